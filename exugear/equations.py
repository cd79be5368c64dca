"""Equations of motion, signals and a Runge-Kutta loop as one compiled piece that allocates nothing per step.

The laws are those of `exugear.kernels`, which the tests hold them against; here they are arranged for speed: every
sine is taken once per evaluation, constant entries that are zero are left out, bearing forces are collected per body
before they are turned into generalized ones. Bodies without a coordinate point to one that stays zero, so that
the loops need no exceptions.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exugear.elastic import ElasticArrays, ElasticMotion, elastic_energies, set_elastic_motion
from exugear.table_law import FIRST_TWO, Scratch, TableArrays, piece_at, surface_law
from exugear.travelling import TravellingArrays, place_travelling, share_travelling_forces
from exugear.turning import TurningArrays, set_turning_motion, turning_energies
from fe_ste.compilation import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Bodies(NamedTuple):
    """Bodies with six coordinates, seats of elastic bodies, the ground; then bodies with their spin alone.

    Attributes
    ----------
    start : (b + e + 1,) first coordinate, of the rigid ones, then of seats, then one that stays zero for the ground
    slot : (b + e + 1,) where `Work.turns` has the sine of the spin, 0 where no law needs it
    mass, transverse, axial : (b,) kg, kg m2
    spin, spin_inertia : (s,) coordinate and kg m2 of bodies with their spin alone
    inverse : (s, s) inverse mass matrix of these spins where gears only roll, else (0, 0)
    turning : (k,) coordinates whose sine is needed; the first is one that stays zero
    """

    start: Integers
    slot: Integers
    mass: Floats
    transverse: Floats
    axial: Floats
    spin: Integers
    spin_inertia: Floats
    inverse: Floats
    turning: Integers


class Connectors(NamedTuple):
    """6x6 connectors, those between the same bodies one after the other, entries that are not zero as lists.

    Attributes
    ----------
    number : (c,) place of each connector in the assembly
    ends : (c, 2) numbers of the two bodies in `Bodies`
    local : (c, 2, 3) attachment in each body's axes, m
    gap : (c, 3) second attachment against the first at zero angles, m
    repeated : (c,) 1 where the one before has the same ends, so that angles and their rates are known
    twisting : (c,) 1 where the angle about z acts on these ends, else 0
    first : (c + 1,) first entry of each connector
    row, column : (e,) place of each entry in the 6x6 matrix
    stiffness, damping : (e,) its values
    """

    number: Integers
    ends: Integers
    local: Floats
    gap: Floats
    repeated: Integers
    twisting: Integers
    first: Integers
    row: Integers
    column: Integers
    stiffness: Floats
    damping: Floats


class Meshes(NamedTuple):
    """Meshes as in `exugear.kernels.MeshArrays`, with missing coordinates pointing to one that stays zero.

    Attributes
    ----------
    coordinates : (m, 13)
    slot : (m,) where `Work.turns` has the sine of the frame's angle
    place : (m, 2, 2) zero for gears without translations
    conjugate : (m,) 1 where the force row is the deflection row
    spinning : (m,) 1 where the gears have their spins alone
    """

    coordinates: Integers
    slot: Integers
    place: Floats
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


class Loads(NamedTuple):
    """What acts from outside.

    Attributes
    ----------
    steady : (size + 6 t,) constant generalized forces, weight included; zero on travelling seats
    coordinate : (s,) coordinates with a torque given over time
    first : (s + 1,) first line of each series in `time` (s) and `torque` (N m), linear between the lines
    drive : (d,) coordinates driven behind a spring and damper
    law : (d, 5) stiffness, damping, and angle law[2] + law[3] t + law[4] t^2
    """

    steady: Floats
    coordinate: Integers
    first: Integers
    time: Floats
    torque: Floats
    drive: Integers
    law: Floats


class Joints(NamedTuple):
    """Ideal joints in minimal coordinates, for their forces only.

    Attributes
    ----------
    ends : (m, 2) joint that carries gear 1 and gear 2 of each mesh, -1 for none
    host : (j,) joint of the body that a joint sits on, -1 for ground
    planet : (j, 3) mass, x and y from the carrier's axis; mass 0 where nothing orbits
    carrier, slot : (j,) coordinate of the carrier's spin, and where its sine is
    """

    ends: Integers
    host: Integers
    planet: Floats
    carrier: Integers
    slot: Integers


class Springs(NamedTuple):
    """Torsional springs: (s, 2) coordinates, N m/rad, N m s/rad."""

    ends: Integers
    stiffness: Floats
    damping: Floats


class Equations(NamedTuple):
    """All that the right-hand side reads."""

    bodies: Bodies
    connectors: Connectors
    meshes: Meshes
    travelling: TravellingArrays
    springs: Springs
    loads: Loads
    joints: Joints
    elastic: ElasticArrays
    motion: ElasticMotion
    turning: TurningArrays


class Work(NamedTuple):
    """Memory of the right-hand side.

    State vectors have e entries: the system's own, those of travelling seats, and six that stay zero.

    Attributes
    ----------
    q, v : (e,) state at the present step
    stage_q, stage_v, force, rate, total : (e,) stage, generalized forces, accelerations and their sum
    turns : (k, 2) cosine and sine of `Bodies.turning`
    frames : (b + e + 1, 16) rotation matrix, angular velocity, sine and cosine of the tilts
    wrench : (b + e + 1, 6) force and moment on each body, global axes
    motion : (4, 6) strain, its rate, the true rate of change, force of a connector in its own axes
    gradient : (3, 13) gradients of the deflection and of the force row, and the force of a mesh with a table
    series : (s,) line of each torque series that was used last
    states : (m, 4) deflection and its rate, 1 where a table's axis was left, scalar force
    scratch, memory : memory of the elastic bodies, and of those in turning frames
    pieces : (m, 2) load piece of each flank's table that was used last
    law : memory of the law `table`
    row : (12,) row of the push between the axes and the moment of misalignment
    """

    q: Floats
    v: Floats
    stage_q: Floats
    stage_v: Floats
    force: Floats
    rate: Floats
    total: Floats
    turns: Floats
    frames: Floats
    wrench: Floats
    motion: Floats
    gradient: Floats
    series: Integers
    states: Floats
    scratch: Floats
    memory: Floats
    pieces: Integers
    law: Scratch
    row: Floats


@kernel
def place_bodies(q: Floats, v: Floats, bodies: Bodies, work: Work) -> None:
    """Take sines, rotation matrices and angular velocities of all bodies, once per evaluation."""
    for n in range(bodies.turning.size):
        angle = q[bodies.turning[n]]
        work.turns[n, 0], work.turns[n, 1] = math.cos(angle), math.sin(angle)
    for n in range(bodies.start.size - 1):
        o = bodies.start[n]
        a, b = q[o + 3], q[o + 4]
        ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
        cg, sg = work.turns[bodies.slot[n], 0], work.turns[bodies.slot[n], 1]
        frame = work.frames[n]
        frame[0], frame[1], frame[2] = cb * cg, -cb * sg, sb
        frame[3], frame[4], frame[5] = ca * sg + sa * sb * cg, ca * cg - sa * sb * sg, -sa * cb
        frame[6], frame[7], frame[8] = sa * sg - ca * sb * cg, sa * cg + ca * sb * sg, ca * cb
        da, db, dg = v[o + 3], v[o + 4], v[o + 5]
        frame[9], frame[10], frame[11] = da + sb * dg, ca * db - sa * cb * dg, sa * db + ca * cb * dg
        frame[12], frame[13], frame[14], frame[15] = sa, ca, sb, cb


@kernel
def move_connector(
    q: Floats, v: Floats, n: int, bodies: Bodies, connectors: Connectors, work: Work
) -> tuple[float, float, float, float, float, float]:
    """Fill strain and rate of connector n into `work.motion`; return the two arms, global axes (m).

    As Exudyn's RigidBodySpringDamper: second attachment against the first in the first body's axes, the rate not
    corrected for the turning of these axes.
    """
    i, j = connectors.ends[n, 0], connectors.ends[n, 1]
    o, p = bodies.start[i], bodies.start[j]
    one, two = work.frames[i], work.frames[j]
    x, y, z = connectors.local[n, 1]
    bx = two[0] * x + two[1] * y + two[2] * z
    by = two[3] * x + two[4] * y + two[5] * z
    bz = two[6] * x + two[7] * y + two[8] * z
    wx, wy, wz = two[9], two[10], two[11]
    dx = connectors.gap[n, 0] + q[p] + (bx - x)
    dy = connectors.gap[n, 1] + q[p + 1] + (by - y)
    dz = connectors.gap[n, 2] + q[p + 2] + (bz - z)
    ux = v[p] + (wy * bz - wz * by)
    uy = v[p + 1] + (wz * bx - wx * bz)
    uz = v[p + 2] + (wx * by - wy * bx)
    ax, ay, az = connectors.local[n, 0]
    strain, rate = work.motion[0], work.motion[1]
    if i == bodies.start.size - 1:
        strain[0], strain[1], strain[2] = dx, dy, dz
        rate[0], rate[1], rate[2] = ux, uy, uz
        if connectors.repeated[n] == 1:
            return ax, ay, az, bx, by, bz
        rate[3], rate[4], rate[5] = wx, wy, wz
        strain[3], strain[4] = q[p + 3], q[p + 4]
    else:
        x, y, z = ax, ay, az
        ax = one[0] * x + one[1] * y + one[2] * z
        ay = one[3] * x + one[4] * y + one[5] * z
        az = one[6] * x + one[7] * y + one[8] * z
        ox, oy, oz = one[9], one[10], one[11]
        dx += (x - ax) - q[o]
        dy += (y - ay) - q[o + 1]
        dz += (z - az) - q[o + 2]
        ux -= v[o] + (oy * az - oz * ay)
        uy -= v[o + 1] + (oz * ax - ox * az)
        uz -= v[o + 2] + (ox * ay - oy * ax)
        for k in range(3):
            strain[k] = one[k] * dx + one[3 + k] * dy + one[6 + k] * dz
            rate[k] = one[k] * ux + one[3 + k] * uy + one[6 + k] * uz
        if connectors.repeated[n] == 1:
            return ax, ay, az, bx, by, bz
        wx, wy, wz = wx - ox, wy - oy, wz - oz
        for k in range(3):
            rate[3 + k] = one[k] * wx + one[3 + k] * wy + one[6 + k] * wz
        first = one[0] * two[2] + one[3] * two[5] + one[6] * two[8]
        second = one[1] * two[2] + one[4] * two[5] + one[7] * two[8]
        third = one[2] * two[2] + one[5] * two[5] + one[8] * two[8]
        strain[3] = math.atan2(-second, third)
        strain[4] = math.asin(min(1.0, max(-1.0, first)))
    strain[5] = 0.0
    if connectors.twisting[n] == 1:
        cosine = one[0] * two[0] + one[3] * two[3] + one[6] * two[6]
        sine = one[0] * two[1] + one[3] * two[4] + one[6] * two[7]
        strain[5] = math.atan2(-sine, cosine)
    return ax, ay, az, bx, by, bz


@kernel
def connector_force(n: int, connectors: Connectors, work: Work) -> None:
    """Fill the force of connector n on its first body, in that body's axes, into `work.motion[3]`."""
    strain, rate, own = work.motion[0], work.motion[1], work.motion[3]
    own[:] = 0.0
    for entry in range(connectors.first[n], connectors.first[n + 1]):
        column = connectors.column[entry]
        own[connectors.row[entry]] += (
            connectors.stiffness[entry] * strain[column] + connectors.damping[entry] * rate[column]
        )


