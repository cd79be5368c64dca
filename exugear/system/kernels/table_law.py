r"""Compiled model of a mesh from its table: force from deflection, position and relative position of the gears.

On a surface s(pmc, a, gamma, F) of static transmission error over the mesh cycle, centre distance, misalignment and
line-of-action force (`fe_ste.transmission_error.surface`), the force at a deflection delta is the F with s = delta;
below s at no load the flanks are separated. With the complementary energy U*(F) = int_0^F s dF

    U = F delta - U*,   dU/d delta = F,   dU/da = -dU*/da,   dU/d gamma = -dU*/d gamma,   dF/d delta = 1 / (ds/dF)

so that one potential gives the mesh force, the force between the axes and the moment caused by misalignment. The
opposite flank has the same surface seen from the other end of the gear: gamma changes its sign.

The functions of the law allocate nothing: they work in memory that the caller takes from `scratch_memory`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from exugear.system.kernels.cubics import piece_at
from fe_ste.tools.arrays import Booleans, Floats, Integers
from fe_ste.tools.compilation import compiled, kernel
from fe_ste.tools.octets import all_eight, eight, put

ORDERS = np.array(
    [[0, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 2, 0], [0, 1, 1], [0, 0, 2], [1, 1, 0], [1, 0, 1]],
    dtype=np.int64,
)
"""Derivatives of the surface in this order: times by pmc, by centre distance, by misalignment."""
ENERGY_DERIVATIVES = 4
"""Number of them that force, energy and power need: value and all slopes; a tangent needs all."""
DAMPING_DERIVATIVES = 7
"""Number of them that damping needs, which goes with the tangent at a frozen position."""
ROUNDS = 60
"""Newton and bisection steps at most: bisection alone would reach round-off."""

POSITIONS, DISTANCES, MISALIGNMENTS, LOAD_PIECES = range(4)
"""Columns of `TableArrays.shape`."""
AXIS_PMC, AXIS_DISTANCE, AXIS_MISALIGNMENT = range(3)
"""Axes of `Scratch.basis` and `Scratch.node`."""
NOMINAL_DEFLECTION, NOMINAL_DISTANCE, NOMINAL_MISALIGNMENT = range(3)
"""Columns of `TableArrays.nominal`."""
CUBIC_SIZE, NODE_SIZE = 5, 8
"""Number of values of a load piece, and the space reserved for them: padded with zeros for SIMD vectors."""
ENERGY_BELOW = 4
"""Behind the four coefficients of s over a load piece: the integral of s over the force up to the piece's start."""
LAW_FORCE, LAW_STIFFNESS, LAW_POTENTIAL, LAW_BY_DISTANCE, LAW_BY_MISALIGNMENT, LAW_BY_PMC, LAW_OUTSIDE = range(7)
"""Entries of `Scratch.law`."""
LAW_SIZE = 7
LEFT_TABLE, GUESSED = 1.0, 2.0
"""Possible values at `LAW_OUTSIDE` other than zero: an axis was left, or states that have not converged were used."""
NODE_WIDTH = 1e-6
"""Share of an interval next to a node that counts as the node. States acting only on the other side of the node have a
weight of less than 3e-12 in the value there, and 6e-6 in the slope over the interval."""
BY_DISTANCE, BY_MISALIGNMENT, OF_DISTANCE, OF_BOTH, OF_MISALIGNMENT = range(5)
"""Entries of what `surface_damping` fills."""
DAMPING_SIZE = 5


