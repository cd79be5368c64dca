"""A steady-state response as a run-up shows it: swept along its speed, and averaged under its windows.

For an order n whose force does not depend on the speed, the steady-state amplitude H(f) is a transfer function. With
the angle a(t) of a run-up, the order is

    y(t) = F^-1 { H(f) F { exp(i n a(t)) } },

and its cut is the mean of y(t) exp(-i n a(t)) under the window of the measurement. A cut and a steady-state response
differ by several dB at lightly damped resonances; a cut and the swept response do not. Contact loss and friction that
depends on speed are outside of this model.
"""

from __future__ import annotations

import numpy as np
import scipy.fft

from exugear.results.order_tracking.angle_cuts import AngleWindow, mean_over_angle
from exugear.results.order_tracking.shaft_angle import ShaftAngle
from fe_ste.tools.arrays import Complexes, Floats

BAND = 1.3
"""Highest frequency that is computed over that of the order at the highest speed."""
HELD = 0.5
"""Time for which the first and the last speed are held before and after the run, s, so that no transient enters."""
STEPS_PER_SPEED = 16
"""Number of interpolated values between two speeds of the steady-state response."""


def swept_cut(
    speed: Floats, amplitude: Complexes, order: float, shaft: ShaftAngle, window: AngleWindow, per: float = 1.0
) -> Complexes:
    """Order cut that a run-up shows of a steady-state response.

    Parameters
    ----------
    speed : (m,) speeds of the steady-state response, rad/s, positive, ascending
    amplitude : (channels, m) complex amplitudes at these speeds, relative to cos(order angle)
    order : periods per revolution of `shaft`
    shaft : angle over time of the measured run-up
    window, per : as of `exugear.results.order_tracking.angle_cuts.angle_cuts`

    Returns
    -------
    (channels, frames) complex amplitudes in the frames of the measured cut

    Examples
    --------
    Far from resonances a slow run-up shows the steady state:

    >>> from exugear.results.order_tracking.shaft_angle import angle_of_speed
    >>> shaft = angle_of_speed(np.linspace(50.0, 100.0, 60000), 1000.0)
    >>> speed = np.linspace(40.0, 110.0, 50)
    >>> cut = swept_cut(speed, speed[None] * (0.5 + 0.1j), 5.0, shaft, AngleWindow(8.0))
    >>> bool(abs(cut[0, 100] / cut[0, 100].real - (1.0 + 0.2j)) < 1e-3)
    True
    """
    top = BAND * order * float(shaft.speed.max()) / (2.0 * np.pi) + 50.0
    every = max(1, int(shaft.rate / (2.0 * top)))
    coarse = ShaftAngle(shaft.rate / every, 0, shaft.angle[::every], shaft.speed[::every])
    angle, held = coarse.angle, max(8, int(HELD * coarse.rate))
    before = angle[0] - coarse.speed[0] / coarse.rate * np.arange(held, 0, -1)
    after = angle[-1] + coarse.speed[-1] / coarse.rate * np.arange(1, held + 1)
    excitation = np.exp(1j * order * np.concatenate([before, angle, after]))
    fade = 0.5 - 0.5 * np.cos(np.pi * np.arange(held // 2) / (held // 2))
    excitation[: held // 2] *= fade
    excitation[-(held // 2) :] *= fade[::-1]
    size = scipy.fft.next_fast_len(excitation.size)
    spectrum = scipy.fft.fft(excitation, size)
    # The excitation turns one way only: its band begins at zero and ends at the sampling rate.
    frequency = np.arange(size) * coarse.rate / size
    frequency = np.where(frequency > 0.95 * coarse.rate, frequency - coarse.rate, frequency)
    transfer = _interpolated(speed, amplitude, 2.0 * np.pi * frequency / order)
    back = excitation[held : held + angle.size].conj()
    envelope = np.empty((len(amplitude), angle.size), dtype=np.complex128)
    for own, values in zip(envelope, transfer, strict=True):
        values *= spectrum
        own[:] = scipy.fft.ifft(values, overwrite_x=True)[held : held + angle.size]
        own *= back
    return mean_over_angle(envelope, coarse, window, per)


def _interpolated(speed: Floats, amplitude: Complexes, at: Floats) -> Complexes:
    """Amplitudes (channels, k) at speeds (k,), those at the ends beyond them.

    Interpolation is monotone cubic between the speeds, and linear between its closely spaced values.
    """
    from scipy.interpolate import PchipInterpolator

    steps = np.arange(STEPS_PER_SPEED * (speed.size - 1) + 1) / STEPS_PER_SPEED
    fine = np.interp(steps, np.arange(speed.size), speed)
    real, imaginary = (PchipInterpolator(speed, part, axis=1)(fine) for part in (amplitude.real, amplitude.imag))
    known = real + 1j * imaginary
    place = np.interp(at, fine, np.arange(fine.size))
    before = np.minimum(place.astype(np.int64), fine.size - 2)
    share = place - before
    found = np.empty((len(amplitude), at.size), dtype=np.complex128)
    for own, values in zip(found, known, strict=True):
        own[:] = values[before]
        own += share * np.diff(values)[before]
    return found
