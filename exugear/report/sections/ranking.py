"""Section "Resonances, loudest first": what rings, by which mesh, whether other variants have it, and what moves."""

from __future__ import annotations

import math

from exugear.gearbox.parts import RPM
from exugear.gearbox.variant import Variant
from exugear.report.findings.groups import RankedResonance, RunGroup
from exugear.report.findings.loudness import Resonance
from exugear.report.findings.words import figure_text, percentages
from exugear.report.parts.material import Material, Part, only_for, told_groups
from exugear.report.web import pieces
from exugear.report.web.pieces import Cell
from exugear.results.spectra.comparison import AbsenceRule
from exugear.results.spectra.run_spectra import VariantRun
from exugear.results.spectra.windows import WINDOW_FACTORS

SHOWN_SPAN = 60.0
"""dB below the loudest at which the bar of a level ends."""
BUILT_UP = 3.0
"""dB below the level at constant speed from which a run-up counts as too fast for a resonance."""
NOT_NEAR = "no mode near"
SHOWN = 10
"""Resonances in the table by three quantities."""
QUANTITIES = {
    "error": ("Transmission error / µm", 1e6),
    "force": ("Bearing force / kN", 1e-3),
    "acceleration": ("Acceleration / m/s²", 1.0),
}
"""Titles of the three quantities, and their units over those of SI."""
AT_CONSTANT = "Constant speed / dB, Hz"


def ranking_section(material: Material) -> Part:
    """Rank the resonances of each run-up, and of each steady response, in a table."""
    in_operation = [only_for(_in_operation(material, group), group.name) for group in material.groups]
    tables = [
        only_for(_table(material, group, variant), group.name, variant)
        for group in material.groups
        for variant in reversed(list(group.runs))
    ]
    for group in told_groups(material.groups):
        _note_comparisons(material, group)
    if not tables:
        return Part("")
    controls = pieces.element("div", _variant_choice() + _filters(), class_="controls scripts-only")
    html = pieces.section(
        "Resonances, loudest first",
        *in_operation,
        controls,
        *tables,
        pieces.paragraph(_rules(), "note"),
        name="ranking",
    )
    return Part(html, {}, "Ranking", "ranking")


def _in_operation(material: Material, group: RunGroup) -> str:
    """Table of the resonances of the main variant at constant speed, where the gearbox works, by three quantities."""
    ranking = group.in_operation
    if ranking is None or not ranking.resonances:
        return ""
    low, high = (figure_text(speed / RPM, 4) for speed in ranking.speeds)
    which = "all speeds" if ranking.whole else "speeds of operation"
    rows = [_loud_row(material, resonance) for resonance in ranking.resonances[:SHOWN]]
    title = f"At constant speed, {Variant.of(group.main).label}, {which}, {low} to {high} rpm: the first {len(rows)}"
    table = pieces.table(rows, ("Excited by", "At"), caption=title, name=f"in-operation-{group.name}", sortable=True)
    note = (
        f"In the order of the best place in any of the three; the place stands in brackets. Accelerations are those of "
        f"the {ranking.accelerates} at bearings. Of planets it is the root of the mean square over them."
    )
    return pieces.element("h3", pieces.text(title)) + table + pieces.paragraph(note, "note")


def _loud_row(material: Material, resonance: Resonance) -> dict[str, object]:
    row: dict[str, object] = {
        "Excited by": material.words.told(resonance.line),
        "Speed / rpm": Cell(figure_text(abs(resonance.speed) / RPM, 4), abs(resonance.speed) / RPM),
        "Frequency / Hz": Cell(f"{resonance.frequency:.1f}", resonance.frequency),
    }
    for name, loudness in resonance.loudness.items():
        title, factor = QUANTITIES[name]
        place = "" if loudness.place is None else f" ({loudness.place})"
        row[title] = Cell(f"{figure_text(factor * loudness.amplitude)}{place}", loudness.amplitude)
        if name == "force":
            row["At"] = material.words.of(loudness.at)
    return row


def _variant_choice() -> str:
    return pieces.element("div", "", class_="choices", id="variant", role="group", aria_label="Resonances of")


def _filters() -> str:
    only = pieces.element(
        "label", pieces.element("input", type="checkbox", id="only-lacking") + " only what another model lacks"
    )
    text = pieces.element(
        "input", type="search", id="filter", placeholder="Filter: shaft, bearing, Hz", aria_label="Filter the table"
    )
    limit = pieces.element(
        "label",
        "Speeds up to "
        + pieces.element("input", type="range", id="limit")
        + pieces.element("output", "", id="limit-shown"),
    )
    rated = pieces.element("button", "Around rated", type="button", id="rated", hidden=True)
    return only + text + limit + rated


def _rules() -> str:
    factors = ", ".join(f"{factor:g}" for factor in WINDOW_FACTORS)
    return (
        "A resonance is a peak that stands at least 6 dB above its surroundings along an order; peaks of several "
        f"orders at one frequency are one. Absent, judged at its loudest peak: {AbsenceRule().description}, with every "
        f"window. Unsteady, of run-ups: not shown with every length of the window, {factors} times that of the "
        "diagrams. Where a steady response is there, levels at constant speed rank: a run-up that is too fast for a "
        f"resonance shows it too low, and is marked where it lacks {BUILT_UP:g} dB or more. At constant speed ± is "
        "half of the width of a peak 3 dB below its top."
    )


