"""Figures that the documents quote are those that the benchmarks stored."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parent.parent
FOLDER = ROOT / "benchmarks"


@pytest.fixture(scope="module")
def reporting() -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(FOLDER)  # as for the scripts, which import each other by their names
        return importlib.import_module("reporting")


@pytest.fixture(scope="module")
def results() -> dict:
    return json.loads((FOLDER / "results.json").read_text(encoding="utf-8"))


def test_tables_are_made_of_the_stored_figures(reporting: ModuleType, results: dict) -> None:
    assert (FOLDER / "results.md").read_text(encoding="utf-8") == reporting.page(results), (
        "edit benchmarks/reporting.py, not the tables; then: python benchmarks/run_all.py --render"
    )


@pytest.mark.parametrize(
    ("name", "quote"),
    [("docs/reference/computing_time.md", "in_short"), ("docs/validation/dynamics.md", "amplitudes")],
)
def test_documents_quote_the_stored_figures(reporting: ModuleType, results: dict, name: str, quote: str) -> None:
    text = (ROOT / name).read_text(encoding="utf-8")
    assert name in reporting.QUOTED
    assert reporting.QUOTES[quote](results) in text
    assert reporting.with_quotes(text, results) == text


def test_changed_figures_show(reporting: ModuleType, results: dict) -> None:
    text = (ROOT / "docs" / "reference" / "computing_time.md").read_text(encoding="utf-8")
    slower = json.loads(json.dumps(results))
    for row in slower["dynamics"]["run_ups"]["alone"]:
        row["wall_s"] *= 2.0
    assert reporting.with_quotes(text, slower) != text


def test_stored_accuracy_is_what_is_asked_for(results: dict) -> None:
    """Amplitude errors do not depend on the machine: under 0.1 % up to 6.4 kHz at the steps that runs choose."""
    chosen = [row for row in results["dynamics"]["amplitudes"] if row["chosen"]]
    assert {row["variant"] for row in chosen} == {"rigid", "bushing"}
    for row in chosen:
        assert max(abs(error) for error in (*row["overall"], *row["high_speed"])) < 1e-3


def test_every_part_says_what_it_ran_on(results: dict) -> None:
    parts = {"startup", "tables", "dynamics", "grids", "elastic", "bearings", "steady", "excitations"}
    parts |= {"loads", "studies", "report"}
    assert set(results) == parts
    for part in results.values():
        assert part["load_at_start"] >= 0.0
        assert part["cores_busy_before"] is None or part["cores_busy_before"] >= 0.0
        assert part["took_s"] > 0.0
        assert part["machine"]["cores"] >= 1
