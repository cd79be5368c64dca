"""Stages, gears and pairs of a REXS file as tables of the gearbox file; equal planets have one table."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from exugear.exchange.rexs.to_case.bodies import RigidGroup, RigidGroups
from exugear.exchange.rexs.to_case.meshing import (
    PLACE_TOLERANCE,
    Stage,
    centre_distance,
    modification_of,
    reports_impossible,
    unchecked,
    with_clear_tips,
    with_equal_racks,
    with_fitting_tool,
    with_form_circles,
    with_possible_cutter,
    with_shifts,
)
from exugear.exchange.rexs.to_case.notes import Block, ComponentPositions, Entry, Notes, assumed, derived, read, tidy
from exugear.exchange.rexs.to_case.shafts import Cylinder, seat_diameter
from exugear.exchange.rexs.to_case.toothing import Toothing, is_rigid, material_of, material_table, toothing_of
from exugear.exchange.rexs.tree import Component, Model, RexsError

FACE_TOLERANCE = 1e-3
"""Largest difference of face widths that is not reported, mm."""
LEAST_RIM = 1.0
"""Minimum rim thickness between root circle and seat, in normal modules; below it the gear is integral with its shaft.
"""
ANGLE_TOLERANCE = 0.01
"""Largest difference of two values of a direction that is not reported, deg."""
HELD_SHARE = 0.6
"""Assumed fixed diameter of a gear that is integral with its shaft, divided by its root diameter."""


@dataclass(frozen=True)
class Teeth:
    """All meshing gears, with their names, stages and bodies; of equal planets only the first."""

    gears: Mapping[int, Toothing]
    """Gears by the number of their component."""
    names: Mapping[int, str]
    stages: Mapping[str, Stage]
    """Stages by the name of their pair."""
    bodies: Mapping[int, RigidGroup]
    z: Mapping[int, float]
    """Axial position of the middle of each gear, mm."""


def teeth_of(model: Model, places: ComponentPositions, bodies: RigidGroups, notes: Notes) -> Teeth:
    """Collect gears and stages.

    Raises
    ------
    RexsError
        Stages cannot be converted to gear pairs; all reasons are reported.
    """
    first = first_of_planets(places, bodies)
    met: dict[frozenset[int], tuple[Component, list[Component]]] = {}
    for relation in model.relations_of("stage"):
        with notes.errors.gathered():
            missing = [role for role in ("stage", "gear_1", "gear_2") if role not in relation.roles]
            if missing:
                raise RexsError(f"a relation 'stage' has no {' and no '.join(missing)}")
            part, *both = (model.components[relation.roles[role]] for role in ("stage", "gear_1", "gear_2"))
            pair = frozenset(first.get(gear.number, gear.number) for gear in both)
            if len(pair) == 1:
                raise RexsError(f"{part}: planets of one set mesh with each other; correct the stage")
            met.setdefault(pair, (part, [model.components[number] for number in sorted(pair)]))
            _check_direction(places, part, both, notes)
    notes.errors.tell()
    mates: dict[int, list[Component]] = {}
    for _, (component, mate) in met.values():
        mates.setdefault(component.number, []).append(mate)
        mates.setdefault(mate.number, []).append(component)
    gears: dict[int, Toothing] = {}
    for number, partners in mates.items():
        with notes.errors.gathered():
            gears[number] = toothing_of(model, model.components[number], partners, notes)
    notes.errors.tell()
    stages = _ordered(places, met.values(), gears, notes)
    notes.errors.tell()
    _check_equal_planets(model, first, gears, notes)
    gears = with_equal_racks(gears, stages, notes)
    gears = with_shifts(gears, stages, notes)
    for number, gear in gears.items():
        with reports_impossible(gear):
            gears[number] = with_form_circles(with_fitting_tool(with_possible_cutter(gear, notes), notes), notes)
    gears = with_clear_tips(gears, stages, notes)
    owners = {number: body for number in gears if (body := bodies.of(model.components[number])) is not None}
    lost = [str(gears[number].part) for number in gears if number not in owners]
    if lost:
        raise RexsError(f"{', '.join(lost)}: no relation defines its shaft")
    pairs: dict[str, Stage] = {}
    for number, stage in enumerate(stages, 1):
        planet = next((owners[gear].name for gear in stage.both if owners[gear].carrier), "")
        of_planets = owners[stage.pinion].carrier and owners[stage.gear].carrier
        central = "ring" if gears[stage.gear].internal else "sun"
        name = f"{central}_{planet}" if planet and not of_planets else ""
        pairs[name if name and name not in pairs else f"stage_{number}"] = stage
    return Teeth(
        gears,
        _gear_names(gears, stages, owners),
        pairs,
        owners,
        {number: places.position(gear.part)[2] for number, gear in gears.items()},
    )


def first_of_planets(places: ComponentPositions, bodies: RigidGroups) -> dict[int, int]:
    """Map the gear of each planet to the equal gear of the first planet, by their numbers."""

    def ordered(parts: Iterable[Component]) -> list[int]:
        gears = [part for part in parts if part.type == "cylindrical_gear"]
        gears.sort(key=lambda gear: (gear.whole("number_of_teeth") or 0, places.position(gear)[2]))
        return [gear.number for gear in gears]

    return {
        number: own
        for body in bodies.members
        for planet in body.others
        for own, number in zip(ordered(body.parts), ordered(planet), strict=True)
    }


def _check_direction(places: ComponentPositions, stage: Component, gears: Sequence[Component], notes: Notes) -> None:
    """Compare the direction of the line of centres with the positions."""
    first, second = (places.position(gear) for gear in gears)
    stated = stage.quantity("rotating_angle_around_neg_u_axis")
    # Angle of the second gear's centre as seen from the first, zero along w and positive towards v.
    angle = math.degrees(math.atan2(second[0] - first[0], second[1] - first[1]))
    if stated is not None and abs(math.remainder(stated - angle, 360.0)) > ANGLE_TOLERANCE:
        notes.checked.append(
            f"{stage}: rotated by {stated:g} deg in the file, by {angle:.4f} deg from the gear positions"
        )


def _ordered(
    places: ComponentPositions,
    met: Iterable[tuple[Component, list[Component]]],
    gears: Mapping[int, Toothing],
    notes: Notes,
) -> list[Stage]:
    stages = []
    for part, (first, second) in met:
        with notes.errors.gathered():
            if gears[first.number].internal and gears[second.number].internal:
                raise RexsError(f"{part}: two ring gears cannot mesh")
            pinion, gear = sorted(
                (first, second), key=lambda gear: (gears[gear.number].internal, gears[gear.number].teeth)
            )
            apart = math.dist(places.position(first)[:2], places.position(second)[:2])
            both = gears[pinion.number], gears[gear.number]
            if both[1].internal and both[1].teeth <= both[0].teeth:
                raise RexsError(f"{part}: a ring gear of {both[1].teeth} teeth is too small for {both[0].teeth}")
            distance = centre_distance(part, apart, both, notes)
            common = _common_face(places, part, *both)
            stages.append(Stage(part, pinion.number, gear.number, distance, apart, common))
    return stages


def _common_face(places: ComponentPositions, stage: Component, pinion: Toothing, gear: Toothing) -> Entry | None:
    """Return the common face width of the gears, if it is less than the narrower face width."""
    least = min(pinion.face_width.value, gear.face_width.value)
    low = -math.inf
    high = math.inf
    for toothing in (pinion, gear):
        z = places.position(toothing.part)[2]
        low = max(low, z - 0.5 * toothing.face_width.value)
        high = min(high, z + 0.5 * toothing.face_width.value)
    stated = stage.quantity("common_face_width")
    overlap = tidy(round(high - low, 6))
    if stated is not None and stated < min(least, overlap) - FACE_TOLERANCE:
        return read(tidy(stated), "common_face_width")
    if 0.0 < overlap < least - FACE_TOLERANCE:
        return derived(overlap, "overlap of the face widths at their positions")
    return None


def _check_equal_planets(model: Model, first: Mapping[int, int], gears: Mapping[int, Toothing], notes: Notes) -> None:
    for number, planet in first.items():
        if planet not in gears:
            continue
        other = toothing_of(model, model.components[number], [], Notes())
        mate = gears[planet]
        for key in ("module", "face_width", "helix_angle", "pressure_angle"):
            if abs(getattr(other, key).value - getattr(mate, key).value) > 1e-9:
                notes.errors.append(f"{other.part}: differs from {mate.part} in {key}; planets of a set must be equal")
    notes.errors.tell()


def axes_to_move(
    teeth: Teeth, bodies: RigidGroups, places: ComponentPositions
) -> list[tuple[tuple[Component, ...], tuple[float, float]]]:
    """Parts and the displacements (mm) that produce the selected centre distances; empty if all positions agree.

    The first body of a train is not moved. Coaxial bodies move together, planets along their own radii.

    Raises
    ------
    RexsError
        Moving a gear for one stage would change the centre distance of another.
    """
    if all(abs(stage.distance.value - stage.apart) <= PLACE_TOLERANCE for stage in teeth.stages.values()):
        return []
    axes = {body.name: body.axis for body in bodies.members}
    first = next(iter(teeth.stages.values()))
    settled = set(_coaxial(bodies, teeth.bodies[first.pinion]))
    open_stages = list(teeth.stages.values())
    while open_stages:
        touching = (s for s in open_stages if settled & {teeth.bodies[number].name for number in s.both})
        stage = next(touching, open_stages[0])
        open_stages.remove(stage)
        one = teeth.bodies[stage.pinion]
        other = teeth.bodies[stage.gear]
        base, moving = (one, other) if one.name in settled else (other, one)
        stands = axes[base.name], axes[moving.name]
        apart = math.dist(*stands)
        if moving.name in settled:
            if abs(apart - stage.distance.value) > PLACE_TOLERANCE:
                raise RexsError(
                    f"{stage.part}: its centre distance of {stage.distance.value:g} mm contradicts the other stages; "
                    "import with --distances positions, or correct them"
                )
            continue
        share = stage.distance.value / apart - 1.0
        by = share * (stands[1][0] - stands[0][0]), share * (stands[1][1] - stands[0][1])
        for name in _coaxial(bodies, moving):
            axes[name] = axes[name][0] + by[0], axes[name][1] + by[1]
            settled.add(name)
    return [move for body in bodies.members for move in _moves(places, bodies, body, axes)]


def _coaxial(bodies: RigidGroups, body: RigidGroup) -> list[str]:
    """Names of the coaxial bodies; a planet forms its own group."""
    if body.carrier:
        return [body.name]
    return [
        member.name
        for member in bodies.members
        if not member.carrier and math.dist(member.axis, body.axis) <= PLACE_TOLERANCE
    ]


def _moves(
    places: ComponentPositions, bodies: RigidGroups, body: RigidGroup, axes: Mapping[str, tuple[float, float]]
) -> Iterator[tuple[tuple[Component, ...], tuple[float, float]]]:
    """Yield the displacements of the parts of a body; each planet of a set moves along its own radius."""
    new = axes[body.name]
    if not body.carrier:
        yield body.parts, (new[0] - body.axis[0], new[1] - body.axis[1])
        return
    carrier = next(member for member in bodies.members if member.name == body.carrier)
    centre = axes[carrier.name]
    orbit = math.dist(new, axes[carrier.name])
    for parts, degrees in zip((body.parts, *body.others), body.angles, strict=True):
        angle = math.radians(degrees)
        target = centre[0] + orbit * math.cos(angle), centre[1] + orbit * math.sin(angle)
        x, y, _ = places.position(next(part for part in parts if part.given("support_vector")))
        yield parts, (target[0] - x, target[1] - y)


def _gear_names(
    gears: Mapping[int, Toothing], stages: Sequence[Stage], owners: Mapping[int, RigidGroup]
) -> dict[int, str]:
    """Role of each gear; several gears of one role are numbered in the order of the stages."""
    central = {
        number
        for stage in stages
        for number, mate in (stage.both, stage.both[::-1])
        if owners[mate].carrier and not owners[number].carrier
    }
    roles: dict[str, list[int]] = {}
    for number in dict.fromkeys(number for stage in stages for number in stage.both):
        if gears[number].internal:
            role = "ring"
        elif owners[number].carrier:
            role = "planet_gear"
        else:
            role = "sun" if number in central else "gear"
        roles.setdefault(role, []).append(number)
    return {
        number: role if len(numbers) == 1 and role != "gear" else f"{role}_{place}"
        for role, numbers in roles.items()
        for place, number in enumerate(numbers, 1)
    }


def gear_blocks(
    model: Model, teeth: Teeth, sections: Mapping[str, Sequence[Cylinder]], notes: Notes
) -> dict[str, Block]:
    """Tables of the gears; `sections` are the shaft sections of each body."""
    blocks = {}
    for number, gear in teeth.gears.items():
        entries = _entries(model, gear, teeth.z[number], sections[teeth.bodies[number].name], notes)
        block = blocks[teeth.names[number]] = Block(str(gear.part), entries)
        with notes.errors.gathered():
            modification = modification_of(model, gear, notes)
            if modification:
                block.blocks["modification"] = Block("", modification)
    return blocks


def _entries(model: Model, gear: Toothing, z: float, sections: Sequence[Cylinder], notes: Notes) -> dict[str, Entry]:
    rack = {"addendum": 1.0, "dedendum": gear.dedendum.value, "tip_radius": gear.tip_radius.value}
    tip = "addendum: tip_diameter_mm is used" if gear.tip is not None else "addendum: A"
    parts = (tip, f"dedendum: {gear.dedendum.comment}", f"tip radius: {gear.tip_radius.comment}")
    material = material_of(model, gear.part)
    table = material_table(material)
    if table is None and is_rigid(material):
        notes.changed.append(f"{gear.part}: its material means 'rigid'; steel is used")
    chamfer = read(gear.chamfer, "tooth_tip_chamfer, or tip_form_diameter")
    entries = {
        "teeth": read(gear.teeth, "number_of_teeth"),
        "internal": read(True, "ring_gear") if gear.internal else None,
        "normal_module_mm": gear.module,
        "normal_pressure_angle_deg": gear.pressure_angle,
        "helix_angle_deg": gear.helix_angle,
        "profile_shift": gear.shift or assumed(0.0, ""),
        "face_width_mm": gear.face_width,
        "held_diameter_mm": _held(gear, z, sections),
        "tooth_thickness": gear.allowances,
        "tooth_thinning_mm": None if gear.allowances else gear.thinning,
        "tip_diameter_mm": gear.tip,
        "root_diameter_mm": gear.root,
        "tip_chamfer_mm": chamfer if gear.chamfer else None,
        "root_form_diameter_mm": gear.root_form,
        "rack": Entry(rack, "; ".join(" ".join(part.split()) for part in parts)),
        "cutter": gear.cutter,
        "material": table,
    }
    return {key: entry for key, entry in entries.items() if entry is not None}


def _held(gear: Toothing, z: float, sections: Sequence[Cylinder]) -> Entry:
    """Return the fixed diameter of the tooth model: the seat, if the remaining rim is thick enough."""
    root = 2e3 * unchecked("", gear).root_radius
    seat = seat_diameter(sections, z, gear.face_width.value, gear.internal)
    rim = 0.0 if seat is None else 0.5 * abs(root - seat)
    fits = seat is not None and ((seat > root) if gear.internal else (0.0 < seat < root))
    if fits and seat is not None and rim >= LEAST_RIM * gear.module.value:
        return derived(
            tidy(seat), "seat on its shaft" if not gear.internal else ("outside diameter of the ring, in its seat")
        )
    if gear.internal:
        return assumed(tidy(round(root + 6.0 * gear.module.value, 4)), "root diameter and a rim of 3 normal modules")
    why = f"{HELD_SHARE:g} root diameters: integral with its shaft, or no seat specified"
    return assumed(tidy(round(HELD_SHARE * root, 4)), why)


def pair_blocks(teeth: Teeth) -> dict[str, Block]:
    """Tables of the gear pairs."""
    blocks = {}
    for name, stage in teeth.stages.items():
        block = blocks[name] = Block(str(stage.part))
        block.entries["pinion"] = Entry(teeth.names[stage.pinion])
        block.entries["gear"] = Entry(teeth.names[stage.gear])
        block.entries["centre_distance_mm"] = stage.distance
        if stage.common_face:
            block.entries["common_face_width_mm"] = stage.common_face
    return blocks


def mesh_blocks(teeth: Teeth) -> dict[str, Block]:
    """Tables of the meshes: one for each pair, also for all planets of a set."""
    blocks = {}
    for name, stage in teeth.stages.items():
        names = {
            "pair": name,
            "pinion_body": teeth.bodies[stage.pinion].name,
            "gear_body": teeth.bodies[stage.gear].name,
        }
        blocks[name] = Block("", {key: Entry(value) for key, value in names.items()})
    return blocks
