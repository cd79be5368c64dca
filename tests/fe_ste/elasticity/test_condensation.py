"""Condensation of a tooth sector: against a sparse factorisation of the whole sector, and what it may be given."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import scipy.sparse

from fe_ste.elasticity.bricks import stiffness_matrix
from fe_ste.elasticity.condensation import CondensedSector, flank_functionals, open_chain_faces
from fe_ste.elasticity.hexmesh import MeshSettings, SectorMesh, sector_mesh
from fe_ste.elimination import factorise
from fe_ste.geometry.gears import Gear

from ..cases.gears import HELICAL_20, RING_60, SPUR_20

EVEN_NUMBERS = MeshSettings(layers=4, flank=8, thickness=6, fillet=2, root=2, rim=5)
ODD_NUMBERS = MeshSettings(layers=5, flank=7, thickness=5, fillet=1, root=1, rim=4)


def rotation(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])


def unknowns(nodes: np.ndarray) -> np.ndarray:
    return (3 * nodes[:, None] + np.arange(3)).ravel()


@dataclasses.dataclass(frozen=True)
class Reference:
    """A sector condensed by one sparse factorisation of all its inner unknowns.

    Faces by layer, node and direction, minus face first; the plus face in the frame of the next sector.
    """

    stiffness: np.ndarray
    load: np.ndarray
    fixed: np.ndarray
    by_face: np.ndarray
    fixed_torque: np.ndarray
    face_torque: np.ndarray

    @classmethod
    def of(cls, mesh: SectorMesh, side: int, incompatible_modes: bool) -> Reference:
        stiffness = stiffness_matrix(mesh.points, mesh.hexahedra, mesh.gear.material, incompatible_modes)
        nodes = len(mesh.cut_nodes(1))
        frames = np.kron(np.eye(nodes), rotation(mesh.gear.angular_pitch))
        turn = scipy.sparse.block_diag([scipy.sparse.identity(3 * nodes), frames], format="csc")
        faces = np.concatenate([unknowns(mesh.cut_nodes(-1)), unknowns(mesh.cut_nodes(1))])
        held = unknowns(mesh.held_nodes)
        inside = np.setdiff1d(np.arange(stiffness.shape[0]), np.concatenate([faces, held]))
        to_faces = (stiffness[:, faces] @ turn).tocsr()
        x, y, _ = mesh.points.T
        about_axis = np.stack([-y, x, np.zeros_like(x)], axis=-1).ravel()
        held_torque = stiffness[held].T @ about_axis[held]
        surface = flank_functionals(mesh, side)
        columns = [to_faces[inside], -surface[inside], scipy.sparse.csr_matrix(held_torque[inside]).T]
        everything = scipy.sparse.hstack(columns).tocsc()
        with factorise(stiffness[inside][:, inside]) as factor:
            response = everything.T @ factor.solve(everything)
        ends = np.cumsum([columns[0].shape[1], surface.shape[1]])
        face, load = (slice(*part) for part in zip([0, *ends[:-1]], ends, strict=True))
        return cls(
            stiffness=(turn.T @ to_faces[faces]).toarray() - response[face, face],
            load=-response[face, load],
            fixed=response[load, load],
            by_face=-response[load, face],
            fixed_torque=response[-1, load],
            face_torque=turn.T @ held_torque[faces] - response[-1, face],
        )

    def open_chain(self, teeth: int, weights: np.ndarray) -> tuple[dict[tuple[int, int], np.ndarray], np.ndarray]:
        """Compliance by (read, loaded) of a chain with free ends, and the torque, its middle tooth loaded."""
        blocks, middle = {}, teeth // 2
        by_load = open_chain_faces(self.stiffness, self.load, teeth)
        for loaded, faces in enumerate(by_load):
            for read in range(teeth):
                both = np.concatenate(faces[read : read + 2])
                moved = self.by_face @ both
                own = (self.fixed + moved) @ weights
                blocks[read - middle, loaded - middle] = own if read == loaded else moved
        ends = (np.concatenate(by_load[middle][read : read + 2]) for read in range(teeth))
        return blocks, self.fixed_torque + sum(self.face_torque @ both for both in ends)


def assert_equal_to_one_factorisation(gear: Gear, settings: MeshSettings, side: int) -> None:
    """Compared as an open chain of three teeth, where the choice of face unknowns drops out."""
    mesh = sector_mesh(gear, settings)
    own = CondensedSector.from_mesh(mesh, side, True)
    faces, torque = own.open_faces(3)
    blocks, reference_torque = Reference.of(mesh, side, True).open_chain(3, own.weights)
    # 1e-10: two eliminations of the same thousands of equations in different orders.
    assert np.abs(torque - reference_torque).max() < 1e-10 * np.abs(reference_torque).max()
    for (read, loaded), reference in blocks.items():
        found = own.displacement(read == loaded, *faces[read, loaded])
        assert np.abs(found - reference).max() < 1e-10 * np.abs(blocks[0, 0]).max()


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("settings", [EVEN_NUMBERS, ODD_NUMBERS], ids=["even", "odd"])
@pytest.mark.parametrize("gear", [SPUR_20, HELICAL_20, RING_60], ids=lambda gear: gear.name)
def test_dissection_equals_one_sparse_factorisation(gear: Gear, settings: MeshSettings, side: int) -> None:
    assert_equal_to_one_factorisation(gear, settings, side)


@pytest.mark.validation
@pytest.mark.long
def test_dissection_equals_one_sparse_factorisation_on_the_default_mesh(any_grc_gear: Gear) -> None:
    assert_equal_to_one_factorisation(any_grc_gear, MeshSettings(), 1)


def test_layers_of_unequal_height_are_condensed() -> None:
    """Graded to both ends: two heights, with elements of their own each."""
    mesh = sector_mesh(HELICAL_20, EVEN_NUMBERS)
    graded = dataclasses.replace(mesh, axial_positions=np.array([-10.0, -7.0, 0.0, 7.0, 10.0]) * 1e-3)
    own = CondensedSector.from_mesh(graded, 1, True)
    faces, _ = own.open_faces(3)
    blocks, _ = Reference.of(graded, 1, True).open_chain(3, own.weights)
    found = own.displacement(True, *faces[0, 0])
    assert np.abs(found - blocks[0, 0]).max() < 1e-10 * np.abs(found).max()


def test_a_mesh_that_is_not_its_own_mirror_image_is_refused() -> None:
    mesh = sector_mesh(HELICAL_20, EVEN_NUMBERS)
    lopsided = dataclasses.replace(mesh, axial_positions=np.array([-10.0, -7.0, 0.0, 5.0, 10.0]) * 1e-3)
    with pytest.raises(ValueError, match="turned by 180 deg .* misses itself by 0.002 m"):
        CondensedSector.from_mesh(lopsided, 1, True)
