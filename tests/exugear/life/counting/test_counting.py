"""Counting: the standard's example, equality of bins and series, and stored figures of a turbine file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from exugear.exchange.series_files import read_channels
from exugear.life.load_spectrum.counting import (
    Rainflow,
    equivalent_load,
    equivalent_range,
    load_duration,
    rainflow,
    reversals,
)

EXAMPLE = Path(__file__).parents[4] / "cases/grc750/loads"


def test_rainflow_gives_the_example_of_astm_e1049():
    """ASTM E1049-85, 5.4.4, figure 6: half a cycle of 3, one and a half of 4, half of 6, one of 8, half of 9."""
    ranges, means, counts = rainflow(np.array([-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0]))
    found = {size: counts[ranges == size].sum() for size in np.unique(ranges)}
    assert found == {3.0: 0.5, 4.0: 1.5, 6.0: 0.5, 8.0: 1.0, 9.0: 0.5}
    assert means[ranges == 9.0] == pytest.approx([0.5])


def test_rainflow_counts_every_reversal_half_once():
    series = np.random.default_rng(3).normal(size=2000)
    _, _, counts = rainflow(series)
    assert counts.sum() == pytest.approx(0.5 * (len(reversals(series)) - 1))


@pytest.mark.parametrize("pieces", [1, 2, 7, 500, 2000])
def test_a_series_in_pieces_has_the_cycles_of_the_whole(pieces):
    """Pieces of any length, those of one sample and of equal samples among them."""
    series = np.round(3.0 * np.random.default_rng(5).normal(size=2000))
    series[700:760] = series[700]
    count = Rainflow()
    for piece in np.array_split(series, pieces):
        count.add(piece)
    for part, whole in zip(count.cycles(), rainflow(series), strict=True):
        assert np.array_equal(part, whole)


def test_a_series_that_never_turns_is_half_a_cycle_however_it_comes():
    for pieces in ([[0.0], [1.0], [2.0]], [[0.0, 0.0], [], [0.0, 2.0, 2.0], [2.0]]):
        count = Rainflow()
        for piece in pieces:
            count.add(np.array(piece))
        assert [one.tolist() for one in count.cycles()] == [[2.0], [1.0], [0.5]]
    still = Rainflow()
    still.add(np.ones(4))
    assert len(still.cycles()[0]) == 0


def test_damage_equivalent_ranges_of_a_turbine_file():
    """Test1 of pCrunch by the package rainflow 3.2 (same cycles, no bins): slopes 3, 6.6, 10, one cycle a second."""
    series = read_channels(EXAMPLE / "oc3_hywind_test1.outb")
    torque = 1e-3 * series.channel("RotTorq", "torque")
    seconds = series.time[-1] - series.time[0]
    sizes, _, counts = rainflow(torque)
    ranges = [equivalent_range(sizes, counts, m, seconds) for m in (3.0, 6.6, 10.0)]
    assert ranges == pytest.approx([298.07, 820.95, 1141.66], rel=2e-5)


def turbine() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    files = [read_channels(EXAMPLE / f"oc3_hywind_test{number}.outb") for number in (1, 2, 3)]
    torque = np.concatenate([one.channel("RotTorq", "torque") for one in files])
    speed = np.concatenate([one.channel("RotSpeed", "speed") for one in files])
    return torque, speed, np.full(len(torque), 0.1 / 3600.0)


@pytest.mark.parametrize("exponent", [4.0, 13.22])
def test_bins_do_the_damage_of_the_series(exponent):
    """64 bins at the mean of their revolutions: within 0.1 % of all samples by themselves, as bins are narrow."""
    torque, speed, hours = turbine()
    found = load_duration(torque, speed, hours, 64)
    binned = equivalent_load(found.torque, found.revolutions, exponent)
    assert binned == pytest.approx(equivalent_load(torque, speed * hours, exponent), rel=1e-3)
    assert equivalent_load(found.upper, found.revolutions, exponent) > 1.005 * binned  # the upper edge adds damage


def test_bins_keep_hours_and_revolutions():
    torque, speed, hours = turbine()
    found = load_duration(torque, speed, hours, 64)
    assert found.hours.sum() == pytest.approx(hours.sum())
    assert found.revolutions.sum() == pytest.approx((speed * hours).sum() * 3600.0 / (2.0 * np.pi))


def test_a_reversed_torque_has_bins_of_its_own():
    found = load_duration(np.array([10.0, -10.0, -4.0]), np.ones(3), np.ones(3), 5)
    assert found.torque.tolist() == [-10.0, -4.0, 10.0]
    assert np.all(np.abs(found.upper) > np.abs(found.lower))
