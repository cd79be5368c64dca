"""Conversion of a REXS file to a gearbox file; all errors are reported together, and assumptions are marked."""

from __future__ import annotations

import dataclasses
import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from exugear.exchange.rexs.mapping import (
    GEARS,
    JOINING,
    OTHER_GEARS,
    OWN,
    READ_TYPES,
    TYPES_OF_ROLES,
    TYPES_WITHOUT_EFFECT,
)
from exugear.exchange.rexs.to_case.bodies import RigidGroup, RigidGroups, find_bodies
from exugear.exchange.rexs.to_case.gear_blocks import (
    Teeth,
    axes_to_move,
    gear_blocks,
    mesh_blocks,
    pair_blocks,
    teeth_of,
)
from exugear.exchange.rexs.to_case.loads import (
    Ends,
    ImportedLoads,
    ends_of,
    force_blocks,
    life_blocks,
    load_case_blocks,
    loads_of,
    static_load,
)
from exugear.exchange.rexs.to_case.notes import (
    Block,
    ComponentPositions,
    Entry,
    Notes,
    Rules,
    assumed,
    derived,
    read,
    tidy,
    toml_text,
)
from exugear.exchange.rexs.to_case.shafts import (
    Cylinder,
    gear_tube,
    inertia_of,
    is_continuous,
    levelled,
    plate,
    seat_diameter,
    sections_of,
)
from exugear.exchange.rexs.to_case.supports import bearing_blocks, coupling_blocks, joint_blocks
from exugear.exchange.rexs.to_case.toothing import is_rigid, material_of, material_table
from exugear.exchange.rexs.tree import Model, RexsError, plain
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.system.gearbox_checks import check_parts
from fe_ste.tools.display import ReprMixin

INERTIAS = "geometry"
"""Name of the inertia set."""


def sections_of_bodies(
    model: Model, places: ComponentPositions, bodies: RigidGroups, notes: Notes
) -> dict[str, Sequence[Cylinder]]:
    """Shaft sections of each body, in the order of z."""
    found: dict[str, Sequence[Cylinder]] = {}
    for body in bodies.members:
        pieces: list[Cylinder] = []
        for shaft in body.parts_of_type("shaft"):
            with notes.errors.gathered():
                pieces += sections_of(model, places, shaft, body, notes)
        found[body.name] = sorted(pieces, key=lambda cylinder: cylinder.start)
    return found


def levelled_under_seats(
    sections: Mapping[str, Sequence[Cylinder]], teeth: Teeth, bearings: Mapping[str, Block], notes: Notes
) -> dict[str, Sequence[Cylinder]]:
    """Shaft sections of each body, with nearly uniform diameters made uniform under gears and catalogue bearings."""
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


def _body_block(
    model: Model, places: ComponentPositions, body: RigidGroup, teeth: Teeth, sections: Sequence[Cylinder], notes: Notes
) -> Block:
    """Table of a body with its inertia and shape."""
    block = Block(", ".join(str(part) for part in body.parts))
    if body.carrier:
        block.entries["carrier"] = Entry(body.carrier)
        block.entries["orbit_radius_mm"] = read(body.orbit, "support_vector of the planet shafts")
        angles = [tidy(round(angle, 6)) for angle in body.angles]
        block.entries["planet_angles_deg"] = read(angles, "support_vector")
    else:
        block.entries["axis_position_mm"] = read([*body.axis], "support_vector")
    wheels = [number for number, owner in teeth.bodies.items() if owner is body]
    if wheels:
        z = {teeth.names[number]: teeth.z[number] for number in wheels}
        block.entries["gears_z_mm"] = read(z, "support_vector of the gears")
    if body.fixed:
        block.entries["fixed"] = read(True, "joined with the casing")
        return block
    tubes = {}
    for number in wheels:
        gear = teeth.gears[number]
        seat = seat_diameter(sections, teeth.z[number], gear.face_width.value, gear.internal)
        tubes[number] = gear_tube(model, gear, teeth.z[number], seat, notes)
    plates = [
        one for part in body.parts_of_type("side_plate") if (one := plate(model, places, part, notes)) is not None
    ]
    pieces = [*sections, *tubes.values(), *plates]
    inertia = inertia_of(pieces)
    if inertia.mass <= 0.0:
        raise RexsError(f"{body.parts[0]}: inertia is not defined by sections, gears or plates")
    made_of = [
        f"{len(found)} {name}{'s' if len(found) > 1 else ''}"
        for name, found in (("section", sections), ("gear tube", tubes), ("plate", plates))
        if found
    ]
    entries = {key: derived(value, "likewise") for key, value in _mass_entries(pieces).items()}
    entries["mass_kg"] = derived(entries["mass_kg"].value, f"computed here from {', '.join(made_of)}")
    entries["centre_of_mass_z_mm"] = derived(tidy(round(1e3 * inertia.centre, 4)), "likewise")
    block.blocks[f"inertia.{INERTIAS}"] = Block("", entries)
    if _has_shape(model, body, sections):
        block.entries["flexibility"] = derived("elastic", "in the variant flexible: its sections in sequence")
        block.blocks["shape"] = _shape(model, body, sections)
        blanks = {
            teeth.names[number]: derived(
                _mass_entries([tube]), f"{tube.outers[0]:.4g} x {tube.inners[0]:.4g} x {tube.length:g} mm"
            )
            for number, tube in tubes.items()
            if inertia_of([tube]).mass > 0.0
        }
        if blanks:
            block.blocks["shape.blanks"] = Block("gears as hollow cylinders from seat to reference diameter", blanks)
    return block


