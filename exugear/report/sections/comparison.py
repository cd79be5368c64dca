"""Section "Two designs": amplitudes of this and of another design over speed, and the keys that differ."""

from __future__ import annotations

import math
from typing import Any

from exugear.gearbox.units import RPM
from exugear.report.findings.other_design import Difference, HighestAmplitude, change_in_decibels, highest_within
from exugear.report.findings.ranking import Envelope
from exugear.report.findings.words import QUANTITIES, rounded_text
from exugear.report.sections.material import ChartAxis, Curve, Part, ReportData
from exugear.report.web.html import Cell, Figure, Table, render

SHOWN_KEYS = 40
"""Number of differing keys in the table."""


def comparison_section(material: ReportData) -> Part:
    """Compare with the design of ``--compare``; nothing without it."""
    other = material.other_design
    headline = material.headline
    if other is None or headline is None:
        return Part()
    this = material.context.folder.resolve().name
    curves = headline.envelopes(material.lines)
    other_curves = other.headline.envelopes(other.lines)
    rows: list[dict[str, object]] = []
    figures: list[Figure] = []
    for name in QUANTITIES:
        if name not in curves or name not in other_curves:
            continue
        own = highest_within(curves[name], headline.ranking.speeds)
        others = highest_within(other_curves[name], headline.ranking.speeds)
        if own is None or others is None:
            continue
        rows.append(_row(material, name, (this, own), (other.name, others)))
        figures.append(_figure(material, name, (this, curves[name]), (other.name, other_curves[name])))
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


def _row(
    material: ReportData, name: str, own: tuple[str, HighestAmplitude], other: tuple[str, HighestAmplitude]
) -> dict[str, object]:
    """Return a row of the table of amplitudes, and note it for the command line."""
    label = QUANTITIES[name]
    change = change_in_decibels(own[1], other[1])
    row: dict[str, object] = {"quantity": f"{label.title}, ± / {label.unit}"}
    said = []
    for design, highest in (own, other):
        amplitude = label.factor * highest.amplitude
        row[design] = _number(amplitude)
        row[f"{design} / rpm"] = _number(highest.speed / RPM)
        said.append(f"{design} ±{rounded_text(amplitude)} {label.unit}")
    row["change / dB"] = _number(round(change, 1) + 0.0, "+.1f")
    statement = f"{label.title}, highest in the range: {', '.join(said)} ({change:+.1f} dB)."
    material.context.notes.statements.append(statement)
    return row


def _figure(material: ReportData, name: str, own: tuple[str, Envelope], other: tuple[str, Envelope]) -> Figure:
    label = QUANTITIES[name]
    curves = [
        Curve(design, curve.speed / RPM, label.factor * curve.amplitude, style)
        for (design, curve), style in ((own, "thin"), (other, "line"))
    ]
    title = f"{label.title} ± / {label.unit}"
    axes = [ChartAxis(f"{material.input_words} speed / rpm"), ChartAxis(f"± {label.unit}")]
    return material.chart(
        f"compared-{name}", title, "Largest single order over speed.", f"{own[0]} and {other[0]}", curves, axes
    )


def _number(value: float, form: str = "") -> Cell:
    if math.isnan(value):
        return Cell("–", value)
    return Cell((format(value, form) if form else rounded_text(value)).replace("-", "−"), value)


def _key_row(this: str, other: str, difference: Difference) -> dict[str, Any]:
    values = map(_value_text, (difference.own, difference.other))
    return {"key": difference.key, **dict(zip((this, other), values, strict=True))}


def _value_text(value: Any) -> str:
    if value is None:
        return "–"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
