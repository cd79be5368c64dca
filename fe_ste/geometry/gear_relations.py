"""Macro geometry of one cylindrical gear: its inputs, and what follows from them by the relations of ISO 21771.

Nothing is refused here: the checks read radii and angles of an unchecked gear to report what is wrong with it.

External teeth get the fillet that a rack with a rounded tip generates (`fe_ste.geometry.involute`); internal teeth
that of their cutter (`fe_ste.geometry.involute`), or, without one, an arc that touches the flank and the root circle.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, overload

import numpy as np

from fe_ste.geometry.involute import CutterTipCut, PinionCutter, RackTipCut, cutting_distance, involute
from fe_ste.tools.arrays import Floats

ROUNDING = 1e-9
"""Rounding allowed for when lengths are compared, in normal modules."""
LATER_INPUTS = frozenset(("tip_form_diameter", "root_form_diameter", "common_face_width", "cutter"))
"""Inputs of gears and pairs that came after files with hashes of the others."""


def inputs_that_are_given(items: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """Return inputs without the later ones that nobody gave, so that hashes of older inputs stay as they were.

    For `dataclasses.asdict`, as its `dict_factory`.

    Examples
    --------
    >>> inputs_that_are_given([("teeth", 20), ("tip_diameter", None), ("tip_form_diameter", None)])
    {'teeth': 20, 'tip_diameter': None}
    """
    return {key: value for key, value in items if not (value is None and key in LATER_INPUTS)}


@dataclass(frozen=True)
class BasicRack:
    """Basic rack tooth profile (ISO 53), in normal modules."""

    addendum: float = 1.0
    """Addendum of the gear tooth, h_aP*."""
    dedendum: float = 1.25
    """Dedendum of the gear tooth, h_fP*."""
    tip_radius: float = 0.38
    """Tip radius of the generating rack, rho_fP*: fillet radius at the root of the basic rack."""


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic material."""

    youngs_modulus: float = 206e9
    """In Pa."""
    poissons_ratio: float = 0.3
    """Dimensionless."""
    density: float = 7850.0
    """kg/m^3."""


