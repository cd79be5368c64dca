"""Excitations at the orders of shafts: pitch deviations and run-out of gears, and stated loads.

A deviation e of a gear is subtracted from the deflection d of its meshes, so that the force of a mesh is

    F = k (d - e) + c (d' - e'),

and -k e - c e' is a given force at the orders n of the shaft. The stiffness k varies with the mesh cycle, which brings
the sidebands h z +- n of the mesh orders h z of a gear with z teeth. The normal of a flank with deviations is not that
of the perfect one: by the work along e, the static force F_0 has the torque F_0 de/dphi on the gear, which is given,
too. The averaged system itself has no deviations. A stated load on a body, such as an unbalance, is given like this
one.

Meshes of planets are waves around the carrier (`exugear.steady.mean_system.mesh_waves`), so that a deviation of order n
against the carrier appears at n plus and minus multiples of the carrier's rotation. So does a load on one planet. A
flexible ring gear has more waves than planets; as many waves as planets give any deviation at these, and their forces
couple to all waves as those of deflections do. Where the carrier's rotation is a base of its own, as it is there, order
n = h z + r of a gear with z teeth is its part r beside the cycle h of the mesh, whose phase it keeps.
"""

from __future__ import annotations

import cmath
import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np

from exugear.steady.harmonics.lines import (
    SAME,
    LineSet,
    Rotation,
    Sidebands,
    TorusSampling,
    fourier_coefficients,
    largest,
)
from exugear.steady.mean_system.displaced_pins import displaced_carriers, pin_deflections, pin_places
from exugear.steady.mean_system.mesh_waves import MeshWaves
from exugear.steady.mean_system.planet_sets import PlanetSet
from exugear.steady.mean_system.standing_loads import reactions
from exugear.steady.mean_system.unequal_bearings import LEAST, UnequalBearings, unequal_bearings
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN
from exugear.system.kernels.meshes import FRAME
from exugear.system.kernels.turning import travelling_tangent
from exugear.system.kernels.varying_loads import VaryingLoadArrays, fill_sizes_and_phases, no_varying_loads
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers
from fe_ste.tools.bundles import cached_bundle

NEGLECTED = 1e-2
"""Share of the root mean square of a mesh component's deviations in orders that are left out."""
SAMPLES_PER_PIECE = 4
"""Samples of each cubic piece of a deviation for its Fourier coefficients; pieces are a fraction of a tooth."""
PASSING_SAMPLES = 64
"""Angles of the carrier over which the motion by passing planets has its mean."""
REACH = 4
"""Harmonics of each mesh frequency whose sidebands a stated load has at most."""
ABSENT = 1e-2
"""Share of the variation of a mesh stiffness up to which it counts as without a harmonic, which makes the sidebands."""
TURNS_BESIDE = 2
TURNS_BESIDE_ROWS = 4
"""Turns of the carrier beyond those of displaced pins at which mesh orders have sidebands, the latter where planets run
on rows of rolling elements, whose stiffness follows the unequal loads.

In the GRC with one displaced pin, sidebands are 2e-3 off those of a run with two of them, 1e-2 with one. On rows they
are 2e-3 off at a resonance with four of them, 1e-1 with two."""
FEW = 2
"""Largest number of orders of a rotation of which sums of three are kept apart, too: ten orders have hundreds."""


