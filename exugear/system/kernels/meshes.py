r"""Compiled geometry of gear meshes on arrays of coordinates: deflection, its rate, and positions of the gears.

Each mesh has a frame with which its line of centres rotates: ground, or a carrier with the angle psi. With R the
rotation by psi, p the position of a gear relative to the frame's axis and S = z x,

    z_b   = R^T (p_b + x_b) - p_b,  tilts likewise,  spin_b - psi          displacements seen from the frame
    delta = sum_b W_b . z_b                                                deflection, W constant
    pmc   = phase + (spin_1 - psi) cycles                                  position in the mesh cycle
    f     = -F dg/dq,  g = sum_b V_b . z_b                                 generalized force of a scalar force F

Row-based mesh models (without a table) that resist misalignment gamma use the deflection and moment of
`exugear.system.tooth_mesh.contact_state` instead: e = delta - (zt + w) (gamma - g0) in place of delta, and the
additional force + M d gamma/dq.

The row g is invariant under a common rotation by psi, so that the force on the carrier balances the moments exactly.
The mesh models (`exugear.system.tooth_mesh.laws`) give the force F at a deflection. Pitch deviations and run-out,
specified over a revolution of each gear, are subtracted from the deflection of any model.

Coordinates are those of `exugear.system.kernels.coordinates`.

The module has two versions of these formulas, which the tests compare. The first, on `MeshArrays`, also has second
derivatives. The second, on `Meshes`, is optimised for speed: sines of the frames' angles are computed once per
evaluation and passed in, missing coordinates refer to one that remains zero, so that the loops need no exceptions, and
no memory is allocated.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from exugear.system.kernels.coordinates import AXIAL, BODY_SIZE, PADDED, PADDED_SPIN, PADDED_TILT, SPIN, TILT
from exugear.system.kernels.cubics import cubic, piece_of
from exugear.system.kernels.table_law import (
    NOMINAL_DEFLECTION,
    NOMINAL_DISTANCE,
    NOMINAL_MISALIGNMENT,
    Scratch,
    TableArrays,
)
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled, kernel
from fe_ste.tools.octets import eight, put, sum_of

FRAME = 2 * BODY_SIZE
"""Local coordinates of a mesh: six of gear 1, six of gear 2, then the rotation of the frame."""
ROW_SIZE = FRAME + 1
SPIN_1 = SPIN
SPIN_2 = BODY_SIZE + SPIN

DEFLECTION, RATE, PMC, STIFFNESS, FORCE, ENERGY, DAMPED_POWER, CYCLE_POWER, OTHER_POWER = range(9)
FRICTION_POWER, OUTSIDE, CENTRE_CHANGE, CENTRE_RATE, MISALIGNMENT, FRICTION = range(9, 15)
"""Columns of the states of meshes.

