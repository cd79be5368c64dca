"""The table of attributes agrees with the keys of the gearbox file and with itself."""

from __future__ import annotations

import pytest

from exugear.exchange.rexs.mapping import ATTRIBUTES, READ, RESULTS, UNITS
from exugear.exchange.rexs.to_case.notes import entries_of
from exugear.exchange.rexs.tree import Attribute, Component
from exugear.gearbox.sections.schema.keys import keys
from exugear.gearbox.units import unit_of, unit_of_key

ROWS = [row for rows in READ.values() for row in rows]
COUNTED = "MRev"
"""Millions of revolutions, which no input has."""


def test_every_key_is_one_of_the_gearbox_file_in_a_unit_of_its_quantity():
    known = {key.name for key in keys()}
    for row in ROWS:
        unit = unit_of(row.unit)
        assert unit is not None, row
        if row.key:
            assert row.key in known, row
            of_key = unit_of_key(row.key)
            assert of_key is None or of_key.quantity == unit.quantity, row


def test_an_attribute_has_one_unit_and_one_current_name():
    assert all(UNITS[row.attribute] == row.unit for row in ROWS)
    assert not ATTRIBUTES.keys() & ATTRIBUTES.values()


def test_results_are_in_known_units_with_names_in_the_order_of_versions():
    for result in RESULTS.values():
        assert unit_of(result.unit) is not None or result.unit == COUNTED, result
        assert list(result.names) == sorted(result.names), result


def test_entries_have_the_unit_of_their_key_and_the_first_attribute_has_priority():
    """206 GPa = 206e3 N/mm2; Ra of a root counts as Rz by a factor of 6 where the file has no Rz."""
    steel = Component(1, "material", attributes={"elastic_modulus": Attribute("206000", "N / mm^2")})
    assert entries_of(READ["material"], steel)["youngs_modulus_GPa"].value == 206.0
    gear = Component(2, "cylindrical_gear", attributes={"arithmetic_average_roughness_root": Attribute("2.5", "mum")})
    flank = Component(3, "flank", attributes={"averaged_peak_to_valley_height_root": Attribute("0.0161", "mm")})
    assert entries_of(READ["roughness"], gear)["root_roughness_Rz_um"].value == 15.0
    both = entries_of(READ["roughness"], gear, flank)["root_roughness_Rz_um"]
    assert (both.value, both.source) == (pytest.approx(16.1), "averaged_peak_to_valley_height_root")
    assert "root_roughness_Rz_um" not in entries_of(READ["roughness"], gear, limits=(0.1, 10.0))
