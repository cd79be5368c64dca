"""Amplitude spectra of tones, and windows for tones that sweep."""

import math

import numpy as np
import pytest

from exugear.results.spectra.waterfall import (
    amplitude_spectrum,
    sweep_limited_resolution,
    sweep_matched_window,
    waterfall,
)

from .run_ups import RATE, run_up


@pytest.mark.parametrize("window", ["boxcar", "hann", "hamming", "blackman", "flattop"])
@pytest.mark.parametrize("count", [1000, 1001])
def test_tone_on_a_spectral_line_has_its_amplitude(window, count):
    cycle = np.arange(count) / count
    signal = 0.25 + 1.75 * np.cos(2 * np.pi * 40.0 * cycle + 0.3)
    frequency, amplitude = amplitude_spectrum(signal, float(count), window)
    assert frequency[40] == pytest.approx(40.0)
    assert amplitude[40] == pytest.approx(1.75, rel=1e-12)  # rounding
    assert amplitude[0] == pytest.approx(0.25, rel=1e-12)


def test_nyquist_line_counts_once():
    _, amplitude = amplitude_spectrum(np.tile([2.0, -2.0], 64), 128.0, "boxcar")
    assert amplitude[-1] == pytest.approx(2.0)


def test_flattop_reads_amplitudes_between_lines():
    time = np.arange(1000) / 1000.0
    _, amplitude = amplitude_spectrum(np.sin(2 * np.pi * 40.5 * time), 1000.0, "flattop")
    assert amplitude.max() == pytest.approx(1.0, rel=1.5e-3)  # 0.01 dB, the window's property


def test_spectrum_of_several_rows_is_that_of_each():
    rows = np.random.default_rng(0).normal(size=(3, 256))
    together = amplitude_spectrum(rows, 256.0)[1]
    for row, spectrum in zip(rows, together, strict=True):
        np.testing.assert_allclose(amplitude_spectrum(row, 256.0)[1], spectrum, rtol=1e-12)


def test_best_window_resolves_the_root_of_the_sweep_rate():
    # 29.87992 Hz per rpm over 215 rpm in 30 s is 214.1 Hz/s: 15 Hz.
    rate = 29.87992 * 215.0 / 30.0
    assert sweep_limited_resolution(rate) == pytest.approx(14.6, abs=0.1)
    assert sweep_matched_window(rate) * sweep_limited_resolution(rate) == pytest.approx(1.0)


def test_no_window_makes_a_chirp_narrower_than_the_root_of_its_rate():
    time, speed, angle = run_up(duration=8.0, end_frequency=1600.0)  # 200 Hz/s
    widths = []
    for length in np.geomspace(0.02, 0.4, 9):
        run = waterfall(np.sin(60 * angle), speed, RATE, window_length=length, overlap=0.0)
        frame = run.amplitude[np.argmin(np.abs(run.time - 4.0))]
        widths.append(np.ptp(run.frequency[frame > frame.max() / math.sqrt(2.0)]))
    # Half-power width with the best Hann window, read off spectral lines: about the root of the rate.
    best = min(widths)
    assert 0.7 < best / math.sqrt(200.0) < 2.0
    assert widths[0] > 1.5 * best and widths[-1] > 1.5 * best


def test_steady_tone_has_no_matched_window():
    with pytest.raises(ValueError, match="sweep rate = 0"):
        sweep_matched_window(0.0)
