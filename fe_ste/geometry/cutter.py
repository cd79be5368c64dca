"""Pinion-type cutter of an internal gear: what its rounded tip leaves at the root, and whether it spoils the tips.

In the transverse section cutter and gear roll on each other as an internal pair without backlash. The tip of the
cutter's tooth is rounded by an arc that touches its involute and its tip circle. The fillet is the envelope of this
arc.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fe_ste.geometry.involute import inverse_involute, involute
from fe_ste.tools.arrays import Floats

POSITIONS = 4001
"""Positions of the cutter at which a corner of the gear's tips is looked at."""


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
        """Least gap between the cutter's teeth and the corners of the gear's tips as they roll past each other.

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
