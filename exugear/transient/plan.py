"""Plan of a run: its steps, and its settings as stored in the file."""

from __future__ import annotations

import math
import shutil
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import LoadCase
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.versions import RUN
from exugear.results.run_file import FINAL_NAME, PARTIAL_NAME
from exugear.system.signals import AXES, SignalLayout, bodies_of_forces, signals_of
from exugear.system.system import Assembly, input_hash
from exugear.transient.compiled.integrator import RUNGE_KUTTA, Integration, unstable
from exugear.transient.filters import TAPS_PER_FACTOR, Decimator, stored_filter
from exugear.transient.outcome import RunError

if TYPE_CHECKING:
    from exugear.transient.exudyn_model.system import MeshRoute

SAMPLE_RATE = 20e3
"""Stored rate, Hz."""
HIGHEST_BAND = 100e3
"""Highest frequency that a run can be asked to keep, Hz."""
STORED_BAND = 0.4
"""Highest frequency that is stored as it is, over the stored rate: the anti-aliasing filter is flat up to there."""
LEAST_SAMPLES = 8
"""Stored samples that a spectrum needs at least."""
MOST_STEPS_PER_SAMPLE = 1000
"""Steps between two stored samples at most: 5e-8 s at 20 kHz, for a motion of 6 MHz, which no gearbox has.

The anti-aliasing filter reaches over 31 times as many steps, and a simulated second takes minutes to hours.
"""
BUFFER_BYTES = 1 << 30
"""Memory of what is kept between two writes at most."""


def rate_for(band: float) -> float:
    """Find the stored rate (Hz) for a band (Hz): the usual one, or the multiple of it that is enough.

    Raises
    ------
    GearboxFileError
        A band that is no frequency, or beyond what any step is chosen for.

    Examples
    --------
    >>> rate_for(6.4e3), rate_for(9e3)
    (20000.0, 40000.0)
    """
    if not 0.0 < band <= HIGHEST_BAND:
        raise GearboxFileError(f"--band {band:g}: must be above 0 and at most {HIGHEST_BAND:g} Hz")
    return SAMPLE_RATE * max(1, math.ceil(band / (STORED_BAND * SAMPLE_RATE) - 1e-9))


def check_duration(
    gearbox: Gearbox, case: LoadCase, duration: float | None = None, sample_rate: float = SAMPLE_RATE
) -> None:
    """Refuse a simulated time (s; the load case's by default) that is no number or leaves too few samples.

    The anti-aliasing filter needs half its length of signal on both sides of each sample.
    """
    total, key = _span(gearbox, case, duration)
    if not math.isfinite(total):
        raise GearboxFileError(f"{key} = {total:g}: set a finite number of seconds")
    least = _shortest(sample_rate)
    if total < least:
        raise GearboxFileError(
            f"{key} = {total:g}: too short for a spectrum (filtering removes {TAPS_PER_FACTOR / sample_rate:.3g} s at "
            f"the ends); set {least:.3g} s or more"
        )


def check_disk(
    gearbox: Gearbox,
    case: LoadCase,
    folder: Path,
    duration: float | None = None,
    sample_rate: float = SAMPLE_RATE,
    *,
    sample_bytes: int,
) -> None:
    """Refuse a simulated time (s) whose results do not fit on the disk of a folder, which need not be there yet."""
    total, key = _span(gearbox, case, duration)
    there = next(parent for parent in (folder.absolute(), *folder.absolute().parents) if parent.is_dir())
    needed = total * sample_rate * sample_bytes
    free = shutil.disk_usage(there).free
    if needed > free:
        fitting = free / (sample_rate * sample_bytes)
        shorter = f"set at most {fitting:.3g} s, or " if fitting > _shortest(sample_rate) else ""
        raise GearboxFileError(
            f"{key} = {total:g}: the results require {1e-9 * needed:.3g} GB, and {there} has {1e-9 * free:.3g} GB "
            f"free; {shorter}free some space or use another results folder"
        )


