"""Integration of a load case over time, a run-up or any other: start in balance, integrate, stream the results.

Two solvers take the same assembly: `exugear.transient.compiled.solver`, and Exudyn as the model of record. Both hand
their states to one `exugear.transient.recorder.Recorder`, which filters, accounts for energy and writes. Without a step
asked for, `exugear.transient.folding.choose_against_folding` finds method and step, stable and accurate up to the end
of the band: 6.4 kHz is the high-speed mesh of the GRC at 215 rpm. Exudyn is loaded only where it integrates.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.results.folder import run_directory
from exugear.results.run_file import RunFile
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.build import assemble
from exugear.system.signals import signal_layout
from exugear.system.tooth_mesh.element import Angles, MeshData, friction_lack
from exugear.transient.compiled.integrator import INTEGRATORS, choose_integration, fastest_motion
from exugear.transient.compiled.solver import CompiledSystem, unsupported_reason
from exugear.transient.folding import choose_against_folding, folding_warning
from exugear.transient.outcome import LimitError, Progress, ProgressMeter, Run, RunError
from exugear.transient.plan import SAMPLE_RATE, RunPlan, check_disk, check_duration, plan_run, too_fine
from exugear.transient.recorder import Recorder
from exugear.transient.start import RunStart, held, kept_setting, prepare_start
from fe_ste.tools.arrays import Floats

if TYPE_CHECKING:
    from exugear.transient.exudyn_model.system import MeshRoute

# Interruption: Ctrl-C ends a run after the current step

SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
"""Signals that end a run; the last two where the program that runs it listens to them itself."""


class StopRequest:
    """Whether somebody asked to stop."""

    def __init__(self) -> None:
        self.asked = False


@contextmanager
def interruptible() -> Iterator[StopRequest]:
    """Take note of Ctrl-C instead of raising; a second one tears down.

    So do other signals by which the program that runs this has itself stopped. Only the main thread receives them.
    """
    interruption = StopRequest()
    if threading.current_thread() is not threading.main_thread():
        yield interruption
        return
    numbers = [getattr(signal, name) for name in SIGNALS if hasattr(signal, name)]
    handlers = {number: handler for number in numbers if callable(handler := signal.getsignal(number))}

    def note(number: int, frame: FrameType | None) -> None:
        if interruption.asked and number == signal.SIGINT:
            handlers[number](number, frame)
        interruption.asked = True

    for number in handlers:
        signal.signal(number, note)
    try:
        yield interruption
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


# Integration of a run by either solver until its end, an error or an interruption

STEPS_AT_ONCE = 2000
"""Steps of one call of the compiled solver: Ctrl-C is heard between calls, and a step takes up to half a ms."""
STEP_TOLERANCE = 1e-3
"""How far Exudyn's clock may be from the step that is due, in steps."""


def integrate(plan: RunPlan, start: RunStart, recorder: Recorder, interruption: StopRequest) -> None:
    """Integrate as planned; the recorder takes the states and any error."""
    if start.state.step >= plan.steps:  # a kill fell between the last step and the joining of the pieces
        recorder.last_time = start.state.step * plan.step
    elif plan.solver == "compiled":
        _integrate_compiled(plan, start, recorder, interruption)
    else:
        _integrate_in_exudyn(plan, start, recorder, interruption)


def _integrate_compiled(plan: RunPlan, start: RunStart, recorder: Recorder, interruption: StopRequest) -> None:
    """Let the compiled solver fill the recorder's buffer."""
    state = start.state
    step = plan.step
    method = plan.integration.method
    system = CompiledSystem(plan.assembly, state.q, state.v, start.loads, step, method, state.past)
    done = state.step
    recorder.begin(done * step, state.q, state.v)
    while done < plan.steps and not interruption.asked and not recorder.halted:
        room = recorder.buffer.room(min(plan.steps - done, STEPS_AT_ONCE))
        good = system.advance(done, *room)
        if good < len(room.q):
            recorder.error = f"the state is not finite at t = {(done + good + 1) * step:.6g} s"
        recorder.past = system.past
        recorder.take_observed(step * np.arange(done + 1, done + good + 1, dtype=np.float64))
        done += good


def _integrate_in_exudyn(plan: RunPlan, start: RunStart, recorder: Recorder, interruption: StopRequest) -> None:
    """Let Exudyn hand over each state."""
    from exugear.transient.exudyn_model.library import SolverFailure
    from exugear.transient.exudyn_model.system import ExudynSystem

    state = start.state
    step = plan.step
    system = ExudynSystem(plan.assembly, state.q, state.v, start.loads, plan.mesh_route)
    follow = _StepFollower(plan, start, recorder, interruption)
    try:
        system.run(state.step * step, plan.steps - state.step, step, follow, not plan.is_implicit)
    except SolverFailure as error:
        recorder.error = recorder.error or f"Exudyn stopped at t = {recorder.last_time:.6g} s: {error}"


