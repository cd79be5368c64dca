"""Rows from catalogue sections: estimates against known bearings, types, pairs, profiles; refusals by key."""

import math
from typing import get_args

import numpy as np
import pytest

from exugear.gearbox.sections.connections import BearingType, CatalogueSection
from exugear.system.bearings.rolling.catalogue import catalogue_rows, estimates, with_estimate
from exugear.system.bearings.rolling.contact import (
    element_loads,
    equilibrium,
    pitch_averaged_tangent,
    row_contacts,
)
from exugear.system.bearings.rolling.point_contact import ball_pressure, elliptic_contact
from exugear.system.bearings.rolling.rows import BallRow, BearingError, BearingOfRows, RollerRow

TYPES = get_args(BearingType)
SIZES = [(10.0, 26.0, 8.0), (25.0, 52.0, 15.0), (160.0, 290.0, 80.0), (400.0, 500.0, 46.0), (1000.0, 1220.0, 128.0)]


def section(kind, bore=50.0, outer=90.0, width=20.0, **keys):
    return CatalogueSection(type=kind, bore_mm=bore, outer_diameter_mm=outer, width_mm=width, **keys)


def estimate(of, key):
    (found,) = [each for each in estimates(of) if each.key == key]
    return found


# SKF, General Catalogue (2008), needle roller bearings Rolling Bearings (2017): d, D, B in mm, static rating in kN; of
# tapered roller bearings T, and the contact angle that 1.5 tan(alpha) = e gives.
PRINTED = {
    "6205": ("deep_groove_ball", 25, 52, 15, 7.8, {}),
    "6210": ("deep_groove_ball", 50, 90, 20, 23.2, {}),
    "6220": ("deep_groove_ball", 100, 180, 34, 93, {}),
    "6310": ("deep_groove_ball", 50, 110, 27, 38, {}),
    "6020": ("deep_groove_ball", 100, 150, 24, 54, {}),
    "7210 B": ("angular_contact_ball", 50, 90, 20, 31, {}),
    "7218 B": ("angular_contact_ball", 90, 160, 30, 104, {}),
    "7310 B": ("angular_contact_ball", 50, 110, 27, 51, {}),
    "1206": ("self_aligning_ball", 30, 62, 16, 4.65, {}),
    "1310": ("self_aligning_ball", 50, 110, 27, 14, {}),
    "2210": ("self_aligning_ball", 50, 90, 23, 11.2, {}),
    "QJ 210": ("four_point_ball", 50, 90, 20, 61, {}),
    "QJ 220": ("four_point_ball", 100, 180, 34, 240, {}),
    "NU 205 E": ("cylindrical_roller", 25, 52, 15, 27, {}),
    "NU 210 E": ("cylindrical_roller", 50, 90, 20, 69.5, {}),
    "NU 2220 E": ("cylindrical_roller", 100, 180, 46, 450, {}),
    "NJ 2232 E": ("cylindrical_roller", 160, 290, 80, 1200, {}),
    "NU 330 E": ("cylindrical_roller", 150, 320, 65, 965, {}),
    "NCF 2930": ("cylindrical_roller", 150, 210, 36, 490, {"full_complement": True}),
    "NCF 3020": ("cylindrical_roller", 100, 150, 37, 310, {"full_complement": True}),
    "NCF 1880": ("cylindrical_roller", 400, 500, 46, 1340, {"full_complement": True}),
    "NA 4904": ("needle_roller", 20, 37, 17, 28, {}),
    "NA 4910": ("needle_roller", 50, 72, 22, 85, {}),
    "NA 4840": ("needle_roller", 200, 250, 50, 735, {}),
    "30206": ("tapered_roller", 30, 62, 17.25, 44, {"contact_angle_deg": 14.0}),
    "32222": ("tapered_roller", 110, 200, 56, 570, {"contact_angle_deg": 16.0}),
    "32032 X": ("tapered_roller", 160, 240, 51, 780, {"contact_angle_deg": 17.0}),
    "32948": ("tapered_roller", 240, 320, 51, 1080, {"contact_angle_deg": 17.0}),
    "22210": ("spherical_roller", 50, 90, 23, 108, {}),
    "22228": ("spherical_roller", 140, 250, 68, 900, {}),
    "23032": ("spherical_roller", 160, 240, 60, 880, {}),
}


