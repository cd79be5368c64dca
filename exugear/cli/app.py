"""Command line: one function per verb, thin over the library.

Libraries that take long to load are imported inside the verbs, so that ``--help`` answers at once.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from exugear.cli.console import (
    BadInputError,
    FailedError,
    StoppedError,
    exit_codes,
    interruption,
    note,
    print_json,
    print_table,
    progress_bar,
    say,
    say_what_is_logged,
    standard_streams,
)

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from exugear.dynamics.modes import Modes
    from exugear.model.gearbox import Gearbox
    from exugear.model.parts import PairSpec
    from exugear.runs.outcome import Progress as RunProgress
    from exugear.runs.outcome import Run
    from exugear.tooth_mesh.reference_tables import ReferenceOrder
    from exugear.tooth_mesh.tables import TableOrder
    from fe_ste.reference.newton import Iteration
    from fe_ste.reference.table import NonlinearTable
    from fe_ste.transmission_error.table import MeshTable


#: Fewer positions of the mesh cycle would not show the harmonics that dynamics ask of a table.
_LEAST_TABLE_POSITIONS = 8
app = typer.Typer(
    help="Transmission error of gear pairs by finite elements, and gearbox dynamics in Exudyn.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_show_locals=False,
)
CaseArgument = Annotated[Path, typer.Argument(metavar="CASE.toml", help="The gearbox file.", show_default=False)]
JsonOption = Annotated[bool, typer.Option("--json", help="Print a summary as one JSON object.")]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Results folder. (default: results/FOLDER-OF-THE-CASE)"),
]


class Variant(StrEnum):
    """How the shafts are held: on ideal joints, on their rolling bearings, or these with elastic bodies."""

    rigid = "rigid"
    bushing = "bushing"
    flexible = "flexible"


class MeshLaw(StrEnum):
    """How teeth in mesh push each other."""

    rigid = "rigid"
    constant = "constant"
    iso6336 = "iso6336"
    seed = "seed"
    line_of_action = "line_of_action"
    table = "table"


class Solver(StrEnum):
    """What integrates: the compiled loop, or Exudyn as the model of record."""

    compiled = "compiled"
    exudyn = "exudyn"


VariantOption = Annotated[Variant, typer.Option(help="How the shafts are held.", show_default=False)]
LawOption = Annotated[MeshLaw, typer.Option("--mesh-law", help="How teeth in mesh push each other.")]
FilesBelowOption = Annotated[
    Path | None,
    typer.Option(
        "--files-below",
        metavar="DIR",
        envvar="EXUGEAR_FILES_BELOW",
        help="A further folder that files may lie in which the gearbox file names. (default: its own alone)",
        show_default=False,
    ),
]
ScriptsOption = Annotated[
    bool,
    typer.Option(
        "--allow-scripts",
        envvar="EXUGEAR_ALLOW_SCRIPTS",
        help="Let gmsh scripts run that the gearbox file names; they can do all that you can.",
    ),
]
InertiasOption = Annotated[
    str | None, typer.Option("--inertias", metavar="SET", help="Inertia set. (default: as the file says)")
]


class Method(StrEnum):
    """How the teeth deflect: by condensed finite elements, or by the full non-linear analysis they are checked by."""

    superelement = "superelement"
    nonlinear = "nonlinear"


def main() -> None:
    """Run the command line.

    BLAS keeps to one thread: its idle threads wait actively and slow the compiled kernels beside them severalfold.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    say_what_is_logged()
    with standard_streams():
        app()


def _print_version(wanted: bool) -> None:
    if wanted:
        from exugear import __version__

        say(f"exugear {__version__}")
        raise typer.Exit


