"""Load-dependent loss of a gear mesh: loss factors, and coefficients of friction.

The power that friction of the teeth dissipates is P_loss = P mu_m H_V: the power P through the mesh, a mean coefficient
of friction mu_m and the gear loss factor H_V, which is geometry alone: the mean sliding speed over the mesh cycle,
weighted by the load, over the speed of the base circles. Speeds are those relative to the frame of the mesh: to the
carrier of planets.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fe_ste.geometry.gears import GearPair
from fe_ste.tools.arrays import Floats


def partial_contact_ratios(pair: GearPair) -> tuple[float, float]:
    """Contact ratios from the pitch point to where contact ends at the tips of gear 1 and of gear 2.

    One of them may be negative: the pitch point is outside the path of contact then.

    Examples
    --------
    >>> from fe_ste.geometry.gears import Gear
    >>> gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
    >>> pair = GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3)
    >>> [round(part, 4) for part in partial_contact_ratios(pair)], round(pair.transverse_contact_ratio, 4)
    ([0.8268, 0.8268], 1.6535)
    """
    tangent = math.tan(pair.working_pressure_angle)
    ratios = []
    for gear in (pair.pinion, pair.gear):
        # Contact ends at the tip circle, or where a chamfer begins; that of an internal gear is inside the pitch point.
        beyond = math.sqrt(gear.tip_form_radius**2 - gear.base_radius**2) - gear.base_radius * tangent
        ratios.append(gear.outward * beyond / pair.transverse_base_pitch)
    return ratios[0], ratios[1]


def loss_factor(pair: GearPair) -> float:
    """Gear loss factor H_V with equal load on all tooth pairs in contact (Ohlendorf 1958).

    H_V = pi (u + 1) / (z_1 u cos beta_b) (1 - eps_alpha + eps_1^2 + eps_2^2) with the contact ratios of
    `partial_contact_ratios`, u the ratio of the numbers of teeth, negative for internal gears. The formula is exact for
    spur gears with contact ratios between 1 and 2 and the pitch point within the path of contact.

    Examples
    --------
    >>> from fe_ste.geometry.gears import Gear
    >>> gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
    >>> round(loss_factor(GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3)), 4)
    0.1494
    """
    first, second = partial_contact_ratios(pair)
    return _sliding(pair) * (1.0 - first - second + first**2 + second**2)


def helical_loss_factor(pair: GearPair) -> float:
    """Gear loss factor H_V with a constant load per length of all contact lines, as in wide helical gears.

    As `loss_factor` with the bracket (eps_1 abs(eps_1) + eps_2 abs(eps_2)) / eps_alpha: the mean distance from the
    pitch point over the path of contact.
    """
    first, second = partial_contact_ratios(pair)
    return _sliding(pair) * (first * abs(first) + second * abs(second)) / (first + second)


def _sliding(pair: GearPair) -> float:
    """Sliding speed over the speed of the base circles, normal load over tangential: at half a base pitch of path."""
    ratios = 1.0 / pair.pinion.teeth + pair.gear.outward / pair.gear.teeth
    return math.pi * abs(ratios) / math.cos(pair.pinion.base_helix_angle)


@dataclass(frozen=True)
class MeshOperation:
    """What friction in a mesh depends on: geometry at the pitch point, load, speed, oil and roughness."""

    line_load: float
    """Tangential force at the base circles over the common face width, F_bt / b, N/m."""
    sum_speed: float
    """Sum of both surface speeds along the profile at the pitch point, relative to the frame of the mesh, m/s."""
    radius: float
    """Reduced radius of curvature at the pitch point in the normal section, m."""
    viscosity: float
    """Dynamic viscosity of the oil at its temperature, Pa s."""
    roughness: float
    """Arithmetic mean roughness Ra, mean of both flanks, m."""

    @classmethod
    def of(cls, pair: GearPair, force: float, speed: float, viscosity: float, roughness: float) -> MeshOperation:
        """Collect the operating conditions of a pair.

        Parameters
        ----------
        force : F_bt, N
        speed : of gear 1 relative to the frame of the mesh, rad/s
        viscosity, roughness : Pa s, m
        """
        pinion = pair.pinion
        tangent = math.tan(pair.working_pressure_angle)
        curvature = (1.0 / pinion.base_radius + pair.gear.outward / pair.gear.base_radius) / tangent
        return cls(
            line_load=abs(force) / pair.face_width,
            sum_speed=2.0 * abs(speed) * pinion.base_radius * tangent,
            radius=1.0 / (curvature * math.cos(pinion.base_helix_angle)),
            viscosity=viscosity,
            roughness=roughness,
        )


def friction_schlenk(mesh: MeshOperation) -> float:
    """Mean coefficient of friction by Schlenk (FVA; ISO/TR 14179-2), for mineral oil.

    mu_m = 0.048 (F_bt / b / (v_Sigma rho))^0.2 eta^-0.05 Ra^0.25 with N/mm, m/s, mm, mPa s and um; as in C. Fernandes,
    GEARpie (2022), https://github.com/cfernandesFEUP/GEARpie, without its factor for the lubricant.

    Examples
    --------
    >>> mesh = MeshOperation(line_load=4e5, sum_speed=3.0, radius=12e-3, viscosity=0.03, roughness=0.5e-6)
    >>> round(friction_schlenk(mesh), 4)
    0.0551
    """
    load = 1e-3 * mesh.line_load / (mesh.sum_speed * 1e3 * mesh.radius)
    return float(0.048 * load**0.2 * (1e3 * mesh.viscosity) ** -0.05 * (1e6 * mesh.roughness) ** 0.25)


def friction_niemann(mesh: MeshOperation, diameter: float, speed_ratio: float = 1.0) -> float:
    """Mean coefficient of friction by Niemann and Winter, as rating programs print it, for mineral oil.

    mu_m = 0.045 (w / (v_S rho))^0.2 eta^-0.05 X_R with X_R = 3.8 (Ra / d_1)^0.25, in N/mm, m/s, mm, mPa s and um (G.
    Niemann, H. Winter, Maschinenelemente II). The conventions for load, speed and roughness are those that reproduce
    the losses of a public rating report (NREL 5 MW gearbox) within 0.5 %: the line load contains the dynamic and the
    distribution factor, the sum speed is that at the reference circle, the viscosity that at the temperature of the
    teeth, and the roughness that of the rougher flank.

    Parameters
    ----------
    mesh : with line load and roughness as above
    diameter : reference diameter of gear 1, m
    speed_ratio : sum speed at the reference circle over that at the pitch point

    Examples
    --------
    >>> mesh = MeshOperation(line_load=4e5, sum_speed=3.0, radius=12e-3, viscosity=0.03, roughness=0.5e-6)
    >>> round(friction_niemann(mesh, 0.1), 4)
    0.0621
    """
    load = 1e-3 * mesh.line_load / (speed_ratio * mesh.sum_speed * 1e3 * mesh.radius)
    roughness = 3.8 * (1e6 * mesh.roughness / (1e3 * diameter)) ** 0.25
    return float(0.045 * load**0.2 * (1e3 * mesh.viscosity) ** -0.05 * roughness)


XU_KAHRAMAN = (-8.916465, 1.03303, 1.036077, -0.354068, 2.812084, -0.100601, 0.752755, -0.390958, 0.620305)
"""Coefficients b_1 to b_9 of `friction_xu_kahraman`."""


def friction_xu_kahraman(
    pressure: ArrayLike,
    slide_to_roll: ArrayLike,
    speed: ArrayLike,
    radius: ArrayLike,
    viscosity: float,
    roughness: float,
) -> Floats:
    """Local coefficient of friction in an elastohydrodynamic contact by Xu and Kahraman.

    mu = e^f p^b2 SR^b3 v^b6 eta^b7 R^b8, f = b1 + b4 SR p lg eta + b5 e^(-SR p lg eta) + b9 e^S, SR the absolute
    slide-to-roll ratio, with GPa, m/s, mPa s, m and um rms (H. Xu, Development of a generalized mechanical efficiency
    prediction methodology for gear pairs, dissertation, Ohio State University, 2005). The term of roughness was fitted
    up to 0.5 um and rises steeply beyond.

    Parameters
    ----------
    pressure : maximum Hertzian pressure, Pa
    slide_to_roll : sliding speed over the mean of both surface speeds
    speed : mean of both surface speeds, m/s
    radius : reduced radius of curvature, m
    viscosity : dynamic viscosity at the temperature of the oil, Pa s
    roughness : root mean square roughness of both flanks, m

    Examples
    --------
    >>> print(round(float(friction_xu_kahraman(1e9, 0.3, 5.0, 12e-3, 0.01, 0.3e-6)), 4))
    0.0174
    """
    b1, b2, b3, b4, b5, b6, b7, b8, b9 = XU_KAHRAMAN
    p = 1e-9 * np.asarray(pressure)
    slide = np.abs(slide_to_roll)
    eta = 1e3 * viscosity
    product = slide * p * math.log10(eta)
    f = b1 + b4 * product + b5 * np.exp(-product) + b9 * math.exp(1e6 * roughness)
    return np.asarray(np.exp(f) * p**b2 * slide**b3 * np.asarray(speed) ** b6 * eta**b7 * np.asarray(radius) ** b8)
