"""The compiled solver against the plain kernels, against Exudyn, and against itself at other steps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.signal

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.results.run_file import load_run
from exugear.results.spectra.resonances import order_cut
from exugear.results.spectra.waterfall import order_lines
from exugear.system.build import assemble
from exugear.system.loads import Drive, LoadTable
from exugear.system.signals import signal_layout
from exugear.system.statics import accelerating_start
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.transient.compiled.integrator import RUNGE_KUTTA, Method, choose_integration, highest_rate
from exugear.transient.compiled.solver import CompiledSystem, unsupported_reason
from exugear.transient.exudyn_model.library import exudyn
from exugear.transient.exudyn_model.system import ExudynSystem
from exugear.transient.outcome import RunError
from exugear.transient.runup import simulate

from ...cases.assembled import assembled, simulated
from ...cases.both_ways import (
    assert_signals_are_those_of_the_plain_kernels,
    compiled_states,
    errors_and_mesh_forces,
    exudyn_states,
)
from ...cases.contact import contacts, curves_of
from ...cases.plain_motion import accelerations_of
from ...cases.plain_signals import sampled
from ...cases.rolling import BALLS, CYLINDRICAL, TAPERED, on_rolling

LOAD = {"carrier": 240e3, "hss": -3000.0}
STEP = 2.5e-5


def disturbed(assembly: Assembly, angle: float = 0.7) -> tuple[np.ndarray, np.ndarray]:
    """Preloaded state at 215 rpm, the carrier rolled to an angle (rad), all coordinates and rates moved at random."""
    start = accelerating_start(assembly, LOAD, 22.5)
    random = np.random.default_rng(7)
    q = start.q + 1e-5 * random.normal(size=assembly.size)
    v = start.v + 0.1 * random.normal(size=assembly.size)
    bodies = {body.name: body for body in assembly.bodies}
    for name, unit in assembly.gearbox.train.rolling_speeds("carrier", 1.0).items():
        q[assembly.spin[name]] += unit * angle
        carrier = bodies[name].carrier
        if carrier is not None and assembly.has_six(bodies[name]):
            place = complex(*np.subtract(bodies[name].axis, bodies[carrier].axis))
            orbit = place * (np.exp(1j * angle) - 1.0)
            o = assembly.coordinates[name][0]
            q[o : o + 2] += orbit.real, orbit.imag
    return q, v


def with_full_matrices(assembly: Assembly, off_axis: float) -> Assembly:
    """The same with random coupled 6x6 matrices, the turning about z included, and attachments off the axes."""
    random = np.random.default_rng(5)
    connectors = assembly.connectors
    roots = random.normal(size=connectors.stiffness.shape)
    stiffness = 1e8 * roots @ roots.transpose(0, 2, 1)
    damping = 1e3 * (roots + 0.1 * random.normal(size=roots.shape))
    local = connectors.local + off_axis * random.normal(size=connectors.local.shape)
    return replace(assembly, connectors=connectors._replace(stiffness=stiffness, damping=damping, local=local))


def assemblies(grc: Gearbox, stiffness: dict) -> Iterator[Assembly]:
    for law in (name for name, law in LAWS.items() if law.has_force and not law.needs_axes):
        yield assembled(grc, Choice("rigid", law), stiffness)
    for law in ("line_of_action", "tangential"):  # of one row, and of two
        yield assembled(grc, Choice("bushing", law), stiffness)
    for choice in (Choice("rigid"), Choice("bushing")):
        yield assemble(grc, choice, curves_of(stiffness), contact=contacts(grc))
    yield assemble(grc, Choice("rigid", "kinematic"), {})
    yield with_full_matrices(assemble(grc, Choice("bushing"), stiffness), off_axis=0.05)
    preloaded = replace(CYLINDRICAL, radial_clearance=-20e-6)
    pair = tuple(replace(TAPERED, contact_angle=a, axial_position=0.1 * a) for a in (0.3, -0.3))
    bushing = assemble(grc, Choice("bushing"), stiffness)
    yield on_rolling(bushing, [(preloaded,), (), (BALLS,), pair], stiffness=0.5)
    heavy = grc.varied({"gravity.acceleration_m_per_s2": [0.0, -9.81, 0.0]})
    yield assemble(heavy, Choice("bushing"), stiffness)


@pytest.mark.validation
def test_accelerations_are_those_of_the_plain_kernels(grc: Gearbox, stiffness: dict) -> None:
    for assembly in assemblies(grc, stiffness):
        if assembly.mesh_model == "kinematic":
            continue
        q, v = disturbed(assembly)
        found = CompiledSystem(assembly, q, v, LoadTable(LOAD), STEP).accelerations()
        expected = accelerations_of(assembly, q, v, assembly.torque_vector(LOAD))
        # The same sums in another order: 1e-16 of positions of 1 m and of spins of 60 rad acts on 1e9 N/m.
        assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max(), (assembly.variant, assembly.mesh_model)


def test_gears_that_only_roll_accelerate_together(grc: Gearbox) -> None:
    assembly = assemble(grc, Choice("rigid", "kinematic"), {})
    rest = np.zeros(assembly.size)
    found = CompiledSystem(assembly, rest, rest, LoadTable(LOAD), STEP).accelerations()
    free = assembly.motions
    weights = np.linalg.solve(free.T @ assembly.mass_matrix @ free, free.T @ assembly.torque_vector(LOAD))
    assert found == pytest.approx(free @ weights, rel=1e-12)


@pytest.mark.validation
def test_signals_and_energies_are_those_of_the_plain_kernels(grc: Gearbox, stiffness: dict) -> None:
    for assembly in assemblies(grc, stiffness):
        states = [disturbed(assembly, angle) for angle in (0.0, 0.7)]
        q, v = (np.array(values) for values in zip(*states, strict=True))
        powers = assert_signals_are_those_of_the_plain_kernels(assembly, q, v, LOAD)
        load = v @ (assembly.torque_vector(LOAD) + assembly.constant_forces)
        assert powers[:, 0] == pytest.approx(load, rel=1e-12)


def test_loads_over_time_are_those_that_exudyn_gets(grc: Gearbox, stiffness: dict) -> None:
    assembly = assemble(grc, Choice("rigid"), stiffness)
    times = np.array([0.0, 0.01, 0.015, 0.5])
    loads = LoadTable(
        constant={"carrier": 10.0},
        series={"hss": (times, np.array([1.0, -3.0, 4.0, 5.0])), "carrier": (times[:2], np.array([7.0, 8.0]))},
        drive=Drive("lss", 1e4, 3.0, (0.1, 2.0, -1.5)),
    )
    q, v = disturbed(assembly)
    system = CompiledSystem(assembly, q, v, loads, STEP)
    for t in (0.0, 0.012, 0.3, 0.7, 0.005):  # forwards, beyond the end, and back again
        applied = loads.generalized(assembly, t, q, v)
        assert system.accelerations(t) == pytest.approx(accelerations_of(assembly, q, v, applied), rel=1e-12)


def exudyn_accelerations(assembly: Assembly, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Accelerations that Exudyn's own mass matrix and right-hand side give."""
    system = ExudynSystem(assembly, q, v, LoadTable(LOAD))
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    solver = exudyn.MainSolverImplicitSecondOrder()
    solver.InitializeSolver(system.mbs, settings)
    solver.ComputeMassMatrix(system.mbs)
    solver.ComputeODE2RHS(system.mbs)
    size = assembly.size
    mass, forces = np.array(solver.GetSystemMassMatrix()), np.array(solver.GetSystemResidual())
    return np.linalg.solve(mass[:size, :size], forces[:size])[system._order]


