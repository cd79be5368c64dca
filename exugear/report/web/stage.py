"""Bodies and mode shapes as data for the animated 3-D view of a page."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import seat_key
from exugear.report.pictures.scene import DISPLACEMENT_COLOURS, body_colours
from exugear.report.pictures.shapes import (
    BodyShape,
    TriangleSurface,
    bodies_of,
    largest_displacement,
    motions_of,
    shapes_at_seats,
    turned,
    vibration_of,
)
from exugear.report.web.document import ArrayStore, rounded, rounded_list
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Complexes, Floats

# Bodies of a gearbox for the page: rigid ones with their teeth, flexible ones with gears on their seats

SAME_SHAPE = 1e-6
"""Maximum distance (m) between points of bodies that are drawn as rotated copies of one shape."""


@dataclass(frozen=True)
class DrawnBody:
    """Body drawn in a page."""

    shape: BodyShape
    colour: str
    """As ``#rrggbb``."""
    owner: str
    """Body that has the seat of a gear; otherwise its own name."""
    field: NDArray[np.float32] | None = None
    """(p, 3, n) displacement of its points per coordinate of a flexible body; None for a rigid-body motion."""


def drawn_bodies(assembly: Assembly) -> tuple[DrawnBody, ...]:
    """List all bodies of a gearbox that have a shape to draw, with their colours from the pictures."""
    bodies = rigid_bodies(assembly.gearbox)
    colours = {body.shape.family: body.colour for body in bodies}
    rigid = (body for body in bodies if body.owner not in assembly.elastic_bodies)
    return (*rigid, *_elastic(assembly, colours))


def rigid_bodies(gearbox: Gearbox) -> tuple[DrawnBody, ...]:
    """List all bodies of a gearbox that have a shape to draw, as rigid ones."""
    from matplotlib.colors import to_hex

    shapes = bodies_of(gearbox)
    colours = body_colours(shapes)
    return tuple(DrawnBody(shape, to_hex(colours[shape.family]), shape.name) for shape in shapes)


def _elastic(assembly: Assembly, colours: dict[str, str]) -> list[DrawnBody]:
    drawn = []
    for body in assembly.bodies:
        if body.name not in assembly.elastic_bodies:
            continue
        surface = assembly.elastic_bodies[body.name].reduced.surface
        quads = surface.quads
        # A triangle repeats its last corner; its second half has no area and is skipped.
        whole = quads[:, 2] != quads[:, 3]
        triangles = np.concatenate([quads[:, [0, 1, 2]], quads[whole][:, [0, 2, 3]]])
        centre = np.array([*body.axis, body.centre_of_mass_z])
        shape = BodyShape(body.name, body.family, TriangleSurface(surface.points, triangles), centre, body.fixed)
        colour = colours.get(body.family, "#a0a8b0")
        drawn.append(DrawnBody(shape, colour, body.name, surface.displacement))
        drawn += [DrawnBody(seated, colour, body.name) for seated in shapes_at_seats(assembly.gearbox, body)]
    return drawn


@dataclass(frozen=True)
class DrawnMode:
    """Vibration for drawing in a page: complex amplitudes, with the largest displacement 1 m of any point at time 0.

    All imaginary parts of a mode shape are 0.
    """

    motions: Complexes
    """(bodies, 6) rigid-body motion of each body; zero for a body with a field."""
    fields: dict[int, Complexes]
    """(p, 3) displacement of the points of flexible bodies, by the index of the body."""


def drawn_mode(
    assembly: Assembly, bodies: tuple[DrawnBody, ...], shape: Floats | Complexes, with_fields: bool
) -> DrawnMode:
    """Return the motion of the bodies of an assembly in a mode shape or an operating deflection shape.

    Parameters
    ----------
    shape : (size,) real or complex
    with_fields : whether flexible bodies deform; otherwise they move rigidly with their main seats
    """
    motions = np.zeros((len(bodies), 6), dtype=np.complex128)
    fields: dict[int, Complexes] = {}
    parts = [(1.0 + 0.0j, np.real(shape))]
    if np.imag(shape).any():
        parts.append((1.0j, np.imag(shape)))
    for unit, part in parts:
        own, deformed = _moving(assembly, bodies, part, with_fields)
        motions += unit * own
        for place, field in deformed.items():
            fields[place] = unit * field + fields.get(place, np.complex128(0.0))
    vibrations = [fields.get(place, vibration_of(b.shape, motions[place])) for place, b in enumerate(bodies)]
    largest = largest_displacement(vibrations) or 1.0
    return DrawnMode(motions / largest, {place: field / largest for place, field in fields.items()})


