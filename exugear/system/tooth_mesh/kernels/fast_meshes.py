"""Compiled geometry of gear meshes, arranged for speed: value, rate and gradient of a row in one pass.

The formulas are those of `exugear.system.tooth_mesh.kernels.meshes`, which the tests hold them against. What differs:
sines of the frames' angles are taken once per evaluation and handed in, missing coordinates point to one that stays
zero, so that the loops need no exceptions, and nothing is allocated.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from exugear.system.kernels.coordinates import (
    AXIAL,
    BODY_SIZE,
    PADDED,
    PADDED_SPIN,
    PADDED_TILT,
    SPIN,
    TILT,
)
from exugear.system.tooth_mesh.kernels.meshes import FRAME
from exugear.system.tooth_mesh.kernels.table_law import Scratch, TableArrays, piece_at
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import kernel
from fe_ste.tools.octets import eight, put, sum_of

ALONG_DEFLECTION, ALONG_FORCE, TABLE_FORCE = range(3)
"""Rows of `MeshMemory.gradient`."""
LAST_DEFLECTION, LAST_RATE, LAST_OUTSIDE, LAST_FORCE, LAST_ENERGY, LAST_DAMPED, LAST_CYCLE, LAST_OTHER = range(8)
LAST_CENTRE, LAST_MISALIGNMENT, LAST_CENTRE_RATE = range(8, 11)
"""Columns of `MeshMemory.states`: deflection (m), rate (m/s), 1 outside a table, scalar force (N; of a table F_bt), and
what an account of energy takes of the mesh: elastic energy (J); power damped, of the stiffness that changes with pmc,
and of a force that is not conjugate to its deflection (W); of a table change of centre distance (m),
misalignment (rad) and rate of the centre distance (m/s)."""
STATES_SIZE = 11
DEFLECTION_ROW, FORCE_ROW = range(2)
"""Rows of `Meshes.rows`."""
FIXED, ALONG_COSINE, ALONG_SINE, SECOND = range(0, 4 * PADDED, PADDED)
"""First columns of the parts of each of them, and of those of the second gear."""
TILT_ROW_X, TILT_ROW_Y, TILT_SHIFT, TILT_RESISTANCE, TILT_DAMPER, TILT_ARM, TILT_PUSH = range(7)
"""Columns of `Meshes.tilt`: the misalignment's row over the tilts of gear 1, its negative being that of gear 2;
misalignment at zero tilts against that of the contact's state (rad); tilt stiffness, damping, lever and moment as in
`exugear.system.tooth_mesh.kernels.meshes.MeshArrays.tilt`."""
PADDED_FRAME = 2 * PADDED
"""Place of the frame's angle in a gradient of `MeshMemory.gradients`, behind two padded gears."""
KINETIC, ELASTIC, OF_LOADS, DISSIPATED, OF_VARYING_STIFFNESS, NON_CONSERVATIVE, OF_BEARING_RATES = range(7)
"""Columns of an account of energy, as runs take it (`exugear.transient.compiled.sampling`).

Kinetic and elastic energy (J); powers (W): of the loads, damped, of the stiffness that changes with pmc, of mesh forces
that are not conjugate to their deflection, of bearings whose rate is not the derivative of their displacement.
"""


class Meshes(NamedTuple):
    """Meshes as in `system.tooth_mesh.kernels.meshes.MeshArrays`; missing coordinates point to one that stays zero."""

    coordinates: Integers
    """(m, 13)"""
    slot: Integers
    """(m,) where the cosine and sine of the frame's angle stand among those of all angles that turn anything."""
    axis: Floats
    """(m, 2, 2) zero for gears without translations."""
    form: Integers
    deflection: Floats
    force: Floats
    conjugate: Integers
    """(m,) 1 where the force row is the deflection row."""
    tilting: Integers
    """(m,) 1 where a law along a row resists misalignment."""
    tilt: Floats
    """(m, 7) columns as named in this module."""
    way_pieces: Integers
    way: Floats
    """Of the load's ways along the face."""
    spinning: Integers
    """(m,) 1 where the gears have their spins alone."""
    ends: Integers
    """(m, 2) numbers of the two gears' places."""
    rows: Floats
    """(m, 2, 48) rows over both gears' padded places: parts W0, W1, W2 of the first, then of the second gear, whose:
    row is W0 + W1 cos psi + W2 sin psi at the angle psi of the frame."""
    offsets: Floats
    """(m, 2, 3) of each row: what cos psi, sin psi and psi itself add to its value."""
    cycles: Floats
    phase: Floats
    pieces: Integers
    stiffness: Floats
    damping: Floats
    mean: Floats
    """(m, 2) stiffness (N/m) and damping (N s/m) at the static load, mean over the cycle."""
    line_of_action: Floats
    error_pieces: Integers
    error: Floats
    nominal: Floats
    """(m,) deflection of gears in their nominal place, m."""
    table: TableArrays | None
    """None where no mesh follows one."""


