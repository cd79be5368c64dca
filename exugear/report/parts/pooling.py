"""Waterfalls made smaller for a page: levels in bytes, the highest of each cell, so that no peak is lost."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exugear.results.spectra.orders import OrderLine
from exugear.results.spectra.waterfall import Waterfall
from fe_ste.tools.arrays import Floats

NO_LEVEL = -32768
"""What stands in a cut where the order has no level."""


def pooled(level: Floats, speed: Floats, columns: int, lines: int) -> Floats:
    """Highest level in cells of equal speed and of some spectral lines: a peak is widened to its cell, never lost.

    Parameters
    ----------
    level : (n, m) dB
    speed : (n,) rad/s
    columns : cells over the speed
    lines : spectral lines of a cell; what is left over at the top falls away

    Returns
    -------
    (columns, m // lines) where frames are rarer than cells, that of the nearest frame
    """
    count = level.shape[1] // lines * lines
    narrow = level[:, :count:lines].copy()
    for line in range(1, lines):
        np.maximum(narrow, level[:, line:count:lines], out=narrow)
    low = float(speed.min())
    span = max(float(np.ptp(speed)), 1e-12)
    cell = np.minimum(((speed - low) / span * columns).astype(np.int64), columns - 1)
    whole = np.full((columns, narrow.shape[1]), -np.inf)
    order = np.argsort(cell, kind="stable")
    filled, starts = np.unique(cell[order], return_index=True)
    whole[filled] = np.maximum.reduceat(narrow[order], starts, axis=0)
    empty = np.flatnonzero(~np.isfinite(whole[:, 0]))
    middle = low + (empty + 0.5) * span / columns
    whole[empty] = narrow[np.argmin(np.abs(speed[:, None] - middle), axis=0)]
    return whole


def level_bytes(level: Floats, floor: float, step: float) -> NDArray[np.uint8]:
    """Levels (dB) as steps above a floor.

    Examples
    --------
    >>> level_bytes(np.array([-80.0, -60.0, -59.6, 10.0]), -60.0, 0.5).tolist()
    [0, 0, 1, 140]
    """
    steps: NDArray[np.uint8] = np.clip(np.round((level - floor) / step), 0, 255).astype("u1")
    return steps


def cut_levels(spectra: Waterfall, lines: Sequence[OrderLine]) -> NDArray[Any]:
    """Level along each order (frames, lines), tenths of a dB; `NO_LEVEL` where there is none."""
    levels = np.array([spectra.along(line) for line in lines]).reshape(len(lines), spectra.time.size).T
    return tenths(levels)


def tenths(levels: Floats) -> NDArray[Any]:
    """Levels (dB) as tenths of a dB; `NO_LEVEL` where there is none.

    Examples
    --------
    >>> tenths(np.array([-3.21, np.nan])).tolist()
    [-32, -32768]
    """
    return np.where(np.isfinite(levels), np.round(10.0 * levels), NO_LEVEL).astype("i2")
