"""Sets of lines: the frequencies at which something driven by several periodic causes vibrates.

Each cause is a base with a frequency of its own. What all of them do together is a sum of lines, at integer
combinations k . base of these frequencies. Real signals need one line of each pair k, -k.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers


@dataclass(frozen=True, eq=False)
class LineSet:
    r"""Lines of a real signal x = x_0 + sum_k (c_k e^(i k . theta) + its conjugate).

    Arrays of a signal have the coefficients c along their first axis; the first one, the mean, is real. The peak
    amplitude of a line is 2 \|c_k\|.

    Attributes
    ----------
    index : (n, bases) array of int
        Multiples of each base; the first line is the mean.
    orders : (n,) array
        Frequency of each line over that of the reference, not negative.
    """

    index: Integers
    orders: Floats

    def __repr__(self) -> str:
        """Sizes in one line."""
        return f"<LineSet: {len(self.index)} lines of {self.index.shape[1]} bases>"

    @cached_property
    def _radix(self) -> Integers:
        """Weights that make one number of a vector of multiples; wide enough for sums of several lines."""
        span = 64 * (int(np.abs(self.index).max(initial=0)) + 1)
        return np.array([span**n for n in range(self.index.shape[1])], dtype=np.int64)

    @cached_property
    def _sorted_keys(self) -> tuple[Integers, Integers]:
        keys = self.index @ self._radix
        order = np.argsort(keys)
        return keys[order], order

    def find(self, multiples: Integers) -> tuple[Integers, Booleans]:
        """Place of lines (..., bases) in the set, -1 for none, and whether it is the conjugate that stands there."""
        keys, order = self._sorted_keys
        wanted = multiples @ self._radix

        def look(values: Integers) -> Integers:
            at = np.minimum(np.searchsorted(keys, values), len(keys) - 1)
            return np.where(keys[at] == values, order[at], -1)

        direct, mirrored = look(wanted), look(-wanted)
        return np.where(direct >= 0, direct, mirrored), (direct < 0) & (mirrored >= 0)

    def values(self, coefficients: Complexes, angles: Floats) -> Floats:
        """Values (samples, ...) of signals with `coefficients` (n, ...) at angles (samples, bases) of the bases, rad.

        Examples
        --------
        >>> lines = line_set([1.0], 2)
        >>> lines.values(np.array([1.0, 0.5, 0.0], dtype=complex), np.array([[0.0], [np.pi]]))
        array([2., 0.])
        """
        turning = np.exp(1j * (angles @ self.index.T))
        turning[:, 1:] *= 2.0
        return np.asarray(np.real(np.tensordot(turning, coefficients, axes=1)))


@dataclass(frozen=True)
class Modulator:
    """A slow turn of several equal things that puts lines beside those of some bases.

    Attributes
    ----------
    order : float
        Its frequency over that of the reference.
    of : tuple of int
        Bases whose lines it modulates.
    count : int
        How many things turn.
    step : int or None
        What each multiple of the bases adds to the turns of its line, to be taken within half of `count` on either
        side; None where they follow no rule.
    """

    order: float
    of: tuple[int, ...]
    count: int
    step: int | None

    def turns(self, line: Integers) -> tuple[int, ...]:
        """Multiples of the turn beside a line (bases,): by the rule, and of a base alone all of them.

        Examples
        --------
        >>> four = Modulator(1.0, (0,), 4, 1)
        >>> four.turns(np.array([3, 1])), four.turns(np.array([2, 0])), four.turns(np.array([0, 1]))
        ((-1,), (-2, -1, 0, 1, 2), (0,))
        """
        multiple = int(line[list(self.of)].sum())
        if not np.any(line[list(self.of)]):
            return (0,)
        if self.step is None or np.count_nonzero(line) == 1:
            return tuple(range(-(self.count // 2), self.count // 2 + 1))
        turns = (multiple * self.step) % self.count
        return (0 if 2 * turns == self.count else turns - self.count if 2 * turns > self.count else turns,)


def line_set(orders: Sequence[float], harmonics: int, combinations: int = 0) -> LineSet:
    """Each base alone up to its harmonics, and combinations of bases with a small sum of multiples.

    Parameters
    ----------
    orders : sequence of float
        Frequency of each base over that of the reference, positive.
    harmonics : int
        Highest multiple of one base alone.
    combinations : int
        Largest sum of the magnitudes of a combination's multiples.

    Examples
    --------
    >>> lines = line_set([1.0, 4.5], harmonics=2, combinations=2)
    >>> [tuple(row) for row in lines.index.tolist()]
    [(0, 0), (1, 0), (2, 0), (-1, 1), (0, 1), (1, 1), (0, 2)]
    """
    bases = np.asarray(orders, dtype=np.float64)
    rows = {tuple(n * unit) for unit in np.eye(bases.size, dtype=np.int64) for n in range(1, harmonics + 1)}
    reach = range(-combinations, combinations + 1)
    for row in itertools.product(reach, repeat=bases.size):
        if 0 < sum(map(abs, row)) <= combinations and row > tuple(-n for n in row):
            rows.add(row if np.dot(row, bases) >= 0.0 else tuple(-n for n in row))
    index = np.array(sorted((tuple(map(int, row)) for row in rows), key=lambda row: float(np.dot(row, bases))))
    index = np.vstack([np.zeros((1, bases.size), dtype=np.int64), index.astype(np.int64).reshape(-1, bases.size)])
    return LineSet(index, index @ bases)


def modulated(lines: LineSet, modulators: Sequence[Modulator]) -> LineSet:
    """Lines with those beside them that slow turns make, whose bases come after the others.

    Parameters
    ----------
    lines : LineSet
    modulators : sequence of Modulator

    Examples
    --------
    >>> lines = modulated(line_set([10.0, 47.0], 1), [Modulator(1.0, (0,), 3, 1)])
    >>> [tuple(row) for row in lines.index.tolist()]
    [(0, 0, 0), (1, 0, -1), (1, 0, 0), (1, 0, 1), (0, 1, 0)]
    """
    own = np.array([modulator.order for modulator in modulators])
    bases = np.append(_bases(lines), own)
    rows: set[tuple[int, ...]] = set()
    for line in lines.index[1:]:
        for turns in itertools.product(*(modulator.turns(line) for modulator in modulators)):
            row = np.append(line, np.array(turns, dtype=np.int64))
            row = row if np.dot(row, bases) >= 0.0 else -row
            rows.add(tuple(int(n) for n in row))
    index = np.array(sorted(rows, key=lambda row: float(np.dot(row, bases))), dtype=np.int64)
    index = np.vstack([np.zeros((1, len(bases)), dtype=np.int64), index.reshape(-1, len(bases))])
    return LineSet(index, index @ bases)


def beside(lines: LineSet, slow: Sequence[Modulator], most: int) -> LineSet:
    """Lines with those that the passing of equal things puts beside each, the mean among them; slow bases come last.

    Parameters
    ----------
    lines : LineSet
    slow : sequence of Modulator
        What turns, one at a time: after a turn over their `count` the things stand in each other's places.
    most : int
        Passings beside a line at most.

    Examples
    --------
    >>> lines = beside(line_set([10.0], 1), [Modulator(1.0, (0,), 3, 0)], 1)
    >>> [tuple(row) for row in lines.index.tolist()]
    [(0, 0), (0, 3), (1, -3), (1, 0), (1, 3)]
    """
    bases = np.append(_bases(lines), [own.order for own in slow])
    turns = [np.zeros(len(slow), dtype=np.int64)]
    turns += [
        n * own.count * unit
        for own, unit in zip(slow, np.eye(len(slow), dtype=np.int64), strict=True)
        for n in range(-most, most + 1)
        if n
    ]
    rows = np.array([np.append(line, turn) for line in lines.index for turn in turns])
    rows[rows @ bases < 0.0] *= -1
    rows = np.unique(rows, axis=0)
    index = rows[np.argsort(rows @ bases, kind="stable")]
    return LineSet(index, index @ bases)


def joined(one: LineSet, other: LineSet) -> LineSet:
    """Lines of two sets of the same bases."""
    orders = dict(zip(map(tuple, one.index.tolist()), one.orders.tolist(), strict=True))
    orders |= dict(zip(map(tuple, other.index.tolist()), other.orders.tolist(), strict=True))
    rows = sorted(orders, key=lambda row: (orders[row], row))
    return LineSet(np.array(rows, dtype=np.int64), np.array([orders[row] for row in rows]))


def _bases(lines: LineSet) -> Floats:
    """Frequencies of the bases of a set, over that of the reference."""
    units = np.eye(lines.index.shape[1], dtype=np.int64)
    return np.array([float(lines.orders[np.flatnonzero((lines.index == unit).all(axis=1))[0]]) for unit in units])
