"""Life of gears under variable load by ISO 6336-6:2006 (Corrigendum 1:2007): S-N curves, Miner's rule, safety."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fe_ste.tools.arrays import Floats

_MOST_FACTOR = 1e6
"""Beyond it a safety factor says that nothing wears."""


@dataclass(frozen=True)
class LifeCurve:
    """Life factor over load cycles, straight between its points in logarithms.

    Below the first point's cycles the factor stays as it is there. Beyond the last point the last slope goes on: no
    stress is without damage.

    Examples
    --------
    >>> round(CASE_HARDENED_CONTACT.factor(1.08e9), 3)
    0.91
    """

    cycles: tuple[float, ...]
    factors: tuple[float, ...]
    """Rising; not rising."""

    def factor(self, cycles: float) -> float:
        """Life factor Z_NT or Y_NT at a number of cycles."""
        x = np.log(self.cycles)
        y = np.log(self.factors)
        at = math.log(max(cycles, self.cycles[0]))
        if at > x[-1]:
            return float(np.exp(y[-1] + (at - x[-1]) * (y[-1] - y[-2]) / (x[-1] - x[-2])))
        return float(np.exp(np.interp(at, x, y)))

    def endured(self, factors: Floats) -> Floats:
        """Cycles that are endured where this life factor is needed; zero above the curve, infinite at zero.

        A level piece at the end endures without end what does not exceed it.
        """
        x = np.log(self.cycles)
        y = np.log(self.factors)
        with np.errstate(divide="ignore"):
            need = np.log(np.asarray(factors, dtype=np.float64))
        slope = (y[-1] - y[-2]) / (x[-1] - x[-2])
        beyond = x[-1] + (need - y[-1]) / slope if slope < 0.0 else np.full(need.shape, np.inf)
        falling = np.append(True, np.diff(y) < 0.0)
        inside = np.interp(-need, -y[falling], x[falling])
        found = np.where(need <= y[-1], beyond, inside)
        with np.errstate(over="ignore"):
            return np.where(need > y[0], 0.0, np.exp(found))


CASE_HARDENED_CONTACT = LifeCurve((1e5, 5e7, 1e10), (1.6, 1.0, 0.85))
"""Z_NT of case-hardened steel without pitting: exponents 13.222469 and 32.60122926 of the corrigendum's clause C.6."""
CASE_HARDENED_BENDING = LifeCurve((1e3, 3e6, 1e10), (2.5, 1.0, 0.85))
"""Y_NT of case-hardened steel: exponents 8.73724908 and 49.91250338 of the corrigendum's clause C.6."""

THROUGH_HARDENED_CONTACT = CASE_HARDENED_CONTACT
"""Z_NT of through-hardened steel without pitting: the same points (ISO 6336-2:2006, table 2)."""
THROUGH_HARDENED_BENDING = LifeCurve((1e4, 3e6, 1e10), (2.5, 1.0, 0.85))
"""Y_NT of through-hardened steel (ISO 6336-3:2006, table 1)."""


def damages(curve: LifeCurve, stress: Floats, strength: Floats | float, cycles: Floats) -> Floats:
    """Cycles over endured cycles of each load; infinite where a stress exceeds the curve.

    Parameters
    ----------
    stress : of each load, Pa
    strength : stress at which the life factor is one, Pa
    cycles : of each load
    """
    endured = curve.endured(np.asarray(stress / np.asarray(strength, dtype=np.float64)))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.asarray(cycles) > 0.0, np.asarray(cycles) / endured, 0.0)


def miner_sum(curve: LifeCurve, stress: Floats, strength: Floats | float, cycles: Floats) -> float:
    """Sum of `damages`."""
    return float(np.sum(damages(curve, stress, strength, cycles)))


def safety_factor(curve: LifeCurve, stress: Floats, strength: Floats | float, cycles: Floats) -> float:
    """Factor on all stresses at which Miner's sum is one; infinite where nothing wears.

    Examples
    --------
    One load, at the stress that its cycles allow:

    >>> curve = CASE_HARDENED_CONTACT
    >>> round(safety_factor(curve, np.array([0.91e9]), 1e9, np.array([1.08e9])), 3)
    1.0
    """
    low = math.log(1.0 / _MOST_FACTOR)
    high = math.log(_MOST_FACTOR)

    def damage(logarithm: float) -> float:
        return miner_sum(curve, np.asarray(stress) * math.exp(logarithm), strength, cycles)

    if damage(high) < 1.0:
        return math.inf
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if damage(middle) < 1.0 else (low, middle)
    return math.exp(0.5 * (low + high))
