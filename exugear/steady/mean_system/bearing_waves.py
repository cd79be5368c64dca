"""Bearings with rows of rolling elements in the rotating frame: inputs of their model, and its force directions.

A bearing model has five inputs (readings), the displacement and tilts of the second body's seat against that of the
first in the first one's axes, ahead by the time of the damping; five forces go with them. Bearings of equal planets are
written as multi-blade components, like their meshes, each along the radius and the tangent of its planet: in these
directions the model is the same for all of them, at every angle of the carrier.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from exugear.steady.mean_system.mean_system import PLACE_STEP, RATE_STEP, MeanSystem
from exugear.steady.mean_system.mesh_places import POSITION, MeshInterface, MeshPlaces, among_waves, wave_shapes
from exugear.steady.mean_system.mesh_waves import WAVES, MeshWaves, wave_name
from exugear.steady.mean_system.planet_sets import PlanetSet, SteadyError
from exugear.steady.mean_system.rotating_frame import PLACES
from exugear.steady.mean_system.sampled_laws import sample_rolling
from exugear.system.bearings.stiffness import bearing_rows
from exugear.system.kernels.connectors import rolling_pushes, rolling_strains
from exugear.system.kernels.rolling import RollingArrays, selected_rolling
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Floats

COMPONENTS = 5
"""Readings and forces of a bearing: along x, y, z, and tilts about x and y; of planets' along radius and tangent."""
TILTS = slice(3, 5)
"""Tilts among them."""


@dataclass(frozen=True, eq=False)
class BearingWave:
    """One wave of the bearings of a family, or a single bearing."""

    name: str
    """Bearing or family, with the wave where there are several."""
    connectors: tuple[int, ...]
    """Supports of the family, in the order of their planets."""
    law: int
    """Place of its law in `BearingWaves.laws`."""
    wave: int
    """0 mean, 1 cosine, 2 sine, and on where planets mesh out of phase."""
    weight: float
    """What a unit of its force counts in generalized forces."""
    planets: PlanetSet | None


class BearingMean(NamedTuple):
    """Bearings in the averaged system at one speed; b components."""

    readings: Floats
    rates: Floats
    """(b, 5, size) rows of what the laws read, by the frame's coordinates and by their rates."""
    static: Floats
    """(b, 5) readings in the static state, m and rad."""
    pushes: Floats
    """(b, 5, size) rows along which forces act: a unit is a generalized force of minus the row."""
    load: Floats
    """(b, 5) forces in the static state, N and N m."""
    slope: Floats
    """(b, 5, b, 5) derivatives of the forces by the readings there."""


