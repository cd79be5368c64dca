"""Order cuts of sweeping orders and of swept oscillators."""

import numpy as np

from exugear.results.spectra.resonances import order_cut

from .run_ups import MESH, RATE, oscillator, run_up


def test_order_cut_returns_amplitude_and_phase_of_a_sweeping_order():
    time, speed, angle = run_up()
    growing = 1.0 + time / 20.0
    signal = growing * np.cos(60 * angle + 0.7) + 0.5 * np.cos(90 * angle)
    cut = order_cut(signal, speed, RATE, MESH, window_length=0.1)
    # Where the orders are 1/T x 4 apart (speed above 40/30 turns per second) the other one is out.
    apart = cut.speed > 2 * np.pi * 40.0 / 30.0
    np.testing.assert_allclose(np.abs(cut.amplitude[apart]), 1.0 + cut.time[apart] / 20.0, rtol=2e-3)
    np.testing.assert_allclose(np.angle(cut.amplitude[apart]), 0.7, atol=2e-3)
    np.testing.assert_allclose(cut.frequency, 60 * cut.speed / (2 * np.pi))


def test_order_cut_of_a_slow_sweep_is_the_steady_frequency_response():
    time, speed, angle = run_up(duration=40.0, end_frequency=400.0)
    response = oscillator(np.cos(60 * angle), 250.0, 0.05)
    cut = order_cut(response, speed, RATE, MESH, window_length=0.2)
    ratio = cut.frequency / 250.0
    steady = 1.0 / np.abs(1 - ratio**2 + 0.1j * ratio)
    inside = (cut.frequency > 100.0) & (cut.frequency < 390.0)
    # 10 Hz/s against a half-power width of 25 Hz: quasi-static to (rate / width^2) = 1.6 %.
    np.testing.assert_allclose(np.abs(cut.amplitude[inside]), steady[inside], rtol=0.03)
