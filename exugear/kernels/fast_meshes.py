"""Compiled geometry of gear meshes, arranged for speed: value, rate and gradient of a row in one pass.

The formulas are those of `exugear.kernels.meshes`, which the tests hold them against. What differs: sines of the
frames' angles are taken once per evaluation and handed in, missing coordinates point to one that stays zero, so that
the loops need no exceptions, and nothing is allocated.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from exugear.kernels.coordinates import AXIAL, BODY_SIZE, SPIN, TILT
from exugear.kernels.meshes import FRAME
from exugear.kernels.table_law import Scratch, TableArrays, piece_at
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import kernel

ALONG_DEFLECTION, ALONG_FORCE, TABLE_FORCE = range(3)
"""Rows of `MeshMemory.gradient`."""
LAST_DEFLECTION, LAST_RATE, LAST_OUTSIDE, LAST_FORCE = range(4)
"""Columns of `MeshMemory.states`."""
KINETIC, ELASTIC, OF_LOADS, DISSIPATED, OF_VARYING_STIFFNESS, NON_CONSERVATIVE, OF_BEARING_RATES = range(7)
"""Columns of an account of energy.

Kinetic and elastic energy (J); powers (W): of the loads, damped, of the stiffness that changes with pmc, of mesh forces
that are not conjugate to their deflection, of bearings whose rate is not the derivative of their displacement.
"""


class Meshes(NamedTuple):
    """Meshes as in `exugear.kernels.meshes.MeshArrays`, with missing coordinates pointing to one that stays zero.

    Attributes
    ----------
    coordinates : (m, 13)
    slot : (m,) where the cosine and sine of the frame's angle stand among those of all angles that turn anything
    axis : (m, 2, 2) zero for gears without translations
    conjugate : (m,) 1 where the force row is the deflection row
    spinning : (m,) 1 where the gears have their spins alone
    """

    coordinates: Integers
    slot: Integers
    axis: Floats
    form: Integers
    deflection: Floats
    force: Floats
    conjugate: Integers
    spinning: Integers
    cycles: Floats
    phase: Floats
    pieces: Integers
    stiffness: Floats
    damping: Floats
    line_of_action: Floats
    error_pieces: Integers
    error: Floats
    table: TableArrays


class MeshMemory(NamedTuple):
    """Memory of the meshes' laws.

    Attributes
    ----------
    gradient : (3, 13) gradients of the deflection and of the force row, and the force of a mesh with a table
    states : (m, 4) deflection and its rate, 1 where a table's axis was left, scalar force
    pieces : (m, 2) load piece of each flank's table that was used last
    law : memory of the law `table`
    row : (12,) row of the push between the axes and the moment of misalignment
    """

    gradient: Floats
    states: Floats
    pieces: Integers
    law: Scratch
    row: Floats


@kernel
def mesh_row(
    q: Floats, v: Floats, index: Integers, axis: Floats, row: Floats, c: float, s: float, gradient: Floats
) -> tuple[float, float]:
    """Value and rate of a row over the coordinates seen from its frame; fills its gradient (13,)."""
    psi, psi_rate = q[index[FRAME]], v[index[FRAME]]
    value, rate, turning = 0.0, 0.0, 0.0
    for end in range(2):
        o = BODY_SIZE * end
        px, py = axis[end, 0], axis[end, 1]
        for pair in (0, TILT):
            i, j = index[o + pair], index[o + pair + 1]
            # Turned back by psi; the row turned forward is its gradient, whose product with v is the rate.
            x, y = px + q[i], py + q[j]
            lx, ly = c * x + s * y, c * y - s * x
            wx, wy = row[o + pair], row[o + pair + 1]
            gx, gy = c * wx - s * wy, s * wx + c * wy
            value += wx * (lx - px) + wy * (ly - py)
            rate += gx * v[i] + gy * v[j]
            turning += wx * ly - wy * lx
            gradient[o + pair], gradient[o + pair + 1] = gx, gy
            px, py = 0.0, 0.0  # tilts have no lever
        axial, spin = row[o + AXIAL], row[o + SPIN]
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
def subtract_wheel_errors(
    q: Floats, v: Floats, m: int, side: float, meshes: Meshes, gradient: Floats
) -> tuple[float, float]:
    """Change of a deflection and its rate by the gears' errors; changes its gradient too."""
    delta, rate = 0.0, 0.0
    index = meshes.coordinates[m]
    for end in range(2):
        if meshes.error_pieces[m, end] > 0:
            spin, frame = index[BODY_SIZE * end + SPIN], index[FRAME]
            error, slope = error_at(m, end, q[spin] - q[frame], meshes)
            # A flank that stands back closes later; seen from the other flank it stands ahead (side -1).
            delta -= side * error
            rate -= side * slope * (v[spin] - v[frame])
            gradient[BODY_SIZE * end + SPIN] -= side * slope
            gradient[FRAME] += side * slope
    return delta, rate
