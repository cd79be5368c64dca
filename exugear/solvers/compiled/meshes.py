"""Forces of gear meshes in the compiled solver."""

from __future__ import annotations

import math

from exugear.kernels.table_law import FIRST_TWO, piece_at, surface_law
from exugear.solvers.compiled.arrays import Meshes, Work
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import kernel


@kernel
def mesh_row(
    q: Floats, v: Floats, index: Integers, place: Floats, row: Floats, c: float, s: float, gradient: Floats
) -> tuple[float, float]:
    """Value and rate of a row over the coordinates seen from its frame; fills its gradient (13,)."""
    psi, psi_rate = q[index[12]], v[index[12]]
    value, rate, turning = 0.0, 0.0, 0.0
    for end in range(2):
        o = 6 * end
        px, py = place[end, 0], place[end, 1]
        for pair in (0, 3):
            i, j = index[o + pair], index[o + pair + 1]
            x, y = px + q[i], py + q[j]
            lx, ly = c * x + s * y, c * y - s * x
            wx, wy = row[o + pair], row[o + pair + 1]
            gx, gy = c * wx - s * wy, s * wx + c * wy
            value += wx * (lx - px) + wy * (ly - py)
            rate += gx * v[i] + gy * v[j]
            turning += wx * ly - wy * lx
            gradient[o + pair], gradient[o + pair + 1] = gx, gy
            px, py = 0.0, 0.0
        axial, spin = row[o + 2], row[o + 5]
        value += axial * q[index[o + 2]] + spin * (q[index[o + 5]] - psi)
        rate += axial * v[index[o + 2]] + spin * v[index[o + 5]]
        turning -= spin
        gradient[o + 2], gradient[o + 5] = axial, spin
    gradient[12] = turning
    return value, rate + turning * psi_rate


@kernel
def mesh_stiffness(q: Floats, m: int, meshes: Meshes) -> tuple[float, float]:
    """Stiffness (N/m) of mesh m and its slope per cycle."""
    position = meshes.phase[m] + meshes.cycles[m] * (q[meshes.coordinates[m, 5]] - q[meshes.coordinates[m, 12]])
    pieces = meshes.pieces[m]
    scaled = (position - math.floor(position)) * pieces
    piece = piece_at(scaled, pieces)
    t = scaled - piece
    c = meshes.stiffness[m, piece]
    slope = (c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])) * pieces
    return c[0] + t * (c[1] + t * (c[2] + t * c[3])), slope


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
def take_off_errors(q: Floats, v: Floats, m: int, side: float, meshes: Meshes, gradient: Floats) -> tuple[float, float]:
    """Change of a deflection and its rate by the gears' errors; changes its gradient too."""
    delta, rate = 0.0, 0.0
    index = meshes.coordinates[m]
    for end in range(2):
        if meshes.error_pieces[m, end] > 0:
            spin, frame = index[6 * end + 5], index[12]
            error, slope = error_at(m, end, q[spin] - q[frame], meshes)
            delta -= side * error
            rate -= side * slope * (v[spin] - v[frame])
            gradient[6 * end + 5] -= side * slope
            gradient[12] += side * slope
    return delta, rate


@kernel
def mesh_motion(q: Floats, v: Floats, m: int, meshes: Meshes, work: Work) -> tuple[float, float, float]:
    """Deflection of mesh m, its rate, and the rate along the force row; fills `work.gradient`."""
    index = meshes.coordinates[m]
    clean = meshes.error_pieces[m, 0] + meshes.error_pieces[m, 1] == 0
    if meshes.spinning[m] == 1 and clean:
        one, two = meshes.deflection[m, 5], meshes.deflection[m, 11]
        i, j, k = index[5], index[11], index[12]
        delta = meshes.table.nominal[m, 0] + one * (q[i] - q[k]) + two * (q[j] - q[k])
        rate = one * (v[i] - v[k]) + two * (v[j] - v[k])
        if meshes.conjugate[m] == 1:
            return delta, rate, rate
        one, two = meshes.force[m, 5], meshes.force[m, 11]
        return delta, rate, one * (v[i] - v[k]) + two * (v[j] - v[k])
    c, s = work.turns[meshes.slot[m], 0], work.turns[meshes.slot[m], 1]
    delta, rate = mesh_row(q, v, index, meshes.place[m], meshes.deflection[m], c, s, work.gradient[0])
    delta += meshes.table.nominal[m, 0]
    if not clean:
        less, slower = take_off_errors(q, v, m, 1.0, meshes, work.gradient[0])
        delta, rate = delta + less, rate + slower
    if meshes.conjugate[m] == 1:
        return delta, rate, rate
    _, acting = mesh_row(q, v, index, meshes.place[m], meshes.force[m], c, s, work.gradient[1])
    if not clean:
        _, slower = take_off_errors(q, v, m, 1.0, meshes, work.gradient[1])
        acting += slower
    return delta, rate, acting


