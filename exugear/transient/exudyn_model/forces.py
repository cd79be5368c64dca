"""Forces between bodies in an Exudyn system: bearings, couplings, gear meshes, torques, the variant rigid.

Bearings are ``RigidBodySpringDamper``, with a user function if they have rows of rolling elements. Forces on a body in
a floating frame are in `exugear.transient.exudyn_model.bodies`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from exugear.gearbox.parts import Joint
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN
from exugear.system.kernels.meshes import ROW_SIZE, MeshArrays
from exugear.system.kernels.modal_damping import add_modal_damping, modal_matrix, modal_memory
from exugear.system.kernels.rolling import CAGE_TORQUE, ELASTIC_PART, rolling_force, rolling_memory
from exugear.system.kernels.varying_loads import VaryingLoadArrays, add_varying_loads
from exugear.system.loads import LoadTable
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.mesh_forces import add_mesh_forces
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.transient.exudyn_model.bodies import Parts
from exugear.transient.exudyn_model.library import exudyn, items
from fe_ste.tools.arrays import Floats
from fe_ste.tools.bundles import cached_bundle

FREE_SPIN = [1, 1, 1, 1, 1, 0]
"""Axes that an ideal joint holds: all but the spin."""


def add_supports(parts: Parts) -> None:
    """Add bearings and mounts."""
    assembly = parts.assembly
    elsewhere = () if parts.floating is None else parts.floating.connectors
    for n, bearing in enumerate(assembly.supports):
        if n in elsewhere:
            continue
        position = np.array(bearing.position)
        pin = np.array([*assembly.gearbox.pin_offsets.get(bearing.body, (0.0, 0.0)), 0.0])
        ends = ((bearing.on, position + pin), (bearing.body, position))
        rolling = assembly.connectors.rolling
        law = _rolling_law(parts, n) if rolling.first[n] < rolling.first[n + 1] else 0
        # The linear law has no load where the matrix resists nothing: rows that do not resist do not push either.
        size = np.sqrt(np.abs(np.diag(assembly.connectors.stiffness[n])))
        scale = np.divide(1.0, size, out=np.zeros(BODY_SIZE), where=size > 0.0)
        # Forces and moments differ by orders of magnitude: to a unit diagonal before a rank is decided.
        matrix = scale[:, None] * assembly.connectors.stiffness[n] * scale
        found = np.linalg.pinv(matrix, rcond=1e-12, hermitian=True) @ (scale * assembly.connectors.offset[n])
        parts.mbs.AddObject(
            items.RigidBodySpringDamper(
                markerNumbers=[parts.support_marker(body, bearing.name, at) for body, at in ends],
                stiffness=assembly.connectors.stiffness[n],
                damping=assembly.connectors.damping[n],
                offset=np.asarray(-scale * found),
                springForceTorqueUserFunction=law,
            )
        )


def _rolling_law(parts: Parts, n: int) -> Callable[..., Floats]:
    """Return the user function of a support with rolling elements and a linear part; it evaluates both."""
    offset = parts.assembly.connectors.offset[n]
    bearing = parts.assembly.supports[n]
    rolling = parts.assembly.connectors.rolling
    first, second = (parts.support_spin(body, bearing.name) for body in (bearing.on, bearing.body))
    forces = rolling_memory(rolling)

    def law(
        mbs: Any,
        t: float,
        item: int,
        displacement: Any,
        rotation: Any,
        velocity: Any,
        angular_velocity: Any,
        stiffness: Any,
        damping: Any,
        *frames: Any,
    ) -> Floats:
        strain = np.array([*displacement, *rotation])
        rate = np.array([*velocity, *angular_velocity])
        rolling_force(n, strain, rate, second() - first(), rolling, forces)
        load: Floats = offset + stiffness @ strain + damping @ rate
        load += forces[ELASTIC_PART : ELASTIC_PART + BODY_SIZE]
        load[SPIN] += forces[CAGE_TORQUE]
        return load

    return law


def add_couplings(parts: Parts) -> None:
    """Add torsional springs between spins."""
    elsewhere = () if parts.floating is None else parts.floating.couplings
    for n, coupling in enumerate(parts.assembly.gearbox.couplings):
        if n in elsewhere:
            continue
        parts.mbs.AddObject(
            items.CoordinateSpringDamper(
                markerNumbers=[parts.spin_marker(body, coupling.seat) for body in (coupling.first, coupling.second)],
                stiffness=coupling.stiffness,
                damping=coupling.damping,
            )
        )


def add_joint(parts: Parts, joint: Joint) -> None:
    """Add an ideal joint, which leaves a body its spin."""
    position = np.array(joint.position)
    parts.mbs.AddObject(
        items.GenericJoint(
            markerNumbers=[parts.support_marker(body, joint.name, position) for body in (joint.on, joint.body)],
            constrainedAxes=FREE_SPIN,
        )
    )


# External loads: torques, and the drive at prescribed speed


def add_loads(parts: Parts, loads: LoadTable) -> None:
    """Add torques and drive; those on bodies in floating frames act with the other forces on these."""
    elsewhere = parts.assembly.floating
    for name, torque in loads.constant.items():
        if name not in elsewhere:
            parts.mbs.AddLoad(items.LoadCoordinate(markerNumber=parts.spin_marker(name), load=torque))
    for name in loads.series:
        if name not in elsewhere:
            parts.mbs.AddLoad(
                items.LoadCoordinate(
                    markerNumber=parts.spin_marker(name),
                    load=loads.torque(name, 0.0),
                    loadUserFunction=_load_function(loads, name),
                )
            )
    drive = loads.drive
    if drive is not None and drive.body not in elsewhere:
        fixed = parts.mbs.AddNode(items.NodePointGround())
        ground = parts.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=fixed, coordinate=0))
        parts.mbs.AddObject(
            items.CoordinateSpringDamper(
                markerNumbers=[ground, parts.spin_marker(drive.body)],
                stiffness=drive.stiffness,
                damping=drive.damping,
                # The force of this spring to the ground is a torque over time, angle and speed.
                springForceUserFunction=lambda mbs, t, item, u, v, k, d, offset: -drive.torque(t, u, v),
            )
        )


def _load_function(loads: LoadTable, body: str) -> Callable[[Any, float, float], float]:
    return lambda mbs, t, load: loads.torque(body, t)


def add_varying_loads_element(parts: Parts, loads: VaryingLoadArrays) -> None:
    """Add the one object for loads over angles, on all nodes in the order of the assembly's coordinates."""

    def force(mbs: Any, t: float, item: int, q: Any, v: Any) -> Floats:
        f = np.zeros(parts.assembly.size)
        add_varying_loads(np.array(q), np.array(v), loads, f)
        return f

    def jacobian(mbs: Any, t: float, item: int, q: Any, v: Any, factor_q: float, factor_v: float) -> Floats:
        # Their derivatives are small against stiffness and inertia: Newton's method converges without them.
        return np.zeros((parts.assembly.size, parts.assembly.size))

    parts.mbs.AddObject(
        items.ObjectGenericODE2(nodeNumbers=parts.all_nodes, forceUserFunction=force, jacobianUserFunction=jacobian)
    )


