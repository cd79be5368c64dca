"""Load ratings that makers print for a designation, and how far estimates may lie above printed ones.

`makers.csv` has the least of what the catalogues of SKF, NKE and NSK print for open bearings of today's design with
these boundary dimensions (text of the catalogues in the public repository ArtemFilin1990/Mar, commit 7b871a5):
cylindrical roller bearings with E of that design, without E the older ones where they are printed; angular contact ball
bearings of 40 degrees (B). Where two makers agree within a tenth and the third does not within a fifth, it was read
wrong and is left out.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from exugear.gearbox.sections.connections import BearingType, CatalogueSection

WITHIN = 0.005
"""Part by which dimensions may differ from those of the designation."""
MARGINS: Mapping[BearingType, tuple[float, float]] = {
    "deep_groove_ball": (1.23, 1.24),
    "angular_contact_ball": (1.11, 1.12),
    "self_aligning_ball": (1.51, 1.35),
    "four_point_ball": (1.00, 1.00),
    "cylindrical_roller": (1.94, 2.11),
    "needle_roller": (1.27, 1.27),
    "tapered_roller": (1.27, 1.22),
    "spherical_roller": (1.17, 1.22),
    "thrust_spherical_roller": (1.27, 1.27),
}
"""Largest ratio of estimated to printed dynamic and static rating, by which estimates are divided.

Of all bearings in `makers.csv`, cylindrical roller bearings of older design among them; and of four-point ball
bearings, whose estimates count the balls once and reach 0.73 of what is printed. Needle rollers and thrust bearings
have the largest static ratio of full complement rollers.
"""
FULL_COMPLEMENT_MARGIN = 1.27
"""The same of cylindrical rollers without a cage (static ratings, see `system.bearings.rolling.proportions`)."""
_LISTED = re.compile(r"(NUP|NU|NJ|N)?\s?(\d{3,5})(?!\d)[\s-]?([A-Z0-9-]*)")
_SEALED = re.compile(r"2?RS|LL|DDU|VV|UU")


@dataclass(frozen=True)
class KnownRating:
    """Dynamic and static rating of one bearing, N, and whose catalogues they are the least of."""

    dynamic: float
    static: float
    makers: tuple[str, ...]


def known_rating(section: CatalogueSection) -> KnownRating | None:
    """Ratings of a single bearing by its designation; None where it is not listed, or has other dimensions.

    Examples
    --------
    >>> section = CatalogueSection(
    ...     designation="22320 E", type="spherical_roller", bore_mm=100.0, outer_diameter_mm=215.0, width_mm=73.0
    ... )
    >>> known_rating(section)
    KnownRating(dynamic=682000.0, static=842000.0, makers=('NKE', 'NSK', 'SKF'))
    """
    if section.row_count is not None or section.full_complement:
        return None
    rows = (_listed().get((section.type, number)) for number in _listed_as(section))
    row = next((one for one in rows if one is not None), None)
    if row is None:
        return None
    sizes = zip(("bore_mm", "outer_diameter_mm", "width_mm"), row[:3], strict=True)
    if any(abs(getattr(section, key) / size - 1.0) > WITHIN for key, size in sizes):
        return None
    return KnownRating(row[3], row[4], row[5])


def margins(section: CatalogueSection) -> tuple[float, float]:
    """Divisors of estimated dynamic and static ratings, see `MARGINS`."""
    if section.type == "cylindrical_roller" and section.full_complement:
        return FULL_COMPLEMENT_MARGIN, FULL_COMPLEMENT_MARGIN
    return MARGINS[section.type]


def _listed_as(section: CatalogueSection) -> tuple[str, ...]:
    """Designations of the table that may be meant; none for other designs, and for seals that leave less room inside.

    A cylindrical roller bearing without E is of the older design where a maker still prints that one.
    """
    match = _LISTED.match((section.designation or "").strip().upper())
    if match is None:
        return ()
    prefix, number, suffix = match.groups()
    if section.type == "cylindrical_roller":
        if prefix is None:
            return ()
        if suffix.startswith("E"):
            return (f"NU{number}E",)
        return (f"NU{number}", f"NU{number}E")
    if prefix is not None:
        return ()
    if section.type == "angular_contact_ball":
        if suffix.startswith("B"):
            return (f"{number}B",)
        return ()
    if section.type == "self_aligning_ball" and _SEALED.search(suffix):
        return ()
    return (number,)


@cache
def _listed() -> dict[tuple[str, str], tuple[float, float, float, float, float, tuple[str, ...]]]:
    """Bore, outer diameter and width (mm), dynamic and static rating (N) and makers, by type and designation."""
    found = {}
    with (Path(__file__).parent / "makers.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            bore, outer, width = (float(row[key]) for key in ("bore_mm", "outer_diameter_mm", "width_mm"))
            dynamic = 1e3 * float(row["dynamic_kN"])
            static = 1e3 * float(row["static_kN"])
            makers = tuple(row["makers"].split("/"))
            found[row["type"], row["designation"]] = bore, outer, width, dynamic, static, makers
    return found
