"""Products of a signal with periodic coefficients: each harmonic of the coefficient carries every line to another."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from exugear.steady.harmonics.lines import LineSet
from fe_ste.tools.arrays import Complexes, Floats, Integers
from fe_ste.tools.compilation import kernel
from fe_ste.tools.inner_kernels import kept_bundle


def fourier_coefficients(samples: Floats, harmonics: int) -> Complexes:
    """Coefficients c_0 .. c_h of a real function sum_h c_h e^(i h theta) from samples over a period.

    Examples
    --------
    >>> theta = 2.0 * np.pi * np.arange(8) / 8
    >>> np.abs(fourier_coefficients(3.0 + np.cos(2.0 * theta), 3)).round(12)
    array([3. , 0. , 0.5, 0. ])
    """
    return np.asarray(np.fft.rfft(samples)[: harmonics + 1] / len(samples))


class Terms(NamedTuple):
    """Terms of the products of a line set of n lines: which lines each line takes in.

    Attributes
    ----------
    first : (n + 1,) first term of each line in the arrays that follow
    place, mirrored, order : (t,) line that is taken in, whether as its conjugate, and the harmonic that carries it
    """

    first: Integers
    place: Integers
    mirrored: Integers
    order: Integers


@dataclass(frozen=True, eq=False)
class Product:
    """The product with a function of one base's angle, as a map of lines.

    Attributes
    ----------
    lines : LineSet
    base : int
        Base whose angle the function depends on.
    harmonics : int
        Highest harmonic of the function.
    """

    lines: LineSet
    base: int
    harmonics: int

    @cached_property
    def _terms(self) -> Terms:
        count, orders = len(self.lines.index), np.arange(-self.harmonics, self.harmonics + 1)
        source = np.repeat(self.lines.index[:, None, :], len(orders), axis=1)
        source[:, :, self.base] -= orders
        # The mean is its own conjugate, and is found as it stands.
        place, mirrored = self.lines.find(source)
        line, at = np.nonzero(place >= 0)
        first = np.searchsorted(line, np.arange(count + 1))
        return Terms(first, place[line, at], mirrored[line, at].astype(np.int64), orders[at])

    def add(self, coefficients: Complexes, values: Complexes, signals: Integers, out: Complexes) -> None:
        """Add products of some signals and a real function for each to others.

        Parameters
        ----------
        coefficients : (m, h + 1) complex array
            c_0 .. c_h of the functions.
        values : (n, m) complex array
        signals : (k,) array of int
            Signals that are looked at.
        out : (n, m) complex array
            What is added to.
        """
        add_products(kept_bundle(self._terms), signals, coefficients, values, out)

    def of(self, coefficients: Complexes, values: Complexes) -> Complexes:
        """Coefficients (n,) of the product of a signal `values` (n,) and a real function, `coefficients` c_0 .. c_h."""
        out = np.zeros((len(values), 1), dtype=np.complex128)
        one = np.zeros(1, dtype=np.int64)
        self.add(coefficients[None].astype(np.complex128), values[:, None].astype(np.complex128), one, out)
        return out[:, 0]


@kernel
def add_products(terms: Terms, signals: Integers, coefficients: Complexes, values: Complexes, out: Complexes) -> None:
    """Add the products of some `signals` (k,) among `values` (n, m) and functions (m, h + 1) to `out` (n, m)."""
    for line in range(terms.first.size - 1):
        for term in range(terms.first[line], terms.first[line + 1]):
            place, order = terms.place[term], terms.order[term]
            for signal in signals:
                factor = coefficients[signal, abs(order)]
                value = values[place, signal]
                c, s = factor.real, factor.imag if order >= 0 else -factor.imag
                a, b = value.real, -value.imag if terms.mirrored[term] else value.imag
                out[line, signal] += complex(c * a - s * b, c * b + s * a)
