"""What files of the industry hold, one thing in each of these files: by import alone the loads are right.

Reactions are compared with balances by hand; what bearings do among themselves, with their rows in balance.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from exugear.exchange.rexs.to_case.conversion import to_case
from exugear.exchange.rexs.to_case.notes import Rules
from exugear.exchange.rexs.tree import RexsError
from exugear.gearbox.choice import Choice
from exugear.gearbox.sections.connections import CatalogueSection
from exugear.system.bearings.rolling.catalogue import catalogue_rows
from exugear.system.bearings.rolling.contact import equilibrium
from exugear.system.bearings.rolling.rows import BearingOfRows
from exugear.system.build import assemble
from exugear.system.operating_points import bearing_duties, reaction_loads
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness

from .own_files import OwnFile, spur_pair

RIGID = {
    "rotational_stiffness": 1e20,
    "radial_stiffness": 1e20,
    "axial_stiffness": 1e20,
    "bending_stiffness": 1e20,
}
"""A coupling that joins, in the units of the file."""


def imported(file, **rules):
    return to_case(file.model(), "own.rexs", rules=Rules(**rules))


def assembly(gearbox, tmp_path):
    choice = Choice("bushing", "iso6336")
    return assemble(gearbox, choice, mesh_stiffness(gearbox, "iso6336", tmp_path))


def reactions(gearbox, tmp_path):
    return reaction_loads(assembly(gearbox, tmp_path))


# -- bearings ------------------------------------------------------------------------------------------------

ROLLERS = {"diameter_of_rolling_element": 11.0, "length_of_rolling_element": 12.0}
CONES = {"diameter_of_rolling_element": 9.0, "length_of_rolling_element": 12.0}
SIZES = {"inner_diameter": 50.0, "outer_diameter": 90.0}
TORQUE, HELIX, BASE = 200.0, math.radians(20.0), 3.0 * 20 / (2.0 * math.cos(math.radians(20.0)))


def helical(bearings, turned=False):
    """Two shafts of 200 mm, helical gears of 20 and 40 teeth in their middles, the second on its own rigid bearings."""
    file = OwnFile()
    distance = 3.0 * 60 / (2.0 * math.cos(HELIX))
    first = file.shaft((0.0, 0.0, 0.0), [(0.0, 200.0, 50.0)], speed=1500.0)
    second = file.shaft((0.0, distance, 0.0), [(0.0, 200.0, 50.0)], speed=-750.0)
    if turned:  # the shaft points against the gear unit's u axis
        file.give(
            first, support_vector=(200.0, 0.0, 0.0), u_axis_vector=(-1.0, 0.0, 0.0), w_axis_vector=(0.0, 0.0, 1.0)
        )
        file.give(first, rotational_speed=-1500.0)
    gears = [
        file.gear(shaft, (100.0, v, 0.0), teeth, 3.0, helix_angle_reference_diameter=hand)
        for shaft, v, teeth, hand in ((first, 0.0, 20, 20.0), (second, distance, 40, -20.0))
    ]
    file.stage(*gears, distance)
    file.load(first, -TORQUE if turned else TORQUE)
    file.load(second, None)
    for u in (20.0, 180.0):
        file.stiff_bearing(second, (u, distance, 0.0))
    bearings(file, first)
    return file


def cylindrical(file, shaft, u, absorption, **given):
    return file.rolling_bearing(
        shaft,
        (u, 0.0, 0.0),
        [({"number_of_rolling_elements": 14}, ROLLERS)],
        bearing_type="radial_roller_bearing",
        width=20.0,
        axial_force_absorption=absorption,
        **SIZES,
        **given,
    )


def axial_force():
    """Force on the first shaft, towards +z: F_t tan(beta); right hand, driving about +z."""
    return TORQUE / (1e-3 * BASE) * math.tan(HELIX)


@pytest.mark.parametrize("turned", [False, True])
def test_of_two_cylindrical_bearings_with_one_rib_each_the_one_that_is_pushed_holds_the_shaft(turned, tmp_path):
    """The bearing at 20 mm holds a shaft pushed to -z, that at 180 mm one to +z. u of a turned shaft points to -z."""
    senses = ("positive", "negative") if turned else ("negative", "positive")

    def bearings(file, shaft):
        for u, sense in zip((20.0, 180.0), senses, strict=True):
            cylindrical(file, shaft, u, sense)

    gearbox = imported(helical(bearings, turned)).gearbox
    ribs = {b.name: b.catalogue.ribs for b in gearbox.bearings if b.catalogue is not None}
    assert sorted(ribs.values()) == ["+z", "-z"]
    assert {b.position[2]: ribs[b.name] for b in gearbox.bearings if b.name in ribs} == {0.02: "-z", 0.18: "+z"}
    duties = {duty.name: duty for duty in bearing_duties(assembly(gearbox, tmp_path))}
    by_rib = {ribs[name]: duty.axial_load for name, duty in duties.items()}
    assert by_rib["+z"] == pytest.approx(axial_force(), rel=1e-3)
    assert by_rib["-z"] == 0.0  # the other rib does not touch


def test_ribs_on_both_sides_hold_alone_and_a_stiffness_given_for_them_stands(tmp_path):
    def bearings(file, shaft):
        cylindrical(file, shaft, 20.0, "both_directions")
        cylindrical(file, shaft, 180.0, "no_direction")

    gearbox = imported(helical(bearings)).gearbox
    loads = [duty.axial_load for duty in bearing_duties(assembly(gearbox, tmp_path))]
    assert loads == pytest.approx([axial_force(), 0.0], rel=1e-3, abs=1e-6)

    def stiff(file, shaft):
        cylindrical(file, shaft, 20.0, "both_directions", axial_stiffness=3e8)
        cylindrical(file, shaft, 180.0, "no_direction")

    held = imported(helical(stiff)).gearbox.bearings
    assert [b.catalogue.ribs for b in held if b.catalogue] == ["none", "none"]
    assert [b.stiffness.axial_N_per_m for b in held if b.catalogue and b.stiffness] == [3e8]


def two_row_tapered(senses, **given):
    def bearings(file, shaft):
        rows = [
            ({"axial_force_absorption_of_row": sense, "pressure_angle": 15.0, "number_of_rolling_elements": 18}, CONES)
            for sense in senses
        ]
        file.rolling_bearing(
            shaft,
            (20.0, 0.0, 0.0),
            rows,
            bearing_type="radial_tapered_roller_bearing",
            width=40.0,
            number_of_bearing_rows=2,
            distance_between_bearing_rows=20.0,
            **SIZES,
            **given,
        )
        cylindrical(file, shaft, 180.0, "no_direction")

    return bearings


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    ("senses", "arrangement"),
    [(("negative", "positive"), "X"), (("positive", "negative"), "O"), (("positive", "positive"), "tandem")],
)
def test_two_rows_of_tapered_rollers_stand_as_their_order_and_senses_say(senses, arrangement, turned):
    catalogue = catalogue_of(helical(two_row_tapered(senses), turned), "tapered_roller")
    assert catalogue.arrangement == arrangement
    assert catalogue.width_mm == 20.0  # of one of two
    assert catalogue.row_distance_mm == 20.0
    if arrangement == "tandem":
        assert catalogue.locates_towards == ("-z" if turned else "+z")


def catalogue_of(file, kind):
    held = imported(file).gearbox.bearings
    return next(b.catalogue for b in held if b.catalogue is not None and b.catalogue.type == kind)


def test_an_x_holds_less_against_tilting_than_an_o_and_both_hold_the_shaft(tmp_path):
    """Reactions of the shaft by levers: half of the forces of the mesh, and the tilting moment of the axial one."""
    tilts = {}
    for senses in (("negative", "positive"), ("positive", "negative")):
        gearbox = imported(helical(two_row_tapered(senses))).gearbox
        duties = bearing_duties(assembly(gearbox, tmp_path))
        pair, other = duties
        found = {b.name: b.catalogue.arrangement for b in gearbox.bearings if b.catalogue is not None}
        tilts[found[pair.name]] = float(pair.stiffness[3, 3])
        assert pair.axial_load == pytest.approx(axial_force(), rel=1e-3)
        assert other.axial_load == 0.0
    assert tilts["O"] > 3.0 * tilts["X"]


def test_play_and_preload_of_a_pair_are_its_setting():
    file = helical(two_row_tapered(("negative", "positive"), operating_axial_bearing_clearance=0.05))
    assert catalogue_of(file, "tapered_roller").axial_preload_um == -50.0
    file = helical(two_row_tapered(("negative", "positive"), preload_distance=0.02))
    assert catalogue_of(file, "tapered_roller").axial_preload_um == 20.0


def test_rows_that_do_not_tell_how_they_stand_stay_blank():
    result = imported(helical(two_row_tapered((None, None))))
    assert any("rows with contact angles, whose orientation is not defined by" in line for line in result.changed)


def test_needles_without_rings_run_between_shaft_and_bore():
    """Bore 20, outer 26: two needles of 3 mm are all there is between."""

    def bearings(file, shaft):
        row = {"number_of_rolling_elements": 16, "reference_diameter": 23.0}
        for u in (20.0, 180.0):
            file.rolling_bearing(
                shaft,
                (u, 0.0, 0.0),
                [(row, {"diameter_of_rolling_element": 3.0, "length_of_rolling_element": 15.8})],
                bearing_type="radial_needle_roller_bearing",
                inner_diameter=20.0,
                outer_diameter=26.0,
                width=17.0,
                axial_force_absorption="both_directions",
            )

    rows = catalogue_rows(catalogue_of(helical(bearings), "needle_roller"))
    assert rows[0].element_diameter == pytest.approx(3e-3)
    assert rows[0].pitch_diameter == pytest.approx(23e-3)
    with pytest.raises(ValueError, match="element_diameter_mm = 3.1 must be below the 3 mm"):
        CatalogueSection(
            type="needle_roller", bore_mm=20.0, outer_diameter_mm=26.0, width_mm=17.0, element_diameter_mm=3.1
        )
    with pytest.raises(ValueError, match="element_diameter_mm = 3 must be below"):
        CatalogueSection(
            type="cylindrical_roller", bore_mm=20.0, outer_diameter_mm=26.0, width_mm=17.0, element_diameter_mm=3.0
        )


def test_radii_of_grooves_are_read_and_decide_on_the_axial_stiffness():
    """r over D_w of 0.515 against 0.53: the wider groove is softer along the axis by more than a tenth."""

    def groove(radius):
        def bearings(file, shaft):
            row = {"number_of_rolling_elements": 9, "reference_diameter": 60.0}
            row |= {"raceway_radius_of_inner_ring": radius, "raceway_radius_of_outer_ring": radius}
            for u in (20.0, 180.0):
                file.rolling_bearing(
                    shaft,
                    (u, 0.0, 0.0),
                    [(row, {"diameter_of_rolling_element": 12.0})],
                    bearing_type="radial_grooved_ball_bearing",
                    inner_diameter=40.0,
                    outer_diameter=80.0,
                    width=18.0,
                )

        return catalogue_of(helical(bearings), "deep_groove_ball")

    narrow, wide = groove(6.18), groove(6.36)
    assert (narrow.inner_groove_ratio, narrow.outer_groove_ratio) == (0.515, 0.515)
    assert (wide.inner_groove_ratio, wide.outer_groove_ratio) == (0.53, 0.53)
    moved = [
        equilibrium(BearingOfRows(catalogue_rows(one)), (0.0, 0.0, 2000.0), tilt=np.zeros(2)).displacement[2]
        for one in (narrow, wide)
    ]
    assert moved[1] > 1.1 * moved[0]


def test_a_spherical_roller_thrust_bearing_holds_the_shaft_its_way(tmp_path):
    def bearings(file, shaft):
        for u in (20.0, 180.0):
            cylindrical(file, shaft, u, "no_direction")
        file.rolling_bearing(
            shaft,
            (40.0, 0.0, 0.0),
            bearing_type="axial_self_aligning_roller_bearing",
            inner_diameter=60.0,
            outer_diameter=130.0,
            width=42.0,
            axial_force_absorption="positive",
            axial_dynamic_load_rating=390.0,
            axial_static_load_rating=915.0,
            fatigue_limit_load=112.0,
        )

    gearbox = imported(helical(bearings)).gearbox
    catalogues = {b.catalogue.type: b.catalogue for b in gearbox.bearings if b.catalogue}
    thrust = catalogues["thrust_spherical_roller"]
    assert (thrust.locates_towards, thrust.dynamic_rating_kN, thrust.static_rating_kN) == ("+z", 390.0, 915.0)
    assert thrust.fatigue_load_limit_kN == 112.0
    duties = {duty.kind: duty for duty in bearing_duties(assembly(gearbox, tmp_path))}
    assert duties["thrust_spherical_roller"].axial_load == pytest.approx(axial_force(), rel=1e-3)


# -- couplings -----------------------------------------------------------------------------------------------


def planetary(sun_coupling):
    """Input shaft, coupling, sun of 24 teeth, three planets of 24, ring of 72 in the casing, carrier on bearings."""
    file = OwnFile()
    file.give(
        file.unit,
        account_for_gravity=True,
        direction_vector_gravity_u=0.0,
        direction_vector_gravity_v=-1.0,
        direction_vector_gravity_w=0.0,
    )
    file.input = file.shaft((-200.0, 0.0, 0.0), [(0.0, 150.0, 60.0)], speed=1500.0)
    for u in (-180.0, -80.0):
        file.stiff_bearing(file.input, (u, 0.0, 0.0))
    sun = file.shaft((-50.0, 0.0, 0.0), [(0.0, 100.0, 50.0)], speed=1500.0)
    file.coupling(file.input, sun, (-50.0, 0.0, 0.0), **sun_coupling)
    file.load(file.input, 500.0)
    ring_shaft = file.shaft((0.0, 0.0, 0.0), [(0.0, 40.0, 400.0, 340.0)])
    file.coupling(ring_shaft, file.casing, (0.0, 0.0, 0.0), **RIGID)
    carrier = file.shaft((60.0, 0.0, 0.0), [(0.0, 100.0, 80.0)])
    for u in (80.0, 150.0):
        file.stiff_bearing(carrier, (u, 0.0, 0.0))
    file.load(carrier, None)
    stage = file.add("planetary_stage")
    plate = file.add("side_plate", support_vector=(50.0, 0.0, 0.0), length=10.0, outer_diameter=260.0)
    file.coupling(carrier, plate, (55.0, 0.0, 0.0), **RIGID)
    file.relate("planet_carrier_shaft", planetary_stage=stage, shaft=carrier)
    wheels = [file.gear(sun, (20.0, 0.0, 0.0), 24, 4.0, face_width=40.0)]
    wheels += [file.gear(ring_shaft, (20.0, 0.0, 0.0), 72, 4.0, face_width=40.0, ring=True)]
    for number in range(3):
        planet(file, stage, plate, wheels, 96.0, 120.0 * number)
    return file


def planet(file, stage, plate, mates, radius, degrees, teeth=24, u=20.0, shift=0.0):
    """Planet of a face of 40 mm on a pin in the plate, in mesh with its mates."""
    v, w = (round(radius * turn(math.radians(degrees)), 9) for turn in (math.cos, math.sin))
    pin = file.shaft((u - 30.0, v, w), [(0.0, 70.0, 30.0)])
    file.relate("planet_pin", planetary_stage=stage, shaft=pin)
    file.coupling(pin, plate, (55.0, v, w), **RIGID)
    shaft = file.shaft((u - 20.0, v, w), [(0.0, 40.0, 60.0, 30.0)])
    file.relate("planet_shaft", planetary_stage=stage, shaft=shaft)
    gear = file.gear(shaft, (u, v, w), teeth, 4.0, face_width=40.0, shift=shift)
    file.stiff_bearing(shaft, (u, v, w), on=pin, bending_stiffness=1e9)
    for mate in mates:
        file.stage(mate, gear) if mate == mates[0] else file.stage(gear, mate)
    return gear


FLOATING = {
    "rotational_stiffness": 1e20,
    "radial_stiffness": 1e5,
    "axial_stiffness": 1e20,
    "bending_stiffness": 1e6,
}


def test_a_sun_behind_a_coupling_soft_across_the_axis_floats_and_hands_no_weight_on(tmp_path):
    """The input's bearings carry the input alone; joined rigidly they carry the overhanging sun, too."""
    floating = imported(planetary(FLOATING)).gearbox
    (coupling,) = floating.couplings
    held = next(bearing for bearing in floating.bearings if bearing.name == coupling.seat)
    assert {coupling.first, coupling.second} == {held.body, held.on} == {"shaft_1", "shaft_2"}
    stiffness = held.stiffness
    assert (stiffness.radial_N_per_m, stiffness.axial_N_per_m, stiffness.tilt_N_m_per_rad) == (1e5, 1e10, 1e3)
    assert coupling.stiffness == pytest.approx(1e10 * 0.048**2, rel=0.01)
    masses = {body.name: body.mass for body in floating.bodies()}
    loads = reactions(floating, tmp_path)
    own = abs(loads["bearing_1"][0] + loads["bearing_2"][0])
    handed_on = abs(loads[held.name][0])
    assert handed_on < 0.1 * 9.81 * masses["shaft_2"]  # its teeth hold it, the coupling what is out of their middle
    assert own == pytest.approx(9.81 * masses["shaft_1"] + handed_on, rel=1e-3)
    rigid = imported(planetary(RIGID)).gearbox
    assert not rigid.couplings
    joined = reactions(rigid, tmp_path)
    assert abs(joined["bearing_2"][0]) > 1.2 * abs(loads["bearing_2"][0])


