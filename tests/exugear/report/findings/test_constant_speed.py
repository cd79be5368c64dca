"""Levels at constant speed beside those of a run-up: which rank, and which mode they belong to."""

from __future__ import annotations

import json
from dataclasses import asdict

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.report.findings.facts import facts_of_response
from exugear.report.findings.groups import RankedResonance
from exugear.report.findings.ranking import constant_speed_of, most_complete_levels
from exugear.report.findings.words import Labels
from exugear.results.spectra.waterfall import OrderLine
from exugear.steady.settings import SpeedRange, SteadySettings

from ...results.spectra.run_ups import STORED_LINE

CHOICE = Choice("bushing", "line_of_action", "assemblies")


def response(level: str = "parametric", branches: bool = False, sign: float = -1.0) -> xr.Dataset:
    """Two lines; that of the tests' run-ups peaks with 200 um at 790 Hz and 20 um at 500 Hz, the other is flat."""
    frequency = np.arange(100.0, 1500.0, 1.0)
    speed = sign * 2.0 * np.pi * frequency / STORED_LINE.order
    line = 1e-6 + sum(peak / (1.0 + (frequency - centre) ** 2) for centre, peak in ((790.0, 200e-6), (500.0, 20e-6)))
    amplitude = np.stack([np.zeros_like(line), line, np.full_like(line, 3e-6)], axis=1)[:, :, None]
    settings = asdict(SteadySettings(speeds=SpeedRange(-1.0, -0.1, 3), method=level, branches=branches))
    return xr.Dataset(
        {
            "speed": ("point", speed),
            "loads_at_mean_angles": ("point", np.zeros(len(speed), dtype=np.int8)),
            "order": ("line", np.array([0.0, STORED_LINE.order, 7.5 * STORED_LINE.order])),
            "index": (("line", "base"), np.array([[0], [1], [2]])),
            "amplitude": (("point", "line", "signal"), amplitude),
        },
        {"base": ["mesh"], "signal": ["overall_dte"]},
        {
            "variant": CHOICE.variant,
            "mesh_model": CHOICE.mesh_model,
            "inertias": CHOICE.inertias,
            "method": level,
            "settings": json.dumps(settings),
        },
    )


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_peak_is_found_within_what_a_run_up_resolves_whichever_way_the_input_turns(sign):
    levels = constant_speed_of(response(sign=sign))
    found = levels.near(STORED_LINE, 800.0, 15.0)
    assert found is not None
    assert found.frequency == pytest.approx(790.0)
    assert found.level == pytest.approx(20.0 * np.log10(201.0), abs=0.01)
    assert found.speed == pytest.approx(2.0 * np.pi * 790.0 / STORED_LINE.order)


def test_the_flank_of_a_neighbour_is_no_peak():
    levels = constant_speed_of(response())
    found = levels.near(STORED_LINE, 840.0, 15.0)
    assert found is not None
    assert found.frequency == pytest.approx(840.0)
    assert found.level < levels.near(STORED_LINE, 800.0, 15.0).level - 40.0


def test_where_a_response_does_not_go_there_is_no_level():
    levels = constant_speed_of(response())
    assert levels.near(STORED_LINE, 3000.0, 15.0) is None
    assert levels.near(OrderLine("other", 1.37 * STORED_LINE.order), 800.0, 15.0) is None


def test_the_loudest_of_all_orders_is_found_with_its_order():
    line, at = constant_speed_of(response()).highest([OrderLine("other", 7.5 * STORED_LINE.order), STORED_LINE])
    assert line is STORED_LINE
    assert at.frequency == pytest.approx(790.0)
    assert constant_speed_of(response()).highest([OrderLine("none", 3.3 * STORED_LINE.order)]) is None


def test_the_level_that_leaves_least_out_is_told_and_branches_are_not():
    branch, best = response("nonlinear", branches=True), response("parametric")
    best["amplitude"] = 2.0 * best["amplitude"]
    truest = most_complete_levels([branch, response("linear"), best, response("linear")], CHOICE)
    assert truest is not None
    assert truest.level.max() == pytest.approx(20.0 * np.log10(402.0), abs=0.01)
    assert most_complete_levels([branch], CHOICE) is None
    assert most_complete_levels([best], Choice("rigid", CHOICE.mesh_model, CHOICE.inertias)) is None


def test_resonances_rank_by_their_level_at_constant_speed(runs):
    bushing, levels = runs[0], constant_speed_of(response())
    judged = []
    for finding in bushing.findings():
        peak = finding.strongest
        at = levels.near(peak.line, peak.frequency, 15.0)
        judged.append(RankedResonance(bushing.located(finding, at.frequency), True, (), {}, at))
    loudest = max(judged, key=lambda own: own.ranking_level)
    assert loudest.frequency == pytest.approx(790.0)
    assert loudest.ranking_level == pytest.approx(20.0 * np.log10(201.0), abs=0.01)
    assert loudest.missed == pytest.approx(loudest.ranking_level - loudest.peak.level)


def test_a_mode_is_that_of_the_exact_frequency_not_of_the_run_up_s(runs):
    bushing = runs[0]
    finding = next(own for own in bushing.findings() if own.resonance.frequency == pytest.approx(800.0, abs=15.0))
    assert bushing.located(finding, 1151.0).mode_frequency == 1150.0
    assert bushing.located(finding, 806.5).mode_frequency == 806.0
    assert bushing.located(finding, 700.0).mode is None


def test_without_a_run_up_the_loudest_is_told_by_the_response():
    (fact,) = facts_of_response(Labels(Gearbox.from_toml("cases/grc750/gearbox.toml")), response())
    assert fact.figure == "790 Hz"
    assert "Order mesh." in fact.sentence and "±201 µm" in fact.sentence
