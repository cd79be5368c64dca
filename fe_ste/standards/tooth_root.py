"""Nominal tooth root stress to ISO 6336-3 method B, editions of 2019 and 2006.

The edition of 2019 has the load distribution influence factor f_epsilon in Y_F, and divides Y_beta by cos^3(beta).
Source: F. Mehlan, MADE4WIND drivetrain optimizer, https://github.com/FelixMehlan/MADE4WIND-drivetrain-optimizer,
package `gearopt.safety`. The results of a rating program that its tests quote confirm both factors.

Gears without protuberance and undercut, tooth thinning neglected; internal gears to Corrigendum 1 of 2007, with their
pinion-type cutter. Lengths in the formulas are in normal modules of the virtual spur gear in the normal section; an
internal gear has a negative number of teeth and negative diameters there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.geometry.involute import involute
from fe_ste.standards.iso6336 import Edition, Hardening
from fe_ste.tools.arrays import Floats

_ROOT_ANGLE, _RING_ROOT_ANGLE = math.pi / 3.0, math.pi / 6.0
"""60 and 30 deg: the tangents at the critical section lean by 30 deg from the middle of an external tooth, by 60 deg
from that of an internal one."""
_THICK_RIM, _THICK_RING = 1.2, 3.5
"""Rim over tooth height, and ring's rim over normal module, from which rims do not weaken roots."""
_FINE_CLASS, _DEEP_TEETH = 4, 2.05
"""Coarsest flank tolerance class, and virtual contact ratio from which on, teeth count as deep."""
_NEWTON_STEPS = 50
_LARGEST_HELIX = math.radians(30.0)
"""Above it the helix factor stays."""


@dataclass(frozen=True)
class RootStressFactors:
    """Factors of the nominal root stress ``sigma_F0 = F_t / (b m_n) Y_F Y_S Y_beta``."""

    form: float
    stress_correction: float
    helix: float
    """Y_F (with f_epsilon) and Y_S with the load at the outer point of single contact, Y_beta."""
    load_distribution: float
    """f_epsilon of the edition of 2019; 1 in the edition of 2006."""
    rim: float
    deep_tooth: float
    """Y_B of thin rims, Y_DT of deep teeth of high accuracy."""
    notch: float
    """q_s, the notch parameter."""
    outside_validity: tuple[str, ...]
    """Why the value is an extrapolation."""

    @property
    def product(self) -> float:
        """Y_F Y_S Y_beta Y_B Y_DT."""
        return self.form * self.stress_correction * self.helix * self.rim * self.deep_tooth


def root_stress_factors(
    pair: GearPair,
    member: int,
    tolerance_class: int | None = None,
    free_bore: bool = False,
    edition: Edition = "ISO 6336:2019",
) -> RootStressFactors:
    """Factors of the root stress of a gear in its pair, ISO 6336-3, method B.

    Parameters
    ----------
    member : {0, 1}
        Gear 1 or gear 2.
    tolerance_class : flank tolerance class: teeth of class 4 and finer share the load of deep teeth
    free_bore
        Whether the diameter at which an external gear is held is a bore that nothing fills, as in planets on rollers,
        and not a seat on a shaft: its rim then counts, as that of a ring does.
    edition : of the standard
    """
    gear = (pair.pinion, pair.gear)[member]
    virtual = gear.teeth / (math.cos(gear.base_helix_angle) ** 2 * math.cos(gear.helix_angle))
    contact_ratio = pair.transverse_contact_ratio / math.cos(gear.base_helix_angle) ** 2
    tip = virtual + 2.0 * (gear.tip_radius - gear.reference_radius) / gear.normal_module
    base = virtual * math.cos(gear.normal_pressure_angle)
    # Diameter at the outer point of single contact: from the tip along the path, towards the root, by what is shared.
    shared = math.pi * math.cos(gear.normal_pressure_angle) * (contact_ratio - 1.0) * gear.outward
    loaded = 2.0 * math.hypot(0.5 * math.sqrt(tip**2 - base**2) - shared, 0.5 * base)
    form, correction, notch = form_and_correction(gear, virtual, loaded)
    distribution = 1.0
    if edition == "ISO 6336:2019":
        distribution = load_distribution_factor(pair.overlap_ratio, contact_ratio)
    remarks = {
        f"notch parameter q_s = {notch:.2f} is outside 1 to 8": not 1.0 <= notch <= 8.0,
        f"virtual contact ratio {contact_ratio:.2f} is not below 2": contact_ratio >= 2.0,
        "no cutter is specified: the root fillet of its rack is used": gear.internal and gear.cutter is None,
    }
    return RootStressFactors(
        form=form * distribution,
        stress_correction=correction,
        helix=helix_factor(gear.helix_angle, pair.overlap_ratio, edition),
        load_distribution=distribution,
        rim=rim_factor(gear) if gear.internal or free_bore else 1.0,
        deep_tooth=_deep_tooth_factor(contact_ratio, tolerance_class),
        notch=notch,
        outside_validity=tuple(text for text, applies in remarks.items() if applies),
    )


def load_distribution_factor(overlap: float, contact_ratio: float) -> float:
    """f_epsilon of ISO 6336-3:2019: load distribution influence factor in Y_F.

    Parameters
    ----------
    overlap : eps_beta
    contact_ratio : eps_alpha_n, of the virtual spur gear

    Notes
    -----
    1 for spur gears (0.7 for contact ratios of at least 2), ``eps_alpha_n^-0.5`` for overlap ratios of at least 1. In
    between, the square is interpolated linearly, which makes the factor continuous; the source interpolates the factor
    itself to ``1 / eps_alpha_n`` and is discontinuous there.

    Examples
    --------
    >>> [round(load_distribution_factor(eps_beta, 1.5), 3) for eps_beta in (0.0, 0.5, 1.0, 1.5)]
    [1.0, 0.913, 0.816, 0.816]
    """
    if overlap >= 1.0:
        return 1.0 / math.sqrt(contact_ratio)
    spur, spur_squared = (1.0, 1.0)
    if contact_ratio >= 2.0:
        spur, spur_squared = (0.7, 0.5)
    if overlap <= 0.0:
        return spur
    return math.sqrt(spur_squared * (1.0 - overlap) + overlap / contact_ratio)


