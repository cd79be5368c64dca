"""Elastic bodies in their own turning frame, one at a time; `exugear.kernels.turning` has the compiled laws."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exugear.bodies.reduced_body import ReducedBody
from exugear.kernels.elastic import LANES
from exugear.kernels.turning import TurningArrays
from fe_ste.tools.arrays import Floats


@dataclass(frozen=True)
class TurningBody:
    """An elastic body in its own turning frame; n coordinates.

    Attributes
    ----------
    reduced : ReducedBody
        In the frame "carrier".
    damping_time : float
        Damping over stiffness, s.
    gravity : (3,)
        Acceleration, m/s2.
    """

    reduced: ReducedBody
    damping_time: float
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @cached_property
    def seats(self) -> int:
        """Number of seats."""
        return len(self.reduced.seats)

    @cached_property
    def places(self) -> Floats:
        """Places of the seats from the axis, (seats, 2), m: where the rigid spin moves them tells."""
        moved = self.reduced.spin[: 6 * self.seats].reshape(-1, 6)
        return np.stack([moved[:, 1], -moved[:, 0]], axis=1)

    @cached_property
    def weights(self) -> Floats:
        """Weights s (n,) of the frame's angle psi = s . coordinates."""
        away = np.hypot(*self.places.T) > 0.0
        chosen = away if away.any() else np.ones(self.seats, dtype=np.bool_)
        weights = np.zeros(self.reduced.size)
        weights[5 : 6 * self.seats : 6] = chosen / np.count_nonzero(chosen)
        return weights

    @cached_property
    def coriolis(self) -> Floats:
        """Matrix 2 C - M S, (n, n)."""
        return self.reduced.gyroscopic + self.across(self.reduced.mass).T  # S' = -S

    @cached_property
    def pull(self) -> Floats:
        """Centrifugal force over the square of the speed, -C r, (n,)."""
        return np.asarray(-0.5 * self.reduced.gyroscopic @ self.reduced.spin)

    def turned(self, vector: Floats, angle: float) -> Floats:
        """Turn the vectors of the seats in (n, ...) by an angle (rad) about z."""
        out = np.array(vector, dtype=np.float64)
        c, s = math.cos(angle), math.sin(angle)
        for first in (0, 3):
            x, y = slice(first, 6 * self.seats, 6), slice(first + 1, 6 * self.seats, 6)
            out[x], out[y] = c * vector[x] - s * vector[y], s * vector[x] + c * vector[y]
        return out

    def across(self, vector: Floats) -> Floats:
        """Turn the vectors of the seats in (n, ...) by a right angle and drop all else: S times the vector."""
        out = np.zeros_like(vector)
        for first in (0, 3):
            x, y = slice(first, 6 * self.seats, 6), slice(first + 1, 6 * self.seats, 6)
            out[x], out[y] = -vector[y], vector[x]
        return out

    def angle(self, q: Floats) -> float:
        """Angle psi of the frame at coordinates q, or its speed at velocities."""
        return float(self.weights @ q)

    def seen(self, q: Floats) -> Floats:
        """Displacements in the frame at coordinates q, both (n,)."""
        places = -self.across(self.reduced.spin)
        angle = self.angle(q)
        out: Floats = self.turned(np.asarray(q + places), -angle) - places
        out[5 : 6 * self.seats : 6] -= angle
        return out

    def forces(self, q: Floats, v: Floats) -> Floats:
        """Generalized forces of elasticity, damping and weight, (n,)."""
        angle, speed = self.angle(q), self.angle(v)
        moved = self.seen(q)
        rates = self.turned(v, -angle) - speed * (self.reduced.spin + self.across(moved))
        elastic = -self.reduced.stiffness @ (moved + self.damping_time * rates)
        falling = np.zeros_like(q)
        for axis in range(3):
            falling[axis : 6 * self.seats : 6] = self.gravity[axis]
        weight = self.reduced.mass @ self.turned(falling, -angle)
        return np.asarray(self.turned(elastic + weight, angle) - (self.across(moved) @ elastic) * self.weights)

    def apparent_forces(self, v: Floats, angle: float) -> Floats:
        """Coriolis and centrifugal forces in the frame, Omega h - (w . h) s, (n,)."""
        speed, w = self.angle(v), self.turned(v, -angle)
        apparent = speed * self.pull - self.coriolis @ (w - speed * self.reduced.spin)
        return np.asarray(speed * apparent - (w @ apparent) * self.weights)

    def inertia_forces(self, q: Floats, v: Floats, a: Floats) -> Floats:
        """Generalized forces that accelerations a need, all (n,)."""
        angle = self.angle(q)
        rates = self.turned(a - self.angle(v) * self.across(v), -angle)
        return self.turned(self.reduced.mass @ rates - self.apparent_forces(v, angle), angle)

    def accelerations(self, q: Floats, v: Floats, f: Floats) -> Floats:
        """Accelerations under generalized forces f, all (n,): the inverse of `inertia_forces`."""
        angle = self.angle(q)
        given = self.turned(f, -angle) + self.apparent_forces(v, angle)
        rates: Floats = np.asarray(np.linalg.solve(self.reduced.mass, given), dtype=np.float64)
        return self.turned(rates, angle) + self.angle(v) * self.across(v)

    def mass_matrix(self, q: Floats) -> Floats:
        """Mass matrix at coordinates q, (n, n)."""
        angle = self.angle(q)
        return self.turned(self.turned(self.reduced.mass, angle).T, angle)

    def rolling_velocity(self, q: Floats, speed: float) -> Floats:
        """Velocities (n,) at which the body turns with its deformation at a speed (rad/s)."""
        return np.asarray(speed * (self.reduced.spin + self.across(q)))

    def rolling_acceleration(self, q: Floats, speed: float, rate: float) -> Floats:
        """Accelerations (n,) of the same motion at a spin rate (rad/s2)."""
        around = self.reduced.spin + self.across(q)
        return np.asarray(rate * around + speed**2 * self.across(around))


def turning_arrays(bodies: Iterable[tuple[int, TurningBody]]) -> TurningArrays:
    """Arrays of bodies, each with its first coordinate in the state."""
    given = list(bodies)
    sizes = np.array([body.reduced.size for _, body in given], dtype=np.int64)
    columns = -(-sizes // LANES) * LANES

    def row_by_row(matrices: Iterable[Floats]) -> Floats:
        padded = [np.pad(matrix, ((0, 0), (0, -len(matrix) % LANES))).ravel() for matrix in matrices]
        return np.concatenate([np.zeros(0), *padded])

    def joined(vectors: Iterable[Floats]) -> Floats:
        return np.concatenate([np.zeros(0), *vectors])

    return TurningArrays(
        begin=np.array([begin for begin, _ in given], dtype=np.int64),
        size=sizes,
        seats=np.array([body.seats for _, body in given], dtype=np.int64),
        columns=columns,
        first=np.cumsum(sizes) - sizes,
        spin=joined(body.reduced.spin for _, body in given),
        weight=joined(body.weights for _, body in given),
        pull=joined(body.pull for _, body in given),
        square=np.cumsum(sizes * columns) - sizes * columns,
        stiffness=row_by_row(body.reduced.stiffness for _, body in given),
        coriolis=row_by_row(body.coriolis for _, body in given),
        mass=row_by_row(body.reduced.mass for _, body in given),
        inverse=row_by_row(np.asarray(np.linalg.inv(body.reduced.mass), dtype=np.float64) for _, body in given),
        damping_time=np.array([body.damping_time for _, body in given], dtype=np.float64),
        gravity=np.array([body.gravity for _, body in given], dtype=np.float64).reshape(-1, 3),
    )
