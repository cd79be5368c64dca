"""Planets made equal: bearings of a planet set get the mean of their laws, each seen along its own radius.

Catalogue bearings take their laws from the static load at one position of the carrier, where planets may be loaded
unequally. As the carrier turns every planet passes all positions: what lasts is the mean. Left as they are, unequal
planets would be an asymmetry that turns with the carrier, and make sidebands. Of rows of rolling elements the mean is
that of their places, which follow the load's direction.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from exugear.gearbox.parts import Bearing, Body
from exugear.system.bearings.kernels.connectors import ConnectorArrays
from fe_ste.tools.arrays import Floats, Integers

FEWEST = 3
"""Planets that a set needs: fewer do not average out what their turning does to the others."""
SPACING = 1e-6
"""Largest departure of planets from equal spacing, rad."""


def planet_families(bodies: Iterable[Body]) -> list[list[Body]]:
    """Find the sets of planets: those of one family on one carrier that turns."""
    families: dict[tuple[str, str], list[Body]] = {}
    for body in bodies:
        if body.carrier is not None:
            families.setdefault((body.carrier, body.family), []).append(body)
    return list(families.values())


def equally_spaced(planets: Sequence[Body]) -> bool:
    """Tell whether planets of a set stand at equal distances around their carrier, three of them or more."""
    spacing = 2.0 * math.pi / len(planets)
    turned = np.array([planet.orbit_angle - planets[0].orbit_angle for planet in planets]) % (2.0 * math.pi)
    return len(planets) >= FEWEST and bool(np.abs(turned - spacing * np.arange(len(planets))).max() <= SPACING)


class PlanetSupports(NamedTuple):
    """Supports of one family, one of each planet of a set."""

    numbers: Integers
    """(N,) among all supports, in the order of the planets."""
    angles: Floats
    """(N,) of the planets in the carrier's axes, rad."""


def planet_supports(supports: Sequence[Bearing], planets: Sequence[str], angles: Floats) -> list[PlanetSupports]:
    """Families of supports that each planet (names) of a set has one of; angles (N,) of the planets, rad."""
    found = []
    for family in sorted({support.family for support in supports if support.body in planets}):
        numbers = [n for name in planets for n, own in enumerate(supports) if own.body == name and own.family == family]
        if len(numbers) == len(planets):
            found.append(PlanetSupports(np.array(numbers, dtype=np.int64), angles))
    return found


def with_equal_planets(connectors: ConnectorArrays, sets: Iterable[PlanetSupports]) -> tuple[ConnectorArrays, float]:
    """Connectors whose planets are equal, and the largest change of stiffness that this took, over it.

    Notes
    -----
    Cages that turn stay where they are.
    """
    stiffness, damping, phase = (
        values.copy() for values in (connectors.stiffness, connectors.damping, connectors.rolling.phase)
    )
    strain = connectors.point_strain.copy()
    load = connectors.point_load.copy()
    with_rows = np.diff(connectors.rolling.first) > 0
    largest = 0.0
    for own, angles in sets:
        if with_rows[own].all() and not connectors.rolling.cage_ratio[own].any():
            phase[own] = angles + _mean_angle(phase[own] - angles)
        turns = np.array([_turn(angle) for angle in angles])
        back = turns.transpose(0, 2, 1)
        largest = max(largest, _spread(back @ stiffness[own] @ turns))
        for matrices in (stiffness, damping):
            matrices[own] = turns @ (back @ matrices[own] @ turns).mean(axis=0) @ back
        for vectors in (strain, load):
            mean = np.einsum("nij,nj->ni", back, vectors[own]).mean(axis=0)
            vectors[own] = turns @ mean
    rolling = connectors.rolling._replace(phase=phase)
    equal = connectors._replace(
        stiffness=stiffness, damping=damping, point_strain=strain, point_load=load, rolling=rolling
    )
    if largest or with_rows.any():
        return (equal, largest)
    return (connectors, 0.0)


def _spread(matrices: Floats) -> float:
    """Largest difference of the displacements' stiffness (n, 6, 6) from its mean, over it."""
    mean = matrices.mean(axis=0)
    size = np.sqrt(np.abs(np.diag(mean)).clip(min=1e-9 * np.abs(mean).max(initial=0.0) + 1e-300))
    return float(np.abs((matrices - mean) / np.outer(size, size))[:, :3, :3].max())


def _mean_angle(angles: Floats) -> float:
    """Mean of angles (n,) that are near each other on the circle, rad."""
    return math.atan2(float(np.sin(angles).mean()), float(np.cos(angles).mean()))


def _turn(angle: float) -> Floats:
    """Matrix (6, 6) that turns displacements and tilts about z by an angle (rad)."""
    c = math.cos(angle)
    s = math.sin(angle)
    turn = np.eye(6)
    turn[:2, :2] = turn[3:5, 3:5] = [[c, -s], [s, c]]
    return turn
