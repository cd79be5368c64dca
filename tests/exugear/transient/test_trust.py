"""A run that cannot be right says so: limits on energy, speed, deflection and pulling; indices that stay inside."""

from __future__ import annotations

import json
import math
import os
import re
import signal
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

from exugear.cli import app as cli
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import summarise_loads
from exugear.report.writer import write_report
from exugear.results.run_file import invalidity_of, load_run
from exugear.system.build import assemble
from exugear.system.kernels.cubics import piece_at
from exugear.system.signals import BALANCE_TERMS, MESH_TIMES
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.transient.compiled.integrator import highest_rate
from exugear.transient.outcome import LIMITS, LimitError, Progress, RunError, ValidityMonitor
from exugear.transient.runup import simulate

from ..cases.assembled import simulated
from ..cases.spur import SPUR_CASE

BALANCED = "{ shaft_1 = 100.0, shaft_2 = 140.0 }"
RUNAWAY = "{ shaft_1 = 100.0, shaft_2 = -140.0 }"
"""The load drives: 193 N m on 0.0233 kg m2, and nothing takes it up."""
REVERSED = "{ shaft_1 = -100.0, shaft_2 = -140.0 }"
"""The same net torque as the case's, turned round: its other flanks carry."""


def spur(torques: str = BALANCED, more: str = "") -> Gearbox:
    return Gearbox.from_dict(tomllib.loads(SPUR_CASE.replace(BALANCED, torques) + more), "spur.toml")


def stiffness_of(gearbox: Gearbox) -> dict[str, np.ndarray]:
    return mesh_stiffness(gearbox, "iso6336")


def attributes(path: Path) -> dict[str, object]:
    return load_run(path, ()).attrs


def exugear(verb: str, case: Path, *more: object):
    arguments = [verb, case, "--mesh-model", "iso6336", "--out", case.parent / "out", "--variant", "rigid", *more]
    return CliRunner().invoke(cli.app, [str(argument) for argument in arguments])


def written(folder: Path, torques: str, duration: float = 1.0) -> Path:
    case = folder / "spur.toml"
    text = SPUR_CASE.replace(BALANCED, torques).replace("duration_s = 1.0", f"duration_s = {duration}")
    case.write_text(text, encoding="utf-8")
    return case


# -- what is told of a run that cannot be right --------------------------------------------------------------------


def test_a_train_that_runs_away_is_stopped_where_its_rims_would_burst(tmp_path):
    outcome = exugear("run", written(tmp_path, RUNAWAY, 3.0), "--json")
    assert outcome.exit_code == 1
    summary = json.loads(outcome.stdout)
    assert summary["valid"] is False and summary["complete"] is False
    (reason,) = summary["reasons"]
    # 300 m/s on the tip radius of 33 mm, at the net torque over the inertia at the pinion.
    instant = 300.0 / 33e-3 / ((100 + 140 / 1.5) / (1e-2 + 3e-2 / 2.25))
    told = re.fullmatch(r"overspeed at t = ([\d.]+) s: tip speed on shaft_1 exceeds 300 m/s .*", reason)
    assert told and float(told[1]) == pytest.approx(instant, rel=1e-3)
    message = " ".join(outcome.stderr.split())
    assert "invalid" in message and reason in message and "run.partial" in message
    kept = attributes(Path(summary["file"]))
    assert (kept["valid"], kept["complete"], kept["validity_message"]) == (0, 0, reason)
    assert summary["simulated_s"] < 2.0  # and did not go on to 3 s
    again = exugear("run", tmp_path / "spur.toml", "--resume")
    assert again.exit_code == 1 and ": aborted: overspeed" in " ".join(again.stderr.split())


def test_teeth_that_pull_for_the_whole_run_end_with_code_1_and_a_red_box_in_the_report(tmp_path):
    outcome = exugear("run", written(tmp_path, REVERSED), "--json")
    assert outcome.exit_code == 1
    summary = json.loads(outcome.stdout)
    assert summary["complete"] is True and summary["valid"] is False
    (reason,) = summary["reasons"]
    assert reason.startswith("tensile mesh force: spur for up to 100 % of the run") and "check torque signs" in reason
    assert Path(summary["file"]).name == "run.nc"
    kept = attributes(Path(summary["file"]))
    assert invalidity_of(kept) == reason
    assert json.loads(str(kept["limits"]))["pulling_marked"] == LIMITS.pulling_marked
    page = write_report(tmp_path / "out", target=1000.0).path.read_text(encoding="utf-8")
    head = page[: page.index('<section id="answer"')]
    assert '<div class="alert" role="alert"><strong>Invalid runs' in head
    assert f"rigid/run_up-iso6336-disc/run.nc: {reason}" in head
    assert "NO, see top of page" in page and '<section id="ranking"' in page  # shown all the same


