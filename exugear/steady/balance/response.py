"""Steady-state response of a gearbox at one speed, by mesh forces that are linear in the deflections.

With the inputs y of the mesh models, and the forces F of the meshes in addition to those of their mean stiffness

    y_k = y_static [k = 0] - G(w_k) F_k

for every order k. Method `linear`: F is the excitation by the static transmission error under the mean force. Method
`parametric`: F = (k(pmc) - k_mean) d, all mesh frequencies at once; the equations are linear and GMRES solves them. A
curve of load over deflection is replaced by its tangent k(pmc) at the static load F_0, with the exponent m(pmc):

    force k d - (m - 1) F_0 = k (d - e),  e = s - F_0 / k,  s the static transmission error.

Deviations of gears are a given displacement in both methods: see `exugear.steady.mean_system.shaft_orders`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from exugear.steady.balance.interface import Interface
from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.balance.passing_planets import (
    BearingForces,
    PassingPlanets,
    PlanetBearings,
    passing_planets,
    solve_one_by_one,
)
from exugear.steady.harmonics.linear_solvers import solve_lines
from exugear.steady.harmonics.lines import add_answered, flat
from exugear.steady.mean_system.bearing_waves import TILTS
from exugear.steady.mean_system.mesh_places import (
    DEFLECTION,
    MISALIGNMENT,
    POSITION,
    CycleFunctions,
    MeshInterface,
    wave_products,
)
from exugear.system.kernels.coordinates import BODY_SIZE
from exugear.system.kernels.meshes import TILT_DAMPING, TILT_STIFFNESS
from fe_ste.tools.arrays import Complexes, Floats, Integers
from fe_ste.tools.bundles import cached_bundle
from fe_ste.tools.octets import SIZE

TOLERANCE = 1e-9
"""Residual of the balance over the static deflections."""
PASSING_TOLERANCE = 1e-6
"""The same where stiffness varies with the carrier: neighbours that are left out are larger by far."""
BESIDE_ROTATIONS = 1e-2
"""Factor on it with the orders of shafts, which turn carrier and planets by a thousand times what meshes deflect."""
ROUGH_TOLERANCE = 1e-4
"""The same of solutions that only tell how far positions move, which changes forces by a hundredth."""
POSITIONS_REPEATED = 2
"""Solutions after the first one, with positions in the mesh cycle that move with the orders of shafts."""
LARGEST_SHIFT = 0.1
"""Motion of a position, mesh cycles, above which forces are not linear in it: it is neglected there.

Near standstill stated torques and eccentric gears, whose mesh forces have varying levers, turn the free gear train that
far."""


@dataclass(frozen=True, eq=False)
class Response:
    """Steady state at one speed; n orders, m mesh components, f forces of each.

    Arrays of lines hold coefficients; `exugear.steady.harmonics.lines.LineSet` defines the signal.
    """

    interface: Interface
    deflection: Complexes
    """(n, m) deflections that the laws read, m."""
    excess: Complexes
    """(n, m, f) forces in addition to the averaged system, in the model's coordinates, N and N m."""
    force: Complexes
    """(n, m) forces of the meshes on the line of action, N."""
    products: int
    """Products with the operator that the solution took."""
    apart: Floats
    """(m,) share of time in which teeth are apart."""
    free: Floats
    """(b,) share of time in which no rolling element of a non-linear bearing touches, by law."""
    of_bearings: Complexes
    """(n, c) forces along coordinates of the bearings that vary with the carrier, beyond the averaged system."""
    at_mean_angles: bool = False
    """Whether positions in the mesh cycles are those of the mean speed, because they move by more than
    `LARGEST_SHIFT`."""

    @cached_property
    def motion(self) -> Complexes:
        """Coefficients (n, size) of the motion about the static state, in the rotating frame."""
        return self.motion_at(np.s_[:])

    def motion_at(self, lines: Integers | slice) -> Complexes:
        """Return the coefficients (q, size) of the motion at some lines alone."""
        excess = self.excess.reshape(len(self.excess), -1)
        return _motion(
            self.interface, np.hstack([excess, self.of_bearings]) if self.of_bearings.size else excess, lines
        )

    @property
    def torque(self) -> float:
        """Mean torque of the drive that keeps the speed, N m."""
        torque = self.interface.torque - float(np.sum(self.interface.torque_per_force * self.excess[0].real))
        if self.of_bearings.size:
            torque -= float(self.interface.torque_along_bearings @ self.of_bearings[0].real)
        return torque if self.interface.loads is None else torque + self.interface.loads.torque


