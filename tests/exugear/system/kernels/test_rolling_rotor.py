"""A rotor on two bearings that follow their rollers: energy, eigenfrequencies, lines of passing rollers."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

from exugear.system.bearings.rolling.point_contact import rolling_arrays
from exugear.system.bearings.rolling.rows import RollingRow
from exugear.system.kernels.connectors import ConnectorArrays, add_connector_forces
from exugear.system.kernels.coordinates import InertiaArrays
from exugear.system.kernels.rolling import STORED, rolling_forces, rolling_memory, rolling_tangent

from ...cases.plain_connectors import add_forces
from ...cases.plain_motion import accelerations, kinetic_energies
from ...cases.rolling import BALLS, CYLINDRICAL

STEP = 1 / 60e3
MASS, TRANSVERSE, AXIAL_INERTIA = 400.0, 25.0, 5.0
PLACES = (-0.25, 0.3)
"""Of the bearings along the axis, m: not symmetric, so that all motions are coupled."""
PULL = np.array([0.0, -248e3, 0.0, 0.0, 0.0, 0.0])
"""N, a constant force at the mass centre."""
FLOOR = np.diag([0.0, 0.0, 1e8, 0.0, 0.0, 0.0])
"""Stiffness along the axis, which rollers leave free."""


@dataclass
class Rotor:
    """Rotor and its bearings; coordinates as in `exugear.system.kernels.coordinates`."""

    connectors: ConnectorArrays
    inertia: InertiaArrays

    def displacement(self, q: np.ndarray, n: int) -> np.ndarray:
        """Displacement (5,) of the rotor in bearing n, to first order."""
        x, y, z, a, b = q[:5]
        return np.array([x + PLACES[n] * b, y - PLACES[n] * a, z, a, b])

    def stiffness(self, q: np.ndarray) -> np.ndarray:
        """Tangent (5, 5) of both bearings about the mass centre."""
        total, tangent = np.zeros((5, 5)), np.empty((6, 6))
        for n, place in enumerate(PLACES):
            moves = np.eye(5)
            moves[0, 4], moves[1, 3] = place, -place
            rolling_tangent(n, self.displacement(q, n), q[5], self.connectors.rolling, tangent)
            total += moves.T @ (tangent + FLOOR)[:5, :5] @ moves
        return total

    def at_rest(self, pull: np.ndarray = PULL) -> np.ndarray:
        """Coordinates in balance with the force, by Newton's method from touching rollers."""
        q = np.array([0.0, -80e-6, 0.0, 0.0, 0.0, 0.0])
        for _ in range(40):
            f = pull.copy()
            add_connector_forces(q, np.zeros(6), self.connectors, f)
            q[:5] += np.linalg.solve(self.stiffness(q), f[:5])
        assert np.abs(f[:5]).max() < 1e-6
        return q

    def energy(self, q: np.ndarray, v: np.ndarray) -> float:
        """Kinetic, elastic and that of the force, J."""
        kinetic, forces = np.empty(1), rolling_memory(self.connectors.rolling)
        kinetic_energies(q, v, self.inertia, kinetic)
        total = kinetic[0] - PULL @ q + 0.5 * len(PLACES) * FLOOR[2, 2] * q[2] ** 2
        for n in range(len(PLACES)):
            rolling_forces(n, self.displacement(q, n), np.zeros(6), q[5], self.connectors.rolling, forces)
            total += forces[STORED]
        return total


def rotor(row: RollingRow, time: float = 0.0, cage_ratio: float = 0.0) -> Rotor:
    """Rotor on two bearings of one row each; cages as they stand by chance."""
    local = np.zeros((2, 2, 3))
    local[:, 1, 2] = PLACES
    node = np.zeros((2, 2, 3))
    node[:, 0, 2] = PLACES
    rolling = rolling_arrays([(row,), (row,)], [1.0, 1.0], [time] * 2, [cage_ratio] * 2, [0.05, 0.21])
    connectors = ConnectorArrays(
        bodies=np.array([[-1, 0], [-1, 0]]),
        local=local,
        node=node,
        stiffness=np.stack([FLOOR, FLOOR]),
        damping=time * np.stack([FLOOR, FLOOR]),
        point_strain=np.zeros((2, 6)),
        point_load=np.zeros((2, 6)),
        rolling=rolling,
    )
    one, none = np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64)
    inertia = InertiaArrays(one, np.array([MASS]), np.array([TRANSVERSE]), np.array([AXIAL_INERTIA]), none, np.zeros(0))
    return Rotor(connectors, inertia)


