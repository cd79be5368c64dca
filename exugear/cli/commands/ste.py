"""The command `ste`: tables of the static transmission error, with pictures."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exugear.cli.case import CaseArgument, FilesBelowOption, JsonOption, OutOption, read_gearbox
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
    table_warnings,
)
from exugear.cli.tables import print_table

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from exugear.cli.watched import WatchedProject
    from exugear.gearbox.gearbox import Gearbox
    from exugear.system.tooth_mesh.reference_tables import ReferenceRequest
    from exugear.system.tooth_mesh.tables import TableRequest
    from fe_ste.reference.newton import Iteration
    from fe_ste.reference.table import NonlinearTable
    from fe_ste.transmission_error.table import MeshTable

#: Minimum number of positions, with which the mesh cycle resolves the harmonics needed by the dynamics.
LEAST_TABLE_POSITIONS = 8

#: Minimum number of tooth pictures, at about a second each, that justifies the start of another process.
WORTH_A_PROCESS = 3


class Method(StrEnum):
    """Method for tooth deflections: condensed finite elements, or the full nonlinear analysis used as reference."""

    superelement = "superelement"
    nonlinear = "nonlinear"


def ste(
    case: CaseArgument,
    mesh: Annotated[
        list[str] | None,
        typer.Option("--mesh", metavar="NAME", help="Gear pair to compute; repeatable. (default: all)"),
    ] = None,
    positions: Annotated[
        int | None,
        typer.Option(
            min=1, max=2000, help="Positions of the mesh cycle. (default: gearbox file, else 50; nonlinear: 10)"
        ),
    ] = None,
    method: Annotated[
        Method | None,
        typer.Option(
            metavar="NAME",
            help="superelement: condensed finite elements; nonlinear: reference analysis, about 30 s per position. "
            "(default: gearbox file)",
        ),
    ] = None,
    grid: Annotated[
        bool,
        typer.Option("--grid", help="Also vary load, centre distance and misalignment over the axes of the file."),
    ] = False,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compute tables of the static transmission error. Also draws the curves and the teeth in contact.

    Tables are cached and recomputed when their input changes. Tables of the method nonlinear are for comparison; the
    dynamic models do not use them.
    """
    with exit_codes():
        from exugear.cli.watched import WatchedProject
        from exugear.gearbox.choice import Choice
        from exugear.gearbox.variant import Variant
        from exugear.project import default_folder
        from exugear.results.folder import time_noted
        from exugear.system.tooth_mesh.tables import stored_tables

        gearbox = read_gearbox(case, allow_dir)
        if (method or Method(gearbox.ste.method)) is Method.nonlinear:
            if grid:
                raise BadInputError("--grid: the method nonlinear computes the static load only; remove --grid")
            _compute_references(gearbox, case, out, mesh or [], positions, as_json)
            return
        if positions is not None and positions < LEAST_TABLE_POSITIONS:
            raise BadInputError(
                f"--positions {positions}: a table for dynamics requires at least {LEAST_TABLE_POSITIONS}"
            )
        project = WatchedProject(gearbox, out or default_folder(case), Choice(Variant.bushing))
        folder = project.folder
        requests = _requested_tables(project, mesh or [], positions, grid)
        with time_noted(folder, "tables of transmission error"):
            tables = project.computed(requests)
        with time_noted(folder, "pictures of the tables"):
            beside = stored_tables(gearbox, folder, positions)
            with _curves_beside({**beside, **tables}, folder, requests) as curves:
                contacts = _draw_contacts(requests, tables, folder)
            pictures = curves.result() + contacts
        _print_misalignment(project)
        _print_tables(case, folder, requests, tables, pictures, as_json)


def _print_misalignment(project: WatchedProject) -> None:
    """Print the misalignment of the gears, which static tables neglect; nothing if bearing data are unknown."""
    from exugear.system.bearings.rolling.rows import BearingError
    from exugear.system.bearings.stiffness import unsupported
    from exugear.system.statics import BalanceError, static_state
    from exugear.system.tooth_mesh.placement import MeshError
    from exugear.system.tooth_mesh.tables import missing_tables

    if unsupported(project.gearbox, project.choice.variant) or missing_tables(project.gearbox, project.folder):
        return
    try:
        with project.bars.row():
            state = static_state(project.assembly())
    except (BalanceError, BearingError, MeshError):  # reported by the commands that need the state
        return
    largest: dict[str, float] = {}
    for element, misalignment in zip(state.assembly.elements, state.misalignment, strict=True):
        pair = element.mesh.pair
        largest[pair.name] = max(largest.get(pair.name, 0.0), abs(float(misalignment)) * pair.face_width)
    words = ", ".join(f"{name} {1e6 * opening:.1f} µm" for name, opening in largest.items())
    note(f"Misalignment under the static load, gap over the face width: {words} (details: exugear bearings)")


