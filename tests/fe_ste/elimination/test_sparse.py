"""Both sparse back ends against each other, and their errors."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse
from skfem import Basis, ElementHex1, ElementVector, MeshHex
from skfem.models.elasticity import lame_parameters, linear_elasticity

from fe_ste.elimination import FactorisationError, available_backends, factorise

needs_pardiso = pytest.mark.skipif(
    "pardiso" not in available_backends(), reason="pypardiso (extra `fast`) is not installed"
)
BACKENDS = [pytest.param("pardiso", marks=needs_pardiso), "superlu"]


def elastic_block(clamped=True):
    """Stiffness matrix of a steel block of 8 x 6 x 10 bricks (N/m, m), held at x = 0 where `clamped`."""
    mesh = MeshHex.init_tensor(np.linspace(0, 0.08, 9), np.linspace(0, 0.06, 7), np.linspace(0, 0.1, 11))
    basis = Basis(mesh, ElementVector(ElementHex1()))
    stiffness = linear_elasticity(*lame_parameters(206e9, 0.3)).assemble(basis).tocsr()
    if not clamped:
        return stiffness
    free = np.setdiff1d(np.arange(stiffness.shape[0]), basis.get_dofs(lambda x: x[0] == 0.0).all())
    return stiffness[free][:, free]


def block_loads(unknowns, columns=300):
    """More loads than are solved at a time, so that the seams between the chunks are seen."""
    return np.random.default_rng(1).normal(size=(unknowns, columns))


def sparse_block_loads(unknowns, columns=300):
    rng = np.random.default_rng(2)
    return scipy.sparse.random_array((unknowns, columns), density=0.01, rng=rng, format="csc")


@needs_pardiso
def test_both_back_ends_give_the_same_numbers():
    matrix = elastic_block()
    loads = block_loads(matrix.shape[0])
    with factorise(matrix, "pardiso") as first, factorise(matrix, "superlu") as second:
        solutions = first.solve(loads), second.solve(loads)
    # 1e-9 is what the project promises; a condition number of some 1e4 leaves both about 1e-12.
    np.testing.assert_allclose(solutions[0], solutions[1], rtol=0, atol=1e-9 * np.abs(solutions[1]).max())


@pytest.mark.sample
@pytest.mark.parametrize("backend", BACKENDS)
def test_solution_satisfies_the_equations(backend):
    matrix = elastic_block()
    loads = block_loads(matrix.shape[0])
    with factorise(matrix, backend) as factorisation:
        residual = matrix @ factorisation.solve(loads) - loads
    assert factorisation.name == backend
    # Rounding times the condition number (some 1e4).
    assert np.abs(residual).max() < 1e-10 * np.abs(loads).max()


@pytest.mark.sample
@pytest.mark.parametrize("backend", BACKENDS)
def test_sparse_dense_and_single_right_hand_sides_agree(backend):
    matrix = elastic_block()
    loads = sparse_block_loads(matrix.shape[0])
    with factorise(matrix, backend) as factorisation:
        dense = factorisation.solve(loads.toarray())
        scale = np.abs(dense).max()
        np.testing.assert_allclose(factorisation.solve(loads), dense, rtol=0, atol=1e-12 * scale)
        np.testing.assert_allclose(
            factorisation.solve(loads[:, [7]].toarray()[:, 0]), dense[:, 7], rtol=0, atol=1e-12 * scale
        )


@pytest.mark.sample
@pytest.mark.parametrize("backend", BACKENDS)
def test_the_inverse_read_out_is_symmetric(backend):
    matrix = elastic_block()
    loads = sparse_block_loads(matrix.shape[0])
    with factorise(matrix, backend) as factorisation:
        compliance = loads.T @ factorisation.solve(loads)
    np.testing.assert_allclose(compliance, compliance.T, rtol=0, atol=1e-11 * np.abs(compliance).max())


@pytest.mark.sample
@pytest.mark.parametrize("backend", BACKENDS)
def test_a_body_free_to_move_is_refused_with_its_number_of_unknowns(backend):
    matrix = elastic_block(clamped=False)
    with pytest.raises(FactorisationError, match=f"{matrix.shape[0]} unknowns.*rigid-body"):
        factorise(matrix, backend)


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_indefinite_matrix_is_refused(backend):
    matrix = scipy.sparse.csr_array(np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))
    with pytest.raises(FactorisationError, match="3 unknowns"):
        factorise(matrix, backend)


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_empty_row_is_refused_with_its_number(backend):
    matrix = scipy.sparse.csr_array(np.diag([1.0, 1.0, 0.0]))
    with pytest.raises(FactorisationError, match="unknown 2"):
        factorise(matrix, backend)


@pytest.mark.sample
@pytest.mark.parametrize("backend", BACKENDS)
def test_a_closed_factorisation_says_so(backend):
    factorisation = factorise(elastic_block(), backend)
    factorisation.close()
    factorisation.close()
    with pytest.raises(ValueError, match="closed"):
        factorisation.solve(np.ones(factorisation.unknowns))


def test_wrong_inputs_are_named():
    matrix = elastic_block()
    with pytest.raises(ValueError, match="'cholmod' is not installed; installed: .*superlu"):
        factorise(matrix, "cholmod")
    with pytest.raises(ValueError, match="sparse and square"):
        factorise(matrix[:5])
    with factorise(matrix) as factorisation, pytest.raises(ValueError, match="3 rows"):
        factorisation.solve(np.ones((3, 2)))
