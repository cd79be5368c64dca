"""Load cases in time: start in balance, integrate, stream the results.

Two solvers take the same assembly: `exugear.compiled`, and Exudyn as the model of record. Both hand their states to
one `Recorder`, which filters, accounts for energy and writes. Without a step asked for, `exugear.compiled.choose_step`
finds the longest that is stable and keeps the excitation in the band: 6.4 kHz is the high-speed mesh of the GRC at
215 rpm. Exudyn is loaded only where it integrates.
"""

from __future__ import annotations

import math
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from exugear.assembly import Assembly, assemble
from exugear.channels import BALANCE_TERMS, Channels
from exugear.compiled import (
    CompiledSystem,
    DriveLaw,
    LoadTable,
    Observer,
    choose_step,
    fastest_motion,
    highest_rate,
    refusal,
    unstable,
)
from exugear.extent import SAMPLE_RATE, buffer_rows, check_disk, check_duration, sample_bytes, too_fine
from exugear.gearbox import Gearbox, LoadCase
from exugear.load_summary import drive_rate, driven_start_speed, summarise_loads
from exugear.mesh_element import Angles, MeshData
from exugear.results import bodies_folder, input_hash
from exugear.runfile import (
    EARLIER_PARTIAL_NAME,
    FINAL_NAME,
    MESH_TIMES,
    PARTIAL_NAME,
    Checkpoint,
    Decimator,
    RunFile,
    has_pieces,
    load_run,
)
from exugear.statics import accelerating_start
from exugear.torque_series import torque_series
from exugear.trust import Judge
from exugear.versions import RUN
from fe_ste.files import FileError, exclusive

if TYPE_CHECKING:
    from exugear.system import Loading, MeshRoute

Floats = NDArray[np.float64]

Solver = Literal["compiled", "exudyn"]
SOLVERS: tuple[str, ...] = get_args(Solver)

BAND = 6.4e3
"""Highest frequency whose amplitude is kept, Hz."""
LOCK_NAME = "run.partial.lock"
FLUSH_INTERVAL = 0.25
"""Simulated time between writes to disk, s."""
FLUSH_FACTOR = {"compiled": 4, "exudyn": 1}
"""How many times this interval each solver goes without: a piece costs as much as 2000 compiled steps."""

STEPS_AT_ONCE = 2000
"""Steps of one call of the compiled solver: Ctrl-C is heard between calls, and a step takes up to half a ms."""


class RunError(RuntimeError):
    """A run that went wrong; what was reached before is kept."""


class LimitError(RunError):
    """A run that was stopped beyond a limit of `exugear.trust`, with what was reached."""

    def __init__(self, message: str, run: Run) -> None:
        super().__init__(message)
        self.run = run


@dataclass(frozen=True)
class Progress:
    """How far a run is: simulated and total time (s), wall time spent and expected to remain (s)."""

    simulated: float
    total: float
    wall: float
    remaining: float

    @property
    def speed(self) -> float:
        """Simulated seconds per second of wall time."""
        return self.simulated / self.wall if self.wall > 0.0 else 0.0


@dataclass(frozen=True)
class Run:
    """A finished or stopped run.

    Attributes
    ----------
    path : Path
    complete : bool
    end, wall : float
        Simulated and wall time, s.
    reasons : tuple of str
        Why it is not to be trusted (`exugear.trust`), none if it is.
    halted : bool
        Whether it was stopped beyond a limit, and cannot go on.
    """

    path: Path
    complete: bool
    end: float
    wall: float
    reasons: tuple[str, ...] = ()
    halted: bool = False

    @property
    def trusted(self) -> bool:
        """Whether the run stayed within the limits of what it may claim."""
        return not self.reasons


def run_directory(out: str | Path, variant: str, load_case: str, law: str, inertias: str) -> Path:
    """Directory of a run: ``<variant>/<load case>-<law>-<inertias>`` in the results directory."""
    return Path(out) / variant / f"{load_case}-{law}-{inertias}"