@app.callback()
def _program(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Hold what all verbs share."""


@app.command()
def check(case: CaseArgument, files_below: FilesBelowOption = None, as_json: JsonOption = False) -> None:
    """Read and check a gearbox file, and sum up its load cases; compute nothing."""
    with exit_codes():
        from exugear.dynamics.readiness import VARIANTS, lacking, remarks

        gearbox = read_gearbox(case, files_below, tell=False)
        _tell_scripts(gearbox)
        pairs = [_pair_summary(name, spec) for name, spec in gearbox.pairs.items()]
        loads = _load_summaries(gearbox)
        variants = {variant: lacking(gearbox, variant) for variant in VARIANTS}
        if as_json:
            summary = {"case": str(case), "name": gearbox.name, "ratio": gearbox.ratio, "pairs": pairs}
            print_json({**summary, "load_cases": loads, "variants": variants, "warnings": remarks(gearbox)})
        else:
            say(f"{gearbox.name}: no fault found, ratio {gearbox.ratio:.6f}")
            print_table("Gear pairs", [_pair_row(pair) for pair in pairs])
            if loads:
                title = f"Load cases, rolling at the overall input {gearbox.case.overall.input}"
                print_table(title, [_load_row(one) for one in loads], ("loaded flanks",))
            for variant, reason in variants.items():
                say(f"variant {variant}: {f'not possible, {reason}' if reason else 'possible'}")
            for line in remarks(gearbox):
                note(f"Warning: {line}", style="yellow")
        for one in loads:
            for doubt in one["doubts"]:
                note(f"load_cases.{one['load_case']}: {doubt}", style="yellow")


@app.command()
def ste(
    case: CaseArgument,
    mesh: Annotated[
        list[str] | None,
        typer.Option("--mesh", metavar="NAME", help="Gear pair to compute; repeatable. (default: all)"),
    ] = None,
    positions: Annotated[
        int | None,
        typer.Option(
            min=1, max=2000, help="Positions of the mesh cycle. (default: as the file says, 50; nonlinear: 10)"
        ),
    ] = None,
    method: Annotated[
        Method | None,
        typer.Option(
            help="How the teeth deflect; nonlinear takes a minute or two a position. (default: as the file says)"
        ),
    ] = None,
    grid: Annotated[
        bool,
        typer.Option("--grid", help="Over load, centre distance and misalignment too, with the axes of the file."),
    ] = False,
    out: OutOption = None,
    files_below: FilesBelowOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compute the static transmission error of the gear pairs, with pictures.

    Tables already there are kept if they were computed from the same input. Those of the method nonlinear lie beside
    the others and serve to check them; dynamics do not use them.
    """
    with exit_codes():
        from exugear.pictures.tables import draw_curves
        from exugear.tooth_mesh.tables import stored_tables

        gearbox = read_gearbox(case, files_below)
        if (method or Method(gearbox.ste.method)) is Method.nonlinear:
            if grid:
                raise BadInputError("--grid: the method nonlinear computes the static state alone; leave --grid out")
            _compute_references(gearbox, case, out, mesh or [], positions, as_json)
            return
        if positions is not None and positions < _LEAST_TABLE_POSITIONS:
            raise BadInputError(
                f"--positions {positions}: a table for dynamics needs at least {_LEAST_TABLE_POSITIONS}"
            )
        orders, folder = _order_tables(gearbox, case, out, mesh or [], positions, grid)
        with _time_noted(folder, "tables of transmission error"):
            tables = _fill_tables(orders)
        with _time_noted(folder, "pictures of the tables"):
            beside = stored_tables(gearbox, folder, positions)
            pictures = draw_curves({**beside, **tables}, folder) + _draw_contacts(orders, tables, folder)
        _report_tables(case, folder, orders, tables, pictures, as_json)


@app.command()
def modes(
    case: CaseArgument,
    variant: VariantOption,
    mesh_law: LawOption = MeshLaw.line_of_action,
    inertias: InertiasOption = None,
    out: OutOption = None,
    files_below: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compute the eigenmodes of a variant at its static load, with a Campbell diagram.

    Tables that are missing or do not fit the case are computed first.
    """
    with exit_codes():
        gearbox = read_gearbox(case, files_below, scripts)
        _check_choices(gearbox, variant, mesh_law, inertias, _results_folder(case, out, make=False))
        folder = _results_folder(case, out)
        _fill_missing_tables(gearbox, folder, mesh_law)
        with _time_noted(folder, f"modes, {variant}, {inertias or gearbox.case.default_inertias}, {mesh_law}"):
            found, path = _compute_modes(gearbox, folder, variant.value, mesh_law.value, inertias)
            picture = _draw_campbell(found, path)
        rows = _mode_summaries(found)
        if found.growth_rate > 0.0:
            note(f"Unstable: disturbances grow by up to {found.growth_rate:.3g} 1/s; a run diverges", style="yellow")
        if as_json:
            assembly = found.assembly
            label = {"variant": assembly.variant, "mesh_law": assembly.law, "inertias": assembly.inertias}
            print_json({"case": str(case), **label, "modes": rows, "file": str(path), "picture": str(picture)})
            return
        print_table(f"Modes of {_label(found)}", [_mode_row(row) for row in rows], ("what moves",))
        say(f"Modes in {path}, diagram in {picture}")


@app.command()
def run(
    case: CaseArgument,
    variant: VariantOption,
    mesh_law: LawOption = MeshLaw.line_of_action,
    inertias: InertiasOption = None,
    load_case: Annotated[
        str | None, typer.Option("--load-case", metavar="NAME", help="Load case. (default: the first of the file)")
    ] = None,
    solver: Annotated[Solver, typer.Option(help="What integrates.")] = Solver.compiled,
    duration: Annotated[
        float | None, typer.Option(metavar="S", help="Simulated time, s. (default: the load case's)")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with a run that was stopped.")] = False,
    out: OutOption = None,
    files_below: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run a load case in time; results are written while it goes on.

    Ctrl-C keeps what was reached. Tables that are missing or do not fit the case are computed first.
    """
    with exit_codes():
        from exugear.runs.run_folder import refuse_if_busy, refuse_to_resume, run_directory

        gearbox = read_gearbox(case, files_below, scripts)
        loads = load_case or next(iter(gearbox.load_cases), "")
        _check_choices(gearbox, variant, mesh_law, inertias, _results_folder(case, out, make=False), loads)
        _check_freedom(gearbox)
        _check_extent(gearbox, variant, mesh_law, loads, duration, out or Path("results"))
        _check_solver(gearbox, variant, solver)
        inertias = inertias or gearbox.case.default_inertias
        folder = _results_folder(case, out, make=not resume)
        directory = run_directory(folder, variant.value, loads, mesh_law.value, inertias)
        refuse_if_busy(directory)
        if resume and (reason := refuse_to_resume(directory)):
            raise BadInputError(f"--resume: {reason}; run without it")
        _tell_doubts(gearbox, loads)
        _fill_missing_tables(gearbox, folder, mesh_law)
        with _time_noted(folder, f"run, {variant}, {loads}, {inertias}, {mesh_law}, solver {solver}"):
            finished = _simulate(
                gearbox, folder, variant.value, mesh_law.value, inertias, loads, solver.value, duration, resume
            )
        _report_run(case, finished, as_json)


@app.command()
def view(
    case: CaseArgument,
    variant: Annotated[Variant, typer.Option(help="How the shafts are held.")] = Variant.bushing,
    mesh_law: LawOption = MeshLaw.line_of_action,
    inertias: InertiasOption = None,
    near: Annotated[
        float | None,
        typer.Option(
            min=0.0, metavar="HZ", help="Frequency whose nearest mode is shown first. (default: as the file says)"
        ),
    ] = None,
    animation: Annotated[bool, typer.Option("--gif", help="Write that mode as an animated picture, too.")] = False,
    out: OutOption = None,
    files_below: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Show the gearbox and its modes in three dimensions: a web page that stands alone, and pictures."""
    with exit_codes():
        gearbox = read_gearbox(case, files_below, scripts)
        _check_choices(gearbox, variant, mesh_law, inertias, _results_folder(case, out, make=False))
        folder = _results_folder(case, out)
        _fill_missing_tables(gearbox, folder, mesh_law)
        found, path = _compute_modes(gearbox, folder, variant.value, mesh_law.value, inertias)
        wanted = gearbox.case.report.reference_frequency_Hz if near is None else near
        first = int(found.overall.argmax()) if wanted is None else found.nearest(wanted)
        written = _draw_modes(found, path.parent, first, animation)
        if as_json:
            print_json({"case": str(case), "mode": first + 1, "files": [str(file) for file in written]})
            return
        for file in written:
            say(str(file))


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Results folder.", show_default=False)],
    near: Annotated[
        float | None,
        typer.Option(min=1.0, metavar="HZ", help="Frequency to look for modes at. (default: as the case says)"),
    ] = None,
    files_below: FilesBelowOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write a report of a results folder: one web page with pictures, tables, assumptions, and where time went.

    Compares the variants whose runs and modes are there. gmsh scripts never run: what they would make must be there.
    """
    with exit_codes():
        from exugear.model.reading import CaseError
        from exugear.report.writer import ReportError, write_report

        _check_files_below(files_below)
        if not folder.is_dir():
            raise BadInputError(f"{folder}: no such folder; name the one that `exugear run` wrote into")
        try:
            with _time_noted(folder, "report"), progress_bar() as bar:
                task = bar.add_task("report", total=None)
                written = write_report(folder, near, lambda what: bar.update(task, description=what), files_below)
        except (CaseError, ReportError) as error:
            raise BadInputError(error) from error
        _report_report(folder, written.path, written.statements, written.left_out, as_json)


def _order_tables(
    gearbox: Gearbox, case: Path, out: Path | None, names: list[str], positions: int | None, grid: bool
) -> tuple[list[TableOrder], Path]:
    from exugear.model.reading import CaseError
    from exugear.results.folder import keep_case
    from exugear.tooth_mesh.tables import order_tables

    folder = out or Path("results") / case.resolve().parent.name
    try:
        orders = order_tables(gearbox, folder, names, positions, grid)
    except CaseError as error:
        raise BadInputError(error) from error
    make_results_folder(folder)
    keep_case(gearbox, folder)
    for order in orders:
        if order.stored:
            note(f"{order.name}: kept {order.path}, computed from the same input")
        elif order.replaces:
            note(order.replaces)
    return orders, folder


def _compute_references(
    gearbox: Gearbox, case: Path, out: Path | None, names: list[str], positions: int | None, as_json: bool
) -> None:
    """Run the reference analysis of the pairs and report; each position is kept as soon as it is solved."""
    from exugear.model.reading import CaseError
    from exugear.results.folder import keep_case
    from exugear.tooth_mesh.reference_tables import order_references, summarise_reference

    folder = out or Path("results") / case.resolve().parent.name
    try:
        orders = order_references(gearbox, folder, names, positions)
    except CaseError as error:
        raise BadInputError(error) from error
    make_results_folder(folder)
    keep_case(gearbox, folder)
    tables = {}
    with _time_noted(folder, "reference analysis"), progress_bar() as bar:
        task = bar.add_task("", total=sum(order.wanted.positions for order in orders))
        for order in orders:
            tables[order.name] = _fill_reference(order, bar, task)
    summaries = [summarise_reference(order, tables[order.name]) for order in orders]
    if as_json:
        print_json({"case": str(case), "tables": summaries})
    else:
        print_table("Static transmission error, non-linear finite elements", [_ste_row(row) for row in summaries])
        say(f"Tables in {folder / 'tables'}")
    failures = [f"{name}: {line}" for name, table in tables.items() for line in table.failures]
    if failures:
        raise FailedError("\n".join(["positions that are not solved:", *failures]))


def _fill_reference(order: ReferenceOrder, bar: Progress, task: TaskID) -> NonlinearTable:
    from fe_ste.geometry.checks import GeometryError

    before = bar.tasks[task].completed

    def at_iteration(done: int, of: int, iteration: Iteration | None) -> None:
        interruption.check()
        text = f"{order.name}: {done} of {of} positions"
        if iteration is not None:
            text += f", {100 * iteration.load:.3g} % of the load, iteration {iteration.number}"
        bar.update(task, completed=before + done, description=text)

    try:
        return order.fill(at_iteration)
    except GeometryError as error:
        raise BadInputError(f"pairs.{order.name}: {error}") from error


def _fill_tables(orders: list[TableOrder]) -> dict[str, MeshTable]:
    """Return the table of each order, computing those that are not stored."""
    tables = {order.name: order.stored for order in orders if order.stored}
    missing = [order for order in orders if not order.stored]
    if missing:
        with progress_bar() as bar:
            task = bar.add_task("", total=sum(_work(order) for order in missing))
            for order in missing:
                tables[order.name] = _fill_table(order, bar, task)
    return {order.name: tables[order.name] for order in orders}


def _fill_table(order: TableOrder, bar: Progress, task: TaskID) -> MeshTable:
    from fe_ste.geometry.checks import GeometryError
    from fe_ste.tools.sparse import FactorisationError
    from fe_ste.transmission_error.grid import SweepError

    before = bar.tasks[task].completed
    bar.update(task, description=f"{order.name}: finite elements")

    what = "position" if _states(order) == order.wanted.positions else "state"

    def at_state(done: int, of: int) -> None:
        interruption.check()
        completed = before + _work(order) - of + done
        bar.update(task, completed=completed, description=f"{order.name}: {what} {done} of {of}")

    try:
        return order.fill(at_state)
    except GeometryError as error:
        raise BadInputError(f"pairs.{order.name}: {error}") from error
    except (FactorisationError, SweepError) as error:
        raise FailedError(f"{order.name}: {error}") from error


def _work(order: TableOrder) -> int:
    """Work of a table, in states: the time left counts the finite elements of both gears as well."""
    finite_elements = 500
    return finite_elements + _states(order)


def _states(order: TableOrder) -> int:
    wanted = order.wanted
    return wanted.positions * len(wanted.torque) * max(len(wanted.centre_distance), 1) * len(wanted.misalignment)


def _results_folder(case: Path, out: Path | None, make: bool = True) -> Path:
    folder = out or Path("results") / case.resolve().parent.name
    if make:
        make_results_folder(folder)
    return folder


def _check_choices(
    gearbox: Gearbox,
    variant: Variant,
    law: MeshLaw,
    inertias: str | None,
    folder: Path,
    load_case: str | None = None,
) -> None:
    """Refuse what the gearbox does not have, or may not do, before anything is written into the results folder."""
    from exugear.bodies.of_gearbox.solids import check_solids
    from exugear.dynamics.readiness import lacking
    from exugear.results.folder import bodies_folder

    with _model_errors():
        gearbox.bodies(inertias)
        if load_case is not None and load_case not in gearbox.load_cases:
            known = ", ".join(gearbox.load_cases) or "none"
            raise gearbox.fault(f"no load case {load_case!r}; load cases are {known}")
        reason = lacking(gearbox, variant.value)
        if reason:
            raise gearbox.fault(f"variant {variant}: {reason}")
        if variant is Variant.flexible:
            check_solids(gearbox, bodies_folder(folder))
    if law is MeshLaw.rigid and variant is not Variant.rigid:
        raise BadInputError(f"--mesh-law rigid: its gears only roll, which needs the variant rigid, not {variant}")


def _check_extent(
    gearbox: Gearbox, variant: Variant, law: MeshLaw, load_case: str, duration: float | None, folder: Path
) -> None:
    """Refuse a simulated time that is too short, or whose results do not fit on the disk."""
    from exugear.runs.extent import check_disk, check_duration, sample_bytes

    supports = gearbox.joints if variant is Variant.rigid else gearbox.bearings
    size = sample_bytes(len(gearbox.meshes), len(supports), law is MeshLaw.table)
    with _model_errors():
        check_duration(gearbox, gearbox.load_cases[load_case], duration)
        check_disk(gearbox, gearbox.load_cases[load_case], folder, duration, sample_bytes=size)


def _tell_doubts(gearbox: Gearbox, load_case: str) -> None:
    """Say what looks like the wrong sign of a torque."""
    from exugear.loads.summary import doubts_about, summarise_loads

    with _model_errors():
        doubts = doubts_about(summarise_loads(gearbox, gearbox.load_cases[load_case]))
    for doubt in doubts:
        note(f"load_cases.{load_case}: {doubt}", style="yellow")


def _tell_scripts(gearbox: Gearbox) -> None:
    """Check the solids, and say which of them only a script makes."""
    from exugear.bodies.of_gearbox.solids import solids_of

    with _model_errors():
        for key, model in solids_of(gearbox):
            if model.mesh.is_script:
                note(
                    f"{key}.file = {model.mesh.path.name!r}: a gmsh script can run any command, so modes, run and "
                    "view want --allow-scripts or EXUGEAR_ALLOW_SCRIPTS=1 for the variant flexible",
                    style="yellow",
                )


@contextmanager
def _time_noted(folder: Path, step: str) -> Iterator[None]:
    """Write into the results folder how long a step took, if it ended well."""
    from exugear.results.folder import note_time

    start = time.perf_counter()
    yield
    try:
        note_time(folder, step, time.perf_counter() - start)
    except OSError as error:  # the work itself is done
        note(f"The time that it took is not noted: {error}", style="yellow")


@contextmanager
def _model_errors() -> Iterator[None]:
    """Turn errors of the model's parts into those of the command line."""
    from exugear.bearings.rows import BearingError
    from exugear.dynamics.assembly import VariantError
    from exugear.dynamics.statics import BalanceError
    from exugear.model.reading import CaseError
    from exugear.tooth_mesh.placement import MeshError

    try:
        yield
    except (CaseError, VariantError, MeshError, BearingError) as error:
        raise BadInputError(error) from error
    except BalanceError as error:
        raise FailedError(error) from error


def _fill_missing_tables(gearbox: Gearbox, folder: Path, law: MeshLaw) -> None:
    """Compute the tables that a law needs and that are not there or belong to another input."""
    from exugear.results.folder import keep_case
    from exugear.tooth_mesh.tables import missing_tables

    orders = []
    if law not in (MeshLaw.rigid, MeshLaw.iso6336):
        with _model_errors():
            orders = missing_tables(gearbox, folder, grid=law is MeshLaw.table)
    keep_case(gearbox, folder)
    for order in orders:
        note(order.replaces or f"{order.name}: no table in {folder}; it is computed first")
    with _time_noted(folder, "tables, computed before dynamics") if orders else nullcontext():
        tables = _fill_tables(orders)
    failures = [f"{name}: {line}" for name, table in tables.items() for line in table.failures]
    if failures:
        raise FailedError("\n".join(["positions of the tables that are not solved:", *failures]))


def _check_solver(gearbox: Gearbox, variant: Variant, solver: Solver) -> None:
    """Refuse a solver that cannot run what the file asks for, before anything is computed."""
    floating = [name for name, body in gearbox.case.bodies.items() if body.flexibility == "ffrf"]
    if variant is Variant.flexible and solver is Solver.compiled and floating:
        raise BadInputError(
            f"--solver compiled: bodies.{floating[0]}.flexibility = 'ffrf' runs in Exudyn only; "
            "add --solver exudyn, or choose 'nonrotating'"
        )


def _check_freedom(gearbox: Gearbox) -> None:
    """Refuse to run a train whose speeds do not follow from one of them."""
    freedoms = gearbox.kinematic_modes.shape[1]
    if freedoms > 1:
        raise BadInputError(
            f"{gearbox.source}: the gear train has {freedoms} degrees of freedom, and its runs do not work yet; "
            "fix a body (fixed = true) or couple two, or take `exugear modes`"
        )


def _reduce_elastic_bodies(gearbox: Gearbox, folder: Path, variant: str, inertias: str | None) -> None:
    """Reduce the elastic bodies of a variant behind a progress bar; kept, they are there at once when asked for."""
    if variant != Variant.flexible:
        return
    from exugear.bearings.supports import elastic_names
    from exugear.bodies.of_gearbox.elastic_bodies import reduced_bodies
    from exugear.results.folder import bodies_folder

    with progress_bar() as bar:
        task = bar.add_task("", total=len(elastic_names(gearbox)))

        def begin(name: str) -> None:
            done = bar.tasks[task].completed + (bar.tasks[task].description != "")
            bar.update(task, completed=done, description=f"{name}: finite elements, reduced to its seats")

        try:
            with _model_errors():
                reduced_bodies(gearbox, inertias or gearbox.case.default_inertias, bodies_folder(folder), begin)
        except BadInputError as error:  # a mesh that only reading shows to be none: the work has begun
            raise FailedError(error) from error
        bar.update(task, completed=bar.tasks[task].total)


def _compute_modes(gearbox: Gearbox, folder: Path, variant: str, law: str, inertias: str | None) -> tuple[Modes, Path]:
    from exugear.dynamics.modes import eigenmodes
    from exugear.results.folder import bodies_folder, modes_path
    from exugear.tooth_mesh.stiffness import mesh_stiffness

    _reduce_elastic_bodies(gearbox, folder, variant, inertias)
    with _model_errors():
        found = eigenmodes(
            gearbox, variant, mesh_stiffness(gearbox, law, folder), law, inertias, folder=bodies_folder(folder)
        )
    for name, body in found.assembly.elastic_bodies.items():
        figures = body.reduced.summary
        unknowns, took = sum(figures.unknowns.values()), figures.seconds
        note(f"{name}: {unknowns} unknowns reduced to {body.reduced.size} coordinates in {took:.1f} s")
    return found, found.save(modes_path(folder, variant, law, found.assembly.inertias))


def _draw_campbell(found: Modes, path: Path) -> Path:
    """Draw the modes that the overall transmission error sees, over the speeds of the fastest load case."""
    from exugear.pictures.diagrams import plot_campbell
    from exugear.spectra.comparison import mobility_shares
    from exugear.spectra.orders import order_lines

    gearbox, least = found.assembly.gearbox, 1e-3
    shares = mobility_shares(found.to_dataset())
    seen = (found.frequency > 0.0) & (shares >= least)
    highest = max(gearbox.mesh_frequencies(1.0).values())
    top = 1.1 * float(max(found.frequency[seen], default=1.0))
    picture = path.with_name("campbell.png")
    plot_campbell(
        found.frequency[seen],
        order_lines(gearbox),
        top / highest,
        picture,
        weights=(shares[seen] / shares.max()) ** 0.5,
        highest_frequency=top,
        title=f"{_label(found)}: modes with a share over {100 * least:g} %",
    )
    return picture


def _label(found: Modes) -> str:
    assembly = found.assembly
    law = f"law {assembly.law}, inertias {assembly.inertias}"
    return f"{assembly.variant}, {law}, housing factor {assembly.housing_factor:g}"


def _mode_summaries(found: Modes) -> list[dict[str, Any]]:
    from exugear.spectra.comparison import report_mode

    data = found.to_dataset()
    reports = [report_mode(data, place) for place in range(len(found.names))]
    return [
        {
            "mode": mode.place + 1,
            "frequency_Hz": mode.frequency,
            "damping_ratio": mode.damping_ratio,
            "share_of_overall_dte": mode.share,
            "amplification": mode.amplification,
            "name": mode.name,
        }
        for mode in reports
    ]


def _mode_row(summary: dict[str, Any]) -> dict[str, str]:
    return {
        "no.": str(summary["mode"]),
        "Hz": f"{summary['frequency_Hz']:.1f}",
        "damping\n%": f"{100 * summary['damping_ratio']:.2f}",
        "DTE share\n%": f"{100 * summary['share_of_overall_dte']:.2f}",
        "amplif.": f"{summary['amplification']:.2f}",
        "what moves": summary["name"],
    }


def _simulate(
    gearbox: Gearbox,
    folder: Path,
    variant: str,
    law: str,
    inertias: str,
    load_case: str,
    solver: Literal["compiled", "exudyn"],
    duration: float | None,
    resume: bool,
) -> Run:
    """Run a load case behind a progress bar."""
    from exugear.runs.outcome import LimitError, RunError
    from exugear.runs.run_folder import refuse_to_resume, run_directory
    from exugear.runs.runup import simulate
    from exugear.tooth_mesh.stiffness import mesh_stiffness

    directory = run_directory(folder, variant, load_case, law, inertias)
    if not resume and not refuse_to_resume(directory):
        note(f"{directory}: a stopped run is begun anew; --resume would have gone on from it")
    _reduce_elastic_bodies(gearbox, folder, variant, inertias)
    with progress_bar() as bar:
        task = bar.add_task(f"{variant}: start in balance", total=None)

        def show(at: RunProgress) -> None:
            interruption.check()
            text = f"{variant}: {at.simulated:.2f} of {at.total:g} s, {at.speed:.2f} simulated s per s"
            bar.update(task, completed=at.simulated, total=at.total, description=text)

        try:
            with _model_errors():
                return simulate(
                    gearbox,
                    variant,
                    mesh_stiffness(gearbox, law, folder),
                    folder,
                    load_case=load_case,
                    mesh_law=law,
                    inertias=inertias,
                    duration=duration,
                    solver=solver,
                    resume=resume,
                    progress=show,
                )
        except LimitError as error:
            return error.run
        except RunError as error:
            raise FailedError(error) from error
        except KeyboardInterrupt:
            if refuse_to_resume(directory):
                raise
            raise StoppedError(f"kept in {directory}, --resume goes on from there") from None


def _report_run(case: Path, finished: Run, as_json: bool) -> None:
    """Print what a run reached; end with 130 if the user stopped it, with 1 if it is not to be trusted."""
    if not finished.complete and not finished.halted:
        so_far = "".join(f"\nNot to be trusted so far: {reason}" for reason in finished.reasons)
        raise StoppedError(f"at {finished.end:.3f} s; kept in {finished.path}, --resume goes on from there{so_far}")
    from exugear.dynamics.signals import BALANCE_TERMS, energy_residual
    from exugear.model.gearbox import RPM
    from exugear.results.run_file import MESH_TIMES, load_run

    data = load_run(finished.path, ("input_speed", *MESH_TIMES, *BALANCE_TERMS))
    outside = float(data["outside_time"].max())
    summary = {
        "case": str(case),
        **{key: str(data.attrs[key]) for key in ("variant", "load_case", "mesh_law", "inertias", "solver")},
        "file": str(finished.path),
        "simulated_s": finished.end,
        "wall_s": round(finished.wall, 2),
        "input_speed_rpm": float(data["input_speed"][-1]) / RPM,
        "energy_not_accounted_for": energy_residual(data),
        "longest_pull_of_a_mesh_s": float(data["pulling_time"].max()),
        "longest_time_apart_s": float(data["apart_time"].max()),
        "longest_time_outside_table_s": outside,
        "complete": finished.complete,
        "trusted": finished.trusted,
        "reasons": list(finished.reasons),
    }
    if as_json:
        unknown = {key for key, value in summary.items() if isinstance(value, float) and not math.isfinite(value)}
        print_json({key: None if key in unknown else value for key, value in summary.items()})
    else:
        _print_run(summary, outside)
    if not finished.trusted:
        what = "the run is" if finished.complete else f"the run was stopped at {finished.end:.4g} s and is"
        raise FailedError("\n".join([f"{what} not to be trusted:", *finished.reasons, f"It is in {finished.path}"]))


def _print_run(summary: dict[str, Any], outside: float) -> None:
    say(
        f"{summary['variant']}, {summary['load_case']}, law {summary['mesh_law']}, inertias {summary['inertias']}: "
        f"{summary['simulated_s']:g} s simulated in {summary['wall_s']:.1f} s ({summary['solver']}), "
        f"{summary['input_speed_rpm']:.1f} rpm reached"
    )
    if outside > 0.0:
        say(
            f"A mesh was outside its table for {outside:.3g} s, where the table goes on in a straight line: "
            "outside_time in the results names the mesh; widen the axes of [ste]"
        )
    say(f"Results in {summary['file']}")


def _draw_modes(found: Modes, folder: Path, first: int, animation: bool) -> list[Path]:
    """Write the page of all elastic modes, and pictures of the gearbox and one mode if this machine can render."""
    from exugear.pictures.elastic_scene import animate_elastic_bodies, draw_elastic_bodies, elastic_scene
    from exugear.pictures.scene import animate_mode, draw_gearbox, draw_mode
    from exugear.pictures.shapes import bodies_of, mode_scene, motions_of
    from exugear.pictures.viewer import write_mode_page
    from fe_ste.tools.rendering import RenderingError

    assembly = found.assembly
    bodies = bodies_of(assembly.gearbox)
    drawn = {body.name for body in bodies}
    scenes = {}
    for place, name in enumerate(found.names):
        motions = motions_of(assembly.bodies, assembly.coordinates, assembly.rigid_part(found.shapes[:, place]))
        moving = {body: motion for body, motion in motions.items() if body in drawn}
        if found.frequency[place] > 0.0 and any(motion.any() for motion in moving.values()):
            scenes[place] = mode_scene(bodies, moving, title=f"{found.frequency[place]:.0f} Hz: {name}")
    if not scenes:
        raise BadInputError(f"{_label(found)}: no elastic mode to show")
    places = list(scenes)
    shown = places.index(first) if first in scenes else 0
    heading = f"{assembly.gearbox.name}, {_label(found)}"
    if assembly.elastic_bodies:
        heading += "; elastic bodies move here as a whole, without their deformation"
    written = [write_mode_page(list(scenes.values()), folder / "modes.html", heading=heading, first=shown)]
    scene = scenes[places[shown]]
    stem = folder / f"mode_{places[shown] + 1}"
    try:
        draw_gearbox(bodies, folder / "gearbox.png", title=assembly.gearbox.name)
        still, animated = stem.with_suffix(".png"), stem.with_suffix(".gif")
        if assembly.elastic_bodies:
            deformed = elastic_scene(assembly, found.shapes[:, places[shown]], title=scene.title)
            draw_elastic_bodies(deformed, still)
            written += [animate_elastic_bodies(deformed, animated)] if animation else []
        else:
            draw_mode(scene, still)
            written += [animate_mode(scene, animated)] if animation else []
        written += [folder / "gearbox.png", still]
    except RenderingError as error:
        note(f"No pictures: {error}", style="yellow")
    return written


def _report_report(
    folder: Path, path: Path, statements: tuple[str, ...], left_out: tuple[str, ...], as_json: bool
) -> None:
    from exugear.results.folder import times_spent

    spent = times_spent(folder)
    for line in left_out:
        note(f"Left out: {line}", style="yellow")
    if as_json:
        times = {entry.step: entry.seconds for entry in spent}
        print_json({"report": str(path), "statements": list(statements), "left_out": list(left_out), "seconds": times})
        return
    for line in statements:
        say(f"- {line}")
    rows = [
        {"step": entry.step, "wall s": f"{entry.seconds:.1f}", "peak MB": f"{1e-6 * entry.memory:.0f}"}
        for entry in spent
    ]
    print_table("Where the time went, the last time of each step (steps side by side overlap)", rows, ("step",))
    say(f"Report: {path}")


def _draw_contacts(orders: list[TableOrder], tables: dict[str, MeshTable], folder: Path) -> list[Path]:
    """Draw the teeth in contact where the picture is missing or the table is new; return all such pictures."""
    from exugear.pictures.tables import contact_picture, draw_contact
    from fe_ste.contact.kinematics import ContactError
    from fe_ste.tools.rendering import RenderingError

    pictures: list[Path] = []
    with progress_bar() as bar:
        for order in bar.track(orders, description="pictures of the teeth"):
            path = contact_picture(order.name, folder)
            try:
                if not (order.stored and path.exists()):
                    draw_contact(order, tables[order.name], folder)
            except ContactError as error:
                note(f"No picture of the teeth of {order.name}: {error}", style="yellow")
                continue
            except RenderingError as error:
                note(f"No pictures of the teeth: {error}", style="yellow")
                break
            pictures.append(path)
    return pictures


def _report_tables(
    case: Path,
    folder: Path,
    orders: list[TableOrder],
    tables: dict[str, MeshTable],
    pictures: list[Path],
    as_json: bool,
) -> None:
    from exugear.tooth_mesh.tables import summarise

    summaries = [summarise(order, tables[order.name]) for order in orders]
    if as_json:
        print_json({"case": str(case), "tables": summaries, "pictures": [str(path) for path in pictures]})
    else:
        print_table("Static transmission error", [_ste_row(summary) for summary in summaries])
        say(f"Tables in {folder / 'tables'}, pictures in {folder / 'pictures'}")
    failures = [f"{name}: {line}" for name, table in tables.items() for line in table.failures]
    if failures:
        raise FailedError("\n".join(["positions that are not solved:", *failures]))


def make_results_folder(folder: Path) -> None:
    """Make the folder that a verb writes into, so that a wrong one shows before the work, not after."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(f"--out {folder}: {error.strerror}; name a folder that can be made") from error
    if not os.access(folder, os.W_OK):
        raise BadInputError(f"--out {folder}: not writable; name another folder")


def read_gearbox(case: Path, files_below: Path | None = None, scripts: bool = False, *, tell: bool = True) -> Gearbox:
    """Read a gearbox file for a verb, with what the user permits it, and try all its parts; tell what is unusual."""
    from exugear.dynamics.readiness import check_parts
    from exugear.model.gearbox import Gearbox
    from exugear.model.named_files import Permissions
    from exugear.model.reading import CaseError

    _check_files_below(files_below)
    try:
        gearbox = Gearbox.from_toml(case, Permissions(scripts, files_below))
        check_parts(gearbox)
    except CaseError as error:
        raise BadInputError(error) from error
    for line in gearbox.warnings if tell else ():
        note(f"Warning: {line}", style="yellow")
    return gearbox


def _check_files_below(folder: Path | None) -> None:
    if folder is not None and not folder.is_dir():
        raise BadInputError(f"--files-below {folder}: no such folder; name one that the gearbox file may read from")


def _pair_summary(name: str, spec: PairSpec) -> dict[str, Any]:
    pair = spec.pair
    return {
        "pair": name,
        "teeth": [pair.pinion.teeth, pair.gear.teeth],
        "centre_distance_mm": 1e3 * pair.centre_distance,
        "pressure_angle_deg": math.degrees(pair.working_pressure_angle),
        "transverse_contact_ratio": pair.transverse_contact_ratio,
        "overlap_ratio": pair.overlap_ratio,
        "torque_gear_1_N_m": spec.static_torque,
    }


def _pair_row(pair: dict[str, Any]) -> dict[str, str]:
    return {
        "pair": pair["pair"],
        "teeth": "{}/{}".format(*pair["teeth"]),
        "centre dist.\nmm": f"{pair['centre_distance_mm']:.3f}",
        "press. angle\ndeg": f"{pair['pressure_angle_deg']:.3f}",
        "contact ratio\n+ overlap": f"{pair['transverse_contact_ratio']:.3f} + {pair['overlap_ratio']:.3f}",
        "torque 1\nN m": f"{pair['torque_gear_1_N_m']:.1f}",
    }


def _load_summaries(gearbox: Gearbox) -> list[dict[str, Any]]:
    """Sum up what each load case does to the rolling train; one that no run could take is bad input."""
    from exugear.loads.summary import doubts_about, summarise_loads
    from exugear.model.gearbox import RPM
    from exugear.runs.extent import check_duration

    found = []
    with _model_errors():
        for name, case in gearbox.load_cases.items():
            check_duration(gearbox, case)
            loads = summarise_loads(gearbox, case)
            body, rim = loads.fastest_rim
            found.append(
                {
                    "load_case": name,
                    "net_torque_N_m": loads.net_torque,
                    "driven": loads.driven,
                    "duration_s": case.duration,
                    "start_speed_rpm": loads.start_speed / RPM,
                    "end_speed_rpm": loads.end_speed / RPM,
                    "fastest_rim_m_per_s": rim,
                    "fastest_rim_on": body,
                    "loaded_flanks": dict(loads.flanks),
                    "reversed_flanks": list(loads.reversed_flanks),
                    "doubts": list(doubts_about(loads)),
                }
            )
    return found


def _load_row(summary: dict[str, Any]) -> dict[str, str]:
    turned = summary["reversed_flanks"]
    flanks = (f"{name} {sign}{'!' if name in turned else ''}" for name, sign in summary["loaded_flanks"].items())
    return {
        "load case": summary["load_case"],
        "net torque\nN m": f"{summary['net_torque_N_m']:.6g}" + (" (driven)" if summary["driven"] else ""),
        "end speed\nrpm": f"{summary['end_speed_rpm']:.4g}",
        "fastest rim\nm/s": f"{summary['fastest_rim_m_per_s']:.3g}",
        "loaded flanks": ", ".join(flanks),
    }


def _ste_row(summary: dict[str, Any]) -> dict[str, str]:
    def shown(key: str, form: str, factor: float = 1.0) -> str:
        return "-" if summary[key] is None else format(factor * summary[key], form)

    solved = summary["states"] - summary["not_converged"]
    return {
        "pair": summary["pair"],
        "torque 1\nN m": shown("torque_gear_1_N_m", ".1f"),
        "mean\nµm": shown("ste_mean_um", ".2f"),
        "peak-peak\nµm": shown("ste_peak_to_peak_um", ".3f"),
        "stiffness\nMN/m": shown("mesh_stiffness_mean_N_per_m", ".1f", 1e-6),
        "pressure\nMPa": shown("max_pressure_MPa", ".0f"),
        "states\nsolved": f"{solved}/{summary['states']}",
    }
