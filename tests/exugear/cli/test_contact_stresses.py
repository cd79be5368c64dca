"""Contact stresses and K_Hbeta: what has one name is one number in all commands and in the report."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.templates.kinds import template
from fe_ste.transmission_error.cycle import harmonics_of
from fe_ste.transmission_error.table import MeshTable

from ..cases.case_mutations import toml_text
from ..cases.command import exugear
from ..cases.spur import COARSE_INPUT

STRENGTH = """
[rating.gears.{gear}]
sigma_H_lim_MPa = 1500.0
sigma_F_lim_MPa = 500.0
curve = "case_hardened"
roughness_Rz_um = 4.8
root_factor = 0.95
"""
RATED = """
[ste]
positions = 12
[rating]
dynamic_factor = 1.1
[lubricant]
viscosity_40_mm2_per_s = 68.0
[loads]
body = "input"
life_years = 1.0
[loads.sources.one_torque]
file = "loads.csv"
"""
TORQUE = 150.0
"""Static torque of the template's input, which is the only load of the life, N m."""


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Summaries of the commands on one gearbox, and the row of its pair in the report."""
    folder = tmp_path_factory.mktemp("stresses")
    case = folder / "gearbox.toml"
    content = tomllib.loads(template("pair"))
    content |= tomllib.loads(RATED + "".join(STRENGTH.format(gear=gear) for gear in ("pinion", "wheel")))
    case.write_text(toml_text(content), encoding="utf-8")
    (folder / "loads.csv").write_text(f"torque_N_m,speed_rpm,hours\n{TORQUE},1500,300\n", encoding="utf-8")
    found: dict[str, Any] = {"folder": folder}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("exugear.system.tooth_mesh.tables.TableInput", COARSE_INPUT)
        for name, options in {
            "ste": ("--out", folder / "out"),
            "check": (),
            "rating": ("--rating",),
            "bearings": ("--out", folder / "out"),
            "life": ("--out", folder / "out"),
        }.items():
            command = "check" if name == "rating" else name
            outcome = exugear(command, case, *options, "--json")
            assert outcome.exit_code == 0, outcome.stderr
            found[name] = json.loads(outcome.stdout)
            found[f"{name} stderr"] = outcome.stderr
        outcome = exugear("report", folder / "out")
        assert outcome.exit_code == 0, outcome.stderr
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    table = page[page.index('<table id="stresses"') :]
    found["report"] = [float(cell.replace("–", "nan")) for cell in re.findall(r">\s*([0-9.]+|–)\s*</td>", table)[:7]]
    return found


@pytest.mark.validation
def test_sigma_H0_is_one_number_in_check_ste_life_rating_and_report(printed: dict[str, Any]) -> None:
    expected = printed["check"]["pairs"][0]["sigma_H0_MPa"]
    assert printed["ste"]["tables"][0]["sigma_H0_MPa"] == pytest.approx(expected, rel=1e-12)
    for flank in printed["life"]["flanks"]:
        assert 1e-6 * flank["nominal_contact"] == pytest.approx(expected, rel=1e-6)
    for flank in printed["rating"]["rating"]["flanks"]:
        assert flank["standard"]["sigma_H0_MPa"] == pytest.approx(expected, rel=1e-6)
    assert printed["report"][0] == pytest.approx(expected, abs=0.5)


@pytest.mark.validation
def test_stress_and_face_load_factor_of_aligned_gears_are_those_of_the_table(printed: dict[str, Any]) -> None:
    table = printed["ste"]["tables"][0]
    assert printed["report"][1] == pytest.approx(table["K_Hbeta_aligned"], abs=0.005)
    assert printed["report"][2] == pytest.approx(table["sigma_H_aligned_MPa"], abs=0.5)
    assert table["sigma_H_aligned_MPa"] > table["sigma_H0_MPa"]


@pytest.mark.validation
def test_stress_and_face_load_factor_of_misaligned_gears_are_those_of_bearings(printed: dict[str, Any]) -> None:
    (mesh,) = printed["bearings"]["meshes"]
    assert printed["report"][3] == pytest.approx(mesh["K_Hbeta"], abs=0.005)
    assert printed["report"][4] == pytest.approx(mesh["sigma_H_misaligned_MPa"], abs=0.5)


@pytest.mark.validation
def test_the_rated_stress_of_the_report_is_that_of_the_rating_sheet_with_its_face_load_factor(
    printed: dict[str, Any],
) -> None:
    rated = max(
        (flank["standard"] for flank in printed["rating"]["rating"]["flanks"]), key=lambda own: own["sigma_H_MPa"]
    )
    assert printed["report"][5] == pytest.approx(rated["K_Hbeta"], abs=0.005)
    assert printed["report"][6] == pytest.approx(rated["sigma_H_MPa"], abs=0.5)


@pytest.mark.validation
def test_the_stress_of_a_life_with_the_static_load_alone_is_that_of_the_table_times_the_root_of_K_v(
    printed: dict[str, Any],
) -> None:
    """The gears of this template are misaligned too little to change it."""
    largest = max(flank["contact_stress"] for flank in printed["life"]["flanks"])
    aligned = printed["ste"]["tables"][0]["sigma_H_aligned_MPa"]
    assert 1e-6 * largest == pytest.approx(1.1**0.5 * aligned, rel=1e-3)


@pytest.mark.validation
def test_ste_prints_harmonics_and_the_error_of_the_peak_to_peak_value(printed: dict[str, Any]) -> None:
    summary = printed["ste"]["tables"][0]
    error = MeshTable.open(Path(summary["table"])).static_state["ste"].to_numpy()
    assert summary["ste_harmonics_um"] == pytest.approx((1e6 * harmonics_of(error, 4)).tolist(), rel=1e-9)
    halves = min(float(np.ptp(error[start::2])) for start in (0, 1))
    assert summary["ste_peak_to_peak_error_um"] == pytest.approx(1e6 * (np.ptp(error) - halves), rel=1e-9)
    warned = "positions of the mesh cycle" in printed["ste stderr"]
    assert warned == (summary["ste_peak_to_peak_error_um"] > 0.1 * summary["ste_peak_to_peak_um"])
