"""Mass and stiffness of meshed solids.

Displacements are of second order on hexahedra or tetrahedra. The matrices come from the gradients of the scalar shape
functions, all elements at once: three displacement components share them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from exugear.system.bodies.finite_elements.lazy import at_first_use
from fe_ste.geometry.gears import Material
from fe_ste.tools.arrays import Floats, SparseMatrix

if TYPE_CHECKING:
    import skfem
else:
    skfem = at_first_use("skfem")


ELEMENTS_AT_A_TIME = 1000
"""Elements whose matrices are held together."""


@dataclass(frozen=True)
class Solid:
    """Matrices of a meshed solid with n nodes; unknown 3 node + direction."""

    mesh: Any
    """skfem.MeshTet2 or skfem.MeshHex2."""
    nodes: Floats
    """(n, 3) m."""
    scalar_mass: SparseMatrix
    """(n, n) sparse, int rho N_i N_j, kg; the mass matrix holds it for each direction."""
    stiffness: SparseMatrix
    """(3 n, 3 n) sparse, N/m."""
    convection: SparseMatrix
    """(n, n) sparse, int rho N_i d_phi N_j with d_phi = x d_y - y d_x about the axis, kg."""
    convection_square: SparseMatrix
    """(n, n) sparse, int rho d_phi N_i d_phi N_j, kg."""

    @cached_property
    def mass(self) -> SparseMatrix:
        """Mass matrix (3 n, 3 n), kg."""
        return in_each_direction(self.scalar_mass)

    def rigid_motions(self, centre: Sequence[float]) -> Floats:
        """Give translations, and turns about a centre (3,) m, over all unknowns (3 n, 6)."""
        x, y, z = (self.nodes - np.asarray(centre)).T
        motions = np.zeros((len(self.nodes), 3, 6))
        motions[:, :, :3] = np.eye(3)
        motions[:, 1, 3], motions[:, 2, 3] = -z, y
        motions[:, 2, 4], motions[:, 0, 4] = -x, z
        motions[:, 0, 5], motions[:, 1, 5] = -y, x
        return motions.reshape(-1, 6)


def in_each_direction(scalar: SparseMatrix) -> SparseMatrix:
    """Matrix (3 n, 3 n) that does in each direction what the scalar one (n, n) does."""
    return scipy.sparse.csr_array(scipy.sparse.kron(scalar, np.eye(3), format="csr"))


def assemble(mesh: Any, material: Material, axis: tuple[float, float] = (0.0, 0.0)) -> Solid:
    """Assemble the matrices of a solid.

    Parameters
    ----------
    mesh : skfem.MeshTet2 or skfem.MeshHex2
    axis : (x, y) of the axis of turning, parallel to z, m

    Examples
    --------
    >>> box = skfem.MeshHex.init_tensor([0.0, 0.2, 0.4], [0.0, 0.2], [0.0, 0.1])
    >>> solid = assemble(skfem.MeshHex2.from_mesh(box), Material(density=1000.0))
    >>> round(float(solid.scalar_mass.sum()), 9)
    8.0
    """
    from fe_ste.elasticity.bricks import gradient_products

    numbering = skfem.assembly.Dofs(mesh, mesh.elem())
    dofs = np.asarray(numbering.element_dofs).T.astype(np.int64)
    count = mesh.doflocs.shape[1]
    nodes = dofs.shape[1]
    places = np.asarray(mesh.doflocs).T - np.array([*axis, 0.0])
    points, weights = skfem.quadrature.get_quadrature(mesh.elem(), 4 if nodes == 10 else 5)
    functions = [mesh.elem().lbasis(points, number) for number in range(nodes)]
    values = np.stack([value for value, _ in functions])[:, None, :]
    reference_slopes = np.stack([slope for _, slope in functions])
    # Each entry of the sparse matrices, and which of them each pair of an element's nodes adds to.
    pairs = dofs[:, :, None] * count + dofs[:, None, :]
    entries, entry_of_pair = np.unique(pairs, return_inverse=True)
    entry_of_pair = entry_of_pair.reshape(len(dofs), -1)
    scalar = {name: np.zeros(len(entries)) for name in ("mass", "convection", "convection_square")}
    blocks = np.zeros((3, 3, len(entries)))
    for start in range(0, len(dofs), ELEMENTS_AT_A_TIME):
        chosen = np.arange(start, min(start + ELEMENTS_AT_A_TIME, len(dofs)))
        targets = entry_of_pair[chosen].ravel()
        x, y, slopes, volume = shape_gradients(places[dofs[chosen]], values, reference_slopes, weights)
        around = x * slopes[:, 1] - y * slopes[:, 0]
        weighted = material.density * volume
        for name, left, right in (
            ("mass", values, values),
            ("convection", values, around),
            ("convection_square", around, around),
        ):
            matrices = np.matmul(
                (left * weighted).transpose(1, 0, 2), np.broadcast_to(right, around.shape).transpose(1, 2, 0)
            )
            scalar[name] += np.bincount(targets, matrices.ravel(), len(entries))
        stiffness = gradient_products(slopes, volume, material).reshape(len(chosen), nodes, 3, nodes, 3)
        for a in range(3):
            for b in range(3):
                blocks[a, b] += np.bincount(targets, stiffness[:, :, a, :, b].ravel(), len(entries))
    rows = entries // count
    columns = entries % count
    row_starts = np.searchsorted(rows, np.arange(count + 1))
    size = (count, count)
    matrices = {name: scipy.sparse.csr_array((data, columns, row_starts), shape=size) for name, data in scalar.items()}
    by_block = scipy.sparse.bsr_array((blocks.transpose(2, 0, 1), columns, row_starts), shape=(3 * count, 3 * count))
    whole = by_block.tocsr()
    return Solid(
        mesh=mesh,
        nodes=np.asarray(mesh.doflocs).T,
        scalar_mass=0.5 * (matrices["mass"] + matrices["mass"].T),
        stiffness=0.5 * (whole + whole.T),
        convection=matrices["convection"],
        convection_square=0.5 * (matrices["convection_square"] + matrices["convection_square"].T),
    )


def shape_gradients(
    places: Floats, values: Floats, reference_slopes: Floats, weights: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Places x and y (e, q), slopes (k, 3, e, q) and volumes (e, q) at the q integration points of e elements.

    Nodes (e, k, 3); values (k, 1, q) and slopes (k, 3, q) of the shape functions on the reference element.
    """
    jacobian = np.einsum("eka,kbq->eqab", places, reference_slopes, optimize=True)
    slopes = np.einsum("kbq,eqba->kaeq", reference_slopes, np.linalg.inv(jacobian), optimize=True)
    x, y = np.einsum("eka,kq->aeq", places[:, :, :2], values[:, 0], optimize=True)
    return x, y, slopes, np.abs(np.linalg.det(jacobian)) * weights
