"""Names that say what they stand for, one step a line: counts over both packages, which may only fall."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
TREES = [
    ast.parse(path.read_text(encoding="utf-8"))
    for package in ("exugear", "fe_ste")
    for path in sorted((ROOT / package).rglob("*.py"))
]
MOST_PAIRS = 400
MOST_CONDITIONAL_EXPRESSIONS = 1095
PREPOSITIONS = (
    *("about", "after", "along", "around", "before", "behind", "beside", "between", "by", "in", "near", "of", "on"),
    *("over", "per", "under"),
)
"""A function with such a first word is no verb and names no result; `from_`, `to_`, `with_`, `at_` are idioms."""
VAGUE = {"own", "one", "found", "told", "said", "place", "places", "whole", "words"}


def nodes(kind: type[ast.AST]) -> Iterator[ast.AST]:
    return (node for tree in TREES for node in ast.walk(tree) if isinstance(node, kind))


def bound_names() -> list[str]:
    """Names that are assigned, looped over or taken as parameters."""
    stored = [node.id for node in nodes(ast.Name) if isinstance(node.ctx, ast.Store)]
    return [*stored, *(node.arg for node in nodes(ast.arg))]


def test_few_names_are_vague():
    names = bound_names()
    assert sum(name in VAGUE for name in names) < 0.032 * len(names)


def test_no_function_begins_with_a_preposition():
    names = [node.name for kind in (ast.FunctionDef, ast.AsyncFunctionDef) for node in nodes(kind)]
    assert not [name for name in names if name.lstrip("_").split("_")[0] in PREPOSITIONS and "_" in name.strip("_")]


def test_values_are_assigned_one_by_one():
    pairs = [
        node
        for node in nodes(ast.Assign)
        if isinstance(node.targets[0], ast.Tuple) and isinstance(node.value, ast.Tuple)
    ]
    assert len(pairs) <= MOST_PAIRS


def test_conditional_expressions_are_few_and_none_stands_in_another():
    found = list(nodes(ast.IfExp))
    assert len(found) <= MOST_CONDITIONAL_EXPRESSIONS
    assert not [
        node for node in found for child in ast.walk(node) if child is not node and isinstance(child, ast.IfExp)
    ]
