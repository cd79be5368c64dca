"""Stability of linear systems with periodic stiffness: Floquet multipliers over one period.

    x' = A x - sum_j b_j s_j(t) c_j x,  the varying parts of low rank

Between instants the constant part acts exactly, by its exponential; the varying part acts in kicks at the instants
(Strang's splitting, an error of second order in the step).
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

from fe_ste.tools.arrays import Complexes, Floats

PER_FASTEST = 6.0
"""Kicks per period of the fastest mode: with fewer of them the splitting itself resonates."""


def kicks_needed(fastest: float, period: float) -> int:
    """Kicks over a period (s) in which modes up to a frequency (Hz) keep their stability.

    Examples
    --------
    >>> kicks_needed(1000.0, 0.01)
    60
    """
    return int(np.ceil(PER_FASTEST * fastest * period))


def exponents(
    constant: Floats, pushes: Floats, reads: Floats, varying: Floats, period: float
) -> tuple[Complexes, Complexes]:
    """Floquet exponents (n,) of a system, 1/s, the fastest growing first, and the shapes (n, n) that grow, by columns.

    Parameters
    ----------
    constant : (n, n) array
        A, 1/s.
    pushes : (n, j) array
        Columns b.
    reads : (j, n) array
        Rows c.
    varying : (kicks, j, j) array
        What multiplies the readings, at even instants of the period.
    period : float
        s.

    Examples
    --------
    A constant part that decays, and nothing that varies:

    >>> exponents(-np.eye(1), np.ones((1, 1)), np.ones((1, 1)), np.zeros((4, 1, 1)), 2.0)[0].real.round(12)
    array([-1.])
    """
    kicks = len(varying)
    step = period / kicks
    advance = scipy.linalg.expm(step * constant)
    total = np.eye(len(constant))
    for own in varying:
        total = total - pushes @ (step * own @ (reads @ total))
        total = advance @ total
    multipliers, shapes = scipy.linalg.eig(total)
    found = np.log(np.where(multipliers == 0.0, 1e-300, multipliers)) / period
    order = np.argsort(-found.real)
    return np.asarray(found[order], dtype=complex), np.asarray(shapes[:, order], dtype=complex)
