"""Modified life by ISO 281: a_ISO at its limits and across its branches, viscosity, contamination."""

from __future__ import annotations

import math

import numpy as np
import pytest

from exugear.system.bearings.rolling.life import (
    CONTAMINATION,
    LARGEST_FACTOR,
    contamination_factor,
    fatigue_limit,
    life_factor,
    viscosity_at,
    viscosity_ratio,
)

TYPES = ("cylindrical_roller", "deep_groove_ball")


@pytest.mark.parametrize("kind", TYPES)
def test_dirt_leaves_a_tenth_of_the_life_whatever_the_film(kind):
    """SKF's catalogue says so of its diagrams: towards zero the factor tends to 0.1 for all viscosity ratios."""
    for ratio in (0.1, 0.3, 1.0, 4.0):
        assert life_factor(ratio, 0.0, kind) == pytest.approx(0.1)
        assert life_factor(ratio, 1e-9, kind) == pytest.approx(0.1, rel=0.02)


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("ratio", [0.4, 1.0])
def test_the_factor_goes_on_where_one_branch_meets_the_next(kind, ratio):
    """The constants of each branch were fitted by themselves: a mistyped one would show as a step."""
    for load in (0.01, 0.1, 0.3):
        below, above = (life_factor(ratio * (1.0 + step), load, kind) for step in (-1e-6, 1e-6))
        assert below == pytest.approx(above, rel=2e-3)


@pytest.mark.parametrize("kind", TYPES)
def test_film_and_cleanliness_lengthen_the_life_up_to_fifty_times(kind):
    ratios, loads = np.geomspace(0.1, 4.0, 30), np.geomspace(1e-3, 5.0, 30)
    table = np.array([[life_factor(ratio, load, kind) for load in loads] for ratio in ratios])
    assert np.all(np.diff(table, axis=0) >= -1e-3 * table[:-1])
    assert np.all(np.diff(table, axis=1) >= -1e-3)
    assert table.max() == LARGEST_FACTOR
    assert life_factor(9.0, 0.1, kind) == life_factor(4.0, 0.1, kind)
    assert life_factor(0.01, 0.1, kind) == life_factor(0.1, 0.1, kind)


def test_viscosity_of_an_oil_between_its_two_temperatures():
    """VG 220: 220 and 19 mm2/s; at 80 degrees a rating program prints 30.09 mPa s at 890 kg/m3 at 15 degrees."""
    assert viscosity_at(40.0, 220.0, 19.0) == pytest.approx(220.0)
    assert viscosity_at(100.0, 220.0, 19.0) == pytest.approx(19.0)
    density = 890.0 - 0.7 * 65.0
    assert 1e-3 * density * viscosity_at(80.0, 220.0, 19.0) == pytest.approx(30.09, rel=1e-3)


def test_needed_viscosity_goes_on_at_a_thousand_turns():
    """45000 n^-0.83 below, 4500 n^-0.5 above: they meet within 3 %."""
    slow, fast = (viscosity_ratio(20.0, n * math.pi / 30.0, 0.1) for n in (999.9, 1000.1))
    assert slow == pytest.approx(fast, rel=0.03)
    assert viscosity_ratio(40.0, 50.0, 0.1) == pytest.approx(2.0 * viscosity_ratio(20.0, 50.0, 0.1))


def test_cleaner_oil_and_larger_bearings_have_larger_factors():
    small, large = ([contamination_factor(one, size) for one in CONTAMINATION] for size in (0.05, 0.2))
    assert small == sorted(small, reverse=True) and large == sorted(large, reverse=True)
    assert all(one <= other for one, other in zip(small, large, strict=True))


def test_fatigue_limits_fall_with_size():
    for kind, share in (("cylindrical_roller", 8.2), ("deep_groove_ball", 22.0)):
        assert fatigue_limit(100e3, 0.08, kind) == pytest.approx(100e3 / share)
        assert fatigue_limit(100e3, 0.3, kind) < 100e3 / share