def test_what_a_coupling_says_nothing_of_is_as_rigid_as_its_torsion():
    gearbox = imported(planetary({"radial_stiffness": 1e5})).gearbox
    (held,) = [one for one in gearbox.bearings if one.stiffness is not None and one.stiffness.radial_N_per_m == 1e5]
    assert (held.stiffness.axial_N_per_m, held.stiffness.tilt_N_m_per_rad) == (1e10, 1e7)
    assert len(gearbox.couplings) == 1
    assert not imported(planetary({})).gearbox.couplings


def test_a_ring_that_the_casing_holds_against_turning_alone_is_told_as_fixed():
    file = planetary(RIGID)
    couplings = [part.number for part in file.model().components_of_type("coupling")]
    file.give(couplings[1], radial_stiffness=1e6)
    result = imported(file)
    assert any("and is elastic otherwise; modelled as rigid, since a body" in line for line in result.changed)
    assert result.gearbox.train.ratio == pytest.approx(0.25)


# -- gears ---------------------------------------------------------------------------------------------------


def test_planets_on_two_orbits_are_two_sets(tmp_path):
    """A Ravigneaux set whose short and long planets have 18 teeth each: the small sun drives short planets, these the
    long ones, these the ring. By hand: ratio of sun to carrier with the ring held, 1 - 84/30."""
    file = OwnFile()
    sun = file.shaft((-80.0, 0.0, 0.0), [(0.0, 120.0, 60.0)], speed=1500.0)
    for u in (-70.0, -20.0):
        file.stiff_bearing(sun, (u, 0.0, 0.0), bending_stiffness=1e9)
    file.load(sun, 300.0)
    ring_shaft = file.shaft((0.0, 0.0, 0.0), [(0.0, 40.0, 400.0, 340.0)])
    file.coupling(ring_shaft, file.casing, (0.0, 0.0, 0.0), **RIGID)
    carrier = file.shaft((60.0, 0.0, 0.0), [(0.0, 100.0, 80.0)])
    for u in (80.0, 150.0):
        file.stiff_bearing(carrier, (u, 0.0, 0.0), bending_stiffness=1e9)
    file.load(carrier, None)
    stage = file.add("planetary_stage")
    plate = file.add("side_plate", support_vector=(50.0, 0.0, 0.0), length=10.0, outer_diameter=260.0)
    file.coupling(carrier, plate, (55.0, 0.0, 0.0), **RIGID)
    file.relate("planet_carrier_shaft", planetary_stage=stage, shaft=carrier)
    sun_gear = file.gear(sun, (20.0, 0.0, 0.0), 30, 4.0, face_width=40.0)
    ring = file.gear(ring_shaft, (20.0, 0.0, 0.0), 84, 4.0, face_width=40.0, ring=True)
    inner, outer, between = 2.0 * (30 + 18), 2.0 * (84 - 18), 2.0 * (18 + 18)
    turn = math.degrees(math.acos((inner**2 + outer**2 - between**2) / (2.0 * inner * outer)))
    for number in range(3):
        # The short planet of the last pair stands before the long one of the first in the order of angles.
        degrees = 120.0 * number - 0.5 * turn
        short = planet(file, stage, plate, [sun_gear], inner, degrees, 18)
        planet(file, stage, plate, [short, ring], outer, degrees + turn, 18)
    gearbox = imported(file).gearbox
    sets = [body for body in gearbox.case.bodies.values() if body.carrier]
    assert [body.orbit_radius_mm for body in sets] == [inner, outer]
    assert [len(body.planet_angles_deg) for body in sets] == [3, 3]
    assert gearbox.train.ratio == pytest.approx(1.0 / (1.0 - 84 / 30))
    loads = reactions(gearbox, tmp_path)
    assert (
        max(np.abs(load[0]) + np.abs(load[1]) for name, load in loads.items() if name in ("bearing_1", "bearing_2"))
        < 1e-3
    )
    # The short planet between sun and long planet: two equal forces on the base circle, F_bt = M / (3 r_b).
    force = 300.0 / (3 * 0.060 * math.cos(math.radians(20.0)))
    pins = [name for name, load in loads.items() if name.endswith("_1") and np.hypot(load[0], load[1]) > 100.0]
    assert len(pins) == 2
    assert all(np.hypot(*loads[name][:2]) < 2.0 * force for name in pins)


