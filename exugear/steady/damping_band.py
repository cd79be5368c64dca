"""How high the peaks of a steady response are at both ends of the plausible range of damping.

Damping is the most uncertain input of a gearbox model. The highest peaks are therefore solved again with the lowest and
the highest plausible damping (`damping.modal_band_percent`; half and twice the damping without it). They are solved at
three speeds about each peak, whose top may have moved, and the curve of a resonance goes through the three. This holds
for methods that are linear in the deflections only: with contact loss another damping may lead to another state.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from exugear.gearbox.load_cases import operating_range
from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.balance.response import linear_response, parametric_response, signals
from exugear.steady.crossings import in_operation
from exugear.steady.mean_system.mean_system import MeanSystem
from exugear.steady.mean_system.signals import Quantity
from exugear.steady.settings import Method
from exugear.system.kernels.modal_damping import modal_matrix
from exugear.system.modal_damping import with_modal_damping
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers, SingleComplexes
from fe_ste.tools.processes import each_in_forks

FACTORS = (0.5, 2.0)
"""Factors on the damping where the file states no range."""
MOST_PEAKS = 20
"""Highest peaks of each quantity that are solved again."""
BESIDE = 0.004
"""Distance of the speeds on either side of a peak at which it is solved again, relative to its own speed."""
RELEVANT, BESIDE_PEAK = 3e-4, 0.03
"""Shares of the deflections of the meshes, and of those in the line of a peak, from which a line beside others is
solved again with the peak."""
MOST_RISE = 1.1
"""Limit of the top of a curve, over the highest amplitude that was solved."""


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


def damping_band(
    model: HarmonicBalanceModel, method: Method, speed: Floats, amplitude: SingleComplexes, jumps: Booleans
) -> DampingBand:
    """Solve the highest peaks of a response again with the lowest and the highest plausible damping.

    Parameters
    ----------
    model : with linear bearings, of a mesh model without contact loss
    method : ``linear`` or ``parametric``
    speed : (points,) of the overall input, rad/s, ascending
    amplitude : (points, lines, signals) of the response, of line 0 the mean
    jumps : (points,) points beside a jump of the response, which are no peaks
    """
    quantities = model.quantities
    counted = in_operation(speed, operating_range(model.waves.assembly.gearbox)) & ~jumps
    point, line, rises = _highest_peaks(quantities, amplitude, counted)
    found = np.zeros((len(point), len(quantities), 2))
    respond = {"linear": linear_response, "parametric": parametric_response}[method]
    ends = damping_limits(model.system)
    whole = [model.with_system(system) for system in ends]

    def limits_at(at: int) -> Floats:
        """Amplitudes (peaks, s, 2) of the peaks at one point."""
        own = line[point == at]
        few = with_relevant_lines(model, amplitude[at], own)
        places = few.lines.find(model.lines.index[own])[0]

        def sizes(damped: HarmonicBalanceModel, beside: float = 0.0) -> Floats:
            """Sizes (peaks, s) of the quantities."""
            response = respond(damped, damped.at(float(speed[at]) * (1.0 + beside)))
            return sizes_of(2.0 * signals(damped, response)[places])

        def sizes_of(own_signals: Complexes) -> Floats:
            return np.stack([quantity.sizes(own_signals).max(axis=1) for quantity in quantities], axis=1)

        limits = np.zeros((len(own), len(quantities), 2))
        for end, system in enumerate(ends):
            damped = whole[end] if few is model else few.with_system(system)
            before, middle, after = (sizes(damped, beside) for beside in (-BESIDE, 0.0, BESIDE))
            # A quantity without a peak there counts at the peak's speed: beside it others may rise.
            limits[..., end] = np.where(rises[point == at], resonance_top(before, middle, after), middle)
        if few is model:
            return limits
        # What the lines left out add is taken to change with the damping as all others do.
        present = sizes_of(amplitude[at, own].astype(np.complex128))
        return np.asarray(limits * (present / np.maximum(sizes(few), 1e-300))[..., None])

    points = np.unique(point).tolist()
    for at, limits in zip(points, each_in_forks(limits_at, points), strict=True):
        found[point == at] = limits
    return DampingBand(point, line, found, tuple(quantity.name for quantity in quantities))


def with_relevant_lines(
    model: HarmonicBalanceModel, amplitude: SingleComplexes, wanted: Integers
) -> HarmonicBalanceModel:
    """Leave out lines beside others that hardly vibrate at one point; where nothing couples them, all lines stay.

    Parameters
    ----------
    amplitude : (lines, signals) of the response there
    wanted : lines that stay
    """
    if not model.waves.neighbours:
        return model
    read = [name.quantity == "mesh_dte" for name in model.signal_names]
    deflection = np.linalg.norm(np.abs(amplitude[:, read]).astype(np.float64), axis=1)
    least = min(RELEVANT * float(np.linalg.norm(deflection[1:])), BESIDE_PEAK * float(deflection[wanted].min()))
    kept = ~model.beside_others | (deflection > least)
    kept[wanted] = True
    return model.of(kept)


def resonance_top(before: Floats, middle: Floats, after: Floats) -> Floats:
    """Highest amplitudes of resonance curves through amplitudes at three speeds of equal distance.

    Near a resonance of light damping, the square of the reciprocal amplitude is a parabola over speed. Where its top
    lies far outside the three speeds, or far above them, it is limited.

    Examples
    --------
    Amplitudes of a mode with 1 % damping, whose top of 50 lies between two of the speeds:

    >>> at = 1.003 * np.array([0.996, 1.0, 1.004])
    >>> print(round(float(resonance_top(*(1.0 / np.hypot(1.0 - at**2, 0.02 * at))[:, None])[0]), 1))
    50.0
    """
    solved = np.maximum(np.maximum(before, middle), after)
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second, third = (1.0 / amplitude**2 for amplitude in (before, middle, after))
        bend = 0.5 * (first + third) - second
        slope = 0.5 * (third - first)
        at = np.clip(np.where(bend > 0.0, -0.5 * slope / bend, 0.0), -1.5, 1.5)
        top = second + slope * at + bend * at**2
        curve = np.where(top > 0.0, 1.0 / np.sqrt(top), np.inf)
    return np.fmax(solved, np.where(bend > 0.0, np.fmin(curve, MOST_RISE * solved), solved))


def damping_limits(system: MeanSystem) -> tuple[MeanSystem, MeanSystem]:
    """Return an averaged system with the lowest and with the highest plausible damping.

    Gyroscopic and Coriolis terms stay as they are: they do not dissipate.
    """
    assembly = system.frame.assembly
    band = assembly.gearbox.case.damping.modal_band_percent
    present = system.at(system.damping, 0.0)
    present = 0.5 * (present + present.T)
    changes = [(factor - 1.0) * present for factor in FACTORS]
    factors = FACTORS
    if band is not None:
        # Dampers with stated values are no less certain than the rest of the model, and stay.
        turned = system.frame.matrices(0.0)[0]
        still = np.zeros(assembly.size)
        now = modal_matrix(still, assembly.modal)
        undamped = replace(assembly, modal=None)
        limits = (modal_matrix(still, with_modal_damping(undamped, percent).modal) for percent in band)
        changes = [turned.T @ (limit - now) @ turned for limit in limits]
        factors = (1.0, 1.0)
    lowest, highest = (
        replace(system, damping=system.damping + change, damper_factor=factor)
        for change, factor in zip(changes, factors, strict=True)
    )
    return lowest, highest


def _highest_peaks(
    quantities: tuple[Quantity, ...], amplitude: SingleComplexes, counted: Booleans
) -> tuple[Integers, Integers, Booleans]:
    """Points (k,) and lines (k,) of the highest peaks of any quantity, and which quantities (k, s) have one there.

    Peaks count at the points that are `counted`.
    """
    chosen: set[tuple[int, int]] = set()
    of_quantity: list[set[tuple[int, int]]] = []
    for quantity in quantities:
        size = quantity.sizes(amplitude[:, 1:]).max(axis=2)
        peaks = quantity.peaks(size, counted[:, None])
        of_quantity.append(set(peaks))
        chosen |= set(peaks[:MOST_PEAKS])
    ordered = sorted(chosen)
    rises = np.array([[peak in peaks for peaks in of_quantity] for peak in ordered], dtype=bool)
    point, line = np.array(ordered, dtype=np.int64).reshape(-1, 2).T
    return point, line + 1, rises.reshape(len(ordered), len(quantities))


def no_band(quantities: tuple[str, ...]) -> DampingBand:
    """Return the band of a response that has none: with contact loss, or along a branch."""
    none = np.zeros(0, dtype=np.int64)
    return DampingBand(none, none, np.zeros((0, len(quantities), 2)), quantities)
