"""Nastran op4 files: matrices by name without nodes, ASCII or binary, in either byte order.

A matrix has a header with its numbers of columns and rows, form, type and name, then a record for each column that is
not zero: column, first row, and number of words, with the values from there on. A first row of zero announces strings,
pieces of a column each with a row and a length of its own; in matrices with a negative number of rows ("bigmat") row
and length have a word each, in others they share one: row + 65536 (words + 1). A record with a column beyond the last
ends the matrix.

Binary files are records of Fortran, with their length before and behind them; the header has 24 bytes, or 48 with
integers of 64 bits. Text has a format for the values in each header, such as `1P,3E23.16`; values may touch.
"""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import numpy as np

from exugear.system.bodies.matrix_files.interface import (
    InterfaceMatrices,
    LabelledMatrix,
    MatrixFileError,
    check_size,
)
from exugear.system.bodies.matrix_files.text import real, text_lines, whole
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import FileError, open_regular

_HEADER_BYTES = {24: 4, 48: 8}
"""Bytes of a word by those of the header of a binary file."""
_SINGLE, _DOUBLE, _COMPLEX_DOUBLE = 1, 2, 4
"""Types of matrices; 3 and 4 are complex."""
_PACKED = 65536
"""Row and length of a string share a word: row + 65536 (words + 1)."""
_WIDE, _NARROW = 16, 8
"""Columns of an integer in a text."""
_FORMAT = re.compile(r"(?:1P,?)?(\d{1,2})[ED](\d{1,2})\.\d")
_SPARSE = 0
RECOVERY = "MUG1"
"""Name of the recovery matrix, a row for each displacement that follows from the coordinates, its columns."""
MOST_ROWS = 1_200_000
"""Largest number of these rows."""
_FULL = 20
"""Entries of a recovery matrix over those in the file, at most: it is full, and memory follows the size of the file."""


@dataclass
class _Matrix:
    """A matrix while it is read: allocated only after its last record was found."""

    path: Path
    name: str
    columns: int
    rows: int
    kind: int
    is_wanted: bool
    """Whether it is kept; all others are skipped."""
    pieces: list[tuple[int, int, Floats]] = field(default_factory=list)
    """First row and column, both from 0, and values of each piece of a column."""

    def check(self) -> None:
        """Refuse what cannot be a mass or stiffness matrix."""
        if not self.is_wanted:
            return
        if self.kind not in (_SINGLE, _DOUBLE):
            raise MatrixFileError(
                f"{self.path}: matrix {self.name} is complex; write real matrices, and state structural damping by "
                "loss_factor"
            )
        if self.name == RECOVERY:
            check_size(self.columns, self.path, self.name)
            if not 0 < self.rows <= MOST_ROWS:
                raise MatrixFileError(
                    f"{self.path}: matrix {self.name} has {self.rows} rows; 1 to {MOST_ROWS} are read; keep the nodes "
                    "of the outer surface only"
                )
            return
        if self.columns != self.rows:
            raise MatrixFileError(
                f"{self.path}: matrix {self.name} is {self.rows} x {self.columns}; expected a square one"
            )
        check_size(self.rows, self.path, self.name)

    def add(self, row: int, column: int, values: Floats) -> None:
        """Add the values of a column from a row on, both counted from 1."""
        if not self.is_wanted:
            return
        if not 0 < column <= self.columns or row < 1 or row - 1 + len(values) > self.rows:
            raise MatrixFileError(
                f"{self.path}: matrix {self.name}: column {column} has rows {row} to {row - 1 + len(values)}, but the "
                f"matrix has {self.rows}; the file is damaged, write it again"
            )
        if not np.isfinite(values).all():
            raise MatrixFileError(f"{self.path}: matrix {self.name}: column {column} has a value that is not finite")
        self.pieces.append((row - 1, column - 1, values))

    def complete(self) -> LabelledMatrix:
        stored = sum(len(values) for _, _, values in self.pieces)
        if self.name == RECOVERY and self.rows * self.columns > _FULL * stored:
            raise MatrixFileError(
                f"{self.path}: matrix {self.name} has {self.rows} x {self.columns} entries, but {stored} in the file, "
                "which is damaged; write it again"
            )
        matrix = np.zeros((self.rows, self.columns))
        for row, column, values in self.pieces:
            matrix[row : row + len(values), column] = values
        return LabelledMatrix(matrix)


