"""Torque ripple of machines: shares of the static torque, powers of the speed, tables, reactions, half orders."""

from __future__ import annotations

import html
import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from exugear.cli.app import app
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.steady.balance.response import signals
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import load_response
from exugear.steady.steady_response import response_of
from exugear.system.build import assemble
from exugear.system.gearbox_checks import gearbox_warnings
from exugear.system.kernels.coordinates import SPIN
from exugear.system.loads import LoadTable
from exugear.system.system import Assembly, input_hash

from ..cases.assembled import assembled
from ..cases.both_ways import assert_both_solvers_move_alike
from ..cases.box import box_content
from ..cases.case_mutations import toml_text
from ..cases.spur import SPUR_CASE
from ..cases.steady_runs import SHAPE, apart, line_at, solver_of

SPEEDS = (50.0, 150.0)
HEADER = "speed_rpm,torque_N_m,order,amplitude_N_m,phase_deg\n"
TABLE = HEADER + "".join(
    f"{speed},{torque},{order},{amplitude * torque * (1.0 + 1e-3 * speed)},{phase + 0.1 * speed}\n"
    for order, amplitude, phase in ((12, 0.02, 300.0), (24, 0.01, 10.0))
    for torque in (50, 200)
    for speed in (400, 900, 1500)
)


def content(**excitation: Any) -> dict[str, Any]:
    return tomllib.loads(SPUR_CASE) | {"excitations": {"ripple": {"body": "shaft_1"} | excitation}}


def assembly_of(gearbox: Gearbox) -> Assembly:
    return assemble(gearbox, Choice("bushing"), {"spur": 3e8 * SHAPE})


def from_file(folder: Path, table: str | bytes, **excitation: Any) -> Gearbox:
    """Read a gearbox whose excitation has a table."""
    (folder / "ripple.csv").write_bytes(table.encode() if isinstance(table, str) else table)
    return Gearbox.from_toml(written(folder, content(table="ripple.csv", **excitation)))


def written(folder: Path, case: dict[str, Any]) -> Path:
    """Gearbox file of a content, with a mesh stiffness that hardly varies."""
    case["pairs"]["spur"]["stiffness"] = {"mean_N_per_m": 3e8, "cosine_N_per_m": [2e6]}
    file = folder / "gearbox.toml"
    file.write_text(toml_text(case), encoding="utf-8")
    return file


def applied(assembly: Assembly, body: str, angle: float, speed: float) -> np.ndarray:
    """Generalized forces at an angle and a speed of a body."""
    q, v = np.zeros((2, assembly.size))
    q[assembly.spin[body]], v[assembly.spin[body]] = angle, speed
    return LoadTable(varying=assembly.varying_loads).generalized(assembly, 0.0, q, v)


@pytest.mark.parametrize(("body", "torque"), [("shaft_1", 100.0), ("shaft_2", 150.0)])
def test_a_share_counts_of_the_torque_that_acts_on_the_body_or_locks_it(body, torque):
    """Shaft 1 has 100 N m; shaft 2 is locked and takes 100 N m x 30 / 20."""
    assembly = assembly_of(Gearbox.from_dict(content(body=body, orders=[48], torque_percent=[0.5])))
    found = applied(assembly, body, 0.1, 80.0)[assembly.spin[body]]
    assert found == pytest.approx(0.005 * torque * np.cos(4.8), rel=1e-9)


def test_amplitudes_grow_with_the_power_of_the_speed_from_the_stated_one():
    ripple = {"orders": [4], "torque_N_m": [3.0], "speed_exponent": 2.0, "reference_speed_rpm": 600.0}
    assembly = assembly_of(Gearbox.from_dict(content(**ripple)))
    spin = assembly.spin["shaft_1"]
    for speed in (np.pi * 20.0, -np.pi * 10.0):
        expected = 3.0 * (speed / np.pi / 20.0) ** 2 * np.cos(4 * 0.3)
        assert applied(assembly, "shaft_1", 0.3, speed)[spin] == pytest.approx(expected, rel=1e-12)


