"""The variant `rigid` in an Exudyn system: minimal coordinates, masses, couplings, meshes and loads in one object."""

from __future__ import annotations

from typing import Any

import numpy as np

from exugear.system.assembly import Assembly
from exugear.system.kernels.springs import SpringArrays
from exugear.system.loads import Loading
from exugear.system.tooth_mesh.kernels.meshes import MeshArrays
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.transient.exudyn_model.library import items
from exugear.transient.exudyn_model.meshes import mesh_jacobian
from fe_ste.tools.arrays import Floats


def add_minimal_system(
    mbs: Any, assembly: Assembly, q: Floats, v: Floats, loading: Loading, meshes: MeshArrays | None
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
    stiffness, damping = _spring_matrices(assembly.size, assembly.springs)
    steady = loading.generalized(assembly, 0.0, q, v) if loading.is_constant else None

    def force(mbs: Any, t: float, item: int, y: Any, rate: Any) -> Floats:
        q = motions @ np.array(y)
        v = motions @ np.array(rate)
        f = loading.generalized(assembly, t, q, v) if steady is None else steady.copy()
        if meshes is not None:
            f += assembly.mesh_forces(q, v, meshes)
        return f @ motions

    # The drive's spring is in no jacobian, and gears that only roll have coordinates of their own.
    jacobian: Any = 0
    if loading.drive is None and meshes is not None and LAWS[assembly.mesh_law].has_force:
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


def _spring_matrices(size: int, springs: SpringArrays) -> tuple[Floats, Floats]:
    """Stiffness and damping (size, size) of torsional couplings."""
    stiffness = np.zeros((size, size))
    damping = np.zeros((size, size))
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    for (i, j), k, d in zip(springs.coordinates, springs.stiffness, springs.damping, strict=True):
        stiffness[np.ix_([i, j], [i, j])] += k * pair
        damping[np.ix_([i, j], [i, j])] += d * pair
    return stiffness, damping
