"""Waterfalls: amplitude spectra of a run-up over the speed of the reference shaft.

Amplitudes are peak amplitudes of a sine; levels are ``20 log10(amplitude / reference)`` in dB. Speeds are those of the
reference shaft as in `exugear.results.spectra.orders`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.parts import RPM
from exugear.results.spectra.orders import OrderLine
from exugear.results.spectra.spectrum import amplitude_spectrum, sweep_limited_resolution
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed, TitledRows, value_range


@dataclass(frozen=True)
class Waterfall(Displayed, line=": {time.size} spectra of {frequency.size} lines, {_spans}, {description}"):
    """Spectra over the speed of the reference shaft."""

    time: Floats
    speed: Floats
    """(n,) middle of each window, s, and the speed there, rad/s."""
    frequency: Floats
    """(m,) Hz."""
    amplitude: Floats
    """(n, m) peak amplitudes in `unit`."""
    window: str
    """Name of the window."""
    window_length: float
    """s."""
    overlap: float
    """Share of a window that the next one repeats."""
    reference: float
    """Amplitude of 0 dB in `unit`."""
    unit: str
    """Unit of signal and reference."""

    def _table(self) -> TitledRows:
        rows = {
            "spectra": str(self.time.size),
            "spectral lines": str(self.frequency.size),
            "time": value_range(self.time, "s"),
            "speed of the reference shaft": value_range(self.speed, "rpm", 1.0 / RPM),
            "frequency": value_range(self.frequency, "Hz"),
            "level": value_range(self.level, f"dB re {self.reference_text}"),
            "analysis": self.description,
        }
        return "Waterfall", rows

    @property
    def _spans(self) -> str:
        speed = value_range(self.speed, "rpm", 1.0 / RPM)
        return f"{speed}, {value_range(self.frequency, 'Hz')}"

    @cached_property
    def level(self) -> Floats:
        """Level in dB, shape (n, m); silence ends 200 dB below the reference."""
        return 20.0 * np.log10(np.maximum(self.amplitude / self.reference, 1e-10))

    @cached_property
    def _along(self) -> dict[OrderLine, Floats]:
        """Levels along the order lines that were asked for."""
        return {}

    def along(self, line: OrderLine) -> Floats:
        """Level (dB) along an order line as `line_level` finds it, shape (n,); each line is looked for once."""
        if line not in self._along:
            self._along[line] = line_level(self, line)
        return self._along[line]

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
        frequency = line.frequency(self.speed)
        # One frame alone tells of no sweep.
        rate = np.gradient(frequency, self.time) if self.time.size > 1 else np.zeros(1)
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
    values, speed : (n,)
        Signal and speed of the reference shaft (rad/s), uniformly sampled from time zero on. A signal in single
        precision is analysed so.
    rate : sampling rate, Hz
    window_length : s; `sweep_matched_window` of the fastest order of interest is the natural choice
    overlap : share of each window that the next repeats, in [0, 1)
    window : name of a SciPy window
    reference : amplitude of 0 dB, in `unit`
    unit : unit of the signal

    Returns
    -------
    the mean of each window is removed: the static deflection is no vibration

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
    signal = np.asarray(values)
    shaft = np.asarray(speed, dtype=np.float64)
    length = round(window_length * rate)
    if signal.shape != shaft.shape or signal.ndim != 1:
        raise ValueError(f"values {signal.shape} and speed {shaft.shape} must be two rows of equal length")
    if length < 8 or signal.size < length:
        raise ValueError(f"window_length = {window_length} s is {length} samples: it needs 8 to {signal.size}")
    if not 0.0 <= overlap < 1.0:
        raise ValueError(f"overlap = {overlap} must lie in [0, 1)")
    frames = overlapping_frames(signal, length, overlap)
    # Twice the spectral lines: a tone between two lines would lose up to 1.4 dB, so it loses 0.4 dB.
    centred = frames - frames.mean(axis=1, keepdims=True)
    frequency, amplitude = amplitude_spectrum(centred, rate, window, padding=2)
    return Waterfall(
        time=overlapping_frames(np.arange(signal.size) / rate, length, overlap).mean(axis=1),
        speed=np.abs(overlapping_frames(shaft, length, overlap).mean(axis=1)),
        frequency=frequency,
        amplitude=amplitude,
        window=window,
        window_length=length / rate,
        overlap=overlap,
        reference=reference,
        unit=unit,
    )


def overlapping_frames(values: Floats, length: int, overlap: float) -> Floats:
    """Cut a signal into overlapping frames, shape (frames, length), without a copy."""
    hop = max(1, round(length * (1.0 - overlap)))
    return np.lib.stride_tricks.sliding_window_view(values, length)[::hop]


def line_level(spectra: Waterfall, line: OrderLine) -> Floats:
    """Level along an order line.

    Parameters
    ----------
    spectra : the run
    line : the order

    Returns
    -------
    (n,)
        Highest level within half the resolution to both sides of the line, dB; NaN where the line lies above
        the band or so low (four spectral widths) that the window cannot tell it from the mean.
    """
    frequency = line.frequency(spectra.speed)
    resolution = spectra.resolution(line)
    spacing = float(spectra.frequency[1])
    reach = int(np.max(np.ceil(0.5 * resolution / spacing)))
    nearest = np.rint(frequency / spacing).astype(np.int64)
    index = nearest[:, None] + np.arange(-reach, reach + 1)
    last = spectra.frequency.size - 1
    # The nearest spectral line always counts; half a resolution is at least that.
    near = np.abs(index * spacing - frequency[:, None]) <= np.maximum(0.5 * resolution, 0.5 * spacing)[:, None]
    level = np.take_along_axis(spectra.level, np.clip(index, 0, last), axis=1)
    highest: Floats = np.where(near, level, -np.inf).max(axis=1)
    inside = (frequency > 4.0 / spectra.window_length) & (nearest <= last)
    return np.where(inside, highest, np.nan)
