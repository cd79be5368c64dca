"""The command `ste`: tables of the static transmission error, with pictures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from rich.progress import Progress, TaskID

from exugear.cli.console import BadInputError, interruption, make_results_folder, note, progress_bar
from exugear.cli.tables import Column, Outcome, Table, detail, failure_text, significant
from exugear.cli.watched import WatchedProject, errors_of_tables
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.variant import Variant
from exugear.project import results_folder
from exugear.report.pictures.diagrams import contact_picture, draw_contact, draw_curves
from exugear.results.findings import Finding
from exugear.results.folder import keep_case, time_noted
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.bearings.stiffness import unsupported
from exugear.system.statics import BalanceError, static_state
from exugear.system.tooth_mesh.placement import MeshError
from exugear.system.tooth_mesh.reference_tables import (
    ReferenceRequest,
    reference_warnings,
    requested_references,
    summarise_reference,
)
from exugear.system.tooth_mesh.tables import TableRequest, missing_tables, stored_tables, summarise, without_table
from fe_ste.contact.kinematics import ContactError
from fe_ste.geometry.checks import GeometryError
from fe_ste.reference.newton import Iteration
from fe_ste.reference.table import NonlinearTable
from fe_ste.tools.drawing import RenderingError
from fe_ste.tools.processes import Workers
from fe_ste.tools.threads import available_cores
from fe_ste.transmission_error.cycle import HARMONICS
from fe_ste.transmission_error.table import MeshTable

#: Minimum number of positions, with which the mesh cycle resolves the harmonics needed by the dynamics.
LEAST_TABLE_POSITIONS = 8

#: Minimum number of tooth pictures, at about a second each, that justifies the start of another process.
WORTH_A_PROCESS = 3


def ste(
    gearbox: Gearbox,
    out: Path | None,
    names: list[str],
    positions: int | None,
    grid: bool,
    as_json: bool,
    whole: bool,
) -> None:
    """Compute, store and print the tables of the pairs of a gearbox."""
    if positions is not None and positions < LEAST_TABLE_POSITIONS:
        raise BadInputError(f"--positions {positions}: a table for dynamics requires at least {LEAST_TABLE_POSITIONS}")
    project = WatchedProject(gearbox, results_folder(gearbox.source, out), Choice(Variant.bushing))
    folder = project.folder
    requests = _requested_tables(project, names, positions, grid)
    with time_noted(folder, "tables of transmission error"):
        tables = project.computed(requests)
    with time_noted(folder, "pictures of the tables"):
        stored = stored_tables(gearbox, folder, positions)
        with _curves_beside({**stored, **tables}, folder, requests) as curves:
            contacts = _draw_contacts(requests, tables, folder)
        pictures = curves.result() + contacts
    summaries = [summarise(request, tables[request.name]) for request in requests]
    doubts = errors_of_tables(tables)
    Outcome(
        verdict=_verdict(summaries),
        summary={"case": gearbox.source, "tables": summaries, "pictures": [str(path) for path in pictures]},
        tables=[Table("Static transmission error, aligned gears", summaries, TABLES, LEGEND, DETAILS, "pairs")],
        findings=[
            *(Finding("warning", line) for line in few_positions(summaries)),
            *(Finding("note", line) for line in _misalignment(project)),
            *(Finding("note", f"{own.name}: cached table of the same input") for own in requests if own.stored),
        ],
        path=f"{folder / 'tables'}, {folder / 'pictures'}",
        failure=failure_text("invalid tables:", doubts),
    ).show(as_json, whole)


def _verdict(summaries: Sequence[Mapping[str, Any]]) -> str:
    """Return the largest peak-to-peak transmission error."""
    known = [table for table in summaries if table["ste_peak_to_peak_um"] is not None]
    text = f"{len(summaries)} table{'s' * (len(summaries) != 1)} of transmission error"
    if not known:
        return text
    largest = max(known, key=lambda table: table["ste_peak_to_peak_um"])
    return f"{text}: at most {significant(largest['ste_peak_to_peak_um'], 3)} µm peak-to-peak ({largest['pair']})"


def few_positions(summaries: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Say where more positions of the mesh cycle are needed.

    Examples
    --------
    >>> table = {"pair": "stage_1", "positions": 12, "ste_peak_to_peak_um": 0.137, "ste_peak_to_peak_error_um": 0.05}
    >>> print(*few_positions([table]))
    stage_1: 12 positions of the mesh cycle; the peak-to-peak transmission error may be off by 36 %, ...
    """
    for one in summaries:
        size = one["ste_peak_to_peak_um"]
        error = one["ste_peak_to_peak_error_um"]
        if size and error and error > LARGEST_ERROR * size:
            yield (
                f"{one['pair']}: {one['positions']} positions of the mesh cycle; the peak-to-peak transmission error "
                f"may be off by {100.0 * error / size:.0f} %, and the largest contact stress may be too low: use "
                f"--positions {2 * one['positions']}"
            )


