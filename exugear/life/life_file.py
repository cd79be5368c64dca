"""The file of a life: sealed netCDF with the hash of its input, and tables with commas beside it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.versions import LIFE
from exugear.life.bearing_life import BearingLife
from exugear.life.gear_life import FlankLife
from exugear.life.life import Life
from exugear.life.load_spectrum.spectra_files import write_table
from exugear.results.folder import modes_path
from fe_ste.tools.sealed import Layout, load_dataset, write_dataset
from fe_ste.tools.stores.store import Store

if TYPE_CHECKING:
    import xarray as xr

FLANK_UNITS = dict.fromkeys(
    (
        *("contact_stress", "root_stress", "compression", "nominal_contact", "nominal_root"),
        *("contact_worn", "root_worn", "contact_limit", "root_limit"),
    ),
    "Pa",
)
FLANK_WORDS = ("contact_holder", "root_holder")
INFINITE = "infinite"
"""For programs in place of a number, where JSON has none: a damage without end, or a life that nothing ends."""
DAMAGES = {
    "pitting": ("flank", "contact_damage", "contact_by_bin"),
    "root": ("flank", "root_damage", "root_by_bin"),
    "L10": ("bearing", "damage", "by_bin"),
    "L10r": ("bearing", "reference_damage", "reference_by_bin"),
}
"""Dimension, figure and figure by bin of each kind of damage."""
LISTS = ("assumptions", "unrated", "failures", "shortfalls", "reliefs")
"""What a life says in words, lists of sentences."""
BEARING_UNITS = {"largest_load": "N", "equivalent": "N", "basic_hours": "h", "reference_hours": "h", "pressure": "Pa"}
BEARING_UNITS |= {"modified_hours": "h", "minimum_load": "N"}
FLANK_NUMBERS = tuple(one.name for one in fields(FlankLife) if one.type in (float, "float"))
BEARING_NUMBERS = tuple(one.name for one in fields(BearingLife) if one.type in (float, "float"))
_LAYOUT = Layout(
    "life",
    LIFE,
    {f"flank_{name}": ("flank",) for name in FLANK_NUMBERS}
    | {f"bearing_{name}": ("bearing",) for name in (*BEARING_NUMBERS, "dynamic_rating", "static_rating")}
    | dict.fromkeys(("torque", "hours", "revolutions", "speed"), ("bin",))
    | {"flank": ("flank",), "bearing": ("bearing",)}
    | {f"flank_{name}": ("flank",) for name in FLANK_WORDS}
    | {f"{name}_{by_bin}": (name, "bin") for name, _, by_bin in DAMAGES.values()},
    ("gearbox", "variant", "mesh_law", "inertias", "edition", "input_hash", *LISTS),
)


def life_path(folder: Path, choice: Choice) -> Path:
    """Place of the life of a choice that names its inertia set: beside its modes."""
    return modes_path(folder, choice).with_name("life.nc")


def to_dataset(life: Life, gearbox: str) -> xr.Dataset:
    """Labelled arrays with units, what `write_life` writes."""
    import xarray as xr

    distribution = life.counted.distribution
    variables: dict[str, tuple[tuple[str, ...], Any, dict[str, str]]] = {
        "torque": (("bin",), distribution.torques(life.counted.bin_value), {"units": "N m"}),
        "hours": (("bin",), distribution.hours, {"units": "h"}),
        "revolutions": (("bin",), distribution.revolutions, {"units": "1"}),
        "speed": (("bin",), distribution.speed, {"units": "rad/s"}),
        "load_sharing": (("family",), np.array([*life.load_sharing.values()]), {"units": "1"}),
    }
    for name in FLANK_NUMBERS:
        values = np.array([getattr(flank, name) for flank in life.flanks], dtype=np.float64)
        variables[f"flank_{name}"] = (("flank",), values, {"units": FLANK_UNITS.get(name, "1")})
    for name in BEARING_NUMBERS:
        values = np.array([getattr(bearing, name) for bearing in life.bearings], dtype=np.float64)
        variables[f"bearing_{name}"] = (("bearing",), values, {"units": BEARING_UNITS.get(name, "1")})
    count = len(distribution.hours)
    none = {"units": "1", "long_name": "parts of the damage by bin of torque"}
    parts = {"flank": life.flanks, "bearing": life.bearings}
    for name, _, by_bin in DAMAGES.values():
        values = np.array([getattr(part, by_bin) for part in parts[name]], dtype=np.float64).reshape(-1, count)
        variables[f"{name}_{by_bin}"] = ((name, "bin"), values, none)
    for name in FLANK_WORDS:
        words = np.array([getattr(flank, name) for flank in life.flanks], dtype=object)
        variables[f"flank_{name}"] = (("flank",), words, {})
    for name in ("dynamic", "static"):
        values = np.array([getattr(bearing.ratings, name) for bearing in life.bearings], dtype=np.float64)
        variables[f"bearing_{name}_rating"] = (("bearing",), values, {"units": "N"})
    coordinates = {
        "flank": np.array([flank_label(flank) for flank in life.flanks], dtype=object),
        "bearing": np.array([bearing.name for bearing in life.bearings], dtype=object),
        "family": np.array([*life.load_sharing], dtype=object),
    }
    attributes = {
        "gearbox": gearbox,
        "variant": life.variant,
        "mesh_law": life.mesh_law,
        "inertias": life.inertias,
        "edition": life.edition,
        "body": life.counted.body,
        "life_years": life.counted.life_years,
        "sources": json.dumps(life.counted.source_rows()),
        **{name: json.dumps(getattr(life, name)) for name in LISTS},
        "bearing_remarks": json.dumps({bearing.name: bearing.remarks for bearing in life.bearings if bearing.remarks}),
        "input_hash": life.input_hash,
        "method_version": LIFE,
    }
    return xr.Dataset(variables, coordinates, attributes)


def flank_label(life: FlankLife) -> str:
    """Gear, flank and family of meshes in one text."""
    return f"{life.gear} {life.flank} {life.family}"


def stored_life(path: Path, input_hash: str) -> xr.Dataset | None:
    """Life of a file that was computed from exactly this input; None without one."""
    return Store(path, input_hash).read_dataset(_LAYOUT)


def read_life(path: Path) -> xr.Dataset:
    """Life of a file.

    Raises
    ------
    FileError
        It is missing, damaged, or of another version.
    """
    return load_dataset(path, _LAYOUT)


def write_life(path: Path, life: Life, gearbox: str) -> xr.Dataset:
    """Write a life whole or not at all, with tables of its flanks and bearings beside it; return its arrays."""
    dataset = to_dataset(life, gearbox)
    write_table(path.with_name("life_gears.csv"), ("flank", *FLANK_NUMBERS), _rows(dataset, "flank", FLANK_NUMBERS))
    write_table(
        path.with_name("life_bearings.csv"), ("bearing", *BEARING_NUMBERS), _rows(dataset, "bearing", BEARING_NUMBERS)
    )
    write_dataset(path, dataset)
    return dataset


def _rows(dataset: xr.Dataset, name: str, numbers: Sequence[str]) -> Iterator[list[str | float]]:
    for place, label in enumerate(dataset[name].to_numpy().tolist()):
        yield [label, *(float(dataset[f"{name}_{number}"][place]) for number in numbers)]


def limits(dataset: xr.Dataset) -> list[tuple[str, str, float]]:
    """Damages of all parts of a stored life, largest first: part, kind, Miner's sum, which may be infinite."""
    found = []
    for kind, (name, key, _) in DAMAGES.items():
        values = dataset[f"{name}_{key}"].to_numpy().tolist()
        found += [(part, kind, value) for part, value in zip(dataset[name].to_numpy().tolist(), values, strict=True)]
    return sorted((one for one in found if not math.isnan(one[2])), key=lambda one: -one[2])


