"""Compiled law of 6x6 connectors (bearings) on arrays of coordinates, with rolling laws in parallel to the matrices.

Displacement and rate are those of Exudyn's RigidBodySpringDamper. Coordinates are those of
`exugear.kernels.coordinates`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from exugear.kernels.coordinates import BODY_SIZE, SPIN, TILT
from exugear.kernels.rolling import (
    CAGE_TORQUE,
    ELASTIC_PART,
    RollingArrays,
    no_rolling,
    rolling_force,
    rolling_memory,
    selected_rolling,
)
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled
from fe_ste.tools.inner_kernels import kept_bundle

ARM, POSITION, VELOCITY, ANGULAR_VELOCITY = range(4)
"""Rows of `body_point`."""
DISPLACEMENT, RATE, TRUE_RATE = range(3)
"""Rows of `connector_motion`."""
_NONE = np.zeros(0)
_ROOMS = {"strains": np.zeros((0, 0)), "loads": np.zeros((0, 0)), "f": _NONE, "tangents": np.zeros((0, 0, 0))}
"""What `pass_connectors` fills, without room for it."""


class ConnectorArrays(NamedTuple):
    """All 6x6 connectors (bearings); c connectors.

    Attributes
    ----------
    bodies : (c, 2) first coordinate of the two bodies, -1 for ground; stiffness is in the first body's axes
    local : (c, 2, 3) attachment in each body's axes, relative to its node, m
    node : (c, 2, 3) node positions at zero angles, m (for ground: zero)
    stiffness, damping : (c, 6, 6) N/m .. N m/rad, and times s
    rolling : rolling laws, which act in parallel to the matrices
    """

    bodies: Integers
    local: Floats
    node: Floats
    stiffness: Floats
    damping: Floats
    rolling: RollingArrays

    def one(self, n: int) -> ConnectorArrays:
        """Arrays of connector n alone."""
        return self.chosen(np.array([n], dtype=np.int64))

    def chosen(self, numbers: Integers) -> ConnectorArrays:
        """Arrays of some connectors, in the order of their numbers."""
        return ConnectorArrays(
            bodies=self.bodies[numbers],
            local=self.local[numbers],
            node=self.node[numbers],
            stiffness=self.stiffness[numbers],
            damping=self.damping[numbers],
            rolling=selected_rolling(self.rolling, numbers),
        )


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
        for j in range(BODY_SIZE):
            local[i] += connectors.stiffness[n, i, j] * motion[DISPLACEMENT, j]
            local[i] += connectors.damping[n, i, j] * motion[RATE, j]
    torque = 0.0
    if connectors.rolling.first[n] < connectors.rolling.first[n + 1]:
        forces = rolling_memory(connectors.rolling)
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
def add_differences(
    q: Floats, n: int, step: float, connectors: ConnectorArrays, state: Floats, tangents: Floats
) -> None:
    """Add minus the derivatives of connector n's forces to tangents (2, size, size), at rest; a cage's torque left out.

    Central differences with `step` by each coordinate, a row, and by its rate; the state (2, size) is q at rest, and is
    so again. Differences, because axes, arms and angles depend on the coordinates, too.
    """
    load, arms = np.empty(BODY_SIZE), np.empty((2, 3))
    ends = connectors.bodies[n]
    for k in range(2 * BODY_SIZE):
        c = ends[k // BODY_SIZE] + k % BODY_SIZE
        if ends[k // BODY_SIZE] < 0:
            continue
        for of_rate in range(2):
            before = state[of_rate, c]
            for sign in (-1.0, 1.0):
                state[of_rate, c] = before + sign * step
                connector_load(state[0], state[1], n, connectors, arms, load)
                for i in range(BODY_SIZE):
                    load[i] *= -sign / (2.0 * step)
                add_wrench(state[0], ends[0], 1.0, load, arms[0], tangents[of_rate, c])
                add_wrench(state[0], ends[1], -1.0, load, arms[1], tangents[of_rate, c])
            state[of_rate, c] = before


@compiled
def pass_connectors(
    q: Floats,
    v: Floats,
    steps: Floats,
    connectors: ConnectorArrays,
    strains: Floats,
    loads: Floats,
    f: Floats,
    tangents: Floats,
) -> None:
    """Do for all connectors what the functions below say, where there is room for it.

    One function does all, so that the law is compiled once.
    """
    turn, motion, arms, load = np.empty((3, 3)), np.empty((3, BODY_SIZE)), np.empty((2, 3)), np.empty(BODY_SIZE)
    state = np.zeros((2, q.size))
    for i in range(q.size):
        state[0, i] = q[i]
    for n in range(connectors.bodies.shape[0]):
        if strains.size > 0:
            connector_motion(q, v, n, connectors, turn, arms, motion)
            for i in range(BODY_SIZE):
                strains[n, i] = motion[DISPLACEMENT, i]
        if f.size > 0 or loads.size > 0:
            torque = connector_load(q, v, n, connectors, arms, load)
            for i in range(BODY_SIZE if loads.size > 0 else 0):
                loads[n, i] = load[i]
            if f.size > 0:
                first, second = connectors.bodies[n]
                add_wrench(q, first, 1.0, load, arms[0], f)
                add_wrench(q, second, -1.0, load, arms[1], f)
                if first >= 0:
                    f[first + SPIN] += torque
                if second >= 0:
                    f[second + SPIN] -= torque
        if tangents.size > 0 and steps[n] > 0.0:
            add_differences(q, n, steps[n], connectors, state, tangents)


def _pass(q: Floats, v: Floats, connectors: ConnectorArrays, steps: Floats = _NONE, **rooms: Floats) -> None:
    places = (rooms.get(name, none) for name, none in _ROOMS.items())
    pass_connectors(q, v, steps, kept_bundle(connectors), *places)


def add_connector_forces(q: Floats, v: Floats, connectors: ConnectorArrays, f: Floats) -> None:
    """Add the generalized forces of all connectors to f."""
    _pass(q, v, connectors, f=f)


def connector_loads(q: Floats, v: Floats, connectors: ConnectorArrays) -> Floats:
    """Force and moment (c, 6) that each connector takes from its second body, global axes, N and N m."""
    loads = np.zeros((len(connectors.bodies), BODY_SIZE))
    _pass(q, v, connectors, loads=loads)
    return loads


def connector_strains(q: Floats, connectors: ConnectorArrays) -> Floats:
    """Displacement (c, 6) of each connector's second body against the first, in the axes of that, m and rad."""
    strains = np.zeros((len(connectors.bodies), BODY_SIZE))
    _pass(q, np.zeros_like(q), connectors, strains=strains)
    return strains


def add_connector_tangents(
    q: Floats, steps: Floats, connectors: ConnectorArrays, stiffness: Floats, damping: Floats
) -> None:
    """Add minus the derivatives (size, size) of the connectors' forces to coordinates q and to velocities, at rest.

    Parameters
    ----------
    steps : (c,) array
        Of the central differences, m or rad, and per second; connectors with 0 are left out.
    """
    tangents = np.zeros((2, q.size, q.size))
    _pass(q, np.zeros_like(q), connectors, steps, tangents=tangents)
    stiffness += tangents[0].T
    damping += tangents[1].T


def no_connectors() -> ConnectorArrays:
    """Arrays of a system without bearings."""
    empty = np.zeros((0, 2, 3))
    matrices = np.zeros((0, BODY_SIZE, BODY_SIZE))
    return ConnectorArrays(np.zeros((0, 2), dtype=np.int64), empty, empty, matrices, matrices, no_rolling(0))
