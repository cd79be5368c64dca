"""Flexible bodies in their own rotating frame, such as a planet carrier: forces on arrays of coordinates.

Coordinates in the state are those of `exugear.system.kernels.coordinates` at each seat: the displacement of its centre
from the place p that it has at zero angles, tilts about non-rotating axes, and the unwrapped spin. Internal modal
coordinates follow. So a seat at p from the axis that turns by psi is displaced by x = R(psi) (p + u) - p. Stiffness and
mass are constant in a frame that turns with the mean psi of the spins of the seats off the axis (of all seats if none
is), Omega = d psi / dt:

- displacements in it, q: u = R' (p + x) - p, tilts R' (a, b), spins less psi, amplitudes as they are;
- velocities along its axes, w: R' x', R' (a', b'), spins', amplitudes'. With S, which turns the vectors of the seats
  by a right angle about z (no spin, no amplitude), and the rigid spin r, q' = w - Omega (r + S q).

Kinetic energy w' M w / 2, elastic energy q' K q / 2 and damping, time times K, on the rates q' give

    M dw/dt = R' f - K (q + time q') + Omega h + s m,    h = -(2 C - M S) (w - Omega r) - Omega C r,

with C_ij = int rho phi_i . (e_z x phi_j), accelerations R (dw/dt + Omega S w), and the weights s of the spins in psi,
which carry the reaction on the frame's angle, m = (S q) . K (q + time q') - w . h. The sum has the Coriolis forces
2 Omega C q' and the centrifugal force -Omega^2 C r of the undeformed body; a disc on the axis tilts as a gyroscope.
All forces but damping balance: their power w . (-K q + Omega h) + Omega m is -q' . K q, whatever h is.

Of the other terms quadratic in Omega, centrifugal stiffening and softening of the deformation are both neglected, and
tilts are treated as on the axis; the part of Omega' C q that M S does not contain is neglected, too. At the speed of a
planet carrier (3 rad/s) this is a millionth of the elastic forces.

The toothed ring of a flexible body has seats on equal sectors, each the rigid motion nearest to that of its sector.
Seen from the direction of its sector (radial, tangential, axial), that motion is a sample of a function around the
ring. The motion under a mesh at the angle theta is the trigonometric polynomial through an odd number s of samples,

    x(theta) = sum_k w(theta - theta_k) R(theta - theta_k) x_k,   w(d) = (1 + 2 sum_(n=1)^((s-1)/2) cos n d) / s,

with R the rotation about z. It reproduces rigid motions, and it is smooth: a load that passes from sector to sector
causes no numerical excitation. Circumferential harmonics of the ring up to n = (s-1)/2 are represented, with a radial
part reduced by averaging over a sector: nine sectors represent 94 % of an oval (n = 2) and 85 % of n = 3. Forces are
distributed to the sectors by the transposed map, and the work of the slope of x(theta) is assigned to the angle of the
frame: energy is conserved.

Each travelling seat has six coordinates of its own behind those of the system, which follow from these; they are those
of `exugear.system.kernels.coordinates`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from exugear.system.kernels.coordinates import AXIAL, BODY_SIZE, SPIN, TILT
from exugear.system.kernels.products import add_rows, add_symmetric, add_symmetric_with_form, filled_up, square_form
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled, kernel
from fe_ste.tools.octets import SIZE, aligned_zeros, all_eight, eight, put, sum_of


class TurningArrays(NamedTuple):
    """Bodies in turning frames as b bodies, arranged for speed."""

    begin: Integers
    size: Integers
    seats: Integers
    """(b,) first coordinate in the state, number of coordinates and seats."""
    columns: Integers
    """(b,) that number filled up to a multiple of eight."""
    first: Integers
    """(b,) first entry of each body in the vectors, which are filled up likewise."""
    spin: Floats
    weight: Floats
    pull: Floats
    """r, s and -C r of all bodies."""
    square: Integers
    """(b,) first entry of each body in `stiffness`, `mass` and `inverse`."""
    stiffness: Floats
    mass: Floats
    inverse: Floats
    """Tiles of -K, M and its inverse, see `exugear.system.kernels.products`."""
    across: Integers
    """(b,) first entry of each body in `coriolis`."""
    coriolis: Floats
    """Tiles of M S - 2 C."""
    damping_time: Floats
    """(b,) s."""
    gravity: Floats
    """(b, 3) m/s2."""
    moving: Floats
    """(3, c) of all bodies M times a motion of all seats along x, y and z by one."""


def turning_memory(turning: TurningArrays) -> Floats:
    """Memory (7, n) that the functions below work in, for the largest body."""
    size = int(turning.columns.max(initial=SIZE))
    return aligned_zeros(7 * size).reshape(7, size)


@kernel
def to_body_frame(
    b: int, q: Floats, v: Floats, turning: TurningArrays, moved: Floats, rates: Floats
) -> tuple[float, float, float]:
    """Fill displacements q and rates w - Omega r of body b in its frame; return cos psi, sin psi and Omega."""
    begin, first, size = turning.begin[b], turning.first[b], turning.size[b]
    # The frame's angle and speed: the weighted mean of the spins.
    angle, speed = 0.0, 0.0
    for n in range(turning.seats[b]):
        weight = turning.weight[first + BODY_SIZE * n + SPIN]
        angle += weight * q[begin + BODY_SIZE * n + SPIN]
        speed += weight * v[begin + BODY_SIZE * n + SPIN]
    c, s = math.cos(angle), math.sin(angle)
    for n in range(turning.seats[b]):
        i, j = BODY_SIZE * n, begin + BODY_SIZE * n
        # A rigid spin displaces a seat at p by S p per rad: its entries are -p_y and p_x.
        rx, ry = turning.spin[first + i], turning.spin[first + i + 1]
        x, y = ry + q[j], q[j + 1] - rx
        moved[i], moved[i + 1] = c * x + s * y - ry, c * y - s * x + rx
        rates[i] = c * v[j] + s * v[j + 1] - speed * rx
        rates[i + 1] = c * v[j + 1] - s * v[j] - speed * ry
        k, m = i + TILT, j + TILT
        moved[k], moved[k + 1] = c * q[m] + s * q[m + 1], c * q[m + 1] - s * q[m]
        rates[k], rates[k + 1] = c * v[m] + s * v[m + 1], c * v[m + 1] - s * v[m]
        moved[i + AXIAL], rates[i + AXIAL] = q[j + AXIAL], v[j + AXIAL]
        moved[i + SPIN], rates[i + SPIN] = q[j + SPIN] - angle, v[j + SPIN] - speed
    # Modal coordinates turn with the frame as they are; what fills up the rows is zero.
    for i in range(BODY_SIZE * turning.seats[b], size):
        moved[i], rates[i] = q[begin + i], v[begin + i]
    for i in range(size, turning.columns[b]):
        moved[i], rates[i] = 0.0, 0.0
    return c, s, speed


@kernel
def deformation_rates(b: int, moved: Floats, rates: Floats, speed: float, turning: TurningArrays, out: Floats) -> None:
    """Fill the rates q' = w - Omega r - Omega S q of the displacements of body b."""
    for i in range(turning.columns[b]):
        out[i] = rates[i]
    for n in range(turning.seats[b]):
        for i in (BODY_SIZE * n, BODY_SIZE * n + TILT):
            out[i] += speed * moved[i + 1]
            out[i + 1] -= speed * moved[i]


