"""The verb `steady` as a user meets it: what it writes and prints, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import get_args, get_type_hints

import pytest
import xarray as xr
from pandas import NA

from exugear import resonances
from exugear.cli.commands import models
from exugear.steady.settings import METHODS
from exugear.steady.steady_file import load_response
from fe_ste.transmission_error.table import MeshTable

from ...optional_libraries import needs_meshio
from ..cases.bearing import BEARING_CASE
from ..cases.box import box_content
from ..cases.case_mutations import toml_text
from ..cases.command import exugear

pytestmark = pytest.mark.usefixtures("coarse_tables")


def steady(case, *more):
    return exugear("steady", case, "--out", case.parent / "out", *more)


def test_the_methods_offered_are_those_of_the_library():
    assert get_args(get_type_hints(models.steady)["method"]) == METHODS


@pytest.mark.validation
def test_steady_writes_a_response_and_sums_it_up(case):
    outcome = steady(case, "--variant", "bushing", "--speeds", "500:8000", "--points", "30", "--json")
    assert outcome.exit_code == 0, outcome.stderr
    summary = json.loads(outcome.stdout)
    path = Path(summary["file"])
    assert path == case.parent / "out" / "bushing" / "line_of_action-disc" / "steady-parametric.nc"
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert data.sizes["point"] == summary["speeds"] >= 30
    assert summary["peaks_of_overall_dte"][0]["amplitude_m"] > 0.0
    table = resonances(load_response(path))
    assert [row["force_N"] for row in summary["resonances"]] == table["force_N"].to_list()
    assert [row["error_place"] for row in summary["resonances"]] == table["error_place"].replace({NA: None}).to_list()
    assert summary["largest_energy_error"] < 1e-4
    again = steady(case, "--variant", "bushing", "--speeds", "500:8000", "--points", "30")
    assert again.exit_code == 0
    assert "(all speeds)" in again.stdout
    report = exugear("report", case.parent / "out")
    assert report.exit_code == 0, report.stderr
    page = (case.parent / "out" / "report.html").read_text(encoding="utf-8")
    for words in ("Steady-state response", "Natural frequencies over speed in the fixed frame,", "strongest crossing"):
        assert words in page, words


@needs_meshio
@pytest.mark.validation
def test_the_sound_power_of_a_flexible_housing_follows_the_verdict_with_its_limits(tmp_path):
    case = tmp_path / "box.toml"
    case.write_text(toml_text(box_content(tmp_path)), encoding="utf-8")
    options = ("--variant", "flexible", "--mesh-model", "line_of_action", "--speeds", "1000:3000", "--points", "9")
    outcome = steady(case, *options, "--quantity", "sound_power", "--all")
    assert outcome.exit_code == 0, outcome.stderr
    first, second = outcome.stdout.splitlines()[:2]
    assert first.startswith("Highest peak: surface velocity ±")
    assert second.startswith("Highest sound power ") and "dB(A), upper estimate: " in second
    assert "Sound power by order at" in outcome.stdout and "third octaves" in outcome.stdout
    said = " ".join(outcome.stderr.split())
    assert "12 to 14 dB at 63 Hz" in said and "set bodies.box.solid.band_Hz to 1.5 times" in said
    sound = json.loads(steady(case, *options, "--json").stdout)["sound"]
    assert sum(10.0 ** (0.1 * own["level_dBA"]) for own in sound["orders"]) == pytest.approx(
        10.0 ** (0.1 * sound["level_dBA"]), rel=1e-9
    )
    assert "Contributions to the sound power of the loudest orders at" in outcome.stdout
    said = json.loads(exugear("report", tmp_path / "out", "--json").stdout)["statements"]
    (line,) = [own for own in said if own.startswith("Sound power of the housing")]
    assert f"{sound['level_dBA']:.1f} dB(A), upper estimate, at {sound['speed_rpm']:.0f} rpm" in line
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert all(f"{own['level_dB']:.1f}" in page and f"{own['level_dBA']:.1f}" in page for own in sound["orders"])


@pytest.mark.validation
def test_loads_of_runs_and_responses_are_told_and_a_response_can_be_at_that_of_a_load_case(case):
    text = case.read_text(encoding="utf-8").replace(
        "shaft_1 = 100.0, shaft_2 = 140.0", "shaft_1 = 40.0, shaft_2 = 50.0"
    )
    case.write_text(text, encoding="utf-8")
    options = "--variant", "rigid", "--speeds", "1000:1100", "--points", "3"
    usual = steady(case, *options)
    assert "at shaft_1 100 N m" in " ".join(usual.stdout.split())
    said = "static load (shaft_1 100 N m); load case run_up has another load (shaft_1 40 N m"
    assert said in usual.stderr
    there = steady(case, *options, "--load-case", "run_up", "--json")
    assert there.exit_code == 0, there.stderr
    summary = json.loads(there.stdout)
    assert summary["static_load"] == "shaft_1 40 N m"
    assert "has another load" not in there.stderr
    assert Path(summary["file"]).parents[2] == case.parent / "out" / "at-run_up"
    assert exugear("report", case.parent / "out" / "at-run_up").exit_code == 0
    run = exugear("run", case, "--variant", "rigid", "--out", case.parent / "out", "--all")
    assert "run_up (shaft_1 40 N m, shaft_2 50 N m), mesh model" in " ".join(run.stdout.split())
    assert "load_cases.run_up: other load: spur 37 % of the static load" in run.stderr
    there = exugear("run", case, "--variant", "rigid", "--out", case.parent / "out", "--at-load-case", "--json")
    assert there.exit_code == 0, there.stderr
    assert "other load" not in there.stderr
    assert Path(json.loads(there.stdout)["file"]).is_relative_to(case.parent / "out" / "at-run_up")
    assert MeshTable.open(case.parent / "out" / "at-run_up" / "tables" / "spur.nc").static_state["torque"] == 40.0
    written = json.loads(exugear("report", case.parent / "out", "--json").stdout)["statements"]
    assert any("the run-up of the load case run_up has another load (shaft_1 40 N m" in line for line in written)


@pytest.mark.validation
def test_bearings_follow_their_elements_at_the_level_nonlinear(tmp_path):
    """The state, its report and what is said of it; other levels say that they do not."""
    case = tmp_path / "bearings.toml"
    text = BEARING_CASE.replace("[bearings.roller.catalogue]", 'model = "iso16281"\n[bearings.roller.catalogue]')
    case.write_text(text, encoding="utf-8")
    options = "--variant", "bushing", "--speeds", "1000:1100", "--points", "3"
    outcome = steady(case, *options, "--method", "nonlinear", "--json")
    assert outcome.exit_code == 0, outcome.stderr
    summary = json.loads(outcome.stdout)
    assert summary["bearings_in_time"] == "roller"
    assert summary["largest_energy_error"] < 1e-4
    assert any("(rolling elements evaluated in time): roller" in own["text"] for own in summary["findings"])
    outcome = steady(case, *options, "--method", "linear", "--all")
    assert outcome.exit_code == 0, outcome.stderr
    assert "nonlinear bearings are linearised at the static load" in " ".join(outcome.stdout.split())
    report = exugear("report", case.parent / "out")
    assert report.exit_code == 0, report.stderr


@pytest.mark.validation
def test_the_range_of_the_load_case_is_the_usual_one(case):
    outcome = steady(case, "--variant", "rigid", "--method", "linear", "--json")
    assert outcome.exit_code == 0, outcome.stderr
    assert json.loads(outcome.stdout)["speeds"] >= 399


@pytest.mark.sample
@pytest.mark.parametrize("law", ["iso6336", "constant"])
def test_a_law_without_a_wave_excites_nothing_and_says_so(case, law):
    outcome = steady(
        case, "--variant", "bushing", "--mesh-model", law, "--speeds", "500:8000", "--points", "20", "--json"
    )
    assert outcome.exit_code == 0, outcome.stderr
    summary = json.loads(outcome.stdout)
    assert (summary["excited"], summary["speeds"], summary["peaks_of_overall_dte"]) == (False, 20, [])
    assert f"Warning: no excitation: the mesh model {law} has constant stiffness" in outcome.stderr
    assert Path(summary["file"]).exists()


@pytest.mark.validation
def test_harmonics_are_told_and_may_be_asked_for(case):
    options = "--variant", "bushing", "--speeds", "1400:1500", "--points", "5"
    usual = json.loads(steady(case, *options, "--json").stdout)
    assert usual["harmonics"] >= 10
    outcome = steady(case, *options, "--harmonics", "3", "--json")
    summary = json.loads(outcome.stdout)
    assert summary["harmonics"] == 3
    assert summary["truncation_of_compliance"]["spur"] > usual["truncation_of_compliance"]["spur"]
    assert summary["change_with_more_harmonics"] > usual["change_with_more_harmonics"]
    assert any(own["text"].startswith("3 mesh harmonics (5 would change") for own in summary["findings"])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--variant", "rigid", "--harmonics", "0"), "must be from 1 to 100"),
        (("--variant", "rigid", "--harmonics", "1000"), "must be from 1 to 100"),
        (("--variant", "rigid", "--speeds", "5"), "must be FIRST:LAST in rpm"),
        (("--variant", "rigid", "--speeds", "0:fast"), "must be FIRST:LAST in rpm"),
        (("--variant", "rigid", "--speeds", "0:215:400"), "write --speeds 0:215 --points 400"),
        (("--variant", "rigid", "--points", "0"), "the count must be from 1 to 20000"),
        (
            ("--variant", "rigid", "--speeds", "-5:5", "--points", "10"),
            ": change sign; compute each sense of rotation separately",
        ),
        (("--variant", "rigid", "--speeds", "0:1e6", "--points", "10"), "m/s, and steel gears burst at about"),
        (("--variant", "rigid", "--speeds", "0:1e300", "--points", "10"), "m/s, and steel gears burst at about"),
        (
            ("--variant", "rigid", "--mesh-model", "kinematic"),
            ": kinematic constraint without vibration; use another mesh model",
        ),
        (("--variant", "rigid", "--mesh-model", "table"), ": includes contact loss, which the method"),
    ],
)
def test_what_cannot_be_answered_is_one_sentence_and_code_2(case, options, said):
    outcome = steady(case, *options)
    assert outcome.exit_code == 2
    assert said in outcome.stderr


@pytest.mark.validation
def test_a_response_in_which_teeth_pull_says_where(case):
    """On ideal joints the spur pair's force swings beyond its static one at the resonance, and grows besides."""
    outcome = steady(case, "--variant", "rigid", "--speeds", "500:8000", "--points", "30", "--json")
    assert outcome.exit_code == 1
    assert "disturbances grow" in outcome.stderr
    (pull,) = json.loads(outcome.stdout)["meshes_that_pull"]
    assert pull["mesh"] == "spur" and pull["speeds"] > 0
    assert "spur: tensile mesh force at" in outcome.stderr