def static_rating(rows, kind):
    """ISO 76, kN: pressures of 4200 MPa (self-aligning balls 4600) and of 4000 MPa for rollers under 5 C0 / (Z cos)."""
    row = rows[0]
    carrying = len(rows) * row.element_count * math.cos(row.contact_angle)
    if isinstance(row, RollerRow):
        return 44e3 * (1.0 - row.diameter_ratio) * carrying * row.effective_length * row.element_diameter
    pressure = 4600e6 if kind == "self_aligning_ball" else 4200e6
    return 1e-3 * carrying * (pressure / ball_pressure(row)) ** 3 / 5.0


@pytest.mark.parametrize("name", PRINTED)
def test_estimated_bearings_have_the_static_rating_of_the_catalogue(name):
    kind, bore, outer, width, printed, keys = PRINTED[name]
    rows = catalogue_rows(section(kind, float(bore), float(outer), float(width), **keys))
    # Nine tenths of 680 bearings lie within the ranges of `exugear.system.bearings.rolling.dimensions`, 0.71 to 1.27
    # in all.
    assert static_rating(rows, kind) == pytest.approx(printed, rel=0.3)


# Bearings whose inside is published: elements per row, their diameter, pitch diameter and length in mm.
KNOWN = {
    # Case Western Reserve University, bearing data center; Harris and Kotzalas, Rolling Bearing Analysis.
    "6205": (
        "deep_groove_ball",
        25,
        52,
        15,
        {"element_count": 9, "element_diameter_mm": 7.94, "pitch_diameter_mm": 39.04},
    ),
    "6203": (
        "deep_groove_ball",
        17,
        40,
        12,
        {"element_count": 8, "element_diameter_mm": 6.746, "pitch_diameter_mm": 28.5},
    ),
    "209": (
        "deep_groove_ball",
        45,
        85,
        19,
        {"element_count": 9, "element_diameter_mm": 12.7, "pitch_diameter_mm": 65.0},
    ),
    "218": (
        "angular_contact_ball",
        90,
        160,
        30,
        {"element_count": 16, "element_diameter_mm": 22.23, "pitch_diameter_mm": 125.26, "contact_angle_deg": 40.0},
    ),
    "N 209": (
        "cylindrical_roller",
        45,
        85,
        19,
        {"element_count": 14, "element_diameter_mm": 10.0, "pitch_diameter_mm": 65.0, "element_length_mm": 9.6},
    ),
    "22317": (
        "spherical_roller",
        85,
        180,
        60,
        {
            "element_count": 14,
            "element_diameter_mm": 25.0,
            "pitch_diameter_mm": 135.08,
            "element_length_mm": 20.71,
            "contact_angle_deg": 12.0,
            "osculation": 79.959 / 81.585,
        },
    ),
}


@pytest.mark.parametrize("name", KNOWN)
def test_known_bearings_lie_within_the_estimates(name):
    kind, bore, outer, width, inside = KNOWN[name]
    of = section(kind, float(bore), float(outer), float(width))
    for key, known in inside.items():
        found = estimate(of, key)
        assert found.low * 0.995 <= known <= found.high * 1.005  # as printed
        of = with_estimate(of, found, known)
    assert {each.key for each in estimates(of)}.isdisjoint(inside)


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("full_complement", [False, True])
def test_both_ends_of_every_estimate_are_bearings(kind, size, full_complement):
    of = section(kind, *size, full_complement=full_complement)
    for found in estimates(of):
        assert found.low <= found.value <= found.high
        for end in (found.low, found.high):
            rows = catalogue_rows(with_estimate(of, found, end))
            assert all(row.element_count >= 3 for row in rows)


@pytest.mark.parametrize("kind", TYPES)
def test_a_bearing_without_open_keys_has_no_estimates(kind):
    of = section(kind)
    rows = catalogue_rows(of)
    for found in estimates(of):
        of = with_estimate(of, found, found.value)
    assert estimates(of) == ()
    assert catalogue_rows(of) == rows


