r"""Compiled law of a mesh that follows its table: force from deflection, position and where the gears stand.

On a surface s(pmc, a, gamma, F) of static transmission error over the mesh cycle, centre distance, misalignment and
line-of-action force (`fe_ste.transmission_error.surface`), the force at a deflection delta is the F with s = delta;
below s at no load the flanks are apart. With the complementary energy U*(F) = int_0^F s dF

    U = F delta - U*,   dU/d delta = F,   dU/da = -dU*/da,   dU/d gamma = -dU*/d gamma,   dF/d delta = 1 / (ds/dF)

so that one potential gives the force, the push between the axes and the moment that misalignment raises. A
flank of the other side has the same surface seen from the other end of the gear: gamma changes its sign.

Nothing is allocated here but the memory handed in.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled, kernel

ORDERS = np.array(
    [[0, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 2, 0], [0, 1, 1], [0, 0, 2], [1, 1, 0], [1, 0, 1]],
    dtype=np.int64,
)
"""Derivatives of the surface in this order: times by pmc, by centre distance, by misalignment."""
FIRST_TWO = 3
"""Number of them that a force needs; one more for the power of the turning cycle, all for a tangent."""
ROUNDS = 60
"""Newton and bisection steps at most: bisection alone would reach round-off."""


class TableArrays(NamedTuple):
    """Tables of all meshes; m meshes, those of another law with zeros.

    Attributes
    ----------
    shape : (m, 4) positions, centre distances, values and slopes along misalignment, load pieces
    axes : (m, 2) number of knots of centre distance and misalignment
    values : (m, n) `fe_ste.transmission_error.surface.SteSurface.coefficients`, flat
    root : (m, l + 1) knots of the root of F_bt, sqrt(N)
    knots : (m, 2, k) knots of centre distance (m) and misalignment (rad)
    first : (m, 2, k) first node that acts in each interval
    weights : (m, 2, k, 4, 4) coefficients of the nodes' weights in each interval
    lowest : (m,) deflection below which the flanks are apart in every position, m
    centre, tilt : (m, 12) rows of centre distance and misalignment, about the bodies' nodes
    back, back_tilt : (m, 12) rows of the other flank's deflection and misalignment
    nominal : (m, 3) deflection (m), centre distance (m), misalignment (rad) of gears in their nominal place
    backlash : (m,) approach from flank to flank along the transverse line of action, m
    back_phase : (m,) position of the other flank in its mesh cycle at zero angles
    damping_time : (m,) damping over tangent stiffness, s
    sense : (m,) the loaded flank of gear 1, 1 or -1: the table is that of 1, or of -1 turned about the line of centres
    """

    shape: Integers
    axes: Integers
    values: Floats
    root: Floats
    knots: Floats
    first: Integers
    weights: Floats
    lowest: Floats
    centre: Floats
    tilt: Floats
    back: Floats
    back_tilt: Floats
    nominal: Floats
    backlash: Floats
    back_phase: Floats
    damping_time: Floats
    sense: Floats


class Scratch(NamedTuple):
    """Memory of the law.

    Attributes
    ----------
    basis : (3, 3, 4) weights of the nodes by axis and order of derivative
    node : (3,) first node on each axis
    part : (2, 5) sums over one axis
    cubic : (9, 5) the surface's derivatives in the order of `ORDERS`, over one load piece
    law : (7,) force (N), tangent stiffness (N/m), potential (J), its derivatives by centre distance (N), by
        misalignment (N m) and by pmc (J), 1 where an axis was left
    """

    basis: Floats
    node: Integers
    part: Floats
    cubic: Floats
    law: Floats


@compiled
def scratch_memory() -> Scratch:
    """Memory for `surface_law`."""
    return Scratch(np.zeros((3, 3, 4)), np.zeros(3, dtype=np.int64), np.zeros((2, 5)), np.zeros((9, 5)), np.zeros(7))


@kernel
def piece_at(scaled: float, pieces: int) -> int:
    """Find the piece that holds a place in [0, pieces]; one of them for any number, also one that is not finite.

    A state that diverges passes through angles that are no numbers, or that no integer can hold: what the processor
    makes of these would read outside the array. Clamping the integer costs nothing; clamping the number, 4 % of a step.
    """
    return max(0, min(int(scaled), pieces - 1))


@kernel
def place_in_cycle(pmc: float, positions: int, node: Integers, basis: Floats) -> None:
    """Weights of the four positions around pmc, and their derivatives per cycle."""
    basis[:] = 0.0
    if positions == 1:
        node[0] = 0
        basis[0, 0] = 1.0
        return
    scaled = (pmc - math.floor(pmc)) * positions
    piece = piece_at(scaled, positions)
    t = scaled - piece
    node[0] = piece - 1 if piece > 0 else positions - 1
    basis[0, 0] = 0.5 * t * (2.0 * t - 1.0 - t * t)
    basis[0, 1] = 0.5 * (2.0 + t * t * (3.0 * t - 5.0))
    basis[0, 2] = 0.5 * t * (1.0 + t * (4.0 - 3.0 * t))
    basis[0, 3] = 0.5 * t * t * (t - 1.0)
    basis[1, 0] = 0.5 * (t * (4.0 - 3.0 * t) - 1.0) * positions
    basis[1, 1] = 0.5 * t * (9.0 * t - 10.0) * positions
    basis[1, 2] = 0.5 * (1.0 + t * (8.0 - 9.0 * t)) * positions
    basis[1, 3] = 0.5 * t * (3.0 * t - 2.0) * positions


@kernel
def place_on_axis(x: float, count: int, knots: Floats, first: Integers, weights: Floats, basis: Floats) -> int:
    """Weights of the nodes near x with two derivatives; the interval, or -1 - interval where x is outside the axis."""
    if count == 1:
        basis[:] = 0.0
        basis[0, 0] = 1.0
        return 0
    i = 0
    while i < count - 2 and x >= knots[i + 1]:
        i += 1
    step = knots[i + 1] - knots[i]
    whole = (x - knots[i]) / step
    t = min(1.0, max(0.0, whole))
    beyond = whole - t
    for a in range(4):
        w = weights[i, a]
        slope = w[1] + t * (2.0 * w[2] + t * 3.0 * w[3])
        basis[0, a] = w[0] + t * (w[1] + t * (w[2] + t * w[3])) + beyond * slope
        basis[1, a] = slope / step
        basis[2, a] = (2.0 * w[2] + t * 6.0 * w[3]) / (step * step) if beyond == 0.0 else 0.0
    return i if beyond == 0.0 else -1 - i


@kernel
def contract_for_force(values: Floats, shape: Integers, piece: int, memory: Scratch) -> None:
    """Fill `cubic` with the surface and its slopes over centre distance and misalignment, one axis after the other."""
    basis, node, cubic, part = memory.basis, memory.node, memory.cubic, memory.part
    stride = 5 * shape[3]
    for d in range(3):
        for j in range(5):
            cubic[d, j] = 0.0
    for p in range(4 if shape[0] > 1 else 1):
        position = node[0] + p
        while position >= shape[0]:
            position -= shape[0]
        place = basis[0, 0, p]
        for c in range(min(4, shape[1])):
            start = 5 * (((position * shape[1] + node[1] + c) * shape[2] + node[2]) * shape[3] + piece)
            for j in range(5):
                part[0, j], part[1, j] = 0.0, 0.0
            for a in range(min(4, shape[2])):
                straight, sloping = basis[2, 0, a], basis[2, 1, a]
                for j in range(5):
                    value = values[start + j]
                    part[0, j] += straight * value
                    part[1, j] += sloping * value
                start += stride
            straight, sloping = place * basis[1, 0, c], place * basis[1, 1, c]
            for j in range(5):
                cubic[0, j] += straight * part[0, j]
                cubic[1, j] += sloping * part[0, j]
                cubic[2, j] += straight * part[1, j]


@kernel
def contract(values: Floats, shape: Integers, piece: int, count: int, memory: Scratch) -> None:
    """Fill `cubic` with the first `count` derivatives of the surface over one load piece."""
    if count == FIRST_TWO:
        contract_for_force(values, shape, piece, memory)
        return
    cubic, basis, node = memory.cubic, memory.basis, memory.node
    for d in range(count):
        for j in range(5):
            cubic[d, j] = 0.0
    across, along = min(4, shape[1]), min(4, shape[2])
    for p in range(4 if shape[0] > 1 else 1):
        position = node[0] + p
        while position >= shape[0]:
            position -= shape[0]
        for c in range(across):
            start = ((position * shape[1] + node[1] + c) * shape[2] + node[2]) * shape[3] + piece
            for a in range(along):
                o = 5 * (start + a * shape[3])
                for d in range(count):
                    weight = basis[0, ORDERS[d, 0], p] * basis[1, ORDERS[d, 1], c] * basis[2, ORDERS[d, 2], a]
                    for j in range(5):
                        cubic[d, j] += weight * values[o + j]


@kernel
def energy(c: Floats, start: float, step: float, t: float) -> float:
    """Integral of s over the force from zero to place t of a load piece, c (5,)."""
    level = t * (c[0] + t * (c[1] / 2.0 + t * (c[2] / 3.0 + t * c[3] / 4.0)))
    rising = t * t * (c[0] / 2.0 + t * (c[1] / 3.0 + t * (c[2] / 4.0 + t * c[3] / 5.0)))
    value: float = c[4] + 2.0 * step * (start * level + step * rising)
    return value


@kernel
def place_on_piece(delta: float, c: Floats, flat: bool) -> float:
    """Place t in [0, 1] with s(t) = delta on a rising cubic; flat: its slope at 0 may vanish."""
    low, high = 0.0, 1.0
    t = (delta - c[0]) / (c[1] + c[2] + c[3])
    if flat:
        t = math.sqrt(max(0.0, t))
    t = min(1.0, max(0.0, t))
    for _ in range(ROUNDS):
        miss = c[0] + t * (c[1] + t * (c[2] + t * c[3])) - delta
        if miss > 0.0:
            high = t
        else:
            low = t
        slope = c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])
        guess = t - miss / slope if slope > 0.0 else -1.0
        if not (low <= guess <= high):
            guess = 0.5 * (low + high)
        if abs(guess - t) <= 1e-14:
            break
        t = guess
    place: float = t
    return place


@kernel
def surface_law(
    delta: float,
    pmc: float,
    centre: float,
    misalignment: float,
    m: int,
    tables: TableArrays,
    guess: int,
    count: int,
    memory: Scratch,
) -> tuple[int, float]:
    """Fill `memory.law` for the deflection delta (m) of one flank of mesh m.

    Parameters
    ----------
    guess : load piece where the search begins; it does not change the result
    count : derivatives wanted, at least `FIRST_TWO`

    Returns
    -------
    piece : int
        Load piece of the solution, whose cubics are left in `memory.cubic`.
    t : float
        Place in it: below 0 where the flanks are apart, above 1 beyond the last load.
    """
    law, cubic, shape = memory.law, memory.cubic, tables.shape[m]
    for i in range(7):
        law[i] = 0.0
    place_in_cycle(pmc, shape[0], memory.node, memory.basis[0])
    for axis in range(2):
        x = centre if axis == 0 else misalignment
        i = place_on_axis(
            x, tables.axes[m, axis], tables.knots[m, axis], tables.first[m, axis], tables.weights[m, axis],
            memory.basis[1 + axis],
        )  # fmt: skip
        if i < 0:
            law[6] = 1.0
            i = -1 - i
        memory.node[1 + axis] = tables.first[m, axis, i]
    last = shape[3] - 1
    piece = min(max(guess, 0), last)
    c = cubic[0]
    moved = 0
    while True:
        contract(tables.values[m], shape, piece, count, memory)
        if delta < c[0] and piece > 0 and moved <= 0:
            moved = -1
        elif delta > c[0] + c[1] + c[2] + c[3] and piece < last and moved >= 0:
            moved = 1
        else:
            break
        piece += moved
    start = tables.root[m, piece]
    step = tables.root[m, piece + 1] - start
    if delta <= c[0] and piece == 0:
        return 0, -1.0
    end = c[0] + c[1] + c[2] + c[3]
    if delta > end and piece == last:
        law[6] = 1.0
        beyond_last(delta, start, step, count, memory)
        return piece, 2.0
    t = place_on_piece(delta, c, piece == 0)
    root = start + step * t
    slope = c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])
    law[0] = root * root
    law[1] = 2.0 * root * step / slope if slope > 0.0 else 0.0
    law[2] = law[0] * delta - energy(c, start, step, t)
    for d in range(1, min(count, 4)):
        law[2 + d] = -energy(cubic[d], start, step, t)
    return piece, t


@kernel
def beyond_last(delta: float, start: float, step: float, count: int, memory: Scratch) -> None:
    """Fill `memory.law` beyond the last load: the deflection goes on in proportion to the force."""
    law, cubic = memory.law, memory.cubic
    c = cubic[0]
    per_force = 2.0 * (start + step) * step
    end, slope = c[0] + c[1] + c[2] + c[3], (c[1] + 2.0 * c[2] + 3.0 * c[3]) / per_force
    more = (delta - end) / slope
    law[0] = (start + step) ** 2 + more
    law[1] = 1.0 / slope
    law[2] = law[0] * delta - energy(c, start, step, 1.0) - more * (end + 0.5 * slope * more)
    for d in range(1, min(count, 4)):
        g = cubic[d]
        rate = (g[1] + 2.0 * g[2] + 3.0 * g[3]) / per_force
        law[2 + d] = -energy(g, start, step, 1.0) - more * (g[0] + g[1] + g[2] + g[3] + 0.5 * rate * more)


@kernel
def surface_tangent(t: float, piece: int, m: int, tables: TableArrays, memory: Scratch, out: Floats) -> None:
    """Second derivatives after `surface_law` with all derivatives asked for.

    Parameters
    ----------
    out : (4, 4) array
        Derivatives of F, dU/da, dU/d gamma and of the tangent stiffness (rows) by delta, a, gamma and pmc (columns).
    """
    out[:] = 0.0
    if t < 0.0:
        return
    start = tables.root[m, piece]
    step = tables.root[m, piece + 1] - start
    inside = min(t, 1.0)
    root = start + step * inside
    law, cubic = memory.law, memory.cubic
    more = law[0] - root * root if t > 1.0 else 0.0
    k = law[1]
    for d in range(4):  # delta, then the first derivatives of the surface in its order
        c = cubic[d]
        rising = (c[1] + inside * (2.0 * c[2] + inside * 3.0 * c[3])) / step
        bending = (2.0 * c[2] + 6.0 * inside * c[3]) / (step * step)
        per_force = rising / (2.0 * root)
        curvature = (bending - rising / root) / (4.0 * root * root)
        value = c[0] + inside * (c[1] + inside * (c[2] + inside * c[3])) + more * per_force
        if d == 0:
            second = 0.0 if t > 1.0 else curvature
            out[0, 0], out[3, 0] = k, -(k**3) * second
        else:
            out[0, d] = -k * value
            out[3, d] = -k * k * (per_force + second * out[0, d])
    for row in range(1, 3):
        out[row, 0] = out[0, row]
        for column in range(1, 4):
            twice = 3 + row + column - 1 if column < 3 else 6 + row
            g = cubic[twice]
            slope = (g[1] + 2.0 * g[2] + 3.0 * g[3]) / (2.0 * root * step)
            across = energy(g, start, step, inside) + more * (g[0] + g[1] + g[2] + g[3] + 0.5 * slope * more) * (
                1.0 if t > 1.0 else 0.0
            )
            # dU*/dx at given force, plus the force's own change at given deflection
            out[row, column] = -across - (-out[0, row] / k) * out[0, column]
