"""Solid meshes of second order: nodes in the middle of edges and faces, put where the elements want them.

Every mesh comes out as scikit-fem's `MeshHex2` (27 nodes) or `MeshTet2` (10 nodes). Elements of first order keep their
straight edges and get nodes in the middle; the displacement is of second order in either case.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.system.bodies.finite_elements.lazy import at_first_use
from fe_ste.tools.arrays import Floats, Integers

if TYPE_CHECKING:
    import skfem
else:
    skfem = at_first_use("skfem")


TET_EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
HEX_EDGES = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]])
HEX_FACES = np.array([[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]])
HEX_FACE_EDGES = np.array([[3, 8, 7, 11], [1, 9, 5, 10], [0, 9, 4, 8], [2, 11, 6, 10], [0, 1, 2, 3], [4, 5, 6, 7]])
"""Corners of edges and faces, and edges of faces, in the order of VTK."""
CORNERS = {"tetra": 4, "tetra10": 4, "hexahedron": 8, "hexahedron20": 8, "hexahedron27": 8}
"""Corners of an element by its kind in meshio's words."""


class SolidError(ValueError):
    """A solid that cannot be meshed or read, or a seat that does not lie on it."""


def second_order(points: Floats, cells: Integers, kind: str) -> Any:
    """Mesh of second order from nodes (n, 3), cells (m, k) in the order of VTK, and their kind in meshio's words.

    Raises
    ------
    SolidError
        An element is turned inside out.
    """
    corners = cells[:, : CORNERS[kind]]
    used, numbers = np.unique(corners, return_inverse=True)
    numbers = numbers.reshape(corners.shape)
    tetrahedral = kind.startswith("tetra")
    from fe_ste.elasticity.bricks import skfem_mesh

    straight = _linear_tetrahedra(points[used], numbers) if tetrahedral else skfem_mesh(points[used], numbers)
    mesh = (skfem.MeshTet2 if tetrahedral else skfem.MeshHex2).from_mesh(straight)
    places = np.array(mesh.doflocs)
    node = len(used)  # the first beyond the corners
    edges = points[cells[:, CORNERS[kind] :]]
    if kind == "tetra10":
        _place(places[:, node:], mesh.edges, numbers[:, TET_EDGES], edges)
    elif kind in ("hexahedron20", "hexahedron27"):
        _place(places[:, node:], mesh.edges, numbers[:, HEX_EDGES], edges[:, :12])
        node += mesh.edges.shape[1]
        faces = edges[:, 12:18]
        bodies = edges[:, 18:19]
        if kind == "hexahedron20":  # the serendipity element's own place of these, or linear fields are lost
            ends = points[corners]
            faces = 0.5 * edges[:, HEX_FACE_EDGES].sum(axis=2) - 0.25 * ends[:, HEX_FACES].sum(axis=2)
            bodies = 0.25 * edges.sum(axis=1, keepdims=True) - 0.25 * ends.sum(axis=1, keepdims=True)
        _place(places[:, node:], mesh.facets, numbers[:, HEX_FACES], faces)
        places[:, node + mesh.facets.shape[1] :] = bodies[:, 0].T
    bent = type(mesh)(places, mesh.t)
    determinant = bent.mapping().detDF(skfem.quadrature.get_quadrature(bent.elem(), 4)[0])
    turned = np.flatnonzero((determinant.min(axis=1) < 0.0) == (determinant.max(axis=1) > 0.0))
    if turned.size:
        raise SolidError(f"element {turned[0]} of {len(cells)} is turned inside out; mesh finer where it is curved")
    return bent


def _linear_tetrahedra(points: Floats, cells: Integers) -> Any:
    return skfem.MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))


def entity_numbers(entities: Integers, corners: Integers) -> Integers:
    """Numbers (m,) of edges or faces, given by corners (m, c) in any order, among all of a mesh (c, n)."""
    known = np.sort(np.asarray(entities), axis=0).T
    asked = np.sort(corners, axis=1)
    _, label = np.unique(np.concatenate([known, asked]), axis=0, return_inverse=True)
    label = label.ravel()
    number = np.empty(label.max() + 1, dtype=np.int64)
    number[label[: len(known)]] = np.arange(len(known))
    return number[label[len(known) :]]


def _place(places: Floats, entities: Integers, corners: Integers, wanted: Floats) -> None:
    """Put the nodes (3, ...) of edges or faces, (c, n), where elements of corners (m, e, c) want them (m, e, 3)."""
    places[:, entity_numbers(entities, corners.reshape(-1, corners.shape[2]))] = wanted.reshape(-1, 3).T
