"""Friction of the teeth in runs: both solvers alike, its power by the loss factor, lines as in the steady response."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import friction_warning, summarise_loads
from exugear.gearbox.reading import GearboxFileError
from exugear.results.run_file import read_run
from exugear.steady.balance.response import signals
from exugear.steady.point_solver import PointSolver, harmonic_balance_model
from exugear.system.build import assemble
from exugear.system.loads import LoadTable
from exugear.system.signals import BALANCE_TERMS, energy_residual
from exugear.system.statics import locked_equilibrium
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import Observer
from exugear.transient.runup import simulate
from fe_ste.transmission_error.sliding import table_loss_factor

from ..cases.both_ways import (
    assert_signals_are_those_of_the_plain_kernels,
    compiled_states,
    errors_and_mesh_forces,
    exudyn_states,
    relative_error,
)
from ..cases.command import exugear
from ..cases.spur import SPUR_CASE
from ..steady.test_steady_in_time import fitted
from ..steady.test_tooth_friction import COEFFICIENT, curves_with_friction, line_loads, with_friction

OF_FRICTION = 4
"""Column of its power among those that `Observer.observe` returns."""


def rolling_state(assembly: Assembly, speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Static state under the static load, with the rates of the rolling gear train at a speed of the input (rad/s)."""
    gearbox = assembly.gearbox
    q = locked_equilibrium(assembly, gearbox.case.static_load.torques_N_m, tuple(gearbox.locked))
    turns = gearbox.train.rolling_speeds(gearbox.case.overall.input, speed)
    return q, assembly.rolling_velocity(q, turns)


@pytest.mark.parametrize("variant", ["rigid", "bushing"])
def test_both_solvers_and_the_plain_kernels_have_the_same_friction(grc: Gearbox, stiffness: dict, variant: str) -> None:
    assembly = assemble(with_friction(grc), Choice(variant), curves_with_friction(grc, stiffness))
    q, v = rolling_state(assembly, 2.0)
    load = {"carrier": 240e3, "hss": -2800.0}
    steps, step = 200, 1.0 / 60e3
    states = compiled_states(assembly, q, v, load, steps, step)
    powers = assert_signals_are_those_of_the_plain_kernels(assembly, *states, load)
    assert powers[:, OF_FRICTION].min() > 0.0
    by_exudyn = [np.ascontiguousarray(own) for own in exudyn_states(assembly, q, v, load, steps, step)]
    observer = Observer(assembly, LoadTable(load))
    columns = errors_and_mesh_forces(assembly)
    one, two = (observer.observe(np.zeros(steps + 1), *own)[0][:, columns] for own in (states, by_exudyn))
    assert relative_error(one, two) < 1e-5


def test_friction_takes_what_the_loss_factor_says(grc: Gearbox, stiffness: dict) -> None:
    """Power of friction = sum of mu H_V P over the meshes, if each mesh transmits its static force.

    Where the mesh is in its cycle decides on the power at an instant: it is the mean over the cycle that counts, here
    of states with equal deflections at many angles.
    """
    constant = {name: values.mean() * np.ones(len(values)) for name, values in stiffness.items()}
    assembly = assemble(with_friction(grc), Choice("rigid"), curves_with_friction(grc, constant))
    q, v = rolling_state(assembly, 2.0)
    angles = np.linspace(0.0, np.pi, 997)[:, None]
    states = q + angles * v
    load = LoadTable(grc.case.static_load.torques_N_m)
    powers = Observer(assembly, load).observe(np.zeros(len(states)), states, np.broadcast_to(v, states.shape).copy())[2]
    turns = grc.train.rolling_speeds(grc.case.overall.input, 2.0)
    forces = grc.train.static_mesh_forces()
    lost = 0.0
    for mesh in grc.meshes:
        relative = abs(turns[mesh.pinion] - turns.get(mesh.frame, 0.0))
        power = abs(forces[mesh.name]) * relative * mesh.pair.pinion.base_radius
        lost += COEFFICIENT * table_loss_factor(mesh.pair, line_loads(mesh.pair, 9)) * power
    assert powers[:, OF_FRICTION].mean() == pytest.approx(lost, rel=1e-2)