def _shortest(sample_rate: float) -> float:
    """Return the shortest simulated time (s) of which a spectrum can be computed."""
    return (TAPS_PER_FACTOR + LEAST_SAMPLES) / sample_rate


def sample_bytes(
    meshes: int, supports: int, tabled: bool, jointed: bool = False, couplings: int = 0, bodies: int = 0
) -> int:
    """Return the size of one sample on disk, of a run with so many meshes, supports, couplings and turning bodies.

    Parameters
    ----------
    tabled : whether its mesh model is `table`, which has further signals
    jointed : whether supports are ideal joints, which have fewer

    Examples
    --------
    >>> sample_bytes(meshes=8, supports=12, tabled=False)
    384
    >>> sample_bytes(meshes=8, supports=12, tabled=False, jointed=True)
    240
    """
    counts = {"mesh": meshes, "support": supports, "coupling": couplings, "body": bodies}
    names = {"axis": AXES} | {dimension: ("",) * count for dimension, count in counts.items()}
    return SignalLayout(signals_of(tabled, jointed, couplings > 0), names, radius=1.0).sample_bytes


def too_fine(step: float, total: float, sample_rate: float) -> str:
    """Reason why a step (s) is absurdly small, empty if it is not.

    Examples
    --------
    >>> too_fine(2.5e-5, 30.0, 20e3)
    ''
    >>> too_fine(1e-12, 30.0, 20e3)
    'step = 1e-12 s: 3e+13 steps, 5e+07 for each stored sample; at most 1000 are permitted, a step of 5e-08 s'
    """
    interval = 1.0 / (step * sample_rate)
    if interval <= MOST_STEPS_PER_SAMPLE * (1.0 + 1e-9):
        return ""
    return (
        f"step = {step:.3g} s: {total / step:.3g} steps, {interval:.3g} for each stored sample; at most "
        f"{MOST_STEPS_PER_SAMPLE} are permitted, a step of {1.0 / (MOST_STEPS_PER_SAMPLE * sample_rate):.3g} s"
    )