def _motion(interface: Interface, excess: Complexes, lines: Integers | slice) -> Complexes:
    """Motion (q, size) about the static state under forces (n, m f + c) beyond the averaged system, and other loads."""
    of_meshes = interface.motion.reshape(*interface.motion.shape[:2], -1)
    meshes = of_meshes.shape[2]
    found = of_meshes[lines] @ excess[lines, :meshes, None]
    if interface.along_bearings.shape[2]:
        found = found + interface.along_bearings[lines] @ excess[lines, meshes:, None]
    if interface.loads is None:
        return np.asarray(-found[..., 0])
    return np.asarray(interface.loads.motion[lines] - found[..., 0])


def linear_response(model: HarmonicBalanceModel, interface: Interface) -> Response:
    """Compute the response to static transmission errors as given displacements, first order in stiffness variation.

    F = -k_mean e with e = s - mean of s, the transmission error under the static force F_0; of a curve k_mean is the
    mean of the tangent. Deviations of gears add to e, and to the displacement of the damper. Where the load shuttles by
    w, s contains w (g - g0), and F_0 w is a moment.
    """
    excess = transmission_errors(model, interface.ports, interface.speed)
    excess[..., DEFLECTION] += mean_deviation_forces(model, interface.speed)
    forces = excess.reshape(len(excess), -1)
    answer = -np.einsum("nij,nj->ni", interface.deflection_per_force, forces).reshape(excess.shape)[..., DEFLECTION]
    if model.unequal_bearings:
        bearings = PlanetBearings(model, interface)
        of_bearings = bearings.given + bearings.forces(excess)
        read = interface.read(interface.along_bearings)[..., DEFLECTION, :]
        answer -= (read @ of_bearings[..., None])[..., 0]
        forces = np.hstack([forces, of_bearings])
    return _response(model, interface, interface.static[..., DEFLECTION] + answer, forces, 0)


def transmission_errors(model: HarmonicBalanceModel, ports: MeshInterface, speed: float) -> Complexes:
    """Find the forces (n, m, f) that static transmission errors make of the mean stiffness, and moments, N and N m."""
    mean = model.waves.mean_stiffness[:, None]
    compliances, ways = (_varying(own) for own in (model.cycles.compliances, model.cycles.ways))
    spectra = {(DEFLECTION, DEFLECTION): -mean * compliances}
    # What the errors go with: force, and misalignment.
    static = np.zeros(ports.forces.shape[:2])
    static[:, DEFLECTION] = mean[:, 0] * model.pressed(ports.static)
    if model.shuttles:
        static[:, MISALIGNMENT] = ports.static[: len(mean), MISALIGNMENT]
        spectra |= {(DEFLECTION, MISALIGNMENT): -mean * ways, (MISALIGNMENT, DEFLECTION): -ways}
    found = _products_of_constants(model, model.cycles.functions(spectra), ports, speed, static)
    if model.shuttles:
        beyond = {(MISALIGNMENT, DEFLECTION): -_varying(model.cycles.moments_beyond)}
        found += _products_of_constants(model, model.cycles.functions(beyond), ports, speed, _everywhere(model, ports))
    found[0] = 0.0
    return found


def mean_deviation_forces(model: HarmonicBalanceModel, speed: float) -> Complexes:
    """Find the forces (n, m) of the deviations of gears in the averaged system, -k_mean e - c e', N."""
    waves = model.waves
    errors = model.deviations(speed)
    return np.asarray(-waves.mean_stiffness * errors - waves.damping * rates_of(model, speed, errors))


