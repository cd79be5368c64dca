"""Load ratings and equivalent loads of rolling bearings from their rows, according to ISO 281 and ISO 76.

The dynamic factor f_c and the static factor f_0 are computed, not read from the tables of the standards: f_c by
the formulas of ISO/TR 1281-1 behind ISO 281:2007, f_0 from the Hertzian contact behind ISO 76:2006 (ISO/TR 10657).
The standards' tables are the tests. The formulas hold in N and mm; arguments and results are SI.

A bearing has `i` rows that are alike. Its ratings are radial forces: contact angles above 45 degrees make a thrust
bearing and are refused. A manufacturer's own ratings may be higher or lower; where they are known, use them.

The equivalent load is the radial load with the same fatigue damage (dynamic), or the same permanent indentation
(static), as the radial and axial load together. Both standards give it as the larger of two sums ``X F_r + Y F_a``; the
limit ``e`` of ISO 281 is the ratio ``F_a / F_r`` at which the two are equal. Opposite contact angles make a double row
bearing (or a pair in X or O), equal ones a single row bearing or a pair in tandem. Moments are neglected: rows that
carry a moment require the reference rating life (`exugear.system.bearings.rolling.life`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from exugear.gearbox.sections.connections import BearingType
from exugear.system.bearings.rolling.rows import (
    BallRow,
    BearingError,
    RollerRow,
    RollingRow,
    raceway_rows,
)

MATERIAL_FACTOR: dict[BearingType, float] = {
    "cylindrical_roller": 1.1,
    "needle_roller": 1.1,
    "tapered_roller": 1.1,
    "spherical_roller": 1.15,
    "deep_groove_ball": 1.3,
    "angular_contact_ball": 1.3,
    "self_aligning_ball": 1.3,
    "four_point_ball": 1.3,
    "thrust_spherical_roller": 1.15,
}
"""b_m of ISO 281:2007, tables 1 and 6: today's steel and making. Needle rollers: with machined rings."""
LARGEST_CONTACT_ANGLE = math.radians(45.0)
"""Above it a bearing is a thrust bearing."""
THRUST: frozenset[BearingType] = frozenset({"thrust_spherical_roller"})
"""Types whose ratings are axial forces."""
LARGE_BALL = 25.4
"""Ball diameter, mm, above which the dynamic rating grows with its power 1.4 instead of 1.8."""
INNER_CONFORMITY, OUTER_CONFORMITY = 0.52, 0.53
"""Widest grooves, radius over ball diameter, that the factors of deep groove and angular contact bearings cover.
Closer grooves do not raise a rating, wider ones lower it (ISO 281:2007, 5.1; ISO 76:2006, 5.1)."""
SELF_ALIGNING_CONFORMITY = 0.53
"""The same for the inner ring of self-aligning ball bearings; their outer raceway is a sphere."""
ELASTIC_MODULUS, POISSON_RATIO = 2.07e5, 0.3
"""Steel of ISO/TR 10657, N/mm^2."""
CONTACT_ANGLES = (5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0)
"""Degrees: lines of the tables for angular contact ball bearings."""
RELATIVE_AXIAL_LOADS = (0.172, 0.345, 0.689, 1.03, 1.38, 2.07, 3.45, 5.17, 6.89)
"""Axial load over number of balls and diameter squared, MPa: columns of the tables."""
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


