"""Compiled laws of elastic bodies on arrays of coordinates: forces, accelerations and energies.

A body's matrices fall into blocks: for a shaft two planes of bending, torsion and stretching. Each block works on its
own coordinates, gathered from the state; gyroscopic forces come from the velocities of a partner block, times the
spin speed Omega = s . v that the body's momentum about its axis defines. Compiled functions allocate nothing: they work
in memory that the caller takes from `scratch_for`.

Seats have the coordinates of `exugear.system.kernels.coordinates`; what vibrates between them, modal ones.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exugear.system.kernels.products import (
    add_rows,
    add_symmetric,
    add_symmetric_with_form,
    filled_up,
    laid_out,
    rectangular_tiles,
    square_form,
    symmetric_tiles,
)
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import kernel
from fe_ste.tools.octets import SIZE, aligned_zeros, all_eight, eight, eight_at, put, sum_of


class ElasticArrays(NamedTuple):
    """Elastic bodies as b blocks with c coordinates in all."""

    first: Integers
    """(b + 1,) first entry of each block in `coordinate`, `spin` and `momentum`."""
    coordinate: Integers
    """(c,) position in the state."""
    spin: Floats
    """(c,) rigid spin of the body: 1 where a coordinate turns with it."""
    momentum: Floats
    """(c,) row s of the spin speed Omega = s . v."""
    turning: Integers
    """(b,) block whose coordinates hold the spin of the block's body."""
    partner: Integers
    """(b,) block whose velocities give gyroscopic forces, -1 for none."""
    square: Integers
    """(b,) first entry of each block in the matrices below, which hold them column by column."""
    stiffness: Floats
    mass: Floats
    inverse: Floats
    """Blocks of K, M and the inverse of M."""
    across: Integers
    """(b,) first entry of each block in `gyroscopic`."""
    gyroscopic: Floats
    """Blocks of G, rows of this block, columns of its partner."""
    damping_time: Floats
    """(b,) damping over stiffness, s."""


def no_elastic() -> ElasticArrays:
    """Arrays of a system without elastic bodies."""
    none = np.zeros(0, dtype=np.int64)
    nothing = np.zeros(0)
    first = np.zeros(1, dtype=np.int64)
    return ElasticArrays(
        first, none, nothing, nothing, none, none, none, nothing, nothing, nothing, none, nothing, nothing
    )


def scratch_for(elastic: ElasticArrays | ElasticMotion) -> Floats:
    """Memory (3, n) that the functions below work in, for the largest block."""
    size = filled_up(int(np.diff(elastic.first).max(initial=1)))
    return aligned_zeros(3 * size).reshape(3, size)


class ElasticMotion(NamedTuple):
    """The same blocks arranged for speed, each filled up to a multiple of eight coordinates."""

    first: Integers
    """(b + 1,) first entry of each block in `coordinate`, `spin` and `momentum`."""
    sizes: Integers
    """(b,) coordinates of each block."""
    coordinate: Integers
    spin: Floats
    momentum: Floats
    """As in `ElasticArrays`; what fills them up is a block's first coordinate and zeros."""
    turning: Integers
    partner: Integers
    damping_time: Floats
    """As in `ElasticArrays`."""
    square: Integers
    """(b,) first entry of each block in `stiffness`, `mass` and `inverse`."""
    stiffness: Floats
    mass: Floats
    inverse: Floats
    """Tiles of -K, M and the inverse of M, see `exugear.system.kernels.products`."""
    across: Integers
    """(b,) first entry of each block in `gyroscopic`."""
    gyroscopic: Floats
    """Tiles of -G."""


def elastic_motion(elastic: ElasticArrays) -> ElasticMotion:
    """Arrange all blocks for `set_elastic_motion`."""
    sizes = np.diff(elastic.first)
    across = np.where(elastic.partner >= 0, sizes[elastic.partner], 0)
    first = np.cumsum([0, *(filled_up(int(n)) for n in sizes)]).astype(np.int64)
    places = np.concatenate([np.arange(n) + begin for n, begin in zip(sizes, first, strict=False)] or [np.zeros(0)])
    kept = places.astype(np.int64)
    coordinate = np.repeat(elastic.coordinate[elastic.first[:-1]], np.diff(first))
    coordinate[kept] = elastic.coordinate
    spin, momentum = np.zeros((2, first[-1]))
    spin[kept], momentum[kept] = elastic.spin, elastic.momentum

    def squares(matrices: Floats, sign: float) -> tuple[Floats, Integers]:
        blocks = (matrices[begin : begin + n**2].reshape(n, n) for begin, n in zip(elastic.square, sizes, strict=True))
        return laid_out(symmetric_tiles(sign * block) for block in blocks)

    def rectangle(b: int) -> Floats:
        begin = elastic.across[b]
        shape = (across[b], sizes[b])
        return -elastic.gyroscopic[begin : begin + sizes[b] * across[b]].reshape(shape).T

    stiffness, square = squares(elastic.stiffness, -1.0)
    gyroscopic, begins = laid_out(rectangular_tiles(rectangle(b)) for b in range(sizes.size))
    return ElasticMotion(
        first=first,
        sizes=sizes,
        coordinate=coordinate,
        spin=spin,
        momentum=momentum,
        turning=elastic.turning,
        partner=elastic.partner,
        damping_time=elastic.damping_time,
        square=square,
        stiffness=stiffness,
        mass=squares(elastic.mass, 1.0)[0],
        inverse=squares(elastic.inverse, 1.0)[0],
        across=begins,
        gyroscopic=gyroscopic,
    )


