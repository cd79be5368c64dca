"""Swept steady-state responses, against oscillators that are integrated in time along the same run-up."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.results.order_tracking.angle_cuts import AngleWindow, angle_cuts
from exugear.results.order_tracking.shaft_angle import ShaftAngle
from exugear.results.spectra.waterfall import OrderLine
from exugear.steady.evaluation.swept import swept_cut
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import complex_amplitudes, steady_response

from ...results.order_tracking.test_angle_cuts import resonator
from ...results.order_tracking.test_shaft_angle import RATE, run_up

ORDER, FREQUENCY = 20.0, 500.0


@pytest.mark.parametrize(("seconds", "damping", "least"), [(60.0, 0.02, 0.7), (60.0, 0.005, 3.0), (6.0, 0.02, 0.7)])
@pytest.mark.parametrize("revolutions", [8.0, 32.0])
def test_a_swept_response_is_that_of_an_oscillator_in_time(seconds, damping, least, revolutions):
    """Within 0.02 dB where a steady response is up to several dB off, and with 6 s a sweep-rate ratio of 0.2.

    The force of the integration is linear between samples, which takes 0.02 dB off at 500 Hz and is allowed for.
    """
    time, _, angle = run_up(seconds, drift=0.0)
    shaft = ShaftAngle(RATE, 0, angle, np.gradient(angle, time))
    values = resonator(np.cos(ORDER * angle), FREQUENCY, damping)
    window = AngleWindow(revolutions)
    ((cut,),) = angle_cuts(values[None], shaft, [OrderLine("20", ORDER)], window)
    grid = np.concatenate([np.linspace(480.0, 3020.0, 1200), 1500.0 + np.linspace(-60.0, 60.0, 400)])
    speed = np.unique(grid) * np.pi / 30.0
    ratio = ORDER * speed / (2.0 * np.pi * FREQUENCY)
    steady = np.sinc(FREQUENCY * ratio / RATE) ** 2 / (1.0 - ratio**2 + 2j * damping * ratio)
    swept = swept_cut(speed, steady[None], ORDER, shaft, window)[0]
    count = min(swept.size, cut.amplitude.size)
    inside = slice(8, count - 8)  # the measurement begins at rest, the swept response at constant speed
    error = 20.0 * np.log10(np.abs(swept[:count]) / np.abs(cut.amplitude[:count]))[inside]
    plain = 20.0 * np.log10(np.interp(cut.speed, speed, np.abs(steady))[:count] / np.abs(cut.amplitude[:count]))[inside]
    assert np.abs(error).max() < 0.02
    if revolutions > 8.0:
        assert np.abs(plain).max() > least


@pytest.mark.parametrize("range_of_speeds", ["12:16:60", "-12:-16:60"])
def test_amplitudes_of_both_senses_of_rotation_lag_behind_their_force(grc: Gearbox, stiffness: dict, range_of_speeds):
    """A causal phase falls by about pi over a resonance, relative to the angle in the sense of rotation."""
    settings = SteadySettings(SpeedRange.from_text(range_of_speeds))
    data = steady_response(grc, Choice("rigid"), stiffness, settings=settings)
    speed, order = data["speed"].to_numpy(), data["order"].to_numpy()
    amplitude = complex_amplitudes(data)[:, 1:, 0]
    point, line = np.unravel_index(np.abs(amplitude).argmax(), amplitude.shape)
    own = amplitude[:, line]
    ascending = np.argsort(np.abs(speed))
    near = np.flatnonzero(np.abs(np.abs(speed[ascending]) / abs(speed[point]) - 1.0) < 0.01)
    phase = np.unwrap(np.angle(own[ascending][near].astype(complex)))
    assert order[line + 1] > 0.0
    assert near.size > 5
    assert -1.2 * np.pi < phase[-1] - phase[0] < -0.3
