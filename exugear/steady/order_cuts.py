"""Orders of a stored steady response as cuts of run-ups give them, and peaks beside what a run-up shows of them."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from exugear.rotating.rotating_frame import SteadyError
from exugear.spectra.order_cut import OrderCut
from exugear.spectra.orders import OrderLine
from exugear.spectra.sweeps import sweep_severity
from exugear.steady.peaks import Peak, peaks
from fe_ste.tools.arrays import Floats

if TYPE_CHECKING:
    import xarray as xr

SAME_ORDER = 1e-6
"""Share by which orders of one line may differ."""
SAME_SPEED = 0.02
"""Share of the speed within which a peak belongs to the crossing of its line with a mode."""
BESIDE = 0.03
"""Share of the speed within which a run-up's peak is looked for: sweeps shift it."""


@dataclass(frozen=True)
class ComparedPeak:
    """A peak of a steady response beside what a run-up shows of it.

    Attributes
    ----------
    peak : Peak
    damping : float or None
        Share of critical damping of the mode that is met there, where one is known.
    run_amplitude : float
        Largest of the run-up near that speed, in the signal's unit.
    severity : float or None
        Of the sweep, as `exugear.spectra.sweeps.sweep_severity` has it.
    run_rank : int
        Place among the peaks by the run-up's amplitude, 1 for the loudest.
    """

    peak: Peak
    damping: float | None
    run_amplitude: float
    severity: float | None
    run_rank: int


def steady_cut(data: xr.Dataset, line: OrderLine, signal: str = "overall_dte") -> OrderCut:
    """Amplitude and phase along an order, as `exugear.spectra.order_cut` cuts them out of run-ups; times are NaN.

    Parameters
    ----------
    data : Dataset
        As `exugear.steady.steady_file.load_response` reads it.
    line : OrderLine
        Of a single mesh frequency or a combination.
    signal : str

    Raises
    ------
    SteadyError
        The response has no such signal or order.
    """
    names, orders = [str(name) for name in data["signal"].to_numpy()], data["order"].to_numpy()
    if signal not in names:
        raise SteadyError(f"no signal {signal!r}; signals are {', '.join(names)}")
    place = int(np.argmin(np.abs(orders - line.order)))
    if abs(orders[place] - line.order) > SAME_ORDER * line.order:
        raise SteadyError(f"no line of order {line.order:g}; the nearest is {orders[place]:g}")
    own = data.isel(line=place, signal=names.index(signal))
    speed: Floats = data["speed"].to_numpy().astype(np.float64)
    amplitude = own["amplitude"].to_numpy() * np.exp(1j * own["phase"].to_numpy())
    return OrderCut(line, np.full(speed.shape, np.nan), speed, line.frequency(speed), amplitude.astype(np.complex128))


def damping_at(data: xr.Dataset, peak: Peak) -> float | None:
    """Damping of the mode that the line of a peak crosses there, None where none is known."""
    orders, near = data["order"].to_numpy(), []
    for crossing in json.loads(data.attrs["crossings"]):
        same = abs(orders[crossing["line"]] - peak.order) < SAME_ORDER * peak.order
        apart = abs(crossing["speed"] - peak.speed)
        if same and apart < SAME_SPEED * abs(peak.speed):
            near.append((apart, float(crossing["damping"])))
    return min(near)[1] if near else None


def compared_peaks(
    data: xr.Dataset, cut: Callable[[OrderLine], OrderCut], rate: float, most: int = 20, signal: str = "overall_dte"
) -> tuple[ComparedPeak, ...]:
    """Loudest peaks of single mesh frequencies beside what a run-up shows of them, the loudest first.

    Parameters
    ----------
    data : Dataset
        Steady response of the same variant.
    cut : callable
        From an order to its cut out of the run-up, as `exugear.spectra.sweeps.run_up_cut` makes it.
    rate : float
        At which order one sweeps, Hz/s.
    most : int
        How many.
    signal : str
    """
    index, orders = data["index"].to_numpy(), data["order"].to_numpy()
    alone = orders[np.count_nonzero(index, axis=1) == 1]
    found = [peak for peak in peaks(data, signal) if np.abs(alone - peak.order).min() < SAME_ORDER * peak.order][:most]
    cuts = {peak.order: cut(OrderLine(peak.line, peak.order)) for peak in found}
    heard = [_near(cuts[peak.order], abs(peak.speed)) for peak in found]
    louder = np.argsort(np.argsort([-amplitude for amplitude in heard], kind="stable"), kind="stable")
    out = []
    for peak, amplitude, place in zip(found, heard, louder, strict=True):
        damping = damping_at(data, peak)
        severity = None if damping is None else sweep_severity(peak.frequency, damping, rate * peak.order)
        out.append(ComparedPeak(peak, damping, amplitude, severity, int(place) + 1))
    return tuple(out)


def _near(cut: OrderCut, speed: float) -> float:
    """Largest amplitude of a cut near a speed, zero where it does not pass."""
    passed = np.abs(np.abs(cut.speed) / speed - 1.0) <= BESIDE
    return float(np.abs(cut.amplitude[passed]).max(initial=0.0))
