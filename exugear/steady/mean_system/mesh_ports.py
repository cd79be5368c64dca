"""What mesh laws read of the motion and what they push along: rows by the frame's coordinates, as waves.

A law along a row reads its deflection and the position in the mesh cycle, and has one force; what it resists
misalignment with is in the mean system. Where its load moves along the face it reads the misalignment, too, and has a
moment along that. The law `table` reads the
approach of both flanks, the centre distance, the misalignment of both flanks and the position, and pushes along all
but the last (`exugear.system.tooth_mesh.laws.table`). Kernels of `fe_ste.tools.compilation` read the numbers of its
rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exugear.steady.mean_system.mesh_waves import MeshWaves
from exugear.system.tooth_mesh.kernels.meshes import TILT_LEVER, TILT_REST, MeshArrays
from exugear.system.tooth_mesh.kernels.table_law import (
    NOMINAL_DEFLECTION,
    NOMINAL_DISTANCE,
    NOMINAL_MISALIGNMENT,
)
from fe_ste.tools.arrays import Floats

DEFLECTION, MISALIGNMENT, POSITION = 0, 1, -1
"""Places among what a law along a row reads: the first, the second where its load moves along the face, the last."""
FRONT, BACK, CENTRE, TILT, BACK_TILT = range(5)
"""Places among what the law `table` reads and pushes along."""


@dataclass(frozen=True, eq=False)
class MeshPorts:
    """Rows of all mesh waves at one speed; m waves, r readings, f forces."""

    readings: Floats
    """(m, r, size) rows of what the law reads; the last is the position in the mesh cycle, in cycles."""
    static: Floats
    """(m, r) their values in the static state; the mean position counts from there."""
    forces: Floats
    """(m, f, size) rows along which its forces push."""
    positions: Floats
    """(meshes,) position in the mesh cycle at zero angle of the input, of the waves of meshes alone."""
    levers: Floats
    """(m, size + 1) rows by which the deflection at mid-face is more than what a law reads of it that bears beside
    the middle, of the waves of meshes alone; in the last column that in the static state."""
    rates: Floats | None = None
    """(m, r, size) rows of what the law reads by the rates of the coordinates; non-linear bearings have some."""


def mesh_ports(waves: MeshWaves, speed: float, parting: bool) -> MeshPorts:
    """Rows of all mesh waves at a speed of the input (rad/s); `parting` for the law `table`."""
    meshes = waves.assembly.meshes
    rows, offsets = _table_rows(meshes) if parting else _row_rows(meshes, waves.wander)
    means = np.array([wave.wave == 0 for wave in waves.waves])
    firsts = [wave.first for wave in waves.waves]
    readings = [waves.gradients(row, speed) for row in rows] + [waves.position_rows()]
    static = [waves.values(row, speed) + means * offset[firsts] for row, offset in zip(rows, offsets, strict=True)]
    # The mean position counts from the static state; what planets are ahead of each other by stays.
    ahead = np.where(means, 0.0, readings[-1] @ waves.system.static_at(speed))
    levers = meshes.tilt[:, [TILT_LEVER]] * meshes.table.misalignment
    forces = readings[:-1] if parting else [waves.gradients(meshes.force - levers, speed), *readings[1:-1]]
    shift = meshes.tilt[:, TILT_LEVER] * (meshes.table.nominal[:, NOMINAL_MISALIGNMENT] - meshes.tilt[:, TILT_REST])
    beside = waves.values(levers, speed) + means * shift[firsts]
    return MeshPorts(
        readings=np.stack(readings, axis=1),
        static=np.stack([*static, ahead], axis=1),
        forces=np.stack(forces, axis=1),
        positions=waves.positions(speed),
        levers=np.column_stack([waves.gradients(levers, speed), beside]),
    )


def _row_rows(meshes: MeshArrays, wander: bool) -> tuple[list[Floats], list[Floats]]:
    """Rows that a law along a row reads (`system.tooth_mesh.contact_state`), and their values at zero coordinates.

    They are its deflection with the mean lever of the load and, where loads wander along the face, the misalignment
    against that of the contact's state; zeros of a mesh whose load stays.
    """
    lever = meshes.tilt[:, TILT_LEVER]
    nominal = meshes.table.nominal
    turned = nominal[:, NOMINAL_MISALIGNMENT] - meshes.tilt[:, TILT_REST]
    row = meshes.deflection - lever[:, None] * meshes.table.misalignment
    offset = lever * turned
    if not wander:
        return [row], [nominal[:, NOMINAL_DEFLECTION] - offset]
    moves = meshes.way_pieces > 0
    rows = [row, moves[:, None] * meshes.table.misalignment]
    return rows, [nominal[:, NOMINAL_DEFLECTION] - offset, moves * turned]


def _table_rows(meshes: MeshArrays) -> tuple[list[Floats], list[Floats]]:
    """Rows of both flanks and of where the gears stand, and their values at zero coordinates."""
    table = meshes.table
    nominal = table.nominal.T
    front = nominal[NOMINAL_DEFLECTION]
    tilt = nominal[NOMINAL_MISALIGNMENT]
    rows = [meshes.deflection, table.back, table.centre, table.misalignment, table.back_misalignment]
    # The other flank closes when the loaded one opens by the backlash.
    return rows, [front, -front - table.backlash, nominal[NOMINAL_DISTANCE], tilt, tilt]
