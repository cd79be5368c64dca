"""Where flanks meet: frame, signs and the gap between rigid flanks over the plane of action.

Frame. Gear 1 turns counter-clockwise and drives. The x axis runs from its centre to the pitch point, z along the
axes, z = 0 in the middle of the common face width. An external gear 2 stands at +x, an internal one at -x. The flanks
in contact are the counter-clockwise flanks of gear 1 and of an external gear 2, and the clockwise flanks of an
internal gear 2's teeth. Tooth pair 0 touches at the pitch point for rotation 0; pair j is j base pitches ahead on the
path of contact.

Signs. The position in the mesh cycle (pmc) is the part of a pitch by which gear 1 has turned in its driving sense from
rotation 0. Gear 1 is held, gear 2 turns about its axis under a torque that presses its flank on gear 1. The approach
and the static transmission error are that rotation as a length, from the position in which the unmodified rigid
flanks would roll: positive, the loaded gear yields. Approach and gap are lengths on the contact normal, the
transmission error on the transverse line of action, which is longer by 1 / cos(beta_b). A gap is positive where the
flanks stand apart. Misalignment (rad) is the rotation of the axes against each other in the plane of action, positive
where it opens the gap at the +z end.

Involutes. A point of a flank is told by its roll angle tan(alpha), alpha the profile angle at its radius r:
r = r_b sqrt(1 + tan(alpha)^2), and its polar angle falls with inv(alpha) = tan(alpha) - alpha (ISO 21771).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fe_ste.geometry.gears import GearPair
from fe_ste.tools.compilation import compiled


class ContactError(RuntimeError):
    """A contact position that could not be solved; the message says why."""


class FlankPair(NamedTuple):
    """Numbers of the rigid kinematics of two conjugate flanks; lengths in m, angles in rad."""

    base_radius_1: float
    base_radius_2: float
    centre_distance: float
    working_involute: float
    working_roll: float
    pitch_1: float
    pitch_2: float
    twist_1: float
    twist_2: float
    base_helix_cosine: float
    kind: float  # +1 external pair, -1 internal pair
    form_roll_1: float
    tip_roll_1: float
    tip_radius_2: float
    root_radius_2: float  # of the circle that ends contact towards the root of gear 2; 0 or infinite for none

    @classmethod
    def from_pair(cls, pair: GearPair, form_roll: float, tip_roll: float) -> FlankPair:
        """Collect the numbers of `pair`; `form_roll` and `tip_roll` bound the flank of gear 1.

        Where a flank ends in an edge, at a chamfer of the tip or at a relieved root, contact ends there as well.
        """
        pinion = pair.pinion
        gear = pair.gear
        working_angle = pair.working_pressure_angle
        inner_radius_2 = math.inf if gear.internal else 0.0
        return cls(
            base_radius_1=pinion.base_radius,
            base_radius_2=gear.base_radius,
            centre_distance=pair.centre_distance,
            working_involute=math.tan(working_angle) - working_angle,
            working_roll=math.tan(working_angle),
            pitch_1=pinion.angular_pitch,
            pitch_2=gear.angular_pitch,
            twist_1=math.tan(pinion.base_helix_angle) / pinion.base_radius,
            twist_2=math.tan(gear.base_helix_angle) / gear.base_radius,
            base_helix_cosine=math.cos(pinion.base_helix_angle),
            kind=-1.0 if gear.internal else 1.0,
            form_roll_1=max(form_roll, pinion.root_form_roll_length / pinion.base_radius)
            if pinion.has_relieved_root
            else form_roll,
            tip_roll_1=min(tip_roll, pinion.tip_form_roll_length / pinion.base_radius)
            if pinion.tip_form_diameter is not None
            else tip_roll,
            tip_radius_2=gear.tip_form_radius,
            root_radius_2=gear.root_form_radius if gear.has_relieved_root else inner_radius_2,
        )


@compiled
def _polar_on_gear_2(pair: FlankPair, roll: float, axial: float, tooth: int, rotation: float) -> tuple[float, float]:
    """Radius and polar angle, about the axis of gear 2, of a flank point of gear 1."""
    radius = pair.base_radius_1 * math.sqrt(1.0 + roll * roll)
    # Polar angle on gear 1: zero at the pitch point, inv(alpha_w) - inv(alpha) along the involute, with the helix.
    angle = pair.working_involute - (roll - math.atan(roll)) + rotation + tooth * pair.pitch_1 + pair.twist_1 * axial
    # Gear 2's own frame has its x axis towards the pitch point: for an external gear it is turned by pi.
    x = pair.centre_distance - pair.kind * radius * math.cos(angle)
    y = -pair.kind * radius * math.sin(angle)
    return math.sqrt(x * x + y * y), math.atan2(y, x)


@compiled
def rigid_gap(pair: FlankPair, roll: float, axial: float, tooth: int, rotation: float) -> tuple[float, float]:
    """Gap between a flank point of gear 1 and the unmodified flank of gear 2, along the contact normal.

    The gap is the arc by which gear 2 would have to turn to touch the point, as a length on the normal: exact, with
    the sides of the teeth, tip corners and centre distance as they are.

    Parameters
    ----------
    roll : roll angle of the point on gear 1, rad
    axial : its axial position, m
    tooth : tooth pair
    rotation : rotation of gear 1, rad; gear 2 is where it rolls with it

    Returns
    -------
    gap : m; infinite inside the base circle of gear 2
    gear_roll : roll angle on gear 2 at the point's radius, rad
    """
    radius, angle = _polar_on_gear_2(pair, roll, axial, tooth, rotation)
    # r = r_b sqrt(1 + roll^2), solved for the roll angle.
    square = (radius / pair.base_radius_2) ** 2 - 1.0
    if square <= 0.0:
        return math.inf, 0.0
    gear_roll = math.sqrt(square)
    # External gears turn against each other, an internal one with its pinion, in the ratio of the pitches.
    rolled = -pair.kind * (rotation * pair.pitch_2 / pair.pitch_1 + tooth * pair.pitch_2)
    flank = pair.working_involute - (gear_roll - math.atan(gear_roll)) + rolled + pair.twist_2 * axial
    # An angle times the base radius is a length on the transverse line of action; the normal leans by beta_b from it.
    return pair.kind * pair.base_radius_2 * (angle - flank) * pair.base_helix_cosine, gear_roll


@compiled
def circle_limit(pair: FlankPair, radius: float, axial: float, tooth: int, rotation: float) -> float:
    """Roll angle on gear 1 at a circle of gear 2, by bisection; within gear 1's flank.

    Of the tip circle it is the least that gear 2 reaches, of the circle that ends its flank at the root the largest.
    """
    low = pair.form_roll_1
    high = pair.tip_roll_1
    if pair.kind * (_polar_on_gear_2(pair, low, axial, tooth, rotation)[0] - radius) <= 0.0:
        return low
    if pair.kind * (_polar_on_gear_2(pair, high, axial, tooth, rotation)[0] - radius) >= 0.0:
        return high
    for _ in range(60):  # halves the interval down to rounding
        middle = 0.5 * (low + high)
        if pair.kind * (_polar_on_gear_2(pair, middle, axial, tooth, rotation)[0] - radius) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
