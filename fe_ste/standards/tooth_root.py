"""Nominal tooth root stress by ISO 6336-3:2006 method B, for comparison with the finite elements.

External gears without protuberance and undercut, thinning of teeth left out; internal ones are left to the finite
elements. Lengths in the formulas
are in normal modules of the virtual spur gear in the normal section.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.geometry.involute import involute
from fe_ste.tools.arrays import Floats

_ROOT_ANGLE = math.pi / 3.0
"""60 deg: the tangents at the critical section lean by 30 deg from the middle of an external tooth."""
_NEWTON_STEPS = 50
_LARGEST_HELIX = math.radians(30.0)
"""Above it the helix factor stays."""


@dataclass(frozen=True)
class RootStressFactors:
    """Factors of the nominal root stress ``sigma_F0 = F_t / (b m_n) Y_F Y_S Y_beta``.

    Attributes
    ----------
    form, stress_correction, helix : float
        Y_F and Y_S with the load at the outer point of single contact, Y_beta.
    outside_validity : tuple of str
        Why the value is an extrapolation.
    """

    form: float
    stress_correction: float
    helix: float
    outside_validity: tuple[str, ...]

    @property
    def product(self) -> float:
        """Y_F Y_S Y_beta."""
        return self.form * self.stress_correction * self.helix


def root_stress_factors(pair: GearPair, member: int) -> RootStressFactors:
    """Form, stress correction and helix factor of a gear in its pair, ISO 6336-3:2006, method B.

    Parameters
    ----------
    pair : GearPair
    member : {0, 1}
        Gear 1 or gear 2, an external one.

    Raises
    ------
    ValueError
        The gear is internal.
    """
    gear = (pair.pinion, pair.gear)[member]
    if gear.internal:
        raise ValueError(f"gear {gear.name}: the root stress of internal gears is that of the finite elements alone")
    virtual = gear.teeth / (math.cos(gear.base_helix_angle) ** 2 * math.cos(gear.helix_angle))
    contact_ratio = pair.transverse_contact_ratio / math.cos(gear.base_helix_angle) ** 2
    tip = virtual + 2.0 * (gear.tip_radius - gear.reference_radius) / gear.normal_module
    base = virtual * math.cos(gear.normal_pressure_angle)
    # Diameter at the outer point of single contact: from the tip back along the path by what is shared.
    shared = math.pi * math.cos(gear.normal_pressure_angle) * (contact_ratio - 1.0)
    loaded = 2.0 * math.hypot(0.5 * math.sqrt(tip**2 - base**2) - shared, 0.5 * base)
    form, correction, notch = form_and_correction(gear, virtual, loaded)
    overlap = pair.overlap_ratio
    helix = 1.0 - min(overlap, 1.0) * min(abs(gear.helix_angle), _LARGEST_HELIX) / math.radians(120.0)
    remarks = {
        f"notch parameter q_s = {notch:.2f} is outside 1 to 8": not 1.0 <= notch <= 8.0,
        f"virtual contact ratio {contact_ratio:.2f} is not below 2": contact_ratio >= 2.0,
    }
    return RootStressFactors(form, correction, helix, tuple(text for text, applies in remarks.items() if applies))


def root_face_load_factor(face_load: Floats, pair: GearPair) -> Floats:
    """K_Fbeta of K_Hbeta, by the face width over the tooth height (ISO 6336-1:2006, 7.4).

    Parameters
    ----------
    face_load : array
        K_Hbeta.
    pair : GearPair

    Examples
    --------
    The helical stage of the NREL 5 MW gearbox as a rating program has it: b / h = 360 / 30.562, K_Hbeta 1.150:

    >>> round(float(1.150 ** _face_exponent(360.0 / 30.562)), 3)
    1.137
    """
    heights = [abs(gear.tip_radius - gear.root_radius) for gear in (pair.pinion, pair.gear)]
    return np.asarray(face_load ** _face_exponent(pair.face_width / max(heights)))


def _face_exponent(slenderness: float) -> float:
    """N_F of b / h, which counts as no less than 3."""
    ratio = max(slenderness, 3.0)
    return ratio**2 / (1.0 + ratio + ratio**2)


def form_and_correction(gear: Gear, virtual: float, loaded: float) -> tuple[float, float, float]:
    """Y_F, Y_S and the notch parameter q_s of an external gear.

    Parameters
    ----------
    gear : Gear
    virtual : float
        Teeth z_n of the virtual spur gear.
    loaded : float
        Diameter at which the load acts on that gear, normal modules.
    """
    angle, shift = gear.normal_pressure_angle, gear.profile_shift
    tool_depth, radius = gear.dedendum_factor, gear.rack.tip_radius
    offset = radius - tool_depth + shift
    half = 0.25 * math.pi - tool_depth * math.tan(angle) - (1.0 - math.sin(angle)) * radius / math.cos(angle)
    constant = 2.0 / virtual * (0.5 * math.pi - half) - _ROOT_ANGLE
    theta = math.pi / 6.0
    for _ in range(_NEWTON_STEPS):
        error = theta - 2.0 * offset / virtual * math.tan(theta) + constant
        theta -= error / (1.0 - 2.0 * offset / virtual / math.cos(theta) ** 2)
    chord = virtual * math.sin(_ROOT_ANGLE - theta) + math.sqrt(3.0) * (offset / math.cos(theta) - radius)
    cosine = math.cos(theta)
    fillet = radius + 2.0 * offset**2 / (cosine * (virtual * cosine**2 - 2.0 * offset))
    at_load = math.acos(virtual * math.cos(angle) / loaded)
    half_tooth = (0.5 * math.pi + 2.0 * shift * math.tan(angle)) / virtual + involute(angle) - involute(at_load)
    force_angle = at_load - half_tooth
    arm = 0.5 * (
        (math.cos(half_tooth) - math.sin(half_tooth) * math.tan(force_angle)) * loaded
        - virtual * math.cos(_ROOT_ANGLE - theta)
        - offset / math.cos(theta)
        + radius
    )
    form = 6.0 * arm * math.cos(force_angle) / (chord**2 * math.cos(angle))
    slender, notch = chord / arm, 0.5 * chord / fillet
    correction = (1.2 + 0.13 * slender) * notch ** (1.0 / (1.21 + 2.3 / slender))
    return form, correction, notch
