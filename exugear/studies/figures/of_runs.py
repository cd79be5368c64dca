"""Figures of runs in time."""

from __future__ import annotations

import numpy as np

from exugear.studies.figures.of_statics import of_planets
from exugear.studies.figures.point_results import PointError, PointResults
from fe_ste.tools.arrays import Floats

SETTLING = 0.25
"""Share of a run that is left out at its beginning."""
OVERALL = "overall_dte"


def _settled(results: PointResults, signal: str) -> Floats:
    """Values of a signal over time, the beginning left out."""
    if signal not in results.run.variables or results.run[signal].dims[:1] != ("time",):
        known = ", ".join(str(name) for name, own in results.run.variables.items() if own.dims[:1] == ("time",))
        raise PointError(f"no signal {signal!r} over time; signals are {known}")
    values = results.run[signal].to_numpy()
    return np.asarray(values[int(SETTLING * len(values)) :], dtype=np.float64)


def rms(results: PointResults, *, signal: str = OVERALL) -> float:
    """Root mean square of a signal about its mean; of several the largest."""
    return float(np.max(np.std(_settled(results, signal), axis=0)))


def peak_to_peak(results: PointResults, *, signal: str = OVERALL) -> float:
    """Peak to peak of a signal; of several the largest."""
    return float(np.max(np.ptp(_settled(results, signal), axis=0)))


def final_speed(results: PointResults) -> float:
    """Speed of the overall input at the end."""
    return float(results.run["input_speed"].to_numpy()[-1])


def dynamic_load_sharing(results: PointResults, *, meshes: str) -> float:
    """Largest mean force among the planets' meshes over the mean of all, in a run."""
    forces = of_planets(results, meshes, _settled(results, "mesh_force")).mean(axis=0)
    return float(forces.max() / forces.mean())


def order_amplitudes(
    results: PointResults, *, centre: float, spacing: float, count: int = 3, signal: str = OVERALL
) -> dict[str, float]:
    """Amplitudes of a signal at orders of the input: a centre and `count` sidebands to either side.

    The run is at constant speed; the orders are read over whole turns of the spacing, so that they do not leak.
    """
    values, time = _settled(results, signal), results.run["time"].to_numpy()
    speed = np.abs(_settled(results, "input_speed"))
    rate = 1.0 / float(time[1] - time[0])
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) / rate
    periods = int(angle[-1] * spacing / (2.0 * np.pi))
    if periods < 1:
        raise PointError(f"the run is shorter than one period of the order {spacing:g}; make it longer")
    whole = int(np.searchsorted(angle, 2.0 * np.pi * periods / spacing))
    orders = {f"{n:+d}" if n else "0": centre + n * spacing for n in range(-count, count + 1)}
    return {
        name: float(2.0 / whole * abs(np.exp(-1j * order * angle[:whole]) @ values[:whole]))
        for name, order in orders.items()
    }
