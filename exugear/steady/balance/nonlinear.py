"""Steady-state response by mesh forces evaluated in time: position varies with the vibration, contact loss included.

Orders are converted to samples on a lattice of the bases' angles, the models are evaluated there, and their forces are
converted back to orders. Newton's method solves the balance, each step by GMRES on the tangents along the lattice.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from exugear.steady.balance.interface import Interface
from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.balance.passing_planets import (
    PassingPlanets,
    PlanetBearings,
    VaryingPart,
    bearing_parts,
    by_carrier,
    carried_readings,
    solve_one_by_one,
)
from exugear.steady.balance.response import LARGEST_SHIFT, Response, rates_of
from exugear.steady.harmonics.linear_solvers import HarmonicBalanceError, solve_lines
from exugear.steady.harmonics.lines import TorusSampling
from exugear.steady.mean_system.bearing_waves import COMPONENTS
from exugear.steady.mean_system.mesh_places import (
    BACK,
    DEFLECTION,
    FRONT,
    MISALIGNMENT,
    POSITION,
    MeshPlaces,
    slopes_over_turn,
)
from exugear.steady.mean_system.sampled_laws import (
    LawSamples,
    add_resistance,
    sample_curve,
    sample_line,
    sample_rolling,
    sample_table,
    sample_wandering_curve,
    sample_wandering_line,
    widened,
)
from fe_ste.tools.arrays import Complexes, Floats, Integers

BALANCED = 1e-8
"""Residual of the balance over the size of the deflections."""
STEP_TOLERANCE = 1e-3
"""Residual of a Newton step's linear equations over that of the balance."""
MOST_STEPS = 40
PATIENCE, STALLED = 6, 0.5
"""Newton steps over which the residual has to fall to this share, or the search is given up."""
MOST_TURNS = 12
"""Times that stated loads are turned with their bodies at most."""
SHORTEST = 1.0 / 64.0
"""Share of a Newton step to which it is halved while it does not lower the residual."""