def shifted_pair(shifts, distance=91.5):
    """Teeth 20 and 40, m_n 3, 91.5 mm apart in place of 90."""
    file, shafts = spur_pair()
    gears = [part.number for part in file.model().components_of_type("cylindrical_gear")]
    flanks = [part.number for part in file.model().components_of_type("cylindrical_gear_flank")]
    for number, shift in zip(flanks, np.repeat(np.array(shifts), 2).tolist(), strict=True):
        file.give(number, addendum_modification_coefficient=shift)
    for part in file.model().components.values():
        vector = part.vector("support_vector") if part.given("support_vector") else None
        if vector is not None and vector[1] == 90.0:
            file.give(part.number, support_vector=(vector[0], distance, vector[2]))
    file.give(file.model().components_of_type("cylindrical_stage")[0].number, center_distance=distance)
    del shafts, gears
    return file


def asked_for(distance):
    """Sum of profile shifts without backlash (ISO 21771): (inv(alpha_w) - inv(alpha)) (z_1 + z_2) / (2 tan(alpha))."""
    angle = math.radians(20.0)
    working = math.acos(90.0 * math.cos(angle) / distance)
    turned = math.tan(working) - working - (math.tan(angle) - angle)
    return turned * 60 / (2.0 * math.tan(angle))