def helix_factor(helix_angle: float, overlap: float, edition: Edition = "ISO 6336:2019") -> float:
    """Y_beta of the helix angle (rad, 30 deg at most) and the overlap ratio (1 at most).

    Examples
    --------
    >>> angle = math.radians(15.0)
    >>> [round(helix_factor(angle, 1.5, edition), 3) for edition in ("ISO 6336:2006", "ISO 6336:2019")]
    [0.875, 0.971]
    """
    angle = min(abs(helix_angle), _LARGEST_HELIX)
    factor = 1.0 - min(overlap, 1.0) * angle / math.radians(120.0)
    return factor if edition == "ISO 6336:2006" else float(factor / math.cos(angle) ** 3)


def rim_factor(gear: Gear) -> float:
    """Y_B of the rim between the roots and where the gear is held, ISO 6336-3:2006, clause 9.

    Examples
    --------
    >>> gear = {"name": "1", "teeth": 60, "normal_module": 5e-3, "face_width": 50e-3}
    >>> [round(rim_factor(Gear(**gear, held_diameter=inside)), 3) for inside in (100e-3, 270e-3)]
    [1.0, 1.694]
    """
    rim = abs(0.5 * gear.held_diameter - gear.root_radius)
    height = abs(gear.tip_radius - gear.root_radius)
    if gear.internal:
        if rim >= _THICK_RING * gear.normal_module:
            return 1.0
        return 1.15 * math.log(8.324 * gear.normal_module / rim)
    if rim >= _THICK_RIM * height:
        return 1.0
    return 1.6 * math.log(2.242 * height / rim)


def _deep_tooth_factor(contact_ratio: float, tolerance_class: int | None) -> float:
    """Y_DT over the virtual contact ratio."""
    if tolerance_class is None or tolerance_class > _FINE_CLASS or contact_ratio <= _DEEP_TEETH:
        return 1.0
    return max(2.366 - 0.666 * contact_ratio, 0.7)


def root_face_load_factor(face_load: Floats, pair: GearPair) -> Floats:
    """K_Fbeta of K_Hbeta, by the face width over the tooth height (ISO 6336-1:2006, 7.4).

    Parameters
    ----------
    face_load : K_Hbeta

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
    """Y_F, Y_S and the notch parameter q_s of a gear.

    Parameters
    ----------
    virtual : teeth z_n of the virtual spur gear
    loaded : diameter at which the load acts on that gear, normal modules
    """
    teeth = virtual * gear.outward
    diameter = loaded * gear.outward
    angle = gear.normal_pressure_angle
    shift = gear.profile_shift * gear.outward
    tool_depth = gear.dedendum_factor
    radius = _rack_radius(gear)
    section, around = (_RING_ROOT_ANGLE, 1.0) if gear.internal else (_ROOT_ANGLE, math.sqrt(3.0))
    offset = radius - tool_depth + shift
    half = 0.25 * math.pi - tool_depth * math.tan(angle) - (1.0 - math.sin(angle)) * radius / math.cos(angle)
    theta = _tangent_angle(2.0 * offset / teeth, 2.0 / teeth * (0.5 * math.pi - half) - section)
    cosine = math.cos(theta)
    lean = section - theta
    chord = teeth * math.sin(lean) + around * (offset / cosine - radius)
    fillet = radius + 2.0 * offset**2 / (cosine * (virtual * cosine**2 - 2.0 * offset))
    at_load = math.acos(teeth * math.cos(angle) / diameter)
    half_tooth = (0.5 * math.pi + 2.0 * shift * math.tan(angle)) / teeth + involute(angle) - involute(at_load)
    force_angle = at_load - half_tooth
    arm = 0.5 * (
        (math.cos(half_tooth) - math.sin(half_tooth) * math.tan(force_angle)) * diameter
        - teeth * math.cos(lean)
        - math.sqrt(3.0) / around * (offset / cosine - radius)
    )
    form = 6.0 * arm * math.cos(force_angle) / (chord**2 * math.cos(angle))
    slender = chord / arm
    notch = 0.5 * chord / fillet
    correction = (1.2 + 0.13 * slender) * notch ** (1.0 / (1.21 + 2.3 / slender))
    return form, correction, notch


def _tangent_angle(slope: float, constant: float) -> float:
    """Solve ``theta = slope tan(theta) - constant``, rad."""
    theta = math.pi / 6.0
    for _ in range(_NEWTON_STEPS):
        error = theta - slope * math.tan(theta) + constant
        theta -= error / (1.0 - slope / math.cos(theta) ** 2)
    return theta


def _rack_radius(gear: Gear) -> float:
    """rho_fPv: tip radius of the rack, or of one that leaves about what the cutter of an internal gear leaves."""
    if not gear.internal:
        return gear.rack.tip_radius
    if gear.cutter is None:
        return gear.fillet_radius / gear.normal_module
    radius = gear.cutter.tip_radius
    cutter = gear.cutter
    reach = max(cutter.profile_shift + gear.dedendum_factor - radius, 0.0)
    return radius + float(reach**1.95) / (3.156 * 1.036**cutter.teeth)


# Permissible tooth root stress, ISO 6336-3:2006 method B: Y_delta_rel_T, Y_R_rel_T and Y_X

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