@dataclass(frozen=True, eq=False)
class HarmonicResidual:
    """The equations of all lines at one speed; n lines, m waves, r readings, f forces."""

    model: HarmonicBalanceModel
    interface: Interface
    sampling: TorusSampling
    at_mean_angles: bool = False
    """Whether meshes and stated loads are at the angles of the mean speed, without what the vibration adds."""

    @cached_property
    def static(self) -> Complexes:
        """Readings (n, m, r) of the static state with friction."""
        if self._bearings is None:
            return self.interface.static
        return self.interface.static - self._read_of_bearings(self._bearings.given)

    @cached_property
    def _bearings(self) -> PlanetBearings | None:
        """Bearings that differ from planet to planet; None without any."""
        return PlanetBearings(self.model, self.interface) if self.model.unequal_bearings else None

    @cached_property
    def along_bearings(self) -> Complexes:
        """Readings (n, m, r, c) under a unit of force along each coordinate of these bearings."""
        return self.interface.read(self.interface.along_bearings)

    def _read_of_bearings(self, forces: Complexes) -> Complexes:
        """Find readings (n, m, r) under forces (n, c) along these coordinates."""
        return np.asarray(np.einsum("nmrc,nc->nmr", self.along_bearings, forces))

    def bearing_forces(self, excess: Complexes) -> Complexes:
        """Return forces (n, c) of these bearings beyond the averaged system, under forces (n, m, f) of the laws."""
        if self._bearings is None:
            return np.zeros((len(excess), 0), dtype=complex)
        return self._bearings.given + self._bearings.forces(excess)

    @cached_property
    def places(self) -> MeshPlaces:
        """Where laws are evaluated."""
        return self._places(self.sampling.angles)

    def _places(self, angles: Floats) -> MeshPlaces:
        return self.model.places(self.interface.speed, self.interface.ports.positions, angles)

    @cached_property
    def mean_force(self) -> Floats:
        """Forces (m, f) in the static state: those of the mean stiffness along the deflection, and of bearings."""
        found = np.zeros(self.interface.ports.forces.shape[:2])
        m = self.meshes
        model = self.model
        static = self.interface.ports.static
        found[:m, DEFLECTION] = model.waves.mean_stiffness * model.pressed(static)
        if self._tilting.any():
            stiffness, _, moment = self._tilting.T
            found[:m, MISALIGNMENT] = stiffness * static[:m, MISALIGNMENT]
            found[:m, MISALIGNMENT] -= moment * [wave.wave == 0 for wave in model.waves.waves]
        if self.interface.bearings is not None:
            found[m:, :COMPONENTS] = self.interface.bearings.load
        return found

    @cached_property
    def read(self) -> Integers:
        """Places of what the laws read among all readings (m r,): some laws read less than others."""
        ports = self.interface.ports
        found = ports.readings.any(axis=2) if ports.rates is None else (ports.readings + ports.rates).any(axis=2)
        return np.flatnonzero(found)

    @property
    def meshes(self) -> int:
        """Number of the meshes' waves, behind which those of bearings follow."""
        return len(self.model.waves.waves)

    @cached_property
    def _dampers(self) -> Floats:
        """Damping (m,) along the deflections that the laws have in time, and the averaged system in the mean, N s/m.

        That of tables comes and goes; that of laws along a row varies with the carrier where their stiffness does.
        """
        in_time = self.model.varying_waves | self.model.loses_contact
        return np.where(in_time, self.model.waves.damping, 0.0)

    @property
    def _reads_rates(self) -> bool:
        """Whether laws read rates, too."""
        return self.model.loses_contact or bool(self._dampers.any())

    @cached_property
    def _tilting(self) -> Floats:
        """Resistance to misalignment (m, 3) that varies with the carrier, as `MeshWaves.tilting` has it."""
        return np.zeros((self.meshes, 3)) if self.model.loses_contact else self.model.cycles.varying_tilting

    @cached_property
    def _curved(self) -> bool:
        """Whether laws along a row are curves, and not their tangents."""
        return bool(self.model.waves.loads.any())

    def _stiffness(self, places: MeshPlaces) -> Floats:
        """Return stiffness in places, N/m, and two derivatives per cycle, (3 q, s, u); none for models with tables.

        Then follow the curves' exponents minus one; for tangents the forces to be subtracted, N. Where loads shuttle,
        their axial shift follows, or the arrays required by `sample_wandering_line`. It contains only the harmonics of
        the method `parametric`: others would alias.
        """
        if self.model.loses_contact:
            return np.zeros((0, 0, 0))
        positions = places.positions
        spectra = self._cycle_spectra
        rate = 2j * np.pi * np.arange(spectra.shape[2])
        twice = np.where(np.arange(spectra.shape[2]) > 0, 2.0, 1.0)
        out = np.empty((spectra.shape[1], *positions.shape))
        for u, n in enumerate(places.means[: positions.shape[1]]):
            if u and n == places.means[u - 1] and np.array_equal(positions[:, u], positions[:, u - 1]):
                out[:, :, u] = out[:, :, u - 1]
                continue
            out[:, :, u] = (np.exp(positions[:, [u]] * rate) @ (twice * spectra[n]).T).real.T
        return out

    @cached_property
    def _cycle_spectra(self) -> Complexes:
        """Harmonics (m, 3 q, h + 1) over the mesh cycle of what `_stiffness` has."""
        model = self.model
        if self._curved:
            found = [*model.cycles.curves]
            found += [model.cycles.ways, model.cycles.moments_beyond] if model.shuttles else []
        else:
            found = [model.cycles.stiffness, model.cycles.pulls]
            found += [*model.cycles.moments, model.cycles.moments_beyond] if model.shuttles else []
        rate = 2j * np.pi * np.arange(model.harmonics + 1)
        return np.stack([curve * rate**order for curve in found for order in range(3)], axis=1)

    @cached_property
    def _lattice_stiffness(self) -> Floats:
        """As `_stiffness` has it, on the samples of the lattice: each mesh follows the angle of one base."""
        if self.model.loses_contact:
            return self._stiffness(self.places)
        waves = self.model.waves.waves
        positions = self.places.positions
        forward = self.model.forward(self.interface.speed)
        spectra = self._cycle_spectra
        out = np.empty((spectra.shape[1], *positions.shape))
        for u, n in enumerate(self.places.means[: positions.shape[1]]):
            if u and n == self.places.means[u - 1] and positions[0, u] == positions[0, u - 1]:
                out[:, :, u] = out[:, :, u - 1]
                continue
            # All angles are zero at the first sample.
            own = spectra[n] * np.exp(2j * np.pi * positions[0, u] * np.arange(spectra.shape[2]))
            out[:, :, u] = self.sampling.sample_along_base(waves[n].base, own if forward[n] else own.conj())
        return out

    def _sample(self, readings: Floats, rates: Floats, places: MeshPlaces, stiffness: Floats) -> LawSamples:
        """Sample the laws in all places: readings and rates (s, u, r), stiffness (6, s, u); results (s, u, ...)."""
        waves = self.model.waves
        meshes = self.model.waves.assembly.meshes
        of_meshes = np.array(places.means) < self.meshes
        if self.at_mean_angles:
            readings, rates = readings.copy(), rates.copy()
            readings[:, of_meshes, POSITION] = (places.there @ self.static[0].real)[..., of_meshes, POSITION]
            rates[:, of_meshes, POSITION] = 0.0
        found = []
        for u, n in enumerate(places.means):
            if n >= self.meshes:
                found.append(self._sample_bearing(n - self.meshes, readings[:, u]))
            elif self.model.loses_contact:
                whole = readings[:, u].copy()
                whole[:, POSITION] += places.positions[:, u]
                found.append(sample_table(meshes, waves.waves[n].first, whole, rates[:, u]))
            else:
                samples = self._sample_row(n, readings[:, u], stiffness[..., u])
                if self.model.varying_waves[n]:
                    add_resistance(samples, readings[:, u], rates[:, u], self._dampers[n], *self._tilting[n])
                found.append(samples)
        shape = self.interface.ports.forces.shape[1], readings.shape[2]
        found = [widened(samples, *shape) for samples in found]
        sampled = LawSamples(*(np.stack(samples, axis=1) for samples in zip(*found, strict=True)))
        if self.at_mean_angles:
            sampled.slope[:, of_meshes, :, POSITION] = 0.0
            sampled.damping[:, of_meshes, :, POSITION] = 0.0
        return sampled

    def _sample_row(self, wave: int, readings: Floats, stiffness: Floats) -> LawSamples:
        """Sample the law of a mesh along a row with readings (s, r), stiffness (3 q, s)."""
        load = float(self.model.waves.loads[wave])
        if self.model.shuttles:
            reading = readings[:, [DEFLECTION, MISALIGNMENT, POSITION]]
            if not self._curved:
                return sample_wandering_line(stiffness, reading)
            # A straight line among curves is a curve of exponent one, through any load.
            return sample_wandering_curve(stiffness, reading, load or 1.0)
        reading = readings[:, [DEFLECTION, POSITION]]
        if self._curved and load:
            return sample_curve(stiffness, reading, load)
        return sample_line(stiffness, reading)

    def _sample_bearing(self, wave: int, readings: Floats) -> LawSamples:
        """Sample the law of a bearing with readings (s, r), their last one none of it."""
        bearings = self.model.bearings
        assert bearings is not None
        force, slope = sample_rolling(bearings.laws, bearings.waves[wave].law, readings[:, :COMPONENTS])
        slope = np.pad(slope, ((0, 0), (0, 0), (0, readings.shape[1] - COMPONENTS)))
        return LawSamples(force, slope, np.zeros_like(slope))

    def _sample_readings(self, readings: Complexes) -> tuple[Floats, Floats]:
        """Sample (s, m, r) readings and of their rates, the latter zero where no law asks for them."""
        values = self.sampling.values(readings)
        if not self._reads_rates:
            return values, np.zeros_like(values)
        return values, self.sampling.values(rates_of(self.model, self.interface.speed, readings))

    def forces(self, readings: Complexes) -> tuple[Complexes, Tangent, Floats]:
        """Return the forces (n, m, f) in addition to the averaged system, and their linearisation by the readings.

        The last result is the total forces (s, u, f) in time, in all places.
        """
        if not self._last or self._last[0][0] is not readings:
            there = self.places.there
            back = self.places.back
            values, rates = self._sample_readings(readings - self.deviations)
            sampled = self._sample(there @ values, there @ rates, self.places, self._lattice_stiffness)
            # The averaged system has the mean forces at the static state without friction. What friction deflects is
            # part of its motion.
            beyond = readings.copy()
            beyond[0] -= self.interface.ports.static
            averaged = self._mean_slopes(beyond)
            averaged[0] += self.mean_force
            excess = self.sampling.coefficients(back @ sampled.force) - averaged + self._dragged
            self._last[:] = [(readings, excess, sampled)]
        _, excess, sampled = self._last[0]
        return excess, Tangent(self, sampled), sampled.force

    @cached_property
    def deviations(self) -> Complexes:
        """What deviations of gears take from the readings (n, m, r): they deflect one flank less and the other more."""
        found = np.zeros_like(self.static)
        own = self.model.deviations(self.interface.speed)
        found[:, : self.meshes, DEFLECTION] = own
        if self.model.loses_contact:
            found[:, : self.meshes, BACK] = -own
        return found

    @cached_property
    def _dragged(self) -> Complexes:
        """Forces (n, m, f) under deviations of gears by the dampers that are in the averaged system alone."""
        found = np.zeros((len(self.static), *self.interface.ports.forces.shape[:2]), dtype=complex)
        rates = rates_of(self.model, self.interface.speed, self.model.deviations(self.interface.speed))
        found[:, : self.meshes, DEFLECTION] = (self._dampers - self.model.waves.damping) * rates
        return found

    @cached_property
    def _last(self) -> list[tuple[Complexes, Complexes, LawSamples]]:
        """Return the last readings and the forces that they gave: start values of the next search.

        No tangent is kept: it refers to the balance, and the memory of both could not be freed at once.
        """
        return []

    def change(self, sampled: LawSamples, step: Complexes) -> Complexes:
        """Find how the forces (n, m, f) follow a small change (n, m, r) of the readings that were sampled."""
        there = self.places.there
        back = self.places.back
        moved, moving = self._sample_readings(step)
        found = np.einsum("sufr,sur->suf", sampled.slope, there @ moved)
        if self._reads_rates:
            found += np.einsum("sufr,sur->suf", sampled.damping, there @ moving)
        return np.asarray(self.sampling.coefficients(back @ found) - self._mean_slopes(step))

    def averaged(self, sampled: LawSamples) -> Complexes:
        """Balance (n, m r, m r) of each line by itself, laws at their mean slopes over time: what couples no lines."""
        there = self.places.there
        back = self.places.back
        n, m, r = self.static.shape
        means = []
        for slopes in (sampled.slope, sampled.damping):
            if not slopes.any():
                found = np.zeros((m, slopes.shape[2], m, slopes.shape[3]))
            elif there.ndim == 2:
                found = np.einsum("mu,ufr,uw->mfwr", back, slopes.mean(axis=0), there, optimize=True)
            else:
                found = _mean_of_waves(there, back, slopes)
            self._less_mean(found, slopes is sampled.damping)
            means.append(found.reshape(-1, m * r))
        # Rates of the waves as their meshes see them: their own, and what the turning carries along.
        carried = self.interface.speed * np.kron(self.model.partners, np.eye(r))
        answers = self.interface.readings.reshape(n * m * r, -1)
        by_place, by_rate = (
            (answers @ slopes).reshape(n, m * r, m * r) for slopes in (means[0] + means[1] @ carried, means[1])
        )
        return np.asarray(np.eye(m * r) + by_place + 1j * self.interface.frequencies[:, None, None] * by_rate)

    def _less_mean(self, slopes: Floats, by_rates: bool) -> None:
        """Subtract the slopes of the averaged system from slopes (..., m, f, m, r)."""
        waves = self.model.waves
        at = np.arange(self.meshes)
        if self._tilting.any():
            slopes[..., at, MISALIGNMENT, at, MISALIGNMENT] -= self._tilting[:, int(by_rates)]
        if by_rates:
            slopes[..., at, DEFLECTION, at, DEFLECTION] -= self._dampers
            return
        slopes[..., at, DEFLECTION, at, DEFLECTION] -= waves.mean_stiffness
        if self.interface.bearings is not None:
            slopes[..., self.meshes :, :COMPONENTS, self.meshes :, :COMPONENTS] -= self.interface.bearings.slope

    def tangents_along(self, readings: Complexes, base: int, samples: int) -> Floats:
        """Return slopes of forces beyond the averaged system over the angle of one base, other meshes at their mean.

        Parameters
        ----------
        readings : (n, m, r)

        Returns
        -------
        (samples, m f, 2 m r) by the readings, then by their rates
        """
        there = self.places.there
        back = self.places.back
        means = self.places.means
        lines = self.sampling.lines
        alone = np.abs(np.delete(lines.index, base, axis=1)).sum(axis=1) == 0
        angles = np.zeros((samples, lines.index.shape[1]))
        angles[:, base] = 2.0 * np.pi * np.arange(samples) / samples
        places = self._places(angles)
        own = np.where(alone[:, None, None], readings, 0.0)
        rates = rates_of(self.model, self.interface.speed, own)
        values = there @ lines.values(own, angles)
        moving = there @ lines.values(rates, angles)
        along = self._sample(values, moving, places, self._stiffness(places))
        everywhere = self.forces(readings)[1].sampled
        # Bearings vary with all bases.
        waves = self.model.waves.waves
        varies = np.array([n >= self.meshes or waves[n].base == base for n in means])[:, None, None]
        parts = []
        for name in ("slope", "damping"):
            own = getattr(along, name)
            mean = getattr(everywhere, name).mean(axis=0)
            found = np.where(varies, own, mean)
            # What vibrations of all bases leave of a bearing in the mean counts, and how it varies with this one.
            found[:, len(places.positions[0]) :] += (mean - own.mean(axis=0))[len(places.positions[0]) :]
            whole = np.einsum("mu,sufr,uw->smfwr", back, found, there, optimize=True)
            self._less_mean(whole, name == "damping")
            parts.append(whole.reshape(samples, back.shape[0] * found.shape[2], -1))
        return np.concatenate(parts, axis=2)

    def _mean_slopes(self, change: Complexes) -> Complexes:
        """Find the forces (n, m, f) of the mean stiffness under changes of the readings (n, m, r)."""
        waves = self.model.waves
        m = self.meshes
        deflection = change[:, :m, DEFLECTION]
        found = np.zeros((len(change), *self.interface.ports.forces.shape[:2]), dtype=complex)
        found[:, :m, DEFLECTION] = waves.mean_stiffness * deflection
        if self._reads_rates:
            found[:, :m, DEFLECTION] += self._dampers * rates_of(self.model, self.interface.speed, deflection)
        if self._tilting.any():
            stiffness, damping, _ = self._tilting.T
            tilt = change[:, :m, MISALIGNMENT]
            found[:, :m, MISALIGNMENT] += stiffness * tilt + damping * rates_of(self.model, self.interface.speed, tilt)
        if self.interface.bearings is not None:
            slope = self.interface.bearings.slope
            own = change[:, m:, :COMPONENTS]
            found[:, m:, :COMPONENTS] = np.tensordot(own, slope, axes=([1, 2], [2, 3]))
        return found

    def missing(self, readings: Complexes) -> Complexes:
        """Find what is missing to the balance (n, m, r)."""
        return readings - self.static - self.answer(self.forces(readings)[0])

    def turns_far(self, readings: Complexes) -> bool:
        """Return whether the vibration in readings (n, m, r) moves a mesh by more than `LARGEST_SHIFT`."""
        moved = 2.0 * np.abs(readings[1:, : self.meshes, POSITION])
        return bool(moved.sum(axis=0).max(initial=0.0) > LARGEST_SHIFT)

    def with_turned_loads(self, readings: Complexes) -> HarmonicResidual:
        """Return the balance with stated loads turned by the motion that readings (n, m, r) belong to."""
        motion = response_of_readings(self, readings).motion
        return replace(self, interface=self.model.with_turned_loads(self.interface, motion))

    def answer(self, excess: Complexes) -> Complexes:
        """Find the readings -G F (n, m, r) under forces (n, m, f)."""
        shape = self.interface.readings.shape
        matrix = self.interface.readings.reshape(shape[0], shape[1] * shape[2], shape[3] * shape[4])
        found = np.asarray(-(matrix @ excess.reshape(shape[0], -1, 1))).reshape(shape[:3])
        return found if self._bearings is None else found - self._read_of_bearings(self._bearings.forces(excess))


