"""Equations of motion, signals and a Runge-Kutta loop as one compiled piece that allocates nothing per step.

The laws are those of `exugear.kernels`, which the tests hold them against; here they are arranged for speed: every
sine is taken once per evaluation, constant entries that are zero are left out, bearing forces are collected per body
before they are turned into generalized ones. Bodies without a coordinate point to one that stays zero, so that
the loops need no exceptions.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar, cast

import numba
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Function = TypeVar("Function", bound=Callable[..., object])

OPTIONS: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "forceinline": True,
    "_nrt": False,
}


def kernel(function: Function) -> Function:
    """Compile to machine code kept on disk; exact floating-point order, division without checks.

    Nothing is allocated here, so reference counts of arrays are left out (they cost ten times the arithmetic), and
    everything becomes one function (which saves handing over tuples of arrays).
    """
    return cast(Function, numba.njit(**OPTIONS)(function))


class Bodies(NamedTuple):
    """Bodies with six coordinates, the ground behind them as the last; then bodies with their spin alone.

    Attributes
    ----------
    start : (b + 1,) first coordinate
    slot : (b + 1,) where `Work.turns` has the sine of the spin, 0 where no law needs it
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


class Loads(NamedTuple):
    """What acts from outside.

    Attributes
    ----------
    steady : (size,) constant generalized forces, weight included
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
    springs: Springs
    loads: Loads
    joints: Joints


class Work(NamedTuple):
    """Memory of the right-hand side; state vectors have six entries more, which stay zero.

    Attributes
    ----------
    q, v : (size + 6,) state at the present step
    stage_q, stage_v, force, rate, total : (size + 6,) stage, generalized forces, accelerations and their sum
    turns : (k, 2) cosine and sine of `Bodies.turning`
    frames : (b + 1, 16) rotation matrix, angular velocity, sine and cosine of the tilts
    wrench : (b + 1, 6) force and moment on each body, global axes
    motion : (4, 6) strain, its rate, the true rate of change, force of a connector in its own axes
    gradient : (2, 13) gradients of the deflection and of the force row
    series : (s,) line of each torque series that was used last
    states : (m, 5) deflection, its rate, k, slope of k per cycle, scalar force
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


@kernel
def place_bodies(q: Floats, v: Floats, bodies: Bodies, work: Work) -> None:
    """Take sines, rotation matrices and angular velocities of all bodies, once per evaluation."""
    for n in range(bodies.turning.size):
        angle = q[bodies.turning[n]]
        work.turns[n, 0], work.turns[n, 1] = math.cos(angle), math.sin(angle)
    for n in range(bodies.mass.size):
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
    if i == bodies.mass.size:
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
    for n in range(bodies.mass.size):
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
    piece = min(int(scaled), pieces - 1)
    t = scaled - piece
    c = meshes.stiffness[m, piece]
    slope = (c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])) * pieces
    return c[0] + t * (c[1] + t * (c[2] + t * c[3])), slope


@kernel
def mesh_motion(q: Floats, v: Floats, m: int, meshes: Meshes, work: Work) -> tuple[float, float, float]:
    """Deflection of mesh m, its rate, and the rate along the force row; fills `work.gradient`."""
    index = meshes.coordinates[m]
    if meshes.spinning[m] == 1:
        one, two = meshes.deflection[m, 5], meshes.deflection[m, 11]
        i, j, k = index[5], index[11], index[12]
        delta = one * (q[i] - q[k]) + two * (q[j] - q[k])
        rate = one * (v[i] - v[k]) + two * (v[j] - v[k])
        if meshes.conjugate[m] == 1:
            return delta, rate, rate
        one, two = meshes.force[m, 5], meshes.force[m, 11]
        return delta, rate, one * (v[i] - v[k]) + two * (v[j] - v[k])
    c, s = work.turns[meshes.slot[m], 0], work.turns[meshes.slot[m], 1]
    delta, rate = mesh_row(q, v, index, meshes.place[m], meshes.deflection[m], c, s, work.gradient[0])
    if meshes.conjugate[m] == 1:
        return delta, rate, rate
    _, acting = mesh_row(q, v, index, meshes.place[m], meshes.force[m], c, s, work.gradient[1])
    return delta, rate, acting


