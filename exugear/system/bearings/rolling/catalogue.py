"""Rows of rolling elements from a catalogue section, with estimates of missing dimensions.

A catalogue lists the boundary dimensions. Internal dimensions missing in the file follow from the usual proportions of
the type (`exugear.system.bearings.rolling.dimensions`), and are reported as estimates with their range.

`makers.csv` contains the minimum of the catalogue values of SKF, NKE and NSK for open bearings of current design with
these boundary dimensions (text of the catalogues in the public repository ArtemFilin1990/Mar, commit 7b871a5):
cylindrical roller bearings with E of that design, without E the older ones where they are listed; angular contact ball
bearings of 40 degrees (B). If two manufacturers agree within a tenth and the third deviates by more than a fifth, the
third value was misread and is omitted.
"""

from __future__ import annotations

import csv
import difflib
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from exugear.gearbox.sections.connections import (
    CONTACT_ANGLES_DEG,
    ROUNDING_MM,
    TYPES_OF_KEYS,
    BearingType,
    CatalogueSection,
)
from exugear.gearbox.units import KN, MM, UM, si
from exugear.system.bearings.rolling import dimensions
from exugear.system.bearings.rolling.rows import BallRow, BearingError, RollerRow, RollingRow, moved, pair_rows, rib_row

ALIGNING = ("spherical_roller", "self_aligning_ball")
"""Types whose outer raceway is a sphere about the middle of the bearing."""
SPHERES = (*ALIGNING, "thrust_spherical_roller")
"""Types whose outer raceway is a sphere about a point of the axis."""
EXPANSION = 11e-6
"""Coefficient of thermal expansion of bearing steel, 1/K, as catalogues use it for clearances."""


@dataclass(frozen=True)
class Estimate:
    """What the file leaves open of a bearing."""

    key: str
    """Name of the key in the file that would give it."""
    value: float
    low: float
    high: float
    """Value used, and its usual range."""
    unit: str
    """Unit of the three, as the key has it; empty for numbers."""


def catalogue_rows(section: CatalogueSection) -> tuple[RollingRow, ...]:
    """Rows of the bearing, or of the pair, that a section describes.

    Parameters
    ----------
    section : bearing section of the gearbox file

    Returns
    -------
    in the frame of the bearing, with z along the global one; from -z to +z

    Raises
    ------
    exugear.system.bearings.rolling.rows.BearingError
        The elements do not fit into the bearing.

    Notes
    -----
    A four-point ball bearing is two rows of the same balls about one centre, with contact angles of both signs: each
    diagonal of a ball is a line of contact by itself. This neglects that the diagonals share the ball's equilibrium
    when their angles differ under load, and the gap between the halves of the groove under radial load.

    Examples
    --------
    >>> section = CatalogueSection(type="spherical_roller", bore_mm=85.0, outer_diameter_mm=180.0, width_mm=60.0)
    >>> [(row.element_count, round(math.degrees(row.contact_angle))) for row in catalogue_rows(section)]
    [(14, -13), (14, 13)]
    """
    return _rows_of(section, frozenset(section.model_fields_set))


@lru_cache(maxsize=128)
def _rows_of(section: CatalogueSection, stated: frozenset[str]) -> tuple[RollingRow, ...]:
    """Rows of a section; equal sections differ by the keys that the file states, which are no estimates."""
    full = section
    for estimate in estimates(section):
        full = with_estimate(full, estimate, estimate.value)
    row = _ball_row(full) if full.type.endswith("ball") else _roller_row(full)
    rows = _placed(full, row)
    if full.ribs != "none" and isinstance(row, RollerRow):
        # Ribs of cylindrical rollers are rows of their own, first those that hold the inner ring against +z.
        length = si(full, "rib_contact_mm")
        senses = {"+z": (1,), "-z": (-1,), "both": (1, -1)}[full.ribs]
        rows += tuple(rib_row(row, sense, length) for sense in senses)
    return rows


