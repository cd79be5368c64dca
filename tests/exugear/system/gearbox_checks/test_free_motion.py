"""Bodies that can move without resistance are named by what nothing holds, remedies by what the file takes."""

from __future__ import annotations

import math
import tomllib
from typing import Any

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.system.gearbox_checks import free_motion, gearbox_warnings

from ...cases.spur import SPUR_CASE


def helical(loose: str, axial: float = 0.0) -> dict[str, Any]:
    """Pair of helical gears of 20 degrees, one of whose shafts has an axial stiffness of its own, N/m."""
    found = tomllib.loads(SPUR_CASE)
    distance = 75.0 / math.cos(math.radians(20.0))
    for gear, hand in (("pinion", 1.0), ("wheel", -1.0)):
        found["gears"][gear]["helix_angle_deg"] = 20.0 * hand
    found["pairs"]["spur"]["centre_distance_mm"] = distance
    found["bodies"]["shaft_2"]["axis_position_mm"] = [distance, 0.0]
    found["bearings"][f"bearing_{loose[-1]}"]["stiffness"]["axial_N_per_m"] = axial
    return found


@pytest.mark.parametrize("loose", ["shaft_1", "shaft_2"])
def test_a_helical_gear_that_screws_along_its_teeth_is_the_one_that_nothing_holds(loose: str) -> None:
    """Both gears take part in that motion; the other one turns, which it may."""
    gearbox = Gearbox.from_dict(helical(loose), "case.toml")
    assert free_motion(gearbox, "bushing").startswith(f"body {loose} can move along z")
    assert not free_motion(Gearbox.from_dict(helical(loose, 1e6), "case.toml"), "bushing")


@pytest.mark.parametrize(
    ("cold", "hot", "told"), [(100.0, 11.0, False), (32.0, 5.4, False), (150.0, 110.0, True), (1500.0, 11.0, True)]
)
def test_a_viscosity_is_judged_by_the_range_of_its_temperature(cold: float, hot: float, told: bool) -> None:
    """Oils of ISO VG 32 to 150 have 5 to 15 mm2/s at 100 degrees."""
    found = tomllib.loads(SPUR_CASE)
    found["lubricant"] = {"viscosity_40_mm2_per_s": cold, "viscosity_100_mm2_per_s": hot}
    lines = [line for line in gearbox_warnings(Gearbox.from_dict(found, "case.toml")) if "viscosity" in line]
    assert bool(lines) == told
