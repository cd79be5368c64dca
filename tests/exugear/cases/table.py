"""Tables of known shape that stand for FE tables: every axis acts, Hertz-like at small loads."""

from __future__ import annotations

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from fe_ste.transmission_error.surface import SteSurface

LOADS = np.array([0.05, 0.2, 0.5, 1.0, 1.5, 2.0])
STIFFNESS = {"sun_planet": 3.77e9, "ring_planet": 4.85e9, "intermediate": 3.07e9, "high_speed": 1.93e9}


def surface_of(
    gearbox: Gearbox,
    name: str,
    positions: int = 50,
    variation: float = 1.0,
    stiffness: float | None = None,
    hollow: float = 0.2,
) -> SteSurface:
    """Table of a pair around its centre distance, up to twice its static load; `variation` times 5 % over the cycle.

    `hollow` is how the deflection bends with the misalignment; teeth resist tilting where it is negative.
    """
    stiffness = stiffness or STIFFNESS[name]
    mesh = next(mesh for mesh in gearbox.meshes if mesh.pair.name == name)
    static = abs(gearbox.train.static_mesh_forces()[mesh.name])
    centre = mesh.centre_distance + np.linspace(-2e-4, 2e-4, 5)
    misalignment = np.linspace(-6e-4, 6e-4, 7)
    force = static * LOADS
    cycle = 2.0 * np.pi * np.arange(positions) / positions
    shape = 1.0 + variation * (0.05 * np.cos(cycle + 0.3) + 0.02 * np.cos(2 * cycle + 1.1))
    p = shape[:, None, None, None]
    c = (centre - mesh.centre_distance)[None, :, None, None] / 2e-4
    a = misalignment[None, None, :, None] / 4e-4
    softer = (1.0 + 0.03 * c) * (1.0 + hollow * a**2 + 0.05 * a)
    unloaded = -1e-6 * a[..., 0] ** 2 + 1e-6 * (1.0 + p[..., 0])
    per_force = p * softer / stiffness
    bend = 4e-6 * softer * p
    ste = unloaded[..., None] + per_force * force + bend * (force / static) ** 0.75
    slope = per_force + 0.75 * bend * (force / static) ** -0.25 / static
    tilting = (1.0 + 0.03 * c) * (2.0 * hollow * a + 0.05) / 4e-4
    centre_of_load = -2e-6 * a / 4e-4 + (ste - unloaded[..., None]) * tilting / softer
    return SteSurface.from_nodes(
        centre,
        misalignment,
        force,
        ste,
        1.0 / slope,
        tangent_load_centroid=centre_of_load,
        unloaded=np.broadcast_to(unloaded, ste.shape[:3]),
        unloaded_centre=np.broadcast_to(-2e-6 * a[..., 0] / 4e-4, ste.shape[:3]),
    )


def surfaces(gearbox: Gearbox) -> dict[str, SteSurface]:
    """Tables of all pairs at work."""
    return {name: surface_of(gearbox, name) for name in STIFFNESS}
