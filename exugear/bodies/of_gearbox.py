"""The elastic bodies of a gearbox: shapes and solids from the gearbox file, seats where gears and bearings sit.

The mass of a body that turns comes from its shape and the blanks on it. What the body's inertia set says beyond that
(or short of it) is spread over the rigid part of the motion, so that an elastic body accelerates and orbits exactly as
the rigid one does and only its deformation is new. A fixed body has no inertia set: its mass is that of its solid.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from exugear.bearings.supports import elastic_names, mounts_at_work
from exugear.bodies.floating import FloatingBody, load_or_reduce_floating, with_inertia
from exugear.bodies.reduced_body import Blank, Frame, ReducedBody, ReductionError, RigidInertia
from exugear.bodies.reduction import with_rigid_inertia
from exugear.bodies.solid_mesh import GEOMETRY, MESHES, UNPERMITTED, SolidError, SolidFile, turned_hexahedra
from exugear.bodies.solids import SolidModel, SolidSeat, kept_file, load_or_reduce_solid, reduce_solid
from exugear.bodies.turned_section import MeshSize, SeatBand, Shaft, ShaftError, ShaftSection, check_shaft
from exugear.bodies.turned_shaft import ShaftModel, load_or_reduce, reduce_shaft
from exugear.model.gearbox import Gearbox
from exugear.model.named_files import LARGEST_SOLID
from exugear.model.parts import Bearing, Body
from exugear.model.sections.bodies import BlankSection, ShapeSection, SolidSeatSection, SolidSection
from exugear.model.sections.gears import MaterialSection
from fe_ste.geometry.gears import Material

SOLID_SIZE = MeshSize(0.05, 0.05, 1)
"""Elements of a shaft as a solid: its vibrations come out up to 0.6 % too fast."""
TORQUE_SEAT = "torque"
"""Name of the seat where torques and couplings act."""


@dataclass(frozen=True)
class ElasticBody:
    """A reduced body of a gearbox.

    Attributes
    ----------
    reduced : with the rigid inertia of the body's inertia set
    own : rigid inertia of shape and blanks by themselves
    main : seat whose spin stands for the body: where torques act, else the first gear
    sectors : seats on equal sectors by internal gear, an odd number, the first about +x, then on towards +y
    shared : seat that a second bearing sits on, by the bearing
    floating : its modes in a frame that floats with it, for a body that moves so in Exudyn
    """

    reduced: ReducedBody
    own: RigidInertia
    main: str
    sectors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    shared: Mapping[str, str] = field(default_factory=dict)
    floating: FloatingBody | None = None


def shaft_model(gearbox: Gearbox, name: str) -> ShaftModel:
    """All that the reduction of a body's shaft depends on.

    Raises
    ------
    CaseError
        The body has no shape, or a shape that its gears and bearings do not fit on.
    """
    body = gearbox.body(name)
    shape = gearbox.case.bodies[body.family].shape
    if shape is None:
        raise gearbox.fault(f"bodies.{body.family}: no shape; give a [bodies.{body.family}.shape] table")
    if frame_of(gearbox, body) == "carrier":
        raise gearbox.fault(f"bodies.{body.family}.shape: the body carries planets; give a .solid table instead")
    start = shape.start_z_mm * 1e-3
    seats = tuple(SeatBand(seat, z - start, width) for seat, z, width in _seats(gearbox, body, shape))
    names = [seat.name for seat in seats]
    doubled = next((seat for seat in names if names.count(seat) > 1), None)
    if doubled is not None:
        raise gearbox.fault(f"bodies.{body.family}: a gear and a bearing on it are both named {doubled!r}; rename one")
    key = f"bodies.{body.family}.shape"
    unknown = next((blank for blank in shape.blanks if blank not in names), None)
    if unknown is not None:
        raise gearbox.fault(f"{key}.blanks.{unknown}: no such seat; seats are {', '.join(names)}")
    return ShaftModel(
        name=name,
        sections=tuple(
            ShaftSection(s.length_mm * 1e-3, s.outer_diameter_mm * 1e-3, s.inner_diameter_mm * 1e-3)
            for s in shape.sections
        ),
        material=_material(shape.material),
        origin=(*body.axis, start),
        seats=seats,
        blanks={seat: _blank(blank) for seat, blank in shape.blanks.items()},
        band=gearbox.case.elasticity.band_Hz,
        limit=gearbox.case.elasticity.limit_Hz,
    )


def _seats(gearbox: Gearbox, body: Body, shape: ShapeSection) -> Iterator[tuple[str, float, float]]:
    """Name, z and width (m) of each seat."""
    for gear, z in body.wheels.items():
        yield gear, z, gearbox.gears[gear].face_width
    for bearing in gearbox.bearings:
        if body.name in (bearing.body, bearing.on):
            yield bearing.name, bearing.position[2], _width(bearing)
    for mount in mounts_at_work(gearbox):
        if mount.body == body.name:
            yield mount.name, mount.position[2], 0.0
    if shape.torque_z_mm is not None:
        yield TORQUE_SEAT, shape.torque_z_mm * 1e-3, 0.0


def _width(bearing: Bearing) -> float:
    """Width of a bearing's seat (m): that of its rows; a plane where only a stiffness is given."""
    if bearing.catalogue is None:
        return 0.0
    rows = 1 if bearing.catalogue.arrangement == "single" else 2
    return rows * bearing.catalogue.width_mm * 1e-3


