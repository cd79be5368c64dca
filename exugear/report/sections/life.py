"""Sections "Rating and life" (damage of gears and bearings under the load spectrum, limiting parts) and "Studies"."""

from __future__ import annotations

import io
import json
import math
from typing import Any

import xarray as xr

from exugear.life.life_file import draw_life, limits
from exugear.report.findings.context import choice_of, model_label
from exugear.report.findings.words import figure_text
from exugear.report.pictures.png import png_address
from exugear.report.sections.material import Part, ReportData
from exugear.report.web.html import Cell, Table, render
from exugear.results.folder import StoredStudy, stored_studies
from fe_ste.tools.display import LONGEST_LIFE, life_text, without_round_off

LEAST_DAMAGE = 1e-6
"""Damages below this value are shown as "below" it."""


def life_section(material: ReportData) -> Part:
    """List loads, damages and safety factors for each rated variant, and add the rating sheet to the page's data.

    The sheet has the key ``rating`` and is that of ``check --rating --json``.
    """
    ratings = material.ratings
    data = {} if ratings.sheet is None else {"rating": ratings.sheet.summary()}
    for life in ratings.lives:
        worst = limits(life)
        if worst:
            part, kind, damage = worst[0]
            size = "infinite" if math.isinf(damage) else f"{damage:.3g}"
            material.context.notes.statements.append(
                f"{model_label(choice_of(life.attrs))}: largest fatigue damage in "
                f"{float(life.attrs['life_years']):g} years: {material.words.labelled(part)}, {size} ({kind})."
            )
    if not ratings.lives:
        return Part(data=data)
    content = [_rated_variant(material, life) for life in ratings.lives]
    return Part(render("life", variants=content), data, "Rating and life", "life")


def _rated_variant(material: ReportData, data: xr.Dataset) -> dict[str, Any]:
    labelled = material.words.labelled
    data = data.assign_coords(
        {key: [labelled(str(own)) for own in data[key].to_numpy()] for key in ("flank", "bearing")}
    )
    name = model_label(choice_of(data.attrs))
    label = f"life-{data.attrs['variant']}-{data.attrs['mesh_model']}"

    def listed(*keys: str) -> list[str]:
        return [labelled(line) for key in keys for line in json.loads(data.attrs[key])]

    content = io.BytesIO()
    draw_life(data).savefig(content, format="png", dpi=130)
    return {
        "title": f"{name[0].upper()}{name[1:]}, gears to {data.attrs['edition']}",
        "failures": listed("failures"),
        "shortfalls": listed("shortfalls"),
        "reliefs": listed("reliefs"),
        "picture": png_address(content.getvalue()),
        "words": f"Limiting parts, {name}",
        "gears": Table(_flank_rows(data), caption=f"Gears, {name}", name=f"{label}-gears", sortable=True),
        "bearings": Table(_bearing_rows(data), caption=f"Bearings, {name}", name=f"{label}-bearings", sortable=True),
        "remarks": [
            f"{labelled(bearing)}: {remark}"
            for bearing, remarks in json.loads(data.attrs["bearing_remarks"]).items()
            for remark in remarks
        ],
        "rested": listed("assumptions", "unrated"),
    }


def _flank_rows(data: xr.Dataset) -> list[dict[str, object]]:
    columns = {
        "σ_H life / MPa": ("contact_stress", 1e-6, ".0f"),
        "σ_H0 / MPa": ("nominal_contact", 1e-6, ".0f"),
        "outside the path / %": ("outside", 100.0, ".1f"),
        "K_Hbeta": ("face_load", 1.0, ".3f"),
        "pitting damage": ("contact_damage", 1.0, ".3g"),
        "S_H": ("contact_safety", 1.0, ".2f"),
        "S_H, ISO": ("standard_contact_safety", 1.0, ".2f"),
        "σ_F / MPa": ("root_stress", 1e-6, ".0f"),
        "σ_F0, ISO / MPa": ("nominal_root", 1e-6, ".0f"),
        "root damage": ("root_damage", 1.0, ".3g"),
        "S_F": ("root_safety", 1.0, ".2f"),
        "S_F, ISO": ("standard_root_safety", 1.0, ".2f"),
        "static S_H": ("contact_static", 1.0, ".2f"),
        "static S_F": ("root_static", 1.0, ".2f"),
    }
    return _rows(data, "flank", "gear, flank, mesh", columns)


def _bearing_rows(data: xr.Dataset) -> list[dict[str, object]]:
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
    return _rows(data, "bearing", "bearing", columns)


def _rows(
    data: xr.Dataset, name: str, first: str, columns: dict[str, tuple[str, float, str]]
) -> list[dict[str, object]]:
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
        return Cell(figure_text(float(format(value, form))) if value <= LONGEST_LIFE else life_text(value), value)
    return Cell(format(without_round_off(value), form), value)


# Section "Studies": pictures of each study of the gearbox

LARGEST_PICTURE = 2_000_000
"""Maximum size of a picture embedded in the page, bytes."""


def studies_section(material: ReportData) -> Part:
    """Show the pictures of the studies in the results folder."""
    found = list(stored_studies(material.context.folder, material.context.gearbox))
    if not found:
        return Part()
    return Part(render("studies", studies=map(_study, found)), title="Studies", name="studies")


def _study(study: StoredStudy) -> dict[str, object]:
    lost = "".join(
        f", {count} {word}" for count, word in ((study.failed, "failed"), (study.missing, "missing")) if count
    )
    return {
        "title": study.title,
        "fits": study.fits,
        "words": f"{study.points} points{lost}. {study.description[:1].upper()}{study.description[1:]}",
        "pictures": [
            (png_address(path.read_bytes()), path.stem.replace("_", " "))
            for path in study.pictures
            if path.stat().st_size <= LARGEST_PICTURE
        ],
    }
