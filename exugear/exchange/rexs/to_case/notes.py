"""Values of the gearbox file with their sources, how they are written, and what an import notes beside them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from exugear.exchange.rexs.faults import Faults, RexsError

ASSUMED = "A"
DERIVED = "D"
COMMENT_COLUMN = 44
"""Column in which comments begin, where the value is not longer."""


@dataclass(frozen=True)
class Entry:
    """A value of the gearbox file, and where it comes from."""

    value: Any
    """As TOML has it."""
    source: str = ""
    """Component and attribute that give it; for one that is derived or assumed how."""
    kind: str = ""
    """Empty as read, `DERIVED` or `ASSUMED`."""

    @property
    def comment(self) -> str:
        """Comment after the value."""
        if self.kind:
            return f"{self.kind}   {self.source}"
        return self.source


def read(value: Any, source: str) -> Entry:
    """Value that stands in the REXS file."""
    return Entry(value, source)


def derived(value: Any, source: str) -> Entry:
    """Value that follows from what stands there."""
    return Entry(value, source, DERIVED)


def assumed(value: Any, source: str) -> Entry:
    """Value that the file does not give."""
    return Entry(value, source, ASSUMED)


@dataclass(frozen=True)
class Rules:
    """Which of two statements counts where a file contradicts itself."""

    shifts: Literal["file", "centre-distance"] = "file"
    """Profile shifts that do not fit to the centre distance: refused, or replaced by those that it asks for."""
    distances: Literal["agreeing", "positions", "file"] = "agreeing"
    """Centre distances unlike the positions of the gears: that with which the profile shifts agree, that of the
    positions, or that of ``center_distance``, to which axes are moved."""


@dataclass
class Notes:
    """Lines gathered on the way."""

    rules: Rules = Rules()
    faults: Faults = field(default_factory=Faults)
    """Why the file cannot be imported."""
    changed: list[str] = field(default_factory=list)
    """Values of the file that were replaced, and assumptions that matter."""
    checked: list[str] = field(default_factory=list)
    """Comparisons of what the file says twice."""
    ignored: list[str] = field(default_factory=list)
    """What the file holds and the gearbox file does not."""


def tidy(value: float) -> float:
    """Return a number without the last digits, which arithmetic made; never minus zero.

    Examples
    --------
    >>> tidy(16.799999999999997), tidy(-0.0)
    (16.8, 0.0)
    """
    return float(f"{value:.12g}") + 0.0


def needed(value: float | None, part: object, key: str) -> float:
    """Return the value, or say that it is missing.

    Raises
    ------
    RexsError
        There is none.
    """
    if value is None:
        raise RexsError(f"{part}: {key} is missing")
    return value


def within(value: float, part: object, key: str, low: float, high: float) -> float:
    """Return the value, or say that no gear can have it.

    Raises
    ------
    RexsError
        It lies outside of low and high.
    """
    if not low <= value <= high:
        raise RexsError(f"{part}: {key} = {value:g} cannot be; expected {low:g} to {high:g}")
    return value


@dataclass
class Block:
    """Table of the gearbox file with its entries and the tables inside it."""

    comment: str = ""
    """After its head: the component that it stands for."""
    entries: dict[str, Entry] = field(default_factory=dict)
    blocks: dict[str, Block] = field(default_factory=dict)
    number: int = 0
    """Of the component; 0 where nobody asks for it."""


def toml_text(head: Sequence[str], top: Mapping[str, Entry], groups: Sequence[tuple[str, Mapping[str, Block]]]) -> str:
    """Gearbox file with comments.

    Parameters
    ----------
    head : lines of comment before everything else
    top : keys outside of tables
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
    if isinstance(entry.value, list) and any(isinstance(one, Mapping) for one in entry.value):
        rows = "".join(f"    {toml_value(one)},\n" for one in entry.value)
        return f"{_with_comment(f'{key} = [', entry.comment)}\n{rows}]"
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
        if value:
            return "true"
        return "false"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {toml_value(entry)}" for key, entry in value.items()) + " }"
    return "[" + ", ".join(toml_value(entry) for entry in value) + "]"
