"""The hexahedron with incompatible modes, and the compliance of flanks made of it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import scipy.sparse.linalg
import skfem
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

from fe_ste.elasticity.bricks import skfem_mesh, stiffness_matrix
from fe_ste.elasticity.condensation import flank_normals
from fe_ste.elasticity.flank import FlankCompliance, flank_compliance
from fe_ste.elasticity.halfspace import tent_weights
from fe_ste.elasticity.hexmesh import MeshSettings, sector_mesh
from fe_ste.geometry.gears import Gear, Material

from ..cases.gears import HELICAL_20, RING_60, SPUR_20

STEEL = Material()
COARSE = MeshSettings(layers=4, flank=8, thickness=6, fillet=2, root=2, rim=5)


def brick(counts: tuple[int, int, int], sizes: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and VTK hexahedra of a block of `counts` bricks."""
    axes = [np.linspace(0, size, count + 1) for size, count in zip(sizes, counts, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    ids = np.arange(len(points)).reshape([count + 1 for count in counts])
    near, far = ids[:-1, :, :], ids[1:, :, :]
    corners = [near[:, :-1], far[:, :-1], far[:, 1:], near[:, 1:]]
    bottom, top = [c[:, :, :-1] for c in corners], [c[:, :, 1:] for c in corners]
    return points, np.stack([*bottom, *top], axis=-1).reshape(-1, 8)


def distorted(seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    points, cells = brick((3, 3, 3), (1.0, 1.0, 1.0))
    inner = ((points > 1e-9) & (points < 1 - 1e-9)).all(axis=1)
    points[inner] += np.random.default_rng(seed).uniform(-0.1, 0.1, (inner.sum(), 3))
    return points, cells


def flank_of(gear: Gear) -> FlankCompliance:
    return flank_compliance(gear, -1 if gear.internal else 1, COARSE)


@pytest.fixture(scope="module", params=[SPUR_20, HELICAL_20, RING_60], ids=lambda gear: gear.name)
def flank(request: pytest.FixtureRequest) -> FlankCompliance:
    return flank_of(request.param)


@pytest.mark.parametrize("incompatible_modes", [True, False])
def test_patch_test_on_distorted_hexahedra(incompatible_modes: bool) -> None:
    """A linear displacement prescribed on the boundary is the solution inside, and its stress is uniform."""
    points, cells = distorted()
    stiffness = stiffness_matrix(points, cells, STEEL, incompatible_modes)
    gradient = 1e-3 * np.array([[1.0, 0.4, -0.2], [0.3, -0.5, 0.6], [0.1, 0.7, 0.8]])
    exact = (points @ gradient.T).ravel()
    outside = ((points < 1e-9) | (points > 1 - 1e-9)).any(axis=1)
    fixed = np.repeat(outside, 3)
    solution = exact.copy()
    solution[~fixed] = scipy.sparse.linalg.spsolve(
        stiffness[~fixed][:, ~fixed].tocsc(), -stiffness[~fixed][:, fixed] @ exact[fixed]
    )
    # Direct solution of 24 unknowns: rounding only.
    assert np.abs(solution - exact).max() < 1e-12 * np.abs(exact).max()

    strain = (gradient + gradient.T) / 2
    lame, shear = (float(value) for value in _lame(STEEL))
    stress = lame * np.trace(strain) * np.eye(3) + 2 * shear * strain
    energy = exact @ (stiffness @ exact)
    assert energy == pytest.approx(float(np.sum(stress * strain)), rel=1e-12)


@pytest.mark.parametrize("incompatible_modes", [True, False])
def test_rigid_motions_cost_no_energy(incompatible_modes: bool) -> None:
    mesh = sector_mesh(HELICAL_20, COARSE)
    stiffness = stiffness_matrix(mesh.points, mesh.hexahedra, STEEL, incompatible_modes)
    centred = mesh.points - mesh.points.mean(axis=0)
    size = np.abs(centred).max()
    motions = [np.tile(axis, len(centred)) for axis in np.eye(3)]
    motions += [np.cross(axis, centred / size).ravel() for axis in np.eye(3)]
    scale = abs(stiffness).max()
    for motion in motions:
        assert np.abs(stiffness @ motion).max() < 1e-10 * scale
        assert abs(motion @ (stiffness @ motion)) < 1e-10 * scale


def test_stiffness_is_symmetric_and_has_six_motions_only() -> None:
    points, cells = distorted()
    dense = stiffness_matrix(points, cells, STEEL).toarray()
    assert np.abs(dense - dense.T).max() < 1e-12 * np.abs(dense).max()
    values = np.linalg.eigvalsh(dense)
    assert (np.abs(values[:6]) < 1e-10 * values[-1]).all()
    assert values[6] > 1e-4 * values[-1]


def test_plain_brick_equals_the_elasticity_model_of_scikit_fem() -> None:
    mesh = sector_mesh(HELICAL_20, COARSE)
    own = stiffness_matrix(mesh.points, mesh.hexahedra, STEEL, incompatible_modes=False)
    element = skfem.ElementVector(skfem.ElementHex1())
    basis = skfem.Basis(skfem_mesh(mesh.points, mesh.hexahedra), element, intorder=3)
    reference = linear_elasticity(*lame_parameters(STEEL.youngs_modulus, STEEL.poissons_ratio)).assemble(basis)
    order = basis.nodal_dofs.T.ravel()
    difference = own - reference[order][:, order]
    assert abs(difference).max() < 1e-12 * abs(own).max()


def test_skfem_mesh_keeps_nodes_and_volume() -> None:
    points, cells = distorted()
    basis = skfem.Basis(skfem_mesh(points, cells), skfem.ElementHex1(), intorder=3)

    @skfem.LinearForm
    def one(v: np.ndarray, w: skfem.FormExtraParams) -> np.ndarray:
        return dot(np.ones_like(w.x), np.ones_like(w.x)) / 3 * v

    assert one.assemble(basis).sum() == pytest.approx(1.0, rel=1e-12)


def _tip_deflection(layers: int, incompatible_modes: bool) -> float:
    """Slender cantilever of `layers` bricks along its length, one across, per Euler-Bernoulli deflection."""
    length, height, width, force = 1.0, 0.05, 0.05, 1e3
    points, cells = brick((layers, 1, 1), (length, height, width))
    # Poisson's ratio 0: Euler and Bernoulli's beam has no cross effects.
    material = Material(youngs_modulus=206e9, poissons_ratio=0.0)
    stiffness = stiffness_matrix(points, cells, material, incompatible_modes)
    end = points[:, 0] > length - 1e-9
    load = np.zeros((len(points), 3))
    load[end, 1] = force / end.sum()
    free = np.repeat(points[:, 0] > 1e-9, 3)
    moved = np.zeros(points.size)
    moved[free] = scipy.sparse.linalg.spsolve(stiffness[free][:, free].tocsc(), load.ravel()[free])
    inertia = width * height**3 / 12
    return float(moved.reshape(-1, 3)[end, 1].mean() * 3 * 206e9 * inertia / (force * length**3))


def test_few_plain_bricks_lock_in_bending_and_incompatible_modes_do_not() -> None:
    """Eight bricks, 2.5 times as long as high, one across the height."""
    # Exact for linear moments but for the curvature's step per brick: 1 - 1/(4 n^2) = 0.996, plus 0.0025 of shear.
    assert _tip_deflection(8, incompatible_modes=True) == pytest.approx(1.0, abs=0.005)
    # In bending a plain brick of length a and height h is stiffer by 1 + (a/h)^2 / 2 for zero Poisson's ratio: 4.1.
    assert _tip_deflection(8, incompatible_modes=False) == pytest.approx(1 / 4.125, rel=0.02)


def test_flank_normals_are_unit_and_perpendicular_to_the_flank() -> None:
    for gear, side in ((HELICAL_20, 1), (HELICAL_20, -1), (RING_60, 1), (RING_60, -1)):
        mesh = sector_mesh(gear, MeshSettings(layers=200, flank=100, thickness=2, fillet=1, root=1, rim=2))
        nodes = mesh.points[mesh.flank_nodes(side)]
        normals = flank_normals(mesh, side)
        assert np.abs(np.linalg.norm(normals, axis=-1) - 1).max() < 1e-12
        for axis in (0, 1):
            tangent = (np.roll(nodes, -1, axis) - np.roll(nodes, 1, axis))[1:-1, 1:-1]
            tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
            # Central differences over 1/50 of the flank.
            assert np.abs(np.sum(tangent * normals[1:-1, 1:-1], axis=-1)).max() < 2e-4
        # Out of the material: the tooth is on the other side of its flank than the neighbouring tooth space.
        outward = np.cross([0, 0, 1.0], nodes)[..., :2] * side
        assert (np.sum(outward * normals[..., :2], axis=-1) > 0).all()


@pytest.mark.parametrize("teeth", [0, 2, 21])
def test_open_sectors_of_impossible_tooth_numbers_are_refused(teeth: int) -> None:
    with pytest.raises(ValueError, match="open_teeth"):
        flank_compliance(SPUR_20, 1, COARSE, open_teeth=teeth)


def test_unit_flank_loads_turn_the_hub_with_the_base_lever_arm(flank: FlankCompliance) -> None:
    """Each nodal normal load meets the held surface as the torque r_b cos(beta_b), whatever its place."""
    lever = flank.gear.base_radius * np.cos(flank.gear.base_helix_angle)
    # Loads into a counter-clockwise flank turn the gear clockwise; the reaction of the hub is the other way.
    assert np.abs(flank.hub_torque - flank.side * lever).max() < 1e-10 * lever


def test_compliance_is_symmetric_and_reciprocal(flank: FlankCompliance) -> None:
    """Betti: tooth k under loads on tooth 0 moves as tooth 0 under loads on tooth k."""
    scale = np.abs(flank.regular[0, 0]).max()
    assert np.abs(flank.regular[0, 0] - flank.regular[0, 0].T).max() < 1e-14 * scale
    for offset in range(1, 5):
        ahead, behind = flank.between(offset, 0), flank.between(-offset, 0)
        assert np.abs(ahead - behind.T).max() < 1e-10 * scale


def test_neighbouring_teeth_yield_less_with_distance(flank: FlankCompliance) -> None:
    middle = [np.abs(flank.between(offset, 0)).mean() for offset in range(5)]
    assert middle[1] > middle[2] > middle[3]


def test_teeth_further_apart_than_computed_are_refused(flank: FlankCompliance) -> None:
    with pytest.raises(ValueError, match="between teeth 6 and 0"):
        flank.between(6, 0)


def test_mirrored_hand_has_the_mirrored_compliance() -> None:
    """z -> -z turns a left-hand tooth into a right-hand one: same flank, layers in reverse."""
    one, other = flank_of(HELICAL_20), flank_of(HELICAL_20.mirrored())
    shape = (len(one.roll), len(one.axial)) * 2
    for offset in (-1, 0, 2):
        mirrored = other.between(offset, 0).reshape(shape)[:, ::-1, :, ::-1]
        difference = np.abs(one.between(offset, 0).reshape(shape) - mirrored).max()
        assert difference < 1e-9 * np.abs(one.between(0, 0)).max()


def test_other_flank_has_the_mirrored_compliance() -> None:
    """y -> -y turns the counter-clockwise flank into the clockwise flank of the other hand."""
    one, other = flank_compliance(HELICAL_20, 1, COARSE), flank_compliance(HELICAL_20.mirrored(), -1, COARSE)
    for offset in (-1, 0, 2):
        difference = np.abs(one.between(offset, 0) - other.between(-offset, 0)).max()
        assert difference < 1e-9 * np.abs(one.between(0, 0)).max()


def test_compliance_scales_with_size_and_modulus() -> None:
    """A gear twice as large of half the modulus is as compliant: m/N goes with 1 / (E length)."""
    large = dataclasses.replace(
        HELICAL_20,
        normal_module=2 * HELICAL_20.normal_module,
        face_width=2 * HELICAL_20.face_width,
        held_diameter=2 * HELICAL_20.held_diameter,
        material=Material(youngs_modulus=103e9),
    )
    one, other = flank_of(HELICAL_20), flank_of(large)
    assert np.abs(one.between(0, 0) - other.between(0, 0)).max() < 1e-9 * np.abs(one.between(0, 0)).max()


def test_tent_weights_spread_a_load_without_changing_it(flank: FlankCompliance) -> None:
    weights = tent_weights(flank.roll, flank.axial)
    assert np.abs(weights.sum(axis=0) - 1).max() < 1e-12
    assert (weights >= 0).all()


def _lame(material: Material) -> tuple[float, float]:
    lame, shear = lame_parameters(material.youngs_modulus, material.poissons_ratio)
    return float(lame), float(shear)