@kernel
def add_meshes(q: Floats, v: Floats, meshes: Meshes, work: Work) -> None:
    """Add the generalized forces of all meshes to `work.force`."""
    f = work.force
    for m in range(meshes.coordinates.shape[0]):
        delta, rate, _ = mesh_motion(q, v, m, meshes, work)
        k, _ = mesh_stiffness(q, m, meshes)
        force = k * delta + meshes.damping[m] * rate
        index = meshes.coordinates[m]
        if meshes.spinning[m] == 1:
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
    """Fill `work.rate` with the accelerations at time t (s) and state q, v (size + 6,)."""
    place_bodies(q, v, equations.bodies, work)
    set_loads(t, q, v, equations.loads, work.series, work.force)
    add_connectors(q, v, equations.bodies, equations.connectors, work)
    add_meshes(q, v, equations.meshes, work)
    add_springs(q, v, equations.springs, work.force)
    set_accelerations(v, equations.bodies, work)


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
        evaluate(begin, q, v, equations, work)
        for i in range(size):
            total[i] = a[i]
            out_q[n, i] = a[i]
            x[i] = q[i] + half * v[i]
            u[i] = v[i] + half * a[i]
        evaluate(begin + half, x, u, equations, work)
        for i in range(size):
            total[i] += 2.0 * a[i]
            out_q[n, i] += a[i]
            x[i] = q[i] + half * u[i]
            u[i] = v[i] + half * a[i]
        evaluate(begin + half, x, u, equations, work)
        for i in range(size):
            total[i] += 2.0 * a[i]
            out_q[n, i] += a[i]
            x[i] = q[i] + step * u[i]
            u[i] = v[i] + step * a[i]
        evaluate(begin + step, x, u, equations, work)
        check = 0.0
        for i in range(size):
            q[i] += step * (v[i] + step / 6.0 * out_q[n, i])
            v[i] += step / 6.0 * (total[i] + a[i])
            out_q[n, i], out_v[n, i] = q[i], v[i]
            check += abs(q[i]) + abs(v[i])
        if not math.isfinite(check):
            return n
    steps: int = out_q.shape[0]
    return steps


@kernel
def observe_meshes(q: Floats, v: Floats, meshes: Meshes, work: Work, signals: Floats, energy: Floats) -> None:
    """Fill deflection and F_bt of each mesh into signals (2 m,); add energy and powers (see `observe`)."""
    count = meshes.coordinates.shape[0]
    for m in range(count):
        delta, rate, acting = mesh_motion(q, v, m, meshes, work)
        k, slope = mesh_stiffness(q, m, meshes)
        force = k * delta + meshes.damping[m] * rate
        work.states[m, 0] = force
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
                x, y, z = meshes.force[m, 6 * end], meshes.force[m, 6 * end + 1], meshes.force[m, 6 * end + 2]
                signals[3 * j] += work.states[m, 0] * (c * x - s * y)
                signals[3 * j + 1] += work.states[m, 0] * (s * x + c * y)
                signals[3 * j + 2] += work.states[m, 0] * z
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

    Signals: deflection and F_bt of each mesh, force of each bearing or ideal joint. Energies: kinetic and elastic (J);
    powers (W) of the loads, damped, of k(PMC), non-conservative of meshes and of bearings.
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
        observe_meshes(x, u, meshes, work, signals[n, :two], energy)
        observe_connectors(x, u, equations.bodies, equations.connectors, work, signals[n, two:], energy)
        if equations.joints.host.size > 0:
            observe_joints(u, meshes, equations.joints, work, signals[n, two:])
        for s in range(springs.ends.shape[0]):
            i, j = springs.ends[s, 0], springs.ends[s, 1]
            energy[1] += 0.5 * springs.stiffness[s] * (x[j] - x[i]) ** 2
            energy[3] += springs.damping[s] * (u[j] - u[i]) ** 2
        set_loads(time[n], x, u, equations.loads, work.series, f)
        for i in range(size):
            energy[2] += f[i] * u[i]
