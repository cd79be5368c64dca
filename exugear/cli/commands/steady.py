"""Options of the command `steady`."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from exugear.cli import options
from exugear.cli.console import exit_codes


class Method(StrEnum):
    """Methods: transmission error as excitation, time-varying stiffness, or nonlinear models evaluated in time."""

    linear = "linear"
    parametric = "parametric"
    nonlinear = "nonlinear"


def steady(
    case: options.CaseArgument,
    variant: options.VariantOption = None,
    mesh_model: options.LawOption = options.USUAL_LAW,
    inertias: options.InertiasOption = None,
    load_case: Annotated[
        str | None,
        typer.Option(
            "--load-case",
            metavar="NAME",
            help="Linearise at the torques of a load case; results in at-NAME of the results folder. (default: static "
            "load)",
            show_default=False,
        ),
    ] = None,
    method: Annotated[
        Method,
        typer.Option(
            metavar="NAME",
            help="Method. linear: transmission error as excitation; parametric: time-varying stiffness, all meshes "
            "coupled; nonlinear: harmonic balance with contact loss (model table) and bearings of model iso16281.",
        ),
    ] = Method.parametric,
    speeds: Annotated[
        str | None,
        typer.Option(
            metavar="FIRST:LAST:COUNT",
            help="Input speeds, rpm, positive about +z. (default: range of the first load case)",
            show_default=False,
        ),
    ] = None,
    harmonics: Annotated[
        int | None,
        typer.Option(
            help="Harmonics of each mesh frequency. (default: as the mesh stiffness requires)",
            show_default=False,
        ),
    ] = None,
    branches: Annotated[
        bool,
        typer.Option(
            "--continuation",
            help="Continuation: follow the solution through turning points (method nonlinear).",
        ),
    ] = False,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Compute the steady-state response and rank the resonances.

    Needs no run-up. Speeds are added where mesh orders cross modes. Transmission error tables that are missing or out
    of date are computed first.
    """
    with exit_codes():
        from exugear.cli.case import open_project
        from exugear.cli.tasks import steady as task

        project = open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias, load_case)
        if load_case is not None:
            project = project.at_load_case(load_case)
        task.steady(project, task.settings_of_options(project, method.value, speeds, harmonics, branches), as_json)
