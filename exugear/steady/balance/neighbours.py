"""Orders beside others that stiffness varying with the carrier makes relevant, chosen by what they carry.

A line acts on those beside it at multiples of the planet passing frequency. Near a mode of ring and housing that is
lightly damped a dozen of them carry vibration, elsewhere one or two, and most combinations of meshes none. Solutions at
a few speeds with many neighbours show which of them are needed. Each order is held against its own neighbours: those of
an order that hardly deflects the meshes may double an acceleration to which it contributes most.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.balance.response import parametric_response, signals
from exugear.steady.mean_system.mean_system import Steps
from fe_ste.tools.arrays import Complexes, Floats
from fe_ste.tools.processes import each_in_forks

CARRIED = (0.05, 0.035, 0.02, 0.01, 3e-3, 1e-3)
"""Shares of the highest line of its order that a line has to have in some quantity at one of the speeds, tried one
after the other."""
SMALL = 0.1
"""Share of the highest order of a quantity at a speed below which orders are held against this share."""
CHANGED = 0.05
"""Change of an order by the lines left out, over its highest line, with which a choice is good enough.

Of the orders of the GRC with everything flexible, one in a thousand then changes by more than 2 %."""
EVEN, IN_OPERATION, AT_CROSSINGS = 3, 6, 12
"""Speeds at which lines are judged: some even ones of all and of the range of operation, and the strongest crossing
with a mode of so many orders."""
Vibration = list[Complexes]
"""Amplitudes (lines, signals) of the ranked quantities, and deflections and forces of the meshes, at one speed."""


def judged_speeds(
    speeds: Floats, crossings: Iterable[tuple[int, float]], operation: tuple[float, float] | None = None
) -> Floats:
    """Return the speeds (rad/s) at which the neighbours of lines are judged, in the range of some speeds.

    Parameters
    ----------
    speeds : (n,) of the overall input, rad/s, of one sense
    crossings : lines, and speeds at which they meet a mode, the strongest first
    operation : operating speed range, rad/s without sign
    """
    strongest: dict[int, float] = {}
    for line, speed in crossings:
        strongest.setdefault(line, speed)
    low, high = float(speeds.min()), float(speeds.max())
    even = np.linspace(low, high, EVEN)
    if operation is not None:
        within = math.copysign(1.0, low + high) * np.linspace(*operation, IN_OPERATION)
        even = np.append(even, within[(within >= low) & (within <= high)])
    return np.unique(np.append(even[even != 0.0], list(strongest.values())[:AT_CROSSINGS]))


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
    changed : largest change of an order of the meshes in any quantity by what is left out, over its highest line at
        that speed, or over `SMALL` of the highest of all
    """
    index = model.lines.index
    carriers = list({family.carrier for family in model.varying})
    of_meshes = np.delete(index, carriers, axis=1)
    passing = ~of_meshes.any(axis=1)
    beside = model.beside_others & ~(passing & (np.count_nonzero(index[:, carriers], axis=1) < 2))
    orders, order = np.unique(of_meshes, axis=0, return_inverse=True)
    whole = _vibrations(model, speeds, prepared)
    sizes = np.array([[np.linalg.norm(part, axis=1) for part in parts] for parts in whole])
    sizes[..., 0] = 0.0
    highest = np.stack([sizes[..., order == n].max(axis=2) for n in range(len(orders))], axis=2)
    small = SMALL * sizes[..., ~passing].max(axis=2, initial=0.0, keepdims=True)
    against = np.maximum(np.maximum(highest, small), 1e-300)[..., order]
    shares = (sizes / against).max(axis=(0, 1))
    few, changed = model, 0.0
    for carried in CARRIED:
        kept = ~beside | (shares > carried)
        few = model.of(kept)
        counted = ~beside[kept]
        counted[0] = False
        changed = 0.0
        for parts, known, own in zip(_vibrations(few, speeds, prepared), whole, against[..., kept], strict=True):
            for part, exact, size in zip(parts, known, own, strict=True):
                change = np.linalg.norm(part - exact[kept], axis=1) / size
                changed = max(changed, float(change[counted].max(initial=0.0)))
        if changed < CHANGED:
            break
    return few, changed


def _vibrations(model: HarmonicBalanceModel, speeds: Floats, prepared: Steps | None) -> list[Vibration]:
    """Vibration at each of the speeds, rad/s."""
    columns = [np.unique(np.concatenate([own.ravel() for own in one.signals])) for one in model.quantities]

    def vibration(speed: float) -> Vibration:
        """Return the vibration at a speed."""
        response = parametric_response(model, model.at(speed))
        found = signals(model, response)
        return [*(found[:, own] for own in columns), response.deflection, response.force]

    found = []
    for vibrating in each_in_forks(vibration, speeds.tolist()):
        found.append(vibrating)
        if prepared is not None:
            prepared(f"choice of {len(model.lines.index)} orders", len(found), len(speeds))
    return found
