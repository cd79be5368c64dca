"""The superelement and the full non-linear analysis on the same open sectors tell the same story.

The non-linear analysis is too stiff by what its bricks are too large, so that agreement on one mesh would say little:
what is compared is its limit over three meshes, and how both change with position and number of teeth. Results are
stored with meshes and settings in benchmarks/nonlinear/results.json; its README shows the convergence.
"""

from __future__ import annotations

import json
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from scipy.optimize import brentq

from ..cases.benchmarks import benchmark_module

FOLDER = Path(__file__).parents[3] / "benchmarks" / "nonlinear"
STORED: dict[str, dict[str, Any]] = json.loads((FOLDER / "results.json").read_text(encoding="utf-8"))
CALCULIX = json.loads((FOLDER.parent / "calculix" / "results.json").read_text(encoding="utf-8"))
PAIRS = ("spur", "helical", "internal")


def ste(name: str, method: str = "nonlinear") -> float:
    return float(STORED[name][method]["ste_um"])


@pytest.fixture(scope="module")
def agreement() -> ModuleType:
    return benchmark_module("nonlinear", "agreement")


def above(name: str) -> float:
    """Superelement over non-linear analysis."""
    return ste(name, "superelement") / ste(name)


def limit(pair: str, order: float | None = None) -> float:
    """Richardson limit of the non-linear analysis at position 0, with the order that its three meshes show or another.

    Element sizes are 1/0.6, 1 and 1/1.5. The values rise: their slowest order gives the highest limit.
    """
    coarse, default, fine = (ste(f"{pair} 0{mesh}") for mesh in (" coarse", "", " fine"))
    if order is None:
        seen = (default - coarse) / (fine - default)
        order = brentq(lambda p: (0.6**-p - 1.0) / (1.0 - 1.5**-p) - seen, 0.1, 6.0)
    return float(fine + (fine - default) / (1.5**order - 1.0))


@pytest.mark.parametrize("pair", PAIRS)
def test_the_nonlinear_analysis_converges(pair):
    coarse, default, fine = (ste(f"{pair} 0{mesh}") for mesh in (" coarse", "", " fine"))
    # Each step is at most two thirds of the one before (seen: 0.49, 0.47, 0.60).
    assert 0 < fine - default < 2 / 3 * (default - coarse)


@pytest.mark.parametrize("pair", PAIRS)
def test_the_superelement_lies_between_the_finest_mesh_and_the_limit(pair):
    # Seen: limits of order 1.07, 1.12, 0.59, which lie 1.7, 1.4 and 2.4 % above the finest mesh.
    assert ste(f"{pair} 0 fine") < ste(f"{pair} 0", "superelement") < limit(pair)


@pytest.mark.parametrize("pair", PAIRS)
def test_the_superelement_is_within_one_per_cent_of_the_limit_of_second_order(pair):
    # Two is the order of these bricks where nothing is singular. Where the truth is known, on the helical pair, it
    # needs 1.4: the limit is open to 1 % itself, and no finer claim can be made of it.
    assert ste(f"{pair} 0", "superelement") == pytest.approx(limit(pair, order=2.0), rel=0.01)


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("pmc", ["0.2", "0.4", "0.6", "0.8"])
def test_the_methods_agree_on_the_curve_within_nine_thousandths(pair, pmc):
    # The default mesh is too stiff by nearly the same part at all positions (seen: within 0.1, 0.5 and 0.75 %, where
    # tooth pairs come into contact most and, in the internal pair at 0, tip edges carry load; of that the superelement
    # has 0.35 % against the truth at 0 and 0.5).
    assert above(f"{pair} {pmc}") == pytest.approx(above(f"{pair} 0"), rel=0.009)


@pytest.mark.parametrize("pair", PAIRS)
def test_wider_sectors_approach_the_closed_ring_and_the_methods_agree_on_that(pair):
    names = [f"{pair} 0", f"{pair} 0 5 teeth", f"{pair} 0 7 teeth"]
    ring = STORED[names[0]]["closed_ring_um"]
    excess = [ste(name, "superelement") / ring - 1 for name in names]
    assert excess[0] > excess[1] > excess[2] > 0
    for name in names[1:]:
        # Rims bend less as sectors widen, and their meshes with them (seen: 0.1 to 0.3 %).
        assert above(name) == pytest.approx(above(names[0]), rel=0.004)


@pytest.mark.parametrize("case", [f"{pair} {pmc}" for pair in PAIRS for pmc in ("0", "0.6")])
def test_geometric_nonlinearity_adds_less_than_two_thousandths(case):
    # CalculiX: +0.07 % for the spur pair at 0.
    assert 0 < ste(case) / ste(f"{case} small strain") - 1 < 0.002


@pytest.mark.parametrize(("name", "bound"), [("spur 0 fine", 0.002), ("helical 0 flank 32", 0.006)])
def test_the_nonlinear_analysis_agrees_with_calculix_on_its_meshes(name, bound):
    # Two contact discretisations on the same bricks: apart by what their flanks' elements leave open.
    stored = CALCULIX[name]
    assert stored["nonlinear"]["ste_um"] == pytest.approx(stored["calculix"]["ste_um"], rel=bound)


def test_stored_cases_are_those_of_the_benchmark(agreement):
    assert set(STORED) == set(agreement.CASES)
    for name, entry in STORED.items():
        assert entry["case"] == agreement.dataclasses.asdict(agreement.CASES[name])


@pytest.mark.validation
@pytest.mark.long
@pytest.mark.parametrize("name", ["spur 0 coarse", "helical 0.4", "internal 0.6"])
def test_the_nonlinear_analysis_still_gives_the_stored_value(agreement, name):
    entry = agreement.compare(agreement.CASES[name])
    # Converged to 1e-8; another version of the meshes or of the sparse solver may differ by rounding.
    assert entry["nonlinear"]["ste_um"] == pytest.approx(ste(name), rel=1e-4)
    assert entry["superelement"]["ste_um"] == pytest.approx(ste(name, "superelement"), rel=1e-3)
