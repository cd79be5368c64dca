"""Joining sectors: against a ring meshed as a whole, the Fourier transform over the teeth, and a meshed open sector."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse

from fe_ste.elasticity.bricks import stiffness_matrix
from fe_ste.elasticity.condensation import (
    Chain,
    chain_of,
    flank_functionals,
    open_chain_faces,
    ring_faces,
    uniform_faces,
)
from fe_ste.elasticity.flank import FlankCompliance, flank_compliance, flank_images, flank_near_field, regular_part
from fe_ste.elasticity.halfspace import tent_weights
from fe_ste.elasticity.hexmesh import MeshSettings, SectorMesh, sector_mesh
from fe_ste.elimination import factorise

from ..cases.gears import HELICAL_12

COARSE = MeshSettings(layers=3, flank=6, thickness=4, fillet=1, root=1, rim=3)


def rotation(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])


def meshed_compliance(mesh: SectorMesh, sectors: int, closed: bool) -> dict[tuple[int, int], np.ndarray]:
    """Flank compliance of `sectors` turned copies of the sector with merged nodes, solved as one body.

    Nothing is condensed: one stiffness matrix of all hexahedra. Result by (tooth read, tooth loaded).
    """
    count = len(mesh.points)
    pitch = mesh.gear.angular_pitch
    copies = np.concatenate([mesh.points @ rotation(k * pitch).T for k in range(sectors)])
    merged = np.arange(sectors * count)
    plus = np.concatenate([mesh.cut_nodes(1), _held_on_cut(mesh, 1)])
    minus = np.concatenate([mesh.cut_nodes(-1), _held_on_cut(mesh, -1)])
    for sector in range(sectors if closed else sectors - 1):
        after = (sector + 1) % sectors
        assert np.abs(copies[sector * count + plus] - copies[after * count + minus]).max() < 1e-12
        merged[sector * count + plus] = after * count + minus
    nodes, number = np.unique(merged, return_inverse=True)
    cells = np.concatenate([number[mesh.hexahedra + sector * count] for sector in range(sectors)])
    stiffness = stiffness_matrix(copies[nodes], cells, mesh.gear.material)

    held = np.unique(np.concatenate([number[mesh.held_nodes + sector * count] for sector in range(sectors)]))
    free = np.setdiff1d(np.arange(stiffness.shape[0]), (3 * held[:, None] + np.arange(3)).ravel())
    surface = flank_functionals(mesh, 1)
    loads = []
    for sector in range(sectors):
        turn = scipy.sparse.kron(scipy.sparse.identity(count), rotation(sector * pitch)).tocsr()
        unknowns = (3 * number[np.arange(count) + sector * count][:, None] + np.arange(3)).ravel()
        place = scipy.sparse.csr_matrix(
            (np.ones(3 * count), (unknowns, np.arange(3 * count))), shape=(stiffness.shape[0], 3 * count)
        )
        loads.append((place @ turn @ surface)[free])
    with factorise(stiffness[free][:, free]) as factor:
        moved = factor.solve(scipy.sparse.hstack(loads).tocsc())
    return _as_stored(mesh, scipy.sparse.hstack(loads).T @ moved, sectors)


def _as_stored(mesh: SectorMesh, on_surface: np.ndarray, sectors: int) -> dict[tuple[int, int], np.ndarray]:
    """Blocks by tooth; the loaded tooth's own under tent loads, without the near field."""
    weights = tent_weights(mesh.section.flank_roll, mesh.axial_positions)
    size = len(weights)
    near = flank_near_field(mesh, 1, flank_images(mesh.gear, 1))
    result = {}
    for read in range(sectors):
        for loaded in range(sectors):
            block = np.s_[read * size : (read + 1) * size, loaded * size : (loaded + 1) * size]
            result[read, loaded] = on_surface[block]  # displacement into the flank under loads into it
            if read == loaded:
                result[read, loaded] = regular_part(mesh, on_surface[block] @ weights, near)
    return result


def _held_on_cut(mesh: SectorMesh, side: int) -> np.ndarray:
    section = mesh.section
    cut = section.plus_cut if side > 0 else section.minus_cut
    layers = np.arange(len(mesh.axial_positions)) * len(section.points)
    return np.asarray((layers[:, None] + cut[np.isin(cut, section.held)]).ravel())


@pytest.fixture(scope="module")
def mesh() -> SectorMesh:
    return sector_mesh(HELICAL_12, COARSE)


@pytest.fixture(scope="module")
def closed() -> FlankCompliance:
    return flank_compliance(HELICAL_12, 1, COARSE)


def random_sector(loads: int, seed: int = 0) -> tuple[Chain, Chain, np.ndarray, np.ndarray, np.ndarray]:
    """Positive definite halves of a sector with loads on them and signs; both faces, and the loads alone on them."""
    random = np.random.default_rng(seed)
    signs = np.array([1.0, 1.0, 1.0, -1.0, -1.0])
    roots = random.normal(size=(2, 5, 5))
    sector = Chain(*(root @ root.T + 0.5 * np.eye(5) for root in roots))
    load = Chain(*random.normal(size=(2, 5, loads)))
    minus, plus = signs[:, None] * (load.even - load.odd) / 2, (load.even + load.odd) / 2
    return sector, load, signs, sector.whole(signs), np.concatenate([minus, plus])


