"""What a life comes to: parts that fail, that fall short of what is asked for, and pairs that need relief."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.loads import RatingSection
from exugear.life.bearing_life import BearingLife
from exugear.life.gear_life import FlankLife
from exugear.life.load_spectrum.counted import CountedLoads

LEAST_OUTSIDE = 0.01
"""Share of the load outside the path of contact below which no relief is asked for."""
LARGEST_REACH = 2.5
"""Torque over the largest of a table beyond which loads are refused: up to three times stresses that are continued with
constant load sharing are 0 to 6 % above those of a table at that torque, on the safe side."""
UNTRUSTED_REACH = 3.0
"""The same of what meshes carry with load sharing, loads of a hub and K_v, from where on no safety is told as good."""
TOLD_REACH = 1.001
"""From here on that is told."""
LEFT_OUT = (
    "scuffing (ISO/TS 6336-20, -21): not rated: its formulas are not part of this program",
    "micropitting (ISO/TS 6336-22): not rated: its formulas are not part of this program",
    "tooth flank fracture (ISO/TS 6336-4): not rated: its formulas are not part of this program",
)
"""Damages of gears that are not rated, and why."""


def check_reach(gearbox: Gearbox, counted: CountedLoads, tables: Mapping[str, float]) -> None:
    """Refuse loads far beyond the tables that their stresses come from, before any work begins.

    Parameters
    ----------
    tables : by pair name, largest torque on gear 1 of each table, N m

    Raises
    ------
    CaseError
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
        raise gearbox.fault(
            f"loads: {1e-3 * largest:.4g} kN m on {counted.body} are {reach:.3g} times the largest torque that the "
            f"table of {name} has; stresses are continued up to {LARGEST_REACH:g} times. Raise static_load.torques_N_m "
            f"to these loads, or give [ste] axes with torque_factors up to {reach:.2g} and grid = true"
        )


def failures(flanks: Iterable[FlankLife]) -> Iterator[str]:
    """Tell which flanks and roots bear stresses that not one load cycle endures: their damage is infinite."""
    for flank in flanks:
        for what, damage, worn, limit, holder in (
            ("contact", flank.contact_damage, flank.contact_worn, flank.contact_limit, flank.contact_holder),
            ("root", flank.root_damage, flank.root_worn, flank.root_limit, flank.root_holder),
        ):
            if math.isinf(damage):
                yield (
                    f"{label(flank, holder)}: infinite damage: a {what} stress of {1e-6 * worn:.4g} MPa is in its "
                    f"loads, and it endures {1e-6 * limit:.4g} MPa not even for the first cycles of its S-N curve"
                )


def label(life: FlankLife, holder: str) -> str:
    """Gear, flank and family of meshes in one text, and the body where it is one of several."""
    return f"{life.gear} {life.flank} {life.family}" + (f" ({holder})" if holder else "")


def shortfalls(
    rating: RatingSection, flanks: Iterable[FlankLife], bearings: Iterable[BearingLife], hours: float
) -> Iterator[str]:
    """Tell which parts have less safety, over the life or under the largest load, or live less long than is asked for.

    Parameters
    ----------
    rating : its `least_S_H`, `least_S_F` and `least_S_0`
    hours : of operation in the life
    """
    for flank in flanks:
        of_flank = (flank.contact_safety, flank.contact_static)
        of_root = (flank.root_safety, flank.root_static)
        for name, found, asked, holder in (
            ("S_H", of_flank, rating.least_S_H, flank.contact_holder),
            ("S_F", of_root, rating.least_S_F, flank.root_holder),
        ):
            least = min((value for value in found if not math.isnan(value)), default=math.inf)
            if least < asked:
                yield f"{label(flank, holder)}: {name} = {least:.3g}, {asked:g} is asked for"
        if flank.reach > UNTRUSTED_REACH:
            yield (
                f"{label(flank, flank.contact_holder)}: its largest torque is {flank.reach:.3g} times "
                "that of its table: "
                "these stresses are not to be trusted; raise static_load.torques_N_m, or give [ste] larger "
                "torque_factors and grid = true"
            )
    for bearing in bearings:
        for name, lasting in (
            ("L10", bearing.basic_hours),
            ("L10r", bearing.reference_hours),
            ("L10m", bearing.modified_hours),
        ):
            if lasting < hours:
                yield f"{bearing.name}: {name} = {lasting:,.0f} h, {hours:,.0f} h are asked for"
        if bearing.static_safety < rating.least_S_0:
            yield f"{bearing.name}: S_0 = {bearing.static_safety:.3g}, {rating.least_S_0:g} is asked for"


def reaches(flanks: Iterable[FlankLife]) -> Iterator[str]:
    """Tell of pairs whose loads go beyond their tables."""
    largest: dict[str, float] = {}
    for flank in flanks:
        largest[flank.family] = max(flank.reach, largest.get(flank.family, 0.0))
    for family, reach in largest.items():
        if reach > TOLD_REACH:
            yield (
                f"{family}: its largest torque is {reach:.3g} times that of its table; from there on contact stress "
                "grows with the root of torque, root stress with torque"
            )


def needs_of_relief(flanks: Iterable[FlankLife]) -> Iterator[str]:
    """Tell which pairs need relief of their tips: those that carry more than `LEAST_OUTSIDE` outside their path."""
    largest: dict[str, float] = {}
    for flank in flanks:
        largest[flank.family] = max(flank.outside, largest.get(flank.family, 0.0))
    for family, share in largest.items():
        if share > LEAST_OUTSIDE:
            yield (
                f"{family}: up to {100.0 * share:.1f} % of its load lies outside the path of contact, where tip edges "
                "dig in and no stress is rated: its flanks need tip relief"
            )