@dataclass(frozen=True, kw_only=True)
class GearInputs:
    """Inputs of a gear that may be impossible, with all that follows from them; for the inputs see `Gear`."""

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
    tip_form_diameter: float | None = None
    root_form_diameter: float | None = None
    cutter: PinionCutter | None = None

    @property
    def outward(self) -> int:
        """Direction in which the teeth point: +1 away from the axis, -1 towards it."""
        if self.internal:
            return -1
        return 1

    @property
    def hand(self) -> Literal["right", "left", "spur"]:
        """Hand of the helix."""
        if self.helix_angle == 0.0:
            return "spur"
        if self.helix_angle > 0.0:
            return "right"
        return "left"

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
        if self.cutter is not None and self.cutter.tip_diameter is not None:
            return self.cutting_distance + 0.5 * self.cutter.tip_diameter
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
    def normal_tooth_thickness(self) -> float:
        """Tooth thickness on the reference circle in the normal section, m (ISO 21771: s_n less the thinning)."""
        return 2.0 * self.reference_radius * self.reference_half_angle * math.cos(self.helix_angle)

    @property
    def usual_span(self) -> int:
        """Number of teeth over which `span_measurement` touches external flanks nearest to their middle."""
        middle = self.reference_radius + self.normal_module * self.profile_shift
        # The planes touch the flanks half a span away from the axis, along normals at the base helix angle: seen along
        # the axis that is W_k cos(beta_b) / 2 on the tangent of the base circle.
        half_length = math.sqrt(max(middle**2 - self.base_radius**2, 0.0)) / math.cos(self.base_helix_angle)
        pitch = self.transverse_base_pitch * math.cos(self.base_helix_angle)
        return max(2, round((2.0 * half_length - self.span_measurement(0)) / pitch))

    def span_measurement(self, teeth: int) -> float:
        """Distance of parallel planes that touch opposite external flanks, m (ISO 21771: base tangent length W_k).

        The base pitches between the teeth and the thickness of one at the base circle, normal to the flanks.

        Parameters
        ----------
        teeth : how many are between the planes, k
        """
        thickness = 2.0 * self.base_radius * self.half_angle(self.base_radius)
        return ((teeth - 1) * self.transverse_base_pitch + thickness) * math.cos(self.base_helix_angle)

    def span_contact_radius(self, teeth: int) -> float:
        """Radius at which the planes of `span_measurement` touch the flanks, m (DIN 3960: d_M / 2)."""
        tangent = 0.5 * self.span_measurement(teeth) * math.cos(self.base_helix_angle)
        return math.hypot(self.base_radius, tangent)

    def span_face_width(self, teeth: int) -> float:
        """Face width above which both planes of `span_measurement` find the flanks of a helical gear, m.

        The normals of the flanks lean by the base helix angle, so that one plane touches that far along the axis
        from the other.
        """
        return self.span_measurement(teeth) * abs(math.sin(self.base_helix_angle))

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
    def tip_form_radius(self) -> float:
        """Radius at which a chamfer or rounding of the tip ends the flank (ISO 21771: d_Fa / 2), m."""
        if self.tip_form_diameter is None:
            return self.tip_radius
        return 0.5 * self.tip_form_diameter

    @property
    def root_form_radius(self) -> float:
        """Radius at which the flank ends towards the root (ISO 21771: d_Ff / 2), m.

        The one that is given, where a tool with protuberance or a grinding wheel ends the flank before the fillet
        that is modelled does.
        """
        given = self.form_radius if self.root_form_diameter is None else 0.5 * self.root_form_diameter
        return self.outward * max(self.outward * given, self.outward * self.form_radius)

    @property
    def tip_form_roll_length(self) -> float:
        """Roll length at `tip_form_radius`, m."""
        if self.tip_form_diameter is None:
            return self.tip_roll_length
        return math.sqrt(self.tip_form_radius**2 - self.base_radius**2)

    @property
    def root_form_roll_length(self) -> float:
        """Roll length at `root_form_radius`, m."""
        if self.root_form_diameter is None:
            return self.form_roll_length
        return math.sqrt(max(self.root_form_radius**2 - self.base_radius**2, 0.0))

    @property
    def has_relieved_root(self) -> bool:
        """Whether the flank ends in an edge towards the root, beyond which a mate's tip is free."""
        return self.is_undercut or (self.root_form_radius - self.form_radius) * self.outward > 0.0

    @property
    def is_undercut(self) -> bool:
        """Whether the tip of the generating rack cuts back into the involute."""
        return not self.internal and self.generated_roll_length < -ROUNDING * self.normal_module

    @cached_property
    def form_roll_length(self) -> float:
        """Roll length at which the involute meets the root fillet, m.

        External: where the generating rack's straight flank ends, or where its tip has cut the involute away.
        Internal: where the involute of the cutter ends. Without one the centre of the fillet lies on the involute
        shifted by the fillet radius into the tooth space, which is an involute of the same base circle.
        """
        if self.internal and self.cutter is not None:
            return self.cutter_tip_cut.form_roll_length
        if self.internal:
            radius = self.fillet_radius
            return radius + math.sqrt((self.root_radius - radius) ** 2 - self.base_radius**2)
        if not self.is_undercut:
            return max(self.generated_roll_length, 0.0)
        radius = self.rack_tip_cut.polar(np.array([self.fillet_start]))[0].item()
        return math.sqrt(max(radius**2 - self.base_radius**2, 0.0))

    @property
    def fillet_start(self) -> float:
        """Parameter of `rack_tip_cut` at which the fillet of an external gear begins: above 0 on an undercut tooth."""
        if self.is_undercut:
            return self.rack_tip_cut.undercut_parameter
        return 0.0

    @cached_property
    def rack_tip_cut(self) -> RackTipCut:
        """Curve that the rounded tip of the generating rack cuts into the root of an external gear."""
        return RackTipCut(
            reference_radius=self.reference_radius,
            base_radius=self.base_radius,
            root_radius=self.root_radius,
            half_pitch_angle=0.5 * self.angular_pitch,
            base_half_angle=self.half_angle(self.base_radius),
            pressure_angle=self.normal_pressure_angle,
            helix_angle=self.helix_angle,
            rounding=self.fillet_radius,
            half_land=self.rack_tip_half_land,
        )

    @property
    def cutting_distance(self) -> float:
        """Centre distance at which the cutter generates an internal gear, m; NaN if there is no cutter or distance."""
        if self.cutter is None:
            return math.nan
        thickness = 0.5 * math.pi + 2.0 * self.cutter.profile_shift * math.tan(self.normal_pressure_angle)
        thickness += self.teeth * self.reference_half_angle
        return cutting_distance(
            self.teeth, self.cutter.teeth, thickness, self.transverse_pressure_angle, self.transverse_module
        )

    @cached_property
    def cutter_tip_cut(self) -> CutterTipCut:
        """Curve that the rounded tip of its cutter cuts into the root of an internal gear."""
        assert self.cutter is not None
        ratio = self.cutter.teeth / self.teeth
        half_angle = 0.5 * math.pi + 2.0 * self.cutter.profile_shift * math.tan(self.normal_pressure_angle)
        return CutterTipCut(
            base_radius=self.base_radius,
            cutter_base_radius=ratio * self.base_radius,
            centre_distance=self.cutting_distance,
            cutter_tip_radius=self.root_radius - self.cutting_distance,
            rounding=self.cutter.tip_radius * self.normal_module,
            cutter_base_half_angle=half_angle / self.cutter.teeth + involute(self.transverse_pressure_angle),
            half_pitch_angle=0.5 * self.angular_pitch,
        )

    @property
    def generated_roll_length(self) -> float:
        """Roll length down to which the straight flank of the generating rack cuts, m; negative where that undercuts.

        The last straight point of the rack, followed down the line of action.
        """
        straight = self.dedendum_factor - self.rack.tip_radius * (1.0 - math.sin(self.normal_pressure_angle))
        depth = (straight - self.profile_shift) * self.normal_module
        angle = self.transverse_pressure_angle
        return self.base_radius * math.tan(angle) - depth / math.sin(angle)

    @cached_property
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
        angle = self.normal_pressure_angle
        rack = self.rack
        taper = (self.dedendum_factor - rack.tip_radius) * math.tan(angle) + rack.tip_radius / math.cos(angle)
        widening = 0.5 * self.tooth_thinning * math.cos(self.helix_angle)
        return self.normal_module * (0.25 * math.pi - taper) + widening

    @property
    def largest_rack_rounding(self) -> float:
        """Largest radius that fits on the tip of the generating rack, in normal modules; negative on a pointed one."""
        angle = self.normal_pressure_angle
        growth = 1.0 / math.cos(angle) - math.tan(angle)
        return self.rack.tip_radius + self.rack_tip_half_land / self.normal_module / growth

    @overload
    def half_angle(self, radius: float) -> float: ...

    @overload
    def half_angle(self, radius: Floats) -> Floats: ...

    def half_angle(self, radius: float | Floats) -> float | Floats:
        """Polar half angle of the tooth, bounded by its involutes, at a radius (ISO 21771).

        Parameters
        ----------
        radius : m. There is no involute inside the base circle: the result is NaN there.

        Returns
        -------
        rad; falls with the radius for external, grows for internal teeth. Thinning is included.
        """
        with np.errstate(invalid="ignore"):
            profile_angle = np.arccos(self.base_radius / np.asarray(radius, dtype=np.float64))
        fall = np.tan(profile_angle) - profile_angle - involute(self.transverse_pressure_angle)
        half_angle = self.reference_half_angle - self.outward * fall
        return half_angle if isinstance(radius, np.ndarray) else float(half_angle)


