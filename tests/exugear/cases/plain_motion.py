"""Accelerations and energies of bodies by plain loops: what the compiled equations of motion are held against."""

from __future__ import annotations

import math

import numpy as np

from exugear.system.kernels.coordinates import SPIN, TILT, InertiaArrays
from exugear.system.kernels.elastic import ElasticArrays, deformation, scratch_for
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import compiled, kernel, summing_kernel


def accelerations_of(assembly: Assembly, q: Floats, v: Floats, applied: Floats) -> Floats:
    """Accelerations under all forces and the applied generalized forces, shape (size,)."""
    out = np.zeros(assembly.size)
    forces = assembly.forces(q, v) + applied
    accelerations(q, v, assembly.inertia, forces, out)
    if assembly.elastic_bodies:
        set_elastic_accelerations(forces, assembly.elastic, scratch_for(assembly.elastic), out)
    for name, body in assembly.turning.items():
        elastic_slice = assembly.elastic_slices[name]
        out[elastic_slice] = body.accelerations(q[elastic_slice], v[elastic_slice], forces[elastic_slice])
    return out


@compiled
def accelerations(q: Floats, v: Floats, inertia: InertiaArrays, f: Floats, out: Floats) -> None:
    """Solve the equations of motion of the bodies for the accelerations under generalized forces f.

    The formula is that of `exugear.transient.compiled.equations.set_accelerations`; the kinetic energy is that of
    `kinetic_energies`.
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


@kernel
def set_elastic_accelerations(f: Floats, elastic: ElasticArrays, scratch: Floats, out: Floats) -> None:
    """Fill the accelerations of all elastic bodies under generalized forces f into out."""
    sum_ = scratch[1]
    for b in range(elastic.turning.size):
        begin = elastic.first[b]
        size = elastic.first[b + 1] - begin
        for i in range(size):
            sum_[i] = 0.0
        column = elastic.square[b]
        for j in range(size):
            value = f[elastic.coordinate[begin + j]]
            for i in range(size):
                sum_[i] += elastic.inverse[column + i] * value
            column += size
        for i in range(size):
            out[elastic.coordinate[begin + i]] = sum_[i]


@summing_kernel
def row_product(matrix: Floats, begin: int | np.uint64, given: Floats, count: int | np.uint64) -> float:
    """Scalar product of entries of a flat matrix, from `begin` on, with the first entries of a vector.

    Places without a sign spare the processor the question whether they count from the end, so that it takes several
    products at once.
    """
    total = 0.0
    start = np.uint64(begin)
    for j in range(np.uint64(count)):
        total += matrix[start + j] * given[j]
    return total


@kernel
def block_energy(b: int, x: Floats, matrix: Floats, elastic: ElasticArrays) -> float:
    """Scalar x' A x of a block's matrix with its own vector x."""
    size = np.uint64(elastic.first[b + 1] - elastic.first[b])
    total = 0.0
    column = np.uint64(elastic.square[b])
    for i in range(size):
        total += x[i] * row_product(matrix, column, x, size)
        column += size
    return total


@kernel
def elastic_energies(q: Floats, v: Floats, elastic: ElasticArrays, scratch: Floats) -> tuple[float, float, float]:
    """Kinetic and elastic energy (J) of all elastic bodies, and the power that they damp (W)."""
    kinetic = 0.0
    stored = 0.0
    damped = 0.0
    given = scratch[0]
    for b in range(elastic.turning.size):
        for i in range(elastic.first[b], elastic.first[b + 1]):
            given[i - elastic.first[b]] = v[elastic.coordinate[i]]
        kinetic += 0.5 * block_energy(b, given, elastic.mass, elastic)
        deformation(b, q, v, 0.0, elastic, given)
        stored += 0.5 * block_energy(b, given, elastic.stiffness, elastic)
        # Damping is a time times the stiffness: its power is that of the rates, without the common turning.
        deformation(b, v, v, 0.0, elastic, given)
        damped += elastic.damping_time[b] * block_energy(b, given, elastic.stiffness, elastic)
    return kinetic, stored, damped
