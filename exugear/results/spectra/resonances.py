"""Resonances of a run-up: peaks that stand out along the order lines of its waterfall, gathered by frequency."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from textwrap import shorten

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.parts import RPM
from exugear.results.spectra.orders import OrderLine
from exugear.results.spectra.waterfall import Waterfall
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed, TitledRows


@dataclass(frozen=True)
class Pick:
    """A peak on an order line of a waterfall."""

    line: OrderLine
    """The order that excites it."""
    time: float
    speed: float
    frequency: float
    """Where it peaks: s, rad/s, Hz."""
    level: float
    prominence: float
    """Level and prominence over its surroundings on the line, dB."""
    resolution: float
    """How exactly the sweep allows the frequency to be told, Hz."""


Peaks = Callable[[Waterfall, OrderLine, float], list[Pick]]
"""Finds the peaks of a least prominence (dB) along an order line."""


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
    spectra : the run
    lines : where to look
    prominence : least height of a peak over the higher of the two valleys beside it, dB
    depth
        Peaks so far below the highest level on any of the lines, dB, are left out: where an order excites
        nothing, its line shows the ripple of the spectral floor.
    peaks : callable, optional
        Finds the peaks of a least prominence (dB) along a line: `peaks_on_line` by default, or that of steady
        responses, `exugear.results.spectra.line_spectra.line_peaks`.

    Returns
    -------
    line by line, in order of time. Of peaks closer than the resolution the higher one is kept.

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
    highest = max((_highest(spectra.along(line)) for line in searched), default=0.0)
    picks = (pick for line in searched for pick in (peaks or peaks_on_line)(spectra, line, prominence))
    return tuple(pick for pick in picks if pick.level > highest - depth)


def _highest(level: Floats) -> float:
    return float(np.max(level, initial=-np.inf, where=np.isfinite(level)))


def peaks_on_line(spectra: Waterfall, line: OrderLine, prominence: float) -> list[Pick]:
    """Find the peaks of a least prominence (dB) along one order line, in order of time."""
    import scipy.signal  # loads all of scipy.stats, for which others need not wait

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
        resolution=float(np.interp(position, frames, resolution)),
    )


@dataclass(frozen=True)
class Resonance(Displayed, line=" {_frequency_text}, {_highest_text}, {picks!n} peaks"):
    """Peaks of several order lines at one frequency."""

    frequency: float
    """Mean of the peaks, weighted by their resolution, Hz."""
    resolution: float
    """Of the slowest of its lines, Hz."""
    picks: tuple[Pick, ...]
    """The highest first."""

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


def group_by_frequency(picks: Iterable[Pick]) -> tuple[Resonance, ...]:
    """Gather the peaks that several orders show of one resonance.

    Parameters
    ----------
    picks : peaks of any lines

    Returns
    -------
    by frequency. The highest peak gathers those within the wider of both resolutions, then the next.
    """
    waiting = sorted(picks, key=lambda pick: -pick.level)
    groups: list[Resonance] = []
    while waiting:
        highest = waiting[0]
        members = [pick for pick in waiting if _within_resolution(highest, pick)]
        waiting = [pick for pick in waiting if not _within_resolution(highest, pick)]
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


def match_eigenfrequencies(
    resonances: Sequence[Pick | Resonance], eigenfrequencies: ArrayLike
) -> tuple[int | None, ...]:
    """Name the eigenfrequency that each resonance belongs to.

    Parameters
    ----------
    resonances : as a waterfall shows them
    eigenfrequencies : (n,) Hz

    Returns
    -------
    index of the nearest eigenfrequency, or None where none lies within the resolution of the resonance

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
