"""Speeds at which a response over speed is still to be solved: tops of peaks between known speeds, and their flanks.

A resonance that is narrower than the step between two speeds shows less than its height at them. The response at a
place is a rational function of speed with few poles near a resonance: a curve of that kind through the neighbours
predicts the top.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from exugear.steady.crossings import COINCIDE, in_operation
from exugear.steady.harmonics.branches import NEIGHBOURS, peaks_of_lines, predicted_tops
from exugear.steady.mean_system.signals import SURFACE_VELOCITY, Quantity
from fe_ste.tools.arrays import Booleans, Floats, SingleComplexes

Peak = tuple[int, int]
"""Point and line."""
KnownTops = dict[tuple[str, int, int, int, bytes], list[float]]
"""Place and height of tops by quantity, line, place of the quantity, and the speeds around."""
PREDICTED = 200
"""Highest peaks of each quantity at the known speeds whose tops are predicted, of all speeds and of the range of
operation."""
LOUDEST, LOUDEST_BESIDE_OTHERS = 100, 30
"""Number of these at whose tops the response is evaluated, those predicted to be highest; the second where stiffness
varies with the carrier and a speed takes a hundred times as long. Lower peaks may be known at even steps only."""
LEAST_STAND = 1e-4
"""Relative prominence of a peak at the known speeds from which it is refined: its maximum may be higher."""
GAIN = 1e-3
"""Relative excess of a maximum over its peak at the known speeds from which it is evaluated."""
NOTICED = 0.01
"""Relative excess of a maximum over its peak from which it is reported where it was not evaluated."""
APART = 0.25
"""Share of the distance between a peak's neighbours within which two maxima are evaluated together."""
DRAWN = 10
"""Highest peaks of each quantity in the range of operation whose flanks are resolved for drawings."""
FLANK = (0.6, 1.2)
"""Places of two points on a flank, over the distance at which a resonance falls to 1 / sqrt(2) of its top: they are at
86 % and 64 % of it."""


def missed_tops(
    speeds: Floats,
    amplitude: SingleComplexes,
    smooth: Booleans,
    quantities: Sequence[Quantity],
    operation: tuple[float, float] | None,
    known: KnownTops | None = None,
    count: int = LOUDEST,
) -> Floats:
    """Return speeds at which the peaks of the highest tops exceed every known speed, by curves through neighbours.

    Parameters
    ----------
    speeds : (n,) ascending, rad/s
    amplitude : (n, lines, signals) of all signals, the mean as the first line
    smooth : (n,) where the response is smooth over speed: not with contact loss
    quantities : quantities whose peaks are evaluated
    operation : operating speed range, whose highest peaks are ranked separately, rad/s without sign
    known : dict, optional
        Maxima found between the same speeds before; newly found ones are added.
    count : number of tops of each quantity that are evaluated, of all speeds and of the range of operation
    """
    if len(speeds) < NEIGHBOURS:
        return np.zeros(0)
    known = {} if known is None else known
    tops: list[float] = []
    inside = in_operation(speeds, operation)
    for quantity in quantities:
        sizes = quantity.sizes(amplitude[:, 1:])
        highest = sizes.max(axis=2)
        peaks = sorted(peaks_of_lines(highest, LEAST_STAND), key=lambda peak: -highest[peak])
        predicted = _predicted(_first(peaks, PREDICTED, inside), speeds, amplitude, smooth, quantity, sizes, known)
        by_height = sorted(predicted, key=lambda peak: -predicted[peak][1])
        for point, line in _first(by_height, count, inside):
            top, height = predicted[point, line]
            near = APART * (speeds[point + 1] - speeds[point - 1])
            new = all(abs(top - other) > near for other in tops)
            new &= bool((np.abs(speeds[_around(point, len(speeds))] - top) > COINCIDE * abs(top)).all())
            if new and height > (1.0 + GAIN) * highest[point, line]:
                tops.append(top)
    return np.sort(np.array(tops))


@dataclass(frozen=True)
class HigherBetween:
    """Peaks of a quantity that are higher between the computed speeds than at them."""

    quantity: str
    rank: int
    """Of the first of them, 1 for the highest peak in the range of operation."""
    excess: float
    """Relative, the largest of them."""


def higher_between(
    speeds: Floats,
    amplitude: SingleComplexes,
    smooth: Booleans,
    quantities: Sequence[Quantity],
    operation: tuple[float, float] | None,
    known: KnownTops,
    audible: Booleans | None = None,
) -> tuple[HigherBetween, ...]:
    """Find what `missed_tops`, of whose parameters these are, left out among the `PREDICTED` highest peaks.

    Parameters
    ----------
    audible : (n, lines), optional
        Where the surface velocity is ranked.
    """
    found = []
    inside = in_operation(speeds, operation)
    for quantity in quantities if len(speeds) >= NEIGHBOURS else ():
        sizes = quantity.sizes(amplitude[:, 1:])
        highest = sizes.max(axis=2)
        if audible is not None and quantity.name == SURFACE_VELOCITY.name:
            highest[~audible[:, 1:]] = 0.0
        peaks = [peak for peak in peaks_of_lines(highest) if inside[peak[0]]]
        ranked = sorted(peaks, key=lambda peak: -highest[peak])[:PREDICTED]
        predicted = _predicted(ranked, speeds, amplitude, smooth, quantity, sizes, known)
        excess = np.array([predicted[peak][1] / highest[peak] - 1.0 if peak in predicted else 0.0 for peak in ranked])
        if (noticed := np.flatnonzero(excess > NOTICED)).size:
            found.append(HigherBetween(quantity.name, int(noticed[0]) + 1, float(excess.max())))
    return tuple(found)


