"""Peaks of a stored steady response: which line is loud at which speed, and how wide its peak is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from exugear.rotating.rotating_frame import SteadyError
from fe_ste.tools.arrays import Floats

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Peak:
    """A line of a signal where it is loudest.

    Attributes
    ----------
    line : str
        Such as ``2 x intermediate``.
    order : float
        Periods per turn of the input.
    speed : float
        Of the input, rad/s.
    frequency : float
        Hz.
    amplitude : float
        In the signal's unit.
    """

    line: str
    order: float
    speed: float
    frequency: float
    amplitude: float


def line_name(index: tuple[int, ...], bases: tuple[str, ...]) -> str:
    """Name of a line from its multiples of the bases, each base by the first of its meshes.

    Examples
    --------
    >>> line_name((0, 2), ("sun_planet, ring_planet", "high_speed"))
    '2 x high_speed'
    >>> line_name((-1, 1), ("sun_planet, ring_planet", "high_speed"))
    'high_speed - sun_planet'
    """
    words = []
    for multiple, base in sorted(zip(index, bases, strict=True), key=lambda item: -item[0]):
        if multiple:
            times = "" if abs(multiple) == 1 else f"{abs(multiple)} x "
            words.append(("- " if multiple < 0 else "+ ") + times + base.split(", ")[0])
    return " ".join(words).removeprefix("+ ") or "mean"


def peaks(data: xr.Dataset, signal: str = "overall_dte", least: float = 0.01) -> tuple[Peak, ...]:
    """Local maxima over speed of all lines of a signal, the loudest first.

    Parameters
    ----------
    data : Dataset
        As `exugear.steady.steady_file.load_response` reads it.
    signal : str
    least : float
        Share of the loudest below which a peak is left out.

    Raises
    ------
    SteadyError
        The response has no such signal.
    """
    names = [str(name) for name in data["signal"].to_numpy()]
    if signal not in names:
        raise SteadyError(f"no signal {signal!r}; signals are {', '.join(names)}")
    values: Floats = data["amplitude"].to_numpy()[:, 1:, names.index(signal)].astype(np.float64)
    speed: Floats = data["speed"].to_numpy()
    padded = np.pad(values, ((1, 1), (0, 0)), constant_values=-np.inf)
    highest = (values >= padded[:-2]) & (values > padded[2:]) & (values >= least * values.max(initial=0.0))
    bases = tuple(str(name) for name in data["base"].to_numpy())
    index, orders = data["index"].to_numpy(), data["order"].to_numpy()
    found = [
        Peak(
            line=line_name(tuple(int(n) for n in index[line + 1]), bases),
            order=float(orders[line + 1]),
            speed=float(speed[point]),
            frequency=float(orders[line + 1] * abs(speed[point]) / (2.0 * np.pi)),
            amplitude=float(values[point, line]),
        )
        for point, line in zip(*np.nonzero(highest), strict=True)
    ]
    return tuple(sorted(found, key=lambda peak: -peak.amplitude))
