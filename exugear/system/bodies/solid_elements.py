"""Solid finite elements: nodes of second order, facets, seats, mass and stiffness.

Displacements are of second order on hexahedra or tetrahedra. The matrices come from the gradients of the scalar shape
functions, all elements at once: three displacement components share them.

Every mesh comes out as scikit-fem's `MeshHex2` (27 nodes) or `MeshTet2` (10 nodes). Elements of first order keep their
straight edges and get nodes in the middle; the displacement is of second order in either case.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from exugear.system.bodies.lazy import lazy_import
from fe_ste.geometry.gears import Material
from fe_ste.tools.arrays import Floats, Integers, SparseMatrix

if TYPE_CHECKING:
    import skfem
else:
    skfem = lazy_import("skfem")


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
        return expand_to_directions(self.scalar_mass)

    def rigid_motions(self, centre: Sequence[float]) -> Floats:
        """Give translations, and turns about a centre (3,) m, over all unknowns (3 n, 6)."""
        x, y, z = (self.nodes - np.asarray(centre)).T
        motions = np.zeros((len(self.nodes), 3, 6))
        motions[:, :, :3] = np.eye(3)
        motions[:, 1, 3], motions[:, 2, 3] = -z, y
        motions[:, 2, 4], motions[:, 0, 4] = -x, z
        motions[:, 0, 5], motions[:, 1, 5] = -y, x
        return motions.reshape(-1, 6)


def expand_to_directions(scalar: SparseMatrix) -> SparseMatrix:
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

    if tetrahedral:
        straight = skfem.MeshTet(np.ascontiguousarray(points[used].T), np.ascontiguousarray(numbers.T))
    else:
        straight = skfem_mesh(points[used], numbers)
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
        raise SolidError(f"element {turned[0]} of {len(cells)} is inverted; refine the mesh at curved faces")
    return bent


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


# Facets of solid meshes: their corners in order, seen from outside


def ordered_corners(mesh: Any, facets: Integers) -> Integers:
    """Corners (f, 4) of facets, seen from outside of their first element counter-clockwise; a triangle repeats one."""
    corners = np.asarray(mesh.facets)[:, facets].T
    places = np.asarray(mesh.doflocs).T
    if corners.shape[1] == 4:
        # The corners of each quadrilateral go in the order around it.
        points = places[corners]
        away = points - points.mean(axis=1, keepdims=True)
        start = away[:, 0]
        normal = np.cross(start, away[:, 1]) + np.cross(start, away[:, 2])
        sideways = np.cross(normal, start)
        angle = np.arctan2(
            np.einsum("fcd,fd->fc", away, sideways) * np.linalg.norm(start, axis=1)[:, None],
            np.einsum("fcd,fd->fc", away, start) * np.linalg.norm(sideways, axis=1)[:, None],
        )
        corners = np.take_along_axis(corners, np.argsort(angle, axis=1), axis=1)
    points = places[corners]
    normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    inside = places[np.asarray(mesh.t)[:, np.asarray(mesh.f2t)[0, facets]].T].mean(axis=1)
    inward = np.einsum("fd,fd->f", normal, points.mean(axis=1) - inside) < 0.0
    corners = np.where(inward[:, None], corners[:, ::-1], corners)
    return np.asarray(np.column_stack([corners, corners[:, 2]]) if corners.shape[1] == 3 else corners)


# Seats on meshed solids: bands of cylinders and flat rings, each with the rigid motion nearest to its surface's

SURFACE_TOLERANCE = 1e-3
"""Distance from a seat's surface, as a share of its radius, up to which a corner lies on it."""


@dataclass(frozen=True)
class SolidSeat:
    """Where something sits on a solid: a band of a cylinder along z, or a flat ring across z."""

    name: str
    centre: tuple[float, float, float]
    """(3,) on the axis of the cylinder, in the middle of the band; m."""
    radius: float
    """Of the cylinder, or outer radius of the flat ring, m."""
    width: float = 0.0
    """Of the band, m; 0 for a flat ring."""
    inner_radius: float = 0.0
    """Of a flat ring, m."""
    sector: tuple[float, float] | None = None
    """Middle and extent (rad) of the part around the axis that belongs to it; all of it by default."""


def seat_rows(solid: Solid, seats: Sequence[SolidSeat]) -> Floats:
    """Seat coordinates as averages of the unknowns, (6 s, 3 n): the rigid motion nearest to the surface's.

    Nearest means least square distance over the area of the seat's facets, so that loads on a seat spread evenly.

    Raises
    ------
    SolidError
        No seat, a seat without facets, or two seats that share some.
    """
    if not seats:
        raise SolidError("a body requires at least one seat")
    facets = {seat.name: _facets(solid.mesh, seat) for seat in seats}
    taken: dict[int, str] = {}  # seat by facet
    for name, numbers in facets.items():
        if not numbers.size:
            raise SolidError(f"seat {name}: no face of the mesh lies on it")
        shared = next((taken[n] for n in numbers.tolist() if n in taken), None)
        if shared is not None:
            raise SolidError(f"seats {shared} and {name} share faces; move or narrow one")
        taken |= dict.fromkeys(numbers.tolist(), name)
    return np.concatenate([_rows(solid.mesh, facets[seat.name], np.array(seat.centre)) for seat in seats])


