"""Bodies of an assembly in an Exudyn system: rigid ones, those with spin only, and flexible ones.

Rigid bodies are ``NodeRigidBodyRxyz`` with z as spin axis, so that the unwrapped angle is a coordinate. A flexible body
has such a node at each seat, one node for its modal coordinates, and its matrices in one ``ObjectGenericODE2`` on all.

`exugear.transient.exudyn_model.floating` describes the particular properties of Exudyn's floating frame.

Quantities that Exudyn would compute from a mesh (nodes, mass matrix, modes) are passed as integrals, so that rigid
rings on seats count and a run needs no mesh.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from exugear.gearbox.parts import Body, node_position, seat_key
from exugear.system.bodies.elastic_body import (
    FRAME_COORDINATES,
    MODAL,
    FloatingBody,
    FloatingCoordinates,
    FloatingMotion,
    skew,
)
from exugear.system.bodies.reduction import ReducedBody
from exugear.system.bodies.turning_frame import TurningBody
from exugear.system.kernels.connectors import add_connector_forces
from exugear.system.kernels.coordinates import SPIN, SpringArrays, add_spring_forces
from exugear.system.kernels.meshes import MeshArrays
from exugear.system.kernels.modal_damping import add_modal_damping, modal_memory
from exugear.system.kernels.varying_loads import VaryingLoadArrays, add_varying_loads
from exugear.system.system import Assembly
from exugear.transient.exudyn_model.library import elements, exudyn, items
from fe_ste.tools.arrays import Floats
from fe_ste.tools.bundles import cached_bundle

Rotation = Literal["euler_parameters", "tait_bryan"]


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
    second_moments = body.second_moments
    first_moments = body.first_moments
    modes = len(body.stiffness)
    seats = len(body.seats)
    products = np.einsum("aafg,bc->bcfg", second_moments, np.eye(3)) - second_moments.transpose(1, 0, 2, 3)
    turned = np.stack([second_moments[a, b] - second_moments[b, a] for a, b in ((2, 1), (0, 2), (1, 0))])

    interface = elements.ObjectFFRFreducedOrderInterface(rigidBodyNodeType=kind)
    interface.rigidBodyNodeType = kind
    interface.nModes, interface.trigList, interface.postProcessingModes = modes, [], {}
    interface.xRef = (body.places - body.centre).ravel()
    interface.modeBasis = body.at_seats.reshape(seats, 2, 3, -1)[:, 0].reshape(3 * seats, -1)
    interface.massMatrixReduced = np.einsum("aafg->fg", second_moments)[1:, 1:]
    interface.stiffnessMatrixReduced = np.diag(body.stiffness)
    interface.totalMass, interface.inertiaLocal = body.mass, products[:, :, 0, 0]
    interface.chiU = first_moments[:, 0] / body.mass
    interface.chiUtilde = skew(interface.chiU)
    interface.mPhitTPsi = first_moments[:, 1:]
    interface.mPhitTPsiTilde = np.hstack([skew(column) for column in first_moments[:, 1:].T])
    interface.mXRefTildePsi = turned[:, 0, 1:]
    interface.mXRefTildePsiTilde = products[:, :, 0, 1:].transpose(0, 2, 1).reshape(3, -1)
    interface.mPsiTildePsi = turned[:, 1:, 1:].transpose(1, 0, 2).reshape(3 * modes, -1)
    interface.mPsiTildePsiTilde = products[:, :, 1:, 1:].transpose(2, 0, 3, 1).reshape(3 * modes, -1)
    return interface


# The bodies of a gearbox that move in floating frames, and the forces that they share with others

Law = Callable[[float, Floats, Floats], Floats]
"""Generalized forces on an assembly's coordinates as a function of time, coordinates and velocities."""
DIFFERENCE = 1e-6
"""Step that forces of supports are differentiated with, m or rad, and per second."""