class _StepFollower:
    """Observer of Exudyn's steps: the first call is the start itself."""

    def __init__(self, plan: RunPlan, start: RunStart, recorder: Recorder, interruption: StopRequest) -> None:
        self._step = plan.step
        self._next = start.state.step
        self._begun = False
        self._recorder = recorder
        self._interruption = interruption

    def __call__(self, t: float, q: Floats, v: Floats) -> bool:
        """Hand a state over; False ends the run."""
        recorder = self._recorder
        due = self._next * self._step
        self._next += 1
        if not self._begun:
            self._begun = True
            recorder.begin(t, q, v)
            return not self._interruption.asked and not recorder.halted
        if np.isfinite(q).all() and np.isfinite(v).all() and abs(t - due) > STEP_TOLERANCE * self._step:
            recorder.last_time = t
            recorder.error = (
                f"Exudyn reduced the step at t = {t:.9g} s, expected {due:.9g} s: the equations did not converge; use "
                "a smaller step"
            )
            return False
        recorder.keep(t, q, v)
        return not self._interruption.asked and not recorder.halted


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
    choice : variant, mesh model, inertia set and load case
    stiffness : mapping of pair name to (n,) array
        Mesh stiffness over the cycle, see `exugear.system.tooth_mesh.laws.stiffness.mesh_stiffness`.
    out : results directory
    bodies : by body name, reduced flexible bodies, required by the variant `flexible`
    duration : simulated time, s; the load case's by default, that of the stopped run where one is resumed
    step
        Integration step, s; by default chosen from `band`, the fastest eigenfrequency and the harmonics of the meshes,
        which a given step may fold into the band.
    band, sample_rate : highest frequency whose amplitude is kept, and stored rate, Hz; the rate must divide the steps
    solver : {"compiled", "exudyn"}, optional
        The compiled one where it applies by default; a body in a floating frame needs Exudyn.
    integrator : {"adams", "rk4"}, optional
        Kind of method of the compiled solver; by default the one with fewer evaluations. ``rk4`` is the reference.
    angles : {"reference", "operating"}
        Angles of the model `tangential`.
    mesh_route : {"element", "loads"}
        See `exugear.transient.exudyn_model.system`; "loads" is Exudyn's alone.
    resume : resume a stopped run
    progress : called about every quarter of a simulated second

    Returns
    -------
    Run
        Not complete after Ctrl-C; its folder then holds everything up to there, see
        `exugear.results.run_file.load_run`.

    Raises
    ------
    GearboxFileError
        A load case or a duration that cannot be run: too short, too long for the disk, or with a motion so fast that it
        requires an extremely small step. Friction of the teeth without line loads.
    RunError
        The compiled solver does not support the variant or the step, a state is not finite, Exudyn reduced a step, or
        there is nothing to resume.
    FileError
        Another process is writing this run.
    OSError
        The results cannot be written; what was written before is kept.
    LimitError
        A limit of `exugear.transient.outcome` that no run may go beyond; softer ones end in `Run.reasons`.
    """
    choice = choice.of(gearbox)
    if choice.load_case not in gearbox.load_cases:
        raise gearbox.error(
            f"no load case {choice.load_case!r}; choose one of: {', '.join(gearbox.load_cases) or 'none in the file'}"
        )
    case = gearbox.load_cases[choice.load_case]
    directory = run_directory(out, choice)
    if resume and duration is None:
        duration = kept_setting(directory, "duration")
    check_duration(gearbox, case, duration, sample_rate)

    assembly = assemble(gearbox, choice, stiffness, bodies, angles=angles)
    if lack := friction_lack(assembly.elements):
        raise gearbox.error(lack)
    total = case.duration if duration is None else duration
    if integrator is not None and integrator not in INTEGRATORS:
        raise RunError(f"integrator {integrator!r} is unknown; integrators are {', '.join(INTEGRATORS)}")
    if solver is not None and solver not in SOLVERS:
        raise RunError(f"solver {solver!r} is unknown; solvers are {', '.join(SOLVERS)}")
    reason = unsupported_reason(assembly) if mesh_route == "element" else "user-function loads exist in Exudyn only"
    if solver == "compiled" and reason:
        raise RunError(f"the compiled solver cannot run this: {reason}; use --solver exudyn")
    chosen = "exudyn" if reason else solver or "compiled"
    kind = integrator if chosen == "compiled" else "rk4"  # Exudyn's explicit method is the same
    doubt = ""
    if step is None:
        integration, line = choose_against_folding(assembly, case, total, sample_rate, band, kind)
        doubt = folding_warning(line, assembly, case, total, band, kind)
    else:
        integration = choose_integration(assembly, sample_rate, band, step=step, integrator=kind)
    if step is None and too_fine(integration.step, total, sample_rate):
        raise gearbox.error(f"{fastest_motion(assembly)}; {too_fine(integration.step, total, sample_rate)}")
    with held(directory):
        plan = plan_run(assembly, case, directory, total, integration, band, sample_rate, chosen, mesh_route, doubt)
        if not resume:
            size = signal_layout(assembly).sample_bytes
            check_disk(gearbox, case, directory, total, sample_rate, sample_bytes=size)
        start = prepare_start(plan, resume)
        with RunFile(plan.final_path, start.pieces, plan.samples) as file:
            meter = ProgressMeter(start.state.step * plan.step, plan.duration, progress)
            with Recorder(plan, start, file, meter.reach) as recorder, interruptible() as interruption:
                integrate(plan, start, recorder, interruption)
                recorder.finish()
                if recorder.error:
                    recorder.note_validity()
                    start.pieces.mark()
            reasons = recorder.reasons()
            if recorder.error:
                raise RunError(f"{'; '.join((recorder.error, *reasons))}; results so far: {plan.partial_path}")
            complete = not interruption.asked and not recorder.halted
            path = plan.final_path if complete else plan.partial_path
            run = Run(path, complete, recorder.last_time, meter.wall, reasons, recorder.halted)
            if run.halted:
                raise LimitError(f"{'; '.join(reasons)}; results so far: {plan.partial_path}", run)
            if run.complete:
                meter.reach(run.end)
                start.pieces.note("complete", 1)
                file.finish()
        return run