def _facets(mesh: Any, seat: SolidSeat) -> Integers:
    """Numbers of the facets on a seat's surface."""
    points = np.asarray(mesh.p)[:, np.asarray(mesh.facets)] - np.reshape(seat.centre, (3, 1, 1))
    points = points[:, : 3 if mesh.t.shape[0] == 4 else 4]
    radius = np.hypot(points[0], points[1])
    height = points[2]
    middle = points.mean(axis=1)
    slack = SURFACE_TOLERANCE * seat.radius
    if seat.width > 0.0:
        on = (np.abs(radius - seat.radius) < slack).all(axis=0) & (np.abs(middle[2]) < seat.width / 2.0)
        on &= np.ptp(height, axis=0) > slack  # an end face may have all its corners on the circle
    else:
        on = (np.abs(height) < slack).all(axis=0)
        on &= (radius.min(axis=0) > seat.inner_radius - slack) & (radius.max(axis=0) < seat.radius + slack)
    if seat.sector is not None:
        away = np.angle(np.exp(1j * (np.arctan2(middle[1], middle[0]) - seat.sector[0])))
        on &= np.abs(away) < seat.sector[1] / 2.0
    return np.flatnonzero(on)


def _rows(mesh: Any, facets: Integers, centre: Floats) -> Floats:
    """Averages over facets, (6, 3 n): displacement of the centre and turns."""
    nodes = facet_nodes(mesh, facets)
    element = skfem.ElementTriP2() if nodes.shape[1] == 6 else skfem.ElementQuad2()
    points, weights = skfem.quadrature.get_quadrature(element, 5)
    functions = [element.lbasis(points, number) for number in range(nodes.shape[1])]
    values = np.stack([value for value, _ in functions])
    places = np.asarray(mesh.doflocs).T[nodes]
    tangents = np.einsum("fka,kbq->bfqa", places, np.stack([slope for _, slope in functions]), optimize=True)
    weight = np.linalg.norm(np.cross(tangents[0], tangents[1]), axis=2) * weights
    arm = np.einsum("fka,kq->afq", places, values, optimize=True) - centre[:, None, None]
    share = np.zeros((4, mesh.doflocs.shape[1]))  # integrals of the shape functions, and of them times the arm
    for row, factor in enumerate((np.ones_like(weight), *arm)):
        integrals = np.einsum("fq,kq->fk", factor * weight, values)
        share[row] = np.bincount(nodes.ravel(), integrals.ravel(), share.shape[1])
    motions = np.zeros((6, 3, *weight.shape))
    motions[:3] = np.eye(3)[:, :, None, None]
    loads = np.zeros((6, 3, share.shape[1]))
    loads[:3] = np.eye(3)[:, :, None] * share[0]
    # A turn about an axis moves the arm along the two axes after it in cyclic order.
    for turn, (after, before) in enumerate(((1, 2), (2, 0), (0, 1))):
        motions[3 + turn, after], motions[3 + turn, before] = -arm[before], arm[after]
        loads[3 + turn, after], loads[3 + turn, before] = -share[1 + before], share[1 + after]
    inertia = np.einsum("idfq,jdfq,fq->ij", motions, motions, weight)
    rows: Floats = np.linalg.solve(inertia, loads.transpose(0, 2, 1).reshape(6, -1))
    return rows


def facet_nodes(mesh: Any, facets: Integers) -> Integers:
    """Nodes of facets, (f, 6) or (f, 9): corners around each, middles of its edges, its own middle if it has one."""
    corners = ordered_corners(mesh, facets)[:, : 3 if mesh.t.shape[0] == 4 else 4]
    sides = [corners, np.roll(corners, -1, axis=1)]
    if corners.shape[1] == 3:  # the element's edges are 01, 12, 02; a quadrilateral's 01, 12, 23, 03
        sides = [corners[:, [0, 1, 0]], corners[:, [1, 2, 2]]]
    edges = entity_numbers(mesh.edges, np.stack(sides, axis=2).reshape(-1, 2)).reshape(corners.shape)
    vertices = int(np.max(mesh.t)) + 1
    nodes = [corners, vertices + edges]
    if corners.shape[1] == 4:
        nodes.append(vertices + mesh.edges.shape[1] + facets[:, None])
    return np.hstack(nodes)
