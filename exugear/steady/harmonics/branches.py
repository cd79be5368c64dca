"""Continuation of solutions over a parameter, through turning points: their stability, and peaks of curves.

Coefficients of orders y and the parameter p are unknown together; the arc length along the branch is advanced (Keller
1977). A secant predicts, and Newton's method corrects on the plane across it, with two linear solutions each step.

    x' = A x - sum_j b_j s_j(t) c_j x,  the varying parts of low rank

Between instants the constant part acts exactly, by its exponential; the varying part acts in kicks at the instants
(Strang's splitting, an error of second order in the step).

Near a resonance every signal is a ratio of polynomials of the frequency. A ratio of second degree through five
neighbouring values has two poles, enough for a resonance and its neighbour, and locates the maximum between them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg

from exugear.steady.harmonics.linear_solvers import HarmonicBalanceError, solve_lines
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers
from fe_ste.tools.compilation import compiled

Residual = Callable[[Complexes, float], tuple[Complexes, Any]]
"""Residual of lines at a parameter, and how it follows small changes of them: a map, or what `Solve` knows to solve."""
Solve = Callable[[Any, Complexes, float], Complexes]
"""Small change of the lines for a change of the residual, to an error over the size of the latter."""
SOLVED = 1e-9
"""Residual over the scale of the lines that counts as solved."""
STEP_TOLERANCE = 1e-4
"""Residual of a Newton step's linear equations over its right-hand side."""
MOST_CORRECTIONS = 8
GOOD_CORRECTIONS = 4
"""Corrections up to which the next step is longer."""
MOST_POINTS = 2000
DIFFERENCE = 1e-5
"""Step of the derivative by the parameter, over the scale of the latter."""


@dataclass(frozen=True)
class Scales:
    """What counts as one along a branch."""

    lines: float
    parameter: float
    """Size of a change of the lines, and of the parameter."""


@dataclass(frozen=True)
class Branch:
    """Points along a branch; n of them."""

    parameter: Floats
    """(n,)"""
    lines: Complexes
    """(n, ...)"""
    whole: bool = True
    """Whether the branch reached its end value; else it stopped at the maximum number of points, or is lost."""
    lost: bool = False
    """Whether no solution was found near its last point with steps a thousandth of the first."""

    @property
    def folds(self) -> tuple[tuple[int, float], ...]:
        """Points after which the parameter turns back, and its value at the fold, from a parabola through three."""
        p = self.parameter
        found = []
        for n in range(1, len(p) - 1):
            if (p[n] - p[n - 1]) * (p[n + 1] - p[n]) < 0.0:
                chords = [float(np.linalg.norm((self.lines[n + k] - self.lines[n + k - 1]).ravel())) for k in (0, 1)]
                s = np.array([-chords[0], 0.0, chords[1]])
                a, b, c = np.polyfit(s, p[n - 1 : n + 2], 2)
                found.append((n, float(c - b * b / (4.0 * a))))
        return tuple(found)


def trace(
    residual: Residual,
    start: Complexes,
    first: float,
    last: float,
    scales: Scales,
    *,
    step: float,
    longest: float,
    solve: Solve | None = None,
    progress: Callable[[float], None] | None = None,
) -> Branch:
    """Follow a branch from one value of the parameter until it passes another, or comes back past the first.

    Parameters
    ----------
    residual : callable
    start : orders near a solution at `first`
    first, last : of the parameter
    step, longest : first and longest step along the branch, in scales
    solve : callable, optional
        Solution of the linear equations; GMRES by default.
    progress : called with the parameter of each point

    Raises
    ------
    HarmonicBalanceError
        No solution at `first`, or none beyond it.
    """
    solve = solve or (lambda change, right, tolerance: solve_lines(change, right, tolerance)[0])
    lines = [_solution_at(residual, solve, start, first, scales)]
    parameters = [first]
    sense = np.sign(last - first)
    length = step
    tangent_lines = np.zeros_like(start)
    tangent_parameter = sense * scales.parameter
    whole = lost = False
    while not (whole or lost) and len(parameters) < MOST_POINTS:
        ahead = lines[-1] + length * tangent_lines, parameters[-1] + length * tangent_parameter
        found = _corrected(residual, solve, ahead, (tangent_lines, tangent_parameter), scales)
        if found is None:
            length *= 0.5
            lost = length < 1e-3 * step
            if lost and len(parameters) == 1:
                raise HarmonicBalanceError(f"continuation: no solution beyond the start {first:.6g}")
            continue
        y, p, corrections = found
        size = np.hypot(_size(y - lines[-1]) / scales.lines, (p - parameters[-1]) / scales.parameter)
        tangent_lines = (y - lines[-1]) / size
        tangent_parameter = (p - parameters[-1]) / size
        lines.append(y)
        parameters.append(p)
        if progress is not None:
            progress(p)
        whole = bool((p - last) * sense >= 0.0 or (p - first) * sense < 0.0)
        length = min(longest, 1.5 * length) if corrections <= GOOD_CORRECTIONS else 0.7 * length
    return Branch(np.array(parameters), np.array(lines), whole, lost)


