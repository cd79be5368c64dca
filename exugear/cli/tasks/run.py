"""The command `run`: a load case in the time domain."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np

from exugear.cli.case import check_friction
from exugear.cli.console import BadInputError, FailedError, StoppedError, note, warn
from exugear.cli.tables import Outcome, significant
from exugear.cli.watched import WatchedProject
from exugear.gearbox.load_cases import load_case_warnings
from exugear.gearbox.parts import LoadCase
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.units import RPM
from exugear.project import Project
from exugear.results.findings import DOUBTS, run_findings
from exugear.results.folder import time_noted
from exugear.results.run_file import PARTIAL_NAME, has_pieces, read_run
from exugear.results.solver_comparison import SolverComparison
from exugear.system.signals import BALANCE_TERMS, MESH_TIMES, energy_residual, turning_bodies
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.transient.outcome import LimitError, Run, RunError
from exugear.transient.plan import EXPECTATIONS, check_disk, check_duration, rate_for, sample_bytes
from exugear.transient.runup import BAND
from exugear.transient.start import kept_setting, refuse_if_busy, refuse_shorter, refuse_to_resume
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import FileError


def run(
    project: WatchedProject,
    as_json: bool,
    whole: bool,
    command: str,
    *,
    solver: str,
    mesh_route: str,
    integrator: str | None,
    band: float | None,
    duration: float | None,
    compared: float | None,
    resume: bool,
) -> None:
    """Compute, store and print the run of a project; `command` resumes it."""
    if resume:
        if duration is None:
            duration = kept_setting(project.run_directory, "duration")
        elif reason := refuse_shorter(project.run_directory, duration):
            raise BadInputError(f"--duration {duration:g}: {reason}; set a longer duration, or remove --duration")
        if band is None:
            band = kept_setting(project.run_directory, "band")
    if band is None:
        band = BAND
    kept = {"band": band, "sample_rate": rate_for(band)}
    _check_extent(project, duration, kept["sample_rate"])
    _check_solver(project, solver, mesh_route)
    if compared is not None:
        if solver == "exudyn":
            raise BadInputError("--compare-exudyn: requires the compiled solver; remove --solver exudyn")
        try:
            _check_extent(project, compared, kept["sample_rate"])
        except GearboxFileError as error:
            raise BadInputError(f"--compare-exudyn: {error}") from error
    if integrator and solver == "exudyn":
        raise BadInputError(f"--integrator {integrator}: applies to the compiled solver only; remove --integrator")
    check_friction(project.gearbox, project.choice.mesh_model)
    if not resume:
        project.begin()
    refuse_if_busy(project.run_directory)
    if resume and (reason := refuse_to_resume(project.run_directory)):
        raise BadInputError(f"--resume: {reason}; remove --resume")
    said = _warn_before_run(project, duration, kept["band"])
    project.prepare()
    choice = project.choice
    label = f"run, {choice.variant}, {choice.load_case}, {choice.inertias}, {choice.mesh_model}, solver {solver}"
    if mesh_route == "loads":
        label += ", meshes as loads"
    with time_noted(project.folder, label):
        how = {"solver": solver, "mesh_route": mesh_route, "integrator": integrator, "duration": duration, **kept}
        finished = _simulate(project, resume, command, **how)
    comparison = None
    if compared is not None and finished.complete:
        with time_noted(project.folder, f"comparison with Exudyn, {choice.variant}"):
            try:
                comparison = project.compare_with_exudyn(compared, **kept)
            except (RunError, LimitError, FileError) as error:
                raise FailedError(f"comparison with Exudyn: {error}") from error
    _outcome(project.gearbox.source, finished, comparison, command, said).show(as_json, whole)


def load_case_of(project: Project) -> LoadCase:
    """Load case of the run; it exists unless the file has no load cases."""
    if project.choice.load_case is None:
        raise BadInputError(project.gearbox.error("no load case; add a section [load_cases.NAME]"))
    return project.gearbox.load_cases[project.choice.load_case]


def _check_extent(project: Project, duration: float | None, sample_rate: float) -> None:
    """Raise an error if the simulated time is too short or its results exceed the free disk space."""
    gearbox = project.gearbox
    load_case = load_case_of(project)
    jointed = project.choice.variant.spins_only
    tabled = LAWS[project.choice.mesh_model].signals_positions
    supports = gearbox.joints if jointed else gearbox.bearings
    bodies = turning_bodies(gearbox, [body.name for body in gearbox.bodies() if not body.fixed])
    counts = len(gearbox.meshes), len(supports)
    size = sample_bytes(*counts, tabled, jointed, len(gearbox.couplings), len(bodies))
    check_duration(gearbox, load_case, duration, sample_rate)
    check_disk(gearbox, load_case, project.folder, duration, sample_rate, sample_bytes=size)


def _check_solver(project: Project, solver: str, mesh_route: str) -> None:
    """Raise an error if the solver or the variant does not support the model, before anything is computed."""
    variant = project.choice.variant
    floating = [name for name, body in project.gearbox.case.bodies.items() if body.flexibility == "ffrf"]
    if variant.is_elastic and solver == "compiled" and floating:
        raise BadInputError(
            f"--solver compiled: bodies.{floating[0]}.flexibility = 'ffrf' requires Exudyn; "
            "add --solver exudyn, or set flexibility = 'nonrotating'"
        )
    if mesh_route == "element":
        return
    if variant.spins_only or variant.is_elastic:
        why = "has rotations only" if variant.spins_only else "has flexible bodies"
        raise BadInputError(
            f"--mesh-route loads: requires rigid bodies with six degrees of freedom; the variant {variant} {why}; "
            "use --variant bushing, or --mesh-route element"
        )
    if solver != "exudyn":
        raise BadInputError(
            f"--mesh-route loads: user-function loads exist in Exudyn only, not in the solver {solver}; "
            "add --solver exudyn"
        )


def _warn_before_run(project: Project, duration: float | None, band: float) -> tuple[str, ...]:
    """Print and return the warnings about the load case, before the run."""
    choice = project.choice
    load_case = load_case_of(project)
    said = load_case_warnings(
        project.gearbox,
        load_case,
        band,
        choice.variant,
        choice.inertias,
        duration,
        uses_single_load=LAWS[choice.mesh_model].uses_single_load,
    )
    for text in said:
        warn(f"load_cases.{load_case.name}: {text}")
    return said


def _simulate(project: Project, resume: bool, command: str, **options: Any) -> Run:
    """Run the load case with the options of `exugear.transient.runup.simulate`; `command` resumes it."""
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


def _outcome(
    case: str, finished: Run, comparison: SolverComparison | None, command: str, said: Collection[str]
) -> Outcome:
    """Return what is printed of a run, but for warnings that were said before; end with code 130 if it was stopped."""
    if not finished.complete and not finished.halted:
        so_far = "".join(f"\nInvalid so far: {reason}" for reason in finished.reasons)
        raise StoppedError(
            f"at {finished.end:.3f} s; results so far are kept in {finished.path}; resume with:\n{command}{so_far}"
        )
    data, attributes = read_run(finished.path, ("input_speed", *MESH_TIMES, *BALANCE_TERMS))
    times = {name: float(np.max(data[name], initial=0.0)) for name in MESH_TIMES}  # a rotor has no meshes
    summary = {"case": case, **_summary(finished, data, attributes, times)}
    if comparison is not None:
        summary["apart_from_exudyn"] = comparison.difference
    unknown = {key for key, value in summary.items() if isinstance(value, float) and not math.isfinite(value)}
    found = run_findings(attributes, summary["energy_not_accounted_for"], times)
    failure = ""
    if not finished.trusted:
        what = "the run is invalid:" if finished.complete else f"the run is invalid, aborted at {finished.end:.4g} s:"
        failure = "\n".join([what, *finished.reasons])
    return Outcome(
        verdict=f"{summary['simulated_s']:.4g} s simulated in {summary['wall_s']:.3g} s: final input speed "
        f"{significant(summary['input_speed_rpm'], 3)} rpm",
        summary={key: None if key in unknown else value for key, value in summary.items()},
        findings=[own for own in found if own.level != "error" and own.text not in said],
        path=finished.path,
        failure=failure,
        remarks=[*_remarks(summary), *([comparison.words] if comparison is not None else [])],
    )


def _summary(
    finished: Run, data: Mapping[str, Floats], attributes: Mapping[str, Any], longest: Mapping[str, float]
) -> dict[str, Any]:
    """Summarise a run by its data, its attributes and the longest times of its meshes, with units in the keys."""
    return {
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
        **{doubt: str(attributes.get(doubt, "")) for doubt in DOUBTS},
        "longest_tensile_time_s": longest["tensile_time"],
        "longest_contact_loss_s": longest["contact_loss_time"],
        "longest_time_outside_table_s": longest["extrapolation_time"],
        "longest_interpolation_time_s": longest["interpolation_time"],
        "complete": finished.complete,
        "valid": finished.trusted,
        "reasons": list(finished.reasons),
    }


def _remarks(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield the settings of a run and its numerical accuracy."""
    yield (
        f"Variant {summary['variant']}, load case {summary['load_case']} ({summary['load']}), mesh model "
        f"{summary['mesh_model']}, inertia set {summary['inertias']}, solver {summary['solver']}."
    )
    if "stability_margin" in summary:
        yield (
            f"Time step {1e6 * summary['step_s']:.3g} µs, stability margin {summary['stability_margin']:.1f}; "
            f"estimated integration error up to {summary['band_Hz'] / 1e3:g} kHz: "
            f"{100.0 * abs(summary['expected_error_at_band']):.1g} % of amplitudes, "
            f"{100.0 * summary['expected_error_of_resonances']:.1g} % of resonance peaks."
        )
    if summary["tooth_friction_work_J"]:
        yield f"Friction of the teeth included: it dissipates {1e-3 * summary['tooth_friction_work_J']:.3g} kJ."
