"""The averaged system: equations of motion in the rotating frame, linearised about the static state at speed.

    M u'' + C(W) u' + K(W) u = forces,   C and K quadratic in the speed W of the overall input

averaged over the positions of the carrier: static tilts that differ from planet to planet cause 5e-5 of variation in
the GRC. Gyroscopic, Coriolis and centrifugal terms are in C and K. They come from the assembly's own forces by central
differences, since these include every element; the parabolas through three speeds are exact.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import count
from typing import Any, TypeAlias, TypeVar

import numpy as np
import scipy.linalg

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Mesh
from exugear.steady.harmonics.linear_solvers import Batches, Elimination, elimination, solve_side_by_side
from exugear.steady.mean_system.displaced_pins import with_equal_pins
from exugear.steady.mean_system.planet_sets import PlanetSet, SteadyError, planet_sets
from exugear.steady.mean_system.rotating_frame import RotatingFrame
from exugear.steady.mean_system.symmetric_carriers import SymmetricCarrier, symmetric_carrier
from exugear.system.bearings.stiffness import load_stands_still, planet_supports, with_equal_planets
from exugear.system.modes import state_matrix
from exugear.system.statics import (
    RIGID_BODY_LIMIT,
    BalanceError,
    Linearised,
    linearise,
    static_state,
    tangent_stiffness,
)
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Complexes, Floats, Integers
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.processes import each_in_forks

Values = TypeVar("Values", Floats, Complexes)
Steps: TypeAlias = Callable[[str, int, int], None]
"""Called during a long preparation with its name, the number of finished steps, and the total; may raise to end it."""
PLACE_STEP, RATE_STEP = 1e-6, 1e-3
"""Steps of central differences by u and u'; forces are all but linear in the latter."""
ROWS_STEP = 1e-8
"""Step in u where rolling elements make forces nonlinear: barely loaded ones stiffen within a tenth of a micrometre.

A step ten times as long changes a frequency in the GRC by 3e-5, which is 2e-3 of the response near a lightly damped
mode."""
MOST_STEPS = 20
"""Steps of Newton's method to the static state."""
BALANCED = 1e-8
"""Residual over the largest load at which a state is balanced; the search continues as long as the residual falls."""
VARIATION = 2e-4
"""Largest change of stiffness over the carrier's angle that counts as none, over the stiffness.

Static tilts that are not the same for all planets bend the geometry by 5e-5 in the GRC; unequal planets bring 1e-3."""
ROWS_VARIATION = 2e-2
"""The same with nonlinear bearings and curved teeth: planets share the load unequally, more loaded ones are stiffer.

Shares rotate with the carrier's angle. In the GRC, whose sun is displaced radially, the variation is 8e-3, at three
times the carrier's frequency: orders change by less than 1e-3, and their sidebands are neglected."""


ROLLING = 2
"""Motions of free rolling: angle and speed."""


