"""The how-to guides run as pasted: their shell and Python blocks, one page after the other, in one folder.

A block that runs begins with ```` ```sh ```` or ```` ```python ````. Indented blocks and blocks of other languages are
shown only. A comment ``<!-- expect: TEXT -->`` after a block names a text that its output contains, and one
``<!-- exit: 1 -->`` the exit code; ``<!-- picture: PATH -->`` names a picture that the block writes, which
``docs/tools/howto_pictures.py`` keeps for the page. Pages that take longer than some seconds run with the validation
tests.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
GUIDES = ROOT / "docs" / "howto"
START = "exugear new my/gearbox.toml"
"""First command of the tutorial, which makes the file that all guides start from."""
BLOCK = re.compile(
    r"^( *)```(sh|python)\n(.*?)^\1```$((?:\s*<!-- (?:expect|exit|picture): .*? -->)*)", re.MULTILINE | re.DOTALL
)
QUICK = ("editor_in_the_browser", "untrusted_files")
LONG = (
    "damping",
    "drive_with_duty_cycle",
    "external_housing",
    "flanks_and_deviations",
    "flexible_bodies",
    "lubricant",
    "machine_ripple",
    "measured_run_up",
    "operating_range",
    "reference_analysis",
    "resume_a_run",
    "solids_in_python",
    "studies",
    "te_tables_over_load",
    "torque_series",
    "unbalance",
)
NEEDS_GMSH = ("flexible_bodies", "solids_in_python")


def pages() -> list[str]:
    """Names of the guides in the order of the table of contents."""
    contents = (GUIDES / "index.md").read_text(encoding="utf-8")
    return re.findall(r"^([a-z_]+)$", contents[contents.index("```{toctree}") :], re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """Block of a page that runs."""

    language: str
    text: str
    expected: str
    code: int
    picture: str

    def pictures(self, place: Path) -> list[Path]:
        """Pictures that the block has written."""
        return sorted(place.glob(self.picture)) if self.picture else []


def blocks(page: str) -> list[Block]:
    found = []
    for indent, language, text, notes in BLOCK.findall((GUIDES / f"{page}.md").read_text(encoding="utf-8")):
        stated = {name: re.findall(rf"<!-- {name}: (.*?) -->", notes) for name in ("expect", "exit", "picture")}
        block = re.sub(rf"^{indent}", "", text, flags=re.MULTILINE)
        code = int("".join(stated["exit"]) or 0)
        found.append(Block(language, block, "".join(stated["expect"]), code, "".join(stated["picture"])))
    return found


def marked(page: str) -> pytest.param:
    marks = [] if page in QUICK else [pytest.mark.long if page in LONG else pytest.mark.validation]
    return pytest.param(page, marks=marks)


def prepared(place: Path) -> Path:
    """Folder with the tutorial's file, and with `exugear` and `python` as commands of this interpreter."""
    commands = place / "bin"
    commands.mkdir()
    called = "import sys; sys.argv[0] = 'exugear'; from exugear.cli.app import main; main()"
    for name, options in {"exugear": f' -c "{called}"', "python": ""}.items():
        script = commands / name
        script.write_text(f'#!/bin/sh\nexec "{sys.executable}"{options} "$@"\n', encoding="utf-8")
        script.chmod(0o755)
    run(place, "sh", START)
    return place


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return prepared(tmp_path_factory.mktemp("howto"))


def run(place: Path, language: str, text: str) -> subprocess.CompletedProcess[str]:
    """Run a block as pasted into a shell, or saved and run by Python; a shell stops at the first failure."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PATH": f"{place / 'bin'}{os.pathsep}{os.environ['PATH']}"}
    call = ["sh", "-e", "-c", text] if language == "sh" else [sys.executable, "-c", text]
    return subprocess.run(call, cwd=place, env=environment, capture_output=True, text=True, check=False, timeout=900)


def test_every_guide_is_in_the_contents_and_most_of_them_run() -> None:
    assert sorted(pages()) == sorted(file.stem for file in GUIDES.glob("*.md") if file.stem != "index")
    assert sum(bool(blocks(page)) for page in pages()) >= len(pages()) - 3
    assert set(QUICK) | set(LONG) | set(NEEDS_GMSH) <= set(pages())


def test_the_tutorial_makes_the_file_that_the_guides_start_from() -> None:
    assert START in (ROOT / "docs" / "getting_started" / "own_gearbox.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", [marked(page) for page in pages() if blocks(page)])
def test_a_guide_runs_as_pasted(page: str, folder: Path) -> None:
    if page in NEEDS_GMSH and find_spec("gmsh") is None:
        pytest.skip("gmsh is not installed")
    for block in blocks(page):
        outcome = run(folder, block.language, block.text)
        printed = f"{outcome.stdout}\n{outcome.stderr}"
        assert outcome.returncode == block.code, f"{block.text}\n{printed}"
        assert block.expected in printed, f"{block.text}\n{printed}"
        assert not block.picture or block.pictures(folder) or "no pictures" in printed, block.picture


@pytest.mark.parametrize("page", pages())
def test_a_guide_has_a_picture_and_says_what_to_vary_and_by_how_much(page: str) -> None:
    text = (GUIDES / f"{page}.md").read_text(encoding="utf-8")
    pictures = re.findall(r"!\[.+\]\((.+)\)", text)
    assert pictures and all((GUIDES / picture).exists() for picture in pictures)
    assert re.search("What to vary, and by how much|sensible|How fine", text)
