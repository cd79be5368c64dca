"""ISO 6336-1 by method B: mesh stiffness, and the load factors K_v, K_Hbeta, K_Halpha and K_Falpha.

The series for the theoretical single stiffness was fitted to external spur gears of the basic rack with
dedendum 1.2; everything else enters by factors. The stiffness holds per unit of face width, along the
transverse line of action.

Checked against the sheets that a rating program printed for the NREL 5 MW gearbox (github.com/gfsReboucas/Drivetrain).
Case-hardened and through-hardened steels; solid discs for the mass that vibrates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools.display import ReprMixin, TitledRows, value_range

_STEEL = 206e9
"""Young's modulus behind the series, Pa."""
_PER_WIDTH = 1e9
"""One N/(mm um) in N/m per m."""
_REFERENCE_LINE_LOAD = 100e3
"""Load per face width below which the stiffness falls, N/m."""
_GREATEST_LINE_LOAD = 1600e3
"""Load per face width up to which the series has been compared with measurements, N/m."""
_MEASURED_TO_THEORETICAL = 0.8
"""Correction factor C_M of measured to theoretical stiffness of solid disc gears."""


@dataclass(frozen=True)
class MethodBStiffness(ReprMixin):
    """Stiffness of a gear pair according to ISO 6336-1 method B."""

    theoretical_single_stiffness: float
    """c'_th of one pair of spur teeth, N/m per m."""
    single_stiffness: float
    """c': maximum stiffness of one pair of teeth, N/m per m."""
    mesh_stiffness: float
    """c_gamma_alpha: mean of the mesh, N/m per m."""
    face_width: float
    """Common face width, m."""
    outside_validity: tuple[str, ...]
    """Why the value is an extrapolation; empty if it is not."""

    @property
    def mesh_stiffness_for_load_distribution(self) -> float:
        """c_gamma_beta = 0.85 c_gamma_alpha, N/m per m: replaces the mesh stiffness, is never added to it."""
        return 0.85 * self.mesh_stiffness

    @property
    def stiffness(self) -> float:
        """Mean mesh stiffness along the transverse line of action, N/m."""
        return self.mesh_stiffness * self.face_width

    def _line(self) -> str:
        return f": mesh {1e-9 * self.mesh_stiffness:.4g} N/(mm µm), {1e-6 * self.stiffness:.4g} N/µm"

    def _table(self) -> TitledRows:
        per_width = {
            "theoretical single stiffness": self.theoretical_single_stiffness,
            "single stiffness": self.single_stiffness,
            "mesh stiffness": self.mesh_stiffness,
        }
        return "stiffness to ISO 6336-1 method B", {
            **{name: value_range(value, "N/(mm µm)", 1e-9) for name, value in per_width.items()},
            "mean mesh stiffness": value_range(self.stiffness, "N/µm", 1e-6),
            "outside validity": "; ".join(self.outside_validity) or "no",
        }


def mesh_stiffness(
    pair: GearPair,
    *,
    tangential_force: float | None = None,
    application_factor: float = 1.0,
    blank_factor: float = 1.0,
) -> MethodBStiffness:
    """Return the stiffness of a gear pair according to ISO 6336-1 method B.

    Parameters
    ----------
    pair : gear pair. For an internal gear the tooth number is infinite; its profile shift is included.
    tangential_force
        F_t at the reference circle, N. Below 100 N/mm of face width the stiffness falls with the fourth root of the
        load; without a force that correction is omitted.
    application_factor : K_A, applied to the force
    blank_factor : C_R of the gear blanks, 1 for solid discs

    Returns
    -------
    stiffnesses, with warnings where the method does not apply

    Raises
    ------
    ValueError
        If a force or factor is not a finite number above zero.

    Notes
    -----
    ``c' = C_M C_R C_B cos(beta) / q'`` times the ratio of the mean Young's modulus to 206 GPa, and
    ``c_gamma_alpha = c' (0.75 eps_alpha + 0.25)``.

    Examples
    --------
    >>> gear = {"normal_module": 3e-3, "face_width": 20e-3, "held_diameter": 100e-3}
    >>> pinion, wheel = Gear(name="1", teeth=50, **gear), Gear(name="2", teeth=50, **gear)
    >>> pair = GearPair(name="spur", pinion=pinion, gear=wheel, centre_distance=0.15)
    >>> result = mesh_stiffness(pair)
    >>> round(1e-9 * result.single_stiffness, 2), round(1e-9 * result.mesh_stiffness, 2)
    (14.05, 22.01)
    """
    for key, value in {
        "tangential_force": tangential_force,
        "application_factor": application_factor,
        "blank_factor": blank_factor,
    }.items():
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{key} = {value!r} must be a finite number above zero")
    theoretical = _PER_WIDTH / _flexibility(pair)
    moduli = pair.pinion.material.youngs_modulus, pair.gear.material.youngs_modulus
    elasticity = 2.0 * moduli[0] * moduli[1] / ((moduli[0] + moduli[1]) * _STEEL)
    rack = 0.5 * (_basic_rack_factor(pair.pinion) + _basic_rack_factor(pair.gear))
    factors = _MEASURED_TO_THEORETICAL * blank_factor * rack * elasticity
    single = theoretical * factors * math.cos(pair.pinion.helix_angle)
    line_load = None if tangential_force is None else tangential_force * application_factor / pair.face_width
    if line_load is not None and line_load < _REFERENCE_LINE_LOAD:
        single *= (line_load / _REFERENCE_LINE_LOAD) ** 0.25
    return MethodBStiffness(
        theoretical_single_stiffness=theoretical,
        single_stiffness=single,
        mesh_stiffness=single * (0.75 * pair.transverse_contact_ratio + 0.25),
        face_width=pair.face_width,
        outside_validity=_outside_validity(pair, line_load),
    )


