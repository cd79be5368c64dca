"""Evaluation points of mesh models: positions around carriers, at samples of the bases' angles.

A single mesh is one place. Meshes of planets in phase are evaluated in places spread evenly over the revolution of the
carrier, in which the multi-blade components add up as they do for a planet there: the mean over the revolution counts.
Each planet out of phase is a place, whose angle rotates with the base of its carrier.

A model along a row has the inputs (readings) deflection and position in the mesh cycle, and one force; its tilting
stiffness is in the averaged system. Where its load shuttles, or it moves around a flexible ring gear, the misalignment
is an input, too, with a moment along it.
The model `table` has the inputs approach of both flanks, centre distance, misalignment of both flanks and position, and
a force along all but the last (`exugear.system.tooth_mesh.laws.table`). Kernels of `fe_ste.tools.compilation` read the
numbers of its rows.

A function f of the mesh cycle multiplies the input of each mesh. In multi-blade components this is

    sum over places of   back (waves, places)  f(position)  there (places, waves),

with both matrices from this module. The position follows the angle of the base; of planets out of
phase, shapes rotate with the angle of the carrier. Both generate harmonics: those of the cycle are known, those of a
revolution follow from few samples of it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exugear.steady.harmonics.lines import Group
from exugear.steady.mean_system.mesh_waves import MeshWaves
from exugear.steady.mean_system.planet_sets import PlanetSet
from exugear.system.kernels.meshes import TILT_LEVER, TILT_REST, MeshArrays
from exugear.system.kernels.table_law import NOMINAL_DEFLECTION, NOMINAL_DISTANCE, NOMINAL_MISALIGNMENT
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers

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
        sense = math.copysign(1.0, speed) * wave.sense
        position = positions[first] + sense * angles[:, [wave.base]] / (2.0 * math.pi)
        column = len(waves.base_orders) + carriers.index(planets.carrier) if planets and wave.ahead else None
        number = sum(other.first == wave.first for other in waves.waves)
        shapes = wave_shapes(planets, speed, None if column is None else angles[:, column], number)
        norms = planets.norms(number) if planets and column is not None else None
        rows, columns = among_waves(shapes, first, count, (len(angles),) if turning else (), norms)
        there.append(rows)
        back.append(columns)
        means += [first] * shapes.shape[-2]
        at.append(position + np.array(wave.ahead or np.zeros(shapes.shape[-2])))
    return MeshPlaces(
        tuple(means), np.concatenate(there, axis=-2), np.concatenate(back, axis=-1), np.concatenate(at, axis=1)
    )


def wave_shapes(planets: PlanetSet | None, speed: float, turned: Floats | None, count: int | None = None) -> Floats:
    """Waves in the places (places, waves), or where the carrier is turned by angles (s, places, waves).

    Parameters
    ----------
    planets : None of what does not travel
    speed : of the input, rad/s
    turned : (s,) angles of the base of the carrier, rad; None where it is none
    count : of waves where planets are modelled one by one; by default as many as planets
    """
    if planets is None:
        return np.ones((1, 1))
    if turned is not None:
        return planets.values(math.copysign(1.0, speed * planets.ratio) * turned, count)
    theta = 2.0 * np.pi * np.arange(TURNED) / TURNED
    return np.stack([np.ones_like(theta), np.cos(theta), np.sin(theta)], axis=1)


def among_waves(
    shapes: Floats, first: int, count: int, samples: tuple[int, ...], norms: Floats | None = None
) -> tuple[Floats, Floats]:
    """Values in places p by those of all `count` waves (..., p, count), and back, for some waves from `first` on.

    Parameters
    ----------
    shapes : (..., p, waves) of these waves in the places
    samples : shape of the samples over which the shapes turn; empty if they are constant
    norms : (waves,) mean sum of their squares over the places; by default that of these shapes
    """
    if norms is None:
        norms = (shapes**2).sum(axis=-2, keepdims=True)
    waves = slice(first, first + shapes.shape[-1])
    rows = np.zeros((*shapes.shape[:-1], count))
    columns = np.zeros((*shapes.shape[:-2], count, shapes.shape[-2]))
    rows[..., waves] = shapes
    columns[..., waves, :] = np.swapaxes(shapes / norms, -1, -2)
    return np.broadcast_to(rows, (*samples, *rows.shape[-2:])), np.broadcast_to(
        columns, (*samples, *columns.shape[-2:])
    )


DEFLECTION, MISALIGNMENT, POSITION = 0, 1, -1
"""Indices of the inputs of a model along a row: the first, the second where its load shuttles, the last."""
FRONT, BACK, CENTRE, TILT, BACK_TILT = range(5)
"""Places among what the law `table` reads and pushes along."""


@dataclass(frozen=True, eq=False)
class MeshInterface:
    """Rows of all mesh components at one speed; m components, r readings, f forces."""

    readings: Floats
    """(m, r, size) rows of what the law reads; the last is the position in the mesh cycle, in cycles."""
    static: Floats
    """(m, r) their values in the static state; the mean position counts from there."""
    forces: Floats
    """(m, f, size) rows along which its forces push."""
    positions: Floats
    """(meshes,) position in the mesh cycle at zero angle of the input, of the waves of meshes alone."""
    levers: Floats
    """(m, size + 1) rows of the difference between the deflection at mid-face and the input of a model whose load is
    off the middle, for components of meshes only; in the last column the difference in the static state."""
    rates: Floats | None = None
    """(m, r, size) rows of what the law reads by the rates of the coordinates; non-linear bearings have some."""

    @cached_property
    def turned_by_places(self) -> dict[tuple[int, int, float], Complexes]:
        """What the harmonics of mesh cycles are between waves, by first wave, harmonics and speed; `CycleFunctions`."""
        return {}


def mesh_ports(waves: MeshWaves, speed: float, loses_contact: bool) -> MeshInterface:
    """Rows of all mesh components at a speed of the input (rad/s); `loses_contact` for the model `table`."""
    meshes = waves.assembly.meshes
    rows, offsets = _table_rows(meshes) if loses_contact else _row_rows(meshes, waves.moving)
    means = np.array([wave.wave == 0 for wave in waves.waves])
    firsts = [wave.first for wave in waves.waves]
    readings = [waves.gradients(row, speed) for row in rows] + [waves.position_rows()]
    static = [waves.values(row, speed) + means * offset[firsts] for row, offset in zip(rows, offsets, strict=True)]
    # The mean position counts from the static state; what planets are ahead of each other by stays.
    ahead = np.where(means, 0.0, readings[-1] @ waves.system.static_at(speed))
    levers = meshes.tilt[:, [TILT_LEVER]] * meshes.table.misalignment
    forces = readings[:-1] if loses_contact else [waves.gradients(meshes.force - levers, speed), *readings[1:-1]]
    shift = meshes.tilt[:, TILT_LEVER] * (meshes.table.nominal[:, NOMINAL_MISALIGNMENT] - meshes.tilt[:, TILT_REST])
    beside = waves.values(levers, speed) + means * shift[firsts]
    return MeshInterface(
        readings=np.stack(readings, axis=1),
        static=np.stack([*static, ahead], axis=1),
        forces=np.stack(forces, axis=1),
        positions=waves.positions(speed),
        levers=np.column_stack([waves.gradients(levers, speed), beside]),
    )


def _row_rows(meshes: MeshArrays, moving: Booleans) -> tuple[list[Floats], list[Floats]]:
    """Return the input rows of a model along a row (`system.tooth_mesh.contact_state`), and values at zero coordinates.

    These are its deflection with the mean lever arm of the load and, for `MeshWaves.moving`, the misalignment relative
    to that of the contact's state; zeros for other meshes.
    """
    lever = meshes.tilt[:, TILT_LEVER]
    nominal = meshes.table.nominal
    turned = nominal[:, NOMINAL_MISALIGNMENT] - meshes.tilt[:, TILT_REST]
    row = meshes.deflection - lever[:, None] * meshes.table.misalignment
    offset = lever * turned
    if not moving.any():
        return [row], [nominal[:, NOMINAL_DEFLECTION] - offset]
    rows = [row, moving[:, None] * meshes.table.misalignment]
    return rows, [nominal[:, NOMINAL_DEFLECTION] - offset, moving * turned]


def _table_rows(meshes: MeshArrays) -> tuple[list[Floats], list[Floats]]:
    """Rows of both flanks and of the gear positions, and their values at zero coordinates."""
    table = meshes.table
    nominal = table.nominal.T
    front = nominal[NOMINAL_DEFLECTION]
    tilt = nominal[NOMINAL_MISALIGNMENT]
    rows = [meshes.deflection, table.back, table.centre, table.misalignment, table.back_misalignment]
    # The other flank closes when the loaded one opens by the backlash.
    return rows, [front, -front - table.backlash, nominal[NOMINAL_DISTANCE], tilt, tilt]


SAMPLED = 4
"""Samples of a carrier's turn over the highest multiple of it that shapes have with each other."""
Spectra = Mapping[tuple[int, int], Complexes]
"""Harmonics (m, h + 1) over the mesh cycle of the functions that lead to a force from a reading."""


