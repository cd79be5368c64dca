"""What modes of the mean system are: types of planetary sets, who moves how in words, the sense of a whirl.

Equal planets, equally spaced, have three types of modes (Lin and Parker 1999, J. Vib. Acoust. 121, 316): rotational,
in which all planets move alike and central bodies turn (and move along the axis); translational, in which planets move
as a cosine and a sine around the carrier and central bodies move across; planet modes, of higher waves, in which no
central body moves. Coordinates are waves already, so that the kinetic energy tells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exugear.steady.mean_system.mean_system import MeanSystem
from exugear.steady.mean_system.rotating_frame import PlanetSet
from exugear.system.bodies.reduced_body import TILT_X, TILT_Y, UX, UY
from exugear.system.eigenmodes.energy_shares import BODY_MOTIONS, kinetic_shares, mode_name
from exugear.system.linearised import linearise
from fe_ste.tools.arrays import Complexes, Floats

KINDS = ("rotational", "translational", "planet")
"""Types of modes of a planetary set."""
MIXED = "mixed"
"""Neither: bearings that are not isotropic, or gears beside the set, couple its waves."""
OF_SET, OF_PLANETS, OF_KIND = 0.5, 0.1, 0.8
"""Least shares of the kinetic energy: of a set for a mode to be one of its own, of the planets for it to be named by
type, and of one type within the set."""
LATERAL = 0.01
"""Least share of the kinetic energy that turning bodies' lateral and tilting motions have for a whirl to be told."""
TURNING = tuple(BODY_MOTIONS.index(name) for name in ("spin", "axial", "twist", "stretch"))
"""Motions of a central body in rotational modes; all others are those of translational ones."""


@dataclass(frozen=True)
class NamedMode:
    """A mode in words."""

    kind: str
    """Of `KINDS`, `MIXED`, or empty where no planet set carries the mode; with the carrier where there are several."""
    name: str
    """What moves and what is strained."""
    whirl: float
    """1 for a circle in the sense in which the body turns, -1 against it, 0 for a line and where hardly any turning
    body moves across."""


class ModeNamer:
    """Names modes of a mean system; its elements are linearised once, about the static state at one speed.

    Parameters
    ----------
    speed : of the input, rad/s
    """

    def __init__(self, system: MeanSystem, speed: float) -> None:
        self.system, frame = system, system.frame
        self.assembly, self._turn = frame.assembly, frame.matrices(0.0)[0]
        self._q = frame.state(0.0, speed, system.static_at(speed))[0]
        self._elements = linearise(self.assembly, self._q, frame.mean_meshes).stiffness
        self._senses = {name: float(np.sign(own * speed)) for name, own in frame.speeds.items()}

    def named(self, shape: Complexes) -> NamedMode:
        """Name a shape (size,) of the mean system."""
        kinetic = self._kinetic(shape)
        return NamedMode(self._kind(shape, kinetic), self._words(shape, kinetic), self.whirl(shape))

    def whirl(self, shape: Complexes) -> float:
        """Sense of the whirl of a shape (size,), bodies by their lateral and tilting energy; see `NamedMode`."""
        circling = total = 0.0
        energy = np.diag(self.system.mass)
        for body in self.assembly.bodies:
            index = self.assembly.coordinates[body.name]
            if body.carrier is not None:
                continue
            for x, y in ((index[UX], index[UY]), (index[TILT_X], index[TILT_Y])):
                if min(x, y) >= 0:
                    circling += self._senses.get(body.name, 0.0) * energy[x] * circle(shape[x], shape[y])
                    total += energy[x] * (abs(shape[x]) ** 2 + abs(shape[y]) ** 2)
        whole = float((shape.conj() @ self.system.mass @ shape).real)
        if total > LATERAL * whole:
            return float(circling / total)
        return 0.0

    def _parts(self, shape: Complexes) -> tuple[tuple[Floats, float], ...]:
        """Real and imaginary part of a shape with the share of its energy that each has."""
        parts = (shape.real, shape.imag)
        energies = [float(part @ self.system.mass @ part) for part in parts]
        return tuple(
            (part, energy / sum(energies)) for part, energy in zip(parts, energies, strict=True) if energy > 0.0
        )

    def _kinetic(self, shape: Complexes) -> Floats:
        """Share of kinetic energy (bodies, motions)."""
        shares = np.zeros((len(self.assembly.bodies), len(BODY_MOTIONS)))
        for part, weight in self._parts(shape):
            shares += weight * kinetic_shares(self.assembly, (self._turn @ part)[:, None], self._q)[0]
        return shares

    def _words(self, shape: Complexes, kinetic: Floats) -> str:
        moved = self._turn @ shape
        strain = np.array([float((moved.conj() @ k @ moved).real) for k in self._elements.values()])
        return mode_name(self.assembly, tuple(self._elements), kinetic, strain / max(float(strain.sum()), 1e-300))

    def _kind(self, shape: Complexes, kinetic: Floats) -> str:
        sets = self.system.frame.sets
        shares = [(planets, self._of_kinds(planets, shape, kinetic)) for planets in sets]
        if not shares:
            return ""
        planets, (of_planets, own) = max(shares, key=lambda item: float(item[1][1].sum()))
        if own.sum() < OF_SET or of_planets < OF_PLANETS:
            return ""
        most = int(np.argmax(own))
        kind = KINDS[most] if own[most] >= OF_KIND * own.sum() else MIXED
        if len(sets) == 1:
            return kind
        return f"{kind} of {planets.carrier}"

    def _of_kinds(self, planets: PlanetSet, shape: Complexes, kinetic: Floats) -> tuple[float, Floats]:
        """Share of the planets of a set, and shares (3,) of the set by type of motion."""
        places = {body.name: n for n, body in enumerate(self.assembly.bodies)}
        waves = np.array([self._wave_energy(name, shape) for name in planets.names])
        by_kind = np.array([waves[0], waves[1:3].sum(), waves[3:].sum()])
        of_planets = float(sum(kinetic[places[name]].sum() for name in planets.names))
        shares = of_planets * by_kind / max(float(by_kind.sum()), 1e-300)
        for name in self._central(planets):
            if name in places:
                turning = float(kinetic[places[name], TURNING].sum())
                shares[:2] += turning, float(kinetic[places[name]].sum()) - turning
        return of_planets, shares

    def _wave_energy(self, slot: str, shape: Complexes) -> float:
        """Kinetic energy of the wave that stands in the coordinates of a planet."""
        index = [i for i in self.assembly.coordinates[slot] if i >= 0]
        own = shape[index]
        return float((own.conj() @ self.system.mass[np.ix_(index, index)] @ own).real)

    def _central(self, planets: PlanetSet) -> set[str]:
        """Bodies that carry the planets or mesh with them."""
        meshes = (element.mesh for element in self.assembly.elements)
        ends = [{mesh.pinion, mesh.gear} for mesh in meshes]
        own = set(planets.names)
        return {planets.carrier}.union(*(pair for pair in ends if pair & own)) - own


def circle(x: complex, y: complex) -> float:
    """Product of the axes of an ellipse x, y, twice: ``|x|^2 + |y|^2`` for a circle from x to y, negative against it.

    Examples
    --------
    >>> circle(1.0, -1j), circle(1.0, 1j), circle(1.0, 2.0)
    (2.0, -2.0, 0.0)
    """
    return float(0.0 - 2.0 * (np.conj(x) * y).imag)