def test_a_table_is_linear_over_speed_and_torque_with_the_nearest_phase(tmp_path):
    """Rows at 900 and 1500 rpm, 50 and 200 N m; amplitudes are proportional to the torque, linear over the speed.

    The phases 390 and 450 degrees are written as 30 and 90: they go on from 340 at 400 rpm.
    """
    wrapped = TABLE.replace(",390.0\n", ",30.0\n").replace(",450.0\n", ",90.0\n")
    assert wrapped != TABLE
    assembly = assembly_of(from_file(tmp_path, wrapped))
    speed = 1200.0 * np.pi / 30.0
    expected = 100.0 * 2.2 * (0.02 * np.cos(12 * 0.2 + np.radians(420.0)) + 0.01 * np.cos(24 * 0.2 + np.radians(130.0)))
    for sense in (1.0, -1.0):
        found = applied(assembly, "shaft_1", 0.2, sense * speed)[assembly.spin["shaft_1"]]
        assert found == pytest.approx(expected, rel=1e-12)


def test_a_table_has_the_response_of_the_ripple_that_it_states(tmp_path):
    """At 1200 rpm as above, beside 4.4 and 2.2 N m stated for this speed."""
    speed = 1200.0 * np.pi / 30.0
    stated = {"orders": [12, 24], "torque_N_m": [4.4, 2.2], "phase_deg": [420.0, 130.0]}
    found = []
    for gearbox in (from_file(tmp_path, TABLE), Gearbox.from_dict(content(**stated))):
        solver = solver_of(assembly_of(gearbox), SPEEDS, "parametric")
        found.append(signals(solver.model, solver.response(speed)))
    np.testing.assert_allclose(found[0], found[1], rtol=0.0, atol=1e-12 * np.abs(found[1]).max())


@pytest.mark.parametrize(
    "ripple",
    [
        {"orders": [0.5, 1.5], "torque_N_m": [0.2, 0.15], "phase_deg": [0.0, 40.0]},
        {"orders": [12], "torque_percent": [4.0], "speed_exponent": 1.0, "reference_speed_rpm": 900.0},
    ],
)
def test_a_run_started_on_the_steady_state_stays_there(ripple):
    """RK4 at 1/60 kHz over all lines; half orders repeat after two revolutions.

    Their torque is small: it turns the shaft by some 1e-3 rad, and the run takes it at the angle that includes this.
    """
    assembly = assembly_of(Gearbox.from_dict(content(**ripple)))
    solver = solver_of(assembly, SPEEDS, "parametric")
    assert apart(solver, 88.0, 0.8, 1.0 / 60e3, 0.4, assembly)[0] < 1e-3


def test_half_orders_are_lines_of_half_a_rotation():
    ripple = {"orders": [0.5, 1.0, 1.5], "torque_N_m": [4.0, 2.0, 3.0]}
    response = response_of(
        assembly_of(Gearbox.from_dict(content(**ripple))), SteadySettings(SpeedRange(50.0, 150.0, 4), "linear")
    )
    assert response.base_names == ("spur", "half rotation of shaft_1", "rotation of shaft_1")
    assert {0.5, 1.0, 1.5} <= set(response.lines.orders.round(9).tolist())


def test_a_reaction_acts_on_another_body_at_the_same_place():
    """Air-gap torque and magnetic pull between two shafts, in both solvers; together they have no resultant."""
    force = {"orders": [2], "z_mm": 20.0, "force_N": [[30.0, 10.0, 4.0]], "torque_N_m": [5.0]}
    assembly = assembly_of(Gearbox.from_dict(content(reaction_on="shaft_2", **force)))
    found = applied(assembly, "shaft_1", 0.4, 80.0)
    one, other = (found[list(assembly.coordinates[name])] for name in ("shaft_1", "shaft_2"))
    np.testing.assert_allclose(one[:3], -other[:3], rtol=1e-12)
    place = np.array([-0.075, 0.0, 0.0])  # of shaft 1 against the node of shaft 2
    np.testing.assert_allclose(other[3:], -one[3:] - np.cross(place, one[:3]), rtol=1e-12, atol=1e-12)
    rng = np.random.default_rng(5)
    q, v = 1e-6 * rng.normal(size=(2, assembly.size))
    v[assembly.spin["shaft_1"]] = 80.0
    assert_both_solvers_move_alike(assembly, q, v)


