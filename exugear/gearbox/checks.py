"""Consistency checks between the parts of a gearbox: masses, positions, assembly of planets, supports."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from exugear.gearbox.body_parts import blank_places
from exugear.gearbox.parts import (
    Bearing,
    Body,
    Coupling,
    Joint,
    LoadCase,
    Mesh,
    PointForce,
    VaryingLoad,
    connector_matrix,
)
from exugear.gearbox.reading import GearboxFileError, known_names, shortened
from exugear.gearbox.sections.case import GearboxFile
from exugear.gearbox.sections.connections import BearingSection, ConnectorDampingSection, StiffnessSection
from exugear.gearbox.sections.entries import GROUND
from exugear.gearbox.train import Train
from exugear.gearbox.units import MEASURED_UNITS, unit_of
from fe_ste.geometry.gears import Gear

CENTRE_DISTANCE_TOLERANCE = 2e-5
"""Allowed difference between a pair's centre distance and the positions of its bodies, m."""
AXIS_TOLERANCE = 1e-6
"""Allowed distance of a central gear from the axis of the carrier whose planets it meshes with, m."""
ASSEMBLY_TOLERANCE = 2e-3
"""Allowed deviation from the assembly condition, in teeth; it covers the rounding of angles in a file."""
MATRIX_TOLERANCE = 1e-4
"""Allowed rounding of a stiffness matrix relative to its diagonal, for matrices printed with five digits."""
LARGEST_MATRICES = 2e9
"""Memory limit for the matrices of all elements together, bytes; each matrix covers the coordinates of all bodies."""

Element = Mesh | Bearing | Coupling | PointForce
"""Part that exerts forces."""


def errors_of_bodies(case: GearboxFile) -> Iterator[str]:
    """Yield errors for names that are already used, impossible carriers, and unknown gears of bodies."""
    if GROUND in case.bodies:
        yield f"bodies.{GROUND}: {GROUND} is the name of the fixed frame; choose another name"
    families: dict[str, str] = {}
    for family, section in case.bodies.items():
        count = len(section.planet_angles_deg)
        for name in [f"{family}_{number}" for number in range(1, count + 1)] or [family]:
            if name in families:
                yield (
                    f"bodies.{family}: planets are numbered, and bodies.{families[name]} has the same name {name}; "
                    "rename one"
                )
            families[name] = family
        for gear in section.gears_z_mm:
            if gear not in case.gears:
                known = known_names("gears", case.gears, f"gears.{gear}", gear)
                yield f"bodies.{family}.gears_z_mm.{gear}: no such gear; {known}"
        if section.enabled and section.carrier is not None:
            key = f"bodies.{family}.carrier = {section.carrier!r}"
            carrier = case.bodies.get(section.carrier)
            if carrier is None:
                yield f"{key}: no such body; bodies are {', '.join(case.bodies)}"
            elif not carrier.enabled:
                yield f"{key}: that body is not enabled"
            elif carrier.carrier is not None:
                yield f"{key}: a carrier cannot be a planet"
            elif carrier.spin_only:
                yield f"{key}: a spin-only body has no position and cannot carry planets"


def errors_of_pairs(case: GearboxFile) -> Iterator[str]:
    """Yield errors for unknown gears of pairs."""
    for name, section in case.pairs.items():
        for key, gear in (("pinion", section.pinion), ("gear", section.gear)):
            if gear not in case.gears:
                known = known_names("gears", case.gears, f"gears.{gear}", gear)
                yield f"pairs.{name}.{key} = {gear!r}: no such gear; {known}"


def errors_of_strengths(case: GearboxFile) -> Iterator[str]:
    """Yield errors for strengths and roughnesses of unknown gears, which losses would replace by usual values."""
    for gear in case.rating.gears if case.rating else ():
        if gear not in case.gears:
            yield f"rating.gears.{gear}: no such gear; {known_names('gears', case.gears, f'gears.{gear}', gear)}"


