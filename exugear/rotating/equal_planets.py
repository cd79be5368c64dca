"""Planets made equal: bearings of a planet set get the mean of their stiffness, each seen along its own radius.

Catalogue bearings take their stiffness from the static load at one position of the carrier, where planets may be
loaded unequally. As the carrier turns every planet passes all positions: what lasts is the mean. Of non-linear ones it
is the place of their rolling elements, which follows the load's direction.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from exugear.dynamics.assembly import Assembly
from exugear.rotating.rotating_frame import PlanetSet
from fe_ste.tools.arrays import Floats


def with_equal_planets(assembly: Assembly, sets: tuple[PlanetSet, ...]) -> tuple[Assembly, float]:
    """Assembly whose planets' supports are equal, and the largest change of stiffness that this took, over it.

    Parameters
    ----------
    assembly : Assembly
    sets : tuple of PlanetSet
    """
    arrays, largest = assembly.connectors, 0.0
    stiffness, damping, phase = arrays.stiffness.copy(), arrays.damping.copy(), arrays.rolling.phase.copy()
    for planets in sets:
        families = {support.family for support in assembly.supports if support.body in planets.names}
        for family in sorted(families):
            own = [
                n
                for name in planets.names
                for n, support in enumerate(assembly.supports)
                if support.body == name and support.family == family
            ]
            if len(own) != planets.waves:
                continue
            if assembly.has_rows:
                phase[own] = planets.angles + _mean_angle(phase[own] - planets.angles)
            for matrices in (stiffness, damping):
                turned = np.array([_turned(matrices[n], -a) for n, a in zip(own, planets.angles, strict=True)])
                mean = turned.mean(axis=0)
                size = np.sqrt(np.abs(np.diag(mean)).clip(min=1e-9 * np.abs(mean).max(initial=0.0) + 1e-300))
                largest = max(largest, float(np.abs((turned - mean) / np.outer(size, size))[:, :3, :3].max()))
                for n, angle in zip(own, planets.angles, strict=True):
                    matrices[n] = _turned(mean, angle)
    if largest == 0.0 and not assembly.has_rows:
        return assembly, 0.0
    rolling = arrays.rolling._replace(phase=phase)
    return replace(assembly, connectors=arrays._replace(stiffness=stiffness, damping=damping, rolling=rolling)), largest


def _mean_angle(angles: Floats) -> float:
    """Mean of angles (n,) that are near each other on the circle, rad."""
    return math.atan2(float(np.sin(angles).mean()), float(np.cos(angles).mean()))


def _turned(matrix: Floats, angle: float) -> Floats:
    """Matrix (6, 6) of a support that is turned about z by an angle (rad)."""
    c, s = math.cos(angle), math.sin(angle)
    turn = np.eye(6)
    turn[:2, :2] = turn[3:5, 3:5] = [[c, -s], [s, c]]
    return np.asarray(turn @ matrix @ turn.T)
