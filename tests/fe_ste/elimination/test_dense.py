"""Dense elimination in place, against numpy."""

from __future__ import annotations

import numpy as np
import pytest

from fe_ste.elimination import FactorisationError, divided_by_factor, eliminate, mirrored_lower


def random_matrix(size: int) -> np.ndarray:
    root = np.random.default_rng(size).normal(size=(size, size))
    return np.asfortranarray(root @ root.T + size * np.eye(size))


@pytest.mark.parametrize(("size", "count"), [(3, 0), (3, 1), (3, 3), (200, 64), (200, 130), (200, 200)])
def test_elimination_leaves_factor_and_schur_complement(size: int, count: int) -> None:
    matrix = random_matrix(size)
    # Above the diagonal may stand anything.
    front = np.asfortranarray(np.tril(matrix) + np.triu(np.full_like(matrix, 7.0), 1))
    eliminate(front, count)
    gone, coupling = matrix[:count, :count], matrix[count:, :count]
    factor = np.tril(front[:count, :count])
    schur = matrix[count:, count:] - coupling @ np.linalg.solve(gone, coupling.T)
    # Well-conditioned: rounding.
    assert np.allclose(factor @ factor.T, gone, rtol=0, atol=1e-12 * size)
    assert np.allclose(front[count:, :count] @ factor.T, coupling, rtol=0, atol=1e-12 * size)
    assert np.allclose(np.tril(front[count:, count:]), np.tril(schur), rtol=0, atol=1e-12 * size)
    assert np.allclose(divided_by_factor(coupling, front[:count, :count]) @ factor, coupling, rtol=0, atol=1e-12 * size)


def test_lower_triangle_is_mirrored() -> None:
    matrix = random_matrix(150)
    assert (mirrored_lower(np.asfortranarray(np.tril(matrix))) == np.tril(matrix) + np.tril(matrix, -1).T).all()


def test_a_matrix_that_is_not_positive_definite_is_refused() -> None:
    with pytest.raises(FactorisationError, match="pivot 2 of 2"):
        eliminate(np.asfortranarray([[1.0, 2.0], [2.0, 1.0]]), 2)


def test_an_array_stored_by_rows_is_refused() -> None:
    with pytest.raises(ValueError, match="stored by columns"):
        eliminate(np.ascontiguousarray(random_matrix(3)), 1)
