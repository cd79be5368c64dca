"""Section "Design changes": what recomputed changes of the design do to a resonance, and what they cost."""

from __future__ import annotations

import math
from collections.abc import Sequence

from exugear.gearbox.units import RPM
from exugear.report.findings.context import OTHER_INPUT, Context, choice_of, model_label
from exugear.report.findings.design_changes import (
    ASSUMPTION,
    LEAST_DB,
    ChangeResult,
    DesignStudy,
    Effect,
    read_design_study,
    settings_of_study,
)
from exugear.report.findings.headline import Headline
from exugear.report.findings.words import QUANTITIES, rounded_text
from exugear.report.sections.material import Part, ReportData
from exugear.report.web.html import Cell, Table, render
from exugear.results.folder import DESIGN_CHANGES_FILE
from exugear.steady.mean_system.rotating_frame import SteadyError
from fe_ste.tools.files import FileError

CHANGES_NAME = "design-changes"
"""Identifier of the section."""


def changes_section(material: ReportData) -> Part:
    """Show the results of `exugear report --levers`; nothing without them."""
    study = material.design_study
    if study is None:
        return Part()
    made = [result for result in study.results if not result.refusal]
    designs = [result for result in made if result.change.group != ASSUMPTION]
    assumptions = [result for result in made if result.change.group == ASSUMPTION]
    words = material.words
    where = f"{rounded_text(study.frequency)} Hz at {rounded_text(abs(study.speed) / RPM)} rpm"
    line = next((words.line(own) for own in material.lines if own.name == study.line), words.labelled(study.line))
    html = render(
        "design_changes",
        scope=f"Resonance: {where}, {line}. Model: {model_label(choice_of(study.model))}.",
        designs=_table(material, designs, "Design changes", CHANGES_NAME + "-table"),
        assumptions=_table(material, assumptions, "Other assumptions", CHANGES_NAME + "-assumptions"),
        refused=[f"{words.labelled(one.change.words)}: {one.refusal}" for one in study.results if one.refusal],
    )
    return Part(html, title="Design changes", name=CHANGES_NAME)


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
        context.notes.left_out.append(f"{context.name_of(path)}: {error}")
        return None
    if not fits:
        context.notes.left_out.append(f"{context.name_of(path)}: {OTHER_INPUT}")
        return None
    return study


def best_changes(study: DesignStudy | None, headline: Headline, count: int) -> list[tuple[str, str]]:
    """Return what the best changes do to the transmission error at the resonance of a headline, and their texts.

    The best ones reduce this resonance, and most of all the highest amplitude in the operating range. The list is empty
    if the study is of another resonance or another model.
    """
    top = headline.top
    if study is None or top is None or choice_of(study.model) != headline.choice:
        return []
    if study.line != top.line or abs(study.frequency - top.frequency) > 0.01 * top.frequency:
        return []
    lowered = [
        (effect.this_peak, effect.highest or 0.0, result.change.words)
        for result in study.results
        if result.change.group != ASSUMPTION
        and (effect := result.effects.get("error")) is not None
        and effect.this_peak is not None
        and effect.this_peak < 0.0
    ]
    return [
        (_decibels(here).shown + " dB", f"{_beginning(words)}; highest in range {_decibels(highest).shown} dB")
        for here, highest, words in lowered[:count]
    ]


def _beginning(words: str) -> str:
    """Return the text of a change without its details, which the table has."""
    return words.split(" (")[0].split(",")[0]


def _table(material: ReportData, results: Sequence[ChangeResult], caption: str, name: str) -> Table:
    rows = []
    for result in results:
        row: dict[str, object] = {"change": material.words.labelled(result.change.words)}
        for quantity, label in QUANTITIES.items():
            if any(quantity in own.effects for own in results):
                effect = result.effects.get(quantity, Effect(None, None))
                row[f"{label.column}, this peak / dB"] = _decibels(effect.this_peak)
                row[f"{label.column}, highest in range / dB"] = _decibels(effect.highest)
        row["price"] = material.words.labelled(result.price).replace(" -", " −") or "–"
        rows.append(row)
    narrow = ("change", "transmission error", "price")
    hidden = [key for key in (rows[0] if rows else ()) if not key.startswith(narrow)]
    return Table(rows, ("change", "price"), caption=caption, name=name, hidden=hidden, sortable=True, stacked=True)


def _decibels(value: float | None) -> Cell:
    if value is None:
        return Cell("–", math.nan)
    if value <= LEAST_DB:
        return Cell(f"≤ −{-LEAST_DB:g}", value)
    text = f"{value:+.1f}".replace("-", "−")
    return Cell("0.0" if text in ("+0.0", "−0.0") else text, value)
