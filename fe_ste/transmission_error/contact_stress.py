"""Hertzian contact stress along the contact lines, from the load that each unit of their length carries.

Line loads of different discretisations can be compared; the largest pressure of a cell or a node depends on its size.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from fe_ste.geometry.gears import GearPair
from fe_ste.tools.arrays import Floats
from fe_ste.transmission_error.search import flank_radii

if TYPE_CHECKING:
    import xarray as xr


def contact_line_stress(
    pair: GearPair, pmc: ArrayLike, tooth: ArrayLike, axial: ArrayLike, line_load: ArrayLike
) -> Floats:
    """Return the Hertzian stress where contact lines carry a given load, Pa.

    Parameters
    ----------
    pmc, tooth, axial
        Positions in the mesh cycle, tooth pairs (0 touches at the pitch point at mid-face at pmc 0) and axial
        positions, m from mid-face; they broadcast with `line_load`.
    line_load : normal load per length of the contact line, N/m

    Notes
    -----
    sigma_H = sqrt(w E* / (pi R)), 1/R the sum of the normal curvatures and 1/E* the sum of (1 - nu^2)/E (Johnson,
    Contact Mechanics, eq. 4.45 with p = 2 w / (pi b)). A tooth pair that touches outside the path of contact does so at
    the tip of one of the gears; the curvatures are those at the end of the path then, the radius of the tip edge is not
    taken into account.

    Examples
    --------
    Two steel gears of 30 teeth at the pitch point:

    >>> from fe_ste.geometry.gears import Gear
    >>> gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
    >>> pair = GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3)
    >>> round(1e-6 * float(contact_line_stress(pair, 0.0, 0, 0.0, 1e5)), 1)
    684.2
    """
    _, along, base_points = contact_path(pair, pmc, tooth, axial)
    curvature = math.cos(pair.pinion.base_helix_angle) * (1.0 / along + 1.0 / (base_points - along))
    gears = (pair.pinion, pair.gear)
    compliance = sum((1 - g.material.poissons_ratio**2) / g.material.youngs_modulus for g in gears)
    return np.sqrt(np.maximum(line_load, 0.0) * curvature / (math.pi * compliance))


def contact_path(pair: GearPair, pmc: ArrayLike, tooth: ArrayLike, axial: ArrayLike) -> tuple[float, Floats, float]:
    """Find where tooth pairs touch along the line of action, m from its point on the base circle of gear 1.

    Parameters
    ----------
    pmc, tooth, axial : as in `contact_line_stress`

    Returns
    -------
    The place of the pitch point, the places of contact, limited to the path of contact, and the point on the base
    circle of gear 2.
    """
    pinion = pair.pinion
    gear = pair.gear
    kind = -1.0 if gear.internal else 1.0
    twist = math.tan(pinion.base_helix_angle)
    pitch_point = pinion.base_radius * math.tan(pair.working_pressure_angle)
    base_points = pitch_point + kind * gear.base_radius * math.tan(pair.working_pressure_angle)
    along = pitch_point + pair.transverse_base_pitch * np.add(tooth, pmc) + twist * np.asarray(axial)
    ends = [math.sqrt(radius**2 - pinion.base_radius**2) for radius in flank_radii(pinion)]
    other_ends = [base_points - kind * math.sqrt(radius**2 - gear.base_radius**2) for radius in flank_radii(gear)]
    return pitch_point, np.clip(along, max(ends[0], min(other_ends)), min(ends[1], max(other_ends))), base_points


_ALONG_LINE = ("pmc", "tooth", "axial_position")
PATH_MARGIN = 0.05
"""Part of the path of contact at either end that counts as its edge."""


def largest_contact_stress(pair: GearPair, states: xr.Dataset) -> xr.DataArray:
    """Return the largest Hertzian stress of the mesh cycle within the path of contact, Pa.

    Both ends of the path (`PATH_MARGIN`) are left out, as in the rating: there tip edges touch, and the stress depends
    on how close a position of the mesh cycle comes to them.

    Parameters
    ----------
    states : of `fe_ste.transmission_error.transmission_error.static_transmission_error`, or of a table

    Returns
    -------
    over torque, centre_distance and misalignment
    """
    load = states["line_load"].fillna(0.0).transpose(..., *_ALONG_LINE)
    pmc, tooth, axial = np.meshgrid(*(load[name].to_numpy() for name in _ALONG_LINE), indexing="ij")
    along = pair.path_pitch_point + pair.transverse_base_pitch * (pmc + tooth)
    along += math.tan(pair.pinion.base_helix_angle) * axial
    margin = PATH_MARGIN * (pair.path_end - pair.path_start)
    inside = (along > pair.path_start + margin) & (along < pair.path_end - margin)
    stress = load.copy(data=np.where(inside, contact_line_stress(pair, pmc, tooth, axial, load.to_numpy()), 0.0))
    largest: xr.DataArray = stress.max(_ALONG_LINE)
    return largest.assign_attrs(
        units="Pa", long_name="largest contact stress of the mesh cycle within the path of contact"
    )


def mean_over_contact_line(stress: ArrayLike, load: ArrayLike) -> Floats:
    """Return the mean stress along the last axis, weighted by the load there; zero without load.

    Unlike the largest value it does not depend on how finely the ends of a contact line are resolved.

    Examples
    --------
    >>> mean_over_contact_line(np.array([[1.0, 2.0], [5.0, 5.0]]), np.array([[3.0, 1.0], [0.0, 0.0]])).tolist()
    [1.25, 0.0]
    """
    total = np.sum(load, axis=-1)
    return np.asarray((np.asarray(stress) * load).sum(axis=-1) / np.where(total > 0.0, total, 1.0))


def mean_contact_stress(pair: GearPair, curve: xr.Dataset) -> xr.DataArray:
    """Return the mean Hertzian stress of each tooth pair of a transmission error curve, Pa.

    Parameters
    ----------
    curve : with ``line_load`` (N/m) over ``tooth``, ``axial_position`` and, among others, ``pmc``

    Returns
    -------
    `mean_over_contact_line` over the dimensions that are left.
    """
    load = curve["line_load"].transpose(..., "axial_position")
    pmc, tooth, axial = (load[name].broadcast_like(load).transpose(*load.dims).to_numpy() for name in _ALONG_LINE)
    stress = contact_line_stress(pair, pmc, tooth, axial, load.to_numpy())
    mean = mean_over_contact_line(stress, load.to_numpy())
    return load.isel(axial_position=0, drop=True).copy(data=mean)


def load_along_face(states: xr.Dataset) -> xr.DataArray:
    """Line load over the face, N/m: that of all tooth pairs together, mean of the mesh cycle.

    Parameters
    ----------
    states : of `fe_ste.transmission_error.transmission_error.static_transmission_error`, or of a table
    """
    line_load: xr.DataArray = states["line_load"].sum("tooth").mean("pmc")
    return line_load.assign_attrs(units="N/m", long_name="line load of all tooth pairs, mean of the mesh cycle")


def face_load_factor(states: xr.Dataset) -> xr.DataArray:
    """Highest over mean line load along the face: the face load factor K_Hbeta (ISO 6336-1) as the teeth have it.

    The standard's is an estimate from the mesh misalignment and a constant mesh stiffness; here teeth bend and flatten
    by finite elements. Helical teeth have more than 1 when aligned, because their ends give way.

    Parameters
    ----------
    states : of `fe_ste.transmission_error.transmission_error.static_transmission_error`, or of a table

    Returns
    -------
    over torque, centre_distance and misalignment

    Examples
    --------
    >>> import numpy as np
    >>> import xarray as xr
    >>> load = xr.DataArray(np.array([[[1.0, 2.0, 3.0]]]), dims=("pmc", "tooth", "axial_position"))
    >>> float(face_load_factor(xr.Dataset({"line_load": load})))
    1.5
    """
    along = load_along_face(states)
    factor: xr.DataArray = along.max("axial_position") / along.mean("axial_position")
    return factor.assign_attrs(units="1", long_name="highest over mean line load along the face")
