"""Macro geometry of two gears in mesh: working angles, path of contact, contact ratios, backlash (ISO 21771).

Nothing is refused here, as in `fe_ste.geometry.gear_relations`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from fe_ste.geometry.gear_relations import GearInputs, root_fillet
from fe_ste.geometry.involute import inverse_involute, involute


@dataclass(frozen=True, kw_only=True)
class UncheckedPair:
    """Two gears that may not fit, with all that follows for their mesh; for the inputs see `GearPair`."""

    name: str
    pinion: GearInputs
    gear: GearInputs
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
        """Centre distance without backlash, m: the minimum of an external pair, the maximum of an internal one."""
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

    def working_radius(self, gear: GearInputs) -> float:
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
        """Normal backlash between the back flanks, m (ISO 21771: j_bn)."""
        across = math.cos(self.working_pressure_angle) * math.cos(self.pinion.base_helix_angle)
        return self.circumferential_backlash * across

    @property
    def circumferential_backlash(self) -> float:
        """Circumferential backlash along the working circles, transverse section, m."""
        r_1 = self.pinion_working_radius
        r_2 = self.gear_working_radius
        thickness = 2.0 * (r_1 * self.pinion.half_angle(r_1) + r_2 * self.gear.half_angle(r_2))
        return self.pinion.angular_pitch * r_1 - thickness


# Clearance of tip corners from the root fillet of the mating gear

FILLET_TOLERANCE = 1e-5
"""Error of the fillet as a polygon when a tip corner is led past it, in normal modules."""


def corner_to_fillet_gap(pair: UncheckedPair, tip: GearInputs, mate: GearInputs) -> float:
    """Return the minimum gap between the path of a tip's corners and the root fillet of the mating gear.

    The corner leaves the line of action at the end of the path of contact and goes deeper than there. The flanks are
    assumed in contact, as on the path of contact. A chamfer has two corners, at the tip form diameter and, as far from
    the flank as it is high, at the tip circle.

    Parameters
    ----------
    pair : the pair
    tip, mate : gear whose tip corner moves, gear whose fillet it passes

    Returns
    -------
    float
        Arc about the axis of the mating gear, m; negative if the corner cuts into the fillet, infinite if it does not
        get below the root form diameter.
    """
    corners = [(tip.tip_form_radius, tip.half_angle(tip.tip_form_radius))]
    chamfer = abs(tip.tip_radius - tip.tip_form_radius)
    if chamfer > 0.0:
        corners.append((tip.tip_radius, corners[0][1] - chamfer / tip.tip_radius))
    return min(_corner_gap(pair, tip, mate, *corner) for corner in corners)


def _corner_gap(
    pair: UncheckedPair, tip: GearInputs, mate: GearInputs, radius: float, half_angle_of_corner: float
) -> float:
    distance = pair.centre_distance
    # Origin on the tip's axis, x along the line of centres to the pitch point; x as the mate sees it is
    # to_mate * distance + turn * x.
    to_mate = -1.0 if tip.internal else 1.0
    turn = -float(pair.gear.outward)
    cosine = to_mate * turn * (mate.form_radius**2 - distance**2 - radius**2) / (2.0 * distance * radius)
    if cosine >= 1.0:
        return math.inf
    corner = np.linspace(-1.0, 1.0, 1001) * math.acos(max(cosine, -1.0))
    x = to_mate * distance + turn * radius * np.cos(corner)
    y = radius * np.sin(corner)
    seen_radius = np.hypot(x, y)
    seen_angle = np.arctan2(y, x)
    # The flanks touch at the pitch point at rotation zero.
    rotation = corner - half_angle_of_corner + tip.half_angle(pair.working_radius(tip))
    mate_tooth = mate.half_angle(pair.working_radius(mate)) + rotation * tip.teeth / mate.teeth
    fillet = root_fillet(mate, np.linspace(0.0, 1.0, 2001))[:: -mate.outward]
    half_angle = np.interp(seen_radius, np.hypot(*fillet.T), np.arctan2(fillet[:, 1], fillet[:, 0]))
    return float(np.min(seen_radius * (mate_tooth - half_angle - seen_angle)))


# Inputs that follow from the mating gear: profile shift from the centre distance, shortened tip

ROOT_MARGIN = 0.1
"""Roll length between an automatically shortened tip and the root form diameter of the mating gear, in normal modules:
the width of the contact under load reaches beyond the path of contact."""
LEAST_ROOT_MARGIN = 0.03
"""Roll length below which contact under usual loads reaches the root form diameter, in normal modules."""
LEAST_CLEARANCE = 0.1
"""Tip clearance that a fitted tip keeps at least, in normal modules."""


def shift_sum(one: GearInputs, other: GearInputs, centre_distance: float) -> float | None:
    """Profile shifts that leave no backlash at a centre distance: x1 + x2, of an internal pair x1 - x2.

    ISO 21771: sum = (z1 + z2) (inv alpha_wt - inv alpha_t) / (2 tan alpha_n), teeth of a ring negative.

    Parameters
    ----------
    one, other : the pair; of an internal one in either order
    centre_distance : m

    Returns
    -------
    in normal modules; None if no line of action touches both base circles at this distance

    Examples
    --------
    >>> gear = GearInputs(name="", teeth=25, normal_module=4e-3, face_width=20e-3, held_diameter=50e-3)
    >>> round(shift_sum(gear, gear, 102e-3), 4)
    0.5354
    """
    teeth = sum(-gear.teeth if gear.internal else gear.teeth for gear in (one, other))
    transverse = one.transverse_pressure_angle
    cosine = abs(teeth) * one.transverse_module * math.cos(transverse) / (2.0 * centre_distance)
    if not 0.0 < cosine < 1.0:
        return None
    return teeth * (involute(math.acos(cosine)) - involute(transverse)) / (2.0 * math.tan(one.normal_pressure_angle))


def shift_beside(mate: GearInputs, gear: GearInputs, centre_distance: float) -> float | None:
    """Profile shift of a gear for zero backlash with its mating gear; None if there is none."""
    total = shift_sum(gear, mate, centre_distance)
    if total is None:
        return None
    if gear.internal:
        return mate.profile_shift - total
    if mate.internal:
        return total + mate.profile_shift
    return total - mate.profile_shift


def root_margin(pair: UncheckedPair, tip: GearInputs) -> float:
    """Roll length, m, of the tip above the form diameter of the mating root; infinite above a relieved root."""
    if (pair.pinion if tip is pair.gear else pair.gear).has_relieved_root:
        return math.inf
    if tip is pair.gear:
        return pair.pinion_roll_length(tip.tip_form_roll_length) - pair.pinion.form_roll_length
    return pair.pinion_roll_length(pair.gear.form_roll_length) - tip.tip_form_roll_length


def clear_tip_diameter(pair: UncheckedPair, tip: GearInputs, margin: float) -> float:
    """Tip diameter, m, that keeps a roll length (m) above the form diameter of the mating root; unchanged if it does.

    The height of a chamfer is unchanged.
    """
    lacking = margin - root_margin(pair, tip)
    if lacking <= 0.0:
        return 2.0 * tip.tip_radius
    roll = max(tip.tip_form_roll_length - tip.outward * lacking, 0.0)
    chamfer = tip.tip_radius - tip.tip_form_radius
    return 2.0 * (math.hypot(tip.base_radius, roll) + chamfer)


def fitted_tip_diameter(pair: UncheckedPair, tip: GearInputs) -> float:
    """Tip diameter, m, shortened for the mating gear: the clearance of the rack, and clearance above the fillet.

    ISO 21771 calls the shortening of the tip that keeps the clearance at profile shifts the tip alteration k m_n.
    """
    mate = pair.pinion if tip is pair.gear else pair.gear
    module = tip.normal_module
    clearance = module * max(mate.dedendum_factor - tip.rack.addendum, LEAST_CLEARANCE)
    inner = tip.internal or mate.internal
    # External pair: r_a + c + r_f = a. A ring's root lies outside its pinion's tip, a pinion's root inside a ring's.
    if not inner:
        bound = pair.centre_distance - mate.root_radius - clearance
    elif tip.internal:
        bound = pair.centre_distance + mate.root_radius + clearance
    else:
        bound = mate.root_radius - pair.centre_distance - clearance
    clear = 0.5 * clear_tip_diameter(pair, tip, ROOT_MARGIN * module)
    pick = max if tip.internal else min
    fitted = 2.0 * pick(tip.tip_radius, bound, clear)
    shorter = with_tip_diameter(tip, fitted)
    beside = _with_gear(pair, tip, shorter)
    if corner_to_fillet_gap(beside, shorter, mate) >= -FILLET_TOLERANCE * module:
        return fitted
    return corner_clear_tip_diameter(beside, shorter) or fitted


def with_tip_diameter(gear: GearInputs, diameter: float) -> GearInputs:
    """Return a gear with another tip diameter (m), unchecked; a chamfer keeps its height."""
    inputs = {field.name: getattr(gear, field.name) for field in fields(GearInputs)}
    if gear.tip_form_diameter is not None:
        inputs["tip_form_diameter"] = gear.tip_form_diameter + diameter - 2.0 * gear.tip_radius
    return GearInputs(**inputs | {"tip_diameter": diameter})


def _with_gear(pair: UncheckedPair, before: GearInputs, after: GearInputs) -> UncheckedPair:
    """Return the pair with one of its gears replaced; unchecked, whatever the pair was."""
    first, second = (after if gear is before else gear for gear in (pair.pinion, pair.gear))
    return UncheckedPair(
        name=pair.name,
        pinion=first,
        gear=second,
        centre_distance=pair.centre_distance,
        common_face_width=pair.common_face_width,
    )


def corner_clear_tip_diameter(pair: UncheckedPair, tip: GearInputs) -> float | None:
    """Tip diameter, m, at which the corners of a gear clear the fillet of the mating gear.

    The smallest sufficient change, rounded to hundredths of a millimetre towards clearance; None where the tooth would
    have to end at its working circle.
    """
    mate = pair.pinion if tip is pair.gear else pair.gear

    def is_clear(diameter: float) -> bool:
        changed = with_tip_diameter(tip, diameter)
        return corner_to_fillet_gap(_with_gear(pair, tip, changed), changed, mate) >= 0.0

    cutting = 2.0 * tip.tip_radius
    clear = 2.0 * pair.working_radius(tip)
    if (cutting - clear) * tip.outward <= 0.0 or not is_clear(clear):
        return None
    while abs(clear - cutting) > 1e-7:
        middle = 0.5 * (cutting + clear)
        if is_clear(middle):
            clear = middle
        else:
            cutting = middle
    return 1e-5 * tip.outward * math.floor(1e5 * tip.outward * clear)
