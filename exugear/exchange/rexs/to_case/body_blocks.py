"""Bodies of a REXS file as tables of the gearbox file: place, inertia, and the shape of shafts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from exugear.exchange.rexs.faults import RexsError
from exugear.exchange.rexs.to_case.bodies import Bodies, Body
from exugear.exchange.rexs.to_case.gear_blocks import Teeth
from exugear.exchange.rexs.to_case.notes import Block, Entry, Notes, derived, read, tidy
from exugear.exchange.rexs.to_case.places import Places
from exugear.exchange.rexs.to_case.shafts import (
    Cylinder,
    Inertia,
    gear_tube,
    inertia_of,
    is_continuous,
    levelled,
    plate,
    seat_diameter,
    sections_of,
)
from exugear.exchange.rexs.to_case.toothing import is_rigid, material_of, material_table
from exugear.exchange.rexs.tree import Component, Model

INERTIAS = "geometry"
"""Name of the inertia set."""


def sections_of_bodies(model: Model, places: Places, bodies: Bodies, notes: Notes) -> dict[str, Sequence[Cylinder]]:
    """Sections of the shafts of each body, in the order of z."""
    found: dict[str, Sequence[Cylinder]] = {}
    for body in bodies.members:
        pieces: list[Cylinder] = []
        for shaft in body.of_type("shaft"):
            with notes.faults.gathered():
                pieces += sections_of(model, places, shaft, body, notes)
        found[body.name] = sorted(pieces, key=lambda one: one.start)
    return found


def levelled_under_seats(
    sections: Mapping[str, Sequence[Cylinder]], teeth: Teeth, bearings: Mapping[str, Block], notes: Notes
) -> dict[str, Sequence[Cylinder]]:
    """Sections of each body, of one diameter under its gears and catalogue bearings where it nearly is."""
    seats: dict[str, list[tuple[str, float, float]]] = {name: [] for name in sections}
    for number, body in teeth.bodies.items():
        gear = teeth.gears[number]
        seats[body.name].append((str(gear.part), teeth.z[number], gear.face_width.value))
    for block in bearings.values():
        if "catalogue" in block.blocks:
            width = block.blocks["catalogue"].entries["width_mm"].value
            seats[block.entries["body"].value].append((block.comment, block.entries["z_mm"].value, width))
    return {
        name: levelled(pieces, seats[name], notes) if is_continuous(pieces) else pieces
        for name, pieces in sections.items()
    }


def body_blocks(
    model: Model,
    places: Places,
    bodies: Bodies,
    teeth: Teeth,
    sections: Mapping[str, Sequence[Cylinder]],
    notes: Notes,
) -> dict[str, Block]:
    """Tables of all bodies by name."""
    blocks = {}
    for body in bodies.members:
        with notes.faults.gathered():
            blocks[body.name] = _block(model, places, body, teeth, sections[body.name], notes)
    return blocks


def _block(model: Model, places: Places, body: Body, teeth: Teeth, sections: Sequence[Cylinder], notes: Notes) -> Block:
    block = Block(", ".join(str(part) for part in body.parts), _place(body))
    wheels = [number for number, owner in teeth.bodies.items() if owner is body]
    if wheels:
        z = {teeth.names[number]: teeth.z[number] for number in wheels}
        block.entries["wheels_z_mm"] = read(z, "support_vector of the gears")
    if body.fixed:
        block.entries["fixed"] = read(True, "joined with the casing")
        return block
    tubes = {number: _tube(model, body, teeth, number, sections, notes) for number in wheels}
    plates = [one for part in body.of_type("side_plate") if (one := plate(model, places, part, notes)) is not None]
    inertia = inertia_of([*sections, *tubes.values(), *plates])
    if inertia.mass <= 0.0:
        raise RexsError(f"{body.parts[0]}: neither sections nor gears nor plates give its inertia")
    made_of = [
        f"{len(found)} {name}{'s' if len(found) > 1 else ''}"
        for name, found in (("section", sections), ("gear tube", tubes), ("plate", plates))
        if found
    ]
    block.blocks[f"inertia.{INERTIAS}"] = Block("", _inertia_entries(inertia, ", ".join(made_of)))
    if _has_shape(model, body, sections):
        block.entries["flexibility"] = derived("elastic", "in the variant flexible: its sections follow each other")
        block.blocks["shape"] = _shape(model, body, sections, notes)
        block.blocks["shape.blanks"] = Block(
            "gears as tubes from their seats to their reference circles",
            {teeth.names[number]: _blank(tube) for number, tube in tubes.items() if tube.mass > 0.0},
        )
        if not block.blocks["shape.blanks"].entries:
            del block.blocks["shape.blanks"]
    return block


def _place(body: Body) -> dict[str, Entry]:
    if not body.carrier:
        return {"axis_position_mm": read([*body.axis], "support_vector")}
    return {
        "carrier": Entry(body.carrier),
        "orbit_radius_mm": read(body.orbit, "support_vector of the planet shafts"),
        "planet_angles_deg": read([tidy(round(angle, 6)) for angle in body.angles], "support_vector"),
    }


def _tube(model: Model, body: Body, teeth: Teeth, number: int, sections: Sequence[Cylinder], notes: Notes) -> Cylinder:
    gear = teeth.gears[number]
    z = teeth.z[number]
    seat = seat_diameter(sections, z, gear.face_width.value, gear.internal)
    return gear_tube(model, gear, z, seat, 0.0, notes)


def _inertia_entries(inertia: Inertia, made_of: str) -> dict[str, Entry]:
    return {
        "mass_kg": derived(_digits(inertia.mass), f"computed here from {made_of}"),
        "axial_kg_m2": derived(_digits(inertia.axial), "likewise"),
        "transverse_kg_m2": derived(_digits(max(inertia.transverse, 0.5 * inertia.axial * (1.0 + 1e-5))), "likewise"),
        "centre_of_mass_z_mm": derived(tidy(round(inertia.centre, 4)), "likewise"),
    }


def _digits(value: float) -> float:
    return float(f"{value:.6g}")


def _has_shape(model: Model, body: Body, sections: Sequence[Cylinder]) -> bool:
    """Tell whether the sections of a body make one elastic shaft."""
    shafts = [part for part in body.of_type("shaft") if part.given("support_vector")]
    rigid = any(is_rigid(material_of(model, shaft)) for shaft in shafts)
    plain_shaft = (
        not body.carrier and not body.of_type("side_plate") and all(section.aside == 0.0 for section in sections)
    )
    materials = {_number(material_of(model, shaft)) for shaft in shafts}
    return plain_shaft and not rigid and len(materials) == 1 and is_continuous(sections)


def _number(material: Component | None) -> int:
    if material is None:
        return -1
    return material.number


def _shape(model: Model, body: Body, sections: Sequence[Cylinder], notes: Notes) -> Block:
    pieces = [
        {"length_mm": section.length, "outer_diameter_mm": section.outer}
        | ({"inner_diameter_mm": section.inner} if section.inner else {})
        | ({"outer_diameter_end_mm": section.outer_end} if section.outer_end not in (None, section.outer) else {})
        | ({"inner_diameter_end_mm": section.inner_end} if section.inner_end not in (None, section.inner) else {})
        for section in sections
    ]
    entries = {
        "start_z_mm": read(sections[0].start, "support_vector of the shaft"),
        "sections": read(pieces, "shaft_section"),
    }
    material = material_table(material_of(model, body.of_type("shaft")[0]))
    if material is not None:
        entries["material"] = material
    return Block("", entries)


def _blank(tube: Cylinder) -> Entry:
    inertia = inertia_of([tube])
    return derived(
        {
            "mass_kg": _digits(inertia.mass),
            "axial_kg_m2": _digits(inertia.axial),
            "transverse_kg_m2": _digits(max(inertia.transverse, 0.5 * inertia.axial * (1.0 + 1e-5))),
        },
        f"{tube.outer:.4g} x {tube.inner:.4g} x {tube.length:g} mm",
    )


def meshes_of_bodies(teeth: Teeth) -> dict[str, int]:
    """Count the meshes of each turning body that is no planet, in the order of the stages."""
    counts: dict[str, int] = {}
    for stage in teeth.stages.values():
        for number in (stage.pinion, stage.gear):
            body = teeth.bodies[number]
            if not body.fixed and not body.carrier:
                counts[body.name] = counts.get(body.name, 0) + 1
            if body.carrier:
                counts[body.carrier] = 1
    return counts


def gear_places(teeth: Teeth, bodies: Bodies) -> dict[str, float]:
    """Middle of the first gear of each body, of a carrier that of its planets, mm."""
    found: dict[str, float] = {}
    for number, body in teeth.bodies.items():
        found.setdefault(body.name, teeth.z[number])
    for body in bodies.members:
        if body.carrier and body.name in found:
            found.setdefault(body.carrier, found[body.name])
    return {name: z for name, z in found.items() if math.isfinite(z)}
