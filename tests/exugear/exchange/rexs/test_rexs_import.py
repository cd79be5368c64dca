"""Gearboxes of other programs are imported with their numbers, or refused by name; what is assumed is marked."""

from __future__ import annotations

import dataclasses
import json
import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from exugear.exchange.rexs.containers import read_rexs
from exugear.exchange.rexs.parsing import parse_model
from exugear.exchange.rexs.to_case.conversion import to_case
from exugear.exchange.rexs.tree import Attribute, RexsError
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.designations import boundary_of
from exugear.system.gearbox_checks import lacking

from ...cases.command import exugear

DATA = Path(__file__).parent / "data"
SEW = "SEW_3-stage_cylindrical_gearbox_1.0.rexs"
INDUSTRIAL = "FVA-Industriegetriebe_2_stufig_1-6.rexs"
PLANETARY = "FVA_Planetary_stage_-_Minus_gearing_1.1.rexs"
IMPORTED = {
    SEW: -23 * 13 * 14 / (67 * 76 * 87),
    INDUSTRIAL: 27 * 23 / (51 * 34),
    "FVA-Industriegetriebe_2stufig_1-4.rexs": 27 * 23 / (51 * 34),
    "FVA-Industriegetriebe_2stufig_1-4.rexsj": 27 * 23 / (51 * 34),
    PLANETARY: 17 / (17 + 61),
    "FVA_Planetary_stage_-_Minus_gearing_1.1.rexsz": 17 / (17 + 61),
    "FVA_Planetary_stage_-_Minus_gearing_1.1_vers2.rexsj": 17 / (17 + 61),
}
"""Speed of the output over that of the input, from the numbers of teeth."""
REFUSED = {
    "FVA_worm_stage_1-4.rexs": "worm_stage 3 'Schneckenstufe [3]', .*: worm gears cannot be imported",
    "FVA_worm_stage_1-4.rexsj": "worm_stage 15 'Schneckenstufe [3]', .*: worm gears cannot be imported",
    "FVA_Planetary_stage_-_Minus_gearing_1.1.rexsj": "positions are not three numbers for .* arrays were lost",
    "example_xml.rexs.zip": "no stage of two cylindrical gears",
    "example_json.rexs.zip": "no stage of two cylindrical gears",
}


@pytest.fixture(scope="module")
def imported():
    known = {}

    def of(name):
        if name not in known:
            known[name] = to_case(read_rexs(DATA / name), name)
        return known[name]

    return of


def edited(name, *changes):
    """Import a file whose text was changed first."""
    text = (DATA / name).read_text(encoding="utf-8-sig")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return to_case(parse_model(text.encode()), name)


def test_every_file_is_imported_or_refused():
    names = {path.name for path in DATA.iterdir() if path.suffix not in (".txt", ".md")}
    assert names == {*IMPORTED, *REFUSED}


@pytest.mark.parametrize("name", IMPORTED)
def test_the_train_rolls_as_its_teeth_say(name, imported):
    gearbox = imported(name).gearbox
    assert gearbox.train.ratio == pytest.approx(IMPORTED[name], rel=1e-12)
    assert lacking(gearbox, "rigid") == ""


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_gearbox_of_cylindrical_gears_is_refused_by_name(name):
    with pytest.raises(RexsError, match=REFUSED[name].replace("[", r"\[").replace("]", r"\]")) as refusal:
        to_case(read_rexs(DATA / name), name)
    assert len(refusal.value.errors) == 1


@pytest.mark.parametrize("name", IMPORTED)
def test_centre_distances_are_those_of_the_file_and_of_its_positions(name, imported):
    """Three ways: the attribute, the positions of the gears, and the bodies of the finished gearbox."""
    model, gearbox = read_rexs(DATA / name), imported(name).gearbox
    stated = {
        round(stage.quantity("center_distance", "mm"), 9) for stage in model.components_of_type("cylindrical_stage")
    }
    assert {round(1e3 * pair.pair.centre_distance, 9) for pair in gearbox.pairs.values()} == stated
    for mesh in gearbox.meshes:  # positions of the files have 11 digits and more
        assert mesh.centre_distance == pytest.approx(mesh.pair.centre_distance, abs=1e-9)
    for pair in gearbox.pairs.values():
        clearance = pair.pair.centre_distance - pair.pair.backlash_free_centre_distance
        thinned = sum(gear.tooth_thinning for gear in (pair.pair.pinion, pair.pair.gear))
        outward = pair.pair.gear.outward
        # Thinning alone makes the backlash, to first order thinning / (2 tan alpha_wt) along the line of centres;
        # shifts are rounded to 1e-4.
        expected = outward * 0.5 * thinned / math.tan(pair.pair.working_pressure_angle)
        assert clearance == pytest.approx(expected, abs=0.05 * thinned + 1e-4 * pair.pair.pinion.normal_module)


