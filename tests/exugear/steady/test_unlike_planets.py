"""Planets that are fewer than three or unequally spaced in the steady-state response: against runs and closed form."""

from __future__ import annotations

import json

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.steady.balance.load_sharing import mean_planet_forces
from exugear.steady.balance.neighbours import with_needed_neighbours
from exugear.steady.balance.response import dissipated_and_given, parametric_response, signals
from exugear.steady.damping_band import damping_limits
from exugear.steady.findings import response_findings
from exugear.steady.mean_system.mean_system import unsuitable
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.steady.point_solver import PointSolver
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import to_dataset
from exugear.steady.steady_response import response_of
from exugear.system.build import assemble
from exugear.system.statics import static_state

from ..cases import gear_trains
from ..cases.case_mutations import toml_text
from ..cases.command import exugear
from ..cases.steady_runs import apart, apart_over_time, fitted, solver_of

CYCLE = 2.0 * np.pi * np.arange(50) / 50
SHAPE = 1.0 + 0.08 * np.cos(CYCLE) + 0.03 * np.sin(2 * CYCLE)
UNLIKE_HELD = {"matrix": np.diag([1e8, 3e8, 1e8, 1e6, 2e6, 0.0]).tolist()}
"""Stiffness of a bearing three times as high along y as along x."""


def placed(content, angles):
    """Place the planets of a train at some angles, degrees."""
    for body in content["bodies"].values():
        if "planet_angles_deg" in body:
            start = body["planet_angles_deg"][0]
            body["planet_angles_deg"] = [start + angle for angle in angles]
    return content


def on_unlike_bearings(content):
    """Let all bodies but planets turn in bearings that are three times as stiff along y as along x."""
    for bearing in content["bearings"].values():
        if "on" not in bearing:
            bearing["stiffness"] = UNLIKE_HELD
    return content


def train(content, shape=SHAPE, variant="bushing", **more):
    gearbox = Gearbox.from_dict(content | more)
    return assemble(gearbox, Choice(variant), dict.fromkeys(gearbox.pairs, 4e8 * shape))


def lines_by_order(solver, speed):
    """Lines of the overall error of a response by their multiples of the bases."""
    lines = signals(solver.model, solver.response(speed))[:, 0]
    return {tuple(index): line for index, line in zip(solver.model.lines.index.tolist(), lines, strict=True)}


@pytest.mark.validation
def test_equal_planets_taken_one_by_one_give_the_response_of_their_waves(monkeypatch):
    """Three equal planets on bearings that are stiffer along y: the response in multi-blade coordinates is another way.

    Neighbours up to six carrier revolutions leave out 1e-6.
    """
    content = on_unlike_bearings(gear_trains.planetary("ring"))
    known = lines_by_order(solver_of(train(content), (50.0, 150.0), "parametric", 5), 90.0)
    monkeypatch.setattr("exugear.steady.mean_system.planet_sets.equally_spaced", lambda planets: False)
    solver = solver_of(train(content), (50.0, 150.0), "parametric", 5)
    assert all(planets.is_single for planets in solver.model.system.frame.sets)
    found = lines_by_order(solver, 90.0)
    size = np.linalg.norm([line for index, line in known.items() if any(index)])
    assert max(abs(found[(*index, 0)] - line) for index, line in known.items() if any(index)) < 1e-5 * size
    beside = [abs(line) for index, line in found.items() if index[-1]]
    assert beside
    assert max(beside) < 1e-5 * size


def test_equally_spaced_planets_may_be_listed_against_the_sense_of_rotation():
    """The response is that of the same planets in the order of their angles, in multi-blade coordinates as well."""
    known, found = (
        solver_of(train(placed(gear_trains.planetary("ring"), angles)), (50.0, 150.0), "parametric", 5)
        for angles in ((0.0, 120.0, 240.0), (0.0, -120.0, -240.0))
    )
    assert [planets.waves for planets in found.model.system.frame.sets] == [3]
    lines, others = lines_by_order(known, 90.0), lines_by_order(found, 90.0)
    size = np.linalg.norm([line for index, line in lines.items() if any(index)])
    assert max(abs(others[index] - line) for index, line in lines.items() if any(index)) < 1e-9 * size


