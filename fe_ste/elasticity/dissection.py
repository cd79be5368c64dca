"""Order in which unknowns are eliminated: nested dissection of cells that lie in a plane.

Cells couple blocks of unknowns. A set of cells is cut in two, again and again; a block is eliminated as soon as all
cells that couple it are in one set. What is never eliminated is kept to the end (George, SIAM J. Numer. Anal. 10
(1973) 345-363).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fe_ste.tools.arrays import Floats, Integers

#: Directions in which a set of cells may be cut, and where, as parts of its cells.
_DIRECTIONS = 8
_FRACTIONS = (0.36, 0.43, 0.5, 0.57, 0.64)


@dataclass(frozen=True)
class Front:
    """A step of the elimination: some blocks are eliminated, their neighbours take up what is left.

    Attributes
    ----------
    eliminated, border : ndarray
        Blocks, in the order of elimination; those that are kept come last.
    children : tuple of Front
        What comes before; none for a leaf.
    cells : ndarray
        Cells of a leaf.
    """

    eliminated: Integers
    border: Integers
    children: tuple[Front, ...]
    cells: Integers


def dissected(middles: Floats, cells: Sequence[Integers], sizes: Integers, kept: Integers, leaf_blocks: int) -> Front:
    """Dissect cells.

    Parameters
    ----------
    middles : ndarray (m, 2)
        Middle of each cell.
    cells : sequence of ndarray
        Blocks that each of the m cells couples.
    sizes : ndarray (b,)
        Unknowns of each block.
    kept : ndarray
        Blocks that are never eliminated.
    leaf_blocks : int
        A set with at most so many blocks is not cut any more.

    Returns
    -------
    Front
        The last one; its border are the blocks that are kept and that some cell couples.
    """
    couples = np.zeros((len(cells), len(sizes)), dtype=bool)
    for number, blocks in enumerate(cells):
        couples[number, blocks] = True
    plan = _Plan(middles, couples, np.asarray(sizes, dtype=np.float64), leaf_blocks)
    inner = couples.any(axis=0)
    inner[kept] = False
    tree = plan.cut(np.arange(len(cells)), inner)
    place = np.full(len(sizes), len(sizes))
    place[plan.order] = np.arange(len(plan.order))
    return _sorted_borders(tree, place)


class _Plan:
    """The cells, and the order of elimination found so far."""

    def __init__(self, middles: Floats, couples: np.ndarray[tuple[int, int], np.dtype[np.bool_]], sizes: Floats, leaf_blocks: int) -> None:
        self._middles, self._couples, self._sizes, self._leaf_blocks = middles, couples, sizes, leaf_blocks
        angle = np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS
        self._directions = np.stack([np.cos(angle), np.sin(angle)])
        self.order: list[int] = []

    def cut(self, cells, inner) -> Front:
        """Dissect a set of cells; `inner` tells which blocks no cell outside the set couples, and none keeps."""
        touched = self._couples[cells].any(axis=0)
        children: tuple[Front, ...] = ()
        left_over = inner
        if np.count_nonzero(touched) > self._leaf_blocks and len(cells) > 1:
            one, other = self._best_cut(cells, inner)
            of_one, of_other = self._couples[one].any(axis=0), self._couples[other].any(axis=0)
            children = (self.cut(one, inner & of_one & ~of_other), self.cut(other, inner & of_other & ~of_one))
            left_over = inner & of_one & of_other
        eliminated = np.flatnonzero(left_over)
        self.order.extend(eliminated.tolist())
        return Front(eliminated, np.flatnonzero(touched & ~inner), children, cells if not children else cells[:0])

    def _best_cut(self, cells, inner):
        """Cut with the least work of the front between both parts and of the largest fronts within them."""
        along = self._middles[cells] @ self._directions
        orders = np.argsort(along, axis=0, kind="stable").T
        best, chosen = np.inf, (cells[:1], cells[1:])
        border = self._couples[cells].any(axis=0) & ~inner
        for order in orders:
            behind = np.logical_or.accumulate(self._couples[cells[order]], axis=0)
            ahead = np.logical_or.accumulate(self._couples[cells[order[::-1]]], axis=0)[::-1]
            for fraction in _FRACTIONS:
                count = min(max(round(fraction * len(cells)), 1), len(cells) - 1)
                one, other = behind[count - 1], ahead[count]
                between = one & other & inner
                work = self._work(between, border)
                # Each part has this cut as a border of all that lies along it.
                for part in (one, other):
                    work += 0.5 * self._work(between, (border & part) | between)
                work *= 1 + 2 * abs(fraction - 0.5)
                if work < best:
                    best, chosen = work, (cells[order[:count]], cells[order[count:]])
        return chosen

    def _work(self, eliminated, border) -> float:
        s, b = self._sizes[eliminated].sum(), self._sizes[border].sum()
        return float(s * (s * s / 3 + s * b + b * b))


def _sorted_borders(front: Front, place: Integers) -> Front:
    border = front.border[np.argsort(place[front.border], kind="stable")]
    return Front(front.eliminated, border, tuple(_sorted_borders(child, place) for child in front.children), front.cells)
