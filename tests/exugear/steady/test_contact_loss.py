"""Steady states of a spur pair whose teeth part, against runs in time of the compiled solver at constant speed."""

from __future__ import annotations

import functools
import time
import tomllib
from dataclasses import dataclass

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.steady import steady_response
from exugear.steady.balance.response import signals
from exugear.steady.harmonics.branches import trace
from exugear.steady.harmonics.linear_solvers import HarmonicBalanceError
from exugear.steady.mean_system.mesh_places import DEFLECTION
from exugear.steady.point_solver import PointSolver, harmonic_balance_model
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.settling import SettlingRun
from exugear.steady.steady_response import follow_branch, response_of
from exugear.system.build import assemble

from ..cases import gear_trains
from ..cases import table as table_case
from ..cases.spur import SPUR_CASE
from .test_steady_in_time import fitted

TEETH = 20
TOUGH = {
    "lightly loaded, on bearings": ("bushing", {"torque": 20.0}),
    "reversed torque, on bearings": ("bushing", {"torque": -100.0, "mesh_time": 2e-6}),
    "hardly damped, spins alone": ("rigid", {"mesh_time": 1e-6}),
    "tight backlash, spins alone": ("rigid", {"mesh_time": 2e-6, "thinning": 0.008}),
    "hardly loaded, on bearings": ("bushing", {"torque": 5.0}),
}


def spur(torque=100.0, mesh_time=4e-6, thinning=0.03):
    case = tomllib.loads(SPUR_CASE)
    case["static_load"]["torques_N_m"]["shaft_1"] = torque
    case["damping"] = {"mesh_time_s": mesh_time, "bearing_time_s": 4e-6}
    for gear in case["gears"].values():
        gear["tooth_thinning_mm"] = thinning
    return Gearbox.from_dict(case)


@dataclass(frozen=True)
class Tough:
    """A pair near the resonance of its teeth."""

    assembly: object
    solver: PointSolver
    resonance: float

    def swept(self, *shares):
        """States at speeds over that of the resonance, each from the one before."""
        for share in shares:
            self.solver.response(share * self.resonance)
        return self.solver.state


def tough(name):
    variant, changes = TOUGH[name]
    return tough_pair(variant, **changes)


def tough_pair(variant, **changes):
    gearbox = spur(**changes)
    before = dict(table_case.STIFFNESS)
    table_case.STIFFNESS["spur"] = 3e8
    surface = table_case.surface_of(gearbox, "spur", variation=3.0)
    table_case.STIFFNESS.clear()
    table_case.STIFFNESS.update(before)
    assembly = assemble(gearbox, Choice(variant, "table"), {"spur": surface})
    model = harmonic_balance_model(assembly, np.array([50.0, 2000.0]))
    solver = PointSolver(model, "nonlinear")
    return Tough(assembly, solver, float(model.system.eigenvalues(100.0).imag.max()) / TEETH)


UP = np.arange(0.7, 1.2, 0.04)
LONGER = [
    pytest.param(name, marks=pytest.mark.long) for name in ("lightly loaded, on bearings", "hardly damped, spins alone")
]


@pytest.mark.validation
@pytest.mark.parametrize("name", ["reversed torque, on bearings", "tight backlash, spins alone", *LONGER])
def test_every_speed_through_a_resonance_with_contact_loss_has_a_state(name):
    """Upwards the pair jumps to the branch on which teeth part, downwards it stays there longer."""
    own, found = tough(name), []
    for shares in (UP, UP[::-1]):
        own.solver.state = None
        found.append([float(own.swept(share).response.apart[0]) for share in shares])
    up, down = np.array(found[0]), np.array(found[1][::-1])
    assert up.max() > 0.2
    assert up[0] == 0.0
    assert (down >= up - 0.02).all()
    assert (down > up + 0.2).any()


@pytest.mark.long
@pytest.mark.parametrize("variant", ["bushing", "rigid"])
@pytest.mark.parametrize("torque", [100.0, 20.0, 5.0])
@pytest.mark.parametrize("mesh_time", [1e-6, 2e-6, 4e-6])
def test_every_speed_of_a_sweep_has_a_state_or_says_that_its_motion_does_not_repeat(variant, torque, mesh_time):
    """Eighteen settings, 31 speeds up and 31 down through the resonance."""
    own, shares = tough_pair(variant, torque=torque, mesh_time=mesh_time), np.linspace(0.7, 1.2, 31)
    states, reasons, took = 0, [], time.process_time()
    for direction in (shares, shares[::-1]):
        own.solver.state = None
        for share in direction:
            try:
                own.swept(share)
                states += 1
            except HarmonicBalanceError as error:
                reasons.append(str(error))
    print(f"{variant}, {torque} N m, {mesh_time} s: {states} states, {time.process_time() - took:.1f} s, {reasons}")
    assert all("the time-domain motion is not periodic" in reason for reason in reasons)
    # On bearings and hardly loaded the teeth hop without end at five or six speeds past the fold.
    assert states >= (55 if (variant, torque) == ("bushing", 5.0) else 62)


