"""What the files of other programs do not show: turned axes, derived shifts, reliefs, couplings, one-sided bearings."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from exugear.exchange.rexs.containers import read_rexs
from exugear.exchange.rexs.to_case.conversion import to_case
from exugear.exchange.rexs.tree import Attribute, Component, Model, Relation, RexsError
from exugear.system.gearbox_checks import lacking
from fe_ste.geometry.involute import inverse_involute, involute

DATA = Path(__file__).parent / "data"
SEW = read_rexs(DATA / "SEW_3-stage_cylindrical_gearbox_1.0.rexs")
PLANETARY = read_rexs(DATA / "FVA_Planetary_stage_-_Minus_gearing_1.1.rexs")
INDUSTRIAL = read_rexs(DATA / "FVA-Industriegetriebe_2_stufig_1-6.rexs")


def with_values(model: Model, changes: dict[int, dict[str, object]], *more: Component) -> Model:
    """Return the model with values of some components replaced (None: left out), and with further components."""
    components = dict(model.components)
    for number, values in changes.items():
        part = components[number]
        attributes = {key: one for key, one in part.attributes.items() if key not in values}
        attributes |= {
            key: Attribute(value, part.attributes[key].unit if key in part.attributes else "")
            for key, value in values.items()
            if value is not None
        }
        components[number] = dataclasses.replace(part, attributes=attributes)
    components |= {part.number: part for part in more}
    return dataclasses.replace(model, components=components)


def with_relations(model: Model, *relations: Relation) -> Model:
    return dataclasses.replace(model, relations=(*model.relations, *relations))


def gearbox_of(model: Model):
    return to_case(model, "case").gearbox


def shape_of(gearbox, body):
    return gearbox.case.bodies[body].shape


def turned_round(shaft: int, length: float) -> Model:
    """The model with the axis of one shaft, which is of this length (mm), pointing the other way."""
    sections = {
        part.number: {
            "u_coordinate_on_shaft": length
            - part.quantity("u_coordinate_on_shaft", "mm")
            - part.quantity("length", "mm")
        }
        for part in SEW.related("assembly", "assembly", shaft, "part")
        if part.type == "shaft_section"
    }
    x, y, z = SEW.components[shaft].vector("support_vector")
    axis = {shaft: {"support_vector": (x + length, y, z), "u_axis_vector": (-1.0, 0.0, 0.0)}}
    return with_values(SEW, {**sections, **axis})


def test_a_shaft_whose_axis_points_the_other_way_is_the_same_shaft():
    plain, other = gearbox_of(SEW), gearbox_of(turned_round(5, 59.5))
    first, second = (shape_of(gearbox, "shaft_2") for gearbox in (plain, other))
    assert second.start_z_mm == pytest.approx(first.start_z_mm)
    for one, two in zip(first.sections, second.sections, strict=True):
        assert two.length_mm == pytest.approx(one.length_mm)
        assert two.outer_diameter_mm == one.outer_diameter_mm
    assert other.body("shaft_2").mass == pytest.approx(plain.body("shaft_2").mass)
    assert [gear.helix_angle for gear in other.gears.values()] == [gear.helix_angle for gear in plain.gears.values()]


def test_speed_and_torque_are_signed_along_the_shaft_that_bears_them():
    gearbox = gearbox_of(turned_round(4, 164.5))
    assert gearbox.load_cases["nominal"].start_speed == pytest.approx(-1400.0 * math.pi / 30.0)
    assert gearbox.case.static_load.torques_N_m["shaft_1"] == pytest.approx(-4.72456, rel=1e-5)


def test_a_gearbox_that_lies_along_another_direction_is_the_same_gearbox():
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # u becomes -w
    changes = {
        number: {
            key: tuple((turn @ part.vector(key)).tolist())
            for key in ("support_vector", "u_axis_vector", "w_axis_vector")
            if part.given(key)
        }
        for number, part in SEW.components.items()
        if part.type != "gear_unit"
    }
    plain, other = gearbox_of(SEW), gearbox_of(with_values(SEW, changes))
    for mesh, twin in zip(plain.meshes, other.meshes, strict=True):
        assert twin.centre_distance == pytest.approx(mesh.centre_distance, abs=1e-12)
        assert twin.z == pytest.approx(mesh.z, abs=1e-12)
    angles = [[mesh.position_angle for mesh in gearbox.meshes] for gearbox in (plain, other)]
    steps = [np.diff(np.unwrap(one)) for one in angles]
    assert steps[0] == pytest.approx(steps[1], abs=1e-9)  # turned about the shafts, not mirrored


@pytest.mark.parametrize("lacking", [361, 363])
def test_a_shift_that_is_not_given_follows_from_the_centre_distance(lacking):
    """Against the finished pair: with that shift and no thinning, its backlash-free distance is the file's."""
    changes = {number: {"addendum_modification_coefficient": None} for number in (lacking, lacking + 1)}
    gearbox = gearbox_of(with_values(SEW, changes))
    pair = gearbox.pairs["stage_1"].pair
    assert pair.pinion.profile_shift + pair.gear.profile_shift == pytest.approx(1.0941, abs=1e-4)
    bare = [dataclasses.replace(gear, tooth_thinning=0.0) for gear in (pair.pinion, pair.gear)]
    bare = dataclasses.replace(pair, pinion=bare[0], gear=bare[1])
    assert bare.backlash_free_centre_distance == pytest.approx(53e-3, abs=1e-9)


