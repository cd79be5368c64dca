"""Equations of motion as one compiled piece that allocates nothing.

Forces of meshes are computed by `exugear.system.tooth_mesh.laws.mesh_forces`; those of flexible bodies, rolling
elements, modal damping, seats that travel and varying loads by functions of `exugear.system.kernels`. Connectors,
springs and the accelerations of rigid bodies are written again here for speed: every sine is taken once per evaluation,
constant entries that are zero are left out, bearing forces are collected per body before they are turned into
generalized ones. Tests compare the accelerations with those of the plain functions. Bodies without a coordinate point
to one that stays zero, so that the loops need no exceptions.

Each place has eight numbers x y z 0 a b spin 0 (see `exugear.system.kernels.coordinates`) and their rates behind, two
vectors of four each, as the processor takes them; forces likewise. Machine code is kept by `fe_ste.tools.compilation`.
"""

from __future__ import annotations

import math

from exugear.system.kernels.coordinates import BODY_SIZE, COSINE, PADDED, PADDED_SPIN, PADDED_TILT, SINE, SPIN, TILT
from exugear.system.kernels.elastic import set_elastic_motion
from exugear.system.kernels.modal_damping import add_modal_damping
from exugear.system.kernels.rolling import CAGE_TORQUE, ELASTIC_PART, RollingArrays, rolling_force
from exugear.system.kernels.turning import place_travelling, set_turning_motion, share_travelling_forces
from exugear.system.kernels.varying_loads import add_varying_loads
from exugear.system.tooth_mesh.laws.mesh_forces import add_meshes
from exugear.transient.compiled.packing import (
    ANGLE,
    COS_A,
    COS_B,
    DAMPED,
    DAMPING,
    FIRST_ARM,
    FIRST_TURNING,
    GAP,
    HALF_ACCELERATION,
    LAG,
    NODES,
    OFF_AXIS,
    OFFSET,
    RELATIVE_AXIS,
    RELATIVE_PLACE,
    RELATIVE_TILT,
    RELATIVE_VELOCITY,
    SECOND_ARM,
    SECOND_TURNING,
    SIN_A,
    SIN_B,
    SPEED,
    STIFFNESS,
    SUPPORT_LOAD,
    W_X,
    W_Y,
    W_Z,
    WRENCH,
    Bodies,
    Connectors,
    Equations,
    Loads,
    Pairs,
    Places,
    Springs,
    Work,
)
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import kernel
from fe_ste.tools.octets import SIZE, all_eight, put

# Where bodies and seats stand in the compiled solver: padded coordinates, sines, axes; and what acts on them there

SMALL_ANGLE = 1.0 / 32.0
"""Below it the first terms of the series below are exact to round-off: the next ones are 1e-17 of them."""


@kernel
def tilt_sines(angle: float) -> tuple[float, float]:
    """Cosine and sine of a tilt, which is small: a quarter of the time of the library's.

    Examples
    --------
    >>> tilt_sines(0.5) == (math.cos(0.5), math.sin(0.5))
    True
    """
    if abs(angle) > SMALL_ANGLE:
        return math.cos(angle), math.sin(angle)
    y = angle * angle
    cosine = 1.0 - y * (1.0 / 2.0 - y * (1.0 / 24.0 - y * (1.0 / 720.0 - y / 40320.0)))
    return cosine, angle * (1.0 - y * (1.0 / 6.0 - y * (1.0 / 120.0 - y / 5040.0)))


@kernel
def tilts_of_axis(x: float, y: float, z: float) -> tuple[float, float]:
    """Two tilts of a body from its unit z axis.

    Examples
    --------
    >>> a, b = tilts_of_axis(math.sin(0.02), -math.sin(0.01) * math.cos(0.02), math.cos(0.01) * math.cos(0.02))
    >>> round(a, 15), round(b, 15)
    (0.01, 0.02)
    """
    if z <= 0.0 or abs(x) > SMALL_ANGLE or abs(y) > SMALL_ANGLE * z:
        return math.atan2(-y, z), math.asin(min(1.0, max(-1.0, x)))
    t = -y / z
    s = x * x
    u = t * t
    a = t * (1.0 - u * (1.0 / 3.0 - u * (1.0 / 5.0 - u * (1.0 / 7.0 - u * (1.0 / 9.0 - u / 11.0)))))
    b = x * (1.0 + s * (1.0 / 6.0 + s * (3.0 / 40.0 + s * (5.0 / 112.0 + s * (35.0 / 1152.0 + s * 63.0 / 2816.0)))))
    return a, b


