"""Lines of text files with matrices: read one after another, and refused if they are binary or without end."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from exugear.system.bodies.matrix_files.interface import MatrixFileError
from fe_ste.tools.files import FileError, open_regular
from fe_ste.tools.numbers import fortran_number

LONGEST_LINE = 1_000_000
"""Maximum number of bytes of a line; a row of the largest matrix as CSV has less than 100 kB."""


def text_lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield number and text of each line, without its end.

    Raises
    ------
    MatrixFileError
        The file cannot be read, contains binary data, or has a line of more than `LONGEST_LINE` bytes.
    """
    try:
        with open_regular(path) as file:
            number = 0
            while line := file.readline(LONGEST_LINE + 1):
                number += 1
                if len(line) > LONGEST_LINE:
                    raise MatrixFileError(f"{path}: line {number} has more than {LONGEST_LINE} bytes; expected a text")
                if b"\0" in line:
                    raise MatrixFileError(
                        f"{path}: line {number} contains binary data; expected a text; check the ending of its name"
                    )
                yield number, line.decode("latin-1").rstrip("\r\n")
    except FileError as error:
        raise MatrixFileError(str(error)) from None


def real(word: str, place: str) -> float:
    """Return the finite number in a word; `place` says where it is, for the message.

    Raises
    ------
    MatrixFileError
        The word is not a finite number.

    Examples
    --------
    >>> real(" 1.5D+02", "housing.pch: line 3")
    150.0
    """
    try:
        value = fortran_number(word.strip())
    except ValueError:
        raise MatrixFileError(f"{place}: {word.strip()[:40]!r} is not a number; write the file again") from None
    if not abs(value) < float("inf"):
        raise MatrixFileError(f"{place}: {word.strip()[:40]!r} is not finite; write the file again")
    return value


def whole(word: str, place: str) -> int:
    """Return the whole number in a word.

    Raises
    ------
    MatrixFileError
        The word is not a whole number of at most 18 digits.
    """
    text = word.strip()
    if len(text.lstrip("+-")) > 18 or not text.lstrip("+-").isdecimal():
        raise MatrixFileError(f"{place}: {text[:40]!r} is not a whole number; write the file again")
    try:
        return int(text)
    except ValueError:
        raise MatrixFileError(f"{place}: {text[:40]!r} is not a whole number; write the file again") from None
