"""Resonances that stand out of a waterfall along its order lines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.signal
from numpy.typing import ArrayLike

from exugear.spectra.waterfall import OrderLine, Waterfall
from fe_ste.tools.arrays import Floats


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


def line_level(spectra: Waterfall, line: OrderLine) -> Floats:
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
    highest: Floats = np.where(near, level, -np.inf).max(axis=1)
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


def _highest(level: Floats) -> float:
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


def _pick_at(spectra: Waterfall, line: OrderLine, level: Floats, frame: int, prominence: float) -> Pick:
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
