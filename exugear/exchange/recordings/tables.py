"""Comma-separated tables with a line of headings: time in the first column, a channel in each of the others.

Units are part of the headings, as in ``left / (m/s2)``, ``left [g]``, ``left (g)`` or ``left_m_per_s2``, or in a second
line of their own. Columns are separated by commas, semicolons or tabs.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exugear.exchange.channels import LoadFileError
from exugear.exchange.recordings.recording import (
    MOST_SAMPLES,
    RecordedChannel,
    Recording,
    RecordingError,
    even_rate,
    places_of,
    recording_of,
)
from exugear.exchange.series_files import first_lines, numbers
from exugear.gearbox.units import unit_of, unit_suffix
from fe_ste.tools.numbers import fortran_number

SEPARATORS = (";", "\t", ",")
_BRACKETED = re.compile(r"^(.*?)\s*/?\s*[\[(]([^\[\]]*?)[\])]\s*$")
_SLASHED = re.compile(r"^(.*?)\s+/\s+(\S+)$")
_HEAD = 50


@dataclass(frozen=True)
class _Headings:
    """Columns of a table, and where its numbers begin."""

    names: tuple[str, ...]
    """Names of columns without units, that of time first."""
    units: tuple[str, ...]
    separator: str
    skipped: int
    """Number of lines above the numbers."""


def read_table(path: Path, wanted: Sequence[str] | None = None) -> Recording:
    """Channels of a comma-separated table: those of wanted names (without units), or all.

    Raises
    ------
    RecordingError
        The file has no headings, no time in its first column, text where numbers are expected, or times with gaps.
    """
    try:
        head = _headings(path)
        names = head.names[1:]
        chosen = places_of(path, names, wanted)
        columns = [0, *(place + 1 for place in chosen)]
        blocks, rows = [], 0
        for block in numbers(path, head.names, head.skipped, head.separator, columns):
            rows += len(block)
            if rows > MOST_SAMPLES:
                raise RecordingError(f"{path}: has more than {MOST_SAMPLES:g} lines; split the file")
            blocks.append(block[:, columns])
    except LoadFileError as error:
        raise RecordingError(f"{error}; correct the line, or export the table again") from None
    values = np.concatenate(blocks)
    second = unit_of(head.units[0] or "s", any_case=True)
    if second is None or second.quantity != "time":
        raise RecordingError(f"{path}: time has the unit {head.units[0]!r}; expected s, ms, min or h")
    time = second.factor * values[:, 0]
    channels = [
        RecordedChannel(names[place], head.units[place + 1], np.ascontiguousarray(values[:, number]))
        for number, place in enumerate(chosen, start=1)
    ]
    return recording_of(path, even_rate(path, time), float(time[0]), channels)


def heading(text: str) -> tuple[str, str]:
    """Split a heading into name and unit; the unit is empty if there is none.

    Examples
    --------
    >>> heading("Acc 3 / (m/s2)"), heading("Acc 3 [g]"), heading("n / rpm"), heading("left_m_per_s2"), heading("Tacho")
    (('Acc 3', 'm/s2'), ('Acc 3', 'g'), ('n', 'rpm'), ('left', 'm/s2'), ('Tacho', ''))
    """
    text = text.strip()
    for pattern in (_BRACKETED, _SLASHED):
        if found := pattern.match(text):
            return found[1].strip(), found[2].strip()
    suffix = unit_suffix(text)
    name = text[: -len(suffix) - 1] if suffix else text
    return name, suffix.replace("_per_", "/").replace("_", " ")


def _headings(path: Path) -> _Headings:
    """Read the headings, and the line of units below them if there is one."""
    lines = first_lines(path, _HEAD)
    place = next((number for number, line in enumerate(lines) if line.strip()), None)
    if place is None:
        raise RecordingError(f"{path}: is empty; expected a line of headings and lines of numbers")
    separator = max(SEPARATORS, key=lines[place].count)
    try:
        rows = [[cell.strip() for cell in row] for row in csv.reader(lines[place : place + 3], delimiter=separator)]
    except csv.Error as error:
        raise RecordingError(f"{path}: cannot be read as a table ({error}); export it again") from None
    head, *below = rows
    if len(head) < 2 or len(head) > 1000:
        raise RecordingError(
            f"{path}: line {place + 1} has {len(head)} columns, {lines[place][:40]!r}; expected the headings of time "
            "and of channels, separated by commas, semicolons or tabs"
        )
    named = [heading(cell) for cell in head]
    skipped = place + 1
    if below and len(below[0]) == len(head) and not _is_number(below[0][0]):
        named = [(name, own.strip("[]() ") or unit) for (name, unit), own in zip(named, below[0], strict=True)]
        skipped += 1
        del below[0]
    if separator != "," and any("," in cell for row in below for cell in row):
        raise RecordingError(f"{path}: line {skipped + 1} has decimal commas; export the table with decimal points")
    counts = Counter(name for name, _ in named)
    names = tuple(name if counts[name] == 1 else text for (name, _), text in zip(named, head, strict=True))
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise RecordingError(f"{path}: two columns have the name {twice!r}; rename one")
    if not re.match(r"(time|zeit|t|x)\b", names[0].lower()):
        raise RecordingError(f"{path}: its first heading is {head[0]!r}; the first column must be time, such as time_s")
    return _Headings(names, tuple(unit for _, unit in named), separator, skipped)


def _is_number(text: str) -> bool:
    try:
        fortran_number(text.replace(",", "."))
    except ValueError:
        return False
    return True
