"""Coordinates of bodies as used by all compiled models, inertia of rigid bodies, torsional springs.

Coordinates are those of Exudyn's ``NodeRigidBodyRxyz``: translations x, y, z of the body's node (m), tilts a and b
(rad) about x and about the tilted y, and the unwrapped spin about the body's own z axis (rad), so that its axes
are turned by Rx(a) Ry(b) Rz(spin). All are zero in the reference state. Rates are the time derivatives of the
coordinates. Generalized forces are conjugate to them: N for translations, N m for angles.

A body has all six one after the other, or its spin alone; the ground has none. So has each seat of an elastic body,
which a mesh or a bearing treats as a rigid body. Models that allow for missing coordinates give them the index -1; in
the arrays of the compiled solver they point to a coordinate that stays zero.

Numbers here become part of machine code: `fe_ste.tools.compilation` recompiles when this file changes.

Coordinates are those of `exugear.system.kernels.coordinates`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled

# Coordinates of bodies, as all compiled laws read them: what each is, and where it stands among a body's six

AXIAL = 2
"""Translation along z, behind those along x and y."""
TILT = 3
"""First of the two tilts; the other one follows."""
SPIN = 5
"""Spin about the body's axis."""
BODY_SIZE = 6
"""Coordinates of a body or a seat."""
PADDED, PADDED_TILT, PADDED_SPIN = 8, 4, 6
"""Size of the padded row x y z 0 a b spin 0 that loops arranged for speed take a body's coordinates in, first tilt and
spin there."""
COSINE, SINE = range(2)
"""Columns of the cosines and sines of all angles that turn anything, which such loops take once per evaluation."""


# Compiled inertia of rigid bodies, symmetric about their axes, on arrays of coordinates


class InertiaArrays(NamedTuple):
    """Inertias, axially symmetric with the centre of mass at the node."""

    body: Integers
    """(b,) first coordinate of each body with six coordinates."""
    mass: Floats
    transverse: Floats
    axial: Floats
    """(b,) kg, kg m2, kg m2."""
    spin: Integers
    """(s,) coordinate of each body with its spin alone."""
    spin_inertia: Floats
    """(s,) kg m2."""


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
        # The first tilt's equation contains spin'': it is eliminated with the spin's own equation, solved last.
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
        # Angular velocity across the axis, and about it: spin' + a' sin b.
        sb = math.sin(q[o + TILT + 1])
        cb = math.cos(q[o + TILT + 1])
        tilting = (v[o + TILT] * cb) ** 2 + v[o + TILT + 1] ** 2
        spin = v[o + SPIN] + v[o + TILT] * sb
        out[n] = 0.5 * (inertia.mass[n] * square + inertia.transverse[n] * tilting + inertia.axial[n] * spin**2)
    for n in range(inertia.spin.size):
        out[inertia.body.size + n] = 0.5 * inertia.spin_inertia[n] * v[inertia.spin[n]] ** 2


# Law of torsional springs on arrays of coordinates, which are those of `exugear.system.kernels.coordinates`


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