def test_one_shift_of_zero_that_cannot_be_is_that_of_the_centre_distance():
    result = imported(shifted_pair((0.3, 0.0)))
    shifts = [gear.profile_shift for gear in result.gearbox.gears.values()]
    assert shifts == pytest.approx([0.3, asked_for(91.5) - 0.3], abs=1e-6)
    assert any("contradicts the centre distances and is treated as missing:" in t for t in result.changed)


def test_two_shifts_that_cannot_be_are_refused_with_what_the_centre_distance_offers():
    with pytest.raises(RexsError, match=rf"requires {asked_for(91.5):.5f}; .*--shifts centre-distance, which replaces"):
        imported(shifted_pair((0.0, 0.0)))
    with pytest.raises(RexsError, match="--shifts centre-distance"):
        imported(shifted_pair((0.2, 0.1)))
    for given, expected in (((0.0, 0.0), (asked_for(91.5), 0.0)), ((0.2, 0.1), (asked_for(91.5) - 0.1, 0.1))):
        gears = imported(shifted_pair(given), shifts="centre-distance").gearbox.gears.values()
        assert [gear.profile_shift for gear in gears] == pytest.approx(expected, abs=1e-6)


def test_of_centre_distance_and_positions_those_count_that_agree_with_the_shifts():
    total = asked_for(91.5)
    file = shifted_pair((total, 0.0))
    stage = file.model().components_of_type("cylindrical_stage")[0].number
    file.give(stage, center_distance=90.7)
    result = imported(file)
    assert result.gearbox.pairs["stage_1"].pair.centre_distance == pytest.approx(91.5e-3)
    assert any("the positions count, with which the profile shifts agree" in line for line in result.changed)
    moved = shifted_pair((total, 0.0))
    for part in moved.model().components.values():
        vector = part.vector("support_vector") if part.given("support_vector") else None
        if vector is not None and vector[1] == 91.5:
            moved.give(part.number, support_vector=(vector[0], 0.0, 90.7))
    result = imported(moved)
    assert any("axes are moved to the first, with which the profile shifts agree" in line for line in result.changed)
    assert result.gearbox.case.bodies["shaft_2"].axis_position_mm == pytest.approx((0.0, 91.5))


