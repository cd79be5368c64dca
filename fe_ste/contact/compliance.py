"""Compliance of the contact cells of a gear pair: near field of half-spaces, and the regular part of both flanks.

The near field is the surface displacement of an elastic half-space under uniform cell pressures. The regular part is
what finite elements give for the tooth, the rim and the neighbouring teeth, with their own near field taken out
(`fe_ste.elasticity.flank`). Frame and signs as in `fe_ste.contact.kinematics`.

The kernels take distances across and along the contact lines, see `fe_ste.elasticity.halfspace`. Frame and signs as in
`fe_ste.contact.kinematics`.

Finite elements give it between the nodes of the flank grid (`fe_ste.elasticity.flank`). Here it is a function of two
points of the flank, made of cubic splines over the profile and over the face width of each.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fe_ste.contact.kinematics import Cells, FlankPair
from fe_ste.elasticity.halfspace import rectangle_integral
from fe_ste.geometry.profile import cubic_coefficients, cubic_knots, cubic_values
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled, summing, summing_kernel
from fe_ste.tools.display import ReprMixin

if TYPE_CHECKING:
    from fe_ste.elasticity.flank import FlankCompliance


#: Beyond this many half sides a cell acts as its resultant with its second moments (error below 2e-3 of its part).
#: Slices are two half sides apart, so that rounding never decides which formula holds.
_FAR = 5.5

#: Terms of the series of a far load, and the square of the distance across over that along up to which they reach:
#: what is left out is below 0.06^12 = 2e-15.
_TERMS = 12
_SERIES_REACH = 0.06


def _binomials(exponent: float) -> Floats:
    """Coefficients of (1 + x)^exponent up to x^(_TERMS - 1)."""
    steps = (exponent - np.arange(_TERMS - 1)) / np.arange(1, _TERMS)
    return np.cumprod(np.concatenate([[1.0], steps]))


#: Series of 1 / R and, of its second moments, of (2 across^2 - along^2) / 6 R^5 and (2 along^2 - across^2) / 6 R^5, in
#: powers of (across / along)^2.
_INVERSE = _binomials(-0.5)
_FIFTH = _binomials(-2.5)
_FIFTH_BEFORE = np.append(0.0, _FIFTH[:-1])
_MOMENT_ACROSS = (2.0 * _FIFTH_BEFORE - _FIFTH) / 6.0
_MOMENT_ALONG = (2.0 * _FIFTH - _FIFTH_BEFORE) / 6.0


@compiled
def mean_inverse_distance(across: float, along: float, half_across: float, half_along: float) -> float:
    """Mean of 1 / distance over a rectangle: exact near it, else the first terms of its Taylor series.

    Parameters
    ----------
    across, along : position of the point from the middle of the rectangle, m
    half_across, half_along : half sides of the rectangle, m

    Returns
    -------
    1/m
    """
    square = across * across + along * along
    if square > (_FAR * max(half_across, half_along)) ** 2:
        # 1/R averaged to second order: a^2 / 6 and b^2 / 6 times its second derivatives.
        moments = half_across**2 * (2 * across**2 - along**2) + half_along**2 * (2 * along**2 - across**2)
        return (1.0 + moments / (6.0 * square * square)) / math.sqrt(square)
    return rectangle_integral(across, along, half_across, half_along) / (4.0 * half_across * half_along)


def add_near_field(
    matrix: Floats,
    groups: Integers,
    cells: Cells,
    pair: FlankPair,
    axial: Floats,
    flanks: tuple[FlankCompliance, FlankCompliance],
) -> None:
    """Add the surface displacement of both half-spaces at each cell under unit forces on each cell, lower triangle.

    Parameters
    ----------
    matrix : (n, n) m/N; above the diagonal anything may be added
    groups : (g + 1,) bounds of the runs of cells of one tooth pair and slice
    axial : (slices,) middle of the contact slices, m
    flanks : gear 1, gear 2
    """
    materials = [flank.gear.material for flank in flanks]
    surface = np.array([(1 - m.poissons_ratio**2) / (np.pi * m.youngs_modulus) for m in materials])
    _add_half_spaces(
        matrix,
        groups,
        cells.tooth[groups[:-1]],
        axial[cells.layer[groups[:-1]]],
        cells.roll,
        cells.half_across,
        0.5 * (axial[1] - axial[0]) / pair.base_helix_cosine,
        pair,
        surface,
        np.array([flank.gear.face_width / 2 for flank in flanks]),
        np.array([flank.images for flank in flanks]),
    )


@summing
def _add_half_spaces(
    matrix: Floats,
    groups: Integers,
    tooth: Integers,
    axial: Floats,
    roll: Floats,
    half_across: Floats,
    half_along: float,
    pair: FlankPair,
    surface: Floats,
    ends: Floats,
    images: Floats,
) -> None:
    """Add the displacement of both half-spaces; ``tooth`` and ``axial`` are those of groups.

    ``surface`` is (1 - nu^2) / (pi E) of each gear, ``ends`` the axial position of its free end faces (+-), and
    ``images`` the image loads behind them, by gear and end, see
    `fe_ste.elasticity.halfspace.wedge_images`. Distances along the contact
    line are common to two groups, and so is the series of the loads that are far.
    """
    widest = (groups[1:] - groups[:-1]).max()
    widest_half = half_across.max()
    across = np.empty(widest**2)
    half = np.empty(widest**2)
    sums = np.empty(widest**2)
    series = np.empty((2, _TERMS))
    loads = 1 + images.shape[0] * images.shape[1] * images.shape[2]
    along = np.empty(loads)
    strength = np.empty(loads)
    half_length = np.empty(loads)
    _stretch(half_length, half_along, images)
    for g in range(len(groups) - 1):
        for h in range(g + 1):
            if tooth[g] != tooth[h]:
                continue  # a near field ends at its tooth; others feel it through the regular part
            apart = axial[g] - axial[h]
            together = axial[g] + axial[h]
            _place_loads(along, strength, apart, together, pair.base_helix_cosine, surface, ends, images)
            count = 0
            square = 0.0
            for i in range(groups[g], groups[g + 1]):
                for j in range(groups[h], groups[h + 1]):
                    # Distance across the generators, see `fe_ste.elasticity.halfspace`.
                    rolled = roll[i] - roll[j] - pair.twist_1 * apart
                    across[count] = 0.5 * pair.base_radius_1 * (roll[i] + roll[j]) * rolled
                    half[count] = 0.5 * (half_across[i] + half_across[j])  # of both cells: the matrix stays symmetric
                    square = max(square, across[count] ** 2)
                    count += 1
            sums[:count] = 0.0
            series[:] = 0.0
            for load in range(loads):
                if strength[load] == 0.0:
                    continue
                from_afar = _FAR * max(half_length[load], widest_half)
                if abs(along[load]) >= from_afar and square <= _SERIES_REACH * along[load] ** 2:
                    _add_series(series, strength[load], along[load], half_length[load])
                else:
                    for n in range(count):
                        mean = mean_inverse_distance(across[n], along[load], half[n], half_length[load])
                        sums[n] += strength[load] * mean
            _evaluate(sums, series, across, half, count)
            count = 0
            for i in range(groups[g], groups[g + 1]):
                for j in range(groups[h], groups[h + 1]):
                    matrix[i, j] += sums[count]
                    count += 1


@summing
def _stretch(half_length: Floats, half_along: float, images: Floats) -> None:
    """Half lengths of a load and of its images in the distances along that `_place_loads` gives."""
    half_length[0] = half_along
    load = 1
    for body in range(len(images)):
        for end in range(2):
            for image in images[body, end]:
                half_length[load] = half_along * math.sqrt(0.5 * image[1] + 0.25 * image[2])
                load += 1


@summing
def _place_loads(
    along: Floats, strength: Floats, apart: float, together: float, cosine: float, surface: Floats, ends: Floats,
    images: Floats,
) -> None:  # fmt: skip
    """Distances along the contact line and strengths of a load and of its images.

    Load 0 is the cell's own, on both half-spaces. The others are its images behind the end faces of gear 1 and gear 2.
    """
    along[0], strength[0] = apart / cosine, surface[0] + surface[1]
    load = 1
    for body in range(len(images)):
        for end in range(2):
            face = (2.0 * end - 1.0) * ends[body]
            read = 0.5 * (together + apart) - face
            loaded = 0.5 * (together - apart) - face
            for image in images[body, end]:
                square = image[1] * (read * read + loaded * loaded) + image[2] * read * loaded
                along[load], strength[load] = math.sqrt(square) / cosine, image[0] * surface[body]
                load += 1


@summing
def _add_series(series: Floats, strength: float, along: float, half_along: float) -> None:
    """Add a load's series in powers of the square of the distance across: row 1 goes with the half width's square."""
    inverse_square = 1.0 / (along * along)
    scale = strength * math.sqrt(inverse_square)
    moment = half_along * half_along * inverse_square
    for k in range(_TERMS):
        series[0, k] += scale * (_INVERSE[k] + moment * _MOMENT_ALONG[k])
        series[1, k] += scale * inverse_square * _MOMENT_ACROSS[k]
        scale *= inverse_square


@summing
def _evaluate(sums: Floats, series: Floats, across: Floats, half: Floats, count: int) -> None:
    """Add the series to the first `count` sums."""
    for n in range(count):
        square = across[n] * across[n]
        value = series[0, _TERMS - 1]
        moment = series[1, _TERMS - 1]
        for k in range(1, _TERMS):
            value = value * square + series[0, _TERMS - 1 - k]
            moment = moment * square + series[1, _TERMS - 1 - k]
        sums[n] += value + half[n] * half[n] * moment


#: Indices without a sign: one with a sign counts from the end if it is negative, which numba would ask at each use.
Places: TypeAlias = NDArray[np.uintp]
_ONE = np.uintp(1)
_TWO = np.uintp(2)
_THREE = np.uintp(3)
_FOUR = np.uintp(4)


@dataclass(frozen=True)
class RegularCompliance(ReprMixin):
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


def compliance_matrix(
    cells: Cells,
    pair: FlankPair,
    axial: Floats,
    flanks: tuple[FlankCompliance, FlankCompliance],
    regular: tuple[RegularCompliance, RegularCompliance],
) -> Floats:
    """Approach of both flanks at each cell under unit forces on each cell.

    Parameters
    ----------
    axial : (slices,) middle of the contact slices, m
    flanks : gear 1, gear 2
    regular : of these flanks

    Returns
    -------
    (n, n) m/N; symmetric, of which the lower triangle is given and what is above it is not
    """
    matrix = np.zeros((len(cells.tooth), len(cells.tooth)))
    starts = np.flatnonzero(np.diff(cells.tooth * len(axial) + cells.layer)) + 1
    groups = np.concatenate([[0], starts, [len(cells.tooth)]])
    add_near_field(matrix, groups, cells, pair, axial, flanks)
    for part, roll in zip(regular, (cells.roll, cells.gear_roll), strict=True):
        part.add_to(matrix, groups, cells, roll, axial)
    return matrix