def test_the_sign_of_round_off_in_an_unloaded_mesh_is_no_tensile_force(tmp_path):
    case = written(tmp_path, "{ shaft_1 = 0.0, shaft_2 = 0.0 }, start_speed_rpm = 977.0", 0.1)
    outcome = exugear("run", case, "--json")
    assert outcome.exit_code == 0, outcome.stderr
    summary = json.loads(outcome.stdout)
    assert summary["longest_tensile_time_s"] == 0.0 and summary["valid"] is True


def test_absurd_shares_are_told_without_exponents(tmp_path):
    """A torque in N mm: teeth that deflect by many times their height."""
    outcome = exugear("run", written(tmp_path, "{ shaft_1 = 100e6, shaft_2 = 150e6 }"))
    assert outcome.exit_code == 1
    message = " ".join(outcome.stderr.split())
    assert "beyond breakage; maximum over 1000 %" in message
    assert not re.search(r"(e\+\d+|inf|nan) %", message)


def test_a_good_run_is_trusted(tmp_path):
    outcome = exugear("run", written(tmp_path, BALANCED), "--json")
    assert outcome.exit_code == 0, outcome.stderr
    summary = json.loads(outcome.stdout)
    assert summary["valid"] is True and summary["reasons"] == []
    kept = attributes(Path(summary["file"]))
    assert (kept["valid"], kept["validity_message"]) == (1, "within all limits")


@pytest.mark.parametrize("solver", ["compiled", pytest.param("exudyn", marks=pytest.mark.validation)])
def test_parametric_instability_is_stopped_at_a_part_of_the_tooth_height(tmp_path, solver):
    gearbox = spur()
    samples = float(stiffness_of(gearbox)["spur"][0]) * (1.0 + 0.4 * np.cos(2.0 * np.pi * np.arange(50) / 50))
    assembly = assemble(gearbox, Choice("rigid"), {"spur": samples.mean(keepdims=True)})
    twice = 2.0 * highest_rate(assembly) / 20 * 30 / np.pi  # mesh frequency at twice the eigenfrequency
    gearbox = gearbox.varied(
        {
            "load_cases.run_up.torques_N_m": {"shaft_1": 100.0, "shaft_2": 150.0},
            "load_cases.run_up.start_speed_rpm": float(twice),
        }
    )
    with pytest.raises(LimitError, match="s: mesh spur, tooth height 6.75 mm, exceeds 5 %") as error:
        simulate(gearbox, Choice("rigid", load_case="run_up"), {"spur": samples}, tmp_path, duration=0.6, solver=solver)
    assert not error.value.run.trusted
    assert invalidity_of(attributes(error.value.run.path)).startswith("tooth deflection at t = 0.00")


def test_energy_that_a_coarse_step_loses_marks_the_run(tmp_path):
    """A jump of torque rings at 2.4 steps a radian, which the step damps away: nothing accounts for that energy."""
    (tmp_path / "jump.csv").write_text(
        "time_s,shaft_1_N_m,shaft_2_N_m\n0,1,1.5\n0.005,1,1.5\n0.0051,100,150\n1,100,150\n", encoding="utf-8"
    )
    near = replace(spur(), source=str(tmp_path / "spur.toml"))
    gearbox = near.varied({"load_cases.run_up": {"torque_series": "jump.csv"}})
    stiffness = stiffness_of(gearbox)
    step = 2.4 / highest_rate(assemble(gearbox, Choice("rigid"), stiffness))
    options = {"duration": 0.05}
    coarse = {"step": step, "sample_rate": 1.0 / step, "integrator": "rk4"}
    with pytest.raises(LimitError, match=r"energy: from t = .* energy balance error .* maximum [1-9]\d"):
        simulate(gearbox, Choice("rigid"), stiffness, tmp_path / "coarse", **coarse)
    assert simulate(gearbox, Choice("rigid", load_case="run_up"), stiffness, tmp_path / "fine", **options).trusted


