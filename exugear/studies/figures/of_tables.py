"""Figures of transmission error tables and of contact over loads and misalignments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exugear.studies.figures.point_results import PointResults
from fe_ste.tools.arrays import Floats

LOADS = (0.25, 0.5, 1.0, 1.5)
"""Loads over the static one that a ripple is looked at."""
MISALIGNMENTS_UM = (-20.0, 0.0, 20.0)
"""Openings at the +z end over the common face width."""
POSITIONS = 16


def ste_peak_to_peak(results: PointResults, *, pair: str) -> float:
    """Peak to peak of the static transmission error of a pair at its static load."""
    return float(np.ptp(results.table(pair).static_state["ste"].to_numpy()))


def ste_harmonic(results: PointResults, *, pair: str, harmonic: int = 1) -> float:
    """Amplitude of a harmonic of the static transmission error of a pair at its static load."""
    ste = results.table(pair).static_state["ste"].to_numpy()
    return float(2.0 * np.abs(np.fft.rfft(ste)[harmonic]) / ste.size)


def mesh_stiffness(results: PointResults, *, pair: str) -> float:
    """Mean of the mesh stiffness of a pair over the cycle at its static load."""
    return float(results.table(pair).static_state["mesh_stiffness"].mean())


def contact_pressure(results: PointResults, *, pair: str) -> float:
    """Highest contact pressure of a pair over the cycle at its static load."""
    return float(results.table(pair).static_state["max_pressure"].max())


def ripples(ste: Floats) -> Floats:
    """Peak to peak over positions (the first axis) of a transmission error."""
    return np.asarray(np.ptp(ste, axis=0), dtype=np.float64)


def worst_ripple(
    results: PointResults,
    *,
    pair: str,
    torque_factors: Sequence[float] = LOADS,
    misalignment_um: Sequence[float] = MISALIGNMENTS_UM,
    positions: int = POSITIONS,
) -> float:
    """Largest peak to peak of the static transmission error over loads and misalignments."""
    data = results.states(pair, positions, torque_factors, misalignment_um)
    return float(ripples(data["ste"].to_numpy()).max())


def mean_ripple(
    results: PointResults,
    *,
    pair: str,
    torque_factors: Sequence[float] = LOADS,
    misalignment_um: Sequence[float] = MISALIGNMENTS_UM,
    positions: int = POSITIONS,
) -> float:
    """Mean peak to peak of the static transmission error over loads and misalignments."""
    data = results.states(pair, positions, torque_factors, misalignment_um)
    return float(ripples(data["ste"].to_numpy()).mean())


def worst_pressure(
    results: PointResults,
    *,
    pair: str,
    torque_factors: Sequence[float] = LOADS,
    misalignment_um: Sequence[float] = MISALIGNMENTS_UM,
    positions: int = POSITIONS,
) -> float:
    """Highest contact pressure inside the flank over loads and misalignments."""
    data = results.states(pair, positions, torque_factors, misalignment_um)
    return float(data["max_pressure"].max())
