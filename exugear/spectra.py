"""Spectra of run-ups: waterfalls, order cuts, and the resonances that stand out in them.

Pure functions on arrays. Speeds are those of the reference shaft (the carrier) in rad/s and count by
magnitude; an order is a number of periods per turn of that shaft, so that a line of order ``o`` lies at
``o |speed| / 2 pi``. Amplitudes are peak amplitudes of a sine; levels are
``20 log10(amplitude / reference)`` in dB.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.interpolate
import scipy.signal
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


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

    def frequency(self, speed: ArrayLike) -> FloatArray:
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


def sweep_limited_resolution(sweep_rate: ArrayLike) -> FloatArray:
    """Finest frequency resolution of a tone that sweeps, Hz: the root of its rate (Hz/s).

    During a window T the tone sweeps over rate x T, while the window resolves 1/T: best where both are equal.

    Examples
    --------
    >>> float(np.round(sweep_limited_resolution(214.0), 1))
    14.6
    """
    resolution: FloatArray = np.sqrt(np.abs(np.asarray(sweep_rate, dtype=np.float64)))
    return resolution


def sweep_matched_window(sweep_rate: float) -> float:
    """Window length, s, that resolves a tone sweeping at a rate (Hz/s) best.

    Examples
    --------
    >>> round(1e3 * sweep_matched_window(214.0))  # milliseconds
    68
    """
    if not abs(sweep_rate) > 0.0:
        raise ValueError("sweep rate = 0: a steady tone has no best window, choose its length")
    return 1.0 / math.sqrt(abs(sweep_rate))


def resample_uniform(time: ArrayLike, values: ArrayLike, rate: float) -> tuple[FloatArray, FloatArray]:
    """Bring a signal onto a uniform grid.

    Parameters
    ----------
    time : array_like, shape (n,)
        Increasing instants, s.
    values : array_like, shape (n,)
        Signal.
    rate : float
        Wanted sampling rate, Hz.

    Returns
    -------
    time, values : (m,) arrays
        From the first instant on, at ``1 / rate``.

    Raises
    ------
    ValueError
        If the instants do not increase, or there are fewer than eight.

    Notes
    -----
    Quintic spline; at eight samples per period its error is below 0.1 %. A rate below the signal's goes
    through a linear-phase low pass (Kaiser window) that keeps 80 % of the new band within 1 % and holds back
    aliases.
    """
    instants, signal = np.asarray(time, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if instants.shape != signal.shape or instants.ndim != 1 or instants.size < 8:
        raise ValueError(f"time {instants.shape} and values {signal.shape} must be two rows of 8 or more samples")
    steps = np.diff(instants)
    if not np.all(steps > 0.0):
        raise ValueError(f"time must increase, but does not after {instants[:-1][~(steps > 0.0)][0]:.9g} s")
    finest = 1.0 / float(np.median(steps))
    factor = max(1, math.ceil(finest / rate - 1e-6))
    count = math.floor((instants[-1] - instants[0]) * rate * factor + 1e-6) + 1
    fine_time = np.minimum(instants[0] + np.arange(count) / (rate * factor), instants[-1])
    fine: FloatArray = np.asarray(scipy.interpolate.make_interp_spline(instants, signal, k=5)(fine_time))
    if factor > 1:
        taps = scipy.signal.firwin(40 * factor + 1, 0.9 / factor, window=("kaiser", 6.0))
        # Anti-symmetric continuation at both ends keeps slopes and avoids a step into zeros.
        padded = np.pad(fine, 20 * factor, mode="reflect", reflect_type="odd")
        fine = scipy.signal.fftconvolve(padded, taps, mode="valid")[::factor]
    return instants[0] + np.arange(fine.size) / rate, fine


def amplitude_spectrum(
    values: ArrayLike, rate: float, window: str = "hann", padding: int = 1
) -> tuple[FloatArray, FloatArray]:
    """One-sided amplitude spectrum.

    Parameters
    ----------
    values : array_like, shape (..., n)
        Signal, along the last axis.
    rate : float
        Sampling rate, Hz.
    window : str
        Name of a SciPy window. ``"flattop"`` reads amplitudes between bins to 0.1 %, ``"hann"`` to 15 %.
    padding : int
        Length after appending zeros over `n`: spectral lines in between, no finer resolution.

    Returns
    -------
    frequency : (padding n // 2 + 1,) array
        Hz.
    amplitude : (..., padding n // 2 + 1) array
        Peak amplitude of a sine at that frequency; at frequency zero the mean.

    Examples
    --------
    >>> time = np.arange(1000) / 1000.0
    >>> frequency, amplitude = amplitude_spectrum(3.0 * np.cos(2 * np.pi * 50.0 * time), 1000.0)
    >>> float(frequency[50]), round(float(amplitude[50]), 12)
    (50.0, 3.0)
    """
    signal = np.asarray(values, dtype=np.float64)
    count = padding * signal.shape[-1]
    weights = scipy.signal.get_window(window, signal.shape[-1])  # periodic: a tone on a bin comes out exactly
    spectrum = np.fft.rfft(signal * weights, n=count, axis=-1)
    amplitude: FloatArray = 2.0 * np.abs(spectrum) / weights.sum()
    amplitude[..., 0] *= 0.5
    if count % 2 == 0:
        amplitude[..., -1] *= 0.5
    frequency = np.arange(amplitude.shape[-1]) * (rate / count)
    return frequency, amplitude


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

    time: FloatArray
    speed: FloatArray
    frequency: FloatArray
    amplitude: FloatArray
    window: str
    window_length: float
    overlap: float
    reference: float
    unit: str

    @cached_property
    def level(self) -> FloatArray:
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

    def resolution(self, line: OrderLine) -> FloatArray:
        """Frequency resolution along an order line, Hz, shape (n,).

        The wider of one over the window's length and what the sweep of that order allows.
        """
        rate = np.gradient(line.frequency(self.speed), self.time)
        resolution: FloatArray = np.maximum(sweep_limited_resolution(rate), 1.0 / self.window_length)
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


def _frames(values: FloatArray, length: int, overlap: float) -> FloatArray:
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
    time: FloatArray
    speed: FloatArray
    frequency: FloatArray
    amplitude: ComplexArray


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


@dataclass(frozen=True)
class Pick:
    """A peak on an order line of a waterfall.

    Attributes
    ----------
    line : OrderLine
        The order that excites it.
    time, speed, frequency : float
        Where it peaks: s, rad/s, Hz.
    level, prominence : float
        Level and prominence over its surroundings on the line, dB.
    resolution : float
        How exactly the sweep allows the frequency to be told, Hz.
    """

    line: OrderLine
    time: float
    speed: float
    frequency: float
    level: float
    prominence: float
    resolution: float


def line_level(spectra: Waterfall, line: OrderLine) -> FloatArray:
    """Level along an order line.

    Parameters
    ----------
    spectra : Waterfall
        The run.
    line : OrderLine
        The order.

    Returns
    -------
    (n,) array
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
    highest: FloatArray = np.where(near, level, -np.inf).max(axis=1)
    inside = (frequency > 4.0 / spectra.window_length) & (nearest <= last)
    return np.where(inside, highest, np.nan)


def pick_resonances(
    spectra: Waterfall, lines: Iterable[OrderLine], *, prominence: float = 6.0, depth: float = 60.0
) -> tuple[Pick, ...]:
    """Find the peaks along order lines.

    Parameters
    ----------
    spectra : Waterfall
        The run.
    lines : iterable of OrderLine
        Where to look.
    prominence : float
        Least height of a peak over the higher of the two valleys beside it, dB.
    depth : float
        Peaks so far below the highest level on any of the lines, dB, are left out: where an order excites
        nothing, its line shows the ripple of the spectral floor.

    Returns
    -------
    tuple of Pick
        Line by line, in order of time. Of peaks closer than the resolution the higher one is kept.

    Examples
    --------
    >>> time = np.arange(20000) / 2000.0
    >>> speed = 2 * np.pi * time / 4.0
    >>> tone = np.sin(2 * np.pi * 100 * time**2 / 8.0) / np.hypot(1 - (25 * time / 120.0) ** 2, 0.1)
    >>> run = waterfall(tone, speed, 2000.0, window_length=0.2, reference=1.0)
    >>> [round(pick.frequency) for pick in pick_resonances(run, [OrderLine("mesh", 100.0)])]
    [120]
    """
    searched = tuple(lines)
    highest = max((_highest(line_level(spectra, line)) for line in searched), default=0.0)
    picks = (pick for line in searched for pick in _peaks_on_line(spectra, line, prominence))
    return tuple(pick for pick in picks if pick.level > highest - depth)


def _highest(level: FloatArray) -> float:
    return float(np.max(level, initial=-np.inf, where=np.isfinite(level)))


def _peaks_on_line(spectra: Waterfall, line: OrderLine, prominence: float) -> list[Pick]:
    level = line_level(spectra, line)
    usable = np.flatnonzero(np.isfinite(level))
    if usable.size < 3:
        return []
    frequency, resolution = line.frequency(spectra.speed), spectra.resolution(line)
    pace = np.median(np.abs(np.diff(frequency[usable])))
    apart = max(1.0, float(np.median(resolution[usable]) / pace)) if pace > 0.0 else 1.0
    peaks, properties = scipy.signal.find_peaks(level[usable], prominence=prominence, distance=apart)
    return [
        _pick_at(spectra, line, level, int(usable[peak]), float(height))
        for peak, height in zip(peaks, properties["prominences"], strict=True)
    ]


def _pick_at(spectra: Waterfall, line: OrderLine, level: FloatArray, frame: int, prominence: float) -> Pick:
    """Refine a peak by the parabola through its frame and both neighbours."""
    before, here, after = level[frame - 1 : frame + 2]
    curvature = before - 2.0 * here + after
    offset = 0.5 * (before - after) / curvature if curvature < 0.0 else 0.0
    position = frame + offset
    frames = np.arange(level.size)
    speed = float(np.interp(position, frames, spectra.speed))
    return Pick(
        line=line,
        time=float(np.interp(position, frames, spectra.time)),
        speed=speed,
        frequency=float(line.frequency(speed)),
        level=float(here - 0.25 * (before - after) * offset),
        prominence=prominence,
        resolution=float(np.interp(position, frames, spectra.resolution(line))),
    )


@dataclass(frozen=True)
class Resonance:
    """Peaks of several order lines at one frequency.

    Attributes
    ----------
    frequency : float
        Mean of the peaks, weighted by their resolution, Hz.
    resolution : float
        Of the slowest of its lines, Hz.
    picks : tuple of Pick
        The highest first.
    """

    frequency: float
    resolution: float
    picks: tuple[Pick, ...]


def group_by_frequency(picks: Iterable[Pick]) -> tuple[Resonance, ...]:
    """Gather the peaks that several orders show of one resonance.

    Parameters
    ----------
    picks : iterable of Pick
        Peaks of any lines.

    Returns
    -------
    tuple of Resonance
        By frequency. The highest peak gathers those within the wider of both resolutions, then the next.
    """
    waiting = sorted(picks, key=lambda pick: -pick.level)
    groups: list[Resonance] = []
    while waiting:
        first = waiting[0]
        members = [pick for pick in waiting if _within_resolution(first, pick)]
        waiting = [pick for pick in waiting if not _within_resolution(first, pick)]
        weights = np.array([pick.resolution**-2 for pick in members])
        frequencies = np.array([pick.frequency for pick in members])
        groups.append(
            Resonance(
                frequency=float(weights @ frequencies / weights.sum()),
                resolution=min(pick.resolution for pick in members),
                picks=tuple(members),
            )
        )
    return tuple(sorted(groups, key=lambda group: group.frequency))


def _within_resolution(first: Pick, second: Pick) -> bool:
    return abs(first.frequency - second.frequency) <= max(first.resolution, second.resolution)


def match_eigenfrequencies(found: Sequence[Pick | Resonance], eigenfrequencies: ArrayLike) -> tuple[int | None, ...]:
    """Name the eigenfrequency that each finding belongs to.

    Parameters
    ----------
    found : sequence of Pick or Resonance
        Findings in a waterfall.
    eigenfrequencies : array_like, shape (n,)
        Hz.

    Returns
    -------
    tuple of int or None
        Index of the nearest eigenfrequency, or None where none lies within the resolution of the finding.

    Examples
    --------
    >>> line = OrderLine("HS", 1792.8)
    >>> pick = Pick(
    ...     line, time=15.0, speed=11.2, frequency=3201.0, level=10.0, prominence=9.0, resolution=15.0
    ... )
    >>> match_eigenfrequencies([pick], [812.0, 3215.0, 3190.0])
    (2,)
    """
    known = np.asarray(eigenfrequencies, dtype=np.float64)
    matches: list[int | None] = []
    for finding in found:
        distance = np.abs(known - finding.frequency)
        nearest = int(np.argmin(distance)) if known.size else None
        matches.append(nearest if nearest is not None and distance[nearest] <= finding.resolution else None)
    return tuple(matches)


@dataclass(frozen=True)
class AbsenceRule:
    """When a peak of one run counts as absent from another.

    Attributes
    ----------
    prominence : float
        On the same order line the other run has no peak of this prominence, dB, within the resolution, and
    margin : float
        its level at that place lies at least so far below, dB.
    """

    prominence: float = 3.0
    margin: float = 6.0

    @property
    def description(self) -> str:
        """The rule in words, for captions."""
        return (
            f"no peak of {self.prominence:g} dB prominence on the same order within the resolution, "
            f"and a level at least {self.margin:g} dB lower"
        )


def only_in_first(picks: Iterable[Pick], other: Waterfall, rule: AbsenceRule | None = None) -> tuple[Pick, ...]:
    """Select the peaks of one run that another run does not show.

    Parameters
    ----------
    picks : iterable of Pick
        Peaks of the first run.
    other : Waterfall
        The second run, with the same unit.
    rule : AbsenceRule, optional
        Stated thresholds.

    Returns
    -------
    tuple of Pick
        Peaks that satisfy the rule; a peak where the second run has no data does not.
    """
    stated = rule or AbsenceRule()
    return tuple(pick for pick in picks if _is_absent(pick, other, stated))


def _is_absent(pick: Pick, other: Waterfall, rule: AbsenceRule) -> bool:
    frequency, level = pick.line.frequency(other.speed), line_level(other, pick.line)
    near = np.isfinite(level) & (np.abs(frequency - pick.frequency) <= pick.resolution)
    if not np.any(near):
        return False
    same_place = any(
        abs(peak.frequency - pick.frequency) <= max(pick.resolution, peak.resolution)
        for peak in _peaks_on_line(other, pick.line, rule.prominence)
    )
    return not same_place and float(level[near].max()) <= pick.level - rule.margin
