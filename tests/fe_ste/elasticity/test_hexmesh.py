"""Hexahedra of one tooth sector: shape, named surfaces, exact flanks and cut faces, volume."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import skfem

from fe_ste.elasticity.bricks import skfem_mesh
from fe_ste.elasticity.hexmesh import MeshSettings, SectorMesh, sector_mesh
from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gears import Gear
from fe_ste.geometry.profile import tooth_profile

from ..cases.gears import SPUR_50

FEW_LAYERS = MeshSettings(layers=4)
"""The default section; layers repeat it."""


@pytest.fixture
def mesh(any_grc_gear: Gear) -> SectorMesh:
    return sector_mesh(any_grc_gear, FEW_LAYERS)


def gauss_determinants(mesh: SectorMesh) -> np.ndarray:
    basis = skfem.Basis(skfem_mesh(mesh.points, mesh.hexahedra), skfem.ElementHex1(), intorder=3)
    return np.asarray(basis.mapping.detDF(basis.X))


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    rotation = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    return np.asarray(points @ rotation.T)


def test_every_grc_gear_has_positive_jacobians_and_well_shaped_elements(mesh: SectorMesh) -> None:
    # Least value of the seven gears: 0.667, at the corner between fillet, tooth and rim of the ring.
    assert gauss_determinants(mesh).min() > 0
    assert mesh.scaled_jacobian.min() > 0.65
    assert mesh.scaled_jacobian.max() <= 1.0 + 1e-12


def test_a_spur_gear_and_an_undivided_rim_mesh_too() -> None:
    mesh = sector_mesh(SPUR_50, MeshSettings(layers=3, flank=4, thickness=2, fillet=1, root=1, rim=1))
    assert gauss_determinants(mesh).min() > 0
    assert mesh.scaled_jacobian.min() > 0.3  # seven elements a section: coarse, but no fold


def test_cut_faces_match_after_one_pitch(mesh: SectorMesh) -> None:
    minus, plus = mesh.points[mesh.cut_nodes(-1)], mesh.points[mesh.cut_nodes(1)]
    # 1e-12 of a metre: rounding of coordinates below one metre.
    assert np.abs(turned(minus, mesh.gear.angular_pitch) - plus).max() < 1e-12


def test_flank_nodes_lie_on_the_involute_helicoid(mesh: SectorMesh) -> None:
    gear = mesh.gear
    for side in (-1, 1):
        x, y, z = np.moveaxis(mesh.points[mesh.flank_nodes(side)], -1, 0)
        radius = np.hypot(x, y)
        # The helix: tan(beta) at the reference circle, independent of the mesh's own rate of twist.
        lead = np.tan(gear.helix_angle) / gear.reference_radius
        angle = np.arctan2(y, x) - lead * z
        assert np.abs(radius * (side * angle - gear.half_angle(radius))).max() < 1e-12
        assert np.abs(radius[:, 0] - gear.base_radius * np.hypot(1.0, mesh.section.flank_roll)).max() < 1e-12
        ends = sorted((gear.form_radius, gear.tip_radius))
        assert (radius.min(), radius.max()) == pytest.approx(ends, abs=1e-12)
        assert (np.diff(mesh.section.flank_roll) > 0).all()


def test_surfaces_are_named_completely_and_apart(mesh: SectorMesh) -> None:
    """Named surfaces share no node but where they meet; with tip, root and ends they make up the boundary."""
    gear, section = mesh.gear, mesh.section
    flanks = [set(mesh.flank_nodes(side).ravel()) for side in (-1, 1)]
    cuts = [set(mesh.cut_nodes(side)) for side in (-1, 1)]
    held = set(mesh.held_nodes)
    surfaces = [*flanks, *cuts, held]
    for i, one in enumerate(surfaces):
        for other in surfaces[:i]:
            assert not one & other

    assert len(held) == (len(section.held)) * len(mesh.axial_positions)
    assert np.hypot(*section.points[section.held].T) == pytest.approx(gear.held_diameter / 2, abs=1e-12)
    for side, cut in ((-1, section.minus_cut), (1, section.plus_cut)):
        x, y = section.points[cut].T
        assert np.arctan2(y, x) == pytest.approx(side * np.pi / gear.teeth, abs=1e-12)

    boundary = set(skfem_mesh(mesh.points, mesh.hexahedra).boundary_nodes())
    assert all(surface <= boundary for surface in surfaces)
    inner = boundary - set.union(*surfaces)
    x, y, z = mesh.points[sorted(inner)].T
    end_face = np.abs(np.abs(z) - gear.face_width / 2) < 1e-12
    radius = np.hypot(x, y)
    tip = np.abs(radius - gear.tip_radius) < 1e-9
    low, high = sorted((gear.root_radius, gear.form_radius))
    # Chords of the fillet and land may cut the root circle by their sagitta: nodes themselves do not.
    root = (radius > low - 1e-6) & (radius < high + 1e-12)
    assert (end_face | tip | root).all()


def test_sector_has_no_inner_surface(mesh: SectorMesh) -> None:
    """The boundary edges of the section form one closed line: no crack between the blocks."""
    edges = np.concatenate([mesh.section.quads[:, [i, (i + 1) % 4]] for i in range(4)])
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    outer = edges[first[count == 1]]
    assert count.max() == 2
    start = np.argsort(outer[:, 0])
    after = dict(zip(outer[start, 0], outer[start, 1], strict=True))
    node, steps = int(outer[0, 0]), 0
    while True:
        node, steps = int(after[node]), steps + 1
        if node == outer[0, 0]:
            break
    assert steps == len(outer)
    flat = np.sort(np.concatenate([mesh.section.quads.ravel()]))
    assert np.array_equal(np.unique(flat), np.arange(len(mesh.section.points)))


def test_volume_is_section_area_times_width() -> None:
    """A spur sector: hexahedra against the shoelace area of the boundary line, itself against the profile."""
    mesh = sector_mesh(SPUR_50, MeshSettings().refined(2))
    volume = gauss_determinants(mesh).sum() / 8  # eight Gauss points of weight 1/8 in the unit cube
    quads = mesh.section.points[mesh.section.quads]
    x, y = quads[..., 0], quads[..., 1]
    area = 0.5 * np.sum(x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y)
    assert volume == pytest.approx(area * SPUR_50.face_width, rel=1e-12)

    # Closed form: sector of the root circle plus, from root to tip, the width of the tooth at each radius.
    profile = tooth_profile(SPUR_50)
    flank = profile.flank(np.linspace(profile.form_radius, profile.tip_radius, 2001))
    edge = np.concatenate([profile.fillet[::-1], flank])
    radius, angle = np.hypot(*edge.T), np.arctan2(edge[:, 1], edge[:, 0])
    tooth = 2 * np.trapezoid(angle * radius, radius)
    body = np.pi / SPUR_50.teeth * (SPUR_50.root_radius**2 - (SPUR_50.held_diameter / 2) ** 2)
    # Chords instead of arcs: the twice refined mesh misses a few 1e-4 of the area.
    assert area == pytest.approx(tooth + body, rel=5e-4)


def test_helical_sector_has_the_volume_of_its_section(mesh: SectorMesh) -> None:
    quads = mesh.section.points[mesh.section.quads]
    x, y = quads[..., 0], quads[..., 1]
    area = 0.5 * np.sum(x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y)
    # Between two layers a turn apart the section is (1 - t) I + t R(turn) of itself: its area is smaller by
    # 4 t (1 - t) sin^2(turn / 2), two thirds of sin^2(turn / 2) in the mean.
    turn = mesh.twist_rate * mesh.gear.face_width / mesh.settings.layers
    shrunk = area * mesh.gear.face_width * (1 - 2 / 3 * np.sin(turn / 2) ** 2)
    assert gauss_determinants(mesh).sum() / 8 == pytest.approx(shrunk, rel=1e-12)


def test_refined_settings_divide_every_element() -> None:
    coarse, fine = (sector_mesh(SPUR_50, MeshSettings(layers=3).refined(factor)) for factor in (1, 2))
    assert len(fine.hexahedra) == 8 * len(coarse.hexahedra)


@pytest.mark.parametrize("key", ["layers", "flank", "thickness", "fillet", "root", "rim", "grading"])
def test_counts_no_mesh_can_have_are_refused(key: str) -> None:
    with pytest.raises(ValueError, match=key):
        MeshSettings(**{key: 0})


def test_grading_that_is_no_number_is_refused() -> None:
    with pytest.raises(ValueError, match="grading"):
        MeshSettings(grading=float("nan"))


def test_folded_section_is_refused() -> None:
    """A held cylinder just under the root leaves no rim below the fillet's split point."""
    root = 2 * SPUR_50.root_radius
    for held in np.linspace(0.9, 0.9999, 12) * root:
        try:
            mesh = sector_mesh(dataclasses.replace(SPUR_50, held_diameter=held), FEW_LAYERS)
        except GeometryError as error:
            assert "held" in str(error)
        else:
            assert gauss_determinants(mesh).min() > 0
