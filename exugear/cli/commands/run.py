"""The command `run`: a load case in the time domain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exugear.cli.again import resuming
from exugear.cli.case import (
    USUAL_LAW,
    CaseArgument,
    FilesBelowOption,
    InertiasOption,
    JsonOption,
    LawOption,
    OutOption,
    ScriptsOption,
    VariantOption,
    check_friction,
    open_project,
)
from exugear.cli.console import BadInputError, FailedError, StoppedError, exit_codes, note, print_json, say
from exugear.gearbox.variant import Variant

if TYPE_CHECKING:
    from exugear.gearbox.gearbox import Gearbox
    from exugear.gearbox.parts import LoadCase
    from exugear.project import Project
    from exugear.results.solver_comparison import SolverComparison
    from exugear.transient.outcome import Run


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
    case: CaseArgument,
    variant: VariantOption = None,
    mesh_model: LawOption = USUAL_LAW,
    inertias: InertiasOption = None,
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
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Simulate a load case in the time domain.

    Results are written during the run; Ctrl-C keeps the results so far. Transmission error tables that are missing or
    out of date are computed first.
    """
    with exit_codes():
        from exugear.gearbox.reading import GearboxFileError
        from exugear.results.folder import time_noted

        project = open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias, load_case)
        if at_load_case:
            project = project.at_load_case(_load_case(project).name)
        if resume:
            duration = _duration_to_resume(project, duration)
        kept = _kept_band(project, band, resume)
        _check_extent(project, duration, kept["sample_rate"], out or Path("results"))
        _check_solver(project.gearbox, project.choice.variant, solver)
        _check_mesh_route(mesh_route, project.choice.variant, solver)
        if compared is not None and solver is Solver.exudyn:
            raise BadInputError("--compare-exudyn: requires the compiled solver; remove --solver exudyn")
        if compared is not None:
            try:
                _check_extent(project, compared, kept["sample_rate"], out or Path("results"))
            except GearboxFileError as error:
                raise BadInputError(f"--compare-exudyn: {error}") from error
            _check_solver(project.gearbox, project.choice.variant, Solver.compiled)
        if integrator and solver is Solver.exudyn:
            raise BadInputError(f"--integrator {integrator}: applies to the compiled solver only; remove --integrator")
        check_friction(project.gearbox, mesh_model)
        if not resume:
            project.begin()
        _check_run_directory(project.run_directory, resume)
        _warn_before_run(project, duration, kept["band"])
        project.prepare()
        with time_noted(project.folder, _label_of(project, solver, mesh_route)):
            how = {"solver": solver.value, "mesh_route": mesh_route.value, "integrator": integrator, **kept}
            finished = _simulate(project, resume, resuming(context), duration=duration, **how)
        comparison = None
        if compared is not None and finished.complete:
            with time_noted(project.folder, f"comparison with Exudyn, {project.choice.variant}"):
                comparison = _compare(project, compared, kept)
        _print_run_result(case, finished, comparison, resuming(context), as_json)


def _compare(project: Project, duration: float, kept: Mapping[str, float]) -> SolverComparison:
    """Integrate the beginning of the run with Exudyn."""
    from exugear.transient.outcome import LimitError, RunError
    from fe_ste.tools.files import FileError

    try:
        return project.compare_with_exudyn(duration, **kept)
    except (RunError, LimitError, FileError) as error:
        raise FailedError(f"comparison with Exudyn: {error}") from error


def _load_case(project: Project) -> LoadCase:
    """Load case of the run; it exists unless the file has no load cases."""
    if project.choice.load_case is None:
        raise BadInputError(project.gearbox.error("no load case; add a section [load_cases.NAME]"))
    return project.gearbox.load_cases[project.choice.load_case]


def _label_of(project: Project, solver: Solver, route: MeshRoute) -> str:
    """Name of a run in the list of run times."""
    choice = project.choice
    label = f"run, {choice.variant}, {choice.load_case}, {choice.inertias}, {choice.mesh_model}, solver {solver}"
    if route is MeshRoute.loads:
        return f"{label}, meshes as loads"
    return label


def _kept_band(project: Project, band: float | None, resume: bool) -> dict[str, float]:
    """Return the requested band, or that of the stopped run, and the required sample rate, Hz."""
    from exugear.transient.plan import rate_for
    from exugear.transient.runup import BAND
    from exugear.transient.start import kept_band

    if band is None and resume:
        band = kept_band(project.run_directory)
    if band is None:
        band = BAND
    return {"band": band, "sample_rate": rate_for(band)}


