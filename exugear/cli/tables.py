"""Outcomes on the console: a verdict, at most one table, warnings, path of the results; ``--all`` prints the rest.

Tables have complete numbers and headings in 79 columns; only names and texts are wrapped.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Self

from rich.cells import cell_len, set_cell_size
from rich.text import Text

from exugear.cli.console import EXIT_FAILED, counted, note, plain, print_json, results, say
from exugear.results.findings import Finding
from fe_ste.tools.display import without_round_off

NARROWEST = 79
"""Minimum width of a table in characters, which fits a terminal of 80."""
GAP = 2
INFINITE = "infinite"
"""Text of infinite numbers in summaries, since JSON has none."""
HARD_SPACE = "\u00a0"
"""Space in texts at which lines are broken only if necessary; it is printed as a space."""
SHOWN_ROWS = 10
"""Maximum number of rows of a table without ``--all``."""
SHOWN_WARNINGS = 5
"""Maximum number of warnings without ``--all``."""
SMALLEST_NAME = 10
"""Minimum width of wrapped names and texts; a table without space for it is printed in parts below each other."""


@dataclass(frozen=True)
class Column:
    """A column of a table of summaries: the heading, the key of the value in a summary, and how the value is shown."""

    heading: str
    key: str | Callable[[Any], Any]
    """Key in a summary, or a function that takes the value from it."""
    form: str | Callable[[Any], str] = ""
    """Format of a number, or a function that makes its text."""
    factor: float = 1.0
    """From the unit of the summary to that of the heading."""
    missing: str = "-"
    """Text of an unknown value."""
    is_text: bool = False
    """Whether cells are text that may be wrapped."""
    is_detail: bool = False
    """Whether the column is printed with ``--all`` only."""

    def cell(self, summary: Any) -> str:
        """Return the text of one summary."""
        value = self.key(summary) if callable(self.key) else summary.get(self.key)
        if value is None or value != value:
            return self.missing
        if value in (math.inf, INFINITE):
            return "inf."
        if self.factor != 1.0:
            value *= self.factor
        if callable(self.form):
            return self.form(value)
        if isinstance(value, float):
            value = without_round_off(value)
        text = format(value, self.form)
        return text.removeprefix("-") if not text.strip("-0.") else text


detail = partial(Column, is_detail=True)
"""Column that is printed with ``--all`` only."""


@dataclass(frozen=True)
class _Cells:
    """One column as it is printed: heading in lines, cells, and whether they are text that may be wrapped."""

    heading: str
    cells: tuple[str, ...]
    is_text: bool

    @classmethod
    def of(cls, column: Column, summaries: Sequence[Any], is_text: bool) -> Self:
        """Return a column with the texts of all summaries."""
        heading = "\n".join(plain(line.strip()) for line in column.heading.split("\n"))
        return cls(heading, tuple(plain(column.cell(summary)) for summary in summaries), is_text)

    @property
    def natural(self) -> int:
        """Width without any wrapping."""
        return max(_width(text) for text in (self.heading, *self.cells))

    @property
    def smallest(self) -> int:
        """Width below which the heading or a number would be truncated."""
        if not self.is_text:
            return self.natural
        return max(_width(self.heading), min(self.natural, SMALLEST_NAME))


@dataclass(frozen=True)
class Table:
    """A table with one row for each summary."""

    title: str
    rows: Sequence[Any]
    columns: Sequence[Column]
    """The first one is text; numbers are never wrapped or truncated."""
    legend: str = ""
    details: str = ""
    """Continuation of the legend with ``--all``."""
    noun: str = "rows"
    """Name of the rows, plural."""

    @property
    def excerpt(self) -> Table:
        """First rows, without the columns that are details."""
        columns = [column for column in self.columns if not column.is_detail]
        return replace(self, rows=self.rows[:SHOWN_ROWS], columns=columns, details="")


@dataclass(frozen=True)
class Outcome:
    """What a command prints at its end."""

    verdict: str
    """Result in one line."""
    summary: Mapping[str, Any]
    """All results, for ``--json``."""
    tables: Sequence[Table] = ()
    """The first one is an excerpt without ``--all``, the others are omitted."""
    findings: Sequence[Finding] = ()
    path: str | Path = ""
    """File or folder of the results; empty if nothing was written."""
    failure: str = ""
    """Why the command failed, if its results are invalid or do not meet a requirement."""
    remarks: Sequence[str] = ()
    """Sentences below the tables, printed with ``--all`` only."""
    further: Sequence[str] = ()
    """Results below the verdict, one line each."""

    def show(self, as_json: bool, whole: bool) -> None:
        """Print the outcome, and end with code 1 if it is a failure."""
        if as_json:
            print_json({**self.summary, "findings": [asdict(finding) for finding in self.findings]})
        else:
            self._print(whole)
        warnings = [finding.line for finding in self.findings if finding.level == "warning"]
        for line in warnings if whole else counted(warnings, SHOWN_WARNINGS):
            note(line, style="yellow")
        failures = [self.failure, *(finding.text for finding in self.findings if finding.level == "error")]
        failure = "; ".join(filter(None, failures))
        if failure:
            note(f"Failed: {failure}", style="red")
        if self.path and not as_json:
            say(f"Results: {self.path}")
        elif self.path and failure:
            note(f"Results: {self.path}")
        if failure:
            sys.exit(EXIT_FAILED)

    def _print(self, whole: bool) -> None:
        """Print verdict and tables; without ``--all``, say what is left out."""
        for line in (self.verdict, *self.further):
            print_text(line)
        tables = [table for table in self.tables if table.rows]
        for table in tables if whole else [table.excerpt for table in tables[:1]]:
            print_table(table)
        if whole:
            for line in (*self.remarks, *(finding.text for finding in self.findings if finding.passed)):
                print_text(line)
        elif tables:
            first, columns = tables[0], sum(column.is_detail for column in tables[0].columns)
            left = {first.noun: len(first.rows) - SHOWN_ROWS, "columns": columns, "tables": len(tables) - 1}
            more = [f"{count} more {noun if count > 1 else noun[:-1]}" for noun, count in left.items() if count > 0]
            if more:
                print_text(f"{', '.join(more)}: --all")


def failure_text(what: str, reasons: Sequence[str]) -> str:
    """Return what failed with its reasons, a line each; empty without any."""
    return "\n".join([what, *reasons]) if reasons else ""


def bearing_findings(remarks: Mapping[str, Sequence[str]]) -> list[Finding]:
    """Return one finding for each remark, with the bearings that it is on; where ratings are from is a note.

    Examples
    --------
    >>> bearing_findings({"left": ["low load"], "right": ["low load"]})
    [Finding(level='warning', text='bearings left, right: low load', value=None)]
    """
    return [
        Finding(
            "note" if remark.startswith("ratings") else "warning",
            f"bearing{'s' * (len(names) > 1)} {', '.join(names)}: {remark}",
        )
        for remark, names in bearings_of_remarks(remarks.items()).items()
    ]


def bearings_of_remarks(remarks: Iterable[tuple[str, Sequence[str]]]) -> dict[str, list[str]]:
    """Return the bearings that each remark is on, from pairs of a bearing and its remarks.

    Examples
    --------
    >>> bearings_of_remarks([("left", ["low load"]), ("right", ["low load"]), ("left", ["low load"])])
    {'low load': ['left', 'right']}
    """
    found: dict[str, dict[str, None]] = {}
    for bearing, own in remarks:
        for remark in own:
            found.setdefault(remark, {})[bearing] = None
    return {remark: list(names) for remark, names in found.items()}


def print_table(table: Table) -> None:
    """Print a table, and its legend below it."""
    limit = max(NARROWEST, results.width - 1)
    results.print(Text("\n".join(["", *wrapped(plain(table.title), limit)]), style="bold"), soft_wrap=True)
    columns = table.columns
    printed = [_Cells.of(column, table.rows, column.is_text or column is columns[0]) for column in columns]
    for number, part in enumerate(_parts(printed, limit)):
        if number:
            results.print()
        for line in _lines(part, _widths(part, limit)):
            results.print(Text(line), soft_wrap=True)
    if legend := " ".join(filter(None, (table.legend, table.details))):
        print_text(legend)


def print_text(text: str) -> None:
    """Print sentences, wrapped."""
    lines = wrapped(plain(text), max(NARROWEST, results.width - 1))
    results.print(Text("\n".join(lines)), soft_wrap=True)


def significant(value: float, digits: int = 4, decimals: int = 3) -> str:
    """Format a number with some significant digits, without an exponent and with at most some decimals.

    Large numbers keep all digits before the point; above nine of them, or where decimals would show a zero, the number
    has an exponent. Round-off is zero.

    Examples
    --------
    >>> significant(139.192), significant(-0.0), significant(0.53249), significant(2013.46, 5, 1)
    ('139.2', '0.000', '0.532', '2013.5')
    """
    value = without_round_off(value)
    size = abs(value)
    if not math.isfinite(value):
        return f"{value:g}"
    if size >= 1e9 or 0.0 < size < 0.5 * 10.0**-decimals:
        return f"{value:.{digits - 1}g}"
    before = math.floor(math.log10(size)) if size else 0
    return f"{value + 0.0:.{min(max(digits - 1 - before, 0), decimals)}f}"


def wrapped(text: str, width: int) -> list[str]:
    """Break text into lines: at spaces, and in longer words after an underscore, a hyphen, a dot or a slash.

    Examples
    --------
    >>> wrapped("2 x high_speed_stage", 12)
    ['2 x high_', 'speed_stage']
    """
    lines = []
    for paragraph in text.split("\n"):
        line = ""
        for piece in _pieces(paragraph, width):
            if line and cell_len(line) + cell_len(piece.rstrip()) > width:
                lines.append(line.rstrip())
                line = piece.lstrip()
            else:
                line += piece
        lines.append(line.rstrip())
    return [line.replace(HARD_SPACE, " ") for line in lines]


def _pieces(paragraph: str, width: int) -> Iterator[str]:
    """Yield parts of a line between which it may be broken, none of them wider than a column."""
    for word in re.findall(r" *[^ ]+ ?| +", paragraph):
        if cell_len(word.strip()) <= width:
            yield word
            continue
        for part in re.findall(r"[^_\-/.\u00a0]*[_\-/.\u00a0]|[^_\-/.\u00a0]+", word):
            rest = part
            while cell_len(rest.rstrip()) > width:
                head = set_cell_size(rest, width).rstrip() or rest[0]
                yield head
                rest = rest[len(head) :]
            yield rest


def _width(text: str) -> int:
    return max(cell_len(line) for line in text.split("\n"))


def _parts(columns: list[_Cells], limit: int) -> Iterator[list[_Cells]]:
    """Yield groups of columns that fit in one line; further groups are printed below and repeat the first column."""
    part = columns[:1]
    for column in columns[1:]:
        if len(part) > 1 and _total([one.smallest for one in (*part, column)]) > limit:
            yield part
            part = columns[:1]
        part = [*part, column]
    yield part


def _total(widths: Sequence[int]) -> int:
    """Width of a line: a margin, the columns, and the gaps between them."""
    return 1 + sum(widths) + GAP * (len(widths) - 1)


def _widths(columns: Sequence[_Cells], limit: int) -> list[int]:
    """Widths of columns; the widest texts are narrowed first."""
    widths = [column.natural for column in columns]
    while _total(widths) > limit:
        able = [place for place, column in enumerate(columns) if widths[place] > column.smallest]
        if not able:
            break
        widths[max(able, key=lambda place: widths[place])] -= 1
    return widths


def _lines(columns: Sequence[_Cells], widths: Sequence[int]) -> Iterator[str]:
    """Yield the lines of a table: headings, a rule, rows."""
    yield from _row([column.heading.split("\n") for column in columns], columns, widths, bottom=True)
    yield " " + "─" * (_total(widths) - 1)
    for number in range(len(columns[0].cells)):
        cells = []
        for place, (column, width) in enumerate(zip(columns, widths, strict=True)):
            lines = wrapped(column.cells[number], width)
            if not place and len(lines) > 1:
                lines = lines[:1] + [" " * (cell_len(line) < width) + line for line in lines[1:]]
            cells.append(lines)
        yield from _row(cells, columns, widths)


def _row(
    cells: Sequence[list[str]], columns: Sequence[_Cells], widths: Sequence[int], *, bottom: bool = False
) -> Iterator[str]:
    """Yield the lines of one row: texts are left-aligned, numbers right-aligned, headings aligned at the bottom."""
    height = max(map(len, cells))
    if bottom:
        cells = [[*[""] * (height - len(lines)), *lines] for lines in cells]
    for number in range(height):
        line = ""
        for lines, column, width in zip(cells, columns, widths, strict=True):
            text = "".join(lines[number : number + 1])
            blank = " " * (width - cell_len(text))
            parts = (blank, text)
            if column.is_text:
                parts = (text, blank)
            line += " " * GAP + "".join(parts)
        yield line[GAP - 1 :].rstrip()