def _misalignment(project: WatchedProject) -> Iterator[str]:
    """Yield the misalignment of the gears, which static tables neglect; nothing if bearing data are unknown."""
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
    yield f"misalignment under the static load, gap over the face width: {words} (details: exugear bearings)"


def _requested_tables(
    project: WatchedProject, names: list[str], positions: int | None, grid: bool
) -> list[TableRequest]:
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
            continue
        if request.replaces:
            note(request.announcement)
        if len(request.wanted.misalignment) > 1:
            ranges = request.wanted.axes().ranges()
            note(f"{request.name}: grid over {', '.join(f'{axis} {values}' for axis, values in ranges.items())}")
    return requests


def references(
    gearbox: Gearbox, out: Path | None, names: list[str], positions: int | None, as_json: bool, whole: bool
) -> None:
    """Run the reference analysis of the pairs and print results; each position is stored when it is complete."""
    folder = results_folder(gearbox.source, out)
    requests = requested_references(gearbox, folder, names, positions)
    make_results_folder(folder)
    keep_case(gearbox, folder)
    tables = {}
    with time_noted(folder, "reference analysis"), progress_bar() as bar:
        task = bar.add_task("", total=sum(request.wanted.positions for request in requests))
        for request in requests:
            tables[request.name] = _compute_reference(request, bar, task)
    summaries = [summarise_reference(request, tables[request.name]) for request in requests]
    failures = [f"{name}: {line}" for name, table in tables.items() for line in table.failures]
    doubts = reference_warnings(summaries)
    errors = (
        failure_text("positions not converged:", failures),
        failure_text("the methods differ by more than the limit:", doubts),
    )
    title = "Static transmission error, nonlinear finite elements"
    Outcome(
        verdict=_verdict(summaries),
        summary={"case": gearbox.source, "tables": summaries},
        tables=[Table(title, summaries, REFERENCES, REFERENCE_LEGEND, noun="pairs")],
        path=folder / "tables",
        failure="\n".join(filter(None, errors)),
    ).show(as_json, whole)


def _compute_reference(request: ReferenceRequest, bar: Progress, task: TaskID) -> NonlinearTable:
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


LEGEND = (
    "Torque: of gear 1. TE: transmission error, mean and peak-to-peak (p-p). K_Hbeta, σ_H: finite elements, parallel "
    "axes, no load factors."
)
DETAILS = (
    "p-p error: estimated from every second position. 1. to 4.: harmonics, zero-to-peak. Stiffness: of the mesh, mean, "
    "with what lies between held_diameter_mm and the teeth. σ_H0: nominal, at pitch point (ISO 6336-2). σ_H aligned: "
    "largest of the mesh cycle within the path of contact. Converged: of all states of the table."
)
LARGEST_ERROR = 0.1
"""Estimated error of the peak-to-peak transmission error, over its value, from which more positions are advised."""
REFERENCE_LEGEND = (
    "Torque: of gear 1. TE: transmission error, mean and peak-to-peak (p-p), by the nonlinear reference analysis; "
    "table: by the method of the tables, which the dynamic models use. σ_H: contact stress of the most loaded tooth "
    "pair, mean along its contact line, maximum over the positions."
)


PAIR = (Column("pair", "pair"), Column("torque\nN m", "torque_gear_1_N_m", partial(significant, decimals=1)))


def _harmonic(number: int, table: Mapping[str, Any]) -> str:
    value = table["ste_harmonics_um"][number]
    return "-" if value is None else f"{value:.3f}"


CONVERGED = detail("states\nconv.", lambda table: f"{table['states'] - table['not_converged']}/{table['states']}")
TABLES = (
    *PAIR,
    Column("TE mean\nµm", "ste_mean_um", ".2f"),
    Column("TE p-p\nµm", "ste_peak_to_peak_um", ".2f"),
    Column("stiffn.\nMN/m", "mesh_stiffness_mean_N_per_m", partial(significant, digits=3), 1e-6),
    Column("K_Hbeta\naligned", "K_Hbeta_aligned", ".2f"),
    Column("σ_H\naligned MPa", "sigma_H_aligned_MPa", ".0f"),
    detail("σ_H0\nMPa", "sigma_H0_MPa", ".0f"),
    detail("p-p err.\nµm", "ste_peak_to_peak_error_um", ".3f"),
    *(detail(f"{n + 1}.\nµm", partial(_harmonic, n)) for n in range(HARMONICS)),
    CONVERGED,
)
REFERENCES = (
    *PAIR,
    Column("TE mean\nµm", "ste_mean_um", ".2f"),
    Column("table\nmean µm", "superelement_mean_um", ".2f"),
    Column("diff.\n%", "difference_of_means_percent", "+.1f"),
    Column("TE p-p\nµm", "ste_peak_to_peak_um", ".2f"),
    Column("table\np-p µm", "superelement_peak_to_peak_um", ".2f"),
    detail("σ_H\nMPa", "contact_stress_MPa", ".0f"),
    detail("table\nσ_H MPa", "superelement_contact_stress_MPa", ".0f"),
    CONVERGED,
)
"""Mean and peak-to-peak values by the reference analysis and by the method of the tables."""
