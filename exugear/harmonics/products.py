"""Products of a signal with periodic coefficients: each harmonic of the coefficient carries every line to another."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exugear.harmonics.lines import LineSet
from fe_ste.tools.arrays import Complexes, Floats, Integers


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
    def _sources(self) -> Integers:
        """Where the factor (n, 2 h + 1) of each line and order -h .. h stands: values, their conjugates, a zero."""
        count, orders = len(self.lines.index), np.arange(-self.harmonics, self.harmonics + 1)
        source = np.repeat(self.lines.index[:, None, :], len(orders), axis=1)
        source[:, :, self.base] -= orders
        # The mean is its own conjugate, and is found as it stands.
        place, mirrored = self.lines.find(source)
        return np.where(place < 0, 2 * count, place + count * mirrored)

    def of(self, coefficients: Complexes, values: Complexes) -> Complexes:
        """Coefficients (n,) of the product of a signal `values` (n,) and a real function, `coefficients` c_0 .. c_h."""
        both = np.concatenate([coefficients[:0:-1].conj(), coefficients])
        return np.asarray(np.concatenate([values, values.conj(), [0.0]])[self._sources] @ both)
