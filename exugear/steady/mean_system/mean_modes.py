"""Modes of the mean system at one speed: eigenvalues with right and left shapes, gyroscopic and damped as it is."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg

from exugear.steady.mean_system.mean_system import MeanSystem
from exugear.system.linearised import RIGID_BODY_LIMIT
from fe_ste.tools.arrays import Complexes, Floats


def mean_modes(system: MeanSystem, speed: float) -> tuple[Complexes, Complexes, Complexes]:
    """Vibrations of a mean system at a speed of the input (rad/s), as `vibrations` gives them."""
    return vibrations(system.mass, system.damping_at(speed), system.stiffness_at(speed))


def vibrations(mass: Floats, damping: Floats, stiffness: Floats) -> tuple[Complexes, Complexes, Complexes]:
    """Eigenvalues (n,) of M u'' + C u' + K u = 0 with positive frequency, and right and left shapes (n, 2 size).

    Left shapes are scaled so that the response to a load b at the angular frequency w is the sum of
    right (left . [0, M^-1 b]) / (i w - eigenvalue). Free rolling and overdamped motions are left out.

    Parameters
    ----------
    mass, damping, stiffness : (size, size)

    Examples
    --------
    >>> values, _, _ = vibrations(np.eye(2), np.zeros((2, 2)), np.diag([100.0, 400.0]))
    >>> values.imag.round(6)
    array([10., 20.])
    """
    n = len(mass)
    lower = np.linalg.solve(mass, np.hstack([-stiffness, -damping]))
    values, left, right = _eig(np.vstack([np.eye(n, 2 * n, n), lower]))
    kept = values.imag > 2.0 * np.pi * RIGID_BODY_LIMIT
    kept &= np.abs(values.imag) > np.abs(values.real)
    order = np.flatnonzero(kept)[np.argsort(values[kept].imag)]
    right = right[:, order].T
    left = left[:, order].conj().T
    # Left shapes of a repeated eigenvalue are any basis of their space: they become the partners of the right ones.
    partners: Complexes = np.linalg.solve(left @ right.T, left).astype(np.complex128)
    return values[order], right, partners


def _eig(matrix: Floats) -> tuple[Complexes, Complexes, Complexes]:
    """Eigenvalues, and left and right eigenvectors as columns."""
    found: Any = scipy.linalg.eig(matrix, left=True, right=True)
    values, left, right = found
    return values, left, right
