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
from fe_ste.tools.octets import SIZE, aligned_zeros, all_eight, eight, put, sum_of

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
        a, b = eight(tiles, begin) * own, eight(tiles, begin + 8) * own
        c, d = eight(tiles, begin + 16) * own, eight(tiles, begin + 24) * own
        e, f = eight(tiles, begin + 32) * own, eight(tiles, begin + 40) * own
        g, h = eight(tiles, begin + 48) * own, eight(tiles, begin + 56) * own
        begin += TILE
        # Right of the diagonal a tile stands for the one that mirrors it as well.
        for j in range(i + SIZE, size, SIZE):
            given, found, more = eight(x, j), eight(y, j), all_eight(0.0)
            row = eight(tiles, begin)
            a, found = a + row * given, found + row * x[i]
            row = eight(tiles, begin + 8)
            b, more = b + row * given, more + row * x[i + 1]
            row = eight(tiles, begin + 16)
            c, found = c + row * given, found + row * x[i + 2]
            row = eight(tiles, begin + 24)
            d, more = d + row * given, more + row * x[i + 3]
            row = eight(tiles, begin + 32)
            e, found = e + row * given, found + row * x[i + 4]
            row = eight(tiles, begin + 40)
            f, more = f + row * given, more + row * x[i + 5]
            row = eight(tiles, begin + 48)
            g, found = g + row * given, found + row * x[i + 6]
            row = eight(tiles, begin + 56)
            h, more = h + row * given, more + row * x[i + 7]
            put(y, j, found + more)
            begin += TILE
        add_sums(a, b, c, d, y, i)
        add_sums(e, f, g, h, y, i + 4)


@kernel
def add_sums(a: Floats, b: Floats, c: Floats, d: Floats, y: Floats, i: int) -> None:
    """Add the sums of four octets to four entries of y from i on."""
    y[i] += sum_of(a)
    y[i + 1] += sum_of(b)
    y[i + 2] += sum_of(c)
    y[i + 3] += sum_of(d)


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
        add_sums(a, b, c, d, y, i)
        add_sums(e, f, g, h, y, i + 4)


@kernel
def square_form(tiles: Floats, begin: int, size: int, x: Floats, y: Floats) -> float:
    """Scalar x' A x of a symmetric matrix, of tiles from `begin` on, which leaves A x in y; `size` is filled up."""
    none, total = all_eight(0.0), all_eight(0.0)
    for i in range(0, size, SIZE):
        put(y, i, none)
    add_symmetric(tiles, begin, size, x, y)
    for i in range(0, size, SIZE):
        total = total + eight(x, i) * eight(y, i)
    return sum_of(total)
