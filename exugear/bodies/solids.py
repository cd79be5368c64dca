"""Elastic bodies of any shape: solid finite elements, reduced to seats and a few amplitudes.

Displacements are of second order on hexahedra or tetrahedra (`exugear.bodies.solid_mesh`). Mass and stiffness come
from the gradients of the scalar shape functions, all elements at once: three displacement components share them.

A body is reduced free of all supports; what holds a housing are supports on its seats. The frame its coordinates are
seen from decides on the gyroscopic matrix:

nonrotating
    A body of revolution that turns inside a frame that does not: G = C' - C'^T with C' = int rho N (x d_y - y d_x) N,
    as for turned shafts (`exugear.bodies.turned_section`).
carrier
    A body seen from its own turning frame: the constant Coriolis matrix, 2 int rho phi_i . (e_z x phi_j). Centrifugal
    stiffness and softening are left out together; at the speed of a planet carrier both are far below its stiffness.
ground
    A body that does not turn: none.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse
import skfem

from exugear.bodies.reduced_body import Blank, ReductionSummary, Frame, ReducedBody, ReductionError, Seat, Surface
from exugear.bodies.reduction import ReducedComponent, selective_mass_scaling, reduce_component
from exugear.bodies.solid_mesh import SolidError, SolidFile, entity_numbers
from exugear.bodies.store import kept
from exugear.model.versions import REDUCTION
from fe_ste.elasticity.bricks import gradient_products
from fe_ste.geometry.gears import Material
from fe_ste.tools.arrays import Floats, Integers, SparseMatrix
from fe_ste.tools.sparse import Backend

ELEMENTS_AT_A_TIME = 1000
"""Elements whose matrices are held together."""
SURFACE_TOLERANCE = 1e-3
"""Distance from a seat's surface, as a share of its radius, up to which a corner lies on it."""
ASYMMETRY_TOLERANCE = 5e-3
"""Relative change of the seats' mass or stiffness by a quarter turn above which a body is none of revolution."""


@dataclass(frozen=True)
class SolidSeat:
    """Where something sits on a solid: a band of a cylinder along z, or a flat ring across z.

    Attributes
    ----------
    name : str
    centre : (3,) on the axis of the cylinder, in the middle of the band; m
    radius : of the cylinder, or outer radius of the flat ring, m
    width : of the band, m; 0 for a flat ring
    inner_radius : of a flat ring, m
    sector : middle and extent (rad) of the part around the axis that belongs to it; all of it by default
    """

    name: str
    centre: tuple[float, float, float]
    radius: float
    width: float = 0.0
    inner_radius: float = 0.0
    sector: tuple[float, float] | None = None


