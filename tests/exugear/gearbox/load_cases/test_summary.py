"""Load cases summed up before a run: against closed forms, and against the state that runs start from."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path

import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import (
    BURSTING_RIM_SPEED,
    LoadSummary,
    bearing_range_warning,
    gearbox_at_load,
    load_warnings,
    other_load_warning,
    summarise_loads,
)
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.units import RPM
from exugear.results.run_file import load_run
from exugear.system.build import assemble
from exugear.system.statics import accelerating_start
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.transient.runup import simulate

from ...cases.command import exugear
from ...cases.gear_trains import pair
from ...cases.spur import SPUR_CASE

INERTIA = 1e-2 + 3e-2 / 2.25
"""Of both shafts at the pinion, kg m2."""
BASE = 30e-3 * math.cos(math.radians(20.0))


def spur(folder: Path = Path(), **load_case: object) -> Gearbox:
    plain = Gearbox.from_dict(tomllib.loads(SPUR_CASE), str(folder / "spur.toml"))
    return plain.varied({"load_cases.run_up": load_case})


def summed(folder: Path = Path(), **load_case: object) -> LoadSummary:
    gearbox = spur(folder, **load_case)
    return summarise_loads(gearbox, gearbox.load_cases["run_up"])


def checked(folder: Path, torques: str, *more: str):
    case = folder / "spur.toml"
    case.write_text(SPUR_CASE.replace("{ shaft_1 = 100.0, shaft_2 = 140.0 }", torques), encoding="utf-8")
    return exugear("check", case, *more)


def test_two_gears_accelerate_as_by_hand():
    loads = summed(torques_N_m={"shaft_1": 100.0, "shaft_2": 140.0}, duration_s=2.0, start_speed_rpm=60.0)
    net = 100.0 - 140.0 / 1.5
    assert loads.inertia == pytest.approx(INERTIA, rel=1e-12)
    assert loads.net_torque == pytest.approx(net, rel=1e-12)
    assert loads.end_speed == pytest.approx(2.0 * math.pi + net / INERTIA * 2.0, rel=1e-12)
    assert loads.fastest_rim == ("shaft_1", pytest.approx(loads.end_speed * 33e-3, rel=1e-12))
    # What the pinion does not need to accelerate itself goes through the mesh.
    assert loads.mesh_forces["spur"] == pytest.approx((100.0 - 1e-2 * net / INERTIA) / BASE, rel=1e-12)
    assert (dict(loads.flanks), loads.reversed_flanks) == ({"spur": "+"}, ())
    assert load_warnings(loads) == ()


@pytest.mark.parametrize("name", ["reference", "generating", "rated"])
def test_the_reference_gearbox_is_loaded_as_at_the_start_of_its_runs(grc: Gearbox, stiffness: dict, name: str) -> None:
    case = grc.load_cases[name]
    assembly = assemble(grc, Choice("rigid", "constant"), stiffness)
    start = accelerating_start(assembly, case.torques, case.start_speed)
    loads = summarise_loads(grc, case)
    rate = (loads.end_speed - loads.start_speed) / case.duration
    assert rate == pytest.approx(start.rates["carrier"], rel=1e-6)
    forces = assembly.mesh_states(start.q, start.v)[:, 4] * [element.flank for element in assembly.elements]
    assert list(loads.mesh_forces.values()) == pytest.approx(forces.tolist(), rel=1e-6)


def test_a_drive_holds_what_the_torques_do_not(grc: Gearbox, stiffness: dict) -> None:
    case = grc.load_cases["speed_driven"]
    loads = summarise_loads(grc, case)
    assert loads.net_torque == pytest.approx(240e3)
    assert loads.end_speed == pytest.approx(1800.0 * RPM / grc.train.ratio, rel=1e-12)
    half = summarise_loads(grc, case, duration=2.5)  # the ramp is the load case's; a shorter run ends on it
    assert half.end_speed == pytest.approx(0.5 * loads.end_speed, rel=1e-12)
    assembly = assemble(grc, Choice("rigid", "constant"), stiffness)
    rate = 1800.0 * RPM / case.duration
    start = accelerating_start(assembly, case.torques, 0.0, ("hss", rate))
    forces = assembly.mesh_states(start.q, start.v)[:, 4] * [element.flank for element in assembly.elements]
    assert list(loads.mesh_forces.values()) == pytest.approx(forces.tolist(), rel=1e-6)


def test_a_torque_series_is_integrated_and_its_flanks_are_told(tmp_path):
    table = tmp_path / "torque.csv"
    table.write_text("time_s,shaft_1_N_m\n0.1,0\n0.3,200\n0.5,-200\n0.7,0\n")
    loads = summed(tmp_path, torque_series=table.name, duration_s=1.0)
    assert loads.net_torque == 0.0
    assert loads.end_speed == pytest.approx(0.0, abs=1e-9)  # two triangles that cancel
    assert loads.fastest_speed == pytest.approx(0.5 * 0.3 * 200.0 / INERTIA, rel=1e-6)  # after the first
    assert (dict(loads.flanks), loads.reversed_flanks) == ({"spur": "+-"}, ("spur",))


def test_a_run_reaches_the_speed_that_was_told(tmp_path):
    gearbox = spur(torques_N_m={"shaft_1": 100.0, "shaft_2": 140.0}, duration_s=0.5)
    loads = summarise_loads(gearbox, gearbox.load_cases["run_up"])
    run = simulate(gearbox, Choice("rigid", "kinematic", load_case="run_up"), {}, tmp_path)
    data = xr.load_dataset(run.path, engine="h5netcdf")
    assert float(data.input_speed[-1]) == pytest.approx(loads.end_speed * float(data.time[-1]) / 0.5, rel=1e-9)


@pytest.mark.validation
def test_check_prints_torque_speed_and_flanks_of_each_load_case(grc):
    outcome = exugear("check", grc.source, "--json")
    assert outcome.exit_code == 0 and outcome.stderr == ""
    rows = {row["load_case"]: row for row in json.loads(outcome.stdout)["load_cases"]}
    assert list(rows) == ["reference", "generating", "speed_driven", "rated"]
    # The case file says it of the first: net 4.47 kN m, 215 rpm at the end; the carrier turns -z.
    assert rows["reference"]["net_torque_N_m"] == pytest.approx(-4472.0, abs=1.0)
    assert rows["reference"]["end_speed_rpm"] == pytest.approx(-214.5, abs=0.1)
    assert rows["speed_driven"]["driven"] is True
    flanks = {"sun_planet": "-", "ring_planet": "+", "intermediate": "+", "high_speed": "-"}
    assert all(row["loaded_flanks"] == flanks and row["doubts"] == [] for row in rows.values())
    table = exugear("check", grc.source, "--all").stdout
    assert "-4472" in table and "sun_planet -" in table


def test_check_asks_about_the_sign_of_a_torque_that_loads_the_other_flanks(tmp_path):
    outcome = checked(tmp_path, "{ shaft_1 = -100.0, shaft_2 = -140.0 }")
    assert outcome.exit_code == 0
    assert (
        "spur loaded on the opposite flank of the static load, at which tables, stiffness and phases are computed"
        in outcome.stderr
    )
    assert "spur -!" in checked(tmp_path, "{ shaft_1 = -100.0, shaft_2 = -140.0 }", "--all").stdout
    row = json.loads(checked(tmp_path, "{ shaft_1 = -100.0, shaft_2 = -140.0 }", "--json").stdout)["load_cases"][0]
    assert (row["reversed_flanks"], row["loaded_flanks"]) == (["spur"], {"spur": "-"})


def test_check_asks_about_the_sign_of_a_torque_that_lets_the_train_run_away(tmp_path):
    outcome = checked(tmp_path, "{ shaft_1 = 100.0, shaft_2 = -300.0 }")
    assert outcome.exit_code == 0
    reached = 33e-3 * (100.0 + 300.0 / 1.5) / INERTIA
    assert reached > BURSTING_RIM_SPEED
    assert f"the tip speed on shaft_1 reaches {reached:.4g} m/s" in " ".join(outcome.stderr.split())


def test_check_reads_the_torque_series_too(tmp_path):
    (tmp_path / "torque.csv").write_text("time_s,nobody_N_m\n0,1\n1,1\n")
    with pytest.raises(GearboxFileError, match="is not the torque of a body; columns are"):
        summed(tmp_path, torque_series="torque.csv")
    case = tmp_path / "spur.toml"
    case.write_text(
        SPUR_CASE.replace("torques_N_m = { shaft_1 = 100.0, shaft_2 = 140.0 }", 'torque_series = "torque.csv"')
    )
    outcome = exugear("check", case)
    assert outcome.exit_code == 2 and "is not the torque of a body; columns are" in " ".join(outcome.stderr.split())


def test_planets_count_with_their_orbits(grc: Gearbox) -> None:
    unit = grc.train.rolling_speeds("carrier", 1.0)
    bodies = grc.bodies()
    spins = sum(body.axial * unit[body.name] ** 2 for body in bodies if not body.fixed)
    orbits = sum(body.mass * 0.308**2 for body in bodies if body.carrier)
    found = summarise_loads(grc, grc.load_cases["rated"]).inertia
    assert found == pytest.approx(spins + orbits, rel=1e-9)
    assert orbits > 1e-3 * found


@pytest.mark.parametrize(
    ("torques", "said"),
    [
        ({"carrier": 240e3, "hss": -2945.1}, ""),
        ({"carrier": 40e3, "hss": -490.0}, "loads sun_planet, ring_planet, intermediate, high_speed with 17 % of it"),
        ({"carrier": 0.0, "hss": 0.0}, "loads sun_planet, ring_planet, intermediate, high_speed with 0 % of it"),
        ({"carrier": -240e3, "hss": 2945.1}, "reverses the load of sun_planet, ring_planet, intermediate, high_speed"),
    ],
)
def test_a_load_case_far_from_the_static_load_asks_for_rows(grc, torques, said):
    """Linear bearings are of the static load: below a quarter of it, or reversed, the remedy is named."""
    varied = grc.varied({"load_cases.rated.torques_N_m": torques})
    loads = summarise_loads(varied, varied.load_cases["rated"])
    doubt = bearing_range_warning(varied, loads, "bushing")
    assert bool(doubt) == bool(said)
    assert said in doubt
    assert not doubt or 'model = "iso16281"' in doubt
    assert bearing_range_warning(varied, loads, "rigid") == ""
    names = [name for name, one in grc.case.bearings.items() if one.catalogue and one.catalogue.radial_load_kN is None]
    rows = varied.varied({f"bearings.{name}.model": "iso16281" for name in names})
    assert bearing_range_warning(rows, loads, "bushing") == ""


@pytest.mark.parametrize(
    ("torque", "said"),
    [
        (100.0, ""),
        (75.0, ""),
        (60.0, "other load: spur 60 % of the static load (shaft_1 100 N m)"),
        (140.0, "spur 140 %"),
    ],
)
def test_a_load_case_thirty_percent_off_the_load_of_the_tables_is_told(torque, said):
    gearbox = spur(torques_N_m={"shaft_1": torque, "shaft_2": 1.5 * torque})
    doubt = other_load_warning(gearbox, summarise_loads(gearbox, gearbox.load_cases["run_up"]))
    assert said in doubt
    assert bool(said) == bool(doubt)


def test_a_load_case_without_torque_is_told_what_helps():
    """Without torque on the first shaft there is no load to compute tables at: `--at-load-case` would be refused."""
    gearbox = spur(torques_N_m={"shaft_1": 0.0, "shaft_2": -1e-9})
    doubt = other_load_warning(gearbox, summarise_loads(gearbox, gearbox.load_cases["run_up"]))
    assert "spur 0 % of the static load" in doubt
    assert doubt.endswith("are computed; use --mesh-model table, which covers a range of loads")


def test_a_stated_stiffness_has_no_other_load(tmp_path):
    """A run is the same to the bit with the static load of the file and with that of the load case."""
    doubled = {name: 2.0 * torque for name, torque in pair()["load_cases"]["steady"]["torques_N_m"].items()}
    gearbox = Gearbox.from_dict(pair()).varied({"load_cases.steady.torques_N_m": doubled})
    case = gearbox.load_cases["steady"]
    assert other_load_warning(gearbox, summarise_loads(gearbox, case)) == ""
    forces = []
    for name, own in (("static", gearbox), ("case", gearbox_at_load(gearbox, case))):
        stiffness = mesh_stiffness(own, "line_of_action", tmp_path)
        run = simulate(own, Choice("bushing"), stiffness, tmp_path / name, duration=0.01)
        forces.append(load_run(run.path)["mesh_force"].to_numpy())
    assert (forces[0] == forces[1]).all()


def test_a_load_case_becomes_the_static_load_with_what_holds_it():
    gearbox = spur(torques_N_m={"shaft_1": 40.0, "shaft_2": 60.0})
    static = gearbox_at_load(gearbox, gearbox.load_cases["run_up"]).case.static_load
    assert static.torques_N_m == {"shaft_1": 40.0}
    assert static.locked == ("shaft_2",)
    with pytest.raises(
        GearboxFileError, match=".torques_N_m: at the start, no torque acts except on bodies that hold the static load"
    ):
        gearbox_at_load(gearbox, spur(torques_N_m={"shaft_2": 60.0}).load_cases["run_up"])


@pytest.mark.parametrize(("duration", "reached"), [("0.1", 150.0), ("0.2", 300.0)])
def test_a_drive_that_goes_beyond_its_end_speed_says_which_speed_it_reaches(tmp_path, duration, reached):
    """The run ends at that speed; of a run as long as the load case nothing is said."""
    case = tmp_path / "spur.toml"
    drive = 'driven_body = "shaft_1"\nend_speed_rpm = 150.0\ndrive_stiffness_N_m_per_rad = 1e5\nduration_s = 0.1\n'
    loads = "torques_N_m = { shaft_2 = 10.0 }\nstart_speed_rpm = 0.0\n"
    case.write_text(f"{SPUR_CASE.partition('[load_cases')[0]}\n[load_cases.ramp]\n{loads}{drive}", encoding="utf-8")
    options = [
        "--variant",
        "rigid",
        "--mesh-model",
        "iso6336",
        "--duration",
        duration,
        "--out",
        tmp_path / "out",
        "--json",
    ]
    outcome = exugear("run", case, *options)
    assert outcome.exit_code == 0, outcome.stderr
    assert json.loads(outcome.stdout)["input_speed_rpm"] == pytest.approx(reached, rel=0.02)
    said = f"to {reached:g} rpm at {duration} s, beyond end_speed_rpm = 150" in outcome.stderr
    assert said == (reached > 150.0)
