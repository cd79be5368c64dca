"""A run compared with Exudyn over its beginning: what is printed, stored, refused, and shown by the report."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from exugear.cli.app import app
from exugear.results.run_file import FINAL_NAME
from exugear.results.solver_comparison import COMPARED, EXUDYN_FOLDER, compare_solvers
from fe_ste.tools.files import FileError

from ..cases.spur import SPUR_CASE


def exugear(*arguments: object):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def case(tmp_path: Path) -> Path:
    path = tmp_path / "spur.toml"
    path.write_text(SPUR_CASE, encoding="utf-8")
    return path


def run(case: Path, *more: object):
    usual = ("--variant", "bushing", "--mesh-model", "iso6336", "--duration", 0.05, "--out", case.parent / "out")
    return exugear("run", case, *usual, *more)


def test_a_run_says_how_far_it_is_from_exudyn_and_the_report_shows_it(case):
    done = run(case, "--compare-exudyn", 0.02, "--json")
    assert done.exit_code == 0, done.output
    apart = json.loads(done.stdout)["apart_from_exudyn"]
    assert set(apart) == set(COMPARED) - {"coupling_torque"}  # the gearbox has no coupling
    # The steps of both methods err by less at the frequencies that a signal holds.
    assert max(apart.values()) < 1e-5
    out = case.parent / "out"
    (path,) = [
        found for found in out.glob(f"*/*/{FINAL_NAME}") if EXUDYN_FOLDER not in found.relative_to(out).parts[:1]
    ]
    found = compare_solvers(path, out / EXUDYN_FOLDER / path.relative_to(out))
    assert found.difference == apart
    assert found.duration == pytest.approx(0.02, abs=2e-3)
    assert exugear("report", out).exit_code == 0
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Comparison with Exudyn" in page and "with mesh forces from user functions; maximum difference:" in page


def test_a_run_of_another_input_is_not_compared_and_the_report_says_so(case):
    assert run(case, "--compare-exudyn", 0.02).exit_code == 0
    out = case.parent / "out"
    case.write_text(SPUR_CASE.replace("shaft_1 = 100.0 }, locked", "shaft_1 = 110.0 }, locked"), encoding="utf-8")
    assert run(case).exit_code == 0
    (path,) = out.glob(f"bushing/*/{FINAL_NAME}")
    with pytest.raises(FileError, match="another input"):
        compare_solvers(path, out / EXUDYN_FOLDER / path.relative_to(out))
    done = exugear("report", out)
    assert done.exit_code == 0
    assert "another input" in done.output.replace("\n", " ")


def test_what_cannot_be_compared_is_refused_before_anything_runs(case):
    own = run(case, "--compare-exudyn", 0.02, "--solver", "exudyn")
    assert own.exit_code == 2 and "--compare-exudyn" in own.output
    for duration in (0.0, -1.0, "nan", "inf", 1e12):
        refused = run(case, "--compare-exudyn", duration)
        assert refused.exit_code == 2 and "--compare-exudyn" in refused.output
    assert not (case.parent / "out" / EXUDYN_FOLDER).exists()
