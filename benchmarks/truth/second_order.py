"""Compliance of an open sector of one gear under given cell forces, by 20-node bricks."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse
import skfem

from cases import TEETH, LoadCase
from fe_ste.elasticity.bricks import gradient_products, skfem_mesh
from fe_ste.elasticity.hexmesh import MeshSettings, SectorMesh, refined_sector_mesh
from fe_ste.elimination import factorise
from fe_ste.geometry.gears import Gear
from fe_ste.tools.arrays import Floats, Integers, SparseMatrix

CHUNK = 1000
"""Elements assembled at a time."""

VTK_TO_SKFEM = [6, 2, 5, 7, 1, 3, 4, 0]
"""Corners of a hexahedron in the order of scikit-fem."""


@dataclass(frozen=True)
class Fineness:
    """Sizes of elements; all are divided by `factor`.

    Parameters
    ----------
    factor : float
    contact : float
        Size at the contact line in widths of a cell.
    growth : float
        Growth of the size per length from there.
    largest : float
        Largest size on a loaded flank and through the tooth, normal modules.
    end, end_growth, layer : float
        Thickness of the layer at an end face, its growth per length, and the largest thickness, normal modules.
    """

    factor: float = 1.0
    contact: float = 0.6
    growth: float = 0.5
    largest: float = 0.4
    end: float = 0.09
    end_growth: float = 0.5
    layer: float = 0.8
    fillet: float = 9.0
    root: float = 5.0
    rim: float = 20.0
    idle: float = 1.0


def graded(length: float, sizes: Floats, count: int | None = None) -> Floats:
    """Fractions 0..1 that bound elements over a length, sized as given at equally spaced places."""
    density = 1.0 / sizes
    passed = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2)]) * length / (len(sizes) - 1)
    count = count or max(4, math.ceil(passed[-1]))
    fractions = np.interp(np.linspace(0.0, passed[-1], count + 1), passed, np.linspace(0.0, 1.0, len(sizes)))
    fractions[0], fractions[-1] = 0.0, 1.0
    return np.asarray(fractions)


def layers(gear: Gear, fineness: Fineness) -> Floats:
    """Axial positions of the layers, graded to both ends."""
    module, width = gear.normal_module, gear.face_width
    places = np.linspace(0.0, width, 4001)
    end = np.minimum(places, width - places)
    factor = fineness.factor
    sizes = np.minimum(
        fineness.end * module / factor + fineness.end_growth / factor * end, fineness.layer * module / factor
    )
    return width * (graded(width, sizes) - 0.5)


def loaded_tooth(
    gear: Gear, side: int, roll: Floats, z: Floats, load: LoadCase, chosen: Integers, fineness: Fineness
) -> SectorMesh:
    """Mesh of a tooth, fine about its contact line; `roll` (layers + 1,) is the line's."""
    factor, module = fineness.factor, gear.normal_module
    form, tip = ((radius / gear.base_radius) ** 2 - 1.0 for radius in (gear.form_radius, gear.tip_radius))
    length = gear.base_radius * abs(tip - form) / 2.0
    places = np.linspace(0.0, 1.0, 2001)
    if len(chosen):
        cell = 2.0 * np.median(load.cells.half_across[chosen])
        band = 3.0 * cell  # half of the part of the window that carries load
        smallest = fineness.contact * cell / factor
        centres = np.clip((np.maximum(roll, 0.0) ** 2 - form) / (tip - form), 0.0, 1.0)
        outside = np.maximum(np.abs(places - centres[:, None]) * length - band, 0.0)
        sizes = np.minimum(smallest + fineness.growth / factor * outside, fineness.largest * module / factor)
        through = np.linspace(0.0, 1.0, 2001) * math.pi / 2 * gear.transverse_module
        across = graded(
            through[-1],
            np.minimum(smallest + fineness.growth / factor * through, fineness.largest * module / factor),
        )
    else:
        sizes = np.full((len(z), len(places)), 0.9 * module / factor / fineness.idle)
        across = graded(1.0, np.full(11, 0.25 / factor / fineness.idle))
    count = max(len(graded(length, row)) - 1 for row in sizes)
    fractions = np.stack([graded(length, row, count) for row in sizes])
    settings = MeshSettings(
        layers=len(z) - 1,
        flank=count,
        thickness=len(across) - 1,
        fillet=max(2, round(fineness.fillet * factor)),
        root=max(2, round(fineness.root * factor)),
        rim=max(4, round(fineness.rim * factor)),
    )
    return replace(
        refined_sector_mesh(gear, settings, fractions, 1.0 - across[::-1] if side > 0 else across), axial_positions=z
    )


