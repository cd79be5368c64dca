"""Contact of teeth on the page: sides of the face of both flanks, places in words, drawings."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest

from exugear.life.rating.sheet import FlankSheet, RatingSheet
from exugear.report.findings.flank_contacts import PairContact, _seen_by, edge_in_words, place_on_flank
from exugear.report.findings.ratings import Ratings
from exugear.report.pictures.flank_maps import LEFT, LOAD, RIGHT, flank_map
from exugear.report.sections.gears import edge_cell
from fe_ste.flank_pressure import FlankPressure
from fe_ste.geometry.gears import Gear, GearPair

GEAR = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
PAIR = GearPair(name="pair", pinion=GEAR, gear=GEAR, centre_distance=90e-3)
AXIAL = 1e-3 * np.linspace(-9.0, 9.0, 10)
PATH = np.linspace(1e-3, 9e-3, 9)


@pytest.fixture
def loaded_below() -> FlankPressure:
    """More load towards -z, most pressure at the root of gear 1 there."""
    along = np.linspace(2.0, 0.5, 10)
    pressure = 1e9 * along * np.linspace(1.0, 0.5, 9)[:, None]
    return FlankPressure(1e-4, PATH, AXIAL, pressure, 1e5 * along, float(along.max() / along.mean()), 0.0)


def contact(flank: FlankPressure) -> PairContact:
    return PairContact("mesh", "mesh", PAIR, 1e3, flank, flank)


def test_the_other_flank_turns_the_ends_of_the_face(loaded_below: FlankPressure) -> None:
    turned = _seen_by(loaded_below, -1)
    assert turned.misalignment == -loaded_below.misalignment
    assert (np.diff(turned.axial) > 0.0).all()
    assert turned.highest == (2e9, PATH[0], AXIAL[-1])
    assert turned.line_load @ turned.axial == pytest.approx(-(loaded_below.line_load @ loaded_below.axial))
    again = _seen_by(turned, -1)
    assert np.array_equal(again.pressure, loaded_below.pressure) and np.array_equal(again.axial, AXIAL)
    assert _seen_by(loaded_below, 1) is loaded_below


def highest_place(flank: FlankPressure, labels: dict[str, str]) -> str:
    return place_on_flank(contact(flank), *flank.highest[1:], labels)


def test_places_are_named_by_gear_1_and_the_end_of_the_face(loaded_below: FlankPressure) -> None:
    assert highest_place(loaded_below, {"gear": "sun"}) == "root of sun, −z end"
    tip = replace(loaded_below, pressure=loaded_below.pressure[::-1, ::-1])
    assert highest_place(tip, {}) == "tip of gear, +z end"
    middle = replace(loaded_below, pressure=np.pad(np.ones((1, 2)), ((4, 4), (4, 4))))
    assert highest_place(middle, {}) == "middle of the profile of gear, middle of the face"


def test_the_tip_edge_is_of_gear_1_at_the_end_of_the_path_and_of_gear_2_at_its_start(
    loaded_below: FlankPressure,
) -> None:
    other = replace(GEAR, name="wheel")
    pair = replace(PAIR, gear=other)
    for path, name in ((PATH[-1], "gear"), (PATH[0], "big wheel")):
        edge = replace(loaded_below, edge_pressure=3e9, edge_place=(float(path), float(AXIAL[0])))
        seen = PairContact("mesh", "mesh", pair, 1e3, edge, edge)
        assert edge_in_words(seen, {"wheel": "big wheel"}) == f"tip of {name}, −z end"
        turned = _seen_by(edge, -1)
        seen = PairContact("mesh", "mesh", pair, 1e3, turned, turned)
        assert edge_in_words(seen, {"wheel": "big wheel"}) == f"tip of {name}, +z end"


def test_without_a_load_at_tip_edges_no_tip_is_named(loaded_below: FlankPressure) -> None:
    """A pressure at edges may come from cells whose load lies on the path."""
    edge = replace(loaded_below, edge_pressure=3e9)
    assert edge_in_words(contact(edge), {}) == edge_in_words(contact(_seen_by(edge, -1)), {}) == "–"


def test_a_tip_edge_pressure_above_that_of_the_flank_is_marked() -> None:
    above, below, none = (edge_cell(edge, 1.2e9) for edge in (1.5e9, 1.0e9, 0.0))
    assert (above.shown, above.tag, below.tag) == ("1500", "mind", "")
    assert above.caveat and above.caveat == below.caveat
    assert (none.shown, none.tag, none.caveat) == ("–", "", "")


def test_safety_factors_are_the_smallest_of_both_gears_and_finite_elements_count() -> None:
    def flank(gear: str, standard: float, finite_elements: dict[str, float]) -> FlankSheet:
        return FlankSheet(gear, "mesh", "+", 0, {"S_H": standard, "S_F": 2.0 * standard}, finite_elements, {}, ())

    sheet = RatingSheet("edition", "load", (flank("sun", 1.1, {}), flank("planet", 1.2, {"S_H": 0.9})), (), ())
    assert Ratings((), sheet).safety_factors("mesh") == {"S_H": 0.9, "S_F": 2.2}
    assert Ratings((), sheet).safety_factors("other") == Ratings().safety_factors("mesh") == {}


def test_the_drawing_has_the_root_below_and_the_minus_z_end_left(loaded_below: FlankPressure) -> None:
    drawn = flank_map(loaded_below, 2e9, 2.5e5, "words")
    pixels = matplotlib.image.imread(io.BytesIO(base64.b64decode(drawn.picture.split(",")[1])))
    assert pixels.shape[:2] == (9, 10)
    darkest = np.unravel_index(pixels[..., :3].sum(axis=2).argmin(), (9, 10))
    assert darkest == (8, 0)
    points = np.array([pair.split() for pair in re.split("[ML]", drawn.curve)[1:]], dtype=float)
    assert points.shape == (10, 2) and (points[:, 0] > LEFT).all() and (points[:, 0] < RIGHT).all()
    # Line loads, read back from the curve.
    read = (LOAD[1] - points[:, 1]) / (LOAD[1] - LOAD[0]) * 2.5e5
    assert read == pytest.approx(loaded_below.line_load, abs=200.0)
    assert [mark.text for mark in drawn.ticks] == ["−10", "−5", "0", "5", "10"]