def _size(values: Complexes) -> float:
    return float(np.linalg.norm(values.ravel()))


def _solution_at(residual: Residual, solve: Solve, lines: Complexes, parameter: float, scales: Scales) -> Complexes:
    """Solution at a parameter by Newton's method."""
    for _ in range(5 * MOST_CORRECTIONS):
        missing, change = residual(lines, parameter)
        if _size(missing) <= SOLVED * scales.lines:
            return lines
        lines = lines + solve(change, -missing, STEP_TOLERANCE)
    raise HarmonicBalanceError(f"continuation: no solution at the start {parameter:.6g}")


def _corrected(
    residual: Residual, solve: Solve, ahead: tuple[Complexes, float], tangent: tuple[Complexes, float], scales: Scales
) -> tuple[Complexes, float, int] | None:
    """Solution on the plane through a predicted point across the tangent, None where there is none near."""
    y, p = ahead
    along = tangent[0] / scales.lines**2
    by_parameter = tangent[1] / scales.parameter**2
    before = np.inf
    for corrections in range(MOST_CORRECTIONS + 1):
        missing, change = residual(y, p)
        error = _size(missing)
        if error <= SOLVED * scales.lines:
            return y, p, corrections
        if not error < 10.0 * before:
            return None
        before = error
        small = DIFFERENCE * scales.parameter
        slope = (residual(y, p + small)[0] - missing) / small
        try:
            step, turn = (solve(change, right, STEP_TOLERANCE) for right in (-missing, -slope))
        except HarmonicBalanceError:
            return None
        off = float(np.real(np.vdot(along, ahead[0] - y))) + by_parameter * (ahead[1] - p)
        dp = (off - float(np.real(np.vdot(along, step)))) / (float(np.real(np.vdot(along, turn))) + by_parameter)
        y = y + step + dp * turn
        p = p + dp
    return None


# Stability of linear systems with periodic stiffness: Floquet multipliers over one period

PER_FASTEST = 6.0
"""Kicks per period of the fastest mode: with fewer of them the splitting itself resonates."""
TOGETHER = 24
"""Kicks that are passed at once."""


def kicks_needed(fastest: float, period: float) -> int:
    """Kicks over a period (s) in which modes up to a frequency (Hz) keep their stability.

    Examples
    --------
    >>> kicks_needed(1000.0, 0.01)
    60
    """
    return int(np.ceil(PER_FASTEST * fastest * period))


def exponents(
    constant: Floats, pushes: Floats, reads: Floats, varying: Floats, period: float
) -> tuple[Complexes, Complexes]:
    """Floquet exponents (n,) of a system, 1/s, the fastest growing first, and the shapes (n, n) that grow, by columns.

    Parameters
    ----------
    constant : (n, n) A, 1/s
    pushes : (n, j) columns b
    reads : (j, n) rows c
    varying : (kicks, j, j) what multiplies the readings, at even instants of the period
    period : s

    Examples
    --------
    A constant part that decays, and nothing that varies:

    >>> exponents(-np.eye(1), np.ones((1, 1)), np.ones((1, 1)), np.zeros((4, 1, 1)), 2.0)[0].real.round(12)
    array([-1.])
    """
    kicks = len(varying)
    step = period / kicks
    advance = scipy.linalg.expm(step * constant)
    total = np.eye(len(constant))
    for first in range(0, kicks, TOGETHER):
        total = _apply_kicks(total, advance, pushes, reads, step * varying[first : first + TOGETHER])
    multipliers, shapes = scipy.linalg.eig(total)
    found = np.log(np.where(multipliers == 0.0, 1e-300, multipliers)) / period
    order = np.argsort(-found.real)
    return np.asarray(found[order], dtype=complex), np.asarray(shapes[:, order], dtype=complex)


