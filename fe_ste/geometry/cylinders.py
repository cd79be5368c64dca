"""Mass and moments of inertia of hollow cylinders and cones on one axis, as shafts and gear bodies are made of them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Tube:
    """Hollow cylinder or cone about the z axis."""

    start: float
    length: float
    """In m."""
    outer: float
    inner: float
    """Diameters at its start, m."""
    density: float
    """kg/m^3."""
    outer_end: float | None = None
    inner_end: float | None = None
    """Diameters at its end, m; those of its start if not given."""
    aside: float = 0.0
    """Distance of its axis from the z axis, m; it stands for several that are spread evenly around."""


@dataclass(frozen=True)
class MassProperties:
    """Mass (kg), moments of inertia about the centre of mass, along and across the axis (kg m^2), and its place (m)."""

    mass: float
    axial: float
    transverse: float
    centre: float


def mass_properties(tubes: Iterable[Tube]) -> MassProperties:
    """Mass properties of tubes together; all zero if they have no mass.

    With r(z) straight from a to b over the length L, a solid cone has the integrals over z of r^2, z r^2, z^2 r^2 and
    r^4 in closed form; a hollow one is the difference of two.

    Examples
    --------
    >>> disc = mass_properties([Tube(start=0.0, length=0.1, outer=0.2, inner=0.0, density=7850.0)])
    >>> round(disc.mass, 3), round(disc.axial, 5), round(disc.transverse, 5), round(disc.centre, 5)
    (24.662, 0.12331, 0.08221, 0.05)
    """
    return together(_cylinder_inertia(tube) for tube in tubes)


def together(bodies: Iterable[MassProperties]) -> MassProperties:
    """Mass properties of several bodies on one axis, as one."""
    parts = [body for body in bodies if body.mass > 0.0]
    mass = sum(part.mass for part in parts)
    if mass <= 0.0:
        return MassProperties(0.0, 0.0, 0.0, 0.0)
    centre = sum(part.mass * part.centre for part in parts) / mass
    transverse = sum(part.transverse + part.mass * (part.centre - centre) ** 2 for part in parts)
    return MassProperties(mass, sum(part.axial for part in parts), transverse, centre)


def _cylinder_inertia(tube: Tube) -> MassProperties:
    outer_end = tube.outer if tube.outer_end is None else tube.outer_end
    inner_end = tube.inner if tube.inner_end is None else tube.inner_end
    outside, inside = (
        _integrals(0.5 * one, 0.5 * other, tube.length)
        for one, other in ((tube.outer, outer_end), (tube.inner, inner_end))
    )
    area, first, second, fourth = (tube.density * math.pi * (a - b) for a, b in zip(outside, inside, strict=True))
    if area <= 0.0:
        return MassProperties(0.0, 0.0, 0.0, 0.0)
    centre = first / area
    axial = 0.5 * fourth + area * tube.aside**2
    transverse = 0.25 * fourth + second - area * centre**2 + 0.5 * area * tube.aside**2
    return MassProperties(area, axial, transverse, tube.start + centre)


def _integrals(a: float, b: float, length: float) -> tuple[float, float, float, float]:
    """Integrals over the length of r^2, z r^2, z^2 r^2 and r^4 for r straight from a to b."""
    square = length * (a * a + a * b + b * b) / 3.0
    first = length**2 * (a * a + 2.0 * a * b + 3.0 * b * b) / 12.0
    second = length**3 * (a * a + 3.0 * a * b + 6.0 * b * b) / 30.0
    fourth = length * (a**4 + a**3 * b + a**2 * b**2 + a * b**3 + b**4) / 5.0
    return square, first, second, fourth
