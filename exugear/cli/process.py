"""The process of the command line: standard streams that may be closed, libraries that are not wanted."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO

from exugear.cli.console import EXIT_FAILED, end_with

# Standard streams that may be closed, full or no longer read: the work goes on, and the exit code tells

EXIT_UNREAD = 141
"""As of any program whose reader, such as ``head``, has read enough."""


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
            end_with("Failed", f"standard output: {failure.strerror}", EXIT_FAILED)
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


# Libraries that are installed and not wanted: Dask, which xarray loads with the first data set if it is there

_modules: dict[str, Any] = sys.modules


def leave_out_dask() -> None:
    """Let Dask look as if it were not installed: half a second of each verb, none of which has an array of it."""
    _modules.setdefault("dask", None)


def let_in_dask() -> None:
    """Let Dask be found again, by what sends work to its clusters."""
    if _modules.get("dask", ...) is None:
        del _modules["dask"]