@pytest.mark.parametrize("matrices", ["catalogue bearings", "coupled 6x6"])
def test_accelerations_equal_exudyns_body_by_body(grc: Gearbox, stiffness: dict, matrices: str) -> None:
    assembly = assemble(grc, Choice("bushing"), stiffness)
    angle = 0.7
    if matrices == "coupled 6x6":  # these hold the spins too, which only makes sense near zero
        assembly, angle = with_full_matrices(assembly, off_axis=0.0), 0.0
    q, v = disturbed(assembly, angle)
    found = CompiledSystem(assembly, q, v, LoadTable(LOAD), STEP).accelerations()
    expected = exudyn_accelerations(assembly, q, v)
    for body in assembly.bodies:
        index = [i for i in assembly.coordinates[body.name] if i >= 0]
        for part in (index[:3], index[3:]):
            # Scale: the largest acceleration of the same body, of its centre and of its turning.
            scale = np.abs(expected[part]).max(initial=1e-300)
            assert np.abs(found[part] - expected[part]).max(initial=0.0) < 1e-9 * scale, body.name


def dynamic_error(found: np.ndarray, expected: np.ndarray) -> float:
    """Greatest rms of a difference over the rms of its column without a cubic trend."""
    time = np.linspace(-1.0, 1.0, len(expected))
    trend = np.polynomial.polynomial.polyvander(time, 3)
    dynamic = expected - trend @ np.linalg.lstsq(trend, expected)[0]
    return float(np.max(np.sqrt(np.mean((found - expected) ** 2, axis=0) / np.mean(dynamic**2, axis=0))))


