"""Elastic bodies in Exudyn, by its floating frame of reference.

The modes of a solid (`exugear.bodies.floating`) are those of an ``ObjectFFRFreducedOrder`` on a rigid-body node with
Euler
parameters. Forces on its seats, such as those of bearings and meshes, are an ``ObjectGenericODE2`` on the object's two
nodes (`FloatingSystem`, a body by itself) or on all nodes of a gearbox (`FloatingBodies`). For shafts it is the second
way beside the frame that does not turn (`exugear.bodies.reduction`), whose constant matrices run far faster.

What the object of Exudyn 1.13 gets wrong, and what is done about it:

- It softens a spinning body by the centrifugal forces of its deformation without the tension that they make: torsion
  falls to sqrt(w^2 - Omega^2). The missing stiffness Omega^2 int rho d_phi phi_i . d_phi phi_j, d_phi = x d_y - y d_x,
  is added (`stiffening`). It is that of a body of revolution that spins about z and follows the speed from instant to
  instant. Forces of angular acceleration are Exudyn's own; the frame that does not turn leaves them out (Omega' C q),
  which is about the angular acceleration over speed times frequency: nothing in a run-up of seconds.
- On Tait-Bryan angles its gyroscopic moments are wrong. It is built on Euler parameters, whose angle is not unwrapped:
  the spin at a seat of a body by itself is the elastic twist alone, in a gearbox the one nearest to the last step's.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from exugear.bodies.floating import FloatingBody
from exugear.bodies.floating_coordinates import FloatingCoordinates, FloatingMotion
from exugear.bodies.rotations import euler_rotation
from exugear.dynamics.assembly import Assembly
from exugear.kernels.connectors import ConnectorArrays, add_connector_forces
from exugear.kernels.meshes import MeshArrays
from exugear.kernels.springs import SpringArrays, add_spring_forces
from fe_ste.tools.arrays import Floats

Rotation = Literal["euler_parameters", "tait_bryan"]
Law = Callable[[float, Floats, Floats], Floats]
"""Generalized forces on an assembly's coordinates as a function of time, coordinates and velocities."""
DIFFERENCE = 1e-6
"""Step that forces of supports are differentiated with, m or rad, and per second."""

# Exudyn's type stubs cover a part of it only, so its modules count as untyped.
exudyn: Any = importlib.import_module("exudyn")
items: Any = importlib.import_module("exudyn.itemInterface")
elements: Any = importlib.import_module("exudyn.FEM")
kinematics: Any = importlib.import_module("exudyn.rigidBodyUtilities")
exudyn.config.suppressWarnings = True


class SolverFailure(RuntimeError):
    """Exudyn's solver gave up."""


@dataclass(frozen=True)
class SeatLaw:
    """Forces on the seats of a body.

    Attributes
    ----------
    force : function of time, motion and velocity (6 s,) of the seats
        Gives forces and moments (6 s,) on them, in axes that do not turn.
    stiffness, damping : (6 s, 6 s) about what its derivatives are, for Newton's method
    """

    force: Callable[[float, Floats, Floats], Floats]
    stiffness: Floats
    damping: Floats


def linear_supports(stiffness: Floats, damping: Floats) -> SeatLaw:
    """Springs and dampers between the seats and the ground, (6 s, 6 s); about z they see the elastic twist alone."""
    return SeatLaw(lambda t, motion, velocity: -stiffness @ motion - damping @ velocity, stiffness, damping)


