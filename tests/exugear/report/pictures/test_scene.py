"""Pictures and animations of gearboxes show their bodies; needs pyvista and off-screen OpenGL."""

import numpy as np
import pytest
from PIL import Image

from exugear.report.pictures.scene import (
    DISPLACEMENT_COLOURS,
    animate_mode,
    body_colours,
    displacement_map,
    draw_gearbox,
    draw_mode,
)
from exugear.report.pictures.shapes import BodyShape, TriangleSurface, gear_surface, mode_scene, tube_surface
from fe_ste.geometry.gears import Gear

from ....optional_libraries import needs_rendering


def bodies():
    gear = Gear(name="gear", teeth=30, normal_module=3e-3, helix_angle=0.2, face_width=20e-3, held_diameter=50e-3)
    wheel = TriangleSurface.joined([gear_surface(gear), tube_surface(50e-3, -40e-3, 40e-3)])
    ring = tube_surface(150e-3, -10e-3, 10e-3, bore=120e-3)
    return (
        BodyShape("housing", "housing", ring, np.zeros(3), fixed=True),
        BodyShape("wheel_1", "wheel", wheel, np.zeros(3)),
        BodyShape("wheel_2", "wheel", wheel.moved([0.12, 0.0, 0.0]), np.array([0.12, 0.0, 0.0])),
    )


def mode(title="812 Hz"):
    return mode_scene(bodies(), {"wheel_1": [0, 0, 0, 0, 0, 1.0], "wheel_2": [0, 0, 0, 0, 0, -0.5]}, title=title)


def reddest(image):
    """Share of pixels with the colours of large displacement: much more red than blue."""
    channels = np.asarray(image, dtype=np.int64)
    return float(((channels[..., 0] - channels[..., 2]) > 80).mean())


def test_families_share_a_colour_and_fixed_bodies_are_grey():
    colours = body_colours(bodies())
    assert list(colours) == ["wheel", "housing"]
    assert np.ptp(colours["housing"]) < 0.05 < np.ptp(colours["wheel"])


def test_displacement_runs_from_its_first_to_its_last_colour():
    ends = [displacement_map()(value)[:3] for value in (0.0, 1.0)]
    expected = [
        [int(c[i : i + 2], 16) / 255 for i in (1, 3, 5)] for c in DISPLACEMENT_COLOURS[:: len(DISPLACEMENT_COLOURS) - 1]
    ]
    np.testing.assert_allclose(ends, expected, atol=1e-9)


@needs_rendering
def test_gearbox_picture_names_the_bodies(tmp_path):
    figure = draw_gearbox(bodies(), tmp_path / "gearbox.png", title="two wheels", size=(500, 400))
    assert (tmp_path / "gearbox.png").stat().st_size > 10_000
    assert figure.axes[0].get_title(loc="left") == "two wheels"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["wheel", "housing"]


@needs_rendering
def test_mode_picture_colours_what_moves(tmp_path):
    figure = draw_mode(mode(), tmp_path / "mode.png", size=(500, 400))
    picture, bar = figure.axes
    assert picture.get_title(loc="left") == "812 Hz"
    assert bar.get_ylabel() == "Displacement / largest displacement"
    assert reddest(picture.images[0].get_array()) > 0.05
    resting = mode_scene(bodies(), {"housing": [1.0, 0, 0, 0, 0, 0]})  # only the translucent ring moves
    assert reddest(draw_mode(resting, size=(500, 400)).axes[0].images[0].get_array()) < 0.02


@needs_rendering
def test_animation_is_one_period_that_repeats(tmp_path):
    path = animate_mode(mode(), tmp_path / "new" / "mode.gif", frames=6, size=(300, 240))
    with Image.open(path) as animation:
        assert animation.n_frames == 6 and animation.info["loop"] == 0
        frames = []
        for number in range(6):
            animation.seek(number)
            frames.append(np.asarray(animation.convert("RGB"), dtype=np.int64))
    assert {frame.shape for frame in frames} == {frames[0].shape}
    np.testing.assert_array_equal(frames[1], frames[5])  # out and back
    assert np.abs(frames[0] - frames[3]).max() > 100  # teeth stand elsewhere at the other end
    assert tuple(frames[0][0, 0]) == (255, 255, 255)


@needs_rendering
def test_bodies_a_quarter_period_apart_do_not_move_out_and_back(tmp_path):
    """Wheel 2 is at its largest deflection while wheel 1 passes its rest position."""
    scene = mode_scene(bodies(), {"wheel_1": [0, 0, 0, 0, 0, 1.0], "wheel_2": [0, 0, 0, 0, 0, 0.5j]})
    path = animate_mode(scene, tmp_path / "operation.gif", frames=4, size=(300, 240))
    with Image.open(path) as animation:
        frames = []
        for number in range(4):
            animation.seek(number)
            frames.append(np.asarray(animation.convert("RGB"), dtype=np.int64))
    assert np.abs(frames[1] - frames[3]).max() > 50  # 0 for a standing wave


def test_animation_of_another_format_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"must be \.gif"):
        animate_mode(mode(), tmp_path / "mode.mp4")
