"""Damaged gearbox files: `check` refuses them in words or passes what a later verb takes, and never hangs."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import pytest
from typer.testing import CliRunner

from exugear.cli.app import app
from exugear.gearbox.reading import LONGEST_ERROR, SHOWN_ERRORS

from ..cases.case_mutations import bases, mutant, toml_text

LIMIT = 60.0
"""Longest that a verb may take on a small file, s."""


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    def overdue(number: int, frame: FrameType | None) -> None:
        raise TimeoutError(f"still at work after {seconds:g} s")

    before = signal.signal(signal.SIGALRM, overdue)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def exugear(*arguments: object) -> Any:
    with at_most(LIMIT):
        return CliRunner().invoke(app, [str(argument) for argument in arguments])


def is_refused_in_words(outcome: Any, file: Path) -> bool:
    """Tell whether a file was refused: exit code 2, and a line for each error that names the file."""
    assert outcome.exit_code in (0, 2), f"exit code {outcome.exit_code}: {outcome.exception!r} {outcome.stderr}"
    assert outcome.exception is None or isinstance(outcome.exception, SystemExit)
    if outcome.exit_code == 0:
        return False
    lines = outcome.stderr.rstrip("\n").split("\n")
    lines = [line for line in lines if not line.startswith("Warning: ")]
    assert lines[0].startswith("Bad input: ")
    lines[0] = lines[0].removeprefix("Bad input: ")
    assert len(lines) <= SHOWN_ERRORS + 1
    for number, line in enumerate(lines):
        assert str(file.parent) in line or (number == SHOWN_ERRORS and line.startswith("and ")), line
        assert len(line) <= len(str(file)) + LONGEST_ERROR + 100, line
        assert line.isprintable(), line
    return True


def survives_check(starts: dict[str, dict[str, Any]], seed: int, file: Path) -> dict[str, Any] | None:
    """Check one mutant; return its summary where it passes."""
    text, told = mutant(starts, seed)
    file.write_text(text, encoding="utf-8", newline="")
    outcome = None
    try:
        outcome = exugear("check", file, "--json")
        return None if is_refused_in_words(outcome, file) else json.loads(outcome.stdout)
    except Exception as error:  # whatever it was: the seed tells how to see it again
        raise AssertionError(f"{told}: {error!r}") from (outcome.exception if outcome else error)


def survives_modes(starts: dict[str, dict[str, Any]], seed: int, file: Path) -> None:
    """Take a mutant through check and modes: what check passes, modes takes, and what it refuses, writes nothing."""
    summary = survives_check(starts, seed, file)
    told = mutant(starts, seed)[1]
    for variant in ("rigid", "bushing"):
        out = file.parent / f"out-{seed}-{variant}"
        outcome = exugear("modes", file, "--variant", variant, "--mesh-model", "iso6336", "--out", out)
        try:
            refused = is_refused_in_words(outcome, file)
        except AssertionError as error:
            raise AssertionError(f"{told}: {variant}: {error}") from outcome.exception
        assert refused == (summary is None or summary["variants"][variant] != ""), (told, outcome.stderr)
        assert not (refused and out.exists()), f"{told}: {variant} was refused after {out} was written"


@pytest.fixture(scope="module")
def starts(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, dict[str, Any]]]:
    folder = tmp_path_factory.mktemp("case")
    return folder / "mutant.toml", bases(folder)


@pytest.mark.validation
def test_the_cases_to_start_from_have_no_fault(starts: tuple[Path, dict[str, dict[str, Any]]]) -> None:
    file, cases = starts
    for name, content in cases.items():
        file.write_text(toml_text(content), encoding="utf-8")
        outcome = exugear("check", file, "--json")
        assert outcome.exit_code == 0, f"{name}: {outcome.stderr} {outcome.exception!r}"
        assert not [line for line in json.loads(outcome.stdout)["warnings"] if not line.startswith("damping of")]


@pytest.mark.validation
@pytest.mark.parametrize("seeds", [range(20), pytest.param(range(1000, 1600), marks=pytest.mark.long)], ids=str)
def test_damaged_files_are_refused_in_words_or_pass(
    starts: tuple[Path, dict[str, dict[str, Any]]], seeds: range
) -> None:
    file, cases = starts
    passed = [survives_check(cases, seed, file) is not None for seed in seeds]
    assert 0.1 < sum(passed) / len(passed) < 0.8  # else the mutants are no test of anything


@pytest.mark.parametrize(
    "seeds",
    [range(3), pytest.param(range(100, 120), marks=[pytest.mark.validation, pytest.mark.long])],
    ids=str,
)
def test_what_check_passes_modes_takes(starts: tuple[Path, dict[str, dict[str, Any]]], seeds: range) -> None:
    file, cases = starts
    for seed in seeds:
        survives_modes(cases, seed, file)


@pytest.mark.parametrize(
    "seeds",
    [range(4), pytest.param(range(200, 350), marks=[pytest.mark.validation, pytest.mark.long])],
    ids=str,
)
def test_losses_refuses_damaged_files_in_words(
    starts: tuple[Path, dict[str, dict[str, Any]]], seeds: range, tmp_path: Path
) -> None:
    oil = {"viscosity_40_mm2_per_s": 220.0, "viscosity_100_mm2_per_s": 19.0, "temperature_C": 70.0}
    _, cases = starts
    for name, content in cases.items():
        seals = {"lip": {"body": next(iter(content["bodies"])), "diameter_mm": 50.0}}
        cases = {**cases, name: {**content, "lubricant": oil, "seals": seals}}
    file = tmp_path / "mutant.toml"
    for seed in seeds:
        text, told = mutant(cases, seed)
        file.write_text(text, encoding="utf-8", newline="")
        outcome = exugear("losses", file, "--json", "--out", tmp_path / "none")
        try:
            assert is_refused_in_words(outcome, file) or json.loads(outcome.stdout)["losses_W"] >= 0.0
        except (AssertionError, ValueError) as error:
            raise AssertionError(f"{told}: {error}") from outcome.exception
        assert not (tmp_path / "none").exists()
