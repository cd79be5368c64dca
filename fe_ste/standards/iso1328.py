"""Flank tolerances of cylindrical gears by their class (ISO 1328-1:2013, 5.3 and annex E)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal, get_args

Deviation = Literal["profile_slope", "profile_form", "helix_slope", "single_pitch", "cumulative_pitch", "runout"]
DEVIATIONS: tuple[Deviation, ...] = get_args(Deviation)
CLASSES = range(1, 12)
"""Flank tolerance classes; 1 is the finest."""
_STEP = math.sqrt(2.0)
"""Ratio of the tolerances of two neighbouring classes."""

# Class 5, micrometres, of reference diameter d, normal module m and face width b in mm.
_CLASS_5: dict[Deviation, Callable[[float, float, float], float]] = {
    "profile_slope": lambda d, m, b: 0.4 * m + 0.001 * d + 4.0,
    "profile_form": lambda d, m, b: 0.55 * m + 5.0,
    "helix_slope": lambda d, m, b: 0.05 * math.sqrt(d) + 0.35 * math.sqrt(b) + 4.0,
    "single_pitch": lambda d, m, b: 0.001 * d + 0.4 * m + 5.0,
    "cumulative_pitch": lambda d, m, b: 0.002 * d + 0.55 * math.sqrt(d) + 0.7 * m + 12.0,
    "runout": lambda d, m, b: 0.9 * (0.002 * d + 0.55 * math.sqrt(d) + 0.7 * m + 12.0),
}


def tolerance(
    deviation: Deviation,
    tolerance_class: int,
    *,
    reference_diameter: float,
    normal_module: float,
    face_width: float,
) -> float:
    """Tolerance of a flank deviation, m; slopes and pitches may lie that far to either side.

    Parameters
    ----------
    deviation : str
        One of `DEVIATIONS`.
    tolerance_class : 1 to 11
    reference_diameter, normal_module, face_width : m

    Raises
    ------
    ValueError
        An unknown deviation or class, or a gear outside the standard.

    Notes
    -----
    The formulas hold for class 5; each class beyond it is wider by the square root of 2. Results above 10 um are
    rounded to whole micrometres, above 5 um to halves, others to tenths.

    Examples
    --------
    >>> round(1e6 * tolerance("helix_slope", 5, reference_diameter=0.1, normal_module=3e-3, face_width=0.03), 1)
    6.5
    """
    if deviation not in DEVIATIONS:
        raise ValueError(f"deviation {deviation!r} is unknown; deviations are {', '.join(DEVIATIONS)}")
    if tolerance_class not in CLASSES:
        raise ValueError(f"class {tolerance_class}: ISO 1328-1 has classes {CLASSES[0]} to {CLASSES[-1]}")
    d = 1e3 * reference_diameter
    m = 1e3 * normal_module
    b = 1e3 * face_width
    for name, value, least, most in (("diameter", d, 5, 15000), ("module", m, 0.5, 70), ("face width", b, 4, 1200)):
        if not least <= value <= most:
            raise ValueError(f"{name} {value:g} mm: ISO 1328-1 goes from {least} to {most} mm")
    return 1e-6 * _rounded(_CLASS_5[deviation](d, m, b) * _STEP ** (tolerance_class - 5))


def _rounded(micrometres: float) -> float:
    """Round as the standard does (5.2.3)."""
    if micrometres > 10.0:
        grain = 1.0
    elif micrometres > 5.0:
        grain = 0.5
    else:
        grain = 0.1
    return math.floor(micrometres / grain + 0.5) * grain
