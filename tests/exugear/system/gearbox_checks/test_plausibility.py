"""Mistakes that a file may well hold are told from the gears' own dimensions; good files raise no alarm."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from exugear.exchange.rexs.containers import read_rexs
from exugear.exchange.rexs.to_case.conversion import to_case
from exugear.exchange.rexs.tree import RexsError
from exugear.gearbox.gearbox import Gearbox
from exugear.system.gearbox_checks import check_parts, gearbox_warnings
from exugear.system.part_warnings import part_warnings, usual_backlash

from ...cases.gear_trains import KINDS

ROOT = Path(__file__).parents[4]
REXS = ROOT / "tests" / "exugear" / "exchange" / "rexs" / "data"


def template(name: str) -> dict[str, Any]:
    return tomllib.loads((files("exugear.gearbox.templates") / f"{name}.toml").read_text(encoding="utf-8"))


def in_grams(content: dict[str, Any]) -> None:
    content["bodies"]["input"]["inertia"]["discs"]["mass_kg"] = 2650.0


def in_tonnes(content: dict[str, Any]) -> None:
    content["bodies"]["input"]["inertia"]["discs"]["mass_kg"] = 2.65e-3


def in_square_millimetres(content: dict[str, Any]) -> None:
    content["bodies"]["output"]["inertia"]["discs"] |= {"axial_kg_m2": 33100.0, "transverse_kg_m2": 27800.0}


def without_a_bearing(content: dict[str, Any]) -> None:
    del content["bearings"]["output_right"]


def further_apart(content: dict[str, Any]) -> None:
    content["pairs"]["helical"]["centre_distance_mm"] = 129.0
    content["bodies"]["output"]["axis_position_mm"] = [129.0, 0.0]


def shifted_the_other_way(content: dict[str, Any]) -> None:
    content["gears"]["pinion"]["profile_shift"] = -0.3


def half_beside(content: dict[str, Any]) -> None:
    content["bodies"]["output"]["gears_z_mm"]["wheel"] = 21.0


def half_a_bearing_bore(content: dict[str, Any]) -> None:
    content["bearings"]["output_left"]["catalogue"]["bore_mm"] = 25.0


def half_a_bore_without_designation(content: dict[str, Any]) -> None:
    content["bearings"]["input_left"]["catalogue"] |= {"bore_mm": 17.5, "designation": ""}


def a_letter_for_a_zero(content: dict[str, Any]) -> None:
    del content["bearings"]["output_left"]["catalogue"]
    content["bearings"]["output_left"]["designation"] = "62O9"


def a_bore_in_metres(content: dict[str, Any]) -> None:
    content["gears"]["planet"]["held_diameter_mm"] = 0.062


def half_a_wheels_bore(content: dict[str, Any]) -> None:
    content["gears"]["wheel"]["held_diameter_mm"] = 45.0


def half_a_pinions_bore(content: dict[str, Any]) -> None:
    content["gears"]["pinion_1"]["held_diameter_mm"] = 18.0


def half_a_planets_bore(content: dict[str, Any]) -> None:
    content["gears"]["planet"]["held_diameter_mm"] = 31.0


def a_rim_of_metres(content: dict[str, Any]) -> None:
    content["gears"]["ring"]["held_diameter_mm"] = 29972.0


MISTAKES: dict[str, tuple[str, Callable[[dict[str, Any]], None], str]] = {
    "mass in g": ("pair", in_grams, "bodies.input.inertia.discs.mass_kg = 2650: a steel cylinder"),
    "mass in t": ("pair", in_tonnes, "bodies.input.inertia.discs.mass_kg = 0.00265: a steel cylinder"),
    "inertia in kg mm2": (
        "pair",
        in_square_millimetres,
        "bodies.output.inertia.discs.axial_kg_m2 = 33100: with 10.5 kg the radius of gyration is 5.61e",
    ),
    "one bearing": ("pair", without_a_bearing, "bodies.output: supported by one bearing (output_left) only"),
    "centre distance": ("pair", further_apart, "pairs.helical.centre_distance_mm = 129: backlash is 926 µm, about"),
    "profile shift": (
        "pair",
        shifted_the_other_way,
        "µm is usual; check the centre distance and the signs of the profile shifts",
    ),
    "faces": (
        "pair",
        half_beside,
        "bodies.output.gears_z_mm.wheel = 21: helical has 20 mm of its face width in mesh, but",
    ),
    "bore of a bearing": (
        "pair",
        half_a_bearing_bore,
        "bearings.output_left.catalogue.bore_mm = 25: with outer_diameter_mm = 90 is not the '6210'",
    ),
    "bore without designation": (
        "pair",
        half_a_bore_without_designation,
        "bearings.input_left.catalogue.bore_mm = 17.5: usual bearings of 72 mm outer diameter have a bore of at least",
    ),
    "designation": (
        "pair",
        a_letter_for_a_zero,
        "bearings.output_left.designation = '62O9': has no known dimensions and is left out; all shafts run aligned on "
        "ideal joints, without bearing loads and lives; did you mean '6209'?",
    ),
    "bore in m": ("planetary", a_bore_in_metres, "gears.planet.held_diameter_mm = 0.062: implausible"),
    "bore of a gear": (
        "pair",
        half_a_wheels_bore,
        "gears.wheel.held_diameter_mm = 45: the bearings on both sides",
    ),
    "bore of a pinion": (
        "parallel",
        half_a_pinions_bore,
        "gears.pinion_1.held_diameter_mm = 18: the bearings on both",
    ),
    "bore of a planet": (
        "planetary",
        half_a_planets_bore,
        ": the face width overlaps by 20 mm with bearings.planet_left at z_mm =",
    ),
    "rim": ("wind", a_rim_of_metres, "gears.ring.held_diameter_mm = 29972: rim thickness 1.445e+04 mm"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_told_with_key_value_and_what_it_is_compared_with(mistake: str) -> None:
    name, change, words = MISTAKES[mistake]
    content = template(name)
    change(content)
    gearbox = Gearbox.from_dict(content)
    check_parts(gearbox)  # possible, all of them
    assert sum(words in line for line in gearbox_warnings(gearbox)) == 1, gearbox_warnings(gearbox)


@pytest.mark.parametrize("name", ["pair", "parallel", "e-axle", "planetary", "wind"])
def test_templates_raise_no_alarm(name: str) -> None:
    assert gearbox_warnings(Gearbox.from_dict(template(name))) == ()


@pytest.mark.parametrize("kind", KINDS)
def test_trains_of_every_kind_raise_no_alarm(kind: str) -> None:
    assert list(part_warnings(Gearbox.from_dict(KINDS[kind]()))) == []


def test_the_reference_gearbox_raises_no_alarm(grc: Gearbox) -> None:
    assert list(part_warnings(grc)) == []


@pytest.mark.parametrize("path", sorted(REXS.glob("*.rexs*")), ids=lambda path: path.name)
def test_imports_raise_no_alarm(path: Path) -> None:
    try:
        gearbox = to_case(read_rexs(path), path.name).gearbox
    except RexsError:
        pytest.skip("refused in words, which the tests of imports hold")
    assert list(part_warnings(gearbox)) == []


def test_seats_beyond_the_shape_of_their_shaft_are_named_with_both_positions() -> None:
    """The high-speed shaft of the GRC cut off after 100 mm, and one of its bearings before its start."""
    path = ROOT / "cases/grc750/gearbox.toml"
    content = tomllib.loads(path.read_text("utf-8"))
    shape = content["bodies"]["hss"]["shape"]
    shape["sections"] = [{**shape["sections"][0], "length_mm": 100.0}]
    start, end = shape["start_z_mm"], shape["start_z_mm"] + 100.0
    content["bearings"]["hss_a"]["z_mm"] = start - 500.0
    gear_z = content["bodies"]["hss"]["gears_z_mm"]["hs_pinion"]
    bearing_z = content["bearings"]["hss_bc"]["z_mm"]
    assert min(gear_z, bearing_z) > end
    found = [line for line in part_warnings(Gearbox.from_dict(content, str(path))) if "beyond the shape of hss" in line]
    assert [line.partition(":")[0] for line in found] == [
        f"bearings.hss_a.z_mm = {start - 500.0:g}",
        f"bearings.hss_bc.z_mm = {bearing_z:g}",
        f"bodies.hss.gears_z_mm.hs_pinion = {gear_z:g}",
    ]
    assert all(f"which extends from {start:g} to {end:g} mm" in line for line in found)


ONE_BEARING = "bodies.output: supported by one bearing (output_left) only"


@pytest.mark.parametrize(
    ("catalogue", "named"),
    [
        ({"type": "tapered_roller", "contact_angle_deg": 14.0}, True),
        ({"type": "tapered_roller", "contact_angle_deg": 14.0, "arrangement": "O"}, False),
        ({"type": "cylindrical_roller"}, True),
        ({"type": "cylindrical_roller", "row_count": 2}, False),
        ({"type": "spherical_roller", "row_count": 2}, True),
    ],
)
def test_a_shaft_on_one_bearing_is_named_unless_its_rows_resist_tilting(catalogue: dict[str, Any], named: bool) -> None:
    content = template("pair")
    without_a_bearing(content)
    sizes = {"bore_mm": 50.0, "outer_diameter_mm": 90.0, "width_mm": 20.0}
    content["bearings"]["output_left"]["catalogue"] = sizes | catalogue
    assert any(line.startswith(ONE_BEARING) for line in part_warnings(Gearbox.from_dict(content))) == named


@pytest.mark.parametrize("has_catalogue", [False, True])
def test_a_shaft_on_one_bearing_with_stated_tilting_stiffness_is_not_named(has_catalogue: bool) -> None:
    content = template("pair")
    without_a_bearing(content)
    if not has_catalogue:
        content["bearings"]["output_left"].pop("catalogue")
    stiff = {"radial_N_per_m": 5e8, "axial_N_per_m": 5e8, "tilt_N_m_per_rad": 1e6}
    content["bearings"]["output_left"]["stiffness"] = stiff
    assert not [line for line in part_warnings(Gearbox.from_dict(content)) if line.startswith("bodies.output")]


def test_backlash_of_the_recommendation_is_that_of_its_formula() -> None:
    """ISO/TR 10064-2: 2/3 (0.06 + 0.0005 a + 0.03 m_n), in mm."""
    pair = Gearbox.from_dict(template("pair")).gear_pairs["helical"]
    assert usual_backlash(pair) == pytest.approx(2e-3 / 3.0 * (0.06 + 0.0005 * 128.0 + 0.03 * 3.0))


def test_a_wheel_narrower_than_the_shaft_that_is_drawn_under_it_is_told():
    """All wheels of the GRC with halved bores; its pinions are one piece with their shafts, at any held diameter."""
    for name, words in (
        ("hs_gear", ".shape is 160 mm there; set the bore of the gear on that shaft"),
        ("im_gear", ".shape is 280 mm there; set the bore of the gear on that shaft"),
    ):
        content = tomllib.loads((ROOT / "cases/grc750/gearbox.toml").read_text("utf-8"))
        content["gears"][name]["held_diameter_mm"] *= 0.5
        found = [*part_warnings(Gearbox.from_dict(content, str(ROOT / "cases/grc750/gearbox.toml")))]
        assert any(name in line and words in line for line in found), found
    for name in ("im_pinion", "hs_pinion"):
        content = tomllib.loads((ROOT / "cases/grc750/gearbox.toml").read_text("utf-8"))
        content["gears"][name]["held_diameter_mm"] *= 0.5
        assert not [*part_warnings(Gearbox.from_dict(content, str(ROOT / "cases/grc750/gearbox.toml")))]


@pytest.mark.parametrize(
    ("excitation", "told"),
    [
        ({"orders": [48], "torque_percent": [0.5]}, ""),
        (
            {"orders": [1], "torque_percent": [0.5]},
            "excitations.ripple: its order 1 turns the gear train by 0.41 mesh cycles at 300 rpm of input; low orders "
            "are far too high without the inertias of the connected machines",
        ),
        (
            {"orders": [96], "torque_N_m": [150.0]},
            "excitations.ripple: amplitude of 150 N m on input at 3000 rpm, above the static torque of 100 N m, so "
            "that teeth lose contact; check the unit",
        ),
        ({"z_mm": -28.9, "unbalance_g_mm": 35.0}, ""),
        (
            {"z_mm": -28.9, "unbalance_g_mm": 6.3},
            "excitations.ripple.unbalance_g_mm = 6.3: looks like a balance quality grade; G 6.3 of 1.74 kg at 3000 rpm "
            "permits 34.9 g mm",
        ),
        (
            {"z_mm": -28.9, "unbalance_g_mm": 3500.0},
            "excitations.ripple.unbalance_g_mm = 3500: balance quality grade G 632 of 1.74 kg at 3000 rpm "
            "(ISO 21940-11); check the unit",
        ),
    ],
)
def test_stated_loads_are_compared_with_static_torque_inertia_and_balance_grades(excitation, told):
    """Without machines, the inertia at the input is 3e-3 kg m2; U = 9549 G m / n by ISO 21940-11."""
    content = template("parallel") | {"excitations": {"ripple": {"body": "input"} | excitation}}
    found = [line for line in gearbox_warnings(Gearbox.from_dict(content)) if "excitations" in line]
    assert len(found) == (1 if told else 0)
    assert all(line.startswith(told) for line in found)


def test_the_inertia_of_the_machine_silences_the_warning_about_low_orders():
    content = template("parallel") | {"excitations": {"ripple": {"body": "rotor", "orders": [6], "torque_N_m": [2.0]}}}
    content["bodies"]["rotor"] = {"spin_only": True, "inertia": {"discs": {"axial_kg_m2": 0.2}}}
    content["couplings"] = {"shaft": {"bodies": ["rotor", "input"], "stiffness_N_m_per_rad": 2e4}}
    assert not any("excitations" in line for line in gearbox_warnings(Gearbox.from_dict(content)))
    content["bodies"]["rotor"]["inertia"]["discs"]["axial_kg_m2"] = 1e-4
    assert any("connected machines" in line for line in gearbox_warnings(Gearbox.from_dict(content)))


def test_a_table_that_does_not_cover_the_operating_speeds_is_told(tmp_path: Path):
    (tmp_path / "ripple.csv").write_text("speed_rpm,order,amplitude_N_m\n0,96,0.5\n2000,96,0.5\n", encoding="utf-8")
    content = template("parallel") | {"excitations": {"ripple": {"body": "input", "table": "ripple.csv"}}}
    found = gearbox_warnings(Gearbox.from_dict(content, str(tmp_path / "gearbox.toml")))
    told = "excitations.ripple.table: covers 0 to 2000 rpm of input, which turns at 300 to 3000 rpm"
    assert [line for line in found if line.startswith(told)]
