"""The command `study`: many variations of one gearbox, combined in one dataset."""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exugear.cli.case import FilesBelowOption, JsonOption, OutOption, ScriptsOption, check_allow_dir, check_choice
from exugear.cli.console import (
    BadInputError,
    FailedError,
    exit_codes,
    interruption,
    make_results_folder,
    note,
    print_json,
    progress_bar,
    say,
)
from exugear.cli.process import let_in_dask
from exugear.cli.tables import print_table

if TYPE_CHECKING:
    import xarray as xr

    from exugear.studies.executors import Opens
    from exugear.studies.runner import Shard, StudyResult
    from exugear.studies.sections import LimitSection
    from exugear.studies.study import Study

SHOWN_FAILURES = 5
SHOWN_OF_FRONT = 5


class Executor(StrEnum):
    """Executor of the points."""

    processes = "processes"
    dask = "dask"


def study(
    file: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="The study file.", show_default=False)],
    executor: Annotated[
        Executor, typer.Option(metavar="NAME", help="processes (this machine) or dask (Dask cluster).")
    ] = Executor.processes,
    workers: Annotated[
        int | None, typer.Option(min=1, max=1024, help="Number of processes on this machine. (default: all cores)")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler, such as tcp://10.0.0.1:8786.")
    ] = None,
    shard: Annotated[
        str | None, typer.Option(metavar="i/n", help="Compute only every n-th point, starting at the i-th.")
    ] = None,
    merge: Annotated[
        bool, typer.Option("--merge", help="Merge finished points into the dataset; compute none.")
    ] = False,
    retry: Annotated[bool, typer.Option("--retry-failed", help="Recompute points that failed before.")] = False,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run a study: vary a gearbox and collect the results.

    Computes tables, modes, steady-state responses, lives or runs at each point and writes one dataset.

    Finished points are stored; run the same command again to resume. Failed points are reported; the study continues.
    """
    with exit_codes():
        from exugear.studies.executors import ExecutorError
        from exugear.studies.runner import OptimisationError

        part = _shard(shard, merge)
        opens = _executor(executor, workers, scheduler)
        read = _read(file, allow_dir, scripts)
        if read.file.optimise is not None and (merge or retry or shard is not None):
            raise BadInputError(
                f"{file}: the points of an optimisation depend on each other; "
                "remove --shard, --merge and --retry-failed"
            )
        folder = out or _default_folder(read, file)
        check_choice(read.gearbox, read.choice, folder)
        make_results_folder(folder)
        try:
            result = _run(read, folder, opens, part, merge, retry)
        except (ExecutorError, OptimisationError) as error:
            raise FailedError(error) from error
        pictures = _draw(read, folder, result)
        _print_result(read, file, folder, result, pictures, as_json)


def _shard(text: str | None, merge: bool) -> Shard:
    from exugear.studies.runner import WHOLE, Shard

    if text is None:
        return WHOLE
    if merge:
        raise BadInputError("--merge merges all parts and computes none; remove --shard")
    try:
        return Shard.from_text(text)
    except ValueError as error:
        raise BadInputError(f"--shard: {error}") from error


def _executor(executor: Executor, workers: int | None, scheduler: str | None) -> Opens:
    from exugear.studies.executors import dask_cluster, processes

    if executor is Executor.dask:
        if scheduler is None:
            raise BadInputError("--executor dask requires --scheduler ADDRESS, such as tcp://10.0.0.1:8786")
        if workers is not None:
            raise BadInputError("--workers: the Dask cluster determines the number of workers; remove --workers")
        let_in_dask()
        return dask_cluster(scheduler)
    if scheduler is not None:
        raise BadInputError("--scheduler applies to a Dask cluster; add --executor dask")
    return processes(workers)


def _read(path: Path, allow_dir: Path | None, scripts: bool) -> Study:
    from exugear.gearbox.named_files import Permissions
    from exugear.gearbox.reading import GearboxFileError
    from exugear.studies.sections import StudyError
    from exugear.studies.study import Study
    from exugear.system.gearbox_checks import check_parts

    check_allow_dir(allow_dir)
    try:
        study = Study.from_toml(path, Permissions(scripts, allow_dir))
        check_parts(study.gearbox)
    except (StudyError, GearboxFileError) as error:
        raise BadInputError(error) from error
    if study.choice.mesh_model not in _laws():
        laws = ", ".join(_laws())
        raise BadInputError(
            f"{path}: choice.mesh_model = {study.choice.mesh_model!r}: unknown mesh model; choose one of {laws}"
        )
    return study


def _laws() -> list[str]:
    from exugear.system.tooth_mesh.laws.registry import LAWS

    return list(LAWS)


def _default_folder(study: Study, path: Path) -> Path:
    from exugear.project import default_folder
    from exugear.results.folder import STUDIES

    stem = path.name.removesuffix(".toml").removesuffix(".study") or "study"
    return default_folder(study.gearbox.source) / STUDIES / stem


def _run(study: Study, folder: Path, opens: Opens, shard: Shard, merge: bool, retry: bool) -> StudyResult:
    """Run the study with a progress bar."""
    from exugear.studies.runner import optimise, run_study

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


def _draw(study: Study, folder: Path, swept: StudyResult) -> list[Path]:
    """Plot the combined results."""
    from exugear.studies.pictures import draw_study

    if swept.dataset is None:
        return []
    search = study.file.optimise
    minimised: tuple[str, ...] = ()
    if search is not None:
        minimised = tuple(_judged(study)[: len(search.minimise)])
    return draw_study(swept.dataset, folder, minimised)


def _print_result(
    study: Study, path: Path, folder: Path, swept: StudyResult, pictures: list[Path], as_json: bool
) -> None:
    """Print the results; end with code 1 if points failed, or are missing although all were requested."""
    searched = study.file.optimise is not None
    total = len(swept.records if searched else study.design.points)
    failed = swept.failed
    missing = total - len(swept.records)
    summary: dict[str, Any] = {
        "study": str(path),
        "name": study.file.name,
        "points": total,
        "computed": swept.computed,
        "finished": len(swept.records) - len(failed),
        "failed": len(failed),
        "missing": missing,
        "seconds_of_points": round(sum(record.seconds for record in swept.records.values()), 3),
        "errors": [record.error for record in failed[:SHOWN_FAILURES]],
        "file": None if swept.path is None else str(swept.path),
        "pictures": [str(picture) for picture in pictures],
    }
    if as_json:
        print_json(summary)
    else:
        _print(study, folder, swept, summary)
    _fail_if_beyond(study, swept)
    if failed:
        lines = [f"{len(failed)} of {total} points failed; errors: {folder}; use --retry-failed to recompute them:"]
        raise FailedError("\n".join([*lines, *(f"- {record.error}" for record in failed[:SHOWN_FAILURES])]))
    if missing and swept.path is not None:
        raise FailedError(f"{missing} of {total} points are missing; run the study, or the unfinished shards")


def _print(study: Study, folder: Path, swept: StudyResult, summary: dict[str, Any]) -> None:
    from exugear.studies.dataset import slopes
    from exugear.studies.sampling import SIDE

    say(
        f"{study.file.name}: {summary['finished']} of {summary['points']} points finished, "
        f"{swept.computed} computed now, {summary['seconds_of_points']:.1f} s worker time in total"
    )
    if swept.dataset is None or swept.path is None:
        note(f"{summary['missing']} points belong to other shards; the last shard, or --merge, writes the dataset")
        say(f"Points: {folder}")
        return
    if SIDE in study.design.shape:
        ranked = sorted(slopes(swept.dataset), key=lambda entry: -abs(entry[2]))
        rows = [{"parameter": p, "result": f, "change per\nstep %": f"{100.0 * c:+.3f}"} for f, p, c in ranked]
        if rows:
            print_table("Sensitivity of the results, largest first", rows, ("result",))
    if study.file.optimise is not None:
        _print_front(study, swept.dataset)
    say(f"Results: {swept.path}; pictures in the same folder")


def _judged(study: Study) -> list[str]:
    """Variables that rate the points of an optimisation: outputs, or their percentiles over tolerances."""
    from exugear.studies.dataset import Criteria, judged_name

    return [judged_name(study, name, side) for name, side in Criteria.of(study.file).sides]


def _fail_if_beyond(study: Study, swept: StudyResult) -> None:
    """End with code 1 if no point of an optimisation is within its limits."""
    from exugear.studies.dataset import EVALUATION

    data = swept.dataset
    if data is None or "meets_limits" not in data or data["meets_limits"].any():
        return
    assert study.file.optimise is not None
    limits = (f"{name} {_limit_text(limit)}" for name, limit in study.file.optimise.limits.items())
    raise FailedError(
        f"none of the {data.sizes[EVALUATION]} evaluated points meets the limits {', '.join(limits)}; widen the limits "
        f"or parameter ranges, or set more generations. All points: {swept.path}"
    )


def _limit_text(limit: LimitSection) -> str:
    bounds = (("min", limit.min), ("max", limit.max))
    return " ".join(f"{word} {value:g}" for word, value in bounds if value is not None)


def _print_front(study: Study, dataset: xr.Dataset) -> None:
    """Print the start point of an optimisation, and some points of the Pareto front, spread over the front."""
    import numpy as np

    figures = _judged(study)
    front = dataset.isel(evaluation=dataset["on_front"].to_numpy() == 1).sortby(figures[0])
    shown = sorted({round(n) for n in np.linspace(0, front.sizes["evaluation"] - 1, SHOWN_OF_FRONT)})
    points = {"start\npoint": dataset.isel(evaluation=0)}
    points |= {f"point\n{n + 1}": front.isel(evaluation=n) for n in shown if front.sizes["evaluation"]}
    rows = [
        {"result or\nparameter": name} | {label: _number(float(point[name])) for label, point in points.items()}
        for name in (*figures, *study.file.parameters)
    ]
    print_table(f"Pareto front: {front.sizes['evaluation']} points", rows)
    if study.tolerances is not None:
        for name in figures:
            note(f"{name}: {dataset[name].attrs['long_name']}")


def _number(value: float) -> str:
    if math.isnan(value):
        return ""
    if math.isinf(value):
        return "inf."
    return f"{value:.4g}"
