"""Section "Two designs": amplitudes of this and of another design over speed, and the keys that differ."""

from __future__ import annotations

import math
from typing import Any

from exugear.gearbox.units import RPM
from exugear.report.findings.other_design import Difference, change_in_decibels, highest_within
from exugear.report.findings.words import rounded_text
from exugear.report.sections.answer import QUANTITIES
from exugear.report.sections.material import Axis, Curve, Part, ReportData
from exugear.report.web.html import Cell, Figure, Table, render

SHOWN_KEYS = 40
"""Number of differing keys in the table."""


def comparison_section(material: ReportData) -> Part:
    """Compare with the design of ``--compare``; nothing without it."""
    other = material.other_design
    headline = material.headline
    if other is None or headline is None:
        return Part()
    own_curves = headline.envelopes(material.lines)
    other_curves = other.headline.envelopes(other.lines)
    rows: list[dict[str, object]] = []
    figures: list[Figure] = []
    this = material.context.folder.resolve().name
    for name, label in QUANTITIES.items():
        curves = [curves[name] for curves in (own_curves, other_curves) if name in curves]
        if len(curves) < 2:
            continue
        own, others = (highest_within(curve, headline.ranking.speeds) for curve in curves)
        if own is None or others is None:
            continue
        change = change_in_decibels(own, others)
        rows.append(
            {
                "quantity": label.title,
                f"{this} ±": Cell(f"{rounded_text(label.factor * own.amplitude)} {label.unit}", own.amplitude),
                f"{this} / rpm": _number(own.speed / RPM),
                f"{other.name} ±": Cell(
                    f"{rounded_text(label.factor * others.amplitude)} {label.unit}", others.amplitude
                ),
                f"{other.name} / rpm": _number(others.speed / RPM),
                "change / dB": _number(change, "+.1f"),
            }
        )
        material.context.notes.statements.append(
            f"{label.title}, highest in the range: {this} ±{rounded_text(label.factor * own.amplitude)} {label.unit}, "
            f"{other.name} ±{rounded_text(label.factor * others.amplitude)} {label.unit} ({change:+.1f} dB)."
        )
        figures.append(
            material.chart(
                f"compared-{name}",
                f"{label.title} ± / {label.unit}",
                "Largest single order over speed.",
                f"{this} and {other.name}",
                [
                    Curve(this, curves[0].speed / RPM, label.factor * curves[0].amplitude, "thin"),
                    Curve(other.name, curves[1].speed / RPM, label.factor * curves[1].amplitude),
                ],
                [Axis(f"{material.input_words} speed / rpm"), Axis(f"± {label.unit}", logarithmic=True)],
            )
        )
    first = other.headline.top
    leads = "" if first is None else f"{rounded_text(first.frequency)} Hz at {rounded_text(abs(first.speed) / RPM)} rpm"
    html = render(
        "comparison",
        this=this,
        other=other.name,
        leads=leads,
        cautions=[material.words.labelled(words) for words in other.cautions],
        amplitudes=Table(rows, caption="Two designs", name="two-designs-table"),
        figures=figures,
        keys=Table(
            [_key_row(this, other.name, difference) for difference in other.differences[:SHOWN_KEYS]],
            (this, other.name),
            caption="Keys that differ",
            name="two-designs-keys",
        ),
        more=max(len(other.differences) - SHOWN_KEYS, 0),
    )
    return Part(html, title="Two designs", name="two-designs")


def _number(value: float, form: str = "") -> Cell:
    if math.isnan(value):
        return Cell("–", value)
    return Cell((format(value, form) if form else rounded_text(value)).replace("-", "−"), value)


def _key_row(this: str, other: str, difference: Difference) -> dict[str, Any]:
    names = (this, f"{other} (other)" if other == this else other)
    values = ("–" if value is None else str(value) for value in (difference.own, difference.other))
    return {"key": difference.key, **dict(zip(names, values, strict=True))}