class TableArrays(NamedTuple):
    """Tables of all meshes; m meshes, those of another law with zeros."""

    shape: Integers
    """(m, 4) positions, centre distances, values and slopes along misalignment, load pieces."""
    axes: Integers
    """(m, 2) number of knots of centre distance and misalignment."""
    values: Floats
    """(m, n) `fe_ste.transmission_error.surface.SteSurface.coefficients`, flat, the last axis filled up to 8."""
    root: Floats
    """(m, l + 1) knots of the root of F_bt, sqrt(N)."""
    knots: Floats
    """(m, 2, k) knots of centre distance (m) and misalignment (rad)."""
    first_node: Integers
    """(m, 2, k) first node that acts in each interval."""
    weights: Floats
    """(m, 2, k, 4, 4) coefficients of the nodes' weights in each interval."""
    lowest: Floats
    """(m,) deflection below which the flanks are apart in every position, m."""
    centre: Floats
    misalignment: Floats
    """(m, 12) rows of centre distance and misalignment, about the bodies' nodes."""
    back: Floats
    back_misalignment: Floats
    """(m, 12) rows of the other flank's deflection and misalignment."""
    nominal: Floats
    """(m, 3) deflection (m), centre distance (m), misalignment (rad) of gears in their nominal place."""
    backlash: Floats
    """(m,) approach from flank to flank along the transverse line of action, m."""
    back_phase: Floats
    """(m,) position of the other flank in its mesh cycle at zero angles."""
    damping_time: Floats
    """(m,) damping over tangent stiffness, s."""
    sense: Floats
    """(m,) the loaded flank of gear 1, 1 or -1: the table is that of 1, or of -1 turned about the line of centres."""
    has_guesses: Integers
    """(m,) 1 for states that have not converged and are interpolated from neighbours."""
    acting_guesses: Booleans
    """(m, k) where one of these acts (`SteSurface.acting_guesses`, flat)."""


class Scratch(NamedTuple):
    """Memory of the law."""

    basis: Floats
    """(3, 3, 4) weights of the nodes by axis and order of derivative."""
    node: Integers
    """(3,) first node on each axis."""
    cubic: Floats
    """(9, 8) the surface's derivatives in the order of `ORDERS`, over one load piece, filled up."""
    law: Floats
    """(7,) force (N), tangent stiffness (N/m), potential (J), its derivatives by centre distance (N), misalignment
    (N m) and by pmc (J), `LEFT_TABLE` where an axis was left, `GUESSED` near states that have not converged."""


@compiled
def scratch_memory() -> Scratch:
    """Memory for `surface_law`."""
    return Scratch(
        np.zeros((3, 3, 4)),
        np.zeros(3, dtype=np.int64),
        np.zeros((9, NODE_SIZE)),
        np.zeros(LAW_SIZE),
    )


@kernel
def weigh_positions(pmc: float, positions: int, node: Integers, basis: Floats) -> None:
    """Weights of the four positions around pmc, and their derivatives per cycle: Catmull-Rom splines, periodic."""
    basis[:] = 0.0
    if positions == 1:
        node[AXIS_PMC] = 0
        basis[0, 0] = 1.0
        return
    scaled = (pmc - math.floor(pmc)) * positions
    piece = piece_at(scaled, positions)
    t = scaled - piece
    # Two positions on either side act; the first of them may lie before the start of the cycle.
    node[AXIS_PMC] = piece - 1 if piece > 0 else positions - 1
    basis[0, 0] = 0.5 * t * (2.0 * t - 1.0 - t * t)
    basis[0, 1] = 0.5 * (2.0 + t * t * (3.0 * t - 5.0))
    basis[0, 2] = 0.5 * t * (1.0 + t * (4.0 - 3.0 * t))
    basis[0, 3] = 0.5 * t * t * (t - 1.0)
    # Derivatives of the same polynomials, from per piece to per cycle.
    basis[1, 0] = 0.5 * (t * (4.0 - 3.0 * t) - 1.0) * positions
    basis[1, 1] = 0.5 * t * (9.0 * t - 10.0) * positions
    basis[1, 2] = 0.5 * (1.0 + t * (8.0 - 9.0 * t)) * positions
    basis[1, 3] = 0.5 * t * (3.0 * t - 2.0) * positions


