"""Bearings by their designation alone: type and boundary dimensions of ISO 15 and ISO 355, ratings of catalogues."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.system.bearings.duty import ratings_of
from exugear.system.gearbox_checks import lacking

from ..cases.spur import SPUR_CASE


def gearbox(section: dict[str, Any]) -> Gearbox:
    content = tomllib.loads(SPUR_CASE)
    content["bearings"]["bearing_1"] = {"body": "shaft_1", "z_mm": 0.0} | section
    return Gearbox.from_dict(content)


@pytest.mark.parametrize("section", [{"designation": "6307"}, {"catalogue": {"designation": "6307-2Z"}}])
def test_a_designation_stands_for_type_and_dimensions(section: dict[str, Any]) -> None:
    """6307: 35 x 80 x 21 mm (ISO 15); 33.4 and 19.2 kN are the smallest of SKF, NKE and NSK."""
    own = gearbox(section).bearings[0].catalogue
    assert own is not None
    assert own.type == "deep_groove_ball"
    assert (own.bore_mm, own.outer_diameter_mm, own.width_mm) == (35.0, 80.0, 21.0)
    ratings = ratings_of(own)
    assert (ratings.dynamic, ratings.static) == pytest.approx((33.4e3, 19.2e3), rel=0.03)
    assert ratings.makers


def test_stated_dimensions_count_before_those_of_the_designation() -> None:
    own = gearbox({"catalogue": {"designation": "30208", "width_mm": 20.0}}).bearings[0].catalogue
    assert own is not None
    assert (own.type, own.bore_mm, own.width_mm) == ("tapered_roller", 40.0, 20.0)


def test_an_unknown_designation_says_which_keys_to_set() -> None:
    with pytest.raises(GearboxFileError, match="designation = 'XY 63': the program has no dimensions of it; set type"):
        gearbox({"catalogue": {"designation": "XY 63"}})
    unknown = gearbox({"designation": "XY 63"})
    assert "bearing_1" in lacking(unknown, "bushing")
