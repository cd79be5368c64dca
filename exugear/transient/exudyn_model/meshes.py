"""Gear meshes in an Exudyn system, by one element for all of them or by loads on each gear."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from exugear.system.assembly import Assembly
from exugear.system.tooth_mesh.kernels.meshes import ROW_SIZE, MeshArrays
from exugear.system.tooth_mesh.laws.forms import add_mesh_forces
from exugear.transient.exudyn_model.library import exudyn, items
from exugear.transient.exudyn_model.parts import Parts
from fe_ste.tools.arrays import Floats


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
