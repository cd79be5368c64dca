"""Samples of load put together while they are read: files of any length and number become some ten thousand points.

A point stands for samples whose torques lie within a thousandth of each other (with loads of a hub within a
thirty-second, and an eighth of the range of each of them). Its torque is their mean weighted by revolutions, so that
hours, revolutions and mean of every bin of torque stay as they are. Few samples stay as they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from exugear.life.counting.rainflow import Rainflow, equivalent_range
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import Displayed

HUB_LOADS = 5
"""Loads of a hub beside its torque: force along x, y, z, moment about x and y."""
COMPONENTS = ("torque", "force_x", "force_y", "force_z", "moment_x", "moment_y")
"""Loads of which equivalent ranges are told."""
RANGE_EXPONENTS = (3.0, 6.6, 10.0)
"""Slopes of the S-N curves behind them."""
MOST_POINTS = 100_000
"""Points that are kept as they are."""
HUB_CELLS = 8
"""Cells over the range of each load of a hub."""
FINE, COARSE = 42, 47
"""Bits of a torque that are left out to find its cell: 10 and 5 of its 52 digits stay."""


@dataclass(frozen=True, eq=False)
class Samples(Displayed):
    """Loads that last."""

    torque: Floats
    speed: Floats
    lasting: Floats
    """(samples,) N m, rad/s, and how long each lasts, in a unit of the owner's."""
    hub: Floats
    """(samples, 5) (samples, 0) force along x, y, z and moment about x, y, N and N m; nothing where there are none."""

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.torque)

    def _line(self) -> str:
        return f": {len(self)}"

    def within(self, kept: np.ndarray) -> Samples:
        """Return those of a mask."""
        return Samples(self.torque[kept], self.speed[kept], self.lasting[kept], self.hub[kept])


def together(parts: list[Samples]) -> Samples:
    """Put samples behind each other."""
    names = ("torque", "speed", "lasting", "hub")
    return Samples(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def condensed(samples: Samples, extreme: bool = False) -> Samples:
    """Put samples of one cell together.

    Parameters
    ----------
    extreme : whether the largest loads of a cell stand for it, instead of means weighted by revolutions

    Examples
    --------
    >>> some = Samples(np.array([100.0, 100.01, 250.0]), np.ones(3), np.array([1.0, 3.0, 1.0]), np.zeros((3, 0)))
    >>> condensed(some).torque.round(4).tolist(), condensed(some).lasting.tolist()
    ([100.0075, 250.0], [4.0, 1.0])
    """
    cells = np.ascontiguousarray(samples.torque, dtype=np.float64).view(np.int64) >> (
        COARSE if samples.hub.any() else FINE
    )
    if samples.hub.any():
        span = np.ptp(samples.hub, axis=0)
        inside = (samples.hub - samples.hub.min(axis=0)) / np.where(span > 0.0, span, 1.0)
        for column in np.floor(inside * (HUB_CELLS - 1e-9)).astype(np.int64).T:
            cells = np.unique(cells, return_inverse=True)[1] * HUB_CELLS + column
    number = np.unique(cells, return_inverse=True)[1].ravel()
    if extreme:
        return _largest(samples, number)
    lasting = np.bincount(number, samples.lasting).astype(np.float64)
    weights = np.abs(samples.speed) * samples.lasting
    turns = np.bincount(number, weights).astype(np.float64)
    still = turns == 0.0

    def mean(values: Floats) -> Floats:
        by_time = np.bincount(number, samples.lasting * values) / np.where(lasting > 0.0, lasting, 1.0)
        return np.asarray(np.where(still, by_time, np.bincount(number, weights * values) / np.where(still, 1.0, turns)))

    speed = turns / np.where(lasting > 0.0, lasting, 1.0)
    hub = np.array([mean(column) for column in samples.hub.T]).T.reshape(len(lasting), -1)
    return Samples(mean(samples.torque), speed, lasting, hub)


def _largest(samples: Samples, number: Integers) -> Samples:
    """Largest of each load of a cell, whatever its sign."""

    def largest(values: Floats) -> Floats:
        order = np.lexsort((np.abs(values), number))
        last = np.append(np.diff(number[order]) > 0, True)
        return np.asarray(values[order[last]])

    hub = np.array([largest(column) for column in samples.hub.T]).T
    torque = largest(samples.torque)
    return Samples(torque, largest(samples.speed), np.zeros(len(torque)), hub.reshape(len(torque), -1))


@dataclass(eq=False)
class Pool:
    """Files of one kind whose samples weigh as long as they last."""

    extreme: bool = False
    seconds: float = 0.0
    """Of all files."""
    count: int = 0
    files: int = 0
    """Samples and files."""
    least: float = np.inf
    largest: float = -np.inf
    """Torque, N m."""
    slowest: float = np.inf
    fastest: float = 0.0
    """Speed under a torque without sign, rad/s."""
    _parts: list[Samples] = field(default_factory=list)
    _powers: dict[tuple[str, float], float] = field(default_factory=dict)

    def add(self, samples: Samples) -> None:
        """Take samples of a file."""
        if not len(samples):
            return
        self._parts.append(samples)
        self.count += len(samples)
        self.least = min(self.least, float(samples.torque.min()))
        self.largest = max(self.largest, float(samples.torque.max()))
        loaded = np.abs(samples.speed[samples.torque != 0.0])
        self.slowest = min(self.slowest, float(loaded.min(initial=np.inf)))
        self.fastest = max(self.fastest, float(loaded.max(initial=0.0)))
        if sum(map(len, self._parts)) > 2 * max(MOST_POINTS, len(self._parts[0])):
            self._parts = [condensed(together(self._parts), self.extreme)]

    def merge(self, other: Pool) -> None:
        """Take all that another pool has."""
        parts = other._parts
        count = other.count
        for samples in parts:
            self.add(samples)
        self.count += count - sum(map(len, parts))
        self.least, self.largest = min(self.least, other.least), max(self.largest, other.largest)
        self.slowest, self.fastest = min(self.slowest, other.slowest), max(self.fastest, other.fastest)
        self.seconds += other.seconds
        self.files += other.files
        for key, power in other._powers.items():
            self._powers[key] = self._powers.get(key, 0.0) + power

    def close(self, counts: Mapping[str, Rainflow], seconds: float) -> None:
        """Take what was counted of a file, and how long it is."""
        self.files += 1
        self.seconds += seconds
        for name, count in counts.items():
            ranges, _, cycles = count.cycles()
            for exponent in RANGE_EXPONENTS:
                power = seconds * equivalent_range(ranges, cycles, exponent, seconds) ** exponent
                self._powers[name, exponent] = self._powers.get((name, exponent), 0.0) + power

    def samples(self) -> Samples:
        """Give all samples, put together where they are many."""
        found = together(self._parts)
        if len(found) > MOST_POINTS:
            return condensed(found, self.extreme)
        return found

    def equivalent_ranges(self) -> dict[tuple[str, float], float]:
        """Range of one cycle a second that does the same damage in all files together, by component and slope."""
        return {key: (power / self.seconds) ** (1.0 / key[1]) for key, power in self._powers.items()}