def assert_exudyn_agrees(grc: Gearbox, stiffness: dict, steps: int, limit: float) -> None:
    """Overall DTE, DTE and forces of the meshes from 46 rpm on: high-speed mesh at 1.4 kHz."""
    assembly = assemble(grc, Choice("bushing"), stiffness)
    start = accelerating_start(assembly, LOAD, -4.8)
    found = sampled(assembly, *compiled_states(assembly, start.q, start.v, LOAD, steps, STEP))
    expected = sampled(assembly, *exudyn_states(assembly, start.q, start.v, LOAD, steps, STEP))
    columns = errors_and_mesh_forces(assembly)
    assert dynamic_error(found[:, columns], expected[:, columns]) < limit


def test_bushing_variant_follows_exudyn(grc: Gearbox, stiffness: dict) -> None:
    assert_exudyn_agrees(grc, stiffness, 200, 1e-6)


@pytest.mark.validation
@pytest.mark.long
def test_bushing_variant_follows_exudyn_over_half_a_second(grc: Gearbox, stiffness: dict) -> None:
    assert_exudyn_agrees(grc, stiffness, 20000, 1e-6)


@pytest.mark.validation
@pytest.mark.parametrize("duration", [0.05, pytest.param(0.2, marks=pytest.mark.long)])
def test_rigid_variant_follows_the_jointed_model_of_exudyn(grc: Gearbox, stiffness: dict, duration: float) -> None:
    """Generalized-alpha of second order, extrapolated from two steps to none."""
    minimal, jointed = assemble(grc, Choice("rigid"), stiffness), assemble(grc, Choice("jointed"), stiffness)
    speed, interval = -4.8, 5e-5
    start = accelerating_start(minimal, LOAD, speed)
    speeds = {n: u * speed for n, u in grc.train.rolling_speeds("carrier", 1.0).items()}
    q = np.zeros(jointed.size)
    for name, index in jointed.spin.items():
        q[index] = start.q[minimal.spin[name]]
    v = jointed.rolling_velocity(q, speeds)
    columns = errors_and_mesh_forces(minimal)
    references = []
    for step in (1e-5, 5e-6):
        states = exudyn_states(jointed, q, v, LOAD, round(duration / step), step)
        stored = (each[:: round(interval / step)] for each in states)
        references.append(sampled(jointed, *stored)[:, columns])
    coarse, fine = references
    expected = (4.0 * fine - coarse) / 3.0
    q, v = compiled_states(minimal, start.q, start.v, LOAD, round(duration / 5e-6), 5e-6)
    found = sampled(minimal, q[::10], v[::10])[:, columns]
    assert dynamic_error(found, expected) < 1e-3


@pytest.mark.sample
@pytest.mark.parametrize("variant", ["rigid", "bushing"])
def test_repeated_runs_are_bitwise_equal(grc: Gearbox, stiffness: dict, tmp_path: Path, variant: str) -> None:
    one, two = (
        load_run(simulated(grc, Choice(variant), stiffness, tmp_path / name, duration=0.3).path)
        for name in ("one", "two")
    )
    assert one.identical(two)


