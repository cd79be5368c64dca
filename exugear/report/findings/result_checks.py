"""Validity checks of results: energy balance, convergence, resonances that match modes, speeds and damping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exugear.gearbox.load_cases import operating_range
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
BEYOND_OPERATION = 1.05
"""Ratio to the highest operating speed above which the page warns of speeds beyond it."""


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
    if case.operation.rated_speed_rpm is None:
        findings.append(Finding("warning", "no rated speed; set rated_speed_rpm in [operation]"))
    operation = operating_range(context.gearbox)
    fastest = float(run.spectra.speed.max())
    if operation is not None and fastest > BEYOND_OPERATION * operation[1]:
        text = f"the highest computed speed is {figure_text(fastest / operation[1], 2)} times the highest operating "
        findings.append(Finding("warning", f"{text}speed; speeds outside the operating range are not ranked"))
    return tuple(sorted(findings, key=lambda own: not own.passed))


def _check_resonances(group: RunGroup) -> list[Finding]:
    loudest = group.ranked[group.main][:CHECKED_RESONANCES]
    if not loudest:
        return []
    count = len(loudest)
    findings: list[Finding] = []
    if not group.responses:
        steady = sum(own.steady for own in loudest)
        findings.append(share_check(steady, count, steady == count, "found with all window lengths"))
    if group.runs[group.main].modes is None and not group.responses:
        return [*findings, Finding("warning", "no modes computed; run exugear modes for mode shapes")]
    matched = sum(bool(own.finding.mode_name) for own in loudest)
    return [*findings, share_check(matched, count, matched >= MATCHED * count, "at the frequency of a mode")]


def share_check(number: int, count: int, passed: bool, what: str) -> Finding:
    """Return the check of how many of the highest resonances are `what`."""
    if count == 1:
        return check_finding(passed, f"the highest resonance is {'' if number else 'not '}{what}")
    only = "" if passed else "only "
    return check_finding(passed, f"{only}{number} of the {count} highest resonances are {what}")
