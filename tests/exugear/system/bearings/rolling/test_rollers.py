"""Bearing stiffness against closed forms, exact identities and a hand estimate of the GRC's bearings."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.integrate

from exugear.system.bearings.rolling.contact import (
    bearing_load,
    elastic_energy,
    equilibrium,
    pitch_averaged_tangent,
    row_contacts,
    tangent_stiffness,
)
from exugear.system.bearings.rolling.rows import BearingError, RollerRow
from exugear.system.bearings.stiffness import axially_symmetric, rotate_stiffness

from ....cases.roller_bearings import BearingPair, CylindricalRollerBearing, TaperedRollerBearing


# Closed forms hold for straight rollers, and the hand estimate has rollers of 0.75 of the width: so have all bearings
# here unless a test says otherwise.
def cylindrical(bore, outside, width, **options):
    options.setdefault("profile_factor", 0.0)
    options.setdefault("effective_length", 0.75e-3 * width)
    return CylindricalRollerBearing(bore=1e-3 * bore, outside_diameter=1e-3 * outside, width=1e-3 * width, **options)


def tapered(bore, outside, width, degrees, **options):
    options.setdefault("profile_factor", 0.0)
    options.setdefault("effective_length", 0.75e-3 * width)
    return TaperedRollerBearing(
        bore=1e-3 * bore,
        outside_diameter=1e-3 * outside,
        width=1e-3 * width,
        contact_angle=math.radians(degrees),
        **options,
    )


NJ2232 = cylindrical(160, 290, 80)
PLANET_PAIR = BearingPair(bearing=NJ2232, arrangement="tandem", row_distance=0.100)
LSS_PAIR = BearingPair(bearing=tapered(240, 320, 51, 17.0), arrangement="X")
IMS_PAIR = BearingPair(bearing=tapered(160, 240, 51, 17.0), arrangement="X")
HSS_PAIR = BearingPair(bearing=tapered(110, 200, 56, 15.6), arrangement="O")

# Hand estimate of the GRC 750 kW gearbox's bearings at 240 kNm on the carrier, from the same line contact law
# but with the closed forms Q_max = 4.08 F / (i Z cos a) and k = (10/9) F / delta instead of a solve:
# bearing, F_r and F_a in kN, k_radial, k_axial, k_tilt in N/m and N m/rad, delta_r in micrometres.
HAND_ESTIMATE = {
    "PL-A": (NJ2232, 129.9, 0.0, 4.3e9, 0.0, 1.3e6, 33),
    "planet": (PLANET_PAIR, 259.7, 0.0, 8.7e9, 0.0, 2.2e7, 33),
    "PLC-A": (cylindrical(460, 580, 56, full_complement=True), 20.0, 0.0, 7.0e9, 0.0, 1.0e6, 3),
    "PLC-B": (cylindrical(400, 500, 46, full_complement=True), 20.0, 0.0, 6.2e9, 0.0, 6.2e5, 4),
    "LSS-A": (cylindrical(280, 350, 33, full_complement=True), 37.0, 0.0, 5.1e9, 0.0, 2.6e5, 8),
    "LSS-B/C": (LSS_PAIR, 98.0, 0.0, 9.7e9, 1.9e9, None, 11),
    "IMS-A": (cylindrical(100, 180, 46), 34.8, 0.0, 2.4e9, 0.0, 2.4e5, 16),
    "IMS-B/C": (IMS_PAIR, 67.3, 0.0, 6.9e9, 1.2e9, None, 11),
    "HSS-A": (cylindrical(100, 180, 46), 33.5, 0.0, 2.4e9, 0.0, 2.4e5, 15),
    "HSS-B/C": (HSS_PAIR, 21.8, 0.0, 4.5e9, 7.2e8, 1.1e7, 5),
}


@pytest.mark.parametrize("name", HAND_ESTIMATE)
def test_grc_bearings_agree_with_the_hand_estimate(name):
    bearing, radial, axial, k_radial, k_axial, k_tilt, deflection = HAND_ESTIMATE[name]
    force = (1e3 * radial, 0.0, 1e3 * axial)
    stiffness = pitch_averaged_tangent(bearing, force)
    # The estimate is printed with two figures (rounding alone up to 5 %), its tilting figure for the planet
    # leaves the rollers' own length out: 6 % radial, 10 % axial, 13 % tilting.
    assert stiffness[0, 0] == pytest.approx(k_radial, rel=0.06)
    assert stiffness[2, 2] == pytest.approx(k_axial, rel=0.10, abs=1.0)
    if k_tilt is not None:
        assert stiffness[4, 4] == pytest.approx(k_tilt, rel=0.13)
    assert 1e6 * equilibrium(bearing, force).displacement[0] == pytest.approx(deflection, abs=0.6)


@pytest.mark.parametrize(
    ("pair", "force", "hand_estimate"),
    [(LSS_PAIR, (98e3, 0.0, 82e3), 2.7e7), (IMS_PAIR, (67.3e3, 0.0, 16.9e3), 1.2e7)],
    ids=["LSS-B/C", "IMS-B/C"],
)
def test_x_pairs_tilt_softer_than_an_estimate_that_adds_squares(pair, force, hand_estimate):
    # The hand estimate is k_radial (z^2 + L_we^2 / 12) + k_axial r^2 / 2. Radial and axial part of a contact
    # force are not independent: the lever is z cos(a) - s r sin(a), with a mixed term that X makes negative.
    row = pair.rows[1]
    stiffness = axially_symmetric(pitch_averaged_tangent(pair, force))
    sum_of_squares = (
        stiffness[0, 0] * (row.axial_position**2 + row.effective_length**2 / 12.0)
        + stiffness[2, 2] * row.pitch_diameter**2 / 8.0
    )
    assert sum_of_squares == pytest.approx(hand_estimate, rel=0.08)  # two figures, mean over directions
    assert stiffness[4, 4] < 0.2 * hand_estimate


@pytest.mark.parametrize("pair", [LSS_PAIR, IMS_PAIR, HSS_PAIR], ids=["LSS-B/C", "IMS-B/C", "HSS-B/C"])
def test_pairs_tilt_about_their_pressure_centres(pair):
    row = pair.rows[1]
    stiffness = axially_symmetric(pitch_averaged_tangent(pair, (50e3, 0.0, 0.0)))
    lever = row.axial_position - 0.5 * row.pitch_diameter * math.tan(row.contact_angle)
    sloped_length = row.effective_length / math.cos(row.contact_angle)
    # A few rollers stand for a continuous row.
    expected = stiffness[0, 0] * (lever**2 + sloped_length**2 / 12.0)
    assert stiffness[4, 4] == pytest.approx(expected, rel=2e-3)


class SingleRow:
    """A bearing made of one given row."""

    def __init__(self, row):
        self.rows = (row,)


FINE_ROW = RollerRow(element_diameter=0.01, effective_length=0.02, pitch_diameter=0.65, element_count=200)


def continuous_row_integral():
    """J_r = mean of cos^(19/9) over the turn, load zone 180 degrees (Sjoevall integral, line contact)."""
    zone = (-math.pi / 2, math.pi / 2)
    return scipy.integrate.quad(lambda angle: math.cos(angle) ** (19.0 / 9.0), *zone)[0] / (2.0 * math.pi)


def test_highest_element_load_is_the_classic_factor_times_the_mean():
    # Harris, Rolling Bearing Analysis, line contact without clearance: Q_max = F_r / (Z J_r), J_r = 0.2453.
    assert 1.0 / continuous_row_integral() == pytest.approx(4.08, abs=0.005)
    state = equilibrium(cylindrical(460, 580, 56, full_complement=True), (20e3, 0.0, 0.0))
    # 49 rollers against the integral: 0.1 %.
    assert state.element_load.max() == pytest.approx(20e3 / (49 * continuous_row_integral()), rel=1e-3)


def test_deflection_and_tangent_of_many_rollers_are_the_closed_form():
    bearing = SingleRow(FINE_ROW)
    force = 50e3
    state = equilibrium(bearing, (force, 0.0, 0.0))
    constant = 35948e6 * 0.02 ** (8.0 / 9.0)
    deflection = (force / (200 * continuous_row_integral() * constant)) ** 0.9
    # Trapezoidal sum over 200 rollers of a function with an integrable kink at the ends of the zone.
    assert state.displacement[0] == pytest.approx(deflection, rel=1e-4)
    assert state.tangent[0, 0] == pytest.approx(10.0 / 9.0 * force / deflection, rel=1e-3)
    # Turning displacement and force together costs no work: across the load the tangent is the secant.
    # Its weight delta^(1/9) sin^2 ends steeply at the edge of the zone: 200 rollers resolve it to 0.5 %.
    averaged = pitch_averaged_tangent(bearing, (force, 0.0, 0.0))
    assert averaged[1, 1] == pytest.approx(force / deflection, rel=5e-3)


def test_clearance_narrows_the_load_zone_as_the_load_distribution_factor_says():
    # Harris: half the load zone is arccos(s_d / (2 u)) at a ring displacement u.
    clearance = 60e-6
    row = replace(FINE_ROW, radial_clearance=clearance)
    state = equilibrium(SingleRow(row), (50e3, 0.0, 0.0))
    half_zone = math.acos(0.5 * clearance / state.displacement[0])
    expected = 200 * half_zone / math.pi
    assert abs(np.count_nonzero(state.element_load) - expected) <= 1.0  # whole rollers


def test_pure_axial_load_spreads_evenly_over_a_tapered_row():
    bearing = tapered(160, 240, 51, 17.0)
    state = equilibrium(bearing, (0.0, 0.0, 40e3))
    count = bearing.rows[0].element_count
    expected = 40e3 / (count * math.sin(math.radians(17.0)))
    np.testing.assert_allclose(state.element_load, expected, rtol=1e-9)  # Newton's tolerance


@pytest.mark.parametrize("bearing", [NJ2232, PLANET_PAIR, LSS_PAIR, HSS_PAIR], ids=["NJ", "planet", "X", "O"])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (2e-4, -1e-4)], ids=["straight", "tilted"])
def test_rollers_balance_the_force(bearing, tilt):
    axial = 0.0 if bearing.rows[0].contact_angle == 0.0 else -12e3
    force = np.array([30e3, -50e3, axial])
    state = equilibrium(bearing, force, tilt=tilt)
    np.testing.assert_allclose(state.load[:3], force, atol=1e-9 * np.linalg.norm(force))
    np.testing.assert_array_equal(state.displacement[3:5], tilt)


@pytest.mark.parametrize("bearing", [PLANET_PAIR, LSS_PAIR, HSS_PAIR], ids=["planet", "X", "O"])
def test_tangent_is_the_difference_quotient_of_the_load(bearing):
    contacts = row_contacts(bearing.rows)
    displacement = np.array([20e-6, 10e-6, 8e-6, 1e-4, -2e-4, 0.0])
    tangent = tangent_stiffness(contacts, displacement)
    scale = np.array([1.0, 1.0, 1.0, 10.0, 10.0, 10.0])  # 1 m of travel is like 10 rad at these radii
    for column in range(6):
        step = np.zeros(6)
        step[column] = 1e-10 * scale[column]
        quotient = (bearing_load(contacts, displacement + step) - bearing_load(contacts, displacement - step)) / (
            2.0 * step[column]
        )
        # Laminae at the edge of the zone have a slope like delta^(1/9): 1e-5 of the largest entry of a row.
        largest = np.abs(tangent).max(axis=1)
        assert np.all(np.abs(quotient - tangent[:, column]) <= 1e-5 * largest + 1e-3)


@pytest.mark.parametrize("bearing", [PLANET_PAIR, LSS_PAIR, HSS_PAIR], ids=["planet", "X", "O"])
def test_load_is_the_gradient_of_the_energy(bearing):
    contacts = row_contacts(bearing.rows)
    displacement = np.array([20e-6, 10e-6, 8e-6, 1e-4, -2e-4, 0.0])
    load = bearing_load(contacts, displacement)
    for direction, size in zip(np.eye(6), [1e-8] * 3 + [1e-7] * 3, strict=True):
        work = elastic_energy(contacts, displacement + size * direction) - elastic_energy(
            contacts, displacement - size * direction
        )
        # Round-off of the energy over a step of 10 nm.
        assert work / (2.0 * size) == pytest.approx(float(load @ direction), abs=1e-5 * abs(load).max())


def test_work_along_a_path_is_the_stored_energy():
    contacts = row_contacts(HSS_PAIR.rows)
    end = np.array([15e-6, -5e-6, 20e-6, 2e-4, 1e-4, 0.0])

    def power(path):
        return float(bearing_load(contacts, path * end) @ end)

    work, _ = scipy.integrate.quad(power, 0.0, 1.0, epsrel=1e-10)
    assert work == pytest.approx(elastic_energy(contacts, end), rel=1e-8)


@pytest.mark.parametrize("bearing", [NJ2232, LSS_PAIR, HSS_PAIR], ids=["NJ", "X", "O"])
def test_tangent_is_symmetric_and_not_negative(bearing):
    matrix = equilibrium(bearing, (50e3, 20e3, 0.0), tilt=(1e-4, 2e-4)).tangent
    np.testing.assert_array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix).min() > -1e-12 * np.abs(matrix).max()  # rounding
    assert np.abs(matrix[5]).max() < 1e-12 * np.abs(matrix).max()  # the spin is free


@pytest.mark.parametrize("bearing", [NJ2232, HSS_PAIR], ids=["NJ", "O"])
def test_turning_the_load_by_a_roller_pitch_turns_the_answer(bearing):
    pitch = 2.0 * math.pi / bearing.rows[0].element_count
    force = np.array([40e3, 0.0, 0.0])
    turned_force = 40e3 * np.array([math.cos(pitch), math.sin(pitch), 0.0])
    straight = equilibrium(bearing, force).tangent
    turned = equilibrium(bearing, turned_force).tangent
    np.testing.assert_allclose(turned, rotate_stiffness(straight, pitch), atol=1e-7 * np.abs(straight).max())


def test_stiffness_grows_with_the_tenth_root_of_the_load():
    # Q ~ delta^(10/9) and geometry alone: K ~ F^(1/10), exactly, while the load zone stays.
    light, heavy = (equilibrium(NJ2232, (force, 0.0, 0.0)).tangent[0, 0] for force in (1e3, 1e5))
    assert heavy / light == pytest.approx(100.0**0.1, rel=1e-8)


def test_preload_stiffens_an_o_pair_along_the_axis():
    # Clamped between both rows the axial tangent counts both; by load from one side one row alone.
    taper = tapered(110, 200, 56, 15.6)
    preloaded = BearingPair(bearing=taper, arrangement="O", axial_preload=20e-6)
    row = preloaded.rows[0]
    state = equilibrium(preloaded, (0.0, 0.0, 1.0))
    approach = 10e-6 * math.sin(math.radians(15.6))
    slope = 10.0 / 9.0 * row.contact_constant * approach ** (1.0 / 9.0)
    expected = 2.0 * row.element_count * slope * math.sin(math.radians(15.6)) ** 2
    assert state.tangent[2, 2] == pytest.approx(expected, rel=1e-4)  # the unit force itself shifts the point


def test_o_arrangement_tilts_stiffer_than_x():
    x_pair = BearingPair(bearing=tapered(110, 200, 56, 15.6), arrangement="X")
    stiff, soft = (equilibrium(pair, (21.8e3, 0.0, 0.0)).tangent[4, 4] for pair in (HSS_PAIR, x_pair))
    assert stiff > 10.0 * soft


def test_roller_profile_softens():
    profiled = cylindrical(160, 290, 80, profile_factor=None)
    straight, round_ended = (equilibrium(b, (129.9e3, 0.0, 0.0)).tangent for b in (NJ2232, profiled))
    assert round_ended[0, 0] < straight[0, 0]
    assert round_ended[4, 4] < straight[4, 4]


LOADED = {
    "cylindrical": (lambda **options: cylindrical(160, 290, 80, **options), (129.9e3, 0.0, 0.0)),
    "cylindrical, light": (lambda **options: cylindrical(160, 290, 80, **options), (5e3, 0.0, 0.0)),
    "tapered": (lambda **options: tapered(110, 200, 56, 15.6, **options), (21.8e3, 0.0, 12.9e3)),
    "tapered, light": (lambda **options: tapered(110, 200, 56, 15.6, **options), (2e3, 0.0, 1e3)),
}


@pytest.mark.parametrize("name", LOADED)
@pytest.mark.parametrize("profile", [None, 0.0], ids=["standard profile", "none"])
@pytest.mark.parametrize("tilt", [0.0, 5e-4], ids=["straight", "misaligned"])
def test_the_laminae_leave_half_a_percent_in_the_stiffness(name, profile, tilt):
    build, force = LOADED[name]
    usual, fine = (
        equilibrium(build(profile_factor=profile, **laminae), force, tilt=(0.0, tilt)).tangent
        for laminae in ({}, {"laminae": 960})
    )
    assert usual[0, 0] == pytest.approx(fine[0, 0], rel=5e-3)
    assert usual[4, 4] == pytest.approx(fine[4, 4], rel=5e-3)


def test_a_state_shows_itself_in_one_line():
    state = equilibrium(NJ2232, (129.9e3, 0.0, 0.0))
    carrying = np.count_nonzero(state.element_load)
    assert repr(state) == f"<BearingState (33.3, 0, 0) µm under (130, 0, 0) kN, {carrying} of 17 elements loaded>"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: equilibrium(NJ2232, (1e3, 0.0, 5.0)), "bearing: no row carries an axial force of 5 N"),
        (
            lambda: equilibrium(tapered(160, 240, 51, 17.0), (0.0, 0.0, -1e3)),
            "bearing: no row carries an axial force of",
        ),
        (lambda: equilibrium(tapered(160, 240, 51, 17.0), (1e4, 0.0, 10.0)), "single row with a contact angle"),
        (lambda: equilibrium(NJ2232, (0.0, 0.0, 0.0)), "force = 0"),
        (lambda: equilibrium(NJ2232, (1.0, 0.0)), "three finite numbers"),
        (lambda: cylindrical(160, 290, 80, element_count=40).rows, "do not fit"),
        (lambda: BearingPair(bearing=NJ2232, arrangement="Y").rows, "arrangement = 'Y'"),
        (lambda: BearingPair(bearing=NJ2232, arrangement="X", axial_preload=1e-5).rows, "axial_preload"),
    ],
)
def test_refusals_say_what_is_wrong(call, message):
    with pytest.raises(BearingError, match=message):
        call()
