"""The scripts of cases/grc750 explain themselves with --help and refuse arguments that they do not know."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent.parent / "cases" / "grc750"
SHARED = ("arguments", "one_variant", "published")
SCRIPTS = sorted(file.stem for file in FOLDER.glob("*.py") if file.stem not in SHARED)


def marked(script: str) -> pytest.param:
    return pytest.param(script, marks=[] if script == "rigid" else [pytest.mark.validation])


@pytest.mark.parametrize("script", [marked(script) for script in SCRIPTS])
def test_a_script_has_a_help_and_refuses_unknown_arguments(script: str, tmp_path: Path) -> None:
    for arguments, code in ((["--help"], 0), (["--nothing"], 2), (["a", "b"], 2)):
        command = [sys.executable, str(FOLDER / f"{script}.py"), *arguments]
        outcome = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60)
        assert outcome.returncode == code, outcome.stderr
        assert ("GRC" in outcome.stdout) == (code == 0)
    assert not list(tmp_path.iterdir())
