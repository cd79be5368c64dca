"""The superelement on open sectors agrees with CalculiX on the same meshes, to what these meshes allow.

CalculiX touches with the chords of its flank meshes, which closes convex flanks late and concave ones early, and its
incompatible brick is too stiff: 75.8 um on its finest mesh where the truth is 77.3 (helical 0). So nothing below 2 %
follows from agreement; what is tested is that nothing gross is wrong and that the chords' error falls.

The results of CalculiX are stored with their version, meshes and settings in benchmarks/calculix/results.json, whose
README tells how they came about and what parts the two.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from ..cases.benchmarks import benchmark_module

FOLDER = Path(__file__).parents[3] / "benchmarks" / "calculix"
STORED: dict[str, dict[str, Any]] = json.loads((FOLDER / "results.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def cross_check() -> ModuleType:
    return benchmark_module("calculix", "cross_check")


#: What the meshes of CalculiX leave open.
OPEN = 0.02


@pytest.mark.sample
@pytest.mark.parametrize("name", ["spur 0 coarse", "spur 0.5 coarse", "spur 0 fine", "spur 0.5 fine"])
def test_superelement_is_within_two_per_cent_of_calculix_and_as_stored(cross_check: ModuleType, name: str):
    ours = cross_check.superelement(cross_check.CASES[name])["ste_um"]
    assert ours == pytest.approx(STORED[name]["calculix"]["ste_um"], rel=OPEN)
    assert ours == pytest.approx(STORED[name]["superelement"]["ste_um"], rel=1e-5)


@pytest.mark.parametrize(("pair", "counts"), [("helical 0", (16, 24, 32)), ("internal 0", (16, 32))])
def test_calculix_comes_nearer_as_its_flanks_are_refined(pair: str, counts: tuple[int, ...]):
    apart = [abs(STORED[f"{pair} flank {count}"]["difference_percent"]) for count in counts]
    assert apart == sorted(apart, reverse=True)
    assert apart[-1] < 100.0 * OPEN


@pytest.mark.parametrize("pair", ["helical 0", "internal 0"])
def test_calculix_extrapolated_to_fine_flanks_is_too_stiff_by_its_brick(pair: str):
    coarse, fine = (STORED[f"{pair} flank {count}"]["calculix"]["ste_um"] for count in (16, 32))
    # The depth of the chords falls with the square of the elements' size; the rest is the brick's (seen: 0.8, 0.9 %).
    extrapolated = fine + (fine - coarse) / 3
    assert extrapolated < STORED[f"{pair} flank 32"]["superelement"]["ste_um"] < (1.0 + OPEN) * extrapolated


def test_whole_gears_are_those_of_calculix_with_all_teeth_meshed():
    # The same bricks; the non-linear analysis has all teeth condensed but three (seen: +0.08 %).
    stored = STORED["deep 0 whole gears"]
    assert stored["nonlinear"]["ste_um"] == pytest.approx(stored["calculix"]["ste_um"], rel=0.005)
    assert stored["superelement"]["ste_um"] == pytest.approx(stored["calculix"]["ste_um"], rel=0.005)


def test_large_displacements_do_not_matter():
    linear, large = (
        STORED[name]["calculix"]["ste_um"] for name in ("spur 0 coarse", "spur 0 coarse, large displacements")
    )
    # Rotations are of the order of 1e-4 rad, strains 1e-3.
    assert large == pytest.approx(linear, rel=2e-3)


def test_stored_cases_are_those_of_the_benchmark(cross_check: ModuleType):
    for name, entry in STORED.items():
        assert entry["case"] == json.loads(json.dumps(cross_check.dataclasses.asdict(cross_check.CASES[name])))


@pytest.mark.validation
@pytest.mark.long
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
def test_calculix_still_gives_the_stored_value(cross_check: ModuleType, tmp_path: Path):
    name = "spur 0.5 coarse"
    stored = STORED[name]["calculix"]["ste_um"]
    again = cross_check.calculix(cross_check.CASES[name], 1e-6 * stored, tmp_path)
    # Another version may iterate otherwise; the stored value is converged to much better than this.
    assert again["ste_um"] == pytest.approx(stored, rel=1e-3)
