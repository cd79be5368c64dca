"""Each promise of docs/validation/promises.toml is held by tests that exist, at least one of them in each change."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "validation" / "promises.toml").read_text("utf-8")
NAME = re.compile(r"`(test_\w+\.py)::(test_\w+)`( \((?:v|long)\))?")
NAMED = NAME.findall(PAGE)
PROMISES = [line for line in PAGE.splitlines() if NAME.search(line)]


def test_the_page_names_tests():
    assert len(NAMED) > 50


@pytest.mark.parametrize(("file", "name", "runs"), NAMED)
def test_a_promise_is_held_by_a_test(file: str, name: str, runs: str):
    (path,) = (ROOT / "tests").rglob(file)
    body = ast.parse(path.read_text("utf-8")).body
    functions = {node.name: node for node in body if isinstance(node, ast.FunctionDef)}
    assert name in functions
    marks = {ast.unparse(decorator) for decorator in functions[name].decorator_list}
    where = " (long)" if "pytest.mark.long" in marks else " (v)" if "pytest.mark.validation" in marks else ""
    assert runs == where


@pytest.mark.parametrize("promise", PROMISES)
def test_a_promise_is_held_in_each_change(promise: str):
    assert any(runs != " (long)" for _, _, runs in NAME.findall(promise))
