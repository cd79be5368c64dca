"""Measured run-ups in the report: those of the gearbox file are shown, stale ones are named."""

from __future__ import annotations

from pathlib import Path

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.project import Project
from exugear.report.writer import write_report

from ..steady.evaluation import synthetic


@pytest.mark.validation
def test_a_report_shows_a_comparison_of_its_gearbox_and_names_a_stale_one(tmp_path: Path) -> None:
    """Verdict, a chart for each channel, and peaks; not after a change of the damping or of the section."""
    _, speed, angle = (own[:120_000] for own in synthetic.run_up())
    response = synthetic.response(Gearbox.from_dict(synthetic.content()))
    synthetic.recorded(tmp_path / "bench.h5", synthetic.signals(response, speed, angle, 0.05), angle)
    path = synthetic.gearbox_file(tmp_path, synthetic.measurement())
    project = Project.from_toml(path, tmp_path / "results", synthetic.CHOICE)
    comparison = project.measured()
    project.modes()
    report = write_report(project.folder)
    page = report.path.read_text(encoding="utf-8")
    assert "Measured run-up bench" in page
    assert f"<p>{comparison.verdict}.</p>" in page
    assert f"Measured run-up {comparison.verdict}" in report.statements
    for channel in synthetic.CHANNELS:
        assert f"measured-bench-bushing-line_of_action-discs-{channel}" in page
    assert f"{comparison.peaks[0].measured_speed * 30.0 / 3.141592653589793:.1f}" in page
    assert not any("measured" in line for line in report.left_out)
    for change in ({"damping.modal_percent": 1.7}, {"measurements.bench.harmonics": 2}):
        Project(project.gearbox.varied(change), project.folder, project.choice).modes()
        again = write_report(project.folder)
        assert any("measured-bench.nc: was computed from another input" in line for line in again.left_out)
        assert "Measured run-up bench" not in again.path.read_text(encoding="utf-8")
