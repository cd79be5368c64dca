"""Modes followed over speed: which mode at one speed is which at the next.

Two modes at neighbouring speeds are compared by left and right shapes::

    MAC_ij = |(left_i . right_j) (left_j . right_i)|,   left_i . right_i = 1 at each speed

This is 1 for the same mode, and 0 for different ones of one system, however it is damped and however gyroscopic:
shapes of such systems are not orthogonal by mass alone. Where modes veer, steps are halved until shapes change
gradually. Two modes that changed places within a step crossed if MAC_ij is zero; else they are coupled by half a gap

    c = root(MAC_ij) / (1 / D_1 + 1 / D_2),   D their distance in frequency at both ends of the step,

as two modes are that veer, and stay close over 2 c / (D_1 + D_2) of the step: if that is wide enough to be seen, the
step is halved, too.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from fe_ste.tools.arrays import Complexes, Floats, Integers
from fe_ste.tools.threads import side_by_side

Found: TypeAlias = tuple[Complexes, Complexes, Complexes]
"""Eigenvalues (n,), right and left shapes (n, 2 size), as `exugear.steady.mean_system.mean_modes` gives them."""
CLEAR = 0.8
"""MAC from which two modes are taken for one without a look in between."""
LEAST = 0.05
"""MAC below which two modes are none."""
COUNT, MOST = 9, 33
"""Even speeds to begin with, and speeds at most."""
NARROWEST = 1.0 / 512.0
"""Share of the range below which a step is not halved, and a veering is a crossing."""


@dataclass(frozen=True, eq=False)
class ModeTracks:
    """Modes over speed; n speeds, m modes in the order of their frequency."""

    speeds: Floats
    """(n,) ascending, rad/s."""
    eigenvalues: Complexes
    """(n, m) 1/s; NaN where a mode is none: beyond the highest frequency, or overdamped."""
    shapes: Complexes
    left: Complexes
    """(n, m, size) displacements, and the parts of left shapes that loads meet; zero where a mode is none."""

    @property
    def frequency(self) -> Floats:
        """Damped eigenfrequencies (n, m), Hz."""
        return self.eigenvalues.imag / (2.0 * np.pi)

    @property
    def damping(self) -> Floats:
        """Shares (n, m) of critical damping."""
        return np.asarray(-self.eigenvalues.real / np.abs(self.eigenvalues))


def assurance(one: Found, other: Found) -> Floats:
    """MAC (n, m) of modes of one system with those of another that differs little."""
    return np.asarray(np.abs((one[2] @ other[1].T) * (other[2] @ one[1].T).T))


def mode_tracks(modes_at: Callable[[float], Found], low: float, high: float) -> ModeTracks:
    """Follow modes from one speed to another.

    Parameters
    ----------
    modes_at : from a speed (rad/s) to the modes there
    low, high : ends of the range, rad/s

    Examples
    --------
    A mode that hardens with speed passes one that does not:

    >>> from exugear.steady.mean_system.mean_modes import vibrations
    >>> tracks = mode_tracks(
    ...     lambda w: vibrations(np.eye(2), np.zeros((2, 2)), np.diag([100.0, 50.0 + w**2])), 0.0, 20.0
    ... )
    >>> (2.0 * np.pi * tracks.frequency[[0, -1]]).round(3)
    array([[10.   ,  7.071],
           [10.   , 21.213]])
    """
    even = np.linspace(low, high, COUNT).tolist()
    found = dict(zip(even, side_by_side(modes_at, even), strict=True))
    narrowest = NARROWEST * abs(high - low)
    while len(found) < MOST:
        speeds = sorted(found)
        steps = [
            (_clarity(found[a], found[b], narrowest / (b - a)), 0.5 * (a + b))
            for a, b in itertools.pairwise(speeds)
            if b - a > narrowest
        ]
        unclear = min(steps, default=(1.0, 0.0))
        if unclear[0] >= CLEAR:
            break
        found[unclear[1]] = modes_at(unclear[1])
    speeds = sorted(found)
    return _joined(np.array(speeds), [found[speed] for speed in speeds])


def _matches(one: Found, other: Found) -> tuple[Integers, Integers, Floats]:
    """Pairs of modes that are one, each used once so that the sum of the MAC is largest, and their MAC."""
    import scipy.optimize  # a quarter of a second that others need not wait

    values = assurance(one, other)
    rows, columns = scipy.optimize.linear_sum_assignment(values, maximize=True)
    kept = values[rows, columns] >= LEAST
    rows = rows[kept]
    columns = columns[kept]
    return rows, columns, values[rows, columns]


def _clarity(one: Found, other: Found, narrowest: float) -> float:
    """Least MAC of modes that are one across a step, or less than `CLEAR` where a veering may hide in it."""
    rows, columns, values = _matches(one, other)
    before, after = (own[0][places].imag for own, places in ((one, rows), (other, columns)))
    far = np.triu(np.subtract.outer(before, before), 1)
    near = np.triu(np.subtract.outer(after, after), 1)
    first, second = np.nonzero(far * near < 0.0)
    apart = np.abs(far[first, second]), np.abs(near[first, second])
    cross = assurance(one, other)[rows[first], columns[second]]
    share = 2.0 * np.sqrt(cross) / (1.0 / apart[0] + 1.0 / apart[1]) / (apart[0] + apart[1])
    hidden = share[share > narrowest].max(initial=0.0)
    clear = float(values.min(initial=1.0))
    if hidden:
        return min(clear, CLEAR * (1.0 - min(1.0, float(hidden))))
    return clear


def _joined(speeds: Floats, found: list[Found]) -> ModeTracks:
    """Tracks from modes at each speed, in the order of their mean frequency."""
    places = [list(range(len(found[0][0])))]
    count = len(found[0][0])
    for one, other in itertools.pairwise(found):
        rows, columns, _ = _matches(one, other)
        own = dict(zip(columns.tolist(), (places[-1][row] for row in rows), strict=True))
        new = [n for n in range(len(other[0])) if n not in own]
        own |= {n: count + number for number, n in enumerate(new)}
        count += len(new)
        places.append([own[n] for n in range(len(other[0]))])
    size = found[0][1].shape[1] // 2
    eigenvalues = np.full((len(speeds), count), complex(np.nan, np.nan))
    shapes, partners = np.zeros((2, len(speeds), count, size), dtype=np.complex128)
    for n, (place, (values, right, left)) in enumerate(zip(places, found, strict=True)):
        eigenvalues[n, place], shapes[n, place], partners[n, place] = values, right[:, :size], left[:, size:]
    order = np.argsort(np.nanmean(eigenvalues.imag, axis=0)) if count else np.zeros(0, dtype=np.int64)
    return ModeTracks(speeds, eigenvalues[:, order], shapes[:, order], partners[:, order])
