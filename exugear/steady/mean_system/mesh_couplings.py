"""How functions of the mesh cycle couple the waves of meshes: one matrix for each harmonic of the angles that turn.

A function f of the mesh cycle multiplies what each mesh reads. Seen in waves around the carrier that is

    sum over places of   back (waves, places)  f(position)  there (places, waves),

as `exugear.steady.mean_system.mesh_places` has both. The position follows the angle of the base; of planets out of
phase, shapes turn with the angle of the carrier. Both make harmonics: those of the cycle are known, those of a turn
follow from few samples of it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from exugear.steady.harmonics.products import Group
from exugear.steady.mean_system.mesh_places import wave_shapes
from exugear.steady.mean_system.mesh_ports import POSITION, MeshPorts
from exugear.steady.mean_system.mesh_waves import MeshWaves
from exugear.steady.mean_system.rotating_frame import PlanetSet
from fe_ste.tools.arrays import Complexes

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
        return 2 * (self.planets.waves // 2)


def families(waves: MeshWaves) -> tuple[Family, ...]:
    """Families of all mesh waves, in their order."""
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


def coupled(
    waves: MeshWaves, family: Family, spectra: Spectra, ports: MeshPorts, speed: float, forces: int
) -> Complexes:
    """Coefficients (q, forces of waves, readings of waves) at the harmonics of `group_of`, at a speed (rad/s).

    Where no planets are out of phase, what each mesh is ahead in the static state counts to first order: it gives a
    mean wave to cosine and sine.
    """
    forward = waves.waves[family.first].sense * math.copysign(1.0, speed) > 0.0
    cycles = np.array([own[family.first] for own in spectra.values()])
    parts = (_between_places if waves.carriers else _between_waves)(family, cycles, ports, speed)
    if not forward:  # the mesh runs through its cycle backwards, the carrier turns as it does
        parts = parts[:, :, ::-1].conj()
    harmonics = cycles.shape[1] - 1
    found = np.zeros((2 * harmonics + 1, 2 * family.turns + 1, family.count, forces, family.count, forces), complex)
    for (force, read), own in zip(spectra, parts, strict=True):
        found[harmonics:, :, :, force, :, read] = own
        found[:harmonics, :, :, force, :, read] = own[:0:-1, ::-1].conj()
    return np.asarray(found.reshape(-1, family.count * forces, family.count * forces))


def _between_waves(family: Family, cycles: Complexes, ports: MeshPorts, speed: float) -> Complexes:
    """Coefficients (f, h + 1, 1, waves, waves) of each wave with itself, and of the mean wave to others."""
    orders = 2j * math.pi * np.arange(cycles.shape[1])
    turned = cycles * np.exp(orders * ports.positions[family.first])
    found = np.zeros((*cycles.shape, 1, family.count, family.count), dtype=complex)
    found[:, :, 0, range(family.count), range(family.count)] = turned[..., None]
    found[:, :, 0, :, 0] += (orders * turned)[..., None] * ports.static[family.waves, POSITION]
    return found


def _between_places(family: Family, cycles: Complexes, ports: MeshPorts, speed: float) -> Complexes:
    """Coefficients (f, h + 1, turns, waves, waves) by all places, each as far ahead as the static state has it."""
    samples = SAMPLED * family.turns if family.carrier >= 0 else 1
    theta = 2.0 * math.pi * np.arange(samples) / samples
    there = wave_shapes(family.planets, speed, theta if family.carrier >= 0 else None)
    there = np.broadcast_to(there, (samples, *there.shape[-2:]))
    back = np.swapaxes(there / (there**2).sum(axis=-2, keepdims=True), -1, -2)
    ahead = ports.positions[family.first] + np.array(family.ahead) + there @ ports.static[family.waves, POSITION]
    turned = np.exp(2j * math.pi * np.arange(cycles.shape[1])[:, None, None] * ahead)
    between = (back * turned[:, :, None, :]) @ there
    turns = np.fft.fft(between, axis=1)[:, np.arange(-family.turns, family.turns + 1)] / samples
    return np.asarray(cycles[:, :, None, None, None] * turns)
