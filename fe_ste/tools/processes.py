"""Processes beside this one: workers that end with it, and forks of it that share the work on many items.

A worker is started afresh and loads its own libraries; what it computes is sent to it. A fork has all that this process
has, at once and without a copy, so that items of a few milliseconds are worth it. Forks exist on Linux alone: elsewhere
libraries of the system do not stand being forked.

This module loads no library: a worker monitors the process that started it before it loads its own libraries.
"""

from __future__ import annotations

import ctypes
import logging
import os
import signal
import sys
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Event
from types import TracebackType
from typing import Any, NamedTuple, TypeVar

from fe_ste.tools.threads import available_cores, second_core_is_free

Item = TypeVar("Item")
Result = TypeVar("Result")

#: Seconds of work for which a fork is worth its start.
_WORTH_A_FORK = 0.1
#: Seconds of work that are sent to a fork together: each sending takes a millisecond.
_SENT_AT_ONCE = 0.03


class _Inherited(NamedTuple):
    """What a fork has from the process that started it."""

    lifeline: Connection
    """The end that this process holds: a fork that kept it would never see it closed."""
    function: Callable[[Any], Any]


class Workers(ProcessPoolExecutor):
    """Worker processes on a lifeline: a pipe that the system closes when the process that started them ends.

    An exception that leaves the ``with`` of the executor drops what waits, and stops what asks `stop_if_asked`.

    Notes
    -----
    Workers are started afresh, not forked: a script that uses them needs the usual ``if __name__ == "__main__":``.
    """

    def __init__(self, workers: int = 2) -> None:
        context = get_context("spawn")
        watched, self._lifeline = context.Pipe(duplex=False)
        self._stop = context.Event()
        super().__init__(workers, mp_context=context, initializer=_begin, initargs=(watched, self._stop))

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None:
        """Wait for what was submitted; after an error drop and stop it."""
        if error is not None:
            self._stop.set()
            self.shutdown(cancel_futures=True)
        return super().__exit__(kind, error, trace)


class WorkerStoppedError(RuntimeError):
    """The process that started a worker wants its result no more."""


def stop_if_asked() -> None:
    """End the work of a worker whose result is wanted no more; calls that take long ask between their steps."""
    if _asked is not None and _asked.is_set():
        raise WorkerStoppedError


_asked: Event | None = None


def _begin(lifeline: Connection, asked: Event) -> None:
    """Prepare a worker; signals of the terminal are for the process that started it."""
    global _asked
    _asked = asked
    _live_on(lifeline)


def _live_on(lifeline: Connection) -> None:
    for name in ("SIGINT", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()


def _end_with(lifeline: Connection) -> None:
    with suppress(EOFError, OSError):
        lifeline.recv_bytes()  # nothing is ever sent
    os._exit(1)


def each_in_forks(function: Callable[[Item], Result], items: Iterable[Item]) -> Generator[Result, None, None]:
    """Call a function for each item on all cores and yield the results in the order of the items.

    This process computes the first two items, which loads what the function needs and shows how long an item takes.
    Forks compute the others where that saves time. Where they cannot be started or are lost, in a worker, in a fork and
    on other systems than Linux, this process computes them.
    Results are the same to the bit. The function must not print, log or change anything but its result.

    Raises
    ------
    Exception
        That of the function for one of the next items.

    Examples
    --------
    >>> list(each_in_forks(abs, [-1, 2, -3]))
    [1, 2, 3]
    """
    waiting = deque(items)
    took = 0.0
    for _ in range(min(2, len(waiting))):
        begin = time.perf_counter()
        result = function(waiting.popleft())
        took = time.perf_counter() - begin
        yield result
    count = min(available_cores(), len(waiting), int(took * len(waiting) / _WORTH_A_FORK))
    if count > 1 and sys.platform == "linux" and second_core_is_free():
        at_once = max(1, min(int(_SENT_AT_ONCE / took), len(waiting) // (4 * count)))
        # The system may end a fork for its memory, or have no process or semaphore left: items without a result wait.
        with suppress(BrokenExecutor, OSError, NotImplementedError), _Forks(count, function) as forks:
            left = list(waiting)
            futures = deque(forks.submit_all([left[n : n + at_once] for n in range(0, len(left), at_once)]))
            while futures:
                for found in futures.popleft().result():
                    waiting.popleft()
                    yield found
    yield from map(function, waiting)


class _Forks(ProcessPoolExecutor):
    """Forks of this process, on a lifeline; an error that leaves the ``with`` ends them at once."""

    def __init__(self, count: int, function: Callable[[Any], Any]) -> None:
        context = get_context("fork")
        watched, self._lifeline = context.Pipe(duplex=False)
        inherited = _Inherited(self._lifeline, function)
        super().__init__(count, mp_context=context, initializer=_begin_fork, initargs=(watched, inherited))

    def submit_all(self, parts: Iterable[list[Any]]) -> list[Any]:
        """Let the forks call the function for each item of some parts."""
        with warnings.catch_warnings():
            # Python 3.12 and later warn of locks that other threads hold: forks use none that this process may share.
            warnings.simplefilter("ignore", DeprecationWarning)
            return [self.submit(_call, part) for part in parts]

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None:
        """End the forks."""
        if error is not None:
            self._lifeline.close()
            self.shutdown(cancel_futures=True)
        return super().__exit__(kind, error, trace)


#: Numbers of parameters of the C library's `mallopt`, from its header.
_TRIM_THRESHOLD, _MMAP_MAX = -1, -4

_inherited: _Inherited | None = None


def _begin_fork(watched: Connection, inherited: _Inherited) -> None:
    """Prepare a fork, which must not wait for a lock on an output that another thread of this process held."""
    global _inherited
    _inherited = inherited
    inherited.lifeline.close()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    with suppress(AttributeError):  # a C library without it
        # Each item allocates what the one before it freed. New pages for it cost a quarter of the time.
        set_option = ctypes.CDLL(None).mallopt
        set_option(_MMAP_MAX, 0)
        set_option(_TRIM_THRESHOLD, 2**31 - 1)
    logging.disable()
    sys.stdout = sys.stderr = open(os.devnull, "w")  # noqa: SIM115 - as long as the fork lives
    _live_on(watched)


def _call(items: list[Any]) -> list[Any]:
    assert _inherited is not None
    return [_inherited.function(item) for item in items]
