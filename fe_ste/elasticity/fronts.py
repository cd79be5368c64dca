"""Schur complement of a large sparse matrix by dense fronts, along a nested dissection.

The multifrontal method (Duff and Reid, ACM Trans. Math. Softw. 9 (1983) 302-325), of which only the matrix that is
left for the blocks that are kept is wanted: no factor is stored, and no right-hand side is solved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fe_ste.elasticity.dissection import Front
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.dense import eliminate


def schur_complement(front: Front, sizes: Integers, leaf: Callable[[Integers, Integers], Floats]) -> Floats:
    """Eliminate all blocks but those that are kept.

    Parameters
    ----------
    front : Front
        The last front of a dissection.
    sizes : ndarray
        Unknowns of each block.
    leaf : callable
        Of cells and blocks: the sum of the cells' symmetric matrices over the unknowns of these blocks, stored by
        columns; its lower triangle counts.

    Returns
    -------
    ndarray (n, n)
        Over the unknowns of the last front's border, stored by columns, lower triangle.

    Raises
    ------
    fe_ste.tools.dense.NotPositiveDefiniteError
    """
    blocks = np.concatenate([front.eliminated, front.border])
    if front.children:
        count = int(sizes[blocks].sum())
        matrix = np.zeros((count, count), order="F")
        for child in front.children:
            _add(matrix, blocks, sizes, child.border, schur_complement(child, sizes, leaf))
    else:
        matrix = leaf(front.cells, blocks)
    gone = int(sizes[front.eliminated].sum())
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
            begin, length = start[place[first]], part_start[last] - part_start[first]
            yield slice(part_start[first], part_start[last]), slice(begin, begin + length)
