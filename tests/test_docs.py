"""The site's sources name what is there: public names, examples, pages. `make docs` builds it and checks the rest."""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"


@pytest.mark.parametrize("package", ["exugear", "fe_ste"])
def test_every_public_name_stands_on_the_page_of_the_programming_interface(package):
    listed = set(re.findall(rf"^   ~{package}\.(?:\w+\.)*(\w+)$", (DOCS / "reference" / "api.md").read_text(), re.M))
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


def test_the_readme_links_to_files_that_are_there():
    links = re.findall(r"\]\(((?!https?:)[^)#]+)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert len(links) > 10
    assert [link for link in links if not (ROOT / link).exists()] == []
