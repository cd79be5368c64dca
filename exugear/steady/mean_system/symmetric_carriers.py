"""Flexible planet carriers that are equal under a turn by one planet, as their constant matrices in the frame need it.

A carrier with N equal, equally spaced planets is the same after a turn S by 2 pi / N: its seats take each other's
places, and its modal coordinates are mixed by an orthogonal matrix S_i. The mesh of a solid is not quite so symmetric.
The mean of its matrices A over all turns,

    A_mean = 1/N sum_k S^k' A S^k,

is. S_i follows from the coupling of modal coordinates with those of the seats, M_is S_s = S_i M_is, as the orthogonal
matrix nearest to it (Schoenemann 1966, Psychometrika 31). Its eigenvalues e^(i 2 pi m / N) give each pair of modal
coordinates a wave number m around the carrier, as the components of planets have one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from exugear.steady.mean_system.planet_sets import Jet, PlanetSet, SteadyError
from exugear.system.bodies.reduction import ReducedBody
from exugear.system.kernels.coordinates import BODY_SIZE, TILT
from fe_ste.tools.arrays import Floats, Integers

SAME_PLACE = 1e-3
"""Distance of seats from the places of a regular polygon, over their distance from the axis."""
MAX_SPREAD = 0.05
"""Largest relative change of a carrier's matrices by which it may be made symmetric.

The carrier of the GRC, meshed with 92,000 unknowns, changes by 1.2 %: its gearbox's frequencies by 4.5e-4 at most."""


@dataclass(frozen=True, eq=False)
class SymmetricCarrier:
    """A flexible carrier of equal planets; n coordinates, k modal ones, N planets."""

    name: str
    planets: PlanetSet
    body: ReducedBody
    """Equal under a turn by one planet."""
    rings: Integers
    """(rings, N, 6) coordinates of the seats off the axis, by the planet that each belongs to."""
    modes: Floats
    """(k, k) columns of modal coordinates, each with one wave number."""
    waves: Integers
    """(k,) wave number of each column; those of a pair follow each other, and 0 stands alone."""
    spread: float
    """Change of the mass or stiffness matrix that made it symmetric, over the matrix."""

    @property
    def modal(self) -> Integers:
        """(k,) modal coordinates of the body."""
        return np.arange(self.body.size - len(self.waves), self.body.size)

    def turned(self, psi: float) -> Jet:
        """Modal coordinates (k, k) by those of the frame, and two derivatives by the input's angle psi (rad)."""
        angle = self.waves * self.planets.ratio
        c = np.diag(np.cos(angle * psi))
        s = np.zeros_like(c)
        # Pairs are rotated backwards as the carrier turns: the pattern stands still in the fixed frame.
        first = np.flatnonzero(self.waves > 0)[::2]
        sine = np.sin(angle[first] * psi)
        s[first, first + 1], s[first + 1, first] = sine, -sine
        rate = np.diag(angle)
        value = c + s
        quarter = np.zeros_like(c)
        quarter[first, first + 1], quarter[first + 1, first] = 1.0, -1.0
        slope = value @ quarter @ rate
        return self.modes @ value, self.modes @ slope, -self.modes @ value @ rate @ rate


def symmetric_carrier(name: str, body: ReducedBody, planets: PlanetSet, axis: Sequence[float]) -> SymmetricCarrier:
    """Make a flexible carrier symmetric.

    Parameters
    ----------
    body : its reduction in its own frame
    axis : (2,) place of its axis, m

    Raises
    ------
    SteadyError
        Seats that are not spaced like the planets, or a body that is not symmetric.
    """
    rings = _rings(name, body, planets, axis)
    turn = _turn_of_seats(body, rings, planets)
    seats = len(turn)
    stiffness, mass = body.stiffness[seats:, seats:], body.mass[seats:, seats:]
    modes = np.zeros((body.size - seats,) * 2)
    waves = np.zeros(len(modes), dtype=np.int64)
    whole = turn
    if len(modes):
        shapes = scipy.linalg.eigh(stiffness, mass)[1]
        coupling = shapes.T @ body.mass[seats:, :seats]
        left, _, right = np.linalg.svd(coupling @ turn @ coupling.T)
        between = left @ right
        order, waves, exact = _by_wave_number(between, planets.waves)
        modes = shapes @ order
        # The turn is taken with whole wave numbers, as the frame has them.
        whole = scipy.linalg.block_diag(turn, modes @ exact @ modes.T @ mass)
    matrices = [_mean_over_turns(matrix, whole, planets.waves) for matrix in (body.mass, body.stiffness)]
    both = zip(matrices, (body.mass, body.stiffness), strict=True)
    spread = max(float(np.linalg.norm(new - old) / np.linalg.norm(old)) for new, old in both)
    if spread > MAX_SPREAD:
        raise SteadyError(
            f"bodies.{name}: its mass and stiffness change by {100.0 * spread:.2g} % under a turn by one planet, but "
            f"the steady-state response needs a carrier that is symmetric to {100.0 * MAX_SPREAD:g} %; refine its "
            "mesh, set flexibility = 'none', or use exugear run"
        )
    gyroscopic = _mean_over_turns(body.gyroscopic, whole, planets.waves)
    symmetric = replace(body, mass=matrices[0], stiffness=matrices[1], gyroscopic=gyroscopic)
    return SymmetricCarrier(name, planets, symmetric, rings, modes, waves, spread)


