"""Rows of rolling bearings for tests, and assemblies whose supports follow them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from exugear.bearings.potential import rolling_arrays
from exugear.bearings.rows import BallRow, RollerRow, RollingRow
from exugear.dynamics.assembly import Assembly

CYLINDRICAL = RollerRow(
    element_diameter=0.030,
    pitch_diameter=0.225,
    element_count=20,
    effective_length=0.060,
    profile_factor=0.00035,
    radial_clearance=40e-6,
    laminae=240,
)
"""Rollers of a cylindrical roller bearing 160 x 290 x 80."""
TAPERED = replace(CYLINDRICAL, element_count=24, element_diameter=0.020, contact_angle=0.3, radial_clearance=0.0)
BALLS = BallRow(element_diameter=0.030, pitch_diameter=0.225, element_count=16, radial_clearance=10e-6)


def on_rolling(
    assembly: Assembly, rows: Sequence[tuple[RollingRow, ...]], *, stiffness: float = 1.0, turning: bool = True
) -> Assembly:
    """Assembly whose supports have rows in turn, beside their matrices times a factor; cages turn or stand."""
    count = len(assembly.connector_names)
    rows = [rows[n % len(rows)] for n in range(count)]
    sense = np.where(np.arange(count) % 3 == 2, -1.0, 1.0)
    connectors = assembly.connectors
    return replace(
        assembly,
        connectors=connectors._replace(
            stiffness=stiffness * connectors.stiffness,
            damping=stiffness * connectors.damping,
            rolling=rolling_arrays(
                rows,
                scale=sense * np.linspace(1.0, 0.7, count),
                time=np.full(count, 4e-6),
                cage_ratio=np.full(count, 0.43 * turning),
                phase=np.linspace(0.0, 0.3, count),
            ),
        ),
    )
