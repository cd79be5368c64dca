"""Products by tiles against dense ones."""

from __future__ import annotations

import numpy as np
import pytest

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


def filled(values: np.ndarray) -> np.ndarray:
    return np.pad(values, (0, filled_up(values.size) - values.size))


@pytest.mark.parametrize("size", [1, 8, 15, 41])
def test_tiles_of_half_a_symmetric_matrix_give_its_product(size: int) -> None:
    """Against NumPy, the second of two matrices; sums of at most 41 products in another order."""
    random = np.random.default_rng(size)
    matrices = [m + m.T for m in random.normal(size=(2, size, size))]
    tiles, begins = laid_out(symmetric_tiles(matrix) for matrix in matrices)
    x, y = filled(random.normal(size=size)), np.ones(filled_up(size))
    add_symmetric(tiles, int(begins[1]), filled_up(size), x, y)
    assert y[:size] == pytest.approx(1.0 + matrices[1] @ x[:size], abs=1e-12)


@pytest.mark.parametrize("size", [1, 8, 15, 41])
def test_a_form_taken_beside_a_product_is_that_of_the_matrix(size: int) -> None:
    """Against NumPy; sums of at most 41^2 products of the size of one."""
    random = np.random.default_rng(size)
    matrix = random.normal(size=(size, size))
    matrix += matrix.T
    tiles, rows = symmetric_tiles(matrix), filled_up(size)
    x, u, y = filled(random.normal(size=size)), filled(random.normal(size=size)), np.ones(rows)
    beside = add_symmetric_with_form(tiles, 0, rows, x, y, u)
    alone = square_form(tiles, 0, rows, u)
    assert y[:size] == pytest.approx(1.0 + matrix @ x[:size], abs=1e-12)
    assert (beside, alone) == pytest.approx((u[:size] @ matrix @ u[:size],) * 2, abs=1e-11)


def test_tiles_of_any_matrix_give_its_product() -> None:
    random = np.random.default_rng(3)
    matrix, x = random.normal(size=(12, 19)), random.normal(size=19)
    y = np.zeros(16)
    add_rows(rectangular_tiles(matrix), 0, 16, 24, filled(x), y)
    assert y == pytest.approx(filled(matrix @ x), abs=1e-12)
