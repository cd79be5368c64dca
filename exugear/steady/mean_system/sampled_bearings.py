"""The law of rolling bearings on many samples at once: forces and their slopes, by the kernel of runs in time."""

from __future__ import annotations

import numpy as np

from exugear.system.bearings.kernels.rolling import (
    ELASTIC_PART,
    RollingArrays,
    rolling_memory,
    rolling_tangent,
    set_force,
    sum_rows,
)
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel
from fe_ste.tools.inner_kernels import kept_bundle


def sample_rolling(rolling: RollingArrays, law: int, readings: Floats) -> tuple[Floats, Floats]:
    """Sample the law of one bearing.

    Parameters
    ----------
    law : which of them
    readings : (s, 5) displacement and tilts, ahead by the time of the damping, m and rad

    Returns
    -------
    force : (s, 5) N and N m
    slope : (s, 5, 5) its derivatives by the readings
    """
    force = np.empty(readings.shape)
    slope = np.empty((*readings.shape, readings.shape[1]))
    _fill(law, np.ascontiguousarray(readings), np.zeros(6), kept_bundle(rolling), rolling_memory(rolling), force, slope)
    return force, slope


@kernel
def _fill(
    law: int, readings: Floats, still: Floats, rolling: RollingArrays, memory: Floats, force: Floats, slope: Floats
) -> None:
    for s in range(readings.shape[0]):
        about_axis = sum_rows(law, readings[s], still, 0.0, 0.0, rolling, memory)
        set_force(law, ELASTIC_PART, readings[s], about_axis, rolling, memory)
        for i in range(readings.shape[1]):
            force[s, i] = memory[ELASTIC_PART + i]
        rolling_tangent(law, readings[s], 0.0, rolling, slope[s])
