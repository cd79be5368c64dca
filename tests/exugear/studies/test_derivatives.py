"""Local derivatives of outputs against those that are known."""

from __future__ import annotations

import pytest

from exugear.studies.dataset import slopes
from exugear.studies.executors import processes
from exugear.studies.runner import run_study

from ..cases.study import small_study


def derivatives(folder, **settings):
    parameters = {
        "time": {"path": "damping.mesh_time_s", "acts": "scales", "step": 0.01},
        "inertia": {
            "paths": [f"bodies.shaft_{n}.inertia.disc.axial_kg_m2" for n in (1, 2)],
            "acts": "scales",
            "step": 0.01,
        },
        "torque": {"path": "static_load.torques_N_m.shaft_1", "step": 1.0},
    }
    outputs = {
        "frequency": {"quantity": "nearest_frequency", "near_Hz": 3000.0},
        "damping": {"quantity": "nearest_damping", "near_Hz": 3000.0},
        "forces": {"quantity": "mesh_forces"},
        "sum": {"quantity": "load_sharing", "meshes": "spur"},
    }
    choice = {"variant": "rigid", "mesh_model": "iso6336"}
    study = small_study(folder, parameters=parameters, outputs=outputs, choice=choice, **settings)
    return run_study(study, folder / "out", processes(1)).dataset


def test_the_mode_of_two_discs_moves_as_its_formula_says(tmp_path):
    """One elastic mode: frequency as inertia to the power -1/2, damping in proportion to time and frequency.

    The stiffness by ISO 6336 is constant at this load, so that the torque moves neither. Central differences over two
    steps of 1 % err by the third derivative: 1e-4 of the slope.
    """
    data = derivatives(tmp_path)
    mean = data.mean("side")
    slope = data["slope_frequency"] / mean["frequency"]
    assert float(slope.sel(parameter="inertia")) == pytest.approx(-0.5, rel=2e-4)
    assert float(slope.sel(parameter="time")) == pytest.approx(0.0, abs=1e-9)
    damping = data["slope_damping"] / mean["damping"]
    assert float(damping.sel(parameter="time")) == pytest.approx(1.0, rel=1e-9)
    assert float(damping.sel(parameter="inertia")) == pytest.approx(-0.5, rel=2e-4)


def test_a_mesh_carries_torque_over_base_radius(tmp_path):
    """Base radius of the pinion: 30 mm cos 20 degrees."""
    data = derivatives(tmp_path)
    slope = data["slope_forces"].sel(parameter="torque", mesh="spur")
    assert float(slope) == pytest.approx(1.0 / (30e-3 * 0.9396926), rel=1e-6)


def test_slopes_are_ranked_by_what_a_step_changes(tmp_path):
    changes = {(output, parameter): change for output, parameter, change in slopes(derivatives(tmp_path))}
    assert changes["frequency", "inertia"] == pytest.approx(-0.005, rel=2e-4)
    assert changes["damping", "time"] == pytest.approx(0.01, rel=1e-9)
    assert changes["sum", "time"] == 0.0
