"""What the command line says and how it ends: results on standard output, all else on standard error."""

from __future__ import annotations

import json
import signal
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import FrameType
from typing import Any, Literal, NoReturn

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

EXIT_FAILED = 1
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130

results = Console()
messages = Console(stderr=True)


class BadInputError(Exception):
    """The user's input cannot be used: nothing was written, the message says what would be right."""


class FailedError(Exception):
    """The work was begun and could not be finished; what was finished is kept."""


class StoppedError(Exception):
    """The user stopped the work; the message says what is kept and how to go on."""


class Interruption:
    """Ctrl-C, remembered: Python drops the exception where it falls into a finaliser or a library's callback."""

    def __init__(self) -> None:
        self._wanted = False

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Remember Ctrl-C inside the context, besides raising it; only the main thread receives it."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        self._wanted = False
        before = signal.signal(signal.SIGINT, self._remember)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)

    def _remember(self, number: int, frame: FrameType | None) -> None:
        self._wanted = True
        raise KeyboardInterrupt

    def check(self) -> None:
        """Raise a Ctrl-C that came and was dropped; long work calls this between its steps."""
        if self._wanted:
            raise KeyboardInterrupt


interruption = Interruption()


@contextmanager
def exit_codes() -> Iterator[None]:
    """Turn errors the user can act on into one message and an exit code; others keep their traceback.

    2 after `BadInputError`, 1 after `FailedError` and whatever goes wrong in reading and writing, 130 after
    `StoppedError` and Ctrl-C.
    """
    try:
        with interruption.listening():
            yield
    except BadInputError as error:
        _end("Bad input", error, EXIT_BAD_INPUT)
    except FailedError as error:
        _end("Failed", error, EXIT_FAILED)
    except StoppedError as error:
        _end("Stopped", error, EXIT_INTERRUPTED)
    except KeyboardInterrupt:
        _end("Stopped", "finished results are kept; the same command goes on from there", EXIT_INTERRUPTED)
    except OSError as error:
        _end("Failed", _of_a_file(error), EXIT_FAILED)
    except MemoryError as error:
        _end("Failed", f"out of memory ({error})" if str(error) else "out of memory", EXIT_FAILED)


def _of_a_file(error: OSError) -> str:
    """File and reason; what the program says of a file by itself names it already."""
    return f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error)


def _end(what: str, reason: object, code: int) -> NoReturn:
    note(f"{what}: {reason}", style="red")
    sys.exit(code)


def note(message: str, style: str = "") -> None:
    """Say something that is no result, unwrapped, so that paths in it can be copied."""
    messages.print(Text(message, style=style), soft_wrap=True)


def progress_bar() -> Progress:
    """Return a bar with the time left, to be used as a context manager."""
    return Progress(
        TextColumn("{task.description}"),
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
    table = Table(title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for place, heading in enumerate(rows[0]):
        words = heading in texts
        justify: Literal["left", "right"] = "right" if place and not words else "left"
        table.add_column(heading, justify=justify, no_wrap=not words, overflow="fold" if words else "ellipsis")
    for row in rows:
        table.add_row(*row.values())
    results.print(table)
