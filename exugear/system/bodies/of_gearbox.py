"""The elastic bodies of a gearbox: all that are elastic, reduced, with the rigid inertia of an inertia set.

The mass of a body that turns comes from its shape and the blanks on it. What the body's inertia set says beyond that
(or short of it) is spread over the rigid part of the motion, so that an elastic body accelerates and orbits exactly as
the rigid one does and only its deformation is new. A fixed body has no inertia set: its mass is that of its solid.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.named_files import LARGEST_SOLID
from exugear.gearbox.parts import Body
from exugear.gearbox.sections.bodies import (
    BlankSection,
    ShaftSectionSection,
    ShapeSection,
    SolidSeatSection,
    SolidSection,
)
from exugear.gearbox.sections.gears import MaterialSection
from exugear.gearbox.units import MM, optional_si, si
from exugear.system.bearings.stiffness import elastic_names, mounts_at_work
from exugear.system.bodies.elastic_body import ElasticBody, FloatingBody, stated_damping
from exugear.system.bodies.external import ExternalModel, placed_matrices, reduce_external
from exugear.system.bodies.external_of_gearbox import check_external, external_body
from exugear.system.bodies.matrix_files.interface import MatrixFileError
from exugear.system.bodies.reduction import Blank, ReducedBody, ReductionError, RigidInertia, with_rigid_inertia
from exugear.system.bodies.seated_items import Item, SeatedBody, frame_of, items_on, seat_width, stated_seats
from exugear.system.bodies.shaft_sections import (
    MeshSize,
    SeatBand,
    ShaftError,
    ShaftSection,
    check_sections,
    check_shaft,
    narrowed,
)
from exugear.system.bodies.solid_elements import SolidError, SolidSeat
from exugear.system.bodies.solid_files import GEOMETRY, MESHES, UNPERMITTED, SolidFile
from exugear.system.bodies.solids import (
    SolidModel,
    load_or_reduce_floating,
    load_or_reduce_solid,
    reduce_solid,
    reduction_file,
    with_inertia,
)
from exugear.system.bodies.turned_section import Shaft, turned_hexahedra
from exugear.system.bodies.turned_shaft import ShaftModel, load_or_reduce_shaft, reduce_shaft
from fe_ste.geometry.gears import Material

# Input of a reduction from the gearbox file: materials and blanks


def material_of(section: MaterialSection) -> Material:
    """Material of a body, Pa and kg/m3."""
    return Material(si(section, "youngs_modulus_GPa"), section.poissons_ratio, section.density_kg_per_m3)


def blank_of(section: BlankSection) -> Blank:
    """Rigid ring on a seat, kg and kg m2."""
    return Blank(section.mass_kg, section.transverse_kg_m2, section.axial_kg_m2)


# Turned shafts of a gearbox: shapes from its file, seats where gears and bearings sit

POINT = 0.01
"""Bore over that of the other end where a conical bore has its point: elements cannot begin in one."""
TORQUE_SEAT = "torque"
"""Name of the seat where torques and couplings act."""
SAME_PLACE = 1e-6
"""Distance of places, and difference of widths, below which two seats are one, m."""
SOLID_SIZE = MeshSize(0.05, 0.05, 1)
"""Elements of a shaft as a solid: frequencies of its normal modes come out up to 0.6 % too high."""


def shaft_model(gearbox: Gearbox, name: str) -> ShaftModel:
    """All that the reduction of a body's shaft depends on.

    Raises
    ------
    GearboxFileError
        The body has no shape, or a shape that its gears and bearings do not fit on.
    """
    body = gearbox.body(name)
    shape = _shape_of(gearbox, body)
    if frame_of(gearbox, body) == "carrier":
        raise gearbox.error(f"bodies.{body.family}.shape: the body carries planets; use a [.solid] table instead")
    sections = tuple(map(_section_of, shape.sections))
    seats = tuple(narrowed(sections, seat) for seat in _seats(gearbox, body, shape))
    names = [seat.name for seat in seats]
    doubled = next((seat for seat in names if names.count(seat) > 1), None)
    if doubled is not None:
        raise gearbox.error(f"bodies.{body.family}: a gear and a bearing on it are both named {doubled!r}; rename one")
    key = f"bodies.{body.family}.shape"
    unknown = next((blank for blank in shape.blanks if blank not in names), None)
    if unknown is not None:
        raise gearbox.error(f"{key}.blanks.{unknown}: no such seat; seats are {', '.join(names)}")
    shared = _shared(seats)
    blanks = {shared.get(seat, seat): blank_of(blank) for seat, blank in shape.blanks.items()}
    if len(blanks) < len(shape.blanks):
        raise gearbox.error(
            f"{key}.blanks: two of {', '.join(shape.blanks)} are at one seat; define one blank for both"
        )
    return ShaftModel(
        name=name,
        sections=sections,
        material=material_of(shape.material),
        origin=(*body.axis, si(shape, "start_z_mm")),
        seats=tuple(seat for seat in seats if seat.name not in shared),
        blanks=blanks,
        band=gearbox.case.elasticity.band_Hz,
        limit=gearbox.case.elasticity.limit_Hz,
    )


def shared_seats(gearbox: Gearbox, name: str) -> dict[str, str]:
    """Seats of a body's shaft that are represented by another one of equal position and width, by their names.

    Two seats of equal position and width would have the same motion: their loads could not be separated.
    """
    body = gearbox.body(name)
    shape = _shape_of(gearbox, body)
    sections = tuple(map(_section_of, shape.sections))
    return _shared(tuple(narrowed(sections, seat) for seat in _seats(gearbox, body, shape)))


def _shared(seats: Sequence[SeatBand]) -> dict[str, str]:
    shared: dict[str, str] = {}
    for n, seat in enumerate(seats):
        for other in seats[:n]:
            if other.name not in shared and max(abs(seat.z - other.z), abs(seat.width - other.width)) < SAME_PLACE:
                shared[seat.name] = other.name
                break
    return shared


def narrowed_seats(gearbox: Gearbox, name: str) -> Iterator[str]:
    """Say which seats of a body's shaft reach a little across a shoulder, or beyond its end, and so end there."""
    body = gearbox.body(name)
    shape = _shape_of(gearbox, body)
    sections = tuple(map(_section_of, shape.sections))
    for seat in _seats(gearbox, body, shape):
        across = 500.0 * (seat.width - narrowed(sections, seat).width)
        if across > 0.0:
            yield (
                f"bodies.{body.family}.shape: the seat of {seat.name} extends {across:.3g} mm beyond a shoulder or "
                "the shaft end; it is shortened symmetrically to that point"
            )


