"""Units of all files in SI units: a number times its unit, `MM * length_mm`. Keys end with their unit; see `si`."""

from __future__ import annotations

import math
import re
from functools import cache
from typing import Final, NamedTuple

MM: Final = 1e-3
"""A millimetre, m."""
UM: Final = 1e-6
"""A micrometre, m."""
KN: Final = 1e3
"""A kilonewton, N."""
MPA: Final = 1e6
"""A megapascal, Pa."""
GPA: Final = 1e9
"""A gigapascal, Pa."""
RPM: Final = math.pi / 30.0
"""One revolution per minute, rad/s."""
DEG: Final = math.pi / 180.0
"""One degree, rad."""
STANDARD_GRAVITY: Final = 9.80665
"""Standard acceleration of gravity, m/s2 (ISO 80000-3); sensors are often calibrated in multiples of it."""


class Unit(NamedTuple):
    """A unit of a physical quantity."""

    quantity: str
    factor: float
    """Factor to SI."""


_BY_QUANTITY: Final[dict[str, dict[str, float]]] = {
    "number": {"": 1.0, "none": 1.0},
    "share": {"%": 0.01, "percent": 0.01},
    "length": {"m": 1.0, "mm": MM, "um": UM},
    "angle": {"rad": 1.0, "deg": DEG, "°": DEG},
    "speed": {
        "rad/s": 1.0,
        "rad/sec": 1.0,
        "deg/s": DEG,
        "deg/sec": DEG,
        "rpm": RPM,
        "1/min": RPM,
        "Hz": 2.0 * math.pi,
    },
    "velocity": {"m/s": 1.0, "m/sec": 1.0, "mm/s": MM, "km/h": 1.0 / 3.6},
    "acceleration": {"m/s2": 1.0, "m/s/s": 1.0, "mm/s2": MM, "g": STANDARD_GRAVITY},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "time": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0, "hr": 3600.0, "hours": 3600.0},
    "duration": {"years": 365.25 * 86400.0},
    "force": {"N": 1.0, "kN": KN, "MN": 1e6},
    "torque": {"Nm": 1.0, "Nmm": MM, "kNm": KN, "MNm": 1e6},
    "power": {"W": 1.0, "kW": 1e3},
    "conductance": {"W/K": 1.0},
    "stiffness": {"N/m": 1.0, "N/mm": 1e3, "N/um": 1e6},
    "angular stiffness": {"Nm/rad": 1.0, "Nmm/rad": MM},
    "stiffness per width": {"N/mmum": 1e9},
    "damping": {"Ns/m": 1.0},
    "angular damping": {"Nms/rad": 1.0},
    "stress": {"Pa": 1.0, "MPa": MPA, "GPa": GPA, "N/mm2": MPA},
    "mass": {"kg": 1.0},
    "mass per width": {"kg/mm": 1e3},
    "density": {"kg/m3": 1.0, "kg/dm3": 1e3},
    "inertia": {"kgm2": 1.0},
    "unbalance": {"gmm": 1e-6},
    "viscosity": {"mm2/s": 1e-6},
    "temperature": {"C": 1.0},
}
MEASURED_UNITS: Final = {
    "acceleration": ("acceleration", "m/s2 or g"),
    "velocity": ("velocity", "m/s or mm/s"),
    "displacement": ("length", "um"),
    "transmission_error": ("length", "um"),
    "force": ("force", "N"),
    "speed": ("speed", "rpm"),
    "torque": ("torque", "N m"),
}
"""Quantity of the unit of each measured quantity, and units that a message states as examples."""
UNITS: Final = {text: Unit(quantity, size) for quantity, sizes in _BY_QUANTITY.items() for text, size in sizes.items()}
"""Units by their text without blanks, brackets and signs of multiplication and power."""
_UNIT_IN_ANY_CASE: Final = {text.lower(): unit for text, unit in UNITS.items()}
_PLAIN: Final = str.maketrans({"µ": "u", "²": "2", **dict.fromkeys(" ·*-^_()[]", "")})


def unit_of(text: str, any_case: bool = False) -> Unit | None:
    """Look up a unit; None for an unknown one.

    Parameters
    ----------
    any_case : whether capital and small letters are equal; mN is then unknown, because it must not be confused with MN

    Examples
    --------
    >>> unit_of("(kN·m)"), unit_of("N mm / rad"), unit_of("kg / dm^3").factor, unit_of("furlong")
    (Unit(quantity='torque', factor=1000.0), Unit(quantity='angular stiffness', factor=0.001), 1000.0, None)
    >>> unit_of("KN-M"), unit_of("KN-M", any_case=True).factor, unit_of("mNm", any_case=True)
    (None, 1000.0, None)
    """
    plain = re.sub("(?<![a-z])mum", "um", "".join(text.split()).translate(_PLAIN))
    if any_case and not plain.startswith("mN"):
        return _UNIT_IN_ANY_CASE.get(plain.lower())
    return UNITS.get(plain)


def unit_suffix(key: str) -> str:
    """Return the suffix of a key or heading that is a unit; empty if there is none.

    Examples
    --------
    >>> unit_suffix("stiffness_N_m_per_rad"), unit_suffix("row_count")
    ('N_m_per_rad', '')
    """
    parts = key.split("_")
    ends = ("_".join(parts[start:]) for start in range(1, len(parts)))
    return next((end for end in ends if _without_blanks(end) in UNITS), "")


def unit_of_key(key: str) -> Unit | None:
    """Look up the unit that the suffix of a key or heading indicates; None if it indicates none.

    Examples
    --------
    >>> unit_of_key("stiffness_N_m_per_rad"), unit_of_key("viscosity_40_mm2_per_s").factor, unit_of_key("row_count")
    (Unit(quantity='angular stiffness', factor=1.0), 1e-06, None)
    """
    suffix = unit_suffix(key)
    return UNITS[_without_blanks(suffix)] if suffix else None


def si(section: object, key: str) -> float:
    """Value of a key of a section of a file in SI units, according to the unit that the key ends with.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> gear = SimpleNamespace(face_width_mm=170.0, helix_angle_deg=14.0, tip_diameter_mm=None)
    >>> si(gear, "face_width_mm"), round(si(gear, "helix_angle_deg"), 6), optional_si(gear, "tip_diameter_mm")
    (0.17, 0.244346, None)
    """
    value: float = getattr(section, key)
    return value * _factor(key)


def optional_si(section: object, key: str) -> float | None:
    """Value of an optional key in SI units, as `si` returns it; None if it is not specified."""
    return None if getattr(section, key) is None else si(section, key)


@cache
def _factor(key: str) -> float:
    unit = unit_of_key(key)
    assert unit is not None, key
    return unit.factor


def _without_blanks(suffix: str) -> str:
    return suffix.replace("_per_", "/").replace("_", "")