def test_an_unstable_response_ends_with_code_1_and_says_so(case, monkeypatch):
    from exugear.project import Project

    kept = Project.steady

    def unstable(self, settings, *progress):
        return kept(self, settings, *progress).assign_attrs(growth_rate=221.0)

    monkeypatch.setattr(Project, "steady", unstable)
    outcome = steady(case, "--variant", "rigid", "--speeds", "10:50", "--points", "5")
    assert outcome.exit_code == 1
    assert "Failed: the steady state is unstable: disturbances grow at up to 221 1/s" in outcome.stderr


@pytest.mark.validation
def test_a_branch_that_is_not_whole_ends_with_code_1_and_says_where(case, monkeypatch):
    from exugear.project import Project

    kept, words = Project.steady, "the continuation ends at 12.5 rpm after 2000 points, before"

    def ended(self, settings, *progress):
        return kept(self, settings, *progress).assign_attrs(branch_ended=words, growth_rate=-1.0)

    monkeypatch.setattr(Project, "steady", ended)
    outcome = steady(case, "--variant", "bushing", "--speeds", "1400:1500", "--points", "3", "--json")
    assert outcome.exit_code == 1
    assert f"continuation incomplete: {words}" in outcome.stderr
    assert json.loads(outcome.stdout)["branch_ended"] == words
