"""Orders of a stored response as those of run-ups, and its peaks beside theirs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.results.spectra.resonances import OrderCut, sweep_severity
from exugear.results.spectra.waterfall import OrderLine
from exugear.steady.peaks import peaks
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import to_dataset
from exugear.steady.steady_response import response_of
from exugear.system.build import assemble

from ..cases.command import script

ranking = script(Path(__file__).parents[3] / "cases" / "grc750", "ranking")


def steady_cut(data: xr.Dataset, line: OrderLine) -> OrderCut:
    """Overall transmission error along an order, as run-ups have it; times are NaN."""
    own = data.isel(line=line.place(data["order"].to_numpy()), signal=0)
    speed = data["speed"].to_numpy().astype(np.float64)
    amplitude = own["amplitude"].to_numpy() * np.exp(1j * own["phase"].to_numpy())
    return OrderCut(line, np.full(speed.shape, np.nan), speed, line.frequency(speed), amplitude.astype(np.complex128))


@pytest.fixture(scope="module")
def data(grc, stiffness):
    settings = SteadySettings(SpeedRange(4.0, 20.0, 40))
    return to_dataset(response_of(assemble(grc, Choice("rigid"), stiffness), settings))


def test_a_run_that_shows_one_order_too_low_ranks_its_peaks_lower(data):
    """A run as slow as can be shows the steady response; one that loses an order to a tenth ranks that behind."""
    slow = ranking.compared_peaks(data, lambda line: steady_cut(data, line), 1e-6, most=5)
    assert [own.run_rank for own in slow] == [1, 2, 3, 4, 5]
    for own in slow:
        # A louder peak of the same order may stand within the sweep's shift.
        assert own.run_amplitude >= own.peak.amplitude * (1.0 - 1e-6)
    loudest = slow[0].peak.order

    def lossy(line):
        cut = steady_cut(data, line)
        return replace(cut, amplitude=0.1 * cut.amplitude) if line.order == loudest else cut

    assert ranking.compared_peaks(data, lossy, 1e-6, most=5)[0].run_rank > 1


def test_the_severity_is_that_of_the_damping_at_the_peak(data):
    own = next(own for own in ranking.compared_peaks(data, lambda line: steady_cut(data, line), 0.1) if own.damping)
    assert own.damping == ranking.damping_at(data, own.peak)
    assert own.severity == sweep_severity(own.peak.frequency, own.damping, 0.1 * own.peak.order)


def test_far_from_all_crossings_no_damping_is_known(data):
    assert ranking.damping_at(data, replace(peaks(data)[0], speed=100.0)) is None
