"""Section "Static transmission error and gears": error curves over the mesh cycle, harmonics and gear data."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np

from exugear.report.findings.context import HARMONICS, PairExcitation, excitations
from exugear.report.findings.words import figure_text
from exugear.report.sections.material import ChartAxis, Curve, Part, ReportData
from exugear.report.web.html import Cell, Table, render
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.operating_points import mesh_duties
from exugear.system.statics import BalanceError
from exugear.system.tooth_mesh.contact_state import MeshLoadState
from fe_ste.standards.pitting import nominal_contact_stress


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
            [ChartAxis("position in the mesh cycle"), ChartAxis("transmission error / µm")],
        ),
        errors=Table([_row(material, own) for own in found], caption="Static transmission error", name="errors"),
        stresses=Table(_stress_rows(material, found), caption="Contact stresses", name="stresses"),
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
    }


def _stress_rows(material: ReportData, found: Iterable[PairExcitation]) -> list[dict[str, object]]:
    """Contact stress of each pair, from the nominal value to that of the rating, with the K_Hbeta of each."""
    misaligned = _misaligned(material)
    rows = []
    for own in found:
        pair = material.context.gearbox.pairs[own.pair].pair
        nominal = nominal_contact_stress(pair, own.torque / pair.pinion.reference_radius)
        actual = misaligned.get(own.pair)
        rated = _rated(material, own.pair)
        rows.append(
            {
                "pair": material.words.of(own.pair),
                "σ_H0 / MPa": _cell(1e-6 * nominal, ".0f"),
                "K_Hbeta aligned": _cell(own.face_load_factor, ".2f"),
                "σ_H aligned / MPa": _cell(1e-6 * own.contact_stress, ".0f"),
                "K_Hbeta misaligned": _cell(actual.face_load_factor if actual else math.nan, ".2f"),
                "σ_H misaligned / MPa": _cell(1e-6 * actual.pressure if actual else math.nan, ".0f"),
                "K_Hbeta ISO 6336-1": _cell(rated.get("K_Hbeta", math.nan), ".2f"),
                "σ_H ISO 6336-2 / MPa": _cell(1e-6 * rated.get("sigma_H", math.nan), ".0f"),
            }
        )
    return rows


def _cell(value: float, form: str) -> Cell:
    return Cell(format(value, form) if math.isfinite(value) else "–", value)


def _misaligned(material: ReportData) -> dict[str, MeshLoadState]:
    """Return the mesh of each pair with the largest contact stress under the static load.

    It is that of the headline's model, or of the first one with solved contacts where there is no headline.
    """
    context = material.context
    models = context.assemblies.values() if material.headline is None else [context.assembled(material.headline.choice)]
    assembly = next((model for model in models if model.contacts.contacts), None)
    if assembly is None:
        return {}
    pairs = {element.mesh.name: element.mesh.pair.name for element in assembly.elements}
    try:
        states = [state for state in mesh_duties(assembly) if math.isfinite(state.pressure)]
    except (BalanceError, BearingError):  # the section on bearings says why
        return {}
    return {pairs[state.name]: state for state in sorted(states, key=lambda state: state.pressure)}


def _rated(material: ReportData, pair: str) -> Mapping[str, float]:
    """Return the factors and stresses to ISO 6336 of the flank of a pair with the largest contact stress."""
    sheet = material.ratings.sheet
    families = {mesh.family for mesh in material.context.gearbox.meshes if mesh.pair.name == pair}
    flanks = [] if sheet is None else [flank.standard for flank in sheet.flanks if flank.family in families]
    return max(flanks, key=lambda standard: standard.get("sigma_H", 0.0), default={})


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
