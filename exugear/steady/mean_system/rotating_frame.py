"""Coordinates in which a gearbox with planets has constant matrices: multi-blade (Coleman) coordinates.

A planet's displacements and tilts are written along the radius and the tangent of its place on the turning carrier, and
then as components around the carrier: with N planets at angles theta_n = psi + phi_n,

    z_n = z_0 + sum_m (z_cm cos m theta_n + z_sm sin m theta_n) [+ z_a (-1)^n for even N].

The components do not rotate with the carrier: a central body on anisotropic bearings has constant stiffness (Coleman
and Feingold 1958, NACA report 1351). The seats of a flexible carrier that its planets sit on have the same components,
and its modal coordinates those of their wave numbers. Bodies on fixed axes keep their coordinates.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from exugear.steady.mean_system.planet_sets import Jet, PlanetSet
from exugear.steady.mean_system.symmetric_carriers import SymmetricCarrier
from exugear.system.kernels.coordinates import TILT
from exugear.system.kernels.meshes import MeshArrays
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.arrays import Floats, Integers

PLACES = 4
"""Places of the carrier between one planet's and the next, over which matrices are averaged, at least.

A thousandth of a light resonance's amplitude hangs on it: 5e-6 of a frequency."""
SINGLE_PLACES = 8
"""The same over a revolution where planets are not alike: stiffness has harmonics up to the second."""
MOST_KEPT = 16
"""Angles at which matrices are kept: 3 MB each for the GRC with all bodies flexible."""


