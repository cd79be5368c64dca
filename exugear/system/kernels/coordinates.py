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

import math
from typing import NamedTuple

import numpy as np

from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled

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


@compiled
def accelerations(q: Floats, v: Floats, inertia: InertiaArrays, f: Floats, out: Floats) -> None:
    """Solve the equations of motion of the bodies for the accelerations under generalized forces f.

    Lagrange's equations of an axially symmetric body in Rxyz coordinates, with p = J_a (spin' + a' sin b), the angular
    momentum about its axis (the kinetic energy is that of `kinetic_energies`):

        J_t cos^2 b a'' = Q_a - Q_spin sin b - p b' cos b + 2 J_t a' b' sin b cos b
        J_t b'' = Q_b - J_t a'^2 sin b cos b + p a' cos b,   spin'' = Q_spin / J_a - a'' sin b - a' b' cos b
    """
    for n in range(inertia.body.size):
        o = inertia.body[n]
        jt = inertia.transverse[n]
        ja = inertia.axial[n]
        for i in range(3):
            out[o + i] = f[o + i] / inertia.mass[n]
        a = o + TILT
        b = o + TILT + 1
        spin = o + SPIN
        sb = math.sin(q[b])
        cb = math.cos(q[b])
        da = v[a]
        db = v[b]
        p = ja * (v[spin] + da * sb)
        # The first tilt's equation contains spin'': the spin's own equation, solved last, eliminates it.
        out[a] = (f[a] - f[spin] * sb - p * db * cb + 2.0 * jt * da * db * sb * cb) / (jt * cb * cb)
        out[b] = (f[b] - jt * da * da * sb * cb + p * da * cb) / jt
        out[spin] = f[spin] / ja - out[a] * sb - da * db * cb
    for n in range(inertia.spin.size):
        out[inertia.spin[n]] = f[inertia.spin[n]] / inertia.spin_inertia[n]


@compiled
def kinetic_energies(q: Floats, v: Floats, inertia: InertiaArrays, out: Floats) -> None:
    """Fill the kinetic energy (J) of each body, six-coordinate bodies first."""
    for n in range(inertia.body.size):
        o = inertia.body[n]
        square = v[o] ** 2 + v[o + 1] ** 2 + v[o + 2] ** 2
        # Angular velocity transverse to the axis, and about it: spin' + a' sin b.
        sb = math.sin(q[o + TILT + 1])
        cb = math.cos(q[o + TILT + 1])
        tilting = (v[o + TILT] * cb) ** 2 + v[o + TILT + 1] ** 2
        spin = v[o + SPIN] + v[o + TILT] * sb
        out[n] = 0.5 * (inertia.mass[n] * square + inertia.transverse[n] * tilting + inertia.axial[n] * spin**2)
    for n in range(inertia.spin.size):
        out[inertia.body.size + n] = 0.5 * inertia.spin_inertia[n] * v[inertia.spin[n]] ** 2


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
