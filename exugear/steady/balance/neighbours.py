"""Orders beside others that stiffness varying with the carrier makes relevant, chosen by what they carry.

A line acts on those beside it at multiples of the planet passing frequency. Near a mode of ring and housing that is
lightly damped a dozen of them carry vibration, elsewhere one or two, and most combinations of meshes none. Solutions at
a few speeds with many neighbours show which of them are needed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.balance.response import parametric_response
from exugear.steady.mean_system.mean_system import Steps
from fe_ste.tools.arrays import Complexes, Floats
from fe_ste.tools.processes import each_in_forks

CARRIED = (1e-4, 3e-5, 1e-5, 3e-6, 1e-6)
"""Shares of the deflections of all meshes that a line has to have at one of the speeds, tried one after the other.

Near a resonance of a damping ratio z what is left out counts by a factor of 1 / 2 z."""
CHANGED = 5e-4
"""Relative change by the lines left out, of all others together, with which a choice is good enough."""
FORCES_CHANGED = 2e-3
"""The same of the forces of the meshes, in which what passing planets do, most of a deflection, hardly counts."""
EVEN, AT_CROSSINGS = 3, 8
"""Speeds at which lines are judged: some even ones, and those of the strongest crossings of orders with modes."""


def judged_speeds(low: float, high: float, crossings: Sequence[float]) -> Floats:
    """Return the speeds (rad/s) at which the neighbours of lines are judged, between two speeds.

    `crossings` are speeds at which orders meet modes, those of the strongest first.
    """
    even = np.linspace(low, high, EVEN)
    return np.unique(np.append(even[even != 0.0], crossings[:AT_CROSSINGS]))


def with_needed_neighbours(
    model: HarmonicBalanceModel, speeds: Floats, prepared: Steps | None = None
) -> tuple[HarmonicBalanceModel, float]:
    """Leave out the neighbours of lines that hardly change the vibration in the other lines at some speeds (rad/s).

    Parameters
    ----------
    prepared : called with the number of speeds that are solved with each choice of lines

    Returns
    -------
    model : with the lines of the meshes, of passing planets, and the relevant ones beside them
    changed : largest relative change of overall transmission error and deflections of the meshes by what is left out
    """
    carriers = list({family.carrier for family in model.varying})
    passing = ~np.delete(model.lines.index, carriers, axis=1).any(axis=1)
    passing &= np.count_nonzero(model.lines.index[:, carriers], axis=1) < 2
    beside = model.beside_others & ~passing
    whole = _vibrations(model, speeds, prepared)
    carry = np.array([np.linalg.norm(motion[:, 1:], axis=1) for motion, _ in whole])
    push = np.array([np.linalg.norm(forces, axis=1) for _, forces in whole])
    shares, pushing = (own.T / np.linalg.norm(own[:, 1:], axis=1) for own in (carry, push))
    # Of forces, as much more may be left out as they may change more.
    shares = np.maximum(shares, CHANGED / FORCES_CHANGED * pushing).max(axis=1)
    few, changed = model, 0.0
    for carried in CARRIED:
        kept = ~beside | (shares > carried)
        few = model.of(kept)
        chosen = _vibrations(few, speeds, prepared)
        pairs = list(zip(chosen, whole, strict=True))
        parts = (slice(0, 1), slice(1, None))
        changed = max(_change(found[:, part], known[kept, part]) for (found, _), (known, _) in pairs for part in parts)
        of_forces = max(_change(found, known[kept]) for (_, found), (_, known) in pairs)
        if changed < CHANGED and of_forces < FORCES_CHANGED:
            break
    return few, changed


def _vibrations(
    model: HarmonicBalanceModel, speeds: Floats, prepared: Steps | None
) -> list[tuple[Complexes, Complexes]]:
    """Vibration at each of the speeds, rad/s."""

    def vibration(speed: float) -> tuple[Complexes, Complexes]:
        """Overall transmission error and deflections of the meshes (n, 1 + m), m; their forces (n, m), N."""
        response = parametric_response(model, model.at(speed))
        overall = response.motion @ model.row_of_overall(speed)
        return np.column_stack([overall, response.deflection]), response.force

    found = []
    for vibrating in each_in_forks(vibration, speeds.tolist()):
        found.append(vibrating)
        if prepared is not None:
            prepared(f"choice of {len(model.lines.index)} orders", len(found), len(speeds))
    return found


def _change(found: Complexes, known: Complexes) -> float:
    """Change of a vibration (n, k) in all lines but the mean, over its size."""
    return float(np.linalg.norm((found - known)[1:]) / np.linalg.norm(known[1:]))
