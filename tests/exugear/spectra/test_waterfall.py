"""Spectra of tones, chirps and swept oscillators whose answers are known in closed form."""

import math

import numpy as np
import pytest
import scipy.signal

from exugear.spectra.resampling import (
    amplitude_spectrum,
    resample_uniform,
    sweep_limited_resolution,
    sweep_matched_window,
)
from exugear.spectra.resonances import (
    AbsenceRule,
    Pick,
    group_by_frequency,
    line_level,
    match_eigenfrequencies,
    only_in_first,
    pick_resonances,
)
from exugear.spectra.waterfall import OrderLine, harmonics, order_cut, waterfall

RATE = 8192.0
MESH = OrderLine("mesh", 60.0)


def run_up(duration=20.0, end_frequency=2000.0, line=MESH):
    """Time, speed and shaft angle of a uniform run-up in which `line` reaches `end_frequency`."""
    time = np.arange(round(duration * RATE)) / RATE
    end_speed = 2.0 * math.pi * end_frequency / line.order
    return time, end_speed * time / duration, 0.5 * end_speed * time**2 / duration


def oscillator(excitation, frequency, damping):
    """Displacement times stiffness of x'' + 2 D w x' + w^2 x = w^2 f, exact for piecewise linear f."""
    omega = 2.0 * math.pi * frequency
    system = ([omega**2], [1.0, 2.0 * damping * omega, omega**2])
    numerator, denominator, _ = scipy.signal.cont2discrete(system, 1.0 / RATE, method="foh")
    return scipy.signal.lfilter(numerator.ravel(), denominator, excitation)


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


@pytest.mark.parametrize("damping", [0.005, 0.02, 0.04])
@pytest.mark.parametrize("frequency", [500.0, 820.0, 1411.0])
def test_resonance_of_a_swept_oscillator_is_picked_within_the_resolution(frequency, damping):
    time, speed, angle = run_up(duration=10.0)  # 200 Hz/s
    response = oscillator(np.sin(60 * angle), frequency, damping)
    run = waterfall(response, speed, RATE, window_length=sweep_matched_window(200.0), overlap=0.8, reference=1.0)
    (pick,) = pick_resonances(run, [MESH])
    assert pick.resolution == pytest.approx(math.sqrt(200.0), rel=0.02)
    assert abs(pick.frequency - frequency) < pick.resolution
    assert pick.speed == pytest.approx(2 * np.pi * pick.frequency / 60.0)
    assert pick.time == pytest.approx(pick.frequency / 200.0, rel=1e-3)
    assert match_eigenfrequencies([pick], [frequency - 40.0, frequency, frequency + 40.0]) == (1,)


def test_level_of_a_slowly_swept_resonance_is_its_magnification():
    time, speed, angle = run_up(duration=40.0, end_frequency=400.0)
    run = waterfall(oscillator(np.sin(60 * angle), 250.0, 0.05), speed, RATE, window_length=0.25, reference=1.0)
    (pick,) = pick_resonances(run, [MESH])
    assert pick.level == pytest.approx(20 * math.log10(10.0), abs=0.5)  # 1 / (2 D), scalloping 0.4 dB


def test_two_orders_find_the_same_resonance_and_are_one_group():
    time, speed, angle = run_up(duration=20.0)
    lines = harmonics("mesh", 60.0, 2)
    force = np.sin(60 * angle) + 0.5 * np.sin(120 * angle)
    response = oscillator(force, 700.0, 0.02) + oscillator(force, 1200.0, 0.02)
    run = waterfall(response, speed, RATE, window_length=0.1, overlap=0.8, reference=1.0)
    groups = group_by_frequency(pick_resonances(run, lines))
    assert len(groups) == 2
    for group, frequency in zip(groups, (700.0, 1200.0), strict=True):
        assert abs(group.frequency - frequency) < group.resolution
        assert {pick.line.name for pick in group.picks} == {"mesh", "2 × mesh"}
        assert group.picks[0].level >= group.picks[1].level
    assert match_eigenfrequencies(groups, [1200.0, 700.0]) == (1, 0)


