"""What follows from the rest of a gearbox file may be left out of it: inertia from shapes and gears, joints."""

from __future__ import annotations

import math
import tomllib

import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.templates.kinds import template
from exugear.report.pictures.shapes import bodies_of
from exugear.report.web.stage import drawn_bodies
from exugear.system.bodies.of_gearbox import reduced_bodies, shaft_model
from exugear.system.modes import eigenmodes
from exugear.system.sensitivity import assumed_parameters
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from fe_ste.geometry.cylinders import Tube, mass_properties

from ..cases.assembled import assembled
from ..cases.spur import SPUR_CASE

STEEL = 7850.0
CASE = """
name = "a pair of which little is said"
default_inertias = "usual"
overall = { input = "one", output = "two", output_gear = "wheel" }
static_load = { torques_N_m = { one = 100.0 }, locked = ["two"] }

[gears]
pinion = { teeth = 20, normal_module_mm = 3.0, face_width_mm = 15.0, held_diameter_mm = 30.0 }
wheel = { teeth = 30, normal_module_mm = 3.0, face_width_mm = 15.0, held_diameter_mm = 50.0 }

[pairs]
spur = { pinion = "pinion", gear = "wheel", centre_distance_mm = 75.0 }

[bodies.one]
axis_position_mm = [0.0, 0.0]
gears_z_mm = { pinion = 60.0 }
[bodies.one.shape]
start_z_mm = 10.0
sections = [
    { length_mm = 40.0, outer_diameter_mm = 25.0 },
    { length_mm = 30.0, outer_diameter_mm = 35.0, inner_diameter_mm = 10.0 },
    { length_mm = 20.0, outer_diameter_mm = 30.0, outer_diameter_end_mm = 20.0 },
]

[bodies.two]
axis_position_mm = [75.0, 0.0]
gears_z_mm = { wheel = 60.0 }
[bodies.two.shape]
start_z_mm = 20.0
sections = [{ length_mm = 80.0, outer_diameter_mm = 50.0 }]
blanks.wheel = { mass_kg = 0.5, axial_kg_m2 = 1e-3, transverse_kg_m2 = 6e-4 }

[bearings]
one_left = { body = "one", z_mm = 20.0, stiffness = { radial_N_per_m = 2e8, axial_N_per_m = 1e8 } }
one_right = { body = "one", z_mm = 92.0, stiffness = { radial_N_per_m = 2e8 } }
two = { body = "two", z_mm = 30.0, stiffness = { radial_N_per_m = 2e8, axial_N_per_m = 1e8, tilt_N_m_per_rad = 1e6 } }

[meshes]
spur = { pair = "spur", pinion_body = "one", gear_body = "two" }

[load_cases]
run_up = { torques_N_m = { one = 100.0, two = 140.0 }, duration_s = 1.0 }
"""


def gearbox_of(*changes: tuple[str, str]) -> Gearbox:
    text = CASE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return Gearbox.from_dict(tomllib.loads(text), "case.toml")


def disc(length: float, outer: float, inner: float = 0.0) -> tuple[float, float]:
    """Mass and axial inertia of a tube of steel, m."""
    mass = STEEL * math.pi / 4.0 * (outer**2 - inner**2) * length
    return mass, mass * (outer**2 + inner**2) / 8.0


def test_inertia_is_that_of_the_pieces_and_of_the_gear_above_its_seat() -> None:
    """By hand: three pieces, the last a cone, and a tube from the shaft's 35 mm to the reference circle of 60 mm."""
    body = gearbox_of().body("one")
    cone = STEEL * math.pi * 20e-3 * (15**2 + 15 * 10 + 10**2) * 1e-6 / 3.0
    parts = [disc(0.04, 0.025), disc(0.03, 0.035, 0.010), disc(0.015, 0.060, 0.035)]
    assert body.mass == pytest.approx(sum(mass for mass, _ in parts) + cone, rel=1e-12)
    fourth = sum(15.0 ** (4 - n) * 10.0**n for n in range(5)) * 1e-12
    cone_axial = STEEL * math.pi * 20e-3 * fourth / 10.0
    assert body.axial == pytest.approx(sum(axial for _, axial in parts) + cone_axial, rel=1e-12)
    # The gear may stand on the thicker of the two pieces under it alone: 35 mm, from z = 50 to 80 mm.
    assert 0.045 < body.centre_of_mass_z < 0.065