def _mass_entries(pieces: Sequence[Cylinder]) -> dict[str, float]:
    """Mass and moments of inertia of pieces; the transverse one at least that of a thin disc."""
    inertia = inertia_of(pieces)
    transverse = max(inertia.transverse, 0.5 * inertia.axial * (1.0 + 1e-5))
    values = {"mass_kg": inertia.mass, "axial_kg_m2": inertia.axial, "transverse_kg_m2": transverse}
    return {key: float(f"{value:.6g}") for key, value in values.items()}


def _has_shape(model: Model, body: RigidGroup, sections: Sequence[Cylinder]) -> bool:
    """Return whether the sections of a body form one flexible shaft."""
    shafts = [part for part in body.parts_of_type("shaft") if part.given("support_vector")]
    materials = [material_of(model, shaft) for shaft in shafts]
    rigid = any(map(is_rigid, materials))
    plain_shaft = (
        not body.carrier and not body.parts_of_type("side_plate") and all(section.aside == 0.0 for section in sections)
    )
    return plain_shaft and not rigid and len(set(materials)) == 1 and is_continuous(sections)


def _shape(model: Model, body: RigidGroup, sections: Sequence[Cylinder]) -> Block:
    pieces = []
    for cylinder in sections:
        piece = {"length_mm": cylinder.length, "outer_diameter_mm": cylinder.outers[0]}
        if cylinder.inners[0]:
            piece["inner_diameter_mm"] = cylinder.inners[0]
        if cylinder.outers[1] != cylinder.outers[0]:
            piece["outer_diameter_end_mm"] = cylinder.outers[1]
        if cylinder.inners[1] != cylinder.inners[0]:
            piece["inner_diameter_end_mm"] = cylinder.inners[1]
        pieces.append(piece)
    entries = {
        "start_z_mm": read(sections[0].start, "support_vector of the shaft"),
        "sections": read(pieces, "shaft_section"),
    }
    material = material_table(material_of(model, body.parts_of_type("shaft")[0]))
    if material is not None:
        entries["material"] = material
    return Block("", entries)


def meshes_of_bodies(teeth: Teeth) -> dict[str, int]:
    """Count the meshes of each rotating body other than planets, in the order of the stages."""
    counts: dict[str, int] = {}
    for stage in teeth.stages.values():
        for number in stage.both:
            body = teeth.bodies[number]
            if not body.fixed and not body.carrier:
                counts[body.name] = counts.get(body.name, 0) + 1
            if body.carrier:
                counts[body.carrier] = 1
    return counts


def gear_places(teeth: Teeth, bodies: RigidGroups) -> dict[str, float]:
    """Axial middle of the first gear of each body, or of the planets of a carrier, mm."""
    found: dict[str, float] = {}
    for number, body in teeth.bodies.items():
        found.setdefault(body.name, teeth.z[number])
    for body in bodies.members:
        if body.carrier and body.name in found:
            found.setdefault(body.carrier, found[body.name])
    return {name: z for name, z in found.items() if math.isfinite(z)}


SPEED_TOLERANCE = 1e-3
"""Largest relative difference between a speed in the file and the kinematic speed."""
_SHAPE_ERROR = re.compile(r"bodies\.(\w+)\.shape: (.*)")


