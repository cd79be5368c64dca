"""The gearbox file: what it yields and what it refuses."""

from __future__ import annotations

import copy
import math
import tomllib
from pathlib import Path

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError

CASE = Path(__file__).parents[3] / "cases" / "grc750" / "gearbox.toml"


@pytest.fixture
def content() -> dict:
    return copy.deepcopy(tomllib.loads(CASE.read_text(encoding="utf-8")))


def test_static_torques_follow_from_the_train(grc: Gearbox) -> None:
    # Gear 1 of each pair: sun 240/5.714/3 kNm, planet x 39/21, IMS 240/(5.714 x 3.565), HSS 240/81.49.
    torque = {name: pair.static_torque for name, pair in grc.pairs.items()}
    assert torque["sun_planet"] == pytest.approx(14000.0, rel=1e-12)
    assert torque["ring_planet"] == pytest.approx(26000.0, rel=1e-12)
    assert torque["intermediate"] == pytest.approx(240e3 / (120 / 21 * 82 / 23), rel=1e-12)
    assert torque["high_speed"] == pytest.approx(240e3 / grc.train.ratio, rel=1e-12)


@pytest.mark.parametrize("inertias", ["assemblies", "gears"])
def test_both_inertia_sets_need_thirty_seconds_to_215_rpm(grc: Gearbox, inertias: str) -> None:
    spins = grc.train.rolling_speeds("carrier", 1.0)
    referred = sum(
        body.axial * spins[body.name] ** 2 + (body.mass * 0.308**2 if body.carrier else 0.0)
        for body in grc.bodies(inertias)
        if not body.fixed
    )
    seconds = referred * 215 * math.pi / 30 / (3000 * grc.train.ratio - 240e3)
    assert seconds == pytest.approx(30.0, rel=3e-3)  # the brake's inertia is written with two digits


def test_planets_are_expanded_and_ride_on_the_carrier(grc: Gearbox) -> None:
    planet = grc.body("planet_2")
    assert math.hypot(*planet.axis) == pytest.approx(0.308)
    assert planet.orbit_angle == pytest.approx(2 * math.pi / 3)
    assert [mesh.frame for mesh in grc.meshes] == ["carrier"] * 6 + ["ground"] * 2
    assert len(grc.joints) == 7
    assert sum(bearing.on == "carrier" for bearing in grc.bearings) == 6


def test_option_brings_the_rotor_and_its_shaft(grc: Gearbox) -> None:
    assert "rotor" not in grc.spinning
    varied = grc.varied({"bodies.rotor.enabled": True})
    assert "rotor" in varied.spinning
    assert [coupling.name for coupling in varied.couplings] == ["brake_coupling", "main_shaft"]


def test_option_brings_the_main_shaft_which_rolls_with_the_carrier(grc: Gearbox) -> None:
    varied = grc.varied({"bodies.main_shaft.enabled": True})
    assert [coupling.name for coupling in varied.couplings] == ["brake_coupling", "shrink_disc_torsion"]
    assert {bearing.name for bearing in varied.bearings if bearing.body == "main_shaft"} == {
        "main_bearing",
        "shrink_disc",
    }
    speeds = varied.train.rolling_speeds("main_shaft", 2.0)
    assert speeds["carrier"] == pytest.approx(2.0, rel=1e-12)
    assert speeds["hss"] == pytest.approx(2.0 * grc.train.ratio, rel=1e-12)
    # The torque comes in at the hub: meshes carry the same.
    driven = varied.varied({"static_load.torques_N_m": {"main_shaft": 240e3}})
    assert driven.train.static_mesh_forces() == pytest.approx(grc.train.static_mesh_forces(), rel=1e-9)


