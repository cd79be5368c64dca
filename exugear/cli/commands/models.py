"""Commands that compute: their options, and the tasks that they start, which are imported only then."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated, Literal

import typer

from exugear.cli import options
from exugear.cli.console import BadInputError
from exugear.gearbox.variant import Variant


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
        Literal["superelement", "nonlinear"] | None,
        typer.Option(
            metavar="NAME",
            help="superelement: condensed finite elements; nonlinear: reference analysis, about 30 s per position. "
            "(default: gearbox file)",
        ),
    ] = None,
    grid: Annotated[
        bool, typer.Option("--grid", help="Also vary load, centre distance and misalignment over the axes of the file.")
    ] = False,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Compute tables of the static transmission error. Also draws the curves and the teeth in contact.

    Tables are cached and recomputed when their input changes. Tables of the method nonlinear are for comparison; the
    dynamic models do not use them.
    """
    from exugear.cli.case import read_gearbox
    from exugear.cli.tasks import ste as task

    gearbox = read_gearbox(case, allow_dir)
    if (method or gearbox.ste.method) == "nonlinear":
        if grid:
            raise BadInputError("--grid: the method nonlinear computes the static load only; remove --grid")
        task.references(gearbox, out, mesh or [], positions, as_json, whole)
    else:
        task.ste(gearbox, out, mesh or [], positions, grid, as_json, whole)


def bearings(
    case: options.CaseArgument,
    variant: options.VariantOption = None,
    mesh_model: options.LawOption = options.USUAL_LAW,
    inertias: options.InertiasOption = None,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """List load, stiffness and life of the catalogue bearings.

    All values are for the static load. Also lists misalignment, load distribution and contact stress of each mesh.
    Transmission error tables that are missing or out of date are computed first.
    """
    from exugear.cli.tasks import bearings as task
    from exugear.cli.watched import open_project

    variant = variant or Variant.bushing
    if not variant.has_bearings:
        raise BadInputError(f"--variant {variant}: has ideal joints instead of bearings; use bushing or flexible")
    task.bearings(open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias), as_json, whole)


def modes(
    case: options.CaseArgument,
    variant: options.VariantOption = None,
    mesh_model: options.LawOption = options.USUAL_LAW,
    inertias: options.InertiasOption = None,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Compute natural frequencies, mode shapes and a Campbell diagram.

    The variant is linearised at the static load. Transmission error tables that are missing or out of date are computed
    first.
    """
    from exugear.cli.tasks import modes as task
    from exugear.cli.watched import open_project

    task.modes(open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias), as_json, whole)


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
            help="Linearise at the torques of a load case; results in at-NAME. (default: static load)",
            show_default=False,
        ),
    ] = None,
    method: Annotated[
        Literal["linear", "parametric", "nonlinear"],
        typer.Option(
            metavar="NAME",
            help="Method. linear: transmission error as excitation; parametric: time-varying stiffness, all meshes "
            "coupled; nonlinear: harmonic balance with contact loss (model table) and bearings of model iso16281.",
        ),
    ] = "parametric",
    speeds: Annotated[
        str | None,
        typer.Option(
            metavar="FIRST:LAST",
            help="Range of input speeds, rpm, positive about +z. (default: 0 to the highest speed in the file)",
            show_default=False,
        ),
    ] = None,
    points: Annotated[
        int | None,
        typer.Option(metavar="N", help="Number of speeds in the range. (default: 400)", show_default=False),
    ] = None,
    harmonics: Annotated[
        int | None,
        typer.Option(
            help="Harmonics of each mesh frequency. (default: as the mesh stiffness requires)", show_default=False
        ),
    ] = None,
    branches: Annotated[
        bool,
        typer.Option("--continuation", help="Continuation through turning points (nonlinear)."),
    ] = False,
    quantity: options.QuantityOption = None,
    without: options.WithoutOption = None,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Compute the steady-state response and rank the resonances.

    Needs no run-up. Speeds are added where mesh orders cross modes. Missing tables are computed first.
    """
    from exugear.cli.tasks import steady as task
    from exugear.cli.watched import open_project

    project = open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias, load_case, without or ())
    if load_case is not None:
        project = project.at_load_case(load_case)
    asked = task.speeds_of_options(project, speeds, points)
    settings = task.settings_of_options(project, method, asked, harmonics, branches)
    task.steady(project, settings, quantity, as_json, whole)