@kernel
def add_connectors(q: Floats, v: Floats, bodies: Bodies, connectors: Connectors, work: Work) -> None:
    """Collect the forces of all connectors per body in `work.wrench`, then add them to `work.force`."""
    work.wrench[:] = 0.0
    for n in range(connectors.ends.shape[0]):
        ax, ay, az, bx, by, bz = move_connector(q, v, n, bodies, connectors, work)
        connector_force(n, connectors, work)
        i, j = connectors.ends[n, 0], connectors.ends[n, 1]
        own, turn = work.motion[3], work.frames[i]
        fx = turn[0] * own[0] + turn[1] * own[1] + turn[2] * own[2]
        fy = turn[3] * own[0] + turn[4] * own[1] + turn[5] * own[2]
        fz = turn[6] * own[0] + turn[7] * own[1] + turn[8] * own[2]
        mx = turn[0] * own[3] + turn[1] * own[4] + turn[2] * own[5]
        my = turn[3] * own[3] + turn[4] * own[4] + turn[5] * own[5]
        mz = turn[6] * own[3] + turn[7] * own[4] + turn[8] * own[5]
        one, two = work.wrench[i], work.wrench[j]
        one[0] += fx
        one[1] += fy
        one[2] += fz
        one[3] += mx + (ay * fz - az * fy)
        one[4] += my + (az * fx - ax * fz)
        one[5] += mz + (ax * fy - ay * fx)
        two[0] -= fx
        two[1] -= fy
        two[2] -= fz
        two[3] -= mx + (by * fz - bz * fy)
        two[4] -= my + (bz * fx - bx * fz)
        two[5] -= mz + (bx * fy - by * fx)
    f = work.force
    for n in range(bodies.start.size - 1):
        o, load, frame = bodies.start[n], work.wrench[n], work.frames[n]
        sa, ca, sb, cb = frame[12], frame[13], frame[14], frame[15]
        f[o] += load[0]
        f[o + 1] += load[1]
        f[o + 2] += load[2]
        f[o + 3] += load[3]
        f[o + 4] += ca * load[4] + sa * load[5]
        f[o + 5] += sb * load[3] - sa * cb * load[4] + ca * cb * load[5]


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