def test_the_springs_that_stand_for_the_main_shaft_do_not_act_beside_it(grc: Gearbox) -> None:
    assert [mount.name for mount in grc.mounts] == ["arm_left", "arm_right", "main_shaft_support"]
    assert [m.name for m in grc.varied({"bodies.main_shaft.enabled": True}).mounts] == ["arm_left", "arm_right"]
    # The body has its rotor: a second one has nothing left to hold on to.
    with pytest.raises(GearboxFileError, match="main_shaft is disabled while bodies.main_shaft is enab"):
        grc.varied({"bodies.main_shaft.enabled": True, "bodies.rotor.enabled": True})


def test_two_paths_of_torsion_are_named(grc: Gearbox) -> None:
    both = {"bodies.main_shaft.enabled": True, "bodies.rotor.enabled": True}
    hub = {"bodies": ["main_shaft", "rotor"], "stiffness_N_m_per_rad": 1e9}
    joined = {"bodies": ["rotor", "carrier"], "stiffness_N_m_per_rad": 8e7}
    with pytest.raises(
        GearboxFileError,
        match="couplings hub, shrink_disc_torsion, main_shaft form a loop:",
    ):
        order = {name: grc.content["couplings"][name] for name in ("brake_coupling", "shrink_disc_torsion")}
        grc.varied({**both, "couplings": {**order, "hub": hub, "main_shaft": joined}})
    with pytest.raises(
        GearboxFileError, match="09 N m/rad between carrier and main_shaft, which both rotate; set it in a"
    ):
        grc.varied({"bodies.main_shaft.enabled": True, "bearings.shrink_disc.stiffness": {"torsion_N_m_per_rad": 1e9}})


def _set(content: dict, dotted: str, value: object) -> dict:
    *parents, last = dotted.split(".")
    section = content
    for part in parents:
        section = section[part]
    section[last] = value
    return content


@pytest.mark.parametrize(
    ("dotted", "value", "words"),
    [
        ("gears.sun.teeth", 2, ["gears.sun.teeth = 2", "between 5 and 2000"]),
        ("gears.sun.theeth", 21, ["gears.sun.theeth = 21", "did you mean 'teeth'?"]),
        ("bearings.hss_a.catalogue.type", "tapered_rolle", ["did you mean 'tapered_roller'?"]),
        ("gears.sun.face_width_mm", -1.0, ["gears.sun.face_width_mm = -1.0", "between 0.1 and 5000"]),
        ("gears.sun.helix_angle_deg", -7.495, ["pairs.sun_planet"]),
        ("pairs.high_speed.pinion", "nobody", ["pairs.high_speed.pinion = 'nobody'", "hs_pinion"]),
        ("pairs.high_speed.centre_distance_mm", 285.2, ["285.2", "285.0001 mm apart"]),
        ("bodies.hss.axis_position_mm", [0.0, 521.0], ["pairs.high_speed.centre_distance_mm", "apart"]),
        ("bodies.planet.planet_angles_deg", [0.0, 121.0, 240.0], ["cannot be assembled", "3.0000 deg"]),
        ("bodies.planet.planet_angles_deg", [0.0, 60.0, 240.0], ["collide"]),
        ("bodies.hss.inertia.assemblies.axial_kg_m2", 8.0, ["triangle inequality"]),
        ("bodies.hss.inertia.assemblies.mass_kg", 0.0, ["mass_kg = 0.0", "between 1e-06 and 1e+07"]),
        ("bodies.brake.inertia.gears", {}, ["bodies.brake.inertia.gears.axial_kg_m2", "missing"]),
        (
            "couplings.brake_coupling.bodies",
            ["hss", "hss"],
            [
                "brake",
                "; the gear train must be connected. A body held only by",
            ],
        ),
        ("couplings.brake_coupling.seat", "hss_x", ["couplings.brake_coupling.seat = 'hss_x'", "hss_bc"]),
        ("couplings.brake_coupling.instead_of", "nobody", ["couplings.brake_coupling.instead_of", "'nobody'"]),
        ("couplings.hss_a", {"bodies": ["hss", "ims"], "stiffness_N_m_per_rad": 1.0}, ["couplings.hss_a", "rename"]),
        ("bearings.hss_a.body", "nobody", ["bearings.hss_a", "'nobody'"]),
        ("joints.hss.body", "ims", ["joints.hss.body = 'ims'", "redundant"]),
        ("meshes.high_speed.position_angle_deg", 10.0, ["position_angle_deg = 10.0", "-30.2066"]),
        ("meshes.sun_planet.phase", [0.1, 0.2], ["3 meshes require 3 phases"]),
        ("static_load.locked", [], ["does not balance the torques"]),
        ("load_cases.reference.torques_N_m", {"nobody": 1.0}, ["load_cases.reference", "'nobody'"]),
        ("overall.output", "housing", ["overall.output = 'housing'"]),
        ("housing.factor", 0.0, ["housing.factor = 0.0"]),
        ("gears.sun.profile_shift", math.nan, ["gears.sun.profile_shift"]),
    ],
)
def test_wrong_input_is_named(content: dict, dotted: str, value: object, words: list[str]) -> None:
    with pytest.raises(GearboxFileError) as caught:
        Gearbox.from_dict(_set(content, dotted, value), "case.toml")
    message = str(caught.value)
    assert message.startswith("case.toml: ")
    for word in words:
        assert word in message