def errors_of_blanks(case: GearboxFile) -> Iterator[str]:
    """Yield errors for blanks of stepped shafts without a seat, if the inertia follows from the shape.

    The computed inertia would lack these blanks. If it is specified, they affect only a flexible shaft, which refuses
    them.
    """
    for family, section in case.bodies.items():
        if section.shape is None or section.inertia:
            continue
        seats = blank_places(case, family)
        for blank in section.shape.blanks:
            if blank not in seats:
                known = ", ".join(seats) or "none yet"
                yield f"bodies.{family}.shape.blanks.{blank}: no such seat on the body; seats are {known}"


def errors_of_inertia_sets(case: GearboxFile, inertia_sets: Sequence[str]) -> Iterator[str]:
    """Yield an error if no body moves, or if no body has the default inertia set."""
    if not inertia_sets:
        yield "bodies: all bodies are fixed; a gearbox needs at least one body without fixed = true"
    elif case.default_inertias not in inertia_sets:
        stated = "default_inertias" in case.model_fields_set
        what = f"default_inertias = {case.default_inertias!r}: no such set" if stated else "default_inertias: missing"
        yield f"{what}; sets are {', '.join(inertia_sets)}"


def errors_of_size(named_bodies: Mapping[str, Body], elements: Mapping[str, Sequence[Element]]) -> Iterator[str]:
    """Yield an error if the matrices exceed the memory: each element has stiffness and damping over all coordinates."""
    count = sum(map(len, elements.values()))
    coordinates = 6 * len(named_bodies)
    if 16.0 * count * coordinates**2 > LARGEST_MATRICES:
        yield (
            f"bodies: {len(named_bodies)} with {count} meshes, bearings and couplings are too many: their "
            f"matrices take more than {1e-9 * LARGEST_MATRICES:g} GB"
        )


def errors_of_overall(case: GearboxFile, spinning: Sequence[str]) -> Iterator[str]:
    """Yield errors for an overall input or output that cannot rotate, or that is the same body although gears exist."""
    overall = case.overall
    for key, body in (("input", overall.input), ("output", overall.output)):
        if body not in spinning:
            yield f"overall.{key} = {body!r}: no such rotating body; bodies are {', '.join(spinning)}"
            return
    if overall.input == overall.output and case.gears:
        yield f"overall.output = {overall.output!r}: is also the input; set the body at the other end"


def errors_of_output_gear(
    case: GearboxFile, gears: Collection[str], named_bodies: Mapping[str, Body], couplings: Sequence[Coupling]
) -> Iterator[str]:
    """Yield an error if the output gear does not rotate with the output.

    The overall transmission error is expressed as a length at this gear. If the output has no gear, as with a carrier,
    every gear is accepted. A rotor without gears needs no output gear.
    """
    overall = case.overall
    if overall.output_gear is None:
        if gears:
            yield (
                "overall.output_gear: this key is missing; set the gear whose base radius converts the output angle "
                "to a length"
            )
        return
    if overall.output_gear not in gears:
        listed = known_names("gears", gears, f"gears.{overall.output_gear}", overall.output_gear)
        yield f"overall.output_gear = {overall.output_gear!r}: no such gear; {listed}"
        return
    # Names of the body and of all bodies that couplings connect to it; they rotate at one speed.
    turning = {overall.output}
    for _ in couplings:
        turning |= {name for c in couplings if {c.first, c.second} & turning for name in (c.first, c.second)}
    known = [gear for body in named_bodies.values() if body.name in turning for gear in body.wheels]
    if known and overall.output_gear not in known:
        yield (
            f"overall.output_gear = {overall.output_gear!r}: does not rotate with {overall.output}; gears that do are "
            f"{', '.join(known)}"
        )


def errors_of_repetition(
    case: GearboxFile, deviations: Collection[tuple[str, str]], pin_offsets: Collection[str]
) -> Iterator[str]:
    """Yield errors for deviations of a gear or pin that are specified twice; the second would replace the first."""
    if len(deviations) < len(case.deviations):
        yield "deviations: two tables for the same gear; combine them in one"
    elif len(pin_offsets) < len(case.pins):
        yield "pins: two tables for the same planet; combine them in one"


