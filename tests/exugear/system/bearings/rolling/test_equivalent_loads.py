"""Equivalent loads against the examples of a catalogue, the printed limits e of ISO 281 and their own continuity."""

import math

import pytest

from exugear.system.bearings.rolling.ratings import (
    CONTACT_ANGLES,
    DOUBLE_ROW_SMALL_Y,
    DOUBLE_ROW_X,
    DOUBLE_ROW_Y,
    SINGLE_ROW_X,
    SINGLE_ROW_Y,
    basic_static_rating,
    equivalent_load,
    equivalent_static_load,
)
from exugear.system.bearings.rolling.rows import BallRow, RollerRow


def balls(*degrees):
    return [
        BallRow(element_diameter=0.011906, pitch_diameter=0.06, element_count=9, contact_angle=math.radians(angle))
        for angle in degrees
    ]


def rollers(*degrees):
    return [
        RollerRow(
            element_diameter=0.01,
            effective_length=0.012,
            pitch_diameter=0.065,
            element_count=14,
            contact_angle=math.radians(angle),
        )
        for angle in degrees
    ]


def dynamic_load(rows, bearing_type, radial, axial):
    return equivalent_load(rows, bearing_type, radial, axial, basic_static_rating(rows, bearing_type))


def test_deep_groove_ball_bearing_of_a_catalogue_example():
    # NSK catalogue E1102, section 5.7, example 3: 6208 under 2500 N and 1000 N: X = 0.56, Y = 1.67, P = 3070 N.
    assert dynamic_load(balls(0.0), "deep_groove_ball", 2500.0, 1000.0) == pytest.approx(3070.0, abs=5.0)
    assert dynamic_load(balls(0.0), "deep_groove_ball", 2500.0, 500.0) == 2500.0  # below e = 0.23


def test_tapered_roller_bearing_of_a_catalogue_example():
    # The same, example 5: HR30305DJ with e = 0.83, Y = 0.73 under 1569 N and 3474 N: 3164 N.
    rows = rollers(math.degrees(math.atan(0.4 / 0.73)))
    assert dynamic_load(rows, "tapered_roller", 1569.0, 3474.0) == pytest.approx(3164.0, abs=1.0)


def test_spherical_roller_bearing_of_a_catalogue_example():
    # The same, example 4: 23126 with Y_3 = 2.4 under 45 kN and 8 kN: 64.2 kN.
    angle = math.degrees(math.atan(0.45 / 2.4))
    load = dynamic_load(rollers(angle, -angle), "spherical_roller", 45e3, 8e3)
    assert load == pytest.approx(64.2e3, abs=1.0)


# e of ISO 281:2007, table 3, at the largest relative axial load.
PRINTED_LIMITS = {10.0: 0.54, 15.0: 0.56, 20.0: 0.57, 25.0: 0.68, 30.0: 0.80, 35.0: 0.95, 40.0: 1.14, 45.0: 1.34}


@pytest.mark.parametrize("angle", PRINTED_LIMITS)
def test_tabulated_sums_meet_at_the_printed_limit(angle):
    line = CONTACT_ANGLES.index(angle)
    e = PRINTED_LIMITS[angle]
    # X and Y have two digits, so the crossings are known to 2 %.
    assert (1.0 - SINGLE_ROW_X[line]) / SINGLE_ROW_Y[line][-1] == pytest.approx(e, rel=0.02)
    crossing = (1.0 - DOUBLE_ROW_X[line]) / (DOUBLE_ROW_Y[line][-1] - DOUBLE_ROW_SMALL_Y[line][-1])
    assert crossing == pytest.approx(e, rel=0.05)


