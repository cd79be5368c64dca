r"""Compiled mesh and connector laws on arrays of coordinates; no Exudyn, no files, no names.

Coordinates are those of Exudyn's ``NodeRigidBodyRxyz``: translations x, y, z (m), tilts a, b about x and
the tilted y, and the unwrapped spin about the body's z axis (rad), all zero in the reference state. A body
may also have its spin alone.

Mesh law
--------
Each mesh lives in a frame that carries its line of centres: ground, or a carrier of spin psi. With R the
rotation by psi, p a gear's place relative to the frame's axis and S = z x,

    z_b   = R^T (p_b + x_b) - p_b,  tilts likewise,  spin_b - psi          displacements seen from the frame
    delta = sum_b W_b . z_b                                                deflection, W constant
    pmc   = phase + (spin_1 - psi) cycles                                  position in the mesh cycle
    F     = k(pmc) delta + c d delta/dt                                    scalar mesh force
    f     = -F dg/dq,  g = sum_b V_b . z_b                                 generalized force

g does not change when everything turns with psi, the carrier's share of the force balances moments exactly.

A mesh with a table follows `exugear.kernels.table_law` instead: its potential depends on delta, on the centre
distance a and
the misalignment gamma, each a row of the same coordinates, and f = -(F d delta/dq + U_a da/dq + U_gamma d gamma/dq).
Errors of pitch and run-out, given over a revolution of each gear, are taken off the deflection of any law.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from exugear.kernels.table_law import ORDERS, TableArrays, piece_at, scratch_memory, surface_law, surface_tangent
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled

END_SIZE = 6
ROW_SIZE = 13
"""Local coordinates of a mesh: six of gear 1, six of gear 2, the spin of the frame."""
STATE_SIZE = 10
"""Columns of `mesh_state`."""


class MeshArrays(NamedTuple):
    """All meshes of a system as arrays; m meshes, n cubic pieces at most.

    Attributes
    ----------
    coordinates : (m, 13) position of each local coordinate in the state, -1 where there is none
    place : (m, 2, 2) axis of each gear relative to the frame's axis at zero angles, m
    deflection, force : (m, 12) rows W and V, m/m and m/rad
    cycles : (m,) mesh cycles per rad of gear 1 relative to the frame, signed by the loaded flank
    phase : (m,) position in the mesh cycle at zero angles
    pieces : (m,) number of equal cubic pieces over the mesh cycle
    stiffness : (m, n, 4) coefficients of k over each piece, N/m
    damping : (m,) N s/m
    line_of_action : (m,) F_bt per scalar mesh force
    error_pieces : (m, 2) number of equal cubic pieces of each gear's error over its revolution; 0 for no error
    error : (m, 2, e, 4) coefficients of the error over each piece, m along the transverse line of action
    table : tables of the meshes that follow one
    """

    coordinates: Integers
    place: Floats
    deflection: Floats
    force: Floats
    cycles: Floats
    phase: Floats
    pieces: Integers
    stiffness: Floats
    damping: Floats
    line_of_action: Floats
    error_pieces: Integers
    error: Floats
    table: TableArrays

    def one(self, n: int) -> MeshArrays:
        """Arrays of mesh n alone."""
        table = TableArrays._make(values[n : n + 1] for values in self.table)
        others = {name: values[n : n + 1] for name, values in self._asdict().items() if name != "table"}
        return MeshArrays(**others, table=table)


def periodic_cubic(samples: Floats) -> Floats:
    """Coefficients of a periodic C1 cubic through equally spaced samples over one cycle.

    Slopes are central differences (Catmull-Rom), so that a sample acts on its neighbourhood only.

    Parameters
    ----------
    samples : (n,) array
        Values at pmc = 0, 1/n, ...; one sample means a constant.

    Returns
    -------
    (n, 4) array
        Coefficients c of sum_j c_j t^j on each piece, t from 0 to 1.

    Examples
    --------
    >>> periodic_cubic(np.array([1.0, 2.0, 1.0, 0.0]))[0]
    array([ 1.,  1.,  1., -1.])
    """
    values = np.asarray(samples, dtype=np.float64)
    following = np.roll(values, -1)
    slope = 0.5 * (following - np.roll(values, 1))
    next_slope = np.roll(slope, -1)
    rise = following - values
    return np.stack([values, slope, 3.0 * rise - 2.0 * slope - next_slope, slope + next_slope - 2.0 * rise], axis=1)


@compiled
def stiffness_at(coefficients: Floats, pieces: int, pmc: float) -> tuple[float, float]:
    """Stiffness (N/m) and its slope per cycle at any position in the mesh cycle; pieces (n, 4)."""
    scaled = (pmc - math.floor(pmc)) * pieces
    piece = piece_at(scaled, pieces)
    t = scaled - piece
    c = coefficients[piece]
    value: float = c[0] + t * (c[1] + t * (c[2] + t * c[3]))
    slope = (c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])) * pieces
    return value, slope


@compiled
def frame_row(q: Floats, index: Integers, place: Floats, row: Floats, gradient: Floats, turning: Floats) -> float:
    """Value of sum W . z with its gradient (13,) and the gradient's derivative to psi (13,) for one mesh."""
    psi = q[index[12]] if index[12] >= 0 else 0.0
    c, s = math.cos(psi), math.sin(psi)
    value = 0.0
    gradient[:] = 0.0
    turning[:] = 0.0
    for end in range(2):
        o = END_SIZE * end
        for pair in (0, 3):
            if index[o + pair] < 0:
                continue
            px, py = (place[end, 0], place[end, 1]) if pair == 0 else (0.0, 0.0)
            x, y = px + q[index[o + pair]], py + q[index[o + pair + 1]]
            lx, ly = c * x + s * y, c * y - s * x
            wx, wy = row[o + pair], row[o + pair + 1]
            value += wx * (lx - px) + wy * (ly - py)
            gradient[o + pair] = c * wx - s * wy
            gradient[o + pair + 1] = s * wx + c * wy
            turning[o + pair] = -gradient[o + pair + 1]
            turning[o + pair + 1] = gradient[o + pair]
            gradient[12] += wx * ly - wy * lx
            turning[12] -= wx * lx + wy * ly
        if index[o + 2] >= 0:
            value += row[o + 2] * q[index[o + 2]]
            gradient[o + 2] = row[o + 2]
        spin = q[index[o + 5]] if index[o + 5] >= 0 else 0.0
        value += row[o + 5] * (spin - psi)
        gradient[o + 5] = row[o + 5]
        gradient[12] -= row[o + 5]
    return value