@dataclass(frozen=True, eq=False)
class MeanSystem(ReprMixin):
    """Averaged system of an assembly over speed."""

    frame: RotatingFrame
    speeds: Floats
    """(3,) speeds of the input at which it was linearised, rad/s."""
    mass: Floats
    """(size, size)"""
    damping: Floats
    stiffness: Floats
    """(3, size, size) C and K there."""
    static: Floats
    """(3, size) static coordinates u there."""
    torque: Floats
    """(3,) torque of the drive that keeps the speed, N m."""
    drive: Floats
    """(size,) generalized force of a unit of that torque."""
    pinned: int
    """Coordinate whose mean is zero: the spin of the overall input."""
    planet_spread: float
    """Largest change of planet bearings' stiffness that makes them equal, over that stiffness."""
    variation: float
    """Largest change of stiffness over the carrier's places, over the stiffness: its mean is taken. What a flexible
    ring gear and planets that are not alike bring is left out of it: their meshes are waves around the carrier."""
    over_angles: tuple[tuple[Floats, Floats], ...] = ()
    """C (p, size, size) and K (3, p, size, size) less those at zero angle of a carrier, at p of its angles that are
    evenly spread over the passing of a planet, or of two; for each carrier with whose angle they vary."""

    damper_factor: float = 1.0
    """Factor on the dampers of meshes and bearings, which the damping has in it: of another end of its range."""

    def _line(self) -> str:
        return f": {self.size} coordinates, {self.speeds.min():.4g} to {self.speeds.max():.4g} rad/s"

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.mass)

    @cached_property
    def rolling(self) -> Floats:
        """Velocity (size,) of free rolling in the rotating frame, at unit speed of the input."""
        turning = self.frame.assembly.rolling_velocity(np.zeros(self.size), self.frame.speeds)
        return np.asarray(np.linalg.solve(self.frame.matrices(0.0)[0], turning))

    @property
    def frozen(self) -> MeanSystem:
        """The system with the carriers held at zero angle; itself where stiffness does not vary with their angle.

        The frequencies of the averaged system are higher than those at any angle, by 5 % at most in the GRC with a
        flexible ring gear, since it has springs all around the ring.
        """
        return next(self.at_angles()) if self.over_angles else self

    def at_angles(self) -> Iterator[MeanSystem]:
        """Systems with carriers held, one of them at the angles of a planet passage and others at zero angle.

        None where stiffness does not vary. The first is that with all of them at zero angle.
        """
        damping, stiffness = self.damping, self.stiffness
        for dampings, stiffnesses in self.over_angles:
            damping = damping - dampings.mean(axis=0)
            stiffness = stiffness - stiffnesses.mean(axis=1)
        for number, (dampings, stiffnesses) in enumerate(self.over_angles):
            for place in range(min(number, 1), len(dampings)):
                held = damping + dampings[place], stiffness + stiffnesses[:, place]
                yield replace(self, damping=held[0], stiffness=held[1], over_angles=())

    @cached_property
    def _parabola(self) -> Floats:
        """From values at the three speeds to coefficients of 1, W, W^2."""
        return np.asarray(np.linalg.inv(np.vander(self.speeds, 3, increasing=True)))

    def at(self, values: Values, speed: float) -> Values:
        """Value (...) at a speed (rad/s) of what is known at the three, (3, ...): exact for parabolas."""
        weights = np.array([1.0, speed, speed**2]) @ self._parabola
        found: Values = (weights @ values.reshape(len(weights), -1)).reshape(values.shape[1:])
        return found

    @cached_property
    def elements(self) -> Linearised:
        """Matrices of all elements in the static state at the middle one of the speeds."""
        q, _, _ = self.frame.state(0.0, float(self.speeds[1]), self.static[1])
        return linearise(self.frame.assembly, q, self.frame.mean_meshes)

    def stiffness_at(self, speed: float) -> Floats:
        """K (size, size) at a speed of the input, rad/s."""
        return self.at(self.stiffness, speed)

    def damping_at(self, speed: float) -> Floats:
        """C (size, size) at a speed of the input, rad/s."""
        return self.at(self.damping, speed)

    def static_at(self, speed: float) -> Floats:
        """Coordinates u (size,) of the static state at a speed of the input, rad/s."""
        return self.at(self.static, speed)

    def torque_at(self, speed: float) -> float:
        """Torque of the drive at a speed of the input (rad/s), N m."""
        return float(self.at(self.torque, speed))

    @cached_property
    def _plan(self) -> Elimination:
        """How dynamic stiffnesses are eliminated: bodies touch each other at few coordinates."""
        return elimination((self.mass != 0.0) | (self.damping != 0.0).any(axis=0) | (self.stiffness != 0.0).any(axis=0))

    def fill_responses(
        self,
        pencil: tuple[Floats, Floats],
        frequencies: Floats,
        loads: Floats,
        own: Complexes,
        batches: Batches,
        out: Complexes,
    ) -> None:
        """Fill amplitudes (lines, size, n) under unit loads (size, n) at angular frequencies (lines,), not zero.

        The pencil is stiffness and damping at a speed. Loads of each line by itself (lines, size) become the amplitudes
        under them. Unit loads that do not act on a line have no amplitudes there.
        """
        solve_side_by_side(self._plan, (*pencil, self.mass), frequencies, loads, own, batches, out)

    def dynamic(self, speed: float, frequency: float) -> Complexes:
        """Dynamic stiffness (size, size) at a speed of the input and an angular frequency, rad/s."""
        stiffness = self.stiffness_at(speed) - frequency**2 * self.mass
        return np.asarray(stiffness + 1j * frequency * self.damping_at(speed))

    def still(self, stiffness: Floats, loads: Floats) -> Floats:
        """Find static deflections under loads (size, n), and in the last row the torque of the drive that they need.

        The train is free to roll: the mean angle of the input stays, and the drive takes what a load would turn.
        """
        n = self.size
        bordered = np.zeros((n + 1, n + 1))
        bordered[:n, :n], bordered[:n, n], bordered[n, self.pinned] = stiffness, -self.drive, 1.0
        # Rows of torque and stiffness differ by ten orders of magnitude.
        size = np.sqrt(np.abs(np.diag(stiffness)).clip(min=1.0))
        scale = np.append(1.0 / size, 1.0)
        reach = float(np.abs(scale[:n] * self.drive).max())
        columns = np.append(scale[:n], 1.0 / reach)
        solved = np.linalg.solve(
            scale[:, None] * bordered * columns, scale[:, None] * np.vstack([loads, np.zeros((1, loads.shape[1]))])
        )
        return np.asarray(columns[:, None] * solved)

    def eigenvalues(self, speed: float) -> Complexes:
        """Eigenvalues of the averaged system at a speed of the input, 1/s; free rotation among them."""
        matrix = state_matrix(self.mass, self.damping_at(speed), self.stiffness_at(speed))
        return np.asarray(scipy.linalg.eigvals(matrix))


