"""Turned shafts as their sections and seats: what can be turned, and where a seat lies, before any mesh."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

MOST_ELEMENTS = 50_000
"""Most elements over a half-section: 10 m of shaft with 3 m diameter; 4 GB."""
SAME = 1e-9
"""Two places (m) this close are one."""
REACH = 2e-3
"""Length (m) by which a seat may reach across a shoulder or the end of its shaft: chamfers, and rounded drawings."""
REACHING_SHARE = 0.25
"""Part of its width by which it may at most."""


class ShaftError(ValueError):
    """A shaft that cannot be, or a seat that does not lie on it."""


@dataclass(frozen=True)
class ShaftSection:
    """A piece of a shaft, a cylinder or cone: length, outer and inner diameter where it begins, m.

    Raises
    ------
    ShaftError
        Length or outer diameter not positive, no wall between the diameters, or a bore that begins in the full.
    """

    length: float
    outer_diameter: float
    inner_diameter: float = 0.0
    outer_diameter_end: float | None = None
    inner_diameter_end: float | None = None
    """Where it ends, of a cone; those of its beginning if not given."""

    def __post_init__(self) -> None:
        """Refuse what cannot be turned."""
        if self.length <= 0.0 or self.outer_diameter <= 0.0 or not 0.0 <= self.inner_diameter < self.outer_diameter:
            raise ShaftError(
                f"section of length {self.length:g} m and diameters {self.outer_diameter:g} over "
                f"{self.inner_diameter:g} m: a positive length and wall thickness are required"
            )
        if not 0.0 <= self.inner_end < self.outer_end:
            raise ShaftError(
                f"section that ends with diameters {self.outer_end:g} over {self.inner_end:g} m: a positive wall "
                "thickness is required there"
            )
        if (self.inner_diameter == 0.0) != (self.inner_end == 0.0):
            raise ShaftError(
                f"section with a bore of {self.inner_diameter:g} m at its start and {self.inner_end:g} m at its end: "
                "a cone tip cannot be meshed; set a bore diameter at both ends, or split the section"
            )

    @property
    def outer_end(self) -> float:
        """Outer diameter where it ends, m."""
        if self.outer_diameter_end is None:
            return self.outer_diameter
        return self.outer_diameter_end

    @property
    def inner_end(self) -> float:
        """Inner diameter where it ends, m."""
        if self.inner_diameter_end is None:
            return self.inner_diameter
        return self.inner_diameter_end

    def outer_at(self, place: float) -> float:
        """Outer diameter so far (m) from where it begins, m."""
        share = min(max(place / self.length, 0.0), 1.0)
        return self.outer_diameter + share * (self.outer_end - self.outer_diameter)

    @property
    def is_cone(self) -> bool:
        """Whether a diameter changes along it."""
        return self.outer_end != self.outer_diameter or self.inner_end != self.inner_diameter


@dataclass(frozen=True)
class MeshSize:
    """Element sizes over the half-section."""

    axial: float = 0.025
    radial: float = 0.0125
    """Largest element, m."""
    grading: int = 3
    """Number of lines that close in on each shoulder."""


STANDARD_SIZE = MeshSize()


@dataclass(frozen=True)
class SeatBand:
    """Where something sits on a shaft: a band of the outer surface, or a plane cross-section if it has no width."""

    name: str
    z: float
    """Middle, m from the beginning of the first section."""
    width: float = 0.0
    """m; 0 for the cross-section."""


def locate(sections: Sequence[ShaftSection], seat: SeatBand, start: float = 0.0) -> tuple[int, float, float]:
    """Find the number of the section under a seat, lower and upper edge (m); neighbours of one diameter count as one.

    Parameters
    ----------
    start : where the first section begins in the file (m), for messages

    Raises
    ------
    ShaftError
        The seat lies outside the shaft or across a step.
    """
    places = np.concatenate([[0.0], np.cumsum([section.length for section in sections])])
    low = seat.z - seat.width / 2.0
    high = seat.z + seat.width / 2.0
    limits = f"{1e3 * (start + low):.6g}", f"{1e3 * (start + high):.6g}"
    if low < -SAME or high > places[-1] + SAME:
        raise ShaftError(
            f"seat {seat.name}: extends from z = {limits[0]} to {limits[1]} mm, the shaft from {1e3 * start:.6g} to "
            f"{1e3 * (start + places[-1]):.6g} mm"
        )
    under = [
        number
        for number, (start, end) in enumerate(itertools.pairwise(places))
        if (start < high - SAME and end > low + SAME) or (seat.width == 0.0 and start - SAME <= low <= end + SAME)
    ]
    ends = {diameter for number in under for diameter in (sections[number].outer_diameter, sections[number].outer_end)}
    if seat.width > 0.0 and len(under) > 1 and len(ends) > 1:
        raise ShaftError(
            f"seat {seat.name}: a shoulder lies between z = {limits[0]} and {limits[1]} mm; move or narrow it"
        )
    return max(under, key=lambda number: sections[number].outer_at(seat.z - float(places[number]))), low, high


def narrowed(sections: Sequence[ShaftSection], seat: SeatBand) -> SeatBand:
    """Return a seat that slightly crosses a shoulder, or the shaft end, as one that ends there.

    It stays centred about its middle, where the load of the mounted part acts, so that the other side is shortened
    equally. A seat that extends further is unchanged; `locate` refuses it.

    Examples
    --------
    A bearing of 20 mm whose shoulder is 19 mm from its far side:

    >>> sections = (ShaftSection(0.019, 0.040), ShaftSection(0.100, 0.050))
    >>> round(narrowed(sections, SeatBand("bearing", 0.010, 0.020)).width, 6)
    0.018
    """
    places = np.concatenate([[0.0], np.cumsum([section.length for section in sections])])
    outer = [section.outer_diameter for section in sections]
    ends = [section.outer_end for section in sections]
    steps = [n for n in range(1, len(sections)) if outer[n] != ends[n - 1]]
    half = min((abs(seat.z - float(places[n])) for n in (0, *steps, len(sections))), default=0.0)
    across = seat.width / 2.0 - half
    if not SAME < across <= min(REACH, REACHING_SHARE * seat.width) + SAME:
        return seat
    return replace(seat, width=2.0 * half)


def check_shaft(sections: Sequence[ShaftSection], seats: Sequence[SeatBand], start: float = 0.0) -> None:
    """Refuse a shaft before it is meshed with elements of `STANDARD_SIZE`.

    Parameters
    ----------
    start : where it begins in the file (m), for messages

    Raises
    ------
    ShaftError
        Sections that do not touch each other, seats that do not lie on them, or more elements than memory holds.
    """
    check_sections(tuple(sections))
    for seat in seats:
        locate(sections, seat, start)
    length = sum(s.length for s in sections)
    radius = max(max(s.outer_diameter, s.outer_end) for s in sections) / 2.0
    elements = length / STANDARD_SIZE.axial * radius / STANDARD_SIZE.radial
    if elements > MOST_ELEMENTS:
        raise ShaftError(
            f"a shaft of {length:g} m length and {2.0 * radius:g} m diameter requires {elements:.0f} elements over "
            f"its section; at most {MOST_ELEMENTS} are permitted"
        )


def check_sections(sections: tuple[ShaftSection, ...]) -> None:
    """Refuse sections that do not make one shaft.

    Raises
    ------
    ShaftError
        No section, or neighbours that do not touch.
    """
    if not sections:
        raise ShaftError("a shaft needs at least one section")
    for number, (left, right) in enumerate(itertools.pairwise(sections), start=1):
        if min(left.outer_end, right.outer_diameter) <= max(left.inner_end, right.inner_diameter):
            raise ShaftError(
                f"sections {number} and {number + 1} are not connected: one fits into the bore of the other"
            )
