"""Elastic bodies in their own turning frame, one at a time; `exugear.system.kernels.turning` has the compiled laws."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exugear.system.bodies.reduction import TILT_X, TILT_Y, UX, UY, UZ, ReducedBody
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN
from exugear.system.kernels.products import filled_up, laid_out, rectangular_tiles, symmetric_tiles
from exugear.system.kernels.turning import TurningArrays
from fe_ste.tools.arrays import Floats


@dataclass(frozen=True)
class TurningBody:
    """An elastic body in its own turning frame; n coordinates, of one state (n,) or of several (n, k)."""

    reduced: ReducedBody
    """In the frame "carrier"."""
    damping_time: float
    """Damping over stiffness, s."""
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """(3,) acceleration, m/s2."""

    @cached_property
    def seat_count(self) -> int:
        """Number of seats."""
        return len(self.reduced.seats)

    @cached_property
    def angle_weights(self) -> Floats:
        """Weights s (n,) of the frame's angle psi = s . coordinates."""
        # The mean spin of the seats off the axis, which the rigid spin displaces: turning them by it displaces none.
        moved = self.reduced.spin[: 6 * self.seat_count].reshape(-1, 6)
        off_axis = np.hypot(moved[:, UX], moved[:, UY]) > 0.0
        chosen = off_axis if off_axis.any() else np.ones(self.seat_count, dtype=np.bool_)
        weights = np.zeros(self.reduced.size)
        weights[SPIN : 6 * self.seat_count : 6] = chosen / np.count_nonzero(chosen)
        return weights

    @cached_property
    def coriolis(self) -> Floats:
        """Matrix 2 C - M S, (n, n)."""
        return self.reduced.gyroscopic + self.quarter_turned(self.reduced.mass).T  # S' = -S

    @cached_property
    def centrifugal(self) -> Floats:
        """Centrifugal force over the square of the speed, -C r, (n,)."""
        return np.asarray(-0.5 * self.reduced.gyroscopic @ self.reduced.spin)

    @property
    def _planar_coordinates(self) -> tuple[tuple[slice, slice], ...]:
        """X and y of all seats, of their displacements and of their tilts."""
        end = 6 * self.seat_count
        return (slice(UX, end, 6), slice(UY, end, 6)), (slice(TILT_X, end, 6), slice(TILT_Y, end, 6))

    def rotated(self, vector: Floats, angle: float | Floats) -> Floats:
        """Turn the vectors of the seats in (n, ...) by an angle (rad) about z, or each state (n, k) by its own (k,)."""
        out = np.array(vector, dtype=np.float64)
        c, s = np.cos(angle), np.sin(angle)
        for x, y in self._planar_coordinates:
            out[x], out[y] = c * vector[x] - s * vector[y], s * vector[x] + c * vector[y]
        return out

    def quarter_turned(self, vector: Floats) -> Floats:
        """Turn the vectors of the seats in (n, ...) by a right angle and drop all else: S times the vector."""
        out = np.zeros_like(vector)
        for x, y in self._planar_coordinates:
            out[x], out[y] = -vector[y], vector[x]
        return out

    def angle(self, q: Floats) -> Floats:
        """Angle psi of the frame at coordinates q, or its speed at velocities, () or (k,)."""
        return np.asarray(self.angle_weights @ q)

    def to_body_frame(self, q: Floats) -> Floats:
        """Displacements in the frame at coordinates q."""
        places = self._of_states(-self.quarter_turned(self.reduced.spin), q)  # the rigid spin, a quarter turn on
        angle = self.angle(q)
        out: Floats = self.rotated(np.asarray(q + places), -angle) - places
        out[SPIN : 6 * self.seat_count : 6] -= angle
        return out

    def _of_states(self, vector: Floats, states: Floats) -> Floats:
        """Return a vector (n,) as it combines with each of some states."""
        return vector.reshape(-1, *(1,) * (states.ndim - 1))

    def forces(self, q: Floats, v: Floats) -> Floats:
        """Generalized forces of elasticity, damping and weight."""
        angle = self.angle(q)
        speed = self.angle(v)
        displacements = self.to_body_frame(q)
        around = self.quarter_turned(displacements)
        rates = self.rotated(v, -angle) - speed * (self._of_states(self.reduced.spin, q) + around)
        elastic = -self.reduced.stiffness @ (displacements + self.damping_time * rates)
        falling = np.zeros_like(q)
        for axis in (UX, UY, UZ):
            falling[axis : 6 * self.seat_count : 6] = self.gravity[axis]
        weight = self.reduced.mass @ self.rotated(falling, -angle)
        # Turning the frame alone changes the displacements in it: elastic forces act on its angle.
        torque = np.einsum("n...,n...", around, elastic)
        return np.asarray(self.rotated(elastic + weight, angle) - torque * self._of_states(self.angle_weights, q))

    def apparent_forces(self, v: Floats, angle: float | Floats) -> Floats:
        """Coriolis and centrifugal forces in the frame, Omega h - (w . h) s."""
        speed = self.angle(v)
        w = self.rotated(v, -angle)
        spin, centrifugal, weights = (
            self._of_states(vector, v) for vector in (self.reduced.spin, self.centrifugal, self.angle_weights)
        )
        apparent = speed * centrifugal - self.coriolis @ (w - speed * spin)
        # What is taken from the frame's angle leaves no power to them.
        return np.asarray(speed * apparent - np.einsum("n...,n...", w, apparent) * weights)

    def inertia_forces(self, q: Floats, v: Floats, a: Floats) -> Floats:
        """Generalized forces that accelerations a need."""
        angle = self.angle(q)
        rates = self.rotated(a - self.angle(v) * self.quarter_turned(v), -angle)
        return self.rotated(self.reduced.mass @ rates - self.apparent_forces(v, angle), angle)

    def accelerations(self, q: Floats, v: Floats, f: Floats) -> Floats:
        """Accelerations of one state under generalized forces f: the inverse of `inertia_forces`."""
        angle = self.angle(q)
        given = self.rotated(f, -angle) + self.apparent_forces(v, angle)
        rates: Floats = np.asarray(np.linalg.solve(self.reduced.mass, given), dtype=np.float64)
        return self.rotated(rates, angle) + self.angle(v) * self.quarter_turned(v)

    def mass_matrix(self, q: Floats) -> Floats:
        """Mass matrix at coordinates q, (n, n)."""
        angle = self.angle(q)
        return self.rotated(self.rotated(self.reduced.mass, angle).T, angle)

    def rolling_velocity(self, q: Floats, speed: float) -> Floats:
        """Velocities (n,) at which the body turns with its deformation at a speed (rad/s)."""
        return np.asarray(speed * (self.reduced.spin + self.quarter_turned(q)))

    def rolling_acceleration(self, q: Floats, speed: float, rate: float) -> Floats:
        """Accelerations (n,) of the same motion at a spin rate (rad/s2)."""
        around = self.reduced.spin + self.quarter_turned(q)
        return np.asarray(rate * around + speed**2 * self.quarter_turned(around))