class FloatingSystem:
    """A floating body in an Exudyn system of its own, with forces on its seats.

    Parameters
    ----------
    body : FloatingBody
    law : SeatLaw
    speed : float
        Spin about z at the beginning, rad/s.
    velocity : (3,) of the mass centre at the beginning, m/s
    amplitude_rates : (k,) rates of the modes at the beginning, m kg^0.5/s
    stiffening : bool
        Add the centrifugal tension that Exudyn leaves out. False shows what is missing.
    rotation : {"euler_parameters", "tait_bryan"}
        Tait-Bryan angles show what is wrong with them.

    Attributes
    ----------
    mbs : exudyn.MainSystem
        The system, open to everything Exudyn offers.
    """

    def __init__(
        self,
        body: FloatingBody,
        law: SeatLaw,
        speed: float,
        velocity: Floats,
        amplitude_rates: Floats,
        stiffening: bool = True,
        rotation: Rotation = "euler_parameters",
    ) -> None:
        self.body, self.law, self.stiffening = body, law, stiffening
        self._euler = rotation == "euler_parameters"
        self._container = exudyn.SystemContainer()
        self.mbs = self._container.AddSystem()
        rigid, modal = add_floating_body(self.mbs, body, rotation)
        self._reference = np.array([1.0, 0.0, 0.0, 0.0]) if self._euler else np.zeros(3)
        turning = [0.0, 0.0, 0.0, speed / 2.0] if self._euler else [0.0, 0.0, speed]
        self.mbs.SetNodeParameter(rigid, "initialVelocities", [*np.asarray(velocity).tolist(), *turning])
        self.mbs.SetNodeParameter(modal, "initialCoordinates_t", np.asarray(amplitude_rates).tolist())
        self._spin_stiffness, self._spin_damping = body.spin_stiffness, body.spin_damping
        self._arms = body.places - body.centre
        by_seat = body.at_seats.reshape(len(body.seats), 2, 3, -1)
        self._moves, self._turns = by_seat[:, 0], by_seat[:, 1]
        self.mbs.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=[rigid, modal], forceUserFunction=self._force, jacobianUserFunction=self._jacobian
            )
        )
        self.mbs.Assemble()
        firsts = [self.mbs.GetNodeODE2Index(node) for node in (rigid, modal)]
        sizes = [3 + len(self._reference), len(body.frequencies)]
        self._order = np.concatenate([first + np.arange(size) for first, size in zip(firsts, sizes, strict=True)])

    def _frame(self, q: Floats) -> tuple[Floats, Floats]:
        """Rotation matrix, and matrix from rates of the rotation's parameters to angular velocity."""
        parameters = q[3 : 3 + len(self._reference)] + self._reference
        if self._euler:
            return euler_rotation(parameters)
        return kinematics.RotXYZ2RotationMatrix(parameters), kinematics.RotXYZ2G(parameters)

    def seat_motion(self, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Motion (6 s,) and velocity of the seats in axes that do not turn, from the object's coordinates.

        Tilts are those of the seat's axis; about z the motion is the elastic twist, the velocity the speed.
        """
        turn, _, arms, jacobian = self._kinematics(q)
        amplitudes = q[3 + len(self._reference) :]
        spatial = (jacobian @ v).reshape(-1, 6)
        axes = turn[:, 2] + np.cross(self._turns @ amplitudes @ turn.T, turn[:, 2])
        axis_rates = np.cross(spatial[:, 3:], axes)
        motion, velocity = np.empty_like(spatial), spatial.copy()
        motion[:, :3] = q[:3] + arms - self._arms
        motion[:, 3], motion[:, 4] = -axes[:, 1], axes[:, 0]
        motion[:, 5] = self._turns[:, 2] @ amplitudes
        velocity[:, 3], velocity[:, 4] = -axis_rates[:, 1], axis_rates[:, 0]
        return motion.ravel(), velocity.ravel()

    def _kinematics(self, q: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Rotation, its rate matrix, arms of the seats (s, 3), and velocities of the seats per rate (6 s, n)."""
        turn, rates = self._frame(q)
        first = 3 + len(self._reference)
        arms = (self._arms + self._moves @ q[first:]) @ turn.T
        jacobian = np.zeros((len(arms), 6, len(q)))
        jacobian[:, :3, :3] = np.eye(3)
        jacobian[:, :3, 3:first] = np.cross(rates.T[None], arms[:, None]).transpose(0, 2, 1)
        jacobian[:, 3:, 3:first] = rates
        jacobian[:, :3, first:] = turn @ self._moves
        jacobian[:, 3:, first:] = turn @ self._turns
        return turn, rates, arms, jacobian.reshape(-1, len(q))

    def _force(self, mbs: Any, t: float, item: int, coordinates: Any, velocities: Any) -> Floats:
        q, v = np.array(coordinates), np.array(velocities)
        turn, rates, _, jacobian = self._kinematics(q)
        force: Floats = self.law.force(t, *self.seat_motion(q, v)) @ jacobian
        if self.stiffening:
            first, speed = 3 + len(self._reference), self._speed(turn, rates, v)
            force[first:] -= speed**2 * (self._spin_stiffness @ q[first:]) + speed * (self._spin_damping @ v[first:])
        return force

    def _jacobian(
        self, mbs: Any, t: float, item: int, coordinates: Any, velocities: Any, factor_q: float, factor_v: float
    ) -> Floats:
        q, v = np.array(coordinates), np.array(velocities)
        turn, rates, _, jacobian = self._kinematics(q)
        matrix: Floats = jacobian.T @ (factor_q * self.law.stiffness + factor_v * self.law.damping) @ jacobian
        if self.stiffening:
            first, speed = 3 + len(self._reference), self._speed(turn, rates, v)
            matrix[first:, first:] += factor_q * speed**2 * self._spin_stiffness + factor_v * speed * self._spin_damping
        return matrix

    def _speed(self, turn: Floats, rates: Floats, v: Floats) -> float:
        """Spin speed about the body's own axis, rad/s."""
        return float(turn[:, 2] @ rates @ v[3 : 3 + len(self._reference)])

    def run(self, steps: int, step: float) -> tuple[Floats, Floats]:
        """Integrate by generalized-alpha; return times (steps + 1,) and motions of the seats (steps + 1, 6 s).

        Raises
        ------
        SolverFailure
            Exudyn gave up.
        """
        settings = exudyn.SimulationSettings()
        integration = settings.timeIntegration
        integration.endTime, integration.numberOfSteps = steps * step, steps
        integration.verboseMode = 0
        integration.generalizedAlpha.spectralRadius = 0.95
        integration.newton.useModifiedNewton = True
        settings.solutionSettings.writeSolutionToFile = False
        settings.displayStatistics = False
        times, motions = [], []

        def after_step(mbs: Any, t: float) -> bool:
            data = mbs.systemData
            q, v = np.array(data.GetODE2Coordinates())[self._order], np.array(data.GetODE2Coordinates_t())[self._order]
            times.append(t)
            motions.append(self.seat_motion(q, v)[0])
            return True

        self.mbs.SetPostStepUserFunction(after_step)
        try:
            exudyn.MainSolverImplicitSecondOrder().SolveSystem(self.mbs, settings)
        except exudyn.ExudynError as error:
            raise SolverFailure(f"body {self.body.name}: {str(error).splitlines()[0]}") from None
        return np.array(times), np.array(motions)


class FloatingBodies:
    """The bodies of an assembly that move in floating frames, and the forces that they share with others.

    The laws of meshes, bearings and couplings stay those of the assembly on its own coordinates: those of each floating
    body follow from its frame and modes, and forces go back by the transposed matrix of their rates. In the solver's
    vector of coordinates those of the frame and modes stand where the assembly has those of the body.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    assembly : Assembly
    q, v : (size,) arrays
        Initial coordinates and velocities of the assembly.

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
            place = assembly.elastic_slices[name]
            coordinates = FloatingCoordinates(body)
            own, rates = coordinates.of(q[place], v[place])
            rigid, modal = add_floating_body(mbs, body)
            self.nodes[name] = [rigid, modal]
            mbs.SetNodeParameter(rigid, "initialCoordinates", own[:7].tolist())
            mbs.SetNodeParameter(rigid, "initialVelocities", rates[:7].tolist())
            mbs.SetNodeParameter(modal, "initialCoordinates", own[7:].tolist())
            mbs.SetNodeParameter(modal, "initialCoordinates_t", rates[7:].tolist())
            self._coordinates[name] = coordinates
            self._spin_terms[name] = body.spin_stiffness, body.spin_damping, body.centrifugal
        self._start = q, v
        self._near = {name: float(q[assembly.spin[name]]) for name in self._coordinates}
        taken = np.zeros(assembly.size, dtype=bool)
        for name in self._coordinates:
            taken[assembly.elastic_slices[name]] = True
        ends, pairs = assembly.connectors.bodies, assembly.springs.coordinates
        self.connectors = np.flatnonzero(((ends >= 0) & taken[ends]).any(axis=1))
        self.couplings = np.flatnonzero(taken[pairs].any(axis=1))
        self._taken = taken
        self.slices: dict[str, slice] = {}
        elastic = sum(body.reduced.size for body in assembly.elastic_bodies.values())
        self._begin = first = assembly.size - elastic
        for name, place in assembly.elastic_slices.items():
            floats = name in self._coordinates
            count = self._coordinates[name].count if floats else place.stop - place.start
            self.slices[name] = slice(first, first + count)
            first += count
        self.size = first

    def accept(self, q: Floats) -> None:
        """Take coordinates (size,) of the assembly as those of the last step: spins will be nearest to theirs."""
        self._near = {name: float(q[self._assembly.spin[name]]) for name in self._near}

    def state(self, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Coordinates and velocities of the assembly from those of the solver."""
        return self._state(q, v)[:2]

    def _state(self, q: Floats, v: Floats) -> tuple[Floats, Floats, dict[str, FloatingMotion]]:
        found_q, found_v, motions = np.empty(self._assembly.size), np.empty(self._assembly.size), {}
        found_q[: self._begin], found_v[: self._begin] = q[: self._begin], v[: self._begin]
        for name, place in self._assembly.elastic_slices.items():
            own = self.slices[name]
            if name in self._coordinates:
                motion = self._coordinates[name].motion(q[own], v[own], self._near[name])
                found_q[place], found_v[place], motions[name] = motion.coordinates, motion.velocities, motion
            else:
                found_q[place], found_v[place] = q[own], v[own]
        return found_q, found_v, motions

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
        connectors = ConnectorArrays._make(values[self.connectors] for values in assembly.connectors)
        springs = SpringArrays._make(values[self.couplings] for values in assembly.springs)
        damping_time = assembly.gearbox.case.damping.body_time_s
        matrices = {name: assembly.elastic_bodies[name].reduced for name in self._coordinates}

        def supports(t: float, q: Floats, v: Floats) -> Floats:
            f = np.where(self._taken, applied(t, q, v) + assembly.weight, 0.0)
            add_connector_forces(q, v, connectors, f)
            add_spring_forces(q, v, springs, f)
            for name, body in matrices.items():
                place = assembly.elastic_slices[name]
                deforming = v[place] - v[place][5] * body.spin
                f[place] -= damping_time * (body.stiffness @ deforming)
            return f

        def force(mbs: Any, t: float, item: int, coordinates: Any, velocities: Any) -> Floats:
            own_q, own_v = np.array(coordinates), np.array(velocities)
            q, v, motions = self._state(own_q, own_v)
            f = supports(t, q, v)
            if meshes is not None:
                f += assembly.mesh_forces(q, v, meshes)
            return self._onto_frames(f, own_q, own_v, motions)

        constant = _differentiated(lambda q, v: supports(0.0, q, v), *self._start)

        def derivatives(
            mbs: Any, t: float, item: int, coordinates: Any, velocities: Any, factor_q: float, factor_v: float
        ) -> Floats:
            own_q, own_v = np.array(coordinates), np.array(velocities)
            q, v, motions = self._state(own_q, own_v)
            matrix = -factor_q * constant[0] - factor_v * constant[1]
            if meshes is not None:
                by_q, by_v = assembly.mesh_jacobians(q, v, meshes)
                matrix -= factor_q * by_q + factor_v * by_v
            return self._matrix_onto_frames(matrix, own_q, own_v, motions, factor_q, factor_v)

        mbs.AddObject(
            items.ObjectGenericODE2(nodeNumbers=nodes, forceUserFunction=force, jacobianUserFunction=derivatives)
        )

    def _onto_frames(self, f: Floats, q: Floats, v: Floats, motions: Mapping[str, FloatingMotion]) -> Floats:
        """Bring forces on the assembly's coordinates to the solver's, and add what Exudyn leaves out of spinning."""
        found = np.empty(self.size)
        found[: self._begin] = f[: self._begin]
        for name, place in self._assembly.elastic_slices.items():
            own = self.slices[name]
            found[own] = f[place] @ motions[name].jacobian if name in motions else f[place]
        for name in motions:
            own, (stiffness, damping, steady) = self.slices[name], self._spin_terms[name]
            speed = self._coordinates[name].speed(q[own], v[own])
            amplitudes = slice(own.start + 7, own.stop)
            found[amplitudes] -= speed**2 * (stiffness @ q[amplitudes] + steady) + speed * (damping @ v[amplitudes])
        return found

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
        found = np.empty((self.size, self.size))
        rows[: self._begin] = matrix[: self._begin]
        for name, place in self._assembly.elastic_slices.items():
            own = self.slices[name]
            rows[own] = motions[name].jacobian.T @ matrix[place] if name in motions else matrix[place]
        found[:, : self._begin] = rows[:, : self._begin]
        for name, place in self._assembly.elastic_slices.items():
            own = self.slices[name]
            found[:, own] = rows[:, place] @ motions[name].jacobian if name in motions else rows[:, place]
        for name in motions:
            own, (stiffness, damping, _) = self.slices[name], self._spin_terms[name]
            speed = self._coordinates[name].speed(q[own], v[own])
            amplitudes = slice(own.start + 7, own.stop)
            found[amplitudes, amplitudes] += factor_q * speed**2 * stiffness + factor_v * speed * damping
        return found


def _differentiated(law: Callable[[Floats, Floats], Floats], q: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Differentiate forces that are nearly linear to q and to v, each (size, size)."""
    size = len(q)
    by_q, by_v = np.empty((size, size)), np.empty((size, size))
    for n, step in enumerate(DIFFERENCE * np.eye(size)):
        by_q[:, n] = (law(q + step, v) - law(q - step, v)) / (2.0 * DIFFERENCE)
        by_v[:, n] = (law(q, v + step) - law(q, v - step)) / (2.0 * DIFFERENCE)
    return by_q, by_v


def add_floating_body(mbs: Any, body: FloatingBody, rotation: Rotation = "euler_parameters") -> tuple[Any, Any]:
    """Add a floating body at rest in its place to an Exudyn system; return its rigid and its modal node."""
    euler = rotation == "euler_parameters"
    kind = exudyn.NodeType.RotationEulerParameters if euler else exudyn.NodeType.RotationRxyz
    made = frame_integrals(body, kind).AddObjectFFRFreducedOrder(mbs, positionRef=body.centre.tolist())
    if body.added_mass.any():
        mbs.AddObject(items.ObjectGenericODE2(nodeNumbers=[made["nGenericODE2"]], massMatrix=np.diag(body.added_mass)))
    return made["nRigidBody"], made["nGenericODE2"]


def frame_integrals(body: FloatingBody, kind: Any) -> Any:
    """Fill Exudyn's description of a floating body: what it would compute from a mesh follows from its integrals.

    A skew matrix s(f) with s(f) v = f x v gives s(f)' s(g) = (f . g) 1 - g f' and s(f)' g = g x f.
    """
    own, first = body.second_moments, body.first_moments
    modes, seats = len(body.stiffness), len(body.seats)
    products = np.einsum("aafg,bc->bcfg", own, np.eye(3)) - own.transpose(1, 0, 2, 3)
    turned = np.stack([own[a, b] - own[b, a] for a, b in ((2, 1), (0, 2), (1, 0))])

    def skew(vector: Floats) -> Floats:
        x, y, z = vector
        return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])

    made = elements.ObjectFFRFreducedOrderInterface(rigidBodyNodeType=kind)
    made.rigidBodyNodeType = kind
    made.nModes, made.trigList, made.postProcessingModes = modes, [], {}
    made.xRef = (body.places - body.centre).ravel()
    made.modeBasis = body.at_seats.reshape(seats, 2, 3, -1)[:, 0].reshape(3 * seats, -1)
    made.massMatrixReduced = np.einsum("aafg->fg", own)[1:, 1:]
    made.stiffnessMatrixReduced = np.diag(body.stiffness)
    made.totalMass, made.inertiaLocal = body.mass, products[:, :, 0, 0]
    made.chiU = first[:, 0] / body.mass
    made.chiUtilde = skew(made.chiU)
    made.mPhitTPsi = first[:, 1:]
    made.mPhitTPsiTilde = np.hstack([skew(column) for column in first[:, 1:].T])
    made.mXRefTildePsi = turned[:, 0, 1:]
    made.mXRefTildePsiTilde = products[:, :, 0, 1:].transpose(0, 2, 1).reshape(3, -1)
    made.mPsiTildePsi = turned[:, 1:, 1:].transpose(1, 0, 2).reshape(3 * modes, -1)
    made.mPsiTildePsiTilde = products[:, :, 1:, 1:].transpose(2, 0, 3, 1).reshape(3 * modes, -1)
    return made
