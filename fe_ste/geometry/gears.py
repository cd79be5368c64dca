"""Macro geometry of cylindrical gears and of the pairs they form.

Everything follows from a few inputs by the relations of ISO 21771: involute, working angles, path of
contact, contact ratios, backlash. Geometry that cannot run is refused here, before any mesh is built.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Literal, overload

import numpy as np

from fe_ste.geometry.checks import check_gear, check_gear_pair
from fe_ste.geometry.involute import inverse_involute, involute
from fe_ste.tools.arrays import Floats


@dataclass(frozen=True)
class BasicRack:
    """Basic rack tooth profile (ISO 53), in normal modules.

    Parameters
    ----------
    addendum : float
        Addendum of the gear tooth, h_aP*.
    dedendum : float
        Dedendum of the gear tooth, h_fP*.
    tip_radius : float
        Tip radius of the generating rack, rho_fP*: fillet radius at the root of the basic rack.
    """

    addendum: float = 1.0
    dedendum: float = 1.25
    tip_radius: float = 0.38


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic material.

    Parameters
    ----------
    youngs_modulus : float
        Pa.
    poissons_ratio : float
        Dimensionless.
    density : float
        kg/m^3.
    """

    youngs_modulus: float = 206e9
    poissons_ratio: float = 0.3
    density: float = 7850.0


