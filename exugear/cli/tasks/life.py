"""The command `life`: service life of gears and bearings under the loads of section ``loads``, and what limits it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from exugear.cli.console import FailedError, make_results_folder, note, print_json, say
from exugear.cli.tables import Column, print_table
from exugear.cli.watched import WatchedProject
from exugear.life.life_file import INFINITE, draw_life, summary
from fe_ste.tools.display import life_text, without_round_off

SHOWN_LIMITS = 8
_column = partial(Column, missing="")
CONTACT_LEGEND = (
    "σ_H life: largest over loads and mesh cycle within the path of contact, misaligned by each load, with K_v "
    "(finite elements); σ_H0: nominal, at the pitch point, at the largest load (ISO 6336-2). Outside: load carried "
    "outside the path of contact. K_Hbeta: of finite elements, at the largest load; S_H ISO has it, too: σ_H0 with "
    "load factors (ISO 6336-2). S_H stat.: under the largest load."
)
ROOT_LEGEND = (
    "σ_F: maximum root stress (finite elements); nominal: σ_F0 of ISO 6336-3 at the largest load, without load "
    "factors; minimum: smallest principal stress (compression). S_F ISO: safety factor of ISO 6336-3; stat.: under the "
    "largest load."
)
BEARING_LEGEND = (
    "Largest: radial load, with partial factors of extreme loads; equiv.: constant equivalent load of the same damage "
    "(ISO 281). L10: basic, L10r: basic reference, L10m: modified reference rating "
    "life. kappa: viscosity ratio. Stress: maximum contact stress. S_0: static safety factor."
)


def life(project: WatchedProject, as_json: bool) -> None:
    """Compute, store and print the life of a project."""
    counted = project.checked_loads()
    make_results_folder(project.folder)
    data = project.life(counted=counted)
    path = project.life_path
    draw_life(data, path.with_suffix(".png"))
    found = {"case": project.gearbox.source, **summary(data), "file": str(path)}
    if as_json:
        print_json(found)
    else:
        print_life(found, float(data.attrs["life_years"]))
        say(f"Results: {path}; CSV tables and a picture in the same folder")
    if lines := [*found["failures"], *found["shortfalls"]]:
        raise FailedError("\n".join(["required life not reached:", *lines, f"Results: {path}"]))


def _flank(kind: str) -> Column:
    """Return the column of flanks, with the number of the planet if there are several."""
    key = f"{kind}_holder"
    return Column("gear, flank, mesh", lambda row: f"{row['flank']} ({row[key]})" if row[key] else row["flank"])


FLANKS = (
    _flank("contact"),
    _column("σ_H\nlife MPa", "contact_stress", ".0f", 1e-6),
    _column("σ_H0\nMPa", "nominal_contact", ".0f", 1e-6),
    _column("outside\n%", "outside", ".1f", 100.0),
    _column("K_Hbeta", "face_load", ".3f"),
    _column("fatigue\ndamage", "contact_damage", ".3g"),
    _column("S_H", "contact_safety", ".2f"),
    _column("S_H\nISO", "standard_contact_safety", ".2f"),
    _column("S_H\nstat.", "contact_static", ".2f"),
)
ROOTS = (
    _flank("root"),
    _column("σ_F\nMPa", "root_stress", ".0f", 1e-6),
    _column("nominal\nMPa", "nominal_root", ".0f", 1e-6),
    _column("minimum\nMPa", "compression", ".0f", 1e-6),
    _column("fatigue\ndamage", "root_damage", ".3g"),
    _column("S_F", "root_safety", ".2f"),
    _column("S_F\nISO", "standard_root_safety", ".2f"),
    _column("S_F\nstat.", "root_static", ".2f"),
)
BEARINGS = (
    Column("bearing", "bearing"),
    _column("largest\nkN", "largest_load", ".4g", 1e-3),
    _column("equiv.\nkN", "equivalent", ".4g", 1e-3),
    _column("L10\nh", "basic_hours", life_text),
    _column("L10r\nh", "reference_hours", life_text),
    _column("L10m\nh", "modified_hours", life_text),
    _column("kappa", "viscosity_ratio", ".2g"),
    _column("stress\nMPa", "pressure", ".0f", 1e-6),
    _column("S_0", "static_safety", ".2f"),
)
LIMITS = (Column("part", "part"), Column("failure mode", "by", is_text=True), _column("damage", "damage", ".3g"))


def print_life(found: Mapping[str, Any], years: float) -> None:
    """Print the tables of flanks, roots and bearings, and the parts with the largest damage."""
    for line in found["failures"]:
        say(line)
    if found["flanks"]:
        title = "Tooth flanks: largest contact stress, safety against pitting"
        print_table(title, found["flanks"], FLANKS, CONTACT_LEGEND)
        print_table("Tooth roots: largest stress, safety against breakage", found["flanks"], ROOTS, ROOT_LEGEND)
    if found["bearings"]:
        print_table("Bearings: rating life, static safety", found["bearings"], BEARINGS, BEARING_LEGEND)
        for bearing, remarks in found["remarks"].items():
            for remark in remarks:
                note(f"{bearing}: {remark}", style="yellow")
    worst = [limit for limit in found["limits"] if limit["damage"] == INFINITE or without_round_off(limit["damage"])]
    if worst:
        title = f"Parts with the largest fatigue damage in {years:g} years"
        print_table(title, worst[:SHOWN_LIMITS], LIMITS, "Damage: 1 is failure at the design probability.")
    for key, style in (("assumptions", ""), ("unrated", "yellow"), ("reliefs", "yellow")):
        for line in found[key]:
            note(line, style=style)
