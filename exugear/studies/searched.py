"""What a search looked at: points by their figures and limits, and the dataset of all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from exugear.studies.dataset import dataset_of
from exugear.studies.design.sampling import SAMPLE, Axis, Design, Point, units_of
from exugear.studies.design.sections import LimitSection, StudyFile
from exugear.studies.design.tolerances import percentile_of
from exugear.studies.journal import Record
from exugear.studies.study import Study
from fe_ste.tools.arrays import Booleans, Floats

if TYPE_CHECKING:
    import xarray as xr

EVALUATION = "evaluation"
"""Dimension of the points that a search looked at, in its order; the first is the case as it is."""
USUAL_PERCENTILE = 95.0
FAR = 1e9
"""Violation of a limit by what has no end."""
Side = Literal["high", "low"]
"""The end of a figure's spread over tolerances that counts: the high one of what is made small or limited above."""


@dataclass(frozen=True, eq=False)
class Looked:
    """A point that a search looked at."""

    row: Floats
    """(parameters,) NaN for the case as it is."""
    draws: tuple[tuple[str, Mapping[str, Any]], ...]
    """Hash and values at paths of the case of each draw of the tolerances; one without tolerances."""

    @property
    def key(self) -> str:
        """What it is found by: equal parameters are one point."""
        return self.draws[0][0]


Figure = Callable[[Looked, str], Floats]
"""Gives a figure of all draws of a point; NaN where one failed."""


@dataclass(frozen=True)
class Criteria:
    """What points of a search are judged by."""

    figures: tuple[str, ...]
    """Made small."""
    limits: tuple[tuple[str, Side, float], ...]
    """Figure, the side that is limited, and the limit."""
    percentile: float
    """Over tolerances, of the bad side."""

    @classmethod
    def of(cls, study: StudyFile) -> Criteria:
        """Read them from a study file with a section `optimise`."""
        wanted = study.optimise
        assert wanted is not None
        limits = tuple(one for name, limit in wanted.limits.items() for one in _limits(name, limit))
        return cls(tuple(wanted.minimise), limits, wanted.percentile or USUAL_PERCENTILE)

    @property
    def sides(self) -> list[tuple[str, Side]]:
        """Figures with the side of their spread that counts, each once."""
        minimised: list[tuple[str, Side]] = [(name, "high") for name in self.figures]
        return list(dict.fromkeys([*minimised, *((name, side) for name, side, _ in self.limits)]))

    def percent(self, side: Side) -> float:
        """Percentile of a side."""
        if side == "high":
            return self.percentile
        return 100.0 - self.percentile

    def over_draws(self, values: Floats, side: Side) -> Floats:
        """Bring a figure (..., draws) into one value; a draw that failed counts as worst."""
        filled = np.where(np.isnan(values), np.inf if side == "high" else -np.inf, values)
        if filled.shape[-1] == 1:
            return filled[..., 0]
        return percentile_of(filled, self.percent(side))

    def minimised(self, figure: Figure, points: Sequence[Looked]) -> Floats:
        """Figures (points, figures) that are made small; infinite where a point failed."""
        found = [[float(self.over_draws(figure(point, name), "high")) for name in self.figures] for point in points]
        return np.array(found).reshape(len(points), len(self.figures))

    def violations(self, figure: Figure, points: Sequence[Looked]) -> Floats:
        """How far points are beyond limits (points, limits), over the size of the limit; negative within."""
        found = [
            [
                beyond(float(self.over_draws(figure(point, name), side)), side, limit)
                for name, side, limit in self.limits
            ]
            for point in points
        ]
        return np.array(found).reshape(len(points), len(self.limits))


def _limits(name: str, limit: LimitSection) -> list[tuple[str, Side, float]]:
    sides: list[tuple[Side, float | None]] = [("high", limit.most), ("low", limit.least)]
    return [(name, side, value) for side, value in sides if value is not None]