@kernel
def table_flank(
    q: Floats, v: Floats, m: int, side: int, centre: float, count: int, meshes: Meshes, work: Work, energy: Floats
) -> float:
    """Add the negative generalized force of one flank (1, -1) of a mesh with a table to `work.gradient[2]`.

    Its scalar force is returned; with all four derivatives asked for (`count`), energy and powers are added to
    `energy` as in `observe`.
    """
    table, index, place = meshes.table, meshes.coordinates[m], meshes.place[m]
    c, s = work.turns[meshes.slot[m], 0], work.turns[meshes.slot[m], 1]
    gradient, total = work.gradient[0], work.gradient[2]
    if side > 0:
        row, tilt, offset = meshes.deflection[m], table.tilt[m], table.nominal[m, 0]
        phase, cycles, number = meshes.phase[m], meshes.cycles[m], 0
    else:
        row, tilt, offset = table.back[m], table.back_tilt[m], -table.nominal[m, 0] - table.backlash[m]
        phase, cycles, number = table.back_phase[m], -meshes.cycles[m], 1
    delta, rate = mesh_row(q, v, index, place, row, c, s, gradient)
    less, slower = take_off_errors(q, v, m, float(side), meshes, gradient)
    delta, rate = delta + offset + less, rate + slower
    if side > 0:
        work.states[m, 0], work.states[m, 1] = delta, rate
    if delta <= table.lowest[m]:
        return 0.0
    sense = side * table.sense[m]
    misalignment = sense * table.nominal[m, 2]
    spinning = meshes.spinning[m] == 1
    if not spinning:
        misalignment += sense * mesh_row(q, v, index, place, tilt, c, s, work.gradient[1])[0]
    position = phase + cycles * (q[index[5]] - q[index[12]])
    guess = work.pieces[m, number]
    piece, _ = surface_law(delta, position, centre, misalignment, m, table, guess, count, work.law)
    work.pieces[m, number] = piece
    law = work.law.law
    damping = table.damping_time[m] * law[1]
    force: float = law[0] + damping * rate
    for i in range(13):
        total[i] += force * gradient[i]
    if not spinning:
        for i in range(12):
            work.row[i] = law[3] * table.centre[m, i] + law[4] * sense * tilt[i]
        mesh_row(q, v, index, place, work.row, c, s, work.gradient[1])
        for i in range(13):
            total[i] += work.gradient[1, i]
    work.states[m, 2] = max(work.states[m, 2], law[6])
    if count > FIRST_TWO:
        energy[1] += law[2]
        energy[3] += damping * rate * rate
        energy[4] -= law[5] * cycles * (v[index[5]] - v[index[12]])
    return force


@kernel
def table_mesh(q: Floats, v: Floats, m: int, count: int, meshes: Meshes, work: Work, energy: Floats) -> float:
    """Fill `work.gradient[2]` with the negative generalized force of a mesh with a table; F_bt is returned."""
    table = meshes.table
    work.gradient[2, :] = 0.0
    work.states[m, 2] = 0.0
    centre = table.nominal[m, 1]
    if meshes.spinning[m] == 0:
        c, s = work.turns[meshes.slot[m], 0], work.turns[meshes.slot[m], 1]
        index = meshes.coordinates[m]
        centre += mesh_row(q, v, index, meshes.place[m], table.centre[m], c, s, work.gradient[1])[0]
    force = 0.0
    for side in (1, -1):
        force += side * table_flank(q, v, m, side, centre, count, meshes, work, energy)
    return force


@kernel
def add_meshes(q: Floats, v: Floats, meshes: Meshes, work: Work) -> None:
    """Add the generalized forces of all meshes to `work.force`."""
    f = work.force
    for m in range(meshes.coordinates.shape[0]):
        index = meshes.coordinates[m]
        if meshes.table.shape[m, 0] > 0:
            table_mesh(q, v, m, FIRST_TWO, meshes, work, work.total)
            for i in range(13):
                f[index[i]] -= work.gradient[2, i]
            continue
        delta, rate, _ = mesh_motion(q, v, m, meshes, work)
        k, _ = mesh_stiffness(q, m, meshes)
        force = k * delta + meshes.damping[m] * rate
        if meshes.spinning[m] == 1 and meshes.error_pieces[m, 0] + meshes.error_pieces[m, 1] == 0:
            one, two = force * meshes.force[m, 5], force * meshes.force[m, 11]
            f[index[5]] -= one
            f[index[11]] -= two
            f[index[12]] += one + two
        else:
            acting = work.gradient[1 - meshes.conjugate[m]]
            for i in range(13):
                f[index[i]] -= force * acting[i]
