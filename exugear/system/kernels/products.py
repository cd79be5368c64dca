"""Products of dense matrices with vectors, eight rows by eight columns at a time.

Of what bodies of a hundred coordinates cost, most is reading their matrices. So a symmetric matrix is kept and read as
its upper triangle alone, each entry used twice, and tiles of eight by eight lie one after the other as they are read.
Sizes are filled up with zeros to multiples of eight. Machine code is kept by `fe_ste.tools.compilation`.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import kernel
from fe_ste.tools.octets import SIZE, aligned_zeros, all_eight, eight, put, sum_of, sums_of

TILE = SIZE * SIZE
"""Entries of a tile."""


def filled_up(size: int) -> int:
    """Next multiple of eight."""
    return -(-size // SIZE) * SIZE


def symmetric_tiles(matrix: Floats) -> Floats:
    """Tiles of a symmetric matrix on and above its diagonal, row by row, flat.

    Examples
    --------
    >>> symmetric_tiles(np.eye(9)).size == 3 * TILE
    True
    """
    tiles = _tiles(matrix)
    return np.concatenate([np.zeros(0), *(tiles[i, i:].ravel() for i in range(len(tiles)))])


def rectangular_tiles(matrix: Floats) -> Floats:
    """Tiles of any matrix, row by row, flat."""
    return _tiles(matrix).ravel()


def _tiles(matrix: Floats) -> Floats:
    """Split a matrix, filled up, into tiles (rows, columns, 8, 8)."""
    rows, columns = (filled_up(size) for size in matrix.shape)
    whole = np.zeros((rows, columns))
    whole[: matrix.shape[0], : matrix.shape[1]] = matrix
    return np.ascontiguousarray(whole.reshape(rows // SIZE, SIZE, columns // SIZE, SIZE).swapaxes(1, 2))


def laid_out(parts: Iterable[Floats]) -> tuple[Floats, Integers]:
    """Flat arrays one after the other, where a processor reads eight at once, and the first entry of each."""
    given = list(parts)
    ends = np.cumsum([part.size for part in given], dtype=np.int64)
    whole = aligned_zeros(int(ends[-1]) if given else 0)
    for part, end in zip(given, ends, strict=True):
        whole[end - part.size : end] = part
    return whole, ends - np.array([part.size for part in given], dtype=np.int64)


@kernel
def add_symmetric(tiles: Floats, begin: int, size: int, x: Floats, y: Floats) -> None:
    """Add the product of a symmetric matrix, of tiles from `begin` on, with x to y; `size` is filled up."""
    for i in range(0, size, SIZE):
        own = eight(x, i)
        # Spread once for a row of tiles: the compiler must assume that y may alias x.
        x0, x1, x2, x3 = all_eight(x[i]), all_eight(x[i + 1]), all_eight(x[i + 2]), all_eight(x[i + 3])
        x4, x5, x6, x7 = all_eight(x[i + 4]), all_eight(x[i + 5]), all_eight(x[i + 6]), all_eight(x[i + 7])
        a, b = eight(tiles, begin) * own, eight(tiles, begin + 8) * own
        c, d = eight(tiles, begin + 16) * own, eight(tiles, begin + 24) * own
        e, f = eight(tiles, begin + 32) * own, eight(tiles, begin + 40) * own
        g, h = eight(tiles, begin + 48) * own, eight(tiles, begin + 56) * own
        begin += TILE
        # Right of the diagonal a tile stands for the one that mirrors it as well.
        for j in range(i + SIZE, size, SIZE):
            given, found = eight(x, j), eight(y, j)
            row = eight(tiles, begin)
            a, found = a + row * given, found + row * x0
            row = eight(tiles, begin + 8)
            b, more = b + row * given, row * x1
            row = eight(tiles, begin + 16)
            c, found = c + row * given, found + row * x2
            row = eight(tiles, begin + 24)
            d, more = d + row * given, more + row * x3
            row = eight(tiles, begin + 32)
            e, found = e + row * given, found + row * x4
            row = eight(tiles, begin + 40)
            f, more = f + row * given, more + row * x5
            row = eight(tiles, begin + 48)
            g, found = g + row * given, found + row * x6
            row = eight(tiles, begin + 56)
            h, more = h + row * given, more + row * x7
            put(y, j, found + more)
            begin += TILE
        put(y, i, eight(y, i) + sums_of(a, b, c, d, e, f, g, h))


@kernel
def add_rows(tiles: Floats, begin: int, rows: int, columns: int, x: Floats, y: Floats) -> None:
    """Add the product of a matrix, of tiles from `begin` on, with x to y; both sizes are filled up."""
    for i in range(0, rows, SIZE):
        a = all_eight(0.0)
        b, c, d, e, f, g, h = a, a, a, a, a, a, a
        for j in range(0, columns, SIZE):
            given = eight(x, j)
            a, b = a + eight(tiles, begin) * given, b + eight(tiles, begin + 8) * given
            c, d = c + eight(tiles, begin + 16) * given, d + eight(tiles, begin + 24) * given
            e, f = e + eight(tiles, begin + 32) * given, f + eight(tiles, begin + 40) * given
            g, h = g + eight(tiles, begin + 48) * given, h + eight(tiles, begin + 56) * given
            begin += TILE
        put(y, i, eight(y, i) + sums_of(a, b, c, d, e, f, g, h))


@kernel
def square_form(tiles: Floats, begin: int, size: int, x: Floats) -> float:
    """Scalar x' A x of a symmetric matrix, of tiles from `begin` on; `size` is filled up."""
    total = all_eight(0.0)
    for i in range(0, size, SIZE):
        given = eight(x, i)
        a, b = eight(tiles, begin) * given, eight(tiles, begin + 8) * given
        c, d = eight(tiles, begin + 16) * given, eight(tiles, begin + 24) * given
        e, f = eight(tiles, begin + 32) * given, eight(tiles, begin + 40) * given
        g, h = eight(tiles, begin + 48) * given, eight(tiles, begin + 56) * given
        begin += TILE
        for j in range(i + SIZE, size, SIZE):
            given = eight(x, j) * 2.0  # a tile stands for the one that mirrors it as well
            a, b = a + eight(tiles, begin) * given, b + eight(tiles, begin + 8) * given
            c, d = c + eight(tiles, begin + 16) * given, d + eight(tiles, begin + 24) * given
            e, f = e + eight(tiles, begin + 32) * given, f + eight(tiles, begin + 40) * given
            g, h = g + eight(tiles, begin + 48) * given, h + eight(tiles, begin + 56) * given
            begin += TILE
        total = total + eight(x, i) * sums_of(a, b, c, d, e, f, g, h)
    return sum_of(total)