def _rings(name: str, body: ReducedBody, planets: PlanetSet, axis: Sequence[float]) -> Integers:
    """Find the coordinates (rings, N, 6) of seats that the planets' places repeat."""
    places = np.array([seat.position for seat in body.seats]) - [*axis, 0.0]
    radii = np.hypot(places[:, 0], places[:, 1])
    left = [n for n in range(len(places)) if radii[n] > SAME_PLACE * max(radii.max(), 1e-3)]
    rings = []
    while left:
        first = places[left[0]]
        ring = []
        for angle in planets.angles - planets.angles[0]:
            c = math.cos(angle)
            s = math.sin(angle)
            place = np.array([c * first[0] - s * first[1], s * first[0] + c * first[1], first[2]])
            apart = np.linalg.norm(places[left] - place, axis=1)
            near = left[int(np.argmin(apart))]
            if apart.min() > SAME_PLACE * radii[left[0]] or near in ring:
                raise SteadyError(
                    f"bodies.{name}: its seat {body.seats[left[0]].name} off the axis is not repeated at each of the "
                    f"{planets.waves} planets, so its stiffness is not constant in the fixed frame; set flexibility = "
                    "'none', or use exugear run"
                )
            ring.append(near)
        left = [n for n in left if n not in ring]
        rings.append(ring)
    starts = BODY_SIZE * np.array(rings, dtype=np.int64).reshape(-1, planets.waves)
    return np.asarray(starts[..., None] + np.arange(BODY_SIZE))


def _turn_of_seats(body: ReducedBody, rings: Integers, planets: PlanetSet) -> Floats:
    """Matrix (s, s) that turns the motion of all seats by one planet about the axis."""
    angle = float(planets.angles[1] - planets.angles[0])
    c = math.cos(angle)
    s = math.sin(angle)
    vectors = np.eye(BODY_SIZE)
    for first in (0, TILT):
        vectors[first : first + 2, first : first + 2] = [[c, -s], [s, c]]
    turn = np.asarray(np.kron(np.eye(len(body.seats)), vectors), dtype=np.float64)
    for ring in rings:
        turn[ring.ravel()] = 0.0
        for here, there in zip(ring, np.roll(ring, -1, axis=0), strict=True):
            turn[np.ix_(there, here)] = vectors
    return turn


def _by_wave_number(turn: Floats, count: int) -> tuple[Floats, Integers, Floats]:
    """Split an orthogonal matrix (k, k), the turn by one of N planets, into rotations of pairs by 2 pi m / N.

    Returns
    -------
    columns : (k, k) orthonormal
    waves : (k,) wave number m of each column; 0 of what is constant, or alternates from planet to planet
    exact : (k, k) the turn of amplitudes of the columns, by whole wave numbers
    """
    triangular, columns = scipy.linalg.schur(turn, output="real")
    order: list[int] = []
    waves: list[int] = []
    exact = np.zeros_like(turn)
    at = 0
    while at < len(turn):
        below = float(triangular[at + 1, at]) if at + 1 < len(turn) else 0.0
        number = round(abs(math.atan2(below, triangular[at, at])) * count / (2.0 * math.pi))
        if below == 0.0 or 2 * number in (0, count):
            exact[at, at] = math.copysign(1.0, triangular[at, at])
            order.append(at)
            waves.append(0)
            at += 1
            continue
        c = math.cos(2.0 * math.pi * number / count)
        s = math.sin(2.0 * math.pi * number / count)
        exact[at : at + 2, at : at + 2] = [[c, -s], [s, c]]
        order += [at, at + 1] if below > 0.0 else [at + 1, at]
        waves += [number, number]
        at += 2
    return columns[:, order], np.array(waves, dtype=np.int64), exact


def _mean_over_turns(matrix: Floats, turn: Floats, count: int) -> Floats:
    """Mean of A, S' A S, S'^2 A S^2 ... over all turns by one planet."""
    found = matrix.copy()
    turned = matrix
    for _ in range(count - 1):
        turned = turn.T @ turned @ turn
        found += turned
    return np.asarray(found / count)