def _flexibility(pair: GearPair) -> float:
    """q', flexibility of one pair of teeth per unit of face width, mm um/N.

    For an internal gear only the tooth number is infinite. Its profile shift has the sign of ISO 21771, opposite to
    that of `Gear`.
    """
    x_1 = pair.pinion.profile_shift
    x_2 = pair.gear.profile_shift * pair.gear.outward
    per_tooth_1 = 1.0 / _virtual_teeth(pair.pinion)
    per_tooth_2 = 1.0 / _virtual_teeth(pair.gear)
    if pair.gear.internal:
        per_tooth_2 = 0.0
    return (
        0.04723
        + 0.15551 * per_tooth_1
        + 0.25791 * per_tooth_2
        - 0.00635 * x_1
        - 0.11654 * x_1 * per_tooth_1
        - 0.00193 * x_2
        - 0.24188 * x_2 * per_tooth_2
        + 0.00529 * x_1**2
        + 0.00182 * x_2**2
    )


def _virtual_teeth(gear: Gear) -> float:
    """Tooth number z_n of the virtual spur gear in the normal section."""
    return gear.teeth / (math.cos(gear.base_helix_angle) ** 2 * math.cos(gear.helix_angle))


def _basic_rack_factor(gear: Gear) -> float:
    """C_B, for a dedendum other than 1.2 and a pressure angle other than 20 deg."""
    depth = 1.0 + 0.5 * (1.2 - gear.dedendum_factor)
    return depth * (1.0 - 0.02 * (20.0 - math.degrees(gear.normal_pressure_angle)))


def _outside_validity(pair: GearPair, line_load: float | None) -> tuple[str, ...]:
    """Conditions of the series and of the mesh factor that the pair does not meet."""
    x_1 = pair.pinion.profile_shift
    x_2 = 0.0 if pair.gear.internal else pair.gear.profile_shift
    helix_angle = abs(math.degrees(pair.pinion.helix_angle))
    contact_ratio = pair.transverse_contact_ratio
    virtual_teeth = _virtual_teeth(pair.pinion)
    remarks = {
        f"x1 = {x_1:g} is below x2 = {x_2:g}": not pair.gear.internal and x_1 < x_2,
        f"x1 + x2 = {x_1 + x_2:g} is outside -0.5 to 2": not -0.5 <= x_1 + x_2 <= 2.0,
        f"virtual teeth of the pinion = {virtual_teeth:.1f} are below 18": virtual_teeth < 18.0,
        f"helix angle = {helix_angle:g} deg is above 30 deg": helix_angle > 30.0,
        f"transverse contact ratio = {contact_ratio:.3f} is below 1.2": contact_ratio < 1.2,
        "line load is above 1600 N/mm": line_load is not None and line_load > _GREATEST_LINE_LOAD,
    }
    return tuple(remark for remark, applies in remarks.items() if applies)


def outside_scope(pair: GearPair) -> str:
    """Return why ISO 6336 does not apply to a pair (ISO 6336-1, scope); empty if it does.

    Teeth of a transverse contact ratio below 1 are never alone in contact: factors that refer to the points of single
    contact (Z_B, Z_D, Y_F) and to the share of the load (Z_eps) have no meaning.
    """
    if pair.transverse_contact_ratio < 1.0:
        return f"transverse contact ratio {pair.transverse_contact_ratio:.3f} is below 1, outside the scope of ISO 6336"
    return ""