def _shape_of(gearbox: Gearbox, body: Body) -> ShapeSection:
    """Section of a body's shape, which must be there."""
    shape = gearbox.case.bodies[body.family].shape
    if shape is None:
        raise gearbox.error(f"bodies.{body.family}: no shape; add a [bodies.{body.family}.shape] table")
    return shape


def _section_of(section: ShaftSectionSection) -> ShaftSection:
    """Piece of a shaft, m."""
    inner = section.inner_diameter_mm
    inner_end = section.inner_diameter_end_mm
    if inner_end is not None:
        inner, inner_end = max(inner, POINT * inner_end), max(inner_end, POINT * inner)
    return ShaftSection(
        si(section, "length_mm"),
        si(section, "outer_diameter_mm"),
        MM * inner,
        optional_si(section, "outer_diameter_end_mm"),
        None if inner_end is None else MM * inner_end,
    )


def _seats(gearbox: Gearbox, body: Body, shape: ShapeSection) -> Iterator[SeatBand]:
    """Each seat as given in the file, from the beginning of the shaft."""
    start = si(shape, "start_z_mm")
    for gear, z in body.wheels.items():
        yield SeatBand(gear, z - start, gearbox.gears[gear].face_width)
    for bearing in gearbox.bearings:
        if body.name in (bearing.body, bearing.on):
            yield SeatBand(bearing.name, bearing.position[2] - start, seat_width(bearing))
    for mount in mounts_at_work(gearbox):
        if mount.body == body.name:
            yield SeatBand(mount.name, mount.position[2] - start, 0.0)
    for force in gearbox.forces:
        if force.body == body.name:
            yield SeatBand(force.name, force.position[2] - start, 0.0)
    loads = [own for own in gearbox.varying_loads if body.name in (own.body, own.reaction_on)]
    for name, place in {own.excitation: own.position for own in loads}.items():
        if place is not None:
            yield SeatBand(name, place[2] - start, 0.0)
    if shape.torque_z_mm is not None:
        yield SeatBand(TORQUE_SEAT, si(shape, "torque_z_mm") - start, 0.0)


