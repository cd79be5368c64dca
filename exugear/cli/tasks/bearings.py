"""The command `bearings`: load, stiffness and life of each rolling bearing under the static load."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from exugear.cli.console import BadInputError
from exugear.cli.tables import Column, Outcome, Table, bearing_findings, detail, significant
from exugear.cli.watched import WatchedProject
from exugear.results.findings import Finding
from exugear.results.folder import duties_summary
from fe_ste.tools.display import life_text

LEGEND = (
    "Axial load: of the shaft on the inner ring, positive along +z. L10r: basic reference rating life, ISO/TS 16281."
)
DETAILS = (
    "Misalignment: tilt of the inner ring against the outer ring. C_r, C_0r: dynamic and static load rating. L10: "
    "basic rating life. Lubricant, cleanliness and ribs are neglected."
)
ESTIMATED = " *: conservative estimate; set dynamic_rating_kN and static_rating_kN to use catalogue values."
CATALOGUES = " +: smallest rating in manufacturers' catalogues for the designation; the same keys replace it."
MESH_LEGEND = (
    "Misalignment: of the gears under load; gap: opening at the +z end over the common face width, negative where the "
    "gap opens at the other end. Load centroid: along +z from the middle of the face width. K_Hbeta: face load factor."
)
MESH_PRESSURE = (
    " σ_H misaligned: largest of the mesh cycle within the path of contact, at this misalignment, no load factors."
)


def bearings(project: WatchedProject, as_json: bool, whole: bool) -> None:
    """Compute, store and print the loads of the bearings and meshes of a project."""
    if not any(bearing.catalogue for bearing in project.gearbox.bearings):
        raise BadInputError(f"{project.gearbox.source}: no bearing has catalogue data; add a [bearings.NAME.catalogue]")
    project.begin()
    project.prepare()
    choice = project.choice
    summary = {
        "case": project.gearbox.source,
        "variant": choice.variant.value,
        "mesh_model": choice.mesh_model,
        "inertias": choice.inertias,
        **duties_summary(*project.duties()),
        "file": str(project.bearings_path),
    }
    rows = summary["bearings"]
    designs = {own["bearing"]: [own["two_designs"]] for own in rows if own["two_designs"]}
    Outcome(
        verdict=_verdict(rows),
        summary=summary,
        tables=bearing_tables(summary),
        findings=[
            *bearing_findings(designs),
            *bearing_findings({own["bearing"]: own["remarks"] for own in rows}),
            *(Finding("warning", f"mesh {own['mesh']}: {own['remark']}") for own in summary["meshes"] if own["remark"]),
        ],
        path=summary["file"],
    ).show(as_json, whole)


def _rating(key: str, bearing: Mapping[str, Any]) -> str:
    """Rating of a bearing, marked if it is estimated or of manufacturers."""
    sign = "*" if bearing["ratings_estimated"] else "+" if bearing["ratings_of_makers"] else ""
    return significant(bearing[key], 3) + sign


_three_digits = partial(significant, digits=3, decimals=5)
BEARINGS = (
    Column("bearing", "bearing"),
    Column("radial\nload kN", "radial_load_kN", lambda load: significant(round(load, 3), 3, 2)),
    Column("axial\nload kN", "axial_load_kN", lambda load: significant(round(load, 3), 3, 2)),
    Column("radial\nstiffness\nGN/m", "radial_stiffness_N_per_m", _three_digits, 1e-9),
    Column("max. contact\nstress MPa", "contact_pressure_MPa", ".0f"),
    Column("L10r\n10⁶ rev", "L10r_Mrev", life_text, missing="inf."),
    Column("misalign-\nment mrad", "misalignment_mrad", ".2f"),
    detail("axial\nstiffness\nGN/m", "axial_stiffness_N_per_m", _three_digits, 1e-9),
    detail("tilting\nstiffness\nMN m/rad", "tilt_stiffness_N_m_per_rad", _three_digits, 1e-6),
    detail("max. ele-\nment kN", "most_loaded_element_kN", partial(significant, digits=3)),
    detail("C_r\nkN", partial(_rating, "dynamic_rating_kN")),
    detail("C_0r\nkN", partial(_rating, "static_rating_kN")),
    detail("L10\n10⁶ rev", "L10_Mrev", life_text, missing="inf."),
)
MESHES = (
    Column("mesh", "mesh"),
    Column("mesh\nforce kN", "force_kN", partial(significant, digits=3)),
    Column("misalign-\nment mrad", "misalignment_mrad", ".2f"),
    Column("gap at +z\nend µm", "opening_um", ".1f"),
    Column("load cen-\ntroid mm", "load_centroid_mm", ".1f"),
    Column("K_Hbeta", "K_Hbeta", ".2f"),
    Column("σ_H mis-\naligned MPa", "sigma_H_misaligned_MPa", ".0f"),
)


def _verdict(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the highest contact stress and the shortest life of all bearings."""
    hardest = max(rows, key=lambda own: own["contact_pressure_MPa"])
    shortest = min(rows, key=_life)
    stress = f"contact stress up to {hardest['contact_pressure_MPa']:.0f} MPa"
    if shortest["L10r_Mrev"] is None:
        return f"{hardest['bearing']}: {stress}"
    life = f"L10r from {life_text(shortest['L10r_Mrev'])}·10⁶ rev"
    if hardest is shortest:
        return f"{hardest['bearing']}: {stress}, {life}"
    return f"{stress[0].upper()}{stress[1:]} ({hardest['bearing']}), {life} ({shortest['bearing']})"


def _life(bearing: Mapping[str, Any]) -> float:
    return math.inf if bearing["L10r_Mrev"] is None else float(bearing["L10r_Mrev"])


def bearing_tables(summary: Mapping[str, Any]) -> list[Table]:
    """Return the tables of all bearings and meshes."""
    rows = sorted(summary["bearings"], key=_life)
    title = f"Bearings under the static load, variant {summary['variant']}"
    details = DETAILS
    details += ESTIMATED if any(bearing["ratings_estimated"] for bearing in rows) else ""
    details += CATALOGUES if any(bearing["ratings_of_makers"] for bearing in rows) else ""
    pressure = any(mesh["sigma_H_misaligned_MPa"] is not None for mesh in summary["meshes"])
    return [
        Table(title, rows, BEARINGS, LEGEND, details, "bearings"),
        Table("Meshes under the static load", summary["meshes"], MESHES, MESH_LEGEND + MESH_PRESSURE * pressure),
    ]
