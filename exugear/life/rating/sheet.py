"""Rating sheet of a gearbox: each gear and flank to ISO 6336, with finite element results and unrated factors."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Mesh
from exugear.gearbox.sections.entries import HOURS_PER_YEAR
from exugear.gearbox.sections.loads import RatingSection
from exugear.gearbox.units import MM, RPM, unit_of
from exugear.gearbox.variant import Variant
from exugear.life.dynamic_factors import stated_factors
from exugear.life.gear_life import auxiliary_factor, check_strengths, flank_lives, is_modified
from exugear.life.life import NOT_RATED, checked_loads, rating_of
from exugear.life.load_spectrum.counted import (
    FLANKS,
    CountedLoads,
    ToothExposure,
    bearing_turns,
    distinct,
    forces_of_families,
    tooth_exposures,
)
from exugear.life.load_spectrum.counting import LoadPoints, load_duration
from exugear.life.load_spectrum.sources import LoadSource
from exugear.life.rating.standard import FlankRules, MeshLoads, rate
from exugear.life.static_balance import ActingLoads, StaticBalance, acting_loads, static_balance
from exugear.system.gearbox_checks import lacking, usual_variant
from exugear.system.system import Assembly
from fe_ste.standards.iso6336 import Edition, outside_scope
from fe_ste.standards.pitting import UNMODIFIED, tangential_force
from fe_ste.standards.tooth_root import root_stress_factors
from fe_ste.tools.display import ReprMixin, torque_text

if TYPE_CHECKING:
    import xarray as xr

    from fe_ste.root_stress import MeshCycleStress

OTHER_EDITION: Mapping[Edition, Edition] = {"ISO 6336:2019": "ISO 6336:2006", "ISO 6336:2006": "ISO 6336:2019"}
"""Edition that is compared with the edition of the file."""
LISTED_DIFFERENCE = 0.01
"""Relative difference above which the value of the other edition is listed."""
LEAST_FORCE = 1.0
"""Tangential force, N, below which a mesh counts as unloaded and is not rated."""
FINITE_ELEMENTS = ("sigma_H", "sigma_F", "K_Hbeta", "S_H", "S_F")
"""Results listed next to the standard's, from finite element contact and root gauges."""
UNITS: Mapping[str, str] = {
    **dict.fromkeys(("sigma_H0", "sigma_H", "sigma_HG", "sigma_F0", "sigma_F", "sigma_FG"), "MPa"),
    **dict.fromkeys(("sigma_Hlim", "sigma_Flim"), "MPa"),
    **dict.fromkeys(("c'", "c_gammaalpha"), "N/(mm um)"),
    "F_t": "kN",
    "torque": "kN m",
    "load_torque": "kN m",
    "m_red": "kg/mm",
    "n_E1": "rpm",
    "v": "m/s",
    "F_betax": "um",
    "Z_E": "N^0.5/mm",
}
"""Units on the sheet by symbol; other values are dimensionless."""


def sheet_value(name: str, value: float) -> float:
    """Convert a value from SI to its unit on the sheet.

    Examples
    --------
    >>> sheet_value("sigma_H", 1.2e9), sheet_value("S_H", 1.1)
    (1200.0, 1.1)
    """
    unit = UNITS.get(name, "")
    if unit == "N^0.5/mm":  # a root of a stress in MPa
        return value * MM
    known = unit_of(unit)
    return value if known is None else value / known.factor


@dataclass(frozen=True, eq=False)
class FlankSheet:
    """One flank of a gear in one family of meshes."""

    gear: str
    family: str
    flank: str
    member: int
    """{0, 1}"""
    standard: Mapping[str, float]
    """By standard symbol, SI; see `exugear.life.rating.standard.rate`."""
    finite_elements: Mapping[str, float]
    """`FINITE_ELEMENTS`, SI; empty if not known."""
    lacking: Mapping[str, str]
    """Reasons why factors are not rated."""
    remarks: tuple[str, ...]
    """Conditions outside the range of the standard."""
    sense: int = 1
    """1 where the load has the sense of the static load, -1 where it is reversed."""
    other_edition: Mapping[str, float] = field(default_factory=dict)
    """Values of the other edition that differ by more than 1 %, SI."""