def basic_dynamic_rating(rows: Sequence[RollingRow], bearing_type: BearingType) -> float:
    """Radial load, N, under which 90 % of equal bearings reach a million revolutions: C_r of ISO 281:2007.

    Parameters
    ----------
    rows : rows of the bearing, alike but for sign of contact angle, position and clearance
    bearing_type : decides on the material factor b_m, and for balls on the reduction factor in f_c

    Returns
    -------
    float
        ``b_m f_c (i L_we cos a)^(7/9) Z^(3/4) D_we^(29/27)`` for rollers, ``b_m f_c (i cos a)^0.7 Z^(2/3) D_w^1.8``
        for balls up to 25.4 mm, ``3.647 ... D_w^1.4`` above.

    Raises
    ------
    BearingError
        If there is no row, rows differ, do not suit the type, or their contact angle exceeds 45 degrees.

    Examples
    --------
    A 6208 with nine balls of 15/32 inch; NSK's catalogue E1102 gives 29.1 kN.

    >>> row = BallRow(element_diameter=11.906e-3, pitch_diameter=60e-3, element_count=9)
    >>> round(basic_dynamic_rating([row], "deep_groove_ball"), -2)
    29100.0
    """
    row = _common_row(rows, bearing_type)
    diameter = 1e3 * row.element_diameter
    cosine = math.cos(row.contact_angle)
    count = row_count(rows, bearing_type)
    if isinstance(row, RollerRow) and bearing_type in THRUST:
        angle = abs(row.contact_angle)
        size = (1e3 * row.effective_length * cosine) ** (7.0 / 9.0) * math.tan(angle)
        size *= row.element_count**0.75 * diameter ** (29.0 / 27.0)
        return float(MATERIAL_FACTOR[bearing_type] * thrust_contact_factor(row.diameter_ratio, angle) * size)
    if isinstance(row, RollerRow):
        length = (count * 1e3 * row.effective_length * cosine) ** (7.0 / 9.0)
        size = length * row.element_count**0.75 * diameter ** (29.0 / 27.0)
        return float(MATERIAL_FACTOR[bearing_type] * line_contact_factor(row.diameter_ratio) * size)
    size = diameter**1.8 if diameter <= LARGE_BALL else 3.647 * diameter**1.4
    # The table of f_c covers outer grooves up to 0.53 by its values for 0.52.
    inner, outer = _static_conformities(row, bearing_type)
    if bearing_type != "self_aligning_ball":
        outer -= OUTER_CONFORMITY - INNER_CONFORMITY
    factor = point_contact_factor(row.diameter_ratio, inner, outer, _ball_reduction(bearing_type, count))
    size *= (count * cosine) ** 0.7 * row.element_count ** (2.0 / 3.0)
    return float(MATERIAL_FACTOR[bearing_type] * factor * size)


def basic_static_rating(rows: Sequence[RollingRow], bearing_type: BearingType) -> float:
    """Radial load, N, at which the most loaded contact reaches the permissible pressure: C_0r of ISO 76:2006.

    Parameters
    ----------
    rows, bearing_type
        As in `basic_dynamic_rating`.

    Returns
    -------
    float
        ``44 (1 - g) i Z L_we D_we cos a`` for rollers (4000 MPa), ``f_0 i Z D_w^2 cos a`` for balls (4200 MPa, in
        self-aligning bearings 4600 MPa), g being `RollingRow.diameter_ratio`.

    Raises
    ------
    BearingError
        As in `basic_dynamic_rating`.

    Examples
    --------
    The 6208 again; NSK's catalogue gives 17.9 kN.

    >>> row = BallRow(element_diameter=11.906e-3, pitch_diameter=60e-3, element_count=9)
    >>> round(basic_static_rating([row], "deep_groove_ball"), -2)
    17900.0
    """
    row = _common_row(rows, bearing_type)
    diameter = 1e3 * row.element_diameter
    elements = row_count(rows, bearing_type) * row.element_count * math.cos(row.contact_angle)
    if isinstance(row, RollerRow) and bearing_type in THRUST:
        loaded = row.element_count * math.sin(abs(row.contact_angle))
        return 220.0 * (1.0 - row.diameter_ratio) * loaded * 1e3 * row.effective_length * diameter
    if isinstance(row, RollerRow):
        return 44.0 * (1.0 - row.diameter_ratio) * elements * 1e3 * row.effective_length * diameter
    return row_static_factor(row, bearing_type) * elements * diameter**2


def equivalent_load(
    rows: Sequence[RollingRow], bearing_type: BearingType, radial: float, axial: float, static_rating: float
) -> float:
    """Equivalent dynamic radial load P_r, N, of ISO 281:2007, tables 3 and 8.

    Parameters
    ----------
    rows : rows of the bearing
    bearing_type : decides on the factors. Four-point bearings take those of double rows.
    radial, axial
        Loads of the bearing, N. The sign of the axial load, positive where it pushes the inner ring towards +z, only
        determines which rows carry it.
    static_rating : C_0r of the bearing, N: the contact angle of ball bearings grows with the axial load over it

    Returns
    -------
    bearings of rollers without contact angle: the radial load, whatever ribs carry along the axis

    Examples
    --------
    Example 3 of NSK's catalogue E1102: a 6208 under 2500 N and 1000 N, for which it finds 3070 N.

    >>> row = BallRow(element_diameter=11.906e-3, pitch_diameter=60e-3, element_count=9)
    >>> round(equivalent_load([row], "deep_groove_ball", 2500.0, 1000.0, 17.9e3), -1)
    3070.0
    """
    factors = _dynamic_factors(rows, bearing_type, axial, static_rating)
    return max(x * abs(radial) + y * abs(axial) for x, y in factors)