@kernel
def add_springs(q: Floats, v: Floats, springs: Springs, f: Floats) -> None:
    """Add the torques of the torsional springs to f."""
    for n in range(springs.ends.shape[0]):
        i, j = springs.ends[n, 0], springs.ends[n, 1]
        torque = springs.stiffness[n] * (q[j] - q[i]) + springs.damping[n] * (v[j] - v[i])
        f[i] += torque
        f[j] -= torque


@kernel
def set_loads(t: float, q: Floats, v: Floats, loads: Loads, series: Integers, f: Floats) -> None:
    """Set f to what acts from outside at time t (s)."""
    for i in range(loads.steady.size):
        f[i] = loads.steady[i]
    for n in range(loads.coordinate.size):
        first, last = loads.first[n], loads.first[n + 1] - 1
        line = series[n]
        while line < last - 1 and loads.time[line + 1] <= t:
            line += 1
        while line > first and loads.time[line] > t:
            line -= 1
        series[n] = line
        share = (t - loads.time[line]) / (loads.time[line + 1] - loads.time[line])
        share = min(1.0, max(0.0, share))
        f[loads.coordinate[n]] += loads.torque[line] + share * (loads.torque[line + 1] - loads.torque[line])
    for n in range(loads.drive.size):
        i, law = loads.drive[n], loads.law[n]
        angle, speed = law[2] + t * (law[3] + t * law[4]), law[3] + 2.0 * t * law[4]
        f[i] += law[0] * (angle - q[i]) + law[1] * (speed - v[i])


