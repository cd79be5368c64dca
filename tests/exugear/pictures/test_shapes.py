"""Bodies look like the gears they are, mesh where they should, and move as rigid bodies."""

import math
from pathlib import Path as FilePath

import numpy as np
import pytest
from matplotlib.path import Path as Outline

from exugear.model.gearbox import Gearbox
from exugear.model.parts import Body
from exugear.pictures.shapes import (
    BodyShape,
    Surface,
    bodies_of,
    displacement_of,
    gear_surface,
    mode_scene,
    motion_matrix,
    motions_of,
    placed,
    tooth_angles,
    tube_surface,
)
from fe_ste.geometry.gears import Gear
from fe_ste.geometry.profile import tooth_profile

CASE = FilePath(__file__).parents[3] / "cases" / "grc750" / "gearbox.toml"


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


@pytest.mark.parametrize("number", range(8))
def test_teeth_of_the_grc_mesh_without_overlap(number):
    gearbox = Gearbox.from_toml(CASE)
    mesh = gearbox.meshes[number]
    angles = tooth_angles(gearbox.meshes)
    outlines = []
    for body, gear, offset in (
        (mesh.pinion, mesh.pair.pinion, mesh.offsets[0]),
        (mesh.gear, mesh.pair.gear, mesh.offsets[1]),
    ):
        profile = tooth_profile(gear)
        radii = np.linspace(profile.form_radius, profile.tip_radius, 40)
        polar = gear.half_angle(radii)
        side = np.concatenate(
            [np.column_stack([np.hypot(*profile.fillet.T), np.arctan2(*profile.fillet.T[::-1])])[::-1],
             np.column_stack([radii, polar])]
        )  # fmt: skip
        tooth = np.concatenate([side * [1.0, -1.0], side[::-1]])
        turned = angles[body, gear.name] + offset * math.tan(gear.base_helix_angle) / gear.base_radius
        all_teeth = np.concatenate([tooth + [0.0, turned + n * gear.angular_pitch] for n in range(gear.teeth)])
        points = all_teeth[:, :1] * np.column_stack([np.cos(all_teeth[:, 1]), np.sin(all_teeth[:, 1])])
        outlines.append(points + gearbox.body(body).axis)
    pinion, gear = outlines
    towards = np.subtract(gearbox.body(mesh.gear).axis, gearbox.body(mesh.pinion).axis)
    kind = -1.0 if mesh.pair.gear.internal else 1.0
    along = (pinion - gearbox.body(mesh.pinion).axis) @ (kind * towards / np.linalg.norm(towards))
    near = along > 0.85 * mesh.pair.pinion.root_radius  # the rest cannot touch
    inside = Outline(gear).contains_points(pinion[near])
    # Between external gears no point of one lies in the other; inside a ring's outline lies its hollow.
    assert inside.all() if mesh.pair.gear.internal else not inside.any()
    # They do reach into each other by about the working depth.
    tip = mesh.pair.gear.tip_radius
    mate = tip - mesh.centre_distance if mesh.pair.gear.internal else mesh.centre_distance - tip
    assert along.max() - mate > 1.5 * mesh.pair.pinion.normal_module


def test_grc_bodies_stand_where_the_file_says():
    gearbox = Gearbox.from_toml(CASE)
    shapes = {shape.name: shape for shape in bodies_of(gearbox)}
    for name in ("planet_1", "planet_2", "planet_3"):
        middle = 0.5 * (shapes[name].surface.points.min(axis=0) + shapes[name].surface.points.max(axis=0))
        np.testing.assert_allclose(middle[:2], gearbox.body(name).axis, atol=2e-3)  # teeth are not symmetric about x, y
        assert shapes[name].family == "planet" and not shapes[name].fixed
    assert shapes["housing"].fixed
    assert shapes["hss"].reference[2] == pytest.approx(gearbox.body("hss").centre_of_mass_z)
    for shape in shapes.values():
        assert shape.surface.triangles.max() < len(shape.surface.points)


def block(name="block", shift=(0.0, 0.0, 0.0)):
    surface = tube_surface(0.2, -0.1, 0.1).moved(shift)
    return BodyShape(name, name, surface, np.array([0.05, -0.02, 0.01]))


