"""6x6 matrices of bearings: symmetric about the axis, turned, in series with their seats, regularised."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from exugear.system.bearings.rolling.rows import BearingError
from fe_ste.tools.arrays import Floats


def axially_symmetric(stiffness: Floats) -> Floats:
    """Mean of a 6x6 stiffness over all directions in the plane of the bearing.

    Parameters
    ----------
    stiffness : (6, 6) in the frame of the bearing

    Returns
    -------
    (6, 6) unchanged by any turn about z, for models that want one radial and one tilting stiffness

    Examples
    --------
    >>> mean = axially_symmetric(np.diag([3.0, 1.0, 0.5, 4.0, 2.0, 0.0]))
    >>> [round(float(entry), 12) for entry in np.diag(mean)]
    [2.0, 2.0, 0.5, 3.0, 3.0, 0.0]
    """
    # The entries hold harmonics up to the second of the turning angle: three positions average them out.
    turned = [rotate_stiffness(stiffness, 2.0 * math.pi * position / 3.0) for position in range(3)]
    mean: Floats = np.mean(turned, axis=0)
    return mean


def rotate_stiffness(stiffness: Floats, angle: float) -> Floats:
    """Turn a 6x6 stiffness about z by an angle (rad), shape (6, 6)."""
    cosine = math.cos(angle)
    sine = math.sin(angle)
    turn = np.kron(np.eye(2), np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]))
    turned: Floats = turn @ stiffness @ turn.T
    return turned


def regularised(stiffness: Floats, floor: ArrayLike) -> Floats:
    """Give directions without stiffness the one that is stated.

    Parameters
    ----------
    stiffness : (6, 6) symmetric stiffness
    floor : (6,) least diagonal entries, N/m and N m/rad; zero leaves a direction free

    Returns
    -------
    (6, 6) the diagonal raised to the floor where it lies below, everything else as before

    Examples
    --------
    >>> held = regularised(np.diag([4e9, 4e9, 0.0, 1e6, 1e6, 0.0]), (0.0, 0.0, 1e8, 0.0, 0.0, 0.0))
    >>> float(held[2, 2]), float(held[5, 5])
    (100000000.0, 0.0)
    """
    least = np.asarray(floor, dtype=np.float64)
    if least.shape != (6,) or np.any(least < 0.0):
        raise BearingError(f"regularisation: floor = {floor!r} must be six numbers, none negative")
    raised: Floats = stiffness + np.diag(np.maximum(least - np.diag(stiffness), 0.0))
    return raised


def in_series(first: Floats, second: Floats) -> Floats:
    """Stiffness of two elements that carry the same load one behind the other.

    Parameters
    ----------
    first, second : (6, 6) symmetric, positive semi-definite: for example bearing and housing seat, about the same point

    Returns
    -------
    (6, 6)
        Parallel sum ``A (A + B)^+ B`` of the matrices: ``(A^-1 + B^-1)^-1`` where these exist; a direction
        that either leaves free is free.

    Examples
    --------
    >>> series = in_series(np.diag([2.0, 2.0, 0.0, 1.0, 1.0, 0.0]), np.diag([2.0, 6.0, 5.0, 1.0, 1.0, 0.0]))
    >>> [round(float(entry), 12) for entry in np.diag(series)]
    [1.0, 1.5, 0.0, 0.5, 0.5, 0.0]
    """
    # Forces and moments differ by orders of magnitude: scale to a unit diagonal before a rank is decided.
    total = first + second
    scale = np.sqrt(np.where(np.diag(total) > 0.0, np.diag(total), 1.0))
    scales = np.outer(scale, scale)
    inverse = np.linalg.pinv(total / scales, rcond=1e-13, hermitian=True) / scales
    series = first @ inverse @ second
    symmetric: Floats = 0.5 * (series + series.T)
    return symmetric


def proportional_damping(stiffness: Floats, time_constant: float) -> Floats:
    """Viscous damping ``beta K``.

    Parameters
    ----------
    stiffness : (6, 6) stiffness
    time_constant : beta, s. A mode of frequency f with all its strain energy here gets the damping ratio ``pi f beta``.

    Returns
    -------
    (6, 6)

    Examples
    --------
    >>> float(proportional_damping(1e9 * np.eye(6), 4e-6)[0, 0])
    4000.0
    """
    if time_constant < 0.0:
        raise BearingError(f"damping: time_constant = {time_constant} s must not be negative")
    return time_constant * stiffness
