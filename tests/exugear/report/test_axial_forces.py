"""Axial forces of bearings: the same sign in the report's table of a run as at the static load."""

from __future__ import annotations

from pathlib import Path

import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.project import Project
from exugear.report.findings.groups import Channel
from exugear.report.sections.run_data import axial_of_shaft
from exugear.results.run_file import load_run


def test_axial_forces_of_a_run_have_the_sign_of_those_at_the_static_load(tmp_path: Path) -> None:
    """Both are those of the shaft on the inner ring; the run records the force on the shaft."""
    gearbox = Gearbox.from_toml(Path("exugear/gearbox/templates/pair.toml"))
    project = Project(gearbox, tmp_path, Choice("bushing", "iso6336"))
    duties = {duty.name: duty.axial_load for duty in project.bearings()}
    data = load_run(project.run(duration=0.02).path)
    assert max(map(abs, duties.values())) > 100.0
    for name, load in duties.items():
        force = float(data["support_force"].sel(support=name)[:, 2].mean())
        channel = Channel(name, "support", name, 1, 0.0, force, spectra=None)  # type: ignore[arg-type]
        assert axial_of_shaft(gearbox, channel) == pytest.approx(load, rel=0.05, abs=1.0)
