"""Meshes with coarse finite elements, so that contact at the static misalignment takes seconds, by two ways.

Curves know their table's input, so that contact is solved where gears stand; surfaces are whole grids around there.
Both have the same finite elements and positions, and stand for the same teeth.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.system.tooth_mesh.element import MeshCurve
from exugear.system.tooth_mesh.tables import wanted_table
from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.transmission_error.mean_contact import POSITIONS
from fe_ste.transmission_error.surface import SteSurface
from fe_ste.transmission_error.table import MeshTable, TableInput

COARSE, CELLS = MeshSettings(layers=5, flank=8, thickness=6, rim=4), ContactSettings(slices=20)


def coarse_input(gearbox: Gearbox, name: str, positions: int = POSITIONS) -> TableInput:
    """Input of a pair's static table with coarse finite elements."""
    return replace(wanted_table(gearbox, name, positions), mesh=COARSE, contact=CELLS)


def coarse_curves(gearbox: Gearbox) -> dict[str, MeshCurve]:
    """Curves of all pairs from coarse tables of their static state."""
    curves = {}
    for name in dict.fromkeys(mesh.pair.name for mesh in gearbox.meshes):
        wanted = coarse_input(gearbox, name)
        state = MeshTable.compute(wanted).static_state
        curves[name] = MeshCurve(
            state["mesh_stiffness"].to_numpy(),
            state["tangent_stiffness"].to_numpy(),
            wanted.torque[0] / wanted.pair.pinion.base_radius,
            wanted,
            state["load_centroid"].to_numpy(),
            state["tangent_load_centroid"].to_numpy(),
        )
    return curves


def coarse_surfaces(gearbox: Gearbox, around: Mapping[str, tuple[float, float]]) -> dict[str, SteSurface]:
    """Whole tables of all pairs over the misalignments (rad) between which they are known to stand."""
    surfaces = {}
    for name, (low, high) in around.items():
        wanted = coarse_input(gearbox, name)
        distances = wanted.pair.centre_distance + np.array([-1e-4, 0.0, 1.2e-4])
        grid = replace(
            wanted,
            torque=tuple(wanted.torque[0] * np.array([0.04, 0.12, 0.25, 0.5, 0.75, 1.0, 1.3])),
            centre_distance=tuple(distances.tolist()),
            misalignment=tuple(np.linspace(low, high, 5).tolist()),
        )
        surfaces[name] = SteSurface.from_table(MeshTable.compute(grid).dataset)
    return surfaces