@kernel
def place_bodies(q: Floats, v: Floats, bodies: Bodies, work: Work) -> None:
    """Take sines, rotation matrices and angular velocities of all bodies, once per evaluation."""
    for n in range(bodies.turning.size):
        angle = q[bodies.turning[n]]
        work.turns[n, COSINE], work.turns[n, SINE] = math.cos(angle), math.sin(angle)
    for n in range(bodies.start.size - 1):
        o = bodies.start[n]
        ca, sa = tilt_sines(q[o + TILT])
        cb, sb = tilt_sines(q[o + TILT + 1])
        cg = work.turns[bodies.slot[n], COSINE]
        sg = work.turns[bodies.slot[n], SINE]
        frame = work.frames[n]
        # Rx(a) Ry(b) Rz(spin), row by row; then the angular velocity in global axes.
        frame[0], frame[1], frame[2] = cb * cg, -cb * sg, sb
        frame[3], frame[4], frame[5] = ca * sg + sa * sb * cg, ca * cg - sa * sb * sg, -sa * cb
        frame[6], frame[7], frame[8] = sa * sg - ca * sb * cg, sa * cg + ca * sb * sg, ca * cb
        da = v[o + TILT]
        db = v[o + TILT + 1]
        dg = v[o + SPIN]
        frame[W_X], frame[W_Y], frame[W_Z] = da + sb * dg, ca * db - sa * cb * dg, sa * db + ca * cb * dg
        frame[SIN_A], frame[COS_A], frame[SIN_B], frame[COS_B] = sa, ca, sb, cb


@kernel
def gather_places(q: Floats, v: Floats, places: Places, work: Work) -> None:
    """Fill `work.places` from the state; nothing acts there yet."""
    for n in range(places.start.size):
        place = work.places[n]
        load = work.loads[n]
        o = places.start[n]
        for i in range(3):
            place[i], place[PADDED_TILT + i] = q[o + i], q[o + TILT + i]
            place[PADDED + i], place[PADDED + PADDED_TILT + i] = v[o + i], v[o + TILT + i]
        put(load, 0, all_eight(0.0))
        put(load, SIZE, all_eight(0.0))
    # Bodies with their spin alone stay where they are.
    for n in range(places.spin.size):
        place = work.places[places.start.size + n]
        load = work.loads[places.start.size + n]
        o = places.spin[n]
        place[PADDED_SPIN], place[PADDED + PADDED_SPIN] = q[o], v[o]
        load[PADDED_SPIN] = 0.0


@kernel
def add_loads_of_places(bodies: Bodies, places: Places, work: Work) -> None:
    """Add what acts on all places to the generalized forces `work.force`."""
    f = work.force
    for n in range(places.start.size):
        load = work.loads[n]
        o = places.start[n]
        for i in range(3):
            f[o + i] += load[i]
            f[o + TILT + i] += load[PADDED_TILT + i]
    for n in range(bodies.start.size - 1):
        load = work.loads[n]
        o = bodies.start[n]
        frame = work.frames[n]
        sa = frame[SIN_A]
        ca = frame[COS_A]
        sb = frame[SIN_B]
        cb = frame[COS_B]
        x = load[WRENCH + PADDED_TILT]
        y = load[WRENCH + PADDED_TILT + 1]
        z = load[WRENCH + PADDED_TILT + 2]
        for i in range(3):
            f[o + i] += load[WRENCH + i]
        # Moments about the axes that the three angles turn about: x, the tilted y, the body's z.
        f[o + TILT] += x
        f[o + TILT + 1] += ca * y + sa * z
        f[o + SPIN] += sb * x - sa * cb * y + ca * cb * z
    for n in range(places.spin.size):
        f[places.spin[n]] += work.loads[places.start.size + n, PADDED_SPIN]


# Forces of bearings in the compiled solver, by pairs of bodies


@kernel
def turn_between(values: Floats, n: int, bodies: Bodies, connectors: Connectors) -> float:
    """Spin of the second body of connector n less that of the first (rad), or their rates; the ground's stays zero."""
    first = bodies.start[connectors.ends[n, 0]]
    second = bodies.start[connectors.ends[n, 1]]
    return float(values[second + SPIN] - values[first + SPIN])


