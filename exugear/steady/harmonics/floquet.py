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
TOGETHER = 24
"""Kicks that are passed at once."""


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
    constant : (n, n) A, 1/s
    pushes : (n, j) columns b
    reads : (j, n) rows c
    varying : (kicks, j, j) what multiplies the readings, at even instants of the period
    period : s

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
    for first in range(0, kicks, TOGETHER):
        total = _after_kicks(total, advance, pushes, reads, step * varying[first : first + TOGETHER])
    multipliers, shapes = scipy.linalg.eig(total)
    found = np.log(np.where(multipliers == 0.0, 1e-300, multipliers)) / period
    order = np.argsort(-found.real)
    return np.asarray(found[order], dtype=complex), np.asarray(shapes[:, order], dtype=complex)


def _after_kicks(state: Floats, advance: Floats, pushes: Floats, reads: Floats, kicks: Floats) -> Floats:
    """Find states (n, n) after some kicks (k, j, r), each followed by a step of the constant part (n, n).

    Readings at each kick are those without kicks, less what the kicks before it changed in them: products with the
    whole matrix are needed once for all of them.
    """
    count = len(kicks)
    if not pushes.shape[1] or not len(reads):  # nothing varies: the constant part acts alone
        return np.asarray(np.linalg.matrix_power(advance, count) @ state)
    rows = [reads]
    columns = [advance @ pushes]
    for _ in range(count - 1):
        rows.append(rows[-1] @ advance)
        columns.append(advance @ columns[-1])
    readings = (np.concatenate(rows) @ state).reshape(count, len(reads), -1)
    felt = np.concatenate([reads @ column for column in columns])
    given = np.empty((count, pushes.shape[1], state.shape[1]))
    for n, kick in enumerate(kicks):
        given[n] = kick @ readings[n]
        later = count - 1 - n
        changed = felt[: later * len(reads)] @ given[n]
        readings[n + 1 :] -= changed.reshape(later, *readings.shape[1:])
    moved: Floats = np.linalg.matrix_power(advance, count) @ state
    moved -= np.concatenate(columns[::-1], axis=1) @ given.reshape(-1, state.shape[1])
    return moved