Deflection (m), its rate (m/s), pmc in [0, 1), tangent stiffness (N/m), F_bt (N, negative on the other flank), elastic
energy (J); powers (W): damped, of the stiffness that changes with pmc, of a force that is not conjugate to its
deflection, of friction of the teeth; 1 where the mesh is outside its table. Loops over time leave pmc and stiffness
out, and keep of tables the change of the centre distance (m), its rate (m/s) and the misalignment (rad), and the
friction force across the line of action (N).
"""
STATE_SIZE, STATES_SIZE = 11, 15
"""Columns of `mesh_state`, and of `MeshMemory.states`."""
TILT_STIFFNESS, TILT_DAMPING, TILT_LEVER, TILT_MOMENT, TILT_REST = range(5)
"""Columns of `MeshArrays.tilt`."""
TILT_COLUMNS = 5
WAY_COLUMNS, MOMENT_BEYOND = 8, 4
"""Columns of `MeshArrays.way`, and the first of the moment in them."""


class MeshArrays(NamedTuple):
    """All meshes of a system as arrays for m meshes with at most n cubic pieces."""

    coordinates: Integers
    """(m, 13) index of each local coordinate in the state, -1 for a missing one."""
    axis: Floats
    """(m, 2, 2) axis of each gear relative to the frame's axis at zero angles, m."""
    form: Integers
    """(m,) number of the mesh model's compiled form, by which `exugear.system.tooth_mesh.laws.mesh_forces` selects it.
    """
    deflection: Floats
    force: Floats
    """(m, 12) rows W and V, m/m and m/rad."""
    cycles: Floats
    """(m,) mesh cycles per rad of gear 1 relative to the frame, signed by the loaded flank."""
    phase: Floats
    """(m,) position in the mesh cycle at zero angles."""
    pieces: Integers
    """(m,) number of equal pieces over the mesh cycle."""
    stiffness: Floats
    """(m, n, c) coefficients of the mesh model over each piece; for a stiffness the four of a cubic, N/m."""
    damping: Floats
    """(m,) damping, N s/m."""
    tilt: Floats
    """(m, 5) for row-based models that resist misalignment: tilt stiffness kg (N m/rad) and damping (N m s/rad), lever
    zt (m), moment F0 (zc - zt) (N m) and misalignment g0 (rad); zeros for other models.
    """
    way_pieces: Integers
    """(m,) number of equal pieces of the shuttling over the mesh cycle; 0 without shuttling."""
    way: Floats
    """(m, w, 8) coefficients over each piece of the mesh cycle: of the axial position w of the incremental load's
    centroid (m), then of the moment F0 (c - w) of the static load about it (N m).
    """
    line_of_action: Floats
    """(m,) ratio of F_bt to the scalar mesh force."""
    error_pieces: Integers
    """(m, 2) number of equal cubic pieces of each gear's deviation over its revolution; 0 without deviation."""
    error: Floats
    """(m, 2, e, 4) coefficients of the deviation over each piece, m along the transverse line of action."""
    friction_pieces: Integers
    """(m,) number of equal cubic pieces of the friction of the teeth over the mesh cycle; 0 without friction."""
    friction: Floats
    """(m, p, 12) coefficients over each piece: of the force across the line of action, per unit mesh force, and of the
    moments about the gear axes and about the line of action (m)."""
    friction_rows: Floats
    """(m, 3, 12) rows of this force and these moments."""
    friction_speed: Floats
    """(m,) speed of gear 1 relative to gear 2 (rad/s) above which friction has its full size."""
    table: TableArrays
    """Tables of the meshes with the model `table`."""

    def one(self, n: int) -> MeshArrays:
        """Arrays of mesh n alone."""
        table = TableArrays._make(values[n : n + 1] for values in self.table)
        others = {name: values[n : n + 1] for name, values in self._asdict().items() if name != "table"}
        return MeshArrays(**others, table=table)


@kernel
def frame_row(q: Floats, index: Integers, axis: Floats, row: Floats, gradient: Floats, turning: Floats) -> float:
    """Value of sum W . z for one mesh, with its gradient (13,) and the derivative of the gradient by psi (13,)."""
    psi = q[index[FRAME]] if index[FRAME] >= 0 else 0.0
    c = math.cos(psi)
    s = math.sin(psi)
    value = 0.0
    gradient[:] = 0.0
    turning[:] = 0.0
    for end in range(2):
        o = BODY_SIZE * end
        # Translations and tilts are vectors in the plane, both rotated back by psi. Only translations have a lever p.
        for pair in (0, TILT):
            if index[o + pair] < 0:
                continue
            px, py = (axis[end, 0], axis[end, 1]) if pair == 0 else (0.0, 0.0)
            x = px + q[index[o + pair]]
            y = py + q[index[o + pair + 1]]
            lx = c * x + s * y
            ly = c * y - s * x
            wx = row[o + pair]
            wy = row[o + pair + 1]
            value += wx * (lx - px) + wy * (ly - py)
            # dz/dq = R^T, so the gradient is the row rotated forward; its derivative by psi is that rotated by 90 deg.
            gradient[o + pair] = c * wx - s * wy
            gradient[o + pair + 1] = s * wx + c * wy
            turning[o + pair] = -gradient[o + pair + 1]
            turning[o + pair + 1] = gradient[o + pair]
            # dl/dpsi = -S l, with l the position of the gear relative to the frame's axis, in the frame; applied twice
            # it is -l.
            gradient[FRAME] += wx * ly - wy * lx
            turning[FRAME] -= wx * lx + wy * ly
        # In the axial direction, the rotation of the frame affects only the relative rotation about the axis.
        if index[o + AXIAL] >= 0:
            value += row[o + AXIAL] * q[index[o + AXIAL]]
            gradient[o + AXIAL] = row[o + AXIAL]
        spin = q[index[o + SPIN]] if index[o + SPIN] >= 0 else 0.0
        value += row[o + SPIN] * (spin - psi)
        gradient[o + SPIN] = row[o + SPIN]
        gradient[FRAME] -= row[o + SPIN]
    return value


