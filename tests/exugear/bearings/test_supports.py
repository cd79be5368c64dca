"""Supports: a bearing's matrices follow from it."""

from __future__ import annotations

import numpy as np

from exugear.bearings.contact import pitch_averaged_tangent
from exugear.bearings.matrices import axially_symmetric
from exugear.bearings.rollers import BearingPair, CylindricalRollerBearing
from exugear.bearings.supports import bearing_matrices, catalogue_stiffness
from exugear.model.gearbox import Gearbox
from exugear.model.sections.connections import CatalogueSection

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
    stiffness, damping = bearing_matrices(bearing, 4e-6)
    np.testing.assert_array_equal(stiffness, bearing.factor * catalogue_stiffness(bearing.catalogue))
    np.testing.assert_array_equal(damping, 4e-6 * stiffness)
