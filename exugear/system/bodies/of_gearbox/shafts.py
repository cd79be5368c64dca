"""Turned shafts of a gearbox: shapes from its file, seats where gears and bearings sit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Body
from exugear.gearbox.sections.bodies import ShaftSectionSection, ShapeSection
from exugear.system.bearings.supports import mounts_at_work
from exugear.system.bodies.finite_elements.shaft_sections import (
    MeshSize,
    SeatBand,
    ShaftError,
    ShaftSection,
    narrowed,
)
from exugear.system.bodies.finite_elements.solid_seats import SolidSeat
from exugear.system.bodies.finite_elements.turned_hexahedra import turned_hexahedra
from exugear.system.bodies.finite_elements.turned_section import Shaft
from exugear.system.bodies.of_gearbox.sections import blank_of, frame_of, material_of, seat_width
from exugear.system.bodies.solids import SolidModel
from exugear.system.bodies.turned_shaft import ShaftModel

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
    CaseError
        The body has no shape, or a shape that its gears and bearings do not fit on.
    """
    body = gearbox.body(name)
    shape = _shape_of(gearbox, body)
    if frame_of(gearbox, body) == "carrier":
        raise gearbox.fault(f"bodies.{body.family}.shape: the body carries planets; give a .solid table instead")
    sections = tuple(map(_section_of, shape.sections))
    seats = tuple(narrowed(sections, seat) for seat in _seats(gearbox, body, shape))
    names = [seat.name for seat in seats]
    doubled = next((seat for seat in names if names.count(seat) > 1), None)
    if doubled is not None:
        raise gearbox.fault(f"bodies.{body.family}: a gear and a bearing on it are both named {doubled!r}; rename one")
    key = f"bodies.{body.family}.shape"
    unknown = next((blank for blank in shape.blanks if blank not in names), None)
    if unknown is not None:
        raise gearbox.fault(f"{key}.blanks.{unknown}: no such seat; seats are {', '.join(names)}")
    shared = _shared(seats)
    blanks = {shared.get(seat, seat): blank_of(blank) for seat, blank in shape.blanks.items()}
    if len(blanks) < len(shape.blanks):
        raise gearbox.fault(f"{key}.blanks: two of {', '.join(shape.blanks)} sit on one seat; give one blank for both")
    return ShaftModel(
        name=name,
        sections=sections,
        material=material_of(shape.material),
        origin=(*body.axis, shape.start_z_mm * 1e-3),
        seats=tuple(seat for seat in seats if seat.name not in shared),
        blanks=blanks,
        band=gearbox.case.elasticity.band_Hz,
        limit=gearbox.case.elasticity.limit_Hz,
    )


def shared_seats(gearbox: Gearbox, name: str) -> dict[str, str]:
    """Seats of a body's shaft that another one stands for, which has their place and width, by their names.

    Two of one place and width would move alike: nothing could tell what each carries.
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
                f"bodies.{body.family}.shape: the seat of {seat.name} reaches {across:.3g} mm across a shoulder or the "
                f"end of the shaft; it ends there, and as far from its middle on the other side"
            )


def _shape_of(gearbox: Gearbox, body: Body) -> ShapeSection:
    """Section of a body's shape, which must be there."""
    shape = gearbox.case.bodies[body.family].shape
    if shape is None:
        raise gearbox.fault(f"bodies.{body.family}: no shape; give a [bodies.{body.family}.shape] table")
    return shape


def _section_of(section: ShaftSectionSection) -> ShaftSection:
    """Piece of a shaft, m."""
    outer_end = section.outer_diameter_end_mm
    inner = section.inner_diameter_mm
    inner_end = section.inner_diameter_end_mm
    if inner_end is not None:
        inner, inner_end = max(inner, POINT * inner_end), max(inner_end, POINT * inner)
    return ShaftSection(
        1e-3 * section.length_mm,
        1e-3 * section.outer_diameter_mm,
        1e-3 * inner,
        None if outer_end is None else 1e-3 * outer_end,
        None if inner_end is None else 1e-3 * inner_end,
    )


def _seats(gearbox: Gearbox, body: Body, shape: ShapeSection) -> Iterator[SeatBand]:
    """Each seat as the file has it, from the beginning of the shaft."""
    start = shape.start_z_mm * 1e-3
    for gear, z in body.wheels.items():
        yield SeatBand(gear, z - start, gearbox.gears[gear].face_width)
    for bearing in gearbox.bearings:
        if body.name in (bearing.body, bearing.on):
            yield SeatBand(bearing.name, bearing.position[2] - start, seat_width(bearing))
    for mount in mounts_at_work(gearbox):
        if mount.body == body.name:
            yield SeatBand(mount.name, mount.position[2] - start, 0.0)
    if shape.torque_z_mm is not None:
        yield SeatBand(TORQUE_SEAT, shape.torque_z_mm * 1e-3 - start, 0.0)


def solid_of_shaft(model: ShaftModel, size: MeshSize = SOLID_SIZE) -> SolidModel:
    """Return the same shaft as a solid of hexahedra with the same seats.

    Raises
    ------
    exugear.system.bodies.finite_elements.shaft_sections.ShaftError
        A shaft that cannot be, or a seat that does not lie on it.
    """
    shaft = Shaft(model.sections, model.material, model.seats, size)
    seats = []
    x, y, z = model.origin
    for seat in model.seats:
        section = shaft.section_under(seat)
        if section.is_cone:
            raise ShaftError(f"seat {seat.name}: it lies on a cone, and seats of a solid are cylinders")
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
