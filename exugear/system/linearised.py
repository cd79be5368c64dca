"""Equations of motion linearised about a state, and their undamped modes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg

from exugear.system.assembly import Assembly
from exugear.system.bearings.kernels.connectors import add_connector_tangents
from exugear.system.bodies.turning_frame import TurningBody
from exugear.system.kernels.springs import SpringArrays, add_spring_forces
from exugear.system.tooth_mesh.kernels.meshes import MeshArrays
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed

DIFFERENCE_STEP = 1e-6
"""Step of central differences, m or rad, and per second."""
ROLLING_STEP = 1e-8
"""The same for rows of rolling elements: a thousandth of what these yield under load, which bends their law."""
RIGID_BODY_LIMIT = 0.1
"""Modes below this frequency (Hz) are motions of the whole train without deflection."""


@dataclass(frozen=True)
class Linearised(Displayed, line=": {mass!n} coordinates, {stiffness!n} elements"):
    """Mass, and stiffness and damping by element, about a state; each matrix (size, size)."""

    mass: Floats
    """(size, size)"""
    stiffness: Mapping[str, Floats]
    damping: Mapping[str, Floats]
    """Element name -> matrix; elements are meshes, bearings, couplings, elastic bodies."""

    @property
    def total_stiffness(self) -> Floats:
        """Sum over all elements."""
        return sum(self.stiffness.values(), start=np.zeros_like(self.mass))

    @property
    def total_damping(self) -> Floats:
        """Sum over all elements."""
        return sum(self.damping.values(), start=np.zeros_like(self.mass))


def linearise(assembly: Assembly, q: Floats, meshes: MeshArrays | None = None) -> Linearised:
    """Matrices about the coordinates q at rest, mesh stiffness averaged over the cycle or that of other `meshes`."""
    stiffness: dict[str, Floats] = {}
    damping: dict[str, Floats] = {}
    rest = np.zeros(assembly.size)
    averaged = assembly.mean_meshes if meshes is None else meshes
    for n, name in enumerate(assembly.mesh_names):
        jq, jv = assembly.mesh_jacobians(q, rest, averaged.one(n))
        stiffness[name], damping[name] = -jq, -jv
    steps = _connector_steps(assembly)
    number = np.arange(len(assembly.connector_names))
    for n, name in enumerate(assembly.connector_names):
        stiffness[name], damping[name] = np.zeros((assembly.size,) * 2), np.zeros((assembly.size,) * 2)
        add_connector_tangents(q, steps * (number == n), assembly.connectors, stiffness[name], damping[name])
    for n, name in enumerate(assembly.spring_names):
        spring = SpringArrays._make(values[n : n + 1] for values in assembly.springs)
        stiffness[name], damping[name] = _tangents(assembly.size, q, spring, add_spring_forces)
    for name, of_body in assembly.elastic_slices.items():
        if name in assembly.turning:
            turning = (of_body, assembly.turning[name])
            stiffness[f"{name}_body"], damping[f"{name}_body"] = _tangents(
                assembly.size, q, turning, _add_turning_forces
            )
            continue
        matrix = np.zeros((assembly.size,) * 2)
        matrix[of_body, of_body] = assembly.elastic_bodies[name].reduced.stiffness
        stiffness[f"{name}_body"] = matrix
        damping[f"{name}_body"] = assembly.gearbox.case.damping.body_time_s * matrix
    return Linearised(assembly.mass_at(q), stiffness, damping)


def tangent_stiffness(assembly: Assembly, q: Floats, meshes: MeshArrays) -> Floats:
    """Stiffness (size, size) of all elements together about the coordinates q at rest.

    The sum over the elements of `linearise`, where no single one is asked for: a tenth of its time with elastic bodies.
    """
    size = assembly.size
    rest = np.zeros(assembly.size)
    stiffness = -assembly.mesh_jacobians(q, rest, meshes)[0]
    damping = np.zeros((size, size))
    add_connector_tangents(q, _connector_steps(assembly), assembly.connectors, stiffness, damping)
    for i, (first, second) in enumerate(assembly.springs.coordinates):
        for one, other in ((first, second), (second, first)):
            stiffness[one, one] += assembly.springs.stiffness[i]
            stiffness[one, other] -= assembly.springs.stiffness[i]
    for name, of_body in assembly.elastic_slices.items():
        if name not in assembly.turning:
            stiffness[of_body, of_body] += assembly.elastic_bodies[name].reduced.stiffness
            continue
        body = assembly.turning[name]
        place = q[of_body]
        still = rest[of_body]
        steps = DIFFERENCE_STEP * np.eye(len(place))
        columns = [body.forces(place - e, still) - body.forces(place + e, still) for e in steps]
        stiffness[of_body, of_body] += np.array(columns).T / (2.0 * DIFFERENCE_STEP)
    return np.asarray(stiffness)


def _connector_steps(assembly: Assembly) -> Floats:
    """Step of the differences that fits each connector."""
    rows = np.diff(assembly.connectors.rolling.first)
    return np.where(rows > 0, ROLLING_STEP, DIFFERENCE_STEP)


def _add_turning_forces(q: Floats, v: Floats, element: tuple[slice, TurningBody], f: Floats) -> None:
    of_body, body = element
    f[of_body] += body.forces(q[of_body], v[of_body])


def _tangents(
    size: int, q: Floats, element: Any, add: Callable[[Floats, Floats, Any, Floats], None]
) -> tuple[Floats, Floats]:
    """Stiffness and damping matrices of one element by central differences of its force."""

    def force(dq: Floats, v: Floats) -> Floats:
        f = np.zeros(size)
        add(q + dq, v, element, f)
        return f

    zero = np.zeros(size)
    steps = DIFFERENCE_STEP * np.eye(size)
    # Columns; a force falls with stiffness times displacement: hence minus ahead of plus.
    stiffness = np.array([force(-e, zero) - force(e, zero) for e in steps]).T / (2.0 * DIFFERENCE_STEP)
    damping = np.array([force(zero, -e) - force(zero, e) for e in steps]).T / (2.0 * DIFFERENCE_STEP)
    return stiffness, damping


def undamped_modes(mass: Floats, stiffness: Floats, motions: Floats | None = None) -> tuple[Floats, Floats]:
    """Solve M x'' + K x = 0 for frequencies (Hz, ascending) and real shapes; M symmetric, K any.

    A preloaded connector or the law `seed` makes K unsymmetric. Equal frequencies may then come out as a complex pair
    that differs from real by round-off; its real and imaginary parts span the same plane. `motions` (size, n) are
    those that are free, all by default.
    """
    # In coordinates with unit mass the problem is an ordinary one; only in free motions, an orthonormal basis of them.
    root = np.linalg.cholesky(mass)
    basis = scipy.linalg.orth(root.T @ (np.eye(len(mass)) if motions is None else motions))
    free = np.linalg.solve(root.T, basis)
    values, vectors = scipy.linalg.eig(free.T @ stiffness @ free)
    shapes = free @ np.where(values.imag < 0.0, vectors.imag, vectors.real)
    order = np.argsort(values.real)
    frequency = np.sqrt(np.maximum(values.real[order], 0.0)) / (2.0 * np.pi)
    return frequency, shapes[:, order]


def growth_rate(linear: Linearised) -> float:
    """Largest real part of the eigenvalues of M x'' + D x' + K x = 0, 1/s, the free rotation left out."""
    size = len(linear.mass)
    lower = np.linalg.solve(linear.mass, np.hstack([-linear.total_stiffness, -linear.total_damping]))
    values = scipy.linalg.eigvals(np.vstack([np.eye(size, 2 * size, size), lower]))
    elastic = np.abs(values.imag) > 2.0 * np.pi * RIGID_BODY_LIMIT
    return float(values.real[elastic].max(initial=-np.inf))
