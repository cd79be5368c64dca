"""Sections "Modes and orders" (Campbell diagrams, lists of modes) and "Design sensitivity" (frequency shifts)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.variant import Variant
from exugear.report.findings.context import MESH_MODEL_LABELS, REFERENCE_VARIANT, VISIBLE_SHARE, model_label
from exugear.report.findings.facts import best_words, sensitivities_of, shift_text
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.headline import headline_of_group
from exugear.report.findings.parameter_variations import best_change, track_mode
from exugear.report.findings.words import figure_text, percentages
from exugear.report.sections.material import ChartAxis, Curve, Part, ReportData, model_name
from exugear.report.web.document import rounded
from exugear.report.web.html import Cell, Figure, Table, render
from exugear.report.web.stage import stage_data
from exugear.results.spectra.run_spectra import NEAR, ModeReport, nearest_mode, report_mode
from exugear.system.modes import modes_of
from exugear.system.sensitivity import FrequencyMatch, ParameterVariation, assumed_parameters, frequency_matches

DEFORMED = 32
"""Number of modes in which flexible bodies deform on the page: those of resonances, and the most visible ones."""


def modes_section(material: ReportData) -> Part:
    """Show Campbell diagram and list of modes of all models."""
    modes = material.results.modes
    if not modes:
        return Part()
    for model, data in modes.items():
        growth = float(data.attrs["growth_rate"])
        if growth > 0.0:
            unstable = f"{model_label(model)}: unstable, disturbances grow at up to {growth:.3g} 1/s."
            material.context.notes.statements.append(unstable)
    models = {model_name(model): _model(material, model, data) for model, data in modes.items()}
    lists = [_all_modes(material, model, data) for model, data in modes.items()]
    # Without run-ups, no other section has the animated mode shapes.
    html = render("modes", alone=not material.groups, lists=lists)
    return Part(html, {"models": models}, "Modes", "modes")


def _model(material: ReportData, model: Choice, data: xr.Dataset) -> dict[str, Any]:
    material.context.tell(f"bodies and modes of {model_label(model)}")
    assembly = material.context.assembled(model)
    reports = [report_mode(data, index) for index in range(data.sizes["mode"])]
    labels = material.words.labels
    return {
        "words": model_label(model),
        "variant": model.variant,
        "stage": stage_data(
            assembly, data["shape"].to_numpy(), labels, material.arrays, _deformed(material, model, data)
        ),
        "modes": [
            {
                "frequency": rounded(report.frequency, 6),
                "damping": rounded(report.damping_ratio, 4),
                "words": material.words.moves(data, report.index),
            }
            for report in reports
        ],
    }


def _deformed(material: ReportData, model: Choice, data: xr.Dataset) -> set[int]:
    if not model.variant.is_elastic:
        return set()
    matched = {
        own.finding.mode
        for group in material.groups
        if model.variant in group.runs and group.choice(model.variant) == model
        for own in group.ranked[model.variant]
        if own.finding.mode is not None
    }
    reports = [report_mode(data, index) for index in range(data.sizes["mode"])]
    seen = sorted((report for report in reports if report.share >= VISIBLE_SHARE), key=lambda one: -one.amplification)
    most = [*sorted(matched), *(one.index for one in seen if one.index not in matched)]
    return set(most[: max(DEFORMED, len(matched))])


def _all_modes(material: ReportData, model: Choice, data: xr.Dataset) -> Table:
    reports = [report_mode(data, index) for index in range(data.sizes["mode"])]
    rows = [
        {
            "No.": Cell(str(mode.index + 1), mode.index + 1),
            "Frequency / Hz": Cell(f"{mode.frequency:.1f}", mode.frequency, f"mode:{model_name(model)}:{mode.index}"),
            "Damping / %": Cell(f"{100 * mode.damping_ratio:.2f}", 100 * mode.damping_ratio),
            "TE participation / %": Cell(f"{100 * mode.share:.2f}", 100 * mode.share),
            "Amplification": Cell(f"{mode.amplification:.2f}", mode.amplification),
            "by mesh": material.words.of(mode.mesh) if mode.amplification >= 0.01 else "–",
            "Mode shape": material.words.moves(data, mode.index),
            "Strain energy": percentages(material.words.strain_energy(data, mode.index)),
        }
        for mode in reports
    ]
    return Table(
        rows,
        ("by mesh", "Mode shape", "Strain energy"),
        caption=f"All {len(rows)} modes of {model_label(model)}",
        name=f"modes-{model_name(model)}",
        hidden=("TE participation / %", "by mesh"),
        sortable=True,
    )


# Section on modes near a target frequency from the gearbox file or the command line, such as a measured one


@dataclass(frozen=True)
class ModelMatch:
    """Parameter change that shifts a mode of a model to the target frequency."""

    model: Choice
    match: FrequencyMatch

    @property
    def assumption(self) -> str:
        """Parameter with its value."""
        return f"{self.match.parameter.label} = {self.match.value:.3g}"


def target_frequency_section(material: ReportData) -> Part:
    """List the modes near the target frequency, and parameter changes that would shift a mode there."""
    target = material.context.target
    modes = material.results.modes
    if target is None or not modes:
        return Part()
    rows = []
    for model, data in modes.items():
        nearest = nearest_mode(data, target)
        visible = nearest_mode(data, target, VISIBLE_SHARE)
        if nearest is None or visible is None:
            continue
        rows += [_row(material, model, data, mode, target) for mode in dict.fromkeys([nearest.index, visible.index])]
        material.context.notes.statements.append(_statement(model, data, nearest, visible, target))
    html = render(
        "target",
        target=target,
        near=Table(rows, ("inertia set", "mode shape"), caption=f"Modes near {target:.0f} Hz", name="near"),
        visible=100 * VISIBLE_SHARE,
        within=100 * NEAR,
        matches=Table(
            _matches(material, target),
            ("inertia set", "assumption", "mode shape"),
            caption="Assumptions",
            name="matches",
        ),
    )
    return Part(html, title=f"Modes near {target:.0f} Hz", name="target")


def _row(material: ReportData, model: Choice, data: xr.Dataset, index: int, target: float) -> dict[str, object]:
    mode = report_mode(data, index)
    return {
        "variant": model.variant,
        "inertia set": f"{model.inertias} ({MESH_MODEL_LABELS[model.mesh_model]})",
        "frequency / Hz": f"{mode.frequency:.1f}",
        "near": "yes" if mode.is_near(target) else "no",
        "damping / %": f"{100 * mode.damping_ratio:.2f}",
        "TE part. / %": f"{100 * mode.share:.1f}",
        "amplification": Cell(f"{mode.amplification:.2f} ({material.words.of(mode.mesh)})", mode.amplification),
        "mode shape": material.words.moves(data, index),
    }


def _statement(model: Choice, data: xr.Dataset, nearest: ModeReport, visible: ModeReport, target: float) -> str:
    factor = float(data.attrs["housing_factor"])
    subject = f"Variant {model_label(model)}, housing stiffness factor {factor:g}"
    if visible.is_near(target):
        return (
            f"{subject}: mode at {visible.frequency:.0f} Hz near {target:.0f} Hz, TE participation "
            f"{100 * visible.share:.0f} % ({visible.name})."
        )
    if nearest.is_near(target):
        return (
            f"{subject}: mode at {nearest.frequency:.0f} Hz near {target:.0f} Hz, but with negligible TE "
            f"participation ({100 * nearest.share:.2g} %; {nearest.name})."
        )
    return (
        f"{subject}: no mode within {100 * NEAR:g} % of {target:.0f} Hz; the nearest mode with TE participation is at "
        f"{visible.frequency:.0f} Hz ({visible.name})."
    )


def _matches(material: ReportData, target: float) -> list[dict[str, object]]:
    """Return the rows of the parameter changes that shift a mode to the target."""
    found = [
        ModelMatch(variation.choice, match)
        for variation in material.variations
        for match in frequency_matches(variation.variations, target, VISIBLE_SHARE)
    ]
    if found:
        entries = "; ".join(
            f"{own.assumption} instead of {own.match.parameter.default:g} ({model_label(own.model)}: "
            f"{own.match.frequency:.0f} Hz)"
            for own in found
        )
        material.context.notes.statements.append(
            f"Assumptions that shift a mode with TE participation to {target:.0f} Hz: {entries}."
        )
    return [_match_row(material, own, target) for own in found]


def _match_row(material: ReportData, found: ModelMatch, target: float) -> dict[str, object]:
    match = found.match
    data = match.modes.to_dataset()
    mode = report_mode(data, match.index)
    return {
        "variant": found.model.variant,
        "inertia set": f"{found.model.inertias} ({MESH_MODEL_LABELS[found.model.mesh_model]})",
        "assumption": material.words.change(match.parameter.label, match.value, match.parameter.default),
        "frequency / Hz": f"{mode.frequency:.0f}",
        "TE part. / %": f"{100 * mode.share:.1f}",
        "amplification": Cell(f"{mode.amplification:.2f} ({material.words.of(mode.mesh)})", mode.amplification),
        (
            f"nearest with TE participation in {REFERENCE_VARIANT} / Hz"
        ): f"{_reference_frequency(material, found, target):.0f}",
        "mode shape": material.words.moves(data, match.index),
    }


def _reference_frequency(material: ReportData, found: ModelMatch, target: float) -> float:
    """Return the frequency (Hz) of the nearest visible mode of the reference variant with the same parameter value."""
    context = material.context
    match = found.match
    reference = replace(found.model, variant=REFERENCE_VARIANT)
    parameters = assumed_parameters(context.gearbox, reference, context.stiffness(found.model.mesh_model))
    same = next((parameter for parameter in parameters if parameter.label == match.parameter.label), None)
    assembly = same.build(match.value) if same else context.assembled(reference)
    nearest = nearest_mode(modes_of(assembly).to_dataset(), target, VISIBLE_SHARE)
    if nearest:
        return nearest.frequency
    return math.nan


# Section "Design sensitivity": first-order shifts of the mode with the highest resonance, and full variations

SHOWN_SENSITIVITIES = 8
"""Maximum number of parameters of each kind in the table."""


def change_section(material: ReportData) -> Part:
    """Show the sensitivity of the mode of the first resonance in the ranking of each group."""
    content = list(filter(None, (_group(material, group) for group in material.groups)))
    if not content:
        return Part()
    return Part(render("change", groups=content), title="Design sensitivity", name="change")


def _group(material: ReportData, group: RunGroup) -> dict[str, Any] | None:
    own = headline_of_group(group)
    found = own.mode_of(own.top) if own.top else None
    modes = own.modes
    if found is None or modes is None:
        return None
    mode = found.index
    frequency = float(modes["frequency"][mode])
    scope = (
        f"For the mode at {frequency:.1f} Hz {Variant.of(group.main).label}, inertia set {group.inertias}: "
        f"{material.words.moves(modes, mode)}."
    )
    varied = next((one.variations for one in material.variations if one.choice == own.choice), ())
    return {
        "name": group.name,
        "scope": scope,
        "table": _sensitivity_table(material, group, modes, mode),
        "variations": [
            _variation(material, f"variation-{group.name}-{number}", variation, frequency)
            for number, variation in enumerate(varied)
        ],
    }


def _sensitivity_table(material: ReportData, group: RunGroup, modes: xr.Dataset, mode: int) -> Table:
    sensitivities = sensitivities_of(material.words, modes, mode)
    largest = max((abs(sensitivity.shift) for sensitivity in sensitivities), default=1.0)
    kinds = [
        [sensitivity for sensitivity in sensitivities if sensitivity.kind == kind][:SHOWN_SENSITIVITIES]
        for kind in ("stiffness", "inertia")
    ]
    rows = [
        {
            "+10 %": sensitivity.kind,
            "of": sensitivity.what,
            "energy fraction / %": Cell(f"{100.0 * sensitivity.share:.1f}", 100.0 * sensitivity.share),
            "frequency shift / Hz": Cell(
                shift_text(sensitivity), sensitivity.shift, bar=abs(sensitivity.shift) / largest
            ),
        }
        for own in kinds
        for sensitivity in own
    ]
    caption = "First-order frequency shifts of the mode of the first resonance"
    return Table(rows, ("of",), caption=caption, name=f"levers-{group.name}", sortable=True)


def _variation(material: ReportData, name: str, variation: ParameterVariation, frequency: float) -> tuple[Figure, str]:
    """Return the chart of a mode over a parameter, and the best value as text."""
    parameter = variation.parameter
    seen = track_mode(variation, frequency)
    best = best_words(material.words, best_change(variation, frequency))
    label = material.words.parameter(parameter.label)
    title = label.partition(" / ")[0]
    values = np.array(parameter.values)
    figure = material.chart(
        name,
        label,
        f"{_range(seen.frequency)} Hz; TE amplification {_range(seen.amplification)}",
        best,
        [
            Curve("this mode / Hz", values, seen.frequency),
            Curve("TE amplification", values, seen.amplification, "dashed", True),
            Curve("highest within one octave", values, seen.loudest, "thin", True),
        ],
        [ChartAxis(label, parameter.logarithmic), ChartAxis("Hz"), ChartAxis("amplification")],
        [(parameter.default, "value used")],
    )
    return figure, f"{title}: {best}"


def _range(values: np.ndarray[Any, Any]) -> str:
    return f"{figure_text(float(values.min()), 4)} to {figure_text(float(values.max()), 4)}"