@pytest.mark.parametrize("load", [100.0, -100.0], ids=["flank +1", "flank -1"])
def test_a_run_has_the_lines_of_the_steady_response(load: float) -> None:
    """Friction alone excites. The response neglects its effect on itself, which is of the order of mu."""
    spur = Gearbox.from_dict(tomllib.loads(SPUR_CASE)).varied({"static_load.torques_N_m.shaft_1": load})
    gearbox = with_friction(spur, 0.01)
    assembly = assemble(gearbox, Choice("bushing"), curves_with_friction(gearbox, {"spur": 3e8 * np.ones(50)}, 1))
    solver = PointSolver(harmonic_balance_model(assembly, np.array([50.0, 150.0]), 20, 3), "nonlinear")
    response = solver.response(60.0)
    speed, lines = fitted(solver, response, 0.8, 1.0 / 60e3, 0.3)
    known = 2.0 * signals(solver.model, response)[1:, 0]
    assert speed == pytest.approx(60.0, rel=1e-3)
    assert np.linalg.norm(lines - known) < 0.03 * np.linalg.norm(known)
    assert np.linalg.norm(known) > 1e-9


def test_the_energy_balance_has_a_term_of_friction(tmp_path) -> None:
    spur = with_friction(Gearbox.from_dict(tomllib.loads(SPUR_CASE)))
    curves = curves_with_friction(spur, {"spur": 3e8 * np.ones(50)}, 1)
    run = simulate(spur, Choice("bushing"), curves, tmp_path, duration=0.2)
    data, _ = read_run(run.path, ("time", "input_speed", *BALANCE_TERMS))
    assert float(data["tooth_friction_work"][-1]) > 0.0
    assert energy_residual(data) < 1e-4


def test_runs_with_friction_need_line_loads(tmp_path, grc: Gearbox, stiffness: dict) -> None:
    with pytest.raises(GearboxFileError, match=r"damping.tooth_friction = 0.05: pair .* has no line loads"):
        simulate(with_friction(grc), Choice("rigid"), stiffness, tmp_path, duration=0.1)
    path = tmp_path / "gearbox.toml"
    text = SPUR_CASE + "\n[damping]\nmodal_percent = 2.0\ntooth_friction = 0.05\n"
    path.write_text(text, encoding="utf-8")
    for command in ("run", "steady"):
        out = tmp_path / command
        refused = exugear(command, path, "--variant", "bushing", "--mesh-model", "iso6336", "--out", out)
        assert refused.exit_code == 2 and "requires line loads over the mesh cycle" in refused.stderr
        assert not out.exists()
    stated = "centre_distance_mm = 75.0, stiffness = { mean_N_per_m = 3e8 } }"
    path.write_text(text.replace("centre_distance_mm = 75.0 }", stated), encoding="utf-8")
    refused = exugear("run", path, "--variant", "bushing", "--out", tmp_path / "run")
    assert refused.exit_code == 2 and "remove pairs.spur.stiffness" in refused.stderr


def test_torques_below_the_friction_are_named_before_a_run_and_hold_the_gearbox(tmp_path) -> None:
    """The surplus of 0.3 N m is below mu H_V P / speed, about 1 N m at a coefficient of 0.05."""
    gearbox = with_friction(Gearbox.from_dict(tomllib.loads(SPUR_CASE)), 0.05)
    gearbox = gearbox.varied({"load_cases.run_up.torques_N_m": {"shaft_1": 100.0, "shaft_2": 149.5}})
    case = gearbox.load_cases["run_up"]
    assert "is below the friction of the teeth" in friction_warning(gearbox, summarise_loads(gearbox, case))
    free = gearbox.varied({"damping.tooth_friction": 0.001})
    assert not friction_warning(free, summarise_loads(free, case))
    ends = []
    for one in (gearbox, free):
        curves = curves_with_friction(one, {"spur": 3e8 * np.ones(50)}, 1)
        run = simulate(one, Choice("bushing"), curves, tmp_path / str(len(ends)), duration=0.2)
        ends.append(abs(float(read_run(run.path, ("input_speed",))[0]["input_speed"][-1])))
    assert ends[0] < 0.2 * ends[1]