def test_numbers_of_gears_are_those_of_the_file(imported):
    gears = imported(SEW).gearbox.gears
    assert [gear.teeth for gear in gears.values()] == [23, 67, 13, 76, 14, 87]
    assert [gear.profile_shift for gear in gears.values()] == [0.581, 0.5131, 0.521, -0.094, 0.536, -0.4815]
    assert [round(math.degrees(gear.helix_angle), 9) for gear in gears.values()] == [30, -30, -10, 10, 10, -10]
    assert [round(1e3 * gear.face_width, 9) for gear in gears.values()] == [16, 11, 23, 15, 41, 36]


def test_diameters_are_those_that_the_file_gives_elsewhere(imported):
    """The newer planetary file gives no tip diameter, but crowns the sun's flank from 64.064 to 76 mm."""
    name = "FVA_Planetary_stage_-_Minus_gearing_1.1_vers2.rexsj"
    crowning = read_rexs(DATA / name).components_of_type("profile_crowning")[0]
    tip = crowning.quantity("diameter_where_profile_crowning_tip_is_specified", "mm")
    root = crowning.quantity("diameter_where_profile_crowning_root_is_specified", "mm")
    gearbox = imported(name).gearbox
    sun = gearbox.gears["sun"]
    assert 2e3 * sun.tip_radius == pytest.approx(tip, rel=1e-12)
    assert 2e3 * sun.base_radius < 2e3 * sun.form_radius <= root


def test_the_torque_at_the_output_is_the_round_number_of_the_catalogue(imported):
    """The file gives 4.72456... N m at the input alone: what the output then bears is 500 N m to all its digits."""
    case = imported(SEW).gearbox.load_cases["nominal"]
    assert case.torques["shaft_4"] == pytest.approx(500.0, abs=1e-5)
    assert imported(SEW).gearbox.train.static_mesh_forces().keys() == {"stage_1", "stage_2", "stage_3"}


def test_power_over_speed_is_the_torque(imported):
    """Both planetary files turn the sun at 1500 rpm: one gives the torque of 250 kW, the other 100 kW."""
    torque = imported(PLANETARY).gearbox.case.static_load.torques_N_m["shaft_1"]
    other = imported("FVA_Planetary_stage_-_Minus_gearing_1.1_vers2.rexsj").gearbox.case.static_load.torques_N_m[
        "shaft_1"
    ]
    assert torque * 1500.0 * math.pi / 30.0 == pytest.approx(250e3, rel=1e-9)
    assert other * 1500.0 * math.pi / 30.0 == pytest.approx(100e3, rel=1e-9)


def test_three_planets_make_one_body_and_stand_where_the_file_has_them(imported):
    gearbox, model = imported(PLANETARY).gearbox, read_rexs(DATA / PLANETARY)
    places = {
        tuple(np.round(part.vector("support_vector")[1:], 6))
        for part in model.components_of_type("cylindrical_gear")
        if part.whole("number_of_teeth") == 22
    }
    planets = [body for body in gearbox.bodies() if body.carrier == "carrier"]
    assert {tuple(np.round(1e3 * np.array(body.axis), 6)) for body in planets} == places
    assert gearbox.body("housing").fixed
    assert len(gearbox.meshes) == 6


def test_all_containers_of_one_gearbox_give_the_same_case(imported):
    def content(name):
        return tomllib.loads(imported(name).text)

    first, second = content(PLANETARY), content("FVA_Planetary_stage_-_Minus_gearing_1.1.rexsz")
    assert {key: first[key] for key in ("gears", "pairs", "meshes")} == {
        key: second[key] for key in ("gears", "pairs", "meshes")
    }
    first, second = (
        content("FVA-Industriegetriebe_2stufig_1-4.rexs"),
        content("FVA-Industriegetriebe_2stufig_1-4.rexsj"),
    )
    assert {**first, "name": ""} == {**second, "name": ""}