@dataclass(frozen=True)
class Solid:
    """Matrices of a meshed solid with n nodes; unknown 3 node + direction.

    Attributes
    ----------
    mesh : skfem.MeshTet2 or skfem.MeshHex2
    nodes : (n, 3) m
    scalar_mass : (n, n) sparse, int rho N_i N_j, kg; the mass matrix holds it for each direction
    stiffness : (3 n, 3 n) sparse, N/m
    convection : (n, n) sparse, int rho N_i d_phi N_j with d_phi = x d_y - y d_x about the axis, kg
    stretching : (n, n) sparse, int rho d_phi N_i d_phi N_j, kg
    """

    mesh: Any
    nodes: Floats
    scalar_mass: SparseMatrix
    stiffness: SparseMatrix
    convection: SparseMatrix
    stretching: SparseMatrix

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
    material : Material
    axis : (x, y) of the axis of turning, parallel to z, m

    Examples
    --------
    >>> box = skfem.MeshHex.init_tensor([0.0, 0.2, 0.4], [0.0, 0.2], [0.0, 0.1])
    >>> solid = assemble(skfem.MeshHex2.from_mesh(box), Material(density=1000.0))
    >>> round(float(solid.scalar_mass.sum()), 9)
    8.0
    """
    numbering = skfem.assembly.Dofs(mesh, mesh.elem())
    dofs = np.asarray(numbering.element_dofs).T.astype(np.int64)
    count, corners = mesh.doflocs.shape[1], dofs.shape[1]
    places = np.asarray(mesh.doflocs).T - np.array([*axis, 0.0])
    points, weights = skfem.quadrature.get_quadrature(mesh.elem(), 4 if corners == 10 else 5)
    functions = [mesh.elem().lbasis(points, number) for number in range(corners)]
    values = np.stack([value for value, _ in functions])[:, None, :]
    local = np.stack([slope for _, slope in functions])
    pairs = dofs[:, :, None] * count + dofs[:, None, :]
    entries, place = np.unique(pairs, return_inverse=True)
    place = place.reshape(len(dofs), -1)
    scalar = {name: np.zeros(len(entries)) for name in ("mass", "convection", "stretching")}
    blocks = np.zeros((3, 3, len(entries)))
    for start in range(0, len(dofs), ELEMENTS_AT_A_TIME):
        chosen = np.arange(start, min(start + ELEMENTS_AT_A_TIME, len(dofs)))
        where = place[chosen].ravel()
        x, y, slopes, volume = _fields(places[dofs[chosen]], values, local, weights)
        around = x * slopes[:, 1] - y * slopes[:, 0]
        weighted = material.density * volume
        for name, left, right in (
            ("mass", values, values),
            ("convection", values, around),
            ("stretching", around, around),
        ):
            matrices = np.matmul(
                (left * weighted).transpose(1, 0, 2), np.broadcast_to(right, around.shape).transpose(1, 2, 0)
            )
            scalar[name] += np.bincount(where, matrices.ravel(), len(entries))
        stiffness = gradient_products(slopes, volume, material).reshape(len(chosen), corners, 3, corners, 3)
        for a in range(3):
            for b in range(3):
                blocks[a, b] += np.bincount(where, stiffness[:, :, a, :, b].ravel(), len(entries))
    rows, columns = entries // count, entries % count
    first = np.searchsorted(rows, np.arange(count + 1))
    size = (count, count)
    matrices = {name: scipy.sparse.csr_array((data, columns, first), shape=size) for name, data in scalar.items()}
    whole = scipy.sparse.bsr_array((blocks.transpose(2, 0, 1), columns, first), shape=(3 * count, 3 * count)).tocsr()
    return Solid(
        mesh=mesh,
        nodes=np.asarray(mesh.doflocs).T,
        scalar_mass=0.5 * (matrices["mass"] + matrices["mass"].T),
        stiffness=0.5 * (whole + whole.T),
        convection=matrices["convection"],
        stretching=0.5 * (matrices["stretching"] + matrices["stretching"].T),
    )


def _fields(places: Floats, values: Floats, local: Floats, weights: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Places x and y (e, q), slopes (k, 3, e, q) and volumes (e, q) at the q integration points of e elements.

    Nodes (e, k, 3); values (k, 1, q) and slopes (k, 3, q) of the shape functions on the reference element.
    """
    jacobian = np.einsum("eka,kbq->eqab", places, local, optimize=True)
    slopes = np.einsum("kbq,eqba->kaeq", local, np.linalg.inv(jacobian), optimize=True)
    x, y = np.einsum("eka,kq->aeq", places[:, :, :2], values[:, 0], optimize=True)
    return x, y, slopes, np.abs(np.linalg.det(jacobian)) * weights


def seat_rows(solid: Solid, seats: Sequence[SolidSeat]) -> Floats:
    """Seat coordinates as averages of the unknowns, (6 s, 3 n): the rigid motion nearest to the surface's.

    Nearest means least square distance over the area of the seat's facets, so that loads on a seat spread evenly.

    Raises
    ------
    SolidError
        No seat, a seat without facets, or two seats that share some.
    """
    if not seats:
        raise SolidError("a body needs at least one seat")
    facets = {seat.name: _facets(solid.mesh, seat) for seat in seats}
    taken: dict[int, str] = {}
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
    radius, height = np.hypot(points[0], points[1]), points[2]
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
    nodes = _facet_nodes(mesh, facets)
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
    for turn, (one, other) in enumerate(((1, 2), (2, 0), (0, 1))):
        motions[3 + turn, one], motions[3 + turn, other] = -arm[other], arm[one]
        loads[3 + turn, one], loads[3 + turn, other] = -share[1 + other], share[1 + one]
    inertia = np.einsum("idfq,jdfq,fq->ij", motions, motions, weight)
    rows: Floats = np.linalg.solve(inertia, loads.transpose(0, 2, 1).reshape(6, -1))
    return rows