def test_a_blank_that_is_given_counts_in_place_of_the_gear() -> None:
    body = gearbox_of().body("two")
    mass, axial = disc(0.08, 0.050)
    assert body.mass == pytest.approx(mass + 0.5, rel=1e-12)
    assert body.axial == pytest.approx(axial + 1e-3, rel=1e-12)
    assert body.centre_of_mass_z == pytest.approx(0.060, rel=1e-12)


def test_inertia_that_is_given_stays_and_names_the_sets_of_all() -> None:
    given = "{ mass_kg = 2.0, axial_kg_m2 = 3e-2, transverse_kg_m2 = 3e-2, centre_of_mass_z_mm = 0.0 }"
    gearbox = gearbox_of(
        ("[bodies.two.shape]", f"inertia.usual = {given}\ninertia.other = {given}\n[bodies.two.shape]")
    )
    assert gearbox.inertia_sets == ("usual", "other")
    assert gearbox.body("two").mass == 2.0
    assert gearbox.body("one", "other").mass == gearbox.body("one", "usual").mass == gearbox_of().body("one").mass


def test_bodies_with_shapes_need_no_name_of_an_inertia_set_and_others_do() -> None:
    without = ('default_inertias = "usual"\n', "")
    assert gearbox_of(without).inertia_sets == ("shapes",)
    assert gearbox_of(without).body("one").mass == gearbox_of().body("one").mass
    given = "{ mass_kg = 2.0, axial_kg_m2 = 3e-2, transverse_kg_m2 = 3e-2, centre_of_mass_z_mm = 0.0 }"
    with pytest.raises(GearboxFileError, match="default_inertias: missing; sets are usual$"):
        gearbox_of(without, ("[bodies.two.shape]", f"inertia.usual = {given}\n[bodies.two.shape]"))


def test_a_body_without_inertia_shape_or_gears_to_take_it_from_is_refused() -> None:
    with pytest.raises(
        GearboxFileError, match="requires an inertia table, .* or a shape from which its inertia is computed"
    ):
        gearbox_of((CASE[CASE.index("[bodies.two.shape]") : CASE.index("[bearings]")], ""))


def test_the_elastic_shaft_has_the_same_mass_as_the_rigid_one() -> None:
    """A cone is a cone in both."""
    gearbox = gearbox_of(("[bodies.one.shape]", 'flexibility = "elastic"\n[bodies.one.shape]'))
    sections = shaft_model(gearbox, "one").sections
    assert len(sections) == 3
    tubes = [
        Tube(
            start=0.0,
            length=s.length,
            outer=s.outer_diameter,
            inner=s.inner_diameter,
            density=STEEL,
            outer_end=s.outer_end,
            inner_end=s.inner_end,
        )
        for s in sections
    ]
    gear = disc(0.015, 0.060, 0.035)[0]
    assert mass_properties(tubes).mass + gear == pytest.approx(gearbox.body("one").mass, rel=1e-12)


def test_joints_stand_in_the_middle_of_bearings_where_the_file_gives_none() -> None:
    joints = {joint.name: joint for joint in gearbox_of().joints}
    assert {name: joint.position[2] for name, joint in joints.items()} == pytest.approx({"one": 0.056, "two": 0.030})
    given = gearbox_of(("[meshes]", '[joints]\nfirst = { body = "one", z_mm = 1.0 }\n\n[meshes]')).joints
    assert [joint.name for joint in given] == ["first"]


def test_joints_of_planets_are_on_their_carrier() -> None:
    """The planetary template without its joints gets those that it had, by body."""
    content = tomllib.loads(template("planetary"))
    before = {joint.body: joint for joint in Gearbox.from_dict(content, "case.toml").joints}
    del content["joints"]
    after = {joint.body: joint for joint in Gearbox.from_dict(content, "case.toml").joints}
    assert {name: joint.on for name, joint in after.items()} == {name: joint.on for name, joint in before.items()}


def test_a_computed_inertia_can_be_varied_like_a_given_one() -> None:
    gearbox = gearbox_of()
    choice = Choice("rigid", "iso6336").of(gearbox)
    parameters = assumed_parameters(gearbox, choice, mesh_stiffness(gearbox, choice.mesh_model))
    label = next(one for one in parameters if one.label.startswith("axial inertia"))
    assembly = label.build(2.0 * gearbox.body("two").axial)
    body = assembly.gearbox.body("two")
    assert body.axial == pytest.approx(2.0 * gearbox.body("two").axial)
    assert body.mass == pytest.approx(gearbox.body("two").mass)