Hardening = Literal["case_hardened", "through_hardened"]
"""Steels that the standard has constants of."""
Edition = Literal["ISO 6336:2019", "ISO 6336:2006"]
"""Editions of the standard. They differ in Z_B and Z_D (`fe_ste.standards.pitting`) and in Y_F and Y_beta
(`fe_ste.standards.tooth_root`) of helical gears. Both use the load factors of 2006."""

_RESONANCE, _ABOVE = 1.15, 1.5
"""Speed ratios where the main resonance ends, and where the supercritical range begins."""


@dataclass(frozen=True)
class FlankDeviations:
    """Deviations of a pair that load factors count with: the larger of both gears, m."""

    base_pitch: float
    """f_pb, the single pitch deviation on the base circle."""
    profile_form: float
    """f_f_alpha."""
    helix: float = 0.0
    """f_ma, misalignment by manufacture of the gears."""


def pitch_running_in(deviation: float, hardening: Hardening, limit: float, velocity: float) -> float:
    """y_alpha, y_p or y_f: what running in takes from a deviation of pitch or profile, m (ISO 6336-1, 8.3.5).

    Parameters
    ----------
    deviation : f_pb or f_f_alpha, m
    hardening : {"case_hardened", "through_hardened"}
    limit : sigma_H_lim, Pa
    velocity : of the pitch line, m/s: through-hardened flanks run in less when they are fast

    Examples
    --------
    >>> round(1e6 * pitch_running_in(15.9e-6, "case_hardened", 1500e6, 20.8), 1)
    1.2
    """
    if hardening == "case_hardened":
        return min(0.075 * deviation, 3e-6)
    most = _most_running_in(velocity)
    return min(160e6 / limit * deviation, 1e-6 * most * 1e6 / limit, deviation)


def _most_running_in(velocity: float) -> float:
    """Limit of y_alpha of through-hardened flanks at a velocity of the pitch line (m/s), um MPa."""
    if velocity <= 5.0:
        return math.inf
    return 12800.0 if velocity <= 10.0 else 6400.0


def helix_running_in(misalignment: float, hardening: Hardening, limit: float, velocity: float) -> float:
    """y_beta: what running in takes from the equivalent misalignment F_beta_x, m (ISO 6336-1, 7.5)."""
    if hardening == "case_hardened":
        return min(0.15 * misalignment, 6e-6)
    most = 2.0 * _most_running_in(velocity)
    return min(320e6 / limit * misalignment, 1e-6 * most * 1e6 / limit, misalignment)


def reduced_mass(pair: GearPair, meshes: tuple[int, int] = (1, 1), ring_held: bool = True) -> float:
    """m_red: reduced mass of both gears on the line of action per unit of face width, kg/m.

    Parameters
    ----------
    pair : gears that are solid between the held diameter and the middle of the teeth; for an internal gear, its rim
    meshes : simultaneous meshes of gear 1 and gear 2; for a sun, the number of planets
    ring_held : whether the housing holds an internal gear, which then has infinite mass

    Notes
    -----
    Sun and p planets: ``J_p J_s / (p r_bs^2 J_p + r_bp^2 J_s)``. Planet and held ring: ``J_p / r_bp^2``.
    """
    masses = [_mass_on_base_circle(gear) for gear in (pair.pinion, pair.gear)]
    if pair.gear.internal and ring_held:
        masses[1] = math.inf
    return 1.0 / sum(count / mass for count, mass in zip(meshes, masses, strict=True))


def _mass_on_base_circle(gear: Gear) -> float:
    """Polar moment of inertia over width and squared base radius, kg/m."""
    middle = 0.5 * (gear.tip_radius + gear.root_radius)
    inertia = 0.5 * math.pi * gear.material.density * abs(middle**4 - (0.5 * gear.held_diameter) ** 4)
    return inertia / gear.base_radius**2


def resonance_speed(pair: GearPair, mesh_stiffness: float, mass: float) -> float:
    """n_E1: speed of gear 1 relative to its frame at the main resonance, rad/s.

    Parameters
    ----------
    mesh_stiffness : c_gamma_alpha, N/m per m
    mass : m_red, kg/m, from `reduced_mass`
    """
    return math.sqrt(mesh_stiffness / mass) / pair.pinion.teeth


