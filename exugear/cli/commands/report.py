"""The command `report`: a web page on a results folder."""

from __future__ import annotations

import math
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exugear.cli.case import FilesBelowOption, JsonOption, check_allow_dir
from exugear.cli.console import (
    BadInputError,
    exit_codes,
    interruption,
    note,
    print_json,
    progress_bar,
    say,
)
from exugear.cli.tables import print_table

if TYPE_CHECKING:
    from exugear.report.writer import Report


def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Results folder.", show_default=False)],
    near: Annotated[
        float | None,
        typer.Option(min=1.0, metavar="HZ", help="Target frequency to compare with modes. (default: gearbox file)"),
    ] = None,
    allow_dir: FilesBelowOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write a report of a results folder as one web page.

    The page lists the resonances, their amplitudes and causes, and needs no other file. It compares all variants with
    runs and modes. gmsh scripts are not run; their meshes must exist.
    """
    with exit_codes():
        from exugear.report.writer import ReportError, write_report
        from exugear.results.folder import time_noted

        check_allow_dir(allow_dir)
        if not folder.is_dir():
            raise BadInputError(f"{folder}: no such folder; specify the results folder of `exugear run`")
        folder = _results_of(folder)
        try:
            with time_noted(folder, "report"), progress_bar() as bar, _parallel_worker() as executor:
                task = bar.add_task("report", total=None)

                def tell(what: str) -> None:
                    interruption.check()
                    bar.update(task, description=what)

                written = write_report(folder, near, tell, allow_dir, executor)
        except ReportError as error:
            raise BadInputError(error) from error
        _print_report(folder, written, as_json)


def _results_of(folder: Path) -> Path:
    """Return the default results folder of the gearbox file in a folder, if only that one contains results."""
    from exugear.project import default_folder
    from exugear.results.folder import CASE_FILE

    below = default_folder(folder / "gearbox.toml")
    if (folder / CASE_FILE).is_file() or not (below / CASE_FILE).is_file() or not any(folder.glob("*.toml")):
        return folder
    note(f"Note: {folder} contains the gearbox file; its results are in {below}")
    return below


def _parallel_worker() -> AbstractContextManager[Executor | None]:
    """Return a second worker process if a core is available for it; the process starts with its first task."""
    from fe_ste.tools.threads import Workers, available_cores

    if available_cores() > 1:
        return Workers(1)
    return nullcontext()


def _print_report(folder: Path, written: Report, as_json: bool) -> None:
    from exugear.results.folder import times_spent

    spent = times_spent(folder)
    for line in written.left_out:
        note(f"Warning: skipped: {line}", style="yellow")
    for line in written.missing:
        note(f"Not computed: {line}")
    if as_json:
        times = {entry.step: entry.seconds for entry in spent}
        lists = {name: list(getattr(written, name)) for name in ("statements", "resonances", "missing", "left_out")}
        print_json({"report": str(written.path), **lists, "seconds": times})
        return
    for line in written.statements:
        say(f"- {line}")
    rows = [
        {"step": entry.step, "wall\ntime s": f"{entry.seconds:.1f}", "memory\npeak MB": _megabytes(entry.memory)}
        for entry in spent
    ]
    print_table("Run time, last execution of each step", rows, legend="Parallel steps overlap.")
    say(f"Report: {written.path}")


def _megabytes(memory: float) -> str:
    return f"{1e-6 * memory:.0f}" if math.isfinite(memory) else "-"