def test_a_profile_shift_follows_from_the_centre_distance() -> None:
    gearbox = gearbox_of(
        ("centre_distance_mm = 75.0", "centre_distance_mm = 75.5"),
        ("axis_position_mm = [75.0, 0.0]", "axis_position_mm = [75.5, 0.0]"),
        ("held_diameter_mm = 50.0", "held_diameter_mm = 50.0, profile_shift_from_centre_distance = true"),
    )
    pair = gearbox.pairs["spur"].pair
    assert pair.circumferential_backlash == pytest.approx(0.0, abs=1e-14)
    assert 0.16 < pair.gear.profile_shift < 0.2


def test_shifts_that_nothing_gives_are_refused() -> None:
    flag = ", profile_shift_from_centre_distance = true }"
    both = [(f"held_diameter_mm = {bore} }}", f"held_diameter_mm = {bore}{flag}") for bore in ("30.0", "50.0")]
    with pytest.raises(GearboxFileError, match="wheel of pairs.spur has no profile_shift either; set one of them"):
        gearbox_of(*both)
    with pytest.raises(
        GearboxFileError, match="set profile_shift or profile_shift_from_centre_distance = true, not both"
    ):
        gearbox_of(("held_diameter_mm = 50.0 }", f"held_diameter_mm = 50.0, profile_shift = 0.1{flag}"))


def test_teeth_that_do_not_fit_the_centre_distance_are_told_with_the_numbers() -> None:
    """Reference centre distance 3 mm (20 + 30) / 2 = 75 mm; base circles touch at 75 cos 20 deg = 70.48 mm."""
    with pytest.raises(
        GearboxFileError,
        match=r"pairs\.spur\.centre_distance_mm = 70: no line of action touches both base circles below 70\.48 mm; "
        r"the reference centre distance is 75 mm \(20 and 30 teeth, module 3 mm, helix angle 0 deg\); check them",
    ):
        gearbox_of(
            ("held_diameter_mm = 50.0 }", "held_diameter_mm = 50.0, profile_shift_from_centre_distance = true }"),
            ("centre_distance_mm = 75.0", "centre_distance_mm = 70.0"),
        )


def test_a_strength_of_an_unknown_gear_is_refused() -> None:
    """Losses would otherwise take usual roughnesses for the gear that the strength is meant for."""
    strength = (
        "sigma_H_lim_MPa = 1500.0, sigma_F_lim_MPa = 500.0, roughness_Rz_um = 4.8, root_factor = 0.95, "
        'curve = "case_hardened"'
    )
    with pytest.raises(GearboxFileError) as caught:
        gearbox_of(("[pairs]", f"[rating]\ndynamic_factor = 1.1\ngears.whel = {{ {strength} }}\n\n[pairs]"))
    assert caught.value.errors == (
        "case.toml: rating.gears.whel: no such gear; did you mean 'wheel'? gears are pinion, wheel",
    )


def test_an_unknown_gear_of_a_pair_is_told_instead_of_what_follows_from_it() -> None:
    with pytest.raises(GearboxFileError) as caught:
        gearbox_of(
            ("held_diameter_mm = 50.0 }", "held_diameter_mm = 50.0, profile_shift_from_centre_distance = true }"),
            ('pinion = "pinion"', 'pinion = "pinon"'),
        )
    assert caught.value.errors == (
        "case.toml: pairs.spur.pinion = 'pinon': no such gear; did you mean 'pinion'? gears are pinion, wheel",
    )


