"""Direct factorisation of sparse symmetric positive definite matrices, behind one interface.

Two libraries are supported: MKL PARDISO if ``pypardiso`` is installed (extra ``fast``), else SuperLU, which is part of
SciPy. Both agree to 1e-9; PARDISO is faster by a factor of about ten. They are used for flexible bodies and for the
reference analysis; tooth sectors are condensed by the elimination in this module, without either library.

Cells that lie in a plane couple blocks of unknowns. The set of cells is bisected recursively. A block is eliminated as
soon as all cells that couple it are in one set (George, SIAM J. Numer. Anal. 10 (1973) 345-363), from the dense matrix
of these cells (multifrontal method: Duff and Reid, ACM Trans. Math. Softw. 9 (1983) 302-325). Only the matrix of the
remaining blocks is needed, so that no factor is stored and no right-hand side is solved.

SciPy's own functions copy arrays that are not contiguous and hold Python's lock, so that two threads cannot run
concurrently.
"""

from __future__ import annotations

import ctypes
import importlib.util
import os
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self, TypeAlias

import numpy as np
import scipy.sparse.linalg

from fe_ste.tools.arrays import Booleans, Floats, Integers, SparseMatrix
from fe_ste.tools.threads import side_by_side

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
    """The library at work: "pardiso" or "superlu"."""

    def __init__(self, unknowns: int) -> None:
        self.unknowns = unknowns
        self._closed = False

    def solve(self, rhs: Floats | SparseMatrix) -> Floats:
        """Solve A x = rhs.

        Parameters
        ----------
        rhs : (n,) or (n, k), one right-hand side a column

        Returns
        -------
        the solutions, as a dense array of the shape of `rhs`

        Raises
        ------
        ValueError
            `rhs` has the wrong number of rows, or the factorisation was closed.
        """
        if self._closed:
            raise ValueError(f"the factorisation of {self.unknowns} unknowns was closed: factorise again")
        if rhs.shape[0] != self.unknowns:
            raise ValueError(f"right-hand sides have {rhs.shape[0]} rows; the matrix has {self.unknowns}")
        if rhs.ndim == 1:
            return self._solve_dense(_dense_columns(rhs.reshape(-1, 1)))[:, 0]
        solution = np.empty(rhs.shape, order="F")
        for start in range(0, rhs.shape[1], RIGHT_HAND_SIDES_AT_A_TIME):
            columns = slice(start, start + RIGHT_HAND_SIDES_AT_A_TIME)
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
        # Without a path to MKL, pypardiso searches the whole environment for each solver it creates.
        libraries = sorted(Path(sys.prefix).glob("lib/libmkl_rt.so*"))
        if libraries:
            os.environ.setdefault("PYPARDISO_MKL_RT", str(libraries[0]))
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
    return ("pardiso", "superlu") if importlib.util.find_spec("pypardiso") else ("superlu",)


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
    # PARDISO ends the process on an empty row.
    bad = np.flatnonzero(~(rows.diagonal() > 0.0))
    if bad.size:
        raise _not_positive_definite(
            rows.shape[0], f"{bad.size} diagonal entries are not positive, the first of unknown {bad[0]}"
        )
    factorisation = _BACKENDS[chosen](rows)
    # Rounding gives a singular matrix tiny pivots of either sign, so pivots alone do not show that it is singular; a
    # component of the null space in the solution does.
    known = np.random.default_rng(0).uniform(-1.0, 1.0, rows.shape[0])
    error = np.abs(factorisation.solve(rows @ known) - known).max()
    if not error < LARGEST_PROBE_ERROR:
        factorisation.close()
        raise _not_positive_definite(rows.shape[0], f"a known solution comes back with a relative error of {error:.1e}")
    return factorisation


def _not_positive_definite(unknowns: int, reason: str) -> FactorisationError:
    return FactorisationError(
        f"the matrix of {unknowns} unknowns is singular or not positive definite ({reason}); "
        "are all rigid-body motions held?"
    )


def _dense_columns(vectors: Floats | SparseMatrix) -> Floats:
    dense = vectors if isinstance(vectors, np.ndarray) else vectors.toarray(order="F")
    return np.asfortranarray(dense, dtype=np.float64)


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
    unit = ctypes.byref(ctypes.c_double(1.0))
    sizes = _integer(rows), _integer(columns), _integer(inner)
    _function("blas", "dgemm")(b"N", b"T", *sizes, scale, *_place(left), *_place(right), unit, *_place(target))