def force_apart(solver, speed, assembly, name):
    """Difference of the amplitudes of all lines of a signal between run and response, their size, and the mean."""
    response = solver.response(speed)
    measured, lines = fitted(solver, response, 1.6, 1.0 / 60e3, 0.8, assembly, name)
    column = [own.name for own in solver.model.signal_names].index(name)
    known = 2.0 * signals(solver.model, solver.response(measured))[:, column]
    difference = np.linalg.norm(abs(lines) - abs(known[1:]))
    return float(difference), float(np.linalg.norm(known[1:])), float(0.5 * abs(known[0]))


TRAINS = {
    "two planets": (gear_trains.planetary("ring", 2), 90.0),
    "two planets, backwards": (gear_trains.planetary("ring", 2), -90.0),
    "two planets, sun held": (gear_trains.planetary("sun", 2), 90.0),
    "unevenly spaced": (gear_trains.unevenly_spaced(), 90.0),
    "stepped planets, unevenly spaced": (
        placed(gear_trains.stepped_planets(), [0.0, 120.0, 524 * 360.0 / 726]),
        90.0,
    ),
    "meshing planets, two of each": (placed(gear_trains.meshing_planets(), [0.0, 180.0]), 90.0),
}


@pytest.mark.validation
@pytest.mark.parametrize("kind", TRAINS)
def test_trains_with_unlike_planets_stay_on_their_steady_state(kind):
    """Constant speed, RK4 at 1/60 kHz, the last 0.8 of 1.6 s; bearings of sun and carrier are stiffer along y.

    Amplitudes of the overall error, all orders together, and of the mesh force of each planet. The train isolates the
    meshes at this speed: their forces vary by less than a thousandth, of which a twentieth is of second order.
    """
    content, speed = TRAINS[kind]
    assembly = train(on_unlike_bearings(content))
    solver = solver_of(assembly, tuple(sorted((0.5 * speed, 2.0 * speed))), "parametric", 6)
    assert apart(solver, speed, 1.6, 1.0 / 60e3, 0.8, assembly)[1] < 5e-3
    for name in (solver.model.waves.waves[n].name for n in solver.model.waves.force_waves):
        difference, vibration, mean = force_apart(solver, speed, assembly, f"mesh_force {name}")
        assert difference < 2e-3 * vibration + 5e-5 * mean


OTHER_EXCITATIONS = {
    "displaced pin": {"pins": {"late": {"body": "planet_1", "tangential_um": 4.0, "radial_um": 2.0}}},
    "run-out": {"deviations": {"sun": {"body": "sun", "gear": "sun", "runout_um": 5.0}}},
    "torque ripple": {"excitations": {"ripple": {"body": "sun", "orders": [5], "torque_N_m": [1.0]}}},
    "unbalance of a planet": {"excitations": {"balance": {"body": "planet_2", "z_mm": 0.0, "unbalance_g_mm": 300.0}}},
}


@pytest.mark.validation
@pytest.mark.parametrize("more", OTHER_EXCITATIONS.values(), ids=OTHER_EXCITATIONS)
def test_other_excitations_stay_on_the_steady_state_of_two_planets(more):
    """As above, over time: orders of sun and carrier coincide. All are small enough to be linear.

    A pin is part of the static state here, since each planet has its own.
    """
    assembly = train(on_unlike_bearings(gear_trains.planetary("ring", 2)), **more)
    solver = solver_of(assembly, (45.0, 180.0), "parametric", 6)
    assert apart_over_time(solver, 90.0, 1.6, 1.0 / 60e3, 0.8, assembly) < 3e-3


def test_the_power_of_the_meshes_is_what_the_dampers_dissipate():
    solver = solver_of(train(on_unlike_bearings(gear_trains.planetary("ring", 2))), (45.0, 180.0), "parametric", 4)
    taken, given = dissipated_and_given(solver.model, solver.response(90.0))
    assert taken == pytest.approx(given, rel=1e-6)


@pytest.mark.validation
def test_both_ends_of_the_range_of_damping_are_those_of_other_dampers():
    """Half and twice the damping of meshes and bearings, what varies with the carrier included."""
    content = on_unlike_bearings(gear_trains.unevenly_spaced())

    def solver(factor):
        damping = {"mesh_time_s": factor * 4e-6, "bearing_time_s": factor * 8e-6}
        return solver_of(train(content, damping=damping), (45.0, 180.0), "parametric", 1)

    model = solver(1.0).model
    for limit, factor in zip(damping_limits(model.system), (0.5, 2.0), strict=True):
        damped = model.with_system(limit)
        found = signals(damped, parametric_response(damped, damped.at(150.0)))[1:, 0]
        other = solver(factor)
        known = signals(other.model, other.response(150.0))[1:, 0]
        assert np.linalg.norm(found - known) < 1e-4 * np.linalg.norm(known)


