"""Macro geometry of two gears in mesh: working angles, path of contact, contact ratios, backlash (ISO 21771).

Nothing is refused here, as in `fe_ste.geometry.gear_relations`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from fe_ste.geometry.gear_relations import UncheckedGear
from fe_ste.geometry.involute import inverse_involute, involute


@dataclass(frozen=True, kw_only=True)
class UncheckedPair:
    """Two gears that may not fit, with all that follows for their mesh; for the inputs see `GearPair`."""

    name: str
    pinion: UncheckedGear
    gear: UncheckedGear
    centre_distance: float
    common_face_width: float | None = None

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
        """Common face width, m: that which is given, else that of the narrower gear."""
        if self.common_face_width is not None:
            return self.common_face_width
        return min(self.pinion.face_width, self.gear.face_width)

    @property
    def reference_centre_distance(self) -> float:
        """Centre distance at which the reference circles touch, m."""
        return abs(self._signed_teeth_sum) * self.pinion.transverse_module / 2.0

    @property
    def backlash_free_centre_distance(self) -> float:
        """Centre distance without backlash, m: the least of an external pair, the greatest of an internal."""
        pinion = self.pinion
        gear = self.gear
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

    def working_radius(self, gear: UncheckedGear) -> float:
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
        gear_roll_length : ``r_b2 tan(alpha_2)``, m

        Returns
        -------
        ``r_b1 tan(alpha_1)``, m
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
        return max(self.pinion_roll_length(self.gear.tip_form_roll_length), self.pinion.root_form_roll_length)

    @property
    def path_end(self) -> float:
        """Coordinate xi of the end of the path of contact set by the pinion's tip, m."""
        return min(self.pinion.tip_form_roll_length, self.pinion_roll_length(self.gear.root_form_roll_length))

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
    def normal_backlash(self) -> float:
        """Play between the back flanks along their normal, m (ISO 21771: j_bn)."""
        across = math.cos(self.working_pressure_angle) * math.cos(self.pinion.base_helix_angle)
        return self.circumferential_backlash * across

    @property
    def circumferential_backlash(self) -> float:
        """Play between the back flanks along the working circles, transverse section, m."""
        r_1 = self.pinion_working_radius
        r_2 = self.gear_working_radius
        thickness = 2.0 * (r_1 * self.pinion.half_angle(r_1) + r_2 * self.gear.half_angle(r_2))
        return self.pinion.angular_pitch * r_1 - thickness
