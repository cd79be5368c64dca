"""What sits on a flexible body of any shape: gears, bearings and mounts with their positions; and the body's frame."""

from __future__ import annotations

from dataclasses import dataclass

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Bearing, Body
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