@kernel
def set_turning_motion(
    q: Floats, v: Floats, f: Floats, with_power: bool, turning: TurningArrays | None, memory: Floats, out: Floats
) -> float:
    """Fill the accelerations of all bodies under generalized forces f, their own forces left out, into out.

    Returns the power that they damp (W) if asked for, else 0. Nothing without such bodies (None).
    """
    damped = 0.0
    if turning is None:
        return damped
    moved, rates, given, deforming = memory[0], memory[1], memory[2], memory[6]
    elastic, apparent, total = memory[3], memory[4], memory[5]
    for b in range(turning.begin.size):
        begin, first, size, columns = turning.begin[b], turning.first[b], turning.size[b], turning.columns[b]
        c, s, speed = to_body_frame(b, q, v, turning, moved, rates)
        deformation_rates(b, moved, rates, speed, turning, deforming)
        time, square = turning.damping_time[b], turning.square[b]
        for i in range(0, columns, SIZE):
            put(given, i, eight(moved, i) + eight(deforming, i) * time)
        # Elastic and apparent forces; the reaction on the frame's angle gathers what they take from its power.
        for i in range(0, columns, SIZE):
            put(elastic, i, all_eight(0.0))
            put(apparent, i, eight(turning.pull, first + i) * speed)
        if with_power:
            damped -= time * add_symmetric_with_form(turning.stiffness, square, columns, given, elastic, deforming)
        else:
            add_symmetric(turning.stiffness, square, columns, given, elastic)
        add_rows(turning.coriolis, turning.across[b], columns, columns, rates, apparent)
        power = all_eight(0.0)
        for i in range(0, columns, SIZE):
            inner, pushed = eight(elastic, i), eight(apparent, i)
            power = power + (eight(rates, i) + eight(turning.spin, first + i) * speed) * pushed
            put(total, i, inner + pushed * speed)
        reaction, lever = -sum_of(power), 0.0
        for n in range(turning.seats[b]):
            for i in (BODY_SIZE * n, BODY_SIZE * n + TILT):
                x, y = f[begin + i], f[begin + i + 1]
                lever += moved[i + 1] * elastic[i] - moved[i] * elastic[i + 1]
                # Outer forces turned into the frame.
                total[i] += c * x + s * y
                total[i + 1] += c * y - s * x
                total[i + AXIAL] += f[begin + i + AXIAL]
        for i in range(BODY_SIZE * turning.seats[b], size):
            total[i] += f[begin + i]
        reaction += lever
        for n in range(turning.seats[b]):
            total[BODY_SIZE * n + SPIN] += reaction * turning.weight[first + BODY_SIZE * n + SPIN]
        # Accelerations along the frame's axes, then in global ones: R (dw/dt + Omega S w).
        for i in range(columns):
            given[i] = 0.0
        add_symmetric(turning.inverse, square, columns, total, given)
        for i in range(size):
            out[begin + i] = given[i]
        for n in range(turning.seats[b]):
            for i in (BODY_SIZE * n, BODY_SIZE * n + TILT):
                spin_x, spin_y = turning.spin[first + i], turning.spin[first + i + 1]
                x = out[begin + i] - speed * (rates[i + 1] + speed * spin_y)
                y = out[begin + i + 1] + speed * (rates[i] + speed * spin_x)
                out[begin + i], out[begin + i + 1] = c * x - s * y, s * x + c * y
            for axis in range(3):
                out[begin + BODY_SIZE * n + axis] += turning.gravity[b, axis]
    return damped