def add_mesh_element(parts: Parts, meshes: MeshArrays) -> None:
    """Add the one object for all meshes, on all nodes in the order of the assembly's coordinates."""
    assembly = parts.assembly

    def force(mbs: Any, t: float, item: int, q: Any, v: Any) -> Floats:
        return assembly.mesh_forces(np.array(q), np.array(v), meshes)

    parts.mbs.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=parts.all_nodes,
            forceUserFunction=force,
            jacobianUserFunction=mesh_jacobian(assembly, meshes),
        )
    )


def add_modal_element(parts: Parts) -> None:
    """Add the one object for modal damping, on all nodes in the order of the assembly's coordinates."""
    assembly = parts.assembly
    modal = assembly.modal
    if modal is None:
        return
    memory = modal_memory(modal)

    def force(mbs: Any, t: float, item: int, q: Any, v: Any) -> Floats:
        f = np.zeros(assembly.size)
        add_modal_damping(np.array(q), np.array(v), cached_bundle(modal), memory, f)
        return f

    def jacobian(mbs: Any, t: float, item: int, q: Any, v: Any, factor_q: float, factor_v: float) -> Floats:
        return factor_v * modal_matrix(np.array(q), modal)

    parts.mbs.AddObject(
        items.ObjectGenericODE2(nodeNumbers=parts.all_nodes, forceUserFunction=force, jacobianUserFunction=jacobian)
    )


def mesh_jacobian(assembly: Assembly, meshes: MeshArrays) -> Callable[..., Floats]:
    """Exudyn's jacobian function of all meshes on the coordinates of an assembly."""

    def jacobian(mbs: Any, t: float, item: int, q: Any, v: Any, factor_q: float, factor_v: float) -> Floats:
        jq, jv = assembly.mesh_jacobians(np.array(q), np.array(v), meshes)
        return -(factor_q * jq + factor_v * jv)

    return jacobian


def add_mesh_loads(parts: Parts, meshes: MeshArrays) -> None:
    """Add per mesh and body one force and one torque load whose user functions read the nodes."""
    for n, element in enumerate(parts.assembly.elements):
        mesh = element.mesh
        involved = [name for name in (mesh.pinion, mesh.gear, mesh.frame) if name in parts.nodes]
        for name in involved:
            vectors = _MeshVectors(parts, meshes.one(n), involved, name)
            marker = parts.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=parts.bodies[name]))
            for load, of in ((items.LoadForceVector, vectors.force), (items.LoadTorqueVector, vectors.torque)):
                parts.mbs.AddLoad(load(markerNumber=marker, loadVector=[0.0, 0.0, 0.0], loadVectorUserFunction=of))