@kernel
def set_accelerations(v: Floats, bodies: Bodies, work: Work) -> None:
    """Solve the bodies' equations for `work.rate`; formula in `exugear.kernels.accelerations`."""
    f, out = work.force, work.rate
    for n in range(bodies.mass.size):
        o, jt, ja = bodies.start[n], bodies.transverse[n], bodies.axial[n]
        sb, cb = work.frames[n, 14], work.frames[n, 15]
        for i in range(3):
            out[o + i] = f[o + i] / bodies.mass[n]
        da, db = v[o + 3], v[o + 4]
        p = ja * (v[o + 5] + da * sb)
        out[o + 3] = (f[o + 3] - f[o + 5] * sb - p * db * cb + 2.0 * jt * da * db * sb * cb) / (jt * cb * cb)
        out[o + 4] = (f[o + 4] - jt * da * da * sb * cb + p * da * cb) / jt
        out[o + 5] = f[o + 5] / ja - out[o + 3] * sb - da * db * cb
    for n in range(bodies.spin.size):
        out[bodies.spin[n]] = f[bodies.spin[n]] / bodies.spin_inertia[n]
    for n in range(bodies.inverse.shape[0]):
        out[bodies.spin[n]] = 0.0
        for m in range(bodies.inverse.shape[1]):
            out[bodies.spin[n]] += bodies.inverse[n, m] * f[bodies.spin[m]]