def subtract_square(target: Floats, left: Floats) -> None:
    """Subtract ``left @ left.T`` from the lower triangle of a symmetric matrix; both are stored by columns."""
    rows, inner = left.shape
    if min(rows, inner) == 0:
        return
    minus = ctypes.byref(ctypes.c_double(-1.0))
    unit = ctypes.byref(ctypes.c_double(1.0))
    _function("blas", "dsyrk")(b"L", b"N", _integer(rows), _integer(inner), minus, *_place(left), unit, *_place(target))


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
    unit = ctypes.byref(ctypes.c_double(1.0))
    sizes = _integer(rows.shape[0]), _integer(rows.shape[1])
    _function("blas", "dtrsm")(b"R", b"L", transposed, b"N", *sizes, unit, *_place(factor), *_place(rows))


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


# Elimination along a nested dissection: a Schur complement of a large sparse matrix by dense fronts

#: Directions in which a set of cells may be cut, and where, as parts of its cells.
_DIRECTIONS = 8
_FRACTIONS = np.array([0.36, 0.43, 0.5, 0.57, 0.64])

#: Parts of unequal size leave more work for later.
_UNEVEN = 1.0 + 2.0 * np.abs(_FRACTIONS - 0.5)


@dataclass(frozen=True, eq=False)
class Front:
    """A step of the elimination: some blocks are eliminated, their neighbours take up what is left."""

    eliminated: Integers
    border: Integers
    """Blocks, in the order of elimination; those that are kept come last."""
    children: tuple[Front, ...]
    """What comes before; none for a leaf."""
    cells: Integers
    """Cells of a leaf."""


def dissected(middles: Floats, cells: Sequence[Integers], sizes: Integers, kept: Integers, leaf_blocks: int) -> Front:
    """Dissect cells.

    Parameters
    ----------
    middles : (m, 2) middle of each cell
    cells : blocks that each of the m cells couples
    sizes : (b,) unknowns of each block
    kept : blocks that are never eliminated
    leaf_blocks : a set with at most so many blocks is not cut any more

    Returns
    -------
    the last one; its border are the blocks that are kept and that some cell couples
    """
    couples = np.zeros((len(cells), len(sizes)), dtype=bool)
    for number, blocks in enumerate(cells):
        couples[number, blocks] = True
    inner = np.asarray(couples.any(axis=0))
    inner[kept] = False
    plan = _Plan(middles, couples, np.asarray(sizes, dtype=np.float64), leaf_blocks)
    tree = plan.cut(np.arange(len(cells)), inner)
    place = np.full(len(sizes), len(sizes))
    place[plan.order] = np.arange(len(plan.order))
    return _sorted_borders(tree, place)


class _Plan:
    """The cells, and the order of elimination found so far."""

    def __init__(self, middles: Floats, couples: Booleans, sizes: Floats, leaf_blocks: int) -> None:
        self._couples, self._sizes, self._leaf_blocks = couples, sizes, leaf_blocks
        angle = np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS
        self._along = np.stack([np.cos(angle), np.sin(angle)], axis=1) @ middles.T
        self.order: list[int] = []

    def cut(self, cells: Integers, inner: Booleans) -> Front:
        """Dissect a set of cells; `inner` are the blocks that only these cells couple, and that are not kept."""
        touched = self._couples[cells].any(axis=0)
        border = touched & ~inner
        children: tuple[Front, ...] = ()
        if np.count_nonzero(touched) > self._leaf_blocks and len(cells) > 1:
            one, other = self._best_cut(cells, inner, border)
            of_one, of_other = (self._couples[part].any(axis=0) for part in (one, other))
            children = self.cut(one, inner & ~of_other), self.cut(other, inner & ~of_one)
            inner = inner & of_one & of_other
        eliminated = np.flatnonzero(inner)
        self.order.extend(eliminated.tolist())
        return Front(eliminated, np.flatnonzero(border), children, cells[:0] if children else cells)

    def _best_cut(self, cells: Integers, inner: Booleans, border: Booleans) -> tuple[Integers, Integers]:
        """Partition with minimum work for the front between both parts and for fronts with that border in either."""
        blocks = np.flatnonzero(inner | border)
        block, cell = np.nonzero(self._couples[np.ix_(cells, blocks)].T)
        starts = np.searchsorted(block, np.arange(len(blocks)))
        order = np.argsort(self._along[:, cells], axis=1, kind="stable")
        rank = np.empty_like(order)
        np.put_along_axis(rank, order, np.arange(len(cells))[None], axis=1)
        first = np.minimum.reduceat(rank[:, cell], starts, axis=1)[:, None]
        last = np.maximum.reduceat(rank[:, cell], starts, axis=1)[:, None]
        counts = np.clip(np.round(_FRACTIONS * len(cells)).astype(np.int64), 1, len(cells) - 1)
        one = first < counts[:, None]
        other = last >= counts[:, None]
        held = border[blocks]
        sizes = self._sizes[blocks]
        between = one & other & ~held
        gone = between @ sizes
        work = _work(gone, sizes[held].sum())
        for part in (one, other):
            # What of this part lies along the cut or the border.
            work = work + 0.5 * _work(gone, (part & held | between) @ sizes)
        direction, place = np.unravel_index(np.argmin(work * _UNEVEN), work.shape)
        count = counts[place]
        return cells[order[direction, :count]], cells[order[direction, count:]]