def errors_of_mass_properties(case: GearboxFile) -> Iterator[str]:
    """Yield errors for missing mass properties."""
    for family, section in case.bodies.items():
        for inertias, values in section.inertia.items():
            if section.spin_only:
                continue
            for key in ("mass_kg", "transverse_kg_m2", "centre_of_mass_z_mm"):
                if getattr(values, key) is None:
                    yield (
                        f"bodies.{family}.inertia.{inertias}.{key}: this key is missing; only a spin_only body needs "
                        "axial_kg_m2 alone"
                    )


def errors_of_centre_distances(meshes: Iterable[Mesh], named_bodies: Mapping[str, Body]) -> Iterator[str]:
    """Yield errors for body positions that contradict the centre distance of a pair or the axis of a carrier."""
    for mesh in meshes:
        difference = mesh.centre_distance - mesh.pair.centre_distance
        if abs(difference) > CENTRE_DISTANCE_TOLERANCE:
            yield (
                f"pairs.{mesh.pair.name}.centre_distance_mm = {mesh.pair.centre_distance * 1e3:g}: the axes of bodies "
                f"{mesh.pinion} and {mesh.gear} are {mesh.centre_distance * 1e3:.4f} mm apart; the difference must be "
                f"below {CENTRE_DISTANCE_TOLERANCE * 1e3:g} mm"
            )
        for body in (mesh.pinion, mesh.gear):
            if mesh.frame != GROUND and named_bodies[body].carrier is None:
                apart = math.dist(named_bodies[body].axis, named_bodies[mesh.frame].axis)
                if apart > AXIS_TOLERANCE:
                    yield (
                        f"meshes.{mesh.family}: {body} is {apart * 1e3:.4f} mm off the axis of {mesh.frame}, with "
                        "which the line of centres rotates; only its planets may be off the axis"
                    )


def errors_of_planets(
    case: GearboxFile, named_bodies: Mapping[str, Body], gears: Mapping[str, Gear], meshes: Sequence[Mesh]
) -> Iterator[str]:
    """Yield errors for planets of one carrier that collide, in a set or between sets, and for impossible assembly."""
    planets = [body for body in named_bodies.values() if body.planet_of is not None]
    reported = set()
    for planet, other in itertools.combinations(planets, 2):
        if (planet.family, other.family) in reported or planet.planet_of != other.planet_of:
            continue
        if any({mesh.pinion, mesh.gear} == {planet.name, other.name} for mesh in meshes):
            continue
        if collision := next(_collisions(case, planet, other, gears), None):
            reported.add((planet.family, other.family))
            yield collision
    for family in case.bodies:
        others = {body.name for body in planets if body.family != family}
        yield from _errors_of_assembly(family, [body for body in planets if body.family == family], others, meshes)


def _collisions(case: GearboxFile, planet: Body, other: Body, gears: Mapping[str, Gear]) -> Iterator[str]:
    """Yield errors for gears of two planets that share an axial position and overlap."""
    gap = math.dist(planet.axis, other.axis)
    for wheel, other_wheel in itertools.product(planet.wheels, other.wheels):
        reach = 0.5 * (gears[wheel].face_width + gears[other_wheel].face_width)
        needed = gears[wheel].tip_radius + gears[other_wheel].tip_radius
        if abs(planet.wheels[wheel] - other.wheels[other_wheel]) < reach and gap <= needed:
            angles = [round(angle, 4) for angle in case.bodies[planet.family].planet_angles_deg]
            yield (
                f"bodies.{planet.family}.planet_angles_deg = {shortened(angles)}: {planet.name} and {other.name} "
                f"collide, their axes are {gap * 1e3:.2f} mm apart, their tips need more than {needed * 1e3:.2f} mm"
            )


