"""Trilinear bricks with incompatible modes: gradients, stiffness of elements and meshes, and errors near a load.

The elements have eight nodes and eight Gauss points. Their three incompatible modes 1 - xi^2 represent bending without
shear.

Near a load the elements cannot resolve the field, so that the displacement of the flank under a tent load has an error.
The error depends only on the elements within two or three element sizes of the load. `brick_error` therefore computes
it on a flat block: the bricks behind the flank are placed with their shapes at the surface of a half-space, for which
the exact solution is known. The other faces of the block have the displacement of the half-space (Boussinesq). The
excess displacement of its surface is the error.

Frame of the block: x across the contact lines, y along them, z into the material.

An end face meets the flank of a helical tooth at an acute or obtuse angle, and layers of bricks are too thick to
resolve the field at such an edge. For `end_errors` the bricks behind the flank are again placed at a plane surface,
which ends at an edge. The exact solution is that of a wedge (`fe_ste.elasticity.halfspace.wedge_images`).

All bricks along the edge are taken equal to those at the middle of the profile. Bricks and exact solution are then
solved for each wave number separately: for one row of bricks, and with the Fourier transform of 1 / distance, 2
K_0(wave number times distance).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse
import skfem
from scipy.special import k0

from fe_ste.elasticity.halfspace import interior_displacement, tent_integrals
from fe_ste.elasticity.hexmesh import SectorMesh
from fe_ste.geometry.gears import Material
from fe_ste.tools.arrays import Floats, Integers, SparseMatrix

_VTK_TO_SKFEM = [6, 2, 5, 7, 1, 3, 4, 0]


def skfem_mesh(points: Floats, hexahedra: Integers) -> skfem.MeshHex:
    """Return the scikit-fem mesh of hexahedra given in VTK order."""
    return skfem.MeshHex(np.ascontiguousarray(points.T), np.ascontiguousarray(hexahedra[:, _VTK_TO_SKFEM].T))


def stiffness_matrix(
    points: Floats, hexahedra: Integers, material: Material, incompatible_modes: bool = True
) -> scipy.sparse.csr_matrix:
    """Assemble the stiffness matrix of 8-node hexahedra with Wilson-Taylor incompatible modes.

    The plain trilinear brick is too stiff in bending. Three quadratic modes per direction, internal to each element and
    condensed there, correct this. Their gradients use the Jacobian at the centre of the element, so that an element of
    any shape passes the patch test.

    Parameters
    ----------
    points : (n, 3) nodes, m
    hexahedra : (m, 8) connectivity in VTK order
    incompatible_modes : False selects the plain brick, for comparison

    Returns
    -------
    (3 n, 3 n) stiffness, N/m; unknown ``3 node + direction``

    Raises
    ------
    ValueError
        An element has a Gauss point without positive volume.

    References
    ----------
    R. L. Taylor, P. J. Beresford, E. L. Wilson, Int. J. Num. Meth. Eng. 10 (1976) 1211-1219.
    """
    nodes, element_matrices = element_stiffness(points, hexahedra, material, incompatible_modes)
    unknowns = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), 24)
    rows = np.repeat(unknowns, 24, axis=1).ravel()
    columns = np.tile(unknowns, (1, 24)).ravel()
    size = 3 * len(points)
    return scipy.sparse.csr_matrix((element_matrices.ravel(), (rows, columns)), shape=(size, size))


def element_stiffness(
    points: Floats, hexahedra: Integers, material: Material, incompatible_modes: bool = True
) -> tuple[Integers, Floats]:
    """Stiffness of single elements; parameters, errors and source as in `stiffness_matrix`.

    Returns
    -------
    nodes : (m, 8) nodes of each element in the order of its matrix
    stiffness : (m, 24, 24) N/m; unknown ``3 index of the node in the element + direction``
    """
    nodes, gradients, volumes = brick_gradients(points, hexahedra)
    if incompatible_modes:
        return nodes, _condense_bubbles(gradient_products(gradients, volumes, material))
    return nodes, gradient_products(gradients[:8], volumes, material)


def brick_gradients(points: Floats, hexahedra: Integers) -> tuple[Integers, Floats, Floats]:
    """Gradients of the brick's eight shape functions and three incompatible modes at its Gauss points.

    Parameters
    ----------
    points : (n, 3) nodes, m
    hexahedra : (m, 8) connectivity in VTK order

    Returns
    -------
    nodes : (m, 8) nodes of each element in the order of the gradients
    gradients : (11, 3, m, 8)
        By function, direction, element and Gauss point; the last three functions are the incompatible modes, 1/m.
    volumes : (m, 8) volumes of the Gauss points, m^3

    Raises
    ------
    ValueError
        An element has a Gauss point without positive volume.
    """
    basis = skfem.Basis(skfem_mesh(points, hexahedra), skfem.ElementHex1(), intorder=3)
    determinant = basis.mapping.detDF(basis.X)
    if determinant.min() <= 0:
        element = int(np.argmin(determinant.min(axis=1)))
        raise ValueError(f"element {element} has a Gauss point with Jacobian {determinant.min():.3e}: the mesh folds")
    compatible = np.stack([field[0].grad for field in basis.basis])
    gradients = np.concatenate([compatible, _incompatible_gradients(basis, determinant)])
    return basis.element_dofs.T.astype(np.int64), gradients, np.asarray(basis.dx)


def brick_values() -> Floats:
    """Return the brick's eight shape functions at its Gauss points, (function, point), as in `brick_gradients`."""
    element = skfem.ElementHex1()
    points, _ = skfem.quadrature.get_quadrature(element, 3)
    return np.stack([element.lbasis(points, number)[0] for number in range(8)])


