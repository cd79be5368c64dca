"""The scripts of cases/grc750 explain themselves with --help and refuse arguments that they do not know."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent.parent / "cases" / "grc750"
SHARED = ("arguments", "one_variant", "published")
SCRIPTS = sorted(file.stem for file in FOLDER.glob("*.py") if file.stem not in SHARED)


@pytest.mark.parametrize("script", SCRIPTS)
def test_a_script_has_a_help_and_refuses_unknown_arguments(
    script: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In this process: three that only start would take five seconds for each script."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(FOLDER)
    for shared in SHARED:
        monkeypatch.delitem(sys.modules, shared, raising=False)
    path = str(FOLDER / f"{script}.py")
    for arguments, code in ((["--help"], 0), (["--nothing"], 2), (["a", "b"], 2)):
        monkeypatch.setattr(sys, "argv", [path, *arguments])
        with pytest.raises(SystemExit) as ended:
            runpy.run_path(path, run_name="__main__")
        assert (ended.value.code or 0) == code
        assert ("GRC" in capsys.readouterr().out) == (code == 0)
    assert not list(tmp_path.iterdir())
