"""Tooth profile: involute, generated fillet of external gears, arc of internal gears."""

from __future__ import annotations

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest

from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gears import BasicRack, Gear, GearPair
from fe_ste.geometry.profile import ToothProfile, tooth_profile
from fe_ste.tools.arrays import Floats

NANO = 1e-12
"""1e-9 mm: rounding of coordinates of half a metre, with room for a few operations."""

DERIVATIVE = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
"""Central difference of eighth order."""


def polar(points: Floats) -> tuple[Floats, Floats]:
    return np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])


def random_gears(count: int) -> list[Gear]:
    """External gears all over the accepted range; what is refused is drawn again."""
    random = np.random.default_rng(7)
    gears: list[Gear] = []
    while len(gears) < count:
        dedendum = float(random.uniform(1.1, 1.6))
        try:
            gear = Gear(
                name="random",
                teeth=int(random.integers(10, 150)),
                normal_module=float(random.uniform(1e-3, 20e-3)),
                normal_pressure_angle=math.radians(float(random.uniform(14.5, 27.0))),
                helix_angle=math.radians(float(random.uniform(-35.0, 35.0))),
                profile_shift=float(random.uniform(-0.6, 1.0)),
                face_width=0.1,
                held_diameter=5e-3,
                rack=BasicRack(0.95, dedendum, float(random.uniform(0.0, 0.45))),
                tooth_thinning=float(random.uniform(0.0, 50e-6)),
            )
        except GeometryError:
            continue
        gears.append(gear)
    return gears


# --- involute -------------------------------------------------------------------------------------


def test_normals_of_the_flank_touch_the_base_circle(any_grc_gear: Gear) -> None:
    """The tangent is a difference of eighth order in roll length: with steps of 0.2 mm exact to rounding."""
    gear, step = any_grc_gear, 0.2e-3
    low, high = sorted((gear.form_roll_length, gear.tip_roll_length))
    roll_length = np.linspace(low + 4.0 * step, high - 4.0 * step, 50)
    stencil = roll_length[:, None] + step * np.arange(-4, 5)
    flank = tooth_profile(gear).flank(np.hypot(gear.base_radius, stencil.ravel())).reshape(50, 9, 2)
    tangent = np.einsum("ijk,j->ik", flank, DERIVATIVE)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    distance = np.einsum("ik,ik->i", flank[:, 4], tangent)
    np.testing.assert_allclose(np.abs(distance), gear.base_radius, rtol=0.0, atol=NANO)


def test_flank_is_the_end_of_a_string_unwound_from_the_base_circle(any_grc_gear: Gear) -> None:
    """All points unwind to one origin, and the tooth has its thickness at the reference circle."""
    gear = any_grc_gear
    radius = np.linspace(*sorted((gear.form_radius, gear.tip_radius)), 101)
    points = tooth_profile(gear).flank(radius)
    string = np.sqrt(np.sum(points**2, axis=1) - gear.base_radius**2)
    foot = polar(points)[1] + gear.outward * (-np.arctan2(string, gear.base_radius))
    origin = foot + gear.outward * string / gear.base_radius
    assert gear.base_radius * np.ptp(origin) < NANO
    thickness = 2.0 * gear.reference_radius * gear.half_angle(gear.reference_radius)
    shift = 2.0 * gear.outward * gear.profile_shift * math.tan(gear.normal_pressure_angle)
    full = gear.normal_module * (0.5 * math.pi + shift) / math.cos(gear.helix_angle)
    assert thickness == pytest.approx(full - gear.tooth_thinning, abs=NANO)


# --- generated fillet -----------------------------------------------------------------------------