def _incompatible_gradients(basis: skfem.CellBasis, determinant: Floats) -> Floats:
    """Gradients (3, 3, elements, Gauss points) of 1 - xi^2 in each direction, with the Jacobian at the centre."""
    # Taylor, Beresford and Wilson: with Jacobian and determinant at the centre the mean gradient vanishes, so that the
    # modes do no work on a constant stress and the element passes the patch test.
    middle = np.full((3, 1), 0.5)
    inverse = basis.mapping.invDF(middle)[..., 0]
    ratio = basis.mapping.detDF(middle) / determinant
    # Derivative of the mode 1 - (2 X - 1)^2, with X from 0 to 1.
    slope = 4.0 * (1.0 - 2.0 * basis.X)
    return np.asarray(np.einsum("iae,iq,eq->iaeq", inverse, slope, ratio))


def gradient_products(gradients: Floats, volume: Floats, material: Material) -> Floats:
    """Element matrices (elements, 3 m, 3 m) of isotropic elasticity.

    Parameters
    ----------
    gradients : (m, 3, elements, points) of the shape functions at the integration points, 1/m
    volume : (elements, points) of the integration points, m^3
    """
    count, _, elements, points = gradients.shape
    flat = np.ascontiguousarray(gradients.transpose(2, 0, 1, 3)).reshape(elements, 3 * count, points)
    products = ((flat * volume[:, None, :]) @ flat.transpose(0, 2, 1)).reshape(elements, count, 3, count, 3)
    modulus = material.youngs_modulus
    ratio = material.poissons_ratio
    lame = modulus * ratio / ((1 + ratio) * (1 - 2 * ratio))
    shear = modulus / (2 * (1 + ratio))
    # B'DB of an isotropic solid: lambda div u div v + mu (grad u + grad u') : grad v.
    laplacian = np.einsum("eicjc->eij", products)
    stiffness = lame * products + shear * products.transpose(0, 1, 4, 3, 2)
    stiffness += shear * laplacian[:, :, None, :, None] * np.eye(3)[:, None, :]
    return stiffness.reshape(elements, 3 * count, 3 * count)


def _condense_bubbles(stiffness: Floats) -> Floats:
    """Eliminate the nine unknowns of the modes, which have no loads and no neighbours (static condensation)."""
    coupling = stiffness[:, 24:, :24]
    return np.asarray(
        stiffness[:, :24, :24] - coupling.transpose(0, 2, 1) @ np.linalg.solve(stiffness[:, 24:, 24:], coupling)
    )


#: Layers on either side of a load for which its error is evaluated, and elements from a load to the faces of the
# block.
ERROR_REACH = 3
BLOCK_MARGIN = 4

#: Depth of the block as a fraction of the tooth's elements.
_DEPTH = 2.0 / 3.0

#: Radius at which a flank counts as flat, in lengths of the flank.
_FLAT = 1e5


