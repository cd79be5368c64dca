"""Compliance of the contact cells of a gear pair: near field of half-spaces, and the regular part of both flanks.

The near field is the surface displacement of an elastic half-space under uniform cell pressures. The regular part is
what finite elements give for the tooth, the rim and the neighbouring teeth, with their own near field taken out
(`fe_ste.elasticity.flank`). Frame and signs as in `fe_ste.contact.kinematics`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from fe_ste.contact.cells import Cells
from fe_ste.contact.kinematics import FlankPair
from fe_ste.elasticity.flank import FlankCompliance
from fe_ste.elasticity.halfspace import rectangle_integral
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled, summing

#: Beyond this many half sides a cell acts as its resultant with its second moments (error below 1e-3 of its part).
_FAR = 5.5


@compiled
def _mean_inverse_distance(across: float, along: float, half_across: float, half_along: float) -> float:
    """Mean of 1 / distance over a rectangle: exact near it, else the first terms of its Taylor series."""
    square = across * across + along * along
    if square > (_FAR * max(half_across, half_along)) ** 2:
        # 1/R averaged to second order: a^2 / 6 and b^2 / 6 times its second derivatives.
        moments = half_across**2 * (2 * across**2 - along**2) + half_along**2 * (2 * along**2 - across**2)
        return (1.0 + moments / (6.0 * square * square)) / math.sqrt(square)
    return rectangle_integral(across, along, half_across, half_along) / (4.0 * half_across * half_along)


@summing
def _add_far(
    row: Floats, strength: float, roll: float, across_scale: float, shift: float, along: float, half_across: float,
    half_along: float, rolls: Floats, halves: Floats,
) -> None:  # fmt: skip
    """Add the resultants and second moments of the cells of one slice, seen from afar, to ``row``; no branches."""
    for j in range(len(rolls)):
        # Distance across the generators, see `fe_ste.elasticity.halfspace`: r_b times mean roll times difference.
        across = across_scale * (roll + rolls[j]) * (roll - rolls[j] - shift)
        half = 0.5 * (half_across + halves[j])  # the mean of both cells: the matrix stays symmetric
        inverse = 1.0 / (across * across + along * along)
        moments = half * half * (2 * across * across - along * along)
        moments += half_along * half_along * (2 * along * along - across * across)
        row[j] += strength * math.sqrt(inverse) * (1.0 + moments * inverse * inverse / 6.0)


@compiled
def _add_near(
    row: Floats, strength: float, roll: float, across_scale: float, shift: float, along: float, half_across: float,
    half_along: float, rolls: Floats, halves: Floats,
) -> None:  # fmt: skip
    """Add the cells of one slice, seen from near, to ``row``."""
    for j in range(len(rolls)):
        across = across_scale * (roll + rolls[j]) * (roll - rolls[j] - shift)
        half = 0.5 * (half_across + halves[j])
        row[j] += strength * _mean_inverse_distance(across, along, half, half_along)


@compiled
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
    mirror: Floats,
) -> None:
    """Add the surface displacement of both half-spaces under uniform cell pressures of unit resultant.

    ``groups`` bounds the runs of cells of one tooth pair and slice; distances along the contact line are common to a
    run, and so is whether it is seen from near. ``surface`` is (1 - nu^2) / (pi E) of each gear, ``ends`` the axial
    position of its free end faces (+-), and ``mirror`` the strength of the image loads behind them.
    """
    scale = 0.5 * pair.base_radius_1
    from_afar = _FAR * max(half_along, half_across.max())
    along, strength = np.empty(5), np.empty(5)
    for g in range(len(groups) - 1):
        for h in range(g + 1):
            row_start, column_start = groups[g], groups[h]
            if tooth[row_start] != tooth[column_start]:
                continue  # a near field ends at its tooth; others feel it through the regular part
            apart, together = axial[row_start] - axial[column_start], axial[row_start] + axial[column_start]
            # Load 0 is the cell's own, on both half-spaces. Loads 1 to 4 are its images behind the end faces of gear 1
            # and gear 2: load and image together leave no shear stress on these free faces.
            along[0], strength[0] = apart / pair.base_helix_cosine, surface[0] + surface[1]
            for image in range(4):
                body, sign = image // 2, 2.0 * (image % 2) - 1.0
                along[image + 1] = (together - 2.0 * sign * ends[body]) / pair.base_helix_cosine
                strength[image + 1] = mirror[body] * surface[body]
            rolls, halves = roll[column_start : groups[h + 1]], half_across[column_start : groups[h + 1]]
            shift = pair.twist_1 * apart
            for i in range(row_start, groups[g + 1]):
                row = matrix[i, column_start : groups[h + 1]]
                for load in range(5):
                    if strength[load] == 0.0:
                        continue
                    geometry = (strength[load], roll[i], scale, shift, along[load], half_across[i], half_along)
                    if abs(along[load]) >= from_afar:
                        _add_far(row, *geometry, rolls, halves)
                    else:
                        _add_near(row, *geometry, rolls, halves)


@summing
def _add_regular(
    matrix: Floats,
    groups: Integers,
    tooth: Integers,
    layer: Integers,
    first_spline: Integers,
    weights: Floats,
    table: Floats,
    number: Integers,
    first_tooth: int,
) -> None:
    """Add the regular compliance of one gear, see `SlicedCompliance`; ``groups`` as in `_add_half_spaces`."""
    read = np.empty(table.shape[4])
    for g in range(len(groups) - 1):
        for h in range(g + 1):
            row_start, column_start, column_end = groups[g], groups[h], groups[h + 1]
            block = table[
                number[tooth[row_start] - first_tooth, tooth[column_start] - first_tooth],
                layer[row_start],
                layer[column_start],
            ]
            lowest, highest = first_spline[column_start], first_spline[column_start]
            for j in range(column_start, column_end):
                lowest, highest = min(lowest, first_spline[j]), max(highest, first_spline[j])
            for i in range(row_start, groups[g + 1]):
                # First the splines of the row's cell, then those of each column's: two sums of four instead of one
                # of sixteen, the first of which serves the whole run.
                for b in range(lowest, highest + 4):
                    read[b] = (
                        weights[i, 0] * block[first_spline[i], b]
                        + weights[i, 1] * block[first_spline[i] + 1, b]
                        + weights[i, 2] * block[first_spline[i] + 2, b]
                        + weights[i, 3] * block[first_spline[i] + 3, b]
                    )
                for j in range(column_start, column_end):
                    at = first_spline[j]
                    matrix[i, j] += (
                        weights[j, 0] * read[at]
                        + weights[j, 1] * read[at + 1]
                        + weights[j, 2] * read[at + 2]
                        + weights[j, 3] * read[at + 3]
                    )


@compiled
def _mirror_lower(matrix: Floats) -> None:
    for i in range(len(matrix)):
        for j in range(i):
            matrix[j, i] = matrix[i, j]


@dataclass(frozen=True)
class SlicedCompliance:
    """Regular compliance of one gear, contracted onto the contact slices; spline coefficients over the roll arc.

    Attributes
    ----------
    table : ndarray (blocks, slices, slices, f, f)
        m/N.
    number : ndarray (t, t)
        Block of (tooth pair read, tooth pair loaded); in a closed ring their difference decides.
    first_tooth : int
        Tooth pair of row and column 0 of `number`.
    knots : ndarray
        Knots of the cubic splines over the arc length u = r_b roll^2 / 2, m.
    base_radius : float
        m.
    """

    table: Floats
    number: Integers
    first_tooth: int
    knots: Floats
    base_radius: float

    @classmethod
    def from_flank(
        cls, flank: FlankCompliance, axial: Floats, sense: int, teeth: Integers, reach: int
    ) -> SlicedCompliance:
        """Contract `flank` onto slices.

        Parameters
        ----------
        flank : FlankCompliance
        axial : ndarray
            Middle of the slices, m.
        sense : int
            Sense in which this gear's tooth numbers run with the tooth pairs.
        teeth : ndarray
            Consecutive tooth pairs that may touch.
        reach : int
            Largest difference of tooth pairs in contact at once.
        """
        # Over the arc length of the involute the flank's nodes are evenly spaced, which suits the splines.
        arc = flank.gear.base_radius * flank.roll**2 / 2.0
        along_roll = make_interp_spline(arc, np.eye(len(arc)), k=3)
        at_slices = make_interp_spline(flank.axial, np.eye(len(flank.axial)), k=3)(axial)
        keys: list[tuple[int, int]] = []
        number = np.full((len(teeth), len(teeth)), -1, dtype=np.int64)
        for row, read in enumerate(teeth):
            for column, loaded in enumerate(teeth):
                if abs(read - loaded) <= reach:
                    key = flank.key(int(sense * read), int(sense * loaded))
                    if key not in keys:
                        keys.append(key)
                    number[row, column] = keys.index(key)
        blocks = [_contracted(flank.regular[key], at_slices, along_roll.c) for key in keys]
        return cls(np.array(blocks), number, int(teeth[0]), along_roll.t, flank.gear.base_radius)

    def weights(self, roll: Floats) -> tuple[Integers, Floats]:
        """First spline and the four spline values at each roll angle."""
        arc = np.clip(self.base_radius * roll**2 / 2.0, self.knots[0], self.knots[-1])
        rows = BSpline.design_matrix(arc, self.knots, 3)
        return rows.indices.reshape(-1, 4)[:, 0].astype(np.int64), rows.data.reshape(-1, 4)

    def __repr__(self) -> str:
        """Return one short line."""
        blocks, slices, _, splines, _ = self.table.shape
        return f"<SlicedCompliance: {blocks} blocks, {slices} slices, {splines} splines over the profile>"


def _contracted(block: Floats, at_slices: Floats, to_splines: Floats) -> Floats:
    """Turn nodal values on the flank grid (f l, f l) into spline coefficients at the slices (k, k, f, f)."""
    rolls, layers = len(to_splines), at_slices.shape[1]
    values = block.reshape(rolls, layers, rolls, layers)
    values = np.einsum("ka,paqb->pkqb", at_slices, values, optimize=True)
    values = np.einsum("lb,pkqb->klpq", at_slices, values, optimize=True)
    values = np.einsum("rp,klpq->klrq", to_splines, values, optimize=True)
    return np.ascontiguousarray(np.einsum("sq,klrq->klrs", to_splines, values, optimize=True))


def compliance_matrix(
    cells: Cells,
    pair: FlankPair,
    axial: Floats,
    flanks: tuple[FlankCompliance, FlankCompliance],
    sliced: tuple[SlicedCompliance, SlicedCompliance],
) -> Floats:
    """Approach of both flanks at each cell under unit forces on each cell, (n, n), m/N."""
    matrix = np.zeros((len(cells.tooth), len(cells.tooth)))
    materials = [flank.gear.material for flank in flanks]
    surface = np.array([(1 - m.poissons_ratio**2) / (np.pi * m.youngs_modulus) for m in materials])
    starts = np.flatnonzero(np.diff(cells.tooth * len(axial) + cells.layer)) + 1
    groups = np.concatenate([[0], starts, [len(cells.tooth)]])
    _add_half_spaces(
        matrix,
        groups,
        cells.tooth,
        axial[cells.layer],
        cells.roll,
        cells.half_across,
        0.5 * (axial[1] - axial[0]) / pair.base_helix_cosine,
        pair,
        surface,
        np.array([flank.gear.face_width / 2 for flank in flanks]),
        np.array([flank.mirror for flank in flanks]),
    )
    for part, roll in zip(sliced, (cells.roll, cells.gear_roll), strict=True):
        first_spline, weights = part.weights(roll)
        blocks = (part.table, part.number, part.first_tooth)
        _add_regular(matrix, groups, cells.tooth, cells.layer, first_spline, weights, *blocks)
    _mirror_lower(matrix)
    return matrix
