"""The law of connectors by plain loops over one connector after the other: what the law of all at once is held against.

Also with the rate by which the displacement of a connector truly changes, which the law itself has no use for.
"""

from __future__ import annotations

import math

import numpy as np

from exugear.system.kernels.connectors import ConnectorArrays
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN, TILT
from exugear.system.kernels.rolling import (
    CAGE_TORQUE,
    CONTACT_SIZE,
    COUNT,
    ELASTIC_PART,
    TOUCHING,
    RollingArrays,
    rolling_force,
)
from fe_ste.tools.compilation import compiled

Floats = np.ndarray
ARM, POSITION, VELOCITY, ANGULAR_VELOCITY = range(4)
"""Rows of `body_point`."""
DISPLACEMENT, RATE, TRUE_RATE = range(3)
"""Rows of `connector_motion`."""


@compiled
def memory_for(rolling: RollingArrays) -> Floats:
    """Memory for `exugear.system.kernels.rolling.rolling_forces`."""
    most = 0
    for r in range(rolling.layout.shape[0]):
        most = max(most, rolling.layout[r, COUNT])
    return np.zeros(TOUCHING + CONTACT_SIZE * most)


@compiled
def rotation(a: float, b: float, spin: float, out: Floats) -> None:
    """Rotation matrix Rx(a) Ry(b) Rz(spin), (3, 3)."""
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    cg, sg = math.cos(spin), math.sin(spin)
    out[0, 0], out[0, 1], out[0, 2] = cb * cg, -cb * sg, sb
    out[1, 0], out[1, 1], out[1, 2] = ca * sg + sa * sb * cg, ca * cg - sa * sb * sg, -sa * cb
    out[2, 0], out[2, 1], out[2, 2] = sa * sg - ca * sb * cg, sa * cg + ca * sb * sg, ca * cb


@compiled
def body_point(q: Floats, v: Floats, start: int, node: Floats, local: Floats, turn: Floats, out: Floats) -> None:
    """Move a body-fixed point: turn (3, 3); out (4, 3) = arm, position, velocity, angular velocity."""
    if start < 0:
        turn[:] = 0.0
        out[:] = 0.0
        for i in range(3):
            turn[i, i] = 1.0
            out[ARM, i] = local[i]
            out[POSITION, i] = node[i] + local[i]
        return
    a, b = q[start + TILT], q[start + TILT + 1]
    rotation(a, b, q[start + SPIN], turn)
    da, db, dg = v[start + TILT], v[start + TILT + 1], v[start + SPIN]
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    # Angular velocity in global axes: each angle's rate about the axis that it turns about.
    wx, wy, wz = da + sb * dg, ca * db - sa * cb * dg, sa * db + ca * cb * dg
    for i in range(3):
        out[ARM, i] = turn[i, 0] * local[0] + turn[i, 1] * local[1] + turn[i, 2] * local[2]
        out[POSITION, i] = node[i] + q[start + i] + out[ARM, i]
    # Velocity of the point: that of the node and omega x r.
    r = out[ARM]
    out[VELOCITY, 0] = v[start] + wy * r[2] - wz * r[1]
    out[VELOCITY, 1] = v[start + 1] + wz * r[0] - wx * r[2]
    out[VELOCITY, 2] = v[start + 2] + wx * r[1] - wy * r[0]
    out[ANGULAR_VELOCITY, 0], out[ANGULAR_VELOCITY, 1], out[ANGULAR_VELOCITY, 2] = wx, wy, wz


@compiled
def connector_motion(
    q: Floats, v: Floats, n: int, connectors: ConnectorArrays, turn: Floats, arms: Floats, out: Floats
) -> None:
    """Fill displacement, rate and change of displacement (3, 6) of connector n, its axes and the arms (2, 3).

    As Exudyn's RigidBodySpringDamper: the second attachment against the first in the first body's axes; the
    rate is not corrected for the turning of those axes. The third row is the true time derivative of the
    displacement, which the rate differs from in turning axes and for spinning, tilted bodies.
    """
    turn1 = np.empty((3, 3))
    point0, point1 = np.empty((4, 3)), np.empty((4, 3))
    index, node, local = connectors.bodies[n], connectors.node[n], connectors.local[n]
    body_point(q, v, index[0], node[0], local[0], turn, point0)
    body_point(q, v, index[1], node[1], local[1], turn1, point1)
    # Everything of the second body against the first, seen in the first body's axes.
    relative = np.zeros((3, 3))
    out[:] = 0.0
    for i in range(3):
        arms[0, i], arms[1, i] = point0[ARM, i], point1[ARM, i]
        for j in range(3):
            out[DISPLACEMENT, i] += turn[j, i] * (point1[POSITION, j] - point0[POSITION, j])
            out[RATE, i] += turn[j, i] * (point1[VELOCITY, j] - point0[VELOCITY, j])
            out[RATE, TILT + i] += turn[j, i] * (point1[ANGULAR_VELOCITY, j] - point0[ANGULAR_VELOCITY, j])
            for k in range(3):
                relative[i, j] += turn[k, i] * turn1[k, j]
    # Rxyz angles of the relative rotation; the sine is clipped, since round-off may carry it past 1.
    out[DISPLACEMENT, TILT] = math.atan2(-relative[1, 2], relative[2, 2])
    out[DISPLACEMENT, TILT + 1] = math.asin(min(1.0, max(-1.0, relative[0, 2])))
    out[DISPLACEMENT, SPIN] = math.atan2(-relative[0, 1], relative[0, 0])
    # True derivative of the displacement: less what the turning of the axes themselves does to it.
    spinning = np.zeros(3)
    for i in range(3):
        for j in range(3):
            spinning[i] += turn[j, i] * point0[ANGULAR_VELOCITY, j]
    d, w = out[DISPLACEMENT], out[RATE]
    out[TRUE_RATE, 0] = w[0] - spinning[1] * d[2] + spinning[2] * d[1]
    out[TRUE_RATE, 1] = w[1] - spinning[2] * d[0] + spinning[0] * d[2]
    out[TRUE_RATE, 2] = w[2] - spinning[0] * d[1] + spinning[1] * d[0]
    # Rates of the three angles from the angular velocity, by inverting the relation in `body_point`.
    a, b = d[TILT], d[TILT + 1]
    across = math.cos(a) * w[SPIN] - math.sin(a) * w[TILT + 1]
    out[TRUE_RATE, SPIN] = across / math.cos(b)
    out[TRUE_RATE, TILT + 1] = math.cos(a) * w[TILT + 1] + math.sin(a) * w[SPIN]
    out[TRUE_RATE, TILT] = w[TILT] - math.sin(b) * out[TRUE_RATE, SPIN]