def brick_error(mesh: SectorMesh, side: int, incompatible_modes: bool = True) -> Floats:
    """Error of the bricks in the displacement of the flank nodes under tent loads, on a half-space.

    Parameters
    ----------
    mesh : with layers of one thickness
    side : loaded flank: +1 counter-clockwise, -1 clockwise
    incompatible_modes : see `stiffness_matrix`

    Returns
    -------
    (f, 2 r + 1, f)
        Bricks minus exact solution by displaced flank node, layer distance -r to r with r = `ERROR_REACH` from the
        load, and loaded flank node, m/N.

    Raises
    ------
    ValueError
        The layers differ in thickness.
    """
    steps = np.diff(mesh.axial_positions)
    if np.ptp(steps) > 1e-9 * steps.mean():
        raise ValueError(f"gear {mesh.gear.name}: layers from {steps.min():.3g} to {steps.max():.3g} m; must be equal")
    points, numbers = flat_block(mesh, side)
    hexahedra = block_bricks(points, numbers)
    stiffness = stiffness_matrix(points, hexahedra, mesh.gear.material, incompatible_modes)
    given = np.ones(numbers.shape, dtype=bool)
    given[:-1, 1:-1, 1:-1] = False
    # Numbering along the profile couples the free nodes in a narrow band.
    by_profile = numbers.swapaxes(0, 1)
    fixed = unknowns_of(numbers[given])
    free = unknowns_of(by_profile[~given.swapaxes(0, 1)])
    count = len(mesh.section.flank_roll)
    moved = _half_space(mesh, side, points[numbers[given]]).reshape(len(fixed), count)
    loads = np.zeros((stiffness.shape[0], count))
    loads[3 * numbers[0] + 2] = _tent_loads(count, numbers.shape[1:])
    found = _solved(stiffness[free][:, free], loads[free] - stiffness[free][:, fixed] @ moved)
    everywhere = np.empty((stiffness.shape[0], count))
    everywhere[fixed], everywhere[free] = moved, found
    middle = numbers.shape[2] // 2
    read = numbers[0, BLOCK_MARGIN:-BLOCK_MARGIN, middle - ERROR_REACH : middle + ERROR_REACH + 1]
    return everywhere[3 * read + 2] - _surface_displacement(mesh, side)


class FlankSpacing(NamedTuple):
    """Arc lengths (f,) of the flank nodes (m), thickness of a layer (m), shear of the layers, cos(beta_b)."""

    arc: Floats
    layer: float
    shear: float
    cosine: float


def _solved(matrix: SparseMatrix, right: Floats) -> Floats:
    """Solve a positive definite system with a narrow band; loading a sparse solver would take longer."""
    entries = scipy.sparse.tril(matrix, format="coo")
    below = entries.row - entries.col
    band = np.zeros((below.max() + 1, len(right)))
    band[below, entries.col] = entries.data
    return np.asarray(scipy.linalg.solveh_banded(band, right, overwrite_ab=True, lower=True, check_finite=False))


def flank_spacing(mesh: SectorMesh, side: int) -> FlankSpacing:
    """Return the spacing of the nodes of a flank with equal layers, developed onto a plane."""
    gear = mesh.gear
    roll = mesh.section.flank_roll
    handed = side * (-1.0 if gear.internal else 1.0)
    shear = handed * np.tan(gear.base_helix_angle) * roll.mean()
    arc = gear.base_radius * roll**2 / 2.0
    layer = mesh.axial_positions[1] - mesh.axial_positions[0]
    return FlankSpacing(arc, float(layer), float(shear), float(np.cos(gear.base_helix_angle)))


