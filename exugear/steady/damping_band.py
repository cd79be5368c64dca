"""How high the peaks of a steady response are at both ends of the plausible range of damping.

Damping is the most uncertain input of a gearbox model. The highest peaks are therefore solved again with the lowest and
the highest plausible damping (`damping.modal_band_percent`; half and twice the damping without it), at some speeds
about each peak, where its maximum may have moved. Methods that are linear in the deflections only: with contact loss
another damping may lead to another state.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from exugear.gearbox.load_cases import operating_range
from exugear.steady.balance.excitation import HarmonicBalanceModel
from exugear.steady.balance.response import linear_response, parametric_response, signals
from exugear.steady.harmonics.branches import standing_peaks
from exugear.steady.mean_system.mean_system import MeanSystem
from exugear.steady.mean_system.signals import Quantity
from exugear.steady.settings import Method
from exugear.system.kernels.modal_damping import modal_matrix
from exugear.system.modal_damping import with_modal_damping
from fe_ste.tools.arrays import Booleans, Floats, Integers, SingleComplexes
from fe_ste.tools.threads import side_by_side

FACTORS = (0.5, 2.0)
"""Factors on the damping where the file states no range."""
MOST_PEAKS = 20
"""Highest peaks of each quantity that are solved again."""
ABOUT = (0.0, -0.006, -0.003, -0.001, 0.001, 0.003, 0.006)
"""Speeds about a peak at which it is solved again, relative to its own, this one first."""
ABOUT_WITH_RING = (0.0, -0.003, 0.003)
"""The same with a flexible ring gear, where a solution takes a hundred times as long."""


@dataclass(frozen=True, eq=False)
class DampingBand:
    """Amplitudes of the highest peaks at both ends of the range of damping; k peaks, s quantities."""

    point: Integers
    line: Integers
    """(k,) place of each peak among the points and the lines of the response."""
    amplitude: Floats
    """(k, s, 2) with the lowest and with the highest damping, in the quantities' units."""
    quantities: tuple[str, ...]
    """Names of the quantities, see `exugear.steady.mean_system.signals.Quantity`."""

    def variables(self) -> dict[str, tuple[tuple[str, ...], Any, dict[str, str]]]:
        """Variables of a dataset, with their dimensions and attributes."""
        words = "peak amplitude with the lowest and the highest plausible damping"
        return {
            "band_point": (("peak",), self.point, {"long_name": "point of the response"}),
            "band_line": (("peak",), self.line, {"long_name": "line of the response"}),
            "band_amplitude": (
                ("peak", "quantity", "damping_limit"),
                self.amplitude,
                {"long_name": words, "units": "m, N, m/s2, m/s2, m/s"},
            ),
        }


def damping_band(model: HarmonicBalanceModel, method: Method, speed: Floats, amplitude: SingleComplexes) -> DampingBand:
    """Solve the highest peaks of a response again with the lowest and the highest plausible damping.

    Parameters
    ----------
    model : with linear bearings, of a mesh model without contact loss
    method : ``linear`` or ``parametric``
    speed : (points,) of the overall input, rad/s, ascending
    amplitude : (points, lines, signals) of the response, of line 0 the mean
    """
    quantities = model.quantities
    point, line, rises = _highest_peaks(model, quantities, speed, amplitude)
    found = np.zeros((len(point), len(quantities), 2))
    respond = {"linear": linear_response, "parametric": parametric_response}[method]
    damped = [model.with_system(system) for system in damping_limits(model.system)]
    beside = ABOUT_WITH_RING if model.waves.neighbours else ABOUT
    solves = list(product(range(len(damped)), np.unique(point), beside))

    def sizes_at(solve: tuple[int, int, float]) -> Floats:
        """Sizes (lines, s) of the quantities in one solution."""
        end, at, about = solve
        response = respond(damped[end], damped[end].at(float(speed[at]) * (1.0 + about)))
        own_signals = 2.0 * signals(damped[end], response)[line[point == at]]
        return np.stack([quantity.sizes(own_signals).max(axis=1) for quantity in quantities], axis=1)

    sizes_of_all = side_by_side(sizes_at, solves) if model.waves.neighbours else map(sizes_at, solves)
    for (end, at, about), sizes in zip(solves, sizes_of_all, strict=True):
        here = point == at
        # A quantity without a peak there counts at the peak's speed: beside it others may rise.
        counts = rises[here] | (about == 0.0)
        found[here, :, end] = np.maximum(found[here, :, end], np.where(counts, sizes, 0.0))
    return DampingBand(point, line, found, tuple(quantity.name for quantity in quantities))


def damping_limits(system: MeanSystem) -> tuple[MeanSystem, MeanSystem]:
    """Return an averaged system with the lowest and with the highest plausible damping.

    Gyroscopic and Coriolis terms stay as they are: they do not dissipate.
    """
    assembly = system.frame.assembly
    band = assembly.gearbox.case.damping.modal_band_percent
    present = system.at(system.damping, 0.0)
    present = 0.5 * (present + present.T)
    changes = [(factor - 1.0) * present for factor in FACTORS]
    if band is not None:
        # Dampers with stated values are no less certain than the rest of the model, and stay.
        turned = system.frame.matrices(0.0)[0]
        still = np.zeros(assembly.size)
        now = modal_matrix(still, assembly.modal)
        undamped = replace(assembly, modal=None)
        limits = (modal_matrix(still, with_modal_damping(undamped, percent).modal) for percent in band)
        changes = [turned.T @ (limit - now) @ turned for limit in limits]
    return (
        replace(system, damping=system.damping + changes[0]),
        replace(system, damping=system.damping + changes[1]),
    )


def _highest_peaks(
    model: HarmonicBalanceModel, quantities: tuple[Quantity, ...], speed: Floats, amplitude: SingleComplexes
) -> tuple[Integers, Integers, Booleans]:
    """Points (k,) and lines (k,) of the highest peaks of any quantity, and which quantities (k, s) have one there.

    Within the operating range, where the file has one and the response reaches it.
    """
    stated = operating_range(model.waves.assembly.gearbox)
    inside = np.ones(len(speed), dtype=bool)
    if stated is not None:
        within = (np.abs(speed) >= stated[0]) & (np.abs(speed) <= stated[1])
        if within.any():
            inside = within
    chosen: set[tuple[int, int]] = set()
    of_quantity: list[set[tuple[int, int]]] = []
    for quantity in quantities:
        size = quantity.sizes(amplitude[:, 1:]).max(axis=2)
        peaks = [
            (int(point), line)
            for line, amplitudes in enumerate(size.T, start=1)
            for point in standing_peaks(amplitudes)
        ]
        of_quantity.append(set(peaks))
        peaks = sorted((peak for peak in peaks if inside[peak[0]]), key=lambda peak: -size[peak[0], peak[1] - 1])
        chosen |= {peak for peak in peaks[:MOST_PEAKS] if size[peak[0], peak[1] - 1] > 0.0}
    ordered = sorted(chosen)
    rises = np.array([[peak in peaks for peaks in of_quantity] for peak in ordered], dtype=bool)
    point, line = np.array(ordered, dtype=np.int64).reshape(-1, 2).T
    return point, line, rises.reshape(len(ordered), len(quantities))


def no_band(quantities: tuple[str, ...]) -> DampingBand:
    """Return the band of a response that has none: with contact loss, or along a branch."""
    none = np.zeros(0, dtype=np.int64)
    return DampingBand(none, none, np.zeros((0, len(quantities), 2)), quantities)
