"""Runs in time at constant speed until the motion repeats, and the lines of what they settle to.

Where a branch of steady states ends in a fold, the gearbox jumps: no state lies near the last one, and Newton's method
has nowhere to start. A run of the compiled solver from the last state goes where the gearbox goes. A soft spring to a
machine of constant speed holds the mean speed; what it carries in the mean is the torque that keeps it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exugear.steady.harmonics.lines import LineSet
from exugear.steady.mean_system.mean_system import MeanSystem
from exugear.steady.mean_system.rotating_frame import RotatingFrame
from exugear.system.kernels.coordinates import TILT
from exugear.system.loads import Drive, LoadTable
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import CompiledSystem, unsupported_reason
from fe_ste.tools.arrays import Complexes, Floats


def frame_coordinates(frame: RotatingFrame, q: Floats, psi: Floats) -> Floats:
    """Coordinates u (s, size) in the rotating frame: what `RotatingFrame.state` makes q (s, size) of, turned round.

    Parameters
    ----------
    q : (s, size) coordinates of the assembly, m and rad
    psi : (s,) angles of the overall input, rad
    """
    assembly = frame.assembly
    still = np.zeros(frame.assembly.size)
    u = q - np.outer(psi, assembly.rolling_velocity(still, frame.speeds))
    bend = assembly.rolling_acceleration(still, frame.speeds, dict.fromkeys(frame.speeds, 0.0))
    for planets, coordinates in frame.rings:
        turned = planets.ratio * psi
        # Displacements and tilts turn from fixed axes to radius and tangent.
        for angle, places in zip(planets.angles, coordinates, strict=True) if coordinates[0, 0] >= 0 else ():
            along = places[:2]
            # The centripetal acceleration points back along the radius.
            radius = -bend[along] / planets.ratio**2 if planets.ratio else np.zeros(2)
            u[:, along] = q[:, along] - _rotated(np.broadcast_to(radius, (len(psi), 2)), turned) + radius
            for first in (0, TILT):
                at = places[first : first + 2]
                u[:, at] = _rotated(u[:, at], -(turned + angle))
        shapes = planets.values(turned)
        back = shapes / (shapes**2).sum(axis=1, keepdims=True)
        for axis in range(coordinates.shape[1]):
            if coordinates[0, axis] >= 0:
                u[:, coordinates[:, axis]] = np.einsum("spw,sp->sw", back, u[:, coordinates[:, axis]])
    for carrier in frame.carriers:
        modal = assembly.elastic_slices[carrier.name].start + carrier.modal
        modes = np.array([carrier.turned(float(angle))[0] for angle in psi])
        u[:, modal] = np.linalg.solve(modes, u[:, modal, None])[..., 0]
    return u


def _rotated(plane: Floats, angle: Floats) -> Floats:
    """Vectors (s, 2) turned by angles (s,)."""
    c = np.cos(angle)
    s = np.sin(angle)
    return np.stack([c * plane[:, 0] - s * plane[:, 1], s * plane[:, 0] + c * plane[:, 1]], axis=1)


PERIODS = 80
"""Periods of the slowest base in one leg of a run; lines are fitted over its second half."""
STEPS_PER_PERIOD = 100.0
"""Steps in a period of the fastest base at least."""
STEPS_PER_RADIAN = 1.2
"""Steps in a radian of the fastest motion at least: the Runge-Kutta method is stable at 0.4."""
MOST_STEPS = 60_000
"""Steps in a leg at most."""
HELD, HELD_LATER = 0.005, 0.0005
"""Natural frequency of rolling on the spring of the drive, over the slowest base: in the first leg, and later ones.