def test_incomplete_inertia_set_is_named(content: dict) -> None:
    del content["bodies"]["ims"]["inertia"]["gears"]
    with pytest.raises(GearboxFileError, match="bodies.ims.inertia: no set 'gears'"):
        Gearbox.from_dict(content)


@pytest.mark.parametrize(
    ("text", "words"),
    [("", "the file is empty"), ("name = \n", "line 1"), ("name = 'x'\n", "this key is missing")],
)
def test_unreadable_files_are_one_clear_message(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "broken.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(GearboxFileError, match=words) as caught:
        Gearbox.from_toml(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("line", "remedy"),
    [
        ("held_diameter_mm = 36,0", "'held_diameter_mm = 36,0'; numbers have a decimal point: write 36.0"),
        ("place = { z_mm = -1,5, body = 3 }", "numbers have a decimal point: write -1.5"),
        ("body = input  # of the motor", '; text needs quotes: "input"'),
        ("fixed = True", "; write true"),
        ("teeth 21", "'teeth 21'"),
    ],
)
def test_a_line_that_is_not_toml_is_quoted_with_its_remedy(tmp_path: Path, line: str, remedy: str) -> None:
    path = tmp_path / "broken.toml"
    path.write_text(f"name = 'x'\n{line}\n", encoding="utf-8")
    with pytest.raises(GearboxFileError) as caught:
        Gearbox.from_toml(path)
    assert "(at line 2, column " in str(caught.value)
    assert str(caught.value).endswith(remedy)


@pytest.mark.parametrize(
    ("key", "example"),
    [
        (["static_load"], 'static_load = { torques_N_m = { carrier = 240000.0 }, locked = ["hss"] }'),
        (["name"], 'name = "GRC 750 kW"'),
        (["overall", "output"], 'output = "hss"'),
        (["gears", "sun", "teeth"], "teeth = 21"),
    ],
)
def test_a_missing_key_is_told_with_an_example(content: dict, key: list[str], example: str) -> None:
    table = content
    for part in key[:-1]:
        table = table[part]
    del table[key[-1]]
    with pytest.raises(GearboxFileError) as caught:
        Gearbox.from_dict(content)
    expected = f"{'.'.join(key)}: this key is missing; for example {example}"
    assert [error for error in caught.value.errors if error.endswith(expected)], caught.value.errors


def test_missing_and_binary_files_are_one_clear_message(tmp_path: Path) -> None:
    with pytest.raises(GearboxFileError, match="no such file"):
        Gearbox.from_toml(tmp_path / "nowhere.toml")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(GearboxFileError, match="not UTF-8"):
        Gearbox.from_toml(binary)
