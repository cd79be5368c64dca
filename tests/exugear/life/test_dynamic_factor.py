"""K_v from the forces of a run: a known swing, a drift that is none, and runs that do not fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.units import RPM
from exugear.life.dynamic_factors import DynamicFactor, factors, family_factors, response_path, window_factors
from exugear.life.life import rating_of
from exugear.project import Project
from exugear.steady.mean_system.planet_sets import PlanetSet
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import stored_or_computed
from exugear.system.build import assemble
from exugear.system.system import Assembly
from exugear.transient.runup import simulate

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
    assert factor.largest(0.0, 100.0) == 1.3


def test_a_run_gives_factors_over_speed_and_must_fit(tmp_path):
    """The spur pair with constant stiffness runs up smoothly: factors near one, but for its start."""
    content = content_of(TABLE, tmp_path)
    content["rating"] = {
        "dynamic_factor_run": "run_up",
        "minimum_dynamic_factor": 1.02,
        "viscosity_40_mm2_per_s": 320.0,
    }
    gearbox = Gearbox.from_dict(content, str(tmp_path / "gearbox.toml"))
    project = Project(gearbox, tmp_path, Choice("rigid", "iso6336", load_case="run_up"))
    rating, assembly = rating_of(gearbox), project.assembly()
    with pytest.raises(GearboxFileError, match=r"dynamic_factor_run = 'run_up'.*no such file.*exugear run"):
        factors(assembly, rating, tmp_path, "shaft_1")
    project.run(duration=0.5)
    (found,) = factors(assembly, rating, tmp_path, "shaft_1").values()
    assert found.at(np.array([500.0])) == pytest.approx([1.02], abs=0.02)
    other = Project(gearbox.varied({"damping.mesh_time_s": 5e-6}), tmp_path, project.choice)
    with pytest.raises(GearboxFileError, match="belongs to another input"):
        factors(other.assembly(), rating, tmp_path, "shaft_1")


CONSTANT_SPEED = {
    "torques_N_m": {"shaft_1": 100.0},
    "driven_body": "shaft_2",
    "drive_stiffness_N_m_per_rad": 100.0,
    "duration_s": 1.2,
}
"""The soft drive leaves the gears as free as the response has them."""
RATING = {"minimum_dynamic_factor": 1.0, "viscosity_40_mm2_per_s": 320.0}


def varying_spur(folder: Path, rating: dict[str, object], speed: float) -> tuple[Gearbox, Assembly]:
    """Spur pair on bearings whose stiffness varies by some percent over the mesh cycle, at constant speed (rpm)."""
    content = content_of(TABLE, folder)
    content["rating"] = RATING | rating
    content["load_cases"]["run_up"] = CONSTANT_SPEED | {"start_speed_rpm": speed, "end_speed_rpm": -speed / 1.5}
    gearbox = Gearbox.from_dict(content, str(folder / "gearbox.toml"))
    return gearbox, assemble(gearbox, CHOICE, STIFFNESS)


CHOICE = Choice("bushing", "line_of_action", "disc", "run_up")
CYCLE = 2.0 * np.pi * np.arange(50) / 50
STIFFNESS = {"spur": 3e8 * (1.0 + 0.08 * np.cos(CYCLE) + 0.03 * np.sin(2 * CYCLE))}


@pytest.mark.sample
@pytest.mark.parametrize("speed", [2000.0, 3200.0])
def test_a_run_at_constant_speed_and_the_steady_response_there_give_one_factor(tmp_path, speed):
    """Largest over mean force of a settled run and of the lines put together again, within 0.3 %."""
    gearbox, assembly = varying_spur(tmp_path, {"dynamic_factor_run": "run_up"}, speed)
    run = simulate(gearbox, CHOICE, STIFFNESS, tmp_path)
    (of_run,) = factors(assembly, rating_of(gearbox), tmp_path, "shaft_1").values()
    steady, assembly = varying_spur(tmp_path, {"dynamic_factor_steady": "nonlinear"}, speed)
    rating = rating_of(steady)
    with pytest.raises(GearboxFileError, match=r"dynamic_factor_steady = 'nonlinear'.*no such file.*exugear steady"):
        factors(assembly, rating, tmp_path, "shaft_1")
    settings = SteadySettings(SpeedRange(0.9 * speed * RPM, 1.1 * speed * RPM, 3), "nonlinear", at_resonances=False)
    stored_or_computed(response_path(tmp_path, assembly, rating), assembly, settings)
    (of_response,) = factors(assembly, rating, tmp_path, "shaft_1").values()
    middle = of_response.value[1]
    settled = of_run.value[-len(of_run.value) // 4 :]  # the run begins with what its start excites
    assert run.complete
    assert middle > 1.02
    assert settled == pytest.approx(middle, rel=3e-3)
    span = f"from {0.9 * speed:.4g} to {1.1 * speed:.4g} rpm"
    assert of_response.source == f"the steady-state response (nonlinear) at 3 speeds of shaft_1 {span}"
    assert of_run.source.startswith("the run run_up over ")
    other = assemble(steady.varied({"damping.mesh_time_s": 5e-6}), CHOICE, STIFFNESS)
    with pytest.raises(GearboxFileError, match="belongs to another input"):
        factors(other, rating, tmp_path, "shaft_1")


def test_planets_pass_the_waves_of_a_response(tmp_path):
    """Mean, cosine and sine waves of three planets: uneven sharing is no dynamics, and is left out."""
    order, count = 990.0, 3
    planets = PlanetSet(("a", "b", "c"), "carrier", 2.0 * np.pi * np.arange(count) / count, 1.0)
    # A mean of 1 with 5 % at the mesh frequency, and waves that make one planet carry 10 % more: no dynamics.
    amplitude = np.array([[[1.0, 0.1, 0.0], [0.05, 0.0, 0.0]]])
    names = ["mesh_force sun", "mesh_force sun cosine", "mesh_force sun sine"]
    data = xr.Dataset(
        {
            "amplitude": (("point", "line", "signal"), amplitude),
            "phase": (("point", "line", "signal"), np.zeros_like(amplitude)),
            "order": (("line",), np.array([0.0, order])),
        },
        {"signal": np.array(names, dtype=object)},
    )
    (found,) = family_factors(data, "sun", "sun_1", planets, order)
    # Relative to the least loaded planet; its load drifts by less than 0.007 within a window.
    assert found == pytest.approx(1.0 + 0.05 / 0.9, abs=0.007)
