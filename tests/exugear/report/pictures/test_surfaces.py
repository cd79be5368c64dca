"""Surfaces of gears and shafts are closed and have the volume they should."""

import math
from pathlib import Path as FilePath

import numpy as np
import pytest

from exugear.report.pictures.shapes import TriangleSurface, gear_surface, tube_surface
from fe_ste.geometry.gears import Gear
from fe_ste.geometry.profile import tooth_profile

CASE = FilePath(__file__).parents[4] / "cases" / "grc750" / "gearbox.toml"


def volume(surface):
    """Signed volume by the divergence theorem: right only for a closed surface that faces outwards."""
    a, b, c = surface.points[surface.triangles].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6.0


def is_closed(surface):
    """Each edge belongs to two triangles, one in each sense; points that coincide count as one."""
    _, same = np.unique(np.round(surface.points, 9), axis=0, return_inverse=True)
    corners = same.ravel()[surface.triangles]
    corners = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]  # a bore of zero collapses triangles
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    there = {tuple(edge) for edge in edges}
    return len(there) == len(edges) and all((b, a) in there for a, b in there)


def external(**options):
    return Gear(name="external", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3, **options)


def internal(**options):
    return Gear(
        name="ring", teeth=60, normal_module=3e-3, face_width=20e-3, held_diameter=220e-3, internal=True, **options
    )


def exact_section(gear):
    """Area of a tooth section between tip and root circle from its profile, finely sampled."""
    profile = tooth_profile(gear)
    radii = np.linspace(profile.form_radius, profile.tip_radius, 400)
    polar = gear.half_angle(radii)
    flank = np.column_stack([radii * np.cos(polar), radii * np.sin(polar)])
    lands = (
        (profile.root_radius, math.pi / gear.teeth, np.arctan2(*profile.fillet[-1, ::-1])),
        (profile.tip_radius, polar[-1], 0.0),
    )
    root, tip = (
        radius * np.column_stack([np.cos(angles), np.sin(angles)])
        for radius, angles in ((radius, np.linspace(start, end, 50)) for radius, start, end in lands)
    )
    x, y = np.concatenate([root, profile.fillet[::-1], flank, tip]).T
    half = 0.5 * np.abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))  # from the middle of a space to that of a tip
    return 2.0 * gear.teeth * half


@pytest.mark.parametrize("helix", [0.0, 0.3])
@pytest.mark.parametrize("make", [external, internal])
def test_gear_surface_is_closed_and_has_the_volume_of_the_gear(make, helix):
    gear = make(helix_angle=helix)
    surface = gear_surface(gear)
    assert is_closed(surface)
    rim = math.pi * (0.5 * gear.held_diameter) ** 2
    section = rim - exact_section(gear) if gear.internal else exact_section(gear) - rim
    # Five chords along flank and fillet, one over each land; between rings of points a helix is straight.
    assert abs(volume(surface)) == pytest.approx(section * gear.face_width, rel=0.01)


@pytest.mark.parametrize("make", [external, internal])
def test_gear_surface_reaches_tip_and_root(make):
    gear = make(helix_angle=0.2)
    radius = np.hypot(*gear_surface(gear).points[:, :2].T)
    teeth = radius[np.abs(radius - 0.5 * gear.held_diameter) > 1e-9]
    assert {round(teeth.min(), 9), round(teeth.max(), 9)} == {round(gear.tip_radius, 9), round(gear.root_radius, 9)}


@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_right_hand_teeth_turn_forward_along_the_axis(hand):
    gear = external(helix_angle=hand * 0.2)
    points = gear_surface(gear, angle=0.3).points
    tips = points[np.hypot(points[:, 0], points[:, 1]) > gear.tip_radius - 1e-9]
    half = float(gear.half_angle(gear.tip_radius))
    for height in (-10e-3, 10e-3):
        polar = np.arctan2(tips[:, 1], tips[:, 0])[np.abs(tips[:, 2] - height) < 1e-9]
        middle = 0.3 + height * math.tan(gear.base_helix_angle) / gear.base_radius
        assert np.abs(polar - (middle + half)).min() < 1e-9
        assert np.abs(polar - (middle - half)).min() < 1e-9


def test_tube_has_its_volume():
    tube = tube_surface(0.2, -0.1, 0.3, bore=0.1, centre=(1.0, 2.0))
    assert is_closed(tube) and is_closed(tube_surface(0.2, 0.0, 0.1))
    polygon = 48 * 0.5 * math.sin(2 * math.pi / 48)  # area of the 48-gon in the unit circle
    assert abs(volume(tube)) == pytest.approx(polygon * (0.1**2 - 0.05**2) * 0.4, rel=1e-9)
    np.testing.assert_allclose(tube.points.mean(axis=0)[:2], [1.0, 2.0], atol=1e-12)


def test_surfaces_join_without_mixing():
    first, second = tube_surface(0.1, 0.0, 0.1), tube_surface(0.2, 0.0, 0.1)
    joined = TriangleSurface.joined([first, second])
    assert abs(volume(joined)) == pytest.approx(abs(volume(first)) + abs(volume(second)))