@compiled
def error_at(m: int, end: int, angle: float, meshes: MeshArrays) -> tuple[float, float, float]:
    """Error (m) of one gear of mesh m at its angle (rad) seen from the frame, with two derivatives by the angle."""
    pieces = meshes.error_pieces[m, end]
    if pieces == 0:
        return 0.0, 0.0, 0.0
    turns = angle / (2.0 * math.pi)
    scaled = (turns - math.floor(turns)) * pieces
    piece = piece_at(scaled, pieces)
    t = scaled - piece
    c = meshes.error[m, end, piece]
    per_rad = pieces / (2.0 * math.pi)
    value: float = c[0] + t * (c[1] + t * (c[2] + t * c[3]))
    return value, (c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])) * per_rad, (2.0 * c[2] + 6.0 * t * c[3]) * per_rad**2


@compiled
def approach(
    q: Floats, m: int, meshes: MeshArrays, row: Floats, side: float, gradient: Floats, turning: Floats, bend: Floats
) -> float:
    """Value of a row less the gears' errors (side 1; plus them for the other flank, -1), gradient as `frame_row`.

    The errors' second derivatives by the two spins go to `bend` (2,).
    """
    index = meshes.coordinates[m]
    value: float = frame_row(q, index, meshes.place[m], row, gradient, turning)
    psi = q[index[12]] if index[12] >= 0 else 0.0
    for end in range(2):
        spin = q[index[6 * end + 5]] if index[6 * end + 5] >= 0 else 0.0
        error, slope, curvature = error_at(m, end, spin - psi, meshes)
        value -= side * error
        gradient[6 * end + 5] -= side * slope
        gradient[12] += side * slope
        bend[end] = -side * curvature
    return value


@compiled
def mesh_position(q: Floats, m: int, meshes: MeshArrays) -> float:
    """Position in the mesh cycle of mesh m, unwrapped."""
    spin = q[meshes.coordinates[m, 5]] if meshes.coordinates[m, 5] >= 0 else 0.0
    psi = q[meshes.coordinates[m, 12]] if meshes.coordinates[m, 12] >= 0 else 0.0
    position: float = meshes.phase[m] + meshes.cycles[m] * (spin - psi)
    return position


