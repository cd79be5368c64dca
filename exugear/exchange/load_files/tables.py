"""Tables of numbers as text: OpenFAST's text output, and tables with commas whose headings carry units."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from exugear.exchange.load_files.channels import Channels, LoadFileError, Read
from exugear.exchange.load_files.lines import first_lines, numbers
from fe_ste.tools.arrays import Floats

ENDINGS = {
    "_N_m": "N-m", "_kN_m": "kN-m", "_MN_m": "MN-m", "_N": "N", "_kN": "kN", "_MN": "MN", "_rpm": "rpm",
    "_rad_per_s": "rad/s", "_m_per_s": "m/s", "_s": "s", "_ms": "ms", "_min": "min", "_h": "h",
}  # fmt: skip
"""Units at the end of headings of tables with commas; longer ones first where one ends another."""
_MOST_HEADER_LINES = 40
MOST_ROWS = 1_000_000
"""Lines of a table of counted loads."""


def open_openfast_text(path: Path) -> Channels:
    """Channels of OpenFAST's text output (``.out``): a line of names from Time on, one of units, one for each step.

    Raises
    ------
    LoadFileError
        No such lines.
    """
    lines = first_lines(path, _MOST_HEADER_LINES + 1)
    heads = (place for place, line in enumerate(lines[:_MOST_HEADER_LINES]) if line.lower().split()[:1] == ["time"])
    number = next(heads, None)
    if number is None:
        raise LoadFileError(f"{path}: no line begins with Time; expected OpenFAST's text output")
    names = lines[number].split()
    units = lines[number + 1].split() if number + 1 < len(lines) else []
    if len(units) != len(names):
        raise LoadFileError(
            f"{path}: {len(names)} names and {len(units)} units in lines {number + 1} and {number + 2}; a unit for each"
        )
    return Channels(path, tuple(names[1:]), tuple(units[1:]), units[0], _reader(path, len(names), number + 2, None))


def open_headed_series(path: Path) -> Channels:
    """Channels of a table with commas: ``time_s``, and channels whose heading ends in its unit, ``hss_rpm``, ``a_N_m``.

    Raises
    ------
    LoadFileError
        As `headings_of`; no time first, or a heading without a unit.
    """
    headings = headings_of(path)
    if not is_series(headings):
        raise LoadFileError(f"{path}: its first heading is {headings[0]!r}; a series begins with time_s")
    time, *units = (_unit_of_heading(path, heading) for heading in headings)
    return Channels(path, headings[1:], tuple(units), time, _reader(path, len(headings), 1, ","))


def is_series(headings: tuple[str, ...]) -> bool:
    """Tell whether a table with commas is one over time."""
    return headings[0] in ("time_s", "time_ms", "time_min", "time_h")


def headings_of(path: Path) -> tuple[str, ...]:
    """Headings of a table with commas.

    Raises
    ------
    LoadFileError
        Nothing under the headings, no commas, or a heading twice.
    """
    lines = [line for line in first_lines(path, 100) if line.strip()]
    if len(lines) < 2:
        found = "has headings alone" if lines else "is empty"
        raise LoadFileError(f"{path}: {found}; expected a line of headings and lines of numbers")
    try:
        (cells,) = csv.reader(lines[:1])
    except csv.Error as error:
        raise LoadFileError(f"{path}: cannot be read as a table with commas ({error})") from None
    headings = tuple(cell.strip() for cell in cells)
    if len(headings) == 1:
        raise LoadFileError(f"{path}: its headings are {headings[0][:60]!r}; columns are separated by commas")
    twice = next((heading for heading in headings if headings.count(heading) > 1), None)
    if twice is not None:
        raise LoadFileError(f"{path}: two columns are called {twice!r}; each needs a name of its own")
    return headings


def table_rows(path: Path, columns: int) -> Floats:
    """Numbers under the headings of a table with commas that is no series, (lines, columns).

    Raises
    ------
    LoadFileError
        As `exugear.exchange.load_files.lines.numbers`, or more than `MOST_ROWS` lines.
    """
    parts: list[Floats] = []
    for block in numbers(path, columns, 1, ","):
        parts.append(block)
        if sum(map(len, parts)) > MOST_ROWS:
            raise LoadFileError(f"{path}: more than {MOST_ROWS} lines; counted loads have a line for each bin")
    return np.concatenate(parts)


def _reader(path: Path, columns: int, skipped: int, separator: str | None) -> Read:
    def read(places: tuple[int, ...]) -> Iterator[tuple[Floats, Floats]]:
        chosen = [place + 1 for place in places]
        for rows in numbers(path, columns, skipped, separator):
            yield rows[:, 0], rows[:, chosen]

    return read


def _unit_of_heading(path: Path, heading: str) -> str:
    for ending in sorted(ENDINGS, key=len, reverse=True):
        if heading.endswith(ending):
            return ENDINGS[ending]
    raise LoadFileError(f"{path}: heading {heading!r} ends in no unit; endings are {', '.join(ENDINGS)}")
