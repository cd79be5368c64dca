"""Steady response by mesh forces evaluated in time: the position moves with the vibration, and teeth may part.

Lines become samples on a lattice of the bases' angles, the laws are evaluated there, and their forces become lines
again. Newton's method solves the balance, each step by GMRES on the tangents along the lattice. Of meshes of planets,
whose waves turn with the carrier, the mean over its turn counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exugear.harmonics.krylov import HarmonicBalanceError, solve_lines
from exugear.harmonics.lattice import Lattice
from exugear.rotating.mesh_ports import BACK, DEFLECTION, FRONT, POSITION
from exugear.rotating.sampled_laws import LawSamples, sample_stiffness, sample_table
from exugear.steady.excitation import Gearset, Interface
from exugear.steady.response import Response, rates_of
from fe_ste.tools.arrays import Complexes, Floats

BALANCED = 1e-8
"""Residual of the balance over the size of the deflections."""
STEP_TOLERANCE = 1e-3
"""Residual of a Newton step's linear equations over that of the balance."""
MOST_STEPS = 40
PLACES = 5
"""Places around a carrier in which the law of its planets' meshes is evaluated: exact for products of four waves."""
SHORTEST = 1.0 / 64.0
"""Share of a Newton step to which it is halved while it does not lower the residual."""


