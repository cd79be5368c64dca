"""Bearings and couplings of a REXS file as those of the gearbox file, and the ideal joints of the variant `rigid`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from exugear.bearings.rolling.designations import boundary_of
from exugear.model.sections.connections import CONTACT_ANGLES_DEG, TYPES_OF_KEYS
from exugear.rexs.faults import RexsError, plain
from exugear.rexs.to_case.bodies import (
    JOINING,
    RIGID_TORSION,
    Bodies,
    Body,
    ends,
    is_engaged,
    torsional_stiffness,
)
from exugear.rexs.to_case.notes import Block, Entry, Notes, assumed, derived, read, tidy
from exugear.rexs.to_case.places import Places
from exugear.rexs.tree import Component, Model

BEARINGS = ("concept_bearing", "rolling_bearing_with_catalog_geometry", "rolling_bearing_with_detailed_geometry")
PLAIN_BEARINGS = ("hydrodynamic_radial_plain_bearing", "slide_bearing")
ROLLING_TYPES = {
    "angular_contact_ball_bearing": "angular_contact_ball",
    "four_point_contact_ball_bearing": "four_point_ball",
    "radial_grooved_ball_bearing": "deep_groove_ball",
    "radial_needle_roller_bearing": "needle_roller",
    "radial_roller_bearing": "cylindrical_roller",
    "radial_self_aligning_ball_bearing": "self_aligning_ball",
    "radial_self_aligning_roller_bearing": "spherical_roller",
    "radial_spherical_roller_bearing": "spherical_roller",
    "radial_tapered_roller_bearing": "tapered_roller",
}
"""Types of rolling bearings, REXS to ours."""
PLACE_TOLERANCE = 0.02
"""Largest difference of two statements on a place that needs no word, mm."""
RIGID_ABOVE = {"radial_stiffness": 1e14, "axial_stiffness": 1e14, "bending_stiffness": 1e11}
"""Stiffness (N/m, N m/rad) from which on a file means rigid; no bearing has as much."""
RIGID = {"radial_stiffness": 1e10, "axial_stiffness": 1e10, "bending_stiffness": 1e7}
"""What stands for rigid: stiffer than teeth and bearings, and no more, for the step's sake."""
KEYS = {
    "radial_stiffness": ("radial_N_per_m", "N / m", 1.0),
    "axial_stiffness": ("axial_N_per_m", "N / m", 1.0),
    "bending_stiffness": ("tilt_N_m_per_rad", "N mm / rad", 1e-3),
}


def bearing_blocks(model: Model, places: Places, bodies: Bodies, notes: Notes) -> dict[str, Block]:
    """Tables of all bearings by name, and of connections that hold without joining."""
    blocks: dict[str, Block] = {}
    for part in model.of_type(*BEARINGS, *PLAIN_BEARINGS):
        with notes.faults.gathered():
            block = _bearing(model, places, bodies, part, notes)
            if block is not None:
                blocks[f"bearing_{len(blocks) + 1}"] = block
    for part, body, on in _flexible_connections(model, bodies):
        entries = _stiffness(part, notes)
        if not entries:
            continue
        with notes.faults.gathered():
            blocks[f"bearing_{len(blocks) + 1}"] = _placed(places, part, body, on, {"stiffness": Block("", entries)})
    return blocks


def coupling_blocks(model: Model, bodies: Bodies) -> dict[str, Block]:
    """Tables of the connections whose torsion gives way, by name."""
    blocks: dict[str, Block] = {}
    for part, body, on in _flexible_connections(model, bodies):
        torsion = torsional_stiffness(part) or 0.0
        if torsion > 0.0 and not on.fixed:
            names = read([body.name, on.name], "inner_part and outer_part")
            entries = {"bodies": names, "stiffness_N_m_per_rad": read(tidy(torsion), "rotational_stiffness")}
            blocks[f"coupling_{len(blocks) + 1}"] = Block(str(part), entries)
    return blocks


def joint_blocks(bodies: Bodies, bearings: dict[str, Block], gear_places: dict[str, float]) -> dict[str, Block]:
    """Joints of the variant `rigid`: one for each body, in the middle of its bearings, or at its gear."""
    blocks = {}
    for body in bodies.members:
        if body.fixed:
            continue
        held = [one.entries["z_mm"].value for one in bearings.values() if one.entries["body"].value == body.name]
        place = sum(held) / len(held) if held else gear_places.get(body.name, 0.0)
        entries = {"body": Entry(body.name)}
        if body.carrier:
            entries["on"] = Entry(body.carrier)
        entries["z_mm"] = derived(tidy(round(place, 6)), "middle of its bearings" if held else "middle of its gear")
        blocks[body.name] = Block("", entries)
    return blocks


