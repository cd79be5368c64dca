"""Loads on what stands still as signals: moments of its bearings, loads of its gears, reactions of excitations.

A gear of a fixed body, such as a ring gear, feels the force F of each of its meshes along the row g of its six
coordinates as the load -g F, the moment by which teeth resist misalignment along the row of this, and the friction of
its teeth along its own rows. The rows of planets' meshes turn with the carrier. In multi-blade components the sum over
equal planets is constant: the mean wave gives the axial force and the torque, cosine and sine the rest.

An excitation with a reaction on a fixed body, such as the torque between rotor and stator, acts on that body in the
opposite sense.
"""

from __future__ import annotations

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import node_position
from exugear.steady.mean_system.mesh_waves import MeshWaves
from exugear.steady.mean_system.rotating_frame import RotatingFrame
from exugear.system.kernels.coordinates import BODY_SIZE, TILT
from exugear.system.kernels.meshes import TILT_LEVER
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.element import MeshElement
from exugear.system.tooth_mesh.laws.friction import FRICTION_PARTS
from fe_ste.tools.arrays import Complexes, Floats, Integers

GEAR_FORCE, GEAR_MOMENT = "gear_force", "gear_moment"
"""Signals of the meshes' load on a gear of a fixed body, about the middle of the gear on its axis."""
REACTION_FORCE, REACTION_MOMENT = "reaction_force", "reaction_moment"
"""Signals of the reaction of an excitation on a fixed body, about the seat of the excitation on a flexible body, else
about its place on the axis of the body that it acts on."""


def moment_supports(assembly: Assembly) -> Integers:
    """Numbers of the supports whose moments are signals: bearings between a moving body and one that stands still."""
    standing = {bearing.name for bearing in assembly.gearbox.standing_bearings}
    return np.array([n for n, support in enumerate(assembly.supports) if support.name in standing], dtype=np.int64)


def standing_gears(frame: RotatingFrame) -> tuple[str, ...]:
    """Gears of fixed bodies on which the load is the same wherever the carrier stands.

    It is not on flexible sectors, and where planets are not alike.
    """
    assembly = frame.assembly
    found = {
        gear: None
        for mesh, element in enumerate(assembly.elements)
        for body, gear in _ends(element)
        if assembly.gearbox.body(body).fixed and not frame.varying_carrier_of(mesh)
    }
    return tuple(found)


def reacting_excitations(gearbox: Gearbox) -> tuple[str, ...]:
    """Excitations that have a reaction on a fixed body."""
    fixed = {body.name for body in gearbox.bodies() if body.fixed}
    return tuple(dict.fromkeys(own.excitation for own in gearbox.varying_loads if own.reaction_on in fixed))


def reactions(assembly: Assembly) -> Complexes:
    """Return reactions of the stated loads on fixed bodies, (l, 6 r) for r `reacting_excitations`; w as in the loads.

    Force along x, y, z, then moment about them.
    """
    gearbox = assembly.gearbox
    names = reacting_excitations(gearbox)
    found = np.zeros((len(gearbox.varying_loads), BODY_SIZE * len(names)), dtype=complex)
    for row, load in zip(found, gearbox.varying_loads, strict=True):
        if load.reaction_on is None or load.excitation not in names:
            continue
        first = BODY_SIZE * names.index(load.excitation)
        force, moment = np.split(-np.array(load.wrench), 2)
        seat = assembly.loaded_seat(load.excitation, load.reaction_on)
        if seat is not None and load.position is not None:
            moment = moment + np.cross(np.subtract(load.position, seat.position), force)
        row[first : first + BODY_SIZE] = [*force, *moment]
    return found


def gear_load_rows(waves: MeshWaves) -> tuple[Floats, Floats, Floats]:
    """Return loads of the standing gears per unit of the force and of the moment of each wave, (m, 6 gears) each.

    Those per unit of the forces and moments of friction (m, `FRICTION_PARTS`, 6 gears) follow. Force along x, y, z,
    then moment about them, gear by gear in the order of `standing_gears`. The force acts along its row less the lever
    arm of the load times that of the misalignment, as in `exugear.system.tooth_mesh.laws.mesh_forces`.
    """
    assembly = waves.assembly
    gears = standing_gears(waves.system.frame)
    along, turning, *sliding = np.zeros((2 + FRICTION_PARTS, len(waves.waves), BODY_SIZE * len(gears)))
    groups = {meshes[0]: (meshes, planets) for meshes, planets in waves.groups}
    for number, wave in enumerate(waves.waves):
        meshes, planets = groups[wave.first]
        shapes = np.ones((1, 1)) if planets is None else planets.shapes(0.0)[0]
        if waves.system.frame.varying_carrier_of(wave.first):
            continue
        for mesh, share in zip(meshes, shapes[:, wave.wave], strict=True):
            element = assembly.elements[mesh]
            lever = assembly.meshes.tilt[mesh, TILT_LEVER]
            force = (element.force - lever * element.misalignment) / element.line_of_action
            # Rows of meshes are those of a deflection, against which they push; those of friction have its sense.
            friction = zip(sliding, -element.friction_rows, strict=True)
            for part, rows in ((along, force), (turning, element.misalignment), *friction):
                for (body, gear), row in zip(_ends(element), rows.reshape(2, BODY_SIZE), strict=True):
                    if gear in gears and assembly.gearbox.body(body).fixed:
                        first = BODY_SIZE * gears.index(gear)
                        part[number, first : first + BODY_SIZE] -= share * _about_gear(assembly, body, gear, row)
    return along, turning, np.stack(sliding, axis=1)


def _ends(element: MeshElement) -> tuple[tuple[str, str], tuple[str, str]]:
    """Body and gear of both ends of a mesh."""
    mesh = element.mesh
    return (mesh.pinion, mesh.pair.pinion.name), (mesh.gear, mesh.pair.gear.name)


def _about_gear(assembly: Assembly, name: str, gear: str, row: Floats) -> Floats:
    """Row (6,) about the middle of the gear, from that about the node that carries it."""
    body = assembly.gearbox.body(name)
    node = node_position(body)
    elastic = assembly.elastic_bodies.get(name)
    if elastic is not None:
        node = np.array(next(seat.position for seat in elastic.reduced.seats if seat.name == gear))
    force, moment = row[:TILT], row[TILT:]
    return np.concatenate([force, moment + np.cross(node - np.array([*body.axis, body.wheels[gear]]), force)])
