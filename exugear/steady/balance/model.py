"""A gearbox prepared for harmonic balance: its orders, and at any speed what meshes and bearings read and push along.

Rows and matrices are known at three speeds of the averaged system; parabolas through these are exact between them.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import fields, replace
from functools import cached_property

import numpy as np

from exugear.results.sound.radiated_power import RadiatedPower, radiated_power
from exugear.steady.balance.acting_forces import acting_forces
from exugear.steady.balance.harmonic_truncation import HarmonicTruncation
from exugear.steady.balance.interface import Interface, LoadResponse
from exugear.steady.balance.mesh_cycles import MeshCycles
from exugear.steady.harmonics.linear_solvers import Batches, batches_of
from exugear.steady.harmonics.lines import (
    Group,
    HarmonicCoupling,
    LineSet,
    Sidebands,
    TorusSampling,
    beside,
    joined,
    line_set,
    modulated,
    rank1_lattice,
    with_rotations,
)
from exugear.steady.mean_system.bearing_waves import (
    TILTS,
    BearingMean,
    BearingWaves,
    bearing_waves,
    places_with_bearings,
    ports_with_bearings,
)
from exugear.steady.mean_system.mean_system import MeanSystem
from exugear.steady.mean_system.mesh_places import (
    BACK_TILT,
    DEFLECTION,
    MISALIGNMENT,
    POSITION,
    TILT,
    Family,
    MeshInterface,
    MeshPlaces,
    families,
    group_of,
    mesh_places,
    mesh_ports,
)
from exugear.steady.mean_system.mesh_waves import MeshWaves, mesh_waves
from exugear.steady.mean_system.shaft_orders import Places, ShaftOrders, at_lines
from exugear.steady.mean_system.signals import (
    AXES,
    SUPPORT_MOMENT,
    SURFACE_VELOCITY,
    Quantity,
    SignalName,
    SignalRows,
    mesh_signal_names,
    mount_names,
    quantities_of,
    signal_rows,
)
from exugear.steady.mean_system.standing_loads import gear_load_rows, moment_supports, reacting_excitations
from exugear.steady.mean_system.tooth_friction import friction_parts, tooth_friction
from exugear.steady.mean_system.unequal_bearings import UnequalBearings, varying_bearings
from exugear.system.kernels.coordinates import BODY_SIZE
from exugear.system.kernels.coordinates import TILT as AXIS_TILT
from exugear.system.kernels.meshes import SPIN_1
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers

SAMPLES_PER_HARMONIC = 16
"""Minimum samples per mesh period over the harmonics, with contact loss: kinks need more than products of orders."""
KEPT_APART = 6
"""Multiples of the planet passing frequency beside products of two orders that samples keep apart from the orders."""
STARTING_NEIGHBOURS = 1
"""Multiples of the planet passing frequency beside each order with which states with contact loss begin."""
SHAFT_NEIGHBOURS = 3
"""Multiples of the planet passing frequency by which orders of shafts are coupled to others, where stiffness varies.

