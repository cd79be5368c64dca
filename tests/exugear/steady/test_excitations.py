"""Torques over the angle of a body in the steady-state response and in runs."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.steady.balance.response import signals
from exugear.steady.crossings import contributions
from exugear.steady.findings import response_findings
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import to_dataset, with_names
from exugear.steady.steady_response import response_of
from exugear.system.build import assemble
from exugear.system.loads import LoadTable

from ..cases.both_ways import assert_both_solvers_move_alike
from ..cases.spur import SPUR_CASE
from ..cases.steady_runs import SHAPE, fitted, line_at, solver_of

RIPPLE = {"body": "shaft_1", "orders": [3, 6], "pole_pairs": 2, "torque_N_m": [1.0, 5.0], "phase_deg": [0.0, 30.0]}
SPEEDS = (50.0, 150.0)


def gearbox(**changes):
    return Gearbox.from_dict(tomllib.loads(SPUR_CASE) | {"excitations": {"ripple": RIPPLE | changes}})


def spur_assembly(variation=1.0, **changes):
    return assemble(gearbox(**changes), Choice("bushing"), {"spur": 3e8 * (1.0 + variation * (SHAPE - 1.0))})


def test_two_inertias_on_a_mesh_answer_as_in_closed_form():
    """Rigid supports, constant stiffness: r_1 (theta_1 - theta_2 / i) of two inertias on the spring of the mesh.

    The transmission error is r_1 theta_1 + r_2 theta_2 on the line of action; a torque T on J_1 moves it by
    T r_1 / J_1 / (w_0^2 - w^2 + 2 i D w_0 w) with w_0^2 = k (r_1^2 / J_1 + r_2^2 / J_2).
    """
    content = tomllib.loads(SPUR_CASE) | {
        "excitations": {"ripple": {"body": "shaft_1", "orders": [7], "torque_N_m": [4.0]}}
    }
    content["damping"] = {"mesh_time_s": 1e-5}
    assembly = assemble(Gearbox.from_dict(content), Choice("rigid"), {"spur": np.array([3e8])})
    solver = solver_of(assembly, (20.0, 400.0), "linear", 1)
    r_1, r_2 = (0.5 * 3e-3 * teeth * np.cos(np.radians(20.0)) for teeth in (20, 30))
    stiffness = 3e8 * (1.0 + 0j)
    for speed in (50.0, 200.0, 390.0):
        w = 7.0 * speed
        spring = stiffness * (1.0 + 1j * w * 1e-5)
        expected = 4.0 * r_1 / 1e-2 / (spring * (r_1**2 / 1e-2 + r_2**2 / 3e-2) - w**2)
        overall = 2.0 * signals(solver.model, solver.response(speed))[:, 0]
        assert abs(overall[line_at(solver.model, 7.0)]) == pytest.approx(abs(expected), rel=1e-6)


def test_a_ripple_started_on_its_linear_steady_state_stays_there():
    """RK4 at 1/60 kHz; the order with 5 N m, a twentieth of the static torque. Other methods: all lines, in time."""
    assembly = spur_assembly()
    solver = solver_of(assembly, SPEEDS, "linear")
    speed, lines = fitted(solver, solver.response(88.0), 0.8, 1.0 / 60e3, 0.4, assembly)
    known = 2.0 * signals(solver.model, solver.response(speed))[1:, 0]
    line = line_at(solver.model, 12.0) - 1
    assert abs(lines[line] - known[line]) < 5e-4 * abs(known[line])


def test_both_solvers_have_the_same_torque_over_the_angle():
    assembly = spur_assembly()
    rng = np.random.default_rng(5)
    q, v = 1e-6 * rng.normal(size=(2, assembly.size))
    q[assembly.spin["shaft_1"]] = 0.7
    v[assembly.spin["shaft_1"]] = 80.0
    loads = LoadTable({"shaft_1": 100.0}, varying=assembly.varying_loads)
    applied = loads.generalized(assembly, 0.0, q, v)[assembly.spin["shaft_1"]]
    expected = 100.0 + np.cos(6 * 0.7) + 5.0 * np.cos(12 * 0.7 + np.pi / 6)
    assert applied == pytest.approx(expected, rel=1e-12)
    assert_both_solvers_move_alike(assembly, q, v, spur_assembly(enabled=False))


def test_contributions_name_the_torque_beside_the_meshes():
    """At the order of the ripple alone it makes all of the amplitude; at a mesh order nothing."""
    model = solver_of(spur_assembly(), SPEEDS, "parametric").model
    for order, shares in ((12.0, {"spur": 0.0, "ripple": 1.0}), (20.0, {"spur": 1.0})):
        assert contributions(model, 90.0, line_at(model, order)).meshes == pytest.approx(shares, abs=1e-9)


def test_resonances_of_a_ripple_are_looked_for_even_where_the_mesh_does_not_vary():
    response = response_of(spur_assembly(variation=0.0), SteadySettings(SpeedRange(50.0, 150.0, 12), "parametric"))
    assert response.crossings
    assert response.base_names == ("spur", "rotation of shaft_1")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"body": "nowhere"}, "excitations.ripple: no body 'nowhere'"),
        ({"body": "ground"}, "excitations.ripple.body = 'ground': a load on the ground has no effect"),
        ({"orders": [0, 6]}, "excitations.ripple.orders"),
        ({"orders": [1.25, 6]}, "excitations.ripple: orders: 1.25 is neither a whole number nor a half"),
        ({"torque_N_m": [1.0]}, "set as many torque_N_m as orders: 1 for 2 orders"),
        ({"phase_deg": [1.0]}, "set as many phase_deg as orders: 1 for 2 orders"),
        ({"torque_N_m": [1.0, float("nan")]}, "excitations.ripple.torque_N_m"),
    ],
)
def test_an_impossible_excitation_is_refused_by_its_key(changes, said):
    with pytest.raises(GearboxFileError, match=said.replace("[", r"\[").replace(".", r"\.")):
        gearbox(**changes)


def test_a_warning_advises_the_method_nonlinear():
    """Ninety newton metres part the teeth, which the methods linear in the deflections neglect."""
    run_out = {"one": {"body": "shaft_1", "runout_um": 1.0}}
    for deviations in ({}, run_out):
        content = tomllib.loads(SPUR_CASE) | {"excitations": {"ripple": RIPPLE | {"torque_N_m": [1.0, 90.0]}}}
        cycle = 0.08 * np.cos(2.0 * np.pi * np.arange(50) / 50)
        strong = assemble(
            Gearbox.from_dict(content | {"deviations": deviations}), Choice("bushing"), {"spur": 3e8 * (1.0 + cycle)}
        )
        response = response_of(strong, SteadySettings(SpeedRange(60.0, 70.0, 3), "parametric", at_resonances=False))
        texts = [finding.text for finding in response_findings(with_names(to_dataset(response)))]
        (advised,) = [text for text in texts if "neglects contact loss" in text]
        assert advised.endswith("use --mesh-model table --method nonlinear")
        assert "at most 50 % of the time" in advised
