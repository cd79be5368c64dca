"""Law of torsional springs on arrays of coordinates, which are those of `exugear.system.kernels.coordinates`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fe_ste.tools.arrays import Floats, Integers


class SpringArrays(NamedTuple):
    """Torsional springs between two spins: (s, 2) coordinates, (s,) N m/rad and N m s/rad."""

    coordinates: Integers
    stiffness: Floats
    damping: Floats


def add_spring_forces(q: Floats, v: Floats, springs: SpringArrays, f: Floats) -> None:
    """Add the torques of the torsional springs to f."""
    first, second = springs.coordinates.T
    # A shaft that the second body is ahead of pulls the first one along.
    torque = springs.stiffness * (q[second] - q[first]) + springs.damping * (v[second] - v[first])
    np.add.at(f, first, torque)
    np.subtract.at(f, second, torque)
