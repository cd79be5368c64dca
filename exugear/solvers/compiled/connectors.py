"""Forces of bearings in the compiled solver, collected per body."""

from __future__ import annotations

import math

from exugear.kernels.coordinates import BODY_SIZE, SPIN, TILT
from exugear.kernels.rolling import CAGE_TORQUE, ELASTIC_PART, rolling_force
from exugear.solvers.compiled.arrays import (
    COS_A,
    COS_B,
    COSINE,
    LOCAL_FORCE,
    SIN_A,
    SIN_B,
    SINE,
    STRAIN,
    STRAIN_RATE,
    W_X,
    W_Y,
    W_Z,
    Bodies,
    Connectors,
    Work,
)
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel


@kernel
def place_bodies(q: Floats, v: Floats, bodies: Bodies, work: Work) -> None:
    """Take sines, rotation matrices and angular velocities of all bodies, once per evaluation."""
    for n in range(bodies.turning.size):
        angle = q[bodies.turning[n]]
        work.turns[n, COSINE], work.turns[n, SINE] = math.cos(angle), math.sin(angle)
    for n in range(bodies.start.size - 1):
        o = bodies.start[n]
        a, b = q[o + TILT], q[o + TILT + 1]
        ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
        cg, sg = work.turns[bodies.slot[n], COSINE], work.turns[bodies.slot[n], SINE]
        frame = work.frames[n]
        # Rx(a) Ry(b) Rz(spin), row by row; then the angular velocity in global axes.
        frame[0], frame[1], frame[2] = cb * cg, -cb * sg, sb
        frame[3], frame[4], frame[5] = ca * sg + sa * sb * cg, ca * cg - sa * sb * sg, -sa * cb
        frame[6], frame[7], frame[8] = sa * sg - ca * sb * cg, sa * cg + ca * sb * sg, ca * cb
        da, db, dg = v[o + TILT], v[o + TILT + 1], v[o + SPIN]
        frame[W_X], frame[W_Y], frame[W_Z] = da + sb * dg, ca * db - sa * cb * dg, sa * db + ca * cb * dg
        frame[SIN_A], frame[COS_A], frame[SIN_B], frame[COS_B] = sa, ca, sb, cb


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
    frame_1, frame_2 = work.frames[i], work.frames[j]
    # Second attachment: its arm turned into global axes, its place and velocity there.
    x, y, z = connectors.local[n, 1]
    bx = frame_2[0] * x + frame_2[1] * y + frame_2[2] * z
    by = frame_2[3] * x + frame_2[4] * y + frame_2[5] * z
    bz = frame_2[6] * x + frame_2[7] * y + frame_2[8] * z
    wx, wy, wz = frame_2[W_X], frame_2[W_Y], frame_2[W_Z]
    dx = connectors.gap[n, 0] + q[p] + (bx - x)
    dy = connectors.gap[n, 1] + q[p + 1] + (by - y)
    dz = connectors.gap[n, 2] + q[p + 2] + (bz - z)
    ux = v[p] + (wy * bz - wz * by)
    uy = v[p + 1] + (wz * bx - wx * bz)
    uz = v[p + 2] + (wx * by - wy * bx)
    ax, ay, az = connectors.local[n, 0]
    strain, rate = work.motion[STRAIN], work.motion[STRAIN_RATE]
    # On the ground the first body's axes are the global ones: nothing has to be turned.
    if i == bodies.start.size - 1:
        strain[0], strain[1], strain[2] = dx, dy, dz
        rate[0], rate[1], rate[2] = ux, uy, uz
        if connectors.repeated[n] == 1:
            return ax, ay, az, bx, by, bz
        rate[TILT], rate[TILT + 1], rate[SPIN] = wx, wy, wz
        strain[TILT], strain[TILT + 1] = q[p + TILT], q[p + TILT + 1]
    else:
        # First attachment likewise; the difference of both is then seen in the first body's axes.
        x, y, z = ax, ay, az
        ax = frame_1[0] * x + frame_1[1] * y + frame_1[2] * z
        ay = frame_1[3] * x + frame_1[4] * y + frame_1[5] * z
        az = frame_1[6] * x + frame_1[7] * y + frame_1[8] * z
        ox, oy, oz = frame_1[W_X], frame_1[W_Y], frame_1[W_Z]
        dx += (x - ax) - q[o]
        dy += (y - ay) - q[o + 1]
        dz += (z - az) - q[o + 2]
        ux -= v[o] + (oy * az - oz * ay)
        uy -= v[o + 1] + (oz * ax - ox * az)
        uz -= v[o + 2] + (ox * ay - oy * ax)
        for k in range(3):
            strain[k] = frame_1[k] * dx + frame_1[3 + k] * dy + frame_1[6 + k] * dz
            rate[k] = frame_1[k] * ux + frame_1[3 + k] * uy + frame_1[6 + k] * uz
        if connectors.repeated[n] == 1:
            return ax, ay, az, bx, by, bz
        wx, wy, wz = wx - ox, wy - oy, wz - oz
        for k in range(3):
            rate[TILT + k] = frame_1[k] * wx + frame_1[3 + k] * wy + frame_1[6 + k] * wz
        # Tilts from the second body's z axis as the first body sees it.
        axis_x = frame_1[0] * frame_2[2] + frame_1[3] * frame_2[5] + frame_1[6] * frame_2[8]
        axis_y = frame_1[1] * frame_2[2] + frame_1[4] * frame_2[5] + frame_1[7] * frame_2[8]
        axis_z = frame_1[2] * frame_2[2] + frame_1[5] * frame_2[5] + frame_1[8] * frame_2[8]
        strain[TILT] = math.atan2(-axis_y, axis_z)
        strain[TILT + 1] = math.asin(min(1.0, max(-1.0, axis_x)))
    # The angle about z costs an arc tangent, and bearings rarely resist it.
    strain[SPIN] = 0.0
    if connectors.twisting[n] == 1:
        cosine = frame_1[0] * frame_2[0] + frame_1[3] * frame_2[3] + frame_1[6] * frame_2[6]
        sine = frame_1[0] * frame_2[1] + frame_1[3] * frame_2[4] + frame_1[6] * frame_2[7]
        strain[SPIN] = math.atan2(-sine, cosine)
    return ax, ay, az, bx, by, bz