def test_what_the_file_gives_is_taken():
    of = section(
        "cylindrical_roller",
        element_count=15,
        element_diameter_mm=11.0,
        element_length_mm=12.5,
        pitch_diameter_mm=70.5,
        radial_clearance_mm=0.02,
    )
    (row,) = catalogue_rows(of)
    given = (row.element_count, row.element_diameter, row.effective_length, row.pitch_diameter, row.radial_clearance)
    assert given == pytest.approx((15, 0.011, 0.0125, 0.0705, 20e-6), rel=1e-12)
    (balls,) = catalogue_rows(section("deep_groove_ball", inner_groove_ratio=0.505, outer_groove_ratio=0.53))
    assert (balls.inner_conformity, balls.outer_conformity) == (0.505, 0.53)


def test_a_given_number_of_elements_makes_smaller_ones():
    (row,) = catalogue_rows(section("cylindrical_roller", element_count=30))
    assert row.element_count == 30
    assert row.element_diameter < row.pitch_diameter * math.sin(math.pi / 30)


@pytest.mark.parametrize(
    ("kind", "bore", "outer", "printed"),
    [
        ("cylindrical_roller", 40.0, 80.0, 50.0),
        ("cylindrical_roller", 100.0, 180.0, 85.0),
        ("cylindrical_roller", 280.0, 420.0, 195.0),
        ("cylindrical_roller", 450.0, 600.0, 310.0),
        ("spherical_roller", 100.0, 180.0, 100.0),
        ("spherical_roller", 280.0, 420.0, 260.0),
        ("deep_groove_ball", 40.0, 80.0, 20.0),
        ("deep_groove_ball", 100.0, 180.0, 36.0),
        ("deep_groove_ball", 160.0, 290.0, 53.0),
        ("self_aligning_ball", 100.0, 180.0, 48.0),
        ("four_point_ball", 100.0, 180.0, 156.0 * math.tan(math.radians(35.0))),
    ],
)
def test_the_clearance_that_a_file_leaves_open_reaches_to_the_normal_group(kind, bore, outer, printed):
    # ISO 5753, as printed in SKF's General Catalogue (2008): greatest normal clearance of the step that ends here.
    found = estimate(section(kind, bore, outer, 0.3 * (outer - bore)), "radial_clearance_mm")
    assert found.value == found.low == 0.0
    assert 1e3 * found.high == pytest.approx(printed, rel=0.15)


# -- types, directions, places -------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["spherical_roller", "self_aligning_ball"])
def test_aligning_bearings_are_two_rows_that_point_to_the_middle(kind):
    lower, upper = catalogue_rows(section(kind))
    assert lower.aligning
    assert upper.aligning
    assert upper.contact_angle == -lower.contact_angle > 0.0
    for row in (lower, upper):
        assert row.axial_position == pytest.approx(0.5 * row.pitch_diameter * math.tan(row.contact_angle))
    state = equilibrium(BearingOfRows((lower, upper)), (2e3, 0.0, 200.0), tilt=(0.01, 0.02))
    np.testing.assert_allclose(state.load[3:], 0.0, atol=1e-9)


def test_barrels_of_a_spherical_roller_bearing_carry_more_of_their_length_under_load():
    rows = catalogue_rows(section("spherical_roller", 140.0, 250.0, 68.0))
    shares = []
    for force in (4e3, 400e3):
        state = equilibrium(BearingOfRows(rows), (force, 0.0, 0.0))
        shares.append(np.count_nonzero(state.lamina_load[0].max(axis=0)) / rows[0].laminae)
    assert shares[0] < 0.6 * shares[1]


@pytest.mark.parametrize("load", [1e3, 5e3])
def test_slices_of_a_barrel_stand_for_hertzs_ellipse_while_that_fits(load):
    # A barrel on raceways that it osculates is a point contact; slices without each other's help are 7 % off at most.
    row = catalogue_rows(section("spherical_roller", 140.0, 250.0, 68.0))[1]
    approach = 0.0
    for side in (-1.0, 1.0):
        along = 2.0 / (row.element_diameter * (1.0 + side * row.diameter_ratio))
        total = along + row.crown_curvature
        contact = elliptic_contact(total, (along - row.crown_curvature) / total)
        approach += contact.compliance * load ** (2.0 / 3.0)
    contacts = row_contacts((row,))
    normal = np.array([math.cos(row.contact_angle), 0.0, math.sin(row.contact_angle), 0.0, 0.0, 0.0])
    assert element_loads(contacts, approach * normal)[0] == pytest.approx(load, rel=0.12)  # 1.5 times 7 %


