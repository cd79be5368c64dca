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
of `exugear.system.kernels.coordinates`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from exugear.system.kernels.coordinates import AXIAL, BODY_SIZE, SPIN, TILT
from exugear.system.kernels.products import filled_up
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled, kernel
from fe_ste.tools.octets import SIZE, all_eight, eight, put

AXIS_X, AXIS_Y, WEIGHT, COSINE, SINE, SLOPE, SLOPE_COSINE, SLOPE_SINE, TRAVEL, SUMS = range(10)
"""Rows of a seat's memory. By sector: direction of its middle from the seat at zero angle; its weight in the seat's
motion, that of its motion along and across; the derivatives of these three by the seat's angle. Then the derivative of
the seat's motion, and sums."""
NUMBER_OF_SUMS = 9


class TravellingArrays(NamedTuple):
    """Travelling seats; t seats, s sectors at most."""

    first: Integers
    """(t,) first of the six coordinates that follow."""
    frame: Integers
    """(t,) coordinate of the angle that they travel with; one that stays zero if they do not."""
    angle: Floats
    """(t,) where they are at zero angle, rad."""
    number: Integers
    """(t,) of sectors."""
    sectors: Integers
    """(t, s) first coordinate of each sector's seat."""
    axes: Floats
    """(t, s, 2) cosine and sine of the middle of each sector."""


def no_travelling() -> TravellingArrays:
    """Arrays of a system without travelling seats."""
    none = np.zeros(0, dtype=np.int64)
    return TravellingArrays(none, none, np.zeros(0), none, np.zeros((0, 0), dtype=np.int64), np.zeros((0, 0, 2)))


def travelling_memory(seats: TravellingArrays) -> Floats:
    """Memory (t, rows, s or more) for `place_travelling`, with the directions of all sectors."""
    count, sectors = seats.sectors.shape
    memory = np.zeros((count, SUMS + NUMBER_OF_SUMS, filled_up(max(sectors, 1))))
    x, y = np.moveaxis(seats.axes, -1, 0)
    c = np.cos(seats.angle)[:, None]
    s = np.sin(seats.angle)[:, None]
    memory[:, AXIS_X, :sectors], memory[:, AXIS_Y, :sectors] = c * x + s * y, c * y - s * x
    return memory


