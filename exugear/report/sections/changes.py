"""Section "Design changes": what recomputed changes of the design do to a resonance, and what they cost."""

from __future__ import annotations

import math
from collections.abc import Sequence

from exugear.gearbox.units import RPM
from exugear.report.findings.context import OTHER_INPUT, Context, choice_of, model_label
from exugear.report.findings.design_changes import (
    LEAST_DB,
    ChangeResult,
    DesignStudy,
    Effect,
    read_design_study,
    settings_of_study,
)
from exugear.report.findings.headline import Headline
from exugear.report.findings.proposals import ASSUMPTION
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
        scope=(
            f"Resonance {study.number}: {where}, {line}. Model: {model_label(choice_of(study.model))}. Decides: "
            f"{QUANTITIES[study.quantity].column}. Loads: {', '.join(study.loads)}."
        ),
        requirements=[words.labelled(line) for line in study.requirements],
        designs=_table(material, study, designs, "Design changes", CHANGES_NAME + "-table"),
        assumptions=_table(material, study, assumptions, "Other assumptions", CHANGES_NAME + "-assumptions"),
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
    return [
        (_decibels(result.effects[study.quantity].highest).shown + " dB", _beginning(result.change.words))
        for result in best
    ]


def _beginning(words: str) -> str:
    """Return the text of a change without its details, which the table has."""
    return words.split(" (")[0].split(",")[0]


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