def distance_to_rack_tooth(gear: Gear, across: Floats, up: Floats) -> Floats:
    """Signed distance of points from the generating rack's tooth in the normal section, negative inside, m.

    The tooth is a trapezium grown by the tip radius: straight flanks at the pressure angle from the datum
    line, a flat at the tip, rounded in between. `across` is counted from the tooth's middle in the
    transverse section, `up` from the gear's reference circle away from its axis.
    """
    module, angle = gear.normal_module, gear.normal_pressure_angle
    rounding, below_datum = (
        gear.rack.tip_radius * module,
        (gear.rack.dedendum - gear.rack.tip_radius) * module,
    )
    half_width = 0.25 * math.pi * module + 0.5 * gear.tooth_thinning * math.cos(gear.helix_angle)
    # Corner of the trapezium before it is grown, and points relative to it.
    corner = half_width - below_datum * math.tan(angle) - rounding / math.cos(angle)
    side = np.abs(across) * math.cos(gear.helix_angle) - corner
    depth = up - gear.profile_shift * module + below_datum
    along = side * math.sin(angle) + depth * math.cos(angle)
    beside = side * math.cos(angle) - depth * math.sin(angle)
    outside = np.where(along > 0.0, beside, np.where(side < 0.0, -depth, np.hypot(side, depth)))
    return np.where((depth > 0.0) & (beside < 0.0), np.maximum(beside, -depth), outside) - rounding


def rack_clearance(gear: Gear, points: Floats, travel: Floats) -> Floats:
    """Distance of each profile point (rows) from the rack's tooth at each travel of the rack (columns)."""
    radius, angle = polar(points)
    # The space that the rack's tooth cuts at zero travel stands on the line from the axis to the pitch point.
    angle = angle[:, None] - 0.5 * gear.angular_pitch - travel / gear.reference_radius
    across = -radius[:, None] * np.sin(angle) - travel
    up = radius[:, None] * np.cos(angle) - gear.reference_radius
    return distance_to_rack_tooth(gear, across, up)


def least_rack_clearance(gear: Gear, points: Floats) -> Floats:
    """Least distance of each point from the rolling rack, by a search that narrows around it."""
    reach = 1.5 * math.pi * gear.transverse_module
    centre, width = np.zeros(len(points)), reach
    for _ in range(12):
        travel = centre[:, None] + width * np.linspace(-1.0, 1.0, 201)
        clearance = rack_clearance(gear, points, travel)
        best = np.argmin(clearance, axis=1)
        centre = travel[np.arange(len(points)), best]
        width *= 0.05
    return clearance[np.arange(len(points)), best]


def sampled_profile(gear: Gear, profile: ToothProfile) -> Floats:
    # A large shift lifts the form circle above the reference circle.
    top = min(profile.tip_radius, max(gear.reference_radius, 1.01 * profile.form_radius))
    radius = np.linspace(profile.form_radius, top, 20)
    root = np.linspace(polar(profile.fillet)[1][-1], 0.5 * gear.angular_pitch, 5)
    land = profile.root_radius * np.column_stack((np.cos(root), np.sin(root)))
    return np.vstack((profile.flank(radius), profile.fillet, land))


def test_rack_touches_every_point_of_the_profile_and_cuts_none(any_external_grc_gear: Gear) -> None:
    """The profile is the envelope of the rack's positions, found without the law of gearing."""
    gear = any_external_grc_gear
    clearance = least_rack_clearance(gear, sampled_profile(gear, tooth_profile(gear)))
    np.testing.assert_allclose(clearance, 0.0, rtol=0.0, atol=NANO)


def test_rack_touches_every_point_of_random_profiles_and_cuts_none() -> None:
    for gear in random_gears(25):
        profile = tooth_profile(gear)
        clearance = least_rack_clearance(gear, sampled_profile(gear, profile)[::7])
        np.testing.assert_allclose(clearance, 0.0, rtol=0.0, atol=NANO, err_msg=str(gear))


def test_rack_with_sharp_corners_generates_a_fillet_too() -> None:
    rack = BasicRack(tip_radius=0.0)
    gear = Gear(name="w", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=60e-3, rack=rack)
    clearance = least_rack_clearance(gear, sampled_profile(gear, tooth_profile(gear)))
    np.testing.assert_allclose(clearance, 0.0, rtol=0.0, atol=NANO)


def test_form_radius_by_hand() -> None:
    """Full rack, z 50, m 3, x 0: xi = 75 sin 20 - (1.25 - 0.38 (1 - sin 20)) 3 / sin 20 = 16.8804 mm."""
    gear = Gear(name="wheel", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=60e-3)
    assert 1e3 * gear.form_roll_length == pytest.approx(16.8804, abs=1e-4)
    assert 1e3 * gear.form_radius == pytest.approx(72.4704, abs=1e-4)


