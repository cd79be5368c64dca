"""The command `bearings`: load, stiffness and life of each rolling bearing under the static load."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from exugear.cli.case import (
    USUAL_LAW,
    CaseArgument,
    FilesBelowOption,
    InertiasOption,
    JsonOption,
    LawOption,
    OutOption,
    ScriptsOption,
    VariantOption,
    open_project,
)
from exugear.cli.console import BadInputError, exit_codes, note, print_json, say
from exugear.cli.tables import print_table, significant
from exugear.gearbox.variant import Variant

if TYPE_CHECKING:
    from exugear.system.bearings.duty import BearingLoadState
    from exugear.system.tooth_mesh.contact_state import MeshLoadState


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
    " Contact stress: maximum of ten positions of the mesh cycle, without tip-edge contact and load factors, with the "
    "gears displaced by the static load."
)


def bearings(
    case: CaseArgument,
    variant: VariantOption = None,
    mesh_model: LawOption = USUAL_LAW,
    inertias: InertiasOption = None,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """List load, stiffness and life of the catalogue bearings.

    All values are for the static load. Also lists misalignment, load distribution and contact stress of each mesh.
    Transmission error tables that are missing or out of date are computed first.
    """
    with exit_codes():
        from exugear.results.folder import duties_summary

        variant = variant or Variant.bushing
        if not variant.has_bearings:
            raise BadInputError(f"--variant {variant}: has ideal joints instead of bearings; use bushing or flexible")
        project = open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias)
        if not any(bearing.catalogue for bearing in project.gearbox.bearings):
            raise BadInputError(f"{case}: no bearing has catalogue data; add a [bearings.NAME.catalogue]")
        project.begin()
        project.prepare()
        duties, meshes = project.duties()
        path = project.bearings_path
        if as_json:
            choice = {"variant": variant.value, "mesh_model": mesh_model.value, "inertias": project.choice.inertias}
            print_json({"case": str(case), **choice, **duties_summary(duties, meshes), "file": str(path)})
            return
        _print_bearings(duties, meshes, variant)
        say(f"Results: {path}")
        for duty in duties:
            if duty.ratings.two_designs:
                note(f"bearings.{duty.name}: {duty.ratings.two_designs}")
            for remark in duty.remarks:
                note(f"Warning: bearings.{duty.name}: {remark}", style="yellow")
        for mesh in meshes:
            if mesh.remark:
                note(f"Warning: meshes.{mesh.name}: {mesh.remark}", style="yellow")


def _print_bearings(duties: Sequence[BearingLoadState], meshes: Sequence[MeshLoadState], variant: Variant) -> None:
    """Print the tables of all bearings and meshes."""
    print_table(f"Bearings under the static load, variant {variant}", [*map(_load_row, duties)], legend=LOAD_LEGEND)
    legend = LIFE_LEGEND
    if any(duty.ratings.estimated for duty in duties):
        legend += ESTIMATED
    if any(duty.ratings.makers for duty in duties):
        legend += CATALOGUES
    print_table("Element load, ratings and rating life of the bearings", [*map(_life_row, duties)], legend=legend)
    if meshes:
        legend = MESH_LEGEND
        if any(not math.isnan(mesh.pressure) for mesh in meshes):
            legend += MESH_PRESSURE
        print_table("Meshes under the static load", [*map(_mesh_row, meshes)], legend=legend)


def _load_row(duty: BearingLoadState) -> dict[str, str]:
    return {
        "bearing": duty.name,
        "radial\nload kN": significant(round(1e-3 * duty.radial_load, 3)),
        "axial\nload kN": significant(round(1e-3 * duty.axial_load, 3)),
        "radial\nGN/m": significant(1e-9 * duty.radial_stiffness, 3, 5),
        "axial\nGN/m": significant(1e-9 * duty.stiffness[2, 2], 3, 5),
        "tilting\nMN m/rad": significant(0.5e-6 * (duty.stiffness[3, 3] + duty.stiffness[4, 4]), 3, 5),
        "misalign-\nment mrad": f"{1e3 * duty.misalignment:.3f}",
    }


def _life_row(duty: BearingLoadState) -> dict[str, str]:
    if duty.ratings.estimated:
        sign = "*"
    elif duty.ratings.makers:
        sign = "+"
    else:
        sign = ""
    return {
        "bearing": duty.name,
        "max. ele-\nment kN": significant(1e-3 * duty.element_load, 3),
        "max. contact\nstress MPa": f"{1e-6 * duty.pressure:.0f}",
        "C_r\nkN": significant(1e-3 * duty.ratings.dynamic) + sign,
        "C_0r\nkN": significant(1e-3 * duty.ratings.static) + sign,
        "L10\n10⁶ rev": f"{duty.basic_life:.3g}",
        "L10r\n10⁶ rev": f"{duty.reference_life:.3g}",
    }


def _mesh_row(duty: MeshLoadState) -> dict[str, str]:
    def shown(value: float, form: str) -> str:
        if math.isnan(value):
            return "-"
        return format(value, form)

    return {
        "mesh": duty.name,
        "mesh\nforce kN": significant(1e-3 * duty.force),
        "misalign-\nment mrad": f"{1e3 * duty.misalignment:.3f}",
        "gap at +z\nend µm": f"{1e6 * duty.opening:.1f}",
        "load cen-\ntroid mm": shown(1e3 * duty.load_centroid, ".1f"),
        "K_Hbeta": shown(duty.face_load_factor, ".2f"),
        "contact\nstress MPa": shown(1e-6 * duty.pressure, ".0f"),
    }