@pytest.mark.parametrize("seat", [None, "stator"])
def test_a_stator_acts_on_the_seat_of_its_name_on_a_flexible_housing(tmp_path, seat):
    """Air-gap torque of order 6: both solvers have it on the rotor and, opposed, on the housing; else a warning."""
    case = box_content(tmp_path)
    case["excitations"] = {"stator": {"body": "shaft_1", "orders": [6], "torque_N_m": [5.0], "reaction_on": "box"}}
    if seat is not None:
        own = {"diameter_mm": 60.0, "inner_diameter_mm": 0.0, "position_mm": [-12.5, 0.0, -12.0]}
        case["bodies"]["box"]["solid"]["seats"][seat] = own
    gearbox = Gearbox.from_dict(case, str(tmp_path / "case.toml"))
    told = [line for line in gearbox_warnings(gearbox) if "[bodies.box.solid.seats.stator]" in line]
    assert len(told) == (1 if seat is None else 0)
    assembly = assembled(gearbox, Choice("flexible"), {"spur": 3e8})
    expected = np.zeros(assembly.size)
    expected[assembly.spin["shaft_1"]] = 5.0 * np.cos(6 * 0.4)
    expected[assembly.coordinates["box" if seat is None else "box.stator"][SPIN]] = -5.0 * np.cos(6 * 0.4)
    np.testing.assert_allclose(applied(assembly, "shaft_1", 0.4, 80.0), expected, rtol=1e-12, atol=1e-12)
    rng = np.random.default_rng(5)
    q, v = 1e-7 * rng.normal(size=(2, assembly.size))
    v[assembly.spin["shaft_1"]] = 80.0
    assert_both_solvers_move_alike(assembly, q, v, step=5e-7, most=1e-8)


def test_two_inertias_and_a_coupling_answer_a_torque_between_them_as_in_closed_form():
    """Twist of a coupling K between J_1 and J_2 under a torque T on one and -T on the other: free masses on a spring.

    phi_1 - phi_2 = T / J / (w_0^2 - w^2 + i w c / J) with 1 / J = 1 / J_1 + 1 / J_2 and w_0^2 = K / J, J_2 being
    shaft_1 with all that its soft teeth (0.1 N/m) do not hold.
    """
    case = content(body="rotor", reaction_on="shaft_1", orders=[6], torque_N_m=[4.0], phase_deg=[25.0])
    case["bodies"]["rotor"] = {"inertia": {"disc": {"axial_kg_m2": 0.05}}, "spin_only": True}
    coupling = {"bodies": ["rotor", "shaft_1"], "stiffness_N_m_per_rad": 2e5, "damping_N_m_s_per_rad": 10.0}
    case["couplings"] = {"shaft": coupling}
    case["static_load"]["torques_N_m"] = {"shaft_1": 1e-7}
    assembly = assemble(Gearbox.from_dict(case), Choice("bushing"), {"spur": np.array([0.1])})
    solver = solver_of(assembly, (500.0, 1500.0), "linear", 1)
    line = line_at(solver.model, 6.0)
    inertia = 1.0 / (1.0 / 0.05 + 1.0 / 1e-2)
    for speed in (600.0, 811.0, 1400.0):
        motion = 2.0 * solver.response(speed).motion[line]
        twist = motion[assembly.spin["rotor"]] - motion[assembly.spin["shaft_1"]]
        w = 6.0 * speed
        expected = 4.0 * np.exp(1j * np.radians(25.0)) / (2e5 - inertia * w**2 + 10j * w)
        assert twist == pytest.approx(expected, rel=1e-6)


