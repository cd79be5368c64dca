"""Orders of a stored response as those of run-ups, and its peaks beside theirs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.results.spectra.resonances import OrderCut, sweep_severity
from exugear.results.spectra.waterfall import OrderLine
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.steady.peaks import compared_peaks, damping_at, peaks
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import to_dataset
from exugear.steady.steady_response import response_of
from exugear.system.build import assemble

PLANETARY = OrderLine("planetary", 99.0)


def steady_cut(data: xr.Dataset, line: OrderLine, signal: str = "overall_dte") -> OrderCut:
    """Amplitude and phase along an order, as `exugear.results.spectra.resonances` has them of run-ups; times are NaN.

    Parameters
    ----------
    data : as `exugear.steady.steady_file.load_response` reads it
    line : of a single mesh frequency or a combination

    Raises
    ------
    SteadyError
        The response has no such signal or order.
    """
    names = [str(name) for name in data["signal"].to_numpy()]
    orders = data["order"].to_numpy()
    if signal not in names:
        raise SteadyError(f"no signal {signal!r}; signals are {', '.join(names)}")
    place = line.place(orders)
    if place is None:
        nearest = orders[np.argmin(np.abs(orders - line.order))]
        raise SteadyError(f"no line of order {line.order:g}; the nearest is {nearest:g}")
    own = data.isel(line=place, signal=names.index(signal))
    speed = data["speed"].to_numpy().astype(np.float64)
    amplitude = own["amplitude"].to_numpy() * np.exp(1j * own["phase"].to_numpy())
    return OrderCut(line, np.full(speed.shape, np.nan), speed, line.frequency(speed), amplitude.astype(np.complex128))


@pytest.fixture(scope="module")
def response(grc, stiffness):
    return response_of(assemble(grc, Choice("rigid"), stiffness), SteadySettings(SpeedRange(4.0, 20.0, 40)))


@pytest.fixture(scope="module")
def data(response):
    return to_dataset(response)


@pytest.mark.validation
def test_a_cut_is_the_line_of_that_order(response, data):
    cut = steady_cut(data, PLANETARY)
    known = response.amplitude("overall_dte", (1, 0, 0))
    np.testing.assert_allclose(cut.amplitude, known, rtol=0.0, atol=1e-6 * abs(known).max())  # single precision
    np.testing.assert_array_equal(cut.speed, response.solved.speed)
    np.testing.assert_allclose(cut.frequency, 99.0 * response.solved.speed / (2.0 * np.pi))


def test_an_order_or_signal_that_is_not_there_is_refused(data):
    with pytest.raises(SteadyError, match="no line of order 99.5; the nearest is 99"):
        steady_cut(data, OrderLine("half", 99.5))
    with pytest.raises(SteadyError, match="no signal 'noise'"):
        steady_cut(data, PLANETARY, "noise")


def test_a_run_that_shows_one_order_too_low_ranks_its_peaks_lower(data):
    """A run as slow as can be shows the steady response; one that loses an order to a tenth ranks that behind."""
    slow = compared_peaks(data, lambda line: steady_cut(data, line), 1e-6, most=5)
    assert [own.run_rank for own in slow] == [1, 2, 3, 4, 5]
    for own in slow:
        # A louder peak of the same order may stand within the sweep's shift.
        assert own.run_amplitude >= own.peak.amplitude * (1.0 - 1e-6)
    loudest = slow[0].peak.order

    def lossy(line):
        cut = steady_cut(data, line)
        return replace(cut, amplitude=0.1 * cut.amplitude) if line.order == loudest else cut

    assert compared_peaks(data, lossy, 1e-6, most=5)[0].run_rank > 1


def test_the_severity_is_that_of_the_damping_at_the_peak(data):
    own = next(own for own in compared_peaks(data, lambda line: steady_cut(data, line), 0.1) if own.damping)
    assert own.damping == damping_at(data, own.peak)
    assert own.severity == sweep_severity(own.peak.frequency, own.damping, 0.1 * own.peak.order)


def test_far_from_all_crossings_no_damping_is_known(data):
    assert damping_at(data, replace(peaks(data)[0], speed=100.0)) is None
