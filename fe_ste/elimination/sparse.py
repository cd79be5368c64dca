"""Direct factorisation of sparse symmetric positive definite matrices, behind one interface.

Two libraries do the work: MKL PARDISO where ``pypardiso`` is installed (extra ``fast``), else SuperLU, which
comes with SciPy. Both give the same numbers to 1e-9; PARDISO is faster by about ten. Elastic bodies and the reference
analysis are solved so; tooth sectors are condensed without either (`fe_ste.elimination.dissection`).
"""

from __future__ import annotations

import importlib.util
import os
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self, TypeAlias

import numpy as np
import scipy.sparse.linalg

from fe_ste.tools.arrays import Floats, SparseMatrix

Backend: TypeAlias = Literal["pardiso", "superlu"]
RIGHT_HAND_SIDES_AT_A_TIME = 128
"""Right-hand sides solved together: with more, a solution in work leaves the cache and costs up to twice."""
PARDISO_SETTINGS = {1: 1, 2: 3, 8: 0}
"""Own settings, parallel nested dissection, no refinement: its steps cost five times the solve itself."""
LARGEST_PROBE_ERROR = 1e-6
"""Relative error of a recovered known solution above which a matrix counts as singular."""


class FactorisationError(ValueError):
    """The matrix is not symmetric positive definite, or too nearly singular to solve with."""


class Factorisation(ABC):
    """A factorised symmetric positive definite matrix A, ready to solve with.

    Use it as a context manager, or call `close`, to release the factor's memory: MKL keeps it outside Python.

    Attributes
    ----------
    unknowns : number of rows of A
    """

    name: Backend
    """Str. The library at work: "pardiso" or "superlu"."""

    def __init__(self, unknowns: int) -> None:
        self.unknowns = unknowns
        self._closed = False

    def solve(self, rhs: Floats | SparseMatrix) -> Floats:
        """Solve A x = rhs.

        Parameters
        ----------
        rhs : (n,) (n, k), (n, k) right-hand sides, one a column

        Returns
        -------
        (n,) (n, k) the solutions, as a dense array of the shape of `rhs`

        Raises
        ------
        ValueError
            `rhs` has the wrong number of rows, or the factorisation was closed.
        """
        self._check_usable(rhs)
        if rhs.ndim == 1:
            return self._solve_dense(_dense_columns(rhs.reshape(-1, 1)))[:, 0]
        solution = np.empty(rhs.shape, order="F")
        for columns in _chunks(rhs.shape[1]):
            solution[:, columns] = self._solve_dense(_dense_columns(rhs[:, columns]))
        return solution

    def close(self) -> None:
        """Release the factor's memory; harmless when repeated."""
        if not self._closed:
            self._closed = True
            self._release()

    def __enter__(self) -> Self:
        """Return the factorisation itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Release the factor's memory."""
        self.close()

    def _check_usable(self, vectors: Floats | SparseMatrix) -> None:
        if self._closed:
            raise ValueError(f"the factorisation of {self.unknowns} unknowns was closed: factorise again")
        if vectors.shape[0] != self.unknowns:
            raise ValueError(f"right-hand sides have {vectors.shape[0]} rows; the matrix has {self.unknowns}")

    @abstractmethod
    def _solve_dense(self, rhs: Floats) -> Floats:
        """Solve for a Fortran-ordered (n, k) array."""

    @abstractmethod
    def _release(self) -> None:
        """Give the factor's memory back."""


class PardisoFactorisation(Factorisation):
    """Cholesky factorisation by MKL PARDISO (matrix type 2: the upper triangle by rows)."""

    name = "pardiso"

    def __init__(self, matrix: SparseMatrix) -> None:
        _point_out_mkl()
        from pypardiso import PyPardisoSolver
        from pypardiso.pardiso_wrapper import PyPardisoError

        super().__init__(matrix.shape[0])
        self._upper = scipy.sparse.triu(matrix, format="csr")
        self._solver = PyPardisoSolver(mtype=2)
        for place, value in PARDISO_SETTINGS.items():
            self._solver.set_iparm(place, value)
        try:
            self._solver.factorize(self._upper)
        except PyPardisoError as error:
            self.close()
            pivot = self._solver.get_iparm(30)
            raise _not_positive_definite(self.unknowns, f"PARDISO: {error}, unknown {pivot}") from error

    def _solve_dense(self, rhs: Floats) -> Floats:
        solution: Floats = self._solver.solve(self._upper, rhs)
        return solution

    def _release(self) -> None:
        self._solver.free_memory(everything=True)


