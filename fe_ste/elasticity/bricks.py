"""Trilinear bricks with incompatible modes: gradients, stiffness of single elements and of whole meshes.

Eight nodes, eight Gauss points. The three incompatible modes 1 - xi^2 of each element let it bend without shear.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse
import skfem

from fe_ste.geometry.gears import Material
from fe_ste.tools.arrays import Floats, Integers

_VTK_TO_SKFEM = [6, 2, 5, 7, 1, 3, 4, 0]


def skfem_mesh(points: Floats, hexahedra: Integers) -> skfem.MeshHex:
    """Return the scikit-fem mesh of hexahedra given in VTK order."""
    return skfem.MeshHex(np.ascontiguousarray(points.T), np.ascontiguousarray(hexahedra[:, _VTK_TO_SKFEM].T))


def stiffness_matrix(
    points: Floats, hexahedra: Integers, material: Material, incompatible_modes: bool = True
) -> scipy.sparse.csr_matrix:
    """Assemble the stiffness matrix of 8-node hexahedra with Wilson-Taylor incompatible modes.

    The plain trilinear brick is too stiff in bending. Three quadratic modes per direction, internal to each
    element and condensed there, cure it; their gradients are taken with the Jacobian of the element's middle so
    that the element passes the patch test on any shape.

    Parameters
    ----------
    points : (n, 3) nodes, m
    hexahedra : (m, 8) connectivity in VTK order
    incompatible_modes : False gives the plain brick, for comparison

    Returns
    -------
    (3 n, 3 n) stiffness, N/m; unknown ``3 node + direction``

    Raises
    ------
    ValueError
        If an element has a Gauss point with no positive volume.

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
    """Stiffness of single elements; parameters, errors and source as `stiffness_matrix`.

    Returns
    -------
    nodes : (m, 8) nodes of each element in the order of its matrix
    stiffness : (m, 24, 24) N/m; unknown ``3 place of the node + direction``
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
    volumes : (m, 8) of the Gauss points, m^3

    Raises
    ------
    ValueError
        If an element has a Gauss point with no positive volume.
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
    """Return the brick's eight shape functions at its Gauss points, (function, point), ordered as `brick_gradients`."""
    element = skfem.ElementHex1()
    points, _ = skfem.quadrature.get_quadrature(element, 3)
    return np.stack([element.lbasis(points, number)[0] for number in range(8)])


def _incompatible_gradients(basis: skfem.CellBasis, determinant: Floats) -> Floats:
    """Gradients (3, 3, elements, Gauss points) of 1 - xi^2 in each direction, with the Jacobian of the middle."""
    # Taylor, Beresford and Wilson: Jacobian and determinant of the middle make the mean gradient vanish, so that the
    # modes do no work on a constant stress and the patch test is passed.
    middle = np.full((3, 1), 0.5)
    inverse = basis.mapping.invDF(middle)[..., 0]
    ratio = basis.mapping.detDF(middle) / determinant
    # Mode 1 - (2 X - 1)^2 over X from 0 to 1, whose derivative this is.
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
    """Eliminate the nine unknowns of the modes, which no load and no neighbour touches (static condensation)."""
    coupling = stiffness[:, 24:, :24]
    return np.asarray(
        stiffness[:, :24, :24] - coupling.transpose(0, 2, 1) @ np.linalg.solve(stiffness[:, 24:, 24:], coupling)
    )
