"""Methods of time integration: orders, stability of whole systems, starts, jumps of load, heavy damping."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.loads import LoadTable
from exugear.system.statics import accelerating_start, linearise
from exugear.system.system import Assembly
from exugear.transient.compiled.integrator import (
    CORRECT_POSITION,
    CORRECT_VELOCITY,
    EXTRAPOLATE,
    MARGIN,
    ORDERS,
    PREDICT_POSITION,
    PREDICT_VELOCITY,
    RUNGE_KUTTA,
    Method,
    adams,
    ahead_of_correction,
    choose_integration,
    eigenvalues,
    forced_error,
    growth,
    resonance_error,
    stabilised,
)
from exugear.transient.compiled.solver import CompiledSystem

LOAD = {"carrier": 240e3, "hss": -2.9e3}
"""N m."""
STEP = 1.0 / 60e3


def test_predictor_of_velocities_is_that_of_adams_and_bashforth() -> None:
    """Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, table III.1.1 and equation III.1.5."""
    assert adams(4).weights[PREDICT_VELOCITY] == pytest.approx(np.array([55, -59, 37, -9]) / 24, abs=1e-13)
    # The term of order k + 1 of Adams and Moulton with the newest acceleration corrected once: 251/720 for k = 4.
    assert adams(4).correction[CORRECT_VELOCITY] == pytest.approx(251 / 720, abs=1e-13)
    # Stoermer's double integral of the backward differences: 1/2, 1/6, 1/8, 19/180 and, of the fifth, 3/32.
    assert adams(2).weights[PREDICT_POSITION] == pytest.approx([1 / 2 + 1 / 6, -1 / 6], abs=1e-14)
    assert adams(4).correction[CORRECT_POSITION] == pytest.approx(3 / 32, abs=1e-13)


def oscillation(method: Method, angle: float, turns: int) -> float:
    """Error of an undamped oscillator after whole turns, steps of an angle (rad), begun on the exact solution."""
    matrix = whole_recurrence(method, np.eye(1), np.zeros((1, 1)), np.ones((1, 1)), angle)
    past = np.arange(method.points)
    state = np.concatenate([[0.0], [1.0], -(angle**2) * np.cos(angle * past)])
    for _ in range(round(2.0 * np.pi * turns / angle)):
        state = matrix @ state
    return float(abs(state[1] - 1.0))


def whole_recurrence(method: Method, mass: NDArray, damping: NDArray, stiffness: NDArray, step: float) -> NDArray:
    """Matrix that a step applies to all of h v, q and h^2 times the last accelerations of a linear system."""
    size, count = len(mass), method.points
    one = np.eye(size)
    velocity = np.hstack([one, 0.0 * one, *(w * one for w in method.weights[PREDICT_VELOCITY])])
    position = np.hstack([one, one, *(w * one for w in method.weights[PREDICT_POSITION])])
    acceleration = -np.linalg.solve(mass, step**2 * stiffness @ position + step * damping @ velocity)
    extrapolated = np.hstack([0.0 * one, 0.0 * one, *(w * one for w in method.weights[EXTRAPOLATE])])
    difference = acceleration - extrapolated
    shift = np.eye(size * (count - 1), size * (count + 2), 2 * size)
    return np.vstack(
        [
            velocity + method.correction[CORRECT_VELOCITY] * difference,
            position + method.correction[CORRECT_POSITION] * difference,
            acceleration,
            shift,
        ]
    )


@pytest.mark.parametrize("order", ORDERS)
def test_errors_fall_with_the_order_of_the_method(order: int) -> None:
    coarse, fine = (oscillation(adams(order), 2.0 * np.pi / n, turns=1) for n in (80, 160))
    # Order k + 1 at least: velocities are corrected by one more node than they are predicted with.
    assert coarse / fine > 0.8 * 2.0 ** (order + 1)


def test_stabilised_method_is_of_order_4_and_stable_at_steps_longer_by_a_fifth() -> None:
    """For damping ratios of 2 to 5 %; the limit of Adams' method is the first angle at which a motion grows."""
    coarse, fine = (oscillation(stabilised(), 2.0 * np.pi / n, turns=1) for n in (80, 160))
    assert 0.8 * 2.0**4 < coarse / fine < 1.2 * 2.0**5
    angles = np.linspace(0.1, 1.0, 91)
    for damping in (0.02, 0.033, 0.05):
        limits = []
        for method in (adams(4), stabilised()):
            grows = np.abs(growth(method, angles * motion(damping), 1.0)).max(axis=1) > 1.0
            limits.append(angles[np.argmax(grows)])
        assert limits[1] > 1.2 * limits[0]


