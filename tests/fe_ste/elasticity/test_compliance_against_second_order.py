"""Deflection under given contact forces against 20-node bricks, extrapolated; see benchmarks/truth/README.md."""

from __future__ import annotations

import json
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from ..cases.benchmarks import benchmark_module

FOLDER = Path(__file__).parents[3] / "benchmarks" / "truth"
STORED: dict[str, dict[str, Any]] = json.loads((FOLDER / "results.json").read_text(encoding="utf-8"))
CASES = [(name, int(gear)) for name, entry in STORED.items() for gear in entry["gears"]]

#: Half a per cent is asked, from either end of the truth's range (orders 2 to 3.5 of its extrapolation).
ASKED = 5e-3


@pytest.fixture(scope="module")
def agreement() -> ModuleType:
    return benchmark_module("truth", "agreement_with_truth")


def close(agreement: ModuleType, name: str, gear: int) -> None:
    ours = agreement.superelement_um(name, gear)
    low, high = STORED[name]["gears"][str(gear)]["between_um"]
    assert ours == pytest.approx(low, rel=ASKED)
    assert ours == pytest.approx(high, rel=ASKED)


@pytest.mark.validation
def test_helical_pinion(agreement: ModuleType) -> None:
    close(agreement, "helical 0.2", 0)


@pytest.mark.validation
@pytest.mark.parametrize(
    ("name", "gear"),
    [pytest.param(*case, marks=() if case == ("internal 0", 1) else pytest.mark.long) for case in CASES],
)
def test_every_stored_gear(agreement: ModuleType, name: str, gear: int) -> None:
    close(agreement, name, gear)


@pytest.mark.parametrize(("name", "gear"), CASES)
def test_the_truth_is_known_to_six_per_mille(name: str, gear: int) -> None:
    entry = STORED[name]["gears"][str(gear)]
    coarse, fine = (mesh["deflection_um"] for mesh in entry["meshes"][-2:])
    low, high = entry["between_um"]
    assert coarse < fine < low <= entry["deflection_um"] <= high
    assert high - low < 6e-3 * entry["deflection_um"]


@pytest.mark.long
@pytest.mark.parametrize(("name", "gear"), CASES)
def test_the_stored_truth_is_what_its_bricks_give(name: str, gear: int) -> None:
    """The coarsest stored mesh again; digits of the file are 1e-6 of the deflection."""
    renew, stored = benchmark_module("truth", "renew"), STORED[name]["gears"][str(gear)]["meshes"][0]
    again = renew.mesh_entry(renew.stored_load(name), gear, stored["factor"])
    print(f"{name}, gear {gear + 1}: {again['deflection_um']} um, stored {stored['deflection_um']} um")
    assert again["unknowns"] == stored["unknowns"]
    assert again["deflection_um"] == pytest.approx(stored["deflection_um"], rel=1e-5)
