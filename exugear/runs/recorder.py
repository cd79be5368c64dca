"""A run while it goes on: steps, signals and energies in pieces, checkpoints."""

from __future__ import annotations

import math
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.dynamics.assembly import Assembly
from exugear.dynamics.fingerprint import input_hash
from exugear.dynamics.signals import BALANCE_TERMS, Channels
from exugear.dynamics.statics import accelerating_start
from exugear.loads.summary import drive_rate, driven_start_speed, summarise_loads
from exugear.loads.torque_series import torque_series
from exugear.model.gearbox import Gearbox
from exugear.model.parts import LoadCase
from exugear.model.versions import RUN
from exugear.results.decimation import Decimator
from exugear.results.run_file import EARLIER_PARTIAL_NAME, FINAL_NAME, MESH_TIMES, PARTIAL_NAME, Checkpoint, RunFile
from exugear.runs.extent import buffer_rows, check_disk, sample_bytes, too_fine
from exugear.runs.outcome import LimitError, Progress, Run, RunError
from exugear.runs.run_folder import refuse_to_resume
from exugear.runs.trust import Judge
from exugear.solvers.compiled.solver import CompiledSystem, Observer
from exugear.solvers.compiled.step import highest_rate, unstable
from exugear.solvers.loads import DriveLaw, LoadTable
from fe_ste.tools.arrays import Floats

if TYPE_CHECKING:
    from exugear.solvers.exudyn_model.system import MeshRoute
    from exugear.solvers.loads import Loading


FLUSH_INTERVAL = 0.25
"""Simulated time between writes to disk, s."""
FLUSH_FACTOR = {"compiled": 4, "exudyn": 1}
"""How many times this interval each solver goes without: a piece costs as much as 2000 compiled steps."""
STEPS_AT_ONCE = 2000
"""Steps of one call of the compiled solver: Ctrl-C is heard between calls, and a step takes up to half a ms."""


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
        mesh_route: MeshRoute = "element",
    ) -> None:
        self.assembly = assembly
        self.step = step
        self.band = band
        self.solver = solver
        self.mesh_route = mesh_route
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
            "ratio": gearbox.train.ratio,
            "output_base_radius": self.channels.radius,
            "highest_order": max(gearbox.train.mesh_frequencies(2.0 * math.pi).values()),
            "step": self.step,
            "band": self.band,
            "fastest_eigenvalue": self._rate,
            "solver": self._solver_name,
            "mesh_route": self.mesh_route,
            "complete": 0,
        }

    @property
    def _solver_name(self) -> str:
        if self.solver == "compiled":
            return "compiled, RK4"
        meshes = ", meshes as loads" if self.mesh_route == "loads" else ""
        return f"Exudyn {version('exudyn')}, {'generalized-alpha' if self._is_implicit else 'RK44'}{meshes}"

    @property
    def _is_implicit(self) -> bool:
        """Tell whether Exudyn solves constraints, which its explicit solvers cannot."""
        return self.assembly.variant == "jointed" or bool(self.assembly.floating)

    def _check_same_run(self, case: LoadCase) -> None:
        kept = self.file.attributes
        for key, value in self._attributes(case).items():
            if key not in ("complete", "solver") and kept.get(key) != value:
                raise RunError(f"{self.partial_path}: was run with {key} = {kept.get(key)}, not {value}; start anew")

    def run(self) -> Run:
        """Integrate to the end, or to the first fault or interruption."""
        self._wall_start = time.perf_counter()
        with _interruption(self):
            if self.first_step >= self.steps:  # a kill fell between the last step and the joining of the pieces
                self._last_time = self.first_step * self.step
            elif self.solver == "compiled":
                self._integrate()
            else:
                self._integrate_in_exudyn()
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

    def _integrate_in_exudyn(self) -> None:
        from exugear.solvers.exudyn_model.library import SolverFailure
        from exugear.solvers.exudyn_model.system import ExudynSystem

        system = ExudynSystem(self.assembly, self.q, self.v, _loading(self.loads), self.mesh_route)
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
    from exugear.solvers.loads import Drive, Loading

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