def _requested_tables(
    project: WatchedProject, names: list[str], positions: int | None, grid: bool
) -> list[TableRequest]:
    from exugear.system.tooth_mesh.tables import without_table

    gearbox = project.gearbox
    requests = project.requested_tables(names, positions, grid=grid)
    if not requests:
        why = (
            without_table(gearbox, gearbox.pairs)
            or "pairs: no pair has table = true; set it for a pair, or use --mesh NAME"
        )
        raise BadInputError(gearbox.error(why))
    make_results_folder(project.folder)
    project.keep_case()
    for request in requests:
        if request.stored:
            note(f"{request.name}: cached table of the same input: {request.path}")
            continue
        if request.replaces:
            note(request.replaces)
        if len(request.wanted.misalignment) > 1:
            ranges = request.wanted.axes().ranges()
            note(f"{request.name}: grid over {', '.join(f'{axis} {values}' for axis, values in ranges.items())}")
    return requests


def _compute_references(
    gearbox: Gearbox, case: Path, out: Path | None, names: list[str], positions: int | None, as_json: bool
) -> None:
    """Run the reference analysis of the pairs and print results; each position is stored when it is complete."""
    from exugear.project import default_folder
    from exugear.results.folder import keep_case, time_noted
    from exugear.system.tooth_mesh.reference_tables import (
        reference_warnings,
        requested_references,
        summarise_reference,
    )

    folder = out or default_folder(case)
    requests = requested_references(gearbox, folder, names, positions)
    make_results_folder(folder)
    keep_case(gearbox, folder)
    tables = {}
    with time_noted(folder, "reference analysis"), progress_bar() as bar:
        task = bar.add_task("", total=sum(request.wanted.positions for request in requests))
        for request in requests:
            tables[request.name] = _compute_reference(request, bar, task)
    summaries = [summarise_reference(request, tables[request.name]) for request in requests]
    if as_json:
        print_json({"case": str(case), "tables": summaries})
    else:
        rows = [_reference_row(row) for row in summaries]
        print_table("Static transmission error, nonlinear finite elements", rows, legend=REFERENCE_LEGEND)
        say(f"Results: {folder / 'tables'}")
    failures = [f"{name}: {line}" for name, table in tables.items() for line in table.failures]
    doubts = reference_warnings(summaries)
    errors = []
    if failures:
        errors += ["positions not converged:", *failures]
    if doubts:
        errors += ["the methods differ by more than the limit:", *doubts]
    if errors:
        raise FailedError("\n".join(errors))


def _compute_reference(request: ReferenceRequest, bar: Progress, task: TaskID) -> NonlinearTable:
    from fe_ste.geometry.checks import GeometryError

    before = bar.tasks[task].completed

    def report_iteration(done: int, of: int, iteration: Iteration | None) -> None:
        interruption.check()
        text = f"{request.name}: {done} of {of} positions"
        if iteration is not None:
            text += f", {100 * iteration.load:.3g} % of the load, iteration {iteration.number}"
        bar.update(task, completed=before + done, description=text)

    try:
        return request.compute(report_iteration)
    except GeometryError as error:
        raise BadInputError(f"pairs.{request.name}: {error}") from error


@contextmanager
def _curves_beside(
    tables: dict[str, MeshTable], folder: Path, requests: list[TableRequest]
) -> Iterator[Future[list[Path]]]:
    """Plot the curves of all tables, in another process if this one has enough tooth pictures to draw meanwhile."""
    from exugear.report.pictures.diagrams import contact_picture, draw_curves
    from fe_ste.tools.threads import Workers, available_cores

    new = sum(not (request.stored and contact_picture(request.name, folder).exists()) for request in requests)
    if new >= WORTH_A_PROCESS and available_cores() > 1:
        with Workers(1) as executor:
            yield executor.submit(draw_curves, tables, folder)
        return
    drawn: Future[list[Path]] = Future()
    drawn.set_result(draw_curves(tables, folder))
    yield drawn