def estimates(section: CatalogueSection) -> tuple[Estimate, ...]:
    """Return the values that `catalogue_rows` uses for the missing keys of a section.

    An estimate follows from the section and from preceding estimates: for example, the number of rollers from their
    diameter.

    Examples
    --------
    >>> section = CatalogueSection(type="cylindrical_roller", bore_mm=160.0, outer_diameter_mm=290.0, width_mm=80.0)
    >>> [(estimate.key, round(estimate.value, 2)) for estimate in estimates(section)][1:4]
    [('element_diameter_mm', 35.1), ('element_count', 17.0), ('element_length_mm', 51.2)]
    """
    found = []
    for estimated in _ESTIMATED.values():
        estimate = estimated(section)
        if estimate is not None and _is_open(section, estimate.key):
            found.append(estimate)
            section = with_estimate(section, estimate, estimate.value)
    return tuple(found)


def with_estimate(section: CatalogueSection, estimate: Estimate, value: float) -> CatalogueSection:
    """Give the section as if the file stated a value for what it leaves open.

    Parameters
    ----------
    estimate : one of the section's
    value : in the unit of the estimate; counts are rounded

    Examples
    --------
    >>> section = CatalogueSection(type="cylindrical_roller", bore_mm=160.0, outer_diameter_mm=290.0, width_mm=80.0)
    >>> diameter = next(each for each in estimates(section) if each.key == "element_diameter_mm")
    >>> ends = [with_estimate(section, diameter, end) for end in (diameter.low, diameter.high)]
    >>> [catalogue_rows(end)[0].element_count for end in ends]
    [19, 16]
    """
    given: float | int = round(value) if estimate.key == "element_count" else value
    return section.model_copy(update={estimate.key: given})


def _is_open(section: CatalogueSection, key: str) -> bool:
    if key in TYPES_OF_KEYS and section.type not in TYPES_OF_KEYS[key][0]:
        return False
    return getattr(section, key) is None or key not in section.model_fields_set


# -- estimates, in the order in which they rest on each other -----------------------------------------------------


def row_count(section: CatalogueSection) -> int:
    """Rows in one bearing."""
    return section.row_count or (2 if section.type in ALIGNING else 1)


def _scaled(key: str, proportion: dimensions.Proportion, scale: float, unit: str) -> Estimate:
    return Estimate(key, proportion.value * scale, proportion.low * scale, proportion.high * scale, unit)


def _pitch_diameter(section: CatalogueSection) -> Estimate:
    mean = 0.5 * (section.bore_mm + section.outer_diameter_mm)
    height = section.outer_diameter_mm - section.bore_mm
    beyond = dimensions.PITCH_BEYOND_MEAN
    value, low, high = (mean + share * height for share in (beyond.value, beyond.low, beyond.high))
    return Estimate("pitch_diameter_mm", value, low, high, "mm")


def _contact_angle(section: CatalogueSection) -> Estimate | None:
    if section.type not in CONTACT_ANGLES_DEG or (section.type in ALIGNING and row_count(section) == 1):
        return None
    if section.type in dimensions.CONTACT_ANGLE_DEG:
        return _scaled("contact_angle_deg", dimensions.CONTACT_ANGLE_DEG[section.type], 1.0, "deg")
    distance = dimensions.ALIGNING_ROW_DISTANCE[section.type]
    pitch = _given(section, "pitch_diameter_mm")
    value, low, high = (
        math.degrees(math.atan(share * section.width_mm / pitch))
        for share in (distance.value, distance.low, distance.high)
    )
    return Estimate("contact_angle_deg", value, low, high, "deg")


