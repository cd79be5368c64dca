"""Coordinates in which a gearbox with planets has constant matrices: multi-blade (Coleman) coordinates.

A planet's displacements and tilts are written along the radius and the tangent of its place on the turning carrier, and
then as components around the carrier: with N planets at angles theta_n = psi + phi_n,

    z_n = z_0 + sum_m (z_cm cos m theta_n + z_sm sin m theta_n) [+ z_a (-1)^n for even N].

The components do not rotate with the carrier: a central body on anisotropic bearings has constant stiffness (Coleman
and Feingold 1958, NACA report 1351). Bodies on fixed axes keep their coordinates.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from exugear.gearbox.parts import Body
from exugear.system.bearings.stiffness import FEWEST, equally_spaced, planet_families
from exugear.system.kernels.coordinates import TILT
from exugear.system.kernels.meshes import MeshArrays
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.arrays import Floats, Integers

Jet: TypeAlias = tuple[Floats, Floats, Floats]
"""A function of the input's angle with two derivatives by it."""


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

    def values(self, turned: Floats) -> Floats:
        """Waves at the planets (..., planets, waves) where the carrier has turned by angles (...), rad."""
        theta = turned[..., None] + self.angles
        found = [np.ones_like(theta)]
        for m in range(1, (self.waves - 1) // 2 + 1):
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
        Two planets, planets that are not equally spaced, or an elastic carrier or planet.
    """
    gearbox = assembly.gearbox
    bodies = {body.name: body for body in assembly.bodies}
    speeds = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    sets = []
    for planets in planet_families(assembly.bodies):
        carrier = str(planets[0].carrier)
        family = planets[0].family
        elastic = [name for name in (carrier, *(p.name for p in planets)) if name in assembly.elastic_bodies]
        if elastic:
            raise SteadyError(
                f"bodies.{elastic[0]}: flexible and rotating with planets, so its stiffness is not constant in the "
                "fixed frame; set flexibility = 'none' for the steady-state response"
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


@dataclass(frozen=True, eq=False)
class RotatingFrame:
    """The transformation q = q_rolling(psi) + T(psi) u of an assembly; psi is the angle of the overall input."""

    assembly: Assembly
    sets: tuple[PlanetSet, ...]

    @cached_property
    def mean_meshes(self) -> MeshArrays:
        """Return the meshes of the averaged system: linear, with the mean stiffness over the mesh cycle.

        Tables are replaced by their stiffness at the static load, curves by their tangents there: otherwise stiffness
        would depend on each planet's misalignment and load.
        """
        if not LAWS[self.assembly.mesh_model].loses_contact:
            return self.assembly.tangent_meshes
        teeth = self.assembly.linear_meshes()
        # What tables resist misalignment with is in the forces that they have beyond this.
        return teeth._replace(tilt=np.zeros_like(teeth.tilt))

    @cached_property
    def speeds(self) -> dict[str, float]:
        """Spins of all bodies per spin of the overall input."""
        gearbox = self.assembly.gearbox
        return gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)

    @cached_property
    def _planet_coordinates(self) -> tuple[tuple[PlanetSet, Integers], ...]:
        """Coordinates (planets, 6) of each set, -1 where there is none."""
        coordinates = self.assembly.coordinates
        return tuple((planets, np.array([coordinates[name] for name in planets.names])) for planets in self.sets)

    def _unit(self) -> Jet:
        size = self.assembly.size
        return np.eye(size), np.zeros((size, size)), np.zeros((size, size))

    @cached_property
    def _kept(self) -> dict[float, tuple[Jet, Jet]]:
        """Matrices and kinematic velocities at the last angle: differences use one angle many times."""
        return {}

    def _rotation_at(self, psi: float) -> tuple[Jet, Jet]:
        found = self._kept.get(psi)
        if found is None:
            found = self._matrices(psi), self._rolling(psi)
            self._kept.clear()
            self._kept[psi] = found
        return found

    def matrices(self, psi: float) -> Jet:
        """T and its two derivatives by psi, each (size, size)."""
        return self._rotation_at(psi)[0]

    def rolling(self, psi: float) -> Jet:
        """q_rolling and its two derivatives by psi, each (size,)."""
        return self._rotation_at(psi)[1]

    def _matrices(self, psi: float) -> Jet:
        turned = self._unit()
        for planets, coordinates in self._planet_coordinates:
            waves = planets.shapes(psi)
            for axis in range(coordinates.shape[1]):
                if coordinates[0, axis] >= 0:
                    place = np.ix_(coordinates[:, axis], coordinates[:, axis])
                    for matrix, values in zip(turned, waves, strict=True):
                        matrix[place] = values
        for planets, coordinates in self._planet_coordinates:
            if coordinates[0, 0] < 0:
                continue
            turned = self._with_directions(planets, coordinates, psi, turned)
        return turned

    def _with_directions(self, planets: PlanetSet, coordinates: Integers, psi: float, waves: Jet) -> Jet:
        """Turn displacements and tilts along radius and tangent of each planet: R w and its derivatives."""
        turning = self._unit()
        for angle, coordinate in zip(planets.ratio * psi + planets.angles, coordinates, strict=True):
            c = math.cos(angle)
            s = math.sin(angle)
            rate = planets.ratio
            plane = np.array([[c, -s], [s, c]])
            around = rate * np.array([[-s, -c], [c, -s]])
            for first in (0, TILT):
                place = np.ix_(coordinate[first : first + 2], coordinate[first : first + 2])
                for matrix, values in zip(turning, (plane, around, -(rate**2) * plane), strict=True):
                    matrix[place] = values
        (r, r1, r2), (w, w1, w2) = turning, waves
        return r @ w, r1 @ w + r @ w1, r2 @ w + 2.0 * r1 @ w1 + r @ w2

    def _rolling(self, psi: float) -> Jet:
        assembly = self.assembly
        still = np.zeros(self.assembly.size)
        place = psi * assembly.rolling_velocity(still, self.speeds)
        rate = assembly.rolling_velocity(still, self.speeds)
        bend = assembly.rolling_acceleration(still, self.speeds, dict.fromkeys(self.speeds, 0.0))
        for planets, coordinates in self._planet_coordinates:
            if coordinates[0, 0] < 0:
                continue
            angle = planets.ratio * psi
            c = math.cos(angle)
            s = math.sin(angle)
            plane = np.array([[c, -s], [s, c]])
            for coordinate in coordinates[:, :2]:
                # The centripetal acceleration points back along the radius.
                radius = -bend[coordinate] / planets.ratio**2 if planets.ratio else np.zeros(2)
                place[coordinate] = plane @ radius - radius
                rate[coordinate], bend[coordinate] = plane @ rate[coordinate], plane @ bend[coordinate]
        return place, rate, bend

    def state(self, psi: float, speed: float, u: Floats, du: Floats | None = None, ddu: Floats | None = None) -> Jet:
        """Coordinates, velocities and accelerations (size,) of the assembly at an input speed (rad/s)."""
        (t, t1, t2), (place, rate, bend) = self.matrices(psi), self.rolling(psi)
        q = place + t @ u
        v = speed * (rate + t1 @ u)
        a = speed**2 * (bend + t2 @ u)
        if du is not None:
            v = v + t @ du
            a = a + 2.0 * speed * (t1 @ du)
        if ddu is not None:
            a = a + t @ ddu
        return q, v, a
