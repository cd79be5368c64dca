"""What a run is to do: its steps, and what it was run with, as the file keeps it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exugear.gearbox.parts import LoadCase
from exugear.gearbox.versions import RUN
from exugear.results.decimation import Decimator
from exugear.results.run_file import FINAL_NAME, PARTIAL_NAME
from exugear.system.assembly import Assembly
from exugear.system.fingerprint import input_hash
from exugear.system.signals import bodies_of_forces
from exugear.transient.compiled.methods import RUNGE_KUTTA
from exugear.transient.compiled.step import Integration, unstable
from exugear.transient.extent import too_fine
from exugear.transient.outcome import RunError
from exugear.transient.read_out import stored_filter

if TYPE_CHECKING:
    from exugear.transient.exudyn_model.system import MeshRoute

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
    """How the compiled solver integrates; of Exudyn's own methods it tells the step."""
    solver: str
    """``compiled`` or ``exudyn``."""
    mesh_route: MeshRoute = "element"
    """Str. How meshes act in Exudyn: ``element`` or ``loads``."""

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
        return {
            "gearbox": gearbox.name,
            "variant": str(assembly.variant),
            "load_case": self.case.name,
            "mesh_law": assembly.mesh_law,
            "inertias": assembly.inertias,
            "input_hash": input_hash(assembly, self.case.name),
            "method_version": RUN,
            "housing_factor": assembly.housing_factor,
            "bearing_laws": assembly.bearing_laws,
            "mesh_contact": assembly.contacts.in_words,
            "ratio": gearbox.train.ratio,
            "output_base_radius": gearbox.output_radius,
            "highest_order": max(gearbox.train.mesh_frequencies(2.0 * math.pi).values(), default=1.0),
            **bodies_of_forces(assembly),
            "step": self.step,
            "band": self.band,
            "fastest_eigenvalue": self.integration.fastest_rate,
            **self._expectations(),
            "solver": self._solver_name(),
            "mesh_route": self.mesh_route,
            "complete": 0,
        }

    def _expectations(self) -> dict[str, float]:
        """Return what the method and its step are expected to do; it is known of the compiled solver alone."""
        if self.solver != "compiled":
            return {}
        chosen = self.integration
        figures = (chosen.margin, chosen.forced_error, chosen.resonance_error)
        return dict(zip(EXPECTATIONS, figures, strict=True))

    def _solver_name(self) -> str:
        if self.solver == "compiled":
            return f"compiled, {self.integration.method.name}"
        meshes = ", meshes as loads" if self.mesh_route == "loads" else ""
        return f"Exudyn {version('exudyn')}, {'generalized-alpha' if self.is_implicit else 'RK44'}{meshes}"


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
    return RunPlan(assembly, case, directory, steps, steps_per_sample, band, integration, solver, mesh_route)
