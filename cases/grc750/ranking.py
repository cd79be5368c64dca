"""GRC 750 kW: resonances at steady speed beside what the run-up of the reference shows of them, for both variants.

    python cases/grc750/ranking.py [results folder]

A sweep through a lightly damped resonance does not build up: where its severity f' / (2 pi zeta^2 f^2) is above 0.3
the run-up ranks it too low. Tables, run-ups and steady responses that are there already are used again.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr
from one_variant import grc_project, show

from exugear import Choice, load_run
from exugear.gearbox.units import RPM
from exugear.results.spectra.resonances import OrderCut, run_up_cut, sweep_rate, sweep_severity
from exugear.results.spectra.waterfall import SAME_ORDER, OrderLine
from exugear.steady.peaks import SWEEP_SHIFT, Peak, peaks

SAME_SPEED = 0.02
"""Share of the speed within which a peak belongs to the crossing of its line with a mode."""


@dataclass(frozen=True)
class ComparedPeak:
    """A peak of a steady-state response and its amplitude in a run-up."""

    peak: Peak
    damping: float | None
    """Share of critical damping of the mode that is met there, where one is known."""
    run_amplitude: float
    """Largest of the run-up near that speed, in the signal's unit."""
    severity: float | None
    """Of the sweep, as `exugear.results.spectra.resonances.sweep_severity` has it."""
    run_rank: int
    """Rank among the peaks by the run-up's amplitude, 1 for the highest."""


def damping_at(data: xr.Dataset, peak: Peak) -> float | None:
    """Damping of the mode that the line of a peak crosses there, None where none is known."""
    orders = data["order"].to_numpy()
    near = []
    for crossing in json.loads(data.attrs["crossings"]):
        same = abs(orders[crossing["line"]] - peak.order) < SAME_ORDER * peak.order
        apart = abs(crossing["speed"] - peak.speed)
        if same and apart < SAME_SPEED * abs(peak.speed):
            near.append((apart, float(crossing["damping"])))
    if near:
        return min(near)[1]
    return None


def compared_peaks(
    data: xr.Dataset, cut: Callable[[OrderLine], OrderCut], rate: float, most: int = 20
) -> tuple[ComparedPeak, ...]:
    """Return the highest peaks of single mesh frequencies with their amplitudes in a run-up, highest first.

    Parameters
    ----------
    data : steady-state response of the same variant
    cut : from an order to its cut out of the run-up, as `exugear.results.spectra.resonances.run_up_cut` makes it
    rate : at which order one sweeps, Hz/s
    most : maximum number of peaks
    """
    index = data["index"].to_numpy()
    orders = data["order"].to_numpy()
    alone = orders[np.count_nonzero(index, axis=1) == 1]
    found = [peak for peak in peaks(data) if np.abs(alone - peak.order).min() < SAME_ORDER * peak.order][:most]
    cuts = {peak.order: cut(OrderLine(peak.line, peak.order)) for peak in found}
    heard = []
    for peak in found:
        own = cuts[peak.order]
        # A run-up that does not pass the speed of a peak has no amplitude there.
        passed = np.abs(np.abs(own.speed) / abs(peak.speed) - 1.0) <= SWEEP_SHIFT
        heard.append(float(np.abs(own.amplitude[passed]).max(initial=0.0)))
    louder = np.argsort(np.argsort([-amplitude for amplitude in heard], kind="stable"), kind="stable")
    out = []
    for peak, amplitude, place in zip(found, heard, louder, strict=True):
        damping = damping_at(data, peak)
        severity = None if damping is None else sweep_severity(peak.frequency, damping, rate * peak.order)
        out.append(ComparedPeak(peak, damping, amplitude, severity, int(place) + 1))
    return tuple(out)


def compared(variant: str) -> tuple[ComparedPeak, ...]:
    """Peaks of a variant."""
    project = grc_project(Choice(variant))
    project.tables()
    stored = load_run(project.run(progress=show).path, ("time", "overall_dte", "input_speed"))
    time, values, speed = (stored[name].to_numpy() for name in ("time", "overall_dte", "input_speed"))

    def cut(line: OrderLine) -> OrderCut:
        return run_up_cut(time, values, speed, line)

    return compared_peaks(project.steady(), cut, sweep_rate(time, speed, 1.0))


def main() -> None:
    """Print a table of each variant."""
    for variant in ("rigid", "bushing"):
        rows = compared(variant)
        print(f"\n{variant}: loudest peaks at steady speed, and in the run-up")
        print("| rank | in the run-up | order | rpm | Hz | damping % | steady µm | run-up µm | dB | severity |")
        for rank, own in enumerate(rows, start=1):
            damping = "" if own.damping is None else f"{100.0 * own.damping:.2f}"
            severity = "" if own.severity is None else f"{own.severity:.2g}"
            change = 20.0 * math.log10(max(own.run_amplitude, 1e-12) / own.peak.amplitude)
            print(
                f"| {rank} | {own.run_rank} | {own.peak.line} | {abs(own.peak.speed) / RPM:.1f} | "
                f"{own.peak.frequency:.0f} | {damping} | {1e6 * own.peak.amplitude:.2f} | "
                f"{1e6 * own.run_amplitude:.2f} | {change:+.1f} | {severity} |"
            )


if __name__ == "__main__":
    main()
