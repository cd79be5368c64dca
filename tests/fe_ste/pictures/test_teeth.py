"""Meshed teeth stand where the kinematics put them, and the picture shows the pressure it is given."""

import math
import os
from ctypes.util import find_library

import numpy as np
import pytest
from matplotlib.collections import PolyCollection

from fe_ste.contact.kinematics import FlankPair, lay_cells
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import BasicRack, Gear, GearPair
from fe_ste.pictures.teeth import HexahedraMesh, contact_quads, draw_tooth_contact, meshed_teeth
from fe_ste.tools import drawing
from fe_ste.tools.drawing import RenderingError, nice_length, require_rendering, without_margins

from ...optional_libraries import needs_rendering

COARSE = MeshSettings(layers=6, flank=16, thickness=2)


def external_pair():
    helix = math.radians(12.0)
    pinion = Gear(
        name="pinion", teeth=23, normal_module=5e-3, helix_angle=-helix, face_width=40e-3, held_diameter=60e-3
    )
    gear = Gear(name="gear", teeth=41, normal_module=5e-3, helix_angle=helix, face_width=40e-3, held_diameter=120e-3)
    return GearPair(name="external", pinion=pinion, gear=gear, centre_distance=32 * 5e-3 / math.cos(helix) + 0.2e-3)


def internal_pair():
    rack = BasicRack(addendum=0.9)
    options = {"normal_module": 5e-3, "helix_angle": math.radians(8.0), "face_width": 40e-3, "rack": rack}
    planet = Gear(name="planet", teeth=30, held_diameter=90e-3, **options)
    ring = Gear(name="ring", teeth=80, held_diameter=450e-3, internal=True, profile_shift=0.05, **options)
    return GearPair(name="internal", pinion=planet, gear=ring, centre_distance=25 * 5e-3 / math.cos(math.radians(8.0)))


def cells_on_contact_lines(pair, rotation):
    kinematics = FlankPair.from_pair(
        pair,
        pair.pinion.form_roll_length / pair.pinion.base_radius,
        pair.pinion.tip_roll_length / pair.pinion.base_radius,
    )
    edges = np.linspace(-0.5, 0.5, 9) * pair.face_width
    axial = 0.5 * (edges[1:] + edges[:-1])
    return lay_cells(kinematics, rotation, np.array([-1, 0, 1]), axial, 0.2e-3, 4), axial, edges[1] - edges[0]


@needs_rendering
@pytest.mark.parametrize("pair", [external_pair(), internal_pair()], ids=["external", "internal"])
@pytest.mark.parametrize("part_of_cycle", [0.0, 0.37])
def test_contact_lines_lie_on_the_flanks_of_both_gears(pair, part_of_cycle):
    import pyvista

    rotation = part_of_cycle * pair.pinion.angular_pitch
    bodies = meshed_teeth(pair, rotation, [-2, -1, 0, 1, 2], COARSE)
    cells, axial, slice_width = cells_on_contact_lines(pair, rotation)
    on_line = cells.select(cells.gap < 0.5e-6)
    assert len(on_line.gap) > 5
    middles = contact_quads(pair, on_line, rotation, axial, slice_width).mean(axis=1)
    for body in bodies:
        surface = body.surface().triangulate()
        distance = pyvista.PolyData(middles).compute_implicit_distance(surface)["implicit_distance"]
        # Chords of 16 elements over a flank of radius 20 mm and of twisted facets: 10 micrometres.
        assert np.abs(distance).max() < 15e-6


@pytest.mark.parametrize("pair", [external_pair(), internal_pair()], ids=["external", "internal"])
def test_gears_stand_on_the_line_of_centres(pair):
    pinion, gear = meshed_teeth(pair, 0.1, [0, 1], COARSE)
    kind = -1.0 if pair.gear.internal else 1.0
    from_gear = np.hypot(gear.points[:, 0] - kind * pair.centre_distance, gear.points[:, 1])
    from_pinion = np.hypot(pinion.points[:, 0], pinion.points[:, 1])
    assert from_pinion.max() == pytest.approx(pair.pinion.tip_radius)
    tip = from_gear.min() if pair.gear.internal else from_gear.max()
    assert tip == pytest.approx(pair.gear.tip_radius)


