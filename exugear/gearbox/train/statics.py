"""What a gear train carries at rest: forces of meshes and torques of couplings that balance outer torques."""

from __future__ import annotations

import numpy as np

from fe_ste.tools.arrays import Floats

UNLOADED = 1e-9
"""Part of the largest load below which a mesh counts as unloaded: round-off of the balance."""
BALANCE_TOLERANCE = 1e-9
"""Part of the largest torque that may be left over where torques count as held."""


def holding_forces(rows: Floats, torques: Floats) -> Floats | None:
    """Return the forces of rows that hold torques on the spins; of all that do, those of least norm.

    Parameters
    ----------
    rows : (constraints, spins) torques on the spins per unit force of each constraint
    torques : (spins,) N m

    Returns
    -------
    array (constraints,), or None where no forces hold the torques.

    Examples
    --------
    Wheels of 1 m and 2 m in mesh, in balance and out of it:

    >>> holding_forces(np.array([[1.0, 2.0]]), np.array([10.0, 20.0]))
    array([10.])
    >>> holding_forces(np.array([[1.0, 2.0]]), np.array([10.0, -20.0])) is None
    True
    """
    balance = rows.T
    forces = np.linalg.lstsq(balance, torques, rcond=1e-12)[0]
    if np.abs(balance @ forces - torques).max() > BALANCE_TOLERANCE * np.abs(torques).max():
        return None
    return np.asarray(forces)


def without_round_off(forces: Floats, largest_torque: float, smallest_radius: float) -> Floats:
    """Mesh forces with those set to zero that are round-off of the balance.

    Parameters
    ----------
    forces : (meshes,) N
    largest_torque : of the torques that they balance, N m
    smallest_radius : of the base circles on which they act, m
    """
    return np.where(np.abs(forces) > UNLOADED * largest_torque / smallest_radius, forces, 0.0)