Half as many as of the meshes' orders: there are many of them. In the planetary stage of the GRC they change by 1e-6 at
most with twice as many."""


class HarmonicBalanceModel:
    """A gearbox ready for the balance of lines at any speed within a range.

    Parameters
    ----------
    harmonics : of each mesh frequency. The mesh stiffness has twice as many.
    combinations : largest sum of multiples of several mesh frequencies
    orders : orders of shafts, by deviations of gears and stated loads

    Notes
    -----
    All bearings are linear about the static state, but for those that `with_bearings` adds: waves of these follow those
    of the meshes in all arrays.
    """

    def __init__(self, waves: MeshWaves, harmonics: int, combinations: int, orders: ShaftOrders | None = None) -> None:
        self.waves, self.harmonics = waves, 2 * harmonics
        self.shaft_orders = orders or ShaftOrders()
        # Lines of the larger set are kept apart where forces are evaluated in time.
        self._usual = self._reach = HarmonicTruncation(2 * harmonics, 2 * combinations)
        self.loses_contact = LAWS[waves.assembly.mesh_model].loses_contact
        # With contact loss, each state takes in those of the larger set that it needs.
        few = STARTING_NEIGHBOURS if self.loses_contact else None
        self.lines = self._lines_within(HarmonicTruncation(harmonics, combinations), neighbours=few)
        self._larger: LineSet | None = None
        self._least = 0
        # Shared by all that differ in their lines alone.
        self._lattices: dict[tuple[HarmonicTruncation, int, int, int], TorusSampling] = {}
        self._one_by_one: dict[int, HarmonicBalanceModel] = {}
        self._varying_bearings: list[tuple[UnequalBearings, ...]] = []
        self.bearings: BearingWaves | None = None
        self._bearing_means: tuple[BearingMean, ...] = ()
        ports = []
        rows = []
        for speed in waves.system.speeds:
            ports.append(mesh_ports(waves, float(speed), self.loses_contact))
            rows.append(signal_rows(waves.system, float(speed)))
        self._ports = _stacked(ports)
        self._rows = {
            name: np.array([getattr(row, name) for row in rows]) for name in ("by_place", "by_rate", "by_acceleration")
        }
        self._row_names = rows[0].names
        self.gear_load_rows = gear_load_rows(waves)
        self.signal_names: tuple[SignalName, ...] = (*self._row_names, *mesh_signal_names(waves))
        if self.radiated is not None:
            self.signal_names += (SURFACE_VELOCITY,)

    @property
    def larger(self) -> LineSet:
        """Lines that samples keep apart where forces are evaluated in time: products of two lines among them."""
        if self._larger is None:
            apart = min(self.waves.neighbours, KEPT_APART)
            own = self._lines_within(self._reach, self.shaft_orders.products, neighbours=apart)
            # Neighbours farther off are few, and only those that a state has.
            self._larger = joined(own, self.lines) if self.waves.neighbours > KEPT_APART else own
        return self._larger

    @property
    def shuttles(self) -> bool:
        """Whether any mesh with a model along a row reads its misalignment: see `MeshWaves.moving`."""
        return bool(self.waves.moving.any()) and not self.loses_contact

    @property
    def is_nonlinear(self) -> bool:
        """Whether forces are not parabolas of the inputs of the models: teeth or rolling elements may lose contact."""
        return self.loses_contact or self.bearings is not None

    @cached_property
    def with_bearings(self) -> HarmonicBalanceModel:
        """The same with the laws of bearings that have rows of rolling elements; itself where none has."""
        other = self._copied()
        bearings = bearing_waves(self.waves)
        if bearings is None:
            return self
        ports = []
        speeds = self.system.speeds
        other.bearings = bearings
        other._bearing_means = tuple(bearings.at(float(speed)) for speed in speeds)
        for speed, mean in zip(speeds, other._bearing_means, strict=True):
            ports.append(ports_with_bearings(self.ports_at(float(speed)), mean))
        other._ports = _stacked(ports)
        return other

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """Quantities that describe the response, made of its signals."""
        return quantities_of([name.name for name in self.signal_names], mount_names(self.waves.assembly))

    @cached_property
    def radiated(self) -> RadiatedPower | None:
        """Sound power by the motion in the rotating frame; None without an elastic housing."""
        frame = self.system.frame
        found = radiated_power(frame.assembly)
        return None if found is None else found.in_frame(frame.matrices(0.0)[0])

    @cached_property
    def weights(self) -> Floats:
        """What a unit of each wave's force counts in generalized forces, (m,)."""
        bearings = np.zeros(0) if self.bearings is None else self.bearings.weights
        return np.append(self.waves.weights, bearings)

    @cached_property
    def partners(self) -> Floats:
        """What laws see of the rates of other waves, (m, m): `MeshWaves.partners`; rows of bearings have it in them."""
        found = np.zeros((len(self.weights),) * 2)
        found[: len(self.waves.waves), : len(self.waves.waves)] = self.waves.partners
        return found

    @property
    def bearing_names(self) -> tuple[str, ...]:
        """Bearings whose laws are evaluated in time, planets' by their family, in the order of the laws."""
        return () if self.bearings is None else self.bearings.names

    @cached_property
    def bearing_signals(self) -> Integers:
        """Places (b, 3) of the forces of non-linear bearings among the signals."""
        if self.bearings is None:
            return np.zeros((0, len(AXES)), dtype=np.int64)
        return self.support_forces(np.array([wave.connectors[wave.wave] for wave in self.bearings.waves]))

    def support_forces(self, supports: Integers) -> Integers:
        """Places (s, 3) of the forces of supports (s,), by their numbers, among the signals."""
        first = [signal_name.quantity for signal_name in self.signal_names].index("support_force")
        return np.asarray(first + len(AXES) * supports[:, None] + np.arange(len(AXES)))

    @cached_property
    def bearing_moments(self) -> tuple[Integers, Integers]:
        """Non-linear bearings (k,) on what stands still, and places (k, 2) of their moments among the signals."""
        standing = moment_supports(self.waves.assembly).tolist()
        waves = () if self.bearings is None else self.bearings.waves
        supports = [(n, wave.connectors[wave.wave]) for n, wave in enumerate(waves)]
        if not (found := [(n, standing.index(support)) for n, support in supports if support in standing]):
            return np.zeros(0, dtype=np.int64), np.zeros((0, 2), dtype=np.int64)
        bearings, places = np.array(found, dtype=np.int64).T
        first = [signal_name.quantity for signal_name in self.signal_names].index(SUPPORT_MOMENT)
        return bearings, np.asarray(first + len(AXES) * places[:, None] + np.arange(2))

    @cached_property
    def reacting_excitations(self) -> tuple[str, ...]:
        """Excitations with reactions on fixed bodies; r of them."""
        return reacting_excitations(self.waves.assembly.gearbox)

    @cached_property
    def _misalignments(self) -> Floats:
        rows = self.waves.assembly.meshes.table.misalignment
        return np.array([self.waves.gradients(rows, float(speed)) for speed in self.system.speeds])

    def misalignments_at(self, speed: float) -> Floats:
        """Rows (m, size) of the misalignments of the meshes' waves at a speed of the input, rad/s."""
        return np.asarray(self.system.at(self._misalignments, speed))

    def places(self, speed: float, positions: Floats, angles: Floats) -> MeshPlaces:
        """Places where laws are evaluated, as `mesh_places` has them; those of bearings follow."""
        found = mesh_places(self.waves, speed, positions, angles)
        if self.bearings is None:
            return found
        return places_with_bearings(found, self.bearings, len(self.waves.base_orders), speed, angles)

    @cached_property
    def sampling(self) -> TorusSampling:
        """Samples on which forces are evaluated in time."""
        least = max(self._least, SAMPLES_PER_HARMONIC * self._reach.harmonics if self.is_nonlinear else 0)
        key = self._reach, least, self.waves.passing, len(self.larger.index)
        known = self._lattices.get(key)
        if self.waves.passing:
            known = rank1_lattice(self.lines, self.larger, least, shared=True)
        elif known is None and self.shaft_orders.sidebands and not self.loses_contact:
            reach = HarmonicTruncation(self._reach.harmonics, 1)
            others = self._lines_within(reach, self.shaft_orders.beside_sidebands, neighbours=0)
            known = rank1_lattice(self.lines, joined(self.larger, others), least, shared=True)
        elif known is None:
            known = rank1_lattice(self.larger, self.larger, least)
        self._lattices[key] = known
        return TorusSampling(self.lines, known.generator, known.samples)

    @cached_property
    def denser(self) -> HarmonicBalanceModel:
        """The same on twice as many samples, on which other lines alias."""
        other = self._copied()
        other._least = 2 * self.sampling.samples
        return other

    @cached_property
    def whole(self) -> HarmonicBalanceModel:
        """The same with all lines of the larger set, on the same samples."""
        other = self._copied()
        other.lines = self.larger
        return other

    def with_lines(self, lines: LineSet, clear: bool) -> HarmonicBalanceModel:
        """Copy with other lines, and a larger set that has them; `clear` as `HarmonicTruncation.around` has it."""
        other = self._copied()
        reach = self._usual.around(lines, len(self.waves.base_orders), clear)
        other.lines = lines
        if not clear:
            other._least = 0
        if reach != self._reach:
            other._reach, other._larger, other._least = reach, None, 0
        return other

    def with_system(self, system: MeanSystem) -> HarmonicBalanceModel:
        """Copy with another averaged system of the same coordinates, such as one with another damping."""
        other = self._copied()
        other.waves = replace(self.waves, system=system)
        other._varying_bearings = []
        return other

    @cached_property
    def frozen(self) -> HarmonicBalanceModel:
        """The same with the carriers held at zero angle where their angle varies the stiffness; else itself.

        Its modes are those of the gearbox: springs at all places of a ring raise those of the averaged system.
        """
        system = self.system.frozen
        return self if system is self.system else self.with_system(system)

    def of(self, which: Booleans) -> HarmonicBalanceModel:
        """Copy with some of its orders, selected by a mask (n,)."""
        other = self._copied()
        other.lines = self.lines.part(which)
        if self.waves.neighbours:
            other._larger = None
        return other

    def _lines_within(
        self, reach: HarmonicTruncation, more: tuple[Sidebands, ...] = (), neighbours: int | None = None
    ) -> LineSet:
        """Orders up to a limit, with the sidebands of planets that mesh out of phase, and the orders of shafts.

        `more` are further sums of the latter. `neighbours` is the number of orders that varying stiffness adds on
        either side of each; by default that of the waves.
        """
        waves = self.waves
        lines = line_set(waves.base_orders.tolist(), reach.harmonics, reach.combinations)
        modulators = [planets for _, planets in waves.carriers]
        slow = self.shaft_orders
        sidebands = slow.sidebands + more
        meshes = len(waves.base_orders)
        if not self.varying:
            lines = beside(lines, modulators, 0) if waves.passing else modulated(lines, modulators)
            return with_rotations(lines, slow.rotations, sidebands, meshes, reach.harmonics)
        most = waves.neighbours if neighbours is None else neighbours
        lines = modulated(lines, modulators, most)
        most = min(most, SHAFT_NEIGHBOURS)
        return with_rotations(lines, slow.rotations, sidebands, meshes, reach.harmonics, modulators, most)

    @cached_property
    def beside_others(self) -> Booleans:
        """Lines (n,) that are there because the carrier's angle couples others to them: passing planets, sidebands."""
        reach = HarmonicTruncation(self._usual.harmonics // 2, self._usual.combinations // 2)
        places = self.lines.find(self._lines_within(reach, neighbours=0).index)[0]
        found = np.ones(len(self.lines.index), dtype=bool)
        found[places[places >= 0]] = False
        return found

    @cached_property
    def without_shaft_orders(self) -> HarmonicBalanceModel:
        """The same gearbox with gears that have no deviations; itself if they have none."""
        if not self.shaft_orders.sidebands:
            return self
        return HarmonicBalanceModel(self.waves, self.usual_harmonics, self._usual.combinations // 2)

    @property
    def usual_harmonics(self) -> int:
        """Harmonics of each mesh frequency among its usual lines."""
        return self._usual.harmonics // 2

    def with_more(self, factor: float) -> HarmonicBalanceModel:
        """Copy with a factor times the usual harmonics of each mesh frequency and combinations of several."""
        other = self._copied()
        harmonics = math.ceil(factor * self.usual_harmonics)
        combinations = math.ceil(factor * (self._usual.combinations // 2))
        other.harmonics, other._least, other._larger = 2 * harmonics, 0, None
        other._usual = other._reach = HarmonicTruncation(2 * harmonics, 2 * combinations)
        # Neighbours of known lines are known to be needed; those of others are not looked for.
        more = other._lines_within(HarmonicTruncation(harmonics, combinations), neighbours=0)
        other.lines = joined(self.lines, more) if self.waves.neighbours else more
        return other

    @cached_property
    def finer(self) -> HarmonicBalanceModel:
        """The same with twice the usual harmonics of each mesh frequency, and the usual combinations of several."""
        other = self._copied()
        usual = self._usual
        other.lines = self._lines_within(HarmonicTruncation(usual.harmonics, usual.combinations // 2))
        other._reach, other._larger = HarmonicTruncation(2 * usual.harmonics, usual.combinations), None
        return other

    def _copied(self) -> HarmonicBalanceModel:
        """Copy without what was derived from lines and ports."""
        other = copy.copy(self)
        for name, value in vars(type(self)).items():
            if isinstance(value, cached_property):
                other.__dict__.pop(name, None)
        return other

    def passing(self, strong: Booleans) -> HarmonicBalanceModel | None:
        """Return a copy with one more multiple of the planet passing as sidebands of strong orders, by a mask (n,).

        Planets tilt unequally under load, and table models include this: each passing planet then modulates all orders,
        which adds sidebands. None if planets are not modelled individually, as under stated loads.
        """
        waves = self.waves
        usual = self._usual
        if not self.loses_contact or self.bearings is not None or self.shaft_orders.sidebands:
            return None
        if (waves.carriers and not waves.passing) or not any(wave.wave for wave in waves.waves):
            return None
        more = waves.passing + 1
        bases = len(waves.base_orders)
        if more not in self._one_by_one:
            travelling = mesh_waves(self.system, more)
            self._one_by_one[more] = HarmonicBalanceModel(travelling, usual.harmonics // 2, usual.combinations // 2)
        other = self._one_by_one[more]._copied()
        slow = [planets for _, planets in other.waves.carriers]
        other._one_by_one, other._lattices, other._reach = self._one_by_one, self._lattices, self._reach
        loud = self.lines.part(strong).select_bases(bases)
        whole = self.larger.select_bases(bases)
        known = self.lines if waves.passing else beside(self.lines, slow, 0)
        other.lines = joined(known, beside(loud, slow, more))
        # Of products that lie farther off in both senses little is left.
        other._larger = joined(joined(beside(whole, slow, 1), beside(loud, slow, more + 1)), other.lines)
        return other

    def places_in(self, other: HarmonicBalanceModel) -> tuple[Integers, ...]:
        """Places of the lines (n,) among those of another, which has them all; those of waves follow if it has more."""
        index = self.lines.index
        more = np.zeros((len(index), other.lines.index.shape[1] - index.shape[1]), dtype=index.dtype)
        lines = other.lines.find(np.hstack([index, more]))[0]
        names = [wave.name for wave in other.waves.waves]
        if len(names) == len(self.waves.waves):
            return (lines,)
        return lines[:, None], np.array([names.index(wave.name) for wave in self.waves.waves])

    @property
    def base_names(self) -> tuple[str, ...]:
        """Names of all bases: meshes, carriers of planets out of phase, rotations of gears with deviations."""
        return (*self.waves.base_names, *(name for name, _ in self.waves.carriers), *self.shaft_orders.names)

    @property
    def system(self) -> MeanSystem:
        """The averaged system."""
        return self.waves.system

    @property
    def assembly_in_time(self) -> Assembly:
        """The assembly of the averaged system for runs in time, in which gears have their deviations."""
        assembly = self.system.frame.assembly
        if not self.shaft_orders.error_pieces.any():
            return assembly
        return replace(assembly, meshes=assembly.meshes._replace(error_pieces=self.shaft_orders.error_pieces))

    @cached_property
    def cycles(self) -> MeshCycles:
        """What forces along a row have over the mesh cycles."""
        forces = self._ports["forces"].shape[2]
        return MeshCycles(self.waves, self.families, self.harmonics, forces, self.shuttles)

    def pressed(self, static: Floats) -> Floats:
        """Deflections (m,) from where the mean stiffness has no force, at readings (m, r) of the static state, m."""
        return np.asarray(static[: len(self.waves.waves), DEFLECTION] - self.waves.rest)

    @cached_property
    def families(self) -> tuple[Family, ...]:
        """Families of all mesh components, in their order."""
        return families(self.waves)

    @property
    def varying(self) -> tuple[Family, ...]:
        """Families with more waves than planets: see `MeshWaves.varying_carriers`."""
        return tuple(own for own in self.families if own.planets is not None and own.count > own.planets.waves)

    @cached_property
    def varying_waves(self) -> Booleans:
        """Components (m,) of these families, among those of the meshes."""
        found = np.zeros(len(self.waves.waves), dtype=bool)
        for family in self.varying:
            found[family.waves] = True
        return found

    @property
    def varying_bearings(self) -> tuple[UnequalBearings, ...]:
        """What bearings of planets that are not alike have beyond the averaged system, by carrier."""
        if not self._varying_bearings:
            found = [varying_bearings(self.system, carrier) for carrier in self.waves.varying_carriers]
            self._varying_bearings.append(tuple(own for own in found if own is not None))
        return self._varying_bearings[0]

    @cached_property
    def loaded_bearings(self) -> tuple[UnequalBearings, ...]:
        """What bearings of planets that displaced pins load unequally have beyond the averaged system, by carrier."""
        return tuple(own.with_dampers(self.system.damper_factor) for own in self.shaft_orders.bearings)

    @cached_property
    def unequal_bearings(self) -> tuple[UnequalBearings, ...]:
        """All bearings that differ from planet to planet: `loaded_bearings`, then `varying_bearings`."""
        return *self.loaded_bearings, *self.varying_bearings

    @cached_property
    def bearing_coordinates(self) -> Integers:
        """Coordinates (c,) that these bearings connect, those of one carrier after the other."""
        return np.concatenate([np.zeros(0, dtype=np.int64), *(own.coordinates for own in self.unequal_bearings)])

    @cached_property
    def _along_bearings(self) -> Floats:
        """Generalized forces (size, c) of a unit along each coordinate of these bearings."""
        return np.eye(self.system.size)[:, self.bearing_coordinates]

    def still_bearings(self, speed: float) -> Complexes:
        """Find forces (n, c) of these bearings in the static state beyond the averaged system, at a speed, rad/s."""
        none = np.zeros((len(self.lines.index), 0), dtype=complex)
        found = [own.still_at(self.lines, self.base_names.index(own.carrier), speed) for own in self.unequal_bearings]
        return np.hstack([none, *found])

    def bearing_coupling(self, bearings: Sequence[UnequalBearings]) -> HarmonicCoupling:
        """Products of coordinates of bearings, one after the other, with functions of their carriers' angles."""
        return HarmonicCoupling(self.lines, self._groups_of(bearings, 0))

    def _groups_of(self, bearings: Sequence[UnequalBearings], begin: int) -> tuple[Group, ...]:
        groups = []
        for own in bearings:
            carrier = self.base_names.index(own.carrier)
            multiples = turns_of_carrier(own.most, carrier, self.lines.index.shape[1])
            groups.append(Group(begin, len(own.coordinates), multiples))
            begin += len(own.coordinates)
        return tuple(groups)

    @cached_property
    def coupling(self) -> HarmonicCoupling:
        """Products of all forces along a row with functions of the mesh cycles."""
        forces = self._ports["forces"].shape[2]
        bases = self.lines.index.shape[1]
        return HarmonicCoupling(
            self.lines, tuple(group_of(family, self.harmonics, forces, bases) for family in self.families)
        )

    @cached_property
    def slow_shifts(self) -> tuple[Integers, tuple[Integers, ...], HarmonicCoupling]:
        """Find what moves the positions in the mesh cycles slowly, and products of the meshes' signals with it.

        Returns
        -------
        lines : (q,) of the orders of shafts and of passing planets alone
        places : (2 q, t) by family: harmonic of each of these lines, and of its conjugate, at the turns of products
        products : of the signals of each family, as many as waves
        """
        meshes = len(self.waves.base_orders)
        slow = ~self.lines.index[:, :meshes].any(axis=1) & self.lines.index[:, meshes:].any(axis=1)
        lines = np.flatnonzero(slow)
        multiples = self.lines.index[lines]
        multiples = np.concatenate([multiples, -multiples])
        places = []
        groups = []
        for family in self.families:
            turned = np.repeat(multiples[:, None], len(family.turns_of_products), axis=1)
            if family.carrier >= 0:
                turned[..., family.carrier] += family.turns_of_products
            harmonics, place = np.unique(turned.reshape(-1, turned.shape[-1]), axis=0, return_inverse=True)
            places.append(place.reshape(turned.shape[:2]))
            groups.append(Group(family.first, family.count, harmonics))
        return lines, tuple(places), HarmonicCoupling(self.lines, tuple(groups))

    @cached_property
    def whole_coupling(self) -> HarmonicCoupling:
        """`coupling`, and behind it that of the coordinates of `unequal_bearings`."""
        if not self.unequal_bearings:
            return self.coupling
        begin = len(self.weights) * self._ports["forces"].shape[2]
        return HarmonicCoupling(self.lines, (*self.coupling.groups, *self._groups_of(self.unequal_bearings, begin)))

    @cached_property
    def bearing_lengths(self) -> Floats:
        """What coordinates (c,) of unequal bearings count as a length, m: tilts by the largest base pitch."""
        if not self.unequal_bearings:
            return np.zeros(0)
        coordinates = self.waves.assembly.coordinates.values()
        tilts = np.concatenate([index[AXIS_TILT : AXIS_TILT + 2] for index in coordinates])
        is_tilt = np.isin(self.bearing_coordinates, tilts)
        return np.where(is_tilt, float(self.lengths[:, POSITION].max()), 1.0)

    @cached_property
    def lengths(self) -> Floats:
        """What a reading (m, r) counts as a length, m: metres as they are, cycles and angles by the base pitch.

        Tilts of bearings count by half of their pitch diameter.
        """
        meshes = self.waves.assembly.meshes
        firsts = [wave.first for wave in self.waves.waves]
        pitch = np.abs(meshes.deflection[firsts, SPIN_1] / meshes.cycles[firsts])
        found = np.ones(self._ports["static"].shape[1:])
        count = len(firsts)
        found[:count, POSITION] = pitch
        if self.shuttles:
            found[:count, MISALIGNMENT] = pitch
        if self.loses_contact:
            found[:count, [TILT, BACK_TILT]] = pitch[:, None]
        if self.bearings is not None:
            found[count:, TILTS] = self.bearings.radii[:, None]
        return found

    def forward(self, speed: float) -> Booleans:
        """Return which components' meshes (m,) run forward through their cycles at a speed of the input."""
        return np.array([wave.sense for wave in self.waves.waves]) * math.copysign(1.0, speed) > 0.0

    def ports_at(self, speed: float) -> MeshInterface:
        """Find what the meshes read and push along at a speed of the input, rad/s."""
        return MeshInterface(**{name: self.system.at(values, speed) for name, values in self._ports.items()})

    def loads(self, ports: MeshInterface) -> Floats:
        """Generalized forces (size, m f) of a unit of each force, in the frame."""
        weighted = ports.forces * self.weights[:, None, None]
        return np.asarray(weighted.reshape(-1, weighted.shape[2]).T)

    def at(self, speed: float) -> Interface:
        """Everything at one speed of the input (rad/s), which is not zero."""
        system = self.system
        ports = self.ports_at(speed)
        frequencies = abs(speed) * self.lines.orders
        loads = self.loads(ports)
        pencil = system.stiffness_at(speed), system.damping_at(speed)
        stated = self._shaft_loads(speed)
        other = self._with_friction(stated, speed)
        of_meshes = loads.shape[1]
        loads = np.hstack([loads, self._along_bearings])
        still = system.still(pencil[0], np.column_stack([loads, other[0].real]))
        motion = np.zeros((len(frequencies), *loads.shape), dtype=complex)
        motion[0] = still[:-1, :-1]
        answer = other.copy()
        answer[0] = still[:-1, -1]
        system.fill_responses(pencil, frequencies[1:], loads, answer[1:], self._batches, motion[1:])
        has_loads = bool(self._friction.size or self.shaft_orders.sidebands)
        shape = ports.forces.shape[:2]
        rows = {name: system.at(values, speed) for name, values in self._rows.items()}
        bearings = None
        if self.bearings is not None:
            bearings = BearingMean(*(system.at(np.array(own), speed) for own in zip(*self._bearing_means, strict=True)))
        return Interface(
            speed=speed,
            frequencies=frequencies,
            motion=motion[..., :of_meshes].reshape(*motion.shape[:2], *shape),
            ports=ports,
            rows=SignalRows(self._row_names, **rows),
            torque=system.torque_at(speed),
            torque_per_force=still[-1, :of_meshes].reshape(shape),
            along_bearings=motion[..., of_meshes:],
            torque_along_bearings=still[-1, of_meshes:-1],
            bearings=bearings,
            loads=LoadResponse(other, answer, float(still[-1, -1]), stated[:, system.size :]) if has_loads else None,
        )

    @cached_property
    def _batches(self) -> Batches:
        """Lines but the mean with the forces that may act there: all of them, or those of `acting_forces`."""
        moving = self._ports["forces"].any(axis=(0, -1)).ravel()  # laws with fewer forces have none in their places
        acting = np.ones((len(self.lines.index), len(moving)), dtype=bool)
        if moving.size and not self.is_nonlinear and not self.varying:
            acting = acting_forces(self.coupling, self.slow_shifts[2], self._displacements)
        stated = np.full(len(acting), bool(self._friction.size))
        if self.shaft_orders.sidebands:
            places = self._shaft_places.line[self.shaft_orders.has_forces]
            stated[places[places >= 0]] = True
        of_bearings = np.ones((len(acting), self._along_bearings.shape[1]), dtype=bool)
        return batches_of(np.hstack([acting & moving, of_bearings])[1:], stated[1:])

    @cached_property
    def _friction(self) -> Complexes:
        """Generalized forces (3, n, size) of the friction of teeth at the three speeds; empty without it."""
        if self.waves.assembly.gearbox.case.damping.tooth_friction == 0.0:
            return np.zeros((0, 0, 0), dtype=complex)
        speeds = map(float, self.system.speeds)
        return np.array([tooth_friction(self.waves, self.lines, self.ports_at(s), s, self.harmonics) for s in speeds])

    @cached_property
    def _friction_on_gears(self) -> Complexes:
        """Loads (3, n, 6 gears) on gears that stand still by the friction of teeth at the three speeds."""
        rows = self.gear_load_rows[-1]
        speeds = map(float, self.system.speeds)
        parts = [friction_parts(self.waves, self.lines, self.ports_at(s), s, self.harmonics) for s in speeds]
        return np.array([np.tensordot(own, rows, axes=2) for own in parts])

    def friction_on_gears(self, speed: float) -> Complexes | float:
        """Find loads (n, 6 gears) of the friction of teeth on standing gears at a speed (rad/s); 0 without any."""
        if not (self._friction.size and self.gear_load_rows[-1].size):
            return 0.0
        return np.asarray(self.system.at(self._friction_on_gears, speed))

    @cached_property
    def _shaft_places(self) -> Places:
        """Places of the terms of the orders of shafts among the lines."""
        return self.shaft_orders.places(self.lines)

    def shaft_loads(self, speed: float, source: str | None = None) -> Complexes:
        """Generalized forces (n, size) of deviations and stated loads at the lines, or those of one excitation."""
        return self._shaft_loads(speed, source)[:, : self.system.size]

    def _shaft_loads(self, speed: float, source: str | None = None) -> Complexes:
        """Return the same with the reactions on fixed bodies behind them (n, size + 6 r)."""
        orders = self.shaft_orders
        if not orders.sidebands:
            size = self.system.size + BODY_SIZE * len(self.reacting_excitations)
            return np.zeros((len(self.lines.index), size), dtype=complex)
        counted = np.array([source in (None, name) for name in orders.source])
        reaction = orders.reaction_at(speed, self.system.static_at(speed)) * counted[:, None]
        return at_lines(reaction, self._shaft_places, len(self.lines.index), speed)

    @cached_property
    def _displacements(self) -> Complexes:
        """Deviations (n, m) of gears at the lines where the input turns about +z, m."""
        lines = len(self.lines.index)
        if not self.shaft_orders.sidebands:
            return np.zeros((lines, len(self.waves.waves)), dtype=complex)
        return at_lines(self.shaft_orders.displacement, self._shaft_places, lines, 1.0)

    def deviations(self, speed: float) -> Complexes:
        """Deviations (n, m) of gears in the meshes at the lines, at a speed of the input (rad/s), m."""
        return self._displacements if speed > 0.0 else self._displacements.conj()

    def pin_places(self, speed: float) -> Complexes:
        """Places (n, size) of planets on displaced pins at the lines, in the rotating frame, at a speed (rad/s), m."""
        orders = self.shaft_orders
        if not orders.shift.any():
            return np.zeros((len(self.lines.index), self.system.size), dtype=complex)
        return at_lines(orders.shift, self._shaft_places, len(self.lines.index), speed)

    def _with_friction(self, stated: Complexes, speed: float) -> Complexes:
        """Generalized forces (n, size) of friction and of loads with reactions (n, size + 6 r) at a speed, rad/s."""
        loads = stated[:, : self.system.size].copy()
        if self._friction.size:
            loads += self.system.at(self._friction, speed)
        return loads

    def with_turned_loads(self, interface: Interface, motion: Complexes) -> Interface:
        """Return the interface with stated loads at the angles to which a motion (n, size) turns their bodies."""
        static = self.system.static_at(interface.speed)
        change = self.shaft_orders.change_by_turning(self.sampling, motion, interface.speed, static)
        return self.with_more_loads(interface, change)

    def with_more_loads(self, interface: Interface, more: Complexes) -> Interface:
        """Return the interface with loads and reactions (n, size + 6 r) in addition to those of the shafts' orders."""
        speed = interface.speed
        system = self.system
        loads = self._shaft_loads(speed) + more
        pencil = system.stiffness_at(speed), system.damping_at(speed)
        other = self._with_friction(loads, speed)
        still = system.still(pencil[0], other[0].real[:, None])[:, 0]
        answer = other.copy()
        answer[0] = still[:-1]
        none = np.zeros((system.size, 0))
        batches = batches_of(np.zeros((len(other) - 1, 0), dtype=bool), np.asarray(other[1:].any(axis=1)))
        no_motion = np.zeros((len(other) - 1, *none.shape), dtype=complex)
        system.fill_responses(pencil, interface.frequencies[1:], none, answer[1:], batches, no_motion)
        response = LoadResponse(other, answer, float(still[-1]), loads[:, system.size :])
        return replace(interface, loads=response)

    def row_of_overall(self, speed: float) -> Floats:
        """Row (size,) of the overall transmission error by the frame's coordinates, m/m and m/rad."""
        return np.asarray(self.system.at(self._rows["by_place"], speed)[0])


def turns_of_carrier(most: int, carrier: int, bases: int) -> Integers:
    """Multiples (2 most + 1, bases) of the bases' angles for functions of the angle of a carrier alone."""
    found = np.zeros((2 * most + 1, bases), dtype=np.int64)
    found[:, carrier] = np.arange(-most, most + 1)
    return found


def _stacked(ports: list[MeshInterface]) -> dict[str, Floats]:
    """Arrays of ports at several speeds (speeds, ...), by their names."""
    by_name = {field.name: [getattr(port, field.name) for port in ports] for field in fields(MeshInterface)}
    return {name: np.array(values) for name, values in by_name.items() if values[0] is not None}
