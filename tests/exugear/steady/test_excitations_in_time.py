"""Responses to stated loads against runs in time that start on them: by all methods, on and off resonances."""

from __future__ import annotations

import json
import tomllib
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.steady.balance.response import signals
from exugear.steady.findings import response_findings
from exugear.steady.point_solver import PointSolver
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import to_dataset
from exugear.steady.steady_response import follow_branch, response_of
from exugear.system.build import assemble
from exugear.system.modal_damping import with_damping_times
from exugear.system.system import Assembly

from ..cases import gear_trains
from ..cases import table as table_case
from ..cases.assembled import assembled
from ..cases.bearing import BEARING_CASE, NON_LINEAR
from ..cases.steady_runs import fitted, loose_pair, solver_of
from ..conftest import CASE

CYCLE = 2.0 * np.pi * np.arange(50) / 50
SHAPE = 1.0 + 0.05 * np.cos(CYCLE + 0.3) + 0.02 * np.cos(2 * CYCLE + 1.1) + 0.01 * np.cos(3 * CYCLE)
MEANS = {"stage_1": 3e8, "stage_2": 6e8}
RIPPLE = {"body": "input", "orders": [12], "torque_N_m": [5.0]}
"""A twentieth of the static torque; it meets modes of the `parallel` template at 204.8 and 225.1 rad/s."""
MACHINE = {"body": "rotor", "orders": [6, 12], "pole_pairs": 4, "torque_percent": [2.0, 0.5]}


def parallel(ripple: dict[str, Any], law: str = "line_of_action") -> Assembly:
    """Template `parallel` on bearings, with an electric machine where the ripple is that of one."""
    case = tomllib.loads(template("parallel")) | {"excitations": {"ripple": ripple}}
    if ripple["body"] == "rotor":
        case["bodies"]["rotor"] = {"spin_only": True, "inertia": {"discs": {"axial_kg_m2": 0.02}}}
        case["couplings"] = {"shaft": {"bodies": ["rotor", "input"], "stiffness_N_m_per_rad": 2e4}}
        case["static_load"]["torques_N_m"] = {"rotor": 100.0}
    gearbox = with_damping_times(Gearbox.from_dict(case))
    if law == "table":
        surfaces = {name: table_case.surface_of(gearbox, name, stiffness=mean) for name, mean in MEANS.items()}
        return assemble(gearbox, Choice("bushing", "table"), surfaces)
    return assemble(gearbox, Choice("bushing"), {name: mean * SHAPE for name, mean in MEANS.items()})


def differences(
    assembly: Assembly, solver: PointSolver, speed: float, order: float, duration: float, step: float
) -> tuple[float, float, float]:
    """Differences of an order over itself, and of all lines and their amplitudes over all lines, from a run in time."""
    response = solver.response(speed)
    found = solver if solver.state is None else solver.state
    measured, lines = fitted(
        found, response if solver.state is None else solver.state.response, duration, step, 0.5 * duration, assembly
    )
    model, response = found.model, solver.response(measured)
    if solver.state is not None:
        again = solver.state.on(model)
        response = again.response
    known = 2.0 * signals(model, response)[1:, 0]
    line = int(np.argmin(np.abs(model.lines.orders[1:] - order)))
    size = float(np.linalg.norm(known))
    own = float(abs(lines[line] - known[line]) / abs(known[line]))
    return own, float(np.linalg.norm(lines - known)) / size, float(np.linalg.norm(abs(lines) - abs(known))) / size


@pytest.mark.parametrize(
    ("ripple", "speed", "order", "most"),
    [
        *((RIPPLE, speed, 12.0, 5e-4) for speed in (150.0, 204.8, -225.1)),
        *((MACHINE, w, 24.0, 1e-3) for w in (58.18, 90.0)),
    ],
)
@pytest.mark.parametrize("method", ["parametric", "nonlinear"])
def test_a_ripple_on_two_stages_stays_on_its_steady_state_on_and_off_resonances(method, ripple, speed, order, most):
    """RK4 at 1/80 kHz. On the resonance at 225.1 rad/s the order has 85 um, 25 times as much as off it.

    The electric drive has orders 24 and 48 of a rotor on a coupling; its order 48 meets a mode at 58.18 rad/s.
    """
    assembly = parallel(ripple)
    solver = solver_of(assembly, sorted((0.5 * speed, 1.4 * speed)), method, 8)
    np.testing.assert_array_less(differences(assembly, solver, speed, order, 0.6, 1.0 / 80e3)[:2], (most, 1e-3))


