"""Margins of a rating: safety factors, bearing life and load on tip edges, each next to its requirement."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.sections.loads import RatingSection
from exugear.life.life import LEAST_OUTSIDE

if TYPE_CHECKING:
    import xarray as xr

TIP_EDGE = "load on tip edges"
"""Name of the largest fraction of load outside the path of contact."""
PITTING = "S_H"
CONTACT_SAFETIES = ("contact_safety", "contact_static")
SAME = 0.005
"""Relative change of a margin up to which it counts as unchanged."""


@dataclass(frozen=True)
class Margin:
    """Least favourable value of a rating over all parts."""

    value: float
    required: float
    """Smallest permitted value, or the largest one."""
    part: str
    """Part that has it."""
    unit: str = ""
    is_largest: bool = False
    """Whether `required` is the largest permitted value."""

    @property
    def fails(self) -> bool:
        """Whether the requirement is not met."""
        return self.value > self.required if self.is_largest else self.value < self.required


def margins_of(data: xr.Dataset, rating: RatingSection) -> dict[str, Margin]:
    """Return the margins of a rating by their name.

    Parameters
    ----------
    data : as `exugear.life.life_file.read_life` returns it
    rating : with the required safety factors; the required life is that of the load spectrum
    """
    hours = float(data["hours"].sum())
    found = {
        PITTING: _smallest(data, "flank", CONTACT_SAFETIES, rating.minimum_S_H),
        "S_F": _smallest(data, "flank", ("root_safety", "root_static"), rating.minimum_S_F),
        "shortest bearing life": _smallest(
            data, "bearing", ("basic_hours", "reference_hours", "modified_hours"), hours, "h"
        ),
        "S_0": _smallest(data, "bearing", ("static_safety",), rating.minimum_S_0),
    }
    outside = 100.0 * data["flank_outside"].to_numpy()
    if np.isfinite(outside).any():
        part = str(data["flank"].to_numpy()[int(np.nanargmax(outside))])
        found[TIP_EDGE] = Margin(float(np.nanmax(outside)), 100.0 * LEAST_OUTSIDE, part, "%", is_largest=True)
    return {name: margin for name, margin in found.items() if margin is not None}


def _smallest(data: xr.Dataset, kind: str, names: tuple[str, ...], required: float, unit: str = "") -> Margin | None:
    values = np.array([data[f"{kind}_{name}"].to_numpy() for name in names], dtype=np.float64)
    if not np.isfinite(values).any():
        return None
    _, part = np.unravel_index(int(np.nanargmin(values)), values.shape)
    return Margin(float(np.nanmin(values)), required, str(data[kind].to_numpy()[part]), unit)


def families_short_of_pitting(data: xr.Dataset, rating: RatingSection) -> frozenset[str]:
    """Return the families of meshes with a flank whose safety against pitting is below the required one."""
    safety = np.fmin.reduce([data[f"flank_{name}"].to_numpy() for name in CONTACT_SAFETIES])
    short = data["flank"].to_numpy()[safety < rating.minimum_S_H]
    return frozenset(str(flank).rpartition(" ")[2] for flank in short)


def shortfalls_of(data: xr.Dataset) -> list[str]:
    """Return the parts of a rating that fail or fall short of a requirement, as sentences."""
    return [line for key in ("failures", "shortfalls") for line in json.loads(data.attrs[key])]


def failing(before: Mapping[str, Margin], after: Mapping[str, Margin]) -> list[str]:
    """Return the margins that fail and are new or worse than before, as text.

    Examples
    --------
    >>> known = {"S_H": Margin(0.9, 1.0, "pinion")}
    >>> failing(known, known), failing(known, {"S_H": Margin(0.8, 1.0, "pinion")})
    ([], ['pinion: S_H 0.8'])
    """
    found = []
    for name, margin in after.items():
        old = before.get(name)
        sign = -1.0 if margin.is_largest else 1.0
        worse = old is None or not old.fails or sign * (margin.value - old.value) < -SAME * abs(old.value)
        if margin.fails and worse:
            unit = f" {margin.unit}" if margin.unit else ""
            found.append(f"{margin.part}: {name} {margin.value:{',.0f' if margin.unit == 'h' else '.3g'}}{unit}")
    return found


def margins_in_words(before: Mapping[str, Margin], after: Mapping[str, Margin]) -> str:
    """Describe how margins change, each next to its requirement; unchanged ones are omitted.

    Examples
    --------
    >>> margins_in_words({"S_H": Margin(0.971, 1.0, "pinion")}, {"S_H": Margin(0.891, 1.0, "pinion")})
    'S_H 0.971 to 0.891 (1 required)'
    """
    changes = []
    for name, margin in after.items():
        old = before.get(name)
        if old is None or abs(margin.value - old.value) <= SAME * abs(old.value) or old.value == margin.value:
            continue
        unit = f" {margin.unit}" if margin.unit else ""
        form = ",.0f" if margin.unit == "h" else ".3g"
        kind = "at most" if margin.is_largest else "required"
        changes.append(f"{name} {old.value:{form}} to {margin.value:{form}}{unit} ({margin.required:{form}} {kind})")
    return "; ".join(changes)


def raised_in_words(before: Mapping[str, Margin], after: Mapping[str, Margin], name: str) -> str:
    """Describe how a margin rises; empty if it does not, or is unknown.

    Examples
    --------
    >>> low, high = {"S_H": Margin(0.77, 1.0, "pinion")}, {"S_H": Margin(0.97, 1.0, "pinion")}
    >>> raised_in_words(low, high, "S_H"), raised_in_words(high, low, "S_H")
    ('S_H 0.77 to 0.97 (1 required)', '')
    """
    if name not in before or name not in after or after[name].value <= before[name].value:
        return ""
    return margins_in_words({name: before[name]}, {name: after[name]})
