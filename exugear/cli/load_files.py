"""Files of loads, read behind a progress bar."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from exugear.cli.console import progress_bar
from exugear.cli.errors import interruption


@contextmanager
def files_bar() -> Iterator[Callable[[int, int], None]]:
    """Show how many files are read; give what is to be told the number of those that are, and of all."""
    with progress_bar() as bar:
        task = bar.add_task("files of loads", total=None, visible=False)

        def show(done: int, total: int) -> None:
            interruption.check()
            bar.update(task, completed=done, total=total, visible=total > 1)

        yield show