def _table(material: Material, group: RunGroup, variant: str) -> str:
    run = group.runs[variant]
    ranked = group.ranked[variant]
    title = f"{Variant.of(variant).label.capitalize()}, inertias {group.inertias}, {group.source}"
    heading = pieces.element("h3", pieces.text(f"{title}: {len(ranked)}"))
    rows = [_row(material, group, run, number, own) for number, own in enumerate(ranked, start=1)]
    if not rows:
        return heading + pieces.paragraph("No resonance stands out.")
    table = pieces.table(
        rows,
        ("Excited by", "What moves; what gives", *_others(group, variant)),
        caption=f"Resonances {title}",
        name=f"ranking-{group.name}-{variant}",
        hidden=("± µm", "Prominence / dB", "Mode / Hz"),
        sortable=True,
        choices=[f"resonance:{group.name}:{variant}:{number}" for number in range(len(rows))],
    )
    return heading + table


def _others(group: RunGroup, variant: str) -> list[str]:
    return [f"{Variant.of(name).label.capitalize()} / dB" for name in group.runs if name != variant]


def _row(
    material: Material, group: RunGroup, run: VariantRun, number: int, resonance: RankedResonance
) -> dict[str, object]:
    finding = resonance.finding
    peak = resonance.peak
    loudest = group.ranked[run.variant][0].loudness
    frequency = f"{finding.resonance.frequency:.0f} ± {figure_text(finding.resonance.resolution, 1)}"
    choice = f"resonance:{group.name}:{run.variant}:{number - 1}"
    matched = math.isfinite(finding.mode_frequency)
    row: dict[str, object] = {
        "No.": Cell(str(number), number),
        "Frequency / Hz": Cell(frequency, finding.resonance.frequency, choice),
        "Speed / rpm": Cell(figure_text(finding.speed, 4), finding.speed),
        "Excited by": material.words.line(peak.line),
        "Level / dB": _level(resonance, loudest),
    }
    if run.variant in group.constant:
        row[AT_CONSTANT] = _at_constant(resonance, loudest)
    row["± µm"] = Cell(figure_text(10.0 ** (resonance.loudness / 20.0), 2), resonance.loudness)
    row["Prominence / dB"] = Cell(figure_text(peak.prominence, 2), peak.prominence)
    for name, key in zip((n for n in group.runs if n != run.variant), _others(group, run.variant), strict=True):
        level = resonance.elsewhere[name]
        if name in resonance.lacking:
            row[key] = Cell("absent", -1e3, tag="plain")
        else:
            row[key] = Cell(f"{level:.1f}" if math.isfinite(level) else "–", level if math.isfinite(level) else -1e4)
    row["Mode / Hz"] = Cell(
        f"{finding.mode_frequency:.1f}" if matched else "–", finding.mode_frequency if matched else -1.0
    )
    row["What moves; what gives"] = _story(material, group, run, resonance)
    if group.responses:
        return row
    row["Windows"] = Cell(
        "all" if resonance.steady else "unsteady", float(resonance.steady), tag="good" if resonance.steady else "mind"
    )
    return row


def _level(resonance: RankedResonance, loudest: float) -> Cell:
    """Level of the run-up; marked where it is too fast."""
    level = resonance.peak.level
    if resonance.constant is None:
        return Cell(f"{level:.1f}", level, bar=1.0 - (loudest - level) / SHOWN_SPAN)
    if resonance.missed >= BUILT_UP:
        return Cell(f"{level:.1f} too fast", level, tag="mind")
    return Cell(f"{level:.1f}", level)


def _at_constant(resonance: RankedResonance, loudest: float) -> Cell:
    """Level at constant speed, and the frequency where it is highest."""
    at = resonance.constant
    if at is None:
        return Cell("–", -1e4)
    return Cell(f"{at.level:.1f}, {at.frequency:.0f} Hz", at.level, bar=1.0 - (loudest - at.level) / SHOWN_SPAN)


def _story(material: Material, group: RunGroup, run: VariantRun, resonance: RankedResonance) -> str:
    mode = resonance.finding.mode
    modes = run.modes
    if resonance.finding.mode_name and modes is None:
        return material.words.told(resonance.finding.mode_name)
    if modes is None:
        if group.responses:
            return NOT_NEAR
        return "no modes were computed"
    if mode is None:
        return NOT_NEAR
    gives = percentages(material.words.gives(modes, mode))
    return f"{material.words.moves(modes, mode)}; {gives}"


def _note_comparisons(material: Material, group: RunGroup) -> None:
    """Tell which resonances only one of two variants has; unsteady ones are not counted."""
    for variant, comparison in group.comparisons.items():
        reference = comparison.second.variant
        here = _only(group, variant, reference)
        there = _only(group, reference, variant)
        material.context.notes.statements.append(
            f"Resonances in {variant} and not in {reference} ({group.title}): {here}. In {reference} and not in "
            f"{variant}: {there}."
        )


def _only(group: RunGroup, variant: str, other: str) -> str:
    frequencies = sorted(
        own.finding.resonance.frequency for own in group.ranked[variant] if own.steady and other in own.lacking
    )
    if frequencies:
        return ", ".join(f"{frequency:.0f}" for frequency in frequencies) + " Hz"
    return "none"