def _errors_of_assembly(
    family: str, planets: Sequence[Body], others: Collection[str], meshes: Sequence[Mesh]
) -> Iterator[str]:
    """Yield errors for planets that violate the assembly condition relative to the first planet of the set.

    The path through two meshes with central gears must close on an integer number of teeth. Meshes with planets of
    another set are excluded: their closed chains depend on the positions of all teeth.

    With tooth numbers zp of the planet gear and zc of the central gear (negative for an external one), (zc_b zp_a -
    zc_a zp_b) angle / 2 pi must be a multiple of gcd(zp_a, zp_b); for one planet gear between sun and ring this is the
    familiar (z_sun + z_ring) angle / 2 pi = integer.
    """
    for planet in planets[1:]:
        teeth = [
            _teeth_on_planet(mesh, planet.name)
            for mesh in meshes
            if planet.name in (mesh.pinion, mesh.gear) and not {mesh.pinion, mesh.gear} & set(others)
        ]
        angle = planet.orbit_angle - planets[0].orbit_angle
        for planet_teeth, central_teeth in teeth[1:]:
            whole = math.gcd(planet_teeth, teeth[0][0])
            turns = (central_teeth * teeth[0][0] - teeth[0][1] * planet_teeth) / whole
            off = math.remainder(turns * angle / (2.0 * math.pi), 1.0)
            if abs(off) > ASSEMBLY_TOLERANCE:
                yield (
                    f"bodies.{family}.planet_angles_deg: {planet.name} cannot be assembled at "
                    f"{math.degrees(angle):.4f} deg from the first planet; angles must be multiples of "
                    f"360/{abs(turns):g} = {360.0 / abs(turns):.4f} deg"
                )


def _teeth_on_planet(mesh: Mesh, planet: str) -> tuple[int, int]:
    """Tooth numbers of the planet gear and of its mating gear; the latter is negative unless that gear is internal."""
    pinion = mesh.pair.pinion
    gear = mesh.pair.gear
    if mesh.pinion == planet:
        return pinion.teeth, gear.teeth if gear.internal else -gear.teeth
    return gear.teeth, -pinion.teeth


def errors_of_connection(case: GearboxFile, apart: Sequence[str], held_by_torsion: Collection[str]) -> Iterator[str]:
    """Yield errors for bodies without torsional support that no mesh, coupling or carrier connects to the input."""
    lost = [name for name in apart if name not in held_by_torsion]
    if lost:
        aside = [
            f"; couplings.{name} is disabled while bodies.{section.instead_of} is enabled"
            for name, section in case.couplings.items()
            if section.instead_of is not None and set(section.bodies) & set(lost)
        ]
        yield (
            f"bodies {', '.join(lost)} are not connected to {case.overall.input} by a mesh, coupling or carrier"
            f"{''.join(aside)}; the gear train must be connected. A body held only by bearings and mounts, such as a "
            "bearing pedestal, needs torsion_N_m_per_rad in one of them on a fixed body"
        )


def bodies_apart(
    case: GearboxFile, bodies: Iterable[Body], meshes: Iterable[Mesh], couplings: Iterable[Coupling]
) -> tuple[str, ...]:
    """Movable bodies that no mesh, coupling or carrier connects to the overall input."""
    bodies = tuple(bodies)
    links = [(mesh.pinion, mesh.gear) for mesh in meshes]
    links += [(coupling.first, coupling.second) for coupling in couplings]
    links += [(body.name, body.carrier) for body in bodies if body.carrier]
    reached = {case.overall.input}
    while True:
        more = {b for pair in links for a, b in (pair, pair[::-1]) if a in reached} - reached
        if not more:
            break
        reached |= more
    return tuple(body.name for body in bodies if not body.fixed and body.name not in reached)


