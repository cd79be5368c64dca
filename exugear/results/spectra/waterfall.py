"""Waterfalls: amplitude spectra of a run-up over the speed of the reference shaft, and the order lines in them.

Amplitudes are zero-to-peak amplitudes of a sine; levels are ``20 log10(amplitude / reference)`` in dB.

The reference shaft is that of the overall input. Its speeds are in rad/s and are used without sign: the line of order
``o`` is at the frequency ``o |speed| / 2 pi``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin, TitledRows, value_range
from fe_ste.tools.threads import available_cores, second_core_is_free

# Order lines: excitations with a constant number of periods per revolution of the reference shaft

SAME_ORDER = 1e-6
"""Relative difference up to which orders share a line."""


@dataclass(frozen=True)
class OrderLine:
    """A named line of constant order in a waterfall."""

    name: str
    """Name for legends and tables, such as ``"HS mesh"``."""
    order: float
    """Periods per revolution of the reference shaft."""

    def place(self, orders: Floats) -> int | None:
        """Index of the line among orders (n,); None if it is not included."""
        nearest = int(np.argmin(np.abs(orders - self.order)))
        if abs(orders[nearest] - self.order) <= SAME_ORDER * self.order:
            return nearest
        return None

    def frequency(self, speed: ArrayLike) -> Floats:
        """Frequency of the order line, Hz, at speeds of the reference shaft in rad/s."""
        return self.order * np.abs(np.asarray(speed, dtype=np.float64)) / (2.0 * math.pi)


def order_lines(gearbox: Gearbox, count: int = 3) -> tuple[OrderLine, ...]:
    """Order lines of all meshes with `count` harmonics; meshes of equal frequency (sun and ring) share a line.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [(line.name, round(line.order, 3)) for line in order_lines(gearbox, 1)]
    [('sun_planet', 99.0), ('intermediate', 468.571), ('high_speed', 1792.795)]
    """
    return tuple(OrderLine(name, order) for name, order in gearbox.mesh_orders(count).items())


# Amplitude spectra of signals, and the frequency resolution of a window for a sweeping tone


def amplitude_spectrum(values: ArrayLike, rate: float, window: str = "hann", padding: int = 1) -> tuple[Floats, Floats]:
    """One-sided amplitude spectrum.

    Parameters
    ----------
    values : (..., n) signal, along the last axis. Single precision is retained and takes half the time.
    rate : sampling rate, Hz
    window : name of a SciPy window; amplitudes between bins err by up to 0.1 % (``"flattop"``) or 15 % (``"hann"``)
    padding : length after zero padding divided by `n`; it adds spectral lines without improving the resolution

    Returns
    -------
    frequency : (padding n // 2 + 1,) Hz
    amplitude : (..., padding n // 2 + 1) zero-to-peak amplitude of a sine at that frequency; at frequency zero the mean

    Examples
    --------
    >>> time = np.arange(1000) / 1000.0
    >>> frequency, amplitude = amplitude_spectrum(3.0 * np.cos(2 * np.pi * 50.0 * time), 1000.0)
    >>> float(frequency[50]), round(float(amplitude[50]), 12)
    (50.0, 3.0)
    """
    import scipy.signal  # imported here because it loads all of scipy.stats

    signal = np.asarray(values)
    kind = np.float32 if signal.dtype == np.float32 else np.float64
    count = padding * signal.shape[-1]
    weights = scipy.signal.get_window(window, signal.shape[-1])  # periodic, so that a tone at a bin is exact
    scaled = (2.0 / weights.sum() * weights).astype(kind)
    # Each frame is transformed by itself: the same numbers with any number of threads.
    threads = available_cores() if second_core_is_free() else 1
    amplitude: Floats = np.abs(scipy.fft.rfft(signal * scaled, n=count, axis=-1, workers=threads))
    amplitude[..., 0] *= 0.5
    if count % 2 == 0:
        amplitude[..., -1] *= 0.5
    frequency = np.arange(amplitude.shape[-1]) * (rate / count)
    return frequency, amplitude


def sweep_limited_resolution(sweep_rate: ArrayLike) -> Floats:
    """Finest frequency resolution of a sweeping tone, Hz: the square root of its sweep rate (Hz/s).

    During a window T the tone sweeps over rate x T, while the window resolves 1/T; both are equal at the optimum.

    Examples
    --------
    >>> float(np.round(sweep_limited_resolution(214.0), 1))
    14.6
    """
    resolution: Floats = np.sqrt(np.abs(np.asarray(sweep_rate, dtype=np.float64)))
    return resolution


def sweep_matched_window(sweep_rate: float) -> float:
    """Window length, s, with the best resolution for a tone that sweeps at a rate (Hz/s).

    Examples
    --------
    >>> round(1e3 * sweep_matched_window(214.0))  # milliseconds
    68
    """
    if not abs(sweep_rate) > 0.0:
        raise ValueError("sweep rate = 0: set the window length")
    return 1.0 / math.sqrt(abs(sweep_rate))


@dataclass(frozen=True)
class Waterfall(ReprMixin, line=": {time.size} spectra of {frequency.size} lines, {_spans}, {description}"):
    """Spectra over the speed of the reference shaft."""

    time: Floats
    speed: Floats
    """(n,) centre of each window, s, and the speed there, rad/s."""
    frequency: Floats
    """(m,) frequencies, Hz."""
    amplitude: Floats
    """(n, m) zero-to-peak amplitudes in `unit`."""
    window: str
    """Name of the window function."""
    window_length: float
    """Length of the window, s."""
    overlap: float
    """Overlap of adjacent windows as a fraction of their length."""
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
        """Level in dB, shape (n, m); the lower limit is 200 dB below the reference."""
        return self.level_of(self.amplitude)

    def level_of(self, amplitude: Floats) -> Floats:
        """Level of some amplitudes, dB: of a few it takes less time than the level of all."""
        return 20.0 * np.log10(np.maximum(amplitude / self.reference, 1e-10))

    @cached_property
    def _along(self) -> dict[OrderLine, Floats]:
        """Levels along the order lines that have been evaluated."""
        return {}

    def along(self, line: OrderLine) -> Floats:
        """Level (dB) along an order line from `line_level`, shape (n,); each line is evaluated once."""
        if line not in self._along:
            self._along[line] = line_level(self, line)
        return self._along[line]

    @property
    def description(self) -> str:
        """Window, overlap and reference as text, for captions."""
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

        It is the larger of one over the window length and the resolution that the sweep rate of the order permits.
        """
        frequency = line.frequency(self.speed)
        # No sweep rate follows from a single frame.
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
        Signal and speed of the reference shaft (rad/s), uniformly sampled from time zero. Single precision is retained.
    rate : sampling rate, Hz
    window_length : s; `sweep_matched_window` of the fastest order of interest is the natural choice
    overlap : overlap of adjacent windows, in [0, 1)
    window : name of a SciPy window
    reference : amplitude of 0 dB, in `unit`

    Returns
    -------
    the mean of each window is removed, because the static deflection is not vibration

    Raises
    ------
    ValueError
        The window has fewer than eight samples or the signal is shorter than one window.

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
        raise ValueError(f"window_length = {window_length} s is {length} samples; 8 to {signal.size} are required")
    if not 0.0 <= overlap < 1.0:
        raise ValueError(f"overlap = {overlap} must lie in [0, 1)")
    frames = overlapping_frames(signal, length, overlap)
    # Zero padding doubles the number of spectral lines: a tone between two lines then loses 0.4 dB instead of 1.4 dB.
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

    Returns
    -------
    (n,)
        Highest level within half the resolution on both sides of the line, dB; NaN where the line is above the band,
        or so low (four spectral widths) that the window cannot separate it from the mean.
    """
    frequency = line.frequency(spectra.speed)
    resolution = spectra.resolution(line)
    spacing = float(spectra.frequency[1])
    reach = int(np.max(np.ceil(0.5 * resolution / spacing)))
    nearest = np.rint(frequency / spacing).astype(np.int64)
    index = nearest[:, None] + np.arange(-reach, reach + 1)
    last = spectra.frequency.size - 1
    # The nearest spectral line is always included; half a resolution is at least that.
    near = np.abs(index * spacing - frequency[:, None]) <= np.maximum(0.5 * resolution, 0.5 * spacing)[:, None]
    amplitude = np.take_along_axis(spectra.amplitude, np.clip(index, 0, last), axis=1)
    highest: Floats = spectra.level_of(np.where(near, amplitude, 0.0).max(axis=1))
    inside = (frequency > 4.0 / spectra.window_length) & (nearest <= last)
    return np.where(inside, highest, np.nan)