@dataclass(frozen=True, eq=False)
class RotatingFrame:
    """The transformation q = q_rolling(psi) + T(psi) u of an assembly; psi is the angle of the overall input."""

    assembly: Assembly
    sets: tuple[PlanetSet, ...]
    carriers: tuple[SymmetricCarrier, ...] = ()
    """Flexible carriers, which the assembly has in this symmetric form."""
    without: tuple[str, ...] = ()
    """Carriers with whose angle no stiffness varies, since the meshes and bearings that do so have no forces."""

    @cached_property
    def mean_meshes(self) -> MeshArrays:
        """Return the meshes of the averaged system: linear, with the mean stiffness over the mesh cycle.

        Tables are replaced by their stiffness at the static load, curves by their tangents there: otherwise stiffness
        would depend on each planet's misalignment and load.
        """
        if not LAWS[self.assembly.mesh_model].loses_contact:
            meshes = self.assembly.tangent_meshes
        else:
            meshes = self.assembly.linear_meshes()
            # What tables resist misalignment with is in the forces that they have beyond this.
            meshes = meshes._replace(tilt=np.zeros_like(meshes.tilt))
        if not self.without:
            return meshes
        kept = np.array([self.varying_carrier_of(m) not in self.without for m in range(len(meshes.damping))])
        return meshes._replace(
            stiffness=meshes.stiffness * kept[:, None, None],
            damping=meshes.damping * kept,
            tilt=meshes.tilt * kept[:, None],
        )

    @cached_property
    def speeds(self) -> dict[str, float]:
        """Spins of all bodies per spin of the overall input."""
        gearbox = self.assembly.gearbox
        return gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)

    @cached_property
    def rings(self) -> tuple[tuple[PlanetSet, Integers], ...]:
        """Coordinates (planets, 6) of what rotates with carriers, planet by planet, -1 where there is none.

        These are the planets of each set and the seats of flexible carriers off their axes.
        """
        coordinates = self.assembly.coordinates
        found = [(planets, np.array([coordinates[name] for name in planets.names])) for planets in self.sets]
        for carrier in self.carriers:
            first = self.assembly.elastic_slices[carrier.name].start
            found += [(carrier.planets, first + ring) for ring in carrier.rings]
        return tuple(found)

    def planets_of(self, mesh: int) -> PlanetSet | None:
        """Planets of which one has a mesh, by its number; None of a mesh without planets."""
        own = self.assembly.elements[mesh].mesh
        return next((planets for planets in self.sets if {own.pinion, own.gear} & set(planets.names)), None)

    def varying_carrier_of(self, mesh: int) -> str:
        """Carrier with whose angle the stiffness that a mesh gives the gearbox varies; empty of none."""
        planets = self.planets_of(mesh)
        return planets.carrier if planets is not None and self.waves_around(mesh, planets) else ""

    @cached_property
    def varying_carriers(self) -> tuple[str, ...]:
        """Carriers with whose angles the stiffness varies, in the order of their meshes."""
        of_meshes = map(self.varying_carrier_of, range(len(self.assembly.elements)))
        return tuple(name for name in dict.fromkeys(of_meshes) if name and name not in self.without)

    def varying_bearings(self, carrier: str) -> Integers:
        """Numbers of the bearings of a carrier's planets where these are not alike."""
        single = {name for own in self.sets if own.is_single and own.carrier == carrier for name in own.names}
        return np.flatnonzero([support.body in single for support in self.assembly.supports])

    def ring_waves(self, mesh: int) -> int:
        """Highest wave number around the carrier that the deflection of a mesh has by a flexible ring gear; 0 of none.

        The motion of a ring of s sectors is a polynomial of order (s - 1) / 2 (`exugear.system.kernels.turning`).
        """
        gear = self.assembly.elements[mesh].mesh
        body = self.assembly.elastic_bodies.get(gear.gear)
        return 0 if body is None else (len(body.sectors.get(gear.pair.gear.name, ())) - 1) // 2

    def waves_around(self, mesh: int, planets: PlanetSet) -> int:
        """Count the waves of the deflections of planets, of which a mesh is one, where they are more than the planets.

        A flexible ring gear has them, and every mesh of a single planet: cosine and sine are what the other body does.
        Otherwise 0. The cosine and sine of half of an even number of planets are no motion of these, whose wave
        alternates.
        """
        highest = max(self.ring_waves(mesh), int(planets.is_single))
        alternating = planets.waves % 2 == 0
        return max(planets.waves, 2 * highest + 1 + alternating) if highest else 0

    @property
    def places(self) -> Floats:
        """Angles of the input (p,), rad, at which the slowest planets are evenly spread from one place to the next."""
        passage = max(2.0 * math.pi / abs(planets.waves * planets.ratio) for planets in self.sets)
        return np.asarray(passage * np.arange(PLACES) / PLACES)

    def places_of(self, carrier: str) -> Floats:
        """Angles of the input (p,), rad, at which a carrier is evenly spread from one planet's place to the next.

        Over them and all planets products of two waves around a flexible ring gear have their exact mean. With an even
        number of planets they reach to the place after that: see `PlanetSet.passing`. Those of single planets are
        spread over a revolution.
        """
        meshes = [m for m in range(len(self.assembly.elements)) if self.varying_carrier_of(m) == carrier]
        planets = next(own for own in self.sets if own.carrier == carrier)
        least = SINGLE_PLACES if planets.is_single else PLACES * planets.waves // planets.passing
        count = max(least, 2 * max(map(self.ring_waves, meshes)) // planets.passing + 1)
        passage = 2.0 * math.pi / abs(planets.passing * planets.ratio)
        return np.asarray(passage * np.arange(count) / count)

    @cached_property
    def without_varying(self) -> RotatingFrame:
        """The same gearbox without what varies as carriers turn; itself if nothing does."""
        return self._without(self.varying_carriers)

    @cached_property
    def by_carrier(self) -> tuple[tuple[str, RotatingFrame], ...]:
        """Carriers with which stiffness varies, each with the gearbox without what varies with others."""
        carriers = self.varying_carriers
        return tuple((name, self._without([other for other in carriers if other != name])) for name in carriers)

    def _without(self, carriers: Sequence[str]) -> RotatingFrame:
        if not carriers:
            return self
        bearings = np.concatenate([self.varying_bearings(name) for name in carriers])
        connectors = self.assembly.connectors.without_forces(bearings)
        return replace(self, assembly=replace(self.assembly, connectors=connectors), without=(*self.without, *carriers))

    def mean(self, function: Callable[[RotatingFrame, float], Floats]) -> Floats:
        """Mean over the angles of the carriers with which stiffness varies of something at an angle of the input, rad.

        What several of them vary is the sum of what each of them does; without any it is the value at zero angle.
        """
        means = [
            np.mean([function(frame, float(psi)) for psi in self.places_of(name)], axis=0)
            for name, frame in self.by_carrier
        ]
        if len(means) == 1:
            return np.asarray(means[0])
        return np.asarray(np.sum(means, axis=0) - (len(means) - 1) * function(self.without_varying, 0.0))

    def _unit(self) -> Jet:
        size = self.assembly.size
        return np.eye(size), np.zeros((size, size)), np.zeros((size, size))

    @cached_property
    def _kept(self) -> dict[float, tuple[Jet, Jet]]:
        """Matrices and kinematic velocities at the last angles: differences and means use few angles many times."""
        return {}

    def _rotation_at(self, psi: float) -> tuple[Jet, Jet]:
        found = self._kept.get(psi)
        if found is None:
            found = self._matrices(psi), self._rolling(psi)
            if len(self._kept) >= MOST_KEPT:
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
        for planets, coordinates in self.rings:
            waves = planets.shapes(psi)
            for axis in range(coordinates.shape[1]):
                if coordinates[0, axis] >= 0:
                    place = np.ix_(coordinates[:, axis], coordinates[:, axis])
                    for matrix, values in zip(turned, waves, strict=True):
                        matrix[place] = values
        for planets, coordinates in self.rings:
            if coordinates[0, 0] < 0:
                continue
            # Displacements and tilts turn along radius and tangent of each planet: R w and its derivatives.
            rate = planets.ratio
            r, r1, r2 = self._unit()
            for angle, coordinate in zip(rate * psi + planets.angles, coordinates, strict=True):
                c = math.cos(angle)
                s = math.sin(angle)
                plane = np.array([[c, -s], [s, c]])
                for first in (0, TILT):
                    place = np.ix_(coordinate[first : first + 2], coordinate[first : first + 2])
                    r[place], r1[place] = plane, rate * np.array([[-s, -c], [c, -s]])
                    r2[place] = -(rate**2) * plane
            w, w1, w2 = turned
            turned = r @ w, r1 @ w + r @ w1, r2 @ w + 2.0 * r1 @ w1 + r @ w2
        for carrier in self.carriers:
            modal = self.assembly.elastic_slices[carrier.name].start + carrier.modal
            for matrix, values in zip(turned, carrier.turned(psi), strict=True):
                matrix[np.ix_(modal, modal)] = values
        return turned

    def _rolling(self, psi: float) -> Jet:
        assembly = self.assembly
        still = np.zeros(self.assembly.size)
        place = psi * assembly.rolling_velocity(still, self.speeds)
        rate = assembly.rolling_velocity(still, self.speeds)
        bend = assembly.rolling_acceleration(still, self.speeds, dict.fromkeys(self.speeds, 0.0))
        for planets, coordinates in self.rings:
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
        """Coordinates, velocities and accelerations (..., size) of the assembly at an input speed (rad/s)."""
        (t, t1, t2), (place, rate, bend) = self.matrices(psi), self.rolling(psi)
        q = place + u @ t.T
        v = speed * (rate + u @ t1.T)
        a = speed**2 * (bend + u @ t2.T)
        if du is not None:
            v = v + du @ t.T
            a = a + 2.0 * speed * (du @ t1.T)
        if ddu is not None:
            a = a + ddu @ t.T
        return q, v, a