def measured(
    case: options.CaseArgument,
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME", help="Table of [measurements]; not needed if there is only one.", show_default=False
        ),
    ] = None,
    variant: options.VariantOption = None,
    mesh_model: options.LawOption = options.USUAL_LAW,
    inertias: options.InertiasOption = None,
    method: Annotated[
        Literal["linear", "parametric", "nonlinear"],
        typer.Option(metavar="NAME", help="Method of the response: linear, parametric, nonlinear."),
    ] = "parametric",
    fit: Annotated[
        str | None,
        typer.Option(
            metavar="KEYS",
            help="Fit one to three numbers of the file, such as housing.factor,damping.modal_percent.",
            show_default=False,
        ),
    ] = None,
    write: Annotated[
        Path | None,
        typer.Option(
            "--write",
            metavar="FILE",
            help="Write the gearbox file with the fitted numbers to a new file in the same folder; comments are kept.",
            show_default=False,
        ),
    ] = None,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Compare a measured run-up with the steady-state response.

    Cuts the mesh orders out of a recording of section [measurements], sweeps and averages the computed ones in the same
    way, and lists peaks with their differences, and orders that belong to no part of the gearbox.
    """
    from exugear.cli.tasks import measured as task
    from exugear.cli.watched import open_project

    project = open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias)
    task.measured(project, name, method, fit, write, as_json, whole)


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
    solver: Annotated[
        Literal["compiled", "exudyn"], typer.Option(metavar="NAME", help="Solver: compiled or exudyn.")
    ] = "compiled",
    integrator: Annotated[
        Literal["adams", "rk4"] | None,
        typer.Option(metavar="NAME", help="adams or rk4, compiled solver. (default: the cheaper one)"),
    ] = None,
    mesh_route: Annotated[
        Literal["element", "loads"],
        typer.Option(
            "--mesh-route", metavar="NAME", help="Mesh forces in Exudyn: element, or loads (slow; bushing only)."
        ),
    ] = "element",
    duration: Annotated[
        float | None, typer.Option(metavar="S", help="Simulated time, s. (default: load case, or resumed run)")
    ] = None,
    band: Annotated[
        float | None,
        typer.Option(
            metavar="HZ", help="Highest stored frequency, Hz. (default: 6400, or resumed run)", show_default=False
        ),
    ] = None,
    compared: Annotated[
        float | None,
        typer.Option(
            "--compare-exudyn", metavar="S", min=0.0, help="Also integrate the first S seconds with Exudyn and compare."
        ),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Resume an interrupted run.")] = False,
    without: options.WithoutOption = None,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Simulate a load case in the time domain.

    Results are written during the run; Ctrl-C keeps the results so far. Transmission error tables that are missing or
    out of date are computed first.
    """
    from exugear.cli.tasks import run as task
    from exugear.cli.watched import open_project

    project = open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias, load_case, without or ())
    if at_load_case:
        project = project.at_load_case(task.load_case_of(project).name)
    task.run(
        project,
        as_json,
        whole,
        _resuming(context),
        solver=solver,
        mesh_route=mesh_route,
        integrator=integrator,
        band=band,
        duration=duration,
        compared=compared,
        resume=resume,
    )


def _resuming(context: typer.Context) -> str:
    """Return the command that resumes interrupted work: the typed command with `--resume`.

    Omitted options remain omitted, so that their default behaviour applies again.
    """
    words = ["exugear", str(context.info_name)]
    for parameter in context.command.params:
        source = context.get_parameter_source(str(parameter.name))
        value = context.params.get(str(parameter.name))
        if source is None or source.name != "COMMANDLINE" or parameter.name == "resume":
            continue
        if parameter.param_type_name == "argument":
            words.append(str(value))
        elif value is True:
            words.append(parameter.opts[0])
        else:
            words += [parameter.opts[0], str(value)]
    return shlex.join([*words, "--resume"])


def study(
    file: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="The study file.", show_default=False)],
    executor: Annotated[
        Literal["processes", "dask"],
        typer.Option(metavar="NAME", help="processes (this machine) or dask (Dask cluster)."),
    ] = "processes",
    workers: Annotated[
        int | None, typer.Option(min=1, max=1024, help="Number of processes on this machine. (default: all cores)")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler, such as tcp://10.0.0.1:8786.")
    ] = None,
    shard: Annotated[
        str | None, typer.Option(metavar="i/n", help="Compute only every n-th point, starting at the i-th.")
    ] = None,
    merge: Annotated[
        bool, typer.Option("--merge", help="Merge finished points into the dataset; compute none.")
    ] = False,
    retry: Annotated[bool, typer.Option("--retry-failed", help="Recompute points that failed before.")] = False,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Run a study: vary a gearbox and collect the results.

    Computes tables, modes, steady-state responses, lives or runs at each point and writes one dataset.

    Finished points are stored; run the same command again to resume. Failed points are reported; the study continues.
    """
    from exugear.cli.tasks import study as task

    opens = task.executor_of_options(executor, workers, scheduler)
    part = task.shard_of_options(shard, merge)
    task.study(task.read_study(file, allow_dir, scripts), out, opens, part, merge, retry, as_json, whole)


def loads(
    case: options.CaseArgument,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Count the loads on each mesh and bearing.

    Reads the load files of section [loads]; needs no transmission error tables. Writes load duration distributions
    (LDD) as CSV, and a picture of them.
    """
    from exugear.cli.case import read_gearbox
    from exugear.cli.tasks import loads as task

    task.loads(read_gearbox(case, allow_dir, scripts), out, as_json, whole)


