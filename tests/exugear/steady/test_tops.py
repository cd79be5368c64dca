"""Speeds that are added between others: tops of curves in closed form, and crossings that the speeds do not resolve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize

from exugear.steady.crossings import Crossing, with_crossings
from exugear.steady.harmonics.branches import beside_jumps
from exugear.steady.mean_system.signals import quantities_of
from exugear.steady.tops import ResponseCurves, higher_between, missed_tops

SPEED = np.linspace(0.5, 1.5, 41)
DAMPING = 0.01


def surface(speed):
    """Root mean square over two halves of a surface that vibrate in two modes, the higher one at a speed of 1.011."""
    low, high = (1.0 / (top**2 - speed**2 + 2j * DAMPING * top * speed) for top in (0.93, 1.011))
    return np.sqrt(0.5 * (np.abs(0.4 * low + high) ** 2 + np.abs(0.4 * low - 0.8 * high) ** 2))


def curves_of(values, **changes):
    """A mean, and one line of the surface velocity."""
    amplitude = np.stack([np.zeros_like(values), values], axis=1)[..., None].astype(np.complex64)
    quantities = quantities_of(["surface_velocity"], ())
    smooth = np.ones(len(SPEED), dtype=bool)
    return replace(
        ResponseCurves(SPEED, amplitude, smooth, np.zeros(len(SPEED), dtype=bool), quantities, None, DAMPING), **changes
    )


def test_the_top_of_the_surface_velocity_is_that_of_its_square():
    """It has no phase: as a curve of its own it has no poles near the speeds."""
    top = scipy.optimize.minimize_scalar(lambda at: -surface(at), bounds=(1.0, 1.02), method="bounded")
    assert surface(SPEED).max() < 0.95 * surface(top.x)
    found = missed_tops(curves_of(surface(SPEED)))
    assert np.abs(found - top.x).min() < 1e-3
    assert surface(found[np.abs(found - top.x).argmin()]) == pytest.approx(surface(top.x), rel=5e-3)
    left_out = higher_between(curves_of(surface(SPEED)), {})
    assert left_out[0].rank == 1
    assert left_out[0].excess == pytest.approx(surface(top.x) / surface(SPEED).max() - 1.0, rel=0.1)


def test_lines_above_the_band_of_the_housing_ask_for_no_speeds():
    curves = curves_of(surface(SPEED), audible=np.zeros((len(SPEED), 2), dtype=bool))
    assert not missed_tops(curves).size
    assert not higher_between(curves, {})


def test_neighbours_with_contact_loss_predict_no_top():
    smooth = np.abs(SPEED - 1.0) > 0.1
    assert not missed_tops(curves_of(surface(SPEED), smooth=smooth), {}).size


def test_a_jump_among_neighbours_predicts_no_top_and_is_no_peak():
    """As where sidebands are left out below a speed: the curves on either side have nothing in common."""
    kinds = SPEED < 1.0
    jumps = beside_jumps(kinds)
    assert not missed_tops(curves_of(surface(SPEED), jumps=jumps), {}).size
    falling = np.where(kinds, 1e-6, 1.0 / SPEED**2)
    quantity = curves_of(falling).quantities[0]
    beside = int(np.flatnonzero(~kinds)[0])
    assert quantity.peaks(falling[:, None]) == [(beside, 0)]
    assert quantity.peaks(falling[:, None], curves_of(falling, jumps=jumps).ranked) == []


@pytest.mark.parametrize(("share", "count"), [(1e-5, 2), (1e-7, 1)])
def test_peaks_of_round_off_are_left_out(share, count):
    """So are those below what counts as vibration, 1e-12 m/s, however low the others are."""
    peak = surface(SPEED)
    sizes = np.stack([peak, share * peak[::-1]], axis=1)
    (quantity,) = quantities_of(["surface_velocity"], ())
    lines = [line for _, line in quantity.peaks(sizes)]
    assert set(lines) == set(range(count)) and lines == sorted(lines)
    assert quantity.peaks(1e-15 * sizes) == []


@pytest.mark.parametrize(("damping", "is_added"), [(0.01, True), (0.03, False)])
def test_crossings_with_resonances_wider_than_a_step_are_left_out(damping, is_added):
    """At a speed of 1.011 half a step of 0.025 is as wide as a resonance of 1.24 % damping."""
    crossing = Crossing(speed=1.011, line=1, mode=0, frequency=100.0, damping=damping, share=1.0)
    assert (len(with_crossings(SPEED, (crossing,), 0.5)) > len(SPEED)) == is_added
    assert len(with_crossings(SPEED, (crossing,))) == len(SPEED) + 1