def _facet_nodes(mesh: Any, facets: Integers) -> Integers:
    """Nodes of facets, (f, 6) or (f, 9): corners around each, middles of its edges, its own middle if it has one."""
    corners = _ordered_corners(mesh, facets)[:, : 3 if mesh.t.shape[0] == 4 else 4]
    sides = [corners, np.roll(corners, -1, axis=1)]
    if corners.shape[1] == 3:  # the element's edges are 01, 12, 02; a quadrilateral's 01, 12, 23, 03
        sides = [corners[:, [0, 1, 0]], corners[:, [1, 2, 2]]]
    edges = entity_numbers(mesh.edges, np.stack(sides, axis=2).reshape(-1, 2)).reshape(corners.shape)
    vertices = int(np.max(mesh.t)) + 1
    nodes = [corners, vertices + edges]
    if corners.shape[1] == 4:
        nodes.append(vertices + mesh.edges.shape[1] + facets[:, None])
    return np.hstack(nodes)


@dataclass(frozen=True)
class SolidModel:
    """All that a reduced solid depends on.

    Attributes
    ----------
    name : str
    mesh : skfem.MeshTet2 or skfem.MeshHex2, in the gearbox's coordinates, m; or the file with it
    material : Material
    seats : where other things sit
    frame : where its coordinates are seen from
    band : free vibrations up to here are exact, Hz
    limit : vibrations of the reduced body above this are slowed down to it, Hz
    blanks : seat name -> rigid ring on it
    axis : (x, y) of the axis of turning, parallel to z, m
    """

    name: str
    mesh: Any
    material: Material
    seats: tuple[SolidSeat, ...]
    frame: Frame
    band: float
    limit: float
    blanks: Mapping[str, Blank] = field(default_factory=dict)
    axis: tuple[float, float] = (0.0, 0.0)

    @property
    def key(self) -> str:
        """SHA-256 of these inputs and of the version of the method that reduces them."""
        words = {
            "material": asdict(self.material),
            "seats": [asdict(seat) for seat in self.seats],
            "blanks": {name: asdict(blank) for name, blank in self.blanks.items()},
            "method_version": REDUCTION,
            "rest": [self.name, self.frame, self.band, self.limit, self.axis],
        }
        if isinstance(self.mesh, SolidFile):
            shape = [self.mesh.digest]
        else:
            shape = [np.ascontiguousarray(a).tobytes() for a in (self.mesh.doflocs, self.mesh.t)]
        return hashlib.sha256(b"".join([json.dumps(words, sort_keys=True).encode(), *shape])).hexdigest()

    @property
    def elements(self) -> Any:
        """The mesh itself, read from its file if it is in one."""
        return self.mesh.mesh if isinstance(self.mesh, SolidFile) else self.mesh


@dataclass(frozen=True)
class ReducedSolid:
    """A solid's matrices and their reduction, before anything is dropped.

    Attributes
    ----------
    solid : the whole model
    part : reduced; shapes (3 n, coordinates)
    seconds : wall time that it took
    """

    solid: Solid
    part: ReducedComponent
    seconds: float


def reduce_matrices(model: SolidModel, backend: Backend | None = None) -> ReducedSolid:
    """Assemble a solid and reduce its matrices; what `reduce_solid` makes a body of.

    Raises
    ------
    SolidError, ReductionError
        As `reduce_solid`.
    """
    began = time.perf_counter()
    names = [seat.name for seat in model.seats]
    for name in model.blanks:
        if name not in names:
            raise ReductionError(f"body {model.name}: blank on {name!r}, but the seats are {', '.join(names)}")
    solid = assemble(model.elements, model.material, model.axis)
    rings = [model.blanks.get(name, Blank(0.0, 0.0, 0.0)) for name in names]
    masses = np.diag([m for b in rings for m in (*[b.mass] * 3, b.transverse, b.transverse, b.axial)])
    part = reduce_component(
        solid.mass,
        solid.stiffness,
        seat_rows(solid, model.seats),
        solid.rigid_motions((*model.axis, 0.0)),
        masses,
        model.band,
        backend,
    )
    return ReducedSolid(solid, part, time.perf_counter() - began)


def reduce_solid(model: SolidModel, backend: Backend | None = None) -> ReducedBody:
    """Reduce a solid.

    Parameters
    ----------
    model : SolidModel
    backend : {"pardiso", "superlu"}, optional
        Library that factorises; the fastest installed by default.

    Raises
    ------
    SolidError
        A seat without faces, or two that share some.
    ReductionError
        A blank without its seat, too few seats, or a body in the frame "nonrotating" that is none of revolution.
    """
    return reduced_body(model, reduce_matrices(model, backend))