def _check_extent(project: Project, duration: float | None, sample_rate: float, folder: Path) -> None:
    """Raise an error if the simulated time is too short or its results exceed the free disk space."""
    from exugear.system.tooth_mesh.laws.registry import LAWS
    from exugear.transient.plan import check_disk, check_duration, sample_bytes

    gearbox = project.gearbox
    load_case = _load_case(project)
    jointed = project.choice.variant.spins_only
    tabled = LAWS[project.choice.mesh_model].signals_positions
    supports = gearbox.joints if jointed else gearbox.bearings
    size = sample_bytes(len(gearbox.meshes), len(supports), tabled, jointed)
    check_duration(gearbox, load_case, duration, sample_rate)
    check_disk(gearbox, load_case, folder, duration, sample_rate, sample_bytes=size)


def _check_solver(gearbox: Gearbox, variant: Variant, solver: Solver) -> None:
    """Raise an error if the solver does not support the model, before anything is computed."""
    floating = [name for name, body in gearbox.case.bodies.items() if body.flexibility == "ffrf"]
    if variant.is_elastic and solver is Solver.compiled and floating:
        raise BadInputError(
            f"--solver compiled: bodies.{floating[0]}.flexibility = 'ffrf' requires Exudyn; "
            "add --solver exudyn, or set flexibility = 'nonrotating'"
        )


def _check_mesh_route(route: MeshRoute, variant: Variant, solver: Solver) -> None:
    """Raise an error if the solver or variant does not support mesh forces as loads, before anything is computed."""
    if route is MeshRoute.element:
        return
    if variant.spins_only or variant.is_elastic:
        why = "has rotations only" if variant.spins_only else "has flexible bodies"
        raise BadInputError(
            f"--mesh-route loads: requires rigid bodies with six degrees of freedom; the variant {variant} {why}; "
            "use --variant bushing, or --mesh-route element"
        )
    if solver is not Solver.exudyn:
        raise BadInputError(
            f"--mesh-route loads: user-function loads exist in Exudyn only, not in the solver {solver}; "
            "add --solver exudyn"
        )


def _check_run_directory(directory: Path, resume: bool) -> None:
    """Raise an error if another process works on the run, or if a run to be resumed cannot be resumed."""
    from exugear.transient.start import refuse_if_busy, refuse_to_resume

    refuse_if_busy(directory)
    if resume and (reason := refuse_to_resume(directory)):
        raise BadInputError(f"--resume: {reason}; remove --resume")


def _duration_to_resume(project: Project, duration: float | None) -> float | None:
    """Return the total duration of a resumed run: as specified, else as before; raise an error if it is too short."""
    from exugear.transient.start import kept_duration, refuse_shorter

    directory = project.run_directory
    if duration is None:
        return kept_duration(directory)
    if reason := refuse_shorter(directory, duration):
        raise BadInputError(f"--duration {duration:g}: {reason}; set a longer duration, or remove --duration")
    return duration


def _warn_before_run(project: Project, duration: float | None, band: float) -> None:
    """Print warnings about probable sign errors of torques, and loads outside the range of bearing or mesh models."""
    from exugear.gearbox.load_cases import (
        band_warning,
        bearing_range_warning,
        friction_warning,
        load_warnings,
        other_load_warning,
        summarise_loads,
    )
    from exugear.system.tooth_mesh.laws.registry import LAWS

    load_case = _load_case(project)
    law = LAWS[project.choice.mesh_model]
    loads = summarise_loads(project.gearbox, load_case, project.choice.inertias, duration)
    of_bearings = bearing_range_warning(project.gearbox, loads, project.choice.variant)
    of_tables = other_load_warning(project.gearbox, loads, law.uses_single_load)
    of_friction = friction_warning(project.gearbox, loads)
    for doubt in filter(None, (*load_warnings(loads), of_bearings, of_tables, band_warning(loads, band), of_friction)):
        note(f"Warning: load_cases.{load_case.name}: {doubt}", style="yellow")


def _simulate(project: Project, resume: bool, command: str, **options: Any) -> Run:
    """Run the load case with the options of `exugear.transient.runup.simulate`; `command` resumes it."""
    from exugear.results.run_file import PARTIAL_NAME, has_pieces
    from exugear.transient.outcome import LimitError, RunError

    directory = project.run_directory
    if not resume and has_pieces(directory / PARTIAL_NAME):
        note(f"{directory}: interrupted run is restarted from the beginning; use --resume to continue one")
    try:
        return project.run(resume=resume, **options)
    except LimitError as error:
        return error.run
    except RunError as error:
        raise FailedError(error) from error
    except KeyboardInterrupt:
        if not has_pieces(directory / PARTIAL_NAME):
            raise
        raise StoppedError(f"results so far are kept in {directory}; resume with:\n{command}") from None


