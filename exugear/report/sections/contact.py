"""Section "Contact of the teeth": pressure over flanks and load along the face, aligned and under the static load."""

from __future__ import annotations

from typing import Any

from exugear.report.findings.context import model_label
from exugear.report.findings.flank_contacts import PairContact, flank_contacts, place_on_flank
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
    html = render(
        "contact",
        scope=f"Static load, no load factors. Model: {model_label(headline.choice)}.",
        contacts=Table(
            [_row(material, own) for own in found],
            ("highest pressure at",),
            caption="Contact of the teeth",
            name="contact-table",
        ),
        pairs=[_pair(material, own) for own in found],
    )
    return Part(html, title="Contact of the teeth", name="contact")


def _row(material: ReportData, own: PairContact) -> dict[str, object]:
    overlap = own.pair.overlap_ratio
    off = min(abs(overlap - round(overlap)), 1.0) if overlap > 0.0 else 0.0
    factor = own.actual.face_load_factor
    edge = own.actual.edge_pressure
    return {
        "mesh": material.words.of(own.mesh),
        "force / kN": _cell(1e-3 * own.force),
        "transverse contact ratio": _cell(own.pair.transverse_contact_ratio),
        "overlap ratio": Cell(rounded_text(overlap), overlap, tag="mind" if off > OFF_WHOLE else ""),
        "gap at +z end / µm": _cell(1e6 * own.actual.misalignment * own.pair.face_width),
        "K_Hbeta aligned": Cell(f"{own.aligned.face_load_factor:.2f}", own.aligned.face_load_factor),
        "K_Hbeta as held": Cell(f"{factor:.2f}", factor, tag="mind" if factor > UNEVEN else ""),
        "pressure aligned / MPa": _cell(1e-6 * own.aligned.highest[0]),
        "pressure as held / MPa": _cell(1e-6 * own.actual.highest[0]),
        "highest pressure at": place_on_flank(own, own.actual, material.words.labels),
        "tip edges / MPa": _cell(1e-6 * edge) if edge > 0.0 else Cell("–"),
    }


def _cell(value: float) -> Cell:
    return Cell(rounded_text(value).replace("-", "−"), value)


def _pair(material: ReportData, own: PairContact) -> dict[str, Any]:
    states = {"Aligned": own.aligned, "As held under the static load": own.actual}
    highest = max(state.highest[0] for state in states.values())
    heaviest = 1.05 * max(float(state.line_load.max()) for state in states.values())
    maps = []
    for title, state in states.items():
        pressure = f"{rounded_text(1e-6 * state.highest[0])} MPa, K_Hbeta {state.face_load_factor:.2f}"
        words = f"{title}: pressure over the flank, highest {pressure}; line load along the face."
        maps.append((f"{title}: {pressure}", flank_map(state, highest, heaviest, words)))
    pinion = material.words.of(own.pair.pinion.name)
    return {
        "title": f"{material.words.of(own.pair.name)}, flank of {pinion}",
        "maps": maps,
        "words": (
            f"Above: highest Hertzian stress of the mesh cycle, grey 0, dark {rounded_text(1e-6 * highest)} MPa. "
            "Below: line load of all tooth pairs, mean of the mesh cycle; thin line: its mean."
        ),
    }
