"""Messages about names that nothing in the file can be: they say which table to add."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError

from ..cases.spur import SPUR_CASE


@pytest.mark.parametrize(
    ("missing", "message"),
    [
        (["pairs"], r"meshes.spur.pair = 'spur': no such pair; the file has no pairs; add \[pairs.spur\]"),
        (["gears"], r"pairs.spur.pinion = 'pinion': no such gear; the file has no gears; add \[gears.pinion\]"),
        (
            ["gears", "pairs", "meshes"],
            r"output_gear = 'wheel': no such gear; the file has no gears; add \[gears.wheel\]",
        ),
    ],
)
def test_a_file_without_any_says_which_table_to_add(missing: list[str], message: str) -> None:
    content: dict[str, Any] = tomllib.loads(SPUR_CASE)
    for table in missing:
        del content[table]
    if "meshes" in missing:
        for body in content["bodies"].values():
            del body["gears_z_mm"]
    with pytest.raises(GearboxFileError, match=message):
        Gearbox.from_dict(content)
