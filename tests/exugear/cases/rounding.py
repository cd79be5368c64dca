"""How far rounding lets signals differ that two routes compute with the same formulas."""

from __future__ import annotations

import numpy as np

PLACE = 1e-15
"""Rounding of places of 1 m, and of angles of some 60 rad on base circles, m."""
STIFFEST = 5e9
"""Of meshes and bearings, N/m."""


def allowed_difference(signals: np.ndarray, meshes: int) -> np.ndarray:
    """Bounds (columns,) of signals (samples, columns): deflections of the meshes, then forces of all sizes.

    A tenth of a billionth of each, and of what cancels in them ten times the rounding: forces are differences of
    places times stiffness, so the small ones are known no better than the large ones.
    """
    rounded = np.where(np.arange(signals.shape[1]) < meshes, PLACE, PLACE * STIFFEST)
    return np.asarray(1e-10 * np.abs(signals).max(axis=0) + 10.0 * rounded)
