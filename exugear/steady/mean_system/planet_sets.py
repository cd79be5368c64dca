"""Planets in multi-blade (Coleman) coordinates: equal, equally spaced planets of a carrier, and waves around it.

Planets that are fewer than three or unequally spaced have no such waves: each of them is a set of its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from exugear.gearbox.parts import Body
from exugear.system.bearings.stiffness import FEWEST, equally_spaced, planet_families
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Floats

WaveKind: TypeAlias = Literal["mean", "cosine", "sine", "alternating"]
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

    @property
    def is_single(self) -> bool:
        """Whether the set is one planet of several that are not alike: stiffness then varies as the carrier turns."""
        return self.waves == 1

    @property
    def passing(self) -> int:
        """Turns of the carrier that lie between the orders that the passing planets couple at a flexible ring gear.

        Every planet that passes finds what the one before found. With an even number the alternating wave changes its
        sign then: it is as before after two of them, and couples orders at half of the distance.
        """
        return self.waves // 2 if self.waves % 2 == 0 else self.waves

    def kinds(self, count: int | None = None) -> tuple[tuple[WaveKind, int], ...]:
        """Kind and wave number of each wave, by default of as many as planets, which describe any motion of these.

        A flexible ring gear has more, which follow, and so has a single planet: what a central body does there.

        Examples
        --------
        >>> PlanetSet(("a", "b", "c", "d"), "carrier", np.zeros(4), 1.0).kinds(6)[2:]
        (('sine', 1), ('alternating', 2), ('cosine', 2), ('sine', 2))
        """
        return wave_kinds(self.waves, count or self.waves)

    def norms(self, count: int | None = None) -> Floats:
        """Mean over a turn of the carrier of the sum of each wave's squares over the planets, (count,)."""
        paired = np.array([kind in ("cosine", "sine") for kind, _ in self.kinds(count)])
        return np.where(paired, 0.5 * self.waves, float(self.waves))

    def values(self, turned: Floats, count: int | None = None) -> Floats:
        """Waves at the planets (..., planets, count) where the carrier has turned by angles (...), rad."""
        theta = turned[..., None] + self.angles
        return np.stack([self._wave(kind, m * theta) for kind, m in self.kinds(count)], axis=-1)

    def shapes(self, psi: float) -> Jet:
        """Waves at the planets (planets, waves), and two derivatives by the input's angle psi (rad).

        The first three are the mean, the cosine and the sine.
        """
        theta = self.ratio * psi + self.angles
        value, slope, bend = [], [], []
        for kind, m in self.kinds():
            rate = m * self.ratio if kind in ("cosine", "sine") else 0.0
            value.append(self._wave(kind, m * theta))
            slope.append(rate * self._wave(kind, m * theta + 0.5 * math.pi))
            bend.append(-(rate**2) * value[-1])
        return np.array(value).T, np.array(slope).T, np.array(bend).T

    def _wave(self, kind: WaveKind, angle: Floats) -> Floats:
        """Values of a wave at angles (..., planets), rad, which are those of the planets times the wave number."""
        if kind == "mean":
            return np.ones_like(angle)
        if kind == "alternating":
            return np.broadcast_to(np.where(np.arange(self.waves) % 2, -1.0, 1.0), angle.shape)
        return np.asarray(np.cos(angle) if kind == "cosine" else np.sin(angle))


def wave_kinds(planets: int, count: int) -> tuple[tuple[WaveKind, int], ...]:
    """Kind and wave number of the first waves of a number of planets.

    As many as planets describe any motion of these. The wave that changes its sign from planet to planet is its own
    conjugate, and turns with the planets; the cosine and the sine of its number, which stand still, follow it.
    """
    found: list[tuple[WaveKind, int]] = [("mean", 0)]
    for m in range(1, count // 2 + 1):
        if 2 * m == planets:
            found.append(("alternating", m))
        found += [("cosine", m), ("sine", m)]
    return tuple(found[:count])


def unlike_families(bodies: Sequence[Body]) -> dict[str, str]:
    """Return carriers whose planets are fewer than three or unequally spaced, each with a family of such planets."""
    return {
        str(planets[0].carrier): planets[0].family
        for planets in planet_families(bodies)
        if len(planets) < FEWEST or not equally_spaced(planets)
    }


def planet_sets(assembly: Assembly) -> tuple[PlanetSet, ...]:
    """Planet sets of a gearbox, checked.

    Planets of a carrier are sets of one where those of any of its families are fewer than three or unequally spaced.

    Raises
    ------
    SteadyError
        Planets are flexible, or so is the carrier of planets that are not alike.
    """
    gearbox = assembly.gearbox
    bodies = {body.name: body for body in assembly.bodies}
    speeds = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    sets = []
    families = planet_families(assembly.bodies)
    unlike = unlike_families(assembly.bodies)
    for carrier in sorted(unlike):
        if carrier in assembly.elastic_bodies:
            raise SteadyError(
                f"bodies.{carrier}: a flexible carrier of planets that are fewer than three or unequally spaced, which "
                "the steady-state response cannot treat; set flexibility = 'none', or use exugear run"
            )
    for planets in families:
        carrier = str(planets[0].carrier)
        family = planets[0].family
        elastic = [planet.name for planet in planets if planet.name in assembly.elastic_bodies]
        if elastic:
            raise SteadyError(
                f"bodies.{family}: flexible planets, whose stiffness is not constant in the fixed frame; set "
                "flexibility = 'none' for the steady-state response"
            )
        names = tuple(planet.name for planet in planets)
        angles = np.array([planet.orbit_angle for planet in planets])
        whole = PlanetSet(names, bodies[carrier].name, angles, speeds[carrier])
        if carrier in unlike:
            sets += [
                replace(whole, names=(name,), angles=angle) for name, angle in zip(names, angles[:, None], strict=True)
            ]
        else:
            sets.append(whole)
    return tuple(sets)


def phases_ahead(assembly: Assembly, meshes: Sequence[int]) -> tuple[float, ...]:
    """Cycles by which each mesh is ahead of the first, empty where all are in phase."""
    phases = assembly.meshes.phase[list(meshes)]
    apart = (phases - phases[0] + 0.5) % 1.0 - 0.5
    return tuple(float(phase) for phase in apart) if np.abs(apart).max() > IN_PHASE else ()
