"""What the bodies of a gearbox look like: gears whose teeth mesh, plain shafts and carriers.

NumPy alone. Frame of the gearbox: z along the shafts, lengths in m.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Body, Mesh
from exugear.report.pictures.surfaces import Surface, gear_surface, tube_surface
from fe_ste.tools.arrays import Floats


@dataclass(frozen=True)
class BodyShape:
    """What a body looks like."""

    name: str
    family: str
    """Name that equal bodies share, such as the planets of a set."""
    surface: Surface
    """In the frame of the gearbox, at rest."""
    reference: Floats
    """(3,) point whose displacement describes the body's motion, its centre of mass, m."""
    fixed: bool = False
    """Drawn translucent: a ring hides its planets."""


def bodies_of(gearbox: Gearbox) -> tuple[BodyShape, ...]:
    """Shapes of all bodies of a gearbox that have wheels or carry planets.

    Parameters
    ----------
    gearbox : the gearbox; its teeth are turned so that they mesh

    Returns
    -------
    gears as they are, shafts and carrier as plain cylinders that only show what belongs together

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [body.name for body in bodies_of(gearbox)]
    ['housing', 'carrier', 'planet_1', 'planet_2', 'planet_3', 'lss', 'ims', 'hss']
    """
    angles = tooth_angles(gearbox.meshes)
    shapes = []
    for body in gearbox.bodies():
        planets = [planet for planet in gearbox.bodies() if planet.carrier == body.name]
        parts = [
            gear_surface(gearbox.gears[name], angles.get((body.name, name), 0.0), _rim(gearbox, body, name)).moved(
                [*body.axis, z]
            )
            for name, z in body.wheels.items()
        ]
        parts += _shaft(gearbox, body) + _carrier(gearbox, body, planets)
        if parts:
            reference = np.array([*body.axis, body.centre_of_mass_z])
            shapes.append(BodyShape(body.name, body.family, Surface.joined(parts), reference, body.fixed))
    return tuple(shapes)


def tooth_angles(meshes: Sequence[Mesh]) -> dict[tuple[str, str], float]:
    """Turn the gears of a train so that teeth of each meet spaces of its mates.

    Parameters
    ----------
    meshes : all meshes at work

    Returns
    -------
    dict
        Polar angle (rad) of the middle of a tooth in the middle plane, by names of body and gear. Where a gear has
        several mates, the assembly condition of the train makes them agree.
    """
    angles: dict[tuple[str, str], float] = {}
    waiting = list(meshes)
    while waiting:
        mesh = next((m for m in waiting if _ends(m)[0] in angles or _ends(m)[1] in angles), waiting[0])
        waiting.remove(mesh)
        pinion, gear = _ends(mesh)
        if gear in angles and pinion not in angles:
            angles[pinion] = _mating_angle(mesh, angles[gear], backwards=True)
        else:
            angles.setdefault(gear, _mating_angle(mesh, angles.setdefault(pinion, 0.0), backwards=False))
    return angles


def _ends(mesh: Mesh) -> tuple[tuple[str, str], tuple[str, str]]:
    """Names of body and gear at both ends of a mesh."""
    return (mesh.pinion, mesh.pair.pinion.name), (mesh.gear, mesh.pair.gear.name)


def _mating_angle(mesh: Mesh, angle: float, *, backwards: bool) -> float:
    """Angle of the other gear's tooth when a tooth of one gear stands at `angle`."""
    # The pitch point lies towards gear 2 between external gears, and beyond gear 1 inside a ring.
    gears = (mesh.pair.pinion, mesh.pair.gear)
    facing = math.pi if gears[1].internal else 0.0
    towards = (mesh.position_angle + facing, mesh.position_angle + math.pi)
    sense = 1.0 if gears[1].internal else -1.0
    known, mate = (1, 0) if backwards else (0, 1)
    twists = [math.tan(gear.base_helix_angle) / gear.base_radius for gear in gears]
    at_mesh = angle + twists[known] * mesh.offsets[known]
    # In pitches, from the tooth to the pitch point; there the mate has a space, half a pitch beside its tooth.
    pitches = (towards[known] - at_mesh) / gears[known].angular_pitch
    return towards[mate] - (sense * pitches + 0.5) * gears[mate].angular_pitch - twists[mate] * mesh.offsets[mate]


def _shaft_diameter(gearbox: Gearbox, body: Body) -> float:
    return 0.9 * min(gearbox.gears[name].held_diameter for name in body.wheels)


def _has_shaft(body: Body) -> bool:
    return bool(body.wheels) and not body.fixed and body.carrier is None


def _rim(gearbox: Gearbox, body: Body, gear: str) -> float | None:
    """Wheels reach down to their shaft; planets and rings end where they are held."""
    if _has_shaft(body) and not gearbox.gears[gear].internal:
        return _shaft_diameter(gearbox, body)
    return None


def _shaft(gearbox: Gearbox, body: Body) -> list[Surface]:
    if not _has_shaft(body):
        return []
    ends = [z + side * 0.5 * gearbox.gears[name].face_width for name, z in body.wheels.items() for side in (-1.0, 1.0)]
    ends += [bearing.position[2] for bearing in gearbox.bearings if bearing.body == body.name]
    margin = 0.02
    shaft = tube_surface(_shaft_diameter(gearbox, body), min(ends) - margin, max(ends) + margin, centre=body.axis)
    return [shaft]


def _carrier(gearbox: Gearbox, body: Body, planets: Sequence[Body]) -> list[Surface]:
    """Pins through the planets and a plate behind them, towards +z, that leaves the view on the planets free."""
    parts = []
    for planet in planets:
        for name, z in planet.wheels.items():
            gear = gearbox.gears[name]
            reach = 0.5 * gear.face_width + 0.015
            parts.append(tube_surface(0.6 * gear.held_diameter, z - reach, z + reach + 0.03, centre=planet.axis))
            orbit = math.hypot(planet.axis[0] - body.axis[0], planet.axis[1] - body.axis[1])
            if planet is planets[0]:
                around = (2.0 * orbit + 0.8 * gear.held_diameter, 2.0 * orbit - 0.8 * gear.held_diameter)
                parts.append(tube_surface(around[0], z + reach, z + reach + 0.04, around[1], body.axis))
    return parts
