"""Curve that the rounded tip of a rack cuts into the root of a gear, and where it meets the involute."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fe_ste.geometry.involute import involute
from fe_ste.tools.arrays import Booleans, Floats

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

        The curve begins in the space beside the tooth and enters it there. Where it passes the base circle first,
        too little is cut away to end the involute above it: the parameter at that circle is given.
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