def errors_of_torsion(
    spinning: Sequence[str], couplings: Iterable[Coupling], bearings: Iterable[Bearing]
) -> Iterator[str]:
    """Yield errors for ambiguous torsional load paths: loops of couplings, or bearings between two rotating bodies."""
    paths: dict[str, dict[str, list[str]]] = {name: {name: []} for name in spinning}
    for coupling in couplings:
        from_first = paths[coupling.first]
        from_second = paths[coupling.second]
        if coupling.second in from_first:
            yield (
                f"couplings {', '.join([*from_first[coupling.second], coupling.name])} form a loop: {coupling.first} "
                f"and {coupling.second} are connected twice; remove one of them"
            )
            return
        for start, to_start in list(from_first.items()):
            for end, to_end in list(from_second.items()):
                paths[start][end] = [*to_start[::-1], coupling.name, *to_end]
                paths[end][start] = paths[start][end][::-1]
    for bearing in bearings:
        torsion = connector_matrix(bearing.stiffness)[5, 5]
        if torsion and bearing.on in spinning:
            yield (
                f"bearings.{bearing.family}.stiffness: torsion {torsion:g} N m/rad between {bearing.on} and "
                f"{bearing.body}, which both rotate; set it in a [couplings] table, which makes them rotate together"
            )
            return


def errors_of_supports(case: GearboxFile) -> Iterator[str]:
    """Yield errors for stiffness and damping that are not symmetric, indefinite or zero throughout.

    Rolling bearings between the same bodies that overlap by half of their width or more are errors, too.
    """
    for table, sections in (("bearings", case.bearings), ("mounts", case.mounts)):
        for name, section in sections.items():
            key = f"{table}.{name}"
            stiffness = section.stiffness
            damping = section.damping
            catalogue = isinstance(section, BearingSection) and section.catalogue is not None
            if stiffness is not None:
                yield from _errors_of_matrix(f"{key}.stiffness", stiffness)
                if not catalogue and not np.any(connector_matrix(stiffness)):
                    yield f"{key}.stiffness: is zero in all directions; set at least one above zero"
            if damping is not None:
                yield from _errors_of_matrix(f"{key}.damping", damping)
    rolling = [(name, bearing) for name, bearing in case.bearings.items() if bearing.catalogue is not None]
    for (first, bearing), (second, other) in itertools.combinations(rolling, 2):
        distance = abs(bearing.z_mm - other.z_mm)
        half = 0.5 * sum(section.catalogue.width_mm for section in (bearing, other) if section.catalogue)
        if (bearing.body, bearing.on) == (other.body, other.on) and distance < 0.5 * half:
            yield (
                f"bearings.{second}.z_mm = {other.z_mm:g}: is at the position of bearings.{first} ({distance:g} "
                f"mm apart), and both support {bearing.body} on {bearing.on}; set different positions, or one "
                "bearing with an arrangement"
            )


def _errors_of_matrix(key: str, section: StiffnessSection | ConnectorDampingSection) -> Iterator[str]:
    """Yield an error for an unsymmetric or indefinite matrix, scaled by its diagonal since units differ by row."""
    if section.matrix is None:
        return
    matrix = connector_matrix(section)
    scale = np.sqrt(np.abs(np.diag(matrix)))
    scaled = matrix / np.outer(*[np.where(scale > 0.0, scale, 1.0)] * 2)
    skew = np.abs(scaled - scaled.T)
    row, column = (int(index) for index in np.unravel_index(np.argmax(skew), skew.shape))
    if skew[row, column] > MATRIX_TOLERANCE:
        yield (
            f"{key}.matrix: is not symmetric: {matrix[row, column]:g} in row {row + 1}, column {column + 1}, but "
            f"{matrix[column, row]:g} in row {column + 1}, column {row + 1}"
        )
    elif np.linalg.eigvalsh(0.5 * (scaled + scaled.T))[0] < -MATRIX_TOLERANCE:
        yield f"{key}.matrix: is not positive semi-definite (negative eigenvalue); correct the matrix"


def errors_of_seals(case: GearboxFile, named_bodies: Collection[str]) -> Iterator[str]:
    """Yield an error for each seal between bodies that are not in the file, or between a body and itself."""
    for name, seal in case.seals.items():
        for key, body in (("body", seal.body), ("on", seal.on)):
            if body not in named_bodies and not (key == "on" and body == GROUND):
                yield f"seals.{name}.{key} = {body!r}: no such body; bodies are {', '.join(named_bodies)}"
        if seal.body == seal.on:
            yield f"seals.{name}.on = {seal.on!r}: is the body that the seal slides on; set another body, or remove on"