def _element_diameter(section: CatalogueSection) -> Estimate:
    height = section.outer_diameter_mm - section.bore_mm
    estimate = _scaled("element_diameter_mm", dimensions.PROPORTIONS[section.type].diameter, height, "mm")
    if section.element_count is None:
        return estimate
    # As many as the file says have to fit.
    most = _given(section, "pitch_diameter_mm") * math.sin(math.pi / section.element_count) / 1.005
    value, low, high = (min(length, most) for length in (estimate.value, estimate.low, estimate.high))
    return Estimate(estimate.key, value, low, high, estimate.unit)


def _element_count(section: CatalogueSection) -> Estimate:
    ratio = _given(section, "element_diameter_mm") / _given(section, "pitch_diameter_mm")
    most = int(math.pi / math.asin(min(ratio, 1.0)))
    spacing = dimensions.PROPORTIONS[section.type].spacing
    value, low, high = (
        float(min(most, dimensions.element_count(section.type, ratio, each, section.full_complement)))
        for each in (spacing.value, spacing.high, spacing.low)
    )
    if section.full_complement:
        low = value - 1.0
        high = float(most)
    return Estimate("element_count", value, low, high, "")


def _element_length(section: CatalogueSection) -> Estimate | None:
    if section.type not in dimensions.ROLLER_LENGTH:
        return None
    return _scaled(
        "element_length_mm", dimensions.ROLLER_LENGTH[section.type], section.width_mm / row_count(section), "mm"
    )


def _groove(key: str) -> Callable[[CatalogueSection], Estimate]:
    return lambda section: _scaled(key, dimensions.GROOVE_RATIO, 1.0, "")


def _rib_contact(section: CatalogueSection) -> Estimate | None:
    if section.ribs == "none":
        return None
    return _scaled("rib_contact_mm", dimensions.RIB_CONTACT, _given(section, "element_diameter_mm"), "mm")


def _row_distance(section: CatalogueSection) -> Estimate | None:
    if section.arrangement != "single":
        distance = dimensions.PAIR_DISTANCE
        if section.type == "tapered_roller":
            distance = dimensions.TAPERED_PAIR_DISTANCE.get(section.arrangement, distance)
        return _scaled("row_distance_mm", distance, section.width_mm, "mm")
    rows = row_count(section)
    if rows == 1 or section.type in ALIGNING:
        return None
    return Estimate(
        "row_distance_mm", section.width_mm / rows, 0.75 * section.width_mm / rows, section.width_mm / rows, "mm"
    )


def _radial_clearance(section: CatalogueSection) -> Estimate | None:
    if section.type not in dimensions.CLEARANCE_UM:
        return None
    fixed, per_bore = dimensions.CLEARANCE_UM[section.type]
    return Estimate("radial_clearance_mm", 0.0, 0.0, MM * (fixed + per_bore * section.bore_mm), "mm")


def _axial_preload(section: CatalogueSection) -> Estimate | None:
    if section.arrangement not in ("X", "O") or "radial_clearance_mm" in section.model_fields_set:
        return None
    setting = dimensions.AXIAL_SETTING_UM_PER_MM * section.bore_mm
    return Estimate("axial_preload_um", 0.0, -setting, setting, "um")


_ESTIMATED: Mapping[str, Callable[[CatalogueSection], Estimate | None]] = {
    "pitch_diameter_mm": _pitch_diameter,
    "element_diameter_mm": _element_diameter,
    "element_count": _element_count,
    "element_length_mm": _element_length,
    "rib_contact_mm": _rib_contact,
    "contact_angle_deg": _contact_angle,
    "inner_groove_ratio": _groove("inner_groove_ratio"),
    "outer_groove_ratio": _groove("outer_groove_ratio"),
    "osculation": lambda section: _scaled("osculation", dimensions.OSCULATION, 1.0, ""),
    "row_distance_mm": _row_distance,
    "radial_clearance_mm": _radial_clearance,
    "axial_preload_um": _axial_preload,
}


# -- rows ---------------------------------------------------------------------------------------------------------


def _given(section: CatalogueSection, key: str) -> float:
    """Value of a key that is given or was estimated before."""
    return float(getattr(section, key))


