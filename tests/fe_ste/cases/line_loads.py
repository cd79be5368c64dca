"""Line loads over the mesh cycle in closed form, as a transmission error table has them."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from fe_ste.geometry.gears import GearPair
from fe_ste.standards.mesh_loss import partial_contact_ratios


def state_of(pair: GearPair, positions: int = 400, lines: int = 41) -> xr.Dataset:
    """Equal load on all tooth pairs in contact, evenly along the face."""
    teeth = np.arange(-6, 7)
    pmc = np.arange(positions) / positions
    axial = pair.face_width * ((np.arange(lines) + 0.5) / lines - 0.5)
    pitches = math.tan(pair.pinion.base_helix_angle) * axial / pair.transverse_base_pitch
    along = pmc[:, None, None] + teeth[None, :, None] + pitches
    first, second = partial_contact_ratios(pair)
    # A pair is in contact from the tip of gear 2 to that of gear 1.
    touching = ((along > -second) & (along <= first)).astype(float)
    load = 1e5 * touching / touching.sum(axis=(1, 2), keepdims=True)
    return xr.Dataset(
        {"line_load": (("pmc", "tooth", "axial_position"), load)}, {"pmc": pmc, "tooth": teeth, "axial_position": axial}
    )
