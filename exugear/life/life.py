"""Rating and life of a gearbox under its load spectrum: gears by flank, bearings, extreme loads, limiting parts."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.sections.loads import LubricantSection, RatingSection
from exugear.gearbox.units import RPM
from exugear.gearbox.versions import LIFE
from exugear.life.bearing_life import BearingLife, bearing_lives
from exugear.life.dynamic_factors import WITHIN, DynamicFactor, source_hash
from exugear.life.gear_life import FlankLife, check_strengths, flank_lives, warn_beyond_tables
from exugear.life.load_spectrum.counted import CountedLoads, count_loads
from exugear.life.load_spectrum.sources import Progress, section_of
from exugear.life.static_balance import (
    ActingLoads,
    AngleStore,
    StaticBalance,
    acting_loads,
    hub_position_in_words,
    static_balance,
    torque_reaches,
)
from exugear.system.bearings.rolling.life import LEAST_RATIO
from exugear.system.system import Assembly, input_hash
from exugear.system.tooth_mesh.tables import TableRequest
from fe_ste.standards.iso6336 import outside_scope
from fe_ste.tools.display import ReprMixin

if TYPE_CHECKING:
    from fe_ste.root_stress import MeshCycleStress

LEAST_OUTSIDE = 0.01
"""Fraction of the load outside the path of contact below which no relief is recommended."""
LARGEST_REACH = 2.5
"""Ratio to the largest torque of a table above which loads are refused. Up to three, stresses extrapolated with
constant load sharing are 0 to 6 % above those of a table at that torque (conservative)."""
UNTRUSTED_REACH = 3.0
"""Limit of the same ratio with load sharing, rotor loads and K_v included; above it, safeties are invalid."""
TOLD_REACH = 1.001
"""Ratio above which the extrapolation is reported."""
NOT_RATED = (
    "scuffing (ISO/TS 6336-20, -21): not rated by this program",
    "micropitting (ISO/TS 6336-22): not rated by this program",
    "tooth flank fracture (ISO/TS 6336-4): not rated by this program",
)
"""Failure modes of gears that are not rated, with the reason."""
SYMMETRIC = "reversed torque loads the opposite flanks; their teeth are assumed symmetric"
"""Assumption for loads that press other flanks than the static load, for which tables are computed."""


def check_reach(gearbox: Gearbox, counted: CountedLoads, tables: Mapping[str, float]) -> None:
    """Refuse loads far beyond the tables of their stresses, before the computation begins.

    Parameters
    ----------
    tables : by pair name, largest torque on gear 1 of each table, N m

    Raises
    ------
    GearboxFileError
        Loads above `LARGEST_REACH` times the largest torque of a table.
    """
    largest = max(max(source.largest, -source.least) for source in counted.sources)
    reach = 0.0
    name = ""
    for mesh in gearbox.meshes:
        if mesh.pair.name in tables:
            torque = largest * counted.mesh_forces[mesh.family] * mesh.pair.pinion.base_radius
            reach, name = max((reach, name), (torque / tables[mesh.pair.name], mesh.pair.name))
    if reach > LARGEST_REACH:
        raise gearbox.error(
            f"loads: {1e-3 * largest:.4g} kN m on {counted.body} is {reach:.3g} times the largest torque of the table "
            f"of {name}; stresses are extrapolated up to {LARGEST_REACH:g} times. Increase static_load.torques_N_m to "
            f"these loads, or set torque_factors up to {reach:.2g} and grid = true in [ste]"
        )


def failures(flanks: Iterable[FlankLife]) -> Iterator[str]:
    """Report flanks and roots with stresses above the S-N curve, whose damage is infinite."""
    for flank in flanks:
        for what, damage, worn, limit, holder in (
            ("contact", flank.contact_damage, flank.contact_worn, flank.contact_limit, flank.contact_holder),
            ("root", flank.root_damage, flank.root_worn, flank.root_limit, flank.root_holder),
        ):
            if math.isinf(damage):
                yield (
                    f"{label(flank, holder)}: infinite damage: the loads cause a {what} stress of {1e-6 * worn:.4g} "
                    f"MPa, above the {1e-6 * limit:.4g} MPa at the start of its S-N curve"
                )


def label(life: FlankLife, holder: str) -> str:
    """Return a label of gear, flank and family of meshes, with the body if there are several."""
    return f"{life.gear} {life.flank} {life.family}" + (f" ({holder})" if holder else "")


def shortfalls(
    rating: RatingSection, flanks: Iterable[FlankLife], bearings: Iterable[BearingLife], hours: float
) -> Iterator[str]:
    """Report parts below the required safety, over the life or under the largest load, or below the required life."""
    for flank in flanks:
        of_flank = (flank.contact_safety, flank.contact_static)
        of_root = (flank.root_safety, flank.root_static)
        for name, found, asked, holder in (
            ("S_H", of_flank, rating.minimum_S_H, flank.contact_holder),
            ("S_F", of_root, rating.minimum_S_F, flank.root_holder),
        ):
            least = min((value for value in found if not math.isnan(value)), default=math.inf)
            if least < asked:
                yield f"{label(flank, holder)}: {name} = {least:.3g}, required {asked:g}"
        if flank.reach > UNTRUSTED_REACH:
            yield (
                f"{label(flank, flank.contact_holder)}: the largest torque is {flank.reach:.3g} times the largest "
                "torque of its table: these stresses are invalid; increase static_load.torques_N_m, or set larger "
                "torque_factors and grid = true in [ste]"
            )
    for bearing in bearings:
        for name, lasting in (
            ("L10", bearing.basic_hours),
            ("L10r", bearing.reference_hours),
            ("L10m", bearing.modified_hours),
        ):
            if lasting < hours:
                floor = ""
                if name == "L10m" and bearing.viscosity_ratio < LEAST_RATIO:
                    floor = f" (with a_ISO = 0.1, its minimum, at kappa = {bearing.viscosity_ratio:.2g})"
                yield f"{bearing.name}: {name} = {lasting:,.0f} h{floor}, required {hours:,.0f} h"
        if bearing.static_safety < rating.minimum_S_0:
            yield f"{bearing.name}: S_0 = {bearing.static_safety:.3g}, required {rating.minimum_S_0:g}"


def reaches(flanks: Iterable[FlankLife]) -> Iterator[str]:
    """Report pairs with loads beyond their tables."""
    largest: dict[str, float] = {}
    for flank in flanks:
        largest[flank.family] = max(flank.reach, largest.get(flank.family, 0.0))
    for family, reach in largest.items():
        if reach > TOLD_REACH:
            yield (
                f"{family}: the largest torque is {reach:.3g} times the largest torque of its table; beyond the "
                "table, contact stress is extrapolated with the square root of torque, root stress linearly"
            )


def needs_of_relief(gearbox: Gearbox, flanks: Iterable[FlankLife]) -> Iterator[str]:
    """Report pairs that need tip relief: more than `LEAST_OUTSIDE` of the load is outside their path of contact."""
    pairs = {mesh.family: mesh.pair for mesh in gearbox.meshes}
    largest: dict[str, float] = {}
    for flank in flanks:
        largest[flank.family] = max(flank.outside, largest.get(flank.family, 0.0))
    for family, share in largest.items():
        if share > LEAST_OUTSIDE:
            gears = (pairs[family].pinion.name, pairs[family].gear.name)
            reliefs = {name: gearbox.case.gears[name].modification for name in gears}
            given = " and ".join(
                f"{relief.tip_relief_um:g} µm of tip relief on {name}"
                for name, relief in reliefs.items()
                if relief is not None and relief.tip_relief_um
            )
            remedy = given and f"present: {given}; increase its amount or length"
            yield (
                f"{family}: up to {100.0 * share:.1f} % of the load is outside the path of contact (tip-edge "
                f"contact), where no stress is rated: {remedy or 'add tip relief'}"
            )


TOLD_SHARING = 1.0005
"""K_gamma of a single mesh above which it is reported, as rotor loads then change tooth forces."""


@dataclass(frozen=True, eq=False)
class Life(ReprMixin, line=" of {variant}: {flanks!n} flanks, {bearings!n} bearings"):
    """Rating and life of a gearbox."""

    variant: str
    mesh_model: str
    inertias: str
    edition: str
    """Model of the forces, and edition of the standard for the gears."""
    counted: CountedLoads
    balance: StaticBalance
    load_sharing: Mapping[str, float]
    """By mesh family, K_gamma of the static balance."""
    flanks: tuple[FlankLife, ...]
    bearings: tuple[BearingLife, ...]
    unrated: tuple[str, ...]
    """Reasons why parts have no rating."""
    failures: tuple[str, ...]
    """Parts with infinite damage, and the stress that causes it."""
    shortfalls: tuple[str, ...]
    """Parts below the safety required by `[rating]` or the life required by `[loads]`, or with invalid stresses."""
    reliefs: tuple[str, ...]
    """Pairs with load outside their path of contact, which tip relief would remove."""
    assumptions: tuple[str, ...]
    input_hash: str
    """Hash of gearbox file, model settings, tables, load files and versions of methods."""


def rating_of(gearbox: Gearbox) -> RatingSection:
    """Return the section [rating] of a gearbox file.

    Raises
    ------
    GearboxFileError
        There is none.
    """
    if gearbox.case.rating is None:
        raise gearbox.error(
            "rating: this section is missing; add [rating] with dynamic_factor, [rating.gears.NAME] with the "
            "strength of each gear, and [lubricant] with viscosity_40_mm2_per_s"
        )
    return gearbox.case.rating


def checked_loads(gearbox: Gearbox, progress: Progress | None = None) -> CountedLoads:
    """Read the load spectrum, and check all required input before the computation begins.

    Raises
    ------
    GearboxFileError
        Invalid loads, or strengths that do not fit the gears.
    """
    check_keys(gearbox)
    counted = count_loads(gearbox, progress)
    senses = set(np.sign(counted.distribution.torque).tolist())
    check_strengths(gearbox, rating_of(gearbox), counted.teeth, senses >= {-1.0, 1.0})
    return counted


def check_keys(gearbox: Gearbox) -> None:
    """Refuse a file without the input for a rating, without reading loads; all errors are raised together.

    Raises
    ------
    GearboxFileError
        Missing sections or keys, or an unknown load case.
    """
    errors: list[str] = []
    for asked in (rating_of, section_of, lambda given: given.viscosity_40):
        try:
            asked(gearbox)
        except GearboxFileError as error:
            errors += error.errors
    rating = gearbox.case.rating
    named = rating and rating.dynamic_factor_run
    if named and named not in gearbox.load_cases:
        known = ", ".join(gearbox.load_cases) or "none"
        errors += gearbox.error(
            f"rating.dynamic_factor_run = {named!r}: no such load case; load cases are {known}"
        ).errors
    if errors:
        raise GearboxFileError(*errors)


def life_hash(assembly: Assembly, counted: CountedLoads, requests: Iterable[TableRequest], folder: Path) -> str:
    """Return the SHA-256 of all input of a rating: with that of its tables, and of its run or response in a folder."""
    case = assembly.gearbox.content
    content = {
        "method_version": LIFE,
        "assembly": input_hash(assembly),
        "loads": case.get("loads"),
        "rating": case.get("rating"),
        "lubricant": case.get("lubricant"),
        "files": {source.name: source.digest for source in counted.sources},
        "tables": {request.name: request.wanted.hash for request in requests},
        "run": source_hash(assembly, rating_of(assembly.gearbox), folder),
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def compute_life(
    assembly: Assembly,
    counted: CountedLoads,
    stresses: Mapping[str, MeshCycleStress],
    dynamic: Mapping[str, DynamicFactor],
    digest: str,
    progress: Callable[[int, int], None] | None = None,
    store: AngleStore | None = None,
) -> Life:
    """Rate gears and bearings of a variant under the load spectrum of its gearbox file.

    Parameters
    ----------
    counted : from `checked_loads`
    stresses : by pair name, pairs without are not rated
    dynamic : by mesh family, K_v
    digest : from `life_hash`
    progress : called with the number of solved static states and the total
    store : stores solved angles of the carrier

    Raises
    ------
    BalanceError
        A static state without equilibrium.
    """
    gearbox = assembly.gearbox
    rating = rating_of(assembly.gearbox)
    acting = acting_loads(counted)
    balance = static_balance(
        assembly, counted.body, acting.torques, rating.carrier_angles, progress, 0.5 * acting.hub_sizes, store
    )
    flanks = flank_lives(gearbox, rating, counted.teeth, acting, balance, stresses, dynamic)
    bearings = bearing_lives(assembly.supports, counted.bearings, acting, balance, gearbox.case.lubricant)
    families: dict[str, list[int]] = {}
    for number, mesh in enumerate(gearbox.meshes):
        families.setdefault(mesh.family, []).append(number)
    hub = np.concatenate([acting.points.other, acting.worst_hub])
    sharing = {family: balance.load_sharing(numbers, acting.torques, hub) for family, numbers in families.items()}
    told = {name: value for name, value in sharing.items() if len(families[name]) > 1 or value > TOLD_SHARING}
    return Life(
        variant=str(assembly.variant),
        mesh_model=assembly.mesh_model,
        inertias=assembly.inertias,
        edition=rating.edition,
        counted=counted,
        balance=balance,
        load_sharing=sharing,
        flanks=flanks,
        bearings=bearings,
        unrated=tuple(_unrated(assembly, counted, stresses)),
        failures=tuple(failures(flanks)),
        shortfalls=tuple(shortfalls(rating, flanks, bearings, float(acting.points.hours.sum()))),
        reliefs=tuple(needs_of_relief(gearbox, flanks)),
        assumptions=(
            _hub_in_words(assembly, counted, acting),
            *_assumptions(rating, counted, acting, balance, stresses, dynamic, gearbox.case.lubricant),
            *([SYMMETRIC] if any(back for _, back in torque_reaches(assembly, counted).values()) else []),
            *(f"K_gamma of {family} = {value:.3f}, included in the mesh forces" for family, value in told.items()),
            *warn_beyond_tables(gearbox, acting, balance, stresses),
            *reaches(flanks),
        ),
        input_hash=digest,
    )


def _unrated(assembly: Assembly, counted: CountedLoads, stresses: Mapping[str, MeshCycleStress]) -> list[str]:
    gearbox = assembly.gearbox
    lines = []
    rated = rating_of(gearbox).gears
    for gear in dict.fromkeys(tooth.gear for tooth in counted.teeth):
        if gear not in rated:
            lines.append(f"gear {gear}: no strength; add [rating.gears.{gear}]")
    for pair in dict.fromkeys(mesh.pair.name for mesh in gearbox.meshes):
        if pair not in stresses:
            lines.append(f"pair {pair}: no table, so no stresses")
    for mesh in gearbox.meshes:
        if reason := outside_scope(mesh.pair):
            lines.append(f"{mesh.family}: no nominal stresses and no S_H and S_F to ISO 6336, {reason}")
    for support in dict.fromkeys(support.family for support in assembly.supports if support.catalogue is None):
        lines.append(f"{support}: defined by its stiffness only; add a [.catalogue] table for a rating life")
    if not assembly.supports:
        lines.append(f"bearings: the variant {assembly.variant} has none")
    return [*lines, *NOT_RATED]


def _hub_in_words(assembly: Assembly, counted: CountedLoads, acting: ActingLoads) -> str:
    if not acting.hub_sizes.any():
        return "torque only: no rotor forces or moments"
    points = f"in {len(counted.points.torque)} points; " if counted.points.other.any() else "of extreme sources; "
    return (
        f"rotor forces and moments on {counted.body} {points}their effect is linear at each torque; they act "
        + hub_position_in_words(assembly, counted.body)
    )


def _assumptions(
    rating: RatingSection,
    counted: CountedLoads,
    acting: ActingLoads,
    balance: StaticBalance,
    stresses: Mapping[str, MeshCycleStress],
    dynamic: Mapping[str, DynamicFactor],
    oil: LubricantSection | None,
) -> list[str]:
    count = len(balance.torque)
    turns = len(balance.angle)
    aligned = ", ".join(name for name, stress in stresses.items() if len(stress.misalignment) < 2)
    lines = [
        f"static balance at {count} torque{'s' * (count > 1)} and {turns} carrier angle{'s' * (turns > 1)}, "
        + ("proportional to torque" if balance.linear else "forces interpolated linearly over torque"),
        _dynamic_in_words(rating, dynamic, acting) + "; none on bearings",
        "face and transverse load factors are included in the finite element contact stresses"
        + (f", of {aligned} for aligned gears; --mesh-model table includes misalignment" if aligned else ""),
        f"required: S_H {rating.minimum_S_H:g}, S_F {rating.minimum_S_F:g}, S_0 {rating.minimum_S_0:g}",
        "S_H and S_F to ISO 6336: nominal stresses with K_Hbeta of the finite elements and K_Halpha = K_Falpha = 1",
        "Z_W = Z_X = 1; S-N curves are extrapolated beyond their last point (no endurance limit)",
        _oil_in_words(oil),
    ]
    if balance.outside:
        lines.append(
            f"outside their tables under some loads: {', '.join(balance.outside)}; extrapolated linearly; widen the "
            "axes of [ste]"
        )
    return [*lines, *counted.remarks]


def _oil_in_words(oil: LubricantSection | None) -> str:
    given = oil is not None and None not in (oil.viscosity_100_mm2_per_s, oil.temperature_C, oil.cleanliness)
    if oil is None or not given:
        return (
            "bearing lives are basic rating lives, ribs and cages neglected; L10m (lubricant, cleanliness) requires "
            "viscosity_100_mm2_per_s, temperature_C and cleanliness in [lubricant]"
        )
    return (
        f"L10m of bearings to ISO 281 for oil at {oil.temperature_C:g} °C and cleanliness {oil.cleanliness!r}, with "
        "the lower limit of e_C; ribs and cages neglected"
    )


def _dynamic_in_words(rating: RatingSection, dynamic: Mapping[str, DynamicFactor], acting: ActingLoads) -> str:
    if rating.dynamic_factor is not None:
        return f"K_v = {rating.dynamic_factor:g} for all meshes, as specified"
    factors = {name: factor.largest(acting.slowest, acting.fastest) for name, factor in dynamic.items()}
    values = ", ".join(f"{name} {value:.3f}" for name, value in factors.items())
    first = next(iter(dynamic.values()))
    lowest = acting.slowest / RPM
    highest = acting.fastest / RPM
    slow = first.speed[0] / RPM
    fast = first.speed[-1] / RPM
    inside = slow <= lowest * (1.0 + WITHIN) and highest <= fast * (1.0 + WITHIN)
    beyond = "" if inside else "; constant beyond that range"
    return (
        f"K_v of {first.source}, from {lowest:.4g} to {highest:.4g} rpm, the speed range of the loads{beyond}, at "
        f"least {rating.minimum_dynamic_factor:g}: {values}"
    )
