"""Peaks of a run-up at whose speeds teeth lose contact: their speeds are jumps, and neither compared nor fitted."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM
from exugear.steady.evaluation.comparison import resonance_shift
from exugear.steady.evaluation.measured_comparison import MeasuredComparison, compare_run_up
from exugear.steady.evaluation.run_up import read_run_up
from exugear.steady.steady_file import complex_amplitudes

from ...cases.case_mutations import toml_text
from . import synthetic


@pytest.fixture(scope="module")
def swings(tmp_path_factory: pytest.TempPathFactory) -> tuple[MeasuredComparison, np.ndarray, np.ndarray]:
    """A comparison; speeds of the response, and at each the sum of the orders of a mesh force over its mean.

    Below one no force changes its sign; of all meshes it is the largest. Meshes are thirty times softer than of steel
    gears, so that their modes are within the run-up.
    """
    folder = tmp_path_factory.mktemp("jumps")
    content = {**synthetic.content(), "measurements": {"bench": synthetic.measurement()}}
    for pair, mean in (("stage_1", 1.5e7), ("stage_2", 2.7e7)):
        cosine = [0.2 * mean, 0.06 * mean, 0.02 * mean]
        content["pairs"][pair]["stiffness"] = {"mean_N_per_m": mean, "cosine_N_per_m": cosine}
    (folder / "gearbox.toml").write_text(toml_text(content), encoding="utf-8")
    gearbox = Gearbox.from_toml(folder / "gearbox.toml")
    response = synthetic.response(gearbox)
    _, speed, angle = synthetic.run_up()
    synthetic.recorded(folder / "bench.h5", synthetic.signals(response, speed, angle), angle)
    names = [str(name) for name in response["signal"].to_numpy()]
    forces = np.abs(
        complex_amplitudes(response)[..., [n for n, own in enumerate(names) if own.startswith("mesh_force")]]
    )
    share = (forces[:, 1:].sum(axis=1) / forces[:, 0]).max(axis=1)
    return compare_run_up(gearbox, read_run_up(gearbox), response), response["speed"].to_numpy(), share


def test_peaks_are_jumps_only_where_a_mesh_force_may_change_its_sign(
    swings: tuple[MeasuredComparison, np.ndarray, np.ndarray],
) -> None:
    """Contact is lost only where the orders of a mesh force add up to its mean, and everywhere far above that."""
    comparison, speed, share = swings
    order = np.argsort(np.abs(speed))
    own = np.interp(comparison.cuts.speed, np.abs(speed)[order], share[order])
    lost = comparison.cuts.contact_loss
    assert 0.02 < lost.mean() < 0.6
    # A window between two speeds of the response counts if contact is lost at either.
    assert own[lost].min() > 0.9 and own[~lost].max() < 2.5
    jumps = [peak for peak in comparison.peaks if peak.contact_loss]
    assert 0 < len(jumps) < len(comparison.peaks)
    for peak in jumps:
        near = np.abs(np.abs(speed) / (peak.computed_speed if peak.paired else peak.measured_speed) - 1.0) < 0.02
        assert share[near].max() > 1.0
    assert [finding for finding in comparison.findings if finding.level == "warning" and "jumps" in finding.text]


def test_the_speeds_of_jumps_do_not_count_for_the_shift_and_a_fit(
    swings: tuple[MeasuredComparison, np.ndarray, np.ndarray],
) -> None:
    comparison, _, _ = swings
    moved = [
        replace(peak, computed_speed=1.3 * peak.computed_speed) if peak.contact_loss else peak
        for peak in comparison.peaks
    ]
    steady = sum(peak.paired and not peak.contact_loss for peak in moved)
    assert steady >= 3
    assert resonance_shift(moved, 1.0) == pytest.approx(resonance_shift(comparison.peaks, 1.0), abs=1e-12)
    cuts = comparison.cuts
    assert cuts.compared[..., cuts.contact_loss].any()
    assert not cuts.fitted[..., cuts.contact_loss].any()
    assert (cuts.fitted == cuts.compared)[..., ~cuts.contact_loss].all()


def test_jumps_are_in_the_stored_comparison(
    swings: tuple[MeasuredComparison, np.ndarray, np.ndarray], tmp_path: Path
) -> None:
    import xarray as xr

    comparison, _, _ = swings
    path, *_ = comparison.write(tmp_path / "measured-bench.nc")
    with xr.open_dataset(path) as data:
        peaks = json.loads(data.attrs["peaks"])
    assert [peak["contact_loss"] for peak in peaks] == [peak.contact_loss for peak in comparison.peaks]


@pytest.mark.validation
def test_a_mesh_model_with_contact_loss_is_judged_by_the_fraction_of_the_time(
    tmp_path: Path,
) -> None:
    """Teeth are apart from 1,000 to 1,100 rpm alone."""
    _, speed, angle = synthetic.run_up()
    gearbox = Gearbox.from_toml(synthetic.gearbox_file(tmp_path, synthetic.measurement()))
    response = synthetic.response(gearbox)
    synthetic.recorded(tmp_path / "bench.h5", synthetic.signals(response, speed, angle), angle)
    rpm = np.abs(response["speed"].to_numpy()) / RPM
    fraction = np.zeros(response["contact_loss_fraction"].shape)
    fraction[(rpm > 1000.0) & (rpm < 1100.0), 0] = 0.3
    apart = response.assign(contact_loss_fraction=(response["contact_loss_fraction"].dims, fraction))
    found = compare_run_up(gearbox, read_run_up(gearbox), apart.assign_attrs(mesh_model="table")).cuts
    lost = found.speed[found.contact_loss] / RPM
    step = 2100.0 / 299
    assert lost.min() == pytest.approx(1000.0, abs=2.0 * step) and lost.max() == pytest.approx(1100.0, abs=2.0 * step)
