"""Journals of finished points: a line for each, keyed by the hash of its input, whole or not there at all.

Every process writes a journal of its own, so that none waits for another and any number can work in one folder. A line
is added by one write and carries a checksum: one that a kill cut short is no point. Journals of one study can be
copied together.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import platform
import re
import secrets
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from fe_ste.tools.files import FileError, open_regular, write_all

FOLDER = "points"
INFINITE = "infinite"
"""In place of a number that has no end, which JSON has not; with a sign where it is below all others."""
_END = ".jsonl"
_DIGITS = 16
"""Digits of a line's checksum."""


@dataclass(frozen=True)
class Record:
    """What is kept of a point."""

    point: str
    """Hash of its input."""
    values: Mapping[str, Any] = field(default_factory=dict)
    """Figures by name: a number, or numbers by name; None for one that is none, `INFINITE` for one without end."""
    error: str = ""
    """Why it failed; empty if it did not."""
    doubts: list[str] = field(default_factory=list)
    """What speaks against trusting it."""
    seconds: float = 0.0
    """Wall time that it took."""
    memory: float = 0.0
    """Peak of the memory of its process so far, bytes."""

    def line(self) -> str:
        """Return it as a line of a journal."""
        text = json.dumps(asdict(self), allow_nan=False)
        return f'{{"checksum": "{_checksum(text)}", "record": {text}}}\n'


def _checksum(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8")).hexdigest()[:_DIGITS]


_POINT = re.compile(r'"record": \{"point": "([^"]*)"')
"""Where a line says of which point it is: those that are not wanted are not read any further."""
_LINE = re.compile(rf'\{{"checksum": "([0-9a-f]{{{_DIGITS}}})", "record": (.*)\}}')


def _record(line: str) -> Record | None:
    """Record of a line; None if it was cut short or changed."""
    match = _LINE.fullmatch(line)
    if match is None or _checksum(match[2]) != match[1]:
        return None
    try:
        return Record(**json.loads(match[2]))
    except (ValueError, TypeError):
        return None


def told_in_json(value: float) -> float | str | None:
    """Write a number as a record has it.

    Examples
    --------
    >>> [told_in_json(value) for value in (2.0, float("inf"), float("nan"))]
    [2.0, 'infinite', None]
    """
    if math.isnan(value):
        return None
    if math.isfinite(value):
        return value
    if value > 0.0:
        return INFINITE
    return f"-{INFINITE}"


def number_of(value: Any) -> float:
    """Read a number that a record tells.

    Examples
    --------
    >>> [number_of(value) for value in (2.0, "infinite", "-infinite", None)]
    [2.0, inf, -inf, nan]
    """
    if isinstance(value, str):
        if value.startswith("-"):
            return -math.inf
        return math.inf
    if value is None:
        return math.nan
    return float(value)


class Journal:
    """The journal of this process in a folder, begun with its first line.

    Parameters
    ----------
    folder : of the study
    """

    def __init__(self, folder: Path) -> None:
        host = re.sub(r"[^A-Za-z0-9]", "", platform.node())[:20] or "host"
        self._path = folder / FOLDER / f"{host}-{os.getpid()}-{secrets.token_hex(4)}{_END}"

    def add(self, record: Record) -> None:
        """Add a point; it is there for every process from then on.

        Raises
        ------
        OSError
            The disk is full, say.
        """
        self._path.parent.mkdir(parents=True, exist_ok=True)
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
        with os.fdopen(os.open(self._path, flags, 0o666), "ab", buffering=0) as file:
            write_all(file, record.line().encode("utf-8"))

    def settle(self) -> None:
        """Bring what was added to the disk, so that a power cut does not lose it."""
        if self._path.exists():
            with open(self._path, "rb+") as file:
                os.fsync(file.fileno())


def read_journals(folder: Path, wanted: Collection[str]) -> dict[str, Record]:
    """Finished points of a folder, of those that are wanted; one that did not fail stands before one that did.

    Parameters
    ----------
    folder : of the study
    wanted : hashes
    """
    journals: dict[str, Record] = {}
    for path in sorted((folder / FOLDER).glob(f"*{_END}")):
        try:
            with open_regular(path) as file:
                lines = file.read().decode("utf-8", errors="replace").splitlines()
        except FileError:
            continue  # what is no journal holds no points
        for line in lines:
            match = _POINT.search(line)
            if match is None or match[1] not in wanted:
                continue
            before = journals.get(match[1])
            record = _record(line)
            if record is not None and (before is None or before.error):
                journals[record.point] = record
    return journals