def summary(dataset: xr.Dataset) -> dict[str, Any]:
    """Figures for programs: numbers that are none are left out, those without end are `INFINITE`."""
    return {
        "failures": json.loads(dataset.attrs["failures"]),
        "shortfalls": json.loads(dataset.attrs["shortfalls"]),
        **{key: str(dataset.attrs[key]) for key in ("variant", "mesh_law", "edition", "input_hash")},
        "flanks": [*_entries(dataset, "flank", FLANK_NUMBERS)],
        "bearings": [*_entries(dataset, "bearing", BEARING_NUMBERS)],
        "load_sharing": dict(
            zip(dataset["family"].to_numpy().tolist(), dataset["load_sharing"].to_numpy().tolist(), strict=True)
        ),
        "limits": [
            {"part": part, "by": kind, "damage": _number(damage)} for part, kind, damage in limits(dataset)[:10]
        ],
        **{name: json.loads(dataset.attrs[name]) for name in ("assumptions", "unrated", "reliefs")},
        "remarks": json.loads(dataset.attrs["bearing_remarks"]),
    }


def _number(value: float) -> float | str:
    if math.isinf(value):
        return INFINITE
    return value


def _entries(dataset: xr.Dataset, name: str, numbers: Sequence[str]) -> Iterator[Mapping[str, Any]]:
    for label, *values in _rows(dataset, name, numbers):
        given = zip(numbers, map(float, values), strict=True)
        words = FLANK_WORDS if name == "flank" else ()
        told = {key: str(dataset[f"{name}_{key}"].sel({name: label}).item()) for key in words}
        yield {name: label, **told, **{key: _number(value) for key, value in given if not math.isnan(value)}}