def _apply_kicks(state: Floats, advance: Floats, pushes: Floats, reads: Floats, kicks: Floats) -> Floats:
    """Find states (n, n) after some kicks (k, j, r), each followed by a step of the constant part (n, n).

    Readings at each kick are those without kicks, less what the kicks before it changed in them: products with the
    whole matrix are needed once for all of them.
    """
    count = len(kicks)
    if not pushes.shape[1] or not len(reads):  # nothing varies: the constant part acts alone
        return np.asarray(np.linalg.matrix_power(advance, count) @ state)
    rows = [reads]
    columns = [advance @ pushes]
    for _ in range(count - 1):
        rows.append(rows[-1] @ advance)
        columns.append(advance @ columns[-1])
    readings = (np.concatenate(rows) @ state).reshape(count, len(reads), -1)
    felt = np.concatenate([reads @ column for column in columns])
    given = np.empty((count, pushes.shape[1], state.shape[1]))
    for n, kick in enumerate(kicks):
        given[n] = kick @ readings[n]
        later = count - 1 - n
        changed = felt[: later * len(reads)] @ given[n]
        readings[n + 1 :] -= changed.reshape(later, *readings.shape[1:])
    moved: Floats = np.linalg.matrix_power(advance, count) @ state
    moved -= np.concatenate(columns[::-1], axis=1) @ given.reshape(-1, state.shape[1])
    return moved


# Peaks of complex curves known at few values of a parameter

STANDS = 0.01
"""Prominence, as a share of a peak's height, above the lowest values on both sides up to the next higher peak."""
NEIGHBOURS = 5
"""Values that a curve of two poles goes through."""
SUPPORT, OTHERS = [0, 2, 4], [1, 3]
"""Which of them carry the curve, and which the weights follow from."""
LOOKED_AT, CLOSER = 64, 3
"""Number of points at which a curve is evaluated between its neighbours, and of refinements around the highest one."""
NODE_DISTANCE = 1e-12
"""Share of the neighbours' distance from a place that carries the curve, where its form is 0 / 0."""


def standing_peaks(values: Floats, stands: float = STANDS) -> Integers:
    """Return indices of local maxima of values (n,) that are prominent on both sides, in ascending order.

    End points are excluded: the maximum of a curve that rises up to an end lies elsewhere.

    Examples
    --------
    >>> standing_peaks(np.array([0.0, 2.0, 1.0, 1.001, 1.0, 3.0, 2.9]))
    array([1, 5])
    """
    found = np.empty(len(values), dtype=np.int64)
    count = find_standing(np.ascontiguousarray(values, dtype=np.float64), stands, found)
    return found[:count]


def beside_jumps(kinds: Booleans) -> Booleans:
    """Return which points (n,) follow or precede one of another kind, where a curve over them jumps.

    Examples
    --------
    >>> beside_jumps(np.array([True, True, False, False, False])).tolist()
    [False, True, True, False, False]
    """
    changes = kinds[1:] != kinds[:-1]
    return np.asarray(np.append(changes, False) | np.append(False, changes))


def peaks_of_lines(sizes: Floats, stands: float = STANDS) -> list[tuple[int, int]]:
    """Return point and line of the `standing_peaks` of all amplitudes (points, lines), line by line."""
    return [(int(point), line) for line, own in enumerate(sizes.T) for point in standing_peaks(own, stands)]


@compiled
def find_standing(values: Floats, stands: float, found: Integers) -> int:
    """Fill the places of `standing_peaks` and count them; of equal highest values that of the middle one."""
    count = 0
    last = values.size - 1
    first = 1
    while first < last:
        end = first
        while end < last and values[end + 1] == values[first]:
            end += 1
        if end < last and values[first - 1] < values[first] and values[end + 1] < values[first]:
            peak = values[first]
            before = after = peak
            at = first - 1
            while at >= 0 and values[at] <= peak:
                before = min(before, values[at])
                at = at - 1
            at = end + 1
            while at <= last and values[at] <= peak:
                after = min(after, values[at])
                at = at + 1
            if peak - max(before, after) >= stands * peak:
                found[count] = (first + end) // 2
                count += 1
        first = end + 1
    return count


