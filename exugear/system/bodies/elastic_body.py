"""An elastic body as the equations of motion take it: reduced, with its seats and its rigid inertia. Data alone.

A seat's coordinates are those it has as a reduced body in the gearbox: displacement, tilts a and b and the unwrapped
spin c of its rotation Rx(a) Ry(b) Rz(c). The modal coordinates of a reduced body belong to shapes that do not spin;
those of the floating frame's modes do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from exugear.gearbox.sections.bodies import DampedBodySection
from exugear.system.bodies.reduction import ReducedBody, ReductionError, RigidInertia
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN
from fe_ste.tools.arrays import Complexes, Floats
from fe_ste.tools.display import ReprMixin


@dataclass(frozen=True)
class FloatingBody(ReprMixin, line=" {name}: {seats!n} seats, {stiffness!n} modes, {mass:.4g} kg"):
    """A solid as modes in its own frame; n coordinates of the reduced body, k modes, s seats."""

    name: str
    seats: tuple[str, ...]
    """What it is, and names of its seats."""
    places: Floats
    """(s, 3) of the seats, m."""
    centre: Floats
    """(3,) where the frame is: mass centre of shape and rings, m."""
    mass: float
    """In kg."""
    mode_coordinates: Floats
    """(n, k) coordinates of the reduced body by mode: seats' first, then modal coordinates."""
    stiffness: Floats
    """(k,) of modes of unit mass, 1/s2."""
    added_mass: Floats
    """(k,) by mass scaling beyond the unit mass of modes above the limit."""
    first_moments: Floats
    """(3, 1 + k) int rho f of the place from the centre and of the modes, kg m and kg^0.5."""
    second_moments: Floats
    """(3, 3, 1 + k, 1 + k) int rho f_a g_b."""
    centrifugal_tension: Floats
    """(k, k) what times the square of the spin speed is the stiffness of centrifugal tension."""
    turning: Floats
    """(k, k) antisymmetric S: a rotation by psi transforms the modes by exp(psi S)."""

    @property
    def frequencies(self) -> Floats:
        """Frequencies of the free body at rest, (k,), Hz."""
        return np.sqrt(self.stiffness / (1.0 + self.added_mass)) / (2.0 * np.pi)

    @property
    def centrifugal(self) -> Floats:
        """Steady force on the modes over the square of the spin speed, (k,): it widens and shortens a body."""
        load: Floats = self.second_moments[0, 0, 0, 1:] + self.second_moments[1, 1, 0, 1:]
        return load

    @property
    def spin_stiffness(self) -> Floats:
        """Stiffness over the square of the spin speed, (k, k): centrifugal tension; scaling masses do not spin."""
        square = self.turning @ self.turning
        return self.centrifugal_tension + 0.5 * (self.added_mass[:, None] * square + square * self.added_mass)

    @property
    def spin_damping(self) -> Floats:
        """Antisymmetric damping over the spin speed, (k, k): scaling masses do not spin with the frame."""
        return self.added_mass[:, None] * self.turning + self.turning * self.added_mass

    @property
    def at_seats(self) -> Floats:
        """Displacement and turns of the seats by mode, (6 s, k)."""
        return self.mode_coordinates[: BODY_SIZE * len(self.seats)]