def test_a_tip_near_a_fillet_is_told_with_one_that_is_clear_and_fits_by_itself() -> None:
    """The wheel's tip ends 0.03 mm of roll length above the pinion's fillet, which a shallow rack makes high."""
    pinion = "held_diameter_mm = 30.0, profile_shift = 0.3, rack = { dedendum = 1.1, tip_radius = 0.4 } }"
    shallow = ("held_diameter_mm = 30.0 }", pinion)
    wheel = "held_diameter_mm = 50.0, profile_shift = -0.3, tip_diameter_mm = {}"
    pair = gearbox_of(shallow, ("held_diameter_mm = 50.0", wheel.format(93.0))).pairs["spur"].pair
    roll = pair.base_tangent_length - pair.pinion.form_roll_length - 0.03e-3
    near = 2e3 * math.hypot(pair.gear.base_radius, roll)
    told = gearbox_of(shallow, ("held_diameter_mm = 50.0", wheel.format(near)))
    line = next(
        one for one in told.warnings if one.startswith("gears.wheel: its tip meets pinion 0.030 mm of roll length")
    )
    proposed = float(line.split("tip_diameter_mm = ")[1].split(",")[0])
    assert proposed < near
    fitted = gearbox_of(shallow, ("held_diameter_mm = 50.0", f"{wheel.format(near)}, fitted_tip = true"))
    assert 2e3 * fitted.gears["wheel"].tip_radius == pytest.approx(proposed, abs=1e-3)
    assert not any("gears.wheel: its tip" in line for line in fitted.warnings)


def test_undercut_is_told_as_a_warning() -> None:
    gearbox = gearbox_of(
        (
            "teeth = 20, normal_module_mm = 3.0, face_width_mm = 15.0, held_diameter_mm = 30.0",
            "teeth = 12, normal_module_mm = 3.0, face_width_mm = 15.0, held_diameter_mm = 20.0",
        ),
        ("centre_distance_mm = 75.0", "centre_distance_mm = 63.0"),
        ("axis_position_mm = [75.0, 0.0]", "axis_position_mm = [63.0, 0.0]"),
        ("outer_diameter_mm = 35.0", "outer_diameter_mm = 26.0"),
    )
    assert any(line.startswith("gears.pinion: undercut by its rack") for line in gearbox.warnings)


def test_a_body_that_only_spins_and_a_fixed_one_need_no_place():
    content = tomllib.loads(SPUR_CASE)
    content["bodies"]["brake"] = {"spin_only": True, "inertia": {"disc": {"axial_kg_m2": 0.1}}}
    content["bodies"]["floor"] = {"fixed": True}
    content["couplings"] = {"shaft": {"bodies": ["brake", "shaft_2"], "stiffness_N_m_per_rad": 1e5}}
    bodies = Gearbox.from_dict(content, "spur.toml").named_bodies
    assert bodies["brake"].axis == bodies["shaft_2"].axis
    assert bodies["floor"].axis == (0.0, 0.0)
    del content["bodies"]["shaft_1"]["axis_position_mm"]
    with pytest.raises(GearboxFileError, match=r"bodies.shaft_1: set either axis_position_mm"):
        Gearbox.from_dict(content, "spur.toml")


def test_a_changed_path_with_a_typing_error_names_the_nearest_and_makes_no_entry():
    gearbox = Gearbox.from_dict(tomllib.loads(SPUR_CASE), "spur.toml")
    with pytest.raises(
        GearboxFileError, match=r"gears.pinon.teeth: the file has no entry .* did you mean gears.pinion.teeth\?"
    ):
        gearbox.varied({"gears.pinon.teeth": 21})
    case = gearbox.varied({"load_cases.coast.torques_N_m": {"shaft_1": -10.0}, "load_cases.coast.duration_s": 0.5})
    assert case.load_cases["coast"].duration == 0.5


def test_blanks_at_bearings_and_where_torques_act_count_in_the_inertia() -> None:
    """Two rings beside the 0.5 kg one of the wheel: masses and axial moments add up, places give the centre."""
    rings = """
blanks.two = { mass_kg = 3.0, axial_kg_m2 = 4e-3, transverse_kg_m2 = 3e-3 }
blanks.torque = { mass_kg = 2.0, axial_kg_m2 = 2e-3, transverse_kg_m2 = 1e-3 }
torque_z_mm = 90.0
"""
    place = "sections = [{ length_mm = 80.0, outer_diameter_mm = 50.0 }]"
    plain = gearbox_of().body("two")
    body = gearbox_of((place, place + rings)).body("two")
    assert body.mass == pytest.approx(plain.mass + 5.0, rel=1e-12)
    assert body.axial == pytest.approx(plain.axial + 6e-3, rel=1e-12)
    moment = plain.mass * plain.centre_of_mass_z + 3.0 * 0.030 + 2.0 * 0.090
    assert body.centre_of_mass_z == pytest.approx(moment / body.mass, rel=1e-12)


