"""Uneven samples brought onto equal steps keep what the new rate can hold."""

import numpy as np
import pytest

from exugear.results.spectra.resampling import resample_uniform


def test_resampling_keeps_a_tone_at_eight_samples_per_period():
    rng = np.random.default_rng(3)
    uneven = np.cumsum(rng.uniform(0.9, 1.1, 4000)) / 8000.0
    time, values = resample_uniform(uneven, np.sin(2 * np.pi * 900.0 * uneven), 8000.0)
    np.testing.assert_allclose(np.diff(time), 1 / 8000.0, rtol=1e-9)
    np.testing.assert_allclose(values[20:-20], np.sin(2 * np.pi * 900.0 * time[20:-20]), atol=1.5e-3)


@pytest.mark.parametrize(
    ("frequency", "gain", "tolerance"),
    [(50.0, 1.0, 2e-3), (400.0, 1.0, 1e-2), (560.0, 0.0, 2e-3), (900.0, 0.0, 2e-3)],
)
def test_lower_rate_keeps_the_band_and_holds_back_aliases(frequency, gain, tolerance):
    fine = np.arange(16000) / 8000.0
    time, values = resample_uniform(fine, np.sin(2 * np.pi * frequency * fine), 1000.0)
    middle = slice(100, -100)
    np.testing.assert_allclose(values[middle], gain * np.sin(2 * np.pi * frequency * time[middle]), atol=tolerance)


def test_resampling_refuses_time_that_stands_still():
    time = np.arange(20.0)
    time[7] = time[6]
    with pytest.raises(ValueError, match="does not after 6 s"):
        resample_uniform(time, time, 1.0)