def test_a_bearing_known_by_designation_has_the_dimensions_of_its_standard(imported):
    """6210: 50 x 90 x 20 mm by ISO 15; 33014: 70 x 110 x 31 and 33012: 60 x 95 x 27 mm by ISO 355."""
    made = imported(INDUSTRIAL)
    sizes = {
        bearing.catalogue.designation: (
            bearing.catalogue.type,
            bearing.catalogue.bore_mm,
            bearing.catalogue.outer_diameter_mm,
            bearing.catalogue.width_mm,
        )
        for bearing in made.gearbox.bearings
        if bearing.catalogue
    }
    assert sizes == {
        "6210-2Z": ("deep_groove_ball", 50.0, 90.0, 20.0),
        "33014": ("tapered_roller", 70.0, 110.0, 31.0),
        "33012": ("tapered_roller", 60.0, 95.0, 27.0),
    }
    assert len([line for line in made.text.splitlines() if "# A   ISO " in line]) == 9
    assert sum("from the designation" in line for line in made.changed) == 3
    assert lacking(made.gearbox, "bushing") == ""


def test_a_bearing_of_an_unknown_designation_is_a_blank_that_check_asks_for():
    gearbox = edited(INDUSTRIAL, ("6210-2Z", "SPECIAL 7")).gearbox
    assert gearbox.unknown_bearings == {"bearing_1": "SPECIAL 7"}
    assert "bearings.bearing_1 (SPECIAL 7)" in lacking(gearbox, "bushing")
    assert lacking(gearbox, "rigid") == ""
    sizes = {"type": "deep_groove_ball", "bore_mm": 50.0, "outer_diameter_mm": 90.0, "width_mm": 20.0}
    filled = gearbox.varied({"bearings.bearing_1.catalogue": sizes})
    assert not filled.unknown_bearings


def test_dimensions_of_designations_are_those_of_another_program(imported):
    """The SEW file gives dimensions, and designations in the names of its bearings."""
    found = 0
    for part in read_rexs(DATA / SEW).components_of_type("rolling_bearing_with_catalog_geometry"):
        boundary = boundary_of(part.name.split()[1])
        assert boundary is not None, part
        stated = [part.quantity(key, "mm") for key in ("inner_diameter", "outer_diameter", "width")]
        assert [boundary.bore, boundary.outer, boundary.width] == stated
        found += 1
    assert found == 9


def test_load_cases_are_those_of_the_spectrum_in_balance(imported):
    gearbox = imported(INDUSTRIAL).gearbox
    stated = {"load_case_1": (567.0, 543.0), "load_case_2": (345.0, 3456.0)}
    stated |= {"load_case_3": (456.0, 1234.0), "load_case_4": (789.0, 789.0)}
    assert set(gearbox.load_cases) == {*stated, "run_up"}
    for name, (torque, speed) in stated.items():
        case = gearbox.load_cases[name]
        assert case.torques["shaft_1"] == torque
        assert case.start_speed == pytest.approx(speed * math.pi / 30.0)
        assert sum(value * w for value, w in zip(case.torques.values(), (1.0, gearbox.train.ratio), strict=True)) == (
            pytest.approx(0.0, abs=1e-6 * torque)
        )
    assert gearbox.case.static_load.torques_N_m == {"shaft_1": 789.0}


def test_an_absurd_tip_diameter_is_replaced_by_that_of_the_rack_and_marked(imported):
    made = imported(INDUSTRIAL)
    assert any(
        ": tip_diameter of 1 mm is implausible, replaced by the value of the rack" in line for line in made.changed
    )
    gear = made.gearbox.gears["gear_3"]
    assert gear.teeth == 23
    assert gear.tip_diameter is None
    assert 2.0 * gear.tip_radius == pytest.approx(
        2.0 * gear.reference_radius + 2.0 * gear.normal_module * (1.0 + gear.profile_shift)
    )


