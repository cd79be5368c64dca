"""Sets of orders: the frequencies of the vibration of a system driven by several periodic excitations.

Each excitation is a base with its own frequency. The joint response is a sum of orders (lines), at integer combinations
k . base of these frequencies. Real signals need one line of each pair k, -k.

Bases in a ratio of small integers (a shaft whose wheel has twice the teeth of its pinion) have lines in common, and so
have carriers whose passing planets couple lines. The response of two bases at one frequency is one line: bases are then
multiples of fewer independent frequencies, and lines are told apart by these.

Sample j of M has the angles theta = 2 pi z j / M with an integer z for each base. Line k falls into slot k . z mod M of
one discrete Fourier transform of M samples, however many bases there are (Kammerer, Potts and Volkmer 2015). With z
such that all lines of a larger set fall into slots of their own, products of lines do not disturb them.

Signals form groups that couple only within themselves. The functions of a group are a matrix for each of its harmonics;
one compiled pass over all lines and terms then makes all products.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.linalg

from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers
from fe_ste.tools.bundles import cached_bundle
from fe_ste.tools.compilation import kernel
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.octets import SIZE, all_eight, eight, put

LARGEST_RATIO = 40
"""Integers up to which a ratio of two bases is looked for: harmonics that any set has."""
MOST_TEETH = 1000
"""Largest multiple of a shaft's rotation that a mesh frequency is looked for."""
SAME = 1e-9
"""Relative difference up to which two frequencies are the same."""
OF_SEVERAL = 4
"""Passages of a second set of planets beside those of one set.

Without them the stiffness that the second set passes counts by its mean for the orders of the first: in two planetary
stages with flexible rings these were 1.5 % off."""


