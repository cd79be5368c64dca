"""Names and units over the versions of REXS: what a thing is called today, and what its unit is worth."""

from __future__ import annotations

import math

LEAST_VERSION, LAST_VERSION = (1, 0), (2, 0)
"""Versions that are read; those in between changed names, which the tables below tell."""

TYPES = {
    "flank_geometry": "cylindrical_gear_flank",
    "stage_gear_data": "cylindrical_stage_gear_data",
    "fixed_coupling": "coupling",
}
"""Old name of a component's type to the present one."""

ATTRIBUTES = {
    "axial_backlash": "operating_axial_bearing_clearance",
    "base_circle_diameter": "base_diameter",
    "dynamic_capacity": "radial_dynamic_load_rating",
    "load_duration_fraction": "operating_time_fraction",
    "radial_backlash": "operating_radial_bearing_clearance",
    "reference_circle_diameter": "reference_diameter_cylindrical_gear",
    "reference_diameter": "reference_diameter_rolling_bearing",
    "static_capacity": "radial_static_load_rating",
    "tip_radius_factor": "tip_corner_radius_factor_reference_profile",
}
"""Old name of an attribute to the present one, for those that are read."""

ROLES = {"side_1": "inner_part", "side_2": "outer_part"}
"""Old name of a role in a relation to the present one."""

RELATIONS = {"coupling": "side"}
"""Old name of a relation to the present one."""

_UNITS = {
    "none": ("number", 1.0),
    "%": ("share", 0.01),
    "mum": ("length", 1e-6),
    "mm": ("length", 1e-3),
    "m": ("length", 1.0),
    "deg": ("angle", math.pi / 180.0),
    "°": ("angle", math.pi / 180.0),
    "rad": ("angle", 1.0),
    "1 / min": ("speed", math.pi / 30.0),
    "rad / s": ("speed", 1.0),
    "N": ("force", 1.0),
    "kN": ("force", 1e3),
    "N mm": ("torque", 1e-3),
    "N m": ("torque", 1.0),
    "kN m": ("torque", 1e3),
    "W": ("power", 1.0),
    "kW": ("power", 1e3),
    "N / m": ("stiffness", 1.0),
    "N / mm": ("stiffness", 1e3),
    "N / mum": ("stiffness", 1e6),
    "N mm / rad": ("angular stiffness", 1e-3),
    "N m / rad": ("angular stiffness", 1.0),
    "Pa": ("stress", 1.0),
    "MPa": ("stress", 1e6),
    "N / mm^2": ("stress", 1e6),
    "kg / dm^3": ("density", 1e3),
    "kg / m^3": ("density", 1.0),
    "kg": ("mass", 1.0),
    "kg m^2": ("inertia", 1.0),
    "m / s^2": ("acceleration", 1.0),
    "h": ("time", 3600.0),
    "s": ("time", 1.0),
    "mm^2 / s": ("viscosity", 1e-6),
}


def unit_factor(unit: str, wanted: str) -> float | None:
    """Factor from a unit to a wanted one; None if they do not measure the same or the unit is unknown.

    An empty unit is the wanted one: some programs leave it out.

    Examples
    --------
    >>> unit_factor("mum", "mm"), unit_factor("", "mm"), unit_factor("furlong", "mm")
    (0.001, 1.0, None)
    """
    unit = " ".join(unit.split())
    if unit in ("", "none", wanted):
        return 1.0
    if unit not in _UNITS or _UNITS[unit][0] != _UNITS[wanted][0]:
        return None
    ratio = _UNITS[unit][1] / _UNITS[wanted][1]
    return float(f"{ratio:.15g}")


def degree_sign(version: tuple[int, int]) -> str:
    """Return how a version writes degrees."""
    if version < (1, 4):
        return "°"
    return "deg"
