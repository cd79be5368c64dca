"""A study carried out: what is there is taken, what is missing computed, all put together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from exugear.studies.batches import Task, Work
from exugear.studies.dataset import dataset_of, write_study
from exugear.studies.executors import Opens, processes
from exugear.studies.journal import Record, read_journals
from exugear.studies.schedule import compute_points
from exugear.studies.study import Study
from fe_ste.tools.files import write_file

if TYPE_CHECKING:
    import xarray as xr

STUDY_FILE = "study.json"


@dataclass(frozen=True)
class Shard:
    """A part of a study: every n-th point."""

    number: int
    of: int
    """Part `number` of `of`, counted from 1."""

    def __post_init__(self) -> None:
        """Refuse a part that there is not."""
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
            raise ValueError(f"shard {text!r}: must be i/n, as 1/8")
        return cls(int(number), int(of))


WHOLE = Shard(1, 1)
Progress = Callable[[int, int, int], None]
"""Called with the finished points, those that failed among them, and all."""


@dataclass(frozen=True)
class Swept:
    """What came of a study."""

    records: Mapping[str, Record]
    """By hash, of all its points that are finished."""
    computed: int
    """Points that were computed now."""
    path: Path | None
    """File of the dataset; none was written for a part whose other parts are not finished."""
    dataset: xr.Dataset | None
    """What it holds."""

    @property
    def failed(self) -> list[Record]:
        """Points that failed."""
        return [record for record in self.records.values() if record.error]


def sweep(
    study: Study,
    folder: str | Path,
    opens: Opens | None = None,
    *,
    shard: Shard = WHOLE,
    retry: bool = False,
    merge: bool = False,
    progress: Progress | None = None,
) -> Swept:
    """Carry out a study; points that are finished in the folder are not computed again.

    Parameters
    ----------
    folder : where points, what they share and the dataset are kept
    opens : callable, optional
        Starts workers, see `exugear.studies.executors`; processes on all cores by default.
    shard : the part to compute
    retry : whether points that failed before are computed again
    merge : compute nothing; put together what is there

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
        known = known + 1
        failures = failures + bool(record.error)
        if progress is not None:
            progress(known, failures, len(mine))

    if progress is not None:
        progress(known, 0, len(mine))
    if wanted:
        folder.mkdir(parents=True, exist_ok=True)
        write_file(folder / STUDY_FILE, study.file.model_dump_json(indent=1, exclude_none=True).encode("utf-8"))
        work = [Work(name, points[name]) for name in wanted]
        records |= compute_points(task_of(study, folder), work, opens or processes(), tell)
    records |= {name: record for name, record in read_journals(folder, points).items() if name not in records}
    if len(records) < len(points) and not merge:
        return Swept(records, len(wanted), None, None)
    dataset = dataset_of(study, records)
    return Swept(records, len(wanted), write_study(folder, dataset), dataset)


def task_of(study: Study, folder: Path) -> Task:
    """Gather what all points have in common."""
    gearbox = study.gearbox
    names = {path: name for name, parameter in study.file.parameters.items() for path in parameter.targets}
    settings = (study.choice, study.settings, study.figures)
    return Task(gearbox.content, gearbox.source, gearbox.permissions, *settings, folder, names)
