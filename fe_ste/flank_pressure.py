"""Contact pressure over the flank and line load along the face of a pair: aligned, and at a misalignment."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fe_ste.geometry.gears import GearPair
from fe_ste.root_stress import hertz_stress
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.drawing import axes_or_new
from fe_ste.transmission_error.contact_stress import PATH_MARGIN, face_load_factor, load_along_face
from fe_ste.transmission_error.mean_contact import states_of_contact
from fe_ste.transmission_error.table import TableInput

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

POSITIONS = 20
"""Positions of the mesh cycle: rows of contact lines per base pitch."""
ROWS = 48
"""Number of places on the path of contact."""


@dataclass(frozen=True, eq=False)
class FlankPressure(ReprMixin):
    """Pressure and load of a flank over the mesh cycle at one torque and misalignment."""

    misalignment: float
    """Rad; positive where it opens the gap at the +z end."""
    path: Floats
    """(p,) place on the path of contact from gear 1's base point, m; it rises towards the tip of gear 1. Both ends of
    the path, where tip edges touch, are left out as in the rating (`PATH_MARGIN` of
    `fe_ste.transmission_error.contact_stress`)."""
    axial: Floats
    """(k,) position along the face from its middle, m."""
    pressure: Floats
    """(p, k) highest Hertzian stress of the mesh cycle, Pa; zero where no contact line passes."""
    line_load: Floats
    """(k,) of all tooth pairs together, mean of the mesh cycle, N/m."""
    face_load_factor: float
    """K_Hbeta: maximum over mean line load along the face."""
    edge_pressure: float
    """Highest pressure of contact at tip edges, Pa; zero without any."""
    edge_place: tuple[float, float] = (math.nan, math.nan)
    """Place of the highest line load at tip edges: on the path, at one of its ends, and along the face, m."""

    def _line(self) -> str:
        return f": {1e-6 * self.pressure.max():.4g} MPa, K_Hbeta {self.face_load_factor:.3g}"

    @property
    def highest(self) -> tuple[float, float, float]:
        """Highest Hertzian stress (Pa) with its place on the path and along the face (m)."""
        row, column = np.unravel_index(int(self.pressure.argmax()), self.pressure.shape)
        return float(self.pressure[row, column]), float(self.path[row]), float(self.axial[column])

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the pressure over the flank, MPa, with the position along the face and the path of contact, mm.

        Parameters
        ----------
        ax : matplotlib axes; by default new ones, whose ``ax.figure`` can be shown and saved

        Examples
        --------
        >>> path, axial = np.linspace(0.01, 0.02, 3), np.linspace(-0.01, 0.01, 2)
        >>> ax = FlankPressure(0.0, path, axial, np.full((3, 2), 1e9), np.full(2, 1e5), 1.0, 0.0).plot()
        >>> ax.get_xlabel(), ax.get_ylabel()
        ('Position along the face / mm', 'Path of contact / mm')
        """
        with axes_or_new(ax, 5.0, 3.0) as panel:
            image = panel.pcolormesh(
                1e3 * self.axial, 1e3 * self.path, 1e-6 * self.pressure, cmap="inferno_r", vmin=0.0, shading="nearest"
            )
            panel.grid(False)
            panel.set(xlabel="Position along the face / mm", ylabel="Path of contact / mm")
            panel.figure.colorbar(image, ax=panel, label="Contact pressure / MPa")
            return panel


def flank_pressures(
    table: TableInput, force: float, misalignments: Sequence[float], centre_distance: float | None = None
) -> list[FlankPressure]:
    """Solve the contact of a pair over the mesh cycle under one force, and return the pressure over the flank.

    Parameters
    ----------
    table : of the pair: its modifications and discretisation
    force : on the transverse line of action, N
    misalignments : rad
    centre_distance : m; by default that of the pair

    Returns
    -------
    one for each misalignment

    Raises
    ------
    ContactError
        The contact of a position could not be solved.

    Examples
    --------
    >>> from fe_ste.contact.kinematics import ContactSettings
    >>> from fe_ste.elasticity.hexmesh import MeshSettings
    >>> from fe_ste.geometry.gears import Gear
    >>> gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
    >>> pair = GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3)
    >>> coarse = dict(mesh=MeshSettings(layers=4, flank=8, thickness=4), contact=ContactSettings(slices=12))
    >>> aligned, tilted = flank_pressures(TableInput(pair=pair, torque=(100.0,), **coarse), 2000.0, (0.0, 2e-4))
    >>> abs(aligned.highest[2]) < abs(tilted.highest[2]), tilted.highest[2] < 0.0
    (True, True)
    """
    distance = table.pair.centre_distance if centre_distance is None else centre_distance
    states = states_of_contact(table, force, misalignments, distance, POSITIONS)
    return [_flank_pressure(table.pair, states.isel(misalignment=place)) for place in range(len(misalignments))]


def _flank_pressure(pair: GearPair, states: xr.Dataset) -> FlankPressure:
    loads = np.nan_to_num(states["line_load"].transpose("pmc", "tooth", ...).to_numpy())
    pmc, tooth, axial = (states[name].to_numpy() for name in ("pmc", "tooth", "axial_position"))
    base_pitch = pair.transverse_base_pitch
    contact_lines = pair.path_pitch_point + base_pitch * (pmc[:, None] + tooth)
    place = contact_lines[..., None] + math.tan(pair.pinion.base_helix_angle) * axial
    hertz = hertz_stress(pair, loads, place)
    margin = PATH_MARGIN * (pair.path_end - pair.path_start)
    path = np.linspace(pair.path_start + margin, pair.path_end - margin, ROWS)
    # Each end of the face meets the same place of the path at another position of the mesh cycle.
    order = np.argsort(contact_lines, axis=None)
    places, stresses = (values.reshape(-1, len(axial))[order] for values in (place, hertz))
    pressure = np.stack(
        [np.interp(path, places[:, k], stresses[:, k], left=0.0, right=0.0) for k in range(len(axial))], axis=1
    )
    beyond = np.where((place < path[0]) | (place > path[-1]), loads, 0.0)
    edge = np.unravel_index(int(beyond.argmax()), beyond.shape)
    edge_place = (float(np.clip(place[edge], path[0], path[-1])), float(axial[edge[-1]]))
    return FlankPressure(
        misalignment=float(states["misalignment"]),
        path=path,
        axial=axial,
        pressure=pressure,
        line_load=load_along_face(states).to_numpy(),
        face_load_factor=float(face_load_factor(states)),
        edge_pressure=float(states["edge_pressure"].max()),
        edge_place=edge_place if beyond.any() else (math.nan, math.nan),
    )
