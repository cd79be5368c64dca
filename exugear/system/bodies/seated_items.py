"""What sits on a flexible body of any shape: gears, bearings and mounts with their positions; and the body's frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Bearing, Body
from exugear.gearbox.sections.bodies import ExternalSeatSection, SolidSeatSection
from exugear.gearbox.units import MM, si
from exugear.system.bearings.stiffness import mounts_at_work
from exugear.system.bodies.reduction import Frame


def seat_width(bearing: Bearing) -> float:
    """Width of a bearing's seat (m): that of its rows; a plane where only a stiffness is given."""
    if bearing.catalogue is None:
        return 0.0
    rows = 1 if bearing.catalogue.arrangement == "single" else 2
    return rows * si(bearing.catalogue, "width_mm")


def frame_of(gearbox: Gearbox, body: Body) -> Frame:
    """Frame that an elastic body is seen from: the ground, its own that turns, or one that does not."""
    if body.fixed:
        return "ground"
    if any(other.carrier == body.name for other in gearbox.bodies()):
        return "carrier"
    return "nonrotating"


@dataclass(frozen=True)
class Item:
    """What sits on a body: its position (m), and diameter and width (m) of its seat where they are known.

    `family` is its name in the file, `noun` what it is, `needed` whether there must be a seat for it.
    """

    family: str
    noun: str
    position: tuple[float, float, float]
    diameter: float | None
    width: float | None
    needed: bool = True


def items_on(gearbox: Gearbox, body: Body) -> dict[str, Item]:
    """All that sits on a body, by the name of its seat."""
    items = {}
    for name, z in body.wheels.items():
        gear = gearbox.gears[name]
        items[name] = Item(name, "gear", (*body.axis, z), gear.held_diameter, gear.face_width)
    for bearing in gearbox.bearings:
        if body.name not in (bearing.body, bearing.on):
            continue
        diameter = None
        width = None
        if bearing.catalogue is not None:
            # A planet turns about its bearing, all other bodies in theirs.
            inside = (bearing.body == body.name) != bearing.carries_outer_ring
            diameter = MM * (bearing.catalogue.bore_mm if inside else bearing.catalogue.outer_diameter_mm)
            width = seat_width(bearing)
        items[bearing.name] = Item(bearing.family, "bearing", bearing.position, diameter, width)
    at_work = {mount.name for mount in mounts_at_work(gearbox)}
    for mount in gearbox.mounts:
        if mount.body == body.name:
            items[mount.name] = Item(mount.name, "mount", mount.position, None, None, mount.name in at_work)
    return items


class _NamedSeat(Protocol):
    @property
    def name(self) -> str: ...


Model = TypeVar("Model")
Section = TypeVar("Section", ExternalSeatSection, SolidSeatSection)
Seat = TypeVar("Seat", bound=_NamedSeat)


@dataclass(frozen=True)
class SeatedBody(Generic[Model]):
    """A solid of the gearbox file, or a body from matrices."""

    model: Model
    """All that its reduction depends on."""
    main_seat: str
    sectors: Mapping[str, tuple[str, ...]]
    shared_seats: Mapping[str, str]
    damping_time: float | None
    loss_factor: float
    """As in `exugear.system.bodies.elastic_body.ElasticBody`."""


def stated_seats(
    gearbox: Gearbox,
    body: Body,
    table: str,
    stated: Mapping[str, Section],
    seats_of: Callable[[str, str, Item | None, Section | None], Sequence[Seat]],
) -> tuple[list[Seat], dict[str, tuple[str, ...]], dict[str, str]]:
    """Seats of a body, the sectors of its gears, and the seats that bearings share.

    Parameters
    ----------
    table : "solid" or "external", the table of the body in the file
    stated : its entries by the name of a seat, or of the bearing of all planets
    seats_of : called with key, name, item and entry of a seat: the seat, or its sectors with names of their own
    """
    key = f"bodies.{body.family}.{table}.seats"
    items = items_on(gearbox, body)
    families = {item.family for item in items.values()}
    sections = {name: stated.get(name, stated.get(item.family)) for name, item in items.items()}
    others = {name: section for name, section in stated.items() if name not in items and name not in families}
    seats: list[Seat] = []
    sectors: dict[str, tuple[str, ...]] = {}
    shared: dict[str, str] = {}
    for name, section in (sections | others).items():
        item = items.get(name)
        if section is not None and section.same_as is not None:
            shared[name] = section.same_as
        elif item is None or section is not None or item.needed:
            parts = seats_of(f"{key}.{name}", name, item, section)
            seats += parts
            if parts[0].name != name:
                sectors[name] = tuple(part.name for part in parts)
    names = [seat.name for seat in seats]
    doubled = next((name for name in names if names.count(name) > 1), None)
    if doubled is not None:
        raise gearbox.error(f"{key}: two seats are both named {doubled!r}; rename one")
    for name, other in shared.items():
        if other not in names:
            raise gearbox.error(f"{key}.{name}.same_as = {other!r}: no such seat; seats are {', '.join(names)}")
    if not seats:
        raise gearbox.error(f"{key}: the body has no seat; define at least one")
    return seats, sectors, shared
