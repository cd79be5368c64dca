"""Low-pass filter and decimation of signals while they are computed."""

from __future__ import annotations

import numpy as np

from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel
from fe_ste.tools.octets import SIZE, all_eight, eight, put

TAPS_PER_FACTOR = 31
"""Length of the anti-aliasing filter per decimation factor: 80 dB above 0.58, flat below 0.42 of the rate."""


@kernel
def filtered(rows: Floats, middle: int, column: int, taps: Floats) -> float:
    """One column of rows around a middle one, filtered."""
    total: float = taps[0] * rows[middle, column]
    for k in range(1, taps.size):
        total += taps[k] * (rows[middle - k, column] + rows[middle + k, column])
    return total


@kernel
def filter_eight(rows: Floats, middle: int, column: int, taps: Floats, out: Floats) -> None:
    """Fill eight columns of out (columns,), from one on, with rows around a middle one, filtered.

    In two sums, because each addition waits for the one before.
    """
    near, far = eight(rows[middle], column) * taps[0], all_eight(0.0)
    for k in range(1, taps.size - 1, 2):
        near = near + (eight(rows[middle - k], column) + eight(rows[middle + k], column)) * taps[k]
        far = far + (eight(rows[middle - k - 1], column) + eight(rows[middle + k + 1], column)) * taps[k + 1]
    if taps.size % 2 == 0:
        k = taps.size - 1
        near = near + (eight(rows[middle - k], column) + eight(rows[middle + k], column)) * taps[k]
    put(out, column, near + far)


@kernel
def filter_rows(rows: Floats, taps: Floats, factor: int, out: Floats) -> None:
    """Fill out (count, columns) with every so many rows, filtered by symmetric taps of unit sum (middle first)."""
    half, columns = taps.size - 1, rows.shape[1]
    for n in range(out.shape[0]):
        middle = n * factor + half
        if columns < SIZE:
            for c in range(columns):
                out[n, c] = filtered(rows, middle, c, taps)
            continue
        for c in range(0, columns, SIZE):
            last = columns - SIZE  # the last ones lap over those before
            filter_eight(rows, middle, c if c < last else last, taps, out[n])


def low_pass(factor: int, half: int) -> Floats:
    """Taps (2 half + 1,) of the low pass before decimation: a sinc under a Kaiser window, of unit sum.

    Written out, because ``scipy.signal.firwin``, which the tests compare with, takes a third of a second to load.

    Examples
    --------
    >>> low_pass(2, 3).round(3)
    array([-0.   ,  0.   ,  0.227,  0.547,  0.227,  0.   , -0.   ])
    """
    if factor == 1:
        return np.ones(1)
    taps = np.sinc(np.arange(-half, half + 1) / factor) * np.kaiser(2 * half + 1, 8.0)
    taps /= taps.sum()
    taps[np.abs(taps) < 1e-15] = 0.0  # every other one is, but for round-off, when halving the rate
    return taps


class Decimator:
    """Linear-phase low pass and decimation of a stream of rows.

    Parameters
    ----------
    factor : int
        Keep every so many rows; 1 passes everything.
    count : int
        Columns per row.

    Examples
    --------
    >>> decimator = Decimator(2, 1)
    >>> rows = np.arange(200.0)[:, None]
    >>> first, values = decimator.push(rows[:100])
    >>> again, more = decimator.push(rows[100:])
    >>> first, again, bool(np.allclose(np.vstack([values, more])[:, 0], np.arange(first, first + 138, 2)))
    (32, 70, True)
    """

    def __init__(self, factor: int, count: int) -> None:
        self.factor = factor
        self.half = (TAPS_PER_FACTOR * factor) // 2 if factor > 1 else 0
        self.taps = low_pass(factor, self.half)
        self.pending = np.zeros((0, count))
        self.pending_first = 0  # number of the raw row that `pending` starts with

    def count_of(self, rows: int) -> int:
        """Count the results of so many rows in all.

        Examples
        --------
        >>> Decimator(2, 1).count_of(200)
        69
        """
        first = self.half + -self.half % self.factor
        return max(0, (rows - 1 - self.half - first) // self.factor + 1)

    def push(self, rows: Floats) -> tuple[int, Floats]:
        """Filter as far as the rows reach: number of the raw row of the first result, and the results."""
        before, length = len(self.pending), 2 * self.half + 1
        centre = self.pending_first + self.half
        centre += -centre % self.factor
        last = self.pending_first + before + len(rows) - 1 - self.half
        count = max(0, (last - centre) // self.factor + 1)
        begin = centre - self.half - self.pending_first  # first row that the first result needs, among all
        # Results that need rows from before come from both put together; the others from the new rows as they lie.
        of_both = min(count, max(0, -((begin - before) // self.factor)))
        results = np.empty((count, rows.shape[1]))
        seam = np.vstack([self.pending, rows[: length + self.factor * (of_both + 1)]])
        filter_rows(seam[begin:], self.taps[self.half :], self.factor, results[:of_both])
        skipped = max(0, begin + of_both * self.factor - before)
        filter_rows(rows[skipped:], self.taps[self.half :], self.factor, results[of_both:])
        following = begin + count * self.factor if count else 0
        self.pending = np.vstack([self.pending[following:], rows[max(0, following - before) :]])
        self.pending_first += following
        return centre, results
