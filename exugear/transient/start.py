"""Start of a run: initial state and loads, for a new run or from the last piece of a stopped one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from exugear.gearbox.load_cases import (
    band_warning,
    bearing_range_warning,
    drive_rate,
    driven_start_speed,
    load_in_words,
    other_load_warning,
    summarise_loads,
    table_speed_warning,
    torque_series,
)
from exugear.gearbox.parts import LoadCase
from exugear.results.run_file import (
    EARLIER_PARTIAL_NAME,
    FINAL_NAME,
    PARTIAL_NAME,
    RunCheckpoint,
    RunPieces,
    has_pieces,
    kept_attributes,
    load_run,
)
from exugear.system.loads import Drive, LoadTable
from exugear.system.signals import BALANCE_TERMS, MESH_TIMES, POWERS, SignalLayout, signal_layout
from exugear.system.statics import accelerating_start
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.transient.outcome import RunError, ValidityMonitor
from exugear.transient.plan import EXPECTATIONS, RunPlan
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import FileError, exclusive

LOCK_NAME = "run.partial.lock"


@contextmanager
def held(directory: Path) -> Iterator[None]:
    """Reserve a run for this process; the lock ends with the process, in any case.

    Raises
    ------
    FileError
        Another process is writing the run.
    """
    with exclusive(directory / LOCK_NAME, f"the run {directory}"):
        yield


def refuse_if_busy(directory: Path) -> None:
    """Raise what `simulate` would raise if another process is writing a run; change nothing."""
    if (directory / LOCK_NAME).exists():
        with held(directory):
            pass


def refuse_to_resume(directory: Path) -> str:
    """Why a run cannot be resumed; empty if it can."""
    if has_pieces(directory / PARTIAL_NAME):
        return ""
    if (directory / EARLIER_PARTIAL_NAME).exists():
        return f"{directory / EARLIER_PARTIAL_NAME}: was written by an earlier version and cannot be resumed"
    if (directory / FINAL_NAME).exists():
        try:
            load_run(directory / FINAL_NAME, ())
        except FileError as error:
            return str(error)
        return f"{directory / FINAL_NAME}: is complete; nothing to resume"
    return f"{directory}: no interrupted run with these settings"


def kept_setting(directory: Path, name: Literal["duration", "band"]) -> float | None:
    """Read how long a stopped run was to be (s), or the band that it keeps (Hz); None where that is not kept."""
    kept = kept_attributes(directory / PARTIAL_NAME).get(name)
    return kept and float(kept)


def refuse_shorter(directory: Path, duration: float) -> str:
    """Why a stopped run cannot end at a simulated time (s); empty if it can."""
    kept = kept_attributes(directory / PARTIAL_NAME)
    reached = float(kept.get("state_step", 0)) * float(kept.get("step", 0.0))
    if reached <= duration * (1.0 + 1e-9):
        return ""
    return f"{directory / PARTIAL_NAME}: has reached {reached:.4g} s; a duration of {duration:g} s ends before that"


@dataclass(frozen=True, eq=False)
class RunStart:
    """A run that can begin."""

    loads: LoadTable
    """What acts from outside."""
    state: RunCheckpoint
    """State to start from."""
    pieces: RunPieces
    """What is written so far, and where the rest goes."""
    judge: ValidityMonitor
    resumed: bool
    """Whether the state is that of a run that was stopped, which is in the file already."""


_OTHER_INPUT = {
    "input_hash": "was run with other input: the gearbox file or its tables have changed since",
    "method_version": "was run by another version of exugear",
}
"""Reasons against resuming a run where the two values of an attribute say nothing to the user."""


def prepare_start(plan: RunPlan, resume: bool) -> RunStart:
    """Find the state to start from and open the pieces.

    Raises
    ------
    GearboxFileError
        The table of an excitation does not cover the speeds of the load case.
    RunError
        There is nothing to resume, it was run with other choices, or was stopped for good.
    """
    assembly = plan.assembly
    case = plan.case
    gearbox = assembly.gearbox
    series = torque_series(gearbox, case)
    summary = summarise_loads(gearbox, case, assembly.inertias, plan.duration, series)
    if beyond := table_speed_warning(gearbox, summary):
        raise gearbox.error(beyond)
    judge = ValidityMonitor(assembly, summary)
    layout = signal_layout(assembly)
    if resume:
        reason = refuse_to_resume(plan.directory)
        if reason:
            raise RunError(f"{reason}; run without resuming")
        if shorter := refuse_shorter(plan.directory, plan.duration):
            raise RunError(f"{shorter}; set a longer duration")
        pieces = RunPieces(plan.partial_path, layout)
        for key, value in plan.attributes().items():
            kept = pieces.attributes.get(key, "element" if key == "mesh_route" else None)  # earlier runs had no other
            if key not in ("complete", "solver", *EXPECTATIONS) and kept != value:
                other = _OTHER_INPUT.get(key, f"was run with {key} = {kept}, not {value}")
                raise RunError(f"{plan.partial_path}: {other}; run it again without --resume")
        pieces.note("duration", plan.duration)
        state = pieces.last_checkpoint()
        judge.figures = state.judgement
        if judge.stop:
            reasons = judge.reasons(state.mesh_times, state.step * plan.step)
            raise RunError(f"{plan.partial_path}: aborted: {'; '.join(reasons)}; run it again without --resume")
    else:
        state = _first_state(assembly, case, series, layout, judge)
        (plan.directory / EARLIER_PARTIAL_NAME).unlink(missing_ok=True)
        doubt = bearing_range_warning(gearbox, summary, assembly.variant)
        other = other_load_warning(gearbox, summary, LAWS[assembly.mesh_model].uses_single_load)
        load = load_in_words(case)
        beyond = band_warning(summary, plan.band)
        doubts = {"bearing_doubt": doubt, "table_doubt": other, "band_doubt": beyond}
        told = {**doubts, "folding_doubt": plan.folding_doubt, "load": load, "duration": plan.duration}
        pieces = RunPieces(plan.partial_path, layout, {**plan.attributes(), **told})
    return RunStart(_load_table(case, series, state.start_angle, assembly), state, pieces, judge, resume)


def _first_state(
    assembly: Assembly,
    case: LoadCase,
    series: Mapping[str, tuple[Floats, Floats]],
    layout: SignalLayout,
    judge: ValidityMonitor,
) -> RunCheckpoint:
    """State at the start in balance; a drive is ahead by the angle at which it carries its torque."""
    torques = {**case.torques, **{name: float(values[0]) for name, (_, values) in series.items()}}
    driven = None
    if case.driven_body is not None:
        driven = case.driven_body, drive_rate(assembly.gearbox, case)
    balanced = accelerating_start(assembly, torques, assembly.gearbox.start_speeds(case), driven)
    start_angle = 0.0
    if case.driven_body is not None and case.drive_stiffness is not None:
        start_angle = float(balanced.q[assembly.spin[case.driven_body]]) + balanced.drive_torque / case.drive_stiffness
    return RunCheckpoint(
        step=0,
        q=balanced.q,
        v=balanced.v,
        past=np.zeros((0, assembly.size)),
        pending=np.zeros((0, layout.count)),
        pending_first=0,
        balance=np.zeros(len(BALANCE_TERMS)),
        powers=np.zeros(len(POWERS)),
        start_angle=start_angle,
        mesh_times=np.zeros((len(MESH_TIMES), len(layout.names["mesh"]))),
        judgement=judge.figures,
    )


def _load_table(
    case: LoadCase, series: Mapping[str, tuple[Floats, Floats]], start_angle: float, assembly: Assembly
) -> LoadTable:
    """Gather what acts from outside; a drive starts ahead by an angle (rad)."""
    gearbox = assembly.gearbox
    drive = None
    if case.driven_body is not None and case.drive_stiffness is not None:
        drive = Drive(
            body=case.driven_body,
            stiffness=case.drive_stiffness,
            damping=gearbox.case.damping.coupling_time_s * case.drive_stiffness,
            angle=(start_angle, driven_start_speed(gearbox, case), 0.5 * drive_rate(gearbox, case)),
        )
    return LoadTable(case.torques, series, drive, assembly.varying_loads)
