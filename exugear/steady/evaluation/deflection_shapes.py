"""Operating deflection shapes: how all bodies vibrate at a resonance of a stored steady-state response.

A stored response has the amplitudes of its signals only. The speeds of the resonances are therefore solved again, and
the coefficients c of one order of the motion u of the averaged system become amplitudes of the coordinates,

    x(t) = Re(X exp(i w t)),   X = 2 T c,   w > 0,

with T from the multi-blade coordinates to the coordinates of each planet at the drawn angle of the carrier. The
carrier turns by a small angle in a period of the vibration: X is the shape as seen while it passes that angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.balance.response import Response, signals
from exugear.steady.harmonics.linear_solvers import HarmonicBalanceError
from exugear.steady.point_solver import PointSolver, harmonic_balance_model
from exugear.steady.steady_file import settings_of
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Complexes

if TYPE_CHECKING:
    import xarray as xr

SAME_STATE = 0.01
"""Relative difference from the stored overall transmission error up to which a state solved again is the stored one.

Methods that are linear in the deflections reproduce it to single precision. With contact loss several states may
exist at a speed, and another one can be found from rest."""


def deflection_shapes(
    assembly: Assembly, data: xr.Dataset, resonances: Sequence[tuple[float, float]]
) -> list[Complexes | None]:
    """Return the operating deflection shapes of a steady-state response at some of its orders and speeds.

    Parameters
    ----------
    assembly : that of the response
    data : as `exugear.steady.steady_file.load_response` reads it
    resonances : order, and speed of the overall input (rad/s) of each shape; both as in the response

    Returns
    -------
    (size,) complex peak amplitude of each coordinate, m and rad; None where the stored state is not found again.
    """
    settings = settings_of(data.attrs)
    model = _model_of(assembly, data)
    shapes: list[Complexes | None] = []
    for order, speed in resonances:
        solver = PointSolver(model, settings.method)
        line = int(np.argmin(np.abs(solver.model.lines.orders - order)))
        point = int(np.argmin(np.abs(data["speed"].to_numpy() - speed)))
        stored = float(data["amplitude"][point, line, 0])
        try:
            response = solver.response(speed)
        except HarmonicBalanceError:
            shapes.append(None)
            continue
        amplitude = 2.0 * abs(complex(signals(solver.model, response)[line, 0]))
        if abs(amplitude - stored) > SAME_STATE * stored:
            shapes.append(None)
            continue
        shapes.append(_amplitudes(model, response, speed)[line])
    return shapes


def motion_at(assembly: Assembly, data: xr.Dataset, speed: float) -> Complexes:
    """Peak amplitudes (lines, size) of all coordinates in all orders of a response at one of its speeds (rad/s).

    Raises
    ------
    HarmonicBalanceError
        The state is not found again from rest, or another one is.
    """
    settings = settings_of(data.attrs)
    model = _model_of(assembly, data)
    solver = PointSolver(model, settings.method)
    response = solver.response(speed)
    point = int(np.argmin(np.abs(data["speed"].to_numpy() - speed)))
    found = 2.0 * np.abs(signals(solver.model, response)[1:, 0])
    stored = np.abs(data["amplitude"].to_numpy()[point, 1:, 0])
    if len(found) != len(stored) or np.linalg.norm(found - stored) > SAME_STATE * np.linalg.norm(stored):
        raise HarmonicBalanceError("another state than the stored one is found at this speed")
    return _amplitudes(model, response, speed)


def _model_of(assembly: Assembly, data: xr.Dataset) -> HarmonicBalanceModel:
    settings = settings_of(data.attrs)
    reach = settings.harmonics, settings.combinations
    return harmonic_balance_model(assembly, settings.speeds.values, *reach, settings.method)


def _amplitudes(model: HarmonicBalanceModel, response: Response, speed: float) -> Complexes:
    shapes: Complexes = 2.0 * response.motion @ model.system.frame.matrices(0.0)[0].T
    # Coefficients go with the angle of the input, which decreases in time at a negative speed.
    return shapes.conj() if speed < 0.0 else shapes
