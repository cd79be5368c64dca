"""A gear that hammers: one degree of freedom with backlash and a stiffness that varies with the mesh.

The wheel of a spur pair against a pinion that turns uniformly (an inertia of 1e8 kg m2) is the oscillator

    m x'' + tau k(t) x' [in contact] + F(x, t) = F_0,   F = k(t) x, 0 in the backlash, k'(t) (x + b) beyond it,

of A. Kahraman and R. Singh, J. Sound Vib. 142 (1990) 49-75, and G. W. Blankenship and A. Kahraman, J. Sound Vib. 185
(1995) 743-765. Its second solution here shares nothing with the element: the stiffness is the formula that the table
was made from, contact begins and ends where SciPy's event location finds it, order 8 and tolerances of 1e-10.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.loads import LoadTable
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import CompiledSystem
from fe_ste.transmission_error.surface import SteSurface

from ...cases.spur import SPUR_CASE

MEAN, VARIATION, DAMPING_RATIO = 3e8, 0.3, 0.04
FORCE = 3000.0
PER_CYCLE = 512
"""Steps a mesh cycle: the step in which contact begins or ends costs the Runge-Kutta method its order."""


def compliance(pmc: float) -> float:
    """Deflection per load (m/N): the table's own, with two harmonics."""
    angle = 2.0 * math.pi * pmc
    return (1.0 + VARIATION * math.cos(angle) + 0.1 * VARIATION * math.cos(2.0 * angle + 0.7)) / MEAN


@dataclass(frozen=True)
class Oscillator:
    """The pair as an assembly, and the numbers of its equation."""

    assembly: Assembly
    mass: float
    damping_time: float
    backlash: float
    phase: float
    back_phase: float

    @property
    def natural_frequency(self) -> float:
        """Of the mean compliance, rad/s."""
        return math.sqrt(MEAN / self.mass)

    def torques(self) -> dict[str, float]:
        """Loads that press the loaded flanks with FORCE."""
        element = self.assembly.elements[0]
        pair = element.mesh.pair
        return {
            "shaft_1": element.flank * FORCE * pair.pinion.base_radius,
            "shaft_2": element.flank * FORCE * pair.gear.base_radius,
        }

    def by_element(self, x: float, v: float, omega: float, cycles: int, start: float) -> np.ndarray:
        """Deflection and its rate at PER_CYCLE points of each of some mesh cycles, from the compiled solver."""
        assembly, element = self.assembly, self.assembly.elements[0]
        radii = element.deflection[[5, 11]]
        turning = omega / (2.0 * math.pi * element.cycles)
        q, u = np.zeros(assembly.size), np.zeros(assembly.size)
        one, two = assembly.spin["shaft_1"], assembly.spin["shaft_2"]
        q[one] = start / element.cycles
        q[two], u[two] = (x - radii[0] * q[one]) / radii[1], (v - radii[0] * turning) / radii[1]
        u[one] = turning
        steps = cycles * PER_CYCLE
        states = np.empty((2, steps, assembly.size))
        step = 2.0 * math.pi / omega / PER_CYCLE
        CompiledSystem(assembly, q, u, LoadTable(self.torques()), step).advance(0, *states)
        return np.asarray(states[:, :, one] * radii[0] + states[:, :, two] * radii[1]).T

    def by_events(self, x: float, v: float, omega: float, cycles: int, start: float) -> np.ndarray:
        """The same by SciPy, stopping where contact begins and ends."""
        period = 2.0 * math.pi / omega
        times = period / PER_CYCLE * np.arange(1, cycles * PER_CYCLE + 1)
        found = np.empty((len(times), 2))
        now, state, done = 0.0, np.array([x, v]), 0
        while done < len(times):
            side = 1 if state[0] > 0.0 else -1 if state[0] < -self.backlash else 0
            if state[0] == 0.0:
                side = 1 if state[1] > 0.0 else 0
            elif state[0] == -self.backlash:
                side = -1 if state[1] < 0.0 else 0
            limits = {1: (0.0,), 0: (0.0, -self.backlash), -1: (-self.backlash,)}[side]
            events = [self._leaving(limit, side) for limit in limits]
            solution = solve_ivp(
                self._rate, (now, times[-1]), state, "DOP853", events=events, args=(side, omega, start),
                rtol=1e-10, atol=[1e-16, 1e-12], dense_output=True, max_step=0.1 * period,
            )  # fmt: skip
            end = solution.t[-1]
            count = int(np.searchsorted(times, end, side="right"))
            found[done:count] = solution.sol(times[done:count]).T
            done, now, state = count, end, solution.y[:, -1].copy()
            if done < len(times):
                hit = next(limit for limit, at in zip(limits, solution.t_events, strict=True) if len(at))
                state[0] = hit
        return found

    def _rate(self, t: float, y: np.ndarray, side: int, omega: float, start: float) -> list[float]:
        if side == 0:
            return [y[1], FORCE / self.mass]
        cycle = start + omega * t / (2.0 * math.pi)
        k = 1.0 / compliance(self.phase + cycle if side > 0 else self.back_phase - cycle)
        depth = y[0] if side > 0 else y[0] + self.backlash
        return [y[1], (FORCE - k * depth - self.damping_time * k * y[1]) / self.mass]

    @staticmethod
    def _leaving(limit: float, side: int) -> Callable[..., float]:
        def event(t: float, y: np.ndarray, *_: object) -> float:
            return float(y[0] - limit)

        event.terminal = True
        event.direction = -side if side else (1.0 if limit == 0.0 else -1.0)
        return event