def test_one_row_of_barrels_stands_in_the_middle():
    (row,) = catalogue_rows(section("spherical_roller", row_count=1))
    assert (row.contact_angle, row.axial_position) == (0.0, 0.0)
    with pytest.raises(BearingError, match="bearing: no row carries an axial force of"):
        equilibrium(BearingOfRows((row,)), (1e3, 0.0, 10.0))


@pytest.mark.parametrize("kind", ["tapered_roller", "angular_contact_ball"])
@pytest.mark.parametrize(("towards", "sign"), [("+z", 1.0), ("-z", -1.0)])
def test_a_single_bearing_holds_the_direction_that_the_file_says(kind, towards, sign):
    bearing = BearingOfRows(catalogue_rows(section(kind, locates_towards=towards)))
    assert equilibrium(bearing, (0.0, 0.0, sign * 1e3)).load[2] == pytest.approx(sign * 1e3)
    with pytest.raises(BearingError, match="bearing: no row carries an axial force of"):
        equilibrium(bearing, (0.0, 0.0, -sign * 1e3))


@pytest.mark.parametrize("kind", ["tapered_roller", "angular_contact_ball"])
def test_o_pairs_tilt_stiffer_than_x_pairs(kind):
    stiff, soft = (
        pitch_averaged_tangent(BearingOfRows(catalogue_rows(section(kind, arrangement=each))), (2e3, 0.0, 500.0))[4, 4]
        for each in ("O", "X")
    )
    assert stiff > 2.0 * soft


def test_the_rows_of_tapered_pairs_stand_where_the_pressure_centres_of_the_catalogue_have_them():
    # SKF, General Catalogue (2008): 32222 T = 56, a = 46 mm from the back face of the outer ring, e = 0.43.
    tangent = 0.43 / 1.5
    angle = math.degrees(math.atan(tangent))
    for arrangement, distance in (("O", 2.0 * 46.0), ("X", 2.0 * (56.0 - 46.0))):
        rows = catalogue_rows(
            section("tapered_roller", 110.0, 200.0, 56.0, arrangement=arrangement, contact_angle_deg=angle)
        )
        centres = [row.axial_position - 0.5 * row.pitch_diameter * math.tan(row.contact_angle) for row in rows]
        assert 1e3 * abs(centres[1] - centres[0]) == pytest.approx(distance, abs=2.0)  # 0.42 T of its own 0.425


def test_four_points_are_two_rows_of_the_same_balls():
    lower, upper = catalogue_rows(section("four_point_ball"))
    assert lower.element_count == upper.element_count
    assert lower.contact_angle == -upper.contact_angle
    assert lower.axial_position == upper.axial_position == 0.0


@pytest.mark.parametrize("kind", ["cylindrical_roller", "needle_roller", "deep_groove_ball"])
def test_rows_in_one_bearing_stand_at_their_distance(kind):
    rows = catalogue_rows(section(kind, width=40.0, row_count=4, row_distance_mm=9.0))
    assert [row.axial_position for row in rows] == pytest.approx([-13.5e-3, -4.5e-3, 4.5e-3, 13.5e-3])
    if isinstance(rows[0], RollerRow):
        one = catalogue_rows(section(kind, width=10.0))[0]
        assert rows[0].effective_length == pytest.approx(one.effective_length)


def test_axial_preload_closes_a_pair_by_half_in_each_row():
    pair = section("tapered_roller", arrangement="O", contact_angle_deg=15.0, axial_preload_um=20.0)
    for row in catalogue_rows(pair):
        assert row.radial_clearance == pytest.approx(-20e-6 * math.tan(math.radians(15.0)))
    for row in catalogue_rows(section("angular_contact_ball", arrangement="O", axial_preload_um=20.0)):
        apart = np.array([math.cos(row.contact_angle), math.sin(abs(row.contact_angle))]) * row.groove_distance
        apart[0] -= 0.5 * row.radial_clearance
        nominal = math.radians(40.0)
        expected = row.groove_distance * np.array([math.cos(nominal), math.sin(nominal)]) + [0.0, 10e-6]
        np.testing.assert_allclose(apart, expected, rtol=1e-12)