def solid_of_shaft(model: ShaftModel, size: MeshSize = SOLID_SIZE) -> SolidModel:
    """Return the same shaft as a solid of hexahedra with the same seats.

    Raises
    ------
    exugear.system.bodies.shaft_sections.ShaftError
        A shaft that cannot be, or a seat that does not lie on it.
    """
    shaft = Shaft(model.sections, model.material, model.seats, size)
    seats = []
    x, y, z = model.origin
    for seat in model.seats:
        section = shaft.section_under(seat)
        if section.is_cone:
            raise ShaftError(f"seat {seat.name}: lies on a cone; seats of a solid must be cylindrical")
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


# Solids of a gearbox: shapes and meshes from files, seats where gears, bearings and mounts sit


def solid_body(gearbox: Gearbox, name: str) -> SeatedBody[SolidModel]:
    """Return the data of a body's solid from the gearbox file; its file exists and is permitted, but is not yet read.

    Raises
    ------
    GearboxFileError
        The body has no solid, its file does not exist, has no supported format or lies outside the permitted folder, or
        a seat of an item on it is missing or incompletely specified.
    """
    body = gearbox.body(name)
    section = gearbox.case.bodies[body.family]
    key = f"bodies.{body.family}.solid"
    solid = section.solid
    if solid is None:
        raise gearbox.error(f"bodies.{body.family}: no solid; add a [{key}] table")
    frame = frame_of(gearbox, body)
    if section.flexibility in ("nonrotating", "ffrf") and frame != "nonrotating":
        raise gearbox.error(
            f"bodies.{body.family}.flexibility = {section.flexibility!r}: the body carries planets and is described "
            "in its own rotating frame; set 'elastic'"
        )
    file = SolidFile(
        gearbox.file(f"{key}.file", solid.file, LARGEST_SOLID),
        si(solid, "length_unit_mm"),
        optional_si(solid, "element_size_mm") or 0.0,
        solid.elements_around,
        gearbox.permissions.scripts,
    )
    if not file.is_geometry and not file.is_mesh:
        endings = ", ".join((*GEOMETRY, *MESHES))
        raise gearbox.error(f"{key}.file = {solid.file!r}: unknown format; its name must end in {endings}")
    if file.is_geometry and solid.element_size_mm is None:
        raise gearbox.error(f"{key}.element_size_mm: this key is missing; it is required to mesh {solid.file}")
    band = solid.band_Hz or gearbox.case.elasticity.band_Hz
    if band >= gearbox.case.elasticity.limit_Hz:
        raise gearbox.error(f"{key}.band_Hz = {band:g}: must be below elasticity.limit_Hz")
    seats, sectors, shared = stated_seats(gearbox, body, "solid", solid.seats, partial(_solid_seats, gearbox))
    names = [seat.name for seat in seats]
    if solid.torque_seat is not None and solid.torque_seat not in names:
        raise gearbox.error(f"{key}.torque_seat = {solid.torque_seat!r}: no such seat; seats are {', '.join(names)}")
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
    return SeatedBody(model, solid.torque_seat or names[0], sectors, shared, *stated_damping(solid))


def _solid_seats(
    gearbox: Gearbox, key: str, name: str, item: Item | None, stated: SolidSeatSection | None
) -> list[SolidSeat]:
    """One seat, from its entry in the file and the known data of the item on it, or equal sectors of it."""
    section = stated or SolidSeatSection()
    diameter, width = (None, None) if item is None else (item.diameter, item.width)
    if section.diameter_mm is not None:
        diameter = si(section, "diameter_mm")
    if section.width_mm is not None:
        width = si(section, "width_mm")
    if section.inner_diameter_mm is not None:
        width = 0.0
    position = None if item is None else item.position
    if section.position_mm is not None:
        x, y, z = section.position_mm
        position = (MM * x, MM * y, MM * z)
    given = (("diameter_mm", diameter), ("width_mm", width), ("position_mm", position))
    missing = [word for word, value in given if value is None]
    if missing or diameter is None or width is None or position is None:
        what = "seat without gear, bearing or mount" if item is None else item.noun
        raise gearbox.error(
            f"{key}: {what} {name!r} requires its position and size; set {' and '.join(missing)} in [{key}]"
        )
    inner = 0.5 * (optional_si(section, "inner_diameter_mm") or 0.0)
    count = section.sectors
    if count is None:
        return [SolidSeat(name, position, diameter / 2.0, width, inner)]
    if item is None or item.noun != "gear":
        raise gearbox.error(f"{key}.sectors = {count}: only the seat of a gear has sectors")
    # Numbered from 1, the first in the middle of +x.
    extent = 2.0 * math.pi / count
    return [
        SolidSeat(f"{name}_{n + 1}", position, diameter / 2.0, width, inner, (n * extent, extent)) for n in range(count)
    ]


