"""Linear equations of harmonic balance, solved without their matrix."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from fe_ste.tools.arrays import Complexes, Floats

MOST_PRODUCTS = 400
"""Products with the operator after which the search is given up."""


ROOM = 40
"""Products for which there is room from the beginning; more of it is made where they are not enough."""


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
        column, w = _orthogonal(w, basis[: n + 1])
        length = math.sqrt(w @ w)
        for i, (c, s) in enumerate(turns):
            column[i], column[i + 1] = c * column[i] + s * column[i + 1], c * column[i + 1] - s * column[i]
        radius = math.hypot(column[n], length)
        turns.append((column[n] / radius, length / radius))
        column[n] = radius
        columns.append(column)
        rest[n:] = turns[n][0] * rest[n], -turns[n][1] * rest[n]
        if abs(rest[n + 1]) <= wanted or length == 0.0:
            return lines(x + _steps(columns, rest) @ basis[: n + 1]), n + 1
        if n + 1 == len(basis):
            basis = np.concatenate([basis, np.empty_like(basis)])
        basis[n + 1] = w / length
    raise HarmonicBalanceError(
        f"harmonic balance: the residual stays at {abs(rest[most]) / max(size, 1e-300):.1e} of its start after "
        f"{most} products"
    )


def _orthogonal(w: Floats, basis: Floats) -> tuple[list[float], Floats]:
    """Shares of a vector along an orthonormal basis, and what is left of it, orthogonal to round-off."""
    first = basis @ w
    w = w - first @ basis
    second = basis @ w
    return (first + second).tolist(), w - second @ basis


def _steps(columns: list[list[float]], rest: list[float]) -> Floats:
    """Solve the triangular equations of all columns."""
    triangle = np.zeros((len(columns), len(columns)))
    for n, column in enumerate(columns):
        triangle[: n + 1, n] = column
    return np.asarray(np.linalg.solve(triangle, rest[: len(columns)]))
