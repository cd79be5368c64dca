"""Rainflow counting of ASTM E1049, and the constant cycle that does the same damage.

For what does not turn through its load: housings, arms, pins, splines, couplings.
"""

from __future__ import annotations

import numpy as np

from fe_ste.tools.arrays import Floats

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


def rainflow(series: Floats) -> tuple[Floats, Floats, Floats]:
    """Count cycles as ASTM E1049-85, 5.4.4, rainflow counting; what closes no cycle counts as half cycles.

    Parameters
    ----------
    series : array (samples,)

    Returns
    -------
    ranges, means, counts : arrays (cycles,)
        Counts are 1 or 0.5.

    Examples
    --------
    The example of the standard (figure 6):

    >>> ranges, _, counts = rainflow(np.array([-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0]))
    >>> [(size, float(counts[ranges == size].sum())) for size in sorted(set(ranges.tolist()))]
    [(3.0, 0.5), (4.0, 1.5), (6.0, 0.5), (8.0, 1.0), (9.0, 0.5)]
    """
    found: list[tuple[float, float, float]] = []
    stack: list[float] = []
    for point in reversals(series).tolist():
        stack.append(point)
        while len(stack) >= 3:
            last, before = abs(stack[-1] - stack[-2]), abs(stack[-2] - stack[-3])
            if last < before:
                break
            count = 0.5 if len(stack) == 3 else 1.0
            found.append((before, 0.5 * (stack[-2] + stack[-3]), count))
            if len(stack) == 3:
                del stack[0]
            else:
                del stack[-3:-1]
    found += [(abs(b - a), 0.5 * (a + b), 0.5) for a, b in zip(stack[:-1], stack[1:], strict=True)]
    table = np.array(found).reshape(-1, 3)
    return table[:, 0], table[:, 1], table[:, 2]


def damage_equivalent_range(series: Floats, exponent: float, cycles: float) -> float:
    """Range of `cycles` equal cycles that do the damage of a series, Miner's rule with one slope, means left out.

    Parameters
    ----------
    series : array (samples,)
    exponent : float
        Slope of the S-N curve.
    cycles : float
        Such as the length of the series in seconds, for one cycle a second.

    Notes
    -----
    Ranges below `NOISE` of the largest are left out: packed files have such steps.
    """
    ranges, _, counts = rainflow(series)
    largest = float(ranges.max(initial=0.0))
    if largest == 0.0:
        return 0.0
    kept = ranges > NOISE * largest
    damage = float(np.sum(counts[kept] * (ranges[kept] / largest) ** exponent))
    return float(largest * (damage / cycles) ** (1.0 / exponent))
