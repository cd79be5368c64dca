"""Section "Steady-state response": order cuts, peaks, run-ups that are too fast, modes over speed, sidebands."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.load_cases import static_load_in_words, summarise_loads
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.sections.entries import GROUND
from exugear.gearbox.units import RPM
from exugear.report.findings.context import METHOD_LABELS, Context, choice_of, model_label
from exugear.report.findings.words import figure_text
from exugear.report.sections.material import ChartAxis, Curve, Part, ReportData, model_name
from exugear.report.web.html import Figure, Table, render
from exugear.results.run_file import read_run
from exugear.results.spectra.resonances import MAX_SWEEP_RATIO, run_up_cut, sweep_rate, sweep_severity
from exugear.results.spectra.run_spectra import VariantRun
from exugear.results.spectra.waterfall import OrderLine, order_lines
from exugear.steady.campbell import Campbell, campbell_from
from exugear.steady.peaks import Peak, line_name, peaks, planet_sidebands, sidebands
from exugear.steady.steady_file import settings_of
from fe_ste.tools.arrays import Floats

SHOWN = 20
"""Number of peaks in the table."""
LEAST_SHARE, SHOWN_CONTRIBUTIONS = 0.05, 3
"""Minimum listed contribution to a resonance, and maximum number of contributions."""
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


def steady_section(material: ReportData) -> Part:
    """Show the steady-state responses, each with the run-ups of the same variant, mesh model and inertia set."""
    if not material.results.steady:
        return Part()
    html = render("steady", responses=[_response(material, data) for data in material.results.steady])
    return Part(html, title="Steady-state response", name="steady")


def _response(material: ReportData, data: xr.Dataset) -> dict[str, Any]:
    context = material.context
    choice = choice_of(data.attrs)
    level = str(data.attrs["method"])
    runs = [run for run in material.results.runs if choice_of(run.attributes) == choice]
    label = f"{model_label(choice)}, {METHOD_LABELS[level]}"
    context.tell(f"steady-state response, {label}")
    found = peaks(data)[:SHOWN]
    rates = {str(run.attributes["load_case"]): _unit_rate(run) for run in runs}
    rows = [_row(material, peak, data, rates) for peak in found]
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
    name = f"{level}-{model_name(choice)}"
    return {
        "title": label[0].upper() + label[1:],
        "load": static_load_in_words(context.gearbox),
        "warnings": warnings,
        "growth": float(data.attrs["growth_rate"]),
        # A source of shared orders is not identifiable by frequency.
        "shared": material.words.labelled(str(data.attrs["shared_lines"])),
        "remarks": Table(_remarks(data), ("remark",), caption="Warnings by speed", name=f"remarks-{name}"),
        "speeds": data.sizes["point"] + len(json.loads(str(data.attrs["not_converged"]))),
        "run_ups": bool(runs),
        "branches": settings_of(data.attrs).branches,
        "orders": _order_charts(material, data, runs, f"steady-{name}"),
        "peaks": Table(
            rows,
            ("order",),
            caption=f"Peaks of the steady-state response, {label}",
            name=f"peaks-{name}",
            sortable=True,
        ),
        "contributions": _contributions_table(material, data, f"made-by-{name}"),
        "campbell": _campbell(material, data, f"campbell-{name}", label),
        "ranges": [
            f"{load_case}: {slow / RPM:.4g} to {fast / RPM:.4g} rpm"
            for load_case, (slow, fast) in _ranges(context).items()
        ],
        "sidebands": Table(_sidebands(material, data, peaks(data)), ("sideband", "cause"), name=f"sidebands-{name}"),
        "passages": material.words.labelled(_passages(context, _carriers(context))),
        "ratio": MAX_SWEEP_RATIO,
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
        if _place(data, line) is not None
    ]


def _contributions_table(material: ReportData, data: xr.Dataset, name: str) -> Table:
    """Tabulate the contributions to the strongest resonances (method `linear`)."""
    labelled = material.words.labelled
    bases = tuple(str(name) for name in data["base"].to_numpy())
    index = data["index"].to_numpy()
    rows = []
    for peak in json.loads(data.attrs["contributions"]):
        line = peak["line"]
        speed = abs(float(peak["speed"]))
        rows.append(
            {
                "order": labelled(line_name(tuple(int(n) for n in index[line]), bases)),
                "speed / rpm": f"{speed / RPM:.2f}",
                "excited by": labelled(_shares(peak["meshes"].items())),
                "responding modes": _shares((f"{frequency:.1f} Hz", share) for frequency, share in peak["modes"]),
                "sensitivity to stiffness of": labelled(_slopes_of(peak["supports"])),
                "sensitivity to inertia of": labelled(_slopes_of(peak["bodies"])),
            }
        )
    texts = ("order", "excited by", "responding modes", "sensitivity to stiffness of", "sensitivity to inertia of")
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


def _ranges(context: Context) -> dict[str, tuple[float, float]]:
    """Return the absolute input speed range of each load case, rad/s."""
    ranges = {}
    for name, case in context.gearbox.load_cases.items():
        try:
            loads = summarise_loads(context.gearbox, case)
        except GearboxFileError as error:
            context.notes.left_out.append(f"speeds of load case {name}: {error}")
            continue
        slowest = min(abs(loads.start_speed), abs(loads.end_speed))
        ranges[name] = (0.0 if loads.start_speed * loads.end_speed < 0.0 else slowest, loads.fastest_speed)
    return ranges


def _mode_rows(
    material: ReportData, diagram: Campbell, data: xr.Dataset, crossings: Sequence[Mapping[str, float]]
) -> list[dict[str, object]]:
    """Return the rows of the modes, most excited first."""
    bases = tuple(str(name) for name in data["base"].to_numpy())
    index = data["index"].to_numpy()
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
            "whirl": _whirl_text(whirl),
            "strongest crossing": "",
            "fraction / %": "",
            "mode shape": material.words.labelled(diagram.names[mode]),
        }
        if met is not None:
            line = line_name(tuple(int(n) for n in index[int(met["line"])]), bases)
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
            rows.append(
                {
                    "peak": f"{labelled(peak.line)} at {abs(peak.speed) / RPM:.1f} rpm",
                    "peak / Hz": f"{peak.frequency:.1f}",
                    "sideband": labelled(band.line.replace("mesh_force ", "force of mesh ")),
                    "at / Hz": f"{band.frequency:.1f}",
                    "offset / Hz": f"{band.frequency - peak.frequency:+.2f}",
                    "amplitude": _amplitude(band.line, band.amplitude),
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


def _amplitude(line: str, amplitude: float) -> str:
    if line.startswith("mesh_force "):
        return f"{amplitude:.3g} N"
    return f"{1e6 * amplitude:.3g} µm"


def _carriers(context: Context) -> dict[str, tuple[str, float]]:
    """Return the carrier of the planets of each mesh family, and its revolutions per revolution of the input."""
    gearbox = context.gearbox
    speeds = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    own = {mesh.family: mesh.frame for mesh in gearbox.meshes if mesh.frame != GROUND}
    return {family: (frame, speeds[frame]) for family, frame in own.items() if speeds.get(frame)}


def _shares(parts: Iterable[tuple[str, float]]) -> str:
    entries = [f"{name} {100.0 * share:.0f} %" for name, share in parts if abs(share) >= LEAST_SHARE]
    return ", ".join(entries[:SHOWN_CONTRIBUTIONS])


def _slopes_of(slopes: Mapping[str, float]) -> str:
    strongest = sorted(slopes.items(), key=lambda item: -abs(item[1]))[:SHOWN_CONTRIBUTIONS]
    return ", ".join(f"{name} {slope:+.2f}" for name, slope in strongest)


def _place(data: xr.Dataset, line: OrderLine) -> int | None:
    """Return the index of an order among the spectral components of a response."""
    order = data["order"].to_numpy()
    index = int(np.argmin(np.abs(order - line.order)))
    if abs(order[index] - line.order) < 1e-6 * line.order:
        return index
    return None


def _curves(data: xr.Dataset, runs: Sequence[VariantRun], line: OrderLine) -> list[Curve]:
    place = _place(data, line)
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


def _unit_rate(run: VariantRun) -> float:
    """Return the sweep rate of order one in a run, Hz/s."""
    stored, _ = read_run(run.path, ("time", "input_speed"))
    return sweep_rate(stored["time"], stored["input_speed"], 1.0)


def _whirl_text(whirl: float) -> str:
    if abs(whirl) <= WHIRLING:
        return ""
    return "forward" if whirl > 0.0 else "backward"


def _row(material: ReportData, peak: Peak, data: xr.Dataset, rates: dict[str, float]) -> dict[str, object]:
    damping = _damping(peak, data)
    row: dict[str, object] = {
        "order": material.words.labelled(peak.line),
        "speed / rpm": f"{abs(peak.speed) / RPM:.2f}",
        "frequency / Hz": f"{peak.frequency:.1f}",
        "amplitude / µm": figure_text(1e6 * peak.amplitude),
        "damping / %": "–" if damping is None else f"{100.0 * damping:.3f}",
    }
    for load_case, rate in rates.items():
        too_fast = damping is not None and sweep_severity(peak.frequency, damping, rate * peak.order) > MAX_SWEEP_RATIO
        if damping is None:
            row[f"run-up {load_case}"] = "–"
        elif too_fast:
            row[f"run-up {load_case}"] = TOO_FAST
        else:
            row[f"run-up {load_case}"] = "slow enough"
    return row


def _damping(peak: Peak, data: xr.Dataset) -> float | None:
    """Return the damping of the mode that the order of a peak crosses there, if known."""
    orders = data["order"].to_numpy()
    near = []
    for crossing in json.loads(data.attrs["crossings"]):
        same = abs(orders[crossing["line"]] - peak.order) < 1e-9 * peak.order
        if same and abs(crossing["speed"] - peak.speed) < SAME_SPEED * abs(peak.speed):
            near.append((abs(crossing["speed"] - peak.speed), float(crossing["damping"])))
    if near:
        return min(near)[1]
    return None
