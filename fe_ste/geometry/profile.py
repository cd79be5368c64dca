"""Tooth profile in the transverse section: involute flank and root fillet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_ste.geometry.fillet import cartesian, root_fillet
from fe_ste.geometry.gears import Gear
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed

_FILLET_POINTS = 201
_OVERSAMPLING = 10


@dataclass(frozen=True)
class ToothProfile(Displayed):
    """Counter-clockwise side of a tooth centred on the +x axis."""

    gear: Gear
    """The gear it belongs to."""
    tip_radius: float
    form_radius: float
    root_radius: float
    """Radii at which flank and fillet begin and end, m."""
    fillet: Floats
    """(n, 2) points x, y from the flank (first point, at the form radius, on the involute) to the root circle (last
    point), evenly spaced along the curve, m. From there to the polar angle pi/z the profile is the root circle."""

    def flank(self, radius: Floats) -> Floats:
        """Points of the involute.

        Parameters
        ----------
        radius : (n,) radii between form and tip radius, m

        Returns
        -------
        (n, 2) x, y in m
        """
        return cartesian(radius, self.gear.half_angle(radius))

    def _line(self) -> str:
        tip, form, root = (f"{1e3 * radius:.6g}" for radius in (self.tip_radius, self.form_radius, self.root_radius))
        return f" of {self.gear.name!r}: tip radius {tip} mm, form {form} mm, root {root} mm"


def tooth_profile(gear: Gear) -> ToothProfile:
    """Profile of one tooth of a gear, transverse section.

    Parameters
    ----------
    gear : checked geometry

    Returns
    -------
    radii and fillet

    Examples
    --------
    >>> gear = Gear(name="pinion", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)
    >>> profile = tooth_profile(gear)
    >>> round(float(1e3 * np.hypot(*profile.fillet[-1])), 6)
    71.25
    """
    return ToothProfile(
        gear=gear,
        tip_radius=gear.tip_radius,
        form_radius=gear.form_radius,
        root_radius=gear.root_radius,
        fillet=_evenly_spaced_fillet(gear),
    )


def _evenly_spaced_fillet(gear: Gear) -> Floats:
    """Points of the fillet at nearly equal distances, end points exactly."""
    parameter = np.linspace(0.0, 1.0, _OVERSAMPLING * _FILLET_POINTS)
    steps = np.diff(root_fillet(gear, parameter), axis=0)
    length = np.concatenate(([0.0], np.cumsum(np.hypot(*steps.T))))
    return root_fillet(gear, np.interp(np.linspace(0.0, length[-1], _FILLET_POINTS), length, parameter))