@pytest.mark.validation
@pytest.mark.parametrize("speed", [150.0, 204.8])
def test_a_ripple_on_two_stages_with_tables_stays_on_its_steady_state(speed):
    """Method `nonlinear`, law `table`: RK4 at 1/120 kHz."""
    assembly = parallel(RIPPLE, "table")
    solver = solver_of(assembly, (100.0, 300.0), "nonlinear", 8)
    np.testing.assert_array_less(differences(assembly, solver, speed, 12.0, 0.6, 1.0 / 120e3)[:2], (1e-4, 2e-4))


@pytest.mark.parametrize("name", ["coupling_torque shaft", "body_speed rotor", "body_speed output"])
def test_torques_and_speeds_of_a_run_are_those_of_the_steady_response(name):
    """Electric drive in the resonance of its order 48: signals of a run that starts on its steady state, RK4.

    Method `nonlinear`: order 2 of the rotor, the ripple's order 24 less that of the mesh, is there as the torque turns
    with the vibration of its body; with `parametric` it alone is 1.3e-3 of the speed of the rotor.
    """
    assembly = parallel(MACHINE)
    solver = solver_of(assembly, (50.0, 150.0), "nonlinear", 8)
    measured, lines = fitted(solver, solver.response(58.18), 0.6, 1.0 / 80e3, 0.3, assembly, name)
    names = [signal.name for signal in solver.model.signal_names]
    known = 2.0 * signals(solver.model, solver.response(measured))[1:, names.index(name)]
    assert np.linalg.norm(known) > 0.0
    assert np.linalg.norm(lines - known) < 1e-3 * np.linalg.norm(known)


@pytest.mark.validation
@pytest.mark.parametrize(("speed", "duration", "step"), [(8.0, 0.6, 1.0 / 60e3), (4.259, 1.2, 1.0 / 40e3)])
def test_the_ripple_of_a_generator_stays_on_its_steady_state(grc, stiffness, speed, duration, step):
    """Order 12 of the high-speed shaft of the GRC, off and on a resonance (0.4 and 55 um)."""
    ripple = {"body": "hss", "orders": [12], "torque_N_m": [100.0]}
    assembly = assemble(grc.varied({"excitations": {"ripple": ripple}}), Choice("bushing"), stiffness)
    solver = solver_of(assembly, (0.6 * speed, 1.5 * speed), "parametric", 8)
    order = 12.0 * abs(solver.model.system.frame.speeds["hss"])
    np.testing.assert_array_less(differences(assembly, solver, speed, order, duration, step)[:2], (1e-3, 1e-3))


@pytest.mark.validation
def test_the_ripple_of_a_generator_on_flexible_shafts_stays_on_its_steady_state(grc_shafts, stiffness):
    """144 coordinates; at 4 rad/s order 12 of the high-speed shaft is at a peak of 48 um."""
    ripple = {"body": "hss", "orders": [12], "torque_N_m": [100.0]}
    assembly = assembled(grc_shafts.varied({"excitations": {"ripple": ripple}}), Choice("flexible"), stiffness)
    solver = solver_of(assembly, (2.4, 6.0), "parametric", 8)
    order = 12.0 * abs(solver.model.system.frame.speeds["hss"])
    np.testing.assert_array_less(differences(assembly, solver, 4.0, order, 0.4, 1.0 / 100e3)[:2], (1e-3, 1e-3))


def pair(ripple: dict[str, Any], variation: float = 1.0) -> tuple[Assembly, PointSolver]:
    """Pair with a table and a torque over the angle of a shaft, and its solver by the method `nonlinear`."""
    return loose_pair(variation=variation, excitations={"ripple": {"body": "shaft_1"} | ripple})


@pytest.mark.parametrize(
    ("ripple", "speed", "order"),
    [
        ({"orders": [12, 17], "torque_N_m": [5.0, 3.0]}, 150.0, 5.0),
        ({"orders": [12], "torque_N_m": [150.0]}, 150.0, 24.0),
        ({"orders": [20], "torque_N_m": [20.0]}, 150.0, 40.0),
        ({"body": "shaft_2", "orders": [6, 9], "torque_N_m": [5.0, 3.0]}, -150.0, 4.0),
    ],
)
def test_torques_turn_with_the_vibration_of_their_body_in_the_nonlinear_method(ripple, speed, order):
    """The angle that a torque adds to its body makes sums, differences and multiples of its orders.

    12 and 17 per revolution make 5; 150 N m at order 12, above the static torque, make 24; order 20 is that of the
    mesh; orders 6 and 9 of shaft 2 are 4 and 6 of shaft 1, which is 1.5 times as fast.
    """
    assembly, solver = pair(ripple)
    np.testing.assert_array_less(differences(assembly, solver, speed, order, 0.6, 1.0 / 240e3), (1e-3, 3e-4, 1e-4))


