"""Universal files (UNV, UFF): time signals in data set 58, as text and with binary values.

A data set is enclosed by lines with ``-1``. Its first line is ``58``, or ``58b`` with the byte order, the format of
numbers and the number of bytes of binary values. Eleven records of text follow: five lines of identification; function
type, version, load case and the response and reference degrees of freedom; data type, number of values, spacing, first
abscissa, step; and the quantities and units of the axes. Values are in columns of fixed width without separators
between them (format 6E13.5, or 4E20.12 in double precision), so that numbers may touch (Structural Dynamics Research
Laboratory, University of Cincinnati: "Universal File Formats").

The length of the file decides: a header that states other lengths is refused before memory is allocated for its values.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from exugear.exchange.recordings.recording import (
    RecordedChannel,
    Recording,
    RecordingError,
    check_sizes,
    common_rate,
    floats,
    places_of,
    recording_of,
)
from exugear.exchange.series_files import decoded
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import open_regular

TIME_RESPONSES = (0, 1)
"""Function types that are read: general, and time response."""
FUNCTIONS = {2: "an auto spectrum", 3: "a cross spectrum", 4: "a frequency response function", 6: "a coherence",
             9: "a spectral density", 12: "a spectrum"}  # fmt: skip
"""Function types by number as messages name them."""
TIME_AXES = (0, 17)
"""Quantities of the abscissa that are read: unknown, and time."""
BYTE_ORDERS = {1: "<", 2: ">"}
IEEE_NUMBERS = 2
DIRECTIONS = {1: "+X", -1: "-X", 2: "+Y", -2: "-Y", 3: "+Z", -3: "-Z"}
_LINE = 200
"""Number of bytes of a line that are read: records have 80 columns."""
_END = b"-1"
_MOST_SETS = 10_000


@dataclass(frozen=True)
class _Form:
    """How real values are written, by the ordinate data type of record 7."""

    width: int
    per_line: int
    kind: str


_FORMS = {2: _Form(13, 6, "f4"), 4: _Form(20, 4, "f8")}
_COMPLEX = (5, 6)


@dataclass(frozen=True)
class _SetHeader:
    """A time signal of the file: what its header states, and where its values are."""

    number: int
    """Number of the data set in the file, from 1."""
    title: str
    """First line of identification, which most programs fill with the name of the channel."""
    place: str
    """Response entity, node and direction, such as ``HOUSING 3:+Z``."""
    unit: str
    count: int
    rate: float
    start: float
    order: str
    """Byte order of binary values; empty for text."""
    form: _Form
    begin: int
    """Position of the first value, bytes."""
    line: int
    """Length of a line of text with its end, bytes."""


def read_unv(path: Path, wanted: Sequence[str] | None = None) -> Recording:
    """Time signals of the data sets 58 of a universal file: those of wanted names, or all.

    A channel has the name of the first line of identification; where this is missing or not unique, that of its degree
    of freedom, such as ``HOUSING 3:+Z``.

    Raises
    ------
    RecordingError
        The file has no time signals, is damaged or truncated, or channels differ in length or rate.
    """
    with open_regular(path) as file:
        headers = list(_headers(path, file, os.fstat(file.fileno()).st_size))
        if not headers:
            raise RecordingError(f"{path}: contains no data set 58 with a time signal; export the time signals")
        names = _names(headers)
        chosen = places_of(path, names, wanted)
        rate = common_rate(path, [names[n] for n in chosen], [headers[n].rate for n in chosen])
        channels = [RecordedChannel(names[n], headers[n].unit, _values(path, file, headers[n])) for n in chosen]
    return recording_of(path, rate, headers[chosen[0]].start, channels)


def _names(headers: Sequence[_SetHeader]) -> list[str]:
    """Return unique names of channels: by title, by degree of freedom, or both with the number of the data set."""
    titles = Counter(header.title.lower() for header in headers)
    places = Counter(header.place for header in headers)
    names = []
    for header in headers:
        if header.title.lower() not in ("", "none") and titles[header.title.lower()] == 1:
            names.append(header.title)
        elif places[header.place] == 1:
            names.append(header.place)
        else:
            names.append(f"{header.place} ({header.number})")
    return names


def _headers(path: Path, file: IO[bytes], size: int) -> Iterator[_SetHeader]:
    """Yield the headers of all time signals; binary values are skipped by their length, never searched for an end."""
    number = 0
    others: list[str] = []
    while line := file.readline(_LINE):
        if line.strip() != _END:
            continue
        head = file.readline(_LINE)
        if head[:6].strip() != b"58":
            _pass_over(path, file, decoded(head).strip())
            continue
        number += 1
        if number > _MOST_SETS:
            raise RecordingError(f"{path}: has more than {_MOST_SETS} data sets 58; split the file")
        header = _header(path, file, size, number, head)
        if isinstance(header, str):
            others.append(header)
            continue
        yield header
        file.seek(header.begin + _length(header))
        if not header.order:
            file.seek(-header.line, os.SEEK_CUR)  # the last line may be shorter than the others
            file.readline(_LINE)
        tail = file.read(12)
        if _END not in tail:
            raise RecordingError(
                f"{path}: data set {number} ({header.title or header.place}): no end where its {header.count} values "
                "end; the file is damaged, or its header states a wrong number or type: export it again"
            )
        file.seek(tail.index(_END) + 2 - len(tail), os.SEEK_CUR)
        file.readline(_LINE)

    if others and number == len(others):
        raise RecordingError(f"{path}: contains {others[0]}, but no time signal; export the time signals")


def _pass_over(path: Path, file: IO[bytes], kind: str) -> None:
    """Read to the end of a data set of another kind; nothing may follow the last end."""
    while line := file.readline(_LINE):
        if line.rstrip() == b"    -1":
            return
    if kind:
        raise RecordingError(f"{path}: ends inside data set {kind[:20]!r}; the file is truncated, export it again")


def _header(path: Path, file: IO[bytes], size: int, number: int, head: bytes) -> _SetHeader | str:
    """Read the header of a data set; of one that is no time signal, say what it is, and pass over it."""
    lines = [file.readline(_LINE) for _ in range(11)]
    title = decoded(lines[0]).strip()
    where = f"data set {number}" + (f" ({title})" if title else "")
    if not lines[-1].endswith(b"\n"):
        raise RecordingError(f"{path}: {where}: the file ends in its header; export it again")
    function, response = _degree_of_freedom(path, where, lines[5])
    order, stated = _binary(path, where, head)
    if function not in TIME_RESPONSES:
        file.seek(min(max(stated, 0), size - file.tell()), os.SEEK_CUR)
        _pass_over(path, file, "58")
        return FUNCTIONS.get(function, f"function type {function}")
    record = lines[6]
    try:
        data_type, count, even = (int(record[begin : begin + 10]) for begin in (0, 10, 20))
        start, step = (float(record[begin : begin + 13]) for begin in (30, 43))
    except (ValueError, OverflowError):
        shown = decoded(lines[6]).strip()[:60]
        raise RecordingError(
            f"{path}: {where}: record 7 is {shown!r}; expected data type, number of values, spacing, start and step"
        ) from None
    axis = lines[7][:10].strip()
    if axis.isdigit() and int(axis) not in TIME_AXES:
        raise RecordingError(f"{path}: {where}: its abscissa is quantity {int(axis)}, not time; export the time signal")
    if data_type in _COMPLEX or data_type not in _FORMS:
        what = "complex values" if data_type in _COMPLEX else "values of an unknown type"
        raise RecordingError(f"{path}: {where}: data type {data_type}, {what}; time signals have type 2 or 4")
    if even != 1:
        raise RecordingError(f"{path}: {where}: uneven time steps; export the signal with an even time step")
    check_sizes(path, where, count, 1.0 / step if step else 0.0)
    begin = file.tell()
    line = 0 if order else len(file.readline(_LINE))
    unit = decoded(lines[8][47:67]).strip()
    found = _SetHeader(
        number, title, response, "" if unit.upper() == "NONE" else unit, count, 1.0 / step, start, order,
        _FORMS[data_type], begin, line,
    )  # fmt: skip
    _check_length(path, where, found, size, stated)
    return found


def _degree_of_freedom(path: Path, where: str, line: bytes) -> tuple[int, str]:
    """Return function type, and response entity, node and direction, of record 6."""
    try:
        kind = int(line[:5])
        entity = decoded(line[31:41]).strip()
        node, direction = int(line[41:51] or 0), int(line[51:55] or 0)
    except ValueError:
        shown = decoded(line).strip()[:60]
        raise RecordingError(f"{path}: {where}: record 6 is {shown!r}; expected function type and place") from None
    place = f"{node}:{DIRECTIONS.get(direction, direction)}"
    return kind, place if entity.upper() in ("", "NONE") else f"{entity} {place}"


def _binary(path: Path, where: str, head: bytes) -> tuple[str, int]:
    """Byte order and stated number of bytes of binary values; empty and 0 for text."""
    if head[6:7].lower() != b"b":
        return "", 0
    try:
        order, numbers, stated = (int(head[begin:end] or 0) for begin, end in ((7, 13), (13, 19), (31, 43)))
    except ValueError:
        shown = decoded(head).strip()[:60]
        raise RecordingError(f"{path}: {where}: its first line is {shown!r}; export the file again") from None
    if order not in BYTE_ORDERS or numbers != IEEE_NUMBERS:
        raise RecordingError(
            f"{path}: {where}: byte order {order} and format of numbers {numbers}; 1 or 2, and 2 (IEEE 754) are read"
        )
    return BYTE_ORDERS[order], stated


def _length(header: _SetHeader) -> int:
    """Return the number of bytes of the values; of text the last line as long as the others."""
    if header.order:
        return header.count * np.dtype(header.form.kind).itemsize
    return -(-header.count // header.form.per_line) * header.line


def _check_length(path: Path, where: str, header: _SetHeader, size: int, stated: int) -> None:
    """Compare the number of values with the length of the file, and with the bytes that the header states."""
    needed, left = _length(header), size - header.begin
    if not header.order:
        lines = -(-header.count // header.form.per_line)
        least = header.form.width * min(header.count, header.form.per_line)
        if lines > 1 and not least <= header.line <= least + 2:
            raise RecordingError(
                f"{path}: {where}: lines of values have {header.line} columns; {least} and a line end are expected for "
                f"its data type, so export the file again"
            )
        needed = (lines - 1) * header.line + header.form.width * (header.count - (lines - 1) * header.form.per_line)
    if needed > left:
        raise RecordingError(
            f"{path}: {where}: its {header.count} values take {needed} bytes and {left} follow; the file is truncated, "
            "or its header is damaged: export it again"
        )
    if stated and stated != needed:
        raise RecordingError(
            f"{path}: {where}: its header states {stated} bytes and its {header.count} values take {needed}; export "
            "the file again"
        )


def _values(path: Path, file: IO[bytes], header: _SetHeader) -> Floats:
    """Values of a data set, in its unit."""
    file.seek(header.begin)
    form = header.form
    if header.order:
        return floats(np.frombuffer(file.read(_length(header)), dtype=f"{header.order}{form.kind}"))
    whole = (header.count - 1) // form.per_line
    body = np.frombuffer(file.read(whole * header.line), dtype=np.uint8).reshape(whole, -1)
    rest = file.readline(_LINE).rstrip(b"\r\n")
    last = [rest[begin : begin + form.width] for begin in range(0, len(rest), form.width)]
    try:
        found = np.ascontiguousarray(body[:, : form.width * form.per_line]).view(f"S{form.width}").ravel()
        numbers = np.concatenate([_numbers(found), _numbers(np.array([word for word in last if word.strip()]))])
    except ValueError:
        raise RecordingError(
            f"{path}: data set {header.number} ({header.title or header.place}): has text where a number of "
            f"{form.width} columns is expected; the file is damaged, export it again"
        ) from None
    if numbers.size < header.count:
        raise RecordingError(
            f"{path}: data set {header.number} ({header.title or header.place}): {numbers.size} of {header.count} "
            "values; the file is truncated, export it again"
        )
    return floats(numbers[: header.count])


def _numbers(words: np.ndarray[tuple[int], np.dtype[np.bytes_]]) -> Floats:
    """Numbers in words, with E or, as Fortran writes double precision, D before the exponent."""
    if not words.size:
        return np.zeros(0)
    try:
        return words.astype(np.float64)
    except ValueError:
        return np.char.replace(np.char.upper(words), b"D", b"E").astype(np.float64)
