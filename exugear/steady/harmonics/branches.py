"""Branches of solutions over a parameter, through their folds: arc-length continuation.

Coefficients of lines y and the parameter p are unknown together; the length along the branch is what advances (Keller
1977). A secant predicts, and Newton's method corrects on the plane across it, with two linear solutions each step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from exugear.steady.harmonics.krylov import HarmonicBalanceError, solve_lines
from fe_ste.tools.arrays import Complexes, Floats

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
    """Whether it goes on to where it was to end; else it has as many points as were allowed."""

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
    most: int = MOST_POINTS,
    solve: Solve | None = None,
    progress: Callable[[float], None] | None = None,
) -> Branch:
    """Follow a branch from one value of the parameter until it passes another, or comes back past the first.

    Parameters
    ----------
    residual : callable
    start : lines near a solution at `first`
    first, last : of the parameter
    step, longest : first and longest step along the branch, in scales
    most : points at most
    solve : callable, optional
        Solution of the linear equations; GMRES as it stands by default.
    progress : called with the parameter of each point

    Raises
    ------
    HarmonicBalanceError
        No solution at `first`, or none near the branch with steps a thousandth of the first.
    """
    solve = solve or _by_gmres
    lines = [_at(residual, solve, start, first, scales)]
    parameters = [first]
    sense = np.sign(last - first)
    length = step
    tangent_lines = np.zeros_like(start)
    tangent_parameter = sense * scales.parameter
    whole = False
    while not whole and len(parameters) < most:
        ahead = lines[-1] + length * tangent_lines, parameters[-1] + length * tangent_parameter
        found = _corrected(residual, solve, ahead, (tangent_lines, tangent_parameter), scales)
        if found is None:
            length *= 0.5
            if length < 1e-3 * step:
                raise HarmonicBalanceError(f"branch: no solution near {parameters[-1]:.6g}; it may end or bend sharply")
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
    return Branch(np.array(parameters), np.array(lines), whole)


def _size(values: Complexes) -> float:
    return float(np.linalg.norm(values.ravel()))


def _by_gmres(change: Callable[[Complexes], Complexes], right: Complexes, tolerance: float) -> Complexes:
    return solve_lines(change, right, tolerance)[0]


def _at(residual: Residual, solve: Solve, lines: Complexes, parameter: float, scales: Scales) -> Complexes:
    """Solution at a parameter by Newton's method."""
    for _ in range(5 * MOST_CORRECTIONS):
        missing, change = residual(lines, parameter)
        if _size(missing) <= SOLVED * scales.lines:
            return lines
        lines = lines + solve(change, -missing, STEP_TOLERANCE)
    raise HarmonicBalanceError(f"branch: no solution at {parameter:.6g}, where it was to begin")


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
