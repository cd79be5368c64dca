"""Energy that a run's account leaves over is measured by what changes, or by what is there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from exugear.system.signals import BALANCE_TERMS, energy_residual


def account(kinetic: tuple[float, float], work: float) -> dict[str, np.ndarray]:
    return {
        **{term: np.zeros(2) for term in BALANCE_TERMS},
        "kinetic_energy": np.array(kinetic),
        "work_of_loads": np.array([0.0, work]),
    }


def test_a_run_up_is_measured_by_its_change_of_kinetic_energy() -> None:
    assert energy_residual(account((0.0, 100.0), 101.0)) == pytest.approx(0.01)


def test_a_run_at_constant_speed_is_measured_by_its_kinetic_energy() -> None:
    """A millijoule left over beside a kilojoule is round-off, whatever the tiny change is."""
    assert energy_residual(account((1000.0, 1000.0 + 1e-6), 1e-3)) == pytest.approx(1e-6, rel=0.01)


def test_a_gearbox_at_rest_has_no_measure() -> None:
    assert math.isnan(energy_residual(account((0.0, 0.0), 1.0)))