@dataclass(frozen=True)
class Sector:
    """Bricks of neighbouring teeth of a gear, tooth 0 on the x axis; see `fe_ste.elasticity.hexmesh`."""

    points: Floats
    hexahedra: Integers
    held: Integers
    meshes: list[SectorMesh]
    first_brick: Integers


def sector(load: LoadCase, number: int, fineness: Fineness) -> Sector:
    """Mesh of the open sector of gear 0 or 1 of a load case."""
    gear, side, cell_roll, tooth = load.on_gear(number)
    z = layers(gear, fineness)
    numbers = np.arange(TEETH) - TEETH // 2
    if np.abs(tooth).max() > TEETH // 2:
        raise ValueError(f"tooth {tooth[np.argmax(np.abs(tooth))]} carries load; the sector has {TEETH} teeth")
    meshes = []
    for one in numbers:
        chosen = np.flatnonzero(tooth == one)
        line = np.zeros(len(z))
        if len(chosen):
            line = _line(load, number, int(load.cells.tooth[chosen[0]]), z)
        meshes.append(loaded_tooth(gear, side, line, z, load, chosen, fineness))
    first_point = np.cumsum([0] + [len(mesh.points) for mesh in meshes])
    first_brick = np.cumsum([0] + [len(mesh.hexahedra) for mesh in meshes])
    points = np.concatenate(
        [_turned(mesh.points, k * gear.angular_pitch) for mesh, k in zip(meshes, numbers, strict=True)]
    )
    bricks = np.concatenate([mesh.hexahedra + first for mesh, first in zip(meshes, first_point[:-1], strict=True)])
    held = np.concatenate([mesh.held_nodes + first for mesh, first in zip(meshes, first_point[:-1], strict=True)])
    target = np.arange(len(points))
    for k in range(1, TEETH):
        behind = _cut(meshes[k - 1], 1) + first_point[k - 1]
        ahead = _cut(meshes[k], -1) + first_point[k]
        if np.abs(points[ahead] - points[behind]).max() > 1e-9 * gear.tip_radius:
            raise ValueError("sectors do not meet")
        target[ahead] = target[behind]
    kept, renumbered = np.unique(target, return_inverse=True)
    return Sector(points[kept], renumbered[bricks], np.unique(renumbered[held]), meshes, first_brick)


def _line(load: LoadCase, number: int, tooth: int, z: Floats) -> Floats:
    """Roll angle of the rigid contact line of a tooth pair on gear 0 or 1."""
    from fe_ste.elasticity.gear_mesh import contact_line_rolls

    return contact_line_rolls(load.pair, tooth, load.pmc, z)[number]


def _cut(mesh: SectorMesh, side: int) -> Integers:
    section = mesh.section.plus_cut if side > 0 else mesh.section.minus_cut
    return np.asarray((np.arange(len(mesh.axial_positions))[:, None] * len(mesh.section.points) + section).ravel())


def _turned(points: Floats, angle: float) -> Floats:
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.asarray(points @ np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]))


def stiffness(basis: skfem.CellBasis, mesh: skfem.MeshHex, gear: Gear) -> SparseMatrix:
    """Stiffness matrix (3 n, 3 n) of 20-node bricks; unknown ``3 * scalar unknown + direction``."""
    element, total = skfem.ElementHexS2(), None
    size = 3 * basis.N
    for start in range(0, mesh.t.shape[1], CHUNK):
        elements = np.arange(start, min(start + CHUNK, mesh.t.shape[1]))
        part = skfem.CellBasis(mesh, element, elements=elements, intorder=4)
        gradients = np.stack([field[0].grad for field in part.basis])
        matrices = gradient_products(gradients, np.asarray(part.dx), gear.material)
        unknowns = (3 * basis.element_dofs[:, elements].T[:, :, None] + np.arange(3)).reshape(len(elements), -1)
        unknowns = unknowns.astype(np.int32)
        rows, columns = np.broadcast_arrays(unknowns[:, :, None], unknowns[:, None, :])
        block = scipy.sparse.coo_matrix((matrices.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)).tocsr()
        total = block if total is None else total + block
    return total


