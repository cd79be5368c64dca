"""Variations of assumed parameters: how they shift modes, and how much they could reduce an amplification.

Modes are tracked by their shapes. Where two modes veer, they exchange their character: the tracked mode may lose its
amplification while the other takes it over, without any benefit. Each tracked mode is therefore compared with the
largest amplification of all modes within an octave.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.named_files import Permissions
from exugear.report.findings.context import REFERENCE_VARIANT, Context
from exugear.results.folder import read_stored_gearbox
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.sensitivity import Parameter, ParameterVariation, assumed_parameters, vary_parameter
from exugear.system.statics import BalanceError
from fe_ste.tools.arrays import Floats
from fe_ste.tools.processes import stop_if_asked

if TYPE_CHECKING:
    import xarray as xr

OCTAVE = 2.0
"""Frequency ratio that limits the band around a mode, in both directions."""

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
    value: float
    default: float
    gain: float
    """Reduction of the largest amplification in the octave, dB; positive: lower."""
    span: float
    """Difference between its highest and its lowest value over the parameter, dB."""


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
    begun_models = {} if begun is None else begun.result()
    found = []
    for model in models:
        known = begun_models.get(model, {})
        variations = []
        for parameter in _parameters(context, model):
            figures = known[parameter.label] if parameter.label in known else _figures(parameter)
            if isinstance(figures, str):
                context.notes.left_out.append(f"sensitivity to {parameter.label}: {figures}")
            else:
                variations.append(ParameterVariation(parameter, *figures))
        found.append(ModelVariations(model, tuple(variations)))
    return tuple(found)


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


def variations_of(variations: Sequence[ModelVariations], choice: Choice) -> tuple[ParameterVariation, ...]:
    """Return the variations of one model; none if it is not varied."""
    return next((one.variations for one in variations if one.choice == choice), ())


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
    level = 20.0 * np.log10(np.maximum(track_mode(variation, frequency).loudest, 1e-300))
    index = int(np.argmin(level))
    gain = float(level[default_place(variation)] - level[index])
    parameter = variation.parameter
    return BestChange(parameter.label, parameter.values[index], parameter.default, gain, float(np.ptp(level)))
