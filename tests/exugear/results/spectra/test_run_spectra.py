"""Resonances of stored run-ups made of known resonators, and the modes that they belong to."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.results.run_file import load_run
from fe_ste.tools.stores import write_dataset

from .run_ups import STORED_LINE, read_run, write_run


def test_resonances_are_found_where_they_are_and_matched_with_modes_that_can_show(runs):
    bushing, _ = runs
    findings = bushing.findings()
    # The sweep of 187.5 Hz/s allows 14 Hz.
    assert [finding.resonance.frequency for finding in findings] == pytest.approx([500.0, 800.0, 1150.0], abs=14.0)
    assert [finding.mode for finding in findings] == [1, 3, 4]
    assert [finding.mode_name for finding in findings] == ["mode 1", "mode 3", "mode 4"]
    # Speed on the order: 60 f / 100 revolutions per minute.
    assert [finding.speed for finding in findings] == pytest.approx([300.0, 480.0, 690.0], abs=0.6 * 14.0)


def test_without_modes_nothing_is_matched(runs):
    _, rigid = runs
    assert [finding.mode for finding in rigid.findings()] == [None]


def test_a_run_of_constant_speed_or_hardly_any_length_says_so(tmp_path):
    path = write_run(tmp_path / "run.nc", "rigid", [500.0])
    data = load_run(path)
    write_dataset(tmp_path / "short.nc", data.isel(time=slice(0, 1)))
    steady = data.assign(input_speed=("time", np.full(data.sizes["time"], 3.0)))
    write_dataset(tmp_path / "steady.nc", steady)
    with pytest.raises(ValueError, match="too few"):
        read_run(tmp_path / "short.nc", [STORED_LINE])
    with pytest.raises(ValueError, match="sweep rate"):
        read_run(tmp_path / "steady.nc", [STORED_LINE])