@kernel
def weigh_nodes(x: float, count: int, knots: Floats, weights: Floats, basis: Floats) -> int:
    """Weights of the nodes near x with two derivatives; the interval, or -1 - interval where x is outside the axis."""
    if count == 1:
        basis[:] = 0.0
        basis[0, 0] = 1.0
        return 0
    # Axes have a handful of knots: a search from the left is faster than bisection.
    i = 0
    while i < count - 2 and x >= knots[i + 1]:
        i += 1
    step = knots[i + 1] - knots[i]
    whole = (x - knots[i]) / step
    # Outside the axis the weights go on along their tangent, so that the force stays continuous there.
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
    """Fill `cubic` with the surface and its three slopes over one load piece, one axis after the other."""
    basis, node, cubic = memory.basis, memory.node, memory.cubic
    stride = NODE_SIZE * shape[LOAD_PIECES]
    level = all_eight(0.0)
    by_distance, by_misalignment, by_pmc = level, level, level
    for p in range(4 if shape[POSITIONS] > 1 else 1):
        # The mesh cycle closes: behind the last position comes the first.
        position = node[AXIS_PMC] + p
        while position >= shape[POSITIONS]:
            position -= shape[POSITIONS]
        for c in range(min(4, shape[DISTANCES])):
            row = (position * shape[DISTANCES] + node[AXIS_DISTANCE] + c) * shape[MISALIGNMENTS]
            start = NODE_SIZE * ((row + node[AXIS_MISALIGNMENT]) * shape[LOAD_PIECES] + piece)
            # The innermost axis is summed once for value and slope: half the products of a sum over all three axes.
            part, slope = all_eight(0.0), all_eight(0.0)
            for a in range(min(4, shape[MISALIGNMENTS])):
                entries = eight(values, start)
                part = part + entries * basis[AXIS_MISALIGNMENT, 0, a]
                slope = slope + entries * basis[AXIS_MISALIGNMENT, 1, a]
                start += stride
            of_position, of_distance = basis[AXIS_PMC, 0, p], basis[AXIS_DISTANCE, 0, c]
            level = level + part * (of_position * of_distance)
            by_distance = by_distance + part * (of_position * basis[AXIS_DISTANCE, 1, c])
            by_misalignment = by_misalignment + slope * (of_position * of_distance)
            by_pmc = by_pmc + part * (basis[AXIS_PMC, 1, p] * of_distance)
    put(cubic[0], 0, level)
    put(cubic[1], 0, by_distance)
    put(cubic[2], 0, by_misalignment)
    put(cubic[3], 0, by_pmc)


@kernel
def contract_for_damping(values: Floats, shape: Integers, piece: int, memory: Scratch) -> None:
    """Do as `contract_for_force`, second derivatives by centre distance and misalignment included."""
    basis, node, cubic = memory.basis, memory.node, memory.cubic
    stride = NODE_SIZE * shape[LOAD_PIECES]
    level = all_eight(0.0)
    by_distance, by_misalignment, by_pmc = level, level, level
    by_distances, by_both, by_misalignments = level, level, level
    for p in range(4 if shape[POSITIONS] > 1 else 1):
        position = node[AXIS_PMC] + p
        while position >= shape[POSITIONS]:
            position -= shape[POSITIONS]
        for c in range(min(4, shape[DISTANCES])):
            row = (position * shape[DISTANCES] + node[AXIS_DISTANCE] + c) * shape[MISALIGNMENTS]
            start = NODE_SIZE * ((row + node[AXIS_MISALIGNMENT]) * shape[LOAD_PIECES] + piece)
            part, slope, bend = all_eight(0.0), all_eight(0.0), all_eight(0.0)
            for a in range(min(4, shape[MISALIGNMENTS])):
                entries = eight(values, start)
                part = part + entries * basis[AXIS_MISALIGNMENT, 0, a]
                slope = slope + entries * basis[AXIS_MISALIGNMENT, 1, a]
                bend = bend + entries * basis[AXIS_MISALIGNMENT, 2, a]
                start += stride
            of_position, of_distance = basis[AXIS_PMC, 0, p], basis[AXIS_DISTANCE, 0, c]
            along, across = of_position * basis[AXIS_DISTANCE, 1, c], of_position * of_distance
            level = level + part * across
            by_distance = by_distance + part * along
            by_misalignment = by_misalignment + slope * across
            by_pmc = by_pmc + part * (basis[AXIS_PMC, 1, p] * of_distance)
            by_distances = by_distances + part * (of_position * basis[AXIS_DISTANCE, 2, c])
            by_both = by_both + slope * along
            by_misalignments = by_misalignments + bend * across
    put(cubic[0], 0, level)
    put(cubic[1], 0, by_distance)
    put(cubic[2], 0, by_misalignment)
    put(cubic[3], 0, by_pmc)
    put(cubic[4], 0, by_distances)
    put(cubic[5], 0, by_both)
    put(cubic[6], 0, by_misalignments)