@kernel
def place_pair(p: int, places: Floats, pairs: Pairs, ground: int, work: Work) -> None:
    """Fill `work.relative` with the second body's motion against the first, in the first one's axes."""
    i = pairs.ends[p, 0]
    j = pairs.ends[p, 1]
    out = work.relative
    place = places[j]
    frame = work.frames[j]
    # On the ground the first body's axes are the global ones: nothing has to be turned.
    if i == ground:
        for k in range(3):
            out[RELATIVE_PLACE + k], out[RELATIVE_VELOCITY + k] = place[k], place[PADDED + k]
            out[RELATIVE_AXIS + k], out[FIRST_TURNING + k] = frame[2 + 3 * k], 0.0
            out[SECOND_TURNING + k] = frame[W_X + k]
        out[RELATIVE_TILT], out[RELATIVE_TILT + 1] = place[PADDED_TILT], place[PADDED_TILT + 1]
        out[RELATIVE_TILT + 2] = 0.0
        return
    first = places[i]
    turn = work.frames[i]
    nodes = pairs.data[pairs.first[p]]
    x = place[0] - first[0] + nodes[NODES]
    y = place[1] - first[1] + nodes[NODES + 1]
    z = place[2] - first[2] + nodes[NODES + 2]
    ux = place[PADDED] - first[PADDED]
    uy = place[PADDED + 1] - first[PADDED + 1]
    uz = place[PADDED + 2] - first[PADDED + 2]
    for k in range(3):
        r = turn[k]
        s = turn[3 + k]
        t = turn[6 + k]
        out[RELATIVE_PLACE + k] = r * x + s * y + t * z
        out[RELATIVE_VELOCITY + k] = r * ux + s * uy + t * uz
        out[RELATIVE_AXIS + k] = r * frame[2] + s * frame[5] + t * frame[8]
        out[FIRST_TURNING + k] = r * turn[W_X] + s * turn[W_Y] + t * turn[W_Z]
        out[SECOND_TURNING + k] = r * frame[W_X] + s * frame[W_Y] + t * frame[W_Z]
    # Tilts from the second body's z axis as the first body sees it.
    out[RELATIVE_TILT], out[RELATIVE_TILT + 1] = tilts_of_axis(
        out[RELATIVE_AXIS], out[RELATIVE_AXIS + 1], out[RELATIVE_AXIS + 2]
    )
    out[RELATIVE_TILT + 2] = 0.0


@kernel
def twist_of(i: int, j: int, work: Work) -> float:
    """Angle about z of body j seen from body i (rad): it costs an arc tangent, and bearings rarely resist it."""
    first = work.frames[i]
    second = work.frames[j]
    cosine = first[0] * second[0] + first[3] * second[3] + first[6] * second[6]
    sine = first[0] * second[1] + first[3] * second[4] + first[6] * second[7]
    return math.atan2(-sine, cosine)


@kernel
def second_arm(i: int, j: int, one: Floats, work: Work) -> tuple[float, float, float]:
    """Attachment in the second body j of a connector seen in the axes of the first, i (m)."""
    x = one[SECOND_ARM]
    y = one[SECOND_ARM + 1]
    z = one[SECOND_ARM + 2]
    if one[OFF_AXIS] == 0.0:
        axis = work.relative
        return axis[RELATIVE_AXIS] * z, axis[RELATIVE_AXIS + 1] * z, axis[RELATIVE_AXIS + 2] * z
    turn = work.frames[j]
    first = work.frames[i]
    gx = turn[0] * x + turn[1] * y + turn[2] * z
    gy = turn[3] * x + turn[4] * y + turn[5] * z
    gz = turn[6] * x + turn[7] * y + turn[8] * z
    return (
        first[0] * gx + first[3] * gy + first[6] * gz,
        first[1] * gx + first[4] * gy + first[7] * gz,
        first[2] * gx + first[5] * gy + first[8] * gz,
    )


