"""The command `study`: many variations of one gearbox, combined in one dataset."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.cli.case import check_allow_dir, check_choice
from exugear.cli.console import BadInputError, FailedError, interruption, make_results_folder, progress_bar
from exugear.cli.process import let_in_dask
from exugear.cli.tables import Column, Outcome, Table, failure_text, significant
from exugear.gearbox.named_files import Permissions
from exugear.gearbox.reading import GearboxFileError
from exugear.project import results_folder
from exugear.results.findings import Finding
from exugear.results.folder import STUDIES
from exugear.studies.dataset import EVALUATION, Criteria, judged_name, slopes
from exugear.studies.executors import ExecutorError, Opens, dask_cluster, processes
from exugear.studies.pictures import draw_study
from exugear.studies.runner import WHOLE, OptimisationError, Shard, StudyResult, optimise, run_study
from exugear.studies.sampling import SIDE
from exugear.studies.sections import LimitSection, StudyError
from exugear.studies.study import Study
from exugear.system.gearbox_checks import check_parts
from exugear.system.tooth_mesh.laws.registry import LAWS

if TYPE_CHECKING:
    import xarray as xr

SHOWN_FAILURES = 5
SHOWN_OF_FRONT = 5
SHOWN_COLUMNS = 7
"""Maximum number of columns without ``--all``."""
SLOPES = (
    Column("parameter", itemgetter(1)),
    Column("result", itemgetter(0), is_text=True),
    Column("change per\nstep %", itemgetter(2), "+.2f", 100.0),
)


def study(
    read: Study,
    folder: Path | None,
    opens: Opens,
    shard: Shard,
    merge: bool,
    retry: bool,
    as_json: bool,
    whole: bool,
) -> None:
    """Compute the points of a study, and print its results."""
    if read.file.optimise is not None and (merge or retry or shard != WHOLE):
        raise BadInputError(
            f"{read.source}: the points of an optimisation depend on each other; "
            "remove --shard, --merge and --retry-failed"
        )
    stem = Path(read.source).name.removesuffix(".toml").removesuffix(".study") or "study"
    folder = folder or results_folder(read.gearbox.source) / STUDIES / stem
    check_choice(read.gearbox, read.choice, folder)
    make_results_folder(folder)
    try:
        result = _run(read, folder, opens, shard, merge, retry)
    except (ExecutorError, OptimisationError) as error:
        raise FailedError(error) from error
    pictures = []
    if result.dataset is not None:
        search = read.file.optimise
        minimised = () if search is None else tuple(_judged(read)[: len(search.minimise)])
        pictures = draw_study(result.dataset, folder, minimised)
    summary = summarise(read, result, pictures)
    findings = [Finding("note", f"{summary['seconds_of_points']:.3g} s worker time in total")]
    if result.dataset is None:
        text = f"{summary['missing']} points belong to other shards; the last shard, or --merge, writes the dataset"
        findings.append(Finding("warning", text))
    elif read.tolerances is not None:
        findings += [Finding("note", f"{name}: {result.dataset[name].attrs['long_name']}") for name in _judged(read)]
    failures = [_beyond(read, result)]
    if summary["failed"]:
        line = f"{summary['failed']} of {summary['points']} points failed; errors: {folder}; use --retry-failed to "
        failures.append(failure_text(f"{line}recompute them:", [f"- {error}" for error in summary["errors"]]))
    elif summary["missing"] and summary["file"] is not None:
        missing = f"{summary['missing']} of {summary['points']} points are missing"
        failures.append(f"{missing}; run the study, or the unfinished shards")
    finished = f"{summary['finished']} of {summary['points']} points finished"
    Outcome(
        verdict=f"{read.file.name}: {finished}, {summary['computed']} computed now",
        summary=summary,
        tables=_tables(read, result.dataset),
        findings=findings,
        path=folder if result.path is None else f"{result.path}, pictures",
        failure="\n".join(filter(None, failures)),
    ).show(as_json, whole)


def shard_of_options(text: str | None, merge: bool) -> Shard:
    """Return the points to compute; raise an error for an invalid part."""
    if text is None:
        return WHOLE
    if merge:
        raise BadInputError("--merge merges all parts and computes none; remove --shard")
    try:
        return Shard.from_text(text)
    except ValueError as error:
        raise BadInputError(f"--shard: {error}") from error


def executor_of_options(executor: str, workers: int | None, scheduler: str | None) -> Opens:
    """Return what opens the executor of the points; raise an error for options that exclude each other."""
    if executor == "dask":
        if scheduler is None:
            raise BadInputError("--executor dask requires --scheduler ADDRESS, such as tcp://10.0.0.1:8786")
        if workers is not None:
            raise BadInputError("--workers: the Dask cluster determines the number of workers; remove --workers")
        let_in_dask()
        return dask_cluster(scheduler)
    if scheduler is not None:
        raise BadInputError("--scheduler applies to a Dask cluster; add --executor dask")
    return processes(workers)


def read_study(path: Path, allow_dir: Path | None, scripts: bool) -> Study:
    """Read a study file and check its gearbox."""
    check_allow_dir(allow_dir)
    try:
        study = Study.from_toml(path, Permissions(scripts, allow_dir))
        check_parts(study.gearbox)
    except (StudyError, GearboxFileError) as error:
        raise BadInputError(error) from error
    law = study.choice.mesh_model
    if law not in LAWS:
        raise BadInputError(f"{path}: choice.mesh_model = {law!r}: unknown mesh model; choose one of {', '.join(LAWS)}")
    return study


def _run(study: Study, folder: Path, opens: Opens, shard: Shard, merge: bool, retry: bool) -> StudyResult:
    with progress_bar() as bar:
        task = bar.add_task("points", total=None)
        first: list[int] = []

        def show(done: int, failed: int, total: int) -> None:
            interruption.check()
            first.append(done)  # points from earlier runs do not indicate the remaining time
            failures = f", {failed} failed" if failed else ""
            text = f"point {done} of {total}{failures}"
            bar.update(task, completed=done - first[0], total=total - first[0], description=text)

        if study.file.optimise is not None:
            return optimise(study, folder, opens, progress=show)
        return run_study(study, folder, opens, shard=shard, merge=merge, retry=retry, progress=show)


def summarise(study: Study, swept: StudyResult, pictures: list[Path]) -> dict[str, Any]:
    """Summarise a study: how many points are computed, failed and missing, and the files."""
    searched = study.file.optimise is not None
    total = len(swept.records if searched else study.design.points)
    failed = swept.failed
    return {
        "study": study.source,
        "name": study.file.name,
        "points": total,
        "computed": swept.computed,
        "finished": len(swept.records) - len(failed),
        "failed": len(failed),
        "missing": total - len(swept.records),
        "seconds_of_points": round(sum(record.seconds for record in swept.records.values()), 3),
        "errors": list(dict.fromkeys(record.error for record in failed))[:SHOWN_FAILURES],
        "file": None if swept.path is None else str(swept.path),
        "pictures": [str(picture) for picture in pictures],
    }


def _tables(study: Study, dataset: xr.Dataset | None) -> list[Table]:
    """Return the Pareto front, the sensitivities, or the results of all points."""
    if dataset is None:
        return []
    if study.file.optimise is not None:
        return [_front(study, dataset)]
    if SIDE in study.design.shape:
        ranked = sorted(slopes(dataset), key=lambda entry: -abs(entry[2]))
        return [Table("Sensitivity of the results, largest first", ranked, SLOPES, noun="results")]
    return [point_table(dataset, tuple(study.design.shape), tuple(study.file.parameters), tuple(study.file.outputs))]


def point_table(
    dataset: xr.Dataset, dimensions: Sequence[str], parameters: Sequence[str], outputs: Sequence[str]
) -> Table:
    """Return the results of all points: parameters and outputs with one value, in the units of the dataset."""
    known = [name for name in (*parameters, *outputs) if name in dataset]
    names = [name for name in known if set(dataset[name].dims) <= {*dimensions}]
    others = ", ".join(name for name in known if name not in names)
    legend = f"In the file only, with several values at each point: {others}." if others else ""
    cells = [
        dataset[name].broadcast_like(dataset["seconds"]).transpose(*dimensions).to_numpy().ravel() for name in names
    ]
    rows = [dict(zip(names, row, strict=True)) for row in zip(*cells, strict=True)]
    columns = [Column("point", lambda row: rows.index(row) + 1)]
    for number, name in enumerate(names, start=2):
        unit = dataset[name].attrs.get("units", "")
        heading = name if unit in ("", "1") else f"{name}\n{unit}"
        columns.append(Column(heading, name, _point_value, is_detail=number > SHOWN_COLUMNS))
    return Table("Results of the points", rows, columns, legend, noun="points")


def _point_value(value: Any) -> str:
    return str(value) if isinstance(value, str) else significant(float(value), 3)


def _judged(study: Study) -> list[str]:
    """Variables that rate the points of an optimisation: outputs, or their percentiles over tolerances."""
    return [judged_name(study, name, side) for name, side in Criteria.of(study.file).sides]


def _beyond(study: Study, swept: StudyResult) -> str:
    """Return that no point of an optimisation is within its limits; empty otherwise."""
    data = swept.dataset
    if data is None or "meets_limits" not in data or data["meets_limits"].any():
        return ""
    assert study.file.optimise is not None
    limits = (f"{name} {_limit_text(limit)}" for name, limit in study.file.optimise.limits.items())
    return (
        f"none of the {data.sizes[EVALUATION]} evaluated points meets the limits {', '.join(limits)}; widen the limits "
        f"or parameter ranges, or set more generations. All points: {swept.path}"
    )


def _limit_text(limit: LimitSection) -> str:
    bounds = (("min", limit.min), ("max", limit.max))
    return " ".join(f"{word} {value:g}" for word, value in bounds if value is not None)


PARAMETER = Column("result or\nparameter", str)


def _value(point: xr.Dataset, name: str) -> float:
    return float(point[name])


def _front(study: Study, dataset: xr.Dataset) -> Table:
    """Return the start point of an optimisation, and some points of the Pareto front, spread over the front."""
    figures = _judged(study)
    front = dataset.isel(evaluation=dataset["on_front"].to_numpy() == 1).sortby(figures[0])
    shown = sorted({round(n) for n in np.linspace(0, front.sizes["evaluation"] - 1, SHOWN_OF_FRONT)})
    points = {"start\npoint": dataset.isel(evaluation=0)}
    points |= {f"point\n{n + 1}": front.isel(evaluation=n) for n in shown if front.sizes["evaluation"]}
    columns = [
        Column(label, partial(_value, point), partial(significant, digits=3), missing="")
        for label, point in points.items()
    ]
    names = (*figures, *study.file.parameters)
    return Table(f"Pareto front: {front.sizes['evaluation']} points", names, (PARAMETER, *columns), noun="values")