def test_another_table_is_another_input(tmp_path):
    before = input_hash(assembly_of(from_file(tmp_path, TABLE)))
    assert input_hash(assembly_of(from_file(tmp_path, TABLE))) == before
    assert input_hash(assembly_of(from_file(tmp_path, TABLE.replace("400,50,12,1.4", "400,50,12,1.5")))) != before


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"torque_percent": [1.0, 2.0]}, "set as many torque_percent as orders: 2 for 1 orders"),
        ({"torque_N_m": [1.0]}, "torque_N_m and torque_percent state the same"),
        ({"speed_exponent": 2.0}, "set both speed_exponent and reference_speed_rpm"),
        ({"reference_speed_rpm": 100.0}, "set both speed_exponent and reference_speed_rpm"),
        ({"reference_speed_rpm": 0.0, "speed_exponent": 2.0}, "reference_speed_rpm"),
        ({"reaction_on": "shaft_1"}, "reaction_on = 'shaft_1': the load acts on this body itself"),
        ({"reaction_on": "stator"}, "reaction_on: no body 'stator'"),
        ({"table": "ripple.csv"}, "orders: the table has orders, amplitudes and phases"),
        ({"unbalance_g_mm": 5.0}, "orders: an unbalance has order 1"),
    ],
)
def test_impossible_settings_are_refused_by_their_key(changes, said):
    with pytest.raises(GearboxFileError, match=said):
        Gearbox.from_dict(content(**{"orders": [6], "torque_percent": [1.0]} | changes))


def test_a_share_of_no_torque_is_refused():
    case = content(body="rotor", orders=[6], torque_percent=[1.0])
    case["bodies"]["rotor"] = {"inertia": {"disc": {"axial_kg_m2": 0.05}}, "spin_only": True}
    case["couplings"] = {"shaft": {"bodies": ["rotor", "shaft_1"], "stiffness_N_m_per_rad": 2e5}}
    with pytest.raises(GearboxFileError, match="torque_percent: 'rotor' has no torque in the static load"):
        _ = Gearbox.from_dict(case).varying_loads


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("", "is empty"),
        ("speed_rpm,order\n1,2\n", "columns are speed_rpm, order, amplitude_N_m"),
        ("speed_rpm,order,order,amplitude_N_m\n1,2,2,3\n", "each once"),
        (HEADER, "has a header and no rows"),
        (HEADER + "1000,100,6,1.0\n", "line 2: 5 finite numbers"),
        (HEADER + "1000,100,6,nan,0\n", "line 2: 5 finite numbers"),
        (HEADER + "1000,100,6,1e300,0\n", "line 2: 5 finite numbers"),
        (HEADER + "1000;100;6;1,0;0\n", "line 2: 5 finite numbers are required, with a decimal point"),
        (HEADER + "-1000,100,6,1.0,0\n", "line 2: speed_rpm = -1000 must not be negative"),
        (HEADER + "1000,100,6,-1.0,0\n", "line 2: amplitude_N_m = -1 must not be negative"),
        (HEADER + "\n1000,100,0,1.0,0\n", "line 3: order = 0 must be a whole number or a half"),
        (HEADER + "1000,100,6,1.0,0\n1000,100,6,2.0,0\n", "line 3: repeats order, torque and speed"),
        (HEADER + "1000,100,6,1.0,0\n2000,200,6,2.0,0\n", "order 6 has no row at 2000 rpm and 100 N m"),
        (HEADER + "".join(f"{n},{n},{n % 2000 + 1},1,0\n" for n in range(9000)), "order 1 has no row at 1 rpm"),
        (HEADER + "1000,200,6,1.0,0\n2000,200,6,2.0,0\n", "covers torques from 200 to 200 N m, the static torque"),
        (b"\xff\xfe\x00binary\x00\n", "cannot be read as CSV"),
        (HEADER + 'a"b\n"\n', "line 2: 5 finite numbers|cannot be read as CSV"),
    ],
)
def test_a_table_that_cannot_be_used_is_one_error_and_nothing_is_written(tmp_path, table, said):
    with pytest.raises(GearboxFileError, match=f"excitations.ripple.table = 'ripple.csv': .*({said})") as error:
        from_file(tmp_path, table)
    assert len(error.value.errors) == 1
    before = sorted(tmp_path.iterdir())
    result = CliRunner().invoke(app, ["steady", str(tmp_path / "gearbox.toml"), "--out", str(tmp_path / "results")])
    assert result.exit_code == 2
    assert sorted(tmp_path.iterdir()) == before