def equivalent_static_load(rows: Sequence[RollingRow], bearing_type: BearingType, radial: float, axial: float) -> float:
    """Equivalent static radial load P_0r, N, of ISO 76:2006, tables 2 and 3.

    Parameters
    ----------
    rows, bearing_type, radial, axial
        As in `equivalent_load`.

    Returns
    -------
    the static rating over it is the static safety S_0
    """
    x, y = _static_factors(rows, bearing_type)
    return max(abs(radial), x * abs(radial) + y * abs(axial))


def row_count(rows: Sequence[RollingRow], bearing_type: BearingType) -> int:
    """Rows of rolling elements: `i` of the standards.

    The balls of a four-point bearing touch both halves of the rings. Where each pair of opposite contacts is
    given as a row of its own, rows at one place are one row of balls.
    """
    rows = raceway_rows(rows)
    if bearing_type == "four_point_ball":
        return len({row.axial_position for row in rows})
    return len(rows)


def line_contact_factor(diameter_ratio: float) -> float:
    """f_c of radial roller bearings over gamma: ISO/TR 1281-1 for ISO 281:2007, table 7, reduction factor 0.83."""
    ratio = (1.0 - diameter_ratio) / (1.0 + diameter_ratio)
    inner = 207.9 * 0.83 * diameter_ratio ** (2.0 / 9.0) * (1.0 - diameter_ratio) ** (29.0 / 27.0)
    both = (1.0 + (1.04 * ratio ** (143.0 / 108.0)) ** 4.5) ** (-2.0 / 9.0)
    return float(inner / (1.0 + diameter_ratio) ** 0.25 * both)


def thrust_contact_factor(diameter_ratio: float, contact_angle: float) -> float:
    """f_c of thrust roller bearings with contact angles (rad) below 90 degrees: ISO/TR 1281-1 for ISO 281:2007.

    The reduction factors are lambda = 0.73 and eta = 1 - 0.15 sin(alpha).

    Examples
    --------
    The table has 109.7 at 50 degrees and a ratio of 0.01.

    >>> round(thrust_contact_factor(0.01, math.radians(50.0)), 1)
    109.7
    """
    ratio = (1.0 - diameter_ratio) / (1.0 + diameter_ratio)
    reduction = 0.73 * (1.0 - 0.15 * math.sin(contact_angle))
    inner = 551.13373 * reduction * diameter_ratio ** (2.0 / 9.0) * (1.0 - diameter_ratio) ** (29.0 / 27.0)
    both = (1.0 + ratio ** (143.0 / 108.0 * 4.5)) ** (-2.0 / 9.0)
    return float(inner / (1.0 + diameter_ratio) ** 0.25 * both)


def point_contact_factor(diameter_ratio: float, inner: float, outer: float, reduction: float) -> float:
    """f_c of radial ball bearings: ISO/TR 1281-1 for ISO 281:2007, table 2.

    Parameters
    ----------
    diameter_ratio : gamma of ISO 281
    inner, outer : radii of the grooves over the ball's diameter; 0.52 both in the standard's table
    reduction : reduction factor lambda, see `basic_dynamic_rating`
    """
    ratio = (1.0 - diameter_ratio) / (1.0 + diameter_ratio)
    weaker = 1.04 * ratio**1.72 * groove_ratio(inner, outer)
    both = (1.0 + weaker ** (10.0 / 3.0)) ** -0.3
    slenderness = diameter_ratio**0.3 * (1.0 - diameter_ratio) ** 1.39 / (1.0 + diameter_ratio) ** (1.0 / 3.0)
    grooves = (2.0 * inner / (2.0 * inner - 1.0)) ** 0.41
    return float(98.0665 * 0.41 * reduction * grooves * slenderness * both)


