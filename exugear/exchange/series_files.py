"""Load files over time, by their extension: binary and text output of OpenFAST, and comma-separated tables.

Little endian: format (int16); in format 4 the length of names (int16), 10 otherwise; numbers of channels and of steps
(int32 each); two float64: in format 1 scale and offset of packed times, else first time and step. Formats 1, 2 and 4
pack values as int16 with a scale and an offset (float32) for each channel, format 3 stores them as float64. The
description with its length, and the names and units of time and of all channels follow; then in format 1 the packed
times (int32); then the values step by step. Packed numbers are ``value * scale + offset`` (OpenFAST documentation,
"Output files"; module NWTC_IO).
"""

from __future__ import annotations

import csv
import io
import os
import struct
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import IO, Any

import numpy as np

from exugear.exchange.channels import Channels, LoadFileError, Read
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import FileError, open_regular
from fe_ste.tools.numbers import fortran_number

# Lines of a text of any length, in blocks, so that no whole file is in memory

_PLAIN = b"0123456789+-.eE "
EXACT_PANDAS = (3, 1)
"""Version of pandas from which its default reads decimal numbers exactly, and asking for that is deprecated."""
BLOCK = 1_000_000
"""Number of bytes read at once."""
LONGEST_LINE = 10_000_000
"""Maximum number of bytes of a line of a table."""


def blocks_of_lines(path: Path) -> Iterator[list[bytes]]:
    """Yield the lines of a file in blocks, without line ends.

    Raises
    ------
    LoadFileError
        The file cannot be read, or has a line of more than `LONGEST_LINE` bytes.
    """
    try:
        with open_regular(path) as file:
            rest = b""
            while block := file.read(BLOCK):
                lines = (rest + block).splitlines(keepends=True)
                # A carriage return at the end may belong to a line feed in the next block.
                rest = lines.pop() if not lines[-1].endswith(b"\n") else b""
                if len(rest) > LONGEST_LINE:
                    raise LoadFileError(f"{path}: a line of more than {LONGEST_LINE:g} bytes; expected a table")
                yield [line.rstrip(b"\r\n") for line in lines]
            if rest:
                yield list(rest.splitlines())
    except FileError as error:
        raise LoadFileError(str(error)) from None


def first_lines(path: Path, count: int) -> list[str]:
    """First lines of a file, decoded as UTF-8 or an older encoding; empty for an empty file.

    Raises
    ------
    LoadFileError
        As in `blocks_of_lines`.
    """
    found: list[bytes] = []
    for lines in blocks_of_lines(path):
        found += lines[: count - len(found)]
        if len(found) == count:
            break
    return [decoded(line) for line in found]


def decoded(content: bytes) -> str:
    """Text decoded as UTF-8, or as the encoding of older programs."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def numbers(
    path: Path, headings: Sequence[str], skipped: int, separator: str | None, wanted: Collection[int] | None = None
) -> Iterator[Floats]:
    """Yield rows of numbers after the heading lines, in blocks (n, columns).

    Texts for missing numbers become NaN, so that reading such a channel raises an error; so does any text in unused
    columns.

    Parameters
    ----------
    separator : separator of numbers; None for blanks
    wanted : indices of the required columns; all by default

    Raises
    ------
    LoadFileError
        A line has another number of columns or text in a required column, or the file has no rows.
    """
    table = _Table(path, tuple(headings), separator, tuple(sorted(wanted or range(len(headings)))))
    number = 0
    some = False
    for lines in blocks_of_lines(path):
        first = number + 1
        number += len(lines)
        begin = max(0, skipped + 1 - first)
        rows = table.parsed(lines[begin:], first + begin)
        some = some or bool(len(rows))
        if len(rows):
            yield rows
    if not some:
        raise LoadFileError(f"{path}: no lines of numbers under its headings")


@dataclass(frozen=True)
class _Table:
    """Rows of numbers under headings."""

    path: Path
    headings: tuple[str, ...]
    separator: str | None
    wanted: tuple[int, ...]

    def parsed(self, lines: list[bytes], first: int) -> Floats:
        """Numbers of lines beginning with line number `first`; NaN for text in unused columns."""
        found = self._plain_numbers(lines)
        if found is not None:
            return found
        texts = [line.decode("latin-1") for line in lines]
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

    def _plain_numbers(self, lines: list[bytes]) -> Floats | None:
        """Numbers of lines that have nothing but decimal numbers and separators; None for any others.

        pandas reads them five times as fast as NumPy, and the same values.
        """
        import pandas as pd

        separator = self.separator or " "
        if separator == " " or b"".join(lines).translate(None, _PLAIN + separator.encode()):
            return None
        exact: dict[str, Any] = {} if _version(pd.__version__) >= EXACT_PANDAS else {"float_precision": "round_trip"}
        text = io.BytesIO(b"\n".join(lines))
        try:
            found = pd.read_csv(text, sep=separator, header=None, dtype=np.float64, na_filter=False, **exact).to_numpy()
        except ValueError:  # of pandas, too: an empty cell, another number of columns, no rows
            return None
        return found if found.shape == (len(lines), len(self.headings)) else None

    def _line_by_line(self, texts: list[str], first: int) -> Floats:
        """Read line by line, which is slower, to find the line and column of an error."""
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


def _version(text: str) -> tuple[int, ...]:
    """Major and minor version.

    Examples
    --------
    >>> _version("3.1.1") >= (3, 1), _version("2.3.0rc1")
    (True, (2, 3))
    """
    return tuple(int(part) for part in text.split(".")[:2])


ENDINGS = ("_N_m", "_kN_m", "_MN_m", "_N", "_kN", "_MN", "_rpm", "_rad_per_s", "_m_per_s", "_s", "_ms", "_min", "_h")
"""Units at the end of headings of comma-separated tables; longer ones first if one ends with another."""
_MOST_HEADER_LINES = 40
MOST_ROWS = 1_000_000
"""Maximum number of rows of a table of counted loads."""


def open_openfast_text(path: Path) -> Channels:
    """Channels of OpenFAST's text output (``.out``): a line of names beginning with Time, one of units, one per step.

    Raises
    ------
    LoadFileError
        The file has no such lines.
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
    """Channels of a comma-separated table: ``time_s``, and channels with units, such as ``hss_rpm``, ``a_N_m``.

    Raises
    ------
    LoadFileError
        As in `headings_of`; or time is not the first column, or a heading has no unit.
    """
    headings = headings_of(path)
    if not is_series(headings):
        raise LoadFileError(f"{path}: its first heading is {headings[0]!r}; a series begins with time_s")
    time, *units = (_unit_of_heading(path, heading) for heading in headings)
    return Channels(path, headings[1:], tuple(units), time, _reader(path, headings, 1, ","))


