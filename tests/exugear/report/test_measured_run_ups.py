"""Measured run-ups in the report: those of the gearbox file are shown, stale ones are named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
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
    recording = tmp_path / "bench.h5"
    content = recording.read_bytes()
    recording.write_bytes(content + b"\0")
    other = write_report(project.folder)
    assert any("its recording bench.h5 was replaced; run exugear measured again" in line for line in other.left_out)
    assert "Measured run-up bench" not in other.path.read_text(encoding="utf-8")
    recording.unlink()
    assert "Measured run-up bench" in write_report(project.folder).path.read_text(encoding="utf-8")
    recording.write_bytes(content)
    for change in ({"damping.modal_percent": 1.7}, {"measurements.bench.harmonics": 2}):
        Project(project.gearbox.varied(change), project.folder, project.choice).modes()
        again = write_report(project.folder)
        assert any("measured-bench.nc: was computed from another input" in line for line in again.left_out)
        assert "Measured run-up bench" not in again.path.read_text(encoding="utf-8")


@pytest.mark.validation
@pytest.mark.parametrize(
    ("load_case", "below"), [(None, "at-measured-bench"), ("run_up", "at-run_up/at-measured-bench")]
)
def test_a_comparison_at_another_load_is_named_and_has_a_report_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, load_case: str | None, below: str
) -> None:
    """With a channel of the torque, and with a load case as well: the folder is that of the load, the report names it.

    The command that the report names shows the comparison.
    """
    monkeypatch.chdir(tmp_path)
    _, speed, angle = (own[:90_000] for own in synthetic.run_up())
    response = synthetic.response(Gearbox.from_dict(synthetic.content()))
    torque = np.full(angle.size, 1.2 * Gearbox.from_dict(synthetic.content()).train.static_torques["input"])
    signals = {**synthetic.signals(response, speed, angle, 0.05), "torque": torque}
    synthetic.recorded(tmp_path / "bench.h5", signals, angle)
    channels = {**synthetic.CHANNELS, "torque": {"quantity": "torque", "body": "input", "unit": "N m"}}
    path = synthetic.gearbox_file(tmp_path, synthetic.measurement(channels=channels, load_case=load_case))
    project = Project.from_toml(path, tmp_path / "results", synthetic.CHOICE)
    project.measured()
    project.modes()
    folder = project.folder / below
    assert [own.name for own in folder.glob("*/*/measured-bench.nc")] == ["measured-bench.nc"]
    report = write_report(project.folder)
    (line,) = [own for own in report.left_out if "measured-bench.nc" in own]
    assert f"{below}/bushing/line_of_action-discs/measured-bench.nc: is at another load" in line
    assert f"exugear report results/{below} shows it" in line
    assert "Measured run-up bench" not in report.path.read_text(encoding="utf-8")
    assert "Measured run-up bench" in write_report(folder).path.read_text(encoding="utf-8")