def test_the_shift_of_a_ring_counts_the_other_way():
    """DIN 3960: a ring of negative shift is larger; here a positive one is. Planet -0.1 leaves the sun 0.1."""
    planets = {number: {"addendum_modification_coefficient": -0.1} for number in range(254, 260)}
    ring = {number: {"addendum_modification_coefficient": 0.1} for number in (252, 253)}
    gears = gearbox_of(with_values(PLANETARY, {**planets, **ring})).gears
    assert gears["ring"].profile_shift == -0.1
    assert gears["planet_gear"].profile_shift == -0.1
    assert gears["sun"].profile_shift == pytest.approx(0.1, abs=1e-9)
    wrong = {number: {"addendum_modification_coefficient": -0.1} for number in (252, 253)}
    with pytest.raises(RexsError, match=": the sum of profile shifts is"):
        gearbox_of(with_values(PLANETARY, {**planets, **wrong}))


def test_planets_that_differ_are_refused():
    with pytest.raises(RexsError, match="differs from .* in face_width; planets of a set must be equal"):
        gearbox_of(with_values(PLANETARY, {248: {"face_width": 40.0}}))


def test_a_train_that_is_held_at_both_ends_is_refused():
    held = Relation("side", 0, {"assembly": 900, "inner_part": 4, "outer_part": 2})
    model = with_relations(with_values(PLANETARY, {}, Component(900, "coupling")), held)
    with pytest.raises(
        RexsError,
        match="only shaft_1 can rotate, all other bodies are connected to",
    ):
        gearbox_of(model)


def relieved(**values):
    given = {key: Attribute(value, "mm" if isinstance(value, float) else "none") for key, value in values.items()}
    part = Component(900, "tip_relief", "", given)
    flanks = (Relation("reference", 0, {"origin": number, "referenced": 900}) for number in (361, 362))
    return with_relations(with_values(SEW, {}, part), *flanks)


def test_a_tip_relief_starts_at_its_diameter_and_has_its_depth_at_the_tip():
    model = relieved(tip_relief_depth=0.012, tip_relief_datum_diameter=28.6, shape_of_relief="linear")
    gearbox = gearbox_of(model)
    relief, gear = gearbox.modifications["gear_1"].tip_relief, gearbox.gears["gear_1"]
    assert relief.start_radius == pytest.approx(14.3e-3, rel=1e-7)
    removed = gearbox.modifications["gear_1"].gap(gear, np.array([14.3e-3, gear.tip_radius]), np.zeros(2))
    assert removed == pytest.approx([0.0, 12e-6], abs=1e-10)


def test_a_relief_stated_below_the_tip_goes_on_to_it():
    model = relieved(
        tip_relief_depth=0.012,
        tip_relief_datum_diameter=28.6,
        tip_relief_evaluation_reference=29.0,
        shape_of_relief="linear",
    )
    gearbox = gearbox_of(model)
    gear = gearbox.gears["gear_1"]
    removed = gearbox.modifications["gear_1"].gap(gear, np.array([14.5e-3]), np.zeros(1))
    assert removed == pytest.approx([12e-6], abs=1e-9)


def test_modifications_that_differ_between_the_flanks_are_refused_and_unknown_ones_are_told():
    one_sided = with_relations(
        with_values(SEW, {}, Component(900, "tip_relief")), Relation("reference", 0, {"origin": 361, "referenced": 900})
    )
    with pytest.raises(RexsError, match="left and right flank differ in tip_relief"):
        gearbox_of(one_sided)
    end_relief = (Relation("reference", 0, {"origin": number, "referenced": 900}) for number in (361, 362))
    made = to_case(with_relations(with_values(SEW, {}, Component(900, "end_relief_datum_face")), *end_relief), "case")
    assert any("end_relief_datum_face 900 of cylindrical_gear 23" in line for line in made.changed)


