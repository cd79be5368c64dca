"""A rank-1 lattice on the torus of all bases' angles: few samples on which lines do not alias.

Sample j of M has the angles theta = 2 pi z j / M with an integer z for each base. Line k falls into slot k . z mod M of
one discrete Fourier transform of M samples, however many bases there are (Kammerer, Potts and Volkmer 2015). With z
such that all lines of a larger set fall into slots of their own, products of lines do not disturb them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exugear.steady.harmonics.lines import LineSet
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers
from fe_ste.tools.display import Displayed

GROWTH = 1.15
"""Factor from one number of samples that is tried to the next."""
TRIES = 400
"""Generators that are tried of each number of samples."""


class LatticeError(ValueError):
    """No lattice was found."""


@dataclass(frozen=True, eq=False)
class Lattice(Displayed, line=": {samples} samples for {lines.index!n} lines"):
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

    def along_base(self, base: int, coefficients: Complexes) -> Floats:
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


def lattice(lines: LineSet, larger: LineSet, least: int = 0, shared: bool = False) -> Lattice:
    """Find a lattice on which all lines of a larger set have slots of their own.

    Parameters
    ----------
    lines : lines of the signals
    larger : lines of the same bases; twice the harmonics and combinations keep products of two lines apart
    least : samples at least
    shared
        Whether lines that are in the larger set alone may share slots with each other: a third fewer samples, on which
        what lies beyond the larger set meets those of the lines more often.

    Raises
    ------
    LatticeError
        None was found, which only a set without end could bring about.

    Examples
    --------
    >>> from exugear.steady.harmonics.lines import line_set
    >>> lines = line_set([1.0, 4.7], 2, 2)
    >>> found = lattice(lines, line_set([1.0, 4.7], 4, 4))
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
                return Lattice(lines, generator, samples)
        samples = _smooth(int(samples * GROWTH) + 2)
    raise LatticeError(f"no lattice was found for {len(whole)} lines")


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
