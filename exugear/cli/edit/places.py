"""Lines of keys in the text of a gearbox file, and messages placed at the lines that they are about."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Literal

from exugear.gearbox.sections.schema.keys import keys

_PART = r"""(?:[A-Za-z0-9_-]+|"[^"\n]*"|'[^'\n]*')"""
_DOTTED = rf"{_PART}(?:\s*\.\s*{_PART})*"
_HEADER = re.compile(rf"\s*(\[\[?)\s*({_DOTTED})\s*\]")
_PAIR = re.compile(rf"\s*({_DOTTED})\s*=")
_QUOTED = re.compile(r""""(?:[^"\\\n]|\\.)*"|'[^'\n]*'|\#[^\n]*""")
_LONG_QUOTES = ('"""', "'''")


def places(text: str) -> dict[str, int]:
    r"""Return the line of each table and key, counted from 1; the tables of an array have their number as a part.

    Keys inside an inline table are found at the line of the key that holds it. The text may be invalid TOML.

    Examples
    --------
    >>> places('name = "x"\n[gears.sun]\nteeth = 20\n[[forces.list]]\nz = [\n  1,\n]\n')
    {'name': 1, 'gears.sun': 2, 'gears.sun.teeth': 3, 'forces.list.0': 4, 'forces.list.0.z': 5}
    """
    found: dict[str, int] = {}
    counts: dict[str, int] = {}
    table: list[str] = []
    open_brackets = 0
    quotes = ""
    for number, line in enumerate(text.split("\n"), start=1):
        if quotes:
            if quotes in line:
                quotes = ""
            continue
        if open_brackets <= 0:
            header = _HEADER.match(line)
            pair = None if header else _PAIR.match(line)
            if header:
                table = _parts(header[2])
                if header[1] == "[[":
                    name = ".".join(table)
                    table.append(str(counts.get(name, 0)))
                    counts[name] = counts.get(name, 0) + 1
                found.setdefault(".".join(table), number)
                continue
            if pair:
                found.setdefault(".".join([*table, *_parts(pair[1])]), number)
            open_brackets = 0
        quotes = next((sign for sign in _LONG_QUOTES if line.count(sign) % 2), "")
        bare = _QUOTED.sub("", line)
        open_brackets += sum(bare.count(sign) for sign in "[{") - sum(bare.count(sign) for sign in "]}")
    return found


def _parts(dotted: str) -> list[str]:
    return [part.strip("\"'") for part in re.findall(_PART, dotted)]


def nearest_place(key: str, known: Mapping[str, int]) -> int | None:
    """Return the line of a key, or of the innermost table around it that the text has; None if it has none of them.

    Examples
    --------
    >>> nearest_place("gears.sun.teeth", {"gears.sun": 2}), nearest_place("damping.x", {"gears.sun": 2})
    (2, None)
    """
    parts = key.split(".")
    for count in range(len(parts), 0, -1):
        if (line := known.get(".".join(parts[:count]))) is not None:
            return line
    return None


@dataclass(frozen=True)
class Remark:
    """Error or warning about a gearbox file, at its line, with a correction if there is only one."""

    text: str
    """Key, value and remedy."""
    kind: Literal["error", "warning"]
    line: int | None = None
    """Counted from 1; None for the whole file."""
    old: str = ""
    """Text of the line that the correction replaces."""
    new: str = ""
    """Text that replaces it; without `old` a line to insert below. Empty if there is no correction."""


_AT_LINE = re.compile(r"\(at line (\d+), column \d+\)")
_KEY_FIRST = re.compile(r"([A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)*)(?= = |: |:$)")
_ANY_KEY = re.compile(r"[A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)+")
_MEANT = re.compile(r"did you mean '([^']+)'\?")
_VALUE = re.compile(r" = '([^']*)': (?:no such [a-z ]+; )?did you mean")
_RENAMED = re.compile(r"was renamed to (?:[\w.]*\.)?(\w+);")


_places_of_steps = lru_cache(maxsize=2)(places)
"""Places of a text whose messages come step by step."""


def placed(texts: Iterable[str], kind: Literal["error", "warning"], source: str, text: str) -> list[Remark]:
    """Return messages of a reader about the file `source` at their lines in its text.

    Examples
    --------
    >>> placed(["x.toml: gears.sun.teth: unknown key; did you mean 'teeth'?"], "error", "x.toml", "gears.sun.teth = 2")
    [Remark(text="gears.sun.teth: unknown key; did you mean 'teeth'?", kind='error', line=1, old='teth', new='teeth')]
    """
    known = _places_of_steps(text)
    return [_placed(message.removeprefix(f"{source}: "), kind, text, known) for message in texts]


def _placed(message: str, kind: Literal["error", "warning"], text: str, known: Mapping[str, int]) -> Remark:
    if at := _AT_LINE.search(message):
        return Remark(message, kind, int(at[1]))
    if "(at end of document)" in message:
        return Remark(message, kind, text.count("\n") + 1)
    first = _KEY_FIRST.match(message)
    key = first[1] if first else ""
    line = nearest_place(key, known) if key else None
    if line is None:
        named = (found[0] for found in _ANY_KEY.finditer(message))
        key, line = next(((name, known[name]) for name in named if name in known), (key, None))
    if line is None:
        return Remark(message, kind)
    return Remark(message, kind, line, *_correction(message, key, known))


def _correction(message: str, key: str, known: Mapping[str, int]) -> tuple[str, str]:
    """Return old and new text of the only possible correction of an error; empty texts if there is none."""
    if ": this key is missing" in message:
        table, _, name = key.rpartition(".")
        of_kind = re.sub(r"^(\w+)\.\w+", r"\1.NAME", table)
        keys_of_kind = (one for one in schema_for_completion() if one["table"] == of_kind)
        example = next((one["example"] for one in keys_of_kind if one["name"] == name), "")
        # An inline table has no line below its header.
        return ("", f"{name} = {example}") if example and table in known else ("", "")
    meant = _MEANT.search(message)
    if meant and (value := _VALUE.search(message)):
        return f'"{value[1]}"', f'"{meant[1]}"'
    found = meant or _RENAMED.search(message)
    if found and (not meant or "unknown key" in message):
        return key.rpartition(".")[2], found[1]
    return "", ""


@cache
def schema_for_completion() -> tuple[dict[str, str], ...]:
    """Return table, name, description, meaning and example of each key of a gearbox file.

    The example is in TOML notation; it is empty for tables.
    """
    listed = []
    for key in keys():
        default = key.default if key.default == "required" else f"default {key.default}"
        simple = isinstance(key.example, bool | int | float | str | list)
        listed.append(
            {
                "table": key.table,
                "name": key.name,
                "about": "; ".join(filter(None, [key.kind, key.unit, key.range, default])),
                "meaning": " ".join(key.meaning.split()),
                "example": json.dumps(key.example) if simple else "",
            }
        )
    return tuple(listed)