def beyond(value: float, side: Side, limit: float) -> float:
    """How far a value is beyond a limit of its high or low side, over the size of the limit.

    Examples
    --------
    >>> beyond(1.1, "low", 1.0), beyond(float("inf"), "high", 2.0)
    (-0.1..., 1000000000.0)
    """
    difference = value - limit if side == "high" else limit - value
    return float(np.clip(difference / (abs(limit) or 1.0), -FAR, FAR))


def on_front(figures: Floats) -> Booleans:
    """Tell which points (points, figures) no other one beats: not larger in any figure and smaller in one.

    Examples
    --------
    >>> on_front(np.array([[1.0, 4.0], [2.0, 2.0], [3.0, 3.0]])).tolist()
    [True, True, False]
    """
    kept: Booleans = np.asarray(np.isfinite(figures).all(axis=1))
    for n in np.flatnonzero(kept):
        beaten = (figures <= figures[n]).all(axis=1) & (figures < figures[n]).any(axis=1)
        kept[n] = not beaten.any()
    return kept


def searched_dataset(
    study: Study, criteria: Criteria, points: Sequence[Looked], records: Mapping[str, Record]
) -> xr.Dataset:
    """All points that a search looked at, in their order, with the percentiles that they were judged by.

    Parameters
    ----------
    records : by hash
    """
    dataset = dataset_of(replace(study, design=_design(study, points)), records)
    judged = {side: _judged(dataset, study, criteria, *side) for side in criteria.sides}
    words = {"long_name": "whether all limits are kept"}
    kept = np.ones(len(points), dtype=bool)
    for name, side, limit in criteria.limits:
        kept &= np.array([beyond(float(value), side, limit) <= 0.0 for value in judged[name, side].to_numpy()])
    figures = np.array([judged[name, "high"].to_numpy() for name in criteria.figures]).T
    front = on_front(np.where(kept[:, None], figures, np.inf))
    if study.tolerances is not None:
        dataset = dataset.assign({judged_name(study, *side): values for side, values in judged.items()})
    if criteria.limits:
        dataset = dataset.assign(meets_limits=((EVALUATION,), kept.astype(np.int8), words))
    words = {"long_name": "whether no other point within all limits is better in all figures that are made small"}
    return dataset.assign(on_front=((EVALUATION,), front.astype(np.int8), words))


def judged_name(study: Study, name: str, side: Side) -> str:
    """Variable of the dataset that points are judged by: the figure, or its percentile over the tolerances."""
    if study.tolerances is None:
        return name
    return f"{name}_{side}"


def _judged(dataset: xr.Dataset, study: Study, criteria: Criteria, name: str, side: Side) -> xr.DataArray:
    """Give a figure of each point, or its percentile over tolerances; infinite where draws failed."""
    import xarray as xr

    values = dataset[name].to_numpy().reshape(dataset.sizes[EVALUATION], -1)
    told = f"{criteria.percent(side):g}th percentile of {name} over {values.shape[1]} draws of the tolerances"
    told += f" ({study.file.sampling}, seed {study.file.seed}, the same at every point)"
    attributes = {"units": dataset[name].attrs["units"], "long_name": told}
    return xr.DataArray(criteria.over_draws(values, side), dims=(EVALUATION,), attrs=attributes)


def _design(study: Study, points: Sequence[Looked]) -> Design:
    """Points over evaluations, and over the draws of tolerances."""
    rows = np.array([point.row for point in points])
    tolerances = study.tolerances
    axes = {EVALUATION: Axis((EVALUATION,), np.arange(len(points)))}
    for n, (name, parameter) in enumerate(study.file.parameters.items()):
        axes[name] = Axis((EVALUATION,), rows[:, n], units_of(parameter), ", ".join(parameter.targets))
    if tolerances is None:
        flat = tuple(Point((n,), point.draws[0][1]) for n, point in enumerate(points))
        return Design({EVALUATION: len(points)}, axes, flat)
    count = len(tolerances.draws)
    axes |= {SAMPLE: Axis((SAMPLE,), np.arange(1, count + 1)), **tolerances.axes}
    drawn = tuple(Point((n, m), own) for n, point in enumerate(points) for m, (_, own) in enumerate(point.draws))
    return Design({EVALUATION: len(points), SAMPLE: count}, axes, drawn)