def errors_of_measurements(case: GearboxFile, named_bodies: Mapping[str, Body]) -> Iterator[str]:
    """Yield an error for each measurement at a shaft or place, or with a load case, that is not in the file."""
    turning = {name: body for name, body in named_bodies.items() if not body.fixed}
    places = {**case.bearings, **case.mounts}
    for name, measurement in case.measurements.items():
        key = f"measurements.{name}"
        for kind, source in (("tacho", measurement.tacho), ("speed", measurement.speed)):
            if source is not None and source.shaft not in turning:
                known = known_names("shafts", turning, "bodies.NAME", source.shaft)
                yield f"{key}.{kind}.shaft = {source.shaft!r}: no such shaft; {known}"
        if measurement.load_case is not None and measurement.load_case not in case.load_cases:
            known = known_names("load cases", case.load_cases, "load_cases.NAME", measurement.load_case)
            yield f"{key}.load_case = {measurement.load_case!r}: no such load case; {known}"
        units = [("speed", "speed", measurement.speed.unit)] if measurement.speed is not None else []
        units += [(f"channels.{own}", section.quantity, section.unit) for own, section in measurement.channels.items()]
        for place, quantity, text in units:
            unit = None if text is None else unit_of(text, any_case=True)
            kind, examples = MEASURED_UNITS[quantity]
            if text is not None and (unit is None or unit.quantity != kind):
                what = "unknown" if unit is None else f"a unit of {unit.quantity}"
                yield f"{key}.{place}.unit = {text!r}: {what}; set a unit of {quantity}, such as {examples}"
        for channel, section in measurement.channels.items():
            if section.place is not None and section.place not in places:
                known = known_names("bearings and mounts", places, "bearings.NAME", section.place)
                yield f"{key}.channels.{channel}.place = {section.place!r}: no such place; {known}"
            ends = (case.overall.input, case.overall.output)
            for encoder, kind, end in zip(section.encoders or (), ("input", "output"), ends, strict=False):
                if encoder.shaft != end:
                    yield (
                        f"{key}.channels.{channel}.encoders: shaft = {encoder.shaft!r}, but the overall {kind} is "
                        f"{end!r}; state the encoder of the input first, then that of the output"
                    )
            if section.body is not None and section.body not in turning:
                known = known_names("bodies", turning, "bodies.NAME", section.body)
                yield f"{key}.channels.{channel}.body = {section.body!r}: no such body; {known}"


def errors_of_names(elements: Mapping[str, Sequence[Element]]) -> Iterator[str]:
    """Yield an error for a name used twice among meshes, supports and couplings, since results list them together."""
    tables: dict[str, str] = {}
    for table, members in elements.items():
        for part in members:
            if part.name in tables:
                yield f"{table}.{part.name}: also a name in [{tables[part.name]}]; rename one"
                return
            tables[part.name] = table


def errors_of_excitations(
    varying_loads: Iterable[VaryingLoad], elements: Mapping[str, Sequence[Element]]
) -> Iterator[str]:
    """Yield an error for an excitation with the name of a mesh, support, coupling or force; results list them alike."""
    excitations = {load.excitation for load in varying_loads}
    for table, members in elements.items():
        for part in members:
            for name in sorted(excitations & {part.name, part.family if isinstance(part, Mesh) else part.name}):
                yield f"excitations.{name}: also a name in [{table}]; rename one"
                return


def errors_of_joints(joints: Iterable[Joint], named_bodies: Mapping[str, Body]) -> Iterator[str]:
    """Yield an error for the first invalid joint: on a fixed body, a second joint, or a planet off its carrier."""
    joined: dict[str, str] = {}
    for joint in joints:
        body = named_bodies[joint.body]
        if body.fixed or body.spin_only:
            yield f"joints.{joint.name}.body = {joint.body!r}: a fixed or spin-only body cannot have a joint"
            return
        if joint.body in joined:
            yield (
                f"joints.{joint.name}.body = {joint.body!r}: the body already has a joint on {joined[joint.body]}; a "
                "second ideal joint on the same axis is redundant"
            )
            return
        if body.carrier is not None and joint.on != body.carrier:
            yield f"joints.{joint.name}.on = {joint.on!r}: the joint of a planet is on its carrier {body.carrier!r}"
            return
        joined[joint.body] = joint.name