@pytest.fixture(scope="module")
def oscillator() -> Oscillator:
    content = tomllib.loads(SPUR_CASE)
    content["bodies"]["shaft_1"]["inertia"]["disc"] |= {"axial_kg_m2": 1e8, "transverse_kg_m2": 1e8}
    for gear in content["gears"].values():
        gear["tooth_thinning_mm"] = 0.012
    gearbox = Gearbox.from_dict(content)
    pair = gearbox.gear_pairs["spur"]
    mass = gearbox.body("shaft_2").axial / pair.gear.base_radius**2
    time = 2.0 * DAMPING_RATIO / math.sqrt(MEAN / mass)
    gearbox = gearbox.varied({"damping.mesh_time_s": time})
    positions = np.array([compliance(p / 50) for p in range(50)])[:, None, None, None]
    surface = SteSurface.from_nodes([0.075], [0.0], [FORCE], positions * FORCE, 1.0 / positions)
    assembly = assemble(gearbox, Choice("rigid", "table"), {"spur": surface})
    table = assembly.elements[0].table
    assert table is not None
    return Oscillator(assembly, mass, time, table.backlash, assembly.elements[0].phase, table.back_phase)


def settled(oscillator: Oscillator, method: str, ratio: float, state: np.ndarray, cycles: int) -> np.ndarray:
    """Motion over the last eight cycles at one frequency ratio, started from a state at the start of a cycle."""
    move = oscillator.by_element if method == "element" else oscillator.by_events
    omega = ratio * oscillator.natural_frequency
    return move(float(state[0]), float(state[1]), omega, cycles, 0.0)[-8 * PER_CYCLE :]


def rms(motion: np.ndarray) -> float:
    return float(np.std(motion[:, 0]))


def at_rest() -> np.ndarray:
    return np.array([FORCE / MEAN, 0.0])


def test_element_and_event_location_agree_cycle_by_cycle(oscillator: Oscillator) -> None:
    """From rest through loss of contact and the other flank, before differences could grow."""
    omega = 0.8 * oscillator.natural_frequency
    one, two = (
        move(float(at_rest()[0]), 0.0, omega, 12, 0.0) for move in (oscillator.by_element, oscillator.by_events)
    )
    assert two[:, 0].min() < 0.0  # contact is lost
    # Each passage of an edge costs the fixed step h^2 of the jump in acceleration: (2 pi / 512)^2 / 8 of the motion.
    assert np.abs(one[:, 0] - two[:, 0]).max() < 2e-4 * np.ptp(two[:, 0])


