"""Amplitudes with the lowest and the highest plausible damping over all speeds of a response, for the band of a cut."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from exugear.results.spectra.waterfall import OrderLine
from exugear.steady.evaluation.comparison import mesh_lines, transfers_of
from exugear.steady.evaluation.load_over_speed import LoadedModels
from exugear.steady.evaluation.run_up import MeasuredRunUp
from exugear.steady.settings import SteadySettings
from exugear.steady.steady_file import complex_amplitudes
from fe_ste.tools.arrays import Complexes, Floats, Integers, SingleComplexes

if TYPE_CHECKING:
    import xarray as xr

RESOLVED = 3e-4
"""Error of a response between the speeds at which the band is solved, relative to its highest amplitude. Resonances
with half the damping are half as wide; the band then errs by up to 0.2 dB, by 0.01 dB at 99 of 100 speeds.
"""
COARSEST = 4
"""Least distance of these speeds, in speeds of the response."""


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
