"""Peaks of curves known at few places: their tops by closed forms, and which of them stand out."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
import scipy.optimize
import scipy.signal

from exugear.steady.harmonics.branches import predicted_tops, standing_peaks

SIZE = partial(np.linalg.norm, axis=-1)
"""Height of values (..., signals)."""


def two_modes(x, second):
    """Response of two lightly damped modes at 1 and at another place, of unlike size and sign."""
    return 1.0 / (1.0 - x**2 + 2j * 0.01 * x) - 0.3 / (second**2 - x**2 + 2j * 0.006 * second * x)


@pytest.mark.parametrize("second", [1.03, 1.08, 1.5])
def test_a_curve_through_five_places_knows_the_top_of_the_response_of_two_modes(second):
    """In x such a response has four poles and two near: those far away bend it by less than 1e-3 here."""
    x = np.array([0.97, 0.985, 0.996, 1.008, 1.022])
    top = scipy.optimize.minimize_scalar(lambda at: -abs(two_modes(at, second)), bounds=(0.99, 1.01), method="bounded")
    place, height = predicted_tops(x[None], two_modes(x, second)[None, :, None], 2, SIZE)
    assert place == pytest.approx([top.x], abs=1e-4)
    assert height == pytest.approx([-top.fun], rel=1e-3)


def test_several_signals_of_one_resonance_have_one_top():
    x = np.array([0.97, 0.985, 0.996, 1.008, 1.022])
    sizes = np.array([3.0, 4.0 * np.exp(0.5j)])
    place, height = predicted_tops(x[None], two_modes(x, 1.5)[None, :, None] * sizes, 2, SIZE)
    alone, own = predicted_tops(x[None], two_modes(x, 1.5)[None, :, None], 2, SIZE)
    assert (place, height) == (pytest.approx(alone, abs=1e-6), pytest.approx(5.0 * own, rel=1e-6))


def test_tops_of_several_curves_are_those_of_each_alone():
    """One of the curves rises no more between its neighbours, where the search of the others goes on."""
    x = np.array([[0.97, 0.985, 0.996, 1.008, 1.022], [0.96, 0.98, 1.0, 1.02, 1.04], [0.95, 0.97, 0.99, 1.02, 1.05]])
    values = two_modes(x, 1.5)[..., None]
    together = np.array(predicted_tops(x, values, 2, SIZE))
    alone = [np.ravel(predicted_tops(own[None], value[None], 2, SIZE)) for own, value in zip(x, values, strict=True)]
    np.testing.assert_allclose(together.T, alone, rtol=1e-12)


def test_a_top_beside_the_end_of_the_places_is_found_as_well():
    x = np.array([0.99, 1.008, 1.022, 1.05, 1.09])
    place, height = predicted_tops(x[None], two_modes(x, 1.5)[None, :, None], 1, SIZE)
    assert place == pytest.approx(1.0, abs=2e-3)
    assert height > abs(two_modes(x[1], 1.5))


def test_a_curve_whose_pole_is_less_damped_than_any_mode_predicts_no_top():
    """One value off by a tenth of a percent puts a pole next to the real axis where the response has no resonance."""
    x = np.linspace(0.4, 0.6, 11)[None]
    values = (1.0 + 0.02 * np.exp(-(((x - 0.5) / 0.1) ** 2))).astype(np.complex128)[..., None]
    values[0, 5] *= 1.001
    known = float(np.abs(values[0, 5, 0]))
    spurious = predicted_tops(x, values, 5, SIZE)[1]
    assert spurious > 1.5 * known
    place, height = predicted_tops(x, values, 5, SIZE, damping=0.005)
    assert (place, height) == (pytest.approx([0.5]), pytest.approx([known]))


@pytest.mark.parametrize("damping", [0.002, 0.01])
def test_a_damped_pole_is_kept(damping):
    x = np.array([0.97, 0.985, 0.996, 1.008, 1.022])
    values = (1.0 / (1.0 - x**2 + 2j * damping * x))[None, :, None]
    limited = predicted_tops(x[None], values, 2, SIZE, damping=0.5 * damping)
    np.testing.assert_array_equal(limited, predicted_tops(x[None], values, 2, SIZE))
    assert limited[1] == pytest.approx([0.5 / damping], rel=2e-3)


@pytest.mark.parametrize("stands", [0.0, 1e-4, 0.01, 0.5])
def test_peaks_stand_as_scipy_has_their_prominences(stands):
    """Random walks, rounded so that many neighbours are equal, and a plateau at either end."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        values = np.abs(np.round(rng.normal(size=120).cumsum(), 1))
        values[:2], values[-3:] = 9.0, 9.0
        places = scipy.signal.find_peaks(values)[0]
        stood = scipy.signal.peak_prominences(values, places)[0]
        assert standing_peaks(values, stands).tolist() == places[stood >= stands * values[places]].tolist()
