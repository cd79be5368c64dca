"""Line spectra over speed: the orders of a steady-state response, evaluated like the waterfall of a run-up."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exugear.results.spectra.resonances import Pick
from exugear.results.spectra.waterfall import OrderLine, Waterfall
from fe_ste.tools.arrays import Floats

FRAMES, ROWS = 880, 1536
"""Minimum number of speeds, and number of frequencies, of the picture."""
THICK = 2
"""Rows above and below its own over which an order is drawn; thinner lines disappear on a small screen."""
HALF_POWER = 3.0
"""Drop below a peak at which its width is evaluated, dB."""


@dataclass(frozen=True)
class LineSpectra(Waterfall):
    """Orders at constant speeds, as a waterfall: `amplitude` is the picture, `line_level` the level of each order."""

    orders: Floats
    """(lines,) periods per revolution of the reference shaft."""
    line_level: Floats
    """(n, lines) level at each speed, dB; NaN where no steady state is known."""

    def along(self, line: OrderLine) -> Floats:
        """Level (dB) of an order at each speed, shape (n,); NaN throughout if the order is not included."""
        place = line.place(self.orders)
        if place is None:
            return np.full(self.speed.size, np.nan)
        return self.line_level[:, place]

    def resolution(self, line: OrderLine) -> Floats:
        """Frequency step along an order that results from the spacing of the speeds, Hz, shape (n,)."""
        return np.asarray(np.abs(np.gradient(line.frequency(self.speed))), dtype=np.float64)

    @property
    def description(self) -> str:
        """Type of the spectra and reference amplitude as text, for captions."""
        return f"Orders at constant speeds, 0 dB = {self.reference_text}"


def line_spectra(
    speed: Floats,
    orders: Floats,
    amplitude: Floats,
    highest: float,
    *,
    unknown: Iterable[float] = (),
    reference: float = 1e-6,
    unit: str = "m",
) -> LineSpectra:
    """Line spectra over speed.

    Parameters
    ----------
    speed : (n,) of the reference shaft, rad/s, ascending, three or more
    orders : (lines,) periods per revolution of the reference shaft
    amplitude : (n, lines) peak amplitudes in `unit`
    highest : highest frequency of the picture, Hz
    unknown : speeds without a known state: nothing is drawn between their two neighbours
    reference : amplitude of 0 dB, in `unit`

    Returns
    -------
    LineSpectra
        At the given speeds, and at additional speeds that avoid steps in the picture. Levels are interpolated linearly,
        so that no artificial peaks occur.

    Examples
    --------
    >>> spectra = line_spectra(np.linspace(1, 10, 10), np.array([20.0]), np.full((10, 1), 2e-6), 40.0)
    >>> level = spectra.along(OrderLine("mesh", 20.0))
    >>> round(float(level.min()), 3), round(float(level.max()), 3)
    (6.021, 6.021)
    """
    fine = np.union1d(speed, np.linspace(float(speed[0]), float(speed[-1]), FRAMES))
    known = 20.0 * np.log10(np.maximum(amplitude / reference, 1e-10))
    level = np.array([np.interp(fine, speed, column) for column in known.T]).reshape(-1, fine.size).T
    for place in unknown:
        after = int(np.searchsorted(speed, abs(place)))
        low = speed[after - 1] if after else -np.inf
        high = speed[after] if after < speed.size else np.inf
        level[(fine > low) & (fine < high)] = np.nan
    frequency = np.linspace(0.0, highest, ROWS)
    picture = _picture(fine, orders, reference * 10.0 ** (level / 20.0), frequency)
    time = np.full(fine.size, np.nan)
    return LineSpectra(time, fine, frequency, picture, "none", 0.0, 0.0, reference, unit, orders, level)


def _picture(speed: Floats, orders: Floats, amplitude: Floats, frequency: Floats) -> NDArray[Any]:
    """Amplitudes over speeds and frequencies; each order covers all rows that it crosses between adjacent speeds."""
    middle = 0.5 * (speed[1:] + speed[:-1])
    low = np.append(speed[0], middle)
    high = np.append(middle, speed[-1])
    rows_per_hertz = (frequency.size - 1) / frequency[-1]
    picture: NDArray[Any] = np.zeros((speed.size, frequency.size), dtype=np.float32)
    drawn = np.nan_to_num(amplitude)
    for line, order in enumerate(orders):
        first = np.rint(order * low / (2.0 * np.pi) * rows_per_hertz).astype(np.int64) - THICK
        last = np.rint(order * high / (2.0 * np.pi) * rows_per_hertz).astype(np.int64) + THICK
        for step in range(int((last - first).max()) + 1):
            row = first + step
            at = np.flatnonzero((row <= last) & (row >= 0) & (row < frequency.size))
            picture[at, row[at]] = np.maximum(picture[at, row[at]], drawn[at, line])
    return picture


def line_peaks(spectra: Waterfall, line: OrderLine, prominence: float) -> list[Pick]:
    """Find the peaks of a minimum prominence (dB) along an order at constant speeds.

    The resolution of a peak is half of its half-power bandwidth; closer peaks cannot be separated.
    """
    import scipy.signal  # imported here because it loads all of scipy.stats

    usable = np.flatnonzero(np.isfinite(spectra.along(line)))
    if usable.size < 3:
        return []
    level = spectra.along(line)[usable]
    speed = spectra.speed[usable]
    frequency = line.frequency(speed)
    found, properties = scipy.signal.find_peaks(level, prominence=prominence)
    picks = []
    for peak, height in zip(found, properties["prominences"], strict=True):
        quiet = np.flatnonzero(level < level[peak] - HALF_POWER)
        # A prominent peak has lower levels on both sides.
        left = quiet[quiet < peak][-1]
        right = quiet[quiet > peak][0]
        width = 0.5 * float(frequency[right] - frequency[left])
        picks.append(
            Pick(line, np.nan, float(speed[peak]), float(frequency[peak]), float(level[peak]), float(height), width)
        )
    return picks