@dataclass(frozen=True, eq=False)
class RatingSheet(ReprMixin, line=" by {edition}: {flanks!n} flanks"):
    """All loaded flanks, their loads, and unrated items."""

    edition: str
    load: str
    flanks: tuple[FlankSheet, ...]
    shortfalls: tuple[str, ...]
    assumptions: tuple[str, ...]
    left_out: tuple[str, ...] = NOT_RATED
    other_edition: str = ""
    """Edition of the values in `FlankSheet.other_edition`."""

    def summary(self) -> dict[str, Any]:
        """Return the values for JSON, with units in the keys; NaN is omitted, infinite values are text."""
        return {
            "edition": self.edition,
            "other_edition": self.other_edition,
            "load": self.load,
            "flanks": [
                {
                    "gear": flank.gear,
                    "mesh": flank.family,
                    "flank": flank.flank,
                    "standard": _plain_values(flank.standard),
                    "other_edition": _plain_values(flank.other_edition),
                    "finite_elements": _plain_values(flank.finite_elements),
                    "not_rated": dict(flank.lacking),
                    "remarks": list(flank.remarks),
                }
                for flank in self.flanks
            ],
            "shortfalls": list(self.shortfalls),
            "assumptions": list(self.assumptions),
            "left_out": list(self.left_out),
        }


def _plain_values(figures: Mapping[str, float]) -> dict[str, float | str]:
    programs: dict[str, float | str] = {}
    for name, value in figures.items():
        unit = UNITS.get(name, "").replace("N^0.5/mm", "root_MPa")
        suffix = unit.replace("/", "_per_").replace(" ", "_").replace("(", "").replace(")", "")
        key = f"{name.replace(chr(39), '_single')}_{suffix}".rstrip("_")
        if not math.isnan(value):
            programs[key] = "infinite" if math.isinf(value) else sheet_value(name, value)
    return programs


def _flank(
    gearbox: Gearbox,
    rating: RatingSection,
    counted: CountedLoads,
    acting: ActingLoads,
    balance: StaticBalance,
    tooth: ToothExposure,
    sense: int,
    beside: Mapping[str, float],
) -> FlankSheet | None:
    """Rate one flank; None if its meshes are unloaded."""
    rules = _rules(gearbox, rating, counted, tooth)
    loads = _mesh_loads(gearbox, acting, balance, tooth, rules, sense)
    if not len(loads.force):
        return None
    found = rate(rules, loads)
    other = rate(replace(rules, edition=OTHER_EDITION[rules.edition]), loads)
    lacking = dict(rules.lacking())
    if rules.strength is None:
        lacking["S_H, S_F"] = f"not rated: no strength; add [rating.gears.{tooth.gear}]"
    return FlankSheet(
        gear=tooth.gear,
        family=tooth.family,
        flank=FLANKS[sense * tooth.flank],
        member=tooth.member,
        standard=found,
        finite_elements=beside,
        lacking=lacking,
        remarks=root_stress_factors(rules.pair, tooth.member).outside_validity,
        sense=sense * _static_sense(gearbox, counted.body, gearbox.meshes[tooth.meshes[0]].name),
        other_edition={name: value for name, value in other.items() if _differs(found.get(name, math.nan), value)},
    )


def _static_sense(gearbox: Gearbox, body: str, mesh: str) -> int:
    """Sign of the torque on a body that loads a mesh as the static load does."""
    static = gearbox.train.static_mesh_forces()[mesh]
    return -1 if static * gearbox.train.static_mesh_forces({body: 1.0})[mesh] < 0.0 else 1


def _differs(value: float, other: float) -> bool:
    """Return whether both are numbers that differ by more than `LISTED_DIFFERENCE`."""
    if not (math.isfinite(value) and math.isfinite(other)):
        return False
    return abs(other - value) > LISTED_DIFFERENCE * abs(value)


def _rules(gearbox: Gearbox, rating: RatingSection, counted: CountedLoads, tooth: ToothExposure) -> FlankRules:
    family = [mesh for mesh in gearbox.meshes if mesh.family == tooth.family]
    pair = family[0].pair
    bodies = gearbox.named_bodies
    rolling = gearbox.train.rolling_speeds(counted.body, 1.0)
    around = [
        max(
            sum(other.family == one.family and _holder(other, side) == _holder(one, side) for other in gearbox.meshes)
            for one in family
        )
        for side in (0, 1)
    ]
    strengths = rating.gears.get(pair.pinion.name), rating.gears.get(pair.gear.name)
    return FlankRules(
        pair=pair,
        member=tooth.member,
        strengths=strengths,
        application_factor=rating.application_factor if gearbox.case.loads is None else 1.0,
        stated_dynamic_factor=rating.dynamic_factor or rating.minimum_dynamic_factor or 1.0,
        viscosity=gearbox.viscosity_40,
        meshes=(around[0], around[1]),
        free_bore=bodies[tooth.holder].planet_of is not None,
        ring_held=rolling.get(family[0].gear, 0.0) == 0.0,
        edition=rating.edition,
        f_ZCa=auxiliary_factor(gearbox, rating, pair),
    )