@numba.njit
def integrated(q, v, steps, connectors, inertia, pull):
    """States (steps + 1, 12) by the classical Runge-Kutta method."""
    out = np.empty((steps + 1, 12))
    out[0, :6], out[0, 6:] = q, v
    rates, f = np.empty((4, 12)), np.empty(6)
    for n in range(steps):
        for stage in range(4):
            share = 0.0 if stage == 0 else STEP if stage == 3 else 0.5 * STEP
            state = out[n] + share * rates[stage - 1] if stage > 0 else out[n].copy()
            f[:] = pull
            add_forces(state[:6], state[6:], connectors, f)
            rates[stage, :6] = state[6:]
            accelerations(state[:6], state[6:], inertia, f, rates[stage, 6:])
        out[n + 1] = out[n] + STEP / 6.0 * (rates[0] + 2.0 * rates[1] + 2.0 * rates[2] + rates[3])
    return out


@pytest.mark.validation
@pytest.mark.parametrize("cage_ratio", [pytest.param(0.0, marks=pytest.mark.long), 0.433])
def test_undamped_rotor_keeps_its_energy_over_a_second(cage_ratio: float) -> None:
    """Vibration of some um with clearance at 80 rad/s; what is left is the method's own, w h is up to 0.08."""
    case = rotor(CYLINDRICAL, cage_ratio=cage_ratio)
    rest = case.at_rest()
    q = rest + [2e-6, 3e-6, 1e-6, 8e-6, -6e-6, 0.0]
    spinning = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 80.0])
    states = integrated(q, spinning, 60000, case.connectors, case.inertia, PULL)
    vibration = case.energy(q, spinning) - case.energy(rest, spinning)
    change = case.energy(states[-1, :6], states[-1, 6:]) - case.energy(q, spinning)
    assert vibration > 0.02  # J
    assert np.ptp(states[:, 1]) > 3e-6
    assert abs(change) < 5e-4 * vibration
    if cage_ratio:  # without the torque on the spin the cage would have done work
        assert abs(states[-1, 11] - 80.0) * 80.0 * AXIAL_INERTIA > 1e-3 * vibration


@pytest.mark.parametrize("row", [pytest.param(CYLINDRICAL, marks=pytest.mark.validation), BALLS])
def test_small_vibration_has_the_eigenfrequencies_of_the_tangent(row: RollingRow) -> None:
    pull = PULL if row is CYLINDRICAL else 0.2 * PULL
    case = rotor(row)
    rest, mass = case.at_rest(pull), np.diag([MASS, MASS, MASS, TRANSVERSE, TRANSVERSE])
    squares, shapes = scipy.linalg.eigh(case.stiffness(rest), mass)
    for square, shape in zip(squares, shapes.T, strict=True):
        rate, start = np.sqrt(square), np.append(1e-9 * shape / np.abs(shape).max(), 0.0)
        steps = round(10 * 2.0 * np.pi / rate / STEP)
        states = integrated(rest + start, np.zeros(6), steps, case.connectors, case.inertia, pull)
        share = (states[:, :5] - rest[:5]) @ mass @ shape / (start[:5] @ mass @ shape)
        time = STEP * np.arange(steps + 1)
        (found,), _ = scipy.optimize.curve_fit(lambda t, w: np.cos(w * t), time, share, p0=[rate])
        assert found == pytest.approx(rate, rel=1e-4)


def test_passing_rollers_give_lines_at_their_rate_and_nowhere_else() -> None:
    """Z (1 - gamma) / 2 times the spin against a standing outer ring, here 100 a second."""
    ratio = 0.5 * (1.0 - CYLINDRICAL.diameter_ratio)
    speed = 2.0 * np.pi * 100.0 / (CYLINDRICAL.element_count * ratio)
    case = rotor(CYLINDRICAL, time=3e-4, cage_ratio=ratio)
    settle, window = 24000, 12000
    spinning = np.array([0.0, 0.0, 0.0, 0.0, 0.0, speed])
    states = integrated(case.at_rest(), spinning, settle + window, case.connectors, case.inertia, PULL)
    for coordinate in (0, 1, 3):
        motion = states[settle:-1, coordinate]
        lines = np.abs(np.fft.rfft(motion - motion.mean())) * 2.0 / window
        every = round(100.0 * window * STEP)
        own = np.zeros(len(lines), dtype=bool)
        own[every::every] = True
        assert lines[own].max() > 5e-9
        assert lines[~own][1:].max() < 1e-4 * lines[own].max()