def mean_system(assembly: Assembly, speeds: Floats, prepared: Steps | None = None) -> MeanSystem:
    """Linearise an assembly about its static states at speeds of the overall input.

    Parameters
    ----------
    speeds : rad/s; the system holds between the lowest and the highest
    prepared : called with the steps of the linearisation

    Raises
    ------
    SteadyError
        Its matrices are not constant in the rotating frame, and why.
    BalanceError
        The static load has no equilibrium.
    """
    _check(assembly)
    sets = planet_sets(assembly)
    assembly = with_equal_pins(assembly, sets)
    # Catalogue bearings of planets are equal already: this changes anisotropic matrices of the file.
    supports = [own for planets in sets for own in planet_supports(assembly.supports, planets.names, planets.angles)]
    connectors, spread = with_equal_planets(assembly.connectors, supports)
    assembly = replace(assembly, connectors=connectors)
    frame = rotating_frame(assembly, sets)
    case = assembly.gearbox.case
    # The degree of freedom locked in the file holds the speed: its torque balances the others.
    keeper = assembly.gearbox.locked[0] if assembly.gearbox.locked else case.overall.input
    drive = assembly.torque_vector({keeper: 1.0})
    load = assembly.torque_vector(case.static_load.torques_N_m)
    low = float(np.min(speeds))
    high = float(np.max(speeds))
    low, high = (low, high) if high > low else (low - 0.5 * abs(low), high + 0.5 * abs(high))
    at = np.array([low, 0.5 * (low + high), high])
    # The first guess is the static state at standstill, rotated back to zero angle of the input.
    pinned = assembly.spin[case.overall.input]
    q = static_state(assembly).q
    rolling = assembly.rolling_velocity(np.zeros(assembly.size), frame.speeds)
    u = np.asarray(np.linalg.solve(frame.matrices(0.0)[0], q - q[pinned] * rolling))
    torque = 0.0
    rows = []
    matrix = None
    turned = [(own, frame.places_of(name)) for name, own in frame.by_carrier]
    if sets and not turned:
        turned = [(frame, frame.places)]
    total = len(at) + sum(len(places) - 1 for _, places in turned)
    done = count(1)

    def report() -> None:
        if prepared is not None:
            prepared("linearisation", next(done), total)

    for speed in at:
        u, torque = _static(frame, float(speed), drive, load, u, torque, matrix)
        damping, matrix = tangents(frame, 0.0, float(speed), u)
        rows.append((u, torque, damping, matrix))
        report()
    static, torques, dampings, stiffnesses = (np.array(values) for values in zip(*rows, strict=True))
    mass = _mass(frame, 0.0, static[1])
    variation = 0.0
    over_angles = []
    masses = []
    here = mass, dampings[1], stiffnesses
    for own, places in turned:
        changes, largest = _changes_over_places(own, places, at, static, here, report)
        variation = max(variation, largest)
        masses.append(changes[0].mean(axis=0))
        dampings = dampings + changes[1].mean(axis=0)
        stiffnesses = stiffnesses + changes[2].mean(axis=1)
        over_angles.append(changes[1:])
    if masses:
        mass = mass + np.mean(masses, axis=0)
    return MeanSystem(
        frame,
        at,
        mass,
        dampings,
        stiffnesses,
        static,
        torques,
        drive,
        pinned,
        max(spread, assembly.planet_spread),
        variation,
        tuple(over_angles) if frame.varying_carriers else (),
    )


