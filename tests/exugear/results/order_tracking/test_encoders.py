"""Transmission error of known amplitude from the pulses of two encoders."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from exugear.results.order_tracking.angle_cuts import BANDWIDTH, AngleWindow, angle_cuts
from exugear.results.order_tracking.encoders import check_lines, encoder_angle, error_of_angles
from exugear.results.order_tracking.shaft_angle import ShaftAngle, SpeedSignalError
from exugear.results.spectra.resonances import OrderCut
from exugear.results.spectra.waterfall import OrderLine

RATE, SECONDS = 100_000.0, 8.0
RATIO, ORDER, AMPLITUDE = -0.21, 22.0, 50e-6
"""Output over input, order per revolution of the input, and amplitude at the output, rad."""


def shafts() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Speed and angle of the input (600 to 1,800 rpm), and angle of the output, without sign."""
    time = np.arange(int(SECONDS * RATE)) / RATE
    low, rise = 2.0 * np.pi * 10.0, 2.0 * np.pi * 20.0 / SECONDS
    angle = low * time + 0.5 * rise * time**2
    return low + rise * time, angle, abs(RATIO) * angle + AMPLITUDE * np.cos(ORDER * angle + 0.4)


def square(angle: np.ndarray, lines: int) -> np.ndarray:
    """Signal of an encoder with two levels, as logic has it."""
    return (np.sin(lines * angle + 0.1) > 0.0).astype(float)


def sine(angle: np.ndarray, lines: int) -> np.ndarray:
    return np.sin(lines * angle + 0.1)


def cut_of(wave: Callable[[np.ndarray, int], np.ndarray]) -> OrderCut:
    """Order cut of the transmission error by encoders with 500 and 2,400 lines: 23 lines in a period at both."""
    speed, first, second = shafts()
    time = np.arange(first.size) / RATE
    angles = [encoder_angle(wave(own, lines), RATE, lines, time) for own, lines in ((first, 500), (second, 2400))]
    shaft = ShaftAngle(RATE, 0, first, speed)
    ((cut,),) = angle_cuts(error_of_angles(*angles, RATIO)[None], shaft, [OrderLine("mesh", ORDER)])
    return cut


def test_the_transmission_error_of_two_encoders_has_its_known_amplitude() -> None:
    """50 urad at order 22, sine waves with 6.7 samples of a pulse at the highest speed: within 0.05 dB."""
    level = 20.0 * np.log10(np.abs(cut_of(sine).amplitude[4:-4]) / AMPLITUDE)
    assert np.abs(level).max() < 0.05


def test_noise_by_sampled_edges_is_that_of_their_rounding_to_samples() -> None:
    """Edges of a square wave are rounded to samples: independent errors of w dt / sqrt(12) at N pulses in a window.

    The error of the amplitude is then 2 w dt sqrt(1.5 / 12 (1 / N_1 + 1 / N_2)), 1.5 being the bandwidth of the Hann
    window: 4 of 50 urad at 1,200 rpm. Both shafts contribute alike. The mean over 150 windows is within 25 %.
    """
    cut = cut_of(square)
    error = np.abs(cut.amplitude - AMPLITUDE * np.exp(0.4j))
    pulses = np.array([500.0, 2400.0 * abs(RATIO)]) * AngleWindow().revolutions
    expected = 2.0 * abs(RATIO) * cut.speed / RATE * np.sqrt(BANDWIDTH / 12.0 * (1.0 / pulses).sum())
    assert np.sqrt(np.mean((error / expected) ** 2)) == pytest.approx(1.0, abs=0.25)


def test_pulses_that_are_missing_are_counted() -> None:
    """Three lines of 500 are dirty: the angle does not fall behind."""
    _, first, _ = shafts()
    signal = sine(first, 500)
    turns = np.floor((500.0 * first + 0.1) / (2.0 * np.pi))
    signal[np.isin(turns, [4000.0, 20_000.0, 20_001.0])] = -1.0
    found = encoder_angle(signal, RATE, 500, np.arange(first.size) / RATE)
    assert found[-1] - found[0] == pytest.approx(first[-1] - first[0], abs=2.0 * 2.0 * np.pi / 500)


def test_an_encoder_that_is_sampled_too_slowly_is_refused() -> None:
    """30 revolutions per second with 1,000 lines give 30 kHz: 3.3 samples of a pulse."""
    _, first, _ = shafts()
    with pytest.raises(SpeedSignalError, match="has 3.3 samples of a pulse .* record at 1.2.?e.05 Hz or more"):
        encoder_angle(sine(first, 1000), RATE, 1000, np.arange(first.size) / RATE)


def test_an_encoder_with_too_few_lines_is_refused() -> None:
    check_lines(88, 22.0, "stage_1")
    with pytest.raises(SpeedSignalError, match="has 2 lines in a period of 2 x stage_1; .* an encoder with 176 lines"):
        check_lines(88, 44.0, "2 x stage_1")
