"""Rotations in space: Euler parameters, and tilts and spin of a seat."""

from __future__ import annotations

import numpy as np

from fe_ste.tools.arrays import Floats

IDENTITY = np.eye(3)
"""Rotation by nothing."""


def skew(vectors: Floats) -> Floats:
    """Matrices (..., 3, 3) of the cross product with vectors (..., 3)."""
    matrices = np.zeros((*vectors.shape, 3))
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        matrices[..., a, b], matrices[..., b, a] = -vectors[..., c], vectors[..., c]
    return matrices


def euler_rotation(parameters: Floats) -> tuple[Floats, Floats]:
    """Rotation matrix (3, 3) of Euler parameters (4,), and matrix (3, 4) from their rates to the angular velocity."""
    scalar = parameters[0]
    vector = parameters[1:]
    cross = skew(vector)
    rates = np.empty((3, 4))
    rates[:, 0], rates[:, 1:] = -2.0 * vector, 2.0 * (scalar * IDENTITY + cross)
    return IDENTITY + 2.0 * scalar * cross + 2.0 * cross @ cross, rates


def tilts_and_spin(turns: Floats, near: float) -> tuple[Floats, Floats]:
    """Angles (s, 3) of turns Rx Ry Rz (s, 3, 3), spins nearest to an angle, and from angular velocities to rates."""
    a = np.arctan2(-turns[:, 1, 2], turns[:, 2, 2])
    b = np.arcsin(np.clip(turns[:, 0, 2], -1.0, 1.0))
    c = np.arctan2(-turns[:, 0, 1], turns[:, 0, 0])
    c += 2.0 * np.pi * np.round((near - c) / (2.0 * np.pi))
    ca = np.cos(a)
    sa = np.sin(a)
    cb = np.cos(b)
    sb = np.sin(b)
    rates = np.zeros((len(turns), 3, 3))
    rates[:, 0, 0] = 1.0
    rates[:, 0, 1], rates[:, 0, 2] = sa * sb / cb, -ca * sb / cb
    rates[:, 1, 1], rates[:, 1, 2] = ca, sa
    rates[:, 2, 1], rates[:, 2, 2] = -sa / cb, ca / cb
    return np.stack([a, b, c], axis=1), rates
