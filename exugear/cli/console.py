"""Console output of the commands: results, progress, errors, Ctrl-C and exit codes.

Names, paths and content of files may be untrusted. They are never interpreted as markup, and control sequences for the
terminal are printed in escaped form.
"""

from __future__ import annotations

import json
import logging
import math
import os
import signal
import sys
import threading
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn

from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TaskProgressColumn
from rich.table import Column
from rich.text import Text

# Console output: results on standard output, everything else on standard error

LONGEST_LINE = 400
"""Maximum number of characters of a line of a message; longer lines are shortened in the middle, because file and
remedy are at the ends.
"""
MOST_LINES = 25
"""Maximum number of lines of a message."""
_TURNS = frozenset("\u00ad\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
"""Characters that change the writing direction or are invisible in a name, and so falsify the displayed text."""
results = Console()
messages = Console(stderr=True)


def plain(text: object) -> str:
    r"""Escape characters that affect a terminal: control characters, writing direction, surrogates.

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
    """Shorten a line longer than `LONGEST_LINE` in the middle.

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


class _Notes(logging.Handler):
    """Log handler that prints the messages of the library."""

    def emit(self, record: logging.LogRecord) -> None:
        note(record.getMessage(), style="yellow" if record.levelno >= logging.WARNING else "")


def say_what_is_logged() -> None:
    """Print the log of the packages on standard error."""
    handler = _Notes()
    for package in ("exugear", "fe_ste"):
        logger = logging.getLogger(package)
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)


def note(message: str, style: str = "") -> None:
    """Print text that is not a result on standard error, unwrapped, so that paths in it can be copied.

    Line breaks are kept; lines beyond `MOST_LINES` are counted.
    """
    lines = [shortened(plain(line)) for line in counted(message.split("\n"))]
    messages.print(Text("\n".join(lines), style=style), soft_wrap=True)


def warn(message: str) -> None:
    """Print a warning on standard error."""
    note(f"Warning: {message}", style="yellow")


def counted(lines: list[str], most: int = MOST_LINES) -> list[str]:
    """Return the lines to print: all, or the first ones and a last line with the number of the others.

    Examples
    --------
    >>> shown = counted([f"position {n}" for n in range(50)])
    >>> len(shown), shown[-1]
    (25, 'and 26 more')
    """
    return lines if len(lines) <= most else [*lines[: most - 1], f"and {len(lines) - most + 1} more"]


class _Description(ProgressColumn):
    """Description of a progress bar, printed without markup, and shortened so that the bar is one line."""

    def render(self, task: Task) -> Text:
        return Text(shortened(plain(task.description)), no_wrap=True, overflow="ellipsis")


class _Times(ProgressColumn):
    """Elapsed time, and the remaining time if it is known."""

    def render(self, task: Task) -> Text:
        text = str(timedelta(seconds=int(task.elapsed or 0.0)))
        if task.time_remaining:
            text += f", {timedelta(seconds=math.ceil(task.time_remaining))} left"
        return Text(text)


class _Transient(Progress):
    """Progress display that leaves nothing behind, not even an empty line where the output is no terminal."""

    def stop(self) -> None:
        self.live.stop()


PROGRESS_VARIABLE = "EXUGEAR_PROGRESS"
"""Environment variable by which a program that starts a command asks for its progress as lines on standard error."""
PROGRESS_SIGN = "\x1e"
"""First character of such a line; the rest is a JSON object: words, done, total (None if unknown), left (s or None)."""


class _Told(_Transient):
    """Progress as lines for another program instead of a display."""

    _last = ""

    def get_renderable(self) -> RenderableType:
        for task in self.tasks[-1:]:
            row = {"words": task.description, "done": task.completed, "total": task.total, "left": task.time_remaining}
            if (line := json.dumps(row)) != self._last:
                self._last = line
                sys.stderr.write(f"{PROGRESS_SIGN}{line}\n")
                sys.stderr.flush()
        return super().get_renderable()


def progress_bar() -> Progress:
    """Return a progress bar with the remaining time, to be used as a context manager: one line in 80 columns.

    It disappears at its end.
    """
    kind = _Told if os.environ.get(PROGRESS_VARIABLE) else _Transient
    bar, share, times = (Column(no_wrap=True) for _ in range(3))
    return kind(
        _Description(),
        BarColumn(14, table_column=bar),
        TaskProgressColumn(table_column=share),
        _Times(table_column=times),
        console=messages,
        transient=True,
        speed_estimate_period=3600.0,  # work proceeds in bursts, so that only the whole of it indicates the speed
    )


def print_json(summary: Mapping[str, Any]) -> None:
    """Print one JSON object on standard output."""
    sys.stdout.write(json.dumps(summary, indent=2, allow_nan=False) + "\n")


