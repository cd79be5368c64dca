"""Linear equations of harmonic balance: without their matrix, and many of one pattern eight at a time.

Bodies touch each other at few coordinates, so that most entries of a dynamic stiffness are zero, the same ones at all
frequencies. Which entries an elimination fills, and in what order it fills the fewest, is found once; then eight lines
at a time pass through it in the registers of the processor. Entries on the diagonal are not exchanged for larger ones:
the residual shows whether this was accurate, and orders for which it was not are solved with pivoting. Machine code is
kept by `fe_ste.tools.compilation`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers
from fe_ste.tools.bundles import cached_bundle
from fe_ste.tools.compilation import kernel
from fe_ste.tools.octets import SIZE, aligned_zeros, all_eight, eight, put

MOST_PRODUCTS = 400
"""Products with the operator after which the search is given up."""


ROOM = 40
"""Number of products for which memory is allocated initially; it grows where this is not enough."""


class HarmonicBalanceError(RuntimeError):
    """No balance of all lines was found."""


def solve_lines(
    apply: Callable[[Complexes], Complexes], right: Complexes, tolerance: float, start: Complexes | None = None
) -> tuple[Complexes, int]:
    """Solve A y = b for coefficients of lines by GMRES (Saad and Schultz 1986) over real and imaginary parts.

    A is linear over the reals alone, since products of signals mix lines with their conjugates.

    Parameters
    ----------
    apply : a times an array of the shape of `right`
    tolerance : residual over the size of the right-hand side

    Returns
    -------
    solution
    products : products with A that it took

    Raises
    ------
    HarmonicBalanceError
        Not within `MOST_PRODUCTS`.

    Examples
    --------
    >>> solve_lines(lambda y: y + 0.1j * y.conj(), np.array([1.1 + 0.1j]), 1e-12)[0].round(12)
    array([1.1010101-0.01010101j])
    """

    def real(values: Complexes) -> Floats:
        return np.ascontiguousarray(values).view(np.float64).ravel()

    def lines(values: Floats) -> Complexes:
        return values.view(np.complex128).reshape(right.shape)

    wanted = tolerance * float(np.linalg.norm(right))
    x = np.zeros(2 * right.size) if start is None else real(start).copy()
    remainder = real(right) - (real(apply(lines(x))) if start is not None else 0.0)
    size = float(np.linalg.norm(remainder))
    if size <= wanted:
        return lines(x), 0
    most = min(MOST_PRODUCTS, 2 * right.size)
    basis = np.empty((min(most, ROOM) + 1, x.size))
    # Givens rotations keep the least-squares problem triangular; its residual is then known without solving it.
    columns: list[list[float]] = []
    turns: list[tuple[float, float]] = []
    rest = [size]
    basis[0] = remainder / size
    for n in range(most):
        w = real(apply(lines(basis[n])))
        # Two passes leave a vector that is orthogonal to the basis to round-off.
        first = basis[: n + 1] @ w
        w = w - first @ basis[: n + 1]
        second = basis[: n + 1] @ w
        w = w - second @ basis[: n + 1]
        column = (first + second).tolist()
        length = math.sqrt(w @ w)
        for i, (c, s) in enumerate(turns):
            column[i], column[i + 1] = c * column[i] + s * column[i + 1], c * column[i + 1] - s * column[i]
        radius = math.hypot(column[n], length)
        turns.append((column[n] / radius, length / radius))
        column[n] = radius
        columns.append(column)
        rest[n:] = turns[n][0] * rest[n], -turns[n][1] * rest[n]
        if abs(rest[n + 1]) <= wanted or length == 0.0:
            triangle = np.zeros((n + 1, n + 1))
            for i, own in enumerate(columns):
                triangle[: i + 1, i] = own
            return lines(x + np.linalg.solve(triangle, rest[: n + 1]) @ basis[: n + 1]), n + 1
        if n + 1 == len(basis):
            basis = np.concatenate([basis, np.empty_like(basis)])
        basis[n + 1] = w / length
    raise HarmonicBalanceError(
        f"harmonic balance: not converged, the residual remains at {abs(rest[most]) / max(size, 1e-300):.1e} of its "
        f"initial value after {most} products"
    )


LEFT_OVER = 1e-10
"""Residual over the load up to which a solution counts as such, both by the sum of all loads."""


class Elimination(NamedTuple):
    """Order and places of an elimination of systems of one pattern with n rows and e entries, filled ones too."""

    order: Integers
    """(n,) row that is eliminated in each step; rows and columns are numbered by step from here on."""
    row: Integers
    column: Integers
    """(e,) place of each entry, row by row."""
    first: Integers
    """(n + 1,) first entry of each row."""
    diagonal: Integers
    """(n,) entry on the diagonal."""
    kept: Integers
    """(n + 1,) place of the diagonal among the entries on and above the diagonals, which later steps need."""
    alike: Booleans
    """(n,) whether the next step touches the same later rows: both are taken out of these at once."""
    twin: Booleans
    """(n,) whether the next row has entries in the same columns: steps are taken out of both at once."""


def elimination(pattern: Booleans) -> Elimination:
    """Find an elimination of matrices with entries where a pattern (n, n) is true: rows with few neighbours first.

    Examples
    --------
    A chain needs no more entries than it has:

    >>> found = elimination(np.abs(np.subtract.outer(np.arange(5), np.arange(5))) < 2)
    >>> len(found.row), found.first.tolist()
    (13, [0, 2, 5, 8, 11, 13])
    """
    n = len(pattern)
    filled = pattern | pattern.T
    np.fill_diagonal(filled, True)
    left = np.ones(n, dtype=bool)
    order = np.empty(n, dtype=np.int64)
    for step in range(n):
        counts = np.where(left, (filled & left).sum(axis=1), n + 1)
        k = order[step] = int(np.argmin(counts))
        left[k] = False
        others = np.flatnonzero(filled[k] & left)
        filled[np.ix_(others, others)] = True
    above = np.triu(filled[np.ix_(order, order)])
    whole = above | above.T
    row, column = np.nonzero(whole)
    alike = (above[:-1] == above[1:]).sum(axis=1) == n - 1  # but for the diagonal of the first
    return Elimination(
        order=order,
        row=row.astype(np.int64),
        column=column.astype(np.int64),
        first=np.searchsorted(row, np.arange(n + 1)).astype(np.int64),
        diagonal=np.flatnonzero(row == column).astype(np.int64),
        kept=np.append(0, np.cumsum(above.sum(axis=1))).astype(np.int64),
        alike=np.append(alike, False),
        twin=np.append((whole[:-1] == whole[1:]).all(axis=1), False),
    )


class Batches(NamedTuple):
    """Order in which n lines are solved, eight at a time, each eight with the loads that act on any of them."""

    lines: Integers
    """(n,) lines."""
    first: Integers
    """(o + 1,) first of the loads of each eight in the array that follows."""
    columns: Integers
    """(c,) loads."""
    own: Integers
    """(o,) 1 where the lines have loads of their own as well, else 0."""


def batches_of(acting: Booleans, own: Booleans) -> Batches:
    """Put lines next to each other on which the same loads act (n, loads), and that have loads of their own (n,).

    Examples
    --------
    >>> found = batches_of(np.arange(9)[:, None] == [0, 3], np.zeros(9, dtype=bool))
    >>> found.lines.tolist(), found.columns.tolist(), found.first.tolist()
    ([1, 2, 4, 5, 6, 7, 8, 3, 0], [1, 0], [0, 1, 2])
    """
    keys = np.column_stack([acting, own])
    lines = np.lexsort(keys.T[::-1])
    unions = [np.asarray(keys[lines[start : start + SIZE]].any(axis=0)) for start in range(0, len(lines), SIZE)]
    columns = [np.flatnonzero(union[:-1]) for union in unions]
    return Batches(
        lines=lines.astype(np.int64),
        first=np.cumsum([0, *map(len, columns)]).astype(np.int64),
        columns=np.concatenate([np.zeros(0, dtype=np.int64), *columns]),
        own=np.array([union[-1] for union in unions], dtype=np.int64),
    )


def solve_side_by_side(
    plan: Elimination,
    pencil: tuple[Floats, Floats, Floats],
    frequencies: Floats,
    loads: Floats,
    own: Complexes,
    batches: Batches,
    amplitudes: Complexes,
) -> None:
    """Fill amplitudes x (lines, n, loads) of (K + i w C - w^2 M) x = f, an array in C order, where loads act.

    Parameters
    ----------
    plan : of a pattern that holds all entries of the three matrices
    pencil : stiffness, damping and mass (n, n)
    frequencies : (lines,) angular frequencies w, rad/s
    loads : (n, loads)
    own : (lines, n) loads of each line by itself, which are replaced by their amplitudes
    """
    stiffness, damping, mass = pencil
    order = plan.order
    places = (order[plan.row], order[plan.column])
    loaded = np.flatnonzero(own.any(axis=1))
    sizes = np.abs(own[loaded]).max(axis=1, initial=0.0)
    # Behind the loads of those lines that have some are none, for all others.
    alone = np.append(own[loaded] / sizes[:, None], np.zeros((1, len(order))), axis=0)
    place = np.full(len(own), len(loaded), dtype=np.int64)
    place[loaded] = np.arange(len(loaded))
    upper = aligned_zeros(2 * SIZE * max(plan.kept[-1], 2 * len(order)))
    x = aligned_zeros(2 * SIZE * len(order) * (loads.shape[1] + 2))
    of_loads = np.ascontiguousarray(loads[order]), np.ascontiguousarray(alone[:, order]).view(np.float64)
    missing = np.zeros(len(frequencies))
    entries = (stiffness[places], damping[places], mass[places])
    found = np.empty_like(alone)
    solve_octets(
        cached_bundle(plan),
        cached_bundle(batches),
        *entries,
        frequencies,
        *of_loads,
        place,
        upper,
        aligned_zeros(4 * SIZE * len(order)),
        x,
        amplitudes.view(np.float64),
        found.view(np.float64),
        missing,
    )
    # A residual that is no number is none that is small.
    for line in np.flatnonzero(~(missing <= LEFT_OVER)):
        w = frequencies[line]
        dynamic = stiffness - w**2 * mass + 1j * w * damping
        amplitudes[line] = np.linalg.solve(dynamic, loads)
        found[place[line]] = np.linalg.solve(dynamic, alone[place[line]])
    own[loaded] = found[:-1] * sizes[:, None]


@kernel
def solve_octets(
    plan: Elimination,
    batches: Batches,
    stiffness: Floats,
    damping: Floats,
    mass: Floats,
    frequencies: Floats,
    loads: Floats,
    own: Floats,
    place: Integers,
    upper: Floats,
    rows: Floats,
    x: Floats,
    out: Floats,
    out_own: Floats,
    missing: Floats,
) -> None:
    """Fill amplitudes (lines, n, 2 cases), those of own loads (rows, 2 n), and residuals over loads (lines,).

    Real and imaginary parts are in turns. Matrices are given by their entries (e,), loads (n, cases) and own loads
    (rows, 2 n) in the order of the elimination; `place` (lines,) is the row of each line. `upper` (16 for each entry
    on and above the diagonals, or 32 n if that is more), `rows` (32 n,) and `x` (16 n (cases + 2),) are memory.
    """
    size = plan.order.size
    lines = batches.lines.size
    for octet in range(batches.own.size):
        begin = SIZE * octet
        count = min(SIZE, lines - begin)
        first = batches.first[octet]
        shared = batches.first[octet + 1] - first
        cases = shared + batches.own[octet]
        if cases == 0:
            continue
        w = frequencies_of(begin, count, batches.lines, frequencies, x)
        put_loads(begin, count, octet, batches, loads, own, place, x)
        eliminate(plan, cases, stiffness, damping, mass, w, rows, upper, x)
        for k in range(size - 1, -1, -1):
            substitute_back(k, cases, plan, upper, x)
        for lane in range(count):
            line = batches.lines[begin + lane]
            for k in range(size):
                row = plan.order[k]
                at = 2 * SIZE * k * cases + lane
                for case in range(shared):
                    column = 2 * batches.columns[first + case]
                    out[line, row, column] = x[at]
                    out[line, row, column + 1] = x[at + SIZE]
                    at += 2 * SIZE
                if shared < cases:
                    out_own[place[line], 2 * row] = x[at]
                    out_own[place[line], 2 * row + 1] = x[at + SIZE]
        scale = add_cases(size, cases, upper, x)
        frequencies_of(begin, count, batches.lines, frequencies, x)
        leave_over(plan, stiffness, damping, mass, upper, x)
        for lane in range(count):
            missing[batches.lines[begin + lane]] = math.sqrt(x[lane]) / scale


@kernel
def frequencies_of(begin: int, count: int, lines: Integers, frequencies: Floats, x: Floats) -> Floats:
    """Return frequencies of eight lines, of which `count` exist; they are the first numbers of the memory, too."""
    for lane in range(SIZE):
        x[lane] = frequencies[lines[begin + min(lane, count - 1)]]  # the last line fills what is left
    return eight(x, 0)


@kernel
def put_loads(
    begin: int, count: int, octet: int, batches: Batches, loads: Floats, own: Floats, place: Integers, x: Floats
) -> None:
    """Put the loads of eight lines into the memory, case by case of each row; their sums follow all of them."""
    first = batches.first[octet]
    shared = batches.first[octet + 1] - first
    cases = shared + batches.own[octet]
    size = loads.shape[0]
    for k in range(size):
        total = 0.0
        for case in range(shared):
            at = 2 * SIZE * (k * cases + case)
            value = loads[k, batches.columns[first + case]]
            total += value
            put(x, at, all_eight(value))
            put(x, at + SIZE, all_eight(0.0))
        to = 2 * SIZE * (size * cases + k)
        put(x, to, all_eight(total))
        put(x, to + SIZE, all_eight(0.0))
        if shared < cases:
            at = 2 * SIZE * (k * cases + shared)
            for lane in range(SIZE):
                row = place[batches.lines[begin + min(lane, count - 1)]]
                x[at + lane] = own[row, 2 * k]
                x[at + SIZE + lane] = own[row, 2 * k + 1]
                x[to + lane] += own[row, 2 * k]
                x[to + SIZE + lane] += own[row, 2 * k + 1]


@kernel
def add_cases(size: int, cases: int, sums: Floats, x: Floats) -> float:
    """Put the sum of the solutions of all cases into the first 16 n numbers of `sums`, what acts there behind them.

    Returns
    -------
    largest load of any line and row
    """
    scale = 0.0
    for k in range(size):
        a = all_eight(0.0)
        b = all_eight(0.0)
        for case in range(cases):
            at = 2 * SIZE * (k * cases + case)
            a = a + eight(x, at)
            b = b + eight(x, at + SIZE)
        put(sums, 2 * SIZE * k, a)
        put(sums, 2 * SIZE * k + SIZE, b)
        at = 2 * SIZE * (size * cases + k)
        for lane in range(2 * SIZE):
            scale = max(scale, abs(x[at + lane]))
        put(sums, 2 * SIZE * (size + k), -1.0 * eight(x, at))
        put(sums, 2 * SIZE * (size + k) + SIZE, -1.0 * eight(x, at + SIZE))
    return max(scale, 1e-300)


@kernel
def leave_over(plan: Elimination, stiffness: Floats, damping: Floats, mass: Floats, sums: Floats, x: Floats) -> None:
    """Turn eight frequencies, the first numbers of `x`, into the squares of what solutions in `sums` leave over."""
    size = plan.order.size
    w = eight(x, 0)
    for entry in range(stiffness.size):
        p = stiffness[entry] - w * w * mass[entry]
        q = w * damping[entry]
        at = 2 * SIZE * plan.column[entry]
        to = 2 * SIZE * (size + plan.row[entry])
        a = eight(sums, at)
        b = eight(sums, at + SIZE)
        put(sums, to, eight(sums, to) + p * a - q * b)
        put(sums, to + SIZE, eight(sums, to + SIZE) + p * b + q * a)
    total = all_eight(0.0)
    for place in range(2 * size, 4 * size):
        a = eight(sums, SIZE * place)
        total = total + a * a
    put(x, 0, total)


@kernel
def eliminate(
    plan: Elimination,
    cases: int,
    stiffness: Floats,
    damping: Floats,
    mass: Floats,
    w: Floats,
    rows: Floats,
    upper: Floats,
    x: Floats,
) -> None:
    """Eliminate eight systems at frequencies w for a number of loads, to triangles whose diagonals are inverted.

    All earlier steps are taken out of one row after the other, or of two with entries in the same columns. `rows`
    (32 n,) has them by column: they stay near the processor, and so do earlier rows, of which two are read at once.
    """
    size = plan.order.size
    second = 2 * SIZE * size
    i = 0
    while i < size:
        two = plan.twin[i]
        put_row(i, plan, stiffness, damping, mass, w, rows, 0)
        if two:
            put_row(i + 1, plan, stiffness, damping, mass, w, rows, second)
        entry = plan.first[i]
        while entry < plan.diagonal[i]:
            k = plan.column[entry]
            if two and plan.alike[k] and k + 1 < i:
                take_out_two(k, i, cases, plan, upper, rows, x)
                entry += 1
            else:
                take_out(k, i, cases, plan, upper, rows, 0, x)
                if two:
                    take_out(k, i + 1, cases, plan, upper, rows, second, x)
            entry += 1
        keep_row(i, plan, rows, 0, upper)
        if two:
            take_out(i, i + 1, cases, plan, upper, rows, second, x)
            keep_row(i + 1, plan, rows, second, upper)
            i += 1
        i += 1


@kernel
def put_row(
    i: int,
    plan: Elimination,
    stiffness: Floats,
    damping: Floats,
    mass: Floats,
    w: Floats,
    rows: Floats,
    begin: int,
) -> None:
    """Put the entries of the row of step i at eight frequencies into `rows`, by their columns from a place on."""
    for entry in range(plan.first[i], plan.first[i + 1]):
        at = begin + 2 * SIZE * plan.column[entry]
        put(rows, at, stiffness[entry] - w * w * mass[entry])
        put(rows, at + SIZE, w * damping[entry])


@kernel
def keep_row(i: int, plan: Elimination, rows: Floats, begin: int, upper: Floats) -> None:
    """Keep what steps after i need of its row, which is in `rows` from a place on: the diagonal is inverted."""
    to = 2 * SIZE * plan.kept[i]
    for entry in range(plan.diagonal[i], plan.first[i + 1]):
        at = begin + 2 * SIZE * plan.column[entry]
        put(upper, to, eight(rows, at))
        put(upper, to + SIZE, eight(rows, at + SIZE))
        to += 2 * SIZE
    at = 2 * SIZE * plan.kept[i]
    for lane in range(at, at + SIZE):
        square = upper[lane] * upper[lane] + upper[lane + SIZE] * upper[lane + SIZE]
        upper[lane], upper[lane + SIZE] = upper[lane] / square, -upper[lane + SIZE] / square


@kernel
def times_entry(at: int, a: Floats, b: Floats, upper: Floats) -> tuple[Floats, Floats]:
    """Multiply eight numbers a + i b by the entry at a place: an inverted diagonal."""
    x = eight(upper, at)
    y = eight(upper, at + SIZE)
    return a * x - b * y, a * y + b * x


@kernel
def take_out(
    k: int, i: int, cases: int, plan: Elimination, upper: Floats, rows: Floats, begin: int, out: Floats
) -> None:
    """Take step k out of the row of step i, which is in `rows` from a place on."""
    at = 2 * SIZE * plan.kept[k]
    to = begin + 2 * SIZE * k
    f, g = times_entry(at, eight(rows, to), eight(rows, to + SIZE), upper)
    for entry in range(plan.diagonal[k] + 1, plan.first[k + 1]):
        at += 2 * SIZE
        to = begin + 2 * SIZE * plan.column[entry]
        a = eight(upper, at)
        b = eight(upper, at + SIZE)
        put(rows, to, eight(rows, to) - f * a + g * b)
        put(rows, to + SIZE, eight(rows, to + SIZE) - f * b - g * a)
    for case in range(cases):
        at = 2 * SIZE * (k * cases + case)
        to = 2 * SIZE * (i * cases + case)
        a = eight(out, at)
        b = eight(out, at + SIZE)
        put(out, to, eight(out, to) - f * a + g * b)
        put(out, to + SIZE, eight(out, to + SIZE) - f * b - g * a)


@kernel
def take_out_two(k: int, i: int, cases: int, plan: Elimination, upper: Floats, rows: Floats, out: Floats) -> None:
    """Take steps k and k + 1, which touch the same later rows, out of the rows of steps i and i + 1 in `rows`."""
    further = 2 * SIZE * plan.order.size
    at = 2 * SIZE * plan.kept[k]
    next_at = 2 * SIZE * plan.kept[k + 1]
    to = 2 * SIZE * k
    f0, g0 = times_entry(at, eight(rows, to), eight(rows, to + SIZE), upper)
    f1, g1 = times_entry(at, eight(rows, to + further), eight(rows, to + further + SIZE), upper)
    # The entries below the second diagonal without the first step, times the inverse of that diagonal.
    at += 2 * SIZE
    to += 2 * SIZE
    a = eight(upper, at)
    b = eight(upper, at + SIZE)
    c = eight(rows, to) - f0 * a + g0 * b
    d = eight(rows, to + SIZE) - f0 * b - g0 * a
    s0, t0 = times_entry(next_at, c, d, upper)
    to += further
    c = eight(rows, to) - f1 * a + g1 * b
    d = eight(rows, to + SIZE) - f1 * b - g1 * a
    s1, t1 = times_entry(next_at, c, d, upper)
    for entry in range(plan.diagonal[k] + 2, plan.first[k + 1]):
        at += 2 * SIZE
        next_at += 2 * SIZE
        to = 2 * SIZE * plan.column[entry]
        a = eight(upper, at)
        b = eight(upper, at + SIZE)
        c = eight(upper, next_at)
        d = eight(upper, next_at + SIZE)
        put(rows, to, eight(rows, to) - f0 * a + g0 * b - s0 * c + t0 * d)
        put(rows, to + SIZE, eight(rows, to + SIZE) - f0 * b - g0 * a - s0 * d - t0 * c)
        to += further
        put(rows, to, eight(rows, to) - f1 * a + g1 * b - s1 * c + t1 * d)
        put(rows, to + SIZE, eight(rows, to + SIZE) - f1 * b - g1 * a - s1 * d - t1 * c)
    of_row = 2 * SIZE * cases
    for case in range(cases):
        at = 2 * SIZE * (k * cases + case)
        to = 2 * SIZE * (i * cases + case)
        a = eight(out, at)
        b = eight(out, at + SIZE)
        c = eight(out, at + of_row)
        d = eight(out, at + of_row + SIZE)
        put(out, to, eight(out, to) - f0 * a + g0 * b - s0 * c + t0 * d)
        put(out, to + SIZE, eight(out, to + SIZE) - f0 * b - g0 * a - s0 * d - t0 * c)
        to += of_row
        put(out, to, eight(out, to) - f1 * a + g1 * b - s1 * c + t1 * d)
        put(out, to + SIZE, eight(out, to + SIZE) - f1 * b - g1 * a - s1 * d - t1 * c)


@kernel
def substitute_back(k: int, cases: int, plan: Elimination, upper: Floats, out: Floats) -> None:
    """Find the solution of step k from those of later ones, for three loads at a time."""
    diagonal = 2 * SIZE * plan.kept[k]
    for first in range(0, cases, 3):
        second = min(first + 1, cases - 1)
        third = min(first + 2, cases - 1)
        to = 2 * SIZE * k * cases
        p0 = eight(out, to + 2 * SIZE * first)
        q0 = eight(out, to + 2 * SIZE * first + SIZE)
        p1 = eight(out, to + 2 * SIZE * second)
        q1 = eight(out, to + 2 * SIZE * second + SIZE)
        p2 = eight(out, to + 2 * SIZE * third)
        q2 = eight(out, to + 2 * SIZE * third + SIZE)
        at = diagonal
        for entry in range(plan.diagonal[k] + 1, plan.first[k + 1]):
            at += 2 * SIZE
            a = eight(upper, at)
            b = eight(upper, at + SIZE)
            row = 2 * SIZE * plan.column[entry] * cases
            c = eight(out, row + 2 * SIZE * first)
            d = eight(out, row + 2 * SIZE * first + SIZE)
            p0 = p0 - a * c + b * d
            q0 = q0 - a * d - b * c
            c = eight(out, row + 2 * SIZE * second)
            d = eight(out, row + 2 * SIZE * second + SIZE)
            p1 = p1 - a * c + b * d
            q1 = q1 - a * d - b * c
            c = eight(out, row + 2 * SIZE * third)
            d = eight(out, row + 2 * SIZE * third + SIZE)
            p2 = p2 - a * c + b * d
            q2 = q2 - a * d - b * c
        p0, q0 = times_entry(diagonal, p0, q0, upper)
        p1, q1 = times_entry(diagonal, p1, q1, upper)
        p2, q2 = times_entry(diagonal, p2, q2, upper)
        put(out, to + 2 * SIZE * first, p0)
        put(out, to + 2 * SIZE * first + SIZE, q0)
        put(out, to + 2 * SIZE * second, p1)
        put(out, to + 2 * SIZE * second + SIZE, q1)
        put(out, to + 2 * SIZE * third, p2)
        put(out, to + 2 * SIZE * third + SIZE, q2)