@kernel
def strain_connector(
    one: Floats, on_ground: bool, bx: float, by: float, bz: float, motion: Floats, support: Floats
) -> None:
    """Fill strain and rate of a connector from the motion of its pair.

    As Exudyn's RigidBodySpringDamper: second attachment (at b from its node) against the first in the first body's
    axes, the rate not corrected for the turning of these axes.
    """
    ax = one[FIRST_ARM]
    ay = one[FIRST_ARM + 1]
    az = one[FIRST_ARM + 2]
    x = motion[RELATIVE_PLACE]
    y = motion[RELATIVE_PLACE + 1]
    z = motion[RELATIVE_PLACE + 2]
    if on_ground:  # where nothing turns, small differences come before large places
        x += one[GAP] + (bx - one[SECOND_ARM])
        y += one[GAP + 1] + (by - one[SECOND_ARM + 1])
        z += one[GAP + 2] + (bz - one[SECOND_ARM + 2])
    else:
        x = x + bx - ax
        y = y + by - ay
        z = z + bz - az
    ox = motion[FIRST_TURNING]
    oy = motion[FIRST_TURNING + 1]
    oz = motion[FIRST_TURNING + 2]
    wx = motion[SECOND_TURNING]
    wy = motion[SECOND_TURNING + 1]
    wz = motion[SECOND_TURNING + 2]
    support[0], support[1], support[2] = x, y, z
    support[BODY_SIZE] = motion[RELATIVE_VELOCITY] + (wy * bz - wz * by) - (oy * az - oz * ay)
    support[BODY_SIZE + 1] = motion[RELATIVE_VELOCITY + 1] + (wz * bx - wx * bz) - (oz * ax - ox * az)
    support[BODY_SIZE + 2] = motion[RELATIVE_VELOCITY + 2] + (wx * by - wy * bx) - (ox * ay - oy * ax)
    for k in range(3):
        support[TILT + k] = motion[RELATIVE_TILT + k]
    support[BODY_SIZE + TILT], support[BODY_SIZE + TILT + 1] = wx - ox, wy - oy
    support[BODY_SIZE + SPIN] = wz - oz


@kernel
def load_connector(n: int, one: Floats, damping: Floats, support: Floats) -> None:
    """Fill force and moment of connector n on its first body from strain and rate."""
    # Two vectors of four sums in registers.
    x = one[OFFSET]
    y = one[OFFSET + 1]
    z = one[OFFSET + 2]
    _x = one[OFFSET + 3]
    a = one[OFFSET + 4]
    b = one[OFFSET + 5]
    c = one[OFFSET + 6]
    _a = one[OFFSET + 7]
    time = one[LAG]
    for column in range(BODY_SIZE):
        # Damping in proportion to the stiffness acts as a strain that is ahead of itself.
        ahead = support[column] + time * support[BODY_SIZE + column]
        o = PADDED * column
        x += one[o] * ahead
        y += one[o + 1] * ahead
        z += one[o + 2] * ahead
        _x += one[o + 3] * ahead
        a += one[o + 4] * ahead
        b += one[o + 5] * ahead
        c += one[o + 6] * ahead
        _a += one[o + 7] * ahead
    support[SUPPORT_LOAD], support[SUPPORT_LOAD + 1], support[SUPPORT_LOAD + 2] = x, y, z
    support[SUPPORT_LOAD + 3], support[SUPPORT_LOAD + 4], support[SUPPORT_LOAD + 5] = a, b, c
    if one[DAMPED] == 1.0:
        for column in range(BODY_SIZE):
            for row in range(BODY_SIZE):
                support[SUPPORT_LOAD + row] += damping[n, column, row] * support[BODY_SIZE + column]


@kernel
def add_rolling(
    q: Floats,
    n: int,
    bodies: Bodies,
    connectors: Connectors,
    rolling: RollingArrays | None,
    support: Floats,
    work: Work,
) -> None:
    """Add the rolling law of connector n, if it has one, to its force, its cage's torque to the spins."""
    if rolling is None:
        return
    if rolling.first[n] == rolling.first[n + 1]:
        return
    turn = turn_between(q, n, bodies, connectors)
    rolling_force(n, support[:BODY_SIZE], support[BODY_SIZE:SUPPORT_LOAD], turn, rolling, work.rolling)
    for i in range(BODY_SIZE):
        support[SUPPORT_LOAD + i] += work.rolling[ELASTIC_PART + i]
    ground = bodies.start.size - 1
    first = connectors.ends[n, 0]
    second = connectors.ends[n, 1]
    if first != ground:
        work.force[bodies.start[first] + SPIN] += work.rolling[CAGE_TORQUE]
    if second != ground:
        work.force[bodies.start[second] + SPIN] -= work.rolling[CAGE_TORQUE]


