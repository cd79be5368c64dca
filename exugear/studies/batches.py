"""Points computed in a worker, one after the other, each noted as soon as it is finished."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.named_files import Permissions
from exugear.gearbox.reading import CaseError
from exugear.results.folder import peak_memory
from exugear.studies.design.paths import changed
from exugear.studies.figures.figure import Values
from exugear.studies.figures.point_results import PointResults, PointSettings
from exugear.studies.figures.registry import KeptFigure
from exugear.studies.figures.shared import Shared
from exugear.studies.journal import Journal, Record, told_in_json
from exugear.system.readiness.readiness import check_parts
from fe_ste.tools.workers import StoppedError, stop_if_asked

LONG = 1.0
"""Seconds of a point after which it is brought to the disk by itself."""
SHARED_FOLDER = "shared"
WORK_FOLDER = "work"
SHOWN_VALUES, LONGEST_VALUE = 5, 200
"""Most parameters that the error of a point names, and most letters of each."""


@dataclass(frozen=True)
class Task:
    """What all points of a study have in common, as it is sent to a worker."""

    content: Mapping[str, Any]
    """Of the gearbox file, with the changes that all points have."""
    source: str
    permissions: Permissions
    choice: Choice
    settings: PointSettings
    figures: Mapping[str, KeptFigure]
    """By name."""
    folder: Path
    """Of the study."""
    parameters: Mapping[str, str] = field(default_factory=dict)
    """Mapping of path to str. Names of the parameters that set paths of the case."""


@dataclass(frozen=True)
class Work:
    """A point as it is sent to a worker: the hash of its input, and values at paths of the case."""

    point: str
    changes: Mapping[str, Any]


@lru_cache(maxsize=4)
def _journal(folder: Path) -> Journal:
    """Journal of this process; a worker takes batches of one study after the other."""
    return Journal(folder)


def compute_batch(task: Task, batch: Sequence[Work]) -> list[Record]:
    """Compute points; dense linear algebra keeps to one thread meanwhile.

    Raises
    ------
    StoppedError
        The results are wanted no more; what is finished is noted.
    OSError
        A finished point cannot be written.
    """
    journal = _journal(task.folder)
    records = []
    try:
        with threadpool_limits(1):
            for work in batch:
                stop_if_asked()
                record = compute_point(task, work)
                journal.add(record)
                records.append(record)
                if record.seconds > LONG:
                    journal.settle()
    finally:
        journal.settle()
    return records


def compute_point(task: Task, work: Work) -> Record:
    """Compute one point; whatever goes wrong with it is part of its record."""
    start = time.perf_counter()
    values: dict[str, Any] = {}
    error = ""
    doubts = []
    folder = task.folder / WORK_FOLDER / work.point[:32]
    try:
        gearbox = _built(task, work)
        results = PointResults(gearbox, task.choice, task.settings, Shared(task.folder / SHARED_FOLDER), folder)
        values = {name: _told(kept.of(results)) for name, kept in task.figures.items()}
        doubts = list(results.doubts)
        results.clear()
    except StoppedError:
        raise
    except Exception as reason:  # one point must not end the others, whatever it is
        values = {}
        error = f"{type(reason).__name__}: {reason}"
    return Record(work.point, values, error, doubts, round(time.perf_counter() - start, 6), peak_memory())


def _built(task: Task, work: Work) -> Gearbox:
    """Gearbox of a point; of one that cannot be, the error begins with the parameters and their values."""
    try:
        gearbox = Gearbox.from_dict(changed(task.content, work.changes), task.source, task.permissions)
        check_parts(gearbox)
        return gearbox
    except CaseError as error:
        own = [
            f"parameters.{task.parameters.get(path, '?')}: {path} = {value!r}"[:LONGEST_VALUE]
            for path, value in work.changes.items()
        ]
        more = [f"and {len(own) - SHOWN_VALUES} more"] if len(own) > SHOWN_VALUES else []
        raise CaseError(*("; ".join([*own[:SHOWN_VALUES], *more]) for _ in own[:1]), *error.faults) from None


def _told(values: Values) -> Any:
    """Values as a journal has them."""
    if isinstance(values, Mapping):
        return {name: told_in_json(float(value)) for name, value in values.items()}
    return told_in_json(float(values))
