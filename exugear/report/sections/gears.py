"""Section "Static transmission error and gears": error curves over the mesh cycle, harmonics and gear data."""

from __future__ import annotations

import math

import numpy as np

from exugear.report.findings.context import HARMONICS, PairExcitation, excitations
from exugear.report.findings.words import figure_text
from exugear.report.sections.material import Axis, Curve, Part, ReportData
from exugear.report.web.html import Cell, Table, render


def gears_section(material: ReportData) -> Part:
    """Show the static transmission error of each pair with harmonics and stiffness, and the gear geometry."""
    found = excitations(material.context, material.results)
    curves = [Curve(material.words.of(own.pair), own.position, 1e6 * (own.error - own.error.mean())) for own in found]
    html = render(
        "gears",
        figure_of_error=material.chart(
            "ste",
            "Static transmission error over one mesh cycle",
            "Deviation from the mean.",
            "; ".join(f"{material.words.of(own.pair)} {_swing(own):.2f} µm peak-to-peak" for own in found),
            curves,
            [Axis("position in the mesh cycle"), Axis("transmission error / µm")],
        ),
        errors=Table([_row(material, own) for own in found], caption="Static transmission error", name="errors"),
        harmonics=Table([_harmonics_row(material, own) for own in found], caption="Harmonics", name="harmonics"),
        gears=Table(_gear_rows(material), caption="Gears", name="gears"),
    )
    return Part(html, title="Static transmission error", name="gears-section")


def _swing(excitation: PairExcitation) -> float:
    return 1e6 * float(np.ptp(excitation.error))


def _row(material: ReportData, excitation: PairExcitation) -> dict[str, object]:
    return {
        "pair": material.words.of(excitation.pair),
        "torque on gear 1 / N m": f"{excitation.torque:.1f}",
        "positions": excitation.position.size,
        "mean / µm": f"{1e6 * float(excitation.error.mean()):.2f}",
        "peak-to-peak / µm": Cell(f"{_swing(excitation):.3f}", _swing(excitation)),
        "mean mesh stiffness / (N/µm)": f"{1e-6 * float(excitation.stiffness.mean()):.0f}",
        "ISO 6336-1 B / (N/µm)": f"{1e-6 * excitation.iso_stiffness:.0f}",
        "contact stress / MPa": f"{1e-6 * excitation.pressure:.0f}" if math.isfinite(excitation.pressure) else "–",
    }


def _harmonics_row(material: ReportData, excitation: PairExcitation) -> dict[str, object]:
    largest = max(float(excitation.harmonics.max()), 1e-300)
    cells = {
        f"{n + 1}.": Cell(figure_text(1e6 * float(value), 2), float(value), bar=float(value) / largest)
        for n, value in enumerate(excitation.harmonics[:HARMONICS])
    }
    return {"pair": material.words.of(excitation.pair), **cells}


def _gear_rows(material: ReportData) -> list[dict[str, object]]:
    gearbox = material.context.gearbox
    rows = []
    for name, gear in gearbox.gears.items():
        rows.append(
            {
                "gear": material.words.of(name),
                "teeth": gear.teeth,
                "kind": "internal" if gear.internal else "external",
                "module / mm": f"{1e3 * gear.normal_module:g}",
                "pressure angle / °": f"{math.degrees(gear.normal_pressure_angle):g}",
                "helix angle / °": f"{math.degrees(gear.helix_angle):g}",
                "profile shift": f"{gear.profile_shift:g}",
                "face width / mm": f"{1e3 * gear.face_width:g}",
                "tip diameter / mm": f"{2e3 * gear.tip_radius:.2f}",
                "root diameter / mm": f"{2e3 * gear.root_radius:.2f}",
            }
        )
    return rows