def _moving(
    assembly: Assembly, bodies: tuple[DrawnBody, ...], shape: Floats, with_fields: bool
) -> tuple[Floats, dict[int, Floats]]:
    """Return motions (bodies, 6) and fields of the bodies for real coordinates (size,)."""
    moving = motions_of(assembly.bodies, assembly.coordinates, assembly.rigid_part(shape))
    centres = {own.name: np.array([*own.axis, own.centre_of_mass_z]) for own in assembly.bodies}
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
            arm = body.shape.reference - centres.get(body.owner, body.shape.reference)
            motions[place, :3] += np.asarray(turned(motions[place, 3:], arm), dtype=np.float64)
    return motions, fields


def turn_between(first: BodyShape, other: BodyShape) -> float | None:
    """Return the rotation angle (rad) about z from one shape to another; None if they differ otherwise.

    The planets of a set are drawn from the points of the first one.
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
    return angle if float(np.abs(turned - two).max()) < SAME_SHAPE else None


# Bodies and mode shapes as data for the animated 3-D view

LARGEST = 0.035
"""Largest displacement drawn, over the diagonal of the scene, as in pictures."""
_U16 = 65535


def stage_data(
    assembly: Assembly,
    shapes: Floats | Complexes,
    labels: Mapping[str, str],
    arrays: ArrayStore,
    deformed: Collection[int],
) -> dict[str, Any]:
    """Return the data of a model for the 3-D view: its bodies and their motions.

    Parameters
    ----------
    shapes : (size, modes) mode shapes, or complex operating deflection shapes
    labels : mapping of name to label
        For bodies and gears.
    arrays : store for the points, triangles and motions
    deformed : modes in which flexible bodies deform; in the others they move rigidly, which needs less memory
    """
    bodies = drawn_bodies(assembly)
    return {**bodies_data(bodies, labels, arrays), **motions_data(assembly, bodies, shapes, arrays, deformed)}


def bodies_data(bodies: tuple[DrawnBody, ...], labels: Mapping[str, str], arrays: ArrayStore) -> dict[str, Any]:
    """Return the bodies of a 3-D view, and the size of the scene."""
    # A rotor with given inertias only has no shape to draw; the view is then empty.
    points = np.concatenate([np.zeros((0, 3)), *(body.shape.surface.points for body in bodies)])
    low, high = (points.min(axis=0), points.max(axis=0)) if bodies else (np.zeros(3), np.ones(3))
    firsts: dict[str, DrawnBody] = {}
    listed = []
    for body in bodies:
        # Each shape is stored once, with points in 16 bits of its bounding box: 15 µm per metre.
        first = firsts.setdefault(body.shape.family, body)
        turn = turn_between(first.shape, body.shape)
        drawn = body if turn is None else first
        local = drawn.shape.surface.points - drawn.shape.reference
        start = local.min(axis=0)
        span = np.maximum(np.ptp(local, axis=0), 1e-9)
        kind = "u2" if len(local) <= _U16 else "u4"
        listed.append(
            {
                "name": body.shape.name,
                "label": labels.get(body.shape.name, body.shape.name),
                "owner": body.owner,
                "fixed": body.shape.fixed,
                "elastic": body.field is not None,
                "colour": body.colour,
                "reference": rounded_list(body.shape.reference, 7),
                "turn": rounded(turn or 0.0, 8),
                "low": rounded_list(start, 7),
                "span": rounded_list(span, 7),
                "points": arrays.add(np.round((local - start) / span * _U16).astype("u2"), differences=True),
                "triangles": arrays.add(drawn.shape.surface.triangles.astype(kind), differences=True),
            }
        )
    return {
        "bodies": listed,
        "centre": rounded_list(0.5 * (low + high), 6),
        "diagonal": rounded(float(np.linalg.norm(high - low)), 6),
        "amplitude": LARGEST,
        "colours": list(DISPLACEMENT_COLOURS),
    }


def motions_data(
    assembly: Assembly,
    bodies: tuple[DrawnBody, ...],
    shapes: Floats | Complexes,
    arrays: ArrayStore,
    deformed: Collection[int] = (),
) -> dict[str, Any]:
    """Return the motions of the bodies of a 3-D view in mode shapes (size, modes)."""
    modes = [drawn_mode(assembly, bodies, shapes[:, n], n in deformed) for n in range(shapes.shape[1])]
    fields = {place: n for n, place in enumerate(p for p, body in enumerate(bodies) if body.field is not None)}
    return {
        "motions": arrays.add(np.array([_parts(mode.motions) for mode in modes], dtype="f4")),
        "deformed": {
            str(n): {
                str(place): arrays.add(np.round(127.0 * _parts(modes[n].fields[place].T)).astype("i1"))
                for place in fields
            }
            for n in sorted(deformed)
            if fields
        },
    }


def _parts(amplitudes: Complexes) -> Floats:
    """Return real and imaginary parts along a new first axis."""
    return np.stack([amplitudes.real, amplitudes.imag])
