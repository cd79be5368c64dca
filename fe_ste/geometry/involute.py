"""The involute, and what tools leave at its root: trochoids of racks and of pinion-type cutters.

In the transverse section cutter and gear roll on each other as an internal pair without backlash. The tip of the
cutter's tooth is rounded by an arc that touches its involute and its tip circle. The fillet is the envelope of this
arc.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import overload

import numpy as np

from fe_ste.tools.arrays import Booleans, Floats

# The involute function and its inverse


@overload
def involute(angle: float) -> float: ...


@overload
def involute(angle: Floats) -> Floats: ...


def involute(angle: float | Floats) -> float | Floats:
    """Involute function ``tan(angle) - angle`` (ISO 21771), rad.

    Parameters
    ----------
    angle : profile angle, rad

    Returns
    -------
    involute polar angle, rad

    Examples
    --------
    >>> round(involute(math.radians(20.0)), 9)
    0.014904384
    """
    if isinstance(angle, float):
        return math.tan(angle) - angle
    return np.asarray(np.tan(angle) - angle, dtype=np.float64)


def inverse_involute(value: float) -> float:
    """Angle whose involute function is `value`, by Newton's method.

    Parameters
    ----------
    value : involute polar angle, rad, not negative

    Returns
    -------
    profile angle, rad

    Raises
    ------
    ValueError
        If `value` is negative.

    Examples
    --------
    >>> round(math.degrees(inverse_involute(0.014904383867336446)), 9)
    20.0
    """
    if value < 0.0:
        raise ValueError(f"involute of an angle = {value:g} must not be negative")
    if value == 0.0:
        return 0.0
    # inv(angle) >= angle^3 / 3 and tan(angle) <= value + pi/2 bound the root from above; from there Newton's
    # method runs down a convex function without overshoot.
    angle = min(math.cbrt(3.0 * value), math.atan(value + 0.5 * math.pi))
    for _ in range(50):
        step = (involute(angle) - value) / math.tan(angle) ** 2
        angle -= step
        if abs(step) < 1e-15:
            break
    return angle


SAMPLES = 2001
"""Points of the curve among which its crossing with the involute is looked for."""


@dataclass(frozen=True)
class RackTipCut:
    """What the rounded tip of a generating rack leaves on a gear, transverse section."""

    reference_radius: float
    base_radius: float
    root_radius: float
    """In m."""
    half_pitch_angle: float
    """Half of the angle between teeth, rad."""
    base_half_angle: float
    """Polar half angle of the tooth at the base circle, rad."""
    pressure_angle: float
    """Normal pressure angle, rad."""
    helix_angle: float
    """In rad."""
    rounding: float
    half_land: float
    """Radius of the rack's tip and half the flat land between two such radii, normal section, m."""

    def polar(self, parameter: Floats) -> tuple[Floats, Floats]:
        """Radius and polar angle of points of the curve, the middle of the tooth at angle zero.

        The tip is round in the normal section and so stretched by 1/cos(beta) in the transverse one. A point of the
        rack generates when its normal passes through the pitch point (law of gearing): this gives the rack's travel,
        and the travel divided by the reference radius the gear's rotation.

        Parameters
        ----------
        parameter : 0 where the rack's straight flank ends, to 1 at the root circle
        """
        slope = -(self.pressure_angle + parameter * (0.5 * math.pi - self.pressure_angle))
        stretch = 1.0 / math.cos(self.helix_angle)
        # Rack coordinates: origin at the pitch point, x along the pitch line from the middle of the rack's tooth,
        # y away from the gear's axis.
        x = stretch * (self.half_land + self.rounding * np.cos(slope))
        y = self.root_radius - self.reference_radius + self.rounding * (1.0 + np.sin(slope))
        travel = y * np.cos(slope) / (stretch * np.sin(slope)) - x
        # The rack's tooth cuts the space next to the tooth on the +x axis: its middle is at half a pitch.
        rotation = travel / self.reference_radius
        height = self.reference_radius + y
        side = x + travel
        return np.hypot(side, height), self.half_pitch_angle + rotation - np.arctan2(side, height)

    @cached_property
    def undercut_parameter(self) -> float:
        """Parameter at which the curve of an undercut tooth crosses its involute.

        The curve begins in the tooth space and enters the tooth at this parameter. If it passes the base circle first,
        the undercut is too small to shorten the involute above that circle: the parameter at the base circle is
        returned.
        """
        parameter = np.linspace(0.0, 1.0, SAMPLES)
        inside = np.flatnonzero(self._enters(parameter))
        if inside.size == 0 or inside[0] == 0:
            if inside.size:
                return float(parameter[inside[0]])
            return 0.0
        low = parameter[inside[0] - 1]
        high = parameter[inside[0]]
        while high - low > 4.0 * np.finfo(float).eps:
            middle = 0.5 * (low + high)
            if self._enters(np.array([middle]))[0]:
                high = middle
            else:
                low = middle
        return float(low)

    def _enters(self, parameter: Floats) -> Booleans:
        """Whether points of the curve lie within the involute of the tooth, or within its base circle."""
        radius, angle = self.polar(parameter)
        above = radius > self.base_radius
        profile_angle = np.arccos(self.base_radius / np.where(above, radius, self.base_radius))
        return np.asarray(~above | (angle < self.base_half_angle - involute(profile_angle)))


