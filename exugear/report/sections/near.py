"""Section on modes near a frequency that the case or the user names, such as one that was measured."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.report.findings.context import REFERENCE_VARIANT, VISIBLE_SHARE, words_of
from exugear.report.parts.material import Material, Part
from exugear.report.web import pieces
from exugear.results.spectra.mode_report import NEAR, ModeReport, nearest_mode, report_mode
from exugear.system.eigenmodes.modes import modes_of
from exugear.system.eigenmodes.sensitivity import (
    FrequencyMatch,
    assumed_parameters,
    frequency_matches,
)


@dataclass(frozen=True)
class ModelMatch:
    """An assumption that brings a mode of a model to the target frequency."""

    model: Choice
    match: FrequencyMatch

    @property
    def assumption(self) -> str:
        """Parameter with its value."""
        return f"{self.match.parameter.label} = {self.match.value:.3g}"


def near_section(material: Material) -> Part:
    """Tell which modes lie near the target frequency, and which assumptions would bring one there."""
    target = material.context.target
    modes = material.results.modes
    if target is None or not modes:
        return Part("")
    rows = []
    for model, data in modes.items():
        nearest = nearest_mode(data, target)
        visible = nearest_mode(data, target, VISIBLE_SHARE)
        if nearest is None or visible is None:
            continue
        rows += [_row(material, model, data, mode, target) for mode in dict.fromkeys([nearest.index, visible.index])]
        material.context.notes.statements.append(_statement(model, data, nearest, visible, target))
    words = (
        "Share: of the mode in the mobility of the overall transmission error. Where the nearest mode has a share "
        f"under {100 * VISIBLE_SHARE:g} %, the nearest that has more stands below it. Near: within {100 * NEAR:g} %."
    )
    title = f"Modes near {target:.0f} Hz"
    table = pieces.table(rows, ("inertias", "what moves"), caption=title, name="near")
    html = pieces.section(title, pieces.paragraph(words, "note"), table, *_matches(material, target), name="target")
    return Part(html, {}, title, "target")


def _row(material: Material, model: Choice, data: xr.Dataset, index: int, target: float) -> dict[str, object]:
    mode = report_mode(data, index)
    return {
        "variant": model.variant,
        "inertias": f"{model.inertias} ({model.mesh_law})",
        "frequency / Hz": f"{mode.frequency:.1f}",
        "near": "yes" if mode.is_near(target) else "no",
        "damping / %": f"{100 * mode.damping_ratio:.2f}",
        "share / %": f"{100 * mode.share:.1f}",
        "amplification": f"{mode.amplification:.2f} ({material.words.of(mode.mesh)})",
        "what moves": material.words.moves(data, index),
    }


def _statement(model: Choice, data: xr.Dataset, nearest: ModeReport, visible: ModeReport, target: float) -> str:
    factor = float(data.attrs["housing_factor"])
    subject = f"Variant {words_of(model)}, housing factor {factor:g}"
    if visible.is_near(target):
        return (
            f"{subject}: a mode at {visible.frequency:.0f} Hz, near {target:.0f} Hz, which the overall transmission "
            f"error sees with a share of {100 * visible.share:.0f} % ({visible.name})."
        )
    if nearest.is_near(target):
        return (
            f"{subject}: a mode at {nearest.frequency:.0f} Hz, near {target:.0f} Hz, but the overall transmission "
            f"error hardly sees it (share {100 * nearest.share:.2g} %; {nearest.name})."
        )
    return (
        f"{subject}: no mode within {100 * NEAR:g} % of {target:.0f} Hz; the nearest that the overall transmission "
        f"error sees is at {visible.frequency:.0f} Hz ({visible.name})."
    )


def _matches(material: Material, target: float) -> Iterator[str]:
    """Table of the assumptions that bring a mode to the target, or that none does."""
    modelmatchs = [
        ModelMatch(variation.choice, match)
        for variation in material.variations
        for match in frequency_matches(variation.variations, target, VISIBLE_SHARE)
    ]
    yield pieces.element("h3", f"Assumptions that bring a mode to {target:.0f} Hz")
    if not modelmatchs:
        yield pieces.paragraph(f"No value in the ranges varied brings a mode that is seen to {target:.0f} Hz.")
        return
    told = "; ".join(
        f"{modelmatch.assumption} instead of {modelmatch.match.parameter.default:g} ({words_of(modelmatch.model)}: "
        f"{modelmatch.match.frequency:.0f} Hz)"
        for modelmatch in modelmatchs
    )
    material.context.notes.statements.append(
        f"Assumptions that bring a mode seen by the overall transmission error to {target:.0f} Hz: {told}."
    )
    rows = [_match_row(material, modelmatch, target) for modelmatch in modelmatchs]
    yield pieces.table(rows, ("inertias", "assumption", "what moves"), caption="Assumptions", name="matches")


def _match_row(material: Material, found: ModelMatch, target: float) -> dict[str, object]:
    match = found.match
    data = match.modes.to_dataset()
    mode = report_mode(data, match.index)
    return {
        "variant": found.model.variant,
        "inertias": f"{found.model.inertias} ({found.model.mesh_law})",
        "assumption": material.words.change(match.parameter.label, match.value, match.parameter.default),
        "frequency / Hz": f"{mode.frequency:.0f}",
        "share / %": f"{100 * mode.share:.1f}",
        "amplification": f"{mode.amplification:.2f} ({material.words.of(mode.mesh)})",
        f"nearest seen in {REFERENCE_VARIANT} / Hz": f"{_reference_frequency(material, found, target):.0f}",
        "what moves": material.words.moves(data, match.index),
    }


def _reference_frequency(material: Material, found: ModelMatch, target: float) -> float:
    """Frequency (Hz) of the nearest visible mode of the reference variant under the same assumption."""
    context = material.context
    match = found.match
    reference = replace(found.model, variant=REFERENCE_VARIANT)
    parameters = assumed_parameters(context.gearbox, reference, context.stiffness(found.model.mesh_law))
    same = next((parameter for parameter in parameters if parameter.label == match.parameter.label), None)
    assembly = same.build(match.value) if same else context.assembled(reference)
    nearest = nearest_mode(modes_of(assembly).to_dataset(), target, VISIBLE_SHARE)
    if nearest:
        return nearest.frequency
    return math.nan