def rotating_frame(assembly: Assembly, sets: tuple[PlanetSet, ...]) -> RotatingFrame:
    """Return the rotating frame of an assembly with equal planets, its flexible carriers made symmetric.

    Raises
    ------
    SteadyError
        A flexible carrier is not symmetric, or has planets of different numbers; planets that are not alike are on
        several carriers, or have nonlinear bearings.
    """
    carriers: dict[str, SymmetricCarrier] = {}
    for planets in sets:
        body = assembly.elastic_bodies.get(planets.carrier)
        if body is None:
            continue
        known = carriers.get(planets.carrier)
        if known is None:
            axis = next(body.axis for body in assembly.bodies if body.name == planets.carrier)
            carriers[planets.carrier] = symmetric_carrier(planets.carrier, body.reduced, planets, axis)
        elif known.planets.waves != planets.waves:
            raise SteadyError(
                f"bodies.{planets.carrier}: flexible with {known.planets.waves} and {planets.waves} planets, so its "
                "stiffness is not constant in the fixed frame; set flexibility = 'none', or use exugear run"
            )
    symmetric = {
        name: replace(body, reduced=carriers[name].body) if name in carriers else body
        for name, body in assembly.elastic_bodies.items()
    }
    frame = RotatingFrame(replace(assembly, elastic_bodies=symmetric), sets, tuple(carriers.values()))
    _check_varying(frame)
    return frame


def _check_varying(frame: RotatingFrame) -> None:
    """Refuse planets that are not alike on several carriers, or whose bearings are not linear."""
    unlike = sorted({planets.carrier for planets in frame.sets if planets.is_single})
    if len(unlike) > 1:
        raise SteadyError(
            f"bodies.{', bodies.'.join(unlike)}: planets that are fewer than three or unequally spaced on several "
            "carriers, which the steady-state response cannot treat; use exugear run"
        )
    rows = np.diff(frame.assembly.connectors.rolling.first)
    for n in (n for carrier in unlike for n in frame.varying_bearings(carrier)):
        if rows[n]:
            raise SteadyError(
                f"bearings.{frame.assembly.supports[n].family}.model = 'iso16281': on planets that are fewer than "
                "three or unequally spaced, which the steady-state response cannot treat; set model = 'linear', or "
                "use exugear run"
            )


def unsuitable(assembly: Assembly, elastic: Collection[str] = ()) -> str:
    """Return why this package cannot compute the steady-state response of an assembly; empty if it can.

    Parameters
    ----------
    elastic : bodies that are flexible in another variant, but not in this one
    """
    try:
        _check(assembly)
        _check_varying(RotatingFrame(assembly, planet_sets(assembly)))
        _check_ring(assembly, elastic)
    except SteadyError as error:
        return str(error)
    planets = {body.name for body in assembly.bodies if body.carrier is not None}
    return ", ".join(
        f"bodies.{name}: flexible planets need exugear run, or flexibility = 'none'"
        for name in elastic
        if name in planets
    )


