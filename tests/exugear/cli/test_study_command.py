"""The verb `sweep` as a user meets it: what it writes and prints, what it refuses, how it ends."""

from __future__ import annotations

import json

import pytest

from exugear.studies.dataset import load_study

from ..cases.command import exugear
from ..cases.spur import COARSE_INPUT
from ..cases.study import written_case

STUDY = """
name = "seats"
case = "spur.toml"
choice = { variant = "rigid", mesh_model = "iso6336" }

[parameters.seat]
path = "damping.mesh_time_s"
values = [1e-6, 2e-6, 4e-6]

[outputs.frequency]
quantity = "frequencies"
count = 1

[outputs.damping]
quantity = "nearest_damping"
near_Hz = 2000.0
"""


@pytest.fixture
def study(tmp_path):
    written_case(tmp_path)
    path = tmp_path / "seats.study.toml"
    path.write_text(STUDY, encoding="utf-8")
    return path


def sweep(study, *more):
    return exugear("study", study, "--out", study.parent / "out", *more)


def replaced(study, old, new):
    text = study.read_text(encoding="utf-8")
    assert old in text
    study.write_text(text.replace(old, new), encoding="utf-8")


def test_sweep_writes_a_dataset_and_sums_it_up(study):
    outcome = sweep(study, "--workers", 1, "--json")
    assert outcome.exit_code == 0, outcome.stderr
    summary = json.loads(outcome.stdout)
    assert (summary["points"], summary["computed"], summary["failed"]) == (3, 3, 0)
    data = load_study(summary["file"])
    damping = data["damping"].to_numpy()
    assert damping[2] / damping[0] == pytest.approx(4.0, rel=1e-6)  # damping by time; one elastic mode
    assert json.loads(data.attrs["case"])["name"] == "one spur pair"
    # One of the outputs has a dimension of its own, which no row of the table can hold.
    assert "In the file only, with several values at each point: frequency." in sweep(study, "--workers", 1).stdout
    assert json.loads(data.attrs["study"])["parameters"]["seat"]["values"] == [1e-6, 2e-6, 4e-6]
    again = sweep(study, "--workers", 1)
    assert again.exit_code == 0 and "0 computed now" in again.stdout


def test_without_a_folder_results_lie_beside_those_of_the_case(study, monkeypatch):
    monkeypatch.chdir(study.parent)
    outcome = exugear("study", study.name, "--workers", "1")
    assert outcome.exit_code == 0, outcome.stderr
    folder = study.parent / "results" / study.parent.name / "studies" / "seats"
    assert (folder / "study.nc").is_file()


def test_failed_points_end_with_1_and_their_errors(study):
    replaced(study, "values = [1e-6, 2e-6, 4e-6]", "uniform = { min = 0.0, max = 0.02 }")
    replaced(study, "[parameters.seat]", "samples = 4\n[parameters.seat]")
    outcome = sweep(study, "--workers", 1)
    assert outcome.exit_code == 1
    assert "2 of 4 points failed" in outcome.stderr and "damping.mesh_time_s" in outcome.stderr
    assert "Results: " in outcome.stdout


def test_what_is_missing_after_a_merge_ends_with_1(study):
    first = sweep(study, "--workers", 1, "--shard", "1/3")
    assert first.exit_code == 0 and "2 points belong to other shards" in first.stderr
    merged = sweep(study, "--merge")
    assert merged.exit_code == 1 and "2 of 3 points are missing" in merged.stderr
    assert int(load_study(study.parent / "out" / "study.nc")["damping"].isnull().sum()) == 2


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("damping.mesh_time_s", "damping.mesh_tim_s", "did you mean damping.mesh_time_s"),
        ("[1e-6, 2e-6, 4e-6]", "[1e-6, 1e-6]", "values 1 and 2 are the same point, damping.mesh_time_s"),
        ("outputs.frequency", "outputs.memory", ": this is the name of the results of each point"),
        ('"iso6336"', '"iso"', "unknown mesh model; choose one of"),
        ('"rigid"', '"rigid", load_case = "none"', "no load case 'none'; choose one of: run_up"),
        ('"spur.toml"', '"spu.toml"', "spu.toml"),
        ("[outputs.frequency]", "[outputs.frequency", "not valid TOML"),
    ],
)
def test_bad_input_is_told_and_nothing_written(study, old, new, words):
    replaced(study, old, new)
    outcome = sweep(study)
    assert outcome.exit_code == 2 and words in outcome.stderr
    assert not (study.parent / "out").exists()


def test_a_listed_value_that_cannot_be_is_a_failed_point_with_parameter_and_value(study):
    replaced(study, "[1e-6, 2e-6, 4e-6]", "[1e-6, 2.0]")
    outcome = sweep(study, "--workers", "1")
    assert outcome.exit_code == 1
    assert "1 of 2 points failed" in outcome.stderr
    assert "parameters.seat: damping.mesh_time_s = 2.0" in outcome.stderr
    assert "damping.mesh_time_s = 2.0: must lie between" in outcome.stderr
    data = load_study(study.parent / "out" / "study.nc")
    assert [bool(one) for one in data["damping"].isnull()] == [False, True]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--shard", "3/2"], "parts are 1/2 to 2/2"),
        (["--shard", "a"], "must be i/n"),
        (["--shard", "1/2", "--merge"], "remove --shard"),
        (["--executor", "dask"], "requires --scheduler ADDRESS"),
        (["--scheduler", "tcp://a:1"], "add --executor dask"),
        (["--executor", "dask", "--scheduler", "a", "--workers", "2"], "remove --workers"),
    ],
)
def test_options_that_do_not_go_together_are_refused(study, options, words):
    outcome = sweep(study, *options)
    assert outcome.exit_code == 2 and words in outcome.stderr


def test_a_report_shows_the_studies_of_its_folder(study, monkeypatch):
    monkeypatch.setattr("exugear.system.tooth_mesh.tables.TableInput", COARSE_INPUT)
    results = study.parent / "results"
    swept = exugear("study", study, "--workers", "1", "--out", results / "studies" / "seats")
    assert swept.exit_code == 0, swept.stderr
    case = str(study.parent / "spur.toml")
    modes = exugear("modes", case, "--variant", "rigid", "--mesh-model", "iso6336", "--out", results)
    assert modes.exit_code == 0, modes.stderr
    outcome = exugear("report", results)
    assert outcome.exit_code == 0, outcome.stderr
    page = (results / "report.html").read_text(encoding="utf-8")
    assert ">Studies<" in page and ">seats<" in page and 'alt="damping"' in page and "data:image/png;base64" in page
    assert "changed since" not in page
