"""Load duration distributions: how long, and for how many revolutions, a load lies in each of its bins.

For whatever turns through its load, such as teeth and roller bearings, revolutions at a load are its cycles. Loads of
either sign have bins of their own, since they press on other flanks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_ste.tools.arrays import Floats


@dataclass(frozen=True, eq=False)
class DurationDistribution:
    """Hours and revolutions over bins of torque; empty bins are left out.

    Attributes
    ----------
    lower, upper : array (bins,)
        Edges, N m, by size: the upper one is farther from zero; both have the sign of the torque.
    torque : array (bins,)
        Mean of what lies in the bin, each instant weighted by its revolutions, N m.
    hours, revolutions : array (bins,)
        Of the shaft whose torque it is.
    """

    lower: Floats
    upper: Floats
    torque: Floats
    hours: Floats
    revolutions: Floats

    def __repr__(self) -> str:
        """Return one short line."""
        return f"<DurationDistribution: {len(self.hours)} bins, {self.hours.sum():.6g} h>"

    @property
    def speed(self) -> Floats:
        """Mean speed of each bin, rad/s, without sign."""
        return np.asarray(2.0 * np.pi * self.revolutions / (3600.0 * self.hours))

    def torques(self, value: str) -> Floats:
        """Torque that stands for each bin: its ``mean``, or its ``upper`` edge, which adds damage."""
        return self.upper if value == "upper" else self.torque


def load_duration(torque: Floats, speed: Floats, hours: Floats, bins: int) -> DurationDistribution:
    """Sort samples of torque into bins of equal width, from zero to the largest.

    Parameters
    ----------
    torque, speed, hours : array (samples,)
        N m, rad/s, and how long each sample lasts in the whole of the life.
    bins : int
        Bins of either sign.

    Examples
    --------
    An hour at 100 N m and one at 40 N m, half as fast:

    >>> found = load_duration(np.array([100.0, 40.0]), np.array([2.0, 1.0]), np.ones(2), 10)
    >>> found.torque.tolist(), found.hours.tolist(), (found.revolutions[1] / found.revolutions[0]).round(6).item()
    ([40.0, 100.0], [1.0, 1.0], 2.0)
    """
    width = float(np.abs(torque).max(initial=0.0)) / bins or 1.0
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


def equivalent_load(load: Floats, cycles: Floats, exponent: float) -> float:
    """Constant load that does the same damage in as many cycles, by Miner's rule with one slope.

    Parameters
    ----------
    load : array
        Taken without sign.
    cycles : array
    exponent : float
        Slope of the S-N curve.

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
