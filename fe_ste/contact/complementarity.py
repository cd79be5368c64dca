"""The complementarity problem of contact: pressures where the gap is closed, none elsewhere.

Forces are positive where they press; gap and approach are lengths on the contact normal, see
`fe_ste.contact.kinematics`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from fe_ste.contact.kinematics import ContactError
from fe_ste.tools.arrays import Booleans, Floats


@dataclass(frozen=True)
class ContactSolution:
    """Forces on the cells of one position.

    Attributes
    ----------
    approach : float
        Rotation of gear 2 as a length on the contact normal, m.
    approach_per_load : float
        Its derivative by the normal load, m/N.
    force : ndarray (n,)
        Normal force on each cell, N.
    force_per_load : ndarray (n,)
        Its derivative by the normal load, which is the derivative of the approach by the gap at the cell, too.
    iterations : int

    Notes
    -----
    The energy force C force / 2 + gap force is least under the sum of the forces. Its least value has the derivative
    `force` by the gap and the approach by the load, so that the mixed derivatives are the same.
    """

    approach: float
    approach_per_load: float
    force: Floats
    force_per_load: Floats
    iterations: int

    def __repr__(self) -> str:
        """Return one short line."""
        loaded, approach = np.count_nonzero(self.force), 1e6 * self.approach
        return f"<ContactSolution: {loaded} of {len(self.force)} cells in contact, approach {approach:.4g} um>"


def solve_complementarity(
    compliance: Floats, gap: Floats, load: float, guess: Booleans, max_iterations: int = 60
) -> ContactSolution:
    """Solve force >= 0, compliance force + gap - approach >= 0, one of them zero, sum of forces = load.

    Primal-dual active set: the cells with pressure keep their contact, the cells that overlap gain it. When the
    number of wrong cells stops falling, only the last wrong cell is changed at a time, which cannot cycle for a
    positive definite matrix.

    Parameters
    ----------
    compliance : ndarray (n, n)
        Symmetric positive definite, m/N.
    gap : ndarray (n,)
        m.
    load : float
        Sum of the forces, N, positive.
    guess : ndarray (n,)
        Cells taken to be in contact at the start.
    max_iterations : int
        Block steps allowed.

    Returns
    -------
    ContactSolution

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
    fewest, patience = len(gap) + 1, 5
    for iteration in range(1, max_iterations + 1):
        if not active.any():  # a load needs a cell: the nearest one
            active = gap == gap.min()
        numbers = np.flatnonzero(active)
        rows = compliance[numbers]
        closing, closing_per_load, approach, per_load = _solve_active(rows[:, numbers], gap[numbers], load)
        force = np.zeros(len(gap))
        force[numbers] = closing
        # The matrix is symmetric, so its rows serve as columns: all cells move by the forces on the active ones.
        clearance = closing @ rows + gap - approach
        if np.isnan(clearance).any():  # every comparison below would pass
            raise ContactError("the contact problem holds values that are not numbers")
        # Below rounding an open cell counts as closed, or it would change for ever.
        tolerance = 1e-12 * max(abs(approach), 1e-12)
        wrong = np.where(active, force < 0.0, clearance < -tolerance)
        if not wrong.any():
            force_per_load = np.zeros(len(gap))
            force_per_load[numbers] = closing_per_load
            return ContactSolution(approach, per_load, force, force_per_load, iteration)
        count = int(wrong.sum())
        # Block steps are fast but may cycle. After five without progress single steps go on, which cannot
        # (Judice and Pires): each takes the wrong cell of the highest number.
        if count < fewest:
            fewest, patience = count, 5
        else:
            patience -= 1
        if patience > 0:
            active = active ^ wrong
        else:
            active = active.copy()
            active[np.flatnonzero(wrong)[-1]] ^= True
    raise ContactError(f"the active set did not settle in {max_iterations} iterations ({count} cells still change)")


def _solve_active(compliance: Floats, gap: Floats, load: float) -> tuple[Floats, Floats, float, float]:
    """Solve for contact on all cells given: forces, their derivatives by the load, approach, its derivative.

    Overwrites ``compliance``.
    """
    try:
        # The transpose of the symmetric matrix is in the order that LAPACK works in.
        factor = scipy.linalg.cho_factor(compliance.T, lower=True, overwrite_a=True, check_finite=False)
    except np.linalg.LinAlgError as error:
        raise ContactError("the compliance of the contact cells is not positive definite") from error
    # C f = approach - gap on active cells, so f = approach C^-1 1 - C^-1 gap; sum(f) = load then gives the approach.
    right = np.stack([np.ones(len(gap)), gap])
    unit, closed = scipy.linalg.cho_solve(factor, right.T, overwrite_b=True, check_finite=False).T
    approach = (load + closed.sum()) / unit.sum()
    return unit * approach - closed, unit / unit.sum(), float(approach), float(1.0 / unit.sum())
