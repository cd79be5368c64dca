"""Part "Bearings and life": dynamic forces, accelerations, static loads, and lives under the load spectrum."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.choice import choice_of
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.life.life import LEAST_OUTSIDE
from exugear.life.life_file import draw_life, limits
from exugear.report.findings.context import model_label, response_label
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.words import capitalised, figure_text
from exugear.report.pictures.png import png_address
from exugear.report.sections.material import Part, ReportData, model_name
from exugear.report.web.html import Cell, Table, render
from exugear.steady.steady_file import complex_amplitudes, response_quantities
from exugear.system.bearings.duty import BearingLoadState
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.operating_points import bearing_duties, mesh_duties
from exugear.system.statics import BalanceError
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.contact_state import MeshLoadState
from fe_ste.tools.display import life_text, without_round_off

if TYPE_CHECKING:
    import xarray as xr

CONTACT_LOSS_RATIO = 1.0
"""Dynamic over mean force above which a linear bearing model would lose contact; the page warns then."""
NOISE = 1e-3
"""Fraction of the mean transverse force below which an axial force is shown as zero."""
NOISE_OF_ALL = 1e-5
"""Fraction of the largest force of all bearings below which a force is shown as zero."""
SEATS = 12
"""Maximum number of seats in the table of accelerations."""
MIN_RELATIVE_ACCELERATION = 1e-3
"""Fraction of the largest acceleration below which a seat is not listed."""


def bearings_section(material: ReportData) -> Part:
    """List bearing forces by result group, accelerations by steady-state response and static bearing loads by model."""
    groups = zip(material.run_data["groups"], material.groups, strict=True)
    forces = list(filter(None, (_forces(data, group, variant) for data, group in groups for variant in group.runs)))
    accelerations = list(filter(None, (_accelerations(material, data) for data in material.results.steady)))
    duties = list(filter(None, (_duties(material, assembly) for assembly in material.context.assemblies.values())))
    lives = [_rated_variant(material, data) for data in material.ratings.lives]
    data = {} if material.ratings.sheet is None else {"rating": material.ratings.sheet.summary()}
    for life in material.ratings.lives:
        if worst := limits(life):
            part, kind, damage = worst[0]
            size = "infinite" if math.isinf(damage) else f"{damage:.3g}"
            material.context.notes.statements.append(
                f"{model_label(choice_of(life.attrs))}: largest fatigue damage in "
                f"{float(life.attrs['life_years']):g} years: {material.words.labelled(part)}, {size} ({kind})."
            )
    if not (forces or accelerations or duties or lives):
        return Part(data=data)
    html = render("bearings", forces=forces, accelerations=accelerations, seats=SEATS, duties=duties, lives=lives)
    return Part(html, data, "Bearings and life", "bearings")


def _forces(data: Mapping[str, Any], group: RunGroup, variant: str) -> dict[str, Any] | None:
    own = data["variants"][variant]
    loudest = {name: figures for name, figures in own["loudest"].items() if figures["amplitude"] is not None}
    if not loudest:
        return None
    largest = max(figures["amplitude"] for figures in loudest.values())
    felt = NOISE_OF_ALL * max(max(figures["amplitude"], figures["mean"] or 0.0) for figures in loudest.values())
    # Smaller forces are only rounding error compared with those at other bearings.
    loudest = {
        name: {
            **figures,
            **{kind: own if (own := figures[kind] or 0.0) > felt else 0.0 for kind in ("mean", "amplitude")},
        }
        for name, figures in loudest.items()
    }
    caption = f"Radial forces {Variant.of(variant).label}, {group.source}"
    return {
        "group": group.name,
        "variant": variant,
        "title": caption,
        "steady": bool(group.responses),
        "table": Table(
            [_force_row(group, variant, name, figures, largest) for name, figures in loudest.items()],
            ("dominant order",),
            caption=caption,
            name=f"forces-{group.name}-{variant}",
            hidden=("mean axial force / kN",),
            sortable=True,
        ),
    }


def _force_row(
    group: RunGroup, variant: str, name: str, figures: Mapping[str, Any], largest: float
) -> dict[str, object]:
    amplitude = figures["amplitude"]
    mean = figures["mean"] or 0.0
    copies = f" (1 of {figures['copies']})" if figures["copies"] > 1 else ""
    share = amplitude / mean if mean else math.nan
    lifts = "larger than the mean force: a linear bearing model neglects loss of contact"
    named = Cell(f"{figures['words']}{copies}", choice=f"channel:{group.name}:{variant}:{name}")
    swings = Cell(figure_text(1e-3 * amplitude), 1e-3 * amplitude, bar=amplitude / largest)
    measures = {"amplitude / kN": swings}
    if not group.responses:
        axial = 1e-3 * figures["axial"]
        if not abs(axial) > NOISE * 1e-3 * mean:  # round-off, or from the start-up
            axial = 0.0
        measures = {
            "mean radial force / kN": Cell(figure_text(1e-3 * mean), 1e-3 * mean),
            "mean axial force / kN": Cell(figure_text(axial), axial),
            **measures,
            "amplitude over mean / %": Cell(
                figure_text(100.0 * share, 2) if math.isfinite(share) else "–",
                100.0 * share,
                caveat=lifts if share > CONTACT_LOSS_RATIO else "",
            ),
        }
    return {
        "bearing or joint": named,
        **measures,
        "dominant order": figures["line"],
        "speed / rpm": Cell(figure_text(figures["speed"], 4), figures["speed"]),
        "frequency / Hz": Cell(f"{figures['frequency']:.0f}", figures["frequency"]),
    }


def _accelerations(material: ReportData, data: xr.Dataset) -> dict[str, Any] | None:
    """Tabulate the largest accelerations at bearings and mounts of a steady-state response over orders and speeds."""
    kinds = {"acceleration": "bearing", "mount_acceleration": "mount"}
    amplitude = complex_amplitudes(data)[:, 1:]
    orders = data["order"].to_numpy()[1:]
    found = []
    for quantity in response_quantities(data):
        if quantity.name not in kinds:
            continue
        sizes = quantity.sizes(amplitude)
        for number, place in enumerate(quantity.places):
            at, of = map(int, np.unravel_index(int(np.argmax(sizes[..., number])), sizes.shape[:2]))
            found.append((float(sizes[at, of, number]), kinds[quantity.name], place, at, of))
    if not found:
        return None
    found.sort(key=lambda own: -own[0])
    rows = []
    for largest, kind, place, point, line in found[:SEATS]:
        if not largest > MIN_RELATIVE_ACCELERATION * found[0][0]:
            break
        speed = abs(float(data["speed"][point]))
        rows.append(
            {
                "at": f"{kind}: {material.words.of(place)}",
                "acceleration / (m/s²)": Cell(figure_text(largest), largest),
                "order": material.words.labelled(str(data["line"][line + 1].item())),
                "speed / rpm": Cell(figure_text(speed / RPM, 4), speed / RPM),
                "frequency / Hz": Cell(f"{orders[line] * speed / (2.0 * np.pi):.0f}"),
            }
        )
    title = f"Accelerations at bearings and mounts: steady-state response of {response_label(data)}"
    name = f"seats-{model_name(choice_of(data.attrs))}-{data.attrs['method']}"
    table = Table(rows, ("at", "order"), caption=title, name=name, sortable=True)
    return {"model": model_name(choice_of(data.attrs)), "title": title, "table": table}


def _duties(material: ReportData, assembly: Assembly) -> dict[str, Any] | None:
    if not assembly.variant.has_bearings or not any(support.catalogue for support in assembly.supports):
        return None
    name = model_label(assembly.choice)
    label = model_name(assembly.choice)
    try:
        duties = bearing_duties(assembly)
    except (BalanceError, BearingError) as error:
        material.context.notes.left_out.append(f"bearings of {name}: {error}")
        return None
    said = ((duty, remark) for duty in duties for remark in (duty.ratings.two_designs, *duty.remarks) if remark)
    rows = [_duty_row(material, duty) for duty in duties]
    # Without solved tooth contact there is no load distribution along the face.
    meshes = mesh_duties(assembly) if assembly.contacts.contacts else ()
    return {
        "model": label,
        "name": name,
        "table": Table(rows, ("model",), caption=f"Bearings at the static load, {name}", name=f"duties-{label}"),
        "remarks": [f"{material.words.of(duty.name)}: {remark}." for duty, remark in said],
        "meshes": Table(
            [_mesh_row(material, duty) for duty in meshes],
            caption=f"Meshes at the static load, {name}",
            name=f"meshes-{label}",
        ),
    }


def _mesh_row(material: ReportData, duty: MeshLoadState) -> dict[str, object]:
    def shown(value: float, form: str) -> str:
        return "–" if math.isnan(value) else format(value, form)

    return {
        "mesh": material.words.of(duty.name),
        "force / kN": f"{1e-3 * duty.force:.4g}",
        "misalignment / mrad": f"{1e3 * duty.misalignment:.3f}",
        "gap at +z end / µm": f"{1e6 * duty.opening:.1f}",
        "load centroid / mm": shown(1e3 * duty.load_centroid, ".1f"),
        "K_Hbeta": shown(duty.face_load_factor, ".2f"),
        "σ_H misaligned / MPa": shown(1e-6 * duty.pressure, ".0f"),
    }


def _duty_row(material: ReportData, duty: BearingLoadState) -> dict[str, object]:
    sign = "*" if duty.ratings.estimated else "+" if duty.ratings.makers else ""
    tilt = 0.5e-6 * float(duty.stiffness[3, 3] + duty.stiffness[4, 4])
    return {
        "bearing": material.words.of(duty.name),
        "model": duty.model,
        "radial load / kN": f"{without_round_off(1e-3 * duty.radial_load):.4g}",
        "axial load / kN": f"{round(1e-3 * duty.axial_load, 3) + 0.0:.4g}",
        "radial stiffness / (GN/m)": f"{1e-9 * duty.radial_stiffness:.3g}",
        "axial stiffness / (GN/m)": f"{1e-9 * duty.stiffness[2, 2]:.3g}",
        "tilting stiffness / (MN m/rad)": f"{tilt:.3g}",
        "misalignment / mrad": f"{1e3 * duty.misalignment:.3f}",
        "contact stress / MPa": f"{1e-6 * duty.pressure:.0f}",
        "C_r / kN": Cell(f"{1e-3 * duty.ratings.dynamic:.4g}{sign}", 1e-3 * duty.ratings.dynamic),
        "L10 / Mrev": _life(duty.basic_life),
        "L10r / Mrev": _life(duty.reference_life),
    }


def _life(value: float) -> Cell:
    return Cell(life_text(value) if math.isfinite(value) else "no load", value)


# Lives under the load spectrum

LEAST_DAMAGE = 1e-6
"""Damages below this value are shown as "below" it."""


def _rated_variant(material: ReportData, data: xr.Dataset) -> dict[str, Any]:
    labelled = material.words.labelled
    data = data.assign_coords(
        {key: [labelled(str(own)) for own in data[key].to_numpy()] for key in ("flank", "bearing")}
    )
    name = model_label(choice_of(data.attrs))
    label = f"life-{data.attrs['variant']}-{data.attrs['mesh_model']}"
    remarks = {labelled(bearing): said for bearing, said in json.loads(data.attrs["bearing_remarks"]).items()}

    def listed(*keys: str) -> list[str]:
        return [labelled(line) for key in keys for line in json.loads(data.attrs[key])]

    bearings = _bearing_rows(data, remarks)
    content = io.BytesIO()
    draw_life(data).savefig(content, format="png", dpi=130)
    return {
        "model": model_name(choice_of(data.attrs)),
        "title": f"{capitalised(name)}, gears to {data.attrs['edition']}",
        "failures": listed("failures"),
        "shortfalls": listed("shortfalls"),
        "reliefs": listed("reliefs"),
        "picture": png_address(content.getvalue()),
        "words": f"Limiting parts, {name}",
        "gears": Table(_flank_rows(data), caption=f"Gears, {name}", name=f"{label}-gears", sortable=True),
        "bearings": Table(bearings, caption=f"Bearings, {name}", name=f"{label}-bearings", sortable=True),
        "remarks": [f"{bearing}: {remark}" for bearing, said in remarks.items() for remark in said],
        "rested": listed("assumptions", "unrated"),
    }


def _flank_rows(data: xr.Dataset) -> list[dict[str, Any]]:
    """Return the rows of flanks; load that is not rated weakens their stresses and safety factors."""
    columns = {
        "σ_H life / MPa": ("contact_stress", 1e-6, ".0f"),
        "σ_H0 / MPa": ("nominal_contact", 1e-6, ".0f"),
        "outside the path / %": ("outside", 100.0, ".1f"),
        "K_Hbeta": ("face_load", 1.0, ".3f"),
        "pitting damage": ("contact_damage", 1.0, ".3g"),
        "S_H, FE": ("contact_safety", 1.0, ".2f"),
        "S_H, ISO, FE": ("standard_contact_safety", 1.0, ".2f"),
        "σ_F / MPa": ("root_stress", 1e-6, ".0f"),
        "σ_F0, ISO / MPa": ("nominal_root", 1e-6, ".0f"),
        "root damage": ("root_damage", 1.0, ".3g"),
        "S_F, FE": ("root_safety", 1.0, ".2f"),
        "S_F, ISO, FE": ("standard_root_safety", 1.0, ".2f"),
        "static S_H": ("contact_static", 1.0, ".2f"),
        "static S_F": ("root_static", 1.0, ".2f"),
    }
    rows = _rows(data, "flank", "gear, flank, mesh", columns)
    for row, outside in zip(rows, data["flank_outside"].to_numpy().tolist(), strict=True):
        if outside > LEAST_OUTSIDE:
            text = f"{100.0 * outside:.1f} % of the load is outside the path of contact, where no stress is rated"
            for title in ("σ_H life / MPa", "S_H, FE"):
                row[title] = replace(row[title], caveat=text)
    return rows


def _bearing_rows(data: xr.Dataset, remarks: Mapping[str, Sequence[str]]) -> list[dict[str, Any]]:
    """Return the rows of bearings; remarks on one are next to its life."""
    columns = {
        "largest load / kN": ("largest_load", 1e-3, ".4g"),
        "equivalent load / kN": ("equivalent", 1e-3, ".4g"),
        "L10 / h": ("basic_hours", 1.0, ".3g"),
        "L10r / h": ("reference_hours", 1.0, ".3g"),
        "L10m / h": ("modified_hours", 1.0, ".3g"),
        "κ": ("viscosity_ratio", 1.0, ".2g"),
        "minimum load / kN": ("minimum_load", 1e-3, ".3g"),
        "damage (L10)": ("damage", 1.0, ".3g"),
        "damage (L10r)": ("reference_damage", 1.0, ".3g"),
        "contact stress / MPa": ("pressure", 1e-6, ".0f"),
        "S_0": ("static_safety", 1.0, ".2f"),
    }
    rows = _rows(data, "bearing", "bearing", columns)
    for row in rows:
        row["L10 / h"] = replace(row["L10 / h"], caveat="; ".join(remarks.get(str(row["bearing"]), ())))
    return rows


def _rows(data: xr.Dataset, name: str, first: str, columns: dict[str, tuple[str, float, str]]) -> list[dict[str, Any]]:
    return [
        {first: label, **{title: _cell(data, name, place, *column) for title, column in columns.items()}}
        for place, label in enumerate(data[name].to_numpy().tolist())
    ]


def _cell(data: xr.Dataset, name: str, place: int, key: str, factor: float, form: str) -> Cell:
    value = factor * float(data[f"{name}_{key}"][place])
    if math.isnan(value):
        return Cell("–", value)
    if math.isinf(value):
        return Cell("infinite", value)
    if key.endswith("damage") and value < LEAST_DAMAGE:
        return Cell(f"below {LEAST_DAMAGE:g}", value)
    if key.endswith("hours"):
        return Cell(life_text(value), value)
    return Cell(format(without_round_off(value), form), value)
