"""Products of a signal with periodic coefficients: each harmonic of the coefficient carries every line to another."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse

from exugear.harmonics.lines import LineSet
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers, SparseMatrix


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
    def _places(self) -> tuple[Integers, Integers, Integers, Booleans]:
        """Row, column, harmonic and whether the column's conjugate is meant, of each entry."""
        count, orders = len(self.lines.index), np.arange(-self.harmonics, self.harmonics + 1)
        source = np.repeat(self.lines.index[:, None, :], len(orders), axis=1)
        source[:, :, self.base] -= orders
        column, mirrored = self.lines.find(source)
        row = np.broadcast_to(np.arange(count)[:, None], column.shape)
        harmonic, found = np.broadcast_to(orders, column.shape), column >= 0
        return row[found], column[found], harmonic[found], mirrored[found]

    def matrices(self, coefficients: Complexes) -> tuple[SparseMatrix, SparseMatrix]:
        """Sparse S and S' for which S c + S' conj(c) are the coefficients of the product; `coefficients` c_0 .. c_h."""
        row, column, harmonic, mirrored = self._places
        values = np.where(harmonic >= 0, coefficients[np.abs(harmonic)], np.conj(coefficients[np.abs(harmonic)]))
        count = len(self.lines.index)
        # The mean is its own conjugate: entries that find it count once, as they stand.
        direct = ~mirrored
        return tuple(
            scipy.sparse.csr_array((values[part], (row[part], column[part])), shape=(count, count))
            for part in (direct, mirrored)
        )  # type: ignore[return-value]