@kernel
def weigh_sectors(c: float, s: float, count: int, memory: Floats) -> None:
    """Fill what each of `count` sectors has to do with a seat; c and s are those of the angle it has travelled."""
    for k in range(0, memory.shape[1], SIZE):
        # Angle from the sector's middle to the seat, by the difference of the two directions.
        x = eight(memory[AXIS_X], k)
        y = eight(memory[AXIS_Y], k)
        cosine = x * c + y * s
        sine = x * s - y * c
        # cos n d and sin n d by turning on from n - 1: one cosine and sine serve all waves.
        weight = all_eight(1.0)
        slope = all_eight(0.0)
        of_n = all_eight(1.0)
        of_n_across = all_eight(0.0)
        for n in range(1, (count - 1) // 2 + 1):
            of_n, of_n_across = of_n * cosine - of_n_across * sine, of_n_across * cosine + of_n * sine
            weight = weight + of_n * 2.0
            slope = slope - of_n_across * (2.0 * n)
        weight = weight * (1.0 / count)
        slope = slope * (1.0 / count)
        put(memory[WEIGHT], k, weight)
        put(memory[COSINE], k, weight * cosine)
        put(memory[SINE], k, weight * sine)
        put(memory[SLOPE], k, slope)
        put(memory[SLOPE_COSINE], k, slope * cosine - weight * sine)
        put(memory[SLOPE_SINE], k, slope * sine + weight * cosine)


@kernel
def sum_sectors(t: int, q: Floats, v: Floats, seats: TravellingArrays, memory: Floats) -> None:
    """Fill the sums for seat t: of the sectors' motions by weight, along and across; derivatives; the same of rates."""
    a = all_eight(0.0)
    b = a
    c = a
    d = a
    e = a
    f = a
    g = a
    h = a
    i = a
    for k in range(seats.number[t]):
        j = seats.sectors[t, k]
        place, rate = eight(q, j), eight(v, j)  # the last two of these are of the next seat and not looked at
        weight = memory[WEIGHT, k]
        cosine = memory[COSINE, k]
        sine = memory[SINE, k]
        a = a + place * weight
        b = b + place * cosine
        c = c + place * sine
        d = d + place * memory[SLOPE, k]
        e = e + place * memory[SLOPE_COSINE, k]
        f = f + place * memory[SLOPE_SINE, k]
        g = g + rate * weight
        h = h + rate * cosine
        i = i + rate * sine
    put(memory[SUMS], 0, a)
    put(memory[SUMS + 1], 0, b)
    put(memory[SUMS + 2], 0, c)
    put(memory[SUMS + 3], 0, d)
    put(memory[SUMS + 4], 0, e)
    put(memory[SUMS + 5], 0, f)
    put(memory[SUMS + 6], 0, g)
    put(memory[SUMS + 7], 0, h)
    put(memory[SUMS + 8], 0, i)


@kernel
def turned_sum(memory: Floats, row: int, i: int) -> float:
    """Entry i of a motion from its sums by weight, along and across, which stand in three rows."""
    if i % TILT == AXIAL:
        return float(memory[row, i])
    if i % TILT == 0:
        return float(memory[row + 1, i] - memory[row + 2, i + 1])
    return float(memory[row + 2, i - 1] + memory[row + 1, i])


@kernel
def place_travelling(q: Floats, v: Floats, seats: TravellingArrays | None, shares: Floats) -> None:
    """Fill coordinates and rates of all travelling seats, if any, from those of the sectors, and what each shares."""
    if seats is None:
        return
    c = 1.0
    s = 0.0
    last = -1
    for t in range(seats.first.size):
        o = seats.first[t]
        frame = seats.frame[t]
        memory = shares[t]
        if frame != last:  # seats that travel together need one cosine and sine
            c = math.cos(q[frame])
            s = math.sin(q[frame])
            last = frame
        weigh_sectors(c, s, seats.number[t], memory)
        sum_sectors(t, q, v, seats, memory)
        for i in range(BODY_SIZE):
            memory[TRAVEL, i] = turned_sum(memory, SUMS + 3, i)
            q[o + i] = turned_sum(memory, SUMS, i)
            v[o + i] = turned_sum(memory, SUMS + 6, i) + v[frame] * memory[TRAVEL, i]


@kernel
def share_travelling_forces(seats: TravellingArrays | None, shares: Floats, f: Floats) -> None:
    """Move the generalized forces on all travelling seats to their sectors and to the angle they travel with.

    Where the seats are is what `place_travelling` left in `shares`.
    """
    if seats is None:
        return
    for t in range(seats.first.size):
        o = seats.first[t]
        memory = shares[t]
        power = 0.0  # of the forces as the seat travels, per rad/s: the force on the frame's angle
        for i in range(BODY_SIZE):
            power += f[o + i] * memory[TRAVEL, i]
        x = f[o]
        y = f[o + 1]
        z = f[o + 2]
        a = f[o + 3]
        b = f[o + 4]
        c = f[o + 5]
        for k in range(seats.number[t]):
            # The transposed map: turned back, times the share.
            j = seats.sectors[t, k]
            weight = memory[WEIGHT, k]
            cosine = memory[COSINE, k]
            sine = memory[SINE, k]
            f[j] += cosine * x + sine * y
            f[j + 1] += cosine * y - sine * x
            f[j + AXIAL] += weight * z
            f[j + TILT] += cosine * a + sine * b
            f[j + TILT + 1] += cosine * b - sine * a
            f[j + SPIN] += weight * c
        f[seats.frame[t]] += power
        for i in range(BODY_SIZE):
            f[o + i] = 0.0


def follow(q: Floats, v: Floats, seats: TravellingArrays) -> tuple[Floats, Floats]:
    """States (n, size + 6 t + 1) with those of the travelling seats and one that stays zero behind (n, size)."""
    following = ((0, 0), (0, BODY_SIZE * seats.first.size + 1))
    x = np.pad(q, following)
    u = np.pad(v, following)
    place_all(x, u, seats, travelling_memory(seats))
    return x, u


@compiled
def place_all(x: Floats, u: Floats, seats: TravellingArrays, shares: Floats) -> None:
    """Place the travelling seats of states (n, size + 6 t + 1)."""
    for n in range(len(x)):
        place_travelling(x[n], u[n], seats, shares)


class TravellingTangent(NamedTuple):
    """Derivatives of the e = size + 6 t + 1 coordinates of `follow` by the system's own."""

    place: Floats
    """(e, size) of coordinates by coordinates, and of rates by rates."""
    rate: Floats
    """(e, size) of rates by coordinates."""
    turning: Floats
    """(size, size) of the forces on the sectors and the frame, by coordinates, at unchanged mesh forces."""


def travelling_tangent(q: Floats, v: Floats, force: Floats, seats: TravellingArrays) -> TravellingTangent:
    """Differentiate at a state q, v of `follow` (e,) under generalized forces (e,) that are not shared yet."""
    extended = len(q)
    size = extended - BODY_SIZE * seats.first.size - 1
    place = np.eye(extended, size)
    rate = np.zeros((extended, size))
    turning = np.zeros((size, size))
    for t, o in enumerate(seats.first):
        frame = seats.frame[t]
        acting = force[o : o + BODY_SIZE]
        seat = slice(o, o + BODY_SIZE)
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
    c = math.cos(angle)
    s = math.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    turning = np.array([[-s, -c, 0.0], [c, -s, 0.0], [0.0, 0.0, 0.0]])
    back = np.array([[-c, s, 0.0], [-s, -c, 0.0], [0.0, 0.0, 0.0]])
    maps = weight * turn, slope * turn + weight * turning, curvature * turn + 2.0 * slope * turning + weight * back
    both = np.eye(2)
    return np.kron(both, maps[0]), np.kron(both, maps[1]), np.kron(both, maps[2])
