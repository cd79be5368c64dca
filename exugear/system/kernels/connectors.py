"""Law of 6x6 connectors (bearings) on arrays of coordinates, all at once; rolling laws in parallel to the matrices.

A linear connector has the load F0 + K (u - u0) + D u': it passes the point (u0, F0) at which K is the tangent of its
rows. Where no such point is known both are zero.
Displacement and rate are those of Exudyn's RigidBodySpringDamper: the second attachment against the first in the first
body's axes; the rate is not corrected for the turning of those axes. Coordinates are those of
`exugear.system.kernels.coordinates`. Nothing is compiled here: states of rest ask for a few hundred evaluations, and
the loop over time has the law in its own form. Each connector sees its two ends by six coordinates each; the ground has
zeros.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from exugear.system.kernels.coordinates import BODY_SIZE, SPIN, TILT
from exugear.system.kernels.rolling import (
    RollingArrays,
    no_rolling,
    rolling_loads,
    selected_rolling,
)
from fe_ste.tools.arrays import Floats, Integers

_NEXT, _LAST = [1, 2, 0], [2, 0, 1]
"""Axes after and before x, y, z."""
_SENSE = np.array([1.0, -1.0])
"""A connector gives to its first end what it takes from its second."""


class ConnectorArrays(NamedTuple):
    """All 6x6 connectors (bearings); c connectors."""

    bodies: Integers
    """(c, 2) first coordinate of the two bodies, -1 for ground; stiffness is in the first body's axes."""
    local: Floats
    """(c, 2, 3) attachment in each body's axes, relative to its node, m."""
    node: Floats
    """(c, 2, 3) node positions at zero angles, m (for ground: zero)."""
    stiffness: Floats
    damping: Floats
    """(c, 6, 6) N/m .. N m/rad, and times s."""
    point_strain: Floats
    point_load: Floats
    """(c, 6) displacement u0 (m, rad) and load F0 (N, N m) that the linear law passes."""
    rolling: RollingArrays
    """Rolling laws, which act in parallel to the matrices."""

    @property
    def offset(self) -> Floats:
        """Load (c, 6) of the linear law without displacement, F0 - K u0, N and N m."""
        return self.point_load - _times(self.stiffness, self.point_strain)

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
            point_strain=self.point_strain[numbers],
            point_load=self.point_load[numbers],
            rolling=selected_rolling(self.rolling, numbers),
        )

    def without_forces(self, numbers: Integers) -> ConnectorArrays:
        """Return the same, with no force of the matrices of some of them."""
        kept = np.ones(len(self.bodies))
        kept[numbers] = 0.0
        return self._replace(
            stiffness=self.stiffness * kept[:, None, None],
            damping=self.damping * kept[:, None, None],
            point_load=self.point_load * kept[:, None],
        )


class _Ends(NamedTuple):
    """Both ends of connectors: axes of the bodies (..., c, 2, 3, 3), then vectors (..., c, 2, 3), global axes.

    The attachment's arm from the node and its position, m; its velocity, m/s; the body's angular velocity, rad/s.
    """

    axes: Floats
    arm: Floats
    position: Floats
    velocity: Floats
    angular_velocity: Floats


def _cross(a: Floats, b: Floats) -> Floats:
    """Vector products (..., 3)."""
    product: Floats = a[..., _NEXT] * b[..., _LAST] - a[..., _LAST] * b[..., _NEXT]
    return product


def _times(matrices: Floats, vectors: Floats) -> Floats:
    """Products of matrices (..., n, n) with vectors (..., n)."""
    return np.asarray(np.einsum("...ij,...j->...i", matrices, vectors))


