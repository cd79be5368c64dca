"""The table of docs/reference/rating.md: templates rated to both editions."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.life.rating.sheet import FlankSheet
from exugear.project import Project

STRENGTH: dict[str, Any] = {
    "sigma_H_lim_MPa": 1500.0,
    "sigma_F_lim_MPa": 500.0,
    "curve": "case_hardened",
    "roughness_Rz_um": 4.8,
    "root_roughness_Rz_um": 20.0,
    "tolerance_class": 6,
}
PAGE = Path("docs/reference/rating.md")


def flanks(template: str) -> tuple[FlankSheet, ...]:
    path = Path(f"exugear/gearbox/templates/{template}.toml")
    content = tomllib.loads(path.read_text(encoding="utf-8"))
    content["operation"] = {"rated_speed_rpm": 1500.0}
    del content["loads"], content["lubricant"]
    bent = {"mean_stress_factor": 0.7}
    gears = {name: STRENGTH | (bent if name == "planet" else {}) for name in content["gears"]}
    content["rating"] = {"dynamic_factor": 1.05, "viscosity_40_mm2_per_s": 320.0, "gears": gears}
    return Project(Gearbox.from_dict(content, str(path)), Path("nowhere"), Choice("bushing")).rating().flanks


def documented(template: str) -> list[list[float]]:
    rows, inside = [], False
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if len(cells) != 8:
            continue
        if cells[0]:
            inside = cells[0].startswith(f"`{template}`")
        if inside:
            rows.append([float(cell) for cell in cells[2:]])
    return rows


@pytest.mark.parametrize("template", ["pair", "parallel", "planetary"])
def test_the_documented_values_of_templates_are_computed(template):
    """Half a unit of the last digit."""
    found = []
    for flank in flanks(template):
        now = flank.standard
        before = {**now, **flank.other_edition}
        found.append(
            [
                *(one["S_H"] for one in (now, before)),
                *(1e-6 * one["sigma_F0"] for one in (now, before)),
                *(one["S_F"] for one in (now, before)),
            ]
        )
    expected = documented(template)
    assert len(expected) == len(found)
    for row, values in zip(expected, found, strict=True):
        assert values == pytest.approx(row, abs=0.051) and values[:2] == pytest.approx(row[:2], abs=0.0051)
