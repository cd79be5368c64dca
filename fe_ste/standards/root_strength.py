"""What a tooth root withstands beside its material, by ISO 6336-3:2006 method B: Y_delta_rel_T, Y_R_rel_T and Y_X."""

from __future__ import annotations

import math

from fe_ste.standards.load_factors import Hardening

_TEST_NOTCH = 2.5
"""q_s of the test gears."""
_SLIP_LAYER: dict[Hardening, tuple[float, ...]] = {
    "case_hardened": (0.0030e-3,),
    "through_hardened": (0.0281e-3, 0.0014e-3),
}
"""rho', m; of through-hardened steels at yield points of 500 and 1000 MPa, of which the less favourable counts."""
_SIZE: dict[Hardening, tuple[float, float, float, float]] = {
    "case_hardened": (1.05, 0.01, 25.0, 0.80),
    "through_hardened": (1.03, 0.006, 30.0, 0.85),
}
"""Y_X falls from 1 at a module of 5 mm by a straight line (its beginning and slope) to the last value."""


def notch_factor(notch: float, hardening: Hardening) -> float:
    """Y_delta_rel_T of the notch parameter q_s, for the fatigue limit.

    Examples
    --------
    >>> [round(notch_factor(q, "case_hardened"), 3) for q in (2.620, 3.036)]
    [1.001, 1.005]
    """
    found = []
    for layer in _SLIP_LAYER[hardening]:
        own, test = (math.sqrt(1e3 * layer * 0.2 * (1.0 + 2.0 * q)) for q in (notch, _TEST_NOTCH))
        found.append((1.0 + own) / (1.0 + test))
    return min(found)


def surface_factor(roughness: float) -> float:
    """Y_R_rel_T of the root's Rz (m), case-hardened and through-hardened steels up to 40 um.

    Examples
    --------
    >>> round(surface_factor(20e-6), 3), surface_factor(0.5e-6)
    (0.957, 1.12)
    """
    height = 1e6 * roughness
    if height < 1.0:
        return 1.12
    factor: float = 1.674 - 0.529 * (height + 1.0) ** 0.1
    return factor


def size_factor(normal_module: float, hardening: Hardening) -> float:
    """Y_X of the normal module (m), for the fatigue limit.

    Examples
    --------
    >>> size_factor(14e-3, "case_hardened"), round(size_factor(21e-3, "through_hardened"), 3)
    (0.91, 0.904)
    """
    start, slope, large, least = _SIZE[hardening]
    module = 1e3 * normal_module
    if module <= 5.0:
        return 1.0
    if module >= large:
        return least
    return round(start - slope * module, 12)