def deviation_forces(
    model: HarmonicBalanceModel, interface: Interface, passing: Sequence[PassingPlanets] = ()
) -> Complexes:
    """Find the forces (n, m, f) of the deviations of gears, -k e - c e' with k over the mesh cycle, N and N m.

    `passing` has the dampers of meshes whose stiffness varies with the carrier.
    """
    ports = interface.ports
    forces = np.zeros((len(model.lines.index), *ports.forces.shape[:2]), dtype=complex)
    if not model.deviations(interface.speed).any():
        return forces
    errors = forces.copy()
    errors[..., DEFLECTION] = model.deviations(interface.speed)
    forces[..., DEFLECTION] = mean_deviation_forces(model, interface.speed)
    beyond = model.coupling.of(
        model.cycles.tangents_beyond_mean.at(ports, interface.speed), errors.reshape(len(errors), -1)
    )
    for own in passing:
        readings = np.hstack([errors.reshape(len(errors), -1), np.zeros((len(errors), len(model.bearing_lengths)))])
        beyond += own.damper_forces(readings)[:, : beyond.shape[1]]
    return forces - beyond.reshape(forces.shape)


class SlowChanges:
    """Forces that meshes have because the shafts' orders move them, at one speed.

    A slow change p of the position in the mesh cycle changes the force by p dF/dpmc, and a slow change of deflection
    the stiffness of a curve of load over deflection. Both make sidebands of mesh orders.
    """

    def __init__(self, model: HarmonicBalanceModel, interface: Interface) -> None:
        ports = interface.ports
        self._model = model
        self._interface = interface
        self._ports = ports
        self._speed = interface.speed
        self._shape = len(model.lines.index), *ports.forces.shape[:2]
        self._lines, self._places, self._coupling = model.slow_shifts
        self._products = [wave_products(family, interface.speed) for family in model.families]
        self._rows = np.ascontiguousarray(ports.readings[: self._shape[1], POSITION].T)
        self._by_position = self._forces_by_deflection(model.cycles.slopes, model.cycles.pull_slopes)
        self._by_deflection = self._forces_by_deflection(*model.cycles.bends) if model.waves.loads.any() else None

    def _forces_by_deflection(self, functions: CycleFunctions, given: CycleFunctions) -> tuple[Any, Complexes | float]:
        """Functions of the mesh cycle of a deflection as `flat` has them, and forces (n, m, f) of curves without it."""
        ports = self._ports
        constants: Complexes | float = 0.0
        if self._model.waves.loads.any():
            everywhere = _everywhere(self._model, ports)
            constants = _products_of_constants(self._model, given, ports, self._speed, everywhere)
        return flat(functions.at(ports, self._speed)), constants

    def positions(self, excess: Complexes) -> Complexes:
        """Return how far the motion under forces (n, m f + c) moves the positions (q, m), mesh cycles."""
        return np.asarray(_motion(self._interface, excess, self._lines) @ self._rows)

    def forces(self, deflections: Complexes, positions: Complexes) -> Complexes:
        """Find the forces (n, m, f), N, at deflections (n, m) and `positions` (q, m)."""
        found = np.zeros(self._shape, dtype=complex)
        along = found.copy()
        along[..., DEFLECTION] = deflections - self._model.deviations(self._speed)
        found[..., DEFLECTION] = self._modulated(positions, along, self._by_position)
        if self._by_deflection is not None:
            slow = along[self._lines, :, DEFLECTION]
            along[self._lines] = 0.0
            found[..., DEFLECTION] += self._modulated(slow, along, self._by_deflection)
        return found

    def _modulated(self, slow: Complexes, along: Complexes, law: tuple[Any, Complexes | float]) -> Complexes:
        """Find products (n, m) of slow signals (q, m) of the meshes with forces of a law at deflections (n, m, f)."""
        functions, given = law
        changes = self._model.coupling.of_flat(functions, along.reshape(len(along), -1)).reshape(self._shape) + given
        shifts = np.concatenate([slow, slow.conj()])
        turned = []
        for group, places, products in zip(self._coupling.groups, self._places, self._products, strict=True):
            own = shifts[:, group.begin : group.begin + products.shape[2]]
            function = np.zeros((len(group.harmonics), group.size, group.size), dtype=complex)
            np.add.at(function[..., : products.shape[3]], places, np.einsum("tvwx,qw->qtvx", products, own))
            turned.append(function)
        return self._coupling.of(turned, changes[..., DEFLECTION])