def _check(assembly: Assembly) -> None:
    """Refuse what has no constant matrices, or no single speed."""
    gearbox = assembly.gearbox
    if gearbox.train.degrees_of_freedom != 1:
        raise SteadyError(
            f"the gear train has {gearbox.train.degrees_of_freedom} degrees of freedom; the steady-state response "
            "requires one: fix a body or couple two"
        )
    if not gearbox.meshes and not gearbox.varying_loads:
        raise SteadyError("the train has no meshes and no [excitations]; add an excitation, or use exugear run")
    _check_ring(assembly, assembly.elastic_bodies)
    # Rows of rolling elements must neither pass nor turn against the load that they carry.
    rolling = assembly.connectors.rolling
    bodies = {body.name: body for body in gearbox.bodies()}
    for n in np.flatnonzero(np.diff(rolling.first)):
        support = assembly.supports[n]
        if rolling.cage_ratio[n]:
            raise SteadyError(
                f"bearings.{support.family}.cage = 'turning': ball-pass excitation, which the steady-state response "
                "cannot treat; set cage = 'averaged', or use exugear run"
            )
        if not load_stands_still(support, bodies):
            raise SteadyError(
                f"bearings.{support.family}.model = 'iso16281': its elements rotate with {support.on} relative to the "
                "load, which the steady-state response cannot treat; set model = 'linear', or use exugear run"
            )


def _check_ring(assembly: Assembly, elastic: Collection[str]) -> None:
    """Refuse flexible ring gears whose meshes cannot be written as waves around carriers."""
    gearbox = assembly.gearbox
    travelling = [mesh for mesh in gearbox.meshes if mesh.gear in elastic and _has_sectors(gearbox, mesh)]
    if not travelling:
        return
    for mesh in travelling:
        body = gearbox.body(mesh.gear)
        if not body.fixed:
            raise SteadyError(
                f"bodies.{body.family}: the flexible ring gear rotates, which the steady-state response cannot treat "
                f"yet; set flexibility = 'none' for bodies.{body.family}, or use exugear run"
            )


def _has_sectors(gearbox: Gearbox, mesh: Mesh) -> bool:
    """Whether a mesh travels around the sectors of its gear where this is flexible."""
    section = gearbox.case.bodies[gearbox.body(mesh.gear).family]
    name = mesh.pair.gear.name
    if section.external is not None:
        return name in section.external.seats and bool(section.external.seats[name].sector_nodes)
    seat = None if section.solid is None else section.solid.seats.get(name)
    return seat is not None and seat.sectors is not None


def tangents(frame: RotatingFrame, psi: float, speed: float, u: Floats) -> tuple[Floats, Floats]:
    """Damping and stiffness (size, size) in the frame, about the coordinates u at the input's angle psi.

    The input turns at `speed` (rad/s).
    """
    return _damping(frame, psi, speed, u), _stiffness(frame, psi, speed, u)


def _damping(frame: RotatingFrame, psi: float, speed: float, u: Floats) -> Floats:
    here = np.tile(u, (len(u), 1))
    return _slopes(lambda steps: _residuals(frame, psi, speed, here, steps), len(u), RATE_STEP)


def _stiffness(frame: RotatingFrame, psi: float, speed: float, u: Floats) -> Floats:
    step = place_step(frame.assembly)
    return _slopes(lambda steps: _residuals(frame, psi, speed, u + steps, None), len(u), step)


def _stiffness_at_rest(frame: RotatingFrame, psi: float, u: Floats) -> Floats:
    """Stiffness (size, size) in the frame about the coordinates u: without what the rotation adds, which is little."""
    q = frame.state(psi, 0.0, u)[0]
    t = frame.matrices(psi)[0]
    return np.asarray(t.T @ tangent_stiffness(frame.assembly, q, frame.mean_meshes) @ t)


def _mean_stiffness(frame: RotatingFrame, speed: float, u: Floats) -> Floats:
    """Mean stiffness (size, size) over the angles of carriers; what the rotation adds is that at zero angle."""
    here = _stiffness(frame, 0.0, speed, u)
    if not frame.varying_carriers:
        return here
    return here + frame.mean(lambda own, psi: _stiffness_at_rest(own, psi, u)) - _stiffness_at_rest(frame, 0.0, u)


def place_step(assembly: Assembly) -> float:
    """Step of central differences of forces by places, m and rad."""
    return ROWS_STEP if assembly.has_rows else PLACE_STEP


