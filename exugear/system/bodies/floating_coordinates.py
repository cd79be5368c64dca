"""From a floating frame's coordinates to those of the reduced body, and back.

A seat's coordinates are those it has as a reduced body in the gearbox: displacement, tilts a and b and the unwrapped
spin c of its rotation Rx(a) Ry(b) Rz(c). The modal coordinates of a reduced body belong to shapes that do not spin;
those of the floating frame's modes do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from exugear.system.bodies.floating_body import FloatingBody
from exugear.system.bodies.reduced_body import ReductionError
from exugear.system.bodies.rotations import IDENTITY, euler_rotation, skew, tilts_and_spin
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN
from fe_ste.tools.arrays import Complexes, Floats

ORDER_TOLERANCE = 0.02
"""Largest distance of an eigenvalue of S from a whole number."""
MOST_NEWTON_STEPS = 20
"""Newton steps to find the coordinates of a state."""
CORRECTION_TOLERANCE = 1e-14
"""Size of a correction, m or rad, that ends them."""
DISPLACEMENT, EULER, MODAL = slice(0, 3), slice(3, 7), slice(7, None)
"""Coordinates of a floating frame: of its centre, change of its Euler parameters, those of the modes."""
FRAME_COORDINATES = 7
"""Coordinates of the frame alone."""
NO_TURN = np.array([1.0, 0.0, 0.0, 0.0])
"""Euler parameters of a frame in its place."""


@dataclass(frozen=True)
class FloatingMotion:
    """A state of the reduced body (n,), and the matrix (n, 7 + k) from rates of a floating frame to its rates."""

    coordinates: Floats
    velocities: Floats
    jacobian: Floats


class FloatingCoordinates:
    """From the 7 + k coordinates of a body's floating frame to the n = 6 + k of the reduced body, and back.

    A floating frame's coordinates are the displacement of its centre, the change of its Euler parameters from
    (1, 0, 0, 0), and the modal coordinates.

    Raises
    ------
    ReductionError
        The body is none of revolution.
    """

    def __init__(self, body: FloatingBody) -> None:
        self.body = body
        orders, shapes = np.linalg.eigh(1j * body.turning)
        whole_orders = np.round(orders)
        remainder = np.abs(orders - whole_orders).max()
        if remainder > ORDER_TOLERANCE:
            raise ReductionError(
                f"body {body.name}: a turn leaves {remainder:.1e} of its modes over; it must be "
                "a body of revolution, with a finer mesh"
            )
        self.size, self.count = len(body.mode_coordinates), FRAME_COORDINATES + len(body.stiffness)
        seats = len(body.seats)
        by_seat = body.at_seats.reshape(seats, 2, 3, -1)
        self._moves, self._turns = by_seat[:, 0], by_seat[:, 1]
        self._arms = body.places - body.centre
        self._orders: Floats = whole_orders
        self._shapes: Complexes = np.ascontiguousarray(shapes.conj().T)
        self._inner: Complexes = body.mode_coordinates[BODY_SIZE * seats :] @ shapes

    def motion(self, q: Floats, v: Floats, near: float) -> FloatingMotion:
        """State of the reduced body at coordinates and rates (7 + k,); spins are those nearest to an angle (rad)."""
        modal = q[MODAL]
        turn, to_velocity = euler_rotation(q[EULER] + NO_TURN)
        count = len(self._arms)
        arms = (self._arms + self._moves @ modal) @ turn.T
        # A seat turns with the frame and by its elastic tilts, which are small: their square is enough.
        small = skew(self._turns @ modal)
        elastic_turns = IDENTITY + small + 0.5 * small @ small
        angles, to_angles = tilts_and_spin(np.concatenate([turn @ elastic_turns, turn[None]]), near)
        jacobian = np.zeros((self.size, self.count))
        seats = jacobian[: 6 * count].reshape(count, 6, self.count)
        seats[:, :3, DISPLACEMENT] = IDENTITY
        seats[:, :3, EULER] = -skew(arms) @ to_velocity
        seats[:, :3, MODAL] = turn @ self._moves
        seats[:, 3:, EULER] = to_angles[:-1] @ to_velocity
        seats[:, 3:, MODAL] = to_angles[:-1] @ turn @ ((IDENTITY + 0.5 * small) @ self._turns)
        coordinates = np.empty(self.size)
        at_seats = coordinates[: 6 * count].reshape(count, 6)
        at_seats[:, :3] = q[DISPLACEMENT] + arms - self._arms
        at_seats[:, 3:] = angles[:-1]
        # The modes turn with the frame, the reduced body's shapes do not: turned back by the frame's spin.
        turned_back = self._inner * np.exp(-1j * angles[-1, 2] * self._orders)
        in_frame = self._shapes @ modal
        coordinates[6 * count :] = (turned_back @ in_frame).real
        jacobian[6 * count :, MODAL] = (turned_back @ self._shapes).real
        by_spin = (turned_back @ (-1j * self._orders * in_frame)).real
        jacobian[6 * count :, EULER] = np.outer(by_spin, to_angles[-1, 2] @ to_velocity)
        return FloatingMotion(coordinates, jacobian @ v, jacobian)

    def speed(self, q: Floats, v: Floats) -> float:
        """Spin speed about the frame's own axis, rad/s."""
        turn, to_velocity = euler_rotation(q[EULER] + NO_TURN)
        return float(turn[:, 2] @ to_velocity @ v[EULER])

    def of(self, coordinates: Floats, velocities: Floats) -> tuple[Floats, Floats]:
        """Coordinates and rates (7 + k,) of the floating frame in a state of the reduced body.

        Raises
        ------
        ReductionError
            No such state: tilts or deformations are not small.
        """
        near = float(coordinates[SPIN])
        q = np.zeros(self.count)
        rest = np.zeros(self.count)
        q[EULER] = [math.cos(near / 2.0) - 1.0, 0.0, 0.0, math.sin(near / 2.0)]
        for _ in range(MOST_NEWTON_STEPS):
            state = self.motion(q, rest, near)
            change = np.linalg.lstsq(state.jacobian, coordinates - state.coordinates)[0]
            q = q + change
            parameters = q[EULER] + NO_TURN
            q[EULER] = parameters / np.linalg.norm(parameters) - NO_TURN
            if np.abs(change).max() < CORRECTION_TOLERANCE * max(1.0, abs(near)):
                break
        else:
            raise ReductionError(f"body {self.body.name}: its state is none of small tilts and deformations")
        return q, np.asarray(np.linalg.lstsq(self.motion(q, rest, near).jacobian, velocities)[0], dtype=np.float64)
