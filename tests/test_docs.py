"""Sources of the site: public names, examples, links, claims, headings. `make docs` builds it and checks the rest."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"


@pytest.mark.parametrize("package", ["exugear", "fe_ste"])
def test_every_public_name_stands_on_the_page_of_the_programming_interface(package):
    listed = set(re.findall(rf"^   ~{package}\.(?:\w+\.)*(\w+)$", (DOCS / "reference" / "python.md").read_text(), re.M))
    assert listed == set(importlib.import_module(package).__all__) - {"__version__"}


def test_the_gallery_shows_every_example():
    (order,) = (
        ast.literal_eval(statement.value)
        for statement in ast.parse((DOCS / "tools" / "gallery.py").read_text(encoding="utf-8")).body
        if isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == "ORDER"
    )
    assert sorted(order) == sorted(file.stem for file in (ROOT / "examples").glob("*.py"))


def test_every_example_is_a_question():
    for example in (ROOT / "examples").glob("*.py"):
        title = example.read_text(encoding="utf-8").splitlines()[1]
        assert title.endswith("?"), example.name


@pytest.mark.parametrize("example", sorted((ROOT / "examples").glob("*.py")), ids=lambda path: path.stem)
def test_every_example_saves_its_diagrams_and_says_where(example):
    text = example.read_text(encoding="utf-8")
    assert ".png" in text
    assert re.search(r"print\(f?\"(diagrams?|picture) in ", text)


@pytest.mark.validation
def test_an_example_saves_its_diagram_where_it_says(tmp_path):
    example = ROOT / "examples" / "bearing_stiffness.py"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    run = [sys.executable, str(example)]
    outcome = subprocess.run(run, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    assert (tmp_path / re.findall(r"diagram in (.*)", outcome.stdout)[0]).read_bytes().startswith(b"\x89PNG")


def test_the_readme_links_to_files_that_are_there():
    links = re.findall(r"\]\(((?!https?:)[^)#]+)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert len(links) > 10
    assert [link for link in links if not (ROOT / link).exists()] == []


CLAIMS = tomllib.loads((DOCS / "validation" / "claims.toml").read_text(encoding="utf-8"))
PROMISES = tomllib.loads((DOCS / "validation" / "promises.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("kind", "tables"), [("claims", CLAIMS), ("promises", PROMISES)])
def test_each_table_of_claims_is_on_one_page(kind, tables):
    pages = [path for folder in ("validation", "case_study") for path in (DOCS / folder).glob("*.md")]
    texts = "\n".join(path.read_text(encoding="utf-8") for path in pages)
    assert sorted(re.findall(rf"^<!-- {kind}: (\w+) -->$", texts, re.M)) == sorted(tables)


@pytest.mark.parametrize("name", CLAIMS)
def test_claims_have_five_entries_and_name_tests_that_exist(name):
    tests = {path.name for path in (ROOT / "tests").rglob("test_*.py")}
    for row in CLAIMS[name]["rows"]:
        named = re.findall(r"`(test_\w+\.py)`", row[-1])
        assert len(row) == 5 and row[0] and named and set(named) <= tests, row


HEADING = re.compile(r"^#+ (What|Where|How(?!-to| far can I trust it)|Why|When|Which (?!model when))\b", re.M)


def claims_tables():
    spec = importlib.util.spec_from_file_location("claims_tables", DOCS / "tools" / "claims_tables.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_many_claims_are_compared_with_sources_from_outside_and_each_is_counted_once():
    pytest.importorskip("sphinx")
    tool = claims_tables()
    found = tool.from_outside()
    rows = [tuple(row) for kind in found.values() for row in kind]
    assert len(rows) == len(set(rows)) >= 59  # 728 designations, 16 bearings and 19 trains are one claim each
    assert min(map(len, found.values())) >= 7
    assert f"| all | {len(rows)} |" in tool.sources_table()
    assert tool.SOURCES in (DOCS / "validation" / "trust.md").read_text(encoding="utf-8")


def pages():
    """Pages of the site that are written by hand."""
    made = {"elsewhere", "gallery", "keys", "api"}
    return [path for path in DOCS.rglob("*.md") if not made & set(path.parts) and path.stem != "command_line"]


@pytest.mark.parametrize("page", pages(), ids=lambda path: path.relative_to(DOCS).as_posix())
def test_headings_are_noun_phrases_and_pages_have_a_lower_case_name(page):
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    assert not HEADING.search(text)
    assert re.fullmatch(r"[a-z0-9_]+", page.stem)


def test_diagrams_are_those_that_the_tool_draws():
    names = re.findall(
        r'^            "(\w+)": \w+,$', (DOCS / "tools" / "diagrams.py").read_text(encoding="utf-8"), re.M
    )
    assert sorted(names) == sorted(path.stem for path in (DOCS / "images").glob("*.svg"))
