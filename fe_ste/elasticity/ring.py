"""Joining equal tooth sectors to an open chain or to the closed ring.

A sector is a symmetric stiffness matrix on its two cut faces, minus face first; the unknowns of the plus face are
written in the frame of the next sector, so that joining two sectors means equating the same numbers. A chain of
sectors is again such a matrix, made by doubling: a ring of z teeth takes some log2(z) eliminations of one face,
where the discrete Fourier transform over the teeth takes z/2 complex ones.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

from fe_ste.tools.arrays import Floats


def blocks(chain: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Split a chain's matrix (2 m, 2 m) into its blocks minus-minus, minus-plus, plus-minus, plus-plus."""
    half = len(chain) // 2
    return chain[:half, :half], chain[:half, half:], chain[half:, :half], chain[half:, half:]


def joined(first: Floats, second: Floats) -> Floats:
    """Join two chains and condense the face between them.

    Parameters
    ----------
    first, second : ndarray (2 m, 2 m)
        The plus face of `first` is the minus face of `second`.

    Returns
    -------
    ndarray (2 m, 2 m)

    Examples
    --------
    Two equal springs in series are half as stiff:

    >>> spring = np.array([[2.0, -2.0], [-2.0, 2.0]])
    >>> joined(spring, spring).tolist()
    [[1.0, -1.0], [-1.0, 1.0]]
    """
    outer_minus, to_middle, _, middle_first = blocks(first)
    middle_second, _, from_middle, outer_plus = blocks(second)
    # Schur complement of the joined face: outer blocks less (coupling) (middle)^-1 (coupling)'. By the Cholesky factor
    # it is a product with its own transpose, and so stays symmetric to the last bit.
    coupling = np.concatenate([to_middle, from_middle])
    factor = scipy.linalg.cholesky(middle_first + middle_second, lower=True, overwrite_a=True, check_finite=False)
    reduced = scipy.linalg.solve_triangular(factor, coupling.T, lower=True, check_finite=False)
    result = -reduced.T @ reduced
    half = len(outer_minus)
    result[:half, :half] += outer_minus
    result[half:, half:] += outer_plus
    return np.asarray(result)


def chain(sector: Floats, count: int) -> Floats:
    """Join `count` equal sectors, by doubling."""
    if count == 1:
        return sector
    twice = chain(joined(sector, sector), count // 2)
    return joined(twice, sector) if count % 2 else twice


def ring_faces(sector: Floats, load: Floats, teeth: int, reach: int) -> dict[int, Floats]:
    """Face displacements of the closed ring under loads on one sector.

    Parameters
    ----------
    sector : ndarray (2 m, 2 m)
    load : ndarray (2 m, k)
        Load columns on the minus and plus face of sector 0.
    teeth : int
        Sectors of the ring.
    reach : int
        Sectors on either side of sector 0 wanted; at least ``teeth - 2 reach`` 2.

    Returns
    -------
    dict
        Face number -> ndarray (m, k) for the faces ``-reach`` to ``reach + 1``; face j is the minus face of sector j.
    """
    minus_minus, minus_plus, plus_minus, plus_plus = blocks(sector)
    half = len(minus_minus)
    # The ring is sector 0 and a chain of all others, condensed to its two ends. The chains that lack the sectors near
    # sector 0 are kept on the way: they give the faces in between back.
    rests = [chain(sector, teeth - 1 - reach)]
    for _ in range(reach):
        rests.append(joined(sector, rests[-1]))
    rest = rests.pop()
    # The rest's minus face is the plus face of sector 0 and the other way round, hence the exchanged blocks.
    closed = sector + np.block([[blocks(rest)[3], blocks(rest)[2]], [blocks(rest)[1], blocks(rest)[0]]])
    solution = scipy.linalg.solve(closed, load, assume_a="pos", check_finite=False)
    faces = {0: solution[:half], 1: solution[half:]}
    for step in range(1, reach + 1):
        rest_mm, rest_mp, rest_pm, rest_pp = blocks(rests.pop())
        # Equilibrium of the next face on either side, between the sector just solved and a chain one shorter.
        ahead = plus_minus @ faces[step] + rest_mp @ faces[0]
        faces[step + 1] = -scipy.linalg.solve(plus_plus + rest_mm, ahead, assume_a="pos", check_finite=False)
        behind = minus_plus @ faces[1 - step] + rest_pm @ faces[1]
        faces[-step] = -scipy.linalg.solve(minus_minus + rest_pp, behind, assume_a="pos", check_finite=False)
    return faces


def open_chain_faces(sector: Floats, load: Floats, teeth: int) -> list[list[Floats]]:
    """Face displacements of an open chain with free ends.

    Parameters
    ----------
    sector : ndarray (2 m, 2 m)
    load : ndarray (2 m, k)
        Load columns on the faces of the loaded sector.
    teeth : int
        Sectors of the chain.

    Returns
    -------
    list of list of ndarray (m, k)
        By loaded sector, then by face 0 to `teeth`.
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


def uniform_faces(sector: Floats, load: Floats) -> Floats:
    """Sum over the ring's faces of their displacements under `load`: the harmonic of order zero, (m, k)."""
    # In that harmonic both faces of a sector move alike, so all four blocks add up.
    half = len(sector) // 2
    matrix = sum(blocks(sector), np.zeros((half, half)))
    return np.asarray(scipy.linalg.solve(matrix, load[:half] + load[half:], assume_a="pos", check_finite=False))
