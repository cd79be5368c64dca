"""Spherical roller thrust bearings: one row of barrels on a sphere with its centre beside the bearing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from exugear.gearbox.sections.connections import CatalogueSection
from exugear.system.bearings.duty import loads_of_rows, ratings_of
from exugear.system.bearings.rolling.catalogue import MARGINS, catalogue_rows
from exugear.system.bearings.rolling.contact import (
    bearing_load,
    bearing_state,
    equilibrium,
    row_contacts,
    tangent_stiffness,
)
from exugear.system.bearings.rolling.life import basic_rating_life, reference_life
from exugear.system.bearings.rolling.ratings import (
    basic_dynamic_rating,
    equivalent_load,
    equivalent_static_load,
    thrust_contact_factor,
)
from exugear.system.bearings.rolling.rows import BearingError, BearingOfRows

from ....cases.rolling import assert_compiled_forces_are_those_of

KIND = "thrust_spherical_roller"
SIZES = {"type": KIND, "bore_mm": 200.0, "outer_diameter_mm": 340.0, "width_mm": 85.0}


def rows(**keys):
    return catalogue_rows(CatalogueSection(**SIZES, **keys))


@pytest.mark.parametrize(("towards", "sign"), [("+z", 1.0), ("-z", -1.0)])
def test_it_holds_one_way_and_tilts_freely_about_the_centre_of_its_sphere(towards, sign):
    found = rows(locates_towards=towards)
    state = equilibrium(BearingOfRows(found), (0.0, 0.0, sign * 200e3), tilt=np.zeros(2)).displacement
    with pytest.raises(BearingError):
        equilibrium(BearingOfRows(found), (0.0, 0.0, -sign * 200e3), tilt=np.zeros(2))
    stiffness = tangent_stiffness(row_contacts(found), state)
    centre = found[0].sphere_centre
    assert math.copysign(1.0, centre) == -sign
    assert abs(centre) == pytest.approx(0.135 * math.tan(math.radians(48.0)))
    # A turn about x through (0, 0, c) moves the origin along y by c.
    turn = np.array([0.0, centre, 0.0, 1.0, 0.0, 0.0])
    assert np.abs(stiffness @ turn).max() < 1e-9 * stiffness[3, 3]


def test_the_load_of_an_axial_displacement_is_that_of_equal_rollers():
    """By hand: F = Z sin(alpha) Q, Q from one roller pressed by z sin(alpha)."""
    (row,) = rows()
    z = 40e-6
    along = (np.arange(row.laminae) + 0.5) / row.laminae - 0.5
    approach = z * math.sin(row.contact_angle) - 2.0 * row.drop(along * row.effective_length)
    one = row.contact_constant / row.laminae * np.sum(np.maximum(approach, 0.0) ** (10.0 / 9.0))
    load = bearing_load(row_contacts((row,)), np.array([0.0, 0.0, z, 0.0, 0.0, 0.0]))
    assert load[2] == pytest.approx(row.element_count * math.sin(row.contact_angle) * one, rel=1e-12)


def test_the_compiled_law_has_the_same_forces():
    assert_compiled_forces_are_those_of(rows(), (10e-6, -5e-6, 40e-6, 1e-4, -2e-4))


@pytest.mark.parametrize(("ratio", "degrees", "table"), [(0.01, 50.0, 109.7), (0.01, 65.0, 107.1), (0.01, 80.0, 105.6)])
def test_factors_are_those_of_iso_281(ratio, degrees, table):
    """ISO 281:2007, thrust roller bearings, first line of the table."""
    assert thrust_contact_factor(ratio, math.radians(degrees)) == pytest.approx(table, rel=2e-3)


def test_ratings_are_axial_forces():
    """C_a of ISO 281 and C_0a = 220 (1 - g) Z L D sin(alpha) of ISO 76, N and mm; P_a = F_a + tan(alpha) F_r."""
    (row,) = rows()
    ratings = ratings_of(CatalogueSection(**SIZES))
    diameter, length, sine = 1e3 * row.element_diameter, 1e3 * row.effective_length, math.sin(row.contact_angle)
    static = 220.0 * (1.0 - row.diameter_ratio) * row.element_count * length * diameter * sine
    dynamic_margin, static_margin = MARGINS[KIND]  # the inside is estimated
    assert ratings.static * static_margin == pytest.approx(static, rel=1e-12)
    cosine = math.cos(row.contact_angle)
    size = (length * cosine) ** (7 / 9) * (sine / cosine) * row.element_count**0.75 * diameter ** (29 / 27)
    factor = thrust_contact_factor(row.diameter_ratio, row.contact_angle)
    assert ratings.dynamic * dynamic_margin == pytest.approx(1.15 * factor * size, rel=1e-12)
    tangent = math.tan(math.radians(48.0))
    assert equivalent_load([row], KIND, 10e3, 100e3, ratings.static) == pytest.approx(100e3 + 10e3 * tangent)
    assert equivalent_static_load([row], KIND, 10e3, 100e3) == pytest.approx(100e3 + 23e3 * tangent)


def test_the_reference_life_is_the_basic_one_less_what_edges_take():
    found = rows()
    rating = basic_dynamic_rating(found, KIND)
    load = 0.1 * rating
    state = equilibrium(BearingOfRows(found), (0.0, 0.0, load), tilt=np.zeros(2))
    state = bearing_state(row_contacts(found), state.displacement)
    life = reference_life(found, loads_of_rows(state), KIND)
    basic = basic_rating_life(rating, load, KIND)
    assert 0.5 * basic < life < basic


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"contact_angle_deg": 30.0}, "must lie between 40 and 58"),
        ({"arrangement": "X"}, "arrangement = 'X' is not applicable to type ="),
        ({"row_count": 2}, "row_count is not applicable to type ="),
        ({"ribs": "both"}, "ribs is not applicable to type ="),
    ],
)
def test_keys_that_make_no_sense_are_refused(keys, words):
    with pytest.raises(ValueError, match=words):
        CatalogueSection(**SIZES, **keys)