# Amplitudes to 1e-3 and lines to 2e-3 are asked for at resonances.
@pytest.mark.validation
@pytest.mark.sample
@pytest.mark.parametrize(
    ("name", "share"),
    [
        ("lightly loaded, on bearings", 1.0),
        ("reversed torque, on bearings", 0.94),
        ("hardly damped, spins alone", 0.96),
        ("tight backlash, spins alone", 0.96),
    ],
)
def test_a_run_in_time_stays_on_a_state_with_contact_loss(name, share):
    """Constant torques, 300 mesh periods, lines over the later half, at 1/300 of a period or 1/240 kHz."""
    own = tough(name)
    state = own.swept(*np.arange(1.16, share - 1e-9, -0.04))
    assert state.response.apart[0] > 0.2
    period = 2.0 * np.pi / (TEETH * share * own.resonance)
    step = min(period / 300.0, 1.0 / 240e3)
    duration = 8000 * step * max(1, round(300.0 * period / step / 8000))
    speed, lines = fitted(state, state.response, duration, step, 0.5 * duration)
    own.solver.response(speed)
    again = own.solver.state.on(state.model)
    known = 2.0 * signals(again.model, again.response)[1:, 0]
    size = np.linalg.norm(known)
    assert np.linalg.norm(abs(lines) - abs(known)) < 1e-3 * size
    assert np.linalg.norm(lines - known) < 2e-3 * size


def test_a_state_that_is_said_to_be_unstable_does_not_last():
    """The branch with contact loss of a hardly loaded pair: a run leaves it for a motion that is in no line."""
    own = tough("hardly loaded, on bearings")
    own.solver._settled = lambda speed, state, reason: state
    shares = np.arange(1.16, 0.95, -0.04)
    state = own.swept(*shares)
    model, speed = state.model, float(shares[-1] * own.resonance)
    rows = state.response.interface.ports.readings[:, DEFLECTION]
    run = SettlingRun(model.system, model.lines, rows, model.waves.base_orders, speed, state.response.motion)
    outside = [run.leg().outside for _ in range(4)]
    assert state.growth * 2.0 * np.pi / (TEETH * speed) > 0.02
    assert outside[-1] > 0.3


def test_what_does_not_repeat_is_told_in_words():
    """Upwards past the fold the hardly loaded pair finds no state that lasts."""
    own = tough("hardly loaded, on bearings")
    with pytest.raises(HarmonicBalanceError, match=r"rad/s.*residual.*is not periodic \(\d+ % of the vibration"):
        own.swept(0.86, 0.9)


def test_speeds_without_a_state_leave_the_others(monkeypatch):
    own = tough("hardly damped, spins alone")
    solve = PointSolver.response

    def respond(solver, speed):
        if 0.9 < speed / own.resonance < 0.94:
            raise HarmonicBalanceError("irregular")
        return solve(solver, speed)

    monkeypatch.setattr(PointSolver, "response", respond)
    speeds = SpeedRange(0.8 * own.resonance, 1.2 * own.resonance, 11)
    found = response_of(own.assembly, SteadySettings(speeds, "nonlinear", at_resonances=False))
    assert [reason for _, reason in found.unsolved] == ["irregular"]
    assert len(found.solved.speed) == 10
    assert np.isfinite(found.solved.amplitude).all()
    # Growth is told at every speed.
    assert (found.solved.growth < 0.0).all()
    assert found.growth_rate >= found.solved.growth.max()


def test_a_response_that_goes_on_finds_the_states_that_it_would_have_found():
    """Stopped where teeth part; the branch is the same as without a stop."""
    own = tough("hardly damped, spins alone")
    settings = SteadySettings(SpeedRange(0.8 * own.resonance, 1.1 * own.resonance, 7), "nonlinear", at_resonances=False)
    whole = response_of(own.assembly, settings).solved
    stop = 4
    assert whole.apart[stop - 1].any()
    again = response_of(own.assembly, settings, known=whole.part(slice(stop))).solved
    size = np.abs(whole.amplitude).max()
    np.testing.assert_allclose(again.amplitude, whole.amplitude, atol=1e-4 * size)
    np.testing.assert_array_equal(again.amplitude[0], whole.amplitude[0])


@pytest.mark.validation
def test_a_branch_turns_back_where_the_sweep_jumps():
    """The fold at the foot of the branch lies between the last speed of a sweep before its jump and the first after."""
    own = tough("reversed torque, on bearings")
    branch = follow_branch(own.solver, 0.87 * own.resonance, 1.0 * own.resonance)
    shares = np.arange(0.87, 0.93, 0.01)
    own.solver.state = None
    parted = np.array([own.swept(share).response.apart[0] > 0.1 for share in shares])
    first = int(np.flatnonzero(parted)[0])
    assert first > 0
    folds = np.array(branch.folds) / own.resonance
    assert ((folds > shares[first - 1] - 1e-3) & (folds < shares[first] + 1e-3)).any()


