"""What bricks err by under the loads on a flank: the part that comes from the size of those next to the load.

Near a load the elements cannot follow the field, and the displacement of the flank under a tent load departs from the
true one. The departure depends on the elements within two or three of their sizes only. So it is found on a flat
block: the bricks behind the flank, laid with their shapes on the surface of a half-space, where the truth is known.
The block's other faces move as the half-space does (Boussinesq); what its surface then moves too far is the error.

Frame of the block: x across the contact lines, y along them, z into the material.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse

from fe_ste.elasticity.bricks import stiffness_matrix
from fe_ste.elasticity.halfspace import interior_displacement, tent_integrals
from fe_ste.elasticity.hexmesh import SectorMesh
from fe_ste.tools.arrays import Floats, Integers, SparseMatrix

#: Layers on either side of a load at which its error is read, and elements from a load to the faces of the block.
ERROR_REACH = 3
BLOCK_MARGIN = 4

#: Part of the tooth's elements that the block is deep.
_DEPTH = 2.0 / 3.0

#: Radius of a flank that is as good as flat, in lengths of the flank.
_FLAT = 1e5


def brick_error(mesh: SectorMesh, side: int, incompatible_modes: bool = True) -> Floats:
    """Displacement of the flank nodes under tent loads by the bricks less the true one, on a half-space.

    Parameters
    ----------
    mesh : with layers of one thickness
    side : loaded flank: +1 counter-clockwise, -1 clockwise
    incompatible_modes : see `fe_ste.elasticity.bricks.stiffness_matrix`

    Returns
    -------
    (f, 2 r + 1, f)
        By flank node read, layers from the load to it, -r to r with r = `ERROR_REACH`, and flank node loaded, m/N.

    Raises
    ------
    ValueError
        If the layers differ in thickness.
    """
    steps = np.diff(mesh.axial_positions)
    if np.ptp(steps) > 1e-9 * steps.mean():
        raise ValueError(f"gear {mesh.gear.name}: layers from {steps.min():.3g} to {steps.max():.3g} m; must be equal")
    points, numbers = flat_block(mesh, side)
    hexahedra = block_bricks(points, numbers)
    stiffness = stiffness_matrix(points, hexahedra, mesh.gear.material, incompatible_modes)
    given = np.ones(numbers.shape, dtype=bool)
    given[:-1, 1:-1, 1:-1] = False
    # Node by node along the profile, so that the free ones couple in a narrow band.
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
    return everywhere[3 * read + 2] - _on_surface(mesh, side)


class FlankSpacing(NamedTuple):
    """Arc lengths (f,) of the flank nodes (m), thickness of a layer (m), shear of the layers, cos(beta_b)."""

    arc: Floats
    layer: float
    shear: float
    cosine: float


def _solved(matrix: SparseMatrix, right: Floats) -> Floats:
    """Solve a positive definite system whose matrix has a narrow band: a sparse solver takes longer to load."""
    entries = scipy.sparse.tril(matrix, format="coo")
    below = entries.row - entries.col
    band = np.zeros((below.max() + 1, len(right)))
    band[below, entries.col] = entries.data
    return np.asarray(scipy.linalg.solveh_banded(band, right, overwrite_ab=True, lower=True, check_finite=False))


def flank_spacing(mesh: SectorMesh, side: int) -> FlankSpacing:
    """Return how the nodes of a flank of equal layers lie on a plane."""
    gear = mesh.gear
    roll = mesh.section.flank_roll
    handed = side * (-1.0 if gear.internal else 1.0)
    shear = handed * np.tan(gear.base_helix_angle) * roll.mean()
    arc = gear.base_radius * roll**2 / 2.0
    layer = mesh.axial_positions[1] - mesh.axial_positions[0]
    return FlankSpacing(arc, float(layer), float(shear), float(np.cos(gear.base_helix_angle)))


def flat_block(mesh: SectorMesh, side: int) -> tuple[Floats, Integers]:
    """Return the nodes (n, 3) of the block and their numbers by depth, place along the profile and layer.

    Along the profile there are `BLOCK_MARGIN` nodes more on either side of the flank's.
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
    # In the section the normal of the flank leans by beta_b out of it.
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
    """Displacement (n, 3, f) of a half-space at places away from the loads, under the tent loads, m/N."""
    arc, layer, shear, cosine = flank_spacing(mesh, side)
    material = mesh.gear.material
    gauss, weight = np.polynomial.legendre.leggauss(3)
    step = arc[1] - arc[0]
    within = (gauss + 1.0) / 2.0
    parts = max(2, int(np.ceil(layer / step)))  # along the layer about as fine as along the profile
    along = ((np.arange(parts)[:, None] + within) / parts).ravel()
    z = layer * np.concatenate([-along, along])
    height = np.tile(np.tile(weight, parts) * (1.0 - along), 2)
    # Loads by interval of the profile, point in it, and point along the layers; each has a part in two tents.
    shape = (len(arc) - 1, len(within), len(z))
    interval = np.repeat(np.arange(shape[0]), shape[1] * shape[2])
    s, at = (np.broadcast_to(part, shape).ravel() for part in (within[:, None], z))
    strength = np.broadcast_to(weight[:, None] * height, shape).ravel()
    shares = np.stack([(1.0 - s) * strength, s * strength], axis=-1)
    loads = np.stack([arc[interval] + s * step - shear * at, at / cosine], axis=-1)
    moved = interior_displacement(places, loads, interval, shares, len(arc), material.poissons_ratio)
    total = np.bincount(interval, shares[:, 0], len(arc)) + np.bincount(interval + 1, shares[:, 1], len(arc))
    return np.asarray(moved / total * (1.0 + material.poissons_ratio) / (2.0 * np.pi * material.youngs_modulus))


def _on_surface(mesh: SectorMesh, side: int) -> Floats:
    """Surface displacement of a half-space at the flank nodes, by node, layer and load as in `brick_error`, m/N."""
    arc, layer, shear, cosine = flank_spacing(mesh, side)
    material = mesh.gear.material
    layers = layer * np.arange(-ERROR_REACH - 1.0, ERROR_REACH + 2.0, dtype=np.float64)
    # Flank coordinates of a cylinder so large that arc lengths are roll angles.
    radius = _FLAT * float(np.ptp(arc))
    integrals = tent_integrals(1.0 + arc / radius, layers, radius, shear / radius, cosine, np.zeros((2, 0, 3)))
    shape = (len(arc), len(layers)) * 2
    read = integrals.reshape(shape)[:, 1:-1, :, len(layers) // 2]
    return np.asarray(read * (1.0 - material.poissons_ratio**2) / (np.pi * material.youngs_modulus))
