"""The one place that builds and runs an Exudyn system.

Bodies are ``NodeRigidBodyRxyz`` with z as spin axis, so that the unwrapped angle is a coordinate; bearings
are ``RigidBodySpringDamper``; all meshes together are one ``ObjectGenericODE2`` on the nodes that the
bodies already own,
with an analytic jacobian. ``mesh_route="loads"`` is the textbook way instead: per mesh and gear a force and
a torque load with a user function. It gives the same trajectory, slower, and without any jacobian.

The variant `rigid` runs in minimal coordinates (one spin per body, nothing else is free under ideal joints)
in one ``ObjectGenericODE2``; `jointed` keeps the bodies and the ideal joints and is what it is checked
against.

Exudyn's behaviour that is relied upon: user forces are right-hand sides, user jacobians belong to the left-
hand side; coordinates come without reference values; explicit solvers do not notice NaN; returning False
from a user function
stops a run silently.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from exugear.bodies.reduced_body import ReducedBody
from exugear.bodies.turning_frame import TurningBody
from exugear.dynamics.assembly import Assembly, VariantError
from exugear.kernels.meshes import ROW_SIZE, MeshArrays, add_mesh_forces
from exugear.model.parts import Body, Joint
from exugear.model.seats import node_position, seat_key
from exugear.solvers.exudyn_model.floating import FloatingBodies, SolverFailure
from exugear.solvers.loads import Drive, Loading
from fe_ste.tools.arrays import Floats

MeshRoute = Literal["element", "loads"]
Observer = Callable[[float, Floats, Floats], bool]
"""Called at the start and after each step with time, coordinates and velocities; False stops the run."""

# Exudyn's type stubs cover a part of it only, so both modules count as untyped.
exudyn: Any = importlib.import_module("exudyn")
items: Any = importlib.import_module("exudyn.itemInterface")
exudyn.config.suppressWarnings = True


class ExudynSystem:
    """An assembled Exudyn model of a gearbox variant.

    Parameters
    ----------
    assembly : Assembly
    q, v : (size,) arrays
        Initial coordinates and velocities in the assembly's order.
    loading : Loading
    mesh_route : {"element", "loads"}
        One element for all meshes, or user-function loads per mesh.
    meshes : MeshArrays, optional
        Mesh arrays other than the assembly's; None for the assembly's.
    with_meshes : bool
        False leaves the meshes out, for linearisation of the rest.

    Attributes
    ----------
    mbs : exudyn.MainSystem
        The system, open to everything Exudyn offers.
    """

    def __init__(
        self,
        assembly: Assembly,
        q: Floats,
        v: Floats,
        loading: Loading,
        mesh_route: MeshRoute = "element",
        meshes: MeshArrays | None = None,
        with_meshes: bool = True,
    ) -> None:
        self.assembly = assembly
        self.loading = loading
        self._meshes = assembly.meshes if meshes is None else meshes
        self._container = exudyn.SystemContainer()
        self.mbs = self._container.AddSystem()
        self._nodes: dict[str, Any] = {}
        self._bodies: dict[str, Any] = {}
        self._elastic_nodes: dict[str, list[Any]] = {}
        self._seat_places: dict[str, Floats] = {}
        self._floating: FloatingBodies | None = None
        if assembly.elastic_bodies and mesh_route != "element":
            raise VariantError("mesh_route 'loads' needs rigid bodies: use the variant jointed or bushing")
        if assembly.variant == "rigid":
            if mesh_route != "element":
                raise VariantError("mesh_route 'loads' needs bodies: use the variant jointed or bushing")
            self._add_minimal(q, v, with_meshes)
        else:
            self._add_bodies(q, v)
            if assembly.floating:
                self._floating = FloatingBodies(self.mbs, assembly, q, v)
            self._add_elastic_bodies(q, v)
            self._add_connectors()
            self._add_couplings()
            self._add_loading()
            if assembly.variant == "jointed":
                for joint in assembly.gearbox.joints:
                    self._add_joint(joint)
            if self._floating is not None:
                meshes_there = self._meshes if with_meshes else None
                self._floating.add_forces(self.mbs, self._all_nodes(), meshes_there, self._applied)
            elif with_meshes and mesh_route == "element":
                self._add_mesh_element()
            elif with_meshes:
                self._add_mesh_loads()
        self.mbs.Assemble()
        self._order = self._coordinate_order()
        if self._floating is not None:
            self.mbs.SetPostStepUserFunction(self._post_step(None))

    # -- building ----------------------------------------------------------------------------------------

    def _add_minimal(self, q: Floats, v: Floats, with_meshes: bool) -> None:
        """Build all spins as one object: masses, couplings, meshes and loads in one user function.

        Its coordinates are the weights of the free motions: the spins themselves but for the law `rigid`.
        """
        assembly, springs, motions = self.assembly, self.assembly.springs, self.assembly.motions
        size = assembly.size
        node = self.mbs.AddNode(
            items.NodeGenericODE2(
                referenceCoordinates=[0.0] * motions.shape[1],
                initialCoordinates=np.linalg.lstsq(motions, q)[0].tolist(),
                initialCoordinates_t=np.linalg.lstsq(motions, v)[0].tolist(),
                numberOfODE2Coordinates=motions.shape[1],
            )
        )
        k, d = np.zeros((size, size)), np.zeros((size, size))
        for (i, j), stiffness, damping in zip(springs.coordinates, springs.stiffness, springs.damping, strict=True):
            pattern = np.ix_([i, j], [i, j])
            k[pattern] += stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
            d[pattern] += damping * np.array([[1.0, -1.0], [-1.0, 1.0]])
        meshes, loading = self._meshes, self.loading
        steady = loading.generalized(assembly, 0.0, q, v) if loading.is_constant else None

        def force(mbs: Any, t: float, item: int, y: Any, rate: Any) -> Floats:
            q, v = motions @ np.array(y), motions @ np.array(rate)
            f = loading.generalized(assembly, t, q, v) if steady is None else steady.copy()
            if with_meshes:
                f += assembly.mesh_forces(q, v, meshes)
            return f @ motions

        has_jacobian = loading.drive is None and with_meshes and assembly.law != "rigid"
        self.mbs.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=[node],
                massMatrix=motions.T @ assembly.mass_matrix @ motions,
                stiffnessMatrix=motions.T @ k @ motions,
                dampingMatrix=motions.T @ d @ motions,
                forceUserFunction=force,
                jacobianUserFunction=_mesh_jacobian(assembly, meshes) if has_jacobian else 0,
            )
        )
        self._nodes["*"] = node

    def _add_bodies(self, q: Floats, v: Floats) -> None:
        for body in self.assembly.bodies:
            if self.assembly.has_six(body):
                self._add_rigid_body(body, q, v)
            elif body.name not in self.assembly.elastic_bodies:
                i = self.assembly.spin[body.name]
                self._nodes[body.name] = self.mbs.AddNode(
                    items.Node1D(referenceCoordinates=[0.0], initialCoordinates=[q[i]], initialVelocities=[v[i]])
                )
                self._bodies[body.name] = self.mbs.AddObject(
                    items.ObjectMass1D(physicsMass=body.axial, nodeNumber=self._nodes[body.name])
                )

    def _add_rigid_body(self, body: Body, q: Floats, v: Floats) -> None:
        o = self.assembly.coordinates[body.name][0]
        node = self.mbs.AddNode(
            items.NodeRigidBodyRxyz(
                referenceCoordinates=[*node_position(body).tolist(), 0.0, 0.0, 0.0],
                initialCoordinates=q[o : o + 6].tolist(),
                initialVelocities=v[o : o + 6].tolist(),
            )
        )
        self._nodes[body.name] = node
        inertia = [body.transverse, body.transverse, body.axial, 0.0, 0.0, 0.0]
        self._bodies[body.name] = self.mbs.AddObject(
            items.ObjectRigidBody(physicsMass=body.mass, physicsInertia=inertia, nodeNumber=node)
        )
        acceleration = self.assembly.gearbox.case.gravity.acceleration_m_per_s2
        if any(acceleration):
            marker = self.mbs.AddMarker(items.MarkerBodyMass(bodyNumber=self._bodies[body.name]))
            self.mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=list(acceleration)))

    def _add_elastic_bodies(self, q: Floats, v: Floats) -> None:
        """Add elastic bodies: a rigid-body node at each seat, one node for the amplitudes, their matrices on all."""
        for name, place in self.assembly.elastic_slices.items():
            if self._floating is not None and name in self._floating.nodes:
                self._elastic_nodes[name] = self._floating.nodes[name]
                continue
            reduced = self.assembly.elastic_bodies[name].reduced
            nodes = []
            for n, seat in enumerate(reduced.seats):
                first = place.start + 6 * n
                nodes.append(
                    self.mbs.AddNode(
                        items.NodeRigidBodyRxyz(
                            referenceCoordinates=[*seat.place, 0.0, 0.0, 0.0],
                            initialCoordinates=q[first : first + 6].tolist(),
                            initialVelocities=v[first : first + 6].tolist(),
                        )
                    )
                )
                self._nodes[seat_key(name, seat.name)] = nodes[-1]
                self._seat_places[seat_key(name, seat.name)] = np.array(seat.place)
            inner = slice(place.start + 6 * len(reduced.seats), place.stop)
            nodes.append(
                self.mbs.AddNode(
                    items.NodeGenericODE2(
                        referenceCoordinates=[0.0] * len(reduced.groups),
                        initialCoordinates=q[inner].tolist(),
                        initialCoordinates_t=v[inner].tolist(),
                        numberOfODE2Coordinates=len(reduced.groups),
                    )
                )
            )
            self._elastic_nodes[name] = nodes
            elastic = self.assembly.elastic_bodies[name]
            self._nodes[name] = self._nodes[seat_key(name, elastic.main)]
            for item, seat_name in elastic.shared.items():
                key, shared = seat_key(name, item), seat_key(name, seat_name)
                self._nodes[key], self._seat_places[key] = self._nodes[shared], self._seat_places[shared]
            if name in self.assembly.turning:
                self._add_turning_body(self.assembly.turning[name], nodes)
                continue
            self.mbs.AddObject(
                items.ObjectGenericODE2(
                    nodeNumbers=nodes,
                    massMatrix=reduced.mass,
                    stiffnessMatrix=reduced.stiffness,
                    dampingMatrix=self.assembly.gearbox.case.damping.body_time_s * reduced.stiffness,
                    forceVector=self.assembly.weight[place],
                    forceUserFunction=_gyroscopic_function(reduced) if reduced.gyroscopic.any() else 0,
                )
            )

    def _add_turning_body(self, body: TurningBody, nodes: list[Any]) -> None:
        """Add the laws of a body in its own turning frame; forces without accelerations are on the right-hand side."""

        def mass(mbs: Any, t: float, item: int, q: Any, v: Any) -> Floats:
            return body.mass_matrix(np.array(q))

        def force(mbs: Any, t: float, item: int, q: Any, v: Any) -> Floats:
            q, v = np.array(q), np.array(v)
            return np.asarray(body.forces(q, v) - body.inertia_forces(q, v, np.zeros_like(q)))

        self.mbs.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=nodes,
                massMatrix=body.reduced.mass,
                massMatrixUserFunction=mass,
                forceUserFunction=force,
            )
        )

    def _point(self, body: str, item: str, place: Floats) -> Any:
        """Marker of a support at a place (m, at zero angles) on a body, its seat on an elastic one, or the ground."""
        key = seat_key(body, item)
        if key in self._nodes and not (place - self._seat_places[key]).any():
            return self.mbs.AddMarker(items.MarkerNodeRigid(nodeNumber=self._nodes[key]))
        if key in self._nodes:  # beside the seat's centre: a body without mass is the arm
            arm = items.ObjectRigidBody(physicsMass=0.0, physicsInertia=[0.0] * 6, nodeNumber=self._nodes[key])
            number, place = self.mbs.AddObject(arm), place - self._seat_places[key]
        elif body in self._bodies:
            found = next(b for b in self.assembly.bodies if b.name == body)
            number, place = self._bodies[body], place - node_position(found)
        else:
            number = self._ground()
        return self.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=number, localPosition=place.tolist()))

    def _ground(self) -> Any:
        if "*ground" not in self._bodies:
            self._bodies["*ground"] = self.mbs.AddObject(items.ObjectGround())
        return self._bodies["*ground"]

    def _add_connectors(self) -> None:
        if not self.assembly.connector_names:
            return
        connectors = self.assembly.connectors
        elsewhere = () if self._floating is None else self._floating.connectors
        for n, bearing in enumerate(self.assembly.supports):
            if n in elsewhere:
                continue
            place = np.array(bearing.position)
            pin = np.array([*self.assembly.gearbox.pin_offsets.get(bearing.body, (0.0, 0.0)), 0.0])
            ends = ((bearing.on, place + pin), (bearing.body, place))
            self.mbs.AddObject(
                items.RigidBodySpringDamper(
                    markerNumbers=[self._point(body, bearing.name, at) for body, at in ends],
                    stiffness=connectors.stiffness[n],
                    damping=connectors.damping[n],
                )
            )

    def _add_joint(self, joint: Joint) -> None:
        place = np.array(joint.position)
        self.mbs.AddObject(
            items.GenericJoint(
                markerNumbers=[self._point(body, joint.name, place) for body in (joint.on, joint.body)],
                constrainedAxes=[1, 1, 1, 1, 1, 0],
            )
        )

    def _spin_marker(self, body: str, seat: str | None = None) -> Any:
        """Marker of a body's spin, of an elastic one at a seat or where torques act."""
        at = seat_key(body, seat or "")
        six = self.assembly.coordinates[body][0] >= 0
        node = self._nodes[at if at in self._nodes else body]
        return self.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=5 if six else 0))

    def _add_couplings(self) -> None:
        elsewhere = () if self._floating is None else self._floating.couplings
        for n, coupling in enumerate(self.assembly.gearbox.couplings):
            if n in elsewhere:
                continue
            self.mbs.AddObject(
                items.CoordinateSpringDamper(
                    markerNumbers=[
                        self._spin_marker(body, coupling.seat) for body in (coupling.first, coupling.second)
                    ],
                    stiffness=coupling.stiffness,
                    damping=coupling.damping,
                )
            )

    def _add_loading(self) -> None:
        elsewhere = self.assembly.floating  # loads on these are forces on the assembly's coordinates
        for name, constant in self.loading.constant.items():
            if name in elsewhere:
                continue
            self.mbs.AddLoad(items.LoadCoordinate(markerNumber=self._spin_marker(name), load=constant))
        for name, torque in self.loading.varying.items():
            if name in elsewhere:
                continue
            self.mbs.AddLoad(
                items.LoadCoordinate(
                    markerNumber=self._spin_marker(name),
                    load=torque(0.0),
                    loadUserFunction=_load_function(torque),
                )
            )
        drive = self.loading.drive
        if drive is not None and drive.body not in elsewhere:
            fixed = self.mbs.AddNode(items.NodePointGround())
            ground = self.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=fixed, coordinate=0))
            self.mbs.AddObject(
                items.CoordinateSpringDamper(
                    markerNumbers=[ground, self._spin_marker(drive.body)],
                    stiffness=drive.stiffness,
                    damping=drive.damping,
                    springForceUserFunction=_drive_function(drive),
                )
            )

    def _all_nodes(self) -> list[Any]:
        """Nodes of all bodies in the order of the assembly's coordinates."""
        rigid = [body.name for body in self.assembly.bodies if body.name not in self._elastic_nodes]
        return [self._nodes[name] for name in rigid] + [n for own in self._elastic_nodes.values() for n in own]

    def _applied(self, t: float, q: Floats, v: Floats) -> Floats:
        return self.loading.generalized(self.assembly, t, q, v)

    def _add_mesh_element(self) -> None:
        """Add the one object for all meshes, on all nodes in the order of the assembly's coordinates."""
        assembly, meshes = self.assembly, self._meshes
        nodes = self._all_nodes()

        def force(mbs: Any, t: float, item: int, q: Any, v: Any) -> Floats:
            return assembly.mesh_forces(np.array(q), np.array(v), meshes)

        self.mbs.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=nodes,
                forceUserFunction=force,
                jacobianUserFunction=_mesh_jacobian(assembly, meshes),
            )
        )

    def _add_mesh_loads(self) -> None:
        """Add per mesh and body one force and one torque load whose user functions read the nodes."""
        for n, element in enumerate(self.assembly.elements):
            one = self._meshes.one(n)
            mesh = element.mesh
            involved = [name for name in (mesh.pinion, mesh.gear, mesh.frame) if name in self._nodes]
            for name in involved:
                vectors = _MeshVectors(self, one, involved, name)
                marker = self.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=self._bodies[name]))
                for load, of in (
                    (items.LoadForceVector, vectors.force),
                    (items.LoadTorqueVector, vectors.torque),
                ):
                    self.mbs.AddLoad(load(markerNumber=marker, loadVector=[0.0, 0.0, 0.0], loadVectorUserFunction=of))

    # -- state -------------------------------------------------------------------------------------------

    def _coordinate_order(self) -> NDArray[np.int64]:
        """Position in Exudyn's coordinate vector of each coordinate of the assembly."""
        if "*" in self._nodes:
            return np.arange(self.assembly.size, dtype=np.int64)
        floating = self._floating
        order = np.zeros(self.assembly.size if floating is None else floating.size, dtype=np.int64)
        for name, place in self.assembly.elastic_slices.items():
            begin = (place if floating is None else floating.slices[name]).start
            for node in self._elastic_nodes[name]:
                count = len(self.mbs.GetNodeOutput(node, exudyn.OutputVariableType.Coordinates))
                order[begin : begin + count] = self.mbs.GetNodeODE2Index(node) + np.arange(count)
                begin += count
        for body in self.assembly.bodies:
            if body.name in self._elastic_nodes:
                continue
            first = self.mbs.GetNodeODE2Index(self._nodes[body.name])
            own = [index for index in self.assembly.coordinates[body.name] if index >= 0]
            order[own] = first + np.arange(len(own))
        return order

    def state(self) -> tuple[float, Floats, Floats]:
        """Time (s), coordinates and velocities now."""
        data = self.mbs.systemData
        q, v = np.array(data.GetODE2Coordinates()), np.array(data.GetODE2Coordinates_t())
        if "*" in self._nodes:
            return float(data.GetTime()), self.assembly.motions @ q, self.assembly.motions @ v
        q, v = q[self._order], v[self._order]
        if self._floating is not None:
            q, v = self._floating.state(q, v)
        return float(data.GetTime()), q, v

    # -- solving -----------------------------------------------------------------------------------------

    def run(self, start: float, steps: int, step: float, observe: Observer | None = None, explicit: bool = True) -> int:
        """Integrate equal steps from the initial state; return the number of steps that Exudyn counted.

        Parameters
        ----------
        start : float
            Time at the beginning, s.
        steps, step : int, float
            Number and length (s) of the steps.
        observe : callable, optional
            Called at the start and after each step; returning False ends the run there.
        explicit : bool
            RK44; else generalized-alpha, which the variant `jointed` and floating frames need.

        Raises
        ------
        SolverFailure
            Exudyn gave up; the observer has seen everything up to there.
        """
        settings = exudyn.SimulationSettings()
        integration = settings.timeIntegration
        integration.startTime = start
        integration.endTime = start + steps * step
        integration.numberOfSteps = steps
        integration.verboseMode = 0
        integration.generalizedAlpha.spectralRadius = 0.9
        integration.newton.useModifiedNewton = True
        # Stiff elastic bodies leave more round-off than joints; below it Exudyn would cut its steps in vain.
        jointed = self.assembly.variant == "jointed"
        integration.newton.relativeTolerance = 1e-10 if jointed else 1e-8
        integration.newton.absoluteTolerance = 1e-12 if jointed else 1e-10
        settings.linearSolverType = exudyn.LinearSolverType.EigenSparse
        settings.solutionSettings.writeSolutionToFile = False
        settings.displayStatistics = False
        if observe is not None:
            self.mbs.SetPostStepUserFunction(self._post_step(observe))
        solver = exudyn.MainSolverExplicit() if explicit else exudyn.MainSolverImplicitSecondOrder()
        if explicit:
            integration.explicitIntegration.dynamicSolverType = exudyn.DynamicSolverType.RK44
        try:
            solver.SolveSystem(self.mbs, settings)
        except exudyn.ExudynError as error:
            raise SolverFailure(str(error).splitlines()[0]) from None
        return int(solver.it.currentStepIndex) - 1

    def _post_step(self, observe: Observer | None) -> Callable[[Any, float], bool]:
        def after_step(mbs: Any, t: float) -> bool:
            _, q, v = self.state()
            if self._floating is not None:
                self._floating.accept(q)
            return observe is None or observe(t, q, v)

        return after_step

    def linearised(self) -> tuple[Floats, Floats, Floats]:
        """Mass, stiffness and damping matrices of Exudyn about the initial state, in the assembly's order.

        Raises
        ------
        VariantError
            A body moves in a floating frame, which has other coordinates.
        """
        if self._floating is not None:
            raise VariantError("a floating frame has coordinates of its own; linearise the assembly")
        mass, stiffness, damping = self.mbs.ComputeLinearizedSystem()[:3]
        grid = np.ix_(self._order, self._order)
        return np.array(mass)[grid], np.array(stiffness)[grid], np.array(damping)[grid]

    def joint_null_space(self) -> tuple[Floats, Floats]:
        """Motions (size, n) that ideal joints leave, a unit spin per column, and the mass in them (n, n)."""
        mass, _, _, _, null = self.mbs.ComputeLinearizedSystem(
            projectIntoConstraintNullspace=True, returnConstraintNullspace=True
        )[:5]
        basis = np.array(null).T[self._order]
        spins = [self.assembly.spin[body.name] for body in self.assembly.bodies]
        to_spins = np.linalg.inv(basis[spins])
        return basis @ to_spins, to_spins.T @ np.array(mass) @ to_spins