def _material(section: MaterialSection) -> Material:
    return Material(section.youngs_modulus_GPa * 1e9, section.poissons_ratio, section.density_kg_per_m3)


def _blank(section: BlankSection) -> Blank:
    return Blank(section.mass_kg, section.transverse_kg_m2, section.axial_kg_m2)


def frame_of(gearbox: Gearbox, body: Body) -> Frame:
    """Frame that an elastic body is seen from: the ground, its own that turns, or one that does not."""
    if body.fixed:
        return "ground"
    return "carrier" if any(other.carrier == body.name for other in gearbox.bodies()) else "nonrotating"


@dataclass(frozen=True)
class SolidBody:
    """A solid of the gearbox file.

    Attributes
    ----------
    model : all that its reduction depends on
    main, sectors, shared : as in `ElasticBody`
    """

    model: SolidModel
    main: str
    sectors: Mapping[str, tuple[str, ...]]
    shared: Mapping[str, str]


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
    key, solid = f"bodies.{body.family}.solid", section.solid
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
        material=_material(solid.material),
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
    """What sits on a solid: its place (m), and diameter and width (m) of its seat where they are known.

    `family` is its name in the file, `noun` what it is, `needed` whether there must be a seat for it.
    """

    family: str
    noun: str
    place: tuple[float, float, float]
    diameter: float | None
    width: float | None
    needed: bool = True


def _items(gearbox: Gearbox, body: Body) -> dict[str, _Item]:
    """All that sits on a body, by the name of its seat."""
    found = {}
    for name, z in body.wheels.items():
        gear = gearbox.gears[name]
        found[name] = _Item(name, "gear", (*body.axis, z), gear.held_diameter, gear.face_width)
    planets = {other.name: other.carrier for other in gearbox.bodies()}
    for bearing in gearbox.bearings:
        if body.name not in (bearing.body, bearing.on):
            continue
        diameter, width = None, None
        if bearing.catalogue is not None:
            on_pin = planets[bearing.body] == bearing.on  # a planet turns about its bearing, all others in it
            inside = (bearing.body == body.name) != on_pin
            diameter = 1e-3 * (bearing.catalogue.bore_mm if inside else bearing.catalogue.outer_diameter_mm)
            width = _width(bearing)
        found[bearing.name] = _Item(bearing.family, "bearing", bearing.position, diameter, width)
    at_work = {mount.name for mount in mounts_at_work(gearbox)}
    for mount in gearbox.mounts:
        if mount.body == body.name:
            found[mount.name] = _Item(mount.name, "mount", mount.position, None, None, mount.name in at_work)
    return found


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
    shared: dict[str, str] = {}
    for name, section in (sections | others).items():
        item = items.get(name)
        if section is not None and section.same_as is not None:
            shared[name] = section.same_as
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
    for name, other in shared.items():
        if other not in names:
            raise gearbox.fault(f"{key}.{name}.same_as = {other!r}: no such seat; seats are {', '.join(names)}")
    if not seats:
        raise gearbox.fault(f"{key}: nothing sits on the body; give at least one seat")
    return seats, sectors, shared


def _solid_seat(gearbox: Gearbox, key: str, name: str, item: _Item | None, section: SolidSeatSection) -> SolidSeat:
    """One seat, from what the file says of it and what is known of the item on it."""
    diameter, width = (None, None) if item is None else (item.diameter, item.width)
    if section.diameter_mm is not None:
        diameter = 1e-3 * section.diameter_mm
    if section.width_mm is not None:
        width = 1e-3 * section.width_mm
    if section.inner_diameter_mm is not None:
        width = 0.0
    place = None if item is None else item.place
    if section.position_mm is not None:
        x, y, z = section.position_mm
        place = (1e-3 * x, 1e-3 * y, 1e-3 * z)
    given = (("diameter_mm", diameter), ("width_mm", width), ("position_mm", place))
    missing = [word for word, value in given if value is None]
    if missing or diameter is None or width is None or place is None:
        what = "a seat that no gear, bearing or mount of the body has the name of" if item is None else item.noun
        raise gearbox.fault(f"{key}: {what} {name!r} needs its seat; give {' and '.join(missing)} in [{key}]")
    return SolidSeat(name, place, diameter / 2.0, width, 0.5e-3 * (section.inner_diameter_mm or 0.0))


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
    found: dict[str, Blank] = {}
    for name, section in solid.blanks.items():
        on = [seat for seat in names if name in (seat, families.get(seat))]
        if not on:
            raise gearbox.fault(f"bodies.{body.family}.solid.blanks.{name}: no such seat; seats are {', '.join(names)}")
        found |= dict.fromkeys(on, _blank(section))
    return found


