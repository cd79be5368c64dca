"""Bricks under finite deformation: stress, forces, tangent, and their agreement with the linear element."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fe_ste.elasticity.bricks import stiffness_matrix
from fe_ste.geometry.gears import Material
from fe_ste.reference.finite_deformation import Bricks, BrickTangent, InvertedElementError, von_mises

STEEL = Material()
TURN = Rotation.from_rotvec([0.5, 1.0, -0.7]).as_matrix()


@pytest.fixture
def distorted(block) -> tuple[np.ndarray, np.ndarray]:
    points, hexahedra = block(np.arange(4.0), np.arange(3.0), np.arange(3.0))
    return points + 0.15 * np.random.default_rng(0).standard_normal(points.shape), hexahedra


def assembled(bricks: Bricks, tangent: BrickTangent) -> np.ndarray:
    matrix = np.zeros((bricks.points.size, bricks.points.size))
    for unknowns, stiffness in zip(bricks.unknowns, tangent.stiffness, strict=True):
        matrix[np.ix_(unknowns, unknowns)] += stiffness
    return matrix


def with_modes_at_rest(bricks: Bricks, displacement: np.ndarray) -> tuple[np.ndarray, BrickTangent]:
    """Modes in balance under given displacements, by Newton's method."""
    modes = bricks.modes_at_rest()
    for _ in range(20):
        tangent = bricks.evaluate(displacement, modes)
        modes = bricks.stepped_modes(modes, tangent.recovery, np.zeros_like(displacement), 1.0)
    return modes, bricks.evaluate(displacement, modes)


@pytest.mark.parametrize("finite", [False, True])
def test_tangent_at_rest_is_the_stiffness_matrix_of_the_production_element(distorted, finite):
    points, hexahedra = distorted
    bricks = Bricks.from_mesh(points, hexahedra, [STEEL], finite=finite)
    matrix = assembled(bricks, bricks.evaluate(np.zeros_like(points), bricks.modes_at_rest()))
    expected = stiffness_matrix(points, hexahedra, STEEL).toarray()
    # The same integrals, summed in another order.
    assert np.abs(matrix - expected).max() < 1e-13 * np.abs(expected).max()


def test_finite_rotation_of_a_stress_free_body_gives_no_stress(distorted):
    points, hexahedra = distorted
    bricks = Bricks.from_mesh(points, hexahedra, [STEEL])
    displacement = points @ TURN.T - points
    stress = bricks.nodal_stress(displacement, bricks.modes_at_rest())
    force = bricks.evaluate(displacement, bricks.modes_at_rest()).force
    # Rounding of strains of order one times Young's modulus; the linear element has stresses of its order.
    assert np.abs(stress).max() < 1e-14 * 100 * STEEL.youngs_modulus
    assert np.abs(force).max() < 1e-13 * STEEL.youngs_modulus
    linear = Bricks.from_mesh(points, hexahedra, [STEEL], finite=False)
    assert np.abs(linear.nodal_stress(displacement, linear.modes_at_rest())).max() > 0.1 * STEEL.youngs_modulus


def test_forces_turn_with_a_deformed_body(distorted):
    points, hexahedra = distorted
    bricks = Bricks.from_mesh(points, hexahedra, [STEEL])
    displacement = 0.05 * np.random.default_rng(1).standard_normal(points.shape)
    modes, tangent = with_modes_at_rest(bricks, displacement)
    turned = bricks.evaluate((points + displacement) @ TURN.T - points, modes @ TURN.T)
    assert np.allclose(turned.force, tangent.force @ TURN.T, rtol=0, atol=1e-12 * np.abs(tangent.force).max())