@dataclass(frozen=True)
class ElasticBody(ReprMixin):
    """A reduced body of a gearbox."""

    reduced: ReducedBody
    """With the rigid inertia of the body's inertia set."""
    shape_inertia: RigidInertia
    """Rigid inertia of shape and blanks by themselves."""
    main_seat: str
    """Seat whose spin stands for the body: where torques act, else the first gear."""
    sectors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Seats on equal sectors by internal gear, an odd number, the first about +x, then on towards +y."""
    shared_seats: Mapping[str, str] = field(default_factory=dict)
    """Seat that a second bearing sits on, by the bearing."""
    floating: FloatingBody | None = None
    """Its modes in a frame that floats with it, for a body that moves so in Exudyn."""
    file_digest: str | None = None
    """SHA-256 of the file of a solid."""
    damping_time: float | None = None
    """Damping over stiffness, s; that of the gearbox by default."""
    loss_factor: float = 0.0
    """Of a body on the ground: its free modes have half of it as their damping ratio, in place of a damping time."""

    def _line(self) -> str:
        more = f", {len(self.sectors)} gears on sectors" if self.sectors else ""
        frame = ", floating frame" if self.floating is not None else ""
        return f" of {self.reduced!r}: main seat {self.main_seat}{more}{frame}"


def stated_damping(section: DampedBodySection) -> tuple[float | None, float]:
    """Damping time (s) and loss factor of a body, of which the file states one at most; as `ElasticBody` has them."""
    damping_time, loss_factor = section.damping_time_s, section.loss_factor
    return (damping_time, 0.0) if loss_factor is None else (0.0, loss_factor)


IDENTITY = np.eye(3)
"""Rotation by nothing."""


def skew(vectors: Floats) -> Floats:
    """Matrices (..., 3, 3) of the cross product with vectors (..., 3)."""
    matrices = np.zeros((*vectors.shape, 3))
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        matrices[..., a, b], matrices[..., b, a] = -vectors[..., c], vectors[..., c]
    return matrices


def euler_rotation(parameters: Floats) -> tuple[Floats, Floats]:
    """Rotation matrix (3, 3) of Euler parameters (4,), and matrix (3, 4) from their rates to the angular velocity."""
    scalar = parameters[0]
    vector = parameters[1:]
    cross = skew(vector)
    rates = np.empty((3, 4))
    rates[:, 0], rates[:, 1:] = -2.0 * vector, 2.0 * (scalar * IDENTITY + cross)
    return IDENTITY + 2.0 * scalar * cross + 2.0 * cross @ cross, rates


def tilts_and_spin(turns: Floats, near: float) -> tuple[Floats, Floats]:
    """Angles (s, 3) of turns Rx Ry Rz (s, 3, 3), spins nearest to an angle, and from angular velocities to rates."""
    a = np.arctan2(-turns[:, 1, 2], turns[:, 2, 2])
    b = np.arcsin(np.clip(turns[:, 0, 2], -1.0, 1.0))
    c = np.arctan2(-turns[:, 0, 1], turns[:, 0, 0])
    c += 2.0 * np.pi * np.round((near - c) / (2.0 * np.pi))
    ca = np.cos(a)
    sa = np.sin(a)
    cb = np.cos(b)
    sb = np.sin(b)
    rates = np.zeros((len(turns), 3, 3))
    rates[:, 0, 0] = 1.0
    rates[:, 0, 1], rates[:, 0, 2] = sa * sb / cb, -ca * sb / cb
    rates[:, 1, 1], rates[:, 1, 2] = ca, sa
    rates[:, 2, 1], rates[:, 2, 2] = -sa / cb, ca / cb
    return np.stack([a, b, c], axis=1), rates


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
    """Maps from the 7 + k coordinates of a floating frame to the n = 6 + k of the reduced body, and back.

    A floating frame's coordinates are the displacement of its centre, the change of its Euler parameters from
    (1, 0, 0, 0), and the modal coordinates.

    Raises
    ------
    ReductionError
        The body is not a body of revolution.
    """

    def __init__(self, body: FloatingBody) -> None:
        self.body = body
        orders, shapes = np.linalg.eigh(1j * body.turning)
        whole_orders = np.round(orders)
        remainder = np.abs(orders - whole_orders).max()
        if remainder > ORDER_TOLERANCE:
            raise ReductionError(
                f"body {body.name}: rotation changes its modes by {remainder:.1e}; it must be a body of revolution; "
                "refine the mesh"
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
            raise ReductionError(f"body {self.body.name}: tilts or deformations are not small")
        return q, np.asarray(np.linalg.lstsq(self.motion(q, rest, near).jacobian, velocities)[0], dtype=np.float64)
