"""Elastic bodies in a frame that floats with them: modes, integrals over their mass, and how their seats move.

All elastic vibrations of a reduced solid (`exugear.bodies.solids`) are modes, so that static deflections are those
of the
reduced body; what vibrates above the limit is slowed down to it by mass on its amplitude. A floating frame knows the
body by int rho f_a g_b of its place and its modes f, g; rigid rings on seats (blanks) add theirs.

A seat's coordinates are those it has as a reduced body in the gearbox: displacement, tilts a and b and the unwrapped
spin c of its rotation Rx(a) Ry(b) Rz(c). Inner amplitudes belong to shapes that do not spin; those of the modes do.
For a body of revolution a turn by psi takes the modes into each other, exp(psi S), with eigenvalues of S at whole
numbers: 0 for torsion and stretching, 1 for bending.

Nothing here knows a solver; Exudyn's floating frame is in `exugear.solvers.exudyn_model.floating`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from exugear.bodies.reduced_body import ReducedBody, ReductionError, RigidInertia
from exugear.bodies.solids import ReducedSolid, SolidModel, in_each_direction, reduce_matrices, reduced_body
from exugear.bodies.store import store_arrays, kept, stored_arrays
from fe_ste.tools.arrays import Complexes, Floats

ORDER_TOLERANCE = 0.02
"""Largest distance of an eigenvalue of S from a whole number."""
IDENTITY = np.eye(3)
MOST_NEWTON_STEPS = 20
"""Newton steps to find the coordinates of a state."""
CORRECTION_TOLERANCE = 1e-14
"""Size of a correction, m or rad, that ends them."""


@dataclass(frozen=True)
class FloatingBody:
    """A solid as modes in its own frame; n coordinates of the reduced body, k modes, s seats.

    Attributes
    ----------
    name, seats : what it is, and names of its seats
    places : (s, 3) of the seats, m
    centre : (3,) where the frame is: mass centre of shape and rings, m
    mass : kg
    coordinates : (n, k) coordinates of the reduced body by mode: seats' first, then inner amplitudes
    stiffness : (k,) of modes of unit mass, 1/s2
    slowing : (k,) mass beyond that on modes above the limit
    first : (3, 1 + k) int rho f of the place from the centre and of the modes, kg m and kg^0.5
    moments : (3, 3, 1 + k, 1 + k) int rho f_a g_b
    stretching : (k, k) what times the square of the spin speed is the stiffness of centrifugal tension
    turning : (k, k) antisymmetric S: a turn by psi takes modes into each other by exp(psi S)
    """

    name: str
    seats: tuple[str, ...]
    places: Floats
    centre: Floats
    mass: float
    coordinates: Floats
    stiffness: Floats
    slowing: Floats
    first: Floats
    moments: Floats
    stretching: Floats
    turning: Floats

    @property
    def frequencies(self) -> Floats:
        """Frequencies of the free body at rest, (k,), Hz."""
        return np.sqrt(self.stiffness / (1.0 + self.slowing)) / (2.0 * np.pi)

    @property
    def centrifugal(self) -> Floats:
        """Steady force on the modes over the square of the spin speed, (k,): it widens and shortens a body."""
        load: Floats = self.moments[0, 0, 0, 1:] + self.moments[1, 1, 0, 1:]
        return load

    @property
    def spin_stiffness(self) -> Floats:
        """Stiffness over the square of the spin speed, (k, k): centrifugal tension; slowing masses do not spin."""
        square = self.turning @ self.turning
        return self.stretching + 0.5 * (self.slowing[:, None] * square + square * self.slowing)

    @property
    def spin_damping(self) -> Floats:
        """Antisymmetric damping over the spin speed, (k, k): slowing masses do not spin with the frame."""
        return self.slowing[:, None] * self.turning + self.turning * self.slowing

    @property
    def at_seats(self) -> Floats:
        """Displacement and turns of the seats by mode, (6 s, k)."""
        return self.coordinates[: 6 * len(self.seats)]


def floating_body(model: SolidModel, matrices: ReducedSolid | None = None) -> FloatingBody:
    """Modes of a solid in its own frame, and its integrals; from its reduced matrices if they are at hand."""
    reduced = matrices or reduce_matrices(model)
    solid, part = reduced.solid, reduced.part
    values, turned = scipy.linalg.eigh(part.stiffness, part.mass)
    values, turned = values[6:], turned[:, 6:]
    modes = part.shapes @ turned
    share = np.asarray(solid.scalar_mass.sum(axis=0)).ravel()
    rings = [(n, model.blanks[seat.name]) for n, seat in enumerate(model.seats) if seat.name in model.blanks]
    places = np.array([seat.centre for seat in model.seats])
    mass = share.sum() + sum(ring.mass for _, ring in rings)
    centre = (share @ solid.nodes + sum(ring.mass * places[n] for n, ring in rings)) / mass
    of_nodes = np.concatenate([(solid.nodes - centre)[:, :, None], modes.reshape(-1, 3, len(values))], axis=2)
    count = of_nodes.shape[2]
    flat = of_nodes.reshape(len(of_nodes), -1)
    moments = (flat.T @ (solid.scalar_mass @ flat)).reshape(3, count, 3, count).transpose(0, 2, 1, 3)
    first = (share @ flat).reshape(3, count)
    stretching = modes.T @ (in_each_direction(solid.stretching) @ modes)
    convection = modes.T @ (in_each_direction(solid.convection) @ modes)
    for n, ring in rings:
        moved, turns = turned[6 * n : 6 * n + 3], turned[6 * n + 3 : 6 * n + 6]
        field = np.zeros((3, 4, count))  # of 1, x, y, z from the seat's centre
        field[:, 0, 0], field[:, 1:, 0] = places[n] - centre, np.eye(3)
        field[:, 0, 1:] = moved
        field[:, 1:, 1:] = _skew(turns.T).transpose(1, 2, 0)
        square = np.array([ring.mass, ring.axial / 2, ring.axial / 2, ring.transverse - ring.axial / 2])
        moments += np.einsum("acf,c,bcg->abfg", field, square, field)
        first += ring.mass * field[:, 0]
        stretching += turns.T @ (np.array([0.5, 0.5, 1.0])[:, None] * ring.axial * turns)
        across = ring.axial / 2 * np.outer(turns[0], turns[1])
        convection += across - across.T
    own = moments[:, :, 1:, 1:]
    turning = own[1, 0] - own[0, 1] - convection
    return FloatingBody(
        name=model.name,
        seats=tuple(seat.name for seat in model.seats),
        places=places,
        centre=centre,
        mass=float(mass),
        coordinates=turned,
        stiffness=values,
        slowing=np.maximum(values / (2.0 * np.pi * model.limit) ** 2, 1.0) - 1.0,
        first=first,
        moments=moments,
        stretching=0.5 * (stretching + stretching.T),
        turning=0.5 * (turning - turning.T),
    )


def with_inertia(body: FloatingBody, wanted: RigidInertia) -> FloatingBody:
    """Give a body the rigid inertia of another model of it; as `exugear.bodies.reduction.with_rigid_inertia` does.

    What is added or missing moves with the frame, that is with the rigid part of the motion.
    """
    offset = np.array(wanted.centre) - body.centre
    square = np.diag([wanted.axial / 2, wanted.axial / 2, wanted.transverse - wanted.axial / 2])
    moments, first = body.moments.copy(), body.first.copy()
    moments[:, :, 0, 0] = square + wanted.mass * np.outer(offset, offset)
    first[:, 0] = wanted.mass * offset
    return replace(body, mass=wanted.mass, moments=moments, first=first)


def load_or_reduce_floating(model: SolidModel, folder: Path | None) -> tuple[ReducedBody, FloatingBody]:
    """Both descriptions of a solid of revolution, from a folder if they are there for exactly these inputs.

    Raises
    ------
    exugear.bodies.solids.SolidError, ReductionError
        As `exugear.bodies.solids.reduce_solid`.
    """
    matrices = cache(lambda: reduce_matrices(model))
    if folder is None:
        return reduced_body(model, matrices()), floating_body(model, matrices())
    name = f"{model.name}-{model.key[:16]}"
    reduced = kept(folder / f"{name}.npz", model.key, lambda: reduced_body(model, matrices()))
    path = folder / f"{name}-floating.npz"
    arrays = stored_arrays(path, model.key)
    if arrays is not None:
        return reduced, _from_arrays(arrays)
    body = floating_body(model, matrices())
    store_arrays(path, model.key, {one.name: np.asarray(getattr(body, one.name)) for one in fields(body)})
    return reduced, body


def _from_arrays(arrays: Mapping[str, NDArray[Any]]) -> FloatingBody:
    values: dict[str, Any] = {one.name: arrays[one.name] for one in fields(FloatingBody)}
    values |= {"name": str(values["name"]), "mass": float(values["mass"]), "seats": tuple(values["seats"].tolist())}
    return FloatingBody(**values)


def _skew(vectors: Floats) -> Floats:
    """Matrices (..., 3, 3) of the cross product with vectors (..., 3)."""
    matrices = np.zeros((*vectors.shape, 3))
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        matrices[..., a, b], matrices[..., b, a] = -vectors[..., c], vectors[..., c]
    return matrices


def euler_rotation(parameters: Floats) -> tuple[Floats, Floats]:
    """Rotation matrix (3, 3) of Euler parameters (4,), and matrix (3, 4) from their rates to the angular velocity."""
    scalar, vector = parameters[0], parameters[1:]
    cross = _skew(vector)
    rates = np.empty((3, 4))
    rates[:, 0], rates[:, 1:] = -2.0 * vector, 2.0 * (scalar * IDENTITY + cross)
    return IDENTITY + 2.0 * scalar * cross + 2.0 * cross @ cross, rates


@dataclass(frozen=True)
class FloatingMotion:
    """A state of the reduced body (n,), and the matrix (n, 7 + k) from rates of a floating frame to its rates."""

    coordinates: Floats
    velocities: Floats
    jacobian: Floats


class FloatingCoordinates:
    """From the 7 + k coordinates of a body's floating frame to the n = 6 + k of the reduced body, and back.

    A floating frame's coordinates are the displacement of its centre, the change of its Euler parameters from
    (1, 0, 0, 0), and the amplitudes of the modes.

    Parameters
    ----------
    body : FloatingBody

    Raises
    ------
    ReductionError
        The body is none of revolution.
    """

    def __init__(self, body: FloatingBody) -> None:
        self.body = body
        orders, shapes = np.linalg.eigh(1j * body.turning)
        whole = np.round(orders)
        if np.abs(orders - whole).max() > ORDER_TOLERANCE:
            raise ReductionError(
                f"body {body.name}: a turn leaves {np.abs(orders - whole).max():.1e} of its modes over; it must be "
                "a body of revolution, with a finer mesh"
            )
        self.size, self.count = len(body.coordinates), 7 + len(body.stiffness)
        seats = len(body.seats)
        by_seat = body.at_seats.reshape(seats, 2, 3, -1)
        self._moves, self._turns = by_seat[:, 0], by_seat[:, 1]
        self._arms = body.places - body.centre
        self._orders: Floats = whole
        self._shapes: Complexes = np.ascontiguousarray(shapes.conj().T)
        self._inner: Complexes = body.coordinates[6 * seats :] @ shapes

    def motion(self, q: Floats, v: Floats, near: float) -> FloatingMotion:
        """State of the reduced body at coordinates and rates (7 + k,); spins are those nearest to an angle (rad)."""
        amplitudes = q[7:]
        turn, to_velocity = euler_rotation(q[3:7] + [1.0, 0.0, 0.0, 0.0])
        count = len(self._arms)
        arms = (self._arms + self._moves @ amplitudes) @ turn.T
        small = _skew(self._turns @ amplitudes)
        turns = np.concatenate([turn @ (IDENTITY + small + 0.5 * small @ small), turn[None]])  # of the seats and the frame
        angles, to_angles = _tilts_and_spin(turns, near)
        jacobian = np.zeros((self.size, self.count))
        seats = jacobian[: 6 * count].reshape(count, 6, self.count)
        seats[:, :3, :3] = IDENTITY
        seats[:, :3, 3:7] = -_skew(arms) @ to_velocity
        seats[:, :3, 7:] = turn @ self._moves
        seats[:, 3:, 3:7] = to_angles[:-1] @ to_velocity
        seats[:, 3:, 7:] = to_angles[:-1] @ turn @ ((IDENTITY + 0.5 * small) @ self._turns)
        coordinates = np.empty(self.size)
        at_seats = coordinates[: 6 * count].reshape(count, 6)
        at_seats[:, :3] = q[:3] + arms - self._arms
        at_seats[:, 3:] = angles[:-1]
        carried = self._inner * np.exp(-1j * angles[-1, 2] * self._orders)
        still = self._shapes @ amplitudes
        coordinates[6 * count :] = (carried @ still).real
        jacobian[6 * count :, 7:] = (carried @ self._shapes).real
        turned = (carried @ (-1j * self._orders * still)).real
        jacobian[6 * count :, 3:7] = np.outer(turned, to_angles[-1, 2] @ to_velocity)
        return FloatingMotion(coordinates, jacobian @ v, jacobian)

    def speed(self, q: Floats, v: Floats) -> float:
        """Spin speed about the frame's own axis, rad/s."""
        turn, to_velocity = euler_rotation(q[3:7] + [1.0, 0.0, 0.0, 0.0])
        return float(turn[:, 2] @ to_velocity @ v[3:7])

    def of(self, coordinates: Floats, velocities: Floats) -> tuple[Floats, Floats]:
        """Coordinates and rates (7 + k,) of the floating frame in a state of the reduced body.

        Raises
        ------
        ReductionError
            No such state: tilts or deformations are not small.
        """
        near = float(coordinates[5])
        q, still = np.zeros(self.count), np.zeros(self.count)
        q[3], q[6] = math.cos(near / 2.0) - 1.0, math.sin(near / 2.0)
        for _ in range(MOST_NEWTON_STEPS):
            found = self.motion(q, still, near)
            change = np.linalg.lstsq(found.jacobian, coordinates - found.coordinates)[0]
            q = q + change
            parameters = q[3:7] + [1.0, 0.0, 0.0, 0.0]
            q[3:7] = parameters / np.linalg.norm(parameters) - [1.0, 0.0, 0.0, 0.0]
            if np.abs(change).max() < CORRECTION_TOLERANCE * max(1.0, abs(near)):
                break
        else:
            raise ReductionError(f"body {self.body.name}: its state is none of small tilts and deformations")
        return q, np.asarray(np.linalg.lstsq(self.motion(q, still, near).jacobian, velocities)[0], dtype=np.float64)


def _tilts_and_spin(turns: Floats, near: float) -> tuple[Floats, Floats]:
    """Angles (s, 3) of turns Rx Ry Rz (s, 3, 3), spins nearest to an angle, and from angular velocities to rates."""
    a = np.arctan2(-turns[:, 1, 2], turns[:, 2, 2])
    b = np.arcsin(np.clip(turns[:, 0, 2], -1.0, 1.0))
    c = np.arctan2(-turns[:, 0, 1], turns[:, 0, 0])
    c += 2.0 * np.pi * np.round((near - c) / (2.0 * np.pi))
    ca, sa, cb, sb = np.cos(a), np.sin(a), np.cos(b), np.sin(b)
    rates = np.zeros((len(turns), 3, 3))
    rates[:, 0, 0] = 1.0
    rates[:, 0, 1], rates[:, 0, 2] = sa * sb / cb, -ca * sb / cb
    rates[:, 1, 1], rates[:, 1, 2] = ca, sa
    rates[:, 2, 1], rates[:, 2, 2] = -sa / cb, ca / cb
    return np.stack([a, b, c], axis=1), rates
