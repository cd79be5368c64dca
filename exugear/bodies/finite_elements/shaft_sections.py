"""Turned shafts as their sections and seats: what can be turned, and where a seat lies, before any mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

MOST_ELEMENTS = 50_000
"""Most elements over a half-section: 10 m of shaft with 3 m diameter; 4 GB."""
SAME = 1e-9
"""Two places (m) this close are one."""


class ShaftError(ValueError):
    """A shaft that cannot be, or a seat that does not lie on it."""


@dataclass(frozen=True)
class ShaftSection:
    """A cylindrical piece of a shaft: length, outer and inner diameter, m.

    Raises
    ------
    ShaftError
        Length or outer diameter not positive, or no wall between the diameters.
    """

    length: float
    outer_diameter: float
    inner_diameter: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what cannot be turned."""
        if self.length <= 0.0 or self.outer_diameter <= 0.0 or not 0.0 <= self.inner_diameter < self.outer_diameter:
            raise ShaftError(
                f"section of length {self.length:g} m and diameters {self.outer_diameter:g} over "
                f"{self.inner_diameter:g} m: it needs a positive length and a wall"
            )


@dataclass(frozen=True)
class MeshSize:
    """Element sizes over the half-section.

    Attributes
    ----------
    axial, radial : largest element, m
    grading : number of lines that close in on each shoulder
    """

    axial: float = 0.025
    radial: float = 0.0125
    grading: int = 3


STANDARD_SIZE = MeshSize()


@dataclass(frozen=True)
class SeatBand:
    """Where something sits on a shaft: a band of the outer surface, or a plane cross-section if it has no width.

    Attributes
    ----------
    z : middle, m from the beginning of the first section
    width : m; 0 for the cross-section
    """

    name: str
    z: float
    width: float = 0.0


def locate(sections: Sequence[ShaftSection], seat: SeatBand) -> tuple[ShaftSection, float, float]:
    """Section under a seat, lower and upper edge (m); neighbours of one diameter count as one.

    Raises
    ------
    ShaftError
        The seat lies outside the shaft or across a step.
    """
    ends = np.concatenate([[0.0], np.cumsum([section.length for section in sections])])
    low, high = seat.z - seat.width / 2.0, seat.z + seat.width / 2.0
    if low < -SAME or high > ends[-1] + SAME:
        raise ShaftError(f"seat {seat.name}: it reaches from {low:g} to {high:g} m, the shaft from 0 to {ends[-1]:g} m")
    under = [
        section
        for section, start, end in zip(sections, ends[:-1], ends[1:], strict=True)
        if (start < high - SAME and end > low + SAME) or (seat.width == 0.0 and start - SAME <= low <= end + SAME)
    ]
    if seat.width > 0.0 and len({section.outer_diameter for section in under}) > 1:
        raise ShaftError(f"seat {seat.name}: a shoulder lies between {low:g} and {high:g} m; move or narrow it")
    return max(under, key=lambda section: section.outer_diameter), low, high


def check_shaft(sections: Sequence[ShaftSection], seats: Sequence[SeatBand], size: MeshSize = STANDARD_SIZE) -> None:
    """Refuse a shaft before it is meshed.

    Raises
    ------
    ShaftError
        Sections that do not touch each other, seats that do not lie on them, or more elements than memory holds.
    """
    check_sections(tuple(sections))
    for seat in seats:
        locate(sections, seat)
    length, radius = sum(s.length for s in sections), max(s.outer_diameter for s in sections) / 2.0
    elements = length / size.axial * radius / size.radial
    if elements > MOST_ELEMENTS:
        raise ShaftError(
            f"a shaft of {length:g} m and {2.0 * radius:g} m diameter needs {elements:.0f} elements over its section; "
            f"{MOST_ELEMENTS} are the most"
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
    for number, (left, right) in enumerate(zip(sections[:-1], sections[1:], strict=True), start=1):
        if min(left.outer_diameter, right.outer_diameter) <= max(left.inner_diameter, right.inner_diameter):
            raise ShaftError(f"sections {number} and {number + 1} do not touch: the bore of one clears the other")
