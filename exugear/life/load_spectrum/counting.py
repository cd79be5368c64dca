"""Load duration distributions: how long, and for how many revolutions, a load lies in each of its bins.

For whatever turns through its load, such as teeth and roller bearings, revolutions at a load are its cycles. Loads of
either sign have bins of their own, since they press on other flanks.

For what does not turn through its load: housings, arms, pins, splines, couplings.
"""

from __future__ import annotations

import itertools
from array import array
from dataclasses import dataclass

import numpy as np

from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import ReprMixin


@dataclass(frozen=True, eq=False)
class DurationDistribution(ReprMixin):
    """Hours and revolutions over bins of torque; empty bins are left out."""

    lower: Floats
    upper: Floats
    """(bins,) edges, N m, by size: the upper one is farther from zero; both have the sign of the torque."""
    torque: Floats
    """(bins,) mean of what lies in the bin, each instant weighted by its revolutions, N m."""
    hours: Floats
    revolutions: Floats
    """(bins,) of the shaft whose torque it is."""

    def _line(self) -> str:
        return f": {len(self.hours)} bins, {self.hours.sum():.6g} h"

    @property
    def speed(self) -> Floats:
        """Mean speed of each bin, rad/s, without sign."""
        seconds = 3600.0 * self.hours
        return np.divide(2.0 * np.pi * self.revolutions, seconds, out=np.zeros_like(seconds), where=seconds > 0.0)

    def torques(self, value: str) -> Floats:
        """Torque that stands for each bin: its ``mean``, or its ``upper`` edge, which adds damage."""
        if value == "upper":
            return self.upper
        return self.torque


def load_duration(
    torque: Floats, speed: Floats, hours: Floats, bins: int, largest: float | None = None
) -> DurationDistribution:
    """Sort samples of torque into bins of equal width, from zero to the largest.

    Parameters
    ----------
    torque, speed, hours : (samples,) N m, rad/s, and how long each sample lasts in the whole of the life
    bins : bins of either sign
    largest : torque at which the last bin ends, N m, where the samples stand for larger ones; their largest by default

    Examples
    --------
    An hour at 100 N m and one at 40 N m, half as fast:

    >>> found = load_duration(np.array([100.0, 40.0]), np.array([2.0, 1.0]), np.ones(2), 10)
    >>> found.torque.tolist(), found.hours.tolist(), (found.revolutions[1] / found.revolutions[0]).round(6).item()
    ([40.0, 100.0], [1.0, 1.0], 2.0)
    """
    width = (float(np.abs(torque).max(initial=0.0)) if largest is None else largest) / bins or 1.0
    place = np.minimum(np.floor(np.abs(torque) / width).astype(int), bins - 1) + 1
    place = np.where(torque < 0.0, -place, place)  # a torque of zero counts as positive
    turns = np.abs(speed) * hours * 3600.0 / (2.0 * np.pi)
    numbers, inverse = np.unique(place, return_inverse=True)
    total_hours = np.bincount(inverse, hours).astype(np.float64)
    revolutions = np.bincount(inverse, turns).astype(np.float64)
    by_turns = np.bincount(inverse, turns * torque) / np.where(revolutions > 0.0, revolutions, 1.0)
    by_hours = np.bincount(inverse, hours * torque) / np.where(total_hours > 0.0, total_hours, 1.0)
    sense = np.sign(numbers)
    return DurationDistribution(
        lower=sense * (np.abs(numbers) - 1) * width,
        upper=sense * np.abs(numbers) * width,
        torque=np.where(revolutions > 0.0, by_turns, by_hours),
        hours=total_hours,
        revolutions=revolutions,
    )


@dataclass(frozen=True, eq=False)
class LoadPoints(ReprMixin):
    """Torques with what acts beside them: the bins of a distribution, split where other loads differ."""

    torque: Floats
    """(points,) N m."""
    other: Floats
    """(points, n) loads beside it, means weighted by revolutions."""
    hours: Floats
    revolutions: Floats
    """(points,)"""
    bin: Integers
    """(points,) bin of the distribution that each point lies in."""

    def _line(self) -> str:
        return f": {len(self.hours)} points, {self.hours.sum():.6g} h"

    @property
    def speed(self) -> Floats:
        """Mean speed of each point, rad/s, without sign."""
        seconds = 3600.0 * self.hours
        return np.divide(2.0 * np.pi * self.revolutions, seconds, out=np.zeros_like(seconds), where=seconds > 0.0)


