"""Part "Changes": recomputed changes of the design, another design, and sensitivities of the first resonance."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from typing import Any

import numpy as np

from exugear.gearbox.choice import choice_of
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.report.findings.context import OTHER_INPUT, Context, model_label, shown_path
from exugear.report.findings.design_changes import (
    LEAST_DB,
    ChangeResult,
    DesignStudy,
    Effect,
    read_design_study,
    settings_of_study,
)
from exugear.report.findings.facts import best_words, sensitivities_of, shift_text
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.headline import Headline, headline_of_group
from exugear.report.findings.other_design import change_in_decibels, highest_within
from exugear.report.findings.parameter_variations import best_change, track_mode, variations_of
from exugear.report.findings.proposals import ASSUMPTION
from exugear.report.findings.words import QUANTITIES, figure_text, rounded_text
from exugear.report.sections.material import ChartAxis, Curve, Part, ReportData
from exugear.report.web.html import Cell, Figure, Table, render
from exugear.results.folder import DESIGN_CHANGES_FILE
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.system.sensitivity import ParameterVariation
from fe_ste.tools.files import FileError

CHANGES_NAME = "changes"
"""Identifier of the part."""
SHOWN_KEYS = 40
"""Number of differing keys in the table."""


def changes_section(material: ReportData) -> Part:
    """Show computed design changes, another design, and sensitivities."""
    study = _study(material)
    compared = _compared(material)
    sensitivities = list(filter(None, (_sensitivity(material, group) for group in material.groups)))
    if not (study or compared or sensitivities):
        return Part()
    html = render("changes", study=study, command=levers_command(material), compared=compared, groups=sensitivities)
    return Part(html, title="Changes", name=CHANGES_NAME)


def levers_command(material: ReportData) -> str:
    """Return the command that computes design changes."""
    command = shlex.join(["exugear", "report", shown_path(material.context.folder), "--levers"])
    if material.headline is not None and material.headline.response is None:
        return f"exugear steady, then {command}"
    return command


def _study(material: ReportData) -> dict[str, Any] | None:
    """Return the results of `exugear report --levers`; None without them."""
    study = material.design_study
    if study is None:
        return None
    made = [result for result in study.results if not result.refusal]
    designs = [result for result in made if result.change.group != ASSUMPTION]
    assumptions = [result for result in made if result.change.group == ASSUMPTION]
    words = material.words
    where = f"{rounded_text(study.frequency)} Hz at {rounded_text(abs(study.speed) / RPM)} rpm"
    line = next((words.line(own) for own in material.lines if own.name == study.line), words.labelled(study.line))
    return {
        "scope": (
            f"Resonance {study.number}: {where}, {line}. Model: {model_label(choice_of(study.model))}. Decides: "
            f"{QUANTITIES[study.quantity].column}. Loads: {', '.join(study.loads)}."
        ),
        "requirements": [words.labelled(line) for line in study.requirements],
        "designs": _table(material, study, designs, "Design changes", CHANGES_NAME + "-table"),
        "assumptions": _table(material, study, assumptions, "Other assumptions", CHANGES_NAME + "-assumptions"),
        "refused": [f"{words.labelled(one.change.words)}: {one.refusal}" for one in study.results if one.refusal],
    }


def stored_study(context: Context) -> DesignStudy | None:
    """Read the design changes of the folder, if they belong to its gearbox file; note otherwise why not."""
    path = context.folder / DESIGN_CHANGES_FILE
    if not path.exists():
        return None
    try:
        study = read_design_study(path)
        settings = settings_of_study(context.gearbox)
        fits = settings.hash_with(context.assembled(choice_of(study.model))) == study.input_hash
    except FileError as error:
        context.notes.left_out.append(str(error))
        return None
    except (ValueError, KeyError, SteadyError) as error:
        context.leave_out(path, error)
        return None
    if not fits:
        context.leave_out(path, OTHER_INPUT)
        return None
    return study


def study_of(study: DesignStudy | None, headline: Headline) -> DesignStudy | None:
    """Return the design changes if they are of the first resonance of the page and of its model and quantity."""
    top = headline.top
    if study is None or top is None or choice_of(study.model) != headline.choice:
        return None
    same = study.line == top.line and abs(study.frequency - top.frequency) <= 0.01 * top.frequency
    return study if same and study.quantity == headline.ranking.quantity else None


def best_changes(study: DesignStudy, count: int) -> list[tuple[str, str]]:
    """Return what the best recommended changes do to the highest amplitude in the range, and their texts."""
    best = [result for result in study.results if result.recommended][:count]
    # The table has the details of a change.
    return [
        (
            _decibels(result.effects[study.quantity].highest).shown + " dB",
            result.change.words.split(" (")[0].split(",")[0],
        )
        for result in best
    ]


def _table(material: ReportData, study: DesignStudy, results: Sequence[ChangeResult], caption: str, name: str) -> Table:
    rows = []
    for result in results:
        row: dict[str, object] = {"change": material.words.labelled(result.change.words)}
        for quantity, label in sorted(QUANTITIES.items(), key=lambda item: item[0] != study.quantity):
            if any(quantity in own.effects for own in results):
                effect = result.effects.get(quantity, Effect(None, None))
                row[f"{label.column}, this peak / dB"] = _decibels(effect.this_peak)
                row[f"{label.column}, highest in range / dB"] = _decibels(effect.highest)
        row["recommended"] = material.words.labelled(result.objection) or ("yes" if result.recommended else "–")
        row["price"] = material.words.labelled(result.price).replace(" -", " −") or "–"
        rows.append(row)
    narrow = ("change", QUANTITIES[study.quantity].column, "recommended", "price")
    hidden = [key for key in (rows[0] if rows else ()) if not key.startswith(narrow)]
    return Table(
        rows, ("change", "recommended", "price"), caption=caption, name=name, hidden=hidden, sortable=True, stacked=True
    )


def _decibels(value: float | None) -> Cell:
    if value is None:
        return Cell("–", math.nan)
    if value <= LEAST_DB:
        return Cell(f"≤ −{-LEAST_DB:g}", value)
    text = f"{value:+.1f}".replace("-", "−")
    return Cell("0.0" if text in ("+0.0", "−0.0") else text, value)


# Another design


def _compared(material: ReportData) -> dict[str, Any] | None:
    """Compare with the design of ``--compare``; None without it."""
    other = material.other_design
    headline = material.headline
    if other is None or headline is None:
        return None
    this = material.context.folder.resolve().name
    curves = headline.envelopes(material.lines)
    other_curves = other.headline.envelopes(other.lines)
    rows: list[dict[str, object]] = []
    figures: list[Figure] = []
    for name, label in QUANTITIES.items():
        if name not in curves or name not in other_curves:
            continue
        own = highest_within(curves[name], headline.ranking.speeds)
        others = highest_within(other_curves[name], headline.ranking.speeds)
        if own is None or others is None:
            continue
        row: dict[str, object] = {"quantity": f"{label.title}, ± / {label.unit}"}
        said = []
        drawn = []
        for design, highest, curve, style in (
            (this, own, curves[name], "thin"),
            (other.name, others, other_curves[name], "line"),
        ):
            amplitude = label.factor * highest.amplitude
            row[design] = _number(amplitude)
            row[f"{design} / rpm"] = _number(highest.speed / RPM)
            said.append(f"{design} ±{rounded_text(amplitude)} {label.unit}")
            drawn.append(Curve(design, curve.speed / RPM, label.factor * curve.amplitude, style))
        change = change_in_decibels(own, others)
        row["change / dB"] = _number(round(change, 1) + 0.0, "+.1f")
        rows.append(row)
        statement = f"{label.title}, highest in the range: {', '.join(said)} ({change:+.1f} dB)."
        material.context.notes.statements.append(statement)
        figures.append(
            material.chart(
                f"compared-{name}",
                f"{label.title} ± / {label.unit}",
                "Largest single order over speed.",
                f"{this} and {other.name}",
                drawn,
                [ChartAxis(f"{material.input_words} speed / rpm"), ChartAxis(f"± {label.unit}")],
            )
        )
    first = other.headline.top
    leads = "" if first is None else f"{rounded_text(first.frequency)} Hz at {rounded_text(abs(first.speed) / RPM)} rpm"
    return {
        "this": this,
        "other": other.name,
        "leads": leads,
        "cautions": [material.words.labelled(words) for words in other.cautions],
        "amplitudes": Table(rows, caption="Two designs", name="two-designs-table"),
        "figures": figures,
        "keys": Table(
            [
                {"key": one.key, this: _value_text(one.own), other.name: _value_text(one.other)}
                for one in other.differences[:SHOWN_KEYS]
            ],
            (this, other.name),
            caption="Keys that differ",
            name="two-designs-keys",
        ),
        "more": max(len(other.differences) - SHOWN_KEYS, 0),
    }


def _number(value: float, form: str = "") -> Cell:
    if math.isnan(value):
        return Cell("–", value)
    return Cell((format(value, form) if form else rounded_text(value)).replace("-", "−"), value)


def _value_text(value: Any) -> str:
    if value is None:
        return "–"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


# Sensitivities: first-order shifts of the mode of the first resonance, and full variations

SHOWN_SENSITIVITIES = 8
"""Maximum number of parameters of each kind in the table."""


def _sensitivity(material: ReportData, group: RunGroup) -> dict[str, Any] | None:
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
    varied = variations_of(material.variations, own.choice)
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
    return {
        "name": group.name,
        "scope": scope,
        "table": Table(rows, ("of",), caption=caption, name=f"levers-{group.name}", sortable=True),
        "variations": [
            _variation(material, f"variation-{group.name}-{number}", variation, frequency)
            for number, variation in enumerate(varied)
        ],
    }


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