def _holder(mesh: Mesh, side: int) -> str:
    return (mesh.pinion, mesh.gear)[side]


def _mesh_loads(
    gearbox: Gearbox, acting: ActingLoads, balance: StaticBalance, tooth: ToothExposure, rules: FlankRules, sense: int
) -> MeshLoads:
    """Return the loads of the meshes of a family, from the static balance."""
    points = acting.points
    same_sense = np.sign(points.torque) == sense
    torque = points.torque[same_sense]
    hub = points.other[same_sense]
    numbers = [number for number, mesh in enumerate(gearbox.meshes) if mesh.family == tooth.family]
    forces = np.abs(balance.at(balance.mesh_force, torque, hub)[..., numbers])
    plain = np.abs(balance.at(balance.mesh_force, torque)[..., numbers]).mean(axis=(1, 2))
    tilts = np.abs(balance.at(balance.misalignment, torque, hub)[..., numbers]).max(axis=(1, 2))
    pair = rules.pair
    gear = (pair.pinion, pair.gear)[tooth.member]
    speed = points.speed[same_sense] * tooth.cycles / len(tooth.meshes) * gear.teeth / pair.pinion.teeth
    force = tangential_force(pair.pinion, 1.0) * plain
    carries = force > LEAST_FORCE
    return MeshLoads(
        torque=torque[carries],
        force=force[carries],
        sharing=forces.max(axis=(1, 2))[carries] / plain[carries],
        opening=tilts[carries] * pair.face_width,
        speed=speed[carries],
        turns=(points.revolutions[same_sense] * tooth.cycles)[carries],
    )


def _load_in_words(gearbox: Gearbox, counted: CountedLoads) -> str:
    hours = float(counted.distribution.hours.sum())
    if gearbox.case.loads is not None:
        count = len(counted.points.torque)
        return f"spectrum on {counted.body}: {count} loads, {hours:,.0f} h"
    source = counted.sources[0]
    torque = f"{torque_text(source.largest)} on {counted.body}"
    return f"nominal load: {torque} at {source.fastest / RPM:.4g} rpm, {hours:,.0f} h"


def _assumptions(gearbox: Gearbox, rating: RatingSection) -> Iterator[str]:
    if usual_variant(gearbox).has_bearings:
        yield "K_gamma and misalignment: static balance with elastic bearings and the mesh stiffness of ISO 6336-1"
    else:
        reason = lacking(gearbox, Variant.bushing)
        yield f"K_gamma = 1 and no misalignment by the load, because gears are on ideal joints: {reason}"
    yield (
        "C_R = 1: gears are solid discs; helix and profile modifications are not included in K_v, K_Hbeta and K_Halpha"
    )
    if rating.edition == "ISO 6336:2019":
        text = f"f_ZCa = {UNMODIFIED:g} for helical gears without flank modification (Z_B, Z_D)"
        if rating.f_ZCa is None and any(is_modified(gearbox, mesh.pair) for mesh in gearbox.meshes):
            text += "; the file has flank modifications: if they suit the load, set f_ZCa of [rating]"
        yield text
        yield "K factors, life factors, Z_L, Z_v and Z_R are taken from ISO 6336:2006 in both editions"
    yield "m_red includes the rim of ring gears, except of those held by the housing"
    yield "Y_B: rim thickness of rings and planets; other gears are solid on shafts. Z_W = Z_X = 1"
    if gearbox.case.loads is None:
        if rating.nominal_hours is None:
            yield "nominal_hours of [rating] is missing: teeth are rated for at least 1e10 load cycles"
    elif rating.application_factor != 1.0:
        yield "application_factor is for nominal loads: K_A = 1 under [loads]"
    if rating.dynamic_factor is not None and any(strength.tolerance_class for strength in rating.gears.values()):
        yield (
            f"K_v to method B of pairs with tolerance_class; rating.dynamic_factor = {rating.dynamic_factor:g} applies "
            "to pairs without it, to finite element values and to exugear life"
        )
    elif rating.dynamic_factor is None:
        yield "K_v other than to the standard: minimum_dynamic_factor (runs and responses are not evaluated here)"