def _everywhere(model: HarmonicBalanceModel, ports: MeshInterface) -> Floats:
    """Constants (m, f) of one in all places: what these have alike is what the mean wave has."""
    ones = np.zeros(ports.forces.shape[:2])
    ones[:, DEFLECTION] = [wave.wave == 0 for wave in model.waves.waves]
    return ones


def _varying(cycle: Complexes) -> Complexes:
    """Harmonics (m, h + 1) without the mean."""
    return np.asarray(cycle * (np.arange(cycle.shape[1]) > 0))


def _products_of_constants(
    model: HarmonicBalanceModel, functions: CycleFunctions, ports: MeshInterface, speed: float, values: Floats
) -> Complexes:
    """Products (n, m, f) of constants (m, f) with functions of the mesh cycles."""
    if not values.size:  # a train without meshes
        return np.zeros((len(model.lines.index), *values.shape), dtype=complex)
    return model.coupling.of_constants(functions.at(ports, speed), values.ravel()).reshape(-1, *values.shape)


def parametric_response(model: HarmonicBalanceModel, interface: Interface) -> Response:
    """Response to stiffness that varies with the position in the mesh cycle, this moving with the mean speed.

    The equations y = y_static - G (K y - given) of all lines are solved with readings as lengths, l y. Where gears have
    deviations, the position moves with the orders of their shafts, too: what that adds to the forces is given by the
    solution before (`SlowChanges`). Coordinates of bearings that vary with the carrier follow the readings of the
    meshes. Without meshes it is the response of the method `linear`.
    """
    if not model.waves.waves:
        return linear_response(model, interface)
    shape = len(model.lines.index), *interface.ports.forces.shape[:2]
    of_meshes = shape[1] * shape[2]
    lengths = np.append(model.lengths[: shape[1], : shape[2]].ravel(), model.bearing_lengths)
    coordinates = model.bearing_coordinates
    answers = lengths[:, None] * interface.answers_with(coordinates)
    # These are the readings of meshes and bearings without forces beyond the averaged system.
    still = interface.static[..., : shape[2]].reshape(shape[0], -1)
    if coordinates.size:
        loads = interface.loads
        under_loads = np.zeros((shape[0], len(coordinates))) if loads is None else loads.motion[:, coordinates]
        still = np.hstack([still, under_loads])
    still = lengths * still
    repeated = bool(model.shaft_orders.sidebands or model.varying)
    balance = LineBalance(model, interface, answers, lengths)
    passing = balance.passing
    of_bearings = model.still_bearings(interface.speed)
    given = given_forces(model, interface) + deviation_forces(model, interface, passing)
    moved = np.zeros_like(given)
    slow = SlowChanges(model, interface) if repeated else None
    found = None
    too_far = False
    products = 0
    for again in reversed(range(1 + (POSITIONS_REPEATED if repeated else 0))):
        whole = np.hstack([(given + moved).reshape(shape[0], -1), of_bearings])
        start = still - (answers @ whole[..., None])[..., 0]
        before = found
        found, more = balance.solve(start, before, rough=bool(again and model.varying))
        products += more
        excess = whole + balance.forces(found)
        deflection = (found / lengths)[:, :of_meshes].reshape(shape)[..., DEFLECTION]
        if before is not None and not model.varying:
            # Forces by moving positions are products of deflections and positions: a relative change c of both changes
            # them by 2 c, and these forces have themselves changed the solution by c.
            change = float(np.linalg.norm(found - before) / np.linalg.norm(found))
            if 2.0 * change**2 < TOLERANCE:
                break
        if again and slow is not None:
            positions = slow.positions(excess)
            too_far = bool((2.0 * np.abs(positions)).sum(axis=0).max(initial=0.0) > LARGEST_SHIFT)
            moved = np.zeros_like(given) if too_far else slow.forces(deflection, positions)
        if again and model.varying:
            response = _response(model, interface, deflection, excess, products)
            shifted = at_mean_positions(model, interface, response)
            balance = LineBalance(model, shifted, answers, lengths, passing)
            given = given_forces(model, shifted) + deviation_forces(model, shifted, passing)
    return replace(_response(model, interface, deflection, excess, products), at_mean_angles=too_far)


