"""File of a rating: netCDF with the hash of its input and a checksum, and CSV tables in the same folder."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.choice import Choice, choice_of
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.versions import LIFE
from exugear.life.bearing_life import BearingLife
from exugear.life.gear_life import FlankLife
from exugear.life.life import Life, checked_loads, life_hash
from exugear.life.static_balance import life_requests
from exugear.results.folder import modes_path
from exugear.system.statics import BalanceError
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Floats
from fe_ste.tools.drawing import COLOURS, WARNING_COLOUR, drawing_style, finish_figure, new_figure
from fe_ste.tools.files import FileError, write_table
from fe_ste.tools.stores import Layout, Store, load_dataset, write_dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

FLANK_UNITS = dict.fromkeys(
    (
        *("contact_stress", "root_stress", "compression", "nominal_contact", "nominal_root"),
        *("contact_worn", "root_worn", "contact_limit", "root_limit"),
    ),
    "Pa",
)
FLANK_WORDS = ("contact_holder", "root_holder")
INFINITE = "infinite"
"""Text in JSON for infinite numbers: an infinite damage or life."""
DAMAGES = {
    "pitting": ("flank", "contact_damage", "contact_by_bin"),
    "root": ("flank", "root_damage", "root_by_bin"),
    "L10": ("bearing", "damage", "by_bin"),
    "L10r": ("bearing", "reference_damage", "reference_by_bin"),
    "L10m": ("bearing", "modified_damage", "modified_by_bin"),
}
"""Dimension, value and value by bin of each kind of damage."""
LISTS = ("assumptions", "unrated", "failures", "shortfalls", "reliefs")
"""Lists of sentences of a rating."""
BEARING_UNITS = {"largest_load": "N", "equivalent": "N", "basic_hours": "h", "reference_hours": "h", "pressure": "Pa"}
BEARING_UNITS |= {"modified_hours": "h", "minimum_load": "N"}
FLANK_NUMBERS = tuple(field.name for field in fields(FlankLife) if field.type in (float, "float"))
BEARING_NUMBERS = tuple(field.name for field in fields(BearingLife) if field.type in (float, "float"))
_LAYOUT = Layout(
    "life",
    LIFE,
    {f"flank_{name}": ("flank",) for name in FLANK_NUMBERS}
    | {f"bearing_{name}": ("bearing",) for name in (*BEARING_NUMBERS, "dynamic_rating", "static_rating")}
    | dict.fromkeys(("torque", "hours", "revolutions", "speed"), ("bin",))
    | {"flank": ("flank",), "bearing": ("bearing",)}
    | {f"flank_{name}": ("flank",) for name in FLANK_WORDS}
    | {f"{name}_{by_bin}": (name, "bin") for name, _, by_bin in DAMAGES.values()},
    ("gearbox", "variant", "mesh_model", "inertias", "edition", "input_hash", *LISTS),
)


def life_path(folder: Path, choice: Choice) -> Path:
    """Return the path of the rating for model settings with an inertia set: in the folder of its modes."""
    return modes_path(folder, choice).with_name("life.nc")


def to_dataset(life: Life, gearbox: str) -> xr.Dataset:
    """Return labelled arrays with units, as `write_life` writes them."""
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
    none = {"units": "1", "long_name": "fractions of the damage by torque bin"}
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
        "flank": np.array([f"{flank.gear} {flank.flank} {flank.family}" for flank in life.flanks], dtype=object),
        "bearing": np.array([bearing.name for bearing in life.bearings], dtype=object),
        "family": np.array([*life.load_sharing], dtype=object),
    }
    attributes = {
        "gearbox": gearbox,
        "variant": life.variant,
        "mesh_model": life.mesh_model,
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


def stored_life(path: Path, input_hash: str) -> xr.Dataset | None:
    """Return a stored rating that was computed from exactly this input; None without one."""
    return Store(path, input_hash).read_dataset(_LAYOUT)


def read_life(path: Path) -> xr.Dataset:
    """Read a rating from a file.

    Raises
    ------
    FileError
        The file is missing, damaged, or of another version.
    """
    return load_dataset(path, _LAYOUT)


def write_life(path: Path, life: Life, gearbox: str) -> xr.Dataset:
    """Write a rating and CSV tables of its flanks and bearings as atomic operations; return its arrays."""
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
    """Return the damages of all parts of a stored rating, largest first: part, kind, Miner's sum (may be infinite)."""
    found = []
    for kind, (name, key, _) in DAMAGES.items():
        values = dataset[f"{name}_{key}"].to_numpy().tolist()
        found += [(part, kind, value) for part, value in zip(dataset[name].to_numpy().tolist(), values, strict=True)]
    return sorted((row for row in found if not math.isnan(row[2])), key=lambda row: -row[2])


