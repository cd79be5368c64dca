"""Load duration distributions (hours and revolutions by load bin), and rainflow counting.

For parts that rotate under load, such as gears and roller bearings, the revolutions at a load are its cycles. Positive
and negative loads have separate bins, because they load opposite flanks.

For parts that do not rotate under load (housings, arms, pins, splines, couplings), cycles are counted by the rainflow
method.
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
    """Hours and revolutions by torque bin; empty bins are omitted."""

    lower: Floats
    upper: Floats
    """(bins,) edges, N m: the outer edge of each bin, farther from zero, with the sign of the torque."""
    torque: Floats
    """(bins,) mean torque in the bin, weighted by revolutions, N m."""
    hours: Floats
    revolutions: Floats
    """(bins,) of the loaded shaft."""
    running_speed: Floats
    """(bins,) mean absolute speed, weighted by revolutions, rad/s: hours at standstill leave it as it is."""

    def _line(self) -> str:
        return f": {len(self.hours)} bins, {self.hours.sum():.6g} h"

    @property
    def speed(self) -> Floats:
        """Mean absolute speed of each bin over its hours, rad/s."""
        seconds = 3600.0 * self.hours
        return np.divide(2.0 * np.pi * self.revolutions, seconds, out=np.zeros_like(seconds), where=seconds > 0.0)

    def torques(self, value: str) -> Floats:
        """Return the representative torque of each bin: its ``mean``, or its ``upper`` edge, which is conservative."""
        return self.upper if value == "upper" else self.torque


def load_duration(
    torque: Floats, speed: Floats, hours: Floats, bins: int, largest: float | None = None
) -> DurationDistribution:
    """Sort torque samples into bins of equal width, from zero to the largest torque.

    Parameters
    ----------
    torque, speed, hours : (samples,) N m, rad/s, and duration of each sample in the whole life
    largest : outer edge of the last bin, N m, if the samples represent larger torques; by default their largest torque

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
    some_turns = np.where(revolutions > 0.0, revolutions, 1.0)
    by_turns = np.bincount(inverse, turns * torque) / some_turns
    by_hours = np.bincount(inverse, hours * torque) / np.where(total_hours > 0.0, total_hours, 1.0)
    sense = np.sign(numbers)
    return DurationDistribution(
        lower=sense * (np.abs(numbers) - 1) * width,
        upper=sense * np.abs(numbers) * width,
        torque=np.where(revolutions > 0.0, by_turns, by_hours),
        hours=total_hours,
        revolutions=revolutions,
        running_speed=np.bincount(inverse, turns * np.abs(speed)) / some_turns,
    )


@dataclass(frozen=True, eq=False)
class LoadPoints(ReprMixin):
    """Torques with simultaneous rotor loads: bins of a distribution, split where these loads differ."""

    torque: Floats
    """(points,) N m."""
    other: Floats
    """(points, n) simultaneous loads, means weighted by revolutions."""
    hours: Floats
    revolutions: Floats
    """(points,)"""
    speed: Floats
    """(points,) mean absolute speed, weighted by revolutions, rad/s."""
    bin: Integers
    """(points,) index of the distribution's bin."""

    def _line(self) -> str:
        return f": {len(self.hours)} points, {self.hours.sum():.6g} h"


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
    distribution : of the same samples
    value : as in `DurationDistribution.torques`
    torque, speed, hours : (samples,) as in `load_duration`
    other : (samples, n) simultaneous loads
    cells : number of cells over the range of each of them
    """
    torques = distribution.torques(value)
    if not other.any():
        return LoadPoints(
            torques,
            np.zeros((len(torques), other.shape[1])),
            distribution.hours,
            distribution.revolutions,
            distribution.running_speed,
            np.arange(len(torques)),
        )
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
    *means, running_speed = (
        np.bincount(inverse, turns * column) / np.where(total > 0.0, total, 1.0) for column in (*other.T, np.abs(speed))
    )
    bins = keys[:, 0].astype(np.int64)
    lasting = np.bincount(inverse, hours).astype(np.float64)
    return LoadPoints(torques[bins], np.array(means).T, lasting, total, running_speed, bins)


def equivalent_load(load: Floats, cycles: Floats, exponent: float) -> float:
    """Return the constant load of equal damage in as many cycles as absolute loads, by Miner's rule with one slope.

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


# Rainflow counting to ASTM E1049, and damage-equivalent ranges

_AT_ONCE = 100_000
"""Number of turning points processed at once as Python numbers."""
NOISE = 1e-3
"""Fraction of the largest range below which ranges are neglected as resolution noise of packed files."""


def reversals(series: Floats) -> Floats:
    """Return the turning points of a series, including its ends.

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
    """Rainflow counter for a series in blocks, equivalent to `rainflow`; the series itself is not stored.

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
        self._closed = array("d")  # range, mean and count in sequence
        self._tail = np.zeros(0)

    def _line(self) -> str:
        return f": {len(self._closed) // 3} cycles closed, {len(self._open)} turning points open"

    def add(self, piece: Floats) -> None:
        """Process the next block of the series."""
        if not len(piece):
            return
        points = reversals(np.concatenate([self._tail, piece]))
        begun = len(self._tail) > 1  # its first point was already a turning point
        for begin in range(int(begun), len(points) - 1, _AT_ONCE):
            for point in points[begin : min(begin + _AT_ONCE, len(points) - 1)].tolist():
                _take(point, self._open, self._closed)
        self._tail = points[-2:]

    def cycles(self) -> tuple[Floats, Floats, Floats]:
        """Return ranges, means and counts of all cycles, (cycles,) each; open turning points give half cycles."""
        stack = list(self._open)
        closed = array("d", self._closed)
        if len(self._tail):
            _take(float(self._tail[-1]), stack, closed)
        for first, second in itertools.pairwise(stack):
            closed.extend((abs(second - first), 0.5 * (first + second), 0.5))
        table = np.frombuffer(closed, dtype=np.float64).reshape(-1, 3)
        return table[:, 0], table[:, 1], table[:, 2]


def _take(point: float, stack: list[float], closed: array[float]) -> None:
    """Push a turning point on the stack of open ones, and extract the cycles that it closes."""
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
    """Count cycles of a series (samples,) by the rainflow method of ASTM E1049-85, 5.4.4; the residue gives half ones.

    Returns
    -------
    ranges, means, counts : (cycles,) counts are 1 or 0.5

    Examples
    --------
    The example of the standard, Fig. 6:

    >>> ranges, _, counts = rainflow(np.array([-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0]))
    >>> [(size, float(counts[ranges == size].sum())) for size in sorted(set(ranges.tolist()))]
    [(3.0, 0.5), (4.0, 1.5), (6.0, 0.5), (8.0, 1.0), (9.0, 0.5)]
    """
    count = Rainflow()
    count.add(np.asarray(series, dtype=np.float64))
    return count.cycles()


def equivalent_range(ranges: Floats, counts: Floats, exponent: float, cycles: float) -> float:
    """Return the range of `cycles` equal cycles with the same damage, by Miner's rule with one slope, without means.

    Parameters
    ----------
    ranges, counts : (n,) from `rainflow`
    exponent : slope of the S-N curve
    cycles : such as the length of the series in seconds, for one cycle per second

    Notes
    -----
    Ranges below `NOISE` of the largest are neglected, because packed files have steps of this size.
    """
    largest = float(ranges.max(initial=0.0))
    if largest == 0.0:
        return 0.0
    kept = ranges > NOISE * largest
    damage = float(np.sum(counts[kept] * (ranges[kept] / largest) ** exponent))
    return float(largest * (damage / cycles) ** (1.0 / exponent))