def test_prominence_is_the_height_over_the_valley():
    time, speed, angle = run_up(duration=20.0)
    # A bump of 12 dB on a flat line.
    bump = 10 ** (12.0 / 20.0 * np.exp(-(((100.0 * time - 1000.0) / 60.0) ** 2)))
    run = waterfall(bump * np.sin(60 * angle), speed, RATE, window_length=0.1, reference=1.0)
    (pick,) = pick_resonances(run, [MESH])
    assert pick.prominence == pytest.approx(12.0, abs=1.0)  # scalloping and spread
    assert pick_resonances(run, [MESH], prominence=14.0) == ()


def test_ripple_of_a_line_without_excitation_is_not_picked():
    _, speed, angle = run_up(duration=20.0)
    noise = 1e-5 * np.random.default_rng(0).normal(size=angle.size)
    run = waterfall(oscillator(np.sin(60 * angle), 700.0, 0.02) + noise, speed, RATE, window_length=0.1, reference=1.0)
    silent = OrderLine("silent", 101.0)
    assert {pick.line for pick in pick_resonances(run, [MESH, silent])} == {MESH}
    assert len(pick_resonances(run, [MESH, silent], depth=200.0)) > 10


def swept_pair(frequencies):
    time, speed, angle = run_up(duration=20.0)
    force = np.sin(60 * angle)
    response = sum(oscillator(force, frequency, 0.02) for frequency in frequencies)
    return waterfall(response, speed, RATE, window_length=0.1, overlap=0.8, reference=1.0)


def test_only_the_added_resonance_is_only_in_the_first_run():
    soft, stiff = swept_pair([600.0, 1300.0]), swept_pair([600.0])
    picks = pick_resonances(soft, [MESH])
    assert len(picks) == 2
    (alone,) = only_in_first(picks, stiff)
    assert abs(alone.frequency - 1300.0) < alone.resolution
    assert only_in_first(picks, soft) == ()


def test_a_peak_that_the_other_run_reaches_without_peaking_is_not_only_in_the_first():
    soft = swept_pair([600.0, 1300.0])
    loud = waterfall(
        100.0 * np.sin(60 * run_up(duration=20.0)[2]),
        run_up(duration=20.0)[1],
        RATE,
        window_length=0.1,
        overlap=0.8,
        reference=1.0,
    )
    picks = pick_resonances(soft, [MESH])
    assert only_in_first(picks, loud) == ()
    assert len(only_in_first(picks, loud, AbsenceRule(margin=-60.0))) == 2


def test_what_the_other_run_never_reached_is_not_called_absent():
    soft = swept_pair([600.0, 1300.0])
    time, speed, angle = run_up(duration=20.0)
    short = slice(0, round(8.0 * RATE))
    stopped = waterfall(np.sin(60 * angle[short]), speed[short], RATE, window_length=0.1, overlap=0.8, reference=1.0)
    assert [pick.frequency > 1000 for pick in only_in_first(pick_resonances(soft, [MESH]), stopped)] == [False]


def test_no_eigenfrequency_within_the_resolution_is_no_match():
    pick = Pick(MESH, time=1.0, speed=1.0, frequency=3215.0, level=0.0, prominence=6.0, resolution=15.0)
    assert match_eigenfrequencies([pick], [3199.0, 3231.0]) == (None,)
    assert match_eigenfrequencies([pick], []) == (None,)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"window_length": 1e-4}, "is 1 samples: it needs 8 to 8192"),
        ({"window_length": 9.0}, "is 73728 samples: it needs 8 to 8192"),
        ({"window_length": 0.1, "overlap": 1.0}, "overlap"),
    ],
)
def test_impossible_windows_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        waterfall(np.zeros(8192), np.zeros(8192), RATE, **options)


def test_steady_tone_has_no_matched_window():
    with pytest.raises(ValueError, match="steady"):
        sweep_matched_window(0.0)
