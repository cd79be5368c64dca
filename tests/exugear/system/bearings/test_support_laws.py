"""Laws of supports: matrices of linear bearings, rows and cages of the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.connections import CatalogueSection
from exugear.system.bearings.rolling.contact import pitch_averaged_tangent
from exugear.system.bearings.stiffness import (
    axially_symmetric,
    cage_ratio,
    catalogue_stiffness,
    linear_law,
    rolling_law,
)

from ...cases.bearing import bearing_gearbox
from ...cases.roller_bearings import BearingPair, CylindricalRollerBearing

SECTION = CatalogueSection(
    type="cylindrical_roller",
    bore_mm=160.0,
    outer_diameter_mm=290.0,
    width_mm=80.0,
    arrangement="tandem",
    row_distance_mm=100.0,
    radial_load_kN=259.7,
)


def test_a_catalogue_section_is_the_bearing_that_it_describes():
    one = CylindricalRollerBearing(bore=0.160, outside_diameter=0.290, width=0.080)
    pair = BearingPair(bearing=one, arrangement="tandem", row_distance=0.100)
    expected = axially_symmetric(pitch_averaged_tangent(pair, (259.7e3, 0.0, 0.0)))
    # Millimetres of the file against metres: rounding of the dimensions.
    np.testing.assert_allclose(catalogue_stiffness(SECTION), expected, atol=1e-9 * expected.max())


def test_the_housing_factor_and_the_damping_time_scale_a_bearings_matrices():
    gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    bearing = next(b for b in gearbox.bearings if b.catalogue is not None and b.stiffness is None and b.damping is None)
    law = linear_law(bearing, 4e-6)
    np.testing.assert_array_equal(law.stiffness, bearing.factor * catalogue_stiffness(bearing.catalogue))
    np.testing.assert_array_equal(law.damping, 4e-6 * law.stiffness)


def test_planets_turn_about_their_bearings_and_shafts_in_theirs():
    """What the rows see, and how fast the cage follows: rollers roll on both rings."""
    bearings = {bearing.name: bearing for bearing in Gearbox.from_toml("cases/grc750/gearbox.toml").bearings}
    laws = {
        name: rolling_law(replace(bearings[name], cage="turning"), 4e-6, np.eye(6), 0.0) for name in ("pl_a_1", "hss_a")
    }
    assert {name: law.scale for name, law in laws.items()} == {"pl_a_1": -1.0, "hss_a": 0.3}
    ratio = laws["hss_a"].rows[0].diameter_ratio
    assert laws["hss_a"].cage_ratio == pytest.approx(0.5 * (1.0 - ratio))
    assert laws["pl_a_1"].cage_ratio > 0.5
    row = laws["pl_a_1"].rows[0]
    assert cage_ratio(row, outer_ring_turns=True) + cage_ratio(row, outer_ring_turns=False) == pytest.approx(1.0)


def test_what_the_file_adds_acts_where_the_rows_hold_less():
    bearings = {bearing.name: bearing for bearing in Gearbox.from_toml("cases/grc750/gearbox.toml").bearings}
    of_rows = np.diag([4e9, 3e9, 0.0, 1e6, 1e6, 0.0])
    law = rolling_law(bearings["pl_a_1"], 4e-6, of_rows, 0.5)
    np.testing.assert_array_equal(law.stiffness, np.diag([0.0, 0.0, 1e8, 0.0, 0.0, 0.0]))
    np.testing.assert_array_equal(law.damping, 4e-6 * law.stiffness)
    assert law.phase == pytest.approx(0.5 + 0.5 * np.pi / law.rows[0].element_count)
    assert law.cage_ratio == 0.0


def test_a_gear_that_turns_about_a_fixed_pin_carries_the_outer_ring_where_the_file_says_so(tmp_path):
    gearbox = bearing_gearbox(tmp_path, bearings__ball__outer_ring="body")
    ball, roller, *_ = gearbox.bearings
    assert (ball.carries_outer_ring, roller.carries_outer_ring) == (True, False)
    assert rolling_law(ball, 0.0, np.eye(6), 0.0).scale == -ball.factor