def predicted_tops(
    places: Floats, values: Complexes, highest: int, size: Callable[[Complexes], Floats], damping: float = 0.0
) -> tuple[Floats, Floats]:
    """Places and heights (k,) of the tops near the highest of some values of k curves, by curves through neighbours.

    Parameters
    ----------
    places : (k, n) ascending, five or more
    values : (k, n, signals) all signals of a curve have the same poles
    highest : which place is the highest, neither the first nor the last
    size : returns the heights (...) of values (..., signals)
    damping : lowest damping ratio, a share of a place
        Curves with a pole closer to the real axis between the two neighbours of the highest value are left out: such a
        pole is not one of the system.

    Notes
    -----
    The barycentric form of a rational function: with weights w in the null space of the Loewner matrix
    (f(x_j) - f(s_i)) / (x_j - s_i), it goes through the values of a single signal at all five places, and through
    those of several as nearly as common poles can (Antoulas & Anderson 1986).

    Examples
    --------
    One resonance, whose top lies between two places:

    >>> x = np.array([[0.9, 0.95, 0.99, 1.02, 1.06]])
    >>> values = 0.02 / (1.0 - x**2 + 0.02j * x)
    >>> place, height = predicted_tops(x, values[..., None], 2, lambda own: np.abs(own[..., 0]))
    >>> print(round(float(place[0]), 4), round(float(height[0]), 4))
    0.9999 1.0001
    """
    found = [(places[:, highest], size(values)[:, highest])]
    # Where curves through other neighbours differ, the highest is to be looked at.
    for first in range(max(highest - 3, 0), min(highest, places.shape[1] - NEIGHBOURS + 1)):
        found.append(_tops(places, values, highest, first, size, damping))
    tops, heights = np.swapaxes(found, 0, 1)
    which = heights.argmax(axis=0)
    return np.choose(which, tops), heights.max(axis=0)


def _tops(
    places: Floats, values: Complexes, highest: int, first: int, size: Callable[[Complexes], Floats], damping: float
) -> tuple[Floats, Floats]:
    """Places and heights (k,) of the tops near a place by the curves through five places from one on."""
    middle = places[:, highest]
    width = places[:, highest + 1] - places[:, highest - 1]
    scaled = (places - middle[:, None]) / width[:, None]
    x = scaled[:, first : first + NEIGHBOURS]
    f = values[:, first : first + NEIGHBOURS]
    carrying = x[:, SUPPORT]
    apart = x[:, OTHERS, None] - carrying[:, None, :]
    divided = (f[:, OTHERS, None] - f[:, None, SUPPORT]) / apart[..., None]
    loewner = np.swapaxes(divided, 2, 3).reshape(len(x), -1, len(SUPPORT))
    weights = np.linalg.svd(loewner)[2][:, -1].conj()
    low, high = scaled[:, highest - 1], scaled[:, highest + 1]
    top = np.zeros(len(x))
    known = height = size(values)[:, highest]
    undamped = _is_undamped(carrying, weights, low, high, damping * np.abs(middle) / width)
    for _ in range(CLOSER):
        step = (high - low) / LOOKED_AT
        at = np.linspace(low, high, LOOKED_AT, axis=-1)
        beside = at[..., None] - carrying[:, None, :]
        parts = weights[:, None, :] / np.where(beside == 0.0, NODE_DISTANCE, beside)
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.nan_to_num(size((parts @ f[:, SUPPORT]) / parts.sum(axis=2)[..., None]), posinf=0.0)  # at a pole
        best = found.argmax(axis=1)[:, None]
        risen = np.take_along_axis(found, best, axis=1)[:, 0] > height
        top = np.where(risen, np.take_along_axis(at, best, axis=1)[:, 0], top)
        height = np.fmax(height, found.max(axis=1))
        # A curve that rises no more is not looked at more closely.
        low = np.where(risen, np.maximum(low, top - step), low)
        high = np.where(risen, np.minimum(high, top + step), high)
    return middle + np.where(undamped, 0.0, top) * width, np.where(undamped, known, height)


def _is_undamped(nodes: Floats, weights: Complexes, low: Floats, high: Floats, least: Floats) -> Booleans:
    """Return which curves (k,) have a pole between two places that is closer to the real axis than a distance.

    The poles are the zeros of sum w_i / (x - s_i), of a quadratic polynomial with three nodes s (k, 3).

    Examples
    --------
    Poles at 0.5 +- 0.2i; the weights are those of their polynomial, w_i = q(s_i) / product (s_i - s_j):

    >>> s = np.array([[0.0, 1.0, 2.0]])
    >>> weights = ((s - 0.5) ** 2 + 0.2**2) / np.array([2.0, -1.0, 2.0])
    >>> [bool(_is_undamped(s, weights, 0.0, 1.0, np.array([least]))[0]) for least in (0.19, 0.21)]
    [False, True]
    """
    one, two, three = nodes.T
    first, second, third = weights.T
    a = first + second + third
    b = -(first * (two + three) + second * (one + three) + third * (one + two))
    c = first * two * three + second * one * three + third * one * two
    root = np.sqrt((b**2 - 4.0 * a * c).astype(np.complex128))
    # One zero by the sum without cancellation, the other by their product c / a.
    half = -0.5 * (b + np.where((b.conj() * root).real >= 0.0, root, -root))
    with np.errstate(divide="ignore", invalid="ignore"):
        poles = np.array([half / a, c / half])
    found = (poles.real >= low) & (poles.real <= high) & (np.abs(poles.imag) < least)
    return np.asarray(found.any(axis=0))
