"""What one run-up shows and the other lacks, on run-ups made of known resonators."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.units import RPM
from exugear.results.spectra.resonances import pick_resonances
from exugear.results.spectra.run_spectra import AbsenceRule, compare, only_in_first
from exugear.results.spectra.waterfall import waterfall

from .run_ups import MESH, RATE, STORED_LINE, read_run, run_up, swept_pair, write_run


def test_what_only_one_run_shows(runs):
    bushing, rigid = runs
    comparison = compare(bushing, rigid)
    only = [finding.resonance.frequency for finding in comparison.only_first]
    assert only == pytest.approx([800.0, 1150.0], abs=14.0)
    assert comparison.only_second == ()
    assert [run.variant for run in comparison.runs] == ["rigid", "bushing"]


def test_a_comparison_draws_both_runs_and_what_only_one_shows(runs):
    comparison = compare(*runs)
    panel = comparison.plot()
    curves = {line.get_label(): line.get_xydata().T for line in panel.lines}
    for run in runs:
        expected = run.spectra.speed / RPM, run.spectra.level.max(axis=1)
        np.testing.assert_array_equal(curves[run.variant], expected)
    peaks = [finding.strongest for finding in comparison.only_first]
    np.testing.assert_array_equal(curves["only bushing"][1], [peak.level for peak in peaks])
    assert curves["only rigid"].size == 0


@pytest.mark.parametrize("key", ["load_case", "mesh_model", "inertias", "gearbox"])
def test_runs_of_different_models_are_not_compared(runs, tmp_path, key):
    bushing, _ = runs
    other = read_run(write_run(tmp_path / "r.nc", "rigid", [500.0], **{key: "other"}), [STORED_LINE])
    with pytest.raises(ValueError, match=key):
        compare(bushing, other)


def test_runs_with_different_windows_are_not_compared(runs):
    bushing, rigid = runs
    with pytest.raises(ValueError, match="window"):
        compare(bushing, read_run(rigid.path, [STORED_LINE], None, 2 * rigid.spectra.window_length))


def test_only_the_added_resonance_is_only_in_the_first_run():
    soft, stiff = swept_pair([600.0, 1300.0]), swept_pair([600.0])
    picks = pick_resonances(soft, [MESH])
    assert len(picks) == 2
    (alone,) = only_in_first(picks, stiff)
    assert abs(alone.frequency - 1300.0) < alone.resolution
    assert only_in_first(picks, soft) == ()


def test_a_peak_that_the_other_run_reaches_without_peaking_is_not_only_in_the_first():
    soft = swept_pair([600.0, 1300.0])
    loud = waterfall(
        100.0 * np.sin(60 * run_up(duration=20.0)[2]),
        run_up(duration=20.0)[1],
        RATE,
        window_length=0.1,
        overlap=0.8,
        reference=1.0,
    )
    picks = pick_resonances(soft, [MESH])
    assert only_in_first(picks, loud) == ()
    assert len(only_in_first(picks, loud, AbsenceRule(margin=-60.0))) == 2


def test_what_the_other_run_never_reached_is_not_called_absent():
    soft = swept_pair([600.0, 1300.0])
    time, speed, angle = run_up(duration=20.0)
    short = slice(0, round(8.0 * RATE))
    stopped = waterfall(np.sin(60 * angle[short]), speed[short], RATE, window_length=0.1, overlap=0.8, reference=1.0)
    assert [pick.frequency > 1000 for pick in only_in_first(pick_resonances(soft, [MESH]), stopped)] == [False]
