"""The command `life`: service life of gears and bearings under the loads of section ``loads``, and what limits it."""

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
from exugear.cli.console import FailedError, exit_codes, make_results_folder, note, print_json, say
from exugear.cli.tables import print_table

if TYPE_CHECKING:
    from pathlib import Path

    import xarray as xr

SHOWN_LIMITS = 8


def life(
    case: CaseArgument,
    variant: VariantOption = None,
    mesh_model: LawOption = USUAL_LAW,
    inertias: InertiasOption = None,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Rate gears and bearings for their loads and service life.

    Lists damage, safety factors, rating lives and the limiting parts for the loads of section [loads]. Transmission
    error tables that are missing or out of date are computed first.
    """
    with exit_codes():
        from exugear.life.life_file import draw_life, summary

        project = open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias)
        counted = project.checked_loads()
        make_results_folder(project.folder)
        data = project.life(counted=counted)
        picture = project.life_path.with_suffix(".png")
        draw_life(data, picture)
        if as_json:
            print_json({"case": str(case), **summary(data), "file": str(project.life_path)})
        else:
            _print_result(data)
            say(f"Results: {project.life_path}; CSV tables and a picture in the same folder")
        _fail_if_short(data, project.life_path)


def _fail_if_short(data: xr.Dataset, path: Path) -> None:
    """End with code 1 if a part fails, or misses its required life or safety factor."""
    lines = [line for key in ("failures", "shortfalls") for line in json.loads(data.attrs[key])]
    if lines:
        raise FailedError("\n".join(["required life not reached:", *lines, f"Results: {path}"]))


CONTACT_LEGEND = (
    "sigma_H: Hertzian stress from the line loads of the finite element contact within the path of contact, with K_v, "
    "gears displaced by each load; nominal: sigma_H0 of ISO 6336-2 at the largest load, without load factors. Outside: "
    "load carried outside the path of contact. S_H ISO: safety factor of ISO 6336-2; stat.: under the largest load."
)
ROOT_LEGEND = (
    "sigma_F: maximum root stress (finite elements); nominal: sigma_F0 of ISO 6336-3 at the largest load, without load "
    "factors; minimum: smallest principal stress (compression). S_F ISO: safety factor of ISO 6336-3; stat.: under the "
    "largest load."
)
BEARING_LEGEND = (
    "Largest: radial load, with partial factors of extreme loads; equiv.: constant equivalent load of the same damage "
    "(ISO 281). L10: basic, L10r: basic reference, L10m: modified reference rating "
    "life. kappa: viscosity ratio. Stress: maximum contact stress. S_0: static safety factor."
)


def _print_result(data: xr.Dataset) -> None:
    from exugear.life.life_file import limits

    for line in json.loads(data.attrs["failures"]):
        say(line)
    if data.sizes["flank"]:
        rows = _contact_rows(data)
        print_table("Tooth flanks: largest contact stress, safety against pitting", rows, legend=CONTACT_LEGEND)
        rows = _root_rows(data)
        print_table("Tooth roots: largest stress, safety against breakage", rows, legend=ROOT_LEGEND)
    if data.sizes["bearing"]:
        print_table("Bearings: rating life, static safety", _bearing_rows(data), legend=BEARING_LEGEND)
    worst = [limit for limit in limits(data) if limit[2] > 0.0][:SHOWN_LIMITS]
    if worst:
        rows = [
            {"part": part, "failure mode": kind, "damage": _number_text(damage, ".3g")} for part, kind, damage in worst
        ]
        title = f"Parts with the largest fatigue damage in {float(data.attrs['life_years']):g} years"
        print_table(title, rows, ("failure mode",), "Damage: 1 is failure at the design probability.")
    for key, style in (("assumptions", ""), ("unrated", "yellow"), ("reliefs", "yellow")):
        for line in json.loads(data.attrs[key]):
            note(line, style=style)


def _contact_rows(data: xr.Dataset) -> list[dict[str, str]]:
    return [
        {
            "gear, flank, mesh": _with_holder(data, label, "contact"),
            "sigma_H\nMPa": _number_text(1e-6 * value("contact_stress"), ".0f"),
            "nominal\nMPa": _number_text(1e-6 * value("nominal_contact"), ".0f"),
            "outside\n%": _number_text(100.0 * value("outside"), ".1f"),
            "K_Hbeta": _number_text(value("face_load"), ".3f"),
            "fatigue\ndamage": _number_text(value("contact_damage"), ".3g"),
            "S_H": _number_text(value("contact_safety"), ".2f"),
            "S_H\nISO": _number_text(value("standard_contact_safety"), ".2f"),
            "S_H\nstat.": _number_text(value("contact_static"), ".2f"),
        }
        for label, value in _entries(data, "flank")
    ]


def _root_rows(data: xr.Dataset) -> list[dict[str, str]]:
    return [
        {
            "gear, flank, mesh": _with_holder(data, label, "root"),
            "sigma_F\nMPa": _number_text(1e-6 * value("root_stress"), ".0f"),
            "nominal\nMPa": _number_text(1e-6 * value("nominal_root"), ".0f"),
            "minimum\nMPa": _number_text(1e-6 * value("compression"), ".0f"),
            "fatigue\ndamage": _number_text(value("root_damage"), ".3g"),
            "S_F": _number_text(value("root_safety"), ".2f"),
            "S_F\nISO": _number_text(value("standard_root_safety"), ".2f"),
            "S_F\nstat.": _number_text(value("root_static"), ".2f"),
        }
        for label, value in _entries(data, "flank")
    ]


def _bearing_rows(data: xr.Dataset) -> list[dict[str, str]]:
    return [
        {
            "bearing": label,
            "largest\nkN": _number_text(1e-3 * value("largest_load"), ".4g"),
            "equiv.\nkN": _number_text(1e-3 * value("equivalent"), ".4g"),
            "L10\nh": _number_text(value("basic_hours"), ".3g"),
            "L10r\nh": _number_text(value("reference_hours"), ".3g"),
            "L10m\nh": _number_text(value("modified_hours"), ".3g"),
            "kappa": _number_text(value("viscosity_ratio"), ".2g"),
            "stress\nMPa": _number_text(1e-6 * value("pressure"), ".0f"),
            "S_0": _number_text(value("static_safety"), ".2f"),
        }
        for label, value in _entries(data, "bearing")
    ]


def _entries(data: xr.Dataset, name: str) -> Iterator[tuple[str, Callable[[str], float]]]:
    """Yield the label of each part, and a function that returns its results by key."""
    for place, label in enumerate(data[name].to_numpy().tolist()):
        yield label, partial(_figure, data, name, place)


def _with_holder(data: xr.Dataset, label: str, kind: str) -> str:
    """Label of a flank, with the number of the planet if there are several."""
    holder = str(data[f"flank_{kind}_holder"].sel(flank=label).item())
    if holder:
        return f"{label} ({holder})"
    return label


def _figure(data: xr.Dataset, name: str, place: int, key: str) -> float:
    return float(data[f"{name}_{key}"][place])


def _number_text(value: float, form: str) -> str:
    if math.isnan(value):
        return ""
    if math.isinf(value):
        return "inf."
    return format(value, form)