# Finite element results next to the standard's: from a stored rating, or under the nominal load from tables

_NAMES = {
    "sigma_H": "contact_stress",
    "sigma_F": "root_stress",
    "K_Hbeta": "face_load",
    "S_H": "contact_safety",
    "S_F": "root_safety",
}
"""Variables of a stored rating by the symbols of a sheet."""
FlankKey = tuple[str, str, str]
"""Gear, family of meshes and flank."""


def life_results(data: xr.Dataset) -> dict[FlankKey, dict[str, float]]:
    """Return the values of all flanks of a stored rating."""
    found = {}
    for place, label in enumerate(data["flank"].to_numpy().tolist()):
        gear, flank, family = label.split(" ", 2)
        figures = {name: float(data[f"flank_{figure}"][place]) for name, figure in _NAMES.items()}
        found[gear, family, flank] = figures
    return found


def nominal_load_values(
    gearbox: Gearbox,
    rating: RatingSection,
    counted: CountedLoads,
    balance: StaticBalance,
    stresses: Mapping[str, MeshCycleStress],
) -> dict[FlankKey, dict[str, float]]:
    """Return the values of the flanks of pairs with stresses under the nominal load, with K_A applied to its torque."""
    dynamic = stated_factors(gearbox, rating.dynamic_factor or rating.minimum_dynamic_factor or 1.0)
    lives = flank_lives(gearbox, rating, counted.teeth, acting_loads(counted), balance, stresses, dynamic)
    return {
        (life.gear, life.family, life.flank): {name: float(getattr(life, figure)) for name, figure in _NAMES.items()}
        for life in lives
    }


def stress_warnings(stresses: Mapping[str, MeshCycleStress]) -> list[str]:
    """State which finite element results are for aligned gears."""
    straight = [name for name, stress in stresses.items() if len(stress.misalignment) < 2]
    if straight:
        return [f"finite element sigma and K_Hbeta of {', '.join(straight)} are for aligned gears"]
    return []


# Nominal load of a gearbox as a spectrum of one load: the static load at rated speed

HUB_LOADS = 5
"""Number of rotor loads in addition to the torque; all are zero here."""
LONGEST = 1e10
"""Load cycles at the last point of the standard's S-N curves, used for a load without stated hours."""


def nominal_loads(gearbox: Gearbox, rating: RatingSection, factor: float = 1.0) -> CountedLoads:
    """Return the spectrum of the static load alone.

    Parameters
    ----------
    rating : its `nominal_hours`; without them, the teeth with the fewest cycles have `LONGEST` load cycles
    factor : on the torque

    Raises
    ------
    GearboxFileError
        No rated speed, or a static load on several bodies.
    """
    overall = gearbox.case.overall
    torques = gearbox.case.static_load.torques_N_m
    rated = gearbox.case.operation.rated_speed_rpm
    if rated is None:
        raise gearbox.error(
            "operation.rated_speed_rpm: this key is missing; without [loads] gears are rated at the speed of "
            f"{overall.input}"
        )
    if len(torques) != 1:
        raise gearbox.error(
            f"static_load.torques_N_m: {', '.join(torques) or 'nothing'} has a torque; without [loads] the rating "
            "requires a load on one body; add [loads]"
        )
    body, torque = next(iter(torques.items()))
    speed = abs(gearbox.train.rolling_speeds(overall.input, rated * RPM).get(body, 0.0))
    if speed == 0.0 or torque == 0.0:
        raise gearbox.error(f"static_load.torques_N_m.{body} = {torque:g}: {body} transmits no power at rated speed")
    teeth = tooth_exposures(gearbox, body)
    least = min((tooth.cycles for tooth in teeth if tooth.cycles > 0.0), default=1.0)
    torque *= factor
    hours = rating.nominal_hours or LONGEST / least * 2.0 * math.pi / speed / 3600.0
    duration = load_duration(np.array([torque]), np.array([speed]), np.array([hours]), 1)
    return CountedLoads(
        body=body,
        life_years=hours / HOURS_PER_YEAR,
        sources=(_source(torque, speed, hours),),
        distribution=duration,
        points=LoadPoints(
            duration.torque,
            np.zeros((1, HUB_LOADS)),
            duration.hours,
            duration.revolutions,
            duration.running_speed,
            np.zeros(1, int),
        ),
        equivalent_ranges={},
        teeth=teeth,
        bearings=bearing_turns(gearbox, body),
        mesh_forces=forces_of_families(gearbox, body),
        bin_value="mean",
    )


