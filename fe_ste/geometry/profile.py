"""Tooth profile in the transverse section: involute flank and root fillet.

The same splines as those of SciPy, whose module takes a quarter of a second to load.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_ste.geometry.gear_relations import cartesian, root_fillet
from fe_ste.geometry.gears import Gear
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import ReprMixin

_FILLET_POINTS = 201
_OVERSAMPLING = 10


@dataclass(frozen=True)
class ToothProfile(ReprMixin):
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
    # Points of the fillet at nearly equal distances, end points exactly.
    parameter = np.linspace(0.0, 1.0, _OVERSAMPLING * _FILLET_POINTS)
    steps = np.diff(root_fillet(gear, parameter), axis=0)
    length = np.concatenate(([0.0], np.cumsum(np.hypot(*steps.T))))
    return ToothProfile(
        gear=gear,
        tip_radius=gear.tip_radius,
        form_radius=gear.form_radius,
        root_radius=gear.root_radius,
        fillet=root_fillet(gear, np.interp(np.linspace(0.0, length[-1], _FILLET_POINTS), length, parameter)),
    )


# Cubic splines through values at nodes, whose third derivative is continuous at the last but one ("not a knot")

_DEGREE = 3


def cubic_knots(nodes: Floats) -> Floats:
    """Return the knots (n + 4,) of the splines through n ascending nodes, four or more.

    Examples
    --------
    >>> cubic_knots(np.array([0.0, 1.0, 2.0, 3.0, 4.0])).tolist()
    [0.0, 0.0, 0.0, 0.0, 2.0, 4.0, 4.0, 4.0, 4.0]
    """
    ends = _DEGREE + 1
    return np.concatenate([np.full(ends, nodes[0]), nodes[2:-2], np.full(ends, nodes[-1])])


def cubic_values(places: Floats, knots: Floats) -> tuple[Integers, Floats]:
    """Evaluate the B-splines of some knots.

    Parameters
    ----------
    places : (n,) within the knots

    Returns
    -------
    first : (n,) number of the first of the four splines that are not zero at each place
    values : (n, 4) of these four

    References
    ----------
    C. de Boor, A Practical Guide to Splines, 1978, chapter X.
    """
    span = np.clip(np.searchsorted(knots, places, side="right") - 1, _DEGREE, len(knots) - _DEGREE - 2)
    values = np.zeros((_DEGREE + 1, len(places)))
    values[0] = 1.0
    for degree in range(1, _DEGREE + 1):
        carried = np.zeros(len(places))
        for number in range(degree):
            above = knots[span + number + 1]
            below = knots[span + number + 1 - degree]
            part = values[number] / (above - below)
            values[number] = carried + (above - places) * part
            carried = (places - below) * part
        values[degree] = carried
    return span - _DEGREE, np.ascontiguousarray(values.T)


def cubic_matrix(places: Floats, knots: Floats) -> Floats:
    """Return the values (n, splines) of all B-splines of some knots."""
    first, values = cubic_values(places, knots)
    result = np.zeros((len(places), len(knots) - _DEGREE - 1))
    np.put_along_axis(result, first[:, None] + np.arange(_DEGREE + 1), values, axis=1)
    return result


def cubic_coefficients(nodes: Floats, knots: Floats) -> Floats:
    """Return the coefficients (n, n) of the splines that are 1 at one node, that of the column, and 0 at the others."""
    return np.asarray(np.linalg.inv(cubic_matrix(nodes, knots)))
