"""Orders that passing planets couple where stiffness varies as the carrier turns.

Under a planet a flexible ring gear is softer or stiffer from place to place. Each mesh of the ring has the deflection

    d_n = sum over waves w of d_w s_w(theta_n),   s = 1, cos m theta, sin m theta up to the waves of the ring's motion,

with more waves than planets. The force of wave w is the sum over planets of s_w F_n over the wave's weight, so that
waves act on each other by

    A(psi) = (1 / weight_w) sum_n s_w(theta_n) s_w'(theta_n) = sum_l A_l e^(i l psi),   l multiples of N,

and with an even number of N/2, where the wave that alternates from planet to planet takes part. So a line of the
response acts on those beside it at multiples of the planet passing frequency: by the mean stiffness,
by the damper of the mesh, and by the harmonics of the stiffness as other waves do. Planets that are not alike are sets
of one each, N = 1, whose meshes have the waves of the other gear's motion: mean, cosine and sine. Their bearings on the
carrier vary in the same way (`exugear.steady.mean_system.unequal_bearings`).

Mean stiffness and damper couple a line with its neighbours strongly. Solved exactly for each line and its neighbours,
they precondition the equation of all lines, which GMRES then solves in a few products, however many neighbours there
are.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.linalg
from numpy.lib.stride_tricks import as_strided
from scipy.linalg.lapack import zgbtrf, zgbtrs

from exugear.steady.balance.interface import Interface
from exugear.steady.balance.model import HarmonicBalanceModel, turns_of_carrier
from exugear.steady.harmonics.linear_solvers import solve_lines
from exugear.steady.harmonics.lines import Group, HarmonicCoupling
from exugear.steady.mean_system.mesh_places import DEFLECTION, MISALIGNMENT, CycleFunctions, Family
from exugear.steady.mean_system.unequal_bearings import UnequalBearings
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers

BEARINGS_TOLERANCE = 1e-11
"""Residual of the motion of bearings over what it would be without their differences."""


class SolvedGroup(NamedTuple):
    """Equation of a group of lines that passing planets couple, solved for their n readings that vary."""

    lines: slice
    """Among the lines of all groups."""
    factors: Complexes
    pivots: Integers
    """Of the equation in a band, as LAPACK's zgbtrf gives them."""
    width: int
    """Of the band on either side of the diagonal."""


class VaryingPart(NamedTuple):
    """What couples the s readings of some meshes or bearings at multiples of a carrier's angle, from -t to t."""

    carrier: int
    """Its place among the bases."""
    readings: slice
    """Among all readings."""
    forces: slice
    """Among all forces."""
    stiffness: Complexes
    damping: Complexes
    """(2 t + 1, f, s) of f forces, by the readings and by their rates."""
    carried: Floats
    """(s, s) what laws see of the readings in their rates beside the derivatives: `MeshWaves.partners`, 1/s."""