@pytest.mark.validation
def test_slow_planets_share_the_load_as_in_the_static_state():
    """Unevenly spaced planets on bearings that are equal in all directions: the state stands still on the carrier.

    At a hundredth of the lowest natural frequency, stiffness constant over the cycle.
    """
    assembly = train(gear_trains.unevenly_spaced(), np.ones(1))
    solver = solver_of(assembly, (0.5, 2.0), "parametric", 2)
    lines = 2.0 * signals(solver.model, solver.response(1.0))
    lines[0] *= 0.5
    found = mean_planet_forces(solver.model, lines, 1.0)
    q = static_state(assembly).q
    static = dict(zip(assembly.mesh_names, assembly.mesh_states(q, np.zeros_like(q))[:, 4].tolist(), strict=True))
    for family in ("sun_planet", "planet_ring"):
        expected = np.array([static[f"{family}_{n + 1}"] for n in range(3)])
        loads = found[family]
        np.testing.assert_allclose(loads, expected, rtol=1e-5)
        assert expected.max() / expected.mean() > 1.02


@pytest.mark.validation
def test_a_stored_response_says_what_varies_and_how_planets_share_the_load():
    assembly = train(on_unlike_bearings(gear_trains.unevenly_spaced()))
    data = to_dataset(response_of(assembly, SteadySettings(SpeedRange(40.0, 60.0, 2), harmonics=1)))
    assert data.attrs["varying_carrier"] == "carrier"
    assert set(json.loads(data.attrs["load_sharing"])) == {"sun_planet", "planet_ring"}
    said = " ".join(finding.text for finding in response_findings(data))
    assert "stiffness varies with the angle of carrier" in said
    assert "unequally loaded planets: K_gamma" in said
    assert "flexible ring" not in said


def test_the_method_without_the_angle_of_the_carrier_is_refused():
    settings = SteadySettings(SpeedRange(40.0, 60.0, 2), "linear")
    with pytest.raises(SteadyError, match="bodies.planet: .* the method linear does not include; use --method param"):
        response_of(train(gear_trains.planetary("ring", 2)), settings)


def test_a_refused_method_ends_with_code_2_and_writes_nothing(tmp_path):
    case = tmp_path / "gearbox.toml"
    case.write_text(toml_text(gear_trains.planetary("ring", 2)), encoding="utf-8")
    folder = tmp_path / "results"
    speeds = ("--speeds", "300:600", "--points", "3")
    found = exugear("steady", case, "--variant", "bushing", *speeds, "--method", "linear", "--out", folder)
    assert found.exit_code == 2
    assert "use --method parametric" in " ".join(found.output.split())
    assert not folder.exists()


def test_what_is_not_supported_is_said_before_any_work():
    assert unsuitable(train(gear_trains.planetary("ring", 2))) == ""
    content = gear_trains.wind()
    for planet in ("planet_1", "planet_2"):
        content["bodies"][planet]["planet_angles_deg"] = [0.0, 180.0]
    said = unsuitable(train(content))
    assert said.startswith("bodies.carrier_1, bodies.middle: planets that are fewer than three or unequally spaced on")


@pytest.mark.validation
def test_a_run_of_the_gearbox_with_two_planets_stays_on_its_steady_state(grc, stiffness):
    """Constant speed of 10 rad/s, RK4 at 1/120 kHz, the last 1.0 of 2.0 s; catalogue bearings, which are anisotropic.

    Twice the carrier's order is a fifth of the largest order, orders beside those of the meshes are a twentieth.
    """
    two = grc.varied({"bodies.planet.planet_angles_deg": [0.0, 180.0]})
    assembly = assemble(two, Choice("bushing"), stiffness)
    model = solver_of(assembly, (9.0, 11.0), "parametric", 6).model
    solver = PointSolver(with_needed_neighbours(model, np.array([9.0, 10.0, 11.0]))[0], "parametric")
    overall = {index: abs(line) for index, line in lines_by_order(solver, 10.0).items() if any(index)}
    assert overall[0, 0, 0, 2] > 0.1 * max(overall.values())
    assert apart(solver, 10.0, 2.0, 1.0 / 120e3, 1.0, assembly)[1] < 2e-3
