"""Frictional moment of rolling bearings by the model of SKF, with the constants of the bearing's series.

The moment M = M_rr + M_sl of rolling and sliding (N mm, mm, N, rpm, mm2/s; d_m the mean of bore and outer diameter)::

    M_rr = phi_ish phi_rs G_rr (nu n)^0.6,   M_sl = G_sl mu_sl
    phi_ish = 1 / (1 + 1.84e-9 (n d_m)^1.28 nu^0.64)
    phi_rs = exp(-3e-8 nu n (d + D) sqrt(K_Z / (2 (D - d))))
    mu_sl = phi_bl 0.12 + (1 - phi_bl) mu_EHL,   phi_bl = exp(-2.6e-8 (nu n)^1.4 d_m)

G_rr and G_sl depend on type, load and series. Drag in an oil bath and contact seals are not included.

Source: SKF, *Rolling bearings*, catalogue 10000 EN (2013 and later), chapter "Friction": the formulas of tables 2a and
2b, the constants of tables 3 and 4 (``friction.csv``), 0.12 for thin films as in its edition "The SKF model for
calculating the frictional moment". Constants of deep-groove, cylindrical and tapered roller bearings were compared with
independent programs; those of other types come from one public transcription.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources

from exugear.gearbox.sections.connections import CatalogueSection
from exugear.gearbox.units import RPM
from exugear.system.bearings.rolling.catalogue import catalogue_rows
from exugear.system.bearings.rolling.rows import BearingError

FULL_COMPLEMENT = "full complement"
"""Series of cylindrical roller bearings without a cage."""
REPLENISHMENT = {
    "deep_groove_ball": 3.1,
    "angular_contact_ball": 4.4,
    "four_point_ball": 3.1,
    "self_aligning_ball": 4.8,
    "cylindrical_roller": 5.1,
    "tapered_roller": 6.0,
    "spherical_roller": 5.5,
    "thrust_spherical_roller": 5.6,
}
"""Constant K_Z by type of bearing."""
FULL_FILM = {"cylindrical_roller": 0.02, "tapered_roller": 0.002}
"""Sliding coefficient mu_EHL of a full film of mineral oil by type; 0.05 for others."""
THIN_FILM = 0.12
"""Sliding coefficient without a film."""

Constants = Mapping[str, float]


@cache
def friction_constants(bearing_type: str) -> Mapping[str, Constants]:
    """Constants R_1 to S_5 of a type of bearing by series; empty for types that the model does not describe.

    Examples
    --------
    >>> friction_constants("cylindrical_roller")["22"]["R_1"]
    1.4e-06
    """
    text = (resources.files(__package__) / "friction.csv").read_text(encoding="utf-8")
    rows = [row for row in csv.DictReader(text.splitlines()) if row["type"] == bearing_type]
    return {
        row["series"]: {key: float(value) for key, value in row.items() if key not in ("type", "series") and value}
        for row in rows
    }


def friction_series(section: CatalogueSection) -> str:
    """Series of a bearing in the table of constants: the stated one, or that of its designation; empty if unknown.

    Raises
    ------
    BearingError
        The stated series is not in the table.

    Examples
    --------
    >>> sizes = {"bore_mm": 100.0, "outer_diameter_mm": 180.0, "width_mm": 46.0}
    >>> friction_series(CatalogueSection(type="cylindrical_roller", designation="NU 2220", **sizes))
    '22'
    >>> friction_series(CatalogueSection(type="tapered_roller", designation="32220 J2 pair, O", **sizes))
    '322'
    """
    known = friction_constants(section.type)
    if section.series:
        if section.series not in known:
            names = ", ".join(known) or "none of this type"
            raise BearingError(f"series = {section.series!r}: unknown for type = {section.type!r}; choose {names}")
        return section.series
    if section.type == "cylindrical_roller" and section.full_complement:
        return FULL_COMPLEMENT
    if len(known) == 1:
        return next(iter(known))
    found = re.search(r"(\d+)\s*([A-Z]*)", section.designation)
    if found is None:
        return ""
    digits, letters = found.groups()
    # The last two digits are the bore code; designations of bores below 10 mm have one.
    series = digits[:-2] if len(digits) > 3 or section.type == "cylindrical_roller" else digits[:-1]
    return next((name for name in (f"{series} {letters}", f"{series} {letters[:1]}", series) if name in known), "")


@dataclass(frozen=True)
class _Operation:
    """What the friction of one bearing depends on, in the units of the formulas."""

    radial: float
    axial: float
    """Loads, N."""
    mean: float
    """Mean of bore and outer diameter, mm."""
    speed: float
    """rpm."""
    static_rating: float
    """N."""
    axial_factor: float
    """Axial load factor Y of tapered roller bearings."""


def frictional_moment(
    section: CatalogueSection,
    radial: float,
    axial: float,
    speed: float,
    viscosity: float,
    static_rating: float,
) -> tuple[float, float, float]:
    """Frictional moment of a bearing, or of both bearings of a pair, N m.

    Parameters
    ----------
    radial, axial : loads, N
    speed : of the inner ring relative to the outer ring, rad/s
    viscosity : kinematic, at the temperature of the oil, m2/s
    static_rating : basic static load rating, of a pair that of both bearings, N

    Returns
    -------
    moment, lowest, highest
        The last two differ if the series is unknown: they are those of all series of the type, and the moment is their
        mean.

    Notes
    -----
    The bearings of a pair share the radial load evenly, in tandem also the axial load. In X or O arrangement one of
    them carries the axial load. In addition, both tapered roller bearings then have the axial load 0.5 F_r / Y that the
    radial load F_r on one of them causes, with the axial load factor Y = 0.4 cot(contact angle).

    Examples
    --------
    >>> sizes = {"bore_mm": 90.0, "outer_diameter_mm": 160.0, "width_mm": 30.0}
    >>> section = CatalogueSection(type="cylindrical_roller", designation="NU 218", **sizes)
    >>> print(round(frictional_moment(section, 22e3, 0.0, 2980 * RPM, 20e-6, 2e5)[0], 3))
    1.658
    """
    # Each bearing's share of the radial load, and axial load.
    share = abs(radial)
    axial_loads = [abs(axial)]
    if section.arrangement != "single":
        share *= 0.5
        axial_loads = [0.5 * abs(axial)] * 2
    factor = 1.0
    caused = 0.0
    if section.type == "tapered_roller":
        factor = 0.4 / math.tan(abs(catalogue_rows(section)[0].contact_angle))
        caused = 0.5 * share / factor
    if section.arrangement in ("X", "O"):
        axial_loads = [abs(axial) + caused, caused]
    mean = 0.5 * (section.bore_mm + section.outer_diameter_mm)
    known = friction_constants(section.type)
    series = friction_series(section)
    n = abs(speed) / RPM
    operations = [_Operation(share, axial, mean, n, static_rating / len(axial_loads), factor) for axial in axial_loads]
    moments = [
        sum(_moment(section, known[name], operation, 1e6 * viscosity) for operation in operations)
        for name in known
        if series in ("", name)
    ]
    return sum(moments) / len(moments), min(moments), max(moments)


def _moment(section: CatalogueSection, k: Constants, at: _Operation, viscosity: float) -> float:
    """Frictional moment of one bearing, N m; viscosity in mm2/s."""
    bore = section.bore_mm
    outer = section.outer_diameter_mm
    product = at.speed * viscosity
    rolling, sliding = _VARIABLES[section.type](k, at)
    if section.type == "thrust_spherical_roller":
        flange = k["S_4"] * at.mean**0.76 * (at.radial + k["S_5"] * at.axial)
        sliding += flange * math.exp(-1e-6 * product**1.4 * at.mean)
    heating = 1.0 / (1.0 + 1.84e-9 * (at.speed * at.mean) ** 1.28 * viscosity**0.64)
    slender = math.sqrt(REPLENISHMENT[section.type] / (2.0 * (outer - bore)))
    starvation = math.exp(-3e-8 * product * (bore + outer) * slender)
    thin = math.exp(-2.6e-8 * product**1.4 * at.mean)
    coefficient = thin * THIN_FILM + (1.0 - thin) * FULL_FILM.get(section.type, 0.05)
    return float(1e-3 * (heating * starvation * rolling * product**0.6 + sliding * coefficient))


def _deep_groove(k: Constants, at: _Operation) -> tuple[float, float]:
    if at.axial == 0.0:
        return k["R_1"] * at.mean**1.96 * at.radial**0.54, k["S_1"] * at.mean**-0.26 * at.radial ** (5.0 / 3.0)
    sine = math.sin(math.radians(24.6 * (at.axial / at.static_rating) ** 0.24))
    rolling = k["R_1"] * at.mean**1.96 * (at.radial + k["R_2"] / sine * at.axial) ** 0.54
    slip = at.radial**5 + k["S_2"] * at.mean**1.5 / sine * at.axial**4
    return rolling, k["S_1"] * at.mean**-0.145 * slip ** (1.0 / 3.0)


def _angular_contact(k: Constants, at: _Operation) -> tuple[float, float]:
    return _with_centrifugal_load(k, at, 1.97, 0.26, 4.0)


def _self_aligning(k: Constants, at: _Operation) -> tuple[float, float]:
    return _with_centrifugal_load(k, at, 2.0, -0.12, 3.5)


def _with_centrifugal_load(
    k: Constants, at: _Operation, rolling: float, sliding: float, centrifugal: float
) -> tuple[float, float]:
    """Variables of ball bearings with a contact angle, by the exponents of the mean diameter."""
    square = at.mean**centrifugal * at.speed**2
    load = at.radial + k["R_3"] * square + k["R_2"] * at.axial
    slip = (at.radial + k["S_3"] * square) ** (4.0 / 3.0) + k["S_2"] * at.axial ** (4.0 / 3.0)
    return k["R_1"] * at.mean**rolling * load**0.54, k["S_1"] * at.mean**sliding * slip


def _cylindrical(k: Constants, at: _Operation) -> tuple[float, float]:
    sliding = k["S_1"] * at.mean**0.9 * at.axial + k["S_2"] * at.mean * at.radial
    return k["R_1"] * at.mean**2.41 * at.radial**0.31, sliding


def _tapered(k: Constants, at: _Operation) -> tuple[float, float]:
    axial = at.axial_factor * at.axial
    rolling = k["R_1"] * at.mean**2.38 * (at.radial + k["R_2"] * axial) ** 0.31
    return rolling, k["S_1"] * at.mean**0.82 * (at.radial + k["S_2"] * axial)


def _spherical(k: Constants, at: _Operation) -> tuple[float, float]:
    of_points = k["R_1"] * at.mean**1.85 * (at.radial + k["R_2"] * at.axial) ** 0.54
    of_lines = k["R_3"] * at.mean**2.3 * (at.radial + k["R_4"] * at.axial) ** 0.31
    if of_points < of_lines:
        return of_points, k["S_1"] * at.mean**0.25 * (at.radial**4 + k["S_2"] * at.axial**4) ** (1.0 / 3.0)
    return of_lines, k["S_3"] * at.mean**0.94 * (at.radial**3 + k["S_4"] * at.axial**3) ** (1.0 / 3.0)


def _thrust_spherical(k: Constants, at: _Operation) -> tuple[float, float]:
    of_points = k["R_1"] * at.mean**1.96 * (at.radial + k["R_2"] * at.axial) ** 0.54
    of_lines = k["R_3"] * at.mean**2.39 * (at.radial + k["R_4"] * at.axial) ** 0.31
    slip = k["S_1"] * at.mean**-0.35 * (at.radial ** (5.0 / 3.0) + k["S_2"] * at.axial ** (5.0 / 3.0))
    return min(of_points, of_lines), min(slip, k["S_3"] * at.mean**0.89 * (at.radial + at.axial))


_VARIABLES: Mapping[str, Callable[[Constants, _Operation], tuple[float, float]]] = {
    "deep_groove_ball": _deep_groove,
    "angular_contact_ball": _angular_contact,
    "four_point_ball": _angular_contact,
    "self_aligning_ball": _self_aligning,
    "cylindrical_roller": _cylindrical,
    "tapered_roller": _tapered,
    "spherical_roller": _spherical,
    "thrust_spherical_roller": _thrust_spherical,
}