@dataclass(frozen=True)
class CellPoints:
    """Quadrature points of the cells on their flank.

    Attributes
    ----------
    roll, z, fraction : ndarray (cells, points)
        Roll angle, place along the axis (m), and place between form and tip circle by arc length.
    weight : ndarray (points,)
        Adds up to 1.
    """

    roll: Floats
    z: Floats
    fraction: Floats
    weight: Floats


def _cell_points(load: LoadCase, number: int) -> CellPoints:
    gear, side, cell_roll, _ = load.on_gear(number)
    kappa = math.tan(gear.base_helix_angle) / gear.base_radius * side * (-1.0 if gear.internal else 1.0)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    part = np.concatenate([nodes / 2 - 0.5, nodes / 2 + 0.5])
    share = np.concatenate([weights, weights]) / 4.0
    a, b = (x.ravel() for x in np.meshgrid(part, part, indexing="ij"))
    along = load.half_along * math.cos(gear.base_helix_angle) * b
    z = load.axial[load.cells.layer][:, None] + along
    roll = cell_roll[:, None] + kappa * along
    # On either gear cells have the same width across the contact line: arc lengths of both flanks roll on one another.
    across = load.cells.half_across[:, None] * a * _sense(load, number)
    fraction = _fraction(gear, 0.5 * gear.base_radius * roll**2 + across)
    # A cell whose rectangle leans beyond the tip edge stands upright instead, on the flank.
    leans = ((fraction < 0.0) | (fraction > 1.0)).any(axis=1)
    fraction[leans] = _fraction(gear, 0.5 * gear.base_radius * cell_roll[:, None] ** 2 + across)[leans]
    return CellPoints(roll, z, np.clip(fraction, 0.0, 1.0), np.outer(share, share).ravel())


def _fraction(gear: Gear, arc: Floats) -> Floats:
    """Place between form and tip circle, 0..1, of arc lengths of the involute."""
    form, tip = ((radius / gear.base_radius) ** 2 - 1.0 for radius in (gear.form_radius, gear.tip_radius))
    return np.asarray((2.0 * arc / gear.base_radius - form) / (tip - form))


def _within(places: Floats, bounds: Floats) -> tuple[Integers, Floats]:
    """Interval of increasing bounds (n, k), by row, that holds each of the places (n,), and where in it, 0..1."""
    strip = np.clip((bounds < places[:, None]).sum(axis=1) - 1, 0, bounds.shape[1] - 2)
    row = np.arange(len(places))
    low, high = bounds[row, strip], bounds[row, strip + 1]
    return strip, (places - low) / (high - low)


