"""Orders that passing planets couple where their ring gear is flexible.

Under a planet a ring is softer or stiffer from place to place. Each mesh of the ring has the deflection

    d_n = sum over waves w of d_w s_w(theta_n),   s = 1, cos m theta, sin m theta up to the waves of the ring's motion,

with more waves than planets. The force of wave w is the sum over planets of s_w F_n over the wave's weight, so that
waves act on each other by

    A(psi) = (1 / weight_w) sum_n s_w(theta_n) s_w'(theta_n) = sum_l A_l e^(i l psi),   l multiples of N,

and with an even number of N/2, where the wave that alternates from planet to planet takes part. So a line of the
response acts on those beside it at multiples of the planet passing frequency: by the mean stiffness,
by the damper of the mesh, and by the harmonics of the stiffness as other waves do. Mean stiffness and damper couple a
line with its neighbours strongly. Solved exactly for each line and its neighbours, they precondition the equation of
all lines, which GMRES then solves in a few products, however many neighbours there are.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from exugear.steady.balance.excitation import HarmonicBalanceModel
from exugear.steady.balance.interface import Interface
from exugear.steady.harmonics.lines import Group, HarmonicCoupling
from exugear.steady.mean_system.mesh_places import DEFLECTION, MISALIGNMENT, CycleFunctions, Family
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers


class SolvedGroups(NamedTuple):
    """Groups of lines that passing planets couple, and the solution of their equation; g groups of n lines each."""

    lines: Integers
    """(g, n)"""
    mirrored: Booleans
    """(g, n) whether a line is taken in as its conjugate."""
    inverse: Complexes
    """(g, n s, n s) of the equation of the ring's readings."""
    forces: Complexes
    """(g, n s, n s) forces of the ring's waves by these readings."""
    answers: Complexes
    """(g, n, k, s) all readings under a unit of each of these forces."""


