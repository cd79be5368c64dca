"""Sets of lines: the frequencies at which something driven by several periodic causes vibrates.

Each cause is a base with a frequency of its own. What all of them do together is a sum of lines, at integer
combinations k . base of these frequencies. Real signals need one line of each pair k, -k.

Bases in a ratio of small integers (a shaft whose wheel has twice the teeth of its pinion) have lines in common. What
two bases do at one frequency is one line: bases are then multiples of fewer independent frequencies, and lines are told
apart by these.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np

from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers
from fe_ste.tools.display import Displayed

LARGEST_RATIO = 40
"""Integers up to which a ratio of two bases is looked for: harmonics that any set has."""
SAME = 1e-9
"""Relative difference up to which two frequencies are the same."""


@dataclass(frozen=True, eq=False)
class LineSet(Displayed, line=": {index!n} lines of {index.shape[1]} bases"):
    r"""Lines of a real signal x = x_0 + sum_k (c_k e^(i k . theta) + its conjugate).

    Arrays of a signal have the coefficients c along their first axis; the first one, the mean, is real. The peak
    amplitude of a line is 2 \|c_k\|.
    """

    index: Integers
    r"""(n, bases) multiples of each base; the first line is the mean."""
    bases: Floats
    r"""(bases,) frequency of each base over that of the reference."""
    units: Integers
    r"""(bases, independent) multiples of independent frequencies that the bases are."""

    @cached_property
    def orders(self) -> Floats:
        """Frequency of each line (n,) over that of the reference, not negative."""
        return np.asarray(self.index @ self.bases)

    def shared(self) -> tuple[tuple[int, ...], ...]:
        """Pairs of bases in a ratio of small integers: multiples (bases,) of two of them whose sum is no frequency.

        Examples
        --------
        >>> line_set([3.0, 4.0, 7.1], 1).shared()
        ((4, -3, 0),)
        """
        found = []
        for a, b in itertools.combinations(range(len(self.bases)), 2):
            column = int(np.argmax(self.units[a]))
            one = int(self.units[a, column])
            other = int(self.units[b, column])
            if other:
                row = np.zeros(len(self.bases), dtype=np.int64)
                row[[a, b]] = np.array([other, -one]) // math.gcd(one, other)
                found.append(tuple(row.tolist()))
        return tuple(found)

    @cached_property
    def _radix(self) -> Integers:
        """Weights that make one number of a vector of multiples; wide enough for sums of several lines."""
        span = 64 * (int(np.abs(self.index @ self.units).max(initial=0)) + 1)
        return np.array([span**n for n in range(self.units.shape[1])], dtype=np.int64)

    @cached_property
    def _sorted_keys(self) -> tuple[Integers, Integers]:
        keys = self.index @ self.units @ self._radix
        order = np.argsort(keys)
        return keys[order], order

    def part(self, which: Booleans) -> LineSet:
        """Take some of the lines, told by a flag for each (n,); the mean is always among them.

        Examples
        --------
        >>> lines = line_set([1.0], 3)
        >>> lines.part(lines.orders > 1.5).index.ravel()
        array([0, 2, 3])
        """
        return LineSet(self.index[which | (np.arange(len(which)) == 0)], self.bases, self.units)

    def of_first(self, bases: int) -> LineSet:
        """Take the lines of the first bases alone, without the slow ones that come after them."""
        slow = len(self.bases) - bases
        alone = ~self.index[:, bases:].any(axis=1)
        return LineSet(self.index[alone, :bases], self.bases[:bases], self.units[:bases, : self.units.shape[1] - slow])

    def find(self, multiples: Integers) -> tuple[Integers, Booleans]:
        """Place of lines (..., bases) in the set, -1 for none, and whether it is the conjugate that stands there."""
        keys, order = self._sorted_keys
        wanted = multiples @ self.units @ self._radix

        def look(values: Integers) -> Integers:
            at = np.minimum(np.searchsorted(keys, values), len(keys) - 1)
            return np.where(keys[at] == values, order[at], -1)

        direct = look(wanted)
        mirrored = look(-wanted)
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
    """A slow turn of several equal things that puts lines beside those of some bases."""

    order: float
    """Its frequency over that of the reference."""
    of: tuple[int, ...]
    """Bases whose lines it modulates."""
    count: int
    """How many things turn."""
    step: int | None
    """What each multiple of the bases adds to the turns of its line, to be taken within half of `count` on either
    side; None where they follow no rule."""

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
        if 2 * turns == self.count:
            return (0,)
        return (turns - self.count if 2 * turns > self.count else turns,)


def line_set(orders: Sequence[float], harmonics: int, combinations: int = 0) -> LineSet:
    """Each base alone up to its harmonics, and combinations of bases with a small sum of multiples.

    Parameters
    ----------
    orders : frequency of each base over that of the reference, positive
    harmonics : highest multiple of one base alone
    combinations : largest sum of the magnitudes of a combination's multiples

    Examples
    --------
    >>> lines = line_set([1.0, 4.5], harmonics=2, combinations=2)
    >>> [tuple(row) for row in lines.index.tolist()]
    [(0, 0), (1, 0), (2, 0), (-1, 1), (0, 1), (1, 1), (0, 2)]

    The double of one base is another: one line each of (0, 1) and (2, 0), of (1, 0) and (-1, 1).

    >>> [tuple(row) for row in line_set([1.0, 2.0], harmonics=2, combinations=2).index.tolist()]
    [(0, 0), (1, 0), (0, 1), (1, 1), (0, 2)]
    """
    bases = np.asarray(orders, dtype=np.float64)
    rows = {tuple(n * unit) for unit in np.eye(bases.size, dtype=np.int64) for n in range(1, harmonics + 1)}
    reach = range(-combinations, combinations + 1)
    for row in itertools.product(reach, repeat=bases.size):
        if 0 < sum(map(abs, row)) <= combinations and row > tuple(-n for n in row):
            rows.add(row)
    return _of_rows(np.array([tuple(map(int, row)) for row in rows]), bases, _independent(bases))


def modulated(lines: LineSet, modulators: Sequence[Modulator]) -> LineSet:
    """Lines with those beside them that slow turns make, whose bases come after the others.

    Examples
    --------
    >>> lines = modulated(line_set([10.0, 47.0], 1), [Modulator(1.0, (0,), 3, 1)])
    >>> [tuple(row) for row in lines.index.tolist()]
    [(0, 0, 0), (1, 0, -1), (1, 0, 0), (1, 0, 1), (0, 1, 0)]
    """
    own = np.array([modulator.order for modulator in modulators])
    bases = np.append(lines.bases, own)
    rows: set[tuple[int, ...]] = set()
    for line in lines.index[1:]:
        for turns in itertools.product(*(modulator.turns(line) for modulator in modulators)):
            rows.add(tuple(int(n) for n in (*line, *turns)))
    return _of_rows(np.array(sorted(rows)), bases, _with_slow(lines.units, len(modulators)))


def beside(lines: LineSet, slow: Sequence[Modulator], most: int) -> LineSet:
    """Lines with those that the passing of equal things puts beside each, the mean among them; slow bases come last.

    Parameters
    ----------
    slow : what turns, one at a time: after a turn over their `count` the things stand in each other's places
    most : passings beside a line at most

    Examples
    --------
    >>> lines = beside(line_set([10.0], 1), [Modulator(1.0, (0,), 3, 0)], 1)
    >>> [tuple(row) for row in lines.index.tolist()]
    [(0, 0), (0, 3), (1, -3), (1, 0), (1, 3)]
    """
    bases = np.append(lines.bases, [own.order for own in slow])
    turns = [np.zeros(len(slow), dtype=np.int64)]
    turns += [
        n * own.count * unit
        for own, unit in zip(slow, np.eye(len(slow), dtype=np.int64), strict=True)
        for n in range(-most, most + 1)
        if n
    ]
    rows = np.array([np.append(line, turn) for line in lines.index for turn in turns])
    return _of_rows(rows, bases, _with_slow(lines.units, len(slow)))


def joined(one: LineSet, other: LineSet) -> LineSet:
    """Lines of two sets of the same bases."""
    return _of_rows(np.vstack([one.index, other.index]), one.bases, one.units)


def count_of_lines(bases: int, sum_of_multiples: int) -> int:
    """Count lines of independent bases with a sum of the magnitudes of their multiples up to a given one, no mean.

    Examples
    --------
    >>> count_of_lines(2, 3), len(line_set([1.0, 4.7], 3, 3).index) - 1
    (12, 12)
    """
    points = sum((1 << n) * math.comb(bases, n) * math.comb(sum_of_multiples, n) for n in range(bases + 1))
    return (points - 1) // 2


def largest(sizes: Floats, rest: float) -> Booleans:
    """Tell which of many contributions (n,) are the largest, so that the norm of all others is at most `rest`.

    Examples
    --------
    >>> largest(np.array([0.1, 3.0, 0.2, 4.0]), 0.25)
    array([False,  True, False,  True])
    """
    order = np.argsort(sizes, kind="stable")
    found = np.zeros(len(sizes), dtype=bool)
    found[order] = np.sqrt(np.cumsum(sizes[order] ** 2)) > rest
    return found


def _of_rows(rows: Integers, bases: Floats, units: Integers) -> LineSet:
    """Line set of the mean and multiples (n, bases) of bases in any order and sign, some of them at one frequency.

    Of lines at one frequency that of one base alone stands for all, else that with the smallest multiples.
    """
    rows = rows.astype(np.int64).reshape(-1, bases.size)
    rows = np.where((rows @ bases < 0.0)[:, None], -rows, rows)
    simplest = sorted(map(tuple, rows.tolist()), key=lambda row: (np.count_nonzero(row), sum(map(abs, row)), row))
    kept: dict[tuple[int, ...], tuple[int, ...]] = {(0,) * units.shape[1]: (0,) * bases.size}
    for row in simplest:
        kept.setdefault(tuple((np.array(row, dtype=np.int64) @ units).tolist()), row)
    index = np.array(sorted(kept.values(), key=lambda row: (float(np.dot(row, bases)), row)), dtype=np.int64)
    return LineSet(index, bases, units)


def _independent(bases: Floats) -> Integers:
    """Multiples (bases, independent) of independent frequencies that bases are: their greatest common divisors."""
    groups: list[list[tuple[int, Fraction]]] = []
    for n, base in enumerate(bases):
        for group in groups:
            ratio = base / bases[group[0][0]]
            near = Fraction(ratio).limit_denominator(LARGEST_RATIO)
            if near.numerator <= LARGEST_RATIO and abs(ratio - near) < SAME * ratio:
                group.append((n, near))
                break
        else:
            groups.append([(n, Fraction(1))])
    units = np.zeros((bases.size, len(groups)), dtype=np.int64)
    for column, group in enumerate(groups):
        whole = math.lcm(*(near.denominator for _, near in group))
        common = math.gcd(*(int(near * whole) for _, near in group))
        for n, near in group:
            units[n, column] = int(near * whole) // common
    return units


def _with_slow(units: Integers, slow: int) -> Integers:
    """Multiples of independent frequencies of bases and slow ones behind them, each independent of all others."""
    found = np.zeros((len(units) + slow, units.shape[1] + slow), dtype=np.int64)
    found[: len(units), : units.shape[1]] = units
    found[len(units) :, units.shape[1] :] = np.eye(slow, dtype=np.int64)
    return found
