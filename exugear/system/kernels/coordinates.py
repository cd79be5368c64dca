"""Coordinates of bodies in all compiled models, inertia of rigid bodies, and torsional springs.

Coordinates are those of Exudyn's ``NodeRigidBodyRxyz``: translations x, y, z of the body's node (m), tilts a and b
(rad) about x and about the tilted y, and the unwrapped rotation about the body's own z axis (rad), called spin. The
axes of the body are rotated by Rx(a) Ry(b) Rz(spin). All coordinates are zero in the reference state. Rates are the
time derivatives of the coordinates. Generalized forces are conjugate to them: N for translations, N m for angles.

A body has all six coordinates consecutively, or only its spin; the ground has none. Each seat of a flexible body also
has six, so that a mesh or a bearing treats it as a rigid body. Models that permit missing coordinates give them the
index -1. In the arrays of the compiled solver, missing coordinates refer to one that remains zero.

Numbers in this module become part of machine code: `fe_ste.tools.compilation` recompiles when this file changes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fe_ste.tools.arrays import Floats, Integers

# Coordinates of bodies as used by all compiled models: their meaning and index among the six of a body

AXIAL = 2
"""Translation along z, after those along x and y."""
TILT = 3
"""First of the two tilts, followed by the other one."""
SPIN = 5
"""Rotation about the body's axis."""
BODY_SIZE = 6
"""Number of coordinates of a body or a seat."""
PADDED, PADDED_TILT, PADDED_SPIN = 8, 4, 6
"""Size of the padded row x y z 0 a b spin 0, the form of a body's coordinates in loops optimised for speed, and the
indices of the first tilt and of the spin in it.
"""
COSINE, SINE = range(2)
"""Columns of the cosines and sines of all rotation angles, which such loops compute once per evaluation."""


# Compiled inertia of rigid bodies, symmetric about their axes, on arrays of coordinates


class InertiaArrays(NamedTuple):
    """Inertias of axially symmetric bodies with the centre of mass at the node."""

    body: Integers
    """(b,) first coordinate of each body with six coordinates."""
    mass: Floats
    transverse: Floats
    axial: Floats
    """(b,) mass (kg), transverse and axial moment of inertia (kg m2)."""
    spin: Integers
    """(s,) coordinate of each body that has only its spin."""
    spin_inertia: Floats
    """(s,) axial moment of inertia, kg m2."""


# Torsional springs on arrays of coordinates


class SpringArrays(NamedTuple):
    """Torsional springs between two rotations: (s, 2) coordinates, (s,) N m/rad and N m s/rad."""

    coordinates: Integers
    stiffness: Floats
    damping: Floats


def add_spring_forces(q: Floats, v: Floats, springs: SpringArrays, f: Floats) -> None:
    """Add the torques of the torsional springs to f."""
    first, second = springs.coordinates.T
    # If the second body is ahead, the torque accelerates the first one.
    torque = springs.stiffness * (q[second] - q[first]) + springs.damping * (v[second] - v[first])
    np.add.at(f, first, torque)
    np.subtract.at(f, second, torque)