def turning_arrays(bodies: Iterable[tuple[int, TurningBody]]) -> TurningArrays:
    """Arrays of bodies, each with its first coordinate in the state."""
    given = list(bodies)
    sizes = np.array([body.reduced.size for _, body in given], dtype=np.int64)

    columns = np.array([filled_up(int(size)) for size in sizes], dtype=np.int64)

    def filled(values: Floats) -> Floats:
        """Values (..., size) with zeros behind, up to a multiple of eight."""
        size = values.shape[-1]
        return np.concatenate([values, np.zeros((*values.shape[:-1], filled_up(size) - size))], axis=-1)

    def moved(body: TurningBody) -> Floats:
        """Mass matrix times a motion of all seats along each axis by one, (3, size)."""
        motion = np.zeros((3, body.reduced.size))
        for axis in range(3):
            motion[axis, axis : BODY_SIZE * body.seat_count : BODY_SIZE] = 1.0
        return filled(motion @ body.reduced.mass)

    inverses = [np.asarray(np.linalg.inv(body.reduced.mass), dtype=np.float64) for _, body in given]
    stiffness, square = laid_out(symmetric_tiles(-body.reduced.stiffness) for _, body in given)
    coriolis, across = laid_out(rectangular_tiles(-body.coriolis) for _, body in given)

    def joined(vectors: Iterable[Floats]) -> Floats:
        return np.concatenate([np.zeros(0), *map(filled, vectors)])

    return TurningArrays(
        begin=np.array([begin for begin, _ in given], dtype=np.int64),
        size=sizes,
        seats=np.array([body.seat_count for _, body in given], dtype=np.int64),
        columns=columns,
        first=np.cumsum(columns) - columns,
        spin=joined(body.reduced.spin for _, body in given),
        weight=joined(body.angle_weights for _, body in given),
        pull=joined(body.centrifugal for _, body in given),
        square=square,
        stiffness=stiffness,
        mass=laid_out(symmetric_tiles(body.reduced.mass) for _, body in given)[0],
        inverse=laid_out(symmetric_tiles(inverse) for inverse in inverses)[0],
        across=across,
        coriolis=coriolis,
        damping_time=np.array([body.damping_time for _, body in given], dtype=np.float64),
        gravity=np.array([body.gravity for _, body in given], dtype=np.float64).reshape(-1, 3),
        moving=np.concatenate([np.zeros((3, 0)), *(moved(body) for _, body in given)], axis=1),
    )