@kernel
def hand_to_body(frame: Floats, turned: bool, sign: float, sums: Floats, moment: Floats, load: Floats) -> None:
    """Add the force at the head of sums and a moment, both in a body's axes, to a load in global axes."""
    x = sign * sums[0]
    y = sign * sums[1]
    z = sign * sums[2]
    a = sign * moment[0]
    b = sign * moment[1]
    c = sign * moment[2]
    if turned:
        x, y, z = (
            frame[0] * x + frame[1] * y + frame[2] * z,
            frame[3] * x + frame[4] * y + frame[5] * z,
            frame[6] * x + frame[7] * y + frame[8] * z,
        )
        a, b, c = (
            frame[0] * a + frame[1] * b + frame[2] * c,
            frame[3] * a + frame[4] * b + frame[5] * c,
            frame[6] * a + frame[7] * b + frame[8] * c,
        )
    load[WRENCH] += x
    load[WRENCH + 1] += y
    load[WRENCH + 2] += z
    load[WRENCH + PADDED_TILT] += a
    load[WRENCH + PADDED_TILT + 1] += b
    load[WRENCH + PADDED_TILT + 2] += c


@kernel
def add_connectors(q: Floats, bodies: Bodies, connectors: Connectors, pairs: Pairs, work: Work) -> None:
    """Add the forces of all connectors to `work.loads`, pair of bodies by pair; fill `work.supports`.

    The motion of both bodies is transformed into the first one's axes once for all connectors between them, and their
    forces are transformed back once.
    """
    ground = bodies.start.size - 1
    sums = work.sums
    for p in range(pairs.ends.shape[0]):
        i = pairs.ends[p, 0]
        j = pairs.ends[p, 1]
        place_pair(p, work.places, pairs, ground, work)
        if pairs.twisting[p] == 1:
            work.relative[RELATIVE_TILT + 2] = twist_of(i, j, work)
        for k in range(9):
            sums[k] = 0.0
        for n in range(pairs.first[p], pairs.first[p + 1]):
            one = pairs.data[n]
            support = work.supports[n]
            bx, by, bz = second_arm(i, j, one, work)
            strain_connector(one, i == ground, bx, by, bz, work.relative, support)
            load_connector(n, one, connectors.damping, support)
            add_rolling(q, n, bodies, connectors, connectors.rolling, support, work)
            fx = support[SUPPORT_LOAD]
            fy = support[SUPPORT_LOAD + 1]
            fz = support[SUPPORT_LOAD + 2]
            ax = one[FIRST_ARM]
            ay = one[FIRST_ARM + 1]
            az = one[FIRST_ARM + 2]
            mx = support[SUPPORT_LOAD + 3]
            my = support[SUPPORT_LOAD + 4]
            mz = support[SUPPORT_LOAD + 5]
            sums[0] += fx
            sums[1] += fy
            sums[2] += fz
            # Moments about both nodes.
            sums[3] += mx + (ay * fz - az * fy)
            sums[4] += my + (az * fx - ax * fz)
            sums[5] += mz + (ax * fy - ay * fx)
            sums[6] += mx + (by * fz - bz * fy)
            sums[7] += my + (bz * fx - bx * fz)
            sums[8] += mz + (bx * fy - by * fx)
        turned = i != ground
        if turned:
            hand_to_body(work.frames[i], turned, 1.0, sums, sums[3:6], work.loads[i])
        hand_to_body(work.frames[i], turned, -1.0, sums, sums[6:9], work.loads[j])


# Equations of motion as one compiled piece that allocates nothing


@kernel
def add_springs(q: Floats, v: Floats, springs: Springs, f: Floats) -> None:
    """Add the torques of the torsional springs to f."""
    for n in range(springs.ends.shape[0]):
        i = springs.ends[n, 0]
        j = springs.ends[n, 1]
        torque = springs.stiffness[n] * (q[j] - q[i]) + springs.damping[n] * (v[j] - v[i])
        f[i] += torque
        f[j] -= torque