def train_solver(content, share, mesh_time, bearing_time, combinations):
    """Solver of a gear train on bearings under a share of its load, stiffness varying by 15 to 20 %, and its range."""
    load = content["static_load"]
    load["torques_N_m"] = {name: share * torque for name, torque in load["torques_N_m"].items()}
    content["damping"] = {"mesh_time_s": mesh_time, "bearing_time_s": bearing_time}
    gearbox = Gearbox.from_dict(content)
    tables = {
        mesh.pair.name: table_case.surface_of(gearbox, mesh.pair.name, variation=3.0, stiffness=3e8)
        for mesh in gearbox.meshes
    }
    model = harmonic_balance_model(
        assemble(gearbox, Choice("bushing", "table"), tables), np.array([50.0, 2000.0]), 10, combinations
    )
    return PointSolver(model, "nonlinear")


def stays(solver, speeds, periods):
    """Differences of lines and amplitudes at the last of several speeds from a run in time, over all lines."""
    for speed in speeds:
        solver.response(speed)
    state, bases = solver.state, solver.model.waves.base_orders
    step = min(2.0 * np.pi / (bases.max() * speeds[-1]) / 300.0, 1.0 / 240e3)
    duration = 8000 * step * max(1, round(periods * 2.0 * np.pi / (bases.min() * speeds[-1]) / step / 8000))
    measured, lines = fitted(state, state.response, duration, step, 0.5 * duration)
    solver.response(measured)
    again = solver.state.on(state.model)
    known = 2.0 * signals(again.model, again.response)[1:, 0]
    size = np.linalg.norm(known)
    return np.linalg.norm(lines - known) / size, np.linalg.norm(abs(lines) - abs(known)) / size


def helical():
    """A helical pair with light load and little damping."""
    return train_solver(gear_trains.pair(helix_deg=15.0), 0.3, 1e-6, 1e-6, 3)


@pytest.mark.validation
def test_a_helical_pair_stays_on_a_state_with_contact_loss():
    solver = helical()
    lines, amplitudes = stays(solver, np.arange(520.0, 499.0, -5.0), 400)
    assert solver.state.response.apart[0] > 0.1
    assert lines < 1e-3
    assert amplitudes < 5e-4


@pytest.mark.validation
def test_the_branch_of_a_helical_pair_turns_back_where_its_sweeps_jump():
    """Two folds, no stable state between them; the sweep up jumps at one, that down at the other, 0.5 rad/s apart."""
    solver = helical()
    branch = follow_branch(solver, 510.0, 485.0)
    low, high = sorted(branch.folds)
    turned = np.flatnonzero(np.diff(np.sign(np.diff(branch.speed)))) + 1
    inside = slice(turned[0] + 2, turned[1] - 1)
    assert not branch.stable[inside].any()
    assert branch.stable[: turned[0] - 1].all() and branch.stable[turned[1] + 2 :].all()
    for speeds, fold in ((np.arange(489.0, 500.0, 0.5), high), (np.arange(501.0, 490.0, -0.5), low)):
        solver.state, sizes = None, []
        for speed in (510.0, *speeds) if speeds[0] > speeds[-1] else speeds:
            solver.response(speed)
            sizes.append(np.linalg.norm(solver.state.response.deflection[1:]))
        jump = int(np.argmax(np.abs(np.diff(sizes[-len(speeds) :]))))
        assert min(speeds[jump : jump + 2]) - 0.05 < fold < max(speeds[jump : jump + 2]) + 0.05


@pytest.mark.validation
def test_a_branch_that_runs_out_of_points_says_where(monkeypatch):
    monkeypatch.setattr(steady_response, "trace", functools.partial(trace, most=5))
    branch = follow_branch(helical(), 510.0, 485.0)
    assert len(branch.speed) == 5
    assert f"ends at {branch.speed[-1] * 30.0 / np.pi:.5g} rpm after 5 points" in branch.ended
    monkeypatch.setattr(steady_response, "trace", trace)
    assert not follow_branch(helical(), 520.0, 519.0).ended


@pytest.mark.validation
@pytest.mark.sample
@pytest.mark.parametrize("teeth", [(21, 43, 25, 61), (21, 42, 24, 60), (20, 40, 20, 60)])
def test_a_gearbox_of_two_stages_stays_on_a_state_with_contact_loss(teeth):
    """Kinks join both mesh frequencies, so that combinations grow; the latter two have these as 7 : 4 and 2 : 1."""
    solver = train_solver(gear_trains.two_stage(teeth), 0.1, 5e-7, 1e-5, 3)
    lines, amplitudes = stays(solver, np.array([770.0, 750.0]), 1500)
    assert solver.state.response.apart[0] > 0.08
    assert lines < 1e-3
    assert amplitudes < 1e-3
