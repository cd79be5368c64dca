"""Sweeps through resonances: the measure of what is too fast, against oscillators that are swept."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.integrate

from exugear.results.spectra.resonances import MAX_SWEEP_RATIO, run_up_cut, sweep_rate
from exugear.results.spectra.waterfall import OrderLine

FREQUENCY, DAMPING = 50.0, 0.01


def highest_share(severity):
    """Highest amplitude of an oscillator under a sweep, over that of its steady resonance."""
    rate = severity * 2.0 * np.pi * (DAMPING * FREQUENCY) ** 2
    w, spread = 2.0 * np.pi * FREQUENCY, max(8.0 * DAMPING * FREQUENCY, 6.0 * np.sqrt(rate))
    first, duration = FREQUENCY - spread, 2.0 * spread / rate

    def slope(t, y):
        force = np.cos(2.0 * np.pi * (first * t + 0.5 * rate * t * t))
        return [y[1], force - 2.0 * DAMPING * w * y[1] - w * w * y[0]]

    run = scipy.integrate.solve_ivp(slope, (0.0, duration), [0.0, 0.0], rtol=1e-6, atol=1e-10)
    return np.max(np.hypot(run.y[0], run.y[1] / w)) * 2.0 * DAMPING * w * w


@pytest.mark.validation
@pytest.mark.parametrize(
    ("severity", "low", "high"),
    [pytest.param(0.1, 0.95, 1.02, marks=pytest.mark.long), (MAX_SWEEP_RATIO, 0.88, 0.99), (20.0, 0.2, 0.5)],
)
def test_a_sweep_builds_up_as_far_as_its_severity_says(severity, low, high):
    assert low < highest_share(severity) < high


def test_the_rate_of_an_order_is_the_order_times_that_of_the_shaft():
    time = np.linspace(0.0, 4.0, 100)
    assert sweep_rate(time, -2.0 * np.pi * 3.0 * time, 10.0) == pytest.approx(30.0)


def test_a_cut_of_a_run_up_gives_the_amplitude_back_and_no_mean():
    rate = 4000.0
    time = np.arange(40000) / rate
    speed = 2.0 * np.pi * (1.0 + 0.5 * time)
    angle = 2.0 * np.pi * (time + 0.25 * time**2)
    cut = run_up_cut(time, 5.0 + 0.1 * np.cos(40.0 * angle), speed, OrderLine("40", 40.0))
    np.testing.assert_allclose(np.abs(cut.amplitude), 0.1, rtol=0.02)
