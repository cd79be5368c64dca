"""The complementarity problem of contact: pressures where the gap is closed, none elsewhere.

Forces are positive where they press; gap and approach are lengths on the contact normal, see
`fe_ste.contact.kinematics`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dsymv, dtrsm
from scipy.linalg.lapack import dpotrf

from fe_ste.contact.kinematics import ContactError
from fe_ste.tools.arrays import Booleans, Floats, Integers
from fe_ste.tools.compilation import compiled
from fe_ste.tools.display import ReprMixin

#: Changes of the active set that a factor is carried over, as a part of its size: a border of k cells costs k / 3 n of
#: a new factor in arithmetic, and more in calls.
_BORDER = 0.15


@dataclass(frozen=True)
class ContactSolution(ReprMixin):
    """Forces on the cells of one position.

    Notes
    -----
    The energy force C force / 2 + gap force is minimised for the given sum of the forces. Its minimum has the
    derivative `force` by the gap and the approach by the load, so that the mixed derivatives are the same.
    """

    approach: float
    """Rotation of gear 2 as a length on the contact normal, m."""
    approach_per_load: float
    """Its derivative by the normal load, m/N."""
    force: Floats
    """(n,) normal force on each cell, N."""
    force_per_load: Floats
    """(n,) its derivative by the normal load, which is the derivative of the approach by the gap at the cell, too."""
    iterations: int

    def _line(self) -> str:
        loaded = np.count_nonzero(self.force)
        approach = 1e6 * self.approach
        return f": {loaded} of {len(self.force)} cells in contact, approach {approach:.4g} µm"


def solve_complementarity(
    compliance: Floats, gap: Floats, load: float, guess: Booleans, max_iterations: int = 60
) -> ContactSolution:
    """Solve force >= 0, compliance force + gap - approach >= 0, one of them zero, sum of forces = load.

    Primal-dual active set: the cells with pressure keep their contact, the cells that overlap gain it. When the
    number of wrong cells stops falling, only the last wrong cell is changed at a time, which cannot cycle for a
    positive definite matrix.

    Parameters
    ----------
    compliance : (n, n) symmetric positive definite, m/N. Entries above the diagonal are not read.
    gap : (n,) m
    load : sum of the forces, N, positive
    guess : (n,) cells taken to be in contact at the start
    max_iterations : block steps allowed

    Raises
    ------
    ContactError
        If the active set does not settle, or the matrix is not positive definite on it.

    References
    ----------
    M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2003) 865-888; J. J. Judice, F. M. Pires, Comput. Oper.
    Res. 21 (1994) 587-596 (block principal pivoting and its safeguard).

    Examples
    --------
    >>> solution = solve_complementarity(np.eye(2), np.array([0.0, 1.0]), 0.5, np.array([True, True]))
    >>> solution.force.tolist(), solution.approach
    ([0.5, 0.0], 0.5)
    """
    active = guess & np.isfinite(gap)
    factor = None
    fewest = len(gap) + 1
    patience = 5
    for iteration in range(1, max_iterations + 1):
        if not active.any():  # a load needs a cell: the nearest one
            active = gap == gap.min()
        if factor is None or not factor.reaches(active):
            factor = _Factor(compliance, gap, active)
        unit, closed = factor.solve(active)
        approach = (load + closed.sum()) / unit.sum()
        # C f = approach - gap on active cells, so f = approach C^-1 1 - C^-1 gap; sum(f) = load gives the approach.
        force = unit * approach - closed
        # The lower triangle by rows is the upper one by columns, the order that BLAS works in.
        clearance = dsymv(1.0, compliance.T, force, lower=0) + gap - approach
        if np.isnan(clearance).any():  # every comparison below would pass
            raise ContactError("the contact problem holds values that are not numbers")
        # Below rounding an open cell counts as closed, or it would change for ever.
        tolerance = 1e-12 * max(abs(approach), 1e-12)
        wrong = np.where(active, force < 0.0, clearance < -tolerance)
        if not wrong.any():
            per_load = 1.0 / unit.sum()
            return ContactSolution(float(approach), float(per_load), force, unit * per_load, iteration)
        count = int(wrong.sum())
        # Block steps are fast but may cycle. After five without progress single steps go on, which cannot
        # (Judice and Pires): each takes the wrong cell of the highest number.
        if count < fewest:
            fewest = count
            patience = 5
        else:
            patience -= 1
        if patience > 0:
            active = active ^ wrong
        else:
            active = active.copy()
            active[np.flatnonzero(wrong)[-1]] ^= True
    raise ContactError(f"the active set did not settle in {max_iterations} iterations ({count} cells still change)")


class _Factor:
    """Factor of the compliance on one active set, which solves for sets that differ from it by a few cells, too.

    A cell that is gained borders the matrix by its own column, one that is lost by a column that is zero but for its
    own row: C y + B z = r, B^T y + D z = s. With C = U^T U and W = U^-T B that is (D - W^T W) z = s - W^T U^-T r.
    """

    def __init__(self, compliance: Floats, gap: Floats, active: Booleans) -> None:
        self._compliance, self._gap, self._active = compliance, gap, active
        self._numbers = np.flatnonzero(active)
        # The lower triangle by rows is the upper one by columns.
        self._upper, failed = dpotrf(_lower_part(compliance, self._numbers).T, lower=0, clean=0, overwrite_a=1)
        if failed:
            raise ContactError("the compliance of the contact cells is not positive definite")
        right = np.stack([np.ones(len(self._numbers)), gap[self._numbers]]).T
        self._half = dtrsm(1.0, self._upper, right, trans_a=1, overwrite_b=1)

    def reaches(self, active: Booleans) -> bool:
        """Whether `active` is so near the set of the factor that a border is cheaper than a new factor."""
        return int(np.count_nonzero(active ^ self._active)) <= _BORDER * len(self._numbers)

    def solve(self, active: Booleans) -> tuple[Floats, Floats]:
        """Solve C unit = 1 and C closed = gap on `active`; zero on the other cells."""
        gained = np.flatnonzero(active & ~self._active)
        lost = np.flatnonzero(self._active & ~active)
        half = self._half
        result = np.zeros((2, len(active)))
        if len(gained) + len(lost):
            numbers = self._numbers
            count = len(gained)
            border = np.zeros((count + len(lost), len(numbers)))
            _take(self._compliance, gained, numbers, border)
            # In the size of the other columns, or the equations of the border would lose digits.
            border[np.arange(count, len(border)), np.searchsorted(numbers, lost)] = self._compliance[lost, lost]
            reduced = dtrsm(1.0, self._upper, border.T, trans_a=1, overwrite_b=1)
            corner = -reduced.T @ reduced
            square = np.empty((count, count))
            _take(self._compliance, gained, gained, square)
            corner[:count, :count] += square
            right = -reduced.T @ half
            right[:count, 0] += 1.0
            right[:count, 1] += self._gap[gained]
            multipliers = np.linalg.solve(corner, right)
            half = half - reduced @ multipliers
            result[:, gained] = multipliers[:count].T
        result[:, self._numbers] = dtrsm(1.0, self._upper, half).T
        result[:, lost] = 0.0
        return result[0], result[1]


@compiled
def _lower_part(matrix: Floats, numbers: Integers) -> Floats:
    """Lower triangle of the rows and columns `numbers`; what is above it is not set."""
    part = np.empty((len(numbers), len(numbers)))
    for i in range(len(numbers)):
        row = matrix[numbers[i]]
        for j in range(i + 1):
            part[i, j] = row[numbers[j]]
    return part


@compiled
def _take(matrix: Floats, rows: Integers, columns: Integers, part: Floats) -> None:
    """Copy rows and columns of a symmetric matrix, of which the lower triangle is given, to the top of `part`."""
    for i in range(len(rows)):
        for j in range(len(columns)):
            part[i, j] = matrix[max(rows[i], columns[j]), min(rows[i], columns[j])]
