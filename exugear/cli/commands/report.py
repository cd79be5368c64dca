"""The command `report`: a web page on a results folder."""

from __future__ import annotations

import math
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exugear.cli.case import FilesBelowOption, JsonOption, check_allow_dir
from exugear.cli.console import (
    BadInputError,
    FailedError,
    exit_codes,
    interruption,
    model_errors,
    note,
    print_json,
    progress_bar,
    say,
)
from exugear.cli.tables import print_table
from exugear.gearbox.units import RPM

if TYPE_CHECKING:
    from exugear.report.findings.design_changes import DesignStudy
    from exugear.report.writer import Report


def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Results folder.", show_default=False)],
    near: Annotated[
        float | None,
        typer.Option(min=1.0, metavar="HZ", help="Target frequency to compare with modes. (default: gearbox file)"),
    ] = None,
    stored: Annotated[
        bool,
        typer.Option("--stored", help="Use stored results only: do not compute missing modes and responses."),
    ] = False,
    levers: Annotated[
        bool,
        typer.Option(
            "--levers", help="First compute what design changes do to the highest resonance, which takes minutes."
        ),
    ] = False,
    compare: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Results folder of another design to compare with.", show_default=False),
    ] = None,
    allow_dir: FilesBelowOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write a report of a results folder as one web page.

    The page lists the resonances, their amplitudes and causes, and needs no other file. It compares all variants with
    runs and modes. Missing modes of these models are computed first, and a steady-state response over the operating
    range if there is none. gmsh scripts are not run; their meshes must exist.
    """
    with exit_codes():
        from exugear.report.findings.context import ReportError
        from exugear.report.writer import write_report
        from exugear.results.folder import time_noted

        check_allow_dir(allow_dir)
        if not folder.is_dir():
            raise BadInputError(f"{folder}: no such folder; specify the results folder of `exugear run`")
        if compare is not None and not compare.is_dir():
            raise BadInputError(f"{compare}: --compare: no such folder; specify the results folder of another design")
        folder = _results_of(folder)
        other = None if compare is None else _results_of(compare)
        if other is not None:
            _check_comparison(folder, other, allow_dir)
        if not stored:
            _compute_missing(folder, allow_dir)
        study = None
        if levers:
            study = _design_changes(folder, allow_dir)
        try:
            with time_noted(folder, "report"), progress_bar() as bar, _parallel_worker() as executor:
                task = bar.add_task("report", total=None)

                def tell(what: str) -> None:
                    interruption.check()
                    bar.update(task, description=what)

                written = write_report(folder, near, tell, allow_dir, executor, other)
        except ReportError as error:
            raise BadInputError(error) from error
        _print_report(folder, written, study, as_json)


def _check_comparison(folder: Path, other: Path, allow_dir: Path | None) -> None:
    """Refuse another design that cannot be compared, before anything is computed."""
    from exugear.gearbox.named_files import Permissions
    from exugear.report.findings.context import ReportError
    from exugear.report.findings.other_design import check_ranges
    from exugear.results.folder import read_stored_gearbox

    permissions = Permissions(below=allow_dir)
    own = read_stored_gearbox(folder, permissions)
    others = read_stored_gearbox(other, permissions)
    try:
        check_ranges(own, others)
    except ReportError as error:
        raise BadInputError(error) from error


def _compute_missing(folder: Path, allow_dir: Path | None) -> None:
    """Compute missing modes of all models with runs or modes, and a response of the one with most degrees of freedom.

    Existing files stay as they are, even if they are damaged or belong to other input. What takes long (tables, contact
    loss) or fails is left to the report, which lists it with its command.
    """
    from exugear.cli.watched import WatchedProject
    from exugear.gearbox.named_files import Permissions
    from exugear.gearbox.variant import Variant
    from exugear.report.findings.context import choice_of
    from exugear.results.folder import read_stored_gearbox
    from exugear.results.run_file import load_run
    from exugear.steady.settings import SteadySettings, operating_speeds
    from exugear.system.modes import load_modes
    from exugear.system.tooth_mesh.laws.registry import LAWS
    from fe_ste.tools.files import FileError

    models = []
    for path in sorted(folder.glob("*/*/run.nc")):
        with suppress(FileError, ValueError, KeyError):
            models.append(choice_of(load_run(path, ()).attrs))
    for path in sorted(folder.glob("*/*/modes.nc")):
        with suppress(FileError, ValueError, KeyError):
            models.append(choice_of(load_modes(path).attrs))
    if not models:
        return
    with suppress(BadInputError, FailedError), model_errors():
        project = WatchedProject(read_stored_gearbox(folder, Permissions(below=allow_dir)), folder)
        chosen = [replace(project, choice=model) for model in dict.fromkeys(models)]
        ready = [own for own in chosen if LAWS[own.choice.mesh_model].has_force and not own.missing_tables()]
        for own in ready:
            if not own.modes_path.exists():
                own.modes()
        linear = [
            own
            for own in ready
            if (law := LAWS[own.choice.mesh_model]).needs_tables and not law.loses_contact  # excited, and linear
        ]
        if linear and not any(folder.glob("*/*/steady-*.nc")):
            richest = max(linear, key=lambda own: list(Variant).index(own.choice.variant))
            richest.steady(SteadySettings(operating_speeds(project.gearbox)))


def _design_changes(folder: Path, allow_dir: Path | None) -> DesignStudy:
    """Compute the design changes of the variant with most degrees of freedom that the file allows."""
    from exugear.cli.watched import WatchedProject
    from exugear.gearbox.choice import Choice
    from exugear.gearbox.named_files import Permissions
    from exugear.results.folder import read_stored_gearbox
    from exugear.system.gearbox_checks import usual_variant

    gearbox = read_stored_gearbox(folder, Permissions(below=allow_dir))
    project = WatchedProject(gearbox, folder, Choice(usual_variant(gearbox)))
    project.prepare()
    study = project.design_changes(lambda done, total, words: note(f"Design change {done + 1} of {total}: {words}"))
    if study is None:
        raise BadInputError(f"{folder}: --levers: no resonance in the operating range; nothing to reduce")
    return study


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


def _print_report(folder: Path, written: Report, study: DesignStudy | None, as_json: bool) -> None:
    from exugear.results.folder import times_spent

    spent = times_spent(folder)
    for line in written.left_out:
        note(f"Warning: skipped: {line}", style="yellow")
    for line in written.missing:
        note(f"Not computed: {line}")
    if as_json:
        times = {entry.step: entry.seconds for entry in spent}
        lists = {name: list(getattr(written, name)) for name in ("statements", "resonances", "missing", "left_out")}
        changes = [asdict(result) for result in (study.results if study else ())]
        print_json({"report": str(written.path), **lists, "design_changes": changes, "seconds": times})
        return
    if study is not None:
        _print_changes(study)
    for line in written.statements:
        say(f"- {line}")
    rows = [
        {"step": entry.step, "wall\ntime s": f"{entry.seconds:.1f}", "memory\npeak MB": _megabytes(entry.memory)}
        for entry in spent
    ]
    print_table("Run time, last execution of each step", rows, legend="Parallel steps overlap.")
    say(f"Report: {written.path}")


QUANTITIES = {"error": "TE", "force": "force", "acceleration": "accel."}
"""Column titles of the quantities."""


def _print_changes(study: DesignStudy) -> None:
    """Print the effects of the design changes: on this peak, and on the highest amplitude in the operating range."""
    from exugear.report.findings.design_changes import Effect

    speed = abs(study.speed) / RPM
    title = f"Design changes for {study.frequency:.3g} Hz at {speed:.4g} rpm, {study.line}, dB"
    rows = []
    for result in study.results:
        row = {"change": result.change.words}
        for name, words in QUANTITIES.items():
            effect = result.effects.get(name, Effect(None, None))
            row[f"{words}\nhere"] = _decibels(effect.this_peak)
            row[f"{words}\nrange"] = _decibels(effect.highest)
        rows.append({**row, "price": result.refusal or result.price})
    print_table(title, rows, ("change", "price"), legend="here: this peak; range: highest amplitude of any order.")


def _decibels(value: float | None) -> str:
    if value is None:
        return "–"
    text = f"{value:+.1f}"
    return "0.0" if text in ("+0.0", "-0.0") else text


def _megabytes(memory: float) -> str:
    return f"{1e-6 * memory:.0f}" if math.isfinite(memory) else "-"
