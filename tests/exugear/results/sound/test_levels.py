"""Levels of sound power against the standards' values."""

from __future__ import annotations

import math

import numpy as np
import pytest

from exugear.results.sound.levels import (
    a_weighted,
    a_weighting,
    nominal_frequency,
    power_level,
    third_octave,
    third_octave_powers,
)
from exugear.results.sound.radiated_power import equivalent_power


@pytest.mark.parametrize(
    ("frequency", "weight"), [(63.0957, -26.2), (100.0, -19.1), (199.526, -10.9), (1000.0, 0.0), (3981.07, 1.0)]
)
def test_a_weighting_is_that_of_iec_61672(frequency, weight):
    # Table 3 of IEC 61672-1, exact frequencies of the third octaves, rounded to 0.1 dB.
    assert float(a_weighting(np.array(frequency))) == pytest.approx(weight, abs=0.05)


def test_a_piston_radiates_half_of_rho_c_times_area_times_velocity_squared():
    # Both faces of 0.2 m2 at 1 m/s: 1/2 x 411 x 0.4 = 82.2 W.
    power = float(equivalent_power(np.array(1.0), 0.4))
    assert power == pytest.approx(82.2, rel=1e-12)
    assert float(power_level(np.array(power))) == pytest.approx(10 * math.log10(82.2e12), rel=1e-12)


def test_velocity_of_50_nm_per_s_on_a_square_metre_is_the_0_12_db_of_iso_7849():
    # Levels of velocity re 5e-8 m/s are of effective values: the amplitude is sqrt(2) times that.
    assert float(power_level(equivalent_power(np.array(math.sqrt(2.0) * 5e-8), 1.0))) == pytest.approx(0.12, abs=5e-3)


def test_the_edges_of_third_octaves_are_a_tenth_of_a_decade_apart():
    numbers = np.arange(-17, 14)
    centres = 1000.0 * 10.0 ** (numbers / 10.0)
    lower = centres * 10.0**-0.05
    assert np.array_equal(third_octave(centres), numbers)
    assert np.array_equal(third_octave(lower), numbers)  # the lower edge belongs to the band
    assert np.array_equal(third_octave(lower * (1.0 - 1e-6)), numbers - 1)
    assert nominal_frequency(numbers) == pytest.approx(centres, rel=0.016)


def test_third_octaves_hold_all_power_that_is_known():
    random = np.random.default_rng(3)
    power, frequency = random.uniform(size=(4, 30)), random.uniform(20.0, 5000.0, size=(4, 30))
    power[2, 5:9] = np.nan
    numbers, bands = third_octave_powers(power, frequency)
    assert np.array_equal(np.diff(numbers), np.ones(len(numbers) - 1))
    assert bands.sum(axis=1) == pytest.approx(np.nansum(power, axis=1), rel=1e-12)


def test_weighting_is_one_of_power():
    frequency = np.array([100.0, 1000.0])
    assert 10.0 * np.log10(a_weighted(np.ones(2), frequency)) == pytest.approx([-19.145, 0.0], abs=2e-3)


def test_nothing_known_has_no_band():
    numbers, bands = third_octave_powers(np.full((2, 3), np.nan), np.full((2, 3), 100.0))
    assert not numbers.size
    assert bands.shape == (2, 0)
