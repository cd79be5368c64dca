"""The check of wording finds phrases to avoid in each kind of text, and skips code."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SOURCES = ("docs/tools/check_wording.py", "docs/phrases.toml")
MODULE = '''"""A module that tells everything."""
# A comment about a verb.
MESSAGE = f"{1} stands beside it"  # excused: wording: ok
OTHER = f"{1} stands alone"
"""The greatest value."""
'''


@pytest.fixture
def project(tmp_path):
    """A small project with the check in it and one phrase in each kind of text."""
    for source in SOURCES:
        target = tmp_path / source
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text((ROOT / source).read_text(encoding="utf-8"), encoding="utf-8")
    for package in ("exugear/gearbox/templates", "exugear/report/web/scripts", "fe_ste/tools"):
        (tmp_path / package).mkdir(parents=True)
    (tmp_path / "README.md").write_text("It tells `what is told`.\n\n```\ntold\n```\n\n- told\n", encoding="utf-8")
    (tmp_path / "fe_ste/tools/one.py").write_text(MODULE, encoding="utf-8")
    (tmp_path / "exugear/gearbox/templates/my.toml").write_text('name = "a" # told\n', encoding="utf-8")
    (tmp_path / "exugear/report/web/scripts/page.js").write_text('label = "how loud it is";\n', encoding="utf-8")
    (tmp_path / "Makefile").write_text("help:\n\t@echo the greatest\n", encoding="utf-8")
    (tmp_path / "docs/phrases_budget.toml").write_text("", encoding="utf-8")
    return tmp_path


def check(project, *options):
    script = project / "docs" / "tools" / "check_wording.py"
    return subprocess.run([sys.executable, script, *options], capture_output=True, text=True, check=False)


FOUND = {
    "api fe_ste/tools": 2,
    "code fe_ste/tools": 1,
    "docs README.md": 2,
    "docs exugear/gearbox": 1,
    "ui Makefile": 1,
    "ui exugear/report": 1,
    "ui fe_ste/tools": 1,
}


def test_phrases_are_found_in_every_kind_of_text_and_not_in_code(project):
    answer = check(project)
    assert answer.returncode == 1
    found = dict(line.split(" phrases")[0].rsplit(": ", 1) for line in answer.stderr.splitlines())
    assert {area: int(count) for area, count in found.items()} == FOUND


def test_the_budget_may_only_fall(project):
    budget = project / "docs" / "phrases_budget.toml"
    budget.write_text("".join(f'"{area}" = {count + 1}\n' for area, count in FOUND.items()), encoding="utf-8")
    assert check(project, "--lower").returncode == 0
    lowered = budget.read_text(encoding="utf-8")
    assert lowered == "".join(f'"{area}" = {count}\n' for area, count in sorted(FOUND.items()))
    (project / "README.md").write_text("told, told, told", encoding="utf-8")
    assert check(project, "--lower").returncode == 1
    assert budget.read_text(encoding="utf-8") == lowered