def _common(section: CatalogueSection) -> dict[str, Any]:
    """Give what rows of rollers and of balls share, SI, after a check that the elements fit."""
    diameter = _given(section, "element_diameter_mm")
    pitch = _given(section, "pitch_diameter_mm")
    count = round(_given(section, "element_count"))
    # Across the contact the elements reach from groove to groove; rings need some wall.
    height = diameter * math.cos(math.radians(section.contact_angle_deg or 0.0))
    # Needles without rings run on shaft and bore themselves.
    wall = -ROUNDING_MM if section.type == "needle_roller" else 0.0
    inside = pitch - height - section.bore_mm
    outside = section.outer_diameter_mm - pitch - height
    if min(inside, outside) < wall or (wall == 0.0 and min(inside, outside) == 0.0):
        raise BearingError(
            f"element_diameter_mm = {diameter:g} on pitch_diameter_mm = {pitch:g} reaches beyond the rings; between "
            f"bore_mm = {section.bore_mm:g} and outer_diameter_mm = {section.outer_diameter_mm:g} it must be smaller"
        )
    most = int(math.pi / math.asin(min(1.0, diameter / pitch)))
    if count > most:
        raise BearingError(
            f"element_count = {count} rolling elements of element_diameter_mm = {diameter:g} do not fit on "
            f"pitch_diameter_mm = {pitch:g}; {most} do"
        )
    mean = 0.5 * (section.bore_mm + section.outer_diameter_mm)
    return {
        "element_diameter": MM * diameter,
        "pitch_diameter": MM * pitch,
        "element_count": count,
        "radial_clearance": MM * (section.radial_clearance_mm - (EXPANSION * mean * section.inner_ring_hotter_K)),
        "aligning": section.type in SPHERES,
    }


def _roller_row(section: CatalogueSection) -> RollerRow:
    """One row in the middle of the bearing, without its contact angle."""
    common = _common(section)
    length = si(section, "element_length_mm")
    profile: dict[str, Any] = {}
    if section.type in SPHERES:
        raceway = _outer_raceway_radius(section)
        profile["crown_curvature"] = (1.0 / _given(section, "osculation") - 1.0) / raceway
    elif section.profile == "standard":
        factor, straight = dimensions.standard_profile(section.type, common["element_diameter"], length)
        profile.update(profile_factor=factor, straight_share=straight)
    elif section.profile == "none":
        profile["profile_factor"] = 0.0
    else:
        profile["profile_table"] = tuple((share, UM * drop) for share, drop in section.profile)
    return RollerRow(**common, effective_length=length, **profile)


def _outer_raceway_radius(section: CatalogueSection) -> float:
    """Radius (m) of the sphere that the rows of an aligning bearing run in."""
    angle = math.radians(section.contact_angle_deg or 0.0)
    return 0.5 * MM * (_given(section, "pitch_diameter_mm") / math.cos(angle) + _given(section, "element_diameter_mm"))


def _ball_row(section: CatalogueSection) -> BallRow:
    """One row in the middle of the bearing, without its contact angle."""
    if section.type == "self_aligning_ball":
        outer = _outer_raceway_radius(section) / si(section, "element_diameter_mm")
    else:
        outer = _given(section, "outer_groove_ratio")
    return BallRow(**_common(section), inner_conformity=_given(section, "inner_groove_ratio"), outer_conformity=outer)


