"""Command line: one function per verb, thin over the library.

Libraries that take long to load are imported inside the verbs, so that ``--help`` answers at once.
"""

from __future__ import annotations

import math
import os
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exugear.console import (
    BadInputError,
    FailedError,
    exit_codes,
    note,
    print_json,
    print_table,
    progress_bar,
    results,
)

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from exugear.gearbox import Gearbox, PairSpec
    from exugear.tables import TableOrder
    from fe_ste.table import MeshTable

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
    typer.Option("--out", metavar="DIR", help="Results folder. [default: results/FOLDER-OF-THE-CASE]"),
]


class Method(StrEnum):
    """How the teeth deflect: by condensed finite elements."""

    superelement = "superelement"


def main() -> None:
    """Run the command line.

    BLAS keeps to one thread: its idle threads wait actively and slow the compiled kernels beside them severalfold.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    app()


def _print_version(wanted: bool) -> None:
    if wanted:
        from exugear import __version__

        results.print(f"exugear {__version__}", highlight=False)
        raise typer.Exit


@app.callback()
def _program(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Hold what all verbs share."""


@app.command()
def check(case: CaseArgument, as_json: JsonOption = False) -> None:
    """Read and check a gearbox file; compute nothing."""
    with exit_codes():
        gearbox = read_gearbox(case)
        pairs = [_pair_summary(name, spec) for name, spec in gearbox.pairs.items()]
        if as_json:
            print_json({"case": str(case), "name": gearbox.name, "ratio": gearbox.ratio, "pairs": pairs})
            return
        results.print(f"{gearbox.name}: no fault found, ratio {gearbox.ratio:.6f}", highlight=False)
        print_table("Gear pairs", [_pair_row(pair) for pair in pairs])


@app.command()
def ste(
    case: CaseArgument,
    mesh: Annotated[
        list[str] | None,
        typer.Option("--mesh", metavar="NAME", help="Gear pair to compute; repeatable. [default: all]"),
    ] = None,
    positions: Annotated[
        int | None,
        typer.Option(min=8, max=2000, help="Positions of the mesh cycle. [default: as the file says, 50]"),
    ] = None,
    method: Annotated[Method, typer.Option(help="How the teeth deflect.")] = Method.superelement,
    out: OutOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compute the static transmission error of the gear pairs, with pictures.

    Tables already there are kept if they were computed from the same input.
    """
    with exit_codes():
        from exugear.tables import draw_curves, stored_tables

        gearbox = read_gearbox(case)
        orders, folder = _order_tables(gearbox, case, out, mesh or [], positions)
        tables = _fill_tables(orders)
        beside = stored_tables(gearbox, folder, positions)
        pictures = draw_curves({**beside, **tables}, folder) + _draw_contacts(orders, tables, folder)
        _report_tables(case, folder, orders, tables, pictures, as_json)


def _order_tables(
    gearbox: Gearbox, case: Path, out: Path | None, names: list[str], positions: int | None
) -> tuple[list[TableOrder], Path]:
    from exugear.gearbox import CaseError
    from exugear.tables import order_tables

    folder = out or Path("results") / case.resolve().parent.name
    try:
        orders = order_tables(gearbox, folder, names, positions)
    except CaseError as error:
        raise BadInputError(error) from error
    make_results_folder(folder)
    for order in orders:
        if order.stored:
            note(f"{order.name}: kept {order.path}, computed from the same input")
        elif order.replaces:
            note(order.replaces)
    return orders, folder


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
    from fe_ste.gears import GeometryError
    from fe_ste.sparse import FactorisationError

    before = bar.tasks[task].completed
    bar.update(task, description=f"{order.name}: finite elements")

    def at_position(done: int, of: int) -> None:
        completed = before + _work(order) - of + done
        bar.update(task, completed=completed, description=f"{order.name}: position {done} of {of}")

    try:
        return order.fill(at_position)
    except GeometryError as error:
        raise BadInputError(f"pairs.{order.name}: {error}") from error
    except (FactorisationError, OSError) as error:
        raise FailedError(f"{order.name}: {error}") from error


def _work(order: TableOrder) -> int:
    """Work of a table, in positions: the time left counts the finite elements of both gears as well."""
    finite_elements = 150
    return finite_elements + order.wanted.positions


def _draw_contacts(orders: list[TableOrder], tables: dict[str, MeshTable], folder: Path) -> list[Path]:
    """Draw the teeth in contact where the picture is missing or the table is new; return all such pictures."""
    from exugear.tables import contact_picture, draw_contact
    from fe_ste.contact import ContactError
    from fe_ste.scene import RenderingError

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
    from exugear.tables import summarise

    summaries = [summarise(order, tables[order.name]) for order in orders]
    if as_json:
        print_json({"case": str(case), "tables": summaries, "pictures": [str(path) for path in pictures]})
    else:
        print_table("Static transmission error", [_ste_row(summary) for summary in summaries])
        results.print(f"Tables in {folder / 'tables'}, pictures in {folder / 'pictures'}", highlight=False)
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


def read_gearbox(case: Path) -> Gearbox:
    """Read a gearbox file for a verb."""
    from exugear.gearbox import CaseError, Gearbox

    try:
        return Gearbox.from_toml(case)
    except CaseError as error:
        raise BadInputError(error) from error


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


def _ste_row(summary: dict[str, Any]) -> dict[str, str]:
    def shown(key: str, form: str, factor: float = 1.0) -> str:
        return "-" if summary[key] is None else format(factor * summary[key], form)

    solved = summary["positions"] - summary["not_converged"]
    return {
        "pair": summary["pair"],
        "torque 1\nN m": shown("torque_gear_1_N_m", ".1f"),
        "mean\nµm": shown("ste_mean_um", ".2f"),
        "peak-peak\nµm": shown("ste_peak_to_peak_um", ".3f"),
        "stiffness\nMN/m": shown("mesh_stiffness_mean_N_per_m", ".1f", 1e-6),
        "pressure\nMPa": shown("max_pressure_MPa", ".0f"),
        "positions\nsolved": f"{solved}/{summary['positions']}",
    }
