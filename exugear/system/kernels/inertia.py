"""Compiled inertia of rigid bodies, symmetric about their axes, on arrays of coordinates.

Coordinates are those of `exugear.system.kernels.coordinates`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from exugear.system.kernels.coordinates import SPIN, TILT
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled


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