@compiled
def along(index: Integers, row: Floats, v: Floats) -> float:
    """Scalar product of a local row (13,) with the state's entries it belongs to."""
    total = 0.0
    for i in range(ROW_SIZE):
        if index[i] >= 0:
            total += row[i] * v[index[i]]
    return total


@compiled
def relative_spin(v: Floats, index: Integers, end: int) -> float:
    """Spin of a gear of a mesh seen from the mesh's frame; of coordinates or of their rates."""
    spin = v[index[6 * end + 5]] if index[6 * end + 5] >= 0 else 0.0
    psi = v[index[12]] if index[12] >= 0 else 0.0
    difference: float = spin - psi
    return difference


@compiled
def linear_force(q: Floats, v: Floats, m: int, meshes: MeshArrays, out: Floats, acting: Floats) -> None:
    """Fill the state of a mesh with a stiffness, as in `mesh_state`, and its generalized force, negative (13,)."""
    gradient, turning, bend = np.empty(ROW_SIZE), np.empty(ROW_SIZE), np.empty(2)
    index = meshes.coordinates[m]
    delta = meshes.table.nominal[m, 0]
    delta += approach(q, m, meshes, meshes.deflection[m], 1.0, gradient, turning, bend)
    rate = along(index, gradient, v)
    pmc = mesh_position(q, m, meshes)
    k, k_slope = stiffness_at(meshes.stiffness[m], meshes.pieces[m], pmc)
    approach(q, m, meshes, meshes.force[m], 1.0, acting, turning, bend)
    force = k * delta + meshes.damping[m] * rate
    cycling = meshes.cycles[m] * relative_spin(v, index, 0)
    out[0], out[1], out[2], out[3] = delta, rate, pmc - math.floor(pmc), k
    out[4] = force * meshes.line_of_action[m]
    out[5] = 0.5 * k * delta * delta
    out[6] = meshes.damping[m] * rate * rate
    out[7] = -0.5 * k_slope * cycling * delta * delta
    out[8] = force * (along(index, acting, v) - rate)
    out[9] = 0.0
    acting *= force


@compiled
def gear_position(q: Floats, m: int, meshes: MeshArrays, row: Floats, nominal: float) -> float:
    """Centre distance (m) or misalignment (rad) of mesh m by its row."""
    gradient, turning = np.empty(ROW_SIZE), np.empty(ROW_SIZE)
    index = meshes.coordinates[m]
    value: float = nominal + frame_row(q, index, meshes.place[m], row, gradient, turning)
    return value


@compiled
def flank_of(side: int, m: int, meshes: MeshArrays) -> tuple[Floats, Floats, float, float, float]:
    """Rows of deflection and misalignment, deflection at zero coordinates, phase and cycles of one flank (1, -1)."""
    table = meshes.table
    if side > 0:
        return (
            meshes.deflection[m], table.tilt[m], table.nominal[m, 0], meshes.phase[m], meshes.cycles[m],
        )  # fmt: skip
    return (
        table.back[m], table.back_tilt[m], -table.nominal[m, 0] - table.backlash[m], table.back_phase[m],
        -meshes.cycles[m],
    )  # fmt: skip


@compiled
def table_force(q: Floats, v: Floats, m: int, meshes: MeshArrays, out: Floats, acting: Floats) -> None:
    """Fill the state of a mesh with a table, as in `mesh_state`, and its generalized force, negative (13,)."""
    table, memory = meshes.table, scratch_memory()
    gradient, turning, bend = np.empty(ROW_SIZE), np.empty(ROW_SIZE), np.empty(2)
    index, place = meshes.coordinates[m], meshes.place[m]
    centre = gear_position(q, m, meshes, table.centre[m], table.nominal[m, 1])
    spin, cycling = relative_spin(q, index, 0), relative_spin(v, index, 0)
    pmc = mesh_position(q, m, meshes)
    out[:] = 0.0
    acting[:] = 0.0
    out[2] = pmc - math.floor(pmc)
    for side in (1, -1):
        row, tilt, offset, phase, cycles = flank_of(side, m, meshes)
        delta = offset + approach(q, m, meshes, row, float(side), gradient, turning, bend)
        rate = along(index, gradient, v)
        if side > 0:
            out[0], out[1] = delta, rate
        if delta <= table.lowest[m]:
            continue
        sense = side * table.sense[m]
        misalignment = sense * gear_position(q, m, meshes, tilt, table.nominal[m, 2])
        pmc = phase + cycles * spin
        surface_law(delta, pmc, centre, misalignment, m, table, 0, ORDERS.shape[0], memory)
        law = memory.law
        damping = table.damping_time[m] * law[1]
        force = law[0] + damping * rate
        for i in range(ROW_SIZE):
            acting[i] += force * gradient[i]
        frame_row(q, index, place, law[3] * table.centre[m] + law[4] * sense * tilt, gradient, turning)
        for i in range(ROW_SIZE):
            acting[i] += gradient[i]
        out[3] += law[1]
        out[4] += side * force
        out[5] += law[2]
        out[6] += damping * rate * rate
        out[7] -= law[5] * cycles * cycling
        out[9] = max(out[9], law[6])