def losses(
    case: options.CaseArgument,
    speed: Annotated[
        float | None,
        typer.Option(metavar="RPM", help="Input speed. (default: rated, or of a load case)", show_default=False),
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
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Compute losses of meshes, bearings and seals.

    Also computes the efficiency and the oil temperature. Uses the line loads of transmission error tables in the
    results folder. Churning and windage are not included. Writes no files.
    """
    from exugear.cli.tasks import losses as task
    from exugear.cli.watched import open_project

    project = open_project(case, out, allow_dir, scripts=False, variant=Variant.rigid)
    if load_case is not None:
        project = project.at_load_case(load_case)
    task.losses(project, speed, efficiency_map, as_json, whole)


def life(
    case: options.CaseArgument,
    variant: options.VariantOption = None,
    mesh_model: options.LawOption = options.USUAL_LAW,
    inertias: options.InertiasOption = None,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Rate gears and bearings for their loads and service life.

    Lists damage, safety factors, rating lives and the limiting parts for the loads of section [loads]. Transmission
    error tables that are missing or out of date are computed first.
    """
    from exugear.cli.tasks import life as task
    from exugear.cli.watched import open_project

    task.life(open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias), as_json, whole)


def view(
    case: options.CaseArgument,
    variant: options.VariantOption = None,
    mesh_model: options.LawOption = options.USUAL_LAW,
    inertias: options.InertiasOption = None,
    near: Annotated[
        float | None,
        typer.Option(min=0.0, metavar="HZ", help="Show the mode nearest to this frequency first."),
    ] = None,
    resonance: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Show the vibration in operation at this resonance of the ranking of exugear steady first. (default: "
            "1; without a steady-state response a mode)",
            show_default=False,
        ),
    ] = None,
    quantity: options.QuantityOption = None,
    animation: Annotated[
        bool, typer.Option("--gif", help="Also write an animated GIF of the mode or resonance shown first.")
    ] = False,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Write a web page of mode shapes and vibration in operation.

    It is self-contained and three-dimensional. Operating deflection shapes at resonances need a stored steady-state
    response, see exugear steady.
    """
    from exugear.cli.tasks import view as task
    from exugear.cli.watched import open_project

    if near is not None and resonance is not None:
        raise BadInputError(f"--near {near:g} and --resonance {resonance}: only one can be shown first; omit one")
    project = open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias)
    task.view(project, near, resonance, quantity, animation, as_json, whole)


def report(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Results folder, or its gearbox file.", show_default=False)
    ],
    near: Annotated[
        float | None,
        typer.Option(min=1.0, metavar="HZ", help="Target frequency to compare with modes. (default: gearbox file)"),
    ] = None,
    stored: Annotated[
        bool, typer.Option("--stored", help="Use stored results only: do not compute missing modes and responses.")
    ] = False,
    levers: Annotated[
        bool,
        typer.Option(
            "--levers", help="First compute what design changes do to the highest resonance, which takes minutes."
        ),
    ] = False,
    resonance: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="With --levers: rank of the resonance to reduce. (default: 1)",
            show_default=False,
        ),
    ] = None,
    load: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME|PERCENT%",
            help="With --levers: load case, or percentage of the static load, such as 50%; may be repeated. (default: "
            "static load)",
            show_default=False,
        ),
    ] = None,
    quantity: options.QuantityOption = None,
    compare: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Results folder of another design to compare with.", show_default=False),
    ] = None,
    allow_dir: options.FilesBelowOption = None,
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Write a report of a results folder as one web page.

    The page lists the resonances, their amplitudes and causes, and needs no other file. It compares all variants with
    runs and modes. Missing modes of these models are computed first, and a steady-state response over the operating
    range if there is none for this input. gmsh scripts are not run; their meshes must exist.
    """
    from exugear.cli.tasks import report as task

    changes = task.DesignOptions(levers, resonance, tuple(load or ()), quantity)
    task.report(folder, near, stored, changes, compare, allow_dir, as_json, whole)
