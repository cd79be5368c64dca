"""Macro geometry: closed forms, the GRC gears and conjugate action."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from fe_ste.geometry.gears import BasicRack, Gear, GearPair
from fe_ste.geometry.involute import inverse_involute, involute
from fe_ste.tools.arrays import Floats

from ..cases.gears import pair, ring, spur

# --- closed forms ---------------------------------------------------------------------------------


@pytest.mark.parametrize("degrees", [0.0, 0.01, 1.0, 14.5, 20.0, 35.0, 60.0, 85.0])
def test_inverse_involute_undoes_the_involute(degrees: float) -> None:
    angle = math.radians(degrees)
    # Near zero the involute is angle^3 / 3: its own rounding limits the angle to about eps / angle^2 of
    # itself.
    assert inverse_involute(involute(angle)) == pytest.approx(angle, rel=1e-12, abs=1e-9)


def test_inverse_involute_refuses_negative_values() -> None:
    with pytest.raises(ValueError, match=r"-0\.1 must not be negative"):
        inverse_involute(-0.1)


def test_spur_pair_of_equal_standard_gears_by_hand() -> None:
    """Hand evaluation for z 50/50, m 3, alpha 20 deg, x 0 (ISO 21771)."""
    wheel = spur()
    both = pair(wheel, wheel, 0.15)
    assert wheel.reference_radius == pytest.approx(75e-3, rel=1e-15)
    assert wheel.base_radius == pytest.approx(75e-3 * math.cos(math.radians(20.0)), rel=1e-15)
    assert wheel.tip_radius == pytest.approx(78e-3, rel=1e-15)
    assert wheel.root_radius == pytest.approx(71.25e-3, rel=1e-15)
    assert wheel.transverse_base_pitch == pytest.approx(math.pi * 3e-3 * math.cos(math.radians(20.0)))
    assert both.working_pressure_angle == pytest.approx(math.radians(20.0), rel=1e-14)
    # 2 (sqrt(78^2 - 70.476947^2) - 75 sin 20) / (3 pi cos 20) = 2 (33.421550 - 25.651511) / 8.856394
    assert both.transverse_contact_ratio == pytest.approx(1.754673, abs=2e-6)
    assert both.overlap_ratio == 0.0
    assert both.circumferential_backlash == pytest.approx(0.0, abs=1e-15)  # rounding of the centre distance
    assert both.path_pitch_point == pytest.approx(0.5 * (both.path_start + both.path_end), rel=1e-14)
    assert both.path_pitch_point == pytest.approx(0.5 * both.base_tangent_length, rel=1e-14)
    assert (wheel.hand, both.ratio, both.face_width) == ("spur", 1.0, 20e-3)


def test_helical_quantities_by_hand() -> None:
    """tan alpha_t = tan alpha_n / cos beta, sin beta_b = sin beta cos alpha_n, at beta 30 deg."""
    gear = spur(helix_angle=math.radians(-30.0))
    assert gear.hand == "left"
    assert gear.mirrored().hand == "right"
    # tan 20 / cos 30 = 0.36397023 / 0.86602540 = 0.42027662
    assert math.degrees(gear.transverse_pressure_angle) == pytest.approx(22.795877, abs=1e-6)
    # sin 30 cos 20 = 0.46984631
    assert math.degrees(gear.base_helix_angle) == pytest.approx(-28.024321, abs=1e-6)
    assert gear.transverse_module == pytest.approx(3e-3 / 0.8660254037844387, rel=1e-15)


@pytest.mark.parametrize("internal", [False, True])
def test_profile_shift_counts_in_normal_modules(internal: bool) -> None:
    make, helix_angle = (ring if internal else spur), math.radians(20.0)
    plain, shifted = make(helix_angle=helix_angle), make(helix_angle=helix_angle, profile_shift=0.3)
    assert shifted.tip_radius - plain.tip_radius == pytest.approx(0.3 * 3e-3, rel=1e-12)
    assert shifted.root_radius - plain.root_radius == pytest.approx(0.3 * 3e-3, rel=1e-12)
    normal_growth = 2.0 * (shifted.reference_half_angle - plain.reference_half_angle) * plain.reference_radius
    normal_growth *= math.cos(helix_angle) * plain.outward
    assert normal_growth == pytest.approx(2.0 * 0.3 * 3e-3 * math.tan(math.radians(20.0)), rel=1e-10)


def test_internal_space_is_the_tooth_of_an_external_gear_of_the_same_shift() -> None:
    external = spur(teeth=99, profile_shift=0.4)
    internal = ring(profile_shift=0.4)
    radius = np.linspace(1.001 * internal.tip_radius, external.tip_radius, 7)
    space = 0.5 * internal.angular_pitch - internal.half_angle(radius)
    np.testing.assert_allclose(space, external.half_angle(radius), rtol=0.0, atol=1e-16)


def test_half_angle_is_a_float_for_a_float_and_nan_inside_the_base_circle() -> None:
    gear = spur()
    assert isinstance(gear.half_angle(75e-3), float)
    assert gear.half_angle(75e-3) == pytest.approx(math.pi / 100.0, rel=1e-14)
    assert np.isnan(gear.half_angle(np.array([70e-3, 75e-3]))).tolist() == [True, False]


@pytest.mark.parametrize("internal", [False, True])
def test_thinning_takes_its_amount_off_the_tooth_at_the_reference_circle(internal: bool) -> None:
    make = ring if internal else spur
    plain, thin = make(), make(tooth_thinning=60e-6)
    radius = plain.reference_radius
    lost = 2.0 * radius * (plain.half_angle(radius) - thin.half_angle(radius))
    assert lost == pytest.approx(60e-6, rel=1e-10)
    assert thin.root_radius == plain.root_radius


def test_backlash_of_thinned_teeth_grows_with_the_working_circle(any_grc_pair: GearPair) -> None:
    """j_wt = (t_1 + t_2) cos(alpha_t) / cos(alpha_wt) beyond that of the full teeth."""
    given = any_grc_pair
    full = dataclasses.replace(
        given,
        pinion=dataclasses.replace(given.pinion, tooth_thinning=0.0, profile_shift=given.pinion.profile_shift - 1e-3),
        gear=dataclasses.replace(given.gear, tooth_thinning=0.0),
    )
    thin = dataclasses.replace(full, pinion=_thinned(full.pinion), gear=_thinned(full.gear))
    growth = math.cos(given.pinion.transverse_pressure_angle) / math.cos(given.working_pressure_angle)
    gained = thin.circumferential_backlash - full.circumferential_backlash
    assert gained == pytest.approx(0.04 * given.pinion.normal_module * growth, rel=1e-9)


def _thinned(gear: Gear) -> Gear:
    return dataclasses.replace(gear, tooth_thinning=0.02 * gear.normal_module)


def test_pair_at_its_backlash_free_distance_has_no_backlash(any_grc_pair: GearPair) -> None:
    tight = any_grc_pair.with_centre_distance(any_grc_pair.backlash_free_centre_distance)
    assert tight.circumferential_backlash == pytest.approx(0.0, abs=1e-15)


def test_given_root_diameter_replaces_the_dedendum() -> None:
    gear = spur(root_diameter=142.2e-3, profile_shift=0.1)
    assert gear.root_radius == 71.1e-3
    assert gear.dedendum_factor == pytest.approx(1.4, rel=1e-12)
    assert spur(root_diameter=142.5e-3).form_radius == pytest.approx(spur().form_radius, rel=1e-14)


def test_given_tip_diameter_replaces_the_addendum() -> None:
    assert spur(tip_diameter=155e-3).tip_radius == 77.5e-3


def test_contact_ratios_and_path_follow_from_the_tips(any_grc_pair: GearPair) -> None:
    """Both tip circles cut the line of action at its ends: by coordinates, without roll lengths."""
    given = any_grc_pair
    pinion, gear, outward = given.pinion, given.gear, given.gear.outward
    angle = given.working_pressure_angle
    # Pinion axis at the origin, gear axis on the x axis; unit vector along the line of action, in the
    # sense of xi.
    foot = pinion.base_radius * np.array([math.cos(angle), -math.sin(angle)])
    along = np.array([math.sin(angle), math.cos(angle)])
    other = np.array([outward * given.centre_distance, 0.0])
    assert np.linalg.norm(foot + given.path_end * along) == pytest.approx(pinion.tip_radius, rel=1e-14)
    assert np.linalg.norm(foot + given.path_start * along - other) == pytest.approx(gear.tip_radius, rel=1e-14)
    pitch_point = foot + given.path_pitch_point * along
    # Sums of lengths of up to half a metre, rounded to 1e-16 m each.
    np.testing.assert_allclose(pitch_point, [given.pinion_working_radius, 0.0], rtol=0.0, atol=1e-15)
    assert given.transverse_contact_ratio == pytest.approx(
        (given.path_end - given.path_start) / (2.0 * math.pi * gear.base_radius / gear.teeth), rel=1e-14
    )
    assert given.total_contact_ratio == given.transverse_contact_ratio + given.overlap_ratio


def test_mirrored_pair_swaps_both_hands_and_nothing_else(any_grc_pair: GearPair) -> None:
    mirrored = any_grc_pair.mirrored()
    assert mirrored.pinion.helix_angle == -any_grc_pair.pinion.helix_angle
    assert mirrored.gear.helix_angle == -any_grc_pair.gear.helix_angle
    assert mirrored.working_helix_angle == -any_grc_pair.working_helix_angle
    assert mirrored.mirrored() == any_grc_pair


# --- the gears of the GRC 750 kW gearbox ----------------------------------------------------------

GRC_DERIVED: dict[str, dict[str, tuple[float, ...]]] = {
    "sun_planet": {
        "angles": (20.1585, 7.0406, 22.7443),
        "distance": (302.585, 308.0, 0.5754),
        "reference": (211.810, 393.361),
        "base": (198.835, 369.265),
        "working": (215.600, 400.400),
        "tip": (235.34, 421.34),
        "root": (186.0, 372.0),
        "dedendum": (1.467, 1.467),
        "contact": (1.52, 0.913),
    },
    "ring_planet": {
        "angles": (20.1585, 7.0406, 22.7443),
        "distance": (302.585, 308.0, 0.5754),
        "reference": (393.361, 998.531),
        "base": (369.265, 937.364),
        "working": (400.400, 1016.400),
        "tip": (421.34, 998.02),
        "root": (372.0, 1047.0),
        "dedendum": (1.467, 1.449),
        "contact": (1.66, 0.945),
    },
    "intermediate": {
        "angles": (20.5617, 13.1401, 21.7558),
        "distance": (446.385, 450.0, 0.4505),
        "reference": (195.559, 697.210),
        "base": (183.101, 652.794),
        "working": (197.143, 702.857),
        "tip": (214.60, 718.60),
        "root": (174.0, 678.0),
        "dedendum": (1.461, 1.461),
        "contact": (1.57, 1.587),
    },
    "high_speed": {
        "angles": (20.5617, 13.1401, 21.3931),
        "distance": (283.419, 285.0, 0.3224),
        "reference": (113.367, 453.470),
        "base": (106.145, 424.581),
        "working": (114.000, 456.000),
        "tip": (125.03, 465.03),
        "root": (100.0, 440.0),
        "dedendum": (1.503, 1.503),
        "contact": (1.58, 1.694),
    },
}
"""Degrees and millimetres as tabulated; derived independently from the printed gear data."""


@pytest.fixture(params=tuple(GRC_DERIVED))
def derived(request: pytest.FixtureRequest) -> tuple[GearPair, dict[str, tuple[float, ...]]]:
    name = str(request.param)
    found: GearPair = request.getfixturevalue(name)
    return found, GRC_DERIVED[name]


def test_grc_angles_as_tabulated(derived: tuple[GearPair, dict[str, tuple[float, ...]]]) -> None:
    found, table = derived
    angles = (
        found.pinion.transverse_pressure_angle,
        abs(found.pinion.base_helix_angle),
        found.working_pressure_angle,
    )
    # Half a unit of the last printed digit; so in all tests against this table.
    np.testing.assert_allclose(np.degrees(angles), table["angles"], rtol=0.0, atol=0.5e-4)


def test_grc_diameters_as_tabulated(derived: tuple[GearPair, dict[str, tuple[float, ...]]]) -> None:
    found, table = derived
    gears = (found.pinion, found.gear)
    diameters = {
        "reference": [2e3 * gear.reference_radius for gear in gears],
        "base": [2e3 * gear.base_radius for gear in gears],
        "working": [2e3 * found.pinion_working_radius, 2e3 * found.gear_working_radius],
    }
    for key, found_diameters in diameters.items():
        np.testing.assert_allclose(found_diameters, table[key], rtol=0.0, atol=0.51e-3, err_msg=key)
    # Tip diameters were tabulated from profile shifts before their rounding to three digits: 0.0005 x 2
    # m_n = 0.01.
    tips = [2e3 * gear.tip_radius for gear in gears]
    np.testing.assert_allclose(tips, table["tip"], rtol=0.0, atol=0.016)
    # Root diameters are printed in whole millimetres.
    roots = [2e3 * gear.root_radius for gear in gears]
    np.testing.assert_allclose(roots, table["root"], rtol=0.0, atol=0.5)


def test_grc_centre_distances_and_shift_sums_as_tabulated(
    derived: tuple[GearPair, dict[str, tuple[float, ...]]],
) -> None:
    found, table = derived
    reference, working, shift_sum = table["distance"]
    assert 1e3 * found.reference_centre_distance == pytest.approx(reference, abs=0.5e-3)
    assert 1e3 * found.centre_distance == pytest.approx(working, abs=1e-9)
    # Without thinning and with the tabulated sum of shifts the flanks touch on both sides at the printed
    # distance.
    pinion = dataclasses.replace(found.pinion, tooth_thinning=0.0)
    gear_shift = shift_sum - found.gear.outward * pinion.profile_shift
    gear = dataclasses.replace(found.gear, tooth_thinning=0.0, profile_shift=gear_shift)
    apart = 1e-3 * (working + 0.1 * gear.outward)
    tight = dataclasses.replace(found, pinion=pinion, gear=gear, centre_distance=apart)
    # Half a digit of the shift sum, 0.5e-4 m_n, moves the distance by at most as much: 0.5 um.
    assert 1e3 * tight.backlash_free_centre_distance == pytest.approx(working, abs=1e-3)


def test_grc_dedendum_from_printed_root_diameters_as_tabulated(
    derived: tuple[GearPair, dict[str, tuple[float, ...]]],
) -> None:
    found, table = derived
    for gear, root, dedendum in zip((found.pinion, found.gear), table["root"], table["dedendum"], strict=True):
        rack = BasicRack(dedendum=9.0, tip_radius=0.3)
        by_root = dataclasses.replace(gear, root_diameter=1e-3 * root, rack=rack)
        # Profile shifts are tabulated to three digits.
        assert by_root.dedendum_factor == pytest.approx(dedendum, abs=1e-3)


def test_grc_contact_ratios_as_tabulated(derived: tuple[GearPair, dict[str, tuple[float, ...]]]) -> None:
    found, table = derived
    transverse, overlap = table["contact"]
    # The tips carry the rounding of the shifts, 0.0005 m_n: 0.001 in the transverse contact ratio.
    assert found.transverse_contact_ratio == pytest.approx(transverse, abs=6e-3)
    assert found.overlap_ratio == pytest.approx(overlap, abs=0.51e-3)


def test_grc_hands(sun_planet: GearPair, ring_planet: GearPair, high_speed: GearPair) -> None:
    assert (sun_planet.pinion.hand, sun_planet.gear.hand) == ("right", "left")
    assert (ring_planet.pinion.hand, ring_planet.gear.hand) == ("left", "left")
    assert (high_speed.pinion.hand, high_speed.gear.hand) == ("right", "left")
    assert sun_planet.gear == ring_planet.pinion


# --- conjugate action -----------------------------------------------------------------------------


def unwound_flank(gear: Gear, roll_length: Floats) -> Floats:
    """Counter-clockwise flank of an external tooth on the +x axis: the end of an unwound string."""
    taut = gear.half_angle(gear.base_radius) - roll_length / gear.base_radius
    feet = gear.base_radius * np.column_stack((np.cos(taut), np.sin(taut)))
    return feet + roll_length[:, None] * np.column_stack((-np.sin(taut), np.cos(taut)))


def turned(points: Floats, angle: float) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


def rigid_gap(both: GearPair, roll_length: Floats, rotation: float) -> Floats:
    """Gap along the gear's base circle between a pinion flank and its mate, both rigid, the pinion turned.

    Zero rotation is contact at the pitch point. The pinion's axis is the origin, the gear's axis on the x
    axis, and the pinion tooth pushes with its counter-clockwise flank.
    """
    pinion, gear, outward = both.pinion, both.gear, both.gear.outward
    start = -pinion.half_angle(both.pinion_working_radius)
    flank = turned(unwound_flank(pinion, roll_length), start + rotation)
    seen = flank - np.array([outward * both.centre_distance, 0.0])
    radius, angle = np.hypot(*seen.T), np.arctan2(seen[:, 1], outward * -seen[:, 0])
    # Mirrored for an external mate (it faces the pinion): its teeth then stand around the x axis like the
    # ring's.
    tooth = gear.half_angle(both.gear_working_radius) + rotation / both.ratio
    return gear.base_radius * (tooth - gear.half_angle(radius) - angle)


@pytest.mark.parametrize("shift", [-0.2e-3, 0.0, 0.2e-3])
def test_mating_flanks_touch_along_the_whole_path_of_contact(any_grc_pair: GearPair, shift: float) -> None:
    both = any_grc_pair.with_centre_distance(any_grc_pair.centre_distance + shift)
    touching = np.linspace(both.path_start, both.path_end, 41)
    for xi in touching:
        rotation = (xi - both.path_pitch_point) / both.pinion.base_radius
        neighbours = xi + np.array([-50e-6, -5e-6, 0.0, 5e-6, 50e-6])
        gap = rigid_gap(both, neighbours, rotation)
        # 1e-9 mm, as the coordinates of a metre-sized ring allow.
        assert abs(gap[2]) < 1e-12
        assert np.all(gap[[0, 1, 3, 4]] > 0.0)


def test_no_point_of_the_pinion_flank_enters_its_mate_at_any_rotation(any_grc_pair: GearPair) -> None:
    both = any_grc_pair
    roll_length = np.linspace(both.pinion.form_roll_length, both.pinion.tip_roll_length, 400)
    for xi in np.linspace(both.path_start, both.path_end, 11):
        rotation = (xi - both.path_pitch_point) / both.pinion.base_radius
        gap = rigid_gap(both, roll_length, rotation)
        assert np.nanmin(gap) > -1e-12


def test_helices_of_mates_run_along_each_other(any_grc_pair: GearPair) -> None:
    """Twist per length is tan(beta_b) / r_b; mates twist in the ratio of their teeth."""
    twist = [
        math.tan(gear.base_helix_angle) / gear.base_radius * gear.teeth
        for gear in (any_grc_pair.pinion, any_grc_pair.gear)
    ]
    assert twist[0] == pytest.approx(-any_grc_pair.gear.outward * twist[1], rel=1e-13)
    on_reference = math.tan(any_grc_pair.pinion.helix_angle) / any_grc_pair.pinion.reference_radius
    assert twist[0] == pytest.approx(on_reference * any_grc_pair.pinion.teeth, rel=1e-13)
    assert math.tan(any_grc_pair.working_helix_angle) / any_grc_pair.pinion_working_radius == pytest.approx(
        on_reference, rel=1e-13
    )


# --- inspection -----------------------------------------------------------------------------------


@pytest.mark.parametrize("degrees", [0.0, 14.0, -30.0])
@pytest.mark.parametrize(("teeth", "shift", "span"), [(21, 0.35, 3), (50, 0.0, 6), (99, -0.4, 11)])
def test_base_tangent_length_is_the_formula_of_the_standard(
    degrees: float, teeth: int, shift: float, span: int
) -> None:
    """DIN 3960, 3.7: W_k = m_n cos(a_n) (pi (k - 1/2) + z inv(a_t)) + 2 x m_n sin(a_n) + A_sn cos(a_n)."""
    helix, allowance = math.radians(degrees), -120e-6
    gear = spur(
        teeth=teeth,
        profile_shift=shift,
        helix_angle=helix,
        held_diameter=30e-3,
        tooth_thinning=-allowance / math.cos(helix),
    )
    angle, transverse = gear.normal_pressure_angle, gear.transverse_pressure_angle
    turned = math.pi * (span - 0.5) + teeth * involute(transverse)
    expected = 3e-3 * (math.cos(angle) * turned + 2.0 * shift * math.sin(angle)) + allowance * math.cos(angle)
    assert gear.span_measurement(span) == pytest.approx(expected, rel=1e-13)
    thickness = 3e-3 * (0.5 * math.pi + 2.0 * shift * math.tan(angle)) + allowance
    assert gear.normal_tooth_thickness == pytest.approx(thickness, rel=1e-13)


@pytest.mark.parametrize("degrees", [0.0, 15.0, -30.0, 45.0])
@pytest.mark.parametrize(("teeth", "shift"), [(21, 0.35), (50, 0.0), (99, -0.4)])
def test_the_usual_span_touches_the_flanks_on_their_involute(teeth: int, shift: float, degrees: float) -> None:
    """DIN 3960: d_M^2 = d_b^2 + (W_k cos(beta_b))^2."""
    gear = spur(teeth=teeth, profile_shift=shift, held_diameter=30e-3, helix_angle=math.radians(degrees))

    def touched_radius(span: int) -> float:
        along = gear.span_measurement(span) * math.cos(gear.base_helix_angle)
        return math.sqrt(gear.base_radius**2 + 0.25 * along**2)

    touched = touched_radius(gear.usual_span)
    assert gear.span_contact_radius(gear.usual_span) == pytest.approx(touched, rel=1e-13)
    assert gear.form_radius < touched < gear.tip_radius
    middle = gear.reference_radius + 3e-3 * shift
    others = [abs(touched_radius(k) - middle) for k in range(2, 60)]
    assert abs(touched - middle) == pytest.approx(min(others), abs=2e-5)  # counted along the tangent, not the radius


@pytest.mark.parametrize(
    ("module", "teeth", "degrees", "pressure_angle", "shift", "count", "length"),
    [
        # KHK, Gear Technical Reference, span measurement of spur and of helical gears (normal system).
        (3.0, 24, 0.0, 20.0, 0.4, 4, 32.8266),
        (3.0, 24, 25.0, 20.0, 0.4, 5, 42.0085),  # from 4.63009 teeth
        # By d_M^2 = d_b^2 + (W_k cos(beta_b))^2 at the V circle: k = 16.95.
        (3.0, 100, 30.0, 20.0, 0.0, 17, 152.449),
    ],
)
def test_teeth_and_length_of_the_span_are_the_published_ones(
    module: float, teeth: int, degrees: float, pressure_angle: float, shift: float, count: int, length: float
) -> None:
    gear = spur(
        teeth=teeth,
        normal_module=1e-3 * module,
        normal_pressure_angle=math.radians(pressure_angle),
        helix_angle=math.radians(degrees),
        profile_shift=shift,
        held_diameter=30e-3,
    )
    assert gear.usual_span == count
    assert 1e3 * gear.span_measurement(count) == pytest.approx(length, abs=6e-4)


def test_a_narrow_helical_face_is_too_short_for_its_span() -> None:
    """W_k sin(beta_b) = 152.449 mm sin(28.024 deg) = 71.63 mm for z 100, m_n 3 mm, beta 30 deg."""
    gear = spur(teeth=100, normal_module=3e-3, helix_angle=math.radians(30.0), held_diameter=30e-3)
    assert 1e3 * gear.span_face_width(17) == pytest.approx(71.63, abs=0.01)


@pytest.mark.parametrize("internal", [False, True])
def test_balls_find_the_thickness_that_is_computed(internal: bool) -> None:
    """DIN 3960, 3.9: a ball that touches both flanks of a space sits at inv(a_K) = inv(a_t) -+ eta + D_M / d_b."""
    gear = (ring if internal else spur)(tooth_thinning=80e-6, profile_shift=0.2)
    ball, sign = 1.7 * 3e-3, gear.outward
    half_space = 0.5 * gear.angular_pitch - gear.reference_half_angle
    # The ball's centre lies where its distance along the normal from each flank is its radius.
    value = involute(gear.transverse_pressure_angle) + sign * (0.5 * ball / gear.base_radius - half_space)
    centre = gear.base_radius / math.cos(inverse_involute(value))
    flank = np.linspace(gear.form_radius, gear.tip_radius, 20001)
    angle = 0.5 * gear.angular_pitch - gear.half_angle(flank)  # from the middle of the space
    distance = np.sqrt(centre**2 + flank**2 - 2.0 * centre * flank * np.cos(angle))
    assert distance.min() == pytest.approx(0.5 * ball, abs=1e-9)  # squared step of the samples over the ball's radius


def test_backlash_along_the_normal_is_that_of_two_thinned_teeth_at_their_reference_circles() -> None:
    """At the reference centre distance j_bn is the sum of the normal thinnings times cos(alpha_n)."""
    helix = math.radians(15.0)
    gear = spur(helix_angle=helix, tooth_thinning=70e-6)
    both = pair(gear, gear.mirrored(), 50 * 3e-3 / math.cos(helix))
    expected = 2.0 * 70e-6 * math.cos(helix) * math.cos(gear.normal_pressure_angle)
    assert both.normal_backlash == pytest.approx(expected, rel=1e-9)
