"""Figures of runs in time."""

from __future__ import annotations

import math

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
        known = ", ".join(
            str(name) for name, variable in results.run.variables.items() if variable.dims[:1] == ("time",)
        )
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

    The run is at constant speed and at least two periods of the spacing long.
    """
    orders = {f"{n:+d}" if n else "0": centre + n * spacing for n in range(-count, count + 1)}
    return dict(zip(orders, _at_orders(results, signal, list(orders.values()), spacing), strict=True))


def run_harmonics(results: PointResults, *, mesh: str, count: int = 6, signal: str = OVERALL) -> dict[str, float]:
    """Amplitudes of a signal at the order of a mesh and its multiples, in a run of two turns of the input or more."""
    meshes = {own.family: own.name for own in results.gearbox.meshes}
    if mesh not in meshes:
        raise PointError(f"no meshes {mesh!r}; meshes are {', '.join(meshes)}")
    order = results.gearbox.train.mesh_frequencies(2.0 * math.pi)[meshes[mesh]]
    orders = [n * order for n in range(1, count + 1)]
    return {str(n): value for n, value in enumerate(_at_orders(results, signal, orders, 1.0), start=1)}


def _at_orders(results: PointResults, signal: str, orders: list[float], spacing: float) -> list[float]:
    """Peak amplitudes of a signal at orders of the input, those `spacing` apart told from each other.

    Hann's window over a whole number of periods of the spacing, at least two: its zeros then fall on all neighbours.
    """
    values = _settled(results, signal)
    time = results.run["time"].to_numpy()
    if values.ndim > 1:
        raise PointError(f"signal {signal!r} is one of each mesh or support; orders are read of single signals")
    speed = np.abs(_settled(results, "input_speed"))
    rate = 1.0 / float(time[1] - time[0])
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) / rate
    periods = int(angle[-1] * spacing / (2.0 * math.pi))
    if periods < 2:
        raise PointError(f"the run has {periods} whole periods of the order {spacing:g}, and needs 2; make it longer")
    whole = int(np.searchsorted(angle, 2.0 * math.pi * periods / spacing))
    weights = 1.0 - np.cos(2.0 * math.pi * angle[:whole] / angle[whole])
    weighed = weights * values[:whole] * (2.0 / weights.sum())
    return [float(abs(np.exp(-1j * order * angle[:whole]) @ weighed)) for order in orders]
