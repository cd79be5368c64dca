"""Worker processes that end with the process that started them.

This module loads no library: a worker watches over that process before it loads what it works with.
"""

from __future__ import annotations

import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Event
from types import TracebackType


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


class StoppedError(RuntimeError):
    """The process that started a worker wants its result no more."""


def stop_if_asked() -> None:
    """End the work of a worker whose result is wanted no more; calls that take long ask between their steps."""
    if _asked is not None and _asked.is_set():
        raise StoppedError


_asked: Event | None = None


def _begin(lifeline: Connection, asked: Event) -> None:
    """Prepare a worker; signals of the terminal are for the process that started it."""
    global _asked
    _asked = asked
    for name in ("SIGINT", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()


def _end_with(lifeline: Connection) -> None:
    with suppress(EOFError, OSError):
        lifeline.recv_bytes()  # nothing is ever sent
    os._exit(1)