@dataclass(frozen=True, eq=False)
class ShaftOrders:
    """Deviations of gears and stated loads as Fourier series of the angles of rotations; without any, it is empty.

    Values hold where the input turns about +z; where it turns about -z, they are the conjugates.
    """

    rotations: tuple[Rotation, ...] = ()
    """Bases that follow those of meshes and of carriers whose planets mesh out of phase."""
    sidebands: tuple[Sidebands, ...] = ()
    """Lines that matter."""
    multiples: Integers = field(default_factory=lambda: np.zeros((0, 0), dtype=np.int64))
    """(t, b) multiples of all bases, those of the meshes first."""
    displacement: Complexes = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))
    """(t, m) deviations of the mesh components, m."""
    reaction: Complexes = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))
    """(t, size + 6 r) generalized forces in the rotating frame, by the static forces on deviations and of stated loads,
    these per size at a speed; behind them reactions on fixed bodies, as `reactions` has them."""
    shift: Complexes = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))
    """(t, size) places in the rotating frame of planets on displaced pins, from which their motion counts, m."""
    centrifugal: Complexes = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))
    """(t, size) forces of inertia there, N per square of the speed of the input in rad/s."""
    bearings: tuple[UnequalBearings, ...] = ()
    """Bearings that planets on displaced pins load unequally."""
    source: tuple[str, ...] = ()
    """(t,) name of the excitation that a term is of; empty for deviations."""
    loads: VaryingLoadArrays = field(default_factory=no_varying_loads)
    """Stated loads, for their sizes over the speed."""
    load: Integers = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """(t,) stated load of a term, -1 for deviations."""
    speeds: Floats = field(default_factory=lambda: np.zeros(0))
    """(l,) speed of the body of each stated load over that of the input."""
    angles: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    """(l, size) angle of that body by the static deflections, at zero angle of the input."""
    on_planet: Booleans = field(default_factory=lambda: np.zeros(0, dtype=bool))
    """(l,) whether that body is a planet."""
    error_pieces: Integers = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    """`MeshArrays.error_pieces` with the deviations, which runs in time have."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the rotations."""
        return tuple(rotation.name for rotation in self.rotations)

    @property
    def has_loads(self) -> bool:
        """Whether any of the terms is a stated load."""
        return bool((self.load >= 0).any())

    @property
    def has_forces(self) -> Booleans:
        """Whether a term (t,) has forces beside those of the deviations in the meshes."""
        return np.asarray(self.reaction.any(axis=1) | self.centrifugal.any(axis=1))

    @property
    def highest_load(self) -> float:
        """Highest order of a stated load over the rotation of the input; 0 without any."""
        return float(np.max(np.abs(self.speeds) * self.loads.order, initial=0.0))

    @property
    def products(self) -> tuple[Sidebands, ...]:
        """Sums and differences of two orders, which nonlinear forces add to these."""
        orders = {own.multiples for own in self.sidebands if own.base is None}
        both = itertools.product(orders, orders, (1, -1))
        sums = {tuple(a + sign * b for a, b in zip(one, other, strict=True)) for one, other, sign in both}
        return tuple(Sidebands(multiples) for multiples in sorted(sums) if any(multiples))

    @property
    def beside_sidebands(self) -> tuple[Sidebands, ...]:
        """Sidebands of twice as many harmonics, and sums of two of one mesh and rotation; of three where they are few.

        They arise in meshes whose positions move with the orders. They are small, but so are high mesh orders, for
        which samples in time would take them where both have the same values.
        """
        rotations = len(self.rotations)
        alike: dict[tuple[int, int | None, tuple[bool, ...]], set[tuple[int, ...]]] = {}
        for own in self.sidebands:
            if own.base is not None:
                turning = tuple(multiple != 0 for multiple in own.multiples[len(own.multiples) - rotations :])
                reach = None if own.reach is None else 2 * own.reach
                alike.setdefault((own.base, reach, turning), set()).add(own.multiples)
        found = []
        for (base, reach, _), some in alike.items():
            both = some | {tuple(-multiple for multiple in multiples) for multiples in some}
            sums = set(some)
            for count in (2, 3) if len(some) <= FEW else (2,):
                for terms in itertools.combinations_with_replacement(sorted(both), count):
                    sums.add(tuple(sum(multiples) for multiples in zip(*terms, strict=True)))
            found += [Sidebands(multiples, base, reach) for multiples in sorted(sums) if any(multiples)]
        return tuple(found)

    @property
    def without_load_sidebands(self) -> ShaftOrders:
        """The same without sidebands of stated loads, which are zero where no stiffness varies with the mesh cycle."""
        own = tuple(one for one in self.sidebands if one.base is None or one.reach is None)
        return replace(self, sidebands=own)

    def reaction_at(self, speed: float, static: Floats) -> Complexes:
        """Find forces and reactions (t, size + 6 r) at a speed of the input (rad/s), static deflections (size,)."""
        found = np.empty((len(self.speeds), 2))
        fill_sizes_and_phases(speed * self.speeds, cached_bundle(self.loads), found)
        # Deviations, whose number of a load is -1, have the factor behind those of all loads.
        angles = found[:, 1] + self.loads.order * (self.angles @ static) if len(found) else found[:, 1]
        factors = np.append(found[:, 0] * np.exp(1j * angles), 1.0)[self.load]
        found_forces = self.reaction * factors[:, None]
        found_forces[:, : self.centrifugal.shape[1]] += speed**2 * self.centrifugal
        return np.asarray(found_forces)

    def change_by_turning(self, sampling: TorusSampling, motion: Complexes, speed: float, static: Floats) -> Complexes:
        """Find how forces and reactions (lines, size + 6 r) change with the turning of the stated loads' bodies.

        An angle d that a vibration adds to that of a body multiplies a load of order n by exp(i n d). Loads on single
        planets are left as they are.

        Parameters
        ----------
        motion : (lines, size) about the static state, in the rotating frame
        speed : of the input, rad/s
        static : (size,) deflections
        """
        sense = math.copysign(1.0, speed)
        own = np.flatnonzero((self.load >= 0) & ~self.on_planet[self.load])
        loads = self.load[own]
        added = self.loads.order[loads] * sampling.values(motion @ self.angles.T)[:, loads]
        angles = sampling.angles @ self.multiples[own].T
        turned = np.exp(1j * (sense * angles + added)) - np.exp(1j * sense * angles)
        # Fewer terms than forces pass through the transform: 2 Re(t r) = 2 (Re t Re r - Im t Im r).
        real, imaginary = sampling.coefficients(turned.real), sampling.coefficients(turned.imag)
        reaction = self.reaction_at(speed, static)[own]
        return np.asarray(2.0 * (real @ reaction.real - imaginary @ reaction.imag))

    def places(self, lines: LineSet) -> Places:
        """Places of the terms among lines."""
        place, mirrored = lines.find(self.multiples)
        return Places(place, mirrored, (place == 0) & self.multiples.any(axis=1))


