"""The process of the command line: standard streams that may be closed, and libraries that are not loaded."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO

from exugear.cli.console import EXIT_FAILED, end_with

# Standard streams that may be closed, full or no longer read: the work continues, and the exit code indicates it

EXIT_UNREAD = 141
"""Exit code of programs whose reader, such as ``head``, has closed the pipe."""


class _Stream(io.TextIOWrapper):
    """Standard stream that drops further output after a failed write and keeps the failure, so that work continues."""

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
    """Complete the work although its output cannot be written, and indicate that by the exit code.

    The code is 141, without a message, if the reader of standard output has closed the pipe, and 1 with a message if
    the output is full or closed. Text that cannot be written to standard error is dropped.
    """
    # Closed streams are replaced, so that no other file receives their descriptors and the output sent to them.
    for number, mode in enumerate((os.O_RDONLY, os.O_RDONLY, os.O_WRONLY)):  # writing to standard output fails
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, mode)  # uses the lowest free descriptor, which is this one
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


def _lasting(stream: TextIO | None, number: int) -> TextIO:
    """Return a stream that replaces Python's own one, or the missing one if that was closed."""
    if stream is None:
        return _Stream(open(number, "wb", closefd=False), encoding="utf-8", line_buffering=True)
    if not isinstance(stream, io.TextIOWrapper):
        return stream
    return _Stream(stream.buffer, stream.encoding, stream.errors, None, stream.line_buffering, stream.write_through)


# Optional libraries that commands do not need: Dask, which xarray loads with the first dataset if it is installed

_modules: dict[str, Any] = sys.modules


def leave_out_dask() -> None:
    """Hide Dask from imports, which saves half a second per command; no command uses its arrays."""
    _modules.setdefault("dask", None)


def let_in_dask() -> None:
    """Make Dask importable again, for work on its clusters."""
    if _modules.get("dask", ...) is None:
        del _modules["dask"]
