"""Shafts from their sections, and the inertia of bodies from sections, gears and plates."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from exugear.exchange.rexs.to_case.bodies import Body
from exugear.exchange.rexs.to_case.notes import Notes, Places, needed, tidy
from exugear.exchange.rexs.to_case.toothing import Toothing, is_rigid, material_of
from exugear.exchange.rexs.tree import Component, Model, RexsError
from exugear.gearbox.units import MM
from fe_ste.geometry.cylinders import Tube, mass_properties

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
    """Hollow cylinder or cone about the z axis, mm and kg/m3, `aside` from the axis of its body (mm).

    For a cone, the diameters at its end differ from those at its beginning.
    """

    start: float
    length: float
    outer: float
    inner: float
    density: float
    aside: float = 0.0
    outer_end: float | None = None
    inner_end: float | None = None

    @property
    def tube(self) -> Tube:
        """The same piece in m."""
        outer_end, inner_end = (None if end is None else MM * end for end in (self.outer_end, self.inner_end))
        return Tube(
            start=MM * self.start,
            length=MM * self.length,
            outer=MM * self.outer,
            inner=MM * self.inner,
            density=self.density,
            outer_end=outer_end,
            inner_end=inner_end,
            aside=MM * self.aside,
        )

    @property
    def outers(self) -> tuple[float, float]:
        """Outer diameters at both ends, mm."""
        return self.outer, self.outer if self.outer_end is None else self.outer_end

    @property
    def inners(self) -> tuple[float, float]:
        """Inner diameters at both ends, mm."""
        return self.inner, self.inner if self.inner_end is None else self.inner_end

    @property
    def mass(self) -> float:
        """Mass, kg."""
        return mass_properties([self.tube]).mass

    @property
    def is_cone(self) -> bool:
        """Whether a diameter changes along the piece."""
        return self.outer_end is not None or self.inner_end is not None

    def part(self, start: float, stop: float) -> Cylinder:
        """Return the part between two axial positions, mm."""
        if not self.is_cone:
            return dataclasses.replace(self, start=start, length=tidy(stop - start))
        shares = [(place - self.start) / self.length for place in (start, stop)]
        outer, outer_end, inner, inner_end = (
            tidy(round(low + share * (high - low), 9)) for low, high in (self.outers, self.inners) for share in shares
        )
        ends = {"outer": outer, "outer_end": outer_end, "inner": inner, "inner_end": inner_end}
        return dataclasses.replace(self, start=start, length=tidy(stop - start), **ends)


@dataclass(frozen=True)
class Inertia:
    """Mass (kg), moments of inertia about the centre of mass (kg m2) and its axial position (mm)."""

    mass: float
    axial: float
    transverse: float
    centre: float


def inertia_of(cylinders: Iterable[Cylinder]) -> Inertia:
    """Total inertia of cylinders; eccentric ones are treated as evenly distributed around the axis.

    Examples
    --------
    >>> disc = inertia_of([Cylinder(0.0, 100.0, 200.0, 0.0, 7850.0)])
    >>> round(disc.mass, 3), round(disc.axial, 5), round(disc.transverse, 5), round(disc.centre, 6)
    (24.662, 0.12331, 0.08221, 50.0)
    """
    properties = mass_properties(cylinder.tube for cylinder in cylinders)
    return Inertia(properties.mass, properties.axial, properties.transverse, 1e3 * properties.centre)


def sections_of(model: Model, places: Places, shaft: Component, body: Body, notes: Notes) -> list[Cylinder]:
    """Sections of a shaft in the order of z.

    Raises
    ------
    RexsError
        A section has no length or diameter.
    """
    owned = [
        one
        for kind in ("assembly", "ordered_assembly")
        for one in model.related(kind, "assembly", shaft.number, "part")
        if one.type == "shaft_section"
    ]
    if not owned or not shaft.given("support_vector"):
        return []
    x, y, origin = places.position(shaft)
    sense = places.sense(shaft)
    density = _density(model, shaft, notes)
    aside = math.dist((x, y), body.axis)
    pieces: list[Cylinder] = []
    for section in owned:
        for start, length, outers, inners in _pieces(section, len(owned), notes):
            begin = origin + (start if sense > 0 else -start - length)
            (outer, outer_end), (inner, inner_end) = (
                pair if sense > 0 or pair[1] is None else (pair[1], pair[0]) for pair in (outers, inners)
            )
            place = tidy(round(begin, 6)), tidy(length)
            pieces.append(Cylinder(*place, outer, inner, density, round(aside, 6), outer_end, inner_end))
    return sorted(pieces, key=lambda one: one.start)


_Ends = tuple[float, float | None]


def _pieces(section: Component, count: int, notes: Notes) -> list[tuple[float, float, _Ends, _Ends]]:
    """(start, length, outer, inner) of pieces of a section along u, mm; diameters at the beginning and end."""
    if not section.attributes:
        notes.ignored.append(f"{section}: has no values")
        return []
    start = section.quantity("u_coordinate_on_shaft", "mm")
    if start is None and count == 1:
        start = 0.0
    start = needed(start, section, "u_coordinate_on_shaft")
    length = needed(section.quantity("length", "mm"), section, "length")
    begin = needed(section.quantity("outer_diameter_begin", "mm"), section, "outer_diameter_begin")
    end = section.quantity("outer_diameter_end", "mm")
    bore = section.quantity("inner_diameter_begin", "mm") or 0.0
    bore_end = section.quantity("inner_diameter_end", "mm")
    end = begin if end is None else end
    bore_end = bore if bore_end is None else bore_end
    if length <= 0.0 or min(begin, end) <= 0.0 or bore >= begin or bore_end >= end:
        raise RexsError(f"{section}: length and diameters of {length:g}, {begin:g} and {bore:g} mm are not a section")
    if begin == end and bore == bore_end:
        return [(start, length, (begin, None), (bore, None))]
    return [(start, length, (begin, end), (bore, bore_end))]


def _density(model: Model, part: Component, notes: Notes) -> float:
    """Density of a component, kg/m3; zero if its material represents a rigid body and has no density."""
    material = material_of(model, part)
    density = material.quantity("density", "kg / m^3") if material else None
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
    under = [
        section
        for section in sections
        if section.start < high - TOUCHING and section.start + section.length > low + TOUCHING
    ]
    if not under:
        return None
    if internal:
        return min(end for one in under for end in one.inners)
    return max(end for one in under for end in one.outers)


def gear_tube(model: Model, gear: Toothing, z: float, seat: float | None, aside: float, notes: Notes) -> Cylinder:
    """Gear as a tube from its seat to its reference circle."""
    helix = math.radians(gear.helix_angle.value)
    reference = gear.teeth * gear.module.value / math.cos(helix)
    width = gear.face_width.value
    inner, outer = (reference, seat or reference) if gear.internal else (min(seat or 0.0, reference), reference)
    return Cylinder(z - 0.5 * width, width, outer, inner, _density(model, gear.part, notes), aside)


def plate(model: Model, places: Places, part: Component, notes: Notes) -> Cylinder | None:
    """Side plate of a carrier."""
    length = part.quantity("length", "mm")
    outer = part.quantity("outer_diameter", "mm")
    if not length or not outer:
        return None
    origin = places.position(part)[2]
    start = origin if places.sense(part) > 0 else origin - length
    return Cylinder(start, length, outer, part.quantity("inner_diameter", "mm") or 0.0, _density(model, part, notes))


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
        under = [one for one in pieces if low - TOUCHING < one.start and one.start + one.length < high + TOUCHING]
        outers = [end for one in under for end in one.outers]
        if len(under) < 2 or len(set(outers)) < 2 or min(outers) < (1.0 - LEVELLED) * max(outers):
            continue
        least = min(outers)
        most = max(outers)
        notes.changed.append(f"{name}: shaft of {least:g} to {most:g} mm under it modelled as {most:g}")
        pieces = [dataclasses.replace(one, outer=most, outer_end=None) if one in under else one for one in pieces]
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
    end = piece.start + piece.length
    inside = [place for place in places if piece.start + TOUCHING < place < end - TOUCHING]
    for start, stop in itertools.pairwise([piece.start, *inside, end]):
        yield piece.part(start, stop) if inside else dataclasses.replace(piece, length=tidy(stop - start))


def _merged(pieces: Sequence[Cylinder]) -> list[Cylinder]:
    """Join adjacent pieces of equal diameters."""
    joined: list[Cylinder] = []
    for piece in pieces:
        last = joined[-1] if joined else None
        alike = last is not None and dataclasses.replace(last, start=piece.start, length=piece.length) == piece
        if last is not None and alike and not piece.is_cone and abs(last.start + last.length - piece.start) <= TOUCHING:
            joined[-1] = dataclasses.replace(last, length=tidy(last.length + piece.length))
        else:
            joined.append(piece)
    return joined


def is_continuous(sections: Sequence[Cylinder]) -> bool:
    """Return whether sections form one piece, each beginning at the end of the previous one."""
    ends = itertools.pairwise(sections)
    return bool(sections) and all(abs(a.start + a.length - b.start) <= TOUCHING for a, b in ends)
