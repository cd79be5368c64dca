"""The regular part of a gear's compliance, on contact cells: that of tooth, rim and neighbours without the near field.

Finite elements give it between the nodes of the flank grid (`fe_ste.elasticity.flank`). Here it is a function of two
points of the flank, made of cubic splines over the profile and over the face width of each.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fe_ste.contact.cells import Cells
from fe_ste.geometry.splines import cubic_coefficients, cubic_knots, cubic_values
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import summing, summing_kernel
from fe_ste.tools.display import Displayed

if TYPE_CHECKING:
    from fe_ste.elasticity.flank import FlankCompliance


#: Indices without a sign: one with a sign counts from the end if it is negative, which numba would ask at each use.
Places: TypeAlias = NDArray[np.uintp]
_ONE = np.uintp(1)
_TWO = np.uintp(2)
_THREE = np.uintp(3)
_FOUR = np.uintp(4)


@dataclass(frozen=True)
class RegularCompliance(Displayed):
    """Regular compliance of one gear: coefficients of cubic splines over profile and face width."""

    table: Floats
    """(blocks, f, l, l f) coefficients by profile and layer of the point that is read, and by layer and profile of
    the loaded one, m/N."""
    number: Integers
    """(t, t) block of (tooth pair read, tooth pair loaded); in a closed ring their difference decides."""
    first_tooth: int
    """Tooth pair of row and column 0 of `number`."""
    knots: Floats
    """Knots over the arc length u = r_b roll^2 / 2, m: over it the flank's nodes are evenly spaced."""
    axial_knots: Floats
    """Knots over the axial position, m."""
    base_radius: float
    """m."""

    @classmethod
    def from_flank(cls, flank: FlankCompliance, sense: int, teeth: Integers, reach: int) -> RegularCompliance:
        """Lay splines through the compliance between the nodes of `flank`.

        Parameters
        ----------
        sense : sense in which this gear's tooth numbers run with the tooth pairs
        teeth : consecutive tooth pairs that may touch
        reach : largest difference of tooth pairs in contact at once
        """
        arc = flank.gear.base_radius * flank.roll**2 / 2.0
        knots = cubic_knots(arc)
        axial_knots = cubic_knots(flank.axial)
        along_profile = cubic_coefficients(arc, knots)
        along_axis = cubic_coefficients(flank.axial, axial_knots)
        keys: list[tuple[int, int]] = []
        number = np.full((len(teeth), len(teeth)), -1, dtype=np.int64)
        for row, read in enumerate(teeth):
            for column, loaded in enumerate(teeth):
                if abs(read - loaded) <= reach:
                    key = flank.key(int(sense * read), int(sense * loaded))
                    if key not in keys:
                        keys.append(key)
                    number[row, column] = keys.index(key)
        blocks = np.array([_coefficients(flank.regular[key], along_axis, along_profile) for key in keys])
        return cls(blocks, number, int(teeth[0]), knots, axial_knots, flank.gear.base_radius)

    def add_to(self, matrix: Floats, groups: Integers, cells: Cells, roll: Floats, axial: Floats) -> None:
        """Add the approach of this flank at each cell under unit forces on each cell, lower triangle.

        Parameters
        ----------
        matrix : (n, n) m/N; above the diagonal anything may be added
        groups : (g + 1,) bounds of the runs of cells of one tooth pair and slice
        roll : (n,) roll angles of the cells on this gear, rad
        axial : (slices,) middle of the contact slices, m
        """
        arc = np.clip(self.base_radius * roll**2 / 2.0, self.knots[0], self.knots[-1])
        own = cells.tooth[groups[:-1]] - self.first_tooth, cells.layer[groups[:-1]], self.number
        tooth, layer, number = (places.astype(np.uintp) for places in own)
        profile = _first_and_weights(arc, self.knots)
        width = _first_and_weights(axial, self.axial_knots)
        _add_regular(matrix, groups.astype(np.uintp), tooth, layer, *profile, *width, self.table, number)

    def _line(self) -> str:
        blocks, splines, layers = self.table.shape[:3]
        return f": {blocks} blocks, {splines} splines over the profile, {layers} over the face width"


def _first_and_weights(at: Floats, knots: Floats) -> tuple[Places, Floats]:
    """First spline and the four spline values at each place."""
    first, values = cubic_values(at, knots)
    return first.astype(np.uintp), values


def _coefficients(block: Floats, along_axis: Floats, along_profile: Floats) -> Floats:
    """Turn nodal values on the flank grid (f l, f l) into spline coefficients (f, l, l f)."""
    profile = len(along_profile)
    layers = len(along_axis)
    read = np.kron(along_profile, along_axis)
    loaded = np.einsum("kl,pf->flkp", along_axis, along_profile).reshape(profile * layers, layers * profile)
    return np.asarray((read @ block @ loaded).reshape(profile, layers, layers * profile))


@summing
def _add_regular(
    matrix: Floats,
    groups: Places,
    tooth: Places,
    layer: Places,
    first: Places,
    weights: Floats,
    axial_first: Places,
    axial_weights: Floats,
    table: Floats,
    number: Places,
) -> None:
    """Add the regular compliance of one gear, see `RegularCompliance.add_to`; ``tooth``, ``layer`` are those of groups.

    The splines of a row's layer are summed for its slice, those of its profile for its cell, and what is left, a
    function of the loaded point, for each slice and at last for each cell of a tooth pair.
    """
    splines = table.shape[1]
    layers = table.shape[2]
    of_slice = np.empty((splines, layers * splines))
    of_cell = np.empty((layers, splines))
    loaded = np.empty(splines)
    for g in range(len(groups) - 1):
        own = first[groups[g] : groups[g + 1]]
        start = 0
        while start <= g:
            end = start  # the run of groups of one tooth pair up to this group
            while end <= g and tooth[end] == tooth[start]:
                end += 1
            block = table[number[tooth[g], tooth[start]]]
            for p in range(own.min(), own.max() + _FOUR):
                _sum_four(of_slice[p], block[p], axial_first[layer[g]], axial_weights[layer[g]])
            for i in range(groups[g], groups[g + 1]):
                _sum_four(of_cell.reshape(of_cell.size), of_slice, first[i], weights[i])
                for h in range(start, end):
                    _sum_four(loaded, of_cell, axial_first[layer[h]], axial_weights[layer[h]])
                    for j in range(groups[h], groups[h + 1]):
                        at = first[j]
                        matrix[i, j] += (
                            weights[j, 0] * loaded[at]
                            + weights[j, 1] * loaded[at + _ONE]
                            + weights[j, 2] * loaded[at + _TWO]
                            + weights[j, 3] * loaded[at + _THREE]
                        )
            start = end


@summing_kernel
def _sum_four(result: Floats, rows: Floats, first: np.uintp, weights: Floats) -> None:
    """Weighted sum of four rows that follow each other."""
    row_0 = rows[first]
    row_1 = rows[first + _ONE]
    row_2 = rows[first + _TWO]
    row_3 = rows[first + _THREE]
    weight_0 = weights[0]
    weight_1 = weights[1]
    weight_2 = weights[2]
    weight_3 = weights[3]
    for q in range(len(result)):
        result[q] = weight_0 * row_0[q] + weight_1 * row_1[q] + weight_2 * row_2[q] + weight_3 * row_3[q]