class MeshMemory(NamedTuple):
    """Memory of the meshes' laws."""

    gradient: Floats
    """(3, 13) gradients of the deflection and of the force row, and the force of a mesh with a table."""
    gradients: Floats
    """(4, 17) gradients over two padded places and the frame's angle; the last one is a sum."""
    states: Floats
    """(m, 11) what each mesh does, columns as named in this module."""
    pieces: Integers
    """(m, 2) load piece of each flank's table that was used last."""
    law: Scratch | None
    """Memory of the law `table`; None where no mesh has it."""
    row: Floats
    """(12,) row of the push between the axes and the moment of misalignment."""
    damping: Floats
    """(5,) directions and sizes of the damping of a table."""


class MeshWork(Protocol):
    """What laws read and fill of the memory of a loop over time: `exugear.transient.compiled.arrays.Work`."""

    @property
    def force(self) -> Floats:
        """Generalized forces."""

    @property
    def turns(self) -> Floats:
        """Cosine and sine of all angles that turn anything, (k, 2)."""

    @property
    def places(self) -> Floats:
        """Padded coordinates and rates of all places, (p, 16)."""

    @property
    def loads(self) -> Floats:
        """Generalized forces on all places, padded alike, (p, 16)."""

    @property
    def mesh(self) -> MeshMemory:
        """Memory of the laws."""


def padded_rows(rows: Floats, axis: Floats) -> tuple[Floats, Floats]:
    """Rows over padded places, their parts and offsets: see `Meshes`.

    Parameters
    ----------
    rows : (m, r, 12) rows over the coordinates of both gears seen from the frame
    axis : (m, 2, 2) axis of each gear relative to the frame's at zero angles, m; zero for gears without translations

    Returns
    -------
    rows : (m, r, 48)
    offsets : (m, r, 3)
    """
    count, kinds = rows.shape[:2]
    gears = rows.reshape(count, kinds, 2, BODY_SIZE)
    parts = np.zeros((count, kinds, 2, SECOND))
    parts[..., FIXED + AXIAL], parts[..., FIXED + PADDED_SPIN] = gears[..., AXIAL], gears[..., SPIN]
    for i, o in ((0, 0), (TILT, PADDED_TILT)):
        # Turned forward by psi: (c x - s y, s x + c y).
        parts[..., ALONG_COSINE + o], parts[..., ALONG_COSINE + o + 1] = gears[..., i], gears[..., i + 1]
        parts[..., ALONG_SINE + o], parts[..., ALONG_SINE + o + 1] = -gears[..., i + 1], gears[..., i]
    offsets = np.zeros((count, kinds, 3))
    x = gears[..., 0]
    y = gears[..., 1]
    px = axis[:, None, :, 0]
    py = axis[:, None, :, 1]
    offsets[..., 0], offsets[..., 1] = (x * px + y * py).sum(axis=2), (x * py - y * px).sum(axis=2)
    offsets[..., 2] = -gears[..., SPIN].sum(axis=2)
    return parts.reshape(count, kinds, 2 * SECOND), offsets


@kernel
def row_motion(
    m: int, kind: int, psi: float, psi_rate: float, c: float, s: float, meshes: Meshes, places: Floats, gradient: Floats
) -> tuple[float, float]:
    """Value and rate of a row of mesh m; fills its gradient (17,). c and s are those of the frame's angle psi."""
    row = meshes.rows[m, kind]
    offsets = meshes.offsets[m, kind]
    first = places[meshes.ends[m, 0]]
    second = places[meshes.ends[m, 1]]
    along = eight(row, ALONG_COSINE)
    across = eight(row, ALONG_SINE)
    gradient_1 = eight(row, FIXED) + along * c + across * s
    turning_1 = across * c - along * s
    along = eight(row, SECOND + ALONG_COSINE)
    across = eight(row, SECOND + ALONG_SINE)
    gradient_2 = eight(row, SECOND + FIXED) + along * c + across * s
    turning_2 = across * c - along * s
    place_1 = eight(first, 0)
    place_2 = eight(second, 0)
    level = offsets[0]
    lever = offsets[1]
    spins = offsets[2]
    # What the frame's turning does to all of the above at once.
    turning = sum_of(turning_1 * place_1 + turning_2 * place_2) + (c * lever - s * level) + spins
    value = sum_of(gradient_1 * place_1 + gradient_2 * place_2) + ((c * level + s * lever - level) + spins * psi)
    rate = sum_of(gradient_1 * eight(first, PADDED) + gradient_2 * eight(second, PADDED)) + turning * psi_rate
    put(gradient, 0, gradient_1)
    put(gradient, PADDED, gradient_2)
    gradient[PADDED_FRAME] = turning
    return value, rate