@dataclass(frozen=True, kw_only=True)
class Gear:
    """One cylindrical involute gear, external or internal, spur or helical.

    Parameters
    ----------
    name : str
        Name used in messages.
    teeth : int
        Number of teeth, positive also for an internal gear.
    normal_module : float
        m.
    normal_pressure_angle : float
        rad.
    helix_angle : float
        At the reference circle, rad; positive right hand, negative left hand, zero spur.
    profile_shift : float
        Profile shift coefficient, in *normal* modules. Positive is away from the axis for both kinds:
        it thickens an external tooth, and gives an internal gear the tooth spaces of an external gear
        of the same shift.
    face_width : float
        m.
    held_diameter : float
        Diameter of the cylinder held in the FE model, m: the hub of an external gear, the outside of an
        internal one.
    internal : bool
        Whether the teeth point inwards.
    rack : BasicRack
        Basic rack in normal modules.
    tip_diameter : float, optional
        m; from the rack and the profile shift if not given.
    root_diameter : float, optional
        m; if given, it replaces the dedendum of the rack.
    tooth_thinning : float
        Reduction of the transverse tooth thickness at the reference circle, m: this gear's part of the
        backlash.
    material : Material
        Elastic constants and density.

    Raises
    ------
    GeometryError
        If a value makes no sense, the tip is thinner than 0.2 normal modules, the flank is undercut, or the
        root fillet does not fit.

    Examples
    --------
    >>> gear = Gear(name="pinion", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)
    >>> round(1e3 * gear.base_radius, 6), round(1e3 * gear.tip_radius, 6)
    (70.476947, 78.0)
    """

    name: str
    teeth: int
    normal_module: float
    normal_pressure_angle: float = math.radians(20.0)
    helix_angle: float = 0.0
    profile_shift: float = 0.0
    face_width: float
    held_diameter: float
    internal: bool = False
    rack: BasicRack = BasicRack()
    tip_diameter: float | None = None
    root_diameter: float | None = None
    tooth_thinning: float = 0.0
    material: Material = Material()

    def __post_init__(self) -> None:
        """Refuse what cannot be made."""
        check_gear(self)

    @property
    def outward(self) -> int:
        """Direction in which the teeth point: +1 away from the axis, -1 towards it."""
        return -1 if self.internal else 1

    @property
    def hand(self) -> Literal["right", "left", "spur"]:
        """Hand of the helix."""
        if self.helix_angle == 0.0:
            return "spur"
        return "right" if self.helix_angle > 0.0 else "left"

    @property
    def transverse_module(self) -> float:
        """Module in the transverse section, m."""
        return self.normal_module / math.cos(self.helix_angle)

    @property
    def transverse_pressure_angle(self) -> float:
        """Pressure angle at the reference circle in the transverse section, rad."""
        return math.atan(math.tan(self.normal_pressure_angle) / math.cos(self.helix_angle))

    @property
    def base_helix_angle(self) -> float:
        """Helix angle at the base cylinder, rad, signed like `helix_angle`."""
        return math.asin(math.sin(self.helix_angle) * math.cos(self.normal_pressure_angle))

    @property
    def reference_radius(self) -> float:
        """Radius of the reference circle, m."""
        return 0.5 * self.teeth * self.transverse_module

    @property
    def base_radius(self) -> float:
        """Radius of the base circle, m."""
        return self.reference_radius * math.cos(self.transverse_pressure_angle)

    @property
    def tip_radius(self) -> float:
        """Radius of the tip circle, m."""
        if self.tip_diameter is not None:
            return 0.5 * self.tip_diameter
        height = self.profile_shift + self.outward * self.rack.addendum
        return self.reference_radius + self.normal_module * height

    @property
    def root_radius(self) -> float:
        """Radius of the root circle, m."""
        if self.root_diameter is not None:
            return 0.5 * self.root_diameter
        depth = self.outward * self.rack.dedendum - self.profile_shift
        return self.reference_radius - self.normal_module * depth

    @property
    def dedendum_factor(self) -> float:
        """Dedendum of the rack that reaches the root circle, in normal modules (ISO 21771: h_fP*)."""
        depth = self.reference_radius + self.normal_module * self.profile_shift - self.root_radius
        return self.outward * depth / self.normal_module

    @property
    def angular_pitch(self) -> float:
        """Angle between neighbouring teeth, rad."""
        return 2.0 * math.pi / self.teeth

    @property
    def transverse_base_pitch(self) -> float:
        """Distance of neighbouring flanks along the transverse line of action, m."""
        return self.angular_pitch * self.base_radius

    @property
    def reference_half_angle(self) -> float:
        """Polar half angle of the tooth at the reference circle, rad."""
        shift = 2.0 * self.outward * self.profile_shift * math.tan(self.normal_pressure_angle)
        return (0.5 * math.pi + shift - self.tooth_thinning / self.transverse_module) / self.teeth

    @property
    def tip_thickness(self) -> float:
        """Tooth thickness at the tip circle in the normal section, m."""
        helix_angle = math.atan(self.tip_radius / self.reference_radius * math.tan(self.helix_angle))
        return 2.0 * self.tip_radius * self.half_angle(self.tip_radius) * math.cos(helix_angle)

    @property
    def form_radius(self) -> float:
        """Radius at which the involute ends and the root fillet begins, m."""
        return math.hypot(self.base_radius, self.form_roll_length)

    @property
    def tip_roll_length(self) -> float:
        """Roll length of the tip circle, ``sqrt(r_a^2 - r_b^2)``, m."""
        return math.sqrt(self.tip_radius**2 - self.base_radius**2)

    @property
    def form_roll_length(self) -> float:
        """Roll length at which the involute meets the root fillet, m; negative if the flank is undercut.

        External: the last straight point of the generating rack, followed down the line of action.
        Internal: the centre of the fillet lies on the involute shifted by the fillet radius into the tooth
        space, which is an involute of the same base circle.
        """
        if self.internal:
            radius = self.fillet_radius
            return radius + math.sqrt((self.root_radius - radius) ** 2 - self.base_radius**2)
        straight = self.dedendum_factor - self.rack.tip_radius * (1.0 - math.sin(self.normal_pressure_angle))
        depth = (straight - self.profile_shift) * self.normal_module
        angle = self.transverse_pressure_angle
        return self.base_radius * math.tan(angle) - depth / math.sin(angle)

    @property
    def fillet_radius(self) -> float:
        """Radius of the rack tip that cuts the root fillet, or of an internal gear's fillet itself, m.

        The arc of an internal gear is no larger than the one that touches both flanks and the root circle.
        """
        radius = self.rack.tip_radius * self.normal_module
        if not self.internal or self._internal_fillet_centre_angle(radius) <= 0.5 * self.angular_pitch:
            return radius
        # The angle is a convex, growing function of the radius: Newton's method from above converges.
        for _ in range(50):
            profile_angle = math.acos(self.base_radius / (self.root_radius - radius))
            excess = self._internal_fillet_centre_angle(radius) - 0.5 * self.angular_pitch
            step = excess * self.base_radius / (1.0 - math.sin(profile_angle))
            radius -= step
            if step < 1e-15 * self.root_radius:
                break
        return radius

    @property
    def fillet_centre_angle(self) -> float:
        """Polar angle of the centre of an internal gear's root fillet, from the middle of the tooth, rad."""
        return min(self._internal_fillet_centre_angle(self.fillet_radius), 0.5 * self.angular_pitch)

    def _internal_fillet_centre_angle(self, radius: float) -> float:
        """Polar angle of the centre of the circle that touches the root circle and the involute."""
        return self.half_angle(self.root_radius - radius) + radius / self.base_radius

    @property
    def rack_tip_half_land(self) -> float:
        """Half width of the flat tip of the generating rack between its tip radii, normal section, m.

        Thinner teeth are cut by a rack whose teeth are wider by as much; zero is a full-fillet rack.
        """
        angle, rack = self.normal_pressure_angle, self.rack
        taper = (self.dedendum_factor - rack.tip_radius) * math.tan(angle) + rack.tip_radius / math.cos(angle)
        widening = 0.5 * self.tooth_thinning * math.cos(self.helix_angle)
        return self.normal_module * (0.25 * math.pi - taper) + widening

    @overload
    def half_angle(self, radius: float) -> float: ...

    @overload
    def half_angle(self, radius: Floats) -> Floats: ...

    def half_angle(self, radius: float | Floats) -> float | Floats:
        """Polar half angle of the tooth, bounded by its involutes, at a radius (ISO 21771).

        Parameters
        ----------
        radius : float or array
            m. There is no involute inside the base circle: the result is NaN there.

        Returns
        -------
        float or array
            rad; falls with the radius for external, grows for internal teeth. Thinning is included.
        """
        with np.errstate(invalid="ignore"):
            profile_angle = np.arccos(self.base_radius / np.asarray(radius, dtype=np.float64))
        fall = np.tan(profile_angle) - profile_angle - involute(self.transverse_pressure_angle)
        half_angle = self.reference_half_angle - self.outward * fall
        return half_angle if isinstance(radius, np.ndarray) else float(half_angle)

    def mirrored(self) -> Gear:
        """Return the gear with the other hand of helix."""
        return dataclasses.replace(self, helix_angle=-self.helix_angle)


