"""What the command line says: results on standard output, all else on standard error.

Names, paths and what files hold may come from a stranger. Nothing of it is taken as markup, and what would steer the
terminal is shown, not obeyed.
"""

from __future__ import annotations

import json
import logging
import sys
import unicodedata
from collections.abc import Mapping
from typing import Any, Literal

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

LONGEST_LINE = 400
"""Letters of a line of a message; of a longer one the middle is left out, for file and remedy stand at its ends."""
MOST_LINES = 25
"""Lines of a message."""
_TURNS = frozenset("\u00ad\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
"""Characters that turn the direction of writing, or are not seen in a name, and so show a text that is not there."""
results = Console()
messages = Console(stderr=True)


def plain(text: object) -> str:
    r"""Show what would steer a terminal: control characters, turns of the writing direction, halves of characters.

    Examples
    --------
    >>> print(plain("red \x1b[31m, 5 µm"))
    red \x1b[31m, 5 µm
    >>> print(plain("shaft\xad1"))
    shaft\xad1
    """
    return "".join(
        letter.encode("unicode_escape").decode("ascii")
        if letter in _TURNS or unicodedata.category(letter) in ("Cc", "Cs", "Zl", "Zp")
        else letter
        for letter in str(text)
    )


def shortened(line: str) -> str:
    """Leave out the middle of a line above `LONGEST_LINE`.

    Examples
    --------
    >>> shortened("file: " + 1000 * "x" + " must be shorter")[-20:]
    'xxxx must be shorter'
    """
    half = (LONGEST_LINE - 3) // 2
    if len(line) <= LONGEST_LINE:
        return line
    return f"{line[:half]}...{line[-half:]}"


def say(line: str) -> None:
    """Print a line of results, unwrapped, so that paths in it can be copied."""
    results.print(Text(plain(line)), soft_wrap=True)


class _Notes(logging.Handler):
    """Says what the library logs."""

    def emit(self, record: logging.LogRecord) -> None:
        note(record.getMessage(), style="yellow" if record.levelno >= logging.WARNING else "")


def say_what_is_logged() -> None:
    """Let the packages' own log appear on standard error."""
    handler = _Notes()
    for package in ("exugear", "fe_ste"):
        logger = logging.getLogger(package)
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)


def note(message: str, style: str = "") -> None:
    """Say something that is no result, unwrapped, so that paths in it can be copied; its lines stay lines.

    Of more than `MOST_LINES` the rest is counted.
    """
    lines = [shortened(plain(line)) for line in counted(message.split("\n"))]
    messages.print(Text("\n".join(lines), style=style), soft_wrap=True)


def counted(lines: list[str]) -> list[str]:
    """Return what is shown of lines: all, or as many as leave one to say how many more there are.

    Examples
    --------
    >>> shown = counted([f"position {n}" for n in range(50)])
    >>> len(shown), shown[-1]
    (25, 'and 26 more')
    """
    if len(lines) <= MOST_LINES:
        return lines
    return [*lines[: MOST_LINES - 1], f"and {len(lines) - MOST_LINES + 1} more"]


class _Description(ProgressColumn):
    """What a bar is about, as it is."""

    def render(self, task: Task) -> Text:
        return Text(shortened(plain(task.description)))


def progress_bar() -> Progress:
    """Return a bar with the time left, to be used as a context manager."""
    return Progress(
        _Description(),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=messages,
        speed_estimate_period=3600.0,  # work comes in bursts: the whole of it tells the speed
    )


def print_json(summary: Mapping[str, Any]) -> None:
    """Print one object on standard output."""
    sys.stdout.write(json.dumps(summary, indent=2, allow_nan=False) + "\n")


def print_table(title: str, rows: list[dict[str, str]], texts: tuple[str, ...] = ()) -> None:
    """Print rows under the keys of the first one; the first column is text, others numbers but for `texts`."""
    table = Table(
        title=Text(plain(title)), title_justify="left", title_style="bold", box=SIMPLE_HEAD, padding=(0, 1, 0, 0)
    )
    for place, heading in enumerate(rows[0]):
        words = heading in texts
        justify: Literal["left", "right"] = "right" if place and not words else "left"
        table.add_column(heading, justify=justify, no_wrap=not words, overflow="fold" if words else "ellipsis")
    for row in rows:
        table.add_row(*(Text(plain(value)) for value in row.values()))
    results.print(table)