class LineBalance:
    """Equation y + G K y = b of all lines at one speed, with readings y (n, k) as lengths and K over the mesh cycle.

    Parameters
    ----------
    answers : (n, k, k) readings of each line under a unit of each force, G
    lengths : (k,) what a reading counts as a length
    passing : of stiffness that varies with carriers, at any positions in the mesh cycle; by default it is found
    """

    def __init__(
        self,
        model: HarmonicBalanceModel,
        interface: Interface,
        answers: Complexes,
        lengths: Floats,
        passing: tuple[PassingPlanets, ...] = (),
    ) -> None:
        functions = model.cycles.tangents_beyond_mean.at(interface.ports, interface.speed)
        of_bearings = [own.functions_at(interface.speed) for own in model.unequal_bearings]
        functions += [stiffness for stiffness, _ in of_bearings]
        self._coupling = model.whole_coupling
        self._functions = [
            function / lengths[group.begin : group.begin + group.size]
            for function, group in zip(functions, self._coupling.groups, strict=True)
        ]
        self._answers = answers
        self._flat = flat(self._functions)
        self._parts = *self._flat, *flat([answers])
        self._memory = self._coupling.memory()
        self._octets = np.empty(2 * SIZE)
        self.passing = passing
        if model.varying and not passing:
            self.passing = passing_planets(model, interface, self._functions, answers, lengths)
        self._loaded = BearingForces(model, interface, model.loaded_bearings) if model.loaded_bearings else None
        begin = len(lengths) - len(model.bearing_lengths)
        self._at_loaded = slice(begin, begin + sum(len(own.coordinates) for own in model.loaded_bearings))
        self._lengths = lengths
        self._turns = bool(self.passing) and bool(model.shaft_orders.sidebands)

    def _apply(self, readings: Complexes) -> Complexes:
        out = np.empty_like(readings)
        add_answered(cached_bundle(self._coupling.terms), *self._parts, readings, *self._memory, self._octets, out)
        if self._loaded is not None or self.passing:
            out += (self._answers @ self._dampers(readings)[..., None])[..., 0]
        return solve_one_by_one(self.passing, out)

    def _dampers(self, readings: Complexes) -> Complexes:
        """Return the forces (n, k) of dampers that are unequal or vary, beyond those of the averaged system."""
        found = np.zeros_like(readings)
        for passing in self.passing:
            found += passing.damper_forces(readings)
        if self._loaded is not None:
            own = self._at_loaded
            found[:, own] += self._loaded.of_dampers(readings[:, own] / self._lengths[own])
        return found

    def forces(self, readings: Complexes) -> Complexes:
        """Return the forces (n, k) K y."""
        return self._coupling.of_flat(self._flat, readings) + self._dampers(readings)

    def solve(self, right: Complexes, start: Complexes | None, rough: bool = False) -> tuple[Complexes, int]:
        """Solve for readings (n, k); the products with K that it took follow."""
        tolerance = PASSING_TOLERANCE if self.passing else TOLERANCE
        if self._turns:
            tolerance *= BESIDE_ROTATIONS
        tolerance = ROUGH_TOLERANCE if rough else tolerance
        return solve_lines(self._apply, solve_one_by_one(self.passing, right), tolerance, start)


