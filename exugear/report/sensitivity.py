"""Part of the report on assumptions: how modes move with them, and which bring a mode to the target frequency."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from exugear.bearings.rolling.rows import BearingError
from exugear.dynamics.modes import modes_of
from exugear.dynamics.sensitivity import (
    FrequencyMatch,
    ParameterVariation,
    assumed_parameters,
    frequency_matches,
    vary_parameter,
)
from exugear.dynamics.statics import BalanceError
from exugear.model.choice import Choice
from exugear.pictures.mode_diagrams import Sensitivity, plot_sensitivities
from exugear.report import page
from exugear.report.context import REFERENCE_VARIANT, VISIBLE_SHARE, Context, file_part, words_of
from exugear.spectra.mode_report import nearest_mode, report_mode

PLOTTED_SHARE = 0.001
"""Least share of the overall transmission error's mobility for a mode to be drawn in a diagram of sensitivities."""
WINDOW = (0.45, 1.65)
"""Ends of the frequency axis of these diagrams over the target frequency."""


@dataclass(frozen=True)
class ModelMatch:
    """An assumption that brings a mode of a model to the target frequency."""

    model: Choice
    match: FrequencyMatch

    @property
    def assumption(self) -> str:
        """Parameter with its value."""
        return f"{self.match.parameter.label} = {self.match.value:.3g}"


def sensitivity_part(
    context: Context, modes: Mapping[Choice, xr.Dataset], target: float
) -> tuple[str, list[ModelMatch]]:
    """Diagrams of the sensitivities of the compliant models, and what brings a mode to the target (Hz)."""
    content: list[str] = []
    matches: list[ModelMatch] = []
    for model in _varied_models(context, modes):
        context.tell(f"sensitivities of {words_of(model)}")
        variations = _variations(context, model)
        if not variations:
            continue
        matches += [ModelMatch(model, match) for match in frequency_matches(variations, target, VISIBLE_SHARE)]
        content.append(_sensitivities_picture(context, model, variations, target))
        content.append(_damping_table(variations, target))
    part = page.section("Sensitivity to what was assumed", *content, level=3)
    return part + _matches_part(context, matches, target), matches


def _varied_models(context: Context, modes: Mapping[Choice, xr.Dataset]) -> list[Choice]:
    """Compliant models, or the only one there is; those of the default inertia set before others."""
    models = [model for model in modes if model.variant != REFERENCE_VARIANT] or list(modes)
    return sorted(models, key=lambda model: model.inertias != context.gearbox.case.default_inertias)


def _variations(context: Context, model: Choice) -> list[ParameterVariation]:
    stiffness = context.stiffness(model.mesh_law)
    parameters = assumed_parameters(context.gearbox, model, stiffness, context.bodies_of(model))
    variations = []
    for parameter in parameters:
        try:
            variations.append(vary_parameter(parameter))
        except (BalanceError, BearingError) as error:  # an assumption may leave the range in which bearings balance
            context.notes.left_out.append(f"sensitivity to {parameter.label}: {error}")
    return variations


def _sensitivities_picture(
    context: Context, model: Choice, variations: Sequence[ParameterVariation], target: float
) -> str:
    low, high = (part * target for part in WINDOW)
    plotted = [variation.near((low, high), PLOTTED_SHARE) for variation in variations]
    # Only what lies in the window sets the scale: modes far below are amplified a hundred times more.
    inside = [float(np.max(v.amplification, initial=0.0, where=v.frequency >= low)) for v in plotted]
    highest = max([*inside, 1e-12])
    path = context.picture_path(f"sensitivity-{file_part(model)}")
    plot_sensitivities(
        [
            Sensitivity(
                variation.parameter.label,
                np.array(variation.parameter.values),
                np.where((variation.frequency >= low) & (variation.frequency <= high), variation.frequency, np.nan),
                np.minimum(variation.amplification / highest, 1.0),
                variation.parameter.default,
                variation.parameter.logarithmic,
            )
            for variation in plotted
        ],
        path,
        target=target,
        window=(low, high),
        title=f"{words_of(model)}; size of the points: amplification, largest {highest:.1f}",
    )
    caption = (
        f"Eigenfrequencies of {words_of(model)}, each with all other inputs at their defaults; modes with a share over "
        f"{100 * PLOTTED_SHARE:g} % of the overall transmission error's mobility."
    )
    return page.picture(path, caption)


