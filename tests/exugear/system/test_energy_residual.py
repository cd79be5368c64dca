"""Energy that a run's account leaves over, as a share of the largest energy in the run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.results.run_file import load_run
from exugear.system.signals import BALANCE_TERMS, energy_residual
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.transient.runup import simulate

from ..cases.gear_trains import pair


def account(**terms: tuple[float, ...]) -> dict[str, np.ndarray]:
    """Account of a run with some terms and zeros for the others."""
    count = len(next(iter(terms.values())))
    return {term: np.array(terms.get(term, (0.0,) * count)) for term in BALANCE_TERMS}


def test_a_run_up_is_measured_by_the_work_of_its_loads() -> None:
    assert energy_residual(account(kinetic_energy=(0.0, 100.0), work_of_loads=(0.0, 101.0))) == pytest.approx(1 / 101)


def test_a_run_at_constant_speed_is_measured_by_its_kinetic_energy() -> None:
    """A millijoule left over beside a kilojoule is round-off, whatever the tiny change is."""
    found = account(kinetic_energy=(1000.0, 1000.0 + 1e-6), work_of_loads=(0.0, 1e-3))
    assert energy_residual(found) == pytest.approx(1e-6, rel=0.01)


def test_a_loaded_gearbox_at_standstill_is_measured_by_the_energy_of_its_springs() -> None:
    """The kinetic energy of round-off had been the measure: the balance was said to be closed to 1e15 %."""
    found = account(kinetic_energy=(0.0, 1e-18), elastic_energy=(0.1, 0.1), work_of_loads=(0.0, 1e-9))
    assert energy_residual(found) == pytest.approx(1e-8, rel=1e-6)


def test_the_largest_energy_left_over_in_a_run_counts() -> None:
    found = account(kinetic_energy=(1.0, 2.0, 1.0), work_of_loads=(0.0, 1.5, 0.0))
    assert energy_residual(found) == pytest.approx(0.25)


def test_a_gearbox_at_rest_without_load_leaves_nothing_over() -> None:
    assert energy_residual(account(kinetic_energy=(0.0, 0.0))) == 0.0


def test_a_run_that_begins_and_stays_at_standstill_closes_its_balance(tmp_path: Path) -> None:
    content = pair()
    content["load_cases"]["steady"]["start_speed_rpm"] = 0.0
    gearbox = Gearbox.from_dict(content)
    run = simulate(gearbox, Choice("bushing"), mesh_stiffness(gearbox, "line_of_action", tmp_path), tmp_path)
    assert energy_residual(load_run(run.path)) < 1e-6
