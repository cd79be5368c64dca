"""Boundary dimensions of designations: against those that makers print."""

from __future__ import annotations

import pytest

from exugear.gearbox.sections.designations import boundary_of

PRINTED = {
    "6000": (10.0, 26.0, 8.0),
    "6016": (80.0, 125.0, 22.0),
    "6040": (200.0, 310.0, 51.0),
    "6216": (80.0, 140.0, 26.0),
    "6316": (80.0, 170.0, 39.0),
    "6410": (50.0, 130.0, 31.0),
    "7216": (80.0, 140.0, 26.0),
    "7340": (200.0, 420.0, 80.0),
    "N1015": (75.0, 115.0, 20.0),
    "NU1005": (25.0, 47.0, 12.0),
    "NU1040": (200.0, 310.0, 51.0),
    "N202": (15.0, 35.0, 11.0),
    "NU217": (85.0, 150.0, 28.0),
    "NJ317": (85.0, 180.0, 41.0),
    "NU406": (30.0, 90.0, 23.0),
    "NJ416": (80.0, 200.0, 48.0),
    "NU2204": (20.0, 47.0, 18.0),
    "NJ2217": (85.0, 150.0, 36.0),
    "NU2240": (200.0, 360.0, 98.0),
    "NU2317": (85.0, 180.0, 60.0),
    "22205": (25.0, 52.0, 18.0),
    "22218": (90.0, 160.0, 40.0),
    "22308": (40.0, 90.0, 33.0),
    "22319": (95.0, 200.0, 67.0),
    "22340": (200.0, 420.0, 138.0),
    "30203": (17.0, 40.0, 13.25),
    "30224": (120.0, 215.0, 43.5),
    "30302": (15.0, 42.0, 14.25),
    "30313": (65.0, 140.0, 36.0),
    "32012": (60.0, 95.0, 23.0),
    "32020": (100.0, 150.0, 32.0),
    "32213": (65.0, 120.0, 32.75),
    "32304": (20.0, 52.0, 22.25),
    "32312": (60.0, 130.0, 48.5),
    "33013": (65.0, 100.0, 27.0),
    "33020": (100.0, 150.0, 39.0),
}
"""Bore, outer diameter and width (mm) as catalogues of FAG/INA, FBJ, IBB and KRW print them."""


@pytest.mark.parametrize("designation", PRINTED)
def test_boundary_dimensions_are_those_that_makers_print(designation: str) -> None:
    found = boundary_of(designation)
    assert found is not None
    assert (found.bore, found.outer, found.width) == PRINTED[designation]


@pytest.mark.parametrize(
    "designation", ["22204", "22307", "NU200", "NJ302", "NU404", "N1002", "6417", "30232", "24130"]
)
def test_what_no_maker_lists_has_no_dimensions(designation: str) -> None:
    """The first six are smaller than any of their kind, though the dimension series has their bores."""
    assert boundary_of(designation) is None