def _placed(section: CatalogueSection, row: RollerRow | BallRow) -> tuple[RollingRow, ...]:
    """Place the rows of a bearing or a pair next to each other, with their contact angles."""
    angle = math.radians(section.contact_angle_deg or 0.0)
    signed = angle if section.locates_towards == "+z" else -angle
    if section.type == "four_point_ball":
        return tuple(moved(row, signed, 0.0) for signed in (-angle, angle))
    if section.arrangement != "single":
        distance = si(section, "row_distance_mm")
        preload = si(section, "axial_preload_um")
        return pair_rows(moved(row, signed, 0.0), section.arrangement, distance, preload)
    if section.type == "thrust_spherical_roller":
        # All rollers press on one point of the axis, beside the bearing.
        centre = -0.5 * row.pitch_diameter * math.tan(signed)
        return (replace(moved(row, signed, 0.0), sphere_centre=centre),)
    rows = row_count(section)
    if section.type in ALIGNING and rows == 2:
        # Both rows point to the middle of the bearing.
        place = 0.5 * row.pitch_diameter * math.tan(angle)
        return moved(row, -angle, -place), moved(row, angle, place)
    distance = si(section, "row_distance_mm") if rows > 1 else 0.0
    return tuple(moved(row, signed, (number - 0.5 * (rows - 1)) * distance) for number in range(rows))


# Catalogue load ratings, and the largest ratio of estimates to them

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
"""The same of cylindrical rollers without a cage (static ratings, see `exugear.system.bearings.rolling.dimensions`)."""
_LISTED = re.compile(r"(NUP|NU|NJ|N)?\s?(\d{3,5})(?!\d)[\s-]?([A-Z0-9-]*)")
_SEALED = re.compile(r"2?RS|LL|DDU|VV|UU")


@dataclass(frozen=True)
class KnownRating:
    """Dynamic and static rating of one bearing, N, and the manufacturers whose catalogues they are the minimum of."""

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
    number = next((one for one in _listed_as(section) if (section.type, one) in _listed()), "")
    return _rating_of(section, number)


def other_design(section: CatalogueSection) -> tuple[str, KnownRating] | None:
    """Find name and ratings of the reinforced design, where the designation may mean it and is taken otherwise.

    Examples
    --------
    >>> section = CatalogueSection(
    ...     designation="NU 207", type="cylindrical_roller", bore_mm=35.0, outer_diameter_mm=72.0, width_mm=17.0
    ... )
    >>> other_design(section)
    ('NU207E', KnownRating(dynamic=55300.0, static=48000.0, makers=('NKE', 'SKF')))
    """
    taken = known_rating(section)
    for number in _listed_as(section)[1:]:
        other = _rating_of(section, number)
        if taken is not None and other is not None and other != taken:
            return number, other
    return None


def _rating_of(section: CatalogueSection, number: str) -> KnownRating | None:
    """Ratings that are listed under a name; None where it is not listed, or of other dimensions."""
    row = _listed().get((section.type, number))
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
    """Return the matching designations of the table; none for other designs, nor for seals that reduce the inner space.

    A cylindrical roller bearing without E has the older design if a manufacturer still lists it.
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
        return (f"{number}B",) if suffix.startswith("B") else ()
    if section.type == "self_aligning_ball" and _SEALED.search(suffix):
        return ()
    return (number,)


def similar_designation(designation: str) -> str:
    """Return the listed designation that is most like another; empty if none is like it.

    Examples
    --------
    >>> similar_designation("NU 3O9"), similar_designation("XY 1")
    ('NU309E', '')
    """
    text = designation.upper().replace(" ", "").replace("O", "0")  # a letter that is typed for a zero
    return next(iter(difflib.get_close_matches(text, [name for _, name in _listed()], n=1, cutoff=0.7)), "")


@cache
def _listed() -> dict[tuple[str, str], tuple[float, float, float, float, float, tuple[str, ...]]]:
    """Bore, outer diameter and width (mm), dynamic and static rating (N) and manufacturers, by type and designation."""
    found = {}
    with (Path(__file__).parent / "makers.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            bore, outer, width = (float(row[key]) for key in ("bore_mm", "outer_diameter_mm", "width_mm"))
            dynamic = KN * float(row["dynamic_kN"])
            static = KN * float(row["static_kN"])
            makers = tuple(row["makers"].split("/"))
            found[row["type"], row["designation"]] = bore, outer, width, dynamic, static, makers
    return found
