"""Peaks of complex curves over a parameter that is known at few places: where they stand, and how high they are.

Near a resonance every signal is a ratio of polynomials of the frequency. One of second degree through five
neighbouring values has two poles, as many as a resonance and its neighbour need, and tells the top between them.
"""

from __future__ import annotations

import numpy as np

from fe_ste.tools.arrays import Complexes, Floats, Integers
from fe_ste.tools.compilation import compiled

STANDS = 0.01
"""Share of a peak's height by which it stands above the lowest values on both sides, up to the next that is higher."""
NEIGHBOURS = 5
"""Values that a curve of two poles goes through."""
SUPPORT, OTHERS = [0, 2, 4], [1, 3]
"""Which of them carry the curve, and which the weights follow from."""
LOOKED_AT, CLOSER = 64, 3
"""Places at which a curve is looked at between its neighbours, and how often closer around the highest of them."""
BESIDE = 1e-12
"""Share of the neighbours' distance from a place that carries the curve, where its form is 0 / 0."""


def standing_peaks(values: Floats, stands: float = STANDS) -> Integers:
    """Places at which values (n,) have a local maximum that stands above both sides, in ascending order.

    The ends are none: what rises up to them has its top elsewhere.

    Examples
    --------
    >>> standing_peaks(np.array([0.0, 2.0, 1.0, 1.001, 1.0, 3.0, 2.9]))
    array([1, 5])
    """
    found = np.empty(len(values), dtype=np.int64)
    count = find_standing(np.ascontiguousarray(values, dtype=np.float64), stands, found)
    return found[:count]


@compiled
def find_standing(values: Floats, stands: float, found: Integers) -> int:
    """Fill the places of `standing_peaks` and count them; of equal highest values that of the middle one."""
    count = 0
    last = values.size - 1
    first = 1
    while first < last:
        end = first
        while end < last and values[end + 1] == values[first]:
            end += 1
        if end < last and values[first - 1] < values[first] and values[end + 1] < values[first]:
            peak = values[first]
            before = after = peak
            at = first - 1
            while at >= 0 and values[at] <= peak:
                before = min(before, values[at])
                at = at - 1
            at = end + 1
            while at <= last and values[at] <= peak:
                after = min(after, values[at])
                at = at + 1
            if peak - max(before, after) >= stands * peak:
                found[count] = (first + end) // 2
                count += 1
        first = end + 1
    return count


def predicted_top(places: Floats, values: Complexes, highest: int) -> tuple[float, float]:
    """Place and height of the top near the highest of some values, by a curve through it and its neighbours.

    Parameters
    ----------
    places : (n,) ascending, five or more
    values : (n, signals) the height is the root of their summed squares; all have the same poles
    highest : which is the highest, neither the first nor the last

    Notes
    -----
    The barycentric form of a rational function: with weights w in the null space of the Loewner matrix
    (f(x_j) - f(s_i)) / (x_j - s_i), it goes through the values of a single signal at all five places, and through
    those of several as nearly as common poles can (Antoulas & Anderson 1986).

    Examples
    --------
    One resonance, whose top lies between two places:

    >>> x = np.array([0.9, 0.95, 0.99, 1.02, 1.06])
    >>> place, height = predicted_top(x, 0.02 / (1.0 - x**2 + 0.02j * x)[:, None], 2)
    >>> round(place, 4), round(height, 4)
    (0.9999, 1.0001)
    """
    found = [float(places[highest]), float(np.linalg.norm(values[highest]))]
    # Where curves through other neighbours differ, the highest is to be looked at.
    for first in range(max(highest - 3, 0), min(highest, len(places) - NEIGHBOURS + 1)):
        found = max(found, list(_top(places, values, highest, first)), key=lambda own: own[1])
    return found[0], found[1]


def _top(places: Floats, values: Complexes, highest: int, first: int) -> tuple[float, float]:
    """Place and height of the top near a place by the curve through five places from one on."""
    middle = places[highest]
    width = places[highest + 1] - places[highest - 1]
    x = (places[first : first + NEIGHBOURS] - middle) / width
    f = values[first : first + NEIGHBOURS]
    carrying = x[SUPPORT]
    others = x[OTHERS]
    divided = (f[OTHERS][:, None] - f[SUPPORT]) / (others[:, None] - carrying)[..., None]
    weights = np.linalg.svd(np.moveaxis(divided, 2, 1).reshape(-1, len(SUPPORT)))[2][-1].conj()

    def heights(at: Floats) -> Floats:
        apart = at[:, None] - carrying
        parts = weights / np.where(apart == 0.0, BESIDE, apart)
        return np.asarray(np.linalg.norm((parts @ f[SUPPORT]) / parts.sum(axis=1)[:, None], axis=1))

    low, high = ((places[highest + side] - middle) / width for side in (-1, 1))
    top = 0.0
    height = float(np.linalg.norm(values[highest]))
    for _ in range(CLOSER):
        at = np.linspace(low, high, LOOKED_AT)
        found = heights(at)
        best = int(np.argmax(found))
        if not found[best] > height:
            break
        top = float(at[best])
        height = float(found[best])
        step = (high - low) / LOOKED_AT
        low = max(low, top - step)
        high = min(high, top + step)
    return float(middle + top * width), height