class _MeshVectors:
    """Global force and torque of one mesh on one body, for load user functions."""

    def __init__(self, parts: Parts, mesh: MeshArrays, involved: list[str], body: str) -> None:
        self._nodes = [parts.nodes[name] for name in involved]
        start = 6 * involved.index(body)
        self._of_body = slice(start, start + 6)
        # The mesh reads the coordinates of the involved bodies alone, six after six.
        local = np.full((1, ROW_SIZE), -1, dtype=np.int64)
        for i in range(ROW_SIZE):
            if mesh.coordinates[0, i] >= 0:
                for n, name in enumerate(dict.fromkeys(involved)):
                    coordinates = parts.assembly.coordinates[name]
                    if mesh.coordinates[0, i] in coordinates:
                        local[0, i] = 6 * n + coordinates.index(int(mesh.coordinates[0, i]))
        self._mesh = mesh._replace(coordinates=local)

    def _generalized(self, mbs: Any) -> tuple[Floats, Floats]:
        """Coordinates of the body and generalized force on it, (6,)."""
        output = exudyn.OutputVariableType
        q = np.concatenate([mbs.GetNodeOutput(n, output.Coordinates) for n in self._nodes])
        v = np.concatenate([mbs.GetNodeOutput(n, output.Coordinates_t) for n in self._nodes])
        f = np.zeros(q.size)
        add_mesh_forces(q, v, self._mesh, f)
        return q[self._of_body], f[self._of_body]

    def force(self, mbs: Any, t: float, load: Any) -> list[float]:
        """Force, N."""
        values: list[float] = self._generalized(mbs)[1][:3].tolist()
        return values

    def torque(self, mbs: Any, t: float, load: Any) -> list[float]:
        """Torque, N m, from the generalized moments Q of the Rxyz angles: G^T M = Q."""
        q, f = self._generalized(mbs)
        ca = np.cos(q[3])
        sa = np.sin(q[3])
        cb = np.cos(q[4])
        sb = np.sin(q[4])
        transposed = np.array([[1.0, 0.0, 0.0], [0.0, ca, sa], [sb, -sa * cb, ca * cb]])
        values: list[float] = np.linalg.solve(transposed, f[3:]).tolist()
        return values


def add_minimal_system(
    mbs: Any, assembly: Assembly, q: Floats, v: Floats, loads: LoadTable, meshes: MeshArrays | None
) -> None:
    """Add all spins as one ``ObjectGenericODE2``; meshes are left out if None.

    Its coordinates are the weights of the free motions: the spins themselves but for the law `rigid`.
    """
    motions = assembly.motions
    node = mbs.AddNode(
        items.NodeGenericODE2(
            referenceCoordinates=[0.0] * motions.shape[1],
            initialCoordinates=np.linalg.lstsq(motions, q)[0].tolist(),
            initialCoordinates_t=np.linalg.lstsq(motions, v)[0].tolist(),
            numberOfODE2Coordinates=motions.shape[1],
        )
    )
    # Torsional couplings.
    stiffness = np.zeros((assembly.size, assembly.size))
    damping = np.zeros((assembly.size, assembly.size))
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    for (i, j), k, d in zip(
        assembly.springs.coordinates, assembly.springs.stiffness, assembly.springs.damping, strict=True
    ):
        stiffness[np.ix_([i, j], [i, j])] += k * pair
        damping[np.ix_([i, j], [i, j])] += d * pair
    steady = loads.generalized(assembly, 0.0, q, v) if loads.is_constant else None
    memory = modal_memory(assembly.modal)

    def force(mbs: Any, t: float, item: int, y: Any, rate: Any) -> Floats:
        q = motions @ np.array(y)
        v = motions @ np.array(rate)
        f = loads.generalized(assembly, t, q, v) if steady is None else steady.copy()
        if meshes is not None:
            f += assembly.mesh_forces(q, v, meshes)
        if assembly.modal is not None:
            add_modal_damping(q, v, cached_bundle(assembly.modal), memory, f)
        return f @ motions

    # The drive's spring is in no jacobian, and gears that only roll have coordinates of their own.
    jacobian: Any = 0
    if loads.drive is None and meshes is not None and LAWS[assembly.mesh_model].has_force:
        jacobian = mesh_jacobian(assembly, meshes)
    mbs.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=[node],
            massMatrix=motions.T @ assembly.mass_matrix @ motions,
            stiffnessMatrix=motions.T @ stiffness @ motions,
            dampingMatrix=motions.T @ damping @ motions,
            forceUserFunction=force,
            jacobianUserFunction=jacobian,
        )
    )
