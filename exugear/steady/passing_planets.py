"""Orders that passing planets couple where their ring gear is flexible.

Under a planet a ring is softer or stiffer from place to place. Each mesh of the ring has the deflection

    d_n = sum over waves w of d_w s_w(theta_n),   s = 1, cos m theta, sin m theta up to the waves of the ring's motion,

with more waves than planets. The force of wave w is the sum over planets of s_w F_n over the wave's weight, so that
waves act on each other by

    A(psi) = (1 / weight_w) sum_n s_w(theta_n) s_w'(theta_n) = sum_l A_l e^(i l psi),   l multiples of N,

and a line of the response acts on those beside it at multiples of the planet passing frequency: by the mean stiffness,
by the damper of the mesh, and by the harmonics of the stiffness as other waves do. Mean stiffness and damper couple a
line with its neighbours strongly. Solved exactly for each line and its neighbours, they precondition the equation of
all lines, which GMRES then solves in a few products, however many neighbours there are.
"""

from __future__ import annotations

import numpy as np

from exugear.steady.excitation import HarmonicBalanceModel, Interface
from exugear.steady.harmonics.lines import Group, HarmonicCoupling
from exugear.steady.mean_system.mesh_places import DEFLECTION, MISALIGNMENT, Family, coupled
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers


class PassingPlanets:
    """Coupling of lines by a flexible ring gear at one speed; n lines, k readings of all waves, s of the ring's.

    Parameters
    ----------
    functions : (q, s, s) stiffness of the ring's waves beyond its mean, as `HarmonicBalanceModel.coupled` has it
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
        damping = model.waves.damping[:, None] + 0j
        dampers = {(DEFLECTION, DEFLECTION): damping}
        if model.shuttles:
            dampers[MISALIGNMENT, MISALIGNMENT] = model.ring_tilting[:, 1:2] + 0j
        of_damper = coupled(model.waves, family, dampers, interface.ports, interface.speed, forces)
        of_damper /= lengths[self._waves]
        of_damper[family.turns] = 0.0  # the mean is in the averaged system
        self._of_damper = of_damper
        partners = np.kron(model.partners[family.waves, family.waves], np.eye(forces))
        self._carried = interface.speed * partners
        self._frequencies = interface.frequencies
        self._coupling = HarmonicCoupling(model.lines, (_turns(family, len(partners), model.lines.index.shape[1]),))
        mean = functions.reshape(-1, 2 * family.turns + 1, *functions.shape[1:])
        self._prepare(family, mean[len(mean) // 2], answers)

    def damper_forces(self, readings: Complexes) -> Complexes:
        """Return the forces (n, k) of the meshes' dampers beyond those of the averaged system, from readings (n, k)."""
        own = readings[:, self._waves]
        rates = 1j * self._frequencies[:, None] * own + own @ self._carried.T
        found = np.zeros_like(readings)
        found[:, self._waves] = self._coupling.of([self._of_damper], rates)
        return found

    def _prepare(self, family: Family, stiffness: Complexes, answers: Complexes) -> None:
        """Solve all groups of lines with their neighbours, in which the mesh cycle does not vary."""
        places, mirrored, frequencies = self._groups(family)
        count = stiffness.shape[-1]
        groups, members = places.shape
        turns = family.turns // family.planets.waves if family.planets is not None else 0
        step = family.planets.waves if family.planets is not None else 1
        blocks = np.zeros((groups, members, members, count, count), dtype=complex)
        for apart in range(-turns, turns + 1):
            at = family.turns + apart * step
            for there in range(max(0, -apart), members - max(0, apart)):
                rates = 1j * frequencies[:, there, None, None] * np.eye(count) + self._carried
                blocks[:, there + apart, there] = stiffness[at] + self._of_damper[at] @ rates
        present = places >= 0
        blocks *= (present[:, :, None] & present[:, None, :])[..., None, None]
        found = answers[np.maximum(places, 0)][..., self._waves]
        answering = np.where(mirrored[..., None, None], found.conj(), found)
        own = answering[:, :, self._waves]
        matrix = np.einsum("giab,gijbc->giajc", own, blocks, optimize=True).reshape(groups, members * count, -1)
        self._inverse = np.linalg.inv(matrix + np.eye(members * count))
        self._blocks = blocks.swapaxes(2, 3).reshape(groups, members * count, members * count)
        self._places, self._mirrored, self._present, self._answering = places, mirrored, present, answering

    def _groups(self, family: Family) -> tuple[Integers, Booleans, Floats]:
        """Lines (g, members) of each group in the order of their passings, -1 for none; conjugates; frequencies."""
        index = self._lines.index
        passing = np.zeros(index.shape[1], dtype=np.int64)
        passing[family.carrier] = family.planets.waves if family.planets is not None else 1
        most = int(np.abs(index[:, family.carrier]).max()) // passing[family.carrier]
        middle = index[np.abs(index[:, family.carrier]) < passing[family.carrier]]
        rows = middle[:, None, :] + np.arange(-most, most + 1)[:, None] * passing
        places, mirrored = self._lines.find(rows)
        speed = self._frequencies[-1] / self._lines.orders[-1]
        return places, mirrored, speed * (rows @ self._lines.bases)

    def solve(self, right: Complexes) -> Complexes:
        """Solve the equation (n, k) in which the mesh cycle does not vary."""
        given = right[np.maximum(self._places, 0)]
        given = np.where(self._mirrored[..., None], given.conj(), given) * self._present[..., None]
        groups, members, _ = given.shape
        own = self._inverse @ given[..., self._waves].reshape(groups, -1, 1)
        forces = (self._blocks @ own).reshape(groups, members, -1, 1)
        solved = given - (self._answering @ forces)[..., 0]
        out = right.copy()
        direct = self._present & ~self._mirrored
        out[self._places[direct]] = solved[direct]
        conjugate = self._present & self._mirrored
        out[self._places[conjugate]] = solved[conjugate].conj()
        return out


def _turns(family: Family, size: int, bases: int) -> Group:
    """Group of the ring's signals alone, which functions of the carrier's angle couple."""
    turns = np.arange(-family.turns, family.turns + 1)
    multiples = np.zeros((len(turns), bases), dtype=np.int64)
    multiples[:, family.carrier] = turns
    return Group(0, size, multiples)