@kernel
def evaluate(t: float, q: Floats, v: Floats, equations: Equations, work: Work) -> None:
    """Fill `work.rate` with the accelerations at time t (s) and state q, v (e,)."""
    place_bodies(q, v, equations.bodies, work)
    set_loads(t, q, v, equations.loads, work.series, work.force)
    add_connectors(q, v, equations.bodies, equations.connectors, work)
    place_travelling(q, v, equations.travelling)
    add_meshes(q, v, equations.meshes, work)
    share_travelling_forces(q, equations.travelling, work.force)
    add_springs(q, v, equations.springs, work.force)
    set_accelerations(v, equations.bodies, work)
    set_elastic_motion(q, v, work.force, equations.motion, work.scratch[0], work.rate)
    set_turning_motion(q, v, work.force, equations.turning, work.memory, work.rate)


@kernel
def advance(first: int, step: float, equations: Equations, work: Work, out_q: Floats, out_v: Floats) -> int:
    """Fill out_q and out_v (steps, size) with the states after each step of the classical Runge-Kutta method.

    Starts from `work.q`, `work.v` at time ``first * step``; returns the number of steps that stayed finite.
    """
    size = out_q.shape[1]
    q, v, x, u, a, total = work.q, work.v, work.stage_q, work.stage_v, work.rate, work.total
    half = 0.5 * step
    for n in range(out_q.shape[0]):
        begin = (first + n) * step
        for i in range(size):
            x[i], u[i] = q[i], v[i]
            total[i], out_q[n, i] = 0.0, 0.0
        for stage in range(4):  # a loop, so that the equations are compiled once
            evaluate(begin + (0.0 if stage == 0 else half if stage < 3 else step), x, u, equations, work)
            weight = 2.0 if stage == 1 or stage == 2 else 1.0
            ahead = half if stage < 2 else step
            for i in range(size):
                total[i] += weight * a[i]
                if stage < 3:
                    out_q[n, i] += a[i]
                    x[i] = q[i] + ahead * u[i]
                    u[i] = v[i] + ahead * a[i]
        check = 0.0
        for i in range(size):
            q[i] += step * (v[i] + step / 6.0 * out_q[n, i])
            v[i] += step / 6.0 * total[i]
            out_q[n, i], out_v[n, i] = q[i], v[i]
            check += abs(q[i]) + abs(v[i])
        if not math.isfinite(check):
            return n
    steps: int = out_q.shape[0]
    return steps


@kernel
def place_signals(q: Floats, v: Floats, m: int, meshes: Meshes, work: Work, places: Floats) -> None:
    """Fill change of centre distance (m) and misalignment (rad) of mesh m."""
    table, index, place = meshes.table, meshes.coordinates[m], meshes.place[m]
    c, s = work.turns[meshes.slot[m], 0], work.turns[meshes.slot[m], 1]
    count = meshes.coordinates.shape[0]
    places[m] = mesh_row(q, v, index, place, table.centre[m], c, s, work.gradient[1])[0]
    tilted = mesh_row(q, v, index, place, table.tilt[m], c, s, work.gradient[1])[0]
    places[count + m] = table.nominal[m, 2] + tilted


