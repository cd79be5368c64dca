"""How the command line ends: errors that a user can act on, Ctrl-C, and the exit codes of both."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

from exugear.cli.console import note

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
        end_with("Stopped", "finished results are kept; the same command goes on from there", EXIT_INTERRUPTED)
    except OSError as error:
        end_with("Failed", _of_a_file(error), EXIT_FAILED)
    except MemoryError as error:
        end_with("Failed", f"out of memory ({error})" if str(error) else "out of memory", EXIT_FAILED)


def _of_a_file(error: OSError) -> str:
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
    from exugear.gearbox.reading import CaseError
    from exugear.gearbox.variant import VariantError
    from exugear.steady.harmonics.krylov import HarmonicBalanceError
    from exugear.steady.mean_system.rotating_frame import SteadyError
    from exugear.system.bearings.rolling.rows import BearingError
    from exugear.system.statics import BalanceError
    from exugear.system.tooth_mesh.placement import MeshError

    if isinstance(error, (CaseError, VariantError, MeshError, BearingError, SteadyError)):
        return BadInputError(error)
    if isinstance(error, (BalanceError, HarmonicBalanceError)):
        return FailedError(error)
    return None
