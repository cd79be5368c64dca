"""K_v from the forces of a run: a known swing, a drift that is none, and runs that do not fit."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.life.dynamic_factor import DynamicFactor, factors, window_factors
from exugear.life.life import rating_of
from exugear.model.choice import Choice
from exugear.model.gearbox import Gearbox
from exugear.model.reading import CaseError
from exugear.project import Project

from .test_life import TABLE, content_of


def test_a_swing_at_the_mesh_frequency_is_found_and_a_slow_drift_is_not():
    """Swing of 8 % at 200 Hz over a load that drifts by 20 % within a second: 1.08, and what drifts in 0.1 s."""
    time = np.arange(0.0, 4.0, 1e-4)
    force = (1.0 + 0.1 * np.sin(2.0 * np.pi * 1.0 * time)) * (1.0 + 0.08 * np.sin(2.0 * np.pi * 200.0 * time))
    middles, values = window_factors(time, np.full(len(time), 200.0), force)
    assert np.all(np.diff(middles) == pytest.approx(0.1, abs=2e-4))
    assert np.all((values > 1.079) & (values < 1.08 * 1.035))


def test_windows_that_samples_do_not_resolve_are_left_out():
    time = np.arange(0.0, 1.0, 1e-3)
    assert window_factors(time, np.full(len(time), 400.0), np.ones(len(time))) is None
    assert window_factors(time, np.full(len(time), 5.0), np.ones(len(time))) is None


def test_the_largest_near_a_speed_counts_and_never_less_than_the_least():
    factor = DynamicFactor(np.array([10.0, 10.3, 20.0]), np.array([1.1, 1.3, 1.01]), least=1.05)
    assert factor.at(np.array([10.0, -20.0, 50.0])) == pytest.approx([1.3, 1.05, 1.05])
    assert factor.largest == 1.3


def test_a_run_gives_factors_over_speed_and_must_fit(tmp_path):
    """The spur pair with constant stiffness runs up smoothly: factors near one, but for its start."""
    content = content_of(TABLE, tmp_path)
    content["rating"] = {
        "dynamic_factor_run": "run_up",
        "least_dynamic_factor": 1.02,
        "viscosity_40_mm2_per_s": 320.0,
    }
    gearbox = Gearbox.from_dict(content, str(tmp_path / "gearbox.toml"))
    project = Project(gearbox, tmp_path, Choice("rigid", "iso6336", load_case="run_up"))
    rating, assembly = rating_of(gearbox), project.assembly()
    with pytest.raises(CaseError, match=r"dynamic_factor_run = 'run_up'.*no such file.*exugear run"):
        factors(assembly, rating, project.run_path, "shaft_1")
    project.run(duration=0.5)
    (found,) = factors(assembly, rating, project.run_path, "shaft_1").values()
    assert found.at(np.array([500.0])) == pytest.approx([1.02], abs=0.02)
    other = Project(gearbox.varied({"damping.mesh_time_s": 5e-6}), tmp_path, project.choice)
    with pytest.raises(CaseError, match="belongs to another input"):
        factors(other.assembly(), rating, project.run_path, "shaft_1")
