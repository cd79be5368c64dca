"""What excites: the static transmission error of each pair over the mesh cycle, and its harmonics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exugear.report.findings.context import Context
from exugear.report.findings.stored import StoredResults
from exugear.system.tooth_mesh.laws.iso6336 import iso6336_stiffness
from fe_ste.tools.arrays import Floats

HARMONICS = 6
"""Harmonics of the mesh frequency that are told."""


@dataclass(frozen=True)
class PairExcitation:
    """Static transmission error of a pair at its static load."""

    pair: str
    torque: float
    """On gear 1, N m."""
    position: Floats
    """(n,) in the mesh cycle, 0 to 1."""
    error: Floats
    """(n,) transmission error, m."""
    stiffness: Floats
    """(n,) mesh stiffness, N/m."""
    harmonics: Floats
    """(HARMONICS,) amplitudes of the transmission error at multiples of the mesh frequency, m."""
    pressure: float
    """Highest contact pressure over the cycle, Pa; NaN if the table has none."""
    iso_stiffness: float
    """By ISO 6336-1 method B, N/m."""


def harmonics_of(error: Floats, count: int = HARMONICS) -> Floats:
    """Amplitudes of the harmonics of a curve over one cycle, evenly sampled.

    Examples
    --------
    >>> angle = 2.0 * np.pi * np.arange(16) / 16
    >>> harmonics_of(1.0 + 3.0 * np.cos(angle) - 0.5 * np.sin(2.0 * angle), 3).round(9).tolist()
    [3.0, 0.5, 0.0]
    """
    amplitudes = 2.0 * np.abs(np.fft.rfft(error)) / error.size
    if error.size % 2 == 0:
        amplitudes[-1] *= 0.5
    harmonics = np.zeros(count)
    known = amplitudes[1 : count + 1]
    harmonics[: known.size] = known
    return harmonics


def excitations(context: Context, results: StoredResults) -> tuple[PairExcitation, ...]:
    """Read the static states of all tables."""
    found = []
    for name, table in results.tables.items():
        state = table.static_state
        error = np.asarray(state["ste"].to_numpy(), dtype=np.float64)
        found.append(
            PairExcitation(
                pair=name,
                torque=float(state["torque"]),
                position=np.asarray(state["pmc"].to_numpy(), dtype=np.float64),
                error=error,
                stiffness=np.asarray(state["mesh_stiffness"].to_numpy(), dtype=np.float64),
                harmonics=harmonics_of(error),
                pressure=float(state["max_pressure"].max()) if "max_pressure" in state else float("nan"),
                iso_stiffness=iso6336_stiffness(context.gearbox.pairs[name]),
            )
        )
    return tuple(found)
