"""What an import remembers beside the values: assumptions, checks, what was left out, all written into the file."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from exugear.rexs.faults import Faults, RexsError

ASSUMED = "A"
DERIVED = "D"


@dataclass(frozen=True)
class Entry:
    """A value of the gearbox file, and where it comes from.

    Attributes
    ----------
    value : Any
        As TOML has it.
    source : str
        Component and attribute that give it; for one that is derived or assumed how.
    kind : str
        Empty as read, `DERIVED` or `ASSUMED`.
    """

    value: Any
    source: str = ""
    kind: str = ""

    @property
    def comment(self) -> str:
        """Comment after the value."""
        return f"{self.kind}   {self.source}" if self.kind else self.source


def read(value: Any, source: str) -> Entry:
    """Value that stands in the REXS file."""
    return Entry(value, source)


def derived(value: Any, source: str) -> Entry:
    """Value that follows from what stands there."""
    return Entry(value, source, DERIVED)


def assumed(value: Any, source: str) -> Entry:
    """Value that the file does not give."""
    return Entry(value, source, ASSUMED)


@dataclass
class Notes:
    """Lines gathered on the way.

    Attributes
    ----------
    faults : Faults
        Why the file cannot be imported.
    changed : list of str
        Values of the file that were replaced, and assumptions that matter.
    checked : list of str
        Comparisons of what the file says twice.
    ignored : list of str
        What the file holds and the gearbox file does not.
    """

    faults: Faults = field(default_factory=Faults)
    changed: list[str] = field(default_factory=list)
    checked: list[str] = field(default_factory=list)
    ignored: list[str] = field(default_factory=list)


def tidy(value: float) -> float:
    """Return a number without the last digits, which arithmetic made; never minus zero.

    Examples
    --------
    >>> tidy(16.799999999999997), tidy(-0.0)
    (16.8, 0.0)
    """
    return float(f"{value:.12g}") + 0.0


def needed(value: float | None, part: object, key: str) -> float:
    """Return the value, or say that it is missing.

    Raises
    ------
    RexsError
        There is none.
    """
    if value is None:
        raise RexsError(f"{part}: {key} is missing")
    return value


@dataclass
class Block:
    """Table of the gearbox file with its entries and the tables inside it.

    Attributes
    ----------
    comment : str
        After its head: the component that it stands for.
    entries : dict of str to Entry
    blocks : dict of str to Block
    """

    comment: str = ""
    entries: dict[str, Entry] = field(default_factory=dict)
    blocks: dict[str, Block] = field(default_factory=dict)
