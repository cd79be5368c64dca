"""Files of loads over time, read by their ending: OpenFAST's binary and text output, tables with commas.

Little endian: format (int16); in format 4 the length of names (int16), 10 otherwise; numbers of channels and of steps
(int32 each); two float64: in format 1 scale and offset of packed times, else first time and step. Formats 1, 2 and 4
pack values as int16 with a scale and an offset (float32) for each channel, format 3 holds them as float64. Then the
description with its length, the names and units of time and of all channels; in format 1 the packed times (int32); the
values step by step. Packed are ``value * scale + offset`` (OpenFAST documentation, "Output files"; module NWTC_IO).
"""

from __future__ import annotations

import csv
import hashlib
import os
import re
import struct
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from exugear.exchange.channels import Channels, LoadFileError, Read
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import FileError, open_regular

# Lines of a text of any length, in blocks: no file is in memory as a whole

BLOCK = 1_000_000
"""Bytes that are read at once."""
LONGEST_LINE = 10_000_000
"""Bytes of a line beyond which a file is no table."""


def blocks_of_lines(path: Path) -> Iterator[list[bytes]]:
    """Lines of a file, some at a time, without their ends.

    Raises
    ------
    LoadFileError
        It cannot be read, or has a line of more than `LONGEST_LINE` bytes.
    """
    try:
        with open_regular(path) as file:
            rest = b""
            while block := file.read(BLOCK):
                lines = (rest + block).splitlines(keepends=True)
                # A carriage return at the end may belong to a line feed that comes next.
                rest = lines.pop() if not lines[-1].endswith(b"\n") else b""
                if len(rest) > LONGEST_LINE:
                    raise LoadFileError(f"{path}: a line of more than {LONGEST_LINE:g} bytes; expected a table")
                yield [line.rstrip(b"\r\n") for line in lines]
            if rest:
                yield list(rest.splitlines())
    except FileError as error:
        raise LoadFileError(str(error)) from None


def first_lines(path: Path, count: int) -> list[str]:
    """First lines of a file as text of UTF-8, or of what older programs write; an empty one has none.

    Raises
    ------
    LoadFileError
        As `blocks_of_lines`.
    """
    found: list[bytes] = []
    for lines in blocks_of_lines(path):
        found += lines[: count - len(found)]
        if len(found) == count:
            break
    return [decoded(line) for line in found]