@kernel
def gather_deformation(b: int, q: Floats, v: Floats, time: float, elastic: ElasticMotion, out: Floats) -> None:
    """Fill q + time v of block b without the common turning, as `deformation`.

    Entries after the block are irrelevant: rows and columns of the matrices are zero there.
    """
    first = elastic.first[b]
    common = q[elastic.coordinate[first]] * elastic.spin[first]
    for i in range(first, elastic.first[b + 1], SIZE):
        strained = eight_at(q, elastic.coordinate, i) - eight(elastic.spin, i) * common
        put(out, i - first, strained + eight_at(v, elastic.coordinate, i) * time)


@kernel
def add_gyroscopic(b: int, v: Floats, elastic: ElasticMotion, given: Floats, sums: Floats) -> None:
    """Add the gyroscopic forces of block b, if any, to sums; they come from the other plane's velocities."""
    partner = elastic.partner[b]
    if partner < 0:
        return
    block = elastic.turning[b]
    turning = all_eight(0.0)
    for i in range(elastic.first[block], elastic.first[block + 1], SIZE):
        turning = turning + eight(elastic.momentum, i) * eight_at(v, elastic.coordinate, i)
    speed = sum_of(turning)
    first = elastic.first[partner]
    for i in range(first, elastic.first[partner + 1], SIZE):
        put(given, i - first, eight_at(v, elastic.coordinate, i) * speed)
    rows = elastic.first[b + 1] - elastic.first[b]
    columns = elastic.first[partner + 1] - first
    add_rows(elastic.gyroscopic, elastic.across[b], rows, columns, given, sums)


@kernel
def set_elastic_motion(
    q: Floats, v: Floats, f: Floats, with_power: bool, elastic: ElasticMotion | None, scratch: Floats, out: Floats
) -> float:
    """Fill the accelerations of all elastic bodies under generalized forces f, their own forces left out, into out.

    The forces are those of `add_elastic_forces`. `scratch` is that of `scratch_for`. Returns the power that the bodies
    damp (W) if asked for, else 0. Nothing is done without elastic bodies (None).
    """
    damped = 0.0
    if elastic is None:
        return damped
    given = scratch[0]
    sums = scratch[1]
    found = scratch[2]
    for b in range(elastic.turning.size):
        first = elastic.first[b]
        square = elastic.square[b]
        size = elastic.first[b + 1] - first
        time = elastic.damping_time[b]
        gather_deformation(b, q, v, time, elastic, given)
        for i in range(0, size, SIZE):
            put(sums, i, eight_at(f, elastic.coordinate, first + i))
        if with_power:
            # Damping is a time times the stiffness: its power is that of the rates, without the common turning.
            gather_deformation(b, v, v, 0.0, elastic, found)
            damped -= time * add_symmetric_with_form(elastic.stiffness, square, size, given, sums, found)
        else:
            add_symmetric(elastic.stiffness, square, size, given, sums)
        add_gyroscopic(b, v, elastic, given, sums)
        for i in range(0, size, SIZE):
            put(found, i, all_eight(0.0))
        add_symmetric(elastic.inverse, square, size, sums, found)
        for i in range(elastic.sizes[b]):
            out[elastic.coordinate[first + i]] = found[i]
    return damped


@kernel
def motion_energies(q: Floats, v: Floats, elastic: ElasticMotion | None, scratch: Floats) -> tuple[float, float]:
    """Kinetic and elastic energy of all elastic bodies, J, from blocks arranged for speed; zero without any (None)."""
    kinetic = 0.0
    stored = 0.0
    if elastic is None:
        return kinetic, stored
    given = scratch[0]
    for b in range(elastic.turning.size):
        first = elastic.first[b]
        square = elastic.square[b]
        size = elastic.first[b + 1] - first
        gather_deformation(b, q, v, 0.0, elastic, given)
        stored -= 0.5 * square_form(elastic.stiffness, square, size, given)
        for i in range(0, size, SIZE):
            put(given, i, eight_at(v, elastic.coordinate, first + i))
        kinetic += 0.5 * square_form(elastic.mass, square, size, given)
    return kinetic, stored


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
    given = scratch[0]
    sum_ = scratch[1]
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
