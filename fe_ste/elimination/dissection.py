"""Elimination along a nested dissection: a Schur complement of a large sparse matrix by dense fronts.

Cells that lie in a plane couple blocks of unknowns. A set of cells is cut in two, again and again; a block is
eliminated as soon as all cells that couple it are in one set (George, SIAM J. Numer. Anal. 10 (1973) 345-363), from a
dense matrix of what these cells couple (the multifrontal method: Duff and Reid, ACM Trans. Math. Softw. 9 (1983)
302-325). Only the matrix that is left for the blocks that are kept is wanted: no factor is stored, and no right-hand
side is solved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fe_ste.elimination.dense import eliminate
from fe_ste.tools.arrays import Booleans, Floats, Integers
from fe_ste.tools.threads import side_by_side

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
        """Cut with the least work of the front between both parts, and of a front with that border in either."""
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
    if untouched:
        return [front]
    return found


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
    fe_ste.elimination.sparse.FactorisationError
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
