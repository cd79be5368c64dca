"""Steady-state response of a run-up whose torque changes with its speed: each speed is solved at its own load.

Bearings are stiffer under load, so that resonances shift with the torque, by 5 % of their speed for 30 %. Responses of
a few loads cannot be interpolated then: the quadratic through those at 0.7, 1 and 1.3 times a torque is off by 1.1 to
1.8 dB (rms) between them. Models at loads that differ by 4 % are linearly interpolated instead, each at the speeds
whose torque is next to its own. Mesh stiffness follows from the tables of the mean torque, by their curves of load over
deflection. The band of plausible damping and the levels of a fit come from the same models.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from exugear.results.spectra.waterfall import OrderLine
from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.balance.response import signals
from exugear.steady.damping_band import damping_limits
from exugear.steady.evaluation.comparison import ComparedCuts, harmonic_rows, mesh_lines, swept_lines, transfers_of
from exugear.steady.evaluation.run_up import MeasuredRunUp, MeasuredTorque
from exugear.steady.point_solver import PointSolver, harmonic_balance_model
from exugear.steady.settings import SteadySettings
from exugear.steady.steady_file import complex_amplitudes
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Complexes, Floats, Integers, SingleComplexes

if TYPE_CHECKING:
    import xarray as xr

STEADY_LOAD = 0.02
"""Relative deviation of the torque from its mean up to which the response at the mean is used: 0.17 dB of a level."""
LOAD_STEP = 0.04
"""Relative distance of loads between which responses are interpolated: resonances shift by 0.7 %."""
WIDEST_LOAD = 2.0
"""Ratio of the highest to the lowest torque up to which curves of load over deflection are extrapolated."""
RESOLVED = 3e-4
"""Error of a response between the speeds at which the band is solved, relative to its highest amplitude. Resonances
with half the damping are half as wide; the band then errs by up to 0.2 dB, by 0.01 dB at 99 of 100 speeds.
"""
COARSEST = 4
"""Least distance of these speeds, in speeds of the response."""
SPEEDS = 240
"""Number of equidistant speeds of a response in a fit; they resolve half-power widths of 1 % of the speed."""


def loads_of(torque: MeasuredTorque | None) -> tuple[float, ...]:
    """Torques at which the gearbox is modelled, over the mean, ascending.

    It is the mean alone if the torque over speed stays near it, changes its sign, or varies by more than a factor of 2.

    Examples
    --------
    >>> speed = np.linspace(50.0, 100.0, 5000)
    >>> [round(load, 3) for load in loads_of(MeasuredTorque.of("input", np.linspace(108.0, 92.0, 5000), speed))]
    [0.922, 0.951, 0.981, 1.013, 1.045, 1.078]
    >>> loads_of(MeasuredTorque.of("input", np.linspace(101.0, 99.0, 5000), speed))
    (1.0,)
    """
    if torque is None or not torque.ends[0] * torque.ends[1] > 0.0:
        return (1.0,)
    ratio = torque.over_speed / torque.mean
    lowest, highest = float(ratio.min()), float(ratio.max())
    if max(1.0 - lowest, highest - 1.0) <= STEADY_LOAD or highest > WIDEST_LOAD * lowest:
        return (1.0,)
    count = 1 + math.ceil(math.log(highest / lowest) / math.log(1.0 + LOAD_STEP))
    return tuple(np.geomspace(lowest, highest, count).tolist())


@dataclass(frozen=True, eq=False)
class LoadedModels:
    """Models of a gearbox at the loads of a run-up."""

    models: tuple[HarmonicBalanceModel, ...]
    loads: tuple[float, ...]
    """Torques of the models over the mean torque, ascending."""
    torque: MeasuredTorque | None

    @classmethod
    def of(
        cls,
        assembly_at: Callable[[float], Assembly],
        torque: MeasuredTorque | None,
        speeds: Floats,
        harmonics: int,
        settings: SteadySettings,
    ) -> LoadedModels:
        """Build the models at the speeds of the input (rad/s).

        Parameters
        ----------
        assembly_at : gearbox at a torque over the mean torque
        """
        loads = loads_of(torque)
        reach = harmonics, settings.combinations
        models = [harmonic_balance_model(assembly_at(load), speeds, *reach, settings.method) for load in loads]
        return cls(tuple(models), loads, torque)

    def damped(self, end: int) -> LoadedModels:
        """Return the same models with the lowest (0) or the highest (1) plausible damping."""
        return replace(self, models=tuple(own.with_system(damping_limits(own.system)[end]) for own in self.models))

    @property
    def signal_names(self) -> list[str]:
        """Names of the signals."""
        return [signal.name for signal in self.models[0].signal_names]

    def weights(self, speed: Floats) -> Floats:
        """Shares (loads, points) of the models at speeds of the input (rad/s, either sign); at most two are not zero.

        Examples
        --------
        >>> torque = MeasuredTorque.of("input", np.linspace(108.0, 92.0, 5000), np.linspace(50.0, 100.0, 5000))
        >>> LoadedModels((), (0.9, 1.0, 1.1), torque).weights(np.array([-75.0, 87.5])).round(2)
        array([[0. , 0.4],
               [1. , 0.6],
               [0. , 0. ]])
        """
        if self.torque is None or len(self.loads) == 1:
            return np.ones((1, speed.size))
        at = np.interp(np.abs(speed), self.torque.speed, self.torque.over_speed / self.torque.mean)
        return np.array([np.interp(at, self.loads, unit) for unit in np.eye(len(self.loads))])

    def amplitudes(self, speed: Floats, settings: SteadySettings, harmonics: int, lines: Sequence[str]) -> Complexes:
        """Complex amplitudes (points, lines, signals) of orders at speeds of the input, rad/s.

        Parameters
        ----------
        harmonics : number of harmonics among the names
        lines : names of mesh frequencies and their harmonics
        """
        found = np.zeros((speed.size, len(lines), len(self.signal_names)), dtype=np.complex128)
        for model, weight in zip(self.models, self.weights(speed), strict=True):
            rows = harmonic_rows(model.lines.index, model.base_names, harmonics)
            places = [rows[name] for name in lines]
            solver = PointSolver(model, settings.method)
            for point in np.flatnonzero(weight):
                response = solver.response(float(speed[point]))
                found[point] += 2.0 * weight[point] * signals(model, response)[places]
        return found

    def response(self, at_mean: xr.Dataset, settings: SteadySettings, harmonics: int) -> xr.Dataset:
        """Response at the torque of each speed: the one at the mean with its mesh orders replaced.

        Parameters
        ----------
        at_mean : as of `exugear.steady.steady_file.stored_or_computed`, with the settings
        harmonics : of each mesh frequency that are replaced
        """
        if len(self.loads) == 1:
            return at_mean
        rows = mesh_lines(at_mean, harmonics)
        places, count = np.array([*rows.values()]), at_mean.sizes["signal"]
        own = self.amplitudes(at_mean["speed"].to_numpy(), settings, harmonics, [*rows])[..., :count]
        size, phase = at_mean["amplitude"].to_numpy().copy(), at_mean["phase"].to_numpy().copy()
        size[:, places], phase[:, places] = np.abs(own), np.angle(own)
        over = at_mean["amplitude"].dims
        return at_mean.assign(amplitude=(over, size), phase=(over, phase))


def damping_extremes(
    models: LoadedModels,
    response: xr.Dataset,
    settings: SteadySettings,
    run_up: MeasuredRunUp,
) -> SingleComplexes:
    """Amplitudes (2, points, lines, signals) of the compared orders with the lowest and the highest damping.

    They are solved at as many speeds as the compared orders of the channels need, and interpolated between them; other
    orders are zero. The method `nonlinear`, where another damping may lead to another state, has no band.

    Parameters
    ----------
    models : of the response
    response : with the load over speed
    settings : those of the response
    run_up : the run-up whose channels and orders are compared
    """
    from scipy.interpolate import CubicSpline

    speed, harmonics = response["speed"].to_numpy(), run_up.section.harmonics
    rows = mesh_lines(response, harmonics)
    lines = [OrderLine(name, float(response["order"][row])) for name, row in rows.items()]
    places = np.array([*rows.values()])
    names = [str(name) for name in response["signal"].to_numpy()]
    ascending, transfer = transfers_of(run_up, names, speed, lines, [complex_amplitudes(response)[:, places]])
    solved = ascending[resolving_places(ascending, transfer.reshape(-1, ascending.size).T, RESOLVED)]
    found = np.zeros((2, *response["amplitude"].shape), dtype=np.complex64)
    for end in (0, 1):
        damped = models.damped(end)
        own = damped.amplitudes(np.sign(speed[0]) * solved, settings, harmonics, [*rows])
        found[end][:, places] = CubicSpline(solved, own[..., : len(names)])(np.abs(speed))
    return found


def resolving_places(at: Floats, values: Complexes, tolerance: float) -> Integers:
    """Places of a part of the points between which a cubic spline gives the others.

    Parameters
    ----------
    at : (n,) ascending
    values : (n, k) of each point
    tolerance : largest error, relative to the highest magnitude of each column

    Examples
    --------
    Of a resonance with 0.2 % damping all points are taken, and every fourth away from it:

    >>> x = np.linspace(0.5, 1.5, 1001)
    >>> places = resolving_places(x, 1.0 / (1.0 - x**2 + 0.004j * x)[:, None], 1e-4)
    >>> bool(np.all(np.diff(places[np.abs(x[places] - 1.0) < 0.004]) == 1)), int(np.diff(places).max())
    (True, 4)
    """
    from scipy.interpolate import CubicSpline

    places = np.unique(np.append(np.arange(0, at.size, COARSEST), at.size - 1))
    highest = np.abs(values).max(axis=0)
    known = values[:, highest > 0.0] / highest[highest > 0.0]
    while places.size < at.size and known.size:
        error = np.abs(CubicSpline(at[places], known[places])(at) - known).max(axis=1)
        gaps = [(low, high) for low, high in pairwise(places) if high - low > 1]
        wrong = [(low + high) // 2 for low, high in gaps if error[low + 1 : high].max() > tolerance]
        if not wrong:
            break
        places = np.union1d(places, wrong)
    return places


def response_levels(
    assembly_at: Callable[[float], Assembly], cuts: ComparedCuts, settings: SteadySettings, harmonics: int
) -> Floats:
    """Levels (channels, lines, windows), dB re 1 SI unit, that the measurement would show of a gearbox.

    Parameters
    ----------
    assembly_at : gearbox at a torque over the mean torque of the run-up
    cuts : comparison with the response at the start, whose orders and windows are used
    settings : of that response; its range of speeds is used with fewer speeds
    harmonics : of that response
    """
    speeds = np.linspace(settings.speeds.first, settings.speeds.last, SPEEDS)
    models = LoadedModels.of(assembly_at, cuts.run_up.torque, speeds, harmonics, settings)
    names = [line.name for line in cuts.lines]
    amplitude = models.amplitudes(speeds, settings, cuts.run_up.section.harmonics, names).astype(np.complex64)
    speed, transfer = transfers_of(cuts.run_up, models.signal_names, speeds, cuts.lines, [amplitude])
    swept = swept_lines(speed, transfer, cuts.lines, cuts.run_up, cuts.speed.size)
    return np.asarray(20.0 * np.log10(np.abs(swept)))
