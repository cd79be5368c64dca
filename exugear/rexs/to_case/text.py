"""The gearbox file as text: tables with their comments, each value with its source."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from exugear.rexs.to_case.notes import Block, Entry

COMMENT_COLUMN = 44
"""Column in which comments begin, where the value is not longer."""


def toml_text(head: Sequence[str], top: Mapping[str, Entry], groups: Sequence[tuple[str, Mapping[str, Block]]]) -> str:
    """Gearbox file with comments.

    Parameters
    ----------
    head : sequence of str
        Lines of comment before everything else.
    top : mapping of str to Entry
        Keys outside of tables.
    groups : sequence of (str, mapping of str to Block)
        Heading and tables, by their dotted name.
    """
    lines = [f"# {line}".rstrip() for line in head]
    lines += ["", *(_line(key, entry) for key, entry in top.items())]
    for heading, blocks in groups:
        if blocks:
            lines += ["", *([f"# {'-' * 20} {heading}"] if heading else [])]
        for name, block in blocks.items():
            lines += _table(name, block)
    return "\n".join(lines) + "\n"


def _table(name: str, block: Block) -> Iterator[str]:
    yield ""
    yield _with_comment(f"[{name}]", block.comment)
    yield from (_line(key, entry) for key, entry in block.entries.items())
    for key, inner in block.blocks.items():
        yield from list(_table(f"{name}.{key}", inner))[1:]


def _line(key: str, entry: Entry) -> str:
    return _with_comment(f"{key} = {toml_value(entry.value)}", entry.comment)


def _with_comment(text: str, comment: str) -> str:
    return f"{text:<{COMMENT_COLUMN - 1}} # {comment.strip()}" if comment.strip() else text


def toml_value(value: Any) -> str:
    """Write a value as TOML.

    Examples
    --------
    >>> toml_value({"sun": 1.0, "names": ["a", True]})
    '{ sun = 1.0, names = ["a", true] }'
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {toml_value(entry)}" for key, entry in value.items()) + " }"
    return "[" + ", ".join(toml_value(entry) for entry in value) + "]"
