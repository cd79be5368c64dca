"""Elastic bodies described in their own turning frame, such as a planet carrier: laws on arrays of coordinates.

Coordinates in the state are those of `exugear.system.kernels.coordinates` at each seat: the displacement of its centre
from the place p that it has at zero angles, tilts about axes that do not turn, and the unwrapped spin. Modal
coordinates of the inside follow. So a seat at p from the axis that turns by psi is displaced by x = R(psi) (p + u) - p.
Stiffness and mass are constant in a frame that turns with the mean psi of the spins of the seats off the axis (of all
seats if none is), Omega = d psi / dt:

- displacements in it, q: u = R' (p + x) - p, tilts R' (a, b), spins less psi, amplitudes as they are;
- velocities along its axes, w: R' x', R' (a', b'), spins', amplitudes'. With S, which turns the vectors of the seats
  by a right angle about z (no spin, no amplitude), and the rigid spin r, q' = w - Omega (r + S q).

Kinetic energy w' M w / 2, elastic energy q' K q / 2 and damping, time times K, on the rates q' give

    M dw/dt = R' f - K (q + time q') + Omega h + s m,    h = -(2 C - M S) (w - Omega r) - Omega C r,

with C_ij = int rho phi_i . (e_z x phi_j), accelerations R (dw/dt + Omega S w), and the weights s of the spins in psi,
which carry the reaction on the frame's angle, m = (S q) . K (q + time q') - w . h. The sum has the Coriolis forces
2 Omega C q' and the centrifugal force -Omega^2 C r of the undeformed body; a disc on the axis tilts as a gyroscope.
All forces but damping balance: their power w . (-K q + Omega h) + Omega m is -q' . K q, whatever h is.

Of what else is quadratic in Omega, centrifugal stiffening and softening of the deformation are left out together, and
tilts count as on the axis; the part of Omega' C q that M S does not hold is left out, too. At the speed of a planet
carrier (3 rad/s) this is a millionth of the elastic forces.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from exugear.system.kernels.coordinates import AXIAL, BODY_SIZE, SPIN, TILT
from exugear.system.kernels.products import (
    add_rows,
    add_symmetric,
    add_symmetric_with_form,
    square_form,
)
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import kernel
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