def _flexible_connections(model: Model, bodies: Bodies) -> Iterator[tuple[Component, Body, Body]]:
    """Couplings and fits between two bodies whose torsion is less than rigid, one of equal planets."""
    for part in model.of_type(*JOINING):
        both = ends(model, part)
        torsion = torsional_stiffness(part)
        if both is None or torsion is None or torsion >= RIGID_TORSION or not is_engaged(model, part):
            continue
        inner, outer = bodies.of(both[0]), bodies.of(both[1])
        if inner is not None and outer is not None and inner is not outer:
            yield part, inner, outer


def _bearing(model: Model, places: Places, bodies: Bodies, part: Component, notes: Notes) -> Block | None:
    both = ends(model, part)
    if both is None:
        raise RexsError(f"{part}: no relation 'side' tells what it holds and on what")
    inner, outer = (None if end.type == "gear_casing" else bodies.of_any(end) for end in both)
    if any(body is not None and bodies.of(end) is None for end, body in zip(both, (inner, outer), strict=True)):
        return None  # of a planet that is like the first
    inner, outer = (None if body is not None and body.fixed else body for body in (inner, outer))
    if inner is outer:
        notes.ignored.append(f"{part}: holds nothing that turns, or both of its rings are on one body")
        return None
    if inner is None or (outer is not None and outer.carrier == inner.name):
        inner, outer = outer, inner
    if inner is None:
        return None
    _check_place(places, part, both, notes)
    inside = _support(model, part, places.sense(both[0]), notes)
    block = _placed(places, part, inner, outer, inside)
    if "designation" in inside:
        block.entries["designation"] = inside["designation"].entries["designation"]
        block.blocks.clear()
    if outer is None and bodies.of(both[0]) is None:
        block.entries["outer_ring"] = read("body", "outer_part turns")
    return block


def _check_place(places: Places, part: Component, both: tuple[Component, Component], notes: Notes) -> None:
    """Compare the place of a bearing with its coordinate on the shafts that it joins."""
    for side, shaft in zip(("inner", "outer"), both, strict=True):
        along = part.quantity(f"u_coordinate_on_shaft_{side}_side", "mm")
        if along is None or shaft.type != "shaft" or not shaft.given("support_vector"):
            continue
        expected = places.position(shaft)[2] + places.sense(shaft) * along
        if abs(expected - places.position(part)[2]) > PLACE_TOLERANCE:
            notes.checked.append(
                f"{part}: stands at z = {places.position(part)[2]:g} mm by support_vector, which is taken, and at "
                f"{expected:g} mm by u_coordinate_on_shaft_{side}_side"
            )


def _placed(places: Places, part: Component, body: Body, on: Body | None, inside: dict[str, Block]) -> Block:
    entries = {"body": Entry(body.name)}
    if on is not None and not on.fixed:
        entries["on"] = Entry(on.name)
    entries["z_mm"] = read(places.position(part)[2], "support_vector")
    return Block(str(part), entries, inside, part.number)


def _support(model: Model, part: Component, sense: int, notes: Notes) -> dict[str, Block]:
    """Return the stiffness or catalogue of a bearing, or its designation alone."""
    if part.type == "concept_bearing":
        entries = _stiffness(part, notes)
        if not entries:
            raise RexsError(f"{part}: holds nothing, neither radially nor axially nor against tilting")
        return {"stiffness": Block("", entries)}
    kind = ROLLING_TYPES.get(part.text("bearing_type"))
    sizes = _sizes(part, kind, notes)
    rows = part.whole("number_of_bearing_rows") or 1
    paired = rows > 1 and kind in CONTACT_ANGLES_DEG and kind not in ("spherical_roller", "self_aligning_ball")
    if kind and sizes and not paired:
        return {"catalogue": Block("", _catalogue(model, part, kind, rows, sense, sizes, notes))}
    if not kind:
        why = f"a {part.text('bearing_type') or part.type} has no law here: give its stiffness"
    elif paired:
        why = "a bearing of two rows with contact angles: give its catalogue with arrangement X, O or tandem"
    else:
        why = "the file gives no dimensions, and no table here has them: give its catalogue, or its stiffness"
    notes.changed.append(f"{part}: BLANK, {why}; until then only the variant rigid runs")
    return {"designation": Block("", {"designation": Entry(_designation(part), f"BLANK: {why}")})}


def _sizes(part: Component, kind: str | None, notes: Notes) -> dict[str, Entry]:
    """Boundary dimensions: those of the file, or those that its designation stands for; empty if neither tells."""
    keys = {"inner_diameter": "bore_mm", "outer_diameter": "outer_diameter_mm", "width": "width_mm"}
    given = {ours: part.quantity(key, "mm") for key, ours in keys.items()}
    if all(given.values()):
        return {ours: read(given[ours], key) for key, ours in keys.items()}
    found = boundary_of(_designation(part))
    if found is None or found.type != kind:
        return {}
    source = f"{found.source} by the designation {_designation(part)}: the file gives no dimensions"
    notes.changed.append(f"{part}: {found.bore:g} x {found.outer:g} x {found.width:g} mm by {source}")
    sizes = {"bore_mm": found.bore, "outer_diameter_mm": found.outer, "width_mm": found.width}
    return {key: assumed(value, source) for key, value in sizes.items()}


