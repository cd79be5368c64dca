"""Tables of transmission error, computed behind a progress bar."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from typing import TYPE_CHECKING

from exugear.cli.console import note, progress_bar
from exugear.cli.errors import BadInputError, FailedError, interruption, model_errors

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from exugear.project import Project
    from exugear.tooth_mesh.tables import TableRequest
    from fe_ste.transmission_error.table import MeshTable


def compute_missing_tables(project: Project) -> None:
    """Compute the tables that the mesh law needs and that are not there or belong to another input."""
    from exugear.results.folder import time_noted

    with model_errors():
        requests = project.missing_tables()
    project.keep_case()
    for request in requests:
        note(request.replaces or f"{request.name}: no table in {project.folder}; it is computed first")
    with time_noted(project.folder, "tables, computed before dynamics") if requests else nullcontext():
        compute_tables(requests)
    # What a law cannot do with it refuses itself.
    for doubt in tell_of_tables(project.tables_at_work()):
        note(doubt, style="yellow")


def tell_of_tables(tables: Mapping[str, MeshTable]) -> list[str]:
    """Say what is missing or cut off in tables; return why they are not to be trusted, nothing if they are."""
    from exugear.tooth_mesh.table_remarks import doubts_about_table, remarks_about_table

    for name, table in tables.items():
        for remark in remarks_about_table(name, table):
            note(remark, style="yellow")
    return [doubt for name, table in tables.items() for doubt in doubts_about_table(name, table)]


def refuse_unsolved(meshes: Sequence[str]) -> None:
    """End with code 1 where meshes read their tables beside states that are not solved.

    Raises
    ------
    FailedError
    """
    if meshes:
        raise FailedError(
            f"not to be trusted: at the static load {', '.join(meshes)} come beside states of their tables that are "
            "not solved, where others stand in; exugear ste says which states these are and why"
        )


def compute_tables(requests: list[TableRequest]) -> dict[str, MeshTable]:
    """Return the table of each request, computing those that are not stored."""
    tables = {request.name: request.stored for request in requests if request.stored}
    missing = [request for request in requests if not request.stored]
    if missing:
        with progress_bar() as bar:
            task = bar.add_task("", total=sum(_work(request) for request in missing))
            for request in missing:
                tables[request.name] = _compute_table(request, bar, task)
    return {request.name: tables[request.name] for request in requests}


def _compute_table(request: TableRequest, bar: Progress, task: TaskID) -> MeshTable:
    from fe_ste.elimination.sparse import FactorisationError
    from fe_ste.geometry.checks import GeometryError
    from fe_ste.transmission_error.grid import GridError

    before = bar.tasks[task].completed
    bar.update(task, description=f"{request.name}: finite elements")

    what = "position" if _states(request) == request.wanted.positions else "state"

    def at_state(done: int, of: int) -> None:
        interruption.check()
        completed = before + _work(request) - of + done
        bar.update(task, completed=completed, description=f"{request.name}: {what} {done} of {of}")

    try:
        return request.compute(at_state)
    except GeometryError as error:
        raise BadInputError(f"pairs.{request.name}: {error}") from error
    except (FactorisationError, GridError) as error:
        raise FailedError(f"{request.name}: {error}") from error


def _work(request: TableRequest) -> int:
    """Work of a table, in states: the time left counts the finite elements of both gears as well."""
    finite_elements = 500
    return finite_elements + _states(request)


def _states(request: TableRequest) -> int:
    wanted = request.wanted
    return wanted.positions * len(wanted.torque) * max(len(wanted.centre_distance), 1) * len(wanted.misalignment)
