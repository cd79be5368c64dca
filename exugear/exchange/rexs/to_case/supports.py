"""Bearings and couplings of a REXS file as those of the gearbox file, and ideal joints of the variant `rigid`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from exugear.exchange.rexs.mapping import BEARINGS, JOINING, PLAIN_BEARINGS, READ, ROLLING_TYPES
from exugear.exchange.rexs.to_case.bodies import (
    RIGID_ABOVE,
    RigidGroup,
    RigidGroups,
    connections,
    ends,
    is_one_piece,
    is_rigid_in_torsion,
    torsional_stiffness,
)
from exugear.exchange.rexs.to_case.notes import (
    Block,
    ComponentPositions,
    Entry,
    Notes,
    assumed,
    derived,
    entries_of,
    read,
    tidy,
)
from exugear.exchange.rexs.tree import Component, Model, RexsError, plain
from exugear.gearbox.sections.connections import CONTACT_ANGLES_DEG, TYPES_OF_KEYS
from exugear.gearbox.sections.designations import boundary_of
from exugear.gearbox.units import MM

CYLINDERS = TYPES_OF_KEYS["ribs"][0]
"""Types of roller bearings that locate a shaft axially only by ribs."""
ARRANGED = TYPES_OF_KEYS["axial_preload_um"][0]
"""Types whose two rows are arranged in X, O or tandem."""
RATIOS = (
    ("inner_groove_ratio", "raceway_radius_of_inner_ring", "diameter_of_rolling_element", (0.501, 0.6)),
    ("outer_groove_ratio", "raceway_radius_of_outer_ring", "diameter_of_rolling_element", (0.501, 0.6)),
    ("osculation", "roller_crowning_radius", "raceway_radius_of_outer_ring", (0.5, 0.9999)),
)
"""Keys for ratios of two attributes, and the possible range; the profile radius is that of barrel rollers."""
LEAST_RADIUS = 0.03
"""Radius (m) used in place of a gear radius if two coupled bodies have no gears."""
PLACE_TOLERANCE = 0.02
"""Largest difference of two values of a position that is not reported, mm."""
RIGID = {"radial_stiffness": 1e10, "axial_stiffness": 1e10, "bending_stiffness": 1e7}
"""Stiffness used for rigid: above that of teeth and bearings, but not higher, because of the time step."""


def bearing_blocks(model: Model, places: ComponentPositions, bodies: RigidGroups, notes: Notes) -> dict[str, Block]:
    """Tables of all bearings by name, and of connections that support a body without joining it rigidly."""
    blocks: dict[str, Block] = {}
    for part in model.components_of_type(*BEARINGS, *PLAIN_BEARINGS):
        with notes.errors.gathered():
            block = _bearing(model, places, bodies, part, notes)
            if block is not None:
                blocks[f"bearing_{len(blocks) + 1}"] = block
    for part, body, on in _flexible_connections(model, bodies):
        entries = _stiffness(part, notes)
        if not entries:
            continue
        with notes.errors.gathered():
            blocks[f"bearing_{len(blocks) + 1}"] = _placed(places, part, body, on, {"stiffness": Block("", entries)})
    return blocks


def coupling_blocks(model: Model, bodies: RigidGroups, bearings: Mapping[str, Block]) -> dict[str, Block]:
    """Tables of the connections that couple the rotation of two bodies, by name; `bearings` act in other directions."""
    blocks: dict[str, Block] = {}
    seats = {block.number: name for name, block in bearings.items()}
    for part, body, on in _flexible_connections(model, bodies):
        torsion = torsional_stiffness(part)
        if torsion == 0.0 or on.fixed:
            continue
        entries = {"bodies": read([body.name, on.name], "inner_part and outer_part")}
        if part.number in seats:
            entries["seat"] = Entry(seats[part.number])
        if torsion is None or is_rigid_in_torsion(part):
            said = "none given" if torsion is None else f"rotational_stiffness of {torsion:g} N m/rad means rigid"
            said += f": as much as {RIGID['radial_stiffness']:g} N/m at the teeth"
            stiff = assumed(_stiff_torsion(body, on), said)
        else:
            stiff = read(tidy(torsion), "rotational_stiffness")
        blocks[f"coupling_{len(blocks) + 1}"] = Block(str(part), entries | {"stiffness_N_m_per_rad": stiff})
    return blocks


def _stiff_torsion(*bodies: RigidGroup) -> float:
    """Torsional stiffness used for rigid, N m/rad: the rigid radial stiffness at the largest reference circle."""
    diameters = [
        (gear.whole("number_of_teeth") or 0) * (gear.quantity("normal_module") or 0.0)
        for body in bodies
        for gear in body.gears
    ]
    radius = max([0.5 * MM * abs(diameter) for diameter in diameters], default=0.0) or LEAST_RADIUS
    return float(f"{RIGID['radial_stiffness'] * radius**2:.2g}")


def joint_blocks(bodies: RigidGroups, bearings: dict[str, Block], gear_places: dict[str, float]) -> dict[str, Block]:
    """Joints of the variant `rigid`: one for each body, in the middle of its bearings, or at its gear."""
    blocks = {}
    for body in bodies.members:
        if body.fixed:
            continue
        held = [
            bearing.entries["z_mm"].value for bearing in bearings.values() if bearing.entries["body"].value == body.name
        ]
        place = sum(held) / len(held) if held else gear_places.get(body.name, 0.0)
        entries = {"body": Entry(body.name)}
        if body.carrier:
            entries["on"] = Entry(body.carrier)
        entries["z_mm"] = derived(tidy(round(place, 6)), "middle of its bearings" if held else "middle of its gear")
        blocks[body.name] = Block("", entries)
    return blocks


def _flexible_connections(model: Model, bodies: RigidGroups) -> Iterator[tuple[Component, RigidGroup, RigidGroup]]:
    """Yield couplings and fits between two separate bodies, once for equal planets."""
    for part, *both in connections(model):
        inner, outer = (bodies.of(end) for end in both)
        if not is_one_piece(part) and inner is not None and outer is not None and inner is not outer:
            yield part, inner, outer


def _bearing(
    model: Model, places: ComponentPositions, bodies: RigidGroups, part: Component, notes: Notes
) -> Block | None:
    both = ends(model, part)
    if both is None:
        raise RexsError(f"{part}: no relation 'side' defines the supported and the supporting body")
    inner, outer = (None if end.type == "gear_casing" else bodies.body_of(end) for end in both)
    if any(body is not None and bodies.of(end) is None for end, body in zip(both, (inner, outer), strict=True)):
        return None  # on a planet equal to the first
    inner, outer = (None if body is not None and body.fixed else body for body in (inner, outer))
    if inner is outer:
        notes.lost.append(f"{part}: supports no rotating body, or both of its rings are on one body")
        return None
    if inner is None or (outer is not None and outer.carrier == inner.name):
        inner, outer = outer, inner
    if inner is None:
        return None
    for side, shaft in zip(("inner", "outer"), both, strict=True):
        along = part.quantity(f"u_coordinate_on_shaft_{side}_side")
        if along is None or shaft.type != "shaft" or not shaft.given("support_vector"):
            continue
        expected = places.position(shaft)[2] + places.sense(shaft) * along
        if abs(expected - places.position(part)[2]) > PLACE_TOLERANCE:
            notes.checked.append(
                f"{part}: z = {places.position(part)[2]:g} mm from support_vector (used), {expected:g} mm from "
                f"u_coordinate_on_shaft_{side}_side"
            )
    inside = _support(model, part, places.sense(both[0]), notes)
    block = _placed(places, part, inner, outer, inside)
    if "designation" in inside:
        block.entries["designation"] = inside["designation"].entries["designation"]
        block.blocks.clear()
    if outer is None and bodies.of(both[0]) is None:
        block.entries["outer_ring"] = read("body", "outer_part rotates")
    return block


def _placed(
    places: ComponentPositions, part: Component, body: RigidGroup, on: RigidGroup | None, inside: dict[str, Block]
) -> Block:
    entries = {"body": Entry(body.name)}
    if on is not None and not on.fixed:
        entries["on"] = Entry(on.name)
    entries["z_mm"] = read(places.position(part)[2], "support_vector")
    return Block(str(part), entries, inside, part.number)


def _support(model: Model, part: Component, sense: int, notes: Notes) -> dict[str, Block]:
    """Return the stiffness or catalogue data of a bearing, or only its designation."""
    if part.type == "concept_bearing":
        entries = _stiffness(part, notes)
        if not entries:
            raise RexsError(f"{part}: has no radial, axial or tilting stiffness")
        return {"stiffness": Block("", entries)}
    kind = ROLLING_TYPES.get(part.text("bearing_type"))
    sizes = _sizes(part, kind, notes)
    rows = part.whole("number_of_bearing_rows") or len(model.parts_of(part, "rolling_bearing_row")) or 1
    paired = rows > 1 and kind in CONTACT_ANGLES_DEG and kind not in ("spherical_roller", "self_aligning_ball")
    arrangement = _arrangement(model, part, sense) if paired and rows == 2 and kind in ARRANGED else {}
    if kind and sizes and (arrangement or not paired):
        catalogue = _catalogue(model, part, kind, rows, sense, sizes, notes, arrangement)
        return {"catalogue": Block("", catalogue), **_rib_stiffness(part, catalogue)}
    if not sizes and part.quantity("radial_stiffness"):
        return {"stiffness": Block("", _stiffness(part, notes))}
    if not kind:
        why = f"a {part.text('bearing_type') or part.type} has no bearing model; set its stiffness"
    elif paired:
        why = (
            f"a bearing of {rows} rows with contact angles, whose orientation is not defined by "
            "axial_force_absorption_of_row; set its catalogue with arrangement X, O or tandem"
        )
    else:
        why = "no dimensions in the file or in the built-in tables; set its catalogue data or its stiffness"
    notes.changed.append(f"{part}: BLANK, {why}; until then only the variant rigid runs")
    name = _designation(part)
    if boundary_of(name) is not None:  # its dimensions are not those of a bearing that can be modelled
        name = f"not modelled: {name}"
    return {"designation": Block("", {"designation": Entry(name, f"BLANK: {why}")})}


def _arrangement(model: Model, part: Component, sense: int) -> dict[str, Entry]:
    """Arrangement of two rows, from the direction in which each locates the inner ring; empty if a row has no value.

    The order of rows is along the u axis of the shaft. If the first row supports a ring pushed against u, and the
    second one a ring pushed along u, the arrangement is X: the pressure lines converge towards the middle. For a shaft
    of opposite direction the order and both directions are reversed, so that X remains X.
    """
    rows = model.parts_of(part, "rolling_bearing_row")
    held = [row.text("axial_force_absorption_of_row") for row in rows]
    source = "axial_force_absorption_of_row, in the order of the rows"
    if held in (["negative", "positive"], ["positive", "negative"]):
        found = {"arrangement": read("X" if held[0] == "negative" else "O", source)}
    elif held in (["positive", "positive"], ["negative", "negative"]):
        found = {"arrangement": read("tandem", source), "locates_towards": read(_direction(held[0], sense), source)}
    else:
        return {}
    found |= entries_of(READ["row distance"], part)
    if found["arrangement"].value != "tandem":
        found |= entries_of(READ["preload"], part)
    return found


def _rib_stiffness(part: Component, catalogue: Mapping[str, Entry]) -> dict[str, Block]:
    """Axial stiffness of the ribs of cylindrical rollers from the file, which catalogue data do not cover."""
    value = part.quantity("axial_stiffness")
    if not value or catalogue["type"].value not in CYLINDERS or "ribs" in catalogue:
        return {}
    stiffness = read(tidy(value), "axial_stiffness")
    if value >= RIGID_ABOVE["axial_stiffness"]:
        stiffness = assumed(RIGID["axial_stiffness"], f"axial_stiffness of {value:g} means rigid")
    return {"stiffness": Block("", {"axial_N_per_m": stiffness})}


def _sizes(part: Component, kind: str | None, notes: Notes) -> dict[str, Entry]:
    """Boundary dimensions from the file, or else from the designation; empty if neither defines them."""
    given = entries_of(READ["bearing size"], part)
    if len(given) == len(READ["bearing size"]):
        return given
    boundary = boundary_of(_designation(part))
    if boundary is None or boundary.type != kind:
        return {}
    source = f"{boundary.source} from the designation {_designation(part)}: no dimensions in the file"
    notes.changed.append(f"{part}: {boundary.bore:g} x {boundary.outer:g} x {boundary.width:g} mm by {source}")
    sizes = {"bore_mm": boundary.bore, "outer_diameter_mm": boundary.outer, "width_mm": boundary.width}
    return {key: assumed(value, source) for key, value in sizes.items()}


def _designation(part: Component) -> str:
    return plain(part.text("catalogue_designation") or part.text("name") or part.name or part.type, 60)


def _catalogue(
    model: Model,
    part: Component,
    kind: str,
    rows: int,
    sense: int,
    sizes: Mapping[str, Entry],
    notes: Notes,
    arrangement: Mapping[str, Entry],
) -> dict[str, Entry]:
    if arrangement:  # the catalogue section has the width of one of the two bearings
        sizes = {**sizes, "width_mm": derived(tidy(0.5 * sizes["width_mm"].value), "width, for each of two rows")}
    entries = {
        "type": read(kind, f"bearing_type {part.text('bearing_type')}"),
        "designation": Entry(_designation(part)),
        **sizes,
    }
    row = next(iter(model.parts_of(part, "rolling_bearing_row")), None)
    angle = abs((row or part).quantity("pressure_angle") or 0.0)
    if kind in CONTACT_ANGLES_DEG and CONTACT_ANGLES_DEG[kind][0] <= angle <= CONTACT_ANGLES_DEG[kind][1]:
        entries["contact_angle_deg"] = read(tidy(angle), "pressure_angle of its row")
    if not arrangement and (rows > 1 or part.text("bearing_type") == "radial_spherical_roller_bearing"):
        entries["row_count"] = read(rows, "number_of_bearing_rows")
    if row is not None:
        entries |= _elements(model, row, kind, notes)
    entries |= arrangement
    entries |= entries_of(READ["clearance"], part)
    entries |= entries_of(READ["axial rating"] if kind == "thrust_spherical_roller" else READ["radial rating"], part)
    limit, static = (entries.get(key) for key in ("fatigue_load_limit_kN", "static_rating_kN"))
    if limit is not None and static is not None and limit.value >= static.value:
        notes.changed.append(
            f"{part}: fatigue_limit_load of {limit.value:g} kN is above its static rating and is not imported"
        )
        del entries["fatigue_load_limit_kN"]
    if not arrangement:
        _note_axial(part, kind, sense, entries, notes)
    return entries


def _note_axial(part: Component, kind: str, sense: int, entries: dict[str, Entry], notes: Notes) -> None:
    """Add the axial locating direction of a bearing, or a note if the model of its type locates in both directions."""
    absorbed = part.text("axial_force_absorption")
    one_way = absorbed in ("positive", "negative")
    towards = read(_direction(absorbed, sense), f"axial_force_absorption {absorbed}")
    if kind in TYPES_OF_KEYS["locates_towards"][0] and one_way:
        entries["locates_towards"] = towards
    elif kind in CYLINDERS:
        if absorbed == "both_directions" and not part.quantity("axial_stiffness"):
            entries["ribs"] = read("both", "axial_force_absorption both_directions")
        elif one_way:
            entries["ribs"] = towards
    elif one_way or absorbed == "no_direction":
        notes.changed.append(
            f"{part}: axial_force_absorption {absorbed}, but the model of a {kind} locates in both directions"
        )


def _direction(absorbed: str, sense: int) -> str:
    """Return the direction along z for one along the u axis, which has a sense."""
    return "+z" if (absorbed == "positive") == (sense > 0) else "-z"


def _elements(model: Model, row: Component, kind: str, notes: Notes) -> dict[str, Entry]:
    """Return number, dimensions and curvatures of the rolling elements, as far as specified; at most as many as fit."""
    entries = {}
    count = row.whole("number_of_rolling_elements")
    if count:
        entries["element_count"] = read(count, "number_of_rolling_elements")
    element = next(iter(model.parts_of(row, "rolling_element")), None)
    entries |= entries_of(READ["rolling element"], element)
    if kind not in TYPES_OF_KEYS["element_length_mm"][0]:
        entries.pop("element_length_mm", None)
    entries |= entries_of(READ["bearing row"], row)
    diameter, pitch = (entries.get(key) for key in ("element_diameter_mm", "pitch_diameter_mm"))
    if count and diameter is not None and pitch is not None and 0.0 < diameter.value < pitch.value:
        most = int(math.pi / math.asin(diameter.value / pitch.value))
        if count > most:
            fitting = f"{count} of {diameter.value:g} mm do not fit on {pitch.value:g} mm"
            notes.changed.append(f"{row}: {fitting}, {most} rolling elements used; ratings of the file are kept")
            entries["element_count"] = assumed(most, fitting)
    for key, dividend, divisor, limits in RATIOS:
        over, under = (
            next((value for part in (row, element) if part is not None and (value := part.quantity(name))), None)
            for name in (dividend, divisor)
        )
        if not over or not under or kind not in TYPES_OF_KEYS[key][0]:
            continue
        if limits[0] <= over / under <= limits[1]:
            entries[key] = derived(tidy(round(over / under, 6)), f"{dividend} over {divisor}")
        else:
            notes.changed.append(
                f"{row}: {dividend} over {divisor} is {over / under:.4g}, which is impossible; the usual {key} is used"
            )
    return entries


def _stiffness(part: Component, notes: Notes) -> dict[str, Entry]:
    """Isotropic stiffness of a concept bearing or coupling; values that mean rigid are limited.

    Directions without a value count as rigid in a connection that is rigid in torsion.
    """
    entries = {}
    was_rigid = part.type in JOINING and is_rigid_in_torsion(part)
    absorbed = part.text("axial_force_absorption")
    for row in READ["stiffness"]:
        key = row.attribute
        value = part.quantity(key)
        value = None if value is None else row.factor * value
        if key == "radial_stiffness" and part.flag("radial_force_absorption") is False:
            continue
        if value is None and (key == "bending_stiffness" or part.type in JOINING) and not was_rigid:
            continue
        if key == "axial_stiffness":
            one_way = absorbed in ("positive", "negative")
            if absorbed == "no_direction" or (
                value is None and not (one_way or absorbed == "both_directions" or was_rigid)
            ):
                continue
            if one_way:
                notes.changed.append(f"{part}: locates the axis {absorbed} along u only, here in both directions")
        if value is None:
            entries[row.key] = assumed(RIGID[key], "not in the file")
        elif value >= RIGID_ABOVE[key]:
            entries[row.key] = assumed(RIGID[key], f"{key} of {value:g} means rigid")
        elif value > 0.0:
            entries[row.key] = read(tidy(value), key)
    return entries
