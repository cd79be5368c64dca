"""The involute function and its inverse."""

from __future__ import annotations

import math
from typing import overload

import numpy as np

from fe_ste.tools.arrays import Floats


@overload
def involute(angle: float) -> float: ...


@overload
def involute(angle: Floats) -> Floats: ...


def involute(angle: float | Floats) -> float | Floats:
    """Involute function ``tan(angle) - angle`` (ISO 21771), rad.

    Parameters
    ----------
    angle : profile angle, rad

    Returns
    -------
    involute polar angle, rad

    Examples
    --------
    >>> round(involute(math.radians(20.0)), 9)
    0.014904384
    """
    if isinstance(angle, float):
        return math.tan(angle) - angle
    return np.asarray(np.tan(angle) - angle, dtype=np.float64)


def inverse_involute(value: float) -> float:
    """Angle whose involute function is `value`, by Newton's method.

    Parameters
    ----------
    value : involute polar angle, rad, not negative

    Returns
    -------
    profile angle, rad

    Raises
    ------
    ValueError
        If `value` is negative.

    Examples
    --------
    >>> round(math.degrees(inverse_involute(0.014904383867336446)), 9)
    20.0
    """
    if value < 0.0:
        raise ValueError(f"involute of an angle = {value:g} must not be negative")
    if value == 0.0:
        return 0.0
    # inv(angle) >= angle^3 / 3 and tan(angle) <= value + pi/2 bound the root from above; from there Newton's
    # method runs down a convex function without overshoot.
    angle = min(math.cbrt(3.0 * value), math.atan(value + 0.5 * math.pi))
    for _ in range(50):
        step = (involute(angle) - value) / math.tan(angle) ** 2
        angle -= step
        if abs(step) < 1e-15:
            break
    return angle