def groove_ratio(inner: float, outer: float) -> float:
    """``(r_i / r_e (2 r_e - D_w) / (2 r_i - D_w))^0.41`` of ISO 281 and ISO/TS 16281, radii over D_w."""
    return float((inner / outer * (2.0 * outer - 1.0) / (2.0 * inner - 1.0)) ** 0.41)


def groove_conformities(row: BallRow, bearing_type: BearingType) -> tuple[float, float]:
    """Radii of inner and outer groove over the ball's diameter; in self-aligning bearings a sphere outside."""
    if bearing_type == "self_aligning_ball":
        return row.inner_conformity, 0.5 * (1.0 / row.diameter_ratio + 1.0)
    return row.inner_conformity, row.outer_conformity


def row_static_factor(row: BallRow, bearing_type: BearingType) -> float:
    """f_0 of a row of balls, N/mm^2: its static rating over number and squared diameter of its balls."""
    pressure = 4600.0 if bearing_type == "self_aligning_ball" else 4200.0
    return static_factor(row.diameter_ratio, *_static_conformities(row, bearing_type), pressure)


def static_factor(diameter_ratio: float, inner: float, outer: float, pressure: float) -> float:
    """f_0 of ISO 76:2006, table 1: a fifth of the ball load at a pressure (N/mm^2), over the diameter squared."""
    towards_inner = 2.0 * diameter_ratio / (1.0 - diameter_ratio)
    towards_outer = -2.0 * diameter_ratio / (1.0 + diameter_ratio)
    loads = [
        _ball_load(across, -1.0 / conformity, pressure)
        for across, conformity in ((towards_inner, inner), (towards_outer, outer))
    ]
    return 0.2 * min(loads)


def _static_conformities(row: BallRow, bearing_type: BearingType) -> tuple[float, float]:
    """Conformities that the ratings count with: the row's own, but none closer than those of the standards."""
    inner, outer = groove_conformities(row, bearing_type)
    if bearing_type == "self_aligning_ball":
        return max(inner, SELF_ALIGNING_CONFORMITY), outer
    return max(inner, INNER_CONFORMITY), max(outer, OUTER_CONFORMITY)


def _ball_load(across: float, along: float, pressure: float) -> float:
    """Load, N, of a ball of 1 mm whose raceway is curved `across` and `along` its groove, 1/mm, at a pressure."""
    import scipy.optimize  # a tenth of a second that a gearbox without ratings need not wait
    import scipy.special

    total = 4.0 + across + along
    difference = (across - along) / total  # F(rho), the relative difference of the curvatures

    def surplus(axis_ratio: float) -> float:
        squared = axis_ratio**2
        first = scipy.special.ellipk(1.0 - 1.0 / squared)
        second = scipy.special.ellipe(1.0 - 1.0 / squared)
        return float(((squared + 1.0) * second - 2.0 * first) - difference * (squared - 1.0) * second)

    # A circle, as on a sphere, is the root at one itself.
    axis_ratio = 1.0 if difference < 1e-9 else float(scipy.optimize.brentq(surplus, 1.0 + 1e-9, 1e6))
    integral = float(scipy.special.ellipe(1.0 - 1.0 / axis_ratio**2))
    compliance = 6.0 * (1.0 - POISSON_RATIO**2) / (math.pi * total * ELASTIC_MODULUS)
    # Half axes a = (axis_ratio^2 integral compliance Q)^(1/3) and a / axis_ratio, pressure 3 Q / (2 pi a b).
    half_axis = (axis_ratio**2 * integral * compliance) ** (1.0 / 3.0)
    return float((2.0 * math.pi * half_axis**2 * pressure / (3.0 * axis_ratio)) ** 3)


def _ball_reduction(bearing_type: BearingType, count: int) -> float:
    """Reduction factor lambda of ISO/TR 1281-1: what real bearings fall short of the theory's even load."""
    if bearing_type == "self_aligning_ball":
        return 1.0
    if bearing_type == "deep_groove_ball" and count > 1:
        return 0.90
    return 0.95