@kernel
def contract(values: Floats, shape: Integers, piece: int, count: int, memory: Scratch) -> None:
    """Fill `cubic` with the first `count` derivatives of the surface over one load piece."""
    if count <= ENERGY_DERIVATIVES:
        contract_for_force(values, shape, piece, memory)
        return
    if count <= DAMPING_DERIVATIVES:
        contract_for_damping(values, shape, piece, memory)
        return
    cubic, basis, node = memory.cubic, memory.basis, memory.node
    for d in range(count):
        for j in range(CUBIC_SIZE):
            cubic[d, j] = 0.0
    distances, misalignments = min(4, shape[DISTANCES]), min(4, shape[MISALIGNMENTS])
    for p in range(4 if shape[POSITIONS] > 1 else 1):
        position = node[AXIS_PMC] + p
        while position >= shape[POSITIONS]:
            position -= shape[POSITIONS]
        for c in range(distances):
            row = (position * shape[DISTANCES] + node[AXIS_DISTANCE] + c) * shape[MISALIGNMENTS]
            start = (row + node[AXIS_MISALIGNMENT]) * shape[LOAD_PIECES] + piece
            for a in range(misalignments):
                o = NODE_SIZE * (start + a * shape[LOAD_PIECES])
                for d in range(count):
                    # The surface is a product of one-dimensional weights; so is each of its derivatives.
                    weight = (
                        basis[AXIS_PMC, ORDERS[d, 0], p]
                        * basis[AXIS_DISTANCE, ORDERS[d, 1], c]
                        * basis[AXIS_MISALIGNMENT, ORDERS[d, 2], a]
                    )
                    for j in range(CUBIC_SIZE):
                        cubic[d, j] += weight * values[o + j]


@kernel
def energy(c: Floats, start: float, step: float, t: float) -> float:
    """Integral of s over the force from zero to the position t of a load piece, c (5,)."""
    # s is a cubic in the root of the force, r = start + step t, so dF = 2 r dr: the integrals of s and of t s.
    level = t * (c[0] + t * (c[1] / 2.0 + t * (c[2] / 3.0 + t * c[3] / 4.0)))
    rising = t * t * (c[0] / 2.0 + t * (c[1] / 3.0 + t * (c[2] / 4.0 + t * c[3] / 5.0)))
    value: float = c[ENERGY_BELOW] + 2.0 * step * (start * level + step * rising)
    return value


@kernel
def position_on_piece(delta: float, c: Floats, flat: bool) -> float:
    """Solve s(t) = delta on a rising cubic for t in [0, 1]; flat: its slope at 0 may vanish.

    Newton's method, kept in a bracket that shrinks, and halving it where Newton leaves it (Press et al., Numerical
    Recipes, rtsafe).
    """
    low, high = 0.0, 1.0
    # First guess: the chord; where the slope may vanish, the parabola through both ends.
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
    solution: float = t
    return solution


@kernel
def node_or_interval(interval: int, t: float) -> int:
    """Index along an axis on which nodes and intervals alternate, at the share t of an interval."""
    if t < NODE_WIDTH:
        return 2 * interval
    if t > 1.0 - NODE_WIDTH:
        return 2 * interval + 2
    return 2 * interval + 1