@compiled
def add_mesh_forces(q: Floats, v: Floats, meshes: MeshArrays, f: Floats) -> None:
    """Add the generalized forces of all meshes to f, shape of q."""
    state, acting = np.empty(STATE_SIZE), np.empty(ROW_SIZE)
    for m in range(meshes.coordinates.shape[0]):
        if meshes.table.shape[m, 0] > 0:
            table_force(q, v, m, meshes, state, acting)
        else:
            linear_force(q, v, m, meshes, state, acting)
        index = meshes.coordinates[m]
        for i in range(ROW_SIZE):
            if index[i] >= 0:
                f[index[i]] -= acting[i]


@compiled
def add_mesh_jacobian(q: Floats, v: Floats, meshes: MeshArrays, jq: Floats, jv: Floats) -> None:
    """Add d f/dq and d f/dv of `add_mesh_forces` to jq and jv, each (n, n)."""
    local_q, local_v = np.empty((ROW_SIZE, ROW_SIZE)), np.empty((ROW_SIZE, ROW_SIZE))
    for m in range(meshes.coordinates.shape[0]):
        local_q[:] = 0.0
        local_v[:] = 0.0
        if meshes.table.shape[m, 0] > 0:
            for side in (1, -1):
                table_tangent(q, v, m, side, meshes, local_q, local_v)
        else:
            linear_tangent(q, v, m, meshes, local_q, local_v)
        index = meshes.coordinates[m]
        for i in range(ROW_SIZE):
            for j in range(ROW_SIZE):
                if index[i] >= 0 and index[j] >= 0:
                    jq[index[i], index[j]] -= local_q[i, j]
                    jv[index[i], index[j]] -= local_v[i, j]


@compiled
def turn_rows(turning: Floats, bend: Floats, factor: float, out: Floats) -> None:
    """Add factor times the second derivatives of a row's value, (13, 13)."""
    for i in range(ROW_SIZE):
        out[i, 12] += factor * turning[i]
        if i != 12:
            out[12, i] += factor * turning[i]
    for end in range(2):
        o = 6 * end + 5
        out[o, o] += factor * bend[end]
        out[12, 12] += factor * bend[end]
        out[o, 12] -= factor * bend[end]
        out[12, o] -= factor * bend[end]


@compiled
def rate_gradient(v: Floats, index: Integers, turning: Floats, bend: Floats, out: Floats) -> None:
    """Differentiate a row's rate by the coordinates, (13,)."""
    psi_rate = v[index[12]] if index[12] >= 0 else 0.0
    for i in range(ROW_SIZE):
        out[i] = turning[i] * psi_rate
    out[12] = along(index, turning, v)
    for end in range(2):
        change = bend[end] * relative_spin(v, index, end)
        out[6 * end + 5] += change
        out[12] -= change


@compiled
def linear_tangent(q: Floats, v: Floats, m: int, meshes: MeshArrays, jq: Floats, jv: Floats) -> None:
    """Add the derivatives of the negative force of a mesh with a stiffness k(pmc), (13, 13)."""
    gradient, turning, bend = np.empty(ROW_SIZE), np.empty(ROW_SIZE), np.empty(2)
    acting, acting_turning = np.empty(ROW_SIZE), np.empty(ROW_SIZE)
    slope = np.empty(ROW_SIZE)
    index = meshes.coordinates[m]
    delta = meshes.table.nominal[m, 0]
    delta += approach(q, m, meshes, meshes.deflection[m], 1.0, gradient, turning, bend)
    k, k_slope = stiffness_at(meshes.stiffness[m], meshes.pieces[m], mesh_position(q, m, meshes))
    c = meshes.damping[m]
    force = k * delta + c * along(index, gradient, v)
    rate_gradient(v, index, turning, bend, slope)
    slope *= c
    slope += k * gradient
    slope[5] += delta * k_slope * meshes.cycles[m]
    slope[12] -= delta * k_slope * meshes.cycles[m]
    approach(q, m, meshes, meshes.force[m], 1.0, acting, acting_turning, bend)
    for i in range(ROW_SIZE):
        for j in range(ROW_SIZE):
            jq[i, j] += acting[i] * slope[j]
            jv[i, j] += acting[i] * c * gradient[j]
    turn_rows(acting_turning, bend, force, jq)


