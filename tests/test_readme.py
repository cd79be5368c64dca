"""What the README shows runs as printed."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from typer.testing import CliRunner

import exugear
from exugear.cli.app import app

ROOT = Path(__file__).parent.parent
README = ROOT / "README.md"
TEXT = README.read_text(encoding="utf-8")
COMMANDS = [line.strip() for line in re.findall(r"^    (.*)$", re.sub(r"```.*?```", "", TEXT, flags=re.DOTALL), re.M)]


def commands_of(program: str) -> list[list[str]]:
    """Arguments of all lines that call a program, what explains them left out."""
    lines = [re.split(r"\s{2,}", line)[0].split() for line in COMMANDS]
    return [words[1:] for words in lines if Path(words[0]).name == program]


def test_every_command_is_one_that_is_tested_here() -> None:
    assert {Path(line.split()[0]).name for line in COMMANDS} == {"make", "pip", "exugear"}


def test_both_commands_stand_first() -> None:
    assert [words[0] for words in commands_of("make")] == ["demo", "test"]


@pytest.mark.parametrize("target", sorted(set(re.findall(r"\bmake ([a-z-]+)", TEXT))))
def test_a_target_is_one_of_the_makefile(target: str) -> None:
    make = shutil.which("make")
    if make is None:
        pytest.skip("there is no make here")
    asked = subprocess.run([make, "--dry-run", target], cwd=ROOT, capture_output=True, text=True, check=False)
    assert asked.returncode == 0, asked.stderr


def test_what_pip_installs_is_there_and_of_this_version() -> None:
    checkout, wheel = commands_of("pip")
    assert (ROOT / checkout[checkout.index("-c") + 1]).is_file()
    assert f"exugear-{exugear.__version__}-py3-none-any.whl[all]" in " ".join(wheel)
    assert f"Version {exugear.__version__}" in TEXT
    assert "[all]" in checkout[-1]


@pytest.mark.parametrize("words", commands_of("exugear"), ids=" ".join)
def test_a_verb_has_the_options_that_are_shown(words: list[str]) -> None:
    asked = CliRunner().invoke(app, [words[0], "--help"], env={"COLUMNS": "200"})
    assert asked.exit_code == 0
    for word in words[1:]:
        assert not word.startswith("--") or word in asked.output


@pytest.mark.validation
def test_a_gearbox_of_ones_own_goes_from_file_to_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The lines with a path of the environment, as a user types them."""
    monkeypatch.chdir(tmp_path)
    lines = [line.split()[1:] for line in COMMANDS if line.startswith(".venv/bin/exugear")]
    assert [words[0] for words in lines] == ["new", "steady", "report"]
    for words in lines:
        more = ["--all"] if words[0] == "report" else []
        outcome = CliRunner().invoke(app, [*words, *more], env={"COLUMNS": "80"})
        assert outcome.exit_code == 0, outcome.output
        if words[0] == "steady":
            (shown,) = re.findall(r"```text\n(.*?)```", TEXT, re.DOTALL)
            assert shown in outcome.output
    results = tmp_path / "results" / "my"
    # The three commands give all that the page shows but the run-up: the last one computes modes.
    assert "Not computed: run-up" in outcome.output and outcome.output.count("Not computed") == 1
    assert list(results.glob("bushing/*/modes.nc")) and list(results.glob("bushing/*/steady-parametric.nc"))
    assert (results / "report.html").is_file()


def test_the_python_example_runs(capsys):
    (program,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    exec(compile(program, str(README), "exec"), {})
    lines = capsys.readouterr().out.splitlines()
    found = {float(line.split()[2].rstrip(":")): float(line.split()[3]) for line in lines}
    assert list(found) == [0.2, 0.5, 1.0]
    assert found[0.2] < found[0.5] < found[1.0], "stiffer seats raise the frequency of a mode on bearings"