def simulate(
    gearbox: Gearbox,
    variant: str,
    stiffness: Mapping[str, MeshData],
    out: str | Path,
    *,
    load_case: str = "reference",
    mesh_law: str = "line_of_action",
    inertias: str | None = None,
    duration: float | None = None,
    step: float | None = None,
    band: float = BAND,
    sample_rate: float = SAMPLE_RATE,
    solver: Solver | None = None,
    mesh_route: MeshRoute = "element",
    angles: Angles = "reference",
    resume: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> Run:
    """Run a load case and stream the results to ``<out>/<variant>/<...>/run.nc``.

    Parameters
    ----------
    gearbox : Gearbox
    variant : {"rigid", "bushing", "flexible", "jointed"}
    stiffness : mapping of pair name to (n,) array
        Mesh stiffness over the cycle, see `exugear.mesh_stiffness.mesh_stiffness`.
    out : path
        Results directory.
    load_case, mesh_law, inertias, angles : str
        As in the gearbox file and `exugear.mesh_element`.
    duration : float, optional
        Simulated time, s; the load case's by default.
    step : float, optional
        Integration step, s; chosen from `band` and the fastest eigenfrequency by default.
    band, sample_rate : float
        Highest frequency whose amplitude is kept, and stored rate, Hz; the rate must divide the steps.
    solver : {"compiled", "exudyn"}, optional
        The compiled one where it applies by default; a body in a floating frame needs Exudyn.
    mesh_route : {"element", "loads"}
        See `exugear.system`; "loads" is Exudyn's alone.
    resume : bool
        Go on with a run that was stopped.
    progress : callable, optional
        Called about every quarter of a simulated second.

    Returns
    -------
    Run
        Not complete after Ctrl-C; its folder then holds everything up to there, see `exugear.runfile.load_run`.

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
        A limit of `exugear.trust` that no run may go beyond; softer ones end in `Run.reasons`.
    """
    if load_case not in gearbox.load_cases:
        raise gearbox.fault(f"no load case {load_case!r}; load cases are {', '.join(gearbox.load_cases)}")
    case = gearbox.load_cases[load_case]
    check_duration(gearbox, case, duration, sample_rate)
    folder = bodies_folder(Path(out))
    assembly = assemble(gearbox, variant, stiffness, mesh_law, inertias, angles=angles, folder=folder)
    directory = run_directory(out, variant, load_case, mesh_law, assembly.inertias)
    total = case.duration if duration is None else duration
    chosen = _solver(solver, assembly, mesh_route)
    if step is None:
        step = choose_step(assembly, sample_rate, band)
        if too_fine(step, total, sample_rate):
            raise gearbox.fault(f"{fastest_motion(assembly)}; {too_fine(step, total, sample_rate)}")
    with held(directory):
        recorder = Recorder(assembly, case, directory, total, step, band, sample_rate, chosen, resume, progress)
        return recorder.run(mesh_route)


@contextmanager
def held(directory: Path) -> Iterator[None]:
    """Keep a run to this process; the lock ends with the process, however that ends.

    Raises
    ------
    FileError
        Another process is at work on the run.
    """
    with exclusive(directory / LOCK_NAME, f"the run {directory}"):
        yield


def refuse_if_busy(directory: Path) -> None:
    """Raise what `simulate` would raise if another process is at work on a run; change nothing.

    Raises
    ------
    FileError
    """
    if (directory / LOCK_NAME).exists():
        with held(directory):
            pass


def refuse_to_resume(directory: Path) -> str:
    """Why a run cannot be gone on with; empty if it can."""
    if has_pieces(directory / PARTIAL_NAME):
        return ""
    if (directory / EARLIER_PARTIAL_NAME).exists():
        return f"{directory / EARLIER_PARTIAL_NAME}: was written by an earlier version, which cannot be gone on with"
    if (directory / FINAL_NAME).exists():
        try:
            load_run(directory / FINAL_NAME, ())
        except FileError as error:
            return str(error)
        return f"{directory / FINAL_NAME}: is complete, nothing was stopped"
    return f"{directory}: no run of these choices was stopped here"


def _solver(asked: str | None, assembly: Assembly, mesh_route: str) -> str:
    """Solver to take: the one asked for if it can, else the compiled one where it applies."""
    if asked is not None and asked not in SOLVERS:
        raise RunError(f"solver {asked!r} is unknown; solvers are {', '.join(SOLVERS)}")
    reason = refusal(assembly) if mesh_route == "element" else "user-function loads exist in Exudyn only"
    if asked == "compiled" and reason:
        raise RunError(f"the compiled solver cannot run this: {reason}; use --solver exudyn")
    return "exudyn" if reason else asked or "compiled"


class Recorder:
    """One run in progress: start state, system, buffers, file."""

    def __init__(
        self,
        assembly: Assembly,
        case: LoadCase,
        directory: Path,
        total: float,
        step: float,
        band: float,
        sample_rate: float,
        solver: str,
        resume: bool,
        progress: Callable[[Progress], None] | None,
    ) -> None:
        self.assembly = assembly
        self.step = step
        self.band = band
        self.solver = solver
        self._rate = highest_rate(assembly)
        if solver == "compiled" and unstable(self._rate, step):
            raise RunError(unstable(self._rate, step))
        if too_fine(step, total, sample_rate):
            raise RunError(too_fine(step, total, sample_rate))
        self.steps = round(total / step)
        factor = max(1, round(1.0 / (step * sample_rate)))
        if abs(factor * step * sample_rate - 1.0) > 1e-9:
            raise RunError(
                f"sample_rate = {sample_rate:g} Hz does not fit the step of {step:g} s; "
                f"use {1.0 / (factor * step):g} Hz"
            )
        self.channels = Channels(assembly)
        self.decimator = Decimator(factor, self.channels.count)
        self.final_path = directory / FINAL_NAME
        self.partial_path = directory / PARTIAL_NAME
        self.progress = progress
        self.balance = np.zeros(len(BALANCE_TERMS))
        self._mesh_times = np.zeros((len(MESH_TIMES), len(self.channels.mesh_names)))
        self._powers: Floats | None = None
        rows = buffer_rows(FLUSH_FACTOR[solver] * FLUSH_INTERVAL / step, assembly.size, self.channels.count)
        self._q = np.empty((rows, assembly.size))
        self._v = np.empty((rows, assembly.size))
        self._t = np.empty(rows)
        self._filled = 0
        self._count = -1
        self._last_time = 0.0
        self._stop = False
        self._fault = ""
        if not resume:
            channels = self.channels
            size = sample_bytes(len(channels.mesh_names), len(channels.support_names), channels.has_places)
            check_disk(assembly.gearbox, case, directory, total, sample_rate, sample_bytes=size)
        self._prepare(case, resume)

    def _prepare(self, case: LoadCase, resume: bool) -> None:
        """Open the file and set the state to start from."""
        series = torque_series(self.assembly.gearbox, case)
        total = self.steps * self.step
        intended = summarise_loads(self.assembly.gearbox, case, self.assembly.inertias, total, series)
        self._judge = Judge(self.assembly, intended)
        if resume:
            reason = refuse_to_resume(self.partial_path.parent)
            if reason:
                raise RunError(f"{reason}; run without resuming")
            self.file = RunFile(self.partial_path, self.channels)
            self._check_same_run(case)
            state = self.file.last_checkpoint()
            self.first_step, self.q, self.v = state.step, state.q, state.v
            self.decimator.pending, self.decimator.first = state.pending, state.pending_first
            self.balance, self._mesh_times = state.balance, state.mesh_times
            offset = state.start_angle
            self._judge.figures = state.judgement
            if self._judge.stop:
                reasons = self._judge.reasons(state.mesh_times[0], state.step * self.step)
                raise RunError(f"{self.partial_path}: stopped for good: {'; '.join(reasons)}; run it anew")
        else:
            self.first_step = 0
            self.q, self.v, offset = _start(self.assembly, case, series)
            (self.partial_path.parent / EARLIER_PARTIAL_NAME).unlink(missing_ok=True)
            self.file = RunFile(self.partial_path, self.channels, self._attributes(case))
        self.loads = _load_table(case, series, offset, self.assembly.gearbox)
        self.observer = Observer(self.channels, self.loads)
        self._offset = offset
        self._skip_first = resume

    def _attributes(self, case: LoadCase) -> dict[str, Any]:
        assembly, gearbox = self.assembly, self.assembly.gearbox
        return {
            "gearbox": gearbox.name,
            "variant": assembly.variant,
            "load_case": case.name,
            "mesh_law": assembly.law,
            "inertias": assembly.inertias,
            "input_hash": input_hash(assembly, case.name),
            "method_version": RUN,
            "housing_factor": assembly.housing_factor,
            "ratio": gearbox.ratio,
            "output_base_radius": self.channels.radius,
            "highest_order": max(gearbox.mesh_frequencies(2.0 * math.pi).values()),
            "step": self.step,
            "band": self.band,
            "fastest_eigenvalue": self._rate,
            "solver": self._solver_name,
            "complete": 0,
        }

    @property
    def _solver_name(self) -> str:
        if self.solver == "compiled":
            return "compiled, RK4"
        return f"Exudyn {version('exudyn')}, {'generalized-alpha' if self._is_implicit else 'RK44'}"

    @property
    def _is_implicit(self) -> bool:
        """Tell whether Exudyn solves constraints, which its explicit solvers cannot."""
        return self.assembly.variant == "jointed" or bool(self.assembly.floating)

    def _check_same_run(self, case: LoadCase) -> None:
        kept = self.file.attributes
        for key, value in self._attributes(case).items():
            if key not in ("complete", "solver") and kept.get(key) != value:
                raise RunError(f"{self.partial_path}: was run with {key} = {kept.get(key)}, not {value}; start anew")

    def run(self, mesh_route: MeshRoute) -> Run:
        """Integrate to the end, or to the first fault or interruption."""
        self._wall_start = time.perf_counter()
        with _interruption(self):
            if self.first_step >= self.steps:  # a kill fell between the last step and the joining of the pieces
                self._last_time = self.first_step * self.step
            elif self.solver == "compiled":
                self._integrate()
            else:
                self._integrate_in_exudyn(mesh_route)
            self._flush()
            if self._fault:
                self._note_verdict()
                self.file.mark()
        complete = not self._stop and not self._fault and not self._judge.stop
        reasons = self._reasons()
        if complete:
            self.file.note("complete", 1)
        wall = time.perf_counter() - self._wall_start
        if self._fault:
            raise RunError(f"{'; '.join((self._fault, *reasons))}; what was reached is in {self.partial_path}")
        path = self.final_path if complete else self.partial_path
        run = Run(path, complete, self._last_time, wall, reasons, self._judge.stop)
        if run.halted:
            raise LimitError(f"{'; '.join(reasons)}; what was reached is in {self.partial_path}", run)
        if complete:
            self.file.finish(self.final_path)
        return run

    def _reasons(self) -> tuple[str, ...]:
        return self._judge.reasons(self._mesh_times[0], self._last_time)

    def _note_verdict(self) -> None:
        """Write what the run may claim so far into its next piece, and what speaks against it."""
        against = ((self._fault,) if self._fault else ()) + self._reasons()
        self.file.note("limits", self._judge.limits.to_json())
        self.file.note("verdict", "; ".join(against) or "within all limits")
        self.file.note("trusted", 0 if against else 1)

    def _integrate_in_exudyn(self, mesh_route: MeshRoute) -> None:
        from exugear.flexible import SolverFailure
        from exugear.system import ExudynSystem

        system = ExudynSystem(self.assembly, self.q, self.v, _loading(self.loads), mesh_route)
        start = self.first_step * self.step
        try:
            system.run(start, self.steps - self.first_step, self.step, self._observe, not self._is_implicit)
        except SolverFailure as error:
            self._fault = self._fault or f"Exudyn gave up at t = {self._last_time:.6g} s: {error}"

    def _integrate(self) -> None:
        """Let the compiled solver fill the buffers, one call per flush."""
        system = CompiledSystem(self.assembly, self.q, self.v, self.loads, self.step)
        done = self.first_step
        if not self._observe(done * self.step, self.q, self.v):
            return
        while done < self.steps and not self._stop and not self._fault and not self._judge.stop:
            end = min(self._filled + min(self.steps - done, STEPS_AT_ONCE), len(self._t))
            q, v = self._q[self._filled : end], self._v[self._filled : end]
            good = system.advance(done, q, v)
            if good < len(q):
                self._fault = f"the state is not finite at t = {(done + good + 1) * self.step:.6g} s"
            self._t[self._filled : self._filled + good] = self.step * np.arange(done + 1, done + good + 1)
            self._filled += good
            done += good
            self._last_time = done * self.step
            if self._filled == len(self._t):
                self._flush()

    def interrupt(self) -> None:
        """Stop after the present step."""
        self._stop = True

    @property
    def interrupted(self) -> bool:
        """Whether the run was asked to stop."""
        return self._stop

    def _observe(self, t: float, q: Floats, v: Floats) -> bool:
        """Take one state; False stops the run."""
        if self._skip_first:  # the state resumed from is in the file already
            self._skip_first = False
            self._last_time, self._count = t, 0
            self._powers = self.observer.observe(np.array([t]), q[None], v[None])[2]
            return True
        if not (np.isfinite(q).all() and np.isfinite(v).all()):
            self._fault = f"the state is not finite at t = {t:.6g} s"
            return False
        number = self.first_step + self._advance(t)
        if abs(t - number * self.step) > 1e-3 * self.step:
            self._fault = (
                f"Exudyn cut the step at t = {t:.9g} s, expected {number * self.step:.9g} s: "
                "the equations were not solved at this step; use a smaller one"
            )
            return False
        n = self._filled
        self._t[n], self._q[n], self._v[n] = t, q, v
        self._filled += 1
        if self._filled == len(self._t):
            self._flush()
        return not self._stop and not self._judge.stop

    def _advance(self, t: float) -> int:
        """Count steps since the start of this integration; the first call is the start itself."""
        self._count += 1
        self._last_time = t
        return self._count

    def _flush(self) -> None:
        """Turn the buffered states into signals, write them and the state to go on from."""
        n = self._filled
        if n == 0:
            return
        t, q, v = self._t[:n], self._q[:n], self._v[:n]
        with np.errstate(over="ignore", invalid="ignore"):  # a run that diverges ends in numbers too large to add up
            signals, energies, powers = self.observer.observe(t, q, v)
            balance_times, balances = self._account(t, energies, powers)
        self._judge.see(t, self.channels.mesh_deflections(signals), v, balance_times, balances)
        self._mesh_times = self._mesh_times + self.step * self.channels.mesh_times(signals)
        centre, rows = self.decimator.push(signals)
        times = self.step * (centre + self.decimator.factor * np.arange(len(rows), dtype=np.float64))
        state = Checkpoint(
            step=round(float(t[-1]) / self.step),
            q=q[-1],
            v=v[-1],
            pending=self.decimator.pending,
            pending_first=self.decimator.first,
            balance=self.balance,
            start_angle=self._offset,
            mesh_times=self._mesh_times,
            judgement=self._judge.figures,
        )
        self._note_verdict()
        self.file.append(times, rows, balance_times, balances, state)
        self._filled = 0
        if self.progress is not None:
            self.progress(self._state_of_progress(float(t[-1])))

    def _state_of_progress(self, now: float) -> Progress:
        start, end = self.first_step * self.step, self.steps * self.step
        wall = time.perf_counter() - self._wall_start
        done = now - start
        remaining = wall * (end - now) / done if done > 0.0 else math.inf
        return Progress(now, end, wall, remaining)

    def _account(self, t: Floats, energies: Floats, powers: Floats) -> tuple[Floats, Floats]:
        """Carry the account of energy on; times (s) and lines of it, (n, terms), to write.

        Energies are taken as they are, powers integrated by the trapezoidal rule.
        """
        before = powers[:1] if self._powers is None else self._powers
        series = np.vstack([before, powers])
        lines = np.empty((len(t), len(BALANCE_TERMS)))
        worked = self.balance[[0, 3, 4, 5, 6]] + 0.5 * self.step * np.cumsum(series[1:] + series[:-1], axis=0)
        if self._powers is None:
            worked -= self.step * powers[0]  # no time passes before the first state
        lines[:, [0, 3, 4, 5, 6]] = worked
        lines[:, 1:3] = energies
        self._powers = powers[-1:]
        self.balance = lines[-1]
        stride = max(1, round(FLUSH_INTERVAL / self.step))
        chosen = np.unique(np.append(np.arange(0, len(t), stride), len(t) - 1))
        return t[chosen], lines[chosen]


@contextmanager
def _interruption(recorder: Recorder) -> Iterator[None]:
    """Let Ctrl-C end a run after its step instead of tearing it down; only the main thread receives it.

    So do other signals by which the program that runs this has itself stopped. A second Ctrl-C tears down.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {number: found for number in numbers if callable(found := signal.getsignal(number))}

    def handler(number: int, frame: FrameType | None) -> None:
        if recorder.interrupted and number == signal.SIGINT:
            before[number](number, frame)
        recorder.interrupt()

    for number in before:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number, found in before.items():
            signal.signal(number, found)


def _start(
    assembly: Assembly, case: LoadCase, series: Mapping[str, tuple[Floats, Floats]]
) -> tuple[Floats, Floats, float]:
    """State at the start, and the angle (rad) that a drive must be ahead by to carry its torque."""
    torques = {**case.torques, **{name: float(values[0]) for name, (_, values) in series.items()}}
    driven = None
    if case.driven_body is not None:
        driven = case.driven_body, drive_rate(assembly.gearbox, case)
    found = accelerating_start(assembly, torques, case.start_speed, driven)
    offset = 0.0
    if case.driven_body is not None and case.drive_stiffness is not None:
        offset = float(found.q[assembly.spin[case.driven_body]]) + found.drive_torque / case.drive_stiffness
    return found.q, found.v, offset


def _load_table(
    case: LoadCase, series: Mapping[str, tuple[Floats, Floats]], offset: float, gearbox: Gearbox
) -> LoadTable:
    """Gather what acts from outside; a drive starts `offset` (rad) ahead."""
    drive = None
    if case.driven_body is not None and case.drive_stiffness is not None:
        drive = DriveLaw(
            body=case.driven_body,
            stiffness=case.drive_stiffness,
            damping=gearbox.case.damping.coupling_time_s * case.drive_stiffness,
            angle=(offset, driven_start_speed(gearbox, case), 0.5 * drive_rate(gearbox, case)),
        )
    return LoadTable(case.torques, series, drive)


def _loading(loads: LoadTable) -> Loading:
    """Express the same as functions of time, for Exudyn."""
    from exugear.system import Drive, Loading

    drive = None
    if loads.drive is not None:
        ahead, speed, half = loads.drive.angle
        drive = Drive(
            body=loads.drive.body,
            stiffness=loads.drive.stiffness,
            damping=loads.drive.damping,
            angle=lambda t: ahead + speed * t + half * t * t,
            speed=lambda t: speed + 2.0 * half * t,
        )
    varying = {name: _interpolator(times, values) for name, (times, values) in loads.series.items()}
    return Loading(loads.constant, varying, drive)


def _interpolator(times: Floats, values: Floats) -> Callable[[float], float]:
    return lambda t: float(np.interp(t, times, values))