@kernel
def observe_meshes(q: Floats, v: Floats, meshes: Meshes, work: Work, signals: Floats, energy: Floats) -> None:
    """Fill deflection and F_bt of each mesh into signals (2 m,); add energy and powers (see `observe`).

    With tables, change of centre distance, misalignment and whether outside the table follow at the end (3 m,).

    The scalar force of each mesh, or that along its line of action, is left in `work.states[:, 3]`.
    """
    count = meshes.coordinates.shape[0]
    for m in range(count):
        if meshes.table.shape[m, 0] > 0:
            force = table_mesh(q, v, m, FIRST_TWO + 1, meshes, work, energy)
            work.states[m, 3] = force
            signals[m], signals[count + m] = work.states[m, 0], force
            places = signals[signals.size - 3 * count :]
            places[m], places[count + m], places[2 * count + m] = 0.0, meshes.table.nominal[m, 2], work.states[m, 2]
            if meshes.spinning[m] == 0:
                place_signals(q, v, m, meshes, work, places)
            continue
        delta, rate, acting = mesh_motion(q, v, m, meshes, work)
        k, slope = mesh_stiffness(q, m, meshes)
        force = k * delta + meshes.damping[m] * rate
        work.states[m, 3] = force
        signals[m], signals[count + m] = delta, force * meshes.line_of_action[m]
        cycling = meshes.cycles[m] * (v[meshes.coordinates[m, 5]] - v[meshes.coordinates[m, 12]])
        energy[1] += 0.5 * k * delta * delta
        energy[3] += meshes.damping[m] * rate * rate
        energy[4] -= 0.5 * slope * cycling * delta * delta
        energy[5] += force * (acting - rate)


@kernel
def true_rate(n: int, first_body: Floats, work: Work) -> None:
    """Fill the derivative of a connector's strain into `work.motion[2]`: see `exugear.kernels.connector_motion`."""
    d, w, out = work.motion[0], work.motion[1], work.motion[2]
    x = first_body[0] * first_body[9] + first_body[3] * first_body[10] + first_body[6] * first_body[11]
    y = first_body[1] * first_body[9] + first_body[4] * first_body[10] + first_body[7] * first_body[11]
    z = first_body[2] * first_body[9] + first_body[5] * first_body[10] + first_body[8] * first_body[11]
    out[0] = w[0] - y * d[2] + z * d[1]
    out[1] = w[1] - z * d[0] + x * d[2]
    out[2] = w[2] - x * d[1] + y * d[0]
    c, s = math.cos(d[3]), math.sin(d[3])
    out[5] = (c * w[5] - s * w[4]) / math.cos(d[4])
    out[4] = c * w[4] + s * w[5]
    out[3] = w[3] - math.sin(d[4]) * out[5]


@kernel
def observe_connectors(
    q: Floats, v: Floats, bodies: Bodies, connectors: Connectors, work: Work, signals: Floats, energy: Floats
) -> None:
    """Fill the force of each bearing on its body (3 c,), global axes; add energy and powers (see `observe`)."""
    for n in range(connectors.ends.shape[0]):
        move_connector(q, v, n, bodies, connectors, work)
        turn = work.frames[connectors.ends[n, 0]]
        true_rate(n, turn, work)
        strain, rate, true, own = work.motion[0], work.motion[1], work.motion[2], work.motion[3]
        own[:] = 0.0
        for entry in range(connectors.first[n], connectors.first[n + 1]):
            row, column = connectors.row[entry], connectors.column[entry]
            elastic = connectors.stiffness[entry] * strain[column]
            damped = connectors.damping[entry] * rate[column]
            own[row] += elastic + damped
            energy[1] += 0.5 * elastic * strain[row]
            energy[3] += damped * rate[row]
            energy[6] += elastic * (rate[row] - true[row])
        first = 3 * connectors.number[n]
        for i in range(3):
            o = 3 * i
            signals[first + i] = -(turn[o] * own[0] + turn[o + 1] * own[1] + turn[o + 2] * own[2])


