"""Validity checks of results: energy balance, convergence, resonances that match modes, speeds and damping."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass

import numpy as np
import xarray as xr

from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.report.findings.context import Context
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.words import figure_text
from exugear.results.run_file import invalidity_of, read_run
from exugear.results.spectra.run_spectra import VariantRun
from exugear.steady.peaks import bearing_swings, pulls
from exugear.system.modal_damping import damping_in_words
from exugear.system.signals import BALANCE_TERMS, MESH_TIMES, energy_residual
from exugear.system.tooth_mesh.laws.registry import LAWS

CHECKED_RESONANCES = 10
"""Number of highest resonances that are checked."""
ENERGY = 1e-3
"""Permissible relative residual of the energy balance of a run."""
MATCHED = 0.8
"""Minimum fraction of the highest resonances that should match a mode."""
STEADY_ENERGY = 1e-4
"""Permissible relative difference between dissipated power and power of the meshes in a steady-state response."""
BEYOND_RATED = 1.3
"""Ratio to the rated speed above which the page warns of speeds beyond it."""


@dataclass(frozen=True)
class CheckResult:
    """Result of a check: passed, or a warning."""

    passed: bool
    words: str

    @property
    def line(self) -> str:
        """Check as a line of text."""
        return f"{'Passed' if self.passed else 'Warning'}: {self.words}"


@dataclass(frozen=True)
class RunFigures:
    """Values that describe the validity of a run."""

    residual: float
    """Relative residual of the energy balance."""
    times: tuple[float, ...]
    """Longest times of tensile mesh force, contact loss, outside a table and next to non-converged table states, s."""
    end: float
    """Simulated time, s."""


def run_figures(run: VariantRun) -> RunFigures:
    """Read the validity values of a run."""
    data, _ = read_run(run.path, ("time", *MESH_TIMES, *BALANCE_TERMS))
    times = tuple(float(np.max(data[name], initial=0.0)) for name in MESH_TIMES)
    return RunFigures(energy_residual(data), times, float(data["time"][-1]))


def validity_checks(context: Context, group: RunGroup) -> tuple[CheckResult, ...]:
    """Check the main variant of a group; passed checks come first."""
    case = context.gearbox.case
    run = group.runs[group.main]
    response = group.responses.get(group.main)
    own = _check_run(run, run_figures(run)) if response is None else _check_response(response)
    verdicts = [*own, *_check_resonances(group)]
    verdicts.append(
        CheckResult(
            False,
            (f"damping is assumed ({damping_in_words(case.damping)}). Resonance amplitudes depend on it directly"),
        )
    )
    sets = context.gearbox.inertia_sets
    if len(sets) > 1:
        verdicts.append(
            CheckResult(False, (f"one of {len(sets)} inertia sets ({', '.join(sets)}) is used; compare the others"))
        )
    rated = case.operation.rated_speed_rpm
    fastest = float(run.spectra.speed.max()) / RPM
    if rated is None:
        verdicts.append(CheckResult(False, "no rated speed; set rated_speed_rpm in [operation]"))
    elif fastest > BEYOND_RATED * rated:
        verdicts.append(CheckResult(False, f"speeds up to {figure_text(fastest / rated, 2)} times the rated speed"))
    return tuple(sorted(verdicts, key=lambda own: not own.passed))


def _check_run(run: VariantRun, figures: RunFigures) -> list[CheckResult]:
    residual, (pulling, apart, outside, _) = abs(figures.residual), figures.times
    verdicts = (
        []
        if math.isnan(residual)
        else [CheckResult(residual < ENERGY, f"energy balance closed to {100.0 * residual:.1g} %")]
    )
    doubtful = invalidity_of(run.attributes)
    if doubtful:
        verdicts.append(CheckResult(False, f"the run is invalid: {doubtful}"))
    for doubt in ("table_doubt", "band_doubt", "bearing_doubt"):
        if run.attributes.get(doubt):
            verdicts.append(CheckResult(False, str(run.attributes[doubt])))
    if pulling > 0.0:
        verdicts.append(CheckResult(False, f"tensile mesh force for {figure_text(pulling)} s (contact loss neglected)"))
    if apart > 0.0:
        verdicts.append(CheckResult(True, f"contact loss for {figure_text(apart)} s (included in the mesh model)"))
    if not pulling and not apart:
        verdicts.append(CheckResult(True, f"no tensile mesh force, {Variant.of(run.variant).label}"))
    if outside > 0.0:
        verdicts.append(
            CheckResult(
                False, (f"a mesh was outside the range of its table for {figure_text(outside)} s (extrapolated)")
            )
        )
    if not int(run.attributes["complete"]):
        verdicts.append(CheckResult(False, f"the run was aborted at {figure_text(figures.end)} s"))
    return verdicts


def _check_response(response: xr.Dataset) -> list[CheckResult]:
    error = float(np.nanmax(response["energy_error"]))
    growth = float(response.attrs["growth_rate"])
    verdicts = [
        CheckResult(
            error < STEADY_ENERGY,
            (f"energy balance closed to {100.0 * error:.1g} % (power supplied by the meshes = power dissipated)"),
        ),
        CheckResult(
            growth <= 0.0,
            "the steady state is stable" if growth <= 0.0 else "the steady state is unstable: disturbances grow",
        ),
    ]
    unsolved = json.loads(response.attrs["not_converged"])
    if unsolved:
        verdicts.append(CheckResult(False, f"no steady state found at {len(unsolved)} speeds (blank in the diagrams)"))
    remarks = [str(words) for words in response["remark"].to_numpy() if str(words)]
    if remarks:
        verdicts.append(CheckResult(False, f"{len(remarks)} speeds with warnings, first: {remarks[0]}"))
    for pull in () if LAWS[str(response.attrs["mesh_model"])].loses_contact else pulls(response):
        where = f"{pull.count} of {response.sizes['point']} speeds, longest at {abs(pull.speed) / RPM:.4g} rpm"
        said = f"tensile mesh force in {pull.mesh} at {where}: contact loss is neglected, amplitudes there are invalid"
        verdicts.append(CheckResult(False, said))
    if swings := bearing_swings(response):
        listed = ", ".join(
            f"{swing.bearing} {100.0 * swing.share:.0f} % ({abs(swing.speed) / RPM:.3g} rpm)" for swing in swings
        )
        said = f"dynamic over static load of bearings: {listed}. Outside the linear range; amplitudes are overestimated"
        verdicts.append(CheckResult(False, said))
    apart = float(np.nanmax(response["contact_loss_fraction"], initial=0.0))
    if apart > 0.0:
        verdicts.append(
            CheckResult(True, f"contact loss for up to {100.0 * apart:.2g} % of the time (included in the mesh model)")
        )
    return verdicts


def _check_resonances(group: RunGroup) -> list[CheckResult]:
    loudest = group.ranked[group.main][:CHECKED_RESONANCES]
    if not loudest:
        return []
    count = len(loudest)
    steady = sum(own.steady for own in loudest)
    verdicts: list[CheckResult] = []
    if not group.responses:
        passed = steady == count
        found = _fraction(steady, count, passed)
        verdicts.append(CheckResult(passed, f"{found} are found with all window lengths"))
    if group.runs[group.main].modes is None and not group.responses:
        return [*verdicts, CheckResult(False, "no modes computed; run `exugear modes` for mode shapes")]
    matched = sum(bool(own.finding.mode_name) for own in loudest)
    passed = matched >= MATCHED * count
    return [*verdicts, CheckResult(passed, f"{_fraction(matched, count, passed)} are at the frequency of a mode")]


def _fraction(number: int, count: int, passed: bool) -> str:
    """Return how many of the highest resonances a check found, as text."""
    found = f"{number} of the {count} highest resonances"
    if passed:
        return found
    return f"only {found}"
