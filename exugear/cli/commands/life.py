"""The verb `life`: how long gears and bearings last under the loads of section ``loads``, and what limits them."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from functools import partial
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
from exugear.cli.console import FailedError, exit_codes, make_results_folder, note, print_json, print_table, say
from exugear.gearbox.variant import Variant

if TYPE_CHECKING:
    from pathlib import Path

    import xarray as xr

SHOWN_LIMITS = 8


def life(
    case: CaseArgument,
    variant: VariantOption = Variant.bushing,
    mesh_model: LawOption = USUAL_LAW,
    inertias: InertiasOption = None,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Rate gears and bearings under the loads of section ``loads``: damages, safety factors, lives, what limits.

    Tables that are missing or do not fit the case are computed first.
    """
    with exit_codes():
        from exugear.gearbox.choice import Choice
        from exugear.life.life_file import draw_life, summary

        project = open_project(case, Choice(variant.value, mesh_model.value, inertias), out, allow_dir, scripts)
        counted = project.checked_loads()
        make_results_folder(project.folder)
        data = project.life(counted=counted)
        picture = project.life_path.with_suffix(".png")
        draw_life(data, picture)
        if as_json:
            print_json({"case": str(case), **summary(data), "file": str(project.life_path)})
        else:
            _tell(data)
            say(f"Life in {project.life_path}, tables with commas and a picture beside it")
        _fail_if_short(data, project.life_path)


def _fail_if_short(data: xr.Dataset, path: Path) -> None:
    """End with code 1 where a part fails or falls short of what is asked for."""
    lines = [line for key in ("failures", "shortfalls") for line in json.loads(data.attrs[key])]
    if lines:
        raise FailedError("\n".join(["the gearbox does not live as long as it shall:", *lines, f"It is in {path}"]))


CONTACT_STRESSES = (
    "sigma_H: by Hertz from the line loads of finite elements inside the path of contact, K_v in it, where the gears "
    "stand under each load; ISO: sigma_H0 of ISO 6336-2 under the largest load, without load factors"
)


def _tell(data: xr.Dataset) -> None:
    from exugear.life.life_file import limits

    for line in json.loads(data.attrs["failures"]):
        say(line)
    if data.sizes["flank"]:
        print_table("Flanks: largest contact stress of the life, safety against pitting", _contact_rows(data))
        say(CONTACT_STRESSES)
        print_table("Roots: largest stress of the life, safety against breakage", _root_rows(data))
    if data.sizes["bearing"]:
        print_table("Bearings: basic rating life, static safety", _bearing_rows(data))
    worst = [limit for limit in limits(data) if limit[2] > 0.0][:SHOWN_LIMITS]
    if worst:
        rows = [{"limits": part, "by": kind, "damage": _told(damage, ".3g")} for part, kind, damage in worst]
        print_table(f"What limits the life of {float(data.attrs['life_years']):g} years", rows)
    for key, style in (("assumptions", ""), ("unrated", "yellow"), ("reliefs", "yellow")):
        for line in json.loads(data.attrs[key]):
            note(line, style=style)


def _contact_rows(data: xr.Dataset) -> list[dict[str, str]]:
    return [
        {
            "gear, flank, mesh": _with_holder(data, label, "contact"),
            "sigma_H\nMPa": _told(1e-6 * value("contact_stress"), ".0f"),
            "ISO\nMPa": _told(1e-6 * value("nominal_contact"), ".0f"),
            "outside\n%": _told(100.0 * value("outside"), ".1f"),
            "K_Hb": _told(value("face_load"), ".3f"),
            "damage": _told(value("contact_damage"), ".3g"),
            "S_H": _told(value("contact_safety"), ".2f"),
            "ISO\nS_H": _told(value("standard_contact_safety"), ".2f"),
        }
        for label, value in _entries(data, "flank")
    ]


def _root_rows(data: xr.Dataset) -> list[dict[str, str]]:
    return [
        {
            "gear, flank, mesh": _with_holder(data, label, "root"),
            "sigma_F\nMPa": _told(1e-6 * value("root_stress"), ".0f"),
            "ISO\nMPa": _told(1e-6 * value("nominal_root"), ".0f"),
            "least\nMPa": _told(1e-6 * value("compression"), ".0f"),
            "damage": _told(value("root_damage"), ".3g"),
            "S_F": _told(value("root_safety"), ".2f"),
            "ISO\nS_F": _told(value("standard_root_safety"), ".2f"),
            "static\nS_H": _told(value("contact_static"), ".2f"),
            "static\nS_F": _told(value("root_static"), ".2f"),
        }
        for label, value in _entries(data, "flank")
    ]


def _bearing_rows(data: xr.Dataset) -> list[dict[str, str]]:
    return [
        {
            "bearing": label,
            "largest\nkN": _told(1e-3 * value("largest_load"), ".4g"),
            "equivalent\nkN": _told(1e-3 * value("equivalent"), ".4g"),
            "L10\nh": _told(value("basic_hours"), ".3g"),
            "L10r\nh": _told(value("reference_hours"), ".3g"),
            "L10m\nh": _told(value("modified_hours"), ".3g"),
            "kappa": _told(value("viscosity_ratio"), ".2g"),
            "pressure\nMPa": _told(1e-6 * value("pressure"), ".0f"),
            "S_0": _told(value("static_safety"), ".2f"),
        }
        for label, value in _entries(data, "bearing")
    ]


def _entries(data: xr.Dataset, name: str) -> Iterator[tuple[str, Callable[[str], float]]]:
    """Label of each part, and what gives its figures by their keys."""
    for place, label in enumerate(data[name].to_numpy().tolist()):
        yield label, partial(_figure, data, name, place)


def _with_holder(data: xr.Dataset, label: str, kind: str) -> str:
    """Label of a flank, and which of several planets it is."""
    holder = str(data[f"flank_{kind}_holder"].sel(flank=label).item())
    if holder:
        return f"{label}\n  {holder}"
    return label


def _figure(data: xr.Dataset, name: str, place: int, key: str) -> float:
    return float(data[f"{name}_{key}"][place])


def _told(value: float, form: str) -> str:
    if math.isnan(value):
        return ""
    if math.isinf(value):
        return "infinite"
    return format(value, form)