@kernel
def error_at(m: int, end: int, angle: float, meshes: MeshArrays) -> tuple[float, float, float]:
    """Deviation (m) of one gear of mesh m at its angle (rad) relative to the frame, with two derivatives by it."""
    pieces = meshes.error_pieces[m, end]
    if pieces == 0:
        return 0.0, 0.0, 0.0
    piece, t = piece_of(angle / (2.0 * math.pi), pieces)
    per_rad = pieces / (2.0 * math.pi)
    c = meshes.error[m, end, piece]
    value, slope, curvature = cubic(c[0], c[1], c[2], c[3], t)
    return value, slope * per_rad, curvature * per_rad * per_rad


@kernel
def net_deflection(
    q: Floats, m: int, meshes: MeshArrays, row: Floats, side: float, gradient: Floats, turning: Floats, bend: Floats
) -> float:
    """Value of a row minus the gears' deviations (side 1; plus for side -1), with gradient as in `frame_row`.

    The second derivatives of the deviations by the two rotations are stored in `bend` (2,).
    """
    index = meshes.coordinates[m]
    value: float = frame_row(q, index, meshes.axis[m], row, gradient, turning)
    psi = q[index[FRAME]] if index[FRAME] >= 0 else 0.0
    for end in range(2):
        o = BODY_SIZE * end + SPIN
        spin = q[index[o]] if index[o] >= 0 else 0.0
        error, slope, curvature = error_at(m, end, spin - psi, meshes)
        value -= side * error
        # The deviation depends on spin - psi, so that its slope has opposite signs for the two.
        gradient[o] -= side * slope
        gradient[FRAME] += side * slope
        bend[end] = -side * curvature
    return value


@kernel
def mesh_pmc(q: Floats, m: int, meshes: MeshArrays) -> float:
    """Position in the mesh cycle of mesh m, unwrapped."""
    spin = q[meshes.coordinates[m, SPIN_1]] if meshes.coordinates[m, SPIN_1] >= 0 else 0.0
    psi = q[meshes.coordinates[m, FRAME]] if meshes.coordinates[m, FRAME] >= 0 else 0.0
    pmc: float = meshes.phase[m] + meshes.cycles[m] * (spin - psi)
    return pmc


@kernel
def load_way(m: int, pmc: float, meshes: MeshArrays) -> tuple[float, float, float, float]:
    """Axial position w (m) of mesh m's load centroid and moment F0 (c - w) (N m), each with its slope per cycle."""
    pieces = meshes.way_pieces[m]
    if pieces == 0:
        return 0.0, 0.0, 0.0, 0.0
    piece, t = piece_of(pmc, pieces)
    c = meshes.way[m, piece]
    way, moving, _ = cubic(c[0], c[1], c[2], c[3], t)
    c = c[MOMENT_BEYOND:]
    moment, changing, _ = cubic(c[0], c[1], c[2], c[3], t)
    return way, moving * pieces, moment, changing * pieces


@kernel
def row_dot(index: Integers, row: Floats, v: Floats) -> float:
    """Scalar product of a local row (13,) with the corresponding entries of the state."""
    total = 0.0
    for i in range(ROW_SIZE):
        if index[i] >= 0:
            total += row[i] * v[index[i]]
    return total


@kernel
def relative_spin(v: Floats, index: Integers, end: int) -> float:
    """Rotation of a gear relative to the frame of its mesh, for coordinates or their rates."""
    spin = v[index[BODY_SIZE * end + SPIN]] if index[BODY_SIZE * end + SPIN] >= 0 else 0.0
    psi = v[index[FRAME]] if index[FRAME] >= 0 else 0.0
    difference: float = spin - psi
    return difference


@compiled
def gear_position(q: Floats, m: int, meshes: MeshArrays, row: Floats, nominal: float) -> float:
    """Centre distance (m) or misalignment (rad) of mesh m from its row."""
    gradient = np.empty(ROW_SIZE)
    turning = np.empty(ROW_SIZE)
    index = meshes.coordinates[m]
    value: float = nominal + frame_row(q, index, meshes.axis[m], row, gradient, turning)
    return value


@kernel
def turn_rows(turning: Floats, bend: Floats, factor: float, out: Floats) -> None:
    """Add factor times the second derivatives of a row's value, (13, 13)."""
    # The value is bilinear in psi and the other coordinates: full row and column of psi, with the corner counted once.
    for i in range(ROW_SIZE):
        out[i, FRAME] += factor * turning[i]
        if i != FRAME:
            out[FRAME, i] += factor * turning[i]
    # The curvature of a deviation acts on spin - psi.
    for end in range(2):
        o = BODY_SIZE * end + SPIN
        out[o, o] += factor * bend[end]
        out[FRAME, FRAME] += factor * bend[end]
        out[o, FRAME] -= factor * bend[end]
        out[FRAME, o] -= factor * bend[end]