def _solid_blanks(gearbox: Gearbox, body: Body, solid: SolidSection, names: list[str]) -> dict[str, Blank]:
    """Blanks by seat; a blank of a bearing of all planets is added at each of its seats."""
    families = {name: item.family for name, item in items_on(gearbox, body).items()}
    blanks: dict[str, Blank] = {}
    for name, section in solid.blanks.items():
        on = [seat for seat in names if name in (seat, families.get(seat))]
        if not on:
            raise gearbox.error(f"bodies.{body.family}.solid.blanks.{name}: no such seat; seats are {', '.join(names)}")
        blanks |= dict.fromkeys(on, blank_of(section))
    return blanks


def node_numbers(gearbox: Gearbox, name: str) -> dict[str, int]:
    """Return the node number of each seat of a flexible body in files for other programs.

    A body from matrices keeps their numbers; the seats of a solid are numbered from 1. Reactions of excitations without
    a seat of their own are at the main seat.

    Raises
    ------
    GearboxFileError
        As `external_body` and `solid_body`.
    exugear.system.bodies.matrix_files.interface.MatrixFileError, ReductionError
        The matrices cannot be used.
    """
    section = gearbox.case.bodies[gearbox.body(name).family]
    if section.external is not None:
        external = external_body(gearbox, name)
        names = [seat.name for seat in external.model.seats]
        numbers = dict(zip(names, placed_matrices(external.model).nodes, strict=False))
        shared, main = external.shared_seats, external.main_seat
    else:
        solid = solid_body(gearbox, name)
        numbers = {seat.name: number for number, seat in enumerate(solid.model.seats, start=1)}
        shared, main = solid.shared_seats, solid.main_seat
    reacting = (own.excitation for own in gearbox.varying_loads if own.reaction_on == name)
    return dict.fromkeys(reacting, numbers[main]) | numbers | {seat: numbers[own] for seat, own in shared.items()}


def solids_of(gearbox: Gearbox) -> Iterator[tuple[str, SolidModel]]:
    """Return key and model of each solid that the variant `flexible` uses; files exist, but none is read or run yet.

    Raises
    ------
    GearboxFileError
        As `solid_body`.
    """
    for name in elastic_names(gearbox):
        family = gearbox.body(name).family
        if gearbox.case.bodies[family].solid is not None:
            yield f"bodies.{family}.solid", solid_body(gearbox, name).model


def check_solids(gearbox: Gearbox, folder: Path) -> None:
    """Refuse solids that cannot be used, and scripts that would have to run without permission, before any work.

    Parameters
    ----------
    folder : where reductions are stored: a script with a stored reduction need not run

    Raises
    ------
    GearboxFileError
        A script is not permitted to run, or as `solid_body`.
    """
    for key, model in solids_of(gearbox):
        file: SolidFile = model.mesh
        if file.is_script and not file.scripts and not reduction_file(model, folder).is_file():
            raise gearbox.error(f"{key}.file = {file.path.name!r}: {UNPERMITTED}")


def reduced_bodies(
    gearbox: Gearbox, inertias: str, folder: Path | None = None, begin: Callable[[str], None] | None = None
) -> dict[str, ElasticBody]:
    """Reduce all elastic bodies of a gearbox, or take them from where they are stored.

    Parameters
    ----------
    inertias : inertia set whose rigid inertias the bodies get that turn
    folder : folder of a results folder in which reductions are stored; only the process remembers them otherwise
    begin : called with the name of each body before it is reduced

    Raises
    ------
    GearboxFileError
        A shape, solid or matrices that cannot be, or that its gears and bearings do not fit on.
    """
    bodies = {}
    for name in elastic_names(gearbox):
        if begin is not None:
            begin(name)
        bodies[name] = _elastic_body(gearbox, gearbox.body(name, inertias), folder)
    return bodies


