"""Bearings of planets that are not alike: what they have beyond the averaged system as the carrier turns.

The averaged system has equal planets. Where displaced pins share the load unequally, the tangent of a catalogue bearing
at its load differs from planet to planet; planets that are fewer than three or unequally spaced have no mean that is
the same at all angles. In the frame of the carrier the difference stands still,

    T'(psi) f(T(psi) u, T(psi) u') = sum_l e^(i l psi) (b_l + A_l u + B_l u'),

so that the static state has forces b_l at multiples of the carrier's rotation, and each line of the response acts on
those beside it. Their forces are solved with those of the meshes (`exugear.steady.balance.passing_planets`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from exugear.steady.harmonics.lines import LineSet
from exugear.steady.mean_system.mean_system import RATE_STEP, MeanSystem, place_step
from exugear.steady.mean_system.planet_sets import PlanetSet
from exugear.steady.mean_system.signals import support_waves
from exugear.system.kernels.connectors import ConnectorArrays, add_connector_forces, connector_loads
from exugear.system.kernels.coordinates import BODY_SIZE
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers

LEAST = 1e-9
"""Share of the largest coefficient of a series below which one is zero but for round-off."""
ROUND_OFF = 1e-6
"""Share of the stiffness along a coordinate below which its variation is one of second order, or round-off."""
VARYING_SAMPLES = 9
"""Places of the carrier for planets that are not alike: their stiffness has harmonics up to the second."""
AXES = 3
"""Components of a force."""


@dataclass(frozen=True, eq=False)
class UnequalBearings:
    """Forces of bearings of the planets of one carrier beyond those in the averaged system.

    Series over t multiples of the carrier's angle, of c coordinates of the rotating frame and r signals. Values hold
    where the input turns about +z; where it turns about -z, they are the conjugates.
    """

    carrier: str
    sense: int
    """1 of a carrier that turns as the input does, else -1."""
    turns: Integers
    """(t,) multiples of its angle."""
    coordinates: Integers
    """(c,) that the bearings connect."""
    supports: Integers
    """(s,) numbers of the supports, with three signals each: r = 3 s."""
    still: Complexes
    """(t, c) generalized forces in the static state, N and N m."""
    stiffness: Complexes
    damping: Complexes
    """(t, c, c) derivatives of the generalized forces."""
    signals_still: Complexes
    """(t, r) forces on their bodies in the static state, as the signals `support_force`, N."""
    signals_stiffness: Complexes
    signals_damping: Complexes
    """(t, r, c) derivatives of these."""

    @property
    def most(self) -> int:
        """Largest multiple of the carrier's angle."""
        return int(np.abs(self.turns).max())

    def with_dampers(self, factor: float) -> UnequalBearings:
        """Return the same with dampers multiplied by a factor."""
        if factor == 1.0:
            return self
        return replace(self, damping=factor * self.damping, signals_damping=factor * self.signals_damping)

    def functions_at(self, speed: float) -> tuple[Complexes, Complexes]:
        """Stiffness and damping (2 t + 1, c, c) at multiples -t .. t of the base of the carrier, at an input speed.

        They give forces that the bodies feel in the opposite sense, as those of meshes.
        """
        found = np.zeros((2, 2 * self.most + 1, *self.stiffness.shape[1:]), dtype=complex)
        found[:, self.sense * self.turns + self.most] = -self.stiffness, -self.damping
        return (found[0], found[1]) if speed > 0.0 else (found[0].conj(), found[1].conj())

    def _places(self, lines: LineSet, carrier: int) -> tuple[Integers, Integers, Booleans]:
        """Multiples of the bases (t, bases) at the carrier's turns, and the lines of those (t,) that are among them."""
        shift = np.zeros((len(self.turns), lines.index.shape[1]), dtype=np.int64)
        shift[:, carrier] = self.sense * self.turns
        places, mirrored = lines.find(shift)
        there = (places >= 0) & ~mirrored
        return shift, places[there], there

    def still_at(self, lines: LineSet, carrier: int, speed: float) -> Complexes:
        """Find forces (n, c) of the static state at lines, in that sense; `carrier` is its place among the bases."""
        _, places, there = self._places(lines, carrier)
        found = np.zeros((len(lines.index), len(self.coordinates)), dtype=complex)
        np.add.at(found, places, -self.still[there])
        return found if speed > 0.0 else found.conj()

    def signals_at(self, lines: LineSet, carrier: int, speed: float, motion: Complexes) -> Complexes:
        """Find signals (n, r) of a motion, with those of the static state, at lines.

        Parameters
        ----------
        carrier : place of the carrier among the bases
        speed : of the input, rad/s
        motion : (n, size) about the static state
        """
        shift, places_still, there = self._places(lines, carrier)
        rows = lines.index - shift[:, None, :]
        places, mirrored = lines.find(rows)
        moving = motion[places][..., self.coordinates] * (places >= 0)[..., None]
        moving = np.where(mirrored[..., None], moving.conj(), moving)
        rates = 1j * abs(speed) * (rows @ lines.bases)[..., None] * moving
        slopes = self.signals_still, self.signals_stiffness, self.signals_damping
        still, by_place, by_rate = slopes if speed > 0.0 else (own.conj() for own in slopes)
        found = np.einsum("trc,tnc->nr", by_place, moving) + np.einsum("trc,tnc->nr", by_rate, rates)
        np.add.at(found, places_still, still[there])
        found[0] = found[0].real
        return np.asarray(found)


