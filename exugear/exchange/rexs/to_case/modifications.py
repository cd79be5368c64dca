"""Flank modifications of a REXS file: reliefs and crownings that are equal on both flanks."""

from __future__ import annotations

import math
from collections.abc import Iterator

from exugear.exchange.rexs.faults import RexsError
from exugear.exchange.rexs.to_case.meshing import unchecked
from exugear.exchange.rexs.to_case.notes import Entry, Notes, assumed, derived, read, tidy
from exugear.exchange.rexs.to_case.toothing import EQUAL, Toothing
from exugear.exchange.rexs.tree import Component, Model

READ = ("tip_relief", "root_relief", "profile_crowning", "helix_crowning")
"""Modifications that are imported."""
MODIFICATIONS = (
    *READ,
    "triangular_tip_relief",
    "triangular_root_relief",
    "profile_slope",
    "profile_twist",
    "helix_slope",
    "end_relief_datum_face",
    "end_relief_non_datum_face",
    "topographical_modification",
)
UNSIGNED = {"helix_slope": "helix_slope_um", "profile_slope": "profile_slope_um", "profile_twist": "twist_um"}
"""Modifications by the attribute of their amount, and the key that it would be.

Database and schema of REXS (1.2 to 2.0.0) allow both signs and call it an amount; which end of the flank a positive one
takes material off, no public text says. The wrong sign would be worse than none.
"""
SHAPES = {"linear": "linear", "parabolic": "parabolic", "circular": "parabolic"}
"""Shapes of a relief, REXS to ours; a circle and its parabola differ by the square of depth over length."""


def modification_of(model: Model, gear: Toothing, notes: Notes) -> dict[str, Entry]:
    """Entries of a gear's table of modifications; empty for none.

    Raises
    ------
    RexsError
        Left and right flank differ.
    """
    left, right = (_by_type(model, gear.part, side) for side in ("left", "right"))
    for kind, part in {**right, **left}.items():
        if kind not in READ and kind not in UNSIGNED:
            notes.changed.append(f"{part} of {gear.part}: not imported; give it in [gears.NAME.modification]")
    entries: dict[str, Entry] = {}
    for kind in READ:
        one = left.get(kind)
        other = right.get(kind)
        if one is None and other is None:
            continue
        if one is None or other is None or not _equal(one, other):
            raise RexsError(f"{gear.part}: left and right flank differ in {kind}; only equal flanks can be imported")
        found = dict(_entries(gear, one, notes))
        if not found:
            notes.changed.append(f"{one} of {gear.part}: not imported, its numbers say nothing that can be read here")
        entries |= found
    return entries | dict(_blanks(gear, left, right, notes))


def _blanks(
    gear: Toothing, left: dict[str, Component], right: dict[str, Component], notes: Notes
) -> Iterator[tuple[str, Entry]]:
    """Slopes that the file gives, as zeros to be set: their signs are not known. Those of zero need no word."""
    for kind, key in UNSIGNED.items():
        part = left.get(kind) or right.get(kind)
        amounts = [one[kind].quantity(kind, "mm") for one in (left, right) if kind in one]
        if part is None or not any(amounts):
            continue
        said = ", ".join(dict.fromkeys(f"{_um(amount):g} um" for amount in amounts if amount))
        notes.changed.append(
            f"{part} of {gear.part}: its amount of {said} is not taken, as REXS does not say which end a positive one "
            f"takes material off; set {key} in [gears.NAME.modification], which does"
        )
        yield key, assumed(0.0, f"SET IT: {said} by {part}, the end unknown")


def _by_type(model: Model, gear: Component, side: str) -> dict[str, Component]:
    flanks = model.related("flank", "gear", gear.number, side)
    found = [one for flank in flanks for one in model.related("reference", "origin", flank.number, "referenced")]
    return {one.type: one for one in found if one.type in MODIFICATIONS}


def _equal(component: Component, other: Component) -> bool:
    keys = {key for part in (component, other) for key, value in part.attributes.items() if value.unit == "mm"}
    pairs = ((component.quantity(key, "mm"), other.quantity(key, "mm")) for key in keys)
    return all(a == b or (a is not None and b is not None and abs(a - b) < EQUAL) for a, b in pairs)


def _entries(gear: Toothing, part: Component, notes: Notes) -> Iterator[tuple[str, Entry]]:
    if part.type.endswith("_relief"):
        yield from _relief(gear, part)
    elif part.type == "profile_crowning":
        ends = [part.quantity(f"profile_crowning_at_{end}", "mm") for end in ("tip", "root")]
        if ends[0] is not None and ends[1] is not None and abs(ends[0] - ends[1]) < EQUAL:
            yield "profile_crowning_um", read(_um(ends[0]), f"profile_crowning_at_tip and _root of {part}")
    else:
        yield from _lead_crowning(gear, part)


def _lead_crowning(gear: Toothing, part: Component) -> Iterator[tuple[str, Entry]]:
    """Crowning along the face, scaled to its ends: it grows with the square of the distance from the middle."""
    sides = ("datum_face", "non_datum_face")
    amounts = [part.quantity(f"helix_crowning_amount_{side}", "mm") for side in sides]
    quantities = [part.quantity(f"coordinate_where_helix_crowning_is_specified_{side}", "mm") for side in sides]
    if None in amounts or None in quantities:
        return
    (one, other), (low, high) = [[value or 0.0 for value in pair] for pair in (amounts, quantities)]
    half = 0.5 * gear.face_width.value
    if abs(one - other) < EQUAL and abs(low + high) < EQUAL and abs(high) > 0.1 * half:
        amount = _um(one * (half / high) ** 2)
        yield "lead_crowning_um", read(amount, f"helix_crowning_amount at the ends of the face, {part}")


def _relief(gear: Toothing, part: Component) -> Iterator[tuple[str, Entry]]:
    """Relief from its datum diameter on, scaled to the end of the flank where its depth is stated elsewhere."""
    kind = part.type.removesuffix("_relief")
    depth, datum = (part.quantity(f"{part.type}_{key}", "mm") for key in ("depth", "datum_diameter"))
    shape = SHAPES.get(part.text("shape_of_relief"))
    geometry = unchecked("", gear)
    base = 2e3 * geometry.base_radius
    if not depth or datum is None or abs(datum) <= base or shape is None:
        return
    end = 2e3 * (geometry.tip_radius if kind == "tip" else geometry.form_radius)
    stated = abs(part.quantity(f"{part.type}_evaluation_reference", "mm") or end)
    start, stated_at, ends_at = (math.sqrt(max((d / base) ** 2 - 1.0, 0.0)) for d in (abs(datum), stated, end))
    if abs(stated_at - start) < EQUAL:
        return
    scale = (abs(ends_at - start) / abs(stated_at - start)) ** (1 if shape == "linear" else 2)
    yield f"{kind}_relief_um", read(_um(depth * scale), f"{part.type}_depth of {part}")
    yield f"{kind}_relief_start_roll_deg", derived(tidy(round(math.degrees(start), 6)), f"{part.type}_datum_diameter")
    yield f"{kind}_relief_shape", read(shape, f"shape_of_relief {part.text('shape_of_relief')}")


def _um(length: float) -> float:
    """Millimetres to micrometres, without the digits that arithmetic made."""
    return tidy(round(1e3 * length, 6))
