"""Which components of a REXS file the parts of the gearbox file come from: the way back for results."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from exugear.exchange.rexs.to_case.bodies import GEARS, ends
from exugear.exchange.rexs.to_case.conversion import Found
from exugear.exchange.rexs.to_case.gear_blocks import Teeth, first_of_planets
from exugear.exchange.rexs.to_case.notes import Block
from exugear.exchange.rexs.to_case.places import Places
from exugear.exchange.rexs.to_case.supports import BEARINGS, PLACE_TOLERANCE
from exugear.exchange.rexs.tree import Component, Model
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed


@dataclass(frozen=True)
class Origins(Displayed, line=" of {gears!n} gears, {pairs!n} pairs, {bearings!n} bearings"):
    """Numbers of components by the names of parts; those of planets in the order of their angles."""

    gears: Mapping[str, tuple[int, ...]]
    pairs: Mapping[str, tuple[int, ...]]
    bearings: Mapping[str, tuple[int, ...]]
    bodies: Mapping[str, tuple[tuple[int, ...], ...]]
    """Shafts and gears of each body, of planets one such tuple for each."""
    axes: Mapping[int, Floats]
    """(3, 3) axes u, v, w of bearings and shafts as rows, in those of the gearbox file."""
    places: Mapping[int, float]
    """Origin of bearings, gears and shafts along z, m."""


def origins_of(found: Found) -> Origins:
    """Gather the components behind gears, pairs and bearings."""
    model = found.model
    places = found.places
    first = first_of_planets(model, places, found.bodies)
    gears = {
        name: (number, *(other for other, own in first.items() if own == number))
        for number, name in found.teeth.names.items()
    }
    held = {name: _bearings(found, block) for name, block in found.bearings.items() if block.number}
    bodies = {
        body.name: tuple(_shafts_and_gears(each) for each in (body.parts, *body.others))
        for body in found.bodies.members
    }
    turning = [number for each in bodies.values() for numbers in each for number in numbers]
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
        {part.number: 1e-3 * _z(places, part) for part in placed},
    )


def _shafts_and_gears(parts: Iterable[Component]) -> tuple[int, ...]:
    return tuple(part.number for part in parts if part.type in ("shaft", *GEARS))


def _stages(
    model: Model, teeth: Teeth, first: Mapping[int, int], gears: Mapping[str, tuple[int, ...]]
) -> dict[str, tuple[int, ...]]:
    """Stages of each pair, one for each planet."""
    pairs = {frozenset((stage.pinion, stage.gear)): name for name, stage in teeth.stages.items()}
    found: dict[str, list[tuple[int, int]]] = {name: [] for name in teeth.stages}
    for relation in model.relations_of("stage"):
        both = [relation.roles[role] for role in ("gear_1", "gear_2")]
        own = frozenset(first.get(number, number) for number in both)
        index = max(gears[teeth.names[first.get(number, number)]].index(number) for number in both)
        found[pairs[own]].append((index, relation.roles["stage"]))
    return {name: tuple(number for _, number in sorted(stages)) for name, stages in found.items()}


def _bearings(found_in: Found, block: Block) -> tuple[int, ...]:
    """Bearing of a table, and those of the other planets that stand where it does."""
    model = found_in.model
    places = found_in.places
    bodies = found_in.bodies
    component = model.components[block.number]
    body = next(member for member in bodies.members if member.name == block.entries["body"].value)
    if not body.others or component.type not in BEARINGS:
        return (component.number,)
    planets = [[part.number for part in parts] for parts in body.others]
    found: list[tuple[int, int]] = []
    for part in model.of_type(component.type):
        place = next(
            (n for n, parts in enumerate(planets) for end in ends(model, part) or () if end.number in parts), -1
        )
        if place >= 0 and math.isclose(_z(places, part), _z(places, component), abs_tol=PLACE_TOLERANCE):
            found.append((place, part.number))
    return (component.number, *(number for _, number in sorted(found)))


def _z(places: Places, part: Component) -> float:
    return places.position(part)[2]