def test_a_hotter_inner_ring_takes_clearance_and_preloads_pairs():
    """alpha d_m times the difference of temperatures, 11e-6 70 mm 10 K = 7.7 um on the diameter."""
    for kind in ("deep_groove_ball", "cylindrical_roller", "spherical_roller"):
        cold, hot = (
            catalogue_rows(section(kind, radial_clearance_mm=0.03, inner_ring_hotter_K=kelvin))[0]
            for kelvin in (0.0, 10.0)
        )
        assert cold.radial_clearance - hot.radial_clearance == pytest.approx(7.7e-6, rel=1e-9)
    angle = math.radians(15.0)
    pair = {"arrangement": "O", "contact_angle_deg": 15.0}
    hot = catalogue_rows(section("tapered_roller", inner_ring_hotter_K=10.0, **pair))
    # The radial growth of a raceway on the cone is an axial approach of both rows by twice its cotangent.
    preloaded = catalogue_rows(section("tapered_roller", axial_preload_um=7.7 / math.tan(angle), **pair))
    for one, other in zip(hot, preloaded, strict=True):
        assert one.radial_clearance == pytest.approx(other.radial_clearance, rel=1e-9)


# -- profiles ------------------------------------------------------------------------------------------------------


def test_the_standard_profile_is_that_of_iso_16281():
    (short,) = catalogue_rows(section("cylindrical_roller", element_diameter_mm=10.0, element_length_mm=12.0))
    assert short.drop(np.array([0.0, 3e-3])) == pytest.approx([0.0, -0.00035 * 10e-3 * math.log(1.0 - 0.25)])
    (tapered,) = catalogue_rows(section("tapered_roller", element_diameter_mm=10.0, element_length_mm=12.0))
    assert tapered.drop(np.array([3e-3])) == pytest.approx([-0.00045 * 10e-3 * math.log(1.0 - 0.25)])
    # Longer than 2.5 diameters: straight for L - 2.5 D about the middle, 0.0005 D beyond.
    (long,) = catalogue_rows(section("needle_roller", element_diameter_mm=4.0, element_length_mm=16.0))
    expected = [0.0, 0.0, -0.0005 * 4e-3 * math.log(1.0 - 0.5**2)]
    assert long.drop(np.array([0.0, 3e-3, 5.5e-3])) == pytest.approx(expected)


def test_a_profile_is_none_or_a_table_on_request():
    (straight,) = catalogue_rows(section("cylindrical_roller", profile="none", element_length_mm=16.0))
    assert np.all(straight.drop(np.linspace(-8e-3, 8e-3, 5)) == 0.0)
    table = ((0.0, 0.0), (0.5, 0.0), (1.0, 10.0))
    (given,) = catalogue_rows(section("cylindrical_roller", profile=table, element_length_mm=16.0))
    np.testing.assert_allclose(given.drop(np.array([-8e-3, -6e-3, 2e-3])), [10e-6, 5e-6, 0.0], atol=1e-18)


# -- what cannot be ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"element_count": 25, "element_diameter_mm": 11.0}, "element_count = 25 .* do not fit .* = 70; 19"),
        ({"element_diameter_mm": 19.5, "pitch_diameter_mm": 72.0}, "reaches beyond the rings"),
        ({"pitch_diameter_mm": 52.0}, "on pitch_diameter_mm = 52 reaches beyond the rings"),
    ],
)
def test_elements_that_do_not_fit_are_refused_with_their_keys(keys, message):
    with pytest.raises(BearingError, match=message):
        catalogue_rows(section("cylindrical_roller", **keys))


def test_rows_are_of_the_kind_that_their_type_says():
    for kind in TYPES:
        expected = BallRow if kind.endswith("_ball") else RollerRow
        assert all(isinstance(row, expected) for row in catalogue_rows(section(kind)))