def summary(dataset: xr.Dataset) -> dict[str, Any]:
    """Return the values for JSON: NaN is omitted, infinite values are `INFINITE`."""
    return {
        "failures": json.loads(dataset.attrs["failures"]),
        "shortfalls": json.loads(dataset.attrs["shortfalls"]),
        **{key: str(dataset.attrs[key]) for key in ("variant", "mesh_model", "edition", "input_hash")},
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
    return INFINITE if math.isinf(value) else value


def _entries(dataset: xr.Dataset, name: str, numbers: Sequence[str]) -> Iterator[Mapping[str, Any]]:
    for label, *values in _rows(dataset, name, numbers):
        given = zip(numbers, map(float, values), strict=True)
        words = FLANK_WORDS if name == "flank" else ()
        told = {key: str(dataset[f"{name}_{key}"].sel({name: label}).item()) for key in words}
        yield {name: label, **told, **{key: _number(value) for key, value in given if not math.isnan(value)}}


@dataclass(frozen=True)
class StoredLife:
    """File of a rating."""

    path: Path
    data: xr.Dataset | None
    """Content; None if it does not belong to the gearbox file."""
    reason: str = ""


def stored_lives(gearbox: Gearbox, folder: Path, assembled: Callable[[Choice], Assembly]) -> Iterator[StoredLife]:
    """Read all ratings of a folder."""
    for path in sorted(folder.glob("*/*/life.nc")):
        try:
            data = read_life(path)
            assembly = assembled(choice_of(data.attrs))
            counted = checked_loads(gearbox)
            digest = life_hash(assembly, counted, life_requests(assembly, counted, folder), folder)
        except (FileError, GearboxFileError, BalanceError, KeyError) as error:
            yield StoredLife(path, None, str(error))
            continue
        fits = data.attrs["input_hash"] == digest
        yield StoredLife(path, data if fits else None, "" if fits else "was computed from another input")


# Pictures of a rating: limiting parts, and damage by torque

SHOWN = 16
"""Maximum number of drawn parts."""
LEAST_DAMAGE = 1e-6
"""Smaller damages are not drawn."""
LARGEST_DAMAGE = 1e6
"""Damage at which bars are truncated, including infinite damages."""


def draw_life(data: xr.Dataset, path: str | Path | None = None) -> Figure:
    """Draw the damages of the limiting parts of a stored life, and their distribution over torque."""
    shown = [limit for limit in limits(data) if limit[2] > LEAST_DAMAGE][:SHOWN]
    with drawing_style():
        figure = new_figure(8.5, max(2.2, 0.8 + 0.24 * len(shown)))
        bars, matrix = figure.subplots(1, 2, sharey=True, width_ratios=(1.0, 1.3))
        names = [f"{part}, {kind}" + (": infinite" if np.isinf(damage) else "") for part, kind, damage in shown]
        values = [min(damage, LARGEST_DAMAGE) for _, _, damage in shown]
        colours = [COLOURS[list(DAMAGES).index(kind)] for _, kind, _ in shown]
        bars.barh(range(len(shown)), values, color=colours)
        bars.axvline(1.0, color=WARNING_COLOUR)
        bars.set(
            xscale="log",
            xlabel=("fatigue damage in the life (1: failure)"),
            yticks=range(len(shown)),
            yticklabels=names,
        )
        bars.xaxis.set_major_formatter("{x:g}")
        bars.set_title("what limits")
        bars.invert_yaxis()
        if not shown:
            bars.set_title(f"no damage above {LEAST_DAMAGE:g}")
        edges, shares = damage_matrix(data, shown)
        if shares.size:
            drawn = matrix.pcolormesh(1e-3 * edges, np.arange(len(shown) + 1) - 0.5, 100.0 * shares, cmap="viridis")
            figure.colorbar(drawn, ax=matrix, label="fraction of the part's damage / %")
        matrix.set(xlabel=f"torque on {data.attrs['body']} / kN m", title="damage by torque")
        matrix.grid(False)
        return finish_figure(figure, path)


def damage_matrix(data: xr.Dataset, parts: list[tuple[str, str, float]]) -> tuple[Floats, Floats]:
    """Return the edges of the bins (bins + 1,), N m, and the fraction of each bin in each part's damage (parts, bins).

    Parameters
    ----------
    parts : (part, kind, damage) as `exugear.life.life_file.limits` returns them
    """
    torque = data["torque"].to_numpy()
    order = np.argsort(torque)
    rows = []
    for part, kind, damage in parts:
        name, _, by_bin = DAMAGES[kind]
        index = data[name].to_numpy().tolist().index(part)
        values = data[f"{name}_{by_bin}"].to_numpy()[index][order]
        endless = np.isinf(values)
        rows.append(endless / endless.sum() if endless.any() else values / damage)
    middles = 0.5 * (torque[order][1:] + torque[order][:-1])
    ends = torque[order][[0, -1]]
    return np.concatenate([ends[:1], middles, ends[1:]]), np.array(rows).reshape(len(parts), len(torque))