@dataclass(frozen=True, eq=False)
class Tangent:
    """How the balance follows small changes of the readings."""

    balance: HarmonicResidual
    sampled: LawSamples

    def __call__(self, step: Complexes) -> Complexes:
        """Change of the forces (n, m, f) with one of the readings (n, m, r)."""
        return self.balance.change(self.sampled, step)

    def missing(self, step: Complexes) -> Complexes:
        """Change of what is missing to the balance (n, m, r) with one of the readings."""
        return step - self.balance.answer(self(step))

    def solved(self, right: Complexes, tolerance: float = STEP_TOLERANCE) -> tuple[Complexes, int]:
        """Solve for readings (n, m, r) that change what is missing by `right`, and count the products that it takes.

        The balance of each line by itself, solved exactly, leaves GMRES what varying laws do between lines. Where
        stiffness varies with the carrier, lines are solved with those beside them.
        """
        lengths = self.balance.model.lengths
        passing = self._passing
        # Bearings of planets that are not alike have coordinates in `passing` beside the readings.
        of_bearings = sum(len(own.coordinates) for own in self.balance.model.varying_bearings) if passing else 0

        def solved(wanted: Complexes) -> Complexes:
            found = self.alone(wanted)
            if passing:
                rest = np.zeros((len(found), of_bearings), dtype=complex)
                flat = found.reshape(len(found), -1)
                own = solve_one_by_one(passing, np.hstack([flat, rest]))
                found = own[:, : flat.shape[1]].reshape(found.shape)
            return lengths * found

        def apply(scaled: Complexes) -> Complexes:
            return solved(self.missing(scaled / lengths))

        found, products = solve_lines(apply, solved(right), tolerance)
        return found / lengths, products

    def alone(self, right: Complexes) -> Complexes:
        """Solve for readings (n, m, r) that change what is missing by `right`, each line by itself."""
        read = self.balance.read
        found = right.reshape(len(right), -1).copy()
        found[:, read] = (self._inverse @ found[:, read, None])[..., 0]
        return found.reshape(right.shape)

    @cached_property
    def _passing(self) -> tuple[PassingPlanets, ...]:
        """Coupling of lines by the slopes of the laws in their mean over time, for each carrier that varies them."""
        balance = self.balance
        model, interface = balance.model, balance.interface
        if not model.varying:
            return ()
        n, m, r = balance.static.shape
        f = interface.ports.forces.shape[1]
        means = np.array(balance.places.means)
        parts = []
        for family in model.varying:
            of_places = means == family.first
            slope, damping = (
                values[:, of_places].mean(axis=0) for values in (self.sampled.slope, self.sampled.damping)
            )
            stiffness, damper = (slopes_over_turn(family, values, interface.speed) for values in (slope, damping))
            stiffness[family.turns] = 0.0  # the mean is in what each line answers by itself
            own, forces = (slice(size * family.first, size * (family.first + family.count)) for size in (r, f))
            carried = carried_readings(model, interface.speed, family, r)
            parts.append(VaryingPart(family.carrier, own, forces, stiffness, damper, carried))
        answers = interface.readings.reshape(n, m * r, m * f)
        if model.varying_bearings:
            at = np.concatenate([bearings.coordinates for bearings in model.varying_bearings])
            moved = interface.motion[:, at].reshape(n, len(at), m * f)
            along = interface.along_bearings[..., -len(at) :]
            read_there = balance.along_bearings[..., -len(at) :].reshape(n, m * r, -1)
            answers = np.block([[answers, read_there], [moved, along[:, at]]])
            parts += bearing_parts(model, interface.speed, *answers.shape[1:])
        read = balance.read
        found = []
        for of_carrier, columns in by_carrier(parts):
            along_forces = answers[:, :, columns]
            along_forces[:, read] = self._inverse @ along_forces[:, read]
            found.append(PassingPlanets(model, interface, of_carrier, along_forces))
        return tuple(found)

    @cached_property
    def _inverse(self) -> Complexes:
        read = self.balance.read
        return np.asarray(np.linalg.inv(self.balance.averaged(self.sampled)[:, read[:, None], read]), dtype=complex)


