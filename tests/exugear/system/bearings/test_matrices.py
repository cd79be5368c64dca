"""Matrices of bearings against exact identities."""

from __future__ import annotations

import math

import numpy as np
import pytest

from exugear.system.bearings.rolling.contact import pitch_averaged_tangent
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.bearings.stiffness import (
    axially_symmetric,
    proportional_damping,
    regularised,
    rotate_stiffness,
)

from ...cases.roller_bearings import BearingPair, CylindricalRollerBearing, TaperedRollerBearing

NJ2232 = CylindricalRollerBearing(bore=0.160, outside_diameter=0.290, width=0.080)
PAIR = BearingPair(
    bearing=TaperedRollerBearing(bore=0.110, outside_diameter=0.200, width=0.056, contact_angle=math.radians(15.6)),
    arrangement="O",
)


def test_axially_symmetric_mean_does_not_change_with_a_turn():
    mean = axially_symmetric(pitch_averaged_tangent(PAIR, (21.8e3, 0.0, 12.9e3), positions=1))
    np.testing.assert_allclose(rotate_stiffness(mean, 0.7), mean, atol=1e-12 * np.abs(mean).max())
    assert mean[0, 0] == mean[1, 1] or mean[0, 0] == pytest.approx(mean[1, 1], rel=1e-12)


def test_regularisation_touches_only_what_lies_below_the_floor():
    stiffness = pitch_averaged_tangent(NJ2232, (129.9e3, 0.0, 0.0), positions=1)
    held = regularised(stiffness, (1.0, 1.0, 1e8, 1.0, 1.0, 0.0))
    expected = stiffness.copy()
    expected[2, 2] = 1e8
    np.testing.assert_allclose(held, expected, atol=1e-6)
    np.testing.assert_array_equal(proportional_damping(held, 4e-6), 4e-6 * held)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: regularised(np.eye(6), (1.0, 2.0)), "six numbers"),
        (lambda: proportional_damping(np.eye(6), -1.0), "time_constant"),
    ],
)
def test_refusals_say_what_is_wrong(call, message):
    with pytest.raises(BearingError, match=message):
        call()
