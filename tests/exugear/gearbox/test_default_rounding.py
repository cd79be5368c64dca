"""The default radius at the tip of the tool is no larger than what fits; a radius of the file is refused instead."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from exugear.gearbox.gear_parts import with_usual_rounding
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.sections.case import GearboxFile
from exugear.system.gearbox_checks import gearbox_warnings
from fe_ste.geometry.gear_relations import BasicRack, GearInputs

from ..cases.spur import SPUR_CASE


def content(**of_gears: Any) -> dict[str, Any]:
    found = tomllib.loads(SPUR_CASE)
    for gear in found["gears"].values():
        gear |= of_gears
    return found


def test_gears_of_25_degrees_have_the_largest_rounding_that_fits() -> None:
    """By hand: (pi / 4 - 1.25 tan 25 deg) cos 25 deg / (1 - sin 25 deg) = 0.318 normal modules."""
    gearbox = Gearbox.from_dict(content(normal_pressure_angle_deg=25.0), "case.toml")
    assert [gear.rack.tip_radius for gear in gearbox.gears.values()] == pytest.approx([0.318, 0.318], abs=1e-3)
    told = [line for line in gearbox_warnings(gearbox) if "rack.tip_radius" in line]
    assert len(told) == 2 and all(
        "the default of 0.38" in line and ", the largest possible value, is used" in line for line in told
    )


@pytest.mark.parametrize("rack", [{"tip_radius": 0.38}, {"tip_radius": 0.32}])
def test_a_radius_of_the_file_is_refused_where_it_does_not_fit(rack: dict[str, float]) -> None:
    with pytest.raises(GearboxFileError, match=r"rack.tip_radius = .* does not fit on the rack .* at most 0\.31"):
        Gearbox.from_dict(content(normal_pressure_angle_deg=25.0, rack=rack), "case.toml")


@pytest.mark.parametrize("gears", [{}, {"rack": {"dedendum": 1.4}}, {"normal_pressure_angle_deg": 14.5}])
def test_the_default_stays_where_it_fits(gears: dict[str, Any]) -> None:
    gearbox = Gearbox.from_dict(content(**gears), "case.toml")
    assert {gear.rack.tip_radius for gear in gearbox.gears.values()} == {0.38}
    assert not [line for line in gearbox_warnings(gearbox) if "rack.tip_radius" in line]


def test_a_ring_of_very_low_teeth_has_a_rounding_of_half_their_height() -> None:
    """Teeth of 0.3 normal modules in height have no room for 0.38."""
    ring = GearInputs(
        name="ring", teeth=61, normal_module=3e-3, face_width=0.02, held_diameter=0.22, internal=True,
        rack=BasicRack(0.1, 0.2),
    )  # fmt: skip
    section = GearboxFile.model_validate(content(rack={"addendum": 0.1, "dedendum": 0.2})).gears["wheel"]
    assert with_usual_rounding(section, ring).rack.tip_radius == pytest.approx(0.15, abs=1e-3)