def at_mean_positions(model: HarmonicBalanceModel, interface: Interface, response: Response) -> Interface:
    """Return the meshes at the positions in their cycles that the mean of the vibration moves them to.

    Passing planets wind up the gear train of the GRC by 3e-5 rad: 5e-2 rad of the fifth harmonic of its fastest mesh.
    """
    ports = interface.ports
    moved = response.motion_at(np.s_[:1])[0].real @ ports.readings[:, POSITION].T
    means = np.array([wave.wave == 0 for wave in model.waves.waves])
    static = ports.static.copy()
    static[:, POSITION] += np.where(means, 0.0, moved)
    positions = ports.positions + np.where(means, moved, 0.0)
    return replace(interface, ports=replace(ports, positions=positions, static=static))


def given_forces(model: HarmonicBalanceModel, interface: Interface) -> Complexes:
    """Return the forces (n, m, f) of tangents at zero deflection in addition to the averaged system: of curves only."""
    waves = model.waves
    ports = interface.ports
    shape = len(model.lines.index), *ports.forces.shape[:2]
    if not (waves.loads.any() or model.shuttles):
        return np.zeros(shape, dtype=complex)
    products = _products_of_constants(model, model.cycles.given, ports, interface.speed, _everywhere(model, ports))
    products[0, :, DEFLECTION] += waves.mean_stiffness * waves.rest
    if model.shuttles:
        products[0, :, MISALIGNMENT] += model.cycles.varying_tilting[:, 2] * [wave.wave == 0 for wave in waves.waves]
    return products


def _response(
    model: HarmonicBalanceModel, interface: Interface, deflection: Complexes, forces: Complexes, products: int
) -> Response:
    """Complete a response with the whole forces of its meshes, those of mean stiffness and damping among them.

    `forces` (n, m f + c) are those beyond the averaged system.
    """
    waves = model.waves
    shape = interface.ports.forces.shape[:2]
    excess = forces[:, : shape[0] * shape[1]].reshape(len(forces), *shape)
    of_bearings = forces[:, shape[0] * shape[1] :]
    rates = rates_of(model, interface.speed, deflection)
    force = excess[..., DEFLECTION] + waves.mean_stiffness * deflection + waves.damping * rates
    force[0] -= waves.mean_stiffness * waves.rest
    force *= waves.line_of_action
    apart = np.zeros(len(waves.waves))
    return Response(interface, deflection, excess, force, products, apart, np.zeros(0), of_bearings)


def rates_of(model: HarmonicBalanceModel, speed: float, values: Complexes) -> Complexes:
    """Rates (n, m, ...) of what meshes read (n, m, ...), as the meshes see it that travel through the waves."""
    frequencies = abs(speed) * model.lines.orders.reshape(-1, *(1,) * (values.ndim - 1))
    partners = model.partners[: values.shape[1], : values.shape[1]]
    carried = np.moveaxis(np.tensordot(partners, values, axes=(1, 1)), 0, 1)
    return np.asarray(1j * frequencies * values + speed * carried)