class SuperLUFactorisation(Factorisation):
    """Factorisation by SciPy's SuperLU, symmetric mode: minimum degree of A + A^T, pivots on the diagonal."""

    name = "superlu"

    def __init__(self, matrix: SparseMatrix) -> None:
        super().__init__(matrix.shape[0])
        try:
            self._factor: Any = scipy.sparse.linalg.splu(
                matrix.tocsc(),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise _not_positive_definite(self.unknowns, f"SuperLU: {error}") from error
        negative = int(np.sum(self._factor.U.diagonal() <= 0.0))
        if negative:
            raise _not_positive_definite(self.unknowns, f"SuperLU: {negative} pivots are not positive")

    def _solve_dense(self, rhs: Floats) -> Floats:
        solution: Floats = self._factor.solve(rhs)
        return solution

    def _release(self) -> None:
        self._factor = None


_BACKENDS: dict[Backend, Callable[[SparseMatrix], Factorisation]] = {
    "pardiso": PardisoFactorisation,
    "superlu": SuperLUFactorisation,
}


def available_backends() -> tuple[Backend, ...]:
    """Return the back ends that are installed, the fastest first.

    Examples
    --------
    >>> "superlu" in available_backends()
    True
    """
    if importlib.util.find_spec("pypardiso"):
        return ("pardiso", "superlu")
    return ("superlu",)


def factorise(matrix: SparseMatrix, backend: Backend | None = None) -> Factorisation:
    """Factorise a sparse symmetric positive definite matrix.

    Parameters
    ----------
    matrix : (n, n) symmetric positive definite, both triangles stored. That they agree is not checked.
    backend : {"pardiso", "superlu"}, optional
        The library to use; without it the fastest one installed.

    Returns
    -------
    solves with any number of right-hand sides

    Raises
    ------
    FactorisationError
        The matrix is not positive definite, or so nearly singular that six digits of a solution are lost.
    ValueError
        The matrix is not square, or `backend` is unknown or not installed.

    Examples
    --------
    >>> import numpy as np, scipy.sparse
    >>> matrix = scipy.sparse.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(3, 3), format="csr")
    >>> with factorise(matrix) as factorisation:
    ...     print(factorisation.solve(np.array([1.0, 0.0, 0.0])).round(12))
    [0.75 0.5  0.25]
    """
    if isinstance(matrix, np.ndarray) or matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise ValueError(f"the matrix to factorise must be sparse and square; it has shape {matrix.shape}")
    installed = available_backends()
    chosen = backend or installed[0]
    if chosen not in installed:
        raise ValueError(f"sparse back end {chosen!r} is not installed; installed: {', '.join(installed)}")
    rows = matrix.tocsr()
    _check_diagonal(rows)
    factorisation = _BACKENDS[chosen](rows)
    _check_recovers_known_solution(rows, factorisation)
    return factorisation


def _check_diagonal(matrix: SparseMatrix) -> None:
    """Refuse what needs no factorisation to be seen: PARDISO ends the process on an empty row."""
    bad = np.flatnonzero(~(matrix.diagonal() > 0.0))
    if bad.size:
        raise _not_positive_definite(
            matrix.shape[0], f"{bad.size} diagonal entries are not positive, the first of unknown {bad[0]}"
        )


def _check_recovers_known_solution(matrix: SparseMatrix, factorisation: Factorisation) -> None:
    """Close and refuse a factor that does not give a known solution back.

    Rounding leaves a singular matrix with tiny pivots of either sign, so pivots alone do not tell: a part of
    the null space in the answer does.
    """
    known = np.random.default_rng(0).uniform(-1.0, 1.0, matrix.shape[0])
    error = np.abs(factorisation.solve(matrix @ known) - known).max()
    if not error < LARGEST_PROBE_ERROR:
        factorisation.close()
        raise _not_positive_definite(
            matrix.shape[0], f"a known solution comes back with a relative error of {error:.1e}"
        )


def _point_out_mkl() -> None:
    """Tell pypardiso where the wheel puts MKL, or it walks all of the environment for each solver it makes."""
    libraries = sorted(Path(sys.prefix).glob("lib/libmkl_rt.so*"))
    if libraries:
        os.environ.setdefault("PYPARDISO_MKL_RT", str(libraries[0]))


def _not_positive_definite(unknowns: int, reason: str) -> FactorisationError:
    return FactorisationError(
        f"the matrix of {unknowns} unknowns is singular or not positive definite ({reason}); "
        "are all rigid-body motions held?"
    )


def _dense_columns(vectors: Floats | SparseMatrix) -> Floats:
    dense = vectors if isinstance(vectors, np.ndarray) else vectors.toarray(order="F")
    return np.asfortranarray(dense, dtype=np.float64)


def _chunks(columns: int) -> list[slice]:
    step = RIGHT_HAND_SIDES_AT_A_TIME
    return [slice(start, min(start + step, columns)) for start in range(0, columns, step)]