@dataclass(frozen=True)
class Found(ReprMixin, line=" in {model!r}: {bodies!r}"):
    """Content of a REXS file found by an import, with the names of the gearbox file."""

    model: Model
    places: ComponentPositions
    bodies: RigidGroups
    teeth: Teeth
    bearings: Mapping[str, Block]


@dataclass(frozen=True)
class Imported(ReprMixin, line=" {gearbox!r}: {changed!n} assumptions, {ignored!n} left out"):
    """Result of an import."""

    text: str
    """Text of the gearbox file with its comments."""
    gearbox: Gearbox
    changed: tuple[str, ...]
    """Values that were replaced, and important assumptions."""
    ignored: tuple[str, ...]
    """Omitted content in the order of its effect: `lost`, and then content that affects no result here."""
    lost: tuple[str, ...]
    """Omitted content that loads, moves or supports the gearbox."""
    checked: tuple[str, ...]
    """Comparisons of values that the file contains twice."""
    found: Found
    """Components from which the parts of the gearbox file originate."""
    spectrum: str
    """Table of the life loads, to be stored in the folder of the gearbox file as
    `exugear.exchange.rexs.to_case.loads.SPECTRUM`; empty if the file has insufficient data.
    """


def to_case(model: Model, source: str, path: str | Path = "gearbox.toml", rules: Rules | None = None) -> Imported:
    """Convert a REXS model to a gearbox file and check it; comments name the `source`, messages the `path`.

    Raises
    ------
    RexsError
        The model cannot be imported; the reasons are one sentence each.
    """
    notes = Notes(rules or Rules())
    # Some programs pair shaft and hub of a spline like the gears of a stage; the spline itself states what it connects.
    splines = {part.number for part in model.components_of_type(*JOINING)}
    relations = (one for one in model.relations if one.type != "stage" or one.roles.get("stage") not in splines)
    model = dataclasses.replace(model, relations=tuple(relations))
    for begin, words in OTHER_GEARS.items():
        parts = [part for part in model.components.values() if part.type.startswith(f"{begin}_")]
        parts = [part for part in parts if part.type.endswith(("_gear", "_wheel", "_stage"))]
        if parts:
            names = ", ".join(str(part) for part in parts)
            notes.errors.append(f"{names}: {words} cannot be imported, only cylindrical gears on parallel axes")
    notes.errors.tell()
    if not any(True for _ in model.relations_of("stage")) or not model.components_of_type(*GEARS):
        notes.errors.append("the file has no stage of two cylindrical gears; nothing to import")
    _refuse_misplaced(model, notes)
    notes.errors.tell()
    places = ComponentPositions(model)
    draft = _GearboxDraft(model, places, notes)
    notes.errors.tell()
    static = draft.static.value[draft.ends.input]
    draft.leave_stiff(source, path)
    gearbox = draft.checked(draft.text(source, {}), path)
    ratio = gearbox.train.ratio
    cases = load_case_blocks(draft.loads, draft.ends, static, ratio)
    met = [number for stage in draft.teeth.stages.values() for number in stage.both]
    gears = {name: (model.components[number], met.count(number) > 1) for number, name in draft.teeth.names.items()}
    life = life_blocks(model, draft.loads, draft.ends, ratio, gears)
    draft.settings |= life.blocks
    _compare_speeds(gearbox, draft.loads, draft.ends, notes)
    notes.errors.tell()
    _note_ignored(model, notes)
    text = draft.text(source, cases)
    gearbox = draft.checked(text, path)
    changed, lost, checked = (tuple(dict.fromkeys(lines)) for lines in (notes.changed, notes.lost, notes.checked))
    ignored = (*lost, *notes.ignored)
    return Imported(text, gearbox, changed, ignored, lost, checked, draft.found, life.spectrum)


def _refuse_misplaced(model: Model, notes: Notes) -> None:
    """Report relations in which a component has the wrong type for its role, as results from wrong ids."""
    for relation in model.relations:
        for role, number in relation.roles.items():
            wanted = TYPES_OF_ROLES.get((relation.type, role))
            if wanted is not None and model.components[number].type not in wanted:
                notes.errors.append(
                    f"a relation '{relation.type}' has {model.components[number]} as {role}; expected a component of "
                    f"type {' or '.join(wanted[:3])}: correct the id"
                )


