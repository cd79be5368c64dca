"""Joining equal tooth sectors to an open chain or to the closed ring.

A sector, and any chain of sectors, turned by 180 degrees about the line through its middle is equal to itself. So it is
two symmetric stiffness matrices on its plus face: one for even deformations, which that turn keeps, and one for odd
ones, which it reverses; the minus face then moves as the plus face turned, or against it. The unknowns of a face are
chosen so that the turn about the face's own middle keeps or reverses each: its signs, 1 or -1, ones first.

A chain is made by doubling: a ring of z teeth takes some log2(z) eliminations of one face, where the discrete Fourier
transform over the teeth takes z/2 complex ones.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg

from fe_ste.elimination.dense import divided_by_factor, eliminate, mirrored_lower
from fe_ste.tools.arrays import Floats
from fe_ste.tools.threads import side_by_side


class Chain(NamedTuple):
    """Equal sectors in a row, or one: stiffness (m, m) of the plus face in even and in odd deformations, N/m."""

    even: Floats
    odd: Floats

    @property
    def own(self) -> Floats:
        """Force on the plus face by its own displacement, the minus face held."""
        return (self.even + self.odd) / 2

    @property
    def across(self) -> Floats:
        """Force on the plus face by the displacement of the minus face turned, the plus face held."""
        return (self.even - self.odd) / 2

    def whole(self, signs: Floats) -> Floats:
        """Return the stiffness (2 m, 2 m) of both faces, minus face first."""
        turned = self.own * signs * signs[:, None]
        return np.block([[turned, signs[:, None] * self.across], [self.across * signs, self.own]])


def doubled(chain: Chain, signs: Floats) -> Chain:
    """Join a chain to one like it.

    Parameters
    ----------
    signs : (m,) of the unknowns of a face

    Examples
    --------
    Two equal springs in series are half as stiff. Their ends move along the springs, which the turn reverses: even is
    what stretches them, odd what moves them as a whole.

    >>> spring = Chain(even=np.array([[2.0]]), odd=np.array([[0.0]]))
    >>> doubled(spring, np.array([-1.0])).even.tolist()
    [[1.0]]
    """
    own = chain.own
    across = chain.across
    ones = int(np.count_nonzero(signs > 0))

    def half(parity: int) -> Floats:
        # The joined face lies in the middle of the new chain: an even deformation moves only what its turn keeps.
        moved = slice(None, ones) if parity > 0 else slice(ones, None)
        return _condensed(own[moved, moved], across[:, moved], own)[0]

    return Chain(*side_by_side(half, (1, -1)))


def enclosed(inner: Floats, outer: Chain, signs: Floats) -> tuple[Floats, Floats, Floats]:
    """Join a chain to either end of another one.

    Parameters
    ----------
    inner : (m, m) the even or the odd stiffness of the chain in the middle
    signs : (m,)

    Returns
    -------
    stiffness : (m, m) of the whole, even or odd as `inner`
    factor, below : (m, m)
        ``-(below @ inv(factor)).T`` is the displacement of the inner plus face by that of the outer one.
    """
    return _condensed(inner + outer.own * signs * signs[:, None], outer.across * signs, outer.own)


def _condensed(gone: Floats, coupling: Floats, kept: Floats) -> tuple[Floats, Floats, Floats]:
    """Schur complement of the unknowns that are gone, their Cholesky factor L, and the coupling times L^-T."""
    size = len(kept)
    count = len(gone)
    front = np.empty((count + size, count + size), order="F")
    front[:count, :count], front[count:, :count], front[count:, count:] = gone, coupling, kept
    eliminate(front, count)
    return mirrored_lower(front[count:, count:]), front[:count, :count], front[count:, :count]


def chain_of(sector: Chain, count: int, signs: Floats) -> Chain:
    """Join `count` equal sectors, by doubling."""
    if count == 1:
        return sector
    half = chain_of(sector, count // 2, signs)
    if count % 2 == 0:
        return doubled(half, signs)
    return Chain(*side_by_side(lambda middle: enclosed(middle, half, signs)[0], sector))


def ring_faces(sector: Chain, load: Chain, signs: Floats, teeth: int, reach: int) -> dict[int, Floats]:
    """Face displacements of the closed ring under loads on one sector.

    Parameters
    ----------
    load : forces (m, k) on the plus face of sector 0 under even and odd loads: a load and the same turned, or reversed
    signs : (m,) of the unknowns of a face
    teeth : sectors of the ring
    reach : sectors on either side of sector 0 wanted; at least ``teeth - 2 reach`` 2

    Returns
    -------
    dict
        Face number -> ndarray (m, k) for the faces ``-reach`` to ``reach + 1``, under the loads alone; face j is the
        minus face of sector j.
    """
    # The ring is sector 0 and a chain of all others. That grows from its middle, opposite to sector 0, by one sector on
    # either side; on the way it tells how each face follows the next one.
    rest = chain_of(sector, teeth - 1 - 2 * reach, signs)

    def one_parity(parity: int) -> list[Floats]:
        at = 0 if parity > 0 else 1
        stiffness = rest[at]
        follows = []
        for _ in range(reach):
            stiffness, factor, below = enclosed(stiffness, sector, signs)
            follows.append((factor, below))
        # The plus face of the rest is the minus face of sector 0, which moves as the plus face turned, or against that.
        closed = sector[at] + stiffness * signs * signs[:, None]
        held = scipy.linalg.cho_factor(closed, lower=True, overwrite_a=True, check_finite=False)
        first = scipy.linalg.cho_solve(held, load[at], check_finite=False)
        faces = [parity * signs[:, None] * first]
        for factor, below in reversed(follows):
            faces.append(-divided_by_factor(faces[-1].T @ below, factor).T)
        return faces  # 0, -1, -2, ...

    even, odd = side_by_side(one_parity, (1, -1))
    result = {}
    for step, (kept, reverse) in enumerate(zip(even, odd, strict=True)):
        result[-step] = (kept + reverse) / 2
        result[step + 1] = signs[:, None] * (kept - reverse) / 2
    return result


def open_chain_faces(sector: Floats, load: Floats, teeth: int) -> list[list[Floats]]:
    """Face displacements of an open chain with free ends.

    Parameters
    ----------
    sector : (2 m, 2 m) both faces, minus face first; see `Chain.whole`
    load : (2 m, k) load columns on the faces of the loaded sector
    teeth : sectors of the chain

    Returns
    -------
    (m, k) by loaded sector, then by face 0 to `teeth`
    """
    half = len(sector) // 2
    matrix = np.zeros((half * (teeth + 1), half * (teeth + 1)))
    for number in range(teeth):
        both = slice(half * number, half * (number + 2))
        matrix[both, both] += sector
    factor = scipy.linalg.cho_factor(matrix, overwrite_a=True, check_finite=False)
    result = []
    for number in range(teeth):
        right = np.zeros((len(matrix), load.shape[1]))
        right[half * number : half * (number + 2)] = load
        result.append(np.split(scipy.linalg.cho_solve(factor, right, check_finite=False), teeth + 1))
    return result


def uniform_faces(sector: Chain, load: Chain, signs: Floats) -> Floats:
    """Sum over the ring's faces of their displacements under loads as in `ring_faces`, (m, k)."""
    # In this harmonic of order zero both faces of a sector move alike: what the turn of a face keeps is an even
    # deformation of the sector, what it reverses an odd one.
    ones = int(np.count_nonzero(signs > 0))
    parts = (
        scipy.linalg.solve(stiffness[part, part], forces[part], assume_a="pos", check_finite=False)
        for stiffness, forces, part in zip(sector, load, (slice(None, ones), slice(ones, None)), strict=True)
    )
    return np.concatenate(list(parts)) / 2
