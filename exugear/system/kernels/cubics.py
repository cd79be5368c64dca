"""Functions of one variable as cubic pieces of equal length, periodic: stiffness and friction over the mesh cycle."""

from __future__ import annotations

import math

import numpy as np

from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel


def periodic_cubic(samples: Floats) -> Floats:
    """Coefficients of a periodic C1 cubic through equally spaced samples over one cycle.

    Slopes are central differences (Catmull and Rom 1974), so that a sample affects only its neighbourhood.

    Parameters
    ----------
    samples : (n,) values at pmc = 0, 1/n, ...; one sample means a constant

    Returns
    -------
    (n, 4) coefficients c of sum_j c_j t^j on each piece, t from 0 to 1

    Examples
    --------
    >>> periodic_cubic(np.array([1.0, 2.0, 1.0, 0.0]))[0]
    array([ 1.,  1.,  1., -1.])
    """
    values = np.asarray(samples, dtype=np.float64)
    following = np.roll(values, -1)
    slope = 0.5 * (following - np.roll(values, 1))
    next_slope = np.roll(slope, -1)
    rise = following - values
    return np.stack([values, slope, 3.0 * rise - 2.0 * slope - next_slope, slope + next_slope - 2.0 * rise], axis=1)


@kernel
def piece_at(scaled: float, pieces: int) -> int:
    """Find the piece that holds a number in [0, pieces]; one of them for any number, also one that is not finite.

    A state that diverges passes through angles that are no numbers, or that no integer can hold: what the processor
    makes of these would read outside the array. Clamping the integer costs nothing; clamping the number, 4 % of a step.
    """
    piece = int(scaled)
    if piece >= pieces:
        return pieces - 1
    return max(0, piece)


@kernel
def piece_of(x: float, pieces: int) -> tuple[int, float]:
    """Piece of a function of period 1 at any position x, and the place in it from 0 to 1."""
    scaled = (x - math.floor(x)) * pieces
    piece = piece_at(scaled, pieces)
    return piece, scaled - piece


@kernel
def cubic(a: float, b: float, c: float, d: float, t: float) -> tuple[float, float, float]:
    """Value of a + b t + c t^2 + d t^3, and its two derivatives by t."""
    return a + t * (b + t * (c + t * d)), b + t * (2.0 * c + t * 3.0 * d), 2.0 * c + 6.0 * t * d


@kernel
def stiffness_at(coefficients: Floats, pieces: int, pmc: float) -> tuple[float, float]:
    """Return stiffness (N/m) and its slope per cycle at any position in the mesh cycle; coefficients (n, 4)."""
    piece, t = piece_of(pmc, pieces)
    c = coefficients[piece]
    value, slope, _ = cubic(c[0], c[1], c[2], c[3], t)
    return value, slope * pieces