# Root fillet of a tooth in the transverse section


def root_fillet(gear: GearInputs, parameter: Floats) -> Floats:
    """Points of the fillet on the counter-clockwise side of a tooth centred on the +x axis.

    Parameters
    ----------
    gear : the gear
    parameter : (n,) 0 at the root form diameter, exactly on the involute, to 1 at the root circle

    Returns
    -------
    (n, 2) x, y in m
    """
    if not gear.internal:
        start = gear.fillet_start
        return cartesian(*gear.rack_tip_cut.polar(start + parameter * (1.0 - start)))
    if gear.cutter is not None:
        return cartesian(*gear.cutter_tip_cut.polar(parameter))
    # The arc that touches the flank (0) and the root circle (1) of an internal gear.
    radius = gear.fillet_radius
    centre_angle = gear.fillet_centre_angle
    centre = (gear.root_radius - radius) * np.array([math.cos(centre_angle), math.sin(centre_angle)])
    form_angle = gear.half_angle(gear.form_radius)
    # The normal of an involute is tangent to the base circle, hence at right angles to the base radius that
    # stands off by the profile angle.
    profile_angle = math.acos(gear.base_radius / gear.form_radius)
    begin = form_angle + profile_angle - 0.5 * math.pi
    direction = begin + parameter * (centre_angle - begin)
    return centre + radius * np.column_stack((np.cos(direction), np.sin(direction)))


def cartesian(radius: Floats, angle: Floats) -> Floats:
    """Columns x, y of points given by radius and polar angle."""
    return np.column_stack((radius * np.cos(angle), radius * np.sin(angle)))
