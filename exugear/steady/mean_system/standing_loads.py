"""Loads on what stands still as signals: moments of its bearings, and forces and moments of its gears.

A gear of a fixed body, such as a ring gear, feels the force F of each of its meshes along the row g of its six
coordinates as the load -g F, and the moment by which teeth resist misalignment along the row of this. The rows of
planets' meshes turn with the carrier. In multi-blade components the sum over equal planets is constant: the mean wave
gives the axial force and the torque, cosine and sine the rest.
"""

from __future__ import annotations

import numpy as np

from exugear.gearbox.parts import node_position
from exugear.steady.mean_system.mesh_waves import MeshWaves, mesh_groups
from exugear.system.kernels.coordinates import BODY_SIZE, TILT
from exugear.system.kernels.meshes import TILT_LEVER
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.element import MeshElement
from fe_ste.tools.arrays import Floats, Integers

GEAR_FORCE, GEAR_MOMENT = "gear_force", "gear_moment"
"""Signals of the meshes' load on a gear of a fixed body, about the middle of the gear on its axis."""


def moment_supports(assembly: Assembly) -> Integers:
    """Numbers of the supports whose moments are signals: bearings between a moving body and one that stands still."""
    standing = {bearing.name for bearing in assembly.gearbox.standing_bearings}
    return np.array([n for n, support in enumerate(assembly.supports) if support.name in standing], dtype=np.int64)


def standing_gears(assembly: Assembly) -> tuple[str, ...]:
    """Gears of fixed bodies, without those that are flexible sectors, on which the place of the load matters."""
    found = {
        gear: None
        for element in assembly.elements
        for body, gear in _ends(element)
        if _stands(assembly, body) and not _has_sectors(assembly, body, gear)
    }
    return tuple(found)


def gear_load_rows(waves: MeshWaves) -> tuple[Floats, Floats]:
    """Return loads of the standing gears per unit of the force and of the moment of each wave, (m, 6 gears) each.

    Force along x, y, z, then moment about them, gear by gear in the order of `standing_gears`. The force acts along its
    row less the lever arm of the load times that of the misalignment, as in
    `exugear.system.tooth_mesh.laws.mesh_forces`.
    """
    assembly = waves.assembly
    gears = standing_gears(assembly)
    along, turning = np.zeros((2, len(waves.waves), BODY_SIZE * len(gears)))
    groups = {meshes[0]: (meshes, planets) for meshes, planets in mesh_groups(waves.system.frame)}
    for number, wave in enumerate(waves.waves):
        meshes, planets = groups[wave.first]
        shapes = np.ones((1, 1)) if planets is None else planets.shapes(0.0)[0]
        if wave.wave >= shapes.shape[1]:  # of a flexible ring gear, which has no such signals
            continue
        for mesh, share in zip(meshes, shapes[:, wave.wave], strict=True):
            element = assembly.elements[mesh]
            lever = assembly.meshes.tilt[mesh, TILT_LEVER]
            force = (element.force - lever * element.misalignment) / element.line_of_action
            for part, rows in ((along, force), (turning, element.misalignment)):
                for (body, gear), row in zip(_ends(element), rows.reshape(2, BODY_SIZE), strict=True):
                    if gear in gears and _stands(assembly, body) and not _has_sectors(assembly, body, gear):
                        first = BODY_SIZE * gears.index(gear)
                        part[number, first : first + BODY_SIZE] -= share * _about_gear(assembly, body, gear, row)
    return along, turning


def _ends(element: MeshElement) -> tuple[tuple[str, str], tuple[str, str]]:
    """Body and gear of both ends of a mesh."""
    mesh = element.mesh
    return (mesh.pinion, mesh.pair.pinion.name), (mesh.gear, mesh.pair.gear.name)


def _stands(assembly: Assembly, body: str) -> bool:
    return assembly.gearbox.body(body).fixed


def _has_sectors(assembly: Assembly, body: str, gear: str) -> bool:
    elastic = assembly.elastic_bodies.get(body)
    return elastic is not None and bool(elastic.sectors.get(gear))


def _about_gear(assembly: Assembly, name: str, gear: str, row: Floats) -> Floats:
    """Row (6,) about the middle of the gear, from that about the node that carries it."""
    body = assembly.gearbox.body(name)
    node = node_position(body)
    elastic = assembly.elastic_bodies.get(name)
    if elastic is not None:
        node = np.array(next(seat.position for seat in elastic.reduced.seats if seat.name == gear))
    force, moment = row[:TILT], row[TILT:]
    return np.concatenate([force, moment + np.cross(node - np.array([*body.axis, body.wheels[gear]]), force)])
