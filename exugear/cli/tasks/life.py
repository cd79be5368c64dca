"""The command `life`: service life of gears and bearings under the loads of section ``loads``, and what limits it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

from exugear.cli.console import make_results_folder
from exugear.cli.tables import Column, Outcome, Table, bearing_findings, failure_text, significant
from exugear.cli.watched import WatchedProject
from exugear.life.life_file import INFINITE, draw_life, summary
from exugear.results.findings import Finding
from fe_ste.tools.display import life_text

LEAST_DAMAGE = 1e-3
"""Smaller damages are printed as such."""
NOTHING_RATED = (
    "no part is rated: the rating of gears requires [rating.gears.NAME] and a transmission error table of their pair, "
    "that of bearings a table [.catalogue] and a variant with bearings"
)
_column = partial(Column, missing="")
CONTACT_LEGEND = (
    "σ_H life: largest over loads and mesh cycle within the path of contact, misaligned by each load, with K_v "
    "(finite elements); σ_H0: nominal, at the pitch point, at the largest load (ISO 6336-2). Outside: load carried "
    "outside the path of contact. K_Hbeta: of finite elements, at the largest load. S_H FE: over the life, by finite "
    "elements; ISO, FE: by ISO 6336-2 with K_Hbeta of finite elements; stat.: under the largest load."
)
ROOT_LEGEND = (
    "σ_F: maximum root stress (finite elements); nominal: σ_F0 of ISO 6336-3 at the largest load, without load "
    "factors; minimum: smallest principal stress (compression). S_F FE: over the life, by finite elements; ISO, FE: by "
    "ISO 6336-3 with K_Hbeta of finite elements; stat.: under the largest load."
)
BEARING_LEGEND = (
    "Largest: radial load, with partial factors of extreme loads; equiv.: constant equivalent load of the same damage "
    "(ISO 281). L10: basic, L10r: basic reference, L10m: modified reference rating "
    "life. kappa: viscosity ratio. Stress: maximum contact stress. S_0: static safety factor."
)


def life(project: WatchedProject, as_json: bool, whole: bool) -> None:
    """Compute, store and print the life of a project."""
    counted = project.checked_loads()
    make_results_folder(project.folder)
    data = project.life(counted=counted)
    path = project.life_path
    draw_life(data, path.with_suffix(".png"))
    found = {"case": project.gearbox.source, **summary(data), "file": str(path)}
    failures = [*found["failures"], *found["shortfalls"]]
    years, hours = float(data.attrs["life_years"]), float(data["hours"].sum())
    parts = _parts(found)
    outcome = "unknown: no part is rated"
    if parts:
        outcome = "not reached" if failures else "reached"
        outcome += f": damage {PARTS[2].cell(parts[0])}, {parts[0]['part']}, {parts[0]['mode']}"
    Outcome(
        verdict=f"Life of {years:g} year{'s' * (years != 1.0)}, {hours:,.0f} h, {outcome}",
        summary=found,
        tables=life_tables(found),
        findings=[
            *bearing_findings(found["remarks"]),
            *([] if parts else [Finding("warning", NOTHING_RATED)]),
            *(Finding("warning", line) for line in found["reliefs"]),
            *(Finding("note", line) for key in ("assumptions", "unrated") for line in found[key]),
        ],
        path=f"{path}, CSV tables, life.png",
        failure=failure_text("required life not reached:", failures),
    ).show(as_json, whole)


def _flank(kind: str) -> Column:
    """Return the column of flanks, with the number of the planet if there are several."""
    key = f"{kind}_holder"
    return Column("gear, flank, mesh", lambda row: f"{row['flank']} ({row[key]})" if row[key] else row["flank"])


def _damage(value: float) -> str:
    return f"<{LEAST_DAMAGE:g}" if value < LEAST_DAMAGE else significant(value, 2)


FLANKS = (
    _flank("contact"),
    _column("σ_H\nlife MPa", "contact_stress", ".0f", 1e-6),
    _column("σ_H0\nMPa", "nominal_contact", ".0f", 1e-6),
    _column("outside\n%", "outside", ".1f", 100.0),
    _column("K_Hbeta", "face_load", ".3f"),
    _column("fatigue\ndamage", "contact_damage", _damage),
    _column("S_H\nFE", "contact_safety", ".2f"),
    _column("S_H\nISO, FE", "standard_contact_safety", ".2f"),
    _column("S_H\nstat.", "contact_static", ".2f"),
)
ROOTS = (
    _flank("root"),
    _column("σ_F\nMPa", "root_stress", ".0f", 1e-6),
    _column("nominal\nstress MPa", "nominal_root", ".0f", 1e-6),
    _column("minimum\nstress MPa", "compression", ".0f", 1e-6),
    _column("fatigue\ndamage", "root_damage", _damage),
    _column("S_F\nFE", "root_safety", ".2f"),
    _column("S_F\nISO, FE", "standard_root_safety", ".2f"),
    _column("S_F\nstat.", "root_static", ".2f"),
)
BEARINGS = (
    Column("bearing", "bearing"),
    _column("largest\nload kN", "largest_load", partial(significant, digits=3), 1e-3),
    _column("equiv.\nload kN", "equivalent", partial(significant, digits=3), 1e-3),
    _column("L10\nh", "basic_hours", life_text),
    _column("L10r\nh", "reference_hours", life_text),
    _column("L10m\nh", "modified_hours", life_text),
    _column("kappa", "viscosity_ratio", ".2g"),
    _column("contact\nstress MPa", "pressure", ".0f", 1e-6),
    _column("S_0", "static_safety", ".2f"),
)
MODES = {
    "pitting": "contact_damage",
    "tooth breakage": "root_damage",
    "L10": "damage",
    "L10r": "reference_damage",
    "L10m": "modified_damage",
}
"""Key of the damage by each failure mode."""


def _shortest_life(part: Mapping[str, Any]) -> float | None:
    hours = [part[key] for key in ("basic_hours", "reference_hours", "modified_hours") if key in part]
    return min(hours, key=_number, default=None)


def _number(value: float | str) -> float:
    return math.inf if value == INFINITE else float(value)


PARTS = (
    Column("part", "part"),
    Column("failure\nmode", "mode", is_text=True),
    _column("damage", "damage", _damage),
    _column("S_H\nFE", "contact_safety", ".2f"),
    _column("S_F\nFE", "root_safety", ".2f"),
    _column("S_0", "static_safety", ".2f"),
    _column("life\nh", _shortest_life, life_text),
)
PART_LEGEND = (
    "Damage: 1 is failure at the design probability. S_H, S_F: over the life, by finite elements with load factors, "
    "misaligned by each load; to ISO 6336: check --rating. Life: the shortest of L10, L10r and L10m."
)


def _parts(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return flanks and bearings with their largest damage, the largest first."""
    parts = []
    for part in (*found["flanks"], *found["bearings"]):
        damages = {mode: _number(part[key]) for mode, key in MODES.items() if key in part}
        mode = max(damages, key=lambda own: damages[own], default="")
        name = part.get("flank") or part["bearing"]
        parts.append({**part, "part": name, "mode": mode, "damage": damages.get(mode, 0.0)})
    return sorted(parts, key=lambda part: -part["damage"])


def life_tables(found: Mapping[str, Any]) -> list[Table]:
    """Return the tables of all parts, and those of flanks, roots and bearings."""
    title = "Tooth flanks: largest contact stress, safety against pitting"
    # The legend names the gears, because the parts with the largest damage may all be bearings.
    smallest = []
    for symbol, key in (("S_H", "contact_safety"), ("S_F", "root_safety")):
        rated = [flank for flank in found["flanks"] if math.isfinite(_number(flank.get(key, math.nan)))]
        if rated:
            least = min(rated, key=lambda flank: float(flank[key]))
            smallest.append(f"{symbol} {float(least[key]):.2f} ({least['flank']})")
    legend = f"Smallest {', '.join(smallest)}. {PART_LEGEND}" if smallest else PART_LEGEND
    return [
        Table("Parts with the largest fatigue damage", _parts(found), PARTS, legend, noun="parts"),
        Table(title, found["flanks"], FLANKS, CONTACT_LEGEND),
        Table("Tooth roots: largest stress, safety against breakage", found["flanks"], ROOTS, ROOT_LEGEND),
        Table("Bearings: rating life, static safety", found["bearings"], BEARINGS, BEARING_LEGEND),
    ]