def read_op4(path: Path, wanted: frozenset[str]) -> tuple[dict[str, LabelledMatrix], tuple[str, ...]]:
    """Matrices of the wanted names, and the names of all matrices, of an op4 file.

    Raises
    ------
    MatrixFileError
        The file is no op4 file, is truncated or damaged, or a wanted matrix is complex, rectangular or too large.
    """
    try:
        with open_regular(path) as file:
            length = os.fstat(file.fileno()).st_size
            first = file.read(4)
            file.seek(0)
            orders = [
                order for order in "<>" if len(first) == 4 and struct.unpack(f"{order}i", first)[0] in _HEADER_BYTES
            ]
            found = (
                _Binary(path, file, length, orders[0], wanted).matrices() if orders else _text_matrices(path, wanted)
            )
            names = []
            matrices = {}
            for matrix in found:
                names.append(matrix.name)
                if matrix.is_wanted:
                    matrices[matrix.name] = matrix.complete()
    except FileError as error:
        raise MatrixFileError(str(error)) from None
    if not names:
        raise MatrixFileError(f"{path}: no matrix; write the matrices with OUTPUT4 or EXTSEOUT(MATOP4=unit)")
    return matrices, tuple(names)


@dataclass
class _Binary:
    """Sequential reader of a binary file that never reads beyond its end."""

    path: Path
    file: IO[bytes]
    length: int
    order: str
    """Byte order, "<" or ">"."""
    wanted: frozenset[str]
    word: int = 4
    """Bytes of an integer."""
    name: str = "1"
    """Matrix at work, for messages."""

    def matrices(self) -> Iterator[_Matrix]:
        """Yield the matrices of the file."""
        number = 0
        while self.file.tell() < self.length:
            number += 1
            self.name = str(number)
            yield self._matrix()

    def _record(self) -> bytes:
        """Read the content of a record, whose length before and behind it must agree with the file."""
        (size,) = struct.unpack(f"{self.order}i", self._bytes(4))
        if size < 0 or self.file.tell() + size + 4 > self.length:
            raise MatrixFileError(
                f"{self.path}: matrix {self.name}: a record of {size} bytes at byte {self.file.tell()}, but the file "
                f"ends at {self.length}; it is truncated or damaged, copy it in binary mode or write it again"
            )
        content = self.file.read(size)
        if struct.unpack(f"{self.order}i", self._bytes(4))[0] != size:
            raise MatrixFileError(
                f"{self.path}: matrix {self.name}: the record that ends at byte {self.file.tell()} has two different "
                "lengths; the file is damaged, copy it in binary mode or write it again"
            )
        return content

    def _bytes(self, count: int) -> bytes:
        content = self.file.read(count)
        if len(content) < count:
            raise MatrixFileError(
                f"{self.path}: ends at byte {self.length} inside matrix {self.name}; it is truncated, write it again"
            )
        return content

    def _integers(self, content: bytes, count: int) -> tuple[int, ...]:
        if len(content) < count * self.word:
            raise MatrixFileError(
                f"{self.path}: matrix {self.name}: a record of {len(content)} bytes at byte {self.file.tell()}; "
                f"expected at least {count * self.word}; the file is damaged, write it again"
            )
        return struct.unpack_from(f"{self.order}{count}{'i' if self.word == 4 else 'q'}", content)

    def _matrix(self) -> _Matrix:
        header = self._record()
        if len(header) not in _HEADER_BYTES:
            raise MatrixFileError(
                f"{self.path}: matrix {self.name}: a header of {len(header)} bytes; expected 24 or 48; the file is "
                "damaged, or not an op4 file"
            )
        self.word = _HEADER_BYTES[len(header)]
        columns, rows, _, kind = self._integers(header, 4)
        self.name = header[4 * self.word :].decode("latin-1").replace(" ", "").strip("\0").upper()
        matrix = _Matrix(self.path, self.name, columns, abs(rows), kind, self.name in self.wanted)
        matrix.check()
        real_type = np.dtype(f"{self.order}f{4 if kind == _SINGLE and self.word == 4 else 8}")
        while True:
            content = self._record()
            column, row, words = self._integers(content, 3)
            if column > columns:
                return matrix
            if not matrix.is_wanted:
                continue
            if not 0 <= words * self.word <= len(content) - 3 * self.word:
                raise MatrixFileError(
                    f"{self.path}: matrix {self.name}: column {column} states {words} words in a record of "
                    f"{len(content)} bytes; the file is damaged, write it again"
                )
            body = content[3 * self.word : (3 + words) * self.word]
            pieces = [(row, body)] if row != _SPARSE else self._strings(body, rows < 0, column)
            for start, values in pieces:
                count = len(values) // real_type.itemsize
                matrix.add(start, column, np.frombuffer(values, real_type, count).astype(np.float64))

    def _strings(self, body: bytes, separate: bool, column: int) -> Iterator[tuple[int, bytes]]:
        """Yield row and bytes of the strings of a column."""
        place = 0
        heads = 2 if separate else 1
        while place < len(body):
            numbers = self._integers(body[place:], heads)
            length, row = (numbers[0] - 1, numbers[1]) if separate else _unpacked(numbers[0])
            begin = place + heads * self.word
            place = begin + length * self.word
            if length <= 0 or place > len(body):
                raise MatrixFileError(
                    f"{self.path}: matrix {self.name}: a string of {length} words in column {column}; the file is "
                    "damaged, write it again"
                )
            yield row, body[begin:place]


