"""Section "Bearing forces and accelerations": dynamic forces, seat accelerations and static bearing loads."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.report.findings.context import choice_of, model_label
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.words import figure_text
from exugear.report.material import Part, ReportData, only_for
from exugear.report.web import html as pieces
from exugear.report.web.html import Cell
from exugear.steady.peaks import line_name
from exugear.system.bearings.duty import BearingLoadState
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.operating_points import bearing_duties, mesh_duties
from exugear.system.statics import BalanceError
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.contact_state import MeshLoadState

CONTACT_LOSS_RATIO = 1.0
"""Dynamic over mean force above which a linear bearing model would lose contact; the page warns then."""
NOISE = 1e-3
"""Fraction of the mean transverse force below which an axial force is shown as zero."""
NOISE_OF_ALL = 1e-5
"""Fraction of the largest force of all bearings below which a force is shown as zero."""
RUN_UP_NOTE = (
    "Mean radial force over the middle third of the run-up, and largest zero-to-peak amplitude along an order (root "
    "sum square of both radial directions). For planet sets, the bearing with the largest amplitude. Axial force: of "
    "the shaft on the bearing or joint, positive along +z."
)
"""Note above the table of forces in run-ups."""
STEADY_NOTE = (
    "Largest zero-to-peak amplitude along an order at constant speed (root sum square of both radial "
    "directions). Planet bearing forces are multi-blade components (mean, cosine, sine). Static loads are listed "
    "below."
)
"""Note above the table of forces at constant speed."""
SEATS = 12
"""Maximum number of seats in the table of accelerations."""
MIN_RELATIVE_ACCELERATION = 1e-3
"""Fraction of the largest acceleration below which a seat is not listed."""


def bearings_section(material: ReportData) -> Part:
    """List bearing forces by result group, accelerations by steady-state response and static bearing loads by model."""
    forces = [
        only_for(_forces(material, data, group, variant), group.name, variant)
        for data, group in zip(material.run_data["groups"], material.groups, strict=True)
        for variant in group.runs
    ]
    accelerations = [_accelerations(material, data) for data in material.results.steady]
    duties = [_duties(material, assembly) for assembly in material.context.assemblies.values()]
    if not any((*forces, *accelerations, *duties)):
        return Part("")
    note = ""
    if not any(accelerations):
        note = pieces.paragraph("Accelerations at bearings require a steady-state response: `exugear steady`.", "note")
    html = pieces.section("Bearing forces and accelerations", *forces, *accelerations, note, *duties, name="bearings")
    return Part(html, {}, "Bearing forces and accelerations", "bearings")


def _forces(material: ReportData, data: Mapping[str, Any], group: RunGroup, variant: str) -> str:
    own = data["variants"][variant]
    loudest = {name: figures for name, figures in own["loudest"].items() if figures["amplitude"] is not None}
    if not loudest:
        return ""
    largest = max(figures["amplitude"] for figures in loudest.values())
    felt = NOISE_OF_ALL * max(max(figures["amplitude"], figures["mean"] or 0.0) for figures in loudest.values())
    loudest = {
        name: {**figures, **{kind: _above(figures[kind], felt) for kind in ("mean", "amplitude")}}
        for name, figures in loudest.items()
    }
    rows = [_force_row(group, variant, name, figures, largest) for name, figures in loudest.items()]
    caption = f"Radial forces {Variant.of(variant).label}, {group.source}"
    lifting = [
        f"{figures['words']}: dynamic force amplitude {100.0 * figures['amplitude'] / figures['mean']:.0f} % of the "
        "mean force. A linear bearing model neglects loss of contact."
        for figures in loudest.values()
        if figures["mean"] and figures["amplitude"] > CONTACT_LOSS_RATIO * figures["mean"]
    ]
    words = STEADY_NOTE if group.responses else RUN_UP_NOTE
    table = pieces.table(
        rows,
        ("dominant order",),
        caption=caption,
        name=f"forces-{group.name}-{variant}",
        hidden=("mean axial force / kN",),
        sortable=True,
    )
    warned = pieces.element("div", pieces.bullets(lifting), class_="warning") if lifting else ""
    return pieces.element("h3", pieces.text(caption)) + pieces.paragraph(words, "note") + table + warned


def _force_row(
    group: RunGroup, variant: str, name: str, figures: Mapping[str, Any], largest: float
) -> dict[str, object]:
    amplitude = figures["amplitude"]
    mean = figures["mean"] or 0.0
    copies = f" (1 of {figures['copies']})" if figures["copies"] > 1 else ""
    share = amplitude / mean if mean else math.inf
    named = Cell(f"{figures['words']}{copies}", choice=f"channel:{group.name}:{variant}:{name}")
    swings = Cell(figure_text(1e-3 * amplitude), amplitude, bar=amplitude / largest)
    measures = {"amplitude / kN": swings}
    if not group.responses:
        measures = {
            "mean radial force / kN": Cell(figure_text(1e-3 * mean), mean),
            "mean axial force / kN": Cell(figure_text(_without_noise(1e-3 * figures["axial"], mean)), figures["axial"]),
            **measures,
            ("amplitude over mean / %"): Cell(
                figure_text(100.0 * share, 2) if math.isfinite(share) else "–", min(share, 1e9)
            ),
        }
    return {
        "bearing or joint": named,
        **measures,
        "dominant order": figures["line"],
        "speed / rpm": Cell(figure_text(figures["speed"], 4), figures["speed"]),
        "frequency / Hz": Cell(f"{figures['frequency']:.0f}", figures["frequency"]),
    }


def _above(force: float | None, felt: float) -> float:
    """Return the force, or zero where it is only rounding error compared with the forces at other bearings."""
    if force and force > felt:
        return force
    return 0.0


def _without_noise(value: float, mean: float) -> float:
    """Return an axial force (kN), or zero where it is negligible (round-off, start-up) against the mean force (N)."""
    if abs(value) > NOISE * 1e-3 * mean:
        return value
    return 0.0


def _accelerations(material: ReportData, data: xr.Dataset) -> str:
    """Tabulate the largest seat accelerations of a steady-state response over all orders and speeds."""
    signals = [str(name) for name in data["signal"].to_numpy()]
    places = [place for place, name in enumerate(signals) if name.startswith("seat_acceleration ")]
    if not places:
        return ""
    amplitude = data["amplitude"].to_numpy()[:, 1:, places].astype(np.float64)
    order = np.argsort(-amplitude.max(axis=(0, 1)))[:SEATS]
    bases = tuple(str(name) for name in data["base"].to_numpy())
    rows = []
    for seat in order:
        if not amplitude[..., seat].max() > MIN_RELATIVE_ACCELERATION * amplitude.max():
            break
        point, line = np.unravel_index(int(np.argmax(amplitude[..., seat])), amplitude.shape[:2])
        speed = abs(float(data["speed"][point]))
        _, name, *axes = signals[places[seat]].split(" ")  # such as `seat_acceleration hss_a x`
        index = tuple(int(n) for n in data["index"][int(line) + 1].to_numpy())
        rows.append(
            {
                "seat": " ".join([material.words.of(name), *axes]),
                "acceleration / (m/s²)": Cell(
                    figure_text(float(amplitude[point, line, seat])), float(amplitude[point, line, seat])
                ),
                "order": material.words.labelled(line_name(index, bases)),
                "speed / rpm": Cell(figure_text(speed / RPM, 4), speed),
                "frequency / Hz": Cell(f"{float(data['order'][line + 1]) * speed / (2.0 * np.pi):.0f}"),
            }
        )
    title = (
        f"Accelerations at bearings: steady-state response of {model_label(choice_of(data.attrs))}, method "
        f"{data.attrs['method']}"
    )
    words = (
        f"Largest zero-to-peak amplitude of a single order over all speeds, the {SEATS} largest; x, y and z are the "
        "gearbox axes. For planet sets: multi-blade components (mean, cosine, sine)."
    )
    table = pieces.table(rows, ("order",), caption=title, name=f"seats-{'-'.join(title.split()[7:])}", sortable=True)
    return pieces.element("h3", pieces.text(title)) + pieces.paragraph(words, "note") + table


def _duties(material: ReportData, assembly: Assembly) -> str:
    if not assembly.variant.has_bearings or not any(support.catalogue for support in assembly.supports):
        return ""
    name = model_label(assembly.choice)
    try:
        duties = bearing_duties(assembly)
    except (BalanceError, BearingError) as error:
        material.context.notes.left_out.append(f"bearings of {name}: {error}")
        return ""
    said = ((duty, remark) for duty in duties for remark in (duty.ratings.two_designs, *duty.remarks) if remark)
    remarks = [f"{material.words.of(duty.name)}: {remark}." for duty, remark in said]
    rows = [_duty_row(material, duty) for duty in duties]
    table = pieces.table(
        rows, ("model",), caption=f"Bearings at the static load, {name}", name=f"duties-{'-'.join(name.split())}"
    )
    words = (
        "Rolling elements to ISO/TS 16281 with rigid rings, under the static load. L10 to ISO 281 and L10r to ISO/TS "
        "16281 in million revolutions; lubricant, cleanliness and ribs are neglected. *: conservatively estimated "
        "rating; +: smallest rating in manufacturers' catalogues. Linear bearings have the tangent stiffness at this "
        "load. Axial load: of the shaft on the inner ring, positive along +z."
    )
    content = pieces.paragraph(words, "note") + table + (pieces.bullets(remarks) if remarks else "")
    content += _meshes(material, assembly)
    return pieces.folded(f"Bearings at the static load: {name}", content)


def _meshes(material: ReportData, assembly: Assembly) -> str:
    """Tabulate mesh misalignment and face load distribution under static load; empty without solved tooth contact."""
    if not assembly.contacts.contacts:
        return ""
    name = model_label(assembly.choice)
    duties = mesh_duties(assembly)
    rows = [_mesh_row(material, duty) for duty in duties]
    words = (
        "Gear misalignment and load distribution under the static load (finite element contact). Gap at +z "
        "end: opening of the flanks there due to misalignment, over the common face width; negative: at the -z end. "
        "K_Hbeta: maximum over mean line load along the face width."
    )
    table = pieces.table(
        rows, (), caption=f"Meshes at the static load, {name}", name=f"meshes-{'-'.join(name.split())}"
    )
    return pieces.paragraph(words, "note") + table


def _mesh_row(material: ReportData, duty: MeshLoadState) -> dict[str, object]:
    def shown(value: float, form: str) -> str:
        if math.isnan(value):
            return "–"
        return format(value, form)

    return {
        "mesh": material.words.of(duty.name),
        "force / kN": f"{1e-3 * duty.force:.4g}",
        "misalignment / mrad": f"{1e3 * duty.misalignment:.3f}",
        "gap at +z end / µm": f"{1e6 * duty.opening:.1f}",
        "load centroid / mm": shown(1e3 * duty.load_centroid, ".1f"),
        "K_Hbeta": shown(duty.face_load_factor, ".2f"),
        "contact stress / MPa": shown(1e-6 * duty.pressure, ".0f"),
    }


def _duty_row(material: ReportData, duty: BearingLoadState) -> dict[str, object]:
    if duty.ratings.estimated:
        sign = "*"
    elif duty.ratings.makers:
        sign = "+"
    else:
        sign = ""
    tilt = 0.5e-6 * float(duty.stiffness[3, 3] + duty.stiffness[4, 4])
    return {
        "bearing": material.words.of(duty.name),
        "model": duty.model,
        "radial load / kN": f"{1e-3 * duty.radial_load:.4g}",
        "axial load / kN": f"{round(1e-3 * duty.axial_load, 3) + 0.0:.4g}",
        "radial stiffness / (GN/m)": f"{1e-9 * duty.radial_stiffness:.3g}",
        "axial stiffness / (GN/m)": f"{1e-9 * duty.stiffness[2, 2]:.3g}",
        "tilting stiffness / (MN m/rad)": f"{tilt:.3g}",
        "misalignment / mrad": f"{1e3 * duty.misalignment:.3f}",
        "contact stress / MPa": f"{1e-6 * duty.pressure:.0f}",
        "C_r / kN": f"{1e-3 * duty.ratings.dynamic:.4g}{sign}",
        "L10 / Mrev": _life(duty.basic_life),
        "L10r / Mrev": _life(duty.reference_life),
    }


def _life(value: float) -> str:
    if math.isfinite(value):
        return f"{value:.3g}"
    return "no load"
