"""Where the laws of meshes are evaluated: places around carriers, at samples of the bases' angles.

A single mesh is one place. Meshes of planets in phase are looked at in places spread evenly over the turn of the
carrier, in which the waves add up as they do for a planet there: the mean over its turn counts. Of planets out of
phase each is a place, whose angle turns with the base of its carrier.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from exugear.steady.mean_system.mesh_waves import MeshWaves
from exugear.steady.mean_system.rotating_frame import PlanetSet
from fe_ste.tools.arrays import Floats

TURNED = 5
"""Places around a carrier whose planets mesh in phase: exact for products of four waves."""


@dataclass(frozen=True, eq=False)
class MeshPlaces:
    """Places of all meshes; s samples (one where it stands for all), u places, m waves."""

    means: tuple[int, ...]
    """Mean wave of each place."""
    there: Floats
    """(s, u, m) (u, m) values in the places from those of the waves."""
    back: Floats
    """(s, m, u) (m, u) and back."""
    positions: Floats
    """(s, u) position in the mesh cycle that the mean speed brings, cycles."""


def mesh_places(waves: MeshWaves, speed: float, positions: Floats, angles: Floats) -> MeshPlaces:
    """Places of all meshes at a speed of the input (rad/s).

    Parameters
    ----------
    positions : (m,) in the mesh cycle at zero angle of the input
    angles : (s, bases) of the bases, rad; those of carriers after those of the meshes
    """
    count = len(waves.waves)
    turning = bool(waves.carriers)
    carriers = [name for name, _ in waves.carriers]
    means: list[int] = []
    there = []
    back = []
    at = []
    for first, wave in enumerate(waves.waves):
        if wave.wave != 0:
            continue
        planets = waves.planets(wave)
        own = slice(first, first + sum(other.first == wave.first for other in waves.waves))
        sense = math.copysign(1.0, speed) * wave.sense
        position = positions[first] + sense * angles[:, [wave.base]] / (2.0 * math.pi)
        column = len(waves.base_orders) + carriers.index(planets.carrier) if planets and wave.ahead else None
        shapes = wave_shapes(planets, speed, None if column is None else angles[:, column])
        rows = np.zeros((*shapes.shape[:-1], count))
        columns = np.zeros((*shapes.shape[:-2], count, shapes.shape[-2]))
        rows[..., own] = shapes
        columns[..., own, :] = np.swapaxes(shapes / (shapes**2).sum(axis=-2, keepdims=True), -1, -2)
        samples = (len(angles),) if turning else ()
        there.append(np.broadcast_to(rows, (*samples, *rows.shape[-2:])))
        back.append(np.broadcast_to(columns, (*samples, *columns.shape[-2:])))
        means += [first] * shapes.shape[-2]
        at.append(position + np.array(wave.ahead or np.zeros(shapes.shape[-2])))
    return MeshPlaces(
        tuple(means), np.concatenate(there, axis=-2), np.concatenate(back, axis=-1), np.concatenate(at, axis=1)
    )


def wave_shapes(planets: PlanetSet | None, speed: float, turned: Floats | None) -> Floats:
    """Waves in the places (places, waves), or where the carrier is turned by angles (s, places, waves).

    Parameters
    ----------
    planets : None of what does not travel
    speed : of the input, rad/s
    turned : (s,) angles of the base of the carrier, rad; None where it is none
    """
    if planets is None:
        return np.ones((1, 1))
    if turned is not None:
        return planets.values(math.copysign(1.0, speed * planets.ratio) * turned)
    theta = 2.0 * np.pi * np.arange(TURNED) / TURNED
    return np.stack([np.ones_like(theta), np.cos(theta), np.sin(theta)], axis=1)