def reduced_body(model: SolidModel, reduced: ReducedSolid) -> ReducedBody:
    """Reduced body from a solid's matrices; errors as `reduce_solid`."""
    began = time.perf_counter()
    part, size = reduced.part, reduced.part.shapes.shape[1]
    mass, slowed = selective_mass_scaling(part.mass, part.stiffness, model.limit)
    spin = np.zeros(size)
    for number, seat in enumerate(model.seats if model.frame != "ground" else ()):
        x, y = np.array(seat.centre[:2]) - model.axis
        spin[6 * number : 6 * number + 6] = [-y, x, 0.0, 0.0, 0.0, 1.0]
    return ReducedBody(
        name=model.name,
        seats=tuple(Seat(seat.name, seat.centre) for seat in model.seats),
        mass=mass,
        stiffness=part.stiffness,
        gyroscopic=gyroscopic_matrix(model, reduced),
        spin=spin,
        frame=model.frame,
        groups=("inner",) * (size - 6 * len(model.seats)),
        surface=_surface(model, reduced),
        figures=ReductionSummary(
            unknowns={"whole": 3 * len(reduced.solid.nodes)},
            seconds=reduced.seconds + time.perf_counter() - began,
            free_frequencies={"whole": part.frequencies},
            lowered={"whole": slowed},
        ),
    )


def reduction_file(model: SolidModel, folder: Path) -> Path:
    """Place of a solid's reduction in the folder where they are kept."""
    return folder / f"{model.name}-{model.key[:16]}.npz"


def load_or_reduce_solid(model: SolidModel, folder: Path) -> ReducedBody:
    """Reduced solid from a folder if it is there for exactly these inputs, else reduced and kept there."""
    return kept(reduction_file(model, folder), model.key, lambda: reduce_solid(model))


def gyroscopic_matrix(model: SolidModel, reduced: ReducedSolid) -> Floats:
    """Antisymmetric G of M q'' + Omega G q' + K q = f in the body's frame, (n, n).

    Raises
    ------
    ReductionError
        Frame "nonrotating" for a body that a quarter turn changes.
    """
    shapes, size = reduced.part.shapes, reduced.part.shapes.shape[1]
    matrix = np.zeros((size, size))
    if model.frame == "nonrotating":
        _check_revolution(model, reduced.part)
        scalar = in_each_direction(reduced.solid.convection - reduced.solid.convection.T)
        matrix = shapes.T @ (scalar @ shapes)
    elif model.frame == "carrier":
        across = shapes.reshape(-1, 3, size)
        turned = np.stack([-across[:, 1], across[:, 0], np.zeros_like(across[:, 0])], axis=1).reshape(-1, size)
        matrix = 2.0 * shapes.T @ (reduced.solid.mass @ turned)
    for number, seat in enumerate(model.seats):
        if seat.name in model.blanks and model.frame != "ground":
            own, blank = 6 * number, model.blanks[seat.name]
            # A ring's particles have int rho x^2 = int rho y^2 = axial / 2, int rho z^2 = transverse - axial / 2.
            tilt = blank.axial if model.frame == "nonrotating" else blank.axial - 2.0 * blank.transverse
            matrix[own + 3, own + 4] += tilt
            matrix[own + 4, own + 3] -= tilt
            if model.frame == "carrier":
                matrix[own, own + 1] -= 2.0 * blank.mass
                matrix[own + 1, own] += 2.0 * blank.mass
    if model.frame == "nonrotating":
        spin = np.zeros(size)
        spin[5 : 6 * len(model.seats) : 6] = 1.0
        carried = reduced.part.mass @ spin
        # Coriolis forces of the steady spin itself would be twice the centrifugal force: only what deforms has any.
        deforming = np.eye(size) - np.outer(spin, carried) / (spin @ carried)
        matrix = deforming.T @ matrix @ deforming
    return 0.5 * (matrix - matrix.T)


