"""Trains of shafts and couplings without gears: published and closed forced responses, signals, refusals."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

from exugear.cli.app import app
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.results.run_file import load_run
from exugear.results.solver_comparison import EXUDYN_FOLDER, compare_solvers
from exugear.steady.balance.response import signals
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.steady.point_solver import PointSolver
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import to_dataset, with_names
from exugear.steady.steady_response import response_of
from exugear.studies.quantities import QUANTITIES, outputs_of
from exugear.studies.study import errors_of_signals
from exugear.system.build import assemble
from exugear.transient.runup import simulate

from ..cases.case_mutations import toml_text
from ..cases.steady_runs import apart, line_at, solver_of
from ..report.page_view import data_of

SPEEDS = (2.0, 60.0)


def shaft_line(
    inertias: dict[str, float], couplings: dict[str, tuple[str, str, float, float]], **excitation: Any
) -> dict[str, Any]:
    """Discs (kg m2) on couplings: bodies, stiffness (N m/rad) and damping (N m s/rad); the last disc is locked."""
    names = list(inertias)
    return {
        "name": "shaft line",
        "default_inertias": "disc",
        "overall": {"input": names[0], "output": names[-1]},
        "static_load": {"torques_N_m": {names[0]: 500.0}, "locked": [names[-1]]},
        "bodies": {
            name: {"spin_only": True, "inertia": {"disc": {"axial_kg_m2": inertia}}}
            for name, inertia in inertias.items()
        },
        "couplings": {
            name: {"bodies": [one, other], "stiffness_N_m_per_rad": stiffness, "damping_N_m_s_per_rad": damping}
            for name, (one, other, stiffness, damping) in couplings.items()
        },
        "excitations": {"torque": excitation},
        "load_cases": {"run": {"torques_N_m": {names[0]: 500.0, names[-1]: -500.0}, "duration_s": 0.5}},
    }


def solver(content: dict[str, Any], method: str = "parametric") -> PointSolver:
    return solver_of(assemble(Gearbox.from_dict(content), Choice("rigid"), {}), SPEEDS, method)


def amplitudes(own: PointSolver, speed: float, order: float) -> dict[str, complex]:
    """Complex peak amplitudes of all signals at an order."""
    found = 2.0 * signals(own.model, own.response(speed))[line_at(own.model, order)]
    return dict(zip((name.name for name in own.model.signal_names), found.tolist(), strict=True))


def absorber(order: int = 4) -> dict[str, Any]:
    """Main disc on a spring against a flywheel that hardly vibrates, and a tuned absorber of a fifth of its inertia."""
    return shaft_line(
        {"flywheel": 1e10, "main": 1.0, "absorber": 0.2},
        {"spring": ("flywheel", "main", 1e4, 0.0), "tuned": ("main", "absorber", 2e3, 0.0)},
        body="main",
        orders=[order],
        torque_N_m=[30.0],
    )


def test_a_tuned_absorber_responds_by_the_formula_of_den_hartog():
    """J. P. Den Hartog, Mechanical Vibrations, 4th ed. (1956), chapter 3, undamped absorber with k / K = 1 / 5.

    x_1 / x_st = (1 - g^2) / ((1 - g^2) (1 + 1/5 - g^2) - 1/5) and x_2 / x_st = 1 / (the same) with g = w / w_a. At
    g = 1 the main mass stands still, and the absorber moves by -T / k. Resonances are the roots of the denominator.
    """
    content = absorber()
    content["static_load"]["torques_N_m"] = {"flywheel": 1e-9}  # no twist that changes phases
    own = solver(content)
    static = 30.0 / 1e4
    for g in (0.5, 0.75, 0.9, 1.0, 1.1, 1.4, 2.0):
        w = 100.0 * g
        found = amplitudes(own, w / 4.0, 4.0)
        below = (1.0 - g**2) * (1.2 - g**2) - 0.2
        assert found["body_speed main"] == pytest.approx(1j * w * static * (1.0 - g**2) / below, rel=1e-6, abs=1e-6)
        assert found["body_speed absorber"] == pytest.approx(1j * w * static / below, rel=1e-6)
        assert found["coupling_torque tuned"] == pytest.approx(2e3 * static * g**2 / below, rel=1e-6)
    frequencies = np.sort(own.model.system.eigenvalues(25.0).imag)[-2:] / 100.0
    assert frequencies == pytest.approx(np.sqrt(1.1 + np.array([-1.0, 1.0]) * np.sqrt(0.21)), rel=1e-6)


def ship(**excitation: Any) -> dict[str, Any]:
    """Engine, shaft and propeller: the third order of the engine meets 40.6 rad/s, at 129 rpm."""
    torque = {"body": "engine", "orders": [3], "torque_N_m": [100.0]} | excitation
    return shaft_line({"engine": 50.0, "propeller": 80.0}, {"shaft": ("engine", "propeller", 5e4, 40.0)}, **torque)


def coupling_torque(w: Any, amount: float, damping: float = 40.0) -> Any:
    """Torque of the shaft under one of an amount on the engine, at an angular frequency: two inertias on a spring."""
    inertia = 1.0 / (1.0 / 50.0 + 1.0 / 80.0)
    spring = 5e4 + 1j * w * damping
    return -spring * amount / 50.0 / (spring / inertia - w**2)


@pytest.mark.parametrize("method", ["linear", "parametric"])
def test_an_engine_twists_its_shaft_as_in_closed_form(method):
    """Twist = T / J_1 / (w_0^2 - w^2 + i w c / J) with 1 / J = 1 / 50 + 1 / 80; the shaft drives the propeller."""
    own = solver(ship(), method)
    for speed in (5.0, 13.5, 40.0):
        w = 3.0 * speed
        torque = coupling_torque(w, 100.0)
        found = amplitudes(own, speed, 3.0)
        assert found["coupling_torque shaft"] == pytest.approx(torque, rel=1e-9)
        assert found["body_speed propeller"] == pytest.approx(-torque / (1j * w * 80.0), rel=1e-9)


def test_a_run_of_a_shaft_line_started_on_its_steady_state_stays_there():
    """RK4 at 1/20 kHz, on the resonance; a run takes the torque at the angle that the vibration turns, 1e-3 rad."""
    assembly = assemble(Gearbox.from_dict(ship(torque_N_m=[10.0])), Choice("rigid"), {})
    assert apart(solver_of(assembly, SPEEDS, "parametric"), 13.5, 8.0, 1.0 / 20e3, 4.0, assembly)[0] < 1e-3


def test_a_stored_run_has_the_torque_of_the_coupling_and_the_speeds_of_closed_form(tmp_path: Path):
    """Engine and propeller as above, damped so that 3 s leave 1e-8 of the start; stored at 1 kHz below 200 Hz.

    The propeller is driven by the coupling alone; a run takes the torque at the angle that the vibration turns, 2e-3
    rad. Exudyn, generalized-alpha at 1/4000 s, stores the same within its error of the method.
    """
    content = ship(torque_N_m=[10.0])
    content["couplings"]["shaft"]["damping_N_m_s_per_rad"] = 400.0
    content["load_cases"]["run"]["start_speed_rpm"] = 13.5 * 30.0 / np.pi
    gearbox = Gearbox.from_dict(content)
    settings: dict[str, Any] = {"step": 1.0 / 4000.0, "sample_rate": 1000.0, "band": 200.0}
    path = simulate(gearbox, Choice("rigid"), {}, tmp_path, duration=5.0, **settings).path
    data = load_run(path)
    time, engine = data["time"].to_numpy(), data["body_speed"].sel(body="engine").to_numpy()
    late = time > 3.0
    mean = engine[late].mean()
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (engine[1:] + engine[:-1]) * np.diff(time))])
    slope, start = np.polyfit(time[late], angle[late], 1)
    turned = 3.0 * (slope * time[late] + start)
    columns = np.stack([np.ones(turned.size), np.cos(turned), -np.sin(turned)], axis=1)

    def order(values: Any) -> complex:
        return complex(*np.linalg.lstsq(columns, values.to_numpy()[late], rcond=None)[0][1:])

    w = 3.0 * mean
    found = order(data["coupling_torque"].sel(coupling="shaft"))
    propeller = order(data["body_speed"].sel(body="propeller"))
    assert abs(found) == pytest.approx(abs(coupling_torque(w, 10.0, 400.0)), rel=1e-3)
    assert propeller == pytest.approx(-found / (1j * w * 80.0), rel=1e-3)
    assert data["coupling_torque"].mean() == pytest.approx(-500.0, rel=1e-3)
    simulate(gearbox, Choice("rigid"), {}, tmp_path / EXUDYN_FOLDER, duration=0.5, solver="exudyn", **settings)
    compared = compare_solvers(path, tmp_path / EXUDYN_FOLDER / path.relative_to(tmp_path))
    assert compared.difference["coupling_torque"] < 1e-4
    assert compared.difference["body_speed"] < 1e-6


def test_studies_have_torques_of_couplings_and_fluctuations_of_speeds_by_their_names():
    """Largest over six speeds of the third order, with units; a tenth of the torque of the engine."""
    assembly = assemble(Gearbox.from_dict(ship(torque_N_m=[10.0])), Choice("rigid"), {})
    response = response_of(assembly, SteadySettings(SpeedRange(5.0, 10.0, 6), "linear", at_resonances=False))
    results: Any = SimpleNamespace(steady=with_names(to_dataset(response)))
    options = {"quantity": "largest_line", "line": "3 x rotation of engine"}
    sections = {"torque": {"signal": "coupling_torque shaft"}, "speed": {"signal": "body_speed propeller"}}
    outputs = outputs_of({name: options | own for name, own in sections.items()}, QUANTITIES)
    w = 3.0 * np.linspace(5.0, 10.0, 6)
    torque = abs(coupling_torque(w, 10.0))
    assert outputs["torque"].units == "N m"
    assert outputs["torque"].of(results) == pytest.approx(torque.max(), rel=1e-6)
    assert outputs["speed"].units == "rad/s"
    assert outputs["speed"].of(results) == pytest.approx((torque / (w * 80.0)).max(), rel=1e-6)


def test_studies_accept_signals_and_orders_of_shafts_and_refuse_others():
    """Before any point is computed; a run gives the part of a signal that is named."""
    gearbox = Gearbox.from_dict(ship())

    def output(**options: Any) -> dict[str, Any]:
        return dict(outputs_of({"own": options}, QUANTITIES))

    def errors(**options: Any) -> list[str]:
        return list(errors_of_signals(output(**options), gearbox, Choice("rigid")))

    line = {"quantity": "largest_line", "signal": "coupling_torque shaft"}
    assert errors(**line, line="3 x rotation of engine") == []
    assert "no such order" in errors(**line, line="3 x rotation of motor")[0]
    assert errors(quantity="rms", signal="coupling_torque shaft") == errors(quantity="rms", signal="body_speed") == []
    (error,) = errors(quantity="rms", signal="coupling_torque shift")
    assert "no such signal; did you mean 'coupling_torque shaft'?" in error
    speeds = np.stack([np.sin(np.arange(1000.0)), 3.0 * np.sin(np.arange(1000.0))], axis=1)
    run = xr.Dataset({"body_speed": (("time", "body"), speeds)}, {"body": ["engine", "propeller"]})
    results: Any = SimpleNamespace(run=run)
    one, largest = (output(quantity="rms", signal=name)["own"] for name in ("body_speed engine", "body_speed"))
    assert largest.of(results) == pytest.approx(3.0 * one.of(results), rel=1e-12)
    assert one.units == "rad/s"


def test_a_shaft_line_has_a_ranking_and_a_report_and_refuses_what_needs_meshes(tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    content = ship()
    # A run-up, long enough for windows of one order.
    content["load_cases"]["run"] |= {"torques_N_m": {"engine": 700.0}, "duration_s": 4.0, "start_speed_rpm": 60.0}
    (tmp_path / "ship.toml").write_text(toml_text(content), encoding="utf-8")
    options = ["ship.toml", "--speeds", "60:240", "--points", "30", "--variant", "rigid", "--json"]
    result = CliRunner().invoke(app, ["steady", *options])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    first = found["resonances"][0]
    assert first["line"] == "3 x rotation of engine"
    assert first["speed_rpm"] == pytest.approx(40.6 / 3.0 * 30.0 / np.pi, rel=0.01)
    assert found["sources_of_overall_dte"][0]["meshes"] == pytest.approx({"torque": 1.0}, abs=1e-6)
    refused = CliRunner().invoke(app, ["steady", *options, "--method", "nonlinear"])
    assert refused.exit_code == 2
    assert "meshes: the train has none" in " ".join(refused.output.split())
    run = CliRunner().invoke(app, ["run", "ship.toml", "--variant", "rigid"])
    assert run.exit_code == 0, run.output
    assert CliRunner().invoke(app, ["report", "ship.toml", "--stored"]).exit_code == 0
    groups = data_of(next(tmp_path.rglob("report.html")))["groups"]
    assert len(groups) == 2
    for group in groups:
        units = {own["words"]: own["unit"] for own in group["variants"]["rigid"]["channels"]}
        assert units["Torque: shaft"] == "N m"
        assert units["Speed: engine"] == units["Speed: propeller"] == "rad/s"


def test_a_shaft_line_without_excitation_has_no_steady_response():
    content = ship()
    del content["excitations"]
    assembly = assemble(Gearbox.from_dict(content), Choice("rigid"), {})
    with pytest.raises(SteadyError, match=r"no meshes and no \[excitations\]; add an excitation, or use exugear run"):
        response_of(assembly, SteadySettings(SpeedRange(5.0, 25.0, 4), "linear"))