def _mesh_jacobian(assembly: Assembly, meshes: MeshArrays) -> Callable[..., Floats]:
    """Exudyn's jacobian function of all meshes on the coordinates of an assembly."""

    def jacobian(mbs: Any, t: float, item: int, q: Any, v: Any, factor_q: float, factor_v: float) -> Floats:
        jq, jv = assembly.mesh_jacobians(np.array(q), np.array(v), meshes)
        return -(factor_q * jq + factor_v * jv)

    return jacobian


def _gyroscopic_function(body: ReducedBody) -> Callable[..., Floats]:
    """Force - Omega G v of an elastic body that turns."""
    momentum = body.mass @ body.spin / float(body.spin @ body.mass @ body.spin)
    gyroscopic = body.gyroscopic

    def force(mbs: Any, t: float, item: int, q: Any, v: Any) -> Floats:
        rates = np.array(v)
        opposing: Floats = gyroscopic @ rates
        return -float(momentum @ rates) * opposing

    return force


def _load_function(torque: Callable[[float], float]) -> Callable[[Any, float, float], float]:
    return lambda mbs, t, load: torque(t)


def _drive_function(drive: Drive) -> Callable[..., float]:
    def force(mbs: Any, t: float, item: int, u: float, v: float, k: float, d: float, offset: float) -> float:
        return k * (u - drive.angle(t)) + d * (v - drive.speed(t))

    return force


