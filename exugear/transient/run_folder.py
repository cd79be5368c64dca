"""The folder of a run: one process at a time, and nothing lost."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from exugear.results.pieces import has_pieces
from exugear.results.run_file import EARLIER_PARTIAL_NAME, FINAL_NAME, PARTIAL_NAME, load_run
from fe_ste.tools.files import FileError, exclusive

LOCK_NAME = "run.partial.lock"


@contextmanager
def held(directory: Path) -> Iterator[None]:
    """Keep a run to this process; the lock ends with the process, however that ends.

    Raises
    ------
    FileError
        Another process is at work on the run.
    """
    with exclusive(directory / LOCK_NAME, f"the run {directory}"):
        yield


def refuse_if_busy(directory: Path) -> None:
    """Raise what `simulate` would raise if another process is at work on a run; change nothing."""
    if (directory / LOCK_NAME).exists():
        with held(directory):
            pass


def refuse_to_resume(directory: Path) -> str:
    """Why a run cannot be gone on with; empty if it can."""
    if has_pieces(directory / PARTIAL_NAME):
        return ""
    if (directory / EARLIER_PARTIAL_NAME).exists():
        return f"{directory / EARLIER_PARTIAL_NAME}: was written by an earlier version, which cannot be gone on with"
    if (directory / FINAL_NAME).exists():
        try:
            load_run(directory / FINAL_NAME, ())
        except FileError as error:
            return str(error)
        return f"{directory / FINAL_NAME}: is complete, nothing was stopped"
    return f"{directory}: no run of these choices was stopped here"
