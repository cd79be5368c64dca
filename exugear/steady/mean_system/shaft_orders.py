"""Excitations at the orders of shafts: pitch deviations and run-out of gears, and stated torques.

A deviation e of a gear is subtracted from the deflection d of its meshes, so that the force of a mesh is

    F = k (d - e) + c (d' - e'),

and -k e - c e' is a given force at the orders n of the shaft. The stiffness k varies with the mesh cycle, which brings
the sidebands h z +- n of the mesh orders h z of a gear with z teeth. The normal of a flank with deviations is not that
of the perfect one: by the work along e, the static force F_0 has the torque F_0 de/dphi on the gear, which is given,
too. The averaged system itself has no deviations. A stated torque on a body is given like this one.

Meshes of planets are waves around the carrier (`exugear.steady.mean_system.mesh_waves`), so that a deviation of order n
against the carrier appears at n plus and minus multiples of the carrier's rotation.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field, replace

import numpy as np

from exugear.gearbox.parts import TorqueOrder
from exugear.steady.harmonics.lines import SAME, LineSet, Rotation, Sidebands, fourier_coefficients, largest
from exugear.steady.mean_system.mesh_waves import MeshWaves
from exugear.steady.mean_system.planet_sets import PlanetSet
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN
from exugear.system.kernels.meshes import FRAME
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Complexes, Floats, Integers

NEGLECTED = 1e-2
"""Share of the root mean square of a mesh component's deviations in orders that are left out."""
SAMPLES_PER_PIECE = 4
"""Samples of each cubic piece of a deviation for its Fourier coefficients; pieces are a fraction of a tooth."""
REACH = 4
"""Harmonics of each mesh frequency whose sidebands a stated torque has."""
LEAST = 1e-9
"""Share of the largest coefficient below which one is zero but for round-off."""


@dataclass(frozen=True, eq=False)
class ShaftOrders:
    """Deviations of gears and stated torques as Fourier series of the angles of rotations; without any, it is empty.

    Values hold where the input turns about +z; where it turns about -z, they are the conjugates.
    """

    rotations: tuple[Rotation, ...] = ()
    """Bases that follow those of meshes and of carriers whose planets mesh out of phase."""
    sidebands: tuple[Sidebands, ...] = ()
    """Lines that matter."""
    multiples: Integers = field(default_factory=lambda: np.zeros((0, 0), dtype=np.int64))
    """(t, b) multiples of the bases behind those of the meshes."""
    displacement: Complexes = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))
    """(t, m) deviations of the mesh components, m."""
    reaction: Complexes = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))
    """(t, size) generalized forces in the rotating frame, by the static forces on deviations and of stated torques."""
    source: tuple[str, ...] = ()
    """(t,) name of the stated torque that a term is of; empty for deviations."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the rotations."""
        return tuple(rotation.name for rotation in self.rotations)

    def at_lines(self, values: Complexes, lines: LineSet, meshes: int, speed: float) -> Complexes:
        """Coefficients (n, ...) of a Fourier series (t, ...) at lines, of which `meshes` bases are meshes."""
        found = np.zeros((len(lines.index), *values.shape[1:]), dtype=complex)
        if not len(values):
            return found
        multiples = np.zeros((len(values), lines.index.shape[1]), dtype=np.int64)
        multiples[:, meshes:] = self.multiples
        place, mirrored = lines.find(multiples)
        values = values if speed > 0.0 else values.conj()
        there = place >= 0
        turned = np.where(mirrored[:, None], values.conj(), values)
        np.add.at(found, place[there], turned[there])
        return found


def without_deviations(assembly: Assembly) -> Assembly:
    """Return an assembly whose gears have no deviations."""
    none = (np.zeros(0), np.zeros(0))
    elements = tuple(replace(element, errors=none) for element in assembly.elements)
    no_pieces = np.zeros_like(assembly.meshes.error_pieces)
    return replace(assembly, elements=elements, meshes=assembly.meshes._replace(error_pieces=no_pieces))


def shaft_orders(assembly: Assembly, waves: MeshWaves) -> ShaftOrders:
    """Find the deviations of an assembly's gears and the stated torques, and the orders that matter.

    Parameters
    ----------
    assembly : with deviations
    waves : mesh components of its averaged system without deviations
    """
    series = _Series(assembly, waves)
    for meshes, planets in waves.groups:
        series.add_family(meshes, planets)
    for order in assembly.gearbox.torque_orders:
        series.add_torque(order)
    return series.found()


