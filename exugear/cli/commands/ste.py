"""Options of the command `ste`."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from exugear.cli import options
from exugear.cli.console import BadInputError, exit_codes


class Method(StrEnum):
    """Method for tooth deflections: condensed finite elements, or the full nonlinear analysis used as reference."""

    superelement = "superelement"
    nonlinear = "nonlinear"


def ste(
    case: options.CaseArgument,
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
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Compute tables of the static transmission error. Also draws the curves and the teeth in contact.

    Tables are cached and recomputed when their input changes. Tables of the method nonlinear are for comparison; the
    dynamic models do not use them.
    """
    with exit_codes():
        from exugear.cli.case import read_gearbox
        from exugear.cli.tasks import ste as task

        gearbox = read_gearbox(case, allow_dir)
        if (method or gearbox.ste.method) == Method.nonlinear:
            if grid:
                raise BadInputError("--grid: the method nonlinear computes the static load only; remove --grid")
            task.references(gearbox, out, mesh or [], positions, as_json)
        else:
            task.ste(gearbox, out, mesh or [], positions, grid, as_json)