def _draw_contacts(requests: list[TableRequest], tables: dict[str, MeshTable], folder: Path) -> list[Path]:
    """Draw the teeth in contact if the picture is missing or the table is new; return all such pictures."""
    from exugear.report.pictures.diagrams import contact_picture, draw_contact
    from fe_ste.contact.kinematics import ContactError
    from fe_ste.tools.drawing import RenderingError

    pictures: list[Path] = []
    with progress_bar() as bar:
        for request in bar.track(requests, description="pictures of the teeth"):
            path = contact_picture(request.name, folder)
            try:
                if not (request.stored and path.exists()):
                    draw_contact(request, tables[request.name], folder)
            except ContactError as error:
                note(f"No picture of the teeth of {request.name}: {error}", style="yellow")
                continue
            except RenderingError as error:
                note(f"No pictures of the teeth: {error}", style="yellow")
                break
            pictures.append(path)
    return pictures


TABLE_LEGEND = (
    "Torque: of gear 1. TE: transmission error, mean and peak-to-peak (p-p) over the mesh cycle. Stiffness: mean mesh "
    "stiffness. Stress: maximum contact stress of the mesh cycle without tip-edge contact; at the pitch point: Hertz, "
    "even load distribution. Aligned gears, no load factors. States conv.: converged of all states of the table."
)
REFERENCE_LEGEND = (
    "Torque: of gear 1. TE: transmission error, mean and peak-to-peak (p-p), by the nonlinear reference analysis; "
    "table: by the method of the tables, which the dynamic models use. σ_H: contact stress of the most loaded tooth "
    "pair, mean along its contact line, maximum over the positions."
)


def _print_tables(
    case: Path,
    folder: Path,
    requests: list[TableRequest],
    tables: dict[str, MeshTable],
    pictures: list[Path],
    as_json: bool,
) -> None:
    from exugear.system.tooth_mesh.tables import summarise

    summaries = [summarise(request, tables[request.name]) for request in requests]
    if as_json:
        print_json({"case": str(case), "tables": summaries, "pictures": [str(path) for path in pictures]})
    else:
        print_table("Static transmission error", [_ste_row(summary) for summary in summaries], legend=TABLE_LEGEND)
        say(f"Results: {folder / 'tables'}; pictures: {folder / 'pictures'}")
    doubts = table_warnings(tables)
    if doubts:
        raise FailedError("\n".join(["invalid tables:", *doubts]))


def _ste_row(summary: dict[str, Any]) -> dict[str, str]:
    return {
        "pair": summary["pair"],
        "torque\nN m": _shown(summary, "torque_gear_1_N_m", ".1f"),
        "TE mean\nµm": _shown(summary, "ste_mean_um", ".2f"),
        "TE p-p\nµm": _shown(summary, "ste_peak_to_peak_um", ".3f"),
        "stiffn.\nMN/m": _shown(summary, "mesh_stiffness_mean_N_per_m", ".4g", 1e-6),
        "stress\nMPa": _shown(summary, "max_pressure_MPa", ".0f"),
        "at pitch\npoint MPa": _shown(summary, "pitch_point_pressure_MPa", ".0f"),
        "states\nconv.": _solved(summary),
    }


def _reference_row(summary: dict[str, Any]) -> dict[str, str]:
    """Return mean and peak-to-peak values by the reference analysis and by the method of the tables."""
    return {
        "pair": summary["pair"],
        "torque\nN m": _shown(summary, "torque_gear_1_N_m", ".1f"),
        "TE mean\nµm": _shown(summary, "ste_mean_um", ".2f"),
        "table\nmean µm": _shown(summary, "superelement_mean_um", ".2f"),
        "diff.\n%": _shown(summary, "difference_of_means_percent", "+.1f"),
        "TE p-p\nµm": _shown(summary, "ste_peak_to_peak_um", ".3f"),
        "table\np-p µm": _shown(summary, "superelement_peak_to_peak_um", ".3f"),
        "σ_H\nMPa": _shown(summary, "contact_stress_MPa", ".0f"),
        "table\nσ_H MPa": _shown(summary, "superelement_contact_stress_MPa", ".0f"),
        "posit.\nconv.": _solved(summary),
    }


def _shown(summary: dict[str, Any], key: str, form: str, factor: float = 1.0) -> str:
    if summary.get(key) is None:
        return "-"
    return format(factor * summary[key], form)


def _solved(summary: dict[str, Any]) -> str:
    return f"{summary['states'] - summary['not_converged']}/{summary['states']}"
