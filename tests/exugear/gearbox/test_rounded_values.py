"""Published gear data are rounded in their last digit: overlaps within that are taken as no backlash, and told."""

from __future__ import annotations

import math
import tomllib
from typing import Any

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.system.gearbox_checks import gearbox_warnings

from ..cases.spur import SPUR_CASE

Data = dict[str, Any]
FZG = {"normal_module_mm": 4.5, "face_width_mm": 20.0, "held_diameter_mm": 30.0}
"""FZG gears of ISO 14635-1 and ASTM D5182, with the profile shifts that are commonly printed."""
FZG_A = (FZG | {"teeth": 16, "profile_shift": 0.8532, "tip_diameter_mm": 88.77},
         FZG | {"teeth": 24, "profile_shift": -0.5, "tip_diameter_mm": 112.5})  # fmt: skip
FZG_C = (FZG | {"teeth": 16, "profile_shift": 0.1817, "tip_diameter_mm": 82.46, "face_width_mm": 14.0},
         FZG | {"teeth": 24, "profile_shift": 0.1715, "tip_diameter_mm": 118.36, "face_width_mm": 14.0})  # fmt: skip
HELICAL = {"normal_module_mm": 3.0, "face_width_mm": 30.0, "held_diameter_mm": 20.0, "helix_angle_deg": 30.0}
ELEMENTS = (HELICAL | {"teeth": 12, "profile_shift": 0.09809},
            HELICAL | {"teeth": 60, "profile_shift": 0.0, "helix_angle_deg": -30.0})  # fmt: skip
"""Elements of Metric Gear Technology, table 6.1: a = 125 mm."""
SPUR = {"normal_module_mm": 3.0, "face_width_mm": 20.0}
INTERNAL = (SPUR | {"teeth": 16, "profile_shift": 0.0, "held_diameter_mm": 20.0},
            SPUR | {"teeth": 24, "profile_shift": 0.5, "held_diameter_mm": 95.0, "internal": True})  # fmt: skip
"""Elements of Metric Gear Technology, internal gears: a = 13.1683 mm."""


def content(gears: tuple[Data, Data], distance: float) -> Data:
    found = tomllib.loads(SPUR_CASE)
    found["gears"] = dict(zip(("pinion", "wheel"), (dict(gear) for gear in gears), strict=True))
    found["pairs"]["spur"]["centre_distance_mm"] = distance
    found["bodies"]["shaft_2"]["axis_position_mm"] = [distance, 0.0]
    return found


@pytest.mark.parametrize(
    ("gears", "distance", "angle"),
    [(FZG_A, 91.5, 22.4388), (FZG_C, 91.5, 22.4388), (ELEMENTS, 125.0, 23.1126), (INTERNAL, 13.1683, 31.0937)],
)
def test_published_pairs_without_backlash_are_taken_and_told(
    gears: tuple[Data, Data], distance: float, angle: float
) -> None:
    """Working pressure angles of the tables; the overlaps are 65 nm (FZG), 1 nm (helical) and 39 nm (internal)."""
    gearbox = Gearbox.from_dict(content(gears, distance), "case.toml")
    pair = gearbox.gear_pairs["spur"]
    assert math.degrees(pair.working_pressure_angle) == pytest.approx(angle, abs=2e-4)
    assert 0.0 <= pair.circumferential_backlash < 1e-11
    (line,) = (
        line
        for line in gearbox_warnings(gearbox)
        if "µm, within the rounding of the input; zero backlash is used, with teeth thinner by that amount" in line
    )
    assert line.startswith("gears.wheel: ")


def test_an_overlap_beyond_the_rounding_is_refused_with_digits_that_tell_it() -> None:
    """Half a unit of the last digits: 0.5e-4 modules of x_1, 0.5e-3 of x_2 = -0.5 and of a = 91.5 mm give 2.2 um."""
    for shift, refused in ((-0.4999, False), (-0.495, True)):
        found = content(FZG_A, 91.5)
        found["gears"]["wheel"]["profile_shift"] = shift
        if not refused:
            Gearbox.from_dict(found, "case.toml")
            continue
        with pytest.raises(GearboxFileError, match=r"overlap by .* at least 91\.5\d+ mm is needed") as caught:
            Gearbox.from_dict(found, "case.toml")
        assert "91.5000 mm is needed" not in str(caught.value)


def test_digits_that_are_given_count() -> None:
    """The same overlap of 0.3 um with x_1 to seven digits is no rounding."""
    found = content(FZG_A, 91.5)
    found["gears"]["pinion"]["profile_shift"] = 0.8533001
    found["gears"]["wheel"]["profile_shift"] = -0.5000001
    found["pairs"]["spur"]["centre_distance_mm"] = 91.5000001
    with pytest.raises(
        GearboxFileError, match=r"centre_distance = 91\.5000\d* mm is too small.* overlap by 0\.39\d µm"
    ):
        Gearbox.from_dict(found, "case.toml")


def test_pairs_without_overlap_stay_as_they_are() -> None:
    gearbox = Gearbox.from_dict(tomllib.loads(SPUR_CASE), "case.toml")
    assert all(gear.tooth_thinning == 0.0 for gear in gearbox.gears.values())