def motion(damping: float) -> complex:
    """Eigenvalue of an oscillator in units of its rate."""
    return -damping + 1j * float(np.sqrt(1.0 - damping**2))


@pytest.mark.parametrize("method", [adams(4), adams(5), adams(6), stabilised()], ids=lambda method: method.name)
@pytest.mark.parametrize("lag", [0.0, 0.3])
def test_predicted_states_are_ahead_of_corrected_ones_as_the_method_says(method: Method, lag: float) -> None:
    """One step from the exact past of a motion exp(i w t), whose accelerations are -w^2 times itself."""
    angle = 0.5
    past = -(angle**2) * np.exp(-1j * angle * np.arange(method.points))
    velocity = 1j * angle + method.weights[PREDICT_VELOCITY] @ past
    position = 1.0 + 1j * angle + method.weights[PREDICT_POSITION] @ past
    difference = -(angle**2) * np.exp(1j * angle) - method.weights[EXTRAPOLATE] @ past
    predicted = position + lag * velocity
    corrected = (position + method.correction[CORRECT_POSITION] * difference) + lag * (
        velocity + method.correction[CORRECT_VELOCITY] * difference
    )
    ahead = ahead_of_correction(method, np.array([angle]), lag)[0]
    # The corrected state is the exact one but for the error of a step.
    assert predicted / corrected - 1.0 == pytest.approx(ahead, rel=0.02)
    assert abs(ahead) > 1e-4
    assert ahead_of_correction(RUNGE_KUTTA, np.array([angle]), lag)[0] == 0.0


@pytest.mark.parametrize("damping", [0.0, 0.01, 0.02, 0.03, 0.04])
def test_stabilised_method_follows_motions_up_to_half_a_radian_a_step(damping: float) -> None:
    """By its docstring to 1.3e-5 and 1.5e-5 of their rates; amounts of an oscillation over 40 steps tell it again."""
    angles = np.linspace(0.05, 0.503, 40)
    exact = angles * motion(damping)
    made = growth(stabilised(), exact, 1.0)[:, 0]
    made = np.where(made.imag < 0.0, made.conj(), made)
    assert np.abs(np.log(made) - exact).max() < 1.6e-5 * 0.503
    assert (np.abs(np.log(made) - exact) < 1.6e-5 * angles).all()
    # The state after 40 steps from the exact past, of which the parasitic motions take a share once.
    angle, method = 0.5, stabilised()
    matrix = whole_recurrence(method, np.eye(1), 2.0 * damping * np.eye(1), np.eye(1), angle)
    rate = angle * motion(damping)
    past = rate**2 * np.exp(-rate * np.arange(method.points))
    state = np.concatenate([[rate, 1.0], past])
    for _ in range(40):
        state = matrix @ state
    assert abs(state[1] - np.exp(40.0 * rate)) < 1e-2


@pytest.mark.parametrize("damping", [0.02, 0.027, 0.035])
def test_stabilised_method_is_stable_as_far_as_it_says(damping: float) -> None:
    angles = np.linspace(0.01, 0.863, 200)
    assert np.abs(growth(stabilised(), angles * motion(damping), 1.0)).max() < 1.0


@pytest.mark.parametrize("rate", [0.1, 0.3, 0.45, 0.55])
@pytest.mark.parametrize("method", [RUNGE_KUTTA, stabilised(), adams(4)], ids=lambda method: method.name)
def test_expected_error_of_a_resonance_is_the_one_it_makes(method: Method, rate: float) -> None:
    """Oscillators of 2 % damping, excited in turn at frequencies up to the end of a band at w h = 0.5."""
    damping, end = 0.02, 0.5
    excitation = np.unique(np.append(np.linspace(0.9, 1.1, 41) * rate, end))
    excitation = excitation[excitation <= end]
    wrong = np.abs(answer(method, rate, damping, excitation) - exact_answer(rate, damping, excitation))
    peak = np.abs(exact_answer(rate, damping, np.array([rate]))).max()
    expected = resonance_error(method, np.array([rate * motion(damping)]), 1.0, end / (2.0 * np.pi))
    # The forcing has an error of its own, which is not of the resonance: less than a third of it here.
    assert (wrong / peak).max() < 1.3 * expected
    if rate < end:  # an upper bound for those above the band
        assert (wrong / peak).max() > 0.7 * expected


def exact_answer(rate: float, damping: float, excitation: NDArray) -> NDArray:
    """Amplitudes of displacement per unit force and mass."""
    return np.asarray(1.0 / (rate**2 - excitation**2 + 2j * damping * rate * excitation))