def _damping_table(variations: Sequence[ParameterVariation], target: float) -> str:
    """Amplification over mesh damping of the visible mode nearest to the target: its frequency hardly moves."""
    damping = next((v for v in variations if v.parameter.label.startswith("mesh damping")), None)
    visible = np.flatnonzero(damping.share[0] >= VISIBLE_SHARE) if damping else np.array([])
    if damping is None or not visible.size:
        return ""
    mode = int(visible[np.argmin(np.abs(damping.frequency[0, visible] - target))])
    rows = [
        {
            damping.parameter.label: f"{value:g}",
            "frequency / Hz": f"{damping.frequency[n, mode]:.1f}",
            "damping / %": f"{100 * damping.damping_ratio[n, mode]:.2f}",
            "amplification": f"{damping.amplification[n, mode]:.2f}",
        }
        for n, value in enumerate(damping.parameter.values)
    ]
    return page.folded(f"Mesh damping and the mode at {damping.frequency[0, mode]:.0f} Hz", page.table(rows))


def _matches_part(context: Context, matches: Sequence[ModelMatch], target: float) -> str:
    """Table of the assumptions that bring a mode to the target, or that none does."""
    if matches:
        context.notes.statements.append(
            f"Assumptions that bring a mode seen by the overall transmission error to {target:.0f} Hz: "
            + "; ".join(_match_words(match) for match in matches)
            + "."
        )
    rows = [_match_row(context, match, target) for match in matches]
    none = page.paragraph(f"No value in the ranges drawn brings a mode that is seen to {target:.0f} Hz.")
    title = f"Assumptions that bring a mode to {target:.0f} Hz"
    return page.section(title, page.table(rows, ("inertias", "assumption", "what moves")) or none, level=3)


def _match_words(found: ModelMatch) -> str:
    return (
        f"{found.assumption} instead of {found.match.parameter.default:g} "
        f"({words_of(found.model)}: {found.match.frequency:.0f} Hz)"
    )


def _match_row(context: Context, found: ModelMatch, target: float) -> dict[str, object]:
    model, match = found.model, found.match
    mode = report_mode(match.modes.to_dataset(), match.index)
    return {
        "variant": model.variant,
        "inertias": f"{model.inertias} ({model.mesh_law})",
        "assumption": f"{found.assumption}, default {match.parameter.default:g}",
        "frequency / Hz": f"{mode.frequency:.0f}",
        "share / %": f"{100 * mode.share:.1f}",
        "amplification": f"{mode.amplification:.2f} ({mode.mesh})",
        f"nearest seen in {REFERENCE_VARIANT} / Hz": f"{_reference_frequency(context, found, target):.0f}",
        "what moves": mode.name,
    }


def _reference_frequency(context: Context, found: ModelMatch, target: float) -> float:
    """Frequency (Hz) of the nearest visible mode of the reference variant under the same assumption."""
    model, match = found.model, found.match
    reference = replace(model, variant=REFERENCE_VARIANT)
    parameters = assumed_parameters(context.gearbox, reference, context.stiffness(model.mesh_law))
    same = next((parameter for parameter in parameters if parameter.label == match.parameter.label), None)
    assembly = same.build(match.value) if same else context.assembled(reference)
    nearest = nearest_mode(modes_of(assembly).to_dataset(), target, VISIBLE_SHARE)
    return nearest.frequency if nearest else math.nan