def buffer_rows(wanted: float, size: int, signals: int) -> int:
    """Count the steps between two writes: as many as wanted, as far as their states and signals fit into memory.

    Parameters
    ----------
    wanted : steps
    size, signals : coordinates and signals of a step

    Examples
    --------
    >>> buffer_rows(40000, size=60, signals=60), buffer_rows(1e12, size=60, signals=60)
    (40000, 209715)
    """
    numbers = 4 * size + 6 * signals + 40  # two buffers of states, signals and energies; the filter and the judge
    return max(1, min(round(wanted), BUFFER_BYTES // (8 * numbers)))


def _span(gearbox: Gearbox, case: LoadCase, duration: float | None) -> tuple[float, str]:
    """Find the simulated time (s), and where it is given."""
    if duration is not None:
        return duration, "duration"
    return case.duration, f"{gearbox.source}: load_cases.{case.name}.duration_s"


# Steps and settings of a run

EXPECTATIONS = ("stability_margin", "expected_error_at_band", "expected_error_of_resonances")
"""Attributes that say what a method and its step are expected to do."""


@dataclass(frozen=True, eq=False)
class RunPlan:
    """A run before it begins."""

    assembly: Assembly
    case: LoadCase
    directory: Path
    """Where its results go."""
    steps: int
    """Number of steps to the end."""
    steps_per_sample: int
    """Number of steps between two stored samples."""
    band: float
    """Highest frequency whose amplitude is kept, Hz."""
    integration: Integration
    """Integration settings of the compiled solver; of Exudyn's own methods only the step."""
    solver: str
    """``compiled`` or ``exudyn``."""
    mesh_route: MeshRoute = "element"
    """How meshes act in Exudyn: ``element`` or ``loads``."""
    folding_doubt: str = ""
    """Warning about harmonics of the meshes that the step folds into the band; empty if none."""

    @property
    def step(self) -> float:
        """Time step, s."""
        return self.integration.step

    @property
    def final_path(self) -> Path:
        """File of the complete run."""
        return self.directory / FINAL_NAME

    @property
    def partial_path(self) -> Path:
        """Folder of the run while it is not complete."""
        return self.directory / PARTIAL_NAME

    @property
    def duration(self) -> float:
        """Simulated time, s."""
        return self.steps * self.step

    @property
    def samples(self) -> int:
        """Number of samples that the file will hold."""
        return self.decimator().count_of(self.steps + 1)

    def decimator(self) -> Decimator:
        """Filter of the signals on their way into the file, at its beginning."""
        method = self.integration.method if self.solver == "compiled" else RUNGE_KUTTA
        taps = stored_filter(self.assembly, method, self.step, self.steps_per_sample)
        return Decimator(self.steps_per_sample, taps.own.shape[1], taps)

    @property
    def is_implicit(self) -> bool:
        """Whether Exudyn solves constraints, which its explicit solvers cannot."""
        return self.assembly.variant.is_constrained or bool(self.assembly.floating)

    def attributes(self) -> dict[str, Any]:
        """Attributes that the file of the run begins with."""
        assembly = self.assembly
        gearbox = self.assembly.gearbox
        # What the method and its step are expected to do is known of the compiled solver alone.
        expectations: dict[str, float] = {}
        if self.solver == "compiled":
            chosen = self.integration
            figures = (chosen.margin, chosen.forced_error, chosen.resonance_error)
            expectations = dict(zip(EXPECTATIONS, figures, strict=True))
            solver = f"compiled, {chosen.method.name}"
        else:
            meshes = ", meshes as loads" if self.mesh_route == "loads" else ""
            solver = f"Exudyn {version('exudyn')}, {'generalized-alpha' if self.is_implicit else 'RK44'}{meshes}"
        return {
            "gearbox": gearbox.name,
            "variant": str(assembly.variant),
            "load_case": self.case.name,
            "mesh_model": assembly.mesh_model,
            "inertias": assembly.inertias,
            "input_hash": input_hash(assembly, self.case.name),
            "method_version": RUN,
            "housing_factor": assembly.housing_factor,
            "bearing_laws": assembly.bearing_laws,
            "mesh_contact": assembly.contacts.description,
            "ratio": gearbox.train.ratio,
            "output_base_radius": gearbox.output_radius,
            "highest_order": max(gearbox.train.mesh_frequencies(2.0 * math.pi).values(), default=1.0),
            **bodies_of_forces(assembly),
            "step": self.step,
            "band": self.band,
            "fastest_eigenvalue": self.integration.fastest_rate,
            **expectations,
            "solver": solver,
            "mesh_route": self.mesh_route,
            "complete": 0,
        }


def plan_run(
    assembly: Assembly,
    case: LoadCase,
    directory: Path,
    total: float,
    integration: Integration,
    band: float,
    sample_rate: float,
    solver: str,
    mesh_route: MeshRoute = "element",
    folding_doubt: str = "",
) -> RunPlan:
    """Plan a run of so many seconds.

    Raises
    ------
    RunError
        The step is not stable, absurdly small, or no sample falls on it.
    """
    step = integration.step
    if solver == "compiled" and unstable(integration):
        raise RunError(unstable(integration))
    if too_fine(step, total, sample_rate):
        raise RunError(too_fine(step, total, sample_rate))
    steps_per_sample = max(1, round(1.0 / (step * sample_rate)))
    if abs(steps_per_sample * step * sample_rate - 1.0) > 1e-9:
        raise RunError(
            f"sample_rate = {sample_rate:g} Hz does not fit the step of {step:g} s; "
            f"use {1.0 / (steps_per_sample * step):g} Hz"
        )
    steps = round(total / step)
    return RunPlan(
        assembly, case, directory, steps, steps_per_sample, band, integration, solver, mesh_route, folding_doubt
    )