@kernel
def rate_gradient(v: Floats, index: Integers, turning: Floats, bend: Floats, out: Floats) -> None:
    """Differentiate the rate of a row by the coordinates, (13,)."""
    # d(gradient . v)/dq is the second derivative times v, with the same pattern as in `turn_rows`.
    psi_rate = v[index[FRAME]] if index[FRAME] >= 0 else 0.0
    for i in range(ROW_SIZE):
        out[i] = turning[i] * psi_rate
    out[FRAME] = row_dot(index, turning, v)
    for end in range(2):
        change = bend[end] * relative_spin(v, index, end)
        out[BODY_SIZE * end + SPIN] += change
        out[FRAME] -= change


@compiled
def gear_positions(q: Floats, meshes: MeshArrays, out: Floats) -> None:
    """Fill (m, 2): centre distance (m) and misalignment of the loaded flank (rad) of each mesh."""
    table = meshes.table
    for m in range(meshes.coordinates.shape[0]):
        out[m, 0] = gear_position(q, m, meshes, table.centre[m], table.nominal[m, NOMINAL_DISTANCE])
        out[m, 1] = gear_position(q, m, meshes, table.misalignment[m], table.nominal[m, NOMINAL_MISALIGNMENT])


# Readings of a flank, which the laws of the meshes see, with their gradients

BY_DELTA, BY_CENTRE, BY_TILT, BY_PMC = range(4)
"""Readings of a flank: deflection (m), centre distance (m), misalignment (rad), position in the mesh cycle."""
READINGS, RATES, FORCES, BEND, STRAIGHT, ALONG, ALONG_TURNING, DAMPING, ACTING, STATE = range(10)
GRADIENTS = STATE + 1
TURNINGS = GRADIENTS + 4
RATE_GRADIENTS = TURNINGS + 3
SLOPES = RATE_GRADIENTS + 3
RATE_SLOPES = SLOPES + 3
SECOND_SLOPES = RATE_SLOPES + 3
BY_Q = SECOND_SLOPES + 4
BY_V = BY_Q + ROW_SIZE
MEMORY = BY_V + ROW_SIZE
"""Rows of the memory of a mesh, (`MEMORY`, 13): vectors of a flank, state and negative force of the mesh, and the
derivatives of this."""


@kernel
def read_flank(q: Floats, v: Floats, m: int, side: int, sense: float, meshes: MeshArrays, memory: Floats) -> None:
    """Fill readings of one flank (1, -1), rates, gradients (4, 13), and these differentiated by the frame's angle.

    The misalignment counts in the sense (1, -1) of the law.
    """
    index = meshes.coordinates[m]
    axis = meshes.axis[m]
    table = meshes.table
    readings = memory[READINGS]
    gradients = memory[GRADIENTS:TURNINGS]
    turnings = memory[TURNINGS:RATE_GRADIENTS]
    row, tilt_row, offset = meshes.deflection[m], table.misalignment[m], table.nominal[m, NOMINAL_DEFLECTION]
    phase, cycles = meshes.phase[m], meshes.cycles[m]
    if side < 0:
        # The other flank closes when the loaded one opens by the backlash, and its cycle runs the other way.
        row, tilt_row, offset = table.back[m], table.back_misalignment[m], -offset - table.backlash[m]
        phase, cycles = table.back_phase[m], -cycles
    readings[BY_DELTA] = offset + net_deflection(
        q, m, meshes, row, float(side), gradients[BY_DELTA], turnings[BY_DELTA], memory[BEND]
    )
    readings[BY_CENTRE] = table.nominal[m, NOMINAL_DISTANCE] + frame_row(
        q, index, axis, table.centre[m], gradients[BY_CENTRE], turnings[BY_CENTRE]
    )
    tilt = frame_row(q, index, axis, tilt_row, gradients[BY_TILT], turnings[BY_TILT])
    readings[BY_TILT] = sense * (table.nominal[m, NOMINAL_MISALIGNMENT] - meshes.tilt[m, TILT_REST] + tilt)
    readings[BY_PMC] = phase + cycles * relative_spin(q, index, 0)
    gradients[BY_PMC] = 0.0
    gradients[BY_PMC, SPIN_1], gradients[BY_PMC, FRAME] = cycles, -cycles
    for i in range(ROW_SIZE):
        gradients[BY_TILT, i] *= sense
        turnings[BY_TILT, i] *= sense
    for a in range(4):
        memory[RATES, a] = row_dot(index, gradients[a], v)


