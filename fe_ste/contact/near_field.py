"""Near field of the contact cells: both flanks as elastic half-spaces under uniform cell pressures.

The kernels take distances across and along the contact lines, see `fe_ste.elasticity.halfspace`. Frame and signs as in
`fe_ste.contact.kinematics`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from fe_ste.contact.cells import Cells
from fe_ste.contact.kinematics import FlankPair
from fe_ste.elasticity.halfspace import rectangle_integral
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled, summing

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