def judged() -> ValidityMonitor:
    """Judge of the spur case, which nothing has happened to yet."""
    gearbox = spur()
    assembly = assemble(gearbox, Choice("rigid"), stiffness_of(gearbox))
    return ValidityMonitor(assembly, summarise_loads(gearbox, gearbox.load_cases["run_up"]))


def test_a_mesh_beside_unsolved_states_of_its_table_is_a_reason_not_to_trust() -> None:
    judge = judged()
    seen(judge)
    times = np.zeros((len(MESH_TIMES), 1))
    times[MESH_TIMES.index("interpolation_time")] = 0.02
    (reason,) = judge.reasons(times, 0.1)
    assert reason.startswith("table: spur read table states next to non-converged ones")
    assert "for up to 0.02 s" in reason


def seen(judge: ValidityMonitor, deflection: float = 0.0, spin: float = 0.0, left: float = 0.0) -> tuple[str, ...]:
    """Judge one more state, of 100 J and some energy that is left over."""
    account = np.array([[0.0, 50.0, 50.0 + left, *np.zeros(len(BALANCE_TERMS) - 3)]])
    judge.see(np.array([0.1]), np.array([[deflection]]), np.array([[spin, 0.0]]), np.array([0.1]), account)
    return judge.reasons(np.zeros((len(MESH_TIMES), 1)), 0.1)


def test_each_limit_has_its_words_and_stops_where_it_says():
    height = 2.25 * 3e-3
    intended = 9.429  # m/s on the pinion's rim: 6.67 N m for 1 s
    for figures, words, stops in (
        ({"deflection": 0.049 * height}, "", False),
        ({"deflection": 0.051 * height}, "tooth deflection at t = 0.1 s: mesh spur", False),
        ({"deflection": -0.26 * height}, "deflection", True),
        ({"deflection": math.nan}, "deflection", True),
        ({"spin": 0.99 * (2.0 * intended + 10.0) / 33e-3}, "", False),
        (
            {"spin": -1.01 * (2.0 * intended + 10.0) / 33e-3},
            "m/s, but the loads cause 9.429 m/s at most; the motion is unstable",
            True,
        ),
        ({"left": 0.4}, "", False),
        ({"left": 2.0}, "energy: from t = 0.1 s on the energy balance error exceeds 1 %", False),
        ({"left": 20.0}, "energy", True),
    ):
        judge = judged()
        assert seen(judge) == ()
        reasons = seen(judge, **figures)
        assert words in "".join(reasons) and len(reasons) == bool(words), figures
        assert judge.stop is stops, figures
        assert seen(judge) == reasons  # results so far is not forgotten


def test_energy_that_an_extrapolated_table_gives_names_the_extrapolation():
    judge = judged()
    seen(judge)
    seen(judge, left=2.0)
    times = np.zeros((len(MESH_TIMES), 1))
    times[MESH_TIMES.index("extrapolation_time")] = 0.1
    (reason,) = judge.reasons(times, 0.1)
    assert "the extrapolation beyond the table does not conserve energy" in reason


@pytest.mark.usefixtures("terminal_signals")
def test_a_resumed_run_keeps_its_verdict(tmp_path, monkeypatch):
    monkeypatch.setattr("exugear.transient.recorder.FLUSH_INTERVAL", 0.0125)
    gearbox = spur(REVERSED)
    stiffness = stiffness_of(gearbox)
    options = {"duration": 0.2}
    whole = simulate(gearbox, Choice("rigid", load_case="run_up"), stiffness, tmp_path / "whole", **options)

    def press_ctrl_c(progress: Progress) -> None:
        if progress.simulated > 0.09:
            os.kill(os.getpid(), signal.SIGINT)

    stopped = simulate(
        gearbox, Choice("rigid", load_case="run_up"), stiffness, tmp_path, **options, progress=press_ctrl_c
    )
    assert not stopped.complete and not stopped.trusted
    resumed = simulate(gearbox, Choice("rigid", load_case="run_up"), stiffness, tmp_path, **options, resume=True)
    assert resumed.complete and resumed.reasons == whole.reasons != ()
    one, other = (xr.load_dataset(run.path, engine="h5netcdf") for run in (whole, resumed))
    assert one.state_judgement.identical(other.state_judgement)
    assert float(one.state_judgement[3, 0]) > 0.0


