"""Forces of bearings in the compiled solver, collected per body."""

from __future__ import annotations

import math

from exugear.solvers.compiled.arrays import Bodies, Connectors, Work
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel


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
