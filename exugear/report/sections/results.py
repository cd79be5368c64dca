"""Sections on all result groups: checks, comparison of models, waterfalls, and resonances of each run-up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from exugear.gearbox.load_cases import static_load_in_words
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.report.findings.facts import facts_of
from exugear.report.findings.groups import RankedResonance, RunGroup
from exugear.report.findings.result_checks import validity_checks
from exugear.report.findings.words import figure_text, percentages
from exugear.report.sections.material import Part, ReportData, group_words
from exugear.report.web.html import Cell, Figure, Table, render
from exugear.results.findings import Finding
from exugear.results.spectra.resonances import Pick
from exugear.results.spectra.run_spectra import WINDOW_FACTORS, AbsenceRule, VariantRun


def checks_section(material: ReportData) -> Part:
    """List warnings and passed checks of the results that the headline is from."""
    if not material.groups:
        return Part()
    group = material.groups[0]
    verdicts = _checks(material, group)
    material.context.notes.findings.extend(verdicts)
    material.context.notes.statements.extend(f"{verdict.line}." for verdict in verdicts)
    return Part(render("checks", verdicts=verdicts), title="Checks", name="checks")


def _checks(material: ReportData, group: RunGroup) -> list[Finding]:
    """Return the checks of a group with the labels of parts."""
    found = validity_checks(material.context, group)
    return [replace(finding, text=material.words.labelled(finding.text)) for finding in found]


def results_section(material: ReportData) -> Part:
    """Show findings and checks of each result group as cards; the command line prints those of run-ups, too."""
    notes = material.context.notes.statements
    content = []
    for group in material.groups:
        facts = facts_of(material.context, material.words, group, material.variations)
        verdicts = () if group is material.groups[0] else _checks(material, group)
        if not group.responses:
            several = group_words(material.groups, group)
            notes.append(f"{several}: Load: {_load_of(material, group)}.")
            notes.extend(f"{several}: {fact.line}" for fact in facts)
            notes.extend(f"{several}: {verdict.line}." for verdict in verdicts)
        content.append({"name": group.name, "scope": _scope(material, group), "facts": facts, "verdicts": verdicts})
        _note_comparisons(material, group)
    if not content:
        return Part()
    html = render("results", groups=content, run_ups=any(not group.responses for group in material.groups))
    return Part(html, title="Models compared", name="results")


def _scope(material: ReportData, group: RunGroup) -> str:
    return (
        f"{group.title[0].upper()}{group.title[1:]}. Load: {_load_of(material, group)}. Speeds: of the "
        f"{material.input_words}. Levels: overall transmission error (TE), 0 dB = 1 µm."
    )


def _load_of(material: ReportData, group: RunGroup) -> str:
    """Describe the load of a group: that of its load case, or the static load."""
    static = static_load_in_words(material.context.gearbox)
    loads = sorted({str(run.attributes.get("load", "")) for run in group.runs.values()} - {""})
    text = f"static load, {static}"
    if loads and not group.responses:
        text = f"{'; '.join(loads)} (tables and steady-state responses: {text})"
    return material.words.labelled(text)


# Section "Waterfall and order cuts", with the selected resonance as text and its animated mode shape


def waterfall_section(material: ReportData) -> Part:
    """Draw the waterfalls of all run-ups and steady-state responses; the ranking has the same text."""
    if not material.groups:
        return Part()
    words = _groups_text(material.groups)
    html = render(
        "waterfall",
        words=words,
        waterfall=Figure("waterfall", "Waterfall", f"Source: {material.groups[0].source}.", words),
        cuts=Figure("cuts", "Order cuts", "Same speeds as above. Select orders below.", words),
        modes=bool(material.results.modes),
    )
    return Part(html, material.run_data, "Waterfall and order cuts", "rings")


def _groups_text(groups: Sequence[RunGroup]) -> str:
    group = groups[0]
    loudest = [own for own in group.ranked[group.main] if own.steady][:3]
    entries = [
        f"{own.frequency:.0f} Hz at {own.speed / RPM:.1f} rpm, {figure_text(own.ranking_level)} dB" for own in loudest
    ]
    return f"Highest resonances, {Variant.of(group.main).label}, {group.source}: {'; '.join(entries) or 'none found'}."


# Section "Resonance ranking": exciting mesh, comparison of variants, and mode shape of each resonance

SHOWN_SPAN = 60.0
"""Level difference (dB) below the highest resonance at which the bar has zero length."""
BUILT_UP = 3.0
"""Deficit (dB) against the level at constant speed from which a run-up counts as too fast for a resonance."""
NOT_NEAR = "no mode near"
AT_CONSTANT = "Constant speed / dB, Hz"


def resonances_section(material: ReportData) -> Part:
    """List the resonances of each run-up and each steady-state response in a table, by transmission error."""
    tables = [
        {"group": group.name, "variant": variant, **_table(material, group, variant)}
        for group in material.groups
        for variant in reversed(list(group.runs))
    ]
    if not tables:
        return Part()
    html = render(
        "resonances",
        tables=tables,
        factors=", ".join(f"{factor:g}" for factor in WINDOW_FACTORS),
        absent=AbsenceRule().description,
        built_up=BUILT_UP,
    )
    return Part(html, title="Resonances by model", name="found")


def _table(material: ReportData, group: RunGroup, variant: str) -> dict[str, Any]:
    run = group.runs[variant]
    ranked = group.ranked[variant]
    title = f"{Variant.of(variant).label.capitalize()}, inertia set {group.inertias}, {group.source}"
    table = Table(
        [_row(material, group, run, number, own) for number, own in enumerate(ranked, start=1)],
        ("Excited by", "Mode shape; strain energy", *_others(group, variant)),
        caption=f"Resonances {title}",
        name=f"ranking-{group.name}-{variant}",
        hidden=("± µm", "Prominence / dB", "Mode / Hz"),
        sortable=True,
        choices=[f"resonance:{group.name}:{variant}:{number}" for number in range(len(ranked))],
    )
    return {"title": f"{title}: {len(ranked)}", "table": table}


def _others(group: RunGroup, variant: str) -> list[str]:
    return [f"{Variant.of(name).label.capitalize()} / dB" for name in group.runs if name != variant]


def _row(
    material: ReportData, group: RunGroup, run: VariantRun, number: int, resonance: RankedResonance
) -> dict[str, object]:
    finding = resonance.finding
    # A mode has a peak for each order that excites it: the row is of the one that the panel shows.
    peak = group.shown_peak(resonance)
    loudest = group.ranked[run.variant][0].ranking_level
    frequency = f"{finding.resonance.frequency:.0f} ± {figure_text(finding.resonance.resolution, 1)}"
    choice = f"resonance:{group.name}:{run.variant}:{number - 1}"
    matched = math.isfinite(finding.mode_frequency)
    row: dict[str, object] = {
        "No.": Cell(str(number), number),
        "Frequency / Hz": Cell(frequency, finding.resonance.frequency, choice),
        "Speed / rpm": Cell(figure_text(abs(peak.speed) / RPM, 4), abs(peak.speed) / RPM),
        "Excited by": material.words.line(peak.line),
        "Level / dB": _level(resonance, peak, loudest),
    }
    if run.variant in group.constant:
        row[AT_CONSTANT] = _constant_speed_cell(resonance, loudest)
    shown = resonance.ranking_level if peak is resonance.peak else peak.level
    amplitude = 10.0 ** (shown / 20.0)
    row["± µm"] = Cell(figure_text(amplitude, 2), amplitude)
    row["Prominence / dB"] = Cell(figure_text(peak.prominence, 2), peak.prominence)
    for name, key in zip((n for n in group.runs if n != run.variant), _others(group, run.variant), strict=True):
        level = resonance.elsewhere[name]
        if name in resonance.lacking:
            row[key] = Cell("absent", math.nan, tag="plain")
        else:
            row[key] = Cell(f"{level:.1f}" if math.isfinite(level) else "–", level)
    row["Mode / Hz"] = Cell(f"{finding.mode_frequency:.1f}" if matched else "–", finding.mode_frequency)
    row["Mode shape; strain energy"] = _mode_text(material, group, run, resonance)
    if group.responses:
        return row
    row["Windows"] = Cell(
        "all" if resonance.steady else "window-dependent",
        float(resonance.steady),
        tag="good" if resonance.steady else "mind",
    )
    return row


def _level(resonance: RankedResonance, peak: Pick, loudest: float) -> Cell:
    """Return the level of a peak in the run-up; marked if the run-up is too fast."""
    level = peak.level
    if resonance.constant is None or peak is not resonance.peak:
        return Cell(f"{level:.1f}", level, bar=1.0 - (loudest - level) / SHOWN_SPAN)
    if resonance.missed >= BUILT_UP:
        return Cell(f"{level:.1f} too fast", level, tag="mind")
    return Cell(f"{level:.1f}", level)


def _constant_speed_cell(resonance: RankedResonance, loudest: float) -> Cell:
    """Return the level at constant speed and the frequency of its maximum."""
    at = resonance.constant
    if at is None:
        return Cell("–", math.nan)
    return Cell(f"{at.level:.1f}, {at.frequency:.0f} Hz", at.level, bar=1.0 - (loudest - at.level) / SHOWN_SPAN)


def _mode_text(material: ReportData, group: RunGroup, run: VariantRun, resonance: RankedResonance) -> str:
    mode = resonance.finding.mode
    modes = run.modes
    if resonance.finding.mode_name and modes is None:
        return material.words.labelled(resonance.finding.mode_name)
    if modes is None:
        if group.responses:
            return NOT_NEAR
        return "no modes computed"
    if mode is None:
        return NOT_NEAR
    energies = percentages(material.words.strain_energy(modes, mode))
    return f"{material.words.moves(modes, mode)}; {energies}"


def _note_comparisons(material: ReportData, group: RunGroup) -> None:
    """Note resonances that only one of two variants has; window-dependent ones are not counted."""
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