def _elastic_body(gearbox: Gearbox, body: Body, folder: Path | None) -> ElasticBody:
    section = gearbox.case.bodies[body.family]
    model: ShaftModel | SolidModel | ExternalModel
    seated: SeatedBody[SolidModel] | SeatedBody[ExternalModel] | None = None
    if section.external is not None:
        key, seated = "external", external_body(gearbox, body.name)
        model, digest = seated.model, seated.model.file_digest
    elif section.solid is not None:
        key, seated = "solid", solid_body(gearbox, body.name)
        model, digest = seated.model, hashlib.sha256(seated.model.mesh.path.read_bytes()).hexdigest()
    else:
        key, model, digest = "shape", shaft_model(gearbox, body.name), ""
    floating = None
    try:
        if section.flexibility == "ffrf" and not isinstance(model, ExternalModel):
            of_shape, floating = _floating(_Hashed(model), folder)
        else:
            of_shape = _reduced(_Hashed(model), folder)
    except (ShaftError, SolidError, ReductionError, MatrixFileError) as error:
        raise gearbox.error(f"bodies.{body.family}.{key}: {error}") from None
    wanted = RigidInertia(body.mass, (*body.axis, body.centre_of_mass_z), body.transverse, body.axial)
    reduced = of_shape if body.fixed else with_rigid_inertia(of_shape, wanted)
    floating = None if floating is None else with_inertia(floating, wanted)
    inertia = of_shape.rigid_inertia
    if seated is not None:
        found = ElasticBody(reduced, inertia, seated.main_seat, seated.sectors, seated.shared_seats, floating, digest)
        return replace(found, damping_time=seated.damping_time, loss_factor=seated.loss_factor)
    seats = [seat.name for seat in of_shape.seats]
    shared = shared_seats(gearbox, body.name)
    torque = shared.get(TORQUE_SEAT, TORQUE_SEAT)
    main = torque if torque in seats else seats[0]
    return ElasticBody(reduced, inertia, main, shared_seats=shared, floating=floating)


def check_elastic_body(gearbox: Gearbox, name: str) -> None:
    """Refuse an elastic body before its finite elements are made.

    Raises
    ------
    GearboxFileError
        A shape or solid that cannot be, a file that is not there, matrices that fail a check, seats that do not fit.
    """
    family = gearbox.body(name).family
    if gearbox.case.bodies[family].external is not None:
        check_external(gearbox, name)
        return
    if gearbox.case.bodies[family].solid is not None:
        mesh = solid_body(gearbox, name).model.mesh
        if isinstance(mesh, SolidFile) and mesh.is_mesh:
            try:
                _ = mesh.mesh
            except SolidError as error:
                raise gearbox.error(f"bodies.{family}.solid.file = {mesh.path.name!r}: {error}") from None
        return
    model = shaft_model(gearbox, name)
    if not model.seats:
        raise gearbox.error(f"bodies.{family}.shape: the body has no seat; add a gear, a bearing or torque_z_mm")
    try:
        check_shaft(model.sections, model.seats, start=si(_shape_of(gearbox, gearbox.body(name)), "start_z_mm"))
    except ShaftError as error:
        raise gearbox.error(f"bodies.{family}.shape: {error}") from None


def check_shape(gearbox: Gearbox, family: str) -> None:
    """Refuse the shape of a body, rigid or flexible, whose sections do not touch each other.

    Raises
    ------
    GearboxFileError
        One of them fits into the bore of its neighbour.
    """
    shape = gearbox.case.bodies[family].shape
    if shape is None:
        return
    try:
        check_sections(tuple(map(_section_of, shape.sections)))
    except ShaftError as error:
        raise gearbox.error(f"bodies.{family}.shape: {error}") from None


class _Hashed:
    """A model of a body by its key, so that it can be looked up."""

    def __init__(self, model: ShaftModel | SolidModel | ExternalModel) -> None:
        self.model = model
        self.key = model.key

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Hashed) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)


@lru_cache(maxsize=64)
def _reduced(hashed: _Hashed, folder: Path | None) -> ReducedBody:
    model = hashed.model
    if isinstance(model, ExternalModel):
        return reduce_external(model)
    if isinstance(model, SolidModel):
        return reduce_solid(model) if folder is None else load_or_reduce_solid(model, folder)
    return reduce_shaft(model) if folder is None else load_or_reduce_shaft(model, folder)


@lru_cache(maxsize=16)
def _floating(hashed: _Hashed, folder: Path | None) -> tuple[ReducedBody, FloatingBody]:
    model = hashed.model
    assert not isinstance(model, ExternalModel)
    return load_or_reduce_floating(model if isinstance(model, SolidModel) else solid_of_shaft(model), folder)