def flat_block(mesh: SectorMesh, side: int) -> tuple[Floats, Integers]:
    """Return the nodes (n, 3) of the block and their numbers by depth, position along the profile and layer.

    Along the profile the block has `BLOCK_MARGIN` additional nodes on either side of the flank.
    """
    gear = mesh.gear
    section = mesh.section
    arc, layer, shear, cosine = flank_spacing(mesh, side)
    behind = section.between_flanks[::-side]
    behind = behind[: 1 + max(2, round(_DEPTH * (len(behind) - 1)))]
    offset = section.points[behind] - section.points[behind[0]]
    # Directions of the section in the frame of the flank: its tangent, and its normal into the material.
    radius = np.hypot(*section.points[behind[0]].T)
    radial = section.points[behind[0]] / radius[:, None]
    tangential = np.stack([-radial[:, 1], radial[:, 0]], axis=-1)
    angle = np.arctan(section.flank_roll)[:, None]
    outward = (-1.0 if gear.internal else 1.0) * np.sin(angle) * radial + side * np.cos(angle) * tangential
    tangent = np.stack([outward[:, 1], -outward[:, 0]], axis=-1)
    tangent = tangent * np.sign(np.sum(tangent[0] * np.diff(section.points[behind[0]], axis=0)[0]))
    across = np.sum(offset * tangent, axis=-1)
    inward = -np.sum(offset * outward, axis=-1)
    ends = ((0, 0), (BLOCK_MARGIN, BLOCK_MARGIN))
    across = np.pad(across, ends, mode="edge")
    inward = np.pad(inward, ends, mode="edge")
    step = arc[1] - arc[0]
    beyond = step * np.arange(1, BLOCK_MARGIN + 1)
    arcs = np.concatenate([arc[0] - beyond[::-1], arc, arc[-1] + beyond])
    layers = layer * np.arange(-ERROR_REACH - 1, ERROR_REACH + 2)
    # The normal of the flank is inclined to the section by beta_b.
    lean = side * np.sin(gear.base_helix_angle)
    numbers = np.arange(across.size * len(layers)).reshape(*across.shape, len(layers))
    points = np.empty((*numbers.shape, 3))
    points[..., 0] = (arcs + across)[..., None] - shear * layers
    points[..., 1] = layers / cosine - lean * inward[..., None]
    points[..., 2] = cosine * inward[..., None]
    return points.reshape(-1, 3), numbers


def block_bricks(points: Floats, numbers: Integers) -> Integers:
    """Hexahedra of the block in VTK order."""
    square = ((0, 0), (1, 0), (1, 1), (0, 1))
    deep, along, layers = (count - 1 for count in numbers.shape)
    corners = [numbers[k : k + deep, i : i + along, j : j + layers].ravel() for k in (0, 1) for i, j in square]
    hexahedra = np.stack(corners, axis=-1)
    edges = points[hexahedra[0, [1, 3, 4]]] - points[hexahedra[0, 0]]
    if np.linalg.det(edges) > 0.0:
        return hexahedra
    return hexahedra[:, [0, 3, 2, 1, 4, 7, 6, 5]]


def unknowns_of(nodes: Integers) -> Integers:
    """Unknowns of nodes, three each, in their order."""
    return np.asarray((3 * nodes[:, None] + np.arange(3)).ravel())


def _tent_loads(count: int, surface: tuple[int, ...]) -> Floats:
    """Consistent nodal loads (profile, layers, count) of unit tent loads in the middle layer."""
    mass = np.zeros((count, count))
    for left in range(count - 1):
        mass[left : left + 2, left : left + 2] += np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
    loads = np.zeros((*surface, count))
    middle = surface[1] // 2
    for layer, share in ((middle - 1, 1.0 / 6.0), (middle, 4.0 / 6.0), (middle + 1, 1.0 / 6.0)):
        loads[BLOCK_MARGIN:-BLOCK_MARGIN, layer] = share * mass / mass.sum(axis=0)
    return loads


def _half_space(mesh: SectorMesh, side: int, places: Floats) -> Floats:
    """Displacement (n, 3, f) of a half-space under the tent loads at positions away from them, m/N."""
    arc, layer, shear, cosine = flank_spacing(mesh, side)
    material = mesh.gear.material
    gauss, weight = np.polynomial.legendre.leggauss(3)
    step = arc[1] - arc[0]
    within = (gauss + 1.0) / 2.0
    parts = max(2, int(np.ceil(layer / step)))  # about as fine along the layer as along the profile
    along = ((np.arange(parts)[:, None] + within) / parts).ravel()
    z = layer * np.concatenate([-along, along])
    height = np.tile(np.tile(weight, parts) * (1.0 - along), 2)
    # Loads by interval of the profile, point in it, and point along the layers; each contributes to two tents.
    shape = (len(arc) - 1, len(within), len(z))
    interval = np.repeat(np.arange(shape[0]), shape[1] * shape[2])
    s, at = (np.broadcast_to(part, shape).ravel() for part in (within[:, None], z))
    strength = np.broadcast_to(weight[:, None] * height, shape).ravel()
    shares = np.stack([(1.0 - s) * strength, s * strength], axis=-1)
    loads = np.stack([arc[interval] + s * step - shear * at, at / cosine], axis=-1)
    moved = interior_displacement(places, loads, interval, shares, len(arc), material.poissons_ratio)
    total = np.bincount(interval, shares[:, 0], len(arc)) + np.bincount(interval + 1, shares[:, 1], len(arc))
    return np.asarray(moved / total * (1.0 + material.poissons_ratio) / (2.0 * np.pi * material.youngs_modulus))