def test_rotation_about_z_is_counter_clockwise_about_the_reference():
    matrix = motion_matrix((1.0, 2.0, 0.0), (0.1, 0.0, 0.0, 0.0, 0.0, math.pi / 2))
    np.testing.assert_allclose(matrix @ [2.0, 2.0, 5.0, 1.0], [1.1, 3.0, 5.0, 1.0], atol=1e-12)


def test_motions_are_rigid_however_large():
    body = block()
    moved = placed(body, (0.3, -0.1, 0.2, 0.8, -0.5, 2.0))
    pairs = np.random.default_rng(0).integers(0, len(moved), (50, 2))
    before = np.linalg.norm(np.diff(body.surface.points[pairs], axis=1), axis=2)
    np.testing.assert_allclose(np.linalg.norm(np.diff(moved[pairs], axis=1), axis=2), before, atol=1e-12)


def test_small_motions_are_the_linear_displacement():
    body = block()
    motion = 1e-6 * np.array([1.0, 2.0, -1.0, 3.0, -2.0, 4.0])
    linear = displacement_of(body, motion)
    np.testing.assert_allclose(placed(body, motion) - body.surface.points, linear, atol=1e-11)  # square of 4e-6


def test_mode_is_scaled_to_the_scene():
    bodies = (block("a"), block("b", (1.0, 0.0, 0.0)))
    scene = mode_scene(bodies, {"b": [0.0, 3.0, 0.0, 0.0, 0.0, 0.0]}, title="mode", amplitude=0.05)
    diagonal = np.linalg.norm([1.2, 0.2, 0.2])  # both blocks; 48-gons reach the full diameter
    np.testing.assert_allclose(scene.motions[1], [0.0, 0.05 * diagonal, 0.0, 0.0, 0.0, 0.0], rtol=1e-9)
    np.testing.assert_array_equal(scene.displacement[0], 0.0)
    np.testing.assert_allclose(scene.displacement[1], 1.0)


@pytest.mark.parametrize(
    ("motions", "message"),
    [({"c": np.ones(6)}, "no body 'c'"), ({"a": np.zeros(6)}, "no body moves"), ({}, "no body moves")],
)
def test_modes_that_cannot_be_drawn_are_refused(motions, message):
    with pytest.raises(ValueError, match=message):
        mode_scene((block("a"),), motions)


def body(name, axis, carrier=None):
    return Body(
        name=name,
        family=name,
        axis=axis,
        centre_of_mass_z=0.0,
        mass=1.0,
        axial=1.0,
        transverse=1.0,
        carrier=carrier,
        orbit_angle=0.0,
        spin_only=False,
        fixed=False,
        wheels={},
    )


def test_motions_are_read_from_coordinates():
    bodies = [body("shaft", (0.0, 0.0)), body("disc", (0.0, 0.0))]
    motions = motions_of(bodies, {"shaft": (0, 1, 2, 3, 4, 5), "disc": (-1, -1, -1, -1, -1, 6)}, np.arange(1.0, 8.0))
    np.testing.assert_array_equal(motions["shaft"], [1, 2, 3, 4, 5, 6])
    np.testing.assert_array_equal(motions["disc"], [0, 0, 0, 0, 0, 7])


def test_planet_on_an_ideal_pin_goes_with_its_carrier():
    bodies = [body("carrier", (0.1, 0.0)), body("planet", (0.4, 0.4), carrier="carrier")]
    on_spin = (-1, -1, -1, -1, -1)
    motions = motions_of(bodies, {"carrier": (*on_spin, 0), "planet": (*on_spin, 1)}, [2.0, -5.0])
    np.testing.assert_allclose(motions["planet"], [-0.8, 0.6, 0.0, 0.0, 0.0, -5.0])


def test_planet_with_coordinates_of_its_own_keeps_them():
    bodies = [body("carrier", (0.0, 0.0)), body("planet", (0.3, 0.0), carrier="carrier")]
    motions = motions_of(bodies, {"carrier": (-1,) * 5 + (0,), "planet": (1, 2, 3, 4, 5, 6)}, np.arange(7.0))
    np.testing.assert_array_equal(motions["planet"], [1, 2, 3, 4, 5, 6])


def test_surfaces_join_without_mixing():
    first, second = tube_surface(0.1, 0.0, 0.1), tube_surface(0.2, 0.0, 0.1)
    joined = Surface.joined([first, second])
    assert abs(volume(joined)) == pytest.approx(abs(volume(first)) + abs(volume(second)))
