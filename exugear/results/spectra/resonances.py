"""Resonances of a run-up: prominent peaks along the order lines of its waterfall, grouped by frequency."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from textwrap import shorten

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.units import RPM
from exugear.results.spectra.waterfall import OrderLine, Waterfall, overlapping_frames, sweep_matched_window
from fe_ste.tools.arrays import Complexes, Floats
from fe_ste.tools.display import ReprMixin, TitledRows, value_range


@dataclass(frozen=True)
class Pick:
    """A peak on an order line of a waterfall."""

    line: OrderLine
    """Order that excites the peak."""
    time: float
    speed: float
    frequency: float
    """Time (s), speed (rad/s) and frequency (Hz) of the peak."""
    level: float
    prominence: float
    """Level, and prominence over the surroundings on the order line, dB."""
    resolution: float
    """Frequency resolution that the sweep rate permits, Hz."""


Peaks = Callable[[Waterfall, OrderLine, float], list[Pick]]
"""Function that finds the peaks of a minimum prominence (dB) along an order line."""


def pick_resonances(
    spectra: Waterfall,
    lines: Iterable[OrderLine],
    *,
    prominence: float = 6.0,
    depth: float = 60.0,
    peaks: Peaks | None = None,
) -> tuple[Pick, ...]:
    """Find the peaks along order lines.

    Parameters
    ----------
    prominence : minimum height of a peak above the higher of its two adjacent valleys, dB
    depth
        Peaks that are lower than the highest level of all order lines by more than this, dB, are omitted: without
        excitation an order line shows only the fluctuation of the spectral floor.
    peaks : callable, optional
        Finds the peaks of a minimum prominence (dB) along a line: `peaks_on_line` by default, or for steady-state
        responses `exugear.results.spectra.line_spectra.line_peaks`.

    Returns
    -------
    by order line, then by time. Of peaks closer than the resolution only the higher one is kept.

    Examples
    --------
    >>> from exugear.results.spectra.waterfall import waterfall
    >>> time = np.arange(20000) / 2000.0
    >>> speed = 2 * np.pi * time / 4.0
    >>> tone = np.sin(2 * np.pi * 100 * time**2 / 8.0) / np.hypot(1 - (25 * time / 120.0) ** 2, 0.1)
    >>> run = waterfall(tone, speed, 2000.0, window_length=0.2, reference=1.0)
    >>> [round(pick.frequency) for pick in pick_resonances(run, [OrderLine("mesh", 100.0)])]
    [120]
    """
    searched = tuple(lines)
    levels = (spectra.along(line) for line in searched)
    highest = max((float(np.max(level, initial=-np.inf, where=np.isfinite(level))) for level in levels), default=0.0)
    picks = (pick for line in searched for pick in (peaks or peaks_on_line)(spectra, line, prominence))
    return tuple(pick for pick in picks if pick.level > highest - depth)


def peaks_on_line(spectra: Waterfall, line: OrderLine, prominence: float) -> list[Pick]:
    """Find the peaks of a minimum prominence (dB) along one order line, in order of time."""
    import scipy.signal  # imported here because it loads all of scipy.stats

    level = spectra.along(line)
    usable = np.flatnonzero(np.isfinite(level))
    if usable.size < 3:
        return []
    frequency = line.frequency(spectra.speed)
    resolution = spectra.resolution(line)
    pace = np.median(np.abs(np.diff(frequency[usable])))
    apart = max(1.0, float(np.median(resolution[usable]) / pace)) if pace > 0.0 else 1.0
    peaks, properties = scipy.signal.find_peaks(level[usable], prominence=prominence, distance=apart)
    return [
        _pick_at(spectra, line, level, resolution, int(usable[peak]), float(height))
        for peak, height in zip(peaks, properties["prominences"], strict=True)
    ]


def _pick_at(
    spectra: Waterfall, line: OrderLine, level: Floats, resolution: Floats, frame: int, prominence: float
) -> Pick:
    """Refine a peak by the parabola through its frame and the two adjacent ones."""
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
        resolution=float(np.interp(position, frames, resolution)),
    )


@dataclass(frozen=True)
class WaterfallResonance(ReprMixin, line=" {_frequency_text}, {_highest_text}, {picks!n} peaks"):
    """Peaks of several order lines at one frequency."""

    frequency: float
    """Mean frequency of the peaks, weighted by their resolution, Hz."""
    resolution: float
    """Resolution of the order line with the lowest sweep rate, Hz."""
    picks: tuple[Pick, ...]
    """Peaks, the highest first."""

    def _table(self) -> TitledRows:
        rows = {pick.line.name: f"{pick.level:.1f} dB at {pick.speed / RPM:.1f} rpm" for pick in self.picks}
        return f"Resonance, {self._frequency_text}", rows

    @property
    def _frequency_text(self) -> str:
        return f"{self.frequency:.1f} ± {self.resolution:.1f} Hz"

    @property
    def _highest_text(self) -> str:
        highest = self.picks[0]
        return f"highest {highest.level:.1f} dB on {shorten(highest.line.name, 80)}"


def group_by_frequency(picks: Iterable[Pick]) -> tuple[WaterfallResonance, ...]:
    """Group the peaks of several orders that belong to one resonance.

    Returns
    -------
    by frequency. Starting with the highest, each peak is grouped with those within the larger of both resolutions.
    """
    waiting = sorted(picks, key=lambda pick: -pick.level)
    groups: list[WaterfallResonance] = []
    while waiting:
        highest = waiting[0]
        members = [pick for pick in waiting if are_indistinct(highest, pick)]
        waiting = [pick for pick in waiting if not are_indistinct(highest, pick)]
        weights = np.array([pick.resolution**-2 for pick in members])
        frequencies = np.array([pick.frequency for pick in members])
        groups.append(
            WaterfallResonance(
                frequency=float(weights @ frequencies / weights.sum()),
                resolution=min(pick.resolution for pick in members),
                picks=tuple(members),
            )
        )
    return tuple(sorted(groups, key=lambda group: group.frequency))


def are_indistinct(first: Pick, second: Pick) -> bool:
    """Return whether the frequencies of two peaks differ by at most the larger of both resolutions."""
    return abs(first.frequency - second.frequency) <= max(first.resolution, second.resolution)


def match_eigenfrequencies(
    resonances: Sequence[Pick | WaterfallResonance], eigenfrequencies: ArrayLike
) -> tuple[int | None, ...]:
    """Assign an eigenfrequency, of (n,) in Hz, to each peak or resonance of a waterfall.

    Returns
    -------
    index of the nearest eigenfrequency, or None if none is within the resolution of the resonance

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
    for resonance in resonances:
        distance = np.abs(known - resonance.frequency)
        nearest = int(np.argmin(distance)) if known.size else None
        matches.append(nearest if nearest is not None and distance[nearest] <= resonance.resolution else None)
    return tuple(matches)