@dataclass(frozen=True, eq=False)
class Balance:
    """The equations of all lines at one speed; n lines, m waves, r readings, f forces.

    Attributes
    ----------
    gearset : Gearset
    interface : Interface
    lattice : Lattice
    """

    gearset: Gearset
    interface: Interface
    lattice: Lattice

    @cached_property
    def static(self) -> Complexes:
        """Readings (n, m, r) of the static state."""
        out = np.zeros((len(self.lattice.lines.orders), *self.interface.ports.static.shape), dtype=complex)
        out[0] = self.interface.ports.static
        return out

    @cached_property
    def places(self) -> tuple[tuple[int, ...], Floats, Floats]:
        """Where laws are evaluated: the mean wave of each place, waves to places (u, m), and back to waves (m, u).

        A single mesh is one place. Meshes of planets are looked at in places spread evenly over the turn of the
        carrier, in which the waves add up as they do for a planet there.
        """
        waves = self.gearset.waves.waves
        found: list[int] = []
        there, back = [], []
        for n, wave in enumerate(waves):
            if wave.wave != 0:
                continue
            alone = n + 1 == len(waves) or waves[n + 1].wave == 0
            for angle in [0.0] if alone else 2.0 * np.pi * np.arange(PLACES) / PLACES:
                row = np.zeros(len(waves))
                row[n : n + 1 if alone else n + 3] = [1.0] if alone else [1.0, np.cos(angle), np.sin(angle)]
                found.append(n)
                there.append(row)
                back.append(row * (1.0 if alone else np.where(np.arange(len(waves)) == n, 1.0, 2.0) / PLACES))
        return tuple(found), np.array(there), np.array(back).T

    @cached_property
    def mean_force(self) -> Floats:
        """Forces (m, f) in the static state: those of the mean stiffness along the deflection."""
        found = np.zeros(self.interface.ports.forces.shape[:2])
        found[:, DEFLECTION] = self.gearset.waves.mean_stiffness * self.interface.ports.static[:, DEFLECTION]
        return found

    def _turned(self, angles: Floats) -> Floats:
        """Position in the mesh cycle (s, m) that the mean speed brings, cycles, at angles (s, bases) of the bases."""
        waves = self.gearset.waves.waves
        sense = np.where(self.gearset.forward(self.interface.speed), 1.0, -1.0)
        own = angles[:, [wave.base for wave in waves]]
        return np.asarray(self.interface.ports.positions + sense * own / (2.0 * np.pi))

    def _stiffness(self, turned: Floats) -> Floats:
        """Stiffness (3, s, m) of the waves' meshes at positions (s, m), N/m, and two derivatives per cycle.

        No harmonics stand in it but those of the level `parametric`: others would alias.
        """
        own = self.gearset.cycle_coefficients
        rate = 2j * np.pi * np.arange(own.shape[1])
        twice = np.where(np.arange(own.shape[1]) > 0, 2.0, 1.0)
        out = np.empty((3, *turned.shape))
        for n in range(len(own)):
            waves = np.exp(turned[:, [n]] * rate)
            out[:, :, n] = np.real([waves @ (twice * own[n] * rate**order) for order in range(3)])
        return out

    @cached_property
    def _on_lattice(self) -> tuple[Floats, Floats]:
        """Positions (s, m) on the lattice, and stiffness (3, s, m) there, of laws along a row."""
        turned = self._turned(self.lattice.angles)
        return turned, np.zeros((3, 0, 0)) if self.gearset.parting else self._stiffness(turned)

    def _sample(self, readings: Floats, rates: Floats, at: tuple[Floats, Floats]) -> LawSamples:
        """Sample the laws in all places: readings and rates (s, u, r), `at` as `_on_lattice`; results (s, u, ...)."""
        means, waves = self.places[0], self.gearset.waves
        if not self.gearset.parting:
            found = [sample_stiffness(at[1][:, :, n], readings[:, u]) for u, n in enumerate(means)]
        else:
            whole, meshes = readings.copy(), waves.assembly.meshes
            whole[..., POSITION] += at[0][:, means]
            found = [sample_table(meshes, waves.waves[n].first, whole[:, u], rates[:, u]) for u, n in enumerate(means)]
        return LawSamples(*(np.stack(own, axis=1) for own in zip(*found, strict=True)))

    def _in_time(self, readings: Complexes) -> tuple[Floats, Floats]:
        """Sample (s, m, r) readings and of their rates, the latter zero where no law asks for them."""
        values = self.lattice.values(readings)
        if not self.gearset.parting:
            return values, np.zeros_like(values)
        return values, self.lattice.values(rates_of(self.gearset, self.interface, readings))

    def forces(self, readings: Complexes) -> tuple[Complexes, Callable[[Complexes], Complexes], Floats]:
        """Find the forces (n, m, f) beyond the mean system, and how they follow small changes of the readings.

        The last result is the whole forces (s, u, f) in time, in all places.
        """
        _, there, back = self.places
        values, rates = self._in_time(readings)
        sampled = self._sample(there @ values, there @ rates, self._on_lattice)

        def change(step: Complexes) -> Complexes:
            moved, moving = self._in_time(step)
            found = np.einsum("sufr,sur->suf", sampled.slope, there @ moved)
            if self.gearset.parting:
                found += np.einsum("sufr,sur->suf", sampled.damping, there @ moving)
            return np.asarray(self.lattice.coefficients(back @ found) - self._mean_slopes(step))

        whole = back @ sampled.force
        return self.lattice.coefficients(whole) - self._mean_part(readings), change, sampled.force

    def tangents_along(self, readings: Complexes, base: int, samples: int) -> Floats:
        """Slopes of the forces beyond the mean system along the angle of one base, the meshes of others at their mean.

        Parameters
        ----------
        readings : (n, m, r) complex array
        base : int
        samples : int

        Returns
        -------
        (samples, m f, 2 m r) array
            By the readings, then by their rates.
        """
        _, there, back = self.places
        waves, lines = self.gearset.waves, self.lattice.lines
        alone = np.abs(np.delete(lines.index, base, axis=1)).sum(axis=1) == 0
        angles = np.zeros((samples, lines.index.shape[1]))
        angles[:, base] = 2.0 * np.pi * np.arange(samples) / samples
        turned = self._turned(angles)
        at = turned, np.zeros((3, 0, 0)) if self.gearset.parting else self._stiffness(turned)
        own = np.where(alone[:, None, None], readings, 0.0)
        rates = rates_of(self.gearset, self.interface, own)
        along = self._sample(there @ lines.values(own, angles), there @ lines.values(rates, angles), at)
        values, moving = self._in_time(readings)
        everywhere = self._sample(there @ values, there @ moving, self._on_lattice)
        varies = np.array([waves.waves[n].base == base for n in self.places[0]])[:, None, None]
        parts = []
        for name, mean in (("slope", waves.mean_stiffness), ("damping", waves.damping)):
            found = np.where(varies, getattr(along, name), getattr(everywhere, name).mean(axis=0))
            whole = np.einsum("mu,sufr,uw->smfwr", back, found, there)
            if name == "slope" or self.gearset.parting:
                diagonal = np.arange(len(mean))
                whole[:, diagonal, DEFLECTION, diagonal, DEFLECTION] -= mean
            parts.append(whole.reshape(samples, back.shape[0] * found.shape[2], -1))
        return np.concatenate(parts, axis=2)

    def _mean_slopes(self, change: Complexes) -> Complexes:
        """Find the forces (n, m, f) of the mean stiffness under changes of the readings (n, m, r)."""
        waves, deflection = self.gearset.waves, change[..., DEFLECTION]
        found = np.zeros((len(change), *self.interface.ports.forces.shape[:2]), dtype=complex)
        found[..., DEFLECTION] = waves.mean_stiffness * deflection
        if self.gearset.parting:
            # The damper of laws along a row is the same in the mean system; that of a table comes and goes.
            found[..., DEFLECTION] += waves.damping * rates_of(self.gearset, self.interface, deflection)
        return found

    def _mean_part(self, readings: Complexes) -> Complexes:
        """Find the forces (n, m, f) of the mean system under readings (n, m, r)."""
        found = self._mean_slopes(readings - self.static)
        found[0] += self.mean_force
        return found

    def answer(self, excess: Complexes) -> Complexes:
        """Find the readings -G F (n, m, r) under forces (n, m, f)."""
        shape = self.interface.readings.shape
        matrix = self.interface.readings.reshape(shape[0], shape[1] * shape[2], shape[3] * shape[4])
        return np.asarray(-(matrix @ excess.reshape(shape[0], -1, 1))).reshape(shape[:3])


