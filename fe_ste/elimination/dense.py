"""Dense linear algebra in place, by SciPy's BLAS and LAPACK, on parts of arrays and without Python's lock.

SciPy's own functions copy what is not contiguous and hold Python's lock, so that two threads cannot work at once.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from fe_ste.elimination.sparse import FactorisationError
from fe_ste.tools.arrays import Floats

#: Columns eliminated at a time: the triangular solves, three to five times slower than products, stay a small part.
_PANEL = 64


@cache
def _function(library: str, name: str) -> Callable[..., None]:
    """Fortran function: characters, integers and scalars by address, arrays as addresses."""
    from numba.extending import get_cython_function_address  # a sixth of a second that a start need not wait

    address = get_cython_function_address(f"scipy.linalg.cython_{library}", name)
    return ctypes.CFUNCTYPE(None)(address)


def _integer(value: int) -> Any:
    return ctypes.byref(ctypes.c_int(value))


def _place(matrix: Floats) -> tuple[Any, Any]:
    """Address and leading dimension of a matrix stored by columns."""
    rows = matrix.shape[0]
    if matrix.dtype != np.float64 or not (rows <= 1 or matrix.strides[0] == matrix.itemsize):
        raise ValueError("the matrix must be stored by columns, in double precision")
    leading = matrix.strides[1] // matrix.itemsize if matrix.shape[1] > 1 else rows
    return ctypes.c_void_p(matrix.ctypes.data), _integer(max(leading, rows, 1))


def add_product(target: Floats, left: Floats, right: Floats, factor: float = 1.0) -> None:
    """Add ``factor * left @ right.T`` to a matrix; all are stored by columns."""
    (rows, inner), columns = left.shape, len(right)
    if min(rows, columns, inner) == 0:
        return
    scale = ctypes.byref(ctypes.c_double(factor))
    byref = ctypes.byref(ctypes.c_double(1.0))
    sizes = _integer(rows), _integer(columns), _integer(inner)
    _function("blas", "dgemm")(b"N", b"T", *sizes, scale, *_place(left), *_place(right), byref, *_place(target))


def subtract_square(target: Floats, left: Floats) -> None:
    """Subtract ``left @ left.T`` from the lower triangle of a symmetric matrix; both are stored by columns."""
    rows, inner = left.shape
    if min(rows, inner) == 0:
        return
    minus = ctypes.byref(ctypes.c_double(-1.0))
    byref = ctypes.byref(ctypes.c_double(1.0))
    _function("blas", "dsyrk")(
        b"L", b"N", _integer(rows), _integer(inner), minus, *_place(left), byref, *_place(target)
    )


def factorise_lower(matrix: Floats) -> None:
    """Replace the lower triangle of a symmetric matrix, stored by columns, by its Cholesky factor."""
    found = ctypes.c_int()
    _function("lapack", "dpotrf")(b"L", _integer(len(matrix)), *_place(matrix), ctypes.byref(found))
    if found.value:
        raise FactorisationError(
            f"the matrix of a front is not positive definite (pivot {found.value} of {len(matrix)})"
        )


def _divide(rows: Floats, factor: Floats, transposed: bytes) -> None:
    """Multiply rows from the right by the inverse of a lower triangle, or of its transpose, in place."""
    if min(rows.shape) == 0:
        return
    byref = ctypes.byref(ctypes.c_double(1.0))
    sizes = _integer(rows.shape[0]), _integer(rows.shape[1])
    _function("blas", "dtrsm")(b"R", b"L", transposed, b"N", *sizes, byref, *_place(factor), *_place(rows))


def eliminate(matrix: Floats, count: int) -> None:
    """Eliminate the first unknowns of a symmetric matrix, in place.

    Parameters
    ----------
    matrix : (n, n)
        Stored by columns; its lower triangle counts. Left are the Cholesky factor L of the first `count` unknowns,
        below it B L^-T with B their coupling to the others, and in the rest the Schur complement, lower triangle.

    Raises
    ------
    FactorisationError
        In the unknowns that are eliminated.

    Examples
    --------
    Two springs in series, the node between them eliminated:

    >>> springs = np.array([[2.0, -1.0, -1.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]], order="F")
    >>> eliminate(springs, 1)
    >>> np.tril(springs[1:, 1:]).round(12).tolist()
    [[0.5, 0.0], [-0.5, 0.5]]
    """
    for start in range(0, count, _PANEL):
        stop = min(start + _PANEL, count)
        factorise_lower(matrix[start:stop, start:stop])
        below = matrix[stop:, start:stop]
        _divide(below, matrix[start:stop, start:stop], b"T")
        add_product(matrix[stop:, stop:count], below, below[: count - stop], -1.0)
    subtract_square(matrix[count:, count:], matrix[count:, :count])


def divided_by_factor(rows: Floats, factor: Floats) -> Floats:
    """Return rows times the inverse of a lower triangle, the factor that `eliminate` leaves; stored by columns."""
    result = np.array(rows, order="F")
    size = len(factor)
    for start in range((size - 1) // _PANEL * _PANEL, -1, -_PANEL):
        stop = min(start + _PANEL, size)
        panel = result[:, start:stop]
        panel -= result[:, stop:] @ factor[stop:, start:stop]
        _divide(panel, factor[start:stop, start:stop], b"N")
    return result


def mirrored_lower(matrix: Floats) -> Floats:
    """Write the lower triangle of a symmetric matrix over the upper one, and return it."""
    for start in range(0, len(matrix), _PANEL):
        stop = start + _PANEL
        corner = matrix[start:stop, start:stop]
        corner[:] = np.tril(corner) + np.tril(corner, -1).T
        matrix[start:stop, stop:] = matrix[stop:, start:stop].T
    return matrix
