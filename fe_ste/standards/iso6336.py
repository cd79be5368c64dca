"""Mesh stiffness by ISO 6336-1 method B, for comparison with the finite elements.

The series for the theoretical single stiffness was fitted to external spur gears of the basic rack with
dedendum 1.2; everything else enters by factors. The stiffness holds per unit of face width, along the
transverse line of action.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools.display import Displayed, TitledRows, value_range

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
class MethodBStiffness(Displayed):
    """Stiffness of a gear pair by ISO 6336-1 method B."""

    theoretical_single_stiffness: float
    """c'_th of one pair of spur teeth, N/m per m."""
    single_stiffness: float
    """c': greatest stiffness of one pair of teeth, N/m per m."""
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
        return f": mesh {1e-9 * self.mesh_stiffness:.4g} N/(mm um), {1e-6 * self.stiffness:.4g} N/um"

    def _table(self) -> TitledRows:
        per_width = {
            "theoretical single stiffness": self.theoretical_single_stiffness,
            "single stiffness": self.single_stiffness,
            "mesh stiffness": self.mesh_stiffness,
        }
        return "stiffness by ISO 6336-1 method B", {
            **{name: value_range(value, "N/(mm um)", 1e-9) for name, value in per_width.items()},
            "mean mesh stiffness": value_range(self.stiffness, "N/um", 1e-6),
            "outside validity": "; ".join(self.outside_validity) or "no",
        }


def mesh_stiffness(
    pair: GearPair,
    *,
    tangential_force: float | None = None,
    application_factor: float = 1.0,
    blank_factor: float = 1.0,
) -> MethodBStiffness:
    """Stiffness of a gear pair by ISO 6336-1 method B.

    Parameters
    ----------
    pair : the pair. An internal gear counts as a rack: infinitely many teeth, no profile shift.
    tangential_force
        F_t at the reference circle, N. Below 100 N/mm of face width the stiffness falls with the fourth root
        of the load; without a force that correction is left out.
    application_factor : K_A, applied to the force
    blank_factor : C_R of the gear blanks, 1 for solid discs

    Returns
    -------
    stiffnesses and what speaks against them

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
    elasticity = _mean_youngs_modulus(pair) / _STEEL
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
    """q', flexibility of one pair of teeth per unit of face width, mm um/N."""
    x_1 = pair.pinion.profile_shift
    x_2 = pair.gear.profile_shift
    per_tooth_1 = 1.0 / _virtual_teeth(pair.pinion)
    per_tooth_2 = 1.0 / _virtual_teeth(pair.gear)
    if pair.gear.internal:
        x_2 = per_tooth_2 = 0.0
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


def _mean_youngs_modulus(pair: GearPair) -> float:
    moduli = pair.pinion.material.youngs_modulus, pair.gear.material.youngs_modulus
    return 2.0 * moduli[0] * moduli[1] / (moduli[0] + moduli[1])


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
