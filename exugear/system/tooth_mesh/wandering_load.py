"""How far the load moves along the face over a mesh cycle, which the law `seed` leaves out, and how much that is."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.system.tooth_mesh.tables import fitting_table
from fe_ste.tools.arrays import Floats
from fe_ste.transmission_error.gaps import GapError, complete_cycle
from fe_ste.transmission_error.table import TableError

if TYPE_CHECKING:
    import xarray as xr

LEAST_PUSH = 1e-6
"""Push of a transmission error over the load below which it is round-off."""


@dataclass(frozen=True)
class WanderingLoad:
    """Way of the load along the face, in its first harmonic.

    Examples
    --------
    >>> WanderingLoad("helical", 1.8e-3, 4.3).in_words
    'helical: the load moves by +-1.8 mm along the face in each mesh cycle'
    """

    pair: str
    amplitude: float
    """Of the load centre, m."""
    over_error: float
    """Its moment as forces at the ends of the face, over the force that the first harmonic of the transmission error
    makes of the mean stiffness."""

    @property
    def in_words(self) -> str:
        """Say how far."""
        return f"{self.pair}: the load moves by +-{1e3 * self.amplitude:.2g} mm along the face in each mesh cycle"


def wandering_loads(gearbox: Gearbox, folder: Path) -> tuple[WanderingLoad, ...]:
    """Way of the load of each pair that has a table, at the static load, that which counts most first.

    Parameters
    ----------
    folder : results folder
    """
    loads = []
    for name, pair in {mesh.pair.name: mesh.pair for mesh in gearbox.meshes}.items():
        if name in gearbox.stated_stiffness:
            continue
        with suppress(TableError, GapError):  # no law along a row takes such a table
            point = complete_cycle(fitting_table(gearbox, name, folder).static_state)
            loads.append(_way(name, point, pair.face_width))
    return tuple(sorted(loads, key=lambda own: -own.over_error))


def _way(name: str, point: xr.Dataset, width: float) -> WanderingLoad:
    centre, error, stiffness = (
        np.asarray(point[key].to_numpy(), dtype=np.float64).reshape(-1)
        for key in ("load_centre", "ste", "mesh_stiffness")
    )
    force = float(point["line_of_action_force"].mean())
    at_ends = force * _first_harmonic(centre) / (0.5 * width)
    pushed = max(stiffness.mean() * _first_harmonic(error), LEAST_PUSH * force)
    return WanderingLoad(name, _first_harmonic(centre), float(at_ends / pushed))


def _first_harmonic(values: Floats) -> float:
    """Amplitude of the first harmonic of a cycle."""
    if len(values) > 2:
        return float(2.0 * np.abs(np.fft.rfft(values)[1]) / len(values))
    return 0.0