Key = tuple[tuple[str, int], ...]
"""Multiples of rotations by their names, without zeros."""


class _Series:
    """Collects the terms of all families of meshes."""

    def __init__(self, assembly: Assembly, waves: MeshWaves) -> None:
        self.assembly = assembly
        self.waves = waves
        self.frame = waves.system.frame
        speed = float(waves.system.speeds[1])
        self.still = self.frame.matrices(0.0)[0] @ waves.system.static_at(speed)
        self.load = waves.mean_stiffness * (waves.values(assembly.meshes.deflection, speed) - waves.rest)
        self.orders = {name: modulator.order for name, modulator in waves.carriers}
        """Order of each rotation, by its name; those of carriers whose planets mesh out of phase come first."""
        self.displacement: dict[tuple[str, Key], Complexes] = {}
        self.reaction: dict[tuple[str, Key], Complexes] = {}
        self.beside: list[tuple[Key, int, int | None]] = []
        """Rotations, the base of the mesh beside whose harmonics they appear, and the highest of these."""

    def add_family(self, meshes: tuple[int, ...], planets: PlanetSet | None) -> None:
        """Add the deviations of all meshes of a family of planets, or of a single mesh."""
        waves = self.waves.waves
        own = [n for n, wave in enumerate(waves) if wave.first == meshes[0]]
        sizes: dict[Key, float] = {}
        for place, mesh in enumerate(meshes):
            for end in range(2):
                orders = self._orders(mesh, end)
                if not orders:
                    continue
                teeth = self._wheel(mesh, end)[1]
                turning = self._turning(mesh, end, planets, place, len(own))
                for (order, value), (turn, shape, row) in itertools.product(orders, turning):
                    if order == 0 and turn < 0:
                        continue  # the conjugate of that which turns the other way
                    key = self._key(mesh, end, planets, order, turn)
                    displaced = np.zeros(len(waves), dtype=complex)
                    displaced[own] = value * shape
                    pushed = 1j * order * value * self.load[own[0]] * row
                    if not key and (order or turn):  # at rest it counts with its conjugate
                        displaced, pushed = (2.0 * part.real.astype(complex) for part in (displaced, pushed))
                    self._add(self.displacement, ("", key), displaced)
                    self._add(self.reaction, ("", key), pushed)
                    # Orders at the same distance from a mesh order are sidebands of one kind.
                    nearest = self._key(mesh, end, planets, order - teeth * round(order / teeth), turn)
                    sizes[nearest] = math.hypot(sizes.get(nearest, 0.0), float(np.linalg.norm(displaced)))
        sizes.pop((), None)
        if sizes:
            size = np.array(list(sizes.values()))
            kept = largest(size, NEGLECTED * float(np.linalg.norm(size))) & (size > 0.0)
            base = waves[own[0]].base
            self.beside += [(key, base, None) for key, is_kept in zip(sizes, kept, strict=True) if is_kept]

    def add_torque(self, torque: TorqueOrder) -> None:
        """Add a torque that varies with the angle of a body."""
        speed = self.frame.speeds.get(torque.body, 0.0)
        place = self.assembly.spin[torque.body]
        if speed == 0.0:
            return
        name = f"rotation of {torque.body}"
        self.orders.setdefault(name, abs(speed))
        key = ((name, torque.order * int(math.copysign(1.0, speed))),)
        phase = torque.phase + torque.order * self.still[place]
        row = self.frame.matrices(0.0)[0][place]
        self._add(self.displacement, (torque.excitation, key), np.zeros(len(self.waves.waves), dtype=complex))
        self._add(self.reaction, (torque.excitation, key), 0.5 * torque.amplitude * np.exp(1j * phase) * row)
        self.beside += [(key, base, REACH) for base in range(len(self.waves.base_orders))]

    def found(self) -> ShaftOrders:
        """Return what was collected."""
        names = list(self.orders)
        carriers = len(self.waves.carriers)

        def row(key: Key) -> tuple[int, ...]:
            multiples = dict(key)
            return tuple(multiples.get(name, 0) for name in names)

        if not self.displacement:
            return ShaftOrders()
        return ShaftOrders(
            tuple(Rotation(name, self.orders[name]) for name in names[carriers:]),
            tuple(Sidebands(row(key), base, reach) for key, base, reach in self.beside),
            np.array([row(key) for _, key in self.displacement], dtype=np.int64).reshape(len(self.displacement), -1),
            np.array(list(self.displacement.values())),
            np.array([self.reaction[term] for term in self.displacement]),
            tuple(source for source, _ in self.displacement),
        )

    def _wheel(self, mesh: int, end: int) -> tuple[str, int]:
        """Body and number of teeth of a gear of a mesh."""
        own = self.assembly.elements[mesh].mesh
        gear = (own.pair.pinion, own.pair.gear)[end]
        return (own.pinion, own.gear)[end], gear.teeth

    def _orders(self, mesh: int, end: int) -> list[tuple[int, complex]]:
        """Orders of a gear's deviation and their coefficients at zero angle of the input, m."""
        meshes = self.assembly.meshes
        pieces = int(meshes.error_pieces[mesh, end])
        if not pieces:
            return []
        powers = np.vander(np.arange(SAMPLES_PER_PIECE) / SAMPLES_PER_PIECE, 4, increasing=True).T
        values = fourier_coefficients((meshes.error[mesh, end, :pieces] @ powers).ravel(), pieces // 2)
        angle = sum(sign * self.still[at] for at, sign in self._angles(mesh, end))
        values = values * np.exp(1j * np.arange(len(values)) * angle)
        return [(n, complex(x)) for n, x in enumerate(values) if abs(x) > LEAST * np.abs(values).max()]

    def _angles(self, mesh: int, end: int) -> list[tuple[int, float]]:
        """Coordinates of a gear's angle against its frame, each with its sign."""
        index = self.assembly.meshes.coordinates[mesh]
        both = ((int(index[BODY_SIZE * end + SPIN]), 1.0), (int(index[FRAME]), -1.0))
        return [(at, sign) for at, sign in both if at >= 0]

    def _turning(
        self, mesh: int, end: int, planets: PlanetSet | None, place: int, waves: int
    ) -> list[tuple[int, Floats | Complexes, Complexes]]:
        """Multiples of the carrier's angle, with the shares of a mesh in waves and of its gear's angle in motion."""
        angles = self._angles(mesh, end)
        if planets is None:
            rotation = self.frame.matrices(0.0)[0]
            row = sum((sign * rotation[at] for at, sign in angles), np.zeros(len(rotation)))
            return [(0, np.ones(1), row.astype(complex))]
        most = planets.waves // 2
        samples = 2 * (2 * most + 1)
        turned = 2.0 * np.pi * np.arange(samples) / samples
        values = planets.values(turned)[:, :, :waves]
        shapes = values[:, place] / (values[0] ** 2).sum(axis=0)
        rows = []
        for angle in turned:
            rotation = self.frame.matrices(angle / planets.ratio)[0]
            rows.append(sum((sign * rotation[at] for at, sign in angles), np.zeros(len(rotation))))
        of_shapes = np.fft.fft(shapes, axis=0) / samples
        of_rows = np.fft.fft(np.array(rows), axis=0) / samples
        return [(turn, of_shapes[turn], of_rows[turn]) for turn in range(-most, most + 1)]

    def _key(self, mesh: int, end: int, planets: PlanetSet | None, order: int, turn: int) -> Key:
        """Multiples of rotations of a term: of the gear against its frame, and of the carrier."""
        body = self._wheel(mesh, end)[0]
        frame = self.assembly.elements[mesh].mesh.frame
        relative = self.frame.speeds.get(body, 0.0) - self.frame.speeds.get(frame, 0.0)
        multiples: dict[str, int] = {}
        if order:
            name = f"rotation of {body}"
            if planets is not None:
                family = self.assembly.gearbox.body(body).family
                name = f"rotation of {family} in {planets.carrier}"
                if abs(abs(relative) - abs(planets.ratio)) < SAME * abs(relative):
                    name = self._carrier(planets)
            self.orders.setdefault(name, abs(relative))
            multiples[name] = order * int(math.copysign(1.0, relative))
        if turn and planets is not None:
            name = self._carrier(planets)
            self.orders.setdefault(name, abs(planets.ratio))
            multiples[name] = multiples.get(name, 0) + turn * int(math.copysign(1.0, planets.ratio))
        return tuple(sorted((name, multiple) for name, multiple in multiples.items() if multiple))

    def _carrier(self, planets: PlanetSet) -> str:
        """Name of the rotation of a carrier: its own where its planets mesh out of phase."""
        out_of_phase = [name for name, _ in self.waves.carriers]
        return planets.carrier if planets.carrier in out_of_phase else f"rotation of {planets.carrier}"

    def _add(self, terms: dict[tuple[str, Key], Complexes], key: tuple[str, Key], value: Complexes) -> None:
        terms[key] = terms[key] + value if key in terms else value
