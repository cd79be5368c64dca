"""Waterfalls of tones and chirps whose levels are known."""

import math

import numpy as np
import pytest

from exugear.results.spectra.resonances import pick_resonances
from exugear.results.spectra.waterfall import OrderLine, line_level, waterfall

from .run_ups import MESH, RATE, run_up


def test_waterfall_shows_a_steady_tone_at_every_speed():
    time, speed, _ = run_up(duration=4.0)
    run = waterfall(5.0 + 2e-6 * np.sin(2 * np.pi * 640.0 * time), speed, RATE, window_length=0.125, reference=1e-6)
    assert np.all(run.frequency[np.argmax(run.amplitude, axis=1)] == 640.0)
    # 6.02 dB re 1 um; the mean of 5 is removed to rounding.
    np.testing.assert_allclose(run.level.max(axis=1), 20 * math.log10(2.0), atol=1e-6)
    np.testing.assert_allclose(run.speed, np.interp(run.time, time, speed), rtol=1e-9)
    assert run.description == "Hann window 125 ms, overlap 75 %, 0 dB = 1 µm"


def test_speed_counts_by_magnitude():
    time, speed, angle = run_up(duration=4.0)
    forward = waterfall(np.sin(60 * angle), speed, RATE, window_length=0.1)
    backward = waterfall(np.sin(60 * angle), -speed, RATE, window_length=0.1)
    np.testing.assert_array_equal(forward.speed, backward.speed)
    np.testing.assert_allclose(line_level(forward, MESH), line_level(backward, MESH))


def test_line_level_follows_a_chirp():
    _, speed, angle = run_up()
    run = waterfall(3.0 * np.sin(60 * angle), speed, RATE, window_length=0.1, reference=1.0)
    level = line_level(run, MESH)
    inside = np.isfinite(level)
    assert run.frequency[0] == 0.0 and np.count_nonzero(inside) > 0.95 * level.size
    # 100 Hz/s over 0.1 s: the tone spreads over the 10 Hz that the window resolves.
    np.testing.assert_allclose(level[inside], 20 * math.log10(3.0), atol=0.8)


def test_line_outside_the_band_has_no_level():
    time, speed, angle = run_up(duration=4.0)
    run = waterfall(np.sin(60 * angle), speed, RATE, window_length=0.1)
    assert np.all(np.isnan(line_level(run, OrderLine("far", 6000.0))[-20:]))
    assert pick_resonances(run, [OrderLine("far above", 6e6)]) == ()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"window_length": 1e-4}, "s is 1 samples; 8 to 8192"),
        ({"window_length": 9.0}, "s is 73728 samples; 8 to 8192"),
        ({"window_length": 0.1, "overlap": 1.0}, "overlap"),
    ],
)
def test_impossible_windows_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        waterfall(np.zeros(8192), np.zeros(8192), RATE, **options)
