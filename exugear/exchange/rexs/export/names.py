"""Names of results in each REXS version; results without a REXS name get a custom one."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from exugear.exchange.rexs.mapping import BEARINGS, GEARS, OWN, RESULTS, Version
from exugear.exchange.rexs.to_case.bodies import ends
from exugear.exchange.rexs.to_case.conversion import Found
from exugear.exchange.rexs.to_case.gear_blocks import Teeth, first_of_planets
from exugear.exchange.rexs.to_case.notes import Block
from exugear.exchange.rexs.to_case.supports import PLACE_TOLERANCE
from exugear.exchange.rexs.tree import Model
from exugear.gearbox.units import MM
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin


def name_in(key: str, version: Version) -> str:
    """Name of a result in a version.

    Examples
    --------
    >>> name_in("base_diameter", (1, 4)), name_in("base_diameter", (2, 0)), name_in("base_diameter", (1, 0))
    ('base_circle_diameter', 'base_diameter', 'custom_exugear_base_diameter')
    """
    known = [name for since, name in RESULTS[key].names.items() if since <= version]
    return known[-1] if known else OWN + key


def unit_in(unit: str, version: tuple[int, int]) -> str:
    """Return a unit in the notation of a REXS version.

    Examples
    --------
    >>> unit_in("deg", (1, 1)), unit_in("deg", (1, 4)), unit_in("MPa", (1, 7))
    ('°', 'deg', 'N / mm^2')
    """
    if unit == "deg" and version < (1, 4):
        return "°"
    if unit == "MPa" and version < (2, 0):
        return "N / mm^2"
    return unit


def stiffness_names(version: Version) -> Iterator[tuple[str, int, int, str, float]]:
    """Yield entries of a bearing's stiffness: name, row and column over (u, v, w) and rotations, unit, SI to unit."""
    forces = (("f_u", 0), ("f_v", 1), ("f_w", 2), ("m_v", 4), ("m_w", 5))
    motions = (("d_u", 0), ("d_v", 1), ("d_w", 2), ("rot_v", 4), ("rot_w", 5))
    for force, row in forces:
        for motion, column in motions:
            turned = row > 3, column > 3
            unit = {(False, False): "N / m", (False, True): "N / rad", (True, False): "N"}.get(turned, "N mm / rad")
            end = f"{force}_{motion}"
            if version < (1, 1):
                old = motion if motion.startswith("d_") else f"d_{motion[-1]}_rot"
                end = f"d{force.upper()[0]}_{force[-1]}_{old}"
            yield f"operating_point_stiffness_{end}", row, column, unit, 1e3 if all(turned) else 1.0


# Components of a REXS file from which the parts of the gearbox file originate, for the export of results


@dataclass(frozen=True)
class Origins(ReprMixin, line=" of {gears!n} gears, {pairs!n} pairs, {bearings!n} bearings"):
    """Numbers of components by the names of parts; those of planets in the order of their angles."""

    gears: Mapping[str, tuple[int, ...]]
    pairs: Mapping[str, tuple[int, ...]]
    bearings: Mapping[str, tuple[int, ...]]
    bodies: Mapping[str, tuple[tuple[int, ...], ...]]
    """Shafts and gears of each body; for planets one such tuple per planet."""
    axes: Mapping[int, Floats]
    """(3, 3) axes u, v, w of bearings and shafts as rows, in the axes of the gearbox file."""
    places: Mapping[int, float]
    """Axial position of the origin of bearings, gears and shafts, m."""


def origins_of(found: Found) -> Origins:
    """Collect the components from which gears, pairs and bearings originate."""
    model = found.model
    places = found.places
    first = first_of_planets(places, found.bodies)
    gears = {
        name: (number, *(other for other, planet in first.items() if planet == number))
        for number, name in found.teeth.names.items()
    }
    held = {name: _bearings(found, block) for name, block in found.bearings.items() if block.number}
    bodies = {
        body.name: tuple(
            tuple(part.number for part in parts if part.type in ("shaft", *GEARS))
            for parts in (body.parts, *body.others)
        )
        for body in found.bodies.members
    }
    turning = [number for members in bodies.values() for numbers in members for number in numbers]
    placed = [
        model.components[number]
        for number in dict.fromkeys([*turning, *(number for numbers in held.values() for number in numbers)])
        if model.components[number].given("support_vector")
    ]
    return Origins(
        gears,
        _stages(model, found.teeth, first, gears),
        held,
        bodies,
        {part.number: places.axes(part) for part in placed},
        {part.number: MM * places.position(part)[2] for part in placed},
    )


def _stages(
    model: Model, teeth: Teeth, first: Mapping[int, int], gears: Mapping[str, tuple[int, ...]]
) -> dict[str, tuple[int, ...]]:
    """Stages of each pair, one per planet."""
    pairs = {frozenset(stage.both): name for name, stage in teeth.stages.items()}
    found: dict[str, list[tuple[int, int]]] = {name: [] for name in teeth.stages}
    for relation in model.relations_of("stage"):
        both = [relation.roles[role] for role in ("gear_1", "gear_2")]
        own = frozenset(first.get(number, number) for number in both)
        index = max(gears[teeth.names[first.get(number, number)]].index(number) for number in both)
        found[pairs[own]].append((index, relation.roles["stage"]))
    return {name: tuple(number for _, number in sorted(stages)) for name, stages in found.items()}


def _bearings(found_in: Found, block: Block) -> tuple[int, ...]:
    """Bearing of a section, and the bearings at the same position of the other planets."""
    model = found_in.model
    places = found_in.places
    bodies = found_in.bodies
    component = model.components[block.number]
    body = next(member for member in bodies.members if member.name == block.entries["body"].value)
    if not body.others or component.type not in BEARINGS:
        return (component.number,)
    planets = [[part.number for part in parts] for parts in body.others]
    found: list[tuple[int, int]] = []
    z = places.position(component)[2]
    for part in model.components_of_type(component.type):
        place = next(
            (n for n, parts in enumerate(planets) for end in ends(model, part) or () if end.number in parts), -1
        )
        if place >= 0 and math.isclose(places.position(part)[2], z, abs_tol=PLACE_TOLERANCE):
            found.append((place, part.number))
    return (component.number, *(number for _, number in sorted(found)))