class FloatingBodies:
    """The bodies of an assembly that move in floating frames, and the forces that they share with others.

    Meshes, bearings and couplings keep the models of the assembly on its own coordinates: the coordinates of each
    floating body follow from its frame and modes, and forces are mapped back by the transposed matrix of their rates.
    The solver's vector has the coordinates of frame and modes in place of the body's coordinates in the assembly.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    q, v : (size,) initial coordinates and velocities of the assembly

    Attributes
    ----------
    nodes : rigid and modal node of each body by name
    connectors, couplings : numbers of the bearings and couplings that act on these bodies
    slices : position of each flexible body in the solver's vector
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

    def add_forces(
        self,
        mbs: Any,
        nodes: list[Any],
        meshes: MeshArrays | None,
        applied: Law,
        varying: VaryingLoadArrays | None,
    ) -> None:
        """Add one object on all nodes for meshes and loads over angles, and for all else on the floating bodies.

        Parameters
        ----------
        mbs : exudyn.MainSystem
        nodes : of all bodies in the order of the assembly's coordinates
        meshes : None leaves them out
        applied : what acts from outside, on any coordinates; taken for the floating bodies alone
        varying : loads that vary with the angle of a body, on any coordinates
        """
        assembly = self._assembly
        connectors = assembly.connectors.chosen(self.connectors)
        springs = SpringArrays._make(values[self.couplings] for values in assembly.springs)
        damping_time = assembly.gearbox.case.damping.body_time_s
        matrices = {name: assembly.elastic_bodies[name].reduced for name in self._coordinates}
        memory = modal_memory(assembly.modal)

        def supports(t: float, q: Floats, v: Floats) -> Floats:
            over_angles = np.zeros(assembly.size)
            if varying is not None:
                add_varying_loads(q, v, varying, over_angles)
            f = np.where(self._is_floating, applied(t, q, v) + assembly.constant_forces, over_angles)
            add_connector_forces(q, v, connectors, f)
            add_spring_forces(q, v, springs, f)
            if assembly.modal is not None:
                add_modal_damping(q, v, cached_bundle(assembly.modal), memory, f)
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
        """Do the same with derivatives (size, size) of forces on the left-hand side."""
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


# What stands in an Exudyn system, by the names of the assembly, and where others are fixed to it

SPIN_COORDINATE = 5
"""Coordinate of a rigid-body node that is its spin."""


@dataclass
class Parts:
    """Nodes and objects of an Exudyn system."""

    mbs: Any
    """exudyn.MainSystem."""
    assembly: Assembly
    nodes: dict[str, Any] = field(default_factory=dict)
    """Node of each body by its name. A flexible body has the node of its main seat there; the nodes of its other seats
    have the keys of `exugear.gearbox.parts.seat_key`."""
    bodies: dict[str, Any] = field(default_factory=dict)
    """Object of each rigid body."""
    elastic_nodes: dict[str, list[Any]] = field(default_factory=dict)
    """All nodes of each elastic body: those of its seats, then one for its modal coordinates if it has some."""
    seat_positions: dict[str, Floats] = field(default_factory=dict)
    """(3,) of each seat by its key, m."""
    floating: FloatingBodies | None = None
    """Bodies in floating frames, if there are any."""
    _ground: Any = None

    @property
    def all_nodes(self) -> list[Any]:
        """Nodes of all bodies in the order of the assembly's coordinates."""
        rigid = [body.name for body in self.assembly.bodies if body.name not in self.elastic_nodes]
        elastic = [node for nodes in self.elastic_nodes.values() for node in nodes]
        return [self.nodes[name] for name in rigid] + elastic

    def support_marker(self, body: str, item: str, position: Floats) -> Any:
        """Marker of a support at a position (m, at zero angles) on a body, on an elastic one's seat, or the ground."""
        key = seat_key(body, item)
        if key in self.nodes and not (position - self.seat_positions[key]).any():
            return self.mbs.AddMarker(items.MarkerNodeRigid(nodeNumber=self.nodes[key]))
        if key in self.nodes:  # beside the seat's centre: a body without mass is the arm
            arm = items.ObjectRigidBody(physicsMass=0.0, physicsInertia=[0.0] * 6, nodeNumber=self.nodes[key])
            number = self.mbs.AddObject(arm)
            local = position - self.seat_positions[key]
        elif body in self.bodies:
            carrying = next(b for b in self.assembly.bodies if b.name == body)
            number = self.bodies[body]
            local = position - node_position(carrying)
        else:
            if self._ground is None:
                self._ground = self.mbs.AddObject(items.ObjectGround())
            number = self._ground
            local = position
        return self.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=number, localPosition=np.asarray(local).tolist()))

    def support_spin(self, body: str, item: str) -> Callable[[], float]:
        """Return a function for the unwrapped spin (rad) of a support's base: a body, its seat, or the ground."""
        node = self.nodes.get(seat_key(body, item), self.nodes.get(body))
        if node is None:
            return lambda: 0.0
        coordinates = exudyn.OutputVariableType.Coordinates
        return lambda: float(self.mbs.GetNodeOutput(node, coordinates)[SPIN_COORDINATE])

    def spin_marker(self, body: str, seat: str | None = None) -> Any:
        """Marker of a body's spin, of an elastic one at a seat or where torques act."""
        key = seat_key(body, seat or "")
        has_six = self.assembly.coordinates[body][0] >= 0
        node = self.nodes[key if key in self.nodes else body]
        coordinate = SPIN_COORDINATE if has_six else 0
        return self.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))


