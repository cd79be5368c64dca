"""How modes move with what was assumed, over whole ranges, and whether anything grows quieter by it.

Modes are followed by their shapes. Where two of them come near they swap what they do: the followed one may lose its
amplification while another one takes it over, and nothing is won. So each followed mode stands beside the loudest of
all modes within an octave.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

from exugear.bearings.rolling.rows import BearingError
from exugear.dynamics.sensitivity import ParameterVariation, assumed_parameters, vary_parameter
from exugear.dynamics.statics import BalanceError
from exugear.findings.context import REFERENCE_VARIANT, Context
from exugear.model.choice import Choice
from fe_ste.tools.arrays import Floats

OCTAVE = 2.0
"""Reach around a frequency, as a ratio, to both sides."""
GAIN = 3.0
"""Least gain (dB) that is called one."""


@dataclass(frozen=True)
class ModelVariations:
    """Variations of one model.

    Attributes
    ----------
    choice : Choice
    variations : tuple of ParameterVariation
    """

    choice: Choice
    variations: tuple[ParameterVariation, ...]


@dataclass(frozen=True)
class Guarded:
    """A mode over a parameter, beside the loudest mode near it.

    Attributes
    ----------
    frequency, amplification : (n,) arrays
        Of the mode that is followed by its shape, Hz and m/m.
    loudest : (n,) array
        Amplification of the loudest of all modes within an octave of its frequency at the default value.
    """

    frequency: Floats
    amplification: Floats
    loudest: Floats


@dataclass(frozen=True)
class BestChange:
    """The change of an assumption that makes what lies within an octave of a mode quietest.

    Attributes
    ----------
    label : str
        Of the parameter.
    value, default : float
    gain : float
        Of the loudest mode in the octave, dB; above zero is quieter.
    """

    label: str
    value: float
    default: float
    gain: float


def model_variations(context: Context, modes: Mapping[Choice, xr.Dataset]) -> tuple[ModelVariations, ...]:
    """Vary what was assumed in the compliant models, or in the only one there is; the default inertia set first."""
    models = [model for model in modes if model.variant != REFERENCE_VARIANT] or list(modes)
    models.sort(key=lambda model: model.inertias != context.gearbox.case.default_inertias)
    return tuple(ModelVariations(model, _variations(context, model)) for model in models)


def _variations(context: Context, model: Choice) -> tuple[ParameterVariation, ...]:
    context.tell(f"variations of {model.variant}, {model.inertias}")
    stiffness = context.stiffness(model.mesh_law)
    variations = []
    for parameter in assumed_parameters(context.gearbox, model, stiffness, context.bodies_of(model)):
        try:
            variations.append(vary_parameter(parameter))
        except (BalanceError, BearingError) as error:  # an assumption may leave the range in which bearings balance
            context.notes.left_out.append(f"sensitivity to {parameter.label}: {error}")
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
    place = int(np.argmin(loudest))
    gain = 20.0 * np.log10(max(loudest[default_place(variation)], 1e-300) / max(loudest[place], 1e-300))
    parameter = variation.parameter
    return BestChange(parameter.label, parameter.values[place], parameter.default, float(gain))