def nonlinear_response(
    model: HarmonicBalanceModel,
    interface: Interface,
    sampling: TorusSampling,
    start: Complexes | None = None,
    at_mean_angles: bool = False,
) -> tuple[Response, Complexes]:
    """Response by the laws in time, and the readings (n, m, r), from which a neighbouring speed may start.

    Raises
    ------
    HarmonicBalanceError
        Newton's method found no balance from this start.
    """
    balance = HarmonicResidual(model, interface, sampling, at_mean_angles)
    balance, readings, products = solve_turning(balance, balance.static if start is None else start)
    return response_of_readings(balance, readings, products), readings


def turned_balance(model: HarmonicBalanceModel, interface: Interface, readings: Complexes) -> HarmonicResidual:
    """Return the balance of a model with stated loads at the angles that readings (n, m, r) give their bodies."""
    balance = HarmonicResidual(model, interface, model.sampling)
    return balance.with_turned_loads(readings) if model.shaft_orders.has_loads else balance


def solve_turning(
    balance: HarmonicResidual, readings: Complexes, enough: float = BALANCED
) -> tuple[HarmonicResidual, Complexes, int]:
    """Solve the balance with meshes and stated loads at the angles that the vibration gives their bodies.

    Where it turns the free gear train by more than `LARGEST_SHIFT`, as near standstill, their forces have far more
    orders than the balance: they are at the angles of the mean speed then, as with the method `parametric`.

    Parameters
    ----------
    balance : its `at_mean_angles`, best that of a speed nearby, is tried first
    readings, enough : as of `solve_balance`

    Returns
    -------
    The balance with its loads and angles, the readings, and the number of products that they took.

    Raises
    ------
    HarmonicBalanceError
        Newton's method found no balance, although the vibration does not turn the gear train that far.
    """
    orders = balance.model.shaft_orders
    if not (orders.sidebands or orders.has_loads):
        balance = replace(balance, at_mean_angles=False)
        return balance, *solve_balance(balance, readings, enough)
    products = 0
    if balance.at_mean_angles:
        with suppress(HarmonicBalanceError):
            readings, products = solve_balance(balance, readings, enough)
            if balance.turns_far(readings):
                return balance, readings, products
        balance = replace(balance, at_mean_angles=False)
    failed = None
    try:
        settled, found, took = _settled_loads(balance, readings, enough)
        products += took
        if settled is not None and not settled.turns_far(found):
            return settled, found, products
    except HarmonicBalanceError as error:
        failed, found = error, readings
    still = replace(balance, at_mean_angles=True)
    found, took = solve_balance(still, found, enough)
    if failed is not None and not still.turns_far(found):
        raise failed
    return still, found, products + took


