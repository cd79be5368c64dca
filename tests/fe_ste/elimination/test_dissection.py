"""Elimination along a nested dissection, against dense solution."""

from __future__ import annotations

import numpy as np
import pytest

from fe_ste.elimination import Front, dissected, parts_without, schur_complement
from fe_ste.tools.arrays import Floats, Integers


def grid(columns: int, rows: int) -> tuple[Floats, list[Integers]]:
    """Middles and blocks (the corners) of unit squares."""
    corner = np.arange((columns + 1) * (rows + 1)).reshape(columns + 1, rows + 1)
    places = [(i, j) for i in range(columns) for j in range(rows)]
    return np.array(places) + 0.5, [corner[i : i + 2, j : j + 2].ravel() for i, j in places]


def fronts_of(front: Front) -> list[Front]:
    return [front, *(inner for child in front.children for inner in fronts_of(child))]


@pytest.mark.parametrize("leaf_blocks", [4, 9, 1000])
def test_what_is_left_is_the_schur_complement(leaf_blocks: int) -> None:
    random = np.random.default_rng(5)
    middles, cells = grid(9, 6)
    sizes = random.integers(0, 4, 70)
    kept = np.array([0, 3, 33, 69])
    start = np.concatenate([[0], np.cumsum(sizes)])
    whole = np.zeros((start[-1], start[-1]))

    def unknowns(blocks: Integers) -> Integers:
        return np.concatenate([np.arange(start[block], start[block + 1]) for block in blocks])

    matrices = []
    for blocks in cells:
        root = random.normal(size=(len(unknowns(blocks)),) * 2)
        matrices.append(root @ root.T + np.eye(len(root)))
        whole[np.ix_(unknowns(blocks), unknowns(blocks))] += matrices[-1]

    def add_cells(matrix: Floats, of: Integers, blocks: Integers) -> None:
        mine = np.zeros_like(whole)
        for cell in of:
            mine[np.ix_(unknowns(cells[cell]), unknowns(cells[cell]))] += matrices[cell]
        matrix += mine[np.ix_(unknowns(blocks), unknowns(blocks))]

    plan = dissected(middles, cells, sizes, kept, leaf_blocks)
    found = schur_complement(plan, sizes, add_cells)
    keep = unknowns(kept)
    gone = np.setdiff1d(np.arange(len(whole)), keep)
    expected = whole[np.ix_(keep, keep)] - whole[np.ix_(keep, gone)] @ np.linalg.solve(
        whole[np.ix_(gone, gone)], whole[np.ix_(gone, keep)]
    )
    # Matrices of condition 100: rounding.
    assert np.abs(np.tril(found - expected)).max() < 1e-12 * np.abs(expected).max()

    # Parts that couple none of some blocks may be known before.
    known = {part: schur_complement(part, sizes, add_cells) for part in parts_without(plan, np.array([5, 33]))}
    assert (np.tril(schur_complement(plan, sizes, add_cells, known)) == np.tril(found)).all()


def test_each_block_is_eliminated_once_and_each_cell_is_in_one_leaf() -> None:
    middles, cells = grid(12, 12)
    kept = np.arange(13)
    plan = fronts_of(dissected(middles, cells, np.ones(169, dtype=np.int64), kept, 9))
    assert np.sort(np.concatenate([front.eliminated for front in plan])).tolist() == list(range(13, 169))
    assert np.sort(np.concatenate([front.cells for front in plan])).tolist() == list(range(144))
    assert plan[0].border.tolist() == kept.tolist()


def test_parts_without_some_blocks_are_the_largest() -> None:
    middles, cells = grid(8, 8)
    plan = dissected(middles, cells, np.ones(81, dtype=np.int64), np.array([], dtype=np.int64), 9)
    parts = parts_without(plan, np.array([0]))  # a corner, which one cell couples
    couples_it = [number for number, blocks in enumerate(cells) if 0 in blocks]
    inside = np.concatenate([front.cells for part in parts for front in fronts_of(part)])
    (leaf,) = (front for front in fronts_of(plan) if set(couples_it) & set(front.cells.tolist()))
    assert sorted([*inside.tolist(), *leaf.cells.tolist()]) == list(range(64))
    assert parts_without(plan, np.array([81])) == [plan]


def test_a_square_grid_is_cut_along_its_lines() -> None:
    """The separator of n x n squares has n + 1 corners, and a front has few more neighbours than its edges."""
    middles, cells = grid(16, 16)
    plan = fronts_of(dissected(middles, cells, np.ones(289, dtype=np.int64), np.array([], dtype=np.int64), 9))
    assert len(plan[0].eliminated) == 17
    assert max(len(front.eliminated) + len(front.border) for front in plan) <= 2 * 17