def test_contact_cells_have_their_width():
    pair = external_pair()
    cells, axial, slice_width = cells_on_contact_lines(pair, 0.0)
    quads = contact_quads(pair, cells, 0.0, axial, slice_width)
    across = np.linalg.norm(quads[:, 1] - quads[:, 0], axis=1)
    np.testing.assert_allclose(across, 2 * cells.half_across, rtol=1e-3)  # chord against arc
    np.testing.assert_allclose(quads[:, 2, 2] - quads[:, 1, 2], slice_width, rtol=1e-12)


@needs_rendering
def test_picture_shows_teeth_and_pressure(tmp_path):
    pair = external_pair()
    cells, axial, slice_width = cells_on_contact_lines(pair, 0.0)
    quads = contact_quads(pair, cells, 0.0, axial, slice_width)
    pressure = np.where(cells.gap < 2e-6, 900e6, 0.0)
    pinion, gear = meshed_teeth(pair, 0.0, [-1, 0, 1], MeshSettings(layers=4, flank=6, thickness=2))
    path = tmp_path / "contact.png"
    figure = draw_tooth_contact(pinion, gear, quads, pressure, path, title="pair, 10 kN", size=(500, 400))
    picture, chart, bar = figure.axes
    assert path.stat().st_size > 10_000
    assert picture.get_title(loc="left") == "pair, 10 kN"
    assert any(text.get_text().endswith(" mm") for text in picture.texts)
    assert bar.get_ylabel() == "Contact pressure / MPa"
    (shown,) = [artist for artist in chart.collections if isinstance(artist, PolyCollection)]
    np.testing.assert_allclose(shown.get_array(), 900.0)
    image = picture.images[0].get_array()
    assert 0.2 < np.any(image != 255, axis=-1).mean() < 0.99  # neither empty nor cropped


def test_scale_bar_is_to_scale():
    from matplotlib.figure import Figure

    panel = Figure().add_subplot()
    drawing.place_picture(panel, np.full((100, 400, 3), 255, dtype=np.uint8), 1e-3)
    (bar,) = panel.lines
    assert panel.texts[0].get_text() == "50 mm" and np.ptp(bar.get_xdata()) == pytest.approx(50.0)


@pytest.mark.parametrize(("longest", "expected"), [(0.0999, 0.05), (0.1, 0.1), (2.3e-4, 2e-4), (7.0, 5.0)])
def test_round_lengths(longest, expected):
    assert nice_length(longest) == expected


def test_margins_are_cut_to_the_wanted_width():
    image = np.full((60, 80, 3), 255, dtype=np.uint8)
    image[20:30, 40:50] = 0
    assert without_margins(image, 5).shape == (20, 20, 3)
    assert without_margins(np.full((6, 8, 3), 255, dtype=np.uint8)).shape == (6, 8, 3)


def test_arrays_that_do_not_fit_are_refused():
    body = HexahedraMesh(np.zeros((8, 3)), np.arange(8).reshape(1, 8))
    with pytest.raises(ValueError, match=r"quads \(2, 4, 3\) and pressure \(3,\)"):
        draw_tooth_contact(body, body, np.zeros((2, 4, 3)), np.zeros(3))
    with pytest.raises(ValueError, match="no cell carries pressure"):
        draw_tooth_contact(body, body, np.zeros((2, 4, 3)), np.zeros(2))


def test_missing_opengl_is_an_error_that_names_the_packages(monkeypatch):
    pytest.importorskip("pyvista", reason="pyvista (extra pictures) is missing")
    monkeypatch.setattr(drawing, "_probe_rendering", lambda: False)
    with pytest.raises(RenderingError, match=r"libegl1 .*libosmesa6"):
        require_rendering()


@pytest.mark.skipif(find_library("OSMesa") is not None, reason="OSMesa needs no EGL driver")
@pytest.mark.skipif("DISPLAY" in os.environ, reason="an X server offers OpenGL of its own")
def test_a_machine_without_opengl_is_recognised_although_vtk_crashes(monkeypatch):
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent")  # leaves EGL without a driver
    assert drawing._probe_rendering.__wrapped__() is False


def test_missing_pyvista_names_the_extra(monkeypatch):
    monkeypatch.setattr(drawing.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(RenderingError, match=r"exugear\[pictures\]"):
        require_rendering()