def is_series(headings: tuple[str, ...]) -> bool:
    """Return whether a comma-separated table is a time series."""
    return headings[0] in ("time_s", "time_ms", "time_min", "time_h")


def headings_of(path: Path) -> tuple[str, ...]:
    """Headings of a comma-separated table.

    Raises
    ------
    LoadFileError
        The table has no rows under its headings or no commas, or a heading occurs twice.
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
    """Numbers under the headings of a comma-separated table that is not a time series, (rows, columns).

    Raises
    ------
    LoadFileError
        As in `numbers`, or there are more than `MOST_ROWS` rows.
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
            return ending.replace("_per_", "/").replace("_", " ").strip()
    raise LoadFileError(f"{path}: heading {heading!r} ends in no unit; endings are {', '.join(ENDINGS)}")


WITH_TIME, WITHOUT_TIME, NOT_COMPRESSED, LONG_NAMES = 1, 2, 3, 4
"""Formats of the file, identified by its first number."""
BINARY_BLOCK = 4_000_000
"""Bytes of values that are in memory at once."""
_NAME_LENGTH = 10
_LONGEST_NAME = 1000
_MOST_CHANNELS = 100_000


@dataclass
class _Reader:
    """Sequential reader of a file that never reads beyond its end."""

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
class _ValueLayout:
    """Layout of the values, from the header of a file."""

    kind: int
    steps: int
    first: float
    second: float
    """Scale and offset of packed times, or first time and time step."""
    scales: Floats
    offsets: Floats
    """(channels,) scale and offset of packed values."""
    names: tuple[str, ...]
    units: tuple[str, ...]
    """Names and units, time first."""
    times: int
    rows: int
    """Positions of packed times and of the first row, bytes."""

    @property
    def value(self) -> np.dtype:
        """Data type of a value."""
        return np.dtype("<f8" if self.kind == NOT_COMPRESSED else "<i2")


def open_openfast_binary(path: Path) -> Channels:
    """Channels of an OpenFAST binary file; bytes after its declared steps, which some files have, are ignored.

    Raises
    ------
    LoadFileError
        The format is unknown, or the file ends before its data; its length is checked before memory is allocated.
    """
    try:
        with open_regular(path) as file:
            layout = _layout(_Reader(path, file, os.fstat(file.fileno()).st_size))
    except FileError as error:
        raise LoadFileError(str(error)) from None

    return Channels(path, layout.names[1:], layout.units[1:], layout.units[0], partial(_blocks, path, layout))


def _layout(reader: _Reader) -> _ValueLayout:
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
    layout = _ValueLayout(int(kind), steps, first, second, scales, offsets, names, units, times, rows)
    reader.demand(rows - times + steps * channels * layout.value.itemsize, "values")
    return layout


def _blocks(path: Path, layout: _ValueLayout, places: tuple[int, ...]) -> Iterator[tuple[Floats, Floats]]:
    """Yield time and the values of some channels, in the units of the file, by blocks of steps."""
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


LARGEST_SERIES = 2_000_000_000
"""Maximum size of a file, bytes."""
SERIES_ENDINGS = (".outb", ".out", ".csv")


_OPENED = {".outb": open_openfast_binary, ".out": open_openfast_text, ".csv": open_headed_series}


def read_channels(path: str | Path) -> Channels:
    """Channels over time of OpenFAST's binary (``.outb``) or text (``.out``) output, or of a comma-separated table.

    Values are read in blocks on demand.

    Raises
    ------
    LoadFileError
        The extension is unknown, or the file cannot be read, is damaged or has no channels.

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
