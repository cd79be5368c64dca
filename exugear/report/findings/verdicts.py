"""Validity checks of results, and variations of assumed parameters.

Modes are tracked by their shapes. Where two modes veer, they exchange their character: the tracked mode may lose its
amplification while the other takes it over, without any benefit. Each tracked mode is therefore compared with the
largest amplification of all modes within an octave.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.named_files import Permissions
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.report.findings.context import REFERENCE_VARIANT, Context
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.words import figure_text
from exugear.results.folder import read_stored_gearbox
from exugear.results.run_file import invalidity_of, read_run
from exugear.results.spectra.run_spectra import VariantRun
from exugear.steady.peaks import bearing_swings, pulls
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.modal_damping import damping_in_words
from exugear.system.sensitivity import Parameter, ParameterVariation, assumed_parameters, vary_parameter
from exugear.system.signals import BALANCE_TERMS, MESH_TIMES, energy_residual
from exugear.system.statics import BalanceError
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.arrays import Floats
from fe_ste.tools.threads import stop_if_asked

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


# Variation of assumed parameters over their ranges, and the possible reduction of amplification

OCTAVE = 2.0
"""Frequency ratio that limits the band around a mode, in both directions."""
GAIN = 3.0
"""Minimum gain (dB) that counts as a reduction."""

Figures = tuple[Floats, Floats, Floats, Floats]
"""Frequency, TE participation, amplification and damping ratio of a `ParameterVariation`."""
VariedModels = Mapping[Choice, Mapping[str, Figures | str]]
"""By model and label of the parameter: the values of the variation, or the reason why there are none."""


@dataclass(frozen=True)
class ModelVariations:
    """Variations of one model."""

    choice: Choice
    variations: tuple[ParameterVariation, ...]


@dataclass(frozen=True)
class TrackedMode:
    """Mode over a parameter, with the largest amplification of the modes near it."""

    frequency: Floats
    amplification: Floats
    """(n,) of the mode tracked by its shape, Hz and m/m."""
    loudest: Floats
    """(n,) largest amplification of all modes within an octave of its frequency at the default value."""


@dataclass(frozen=True)
class BestChange:
    """Parameter change that minimises the largest amplification within an octave of a mode."""

    label: str
    """Label of the parameter."""
    value: float
    default: float
    gain: float
    """Reduction of the largest amplification in the octave, dB; positive: lower."""


def begin_variations(context: Context, modes: Mapping[Choice, xr.Dataset], executor: Executor) -> Future[VariedModels]:
    """Start the variations of all models on an executor (possibly another process) while this process reads run-ups."""
    below = context.gearbox.permissions.below
    return executor.submit(varied_models, context.folder, below, _models_to_vary(context, modes))


def varied_models(folder: Path, allow_dir: Path | None, models: Sequence[Choice]) -> VariedModels:
    """Vary the assumed parameters of models of the gearbox file stored in a folder; for `begin_variations`."""
    context = Context(folder, read_stored_gearbox(folder, Permissions(below=allow_dir)), None, lambda what: None)
    return {
        model: {parameter.label: _figures(parameter) for parameter in _parameters(context, model)} for model in models
    }


def model_variations(
    context: Context, modes: Mapping[Choice, xr.Dataset], begun: Future[VariedModels] | None = None
) -> tuple[ModelVariations, ...]:
    """Vary the assumed parameters of the compliant models, or of the only model; the default inertia set comes first.

    Parameters
    ----------
    modes : by the available models
    begun : result of `begin_variations`
    """
    models = _models_to_vary(context, modes)
    for model in models:
        context.tell(f"variations of {model.variant}, {model.inertias}")
    known = {} if begun is None else begun.result()
    return tuple(ModelVariations(model, _variations(context, model, known.get(model, {}))) for model in models)


def _models_to_vary(context: Context, modes: Mapping[Choice, xr.Dataset]) -> list[Choice]:
    models = [model for model in modes if model.variant != REFERENCE_VARIANT] or list(modes)
    return sorted(models, key=lambda model: model.inertias != context.gearbox.case.default_inertias)


def _parameters(context: Context, model: Choice) -> tuple[Parameter, ...]:
    stiffness = context.stiffness(model.mesh_model)
    return assumed_parameters(context.gearbox, model, stiffness, context.bodies_of(model))


def _figures(parameter: Parameter) -> Figures | str:
    """Vary a parameter; return the reason if a value leaves the range in which bearings reach equilibrium."""
    try:
        found = vary_parameter(parameter, stop_if_asked)
    except (BalanceError, BearingError) as error:
        return str(error)
    return found.frequency, found.share, found.amplification, found.damping_ratio


def _variations(context: Context, model: Choice, known: Mapping[str, Figures | str]) -> tuple[ParameterVariation, ...]:
    variations = []
    for parameter in _parameters(context, model):
        figures = known[parameter.label] if parameter.label in known else _figures(parameter)
        if isinstance(figures, str):
            context.notes.left_out.append(f"sensitivity to {parameter.label}: {figures}")
        else:
            variations.append(ParameterVariation(parameter, *figures))
    return tuple(variations)


def default_place(variation: ParameterVariation) -> int:
    """Return the index of the gearbox file's value among the values of a variation."""
    return int(np.argmin(np.abs(np.array(variation.parameter.values) - variation.parameter.default)))


def track_mode(variation: ParameterVariation, frequency: float) -> TrackedMode:
    """Track the mode at a frequency (Hz, at the default value), with the largest amplification within an octave."""
    place = default_place(variation)
    mode = int(np.argmin(np.abs(variation.frequency[place] - frequency)))
    centre = float(variation.frequency[place, mode])
    inside = (variation.frequency > centre / OCTAVE) & (variation.frequency < centre * OCTAVE)
    loudest = np.where(inside, variation.amplification, 0.0).max(axis=1)
    return TrackedMode(variation.frequency[:, mode], variation.amplification[:, mode], loudest)


def best_change(variation: ParameterVariation, frequency: float) -> BestChange:
    """Find the parameter value with the smallest maximum amplification within an octave of a mode."""
    loudest = track_mode(variation, frequency).loudest
    index = int(np.argmin(loudest))
    gain = 20.0 * np.log10(max(loudest[default_place(variation)], 1e-300) / max(loudest[index], 1e-300))
    parameter = variation.parameter
    return BestChange(parameter.label, parameter.values[index], parameter.default, float(gain))
