"""Execution of studies and optimisations: missing points are computed, and all points combined into a dataset.

Each optimisation uses scipy's differential evolution. Its generations of points are computed like those of any study:
they are stored, shared by all searches, and reused after an interruption. Two outputs are combined as the larger of
both, weighted and relative to their values for the unchanged gearbox (Chebyshev), which also reaches non-convex Pareto
fronts. Limits are constraints of the evolution. With tolerances, each point is evaluated for the same set of draws, and
a percentile of each output counts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.studies.dataset import Criteria, EvaluatedPoint, Side, beyond, dataset_of, searched_dataset, write_study
from exugear.studies.executors import (
    Opens,
    PersistentPool,
    PointInput,
    Record,
    Task,
    compute_points,
    number_of,
    processes,
    read_journals,
)
from exugear.studies.sampling import acting, shares
from exugear.studies.study import Study
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import write_file

if TYPE_CHECKING:
    import xarray as xr

STUDY_FILE = "study.json"


@dataclass(frozen=True)
class Shard:
    """Part of a study: every n-th point."""

    number: int
    of: int
    """Number of parts; this is part `number` of `of`, counted from 1."""

    def __post_init__(self) -> None:
        """Refuse a part that does not exist."""
        if not 1 <= self.number <= self.of:
            raise ValueError(f"shard {self.number}/{self.of}: parts are 1/{self.of} to {self.of}/{self.of}")

    @classmethod
    def from_text(cls, text: str) -> Shard:
        """Read ``i/n``.

        Examples
        --------
        >>> Shard.from_text("2/8")
        Shard(number=2, of=8)
        """
        number, stroke, of = text.partition("/")
        if not (stroke and number.isdecimal() and of.isdecimal()):
            raise ValueError(f"shard {text!r}: must be i/n, such as 1/8")
        return cls(int(number), int(of))


WHOLE = Shard(1, 1)
Progress = Callable[[int, int, int], None]
"""Called with the numbers of finished points, of failed points among them, and of all points."""


@dataclass(frozen=True)
class StudyResult:
    """Result of the execution of a study."""

    records: Mapping[str, Record]
    """By hash, all its finished points."""
    computed: int
    """Number of points computed in this call."""
    path: Path | None
    """File of the dataset; None for a part if other parts are not finished."""
    dataset: xr.Dataset | None

    @property
    def failed(self) -> list[Record]:
        """Failed points."""
        return [record for record in self.records.values() if record.error]


def run_study(
    study: Study,
    folder: str | Path,
    opens: Opens | None = None,
    *,
    shard: Shard = WHOLE,
    retry: bool = False,
    merge: bool = False,
    progress: Progress | None = None,
) -> StudyResult:
    """Execute a study; points already finished in the folder are reused.

    Parameters
    ----------
    folder : folder of the points, shared results and the dataset
    opens : callable, optional
        Starts workers, see `exugear.studies.executors`; processes on all cores by default.
    shard : the part to compute
    retry : whether to compute failed points again
    merge : whether to combine the available points without any computation

    Raises
    ------
    ExecutorError
        Workers cannot be reached.
    OSError
        Results cannot be written.
    """
    folder = Path(folder)
    points = {name: point.changes for name, point in study.hashed_points()}
    mine = list(points)[shard.number - 1 :: shard.of]
    records = read_journals(folder, points)
    wanted = [] if merge else [name for name in mine if name not in records or (retry and records[name].error)]
    known = sum(name in records for name in mine) - sum(name in records for name in wanted)
    failures = 0

    def tell(record: Record) -> None:
        nonlocal known, failures
        known += 1
        failures += bool(record.error)
        if progress is not None:
            progress(known, failures, len(mine))

    if progress is not None:
        progress(known, 0, len(mine))
    if wanted:
        folder.mkdir(parents=True, exist_ok=True)
        write_file(folder / STUDY_FILE, study.file.model_dump_json(indent=1, exclude_none=True).encode("utf-8"))
        work = [PointInput(name, points[name]) for name in wanted]
        records |= compute_points(task_of(study, folder), work, opens or processes(), tell)
    records |= {name: record for name, record in read_journals(folder, points).items() if name not in records}
    if len(records) < len(points) and not merge:
        return StudyResult(records, len(wanted), None, None)
    dataset = dataset_of(study, records)
    return StudyResult(records, len(wanted), write_study(folder, dataset), dataset)


def task_of(study: Study, folder: Path) -> Task:
    """Return the common data of all points."""
    gearbox = study.gearbox
    names = {path: name for name, parameter in study.file.parameters.items() for path in parameter.targets}
    settings = (study.choice, study.settings, study.outputs)
    return Task(gearbox.content, gearbox.source, gearbox.permissions, *settings, folder, names)


# Optimisation: parameters that minimise one output, or two with weights, within limits of other outputs

BLEND = 0.05
"""Weight of the sum of both outputs next to the larger one, which decides between points with an equal maximum."""


class OptimisationError(RuntimeError):
    """Error: an optimisation cannot begin."""


@dataclass
class _Evaluated:
    """Points evaluated by optimisations."""

    study: Study
    task: Task
    opens: Opens
    tell: Progress | None
    criteria: Criteria
    points: dict[str, EvaluatedPoint] = field(default_factory=dict)
    records: dict[str, Record] = field(default_factory=dict)
    computed: int = 0

    def look_at(self, values: Floats) -> list[EvaluatedPoint]:
        """Evaluate parameters (points, parameters); known points are reused."""
        varied = []
        for row in values:
            changes = {
                path: acting(parameter, self.study.gearbox, path, float(f"{value:.6g}"))
                for parameter, value in zip(self.study.file.parameters.values(), row, strict=True)
                for path in parameter.targets
            }
            varied.append((row, changes))
        return self.evaluate(varied)

    def minimised(self, points: Sequence[EvaluatedPoint]) -> Floats:
        """Return the outputs (points, outputs) to be minimised; infinite where a point failed."""
        names = self.criteria.outputs
        found = [[self._judged(point, name, "high") for name in names] for point in points]
        return np.array(found).reshape(len(points), len(names))

    def violations(self, points: Sequence[EvaluatedPoint]) -> Floats:
        """Return the violations of limits (points, limits), relative to the limit; negative within limits."""
        limits = self.criteria.limits
        found = [
            [beyond(self._judged(point, name, side), side, limit) for name, side, limit in limits] for point in points
        ]
        return np.array(found).reshape(len(points), len(limits))

    def _judged(self, point: EvaluatedPoint, output: str, side: Side) -> float:
        """Return an output of a point, or its percentile over the draws of tolerances."""
        values = np.array([number_of(self.records[name].values.get(output)) for name, _ in point.draws])
        return float(self.criteria.reduce_draws(values, side))

    def evaluate(self, varied: list[tuple[Floats, dict[str, Any]]]) -> list[EvaluatedPoint]:
        """Evaluate points given by their parameters and the values by path in the gearbox file."""
        tolerances = self.study.tolerances
        wanted = []
        for row, changes in varied:
            drawn = [changes] if tolerances is None else tolerances.produced(self.study.gearbox, changes)
            wanted.append(EvaluatedPoint(row, tuple((self.study.hash_of(draw), draw) for draw in drawn)))
        self.points |= {looked.draws[0][0]: looked for looked in wanted}  # equal parameters give the same point
        draws = {name: changes for looked in wanted for name, changes in looked.draws}
        unknown = [name for name in draws if name not in self.records]
        if unknown:
            self.records |= read_journals(self.task.folder, set(unknown))
        missing = [PointInput(name, draws[name]) for name in unknown if name not in self.records]
        if missing:
            self.records |= compute_points(self.task, missing, self.opens, self._report_record)
        self.computed += len(missing)
        return wanted

    def _report_record(self, record: Record) -> None:
        """Report the numbers of finished and failed points, and the maximum number of points of all searches."""
        self.records[record.point] = record
        wanted = self.study.file.optimise
        if self.tell is None or wanted is None:
            return
        failed = sum(bool(known.error) for known in self.records.values())
        searches = wanted.weightings if len(wanted.minimise) == 2 else 1
        points = 1 + searches * wanted.population * (wanted.generations + 1)
        draws = 1 if self.study.tolerances is None else len(self.study.tolerances.draws)
        self.tell(len(self.records), failed, points * draws)


def optimise(
    study: Study, folder: str | Path, opens: Opens | None = None, *, progress: Progress | None = None
) -> StudyResult:
    """Optimise the parameters of a study with a section ``optimise``.

    Returns
    -------
    StudyResult
        Its dataset holds all evaluated points; `on_front` marks the Pareto-optimal ones, `meets_limits` those within
        all limits.

    Raises
    ------
    OptimisationError
        The unchanged gearbox has no outputs, or there is no such section.
    ExecutorError, OSError
        As `exugear.studies.runner.run_study`.
    """
    wanted = study.file.optimise
    folder = Path(folder)
    if wanted is None:
        raise OptimisationError("the study has no section [optimise]")
    with PersistentPool(opens or processes()) as workers:
        seen = _Evaluated(study, task_of(study, folder), workers.opened, progress, Criteria.of(study.file))
        (unchanged,) = seen.evaluate([(np.full(len(study.file.parameters), math.nan), {})])
        reference = seen.minimised([unchanged])[0]
        if not np.isfinite(reference).all():
            records = [seen.records[name] for name, _ in unchanged.draws]
            reason = next((record.error for record in records if record.error), records[0].values)
            raise OptimisationError(f"the unchanged gearbox has no results: {reason}")
        pair = len(wanted.minimise) == 2
        weights = np.linspace(1.0, 0.0, wanted.weightings) if pair and wanted.weightings > 1 else np.array([0.5])
        for number, first in enumerate(weights):
            weighed = np.array([first, 1.0 - first]) if pair else np.ones(1)
            scale = np.where(reference == 0.0, 1.0, np.abs(reference))
            _search(seen, weighed / scale, study.file.seed + number)
    dataset = searched_dataset(study, seen.criteria, list(seen.points.values()), seen.records)
    return StudyResult(seen.records, seen.computed, write_study(folder, dataset), dataset)


def _search(seen: _Evaluated, weights: Floats, seed: int) -> None:
    """Run one search from evenly distributed points and the best known ones."""
    from scipy.optimize import Bounds, NonlinearConstraint, differential_evolution

    wanted = seen.study.file.optimise
    assert wanted is not None
    limits = [parameter.uniform for parameter in seen.study.file.parameters.values()]
    low = np.array([limit.min for limit in limits if limit is not None])
    high = np.array([limit.max for limit in limits if limit is not None])
    begin = low + shares("latin_hypercube", wanted.population, len(low), seed) * (high - low)
    known = [point for point in seen.points.values() if np.isfinite(point.row).all()]
    if known:  # those within all limits first
        excess = np.maximum(seen.violations(known), 0.0).sum(axis=1)
        best = np.lexsort((mixed(seen.minimised(known), weights), excess))[: wanted.population // 4]
        begin[: len(best)] = [known[n].row for n in best]

    def objective(columns: Floats, /, *_: Any) -> Any:  # takes all columns at once, which its type does not state
        return mixed(seen.minimised(seen.look_at(np.atleast_2d(columns.T))), weights)

    def violations(columns: Floats) -> Any:
        return seen.violations(seen.look_at(np.atleast_2d(columns.T))).T

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
        constraints=NonlinearConstraint(violations, -np.inf, 0.0) if seen.criteria.limits else (),
    )


def mixed(outputs: Floats, weights: Floats) -> Floats:
    """Combine outputs (points, outputs) into one number each: the weighted maximum plus a small part of the sum.

    Examples
    --------
    >>> mixed(np.array([[1.0, 4.0], [2.0, 2.0]]), np.array([1.0, 1.0])).tolist()
    [4.25, 2.2]
    """
    weighed = outputs * np.where(weights == 0.0, 1e-12, weights)
    return np.asarray(weighed.max(axis=1) + BLEND * weighed.sum(axis=1))