# Compiled geometry of gear meshes, optimised for speed: value, rate and gradient of a row in one pass

ALONG_DEFLECTION, ALONG_FORCE, TABLE_FORCE = range(3)
"""Rows of `MeshMemory.gradient`."""
DEFLECTION_ROW, FORCE_ROW, FRICTION_ROW = range(3)
"""Rows of `Meshes.rows`; those of friction are the last three."""
FIXED, ALONG_COSINE, ALONG_SINE, SECOND = range(0, 4 * PADDED, PADDED)
"""First columns of the parts of each row, and first column of the second gear."""
MISALIGNED, TILT_ROW_X, TILT_ROW_Y = range(3)
"""Columns of `Meshes.misalignment`: at zero tilts relative to that of the contact state (rad), and its row over the
tilts of gear 1, whose negative is that of gear 2."""
PADDED_FRAME = 2 * PADDED
"""Index of the frame's angle in a gradient of `MeshMemory.gradients`, after two padded gears."""
KINETIC, ELASTIC, OF_LOADS, DISSIPATED, OF_VARYING_STIFFNESS, NON_CONSERVATIVE, OF_FRICTION, OF_BEARING_RATES = range(8)
"""Columns of the energy balance, as recorded by runs (`exugear.transient.compiled.sampling`).

Kinetic and elastic energy (J); powers (W): of the loads, dissipated, of the stiffness that changes with pmc, of mesh
forces that are not conjugate to their deflection, of friction of the teeth, of bearings whose rate is not the
derivative of their displacement.
"""


class Meshes(NamedTuple):
    """Meshes in a loop over time: `MeshArrays`, and what the loop reads instead of their coordinates and rows."""

    arrays: MeshArrays
    coordinates: Integers
    """(m, 13) index of each local coordinate in the state; missing ones refer to one that remains zero."""
    slot: Integers
    """(m,) index of the cosine and sine of the frame's angle among those of all frame angles."""
    axis: Floats
    """(m, 2, 2) as in `MeshArrays`; zero for gears without translations."""
    conjugate: Integers
    """(m,) 1 if the force row is the deflection row."""
    tilting: Integers
    """(m,) 1 for row-based models that resist misalignment."""
    misalignment: Floats
    """(m, 3) misalignment and its row, columns as named in this module."""
    spinning: Integers
    """(m,) 1 for gears with rotations only."""
    ends: Integers
    """(m, 2) indices of the two gears among the padded positions."""
    rows: Floats
    """(m, 5, 48) rows over the padded positions of both gears: parts W0, W1, W2 of the first, then of the second gear.
    The row is W0 + W1 cos psi + W2 sin psi at the angle psi of the frame.
    """
    offsets: Floats
    """(m, 5, 3) contributions of cos psi, sin psi and psi itself to the value of each row."""
    mean: Floats
    """(m, 2) stiffness (N/m) and damping (N s/m) at the static load, averaged over the cycle."""
    nominal: Floats
    """(m,) deflection of gears in their nominal position, m."""
    table: TableArrays | None
    """None if no mesh has the model `table`."""


class MeshMemory(NamedTuple):
    """Work memory of the mesh models."""

    gradient: Floats
    """(3, 13) gradients of the deflection row, of the force row, and of the force of a mesh with a table."""
    gradients: Floats
    """(4, 17) gradients over two padded positions and the frame's angle; the last one is a sum."""
    states: Floats
    """(m, 15) state of each mesh, columns as named in this module."""
    pieces: Integers
    """(m, 2) load piece of each flank's table that was used last."""
    law: Scratch | None
    """Work memory of the model `table`; None if no mesh has it."""
    row: Floats
    """(12,) row of the force between the axes and of the moment about the misalignment."""
    damping: Floats
    """(5,) directions and magnitudes of the damping of a table."""


class MeshWork(Protocol):
    """Memory of a time integration loop that mesh models read and fill: `exugear.transient.compiled.packing.Work`."""

    @property
    def force(self) -> Floats:
        """Generalized forces."""

    @property
    def turns(self) -> Floats:
        """Cosine and sine of all rotation angles that are needed, (k, 2)."""

    @property
    def places(self) -> Floats:
        """Padded coordinates and rates at all positions, (p, 16)."""

    @property
    def loads(self) -> Floats:
        """Generalized forces at all positions, in the same padded form, (p, 16)."""

    @property
    def mesh(self) -> MeshMemory:
        """Work memory of the mesh models."""