def check_elastic_body(gearbox: Gearbox, name: str) -> None:
    """Refuse an elastic body before its finite elements are made.

    Raises
    ------
    CaseError
        A shape or solid that cannot be, a solid whose file is not there, seats that do not fit.
    """
    family = gearbox.body(name).family
    if gearbox.case.bodies[family].solid is not None:
        solid_body(gearbox, name)
        return
    model = shaft_model(gearbox, name)
    if not model.seats:
        raise gearbox.fault(
            f"bodies.{family}.shape: nothing sits on the body; give it a gear, a bearing or torque_z_mm"
        )
    try:
        check_shaft(model.sections, model.seats)
    except ShaftError as error:
        raise gearbox.fault(f"bodies.{family}.shape: {error}") from None


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
    gearbox : Gearbox
    folder : Path
        Where reductions are kept: a script whose reduction is there need not run.

    Raises
    ------
    CaseError
        A script that may not run, or as `solid_body`.
    """
    for key, model in solids_of(gearbox):
        file: SolidFile = model.mesh
        if file.is_script and not file.scripts and not kept_file(model, folder).is_file():
            raise gearbox.fault(f"{key}.file = {file.path.name!r}: {UNPERMITTED}")


def reduced_bodies(
    gearbox: Gearbox, inertias: str, folder: Path | None = None, begin: Callable[[str], None] | None = None
) -> dict[str, ElasticBody]:
    """Reduce all elastic bodies of a gearbox, or take them from where they were kept.

    Parameters
    ----------
    gearbox : Gearbox
    inertias : str
        Inertia set whose rigid inertias the bodies get that turn.
    folder : Path, optional
        Folder of a results folder in which reductions are kept; only the process remembers them otherwise.
    begin : callable, optional
        Called with the name of each body before it is reduced.

    Raises
    ------
    CaseError
        A shape or solid that cannot be, or that its gears and bearings do not fit on.
    """
    found = {}
    for name in elastic_names(gearbox):
        if begin is not None:
            begin(name)
        found[name] = _elastic_body(gearbox, gearbox.body(name, inertias), folder)
    return found


def _elastic_body(gearbox: Gearbox, body: Body, folder: Path | None) -> ElasticBody:
    section = gearbox.case.bodies[body.family]
    solid = None if section.solid is None else solid_body(gearbox, body.name)
    kind = "shape" if solid is None else "solid"
    model = shaft_model(gearbox, body.name) if solid is None else solid.model
    floating = None
    try:
        if section.flexibility == "ffrf":
            plain, floating = _floating(_Hashed(model), folder)
        else:
            plain = _reduced(_Hashed(model), folder)
    except (ShaftError, SolidError, ReductionError) as error:
        raise gearbox.fault(f"bodies.{body.family}.{kind}: {error}") from None
    own = plain.rigid_inertia
    wanted = RigidInertia(body.mass, (*body.axis, body.centre_of_mass_z), body.transverse, body.axial)
    reduced = plain if body.fixed else with_rigid_inertia(plain, wanted)
    floating = None if floating is None else with_inertia(floating, wanted)
    if solid is not None:
        return ElasticBody(reduced, own, solid.main, solid.sectors, solid.shared, floating)
    seats = [seat.name for seat in plain.seats]
    return ElasticBody(reduced, own, TORQUE_SEAT if TORQUE_SEAT in seats else seats[0], floating=floating)


def solid_of_shaft(model: ShaftModel, size: MeshSize = SOLID_SIZE) -> SolidModel:
    """Return the same shaft as a solid of hexahedra with the same seats.

    Raises
    ------
    exugear.bodies.turned_section.ShaftError
        A shaft that cannot be, or a seat that does not lie on it.
    """
    shaft = Shaft(model.sections, model.material, model.seats, size)
    seats = []
    x, y, z = model.origin
    for seat in model.seats:
        section = shaft.section_under(seat)
        hole = section.inner_diameter / 2.0 if seat.width == 0.0 else 0.0
        seats.append(SolidSeat(seat.name, (x, y, z + seat.z), section.outer_diameter / 2.0, seat.width, hole))
    return SolidModel(
        name=model.name,
        mesh=turned_hexahedra(shaft).translated(model.origin),
        material=model.material,
        seats=tuple(seats),
        frame="nonrotating",
        band=model.band,
        limit=model.limit,
        blanks=model.blanks,
        axis=(x, y),
    )


class _Hashed:
    """A model of a body by its key, so that it can be looked up."""

    def __init__(self, model: ShaftModel | SolidModel) -> None:
        self.model = model
        self.key = model.key

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Hashed) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)


@lru_cache(maxsize=64)
def _reduced(hashed: _Hashed, folder: Path | None) -> ReducedBody:
    model = hashed.model
    if isinstance(model, SolidModel):
        return reduce_solid(model) if folder is None else load_or_reduce_solid(model, folder)
    return reduce_shaft(model) if folder is None else load_or_reduce(model, folder)


@lru_cache(maxsize=16)
def _floating(hashed: _Hashed, folder: Path | None) -> tuple[ReducedBody, FloatingBody]:
    model = hashed.model
    return load_or_reduce_floating(model if isinstance(model, SolidModel) else solid_of_shaft(model), folder)
