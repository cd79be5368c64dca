"""Tables of numbers as text: OpenFAST's text output, and tables with commas whose headings carry units."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from exugear.load_files.channels import Channels, LoadFileError
from fe_ste.tools.arrays import Floats

ENDINGS = {"_N_m": "N-m", "_kN_m": "kN-m", "_N": "N", "_kN": "kN", "_rpm": "rpm", "_rad_per_s": "rad/s", "_s": "s"}
"""Units at the end of headings of tables with commas; longer ones first where one ends another."""
_MOST_HEADER_LINES = 40


def parse_openfast_text(path: Path, text: str) -> Channels:
    """Channels of OpenFAST's text output (``.out``): a line of names from Time on, one of units, one for each step.

    Raises
    ------
    LoadFileError
        No such lines, or a line with another number of columns or with words.
    """
    lines = text.splitlines()
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
    values = _numbers(path, [line.split() for line in lines[number + 2 :]], len(names), number + 3)
    return Channels(path, tuple(names[1:]), tuple(units[1:]), values[:, 0], values[:, 1:])


def read_headed(path: Path, text: str) -> tuple[tuple[str, ...], Floats]:
    """Headings and numbers (lines, columns) of a table with commas.

    Raises
    ------
    LoadFileError
        Nothing under the headings, or a line with another number of columns or with words.
    """
    try:
        lines = [line for line in csv.reader(io.StringIO(text)) if line]
    except csv.Error as error:
        raise LoadFileError(f"{path}: cannot be read as a table with commas ({error})") from None
    if len(lines) < 2:
        found = "has headings alone" if lines else "is empty"
        raise LoadFileError(f"{path}: {found}; expected a line of headings and lines of numbers")
    headings = tuple(cell.strip() for cell in lines[0])
    if len(headings) == 1:
        raise LoadFileError(f"{path}: its headings are {headings[0][:60]!r}; columns are separated by commas")
    twice = next((one for one in headings if headings.count(one) > 1), None)
    if twice is not None:
        raise LoadFileError(f"{path}: two columns are called {twice!r}; each needs a name of its own")
    return headings, _numbers(path, lines[1:], len(headings), 2)


def parse_headed_series(path: Path, text: str) -> Channels:
    """Channels of a table with commas: ``time_s``, and channels whose heading ends in its unit, ``hss_rpm``, ``a_N_m``.

    Raises
    ------
    LoadFileError
        As `read_headed`; no ``time_s`` first, or a heading without a unit.
    """
    headings, values = read_headed(path, text)
    if headings[0] != "time_s":
        raise LoadFileError(f"{path}: its first heading is {headings[0]!r}; a series begins with time_s")
    units = tuple(_unit_of_heading(path, heading) for heading in headings[1:])
    return Channels(path, headings[1:], units, values[:, 0], values[:, 1:])


def _unit_of_heading(path: Path, heading: str) -> str:
    for ending in sorted(ENDINGS, key=len, reverse=True):
        if heading.endswith(ending):
            return ENDINGS[ending]
    raise LoadFileError(f"{path}: heading {heading!r} ends in no unit; endings are {', '.join(ENDINGS)}")


def _numbers(path: Path, lines: list[list[str]], columns: int, first: int) -> Floats:
    """Numbers of lines of words; words for missing numbers stay NaN, so that a channel that is asked for tells."""
    rows = []
    for number, line in enumerate(lines, start=first):
        if not line:
            continue
        if len(line) != columns:
            raise LoadFileError(f"{path}: line {number} has {len(line)} columns; the headings have {columns}")
        try:
            rows.append([float(word) for word in line])
        except ValueError:
            raise LoadFileError(f"{path}: line {number} holds words; expected {columns} numbers") from None
    if not rows:
        raise LoadFileError(f"{path}: no lines of numbers under its headings")
    return np.array(rows)