def add_bodies(parts: Parts, q: Floats, v: Floats) -> None:
    """Add all bodies at coordinates and velocities (size,) of the assembly."""
    assembly = parts.assembly
    for body in assembly.bodies:
        if assembly.has_six(body):
            _add_rigid_body(parts, body, q, v)
        elif body.name not in assembly.elastic_bodies:
            i = parts.assembly.spin[body.name]
            parts.nodes[body.name] = parts.mbs.AddNode(
                items.Node1D(referenceCoordinates=[0.0], initialCoordinates=[q[i]], initialVelocities=[v[i]])
            )
            parts.bodies[body.name] = parts.mbs.AddObject(
                items.ObjectMass1D(physicsMass=body.axial, nodeNumber=parts.nodes[body.name])
            )
    if assembly.floating:
        parts.floating = FloatingBodies(parts.mbs, assembly, q, v)
    for name in assembly.elastic_bodies:
        if parts.floating is not None and name in parts.floating.nodes:
            parts.elastic_nodes[name] = parts.floating.nodes[name]
        else:
            _add_elastic_body(parts, name, q, v)


def _add_rigid_body(parts: Parts, body: Body, q: Floats, v: Floats) -> None:
    first = parts.assembly.coordinates[body.name][0]
    node = _add_rigid_node(parts, node_position(body), first, q, v)
    parts.nodes[body.name] = node
    inertia = [body.transverse, body.transverse, body.axial, 0.0, 0.0, 0.0]
    parts.bodies[body.name] = parts.mbs.AddObject(
        items.ObjectRigidBody(physicsMass=body.mass, physicsInertia=inertia, nodeNumber=node)
    )
    acceleration = parts.assembly.gearbox.case.gravity.acceleration_m_per_s2
    if any(acceleration):
        marker = parts.mbs.AddMarker(items.MarkerBodyMass(bodyNumber=parts.bodies[body.name]))
        parts.mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=list(acceleration)))
    for force in parts.assembly.gearbox.forces:
        if force.body == body.name:
            local = np.subtract(force.position, node_position(body)).tolist()
            marker = parts.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=parts.bodies[body.name], localPosition=local))
            parts.mbs.AddLoad(items.LoadForceVector(markerNumber=marker, loadVector=list(force.wrench[:3])))
            moment = [*force.wrench[3:], 0.0]
            parts.mbs.AddLoad(items.LoadTorqueVector(markerNumber=marker, loadVector=moment))


