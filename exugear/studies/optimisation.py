"""Search for parameters that make one figure small, or two that are weighed against each other.

Each search is scipy's differential evolution: generations of points, computed as any points of a study, so that they
are kept, shared by all searches, and found again after a kill. Two figures are brought into one by the larger of both,
weighed and over their values of the case as it is (Chebyshev), which reaches bent-in fronts as well.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.studies.batches import Task, Work
from exugear.studies.dataset import dataset_of, write_study
from exugear.studies.design.distributions import shares
from exugear.studies.design.sampling import Axis, Design, Point, acting, units_of
from exugear.studies.executors import Kept, Opens, processes
from exugear.studies.journal import Record, read_journals
from exugear.studies.schedule import compute_points
from exugear.studies.study import Study
from exugear.studies.sweep import Progress, Swept, task_of
from fe_ste.tools.arrays import Booleans, Floats

if TYPE_CHECKING:
    import xarray as xr

EVALUATION = "evaluation"
"""Dimension of the points that a search looked at, in its order; the first is the case as it is."""
BLEND = 0.05
"""Share of the sum of both figures beside the larger one: of two points that are equal in one, the better wins."""


class OptimisationError(RuntimeError):
    """A search that cannot begin."""


def value_of(record: Record, figure: str) -> float:
    """Figure of a point; infinite where it failed or is not finite."""
    value = record.values.get(figure)
    return math.inf if value is None else float(value)


@dataclass
class _Evaluated:
    """Points that searches looked at.

    Attributes
    ----------
    study : Study
    task : Task
    opens : Opens
    tell : Progress, optional
    """

    study: Study
    task: Task
    opens: Opens
    tell: Progress | None
    points: dict[str, tuple[Floats, Mapping[str, Any]]] = field(default_factory=dict)
    records: dict[str, Record] = field(default_factory=dict)
    computed: int = 0

    @property
    def figures(self) -> list[str]:
        """Names of the figures that are made small."""
        assert self.study.file.optimise is not None
        return self.study.file.optimise.minimise

    def look_at(self, values: Floats) -> Floats:
        """Figures (points, figures) at parameters (points, parameters); infinite where a point failed."""
        return self._figures([(row, self._changes(row)) for row in values])

    def of_case(self) -> Floats:
        """Figures (figures,) of the case as it is.

        Raises
        ------
        OptimisationError
            It has none.
        """
        nothing = np.full(len(self.study.file.parameters), math.nan)
        found = self._figures([(nothing, {})])[0]
        if not np.isfinite(found).all():
            (record,) = self.records.values()
            raise OptimisationError(f"the case as it is gives no figures: {record.error or record.values}")
        return np.asarray(found)

    def _changes(self, row: Floats) -> dict[str, Any]:
        parameters = self.study.file.parameters.values()
        return {
            path: acting(parameter, self.study.gearbox, path, float(f"{value:.6g}"))
            for parameter, value in zip(parameters, row, strict=True)
            for path in parameter.targets
        }

    def _figures(self, wanted: Sequence[tuple[Floats, Mapping[str, Any]]]) -> Floats:
        names = [self.study.hash_of(changes) for _, changes in wanted]
        self.points |= dict(zip(names, wanted, strict=True))
        unknown = dict.fromkeys(name for name in names if name not in self.records)
        self.records |= read_journals(self.task.folder, unknown)
        missing = [Work(name, self.points[name][1]) for name in unknown if name not in self.records]
        self.records |= compute_points(self.task, missing, self.opens, self._told)
        self.computed += len(missing)
        return np.array([[value_of(self.records[name], figure) for figure in self.figures] for name in names])

    def _told(self, record: Record) -> None:
        if self.tell is not None:
            failed = sum(bool(own.error) for own in self.records.values()) + bool(record.error)
            self.tell(len(self.records), failed, self.expected)

    @property
    def expected(self) -> int:
        """Most points that all searches look at."""
        wanted = self.study.file.optimise
        assert wanted is not None
        searches = wanted.weightings if len(wanted.minimise) == 2 else 1
        return 1 + searches * wanted.population * (wanted.generations + 1)


def optimise(
    study: Study, folder: str | Path, opens: Opens | None = None, *, progress: Progress | None = None
) -> Swept:
    """Search for the parameters of a study that has a section ``optimise``.

    Parameters
    ----------
    study : Study
    folder : path
        Where points and the dataset are kept.
    opens : callable, optional
        Starts workers; processes on all cores by default.
    progress : callable, optional

    Returns
    -------
    Swept
        Its dataset holds all points that were looked at; `on_front` says which of them no other beats in all figures.

    Raises
    ------
    OptimisationError
        The case as it is has no figures, or there is no such section.
    ExecutorError, OSError
        As `exugear.studies.sweep.sweep`.
    """
    wanted, folder = study.file.optimise, Path(folder)
    if wanted is None:
        raise OptimisationError("the study has no section [optimise]")
    with Kept(opens or processes()) as workers:
        seen = _Evaluated(study, task_of(study, folder), workers.opened, progress)
        reference = seen.of_case()
        pair = len(wanted.minimise) == 2
        weights = np.linspace(1.0, 0.0, wanted.weightings) if pair and wanted.weightings > 1 else np.array([0.5])
        for number, first in enumerate(weights):
            weighed = np.array([first, 1.0 - first]) if pair else np.ones(1)
            _search(seen, weighed / reference, study.file.seed + number)
    dataset = _dataset(study, seen)
    return Swept(seen.records, seen.computed, write_study(folder, dataset), dataset)


def _search(seen: _Evaluated, weights: Floats, seed: int) -> None:
    """One search; it begins with points spread evenly and with the best that was seen before."""
    from scipy.optimize import Bounds, differential_evolution

    wanted = seen.study.file.optimise
    assert wanted is not None
    limits = [parameter.uniform for parameter in seen.study.file.parameters.values()]
    low = np.array([own.least for own in limits if own is not None])
    high = np.array([own.most for own in limits if own is not None])
    begin = low + shares("latin_hypercube", wanted.population, len(low), seed) * (high - low)
    known = _best(seen, weights, wanted.population // 4)
    begin[: len(known)] = known

    def objective(columns: Floats, /, *_: Any) -> Any:  # of all columns at once, which its type does not know
        return mixed(seen.look_at(np.atleast_2d(columns.T)), weights)

    differential_evolution(
        objective,
        Bounds(low, high),
        init=begin,
        maxiter=wanted.generations,
        rng=np.random.default_rng(seed),
        polish=False,
        vectorized=True,
        updating="deferred",
        tol=1e-3,
    )


def mixed(figures: Floats, weights: Floats) -> Floats:
    """Bring figures (points, figures) into one number each: the largest when weighed, and a little of all.

    Examples
    --------
    >>> mixed(np.array([[1.0, 4.0], [2.0, 2.0]]), np.array([1.0, 1.0])).tolist()
    [4.25, 2.2]
    """
    weighed = figures * np.where(weights == 0.0, 1e-12, weights)
    return np.asarray(weighed.max(axis=1) + BLEND * weighed.sum(axis=1))


def _best(seen: _Evaluated, weights: Floats, count: int) -> Floats:
    """Parameters (count, parameters) of the best points that were seen."""
    names = [name for name, (row, _) in seen.points.items() if np.isfinite(row).all()]
    if not names or not count:
        return np.zeros((0, len(seen.study.file.parameters)))
    found = np.array([[value_of(seen.records[name], figure) for figure in seen.figures] for name in names])
    order = np.argsort(mixed(found, weights), kind="stable")[:count]
    return np.array([seen.points[names[n]][0] for n in order])


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


def _dataset(study: Study, seen: _Evaluated) -> xr.Dataset:
    """All points that were looked at, in their order."""
    rows = np.array([row for row, _ in seen.points.values()])
    points = tuple(Point((n,), changes) for n, (_, changes) in enumerate(seen.points.values()))
    axes = {EVALUATION: Axis((EVALUATION,), np.arange(len(points)))}
    for n, (name, parameter) in enumerate(study.file.parameters.items()):
        axes[name] = Axis((EVALUATION,), rows[:, n], units_of(parameter), ", ".join(parameter.targets))
    looked_at = replace(study, design=Design({EVALUATION: len(points)}, axes, points))
    dataset = dataset_of(looked_at, seen.records)
    figures = np.array([dataset[name].to_numpy() for name in seen.figures]).T
    front = on_front(np.where(np.isnan(figures), np.inf, figures))
    words = {"long_name": "whether no other point is better in all figures that are made small"}
    return dataset.assign(on_front=((EVALUATION,), front.astype(np.int8), words))
