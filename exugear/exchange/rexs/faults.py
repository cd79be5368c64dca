"""Faults of a REXS file: one clear sentence each, told all at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from fe_ste.tools.display import Displayed

SHOWN_FAULTS = 20
"""Most faults that one message shows."""
LONGEST_TEXT = 80
"""Characters of a file's text that a message or comment shows."""


class RexsError(ValueError):
    """A REXS file that cannot be read or imported.

    Attributes
    ----------
    faults : tuple of str
        All of them, a sentence each; the message shows the first `SHOWN_FAULTS`.
    """

    def __init__(self, *faults: str) -> None:
        self.faults = tuple(dict.fromkeys(faults))
        more = len(self.faults) - SHOWN_FAULTS
        many = "s" if more > 1 else ""
        rest = [f"and {more} more fault{many}"] if more > 0 else []
        super().__init__("\n".join([*self.faults[:SHOWN_FAULTS], *rest]))


class Faults(Displayed, line=": {_found!n}"):
    """Faults gathered over several attempts."""

    def __init__(self) -> None:
        self._found: list[str] = []

    def add(self, sentence: str) -> None:
        """Keep a fault."""
        self._found.append(sentence)

    @contextmanager
    def gathered(self) -> Iterator[None]:
        """Keep the faults that end what is tried inside the context."""
        try:
            yield
        except RexsError as error:
            self._found += error.faults

    def of_each(self, attempts: Iterator[Callable[[], object]]) -> None:
        """Try all and keep the faults of each."""
        for attempt in attempts:
            with self.gathered():
                attempt()

    def tell(self) -> None:
        """End here if there are any.

        Raises
        ------
        RexsError
            All faults so far.
        """
        if self._found:
            raise RexsError(*self._found)


def plain(text: object, longest: int = LONGEST_TEXT) -> str:
    r"""Text of a file as messages and comments show it: one line, printable, not too long.

    Examples
    --------
    >>> plain("Planetenrad\n [54]\x07"), plain("x" * 20, 10)
    ('Planetenrad [54]', 'xxxxxxxxx…')
    """
    words = "".join(sign if sign.isprintable() else " " for sign in str(text)[: 4 * longest]).split()
    line = " ".join(words).encode("utf-8", errors="replace").decode("utf-8")
    if len(line) <= longest:
        return line
    return f"{line[: longest - 1]}…"