class Places(NamedTuple):
    """Places of terms among lines."""

    line: Integers
    mirrored: Booleans
    """(t,) line of a term, -1 for none, and whether the term counts as its conjugate there."""
    halved: Booleans
    """(t,) whether a term of opposite rotations stands still, so that it counts with its conjugate."""


def at_lines(values: Complexes, places: Places, lines: int, speed: float) -> Complexes:
    """Sum up terms (t, ...) at the places of a number of lines (lines, ...); for a negative speed their conjugates."""
    found = np.zeros((lines, *values.shape[1:]), dtype=complex)
    values = values if speed > 0.0 else values.conj()
    there = places.line >= 0
    turned = np.where(places.mirrored[:, None], values.conj(), values)
    turned = np.where(places.halved[:, None], 2.0 * turned.real, turned)
    np.add.at(found, places.line[there], turned[there])
    return found


def without_deviations(assembly: Assembly) -> Assembly:
    """Return an assembly whose gears have no deviations."""
    none = (np.zeros(0), np.zeros(0))
    elements = tuple(replace(element, errors=none) for element in assembly.elements)
    no_pieces = np.zeros_like(assembly.meshes.error_pieces)
    return replace(assembly, elements=elements, meshes=assembly.meshes._replace(error_pieces=no_pieces))


def any_shaft_orders(assembly: Assembly) -> bool:
    """Whether gears have deviations, or loads are stated over the angle of a body."""
    return bool(assembly.meshes.error_pieces.any() or assembly.gearbox.varying_loads or assembly.gearbox.pin_offsets)


PassingMotion: TypeAlias = Mapping[str, Callable[[float], Floats]]
"""Motion (size,) about the static state, in the rotating frame, that passing planets of each carrier cause at an angle
of the input, rad; the mean of all is in that of the first."""


def shaft_orders(assembly: Assembly, waves: MeshWaves, moved: PassingMotion | None = None) -> ShaftOrders:
    """Find the deviations of an assembly's gears and the stated loads, and the orders that matter.

    Parameters
    ----------
    assembly : with deviations
    waves : mesh components of its averaged system without deviations
    moved : motion that passing planets cause; by default none. Gears and loads are turned by its mean.
    """
    series = _Series(assembly, waves, moved)
    for meshes, planets in waves.groups:
        series.add_family(meshes, planets)
    displaced = displaced_carriers(assembly, waves.system.frame.sets)
    for planets in waves.system.frame.sets:
        if planets.carrier in displaced:
            series.add_pins(planets)
    for n in range(len(assembly.gearbox.varying_loads)):
        series.add_load(n)
    return series.found()


Key = tuple[tuple[str, int], ...]
"""Multiples of rotations by their names, without zeros."""
DEVIATION = -1
"""Number of deviations among the stated loads."""