@pytest.mark.parametrize("variant", ["rigid", "bushing"])
def test_the_reference_gearbox_runs_far_inside_the_limits(grc, stiffness, tmp_path, variant):
    run = simulated(grc, Choice(variant), stiffness, tmp_path, duration=0.3)
    assert run.reasons == ()
    judged = xr.load_dataset(run.path, engine="h5netcdf").state_judgement.to_numpy()
    assert judged[0, 0] < 1e-3 * LIMITS.energy_marked
    assert judged[3, 0] < 0.2 * LIMITS.deflection_marked


@pytest.mark.validation
@pytest.mark.sample
@pytest.mark.parametrize("variant", ["rigid", "bushing"])
@pytest.mark.parametrize("inertias", ["gears", "assemblies"])
def test_whole_run_ups_of_the_reference_gearbox_are_trusted(grc, stiffness, tmp_path, variant, inertias):
    run = simulated(grc, Choice(variant, inertias=inertias), stiffness, tmp_path)
    data = xr.load_dataset(run.path, engine="h5netcdf")
    assert run.reasons == ()
    assert data.state_judgement.to_numpy()[0, 0] < 1e-3 * LIMITS.energy_marked
    assert float(data.tensile_time.max()) < 0.1 * LIMITS.pulling_marked * run.end


# -- what diverges stays inside its arrays --------------------------------------------------------------------------

DIVERGED = """
import sys
import tomllib
import numpy as np
from exugear.system.build import assemble
from exugear.transient.compiled.solver import CompiledSystem, Observer
from exugear.system.loads import LoadTable
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.tooth_mesh.laws.mesh_forces import add_mesh_forces
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness

sys.path.insert(0, sys.argv[1])
from spur import SPUR_CASE
from table import surfaces

reference = Gearbox.from_toml(sys.argv[2])
errors = "[deviations.one]\\nbody = 'shaft_1'\\nrunout_um = 30.0\\n"
wobbling = Gearbox.from_dict(tomllib.loads(SPUR_CASE + errors), "spur.toml")
far = 1e18 * 1.01 ** np.arange(300)
values = np.concatenate([[np.nan, np.inf, -np.inf, 1e300, -1e300], far, -far])
for gearbox, law, data in (
    (reference, "table", surfaces(reference)),
    (wobbling, "line_of_action", {name: k * np.ones(50) for name, k in mesh_stiffness(wobbling, "iso6336").items()}),
):
    assembly = assemble(gearbox, Choice("rigid", law), data)
    rest = np.zeros(assembly.size)
    system = CompiledSystem(assembly, rest, rest, LoadTable(), 1e-6)
    observer = Observer(assembly, LoadTable())
    sign = np.where(np.arange(assembly.size) % 2, -1.0, 1.0)
    for value in values:
        q = (value * sign)[None]
        system._work.q[: assembly.size] = q
        system._work.v[: assembly.size] = 0.0
        system.advance(0, np.empty_like(q), np.empty_like(q))
        observer.observe(np.zeros(1), q, np.zeros_like(q))
        add_mesh_forces(q[0], rest, assembly.meshes, np.zeros(assembly.size))
print("alive")
"""


@pytest.mark.validation
def test_angles_that_are_no_numbers_or_too_large_do_not_crash_the_process(grc):
    command = [sys.executable, "-c", DIVERGED, str(Path(__file__).parents[1] / "cases"), grc.source]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=500, check=False)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout == "alive\n"


@pytest.mark.parametrize(
    ("place", "piece"), [(0.0, 0), (3.99, 3), (8.0, 7), (9.0, 7), (-1.0, 0), (math.inf, 7), (-1e300, 0)]
)
def test_a_place_outside_its_pieces_falls_into_the_nearest(place, piece):
    assert piece_at(place, 8) in ((piece,) if math.isfinite(place) and abs(place) < 1e18 else range(8))


def test_a_place_that_is_no_number_falls_into_some_piece():
    assert piece_at(math.nan, 8) in range(8)