def test_teeth_that_part_under_a_ripple_stay_on_their_steady_state():
    """A quarter of the time without contact, in the resonance of the mesh; the ripple is a fifth of the torque."""
    assembly, solver = pair({"orders": [12], "torque_N_m": [20.0]}, variation=3.0)
    resonance = float(solver.model.system.eigenvalues(100.0).imag.max()) / 20.0
    for share in np.arange(1.16, 0.97, -0.04):
        solver.response(share * resonance)
    np.testing.assert_array_less(
        differences(assembly, solver, 0.96 * resonance, 12.0, 0.1, 1.0 / 1e6), (1e-3, 2e-3, 1e-3)
    )
    assert solver.state is not None
    assert solver.state.response.apart[0] > 0.2


@pytest.mark.validation
def test_a_continuation_under_a_ripple_passes_the_states_of_single_speeds():
    """From above the resonance of the mesh into contact loss; loads at their angles, which move by 4e-4 of them.

    Without contact loss both solve the same equations; with it, a continuation has other numbers of orders and samples.
    """
    _, solver = pair({"orders": [12], "torque_N_m": [20.0]}, variation=3.0)
    _, single = pair({"orders": [12], "torque_N_m": [20.0]}, variation=3.0)
    resonance = float(solver.model.system.eigenvalues(100.0).imag.max()) / 20.0
    branch = follow_branch(solver, 1.1 * resonance, 1.0 * resonance)
    assert not branch.ended
    parted = []
    for n in range(0, len(branch.speed), 4):
        speed = float(branch.speed[n])
        expected = np.abs(signals(single.model, single.response(speed))[1:, 0])
        found = solver.response_to(branch.readings[n], speed)
        amplitudes = np.abs(signals(solver.model, found)[1:, 0])
        parted.append(bool(found.apart.any()))
        least = 1e-3 if parted[-1] else 1e-6
        assert np.linalg.norm(amplitudes - expected) < least * np.linalg.norm(expected)
    assert set(parted) == {False, True}


def planetary(variant: str) -> Assembly:
    """Planetary stage with tables of sun and ring, and order 5 of the sun, 2 % of its torque; carrier locked."""
    content = gear_trains.planetary("ring")
    content["excitations"] = {"ripple": {"body": "sun", "orders": [5], "torque_N_m": [2.0]}}
    gearbox = Gearbox.from_dict(content)
    names = ("sun_planet", "planet_ring")
    tables = {name: table_case.surface_of(gearbox, name, stiffness=3e8, variation=0.5) for name in names}
    return assemble(gearbox, Choice(variant, "table"), tables)


@pytest.mark.parametrize("variant", ["rigid", "bushing"])
def test_a_torque_on_the_sun_of_a_planetary_stage_with_tables_stays_on_its_steady_state(variant):
    """Method `nonlinear`, RK4 at 1/120 kHz."""
    assembly = planetary(variant)
    solver = solver_of(assembly, (50.0, 150.0), "nonlinear", 8)
    np.testing.assert_array_less(differences(assembly, solver, 80.0, 5.0, 0.6, 1.0 / 120e3), (1e-3, 2e-3, 1e-3))