def errors_of_train(
    train: Train,
    gears: Collection[str],
    meshes: Sequence[Mesh],
    load_cases: Mapping[str, LoadCase],
    start_speeds: Callable[[LoadCase], object],
) -> Iterator[str]:
    """Check that the static load can be reacted and that the train has consistent kinematics from input to output."""
    train.static_mesh_forces()
    if gears and not meshes:
        yield "meshes: none is enabled; a gearbox with gears needs at least one"
        return
    _ = train.ratio
    for case in load_cases.values():
        try:
            start_speeds(case)
        except GearboxFileError as error:
            key = f"load_cases.{case.name}.start_speeds_rpm"
            raise GearboxFileError(*(f"{line}; see {key}" for line in error.errors)) from None


class Check(NamedTuple):
    """One check of a gearbox; it is skipped if a check that it needs fails or is skipped."""

    name: str
    """Name of the check; without a function, the attribute of the gearbox that is built, which checks its sections."""
    errors: Callable[..., Iterable[str]] | None = None
    """Function that yields error texts; its parameters are attributes of the gearbox."""
    needs: tuple[str, ...] = ()
    """Names of the checks that must succeed before this one is run."""


CHECKS = (
    Check("names of bodies", errors_of_bodies),
    Check("masses", errors_of_mass_properties),
    Check("names of pairs", errors_of_pairs),
    Check("strengths", errors_of_strengths),
    Check("gears", None, ("names of pairs",)),
    Check("file_stiffness"),
    Check("supports", errors_of_supports),
    Check("inertia sets", errors_of_inertia_sets, ("names of bodies", "masses")),
    Check("bodies_by_inertias", None, ("inertia sets",)),
    Check("modifications", None, ("gears",)),
    Check("gear_pairs", None, ("gears",)),
    Check("ends", errors_of_overall, ("bodies_by_inertias",)),
    Check("bearings", None, ("bodies_by_inertias",)),
    Check("joints", None, ("bodies_by_inertias",)),
    Check("mounts", None, ("bodies_by_inertias",)),
    Check("forces", None, ("bodies_by_inertias",)),
    Check("load_cases", None, ("bodies_by_inertias",)),
    Check("pin_offsets", None, ("bodies_by_inertias",)),
    Check("blanks", errors_of_blanks, ("bearings", "mounts", "forces")),
    Check("meshes", None, ("bodies_by_inertias", "gear_pairs")),
    Check("couplings", None, ("bearings",)),
    Check("deviations", None, ("bodies_by_inertias", "gears")),
    Check("distances", errors_of_centre_distances, ("meshes",)),
    Check("planets", errors_of_planets, ("meshes",)),
    Check("size", errors_of_size, ("meshes", "bearings", "mounts", "couplings", "forces")),
    Check("connection", errors_of_connection, ("ends", "meshes", "couplings", "mounts")),
    Check("torsion", errors_of_torsion, ("couplings", "supports")),
    Check("seals", errors_of_seals, ("ends",)),
    Check("measurements", errors_of_measurements, ("ends",)),
    Check("names", errors_of_names, ("meshes", "bearings", "mounts", "couplings", "forces")),
    Check("axes", errors_of_joints, ("joints",)),
    Check("repetition", errors_of_repetition, ("deviations", "pin_offsets")),
    Check("output", errors_of_output_gear, ("ends", "gears", "couplings")),
    Check("train", errors_of_train, ("connection", "size", "load_cases")),
    Check("varying_loads", errors_of_excitations, ("train", "names")),
)
"""Checks in the order in which they are run."""
ALONE = (
    "names of bodies",
    "masses",
    "names of pairs",
    "strengths",
    "gears",
    "file_stiffness",
    "supports",
    "modifications",
    "gear_pairs",
)
"""Checks that remain meaningful if other entries of the file cannot be read."""
