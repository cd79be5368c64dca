"""Options of the command `run`."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from exugear.cli import options
from exugear.cli.again import resuming
from exugear.cli.console import exit_codes


class Solver(StrEnum):
    """Solver for time integration: the compiled loop, or Exudyn as the reference model."""

    compiled = "compiled"
    exudyn = "exudyn"


class Integrator(StrEnum):
    """Integration methods of the compiled solver: multistep with one evaluation per step, or Runge-Kutta with four."""

    adams = "adams"
    rk4 = "rk4"


class MeshRoute(StrEnum):
    """Form of the mesh forces in Exudyn: one element for all meshes, or a load with a user function on each gear."""

    element = "element"
    loads = "loads"


def run(
    context: typer.Context,
    case: options.CaseArgument,
    variant: options.VariantOption = None,
    mesh_model: options.LawOption = options.USUAL_LAW,
    inertias: options.InertiasOption = None,
    load_case: Annotated[
        str | None, typer.Option("--load-case", metavar="NAME", help="Load case. (default: first of the gearbox file)")
    ] = None,
    at_load_case: Annotated[
        bool,
        typer.Option(
            "--at-load-case",
            help="Compute tables, tooth contact and bearings at the torques of the load case; results in at-NAME.",
        ),
    ] = False,
    solver: Annotated[Solver, typer.Option(metavar="NAME", help="Solver: compiled or exudyn.")] = Solver.compiled,
    integrator: Annotated[
        Integrator | None,
        typer.Option(metavar="NAME", help="adams or rk4, compiled solver. (default: the cheaper one)"),
    ] = None,
    mesh_route: Annotated[
        MeshRoute,
        typer.Option(
            "--mesh-route",
            metavar="NAME",
            help="Mesh forces in Exudyn: element, or loads (slow; bushing only).",
        ),
    ] = MeshRoute.element,
    duration: Annotated[
        float | None,
        typer.Option(metavar="S", help="Simulated time, s. (default: load case, or resumed run)"),
    ] = None,
    band: Annotated[
        float | None,
        typer.Option(
            metavar="HZ",
            help="Highest stored frequency, Hz. (default: 6400, or resumed run)",
            show_default=False,
        ),
    ] = None,
    compared: Annotated[
        float | None,
        typer.Option(
            "--compare-exudyn",
            metavar="S",
            min=0.0,
            help="Also integrate the first S seconds with Exudyn and compare.",
        ),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Resume an interrupted run.")] = False,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Simulate a load case in the time domain.

    Results are written during the run; Ctrl-C keeps the results so far. Transmission error tables that are missing or
    out of date are computed first.
    """
    with exit_codes():
        from exugear.cli.case import open_project
        from exugear.cli.tasks import run as task

        project = open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias, load_case)
        if at_load_case:
            project = project.at_load_case(task.load_case_of(project).name)
        task.run(
            project,
            as_json,
            resuming(context),
            solver=solver.value,
            mesh_route=mesh_route.value,
            integrator=integrator,
            band=band,
            duration=duration,
            compared=compared,
            resume=resume,
        )