@kernel
def guess_acts(
    pmc: float, centre: float, misalignment: float, piece: int, t: float, m: int, tables: TableArrays, node: Integers
) -> bool:
    """Whether a state that has not converged has weight at a position of the axes and the share t of a load piece."""
    shape = tables.shape[m]
    # Four positions act between the second and the third of them; a mean over the cycle has one.
    place = 1
    if shape[POSITIONS] > 1:
        scaled = (pmc - math.floor(pmc)) * shape[POSITIONS]
        interval = (node[AXIS_PMC] + 1) % shape[POSITIONS]
        place = node_or_interval(interval, scaled - interval)
    x = centre
    for axis in range(2):
        knots = tables.knots[m, axis]
        intervals = max(1, tables.axes[m, axis] - 1)
        i = 0
        while i < intervals - 1 and x >= knots[i + 1]:
            i += 1
        share = 0.5
        if tables.axes[m, axis] > 1:
            share = (x - knots[i]) / (knots[i + 1] - knots[i])
        place = place * (2 * intervals + 1) + node_or_interval(i, share)
        x = misalignment
    acting: bool = tables.acting_guesses[m, place * (2 * shape[LOAD_PIECES] + 1) + node_or_interval(piece, t)]
    return acting


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
    count : derivatives wanted, at least `ENERGY_DERIVATIVES`

    Returns
    -------
    piece : load piece of the solution, whose cubics are left in `memory.cubic`
    t : position in it: below 0 where the flanks are apart, above 1 beyond the last load
    """
    law, cubic, shape = memory.law, memory.cubic, tables.shape[m]
    for i in range(LAW_SIZE):
        law[i] = 0.0
    # Weights on the three axes; with them the surface becomes a function of the load alone.
    weigh_positions(pmc, shape[POSITIONS], memory.node, memory.basis[AXIS_PMC])
    for axis in range(2):
        x = centre if axis == 0 else misalignment
        i = weigh_nodes(
            x, tables.axes[m, axis], tables.knots[m, axis], tables.weights[m, axis], memory.basis[AXIS_DISTANCE + axis]
        )
        if i < 0:
            law[LAW_OUTSIDE] = LEFT_TABLE
            i = -1 - i
        memory.node[AXIS_DISTANCE + axis] = tables.first_node[m, axis, i]
    # Walk to the load piece whose ends enclose delta. In one direction only: where the surface is not monotonic by
    # round-off, a walk that may turn round would not end.
    last = shape[LOAD_PIECES] - 1
    piece = min(max(guess, 0), last)
    c = cubic[0]
    direction = 0
    while True:
        contract(tables.values[m], shape, piece, count, memory)
        if delta < c[0] and piece > 0 and direction <= 0:
            direction = -1
        elif delta > c[0] + c[1] + c[2] + c[3] and piece < last and direction >= 0:
            direction = 1
        else:
            break
        piece += direction
    start = tables.root[m, piece]
    step = tables.root[m, piece + 1] - start
    # Below the surface at no load the flanks are apart.
    if delta <= c[0] and piece == 0:
        return 0, -1.0
    end = c[0] + c[1] + c[2] + c[3]
    beyond = delta > end and piece == last
    t = 2.0
    if not beyond:
        t = position_on_piece(delta, c, piece == 0)
    if tables.has_guesses[m] == 1 and guess_acts(pmc, centre, misalignment, piece, t, m, tables, memory.node):
        law[LAW_OUTSIDE] = GUESSED
    if beyond:
        law[LAW_OUTSIDE] = max(law[LAW_OUTSIDE], LEFT_TABLE)
        extrapolate_beyond_last(delta, start, step, count, memory)
        return piece, t
    # On the piece: F = r^2, dF/d delta = 2 r (dr/dt) / (ds/dt), U = F delta - U*, dU/dx = -dU*/dx.
    root = start + step * t
    slope = c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])
    law[LAW_FORCE] = root * root
    law[LAW_STIFFNESS] = 2.0 * root * step / slope if slope > 0.0 else 0.0
    law[LAW_POTENTIAL] = law[LAW_FORCE] * delta - energy(c, start, step, t)
    for d in range(1, min(count, ENERGY_DERIVATIVES)):
        law[LAW_POTENTIAL + d] = -energy(cubic[d], start, step, t)
    return piece, t


@kernel
def extrapolate_beyond_last(delta: float, start: float, step: float, count: int, memory: Scratch) -> None:
    """Fill `memory.law` beyond the last load: the deflection grows in proportion to the force."""
    law, cubic = memory.law, memory.cubic
    c = cubic[0]
    # Slope ds/dF at the end of the last piece: (ds/dt) / (dF/dt).
    per_force = 2.0 * (start + step) * step
    end, slope = c[0] + c[1] + c[2] + c[3], (c[1] + 2.0 * c[2] + 3.0 * c[3]) / per_force
    more = (delta - end) / slope
    law[LAW_FORCE] = (start + step) ** 2 + more
    law[LAW_STIFFNESS] = 1.0 / slope
    # Beyond the end s is a straight line: its integral is a trapezium.
    law[LAW_POTENTIAL] = law[LAW_FORCE] * delta - energy(c, start, step, 1.0) - more * (end + 0.5 * slope * more)
    for d in range(1, min(count, ENERGY_DERIVATIVES)):
        g = cubic[d]
        rate = (g[1] + 2.0 * g[2] + 3.0 * g[3]) / per_force
        law[LAW_POTENTIAL + d] = -energy(g, start, step, 1.0) - more * (g[0] + g[1] + g[2] + g[3] + 0.5 * rate * more)


@kernel
def surface_tangent(t: float, piece: int, m: int, tables: TableArrays, memory: Scratch, out: Floats) -> None:
    """Second derivatives after `surface_law` with all derivatives asked for.

    Parameters
    ----------
    out : (4, 4)
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
    more = law[LAW_FORCE] - root * root if t > 1.0 else 0.0
    k = law[LAW_STIFFNESS]
    for d in range(4):  # delta, then the first derivatives of the surface in its order
        c = cubic[d]
        # Derivatives by the root r, then by F = r^2: ds/dF = s' / 2r, d2s/dF2 = (s'' - s'/r) / 4r^2.
        rising = (c[1] + inside * (2.0 * c[2] + inside * 3.0 * c[3])) / step
        bending = (2.0 * c[2] + 6.0 * inside * c[3]) / (step * step)
        per_force = rising / (2.0 * root)
        curvature = (bending - rising / root) / (4.0 * root * root)
        value = c[0] + inside * (c[1] + inside * (c[2] + inside * c[3])) + more * per_force
        if d == 0:
            # From s(F) = delta: dF = k d delta, dk = -k^3 s'' d delta; beyond the last load s'' = 0.
            second = 0.0 if t > 1.0 else curvature
            out[0, 0], out[3, 0] = k, -(k**3) * second
        else:
            # At fixed delta a change x of the surface is made up for by the force: dF/dx = -k ds/dx.
            out[0, d] = -k * value
            out[3, d] = -k * k * (per_force + second * out[0, d])
    for row in range(1, 3):
        out[row, 0] = out[0, row]
        for column in range(1, 4):
            # Second derivative in `ORDERS`: behind the first ones, pairs of a and gamma, then those with pmc.
            twice = 3 + row + column - 1 if column < 3 else 6 + row
            g = cubic[twice]
            slope = (g[1] + 2.0 * g[2] + 3.0 * g[3]) / (2.0 * root * step)
            across = energy(g, start, step, inside) + more * (g[0] + g[1] + g[2] + g[3] + 0.5 * slope * more) * (
                1.0 if t > 1.0 else 0.0
            )
            # dU*/dx at given force, plus the force's own change at given deflection
            out[row, column] = -across - (-out[0, row] / k) * out[0, column]


