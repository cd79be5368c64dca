"""Bodies move as rigid bodies, by as much as can be seen."""

import math
from pathlib import Path as FilePath

import numpy as np
import pytest

from exugear.gearbox.parts import Body
from exugear.report.pictures.shapes import (
    BodyShape,
    displacement_of,
    mode_scene,
    motion_matrix,
    motions_of,
    placed,
    tube_surface,
)

CASE = FilePath(__file__).parents[4] / "cases" / "grc750" / "gearbox.toml"


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