def _shape_functions(mesh: SectorMesh, side: int, z: Floats, fraction: Floats) -> tuple[Integers, Floats]:
    """Bricks (n,) of a tooth behind points of its flank, and their 20 shape functions (n, 20) there."""
    flank = mesh.section.plus_flank if side > 0 else mesh.section.minus_flank
    layer = np.clip(np.searchsorted(mesh.axial_positions, z) - 1, 0, len(mesh.axial_positions) - 2)
    start = mesh.axial_positions[layer]
    t = (z - start) / (mesh.axial_positions[layer + 1] - start)
    nodes = mesh.layer_points[:, flank]
    arcs = 0.5 * mesh.gear.base_radius * (np.sum(nodes[..., :2] ** 2, axis=-1) / mesh.gear.base_radius**2 - 1.0)
    node_fraction = _fraction(mesh.gear, arcs)
    bounds = (1 - t)[:, None] * node_fraction[layer] + t[:, None] * node_fraction[layer + 1]
    upwards = bounds[0, -1] > bounds[0, 0]
    strip, s = _within(*((fraction, bounds) if upwards else (1.0 - fraction, 1.0 - bounds)))
    # Elements with an edge on the flank, by their strip.
    quads, first, second = mesh.section.quads, flank[:-1], flank[1:]
    edges = zip(first, second, strict=True)
    element = np.array([np.flatnonzero((quads == a).any(1) & (quads == b).any(1))[0] for a, b in edges])
    brick = layer * len(quads) + element[strip]
    corners = mesh.hexahedra[:, VTK_TO_SKFEM][brick]
    below = layer * len(mesh.section.points)
    above = below + len(mesh.section.points)
    wanted = np.stack(
        [first[strip] + below, second[strip] + below, first[strip] + above, second[strip] + above], axis=1
    )
    local = skfem.ElementHex1.doflocs[(corners[:, None, :] == wanted[:, :, None]).argmax(axis=2)]
    part = np.stack([(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t], axis=1)
    places = np.einsum("pk,pkd->dp", part, local)
    return brick, np.stack([skfem.ElementHexS2().lbasis(places, i)[0] for i in range(20)], axis=1)


def load_vector(sector: Sector, basis: skfem.CellBasis, load: LoadCase, number: int) -> scipy.sparse.csc_matrix:
    """Consistent forces (3 n, cells) of unit forces on the cells, positive into the material."""
    gear, side, _, tooth = load.on_gear(number)
    points = _cell_points(load, number)
    rows, columns, values = [], [], []
    for k, mesh in enumerate(sector.meshes):
        chosen = np.flatnonzero(tooth == k - TEETH // 2)
        if not len(chosen):
            continue
        z = points.z[chosen].ravel()
        brick, functions = _shape_functions(mesh, side, z, points.fraction[chosen].ravel())
        normal = _inward(gear, side, points.roll[chosen].ravel(), z, (k - TEETH // 2) * gear.angular_pitch)
        weighted = np.tile(points.weight, len(chosen))[:, None] * functions
        unknowns = 3 * basis.element_dofs[:, brick + sector.first_brick[k]].T[:, :, None] + np.arange(3)
        cell = np.repeat(chosen, len(points.weight))
        rows.append(unknowns.ravel())
        values.append((weighted[:, :, None] * normal[:, None, :]).ravel())
        columns.append(np.broadcast_to(cell[:, None, None], unknowns.shape).ravel())
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return scipy.sparse.coo_matrix(entries, shape=(3 * basis.N, len(tooth))).tocsc()


def _sense(load: LoadCase, number: int) -> float:
    """Sense in which arc lengths of the gear grow with those of gear 1."""
    return 1.0 if number == 0 or load.pair.gear.internal else -1.0


def _inward(gear: Gear, side: int, roll: Floats, z: Floats, turned: float) -> Floats:
    pressure_angle = np.arctan(roll)
    radius = gear.base_radius * np.sqrt(1.0 + roll**2)
    angle = side * gear.half_angle(radius) + math.tan(gear.base_helix_angle) / gear.base_radius * z + turned
    radial = (-1.0 if gear.internal else 1.0) * np.sin(pressure_angle)
    tangential = side * np.cos(pressure_angle)
    normal = np.stack(
        [
            radial * np.cos(angle) - tangential * np.sin(angle),
            radial * np.sin(angle) + tangential * np.cos(angle),
            np.full_like(angle, -side * math.tan(gear.base_helix_angle)),
        ],
        axis=-1,
    )
    return np.asarray(-normal * math.cos(gear.base_helix_angle))


@dataclass(frozen=True)
class Deflection:
    """Mean displacement (n,) of the cells, m, and the number of unknowns."""

    mean: Floats
    unknowns: int


def deflection(load: LoadCase, number: int, fineness: Fineness) -> Deflection:
    """Displacement of the cells of a load case on gear 0 or 1, averaged over each cell."""
    mesh3 = sector(load, number, fineness)
    mesh = skfem_mesh(mesh3.points, mesh3.hexahedra)
    basis = skfem.CellBasis(mesh, skfem.ElementHexS2(), intorder=1)
    gear = load.on_gear(number)[0]
    cells = load_vector(mesh3, basis, load, number)
    is_held = np.zeros(mesh.p.shape[1], dtype=bool)
    is_held[mesh3.held] = True
    held = np.concatenate([basis.dofs.nodal_dofs[0, is_held], basis.dofs.edge_dofs[0, is_held[mesh.edges].all(axis=0)]])
    free = np.setdiff1d(np.arange(basis.N), held)
    unknowns = (3 * free[:, None] + np.arange(3)).ravel()
    matrix = stiffness(basis, mesh, gear)[unknowns][:, unknowns]
    with factorise(matrix) as factor:
        free_cells = cells[unknowns]
        solution = factor.solve(free_cells @ load.force)
    mean = free_cells.T @ solution
    return Deflection(np.asarray(mean), len(unknowns))
