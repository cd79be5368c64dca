"""Rating life of rolling bearings: the basic one of ISO 281 and the basic reference one of ISO/TS 16281.

The basic rating life L10 knows the bearing's load only. The basic reference rating life L10r knows the load
of each ball, or of each lamina of each roller, and with it clearance, preload, tilt, profile and pressure at
the rollers' ends. Both are the life that 90 % of equal bearings reach, in millions of revolutions.

Left out: the modified life a_ISO with lubrication, contamination and fatigue limit (ISO 281:2007, 9.3), all
reliabilities but 90 %, ribs, and damage other than fatigue below the surface.

``L_nm = a_ISO L_10`` at 90 % of equal bearings; ``a_ISO`` of the viscosity ratio kappa and of ``e_C C_u / P``
(equations 31 to 36). Radial bearings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from exugear.gearbox.sections.connections import BearingType
from exugear.gearbox.sections.loads import Cleanliness
from exugear.system.bearings.rolling.ratings import (
    THRUST,
    basic_dynamic_rating,
    groove_conformities,
    groove_ratio,
    row_count,
)
from exugear.system.bearings.rolling.rows import BallRow, BearingError, RollerRow, RollingRow, is_rib
from fe_ste.tools.arrays import Floats

LINE_CONTACT_LIFE = 9.0 / 8.0
POINT_CONTACT_LIFE = 10.0 / 9.0
"""Weibull slopes of rollers and balls: damages of rings and rows add up with this power of 1 / life."""
ROLLER_REDUCTION = 0.83
"""Share of the theoretical capacity that ISO 281 leaves to radial rollers for uneven load along them. ISO/TS 16281
takes it back: the laminae know that load."""


def basic_rating_life(dynamic_rating: float, equivalent_load: float, bearing_type: BearingType) -> float:
    """Compute the basic rating life L10 of ISO 281:2007, millions of revolutions.

    Parameters
    ----------
    dynamic_rating, equivalent_load : C_r and P_r, N. The formula is meant for P_r up to half of C_r.
    bearing_type : balls have the exponent 3, rollers 10/3

    Returns
    -------
    infinite without load

    Examples
    --------
    >>> round(basic_rating_life(29.1e3, 2.5e3, "deep_groove_ball"))
    1577
    """
    if equivalent_load == 0.0:
        return math.inf
    exponent = 10.0 / 3.0 if bearing_type.endswith("_roller") else 3.0
    return float((dynamic_rating / abs(equivalent_load)) ** exponent)


def reference_life(
    rows: Sequence[RollingRow],
    loads: Sequence[Floats],
    bearing_type: BearingType,
    *,
    dynamic_rating: float | None = None,
    inner_ring_turns_against_load: bool = True,
) -> float:
    """Compute the basic reference rating life L10r of ISO/TS 16281:2008, millions of revolutions.

    Parameters
    ----------
    rows : rows of the bearing
    loads
        For each row of rollers the lamina loads, shape (elements, laminae); for each row of balls the loads, shape
        (elements,); N. Several positions of the cage may be stacked: (positions * elements, ...).
    bearing_type : type of the bearing
    dynamic_rating : C_r of the whole bearing, N, where the manufacturer states it; by default `basic_dynamic_rating`
    inner_ring_turns_against_load
        Whether the load is stationary relative to the inner ring, as in planets, instead of the outer ring, as usual.

    Returns
    -------
    infinite where no element carries load

    Raises
    ------
    BearingError
        If the loads do not fit the rows, or the rows cannot be rated.

    Notes
    -----
    Each ring of each row has a capacity: the element load Q_c at which it lives a million revolutions (equations
    for Q_ci and Q_ce with the constants 0.378, 0.364 and 1.038 for rollers, 0.407, 0.389 and 1.044 for balls).
    The load is averaged with the power 4 (balls 3) on the ring that turns against the load, 4.5 (10/3) on
    the other. Laminae count with ``Q_c n^(-7/9)`` and the standard's approximate edge stress `edge_stress_factors`.

    Examples
    --------
    A ball bearing without clearance at its own rating: loads over half of the circle.

    >>> row = BallRow(element_diameter=11.906e-3, pitch_diameter=60e-3, element_count=9)
    >>> cosines = np.maximum(np.cos(2.0 * np.pi * np.arange(9) / 9), 0.0)
    >>> load = 29.1e3 / np.sum(cosines**2.5) * cosines**1.5
    >>> round(reference_life([row], [load], "deep_groove_ball", dynamic_rating=29.1e3), 1)
    1.0
    """
    if len(loads) != len(rows):
        raise BearingError(f"reference life: {len(loads)} arrays of loads for {len(rows)} rows; specify one for each")
    rating = basic_dynamic_rating(rows, bearing_type) if dynamic_rating is None else dynamic_rating
    powers = (4.0, 4.5) if isinstance(rows[0], RollerRow) else (3.0, 10.0 / 3.0)
    inner, outer = powers if inner_ring_turns_against_load else powers[::-1]
    count = row_count(rows, bearing_type)
    if isinstance(rows[0], RollerRow):
        slope = LINE_CONTACT_LIFE
        exponent = 4.5
        row_rating = rating / count ** (7.0 / 9.0)
    else:
        slope = POINT_CONTACT_LIFE
        exponent = 10.0 / 3.0
        row_rating = rating / count**0.7
    damage = 0.0
    for row, load in zip(rows, loads, strict=True):
        if is_rib(row):
            continue
        # Balls count as one lamina, rollers with their edge stress.
        stressed = np.asarray(load, dtype=np.float64)
        wanted = "(elements, laminae)" if isinstance(row, RollerRow) else "(elements,)"
        fits = stressed.ndim == 2 if isinstance(row, RollerRow) else stressed.shape[1:] in ((), (1,))
        if not fits or stressed.size == 0 or len(stressed) % row.element_count:
            raise BearingError(
                f"reference life: loads of shape {stressed.shape} for a row of {row.element_count} elements; specify "
                f"{wanted}"
            )
        stressed = stressed.reshape(len(stressed), -1)
        if not np.all(np.isfinite(stressed)) or np.any(stressed < 0.0):
            raise BearingError("reference life: loads of rolling elements must be finite and not negative")
        stressed = stressed * edge_stress_factors(stressed.shape[1])
        capacities = _ring_capacities(row, row_rating, bearing_type)
        share = stressed.shape[1] ** (-7.0 / 9.0)
        for capacity, power in zip(capacities, (inner, outer), strict=True):
            mean = np.mean((stressed / (share * capacity)) ** power, axis=0) ** (1.0 / power)
            damage += float(np.sum(mean**exponent))
    return math.inf if damage == 0.0 else float(damage ** (-1.0 / slope))


def edge_stress_factors(laminae: int) -> Floats:
    """Pressure at a lamina over that of the plain lamina load, (laminae,): approximation of ISO/TS 16281 for f_k.

    ``1 - 0.01 / ln(1.985 |(2 k - n - 1) / (2 n - 2)|)``: 2.3 at the ends of a roller, 1 in its middle.
    """
    if laminae == 1:
        return np.ones(1)
    along = np.abs(2.0 * np.arange(1, laminae + 1) - laminae - 1.0) / (2.0 * laminae - 2.0)
    factors = np.ones(laminae)
    factors[along > 0.0] -= 0.01 / np.log(1.985 * along[along > 0.0])
    return factors


def life_in_hours(millions_of_revolutions: float, speed: float) -> float:
    """Hours for a life at a speed (rad/s) of the rings against each other; infinite at standstill.

    Examples
    --------
    >>> round(life_in_hours(1577.0, 900.0 * math.pi / 30.0))
    29204
    """
    if speed == 0.0:
        return math.inf
    return 1e6 * millions_of_revolutions * 2.0 * math.pi / (3600.0 * abs(speed))


def minimum_load(dynamic_rating: float, bearing_type: BearingType) -> float:
    """Load, N, below which rolling elements may slide instead of roll: a usual rule, 0.02 C_r or, balls, 0.01 C_r."""
    return (0.02 if bearing_type.endswith("_roller") else 0.01) * dynamic_rating


def _ring_capacities(row: RollingRow, row_rating: float, bearing_type: BearingType) -> tuple[float, float]:
    """Q_ci and Q_ce of ISO/TS 16281, N: element loads at which the inner, outer ring lives a million revolutions."""
    ratio = (1.0 - row.diameter_ratio) / (1.0 + row.diameter_ratio)
    cosine = math.cos(row.contact_angle)
    if isinstance(row, BallRow):
        weaker = (1.044 * ratio**1.72 * groove_ratio(*groove_conformities(row, bearing_type))) ** (10.0 / 3.0)
        common = row_rating / (row.element_count * cosine**0.7)
        return common / 0.407 * (1.0 + weaker) ** 0.3, common / 0.389 * (1.0 + 1.0 / weaker) ** 0.3
    if bearing_type in THRUST:  # ISO/TS 16281 for thrust bearings; without its lambda the life is rather too short
        weaker = ratio ** (143.0 / 108.0 * 4.5)
        common = row_rating / (row.element_count * math.sin(abs(row.contact_angle)))
        return common * (1.0 + weaker) ** (2.0 / 9.0), common * (1.0 + 1.0 / weaker) ** (2.0 / 9.0)
    weaker = (1.038 * ratio ** (143.0 / 108.0)) ** 4.5
    common = row_rating / (ROLLER_REDUCTION * row.element_count * cosine)
    power = 2.0 / 9.0
    return common / 0.378 * (1.0 + weaker) ** power, common / 0.364 * (1.0 + 1.0 / weaker) ** power


CONTAMINATION: dict[Cleanliness, tuple[float, float]] = {
    "extreme": (1.0, 1.0),
    "high": (0.6, 0.8),
    "normal": (0.5, 0.6),
    "slight": (0.3, 0.4),
    "typical": (0.1, 0.2),
    "severe": (0.0, 0.0),
    "very_severe": (0.0, 0.0),
}
"""e_C below and above `LARGE_BEARING`: the lower ends of the ranges of ISO 281:2007, table 13."""
LARGE_BEARING = 0.1
"""Pitch diameter, m."""
LARGEST_FACTOR = 50.0
"""a_ISO is taken no larger (9.3.3)."""
LEAST_RATIO, LARGEST_RATIO = 0.1, 4.0
"""Viscosity ratios: smaller ones have no a_ISO, larger ones count as this."""
_WALTHER = 0.7
"""Added to the viscosity in mm2/s in the rule of Walther (DIN 51563)."""
_FREEZING = 273.15


def viscosity_at(temperature: float, viscosity_40: float, viscosity_100: float) -> float:
    """Kinematic viscosity (mm2/s) at a temperature (degrees Celsius) from those at 40 and 100 degrees.

    Notes
    -----
    ``lg lg (nu + 0.7)`` is straight over ``lg T`` (Ubbelohde and Walther, DIN 51563).

    Examples
    --------
    A mineral oil of class 220 at 80 degrees; the dynamic one that a rating program prints is 30.09 mPa s:

    >>> round(viscosity_at(80.0, 220.0, 19.0) * 0.890 * (1.0 - 0.0007 / 0.890 * 65.0), 1)
    30.1
    """
    double = [math.log10(math.log10(viscosity + _WALTHER)) for viscosity in (viscosity_40, viscosity_100)]
    place = [math.log10(celsius + _FREEZING) for celsius in (40.0, 100.0, temperature)]
    slope = (double[1] - double[0]) / (place[1] - place[0])
    return float(10.0 ** (10.0 ** (double[0] + slope * (place[2] - place[0]))) - _WALTHER)


def viscosity_ratio(viscosity: float, speed: float, pitch_diameter: float) -> float:
    """Viscosity ratio kappa: that of the oil over what is needed (ISO 281:2007, 9.3.3.2).

    Parameters
    ----------
    viscosity : kinematic, in service, mm2/s
    speed : of the rings against each other, rad/s
    pitch_diameter : m

    Examples
    --------
    A bearing of 100 mm at 1500 1/min needs 11.6 mm2/s:

    >>> round(viscosity_ratio(11.62, 1500.0 * math.pi / 30.0, 0.1), 3)
    1.0
    """
    turns = max(abs(speed) * 30.0 / math.pi, 1e-9)
    needed = 45000.0 * turns**-0.83 if turns < 1000.0 else 4500.0 * turns**-0.5
    return float(viscosity / needed * math.sqrt(1e3 * pitch_diameter))


def fatigue_limit(static_rating: float, pitch_diameter: float, bearing_type: BearingType) -> float:
    """Fatigue load limit C_u (N) of a static rating (N) and a pitch diameter (m) (ISO 281:2007, B.3.3, simplified)."""
    large = max(1.0, pitch_diameter / LARGE_BEARING)
    if bearing_type.endswith("_roller"):
        return float(static_rating / 8.2 * large**-0.3)
    return float(static_rating / 22.0 * large**-0.5)


def contamination_factor(cleanliness: Cleanliness, pitch_diameter: float) -> float:
    """e_C of a cleanliness and a pitch diameter (m)."""
    return CONTAMINATION[cleanliness][pitch_diameter >= LARGE_BEARING]


def life_factor(ratio: float, cleanliness_load: float, bearing_type: BearingType) -> float:
    """Life modification factor a_ISO, at most 50.

    Parameters
    ----------
    ratio : kappa; below 0.1 a_ISO is evaluated at 0.1, the minimum of the standard
    cleanliness_load : ``e_C C_u / P``

    Examples
    --------
    Severe contamination reduces any life by nine tenths:

    >>> round(life_factor(2.0, 0.0, "cylindrical_roller"), 6)
    0.1
    """
    kappa = min(max(ratio, LEAST_RATIO), LARGEST_RATIO)
    roller = bearing_type.endswith("_roller")
    constant, factors, outer = (
        (1.5859, (1.3993, 1.2348, 1.2348), 1.0) if roller else (2.5671, (2.2649, 1.9987, 1.9987), 0.83)
    )
    power, exponent = (0.4, -9.185) if roller else (1.0 / 3.0, -9.3)
    if kappa < 0.4:
        place = 0
    elif kappa < 1.0:
        place = 1
    else:
        place = 2
    film = factors[place] / kappa ** (0.054381, 0.19087, 0.071739)[place]
    base = 1.0 - (constant - film) ** outer * max(cleanliness_load, 0.0) ** power
    if base <= 0.0:
        return LARGEST_FACTOR
    return float(min(0.1 * base**exponent, LARGEST_FACTOR))
