"""Contact of balls against Hertz's integrals, the pressures of ISO 76, another program and closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.integrate
import scipy.special

from exugear.system.bearings.rolling.contact import (
    bearing_load,
    elastic_energy,
    element_loads,
    equilibrium,
    pitch_averaged_tangent,
    row_contacts,
    tangent_stiffness,
)
from exugear.system.bearings.rolling.point_contact import (
    ball_constant,
    ball_pressure,
    elliptic_contact,
    elliptic_integrals,
    groove_contacts,
)
from exugear.system.bearings.rolling.rows import (
    STEEL_MODULUS,
    BallRow,
    BearingError,
    BearingOfRows,
    RollerRow,
    moved,
    pair_rows,
)
from exugear.system.bearings.stiffness import rotate_stiffness

DEEP_GROOVE = BallRow(element_diameter=0.0127, pitch_diameter=0.065, element_count=9)  # 209, Harris
ANGULAR = BallRow(  # 218, Harris
    element_diameter=0.02223,
    pitch_diameter=0.12526,
    element_count=16,
    contact_angle=math.radians(40.0),
    inner_conformity=0.5232,
    outer_conformity=0.5232,
)
ALIGNING = BallRow(element_diameter=0.008, pitch_diameter=0.046, element_count=14, aligning=True)
PLACE = 0.5 * 0.046 * math.tan(math.radians(10.0))
ROLLERS = RollerRow(element_diameter=0.02, effective_length=0.02, pitch_diameter=0.15, element_count=16, laminae=60)
BEARINGS = {
    "deep groove": (DEEP_GROOVE,),
    "deep groove, clearance": (replace(DEEP_GROOVE, radial_clearance=10e-6),),
    "angular contact, X": pair_rows(ANGULAR, "X", 0.03, 10e-6),
    "angular contact, O": pair_rows(ANGULAR, "O", 0.03, 10e-6),
    "four points": tuple(moved(ANGULAR, angle, 0.0) for angle in (-0.6, 0.6)),
    "self-aligning": tuple(moved(ALIGNING, sign * math.radians(10.0), sign * PLACE) for sign in (-1.0, 1.0)),
    "balls and rollers": (moved(ANGULAR, 0.7, -0.05), ROLLERS),
}
DISPLACEMENT = np.array([20e-6, 10e-6, 8e-6, 1e-4, -2e-4, 0.0])


@pytest.mark.parametrize("parameter", [0.0, 1e-8, 0.1, 0.5, 0.9, 0.999, 1.0 - 1e-8])
def test_elliptic_integrals_are_scipys(parameter):
    expected = (scipy.special.ellipk(parameter), scipy.special.ellipe(parameter))
    assert elliptic_integrals(parameter) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("row", [DEEP_GROOVE, ANGULAR, replace(DEEP_GROOVE, inner_conformity=0.505)])
def test_pressed_ellipses_are_those_of_hertzs_integrals(row):
    # Johnson, Contact Mechanics, (3.25), (3.27): the half ellipsoid of pressure p over half axes a, b displaces the
    # surfaces by (L - M x^2 - N y^2) / (pi E*), with integrals L, M, N; M and N belong to the curvatures.
    for contact in groove_contacts(row):
        load, star = 1000.0, 0.5 * STEEL_MODULUS
        pressure = contact.pressure * load ** (1.0 / 3.0)
        long = math.sqrt(1.5 * load * contact.ratio / (math.pi * pressure))
        short = long / contact.ratio

        def integral(powers, a=long, b=short, p=pressure):
            def integrand(angle):  # w = b^2 tan^2(angle) takes the infinite range
                w = (b * math.tan(angle)) ** 2
                slope = 2.0 * b**2 * math.tan(angle) / math.cos(angle) ** 2
                return slope / math.sqrt((a**2 + w) ** powers[0] * (b**2 + w) ** powers[1] * w)

            return 0.5 * math.pi * p * a * b * scipy.integrate.quad(integrand, 0.0, math.pi / 2, epsrel=1e-11)[0]

        approach = integral((1, 1)) / (math.pi * star)
        along, across = (2.0 * integral(powers) / (math.pi * star) for powers in ((3, 1), (1, 3)))
        assert contact.compliance * load ** (2.0 / 3.0) == pytest.approx(approach, rel=1e-8)  # the quadrature's
        assert contact.curvature_sum == pytest.approx(along + across, rel=1e-8)


def test_a_ball_between_planes_is_the_closed_form():
    # Hertz, sphere on a plane: Q = 4/3 E* sqrt(R) delta^1.5 with E* = E' / 2, twice in series;
    # p = (6 Q E*^2 / R^2)^(1/3) / pi.
    planes = replace(DEEP_GROOVE, pitch_diameter=1e9, inner_conformity=1e9, outer_conformity=1e9)
    radius, star = 0.5 * 0.0127, 0.5 * STEEL_MODULUS
    one = 4.0 / 3.0 * star * math.sqrt(radius)
    assert ball_constant(planes) == pytest.approx(one / 2.0**1.5, rel=1e-7)
    assert ball_pressure(planes) == pytest.approx((6.0 * star**2 / radius**2) ** (1.0 / 3.0) / math.pi, rel=1e-7)


def test_ellipses_near_a_circle_have_no_step():
    # Below a ratio of 1.0005 a series stands in for 0 / 0; F(rho) is 3/8 of the squared ratio less 1 there.
    ratios = [elliptic_contact(100.0, 0.375 * beyond).ratio ** 2 - 1.0 for beyond in (0.9e-3, 1.1e-3)]
    assert ratios == pytest.approx([0.9e-3, 1.1e-3], rel=1e-3)


@pytest.mark.parametrize(("ratio", "factor"), [(0.10, 16.4), (0.20, 14.0), (0.30, 11.6)])
def test_the_static_rating_of_iso_76_presses_balls_by_4200_mpa(ratio, factor):
    # ISO 76:2006: C0 = f0 i Z D^2 cos(alpha), table of f0 for deep-groove bearings, Q = 5 C0 / (Z cos(alpha)).
    row = BallRow(element_diameter=0.010, pitch_diameter=0.010 / ratio, element_count=3)
    load = 5.0 * factor * 10.0**2
    # The standard takes 207 GPa; f0 is printed with three digits: 0.15 % of the pressure.
    scale = (207.0 / 206.0) ** (2.0 / 3.0)
    assert scale * ball_pressure(row) * load ** (1.0 / 3.0) == pytest.approx(4200e6, rel=2e-3)


@pytest.mark.parametrize(
    ("clearance", "force", "radial", "axial", "tilt"),
    [
        (0.0, (1000.0, 0.0, 0.0), 15.1101e-6, None, 0.0),
        (0.0, (0.0, 0.0, 1000.0), None, 133.5381e-6, 0.0),
        (10e-6, (1000.0, 0.0, 0.0), 21.223e-6, None, 0.0),
        (10e-6, (0.0, 0.0, 1000.0), None, 149.1717e-6, 0.0),
        (10e-6, (1000.0, 0.0, 1000.0), 19.5923e-6, 146.4603e-6, 2.6872e-3),
    ],
)
def test_a_deep_groove_bearing_moves_as_a_commercial_program_has_it(clearance, force, radial, axial, tilt):
    # Results of MASTA for 7 balls of 11.5 mm on 43.5 mm, grooves of 0.52 and 0.53, 210 GPa, printed in
    # github.com/minzhun/ISO16281 (Test_BallBearing.py). Stiffness goes with the modulus: load in its proportion.
    row = BallRow(
        element_diameter=0.0115,
        pitch_diameter=0.0435,
        element_count=7,
        inner_conformity=0.52,
        outer_conformity=0.53,
        radial_clearance=clearance,
    )
    scaled = np.array(force) * 206.0 / 210.0
    # There the ring is free to tilt, and takes its tilt at the pitch diameter, not where the groove's centre is.
    state = equilibrium(BearingOfRows((row,)), scaled, tilt=(0.0, tilt * 21.75 / (21.75 + 0.02 * 11.5)))
    if radial is not None:
        assert state.displacement[0] == pytest.approx(radial, rel=1e-4 if tilt == 0.0 else 2e-3)
    if axial is not None:
        assert state.displacement[2] == pytest.approx(axial, rel=1e-4 if tilt == 0.0 else 2e-3)
    if tilt != 0.0:
        assert abs(state.load[4]) < 0.05  # N m, of 9.8 that the axial force has at the raceway


def test_the_contact_angle_grows_under_thrust_by_joness_equation():
    # Jones: F_a / (Z K A^1.5) = sin(alpha) (cos(alpha_0) / cos(alpha) - 1)^1.5.
    force = 17800.0
    state = equilibrium(BearingOfRows((ANGULAR,)), (0.0, 0.0, force))
    distance = (2.0 * 0.5232 - 1.0) * 0.02223
    angle = math.atan2(
        distance * math.sin(math.radians(40.0)) + state.displacement[2], distance * math.cos(math.radians(40.0))
    )
    expected = math.sin(angle) * (math.cos(math.radians(40.0)) / math.cos(angle) - 1.0) ** 1.5
    assert force / (16 * ball_constant(ANGULAR) * distance**1.5) == pytest.approx(expected, rel=1e-8)
    assert math.degrees(angle) == pytest.approx(41.6, abs=0.2)  # Harris, from a chart


def test_the_most_loaded_ball_carries_the_classic_factor_times_the_mean():
    # Stribeck, point contact without clearance: Q_max = 4.37 F / (Z cos(alpha)) (NSK, Technical Report E728, 5.1).
    many = replace(DEEP_GROOVE, element_diameter=0.005, pitch_diameter=0.5, element_count=200)
    state = equilibrium(BearingOfRows((many,)), (2e3, 0.0, 0.0))
    assert state.element_load.max() == pytest.approx(4.37 * 2e3 / 200, rel=2e-3)  # three digits


@pytest.mark.parametrize("name", BEARINGS)
def test_load_is_the_gradient_of_the_energy_and_tangent_that_of_the_load(name):
    contacts = row_contacts(BEARINGS[name])
    load, tangent = bearing_load(contacts, DISPLACEMENT), tangent_stiffness(contacts, DISPLACEMENT)
    np.testing.assert_array_equal(tangent, tangent.T)
    for column, size in enumerate([1e-9] * 3 + [1e-8] * 3):
        step = size * np.eye(6)[column]
        ahead, behind = DISPLACEMENT + step, DISPLACEMENT - step
        work = elastic_energy(contacts, ahead) - elastic_energy(contacts, behind)
        quotient = (bearing_load(contacts, ahead) - bearing_load(contacts, behind)) / (2.0 * size)
        # Round-off of the energy over a step of 1 nm; slopes like the root of the approach at the zone's edge.
        assert work / (2.0 * size) == pytest.approx(load[column], abs=1e-4 * np.abs(load).max())
        assert np.all(np.abs(quotient - tangent[:, column]) <= 1e-4 * np.abs(tangent).max(axis=1) + 1e-2)


@pytest.mark.parametrize("name", BEARINGS)
def test_turning_by_an_element_pitch_turns_load_and_tangent(name):
    rows = BEARINGS[name]
    pitch = 2.0 * math.pi / rows[0].element_count
    turned, straight = row_contacts(rows, pitch), row_contacts(rows)
    if all(row.element_count == rows[0].element_count for row in rows):
        expected = bearing_load(straight, DISPLACEMENT)
        np.testing.assert_allclose(
            bearing_load(turned, DISPLACEMENT), expected, rtol=0.0, atol=1e-9 * np.abs(expected).max()
        )
    angle = 0.3
    turn = np.kron(
        np.eye(2), [[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]]
    )
    expected = rotate_stiffness(tangent_stiffness(straight, DISPLACEMENT), angle)
    found = tangent_stiffness(row_contacts(rows, angle), turn @ DISPLACEMENT)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


def test_rows_of_balls_and_of_rollers_add_up():
    mixed = BEARINGS["balls and rollers"]
    parts = [row_contacts((row,)) for row in mixed]
    whole = row_contacts(mixed)
    for function in (bearing_load, tangent_stiffness):
        np.testing.assert_allclose(function(whole, DISPLACEMENT), sum(function(part, DISPLACEMENT) for part in parts))
    elements = np.concatenate([element_loads(part, DISPLACEMENT) for part in parts])
    np.testing.assert_array_equal(element_loads(whole, DISPLACEMENT), elements)


def test_a_self_aligning_bearing_tilts_freely():
    rows = BEARINGS["self-aligning"]
    straight, tilted = (
        equilibrium(BearingOfRows(rows), (3e3, 0.0, 500.0), tilt=tilt) for tilt in ((0, 0), (0.02, 0.01))
    )
    np.testing.assert_array_equal(straight.load, tilted.load)
    assert np.all(straight.tangent[3:] == 0.0)


def test_four_points_hold_both_directions_and_stiffer_than_two():
    four, deep = BearingOfRows(BEARINGS["four points"]), BearingOfRows((moved(ANGULAR, 0.0, 0.0),))
    pushed, pulled = (equilibrium(four, (0.0, 0.0, force)) for force in (5e3, -5e3))
    np.testing.assert_allclose(pushed.displacement[2], -pulled.displacement[2], rtol=1e-9)
    assert np.count_nonzero(pushed.element_load) == 16
    radial = pitch_averaged_tangent(four, (1.0, 0.0, 5e3))[2, 2] / pitch_averaged_tangent(deep, (1.0, 0.0, 5e3))[2, 2]
    assert radial > 1.5


def test_preload_holds_an_o_pair_with_half_the_approach_in_each_row():
    pair = pair_rows(ANGULAR, "O", 0.03, 20e-6)
    shifted = bearing_load(row_contacts((ANGULAR,)), np.array([0.0, 0.0, 10e-6, 0.0, 0.0, 0.0]))
    contacts = row_contacts(pair)
    rest = np.zeros(6)
    np.testing.assert_allclose(bearing_load(contacts, rest), 0.0, atol=1e-9 * shifted[2])
    one = element_loads(contacts, rest)[0]
    expected = element_loads(row_contacts((ANGULAR,)), np.array([0.0, 0.0, 10e-6, 0.0, 0.0, 0.0]))[0]
    # The preloaded row's curvatures are those at its new contact angle.
    assert one == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("force", [1e-2, 1.0, 1e5])
def test_light_and_heavy_loads_find_their_balance(force):
    state = equilibrium(BearingOfRows((ANGULAR,)), (0.5 * force, 0.0, force))
    np.testing.assert_allclose(state.load[:3], (0.5 * force, 0.0, force), rtol=0.0, atol=1e-9 * force)


def test_the_static_rating_of_iso_76_presses_rollers_by_4000_mpa():
    # ISO 76:2006: C0 = 44 (1 - gamma) i Z L D cos(alpha), Q = 5 C0 / (Z cos(alpha)), line contact.
    row = replace(ROLLERS, laminae=30)
    rating = 44e6 * (1.0 - row.diameter_ratio) * row.element_count * row.effective_length * row.element_diameter
    contacts = row_contacts((row,))
    approach = (5.0 * rating / row.element_count / row.contact_constant) ** 0.9
    displacement = np.array([approach, 0.0, 0.0, 0.0, 0.0, 0.0])
    load, state = 5.0 * rating / row.element_count, equilibrium(BearingOfRows((row,)), (rating, 0.0, 0.0))
    assert element_loads(contacts, displacement)[0] == pytest.approx(load, rel=1e-9)
    # 44 has two digits: 1 % of the load, half of it in the pressure.
    pressure = state.element_pressure[0] * math.sqrt(load / state.element_load[0])
    assert pressure == pytest.approx(4000e6, rel=8e-3)


def test_states_carry_loads_of_laminae_row_by_row():
    rows = BEARINGS["balls and rollers"]
    state = equilibrium(BearingOfRows(rows), (30e3, 0.0, 10e3))
    balls, rollers = state.lamina_load
    assert balls is None
    assert rollers.shape == (16, 60)
    np.testing.assert_allclose(rollers.sum(axis=1), state.element_load[16:], rtol=1e-12)


@pytest.mark.parametrize(
    ("rows", "force", "message"),
    [
        ((ANGULAR,), (0.0, 0.0, -1e3), "bearing: no row carries an axial force of -1000 N"),
        ((ANGULAR,), (5e3, 0.0, 0.0), "single row with a contact angle"),
        ((ALIGNING,), (1e3, 0.0, 10.0), "bearing: no row carries an axial force of"),
        ((DEEP_GROOVE,), (0.0, 0.0, 0.0), "force = 0"),
    ],
)
def test_forces_that_nothing_holds_are_refused(rows, force, message):
    with pytest.raises(BearingError, match=message):
        equilibrium(BearingOfRows(rows), force)


@pytest.mark.parametrize("axial", [1e3, -1e3])
def test_deep_grooves_hold_both_directions(axial):
    state = equilibrium(BearingOfRows(BEARINGS["deep groove, clearance"]), (500.0, 0.0, axial))
    np.testing.assert_allclose(state.load[:3], (500.0, 0.0, axial), atol=1e-6)


def test_preload_that_moves_grooves_past_each_other_is_refused():
    with pytest.raises(BearingError, match="axial_preload = 2000 µm moves the grooves"):
        pair_rows(ANGULAR, "O", 0.03, 2e-3)