def signals(model: HarmonicBalanceModel, response: Response) -> Complexes:
    """Coefficients (n, signals) of all signals of a response, in the order of `HarmonicBalanceModel.signal_names`."""
    interface = response.interface
    of_motion = interface.rows.of(response.motion, interface.frequencies)
    places = model.pin_places(interface.speed)
    for own in model.unequal_bearings:
        carrier = model.base_names.index(own.carrier)
        more = own.signals_at(model.lines, carrier, interface.speed, response.motion)
        of_motion[:, model.support_forces(own.supports).ravel()] += more
    if places.any():  # seats move with them; bearings are not strained
        moving = [name.quantity == "seat_acceleration" for name in interface.rows.names]
        of_motion[:, moving] += interface.rows.of(places, interface.frequencies)[:, moving]
    # Rows have the bearings of the mean system; what non-linear ones have beyond it acts on their bodies, too.
    if model.bearings is not None:
        beyond = response.excess[:, len(model.waves.waves) :, : model.bearing_signals.shape[1]]
        of_motion[:, model.bearing_signals] -= beyond
        tilted, moments = model.bearing_moments
        of_motion[:, moments] -= response.excess[:, len(model.waves.waves) + tilted, TILTS]
    levers = interface.ports.levers
    deflection = response.deflection
    if levers.any():
        deflection = deflection + response.motion @ levers[:, :-1].T
        deflection[0] += levers[:, -1]
    if model.shaft_orders.sidebands:
        deflection = deflection - model.deviations(interface.speed)
    found = [of_motion, deflection, response.force[:, model.waves.force_waves], _gear_loads(model, response)]
    if model.reacting_excitations:
        none = np.zeros((len(of_motion), BODY_SIZE * len(model.reacting_excitations)), dtype=complex)
        found.append(none if interface.loads is None else interface.loads.reactions)
    if model.radiated is not None:
        # A line of a coefficient c oscillates with the amplitude 2 c.
        velocity = model.radiated.surface_velocity(2.0 * response.motion, interface.frequencies)
        found.append((0.5 * velocity[:, None]).astype(np.complex128))
    return np.concatenate(found, axis=1)


def _gear_loads(model: HarmonicBalanceModel, response: Response) -> Complexes:
    """Find the forces and moments (n, 6 gears) of the meshes and their friction on gears that stand still.

    Of the model `table` only the forces along the line of action are included.
    """
    by_force, by_moment, _ = model.gear_load_rows
    found = response.force @ by_force + model.friction_on_gears(response.interface.speed)
    waves = model.waves
    tilt = waves.assembly.meshes.tilt[[wave.first for wave in waves.waves]]
    if by_moment.any() and tilt[:, TILT_STIFFNESS].any():
        turned = response.motion @ model.misalignments_at(response.interface.speed).T
        moment = tilt[:, TILT_STIFFNESS] * turned
        moment += tilt[:, TILT_DAMPING] * rates_of(model, response.interface.speed, turned)
        if model.shuttles:
            moment += response.excess[:, : len(waves.waves), MISALIGNMENT]
        found += moment @ by_moment
    return np.asarray(found)


def dissipated_and_given(model: HarmonicBalanceModel, response: Response) -> tuple[float, float]:
    """Return mean power dissipated by damping, and mean power supplied by the varying meshes, W.

    Both are equal in a steady state.
    """
    interface = response.interface
    motion = response.motion
    w = interface.frequencies[1:, None]
    moving = motion[1:]
    damping = model.system.damping_at(interface.speed)
    stiffness = model.system.stiffness_at(interface.speed)
    rates = 1j * w * moving
    # A stiffness that is not symmetric takes power, too. Matrices are real: so are the products with both parts.
    places = np.concatenate([moving.real, moving.imag])
    speeds = np.concatenate([rates.real, rates.imag])
    taken = 2.0 * float(np.sum(speeds * (speeds @ damping.T + places @ stiffness.T)))
    ports = interface.ports
    along = np.tensordot(rates, ports.forces, axes=(1, 2)) * model.weights[:, None]
    given = -2.0 * float(np.sum((response.excess[1:] * along.conj()).real))
    if response.of_bearings.size:
        given -= 2.0 * float(np.sum((response.of_bearings[1:] * rates[:, model.bearing_coordinates].conj()).real))
    if interface.loads is not None:
        given += 2.0 * float(np.sum((interface.loads.loads[1:] * rates.conj()).real))
    return taken, given


def exchanged_power(response: Response) -> float:
    """Power that loads beside the meshes exchange with the motion, in either sense and without regard to phase, W.

    Where a torque turns the free gear train near standstill it is many times what the dampers dissipate, so that the
    round-off of the stiffness is larger than these.
    """
    interface = response.interface
    if interface.loads is None:
        return 0.0
    rates = interface.frequencies[1:, None] * response.motion[1:]
    return 2.0 * float(np.sum(np.abs(interface.loads.loads[1:] * rates)))