def load_points(
    distribution: DurationDistribution,
    value: str,
    torque: Floats,
    speed: Floats,
    hours: Floats,
    other: Floats,
    cells: int,
) -> LoadPoints:
    """Split the bins of a distribution by other loads.

    Parameters
    ----------
    found : DurationDistribution
        Of the same samples.
    value : as in `DurationDistribution.torques`
    torque, speed, hours : (samples,) as in `load_duration`
    other : (samples, n) loads beside the torque
    cells : cells from the least to the largest of each of them
    """
    torques = distribution.torques(value)
    if not other.any():
        zeros = np.zeros((len(torques), other.shape[1]))
        return LoadPoints(torques, zeros, distribution.hours, distribution.revolutions, np.arange(len(torques)))
    width = float(np.abs(distribution.upper - distribution.lower)[0])
    side = np.where(torque < 0.0, -1.0, 1.0)
    place = side * np.minimum(
        np.floor(np.abs(torque) / width), np.round(np.abs(distribution.upper).max() / width) - 1.0
    )
    number = np.argmin(
        np.abs((side * width * (np.abs(place) + 0.5))[:, None] - 0.5 * (distribution.lower + distribution.upper)),
        axis=1,
    )
    span = np.ptp(other, axis=0)
    cell = np.floor((other - other.min(axis=0)) / np.where(span > 0.0, span, 1.0) * (cells - 1e-9))
    keys, inverse = np.unique(np.column_stack([number, cell]), axis=0, return_inverse=True)
    inverse = inverse.ravel()
    turns = np.abs(speed) * hours * 3600.0 / (2.0 * np.pi)
    total = np.bincount(inverse, turns).astype(np.float64)
    means = [np.bincount(inverse, turns * column) / np.where(total > 0.0, total, 1.0) for column in other.T]
    bins = keys[:, 0].astype(np.int64)
    lasting = np.bincount(inverse, hours).astype(np.float64)
    return LoadPoints(torques[bins], np.array(means).T, lasting, total, bins)


def equivalent_load(load: Floats, cycles: Floats, exponent: float) -> float:
    """Constant load that does the same damage in as many cycles, by Miner's rule with one slope.

    Parameters
    ----------
    load : taken without sign
    exponent : slope of the S-N curve

    Examples
    --------
    >>> equivalent_load(np.array([0.0, 2.0]), np.array([7.0, 1.0]), 3.0)
    1.0
    """
    largest = float(np.abs(load).max(initial=0.0))
    total = float(np.sum(cycles))
    if largest == 0.0 or total == 0.0:
        return 0.0
    damage = float(np.sum(cycles * np.abs(load / largest) ** exponent)) / total
    return float(largest * damage ** (1.0 / exponent))


# Rainflow counting of ASTM E1049, and the constant cycle that does the same damage

_AT_ONCE = 100_000
"""Turning points that are Python's numbers at once."""
NOISE = 1e-3
"""Share of the largest range below which a range is that of the resolution of packed files, and left out."""


def reversals(series: Floats) -> Floats:
    """Find the turning points of a series, its ends among them.

    Examples
    --------
    >>> reversals(np.array([0.0, 1.0, 1.0, 2.0, -1.0])).tolist()
    [0.0, 2.0, -1.0]
    """
    steps = np.diff(series)
    kept = np.append(True, steps != 0.0)
    points = np.asarray(series)[kept]
    slopes = np.sign(np.diff(points))
    inner = np.flatnonzero(slopes[1:] != slopes[:-1]) + 1
    return np.asarray(points[np.unique(np.concatenate([[0], inner, [len(points) - 1]]))])


