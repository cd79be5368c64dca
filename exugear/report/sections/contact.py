"""Section "Contact of the teeth": pressure over flanks and load along the face, aligned and under the static load."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from exugear.life.life import rating_of
from exugear.report.findings.context import PairExcitation, excitations, model_label
from exugear.report.findings.flank_contacts import PairContact, edge_in_words, flank_contacts, place_on_flank
from exugear.report.findings.words import rounded_text
from exugear.report.pictures.flank_maps import flank_map
from exugear.report.sections.material import Part, ReportData
from exugear.report.web.html import Cell, Table, render

UNEVEN = 1.5
"""K_Hbeta from which a value is marked."""
OFF_WHOLE = 0.3
"""Difference of an overlap ratio from a whole number from which it is marked."""


def contact_section(material: ReportData) -> Part:
    """Show the contact of each pair in the model of the headline; nothing without tables or bearings."""
    headline = material.headline
    found = [] if headline is None else flank_contacts(material.context, headline.choice)
    if headline is None or not found:
        return Part()
    ripples = {own.pair: own for own in excitations(material.context, material.results)}
    html = render(
        "contact",
        scope=f"Static load, no load factors. Model: {model_label(headline.choice)}.",
        contacts=Table(
            [_row(material, own) for own in found],
            ("highest pressure at", "highest tip edge pressure at"),
            caption="Contact of the teeth",
            name="contact-table",
        ),
        pairs=[_pair(material, own, ripples.get(own.pair.name)) for own in found],
    )
    return Part(html, title="Contact of the teeth", name="contact")


def _row(material: ReportData, own: PairContact) -> dict[str, object]:
    overlap = own.pair.overlap_ratio
    off = min(abs(overlap - round(overlap)), 1.0) if overlap > 0.0 else 0.0
    factor = own.actual.face_load_factor
    edge = own.actual.edge_pressure
    labels = material.words.labels
    row = {
        "mesh": material.words.of(own.mesh),
        "force / kN": _cell(1e-3 * own.force),
        "transverse contact ratio": _cell(own.pair.transverse_contact_ratio),
        "overlap ratio": Cell(rounded_text(overlap), overlap, tag="mind" if off > OFF_WHOLE else ""),
        "gap at +z end / µm": _cell(1e6 * own.actual.misalignment * own.pair.face_width),
        "load along the face": Cell(
            "uneven" if factor > UNEVEN else "even", factor, tag="mind" if factor > UNEVEN else ""
        ),
        "highest pressure at": place_on_flank(own, *own.actual.highest[1:], labels),
        "tip edge pressure / MPa": _cell(1e-6 * edge) if edge > 0.0 else Cell("–"),
        "highest tip edge pressure at": edge_in_words(own, labels),
    }
    if material.ratings.sheet is not None:
        required = rating_of(material.context.gearbox)
        factors = material.ratings.safety_factors(own.family)
        for name, least in (("S_H", required.minimum_S_H), ("S_F", required.minimum_S_F)):
            value = factors.get(name, math.nan)
            row[name] = Cell("–" if math.isnan(value) else f"{value:.2f}", value, tag="mind" if value < least else "")
    return row


def _cell(value: float) -> Cell:
    return Cell(rounded_text(value).replace("-", "−"), value)


def _pair(material: ReportData, own: PairContact, ripple: PairExcitation | None) -> dict[str, Any]:
    states = {"Aligned": own.aligned, "Misaligned as under the static load": own.actual}
    highest = max(state.highest[0] for state in states.values())
    heaviest = 1.05 * max(float(state.line_load.max()) for state in states.values())
    maps = []
    for title, state in states.items():
        words = f"{title}: pressure over the flank; line load along the face."
        maps.append((title, flank_map(state, highest, heaviest, words)))
    pinion = material.words.of(own.pair.pinion.name)
    return {
        "title": f"{material.words.of(own.pair.name)}, flank of {pinion}",
        "maps": maps,
        "data_sheet": _data_sheet(own, ripple),
        "words": (
            f"Above: highest Hertzian stress of the mesh cycle, grey 0, dark {rounded_text(1e-6 * highest)} MPa. "
            "Below: line load of all tooth pairs, mean of the mesh cycle; thin line: its mean."
        ),
    }


def _data_sheet(own: PairContact, ripple: PairExcitation | None) -> Table:
    """List the geometry and the excitation of a pair."""
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