def _axes(angles: Floats) -> Floats:
    """Rotation matrices Rx(a) Ry(b) Rz(spin) (..., 3, 3) of angles (..., 3)."""
    (ca, cb, cg), (sa, sb, sg) = (np.moveaxis(function(angles), -1, 0) for function in (np.cos, np.sin))
    rows = (
        (cb * cg, -cb * sg, sb),
        (ca * sg + sa * sb * cg, ca * cg - sa * sb * sg, -sa * cb),
        (sa * sg - ca * sb * cg, sa * cg + ca * sb * sg, ca * cb),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _ends(x: Floats, u: Floats, connectors: ConnectorArrays) -> _Ends:
    """Move both attachments of connectors by local coordinates and their rates x, u (..., c, 2, 6)."""
    axes = _axes(x[..., TILT:])
    arm = _times(axes, connectors.local)
    # Each angle's rate about the axis that it turns about: x, the tilted y, and the body's z.
    ca = np.cos(x[..., TILT])
    sa = np.sin(x[..., TILT])
    about_y = np.stack([np.zeros_like(ca), ca, sa], axis=-1)
    omega = about_y * u[..., TILT + 1, None] + axes[..., 2] * u[..., SPIN, None]
    omega[..., 0] += u[..., TILT]
    return _Ends(axes, arm, connectors.node + x[..., :TILT] + arm, u[..., :TILT] + _cross(omega, arm), omega)


def _strains(ends: _Ends) -> tuple[Floats, Floats]:
    """Displacement and rate (..., c, 6) of each second end against the first, in the first one's axes."""
    back = ends.axes[..., 0, :, :].swapaxes(-1, -2)
    other = ends.axes[..., 1, :, :]
    place, speed, spin = (_times(back, value[..., 1, :] - value[..., 0, :]) for value in ends[2:])
    relative = back @ other
    # Rxyz angles of the relative rotation; the sine is clipped, since round-off may carry it past 1.
    angles = (
        np.arctan2(-relative[..., 1, 2], relative[..., 2, 2]),
        np.arcsin(np.clip(relative[..., 0, 2], -1.0, 1.0)),
        np.arctan2(-relative[..., 0, 1], relative[..., 0, 0]),
    )
    return np.concatenate([place, np.stack(angles, axis=-1)], axis=-1), np.concatenate([speed, spin], axis=-1)


def _own_loads(x: Floats, ends: _Ends, connectors: ConnectorArrays) -> tuple[Floats, Floats]:
    """Force and moment (..., c, 6) in the first bodies' axes; torque of a cage (..., c).

    This torque is the generalized force that the cage takes from the second body's spin and gives to that of the first.
    """
    strain, rate = _strains(ends)
    local = _times(connectors.stiffness, strain - connectors.point_strain) + _times(connectors.damping, rate)
    local += connectors.point_load
    torque = np.zeros(local.shape[:-1])
    with_rows = np.flatnonzero(np.diff(connectors.rolling.first))
    if with_rows.size:
        turned = x[..., 1, SPIN] - x[..., 0, SPIN]
        rows = np.s_[..., with_rows, :]
        turned = turned[..., with_rows]
        forces, torque[..., with_rows] = rolling_loads(with_rows, strain[rows], rate[rows], turned, connectors.rolling)
        local[rows] += forces
    return local, torque


def _loads(x: Floats, u: Floats, connectors: ConnectorArrays) -> tuple[_Ends, Floats, Floats]:
    """Both ends; force and moment (..., c, 2, 3) taken from the second one, global axes; torque of a cage (..., c)."""
    ends = _ends(x, u, connectors)
    local, torque = _own_loads(x, ends, connectors)
    vectors = local.reshape(*local.shape[:-1], 2, 3)
    return ends, vectors @ ends.axes[..., 0, :, :].swapaxes(-1, -2), torque


def _forces(x: Floats, ends: _Ends, load: Floats) -> Floats:
    """Generalized forces (..., c, 2, 6) on both ends of connectors under a force and a moment (..., c, 2, 3)."""
    force, moment = (_SENSE[:, None] * load[..., None, part, :] for part in range(2))
    moment = moment + _cross(ends.arm, force)
    # Conjugate to the angles are the moments about x, the tilted y and the body's z.
    about_y = np.cos(x[..., TILT]) * moment[..., 1] + np.sin(x[..., TILT]) * moment[..., 2]
    about_z = np.sum(ends.axes[..., 2] * moment, axis=-1)
    angles = np.stack([moment[..., 0], about_y, about_z], axis=-1)
    return np.concatenate([force, angles], axis=-1)


def _places(connectors: ConnectorArrays, size: int) -> Integers:
    """Coordinates (c, 2, 6) of both ends; those of the ground follow the others."""
    first = np.where(connectors.bodies < 0, size, connectors.bodies)
    return np.asarray(first[..., None] + np.arange(BODY_SIZE))


def _local(values: Floats, places: Integers) -> Floats:
    """Coordinates or rates (..., size) of both ends, (..., c, 2, 6)."""
    return np.concatenate([values, np.zeros((*values.shape[:-1], BODY_SIZE))], axis=-1)[..., places]


def add_connector_forces(q: Floats, v: Floats, connectors: ConnectorArrays, f: Floats) -> None:
    """Add the generalized forces of all connectors at one or several states (..., size) to f, in C order."""
    if not connectors.bodies.size:
        return
    size = f.shape[-1]
    places = _places(connectors, size)
    with np.errstate(over="ignore", invalid="ignore"):  # a search that fails passes through any number
        x = _local(q, places)
        ends, load, torque = _loads(x, _local(v, places), connectors)
        forces = _forces(x, ends, load)
        forces[..., SPIN] += _SENSE * torque[..., None]
        rows = f.reshape(-1, size)
        width = size + BODY_SIZE
        entries = places.ravel() + width * np.arange(len(rows))[:, None]
        rows += np.bincount(entries.ravel(), forces.ravel(), width * len(rows)).reshape(-1, width)[:, :size]


def connector_loads(q: Floats, v: Floats, connectors: ConnectorArrays) -> Floats:
    """Force and moment (..., c, 6) that each connector takes from its second body, global axes, N and N m.

    Parameters
    ----------
    q, v : (..., size) coordinates and velocities
    """
    places = _places(connectors, q.shape[-1])
    _, load, _ = _loads(_local(q, places), _local(v, places), connectors)
    return load.reshape(*load.shape[:-2], BODY_SIZE)


def loads_at_rest(q: Floats, connectors: ConnectorArrays) -> Floats:
    """Force and moment (c, 6) that each connector takes from its second body at rest, in the axes of the first."""
    x = _local(q, _places(connectors, q.size))
    return _own_loads(x, _ends(x, np.zeros_like(x), connectors), connectors)[0]


def connector_strains(q: Floats, connectors: ConnectorArrays) -> Floats:
    """Displacement (c, 6) of each connector's second body against the first, in the axes of that, m and rad."""
    x = _local(q, _places(connectors, q.size))
    return _strains(_ends(x, np.zeros_like(x), connectors))[0]


def rolling_strains(q: Floats, v: Floats, connectors: ConnectorArrays) -> Floats:
    """Displacement (..., c, 5) from which rows of rolling elements have their force, damping with it, m and rad.

    It is ahead of that of `connector_strains` by the time of the damping: see
    `exugear.system.kernels.rolling`.

    Parameters
    ----------
    q, v : (..., size) coordinates and velocities
    """
    places = _places(connectors, q.shape[-1])
    strain, rate = _strains(_ends(_local(q, places), _local(v, places), connectors))
    ahead = connectors.rolling.time
    out: Floats = strain[..., :5] + ahead[:, None] * rate[..., :5]
    out[..., 3] -= ahead * strain[..., 4] * rate[..., 5]
    out[..., 4] += ahead * strain[..., 3] * rate[..., 5]
    return out


def rolling_pushes(q: Floats, connectors: ConnectorArrays) -> Floats:
    """Generalized forces (c, 5, size) per unit of the forces and moments of rows of rolling elements, see `set_force`.

    Parameters
    ----------
    q : (size,)
    """
    places = _places(connectors, q.size)
    x = _local(q, places)
    ends = _ends(x, np.zeros_like(x), connectors)
    strain, _ = _strains(ends)
    count = len(connectors.bodies)
    out = np.zeros((count, 5, q.size + BODY_SIZE))
    for component in range(5):
        load = np.zeros((count, BODY_SIZE))
        load[:, component] = 1.0
        # Moments that do no work on the spin.
        load[:, 5] = {3: -strain[:, 4], 4: strain[:, 3]}.get(component, 0.0)
        vectors = load.reshape(count, 2, 3) @ ends.axes[..., 0, :, :].swapaxes(-1, -2)
        np.add.at(out[:, component], (np.arange(count)[:, None, None], places), _forces(x, ends, vectors))
    return out[..., : q.size]


def add_connector_stiffness(q: Floats, steps: Floats, connectors: ConnectorArrays, stiffness: Floats) -> None:
    """Add minus the derivatives (size, size) of the connectors' forces to coordinates q, at rest.

    Parameters
    ----------
    steps : (c,) as in `connector_tangents`
    """
    if steps.size:
        slopes = _slopes(q, steps, connectors, rates=False)
        stiffness += _scattered(slopes, _places(connectors, q.size).reshape(-1, 2 * BODY_SIZE), q.size)


def connector_tangents(q: Floats, steps: Floats, connectors: ConnectorArrays) -> Iterator[tuple[Floats, Floats]]:
    """Yield stiffness and damping (size, size) of each connector at coordinates q at rest.

    Minus the derivatives of its forces to coordinates and to velocities, by central differences, because axes, arms and
    angles depend on the coordinates, too. A cage's torque is left out.

    Parameters
    ----------
    steps : (c,) of the differences, m or rad, and per second
    """
    if not steps.size:
        return
    both = [_slopes(q, steps, connectors, rates) for rates in (False, True)]
    places = _places(connectors, q.size).reshape(-1, 2 * BODY_SIZE)
    for n in range(len(steps)):
        one = slice(n, n + 1)
        stiffness, damping = (_scattered(slopes[one], places[one], q.size) for slopes in both)
        yield stiffness, damping


def _slopes(q: Floats, steps: Floats, connectors: ConnectorArrays, rates: bool) -> Floats:
    """Minus the derivatives (c, 12, 12) of forces on both ends to their coordinates, or to the rates of these."""
    ends = 2 * BODY_SIZE
    # One coordinate of each connector at a time goes ahead and back: (coordinate, way, connector, end, coordinate).
    ways = np.eye(ends)[:, None, None] * np.array([1.0, -1.0])[:, None, None] * steps[:, None]
    ways = ways.reshape(ends, 2, -1, 2, BODY_SIZE)
    still = np.zeros_like(ways)
    rest = _local(q, _places(connectors, q.size))
    x, u = (rest + still, ways) if rates else (rest + ways, still)
    moved, load, _ = _loads(x, u, connectors)
    forces = _forces(x, moved, load).reshape(ends, 2, -1, ends)
    slopes: Floats = (forces[:, 1] - forces[:, 0]) / (2.0 * steps[:, None])
    return slopes.transpose(1, 2, 0)


def _scattered(slopes: Floats, places: Integers, size: int) -> Floats:
    """Sum (size, size) of the matrices (c, 12, 12) of connectors at their places (c, 12)."""
    padded = np.zeros((size + BODY_SIZE,) * 2)
    np.add.at(padded, (places[:, :, None], places[:, None, :]), slopes)
    return padded[:size, :size]


def no_connectors() -> ConnectorArrays:
    """Arrays of a system without bearings."""
    empty = np.zeros((0, 2, 3))
    matrices = np.zeros((0, BODY_SIZE, BODY_SIZE))
    points = np.zeros((0, BODY_SIZE))
    return ConnectorArrays(
        np.zeros((0, 2), dtype=np.int64), empty, empty, matrices, matrices, points, points, no_rolling(0)
    )