def _source(torque: float, speed: float, hours: float) -> LoadSource:
    torques = np.array([torque])
    return LoadSource(
        name="nominal",
        kind="fatigue",
        case="static load at rated speed",
        file="",
        files=0,
        count=1,
        digest=hashlib.sha256(f"{torque!r} {speed!r} {hours!r}".encode()).hexdigest(),
        torque=torques,
        speed=np.array([speed]),
        hours=np.array([hours]),
        hub=np.zeros((1, 0)),
        series=False,
        skipped=0.0,
        duration=0.0,
        factors=(1.0, 1.0),
        least=torque,
        largest=torque,
        slowest=speed,
        fastest=speed,
        equivalent_ranges={},
    )


# From a gearbox file to its rating sheet: its load spectrum or the nominal load, in static balance


def rated_as(gearbox: Gearbox) -> Choice:
    """Return the model settings for forces and misalignment: mesh stiffness to ISO 6336-1, shafts on bearings.

    Gears without bearings are rated on ideal joints: planets share the load equally and gears are aligned.
    """
    return Choice(usual_variant(gearbox), "iso6336")


def rated_loads(gearbox: Gearbox) -> CountedLoads:
    """Read the loads for the rating: those of `[loads]`, or the static load at rated speed.

    Raises
    ------
    GearboxFileError
        No section `[rating]`, invalid loads, or strengths that do not fit the gears.
    """
    if gearbox.case.loads is not None:
        return checked_loads(gearbox)
    rating = rating_of(gearbox)
    counted = nominal_loads(gearbox, rating)
    check_strengths(gearbox, rating, counted.teeth, False)
    return counted


def balanced(
    assembly: Assembly, counted: CountedLoads, progress: Callable[[int, int], None] | None = None
) -> StaticBalance:
    """Solve the static balance of a gearbox for its rating (`rated_as`), over the torques of its loads.

    Raises
    ------
    BalanceError
        A static state without equilibrium.
    """
    acting = acting_loads(counted)
    angles = rating_of(assembly.gearbox).carrier_angles
    return static_balance(assembly, counted.body, acting.torques, angles, progress, 0.5 * acting.hub_sizes)


def rated(
    gearbox: Gearbox,
    counted: CountedLoads,
    balance: StaticBalance,
    finite_elements: Mapping[FlankKey, Mapping[str, float]],
    remarks: tuple[str, ...] = (),
) -> RatingSheet:
    """Return the rating sheet of a gearbox.

    Parameters
    ----------
    counted : from `rated_loads`
    balance : from `balanced`
    finite_elements : (gear, family, flank) finite element results, see `exugear.life.rating.sheet`
    remarks : on the finite element results
    """
    rating = rating_of(gearbox)
    acting = acting_loads(counted)
    flanks = []
    scope = {mesh.family: reason for mesh in gearbox.meshes if (reason := outside_scope(mesh.pair))}
    for tooth in distinct(counted.teeth):
        if tooth.family in scope:
            continue
        for sense in (1, -1):
            key = tooth.gear, tooth.family, FLANKS[sense * tooth.flank]
            if np.any(acting.points.torque * sense > 0.0):
                flank = _flank(gearbox, rating, counted, acting, balance, tooth, sense, finite_elements.get(key, {}))
                flanks += [] if flank is None else [flank]
    shortfalls = [
        f"{flank.gear} {flank.flank} {flank.family}: {name} = {flank.standard[name]:.3g} to the standard, "
        f"required {asked:g}"
        for flank in flanks
        for name, asked in (("S_H", rating.minimum_S_H), ("S_F", rating.minimum_S_F))
        if flank.standard[name] < asked
    ]
    return RatingSheet(
        edition=rating.edition,
        load=_load_in_words(gearbox, counted),
        flanks=tuple(flanks),
        shortfalls=tuple(shortfalls),
        assumptions=(*remarks, *_assumptions(gearbox, rating)),
        left_out=(*(f"{family}: not rated, {reason}" for family, reason in scope.items()), *NOT_RATED),
        other_edition=OTHER_EDITION[rating.edition],
    )