def _work(gone: Floats, border: Floats) -> Floats:
    """Multiplications to eliminate unknowns from a front."""
    return np.asarray(gone * (gone * gone / 3 + gone * border + border * border))


def _sorted_borders(front: Front, place: Integers) -> Front:
    border = front.border[np.argsort(place[front.border], kind="stable")]
    children = tuple(_sorted_borders(child, place) for child in front.children)
    return Front(front.eliminated, border, children, front.cells)


def parts_without(front: Front, blocks: Integers) -> list[Front]:
    """Return the largest parts of a dissection in which no cell couples any of some blocks."""
    found, untouched = _parts_without(front, set(blocks.tolist()))
    return [front] if untouched else found


def _parts_without(front: Front, blocks: set[int]) -> tuple[list[Front], bool]:
    of_children = [(child, *_parts_without(child, blocks)) for child in front.children]
    if blocks.isdisjoint([*front.eliminated.tolist(), *front.border.tolist()]) and all(
        free for *_, free in of_children
    ):
        return [], True
    return [part for child, found, free in of_children for part in ([child] if free else found)], False


def schur_complement(
    front: Front,
    sizes: Integers,
    add_cells: Callable[[Floats, Integers, Integers], None],
    known: Mapping[Front, Floats] | None = None,
) -> Floats:
    """Eliminate all blocks but those that are kept.

    Parameters
    ----------
    front : the last front of a dissection, or of a part of it
    sizes : unknowns of each block
    add_cells
        Adds to a matrix the symmetric matrices of cells, over the unknowns of blocks: given are the matrix, stored by
        columns, of which the lower triangle counts, cells and blocks.
    known : results for parts of the dissection

    Returns
    -------
    (n, n) over the unknowns of the last front's border, stored by columns, lower triangle

    Raises
    ------
    fe_ste.elimination.FactorisationError
        A front is not positive definite.
    """
    if known and front in known:
        return known[front]
    blocks = np.concatenate([front.eliminated, front.border])
    count = int(sizes[blocks].sum())
    gone = int(sizes[front.eliminated].sum())
    parts = side_by_side(lambda child: schur_complement(child, sizes, add_cells, known), front.children)
    matrix = np.zeros((count, count), order="F")
    for child, part in zip(front.children, parts, strict=True):
        _add(matrix, blocks, sizes, child.border, part)
    if not front.children:
        add_cells(matrix, front.cells, blocks)
    eliminate(matrix, gone)
    return matrix[gone:, gone:]


def _add(matrix: Floats, blocks: Integers, sizes: Integers, part_blocks: Integers, part: Floats) -> None:
    """Add a symmetric matrix over some of the blocks; their order is one, so that lower triangles stay so."""
    runs = list(_runs(blocks, sizes, part_blocks))
    for column, (from_column, to_column) in enumerate(runs):
        for from_row, to_row in runs[column:]:
            matrix[to_row, to_column] += part[from_row, from_column]


def _runs(blocks: Integers, sizes: Integers, part_blocks: Integers) -> Iterator[tuple[slice, slice]]:
    """Slices of unknowns that follow each other both in a part and in the whole."""
    start = np.concatenate([[0], np.cumsum(sizes[blocks])])
    part_start = np.concatenate([[0], np.cumsum(sizes[part_blocks])])
    order = np.argsort(blocks)
    place = order[np.searchsorted(blocks, part_blocks, sorter=order)]
    edges = np.flatnonzero(np.diff(place) != 1) + 1
    for first, last in zip([0, *edges], [*edges, len(place)], strict=True):
        if last > first:
            begin = start[place[first]]
            length = part_start[last] - part_start[first]
            yield slice(part_start[first], part_start[last]), slice(begin, begin + length)
