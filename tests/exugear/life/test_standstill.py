"""Hours at standstill in a load spectrum: nothing turns in them, so that nothing is worn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.life.load_spectrum.counting import load_duration, load_points
from exugear.project import Project

from ..cases.gear_trains import two_stage

TORQUE, SPEED, HOURS = np.array([100.0, 40.0]), np.array([50.0, 80.0]), np.array([10.0, 20.0])


@pytest.mark.parametrize("hub", [0.0, 1.0])
def test_hours_at_standstill_leave_the_speed_of_a_load(hub: float) -> None:
    torque, speed = np.append(TORQUE, 100.0), np.append(SPEED, 0.0)
    found = load_duration(torque, speed, np.append(HOURS, 30.0), 10)
    points = load_points(found, "mean", torque, speed, np.append(HOURS, 30.0), np.full((3, 1), hub), 4)
    assert points.speed == pytest.approx([80.0, 50.0], rel=1e-12)
    assert points.hours == pytest.approx([20.0, 40.0], rel=1e-12)
    assert 2.0 * np.pi * found.revolutions == pytest.approx(3600.0 * found.hours * found.speed, rel=1e-12)


def test_revolutions_weight_the_speeds_of_a_load() -> None:
    """An hour at 10 rad/s and one at 30: three quarters of the revolutions are fast."""
    found = load_duration(np.full(2, 100.0), np.array([10.0, -30.0]), np.ones(2), 1)
    assert found.running_speed == pytest.approx([25.0], rel=1e-12)


def test_hours_at_standstill_leave_all_damages_of_bearings(tmp_path: Path) -> None:
    """Film thickness, and with it L10m, had been that of the mean speed of all hours."""

    def life(name: str, **points: list[float]) -> xr.Dataset:
        content: dict[str, Any] = two_stage()
        content["loads"] = {"body": "input", "life_years": 10.0, "sources": {"duty": points}}
        content["rating"] = {"dynamic_factor": 1.0}
        content["lubricant"] = {
            "viscosity_40_mm2_per_s": 220.0,
            "viscosity_100_mm2_per_s": 19.0,
            "temperature_C": 70.0,
            "cleanliness": "normal",
        }
        return Project(Gearbox.from_dict(content), tmp_path / name, Choice("bushing")).life()

    turning = life("turning", torque_N_m=[30.0, 20.0], speed_rpm=[300.0, 900.0], hours=[100.0, 200.0])
    resting = life("resting", torque_N_m=[30.0, 20.0, 30.0], speed_rpm=[300.0, 900.0, 0.0], hours=[100.0, 200.0, 300.0])
    for damage in ("bearing_damage", "bearing_reference_damage", "bearing_modified_damage"):
        assert resting[damage].to_numpy() == pytest.approx(turning[damage].to_numpy(), rel=1e-9)
