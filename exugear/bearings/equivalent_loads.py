"""Equivalent dynamic load by ISO 281 and equivalent static load by ISO 76 of radial rolling bearings.

The equivalent load is the radial load that would wear the bearing out, or press its rolling elements in, as the
radial and axial load together do. Both standards give it as the larger of two sums ``X F_r + Y F_a``; the limit
``e`` of ISO 281 is the ratio ``F_a / F_r`` at which the two are equal. Moments are not in it: rows that carry a
moment are for the reference rating life (`exugear.bearings.life`).

Opposite contact angles make a double row bearing (or a pair in X or O), equal ones a single row bearing or
a pair in tandem.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from exugear.bearings.ratings import BearingType
from exugear.bearings.rows import RollingRow

CONTACT_ANGLES = (5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0)
"""Degrees: lines of the tables for angular contact ball bearings."""
RELATIVE_AXIAL_LOADS = (0.172, 0.345, 0.689, 1.03, 1.38, 2.07, 3.45, 5.17, 6.89)
"""Axial load over number of balls and diameter squared, MPa: columns of the tables, equal to f_0 F_a / C_0r."""
SINGLE_ROW_X = (0.56, 0.46, 0.44, 0.43, 0.41, 0.39, 0.37, 0.35, 0.33)
SINGLE_ROW_Y = (
    (2.30, 1.99, 1.71, 1.55, 1.45, 1.31, 1.15, 1.04, 1.00),
    (1.88, 1.71, 1.52, 1.41, 1.34, 1.23, 1.10, 1.01, 1.00),
    (1.47, 1.40, 1.30, 1.23, 1.19, 1.12, 1.02, 1.00, 1.00),
    *((value,) * 9 for value in (1.00, 0.87, 0.76, 0.66, 0.57, 0.50)),
)
"""Factors of single rows above ``e``, ISO 281:2007, table 3. Those at 5 degrees are those of deep groove bearings."""
DOUBLE_ROW_X = (0.78, 0.75, 0.72, 0.70, 0.67, 0.63, 0.60, 0.57, 0.54)
DOUBLE_ROW_Y = (
    (3.74, 3.23, 2.78, 2.52, 2.36, 2.13, 1.87, 1.69, 1.63),
    (3.06, 2.78, 2.47, 2.29, 2.18, 2.00, 1.79, 1.64, 1.63),
    (2.39, 2.28, 2.11, 2.00, 1.93, 1.82, 1.66, 1.63, 1.63),
    *((value,) * 9 for value in (1.63, 1.41, 1.24, 1.07, 0.93, 0.81)),
)
DOUBLE_ROW_SMALL_Y = (
    (2.78, 2.40, 2.07, 1.87, 1.75, 1.58, 1.39, 1.26, 1.21),
    (2.18, 1.98, 1.76, 1.63, 1.55, 1.42, 1.27, 1.17, 1.16),
    (1.65, 1.57, 1.46, 1.38, 1.34, 1.26, 1.14, 1.12, 1.12),
    *((value,) * 9 for value in (1.09, 0.92, 0.78, 0.66, 0.55, 0.47)),
)
"""Factors of double rows above ``e``, and Y up to ``e`` (X is one there), ISO 281:2007, table 3."""
STATIC_Y = (0.52, 0.50, 0.46, 0.42, 0.38, 0.33, 0.29, 0.26, 0.22)
"""Y_0 of single rows with X_0 = 0.5, ISO 76:2006, table 2; double rows have twice both."""


def equivalent_dynamic_load(
    rows: Sequence[RollingRow], bearing_type: BearingType, radial: float, axial: float
) -> float:
    """Equivalent dynamic radial load P_r, N, of ISO 281:2007, tables 3 and 8.

    Parameters
    ----------
    rows : sequence of RollingRow
        Rows of the bearing.
    bearing_type : BearingType
        Decides on the factors. Four-point bearings take those of double rows.
    radial, axial : float
        Loads of the bearing, N. The sign of the axial load, positive where it pushes the inner ring towards +z,
        only tells which rows carry it.

    Returns
    -------
    float
        Bearings of rollers without contact angle: the radial load, whatever ribs carry along the axis.

    Examples
    --------
    Example 3 of NSK's catalogue E1102: a 6208 under 2500 N and 1000 N, for which it finds 3070 N.

    >>> from exugear.bearings.rows import BallRow
    >>> row = BallRow(element_diameter=11.906e-3, pitch_diameter=60e-3, element_count=9)
    >>> round(equivalent_dynamic_load([row], "deep_groove_ball", 2500.0, 1000.0), -1)
    3070.0
    """
    factors = _dynamic_factors(rows, bearing_type, axial)
    return max(x * abs(radial) + y * abs(axial) for x, y in factors)


def equivalent_static_load(rows: Sequence[RollingRow], bearing_type: BearingType, radial: float, axial: float) -> float:
    """Equivalent static radial load P_0r, N, of ISO 76:2006, tables 2 and 3.

    Parameters
    ----------
    rows, bearing_type, radial, axial
        As in `equivalent_dynamic_load`.

    Returns
    -------
    float
        The static rating over it is the static safety S_0.
    """
    x, y = _static_factors(rows, bearing_type)
    return max(abs(radial), x * abs(radial) + y * abs(axial))


def _dynamic_factors(
    rows: Sequence[RollingRow], bearing_type: BearingType, axial: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """X and Y up to the limit ratio e, then above it."""
    angle = abs(rows[0].contact_angle)
    double = _double_row(rows, bearing_type)
    if bearing_type == "deep_groove_ball":
        load = _relative_axial_load(rows, axial)
        return (1.0, 0.0), (SINGLE_ROW_X[0], float(np.interp(load, RELATIVE_AXIAL_LOADS, SINGLE_ROW_Y[0])))
    if bearing_type in ("angular_contact_ball", "four_point_ball"):
        load = _relative_axial_load(rows, axial)
        if double:
            return (1.0, _tabulated(DOUBLE_ROW_SMALL_Y, angle, load)), (
                _at_angle(DOUBLE_ROW_X, angle),
                _tabulated(DOUBLE_ROW_Y, angle, load),
            )
        return (1.0, 0.0), (_at_angle(SINGLE_ROW_X, angle), _tabulated(SINGLE_ROW_Y, angle, load))
    if angle == 0.0:
        return (1.0, 0.0), (1.0, 0.0)
    cotangent = 1.0 / math.tan(angle)
    if not double:
        return (1.0, 0.0), (0.4, 0.4 * cotangent)
    small, large = (0.42, 0.65) if bearing_type == "self_aligning_ball" else (0.45, 0.67)
    return (1.0, small * cotangent), (large, large * cotangent)


def _static_factors(rows: Sequence[RollingRow], bearing_type: BearingType) -> tuple[float, float]:
    angle = abs(rows[0].contact_angle)
    if bearing_type == "deep_groove_ball":
        return 0.6, 0.5
    if bearing_type in ("angular_contact_ball", "four_point_ball"):
        y = _at_angle(STATIC_Y, angle)
    elif angle == 0.0:
        return 1.0, 0.0
    else:
        y = 0.22 / math.tan(angle)
    return (1.0, 2.0 * y) if _double_row(rows, bearing_type) else (0.5, y)


def _double_row(rows: Sequence[RollingRow], bearing_type: BearingType) -> bool:
    """Whether the bearing holds the inner ring in both axial directions."""
    signs = {math.copysign(1.0, row.contact_angle) for row in rows}
    return len(signs) > 1 or bearing_type == "four_point_ball"


def _relative_axial_load(rows: Sequence[RollingRow], axial: float) -> float:
    """Axial load per ball that shares it, over the diameter squared, MPa."""
    carrying = sum(row.contact_angle * axial > 0.0 for row in rows) or len(rows)
    return 1e-6 * abs(axial) / (carrying * rows[0].element_count * rows[0].element_diameter ** 2)


def _tabulated(table: tuple[tuple[float, ...], ...], angle: float, load: float) -> float:
    return _at_angle([float(np.interp(load, RELATIVE_AXIAL_LOADS, line)) for line in table], angle)


def _at_angle(values: Sequence[float], angle: float) -> float:
    """Value between the tabulated contact angles, linear as the standard says, constant beyond them."""
    return float(np.interp(math.degrees(angle), CONTACT_ANGLES, values))
