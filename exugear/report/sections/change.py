"""Section "What to change": first-order shifts of the loudest mode, and full variations with their guard."""

from __future__ import annotations

from typing import Any

import numpy as np

from exugear.gearbox.variant import Variant
from exugear.report.findings.facts import best_words, shift_text
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.levers import levers_of
from exugear.report.findings.variations import ModelVariations, best_change, guarded
from exugear.report.findings.words import figure_text
from exugear.report.parts.charts import Axis, Curve, chart
from exugear.report.parts.material import Material, Part, only_for
from exugear.report.web import pieces
from exugear.report.web.pieces import Cell

LEVERS = 8
"""Levers of each kind in the table."""


def change_section(material: Material) -> Part:
    """Show what moves the loudest mode of each group of run-ups."""
    charts: dict[str, Any] = {}
    content = [only_for(_group(material, group, charts), group.name) for group in material.groups]
    if not any(content):
        return Part("")
    return Part(
        pieces.section("What to change", *content, name="change"), {"charts": charts}, "What to change", "change"
    )


def _group(material: Material, group: RunGroup, charts: dict[str, Any]) -> str:
    top = group.loudest
    modes = group.runs[group.main].modes
    if top is None or modes is None or top.finding.mode is None:
        return ""
    mode = top.finding.mode
    frequency = float(modes["frequency"][mode])
    scope = (
        f"For the mode at {frequency:.1f} Hz {Variant.of(group.main).label}, inertias {group.inertias}: "
        f"{material.words.moves(modes, mode)}."
    )
    own = next((variation for variation in material.variations if variation.choice == group.choice(group.main)), None)
    full = _variations(material, group, own, frequency, charts) if own and own.variations else ""
    return pieces.paragraph(scope, "note") + _levers(material, group, mode) + full


def _levers(material: Material, group: RunGroup, mode: int) -> str:
    modes = group.runs[group.main].modes
    assert modes is not None
    levers = levers_of(material.words, modes, mode)
    largest = max((abs(lever.shift) for lever in levers), default=1.0)
    kinds = [[lever for lever in levers if lever.kind == kind][:LEVERS] for kind in ("stiffness", "inertia")]
    rows = [
        {
            "10 % more": lever.kind,
            "of": lever.what,
            "holds / %": Cell(f"{100.0 * lever.share:.1f}", lever.share),
            "shift": Cell(shift_text(lever), lever.shift, bar=abs(lever.shift) / largest),
        }
        for own in kinds
        for lever in own
    ]
    caption = "First-order shifts of the loudest mode"
    table = pieces.table(rows, ("of",), caption=caption, name=f"levers-{group.name}", sortable=True)
    words = (
        "From the shares of its energies, the shape held. A share of strain energy s raises the frequency by "
        "f (√(1 + 0.1 s) − 1), one of kinetic energy lowers it."
    )
    return pieces.element("h3", "10 % more of what") + pieces.paragraph(words, "note") + table


def _variations(
    material: Material, group: RunGroup, variations: ModelVariations, frequency: float, charts: dict[str, Any]
) -> str:
    figures = []
    told = []
    for number, variation in enumerate(variations.variations):
        parameter = variation.parameter
        seen = guarded(variation, frequency)
        best = best_change(variation, frequency)
        label = material.words.parameter(parameter.label)
        told.append(f"{label.partition(' / ')[0]}: {best_words(material.words, best)}")
        values = np.array(parameter.values)
        html, data = chart(
            f"variation-{group.name}-{number}",
            label,
            f"{_range(seen.frequency)} Hz; amplification {_range(seen.amplification)}",
            best_words(material.words, best),
            [
                Curve("this mode / Hz", values, seen.frequency),
                Curve("its amplification", values, seen.amplification, "dashed", True),
                Curve("loudest within an octave", values, seen.loudest, "thin", True),
            ],
            [Axis(label, parameter.logarithmic), Axis("Hz"), Axis("amplification")],
            material.arrays,
            [(parameter.default, "used")],
        )
        figures.append(html)
        charts.update(data)
    words = (
        "Full eigenvalue analysis at each value; dotted: value used. Thick, left axis: frequency of this mode. Dashed, "
        "right axis: its amplification of the transmission error. Thin, right axis: amplification of the loudest mode "
        "of any shape within an octave. Where the dashed line falls and the thin one does not, another mode has taken "
        "over and nothing became quieter."
    )
    return (
        pieces.element("h3", "If an assumption were different")
        + pieces.paragraph(words, "note")
        + pieces.element("div", "".join(figures), class_="grid")
        + pieces.bullets(told)
    )


def _range(values: np.ndarray[Any, Any]) -> str:
    return f"{figure_text(float(values.min()), 4)} to {figure_text(float(values.max()), 4)}"
