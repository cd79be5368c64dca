"""Allowances of the tooth thickness (DIN 3967) in the gearbox file: what teeth, backlash and `check` make of them."""

from __future__ import annotations

import json
import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.templates.kinds import template
from exugear.system.part_warnings import backlash_range, thickness_range

from ..cases.command import exugear

HELIX = math.radians(12.0)
ALLOWANCES = {"upper_allowance_um": -70.0, "lower_allowance_um": -110.0}


def content(**thickness: Any) -> dict[str, Any]:
    """Template of a pair at its reference centre distance, whose pinion has allowances and whose wheel none at all."""
    found = tomllib.loads(template("pair"))
    for gear in found["gears"].values():
        del gear["tooth_thinning_mm"], gear["profile_shift"]
    found["gears"]["pinion"]["tooth_thickness"] = thickness or ALLOWANCES
    return placed(found, 0.5 * (24 + 59) * 3.0 / math.cos(HELIX))


def placed(found: dict[str, Any], distance: float) -> dict[str, Any]:
    found["pairs"]["helical"]["centre_distance_mm"] = distance
    found["bodies"]["output"]["axis_position_mm"] = [distance, 0.0]
    return found


def gearbox_of(**thickness: Any) -> Gearbox:
    return Gearbox.from_dict(content(**thickness), "case.toml")


def test_teeth_have_the_mean_of_their_allowances_in_the_normal_section():
    gear = gearbox_of().gears["pinion"]
    full = replace(gear, tooth_thinning=0.0)
    assert full.normal_tooth_thickness - gear.normal_tooth_thickness == pytest.approx(90e-6, rel=1e-9)
    assert gear.tooth_thinning == pytest.approx(90e-6 / math.cos(HELIX), rel=1e-12)
    assert gearbox_of(upper_allowance_um=-70.0, tolerance_um=40.0).gears["pinion"] == gear


def test_backlash_follows_from_the_allowances():
    """At the reference centre distance the transverse backlash is the normal allowance over cos(beta)."""
    gearbox = gearbox_of()
    found = backlash_range(gearbox, next(iter(gearbox.gear_pairs.values())))
    assert found == pytest.approx([amount / math.cos(HELIX) for amount in (70e-6, 90e-6, 110e-6)], rel=1e-6)


def test_the_ends_of_backlash_are_those_of_pairs_with_the_thickest_and_the_thinnest_teeth():
    gearbox = Gearbox.from_dict(shifted(), "case.toml")
    least, given, most = backlash_range(gearbox, gearbox.gear_pairs["helical"])
    for allowance, expected in ((-70.0, least), (-90.0, given), (-110.0, most)):
        other = shifted()
        other["gears"]["pinion"]["tooth_thickness"] = {"upper_allowance_um": allowance, "tolerance_um": 0.0}
        pair = Gearbox.from_dict(other, "case.toml").gear_pairs["helical"]
        assert pair.circumferential_backlash == pytest.approx(expected, rel=1e-9)


def shifted() -> dict[str, Any]:
    """The same pair at a larger centre distance: backlash then grows with the working circles."""
    found = content()
    return placed(found, found["pairs"]["helical"]["centre_distance_mm"] + 0.2)


def test_an_inspector_finds_the_allowances_in_the_base_tangent_length():
    """DIN 3967: A_W = A_sn cos(alpha_n)."""
    gearbox = gearbox_of()
    found = thickness_range(gearbox, "pinion")
    assert found.thickness[1] - found.thickness[0] == pytest.approx(40e-6, rel=1e-9)
    assert found.span_teeth is not None
    cosine = math.cos(gearbox.gears["pinion"].normal_pressure_angle)
    assert found.span[1] - found.span[0] == pytest.approx(40e-6 * cosine, rel=1e-9)


def test_a_span_that_needs_a_wider_face_is_told():
    """One plane touches W_k sin(beta_b) along the axis from the other; a face as wide as that is not enough."""
    found = content()
    pinion = gearbox_of().gears["pinion"]
    full = replace(pinion, tooth_thinning=70e-6 / math.cos(HELIX))
    needed = 1e3 * full.span_measurement(3) * math.sin(full.base_helix_angle)
    assert thickness_range(gearbox_of(), "pinion").span_teeth == 3
    for width, doubt in ((needed + 0.01, ""), (needed - 0.01, "too narrow for the base tangent length over 3 teeth")):
        found["gears"]["pinion"]["face_width_mm"] = width
        told = thickness_range(Gearbox.from_dict(found, "case.toml"), "pinion").span_warning
        assert doubt in told and bool(doubt) == bool(told)


def test_check_tells_thickness_span_and_backlash(tmp_path: Path):
    path = tmp_path / "case.toml"
    text = template("pair")
    assert "tooth_thinning_mm = 0.06 " in text
    head, tail = text.split("tooth_thinning_mm = 0.06", 1)
    path.write_text(
        f"{head}tooth_thickness = {{ upper_allowance_um = -50, tolerance_um = 30 }} #{tail}", encoding="utf-8"
    )
    told = exugear("check", path, "--all")
    assert told.exit_code == 0, told.output
    assert "Tooth thickness within its allowances" in told.output
    assert "base tangent" in told.output
    found = json.loads(exugear("check", path, "--json").stdout)
    least, given, most = found["pairs"][0]["backlash_um"]
    assert 0.0 < least < given < most
    thin, thick = found["tooth_thickness"][0]["normal_tooth_thickness_mm"]
    assert thick - thin == pytest.approx(0.03, abs=1e-9)


@pytest.mark.parametrize(
    ("thickness", "message"),
    [
        ({"upper_allowance_um": -70.0}, "set lower_allowance_um or tolerance_um in addition to upper_allowance_um"),
        (
            {**ALLOWANCES, "tolerance_um": 40.0},
            "set lower_allowance_um or tolerance_um in addition to upper_allowance_um",
        ),
        ({"upper_allowance_um": -70.0, "lower_allowance_um": -40.0}, "lower_allowance_um = -40 must not be above"),
        ({"upper_allowance_um": 30.0, "tolerance_um": 10.0}, "must lie between -20000 and 0"),
    ],
)
def test_allowances_that_cannot_be_are_refused(thickness: dict[str, float], message: str):
    with pytest.raises(GearboxFileError, match=message):
        gearbox_of(**thickness)


def test_a_thinning_beside_allowances_is_refused():
    both = content()
    both["gears"]["pinion"]["tooth_thinning_mm"] = 0.1
    with pytest.raises(GearboxFileError, match="gears.pinion: set tooth_thinning_mm or a .* table, not both"):
        Gearbox.from_dict(both, "case.toml")
