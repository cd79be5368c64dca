"""Resonances of swept oscillators whose frequencies are known."""

import math

import numpy as np
import pytest

from exugear.results.spectra.resonances import (
    Pick,
    group_by_frequency,
    match_eigenfrequencies,
    pick_resonances,
)
from exugear.results.spectra.waterfall import OrderLine, sweep_matched_window, waterfall

from .run_ups import MESH, RATE, oscillator, run_up


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
    lines = OrderLine("mesh", 60.0), OrderLine("2 × mesh", 120.0)
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


def test_no_eigenfrequency_within_the_resolution_is_no_match():
    pick = Pick(MESH, time=1.0, speed=1.0, frequency=3215.0, level=0.0, prominence=6.0, resolution=15.0)
    assert match_eigenfrequencies([pick], [3199.0, 3231.0]) == (None,)
    assert match_eigenfrequencies([pick], []) == (None,)
