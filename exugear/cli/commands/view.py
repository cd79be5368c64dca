"""Options of the command `view`."""

from __future__ import annotations

from typing import Annotated

import typer

from exugear.cli import options
from exugear.cli.console import BadInputError, exit_codes


def view(
    case: options.CaseArgument,
    variant: options.VariantOption = None,
    mesh_model: options.LawOption = options.USUAL_LAW,
    inertias: options.InertiasOption = None,
    near: Annotated[
        float | None,
        typer.Option(
            min=0.0, metavar="HZ", help="Show the mode nearest to this frequency first. (default: gearbox file)"
        ),
    ] = None,
    resonance: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Show the vibration in operation at this resonance of the ranking of exugear steady first.",
            show_default=False,
        ),
    ] = None,
    animation: Annotated[
        bool, typer.Option("--gif", help="Also write an animated GIF of the mode or resonance shown first.")
    ] = False,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Write a web page of mode shapes and vibration in operation.

    It is self-contained and three-dimensional. Operating deflection shapes at resonances need a stored steady-state
    response, see exugear steady.
    """
    with exit_codes():
        from exugear.cli.case import open_project
        from exugear.cli.tasks import view as task

        if near is not None and resonance is not None:
            raise BadInputError(f"--near {near:g} and --resonance {resonance}: only one can be shown first; omit one")
        project = open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias)
        task.view(project, near, resonance, animation, as_json)
