"""The command line as a user meets it: what is printed where, and the exit codes."""

from __future__ import annotations

import json
from importlib.metadata import version
from pathlib import Path

import pytest
from typer.testing import CliRunner

from exugear.cli import app
from exugear.console import BadInputError, FailedError, exit_codes

CASE = Path(__file__).parents[2] / "cases" / "grc750" / "gearbox.toml"


def exugear(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def changed_case(tmp_path, old, new):
    """Write the case with one piece of its text replaced."""
    text = CASE.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path = tmp_path / "gearbox.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


def test_check_prints_the_ratio_and_the_pairs():
    outcome = exugear("check", CASE)
    assert outcome.exit_code == 0, outcome.stderr
    assert "81.490683" in outcome.stdout
    assert "sun_planet" in outcome.stdout
    assert outcome.stderr == ""


def test_check_as_json_is_one_object_on_standard_output():
    outcome = exugear("check", CASE, "--json")
    summary = json.loads(outcome.stdout)
    assert outcome.exit_code == 0
    # Follows from the tooth numbers alone.
    assert summary["ratio"] == pytest.approx((1 + 99 / 21) * 82 / 23 * 88 / 22, rel=1e-12)
    assert [pair["teeth"] for pair in summary["pairs"]] == [[21, 39], [39, 99], [23, 82], [22, 88]]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("teeth = 21 ", "teeth = -21 ", ["gears.sun.teeth", "-21", "greater than"]),
        ("teeth = 21 ", "theeth = 21 ", ["gears.sun.theeth", "did you mean 'teeth'"]),
        ("teeth = 21 ", "teeth 21 ", ["not valid TOML"]),
    ],
)
def test_a_fault_in_the_file_is_one_message_on_standard_error_and_code_2(tmp_path, old, new, said):
    case = changed_case(tmp_path, old, new)
    outcome = exugear("check", case)
    assert outcome.exit_code == 2
    assert outcome.stdout == ""
    assert len(outcome.stderr.splitlines()) == 1
    for words in [str(case), *said]:
        assert words in outcome.stderr


def test_a_missing_file_is_bad_input(tmp_path):
    outcome = exugear("check", tmp_path / "absent.toml")
    assert outcome.exit_code == 2
    assert "absent.toml" in outcome.stderr


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (BadInputError("x.toml: wrong"), 2, "Bad input: x.toml: wrong"),
        (FailedError("no solution"), 1, "Failed: no solution"),
        (KeyboardInterrupt(), 130, "Stopped: finished results are kept"),
    ],
)
def test_exit_codes(error, code, said, capsys):
    with pytest.raises(SystemExit) as ended, exit_codes():
        raise error
    assert ended.value.code == code
    assert said in capsys.readouterr().err


def test_an_error_of_the_program_itself_keeps_its_traceback():
    with pytest.raises(ZeroDivisionError), exit_codes():
        raise ZeroDivisionError


def test_the_version_is_that_of_the_distribution():
    assert exugear("--version").stdout.split() == ["exugear", version("exugear")]
