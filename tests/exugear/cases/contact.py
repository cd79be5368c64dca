"""Curves of load over deflection and states of contact, as bent and one-sided as those of strongly modified teeth."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.system.tooth_mesh.contact_state import MeshContactState
from exugear.system.tooth_mesh.element import MeshCurve

LOADS = {"sun_planet": 140e3, "ring_planet": 140e3, "intermediate": 180e3, "high_speed": 50e3}


def curves_of(stiffness: Mapping[str, np.ndarray]) -> dict[str, MeshCurve]:
    """Curves through a stiffness over the mesh cycle under 50 to 180 kN, exponents between 1.1 and 1.3.

    Their load moves along the face by some millimetres, as that of helical teeth does, and what is added to it moves
    otherwise.
    """
    cycle = 2.0 * np.pi * np.arange(50) / 50
    exponent = 1.2 + 0.08 * np.cos(cycle + 2.0) + 0.02 * np.cos(2 * cycle)
    centre = 1e-3 + 3e-3 * np.cos(cycle + 1.0) + 1e-3 * np.sin(2 * cycle)
    added = -2e-3 + 4e-3 * np.cos(cycle + 0.7) + 1.5e-3 * np.sin(3 * cycle)
    return {
        name: MeshCurve(values, exponent * values, LOADS[name], load_centroid=centre, tangent_load_centroid=added)
        for name, values in stiffness.items()
    }


def contacts(gearbox: Gearbox) -> dict[str, MeshContactState]:
    """States whose numbers are of the size that contact of the GRC has, no two meshes alike."""
    found = {}
    for n, mesh in enumerate(gearbox.meshes):
        force = 1e5 * (1.0 + 0.1 * n)
        found[mesh.name] = MeshContactState(
            force, 30e-6 + 1e-6 * n, 6e9, 1e-4 - 3e-5 * n, -2e-3 + 4e-4 * n, 3e-3 - 7e-4 * n, 1e7 + 1e6 * n
        )
    return found