@compiled
def table_tangent(q: Floats, v: Floats, m: int, side: int, meshes: MeshArrays, jq: Floats, jv: Floats) -> None:
    """Add the derivatives of the negative force of one flank of a mesh with a table, (13, 13)."""
    table, memory = meshes.table, scratch_memory()
    index, place = meshes.coordinates[m], meshes.place[m]
    row, tilt, offset, phase, cycles = flank_of(side, m, meshes)
    gradients, slopes = np.zeros((4, ROW_SIZE)), np.zeros((4, ROW_SIZE))
    turning, bend, changing = np.empty(ROW_SIZE), np.empty(2), np.empty(ROW_SIZE)
    delta = offset + approach(q, m, meshes, row, float(side), gradients[0], turning, bend)
    if delta <= table.lowest[m]:
        return
    centre = table.nominal[m, 1] + frame_row(q, index, place, table.centre[m], gradients[1], changing)
    sense = side * table.sense[m]
    tilting = sense * tilt
    misalignment = sense * table.nominal[m, 2] + frame_row(q, index, place, tilting, gradients[2], changing)
    pmc = phase + cycles * relative_spin(q, index, 0)
    gradients[3, 5], gradients[3, 12] = cycles, -cycles
    piece, t = surface_law(delta, pmc, centre, misalignment, m, table, 0, ORDERS.shape[0], memory)
    if t < 0.0:
        return
    second = np.empty((4, 4))
    surface_tangent(t, piece, m, table, memory, second)
    law, time = memory.law, table.damping_time[m]
    rate = along(index, gradients[0], v)
    for a in range(3):
        for b in range(4):
            slopes[a] += second[a, b] * gradients[b]
    rate_gradient(v, index, turning, bend, changing)
    for b in range(4):
        slopes[0] += time * rate * second[3, b] * gradients[b]
    slopes[0] += time * law[1] * changing
    for a in range(3):
        for i in range(ROW_SIZE):
            for j in range(ROW_SIZE):
                jq[i, j] += gradients[a, i] * slopes[a, j]
    for i in range(ROW_SIZE):
        for j in range(ROW_SIZE):
            jv[i, j] += time * law[1] * gradients[0, i] * gradients[0, j]
    turn_rows(turning, bend, law[0] + time * law[1] * rate, jq)
    bend[:] = 0.0
    frame_row(q, index, place, law[3] * table.centre[m] + law[4] * tilting, gradients[0], turning)
    turn_rows(turning, bend, 1.0, jq)


@compiled
def mesh_state(q: Floats, v: Floats, meshes: MeshArrays, out: Floats) -> None:
    """Fill (m, 10): what each mesh does.

    Deflection (m), its rate (m/s), pmc in [0, 1), tangent stiffness (N/m), F_bt (N, negative on the other flank),
    elastic energy (J); powers (W): damped, of the stiffness that changes with pmc, of a force that is not conjugate;
    1 where the mesh is outside its table.
    """
    acting = np.empty(ROW_SIZE)
    for m in range(meshes.coordinates.shape[0]):
        if meshes.table.shape[m, 0] > 0:
            table_force(q, v, m, meshes, out[m], acting)
        else:
            linear_force(q, v, m, meshes, out[m], acting)


@compiled
def gear_positions(q: Floats, meshes: MeshArrays, out: Floats) -> None:
    """Fill (m, 2): centre distance (m) and misalignment of the loaded flank (rad) of each mesh."""
    table = meshes.table
    for m in range(meshes.coordinates.shape[0]):
        out[m, 0] = gear_position(q, m, meshes, table.centre[m], table.nominal[m, 1])
        out[m, 1] = gear_position(q, m, meshes, table.tilt[m], table.nominal[m, 2])