@pytest.mark.validation
@pytest.mark.long
def test_mesh_orders_under_an_excitation_lack_what_passing_planets_add_without_it():
    """The GRC with tables at 8 rad/s: a run has it, so that the difference goes where that is added (6e-3 to 1e-3).

    With the modal damping of the file: lighter damping leaves more of the start in the run.
    """
    grc = Gearbox.from_toml(CASE)
    ripple = {"body": "hss", "orders": [12], "torque_N_m": [100.0]}
    found = []
    for gearbox in (grc, grc.varied({"excitations": {"ripple": ripple}})):
        tables = {name: table_case.surface_of(gearbox, name) for name in table_case.STIFFNESS}
        assembly = assemble(gearbox, Choice("bushing", "table"), tables)
        found.append((assembly, solver_of(assembly, (1.0, 22.5), "nonlinear")))
    (_, still), (assembly, moved) = found
    speed, lines = fitted(moved, moved.response(8.0), 3.0, 1.0 / 120e3, 2.0, assembly)
    known = 2.0 * signals(moved.model, moved.response(speed))[1:, 0]
    model = still.model
    still.response(speed)
    passing, mean = (2.0 * signals(model, own.on(model).response)[1:, 0] for own in (still.state, still.state.averaged))
    bases = len(model.waves.base_orders)
    index = moved.model.lines.index[1:]
    place = model.lines.find(index[:, : len(model.lines.bases)])[0]
    own = ~index[:, bases:].any(axis=1) & (place > 0)
    missing = (lines - known)[own]
    size = np.linalg.norm(lines[own])
    assert np.linalg.norm(missing) > 5e-3 * size
    assert np.linalg.norm(missing - (passing - mean)[place[own] - 1]) < 1.5e-3 * size


@pytest.mark.parametrize(("variant", "told"), [("rigid", False), ("bushing", True)])
def test_planets_at_their_mean_under_excitations_are_told_where_they_could_bear_unequally(variant, told):
    settings = SteadySettings(SpeedRange(80.0, 90.0, 2), "nonlinear", at_resonances=False)
    findings = response_findings(to_dataset(response_of(planetary(variant), settings)))
    assert any("planets count at their mean under excitations" in own.text for own in findings) == told


def test_speeds_at_which_loads_do_not_settle_are_told():
    """A torque of 20 N m once per revolution turns the free pair too far at 5 rad/s, and does not at 400 rad/s."""
    assembly, _ = pair({"orders": [1], "torque_N_m": [20.0]})
    speeds = SpeedRange(5.0, 400.0, 2)
    data = to_dataset(response_of(assembly, SteadySettings(speeds, "nonlinear", at_resonances=False)))
    assert data["speed"].values.tolist() == [5.0, 400.0]
    assert data["loads_at_mean_angles"].values.tolist() == [1, 0]
    (told,) = [own.text for own in response_findings(data) if "mean speed" in own.text]
    assert told.startswith("meshes and excitations follow the mean speed alone up to 47.7 rpm: vibration would turn")
    assembly, _ = pair({"orders": [1], "torque_N_m": [1e-3]})
    data = to_dataset(response_of(assembly, SteadySettings(speeds, "nonlinear", at_resonances=False)))
    assert not data["loads_at_mean_angles"].any()
    assert data["energy_error"].max() < 1e-6
    assert not any("mean speed" in own.text for own in response_findings(data))


@pytest.mark.parametrize(("count", "number"), [(1, "1 speed"), (2, "2 speeds")])
def test_a_single_speed_with_a_remark_or_without_a_state_is_told_in_the_singular(count, number):
    assembly, _ = pair({"orders": [1], "torque_N_m": [1e-3]})
    data = to_dataset(
        response_of(assembly, SteadySettings(SpeedRange(390.0, 400.0, 2), "nonlinear", at_resonances=False))
    )
    data["remark"][:] = ["unstable"] * count + [""] * (2 - count)
    data.attrs["not_converged"] = json.dumps([{"speed": 395.0, "reason": "no solution"}] * count)
    texts = [own.text for own in response_findings(data)]
    assert f"no steady state found at {number} (blank in the diagrams), first 3770 rpm: no solution" in texts
    assert f"{number} with warnings, first 3720 rpm: unstable" in texts


@pytest.mark.validation
def test_a_torque_moves_rolling_bearings_evaluated_in_time_as_in_a_run():
    """Method `nonlinear`: balls and rollers without clearance; order 7 is beside all orders of the mesh."""
    content = tomllib.loads(BEARING_CASE) | {
        "excitations": {"ripple": {"body": "shaft_1", "orders": [7], "torque_N_m": [5.0]}}
    }
    gearbox = Gearbox.from_dict(content).varied(NON_LINEAR)
    assembly = assemble(gearbox, Choice("bushing"), {"spur": 3e8 * SHAPE})
    solver = solver_of(assembly, (50.0, 200.0), "nonlinear")
    np.testing.assert_array_less(differences(assembly, solver, 100.0, 7.0, 0.3, 1.0 / 120e3)[:2], (1e-3, 1e-3))
