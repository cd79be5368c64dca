"""Transmission error of a gear train from the pulses of two encoders, those of its input and of its output.

The angle of each shaft is known at its pulses. A cubic spline through them has it at any time, and the difference of
the output from the ideal ratio is the transmission error. Pulses are neither smoothed nor are their places learned:
mesh orders are multiples of the orders of shafts, and what is learned of them is lost to the transmission error.
"""

from __future__ import annotations

import numpy as np

from exugear.results.order_tracking.shaft_angle import SpeedSignalError, counted_pulses, pulse_times
from fe_ste.tools.arrays import Floats

FEWEST_SAMPLES = 4.0
"""Least number of samples of a pulse; edges are within a sample else, of which the spline makes noise."""
FEWEST_LINES = 4.0
"""Least number of lines of an encoder in a period of an order: a cubic spline lowers it by 0.13 dB then."""


def encoder_angle(values: Floats, rate: float, lines: int, at: Floats) -> Floats:
    """Angle of a shaft by its encoder at times (s) since the first sample, rad, without sign.

    Before the first pulse and after the last one it is that of the nearest one.

    Parameters
    ----------
    values : (n,) signal of the encoder, one period for each line, in any unit
    rate : sampling rate, Hz
    lines : lines of the encoder: pulses per revolution

    Raises
    ------
    SpeedSignalError
        There are too few pulses, or too few samples of each.

    Examples
    --------
    >>> time = np.arange(20000) / 20000.0
    >>> angle = 2.0 * np.pi * (3.0 * time + time**2)
    >>> found = encoder_angle(np.sin(500.0 * angle), 20000.0, 500, time)
    >>> bool(np.ptp((found - angle)[100:-100]) < 1e-4)
    True
    """
    from scipy.interpolate import CubicSpline

    train = counted_pulses(pulse_times(values, rate))
    shortest = float(np.quantile(np.diff(train.time) / np.diff(train.count), 0.01)) * rate
    if shortest < FEWEST_SAMPLES:
        raise SpeedSignalError(
            f"has {shortest:.2g} samples of a pulse at the highest speed; at least {FEWEST_SAMPLES:g} are required, so "
            f"record at {rate * FEWEST_SAMPLES / shortest:.3g} Hz or more"
        )
    spline = CubicSpline(train.time, (2.0 * np.pi / lines) * train.count)
    return np.asarray(spline(np.clip(at, train.time[0], train.time[-1])))


def check_lines(lines: int, order: float, name: str) -> None:
    """Refuse an encoder whose lines do not resolve an order.

    Parameters
    ----------
    lines : lines of the encoder
    order : highest order that is compared, per revolution of its shaft
    name : of that order

    Raises
    ------
    SpeedSignalError
        A period of the order has fewer than four lines.
    """
    if lines < FEWEST_LINES * order:
        raise SpeedSignalError(
            f"has {lines / order:.2g} lines in a period of {name}; at least {FEWEST_LINES:g} are required, so set "
            f"fewer harmonics, or use an encoder with {int(np.ceil(FEWEST_LINES * order))} lines"
        )


def error_of_angles(first: Floats, second: Floats, ratio: float) -> Floats:
    """Transmission error as an angle of the output, rad, by the angles of input and output, without its mean.

    Parameters
    ----------
    first, second : (n,) angles of input and output, rad, without sign
    ratio : output over input speed

    Examples
    --------
    >>> angle = np.linspace(0.0, 20.0, 1001)
    >>> error = error_of_angles(angle, 0.5 * angle + 1e-5 * np.cos(angle), -0.5)
    >>> round(1e6 * float(np.ptp(error)), 1)
    20.0
    """
    error = second - abs(ratio) * first
    return np.asarray(error - error.mean())