# --- internal fillet ------------------------------------------------------------------------------


@pytest.mark.parametrize("tip_radius", [0.05, 0.15, 0.3, 0.6])
def test_internal_fillet_is_an_arc_tangent_to_flank_and_root_circle(ring_planet: GearPair, tip_radius: float) -> None:
    rack = dataclasses.replace(ring_planet.gear.rack, tip_radius=tip_radius)
    gear = dataclasses.replace(ring_planet.gear, rack=rack)
    profile = tooth_profile(gear)
    start, end = profile.fillet[0], profile.fillet[-1]
    centre = end * (1.0 - gear.fillet_radius / gear.root_radius)
    np.testing.assert_allclose(np.hypot(*(profile.fillet - centre).T), gear.fillet_radius, rtol=0.0, atol=NANO)
    # Tangent to the flank: the line from the arc's centre to its start is the flank's normal, which
    # touches the base circle.
    normal = (start - centre) / gear.fillet_radius
    assert abs(start[0] * normal[1] - start[1] * normal[0]) == pytest.approx(gear.base_radius, abs=1e-10)
    assert gear.fillet_radius <= tip_radius * gear.normal_module


def test_internal_fillet_too_large_for_the_space_becomes_fully_round(ring_planet: GearPair) -> None:
    gear = ring_planet.gear
    assert gear.fillet_radius < gear.rack.tip_radius * gear.normal_module
    assert polar(tooth_profile(gear).fillet)[1][-1] == pytest.approx(0.5 * gear.angular_pitch, abs=1e-15)
    small = dataclasses.replace(gear, rack=dataclasses.replace(gear.rack, tip_radius=0.15))
    assert small.fillet_radius == 0.15 * gear.normal_module
    assert polar(tooth_profile(small).fillet)[1][-1] < 0.5 * small.angular_pitch


# --- joints ---------------------------------------------------------------------------------------


def test_fillet_joins_flank_and_root_circle_without_a_step_or_a_corner(any_grc_gear: Gear) -> None:
    gear = any_grc_gear
    profile = tooth_profile(gear)
    radius, angle = polar(profile.fillet)
    assert radius[0] == pytest.approx(profile.form_radius, abs=NANO)
    assert angle[0] == pytest.approx(gear.half_angle(profile.form_radius), abs=1e-14)
    assert radius[-1] == pytest.approx(profile.root_radius, abs=NANO)
    assert angle[-1] <= 0.5 * gear.angular_pitch
    above = profile.form_radius + gear.outward * np.array([2e-8, 0.0])
    flank_direction = _direction(*profile.flank(above))
    assert _angle_between(flank_direction, _direction(*profile.fillet[:2])) < 0.02
    tangent_at_root = np.array([-math.sin(angle[-1]), math.cos(angle[-1])])
    assert _angle_between(_direction(*profile.fillet[-2:]), tangent_at_root) < 0.02


def _direction(start: Floats, end: Floats) -> Floats:
    return (end - start) / np.linalg.norm(end - start)


def _angle_between(first: Floats, second: Floats) -> float:
    return float(abs(first[0] * second[1] - first[1] * second[0]))


def test_profile_goes_from_tip_to_root_without_turning_back() -> None:
    for gear in random_gears(100):
        radius, angle = polar(tooth_profile(gear).fillet)
        assert np.all(np.diff(radius) < 0.0)
        assert gear.is_undercut or np.all(np.diff(angle) > 0.0)  # undercut goes into the tooth first
        assert angle[-1] <= 0.5 * gear.angular_pitch + 1e-15


def test_fillet_points_are_evenly_spaced(any_grc_gear: Gear) -> None:
    fillet = tooth_profile(any_grc_gear).fillet
    spacing = np.array([np.linalg.norm(b - a) for a, b in pairwise(fillet)])
    # Interpolated from ten times as many points.
    assert np.ptp(spacing) < 1e-2 * spacing.mean()


def test_hand_of_the_helix_does_not_change_the_transverse_section(any_grc_gear: Gear) -> None:
    np.testing.assert_array_equal(tooth_profile(any_grc_gear).fillet, tooth_profile(any_grc_gear.mirrored()).fillet)