class _MeshVectors:
    """Global force and torque of one mesh on one body, for load user functions."""

    def __init__(self, system: ExudynSystem, mesh: MeshArrays, involved: list[str], body: str) -> None:
        self._nodes = [system._nodes[name] for name in involved]
        self._own = involved.index(body)
        unique = list(dict.fromkeys(involved))
        local = np.full((1, ROW_SIZE), -1, dtype=np.int64)
        for i in range(ROW_SIZE):
            if mesh.coordinates[0, i] >= 0:
                for n, name in enumerate(unique):
                    own = system.assembly.coordinates[name]
                    if mesh.coordinates[0, i] in own:
                        local[0, i] = 6 * n + own.index(int(mesh.coordinates[0, i]))
        self._mesh = mesh._replace(coordinates=local)

    def _generalized(self, mbs: Any) -> tuple[Floats, Floats]:
        output = exudyn.OutputVariableType
        q = np.concatenate([mbs.GetNodeOutput(n, output.Coordinates) for n in self._nodes])
        v = np.concatenate([mbs.GetNodeOutput(n, output.Coordinates_t) for n in self._nodes])
        f = np.zeros(q.size)
        add_mesh_forces(q, v, self._mesh, f)
        own = slice(6 * self._own, 6 * self._own + 6)
        return q[own], f[own]

    def force(self, mbs: Any, t: float, load: Any) -> list[float]:
        """Force, N."""
        values: list[float] = self._generalized(mbs)[1][:3].tolist()
        return values

    def torque(self, mbs: Any, t: float, load: Any) -> list[float]:
        """Torque, N m, from the generalized moments Q of the Rxyz angles: G^T M = Q."""
        q, f = self._generalized(mbs)
        ca, sa, cb, sb = np.cos(q[3]), np.sin(q[3]), np.cos(q[4]), np.sin(q[4])
        transposed = np.array([[1.0, 0.0, 0.0], [0.0, ca, sa], [sb, -sa * cb, ca * cb]])
        values: list[float] = np.linalg.solve(transposed, f[3:]).tolist()
        return values
