"""Bodies of a REXS file: components that rotate together, planets of a set, and their names."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from exugear.exchange.rexs.mapping import GEARS, JOINING, READ
from exugear.exchange.rexs.to_case.notes import ComponentPositions, Notes
from exugear.exchange.rexs.tree import Component, Model, RexsError
from fe_ste.tools.display import ReprMixin

(TORSION,) = READ["torsion"]
RIGID_TORSION = 1e12
"""Torsional stiffness (N m/rad) from which a connection counts as rigid; files use 1e17 for rigid."""
RIGID_ABOVE = {"radial_stiffness": 1e14, "axial_stiffness": 1e14, "bending_stiffness": 1e11}
"""Stiffness (N/m, N m/rad) from which a value counts as rigid; no bearing is as stiff."""
COAXIAL = 2e-3
"""Largest distance of axes that count as coaxial, mm."""


@dataclass(frozen=True)
class RigidGroup:
    """Components that move as one rigid body."""

    name: str
    """Name in the gearbox file."""
    parts: tuple[Component, ...]
    """Shafts, plates and gears."""
    axis: tuple[float, float]
    """Position of the axis, mm."""
    fixed: bool = False
    others: tuple[tuple[Component, ...], ...] = ()
    """Parts of the other planets of a set, in the order of their angles."""
    angles: tuple[float, ...] = ()
    """Angles of the planets on the carrier, deg; empty for other bodies."""
    orbit: float = 0.0
    """Distance of the planets from the axis of the carrier, mm."""
    carrier: str = ""
    """Carrier of the planets; empty for other bodies."""

    def parts_of_type(self, *types: str) -> tuple[Component, ...]:
        """Parts of some types."""
        return tuple(part for part in self.parts if part.type in types)

    @property
    def gears(self) -> tuple[Component, ...]:
        """Gears of the body; for planets those of the first."""
        return self.parts_of_type(*GEARS)


class RigidGroups(ReprMixin):
    """All bodies of a gearbox, by name and by component."""

    def __init__(self, members: Sequence[RigidGroup]) -> None:
        self.members = tuple(members)
        self._of_part = {part.number: body for body in members for part in body.parts}
        self._of_other = {part.number: body for body in members for planet in body.others for part in planet}

    def _line(self) -> str:
        return f": {', '.join(body.name for body in self.members)}"

    def of(self, part: Component) -> RigidGroup | None:
        """Body of a component; None for idle components and for planets other than the first of a set."""
        return self._of_part.get(part.number)

    def body_of(self, part: Component) -> RigidGroup | None:
        """Body of a component, for any planet of a set."""
        return self._of_part.get(part.number) or self._of_other.get(part.number)


class _Union:
    """Disjoint sets of components."""

    def __init__(self, numbers: Iterable[int]) -> None:
        self._parent = {number: number for number in numbers}

    def __contains__(self, number: int) -> bool:
        return number in self._parent

    def root(self, number: int) -> int:
        while self._parent[number] != number:
            self._parent[number] = number = self._parent[self._parent[number]]
        return number

    def join(self, first: int, second: int) -> None:
        self._parent[self.root(second)] = self.root(first)


def torsional_stiffness(connection: Component) -> float | None:
    """Torsional stiffness of a coupling or fit, N m/rad; None if the file has no value."""
    value = connection.quantity(TORSION.attribute)
    return None if value is None else TORSION.factor * value


def is_rigid_in_torsion(connection: Component) -> bool:
    """Return whether both sides rotate together."""
    torsion = torsional_stiffness(connection)
    return torsion is None or torsion >= RIGID_TORSION


def is_one_piece(connection: Component) -> bool:
    """Return whether a coupling or fit rigidly connects both sides in all directions that it specifies.

    A shaft behind a coupling that is torsionally stiff and radially compliant, such as a floating sun, is a separate
    body.
    """
    if not is_rigid_in_torsion(connection) or connection.flag("radial_force_absorption") is False:
        return False
    for row in READ["stiffness"]:
        value = connection.quantity(row.attribute)
        if value is not None and row.factor * value < RIGID_ABOVE[row.attribute]:
            return False
    return True


def ends(model: Model, connection: Component) -> tuple[Component, Component] | None:
    """Inner and outer part of a bearing, coupling or fit; None unless the file specifies both."""
    inner = model.related("side", "assembly", connection.number, "inner_part")
    outer = model.related("side", "assembly", connection.number, "outer_part")
    if inner and outer:
        return (inner[0], outer[0])
    return None


def connections(model: Model) -> Iterator[tuple[Component, Component, Component]]:
    """Yield couplings and fits with inner and outer part, unless they are not engaged in the selected gear."""
    for part in model.components_of_type(*JOINING):
        both = ends(model, part)
        if both is None:
            continue
        unit = model.components_of_type("gear_unit")
        shift = (unit[0].whole("gear_shift_index") if unit else None) or 1
        if part.type != "switchable_coupling" or part.flag("is_engaged", shift - 1) is not False:
            yield part, *both


def find_bodies(model: Model, places: ComponentPositions, notes: Notes) -> RigidGroups:
    """Group components into bodies."""
    union = _joined(model, notes)
    held = held_by_speed(model)
    groups: dict[int, list[Component]] = {}
    for part in model.components_of_type("shaft", "side_plate", "gear_casing", *GEARS):
        groups.setdefault(union.root(part.number), []).append(part)
    working = _working(model, union)
    sets = _planet_sets(model, places, union, groups)
    planets = {root for _, members in sets for root, _ in members}
    pins = {relation.roles["shaft"] for relation in model.relations_of("planet_pin") if "shaft" in relation.roles}
    names = _names(
        {root: parts for root, parts in groups.items() if root in working - planets}, _carriers(model, union)
    )
    bodies: list[RigidGroup] = []
    for root, parts in groups.items():
        if root in names:
            fixed = _is_fixed(parts, held)
            bodies.append(RigidGroup(names[root], tuple(_axial(parts)), _axis(places, parts, pins), fixed))
            stopped = [str(part) for part in parts if part.number in held]
            if stopped and not _is_fixed(parts, ()):
                notes.changed.append(f"{', '.join(stopped)}: fixed, since the file defines its speed as 0")
        elif root not in planets and not _is_fixed(parts, held):
            notes.lost.append(f"{', '.join(str(part) for part in parts)}: in no mesh, rotates without load")
    by_root = {union.root(part.number): body for body in bodies for part in body.parts}
    carried: list[tuple[RigidGroup, list[_Planet]]] = []
    for stage, members in sets:
        carrier = _carrier(model, union, by_root, stage, members[0][1])
        carried += [(carrier, orbit) for orbit in _orbits(places, members, carrier.axis)]
    planet_bodies: list[RigidGroup] = []
    for number, (carrier, placed) in enumerate(carried):
        placed = _order_by_mating_planets(model, groups, placed, planet_bodies)
        first, *others = (tuple(_axial(groups[planet.root])) for planet in placed)
        x, y, _ = places.position(placed[0].shaft)
        planet_bodies.append(
            RigidGroup(
                name=_lettered("planet", number, len(carried)),
                parts=first,
                axis=(x, y),
                others=tuple(others),
                angles=tuple(planet.angle for planet in placed),
                orbit=round(placed[0].radius, 6),
                carrier=carrier.name,
            )
        )
    return RigidGroups([*bodies, *planet_bodies])


def _joined(model: Model, notes: Notes) -> _Union:
    parts = model.components_of_type("shaft", "side_plate", "gear_casing", *GEARS)
    union = _Union(part.number for part in parts)
    casings = [part.number for part in parts if part.type == "gear_casing"]
    for casing in casings[1:]:
        union.join(casings[0], casing)
    carriers: dict[int, int] = {}
    for relation in model.relations_of("assembly"):
        owner = relation.roles.get("assembly", -1)
        part = relation.roles.get("part", -1)
        if owner in union and part in union and model.components[owner].type == "shaft":
            union.join(owner, part)
        elif part in union and owner in model.components and model.components[owner].type == "planet_carrier":
            union.join(carriers.setdefault(owner, part), part)
    stiff = [
        (connection, inner, outer)
        for connection, inner, outer in connections(model)
        if is_rigid_in_torsion(connection) and inner.number in union and outer.number in union
    ]
    for connection, inner, outer in stiff:
        if is_one_piece(connection):
            union.join(inner.number, outer.number)
    for connection, inner, outer in stiff:
        held = {union.root(end.number) for end in (inner, outer)}
        if casings and union.root(casings[0]) in held and len(held) > 1:
            notes.changed.append(
                f"{connection}: constrains the rotation of {inner} and is elastic otherwise; modelled as rigid, since "
                "a body that does not rotate is fixed here: load sharing of its gears is less even than in the "
                "gearbox"
            )
            union.join(inner.number, outer.number)
    return union


def _working(model: Model, union: _Union) -> set[int]:
    """Roots of components that mesh or carry planets, and of those connected to them with some torsional stiffness."""
    numbers = {role for relation in model.relations_of("stage") for role in relation.roles.values()}
    working = {union.root(number) for number in numbers if number in union} | _carriers(model, union)
    ties = [
        {union.root(end.number) for end in both if end.number in union and end.type != "gear_casing"}
        for connection, *both in connections(model)
        if torsional_stiffness(connection) != 0.0
    ]
    for _ in ties:
        working |= {root for tie in ties if tie & working for root in tie}
    return working


def held_by_speed(model: Model) -> set[int]:
    """Numbers of the shafts whose speed is defined as zero in all load cases while others rotate.

    Some programs omit the speed zero although they state that a shaft defines its speed.
    """
    speeds: dict[int, set[float]] = {}
    for case in model.load_cases or (None,):
        for shaft in model.components_in(case, "shaft"):
            speed = shaft.quantity("rotational_speed")
            defined = shaft.flag("defines_speed")
            if defined or (speed is not None and defined is None):
                speeds.setdefault(shaft.number, set()).add(speed or 0.0)
            elif speed:
                speeds.setdefault(shaft.number, set()).add(speed)
    if not any(any(found) for found in speeds.values()):
        return set()
    return {number for number, found in speeds.items() if not any(found)}


def _is_fixed(parts: Iterable[Component], held: Collection[int]) -> bool:
    return any(part.type == "gear_casing" or part.number in held for part in parts)


def _carriers(model: Model, union: _Union) -> set[int]:
    relations = model.relations_of("planet_carrier_shaft", "planet_pin")
    return {union.root(relation.roles["shaft"]) for relation in relations if relation.roles.get("shaft", -1) in union}


def _axial(parts: Iterable[Component]) -> list[Component]:
    return [part for part in parts if part.type != "gear_casing"]


def _axis(places: ComponentPositions, parts: Sequence[Component], pins: set[int]) -> tuple[float, float]:
    """Axis of a body, mm: that of its gears, else of its shafts and plates, without the pins of planets."""
    rank = {"cylindrical_gear": 0, "ring_gear": 0, "shaft": 1, "side_plate": 2}
    own = sorted((p for p in parts if p.type in rank and p.number not in pins), key=lambda part: rank[part.type])
    own = [part for part in own if part.given("support_vector")]
    if not own:
        raise RexsError(f"{parts[0]}: the position of its axis is not defined")
    x, y, _ = places.position(own[0])
    for part in own[1:]:
        if math.dist((x, y), places.position(part)[:2]) > COAXIAL:
            raise RexsError(f"{part}: is rigidly connected to {own[0]} but not on its axis")
    return x, y


def _planet_sets(
    model: Model, places: ComponentPositions, union: _Union, groups: Mapping[int, list[Component]]
) -> list[tuple[int, list[tuple[int, Component]]]]:
    """Group the planets into sets of equal ones: number of the stage, and (root, shaft) of each."""
    sets: dict[tuple[object, ...], tuple[int, list[tuple[int, Component]]]] = {}
    for relation in model.relations_of("planet_shaft"):
        if not {"shaft", "planetary_stage"} <= relation.roles.keys() or relation.roles["shaft"] not in union:
            raise RexsError("a relation 'planet_shaft' lacks the shaft or the planetary_stage")
        shaft = model.components[relation.roles["shaft"]]
        stage = relation.roles["planetary_stage"]
        root = union.root(shaft.number)
        gears = sorted(
            (part.whole("number_of_teeth") or 0, part.quantity("normal_module") or 0.0)
            for part in groups[root]
            if part.type in GEARS
        )
        if gears:
            key = (stage, *gears, places.position(shaft)[2])
            sets.setdefault(key, (stage, []))[1].append((root, shaft))
    return list(sets.values())


@dataclass(frozen=True)
class _Planet:
    """A planet on its carrier: angle in degrees, distance from the axis in mm, root of its parts, its shaft."""

    angle: float
    radius: float
    root: int
    shaft: Component


def _carrier(
    model: Model, union: _Union, by_root: Mapping[int, RigidGroup], stage: int, shaft: Component
) -> RigidGroup:
    """Carrier of the planets of a stage, of which one has the shaft."""
    held = [
        part.number
        for kind in ("planet_carrier_shaft", "planet_pin")
        for part in model.related(kind, "planetary_stage", stage, "shaft")
    ]
    carriers = (by_root.get(union.root(number)) for number in held if number in union)
    carrier = next((body for body in carriers if body is not None), None)
    if carrier is None:
        raise RexsError(
            f"{model.components[stage]}: no planet_carrier_shaft or planet_pin defines the carrier of {shaft}"
        )
    return carrier


def _orbits(
    places: ComponentPositions, members: Sequence[tuple[int, Component]], axis: tuple[float, float]
) -> list[list[_Planet]]:
    """Return sets of planets at equal distance from the carrier axis, ordered by angle; a Ravigneaux set has two."""
    orbits: list[list[_Planet]] = []
    for root, shaft in members:
        x, y, _ = places.position(shaft)
        dx = x - axis[0]
        dy = y - axis[1]
        angle = round(math.degrees(math.atan2(dy, dx)) % 360.0, 9) % 360.0
        planet = _Planet(angle, math.hypot(dx, dy), root, shaft)
        orbit = next((planets for planets in orbits if abs(planets[0].radius - planet.radius) <= COAXIAL), None)
        if orbit is None:
            orbits.append([planet])
        else:
            orbit.append(planet)
    orbits.sort(key=lambda planets: planets[0].radius)
    return [sorted(orbit, key=lambda planet: planet.angle) for orbit in orbits]


def _order_by_mating_planets(
    model: Model, groups: Mapping[int, list[Component]], placed: list[_Planet], earlier: Sequence[RigidGroup]
) -> list[_Planet]:
    """Rotate the order of planets so that each has the number of the planet of another set with which it meshes."""
    mates: dict[int, set[int]] = {}
    for relation in model.relations_of("stage"):
        one, other = (relation.roles.get(role, -1) for role in ("gear_1", "gear_2"))
        mates.setdefault(one, set()).add(other)
        mates.setdefault(other, set()).add(one)
    first = {mate for part in groups[placed[0].root] for mate in mates.get(part.number, ())}
    for body in earlier:
        for number, parts in enumerate((body.parts, *body.others)):
            if first & {part.number for part in parts} and len(body.angles) == len(placed):
                return placed[-number:] + placed[:-number] if number else placed
    return placed


def _names(groups: Mapping[int, list[Component]], carriers: set[int]) -> dict[int, str]:
    """Names of the bodies other than planets, by role, numbered in the order of the file."""
    roles: dict[str, list[int]] = {}
    for root, parts in groups.items():
        if _is_fixed(parts, ()):
            role = "housing"
        elif root in carriers:
            role = "carrier"
        else:
            role = "shaft"
        roles.setdefault(role, []).append(root)
    names = {root: _lettered("carrier", n, len(roles["carrier"])) for n, root in enumerate(roles.get("carrier", []))}
    names |= dict.fromkeys(roles.get("housing", []), "housing")
    return names | {root: f"shaft_{number}" for number, root in enumerate(roles.get("shaft", []), 1)}


def _lettered(name: str, number: int, count: int) -> str:
    return name if count == 1 else f"{name}_{chr(ord('a') + number % 26)}"