@pytest.mark.parametrize(
    ("kind", "key"),
    [("helix_slope", "helix_slope_um"), ("profile_slope", "profile_slope_um"), ("profile_twist", "twist_um")],
)
@pytest.mark.parametrize("amount", [0.012, 0.0])
def test_a_slope_whose_sign_is_not_known_becomes_a_zero_to_be_set(kind: str, key: str, amount: float):
    part = Component(900, kind, attributes={kind: Attribute(amount, "mm")})
    flanks = (Relation("reference", 0, {"origin": number, "referenced": 900}) for number in (361, 362))
    made = to_case(with_relations(with_values(SEW, {}, part), *flanks), "case")
    lines = [line for line in made.text.splitlines() if line.startswith(key)]
    told = [line for line in made.changed if kind in line]
    if amount:
        assert "SET IT: 12 µm" in lines[0]
        assert ": its amount of 12 µm is not imported, since REXS does not" in told[0]
    else:
        assert not lines
        assert not told
    assert getattr(made.gearbox.modifications["gear_1"], key.removesuffix("_um")) == 0.0


def test_a_soft_coupling_joins_spins_and_a_stiff_one_makes_one_body():
    """A third shaft behind the output: 1e17 N mm/rad is one piece (1e14 N m/rad), 1e9 a spring of 1e6 N m/rad."""
    shaft = Component(
        900,
        "shaft",
        "",
        {
            "support_vector": Attribute((402.7, -19.008575782311063, -1.026431327759056), "mm"),
            "u_axis_vector": Attribute((1.0, 0.0, 0.0), "mm"),
            "w_axis_vector": Attribute((0.0, 0.0, 1.0), "mm"),
            "reference_component_for_position": Attribute("1"),
        },
    )
    section = {"u_coordinate_on_shaft": 0.0, "length": 50.0, "outer_diameter_begin": 35.0}
    part = Component(901, "shaft_section", "", {key: Attribute(value, "mm") for key, value in section.items()})

    def joined(stiffness):
        coupling = Component(902, "coupling", "", {"rotational_stiffness": Attribute(stiffness, "N mm / rad")})
        model = with_values(SEW, {}, shaft, part, coupling)
        return with_relations(
            model,
            Relation("assembly", 0, {"assembly": 900, "part": 901}),
            Relation("side", 0, {"assembly": 902, "inner_part": 54, "outer_part": 900}),
        )

    alone = gearbox_of(SEW).body("shaft_4").mass
    rigid = gearbox_of(joined(1e17))
    piece = 7850.0 * math.pi / 4.0 * 0.035**2 * 0.050
    assert rigid.body("shaft_4").mass == pytest.approx(alone + piece, rel=1e-5)
    soft = to_case(joined(1e9), "case")
    assert soft.gearbox.couplings[0].stiffness == pytest.approx(1e6)
    assert {soft.gearbox.couplings[0].first, soft.gearbox.couplings[0].second} == {"shaft_4", "shaft_5"}


@pytest.mark.parametrize(("absorbed", "towards"), [("positive", "+z"), ("negative", "-z")])
def test_a_tapered_bearing_with_dimensions_holds_the_way_it_says(absorbed, towards):
    sizes = {"inner_diameter": 70.0, "outer_diameter": 110.0, "width": 31.0}
    changes = {25: {**sizes, "axial_force_absorption": absorbed}}
    gearbox = gearbox_of(with_values(INDUSTRIAL, changes))
    catalogue = gearbox.case.bearings["bearing_2"].catalogue
    assert catalogue.type == "tapered_roller"
    assert catalogue.locates_towards == towards
    assert (catalogue.bore_mm, catalogue.outer_diameter_mm, catalogue.width_mm) == (70.0, 110.0, 31.0)


def test_a_bearing_of_a_kind_without_law_is_a_blank_with_its_name():
    made = to_case(with_values(SEW, {20: {"bearing_type": "axial_grooved_ball_bearing"}}), "case")
    assert made.gearbox.unknown_bearings == {"bearing_1": "not modelled: 6305-2Z"}
    assert any("axial_grooved_ball_bearing has no bearing model" in line for line in made.changed)


