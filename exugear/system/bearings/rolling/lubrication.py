"""Modified rating life of rolling bearings by ISO 281:2007: viscosity, cleanliness and fatigue limit.

``L_nm = a_ISO L_10`` at 90 % of equal bearings; ``a_ISO`` of the viscosity ratio kappa and of ``e_C C_u / P``
(equations 31 to 36). Radial bearings.
"""

from __future__ import annotations

import math

from exugear.gearbox.sections.connections import BearingType
from exugear.gearbox.sections.lubricant import Cleanliness

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
    double = [math.log10(math.log10(one + _WALTHER)) for one in (viscosity_40, viscosity_100)]
    place = [math.log10(one + _FREEZING) for one in (40.0, 100.0, temperature)]
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
    ratio : kappa; below 0.1 a_ISO is that of 0.1, the least that the standard has
    cleanliness_load : ``e_C C_u / P``

    Examples
    --------
    Dirt takes nine tenths of any life:

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