@kernel
def turning_energies(q: Floats, v: Floats, turning: TurningArrays | None, memory: Floats) -> tuple[float, float]:
    """Kinetic and elastic energy (J) of all bodies."""
    kinetic, stored = 0.0, 0.0
    if turning is None:
        return kinetic, stored
    moved, rates = memory[0], memory[1]
    for b in range(turning.begin.size):
        first, columns, square = turning.first[b], turning.columns[b], turning.square[b]
        _, _, speed = to_body_frame(b, q, v, turning, moved, rates)
        stored -= 0.5 * square_form(turning.stiffness, square, columns, moved)
        for i in range(turning.size[b]):
            rates[i] += speed * turning.spin[first + i]
        kinetic += 0.5 * square_form(turning.mass, square, columns, rates)
    return kinetic, stored


@kernel
def turning_weight_power(q: Floats, v: Floats, turning: TurningArrays | None, memory: Floats) -> float:
    """Power of the weight of all bodies (W)."""
    weight = 0.0
    if turning is None:
        return weight
    moved, rates = memory[0], memory[1]
    for b in range(turning.begin.size):
        gx, gy, gz = turning.gravity[b, 0], turning.gravity[b, 1], turning.gravity[b, 2]
        if gx == 0.0 and gy == 0.0 and gz == 0.0:
            continue
        first = turning.first[b]
        c, s, speed = to_body_frame(b, q, v, turning, moved, rates)
        # Gravity in the frame times the momentum along its axes.
        x, y = c * gx + s * gy, c * gy - s * gx
        for i in range(turning.size[b]):
            momentum = x * turning.moving[0, first + i] + y * turning.moving[1, first + i]
            momentum += gz * turning.moving[2, first + i]
            weight += (rates[i] + speed * turning.spin[first + i]) * momentum
    return weight


# Seats that travel around an elastic ring: a planet's mesh presses where the planet is

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
    """Entry i of a motion from its sums by weight, along and across, which are stored in three rows."""
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


def follow(q: Floats, v: Floats, seats: TravellingArrays, shares: Floats | None = None) -> tuple[Floats, Floats]:
    """States (n, size + 6 t + 1) with those of the travelling seats and one that stays zero behind (n, size).

    Memory of `travelling_memory` is left with what each sector shares in the last state.
    """
    following = np.zeros((len(q), BODY_SIZE * seats.first.size + 1))
    x = np.hstack([q, following])
    u = np.hstack([v, following])
    place_all(x, u, seats, travelling_memory(seats) if shares is None else shares)
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