def test_tangent_is_the_derivative_of_the_forces(distorted):
    points, hexahedra = distorted
    bricks = Bricks.from_mesh(points, hexahedra, [STEEL])
    generator = np.random.default_rng(2)
    displacement, direction = 0.05 * generator.standard_normal((2, *points.shape))
    _, tangent = with_modes_at_rest(bricks, displacement)
    step = 1e-5
    ahead, behind = (with_modes_at_rest(bricks, displacement + sign * step * direction)[1].force for sign in (1, -1))
    difference = (ahead - behind).ravel() / (2 * step)
    predicted = assembled(bricks, tangent) @ direction.ravel()
    # Central differences: error of the square of the step.
    assert np.abs(predicted - difference).max() < 1e-8 * np.abs(predicted).max()


def test_uniform_stretch_gives_the_stress_of_saint_venant_and_kirchhoff(distorted):
    points, hexahedra = distorted
    bricks = Bricks.from_mesh(points, hexahedra, [STEEL])
    gradient = np.diag([0.2, -0.1, 0.05]) + np.array([[0, 0.1, 0], [0, 0, 0], [0, 0, 0]])
    displacement = points @ gradient.T
    modes, tangent = with_modes_at_rest(bricks, displacement)
    deformation = np.eye(3) + gradient
    strain = (deformation.T @ deformation - np.eye(3)) / 2
    ratio, modulus = STEEL.poissons_ratio, STEEL.youngs_modulus
    lame, shear = modulus * ratio / ((1 + ratio) * (1 - 2 * ratio)), modulus / (2 * (1 + ratio))
    kirchhoff = lame * np.trace(strain) * np.eye(3) + 2 * shear * strain
    cauchy = deformation @ kirchhoff @ deformation.T / np.linalg.det(deformation)
    stress = bricks.nodal_stress(displacement, modes)
    # The patch test at finite strain: exact on distorted bricks, the modes stay at rest.
    assert np.abs(stress - cauchy).max() < 1e-12 * np.abs(cauchy).max()
    inner = np.all((points > 0.5) & (points < [2.5, 1.5, 1.5]), axis=1)
    assert inner.any()
    assert np.abs(tangent.force[inner]).max() < 1e-12 * np.abs(tangent.force).max()


def test_thin_bricks_under_the_pressure_of_gears_do_not_buckle_within_themselves(block):
    # Bricks 40 times as long as thick under 0.5 % of compression: 8 times the strain (1/40)^2 at which bricks with
    # the whole Green strain lose a mode of their own.
    points, hexahedra = block(np.linspace(0, 4, 5), np.linspace(0, 4, 5), np.linspace(0, 160, 5))
    bricks = Bricks.from_mesh(points, hexahedra, [STEEL])
    _, tangent = with_modes_at_rest(bricks, points * np.array([-5e-3, 0.0, 0.0]))
    free = np.flatnonzero((points[:, 0] > 0) & (points[:, 0] < 4))
    unknowns = (3 * free[:, None] + np.arange(3)).ravel()
    assert np.linalg.eigvalsh(assembled(bricks, tangent)[np.ix_(unknowns, unknowns)]).min() > 0


def test_a_brick_turned_inside_out_is_named(distorted):
    points, hexahedra = distorted
    bricks = Bricks.from_mesh(points, hexahedra, [STEEL])
    displacement = np.zeros_like(points)
    displacement[hexahedra[5, :4]] = points[hexahedra[5, 4:]] - points[hexahedra[5, :4]] + [0, 0, 1.0]
    with pytest.raises(InvertedElementError, match=r"element \d+ is turned inside out"):
        bricks.evaluate(displacement, bricks.modes_at_rest())


def test_a_folded_mesh_is_refused(distorted):
    points, hexahedra = distorted
    with pytest.raises(ValueError, match="element 3 .*the mesh folds"):
        bad = hexahedra.copy()
        bad[3] = bad[3, [4, 5, 6, 7, 0, 1, 2, 3]]
        Bricks.from_mesh(points, bad, [STEEL])


def test_pure_shear_has_the_equivalent_stress_of_von_mises():
    shear = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert von_mises(shear + 5.0 * np.eye(3)) == pytest.approx(np.sqrt(3.0))
