"""Tables of transmission error, computed behind a progress bar."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from exugear.cli.case import time_noted
from exugear.cli.console import note, progress_bar
from exugear.cli.errors import BadInputError, FailedError, interruption, model_errors
from exugear.cli.options import MeshLaw

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from exugear.model.gearbox import Gearbox
    from exugear.tooth_mesh.tables import TableOrder
    from fe_ste.transmission_error.table import MeshTable


def fill_missing_tables(gearbox: Gearbox, folder: Path, law: MeshLaw) -> None:
    """Compute the tables that a law needs and that are not there or belong to another input."""
    from exugear.results.folder import keep_case
    from exugear.tooth_mesh.tables import missing_tables

    orders = []
    if law not in (MeshLaw.rigid, MeshLaw.iso6336):
        with model_errors():
            orders = missing_tables(gearbox, folder, grid=law is MeshLaw.table)
    keep_case(gearbox, folder)
    for order in orders:
        note(order.replaces or f"{order.name}: no table in {folder}; it is computed first")
    with time_noted(folder, "tables, computed before dynamics") if orders else nullcontext():
        tables = fill_tables(orders)
    failures = [f"{name}: {line}" for name, table in tables.items() for line in table.failures]
    if failures:
        raise FailedError("\n".join(["positions of the tables that are not solved:", *failures]))


def fill_tables(orders: list[TableOrder]) -> dict[str, MeshTable]:
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
    from fe_ste.transmission_error.grid import GridError

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
    except (FactorisationError, GridError) as error:
        raise FailedError(f"{order.name}: {error}") from error


def _work(order: TableOrder) -> int:
    """Work of a table, in states: the time left counts the finite elements of both gears as well."""
    finite_elements = 500
    return finite_elements + _states(order)


def _states(order: TableOrder) -> int:
    wanted = order.wanted
    return wanted.positions * len(wanted.torque) * max(len(wanted.centre_distance), 1) * len(wanted.misalignment)