def _mass(frame: RotatingFrame, psi: float, u: Floats) -> Floats:
    """Mass (size, size) in the frame: what accelerations need, which is linear in them."""
    assembly = frame.assembly
    t = frame.matrices(psi)[0]
    q, v, a = frame.state(psi, 0.0, u)
    still = assembly.inertia_forces(q, v, a)
    return np.asarray(t.T @ (assembly.inertia_forces(q, v, a + t.T) - still).T)


def _residuals(frame: RotatingFrame, psi: float, speed: float, u: Floats, du: Floats | None) -> Floats:
    """Generalized forces (n, size) in the frame that inertia needs, less those that elements give.

    At several coordinates and velocities (n, size) at once: bearings have much in common.
    """
    assembly = frame.assembly
    t = frame.matrices(psi)[0]
    q, v, a = frame.state(psi, speed, u, du)
    return np.asarray((assembly.inertia_forces(q, v, a) - assembly.forces(q, v, frame.mean_meshes)) @ t)


def _residual(frame: RotatingFrame, psi: float, speed: float, u: Floats) -> Floats:
    """Generalized forces (size,) at one set of coordinates, as `_residuals` has them."""
    return np.asarray(_residuals(frame, psi, speed, u[None], None)[0])


def _slopes(function: Callable[[Floats], Floats], size: int, step: float) -> Floats:
    """Take derivatives (size, size) by central differences of a function of several steps (n, size) at once."""
    steps = step * np.eye(size)
    return np.asarray((function(steps) - function(-steps)).T / (2.0 * step))


def _static(
    frame: RotatingFrame,
    speed: float,
    drive: Floats,
    load: Floats,
    u: Floats,
    torque: float,
    matrix: Floats | None,
) -> tuple[Floats, float]:
    """Find the static state at a speed, and the torque that keeps it; `matrix` is the stiffness at another speed.

    Where stiffness varies with carriers, the mean of the forces over their angles is in balance.
    """
    n = len(u)
    assembly = frame.assembly
    pinned = assembly.spin[assembly.gearbox.case.overall.input]
    t0 = frame.matrices(0.0)[0]
    drive = t0.T @ drive
    load = t0.T @ load
    largest = max(1.0, float(np.abs(load).max()))
    best = before = np.inf
    bordered = np.zeros((n + 1, n + 1))
    for _ in range(MOST_STEPS):
        held = frame.mean(partial(_residual, speed=speed, u=u))
        missing = held - load - torque * drive
        error = float(np.abs(np.append(missing, largest * u[pinned])).max()) / largest
        if not error < np.inf or (best < BALANCED and error > 0.5 * best):
            break
        best = min(best, error)
        # The elements are all but linear: one matrix serves for several steps.
        if matrix is None or error > 0.1 * before:
            matrix = _mean_stiffness(frame, speed, u)
        before = error
        bordered[:n, :n], bordered[:n, n], bordered[n, pinned] = matrix, -drive * largest, largest
        step = np.linalg.solve(bordered, -np.append(missing, largest * u[pinned]))
        u = u + step[:n]
        torque = torque + largest * float(step[n])
    if not best < BALANCED:
        raise BalanceError(f"static state at {speed:.4g} rad/s: the residual remains at {best:.1e} of the load")
    return u, torque


