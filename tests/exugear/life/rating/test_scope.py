"""What a rating sheet needs and where the standard ends: no bearings, and teeth never alone in contact."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path
from typing import Any

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.life.losses import losses_of
from exugear.life.rating.lacks import missing_for_life
from exugear.project import Project

from ...cases.case_mutations import toml_text
from ...cases.command import exugear
from ...cases.spur import SPUR_CASE

STRENGTH = {
    "sigma_H_lim_MPa": 1500.0,
    "sigma_F_lim_MPa": 430.0,
    "curve": "case_hardened",
    "roughness_Rz_um": 4.8,
    "root_factor": 1.0,
}


def rated(**changes: Any) -> dict[str, Any]:
    content = tomllib.loads(SPUR_CASE)
    content["operation"] = {"rated_speed_rpm": 1000.0}
    content["rating"] = {"dynamic_factor": 1.0, "gears": {"pinion": STRENGTH, "wheel": STRENGTH}}
    content["lubricant"] = {
        "viscosity_40_mm2_per_s": 220.0,
        "viscosity_100_mm2_per_s": 19.0,
        "temperature_C": 70.0,
    }
    return content | changes


def without_bearings() -> dict[str, Any]:
    content = rated()
    del content["bearings"], content["housing"]
    return content


def low_loss() -> dict[str, Any]:
    """Low-loss gears as those of the FZG rig (H951: 38/57 teeth, module 1.75 mm, eps_alpha 0.93, eps_beta 1.08)."""
    rack = {"addendum": 0.545, "dedendum": 0.8, "tip_radius": 0.3}
    common = {
        "normal_module_mm": 1.75,
        "face_width_mm": 23.0,
        "rack": rack,
        "tooth_thinning_mm": 0.03,
        "normal_pressure_angle_deg": 20.0,
    }
    content = rated()
    distance = 0.5 * 95 * 1.75 / math.cos(math.radians(15.0))
    content["gears"] = {
        "pinion": {"teeth": 38, "helix_angle_deg": 15.0, "held_diameter_mm": 40.0, **common},
        "wheel": {"teeth": 57, "helix_angle_deg": -15.0, "held_diameter_mm": 60.0, **common},
    }
    content["pairs"]["spur"]["centre_distance_mm"] = distance
    content["bodies"]["shaft_2"]["axis_position_mm"] = [distance, 0.0]
    return content


def test_a_pair_without_bearings_is_rated_on_ideal_joints(tmp_path: Path) -> None:
    """K_gamma = 1, no misalignment; the same as on bearings so stiff that neither deflects."""
    alone = Gearbox.from_dict(without_bearings())
    assert missing_for_life(alone)["check --rating"] == ()
    stiff = rated()
    for bearing in stiff["bearings"].values():
        bearing["stiffness"] = {"radial_N_per_m": 1e13, "axial_N_per_m": 1e13, "tilt_N_m_per_rad": 1e12}
    sheets = [Project(one, tmp_path).rating() for one in (alone, Gearbox.from_dict(stiff))]
    for one, other in zip(sheets[0].flanks, sheets[1].flanks, strict=True):
        assert one.standard["K_gamma"] == 1.0
        assert one.standard["F_betax"] == 0.0
        for name in ("S_H", "S_F", "K_Hbeta"):
            assert one.standard[name] == pytest.approx(other.standard[name], rel=1e-3)
    assert "gears are on ideal joints: the gearbox file has no [bearings]" in " ".join(sheets[0].assumptions)
    case = tmp_path / "pair.toml"
    case.write_text(toml_text(without_bearings()), encoding="utf-8")
    outcome = exugear("check", case, "--rating", "--json")
    assert outcome.exit_code == 0, outcome.stderr
    assert len(json.loads(outcome.stdout)["rating"]["flanks"]) == 2


def test_teeth_never_alone_in_contact_are_outside_the_scope_of_the_standard(tmp_path: Path) -> None:
    gearbox = Gearbox.from_dict(low_loss())
    assert gearbox.gear_pairs["spur"].transverse_contact_ratio < 1.0
    sheet = Project(gearbox, tmp_path).rating()
    assert sheet.flanks == ()
    assert any("outside the scope of ISO 6336" in line for line in sheet.left_out)


def test_the_loss_factor_of_low_loss_gears_is_the_mean_sliding_over_the_path_of_contact() -> None:
    """H_V of a constant load per length: mean distance from the pitch point over half a base pitch (Ohlendorf)."""
    gearbox = Gearbox.from_dict(low_loss())
    pair = gearbox.gear_pairs["spur"]
    (mesh,) = losses_of(gearbox, (), {}, 100.0).meshes
    pitch = pair.path_pitch_point
    first, second = pair.path_end - pitch, pitch - pair.path_start
    mean = 0.5 * (first**2 + second**2) / (first + second)
    sliding = mean * (1.0 / pair.pinion.base_radius + 1.0 / pair.gear.base_radius)
    assert mesh.loss_factor == pytest.approx(sliding / math.cos(pair.pinion.base_helix_angle), rel=1e-9)
    assert mesh.loss_factor < 0.1