class Rainflow(ReprMixin):
    """Cycles of a series that comes in pieces, counted as `rainflow` counts them; the series itself is not kept.

    Examples
    --------
    >>> count = Rainflow()
    >>> for piece in ([-2.0, 1.0, -3.0, 5.0, -1.0], [3.0, -4.0, 4.0, -2.0]):
    ...     count.add(np.array(piece))
    >>> count
    <Rainflow: 4 cycles closed, 3 turning points open>
    >>> sorted(set(count.cycles()[0].tolist()))
    [3.0, 4.0, 6.0, 8.0, 9.0]
    """

    def __init__(self) -> None:
        self._open: list[float] = []
        self._closed = array("d")  # range, mean and count, one after the other
        self._tail = np.zeros(0)

    def _line(self) -> str:
        return f": {len(self._closed) // 3} cycles closed, {len(self._open)} turning points open"

    def add(self, piece: Floats) -> None:
        """Take the next piece of the series."""
        if not len(piece):
            return
        points = reversals(np.concatenate([self._tail, piece]))
        begun = len(self._tail) > 1  # its first point is a turning point that was taken
        for begin in range(int(begun), len(points) - 1, _AT_ONCE):
            for point in points[begin : min(begin + _AT_ONCE, len(points) - 1)].tolist():
                _take(point, self._open, self._closed)
        self._tail = points[-2:]

    def cycles(self) -> tuple[Floats, Floats, Floats]:
        """Ranges, means and counts of all cycles, (cycles,) each; what is open counts as half cycles."""
        stack = list(self._open)
        closed = array("d", self._closed)
        if len(self._tail):
            _take(float(self._tail[-1]), stack, closed)
        for one, other in itertools.pairwise(stack):
            closed.extend((abs(other - one), 0.5 * (one + other), 0.5))
        table = np.frombuffer(closed, dtype=np.float64).reshape(-1, 3)
        return table[:, 0], table[:, 1], table[:, 2]


def _take(point: float, stack: list[float], closed: array[float]) -> None:
    """Put a turning point on the stack of open ones, and close the cycles that it closes."""
    stack.append(point)
    while len(stack) >= 3:
        before = abs(stack[-2] - stack[-3])
        if abs(stack[-1] - stack[-2]) < before:
            return
        middle = 0.5 * (stack[-2] + stack[-3])
        if len(stack) == 3:
            closed.extend((before, middle, 0.5))
            del stack[0]
        else:
            closed.extend((before, middle, 1.0))
            del stack[-3:-1]


def rainflow(series: Floats) -> tuple[Floats, Floats, Floats]:
    """Count cycles as ASTM E1049-85, 5.4.4, rainflow counting; what closes no cycle counts as half cycles.

    Parameters
    ----------
    series : (samples,)

    Returns
    -------
    ranges, means, counts : (cycles,) counts are 1 or 0.5

    Examples
    --------
    The example of the standard (figure 6):

    >>> ranges, _, counts = rainflow(np.array([-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0]))
    >>> [(size, float(counts[ranges == size].sum())) for size in sorted(set(ranges.tolist()))]
    [(3.0, 0.5), (4.0, 1.5), (6.0, 0.5), (8.0, 1.0), (9.0, 0.5)]
    """
    count = Rainflow()
    count.add(np.asarray(series, dtype=np.float64))
    return count.cycles()


def damage_equivalent_range(series: Floats, exponent: float, cycles: float) -> float:
    """Range of `cycles` equal cycles that do the damage of a series: see `equivalent_range`."""
    ranges, _, counts = rainflow(series)
    return equivalent_range(ranges, counts, exponent, cycles)


def equivalent_range(ranges: Floats, counts: Floats, exponent: float, cycles: float) -> float:
    """Range of `cycles` equal cycles that do the damage of counted ones, Miner's rule with one slope, means left out.

    Parameters
    ----------
    ranges, counts : (n,) of `rainflow`
    exponent : slope of the S-N curve
    cycles : such as the length of the series in seconds, for one cycle a second

    Notes
    -----
    Ranges below `NOISE` of the largest are left out: packed files have such steps.
    """
    largest = float(ranges.max(initial=0.0))
    if largest == 0.0:
        return 0.0
    kept = ranges > NOISE * largest
    damage = float(np.sum(counts[kept] * (ranges[kept] / largest) ** exponent))
    return float(largest * (damage / cycles) ** (1.0 / exponent))
