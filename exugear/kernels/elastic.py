"""Compiled laws of elastic bodies on arrays of coordinates: forces, accelerations and energies.

A body's matrices fall into blocks: for a shaft two planes of bending, torsion and stretching. Each block works on its
own coordinates, gathered from the state; gyroscopic forces come from the velocities of a partner block, times the
spin speed Omega = s . v that the body's momentum about its axis defines. Nothing is allocated here.

Seats have the coordinates of `exugear.kernels.coordinates`; what vibrates between them, modal ones.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from fe_ste.tools.arrays import Booleans, Floats, Integers
from fe_ste.tools.compilation import kernel, summing_kernel
from fe_ste.tools.octets import all_eight, eight, sum_of


class ElasticArrays(NamedTuple):
    """Elastic bodies as b blocks with c coordinates in all.

    Attributes
    ----------
    first : (b + 1,) first entry of each block in `coordinate`, `spin` and `momentum`
    coordinate : (c,) position in the state
    spin : (c,) rigid spin of the body: 1 where a coordinate turns with it
    momentum : (c,) row s of the spin speed Omega = s . v
    turning : (b,) block whose coordinates hold the spin of the block's body
    partner : (b,) block whose velocities give gyroscopic forces, -1 for none
    square : (b,) first entry of each block in the matrices below, which hold them column by column
    stiffness, mass, inverse : blocks of K, M and the inverse of M
    across : (b,) first entry of each block in `gyroscopic`
    gyroscopic : blocks of G, rows of this block, columns of its partner
    damping_time : (b,) damping over stiffness, s
    """

    first: Integers
    coordinate: Integers
    spin: Floats
    momentum: Floats
    turning: Integers
    partner: Integers
    square: Integers
    stiffness: Floats
    mass: Floats
    inverse: Floats
    across: Integers
    gyroscopic: Floats
    damping_time: Floats


def no_elastic() -> ElasticArrays:
    """Arrays of a system without elastic bodies."""
    none, nothing = np.zeros(0, dtype=np.int64), np.zeros(0)
    first = np.zeros(1, dtype=np.int64)
    return ElasticArrays(
        first, none, nothing, nothing, none, none, none, nothing, nothing, nothing, none, nothing, nothing
    )


def scratch_for(elastic: ElasticArrays) -> Floats:
    """Memory that the functions below work in."""
    return np.zeros((2, 3 * int(np.diff(elastic.first).max(initial=1)) + LANES))


class ElasticMotion(NamedTuple):
    """The same blocks solved for their accelerations, arranged for speed.

    Attributes
    ----------
    first, coordinate, spin, momentum, turning, partner, damping_time : as in `ElasticArrays`
    acted : (b,) number of each block's first coordinates beyond which no outer force acts
    columns : (b,) columns of each block's matrix, filled up with zeros to a multiple of `LANES`
    begin : (b,) first entry of each block in `matrix`
    matrix : blocks row by row: M^-1 (its first columns), -M^-1 K, -M^-1 G, which act on outer forces, q + time v and
        Omega v of the partner; filled up with zeros to a multiple of `ROWS` rows
    """

    first: Integers
    coordinate: Integers
    spin: Floats
    momentum: Floats
    turning: Integers
    partner: Integers
    damping_time: Floats
    acted: Integers
    columns: Integers
    begin: Integers
    matrix: Floats


LANES, ROWS = 8, 4
"""Products taken together: what two registers of a processor hold, and of as many rows."""


def elastic_motion(elastic: ElasticArrays, acted: Booleans) -> ElasticMotion:
    """Solve all blocks for their accelerations.

    Parameters
    ----------
    elastic : ElasticArrays
    acted : (size,) array of bool
        Coordinates of the system that forces act on from outside: seats, not what goes on between them.
    """
    sizes = np.diff(elastic.first)
    across = np.where(elastic.partner >= 0, sizes[elastic.partner], 0)
    seats = [np.flatnonzero(acted[elastic.coordinate[begin:end]]) for begin, end in pairwise(elastic.first)]
    forces = np.array([seat.max(initial=-1) + 1 for seat in seats], dtype=np.int64)
    columns = -(-(forces + sizes + across) // LANES) * LANES
    blocks: list[Floats] = [np.zeros(0)]
    for b, size in enumerate(sizes):
        inverse, stiffness = (
            matrix[elastic.square[b] : elastic.square[b] + size**2].reshape(size, size).T
            for matrix in (elastic.inverse, elastic.stiffness)
        )
        begin = elastic.across[b]
        gyroscopic = elastic.gyroscopic[begin : begin + size * across[b]].reshape(across[b], size).T
        whole = np.zeros((-(-size // ROWS) * ROWS, columns[b]))
        known = np.hstack([inverse[:, : forces[b]], -inverse @ stiffness, -inverse @ gyroscopic])
        whole[:size, : known.shape[1]] = known
        blocks.append(whole.ravel())
    return ElasticMotion(
        first=elastic.first,
        coordinate=elastic.coordinate,
        spin=elastic.spin,
        momentum=elastic.momentum,
        turning=elastic.turning,
        partner=elastic.partner,
        damping_time=elastic.damping_time,
        acted=forces,
        columns=columns.astype(np.int64),
        begin=np.cumsum([block.size for block in blocks])[:-1].astype(np.int64),
        matrix=np.concatenate(blocks),
    )


@summing_kernel
def row_product(matrix: Floats, begin: int | np.uint64, given: Floats, count: int | np.uint64) -> float:
    """Scalar product of entries of a flat matrix, from `begin` on, with the first entries of a vector.

    Places without a sign spare the processor the question whether they count from the end, so that it takes several
    products at once.
    """
    total = 0.0
    start = np.uint64(begin)
    for j in range(np.uint64(count)):
        total += matrix[start + j] * given[j]
    return total


@kernel
def four_rows(matrix: Floats, begin: int, given: Floats, count: int) -> tuple[float, float, float, float]:
    """Scalar products of four neighbouring rows of a flat matrix, from `begin` on, with a vector (count,).

    Four at a time: the vector is read once for them, and four sums wait for each other less than one. The count is a
    multiple of `LANES`.
    """
    a = all_eight(0.0)
    b, c, d = a, a, a
    second, third, fourth = begin + count, begin + 2 * count, begin + 3 * count
    for j in range(0, count, LANES):
        x = eight(given, j)
        a = a + eight(matrix, begin + j) * x
        b = b + eight(matrix, second + j) * x
        c = c + eight(matrix, third + j) * x
        d = d + eight(matrix, fourth + j) * x
    return sum_of(a), sum_of(b), sum_of(c), sum_of(d)


@kernel
def set_rows(b: int, given: Floats, elastic: ElasticMotion, out: Floats) -> None:
    """Set the accelerations of block b to the products of its matrix with a vector."""
    begin, end, columns = elastic.first[b], elastic.first[b + 1], elastic.columns[b]
    row = elastic.begin[b]
    for i in range(begin, end, ROWS):
        first, second, third, fourth = four_rows(elastic.matrix, row, given, columns)
        out[elastic.coordinate[i]] = first
        if i + 1 < end:
            out[elastic.coordinate[i + 1]] = second
        if i + 2 < end:
            out[elastic.coordinate[i + 2]] = third
        if i + 3 < end:
            out[elastic.coordinate[i + 3]] = fourth
        row += ROWS * columns


@kernel
def lane_product(matrix: Floats, begin: int, given: Floats, count: int) -> float:
    """Scalar product of a row of a flat matrix, from `begin` on, with a vector (count,), a multiple of `LANES`."""
    total = all_eight(0.0)
    for j in range(0, count, LANES):
        total = total + eight(matrix, begin + j) * eight(given, j)
    return sum_of(total)


@kernel
def set_elastic_motion(
    q: Floats, v: Floats, f: Floats, elastic: ElasticMotion | None, given: Floats, out: Floats
) -> None:
    """Fill the accelerations of all elastic bodies under generalized forces f, their own forces left out, into out.

    As `add_elastic_forces` and `set_elastic_accelerations` together, in one pass over one matrix for each block.
    `given` has room for three times the largest block and `LANES`. Nothing is done without elastic bodies (None).
    """
    if elastic is None:
        return
    at = np.uint64  # places without a sign spare the question whether they count from the end: a third of the time
    for b in range(at(elastic.turning.size)):
        first, size, acted = at(elastic.first[b]), at(elastic.first[b + 1] - elastic.first[b]), at(elastic.acted[b])
        # What the matrix acts on: outer forces, q + time v without the common turning, Omega v of the partner, zeros.
        common = q[at(elastic.coordinate[first])] * elastic.spin[first]
        time = elastic.damping_time[b]
        for i in range(acted):
            given[i] = f[at(elastic.coordinate[first + i])]
        for i in range(size):
            j = at(elastic.coordinate[first + i])
            given[acted + i] = (q[j] - common * elastic.spin[first + i]) + time * v[j]
        known = acted + size
        if elastic.partner[b] >= 0:
            speed = 0.0
            block = at(elastic.turning[b])
            for i in range(at(elastic.first[block]), at(elastic.first[block + at(1)])):
                speed += elastic.momentum[i] * v[at(elastic.coordinate[i])]
            partner = at(elastic.partner[b])
            begin = at(elastic.first[partner])
            across = at(elastic.first[partner + at(1)]) - begin
            for i in range(across):
                given[known + i] = speed * v[at(elastic.coordinate[begin + i])]
            known += across
        columns = at(elastic.columns[b])
        for i in range(known, columns):
            given[i] = 0.0
        set_rows(b, given, elastic, out)


@kernel
def spin_speed(b: int, v: Floats, elastic: ElasticArrays) -> float:
    """Spin speed of the body of block b, rad/s."""
    speed = 0.0
    block = elastic.turning[b]
    for i in range(elastic.first[block], elastic.first[block + 1]):
        speed += elastic.momentum[i] * v[elastic.coordinate[i]]
    return speed


@kernel
def deformation(b: int, q: Floats, v: Floats, time: float, elastic: ElasticArrays, out: Floats) -> None:
    """Fill q + time v of block b, the turning of its first coordinate left out: a rigid spin deforms nothing.

    Angles grow without bound in a run; taking their common part out keeps their differences.
    """
    begin = np.uint64(elastic.first[b])
    common = q[elastic.coordinate[begin]] * elastic.spin[begin]
    for i in range(begin, np.uint64(elastic.first[b + 1])):
        j = np.uint64(elastic.coordinate[i])
        out[i - begin] = (q[j] - common * elastic.spin[i]) + time * v[j]


@kernel
def add_elastic_forces(q: Floats, v: Floats, elastic: ElasticArrays, scratch: Floats, f: Floats) -> None:
    """Add the elastic, damping and gyroscopic forces - K (q + time v) - Omega G v of all bodies to f."""
    given, sum_ = scratch[0], scratch[1]
    for b in range(elastic.turning.size):
        begin = elastic.first[b]
        size = elastic.first[b + 1] - begin
        deformation(b, q, v, elastic.damping_time[b], elastic, given)
        for i in range(size):
            sum_[i] = 0.0
        # Column by column: the inner loop then runs over neighbouring entries and needs no sum across lanes.
        column = elastic.square[b]
        for j in range(size):
            value = given[j]
            for i in range(size):
                sum_[i] += elastic.stiffness[column + i] * value
            column += size
        # Gyroscopic forces come from the other plane's velocities.
        partner = elastic.partner[b]
        if partner >= 0:
            speed = spin_speed(b, v, elastic)
            column = elastic.across[b]
            for j in range(elastic.first[partner], elastic.first[partner + 1]):
                value = speed * v[elastic.coordinate[j]]
                for i in range(size):
                    sum_[i] += elastic.gyroscopic[column + i] * value
                column += size
        for i in range(size):
            f[elastic.coordinate[begin + i]] -= sum_[i]


@kernel
def set_elastic_accelerations(f: Floats, elastic: ElasticArrays, scratch: Floats, out: Floats) -> None:
    """Fill the accelerations of all elastic bodies under generalized forces f into out."""
    sum_ = scratch[1]
    for b in range(elastic.turning.size):
        begin = elastic.first[b]
        size = elastic.first[b + 1] - begin
        for i in range(size):
            sum_[i] = 0.0
        column = elastic.square[b]
        for j in range(size):
            value = f[elastic.coordinate[begin + j]]
            for i in range(size):
                sum_[i] += elastic.inverse[column + i] * value
            column += size
        for i in range(size):
            out[elastic.coordinate[begin + i]] = sum_[i]


@kernel
def block_energy(b: int, x: Floats, matrix: Floats, elastic: ElasticArrays) -> float:
    """Scalar x' A x of a block's matrix with its own vector x."""
    size = np.uint64(elastic.first[b + 1] - elastic.first[b])
    total = 0.0
    column = np.uint64(elastic.square[b])
    for i in range(size):
        total += x[i] * row_product(matrix, column, x, size)
        column += size
    return total


@kernel
def elastic_energies(
    q: Floats, v: Floats, elastic: ElasticArrays | None, scratch: Floats
) -> tuple[float, float, float]:
    """Kinetic and elastic energy (J) of all elastic bodies, and the power that they damp (W); None: no such bodies."""
    kinetic, stored, damped = 0.0, 0.0, 0.0
    if elastic is None:
        return kinetic, stored, damped
    given = scratch[0]
    for b in range(elastic.turning.size):
        for i in range(elastic.first[b], elastic.first[b + 1]):
            given[i - elastic.first[b]] = v[elastic.coordinate[i]]
        kinetic += 0.5 * block_energy(b, given, elastic.mass, elastic)
        deformation(b, q, v, 0.0, elastic, given)
        stored += 0.5 * block_energy(b, given, elastic.stiffness, elastic)
        # Damping is a time times the stiffness: its power is that of the rates, without the common turning.
        deformation(b, v, v, 0.0, elastic, given)
        damped += elastic.damping_time[b] * block_energy(b, given, elastic.stiffness, elastic)
    return kinetic, stored, damped