@kernel
def surface_damping(t: float, piece: int, m: int, tables: TableArrays, memory: Scratch, out: Floats) -> None:
    """Compute directions and sizes of the damping, proportional to the tangent, after `surface_law` with derivatives.

    At a frozen position the tangent of the potential in x = (delta, a, gamma) is that of the force on
    e = delta - s_a a - s_gamma gamma at a constant load, plus the part at constant load: -U*_xx. Where the
    tangent would be negative, its diagonal is limited to zero, and its off-diagonal entries to the range of a positive
    semidefinite damper.

    Parameters
    ----------
    out : (5,)
        s_a (m/m), s_gamma (m/rad); the tangent at constant load by a twice (N/m), a and gamma (N), gamma twice (N m).
    """
    for i in range(DAMPING_SIZE):
        out[i] = 0.0
    if t < 0.0:
        return
    start = tables.root[m, piece]
    step = tables.root[m, piece + 1] - start
    inside = min(t, 1.0)
    cubic = memory.cubic
    # Beyond the last load the surface goes on in proportion to the force: `more` of it, in ends of the last piece.
    more, per_force = 0.0, 2.0 * (start + step) * step
    if t > 1.0:
        more = memory.law[LAW_FORCE] - (start + step) ** 2
    for d in range(1, 3):
        c = cubic[d]
        rate = (c[1] + 2.0 * c[2] + 3.0 * c[3]) / per_force
        out[BY_DISTANCE + d - 1] = c[0] + inside * (c[1] + inside * (c[2] + inside * c[3])) + more * rate
    for d in range(4, 7):
        c = cubic[d]
        rate = (c[1] + 2.0 * c[2] + 3.0 * c[3]) / per_force
        beyond = more * (c[0] + c[1] + c[2] + c[3] + 0.5 * rate * more)
        out[OF_DISTANCE + d - 4] = -energy(c, start, step, inside) - beyond
    out[OF_DISTANCE], out[OF_MISALIGNMENT] = max(0.0, out[OF_DISTANCE]), max(0.0, out[OF_MISALIGNMENT])
    most = math.sqrt(out[OF_DISTANCE] * out[OF_MISALIGNMENT])
    out[OF_BOTH] = min(most, max(-most, out[OF_BOTH]))
