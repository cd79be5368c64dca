"""Options of the command `losses`."""

from __future__ import annotations

from typing import Annotated

import typer

from exugear.cli import options
from exugear.cli.console import exit_codes
from exugear.gearbox.variant import Variant


def losses(
    case: options.CaseArgument,
    speed: Annotated[
        float | None,
        typer.Option(
            metavar="RPM",
            help="Input speed. (default: rated, or of a load case)",
            show_default=False,
        ),
    ] = None,
    load_case: Annotated[
        str | None,
        typer.Option(
            "--load-case",
            metavar="NAME",
            help="Losses at the torques of a load case. (default: static load)",
            show_default=False,
        ),
    ] = None,
    efficiency_map: Annotated[
        bool, typer.Option("--map", help="Also compute the efficiency over speed and torque.")
    ] = False,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Compute losses of meshes, bearings and seals.

    Also computes the efficiency and the oil temperature. Uses the line loads of transmission error tables in the
    results folder. Churning and windage are not included. Writes no files.
    """
    with exit_codes():
        from exugear.cli.case import open_project
        from exugear.cli.tasks import losses as task

        project = open_project(case, out, allow_dir, scripts=False, variant=Variant.rigid)
        if load_case is not None:
            project = project.at_load_case(load_case)
        task.losses(project, speed, efficiency_map, as_json)