def test_a_cone_is_one_with_its_mass_and_its_shape():
    """Volume of a frustum from 25 to 24 mm: (a2 + ab + b2) / 3; the mass has six digits in the file."""
    plain = gearbox_of(SEW).body("shaft_1").mass
    section = next(part for part in SEW.related("assembly", "assembly", 4, "part") if part.number == 388)
    length = section.quantity("length", "mm")
    coned = gearbox_of(with_values(SEW, {388: {"outer_diameter_end": 24.0}}))
    steel = 7850e-9 * math.pi / 4.0 * length
    expected = plain + steel * ((25.0**2 + 25.0 * 24.0 + 24.0**2) / 3.0 - 25.0**2)
    assert coned.body("shaft_1").mass == pytest.approx(expected, rel=2e-5)
    cones = [one for one in shape_of(coned, "shaft_1").sections if one.outer_diameter_end_mm is not None]
    assert (cones[0].outer_diameter_mm, cones[-1].outer_diameter_end_mm) == (25.0, 24.0)
    # What a seat lies on is levelled; the rest follows without a step.
    assert all(one.outer_diameter_end_mm < one.outer_diameter_mm for one in cones)


def test_a_cone_of_a_shaft_that_points_the_other_way_is_turned_round():
    cone = [p for p in SEW.related("assembly", "assembly", 5, "part") if p.type == "shaft_section"][-1].number
    ahead = with_values(SEW, {cone: {"outer_diameter_begin": 20.0, "outer_diameter_end": 16.0}})
    behind = with_values(turned_round(5, 59.5), {cone: {"outer_diameter_begin": 16.0, "outer_diameter_end": 20.0}})
    one, other = (gearbox_of(model).body("shaft_2") for model in (ahead, behind))
    assert other.mass == pytest.approx(one.mass)
    assert other.centre_of_mass_z == pytest.approx(one.centre_of_mass_z)
    assert one.mass != gearbox_of(SEW).body("shaft_2").mass


def test_a_file_without_torque_gets_one_that_is_marked():
    made = to_case(with_values(SEW, {22: {"torque_around_u_axis": None}}), "case")
    line = next(line for line in made.text.splitlines() if line.startswith("torques_N_m"))
    assert "# A" in line
    assert "SET IT" in line


def test_a_fault_of_the_gearbox_file_names_the_components_it_is_about():
    with pytest.raises(RexsError, match="^pairs.stage_1: .*pairs.stage_1 is cylindrical_stage 6 'Stirnradstufe'"):
        gearbox_of(with_values(SEW, {34: {"tip_diameter": 86.0}}))


def test_a_carrier_that_is_joined_with_the_casing_makes_a_star():
    """Both couplings that hold the ring hold the carrier instead: the ring turns at -17/61 of the sun's speed."""
    held = {one.number for one in PLANETARY.components_of_type("switchable_coupling")}
    relations = tuple(
        dataclasses.replace(one, roles={**one.roles, "inner_part": 4})
        if one.type == "side" and one.roles.get("assembly") in held
        else one
        for one in PLANETARY.relations
    )
    gearbox = gearbox_of(dataclasses.replace(PLANETARY, relations=relations))
    assert gearbox.train.ratio == pytest.approx(-17 / 61, rel=1e-12)
    assert gearbox.body("housing").fixed
    assert len(gearbox.meshes) == 6
    assert lacking(gearbox, "rigid") == ""


def stepped() -> Model:
    """The planetary file with a second gear of 20 teeth on each planet, which meshes with a ring of 59."""
    components, relations = dict(PLANETARY.components), list(PLANETARY.relations)
    ring = PLANETARY.components_of_type("ring_gear")[0].number
    x, y, z = PLANETARY.components[ring].vector("support_vector")
    aside = {"support_vector": Attribute((x + 60.0, y, z), "mm"), "number_of_teeth": Attribute("59")}
    components[ring] = PLANETARY.components[ring].with_attributes(aside)
    for first in [g for g in PLANETARY.components_of_type("cylindrical_gear") if g.whole("number_of_teeth") == 22]:
        number = first.number + 10_000
        x, y, z = first.vector("support_vector")
        place = {"support_vector": Attribute((x + 60.0, y, z), "mm"), "number_of_teeth": Attribute("20")}
        components[number] = dataclasses.replace(first.with_attributes(place), number=number, asked=set())
        for one in list(relations):
            roles = dict(one.roles)
            role = next((role for role, part in roles.items() if part == first.number), None)
            if role is None:
                continue
            if one.type in ("assembly", "flank", "reference"):
                relations.append(dataclasses.replace(one, roles={**roles, role: number}))
            elif one.type == "stage" and ring in roles.values():
                relations[relations.index(one)] = dataclasses.replace(one, roles={**roles, role: number})
    return dataclasses.replace(PLANETARY, components=components, relations=tuple(relations))


