"""Each promise of docs/reliability.md is held by a test that is there, where the page says it runs."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
NAMED = re.findall(r"`(test_\w+\.py)::(test_\w+)`( \(v\))?", (ROOT / "docs" / "reliability.md").read_text("utf-8"))


def test_the_page_names_tests():
    assert len(NAMED) > 50


@pytest.mark.parametrize(("file", "name", "slow"), NAMED)
def test_a_promise_is_held_by_a_test(file: str, name: str, slow: str):
    (path,) = (ROOT / "tests").rglob(file)
    body = ast.parse(path.read_text("utf-8")).body
    functions = {node.name: node for node in body if isinstance(node, ast.FunctionDef)}
    assert name in functions
    assert ("validation" in " ".join(map(ast.unparse, functions[name].decorator_list))) == bool(slow)