class _GearboxDraft:
    """All tables of the gearbox file except the load cases."""

    def __init__(self, model: Model, places: ComponentPositions, notes: Notes) -> None:
        self.model, self.notes = model, notes
        bodies, self.teeth = _placed(model, places, notes)
        bearings = bearing_blocks(model, places, bodies, notes)
        self.found = Found(model, places, bodies, self.teeth, bearings)
        sections = sections_of_bodies(model, places, bodies, notes)
        sections = levelled_under_seats(sections, self.teeth, bearings, notes)
        self.loads = loads_of(model, places, bodies, notes)
        self.ends = ends_of(model, bodies, self.loads, meshes_of_bodies(self.teeth))
        self.static = static_load(self.loads, self.ends)
        gears = gear_blocks(model, self.teeth, sections, notes)
        body_blocks = {}
        for body in bodies.members:
            with notes.errors.gathered():
                body_blocks[body.name] = _body_block(model, places, body, self.teeth, sections[body.name], notes)
        joints = joint_blocks(bodies, bearings, gear_places(self.teeth, bodies))
        self.groups = [
            ("gears", _named("gears", gears)),
            ("pairs", _named("pairs", pair_blocks(self.teeth))),
            ("bodies", _named("bodies", body_blocks)),
            ("meshes", _named("meshes", mesh_blocks(self.teeth))),
            ("forces on bodies", _named("forces", force_blocks(self.loads, self.ends, notes))),
            ("couplings", _named("couplings", coupling_blocks(model, bodies, bearings))),
            ("variant `rigid`: ideal joints", _named("joints", joints)),
            ("variants `bushing` and `flexible`: bearings", _named("bearings", bearings)),
        ]
        at_output = (n for n, body in self.teeth.bodies.items() if body.name == self.ends.output)
        gear = next(at_output, next(iter(self.teeth.names)))
        self.settings = _settings(model, places, self.ends, self.static, self.teeth.names[gear])

    def checked(self, text: str, path: str | Path) -> Gearbox:
        """Read the gearbox file and build its parts; errors name the REXS components concerned.

        Raises
        ------
        RexsError
            The gearbox is impossible.
        """
        content: dict[str, Any] = tomllib.loads(text)
        try:
            gearbox = Gearbox.from_dict(content, str(path))
            check_parts(gearbox)
        except GearboxFileError as error:
            blocks = {name: block.comment for _, group in self.groups for name, block in group.items() if block.comment}
            errors = []
            for line in (line.removeprefix(f"{path}: ") for line in error.errors):
                words = {*re.split(r"[^\w.]", line), *re.split(r"\W", line)}
                named = [name for name in blocks if name in words or name.split(".")[1] in words]
                components = "; ".join(f"{name} is {blocks[name]}" for name in named)
                errors.append(f"{line} ({components})" if components else line)
            raise RexsError(*errors) from None
        return gearbox

    def leave_stiff(self, source: str, path: str | Path) -> None:
        """Set bodies to rigid in all variants if their shape cannot contain the seats, and record the reason."""
        try:
            self.checked(self.text(source, {}), path)
        except RexsError as error:
            found = (_SHAPE_ERROR.search(line) for line in error.errors)
            reasons = {match[1]: match[2] for match in found if match}
        else:
            return
        blocks = dict(self.groups)["bodies"]
        for body, reason in reasons.items():
            self.notes.changed.append(f"bodies.{body}: also rigid in the variant flexible: {reason}")
            blocks[f"bodies.{body}"].entries["flexibility"] = assumed("none", "its sections define no seats, see above")

    def text(self, source: str, cases: Mapping[str, Block]) -> str:
        if not cases:
            torque = {self.ends.input: self.static.value[self.ends.input]}
            cases = {"draft": Block("", {"torques_N_m": Entry(torque)})}
        units = self.model.components_of_type("gear_unit")
        name = plain(units[0].name) if units and units[0].name else ""
        title = f"{Path(source).stem}" + (f": {name}" if name else "")
        top = {"name": Entry(plain(title, 200)), "default_inertias": Entry(INERTIAS)}
        groups = [("", self.settings), *self.groups, ("load cases", _named("load_cases", cases))]
        return toml_text(_head(self.model, source, self.notes), top, groups)


def _placed(model: Model, places: ComponentPositions, notes: Notes) -> tuple[RigidGroups, Teeth]:
    """Bodies and gears at positions that agree with the selected centre distances."""
    first = Notes(notes.rules)
    bodies = find_bodies(model, places, first)
    teeth = teeth_of(model, places, bodies, first)
    moves = axes_to_move(teeth, bodies, places)
    if moves:
        notes.changed += [line for line in first.changed if "axes are moved" in line]
        for parts, by in moves:
            places.move(parts, by)
    bodies = find_bodies(model, places, notes)
    return bodies, teeth_of(model, places, bodies, notes)