@dataclass(frozen=True, eq=False)
class BearingWaves:
    """All multi-blade components of the nonlinear bearings of an averaged system."""

    system: MeanSystem
    waves: tuple[BearingWave, ...]
    """Those of a family one after the other."""
    carriers: tuple[str, ...]
    """Carriers whose angle is a base: their planets are modelled individually."""

    @property
    def assembly(self) -> Assembly:
        """What was linearised."""
        return self.system.frame.assembly

    @cached_property
    def weights(self) -> Floats:
        """(b,) array."""
        return np.array([wave.weight for wave in self.waves])

    @cached_property
    def firsts(self) -> tuple[int, ...]:
        """Place of the mean wave of each law."""
        return tuple(n for n, wave in enumerate(self.waves) if wave.wave == 0)

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each law: bearing, of planets' bearings the family."""
        return tuple(self.waves[n].name for n in self.firsts)

    @cached_property
    def laws(self) -> RollingArrays:
        """Law of each family, of planets along radius and tangent."""
        firsts = [self.waves[n] for n in self.firsts]
        laws = selected_rolling(self.assembly.connectors.rolling, np.array([wave.connectors[0] for wave in firsts]))
        turned = np.array([0.0 if wave.planets is None else wave.planets.angles[0] for wave in firsts])
        return laws._replace(phase=laws.phase - turned)

    @cached_property
    def radii(self) -> Floats:
        """Half of the pitch diameter of each wave's bearing, (b,), m: what makes lengths of tilts."""
        supports = self.assembly.supports
        return np.array([0.5 * bearing_rows(supports[wave.connectors[0]])[0].pitch_diameter for wave in self.waves])

    def at(self, speed: float) -> BearingMean:
        """Find the static state of the bearings in the averaged system at a speed of the input, rad/s."""
        frame = self.system.frame
        numbers = np.concatenate([self.waves[n].connectors for n in self.firsts]).astype(np.int64)  # law by law
        q, v, _ = frame.state(0.0, speed, self.system.static_at(speed))
        t, t1, _ = frame.matrices(0.0)
        chosen = self.assembly.connectors.chosen(numbers)
        ways = np.eye(q.size)
        sets = [self.waves[n].planets for n in self.firsts]
        angles = [np.zeros(1) if planets is None else planets.angles for planets in sets]
        # From components along a bearing's axes to those along radius and tangent of its planet.
        turn = np.tile(np.eye(COMPONENTS), (len(numbers), 1, 1))
        for own, angle in zip(turn, np.concatenate(angles), strict=True):
            c = math.cos(angle)
            s = math.sin(angle)
            own[:2, :2] = own[3:, 3:] = [[c, s], [-s, c]]

        def slopes(step: float, by_place: float) -> Floats:
            moved = [
                rolling_strains(q + by_place * own, v + (1.0 - by_place) * own, chosen)
                for own in (step * ways, -step * ways)
            ]
            return np.asarray(turn @ np.moveaxis((moved[0] - moved[1]) / (2.0 * step), 0, -1))

        by_q = slopes(PLACE_STEP, 1.0)
        by_v = slopes(RATE_STEP, 0.0)
        static = (turn @ rolling_strains(q, v, chosen)[..., None])[..., 0]
        laws = [self.waves[n].law for n in self.firsts for _ in self.waves[n].connectors]
        loads = [sample_rolling(self.laws, law, strain[None])[0] for law, strain in zip(laws, static, strict=True)]
        return BearingMean(
            readings=self._waves_of(by_q @ t + speed * by_v @ t1),
            rates=self._waves_of(by_v @ t),
            static=self._waves_of(static),
            pushes=self._waves_of(-(turn @ rolling_pushes(q, chosen)) @ t),
            load=self._waves_of(np.concatenate(loads)),
            slope=self._mean_slope(self._waves_of(static)),
        )

    def _waves_of(self, values: Floats) -> Floats:
        """Waves (b, ...) of values (c, ...) at zero angle of the input."""
        out = np.empty((len(self.waves), *values.shape[1:]))
        at = 0
        for n in self.firsts:
            count = len(self.waves[n].connectors)
            shapes = self._shapes(n, np.zeros(1))[0]
            back = (shapes / (shapes**2).sum(axis=0)).T
            out[n : n + len(back)] = np.tensordot(back, values[at : at + count], axes=1)
            at += count
        return out

    def _shapes(self, first: int, turned: Floats) -> Floats:
        """Waves of the law whose mean is wave `first`, where its carrier has turned (s, bearings, waves)."""
        planets = self.waves[first].planets
        law = self.waves[first].law
        if planets is None:
            return np.ones((len(turned), 1, 1))
        return planets.values(turned)[..., : sum(wave.law == law for wave in self.waves)]

    def _mean_slope(self, static: Floats) -> Floats:
        """Return derivatives (b, 5, b, 5) of the forces of components by readings, at the static state (b, 5).

        As in the averaged system: the mean over the same positions of the carrier.
        """
        out = np.zeros((len(self.waves), COMPONENTS) * 2)
        for n in self.firsts:
            planets = self.waves[n].planets
            law = self.waves[n].law
            turned = np.zeros(1) if planets is None else 2.0 * np.pi / planets.waves * np.arange(PLACES) / PLACES
            shapes = self._shapes(n, turned)
            own = slice(n, n + shapes.shape[-1])
            back = shapes / (shapes**2).sum(axis=1, keepdims=True)
            _, slope = sample_rolling(self.laws, law, (shapes @ static[own]).reshape(-1, COMPONENTS))
            slope = slope.reshape(*shapes.shape[:2], COMPONENTS, COMPONENTS)
            out[own, :, own] = np.einsum("snw,snfr,snv->wfvr", back, slope, shapes) / len(turned)
        return out


