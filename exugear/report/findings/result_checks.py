"""Validity checks of results: energy balance, convergence, resonances that match modes, speeds and damping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exugear.gearbox.units import RPM
from exugear.report.findings.context import Context
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.words import figure_text
from exugear.results.findings import Finding, check_finding, run_findings
from exugear.results.run_file import read_run
from exugear.results.spectra.run_spectra import VariantRun
from exugear.steady.findings import response_findings
from exugear.system.modal_damping import damping_in_words
from exugear.system.part_warnings import excitation_warnings
from exugear.system.signals import BALANCE_TERMS, MESH_TIMES, energy_residual

CHECKED_RESONANCES = 10
"""Number of highest resonances that are checked."""
MATCHED = 0.8
"""Minimum fraction of the highest resonances that should match a mode."""
BEYOND_RATED = 1.3
"""Ratio to the rated speed above which the page warns of speeds beyond it."""


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


def validity_checks(context: Context, group: RunGroup) -> tuple[Finding, ...]:
    """Check the main variant of a group; passed checks come first."""
    case = context.gearbox.case
    run = group.runs[group.main]
    response = group.responses.get(group.main)
    if response is None:
        figures = run_figures(run)
        findings = [*run_findings(run.attributes, figures.residual, dict(zip(MESH_TIMES, figures.times, strict=True)))]
        if not int(run.attributes["complete"]):
            findings.append(Finding("warning", f"the run was aborted at {figure_text(figures.end)} s"))
    else:
        findings = [*response_findings(response)]
    findings += _check_resonances(group)
    text = f"damping is assumed ({damping_in_words(case.damping)}). Resonance amplitudes depend on it directly"
    findings.append(Finding("warning", text))
    sets = context.gearbox.inertia_sets
    if len(sets) > 1:
        text = f"one of {len(sets)} inertia sets ({', '.join(sets)}) is used; compare the others"
        findings.append(Finding("warning", text))
    findings += [Finding("warning", text) for text in excitation_warnings(context.gearbox)]
    rated = case.operation.rated_speed_rpm
    fastest = float(run.spectra.speed.max()) / RPM
    if rated is None:
        findings.append(Finding("warning", "no rated speed; set rated_speed_rpm in [operation]"))
    elif fastest > BEYOND_RATED * rated:
        text = f"the highest computed speed is {figure_text(fastest / rated, 2)} times the rated speed"
        findings.append(Finding("warning", f"{text}; speeds outside the operating range are not ranked"))
    return tuple(sorted(findings, key=lambda own: not own.passed))


def _check_resonances(group: RunGroup) -> list[Finding]:
    loudest = group.ranked[group.main][:CHECKED_RESONANCES]
    if not loudest:
        return []
    count = len(loudest)
    steady = sum(own.steady for own in loudest)
    findings: list[Finding] = []
    if not group.responses:
        passed = steady == count
        found = _fraction(steady, count, passed)
        findings.append(check_finding(passed, f"{found} are found with all window lengths"))
    if group.runs[group.main].modes is None and not group.responses:
        return [*findings, Finding("warning", "no modes computed; run exugear modes for mode shapes")]
    matched = sum(bool(own.finding.mode_name) for own in loudest)
    passed = matched >= MATCHED * count
    return [*findings, check_finding(passed, f"{_fraction(matched, count, passed)} are at the frequency of a mode")]


def _fraction(number: int, count: int, passed: bool) -> str:
    """Return how many of the highest resonances a check found, as text."""
    found = f"{number} of the {count} highest resonances"
    return found if passed else f"only {found}"