def _common_row(rows: Sequence[RollingRow], bearing_type: BearingType) -> RollerRow | BallRow:
    """Return the row that stands for all but ribs, or refuse rows that the standards cannot rate together."""
    rows = raceway_rows(rows)
    if not rows:
        raise BearingError("load rating: a bearing without rows has none")
    first = rows[0]
    wanted = RollerRow if bearing_type.endswith("_roller") else BallRow
    if not isinstance(first, (RollerRow, BallRow)) or not isinstance(first, wanted):
        raise BearingError(f"load rating: {bearing_type} needs rows of type {wanted.__name__}")
    is_thrust = abs(first.contact_angle) > LARGEST_CONTACT_ANGLE and bearing_type not in THRUST
    if not 0.0 < first.diameter_ratio < 1.0 or is_thrust:
        degrees = math.degrees(abs(first.contact_angle))
        raise BearingError(
            f"load rating: contact_angle = {degrees:.4g} degrees is a thrust bearing; radial ratings apply up to 45"
        )
    if len({_rated_dimensions(row) for row in rows}) > 1:
        raise BearingError("load rating: the rows of one bearing must be alike; rate rows that differ one by one")
    return first


def _rated_dimensions(row: RollingRow) -> tuple[float, ...]:
    length = row.effective_length if isinstance(row, RollerRow) else 0.0
    return row.element_diameter, row.pitch_diameter, row.element_count, abs(row.contact_angle), length


def _dynamic_factors(
    rows: Sequence[RollingRow], bearing_type: BearingType, axial: float, static_rating: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """X and Y up to the limit ratio e, then above it."""
    angle = abs(rows[0].contact_angle)
    double = _double_row(rows, bearing_type)
    if bearing_type == "deep_groove_ball":
        load = _relative_axial_load(rows, bearing_type, axial, static_rating)
        return (1.0, 0.0), (SINGLE_ROW_X[0], float(np.interp(load, RELATIVE_AXIAL_LOADS, SINGLE_ROW_Y[0])))
    if bearing_type in ("angular_contact_ball", "four_point_ball"):
        load = _relative_axial_load(rows, bearing_type, axial, static_rating)
        if double:
            return (1.0, _tabulated(DOUBLE_ROW_SMALL_Y, angle, load)), (
                _interpolate_angle(DOUBLE_ROW_X, angle),
                _tabulated(DOUBLE_ROW_Y, angle, load),
            )
        return (1.0, 0.0), (_interpolate_angle(SINGLE_ROW_X, angle), _tabulated(SINGLE_ROW_Y, angle, load))
    if angle == 0.0:
        return (1.0, 0.0), (1.0, 0.0)
    if bearing_type in THRUST:  # ISO 281:2007, table 11, for more axial load than 1.5 tan(alpha) times the radial one
        return (math.tan(angle), 1.0), (math.tan(angle), 1.0)
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
        y = _interpolate_angle(STATIC_Y, angle)
    elif angle == 0.0:
        return 1.0, 0.0
    elif bearing_type in THRUST:
        return 2.3 * math.tan(angle), 1.0
    else:
        y = 0.22 / math.tan(angle)
    return (1.0, 2.0 * y) if _double_row(rows, bearing_type) else (0.5, y)


def _double_row(rows: Sequence[RollingRow], bearing_type: BearingType) -> bool:
    """Whether the bearing holds the inner ring in both axial directions."""
    signs = {math.copysign(1.0, row.contact_angle) for row in rows}
    return len(signs) > 1 or bearing_type == "four_point_ball"


def _relative_axial_load(
    rows: Sequence[RollingRow], bearing_type: BearingType, axial: float, static_rating: float
) -> float:
    """Axial load per ball that shares it, over the diameter squared, MPa, by ``f_0 F_a / C_0r``."""
    first = rows[0]
    assert isinstance(first, BallRow)
    carrying = sum(row.contact_angle * axial > 0.0 for row in rows) or len(rows)
    share = row_count(rows, bearing_type) * math.cos(first.contact_angle) / min(carrying, row_count(rows, bearing_type))
    return row_static_factor(first, bearing_type) * share * abs(axial) / static_rating


def _tabulated(table: tuple[tuple[float, ...], ...], angle: float, load: float) -> float:
    return _interpolate_angle([float(np.interp(load, RELATIVE_AXIAL_LOADS, line)) for line in table], angle)


def _interpolate_angle(values: Sequence[float], angle: float) -> float:
    """Interpolate linearly between the tabulated contact angles as the standard does; constant beyond them."""
    return float(np.interp(math.degrees(angle), CONTACT_ANGLES, values))
