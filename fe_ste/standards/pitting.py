"""Contact stress and permissible contact stress according to ISO 6336-2, method B, editions of 2019 and 2006.

Checked against the first worked example of ISO/TR 6336-30:2017. Case-hardened and through-hardened steels.

The edition of 2019 has the auxiliary factor f_ZCa in Z_B and Z_D of helical gears. Source: F. Mehlan, MADE4WIND
drivetrain optimizer, https://github.com/FelixMehlan/MADE4WIND-drivetrain-optimizer, package `gearopt.safety` (1.2
without flank modification, 1 for rings). The results of a rating program that its tests quote confirm both values.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools.arrays import Floats

_SOFT, _HARD = 850e6, 1200e6
"""Allowable stress numbers, Pa, between which the constants of oil, speed and roughness change."""
UNMODIFIED = 1.2
"""f_ZCa of helical gears without profile and lead modification, ISO 6336-2:2019."""
_REFERENCE_RADIUS = 10e-3
"""Reduced radius of curvature to which roughness is referred, m."""


def tangential_force(gear: Gear, base_force: float) -> float:
    """F_t at the reference circle (N) of a force F_bt on the transverse line of action."""
    return base_force * gear.base_radius / gear.reference_radius


def zone_factor(pair: GearPair) -> float:
    """Z_H: curvature at the pitch point, and from the reference circle to the normal force."""
    angle = pair.working_pressure_angle
    transverse = pair.pinion.transverse_pressure_angle
    lean = math.cos(pair.pinion.base_helix_angle)
    return math.sqrt(2.0 * lean * math.cos(angle) / (math.cos(transverse) ** 2 * math.sin(angle)))


def elasticity_factor(pair: GearPair) -> float:
    """Z_E, the root of Pa: ``1 / sqrt(pi sum (1 - nu^2) / E)``."""
    gears = (pair.pinion, pair.gear)
    give = sum((1.0 - gear.material.poissons_ratio**2) / gear.material.youngs_modulus for gear in gears)
    return math.sqrt(1.0 / (math.pi * give))


def contact_ratio_factor(pair: GearPair) -> float:
    """Z_eps of transverse and overlap ratio."""
    transverse = pair.transverse_contact_ratio
    overlap = pair.overlap_ratio
    if overlap >= 1.0:
        return math.sqrt(1.0 / transverse)
    return math.sqrt((4.0 - transverse) / 3.0 * (1.0 - overlap) + overlap / transverse)


def helix_factor(gear: Gear) -> float:
    """Z_beta = 1 / sqrt(cos beta), as since 2006."""
    return 1.0 / math.sqrt(math.cos(gear.helix_angle))


def single_contact_factors(pair: GearPair, auxiliary_factor: float = 1.0) -> tuple[float, float]:
    """Z_B and Z_D: from the pitch point to the inner points of single contact of gear 1 and gear 2.

    Parameters
    ----------
    auxiliary_factor : f_ZCa of helical gears in the edition of 2019; 1 in the edition of 2006

    Notes
    -----
    For overlap ratios of at least 1, Z_B and Z_D of external gears are the square root of f_ZCa; Z_D of an internal
    gear is 1. For smaller overlap ratios they are interpolated linearly to the value of a spur gear, as in the edition
    of 2006; the source does not cover this range.
    """
    overlap = pair.overlap_ratio
    slope = math.tan(pair.working_pressure_angle)
    helical = math.sqrt(auxiliary_factor)
    if overlap >= 1.0:
        return (helical, 1.0) if pair.gear.internal else (helical, helical)
    one, two = (
        math.sqrt((gear.tip_radius / gear.base_radius) ** 2 - 1.0) * gear.outward for gear in (pair.pinion, pair.gear)
    )
    steps = tuple(2.0 * math.pi / (gear.teeth * gear.outward) for gear in (pair.pinion, pair.gear))
    shared = pair.transverse_contact_ratio - 1.0
    at_one = (one - steps[0]) * (two - shared * steps[1])
    at_two = (two - steps[1]) * (one - shared * steps[0])
    factors = []
    for curvature in (at_one, at_two):
        factor = slope / math.sqrt(abs(curvature))
        factors.append(max(factor - overlap * (factor - helical), 1.0))
    return factors[0], 1.0 if pair.gear.internal else factors[1]


def nominal_contact_stress(pair: GearPair, force: float) -> float:
    """sigma_H0 at the pitch point, Pa.

    Parameters
    ----------
    force : F_t at the reference circle, N
    """
    diameter = 2.0 * pair.pinion.reference_radius
    ratio = pair.gear.teeth / pair.pinion.teeth
    sign = -1.0 if pair.gear.internal else 1.0
    factors = zone_factor(pair) * elasticity_factor(pair) * contact_ratio_factor(pair) * helix_factor(pair.pinion)
    return factors * math.sqrt(force / (diameter * pair.face_width) * (ratio + sign) / ratio)


def lubricant_factor(limit: float, viscosity: float) -> float:
    """Z_L of the softer gear's allowable stress number (Pa) and the oil's viscosity at 40 deg C (mm2/s)."""
    constant = _constant(limit, 0.83, 0.91)
    return constant + 4.0 * (1.0 - constant) / (1.2 + 134.0 / viscosity) ** 2


def velocity_factor(limit: float, velocity: float) -> float:
    """Z_v of the softer gear's allowable stress number (Pa) and the pitch line velocity (m/s)."""
    constant = _constant(limit, 0.83, 0.91) + 0.02
    return constant + 2.0 * (1.0 - constant) / math.sqrt(0.8 + 32.0 / max(velocity, 1e-9))


def roughness_factor(limit: float, roughness: float, radius: float) -> float:
    """Z_R of the softer gear's allowable stress number (Pa), the mean Rz of both gears and the reduced radius (m)."""
    related = 1e6 * roughness * (_REFERENCE_RADIUS / radius) ** (1.0 / 3.0)
    if limit < _SOFT:
        exponent = 0.15
    elif limit > _HARD:
        exponent = 0.08
    else:
        exponent = 0.32 - 0.2e-9 * limit
    return float((3.0 / related) ** exponent)


def reduced_radius(pair: GearPair) -> float:
    """Radius of relative curvature at the pitch point in the transverse section, m."""
    slope = math.tan(pair.working_pressure_angle)
    sign = -1.0 if pair.gear.internal else 1.0
    return slope / (1.0 / pair.pinion.base_radius + sign / pair.gear.base_radius)


def _constant(limit: float, soft: float, hard: float) -> float:
    return soft + (hard - soft) * min(max((limit - _SOFT) / (_HARD - _SOFT), 0.0), 1.0)


# Life of gears under variable load by ISO 6336-6:2006 (Corrigendum 1:2007): S-N curves, Miner's rule, safety

_MOST_FACTOR = 1e6
"""Upper limit of the safety factor; above it, fatigue damage is negligible."""


@dataclass(frozen=True)
class LifeCurve:
    """Life factor as a function of load cycles, linear between its points on logarithmic scales.

    Below the cycles of the first point the factor is constant. Beyond the last point the last slope is extrapolated:
    every stress causes damage.

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
        """Cycles to failure where this life factor is required; zero above the curve, infinite at zero.

        With a horizontal last segment, life is infinite for values that do not exceed it.
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
    """Return the factor on all stresses at which Miner's sum is one; infinite without fatigue damage.

    Examples
    --------
    One load, at the permissible stress for its cycles:

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
