"""Bodies of a gearbox as a page draws them: rigid ones with their teeth, elastic ones with gears on their seats."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from exugear.gearbox.parts import seat_key
from exugear.report.pictures.motions import displacement_of, motions_of
from exugear.report.pictures.scene import body_colours
from exugear.report.pictures.shapes import BodyShape, bodies_of
from exugear.report.pictures.surfaces import Surface, gear_surface
from exugear.system.assembly import Assembly
from fe_ste.tools.arrays import Floats

SAME_SHAPE = 1e-6
"""Largest distance (m) between points of bodies that are drawn as one, turned."""


@dataclass(frozen=True)
class DrawnBody:
    """A body that a page draws."""

    shape: BodyShape
    colour: str
    """As ``#rrggbb``."""
    owner: str
    """Body whose seat a gear rides on; its own name otherwise."""
    field: NDArray[np.float32] | None = None
    """(p, 3, n) displacement of its points per coordinate of an elastic body; None for a body that moves as a whole."""


def drawn_bodies(assembly: Assembly) -> tuple[DrawnBody, ...]:
    """List all bodies of a gearbox that have a shape to draw, with the colours that they have in pictures."""
    shapes = bodies_of(assembly.gearbox)
    colours = {family: _written(colour) for family, colour in body_colours(shapes).items()}
    rigid = [
        DrawnBody(shape, colours[shape.family], shape.name)
        for shape in shapes
        if shape.name not in assembly.elastic_bodies
    ]
    return (*rigid, *_elastic(assembly, colours))


def _elastic(assembly: Assembly, colours: dict[str, str]) -> list[DrawnBody]:
    drawn = []
    for body in assembly.bodies:
        if body.name not in assembly.elastic_bodies:
            continue
        surface = assembly.elastic_bodies[body.name].reduced.surface
        quads = surface.quads
        # A triangle repeats its last corner: its second half has no area and is left out.
        whole = quads[:, 2] != quads[:, 3]
        triangles = np.concatenate([quads[:, [0, 1, 2]], quads[whole][:, [0, 2, 3]]])
        centre = np.array([*body.axis, body.centre_of_mass_z])
        shape = BodyShape(body.name, body.family, Surface(surface.points, triangles), centre, body.fixed)
        colour = colours.get(body.family, "#a0a8b0")
        drawn.append(DrawnBody(shape, colour, body.name, surface.displacement))
        for gear, z in {} if body.fixed else body.wheels.items():
            place = np.array([*body.axis, z])
            teeth = gear_surface(assembly.gearbox.gears[gear]).moved(place)
            drawn.append(DrawnBody(BodyShape(gear, gear, teeth, place), colour, body.name))
    return drawn


def _written(colour: tuple[float, float, float]) -> str:
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in colour)


@dataclass(frozen=True)
class DrawnMode:
    """A mode as a page draws it; the largest displacement of any point is 1 m."""

    motions: Floats
    """(bodies, 6) motion of each body as a whole; of one with a field zero."""
    fields: dict[int, Floats]
    """Mapping of place among the bodies to (p, 3) array. Displacement of the points of elastic bodies."""


def drawn_mode(assembly: Assembly, bodies: tuple[DrawnBody, ...], shape: Floats, with_fields: bool) -> DrawnMode:
    """Read how the bodies of an assembly move in a mode shape (size,).

    Parameters
    ----------
    shape : (size,)
    with_fields : whether elastic bodies deform; else they move as their main seats do
    """
    moving = motions_of(assembly.bodies, assembly.coordinates, assembly.rigid_part(shape))
    motions = np.zeros((len(bodies), 6))
    fields: dict[int, Floats] = {}
    for place, body in enumerate(bodies):
        if body.field is not None and with_fields:
            fields[place] = np.asarray(body.field @ shape[assembly.elastic_slices[body.owner]], dtype=np.float64)
        elif body.owner != body.shape.name and with_fields:
            seat = assembly.coordinates[seat_key(body.owner, body.shape.name)]
            motions[place] = np.append(shape, 0.0)[list(seat)]
        else:
            motions[place] = moving.get(body.owner, np.zeros(6))
            motions[place, :3] += np.cross(motions[place, 3:], body.shape.reference - _reference(assembly, body))
    largest = _largest(bodies, motions, fields)
    if largest > 0.0:
        motions /= largest
        fields = {place: field / largest for place, field in fields.items()}
    return DrawnMode(motions, fields)


def _reference(assembly: Assembly, body: DrawnBody) -> Floats:
    """Point that the motion of the owner as a whole belongs to: its centre of mass."""
    own = next((one for one in assembly.gearbox.bodies(assembly.inertias) if one.name == body.owner), None)
    if own is None:
        return body.shape.reference
    return np.array([*own.axis, own.centre_of_mass_z])


def _largest(bodies: tuple[DrawnBody, ...], motions: Floats, fields: dict[int, Floats]) -> float:
    sizes = [
        np.linalg.norm(fields[place] if place in fields else displacement_of(body.shape, motions[place]), axis=1).max()
        for place, body in enumerate(bodies)
    ]
    return float(max(sizes, default=0.0))


def turn_between(first: BodyShape, other: BodyShape) -> float | None:
    """Angle (rad) about z by which the points of one shape become those of another; None where no turn does.

    Planets of a set are drawn from the points of the first of them.
    """
    one = first.surface.points - first.reference
    two = other.surface.points - other.reference
    if one.shape != two.shape or not np.array_equal(first.surface.triangles, other.surface.triangles):
        return None
    cross = float(np.sum(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]))
    angle = math.atan2(cross, float(np.sum(one[:, :2] * two[:, :2])))
    cosine = math.cos(angle)
    sine = math.sin(angle)
    turned = one @ np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    if float(np.abs(turned - two).max()) < SAME_SHAPE:
        return angle
    return None