def test_double_row_factors_follow_from_single_row_ones():
    # Palmgren's theory behind ISO/TR 1281-1: above e a double row bearing has 2^(0.7) = 1.625 times both factors,
    # below e, with P = 1.625 F_r at e, Y = 0.625 / e; the tables have two digits.
    for line in range(1, len(CONTACT_ANGLES)):
        assert DOUBLE_ROW_X[line] == pytest.approx(1.625 * SINGLE_ROW_X[line], rel=0.02)
        for single, small, large in zip(SINGLE_ROW_Y[line], DOUBLE_ROW_SMALL_Y[line], DOUBLE_ROW_Y[line], strict=True):
            assert large == pytest.approx(1.625 * single, rel=0.01)
            assert small == pytest.approx(0.625 * single / (1.0 - SINGLE_ROW_X[line]), rel=0.02)


def test_tabulated_contact_angles_give_tabulated_factors():
    # 15 degrees at 0.689 MPa, 40 degrees at any load; ISO 281:2007, table 3.
    axial = 0.689e6 * 9 * 0.011906**2
    assert dynamic_load(balls(15.0), "angular_contact_ball", axial, axial) / axial == pytest.approx(1.74)
    assert dynamic_load(balls(40.0), "angular_contact_ball", 1.0, 2.0) == pytest.approx(0.35 + 2 * 0.57)
    pair = balls(40.0, -40.0)
    assert dynamic_load(pair, "angular_contact_ball", 1.0, 1.0) == pytest.approx(1.55)
    assert dynamic_load(pair, "angular_contact_ball", 1.0, 2.0) == pytest.approx(0.57 + 2 * 0.93)
    # SKF's catalogue (2018) for its four-point bearings of 35 degrees: F_r + 0.66 F_a, and 0.6 F_r + 1.07 F_a.
    assert dynamic_load(balls(35.0), "four_point_ball", 1.0, 0.9) == pytest.approx(1.0 + 0.66 * 0.9)
    assert dynamic_load(balls(35.0), "four_point_ball", 1.0, 2.0) == pytest.approx(0.6 + 2 * 1.07)


def test_rows_in_tandem_share_the_axial_load_and_opposite_ones_do_not():
    shared = dynamic_load(balls(15.0, 15.0), "angular_contact_ball", 2000.0, 4000.0)
    single = dynamic_load(balls(15.0), "angular_contact_ball", 1000.0, 2000.0)
    assert shared == pytest.approx(2.0 * single)
    opposite = dynamic_load(balls(15.0, -15.0), "angular_contact_ball", 0.0, 2000.0)
    alone = dynamic_load(balls(15.0), "angular_contact_ball", 0.0, 2000.0)
    assert opposite == pytest.approx(1.625 * alone, rel=0.01)


def test_rollers_without_contact_angle_count_their_radial_load():
    for load in (dynamic_load, equivalent_static_load):
        assert load(rollers(0.0), "cylindrical_roller", 1000.0, 300.0) == 1000.0


def test_static_loads_are_those_of_iso_76():
    assert equivalent_static_load(balls(0.0), "deep_groove_ball", 1000.0, 1000.0) == pytest.approx(1100.0)
    assert equivalent_static_load(balls(0.0), "deep_groove_ball", 1000.0, 500.0) == 1000.0
    assert equivalent_static_load(balls(40.0), "angular_contact_ball", 1.0, 4.0) == pytest.approx(0.5 + 4 * 0.26)
    assert equivalent_static_load(balls(40.0, -40.0), "angular_contact_ball", 1.0, 4.0) == pytest.approx(1 + 4 * 0.52)
    cotangent = 1.0 / math.tan(math.radians(12.0))
    assert equivalent_static_load(rollers(12.0), "tapered_roller", 1.0, 1.0) == pytest.approx(0.5 + 0.22 * cotangent)
    double = equivalent_static_load(rollers(12.0, -12.0), "spherical_roller", 1.0, 1.0)
    assert double == pytest.approx(1.0 + 0.44 * cotangent)
    assert equivalent_static_load(balls(12.0, -12.0), "self_aligning_ball", 1.0, 1.0) == pytest.approx(double)
