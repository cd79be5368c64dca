"""Comparisons with measured run-ups: what they say, measured and computed order cuts, and peaks."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.choice import choice_of
from exugear.gearbox.units import RPM
from exugear.report.findings.context import model_label
from exugear.report.sections.material import ChartAxis, Curve, ReportData, model_name
from exugear.report.web.html import Cell, Figure, Table
from exugear.steady.evaluation.measured_comparison import DRAWN_RANGE, DRAWN_UNITS

if TYPE_CHECKING:
    import xarray as xr

CHART_ORDERS = 3
"""Number of orders of a chart, those with the highest measured amplitudes: its curves differ in colour."""


def measured_run_up(material: ReportData, data: xr.Dataset) -> dict[str, Any]:
    """Return a stored comparison of the gearbox for the template of the resonances."""
    attributes = data.attrs
    choice = choice_of(attributes)
    name = f"measured-{attributes['measurement']}-{model_name(choice)}"
    material.context.notes.statements.append(f"Measured run-up {attributes['verdict']}")
    rows = [_row(material, peak) for peak in json.loads(str(attributes["peaks"]))]
    return {
        "title": f"Measured run-up {attributes['measurement']}, {model_label(choice)}",
        "verdict": str(attributes["verdict"]),
        "warnings": [material.words.labelled(text) for text in json.loads(str(attributes["warnings"]))],
        "window": str(attributes["window"]),
        "charts": [_chart(material, data, number, name) for number in range(data.sizes["channel"])],
        "peaks": Table(
            rows, ("order", "channel"), caption=f"Peaks of {attributes['measurement']}", name=name, sortable=True
        ),
    }


def _chart(material: ReportData, data: xr.Dataset, number: int, name: str) -> Figure:
    """Draw the highest orders of a channel over the speed, down to the range of the diagram of the command."""
    channel, quantity = str(data["channel"][number].item()), str(data["quantity"][number].item()).replace("_", " ")
    unit, factor = DRAWN_UNITS[str(data["unit"][number].item())]
    with np.errstate(divide="ignore"):
        measured, computed = (
            20.0 * np.log10(factor * data[kind].to_numpy()[number]) for kind in ("measured", "computed")
        )
    highest = np.where(np.isfinite(measured), measured, -np.inf).max(axis=1)
    speed = data["speed"].to_numpy() / RPM
    floor = float(highest.max()) - DRAWN_RANGE
    curves = []
    for line in sorted(np.argsort(-highest)[:CHART_ORDERS]):
        words = material.words.labelled(str(data["line"][line].item()))
        for kind, values, style in (("measured", measured, "line"), ("computed", computed, "dashed")):
            shown = np.where(values[line] > floor, values[line], np.nan)
            curves.append(Curve(f"{words}, {kind}", speed, shown, style))
    where = material.words.labelled(str(data["where"][number].item()))
    return material.chart(
        f"{name}-{channel}",
        f"{channel}: {quantity}, {where}",
        "Solid: measured; dashed: computed, swept along the measured speed.",
        f"Levels of the zero-to-peak amplitudes of the orders of {channel}; the peaks are in the table.",
        curves,
        [ChartAxis(f"{material.input_words} speed / rpm"), ChartAxis(f"level / dB re 1 {unit}")],
    )


def _row(material: ReportData, peak: dict[str, Any]) -> dict[str, object]:
    """Return a row of the table of peaks; a side without the peak has no speed."""
    unit, factor = DRAWN_UNITS[peak["unit"]]

    def number(key: str, form: str) -> Cell:
        value = peak[key]
        return Cell("none", float("nan")) if value is None else Cell(format(value, form), value)

    return {
        "order": material.words.labelled(peak["order"]),
        "channel": peak["channel"],
        "measured speed / rpm": number("measured_speed_rpm", ".1f"),
        "computed speed / rpm": number("computed_speed_rpm", ".1f"),
        "difference / %": Cell("jump", float("nan"))
        if peak["contact_loss"]
        else number("speed_difference_percent", "+.2f"),
        "measured": Cell(f"{factor * peak['measured_amplitude']:.3g} {unit}", factor * peak["measured_amplitude"]),
        "computed": Cell(f"{factor * peak['computed_amplitude']:.3g} {unit}", factor * peak["computed_amplitude"]),
        "level / dB": number("difference_dB", "+.1f"),
    }
