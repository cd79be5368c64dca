"""What acts on a gearbox, as its parts are rated under it: points of its distribution, and the worst of all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exugear.life.counting.duration import LoadPoints
from exugear.life.load_spectrum.counted import CountedLoads
from fe_ste.tools.arrays import Floats


@dataclass(frozen=True, eq=False)
class ActingLoads:
    """Loads over a life."""

    points: LoadPoints
    """What wears, with the loads of a hub beside the torque."""
    worst_torque: Floats
    worst_hub: Floats
    """(w,), (w, 5) what counts for static safety: the ends of the distribution, and extreme sources with their
    partial factors; N m, N and N m."""
    bins: int
    """Bins of the distribution that the points belong to."""
    slowest: float
    fastest: float
    """Least and largest speed of the body under a torque, rad/s without sign, extreme sources among them."""

    @property
    def torques(self) -> Floats:
        """All torques, N m."""
        return np.concatenate([self.points.torque, self.worst_torque])

    @property
    def hub_sizes(self) -> Floats:
        """Largest of each load of a hub without sign, (5,)."""
        return np.asarray(np.abs(np.concatenate([self.points.other, self.worst_hub])).max(axis=0))

    def worst(self, sense: int) -> tuple[Floats, Floats]:
        """Torques of one sign, points among them, and the loads of a hub beside them."""
        torque = self.torques
        hub = np.concatenate([self.points.other, self.worst_hub])
        own = torque * sense > 0.0
        return torque[own], hub[own]

    def by_bin(self, values: Floats) -> Floats:
        """Sum values of points (points,) into the bins of the distribution, (bins,)."""
        return np.asarray(np.bincount(self.points.bin, values, self.bins), dtype=np.float64)


def acting_loads(counted: CountedLoads) -> ActingLoads:
    """Gather what acts of counted loads."""
    distribution = counted.distribution
    extremes = [source for source in counted.sources if source.kind == "extreme"]
    ends = np.array([distribution.upper.max(), distribution.upper.min()])
    return ActingLoads(
        points=counted.points,
        worst_torque=np.concatenate([ends, *(extreme.torque for extreme in extremes)]),
        worst_hub=np.concatenate(
            [np.zeros((2, counted.points.other.shape[1])), *(extreme.hub_loads for extreme in extremes)]
        ),
        bins=len(distribution.hours),
        slowest=min(source.slowest for source in counted.sources),
        fastest=max(source.fastest for source in counted.sources),
    )