def _changes_over_places(
    frame: RotatingFrame,
    places: Floats,
    speeds: Floats,
    static: Floats,
    here: tuple[Floats, Floats, Floats],
    report: Callable[[], None],
) -> tuple[tuple[Floats, Floats, Floats], float]:
    """M and C (places, size, size) and K (3, places, size, size) at angles of the input (rad) less those at the first.

    These are given of the whole gearbox (`here`), and so are the static states (3, size) at the speeds. M and C are the
    same at all speeds. K is linear in the speed where dampers travel around what varies, and else the same. The last
    result is the largest change of K over the places, over K, without what is known to vary: see
    `RotatingFrame.without_varying`. `report` is called after each place.

    Raises
    ------
    SteadyError
        The stiffness changes as the carrier turns.
    """
    speed, u = float(speeds[1]), static[1]
    mass, damping, stiffness = here
    if frame.without:
        damping = _damping(frame, 0.0, speed, u)
        ends = [_stiffness(frame, 0.0, float(speeds[n]), static[n]) for n in (0, 2)]
        stiffness = np.array([ends[0], stiffness[1], ends[1]])
    masses, dampings = np.zeros((2, len(places), *mass.shape))
    stiffnesses = np.zeros((3, len(places), *mass.shape))
    largest = 0.0
    curved = any(element.is_curved for element in frame.assembly.elements)
    most = ROWS_VARIATION if frame.assembly.has_rows or curved else VARIATION
    without = frame.without_varying
    still = stiffness[1] if without is frame else _stiffness_at_rest(without, 0.0, u)
    size = np.sqrt(np.abs(np.diag(stiffness[1])).clip(min=1e-3 * np.abs(np.diag(stiffness[1])).max()))

    def at_place(psi: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Return changes of M, C (n, n) and K (3, n, n) at an angle, and K without what is known to vary."""
        changes = np.zeros((3, *mass.shape))
        if without is frame:
            turned = _stiffness(frame, psi, speed, u)
            changes[:] = turned - stiffness[1]
        else:
            turned = _stiffness_at_rest(without, psi, u)
            for n in (0, 2):
                changes[n] = _stiffness(frame, psi, float(speeds[n]), static[n]) - stiffness[n]
            changes[1] = 0.5 * (changes[0] + changes[2])
        return _mass(frame, psi, u) - mass, _damping(frame, psi, speed, u) - damping, changes, turned

    for place, found in enumerate(each_in_forks(at_place, places[1:].tolist()), start=1):
        masses[place], dampings[place], stiffnesses[:, place], turned = found
        change = float(np.abs((turned - still) / np.outer(size, size)).max())
        if change > most:
            raise SteadyError(
                f"the stiffness varies by {100.0 * change:.2g} % over a carrier revolution (unequal planets, or a "
                "support that rotates with them), which the steady-state response cannot treat; use exugear run instead"
            )
        largest = max(largest, change)
        report()
    return (masses, dampings, stiffnesses), largest


def most_rolling(system: MeanSystem, shapes: Complexes) -> Integers:
    """Return which of some shapes (size, n), by columns, have the largest share of rolling in their energy."""
    along = system.mass @ system.rolling
    energy = np.sqrt(np.abs(np.sum(shapes.conj() * (system.mass @ shapes), axis=0)))
    return np.asarray(np.argsort(-np.abs(along @ shapes) / np.maximum(energy, 1e-300))[:ROLLING])


# Modes of the mean system at one speed: eigenvalues with right and left shapes, gyroscopic and damped as it is


def mean_modes(system: MeanSystem, speed: float) -> tuple[Complexes, Complexes, Complexes]:
    """Vibrations of an averaged system at a speed of the input (rad/s), as `vibrations` gives them."""
    return vibrations(system.mass, system.damping_at(speed), system.stiffness_at(speed))


def vibrations(mass: Floats, damping: Floats, stiffness: Floats) -> tuple[Complexes, Complexes, Complexes]:
    """Eigenvalues (n,) of M u'' + C u' + K u = 0 with positive frequency, and right and left shapes (n, 2 size).

    Left shapes are scaled so that the response to a load b at the angular frequency w is the sum of
    right (left . [0, M^-1 b]) / (i w - eigenvalue). Free rolling and overdamped motions are left out.

    Parameters
    ----------
    mass, damping, stiffness : (size, size)

    Examples
    --------
    >>> values, _, _ = vibrations(np.eye(2), np.zeros((2, 2)), np.diag([100.0, 400.0]))
    >>> values.imag.round(6)
    array([10., 20.])
    """
    found: Any = scipy.linalg.eig(state_matrix(mass, damping, stiffness), left=True, right=True)
    values, left, right = found
    kept = values.imag > 2.0 * np.pi * RIGID_BODY_LIMIT
    kept &= np.abs(values.imag) > np.abs(values.real)
    order = np.flatnonzero(kept)[np.argsort(values[kept].imag)]
    right = right[:, order].T
    left = left[:, order].conj().T
    # Left shapes of a repeated eigenvalue are any basis of their space: they become the partners of the right ones.
    partners: Complexes = np.linalg.solve(left @ right.T, left).astype(np.complex128)
    return values[order], right, partners
