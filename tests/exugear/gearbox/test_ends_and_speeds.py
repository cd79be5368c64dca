"""Inputs that are possible but hardly meant: ends without torque, speeds above limits, shapes in two pieces."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import missing_torque_warning
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.units import MM, RPM
from exugear.system.gearbox_checks import check_parts, gearbox_warnings

from ..cases.gear_trains import differential
from ..cases.spur import SPUR_CASE

SHAPE: dict[str, Any] = {
    "start_z_mm": -40.0,
    "sections": [
        {"length_mm": 40.0, "outer_diameter_mm": 30.0},
        {"length_mm": 40.0, "outer_diameter_mm": 60.0, "inner_diameter_mm": 40.0},
    ],
}


def spur(**tables: Any) -> Gearbox:
    return Gearbox.from_dict(tomllib.loads(SPUR_CASE) | {"operation": {"rated_speed_rpm": 3000.0}} | tables)


def warnings_about(gearbox: Gearbox, key: str) -> list[str]:
    return [line for line in gearbox_warnings(gearbox) if line.startswith(key)]


@pytest.mark.parametrize("left_out", ["ring", "carrier"])
def test_an_output_of_a_differential_without_torque_is_questioned(left_out: str) -> None:
    content = differential()
    (name,) = content["load_cases"]
    torques = content["load_cases"][name]["torques_N_m"]
    whole = Gearbox.from_dict(content)
    assert missing_torque_warning(whole, whole.load_cases[name]) == ""
    del torques[left_out]
    gearbox = Gearbox.from_dict(content)
    said = missing_torque_warning(gearbox, gearbox.load_cases[name])
    assert said.startswith(f"no torque on {left_out}: the gear train has 2 degrees of freedom")
    torques[left_out] = 0.0
    stated = Gearbox.from_dict(content)
    assert missing_torque_warning(stated, stated.load_cases[name]) == ""


def test_a_seal_faster_than_its_material_permits_is_warned_about() -> None:
    """v = d / 2 omega: 3750 rpm (1.25 of rated) on 80 mm are 15.7 m/s, above 14 m/s of nitrile rubber."""
    speed = 0.5 * MM * 80.0 * 3750.0 * RPM
    assert speed == pytest.approx(15.7, abs=0.05)
    seal: dict[str, Any] = {"body": "shaft_1", "diameter_mm": 80.0}
    (said,) = warnings_about(spur(seals={"input": seal}, load_cases={}), "seals.input")
    assert "slides at 15.7 m/s at 3750 rpm of shaft_1, above 14 m/s usual for nitrile rubber" in said
    assert not warnings_about(spur(seals={"input": seal | {"diameter_mm": 70.0}}, load_cases={}), "seals")
    assert not warnings_about(spur(seals={"input": seal | {"speed_limit_m_per_s": 35.0}}, load_cases={}), "seals")
    slow = {"body": "shaft_2", "diameter_mm": 80.0}
    assert not warnings_about(spur(seals={"output": slow}, load_cases={}), "seals")


def test_a_bearing_faster_than_its_catalogue_permits_is_warned_about() -> None:
    bearings = tomllib.loads(SPUR_CASE)["bearings"]
    own = {"body": "shaft_1", "z_mm": 0.0, "catalogue": {"designation": "6307", "speed_limit_rpm": 3700.0}}
    (said,) = warnings_about(spur(bearings=bearings | {"bearing_1": own}, load_cases={}), "bearings.bearing_1: turns")
    assert "turns at 3750 rpm at 3750 rpm of shaft_1, above speed_limit_rpm = 3700" in said
    own["catalogue"]["speed_limit_rpm"] = 3800.0
    assert not warnings_about(spur(bearings=bearings | {"bearing_1": own}, load_cases={}), "bearings.bearing_1: turns")


@pytest.mark.parametrize("flexibility", ["none", "elastic"])
def test_a_shape_in_two_pieces_is_refused_whether_or_not_it_is_flexible(flexibility: str) -> None:
    bodies = tomllib.loads(SPUR_CASE)["bodies"]
    bodies["shaft_1"] |= {"shape": SHAPE, "flexibility": flexibility}
    with pytest.raises(GearboxFileError, match=r"bodies.shaft_1.shape: sections 1 and 2 are not connected"):
        check_parts(spur(bodies=bodies))