POSITIONS = 4001
"""Positions of the cutter at which a corner of the gear's tips is checked."""


@dataclass(frozen=True)
class PinionCutter:
    """Cutter of an internal gear, of its normal module, pressure angle and helix angle."""

    teeth: int
    """Number of teeth, z_0."""
    tip_radius: float
    """Radius of the arc that rounds its tips, transverse section, in normal modules (rho_a0*)."""
    profile_shift: float = 0.0
    """x_0, in normal modules; falls as it is ground again."""
    tip_diameter: float | None = None
    """d_a0, m: the root circle of the gear follows from it. If not given, the cutter reaches the gear's root circle."""


def cutting_distance(gear_teeth: int, cutter_teeth: int, thickness_sum: float, angle: float, module: float) -> float:
    """Centre distance at which a cutter generates an internal gear, m; NaN if there is none.

    Without backlash the teeth fill the pitch: inv a_w = inv a_t + (1 - s / (pi m)) pi / (z - z_0), the sum s of both
    thicknesses on the reference circles.

    Parameters
    ----------
    thickness_sum : tooth thickness of both on their reference circles over the transverse module
    angle : transverse pressure angle, rad
    module : transverse module, m
    """
    difference = gear_teeth - cutter_teeth
    value = involute(angle) + (math.pi - thickness_sum) / difference if difference > 0 else math.nan
    if not value > 0.0:
        return math.nan
    return 0.5 * module * difference * math.cos(angle) / math.cos(inverse_involute(value))


