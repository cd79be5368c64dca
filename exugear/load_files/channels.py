"""Channels over time as a file holds them: names, units, values; one is asked for by name and quantity."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exugear.load_files.units import SI_NAMES, USUAL_NAMES, unit_of
from fe_ste.tools.arrays import Floats

ALIASES: tuple[tuple[str, ...], ...] = (
    ("rottorq", "lsshfttq", "lsshftmxa", "lsshftmxs", "lssgagmxa", "lssgagmxs"),
    ("rotspeed", "lssspeed", "lssgagvxa"),
    ("hsshfttq",),
    ("genspeed", "hssspeed"),
)
"""Channels of OpenFAST that are the same quantity under several names (its list of outputs, ElastoDyn)."""
SHOWN_NAMES = 12
"""Most names that a message lists."""
LEAST_LINES = 3
"""Fewer lines than these are no series."""


class LoadFileError(ValueError):
    """A file of loads that cannot be used: one sentence says file, place and what would be right."""


@dataclass(frozen=True, eq=False)
class Channels:
    """Channels over time.

    Attributes
    ----------
    path : Path
    names, units : tuple of str
        As the file writes them, time left out.
    time : array (steps,)
        s.
    values : array (steps, channels)
        In the units of the file.
    """

    path: Path
    names: tuple[str, ...]
    units: tuple[str, ...]
    time: Floats
    values: Floats

    def __repr__(self) -> str:
        """Return one short line."""
        return f"<Channels of {self.path.name}: {len(self.names)} over {len(self.time)} steps>"

    def __post_init__(self) -> None:
        """Refuse times that do not grow."""
        if len(self.time) < LEAST_LINES:
            raise LoadFileError(f"{self.path}: {len(self.time)} steps of time; at least {LEAST_LINES} make a series")
        bad = np.flatnonzero(~(np.diff(self.time) > 0.0))
        if bad.size:
            raise LoadFileError(f"{self.path}: time does not grow behind step {int(bad[0]) + 1}; each must be later")

    def channel(self, name: str, quantity: str) -> Floats:
        """Values of a channel in SI, (steps,).

        Parameters
        ----------
        name : str
            Capitals do not matter; other names of OpenFAST for the same are found, too.
        quantity : str
            What it must measure: one of `exugear.load_files.units.SI_NAMES`.

        Raises
        ------
        LoadFileError
            No such channel, a unit that is not understood or measures something else, or values that are no numbers.
        """
        place = self._place(name)
        unit = unit_of(self.units[place])
        found = self.names[place]
        if unit is None or unit.quantity != quantity:
            written = self.units[place] or "none"
            raise LoadFileError(
                f"{self.path}: channel {found} has the unit {written!r}, which is no unit of {quantity} known here; "
                f"one such as {USUAL_NAMES[quantity]} ({SI_NAMES[quantity]} in SI) would be"
            )
        values = np.asarray(self.values[:, place] * unit.factor)
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            first = int(bad[0])
            raise LoadFileError(
                f"{self.path}: channel {found} holds no number at {self.time[first]:g} s (step {first + 1}); "
                "every step needs one"
            )
        return values

    def _place(self, name: str) -> int:
        lower = [known.lower() for known in self.names]
        wanted = name.lower()
        same = next((group for group in ALIASES if wanted in group), (wanted,))
        for candidate in (wanted, *same):
            if candidate in lower:
                return lower.index(candidate)
        near = difflib.get_close_matches(wanted, lower, n=3, cutoff=0.5)
        likely = [self.names[lower.index(one)] for one in near] or list(self.names[:SHOWN_NAMES])
        raise LoadFileError(
            f"{self.path}: no channel {name!r}; "
            f"{'names like it are' if near else 'its channels are'} {', '.join(likely)}"
        )
