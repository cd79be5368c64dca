"""The section of the report on lives: what fits the case is shown, what does not is left out and told."""

from __future__ import annotations

import tomllib

import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.project import Project
from exugear.report.writer import write_report

from ..cases.spur import COARSE_INPUT, SPUR_CASE
from ..life.test_life import STRENGTH

LOADS = {"body": "shaft_1", "life_years": 10.0, "sources": {"s": {"file": "loads.csv", "hours_per_year": 1000.0}}}


@pytest.fixture
def project(tmp_path, monkeypatch) -> Project:
    monkeypatch.setattr("exugear.system.tooth_mesh.tables.TableInput", COARSE_INPUT)
    (tmp_path / "loads.csv").write_text("torque_N_m,speed_rpm,hours\n100,1500,3\n200,1000,1\n")
    content = tomllib.loads(SPUR_CASE)
    rating = {"dynamic_factor": 1.0, "viscosity_40_mm2_per_s": 320.0, "gears": {"pinion": STRENGTH}}
    gearbox = Gearbox.from_dict(content | {"loads": LOADS, "rating": rating}, str(tmp_path / "gearbox.toml"))
    return Project(gearbox, tmp_path / "out", Choice("bushing", "line_of_action"))


@pytest.mark.validation
def test_a_report_knows_a_life_whose_stresses_come_from_tables_of_its_own(project):
    """Gears that stand askew on their bearings."""
    askew = project.gearbox.varied({"bearings.bearing_1.z_mm": 20.0})
    skewed = Project(askew, project.folder, project.choice)
    counted = skewed.checked_loads()
    assert [len(request.wanted.misalignment) > 1 for request in skewed.stress_tables(counted)] == [True]
    skewed.life(counted=counted)
    report = write_report(skewed.folder)
    assert not [line for line in report.left_out if "life.nc" in line]
    assert '<div class="life"' in report.path.read_text(encoding="utf-8")


@pytest.mark.validation
def test_a_report_tells_what_limits_the_life_and_leaves_out_what_does_not_fit(project):
    project.life()
    report = write_report(project.folder)
    page = report.path.read_text(encoding="utf-8")
    section = page[page.index('<div class="life"') :]
    assert "pinion + spur" in section and "S_H" in section and "data:image/png;base64," in section
    assert "% of the load is outside the path of contact" in section and "K_Hbeta" in section
    assert "bearing 1: defined by its stiffness only; add a" in section
    assert any("largest fatigue damage in" in line and "pinion + spur" in line for line in report.statements)
    other = project.gearbox.varied({"rating.dynamic_factor": 1.3})
    Project(other, project.folder, project.choice).keep_case()
    again = write_report(project.folder)
    assert any("life.nc: was computed from another input" in line for line in again.left_out)
    assert '<div class="life"' not in again.path.read_text(encoding="utf-8")