class _Series:
    """Collects the terms of all families of meshes."""

    def __init__(self, assembly: Assembly, waves: MeshWaves, moved: PassingMotion | None) -> None:
        self.assembly = assembly
        self.moved = moved or {}
        self.waves = waves
        self.frame = waves.system.frame
        speed = float(waves.system.speeds[1])
        self.speed = speed
        self.still = self._state(0.0) + self._turned_by_passing
        self.cycles = [f"cycle of {name}" for name in waves.base_names]
        """Names of the bases of the meshes."""
        self.load = waves.mean_stiffness * (waves.values(assembly.meshes.deflection, speed) - waves.rest)
        self.orders = {name: modulator.order for name, modulator in waves.carriers}
        """Order of each rotation, by its name; those of carriers whose planets mesh out of phase come first."""
        self.displacement: dict[tuple[int, Key], Complexes] = {}
        self.reaction: dict[tuple[int, Key], Complexes] = {}
        self.shift: dict[tuple[int, Key], Complexes] = {}
        self.centrifugal: dict[tuple[int, Key], Complexes] = {}
        self.bearings: list[UnequalBearings] = []
        self.reactions = reactions(assembly)
        self.without_reactions = np.zeros(self.reactions.shape[1])
        self.beside: list[tuple[Key, int | None, int | None]] = []
        """Rotations, the base of the mesh beside whose harmonics they appear if any, and the highest of these."""

    def add_family(self, meshes: tuple[int, ...], planets: PlanetSet | None) -> None:
        """Add the deviations of all meshes of a family of planets, or of a single mesh."""
        waves = self.waves.waves
        own = [n for n, wave in enumerate(waves) if wave.first == meshes[0]]
        base = waves[own[0]].base
        sizes: dict[Key, float] = {}
        for place, mesh in enumerate(meshes):
            for end in range(2):
                orders = self._orders(mesh, end)
                if not orders:
                    continue
                own_mesh = self.assembly.elements[mesh].mesh
                body = (own_mesh.pinion, own_mesh.gear)[end]
                teeth = (own_mesh.pair.pinion, own_mesh.pair.gear)[end].teeth
                turning = self._turning(mesh, end, planets, place, len(own))
                for (order, value), (turn, shape, row) in itertools.product(orders, turning):
                    if order == 0 and turn < 0:
                        continue  # the conjugate of that which turns the other way
                    # Whole mesh cycles count as such. Orders beside one number of them are sidebands of one kind.
                    whole = round(order / teeth)
                    nearest = self._key(body, own_mesh.frame, planets, order - teeth * whole, turn)
                    whole *= int(math.copysign(1.0, self._relative(body, own_mesh.frame)))
                    key = tuple(sorted((*nearest, (self.cycles[base], whole)))) if whole else nearest
                    displaced = np.zeros(len(waves), dtype=complex)
                    displaced[own] = value * shape
                    pushed = 1j * order * value * self.load[own[0]] * row
                    if not key and (order or turn):  # at rest it counts with its conjugate
                        displaced, pushed = (2.0 * part.real.astype(complex) for part in (displaced, pushed))
                    self._add(self.displacement, (DEVIATION, key), displaced)
                    self._add(self.reaction, (DEVIATION, key), np.append(pushed, self.without_reactions))
                    sizes[nearest] = math.hypot(sizes.get(nearest, 0.0), float(np.linalg.norm(displaced)))
        sizes.pop((), None)
        if sizes:
            size = np.array(list(sizes.values()))
            kept = largest(size, NEGLECTED * float(np.linalg.norm(size))) & (size > 0.0)
            self.beside += [(key, base, None) for key, is_kept in zip(sizes, kept, strict=True) if is_kept]

    def add_pins(self, planets: PlanetSet) -> None:
        """Add what unequally displaced pins of a set give to the deflections of meshes, and centrifugal forces."""
        families = [meshes for meshes, group in self.waves.groups if group is planets]
        counts = [sum(wave.first == meshes[0] for wave in self.waves.waves) for meshes in families]
        most = max((self._most_turns(planets, count) for count in counts), default=0)
        displaced = np.zeros((most + 1, len(self.waves.waves)), dtype=complex)
        for meshes, count in zip(families, counts, strict=True):
            own = [n for n, wave in enumerate(self.waves.waves) if wave.first == meshes[0]]
            deflections = pin_deflections(self.assembly, self.frame.sets, meshes)
            _, shapes = self._shapes_over_turn(planets, count)
            turned = np.fft.fft(np.einsum("snw,n->sw", shapes, deflections), axis=0) / len(shapes)
            turns = self._most_turns(planets, count) + 1
            displaced[:turns, own] = -turned[:turns]
        shift, pushed = self._pin_motion(planets, most)
        no_reaction = np.zeros(self.assembly.size + len(self.without_reactions), dtype=complex)
        for turn in range(most + 1):
            key = self._turns(planets, turn)
            self._add(self.displacement, (DEVIATION, key), displaced[turn])
            self._add(self.reaction, (DEVIATION, key), no_reaction)
            self._add(self.shift, (DEVIATION, key), shift[turn])
            self._add(self.centrifugal, (DEVIATION, key), pushed[turn])
        if (unequal := unequal_bearings(self.assembly, self.waves.system, planets)) is not None:
            self.bearings.append(unequal)
        # Lateral vibration of central bodies and unequally stiff bearings pass on to lines at further turns.
        rows = np.diff(self.assembly.connectors.rolling.first)
        on_planets = [support.body in planets.names for support in self.assembly.supports]
        for turn in range(1, most + (TURNS_BESIDE_ROWS if rows[on_planets].any() else TURNS_BESIDE) + 1):
            key = self._turns(planets, turn)
            self.beside += [(key, None, None)] if turn <= most else []
            self.beside += [(key, base, reach) for base, reach in enumerate(self._reaches) if reach]

    def _pin_motion(self, planets: PlanetSet, most: int) -> tuple[Complexes, Complexes]:
        """Places that unequal pins give to planets (t, size) in the rotating frame, by multiples of the carrier's turn.

        The centrifugal forces there follow, N per square of the speed of the input in rad/s.
        """
        samples = 2 * most + 1
        still = np.zeros(self.assembly.size)
        shifts: list[Floats] = []
        forces: list[Floats] = []
        for angle in (2.0 * np.pi * np.arange(samples) / samples).tolist():
            psi = angle / planets.ratio
            q = self.frame.state(psi, 0.0, self.waves.system.static_at(self.speed))[0]
            place = pin_places(self.assembly, planets, angle)
            by_place = self.assembly.inertia_forces(q, still, place) - self.assembly.inertia_forces(q, still, still)
            frame = self.frame.matrices(psi)[0]
            shifts.append(np.asarray(np.linalg.solve(frame, place), dtype=np.float64))
            forces.append(planets.ratio**2 * by_place @ frame)
        of_shifts, of_forces = (np.fft.fft(np.array(values), axis=0) / samples for values in (shifts, forces))
        return of_shifts, of_forces

    def add_load(self, number: int) -> None:
        """Add a stated load, which varies with the angle of a body."""
        load = self.assembly.gearbox.varying_loads[number]
        if self.frame.speeds.get(load.body, 0.0) == 0.0:
            return
        arrays = self.assembly.varying_loads
        entries = slice(arrays.first[number], arrays.first[number + 1])
        wave = np.zeros(self.assembly.size, dtype=complex)
        wave[arrays.coordinate[entries]] = arrays.wave[entries] @ (0.5, 0.5j)
        wave = np.append(wave, 0.5 * self.reactions[number])
        wave *= cmath.rect(1.0, load.order * float(self._turned_by_passing[arrays.turning[number]]))
        for key, turned in self._in_frame(load.body, load.order, wave):
            self._add(self.displacement, (number, key), np.zeros(len(self.waves.waves), dtype=complex))
            self._add(self.reaction, (number, key), turned)
            self.beside.append((key, None, None))
            self.beside += [(key, base, reach) for base, reach in enumerate(self._reaches) if reach]

    @cached_property
    def _turned_by_passing(self) -> Floats:
        """Mean change of all coordinates by passing planets, behind them those of a flexible ring gear at planets."""
        found = np.zeros_like(self._state(0.0))
        for carrier in self.moved:
            ratio = next(planets.ratio for planets in self.frame.sets if planets.carrier == carrier)
            angles = (2.0 * math.pi / abs(ratio) * np.arange(PASSING_SAMPLES) / PASSING_SAMPLES).tolist()
            found += np.mean([self._state(psi, carrier) - self._state(psi) for psi in angles], axis=0)
        return found

    @cached_property
    def _reaches(self) -> list[int]:
        """Harmonics of each mesh frequency that have sidebands of stated loads: up to the highest of its stiffness."""
        waves = self.waves
        if LAWS[self.assembly.mesh_model].loses_contact:
            return [REACH] * len(waves.base_orders)
        found = [0] * len(waves.base_orders)
        sizes = np.abs(waves.cycle_coefficients("tangent", harmonics=2 * REACH))[:, 1:]
        for n, wave in enumerate(waves.waves):
            present = sizes[n, :REACH] > max(ABSENT * float(np.linalg.norm(sizes[n])), LEAST * waves.mean_stiffness[n])
            own = REACH if waves.moving[wave.first] else int(np.flatnonzero(present).max(initial=-1)) + 1
            found[wave.base] = max(found[wave.base], own)
        return found

    def _in_frame(self, body: str, order: float, wave: Complexes) -> list[tuple[Key, Complexes]]:
        """Multiples of rotations, and forces in the rotating frame and reactions (size + 6 r,), of a load on a body."""
        planets = next((planets for planets in self.frame.sets if body in planets.names), None)
        if planets is None:
            speed = self.frame.speeds[body]
            whole = order == int(order)
            carriers = [name for name, _ in self.waves.carriers]
            rotation = {body if body in carriers else f"rotation of {body}": (int(order), speed)} if whole else {}
            half = {f"half rotation of {body}": (int(2.0 * order), 0.5 * speed)} if not whole else {}
            return [(self._multiples(rotation | half), self._turned(0.0, wave))]
        # The waves around the carrier turn with it, and so do radius and tangent.
        most = planets.waves // 2 + 1
        samples = 2 * most + 1
        angles = 2.0 * np.pi * np.arange(samples) / samples
        turned = np.fft.fft([self._turned(angle / planets.ratio, wave) for angle in angles], axis=0) / samples
        least = LEAST * np.abs(turned).max()
        return [
            (self._key(body, planets.carrier, planets, int(order), int(order) + turn), turned[turn])
            for turn in range(-most, most + 1)
            if np.abs(turned[turn]).max() > least
        ]

    def _turned(self, psi: float, wave: Complexes) -> Complexes:
        """Return forces in the rotating frame at an angle of the input (rad), and reactions, (size + 6 r,)."""
        size = self.assembly.size
        return np.append(self.frame.matrices(psi)[0].T @ wave[:size], wave[size:])

    def found(self) -> ShaftOrders:
        """Return what was collected."""
        names = [*self.cycles, *self.orders]
        meshes = len(self.cycles)
        carriers = meshes + len(self.waves.carriers)

        def row(key: Key) -> tuple[int, ...]:
            multiples = dict(key)
            return tuple(multiples.get(name, 0) for name in names)

        if not self.displacement:
            return ShaftOrders()
        loads = self.assembly.gearbox.varying_loads
        none = np.zeros(self.assembly.size, dtype=complex)
        terms = list(self.displacement)
        return ShaftOrders(
            rotations=tuple(Rotation(name, self.orders[name]) for name in names[carriers:]),
            sidebands=tuple(Sidebands(row(key)[meshes:], base, reach) for key, base, reach in self.beside),
            multiples=np.array([row(key) for _, key in terms], dtype=np.int64),
            displacement=np.array(list(self.displacement.values())),
            reaction=np.array([self.reaction[term] for term in terms]),
            shift=np.array([self.shift.get(term, none) for term in terms]),
            centrifugal=np.array([self.centrifugal.get(term, none) for term in terms]),
            bearings=tuple(self.bearings),
            source=tuple("" if n == DEVIATION else loads[n].excitation for n, _ in terms),
            loads=self.assembly.varying_loads,
            load=np.array([n for n, _ in terms], dtype=np.int64),
            speeds=np.array([self.frame.speeds.get(load.body, 0.0) for load in loads]),
            angles=self.frame.matrices(0.0)[0][self.assembly.varying_loads.turning],
            on_planet=np.array([any(load.body in own.names for own in self.frame.sets) for load in loads], dtype=bool),
            error_pieces=self.assembly.meshes.error_pieces,
        )

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

    def _state(self, psi: float, carrier: str = "") -> Floats:
        """Return coordinates at an angle of the input (rad), behind them those of a flexible ring gear at planets.

        They are static, or as the passing planets of a carrier change them.
        """
        static = self.waves.system.static_at(self.speed)
        if carrier in self.moved:
            static = static + self.moved[carrier](psi)
        q = self.frame.state(psi, self.speed, static)[0]
        return self.assembly.with_travelling(q, np.zeros_like(q))[0]

    def _row(self, angles: list[tuple[int, float]], psi: float, carrier: str = "") -> Floats:
        """Row (size,) of a gear's angle, the sum of coordinates with signs, by those of the frame at an angle (rad)."""
        size = self.assembly.size
        turning = np.zeros(size)
        if any(at >= size for at, _ in angles):
            x = self._state(psi, carrier)
            still = np.zeros_like(x)
            seats = travelling_tangent(x, still, still, self.assembly.travelling).place
            turning = np.sum([sign * seats[at] for at, sign in angles], axis=0)
        else:
            for at, sign in angles:
                turning[at] += sign
        return np.asarray(turning @ self.frame.matrices(psi)[0])

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
            return [(0, np.ones(1), self._row(angles, 0.0).astype(complex))]
        turned, shapes = self._shapes_over_turn(planets, waves)
        rows = [self._row(angles, angle / planets.ratio, planets.carrier) for angle in turned.tolist()]
        of_shapes = np.fft.fft(shapes[:, place], axis=0) / len(turned)
        of_rows = np.fft.fft(rows, axis=0) / len(turned)
        most = self._most_turns(planets, waves)
        return [(turn, of_shapes[turn], of_rows[turn]) for turn in range(-most, most + 1)]

    def _most_turns(self, planets: PlanetSet, waves: int) -> int:
        """Find the highest multiple of the carrier's angle in the shapes of planets whose meshes have some waves."""
        return max(planets.waves, waves) // 2

    def _shapes_over_turn(self, planets: PlanetSet, waves: int) -> tuple[Floats, Floats]:
        """Angles (s,) of the carrier, rad, and the share in waves of the mesh of each planet there (s, n, waves)."""
        samples = 2 * (2 * self._most_turns(planets, waves) + 1)
        turned = 2.0 * np.pi * np.arange(samples) / samples
        # A flexible ring has more waves than planets: as many as planets give any deviation at these.
        values = planets.values(turned)[:, :, :waves]
        shapes = np.zeros((samples, planets.waves, waves))
        shapes[..., : values.shape[2]] = values / (values[0] ** 2).sum(axis=0)
        return turned, shapes

    def _relative(self, body: str, frame: str) -> float:
        """Spin of a body against its frame over the spin of the input."""
        return self.frame.speeds.get(body, 0.0) - self.frame.speeds.get(frame, 0.0)

    def _key(self, body: str, frame: str, planets: PlanetSet | None, order: int, turn: int) -> Key:
        """Multiples of rotations: of a body against its frame, and of the carrier of planets."""
        relative = self._relative(body, frame)
        rotations: dict[str, tuple[int, float]] = {}
        if order:
            name = f"rotation of {body}"
            if planets is not None:
                family = self.assembly.gearbox.body(body).family
                name = f"rotation of {family} in {planets.carrier}"
                if abs(abs(relative) - abs(planets.ratio)) < SAME * abs(relative):
                    name = self._carrier(planets)
            rotations[name] = order, relative
        if turn and planets is not None:
            name = self._carrier(planets)
            before = rotations.get(name, (0, planets.ratio))
            same = math.copysign(1.0, before[1] * planets.ratio)
            rotations[name] = turn + int(same) * before[0], planets.ratio
        return self._multiples(rotations)

    def _turns(self, planets: PlanetSet, turn: int) -> Key:
        """Multiple of the rotation of the carrier of planets."""
        return self._multiples({self._carrier(planets): (turn, planets.ratio)} if turn else {})

    def _multiples(self, rotations: Mapping[str, tuple[int, float]]) -> Key:
        """Multiples of rotations, given with the speed of each over that of the input; a new one becomes a base."""
        for name, (_, speed) in rotations.items():
            self.orders.setdefault(name, abs(speed))
        signed = {name: order * int(math.copysign(1.0, speed)) for name, (order, speed) in rotations.items()}
        return tuple(sorted((name, multiple) for name, multiple in signed.items() if multiple))

    def _carrier(self, planets: PlanetSet) -> str:
        """Name of the rotation of a carrier: its own where its planets mesh out of phase."""
        out_of_phase = [name for name, _ in self.waves.carriers]
        return planets.carrier if planets.carrier in out_of_phase else f"rotation of {planets.carrier}"

    def _add(self, terms: dict[tuple[int, Key], Complexes], key: tuple[int, Key], value: Complexes) -> None:
        terms[key] = terms[key] + value if key in terms else value