@kernel
def set_loads(t: float, q: Floats, v: Floats, loads: Loads, series: Integers, f: Floats) -> None:
    """Set f to what acts from outside at time t (s)."""
    for i in range(loads.steady.size):
        f[i] = loads.steady[i]
    for n in range(loads.coordinate.size):
        first = loads.first[n]
        last = loads.first[n + 1] - 1
        # Time mostly goes on: look from the line that was used last.
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
        i = loads.drive[n]
        law = loads.law[n]
        angle = law[ANGLE] + t * (law[SPEED] + t * law[HALF_ACCELERATION])
        speed = law[SPEED] + 2.0 * t * law[HALF_ACCELERATION]
        f[i] += law[STIFFNESS] * (angle - q[i]) + law[DAMPING] * (speed - v[i])
    add_varying_loads(q, v, loads.varying, f)


@kernel
def set_accelerations(v: Floats, bodies: Bodies, work: Work) -> None:
    """Solve the equations of motion of the bodies for the accelerations `work.rate` under the forces `work.force`.

    Lagrange's equations of an axially symmetric body in Rxyz coordinates, with p = J_a (spin' + a' sin b), the angular
    momentum about its axis:

        J_t cos^2 b a'' = Q_a - Q_spin sin b - p b' cos b + 2 J_t a' b' sin b cos b
        J_t b'' = Q_b - J_t a'^2 sin b cos b + p a' cos b,   spin'' = Q_spin / J_a - a'' sin b - a' b' cos b
    """
    f = work.force
    out = work.rate
    for n in range(bodies.mass.size):
        o = bodies.start[n]
        jt = bodies.transverse[n]
        ja = bodies.axial[n]
        sb = work.frames[n, SIN_B]
        cb = work.frames[n, COS_B]
        per_mass = bodies.shares[n, 0]
        per_jt = bodies.shares[n, 1]
        per_ja = bodies.shares[n, 2]
        for i in range(3):
            out[o + i] = f[o + i] * per_mass
        a = o + TILT
        b = o + TILT + 1
        spin = o + SPIN
        da = v[a]
        db = v[b]
        p = ja * (v[spin] + da * sb)  # angular momentum about the body's axis
        out[a] = (f[a] - f[spin] * sb - p * db * cb + 2.0 * jt * da * db * sb * cb) * (per_jt / (cb * cb))
        out[b] = (f[b] - jt * da * da * sb * cb + p * da * cb) * per_jt
        out[spin] = f[spin] * per_ja - out[a] * sb - da * db * cb
    for n in range(bodies.spin.size):
        out[bodies.spin[n]] = f[bodies.spin[n]] / bodies.spin_inertia[n]
    # Gears that only roll share their inertia: one dense product instead of the above.
    for n in range(bodies.inverse.shape[0]):
        out[bodies.spin[n]] = 0.0
        for m in range(bodies.inverse.shape[1]):
            out[bodies.spin[n]] += bodies.inverse[n, m] * f[bodies.spin[m]]


@kernel
def evaluate(t: float, q: Floats, v: Floats, with_power: bool, equations: Equations, work: Work) -> None:
    """Fill `work.rate` with the accelerations at time t (s) and state q, v (e,).

    States of bodies, meshes and connectors are stored in `work.frames`, `work.mesh.states` and `work.supports`; power
    dissipated by flexible bodies in `work.damped` if the power is requested.
    """
    bodies = equations.bodies
    places = equations.places
    force = work.force
    place_bodies(q, v, bodies, work)
    place_travelling(q, v, equations.travelling, work.shares)
    gather_places(q, v, places, work)
    set_loads(t, q, v, equations.loads, work.series, force)
    add_connectors(q, bodies, equations.connectors, equations.pairs, work)
    add_meshes(q, v, equations.meshes, work)
    add_springs(q, v, equations.springs, force)
    add_loads_of_places(bodies, places, work)
    share_travelling_forces(equations.travelling, work.shares, force)
    work.damped[2] = add_modal_damping(q, v, equations.modal, work.modal, force)
    set_accelerations(v, bodies, work)
    work.damped[0] = set_elastic_motion(q, v, force, with_power, equations.elastic, work.scratch, work.rate)
    work.damped[1] = set_turning_motion(q, v, force, with_power, equations.turning, work.memory, work.rate)
