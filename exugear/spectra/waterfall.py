"""Spectra of run-ups: waterfalls, order cuts, and the resonances that stand out in them.

Pure functions on arrays. Speeds are those of the reference shaft (the carrier) in rad/s and count by
magnitude; an order is a number of periods per turn of that shaft, so that a line of order ``o`` lies at
``o |speed| / 2 pi``. Amplitudes are peak amplitudes of a sine; levels are
``20 log10(amplitude / reference)`` in dB.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.signal
from numpy.typing import ArrayLike

from exugear.spectra.resampling import amplitude_spectrum, sweep_limited_resolution
from fe_ste.tools.arrays import Complexes, Floats


@dataclass(frozen=True)
class OrderLine:
    """A named line of constant order in a waterfall.

    Attributes
    ----------
    name : str
        For legends and tables, such as ``"HS mesh"``.
    order : float
        Periods per turn of the reference shaft.
    """

    name: str
    order: float

    def frequency(self, speed: ArrayLike) -> Floats:
        """Frequency on the line, Hz, at speeds of the reference shaft in rad/s."""
        return self.order * np.abs(np.asarray(speed, dtype=np.float64)) / (2.0 * math.pi)


def harmonics(name: str, order: float, count: int) -> tuple[OrderLine, ...]:
    """Lines of a mesh and its harmonics.

    Parameters
    ----------
    name : str
        Name of the first.
    order : float
        Order of the first.
    count : int
        How many, the first included.

    Returns
    -------
    tuple of OrderLine

    Examples
    --------
    >>> [(line.name, line.order) for line in harmonics("planetary", 99.0, 2)]
    [('planetary', 99.0), ('2 × planetary', 198.0)]
    """
    return tuple(
        OrderLine(name if number == 1 else f"{number} × {name}", number * order) for number in range(1, count + 1)
    )


@dataclass(frozen=True)
class Waterfall:
    """Spectra over the speed of the reference shaft.

    Attributes
    ----------
    time, speed : (n,) array
        Middle of each window, s, and the speed there, rad/s.
    frequency : (m,) array
        Hz.
    amplitude : (n, m) array
        Peak amplitudes in `unit`.
    window : str
        Name of the window.
    window_length : float
        s.
    overlap : float
        Share of a window that the next one repeats.
    reference : float
        Amplitude of 0 dB in `unit`.
    unit : str
        Unit of signal and reference.
    """

    time: Floats
    speed: Floats
    frequency: Floats
    amplitude: Floats
    window: str
    window_length: float
    overlap: float
    reference: float
    unit: str

    @cached_property
    def level(self) -> Floats:
        """Level in dB, shape (n, m); silence ends 200 dB below the reference."""
        return 20.0 * np.log10(np.maximum(self.amplitude / self.reference, 1e-10))

    @property
    def description(self) -> str:
        """Window, overlap and reference in words, for captions."""
        return (
            f"{self.window.capitalize()} window {1e3 * self.window_length:.3g} ms, "
            f"overlap {100 * self.overlap:.0f} %, 0 dB = {self.reference_text}"
        )

    @property
    def reference_text(self) -> str:
        """Amplitude of 0 dB with a metric prefix, such as 1 µm."""
        for prefix, factor in (("", 1.0), ("m", 1e-3), ("µ", 1e-6), ("n", 1e-9)):
            if self.reference >= 0.999 * factor:
                return f"{self.reference / factor:g} {prefix}{self.unit}"
        return f"{self.reference:g} {self.unit}"

    def resolution(self, line: OrderLine) -> Floats:
        """Frequency resolution along an order line, Hz, shape (n,).

        The wider of one over the window's length and what the sweep of that order allows.
        """
        rate = np.gradient(line.frequency(self.speed), self.time)
        resolution: Floats = np.maximum(sweep_limited_resolution(rate), 1.0 / self.window_length)
        return resolution


def waterfall(
    values: ArrayLike,
    speed: ArrayLike,
    rate: float,
    *,
    window_length: float,
    overlap: float = 0.75,
    window: str = "hann",
    reference: float = 1e-6,
    unit: str = "m",
) -> Waterfall:
    """Short-time spectra of a run-up.

    Parameters
    ----------
    values, speed : array_like, shape (n,)
        Signal and speed of the reference shaft (rad/s), uniformly sampled from time zero on.
    rate : float
        Sampling rate, Hz.
    window_length : float
        s; `sweep_matched_window` of the fastest order of interest is the natural choice.
    overlap : float
        Share of each window that the next repeats, in [0, 1).
    window : str
        Name of a SciPy window.
    reference : float
        Amplitude of 0 dB, in `unit`.
    unit : str
        Unit of the signal.

    Returns
    -------
    Waterfall
        The mean of each window is removed: the static deflection is no vibration.

    Raises
    ------
    ValueError
        If the window has fewer than eight samples or the signal is shorter than one window.

    Examples
    --------
    >>> time = np.arange(8000) / 2000.0
    >>> run = waterfall(np.sin(2 * np.pi * 300.0 * time), time, 2000.0, window_length=0.1, reference=1.0)
    >>> float(run.frequency[np.argmax(run.amplitude[0])]), round(float(run.amplitude.max()), 6)
    (300.0, 1.0)
    """
    signal, shaft = np.asarray(values, dtype=np.float64), np.asarray(speed, dtype=np.float64)
    length = round(window_length * rate)
    if signal.shape != shaft.shape or signal.ndim != 1:
        raise ValueError(f"values {signal.shape} and speed {shaft.shape} must be two rows of equal length")
    if length < 8 or signal.size < length:
        raise ValueError(f"window_length = {window_length} s is {length} samples: it needs 8 to {signal.size}")
    if not 0.0 <= overlap < 1.0:
        raise ValueError(f"overlap = {overlap} must lie in [0, 1)")
    frames = _frames(signal, length, overlap)
    # Twice the spectral lines: a tone between two lines would lose up to 1.4 dB, so it loses 0.4 dB.
    centred = frames - frames.mean(axis=1, keepdims=True)
    frequency, amplitude = amplitude_spectrum(centred, rate, window, padding=2)
    middle = _frames(np.arange(signal.size) / rate, length, overlap).mean(axis=1)
    return Waterfall(
        time=middle,
        speed=np.abs(_frames(shaft, length, overlap).mean(axis=1)),
        frequency=frequency,
        amplitude=amplitude,
        window=window,
        window_length=length / rate,
        overlap=overlap,
        reference=reference,
        unit=unit,
    )


def _frames(values: Floats, length: int, overlap: float) -> Floats:
    """Overlapping stretches of a signal, shape (frames, length), without a copy."""
    hop = max(1, round(length * (1.0 - overlap)))
    return np.lib.stride_tricks.sliding_window_view(values, length)[::hop]


@dataclass(frozen=True)
class OrderCut:
    """Amplitude and phase along an order.

    Attributes
    ----------
    line : OrderLine
        The order.
    time, speed, frequency : (n,) array
        Middle of each window, s; speed there, rad/s; frequency of the order there, Hz.
    amplitude : (n,) complex array
        Peak amplitude; its phase is that relative to ``cos(order * angle)``.
    """

    line: OrderLine
    time: Floats
    speed: Floats
    frequency: Floats
    amplitude: Complexes


def order_cut(
    values: ArrayLike,
    speed: ArrayLike,
    rate: float,
    line: OrderLine,
    *,
    window_length: float,
    overlap: float = 0.75,
    window: str = "hann",
) -> OrderCut:
    """Follow an order along the instantaneous speed.

    The signal is multiplied by ``exp(-i order angle)``, the angle being the integral of the speed, and
    averaged under a window. The order itself is at rest then: its amplitude comes out right however fast it
    sweeps.

    Parameters
    ----------
    values, speed : array_like, shape (n,)
        Signal and speed of the reference shaft (rad/s), uniformly sampled.
    rate : float
        Sampling rate, Hz.
    line : OrderLine
        The order to follow.
    window_length : float
        s; another order closer than about ``2 / window_length`` in Hz leaks in.
    overlap : float
        Share of each window that the next repeats, in [0, 1).
    window : str
        Name of a SciPy window.

    Returns
    -------
    OrderCut

    Examples
    --------
    >>> time = np.arange(4000) / 2000.0
    >>> speed = 2 * np.pi * (2.0 + 3.0 * time)  # 2 to 8 turns per second
    >>> angle = 2 * np.pi * (2.0 * time + 1.5 * time**2)
    >>> cut = order_cut(0.5 * np.cos(30 * angle), speed, 2000.0, OrderLine("30", 30.0), window_length=0.1)
    >>> bool(np.all(np.abs(np.abs(cut.amplitude) - 0.5) < 1e-3))
    True
    """
    signal, shaft = np.asarray(values, dtype=np.float64), np.asarray(speed, dtype=np.float64)
    length = round(window_length * rate)
    step = 0.5 * (np.abs(shaft[1:]) + np.abs(shaft[:-1])) / rate
    angle = np.concatenate([[0.0], np.cumsum(step)])
    turning_back = np.exp(-1j * line.order * angle)
    weights = scipy.signal.get_window(window, length)
    weights *= 2.0 / weights.sum()
    demodulated = signal * turning_back
    middle = _frames(np.arange(signal.size) / rate, length, overlap).mean(axis=1)
    mean_speed = np.abs(_frames(shaft, length, overlap).mean(axis=1))
    return OrderCut(
        line=line,
        time=middle,
        speed=mean_speed,
        frequency=line.frequency(mean_speed),
        amplitude=_frames(demodulated.real, length, overlap) @ weights
        + 1j * (_frames(demodulated.imag, length, overlap) @ weights),
    )