def _settled_loads(
    balance: HarmonicResidual, readings: Complexes, enough: float
) -> tuple[HarmonicResidual | None, Complexes, int]:
    """Solve the balance, its stated loads at the angles of their bodies; None in its place if these do not settle."""
    readings, products = solve_balance(balance, readings, enough)
    if not balance.model.shaft_orders.has_loads:
        return balance, readings, products
    size = float(np.linalg.norm(balance.static[..., DEFLECTION]))
    change = np.inf
    for _ in range(MOST_TURNS):
        turned = balance.with_turned_loads(readings)
        before = change
        change = float(np.linalg.norm((turned.static - balance.static)[..., DEFLECTION])) / size
        if change <= enough:
            return balance, readings, products
        if change > before or balance.turns_far(readings):
            break
        balance = turned
        readings, took = solve_balance(balance, readings, enough)
        products += took
    return None, readings, products


def solve_balance(balance: HarmonicResidual, readings: Complexes, enough: float = BALANCED) -> tuple[Complexes, int]:
    """Solve the balance by Newton's method from given readings; the number of products that it took.

    `enough` is the residual over the size of the deflections that counts as balanced.
    """
    size = float(np.linalg.norm(balance.static[..., DEFLECTION]))
    lengths = balance.model.lengths
    if balance.at_mean_angles:
        # No force follows the positions, whose round-off near standstill is that of large rotations.
        lengths = lengths.copy()
        lengths[: balance.meshes, POSITION] = 0.0
    products = 0
    # Steps away from a balance may overflow; they are halved then, or the search is given up.
    with np.errstate(over="ignore", invalid="ignore"):
        excess, tangent, _ = balance.forces(readings)
        missing = readings - balance.static - balance.answer(excess)
        error = float(np.linalg.norm(lengths * missing))
        before = [np.inf] * PATIENCE
        for _ in range(MOST_STEPS):
            if error <= enough * size:
                return readings, products
            if not error <= STALLED * before[-PATIENCE]:
                break
            before.append(error)
            step, took = tangent.solved(-missing)
            products += took
            share = 1.0
            while True:
                ahead = readings + share * step
                excess, tangent, _ = balance.forces(ahead)
                missing = ahead - balance.static - balance.answer(excess)
                new = float(np.linalg.norm(lengths * missing))
                if new < error or share < SHORTEST:
                    break
                share *= 0.5
            readings = ahead
            error = new
    raise HarmonicBalanceError(
        f"no steady state found at {balance.interface.speed:.5g} rad/s: the residual remains at {error / size:.1e} of "
        "the deflections"
    )