Its damper takes part in the vibration, as a damping ratio of 0.7 times as much."""
SAMPLES_PER_UNKNOWN = 8
REPEATING = 0.05
"""Share of the vibration outside the lines up to which a motion counts as made of them."""


@dataclass(frozen=True, eq=False)
class SettlingSegment:
    """What a leg of a run ended in."""

    motion: Complexes
    """(n, size) lines of the motion in the rotating frame; the first row is the mean, whole."""
    outside: float
    """Share of the vibration that is not in the lines, root mean square."""
    doubled: float
    """The same when lines halfway between them are added."""

    @property
    def verdict(self) -> str:
        """Kind of motion, as text."""
        if self.outside < REPEATING:
            return "the time-domain motion is periodic"
        if self.doubled < 0.3 * self.outside:
            return (
                f"the time-domain motion repeats after two mesh periods ({100.0 * self.outside:.2g} % of the "
                "vibration is at half orders)"
            )
        return (
            f"the time-domain motion is not periodic ({100.0 * self.outside:.2g} % of the vibration is not in the "
            "spectral lines)"
        )


def cannot_settle(system: MeanSystem) -> str:
    """Say why no run in time is to be had, empty if there is one."""
    return unsupported_reason(system.frame.assembly)


class SettlingRun:
    """A gearbox in motion at one speed, leg by leg.

    Parameters
    ----------
    rows : (m, size) rows of the mesh deflections, in which it is judged whether a motion repeats
    bases : (bases,) mesh frequencies over the frequency of the input's turns
    speed : of the overall input, rad/s
    motion : (n, size) lines of the motion to start from, in the rotating frame about the static state
    assembly : in motion; by default that of the averaged system, whose gears have no deviations
    """

    def __init__(
        self,
        system: MeanSystem,
        lines: LineSet,
        rows: Floats,
        bases: Floats,
        speed: float,
        motion: Complexes,
        assembly: Assembly | None = None,
    ) -> None:
        self._system, self._lines, self._rows = system, lines, rows
        frame = system.frame
        self._assembly = assembly = assembly or frame.assembly
        slowest = float(bases.min()) * abs(speed)
        fastest = float(bases.max()) * abs(speed)
        rate = float(np.abs(system.eigenvalues(speed)).max())
        self._step = min(2.0 * np.pi / fastest / STEPS_PER_PERIOD, 1.0 / (STEPS_PER_RADIAN * rate))
        self._steps = min(MOST_STEPS, int(PERIODS * 2.0 * np.pi / slowest / self._step))
        w = abs(speed) * lines.orders[1:, None]
        u = system.static_at(speed) + motion[0].real + 2.0 * motion[1:].sum(axis=0).real
        q, v, _ = frame.state(0.0, speed, u, 2.0 * (1j * w * motion[1:]).sum(axis=0).real)
        self._torques = dict(assembly.gearbox.case.static_load.torques_N_m)
        locked = assembly.gearbox.locked
        self._keeper = locked[0] if locked else assembly.gearbox.case.overall.input
        self._torques[self._keeper] = self._torques.get(self._keeper, 0.0) + system.torque_at(speed)
        self._rolling = np.linalg.solve(
            frame.matrices(0.0)[0], assembly.rolling_velocity(np.zeros(assembly.size), frame.speeds)
        )
        self._inertia = float(self._rolling @ system.mass @ self._rolling)
        self._slowest, self._speed, self._done = slowest, speed, 0
        self._state, self._held = (q, v), HELD

    def leg(self) -> SettlingSegment | None:
        """Run on, and fit the lines over the second half; None where the motion is not finite."""
        assembly = self._assembly
        pinned = self._system.pinned
        q, v = self._state
        rate = self._held * self._slowest
        stiffness = self._inertia * rate**2
        damping = 1.4 * self._inertia * rate
        law = (float(q[pinned]), self._speed, 0.0)
        drive = Drive(assembly.gearbox.case.overall.input, stiffness, damping, law)
        loads = LoadTable(self._torques, drive=drive, varying=assembly.varying_loads)
        run = CompiledSystem(assembly, q, v, loads, self._step)
        states = np.empty((self._steps, assembly.size))
        speeds = np.empty_like(states)
        if run.advance(0, states, speeds) < self._steps:
            return None
        self._state = states[-1].copy(), speeds[-1].copy()
        half = self._steps // 2
        time = self._step * np.arange(1.0 + half, 1.0 + self._steps)
        spin = states[half:, pinned]
        # What the drive carried, and what would have been needed to keep the speed, goes to the torque from now on.
        bend, slope, _ = np.polyfit(time - time.mean(), spin, 2)
        carried = stiffness * float(np.mean(law[0] + law[1] * time - spin)) + damping * (self._speed - slope)
        missing = carried - self._inertia * 2.0 * bend
        self._torques[self._keeper] += missing / float(self._system.drive @ self._rolling)
        self._held = HELD_LATER
        return self._fitted(time, states[half:])

    def _fitted(self, time: Floats, states: Floats) -> SettlingSegment:
        """Lines of the motion in given states (s, size)."""
        spin = states[:, self._system.pinned]
        speed, start = np.polyfit(time, spin, 1)
        lines = self._lines
        # Lines that the step does not resolve are left out.
        seen = 1 + np.flatnonzero(lines.orders[1:] * abs(speed) * self._step < 0.5)
        count = min(len(time), 4 * SAMPLES_PER_UNKNOWN * (2 * len(seen) + 1))
        # Instants at random have no aliases.
        at = np.sort(np.random.default_rng(0).choice(len(time), count, replace=False))
        psi = speed * time[at] + start
        u = frame_coordinates(self._system.frame, states[at], psi)
        turned = np.copysign(1.0, speed) * np.outer(psi, lines.orders[seen])
        found, rest = _fit(turned, u)
        between = turned - 0.5 * turned[:, :1]
        size = float(np.linalg.norm((u - u.mean(axis=0)) @ self._rows.T))
        outside = float(np.linalg.norm(rest @ self._rows.T)) / size
        doubled = outside
        if lines.index.shape[1] == 1 and outside > REPEATING:
            doubled = float(np.linalg.norm(_fit(np.hstack([turned, between]), u)[1] @ self._rows.T)) / size
        motion = np.zeros((len(lines.orders), u.shape[1]), dtype=complex)
        motion[0], motion[seen] = found[0], found[1:]
        return SettlingSegment(motion, outside, doubled)


def _fit(angles: Floats, values: Floats) -> tuple[Complexes, Floats]:
    """Lines (1 + n, ...) at angles (s, n) in values (s, ...), the mean first, and what of the values is in none."""
    columns = np.hstack([np.ones((len(angles), 1)), np.cos(angles), -np.sin(angles)])
    found = np.linalg.lstsq(columns, values, rcond=1e-3)[0]
    count = angles.shape[1]
    lines = np.vstack([found[:1].astype(complex), 0.5 * (found[1 : count + 1] + 1j * found[count + 1 :])])
    return lines, values - columns @ found