@pytest.mark.parametrize("name", ["pinion", "one_left", "torque", "tow"])
def test_a_blank_on_a_seat_that_the_body_does_not_have_is_refused(name: str) -> None:
    with pytest.raises(GearboxFileError, match=f"bodies.two.shape.blanks.{name}: no such seat .* seats are wheel, two"):
        gearbox_of(("blanks.wheel", f"blanks.{name}"))


ROTOR = """
name = "shaft with a disc at a bearing"
default_inertias = "usual"
overall = { input = "motor", output = "shaft" }
static_load = { torques_N_m = { motor = 1.0 }, locked = ["shaft"] }
elasticity = { band_Hz = 600.0, limit_Hz = 1200.0 }
couplings.shaft = { bodies = ["motor", "shaft"], stiffness_N_m_per_rad = 1e-2 }
[bodies.motor]
axis_position_mm = [0.0, 0.0]
spin_only = true
inertia.usual = { axial_kg_m2 = 1.0 }
[bodies.shaft]
axis_position_mm = [0.0, 0.0]
[bodies.shaft.shape]
start_z_mm = 0.0
sections = [{ length_mm = 4340.0, outer_diameter_mm = 300.0 }, { length_mm = 1460.0, outer_diameter_mm = 220.0 }]
material = { youngs_modulus_GPa = 207.0, poissons_ratio = 0.301887, density_kg_per_m3 = 7800.0 }
blanks.generator = { mass_kg = 525.7, axial_kg_m2 = 32.2, transverse_kg_m2 = 16.1 }
[bearings]
left = { body = "shaft", z_mm = 5.0, stiffness = { radial_N_per_m = 183.9e6, axial_N_per_m = 1e3 } }
right = { body = "shaft", z_mm = 5500.0, stiffness = { radial_N_per_m = 183.9e6, axial_N_per_m = 1e3 } }
generator = { body = "shaft", z_mm = 100.0, stiffness = { radial_N_per_m = 1.0 } }
[load_cases.run]
torques_N_m = { motor = 1.0, shaft = -1.0 }
duration_s = 0.1
"""


def test_a_disc_at_a_bearing_lowers_the_frequencies_of_a_rigid_rotor_on_two_springs() -> None:
    """51.233 and 87.409 Hz by the closed form for heave and pitch; without the disc 57.31 and 100.92 Hz."""
    gearbox = Gearbox.from_dict(tomllib.loads(ROTOR), "rotor.toml")
    found = eigenmodes(gearbox, Choice("bushing"), {}).frequency
    assert [round(f, 3) for f in found if f > 1.0] == pytest.approx([51.233, 51.233, 87.409, 87.409], abs=0.03)


def test_an_elastic_shaft_has_the_mass_of_a_disc_at_a_bearing() -> None:
    """The inertia set is what the shape and its blanks have by themselves, so nothing is taken away again."""
    gearbox = Gearbox.from_dict(tomllib.loads(ROTOR), "rotor.toml").varied({"bodies.shaft.flexibility": "elastic"})
    body = gearbox.body("shaft")
    of_shape = reduced_bodies(gearbox, "usual")["shaft"].shape_inertia
    assert of_shape.mass == pytest.approx(body.mass, rel=1e-3)
    assert of_shape.axial == pytest.approx(body.axial, rel=1e-3)
    assert of_shape.transverse == pytest.approx(body.transverse, rel=1e-3)


def test_pictures_show_a_disc_at_a_bearing_and_the_shaft_that_carries_it() -> None:
    """A thin disc of 525.7 kg and 32.2 kg m2 has a diameter of 0.7 m; the shaft is 5.8 m long."""
    gearbox = Gearbox.from_dict(tomllib.loads(ROTOR), "rotor.toml")
    (shape,) = bodies_of(gearbox)
    low, high = shape.surface.points.min(axis=0), shape.surface.points.max(axis=0)
    assert high[0] - low[0] == pytest.approx(0.700, abs=0.001)
    assert high[2] - low[2] == pytest.approx(5.8, abs=1e-9)
    elastic = assembled(gearbox.varied({"bodies.shaft.flexibility": "elastic"}), Choice("flexible"), {})
    assert [body.shape.name for body in drawn_bodies(elastic)] == ["shaft", "generator"]
