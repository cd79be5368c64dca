"""Speeds at which a response over speed is still to be solved: tops of peaks between known speeds, and their flanks.

A resonance that is narrower than the step between two speeds shows less than its height at them. The response at a
place is a rational function of speed with few poles near a resonance: a curve of that kind through the neighbours
predicts the top.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from exugear.steady.crossings import COINCIDE, in_operation
from exugear.steady.harmonics.branches import NEIGHBOURS, predicted_tops
from exugear.steady.mean_system.signals import SURFACE_VELOCITY, Quantity
from fe_ste.tools.arrays import Booleans, Complexes, Floats, SingleComplexes

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
DAMPED = 0.5
"""Share of the lowest damping ratio below which the pole of a curve is none of the system."""
NOTICED = 0.01
"""Relative excess of a maximum over its peak from which it is reported where it was not evaluated."""
APART = 0.25
"""Share of the distance between a peak's neighbours within which two maxima are evaluated together."""
DRAWN = 10
"""Highest peaks of each quantity in the range of operation whose flanks are resolved for drawings."""
FLANK = (0.6, 1.2)
"""Places of two points on a flank, over the distance at which a resonance falls to 1 / sqrt(2) of its top: they are at
86 % and 64 % of it."""


@dataclass(frozen=True, eq=False)
class ResponseCurves:
    """A response over the speeds at which it is known."""

    speed: Floats
    """(n,) of the overall input, ascending, rad/s."""
    amplitude: SingleComplexes
    """(n, lines, signals), the mean as the first line."""
    smooth: Booleans
    """(n,) where the response is smooth over speed: not with contact loss, nor where stated loads do not settle."""
    jumps: Booleans
    """(n,) points beside a jump, see `exugear.steady.harmonics.branches.beside_jumps`."""
    quantities: Sequence[Quantity]
    """Quantities whose peaks are evaluated."""
    operation: tuple[float, float] | None
    """Operating speed range, whose highest peaks are ranked separately, rad/s without sign."""
    damping: float
    """Lowest damping ratio of the system."""
    audible: Booleans | None = None
    """(n, lines) where the surface velocity is ranked; None for everywhere."""

    @property
    def inside(self) -> Booleans:
        """(n,) which speeds are in operation."""
        return in_operation(self.speed, self.operation)

    @property
    def ranked(self) -> Booleans:
        """(n, 1) where peaks are ranked."""
        return (self.inside & ~self.jumps)[:, None]

    def is_smooth(self, points: slice) -> bool:
        """Return whether a curve goes through points that follow each other."""
        return bool(self.smooth[points].all()) and not self.jumps[points].any()

    def sizes(self, quantity: Quantity) -> Floats:
        """Return the amplitudes (n, lines - 1, places) of a quantity, zero where it is not ranked."""
        found = quantity.sizes(self.amplitude[:, 1:])
        if self.audible is not None and quantity.name == SURFACE_VELOCITY.name:
            found[~self.audible[:, 1:]] = 0.0
        return found

    def tops(self, quantity: Quantity, sizes: Floats, peaks: list[Peak], known: KnownTops) -> dict[Peak, list[float]]:
        """Predict speed and height of the tops of peaks; those whose neighbours are not smooth are left out.

        `sizes` are those of the quantity. Tops that are not `known` yet are added to it.
        """
        keys: dict[Peak, tuple[str, int, int, int, bytes]] = {}
        # Curves at one place whose peaks have as many neighbours on either side are evaluated together.
        alike: dict[tuple[int, int, int], list[Peak]] = {}
        for point, line in peaks:
            around = _around(point, len(self.speed))
            if self.is_smooth(around):
                place, before = int(sizes[point, line].argmax()), point - around.start
                key = keys[point, line] = quantity.name, line, place, before, self.speed[around].tobytes()
                if key not in known:
                    alike.setdefault((place, before, around.stop - around.start), []).append((point, line))
        for (place, before, count), found in alike.items():
            points, lines = np.array(found).T
            at = points[:, None] - before + np.arange(count)
            values = quantity.components(self.amplitude[at, lines[:, None] + 1], place)
            size: Callable[[Complexes], Floats] = partial(quantity.size, place=place)
            if quantity.name == SURFACE_VELOCITY.name:
                # Without a phase it is no rational function of speed; its square is one.
                values, size = np.abs(values) ** 2, _root
            tops = predicted_tops(self.speed[at], values, before, size, DAMPED * self.damping)
            known |= zip([keys[peak] for peak in found], np.transpose(tops).tolist(), strict=True)
        return {peak: known[key] for peak, key in keys.items()}