def test_where_the_shifts_agree_with_neither_distance_an_option_decides():
    file = shifted_pair((0.4, 0.0))
    file.give(file.model().components_of_type("cylindrical_stage")[0].number, center_distance=90.7)
    with pytest.raises(RexsError, match="--distances positions or --distances file"):
        imported(file)
    for rule, distance in (("positions", 91.5e-3), ("file", 90.7e-3)):
        gearbox = imported(file, distances=rule).gearbox  # the shift of 0.0 follows
        assert gearbox.pairs["stage_1"].pair.centre_distance == pytest.approx(distance)
        assert gearbox.meshes[0].centre_distance == pytest.approx(distance)


def test_gears_of_two_racks_with_one_base_pitch_mesh_as_involutes_do(tmp_path):
    """Racks of 8.857 1/in at 24.60 deg and of 9.143 1/in at 20.19 deg: p_b = pi m cos(alpha) of both is 8.191 mm."""
    racks = [(25.4 / 8.857, 24.60), (25.4 / 9.143, 20.19)]
    bases = [module * math.cos(math.radians(angle)) for module, angle in racks]
    assert bases[0] == pytest.approx(bases[1], rel=1e-4)
    file = OwnFile()
    teeth, shafts, gears = (27, 35), [], []
    # Without shifts on their own circles they roll there: alpha_w follows from s_1 + s_2 = p_w.
    half = [
        0.5 * math.pi / z + math.tan(math.radians(a)) - math.radians(a) for z, (_, a) in zip(teeth, racks, strict=True)
    ]
    inv = (half[0] * teeth[0] + half[1] * teeth[1] - math.pi) / sum(teeth)
    working = 0.4
    for _ in range(50):
        working -= (math.tan(working) - working - inv) / math.tan(working) ** 2
    distance = sum(teeth) * bases[0] / (2.0 * math.cos(working))
    for z, v, (module, angle), speed in zip(teeth, (0.0, distance), racks, (1350.0, None), strict=True):
        shaft = file.shaft((0.0, v, 0.0), [(0.0, 100.0, 30.0)], speed=speed)
        for u in (10.0, 90.0):
            file.stiff_bearing(shaft, (u, v, 0.0))
        shafts.append(shaft)
        gears.append(file.gear(shaft, (50.0, v, 0.0), z, module, angle=angle, tip_diameter=module * (z + 1.6)))
        file.load(shaft, 100.0 if z == 27 else None)
    file.stage(gears[0], gears[1], round(distance, 6))
    result = imported(file)
    assert any("has the base pitch of" in line for line in result.changed)
    one, other = result.gearbox.gears.values()
    assert (other.normal_module, other.normal_pressure_angle) == (one.normal_module, one.normal_pressure_angle)
    assert other.base_radius == pytest.approx(0.5e-3 * 35 * bases[1], rel=1e-4)
    assert 2e3 * other.tip_radius == pytest.approx(racks[1][0] * 36.6)
    assert 2e3 * other.root_radius == pytest.approx(racks[1][0] * (35 - 2.5), rel=1e-6)
    # Tooth thickness at the base circle: 2 r_b (pi / (2 z) + inv(alpha)), of the own rack, less the thinning.
    thickness = 2.0 * other.base_radius * (half[1] - 0.02 / 35)
    assert 2.0 * other.base_radius * other.half_angle(other.base_radius) == pytest.approx(thickness, rel=2e-4)
    assert one.profile_shift == 0.0
    loads = reactions(result.gearbox, tmp_path)
    across = sum(loads[name][:2] for name in ("bearing_1", "bearing_2"))
    assert np.hypot(*across) == pytest.approx(100.0 / one.base_radius, rel=1e-3)