@dataclass(frozen=True, eq=False)
class Family:
    """The waves of one family of meshes, or a single mesh."""

    first: int
    count: int
    """Its first wave, which is the mean one, and number of waves."""
    base: int
    carrier: int
    """Place of the base that the mesh cycle follows, and of that of the carrier among the bases; -1 of none."""
    planets: PlanetSet | None
    ahead: tuple[float, ...]
    """Cycles by which the mesh in each place is ahead; one number where all are alike."""

    @property
    def waves(self) -> slice:
        """Its waves."""
        return slice(self.first, self.first + self.count)

    @property
    def turns(self) -> int:
        """Largest multiple of the carrier's angle in products of two shapes."""
        if self.carrier < 0 or self.planets is None:
            return 0
        return 2 * self._highest(self.count)

    @property
    def turns_of_products(self) -> Integers:
        """Multiples (t,) of the carrier's angle in the waves of a product of two signals at the planets."""
        if self.carrier < 0 or self.planets is None:
            return np.zeros(1, dtype=np.int64)
        step = self.planets.passing
        most = (self._highest(self.count) + 2 * self._highest(self.planets.waves)) // step
        return step * np.arange(-most, most + 1)

    def _highest(self, count: int) -> int:
        """Find the highest wave number of the first waves."""
        assert self.planets is not None
        return max(m for _, m in self.planets.kinds(count))