def missed_tops(curves: ResponseCurves, known: KnownTops | None = None, count: int = LOUDEST) -> Floats:
    """Return speeds at which the peaks of the highest tops exceed every known speed, by curves through neighbours.

    Parameters
    ----------
    known : dict, optional
        Maxima found between the same speeds before; newly found ones are added.
    count : number of tops of each quantity that are evaluated, of all speeds and of the range of operation
    """
    speed = curves.speed
    if len(speed) < NEIGHBOURS:
        return np.zeros(0)
    known = {} if known is None else known
    tops: list[float] = []
    inside = curves.inside
    for quantity in curves.quantities:
        sizes = curves.sizes(quantity)
        highest = sizes.max(axis=2)
        peaks = quantity.peaks(highest, prominence=LEAST_STAND)
        predicted = curves.tops(quantity, sizes, _first(peaks, PREDICTED, inside), known)
        by_height = sorted(predicted, key=lambda peak: -predicted[peak][1])
        for point, line in _first(by_height, count, inside):
            top, height = predicted[point, line]
            near = APART * (speed[point + 1] - speed[point - 1])
            new = all(abs(top - other) > near for other in tops)
            new &= bool((np.abs(speed[_around(point, len(speed))] - top) > COINCIDE * abs(top)).all())
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


def higher_between(curves: ResponseCurves, known: KnownTops) -> tuple[HigherBetween, ...]:
    """Find what `missed_tops` left out among the highest peaks; `known` tops are not predicted again.

    These are estimates: the response was not computed at the tops.
    """
    found = []
    for quantity in curves.quantities if len(curves.speed) >= NEIGHBOURS else ():
        sizes = curves.sizes(quantity)
        highest = sizes.max(axis=2)
        ranked = quantity.peaks(highest, curves.ranked)[:PREDICTED]
        tops = curves.tops(quantity, sizes, ranked, known)
        excess = np.array([tops[peak][1] / highest[peak] - 1.0 if peak in tops else 0.0 for peak in ranked])
        if (noticed := np.flatnonzero(excess > NOTICED)).size:
            found.append(HigherBetween(quantity.name, int(noticed[0]) + 1, float(excess.max())))
    return tuple(found)


def _root(squares: Complexes) -> Floats:
    """Return the surface velocity from its mean square (..., 1), which is a rational function of speed."""
    return np.asarray(np.sqrt(np.maximum(squares[..., 0].real, 0.0)))


def _first(peaks: list[Peak], count: int, inside: Booleans) -> list[Peak]:
    """Return so many of the first peaks (point, line), and as many of those whose points are `inside`."""
    operating = [peak for peak in peaks if inside[peak[0]]]
    return list(dict.fromkeys(peaks[:count] + operating[:count]))


def missed_flanks(curves: ResponseCurves) -> Floats:
    """Return speeds beside the highest peaks that are drawn as triangles: with fewer than two points above half height.

    Notes
    -----
    Near the top A of a resonance the amplitude at a distance d is A / sqrt(1 + (d / w)^2). The first point below A / 2
    on a flank gives w. Other modes may add to that point, and w is too large; the next call then comes closer.
    """
    speed = curves.speed
    more: list[float] = []
    for quantity in curves.quantities:
        sizes = curves.sizes(quantity).max(axis=2)
        for point, line in quantity.peaks(sizes, curves.ranked)[:DRAWN]:
            if curves.is_smooth(_around(point, len(speed))):
                for side in (slice(point, None), slice(point, None, -1)):
                    more += _on_flank(speed[side], sizes[side, line])
    taken = list(speed)
    for added in sorted(more):
        if np.abs(np.array(taken) - added).min() > COINCIDE * abs(added):
            taken.append(added)
    return np.array(taken[len(speed) :])


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