def test_undercut_is_imported_as_it_is(imported):
    """A rack of 1.25 with 0.25 undercuts 17 teeth: x_min = 1.25 - 0.25 (1 - sin 20) - 17/2 sin^2 20 = 0.0912 > 0."""
    made = imported(PLANETARY)
    sun = made.gearbox.gears["sun"]
    assert (sun.rack.tip_radius, sun.rack.dedendum, sun.profile_shift) == (0.25, 1.25, 0.0)
    assert sun.is_undercut
    pair = made.gearbox.pairs["sun_planet"].pair
    assert pair.path_start > sun.form_roll_length  # the planet's tip does not reach down to it
    assert any(": undercut by its tool; root form diameter 63.9" in line for line in made.checked)


def test_a_chamfer_ends_the_flank_of_the_ring_before_the_fillet_of_its_planets(imported):
    """Both files have a ring tip of 236 mm; only the one with a chamfer of 0.5 mm clears the planets' form circle."""
    bare = imported(PLANETARY)
    ring = bare.gearbox.gears["ring"]
    assert 236.5e-3 < 2.0 * ring.tip_radius < 238e-3  # the form circle of the planet ends it at 236.52
    assert re.search(r"tip_diameter_mm = 23\d\.\d*\s+# A ", bare.text)
    chamfered = imported("FVA_Planetary_stage_-_Minus_gearing_1.1_vers2.rexsj").gearbox.gears["ring"]
    assert 2.0 * chamfered.tip_radius == pytest.approx(236e-3, rel=1e-12)
    assert 2.0 * chamfered.tip_form_radius == pytest.approx(237e-3, rel=1e-12)


def test_a_common_face_that_is_narrower_than_both_faces_is_kept():
    """The first stage of the SEW gearbox: faces of 16 and 11 mm."""
    text = '<attribute id="center_distance" unit="mm">53.0</attribute>'
    narrow = '<attribute id="common_face_width" unit="mm">9.0</attribute>'
    pair = edited(SEW, (text, text + narrow)).gearbox.pairs["stage_1"].pair
    assert pair.face_width == pytest.approx(9e-3)
    assert edited(SEW, (text, text + narrow.replace("9.0", "11.0"))).gearbox.pairs["stage_1"].pair.face_width == 11e-3


def test_a_gear_that_stands_aside_touches_over_what_the_faces_share():
    """The wheel moved by 5 mm along its shaft: 16 and 11 mm wide faces then share 8.5 mm."""
    model = read_rexs(DATA / SEW)
    places = {part.number: part.vector("support_vector") for part in model.components_of_type("cylindrical_gear")}
    pinion, wheel = (to_case(model, SEW).found.teeth.stages["stage_1"].__dict__[key] for key in ("pinion", "gear"))
    apart = places[wheel][0] - places[pinion][0]
    moved = Attribute(tuple(map(str, (places[pinion][0] + 5.0, *places[wheel][1:]))), "mm")
    components = {**model.components}
    components[wheel] = components[wheel].with_attributes({"support_vector": moved})
    pair = to_case(dataclasses.replace(model, components=components), SEW).gearbox.pairs["stage_1"].pair
    assert abs(apart) <= 2.5  # as it is, the narrow face lies within the wide one
    assert pair.face_width == pytest.approx((8.0 + 5.5 - 5.0) * 1e-3)


def test_inertia_is_that_of_sections_and_gears(imported):
    """The planetary file's sun shaft: 34 x 150 mm of steel, and a tube of 68/34 x 50 mm."""
    body = imported(PLANETARY).gearbox.body("shaft_1")
    shaft = 7850.0 * math.pi / 4.0 * 0.034**2 * 0.150
    tube = 7850.0 * math.pi / 4.0 * (0.068**2 - 0.034**2) * 0.050
    assert body.mass == pytest.approx(shaft + tube, rel=1e-5)
    assert body.axial == pytest.approx(shaft * 0.034**2 / 8 + tube * (0.068**2 + 0.034**2) / 8, rel=1e-5)
    assert body.centre_of_mass_z == pytest.approx((shaft * 0.175 + tube * 0.125) / (shaft + tube), rel=1e-5)


@pytest.mark.parametrize("name", IMPORTED)
def test_every_number_has_its_source_or_a_mark(name, imported):
    lines = imported(name).text.splitlines()
    bare = [line for line in lines if re.match(r"\w+ = (\[?-?\d|\{)", line) and " # " not in line]
    assert bare == []
    assert any(re.search(r"# A ", line) for line in lines)