def response_of_readings(balance: HarmonicResidual, readings: Complexes, products: int = 0) -> Response:
    """Response of a steady state whose readings (n, m, r) are known."""
    model = balance.model
    interface = balance.interface
    excess, _, whole = balance.forces(readings)
    waves = model.waves
    m = balance.meshes
    deflection = readings[:, :m, DEFLECTION]
    apart = np.zeros(m)
    if model.loses_contact:
        means = balance.places.means
        back = balance.places.back
        force = balance.sampling.coefficients(back @ (whole[..., [FRONT]] - whole[..., [BACK]]))[:, :m, 0]
        free = np.mean((whole[..., FRONT] == 0.0) & (whole[..., BACK] == 0.0), axis=0)
        apart = np.array([free[[mean == n for mean in means]].mean() if n in means else 0.0 for n in range(len(apart))])
    else:
        rates = rates_of(model, interface.speed, deflection)
        force = excess[:, :m, 0] + waves.mean_stiffness * deflection + waves.damping * rates
        force[0] -= waves.mean_stiffness * waves.rest
    # The shares of time in which bearings have no force are means over planets.
    unloaded = np.zeros(0)
    if model.bearings is not None:
        laws = np.array([model.bearings.waves[n - m].law if n >= m else -1 for n in balance.places.means])
        free = np.mean(~whole.any(axis=2), axis=0)
        unloaded = np.array([free[laws == law].mean() for law in range(len(model.bearings.firsts))])
    of_bearings = balance.bearing_forces(excess)
    line = force * waves.line_of_action
    still = balance.at_mean_angles
    return Response(interface, deflection, excess, line, products, apart, unloaded, of_bearings, still)


def _mean_of_waves(there: Floats, back: Floats, slopes: Floats) -> Floats:
    """Mean over samples of slopes (s, u, f, r) in places as those of the waves (m, f, m, r), as they turn.

    A place sees the waves of its own planets alone: few products, where that of all arrays at once has many.
    """
    samples, places, m = there.shape
    found = np.zeros((m, slopes.shape[2], m, slopes.shape[3]))
    for u in range(places):
        own = np.flatnonzero(there[:, u].any(axis=0))
        turning = back[:, :, u][:, own, None] * there[:, u][:, None, own]
        mean = np.tensordot(turning, slopes[:, u], axes=(0, 0)) / samples
        found[own[:, None], :, own] += mean
    return found
