"""Options of the command `report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from exugear.cli import options
from exugear.cli.console import exit_codes


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
    allow_dir: options.FilesBelowOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Write a report of a results folder as one web page.

    The page lists the resonances, their amplitudes and causes, and needs no other file. It compares all variants with
    runs and modes. Missing modes of these models are computed first, and a steady-state response over the operating
    range if there is none. gmsh scripts are not run; their meshes must exist.
    """
    with exit_codes():
        from exugear.cli.tasks import report as task

        task.report(folder, near, stored, levers, compare, allow_dir, as_json)
