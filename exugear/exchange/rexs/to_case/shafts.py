"""Shafts from their sections, and the inertia of bodies from sections, gears and plates."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from exugear.exchange.rexs.to_case.bodies import RigidGroup
from exugear.exchange.rexs.to_case.notes import ComponentPositions, Notes, tidy
from exugear.exchange.rexs.to_case.toothing import Toothing, is_rigid, material_of
from exugear.exchange.rexs.tree import Component, Model, RexsError
from exugear.gearbox.units import MM
from fe_ste.geometry.cylinders import MassProperties, Tube, mass_properties

STEEL = 7850.0
"""Density if the file has no value, kg/m3."""
LEVELLED = 0.1
"""Largest diameter step under a seat that is filled, relative to the diameter."""
OVERHANG = 0.2
"""Largest overhang of a seat beyond the end of its shaft, relative to its width; the shaft is then lengthened."""
TOUCHING = 1e-4
"""Largest gap or overlap of adjacent sections, mm."""


@dataclass(frozen=True)
class Cylinder:
    """Hollow cylinder or cone about the z axis, mm and kg/m3."""

    start: float
    length: float
    outers: tuple[float, float]
    """Outer diameters at its start and end."""
    inners: tuple[float, float]
    density: float
    aside: float = 0.0
    """Distance from the axis of its body."""

    @property
    def end(self) -> float:
        """Axial position of its end, mm."""
        return self.start + self.length

    @property
    def is_cone(self) -> bool:
        """Whether a diameter changes along the piece."""
        return self.outers[0] != self.outers[1] or self.inners[0] != self.inners[1]

    def part(self, start: float, stop: float) -> Cylinder:
        """Return the part between two axial positions, mm."""
        shares = [(place - self.start) / self.length for place in (start, stop)]
        outer, outer_end, inner, inner_end = (
            tidy(round(low + share * (high - low), 9)) for low, high in (self.outers, self.inners) for share in shares
        )
        return Cylinder(start, tidy(stop - start), (outer, outer_end), (inner, inner_end), self.density, self.aside)


def inertia_of(cylinders: Iterable[Cylinder]) -> MassProperties:
    """Total inertia of cylinders in SI; eccentric ones are treated as evenly distributed around the axis.

    Examples
    --------
    >>> disc = inertia_of([Cylinder(0.0, 100.0, (200.0, 200.0), (0.0, 0.0), 7850.0)])
    >>> round(disc.mass, 3), round(disc.axial, 5), round(disc.transverse, 5), round(disc.centre, 6)
    (24.662, 0.12331, 0.08221, 0.05)
    """
    return mass_properties(
        Tube(
            start=MM * cylinder.start,
            length=MM * cylinder.length,
            outer=MM * cylinder.outers[0],
            inner=MM * cylinder.inners[0],
            density=cylinder.density,
            outer_end=MM * cylinder.outers[1],
            inner_end=MM * cylinder.inners[1],
            aside=MM * cylinder.aside,
        )
        for cylinder in cylinders
    )


def sections_of(
    model: Model, places: ComponentPositions, shaft: Component, body: RigidGroup, notes: Notes
) -> list[Cylinder]:
    """Sections of a shaft in the order of z.

    Raises
    ------
    RexsError
        A section has no length or diameter.
    """
    sections = model.parts_of(shaft, "shaft_section")
    if not sections or not shaft.given("support_vector"):
        return []
    x, y, origin = places.position(shaft)
    density = _density(model, shaft, notes)
    aside = round(math.dist((x, y), body.axis), 6)
    pieces: list[Cylinder] = []
    for section in sections:
        if not section.attributes:
            notes.ignored.append(f"{section}: has no values")
            continue
        alone = len(sections) == 1 and not section.given("u_coordinate_on_shaft")
        start = 0.0 if alone else section.required("u_coordinate_on_shaft")
        length = section.required("length")
        begin = section.required("outer_diameter_begin")
        end = section.quantity("outer_diameter_end")
        bore = section.quantity("inner_diameter_begin") or 0.0
        bore_end = section.quantity("inner_diameter_end")
        outers = (begin, begin if end is None else end)
        inners = (bore, bore if bore_end is None else bore_end)
        if length <= 0.0 or min(outers) <= 0.0 or inners[0] >= outers[0] or inners[1] >= outers[1]:
            raise RexsError(
                f"{section}: length and diameters of {length:g}, {begin:g} and {bore:g} mm are not a section"
            )
        if places.sense(shaft) < 0:
            start = -start - length
            outers = outers[::-1]
            inners = inners[::-1]
        pieces.append(Cylinder(tidy(round(origin + start, 6)), tidy(length), outers, inners, density, aside))
    return sorted(pieces, key=lambda cylinder: cylinder.start)


def _density(model: Model, part: Component, notes: Notes) -> float:
    """Density of a component, kg/m3; zero if its material represents a rigid body and has no density."""
    material = material_of(model, part)
    density = material.quantity("density") if material else None
    if density is not None:
        return density
    if is_rigid(material):
        notes.changed.append(f"{part}: its material means 'rigid' and has no density: no mass")
        return 0.0
    line = f"density of steel, {STEEL:g} kg/m3, where not in the file"
    if line not in notes.changed:
        notes.changed.append(line)
    return STEEL


def seat_diameter(sections: Sequence[Cylinder], z: float, width: float, internal: bool) -> float | None:
    """Seat diameter of a gear, mm: the largest shaft diameter under it; for a ring gear the bore around it."""
    low = z - 0.5 * width
    high = z + 0.5 * width
    under = [section for section in sections if section.start < high - TOUCHING and section.end > low + TOUCHING]
    if not under:
        return None
    if internal:
        return min(end for cylinder in under for end in cylinder.inners)
    return max(end for cylinder in under for end in cylinder.outers)


def gear_tube(model: Model, gear: Toothing, z: float, seat: float | None, notes: Notes) -> Cylinder:
    """Gear as a tube from its seat to its reference circle."""
    helix = math.radians(gear.helix_angle.value)
    reference = gear.teeth * gear.module.value / math.cos(helix)
    width = gear.face_width.value
    inner, outer = (reference, seat or reference) if gear.internal else (min(seat or 0.0, reference), reference)
    return Cylinder(z - 0.5 * width, width, (outer, outer), (inner, inner), _density(model, gear.part, notes))


def plate(model: Model, places: ComponentPositions, part: Component, notes: Notes) -> Cylinder | None:
    """Side plate of a carrier."""
    length = part.quantity("length")
    outer = part.quantity("outer_diameter")
    if not length or not outer:
        return None
    origin = places.position(part)[2]
    start = origin if places.sense(part) > 0 else origin - length
    bore = part.quantity("inner_diameter") or 0.0
    return Cylinder(start, length, (outer, outer), (bore, bore), _density(model, part, notes))


def levelled(sections: Sequence[Cylinder], seats: Iterable[tuple[str, float, float]], notes: Notes) -> list[Cylinder]:
    """Fill grooves and small shoulders under seats, because a seat of a flexible shaft must be one cylinder or cone.

    Parameters
    ----------
    seats : name, middle and width of each seat, mm
    """
    pieces = list(sections)
    for name, z, width in seats:
        low = z - 0.5 * width
        high = z + 0.5 * width
        pieces = _lengthened(pieces, name, (low, high), notes)
        pieces = [part for piece in pieces for part in _cut(piece, (low, high))]
        under = [piece for piece in pieces if low - TOUCHING < piece.start and piece.end < high + TOUCHING]
        outers = [end for one in under for end in one.outers]
        if len(under) < 2 or len(set(outers)) < 2 or min(outers) < (1.0 - LEVELLED) * max(outers):
            continue
        least = min(outers)
        most = max(outers)
        notes.changed.append(f"{name}: shaft of {least:g} to {most:g} mm under it modelled as {most:g}")
        pieces = [dataclasses.replace(piece, outers=(most, most)) if piece in under else piece for piece in pieces]
    return _merged(pieces)


def _lengthened(pieces: list[Cylinder], name: str, seat: tuple[float, float], notes: Notes) -> list[Cylinder]:
    """Lengthen the ends of a shaft to include a seat slightly beyond them."""
    first = pieces[0]
    last = pieces[-1]
    most = OVERHANG * (seat[1] - seat[0])
    before = first.start - seat[0]
    beyond = seat[1] - last.start - last.length
    if TOUCHING < before <= most:
        first = dataclasses.replace(first, start=tidy(seat[0]), length=tidy(first.length + before))
        notes.changed.append(f"{name}: extends {before:.4g} mm beyond the shaft, which is lengthened accordingly")
        pieces = [first, *pieces[1:]]
    if TOUCHING < beyond <= most:
        last = dataclasses.replace(pieces[-1], length=tidy(pieces[-1].length + beyond))
        notes.changed.append(f"{name}: extends {beyond:.4g} mm beyond the shaft, which is lengthened accordingly")
        pieces = [*pieces[:-1], last]
    return pieces


def _cut(piece: Cylinder, places: Sequence[float]) -> Iterator[Cylinder]:
    """Cut a piece at those positions that are inside it."""
    inside = [place for place in places if piece.start + TOUCHING < place < piece.end - TOUCHING]
    return (piece.part(start, stop) for start, stop in itertools.pairwise([piece.start, *inside, piece.end]))


def _merged(pieces: Sequence[Cylinder]) -> list[Cylinder]:
    """Join adjacent pieces of equal diameters."""
    joined: list[Cylinder] = []
    for piece in pieces:
        last = joined[-1] if joined else None
        alike = last is not None and dataclasses.replace(last, start=piece.start, length=piece.length) == piece
        if last is not None and alike and not piece.is_cone and abs(last.end - piece.start) <= TOUCHING:
            joined[-1] = dataclasses.replace(last, length=tidy(last.length + piece.length))
        else:
            joined.append(piece)
    return joined


def is_continuous(sections: Sequence[Cylinder]) -> bool:
    """Return whether sections form one piece, each beginning at the end of the previous one."""
    return bool(sections) and all(abs(a.end - b.start) <= TOUCHING for a, b in itertools.pairwise(sections))