class PassingPlanets:
    """Coupling of lines by stiffness that varies with one carrier at one speed; n lines, k readings, s that vary.

    Parameters
    ----------
    parts : with f forces together; the mean of their damping is in the averaged system
    answers : (n, k, f) readings of each line under a unit of each of these forces
    """

    def __init__(
        self, model: HarmonicBalanceModel, interface: Interface, parts: Sequence[VaryingPart], answers: Complexes
    ) -> None:
        self._lines = model.lines
        self._frequencies = interface.frequencies
        self._carrier = parts[0].carrier
        self._step = model.waves.carriers[self._carrier - len(model.waves.base_orders)][1].passing
        self._turns = max(len(part.stiffness) for part in parts) // 2
        self._at = np.concatenate([np.arange(part.readings.start, part.readings.stop) for part in parts])
        self._carried = scipy.linalg.block_diag(*(part.carried for part in parts))
        shape = 2 * self._turns + 1, answers.shape[2], len(self._at)
        stiffness, of_damper = np.zeros((2, *shape), dtype=complex)
        row = column = 0
        for part in parts:
            _, forces, readings = part.stiffness.shape
            at = np.s_[row : row + forces], np.s_[column : column + readings]
            beyond = self._turns - len(part.stiffness) // 2
            inside = slice(beyond, beyond + len(part.stiffness))
            stiffness[inside, *at] = part.stiffness
            of_damper[inside, *at] = part.damping
            row, column = row + forces, column + readings
        of_damper[self._turns] = 0.0
        self._of_damper = of_damper
        self._stiffness = stiffness
        group, member, places, mirrored = self._members()
        self._places, self._mirrored = places, mirrored[:, None]
        self._to, self._of, turns = self._pairs(group, member)
        speed = self._frequencies[-1] / self._lines.orders[-1]
        frequencies = speed * (self._rows[group, member] @ self._lines.bases)  # negative of what is mirrored
        rates = 1j * frequencies[:, None, None] * np.eye(len(self._at)) + self._carried
        self._blocks = stiffness[turns] + of_damper[turns] @ rates[self._of]
        self._answers = np.where(mirrored[:, None, None], answers[places].conj(), answers[places])
        self._groups = list(self._solved(group))

    @cached_property
    def _coupling(self) -> HarmonicCoupling:
        multiples = turns_of_carrier(self._turns, self._carrier, self._lines.index.shape[1])
        return HarmonicCoupling(self._lines, (Group(0, len(self._at), multiples),))

    def damper_forces(self, readings: Complexes) -> Complexes:
        """Return the forces (n, k) of dampers beyond those of the averaged system, from readings (n, k)."""
        own = readings[:, self._at]
        rates = 1j * self._frequencies[:, None] * own + own @ self._carried.T
        found = np.zeros_like(readings)
        found[:, self._at] = self._coupling.of([self._of_damper], rates)
        return found

    def forces(self, readings: Complexes) -> Complexes:
        """Return the forces (n, k) along readings (n, k) that all vary."""
        return self._coupling.of([self._stiffness], readings) + self.damper_forces(readings)

    def _members(self) -> tuple[Integers, Integers, Integers, Booleans]:
        """Find groups of lines with their neighbours at multiples of planet passages, without those of one line.

        Returns
        -------
        group, member : (l,) number of the group, and of the passages in it, group by group
        lines, mirrored : (l,) and whether a line is taken in as its conjugate
        """
        rows = self._rows
        places, mirrored = self._lines.find(rows)
        is_line = places >= 0
        is_line &= is_line.sum(axis=1, keepdims=True) > 1
        group, member = np.nonzero(is_line)
        return group, member, places[group, member], mirrored[group, member]

    @cached_property
    def _rows(self) -> Integers:
        """Multiples (groups, passages, bases) of all bases in the groups, most of which are no lines."""
        index = self._lines.index
        passing = np.zeros(index.shape[1], dtype=np.int64)
        passing[self._carrier] = self._step
        reach = 2 * int(np.abs(index @ self._units).max()) // (self._step * int(self._units[self._carrier]))
        return index[self._first_of_groups(), None, :] + np.arange(-reach, reach + 1)[:, None] * passing

    def _pairs(self, group: Integers, member: Integers) -> tuple[Integers, Integers, Integers]:
        """Find the pairs (p,): line, line that it takes in, and the turns between them, counted from `-turns` on."""
        reach = self._turns // self._step
        places = np.full((len(self._rows), self._rows.shape[1] + 2 * reach), -1)
        places[group, reach + member] = np.arange(len(group))
        near = np.arange(2 * reach + 1)
        taken = places[group[:, None], member[:, None] + near[::-1]]
        to, apart = np.nonzero(taken >= 0)
        return to, taken[to, apart], self._turns + self._step * (apart - reach)

    @property
    def _units(self) -> Integers:
        """Multiples (bases,) of the frequency that the carrier has in common with other bases."""
        units = self._lines.units
        return units[:, int(np.flatnonzero(units[self._carrier])[0])]

    def _first_of_groups(self) -> Integers:
        """First line of each group: lines are alike but for planet passages, those turned round among them."""
        lines = self._lines
        units = lines.index @ lines.units
        turns = lines.index @ self._units
        units[:, lines.units[self._carrier] != 0] = 0
        leading = units[np.arange(len(units)), np.argmax(units != 0, axis=1)]
        step = self._step * int(self._units[self._carrier])
        turns = np.where(leading < 0, -turns, turns) % step
        turns = np.where(leading == 0, np.minimum(turns, -turns % step), turns)
        keys = np.column_stack([np.where(leading < 0, -1, 1)[:, None] * units, turns])
        return np.sort(np.unique(keys, axis=0, return_index=True)[1])

    def _solved(self, group: Integers) -> Iterator[SolvedGroup]:
        """Solve the groups of lines, in which the mesh cycle does not vary; their numbers (l,) ascend."""
        count = len(self._at)
        # Products of arrays that are not in C order are slow.
        products = np.ascontiguousarray(self._answers[:, self._at])[self._to] @ self._blocks
        begins = np.flatnonzero(np.diff(group, prepend=-1))
        for begin, end in zip(begins, [*begins[1:], len(group)], strict=True):
            pairs = slice(*np.searchsorted(self._to, [begin, end]))
            to, of = self._to[pairs] - begin, self._of[pairs] - begin
            size = count * int(end - begin)
            width = min(count * (1 + int(np.abs(to - of).max())), size) - 1
            # Entry (i, j) of the matrix is at 2 width + i - j of column j of its band.
            height = 3 * width + 1
            band = np.zeros(height * size + size, dtype=complex)
            band[2 * width : height * size : height] = 1.0
            (step,) = band.strides
            steps = count * step, step, count * (height - 1) * step, (height - 1) * step
            matrix = as_strided(band[2 * width :], (end - begin, count, end - begin, count), steps)
            matrix[to, :, of] += products[pairs]
            columns = band[: height * size].reshape(size, height).T
            factors, pivots, _ = zgbtrf(columns, width, width, overwrite_ab=True)
            yield SolvedGroup(slice(begin, end), factors, pivots, width)

    def solve(self, right: Complexes) -> Complexes:
        """Solve the equation (n, k) in which the mesh cycle does not vary."""
        own = right[self._places]
        given = np.where(self._mirrored, own.conj(), own)
        found = given[:, self._at]
        for group in self._groups:
            varying = found[group.lines]
            solution, _ = zgbtrs(group.factors, group.width, group.width, varying.ravel(), group.pivots)
            varying[...] = solution.reshape(varying.shape)
        pushed = (self._blocks @ found[self._of, :, None])[..., 0]
        # Each line takes itself in, too.
        forces = np.add.reduceat(pushed, np.flatnonzero(np.diff(self._to, prepend=-1)))
        solved = given - (self._answers @ forces[..., None])[..., 0]
        out = right.copy()
        out[self._places] = np.where(self._mirrored, solved.conj(), solved)
        return out


