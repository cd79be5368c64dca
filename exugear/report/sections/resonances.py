"""Part "Resonances": the list, waterfall and order cuts, Campbell diagram, modes, and what a response has further."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.choice import Choice, choice_of
from exugear.gearbox.load_cases import static_load_in_words, summarise_loads
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.sections.entries import GROUND
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.report.findings.context import Context, model_label, response_label
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.headline import Headline
from exugear.report.findings.ranking import HOUSING, SHAFTS, Ranking, Resonance, is_over_speed
from exugear.report.findings.resonance_list import ListedResonance, listed_resonance
from exugear.report.findings.words import QUANTITIES, capitalised, figure_text, percentages, rounded_text
from exugear.report.pictures.speed_diagrams import NUMBERED, campbell_drawing
from exugear.report.sections.material import ChartAxis, Curve, Part, ReportData, model_name
from exugear.report.sections.measured import measured_run_up
from exugear.report.sections.run_data import is_found_always
from exugear.report.sections.sound import sound_power
from exugear.report.web.html import Cell, Figure, Table, render
from exugear.results.causes import shares, strongest
from exugear.results.run_file import read_run
from exugear.results.spectra.resonances import MAX_SWEEP_RATIO, run_up_cut, sweep_rate, sweep_severity
from exugear.results.spectra.run_spectra import WINDOW_FACTORS, AbsenceRule, VariantRun, report_mode
from exugear.results.spectra.waterfall import OrderLine, order_lines
from exugear.steady.campbell import Campbell, campbell_from
from exugear.steady.peaks import Peak, peaks, planet_sidebands, sidebands
from exugear.steady.steady_file import settings_of
from fe_ste.tools.arrays import Floats

if TYPE_CHECKING:
    import xarray as xr

SHOWN = NUMBERED
"""Number of resonances that the list shows first."""
CAMPBELL = ((1120.0, 520.0), (352.0, 420.0))
"""Sizes of the Campbell diagrams."""
BUILT_UP = 3.0
"""Deficit (dB) against the level at constant speed from which a run-up counts as too fast for a resonance."""
NOT_NEAR = "no mode near"


def resonances_section(material: ReportData) -> Part:
    """Show the list of resonances of each result, its diagrams, and all modes."""
    listed = [
        _of_group(material, group, variant) for group in material.groups for variant in reversed(list(group.runs))
    ]
    headline = material.headline
    if not listed and headline is not None:
        listed = [_of_estimate(material, headline)]
    modes = [(model_name(model), _all_modes(material, model, data)) for model, data in material.results.modes.items()]
    responses = [_response(material, data) for data in material.results.steady]
    measured = [measured_run_up(material, data) for data in material.results.measured]
    if not (listed or modes or responses or measured):
        return Part()
    for model, data in material.results.modes.items():
        growth = float(data.attrs["growth_rate"])
        if growth > 0.0:
            unstable = f"{model_label(model)}: unstable, disturbances grow at up to {growth:.3g} 1/s."
            material.context.notes.statements.append(unstable)
    groups = material.groups
    words = ""
    if groups:
        first = groups[0]
        highest = [own for own in first.ranked[first.main] if own.steady][:3]
        entries = "; ".join(
            f"{own.frequency:.0f} Hz at {own.speed / RPM:.1f} rpm, {figure_text(own.ranking_level)} dB"
            for own in highest
        )
        named = f"Highest transmission errors at all speeds, {Variant.of(first.main).label}, {first.source}"
        words = f"{named}: {entries or 'none found'}."
    html = render(
        "resonances",
        listed=listed,
        count=SHOWN,
        run_ups=any(not group.responses for group in groups),
        absent=AbsenceRule().description,
        factors=", ".join(f"{factor:g}" for factor in WINDOW_FACTORS),
        built_up=BUILT_UP,
        speed_label=f"{material.input_words} speed / rpm",
        words=words,
        waterfall=Figure("waterfall", "Waterfall", f"Source: {groups[0].source}.", words) if groups else None,
        cuts=Figure("cuts", "Order cuts", "Same speeds as above. Select orders below.", words),
        animated=bool(modes),
        modes=modes,
        responses=responses,
        measured=measured,
        ratio=MAX_SWEEP_RATIO,
    )
    return Part(html, material.run_data, "Resonances", "ranking")


# The list: a table for each variant of a result group, of which scripts show the selected one


def _of_group(material: ReportData, group: RunGroup, variant: str) -> dict[str, Any]:
    listed = material.lists[group.name, variant]
    ranking = group.rankings[variant]
    leads = material.headline is not None and group is material.headline.group and variant == group.main
    prefix = f"resonance:{group.name}:{variant}:"
    if group.responses:
        rows = _response_rows(material, ranking, listed, group, variant)
    else:
        rows = _run_rows(material, group, variant, listed)
    title = f"{Variant.of(variant).label.capitalize()}, inertia set {group.inertias}, {group.source}"
    table = _table(
        rows, listed, f"Resonances, {title}", "resonances" if leads else f"resonances-{group.name}-{variant}"
    )
    inside = sum(own.inside for own in listed)
    total = len(ranking.resonances) if group.responses else inside
    return {
        "group": group.name,
        "variant": variant,
        "title": title,
        "count": f"{inside}" if inside >= total else f"first {inside} of {total}",
        "table": replace(table, choices=[f"{prefix}{number}" for number in range(len(listed))]),
        "choice": prefix,
        "note": _list_note(material, ranking, bool(group.responses)),
        **_drawn(material, ranking, listed, group.runs[variant].modes),
    }


def _of_estimate(material: ReportData, headline: Headline) -> dict[str, Any]:
    """Return the list of an estimate from modes and static transmission errors."""
    ranking = headline.ranking
    listed = [listed_resonance(headline, own) for own in ranking.resonances[: 2 * SHOWN]]
    return {
        "group": None,
        "variant": None,
        "title": f"{Variant.of(headline.choice.variant).label.capitalize()}, {headline.source}",
        "count": f"{len(listed)}",
        "table": _table(_response_rows(material, ranking, listed), listed, "Resonances", "resonances"),
        "choice": "",
        "note": "Zero-to-peak amplitudes of single orders. " + note_of(material, headline),
        **_drawn(material, ranking, listed, headline.modes),
    }


def _table(rows: list[dict[str, object]], listed: Sequence[ListedResonance], caption: str, name: str) -> Table:
    kinds = ["" if n < SHOWN and own.inside else "further" if own.inside else "outside" for n, own in enumerate(listed)]
    texts = ("excited by", "place", "mode shape", "strain energy")
    hidden = ("from rated / %", "place", "mode", "prominence / dB", "± µm", "strain energy")
    return Table(rows, texts, caption=caption, name=name, sortable=True, stacked=True, hidden=hidden, kinds=kinds)


def note_of(material: ReportData, headline: Headline) -> str:
    """Say what the amplitudes of a ranking are of."""
    if headline.group is None:
        return (
            "Estimate: amplification of the mode times static transmission error, without shuttling of the load, which "
            "may cause several times as much; run exugear steady."
        )
    if headline.response is None:
        return "Amplitudes in the run-up; exugear steady adds bearing forces and accelerations at constant speed."
    return _ranked_by(material, headline.ranking)


def _ranked_by(material: ReportData, ranking: Ranking) -> str:
    band = material.context.gearbox.case.damping.modal_band_percent
    damping = "half to twice the value used" if band is None else f"{band[0]:g} to {band[1]:g} % of critical"
    return f"Ranked by {QUANTITIES[ranking.quantity].column} ({ranking.reason}). Range of damping: {damping}."


def _list_note(material: ReportData, ranking: Ranking, at_constant: bool) -> str:
    if not at_constant:
        return "Levels of the overall transmission error in the run-up, dB re 1 µm."
    text = "Zero-to-peak amplitudes of single orders"
    resonances = ranking.resonances
    if resonances and len(resonances[0].amplitudes) > 1:
        text += (
            ". Forces and accelerations: largest magnitude of the vector, at the bearing or mount where it is largest; "
            "of planets the root mean square"
        )
    if resonances and "acceleration" in resonances[0].amplitudes:
        parts = {HOUSING: "of the housing at bearing seats", SHAFTS: "of the shafts at bearings; the housing is rigid"}
        text += f". Accelerations: {parts.get(ranking.accelerates, f'of {ranking.accelerates} at bearings')}"
    return f"{text}. {_ranked_by(material, ranking)}"


def sorted_quantities(ranking: Ranking, resonance: Resonance) -> list[str]:
    """Return the quantities of a resonance, that which decides the ranking first."""
    return sorted(resonance.amplitudes, key=lambda name: name != ranking.quantity)


def _response_rows(
    material: ReportData,
    ranking: Ranking,
    listed: Sequence[ListedResonance],
    group: RunGroup | None = None,
    variant: str = "",
) -> list[dict[str, object]]:
    largest: dict[str, float] = {}
    for own in (own for own in listed if own.inside):
        for name, amplitude in (own.resonance.amplitudes if own.resonance else {}).items():
            largest[name] = max(largest.get(name, 1e-300), amplitude.amplitude)
    rows = []
    for number, own in enumerate(listed, start=1):
        row = _first_cells(material, number, own)
        assert own.resonance is not None
        for name in sorted_quantities(ranking, own.resonance):
            amplitude = own.resonance.amplitudes[name]
            label = QUANTITIES[name]
            value = label.factor * amplitude.amplitude
            caveat = "; ".join(map(material.words.labelled, own.caveats)) if name == ranking.quantity else ""
            bar = amplitude.amplitude / largest.get(name, math.inf)  # one that is higher outside has a full bar
            cell = Cell(rounded_text(value), value, bar=bar, kind=name, caveat=caveat)
            row[f"{label.column} ± / {label.unit}"] = cell
            if name != ranking.quantity:  # its rank is the number
                row[f"rank, {name}"] = _number(amplitude.place)
            if name == ranking.quantity and "force" in largest:
                row["place"] = material.words.of(amplitude.at) if amplitude.at else "–"
        if group is not None:
            row |= _levels_elsewhere(group, variant, own)
        row |= _mode_cells(material, group, variant, own)
        rows.append(row)
    return rows


def _run_rows(
    material: ReportData, group: RunGroup, variant: str, listed: Sequence[ListedResonance]
) -> list[dict[str, object]]:
    rows = []
    for number, own in enumerate(listed, start=1):
        found = own.peak
        assert found is not None
        peak = group.shown_peak(found)
        row = _first_cells(material, number, own)
        missed = found.missed if peak is found.peak else 0.0
        too_fast = f"The run-up is too fast: {missed:.0f} dB are missing." if missed >= BUILT_UP else ""
        row["level / dB"] = Cell(f"{peak.level:.1f}", peak.level, tag="mind" if too_fast else "", caveat=too_fast)
        if variant in group.constant:
            at = found.constant
            row["constant speed / dB"] = Cell("–", math.nan) if at is None else Cell(f"{at.level:.1f}", at.level)
        amplitude = 10.0 ** (peak.level / 20.0)
        row["± µm"] = Cell(figure_text(amplitude, 2), amplitude)
        row["prominence / dB"] = Cell(figure_text(peak.prominence, 2), peak.prominence)
        row |= _levels_elsewhere(group, variant, own)
        row |= _mode_cells(material, group, variant, own)
        always = is_found_always(own)
        row["windows"] = Cell("all" if always else "window-dependent", float(always), tag="good" if always else "mind")
        rows.append(row)
    return rows


def _first_cells(material: ReportData, number: int, own: ListedResonance) -> dict[str, object]:
    rated = material.rated_rpm
    rpm = own.speed / RPM
    row: dict[str, object] = {
        "No.": Cell(str(number), number, tag="rank"),
        "speed / rpm": Cell(rounded_text(rpm), rpm),
        "frequency / Hz": Cell(rounded_text(own.frequency), own.frequency),
    }
    if rated is not None:
        off = 100.0 * (rpm / rated - 1.0)
        row["from rated / %"] = Cell(f"{off:+.0f}".replace("-", "−").replace("+0", "0").replace("−0", "0"), off)
    row["excited by"] = material.words.line(own.line)
    return row


def _levels_elsewhere(group: RunGroup, variant: str, own: ListedResonance) -> dict[str, object]:
    """Return the level of the transmission error of each other variant at a resonance."""
    row: dict[str, object] = {}
    for name in (name for name in group.runs if name != variant):
        level = math.nan if own.peak is None else own.peak.elsewhere[name]
        cell = Cell(f"{level:.1f}" if math.isfinite(level) else "–", level)
        if own.peak is not None and name in own.peak.lacking:
            cell = Cell("absent", math.nan, tag="plain")
        row[f"TE {Variant.of(name).label} / dB"] = cell
    return row


def _mode_cells(material: ReportData, group: RunGroup | None, variant: str, own: ListedResonance) -> dict[str, object]:
    headline = material.headline
    modes = group.runs[variant].modes if group is not None else headline.modes if headline is not None else None
    if own.mode is None or modes is None:
        name = own.peak.finding.mode_name if own.peak is not None and modes is None else ""
        return {"mode": _number(None), "mode shape": material.words.labelled(name) or NOT_NEAR}
    choice = group.choice(variant) if group is not None else headline.choice if headline is not None else Choice()
    return {
        "mode": replace(_number(own.mode + 1), choice=f"mode:{model_name(choice)}:{own.mode}"),
        "mode shape": material.words.moves(modes, own.mode),
    }


def _number(value: int | None) -> Cell:
    return Cell("–", math.nan) if value is None else Cell(str(value), value)


def _drawn(
    material: ReportData, ranking: Ranking, listed: Sequence[ListedResonance], modes: xr.Dataset | None
) -> dict[str, Any]:
    """Return the speeds of a list, and orders and modes with its first resonances, for desktops and phones."""
    low, high = (rounded_text(speed / RPM) for speed in ranking.speeds)
    evaluated = {"range": f"{low} to {high} rpm", "whole": ranking.whole}
    inside = [own for own in listed if own.inside][:SHOWN]
    if not inside:
        return {**evaluated, "campbell": []}
    drawn = tuple(Resonance(own.line.name, own.line.order, own.speed, own.frequency, {}) for own in inside)
    frequencies = np.zeros(0)
    matched: dict[int, int] = {}
    if modes is not None:
        frequencies = modes["frequency"].to_numpy()
        matched = {number: own.mode for number, own in enumerate(inside, start=1) if own.mode is not None}
    # One line for each mesh, and those of the circles.
    single = [line for line in material.lines if " × " not in line.name]
    orders = {round(line.order, 6): line for line in [*(own.line for own in inside), *single]}
    lines = [(line, material.words.line(line)) for _, line in sorted(orders.items())]
    words = "Orders are lines through the origin, modes are horizontal lines; circles have the numbers of the list."
    shown = replace(ranking, resonances=drawn)
    drawings = [
        campbell_drawing(shown, lines, frequencies, matched, material.rated_rpm, size, words) for size in CAMPBELL
    ]
    return {**evaluated, "campbell": drawings}


# All modes of each model


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


# Further results of each steady-state response

PEAKS = 20
"""Number of peaks that are compared with run-ups, and listed of a continuation."""
NOTICED_RANGE = 0.01
"""Range of a natural frequency over the angle of the carrier, over it, from which it is drawn."""
STRONG = 0.1
"""Fraction of the largest peak from which a crossing counts as strong."""
TOO_FAST = "too fast"
SIDEBAND_PEAKS, SHOWN_SIDEBANDS = 5, 6
"""Number of peaks with listed sidebands (the highest of each order), and maximum number of sidebands of each kind."""
OTHER_KIND = "other"
"""Legend for modes that belong to no planet set."""
WHIRLING = 0.3
"""Whirl ratio above which forward or backward whirl is listed."""
BELOW = 6.0
"""Margin (dB) below the lowest steady-state level under which an order cut of a run-up is only noise."""
SAME_SPEED = 0.02
"""Relative speed difference within which a peak belongs to the crossing of its order with a mode."""


def _response(material: ReportData, data: xr.Dataset) -> dict[str, Any]:
    context = material.context
    choice = choice_of(data.attrs)
    runs = [run for run in material.results.runs if choice_of(run.attributes) == choice]
    label = response_label(data)
    context.tell(f"steady-state response, {label}")
    found = peaks(data)
    rates = {}
    for run in runs:
        stored, _ = read_run(run.path, ("time", "input_speed"))
        rates[str(run.attributes["load_case"])] = sweep_rate(stored["time"], stored["input_speed"], 1.0)
    rows = [_row(material, peak, data, rates) for peak in found[:PEAKS]]
    lost = [row for row in rows if any(value == TOO_FAST for value in row.values())]
    warnings = [
        f"the run-up of the load case {run.attributes['load_case']} has another load ({run.attributes['load']}), which "
        "also changes its levels."
        for run in runs
        if run.attributes.get("table_doubt")
    ]
    if lost:
        warnings.append(
            f"run-ups are too fast for {len(lost)} of the {len(rows)} highest peaks and underestimate them."
        )
    context.notes.statements.extend(f"Steady-state response, {label}: {warning}" for warning in warnings)
    name = f"{data.attrs['method']}-{model_name(choice)}"
    # Responses over speed are in the list and in the diagrams; continuations turn back and have their own.
    apart = not is_over_speed(data)
    return {
        "model": model_name(choice),
        "title": capitalised(label),
        "load": static_load_in_words(context.gearbox),
        "warnings": warnings,
        "growth": float(data.attrs["growth_rate"]),
        # A source of shared orders is not identifiable by frequency.
        "shared": material.words.labelled(str(data.attrs["shared_lines"])),
        "remarks": Table(_remarks(data), ("remark",), caption="Warnings by speed", name=f"remarks-{name}"),
        "speeds": data.sizes["point"] + len(json.loads(str(data.attrs["not_converged"]))),
        "branches": settings_of(data.attrs).branches,
        "orders": _order_charts(material, data, runs, f"steady-{name}") if apart else [],
        "peaks": Table(
            rows if apart else [],
            ("order",),
            caption=f"Peaks of the steady-state response, {label}",
            name=f"peaks-{name}",
            sortable=True,
        ),
        "contributions": _contributions_table(material, data, f"made-by-{name}"),
        "campbell": _campbell(material, data, f"campbell-{name}", label),
        "sound": sound_power(material, data, f"sound-{name}"),
        "ranges": list(_ranges(context)),
        "sidebands": Table(_sidebands(material, data, found), ("sideband", "cause"), name=f"sidebands-{name}"),
        "passages": material.words.labelled(_passages(context, _carriers(context))),
    }


def _remarks(data: xr.Dataset) -> list[dict[str, object]]:
    """Return rows of the speeds with warnings, and those without a converged state."""
    speeds = data["speed"].to_numpy()
    said = [(abs(float(speed)), str(words)) for speed, words in zip(speeds, data["remark"].to_numpy(), strict=True)]
    lost = [
        (abs(float(point["speed"])), f"not converged: {point['reason']}")
        for point in json.loads(str(data.attrs["not_converged"]))
    ]
    entries = sorted([own for own in said if own[1]] + lost)
    return [{"speed / rpm": f"{speed / RPM:.2f}", "remark": words} for speed, words in entries]


def _order_charts(material: ReportData, data: xr.Dataset, runs: Sequence[VariantRun], name: str) -> list[Figure]:
    """Draw order cuts at constant speed together with those of run-ups, one chart per order."""
    return [
        material.chart(
            f"{name}-{number}",
            material.words.line(line),
            "",
            f"Overall transmission error along {material.words.line_sentence(line)}.",
            _curves(data, runs, line),
            [ChartAxis(f"{material.input_words} speed / rpm"), ChartAxis("level / dB re 1 µm")],
        )
        for number, line in enumerate(order_lines(material.context.gearbox, 2))
        if line.place(data["order"].to_numpy()) is not None
    ]


def _contributions_table(material: ReportData, data: xr.Dataset, name: str) -> Table:
    labelled = material.words.labelled
    rows = []
    for peak in json.loads(data.attrs["contributions"]):
        speed = abs(float(peak["speed"]))
        rows.append(
            {
                "order": labelled(str(data["line"][peak["line"]].item())),
                "speed / rpm": f"{speed / RPM:.2f}",
                "excited by": labelled(shares(peak["meshes"].items())),
                "of this, moment of the shuttling load": labelled(shares(peak.get("shuttling", {}).items())) or "–",
                "responding modes": shares((f"{frequency:.1f} Hz", share) for frequency, share in peak["modes"]),
                "sensitivity to stiffness of": labelled(strongest(peak["supports"])),
                "sensitivity to inertia of": labelled(strongest(peak["bodies"])),
            }
        )
    texts = [heading for heading in (rows[0] if rows else ()) if heading != "speed / rpm"]
    return Table(rows, texts, caption="Contributions to resonances", name=name)


def _campbell(material: ReportData, data: xr.Dataset, name: str, label: str) -> tuple[Figure, Table] | None:
    """Draw and tabulate the modes over speed, with the crossings that excite them."""
    diagram = campbell_from(data)
    if not diagram.names or len(diagram.speeds) < 2:
        return None
    crossings = json.loads(data.attrs["crossings"])
    speeds = np.abs(diagram.speeds) / RPM
    curves = [
        Curve(f"{kind or OTHER_KIND}: mode {number}", speeds, frequency, "thin")
        for number, (kind, frequency) in enumerate(zip(diagram.kinds, diagram.frequency.T, strict=True), start=1)
    ]
    for mode, bounds in enumerate(diagram.over_angle):
        if bounds[1] - bounds[0] > NOTICED_RANGE:
            curves += [
                Curve(
                    f"mode {mode + 1}, {word} over the carrier's angle",
                    speeds,
                    share * diagram.frequency[:, mode],
                    "dashed",
                )
                for word, share in zip(("lowest", "highest"), bounds.tolist(), strict=True)
            ]
    highest = float(np.nanmax(diagram.frequency, initial=1.0))
    for line in order_lines(material.context.gearbox, 1):
        ends = np.array([0.0, float(speeds.max())])
        frequency = line.frequency(ends * RPM)
        reach = min(1.0, highest / max(float(frequency[1]), 1e-300))
        curves.append(Curve(material.words.line(line), reach * ends, reach * frequency, "dashed"))
    for strength, crossed in (("strong", True), ("weak", False)):
        own = [c for c in crossings if (c["share"] >= STRONG) == crossed]
        if own:
            x = np.array([abs(c["speed"]) / RPM for c in own])
            curves.append(Curve(f"{strength} crossings", x, [c["frequency"] for c in own], "points"))
    caption = (
        f"Natural frequencies over speed in the fixed frame, {label}; dots: crossings of modes and mesh harmonics that "
        "excite them."
    )
    figure = material.chart(
        name,
        "Natural frequencies over speed",
        "Horizontal lines: modes, by type. Dashed: mesh orders. Dots: excited crossings.",
        caption,
        curves,
        [ChartAxis(f"{material.input_words} speed / rpm"), ChartAxis("frequency / Hz")],
    )
    rows = _mode_rows(material, diagram, data, crossings)
    texts = ("type", "strongest crossing", "mode shape")
    return figure, Table(rows, texts, caption=caption, name=f"{name}-modes", sortable=True)


def _ranges(context: Context) -> Iterator[str]:
    """Yield the range of absolute input speeds of each load case as text."""
    for name, case in context.gearbox.load_cases.items():
        try:
            loads = summarise_loads(context.gearbox, case)
        except GearboxFileError as error:
            context.notes.left_out.append(f"speeds of load case {name}: {error}")
            continue
        slowest = min(abs(loads.start_speed), abs(loads.end_speed))
        if loads.start_speed * loads.end_speed < 0.0:
            slowest = 0.0
        yield f"{name}: {slowest / RPM:.4g} to {loads.fastest_speed / RPM:.4g} rpm"


def _mode_rows(
    material: ReportData, diagram: Campbell, data: xr.Dataset, crossings: Sequence[Mapping[str, float]]
) -> list[dict[str, object]]:
    """Return the rows of the modes, most excited first."""
    strongest: dict[int, Mapping[str, float]] = {}
    for crossing in crossings:
        mode = diagram.mode_at(crossing["speed"], crossing["frequency"])
        if mode is not None and crossing["share"] > strongest.get(mode, {"share": 0.0})["share"]:
            strongest[mode] = crossing
    rows: list[dict[str, object]] = []
    for mode in sorted(range(len(diagram.names)), key=lambda m: -strongest.get(m, {"share": 0.0})["share"]):
        met = strongest.get(mode)
        known = np.flatnonzero(~np.isnan(diagram.frequency[:, mode]))
        known = known[np.argsort(np.abs(diagram.speeds[known]))]
        slow, fast = diagram.frequency[known[[0, -1]], mode]
        whirl = float(diagram.whirl[known[-1], mode])
        row: dict[str, object] = {
            "mode": mode + 1,
            "at lowest speed / Hz": f"{slow:.1f}",
            "at highest speed / Hz": f"{fast:.1f}",
            "damping / %": f"{100.0 * diagram.damping[known[-1], mode]:.3f}",
            "type": diagram.kinds[mode],
            "whirl": "" if abs(whirl) <= WHIRLING else "forward" if whirl > 0.0 else "backward",
            "strongest crossing": "",
            "fraction / %": "",
            "mode shape": material.words.labelled(diagram.names[mode]),
        }
        if np.ptp(diagram.over_angle) > 0.0:
            low, high = 100.0 * (diagram.over_angle[mode] - 1.0)
            row["over the carrier's angle / %"] = f"{round(low, 2) + 0.0:.2f} to {high:+.2f}"
        if met is not None:
            line = str(data["line"][int(met["line"])].item())
            row["strongest crossing"] = f"{material.words.labelled(line)} at {abs(met['speed']) / RPM:.1f} rpm"
            row["fraction / %"] = f"{100.0 * met['share']:.1f}"
        rows.append(row)
    return rows


def _sidebands(material: ReportData, data: xr.Dataset, found: Sequence[Peak]) -> list[dict[str, object]]:
    """Return rows of the sidebands of the highest peaks, each with its cause."""
    context = material.context
    labelled = material.words.labelled
    carriers = _carriers(context)
    loudest: dict[str, Peak] = {}
    for peak in found:
        loudest.setdefault(peak.line, peak)
    rows: list[dict[str, object]] = []
    for peak in list(loudest.values())[:SIDEBAND_PEAKS]:
        bands = (*sidebands(data, peak)[:SHOWN_SIDEBANDS], *planet_sidebands(data, peak, carriers)[:SHOWN_SIDEBANDS])
        for band in bands:
            amplitude = f"{1e6 * band.amplitude:.3g} µm"
            if band.line.startswith("mesh_force "):
                amplitude = f"{band.amplitude:.3g} N"
            rows.append(
                {
                    "peak": f"{labelled(peak.line)} at {abs(peak.speed) / RPM:.1f} rpm",
                    "peak / Hz": f"{peak.frequency:.1f}",
                    "sideband": labelled(band.line.replace("mesh_force ", "force of mesh ")),
                    "at / Hz": f"{band.frequency:.1f}",
                    "offset / Hz": f"{band.frequency - peak.frequency:+.2f}",
                    "amplitude": amplitude,
                    "fraction / %": f"{100.0 * band.share:.1f}",
                    "cause": labelled(band.cause),
                }
            )
    return rows


def _passages(context: Context, carriers: Mapping[str, tuple[str, float]]) -> str:
    """State the planet passing order at the housing, and the ratio of the mesh order to it."""
    gearbox = context.gearbox
    orders = {mesh.family: gearbox.train.mesh_frequencies(2.0 * np.pi)[mesh.name] for mesh in gearbox.meshes}
    entries = []
    for family, (carrier, ratio) in carriers.items():
        count = sum(mesh.family == family for mesh in gearbox.meshes)
        passage = count * abs(ratio)
        entries.append(
            f"{family}: {count} planets of {carrier} pass a point of the housing at order {passage:g}; the mesh order "
            f"{orders[family]:g} is {orders[family] / passage:g} times this."
        )
    return " ".join(entries)


def _carriers(context: Context) -> dict[str, tuple[str, float]]:
    """Return the carrier of the planets of each mesh family, and its revolutions per revolution of the input."""
    gearbox = context.gearbox
    speeds = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    own = {mesh.family: mesh.frame for mesh in gearbox.meshes if mesh.frame != GROUND}
    return {family: (frame, speeds[frame]) for family, frame in own.items() if speeds.get(frame)}


def _curves(data: xr.Dataset, runs: Sequence[VariantRun], line: OrderLine) -> list[Curve]:
    place = line.place(data["order"].to_numpy())
    amplitude = data["amplitude"].to_numpy()[:, place, 0].astype(np.float64)
    speed = np.abs(data["speed"].to_numpy()) / RPM
    level = _level(amplitude)
    quiet = float(level.min()) - BELOW
    curves = []
    for run in runs:
        stored, _ = read_run(run.path, ("time", "overall_dte", "input_speed"))
        cut = run_up_cut(stored["time"], stored["overall_dte"], stored["input_speed"], line)
        label = f"run-up {run.attributes['load_case']}"
        cut_level = _level(np.abs(cut.amplitude))
        heard = np.where(cut_level > quiet, cut_level, np.nan)
        curves.append(Curve(label, np.abs(cut.speed) / RPM, heard, "dashed"))
    # The steady-state curve comes last, above the run-ups, which show only where they deviate from it.
    if settings_of(data.attrs).branches:
        return [*curves, *branch_curves(speed, level, data["growth"].to_numpy())]
    return [*curves, Curve("steady", speed, level)]


def branch_curves(speed: Floats, level: Floats, growth: Floats) -> list[Curve]:
    """Split a continuation curve at turning points and stability changes; each part is a function of speed.

    Parameters
    ----------
    speed, level, growth : (n,) along the curve; states with a positive growth rate (1/s) are unstable
    """
    stable = ~(growth > 0.0)
    rising = np.diff(speed) >= 0.0
    # A part ends at a turning point, and before a point of different stability.
    turns = np.flatnonzero(rising[1:] != rising[:-1]) + 1
    ends = np.unique(np.concatenate([turns, np.flatnonzero(stable[1:] != stable[:-1]) + 1, [len(speed) - 1]]))
    curves = []
    first = 0
    for number, last in enumerate(ends, start=1):
        part = slice(first, last + 1)
        kind, style = ("stable", "line") if stable[part].mean() > 0.5 else ("unstable", "dashed")
        curves.append(Curve(f"{kind}: part {number}", speed[part], level[part], style))
        first = int(last)
    return curves


def _level(amplitude: Floats) -> Floats:
    """Return the level of an amplitude (m), dB re 1 µm."""
    return np.asarray(20.0 * np.log10(np.maximum(amplitude / 1e-6, 1e-6)))


def _row(material: ReportData, peak: Peak, data: xr.Dataset, rates: Mapping[str, float]) -> dict[str, object]:
    orders = data["order"].to_numpy()
    # Damping of the mode that the order of the peak crosses there, if known
    near = [
        (abs(crossing["speed"] - peak.speed), float(crossing["damping"]))
        for crossing in json.loads(data.attrs["crossings"])
        if abs(orders[crossing["line"]] - peak.order) < 1e-9 * peak.order
        and abs(crossing["speed"] - peak.speed) < SAME_SPEED * abs(peak.speed)
    ]
    damping = min(near)[1] if near else None
    row: dict[str, object] = {
        "order": material.words.labelled(peak.line),
        "speed / rpm": f"{abs(peak.speed) / RPM:.2f}",
        "frequency / Hz": f"{peak.frequency:.1f}",
        "amplitude / µm": figure_text(1e6 * peak.amplitude),
        "damping / %": "–" if damping is None else f"{100.0 * damping:.3f}",
    }
    for load_case, rate in rates.items():
        said = "–"
        if damping is not None:
            too_fast = sweep_severity(peak.frequency, damping, rate * peak.order) > MAX_SWEEP_RATIO
            said = TOO_FAST if too_fast else "slow enough"
        row[f"run-up {load_case}"] = said
    return row