@dataclass(frozen=True)
class OrderCut(ReprMixin):
    """Amplitude and phase along an order."""

    line: OrderLine
    time: Floats
    speed: Floats
    frequency: Floats
    """(n,) centre of each window, s; speed there, rad/s; frequency of the order there, Hz."""
    amplitude: Complexes
    """(n,) complex amplitude (zero-to-peak); its phase is relative to ``cos(order * angle)``."""

    def _line(self) -> str:
        return f": {shorten(', '.join(f'{name} {value}' for name, value in self._rows.items()), 180)}"

    def _table(self) -> TitledRows:
        return "Order cut", self._rows

    @property
    def _rows(self) -> dict[str, str]:
        return {
            "order": f"{self.line.order:g} ({self.line.name})",
            "windows": str(self.time.size),
            "speed": value_range(self.speed, "rpm", 1.0 / RPM),
            "frequency": value_range(self.frequency, "Hz"),
            "amplitude": value_range(np.abs(self.amplitude), "in the signal's unit"),
        }


OVERLAP = 0.75
"""Overlap of the windows of an order cut, as a fraction."""


def order_cut(
    values: ArrayLike,
    speed: ArrayLike,
    rate: float,
    line: OrderLine,
    *,
    window_length: float,
) -> OrderCut:
    """Follow an order along the instantaneous speed.

    The signal is multiplied by ``exp(-i order angle)``, the angle being the integral of the speed, and averaged under
    Hann windows. This demodulates the order to zero frequency, so that its amplitude is exact at any sweep rate.

    Parameters
    ----------
    values, speed : (n,) signal and speed of the reference shaft (rad/s), uniformly sampled
    rate : sampling rate, Hz
    window_length : s; other orders closer than about ``2 / window_length`` in Hz cause leakage

    Examples
    --------
    >>> time = np.arange(4000) / 2000.0
    >>> speed = 2 * np.pi * (2.0 + 3.0 * time)  # 2 to 8 revolutions per second
    >>> angle = 2 * np.pi * (2.0 * time + 1.5 * time**2)
    >>> cut = order_cut(0.5 * np.cos(30 * angle), speed, 2000.0, OrderLine("30", 30.0), window_length=0.1)
    >>> bool(np.all(np.abs(np.abs(cut.amplitude) - 0.5) < 1e-3))
    True
    """
    import scipy.signal  # imported here because it loads all of scipy.stats

    signal = np.asarray(values, dtype=np.float64)
    shaft = np.asarray(speed, dtype=np.float64)
    length = round(window_length * rate)
    step = 0.5 * (np.abs(shaft[1:]) + np.abs(shaft[:-1])) / rate
    angle = np.concatenate([[0.0], np.cumsum(step)])
    turning_back = np.exp(-1j * line.order * angle)
    weights = scipy.signal.get_window("hann", length)
    weights *= 2.0 / weights.sum()
    demodulated = signal * turning_back
    mean_speed = np.abs(overlapping_frames(shaft, length, OVERLAP).mean(axis=1))
    return OrderCut(
        line=line,
        time=overlapping_frames(np.arange(signal.size) / rate, length, OVERLAP).mean(axis=1),
        speed=mean_speed,
        frequency=line.frequency(mean_speed),
        amplitude=overlapping_frames(demodulated.real, length, OVERLAP) @ weights
        + 1j * (overlapping_frames(demodulated.imag, length, OVERLAP) @ weights),
    )