def _designation(part: Component) -> str:
    return plain(part.text("catalogue_designation") or part.text("name") or part.name or part.type, 60)


def _catalogue(
    model: Model, part: Component, kind: str, rows: int, sense: int, sizes: Mapping[str, Entry], notes: Notes
) -> dict[str, Entry]:
    entries = {
        "type": read(kind, f"bearing_type {part.text('bearing_type')}"),
        "designation": Entry(_designation(part)),
        **sizes,
    }
    row = next(iter(_parts_of(model, part, "rolling_bearing_row")), None)
    angle = abs((row or part).quantity("pressure_angle", "deg") or 0.0)
    if kind in CONTACT_ANGLES_DEG and CONTACT_ANGLES_DEG[kind][0] <= angle <= CONTACT_ANGLES_DEG[kind][1]:
        entries["contact_angle_deg"] = read(tidy(angle), "pressure_angle of its row")
    if rows > 1 or part.text("bearing_type") == "radial_spherical_roller_bearing":
        entries["row_count"] = read(rows, "number_of_bearing_rows")
    if row is not None:
        entries |= _elements(model, row, kind)
    clearance = part.quantity("operating_radial_bearing_clearance", "mm")
    if clearance:
        entries["radial_clearance_mm"] = read(tidy(clearance), "operating_radial_bearing_clearance")
    for key, ours in (
        ("radial_dynamic_load_rating", "dynamic_rating_kN"),
        ("radial_static_load_rating", "static_rating_kN"),
    ):
        rating = part.quantity(key, "kN")
        if rating:
            entries[ours] = read(tidy(rating), key)
    _tell_axial(part, kind, sense, entries, notes)
    return entries


def _tell_axial(part: Component, kind: str, sense: int, entries: dict[str, Entry], notes: Notes) -> None:
    """Say which way a bearing holds the shaft, where the law of its type does not already."""
    absorbed = part.text("axial_force_absorption")
    if kind in TYPES_OF_KEYS["holds_towards"][0] and absorbed in ("positive", "negative"):
        towards = "+z" if (absorbed == "positive") == (sense > 0) else "-z"
        entries["holds_towards"] = read(towards, f"axial_force_absorption {absorbed}")
    elif absorbed in ("positive", "negative", "no_direction") and kind not in ("cylindrical_roller", "needle_roller"):
        notes.changed.append(f"{part}: axial_force_absorption {absorbed}, but the law of a {kind} holds both ways")
    elif absorbed != "no_direction" and kind in ("cylindrical_roller", "needle_roller"):
        notes.changed.append(f"{part}: axial_force_absorption {absorbed}, but the law of a {kind} holds no way")


def _elements(model: Model, row: Component, kind: str) -> dict[str, Entry]:
    """Count and sizes of the rolling elements, as far as the file gives them."""
    entries = {}
    count = row.whole("number_of_rolling_elements")
    if count:
        entries["element_count"] = read(count, "number_of_rolling_elements")
    element = next(iter(_parts_of(model, row, "rolling_element")), None)
    wanted = [(element, "diameter_of_rolling_element", "element_diameter_mm")]
    if kind in TYPES_OF_KEYS["element_length_mm"][0]:
        wanted.append((element, "length_of_rolling_element", "element_length_mm"))
    wanted.append((row, "reference_diameter_rolling_bearing", "pitch_diameter_mm"))
    for part, key, ours in wanted:
        value = part.quantity(key, "mm") if part else None
        if value:
            entries[ours] = read(tidy(value), key)
    return entries


def _parts_of(model: Model, owner: Component, kind: str) -> Sequence[Component]:
    found = [
        one
        for relation in ("assembly", "ordered_assembly")
        for one in model.related(relation, "assembly", owner.number, "part")
    ]
    return [one for one in found if one.type == kind]


def _stiffness(part: Component, notes: Notes) -> dict[str, Entry]:
    """Isotropic stiffness of a concept bearing or coupling; what is meant as rigid gets a bound."""
    entries = {}
    for key, (ours, unit, factor) in KEYS.items():
        value = part.quantity(key, unit)
        value = None if value is None else factor * value
        if key == "radial_stiffness" and part.flag("radial_force_absorption") is False:
            continue
        absorbed = part.text("axial_force_absorption")
        if key == "axial_stiffness" and absorbed == "no_direction":
            continue
        if value is None and (key == "bending_stiffness" or part.type in JOINING):
            continue
        if value is None and key == "axial_stiffness" and absorbed not in ("both_directions", "positive", "negative"):
            continue
        if key == "axial_stiffness" and absorbed in ("positive", "negative"):
            notes.changed.append(f"{part}: holds the axis {absorbed} along u only, here both ways")
        if value is None or value >= RIGID_ABOVE[key]:
            said = "the file gives none" if value is None else f"{key} of {value:g} means rigid"
            entries[ours] = assumed(RIGID[key], said)
        elif value > 0.0:
            entries[ours] = read(tidy(value), key)
    return entries
