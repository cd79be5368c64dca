"""Order cuts: amplitude and phase of one order of a run-up, followed along its speed."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import shorten

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.parts import RPM
from exugear.results.spectra.orders import OrderLine
from exugear.results.spectra.waterfall import overlapping_frames
from fe_ste.tools.arrays import Complexes, Floats
from fe_ste.tools.display import Displayed, TitledRows, value_range


@dataclass(frozen=True)
class OrderCut(Displayed):
    """Amplitude and phase along an order."""

    line: OrderLine
    """The order."""
    time: Floats
    speed: Floats
    frequency: Floats
    """(n,) middle of each window, s; speed there, rad/s; frequency of the order there, Hz."""
    amplitude: Complexes
    """(n,) peak amplitude; its phase is that relative to ``cos(order * angle)``."""

    def _line(self) -> str:
        return f": {shorten(', '.join(f'{name} {value}' for name, value in self._rows.items()), 180)}"

    def _table(self) -> TitledRows:
        return "Order cut", self._rows

    @property
    def _rows(self) -> dict[str, str]:
        return {
            "order": f"{self.line.order:g} ({self.line.name})",
            "windows": str(self.time.size),
            "speed": value_range(self.speed, "rpm", 1.0 / RPM),
            "frequency": value_range(self.frequency, "Hz"),
            "amplitude": value_range(np.abs(self.amplitude), "in the signal's unit"),
        }


def order_cut(
    values: ArrayLike,
    speed: ArrayLike,
    rate: float,
    line: OrderLine,
    *,
    window_length: float,
    overlap: float = 0.75,
    window: str = "hann",
) -> OrderCut:
    """Follow an order along the instantaneous speed.

    The signal is multiplied by ``exp(-i order angle)``, the angle being the integral of the speed, and
    averaged under a window. The order itself is at rest then: its amplitude comes out right however fast it
    sweeps.

    Parameters
    ----------
    values, speed : (n,) signal and speed of the reference shaft (rad/s), uniformly sampled
    rate : sampling rate, Hz
    line : the order to follow
    window_length : s; another order closer than about ``2 / window_length`` in Hz leaks in
    overlap : share of each window that the next repeats, in [0, 1)
    window : name of a SciPy window

    Examples
    --------
    >>> time = np.arange(4000) / 2000.0
    >>> speed = 2 * np.pi * (2.0 + 3.0 * time)  # 2 to 8 turns per second
    >>> angle = 2 * np.pi * (2.0 * time + 1.5 * time**2)
    >>> cut = order_cut(0.5 * np.cos(30 * angle), speed, 2000.0, OrderLine("30", 30.0), window_length=0.1)
    >>> bool(np.all(np.abs(np.abs(cut.amplitude) - 0.5) < 1e-3))
    True
    """
    import scipy.signal  # loads all of scipy.stats, for which others need not wait

    signal = np.asarray(values, dtype=np.float64)
    shaft = np.asarray(speed, dtype=np.float64)
    length = round(window_length * rate)
    step = 0.5 * (np.abs(shaft[1:]) + np.abs(shaft[:-1])) / rate
    angle = np.concatenate([[0.0], np.cumsum(step)])
    turning_back = np.exp(-1j * line.order * angle)
    weights = scipy.signal.get_window(window, length)
    weights *= 2.0 / weights.sum()
    demodulated = signal * turning_back
    mean_speed = np.abs(overlapping_frames(shaft, length, overlap).mean(axis=1))
    return OrderCut(
        line=line,
        time=overlapping_frames(np.arange(signal.size) / rate, length, overlap).mean(axis=1),
        speed=mean_speed,
        frequency=line.frequency(mean_speed),
        amplitude=overlapping_frames(demodulated.real, length, overlap) @ weights
        + 1j * (overlapping_frames(demodulated.imag, length, overlap) @ weights),
    )
