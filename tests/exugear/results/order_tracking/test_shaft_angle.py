"""Angle of a shaft from tachos and speed signals, against the angle that the signals were made from."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.units import RPM
from exugear.results.order_tracking.shaft_angle import (
    SpeedSignalError,
    angle_of_speed,
    angle_of_tacho,
    counted_pulses,
    pulse_times,
)

RATE = 20000.0


def run_up(seconds: float = 30.0, first: float = 500.0, last: float = 3000.0, drift: float = 0.02):
    """Time, speed (rad/s) and angle (rad) of a run-up with a speed that drifts by a slow sine, in closed form."""
    time = np.arange(int(seconds * RATE)) / RATE
    low, rise, rate = first * RPM, (last - first) * RPM / seconds, 2.0 * np.pi / 7.0
    speed = low + rise * time + drift * last * RPM * np.sin(rate * time)
    angle = low * time + 0.5 * rise * time**2 + drift * last * RPM * (1.0 - np.cos(rate * time)) / rate
    return time, speed, angle


def tacho(time: np.ndarray, angle: np.ndarray, per: int = 1, jitter: float = 0.0, places=None, seed: int = 1):
    """Pulse whose rising edge passes half of its height exactly at each mark, with the jitter of its time."""
    count = np.arange(1, int(angle[-1] / (2.0 * np.pi) * per))
    marks = 2.0 * np.pi * (count / per - (0.0 if places is None else np.asarray(places)[count % per]))
    edges = np.sort(np.interp(marks, angle, time) + jitter * np.random.default_rng(seed).standard_normal(count.size))
    signal = np.zeros(time.size)
    for edge in edges:
        after = int(np.ceil(edge * RATE))
        rise = after - edge * RATE
        signal[after - 1 : after + 8] = [0.1 + 0.4 * rise, 0.5 + 0.4 * rise, *[1.0] * 7]
        signal[after - 1] = 0.5 - 0.4 * (1.0 - rise)
    return signal, edges


@pytest.mark.parametrize(("jitter", "tolerance"), [(0.0, 1e-5), (10e-6, 2e-4), (50e-6, 5e-4)])
def test_speed_from_one_pulse_per_revolution_is_known_in_spite_of_jitter(jitter, tolerance):
    """Root mean square over the run without the ends, where a spline is least certain; an edge may jitter by 50 us."""
    time, speed, angle = run_up()
    signal, _ = tacho(time, angle, jitter=jitter)
    shaft = angle_of_tacho(signal, RATE)
    own = speed[shaft.first : shaft.first + shaft.speed.size]
    inside = slice(int(RATE), -int(RATE))
    assert np.sqrt(np.mean((shaft.speed / own - 1.0)[inside] ** 2)) < tolerance


def test_pulses_are_where_the_signal_crosses_the_level():
    time, _, angle = run_up(10.0)
    signal, edges = tacho(time, angle)
    assert pulse_times(signal, RATE) == pytest.approx(edges, abs=1e-9)


def test_noise_on_a_slow_edge_is_no_further_pulse():
    time = np.arange(200000) / RATE
    wave = np.sin(2.0 * np.pi * 8.0 * time) + 0.02 * np.random.default_rng(2).standard_normal(time.size)
    assert pulse_times(wave, RATE).size == 80


def test_missing_and_extra_pulses_are_found_and_corrected():
    time, speed, angle = run_up()
    signal, edges = tacho(time, angle)
    for edge in edges[[40, 41, 300]]:
        signal[int(edge * RATE) - 2 : int(edge * RATE) + 12] = 0.0
    for edge in edges[[100, 200]]:
        at = int(edge * RATE) + 100
        signal[at : at + 6] = 1.0
    shaft = angle_of_tacho(signal, RATE)
    assert shaft.remarks == (
        f"3 missing pulses of {edges.size - 3} corrected",
        f"2 extra pulses of {edges.size - 3} corrected",
    )
    own = speed[shaft.first : shaft.first + shaft.speed.size]
    assert np.abs(shaft.speed / own - 1.0).max() < 1e-3


def test_marks_off_their_places_are_learned():
    """Four marks of which two are 3 degrees off: without correction the speed would vary by 2 %."""
    time, speed, angle = run_up()
    signal, _ = tacho(time, angle, per=4, places=np.array([0.0, 3.0, 0.0, -3.0]) / 360.0)
    shaft = angle_of_tacho(signal, RATE, 4)
    own = speed[shaft.first : shaft.first + shaft.speed.size]
    assert np.abs(shaft.speed / own - 1.0).max() < 5e-4


def test_a_run_from_standstill_counts_its_first_pulses():
    """Distances of the first pulses at constant acceleration are as 1 : 0.41 : 0.32, which are no missing pulses."""
    train = counted_pulses(np.sqrt(np.arange(1.0, 300.0)))
    assert (train.missing, train.extra) == (0, 0)


def test_the_angle_of_a_speed_signal_is_its_integral():
    """Tolerance: a step of 1 rpm in a signal is at most half of it in the mean."""
    time, speed, angle = run_up()
    for signal, tolerance in ((speed, 1e-6), (np.round(speed / RPM) * RPM, 0.05)):
        shaft = angle_of_speed(-signal, RATE)
        assert np.abs(shaft.angle - (angle - angle[shaft.first])[shaft.first :]).max() < tolerance


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.zeros(1000), "has 0 pulses; at least 16"),
        (np.sin(0.01 * np.arange(5000)), "has 7 pulses; at least 16"),
    ],
)
def test_a_signal_without_pulses_is_refused(values, message):
    with pytest.raises(SpeedSignalError, match=message):
        angle_of_tacho(values, RATE)


@pytest.mark.parametrize(
    ("speed", "message"), [(np.zeros(100), "zero throughout"), (np.linspace(-3.0, 5.0, 100), "changes its sign")]
)
def test_a_speed_without_a_sense_is_refused(speed, message):
    with pytest.raises(SpeedSignalError, match=message):
        angle_of_speed(speed, RATE)