def _unpacked(number: int) -> tuple[int, int]:
    """Words and row of a string.

    Examples
    --------
    >>> _unpacked(65536 * 5 + 12)
    (4, 12)
    """
    return number // _PACKED - 1, number % _PACKED


class _Lines:
    """Lines of a text, from which values are cut by the width of the header's format: they may touch."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lines = text_lines(path)
        self.number = 0

    def line(self, name: str) -> str:
        """Return the next line; the text must not end here."""
        found = next(self._lines, None)
        if found is None:
            raise MatrixFileError(
                f"{self.path}: ends after line {self.number} inside matrix {name}; it is truncated, write it again"
            )
        self.number = found[0]
        return found[1]

    def header(self) -> str:
        """Return the next line that is not empty; empty at the end of the file."""
        for number, text in self._lines:
            self.number = number
            if text.strip():
                return text
        return ""

    def integers(self, text: str, width: int, count: int) -> list[int]:
        """Return numbers of a fixed width."""
        place = f"{self.path}: line {self.number}"
        return [whole(text[width * n : width * (n + 1)], place) for n in range(count)]

    def values(self, count: int, width: int, per_line: int, name: str) -> Floats:
        """Return numbers that fill lines."""
        found: list[float] = []
        while len(found) < count:
            text = self.line(name)
            place = f"{self.path}: line {self.number}"
            end = min(len(text.rstrip()), per_line * width)
            words = [text[start : start + width] for start in range(0, end, width)][: count - len(found)]
            if not words:
                raise MatrixFileError(f"{place}: no values of matrix {name}; the file is damaged, write it again")
            found += [real(word, place) for word in words]
        return np.array(found)


def _text_matrices(path: Path, wanted: frozenset[str]) -> Iterator[_Matrix]:
    """Yield the matrices of a text file."""
    lines = _Lines(path)
    while header := lines.header():
        # Four integers fill the first 64 columns of a header with wide integers; a name follows in narrow ones.
        width = _WIDE if len(header) > 4 * _WIDE and len(header[: 4 * _WIDE].split()) == 4 else _NARROW
        columns, rows, _, kind = lines.integers(header, width, 4)
        name = header[4 * width : 4 * width + 8].replace(" ", "").upper()
        form = _FORMAT.search(header[4 * width + 8 :].upper())
        per_line, digits = (5, 16) if form is None else (int(form[1]), int(form[2]))
        if not name or not min(per_line, digits) > 0:
            raise MatrixFileError(f"{path}: line {lines.number}: not the header of an op4 matrix; write the file again")
        matrix = _Matrix(path, name, columns, abs(rows), kind, name in wanted)
        matrix.check()
        step = 2 if kind in (_DOUBLE, _COMPLEX_DOUBLE) else 1  # words of a real number
        while True:
            column, row, words = lines.integers(lines.line(name), width, 3)
            if column > columns:
                lines.values(1, digits, per_line, name)
                break
            if not 0 <= words <= 4 * (abs(rows) + 2) * (2 if row == _SPARSE else 1):
                raise MatrixFileError(
                    f"{path}: line {lines.number}: column {column} of matrix {name} states {words} words; the matrix "
                    f"has {abs(rows)} rows; the file is damaged, write it again"
                )
            if row != _SPARSE:
                # In texts the number of words of a dense column is that of its real numbers.
                matrix.add(row, column, lines.values(words, digits, per_line, name))
                continue
            while words > 0:
                head = lines.line(name)
                if rows < 0:
                    length, start = lines.integers(head, width, 2)
                    length -= 1
                    words -= length + 2
                else:
                    length, start = _unpacked(whole(head, f"{path}: line {lines.number}"))
                    words -= length + 1
                if length <= 0:
                    raise MatrixFileError(
                        f"{path}: line {lines.number}: a string of {length} words in column {column} of matrix {name}; "
                        "the file is damaged, write it again"
                    )
                matrix.add(start, column, lines.values(length // step, digits, per_line, name))
        yield matrix


def op4_content(matrices: InterfaceMatrices, names: Mapping[str, str]) -> bytes:
    """Content of an ASCII op4 file with all digits; the order of coordinates is that of the nodes, then the modes.

    Parameters
    ----------
    names : name of each matrix in the file, by "stiffness" and "mass"
    """
    lines = []
    for key, name in names.items():
        matrix = getattr(matrices, key)
        size = len(matrix)
        lines.append(f"{size:8d}{size:8d}{6:8d}{_DOUBLE:8d}{name:<8}1P,3E23.16")
        for column, values in enumerate(matrix.T.tolist(), start=1):
            lines.append(f"{column:8d}{1:8d}{size:8d}")
            lines += ["".join(f"{value:23.16E}" for value in values[n : n + 3]) for n in range(0, size, 3)]
        lines += [f"{size + 1:8d}{1:8d}{1:8d}", f"{1.0:23.16E}"]
    return ("\n".join(lines) + "\n").encode()