@kernel
def observe_joints(v: Floats, meshes: Meshes, joints: Joints, work: Work, signals: Floats) -> None:
    """Fill the force of each ideal joint on its body (3 j,), global axes; after `observe_meshes`."""
    signals[:] = 0.0
    for m in range(meshes.coordinates.shape[0]):
        c, s = work.turns[meshes.slot[m], 0], work.turns[meshes.slot[m], 1]
        for end in range(2):
            j = joints.ends[m, end]
            if j >= 0:
                force = work.states[m, 3]
                row = meshes.force[m]
                if force < 0.0 and meshes.table.shape[m, 0] > 0:  # the other flank pushes
                    force, row = -force, meshes.table.back[m]
                x, y, z = row[6 * end], row[6 * end + 1], row[6 * end + 2]
                signals[3 * j] += force * (c * x - s * y)
                signals[3 * j + 1] += force * (s * x + c * y)
                signals[3 * j + 2] += force * z
    for j in range(joints.host.size):
        if joints.planet[j, 0] > 0.0:
            c, s = work.turns[joints.slot[j], 0], work.turns[joints.slot[j], 1]
            pull = joints.planet[j, 0] * v[joints.carrier[j]] ** 2
            signals[3 * j] -= pull * (c * joints.planet[j, 1] - s * joints.planet[j, 2])
            signals[3 * j + 1] -= pull * (s * joints.planet[j, 1] + c * joints.planet[j, 2])
        if joints.host[j] >= 0:
            for i in range(3):
                signals[3 * joints.host[j] + i] += signals[3 * j + i]


@kernel
def observe_bodies(q: Floats, v: Floats, bodies: Bodies, work: Work, energy: Floats) -> None:
    """Add the kinetic energy of all bodies (see `observe`)."""
    for n in range(bodies.mass.size):
        o, sb, cb = bodies.start[n], work.frames[n, 14], work.frames[n, 15]
        square = v[o] * v[o] + v[o + 1] * v[o + 1] + v[o + 2] * v[o + 2]
        tilting = (v[o + 3] * cb) ** 2 + v[o + 4] * v[o + 4]
        spin = v[o + 5] + v[o + 3] * sb
        energy[0] += 0.5 * (bodies.mass[n] * square + bodies.transverse[n] * tilting + bodies.axial[n] * spin * spin)
    for n in range(bodies.spin.size):
        energy[0] += 0.5 * bodies.spin_inertia[n] * v[bodies.spin[n]] ** 2


@kernel
def observe(
    time: Floats, q: Floats, v: Floats, equations: Equations, work: Work, signals: Floats, energies: Floats
) -> None:
    """Fill signals (samples, 2 m + 3 supports) and energies (samples, 7) of states q, v (samples, size).

    Signals: deflection and F_bt of each mesh, force of each bearing or ideal joint, with tables where the gears stand
    (`exugear.channels`). Energies: kinetic and elastic (J); powers (W) of the loads, damped, of k(PMC),
    non-conservative of meshes and of bearings.
    """
    size = q.shape[1]
    meshes, springs = equations.meshes, equations.springs
    two = 2 * meshes.coordinates.shape[0]
    x, u, f = work.stage_q, work.stage_v, work.force
    for n in range(q.shape[0]):
        energy = energies[n]
        energy[:] = 0.0
        for i in range(size):
            x[i], u[i] = q[n, i], v[n, i]
        place_bodies(x, u, equations.bodies, work)
        observe_bodies(x, u, equations.bodies, work, energy)
        place_travelling(x, u, equations.travelling)
        observe_meshes(x, u, meshes, work, signals[n], energy)
        observe_connectors(x, u, equations.bodies, equations.connectors, work, signals[n, two:], energy)
        if equations.joints.host.size > 0:
            observe_joints(u, meshes, equations.joints, work, signals[n, two : two + 3 * equations.joints.host.size])
        for s in range(springs.ends.shape[0]):
            i, j = springs.ends[s, 0], springs.ends[s, 1]
            energy[1] += 0.5 * springs.stiffness[s] * (x[j] - x[i]) ** 2
            energy[3] += springs.damping[s] * (u[j] - u[i]) ** 2
        kinetic, stored, damped = elastic_energies(x, u, equations.elastic, work.scratch)
        energy[0] += kinetic
        energy[1] += stored
        energy[3] += damped
        kinetic, stored, damped, weight = turning_energies(x, u, equations.turning, work.memory)
        energy[0] += kinetic
        energy[1] += stored
        energy[2] += weight
        energy[3] += damped
        set_loads(time[n], x, u, equations.loads, work.series, f)
        for i in range(size):
            energy[2] += f[i] * u[i]