def _check_revolution(model: SolidModel, part: ReducedComponent) -> None:
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    count = 6 * len(model.seats)
    turn = np.kron(np.eye(count // 3), quarter)
    for name, matrix in (("mass", part.mass), ("stiffness", part.stiffness)):
        own = matrix[:count, :count]
        # Entries differ in unit: each is measured by the diagonal entries of its row and column.
        diagonal = np.sqrt(np.maximum(own.diagonal(), np.abs(turn) @ own.diagonal()))
        change = float((np.abs(turn @ own @ turn.T - own) / np.outer(diagonal, diagonal)).max())
        if change > ASYMMETRY_TOLERANCE or any(np.hypot(*(np.array(seat.centre[:2]) - model.axis)) > 0 for seat in model.seats):
            raise ReductionError(
                f"body {model.name}: a quarter turn changes its {name} by {change:.1e}, but the frame 'nonrotating' "
                "is for bodies of revolution; take 'carrier', or a finer mesh"
            )


def _surface(model: SolidModel, reduced: ReducedSolid) -> Surface:
    """Boundary of the mesh with displacement, and strain in the middle of the element below, per coordinate."""
    mesh, shapes = reduced.solid.mesh, reduced.part.shapes
    facets = np.asarray(mesh.boundary_facets())
    corners = _ordered_corners(mesh, facets)
    nodes, faces = np.unique(corners, return_inverse=True)
    dofs = np.asarray(skfem.assembly.Dofs(mesh, mesh.elem()).element_dofs).T[np.asarray(mesh.f2t)[0, facets]]
    middle = np.full((3, 1), 0.25 if mesh.t.shape[0] == 4 else 0.5)
    functions = [mesh.elem().lbasis(middle, number) for number in range(dofs.shape[1])]
    values, local = (np.stack(part) for part in zip(*functions, strict=True))
    slopes = _fields(np.asarray(mesh.doflocs).T[dofs], values[:, None, :], local, np.ones(1))[2][..., 0]
    by_node = shapes.reshape(-1, 3, shapes.shape[1])
    gradient = np.zeros((len(facets), 3, 3, shapes.shape[1]))  # of displacement component by direction
    for function, slope in zip(dofs.T, slopes, strict=True):
        gradient += by_node[function][:, :, None, :] * slope.T[:, None, :, None]
    strain = [gradient[:, i, i] for i in range(3)]
    strain += [gradient[:, i, j] + gradient[:, j, i] for i, j in ((0, 2), (0, 1), (1, 2))]
    modulus, ratio = model.material.youngs_modulus, model.material.poissons_ratio
    shear = modulus / (2.0 * (1.0 + ratio))
    elasticity = np.diag([2.0 * shear] * 3 + [shear] * 3)
    elasticity[:3, :3] += modulus * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio))
    return Surface(
        points=np.asarray(mesh.doflocs)[:, nodes].T,
        quads=faces.reshape(corners.shape).astype(np.int64),
        displacement=by_node[nodes].astype(np.float32),
        strain=np.stack(strain, axis=1).astype(np.float32),
        elasticity=elasticity,
    )


def _ordered_corners(mesh: Any, facets: Integers) -> Integers:
    """Corners (f, 4) of facets, seen from outside of their first element counter-clockwise; a triangle repeats one."""
    corners = np.asarray(mesh.facets)[:, facets].T
    places = np.asarray(mesh.doflocs).T
    if corners.shape[1] == 4:
        corners = _around(corners, places)
    points = places[corners]
    normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    inside = places[np.asarray(mesh.t)[:, np.asarray(mesh.f2t)[0, facets]].T].mean(axis=1)
    inward = np.einsum("fd,fd->f", normal, points.mean(axis=1) - inside) < 0.0
    corners = np.where(inward[:, None], corners[:, ::-1], corners)
    return np.asarray(np.column_stack([corners, corners[:, 2]]) if corners.shape[1] == 3 else corners)


def _around(corners: Integers, places: Floats) -> Integers:
    """Corners (f, 4) of quadrilaterals, put in the order around each."""
    points = places[corners]
    away = points - points.mean(axis=1, keepdims=True)
    first = away[:, 0]
    normal = np.cross(first, away[:, 1]) + np.cross(first, away[:, 2])
    other = np.cross(normal, first)
    angle = np.arctan2(
        np.einsum("fcd,fd->fc", away, other) * np.linalg.norm(first, axis=1)[:, None],
        np.einsum("fcd,fd->fc", away, first) * np.linalg.norm(other, axis=1)[:, None],
    )
    return np.asarray(np.take_along_axis(corners, np.argsort(angle, axis=1), axis=1))
