"""Compiled law of torsional springs on arrays of coordinates, which are those of `exugear.kernels.coordinates`."""

from __future__ import annotations

from typing import NamedTuple

from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled


class SpringArrays(NamedTuple):
    """Torsional springs between two spins: (s, 2) coordinates, (s,) N m/rad and N m s/rad."""

    coordinates: Integers
    stiffness: Floats
    damping: Floats


@compiled
def add_spring_forces(q: Floats, v: Floats, springs: SpringArrays, f: Floats) -> None:
    """Add the torques of the torsional springs to f."""
    for n in range(springs.coordinates.shape[0]):
        i, j = springs.coordinates[n]
        # A shaft that the second body is ahead of pulls the first one along.
        torque = springs.stiffness[n] * (q[j] - q[i]) + springs.damping[n] * (v[j] - v[i])
        f[i] += torque
        f[j] -= torque