# End of a command: errors that a user can correct, Ctrl-C, and their exit codes

EXIT_FAILED = 1
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130
STOPPING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that request a stop: Ctrl-C, kill, a closed terminal."""


class BadInputError(Exception):
    """Unusable input: nothing was written, and the message states the remedy."""


class FailedError(Exception):
    """The work was started and could not be completed; completed parts are kept."""


class StoppedError(Exception):
    """The user stopped the work; the message states which results are kept and how to resume."""


class Interruption:
    """A remembered Ctrl-C, because Python drops the exception inside finalisers and library callbacks.

    SIGTERM and SIGHUP act as Ctrl-C does. The second Ctrl-C ends the process at once.
    """

    def __init__(self) -> None:
        self._wanted = False

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Remember and raise Ctrl-C inside the context; only the main thread receives it.

        Any error that a library raises after Ctrl-C leaves the context as KeyboardInterrupt.
        """
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        self._wanted = False
        before = {number: signal.getsignal(number) for number in STOPPING}
        for number, handler in before.items():
            if number == signal.SIGINT or handler is not signal.SIG_IGN:  # nohup sets SIGHUP to be ignored
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
        if self._wanted:  # completed results are being stored
            return
        self._wanted = True
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        raise KeyboardInterrupt

    def check(self) -> None:
        """Raise a Ctrl-C that was dropped; long work calls this between its steps."""
        if self._wanted:
            raise KeyboardInterrupt


interruption = Interruption()


@contextmanager
def exit_codes() -> Iterator[None]:
    """Convert errors that the user can correct to one message and an exit code; others keep their traceback.

    The code is 2 after `BadInputError` and for impossible gearboxes or model settings; 1 after `FailedError`, an
    optimisation without a result, and errors in reading and writing; 130 after `StoppedError` and Ctrl-C.
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
        # A message of the program itself already names the file.
        reason = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error)
        end_with("Failed", reason, EXIT_FAILED)
    except MemoryError as error:
        end_with("Failed", f"out of memory ({error})" if str(error) else "out of memory", EXIT_FAILED)
    except Exception as error:
        # Loaded only after an error: a short command needs no compiler.
        from fe_ste.tools.compilation import remove_damaged

        if (folder := remove_damaged(error)) is None:
            raise
        text = f"{folder}: compiled kernels were damaged and have been removed; run the same command again"
        end_with("Failed", text, EXIT_FAILED)


def end_with(what: str, reason: object, code: int) -> NoReturn:
    """Print why the program ends and end it with an exit code."""
    note(f"{what}: {reason}", style="red")
    sys.exit(code)


@contextmanager
def model_errors() -> Iterator[None]:
    """Convert errors of the model to those of the command line, for callers that handle these themselves."""
    try:
        yield
    except Exception as error:
        if not type(error).__module__.startswith("exugear."):
            raise
        # Imported only after an error, because a successful command need not load these modules.
        from exugear.gearbox.reading import GearboxFileError
        from exugear.gearbox.variant import VariantError
        from exugear.steady.harmonics.linear_solvers import HarmonicBalanceError
        from exugear.steady.mean_system.planet_sets import SteadyError
        from exugear.system.bearings.rolling.rows import BearingError
        from exugear.system.statics import BalanceError
        from exugear.system.tooth_mesh.placement import MeshError

        if isinstance(error, (GearboxFileError, VariantError, MeshError, BearingError, SteadyError)):
            raise BadInputError(error) from error
        if isinstance(error, (BalanceError, HarmonicBalanceError)):
            raise FailedError(error) from error
        raise


def not_converged_failure(meshes: Sequence[str]) -> str:
    """Return why results are invalid if meshes interpolate their tables next to non-converged states; empty if none."""
    if not meshes:
        return ""
    return (
        f"invalid: the static state of {', '.join(meshes)} lies next to non-converged table states, values are "
        "interpolated; exugear ste lists the states and reasons"
    )


# Results folders, which commands check before they start


def check_results_folder(folder: Path) -> None:
    """Raise an error for a folder that a command could not write into, without creating it."""
    there = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
    if not there.is_dir():
        raise BadInputError(f"--out {folder}: {there} is not a folder; specify a folder that can be created")
    if not os.access(there, os.W_OK):
        raise BadInputError(f"--out {folder}: {there} is not writable; specify another folder")


def make_results_folder(folder: Path) -> None:
    """Create the folder of results before the work starts, so that a wrong path is reported early."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(f"--out {folder}: {error.strerror}; specify a folder that can be created") from error
    if not os.access(folder, os.W_OK):
        raise BadInputError(f"--out {folder}: not writable; specify another folder")