def _predicted(
    peaks: list[Peak],
    speeds: Floats,
    amplitude: SingleComplexes,
    smooth: Booleans,
    quantity: Quantity,
    sizes: Floats,
    known: KnownTops,
) -> dict[Peak, list[float]]:
    """Return speed and height of the tops of peaks, without those whose neighbours are not smooth.

    `sizes` (n, lines - 1, places) are those of the quantity; tops that are not `known` yet are added to it.
    """
    keys: dict[Peak, tuple[str, int, int, int, bytes]] = {}
    # Curves at one place whose peaks have as many neighbours on either side are evaluated together.
    alike: dict[tuple[int, int, int], list[Peak]] = {}
    for point, line in peaks:
        around = _around(point, len(speeds))
        if smooth[around].all():
            place = int(sizes[point, line].argmax())
            key = keys[point, line] = quantity.name, line, place, point - around.start, speeds[around].tobytes()
            if key not in known:
                alike.setdefault((place, point - around.start, around.stop - around.start), []).append((point, line))
    for (place, before, points_around), found in alike.items():
        points, lines = np.array(found).T
        at = points[:, None] - before + np.arange(points_around)
        values = quantity.components(amplitude[at, lines[:, None] + 1], place)
        tops = predicted_tops(speeds[at], values, before, partial(quantity.size, place=place))
        known |= zip([keys[peak] for peak in found], np.transpose(tops).tolist(), strict=True)
    return {peak: known[key] for peak, key in keys.items()}


def _first(peaks: list[Peak], count: int, inside: Booleans) -> list[Peak]:
    """Return so many of the first peaks (point, line), and as many of those whose points are `inside`."""
    operating = [peak for peak in peaks if inside[peak[0]]]
    return list(dict.fromkeys(peaks[:count] + operating[:count]))


def missed_flanks(
    speeds: Floats,
    amplitude: SingleComplexes,
    smooth: Booleans,
    quantities: Sequence[Quantity],
    operation: tuple[float, float] | None,
) -> Floats:
    """Return speeds beside the highest peaks that are drawn as triangles: with fewer than two points above half height.

    Parameters are those of `missed_tops`.

    Notes
    -----
    Near the top A of a resonance the amplitude at a distance d is A / sqrt(1 + (d / w)^2). The first point below A / 2
    on a flank gives w. Other modes may add to that point, and w is too large; the next call then comes closer.
    """
    inside = in_operation(speeds, operation)
    more: list[float] = []
    for quantity in quantities:
        sizes = quantity.sizes(amplitude[:, 1:]).max(axis=2)
        peaks = [peak for peak in peaks_of_lines(sizes) if inside[peak[0]]]
        for point, line in sorted(peaks, key=lambda peak: -sizes[peak])[:DRAWN]:
            if smooth[_around(point, len(speeds))].all():
                for side in (slice(point, None), slice(point, None, -1)):
                    more += _on_flank(speeds[side], sizes[side, line])
    taken = list(speeds)
    for speed in sorted(more):
        if np.abs(np.array(taken) - speed).min() > COINCIDE * abs(speed):
            taken.append(speed)
    return np.array(taken[len(speeds) :])


def _on_flank(speeds: Floats, amplitude: Floats) -> list[float]:
    """Return the speeds that a flank lacks; it begins at its peak.

    Examples
    --------
    A peak of 1 that falls to 1 / sqrt(2) at 100.1; the flank has no point above half height, and then one:

    >>> def resonance(speeds):
    ...     return 1.0 / np.hypot(1.0, (speeds - 100.0) / 0.1)
    >>> coarse, better = np.array([100.0, 101.0, 102.0]), np.array([100.0, 100.06, 101.0])
    >>> np.round(_on_flank(coarse, resonance(coarse)), 3).tolist()
    [100.06, 100.12]
    >>> np.round(_on_flank(better, resonance(better)), 3).tolist()
    [100.12]
    """
    below = np.flatnonzero(amplitude < 0.5 * amplitude[0])
    if not below.size or below[0] > len(FLANK) or amplitude[below[0]] <= 0.0:
        return []
    first = int(below[0])
    width = (speeds[first] - speeds[0]) / math.sqrt((amplitude[0] / amplitude[first]) ** 2 - 1.0)
    wanted = [float(speeds[0] + share * width) for share in FLANK]
    # Of two points, the one that is further from a known one is new.
    known = speeds[1:first]
    return sorted(wanted, key=lambda own: -float(np.abs(known - own).min(initial=np.inf)))[: len(FLANK) - len(known)]


def _around(point: int, count: int) -> slice:
    """Return the places of a point and its neighbours, among so many."""
    return slice(max(point - NEIGHBOURS, 0), min(point + NEIGHBOURS + 1, count))