def joined(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Both faces of two chains, the face between them condensed."""
    half = len(first) // 2
    both = np.zeros((3 * half, 3 * half))
    both[: 2 * half, : 2 * half] += first
    both[half:, half:] += second
    ends, middle = np.r_[:half, 2 * half : 3 * half], np.s_[half : 2 * half]
    return both[np.ix_(ends, ends)] - both[ends, middle] @ np.linalg.solve(both[middle, middle], both[middle, ends])


def assembled_ring(sector: np.ndarray, load: np.ndarray, teeth: int) -> np.ndarray:
    """Faces (teeth, m, k) of the ring assembled as one dense matrix, sector 0 loaded."""
    half = len(sector) // 2
    matrix, right = np.zeros((teeth * half, teeth * half)), np.zeros((teeth * half, load.shape[1]))
    for number in range(teeth):
        both = (np.arange(2 * half) + number * half) % (teeth * half)
        matrix[np.ix_(both, both)] += sector
        if number == 0:
            right[both] += load
    return np.linalg.solve(matrix, right).reshape(teeth, half, -1)


def test_ring_closure_equals_the_ring_meshed_as_a_whole(mesh: SectorMesh, closed: FlankCompliance) -> None:
    whole = meshed_compliance(mesh, HELICAL_12.teeth, closed=True)
    scale = np.abs(closed.between(0, 0)).max()
    for offset in range(-4, 5):
        reference = whole[offset % HELICAL_12.teeth, 0]
        # 1e-10: two eliminations of the same 7000 equations in different orders.
        assert np.abs(closed.between(offset, 0) - reference).max() < 1e-10 * scale
    # Any tooth may be the loaded one.
    assert np.abs(closed.between(1, 0) - whole[6, 5]).max() < 1e-10 * scale


def test_open_sector_equals_the_open_sector_meshed_as_a_whole(mesh: SectorMesh) -> None:
    teeth = 5
    flank = flank_compliance(HELICAL_12, 1, COARSE, open_teeth=teeth)
    whole = meshed_compliance(mesh, teeth, closed=False)
    scale = np.abs(flank.between(0, 0)).max()
    for read in range(-2, 3):
        for loaded in range(-2, 3):
            difference = flank.between(read, loaded) - whole[read + 2, loaded + 2]
            assert np.abs(difference).max() < 1e-10 * scale


@pytest.mark.parametrize("teeth", [5, 6, 12, 17])
def test_ring_of_random_sectors_equals_the_assembled_ring(teeth: int) -> None:
    sector, load, signs, whole, forces = random_sector(3)
    reference = assembled_ring(whole, forces, teeth)
    reach = min(4, (teeth - 2) // 2)
    faces = ring_faces(sector, load, signs, teeth, reach)
    assert sorted(faces) == list(range(-reach, reach + 2))
    for number, face in faces.items():
        assert np.abs(face - reference[number % teeth]).max() < 1e-12 * np.abs(reference).max()


def test_ring_equals_the_fourier_transform_over_the_teeth() -> None:
    """Harmonic h of the faces: (S_mm + S_pp + S_mp e^iw + S_pm e^-iw) v_h = l_m + l_p e^-iw, w = 2 pi h / z."""
    halves, loads, signs, sector, load = random_sector(4, seed=1)
    teeth, half = 21, 5
    harmonics = []
    for order in range(teeth):
        phase = np.exp(2j * np.pi * order / teeth)
        matrix = sector[:half, :half] + sector[half:, half:]
        matrix = matrix + sector[:half, half:] * phase + sector[half:, :half] / phase
        harmonics.append(np.linalg.solve(matrix, load[:half] + load[half:] / phase))
    transform = np.fft.ifft(np.array(harmonics), axis=0)
    assert np.abs(transform.imag).max() < 1e-12
    for number, face in ring_faces(halves, loads, signs, teeth, 4).items():
        assert np.abs(face - transform.real[number % teeth]).max() < 1e-12 * np.abs(transform).max()
    assert uniform_faces(halves, loads, signs) == pytest.approx(harmonics[0].real, rel=1e-10, abs=1e-12)


def test_doubling_equals_joining_one_after_another() -> None:
    halves, _, signs, sector, _ = random_sector(1, seed=2)
    one_by_one = sector
    for count in range(2, 12):
        one_by_one = joined(one_by_one, sector)
        whole = chain_of(halves, count, signs).whole(signs)
        assert np.abs(whole - one_by_one).max() < 1e-12 * np.abs(sector).max()


def test_open_chain_solves_the_assembled_equations() -> None:
    _, _, _, sector, load = random_sector(2, seed=4)
    teeth, half = 5, 5
    matrix = np.zeros(((teeth + 1) * half, (teeth + 1) * half))
    for number in range(teeth):
        both = slice(number * half, (number + 2) * half)
        matrix[both, both] += sector
    for loaded, faces in enumerate(open_chain_faces(sector, load, teeth)):
        right = matrix @ np.concatenate(faces)
        expected = np.zeros_like(right)
        expected[loaded * half : (loaded + 2) * half] = load
        assert np.abs(right - expected).max() < 1e-11 * np.abs(load).max()


def test_open_sector_tends_to_the_ring_from_the_soft_side(closed: FlankCompliance) -> None:
    """Free cut faces take support away: 3, 7 and 11 of 12 teeth come closer and closer to the ring."""
    middle = [flank_compliance(HELICAL_12, 1, COARSE, open_teeth=teeth).between(0, 0).mean() for teeth in (3, 7, 11)]
    ring = closed.between(0, 0).mean()
    assert middle[0] > middle[1] > middle[2] >= ring * (1 - 1e-12)