def answer(method: Method, rate: float, damping: float, excitation: NDArray) -> NDArray:
    """The same by a method with steps of 1, at the states at which it evaluates."""
    turn = np.exp(1j * excitation)
    if method is RUNGE_KUTTA:
        system = np.array([[0.0, 1.0], [-(rate**2), -2.0 * damping * rate]])
        return np.array([runge_kutta_answer(system, z) for z in turn])
    past = turn[:, None] ** -np.arange(method.points)
    of_v, of_q, ahead = (past @ row for row in method.weights)
    velocity = (of_v + method.correction[CORRECT_VELOCITY] * (turn - ahead)) / (turn - 1.0)
    position = (velocity + of_q + method.correction[CORRECT_POSITION] * (turn - ahead)) / (turn - 1.0)
    # Of the predicted state a step on, per acceleration there.
    velocity, position = (velocity + of_v) / turn, (position + velocity + of_q) / turn
    return np.asarray(position / (1.0 + rate**2 * position + 2.0 * damping * rate * velocity))


def runge_kutta_answer(system: NDArray, turn: complex) -> complex:
    """Displacement of the steady state under a force that turns by a factor in each step."""
    one, force, half = np.eye(2), np.array([0.0, 1.0]), np.sqrt(turn)
    first = (system, force)
    second = (system @ (one + 0.5 * first[0]), 0.5 * system @ first[1] + half * force)
    third = (system @ (one + 0.5 * second[0]), 0.5 * system @ second[1] + half * force)
    fourth = (system @ (one + third[0]), system @ third[1] + turn * force)
    weighted = list(zip((1, 2, 2, 1), (first, second, third, fourth), strict=True))
    step, push = (sum(weight * part[n] for weight, part in weighted) / 6.0 for n in (0, 1))
    return complex(np.linalg.solve((turn - 1.0) * one - step, push)[0])


@pytest.mark.parametrize("variant", ["rigid", "bushing"])
def test_roots_of_single_motions_are_those_of_the_whole_system(grc: Gearbox, stiffness: dict, variant: str) -> None:
    """Damping of the GRC is in proportion within its elements only: motions by themselves must still tell enough."""
    assembly = assemble(grc, Choice(variant), stiffness)
    chosen = choose_integration(assembly, 20e3, 6.4e3, integrator="adams")
    linear = linearise(assembly.unloaded, np.zeros(assembly.size), assembly.linear_meshes())
    free = assembly.motions
    matrices = [free.T @ m @ free for m in (linear.mass, linear.total_damping, linear.total_stiffness)]
    whole = whole_recurrence(chosen.method, *matrices, chosen.step)
    largest = np.abs(np.linalg.eigvals(whole)).max()
    assert largest < 1.0 + 1e-6  # the train rolls: a double root at one, whose rounding goes with a square root
    faster = whole_recurrence(chosen.method, *matrices, 1.3 * chosen.margin * chosen.step)
    if chosen.margin < 3.0:
        assert np.abs(np.linalg.eigvals(faster)).max() > 1.0 + 1e-3


def test_heavy_damping_shortens_the_steps_of_multistep_methods() -> None:
    lightly, critically = np.array([0.2 * (-0.02 + 1j)]), np.array([-0.2 + 0j])
    for method in map(adams, ORDERS):
        assert np.abs(growth(method, lightly, 1.0)).max() < 1.0
        assert np.abs(growth(method, critically, 1.0)).max() > 1.0
    assert np.abs(growth(RUNGE_KUTTA, critically, 1.0)).max() < 1.0


def test_a_dashpot_leads_back_to_the_runge_kutta_method(grc: Gearbox, stiffness: dict) -> None:
    assembly = assemble(grc, Choice("bushing"), stiffness)
    damping = assembly.connectors.damping.copy()
    damping[-1, 0, 0] = 2e7  # the high-speed shaft of some 100 kg in a dashpot: 2e5 1/s
    chosen = choose_integration(
        replace(assembly, connectors=assembly.connectors._replace(damping=damping)), 20e3, 6.4e3
    )
    assert chosen.method.name == "RK4"
    assert chosen.margin >= MARGIN


def test_a_step_that_is_asked_for_is_taken_by_the_method_that_is_accurate_with_it(
    grc: Gearbox, stiffness: dict
) -> None:
    assembly = assemble(grc, Choice("bushing"), stiffness)
    assert choose_integration(assembly, 20e3, 6.4e3, step=STEP).method.name == "Adams of order 5"
    assert choose_integration(assembly, 20e3, 6.4e3, step=STEP, integrator="rk4").method.name == "RK4"
    coarse = choose_integration(assembly, 20e3, 6.4e3, step=5e-5)
    assert coarse.method.name == "RK4" and not coarse.is_accurate


