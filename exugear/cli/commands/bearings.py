"""The verb `bearings`: what each rolling bearing bears under the static load."""

from __future__ import annotations

import math
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
from exugear.cli.console import BadInputError, exit_codes, note, print_json, print_table, say
from exugear.gearbox.variant import Variant

if TYPE_CHECKING:
    from exugear.system.bearings.duty import BearingLoadState
    from exugear.system.tooth_mesh.contact_state import MeshLoadState


AXIAL_SIGN = "Axial loads are those of the shaft on the inner ring, positive along +z"
MESH_PRESSURE = (
    "Pressure of a mesh: largest over ten positions of the mesh cycle, away from tip edges, under the static load "
    "where the gears stand on their bearings, without load factors"
)


def bearings(
    case: CaseArgument,
    variant: VariantOption = Variant.bushing,
    mesh_model: LawOption = USUAL_LAW,
    inertias: InertiasOption = None,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Tell load, stiffness, contact pressure and life of each catalogue bearing under the static load.

    Told as well: how the gears of each mesh stand there, and how evenly their teeth bear. Teeth resist misalignment by
    the contact of finite elements, and so share the load among the bearings; the law iso6336 needs no tables and lets
    them bear evenly. Tables that are missing or do not fit the case are computed first.
    """
    with exit_codes():
        from exugear.gearbox.choice import Choice
        from exugear.results.folder import duties_summary

        if not variant.on_bearings:
            raise BadInputError(f"--variant {variant}: has ideal joints in place of bearings; use bushing or flexible")
        project = open_project(case, Choice(variant.value, mesh_model.value, inertias), out, allow_dir, scripts)
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
        title = f"Bearings under the static load, {variant.value}"
        print_table(title, [_load_row(duty) for duty in duties])
        say(AXIAL_SIGN)
        print_table("Contact, ratings, basic rating life", [*map(_life_row, duties)])
        print_table("Meshes", [*map(_mesh_row, meshes)])
        if any(not math.isnan(mesh.pressure) for mesh in meshes):
            say(MESH_PRESSURE)
        if any(duty.ratings.estimated for duty in duties):
            say("* rating estimated on the safe side; dynamic_rating_kN and static_rating_kN of the file replace it")
        if any(duty.ratings.makers for duty in duties):
            say("+ least rating that makers print for the designation; keys of the file replace it as well")
        say("Lives are basic: lubricant and cleanliness are left out, and so are ribs")
        say(f"Bearings in {path}")
        for duty in duties:
            if duty.ratings.two_designs:
                note(f"bearings.{duty.name}: {duty.ratings.two_designs}")
            for remark in duty.remarks:
                note(f"bearings.{duty.name}: {remark}", style="yellow")
        for mesh in meshes:
            if mesh.remark:
                note(f"meshes.{mesh.name}: {mesh.remark}", style="yellow")


def _load_row(duty: BearingLoadState) -> dict[str, str]:
    return {
        "bearing": duty.name,
        "radial\nkN": f"{1e-3 * duty.radial_load:.4g}",
        "axial\nkN": f"{round(1e-3 * duty.axial_load, 3) + 0.0:.4g}",
        "radial\nGN/m": f"{1e-9 * duty.radial_stiffness:.3g}",
        "axial\nGN/m": f"{1e-9 * duty.stiffness[2, 2]:.3g}",
        "tilt\nMN m/rad": f"{0.5e-6 * (duty.stiffness[3, 3] + duty.stiffness[4, 4]):.3g}",
        "misaligned\nmrad": f"{1e3 * duty.misalignment:.3f}",
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
        "most loaded\nelement kN": f"{1e-3 * duty.element_load:.3g}",
        "pressure\nMPa": f"{1e-6 * duty.pressure:.0f}",
        "C_r\nkN": f"{1e-3 * duty.ratings.dynamic:.4g}{sign}",
        "C_0r\nkN": f"{1e-3 * duty.ratings.static:.4g}{sign}",
        "L10\nMrev": f"{duty.basic_life:.3g}",
        "L10r\nMrev": f"{duty.reference_life:.3g}",
    }


def _mesh_row(duty: MeshLoadState) -> dict[str, str]:
    def shown(value: float, form: str) -> str:
        if math.isnan(value):
            return "-"
        return format(value, form)

    return {
        "mesh": duty.name,
        "force\nkN": f"{1e-3 * duty.force:.4g}",
        "misaligned\nmrad": f"{1e3 * duty.misalignment:.3f}",
        "opens +z\nµm": f"{1e6 * duty.opening:.1f}",
        "load centre\nmm": shown(1e3 * duty.load_centroid, ".1f"),
        "K_Hbeta": shown(duty.face_load_factor, ".2f"),
        "pressure\nMPa": shown(1e-6 * duty.pressure, ".0f"),
    }