def test_a_run_that_diverges_names_the_time_and_is_marked(tmp_path, monkeypatch):
    gearbox = spur()
    stiffness = stiffness_of(gearbox)
    assembly = assemble(gearbox, Choice("rigid"), stiffness)
    soft = {"spur": stiffness["spur"] * (1.0 + 0.9 * np.cos(2.0 * np.pi * np.arange(50) / 50))}
    # Good for the mean stiffness, the step is not stable at the peak of this one.
    step = 2.5 / highest_rate(assembly)
    options = {"step": step, "sample_rate": 1.0 / step, "integrator": "rk4"}
    choice = Choice("rigid", load_case="run_up")
    with pytest.raises(RunError, match="s is unstable: the fastest motion has"):
        simulate(gearbox, choice, soft, tmp_path, **options)
    monkeypatch.setattr("exugear.transient.plan.unstable", lambda integration: "")
    with pytest.raises(RunError, match=r"not finite at t = 0\.\d+ s; .*results so far"):
        simulate(gearbox, choice, soft, tmp_path, **options)
    assert invalidity_of(attributes(next(tmp_path.rglob("run.partial")))).startswith("the state is not finite")


# -- how large a run may be -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("duration", "said"),
    [
        ("inf", ": set a finite number of seconds"),
        ("nan", ": set a finite number of seconds"),
        ("1e9", "GB free; set at most"),
        ("-1", "too short"),
    ],
)
def test_a_duration_that_no_run_can_have_is_bad_input_before_anything_is_written(tmp_path, duration, said):
    case = written(tmp_path, BALANCED)
    outcome = exugear("run", case, "--duration", duration)
    assert outcome.exit_code == 2
    assert said in " ".join(outcome.stderr.split())
    assert list(tmp_path.iterdir()) == [case]


@pytest.mark.parametrize("verb", ["run", "check"])
def test_a_load_case_too_short_for_a_spectrum_is_bad_input(tmp_path, verb):
    case = written(tmp_path, BALANCED, 1.5e-3)
    outcome = exugear("run", case) if verb == "run" else CliRunner().invoke(cli.app, ["check", str(case)])
    assert outcome.exit_code == 2
    message = " ".join(outcome.stderr.split())
    assert "load_cases.run_up.duration_s = 0.0015: too short for a spectrum" in message
    assert "; set 0.00195 s or more" in message
    assert list(tmp_path.iterdir()) == [case]


def test_the_shortest_load_case_runs(tmp_path):
    outcome = exugear("run", written(tmp_path, BALANCED, 1.96e-3), "--json")
    assert outcome.exit_code == 0, outcome.stderr


def test_a_motion_too_fast_to_follow_is_named_before_anything_is_allocated(tmp_path):
    stiffest, lightest = 1e13, 1e-3
    stiff = spur().varied(
        {
            "bearings.bearing_1.stiffness.radial_N_per_m": stiffest,
            "bodies.shaft_1.inertia.disc.mass_kg": lightest,
        }
    )
    words = "against bearing_1; step = ."
    with pytest.raises(ValueError, match=words):
        simulate(stiff, Choice("bushing", load_case="run_up"), stiffness_of(stiff), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_step_that_is_asked_for_is_bounded_too(tmp_path):
    gearbox = spur()
    with pytest.raises(RunError, match=r"step = 1e-12 s: 1e\+12 steps, 5e\+07 for each stored sample"):
        simulate(gearbox, Choice("rigid", load_case="run_up"), stiffness_of(gearbox), tmp_path, step=1e-12)


def test_what_a_run_writes_does_not_depend_on_its_buffers(tmp_path, monkeypatch):
    gearbox = spur()
    stiffness = stiffness_of(gearbox)
    options = {"duration": 0.1}
    plain = simulate(gearbox, Choice("rigid", load_case="run_up"), stiffness, tmp_path / "plain", **options).path
    monkeypatch.setattr("exugear.transient.plan.BUFFER_BYTES", 400_000)
    small = simulate(gearbox, Choice("rigid", load_case="run_up"), stiffness, tmp_path / "small", **options).path
    one, other = (xr.load_dataset(path, engine="h5netcdf") for path in (plain, small))
    assert one.overall_dte.identical(other.overall_dte)
    assert other.sizes["balance_time"] > one.sizes["balance_time"]  # it did write more often
