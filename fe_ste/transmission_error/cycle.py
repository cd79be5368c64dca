"""Curves over the mesh cycle: their harmonics, number of positions, and the error of the peak-to-peak value from it."""

from __future__ import annotations

import numpy as np

from fe_ste.tools.arrays import Floats

DEFAULT_POSITIONS = 50
"""Positions of the mesh cycle unless stated: in eight of the nine pairs of docs/validation/te_accuracy.md, the
peak-to-peak transmission error is within 1.4 % of that of 200 positions."""
HARMONICS = 4
"""Harmonics that are listed."""


def harmonics_of(curve: Floats, count: int = HARMONICS) -> Floats:
    """Return the amplitudes of the harmonics of a curve that is evenly sampled over one cycle.

    Examples
    --------
    >>> angle = 2.0 * np.pi * np.arange(16) / 16
    >>> harmonics_of(1.0 + 3.0 * np.cos(angle) - 0.5 * np.sin(2.0 * angle), 3).round(9).tolist()
    [3.0, 0.5, 0.0]
    """
    amplitudes = 2.0 * np.abs(np.fft.rfft(curve)) / curve.size
    if curve.size % 2 == 0:
        amplitudes[-1] *= 0.5
    harmonics = np.zeros(count)
    known = amplitudes[1 : count + 1]
    harmonics[: known.size] = known
    return harmonics


def peak_to_peak_error(curve: Floats) -> float:
    """Estimate how far the peak-to-peak value of a curve (n,) is off because of its number of positions.

    Each half of the positions, every second one, is a curve of its own. Its peak-to-peak value is too small by what the
    positions between add. With all of them the same is expected at most.

    Examples
    --------
    >>> peak_to_peak_error(np.cos(2.0 * np.pi * np.arange(8) / 8))
    0.58...
    """
    whole = np.ptp(curve)
    return float(whole - min(np.ptp(curve[::2]), np.ptp(curve[1::2])))
