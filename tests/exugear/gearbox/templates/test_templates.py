"""Gearbox files to start from: without an error or a warning, and through the verbs as they are."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import KINDS, template

from ...cases.command import exugear
from ...cases.spur import COARSE_INPUT

QUICKLY_REPORTED = ("pair", "planetary")
"""Templates whose report is written here as well; those of all are by the verbs with tables below."""
RUN_IN_EACH_CHANGE = [pytest.param(kind, marks=() if kind == "wind" else pytest.mark.long) for kind in KINDS]
"""The template of planets and of parallel stages; `pair` goes through all verbs in each change."""


@pytest.fixture(params=KINDS)
def case(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / request.param / "gearbox.toml"
    assert exugear("new", path, "--kind", request.param).exit_code == 0
    return path


@cache
def checked(content: str, folder: Path) -> str:
    """What `check` tells of a file with that content, the same wherever it lies."""
    path = folder / "gearbox.toml"
    path.write_text(content, encoding="utf-8")
    return str(exugear("check", path, "--json").stdout)


@pytest.fixture(scope="module")
def checks(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Path], dict[str, Any]]:
    """Check of a new file, done once for all tests."""
    folder = tmp_path_factory.mktemp("checked")
    return lambda case: json.loads(checked(case.read_text(encoding="utf-8"), folder))


@pytest.mark.sample
def test_a_new_file_has_neither_fault_nor_warning_and_both_variants(
    case: Path, checks: Callable[[Path], dict[str, Any]]
) -> None:
    found = checks(case)
    assert found["warnings"] == []
    assert not found["variants"]["rigid"] and not found["variants"]["bushing"]


def test_the_run_up_ends_at_the_speed_that_the_file_says(case: Path, checks: Callable[[Path], dict[str, Any]]) -> None:
    stated = float(re.search(r"# 0 to (\d+) rpm", case.read_text(encoding="utf-8")).group(1))
    gearbox = Gearbox.from_toml(case)
    ends = checks(case)["load_cases"][0]
    assert abs(ends["end_speed_rpm"]) == pytest.approx(stated, rel=0.01)
    assert gearbox.load_cases["run_up"].duration >= 10.0


@pytest.mark.validation
@pytest.mark.parametrize("case", RUN_IN_EACH_CHANGE, indirect=True)
def test_a_new_file_runs_and_has_modes_in_both_variants(case: Path) -> None:
    out = case.parent / "out"
    for variant in ("rigid", "bushing"):
        how = ("--variant", variant, "--mesh-model", "iso6336", "--out", out)
        ran = exugear("run", case, *how, "--duration", 0.05, "--json")
        assert ran.exit_code == 0, ran.stderr
        modes = exugear("modes", case, *how, "--json")
        assert modes.exit_code == 0, modes.stderr
    if case.parent.name in QUICKLY_REPORTED:
        assert exugear("report", out).exit_code == 0


@pytest.mark.validation
@pytest.mark.sample
def test_a_new_file_goes_through_all_verbs_with_tables_of_its_teeth(
    case: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The pair with few elements a tooth: what the README shows, in a test of its own, has the default mesh."""
    if case.parent.name == "pair":
        monkeypatch.setattr("exugear.system.tooth_mesh.tables.TableInput", COARSE_INPUT)
    out = case.parent / "out"
    assert exugear("ste", case, "--positions", 8, "--out", out).exit_code == 0
    for variant in ("rigid", "bushing"):
        how = ("--variant", variant, "--out", out)
        assert exugear("run", case, *how, "--duration", 0.2).exit_code == 0
        assert exugear("modes", case, *how).exit_code == 0
    assert exugear("bearings", case, "--out", out).exit_code == 0
    assert exugear("view", case, "--out", out).exit_code == 0
    assert exugear("report", out).exit_code == 0


def test_a_file_that_is_there_is_not_written_over(tmp_path: Path) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_text("mine", encoding="utf-8")
    refused = exugear("new", mine, "--kind", "pair")
    assert refused.exit_code == 2 and "not overwritten" in refused.stderr
    assert mine.read_text(encoding="utf-8") == "mine"
    assert exugear("new", tmp_path / "mine.txt", "--kind", "pair").exit_code == 2


def test_the_template_without_an_option_is_that_of_parallel_stages(tmp_path: Path) -> None:
    path = tmp_path / "gearbox.toml"
    assert exugear("new", path).exit_code == 0
    assert path.read_text(encoding="utf-8") == template("parallel")


@pytest.mark.validation
def test_a_report_of_the_folder_of_the_gearbox_file_is_that_of_its_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert exugear("new", "my/gearbox.toml").exit_code == 0
    refused = exugear("report", "my")
    assert refused.exit_code == 2 and "my: contains no results" in refused.stderr
    assert exugear("modes", "my/gearbox.toml", "--variant", "bushing", "--mesh-model", "iso6336").exit_code == 0
    written = exugear("report", "my", "--all")
    assert written.exit_code == 0 and "its results are in results/my" in written.stderr
    page = (tmp_path / "results" / "my" / "report.html").read_text(encoding="utf-8")
    for command in ("exugear steady", "exugear run"):
        line = f"{command} my/gearbox.toml --variant bushing --mesh-model iso6336 --out results/my"
        assert line in " ".join(written.stdout.split()) and line in page
    assert exugear("report", tmp_path / "nothing").exit_code == 2


def test_a_place_where_no_file_can_be_is_bad_input(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert exugear("new", tmp_path / "file" / "mine.toml", "--kind", "pair").exit_code == 2
    assert exugear("schema", "--out", tmp_path).exit_code == 2


@pytest.mark.parametrize("command", [("loads",), ("losses",), ("check", "--rating")])
def test_loads_losses_and_rating_run_on_a_new_file(case: Path, command: tuple[str, ...]) -> None:
    verb, *options = command
    outcome = exugear(verb, case, *options, "--out", case.parent / "out")
    assert outcome.exit_code == 0, outcome.stderr
    assert "Traceback" not in outcome.stderr


@pytest.mark.validation
@pytest.mark.sample
@pytest.mark.parametrize("kind", KINDS)
def test_the_life_of_a_new_file_is_long_enough(kind: str, tmp_path: Path) -> None:
    """The first kind in each change: the way through the program is the same for all, wind takes four times as long."""
    path = tmp_path / kind / "gearbox.toml"
    assert exugear("new", path, "--kind", kind).exit_code == 0
    outcome = exugear("life", path, "--variant", "bushing", "--mesh-model", "iso6336", "--out", tmp_path / "out")
    assert outcome.exit_code == 0, outcome.stderr