def test_a_table_outside_the_folder_or_missing_is_refused(tmp_path):
    from_file(tmp_path, TABLE)
    (tmp_path / "ripple.csv").unlink()
    with pytest.raises(GearboxFileError, match="excitations.ripple.table = 'ripple.csv': no such file"):
        Gearbox.from_toml(tmp_path / "gearbox.toml")


def test_a_table_that_does_not_cover_the_speeds_is_refused_in_both(tmp_path):
    gearbox = from_file(tmp_path, TABLE)
    said = "excitations.ripple.table: covers 400 to 1500 rpm of shaft_1, which turns at 477.465 to 1909.86 rpm"
    with pytest.raises(SteadyError, match=said):
        response_of(assembly_of(gearbox), SteadySettings(SpeedRange(50.0, 200.0, 4), "linear"))
    arguments = ["run", str(tmp_path / "gearbox.toml"), "--out", str(tmp_path / "out"), "--mesh-model", "iso6336"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2
    assert "load_cases.run_up: excitations.ripple.table: covers 400 to 1500 rpm" in " ".join(result.output.split())


def answer(folder: Path, *options: str) -> dict[str, Any]:
    """Summary of the command steady for two excitations and a gear that hardly varies."""
    case = content(orders=[12], torque_percent=[1.0])
    case["excitations"]["imbalance"] = {"body": "shaft_2", "z_mm": 30.0, "unbalance_g_mm": 300.0}
    written(folder, case)
    arguments = ["steady", "gearbox.toml", "--speeds", "300:3000", "--points", "40", "--json", "--out", "results"]
    result = CliRunner().invoke(app, [*arguments, *options])
    assert result.exit_code == 0, result.output
    found: dict[str, Any] = json.loads(result.stdout)
    return found


@pytest.mark.validation
def test_the_ranking_blames_an_excitation_and_does_without_it(tmp_path, monkeypatch):
    """Twelve torques per revolution pass 125 Hz at 627 rpm, the mesh with 20 teeth at 376 rpm."""
    monkeypatch.chdir(tmp_path)
    found = answer(tmp_path)
    first = found["resonances"][0]
    assert first["line"] == "12 x rotation of shaft_1"
    assert first["speed_rpm"] == pytest.approx(627.0, rel=0.01)
    sources = next(own for own in found["sources_of_overall_dte"] if abs(own["speed"] - 627.0 * np.pi / 30.0) < 1.0)
    assert sources["meshes"]["ripple"] == pytest.approx(1.0, abs=1e-6)
    without = answer(tmp_path, "--without", "ripple")
    assert without["resonances"][0]["line"] == "spur"
    assert not any("shaft_1" in own["line"] for own in without["resonances"])
    both = answer(tmp_path, "--without", "ripple", "--without", "imbalance")
    assert both["sources_of_overall_dte"] == []


def test_leaving_out_what_is_not_there_is_bad_input(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written(tmp_path, content(orders=[12], torque_percent=[1.0]))
    for command in ("steady", "run"):
        result = CliRunner().invoke(app, [command, "gearbox.toml", "--without", "rippel"])
        assert result.exit_code == 2
        assert "--without rippel: no such excitation; choose one of: ripple" in " ".join(result.output.split())
    assert not (tmp_path / "results").exists()


@pytest.mark.validation
def test_the_page_lists_excitations_and_deviations_among_its_assumptions_with_their_warnings(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    case = content(orders=[12], torque_N_m=[500.0])
    case["excitations"]["imbalance"] = {"body": "shaft_2", "z_mm": 30.0, "unbalance_g_mm": 300.0, "enabled": False}
    case["deviations"] = {"one": {"body": "shaft_1", "gear": "pinion", "runout_um": 10.0}}
    case["operation"] = {"speed_range_rpm": [300.0, 3000.0]}
    written(tmp_path, case)
    steady = ["steady", "gearbox.toml", "--speeds", "300:3000", "--points", "40", "--out", "results"]
    assert CliRunner().invoke(app, steady).exit_code == 0
    assert CliRunner().invoke(app, ["report", "results", "--stored"]).exit_code == 0
    page = html.unescape((tmp_path / "results" / "report.html").read_text(encoding="utf-8"))
    assumptions = page.partition('id="assumptions"')[2]
    assert "Excitations beside the gears, at the static torque: ripple (order 12 of shaft 1)." in assumptions
    assert "Excitations of the file that are left out: imbalance." in assumptions
    assert "Deviations of gears, pitch over one revolution: pinion on shaft 1 (eccentricity 5 µm)." in assumptions
    assert "excitations.ripple: amplitude of 500 N m on shaft 1" in page


def test_a_continuation_follows_states_under_an_excitation(tmp_path, monkeypatch):
    """The same peaks as at single speeds within the single precision of the file, at the first speed of both."""
    monkeypatch.chdir(tmp_path)
    written(tmp_path, content(orders=[12], torque_percent=[1.0]))
    arguments = ["steady", "gearbox.toml", "--speeds", "1000:1030", "--method", "nonlinear"]
    amplitudes = []
    for out, more in (("branch", ["--continuation"]), ("single", ["--points", "2"])):
        assert CliRunner().invoke(app, [*arguments, *more, "--out", out]).exit_code == 0
        (path,) = (tmp_path / out).rglob("steady-*.nc")
        data = load_response(path)
        amplitudes.append(np.abs(data["amplitude"].to_numpy()[0, 1:, 0]))
    np.testing.assert_allclose(*amplitudes, rtol=1e-5, atol=1e-6 * amplitudes[1].max())


@pytest.mark.validation
def test_the_summary_lists_speeds_at_which_loads_do_not_settle(tmp_path, monkeypatch):
    """Order 1 with a fifth of the torque turns the free pair too far near standstill, and not above 300 rpm."""
    monkeypatch.chdir(tmp_path)
    written(tmp_path, content(orders=[1], torque_N_m=[20.0]))
    arguments = ["steady", "gearbox.toml", "--method", "nonlinear", "--points", "2", "--json", "--out", "results"]
    found = json.loads(CliRunner().invoke(app, [*arguments, "--speeds", "30:60"]).stdout)
    assert found["excitations_at_mean_angles_rpm"]
    assert max(found["excitations_at_mean_angles_rpm"]) < 61.0
    found = json.loads(CliRunner().invoke(app, [*arguments, "--speeds", "2000:3000"]).stdout)
    assert found["excitations_at_mean_angles_rpm"] == []


def test_the_terminal_names_the_excitation_of_an_order(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer(tmp_path)
    arguments = ["steady", "gearbox.toml", "--speeds", "300:3000", "--points", "40", "--out", "results", "--all"]
    said = " ".join(CliRunner().invoke(app, arguments).stdout.split())
    assert "12 × rotation of shaft_1 (ripple)" in said
    assert "Sources of the transmission error at resonances" in said
    assert "ripple 100 %" in said


@pytest.mark.validation
def test_report_and_view_name_the_excitation_of_a_resonance(tmp_path, monkeypatch):
    """The page states cause and share, and draws combinations of mesh and excitation; the view has its order."""
    monkeypatch.chdir(tmp_path)
    answer(tmp_path)
    result = CliRunner().invoke(app, ["report", "results", "--stored"])
    assert result.exit_code == 0, result.output
    page = (tmp_path / "results" / "report.html").read_text(encoding="utf-8")
    assert "Excited by the 12th order of the rotation of shaft 1 (excitation ripple)" in page
    assert "ripple 100 %" in page
    monkeypatch.setattr("exugear.cli.tasks.view._draw_pictures", lambda *given: [])
    result = CliRunner().invoke(app, ["view", "gearbox.toml", "--out", "results"])
    assert result.exit_code == 0, result.output
    pages = [path.read_text(encoding="utf-8") for path in (tmp_path / "results").rglob("modes.html")]
    assert pages
    assert any("(ripple)" in text for text in pages)