@pytest.mark.parametrize("frequency", [1e3, 3e3, 6.4e3])
@pytest.mark.parametrize("method", [RUNGE_KUTTA, stabilised(), *map(adams, ORDERS)], ids=lambda method: method.name)
def test_expected_error_of_a_forced_mass_is_the_one_it_makes(method: Method, frequency: float) -> None:
    """A mass under a force alone, integrated step by step."""
    angle, steps = 2.0 * np.pi * frequency * STEP, 4000
    time = angle * np.arange(-method.points - 1, steps + 1)
    force = np.exp(1j * time)
    q, v = -force.copy(), -1j * force  # h v and q in units of the square of the step over that of the angle
    for n in range(method.points + 1, len(time) - 1):
        a, h = force[n - np.arange(method.points)], angle
        if method.is_multistep:
            difference = force[n + 1] - method.weights[EXTRAPOLATE] @ a
            v[n + 1] = v[n] + h * (method.weights[PREDICT_VELOCITY] @ a + method.correction[0] * difference)
            of_q = method.weights[PREDICT_POSITION] @ a + method.correction[1] * difference
        else:
            middle = np.exp(1j * (time[n] + 0.5 * h))
            v[n + 1] = v[n] + h / 6.0 * (force[n] + 4.0 * middle + force[n + 1])
            of_q = (force[n] + 2.0 * middle) / 6.0
        q[n + 1] = q[n] + h * v[n] + h**2 * of_q
    # What is left of the start drifts in a straight line.
    settled = slice(steps // 2, None)
    shapes = np.stack([force, np.ones(len(time)), time], axis=1)[settled]
    amplitude = abs(np.linalg.lstsq(shapes, q[settled], rcond=None)[0][0])
    assert amplitude - 1.0 == pytest.approx(forced_error(method, angle), rel=1e-3, abs=1e-9)


def states(assembly: Assembly, step: float, method: Method, end: float, loads: LoadTable | None = None) -> NDArray:
    """Coordinates at the end of a run from a start in balance."""
    start = accelerating_start(assembly, LOAD, 20.0)
    steps = round(end / step)
    q, v = np.empty((2, steps, assembly.size))
    system = CompiledSystem(assembly, start.q, start.v, loads or LoadTable(LOAD), step, method)
    assert system.advance(0, q, v) == steps
    return q


def test_a_run_starts_at_the_accuracy_that_it_goes_on_with(grc: Gearbox, stiffness: dict) -> None:
    assembly = assemble(grc, Choice("bushing"), stiffness)
    exact = states(assembly, STEP / 8, RUNGE_KUTTA, 0.01)[7::8]
    moved = np.abs(exact - exact[0]).max(axis=0)
    error = np.abs(states(assembly, STEP, adams(5), 0.01) - exact) / np.maximum(moved, 1e-9)
    # The first steps are the Runge-Kutta method's, four in place of one. Later ones follow the third harmonic of the
    # mesh at 17 kHz, 3.5 steps a cycle, no closer than this.
    assert error[:4].max() < 1e-5
    assert error.max() < 2e-3


def test_a_jump_of_load_costs_no_more_than_a_step_of_it(grc: Gearbox, stiffness: dict) -> None:
    """The torque on the high-speed shaft falls to a half within a microsecond, amid a step."""
    assembly = assemble(grc, Choice("bushing"), stiffness)
    at = 0.00301
    series = {"hss": (np.array([0.0, at, at + 1e-6, 1.0]), LOAD["hss"] * np.array([1.0, 1.0, 0.5, 0.5]))}
    loads = LoadTable({"carrier": LOAD["carrier"]}, series)
    exact = states(assembly, STEP / 32, RUNGE_KUTTA, 0.012, loads)[31::32]
    moved = np.abs(exact - exact[0]).max(axis=0)
    errors = {
        method.name: (np.abs(states(assembly, STEP, method, 0.012, loads) - exact) / np.maximum(moved, 1e-9)).max()
        for method in (RUNGE_KUTTA, adams(5))
    }
    # Both see the jump somewhere within a step; the next steps must not ring.
    assert errors["Adams of order 5"] < 3.0 * errors["RK4"]


def test_eigenvalues_take_meshes_at_their_stiffest(grc: Gearbox, stiffness: dict) -> None:
    wave = 1.0 + 0.44 * np.cos(2.0 * np.pi * np.arange(50) / 50)
    swinging = {name: float(np.mean(values)) * wave for name, values in stiffness.items()}
    stiffest = {name: np.array([float(np.mean(values)) * 1.44]) for name, values in stiffness.items()}
    found = eigenvalues(assemble(grc, Choice("rigid"), swinging))
    expected = eigenvalues(assemble(grc, Choice("rigid"), stiffest))
    # Damping goes with the mean stiffness and is light.
    assert np.abs(found).max() == pytest.approx(np.abs(expected).max(), rel=1e-3)
