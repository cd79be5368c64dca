"""Rainflow counting of ASTM E1049, and the constant cycle that does the same damage.

For what does not turn through its load: housings, arms, pins, splines, couplings.
"""

from __future__ import annotations

import itertools
from array import array

import numpy as np

from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed

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


class Rainflow(Displayed):
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
