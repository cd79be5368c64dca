"""Order cuts over the angle, against orders of known amplitude and a resonance that is crossed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM
from exugear.results.order_tracking.angle_cuts import AngleWindow, TooShortError, angle_cuts
from exugear.results.order_tracking.foreign_orders import (
    foreign_orders,
    gearbox_orders,
    likely_speed,
    order_spectrum,
    standing_orders,
)
from exugear.results.order_tracking.shaft_angle import ShaftAngle, angle_of_speed, angle_of_tacho
from exugear.results.spectra.waterfall import OrderLine

from .test_shaft_angle import RATE, run_up, tacho

ORDERS = {1.0: 0.1, 22.0: 1.0, 44.0: 0.5, 66.0: 0.3, 67.0: 0.03, 132.0: 0.2}
"""Amplitudes by order: a sideband is one order beside an order ten times as high."""


def levels(cut, amplitude: float, low: float = 600.0, high: float = 2900.0) -> np.ndarray:
    """Errors of a cut between two speeds (rpm), dB."""
    inside = (cut.speed > low * RPM) & (cut.speed < high * RPM)
    assert np.count_nonzero(inside) > 100
    return 20.0 * np.log10(np.abs(cut.amplitude[inside]) / amplitude)


@pytest.mark.parametrize(("jitter", "tolerance"), [(0.0, 0.005), (10e-6, 0.03)])
def test_orders_of_a_drifting_run_up_have_their_amplitudes(jitter, tolerance):
    """A chirp in closed form with 2 % drift, and its tacho; phase errors grow with order times jitter."""
    time, _, angle = run_up()
    signal, _ = tacho(time, angle, jitter=jitter)
    shaft = angle_of_tacho(signal, RATE)
    chirp = sum(amplitude * np.cos(order * angle + order) for order, amplitude in ORDERS.items())
    part = chirp[shaft.first : shaft.first + shaft.angle.size]
    (cuts,) = angle_cuts(part[None], shaft, [OrderLine(f"{n:g}", n) for n in ORDERS])
    for cut, amplitude in zip(cuts, ORDERS.values(), strict=True):
        assert np.abs(levels(cut, amplitude)).max() < tolerance * max(1.0, cut.line.order / 44.0)


def test_phases_are_relative_to_the_angle_where_it_begins():
    shaft = angle_of_speed(np.linspace(50.0, 300.0, 200_000), RATE)
    values = np.array([np.cos(20.0 * shaft.angle + phase) for phase in (0.3, -2.0)])
    for (cut,), phase in zip(angle_cuts(values, shaft, [OrderLine("20", 20.0)]), (0.3, -2.0), strict=True):
        assert np.angle(cut.amplitude) == pytest.approx(phase, abs=1e-4)


def test_the_window_may_count_the_revolutions_of_another_shaft():
    """Orders of a slow input, ten times slower than the shaft with the tacho: two orders 0.1 apart are separate."""
    shaft = angle_of_speed(np.linspace(5.0, 30.0, 400_000), RATE)
    values = np.cos(220.0 * shaft.angle) + 0.1 * np.cos(230.0 * shaft.angle)
    ((cut,),) = angle_cuts(values[None], shaft, [OrderLine("23", 230.0)], AngleWindow(8.0), per=10.0)
    assert np.abs(cut.amplitude) == pytest.approx(0.1, rel=2e-3)


def test_orders_above_the_usable_band_are_no_numbers():
    shaft = angle_of_speed(np.linspace(50.0, 300.0, 100_000), RATE)
    ((cut,),) = angle_cuts(np.ones((1, 100_000)), shaft, [OrderLine("300", 300.0)])
    assert np.array_equal(np.isnan(cut.amplitude), cut.frequency > 0.45 * RATE)
    assert 0 < np.isnan(cut.amplitude).sum() < cut.amplitude.size


def test_a_run_shorter_than_a_window_is_refused():
    shaft = angle_of_speed(np.full(1000, 100.0), RATE)
    with pytest.raises(TooShortError, match="0.795 revolutions are shorter than a window of 8"):
        angle_cuts(np.ones((1, 1000)), shaft, [OrderLine("1", 1.0)])


def resonator(force: np.ndarray, frequency: float, damping: float) -> np.ndarray:
    """Response of an oscillator to a force, integrated in time with a force linear between samples."""
    w = 2.0 * np.pi * frequency
    system = ([w * w], [1.0, 2.0 * damping * w, w * w])
    numerator, denominator, _ = scipy.signal.cont2discrete(system, 1.0 / RATE, method="foh")
    return scipy.signal.lfilter(numerator.ravel(), denominator, force)


@pytest.mark.parametrize("revolutions", [8.0, 16.0, 32.0, 64.0])
def test_a_window_averages_over_a_resonance(revolutions):
    """The peak of order 20 at a mode with 2 % damping, 500 to 3,000 rpm in 60 s, lower by up to 2 dB than at rest.

    Reference: mean of the complex steady response under the window, by quadrature over the angle. The sweep-rate ratio
    is 0.02, for which the sweep itself lowers a peak by 0.01 dB.
    """
    time, _, angle = run_up(60.0, drift=0.0)
    frequency, damping = 500.0, 0.02
    values = resonator(np.cos(20.0 * angle), frequency, damping)
    shaft = ShaftAngle(RATE, 0, angle, np.gradient(angle, time))
    ((cut,),) = angle_cuts(values[None], shaft, [OrderLine("20", 20.0)], AngleWindow(revolutions))
    ratio = 20.0 * shaft.speed / (2.0 * np.pi * frequency)
    # A force that is linear between samples is smaller by the square of a sinc function.
    steady = np.sinc(frequency * ratio / RATE) ** 2 / (1.0 - ratio**2 + 2j * damping * ratio)
    even = np.linspace(0.0, angle[-1], int(20 * shaft.revolutions))
    length = int(20 * revolutions)
    averaged = np.convolve(np.interp(even, angle, steady), np.hanning(length) / np.hanning(length).sum(), "valid")
    assert np.abs(cut.amplitude).max() == pytest.approx(np.abs(averaged).max(), rel=10.0 ** (0.015 / 20.0) - 1.0)
    loss = 20.0 * np.log10(np.abs(cut.amplitude).max() / np.abs(steady).max())
    assert loss == pytest.approx({8.0: -0.06, 16.0: -0.24, 32.0: -0.78, 64.0: -2.26}[revolutions], abs=0.03)


def test_orders_of_no_gearbox_are_named_and_a_constant_tone_is_none(grc: Gearbox):
    """Of 9 tones in noise of half their size: those of the gearbox are known, 7.4 and a second machine are foreign."""
    time, _, angle = run_up(40.0)
    shaft = ShaftAngle(RATE, 0, angle / 81.490683, np.gradient(angle, time) / 81.490683)
    ratio = abs(grc.train.ratio)
    mesh = 1792.795  # high-speed stage, per revolution of the input
    tones = {mesh: 1.0, 2 * mesh: 0.5, mesh + ratio: 0.2, ratio: 0.3, 468.571: 0.4, 7.4 * ratio: 0.3, 25.0 * ratio: 0.4}
    rng = np.random.default_rng(5)
    values = sum(a * np.cos(n * shaft.angle + n) for n, a in tones.items()) + 0.5 * rng.standard_normal(time.size)
    values += 0.5 * np.cos(2.0 * np.pi * 740.0 * time)
    known = gearbox_orders(grc, 0.4 * 2.0 * np.pi * RATE / shaft.speed.max())
    spectrum = order_spectrum(values, shaft, ratio)
    found = foreign_orders(standing_orders(spectrum), known, spectrum.resolution)
    assert [own.order / ratio for own in found] == pytest.approx([25.0, 7.4], abs=0.02)
    assert [own.amplitude for own in found] == pytest.approx([0.4, 0.3], rel=0.15)  # between two lines: 1.4 dB


def test_noise_alone_has_no_orders():
    shaft = angle_of_speed(np.linspace(50.0, 300.0, 600_000), RATE)
    for revolutions in (32.0, 16.0, 8.0):  # of the windows: whole run-up, and shorter ones
        part = shaft.angle > shaft.angle[-1] - 2.0 * np.pi * 6.6 * revolutions
        short = replace(shaft, angle=shaft.angle[part], speed=shaft.speed[part])
        for seed in range(3):
            noise = np.random.default_rng(seed).standard_normal(short.angle.size)
            spectrum = order_spectrum(noise, short)
            assert spectrum is not None
            assert spectrum.resolution == 1.0 / revolutions
            assert standing_orders(spectrum) == ()


CANDIDATES = {"twice": 2.0, "half": 0.5, "four times": 4.0, "output for input": 9.52, "input for output": 1.0 / 9.52}
"""Mistakes of the speed of a gearbox with the ratio 9.52."""


@pytest.mark.parametrize("noise", [0.1, 1.0, 3.0])
@pytest.mark.parametrize("mistake", [None, *CANDIDATES])
def test_a_wrong_speed_is_recognised_by_the_mesh_orders(mistake, noise):
    """Six mesh orders in noise whose power is 20 dB below to 10 dB above theirs, by the true speed; no wrong call."""
    orders = [22.0, 44.0, 66.0, 6.43, 12.86, 19.29]
    true = angle_of_speed(np.linspace(50.0, 300.0, 600_000), RATE)
    rng = np.random.default_rng(4)
    values = sum(np.cos(n * true.angle + n) for n in orders) / np.sqrt(3.0) + noise * rng.standard_normal(600_000)
    shaft = true.of_shaft(1.0 if mistake is None else 1.0 / CANDIDATES[mistake])
    spectrum = order_spectrum(values, shaft)
    called = None if spectrum is None else likely_speed(spectrum, orders, CANDIDATES)
    assert called in ({None, mistake} if noise > 1.0 or spectrum is None else {mistake})
