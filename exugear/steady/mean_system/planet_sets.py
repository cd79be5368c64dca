"""Planets in multi-blade (Coleman) coordinates: equal, equally spaced planets of a carrier, and waves around it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from exugear.gearbox.parts import Body
from exugear.system.bearings.stiffness import FEWEST, equally_spaced, planet_families
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Floats

Jet: TypeAlias = tuple[Floats, Floats, Floats]
"""A function of the input's angle with two derivatives by it."""


IN_PHASE = 1e-6
"""Mesh cycles by which planets in phase may differ."""


class SteadyError(ValueError):
    """A gearbox, or a wish, that the steady response cannot treat; the message says why."""


@dataclass(frozen=True)
class PlanetSet:
    """Equal, equally spaced planets of one carrier."""

    names: tuple[str, ...]
    """In the order of their angles."""
    carrier: str
    angles: Floats
    """(N,) at zero angle of the carrier, rad."""
    ratio: float
    """Angle of the carrier over that of the overall input."""

    @property
    def waves(self) -> int:
        """Number of planets, which is that of waves."""
        return len(self.names)

    def norms(self, count: int | None = None) -> Floats:
        """Mean over a turn of the carrier of the sum of each wave's squares over the planets, (count,)."""
        found = np.full(count or self.waves, 0.5 * self.waves)
        found[0] = self.waves
        if self.waves % 2 == 0:
            found[self.waves - 1 : self.waves] = self.waves
        return found

    def values(self, turned: Floats, count: int | None = None) -> Floats:
        """Waves at the planets (..., planets, count) where the carrier has turned by angles (...), rad.

        By default as many as planets, which describe any motion of these; a flexible ring gear has more. The planets
        are then odd in number.
        """
        theta = turned[..., None] + self.angles
        found = [np.ones_like(theta)]
        for m in range(1, ((count or self.waves) - 1) // 2 + 1):
            found += [np.cos(m * theta), np.sin(m * theta)]
        if self.waves % 2 == 0:
            found.append(np.broadcast_to(np.where(np.arange(self.waves) % 2, -1.0, 1.0), theta.shape))
        return np.stack(found, axis=-1)

    def shapes(self, psi: float) -> Jet:
        """Waves at the planets (planets, waves), and two derivatives by the input's angle psi (rad).

        The first three are the mean, the cosine and the sine.
        """
        theta = self.ratio * psi + self.angles
        rate = self.ratio
        value = [np.ones_like(theta)]
        slope = [np.zeros_like(theta)]
        bend = [np.zeros_like(theta)]
        for m in range(1, (self.waves - 1) // 2 + 1):
            c = np.cos(m * theta)
            s = np.sin(m * theta)
            value += [c, s]
            slope += [-m * rate * s, m * rate * c]
            bend += [-((m * rate) ** 2) * c, -((m * rate) ** 2) * s]
        if self.waves % 2 == 0:
            value.append(np.where(np.arange(self.waves) % 2, -1.0, 1.0))
            slope.append(np.zeros_like(theta))
            bend.append(np.zeros_like(theta))
        return np.array(value).T, np.array(slope).T, np.array(bend).T


def planet_sets(assembly: Assembly) -> tuple[PlanetSet, ...]:
    """Planet sets of a gearbox, checked.

    Raises
    ------
    SteadyError
        Two planets, planets that are not equally spaced, or elastic ones.
    """
    gearbox = assembly.gearbox
    bodies = {body.name: body for body in assembly.bodies}
    speeds = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    sets = []
    for planets in planet_families(assembly.bodies):
        carrier = str(planets[0].carrier)
        family = planets[0].family
        elastic = [planet.name for planet in planets if planet.name in assembly.elastic_bodies]
        if elastic:
            raise SteadyError(
                f"bodies.{family}: flexible planets, whose stiffness is not constant in the fixed frame; set "
                "flexibility = 'none' for the steady-state response"
            )
        _check_spacing(family, planets)
        names = tuple(planet.name for planet in planets)
        angles = np.array([planet.orbit_angle for planet in planets])
        sets.append(PlanetSet(names, bodies[carrier].name, angles, speeds[carrier]))
    return tuple(sets)


def _check_spacing(family: str, planets: Sequence[Body]) -> None:
    if len(planets) < FEWEST:
        raise SteadyError(
            f"bodies.{family}: {len(planets)} planets; with fewer than {FEWEST} equally spaced planets the matrices "
            "vary with the carrier angle, which the steady-state response cannot treat; use exugear run instead"
        )
    if not equally_spaced(planets):
        raise SteadyError(
            f"bodies.{family}.planet_angles_deg: with unequally spaced planets the matrices vary with the carrier "
            "angle, which the steady-state response cannot treat; use exugear run instead"
        )


def phases_ahead(assembly: Assembly, meshes: Sequence[int]) -> tuple[float, ...]:
    """Cycles by which each mesh is ahead of the first, empty where all are in phase."""
    phases = assembly.meshes.phase[list(meshes)]
    apart = (phases - phases[0] + 0.5) % 1.0 - 0.5
    return tuple(float(phase) for phase in apart) if np.abs(apart).max() > IN_PHASE else ()
