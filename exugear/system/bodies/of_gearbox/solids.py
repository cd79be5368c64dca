"""Solids of a gearbox: shapes and meshes from files, seats where gears, bearings and mounts sit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.named_files import LARGEST_SOLID
from exugear.gearbox.parts import Body
from exugear.gearbox.sections.bodies import SolidSeatSection, SolidSection
from exugear.system.bearings.supports import elastic_names, mounts_at_work
from exugear.system.bodies.finite_elements.solid_files import (
    GEOMETRY,
    MESHES,
    UNPERMITTED,
    SolidFile,
)
from exugear.system.bodies.finite_elements.solid_seats import SolidSeat
from exugear.system.bodies.of_gearbox.sections import blank_of, frame_of, material_of, seat_width
from exugear.system.bodies.reduced_body import Blank
from exugear.system.bodies.solids import SolidModel, reduction_file


@dataclass(frozen=True)
class SolidBody:
    """A solid of the gearbox file."""

    model: SolidModel
    """All that its reduction depends on."""
    main_seat: str
    sectors: Mapping[str, tuple[str, ...]]
    shared_seats: Mapping[str, str]
    """As in `exugear.system.bodies.of_gearbox.elastic_bodies.ElasticBody`."""


def solid_body(gearbox: Gearbox, name: str) -> SolidBody:
    """Everything that the gearbox file says of a body's solid; its file is there and may be read, but is not yet.

    Raises
    ------
    CaseError
        The body has no solid, its file is not there, in no format that is read, or lies where it may not, or a seat of
        something on it is missing or not known well enough.
    """
    body = gearbox.body(name)
    section = gearbox.case.bodies[body.family]
    key = f"bodies.{body.family}.solid"
    solid = section.solid
    if solid is None:
        raise gearbox.fault(f"bodies.{body.family}: no solid; give a [{key}] table")
    frame = frame_of(gearbox, body)
    if section.flexibility in ("nonrotating", "ffrf") and frame != "nonrotating":
        raise gearbox.fault(
            f"bodies.{body.family}.flexibility = {section.flexibility!r}: the body carries planets and is seen from "
            "its own turning frame; use 'elastic'"
        )
    file = SolidFile(
        gearbox.file(f"{key}.file", solid.file, LARGEST_SOLID),
        solid.length_unit_mm * 1e-3,
        (solid.element_size_mm or 0.0) * 1e-3,
        solid.elements_around,
        gearbox.permissions.scripts,
    )
    if not file.is_geometry and not file.is_mesh:
        endings = ", ".join((*GEOMETRY, *MESHES))
        raise gearbox.fault(f"{key}.file = {solid.file!r}: no format that is read; its name must end in {endings}")
    if file.is_geometry and solid.element_size_mm is None:
        raise gearbox.fault(f"{key}.element_size_mm: this key is missing; {solid.file} has to be meshed")
    band = solid.band_Hz or gearbox.case.elasticity.band_Hz
    if band >= gearbox.case.elasticity.limit_Hz:
        raise gearbox.fault(f"{key}.band_Hz = {band:g}: it must be below elasticity.limit_Hz")
    seats, sectors, shared = _solid_seats(gearbox, body, solid)
    names = [seat.name for seat in seats]
    if solid.torque_seat is not None and solid.torque_seat not in names:
        raise gearbox.fault(f"{key}.torque_seat = {solid.torque_seat!r}: no such seat; seats are {', '.join(names)}")
    model = SolidModel(
        name=name,
        mesh=file,
        material=material_of(solid.material),
        seats=tuple(seats),
        frame=frame,
        band=band,
        limit=gearbox.case.elasticity.limit_Hz,
        blanks=_solid_blanks(gearbox, body, solid, names),
        axis=body.axis,
    )
    return SolidBody(model, solid.torque_seat or names[0], sectors, shared)


@dataclass(frozen=True)
class _Item:
    """What sits on a solid: its position (m), and diameter and width (m) of its seat where they are known.

    `family` is its name in the file, `noun` what it is, `needed` whether there must be a seat for it.
    """

    family: str
    noun: str
    position: tuple[float, float, float]
    diameter: float | None
    width: float | None
    needed: bool = True


def _items(gearbox: Gearbox, body: Body) -> dict[str, _Item]:
    """All that sits on a body, by the name of its seat."""
    items = {}
    for name, z in body.wheels.items():
        gear = gearbox.gears[name]
        items[name] = _Item(name, "gear", (*body.axis, z), gear.held_diameter, gear.face_width)
    for bearing in gearbox.bearings:
        if body.name not in (bearing.body, bearing.on):
            continue
        diameter = None
        width = None
        if bearing.catalogue is not None:
            # A planet turns about its bearing, all other bodies in theirs.
            inside = (bearing.body == body.name) != bearing.carries_outer_ring
            diameter = 1e-3 * (bearing.catalogue.bore_mm if inside else bearing.catalogue.outer_diameter_mm)
            width = seat_width(bearing)
        items[bearing.name] = _Item(bearing.family, "bearing", bearing.position, diameter, width)
    at_work = {mount.name for mount in mounts_at_work(gearbox)}
    for mount in gearbox.mounts:
        if mount.body == body.name:
            items[mount.name] = _Item(mount.name, "mount", mount.position, None, None, mount.name in at_work)
    return items


def _solid_seats(
    gearbox: Gearbox, body: Body, solid: SolidSection
) -> tuple[list[SolidSeat], dict[str, tuple[str, ...]], dict[str, str]]:
    """Seats of a solid, the sectors of its gears, and the seats that bearings share."""
    key = f"bodies.{body.family}.solid.seats"
    items = _items(gearbox, body)
    families = {item.family for item in items.values()}
    sections = {name: solid.seats.get(name, solid.seats.get(item.family)) for name, item in items.items()}
    others = {name: section for name, section in solid.seats.items() if name not in items and name not in families}
    seats: list[SolidSeat] = []
    sectors: dict[str, tuple[str, ...]] = {}
    shared_seats: dict[str, str] = {}
    for name, section in (sections | others).items():
        item = items.get(name)
        if section is not None and section.same_as is not None:
            shared_seats[name] = section.same_as
        elif item is None or section is not None or item.needed:
            seat = _solid_seat(gearbox, f"{key}.{name}", name, item, section or SolidSeatSection())
            count = None if section is None else section.sectors
            if count is not None and (item is None or item.noun != "gear"):
                raise gearbox.fault(f"{key}.{name}.sectors = {count}: only the seat of a gear has sectors")
            parts = [seat] if count is None else _parts(seat, count)
            seats += parts
            if count is not None:
                sectors[name] = tuple(part.name for part in parts)
    names = [seat.name for seat in seats]
    doubled = next((name for name in names if names.count(name) > 1), None)
    if doubled is not None:
        raise gearbox.fault(f"{key}: two seats are both named {doubled!r}; rename one")
    for name, other in shared_seats.items():
        if other not in names:
            raise gearbox.fault(f"{key}.{name}.same_as = {other!r}: no such seat; seats are {', '.join(names)}")
    if not seats:
        raise gearbox.fault(f"{key}: nothing sits on the body; give at least one seat")
    return seats, sectors, shared_seats


def _solid_seat(gearbox: Gearbox, key: str, name: str, item: _Item | None, section: SolidSeatSection) -> SolidSeat:
    """One seat, from what the file says of it and what is known of the item on it."""
    diameter, width = (None, None) if item is None else (item.diameter, item.width)
    if section.diameter_mm is not None:
        diameter = 1e-3 * section.diameter_mm
    if section.width_mm is not None:
        width = 1e-3 * section.width_mm
    if section.inner_diameter_mm is not None:
        width = 0.0
    position = None if item is None else item.position
    if section.position_mm is not None:
        x, y, z = section.position_mm
        position = (1e-3 * x, 1e-3 * y, 1e-3 * z)
    given = (("diameter_mm", diameter), ("width_mm", width), ("position_mm", position))
    missing = [word for word, value in given if value is None]
    if missing or diameter is None or width is None or position is None:
        what = "a seat that no gear, bearing or mount of the body has the name of" if item is None else item.noun
        raise gearbox.fault(f"{key}: {what} {name!r} needs its seat; give {' and '.join(missing)} in [{key}]")
    return SolidSeat(name, position, diameter / 2.0, width, 0.5e-3 * (section.inner_diameter_mm or 0.0))


def _parts(seat: SolidSeat, count: int) -> list[SolidSeat]:
    """Equal sectors of a seat, numbered from 1, the first in the middle of +x."""
    extent = 2.0 * math.pi / count
    return [
        SolidSeat(f"{seat.name}_{n + 1}", seat.centre, seat.radius, seat.width, seat.inner_radius, (n * extent, extent))
        for n in range(count)
    ]


def _solid_blanks(gearbox: Gearbox, body: Body, solid: SolidSection, names: list[str]) -> dict[str, Blank]:
    """Blanks by seat; one given for a bearing of all planets goes on each of its seats."""
    families = {name: item.family for name, item in _items(gearbox, body).items()}
    blanks: dict[str, Blank] = {}
    for name, section in solid.blanks.items():
        on = [seat for seat in names if name in (seat, families.get(seat))]
        if not on:
            raise gearbox.fault(f"bodies.{body.family}.solid.blanks.{name}: no such seat; seats are {', '.join(names)}")
        blanks |= dict.fromkeys(on, blank_of(section))
    return blanks


def solids_of(gearbox: Gearbox) -> Iterator[tuple[str, SolidModel]]:
    """Key and model of each solid that the variant `flexible` takes; files are there, but none is read or run yet.

    Raises
    ------
    CaseError
        As `solid_body`.
    """
    for name in elastic_names(gearbox):
        family = gearbox.body(name).family
        if gearbox.case.bodies[family].solid is not None:
            yield f"bodies.{family}.solid", solid_body(gearbox, name).model


def check_solids(gearbox: Gearbox, folder: Path) -> None:
    """Refuse solids that cannot be taken, and scripts that would have to run and may not, before any work.

    Parameters
    ----------
    folder : where reductions are stored: a script whose reduction is there need not run

    Raises
    ------
    CaseError
        A script that may not run, or as `solid_body`.
    """
    for key, model in solids_of(gearbox):
        file: SolidFile = model.mesh
        if file.is_script and not file.scripts and not reduction_file(model, folder).is_file():
            raise gearbox.fault(f"{key}.file = {file.path.name!r}: {UNPERMITTED}")
