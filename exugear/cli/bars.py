"""What long work shows on standard error: rows with the time left, all of them in one display."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from exugear.cli.console import progress_bar
from exugear.cli.errors import interruption

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


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
        from fe_ste.transmission_error.known_contacts import contacts_told

        contacts = Row(self)

        def solved(done: int, total: int) -> None:
            contacts(f"contact of teeth where gears stand: {done} of {total}", done, total)

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
            row("files of loads", done, total)

    return show
