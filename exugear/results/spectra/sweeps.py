"""Run-ups as sweeps through resonances: orders cut as finely as their sweep allows, and what does not build up."""

from __future__ import annotations

import math

from exugear.results.spectra.order_cut import OrderCut, order_cut
from exugear.results.spectra.orders import OrderLine
from fe_ste.tools.arrays import Floats

TOO_FAST = 0.3
"""Severity of a sweep above which the peak of a resonance is told as lost: at 0.4 it lacks 8 %, at 20 two thirds."""
FEWEST_SAMPLES = 16
"""Samples of the shortest window."""


def sweep_severity(frequency: float, damping: float, rate: float) -> float:
    """How much faster a sweep is than a resonance builds up: f' / (2 pi zeta^2 f^2).

    Parameters
    ----------
    frequency : of the resonance, Hz
    damping : share of critical damping
    rate : of the sweep, Hz/s

    Examples
    --------
    >>> round(sweep_severity(229.0, 0.0029, 56.0), 1)
    20.2
    """
    return abs(rate) / (2.0 * math.pi * (damping * frequency) ** 2)


def sweep_rate(time: Floats, speed: Floats, order: float) -> float:
    """Mean rate at which an order sweeps in a run, Hz/s; times (s) and speeds (rad/s) of the reference shaft.

    Examples
    --------
    >>> import numpy as np
    >>> round(sweep_rate(np.array([0.0, 2.0]), np.array([0.0, 4.0 * np.pi]), 10.0), 6)
    10.0
    """
    change = abs(abs(float(speed[-1])) - abs(float(speed[0])))
    return order * change / (2.0 * math.pi * float(time[-1] - time[0]))


def run_up_cut(time: Floats, values: Floats, speed: Floats, line: OrderLine) -> OrderCut:
    """Cut an order out of a run-up with the window that suits its sweep, one over the root of its rate in Hz/s.

    Parameters
    ----------
    time, values, speed : (n,) s, evenly sampled; the signal; speed of the reference shaft, rad/s
    """
    rate = (len(time) - 1) / float(time[-1] - time[0])
    sweeps = sweep_rate(time, speed, line.order)
    window = 1.0 / math.sqrt(sweeps) if sweeps > 0.0 else 0.1 * float(time[-1] - time[0])
    window = max(FEWEST_SAMPLES / rate, min(window, 0.2 * float(time[-1] - time[0])))
    # At low speed the window is as long as a period of the order: its mean would leak in.
    return order_cut(values - values.mean(), speed, rate, line, window_length=window)
