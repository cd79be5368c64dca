"""Orders beside others that a flexible ring gear makes relevant, chosen by what they carry at some speeds.

A line acts on those beside it at multiples of the planet passing frequency. Near a mode of ring and housing that is
lightly damped a dozen of them carry vibration, elsewhere one or two, and most combinations of meshes none. Solutions at
a few speeds with many neighbours show which of them are needed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exugear.steady.crossings import Crossing
from exugear.steady.excitation import HarmonicBalanceModel
from exugear.steady.response import parametric_response
from fe_ste.tools.arrays import Floats

CARRIED = 2e-4
"""Share of the deflections of all meshes that a line has to have at one of the speeds."""
EVEN, AT_CROSSINGS = 3, 8
"""Speeds at which lines are judged: some even ones, and those of the strongest crossings of orders with modes."""


def judged_speeds(low: float, high: float, crossings: Sequence[Crossing]) -> Floats:
    """Return the speeds (rad/s) at which the neighbours of lines are judged, between two speeds."""
    even = np.linspace(low, high, EVEN)
    met = [crossing.speed for crossing in crossings[:AT_CROSSINGS]]
    return np.unique(np.append(even[even != 0.0], met))


def with_needed_neighbours(model: HarmonicBalanceModel, speeds: Floats) -> tuple[HarmonicBalanceModel, float]:
    """Leave out the neighbours of lines that carry hardly any vibration at some speeds (rad/s).

    Returns
    -------
    model : with the lines of the meshes, of passing planets, and the relevant ones beside them
    neglected : norm of the deflections in lines that are left out, over that of all lines, at most
    """
    meshes = len(model.waves.base_orders)
    index = model.lines.index
    beside = index[:, meshes:].any(axis=1) & index[:, :meshes].any(axis=1)
    shares = []
    for speed in map(float, speeds):
        size = np.linalg.norm(parametric_response(model, model.at(speed)).deflection, axis=1)
        shares.append(size / np.linalg.norm(size[1:]))
    kept = ~beside | (np.max(shares, axis=0) > CARRIED)
    neglected = max(float(np.linalg.norm(share[~kept])) for share in shares)
    return model.of(kept), neglected