@compiled
def turn_between(q: Floats, n: int, connectors: ConnectorArrays) -> float:
    """Spin of the second body less that of the first, rad, unwrapped; the ground has none."""
    first, second = connectors.bodies[n]
    turn = 0.0
    if second >= 0:
        turn += q[second + SPIN]
    if first >= 0:
        turn -= q[first + SPIN]
    return turn


@compiled
def connector_load(q: Floats, v: Floats, n: int, connectors: ConnectorArrays, arms: Floats, out: Floats) -> float:
    """Fill force and moment (6,) that connector n takes from its second body, global axes; arms (2, 3).

    Returns the torque of a turning cage: the generalized force that it takes from the second body's spin and gives to
    that of the first, N m.
    """
    turn, motion = np.empty((3, 3)), np.empty((3, BODY_SIZE))
    connector_motion(q, v, n, connectors, turn, arms, motion)
    # Force and moment in the first body's axes, then turned into global ones.
    # Loops, because a product of arrays takes numba two seconds to compile.
    local = np.zeros(BODY_SIZE)
    for i in range(BODY_SIZE):
        local[i] = connectors.point_load[n, i]
        for j in range(BODY_SIZE):
            local[i] += connectors.stiffness[n, i, j] * (motion[DISPLACEMENT, j] - connectors.point_strain[n, j])
            local[i] += connectors.damping[n, i, j] * motion[RATE, j]
    torque = 0.0
    if connectors.rolling.first[n] < connectors.rolling.first[n + 1]:
        forces = memory_for(connectors.rolling)
        turned = turn_between(q, n, connectors)
        rolling_force(n, motion[DISPLACEMENT], motion[RATE], turned, connectors.rolling, forces)
        for i in range(BODY_SIZE):
            local[i] += forces[ELASTIC_PART + i]
        torque = forces[CAGE_TORQUE]
    for i in range(3):
        out[i] = turn[i, 0] * local[0] + turn[i, 1] * local[1] + turn[i, 2] * local[2]
        out[3 + i] = turn[i, 0] * local[3] + turn[i, 1] * local[4] + turn[i, 2] * local[5]
    return torque


@compiled
def add_wrench(q: Floats, start: int, sign: float, load: Floats, arm: Floats, f: Floats) -> None:
    """Add a global force and moment (6,) acting at `arm` from the node to the Rxyz coordinates of a body."""
    if start < 0:
        return
    a, b = q[start + TILT], q[start + TILT + 1]
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    # Moment about the node: that of the wrench and r x F.
    mx = sign * (load[3] + arm[1] * load[2] - arm[2] * load[1])
    my = sign * (load[4] + arm[2] * load[0] - arm[0] * load[2])
    mz = sign * (load[5] + arm[0] * load[1] - arm[1] * load[0])
    for i in range(3):
        f[start + i] += sign * load[i]
    # Conjugate to the angles are the moments about x, the tilted y and the body's z.
    f[start + TILT] += mx
    f[start + TILT + 1] += ca * my + sa * mz
    f[start + SPIN] += sb * mx - sa * cb * my + ca * cb * mz


@compiled
def add_forces(q: Floats, v: Floats, connectors: ConnectorArrays, f: Floats) -> None:
    """Add the generalized forces of all connectors to f."""
    arms, load = np.empty((2, 3)), np.empty(BODY_SIZE)
    for n in range(connectors.bodies.shape[0]):
        torque = connector_load(q, v, n, connectors, arms, load)
        first, second = connectors.bodies[n]
        add_wrench(q, first, 1.0, load, arms[0], f)
        add_wrench(q, second, -1.0, load, arms[1], f)
        if first >= 0:
            f[first + SPIN] += torque
        if second >= 0:
            f[second + SPIN] -= torque
