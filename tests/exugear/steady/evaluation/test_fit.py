"""Fits to levels of resonances whose frequency and damping are known, with errors as measurements have them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from exugear.steady.evaluation.fit import FitError, fit_levels

SPEED = np.linspace(0.4, 1.6, 240)
MODES = np.array([[0.7, 0.9, 1.1], [0.8, 1.0, 1.3], [0.75, 1.2, 1.4]])
"""Natural frequencies that three orders of each of three channels cross, relative to the parameter."""
TRUE = {"frequency": 1.06, "damping": 0.025}
START = {"frequency": 1.0, "damping": 0.04}


def levels(at: Mapping[str, float]) -> np.ndarray:
    """Levels of nine oscillators, (channels, lines, windows), dB."""
    ratio = SPEED / (MODES[..., None] * at["frequency"])
    return -10.0 * np.log10((1.0 - ratio**2) ** 2 + (2.0 * at["damping"] * ratio) ** 2)


def measured(seed: int, gain: float = 1.0, waviness: float = 0.5) -> np.ndarray:
    """True levels with a gain of each channel (dB) and waviness along each cut (dB, correlated over 20 windows)."""
    rng = np.random.default_rng(seed)
    window = np.exp(-0.5 * (np.arange(-60, 61) / 20.0) ** 2)
    window /= np.sqrt((window**2).sum())
    noise = rng.standard_normal((*MODES.shape, SPEED.size + 120))
    wavy = np.apply_along_axis(lambda own: np.convolve(own, window, "valid"), 2, noise)
    return levels(TRUE) + gain * rng.standard_normal((3, 1, 1)) + waviness * wavy


def test_parameters_without_errors_are_found_in_spite_of_gains() -> None:
    fit = fit_levels(levels, measured(0, waviness=0.0), np.ones((3, 3, 240), bool), START)
    assert [own.value for own in fit.parameters] == pytest.approx([*TRUE.values()], rel=1e-4)
    assert fit.after < 1e-3 < fit.before
    assert not any(own.refusal for own in fit.parameters)


def test_intervals_hold_the_truth_in_19_of_20_seeds() -> None:
    """With gains of 1 dB and waviness of 0.5 dB over 20 windows, for both parameters."""
    held = dict.fromkeys(TRUE, 0)
    for seed in range(20):
        for own in fit_levels(levels, measured(seed), np.ones((3, 3, 240), bool), START).parameters:
            held[own.key] += own.low <= TRUE[own.key] <= own.high
    assert min(held.values()) >= 19, held


def test_a_fit_finds_a_resonance_that_is_far_from_the_start() -> None:
    start = {"frequency": 0.7, "damping": 0.04}
    fit = fit_levels(levels, measured(3), np.ones((3, 3, 240), bool), start)
    assert fit.parameters[0].value == pytest.approx(1.06, rel=0.01)


def test_a_parameter_that_the_data_do_not_determine_is_refused() -> None:
    """Far below all resonances damping changes nothing; the frequency still bends the levels."""
    chosen = np.broadcast_to(SPEED < 0.5, (3, 3, 240))
    fit = fit_levels(levels, measured(1, waviness=0.1), chosen, START)
    refusals = {own.key: own.refusal for own in fit.parameters}
    assert refusals["damping"] != ""
    with pytest.raises(FitError, match="damping is not determined .*; fit the others alone"):
        _ = fit.changes


def test_a_value_at_the_end_of_its_range_is_refused() -> None:
    limits = {"frequency": (0.1, 1.03)}
    fit = fit_levels(levels, measured(1), np.ones((3, 3, 240), bool), START, limits)
    assert fit.parameters[0].value <= 1.03
    assert fit.parameters[0].refusal == "at the end of its range"


@pytest.mark.parametrize(
    ("start", "lines", "message"),
    [
        ({"frequency": -1.0}, 3, "one to 3 with positive values"),
        (dict.fromkeys("abcd", 1.0), 3, "4 parameters"),
        (START, 1, "3 orders of channels count; at least 6 are required"),
    ],
)
def test_a_fit_that_cannot_be_made_is_refused(start: dict[str, float], lines: int, message: str) -> None:
    chosen = np.zeros((3, 3, 240), bool)
    chosen[:, :lines] = True
    with pytest.raises(FitError, match=message):
        fit_levels(levels, measured(0), chosen, start)
