"""Positions of keys and values in the text of a TOML file, and replacement of numbers with all other text kept."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Generator, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

_SPACE = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_KEY = re.compile(r'[A-Za-z0-9_-]+|"(?:[^"\\]|\\.)*"|\'[^\']*\'')
_STRING = re.compile(r'"""(?:[^\\]|\\.)*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'', re.DOTALL)
_OTHER = re.compile(r"[^,\]}\n#]+")


@dataclass(frozen=True)
class Token:
    """A part of a key, or a value that is no table and no array."""

    path: tuple[str, ...]
    """Names of the tables and of this key, or of the key of the value; items of an array have the path of the array."""
    start: int
    end: int
    """Position in the text, including quotes."""
    kind: Literal["key", "string", "other"]
    """Part of a key, string, or other value (number, date or truth value)."""
    value: str = ""
    """Content of a string."""


def tokens(text: str) -> Iterator[Token]:
    r"""Yield the keys and values of a text that is valid TOML, in their order.

    Examples
    --------
    >>> [(token.kind, token.path, token.start) for token in tokens("[a]\nb.c = 2.5  # two")]
    [('key', ('a',), 1), ('key', ('a', 'b'), 4), ('key', ('a', 'b', 'c'), 6), ('other', ('a', 'b', 'c'), 10)]
    """
    return _Scanner(text).tokens()


def with_numbers(text: str, numbers: Mapping[str, float]) -> str:
    r"""Replace numbers in the text of a TOML file; comments, order and spacing are kept.

    Parameters
    ----------
    numbers : new values by dotted key, such as ``housing.factor``

    Raises
    ------
    ValueError
        The text is not valid TOML, or a key has no single number; the message names key, value and reason.

    Examples
    --------
    >>> with_numbers("[housing]\nfactor = 0.50  # of the seats", {"housing.factor": 0.55})
    '[housing]\nfactor = 0.55  # of the seats'
    """
    try:
        wanted = tomllib.loads(text)
    except RecursionError:
        raise ValueError("not valid TOML: nested too deep") from None
    new = {tuple(key.split(".")): float(value) for key, value in numbers.items()}
    for path, value in new.items():
        *parents, last = path
        table: Any = wanted
        for parent in parents:
            table = table.get(parent) if isinstance(table, dict) else None
        if not isinstance(table, dict) or type(table.get(last)) not in (int, float):
            found = f" = {table[last]!r}" if isinstance(table, dict) and last in table else ""
            raise ValueError(f"{'.'.join(path)}{found}: the file has no single number of this key")
        table[last] = value
    pieces, end = [], 0
    for token in tokens(text):
        if token.kind == "other" and token.path in new:
            pieces += [text[end : token.start], repr(new[token.path])]
            end = token.end
    result = "".join([*pieces, text[end:]])
    # Texts of values tell apart 1, 1.0 and true, and agree for nan.
    if repr(tomllib.loads(result)) != repr(wanted):
        raise ValueError(f"{', '.join(numbers)}: cannot be replaced without changing another value; change it by hand")
    return result


class _Scanner:
    """Finds keys and values in a text that is valid TOML."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.place = 0

    def tokens(self) -> Iterator[Token]:
        table: tuple[str, ...] = ()
        while self._skip() < len(self.text):
            if self.text[self.place] == "[":
                self.place += 1 + self.text.startswith("[[", self.place)
                table = yield from self._key(())
                self.place = self.text.index("]", self.place) + 1
                self.place += self.text.startswith("]", self.place)
            else:
                yield from self._assignment(table)

    def _skip(self) -> int:
        found = _SPACE.match(self.text, self.place)
        assert found is not None
        self.place = found.end()
        return self.place

    def _key(self, table: tuple[str, ...]) -> Generator[Token, None, tuple[str, ...]]:
        path = table
        while True:
            self._skip()
            found = _KEY.match(self.text, self.place)
            assert found is not None
            path = (*path, _content(found[0]) if found[0][0] in "\"'" else found[0])
            yield Token(path, *found.span(), "key")
            self.place = found.end()
            if self.text[self._skip()] != ".":
                return path
            self.place += 1

    def _assignment(self, table: tuple[str, ...]) -> Iterator[Token]:
        path = yield from self._key(table)
        self.place = self.text.index("=", self.place) + 1
        yield from self._value(path)

    def _value(self, path: tuple[str, ...]) -> Iterator[Token]:
        first = self.text[self._skip()]
        if first in "[{":
            self.place += 1
            while self.text[self._skip()] not in "]}":
                if self.text[self.place] == ",":
                    self.place += 1
                elif first == "[":
                    yield from self._value(path)
                else:
                    yield from self._assignment(path)
            self.place += 1
        elif found := _STRING.match(self.text, self.place):
            yield Token(path, *found.span(), "string", _content(found[0]))
            self.place = found.end()
        else:
            found = _OTHER.match(self.text, self.place)
            assert found is not None
            yield Token(path, self.place, self.place + len(found[0].rstrip()), "other")
            self.place = found.end()


def _content(quoted: str) -> str:
    """Return the content of a quoted key or string."""
    return str(tomllib.loads(f"content = {quoted}")["content"])