def _named(table: str, blocks: Mapping[str, Block]) -> dict[str, Block]:
    return {f"{table}.{name}": block for name, block in blocks.items()}


def _settings(model: Model, places: ComponentPositions, ends: Ends, static: Entry, gear: str) -> dict[str, Block]:
    blocks = {
        "overall": Block(
            "", {"input": derived(ends.input, ends.reason), "output": Entry(ends.output), "output_gear": Entry(gear)}
        ),
        "static_load": Block(
            "the state that tables are computed for",
            {"torques_N_m": static, "locked": derived([ends.output], "the output balances the input")},
        ),
        "damping": Block(
            "percent of critical damping; measured gearboxes have 1 to 4",
            {"modal_percent": assumed(2.0, "usual value"), "modal_band_percent": assumed([1.0, 4.0], "usual range")},
        ),
    }
    for unit in model.components_of_type("gear_unit")[:1]:
        direction = np.array([unit.quantity(f"direction_vector_gravity_{axis}") or 0.0 for axis in "uvw"])
        if unit.flag("account_for_gravity") and np.linalg.norm(direction) > 0.0:
            size = unit.quantity("gravitational_acceleration") or 9.81
            vector = places.turned(direction / np.linalg.norm(direction)) * size
            entry = read([tidy(round(value, 9)) for value in vector.tolist()], "direction_vector_gravity")
            blocks["gravity"] = Block("", {"acceleration_m_per_s2": entry})
    return blocks


def _head(model: Model, source: str, notes: Notes) -> list[str]:
    """Comment at the beginning: origin, meaning of the marks, and essential information for the reader."""
    lines = [
        f"Imported from {plain(Path(source).name)}: REXS {model.version}, written by {plain(model.program)}.",
        "The comment after each value is its attribute, the comment after each table its component.",
        "D: computed from values of the file. A: assumed, not in the file. Check all A.",
        "Axes: z along the shafts, x and y are v and w of the gear unit; mm.",
    ]
    for title, found in (
        ("Replaced or assumed", notes.changed),
        ("Defined twice, compared", notes.checked),
        ("Left out", [*notes.lost, *notes.ignored]),
    ):
        if found:
            lines += ["", f"{title}:", *(f"- {plain(line, 2000)}" for line in dict.fromkeys(found))]
    return lines


def _note_ignored(model: Model, notes: Notes) -> None:
    """List the component types that were not read, and the unused attributes of the others."""
    kinds = sorted({part.type for part in model.components.values()})
    for kind in kinds:
        if kind not in READ_TYPES:
            lines = (notes.lost, notes.ignored)[kind in TYPES_WITHOUT_EFFECT]
            lines.append(f"{plain(kind)}, {len(model.components_of_type(kind))} of them")
    for kind in kinds:
        parts = model.components_of_type(kind)
        keys = {key for part in parts for key in part.attributes if not key.startswith(OWN)}
        unread = keys - {key for part in parts for key in part.asked}
        if kind in READ_TYPES and unread:
            notes.ignored.append(f"{kind}: {', '.join(plain(key) for key in sorted(unread))}")


def _compare_speeds(gearbox: Gearbox, loads: Sequence[ImportedLoads], ends: Ends, notes: Notes) -> None:
    """Compare the speeds that the file specifies for several bodies with the kinematic speeds."""
    if gearbox.train.degrees_of_freedom != 1:
        return
    mode = dict(zip(gearbox.spinning, gearbox.train.kinematic_modes[:, 0].tolist(), strict=True))
    for load_case in loads:
        base = load_case.speeds.get(ends.input)
        for body, speed in load_case.speeds.items():
            if not base or body == ends.input or body not in mode:
                continue
            rolls = base * mode[body] / mode[ends.input]
            notes.checked.append(
                f"{load_case.name}: {body} rotates at {speed:.6g} rpm, kinematics result in {rolls:.6g} rpm"
            )
            if abs(rolls - speed) > SPEED_TOLERANCE * max(abs(rolls), abs(speed)):
                notes.errors.append(
                    f"{load_case.name}: the file has {body} at {speed:g} rpm, but with {ends.input} at {base:g} rpm "
                    f"the kinematics result in {rolls:g} rpm"
                )
