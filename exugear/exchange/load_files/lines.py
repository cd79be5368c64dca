"""Lines of a text of any length, in blocks: no file is in memory as a whole."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from exugear.exchange.load_files.channels import LoadFileError
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import FileError, open_regular

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


def numbers(path: Path, columns: int, skipped: int, separator: str | None) -> Iterator[Floats]:
    """Rows of numbers behind some lines, in blocks (n, columns).

    Words for missing numbers become NaN, so that a channel that is asked for tells.

    Parameters
    ----------
    columns, skipped : of each line; lines of headings
    separator : between numbers; blanks where it is None

    Raises
    ------
    LoadFileError
        A line with another number of columns or with words; no line at all.
    """
    number = 0
    some = False
    for lines in blocks_of_lines(path):
        first = number + 1
        number += len(lines)
        begin = max(0, skipped + 1 - first)
        texts = [line.decode("latin-1") for line in lines[begin:]]
        rows = _parsed(path, texts, columns, first + begin, separator)
        some = some or bool(len(rows))
        if len(rows):
            yield rows
    if not some:
        raise LoadFileError(f"{path}: no lines of numbers under its headings")


def _parsed(path: Path, texts: list[str], columns: int, first: int, separator: str | None) -> Floats:
    kept = [text for text in texts if text.strip()]
    if not kept:
        return np.zeros((0, columns))
    try:
        found = np.loadtxt(kept, delimiter=separator, comments=None, ndmin=2, quotechar='"')
        if found.shape[1] == columns:
            return found
    except ValueError:
        pass
    return _told(path, texts, columns, first, separator)


def _told(path: Path, texts: list[str], columns: int, first: int, separator: str | None) -> Floats:
    """Read line by line, slowly, to tell which line is wrong."""
    rows = []
    for number, text in enumerate(texts, start=first):
        if not text.strip():
            continue
        words = [word.strip().strip('"') for word in text.split(separator)]
        if len(words) != columns:
            raise LoadFileError(f"{path}: line {number} has {len(words)} columns; the headings have {columns}")
        try:
            rows.append([float(word) for word in words])
        except ValueError:
            raise LoadFileError(f"{path}: line {number} holds words; expected {columns} numbers") from None
    return np.array(rows)
