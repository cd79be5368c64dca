"""The list of `make release-check`: what it says of this tree, and that it finds what is wrong in a changed copy."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from datetime import datetime
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parent.parent.parent
FILES = [
    "pyproject.toml",
    "CITATION.cff",
    "codemeta.json",
    "CHANGELOG.md",
    "README.md",
    "docs/development",
    "packaging",
    ".github",
    "docs/validation/index.md",
    "benchmarks/results.json",
    "exugear/gearbox/versions.py",
    "fe_ste/tools/versions.py",
]


@pytest.fixture(scope="module")
def checks() -> ModuleType:
    spec = importlib.util.spec_from_file_location("release_check", ROOT / "packaging" / "release_check.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["release_check"] = module  # data classes look for their module there
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A copy of the files that are checked, which a test changes."""
    for name in FILES:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, tmp_path / name)
        else:
            shutil.copy(ROOT / name, tmp_path / name)
    return tmp_path


def changed(tree: Path, name: str, old: str, new: str) -> None:
    text = (tree / name).read_text(encoding="utf-8")
    assert old in text
    (tree / name).write_text(text.replace(old, new, 1), encoding="utf-8")


@pytest.mark.parametrize(
    "check", ["same_version", "changelog", "known_versions", "pythons", "bounds", "workflows", "recipes"]
)
def test_what_needs_no_day_of_release_passes_always(checks: ModuleType, check: str) -> None:
    result = getattr(checks, check)(ROOT)
    assert result.state in ("pass", "note"), result.details


@pytest.mark.parametrize(
    ("check", "name", "old", "new", "said"),
    [
        ("same_version", "CITATION.cff", "\nversion: 0", "\nversion: 9", "CITATION.cff: version 9"),
        ("same_version", "packaging/conda/recipe.yaml", 'version: "0', 'version: "9', "recipe.yaml: version 9"),
        ("same_version", "codemeta.json", '"dateModified": "2', '"dateModified": "1', "codemeta.json: date 1"),
        ("same_version", "README.md", "exugear-0", "exugear-9", "README.md: names no wheel"),
        ("known_versions", "README.md", "# exugear", "# exugear 9.9.9", "README.md:1: 9.9.9"),
        ("pythons", "codemeta.json", "Python 3.11", "Python 3.10", "expected 3.11"),
        ("pythons", ".github/workflows/tests.yml", '"3.13"', '"3.15"', "tests.yml: Python 3.15"),
        ("bounds", "pyproject.toml", "numpy>=2.0", "numpy>=99", "numpy >=99 [always]"),
        ("workflows", ".github/workflows/tests.yml", "jobs:", "work:", "has no jobs"),
        ("workflows", ".github/workflows/tests.yml", "jobs:", "jobs: [", "tests.yml: "),
        ("recipes", "packaging/conda/recipe.yaml", "about:", "around:", "has no about"),
    ],
)
def test_a_change_that_contradicts_another_file_fails(
    checks: ModuleType, tree: Path, check: str, name: str, old: str, new: str, said: str
) -> None:
    changed(tree, name, old, new)
    result = getattr(checks, check)(tree)
    assert result.state == "FAIL"
    assert any(said in line for line in result.details), result.details


def test_a_version_without_a_dated_section_fails(checks: ModuleType, tree: Path) -> None:
    changed(tree, "pyproject.toml", 'version = "0', 'version = "9')
    assert checks.changelog(tree).state == "FAIL"


@pytest.mark.skipif(sys.platform == "win32", reason="commands of a shell")
def test_the_commands_of_the_page_on_releases_set_the_version_everywhere(checks: ModuleType, tree: Path) -> None:
    page = (tree / "docs" / "development" / "releasing.md").read_text(encoding="utf-8")
    commands = [line.strip() for line in page.splitlines() if line.startswith(("    VERSION=", "    sed -i "))]
    assert len(commands) > 6
    changed(tree, "CHANGELOG.md", "## [Unreleased]\n", "## [Unreleased]\n\n- An entry of the next version.\n")
    subprocess.run(["sh", "-e"], input="\n".join(commands), cwd=tree, text=True, check=True)
    result = checks.same_version(tree)
    assert result.state == "pass", result.details
    assert result.text.startswith("0.5.0 of 20")
    told = checks.changelog(tree)
    assert told.state == "pass", "all entries of Unreleased stand under the version"
    for check in (checks.known_versions, checks.recipes, checks.pythons):
        assert check(tree).state == "pass"


def test_what_the_owner_fills_in_is_listed_with_its_line_and_refuses_nothing(checks: ModuleType, tree: Path) -> None:
    result = checks.placeholders(tree)
    assert result.state == "note"
    line = (ROOT / "CITATION.cff").read_text(encoding="utf-8").splitlines().index("  - name: the exugear authors")
    assert f"CITATION.cff:{line + 1}: the exugear authors" in result.details


def test_results_older_than_a_method_are_found_by_the_history_of_its_version(checks: ModuleType, tree: Path) -> None:
    """The number of a method is raised in a commit of 2020: results of 2019 are old, those of 2021 are not."""
    date = "2020-05-01T12:00:00+0000"
    settings = {"GIT_COMMITTER_DATE": date, "GIT_AUTHOR_DATE": date, "HOME": str(tree), "PATH": "/usr/bin:/bin"}
    identity = ["-c", "user.name=n", "-c", "user.email=e"]
    for command in (["init", "-q"], ["add", "."], [*identity, "commit", "-q", "-m", "All"]):
        subprocess.run(["git", *command], cwd=tree, env=settings, check=True)
    dates = checks.version_dates(tree)
    assert {"RUN", "STEADY", "TABLE"} <= set(dates)
    assert set(dates.values()) == {datetime.fromisoformat("2020-05-01T12:00:00+00:00")}
    assert checks.measured_before("2019-05-01T12:00:00+00:00", dates, ["RUN"]) == ["RUN"]
    assert checks.measured_before("2021-05-01T12:00:00+00:00", dates, ["RUN"]) == []
    assert checks.benchmarks(tree).state == checks.trust(tree).state == "pass"
    found = checks.sections(tree)
    assert found["0.1.0"][0] == "2026-11-22"


def test_outside_of_a_checkout_dates_are_not_tried(checks: ModuleType, tree: Path) -> None:
    assert checks.benchmarks(tree).state == checks.trust(tree).state == checks.tree(tree).state == "not tried"


@pytest.mark.validation
def test_sdist_and_wheel_hold_all_that_the_repository_has(checks: ModuleType, tmp_path: Path) -> None:
    result = checks.distributions(ROOT, tmp_path / "dist")
    assert result.state == "pass", result.details
