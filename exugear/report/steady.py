"""Section of the report on steady responses: levels along orders, peaks, too fast run-ups, modes over speed."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import xarray as xr

from exugear.campbell.campbell import Campbell, campbell_from
from exugear.loads.summary import summarise_loads
from exugear.model.parts import RPM
from exugear.model.reading import CaseError
from exugear.model.sections.entries import GROUND
from exugear.pictures.steady_diagrams import Mark, ModeCurve, OrderCurve, plot_campbell_over_speed, plot_order_curves
from exugear.report import page
from exugear.report.context import Context, choice_of, file_part, words_of
from exugear.report.stored import StoredResults
from exugear.results.run_file import load_run
from exugear.spectra.orders import OrderLine, order_lines
from exugear.spectra.run_spectra import VariantRun
from exugear.spectra.sweeps import TOO_FAST, run_up_cut, sweep_rate, sweep_severity
from exugear.steady.peaks import Peak, line_name, peaks, planet_sidebands, sidebands

SHOWN = 20
"""Peaks in a table."""
LEAST_SHARE, MOST_TOLD = 0.05, 3
"""Least share that is told of what makes a resonance, and how many."""
TELL_FAST = "too fast"
EXPLAINED, BESIDE = 5, 6
"""Peaks whose sidebands are told, the loudest of each line, and how many of each kind at most."""
OTHER_KIND = "other"
"""Kind of modes that no planet set carries, in the legend."""
WHIRLING = 0.3
"""Whirl from which its sense is told."""
SAME_SPEED = 0.02
"""Share of the speed within which a peak belongs to the crossing of its line with a mode."""


def steady_section(context: Context, results: StoredResults) -> str:
    """Show the steady responses, each with the run-ups of the same variant, law and inertia set over it."""
    if not results.steady:
        return ""
    return page.section("Steady response", *(_response(context, data, results.runs) for data in results.steady))


def _response(context: Context, data: xr.Dataset, runs: Sequence[VariantRun]) -> str:
    choice, level = choice_of(data.attrs), str(data.attrs["level"])
    own = [run for run in runs if choice_of(run.attributes) == choice]
    label = f"{words_of(choice)}, level {level}"
    context.tell(f"steady response, {label}")
    path = context.picture_path(f"steady-{level}-{file_part(choice)}")
    lines = [line for line in order_lines(context.gearbox, 2) if _place(data, line) is not None]
    plot_order_curves({line: _curves(data, own, line) for line in lines}, path)
    found = peaks(data)[:SHOWN]
    rates = {str(run.attributes["load_case"]): _unit_rate(run) for run in own}
    rows = [_row(peak, data, rates) for peak in found]
    lost = [row for row in rows if any(value == TELL_FAST for value in row.values())]
    if lost:
        context.notes.statements.append(
            f"Steady response, {label}: run-ups are too fast for {len(lost)} of its {len(rows)} loudest peaks, which "
            "they show too low."
        )
    growth = float(data.attrs["growth_rate"])
    content = [
        page.alert("Unstable", [f"disturbances grow by up to {growth:.3g} 1/s"]) if growth > 0.0 else "",
        page.picture(
            path, f"Overall transmission error along orders at steady speed, and cut out of run-ups; {label}."
        ),
        page.table(rows, ("line",)),
        _contributions_table(data),
        _campbell(context, data, f"campbell-{level}-{file_part(choice)}", label),
        _sidebands_table(context, data, peaks(data)),
        page.paragraph(
            f"Slowest decay of a disturbance {-growth:.3g} 1/s. A run-up is called too fast for a resonance where "
            f"f' / (2 pi zeta^2 f^2) is above {TOO_FAST:g}: the peak does not build up."
        ),
    ]
    return page.section(label[0].upper() + label[1:], *content, level=3)


def _contributions_table(data: xr.Dataset) -> str:
    """Table of what makes the strongest resonances at the level `linear`."""
    bases, index = tuple(str(name) for name in data["base"].to_numpy()), data["index"].to_numpy()
    rows = []
    for own in json.loads(data.attrs["contributions"]):
        line, speed = own["line"], abs(float(own["speed"]))
        rows.append(
            {
                "line": line_name(tuple(int(n) for n in index[line]), bases),
                "speed / rpm": f"{speed / RPM:.2f}",
                "excited by": _shares(own["meshes"].items()),
                "carried by": _shares((f"{frequency:.1f} Hz", share) for frequency, share in own["modes"]),
                "per stiffness of": _slopes_of(own["supports"]),
                "per inertia of": _slopes_of(own["bodies"]),
            }
        )
    if not rows:
        return ""
    said = "What makes resonances: shares of the amplitude, and its relative change per relative change of a parameter"
    return page.folded(
        said, page.table(rows, ("line", "excited by", "carried by", "per stiffness of", "per inertia of"))
    )


def _campbell(context: Context, data: xr.Dataset, name: str, label: str) -> str:
    """Picture and table of the modes over speed, with the crossings that excite them."""
    diagram = campbell_from(data)
    if not diagram.names or len(diagram.speeds) < 2:
        return ""
    crossings = json.loads(data.attrs["crossings"])
    path = context.picture_path(name)
    curves = [
        ModeCurve(kind or OTHER_KIND, np.abs(diagram.speeds), frequency)
        for kind, frequency in zip(diagram.kinds, diagram.frequency.T, strict=True)
    ]
    marks = [Mark(abs(own["speed"]), own["frequency"], own["share"]) for own in crossings]
    plot_campbell_over_speed(curves, order_lines(context.gearbox, 1), marks, _ranges(context), path)
    caption = (
        f"Modes over speed as seen from the housing, {label}; circles where mesh orders and their harmonics meet "
        "modes, as large as these are excited."
    )
    rows = _mode_rows(diagram, data, crossings)
    return page.picture(path, caption) + page.folded(
        "Modes over speed and the crossing that excites each most: share of the largest peak of a signal",
        page.table(rows, ("type", "strongest crossing", "what moves")),
    )


def _ranges(context: Context) -> dict[str, tuple[float, float]]:
    """Speeds of the input that each load case passes, without sign, rad/s."""
    ranges = {}
    for name, case in context.gearbox.load_cases.items():
        try:
            loads = summarise_loads(context.gearbox, case)
        except CaseError as error:
            context.notes.left_out.append(f"speeds of load case {name}: {error}")
            continue
        slowest = min(abs(loads.start_speed), abs(loads.end_speed))
        ranges[name] = (0.0 if loads.start_speed * loads.end_speed < 0.0 else slowest, loads.fastest_speed)
    return ranges


def _mode_rows(
    diagram: Campbell, data: xr.Dataset, crossings: Sequence[Mapping[str, float]]
) -> list[dict[str, object]]:
    """Rows of the modes, those that are excited most first."""
    bases, index = tuple(str(name) for name in data["base"].to_numpy()), data["index"].to_numpy()
    strongest: dict[int, Mapping[str, float]] = {}
    for own in crossings:
        mode = diagram.mode_at(own["speed"], own["frequency"])
        if mode is not None and own["share"] > strongest.get(mode, {"share": 0.0})["share"]:
            strongest[mode] = own
    rows: list[dict[str, object]] = []
    for mode in sorted(range(len(diagram.names)), key=lambda m: -strongest.get(m, {"share": 0.0})["share"]):
        met = strongest.get(mode)
        known = np.flatnonzero(~np.isnan(diagram.frequency[:, mode]))
        known = known[np.argsort(np.abs(diagram.speeds[known]))]
        slow, fast = diagram.frequency[known[[0, -1]], mode]
        whirl = float(diagram.whirl[known[-1], mode])
        row: dict[str, object] = {
            "mode": mode + 1,
            "slow / Hz": f"{slow:.1f}",
            "fast / Hz": f"{fast:.1f}",
            "damping / %": f"{100.0 * diagram.damping[known[-1], mode]:.3f}",
            "type": diagram.kinds[mode],
            "whirl": "forward" if whirl > WHIRLING else "backward" if whirl < -WHIRLING else "",
            "strongest crossing": "",
            "share / %": "",
            "what moves": diagram.names[mode],
        }
        if met is not None:
            line = line_name(tuple(int(n) for n in index[int(met["line"])]), bases)
            row["strongest crossing"] = f"{line} at {abs(met['speed']) / RPM:.1f} rpm"
            row["share / %"] = f"{100.0 * met['share']:.1f}"
        rows.append(row)
    return rows


def _sidebands_table(context: Context, data: xr.Dataset, found: Sequence[Peak]) -> str:
    """Table of the lines beside the loudest peaks, each with its cause."""
    carriers = _carriers(context)
    loudest: dict[str, Peak] = {}
    for peak in found:
        loudest.setdefault(peak.line, peak)
    rows = []
    for peak in list(loudest.values())[:EXPLAINED]:
        bands = (*sidebands(data, peak)[:BESIDE], *planet_sidebands(data, peak, carriers)[:BESIDE])
        for band in bands:
            rows.append(
                {
                    "peak": f"{peak.line} at {abs(peak.speed) / RPM:.1f} rpm",
                    "peak / Hz": f"{peak.frequency:.1f}",
                    "beside it": band.line,
                    "at / Hz": f"{band.frequency:.1f}",
                    "apart / Hz": f"{band.frequency - peak.frequency:+.2f}",
                    "amplitude": _amplitude(band.line, band.amplitude),
                    "share / %": f"{100.0 * band.share:.1f}",
                    "cause": band.cause,
                }
            )
    if not rows:
        return ""
    said = "Sidebands of the loudest peaks and their causes: lines at the speed of the peak that other meshes or the "
    table = page.table(rows, ("beside it", "cause"))
    return page.folded(f"{said}turning planets make", page.paragraph(_passages(context, carriers)) + table)


def _passages(context: Context, carriers: Mapping[str, tuple[str, float]]) -> str:
    """Tell how often planets pass a place of the housing, and how that goes into the order of their meshes."""
    gearbox = context.gearbox
    orders = {mesh.family: gearbox.train.mesh_frequencies(2.0 * np.pi)[mesh.name] for mesh in gearbox.meshes}
    told = []
    for family, (carrier, ratio) in carriers.items():
        count = sum(mesh.family == family for mesh in gearbox.meshes)
        passage = count * abs(ratio)
        told.append(
            f"{family}: {count} planets of {carrier} pass a place of the housing at order {passage:g}, which goes "
            f"{orders[family] / passage:g} times into the order of the meshes, {orders[family]:g}."
        )
    return " ".join(told)


def _amplitude(line: str, amplitude: float) -> str:
    return f"{amplitude:.3g} N" if line.startswith("mesh_force ") else f"{1e6 * amplitude:.3g} µm"


def _carriers(context: Context) -> dict[str, tuple[str, float]]:
    """Carrier of the planets of each family of meshes, and its turns per turn of the input."""
    gearbox = context.gearbox
    speeds = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    own = {mesh.family: mesh.frame for mesh in gearbox.meshes if mesh.frame != GROUND}
    return {family: (frame, speeds[frame]) for family, frame in own.items() if speeds.get(frame)}


def _shares(parts: Iterable[tuple[str, float]]) -> str:
    told = [f"{name} {100.0 * share:.0f} %" for name, share in parts if abs(share) >= LEAST_SHARE]
    return ", ".join(told[:MOST_TOLD])


def _slopes_of(slopes: Mapping[str, float]) -> str:
    strongest = sorted(slopes.items(), key=lambda item: -abs(item[1]))[:MOST_TOLD]
    return ", ".join(f"{name} {slope:+.2f}" for name, slope in strongest)


def _place(data: xr.Dataset, line: OrderLine) -> int | None:
    """Place of an order among the lines of a response."""
    order = data["order"].to_numpy()
    place = int(np.argmin(np.abs(order - line.order)))
    return place if abs(order[place] - line.order) < 1e-6 * line.order else None


def _curves(data: xr.Dataset, runs: Sequence[VariantRun], line: OrderLine) -> list[OrderCurve]:
    place = _place(data, line)
    amplitude = data["amplitude"].to_numpy()[:, place, 0].astype(np.float64)
    curves = [OrderCurve("steady", np.abs(data["speed"].to_numpy()), amplitude, True)]
    for run in runs:
        stored = load_run(run.path, ("time", "overall_dte", "input_speed"))
        time, values, speed = (stored[name].to_numpy() for name in ("time", "overall_dte", "input_speed"))
        cut = run_up_cut(time, values, speed, line)
        curves.append(OrderCurve(f"run, {run.attributes['load_case']}", cut.speed, np.abs(cut.amplitude), False))
    return curves


def _unit_rate(run: VariantRun) -> float:
    """Rate at which order one sweeps in a run, Hz/s."""
    stored = load_run(run.path, ("time", "input_speed"))
    return sweep_rate(stored["time"].to_numpy(), stored["input_speed"].to_numpy(), 1.0)


def _row(peak: Peak, data: xr.Dataset, rates: dict[str, float]) -> dict[str, object]:
    damping = _damping(peak, data)
    row: dict[str, object] = {
        "line": peak.line,
        "speed / rpm": f"{abs(peak.speed) / RPM:.2f}",
        "frequency / Hz": f"{peak.frequency:.1f}",
        "amplitude / µm": f"{1e6 * peak.amplitude:.3f}",
        "damping / %": "–" if damping is None else f"{100.0 * damping:.3f}",
    }
    for load_case, rate in rates.items():
        too_fast = damping is not None and sweep_severity(peak.frequency, damping, rate * peak.order) > TOO_FAST
        row[f"run {load_case}"] = "–" if damping is None else TELL_FAST if too_fast else "slow enough"
    return row


def _damping(peak: Peak, data: xr.Dataset) -> float | None:
    """Damping of the mode that the line of a peak crosses there, where one is known."""
    orders, near = data["order"].to_numpy(), []
    for crossing in json.loads(data.attrs["crossings"]):
        same = abs(orders[crossing["line"]] - peak.order) < 1e-9 * peak.order
        if same and abs(crossing["speed"] - peak.speed) < SAME_SPEED * abs(peak.speed):
            near.append((abs(crossing["speed"] - peak.speed), float(crossing["damping"])))
    return min(near)[1] if near else None