def _surface_displacement(mesh: SectorMesh, side: int) -> Floats:
    """Surface displacement of a half-space at the flank nodes, by node, layer and load as in `brick_error`, m/N."""
    arc, layer, shear, cosine = flank_spacing(mesh, side)
    material = mesh.gear.material
    layers = layer * np.arange(-ERROR_REACH - 1.0, ERROR_REACH + 2.0, dtype=np.float64)
    # On a cylinder of very large radius the roll angles represent arc lengths.
    radius = _FLAT * float(np.ptp(arc))
    integrals = tent_integrals(1.0 + arc / radius, layers, radius, shear / radius, cosine, np.zeros((2, 0, 3)))
    shape = (len(arc), len(layers)) * 2
    read = integrals.reshape(shape)[:, 1:-1, :, len(layers) // 2]
    return np.asarray(read * (1.0 - material.poissons_ratio**2) / (np.pi * material.youngs_modulus))


#: Number of wave numbers, and of nodes along the profile over which errors are evaluated.
WAVES = 8

#: Layers next to an end whose loads are corrected, and layers of nodes of the bricks.
END_LAYERS = 5
_LAYERS = 8

#: Additional rows of bricks below those of the flat block, with depths that grow by a factor, down to zero
# displacement.
_DEEPER = 6
_GROWTH = 1.5

#: Points of the integrals over a layer, and number of aliased wave numbers on either side.
_POINTS = 12
_ALIASES = 5


def end_errors(mesh: SectorMesh, side: int, images: Floats, incompatible_modes: bool = True) -> tuple[Floats, Floats]:
    """Additional error of the bricks in the displacement of the flank nodes near the end faces.

    Parameters
    ----------
    mesh : with layers of one thickness
    side : loaded flank: +1 counter-clockwise, -1 clockwise
    images : (2, n, 3) image loads behind the lower and the upper end
    incompatible_modes : see `stiffness_matrix`

    Returns
    -------
    lower, upper : (2 w - 1, r, l)
        Error minus that inside the face width, m/N, by distance in nodes along the profile from the load, -w + 1 to
        w - 1 with w = `WAVES`; by displaced layer and loaded layer, `END_LAYERS` each, counted from the end.
    """
    loaded = np.arange(END_LAYERS)
    middle = END_LAYERS
    inside = _Row(mesh, side, 1, 2 * END_LAYERS + 1, incompatible_modes)
    known = inside.error(np.array([middle]), None)[..., 0]
    errors = []
    for end, of_end in zip((-1, 1), images, strict=True):
        error = _Row(mesh, side, end, _LAYERS, incompatible_modes).error(loaded, of_end)[:, :END_LAYERS]
        # The layers of the inner row run from the upper end downwards.
        error -= known[:, middle + end * (loaded[:, None] - loaded)]
        # From wave numbers to the distance in nodes from the load.
        away = np.arange(1 - WAVES, WAVES)
        waves = np.exp(1j * _wave_numbers()[:, None] * away) / WAVES
        errors.append(np.asarray(np.einsum("krl,kj->jrl", error, waves).real))
    return errors[0], errors[1]


def _wave_numbers() -> Floats:
    """Phases per node along the profile: offset from zero by half a step, because the far field is not needed."""
    return np.asarray((np.arange(WAVES) + 0.5) * np.pi / WAVES)


class _Row:
    """One row of bricks along the layers, as deep as the block, repeated along the profile."""

    def __init__(self, mesh: SectorMesh, side: int, end: int, layers: int, incompatible_modes: bool) -> None:
        self._mesh, self._end, self._layers = mesh, end, layers
        arc, self._layer, self._shear, self._cosine = flank_spacing(mesh, side)
        self._step = float(arc[1] - arc[0])
        points, numbers = flat_block(mesh, side)
        block = points.reshape(*numbers.shape, 3)[:, BLOCK_MARGIN + len(arc) // 2]
        behind = block[:, block.shape[1] // 2]
        across = block[0, 1] - block[0, 0]
        deeper = np.cumsum(_GROWTH ** np.arange(1, _DEEPER + 1))[:, None] * (behind[-1] - behind[-2])
        behind = np.concatenate([behind, behind[-1] + deeper])
        near = behind[:, None] - end * np.arange(layers)[:, None] * across
        places = np.stack([near, near + [self._step, 0.0, 0.0]], axis=1).reshape(-1, 3)
        nodes = np.arange(len(places)).reshape(len(behind), 2, layers)
        matrix = stiffness_matrix(places, block_bricks(places, nodes), mesh.gear.material, incompatible_modes)
        first, second = (unknowns_of(nodes[:, x].ravel()) for x in (0, 1))
        self._own = (matrix[first][:, first] + matrix[second][:, second]).toarray()
        self._next = matrix[first][:, second].toarray()
        self._nodes = np.arange(len(behind) * layers).reshape(len(behind), layers)

    def error(self, loaded: Integers, images: Floats | None) -> Floats:
        """Transform (w, layers, loads) of the error; without images the row has no free end and is fixed there."""
        return np.asarray(self._bricks(loaded, images is not None) - self._truth(loaded, images))

    def _bricks(self, loaded: Integers, ends: bool) -> Floats:
        held = np.zeros(self._nodes.shape, dtype=bool)
        held[-1] = held[:, -1] = True
        held[:, 0] |= not ends
        free = unknowns_of(self._nodes[~held])
        mass = np.zeros((self._layers, self._layers))
        for left in range(self._layers - 1):
            mass[left : left + 2, left : left + 2] += np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
        normal = 3 * self._nodes[0] + 2
        loads = np.zeros((self._nodes.size * 3, len(loaded)))
        loads[normal] = (mass / mass.sum(axis=0))[:, loaded]
        own, following = (part[np.ix_(free, free)] for part in (self._own, self._next))
        moved = np.zeros((WAVES, len(loads), len(loaded)), dtype=complex)
        for wave, phase in enumerate(_wave_numbers()):
            across = following * np.exp(1j * phase)
            tent = (2.0 + np.cos(phase)) / 3.0
            moved[wave, free] = np.linalg.solve(own + across + across.conj().T, tent * loads[free])
        return moved[:, normal]

    def _truth(self, loaded: Integers, images: Floats | None) -> Floats:
        material = self._mesh.gear.material
        places, shares = np.polynomial.legendre.leggauss(_POINTS)
        # The substitution concentrates points at both ends, where the field of a layer's own load is logarithmic.
        s = (places + 1.0) / 2.0
        within = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
        shares = 15.0 * shares * (s * (1.0 - s)) ** 2
        aliases = _wave_numbers()[:, None] + 2.0 * np.pi * np.arange(-_ALIASES, _ALIASES + 1)
        wave = (aliases / self._step)[:, :, None, None]
        tent = np.sinc(aliases / (2.0 * np.pi)) ** 2 / self._step
        read = self._layer * np.arange(self._layers)[:, None]
        found = np.zeros((WAVES, self._layers, len(loaded)), dtype=complex)
        for column, layer in enumerate(loaded.tolist()):
            total = 1.0 if layer else 0.5  # integral of the tent over layers, 1/2 for each of its halves
            for below, part in ((layer - 1, within), (layer, 1.0 - within)):
                if below < 0:
                    continue
                place = self._layer * (below + within)
                field = 2.0 * k0(np.abs(wave) * np.abs(read - place) / self._cosine)
                for strength, squares, product in () if images is None else images.tolist():
                    apart = np.sqrt(squares * (read**2 + place**2) + product * read * place) / self._cosine
                    field += strength * 2.0 * k0(np.abs(wave) * apart)
                field = field * np.exp(1j * wave * self._end * self._shear * (read - place))
                found[..., column] += np.einsum("km,kmrz,z->kr", tent, field, part * shares)
            found[..., column] /= total
        return found * ((1.0 - material.poissons_ratio**2) / (np.pi * material.youngs_modulus))