def families(waves: MeshWaves) -> tuple[Family, ...]:
    """Families of all mesh components, in their order."""
    carriers = [name for name, _ in waves.carriers]
    found = []
    for first, wave in enumerate(waves.waves):
        if wave.wave != 0:
            continue
        planets = waves.planets(wave)
        count = sum(other.first == wave.first for other in waves.waves)
        carrier = len(waves.base_orders) + carriers.index(planets.carrier) if planets and wave.ahead else -1
        found.append(Family(first, count, wave.base, carrier, planets, wave.ahead or (0.0,)))
    return tuple(found)


def group_of(family: Family, harmonics: int, forces: int, bases: int) -> Group:
    """Group of the forces of a family, which follow each other wave by wave, with harmonics up to a highest one."""
    every = np.arange(-harmonics, harmonics + 1)
    turns = np.arange(-family.turns, family.turns + 1)
    multiples = np.zeros((len(every), len(turns), bases), dtype=np.int64)
    multiples[..., family.base] = every[:, None]
    if family.carrier >= 0:
        multiples[..., family.carrier] = turns
    return Group(forces * family.first, forces * family.count, multiples.reshape(-1, bases))


def wave_products(family: Family, speed: float) -> Complexes:
    """Find what the waves of two signals at the planets multiply to, (t, count, p, p) at `Family.turns_of_products`.

    Both have the first p waves, as many as there are planets. Planets in phase count by their mean over a revolution.
    """
    turns = family.turns_of_products
    there, norms = _shapes_over_turn(family, speed, 2 * int(turns[-1]) + 1)
    first = there[..., : family.planets.waves if family.planets is not None and family.carrier >= 0 else None]
    products = np.einsum("snv,snw,snx->svwx", there / norms, first, first)
    return np.asarray(np.fft.fft(products, axis=0)[turns] / len(products))


def slopes_over_turn(family: Family, slopes: Floats, speed: float) -> Complexes:
    """Find what slopes (places, f, r) at the planets are between the waves, (2 turns + 1, count f, count r).

    Multiples of the carrier's angle are from -turns to turns; `speed` is that of the input, rad/s.
    """
    samples = SAMPLED * max(family.turns, 1)
    there, norms = _shapes_over_turn(family, speed, samples)
    found = np.einsum("suv,ufr,suw->svfwr", there / norms, slopes, there, optimize=True)
    spectrum = np.fft.fft(found, axis=0)[np.arange(-family.turns, family.turns + 1)] / samples
    return np.asarray(spectrum.reshape(len(spectrum), family.count * slopes.shape[1], -1))


