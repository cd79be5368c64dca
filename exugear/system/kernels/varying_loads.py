"""Loads that vary with the angle of a body, on arrays of coordinates: machines, propellers, unbalance.

With the angle theta of a body and its speed Omega, a load has the generalized forces

    f = a(Omega) Re(w exp(i (n theta + b(Omega)))),

its size a being a power of the speed or, as its phase b, linear between the rows of a table over the speed. Neither a
nor b depends on the sense of rotation.

Numbers in this module become part of machine code: `fe_ste.tools.compilation` recompiles when this file changes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import kernel


class VaryingLoadArrays(NamedTuple):
    """Loads that vary with the angle of a body; l loads with e entries of generalized forces."""

    turning: Integers
    """(l,) coordinate of the angle."""
    order: Floats
    exponent: Floats
    """(l,) periods n per revolution, and power of the speed (rad/s)."""
    first: Integers
    """(l + 1,) first entry of each load in the arrays that follow."""
    coordinate: Integers
    wave: Floats
    """(e,) coordinate on which it acts, and (e, 2) real and imaginary part of w."""
    first_row: Integers
    """(l + 1,) first row of the table of each load; loads with a power of the speed have none."""
    table: Floats
    """(r, 3) ascending speed (rad/s), size, and phase (rad) of all tables."""


def no_varying_loads() -> VaryingLoadArrays:
    """Return the arrays without any load."""
    none = np.zeros(0)
    no_index = np.zeros(0, dtype=np.int64)
    first = np.zeros(1, dtype=np.int64)
    return VaryingLoadArrays(no_index, none, none, first, no_index, np.zeros((0, 2)), first, np.zeros((0, 3)))


@kernel
def size_and_phase(n: int, speed: float, loads: VaryingLoadArrays) -> tuple[float, float]:
    """Size and phase (rad) of load n at a speed (rad/s); before and after its table those of the first and last row."""
    speed = abs(speed)
    first = loads.first_row[n]
    last = loads.first_row[n + 1] - 1
    if last < first:
        return (speed ** loads.exponent[n] if loads.exponent[n] != 0.0 else 1.0), 0.0
    while first < last - 1 and loads.table[first + 1, 0] <= speed:
        first += 1
    if first == last:
        return loads.table[first, 1], loads.table[first, 2]
    share = (speed - loads.table[first, 0]) / (loads.table[first + 1, 0] - loads.table[first, 0])
    share = min(1.0, max(0.0, share))
    size = loads.table[first, 1] + share * (loads.table[first + 1, 1] - loads.table[first, 1])
    return size, loads.table[first, 2] + share * (loads.table[first + 1, 2] - loads.table[first, 2])


@kernel
def fill_sizes_and_phases(speeds: Floats, loads: VaryingLoadArrays, found: Floats) -> None:
    """Fill sizes and phases (l, 2) of all loads at the speeds of their bodies (l,), rad/s."""
    for n in range(speeds.size):
        found[n, 0], found[n, 1] = size_and_phase(n, speeds[n], loads)


@kernel
def add_varying_loads(q: Floats, v: Floats, loads: VaryingLoadArrays, f: Floats) -> None:
    """Add the generalized forces of all loads at coordinates q and velocities v to f."""
    for n in range(loads.turning.size):
        i = loads.turning[n]
        size, phase = size_and_phase(n, v[i], loads)
        angle = loads.order[n] * q[i] + phase
        cosine = size * math.cos(angle)
        sine = size * math.sin(angle)
        for entry in range(loads.first[n], loads.first[n + 1]):
            f[loads.coordinate[entry]] += loads.wave[entry, 0] * cosine - loads.wave[entry, 1] * sine
