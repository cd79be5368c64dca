"""How modes move with what was assumed, over whole ranges, and whether anything grows quieter by it.

Modes are followed by their shapes. Where two of them come near they swap what they do: the followed one may lose its
amplification while another one takes it over, and nothing is won. So each followed mode stands beside the loudest of
all modes within an octave.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.named_files import Permissions
from exugear.report.findings.context import REFERENCE_VARIANT, Context
from exugear.results.folder import kept_case
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.eigenmodes.sensitivity import (
    Parameter,
    ParameterVariation,
    assumed_parameters,
    vary_parameter,
)
from exugear.system.statics import BalanceError
from fe_ste.tools.arrays import Floats
from fe_ste.tools.workers import stop_if_asked

OCTAVE = 2.0
"""Reach around a frequency, as a ratio, to both sides."""
GAIN = 3.0
"""Least gain (dB) that is called one."""

Figures = tuple[Floats, Floats, Floats, Floats]
"""Frequency, share, amplification and damping ratio of a `ParameterVariation`."""
VariedModels = Mapping[Choice, Mapping[str, Figures | str]]
"""By model and label of the parameter, its figures or why there are none."""


@dataclass(frozen=True)
class ModelVariations:
    """Variations of one model."""

    choice: Choice
    variations: tuple[ParameterVariation, ...]


@dataclass(frozen=True)
class Guarded:
    """A mode over a parameter, beside the loudest mode near it."""

    frequency: Floats
    amplification: Floats
    """(n,) of the mode that is followed by its shape, Hz and m/m."""
    loudest: Floats
    """(n,) amplification of the loudest of all modes within an octave of its frequency at the default value."""


@dataclass(frozen=True)
class BestChange:
    """The change of an assumption that makes what lies within an octave of a mode quietest."""

    label: str
    """Of the parameter."""
    value: float
    default: float
    gain: float
    """Of the loudest mode in the octave, dB; above zero is quieter."""


def begin_variations(context: Context, modes: Mapping[Choice, xr.Dataset], executor: Executor) -> Future[VariedModels]:
    """Have all models varied by an executor, which may be another process, while this one reads run-ups."""
    below = context.gearbox.permissions.below
    return executor.submit(varied_models, context.folder, below, _models_to_vary(context, modes))


def varied_models(folder: Path, files_below: Path | None, models: Sequence[Choice]) -> VariedModels:
    """Vary what was assumed in models of the case that a folder keeps: for `begin_variations`."""
    context = Context(folder, kept_case(folder, Permissions(below=files_below)), None, lambda what: None)
    return {
        model: {parameter.label: _figures(parameter) for parameter in _parameters(context, model)} for model in models
    }


def model_variations(
    context: Context, modes: Mapping[Choice, xr.Dataset], begun: Future[VariedModels] | None = None
) -> tuple[ModelVariations, ...]:
    """Vary what was assumed in the compliant models, or in the only one there is; the default inertia set first.

    Parameters
    ----------
    modes : of the models that there are
    begun : what `begin_variations` gave
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
    stiffness = context.stiffness(model.mesh_law)
    return assumed_parameters(context.gearbox, model, stiffness, context.bodies_of(model))


def _figures(parameter: Parameter) -> Figures | str:
    """Vary a parameter; the reason where an assumption leaves the range in which bearings balance."""
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
    """Place of the case's own value among those of a variation."""
    return int(np.argmin(np.abs(np.array(variation.parameter.values) - variation.parameter.default)))


def guarded(variation: ParameterVariation, frequency: float) -> Guarded:
    """Follow the mode of a frequency (Hz, at the default value) and set the loudest of its octave beside it."""
    place = default_place(variation)
    mode = int(np.argmin(np.abs(variation.frequency[place] - frequency)))
    centre = float(variation.frequency[place, mode])
    inside = (variation.frequency > centre / OCTAVE) & (variation.frequency < centre * OCTAVE)
    loudest = np.where(inside, variation.amplification, 0.0).max(axis=1)
    return Guarded(variation.frequency[:, mode], variation.amplification[:, mode], loudest)


def best_change(variation: ParameterVariation, frequency: float) -> BestChange:
    """Find the value that makes what lies within an octave of a mode quietest."""
    loudest = guarded(variation, frequency).loudest
    index = int(np.argmin(loudest))
    gain = 20.0 * np.log10(max(loudest[default_place(variation)], 1e-300) / max(loudest[index], 1e-300))
    parameter = variation.parameter
    return BestChange(parameter.label, parameter.values[index], parameter.default, float(gain))
