"""Files for citation, contribution and public services: readable, and of this version."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest
import yaml

import exugear

ROOT = Path(__file__).parent.parent.parent
PLACEHOLDERS = "OWNER/exugear", "MAINTAINER@EXAMPLE.ORG", "AUTHOR NAME", "DISCLOSURE BY OWNER"
"""What the owner of a public repository fills in; `exugear` is not published before."""


def test_the_citation_is_of_this_version() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    metadata = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
    assert citation["version"] == metadata["version"] == exugear.__version__
    assert {"cff-version", "message", "title", "authors", "license"} <= set(citation)
    date = re.search(rf"^## \[{re.escape(exugear.__version__)}\] - (\S+)$", _text("CHANGELOG.md"), re.MULTILINE)
    assert date is not None
    assert citation["date-released"] == metadata["dateModified"] == date[1]


@pytest.mark.parametrize(
    "file", sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / ".github").rglob("*.yml"))
)
def test_files_of_public_services_can_be_read(file: str) -> None:
    content = yaml.safe_load(_text(file))
    needed = {"ISSUE_TEMPLATE": {"name", "description", "body"}, "workflows": {"name", "jobs"}, ".github": {"updates"}}
    assert needed[Path(file).parent.name] <= set(content)
    if "workflows" in file or "dependabot" in file:
        assert _text(file).startswith("# Not run yet"), "say so until it has run"


def test_hooks_before_a_commit_are_the_checks_of_make() -> None:
    hooks = yaml.safe_load(_text(".pre-commit-config.yaml"))["repos"][0]["hooks"]
    recipe = re.search(r"^check:.*?\n\n", _text("Makefile"), re.MULTILINE | re.DOTALL)
    assert recipe is not None
    commands = re.findall(r"\$\(RUN\)/(.+)", recipe[0])
    for hook in hooks:
        program = hook["entry"].removeprefix(".venv/bin/")
        assert any(command.startswith(program) for command in commands), program


def test_links_of_the_files_for_people_lead_to_files() -> None:
    for name in ("CONTRIBUTING.md", "SECURITY.md", "ROADMAP.md", "CODE_OF_CONDUCT.md"):
        for target in re.findall(r"\]\(((?!https?:)[^)#]+)", _text(name)):
            assert (ROOT / target).exists(), (name, target)


def test_placeholders_are_where_a_release_looks_for_them() -> None:
    """`git grep` finds all of them; a release fills them in."""
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False).stdout.split()
    if not tracked:
        pytest.skip("this is no checkout")
    known = {"CITATION.cff", "codemeta.json", "CONTRIBUTING.md", "CODE_OF_CONDUCT.md", "SECURITY.md"}
    known |= {"docs/development/releasing.md", "paper/paper.md", "packaging/conda/recipe.yaml"}
    texts = [name for name in tracked if name.endswith((".md", ".cff", ".json", ".yml", ".yaml", ".toml"))]
    found = {name for name in texts if any(mark in _text(name) for mark in PLACEHOLDERS)}
    assert found == known & set(tracked)


def _text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")