def varying_bearings(system: MeanSystem, carrier: str) -> UnequalBearings | None:
    """Find what the bearings of planets that are not alike have beyond their mean over a carrier's angle, if any."""
    frame = system.frame
    numbers = frame.varying_bearings(carrier)
    if not numbers.size:
        return None
    given = frame.assembly.connectors.chosen(numbers)
    none = given.without_forces(np.arange(len(numbers)))
    planets = next(planets for planets in frame.sets if planets.carrier == carrier)
    found = _series(system, (given, none), planets, numbers, VARYING_SAMPLES)
    turning = found.turns != 0
    # Directions that do not vary, such as along the axis, are none of its coordinates.
    sizes = np.abs(found.stiffness[turning])
    of_coordinates = sizes.max(axis=(0, 1)) > ROUND_OFF * np.abs(found.stiffness).max(axis=(0, 1))
    return replace(
        found,
        turns=found.turns[turning],
        coordinates=found.coordinates[of_coordinates],
        still=found.still[turning][:, of_coordinates],
        stiffness=found.stiffness[turning][:, of_coordinates][:, :, of_coordinates],
        damping=system.damper_factor * found.damping[turning][:, of_coordinates][:, :, of_coordinates],
        signals_still=found.signals_still[turning],
        signals_stiffness=found.signals_stiffness[turning][..., of_coordinates],
        signals_damping=system.damper_factor * found.signals_damping[turning][..., of_coordinates],
    )


def unequal_bearings(assembly: Assembly, system: MeanSystem, planets: PlanetSet) -> UnequalBearings | None:
    """Find what the bearings of a set of planets have beyond their mean; None where they are equal.

    Parameters
    ----------
    assembly : with bearings as they are
    system : its averaged system
    """
    frame = system.frame
    numbers = np.flatnonzero([support.body in planets.names for support in assembly.supports])
    equal = frame.assembly.connectors.chosen(numbers)
    given = assembly.connectors.chosen(numbers)
    laws = {name: getattr(given, name) for name in ("stiffness", "damping", "point_strain", "point_load")}
    if all(np.array_equal(own, getattr(equal, name)) for name, own in laws.items()):
        return None
    both = equal._replace(**laws), equal
    found = _series(system, both, planets, numbers, 4 * (planets.waves // 2 + 1) + 1)
    return found if found.turns.size else None


def _series(
    system: MeanSystem,
    both: tuple[ConnectorArrays, ConnectorArrays],
    planets: PlanetSet,
    numbers: Integers,
    samples: int,
) -> UnequalBearings:
    """Series of what the first bearings have beyond the second, from a number of places of the carrier."""
    bodies = both[0].bodies
    coordinates = np.unique(bodies[bodies >= 0][:, None] + np.arange(BODY_SIZE))
    angles = 2.0 * np.pi * np.arange(samples) / samples
    parts = [_beyond_mean(system, both, angle / planets.ratio, coordinates, numbers) for angle in angles.tolist()]
    count = len(coordinates)
    series = [np.fft.fft(values, axis=0) / samples for values in zip(*parts, strict=True)]
    most = samples // 2
    turns = np.arange(-most, most + 1)
    still, stiffness, damping = (values[turns] for values in series)
    sizes = np.abs(stiffness).max(axis=(1, 2))
    kept = (sizes > LEAST * sizes.max()) | (np.abs(still).max(axis=1) > LEAST * np.abs(still).max())
    still, stiffness, damping = (values[kept] for values in (still, stiffness, damping))
    return UnequalBearings(
        carrier=planets.carrier,
        sense=int(math.copysign(1.0, planets.ratio)),
        turns=turns[kept],
        coordinates=coordinates,
        supports=numbers,
        still=still[:, :count],
        stiffness=stiffness[:, :count],
        damping=damping[:, :count],
        signals_still=still[:, count:],
        signals_stiffness=stiffness[:, count:],
        signals_damping=damping[:, count:],
    )


def _beyond_mean(
    system: MeanSystem,
    both: tuple[ConnectorArrays, ConnectorArrays],
    psi: float,
    coordinates: Integers,
    numbers: Integers,
) -> tuple[Floats, Floats, Floats]:
    """Find forces (c + r,) of bearings beyond those of equal ones, and their derivatives (c + r, c) by place and rate.

    At an angle psi of the input (rad), in the static state. Behind generalized forces there are those on the bodies, as
    the signals have them.
    """
    frame = system.frame
    speed = float(system.speeds[1])
    u = system.static_at(speed)
    units = np.eye(system.size)[coordinates]
    step = place_step(frame.assembly)
    changes = np.concatenate([0.0 * units[:1], step * units, -step * units])
    rates = np.concatenate([RATE_STEP * units, -RATE_STEP * units])
    du = np.concatenate([0.0 * changes, rates])
    q, v, _ = frame.state(psi, speed, u + np.concatenate([changes, 0.0 * rates]), du)
    forces = np.zeros((2, *q.shape))
    for own, connectors in zip(forces, both, strict=True):
        add_connector_forces(q, v, connectors, own)
    loads = np.zeros((2, len(q), AXES * len(numbers)))
    for own, connectors in zip(loads, both, strict=True):
        own[:] = -connector_loads(q, v, connectors)[..., :AXES].reshape(len(q), -1)
    entries = (AXES * numbers[:, None] + np.arange(AXES)).ravel()
    turn = support_waves(frame.assembly, frame.sets, psi)[0][np.ix_(entries, entries)]
    generalized = ((forces[0] - forces[1]) @ frame.matrices(psi)[0])[:, coordinates]
    found = np.hstack([generalized, (loads[0] - loads[1]) @ turn.T])
    count = len(coordinates)
    ahead, back, faster, slower = (found[1 + n * count : 1 + (n + 1) * count] for n in range(4))
    return found[0], (ahead - back).T / (2.0 * step), (faster - slower).T / (2.0 * RATE_STEP)