@kernel
def add_symmetric_with_form(tiles: Floats, begin: int, size: int, x: Floats, y: Floats, u: Floats) -> float:
    """Do as `add_symmetric` and return u' A u: the matrix, whose reading takes the time, is read once for both."""
    total = all_eight(0.0)
    for i in range(0, size, SIZE):
        own, other = eight(x, i), eight(u, i)
        x0, x1, x2, x3 = all_eight(x[i]), all_eight(x[i + 1]), all_eight(x[i + 2]), all_eight(x[i + 3])
        x4, x5, x6, x7 = all_eight(x[i + 4]), all_eight(x[i + 5]), all_eight(x[i + 6]), all_eight(x[i + 7])
        row = eight(tiles, begin)
        a, k = row * own, row * other
        row = eight(tiles, begin + 8)
        b, s = row * own, row * other
        row = eight(tiles, begin + 16)
        c, m = row * own, row * other
        row = eight(tiles, begin + 24)
        d, n = row * own, row * other
        row = eight(tiles, begin + 32)
        e, o = row * own, row * other
        row = eight(tiles, begin + 40)
        f, p = row * own, row * other
        row = eight(tiles, begin + 48)
        g, q = row * own, row * other
        row = eight(tiles, begin + 56)
        h, r = row * own, row * other
        begin += TILE
        for j in range(i + SIZE, size, SIZE):
            own, other, found = eight(x, j), eight(u, j) * 2.0, eight(y, j)
            row = eight(tiles, begin)
            a, k, found = a + row * own, k + row * other, found + row * x0
            row = eight(tiles, begin + 8)
            b, s, more = b + row * own, s + row * other, row * x1
            row = eight(tiles, begin + 16)
            c, m, found = c + row * own, m + row * other, found + row * x2
            row = eight(tiles, begin + 24)
            d, n, more = d + row * own, n + row * other, more + row * x3
            row = eight(tiles, begin + 32)
            e, o, found = e + row * own, o + row * other, found + row * x4
            row = eight(tiles, begin + 40)
            f, p, more = f + row * own, p + row * other, more + row * x5
            row = eight(tiles, begin + 48)
            g, q, found = g + row * own, q + row * other, found + row * x6
            row = eight(tiles, begin + 56)
            h, r, more = h + row * own, r + row * other, more + row * x7
            put(y, j, found + more)
            begin += TILE
        put(y, i, eight(y, i) + sums_of(a, b, c, d, e, f, g, h))
        total = total + eight(u, i) * sums_of(k, s, m, n, o, p, q, r)
    return sum_of(total)