@pytest.mark.validation
@pytest.mark.usefixtures("terminal_signals")
def test_resumed_run_is_bitwise_the_whole_one(
    grc: Gearbox, stiffness: dict, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("exugear.transient.recorder.FLUSH_INTERVAL", 0.01)
    whole = load_run(simulate(grc, Choice("bushing"), stiffness, tmp_path / "whole", duration=0.12).path)
    plain, calls = CompiledSystem.advance, []

    def interrupted(self: CompiledSystem, first: int, *rows: np.ndarray) -> int:
        calls.append(first)
        if len(calls) == 2:
            import signal

            signal.raise_signal(signal.SIGINT)
        return plain(self, first, *rows)

    monkeypatch.setattr(CompiledSystem, "advance", interrupted)
    stopped = simulate(grc, Choice("bushing"), stiffness, tmp_path, duration=0.12)
    assert not stopped.complete
    assert 0.0 < stopped.end < 0.12
    resumed = load_run(simulate(grc, Choice("bushing"), stiffness, tmp_path, duration=0.12, resume=True).path)
    for name in ("time", "overall_dte", "mesh_force", "support_force", "state_q", "state_v"):
        assert np.array_equal(resumed[name], whole[name]), name


def test_not_finite_state_is_named_and_what_was_reached_is_kept(
    grc: Gearbox, stiffness: dict, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = CompiledSystem.advance

    def poisoned(self: CompiledSystem, first: int, *rows: np.ndarray) -> int:
        good = plain(self, first, *(row[:160] for row in rows))
        self._work.q[:] = np.nan
        return good + plain(self, first + good, *(row[160:] for row in rows))

    monkeypatch.setattr(CompiledSystem, "advance", poisoned)
    with pytest.raises(RunError, match=r"not finite at t = 0.00268333 s; results so far"):
        simulate(grc, Choice("rigid"), stiffness, tmp_path, duration=0.01)
    partial = tmp_path / "rigid" / "reference-line_of_action-assemblies" / "run.partial"
    # What half the filter needs is not written.
    assert float(load_run(partial).time[-1]) == pytest.approx((160 - 31 * 1.5) / 60e3, abs=2 * STEP)


def test_step_follows_from_band_and_eigenfrequencies(grc: Gearbox, stiffness: dict) -> None:
    def step(assembly: Assembly, band: float) -> float:
        return choose_integration(assembly, 20e3, band, integrator="rk4").step

    assembly = assemble(grc, Choice("bushing"), stiffness)
    assert step(assemble(grc, Choice("rigid"), stiffness), 6.4e3) == pytest.approx(1 / 60e3)  # excitation at 6.4 kHz
    assert step(assembly, 2.5e3) == pytest.approx(1 / 60e3)  # resonance at 1.9 kHz
    assert step(assembly, 500.0) == 5e-5  # which is out of this band
    stiff = replace(assembly, connectors=assembly.connectors._replace(stiffness=400 * assembly.connectors.stiffness))
    chosen = step(stiff, 100.0)
    assert chosen * highest_rate(stiff) <= 2.785 / 1.2
    assert 1.0 / (chosen * 20e3) == pytest.approx(round(1.0 / (chosen * 20e3)), abs=1e-9)


@pytest.mark.validation
def test_file_tells_solver_step_and_what_it_follows_from(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    attributes = load_run(simulate(grc, Choice("bushing"), stiffness, tmp_path, duration=0.01).path).attrs
    assert attributes["solver"] == "compiled, Adams of order 5"
    assert attributes["step"] == pytest.approx(1 / 60e3)
    assert attributes["band"] == 6.4e3
    assert attributes["fastest_eigenvalue"] == pytest.approx(highest_rate(assemble(grc, Choice("bushing"), stiffness)))
    assert attributes["stability_margin"] >= 1.2
    assert abs(attributes["expected_error_at_band"]) < 1e-3
    assert 0.0 < attributes["expected_error_of_resonances"] < 1e-3


def test_the_reference_method_can_be_asked_for(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    run = simulate(grc, Choice("rigid"), stiffness, tmp_path, duration=0.01, integrator="rk4")
    assert load_run(run.path).attrs["solver"] == "compiled, RK4"
    with pytest.raises(RunError, match="integrator 'euler' is unknown; integrators are adams, rk4"):
        simulate(grc, Choice("rigid"), stiffness, tmp_path, duration=0.01, integrator="euler")  # type: ignore[arg-type]


def test_unstable_step_is_refused(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"step = 0.0005 s is unstable.*use 0.00017 s or less"):
        simulate(grc, Choice("bushing"), stiffness, tmp_path, duration=0.03, step=5e-4, sample_rate=2e3)


@pytest.mark.validation
def test_what_it_cannot_take_is_refused_with_the_way_out(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    assert unsupported_reason(assemble(grc, Choice("bushing"), stiffness)) == ""
    with pytest.raises(RunError, match="jointed has ideal joints as constraints.*use --solver exudyn"):
        simulate(grc, Choice("jointed"), stiffness, tmp_path, duration=0.01, solver="compiled")
    with pytest.raises(RunError, match="user-function loads exist in Exudyn only.*use --solver exudyn"):
        simulate(grc, Choice("bushing"), stiffness, tmp_path, duration=0.01, solver="compiled", mesh_route="loads")
    run = simulate(grc, Choice("bushing"), stiffness, tmp_path, duration=0.002, mesh_route="loads")
    assert "Exudyn" in load_run(run.path).attrs["solver"]


@pytest.mark.sample
@pytest.mark.parametrize("case", ["speed_driven", "reference"])
def test_both_solvers_write_the_same_run(grc: Gearbox, stiffness: dict, tmp_path: Path, case: str) -> None:
    one, two = (
        load_run(simulate(grc, Choice("rigid", load_case=case), stiffness, tmp_path / s, duration=0.02, solver=s).path)
        for s in ("compiled", "exudyn")
    )
    for name in ("time", "overall_dte", "mesh_force", "support_force", "input_speed", "work_of_loads"):
        expected = two[name].to_numpy()
        scale = float(np.abs(expected).max())
        # Stored forces have seven digits.
        assert np.abs(one[name].to_numpy() - expected).max() < 1e-6 * scale, name


def excitation_amplitudes(assembly: Assembly, rpm: float, step: float, method: Method) -> np.ndarray:
    """Amplitudes of overall DTE and high-speed DTE at the high-speed mesh frequency, constant speed (rpm)."""
    load = {"carrier": 240e3, "hss": -240e3 / assembly.gearbox.train.ratio}
    start = accelerating_start(assembly, load, rpm * np.pi / 30.0)
    every, steps = round(2.5e-5 / step), round(0.4 / step)
    q, v = np.empty((2, steps, assembly.size))
    CompiledSystem(assembly, start.q, start.v, LoadTable(load), step, method).advance(0, q, v)
    q, v = q[steps // 2 :: every], v[steps // 2 :: every]
    element = assembly.elements[assembly.mesh_names.index("high_speed")]
    cycle = element.cycles * q[:, assembly.spin[element.mesh.pinion]]
    window = np.hanning(len(q))
    layout = signal_layout(assembly)
    high_speed = layout["mesh_dte"].start + assembly.mesh_names.index("high_speed")
    values = sampled(assembly, q, v)[:, [layout["overall_dte_angle"].start, high_speed]]
    values = values - window @ values / window.sum()
    return np.abs(2.0 * (window * np.exp(-2j * np.pi * cycle)) @ values) / window.sum()


@pytest.mark.validation
@pytest.mark.parametrize("variant", ["rigid", "bushing"])
@pytest.mark.parametrize(("frequency", "limit"), [(1e3, 1e-4), (3e3, 5e-4), (6.4e3, 1e-3)])
def test_amplitude_error_of_the_chosen_step(
    grc: Gearbox, stiffness: dict, variant: str, frequency: float, limit: float
) -> None:
    assembly = assembled(grc, Choice(variant), stiffness)
    rpm = frequency / grc.train.mesh_frequencies(np.pi / 30.0)["high_speed"]
    chosen = choose_integration(assembly, 20e3, 6.4e3)
    found = excitation_amplitudes(assembly, rpm, chosen.step, chosen.method)
    expected = excitation_amplitudes(assembly, rpm, 2.5e-6, RUNGE_KUTTA)
    # Under 0.1 % is asked for.
    assert np.abs(found / expected - 1.0).max() < limit


@pytest.mark.validation
@pytest.mark.parametrize("variant", ["rigid", pytest.param("bushing", marks=pytest.mark.long)])
def test_order_cuts_of_the_run_up_stay_at_half_the_step(
    grc: Gearbox, stiffness: dict, tmp_path: Path, variant: str
) -> None:
    """30 s from rest to 215 rpm, overall DTE along the first three harmonics of each stage."""
    cuts = []
    chosen = choose_integration(assembled(grc, Choice(variant), stiffness), 20e3, 6.4e3).step
    for step in (chosen, chosen / 2):
        run = simulated(grc, Choice(variant), stiffness, tmp_path / f"{step:g}", step=step)
        data = load_run(run.path)
        rate = 1.0 / float(data.time[1] - data.time[0])
        signal = scipy.signal.sosfiltfilt(
            scipy.signal.butter(4, 20.0, "highpass", fs=rate, output="sos"), data.overall_dte.to_numpy()
        )
        lines = [
            line
            for line in order_lines(grc)
            if line.frequency(22.5) < 8e3  # the flat part of the stored band
        ]
        speed = data.input_speed.to_numpy()
        cuts.append([np.abs(order_cut(signal, speed, rate, line, window_length=0.2).amplitude) for line in lines])
    for coarse, fine in zip(*cuts, strict=True):
        size = min(len(coarse), len(fine))
        # A share of the cut's peak; where an order is weak, others that cross it lie in the window.
        assert np.abs(coarse[:size] - fine[:size]).max() < 1e-3 * fine.max()