RISING = np.round(np.r_[0.40:0.84:0.04, 0.84:0.90:0.005, 0.92:1.5:0.06, 1.5:2.35:0.05], 4)
FALLING = np.round(np.r_[2.3:1.45:-0.05, 1.4:0.88:-0.06, 0.86:0.68:-0.005, 0.66:0.39:-0.04], 4)
"""Frequency ratios, in steps of 0.005 about the folds of the first resonance."""
HALVED = np.round(np.r_[2.3:1.6:-0.05], 4)
FIRST_FOLD = np.round(np.r_[0.72:0.84:0.04, 0.84:0.90:0.005, 0.92:1.1:0.06], 4)


@pytest.mark.validation
@pytest.mark.parametrize(
    ("ratios", "least_jumps", "least_points"),
    [
        pytest.param(FIRST_FOLD, 1, 12, id="first fold"),
        pytest.param(HALVED, 0, 8, id="half the mesh frequency"),
        pytest.param(RISING, 2, 30, id="rising", marks=pytest.mark.long),
        pytest.param(FALLING, 2, 30, id="falling", marks=pytest.mark.long),
    ],
)
def test_sweeps_jump_part_and_halve_as_the_reference_does(
    oscillator: Oscillator, ratios: np.ndarray, least_jumps: int, least_points: int
) -> None:
    """0.1 % of rms off the folds, folds within 0.005 of the natural frequency."""
    ours, reference = (_sweep(oscillator, method, ratios) for method in ("element", "events"))
    jumps, expected = _jumps(ours[:, 0]), _jumps(reference[:, 0])
    assert len(jumps) == len(expected) >= least_jumps
    assert np.abs(ratios[jumps] - ratios[expected]).max() <= 0.005 + 1e-9
    near_fold = np.zeros(len(ratios), dtype=bool)
    for jump in (*jumps, *expected):
        near_fold[jump : jump + 3] = True  # the first points on the new branch still settle
    off = ~near_fold
    assert off.sum() > least_points
    assert np.abs(ours[off, 0] / reference[off, 0] - 1.0).max() < 1e-3
    # Share of time apart, counted on 512 points of a cycle, two edges a passage.
    assert np.abs(ours[off, 1] - reference[off, 1]).max() < 5e-3
    assert np.array_equal(ours[off, 2] > 0.5, reference[off, 2] > 0.5)
    if ratios is FALLING or ratios is HALVED:
        assert (reference[:, 2] > 0.5).any()  # half the mesh frequency, near twice the natural one
    if ratios is FALLING:
        assert reference[:, 3].min() < -oscillator.backlash  # the other flank is struck


@pytest.mark.validation
def test_resonance_softens_where_contact_is_lost(oscillator: Oscillator) -> None:
    """Between the folds the falling sweep stays on the upper branch, the rising one on the lower."""
    rising, falling = (_sweep(oscillator, "element", ratios)[:, 0] for ratios in (RISING, FALLING))
    both = np.intersect1d(RISING, FALLING)
    between = both[(both > 0.83) & (both < 0.86)]
    assert len(between) >= 4
    upper = [float(falling[np.flatnonzero(ratio == FALLING)[0]]) for ratio in between]
    lower = [float(rising[np.flatnonzero(ratio == RISING)[0]]) for ratio in between]
    assert np.all(np.array(upper) > 2.0 * np.array(lower))


def _sweep(oscillator: Oscillator, method: str, ratios: np.ndarray) -> np.ndarray:
    """Level, share of time apart, halved part, lowest deflection at each ratio, each started where the last ended."""
    state, lines = at_rest(), []
    for ratio in ratios:
        motion = settled(oscillator, method, float(ratio), state, 60)
        lines.append([rms(motion), float(np.mean(motion[:, 0] <= 0.0)), _halved(motion), float(motion[:, 0].min())])
        state = motion[-1]
    return np.array(lines)


def _jumps(level: np.ndarray) -> np.ndarray:
    """Numbers of the points before a change of level that no continuous branch has over so small a step."""
    return np.flatnonzero(np.maximum(level[1:] / level[:-1], level[:-1] / level[1:]) > 1.8)


def _halved(motion: np.ndarray) -> float:
    """Part of the motion that returns every second cycle only."""
    spectrum = np.abs(np.fft.rfft(motion[:, 0] - motion[:, 0].mean()))
    return float(spectrum[4] / spectrum.max())  # eight cycles: line 4 is half the mesh frequency