def test_what_is_left_out_is_listed_by_type_and_attribute(imported):
    ignored = "\n".join(imported(PLANETARY).ignored)
    assert "cylindrical_stage_gear_data, 12 of them" in ignored
    assert re.search(r"^material: .*thermal_capacity", ignored, re.M)
    assert not re.search(
        r"^(shaft|cylindrical_gear|side_plate): .*(support_vector|number_of_teeth|length)", ignored, re.M
    )
    head = imported(PLANETARY).text.split("\nname = ")[0]
    assert all(line.startswith("#") for line in head.splitlines() if line)
    assert "cylindrical_stage_gear_data, 12 of them" in head


CONTRADICTIONS = {
    "shifts": (
        ">0.581<",
        ">0.681<",
        ": the sum of profile shifts is 1.19410, but the centre distance of 53 mm requires 1.0941",
    ),
}


@pytest.mark.parametrize("what", CONTRADICTIONS)
def test_a_file_that_contradicts_itself_is_refused_with_both_numbers(what):
    old, new, words = CONTRADICTIONS[what]
    with pytest.raises(RexsError, match=words):
        edited(SEW, (old, new))


def test_a_speed_at_which_the_train_does_not_roll_is_refused():
    speed = '<attribute id="rotational_speed" unit="1 / min">{}</attribute>'
    text = (DATA / SEW).read_text(encoding="utf-8")
    head = re.search(r'<component[^>]*id="54"[^>]*>', text)[0]
    rolling = edited(SEW, (head, head + speed.format(1400.0 * IMPORTED[SEW])))
    assert any("shaft_4 rotates at" in line for line in rolling.checked)
    with pytest.raises(RexsError, match="has shaft_4 at 20 rpm"):
        edited(SEW, (head, head + speed.format(20.0)))


def test_flanks_that_differ_are_refused():
    text = (DATA / SEW).read_text(encoding="utf-8")
    text = text.replace(">0.581<", ">0.582<", 1)
    with pytest.raises(RexsError, match="left and right flank differ in addendum_modification_coefficient"):
        to_case(parse_model(text.encode()), SEW)


def test_an_axis_across_the_others_is_refused():
    text = (DATA / SEW).read_text(encoding="utf-8")
    start = re.search(r'<component[^>]*id="5"[^>]*>', text).start()
    turned = re.sub(r"<c>1\.0</c>\s*<c>0\.0</c>\s*<c>0\.0</c>", "<c>0.0</c><c>1.0</c><c>0.0</c>", text[start:], count=1)
    with pytest.raises(RexsError, match="only parallel axes can be imported"):
        to_case(parse_model((text[:start] + turned).encode()), SEW)


def test_the_verb_writes_a_case_that_check_accepts_and_never_over_another(tmp_path):
    out = tmp_path / "sew"
    outcome = exugear("import", DATA / SEW, "--out", out, "--json")
    assert outcome.exit_code == 0, outcome.output
    summary = json.loads(outcome.stdout)
    assert summary["ratio"] == pytest.approx(IMPORTED[SEW], rel=1e-12)
    assert sorted(path.name for path in out.iterdir()) == ["gearbox.toml", "load_spectrum.csv"]
    assert Gearbox.from_toml(out / "gearbox.toml").train.ratio == summary["ratio"]
    before = (out / "gearbox.toml").read_bytes()
    again = exugear("import", DATA / SEW, "--out", out)
    assert again.exit_code == 2
    assert "exists already" in again.output
    assert (out / "gearbox.toml").read_bytes() == before


def test_the_verb_ends_with_2_and_writes_nothing_of_what_it_refuses(tmp_path):
    outcome = exugear("import", DATA / "FVA_worm_stage_1-4.rexs", "--out", tmp_path / "x")
    assert outcome.exit_code == 2
    assert "worm gears cannot be imported" in " ".join(outcome.output.split())
    assert not (tmp_path / "x").exists()


def test_names_of_a_hostile_file_stay_comments():
    hostile = "ANW [4]&#10;[gears.evil]&#10;teeth = 5 &quot; \\"
    made = edited(SEW, ("ANW [4]", hostile))
    assert "evil" not in tomllib.loads(made.text)["gears"]
    assert made.gearbox.train.ratio == pytest.approx(IMPORTED[SEW])
