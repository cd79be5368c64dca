"""Steady-state response of a run-up whose torque changes with its speed: each speed is solved at its own load.

Bearings are stiffer under load, so that resonances shift with the torque, by 5 % of their speed for 30 %. Responses of
a few loads cannot be interpolated then: the quadratic through those at 0.7, 1 and 1.3 times a torque is off by 1.1 to
1.8 dB (rms) between them. Models at loads that differ by 4 % are linearly interpolated instead, each at the speeds
whose torque is next to its own. Mesh stiffness follows from the tables of the mean torque, by their curves of load over
deflection.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.balance.response import signals
from exugear.steady.damping_band import damping_limits
from exugear.steady.evaluation.comparison import harmonic_rows, mesh_lines
from exugear.steady.evaluation.run_up import MeasuredTorque
from exugear.steady.point_solver import PointSolver, harmonic_balance_model
from exugear.steady.settings import SteadySettings
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Complexes, Floats

if TYPE_CHECKING:
    import xarray as xr

STEADY_LOAD = 0.02
"""Relative deviation of the torque from its mean up to which the response at the mean is used: 0.17 dB of a level."""
LOAD_STEP = 0.04
"""Relative distance of loads between which responses are interpolated: resonances shift by 0.7 %."""
WIDEST_LOAD = 2.0
"""Ratio of the highest to the lowest torque up to which curves of load over deflection are extrapolated."""


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