def padded_rows(rows: Floats, axis: Floats) -> tuple[Floats, Floats]:
    """Parts and offsets of rows over padded positions, see `Meshes`.

    Parameters
    ----------
    rows : (m, r, 12) rows over the coordinates of both gears relative to the frame
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
        # Rotated forward by psi: (c x - s y, s x + c y).
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
    # Common effect of the frame's rotation on all of the above.
    turning = sum_of(turning_1 * place_1 + turning_2 * place_2) + (c * lever - s * level) + spins
    value = sum_of(gradient_1 * place_1 + gradient_2 * place_2) + ((c * level + s * lever - level) + spins * psi)
    rate = sum_of(gradient_1 * eight(first, PADDED) + gradient_2 * eight(second, PADDED)) + turning * psi_rate
    put(gradient, 0, gradient_1)
    put(gradient, PADDED, gradient_2)
    gradient[PADDED_FRAME] = turning
    return value, rate


@kernel
def push_apart(m: int, force: float, gradient: Floats, meshes: Meshes, work: MeshWork) -> None:
    """Subtract a scalar force times its gradient from what acts on the gears of mesh m and on its frame."""
    first = work.loads[meshes.ends[m, 0]]
    second = work.loads[meshes.ends[m, 1]]
    put(first, 0, eight(first, 0) - eight(gradient, 0) * force)
    put(second, 0, eight(second, 0) - eight(gradient, PADDED) * force)
    work.force[meshes.coordinates[m, FRAME]] -= force * gradient[PADDED_FRAME]


@kernel
def tilt_motion(
    m: int, psi_rate: float, c: float, s: float, meshes: Meshes, places: Floats
) -> tuple[float, float, float, float, float]:
    """Misalignment of mesh m relative to that of the contact state, its rate, and its gradient in three numbers.

    The gradient is by both tilts of gear 1, with the opposite sign for gear 2, and by the frame's angle.
    """
    row = meshes.misalignment[m]
    first = places[meshes.ends[m, 0]]
    second = places[meshes.ends[m, 1]]
    x = c * row[TILT_ROW_X] - s * row[TILT_ROW_Y]
    y = s * row[TILT_ROW_X] + c * row[TILT_ROW_Y]
    a = first[PADDED_TILT] - second[PADDED_TILT]
    b = first[PADDED_TILT + 1] - second[PADDED_TILT + 1]
    turning = x * b - y * a
    a_rate = first[PADDED + PADDED_TILT] - second[PADDED + PADDED_TILT]
    b_rate = first[PADDED + PADDED_TILT + 1] - second[PADDED + PADDED_TILT + 1]
    return row[MISALIGNED] + x * a + y * b, x * a_rate + y * b_rate + turning * psi_rate, x, y, turning


@kernel
def mesh_row(
    q: Floats, v: Floats, index: Integers, axis: Floats, row: Floats, c: float, s: float, gradient: Floats
) -> tuple[float, float]:
    """Value and rate of a row over the coordinates relative to its frame; fills its gradient (13,)."""
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
            # Rotated back by psi; the row rotated forward is its gradient, whose product with v is the rate.
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
    # The frame's angle is the last coordinate: common effect of its rotation on all of the above.
    gradient[FRAME] = turning
    return value, rate + turning * psi_rate


@kernel
def subtract_errors(
    q: Floats, v: Floats, m: int, side: float, meshes: Meshes, gradient: Floats, size: int, spin_place: int, frame: int
) -> tuple[float, float]:
    """Change of a deflection and its rate due to the gears' deviations; changes its gradient, too.

    The gradient has `size` entries for each gear, with the rotation at `spin_place` of them, and the frame's angle at
    `frame`.
    """
    delta = 0.0
    rate = 0.0
    index = meshes.coordinates[m]
    for end in range(2):
        if meshes.arrays.error_pieces[m, end] > 0:
            spin = index[BODY_SIZE * end + SPIN]
            psi = index[FRAME]
            error, slope, _ = error_at(m, end, q[spin] - q[psi], meshes.arrays)
            # A flank below its nominal position closes the gap later; for the other flank the sign is opposite (side
            # -1).
            delta -= side * error
            rate -= side * slope * (v[spin] - v[psi])
            gradient[size * end + spin_place] -= side * slope
            gradient[frame] += side * slope
    return delta, rate
