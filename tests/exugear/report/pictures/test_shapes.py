"""Bodies look like the gears they are, and mesh where they should."""

import math
from pathlib import Path as FilePath

import numpy as np
import pytest
from matplotlib.path import Path as Outline

from exugear.gearbox.gearbox import Gearbox
from exugear.report.pictures.shapes import bodies_of, tooth_angles
from fe_ste.geometry.profile import tooth_profile

CASE = FilePath(__file__).parents[4] / "cases" / "grc750" / "gearbox.toml"


@pytest.mark.sample
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