def bearing_waves(meshes: MeshWaves) -> BearingWaves | None:
    """Waves of the bearings with rows of rolling elements, None where all bearings are linear.

    Parameters
    ----------
    meshes : of the same gearbox: bearings of planets that mesh out of phase have all waves

    Raises
    ------
    SteadyError
        Planets have different numbers of non-linear bearings.
    """
    assembly = meshes.assembly
    rows = np.flatnonzero(np.diff(assembly.connectors.rolling.first))
    if not rows.size:
        return None
    carriers = tuple(name for name, _ in meshes.carriers)
    families: dict[str, list[int]] = {}
    for n in rows:
        support = assembly.supports[n]
        carried = any(support.body in planets.names for planets in meshes.system.frame.sets)
        families.setdefault(support.family if carried else support.name, []).append(int(n))
    waves: list[BearingWave] = []
    for law, (family, numbers) in enumerate(families.items()):
        bodies = [assembly.supports[n].body for n in numbers]
        planets = next((planets for planets in meshes.system.frame.sets if bodies[0] in planets.names), None)
        if planets is None:
            waves.append(BearingWave(family, tuple(numbers), law, 0, 1.0, None))
            continue
        if sorted(bodies) != sorted(planets.names):
            raise SteadyError(f"bearings.{family}: nonlinear on some of the planets only; all planets must be equal")
        ordered = tuple(numbers[bodies.index(name)] for name in planets.names)
        norms = (planets.shapes(0.0)[0] ** 2).sum(axis=0)
        for number in range(planets.waves if planets.carrier in carriers else len(WAVES)):
            name = f"{family} {wave_name(number, planets.waves)}" if number else family
            waves.append(BearingWave(name, ordered, law, number, float(norms[number]), planets))
    return BearingWaves(meshes.system, tuple(waves), carriers)


def ports_with_bearings(ports: MeshInterface, bearings: BearingMean) -> MeshInterface:
    """Ports of meshes and behind them those of bearings.

    Laws with fewer readings or forces have rows of zeros; the first reading of a mesh is the first here, the last the
    last.
    """
    count = ports.readings.shape[0]
    size = ports.readings.shape[2]
    forces = max(ports.forces.shape[1], COMPONENTS)
    readings = max(ports.readings.shape[1], COMPONENTS + 1)
    total = count + len(bearings.static)
    read, rates, pushed = (np.zeros((total, own, size)) for own in (readings, readings, forces))
    static = np.zeros((total, readings))
    own = ports.readings.shape[1] - 1
    read[:count, :own], read[:count, POSITION] = ports.readings[:, :own], ports.readings[:, POSITION]
    static[:count, :own], static[:count, POSITION] = ports.static[:, :own], ports.static[:, POSITION]
    pushed[:count, : ports.forces.shape[1]] = ports.forces
    read[count:, :COMPONENTS], rates[count:, :COMPONENTS] = bearings.readings, bearings.rates
    static[count:, :COMPONENTS], pushed[count:, :COMPONENTS] = bearings.static, bearings.pushes
    return MeshInterface(read, static, pushed, ports.positions, ports.levers, rates)


def places_with_bearings(
    places: MeshPlaces, bearings: BearingWaves, meshes: int, speed: float, angles: Floats
) -> MeshPlaces:
    """Places of meshes and behind them those of bearings, whose waves follow those of the meshes.

    Parameters
    ----------
    meshes : number of bases of meshes, behind which those of carriers follow
    speed : of the input, rad/s
    angles : (s, bases) of the bases, rad
    """
    count = places.there.shape[-1]
    means = list(places.means)
    there = [places.there]
    back = [places.back]
    total = count + len(bearings.waves)
    for n in bearings.firsts:
        planets = bearings.waves[n].planets
        turning = planets is not None and planets.carrier in bearings.carriers
        column = meshes + bearings.carriers.index(planets.carrier) if planets and turning else None
        shapes = wave_shapes(planets, speed, None if column is None else angles[:, column])
        rows, columns = among_waves(shapes, count + n, total, places.there.shape[:-2])
        there.append(rows)
        back.append(columns)
        means += [count + n] * shapes.shape[-2]
    return MeshPlaces(
        tuple(means),
        np.concatenate([_wider(there[0], total, -1), *there[1:]], axis=-2),
        np.concatenate([_wider(back[0], total, -2), *back[1:]], axis=-1),
        places.positions,
    )


def _wider(values: Floats, size: int, axis: int) -> Floats:
    """Values with zeros behind them along an axis."""
    lacking = [(0, 0)] * values.ndim
    lacking[axis] = (0, size - values.shape[axis])
    return np.pad(values, lacking)
