"""What the command line says while it works and how it ends: results, progress, errors, Ctrl-C.

Names, paths and what files hold may come from a stranger. Nothing of it is taken as markup, and what would steer the
terminal is shown, not obeyed.
"""

from __future__ import annotations

import json
import logging
import os
import signal
import sys
import threading
import unicodedata
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn

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
from rich.text import Text

if TYPE_CHECKING:
    from rich.progress import TaskID

    from fe_ste.transmission_error.table import MeshTable

# What the command line says: results on standard output, all else on standard error

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


# How the command line ends: errors that a user can act on, Ctrl-C, and the exit codes of both

EXIT_FAILED = 1
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130
STOPPING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that ask the work to stop: Ctrl-C, kill, a closed terminal."""


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

    2 after `BadInputError` and what a gearbox or its choice cannot be, 1 after `FailedError`, a search without a
    result, and whatever goes wrong in reading and writing, 130 after `StoppedError` and Ctrl-C.
    """
    try:
        with interruption.listening(), model_errors():
            yield
    except BadInputError as error:
        end_with("Bad input", error, EXIT_BAD_INPUT)
    except FailedError as error:
        end_with("Failed", error, EXIT_FAILED)
    except StoppedError as error:
        end_with("Stopped", error, EXIT_INTERRUPTED)
    except KeyboardInterrupt:
        end_with("Stopped", "finished results are kept; run the same command to resume", EXIT_INTERRUPTED)
    except OSError as error:
        end_with("Failed", _file_error_text(error), EXIT_FAILED)
    except MemoryError as error:
        end_with("Failed", f"out of memory ({error})" if str(error) else "out of memory", EXIT_FAILED)


def _file_error_text(error: OSError) -> str:
    """File and reason; what the program says of a file by itself names it already."""
    if error.filename and error.strerror:
        return f"{error.filename}: {error.strerror}"
    return str(error)


def end_with(what: str, reason: object, code: int) -> NoReturn:
    """Say why the program ends and end it with an exit code."""
    note(f"{what}: {reason}", style="red")
    sys.exit(code)


@contextmanager
def model_errors() -> Iterator[None]:
    """Turn errors of the model's parts into those of the command line, for those who look at them themselves."""
    try:
        yield
    except Exception as error:
        user = _told_to_the_user(error)
        if user is None:
            raise
        raise user from error


def _told_to_the_user(error: Exception) -> Exception | None:
    """Return what the command line makes of an error of the model's parts; None of another one."""
    if not type(error).__module__.startswith("exugear."):
        return None
    # Imported after the fact: a verb that goes well need not load them.
    from exugear.gearbox.reading import GearboxFileError
    from exugear.gearbox.variant import VariantError
    from exugear.steady.harmonics.linear_solvers import HarmonicBalanceError
    from exugear.steady.mean_system.rotating_frame import SteadyError
    from exugear.system.bearings.rolling.rows import BearingError
    from exugear.system.statics import BalanceError
    from exugear.system.tooth_mesh.placement import MeshError

    if isinstance(error, (GearboxFileError, VariantError, MeshError, BearingError, SteadyError)):
        return BadInputError(error)
    if isinstance(error, (BalanceError, HarmonicBalanceError)):
        return FailedError(error)
    return None


# What long work shows on standard error: rows with the time left, all of them in one display


class Row:
    """One kind of work: its words, how much is done, the time left. It is seen from the first call on."""

    def __init__(self, bars: Bars) -> None:
        self._bars = bars
        self._task: TaskID | None = None

    def __call__(self, words: str, done: float | None = None, total: float | None = None) -> None:
        """Show words and, if they are known, how much is done and of how much; ends the work after Ctrl-C."""
        interruption.check()
        display = self._bars.display()
        if self._task is None:
            self._task = display.add_task(words, total=total)
        display.update(self._task, description=words, completed=done, total=total)


class Bars:
    """Rows of all that goes on at once: work inside of other work adds a row to the display that is there."""

    def __init__(self) -> None:
        self._outermost: ExitStack | None = None
        self._display: Progress | None = None

    @contextmanager
    def row(self) -> Iterator[Row]:
        """Give a row for work inside the context; contact that is solved there has one of its own."""
        from fe_ste.transmission_error.mean_contact import contacts_told

        contacts = Row(self)

        def solved(done: int, total: int) -> None:
            contacts(f"tooth contact at the static load: {done} of {total}", done, total)

        with ExitStack() as own:
            if self._outermost is None:
                self._outermost = own
                own.callback(self._forget)
            own.enter_context(contacts_told(solved))
            yield Row(self)

    def display(self) -> Progress:
        """Return what all rows stand in; it closes with the outermost context."""
        if self._display is None:
            assert self._outermost is not None, "a row is shown inside its context"
            self._display = self._outermost.enter_context(progress_bar())
        return self._display

    def _forget(self) -> None:
        self._outermost = self._display = None


def files_read(row: Row) -> Callable[[int, int], None]:
    """Return what is told the number of files of loads that are read, and of all; one alone is not worth a row."""

    def show(done: int, total: int) -> None:
        interruption.check()
        if total > 1:
            row("load files", done, total)

    return show


# What is said of tables of transmission error


def tell_of_tables(tables: Mapping[str, MeshTable]) -> list[str]:
    """Say what is missing or cut off in tables; return why they are not to be trusted, nothing if they are."""
    from exugear.system.tooth_mesh.tables import doubts_about_table, remarks_about_table

    for name, table in tables.items():
        for remark in remarks_about_table(name, table):
            note(f"Warning: {remark}", style="yellow")
    return [doubt for name, table in tables.items() for doubt in doubts_about_table(name, table)]


def refuse_not_converged(meshes: Sequence[str]) -> None:
    """End with code 1 where meshes read their tables beside states that are not solved."""
    if meshes:
        raise FailedError(
            f"invalid: the static state of {', '.join(meshes)} lies next to non-converged table states, values are "
            "interpolated; `exugear ste` lists the states and reasons"
        )


# Results folders as verbs ask for them before they work


def check_results_folder(folder: Path) -> None:
    """Refuse a folder that a verb could not write into, before it works, and make none."""
    there = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
    if not there.is_dir():
        raise BadInputError(f"--out {folder}: {there} is not a folder; specify a folder that can be created")
    if not os.access(there, os.W_OK):
        raise BadInputError(f"--out {folder}: {there} is not writable; specify another folder")


def make_results_folder(folder: Path) -> None:
    """Make the folder that a verb writes into, so that a wrong one shows before the work, not after."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(f"--out {folder}: {error.strerror}; specify a folder that can be created") from error
    if not os.access(folder, os.W_OK):
        raise BadInputError(f"--out {folder}: not writable; specify another folder")
