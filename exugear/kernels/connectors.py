"""Compiled law of 6x6 connectors (bearings) on arrays of coordinates."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled


class ConnectorArrays(NamedTuple):
    """All 6x6 connectors (bearings); c connectors.

    Attributes
    ----------
    bodies : (c, 2) first coordinate of the two bodies, -1 for ground; stiffness is in the first body's axes
    local : (c, 2, 3) attachment in each body's axes, relative to its node, m
    place : (c, 2, 3) node positions at zero angles, m (for ground: zero)
    stiffness, damping : (c, 6, 6) N/m .. N m/rad, and times s
    """

    bodies: Integers
    local: Floats
    place: Floats
    stiffness: Floats
    damping: Floats


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
            out[0, i] = local[i]
            out[1, i] = node[i] + local[i]
        return
    a, b = q[start + 3], q[start + 4]
    rotation(a, b, q[start + 5], turn)
    da, db, dg = v[start + 3], v[start + 4], v[start + 5]
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    wx, wy, wz = da + sb * dg, ca * db - sa * cb * dg, sa * db + ca * cb * dg
    for i in range(3):
        out[0, i] = turn[i, 0] * local[0] + turn[i, 1] * local[1] + turn[i, 2] * local[2]
        out[1, i] = node[i] + q[start + i] + out[0, i]
    r = out[0]
    out[2, 0] = v[start] + wy * r[2] - wz * r[1]
    out[2, 1] = v[start + 1] + wz * r[0] - wx * r[2]
    out[2, 2] = v[start + 2] + wx * r[1] - wy * r[0]
    out[3, 0], out[3, 1], out[3, 2] = wx, wy, wz


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
    index, place, local = connectors.bodies[n], connectors.place[n], connectors.local[n]
    body_point(q, v, index[0], place[0], local[0], turn, point0)
    body_point(q, v, index[1], place[1], local[1], turn1, point1)
    relative = np.zeros((3, 3))
    out[:] = 0.0
    for i in range(3):
        arms[0, i], arms[1, i] = point0[0, i], point1[0, i]
        for j in range(3):
            out[0, i] += turn[j, i] * (point1[1, j] - point0[1, j])
            out[1, i] += turn[j, i] * (point1[2, j] - point0[2, j])
            out[1, 3 + i] += turn[j, i] * (point1[3, j] - point0[3, j])
            for k in range(3):
                relative[i, j] += turn[k, i] * turn1[k, j]
    out[0, 3] = math.atan2(-relative[1, 2], relative[2, 2])
    out[0, 4] = math.asin(min(1.0, max(-1.0, relative[0, 2])))
    out[0, 5] = math.atan2(-relative[0, 1], relative[0, 0])
    spinning = np.zeros(3)
    for i in range(3):
        for j in range(3):
            spinning[i] += turn[j, i] * point0[3, j]
    d, w = out[0], out[1]
    out[2, 0] = w[0] - spinning[1] * d[2] + spinning[2] * d[1]
    out[2, 1] = w[1] - spinning[2] * d[0] + spinning[0] * d[2]
    out[2, 2] = w[2] - spinning[0] * d[1] + spinning[1] * d[0]
    across = math.cos(d[3]) * w[5] - math.sin(d[3]) * w[4]
    out[2, 5] = across / math.cos(d[4])
    out[2, 4] = math.cos(d[3]) * w[4] + math.sin(d[3]) * w[5]
    out[2, 3] = w[3] - math.sin(d[4]) * out[2, 5]


@compiled
def connector_load(q: Floats, v: Floats, n: int, connectors: ConnectorArrays, arms: Floats, out: Floats) -> None:
    """Fill force and moment (6,) that connector n takes from its second body, global axes; arms (2, 3)."""
    turn, motion = np.empty((3, 3)), np.empty((3, 6))
    connector_motion(q, v, n, connectors, turn, arms, motion)
    own = connectors.stiffness[n] @ motion[0] + connectors.damping[n] @ motion[1]
    for i in range(3):
        out[i] = turn[i, 0] * own[0] + turn[i, 1] * own[1] + turn[i, 2] * own[2]
        out[3 + i] = turn[i, 0] * own[3] + turn[i, 1] * own[4] + turn[i, 2] * own[5]


@compiled
def add_wrench(q: Floats, start: int, sign: float, load: Floats, arm: Floats, f: Floats) -> None:
    """Add a global force and moment (6,) acting at `arm` from the node to the Rxyz coordinates of a body."""
    if start < 0:
        return
    a, b = q[start + 3], q[start + 4]
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    mx = sign * (load[3] + arm[1] * load[2] - arm[2] * load[1])
    my = sign * (load[4] + arm[2] * load[0] - arm[0] * load[2])
    mz = sign * (load[5] + arm[0] * load[1] - arm[1] * load[0])
    for i in range(3):
        f[start + i] += sign * load[i]
    f[start + 3] += mx
    f[start + 4] += ca * my + sa * mz
    f[start + 5] += sb * mx - sa * cb * my + ca * cb * mz


@compiled
def add_connector_forces(q: Floats, v: Floats, connectors: ConnectorArrays, f: Floats) -> None:
    """Add the generalized forces of all connectors to f."""
    load, arms = np.empty(6), np.empty((2, 3))
    for n in range(connectors.bodies.shape[0]):
        connector_load(q, v, n, connectors, arms, load)
        add_wrench(q, connectors.bodies[n, 0], 1.0, load, arms[0], f)
        add_wrench(q, connectors.bodies[n, 1], -1.0, load, arms[1], f)


def no_connectors() -> ConnectorArrays:
    """Arrays of a system without bearings."""
    empty = np.zeros((0, 2, 3))
    matrices = np.zeros((0, 6, 6))
    return ConnectorArrays(np.zeros((0, 2), dtype=np.int64), empty, empty, matrices, matrices)
