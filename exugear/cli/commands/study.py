"""Options of the command `study`."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from exugear.cli import options
from exugear.cli.console import exit_codes


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
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Run a study: vary a gearbox and collect the results.

    Computes tables, modes, steady-state responses, lives or runs at each point and writes one dataset.

    Finished points are stored; run the same command again to resume. Failed points are reported; the study continues.
    """
    with exit_codes():
        from exugear.cli.tasks import study as task

        opens = task.executor_of_options(executor.value, workers, scheduler)
        part = task.shard_of_options(shard, merge)
        task.study(task.read_study(file, allow_dir, scripts), out, opens, part, merge, retry, as_json)