def _print_run_result(
    case: Path, finished: Run, comparison: SolverComparison | None, command: str, as_json: bool
) -> None:
    """Print the results of a run; end with code 130 if the user stopped it, with 1 if it is invalid."""
    if not finished.complete and not finished.halted:
        so_far = "".join(f"\nInvalid so far: {reason}" for reason in finished.reasons)
        raise StoppedError(
            f"at {finished.end:.3f} s; results so far are kept in {finished.path}; resume with:\n{command}{so_far}"
        )
    import numpy as np

    from exugear.gearbox.units import RPM
    from exugear.results.run_file import read_run
    from exugear.system.signals import BALANCE_TERMS, MESH_TIMES, energy_residual
    from exugear.transient.plan import EXPECTATIONS

    data, attributes = read_run(finished.path, ("input_speed", *MESH_TIMES, *BALANCE_TERMS))
    longest = {name: float(np.max(data[name], initial=0.0)) for name in MESH_TIMES}  # a rotor has no meshes
    outside = longest["extrapolation_time"]
    summary = {
        "case": str(case),
        **{key: str(attributes[key]) for key in ("variant", "load_case", "mesh_model", "inertias", "solver")},
        "file": str(finished.path),
        "simulated_s": finished.end,
        "wall_s": round(finished.wall, 2),
        "step_s": float(attributes["step"]),
        "band_Hz": float(attributes["band"]),
        **{key: float(attributes[key]) for key in EXPECTATIONS if key in attributes},
        "input_speed_rpm": float(data["input_speed"][-1]) / RPM,
        "energy_not_accounted_for": energy_residual(data),
        "tooth_friction_work_J": float(data["tooth_friction_work"][-1]),
        "load": str(attributes.get("load", "")),
        **{doubt: str(attributes.get(doubt, "")) for doubt in ("table_doubt", "band_doubt", "bearing_doubt")},
        "longest_tensile_time_s": longest["tensile_time"],
        "longest_contact_loss_s": longest["contact_loss_time"],
        "longest_time_outside_table_s": outside,
        "longest_interpolation_time_s": longest["interpolation_time"],
        "complete": finished.complete,
        "valid": finished.trusted,
        "reasons": list(finished.reasons),
    }
    if comparison is not None:
        summary["apart_from_exudyn"] = comparison.difference
    if as_json:
        unknown = {key for key, value in summary.items() if isinstance(value, float) and not math.isfinite(value)}
        print_json({key: None if key in unknown else value for key, value in summary.items()})
    else:
        _print_run(summary, outside)
        if comparison is not None:
            say(comparison.words)
    if not finished.trusted:
        what = "the run is invalid:" if finished.complete else f"the run is invalid, aborted at {finished.end:.4g} s:"
        raise FailedError("\n".join([what, *finished.reasons, f"Results: {finished.path}"]))


def _print_run(summary: dict[str, Any], outside: float) -> None:
    say(
        f"Variant {summary['variant']}, load case {summary['load_case']} ({summary['load']}), mesh model "
        f"{summary['mesh_model']}, inertia set {summary['inertias']}: {summary['simulated_s']:g} s simulated in "
        f"{summary['wall_s']:.1f} s wall time (solver {summary['solver']}); final input speed "
        f"{summary['input_speed_rpm']:.1f} rpm"
    )
    if "stability_margin" in summary:
        say(
            f"Time step {1e6 * summary['step_s']:.4g} µs, stability margin {summary['stability_margin']:.1f}; "
            f"estimated integration error up to {summary['band_Hz'] / 1e3:g} kHz: "
            f"{100.0 * abs(summary['expected_error_at_band']):.2g} % of amplitudes, "
            f"{100.0 * summary['expected_error_of_resonances']:.2g} % of resonance peaks"
        )
    if summary["tooth_friction_work_J"]:
        say(f"Friction of the teeth included: it dissipates {1e-3 * summary['tooth_friction_work_J']:.4g} kJ")
    if outside > 0.0:
        say(
            f"Warning: a mesh was outside the range of its table for {outside:.3g} s (extrapolated linearly; variable "
            "extrapolation_time of the results). Widen the axes of [ste]."
        )
    say(f"Results: {summary['file']}")