def nonlinear_response(
    gearset: Gearset, interface: Interface, lattice: Lattice, start: Complexes | None = None
) -> tuple[Response, Complexes]:
    """Response by the laws in time, and the readings (n, m, r), from which a neighbouring speed may start.

    Raises
    ------
    HarmonicBalanceError
        Newton's method found no balance from this start.
    """
    balance = Balance(gearset, interface, lattice)
    readings, products = solve_balance(balance, balance.static if start is None else start)
    return response_of_readings(balance, readings, products), readings


def solve_balance(balance: Balance, readings: Complexes) -> tuple[Complexes, int]:
    """Solve the balance by Newton's method from given readings; the number of products that it took."""
    size = float(np.linalg.norm(balance.static[..., DEFLECTION]))
    excess, change, _ = balance.forces(readings)
    missing = readings - balance.static - balance.answer(excess)
    error, products = float(np.linalg.norm(missing)), 0
    for _ in range(MOST_STEPS):
        if error <= BALANCED * size:
            return readings, products
        step, took = solve_lines(
            lambda own, change=change: own - balance.answer(change(own)),  # type: ignore[misc]
            -missing,
            STEP_TOLERANCE,
        )
        products += took
        share = 1.0
        while True:
            ahead = readings + share * step
            excess, change, _ = balance.forces(ahead)
            missing = ahead - balance.static - balance.answer(excess)
            new = float(np.linalg.norm(missing))
            if new < error or share < SHORTEST:
                break
            share *= 0.5
        readings, error = ahead, new
    raise HarmonicBalanceError(
        f"no steady state found at {balance.interface.speed:.5g} rad/s: the residual stays at {error / size:.1e} of "
        "the deflections"
    )


def response_of_readings(balance: Balance, readings: Complexes, products: int = 0) -> Response:
    """Response of a steady state whose readings (n, m, r) are known."""
    gearset, interface = balance.gearset, balance.interface
    excess, _, whole = balance.forces(readings)
    waves = gearset.waves
    deflection = readings[..., DEFLECTION]
    apart = np.zeros(len(waves.waves))
    if gearset.parting:
        means, _, back = balance.places
        force = balance.lattice.coefficients(back @ (whole[..., [FRONT]] - whole[..., [BACK]]))[..., 0]
        free = np.mean((whole[..., FRONT] == 0.0) & (whole[..., BACK] == 0.0), axis=0)
        apart = np.array([free[[own == n for own in means]].mean() if n in means else 0.0 for n in range(len(apart))])
    else:
        rates = rates_of(gearset, interface, deflection)
        force = excess[..., 0] + waves.mean_stiffness * deflection + waves.damping * rates
    return Response(interface, deflection, excess, force * waves.line_of_action, products, apart)