# Sweeps through resonances in a run-up: suitable windows for order cuts, and resonances that do not build up fully

MAX_SWEEP_RATIO = 0.3
"""Sweep-rate ratio above which a warning states that the resonance peak is not reached: the peak is 8 % lower at 0.4
and two thirds lower at 20.
"""
FEWEST_SAMPLES = 16
"""Minimum number of samples of a window."""


def sweep_severity(frequency: float, damping: float, rate: float) -> float:
    """Sweep-rate ratio, of a sweep rate (Hz/s) to the build-up of a resonance at f (Hz): f' / (2 pi zeta^2 f^2).

    Examples
    --------
    >>> round(sweep_severity(229.0, 0.0029, 56.0), 1)
    20.2
    """
    return abs(rate) / (2.0 * math.pi * (damping * frequency) ** 2)


def sweep_rate(time: Floats, speed: Floats, order: float) -> float:
    """Mean sweep rate of an order in a run, Hz/s; times (s) and speeds (rad/s) of the reference shaft.

    Examples
    --------
    >>> import numpy as np
    >>> round(sweep_rate(np.array([0.0, 2.0]), np.array([0.0, 4.0 * np.pi]), 10.0), 6)
    10.0
    """
    change = abs(abs(float(speed[-1])) - abs(float(speed[0])))
    return order * change / (2.0 * math.pi * float(time[-1] - time[0]))


def run_up_cut(time: Floats, values: Floats, speed: Floats, line: OrderLine) -> OrderCut:
    """Cut an order out of a run-up with a window length matched to its sweep: one over the root of the rate in Hz/s.

    Parameters
    ----------
    time, values, speed : (n,) uniformly sampled: s; the signal; speed of the reference shaft, rad/s
    """
    rate = (len(time) - 1) / float(time[-1] - time[0])
    sweeps = sweep_rate(time, speed, line.order)
    window = sweep_matched_window(sweeps) if sweeps > 0.0 else 0.1 * float(time[-1] - time[0])
    window = max(FEWEST_SAMPLES / rate, min(window, 0.2 * float(time[-1] - time[0])))
    # At low speed the window is as long as a period of the order, so that the mean value would leak into it.
    return order_cut(values - values.mean(), speed, rate, line, window_length=window)
