"""Part "Gears": contact of the teeth, static transmission error with harmonics, contact stresses, gear data."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from exugear.life.life import rating_of
from exugear.report.findings.context import HARMONICS, PairExcitation, excitations, model_label
from exugear.report.findings.flank_contacts import PairContact, edge_in_words, flank_contacts, place_on_flank
from exugear.report.findings.words import figure_text, rounded_text
from exugear.report.pictures.flank_maps import flank_map
from exugear.report.sections.material import ChartAxis, Curve, Part, ReportData
from exugear.report.web.html import Cell, Table, render
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.operating_points import mesh_duties
from exugear.system.statics import BalanceError
from exugear.system.tooth_mesh.contact_state import MeshLoadState
from fe_ste.standards.pitting import nominal_contact_stress

OF_CELLS = (
    "contact pressure in the cells at the tip edge; it depends on the size of the cells, and is no Hertzian stress"
)
"""Caveat of the tip edge pressure."""
UNEVEN = 1.5
"""K_Hbeta from which a value is marked."""
OFF_WHOLE = 0.3
"""Difference of an overlap ratio from a whole number from which it is marked."""


def gears_section(material: ReportData) -> Part:
    """Show the contact of each pair in the model of the headline, static transmission errors, and the geometry."""
    headline = material.headline
    contacts = [] if headline is None else flank_contacts(material.context, headline.choice)
    found = excitations(material.context, material.results)
    ripples = {own.pair: own for own in found}
    curves = [Curve(material.words.of(own.pair), own.position, 1e6 * (own.error - own.error.mean())) for own in found]
    gearbox = material.context.gearbox
    rows = [
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
        for name, gear in gearbox.gears.items()
    ]
    html = render(
        "gears",
        scope="" if headline is None else f"Static load, no load factors. Model: {model_label(headline.choice)}.",
        contacts=Table(
            [_contact_row(material, own) for own in contacts],
            ("highest pressure at", "highest tip edge pressure at"),
            caption="Contact of the teeth",
            name="contact-table",
            stacked=True,
        ),
        pairs=[_pair(material, own, ripples.get(own.pair.name)) for own in contacts],
        figure_of_error=material.chart(
            "ste",
            "Static transmission error over one mesh cycle",
            "Deviation from the mean.",
            "; ".join(f"{material.words.of(own.pair)} {_swing(own):.2f} µm peak-to-peak" for own in found),
            curves,
            [ChartAxis("position in the mesh cycle"), ChartAxis("transmission error / µm")],
        ),
        errors=Table(
            [
                {
                    "pair": material.words.of(own.pair),
                    "torque on gear 1 / N m": f"{own.torque:.1f}",
                    "positions": own.position.size,
                    "mean / µm": f"{1e6 * float(own.error.mean()):.2f}",
                    "peak-to-peak / µm": Cell(f"{_swing(own):.3f}", _swing(own)),
                    "mean mesh stiffness / (N/µm)": f"{1e-6 * float(own.stiffness.mean()):.0f}",
                    "ISO 6336-1 B / (N/µm)": f"{1e-6 * own.iso_stiffness:.0f}",
                }
                for own in found
            ],
            caption="Static transmission error",
            name="errors",
        ),
        stresses=Table(_stress_rows(material, found), caption="Contact stresses", name="stresses"),
        harmonics=Table([_harmonics_row(material, own) for own in found], caption="Harmonics", name="harmonics"),
        gears=Table(rows, caption="Gears", name="gear-data"),
    )
    return Part(html, title="Gears", name="gears")


def _swing(excitation: PairExcitation) -> float:
    return 1e6 * float(np.ptp(excitation.error))


def _stress_rows(material: ReportData, found: Iterable[PairExcitation]) -> list[dict[str, object]]:
    """Contact stress of each pair, from the nominal value to that of the rating, with the K_Hbeta of each."""
    misaligned = _misaligned(material)
    rows = []
    for own in found:
        pair = material.context.gearbox.pairs[own.pair].pair
        nominal = nominal_contact_stress(pair, own.torque / pair.pinion.reference_radius)
        actual = misaligned.get(own.pair)
        sheet = material.ratings.sheet
        families = {mesh.family for mesh in material.context.gearbox.meshes if mesh.pair.name == own.pair}
        flanks = [] if sheet is None else [flank.standard for flank in sheet.flanks if flank.family in families]
        rated = max(flanks, key=lambda standard: standard.get("sigma_H", 0.0), default={})
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


def _harmonics_row(material: ReportData, excitation: PairExcitation) -> dict[str, object]:
    largest = max(float(excitation.harmonics.max()), 1e-300)
    cells = {
        f"{n + 1}.": Cell(figure_text(1e6 * float(value), 2), float(value), bar=float(value) / largest)
        for n, value in enumerate(excitation.harmonics[:HARMONICS])
    }
    return {"pair": material.words.of(excitation.pair), **cells}


# Contact of the teeth


def _contact_row(material: ReportData, own: PairContact) -> dict[str, object]:
    overlap = own.pair.overlap_ratio
    off = min(abs(overlap - round(overlap)), 1.0) if overlap > 0.0 else 0.0
    factor = own.actual.face_load_factor
    edge = own.actual.edge_pressure
    labels = material.words.labels
    row = {
        "mesh": material.words.of(own.mesh),
        "force / kN": _rounded(1e-3 * own.force),
        "transverse contact ratio": _rounded(own.pair.transverse_contact_ratio),
        "overlap ratio": Cell(rounded_text(overlap), overlap, tag="mind" if off > OFF_WHOLE else ""),
        "gap at +z end / µm": _rounded(1e6 * own.actual.misalignment * own.pair.face_width),
        "load along the face": Cell(
            "uneven" if factor > UNEVEN else "even", factor, tag="mind" if factor > UNEVEN else ""
        ),
        "highest pressure at": place_on_flank(own, *own.actual.highest[1:], labels),
        "tip edge pressure / MPa": edge_cell(edge, own.actual.highest[0]),
        "highest tip edge pressure at": edge_in_words(own, labels),
    }
    if material.ratings.sheet is not None:
        required = rating_of(material.context.gearbox)
        factors = material.ratings.safety_factors(own.family)
        for name, least in (("S_H", required.minimum_S_H), ("S_F", required.minimum_S_F)):
            value = factors.get(name, math.nan)
            row[f"{name}, life"] = Cell(
                "–" if math.isnan(value) else f"{value:.2f}", value, tag="mind" if value < least else ""
            )
    return row


def edge_cell(edge: float, on_flank: float) -> Cell:
    """Return the cell of a tip edge pressure (Pa), marked if it exceeds the highest pressure on the flank."""
    if edge <= 0.0:
        return Cell("–")
    return replace(_rounded(1e-6 * edge), tag="mind" if edge > on_flank else "", caveat=OF_CELLS)


def _rounded(value: float) -> Cell:
    return Cell(rounded_text(value).replace("-", "−"), value)


def _pair(material: ReportData, own: PairContact, ripple: PairExcitation | None) -> dict[str, Any]:
    states = {"Aligned": own.aligned, "Misaligned as under the static load": own.actual}
    highest = max(state.highest[0] for state in states.values())
    heaviest = 1.05 * max(float(state.line_load.max()) for state in states.values())
    maps = [
        (title, flank_map(state, highest, heaviest, f"{title}: pressure over the flank; line load along the face."))
        for title, state in states.items()
    ]
    pinion = material.words.of(own.pair.pinion.name)
    return {
        "title": f"{material.words.of(own.pair.name)}, flank of {pinion}",
        "maps": maps,
        "data_sheet": _data_sheet(own, ripple),
        "words": (
            "Above: highest Hertzian stress of the mesh cycle. "
            "Below: line load of all tooth pairs, mean of the mesh cycle; thin line: its mean."
        ),
    }


def _data_sheet(own: PairContact, ripple: PairExcitation | None) -> Table:
    gears = (own.pair.pinion, own.pair.gear)

    def both(values: Iterable[float], digits: str) -> str:
        return " / ".join(format(value, digits).replace("-", "−") for value in values)

    values = {
        "teeth": both((gear.teeth for gear in gears), "d"),
        "normal module / mm": f"{1e3 * gears[0].normal_module:g}",
        "normal pressure angle / °": f"{math.degrees(gears[0].normal_pressure_angle):g}",
        "helix angle / °": both((math.degrees(gear.helix_angle) for gear in gears), ".4g"),
        "profile shift": both((gear.profile_shift for gear in gears), ".4f"),
        "face width / mm": both((1e3 * gear.face_width for gear in gears), ".4g"),
        "tip diameter / mm": both((2e3 * gear.tip_radius for gear in gears), ".2f"),
        "centre distance / mm": f"{1e3 * own.pair.centre_distance:.3f}",
        "contact ratios, transverse and overlap": both(
            (own.pair.transverse_contact_ratio, own.pair.overlap_ratio), ".3f"
        ),
    }
    if ripple is not None:
        values["static transmission error, peak-to-peak / µm"] = f"{1e6 * np.ptp(ripple.error):.3g}"
        values["its 1st to 3rd harmonic, amplitude / µm"] = both((1e6 * ripple.harmonics[:3]).tolist(), ".3g")
    rows = [{"quantity": name, "value": value} for name, value in values.items()]
    return Table(rows, caption=f"Data of {own.pair.name}")