@kernel
def tilt_motion(
    m: int, psi_rate: float, c: float, s: float, meshes: Meshes, places: Floats
) -> tuple[float, float, float, float, float]:
    """Misalignment of mesh m against that of its contact's state, and its rate; its gradient in three numbers.

    These are those by both tilts of gear 1, whose negatives belong to gear 2, and by the frame's angle.
    """
    row = meshes.tilt[m]
    first = places[meshes.ends[m, 0]]
    second = places[meshes.ends[m, 1]]
    x = c * row[TILT_ROW_X] - s * row[TILT_ROW_Y]
    y = s * row[TILT_ROW_X] + c * row[TILT_ROW_Y]
    a = first[PADDED_TILT] - second[PADDED_TILT]
    b = first[PADDED_TILT + 1] - second[PADDED_TILT + 1]
    turning = x * b - y * a
    a_rate = first[PADDED + PADDED_TILT] - second[PADDED + PADDED_TILT]
    b_rate = first[PADDED + PADDED_TILT + 1] - second[PADDED + PADDED_TILT + 1]
    return row[TILT_SHIFT] + x * a + y * b, x * a_rate + y * b_rate + turning * psi_rate, x, y, turning


@kernel
def mesh_row(
    q: Floats, v: Floats, index: Integers, axis: Floats, row: Floats, c: float, s: float, gradient: Floats
) -> tuple[float, float]:
    """Value and rate of a row over the coordinates seen from its frame; fills its gradient (13,)."""
    psi = q[index[FRAME]]
    psi_rate = v[index[FRAME]]
    value = 0.0
    rate = 0.0
    turning = 0.0
    for end in range(2):
        o = BODY_SIZE * end
        px = axis[end, 0]
        py = axis[end, 1]
        for pair in (0, TILT):
            i = index[o + pair]
            j = index[o + pair + 1]
            # Turned back by psi; the row turned forward is its gradient, whose product with v is the rate.
            x = px + q[i]
            y = py + q[j]
            lx = c * x + s * y
            ly = c * y - s * x
            wx = row[o + pair]
            wy = row[o + pair + 1]
            gx = c * wx - s * wy
            gy = s * wx + c * wy
            value += wx * (lx - px) + wy * (ly - py)
            rate += gx * v[i] + gy * v[j]
            turning += wx * ly - wy * lx
            gradient[o + pair], gradient[o + pair + 1] = gx, gy
            px, py = 0.0, 0.0  # tilts have no lever
        axial = row[o + AXIAL]
        spin = row[o + SPIN]
        value += axial * q[index[o + AXIAL]] + spin * (q[index[o + SPIN]] - psi)
        rate += axial * v[index[o + AXIAL]] + spin * v[index[o + SPIN]]
        turning -= spin
        gradient[o + AXIAL], gradient[o + SPIN] = axial, spin
    # The frame's angle comes last: what its turning does to all of the above at once.
    gradient[FRAME] = turning
    return value, rate + turning * psi_rate


@kernel
def error_at(m: int, end: int, angle: float, meshes: Meshes) -> tuple[float, float]:
    """Error (m) of one gear of mesh m at its angle (rad) seen from the frame, and its slope per rad."""
    pieces = meshes.error_pieces[m, end]
    turns = angle / (2.0 * math.pi)
    scaled = (turns - math.floor(turns)) * pieces
    piece = piece_at(scaled, pieces)
    t = scaled - piece
    c = meshes.error[m, end, piece]
    slope = (c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])) * pieces / (2.0 * math.pi)
    return c[0] + t * (c[1] + t * (c[2] + t * c[3])), slope


@kernel
def subtract_errors(
    q: Floats, v: Floats, m: int, side: float, meshes: Meshes, gradient: Floats, size: int, spin_place: int, frame: int
) -> tuple[float, float]:
    """Change of a deflection and its rate by the gears' errors; changes its gradient too.

    The gradient has `size` places for each gear, the spin at `spin_place` of them, and the frame's angle at `frame`.
    """
    delta = 0.0
    rate = 0.0
    index = meshes.coordinates[m]
    for end in range(2):
        if meshes.error_pieces[m, end] > 0:
            spin = index[BODY_SIZE * end + SPIN]
            psi = index[FRAME]
            error, slope = error_at(m, end, q[spin] - q[psi], meshes)
            # A flank that stands back closes later; seen from the other flank it stands ahead (side -1).
            delta -= side * error
            rate -= side * slope * (v[spin] - v[psi])
            gradient[size * end + spin_place] -= side * slope
            gradient[frame] += side * slope
    return delta, rate
