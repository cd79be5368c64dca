"""Flank topography: what a grid gives between its points, and what its file must hold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fe_ste.flanks import FlankModification, FlankTopography
from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gears import Gear, GearPair

FILE = """radius_mm, -100.0, 0.0, 100.0
# measured after grinding
185.0, 4.0, 3.0, 5.0

200.0, 1.0, 0.0, -1.5
210.0, 6.0, 5.5, 7.0
"""


def test_file_gives_its_values_at_its_points(tmp_path: Path, sun_planet: GearPair) -> None:
    path = tmp_path / "flank.csv"
    path.write_text(FILE, encoding="utf-8")
    topography = FlankTopography.from_csv(path)
    radius = np.array([0.185, 0.2, 0.21])[:, None]
    gap = topography.gap(sun_planet.gear, radius, np.array([-0.1, 0.0, 0.1]))
    expected = np.array([[4.0, 3.0, 5.0], [1.0, 0.0, -1.5], [6.0, 5.5, 7.0]])
    # Roll lengths rounded to 1e-16 of some cm, slopes of micrometres over them.
    np.testing.assert_allclose(gap, 1e-6 * expected, rtol=0, atol=1e-17)
    # Beyond the grid its edge goes on.
    assert topography.gap(sun_planet.gear, np.array(0.22), np.array(0.2)) == pytest.approx(7e-6, rel=1e-12)


def test_grid_of_a_modification_equals_the_modification(any_grc_gear: Gear) -> None:
    """Slopes and twist are bilinear in roll length and face width: four points hold all of them."""
    gear = any_grc_gear
    whole = FlankModification(profile_slope=5e-6, helix_slope=-8e-6, twist=6e-6)
    radius = np.sort([gear.form_radius, gear.tip_radius])
    axial = np.array([-0.5, 0.5]) * gear.face_width
    removed = whole.gap(gear, radius[:, None], axial)
    grid = FlankTopography(tuple(radius.tolist()), tuple(axial.tolist()), tuple(map(tuple, removed.tolist())))
    places = np.linspace(radius[0], radius[1], 9)[:, None], np.linspace(axial[0], axial[1], 7)
    np.testing.assert_allclose(
        FlankModification(topography=grid).gap(gear, *places), whole.gap(gear, *places), rtol=0, atol=1e-17
    )


def test_mirrored_topography_is_itself_seen_from_the_other_end(sun_planet: GearPair) -> None:
    grid = FlankTopography((0.185, 0.21), (-0.1, 0.02, 0.1), ((1e-6, 2e-6, 3e-6), (0.0, 5e-6, 9e-6)))
    z = np.linspace(-0.1, 0.1, 11)
    radius = np.array([0.186, 0.2])[:, None]
    np.testing.assert_allclose(
        grid.mirrored().gap(sun_planet.gear, radius, z), grid.gap(sun_planet.gear, radius, -z), rtol=0, atol=1e-17
    )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("3.0, 5.0", "three, 5.0", r"line 3: 'three' must be a finite number"),
        ("5.5", "nan", r"line 6: 'nan'"),
        ("6.0, 5.5, 7.0", "6.0, 5.5", r"line 6: 3 values; a radius and 3 amounts"),
        ("210.0", "190.0", r"line 6: radius 190 mm must be above"),
        ("-100.0, 0.0, 100.0", "-100.0, 0.0, -10.0", r"line 1: axial position -10 mm must be above 0 mm"),
        (FILE, "radius_mm, 1.0\n", "a topography needs"),
    ],
)
def test_bad_file_is_refused_with_line_and_value(tmp_path: Path, old: str, new: str, words: str) -> None:
    path = tmp_path / "flank.csv"
    path.write_text(FILE.replace(old, new), encoding="utf-8")
    with pytest.raises(GeometryError, match=rf"flank\.csv: {words}"):
        FlankTopography.from_csv(path)


def test_missing_file_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(GeometryError, match=r"none\.csv: cannot be read"):
        FlankTopography.from_csv(tmp_path / "none.csv")


def test_grid_that_is_none_is_refused() -> None:
    with pytest.raises(GeometryError, match="radius must hold two rising"):
        FlankTopography((0.2, 0.2), (0.0, 0.1), ((0.0, 0.0), (0.0, 0.0)))
    with pytest.raises(GeometryError, match="2 rows of 2"):
        FlankTopography((0.1, 0.2), (0.0, 0.1), ((0.0, 0.0), (0.0,)))


def test_a_grid_inside_the_base_circle_is_refused(sun_planet: GearPair) -> None:
    base = sun_planet.pinion.base_radius
    grid = FlankTopography((0.9 * base, base), (-0.01, 0.01), ((0.0, 1e-6), (0.0, 1e-6)))
    with pytest.raises(GeometryError, match="inside the base circle"):
        grid.gap(sun_planet.pinion, np.array(1.1 * base), np.array(0.0))
