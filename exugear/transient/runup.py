"""Load cases in time: start in balance, integrate, stream the results.

Two solvers take the same assembly: `exugear.transient.compiled.solver`, and Exudyn as the model of record. Both hand
their states to one `exugear.transient.recorder.Recorder`, which filters, accounts for energy and writes. Without a step
asked for, `exugear.transient.compiled.step.choose_integration` finds method and step, stable and accurate up to the end
of the band: 6.4 kHz is the high-speed mesh of the GRC at 215 rpm. Exudyn is loaded only where it integrates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.results.folder import run_directory
from exugear.results.run_file import RunFile
from exugear.system.assemble import assemble
from exugear.system.assembly import Assembly
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.signals import signal_layout
from exugear.system.tooth_mesh.law import Angles, MeshData
from exugear.transient.compiled.solver import compile_loop_ahead, unsupported_reason
from exugear.transient.compiled.step import INTEGRATORS, choose_integration, fastest_motion
from exugear.transient.extent import SAMPLE_RATE, check_disk, check_duration, too_fine
from exugear.transient.integration import integrate
from exugear.transient.interruption import interruptible
from exugear.transient.outcome import LimitError, Progress, ProgressMeter, Run, RunError
from exugear.transient.plan import RunPlan, plan_run
from exugear.transient.recorder import Recorder
from exugear.transient.run_folder import held
from exugear.transient.start import RunStart, prepare_start

if TYPE_CHECKING:
    from exugear.transient.exudyn_model.system import MeshRoute


Solver = Literal["compiled", "exudyn"]
Integrator = Literal["adams", "rk4"]
SOLVERS: tuple[str, ...] = get_args(Solver)
BAND = 6.4e3
"""Highest frequency whose amplitude is kept, Hz."""


def simulate(
    gearbox: Gearbox,
    choice: Choice,
    stiffness: Mapping[str, MeshData],
    out: str | Path,
    *,
    bodies: Mapping[str, ElasticBody] | None = None,
    duration: float | None = None,
    step: float | None = None,
    band: float = BAND,
    sample_rate: float = SAMPLE_RATE,
    solver: Solver | None = None,
    integrator: Integrator | None = None,
    mesh_route: MeshRoute = "element",
    angles: Angles = "reference",
    resume: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> Run:
    """Run a load case and stream the results to ``<out>/<variant>/<...>/run.nc``.

    Parameters
    ----------
    choice : variant, mesh law, inertia set and load case
    stiffness : mapping of pair name to (n,) array
        Mesh stiffness over the cycle, see `exugear.system.tooth_mesh.laws.stiffness.mesh_stiffness`.
    out : results directory
    bodies : by body name, reduced elastic bodies, which the variant `flexible` needs
    duration : simulated time, s; the load case's by default
    step : integration step, s; chosen from `band` and the fastest eigenfrequency by default
    band, sample_rate : highest frequency whose amplitude is kept, and stored rate, Hz; the rate must divide the steps
    solver : {"compiled", "exudyn"}, optional
        The compiled one where it applies by default; a body in a floating frame needs Exudyn.
    integrator : {"adams", "rk4"}, optional
        Kind of method of the compiled solver; whichever takes fewer evaluations by default. ``rk4`` is the reference.
    angles : {"reference", "operating"}
        Angles of the law `seed`.
    mesh_route : {"element", "loads"}
        See `exugear.transient.exudyn_model.system`; "loads" is Exudyn's alone.
    resume : go on with a run that was stopped
    progress : called about every quarter of a simulated second

    Returns
    -------
    Run
        Not complete after Ctrl-C; its folder then holds everything up to there, see
        `exugear.results.run_file.load_run`.

    Raises
    ------
    CaseError
        A load case or a duration that cannot be run: too short, too long for the disk, or with a motion so fast that
        it asks for an absurd step.
    RunError
        The compiled solver does not take the variant or the step, a state that is not finite, a step that Exudyn
        cut, or nothing to resume.
    FileError
        Another process is at work on this run.
    OSError
        The results cannot be written; what was written before is kept.
    LimitError
        A limit of `exugear.transient.trust` that no run may go beyond; softer ones end in `Run.reasons`.
    """
    choice = choice.of(gearbox)
    if choice.load_case not in gearbox.load_cases:
        raise gearbox.fault(f"no load case {choice.load_case!r}; load cases are {', '.join(gearbox.load_cases)}")
    case = gearbox.load_cases[choice.load_case]
    check_duration(gearbox, case, duration, sample_rate)

    def begin_to_compile(parts: Assembly) -> None:
        if _solver(solver, parts, mesh_route) == "compiled":
            compile_loop_ahead(parts)

    assembly = assemble(gearbox, choice, stiffness, bodies, angles=angles, before_balance=begin_to_compile)
    directory = run_directory(out, choice)
    total = case.duration if duration is None else duration
    if integrator is not None and integrator not in INTEGRATORS:
        raise RunError(f"integrator {integrator!r} is unknown; integrators are {', '.join(INTEGRATORS)}")
    chosen = _solver(solver, assembly, mesh_route)
    kind = integrator if chosen == "compiled" else "rk4"  # Exudyn's explicit method is the same
    integration = choose_integration(assembly, sample_rate, band, step=step, integrator=kind)
    if step is None and too_fine(integration.step, total, sample_rate):
        raise gearbox.fault(f"{fastest_motion(assembly)}; {too_fine(integration.step, total, sample_rate)}")
    with held(directory):
        plan = plan_run(assembly, case, directory, total, integration, band, sample_rate, chosen, mesh_route)
        if not resume:
            size = signal_layout(assembly).sample_bytes
            check_disk(gearbox, case, directory, total, sample_rate, sample_bytes=size)
        return _carry_out(plan, prepare_start(plan, resume), progress)


def _carry_out(plan: RunPlan, start: RunStart, progress: Callable[[Progress], None] | None) -> Run:
    """Integrate to the end, or to the first fault or interruption, and keep the file of a complete run."""
    with RunFile(plan.final_path, start.pieces, plan.samples) as file:
        meter = ProgressMeter(start.state.step * plan.step, plan.duration, progress)
        run = _integrate(plan, start, file, meter)
        if run.complete:
            meter.reach(run.end)
            start.pieces.note("complete", 1)
            file.finish()
    return run


def _integrate(plan: RunPlan, start: RunStart, file: RunFile, meter: ProgressMeter) -> Run:
    """Integrate and tell how it ended; a fault, or a limit that was passed, is raised."""
    with Recorder(plan, start, file, meter.reach) as recorder, interruptible() as interruption:
        integrate(plan, start, recorder, interruption)
        recorder.finish()
        if recorder.fault:
            recorder.note_verdict()
            start.pieces.mark()
    reasons = recorder.reasons()
    if recorder.fault:
        raise RunError(f"{'; '.join((recorder.fault, *reasons))}; what was reached is in {plan.partial_path}")
    complete = not interruption.asked and not recorder.halted
    path = plan.final_path if complete else plan.partial_path
    run = Run(path, complete, recorder.last_time, meter.wall, reasons, recorder.halted)
    if run.halted:
        raise LimitError(f"{'; '.join(reasons)}; what was reached is in {plan.partial_path}", run)
    return run


def _solver(asked: str | None, assembly: Assembly, mesh_route: str) -> str:
    """Solver to take: the one asked for if it can, else the compiled one where it applies."""
    if asked is not None and asked not in SOLVERS:
        raise RunError(f"solver {asked!r} is unknown; solvers are {', '.join(SOLVERS)}")
    reason = unsupported_reason(assembly) if mesh_route == "element" else "user-function loads exist in Exudyn only"
    if asked == "compiled" and reason:
        raise RunError(f"the compiled solver cannot run this: {reason}; use --solver exudyn")
    if reason:
        return "exudyn"
    return asked or "compiled"