@kernel
def turn_between(values: Floats, n: int, bodies: Bodies, connectors: Connectors) -> float:
    """Spin of the second body of connector n less that of the first (rad), or their rates; the ground's stays zero."""
    first, second = bodies.start[connectors.ends[n, 0]], bodies.start[connectors.ends[n, 1]]
    return float(values[second + SPIN] - values[first + SPIN])


@kernel
def add_rolling(q: Floats, n: int, bodies: Bodies, connectors: Connectors, work: Work) -> None:
    """Add the rolling law of connector n to its force in `work.motion`, its cage's torque to the spins."""
    turn = turn_between(q, n, bodies, connectors)
    rolling_force(n, work.motion[STRAIN], work.motion[STRAIN_RATE], turn, connectors.rolling, work.rolling)
    for i in range(BODY_SIZE):
        work.motion[LOCAL_FORCE, i] += work.rolling[ELASTIC_PART + i]
    ground = bodies.start.size - 1
    first, second = connectors.ends[n, 0], connectors.ends[n, 1]
    if first != ground:
        work.force[bodies.start[first] + SPIN] += work.rolling[CAGE_TORQUE]
    if second != ground:
        work.force[bodies.start[second] + SPIN] -= work.rolling[CAGE_TORQUE]


@kernel
def connector_force(n: int, connectors: Connectors, work: Work) -> None:
    """Fill the force of connector n on its first body, in that body's axes, into `work.motion`."""
    strain, rate, force = work.motion[STRAIN], work.motion[STRAIN_RATE], work.motion[LOCAL_FORCE]
    stiffness, time = connectors.stiffness[n], connectors.time[n]
    x, y, z, a, b, c = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0  # sums in registers: half the time of sums in memory
    for column in range(BODY_SIZE):
        # Damping in proportion to the stiffness acts as a strain that is ahead of itself.
        ahead = strain[column] + time * rate[column]
        x += stiffness[column, 0] * ahead
        y += stiffness[column, 1] * ahead
        z += stiffness[column, 2] * ahead
        a += stiffness[column, 3] * ahead
        b += stiffness[column, 4] * ahead
        c += stiffness[column, 5] * ahead
    force[0], force[1], force[2], force[3], force[4], force[5] = x, y, z, a, b, c
    if connectors.damped[n] == 1:
        for column in range(BODY_SIZE):
            for row in range(BODY_SIZE):
                force[row] += connectors.damping[n, column, row] * rate[column]


@kernel
def add_connectors(q: Floats, v: Floats, bodies: Bodies, connectors: Connectors, work: Work) -> None:
    """Collect the forces of all connectors per body in `work.wrench`, then add them to `work.force`."""
    work.wrench[:] = 0.0
    for n in range(connectors.ends.shape[0]):
        ax, ay, az, bx, by, bz = move_connector(q, v, n, bodies, connectors, work)
        connector_force(n, connectors, work)
        if connectors.rolling.first[n] < connectors.rolling.first[n + 1]:
            add_rolling(q, n, bodies, connectors, work)
        i, j = connectors.ends[n, 0], connectors.ends[n, 1]
        # From the first body's axes to global ones, then to both bodies with their arms.
        force, turn = work.motion[LOCAL_FORCE], work.frames[i]
        fx = turn[0] * force[0] + turn[1] * force[1] + turn[2] * force[2]
        fy = turn[3] * force[0] + turn[4] * force[1] + turn[5] * force[2]
        fz = turn[6] * force[0] + turn[7] * force[1] + turn[8] * force[2]
        mx = turn[0] * force[3] + turn[1] * force[4] + turn[2] * force[5]
        my = turn[3] * force[3] + turn[4] * force[4] + turn[5] * force[5]
        mz = turn[6] * force[3] + turn[7] * force[4] + turn[8] * force[5]
        wrench_1, wrench_2 = work.wrench[i], work.wrench[j]
        wrench_1[0] += fx
        wrench_1[1] += fy
        wrench_1[2] += fz
        wrench_1[3] += mx + (ay * fz - az * fy)
        wrench_1[4] += my + (az * fx - ax * fz)
        wrench_1[5] += mz + (ax * fy - ay * fx)
        wrench_2[0] -= fx
        wrench_2[1] -= fy
        wrench_2[2] -= fz
        wrench_2[3] -= mx + (by * fz - bz * fy)
        wrench_2[4] -= my + (bz * fx - bx * fz)
        wrench_2[5] -= mz + (bx * fy - by * fx)
    f = work.force
    for n in range(bodies.start.size - 1):
        o, load, frame = bodies.start[n], work.wrench[n], work.frames[n]
        sa, ca, sb, cb = frame[SIN_A], frame[COS_A], frame[SIN_B], frame[COS_B]
        # Moments about the axes that the three angles turn about: x, the tilted y, the body's z.
        f[o] += load[0]
        f[o + 1] += load[1]
        f[o + 2] += load[2]
        f[o + TILT] += load[3]
        f[o + TILT + 1] += ca * load[4] + sa * load[5]
        f[o + SPIN] += sb * load[3] - sa * cb * load[4] + ca * cb * load[5]
