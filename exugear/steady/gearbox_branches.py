"""Branches of steady states over speed, through their folds, with the stability of every point."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from exugear.gearbox.parts import RPM
from exugear.steady.harmonics.branches import Branch, Scales, trace
from exugear.steady.mean_system.mesh_ports import DEFLECTION
from exugear.steady.mean_system.rotating_frame import SteadyError
from exugear.steady.nonlinear import Balance, Tangent
from exugear.steady.point_solver import PointSolver
from exugear.steady.stability import growth_of_state
from fe_ste.tools.arrays import Booleans, Complexes, Floats
from fe_ste.tools.display import Displayed

LONGEST = 0.4
"""Longest step along a branch: in tenths of the static deflections, and in hundredths of the speed."""


@dataclass(frozen=True, eq=False)
class SteadyBranch(Displayed):
    """Steady states along a branch; n points."""

    speed: Floats
    """(n,) of the overall input, rad/s."""
    readings: Complexes
    """(n, lines, m, r) what the mesh laws read."""
    growth: Floats
    """(n,) fastest growth of a disturbance, 1/s, over the bases looked at one at a time."""
    folds: tuple[float, ...]
    """Speeds at which the branch turns back, rad/s."""
    ended: str = ""
    """Why it ends before the last speed, and where; empty if it does not."""

    def _line(self) -> str:
        folds = ", ".join(f"{speed:.5g}" for speed in self.folds) or "none"
        return f": {len(self.speed)} points, {self.speed.min():.4g} to {self.speed.max():.4g} rad/s, folds at {folds}"

    @property
    def stable(self) -> Booleans:
        """Whether disturbances decay, (n,)."""
        return np.asarray(self.growth < 0.0)


def follow_branch(
    solver: PointSolver, first: float, last: float, progress: Callable[[float], None] | None = None
) -> SteadyBranch:
    """Follow the steady states from one speed of the input to another (rad/s), folds included.

    Parameters
    ----------
    solver : of the level `nonlinear`
    first, last : rad/s, of one sense
    progress : called with the speed of each point

    Raises
    ------
    HarmonicBalanceError
        No steady state was found at the first speed, or the branch was lost.
    SteadyError
        Planets mesh out of phase.
    """
    gearset = solver.branch_gearset
    if gearset.waves.carriers:
        raise SteadyError(
            f"branches: planets of {gearset.waves.carriers[0][0]} mesh out of phase, so that the carrier's angle is a "
            "cause beside the mesh cycle, whose stability is not looked at; leave branches out"
        )

    def balance_at(speed: float) -> Balance:
        return Balance(gearset, gearset.at(speed), gearset.lattice)

    # The unknowns are lengths: a mesh cycle and a radian count as a base pitch.
    lengths = gearset.lengths

    def residual(scaled: Complexes, speed: float) -> tuple[Complexes, Tangent]:
        balance = balance_at(speed)
        readings = scaled / lengths
        excess, tangent, _ = balance.forces(readings)
        return lengths * (readings - balance.static - balance.answer(excess)), tangent

    def solve(tangent: Tangent, right: Complexes, tolerance: float) -> Complexes:
        return lengths * tangent.solved(right / lengths, tolerance)[0]

    start = solver.readings(first)
    size = float(np.linalg.norm(start[0, :, DEFLECTION]))
    scales = Scales(0.1 * size, 0.01 * abs(first))
    found = trace(
        residual,
        lengths * start,
        first,
        last,
        scales,
        step=0.1 * LONGEST,
        longest=LONGEST,
        solve=solve,
        progress=progress,
    )
    readings = found.lines / lengths
    growth = [
        growth_of_state(balance_at(float(speed)), reading, gearset.bent)
        for speed, reading in zip(found.parameter, readings, strict=True)
    ]
    ended = "" if found.whole else _ended(found, last)
    return SteadyBranch(found.parameter, readings, np.array(growth), tuple(fold for _, fold in found.folds), ended)


def _ended(branch: Branch, last: float) -> str:
    """Say where a branch ended that has as many points as are allowed, and what it did there."""
    p = branch.parameter
    turns = [n for n, _ in branch.folds]
    lately = sum(n > len(p) // 2 for n in turns)
    return (
        f"the branch ends at {p[-1] / RPM:.5g} rpm after {len(p)} points, before {last / RPM:.5g} rpm: its steps are "
        f"short where teeth graze, and it turned back {len(turns)} times, {lately} of them in its second half; ask for "
        "the speeds from there on, or leave --branches out"
    )
