"""The bodies of a gearbox that move in floating frames, and the forces that they share with others.

What is special about Exudyn's floating frame is told in `exugear.transient.exudyn_model.floating`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from exugear.system.assembly import Assembly
from exugear.system.bearings.kernels.connectors import add_connector_forces
from exugear.system.bodies.floating_coordinates import (
    FRAME_COORDINATES,
    MODAL,
    FloatingCoordinates,
    FloatingMotion,
)
from exugear.system.kernels.coordinates import SPIN
from exugear.system.kernels.springs import SpringArrays, add_spring_forces
from exugear.system.tooth_mesh.kernels.meshes import MeshArrays
from exugear.transient.exudyn_model.floating_object import add_floating_body
from exugear.transient.exudyn_model.library import items
from fe_ste.tools.arrays import Floats

Law = Callable[[float, Floats, Floats], Floats]
"""Generalized forces on an assembly's coordinates as a function of time, coordinates and velocities."""
DIFFERENCE = 1e-6
"""Step that forces of supports are differentiated with, m or rad, and per second."""


class FloatingBodies:
    """The bodies of an assembly that move in floating frames, and the forces that they share with others.

    The laws of meshes, bearings and couplings stay those of the assembly on its own coordinates: those of each floating
    body follow from its frame and modes, and forces go back by the transposed matrix of their rates. In the solver's
    vector of coordinates those of the frame and modes stand where the assembly has those of the body.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    q, v : (size,) initial coordinates and velocities of the assembly

    Attributes
    ----------
    nodes : rigid and modal node of each body by name
    connectors, couplings : numbers of the bearings and couplings that act on these bodies
    slices : place of each elastic body in the solver's vector
    size : its length
    """

    def __init__(self, mbs: Any, assembly: Assembly, q: Floats, v: Floats) -> None:
        self._assembly = assembly
        self._coordinates: dict[str, FloatingCoordinates] = {}
        self.nodes: dict[str, list[Any]] = {}
        self._spin_terms: dict[str, tuple[Floats, Floats, Floats]] = {}
        for name, body in assembly.floating.items():
            in_assembly = assembly.elastic_slices[name]
            coordinates = FloatingCoordinates(body)
            frame_q, frame_v = coordinates.of(q[in_assembly], v[in_assembly])
            rigid, modal = add_floating_body(mbs, body)
            self.nodes[name] = [rigid, modal]
            mbs.SetNodeParameter(rigid, "initialCoordinates", frame_q[:FRAME_COORDINATES].tolist())
            mbs.SetNodeParameter(rigid, "initialVelocities", frame_v[:FRAME_COORDINATES].tolist())
            mbs.SetNodeParameter(modal, "initialCoordinates", frame_q[MODAL].tolist())
            mbs.SetNodeParameter(modal, "initialCoordinates_t", frame_v[MODAL].tolist())
            self._coordinates[name] = coordinates
            self._spin_terms[name] = body.spin_stiffness, body.spin_damping, body.centrifugal
        self._start = q, v
        self._last_spins = {name: float(q[assembly.spin[name]]) for name in self._coordinates}
        self._is_floating = np.zeros(assembly.size, dtype=bool)
        for name in self._coordinates:
            self._is_floating[assembly.elastic_slices[name]] = True
        ends = assembly.connectors.bodies
        pairs = assembly.springs.coordinates
        self.connectors = np.flatnonzero(((ends >= 0) & self._is_floating[ends]).any(axis=1))
        self.couplings = np.flatnonzero(self._is_floating[pairs].any(axis=1))
        self.slices: dict[str, slice] = {}
        elastic = sum(body.reduced.size for body in assembly.elastic_bodies.values())
        self._rigid_count = begin = assembly.size - elastic
        for name, in_assembly in assembly.elastic_slices.items():
            floats = name in self._coordinates
            count = self._coordinates[name].count if floats else in_assembly.stop - in_assembly.start
            self.slices[name] = slice(begin, begin + count)
            begin += count
        self.size = begin

    def accept(self, q: Floats) -> None:
        """Take coordinates (size,) of the assembly as those of the last step: spins will be nearest to theirs."""
        self._last_spins = {name: float(q[self._assembly.spin[name]]) for name in self._last_spins}

    def state(self, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Coordinates and velocities of the assembly from those of the solver."""
        return self._state(q, v)[:2]

    def _state(self, q: Floats, v: Floats) -> tuple[Floats, Floats, dict[str, FloatingMotion]]:
        """Coordinates and velocities of the assembly, and the motion of each floating body."""
        assembly_q = np.empty(self._assembly.size)
        assembly_v = np.empty(self._assembly.size)
        motions: dict[str, FloatingMotion] = {}
        rigid = slice(0, self._rigid_count)
        assembly_q[rigid], assembly_v[rigid] = q[rigid], v[rigid]
        for name, in_assembly in self._assembly.elastic_slices.items():
            in_solver = self.slices[name]
            if name in self._coordinates:
                motion = self._coordinates[name].motion(q[in_solver], v[in_solver], self._last_spins[name])
                assembly_q[in_assembly], assembly_v[in_assembly] = motion.coordinates, motion.velocities
                motions[name] = motion
            else:
                assembly_q[in_assembly], assembly_v[in_assembly] = q[in_solver], v[in_solver]
        return assembly_q, assembly_v, motions

    def add_forces(self, mbs: Any, nodes: list[Any], meshes: MeshArrays | None, applied: Law) -> None:
        """Add one object on all nodes for meshes, and for all else that acts on the floating bodies.

        Parameters
        ----------
        mbs : exudyn.MainSystem
        nodes : of all bodies in the order of the assembly's coordinates
        meshes : None leaves them out
        applied : what acts from outside, on any coordinates; taken for the floating bodies alone
        """
        assembly = self._assembly
        connectors = assembly.connectors.chosen(self.connectors)
        springs = SpringArrays._make(values[self.couplings] for values in assembly.springs)
        damping_time = assembly.gearbox.case.damping.body_time_s
        matrices = {name: assembly.elastic_bodies[name].reduced for name in self._coordinates}

        def supports(t: float, q: Floats, v: Floats) -> Floats:
            f = np.where(self._is_floating, applied(t, q, v) + assembly.weight, 0.0)
            add_connector_forces(q, v, connectors, f)
            add_spring_forces(q, v, springs, f)
            for name, body in matrices.items():
                of_body = assembly.elastic_slices[name]
                deforming = v[of_body] - v[of_body][SPIN] * body.spin
                f[of_body] -= damping_time * (body.stiffness @ deforming)
            return f

        def force(mbs: Any, t: float, item: int, coordinates: Any, velocities: Any) -> Floats:
            solver_q = np.array(coordinates)
            solver_v = np.array(velocities)
            q, v, motions = self._state(solver_q, solver_v)
            f = supports(t, q, v)
            if meshes is not None:
                f += assembly.mesh_forces(q, v, meshes)
            return self._onto_frames(f, solver_q, solver_v, motions)

        # Supports are nearly linear: their derivatives at the start serve Newton's method throughout.
        by_coordinates, by_rates = _differentiated(lambda q, v: supports(0.0, q, v), *self._start)

        def derivatives(
            mbs: Any, t: float, item: int, coordinates: Any, velocities: Any, factor_q: float, factor_v: float
        ) -> Floats:
            solver_q = np.array(coordinates)
            solver_v = np.array(velocities)
            q, v, motions = self._state(solver_q, solver_v)
            matrix = -factor_q * by_coordinates - factor_v * by_rates
            if meshes is not None:
                by_q, by_v = assembly.mesh_jacobians(q, v, meshes)
                matrix -= factor_q * by_q + factor_v * by_v
            return self._matrix_onto_frames(matrix, solver_q, solver_v, motions, factor_q, factor_v)

        mbs.AddObject(
            items.ObjectGenericODE2(nodeNumbers=nodes, forceUserFunction=force, jacobianUserFunction=derivatives)
        )

    def _onto_frames(self, f: Floats, q: Floats, v: Floats, motions: Mapping[str, FloatingMotion]) -> Floats:
        """Bring forces on the assembly's coordinates to the solver's, and add what Exudyn leaves out of spinning."""
        on_solver = np.empty(self.size)
        on_solver[: self._rigid_count] = f[: self._rigid_count]
        for name, in_assembly in self._assembly.elastic_slices.items():
            of_body = f[in_assembly]
            on_solver[self.slices[name]] = of_body @ motions[name].jacobian if name in motions else of_body
        for name in motions:
            (stiffness, damping, steady), speed = self._spin_terms[name], self._speed(name, q, v)
            modal = self._modal(name)
            on_solver[modal] -= speed**2 * (stiffness @ q[modal] + steady) + speed * (damping @ v[modal])
        return on_solver

    def _speed(self, name: str, q: Floats, v: Floats) -> float:
        """Spin speed of a floating body at coordinates and velocities of the solver, rad/s."""
        in_solver = self.slices[name]
        return self._coordinates[name].speed(q[in_solver], v[in_solver])

    def _modal(self, name: str) -> slice:
        """Modal coordinates of a floating body in the solver's vector."""
        in_solver = self.slices[name]
        return slice(in_solver.start + FRAME_COORDINATES, in_solver.stop)

    def _matrix_onto_frames(
        self,
        matrix: Floats,
        q: Floats,
        v: Floats,
        motions: Mapping[str, FloatingMotion],
        factor_q: float,
        factor_v: float,
    ) -> Floats:
        """Do the same with derivatives (size, size) of forces that stand on the left-hand side."""
        rows = np.empty((self.size, self._assembly.size))
        on_solver = np.empty((self.size, self.size))
        rigid = slice(0, self._rigid_count)
        rows[rigid] = matrix[rigid]
        for name, in_assembly in self._assembly.elastic_slices.items():
            of_body = matrix[in_assembly]
            rows[self.slices[name]] = motions[name].jacobian.T @ of_body if name in motions else of_body
        on_solver[:, rigid] = rows[:, rigid]
        for name, in_assembly in self._assembly.elastic_slices.items():
            of_body = rows[:, in_assembly]
            on_solver[:, self.slices[name]] = of_body @ motions[name].jacobian if name in motions else of_body
        for name in motions:
            (stiffness, damping, _), speed = self._spin_terms[name], self._speed(name, q, v)
            modal = self._modal(name)
            on_solver[modal, modal] += factor_q * speed**2 * stiffness + factor_v * speed * damping
        return on_solver


def _differentiated(law: Callable[[Floats, Floats], Floats], q: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Differentiate forces that are nearly linear to q and to v, each (size, size)."""
    size = len(q)
    by_q = np.empty((size, size))
    by_v = np.empty((size, size))
    for n, step in enumerate(DIFFERENCE * np.eye(size)):
        by_q[:, n] = (law(q + step, v) - law(q - step, v)) / (2.0 * DIFFERENCE)
        by_v[:, n] = (law(q, v + step) - law(q, v - step)) / (2.0 * DIFFERENCE)
    return by_q, by_v