@dataclass(frozen=True)
class CutterTipCut:
    """What the rounded tip of a pinion-type cutter leaves on an internal gear, transverse section."""

    base_radius: float
    cutter_base_radius: float
    """Of gear and cutter, m."""
    centre_distance: float
    """At which it cuts, m."""
    cutter_tip_radius: float
    rounding: float
    """Radius of the cutter's tip circle and of the arc there, m."""
    cutter_base_half_angle: float
    """Polar half angle of the cutter's tooth at its base circle, rad."""
    half_pitch_angle: float
    """Half of the angle between the gear's teeth, rad."""

    @property
    def ratio(self) -> float:
        """Teeth of the cutter over those of the gear."""
        return self.cutter_base_radius / self.base_radius

    @property
    def tangent_length(self) -> float:
        """Length of the line of action between the base circles, m."""
        return math.sqrt(max(self.centre_distance**2 - (self.base_radius - self.cutter_base_radius) ** 2, 0.0))

    @property
    def arc_centre_radius(self) -> float:
        """Radius on which the centre of the rounding lies, m."""
        return self.cutter_tip_radius - self.rounding

    @property
    def _arc_centre_roll_length(self) -> float:
        return math.sqrt(max(self.arc_centre_radius**2 - self.cutter_base_radius**2, 0.0))

    @property
    def cutter_form_roll_length(self) -> float:
        """Roll length at which the cutter's involute ends and its rounding begins, m.

        The centre lies on the involute shifted by the radius into the tooth, which shortens its roll length by it.
        """
        return self._arc_centre_roll_length + self.rounding

    @property
    def form_roll_length(self) -> float:
        """Roll length of the gear at which its involute ends and its fillet begins, m."""
        return self.cutter_form_roll_length + self.tangent_length

    @property
    def _flank_normal(self) -> float:
        """Polar angle, from the middle of the cutter's tooth, of the normal where the involute ends, rad."""
        return self.cutter_base_half_angle - self.cutter_form_roll_length / self.cutter_base_radius + 0.5 * math.pi

    @property
    def arc_centre_angle(self) -> float:
        """Polar angle of the rounding's centre from the middle of the cutter's tooth, rad; zero for a full round."""
        turned = math.atan2(self._arc_centre_roll_length, self.cutter_base_radius)
        return self._flank_normal - 0.5 * math.pi + turned

    @cached_property
    def largest_rounding(self) -> float:
        """Largest radius that fits on the cutter's tip, a full round, m; NaN where its tooth is pointed before it."""
        low = 0.0
        high = self.cutter_tip_radius - self.cutter_base_radius
        if replace(self, rounding=low).arc_centre_angle < 0.0:
            return math.nan
        while high - low > 1e-12 * self.cutter_tip_radius:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if replace(self, rounding=middle).arc_centre_angle >= 0.0 else (low, middle)
        return low

    def polar(self, parameter: Floats) -> tuple[Floats, Floats]:
        """Radius and polar angle of points of the fillet, the middle of the gear's tooth at angle zero.

        A point of the arc generates when its normal passes through the pitch point (law of gearing): this gives the
        rotation of the cutter, and with the ratio that of the gear.

        Parameters
        ----------
        parameter : 0 where the involute ends, to 1 at the root circle
        """
        flank = self._flank_normal
        centre_angle = self.arc_centre_angle
        direction = flank + parameter * (centre_angle - flank)
        away = direction - centre_angle
        # Along the normal from the arc's centre to the cutter's pitch circle.
        pitch_radius = self.centre_distance * self.ratio / (1.0 - self.ratio)
        half_chord = np.sqrt(np.maximum(pitch_radius**2 - (self.arc_centre_radius * np.sin(away)) ** 2, 0.0))
        reach = half_chord - self.arc_centre_radius * np.cos(away)
        centre = self.arc_centre_radius * np.exp(1j * centre_angle)
        normal = np.exp(1j * direction)
        rotation = -np.angle(centre + reach * normal)
        point = (self.centre_distance + np.exp(1j * rotation) * (centre + self.rounding * normal)) * np.exp(
            -1j * self.ratio * rotation
        )
        return np.abs(point), self.half_pitch_angle - np.angle(point)

    def cutter_half_angle(self, radius: Floats) -> Floats:
        """Polar half angle of the cutter's tooth with its rounding at radii from base to tip circle, rad."""
        form_radius = math.hypot(self.cutter_base_radius, self.cutter_form_roll_length)
        profile_angle = np.arccos(np.minimum(self.cutter_base_radius / radius, 1.0))
        flank = self.cutter_base_half_angle - involute(profile_angle)
        centre = self.arc_centre_radius
        cosine = (radius**2 + centre**2 - self.rounding**2) / (2.0 * radius * centre)
        arc = self.arc_centre_angle + np.arccos(np.clip(cosine, -1.0, 1.0))
        return np.where(radius <= form_radius, flank, arc)

    def tip_corner_gap(self, tip_radius: float, tip_half_angle: float) -> float:
        """Minimum gap between the cutter's teeth and the corners of the gear's tips during the generating motion.

        Parameters
        ----------
        tip_radius : radius of the gear's tip circle, m
        tip_half_angle : polar half angle of its tooth there, rad

        Returns
        -------
        arc about the cutter's axis, m; negative where the cutter trims the tips
        """
        # The space whose middle stands on the line of centres at rotation zero, and the corner beside it; tips are
        # within reach between the points at which the tip circles cross.
        corner = self.half_pitch_angle - tip_half_angle
        distance = self.centre_distance
        crossing = (tip_radius**2 + distance**2 - self.cutter_tip_radius**2) / (2.0 * distance * tip_radius)
        most = math.acos(min(max(crossing, -1.0), 1.0))
        rotation = (np.linspace(-most, most, POSITIONS) - corner) / self.ratio
        seen = tip_radius * np.exp(1j * (corner + self.ratio * rotation)) - distance
        radius = np.abs(seen)
        angle = np.angle(seen * np.exp(-1j * rotation))
        near = (radius > self.cutter_base_radius) & (radius < self.cutter_tip_radius)
        if not near.any():
            return math.inf
        gap = radius[near] * (angle[near] - self.cutter_half_angle(radius[near]))
        return float(gap.min())