def test_stepped_planets_are_imported_with_both_their_gears():
    """Ring held: 1 / (1 + (22/17) (59/20)) of the sun's speed at the carrier."""
    gearbox = gearbox_of(stepped())
    assert gearbox.train.ratio == pytest.approx(1.0 / (1.0 + 22 / 17 * 59 / 20), rel=1e-12)
    wheels = gearbox.body("planet_1").wheels
    assert sorted(gearbox.gears[name].teeth for name in wheels) == [20, 22]
    places = sorted(wheels.values())
    assert places[1] - places[0] == pytest.approx(0.060)
    assert len(gearbox.meshes) == 6


@pytest.mark.parametrize(
    ("given", "factor"),
    [
        ({"chordal_tooth_thickness_{}_deviation": "mm"}, 1.0),
        ({"chordal_transverse_tooth_thickness_{}_deviation": "mm"}, None),
        ({"{}_backlash_allowance_referenced_to_span": "mum"}, 1.0 / math.cos(math.radians(20.0))),
    ],
)
def test_tooth_thickness_allowances_become_those_of_the_normal_section(given, factor):
    """DIN 3967: A_st = A_sn / cos(beta), A_W = A_sn cos(alpha_n); teeth have the mean."""
    ((key, unit),) = given.items()
    number = next(part.number for part in SEW.components_of_type("cylindrical_gear"))
    scale = 1.0 if unit == "mm" else 1e3
    values = {
        key.format(end): Attribute(amount * scale, unit) for end, amount in (("upper", -0.054), ("lower", -0.084))
    }
    part = SEW.components[number]
    made = to_case(with_values(SEW, {}, dataclasses.replace(part, attributes={**part.attributes, **values})), "case")
    sections = [one for one in made.gearbox.case.gears.items() if one[1].tooth_thickness is not None]
    assert len(sections) == 1
    name, section = sections[0]
    gear = made.gearbox.gears[name]
    factor = math.cos(gear.helix_angle) if factor is None else factor
    assert section.tooth_thickness.upper_allowance_um == pytest.approx(-54.0 * factor, rel=1e-6)
    assert section.tooth_thickness.lower_allowance_um == pytest.approx(-84.0 * factor, rel=1e-6)
    full = dataclasses.replace(gear, tooth_thinning=0.0)
    thinner = full.normal_tooth_thickness - gear.normal_tooth_thickness
    assert thinner == pytest.approx(69e-6 * factor, rel=1e-6)
    assert section.tooth_thinning_mm == 0.0


def test_allowances_that_would_thicken_teeth_are_not_taken():
    number = next(part.number for part in SEW.components_of_type("cylindrical_gear"))
    values = {f"chordal_tooth_thickness_{end}_deviation": 0.02 for end in ("upper", "lower")}
    sections = gearbox_of(with_values(SEW, {number: values})).case.gears.values()
    assert all(one.tooth_thickness is None and one.tooth_thinning_mm > 0.0 for one in sections)


def test_the_cutter_of_a_ring_becomes_one_that_cuts_its_root():
    """By hand: a_0 of 61 and 23 teeth from the ring's shift, its root circle a_0 + r_a0; d_a0 = 4 (23 + 2.5) mm."""
    made = to_case(PLANETARY, "case")
    (name,) = [name for name, one in made.gearbox.gears.items() if one.internal]
    ring, section = made.gearbox.gears[name], made.gearbox.case.gears[name]
    assert section.cutter is not None
    assert (section.cutter.teeth, section.cutter.addendum, section.cutter.profile_shift) == (23, 1.25, 0.0)
    shift = 2.0 * ring.profile_shift * math.tan(math.radians(20.0)) + ring.tooth_thinning / 4e-3
    angle = inverse_involute(involute(math.radians(20.0)) + shift / (61 - 23))
    distance = 0.5 * 4e-3 * (61 - 23) * math.cos(math.radians(20.0)) / math.cos(angle)
    assert ring.root_radius == pytest.approx(distance + 0.5 * 4e-3 * 25.5, rel=1e-12)
    assert "in the file, too small a radius for the tooth model" in next(
        line for line in made.text.splitlines() if line.startswith("cutter")
    )


def test_a_cutter_that_cannot_make_the_ring_is_left_out_and_told():
    made = to_case(with_values(PLANETARY, {85: {"number_of_teeth": 60}}), "case")
    assert all(one.cutter is None for one in made.gearbox.gears.values())
    assert any(
        ": its cutter is not imported, the root fillet is an arc instead; cutter.teeth = 60 trims" in one
        for one in made.changed
    )