def passing_planets(
    model: HarmonicBalanceModel,
    interface: Interface,
    functions: Sequence[Complexes],
    answers: Complexes,
    lengths: Floats,
) -> tuple[PassingPlanets, ...]:
    """Coupling of lines by each carrier where laws along a row are tangents, with forces along the readings.

    Parameters
    ----------
    functions : (q, s, s) by group of `HarmonicBalanceModel.whole_coupling`: stiffness beyond the averaged system
    answers : (n, k, k) readings of each line under a unit of each force
    lengths : (k,) what a reading counts as a length; readings are given as lengths
    """
    forces = interface.ports.forces.shape[1]
    dampers = {(DEFLECTION, DEFLECTION): model.waves.damping[:, None].astype(np.complex128)}
    if model.shuttles:
        dampers[MISALIGNMENT, MISALIGNMENT] = model.cycles.varying_tilting[:, 1:2].astype(np.complex128)
    of_dampers = CycleFunctions(model.waves, model.varying, dampers, forces).at(interface.ports, interface.speed)
    parts = []
    for family, of_damper in zip(model.varying, of_dampers, strict=True):
        whole = functions[model.families.index(family)]
        over_cycle = whole.reshape(-1, 2 * family.turns + 1, *whole.shape[1:])
        own = slice(forces * family.first, forces * (family.first + family.count))
        carried = carried_readings(model, interface.speed, family, forces)
        damping = of_damper / lengths[own]
        parts.append(VaryingPart(family.carrier, own, own, over_cycle[len(over_cycle) // 2], damping, carried))
    of_bearings = bearing_parts(model, interface.speed, *answers.shape[1:])
    for part, stiffness in zip(of_bearings, functions[len(functions) - len(of_bearings) :], strict=True):
        parts.append(part._replace(stiffness=stiffness, damping=part.damping / lengths[part.readings]))
    return tuple(PassingPlanets(model, interface, own, answers[..., at]) for own, at in by_carrier(parts))


def solve_one_by_one(passing: Sequence[PassingPlanets], right: Complexes) -> Complexes:
    """Solve for readings (n, k) with what each carrier couples, one after the other: a preconditioner of several."""
    for carrier in passing:
        right = carrier.solve(right)
    return right


def by_carrier(parts: Sequence[VaryingPart]) -> Iterator[tuple[list[VaryingPart], Integers]]:
    """Parts of each carrier, and the places of their forces (f,) among all."""
    for carrier in dict.fromkeys(part.carrier for part in parts):
        own = [part for part in parts if part.carrier == carrier]
        yield own, np.concatenate([np.arange(part.forces.start, part.forces.stop) for part in own])


def bearing_parts(model: HarmonicBalanceModel, speed: float, readings: int, forces: int) -> list[VaryingPart]:
    """Return what couples the coordinates of bearings of planets that are not alike: last of readings and forces."""
    found: list[VaryingPart] = []
    for own in reversed(model.varying_bearings):
        count = len(own.coordinates)
        at = slice(readings - count, readings), slice(forces - count, forces)
        carrier = model.base_names.index(own.carrier)
        found.insert(0, VaryingPart(carrier, *at, *own.functions_at(speed), np.zeros((count, count))))
        readings, forces = readings - count, forces - count
    return found


def carried_readings(model: HarmonicBalanceModel, speed: float, family: Family, readings: int) -> Floats:
    """Return what laws see of a family's readings in their rates as the carrier turns, (count r, count r), 1/s."""
    return np.asarray(speed * np.kron(model.waves.partners[family.waves, family.waves], np.eye(readings)))


class BearingForces:
    """Forces of some bearings beyond the averaged system, from their motion; n lines, c coordinates."""

    def __init__(self, model: HarmonicBalanceModel, interface: Interface, bearings: Sequence[UnequalBearings]) -> None:
        self._coupling = model.bearing_coupling(bearings)
        self._rate = 1j * interface.frequencies[:, None]
        functions = [own.functions_at(interface.speed) for own in bearings]
        self._stiffness, self._damping = ([own[n] for own in functions] for n in (0, 1))

    def of_dampers(self, motion: Complexes) -> Complexes:
        """Return the forces (n, c) of their dampers in a motion (n, c)."""
        return self._coupling.of(self._damping, self._rate * motion)

    def __call__(self, motion: Complexes) -> Complexes:
        """Return all their forces (n, c) in a motion (n, c), without those of the static state."""
        return self._coupling.of(self._stiffness, motion) + self.of_dampers(motion)


class PlanetBearings:
    """Bearings that differ from planet to planet, taken out of the balance of other laws; n lines, c coordinates.

    Along their coordinates q they have forces b + S q beyond the averaged system, which answers q = q_0 - H_b (b + S q)
    to them: q_0 is the motion under all other forces, and S couples lines at multiples of the carrier's angle alone.
    Those of planets that are not alike are solved directly, and by GMRES where displaced pins load others unequally.
    """

    def __init__(self, model: HarmonicBalanceModel, interface: Interface) -> None:
        at = model.bearing_coordinates
        self._own = interface.along_bearings[:, at]
        self._lengths = model.bearing_lengths
        self._passing = self._forces = None
        if model.loaded_bearings:
            self._forces = BearingForces(model, interface, model.unequal_bearings)
        else:
            parts = bearing_parts(model, interface.speed, len(at), len(at))
            self._passing = PassingPlanets(model, interface, parts, self._own)
        still = model.still_bearings(interface.speed)
        loads = 0.0 if interface.loads is None else interface.loads.motion[:, at]
        self._of_meshes = interface.motion[:, at].reshape(len(self._own), len(at), -1)
        self.given = still + self._varying(loads - (self._own @ still[..., None])[..., 0])
        """(n, c) forces where laws have none beyond the averaged system."""

    def forces(self, excess: Complexes) -> Complexes:
        """Return the forces (n, c) that laws' forces (n, m, f) beyond the averaged system cause, without `given`."""
        return self._varying(-(self._of_meshes @ excess.reshape(len(excess), -1, 1))[..., 0])

    def _varying(self, motion: Complexes) -> Complexes:
        """Return the forces (n, c) S q where the averaged system without them moves by (n, c)."""
        forces = self._forces
        if forces is None:
            assert self._passing is not None
            return self._passing.forces(self._passing.solve(motion))

        def apply(scaled: Complexes) -> Complexes:
            return scaled + self._lengths * (self._own @ forces(scaled / self._lengths)[..., None])[..., 0]

        return forces(solve_lines(apply, self._lengths * motion, BEARINGS_TOLERANCE)[0] / self._lengths)
