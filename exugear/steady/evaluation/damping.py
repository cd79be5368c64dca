"""Amplitudes with the lowest and the highest plausible damping over all speeds of a response, for the band of a cut."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from exugear.steady.balance.response import signals
from exugear.steady.damping_band import damping_limits
from exugear.steady.point_solver import PointSolver, harmonic_balance_model
from exugear.steady.settings import SteadySettings
from exugear.system.system import Assembly
from fe_ste.tools.arrays import SingleComplexes

if TYPE_CHECKING:
    import xarray as xr


def damping_extremes(assembly: Assembly, response: xr.Dataset, settings: SteadySettings) -> SingleComplexes | None:
    """Amplitudes (2, points, lines, signals) at the speeds of a response with the lowest and the highest damping.

    None for the method `nonlinear`, where another damping may lead to another state.

    Parameters
    ----------
    assembly, settings : those of the response
    """
    if settings.method == "nonlinear":
        return None
    speed = response["speed"].to_numpy()
    model = harmonic_balance_model(assembly, speed, int(response.attrs["harmonics"]), settings.combinations)
    found = np.zeros((2, *response["amplitude"].shape), dtype=np.complex64)
    for end, system in enumerate(damping_limits(model.system)):
        damped = model.with_system(system)
        solver = PointSolver(damped, settings.method)
        for point, own in enumerate(speed):
            found[end, point] = 2.0 * signals(damped, solver.response(float(own)))[:, : found.shape[-1]]
    return found
