"""How evenly a mesh carries its load along the face."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr


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
