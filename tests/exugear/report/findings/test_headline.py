"""The resonance that leads: sources in their order, and its contributions."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.report.findings.context import Context, StoredResults
from exugear.report.findings.groups import groups_of
from exugear.report.findings.headline import contributions_of, headline_of
from exugear.report.findings.ranking import ranking_of_errors
from exugear.results.spectra.waterfall import OrderLine
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import to_dataset, with_names
from exugear.steady.steady_response import response_of
from exugear.system.build import assemble
from exugear.system.modes import modes_of

CHOICE = Choice("bushing", "line_of_action", "assemblies")


@pytest.fixture(scope="module")
def found(grc, stiffness, tmp_path_factory):
    """Context and results of the GRC: modes, and a steady response at few speeds and at resonances."""
    assembly = assemble(grc, CHOICE, stiffness)
    data = with_names(to_dataset(response_of(assembly, SteadySettings(SpeedRange(-1.0, -3.0, 40), harmonics=4))))
    context = Context(tmp_path_factory.mktemp("grc"), grc, None, lambda what: None)
    context.assemblies[CHOICE] = assembly
    return context, StoredResults({}, {CHOICE: modes_of(assembly).to_dataset()}, (), (data,))


@pytest.mark.validation
def test_the_headline_is_the_first_of_the_ranking_with_the_mode_that_its_order_crosses(found):
    context, results = found
    headline = headline_of(context, results, groups_of(context, results))
    assert headline.source.startswith("constant speed") and headline.top is headline.ranking.resonances[0]
    for resonance in headline.ranking.resonances[:10]:
        mode = headline.mode_of(resonance)
        assert mode is None or mode.frequency == pytest.approx(resonance.frequency, rel=0.02)
    outside = headline.outside()
    low, high = headline.ranking.speeds
    assert outside is None or not low <= abs(outside.speed) <= high


@pytest.mark.validation
def test_contributions_are_those_of_the_transmission_error_at_the_peak(found):
    """The maximum is searched near the speed of the headline, whose force may be highest beside it."""
    context, results = found
    headline = headline_of(context, results, groups_of(context, results))
    known = contributions_of(context, headline)
    assert known.amplitude == pytest.approx(headline.top.amplitudes["error"].amplitude, rel=0.05)
    assert sum(known.meshes.values()) == pytest.approx(1.0, abs=1e-9)


def test_a_run_up_is_ranked_by_its_error_within_the_stated_speeds():
    line = OrderLine("mesh", 10.0)
    peaks = [(line, 1.0, 1.6, 2e-6), (line, 2.0, 3.2, 5e-6), (line, 4.0, 6.4, 9e-6)]
    speed = np.linspace(0.0, 5.0, 11)
    inside = ranking_of_errors(peaks, speed, (0.5, 3.0))
    assert [own.speed for own in inside.resonances] == [2.0, 1.0]
    assert [own.amplitudes["error"].place for own in inside.resonances] == [1, 2]
    everywhere = ranking_of_errors(peaks, speed, None)
    assert everywhere.whole and everywhere.resonances[0].speed == 4.0


@pytest.mark.validation
def test_without_results_over_speed_and_tables_nothing_leads(found):
    context, results = found
    assert headline_of(context, dataclasses.replace(results, steady=()), ()) is None
