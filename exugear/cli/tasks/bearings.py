"""The command `bearings`: load, stiffness and life of each rolling bearing under the static load."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from exugear.cli.console import BadInputError, note, print_json, say, warn
from exugear.cli.tables import Column, print_table, significant
from exugear.cli.watched import WatchedProject
from exugear.results.folder import duties_summary
from fe_ste.tools.display import life_text

LOAD_LEGEND = (
    "Axial load: of the shaft on the inner ring, positive along +z. Misalignment: tilt of the inner ring against the "
    "outer ring."
)
LIFE_LEGEND = (
    "C_r, C_0r: dynamic and static load rating. L10: basic rating life, L10r: basic reference rating life (ISO/TS "
    "16281), in million revolutions; lubricant, cleanliness and ribs are neglected."
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


def bearings(project: WatchedProject, as_json: bool) -> None:
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
    if as_json:
        print_json(summary)
        return
    print_bearings(summary)
    say(f"Results: {summary['file']}")
    for bearing in summary["bearings"]:
        if bearing["two_designs"]:
            note(f"bearings.{bearing['bearing']}: {bearing['two_designs']}")
        for remark in bearing["remarks"]:
            warn(f"bearings.{bearing['bearing']}: {remark}")
    for mesh in summary["meshes"]:
        if mesh["remark"]:
            warn(f"meshes.{mesh['mesh']}: {mesh['remark']}")


def _rating(key: str, bearing: Mapping[str, Any]) -> str:
    """Rating of a bearing, marked if it is estimated or of manufacturers."""
    sign = ""
    if bearing["ratings_estimated"]:
        sign = "*"
    elif bearing["ratings_of_makers"]:
        sign = "+"
    return significant(bearing[key]) + sign


_three_digits = partial(significant, digits=3, decimals=5)
LOADS = (
    Column("bearing", "bearing"),
    Column("radial\nload kN", "radial_load_kN", lambda load: significant(round(load, 3))),
    Column("axial\nload kN", "axial_load_kN", lambda load: significant(round(load, 3))),
    Column("radial\nGN/m", "radial_stiffness_N_per_m", _three_digits, 1e-9),
    Column("axial\nGN/m", "axial_stiffness_N_per_m", _three_digits, 1e-9),
    Column("tilting\nMN m/rad", "tilt_stiffness_N_m_per_rad", _three_digits, 1e-6),
    Column("misalign-\nment mrad", "misalignment_mrad", ".3f"),
)
LIVES = (
    Column("bearing", "bearing"),
    Column("max. ele-\nment kN", "most_loaded_element_kN", partial(significant, digits=3)),
    Column("max. contact\nstress MPa", "contact_pressure_MPa", ".0f"),
    Column("C_r\nkN", partial(_rating, "dynamic_rating_kN")),
    Column("C_0r\nkN", partial(_rating, "static_rating_kN")),
    Column("L10\n10⁶ rev", "L10_Mrev", life_text, missing="inf."),
    Column("L10r\n10⁶ rev", "L10r_Mrev", life_text, missing="inf."),
)
MESHES = (
    Column("mesh", "mesh"),
    Column("mesh\nforce kN", "force_kN", significant),
    Column("misalign-\nment mrad", "misalignment_mrad", ".3f"),
    Column("gap at +z\nend µm", "opening_um", ".1f"),
    Column("load cen-\ntroid mm", "load_centroid_mm", ".1f"),
    Column("K_Hbeta", "K_Hbeta", ".2f"),
    Column("σ_H mis-\naligned MPa", "sigma_H_misaligned_MPa", ".0f"),
)


def print_bearings(summary: Mapping[str, Any]) -> None:
    """Print the tables of all bearings and meshes."""
    rows = summary["bearings"]
    print_table(f"Bearings under the static load, variant {summary['variant']}", rows, LOADS, LOAD_LEGEND)
    legend = LIFE_LEGEND
    if any(bearing["ratings_estimated"] for bearing in rows):
        legend += ESTIMATED
    if any(bearing["ratings_of_makers"] for bearing in rows):
        legend += CATALOGUES
    print_table("Element load, ratings and rating life of the bearings", rows, LIVES, legend)
    if summary["meshes"]:
        legend = MESH_LEGEND
        if any(mesh["sigma_H_misaligned_MPa"] is not None for mesh in summary["meshes"]):
            legend += MESH_PRESSURE
        print_table("Meshes under the static load", summary["meshes"], MESHES, legend)