class CycleFunctions:
    """Functions of the mesh cycles that lead to forces along a row from readings, as `HarmonicCoupling` takes them.

    Where no planets are out of phase, what each mesh is ahead in the static state counts to first order: it gives a
    mean wave to cosine and sine.

    Parameters
    ----------
    spectra : harmonics of the functions
    forces : number of forces, and of readings, of each wave
    means : (m, forces), optional
        What is subtracted from the mean that a wave has with itself, by its first wave.
    """

    def __init__(
        self, waves: MeshWaves, kinds: Sequence[Family], spectra: Spectra, forces: int, means: Floats | None = None
    ) -> None:
        self._forces = forces
        self._means = None if means is None else [np.tile(means[own.first], own.count) for own in kinds]
        self._by_place = bool(waves.carriers)
        self._families = [(family, waves.waves[family.first].sense) for family in kinds]
        self._spectra = []
        self._of_waves = []
        for family in kinds:
            spectrum = _spectrum(spectra, family.first, forces)
            own = np.einsum("qfr,vw->qvfwr", spectrum, np.eye(family.count))
            self._spectra.append(spectrum)
            self._of_waves.append(own.reshape(len(own), family.count * forces, family.count * forces))

    def at(self, ports: MeshInterface, speed: float) -> list[Complexes]:
        """Coefficients (q, forces of waves, readings of waves) by family at the harmonics of `group_of`.

        `speed` is that of the input, rad/s.
        """
        found = []
        for (family, sense), spectrum, of_waves in zip(self._families, self._spectra, self._of_waves, strict=True):
            if self._by_place:
                functions = self._by_places(family, spectrum, ports, speed)
            else:
                functions = self._by_waves(family, of_waves, ports)
            # A mesh that runs through its cycle backwards; the carrier turns as it does.
            if sense * speed < 0.0:
                turns = functions.reshape(len(spectrum), -1, *functions.shape[1:])
                functions = turns[:, ::-1].conj().reshape(functions.shape)
            found.append(functions)
        for functions, means in zip(found, self._means or (), strict=False):
            np.einsum("ii->i", functions[len(functions) // 2])[...] -= means
        return found

    def _by_waves(self, family: Family, of_waves: Complexes, ports: MeshInterface) -> Complexes:
        """Functions of each wave with itself, and of the mean wave to others."""
        harmonics = len(of_waves) // 2
        orders = 2j * math.pi * np.arange(-harmonics, harmonics + 1)[:, None, None]
        ahead: Floats = np.zeros((family.count, self._forces, family.count, self._forces))
        for force in range(self._forces):
            ahead[:, force, 0, force] = ports.static[family.waves, POSITION]
        to_others = of_waves @ ahead.reshape(of_waves.shape[1:])
        return np.asarray(np.exp(orders * ports.positions[family.first]) * (of_waves + orders * to_others))

    def _by_places(self, family: Family, spectrum: Complexes, ports: MeshInterface, speed: float) -> Complexes:
        """Functions by all places, each as far ahead as in the static state, with multiples of the carrier's angle."""
        key = family.first, len(spectrum), speed
        factors = ports.turned_by_places.get(key)
        if factors is None:
            factors = ports.turned_by_places[key] = _turned_by_places(family, len(spectrum) // 2, ports, speed)
        found = factors[:, :, :, None, :, None] * spectrum[:, None, None, :, None, :]
        return found.reshape(-1, family.count * self._forces, family.count * self._forces)


def _turned_by_places(family: Family, harmonics: int, ports: MeshInterface, speed: float) -> Complexes:
    """Find what a harmonic of a mesh cycle is between waves, (2 harmonics + 1, 2 turns + 1, count, count)."""
    samples = SAMPLED * family.turns if family.carrier >= 0 else 1
    there, norms = _shapes_over_turn(family, speed, samples)
    back = np.swapaxes(there / norms, -1, -2)
    ahead = ports.positions[family.first] + np.array(family.ahead) + there @ ports.static[family.waves, POSITION]
    turned = np.exp(2j * math.pi * np.arange(harmonics + 1)[:, None, None] * ahead)
    between = (back * turned[:, :, None, :]) @ there
    factors = np.fft.fft(between, axis=1)[:, np.arange(-family.turns, family.turns + 1)] / samples
    return np.concatenate([factors[:0:-1, ::-1].conj(), factors])


def _spectrum(spectra: Spectra, first: int, forces: int) -> Complexes:
    """Harmonics (2 h + 1, forces, readings) of all functions over a mesh cycle, from -h to h."""
    harmonics = next(iter(spectra.values())).shape[1] - 1
    found = np.zeros((2 * harmonics + 1, forces, forces), dtype=complex)
    for (force, read), values in spectra.items():
        found[harmonics:, force, read] = values[first]
    found[:harmonics] = found[:harmonics:-1].conj()
    return found


def _shapes_over_turn(family: Family, speed: float, samples: int) -> tuple[Floats, Floats]:
    """Waves in all places (samples, places, count) over a turn of the carrier, and the mean sum of their squares."""
    theta = 2.0 * math.pi * np.arange(samples) / samples
    there = wave_shapes(family.planets, speed, theta if family.carrier >= 0 else None, family.count)
    there = np.broadcast_to(there, (samples, *there.shape[-2:]))
    if family.planets is not None and family.carrier >= 0:
        return there, family.planets.norms(family.count)
    return there, (there**2).sum(axis=-2, keepdims=True)
