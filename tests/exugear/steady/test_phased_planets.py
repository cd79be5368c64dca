"""Planets that mesh out of phase: what cancels, what the carrier's turns put beside the mesh frequency, and runs."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.steady.balance.nonlinear import HarmonicResidual, solve_balance
from exugear.steady.balance.response import dissipated_and_given, signals, transmission_errors
from exugear.steady.mean_system.mesh_places import POSITION, mesh_places
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.steady.point_solver import PointSolver, harmonic_balance_model
from exugear.steady.steady_response import follow_branch
from exugear.system.build import assemble

from ..cases.steady_runs import FOUR, apart, solver_of

RANGE = (1.0, 22.5)


@pytest.fixture(scope="module")
def four(grc):
    return grc.varied(FOUR)


@pytest.fixture(scope="module")
def model(four, stiffness):
    return harmonic_balance_model(assemble(four, Choice("bushing"), stiffness), np.array(RANGE))


def response_at(model, level, speed):
    return PointSolver(model, level).response(speed)


def amplitude(model, response, line, signal="overall_dte"):
    place = int(model.lines.find(np.array(line))[0])
    names = [own.name for own in model.signal_names]
    return 2.0 * abs(signals(model, response)[place, names.index(signal)])


def test_in_torsion_alone_all_harmonics_cancel_but_each_fourth(four, stiffness):
    """Equal planets spread over a cycle excite the mean wave where their number divides the harmonic (Seager 1975)."""
    model = harmonic_balance_model(assemble(four, Choice("rigid"), stiffness), np.array(RANGE))
    response = response_at(model, "parametric", 10.0)
    found = [amplitude(model, response, (n, 0, 0, 0)) for n in range(1, 9)]
    assert max(found[n - 1] for n in (1, 2, 3, 5, 6, 7)) < 1e-9 * found[3]
    assert found[3] > 0.0


@pytest.mark.parametrize(("harmonic", "turns"), [(1, 1), (3, -1), (5, 1)])
def test_lateral_forces_stand_one_turn_of_the_carrier_beside_odd_harmonics(model, harmonic, turns):
    """A quarter of a cycle from planet to planet is a wave around the carrier, which turns against it."""
    response = response_at(model, "parametric", 10.0)
    own, others = (
        [amplitude(model, response, (harmonic, 0, 0, j), "support_force lss_a x") for j in places]
        for places in ((turns,), sorted({-1, 0, 1} - {turns}))
    )
    # What is left comes of bearings that are not alike in all directions, and of static loads that differ.
    assert own[0] > 10.0 * max(others)


@pytest.mark.parametrize("speed", [8.0, -8.0])
def test_errors_of_planets_out_of_phase_excite_what_sampling_their_turn_and_cycle_gives(model, speed):
    """Each planet by itself, at 64 x 32 angles of mesh cycle and carrier: no line takes from another."""
    ports, waves = model.ports_at(speed), model.waves
    angle, turn = 2.0 * np.pi * np.arange(64) / 64, 2.0 * np.pi * np.arange(32) / 32
    angles = np.zeros((angle.size * turn.size, 4))
    angles[:, 0], angles[:, 3] = np.repeat(angle, turn.size), np.tile(turn, angle.size)
    places = mesh_places(waves, speed, ports.positions, angles)
    pressed, ahead = places.there @ model.pressed(ports.static), places.there @ ports.static[:, POSITION]
    forces = np.empty(places.positions.shape)
    for u, n in enumerate(places.means):
        turning = np.exp(2j * np.pi * (places.positions[:, [u]] + ahead[:, [u]]) * np.arange(1, model.harmonics + 1))
        error = 2.0 * (turning @ model.cycles.compliances[n, 1:]).real
        forces[:, u] = -(waves.mean_stiffness[n] ** 2) * pressed[:, u] * error
    lines = np.fft.fft2((places.back @ forces[..., None])[..., 0].reshape(64, 32, -1), axes=(0, 1)) / 64.0 / 32.0
    found = transmission_errors(model, ports, speed)[..., 0]
    own = [n for n, wave in enumerate(waves.waves) if wave.base == 0]
    for line, (harmonic, *others, turns) in enumerate(model.lines.index):
        if harmonic and not any(others):
            largest = np.abs(lines[harmonic][:, own]).max()
            np.testing.assert_allclose(found[line, own], lines[harmonic, turns, own], rtol=0.0, atol=1e-9 * largest)


@pytest.mark.parametrize("level", ["linear", "parametric", "nonlinear"])
def test_damping_takes_the_power_that_planets_out_of_phase_give(model, level):
    taken, given = dissipated_and_given(model, response_at(model, level, 8.0))
    assert taken > 0.0
    assert given == pytest.approx(taken, rel=1e-4)


@pytest.mark.validation
def test_levels_agree_on_small_variations(four, stiffness):
    """A tenth of the variation leaves a hundredth of the difference between both."""
    differences = []
    for share in (1e-1, 1e-2):
        small = {name: k.mean() + share * (k - k.mean()) for name, k in stiffness.items()}
        model = harmonic_balance_model(assemble(four, Choice("bushing"), small), np.array(RANGE), 4, 2)
        linear, full = (signals(model, response_at(model, level, 10.0)) for level in ("linear", "parametric"))
        differences.append(np.linalg.norm((full - linear)[1:, 0]))
    assert differences[1] == pytest.approx(differences[0] / 100.0, rel=0.1)


def test_branches_of_planets_out_of_phase_are_refused_with_the_reason(model):
    solver = PointSolver(model, "nonlinear")
    with pytest.raises(SteadyError, match="mesh out of phase"):
        follow_branch(solver, *RANGE)


@pytest.mark.validation
@pytest.mark.sample
@pytest.mark.parametrize("speed", [8.0, 18.0])
def test_planets_out_of_phase_started_on_their_steady_state_stay_there(four, stiffness, speed):
    """As for planets in phase; combinations beyond the third leave 1e-3 of signals that phasing makes small."""
    solver = solver_of(assemble(four, Choice("bushing"), stiffness), RANGE, "nonlinear")
    assert apart(solver, speed, 3.0, 1.0 / 120e3, 2.0)[0] < 2e-3


def test_the_memory_of_a_solved_speed_falls_free_at_once(four, stiffness):
    """A balance holds samples of all laws: some tens of megabytes a speed, which no search for garbage has to find."""
    model = harmonic_balance_model(assemble(four, Choice("bushing"), stiffness), np.array(RANGE), 4, 2)
    balance = HarmonicResidual(model, model.at(5.0), model.sampling)
    gone = weakref.ref(balance)
    gc.disable()
    try:
        solve_balance(balance, balance.static)
        del balance
        assert gone() is None
    finally:
        gc.enable()
