"""Supports: every kind of catalogue bearing has its law, and a bearing's matrices follow from it."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from exugear.bearings.contact import pitch_averaged_tangent
from exugear.bearings.matrices import axially_symmetric
from exugear.bearings.rollers import BearingPair, CylindricalRollerBearing
from exugear.bearings.supports import CATALOGUE_LAWS, bearing_matrices, catalogue_stiffness
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


def test_every_kind_of_catalogue_bearing_has_a_law():
    assert set(CATALOGUE_LAWS) == set(get_args(CatalogueSection.model_fields["type"].annotation))


def test_a_catalogue_section_is_the_bearing_that_it_describes():
    one = CylindricalRollerBearing(bore=0.160, outside_diameter=0.290, width=0.080)
    pair = BearingPair(bearing=one, arrangement="tandem", row_distance=0.100)
    expected = axially_symmetric(pitch_averaged_tangent(pair, (259.7e3, 0.0, 0.0)))
    np.testing.assert_array_equal(catalogue_stiffness(SECTION), expected)


def test_a_kind_of_its_own_needs_a_law_alone(monkeypatch):
    law = np.diag([3e8, 1e8, 5e7, 2e4, 4e4, 0.0])
    monkeypatch.setitem(CATALOGUE_LAWS, "cylindrical_roller", lambda section: section.radial_load_kN * law)
    catalogue_stiffness.cache_clear()
    found = np.diag(catalogue_stiffness(SECTION))
    catalogue_stiffness.cache_clear()
    assert found == pytest.approx(259.7 * np.array([2e8, 2e8, 5e7, 3e4, 3e4, 0.0]))


def test_the_housing_factor_and_the_damping_time_scale_a_bearings_matrices():
    gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    bearing = next(b for b in gearbox.bearings if b.catalogue is not None and b.stiffness is None and b.damping is None)
    stiffness, damping = bearing_matrices(bearing, 4e-6)
    np.testing.assert_array_equal(stiffness, bearing.factor * catalogue_stiffness(bearing.catalogue))
    np.testing.assert_array_equal(damping, 4e-6 * stiffness)
