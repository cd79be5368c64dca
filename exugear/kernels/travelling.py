"""Seats that travel around an elastic ring: a planet's mesh presses where the planet is.

The toothed ring of an elastic body has seats on equal sectors, each the rigid motion nearest to that of its sector.
Seen from the direction of its sector (radial, tangential, axial), that motion is a sample of a function around the
ring. The motion under a mesh at the angle theta is the trigonometric polynomial through an odd number s of samples,

    x(theta) = sum_k w(theta - theta_k) R(theta - theta_k) x_k,   w(d) = (1 + 2 sum_(n=1)^((s-1)/2) cos n d) / s,

with R the turn about z. It reproduces rigid motions, and it is smooth: a load that passes from sector to sector makes
no noise of its own. Waves around the ring up to n = (s-1)/2 are seen, their radial part less by the smearing over a
sector: nine sectors see 94 % of an oval (n = 2) and 85 % of three waves. Forces go back to the sectors by the
transposed law, and what the slope of x(theta) does goes to the angle of the frame: no energy is made or lost.

Each travelling seat has six coordinates of its own behind those of the system, which follow from these; they are those
of `exugear.kernels.coordinates`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from exugear.kernels.coordinates import BODY_SIZE, TILT
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled, kernel

COSINE, SINE, WEIGHT, SLOPE = range(4)
"""Columns of what a sector shares with a travelling seat: direction from its middle, weight and derivative of it."""


class TravellingArrays(NamedTuple):
    """Travelling seats; t seats, s sectors at most.

    Attributes
    ----------
    first : (t,) first of the six coordinates that follow
    frame : (t,) coordinate of the angle that they travel with; one that stays zero if they do not
    angle : (t,) where they are at zero angle, rad
    number : (t,) of sectors
    sectors : (t, s) first coordinate of each sector's seat
    axes : (t, s, 2) cosine and sine of the middle of each sector
    """

    first: Integers
    frame: Integers
    angle: Floats
    number: Integers
    sectors: Integers
    axes: Floats


def no_travelling() -> TravellingArrays:
    """Arrays of a system without travelling seats."""
    none = np.zeros(0, dtype=np.int64)
    return TravellingArrays(none, none, np.zeros(0), none, np.zeros((0, 0), dtype=np.int64), np.zeros((0, 0, 2)))


@kernel
def sector_weight(cosine: float, sine: float, count: int) -> tuple[float, float]:
    """Weight of a sector and its derivative (1/rad) at an angle from its middle, given by cosine and sine.

    Examples
    --------
    >>> sector_weight(1.0, 0.0, 9)
    (1.0, 0.0)
    """
    weight, slope = 1.0, 0.0
    # cos n d and sin n d by turning on from n - 1: one cosine and sine serve all waves.
    c, s = 1.0, 0.0
    for n in range(1, (count - 1) // 2 + 1):
        c, s = c * cosine - s * sine, s * cosine + c * sine
        weight += 2.0 * c
        slope -= 2.0 * n * s
    return weight / count, slope / count


def travelling_memory(seats: TravellingArrays) -> Floats:
    """Memory (t, s, 4) for `weigh_travelling`."""
    return np.zeros((*seats.sectors.shape, 4))


@kernel
def weigh_travelling(q: Floats, seats: TravellingArrays | None, shares: Floats) -> None:
    """Fill what each sector has to do with each travelling seat, if any: see the columns of `shares`."""
    if seats is None:
        return
    for t in range(seats.first.size):
        angle = seats.angle[t] + q[seats.frame[t]]
        c, s = math.cos(angle), math.sin(angle)
        for k in range(seats.number[t]):
            # Angle from the sector's middle to the seat, by the difference of the two directions.
            x, y, share = seats.axes[t, k, 0], seats.axes[t, k, 1], shares[t, k]
            share[COSINE], share[SINE] = c * x + s * y, s * x - c * y
            share[WEIGHT], share[SLOPE] = sector_weight(share[COSINE], share[SINE], seats.number[t])


@kernel
def place_travelling(q: Floats, v: Floats, seats: TravellingArrays | None, shares: Floats) -> None:
    """Fill coordinates and rates of all travelling seats, if any, from those of the sectors."""
    if seats is None:
        return
    for t in range(seats.first.size):
        o, speed = seats.first[t], v[seats.frame[t]]
        for i in range(BODY_SIZE):
            q[o + i], v[o + i] = 0.0, 0.0
        for k in range(seats.number[t]):
            share, j = shares[t, k], seats.sectors[t, k]
            cosine, sine, weight, slope = share[COSINE], share[SINE], share[WEIGHT], share[SLOPE]
            # Translations, then angles: the sector's motion turned on by that angle, its share, and what the share
            # and the turning change as the seat travels.
            for i in (0, TILT):
                x, y = cosine * q[j + i] - sine * q[j + i + 1], sine * q[j + i] + cosine * q[j + i + 1]
                ux, uy = cosine * v[j + i] - sine * v[j + i + 1], sine * v[j + i] + cosine * v[j + i + 1]
                q[o + i] += weight * x
                q[o + i + 1] += weight * y
                q[o + i + 2] += weight * q[j + i + 2]
                v[o + i] += weight * ux + speed * (slope * x - weight * y)
                v[o + i + 1] += weight * uy + speed * (slope * y + weight * x)
                v[o + i + 2] += weight * v[j + i + 2] + speed * slope * q[j + i + 2]


@kernel
def share_travelling_forces(q: Floats, seats: TravellingArrays | None, shares: Floats, f: Floats) -> None:
    """Move the generalized forces on all travelling seats to their sectors and to the angle they travel with."""
    if seats is None:
        return
    for t in range(seats.first.size):
        o, frame = seats.first[t], seats.frame[t]
        travelling = 0.0  # power of the forces as the seat travels, per rad/s: the force on the frame's angle
        for k in range(seats.number[t]):
            share, j = shares[t, k], seats.sectors[t, k]
            cosine, sine, weight, slope = share[COSINE], share[SINE], share[WEIGHT], share[SLOPE]
            for i in (0, TILT):
                # The transposed map: turned back, times the share.
                fx, fy = cosine * f[o + i] + sine * f[o + i + 1], cosine * f[o + i + 1] - sine * f[o + i]
                fz = f[o + i + 2]
                f[j + i] += weight * fx
                f[j + i + 1] += weight * fy
                f[j + i + 2] += weight * fz
                travelling += slope * (fx * q[j + i] + fy * q[j + i + 1] + fz * q[j + i + 2])
                travelling += weight * (fy * q[j + i] - fx * q[j + i + 1])
        f[frame] += travelling
        for i in range(BODY_SIZE):
            f[o + i] = 0.0


@compiled
def follow(q: Floats, v: Floats, seats: TravellingArrays) -> tuple[Floats, Floats]:
    """States (n, size + 6 t + 1) with those of the travelling seats and one that stays zero behind (n, size)."""
    size, extended = q.shape[1], q.shape[1] + BODY_SIZE * seats.first.size + 1
    x, u = np.zeros((len(q), extended)), np.zeros((len(q), extended))
    x[:, :size], u[:, :size] = q, v
    count, sectors = seats.sectors.shape
    shares = np.zeros((count, sectors, 4))
    for n in range(len(q)):
        weigh_travelling(x[n], seats, shares)
        place_travelling(x[n], u[n], seats, shares)
    return x, u


class TravellingTangent(NamedTuple):
    """Derivatives of the e = size + 6 t + 1 coordinates of `follow` by the system's own.

    Attributes
    ----------
    place : (e, size) of coordinates by coordinates, and of rates by rates
    rate : (e, size) of rates by coordinates
    turning : (size, size) of the forces on the sectors and the frame, by coordinates, at unchanged mesh forces
    """

    place: Floats
    rate: Floats
    turning: Floats


def travelling_tangent(q: Floats, v: Floats, force: Floats, seats: TravellingArrays) -> TravellingTangent:
    """Differentiate at a state q, v of `follow` (e,) under generalized forces (e,) that are not shared yet."""
    extended = len(q)
    size = extended - BODY_SIZE * seats.first.size - 1
    place, rate, turning = np.eye(extended, size), np.zeros((extended, size)), np.zeros((size, size))
    for t, o in enumerate(seats.first):
        frame, acting, seat = seats.frame[t], force[o : o + BODY_SIZE], slice(o, o + BODY_SIZE)
        for k in range(seats.number[t]):
            middle = math.atan2(seats.axes[t, k, 1], seats.axes[t, k, 0])
            maps = _sector_maps(seats.angle[t] + q[frame] - middle, int(seats.number[t]))
            at = slice(seats.sectors[t, k], seats.sectors[t, k] + BODY_SIZE)
            place[seat, at] += maps[0]
            rate[seat, at] += v[frame] * maps[1]
            if frame < size:
                place[seat, frame] += maps[1] @ q[at]
                rate[seat, frame] += maps[1] @ v[at] + v[frame] * maps[2] @ q[at]
                turning[at, frame] += maps[1].T @ acting
                turning[frame, at] += maps[1].T @ acting
                turning[frame, frame] += (maps[2] @ q[at]) @ acting
    return TravellingTangent(place, rate, turning)


def _sector_maps(angle: float, count: int) -> tuple[Floats, Floats, Floats]:
    """Share of a sector's motion in that at an angle (rad) from its middle, and two derivatives, each (6, 6)."""
    order = np.arange(1, (count - 1) // 2 + 1)
    weight = (1.0 + 2.0 * np.cos(order * angle).sum()) / count
    slope = -2.0 * (order * np.sin(order * angle)).sum() / count
    curvature = -2.0 * (order**2 * np.cos(order * angle)).sum() / count
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    turning = np.array([[-s, -c, 0.0], [c, -s, 0.0], [0.0, 0.0, 0.0]])
    back = np.array([[-c, s, 0.0], [-s, -c, 0.0], [0.0, 0.0, 0.0]])
    maps = weight * turn, slope * turn + weight * turning, curvature * turn + 2.0 * slope * turning + weight * back
    both = np.eye(2)
    return np.kron(both, maps[0]), np.kron(both, maps[1]), np.kron(both, maps[2])
