"""Stiffness and damping of one 6x6 connector on the coordinates of its two bodies, by differences of its force.

Differences, because the axes, arms and angles of `exugear.kernels.connectors` depend on the coordinates, too.
"""

from __future__ import annotations

import numpy as np

from exugear.kernels.connectors import ConnectorArrays, add_wrench, connector_load
from exugear.kernels.coordinates import BODY_SIZE
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import compiled


@compiled
def add_connector_tangents(
    q: Floats, n: int, step: float, connectors: ConnectorArrays, stiffness: Floats, damping: Floats
) -> None:
    """Add minus the derivatives (size, size) of connector n's forces to coordinates q and to velocities, at rest.

    Central differences with `step`, m or rad, and per second.
    """
    size = q.size
    rest, x, f = np.zeros(size), q.copy(), np.zeros(size)
    load, arms = np.empty(BODY_SIZE), np.empty((2, 3))
    ends = connectors.bodies[n]
    for moved in range(2):
        if ends[moved] < 0:
            continue
        for c in range(ends[moved], ends[moved] + BODY_SIZE):
            for sign in (-1.0, 1.0):
                for of_rate in range(2):
                    if of_rate == 0:
                        x[c] = q[c] + sign * step
                    else:
                        rest[c] = sign * step
                    connector_load(x, rest, n, connectors, arms, load)
                    add_wrench(x, ends[0], 1.0, load, arms[0], f)
                    add_wrench(x, ends[1], -1.0, load, arms[1], f)
                    x[c], rest[c] = q[c], 0.0
                    matrix = stiffness if of_rate == 0 else damping
                    # Only coordinates of the two bodies feel the connector.
                    for end in range(2):
                        if ends[end] >= 0:
                            for row in range(ends[end], ends[end] + BODY_SIZE):
                                matrix[row, c] -= sign * f[row] / (2.0 * step)
                                f[row] = 0.0