@dataclass(frozen=True, eq=False)
class LineSet(ReprMixin, line=": {index!n} lines of {index.shape[1]} bases"):
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

    def shared(self, meshes: int | None = None) -> tuple[tuple[int, ...], ...]:
        """Pairs of bases in a ratio of small integers: multiples (bases,) of two of them whose sum is no frequency.

        `meshes` is the number of first bases that are compared; all by default.

        Examples
        --------
        >>> line_set([3.0, 4.0, 7.1], 1).shared()
        ((4, -3, 0),)
        """
        found = []
        for a, b in itertools.combinations(range(len(self.bases[:meshes])), 2):
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
        spans = [64 * (int(highest) + 1) for highest in np.abs(self.index @ self.units).max(axis=0)]
        weights = [math.prod(spans[:n]) for n in range(len(spans))]
        if math.prod(spans) >= 2**63:
            raise OverflowError(f"{len(self.index)} orders of {len(self.bases)} frequencies are too many to number")
        return np.array(weights, dtype=np.int64)

    @cached_property
    def _sorted_keys(self) -> tuple[Integers, Integers]:
        keys = self.index @ self.units @ self._radix
        order = np.argsort(keys)
        return keys[order], order

    def part(self, which: Booleans) -> LineSet:
        """Select some of the lines by a mask (n,); the mean is always among them.

        Examples
        --------
        >>> lines = line_set([1.0], 3)
        >>> lines.part(lines.orders > 1.5).index.ravel()
        array([0, 2, 3])
        """
        return LineSet(self.index[which | (np.arange(len(which)) == 0)], self.bases, self.units)

    def select_bases(self, bases: int) -> LineSet:
        """Take the lines of the first bases alone, without the slow ones that come after them."""
        alone = ~self.index[:, bases:].any(axis=1)
        units = self.units[:bases]
        return LineSet(self.index[alone, :bases], self.bases[:bases], units[:, units.any(axis=0)])

    def find(self, multiples: Integers) -> tuple[Integers, Booleans]:
        """Index of lines (..., bases) in the set, -1 for none, and whether the set contains the conjugate."""
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
    """Slow rotation of several equal parts that causes sidebands of the lines of some bases."""

    order: float
    """Its frequency over that of the reference."""
    of: tuple[int, ...]
    """Bases whose lines it modulates."""
    count: int
    """How many things turn."""
    step: int | None
    """What each multiple of the bases adds to the turns of its line, to be taken within half of `count` on either
    side; None where they follow no rule."""
    passing: int = 0
    """Turns that lie between lines where these are coupled to those beside them, however few they carry; 0 if not."""

    def in_steps(self, passages: int) -> int:
        """Count the steps of `passing` that a number of passages of one of what turns has; 0 without coupling.

        Examples
        --------
        >>> Modulator(1.0, (0,), 4, 1, 2).in_steps(3), Modulator(1.0, (0,), 4, 1).in_steps(3)
        (6, 0)
        """
        return passages * self.count // self.passing if self.passing else 0

    def least_turns(self, line: Integers) -> tuple[int, ...]:
        """Multiples of the rotation of a line (bases,) that is coupled to those beside it, the smallest by the rule.

        Examples
        --------
        >>> four = Modulator(1.0, (0,), 4, 1, 2)
        >>> four.least_turns(np.array([3, 1])), four.least_turns(np.array([2, 0])), four.least_turns(np.array([0, 1]))
        ((-1,), (-2, 2), (0,))
        """
        half = self.count // 2
        if self.step is None:
            return tuple(range(-half, half + 1))
        turns = (int(line[list(self.of)].sum()) * self.step + half) % self.count - half
        return (turns, -turns) if 2 * turns == -self.count else (turns,)

    def turns(self, line: Integers) -> tuple[int, ...]:
        """Multiples of the rotation as sidebands of a line (bases,): by the rule; for a single base all of them.

        Examples
        --------
        >>> four = Modulator(1.0, (0,), 4, 1)
        >>> four.turns(np.array([3, 1])), four.turns(np.array([2, 0])), four.turns(np.array([0, 1]))
        ((-1,), (-2, -1, 0, 1, 2), (0,))
        """
        if self.passing:
            return self.least_turns(line)
        if not np.any(line[list(self.of)]):
            return (0,)
        if self.step is None or np.count_nonzero(line) == 1:
            return tuple(range(-(self.count // 2), self.count // 2 + 1))
        least = self.least_turns(line)
        return least if len(least) == 1 else (0,)


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
    return _lines_of_rows(np.array([tuple(map(int, row)) for row in rows]), bases, _independent(bases))


def modulated(lines: LineSet, modulators: Sequence[Modulator], most: int = 0) -> LineSet:
    """Return lines with the sidebands caused by slow rotations, whose bases come after the others.

    Parameters
    ----------
    most : passages on either side at whose orders rotations couple others to a line, the mean included

    Examples
    --------
    >>> lines = modulated(line_set([10.0, 47.0], 1), [Modulator(1.0, (0,), 3, 1)])
    >>> [tuple(row) for row in lines.index.tolist()]
    [(0, 0, 0), (1, 0, -1), (1, 0, 0), (1, 0, 1), (0, 1, 0)]
    """
    orders = np.array([modulator.order for modulator in modulators])
    bases = np.append(lines.bases, orders)
    rows = {(*line.tolist(), *turns) for line in lines.index for turns in _all_turns(line, modulators, most)}
    couple = sum(modulator.passing > 0 for modulator in modulators)
    slow = _independent(orders, MOST_TEETH, MOST_TEETH) if couple > 1 else np.eye(len(orders), dtype=np.int64)
    return _lines_of_rows(np.array(sorted(rows)), bases, scipy.linalg.block_diag(lines.units, slow))


def _all_turns(line: Integers, modulators: Sequence[Modulator], most: int) -> list[tuple[int, ...]]:
    """Multiples of slow rotations (modulators,) beside a line (bases,), and those up to `most` passages on either side.

    Passages of several rotations at once are included of the mean alone, all but one of them up to `OF_SEVERAL`.
    """
    several = 0 if line.any() else OF_SEVERAL
    reaches = [range(-own.in_steps(most), own.in_steps(most) + 1) for own in modulators]
    few = [own.in_steps(several) for own in modulators]
    shifts = [
        tuple(step * own.passing for step, own in zip(steps, modulators, strict=True))
        for steps in itertools.product(*reaches)
        if sum(abs(step) > least for step, least in zip(steps, few, strict=True)) < 2
    ]
    return [
        tuple(turn + more for turn, more in zip(turns, shift, strict=True))
        for turns in itertools.product(*(modulator.turns(line) for modulator in modulators))
        for shift in shifts
    ]


def beside(lines: LineSet, slow: Sequence[Modulator], most: int) -> LineSet:
    """Return lines with the sidebands caused by passing equal parts, including those of the mean; slow bases come last.

    Parameters
    ----------
    slow : rotating sets of equal parts, one at a time: after 1 / `count` of a revolution the parts coincide again
    most : maximum number of sidebands on either side of a line, in passings

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
    return _lines_of_rows(rows, bases, scipy.linalg.block_diag(lines.units, np.eye(len(slow), dtype=np.int64)))


@dataclass(frozen=True)
class Rotation:
    """Rotation of a shaft whose gears deviate from tooth to tooth, or of a carrier."""

    name: str
    order: float
    """Its frequency over that of the reference."""


@dataclass(frozen=True)
class Sidebands:
    """Multiples of slow rotations, by themselves and beside the harmonics of a mesh frequency."""

    multiples: tuple[int, ...]
    """Of all bases that follow those of the meshes."""
    base: int | None = None
    """Base of the mesh frequency; None for the multiples by themselves."""
    reach: int | None = None
    """Highest harmonic of the mesh frequency; None for all of a line set."""


def with_rotations(
    lines: LineSet,
    rotations: Sequence[Rotation],
    sidebands: Sequence[Sidebands],
    meshes: int,
    harmonics: int,
    modulators: Sequence[Modulator] = (),
    most: int = 0,
) -> LineSet:
    """Return lines with the orders of rotations, whose bases come last.

    Parameters
    ----------
    meshes : number of the lines' bases that are meshes; other slow rotations follow them
    harmonics : of each mesh frequency whose sidebands are included
    modulators : slow rotations behind the meshes that turn what stands beside a mesh, if any do
    most : passages on either side at whose orders rotations couple others to a line

    Examples
    --------
    A pinion with five teeth whose first order matters:

    >>> lines = with_rotations(line_set([5.0], 1), [Rotation("pinion", 1.0)], [Sidebands((1,), 0)], 1, 1)
    >>> [tuple(row) for row in lines.index.tolist()], lines.orders.tolist()
    ([(0, 0), (0, 1), (1, -1), (1, 0), (1, 1)], [0.0, 1.0, 4.0, 5.0, 6.0])
    """
    if not sidebands:
        return lines
    first = len(lines.bases)
    bases = np.append(lines.bases, [rotation.order for rotation in rotations])
    known = np.hstack([lines.index, np.zeros((len(lines.index), len(rotations)), dtype=np.int64)])
    more = []
    for beside_mesh in sidebands:
        reach = harmonics if beside_mesh.reach is None else min(harmonics, beside_mesh.reach)
        reach = 0 if beside_mesh.base is None else reach
        own = np.zeros((2 * reach + 1, len(bases)), dtype=np.int64)
        own[:, meshes:] = beside_mesh.multiples
        if beside_mesh.base is not None:
            own[:, beside_mesh.base] = np.arange(-reach, reach + 1)
        for row in own:
            for turns in _all_turns(row[:meshes], modulators, most):
                more.append(row.copy())
                more[-1][meshes : meshes + len(turns)] += np.array(turns, dtype=np.int64)
    # Rotations lead the search for common frequencies: meshes are whole multiples of them, however many teeth.
    lead = [*range(first, len(bases)), *range(meshes)]
    shared = _independent(bases[lead], whole=MOST_TEETH)
    slow = lines.units[meshes:, lines.units[meshes:].any(axis=0)]
    units = np.zeros((len(bases), shared.shape[1] + slow.shape[1]), dtype=np.int64)
    units[lead, : shared.shape[1]] = shared
    units[meshes:first, shared.shape[1] :] = slow
    return _lines_of_rows(np.vstack([known, *more]), bases, units)


def joined(one: LineSet, other: LineSet) -> LineSet:
    """Lines of two sets of the same bases."""
    return _lines_of_rows(np.vstack([one.index, other.index]), one.bases, one.units)


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
    """Return which of many contributions (n,) are the largest, so that the norm of all others is at most `rest`.

    Examples
    --------
    >>> largest(np.array([0.1, 3.0, 0.2, 4.0]), 0.25)
    array([False,  True, False,  True])
    """
    order = np.argsort(sizes, kind="stable")
    found = np.zeros(len(sizes), dtype=bool)
    found[order] = np.sqrt(np.cumsum(sizes[order] ** 2)) > rest
    return found


def _lines_of_rows(rows: Integers, bases: Floats, units: Integers) -> LineSet:
    """Line set of the mean and multiples (n, bases) of bases in any order and sign, some of them at one frequency.

    Of lines at one frequency that of one base alone stands for all, else that with the smallest multiples.
    """
    rows = rows.astype(np.int64).reshape(len(rows), bases.size)
    rows = np.where((rows @ bases < 0.0)[:, None], -rows, rows)
    simplest = sorted(map(tuple, rows.tolist()), key=lambda row: (np.count_nonzero(row), sum(map(abs, row)), row))
    kept: dict[tuple[int, ...], tuple[int, ...]] = {(0,) * units.shape[1]: (0,) * bases.size}
    for row in simplest:
        kept.setdefault(tuple((np.array(row, dtype=np.int64) @ units).tolist()), row)
    index = np.array(sorted(kept.values(), key=lambda row: (float(np.dot(row, bases)), row)), dtype=np.int64)
    return LineSet(index, bases, units)


def _independent(bases: Floats, whole: int = LARGEST_RATIO, largest: int = LARGEST_RATIO) -> Integers:
    """Multiples (bases, independent) of independent frequencies that give the bases: greatest common divisors.

    `whole` is the largest multiple of a base that another one may be, `largest` the largest integer of other ratios.
    """
    groups: list[list[tuple[int, Fraction]]] = []
    for n, base in enumerate(bases):
        for group in groups:
            ratio = base / bases[group[0][0]]
            near = Fraction(ratio).limit_denominator(largest)
            most = whole if near.denominator == 1 else largest
            if near.numerator <= most and abs(ratio - near) < SAME * ratio:
                group.append((n, near))
                break
        else:
            groups.append([(n, Fraction(1))])
    units = np.zeros((bases.size, len(groups)), dtype=np.int64)
    for column, group in enumerate(groups):
        shared = math.lcm(*(near.denominator for _, near in group))
        common = math.gcd(*(int(near * shared) for _, near in group))
        for n, near in group:
            units[n, column] = int(near * shared) // common
    return units


GROWTH = 1.15
"""Factor from one number of samples that is tried to the next."""
TRIES = 400
"""Generators that are tried of each number of samples."""


class LatticeError(ValueError):
    """No lattice was found."""


@dataclass(frozen=True, eq=False)
class TorusSampling(ReprMixin, line=": {samples} samples for {lines.index!n} lines"):
    """Samples of quasi-periodic signals."""

    lines: LineSet
    generator: Integers
    """(bases,)"""
    samples: int

    @cached_property
    def angles(self) -> Floats:
        """Angles (samples, bases) of the bases, rad."""
        return np.asarray(
            2.0 * np.pi * (np.outer(np.arange(self.samples), self.generator) % self.samples) / self.samples
        )

    @cached_property
    def _slots(self) -> tuple[Integers, Booleans]:
        """Slot of each line in a transform of real samples, and whether it holds the conjugate."""
        slot = (self.lines.index @ self.generator) % self.samples
        mirrored = slot > self.samples // 2
        return np.where(mirrored, self.samples - slot, slot), mirrored

    def values(self, coefficients: Complexes) -> Floats:
        """Sample (samples, ...) signals with coefficients (lines, ...)."""
        slot, mirrored = self._slots
        spectrum = np.zeros((self.samples // 2 + 1, *coefficients.shape[1:]), dtype=complex)
        spectrum[slot[~mirrored]] = coefficients[~mirrored]
        spectrum[slot[mirrored]] = coefficients[mirrored].conj()
        return np.asarray(np.fft.irfft(spectrum, self.samples, axis=0) * self.samples)

    def sample_along_base(self, base: int, coefficients: Complexes) -> Floats:
        """Sample (..., samples) functions of the angle of one base with harmonics (..., h + 1), fewer than samples / 2.

        One transform gives them at all angles that samples have; each sample then takes its own.
        """
        spectrum = np.zeros((*coefficients.shape[:-1], self.samples // 2 + 1), dtype=complex)
        spectrum[..., : coefficients.shape[-1]] = coefficients
        even = np.fft.irfft(spectrum, self.samples, axis=-1) * self.samples
        return np.asarray(even[..., np.arange(self.samples) * self.generator[base] % self.samples])

    def coefficients(self, values: Floats) -> Complexes:
        """Find the coefficients (lines, ...) of the lines in samples (samples, ...)."""
        slot, mirrored = self._slots
        found = np.fft.rfft(values, axis=0)[slot] / self.samples
        found[mirrored] = found[mirrored].conj()
        return np.asarray(found)


def rank1_lattice(lines: LineSet, larger: LineSet, least: int = 0, shared: bool = False) -> TorusSampling:
    """Find a lattice on which all lines of a larger set have slots of their own.

    Parameters
    ----------
    lines : lines of the signals
    larger : lines of the same bases; twice the harmonics and combinations keep products of two lines apart
    least : minimum number of samples
    shared
        Whether lines only in the larger set may share slots with each other: a third fewer samples, but lines outside
        the larger set alias more often with the slots of the lines.

    Raises
    ------
    LatticeError
        None was found, which is possible only for an infinite set.

    Examples
    --------
    >>> from exugear.steady.harmonics.lines import line_set
    >>> lines = line_set([1.0, 4.7], 2, 2)
    >>> found = rank1_lattice(lines, line_set([1.0, 4.7], 4, 4))
    >>> signal = np.arange(7.0) + 0j
    >>> bool(np.allclose(found.coefficients(found.values(signal)), signal))
    True
    """
    independent = lines.units.shape[1]
    own, whole = (np.vstack([some.index, -some.index[1:]]) for some in (lines, larger))
    apart = own if shared else whole
    rng = np.random.default_rng(1)
    # An odd number: then no slot but that of the mean is its own conjugate.
    samples = max(len(apart), least) | 1
    while samples < 200 * len(whole):
        for _ in range(TRIES if independent > 1 else 1):
            generator = lines.units @ np.append(1, rng.integers(2, samples, size=independent - 1)).astype(np.int64)
            taken = np.bincount((whole @ generator) % samples, minlength=samples)
            if (taken[(apart @ generator) % samples] == 1).all():
                return TorusSampling(lines, generator, samples)
        samples = _smooth(int(samples * GROWTH) + 2)
    raise LatticeError(f"no sampling lattice found for {len(whole)} spectral lines")


def _smooth(least: int) -> int:
    """Next odd number that a fast transform likes: a product of 3, 5 and 7."""
    number = least | 1
    while True:
        rest = number
        for factor in (3, 5, 7):
            while rest % factor == 0:
                rest //= factor
        if rest == 1:
            return number
        number += 2


def fourier_coefficients(samples: Floats, harmonics: int) -> Complexes:
    """Coefficients c_0 .. c_h of a real function sum_h c_h e^(i h theta) from samples over a period.

    Examples
    --------
    >>> theta = 2.0 * np.pi * np.arange(8) / 8
    >>> np.abs(fourier_coefficients(3.0 + np.cos(2.0 * theta), 3)).round(12)
    array([3. , 0. , 0.5, 0. ])
    """
    return np.asarray(np.fft.rfft(samples)[: harmonics + 1] / len(samples))


@dataclass(frozen=True, eq=False)
class Group:
    """Signals that functions of the same angles couple."""

    begin: int
    size: int
    """First signal, and number of them."""
    harmonics: Integers
    """(q, bases) multiples of the bases' angles that the functions have, of each pair k, -k both."""


class Terms(NamedTuple):
    """Terms of the products of g groups on n lines: which lines each line takes in."""

    begin: Integers
    size: Integers
    """(g,) first signal and number of signals of each group."""
    room: Integers
    """(g,) number of signals padded to whole octets, as coefficients and products are stored in memory."""
    first: Integers
    """(g, n + 1) first term of each line in the arrays that follow."""
    place: Integers
    mirrored: Integers
    """(t,) line that is taken in, and whether as its conjugate."""
    block: Integers
    """(t,) first coefficient of the harmonic that carries it."""


@dataclass(frozen=True, eq=False)
class HarmonicCoupling:
    """Products of the signals of some groups with functions of the bases' angles, as maps of lines."""

    lines: LineSet
    groups: tuple[Group, ...]
    """One after the other they have all signals."""

    @cached_property
    def terms(self) -> Terms:
        """All terms, group by group and line by line."""
        first: list[Integers] = []
        parts: list[tuple[Integers, Integers, Integers]] = []
        terms = blocks = 0
        for group in self.groups:
            # The mean is its own conjugate, and is found as it stands.
            place, mirrored = self.lines.find(self.lines.index[:, None, :] - group.harmonics)
            line, at = np.nonzero(place >= 0)
            coefficients = group.size * _filled(group.size)
            first.append(terms + np.searchsorted(line, np.arange(len(self.lines.index) + 1)))
            parts.append((place[line, at], mirrored[line, at].astype(np.int64), blocks + coefficients * at))
            terms = terms + len(line)
            blocks = blocks + coefficients * len(group.harmonics)
        places, conjugates, at_blocks = (np.concatenate(own) for own in zip(*parts, strict=True))
        begin, size, room = (
            np.array(group, dtype=np.int64)
            for group in zip(*((group.begin, group.size, _filled(group.size)) for group in self.groups), strict=True)
        )
        return Terms(begin, size, room, np.array(first), places, conjugates, at_blocks)

    @cached_property
    def _of_constants(self) -> list[tuple[Integers, Integers]]:
        """Lines at the frequencies of each group's harmonics, and which harmonic that is."""
        found = []
        for group in self.groups:
            place, mirrored = self.lines.find(group.harmonics)
            at = np.flatnonzero((place >= 0) & ~mirrored)
            found.append((place[at], at))
        return found

    def of_constants(self, functions: Sequence[Complexes], values: Floats) -> Complexes:
        """Products (n, k) of functions, as `of` takes them, with signals (k,) that are constant."""
        found = np.zeros((len(self.lines.index), len(values)), dtype=complex)
        for group, function, (lines, at) in zip(self.groups, functions, self._of_constants, strict=True):
            own = slice(group.begin, group.begin + group.size)
            np.add.at(found[:, own], lines, (function @ values[own])[at])
        return found

    def memory(self) -> tuple[Floats, Floats]:
        """Allocate memory (lines times the size of all groups,) for products, real and imaginary parts."""
        size = len(self.lines.index) * int(self.terms.room.sum())
        return np.empty(size), np.empty(size)

    def of(self, functions: Sequence[Complexes], values: Complexes) -> Complexes:
        """Products (n, k) of signals (n, k) with functions.

        Parameters
        ----------
        functions : (q, size, size)
            By group: coefficients at its harmonics, rows what signals take in and columns what they give.
        values : (n, k)
        """
        return self.of_flat(flat(functions), values)

    def of_flat(self, functions: tuple[Floats, Floats], values: Complexes) -> Complexes:
        """Products as in `of`, with functions as `flat` has them."""
        real, imaginary = self.memory()
        take_in(cached_bundle(self.terms), *functions, np.ascontiguousarray(values, complex), real, imaginary)
        found = np.empty((len(values), len(self._columns)), dtype=complex)
        found.real = real.reshape(len(values), -1)[:, self._columns]
        found.imag = imaginary.reshape(len(values), -1)[:, self._columns]
        return found

    @cached_property
    def _columns(self) -> Integers:
        """Signals (k,) among products, whose groups fill whole octets."""
        starts = np.cumsum(self.terms.room) - self.terms.room
        return np.concatenate([start + np.arange(group.size) for start, group in zip(starts, self.groups, strict=True)])


def _filled(size: int) -> int:
    """Whole octets."""
    return -(-size // SIZE) * SIZE


def flat(functions: Sequence[Complexes]) -> tuple[Floats, Floats]:
    """Real and imaginary parts of functions (..., rows, columns) as kernels read them.

    One column after the other, rows filled up to whole octets.
    """
    shapes = [(*own.shape[:-2], own.shape[-1], _filled(own.shape[-2])) for own in functions]
    ends = np.cumsum([math.prod(shape) for shape in shapes])
    real, imaginary = np.zeros((2, ends[-1]))
    for function, shape, end in zip(functions, shapes, ends, strict=True):
        columns = np.swapaxes(function, -1, -2)
        own = slice(end - math.prod(shape), end)
        real[own].reshape(shape)[..., : columns.shape[-1]] = columns.real
        imaginary[own].reshape(shape)[..., : columns.shape[-1]] = columns.imag
    return real, imaginary


@kernel
def take_in(
    terms: Terms, real: Floats, imaginary: Floats, values: Complexes, out_real: Floats, out_imaginary: Floats
) -> None:
    """Fill products (n times all group sizes,) of signals (n, k) and functions as `flat` has them."""
    room = 0
    for group in range(terms.room.size):
        room += terms.room[group]
    to = 0
    for group in range(terms.room.size):
        begin = terms.begin[group]
        size = terms.size[group]
        rows = terms.room[group]
        for octet in range(0, rows, SIZE):
            for line in range(values.shape[0]):
                x = all_eight(0.0)
                y = all_eight(0.0)
                for term in range(terms.first[group, line], terms.first[group, line + 1]):
                    place = terms.place[term]
                    at = terms.block[term] + octet
                    sign = -1.0 if terms.mirrored[term] else 1.0
                    for column in range(begin, begin + size):
                        a = values[place, column].real
                        b = sign * values[place, column].imag
                        c = eight(real, at)
                        s = eight(imaginary, at)
                        x = x + c * a - s * b
                        y = y + c * b + s * a
                        at += rows
                put(out_real, line * room + to + octet, x)
                put(out_imaginary, line * room + to + octet, y)
        to += rows


@kernel
def add_answered(
    terms: Terms,
    real: Floats,
    imaginary: Floats,
    answers_real: Floats,
    answers_imaginary: Floats,
    values: Complexes,
    taken_real: Floats,
    taken_imaginary: Floats,
    memory: Floats,
    out: Complexes,
) -> None:
    """Fill signals (n, k) plus the response of the lines themselves to the products of these.

    `answers` are those of each line (n, k, k) as `flat` has them, `taken` and `memory` (16,) work arrays.
    """
    take_in(terms, real, imaginary, values, taken_real, taken_imaginary)
    lines, size = values.shape
    at = product = 0
    for line in range(lines):
        from_line = product
        from_answers = at
        for octet in range(0, size, SIZE):
            x = all_eight(0.0)
            y = all_eight(0.0)
            product = from_line
            at = from_answers + octet
            for group in range(terms.room.size):
                for column in range(product, product + terms.size[group]):
                    a = taken_real[column]
                    b = taken_imaginary[column]
                    c = eight(answers_real, at)
                    s = eight(answers_imaginary, at)
                    x = x + c * a - s * b
                    y = y + c * b + s * a
                    at += SIZE * ((size + SIZE - 1) // SIZE)
                product += terms.room[group]
            put(memory, 0, x)
            put(memory, SIZE, y)
            for row in range(octet, min(octet + SIZE, size)):
                out[line, row] = values[line, row] + complex(memory[row - octet], memory[SIZE + row - octet])
            at -= octet
