"""Resonances, their modes, and what one run has and the other lacks, on run-ups made of known resonators."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from exugear.model.versions import RUN
from exugear.results.run_file import load_run
from exugear.spectra.comparison import VariantRun, compare, mobility_shares, nearest_mode, read_run, report_mode
from exugear.spectra.waterfall import OrderLine
from fe_ste.tools.sealed import write_dataset

RATE = 8000.0
LINE = OrderLine("mesh", 100.0)
LABELS = {
    "gearbox": "synthetic",
    "load_case": "run_up",
    "mesh_law": "line_of_action",
    "inertias": "gears",
    "highest_order": 100.0,
    "method_version": RUN,
}


def write_run(path: Path, variant: str, resonances: list[float], **labels: str) -> Path:
    """A run of 8 s to 15 rev/s whose order 100 excites resonators of 1 % damping, quasi-statically."""
    time = np.arange(int(8 * RATE)) / RATE
    speed = 2 * np.pi * 15.0 * time / 8.0
    frequency = LINE.frequency(speed)
    phase = 2 * np.pi * np.cumsum(frequency) / RATE
    signal = 1e-7 * np.cos(phase)
    for resonance in resonances:
        answer = 1e-7 / (1 - (frequency / resonance) ** 2 + 0.02j * frequency / resonance)
        signal += (answer * np.exp(1j * phase)).real
    data = {"input_speed": ("time", speed), "overall_dte": ("time", signal)}
    attributes = {**LABELS, "variant": variant, **labels}
    write_dataset(path, xr.Dataset(data, {"time": time}, attributes))
    return path


def modes_dataset(frequencies: list[float], overall: list[float]) -> xr.Dataset:
    count = len(frequencies)
    return xr.Dataset(
        {
            "frequency": ("mode", np.array(frequencies)),
            "damping_ratio": ("mode", np.full(count, 0.01)),
            "overall_dte": ("mode", np.array(overall)),
            "amplification": (("mode", "mesh"), np.tile([1.0, 3.0], (count, 1))),
            "strain_energy_share": (("mode", "element"), np.tile([0.25, 0.75], (count, 1))),
            "kinetic_energy_share": (("mode", "body", "motion"), np.full((count, 2, 4), 0.125)),
            "name": ("mode", np.array([f"mode {n}" for n in range(count)], dtype=object)),
        },
        {"mesh": ["a", "b"], "element": ["a", "bearing"], "body": ["one", "two"]},
    )


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> tuple[VariantRun, VariantRun]:
    """Bushing resonates at 500, 800 and 1150 Hz, rigid at 500 Hz."""
    folder = tmp_path_factory.mktemp("runs")
    # The mode at 802 Hz lies nearer to the resonance, but nothing of it reaches the overall transmission error.
    modes = modes_dataset([0.0, 497.0, 801.0, 806.0, 1150.0], [0.0, 0.3, 0.0, 0.2, 0.2])
    bushing = read_run(write_run(folder / "b.nc", "bushing", [500.0, 800.0, 1150.0]), [LINE], modes)
    window = bushing.spectra.window_length
    return bushing, read_run(write_run(folder / "r.nc", "rigid", [500.0]), [LINE], None, window)


def test_resonances_are_found_where_they_are_and_matched_with_modes_that_can_show(runs):
    bushing, _ = runs
    findings = bushing.findings()
    # The sweep of 187.5 Hz/s allows 14 Hz.
    assert [finding.resonance.frequency for finding in findings] == pytest.approx([500.0, 800.0, 1150.0], abs=14.0)
    assert [finding.mode for finding in findings] == [1, 3, 4]
    assert [finding.mode_name for finding in findings] == ["mode 1", "mode 3", "mode 4"]
    # Speed on the order: 60 f / 100 revolutions per minute.
    assert [finding.speed for finding in findings] == pytest.approx([300.0, 480.0, 690.0], abs=0.6 * 14.0)


def test_what_only_one_run_shows(runs):
    bushing, rigid = runs
    comparison = compare(bushing, rigid)
    only = [finding.resonance.frequency for finding in comparison.only_first]
    assert only == pytest.approx([800.0, 1150.0], abs=14.0)
    assert comparison.only_second == ()
    assert [run.variant for run in comparison.runs] == ["rigid", "bushing"]


def test_without_modes_nothing_is_matched(runs):
    _, rigid = runs
    assert [finding.mode for finding in rigid.findings()] == [None]


@pytest.mark.parametrize("key", ["load_case", "mesh_law", "inertias", "gearbox"])
def test_runs_of_different_models_are_not_compared(runs, tmp_path, key):
    bushing, _ = runs
    other = read_run(write_run(tmp_path / "r.nc", "rigid", [500.0], **{key: "other"}), [LINE])
    with pytest.raises(ValueError, match=key):
        compare(bushing, other)


def test_runs_with_different_windows_are_not_compared(runs):
    bushing, rigid = runs
    with pytest.raises(ValueError, match="window"):
        compare(bushing, read_run(rigid.path, [LINE], None, 2 * rigid.spectra.window_length))


def test_a_run_of_constant_speed_or_hardly_any_length_says_so(tmp_path):
    path = write_run(tmp_path / "run.nc", "rigid", [500.0])
    data = load_run(path)
    write_dataset(tmp_path / "short.nc", data.isel(time=slice(0, 1)))
    steady = data.assign(input_speed=("time", np.full(data.sizes["time"], 3.0)))
    write_dataset(tmp_path / "steady.nc", steady)
    with pytest.raises(ValueError, match="too few"):
        read_run(tmp_path / "short.nc", [LINE])
    with pytest.raises(ValueError, match="sweep rate"):
        read_run(tmp_path / "steady.nc", [LINE])


def test_shares_of_mobility_add_up_to_one():
    shares = mobility_shares(modes_dataset([0.0, 1.0, 2.0], [0.0, 3.0, 4.0]))
    assert shares == pytest.approx([0.0, 0.36, 0.64], rel=1e-15)
    assert not mobility_shares(modes_dataset([0.0], [0.0])).any()


def test_the_nearest_mode_is_elastic_and_has_the_share_asked_for():
    modes = modes_dataset([0.0, 90.0, 104.0], [0.0, 0.5, 1e-3])
    near, seen = nearest_mode(modes, 100.0), nearest_mode(modes, 100.0, least_share=0.01)
    assert near is not None
    assert seen is not None
    assert (near.place, seen.place) == (2, 1)
    assert near.is_near(100.0)
    assert not seen.is_near(100.0)
    assert nearest_mode(modes_dataset([0.0], [0.0]), 100.0) is None


def test_a_mode_in_figures_names_the_mesh_that_excites_it_most():
    mode = report_mode(modes_dataset([0.0, 90.0], [0.0, 0.5]), 1)
    assert (mode.mesh, mode.amplification) == ("b", 3.0)
    assert mode.strain == {"a": 0.25, "bearing": 0.75}
    assert mode.kinetic == {"one": 0.5, "two": 0.5}
