"""Root fillet of a tooth in the transverse section.

External teeth get the fillet that a rack with a rounded tip generates (`fe_ste.geometry.trochoid`); internal teeth
that of their cutter (`fe_ste.geometry.cutter`), or, without one, an arc that touches the flank and the root circle.
"""

from __future__ import annotations

import math

import numpy as np

from fe_ste.geometry.gear_relations import UncheckedGear
from fe_ste.tools.arrays import Floats


def root_fillet(gear: UncheckedGear, parameter: Floats) -> Floats:
    """Points of the fillet on the counter-clockwise side of a tooth centred on the +x axis.

    Parameters
    ----------
    gear : the gear
    parameter : (n,) 0 at the form circle, exactly on the involute, to 1 at the root circle

    Returns
    -------
    (n, 2) x, y in m
    """
    if not gear.internal:
        return _generated_fillet(gear, parameter)
    if gear.cutter is not None:
        return cartesian(*gear.cutter_tip_cut.polar(parameter))
    return _internal_fillet(gear, parameter)


def _generated_fillet(gear: UncheckedGear, parameter: Floats) -> Floats:
    """Curve that the rounded tip of a rack cuts, from the flank (0) to the root circle (1)."""
    start = gear.fillet_start
    return cartesian(*gear.rack_tip_cut.polar(start + parameter * (1.0 - start)))


def _internal_fillet(gear: UncheckedGear, parameter: Floats) -> Floats:
    """Arc that touches the flank (0) and the root circle (1) of an internal gear."""
    radius = gear.fillet_radius
    centre_angle = gear.fillet_centre_angle
    centre = (gear.root_radius - radius) * np.array([math.cos(centre_angle), math.sin(centre_angle)])
    form_angle = gear.half_angle(gear.form_radius)
    # The normal of an involute is tangent to the base circle, hence at right angles to the base radius that
    # stands off by the profile angle.
    profile_angle = math.acos(gear.base_radius / gear.form_radius)
    start = form_angle + profile_angle - 0.5 * math.pi
    direction = start + parameter * (centre_angle - start)
    return centre + radius * np.column_stack((np.cos(direction), np.sin(direction)))


def cartesian(radius: Floats, angle: Floats) -> Floats:
    """Columns x, y of points given by radius and polar angle."""
    return np.column_stack((radius * np.cos(angle), radius * np.sin(angle)))