def _add_rigid_node(parts: Parts, position: Floats, first: int, q: Floats, v: Floats) -> Any:
    """Add a node with six coordinates, which begin at `first` in the assembly's."""
    return parts.mbs.AddNode(
        items.NodeRigidBodyRxyz(
            referenceCoordinates=[*position.tolist(), 0.0, 0.0, 0.0],
            initialCoordinates=q[first : first + 6].tolist(),
            initialVelocities=v[first : first + 6].tolist(),
        )
    )


def _add_elastic_body(parts: Parts, name: str, q: Floats, v: Floats) -> None:
    """Add an elastic body: a rigid-body node at each seat, one node for the modal coordinates, matrices on all."""
    assembly = parts.assembly
    elastic = assembly.elastic_bodies[name]
    coordinates = assembly.elastic_slices[name]
    reduced = elastic.reduced
    for n, seat in enumerate(reduced.seats):
        key = seat_key(name, seat.name)
        position = np.array(seat.position)
        parts.nodes[key] = _add_rigid_node(parts, position, coordinates.start + 6 * n, q, v)
        parts.seat_positions[key] = position
    nodes = [parts.nodes[seat_key(name, seat.name)] for seat in reduced.seats]
    modal = slice(coordinates.start + 6 * len(reduced.seats), coordinates.stop)
    if reduced.modal_groups:  # statically condensed matrices have none, and Exudyn refuses a node without coordinates
        nodes.append(
            parts.mbs.AddNode(
                items.NodeGenericODE2(
                    referenceCoordinates=[0.0] * len(reduced.modal_groups),
                    initialCoordinates=q[modal].tolist(),
                    initialCoordinates_t=v[modal].tolist(),
                    numberOfODE2Coordinates=len(reduced.modal_groups),
                )
            )
        )
    parts.elastic_nodes[name] = nodes
    parts.nodes[name] = parts.nodes[seat_key(name, elastic.main_seat)]
    for item, seat_name in elastic.shared_seats.items():
        key = seat_key(name, item)
        shared = seat_key(name, seat_name)
        parts.nodes[key], parts.seat_positions[key] = parts.nodes[shared], parts.seat_positions[shared]
    if name in assembly.turning:
        _add_turning_laws(parts, assembly.turning[name], assembly.constant_forces[coordinates], nodes)
        return
    parts.mbs.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=nodes,
            massMatrix=reduced.mass,
            stiffnessMatrix=reduced.stiffness,
            dampingMatrix=assembly.damping_time(name) * reduced.stiffness,
            forceVector=assembly.constant_forces[coordinates],
            forceUserFunction=_gyroscopic_function(reduced) if reduced.gyroscopic.any() else 0,
        )
    )


def _add_turning_laws(parts: Parts, body: TurningBody, constant: Floats, nodes: list[Any]) -> None:
    """Add the laws of a body in its own turning frame; forces without accelerations are on the right-hand side."""

    def mass(mbs: Any, t: float, item: int, q: Any, v: Any) -> Floats:
        return body.mass_matrix(np.array(q))

    def force(mbs: Any, t: float, item: int, q: Any, v: Any) -> Floats:
        q = np.array(q)
        v = np.array(v)
        return np.asarray(body.forces(q, v) + constant - body.inertia_forces(q, v, np.zeros_like(q)))

    parts.mbs.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=nodes,
            massMatrix=body.reduced.mass,
            massMatrixUserFunction=mass,
            forceUserFunction=force,
        )
    )


def _gyroscopic_function(body: ReducedBody) -> Callable[..., Floats]:
    """Force - Omega G v of an elastic body that turns."""
    momentum = body.mass @ body.spin / float(body.spin @ body.mass @ body.spin)
    gyroscopic = body.gyroscopic

    def force(mbs: Any, t: float, item: int, q: Any, v: Any) -> Floats:
        rates = np.array(v)
        opposing: Floats = gyroscopic @ rates
        return -float(momentum @ rates) * opposing

    return force