def decoded(content: bytes) -> str:
    """Text of UTF-8, or of what older programs write."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def numbers(
    path: Path, headings: Sequence[str], skipped: int, separator: str | None, wanted: Collection[int] | None = None
) -> Iterator[Floats]:
    """Rows of numbers behind some lines, in blocks (n, columns).

    Words for missing numbers become NaN, so that a channel that is asked for tells; so does whatever stands in columns
    that nobody asks for.

    Parameters
    ----------
    headings : names of the columns
    skipped : lines of headings
    separator : between numbers; blanks where it is None
    wanted : places of the columns that are asked for; all by default

    Raises
    ------
    LoadFileError
        A line with another number of columns, or with words in a column that is asked for; no line at all.
    """
    table = _Table(path, tuple(headings), separator, tuple(sorted(wanted or range(len(headings)))))
    number = 0
    some = False
    for lines in blocks_of_lines(path):
        first = number + 1
        number += len(lines)
        begin = max(0, skipped + 1 - first)
        rows = table.parsed([line.decode("latin-1") for line in lines[begin:]], first + begin)
        some = some or bool(len(rows))
        if len(rows):
            yield rows
    if not some:
        raise LoadFileError(f"{path}: no lines of numbers under its headings")


FORTRAN_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[dDqQ]?)([+-]\d{1,3})")
"""A number as Fortran writes it where its exponent has three digits, without E, or with D for E."""


def fortran_number(word: str) -> float:
    """Return the number of a word, also as Fortran writes it.

    Raises
    ------
    ValueError
        It is none.

    Examples
    --------
    >>> fortran_number("1.2345-101"), fortran_number("-4.5D+02"), fortran_number("7")
    (1.2345e-101, -450.0, 7.0)
    """
    found = FORTRAN_NUMBER.fullmatch(word)
    if found is not None:
        return float(f"{found[1]}e{found[2]}")
    return float(word)


@dataclass(frozen=True)
class _Table:
    """Lines of numbers under headings."""

    path: Path
    headings: tuple[str, ...]
    separator: str | None
    wanted: tuple[int, ...]

    def parsed(self, texts: list[str], first: int) -> Floats:
        """Numbers of lines, the first of them of a number; NaN in columns that nobody asks for and that hold words."""
        kept = [text for text in texts if text.strip()]
        if not kept:
            return np.zeros((0, len(self.headings)))
        try:
            found = np.loadtxt(kept, delimiter=self.separator, comments=None, ndmin=2, quotechar='"')
            if found.shape[1] == len(self.headings):
                return found
        except ValueError:
            pass
        return self._line_by_line(texts, first)

    def _line_by_line(self, texts: list[str], first: int) -> Floats:
        """Read slowly, to tell which line and column is wrong."""
        rows = []
        for number, text in enumerate(texts, start=first):
            if not text.strip():
                continue
            words = [word.strip().strip('"') for word in text.split(self.separator)]
            if len(words) != len(self.headings):
                raise LoadFileError(
                    f"{self.path}: line {number} has {len(words)} columns; the headings have {len(self.headings)}"
                )
            row = np.full(len(words), np.nan)
            for place in self.wanted:
                try:
                    row[place] = fortran_number(words[place])
                except ValueError:
                    raise LoadFileError(
                        f"{self.path}: line {number} has text where {self.headings[place]!r} has a number: "
                        f"{words[place][:40]!r}; expected {len(words)} numbers"
                    ) from None
            rows.append(row)
        return np.array(rows)


# Tables of numbers as text: OpenFAST's text output, and tables with commas whose headings carry units

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
        raise LoadFileError(f"{path}: no line begins with Time; expected OpenFAST text output")
    names = lines[number].split()
    units = lines[number + 1].split() if number + 1 < len(lines) else []
    if len(units) != len(names):
        raise LoadFileError(
            f"{path}: {len(names)} names and {len(units)} units in lines {number + 1} and {number + 2}; one unit per "
            "name is required"
        )
    return Channels(path, tuple(names[1:]), tuple(units[1:]), units[0], _reader(path, names, number + 2, None))


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
    return Channels(path, headings[1:], tuple(units), time, _reader(path, headings, 1, ","))


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
        found = "has headings only" if lines else "is empty"
        raise LoadFileError(f"{path}: {found}; expected a line of headings and lines of numbers")
    try:
        (cells,) = csv.reader(lines[:1])
    except csv.Error as error:
        raise LoadFileError(f"{path}: cannot be read as CSV ({error})") from None
    headings = tuple(cell.strip() for cell in cells)
    if len(headings) == 1:
        raise LoadFileError(f"{path}: its headings are {headings[0][:60]!r}; columns are separated by commas")
    twice = next((heading for heading in headings if headings.count(heading) > 1), None)
    if twice is not None:
        raise LoadFileError(f"{path}: two columns have the name {twice!r}; rename one")
    return headings


def table_rows(path: Path, headings: Sequence[str]) -> Floats:
    """Numbers under the headings of a table with commas that is no series, (lines, columns).

    Raises
    ------
    LoadFileError
        As `exugear.exchange.series_files.numbers`, or more than `MOST_ROWS` lines.
    """
    parts: list[Floats] = []
    for block in numbers(path, headings, 1, ","):
        parts.append(block)
        if sum(map(len, parts)) > MOST_ROWS:
            raise LoadFileError(f"{path}: more than {MOST_ROWS} lines; counted loads have a line for each bin")
    return np.concatenate(parts)


def _reader(path: Path, headings: Sequence[str], skipped: int, separator: str | None) -> Read:
    def read(places: tuple[int, ...]) -> Iterator[tuple[Floats, Floats]]:
        chosen = [place + 1 for place in places]
        for rows in numbers(path, headings, skipped, separator, {0, *chosen}):
            yield rows[:, 0], rows[:, chosen]

    return read


def _unit_of_heading(path: Path, heading: str) -> str:
    for ending in sorted(ENDINGS, key=len, reverse=True):
        if heading.endswith(ending):
            return ENDINGS[ending]
    raise LoadFileError(f"{path}: heading {heading!r} ends in no unit; endings are {', '.join(ENDINGS)}")


# Binary output of OpenFAST (``.outb``), all four formats of it

WITH_TIME, WITHOUT_TIME, NOT_COMPRESSED, LONG_NAMES = 1, 2, 3, 4
"""Formats of the file, by its first number."""
BINARY_BLOCK = 4_000_000
"""Bytes of values that are in memory at once."""
_NAME_LENGTH = 10
_LONGEST_NAME = 1000
_MOST_CHANNELS = 100_000


@dataclass
class _Reader:
    """A file, taken from the front; nothing is taken that it does not hold."""

    path: Path
    file: IO[bytes]
    size: int

    def bytes(self, count: int, what: str) -> bytes:
        self.demand(count, what)
        return self.file.read(count)

    def demand(self, count: int, what: str) -> None:
        end = self.file.tell() + count
        if count < 0 or end > self.size:
            raise LoadFileError(
                f"{self.path}: cut short in its {what}: {end} bytes are needed, the file has {self.size}"
            )

    def numbers(self, form: str, what: str) -> tuple[float, ...]:
        return struct.unpack(f"<{form}", self.bytes(struct.calcsize(f"<{form}"), what))

    def array(self, kind: str, count: int, what: str) -> Floats:
        size = np.dtype(kind).itemsize
        return np.frombuffer(self.bytes(size * count, what), dtype=f"<{kind}").astype(np.float64)

    def texts(self, count: int, length: int, what: str) -> tuple[str, ...]:
        raw = self.bytes(count * length, what)
        return tuple(raw[k * length : (k + 1) * length].decode("latin-1").strip() for k in range(count))


@dataclass(frozen=True, eq=False)
class _Layout:
    """What the head of a file says of its values."""

    kind: int
    steps: int
    first: float
    second: float
    """Scale and offset of packed times, or first time and step."""
    scales: Floats
    offsets: Floats
    """(channels,)"""
    names: tuple[str, ...]
    units: tuple[str, ...]
    """Time first."""
    times: int
    rows: int
    """Places of packed times and of the first row, bytes."""

    @property
    def value(self) -> np.dtype:
        """Type of a value."""
        return np.dtype("<f8" if self.kind == NOT_COMPRESSED else "<i2")


def open_openfast_binary(path: Path) -> Channels:
    """Channels of an OpenFAST binary file; bytes behind its declared steps are left alone, as some files have them.

    Raises
    ------
    LoadFileError
        Another format, or a file that ends before its data; its length is looked at before anything is allocated.
    """
    try:
        with open_regular(path) as file:
            layout = _layout(_Reader(path, file, os.fstat(file.fileno()).st_size))
    except FileError as error:
        raise LoadFileError(str(error)) from None

    def read(places: tuple[int, ...]) -> Iterator[tuple[Floats, Floats]]:
        return _blocks(path, layout, places)

    return Channels(path, layout.names[1:], layout.units[1:], layout.units[0], read)


def _layout(reader: _Reader) -> _Layout:
    path = reader.path
    (kind,) = reader.numbers("h", "format")
    if kind not in (WITH_TIME, WITHOUT_TIME, NOT_COMPRESSED, LONG_NAMES):
        raise LoadFileError(f"{path}: its first number is {kind:g}; OpenFAST binary files begin with 1, 2, 3 or 4")
    (length,) = reader.numbers("h", "length of names") if kind == LONG_NAMES else (_NAME_LENGTH,)
    channels, steps = (int(number) for number in reader.numbers("ii", "numbers of channels and steps"))
    if not (0 < channels <= _MOST_CHANNELS and steps > 0 and 0 < length <= _LONGEST_NAME):
        raise LoadFileError(f"{path}: declares {channels} channels, {steps} steps and names of {length:g} letters")
    first, second = reader.numbers("dd", "times")
    scales = np.ones(channels)
    offsets = np.zeros(channels)
    if kind != NOT_COMPRESSED:
        scales = reader.array("f4", channels, "scales")
        offsets = reader.array("f4", channels, "offsets")
    (described,) = reader.numbers("i", "description")
    reader.bytes(int(described), "description")
    names = reader.texts(channels + 1, int(length), "names")
    units = reader.texts(channels + 1, int(length), "units")
    times = reader.file.tell()
    rows = times + (4 * steps if kind == WITH_TIME else 0)
    reader.demand(rows - times, "times")
    layout = _Layout(int(kind), steps, first, second, scales, offsets, names, units, times, rows)
    reader.demand(rows - times + steps * channels * layout.value.itemsize, "values")
    return layout


def _blocks(path: Path, layout: _Layout, places: tuple[int, ...]) -> Iterator[tuple[Floats, Floats]]:
    """Give time and the values of some channels, in the units of the file, by blocks of steps."""
    chosen = list(places)
    for place in chosen:
        if layout.scales[place] == 0.0:
            raise LoadFileError(f"{path}: channel {layout.names[1 + place]} has the scale 0; damaged")
    width = len(layout.scales) * layout.value.itemsize
    each = max(1, BINARY_BLOCK // width)
    with open_regular(path) as file:
        for begin in range(0, layout.steps, each):
            count = min(each, layout.steps - begin)
            time: Floats = layout.first + layout.second * np.arange(begin, begin + count, dtype=np.float64)
            if layout.kind == WITH_TIME:
                file.seek(layout.times + 4 * begin)
                packed = np.frombuffer(file.read(4 * count), dtype="<i4").astype(np.float64)
                time = (packed - layout.second) / layout.first
            file.seek(layout.rows + width * begin)
            rows = np.frombuffer(file.read(width * count), dtype=layout.value).reshape(count, -1)[:, chosen]
            yield time, (rows.astype(np.float64) - layout.offsets[chosen]) / layout.scales[chosen]


# A file of loads over time, read by its ending

LARGEST_SERIES = 2_000_000_000
"""Largest file that is read, bytes."""
_BLOCK = 1_000_000
SERIES_ENDINGS = (".outb", ".out", ".csv")


_OPENED = {".outb": open_openfast_binary, ".out": open_openfast_text, ".csv": open_headed_series}


def read_channels(path: str | Path) -> Channels:
    """Channels over time of OpenFAST's binary (``.outb``) or text (``.out``) output, or of a table with commas.

    Values are read in blocks when they are asked for.

    Raises
    ------
    LoadFileError
        Another ending, a file that cannot be read, is damaged or holds none.

    Examples
    --------
    >>> series = read_channels("cases/grc750/loads/oc3_hywind_test1.outb")
    >>> series
    <Channels of oc3_hywind_test1.outb: RotTorq, RotSpeed, GenTq, WindVxi>
    >>> round(float(series.channel("LSShftTq", "torque").mean()), 1)
    1933623.7
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in SERIES_ENDINGS:
        raise LoadFileError(f"{path}: ends in {ending or 'nothing'}; load files end in {', '.join(SERIES_ENDINGS)}")
    return _OPENED[ending](path)


def file_digest(path: Path) -> str:
    """SHA-256 of a file.

    Raises
    ------
    LoadFileError
        It cannot be read.
    """
    try:
        with open_regular(path) as file:
            digest = hashlib.sha256()
            while block := file.read(_BLOCK):
                digest.update(block)
            return digest.hexdigest()
    except FileError as error:
        raise LoadFileError(str(error)) from None