def dynamic_factor(
    ratio: float,
    contact_ratio: float,
    single_stiffness: float,
    line_load: float,
    effective: FlankDeviations,
    tip_relief: float | None = None,
) -> float:
    """K_v of ISO 6336-1:2006, 6.5 (method B).

    Parameters
    ----------
    ratio : N, speed of gear 1 over `resonance_speed`
    contact_ratio : eps_gamma, the total one
    single_stiffness : c', N/m per m
    line_load : F_t K_A K_gamma over the face width, N/m
    effective : what running in leaves of them
    tip_relief : C_a of gears of class 5 or finer, m; coarser ones have B_k = 1

    Examples
    --------
    The helical stage of the NREL 5 MW gearbox, for which a rating program prints 1.092:

    >>> left = FlankDeviations(base_pitch=14.7e-6, profile_form=20.4e-6)
    >>> round(dynamic_factor(0.410, 2.884, 13.832e9, 833.56e3, left), 3)
    1.092
    """
    pitch = single_stiffness * effective.base_pitch / line_load
    profile = single_stiffness * effective.profile_form / line_load
    relief = 1.0 if tip_relief is None else abs(1.0 - single_stiffness * tip_relief / line_load)
    share = min(line_load / _REFERENCE_LINE_LOAD, 1.0)
    lower = 0.85 if share == 1.0 else 0.5 + 0.35 * math.sqrt(share)
    at = _constants(contact_ratio)
    if ratio <= lower:
        return 1.0 + ratio * (at[0] * pitch + at[1] * profile + at[2] * relief)
    resonant = 1.0 + at[0] * pitch + at[1] * profile + at[3] * relief
    if ratio <= _RESONANCE:
        return resonant
    beyond = at[4] * pitch + at[5] * profile + at[6]
    if ratio >= _ABOVE:
        return beyond
    return beyond + (resonant - beyond) * (_ABOVE - ratio) / (_ABOVE - _RESONANCE)


def _constants(eps: float) -> tuple[float, ...]:
    """C_v1 to C_v7 over the total contact ratio."""
    if eps <= 1.5:
        last = 0.75
    elif eps <= 2.5:
        last = 0.875 + 0.125 * math.sin(math.pi * (eps - 2.0))
    else:
        last = 1.0
    if eps <= 2.0:
        return 0.32, 0.34, 0.23, 0.90, 0.47, 0.47, last
    return (
        0.32,
        0.57 / (eps - 0.3),
        0.096 / (eps - 1.56),
        (0.57 - 0.05 * eps) / (eps - 1.44),
        0.47,
        0.12 / (eps - 1.74),
        last,
    )


def face_load_factor(line_load: float, stiffness: float, misalignment: float) -> float:
    """K_Hbeta of ISO 6336-1:2006, 7.5: a flat spring under a wedge.

    Parameters
    ----------
    line_load : F_t K_A K_gamma K_v over the face width, N/m
    stiffness : c_gamma_beta, N/m per m
    misalignment : F_beta_y: opening over the face that running in leaves, m

    Examples
    --------
    >>> face_load_factor(100e3, 20e9, 5e-6), face_load_factor(100e3, 20e9, 40e-6)
    (1.5, 4.0)
    """
    wedge = stiffness * misalignment / (2.0 * line_load)
    return 1.0 + wedge if wedge <= 1.0 else 2.0 * math.sqrt(wedge)


def transverse_load_factors(
    pair: GearPair, line_load: float, mesh_stiffness: float, deviation: float, contact_factor: float
) -> tuple[float, float]:
    """K_Halpha and K_Falpha of ISO 6336-1:2006, 8.3.2.

    Parameters
    ----------
    line_load : F_t K_A K_gamma K_v K_Hbeta over the face width, N/m
    mesh_stiffness : c_gamma_alpha, N/m per m
    deviation : larger of f_pb and f_f_alpha, less y_alpha, m
    contact_factor : Z_eps, by which K_Halpha is limited
    """
    total = pair.total_contact_ratio
    transverse = pair.transverse_contact_ratio
    wave = mesh_stiffness * max(deviation, 0.0) / line_load
    if total <= 2.0:
        factor = 0.5 * total * (0.9 + 0.4 * wave)
    else:
        factor = 0.9 + 0.4 * math.sqrt(2.0 * (total - 1.0) / total) * wave
    most_contact = total / (transverse * contact_factor**2)
    most_root = total / (0.25 * transverse + 0.75)
    return max(min(factor, most_contact), 1.0), max(min(factor, most_root), 1.0)
