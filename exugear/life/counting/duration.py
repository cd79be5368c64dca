"""Load duration distributions: how long, and for how many revolutions, a load lies in each of its bins.

For whatever turns through its load, such as teeth and roller bearings, revolutions at a load are its cycles. Loads of
either sign have bins of their own, since they press on other flanks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import Displayed


@dataclass(frozen=True, eq=False)
class DurationDistribution(Displayed):
    """Hours and revolutions over bins of torque; empty bins are left out."""

    lower: Floats
    upper: Floats
    """(bins,) edges, N m, by size: the upper one is farther from zero; both have the sign of the torque."""
    torque: Floats
    """(bins,) mean of what lies in the bin, each instant weighted by its revolutions, N m."""
    hours: Floats
    revolutions: Floats
    """(bins,) of the shaft whose torque it is."""

    def _line(self) -> str:
        return f": {len(self.hours)} bins, {self.hours.sum():.6g} h"

    @property
    def speed(self) -> Floats:
        """Mean speed of each bin, rad/s, without sign."""
        seconds = 3600.0 * self.hours
        return np.divide(2.0 * np.pi * self.revolutions, seconds, out=np.zeros_like(seconds), where=seconds > 0.0)

    def torques(self, value: str) -> Floats:
        """Torque that stands for each bin: its ``mean``, or its ``upper`` edge, which adds damage."""
        if value == "upper":
            return self.upper
        return self.torque


def load_duration(
    torque: Floats, speed: Floats, hours: Floats, bins: int, largest: float | None = None
) -> DurationDistribution:
    """Sort samples of torque into bins of equal width, from zero to the largest.

    Parameters
    ----------
    torque, speed, hours : (samples,) N m, rad/s, and how long each sample lasts in the whole of the life
    bins : bins of either sign
    largest : torque at which the last bin ends, N m, where the samples stand for larger ones; their largest by default

    Examples
    --------
    An hour at 100 N m and one at 40 N m, half as fast:

    >>> found = load_duration(np.array([100.0, 40.0]), np.array([2.0, 1.0]), np.ones(2), 10)
    >>> found.torque.tolist(), found.hours.tolist(), (found.revolutions[1] / found.revolutions[0]).round(6).item()
    ([40.0, 100.0], [1.0, 1.0], 2.0)
    """
    width = (float(np.abs(torque).max(initial=0.0)) if largest is None else largest) / bins or 1.0
    place = np.minimum(np.floor(np.abs(torque) / width).astype(int), bins - 1) + 1
    place = np.where(torque < 0.0, -place, place)  # a torque of zero counts as positive
    turns = np.abs(speed) * hours * 3600.0 / (2.0 * np.pi)
    numbers, inverse = np.unique(place, return_inverse=True)
    total_hours = np.bincount(inverse, hours).astype(np.float64)
    revolutions = np.bincount(inverse, turns).astype(np.float64)
    by_turns = np.bincount(inverse, turns * torque) / np.where(revolutions > 0.0, revolutions, 1.0)
    by_hours = np.bincount(inverse, hours * torque) / np.where(total_hours > 0.0, total_hours, 1.0)
    sense = np.sign(numbers)
    return DurationDistribution(
        lower=sense * (np.abs(numbers) - 1) * width,
        upper=sense * np.abs(numbers) * width,
        torque=np.where(revolutions > 0.0, by_turns, by_hours),
        hours=total_hours,
        revolutions=revolutions,
    )


@dataclass(frozen=True, eq=False)
class LoadPoints(Displayed):
    """Torques with what acts beside them: the bins of a distribution, split where other loads differ."""

    torque: Floats
    """(points,) N m."""
    other: Floats
    """(points, n) loads beside it, means weighted by revolutions."""
    hours: Floats
    revolutions: Floats
    """(points,)"""
    bin: Integers
    """(points,) bin of the distribution that each point lies in."""

    def _line(self) -> str:
        return f": {len(self.hours)} points, {self.hours.sum():.6g} h"

    @property
    def speed(self) -> Floats:
        """Mean speed of each point, rad/s, without sign."""
        seconds = 3600.0 * self.hours
        return np.divide(2.0 * np.pi * self.revolutions, seconds, out=np.zeros_like(seconds), where=seconds > 0.0)


def load_points(
    distribution: DurationDistribution,
    value: str,
    torque: Floats,
    speed: Floats,
    hours: Floats,
    other: Floats,
    cells: int,
) -> LoadPoints:
    """Split the bins of a distribution by other loads.

    Parameters
    ----------
    found : DurationDistribution
        Of the same samples.
    value : as in `DurationDistribution.torques`
    torque, speed, hours : (samples,) as in `load_duration`
    other : (samples, n) loads beside the torque
    cells : cells from the least to the largest of each of them
    """
    torques = distribution.torques(value)
    if not other.any():
        zeros = np.zeros((len(torques), other.shape[1]))
        return LoadPoints(torques, zeros, distribution.hours, distribution.revolutions, np.arange(len(torques)))
    width = float(np.abs(distribution.upper - distribution.lower)[0])
    side = np.where(torque < 0.0, -1.0, 1.0)
    place = side * np.minimum(
        np.floor(np.abs(torque) / width), np.round(np.abs(distribution.upper).max() / width) - 1.0
    )
    number = np.argmin(
        np.abs((side * width * (np.abs(place) + 0.5))[:, None] - 0.5 * (distribution.lower + distribution.upper)),
        axis=1,
    )
    span = np.ptp(other, axis=0)
    cell = np.floor((other - other.min(axis=0)) / np.where(span > 0.0, span, 1.0) * (cells - 1e-9))
    keys, inverse = np.unique(np.column_stack([number, cell]), axis=0, return_inverse=True)
    inverse = inverse.ravel()
    turns = np.abs(speed) * hours * 3600.0 / (2.0 * np.pi)
    total = np.bincount(inverse, turns).astype(np.float64)
    means = [np.bincount(inverse, turns * column) / np.where(total > 0.0, total, 1.0) for column in other.T]
    bins = keys[:, 0].astype(np.int64)
    lasting = np.bincount(inverse, hours).astype(np.float64)
    return LoadPoints(torques[bins], np.array(means).T, lasting, total, bins)


def equivalent_load(load: Floats, cycles: Floats, exponent: float) -> float:
    """Constant load that does the same damage in as many cycles, by Miner's rule with one slope.

    Parameters
    ----------
    load : taken without sign
    exponent : slope of the S-N curve

    Examples
    --------
    >>> equivalent_load(np.array([0.0, 2.0]), np.array([7.0, 1.0]), 3.0)
    1.0
    """
    largest = float(np.abs(load).max(initial=0.0))
    total = float(np.sum(cycles))
    if largest == 0.0 or total == 0.0:
        return 0.0
    damage = float(np.sum(cycles * np.abs(load / largest) ** exponent)) / total
    return float(largest * damage ** (1.0 / exponent))
