"""Progress of long work on standard error: rows with the remaining time, all in one display."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

from rich.progress import Progress, TaskID

from exugear.cli.console import interruption, progress_bar
from fe_ste.transmission_error.mean_contact import contacts_told


class ProgressRow:
    """Progress of one kind of work: text, completed amount, remaining time. It is visible from the first call."""

    def __init__(self, bars: Bars) -> None:
        self._bars = bars
        self._task: TaskID | None = None

    def __call__(self, words: str, done: float | None = None, total: float | None = None) -> None:
        """Show a text and, if known, the completed and the total amount; raise KeyboardInterrupt after Ctrl-C."""
        interruption.check()
        display = self._bars.display()
        if self._task is None:
            self._task = display.add_task(words, total=total)
        display.update(self._task, description=words, completed=done, total=total)


class Bars:
    """Rows of all current work; nested work adds a row to the existing display."""

    def __init__(self) -> None:
        self._outermost: ExitStack | None = None
        self._display: Progress | None = None

    @contextmanager
    def row(self) -> Iterator[ProgressRow]:
        """Yield a row for work inside the context; tooth contact computed there has its own row."""
        contacts = ProgressRow(self)

        def solved(done: int, total: int) -> None:
            contacts(f"tooth contact at the static load: {done} of {total}", done, total)

        with ExitStack() as own:
            if self._outermost is None:
                self._outermost = own
                own.callback(self._forget)
            own.enter_context(contacts_told(solved))
            yield ProgressRow(self)

    def display(self) -> Progress:
        """Return the display of all rows; it closes with the outermost context."""
        if self._display is None:
            assert self._outermost is not None, "a row is shown inside its context"
            self._display = self._outermost.enter_context(progress_bar())
        return self._display

    def _forget(self) -> None:
        self._outermost = self._display = None


def files_read(row: ProgressRow) -> Callable[[int, int], None]:
    """Return a function that shows the number of load files read and of all; a single file has no row."""

    def show(done: int, total: int) -> None:
        interruption.check()
        if total > 1:
            row("load files", done, total)

    return show