class PassingPlanets:
    """Coupling of lines by a flexible ring gear at one speed; n lines, k readings of all waves, s of the ring's.

    Parameters
    ----------
    functions : (q, s, s) stiffness of the ring's waves beyond its mean, as `CycleFunctions` has it
    answers : (n, k, k) readings of each line under a unit of each force
    lengths : (k,) what a reading counts as a length; readings are given as lengths
    """

    def __init__(
        self,
        model: HarmonicBalanceModel,
        interface: Interface,
        functions: Complexes,
        answers: Complexes,
        lengths: Floats,
    ) -> None:
        family = model.ring
        assert family is not None
        forces = interface.ports.forces.shape[1]
        self._waves = slice(forces * family.first, forces * (family.first + family.count))
        self._lines = model.lines
        dampers = {(DEFLECTION, DEFLECTION): model.waves.damping[:, None].astype(np.complex128)}
        if model.shuttles:
            dampers[MISALIGNMENT, MISALIGNMENT] = model.ring_tilting[:, 1:2].astype(np.complex128)
        functions_of_dampers = CycleFunctions(model.waves, [family], dampers, forces)
        (of_damper,) = functions_of_dampers.at(interface.ports, interface.speed)
        of_damper /= lengths[self._waves]
        of_damper[family.turns] = 0.0  # the mean is in the averaged system
        self._of_damper = of_damper
        partners = np.kron(model.partners[family.waves, family.waves], np.eye(forces))
        self._carried = interface.speed * partners
        self._frequencies = interface.frequencies
        self._coupling = HarmonicCoupling(model.lines, (_turns(family, len(partners), model.lines.index.shape[1]),))
        mean = functions.reshape(-1, 2 * family.turns + 1, *functions.shape[1:])
        self._solved_groups = tuple(self._groups(family, mean[len(mean) // 2], answers))

    def damper_forces(self, readings: Complexes) -> Complexes:
        """Return the forces (n, k) of the meshes' dampers beyond those of the averaged system, from readings (n, k)."""
        own = readings[:, self._waves]
        rates = 1j * self._frequencies[:, None] * own + own @ self._carried.T
        found = np.zeros_like(readings)
        found[:, self._waves] = self._coupling.of([self._of_damper], rates)
        return found

    def _groups(self, family: Family, stiffness: Complexes, answers: Complexes) -> Iterator[SolvedGroups]:
        """Solve the groups of lines with their neighbours, in which the mesh cycle does not vary, by their size.

        `stiffness` (2 turns + 1, s, s) couples the ring's signals at multiples of the carrier's angle.
        """
        assert family.planets is not None
        index = self._lines.index
        step = family.planets.passing
        passing = np.zeros(index.shape[1], dtype=np.int64)
        passing[family.carrier] = step
        first = self._first_of_groups(family)
        reach = 2 * int(np.abs(index[:, family.carrier]).max()) // step
        rows = index[first, None, :] + np.arange(-reach, reach + 1)[:, None] * passing
        places, mirrored = self._lines.find(rows)
        speed = self._frequencies[-1] / self._lines.orders[-1]
        frequencies = speed * (rows @ self._lines.bases)
        sizes = (places >= 0).sum(axis=1)
        for size in np.unique(sizes[sizes > 1]):
            group, member = (at.reshape(-1, size) for at in np.nonzero((places >= 0) & (sizes == size)[:, None]))
            own = places[group, member], mirrored[group, member]
            apart = step * (member[:, :, None] - member[:, None, :])
            yield self._solved(family, stiffness, answers, own, frequencies[group, member], apart)

    def _first_of_groups(self, family: Family) -> Integers:
        """First line of each group: lines are alike but for planet passages, those turned round among them."""
        assert family.planets is not None
        lines = self._lines
        units = lines.index @ lines.units
        column = int(np.flatnonzero(lines.units[family.carrier])[0])
        turns = units[:, column].copy()
        units[:, column] = 0
        leading = units[np.arange(len(units)), np.argmax(units != 0, axis=1)]
        step = family.planets.passing
        turns = np.where(leading < 0, -turns, turns) % step
        turns = np.where(leading == 0, np.minimum(turns, -turns % step), turns)
        keys = np.column_stack([np.where(leading < 0, -1, 1)[:, None] * units, turns])
        return np.sort(np.unique(keys, axis=0, return_index=True)[1])

    def _solved(
        self,
        family: Family,
        stiffness: Complexes,
        answers: Complexes,
        lines: tuple[Integers, Booleans],
        frequencies: Floats,
        apart: Integers,
    ) -> SolvedGroups:
        """Solve groups of one size: lines (g, n), whether conjugates, frequencies (g, n), turns between (g, n, n)."""
        places, mirrored = lines
        groups, members = places.shape
        count = stiffness.shape[-1]
        coupled_ones = np.abs(apart) <= family.turns
        turns = np.where(coupled_ones, apart, 0) + family.turns
        rates = 1j * frequencies[..., None, None] * np.eye(count) + self._carried
        blocks = stiffness[turns] + self._of_damper[turns] @ rates[:, None]
        blocks *= coupled_ones[..., None, None]
        found = answers[places][..., self._waves]
        answering = np.where(mirrored[..., None, None], found.conj(), found)
        matrix = (answering[:, :, None, self._waves] @ blocks).swapaxes(2, 3).reshape(groups, members * count, -1)
        inverse = np.linalg.inv(matrix + np.eye(members * count))
        forces = blocks.swapaxes(2, 3).reshape(groups, members * count, -1)
        return SolvedGroups(places, mirrored, inverse, forces, answering)

    def solve(self, right: Complexes) -> Complexes:
        """Solve the equation (n, k) in which the mesh cycle does not vary."""
        out = right.copy()
        for group in self._solved_groups:
            given = np.where(group.mirrored[..., None], right[group.lines].conj(), right[group.lines])
            own = group.inverse @ given[..., self._waves].reshape(len(given), -1, 1)
            forces = (group.forces @ own).reshape(*given.shape[:2], -1, 1)
            solved = given - (group.answers @ forces)[..., 0]
            out[group.lines[group.mirrored]] = solved[group.mirrored].conj()
            out[group.lines[~group.mirrored]] = solved[~group.mirrored]
        return out


def _turns(family: Family, size: int, bases: int) -> Group:
    """Group of the ring's signals alone, which functions of the carrier's angle couple."""
    turns = np.arange(-family.turns, family.turns + 1)
    multiples = np.zeros((len(turns), bases), dtype=np.int64)
    multiples[:, family.carrier] = turns
    return Group(0, size, multiples)
