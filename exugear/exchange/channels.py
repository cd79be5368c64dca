"""Channels of a load file over time: names and units are read at once, values in blocks on demand."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from exugear.gearbox.units import Unit, unit_of
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin

SI_NAMES = {"torque": "N m", "force": "N", "speed": "rad/s", "time": "s", "angle": "rad", "velocity": "m/s"}
USUAL_NAMES = {"torque": "kN-m", "force": "kN", "speed": "rpm", "time": "s", "angle": "deg", "velocity": "m/s"}
"""Units that a message states as examples."""
ALIASES: tuple[tuple[str, ...], ...] = (
    ("rottorq", "lsshfttq", "lsshftmxa", "lsshftmxs", "lssgagmxa", "lssgagmxs"),
    ("rotspeed", "lssspeed", "lssgagvxa"),
    ("hsshfttq",),
    ("genspeed", "hssspeed"),
)
"""Channels of OpenFAST that are the same quantity under several names (its list of outputs, ElastoDyn)."""
SHOWN_NAMES = 12
"""Maximum number of names that a message lists."""
LEAST_LINES = 3
"""Minimum number of rows of a time series."""
GAP = 50.0
"""Largest permitted gap of a long series, in usual time steps; values would be interpolated across a gap."""
LONG_SERIES = 200
"""Number of steps from which a series is assumed to come from a program or recorder with uniform steps."""

Read = Callable[[tuple[int, ...]], Iterator[tuple[Floats, Floats]]]
"""Function that yields blocks of a file for some of its columns: time (n,) and values (n, columns), in the units of the
file.
"""


class LoadFileError(ValueError):
    """An unusable load file; the message states file, position and remedy in one sentence."""


@dataclass(frozen=True, eq=False)
class Channels(ReprMixin):
    """Channels over time."""

    path: Path
    names: tuple[str, ...]
    units: tuple[str, ...]
    """Units as written in the file, without that of time."""
    time_unit: str
    """Unit of time as written in the file; seconds if there is none."""
    read: Read
    """Function that reads blocks of the file for some of its columns."""

    def _line(self) -> str:
        return f" of {self.path.name}: {', '.join(self.names[:SHOWN_NAMES])}"

    @cached_property
    def time(self) -> Floats:
        """Times of all steps, s."""
        return np.concatenate([time for time, _ in self.blocks(())])

    @cached_property
    def values(self) -> Floats:
        """All channels of all steps (steps, channels), in the units of the file."""
        return np.concatenate([values for _, values in self.read(tuple(range(len(self.names))))])

    def channel(self, name: str, quantity: str) -> Floats:
        """Values of a channel in SI, (steps,).

        Parameters
        ----------
        name : name in upper or lower case; OpenFAST's other names of the quantity are found as well
        quantity : required quantity: one of `SI_NAMES`

        Raises
        ------
        LoadFileError
            As in `blocks`.
        """
        return np.concatenate([values[:, 0] for _, values in self.blocks([(name, quantity)])])

    def blocks(self, wanted: Sequence[tuple[str, str]]) -> Iterator[tuple[Floats, Floats]]:
        """Yield time (s) and channels by name and quantity (SI) in blocks, (n,) and (n, channels), to save memory.

        Raises
        ------
        LoadFileError
            A channel does not exist, its unit is unknown or of another quantity, values are not numbers, or times do
            not increase or have a gap.
        """
        places = tuple(self._place(name) for name, _ in wanted)
        units = [self._unit(place, quantity) for place, (_, quantity) in zip(places, wanted, strict=True)]
        factors = np.array([unit.factor for unit in units])
        clock = unit_of(self.time_unit.strip("() []") or "s", any_case=True)
        if clock is None or clock.quantity != "time":
            raise LoadFileError(f"{self.path}: time has the unit {self.time_unit!r}; expected s, ms, min or h")
        steps = _Steps(self.path)
        for time, values in self.read(places):
            instants = clock.factor * time
            steps.check(instants)
            found = values * factors
            bad = np.argwhere(~np.isfinite(found))
            if bad.size:
                row, column = bad[0].tolist()
                raise LoadFileError(
                    f"{self.path}: channel {self.names[places[column]]} has no number at {instants[row]:g} s (step "
                    f"{steps.count - len(time) + row + 1}); correct the file"
                )
            yield instants, found
        if steps.count < LEAST_LINES:
            raise LoadFileError(f"{self.path}: {steps.count} time steps; at least {LEAST_LINES} are required")

    def _unit(self, place: int, quantity: str) -> Unit:
        unit = unit_of(self.units[place], any_case=True)
        if unit is None or unit.quantity != quantity:
            written = self.units[place] or "none"
            raise LoadFileError(
                f"{self.path}: channel {self.names[place]} has the unit {written!r}, which is not a known unit of "
                f"{quantity}; expected one such as {USUAL_NAMES[quantity]} ({SI_NAMES[quantity]} in SI)"
            )
        return unit

    def _place(self, name: str) -> int:
        lower = [known.lower() for known in self.names]
        wanted = name.lower()
        same = next((group for group in ALIASES if wanted in group), (wanted,))
        for candidate in (wanted, *same):
            if candidate in lower:
                return lower.index(candidate)
        raise LoadFileError(f"{self.path}: no channel {name!r}; {channels_like(name, self.names)}")


def channels_like(name: str, known: Sequence[str]) -> str:
    """Return the channels of a file with a similar name in words, or else its first channels.

    Examples
    --------
    >>> channels_like("Torque", ["RotTorq", "RotSpeed"]), channels_like("x", ["RotTorq", "RotSpeed"])
    ('names like it are RotTorq', 'its channels are RotTorq, RotSpeed')
    """
    lower = [own.lower() for own in known]
    near = difflib.get_close_matches(name.lower(), lower, n=3, cutoff=0.5)
    likely = [known[lower.index(own)] for own in near] or known[:SHOWN_NAMES]
    return f"{'names like it are' if near else 'its channels are'} {', '.join(likely)}"


@dataclass
class _Steps:
    """Check of the time steps, block by block."""

    path: Path
    count: int = 0
    last: float | None = None
    usual: float = 0.0

    def check(self, time: Floats) -> None:
        before = time if self.last is None else np.concatenate([[self.last], time])
        first = self.count if self.last is not None else 1
        steps = np.diff(before)
        bad = np.flatnonzero(~(steps > 0.0))
        if bad.size:
            raise LoadFileError(f"{self.path}: time does not increase after step {first + int(bad[0])}")
        if not self.usual and len(steps) >= LONG_SERIES:
            self.usual = float(np.median(steps))
        if self.usual:
            gap = np.flatnonzero(steps > GAP * self.usual)
            if gap.size:
                place = int(gap[0])
                raise LoadFileError(
                    f"{self.path}: no samples between {before[place]:g} and {before[place + 1]:g} s (after step "
                    f"{first + place}), where steps are {self.usual:g} s: a dropout; fill it, or split the file"
                )
        self.count += len(time)
        self.last = float(time[-1]) if len(time) else self.last
