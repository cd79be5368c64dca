"""Can this be trusted: checks that were passed, and things to mind."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass

import numpy as np
import xarray as xr

from exugear.gearbox.parts import RPM
from exugear.gearbox.variant import Variant
from exugear.report.findings.context import Context
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.words import figure_text
from exugear.results.run_file import read_run, verdict_of
from exugear.results.spectra.run_spectra import VariantRun
from exugear.steady.peaks import bearing_swings, pulls
from exugear.system.signals import BALANCE_TERMS, MESH_TIMES, energy_residual
from exugear.system.tooth_mesh.laws.registry import LAWS

LOUDEST = 10
"""Loudest resonances that checks look at."""
ENERGY = 1e-3
"""Share of energy that may be unaccounted for."""
MATCHED = 0.8
"""Least share of the loudest resonances that should match a mode."""
STEADY_ENERGY = 1e-4
"""Share of the power that damping takes by which that of the meshes may differ in a steady response."""
BEYOND_RATED = 1.3
"""Speed over the rated one from which a sweep is said to go beyond it."""


@dataclass(frozen=True)
class Verdict:
    """A check that was passed, or a thing to mind."""

    passed: bool
    words: str

    @property
    def line(self) -> str:
        """As a line of text."""
        return f"{'Passed' if self.passed else 'Mind'}: {self.words}"


@dataclass(frozen=True)
class RunFigures:
    """Figures that tell of one run's quality."""

    residual: float
    """Share of energy that is not accounted for."""
    times: tuple[float, ...]
    """Longest pull of a mesh, longest time that teeth are apart, outside a table, beside unsolved states of it, s."""
    end: float
    """Simulated time, s."""


def run_figures(run: VariantRun) -> RunFigures:
    """Read the figures of a run."""
    data, _ = read_run(run.path, ("time", *MESH_TIMES, *BALANCE_TERMS))
    times = tuple(float(np.max(data[name], initial=0.0)) for name in MESH_TIMES)
    return RunFigures(energy_residual(data), times, float(data["time"][-1]))


def verdicts_of(context: Context, group: RunGroup) -> tuple[Verdict, ...]:
    """Judge the main variant of a group; what was passed comes first."""
    case = context.gearbox.case
    run = group.runs[group.main]
    response = group.responses.get(group.main)
    own = _of_run(run, run_figures(run)) if response is None else _of_response(response)
    verdicts = [*own, *_of_resonances(group)]
    verdicts.append(
        Verdict(False, f"damping is assumed (meshes {1e6 * case.damping.mesh_time_s:g} µs): levels are only as good")
    )
    sets = context.gearbox.inertia_sets
    if len(sets) > 1:
        verdicts.append(Verdict(False, f"inertias are one of {len(sets)} sets ({', '.join(sets)}): see the others"))
    rated = case.operation.rated_speed_rpm
    fastest = float(run.spectra.speed.max()) / RPM
    if rated is None:
        verdicts.append(Verdict(False, "the case names no rated speed ([operation] rated_speed_rpm)"))
    elif fastest > BEYOND_RATED * rated:
        verdicts.append(Verdict(False, f"speeds go to {figure_text(fastest / rated, 2)} times the rated one"))
    return tuple(sorted(verdicts, key=lambda own: not own.passed))


def _of_run(run: VariantRun, figures: RunFigures) -> list[Verdict]:
    residual, (pulling, apart, outside, _) = abs(figures.residual), figures.times
    verdicts = (
        []
        if math.isnan(residual)
        else [Verdict(residual < ENERGY, f"the balance of energy closes within {100.0 * residual:.1g} %")]
    )
    doubtful = verdict_of(run.attributes)
    if doubtful:
        verdicts.append(Verdict(False, f"the run is not to be trusted: {doubtful}"))
    if run.attributes.get("bearing_doubt"):
        verdicts.append(Verdict(False, str(run.attributes["bearing_doubt"])))
    if pulling > 0.0:
        verdicts.append(Verdict(False, f"teeth had to pull for {figure_text(pulling)} s: they would have parted"))
    if apart > 0.0:
        verdicts.append(Verdict(True, f"teeth were apart for {figure_text(apart)} s, and the law knows it"))
    if not pulling and not apart:
        verdicts.append(Verdict(True, f"no tooth had to pull, {Variant.of(run.variant).label}"))
    if outside > 0.0:
        verdicts.append(Verdict(False, f"a mesh was outside its table for {figure_text(outside)} s"))
    if not int(run.attributes["complete"]):
        verdicts.append(Verdict(False, f"the run was stopped at {figure_text(figures.end)} s"))
    return verdicts


def _of_response(response: xr.Dataset) -> list[Verdict]:
    error = float(np.nanmax(response["energy_error"]))
    growth = float(response.attrs["growth_rate"])
    verdicts = [
        Verdict(error < STEADY_ENERGY, f"what damping takes is what the meshes give within {100.0 * error:.1g} %"),
        Verdict(growth <= 0.0, f"disturbances {'decay' if growth <= 0.0 else 'grow: the steady state does not last'}"),
    ]
    unsolved = json.loads(response.attrs["unsolved"])
    if unsolved:
        verdicts.append(Verdict(False, f"no steady state was found at {len(unsolved)} speeds, which are left blank"))
    remarks = [str(words) for words in response["remark"].to_numpy() if str(words)]
    if remarks:
        verdicts.append(Verdict(False, f"speeds with remarks: {len(remarks)}, the first: {remarks[0]}"))
    for pull in () if LAWS[str(response.attrs["mesh_law"])].loses_contact else pulls(response):
        where = f"{pull.count} of {response.sizes['point']} speeds, longest at {abs(pull.speed) / RPM:.4g} rpm"
        said = f"teeth of {pull.mesh} would have to pull at {where}: they would part, and levels there are not real"
        verdicts.append(Verdict(False, said))
    for swing in bearing_swings(response):
        said = (
            f"vibration takes up to {100.0 * swing.share:.0f} % of the static load of the bearing {swing.bearing} (at "
            f"{abs(swing.speed) / RPM:.4g} rpm): linear bearings make levels there too high"
        )
        verdicts.append(Verdict(False, said))
    apart = float(np.nanmax(response["apart_share"], initial=0.0))
    if apart > 0.0:
        verdicts.append(
            Verdict(True, f"teeth are apart for up to {100.0 * apart:.2g} % of the time, and the law knows")
        )
    return verdicts


def _of_resonances(group: RunGroup) -> list[Verdict]:
    loudest = group.ranked[group.main][:LOUDEST]
    if not loudest:
        return []
    count = len(loudest)
    steady = sum(own.steady for own in loudest)
    verdicts: list[Verdict] = []
    if not group.responses:
        verdicts.append(Verdict(steady == count, f"{steady} of the {count} loudest stay with windows of other lengths"))
    if group.runs[group.main].modes is None and not group.responses:
        return [*verdicts, Verdict(False, "no modes were computed (exugear modes): nothing tells what moves")]
    matched = sum(bool(own.finding.mode_name) for own in loudest)
    return [*verdicts, Verdict(matched >= MATCHED * count, f"{matched} of the {count} loudest match an eigenmode")]
