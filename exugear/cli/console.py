"""What the command line says and how it ends: results on standard output, all else on standard error.

Names, paths and what files hold may come from a stranger. Nothing of it is taken as markup, and what would steer the
terminal is shown, not obeyed.
"""

from __future__ import annotations

import io
import json
import logging
import os
import signal
import sys
import threading
import unicodedata
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import FrameType
from typing import Any, Literal, NoReturn, TextIO

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

EXIT_FAILED = 1
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130
EXIT_UNREAD = 141
"""As of any program whose reader, such as ``head``, has read enough."""
STOPPING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that ask the work to stop: Ctrl-C, kill, a closed terminal."""
LONGEST_LINE = 400
"""Letters of a line of a message; of a longer one the middle is left out, for file and remedy stand at its ends."""
_TURNS = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
"""Characters that turn the direction of writing and so can show a text that is not there."""
results = Console()
messages = Console(stderr=True)


class BadInputError(Exception):
    """The user's input cannot be used: nothing was written, the message says what would be right."""


class FailedError(Exception):
    """The work was begun and could not be finished; what was finished is kept."""


class StoppedError(Exception):
    """The user stopped the work; the message says what is kept and how to go on."""


class Interruption:
    """Ctrl-C, remembered: Python drops the exception where it falls into a finaliser or a library's callback.

    SIGTERM and SIGHUP act as Ctrl-C does. The second Ctrl-C ends the process at once.
    """

    def __init__(self) -> None:
        self._wanted = False

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Remember Ctrl-C inside the context, besides raising it; only the main thread receives it.

        Whatever error a library makes of it leaves the context as KeyboardInterrupt.
        """
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        self._wanted = False
        before = {number: signal.getsignal(number) for number in STOPPING}
        for number, handler in before.items():
            if number == signal.SIGINT or handler is not signal.SIG_IGN:  # nohup has SIGHUP ignored
                signal.signal(number, self._remember)
        complain = sys.unraisablehook

        def leave_out_ctrl_c(dropped: sys.UnraisableHookArgs) -> None:
            if dropped.exc_type is not KeyboardInterrupt:
                complain(dropped)

        sys.unraisablehook = leave_out_ctrl_c
        try:
            yield
            self.check()
        except StoppedError:
            raise
        except Exception as error:
            if self._wanted:
                raise KeyboardInterrupt from error
            raise
        finally:
            sys.unraisablehook = complain
            for number, handler in before.items():
                signal.signal(number, handler)

    def _remember(self, number: int, frame: FrameType | None) -> None:
        if self._wanted:  # what is finished is being put away
            return
        self._wanted = True
        signal.signal(signal.SIGINT, signal.SIG_DFL)
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


def plain(text: object) -> str:
    r"""Show what would steer a terminal: control characters, turns of the writing direction, halves of characters.

    Examples
    --------
    >>> print(plain("red \x1b[31m, 5 µm"))
    red \x1b[31m, 5 µm
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
    return line if len(line) <= LONGEST_LINE else f"{line[:half]}...{line[-half:]}"


def say(line: str) -> None:
    """Print a line of results, unwrapped, so that paths in it can be copied."""
    results.print(Text(plain(line)), soft_wrap=True)


class _Stream(io.TextIOWrapper):
    """Standard stream that costs no work when it cannot be written: what follows is dropped, the failure kept."""

    failure: OSError | None = None

    def write(self, text: str, /) -> int:
        try:
            return super().write(text)
        except OSError as error:
            self._give_up(error)
            return len(text)

    def flush(self) -> None:
        try:
            super().flush()
        except OSError as error:
            self._give_up(error)

    def _give_up(self, error: OSError) -> None:
        self.failure = self.failure or error
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self.fileno())
        os.close(nowhere)


@contextmanager
def standard_streams() -> Iterator[None]:
    """Finish the work though its output cannot be written, and tell by the exit code of the program inside.

    141 if the reader of standard output is gone, without a word; 1 and a sentence if it is full or closed. What was
    to be said on standard error and cannot is dropped.
    """
    _take_closed_numbers()
    sys.stdout, sys.stderr = output, _ = _lasting(sys.stdout, 1), _lasting(sys.stderr, 2)
    try:
        yield
    except SystemExit as end:
        output.flush()
        failure = getattr(output, "failure", None)
        if failure is not None and not end.code:
            if isinstance(failure, BrokenPipeError):
                sys.exit(EXIT_UNREAD)
            _end("Failed", f"standard output: {failure.strerror}", EXIT_FAILED)
        raise


def _take_closed_numbers() -> None:
    """Put something in the place of closed streams, so that no file gets their numbers and what goes to them."""
    for number, mode in enumerate((os.O_RDONLY, os.O_RDONLY, os.O_WRONLY)):  # writing to standard output fails
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, mode)  # takes the lowest number, which is this one


def _lasting(stream: TextIO | None, number: int) -> TextIO:
    """Stream in place of Python's own, which is None if it was closed."""
    if stream is None:
        return _Stream(open(number, "wb", closefd=False), encoding="utf-8", line_buffering=True)
    if not isinstance(stream, io.TextIOWrapper):
        return stream
    return _Stream(stream.buffer, stream.encoding, stream.errors, None, stream.line_buffering, stream.write_through)


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
    """Say something that is no result, unwrapped, so that paths in it can be copied; its lines stay lines."""
    lines = [shortened(plain(line)) for line in message.split("\n")]
    messages.print(Text("\n".join(lines), style=style), soft_wrap=True)


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
