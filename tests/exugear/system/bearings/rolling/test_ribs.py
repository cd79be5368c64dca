"""Ribs of cylindrical rollers: they hold the shaft along the axis, one way or both, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.sections.connections import CatalogueSection
from exugear.system.bearings.duty import ratings_of
from exugear.system.bearings.rolling.catalogue import catalogue_rows, estimates
from exugear.system.bearings.rolling.contact import (
    bearing_load,
    equilibrium,
    is_preloaded,
    row_contacts,
    tangent_stiffness,
)
from exugear.system.bearings.rolling.life import reference_life
from exugear.system.bearings.rolling.rows import (
    RIB_APPROACH,
    BearingError,
    BearingOfRows,
    raceway_rows,
)

from ....cases.rolling import assert_compiled_forces_are_those_of

PLAIN = {"type": "cylindrical_roller", "bore_mm": 60.0, "outer_diameter_mm": 130.0, "width_mm": 31.0}


def section(ribs, **keys):
    return CatalogueSection(**PLAIN, ribs=ribs, **keys)


def rows(ribs, **keys):
    return catalogue_rows(section(ribs, **keys))


def test_an_axial_load_moves_the_ring_by_the_law_of_its_line_contacts():
    """By hand: delta = (F / (Z c_L))^0.9 with c_L = 35948 L^(8/9) in N and mm, less the approach without load."""
    found = rows("both", rib_contact_mm=4.0, element_count=13)
    state = equilibrium(BearingOfRows(found), (0.0, 0.0, 20e3), tilt=np.zeros(2))
    constant = 35948.0 * 4.0 ** (8.0 / 9.0)
    expected = 1e-3 * (20e3 / (13 * constant)) ** 0.9 - RIB_APPROACH
    assert state.displacement[2] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(("ribs", "sign"), [("+z", 1.0), ("-z", -1.0)])
def test_one_rib_holds_one_way_alone(ribs, sign):
    found = rows(ribs)
    loads = [bearing_load(row_contacts(found), np.array([0.0, 0.0, z, 0.0, 0.0, 0.0])) for z in (1e-5, -1e-5)]
    held, free = loads if sign > 0 else loads[::-1]
    assert abs(held[2]) > 1e3
    assert not free.any()
    with pytest.raises(BearingError):
        equilibrium(BearingOfRows(found), (10e3, 0.0, -sign * 1e3), tilt=np.zeros(2))


def test_ribs_neither_tilt_nor_hold_across_and_change_no_rating():
    state = np.array([20e-6, 5e-6, 0.0, 1e-4, -2e-4, 0.0])
    plain, ribbed = rows("none"), rows("both")
    loads = [bearing_load(row_contacts(one), state) for one in (plain, ribbed)]
    assert loads[1] == pytest.approx(loads[0], rel=1e-4, abs=1e-3)
    stiffness = [tangent_stiffness(row_contacts(one), state) for one in (plain, ribbed)]
    assert stiffness[0][2, 2] == 0.0
    assert stiffness[1][2, 2] > 1e8
    across = np.ix_([0, 1, 3, 4], [0, 1, 3, 4])
    assert stiffness[1][across] == pytest.approx(stiffness[0][across], rel=1e-3)
    assert ratings_of(section("both")) == ratings_of(section("none"))
    assert not is_preloaded(ribbed)


def test_lives_count_raceways_alone():
    from exugear.system.bearings.duty import loads_of_rows
    from exugear.system.bearings.rolling.contact import bearing_state

    lives = []
    for ribs, axial in (("none", 0.0), ("both", 8e3)):
        found = rows(ribs)
        state = equilibrium(BearingOfRows(found), (30e3, 0.0, axial), tilt=np.zeros(2))
        state = bearing_state(row_contacts(found), state.displacement)
        lives.append(reference_life(found, loads_of_rows(state), "cylindrical_roller"))
    assert lives[1] == pytest.approx(lives[0], rel=1e-3)


@pytest.mark.parametrize("state", [(20e-6, 5e-6, 8e-6, 1e-4, -2e-4), (3e-6, 0.0, -4e-6, 0.0, 0.0)])
def test_the_compiled_law_has_the_same_forces(state):
    assert_compiled_forces_are_those_of(rows("both"), state)


def test_the_contact_of_ribs_is_told_as_an_estimate():
    (found,) = [one for one in estimates(section("+z")) if one.key == "rib_contact_mm"]
    assert (found.low, found.value, found.high) == pytest.approx((1.89, 3.78, 5.67))
    assert not any(one.key == "rib_contact_mm" for one in estimates(section("none")))
    assert len(raceway_rows(rows("both"))) == 1


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"rib_contact_mm": 3.0}, "rib_contact_mm requires ribs = '"),
        ({"type": "tapered_roller", "ribs": "both"}, "ribs is not applicable to type = 'tapered_roller'"),
    ],
)
def test_ribs_where_there_are_none_are_refused(keys, words):
    with pytest.raises(ValueError, match=words):
        CatalogueSection(**(PLAIN | keys))