@dataclass(frozen=True, kw_only=True)
class GearPair:
    """Two gears on parallel axes.

    Parameters
    ----------
    name : str
        Name used in messages.
    pinion : Gear
        The smaller gear, always external.
    gear : Gear
        The larger gear, external or internal.
    centre_distance : float
        Operating centre distance, m, positive also for an internal pair.

    Raises
    ------
    GeometryError
        If the gears do not fit each other, do not touch, or interfere.

    Notes
    -----
    Points of contact are told by ``xi``, the distance along the transverse line of action from the point
    where it touches the pinion's base circle: ``xi = r_b1 tan(alpha_1)``. A driving pinion moves the contact
    from `path_start` (tip of the gear) to `path_end` (tip of the pinion).

    Examples
    --------
    >>> wheel = {"normal_module": 3e-3, "face_width": 20e-3, "held_diameter": 100e-3}
    >>> first, second = Gear(name="1", teeth=50, **wheel), Gear(name="2", teeth=50, **wheel)
    >>> pair = GearPair(name="spur", pinion=first, gear=second, centre_distance=0.151)
    >>> round(math.degrees(pair.working_pressure_angle), 3), round(pair.transverse_contact_ratio, 3)
    (21.018, 1.432)
    >>> pair.with_centre_distance(0.149)
    Traceback (most recent call last):
        ...
    fe_ste.geometry.checks.GeometryError: gear pair 'spur': centre_distance = 149.0000 mm is too small: ...
    """

    name: str
    pinion: Gear
    gear: Gear
    centre_distance: float

    def __post_init__(self) -> None:
        """Refuse what cannot run."""
        check_gear_pair(self)

    @property
    def _signed_teeth_sum(self) -> int:
        """z1 + z2, an internal gear's teeth counted negative as in ISO 21771."""
        return self.pinion.teeth + (-self.gear.teeth if self.gear.internal else self.gear.teeth)

    @property
    def ratio(self) -> float:
        """Tooth number ratio z2/z1."""
        return self.gear.teeth / self.pinion.teeth

    @property
    def face_width(self) -> float:
        """Common face width, m."""
        return min(self.pinion.face_width, self.gear.face_width)

    @property
    def reference_centre_distance(self) -> float:
        """Centre distance at which the reference circles touch, m."""
        return abs(self._signed_teeth_sum) * self.pinion.transverse_module / 2.0

    @property
    def backlash_free_centre_distance(self) -> float:
        """Centre distance without backlash, m: the least of an external pair, the greatest of an internal."""
        pinion, gear = self.pinion, self.gear
        thickness = pinion.teeth * pinion.reference_half_angle + gear.teeth * gear.reference_half_angle
        angle = pinion.transverse_pressure_angle
        value = involute(angle) + (thickness - math.pi) / self._signed_teeth_sum
        working_angle = inverse_involute(max(value, 0.0))
        return self.reference_centre_distance * math.cos(angle) / math.cos(working_angle)

    @property
    def working_pressure_angle(self) -> float:
        """Transverse pressure angle at the working circles, rad."""
        base = self.reference_centre_distance * math.cos(self.pinion.transverse_pressure_angle)
        return math.acos(base / self.centre_distance)

    def working_radius(self, gear: Gear) -> float:
        """Radius of the working circle of either gear of the pair, m."""
        return self.centre_distance * gear.teeth / abs(self._signed_teeth_sum)

    @property
    def pinion_working_radius(self) -> float:
        """Radius of the pinion's working circle, m."""
        return self.working_radius(self.pinion)

    @property
    def gear_working_radius(self) -> float:
        """Radius of the gear's working circle, m."""
        return self.working_radius(self.gear)

    @property
    def working_helix_angle(self) -> float:
        """Helix angle at the working circle, rad, signed as the pinion's."""
        scale = self.pinion_working_radius / self.pinion.reference_radius
        return math.atan(scale * math.tan(self.pinion.helix_angle))

    @property
    def transverse_base_pitch(self) -> float:
        """Distance of neighbouring contacts along the transverse line of action, m."""
        return self.pinion.transverse_base_pitch

    @property
    def base_tangent_length(self) -> float:
        """Length ``a sin(alpha_wt)`` of the line of action from base circle to base circle, m."""
        return self.centre_distance * math.sin(self.working_pressure_angle)

    def pinion_roll_length(self, gear_roll_length: float) -> float:
        """Roll length on the pinion of the point that touches the gear at a given roll length.

        Parameters
        ----------
        gear_roll_length : float
            ``r_b2 tan(alpha_2)``, m.

        Returns
        -------
        float
            ``r_b1 tan(alpha_1)``, m.
        """
        if self.gear.internal:
            return gear_roll_length - self.base_tangent_length
        return self.base_tangent_length - gear_roll_length

    @property
    def path_pitch_point(self) -> float:
        """Coordinate xi of the pitch point, m."""
        return self.pinion.base_radius * math.tan(self.working_pressure_angle)

    @property
    def path_start(self) -> float:
        """Coordinate xi of the end of the path of contact set by the gear's tip, m."""
        return max(self.pinion_roll_length(self.gear.tip_roll_length), self.pinion.form_roll_length)

    @property
    def path_end(self) -> float:
        """Coordinate xi of the end of the path of contact set by the pinion's tip, m."""
        return min(self.pinion.tip_roll_length, self.pinion_roll_length(self.gear.form_roll_length))

    @property
    def transverse_contact_ratio(self) -> float:
        """Length of the path of contact in transverse base pitches."""
        return (self.path_end - self.path_start) / self.transverse_base_pitch

    @property
    def overlap_ratio(self) -> float:
        """Common face width in axial pitches."""
        axial = math.sin(abs(self.pinion.helix_angle)) / (math.pi * self.pinion.normal_module)
        return self.face_width * axial

    @property
    def total_contact_ratio(self) -> float:
        """Sum of transverse contact ratio and overlap ratio."""
        return self.transverse_contact_ratio + self.overlap_ratio

    @property
    def pinion_tip_clearance(self) -> float:
        """Distance of the pinion's tip circle from the gear's root circle on the line of centres, m."""
        return self.gear.outward * (self.centre_distance - self.gear.root_radius) - self.pinion.tip_radius

    @property
    def gear_tip_clearance(self) -> float:
        """Distance of the gear's tip circle from the pinion's root circle on the line of centres, m."""
        return self.gear.outward * (self.centre_distance - self.gear.tip_radius) - self.pinion.root_radius

    @property
    def circumferential_backlash(self) -> float:
        """Play between the back flanks along the working circles, transverse section, m."""
        r_1, r_2 = self.pinion_working_radius, self.gear_working_radius
        thickness = 2.0 * (r_1 * self.pinion.half_angle(r_1) + r_2 * self.gear.half_angle(r_2))
        return self.pinion.angular_pitch * r_1 - thickness

    def with_centre_distance(self, centre_distance: float) -> GearPair:
        """Return the same gears at another operating centre distance, m."""
        return dataclasses.replace(self, centre_distance=centre_distance)

    def mirrored(self) -> GearPair:
        """Return the pair with the hands of both helices swapped."""
        return dataclasses.replace(self, pinion=self.pinion.mirrored(), gear=self.gear.mirrored())
