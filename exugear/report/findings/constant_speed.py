"""Levels at constant speed: a run-up that gives a resonance no time to build up shows it too low."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.report.findings.context import choice_of
from exugear.results.spectra.line_spectra import LineSpectra, line_spectra
from exugear.results.spectra.orders import OrderLine
from exugear.steady.peaks import BESIDE
from exugear.steady.settings import LEVELS
from exugear.steady.steady_file import settings_of
from fe_ste.tools.arrays import Floats

if TYPE_CHECKING:
    import xarray as xr

FAINTEST = 1e-12
"""Amplitude (m) below which a level is no lower."""
TOP = 1.1
"""Highest frequency drawn over that of the fastest mesh at the highest speed."""
LEAST_SPEEDS = 3
"""Speeds without which nothing is drawn over speed."""


@dataclass(frozen=True)
class Highest:
    """Where an order is loudest at constant speed."""

    level: float
    """dB re 1 µm."""
    speed: float
    """Of the input without sign, rad/s."""
    frequency: float
    """Hz."""


@dataclass(frozen=True)
class ConstantSpeed:
    """Overall transmission error along the orders of a steady response."""

    speed: Floats
    """(n,) of the input without sign, rad/s, ascending."""
    orders: Floats
    """(lines,) periods per turn of the input."""
    level: Floats
    """(n, lines) dB re 1 µm."""

    def along(self, line: OrderLine) -> Floats | None:
        """Level at each speed, dB re 1 µm; None if the response has no such order."""
        place = line.place(self.orders)
        if place is None:
            return None
        return self.level[:, place]

    def near(self, line: OrderLine, frequency: float, resolution: float) -> Highest | None:
        """Return the highest peak of an order within what a run-up resolves about a frequency (both Hz).

        Without a peak there, the level at the frequency; None if the response does not go there. The sweep shifts a
        peak besides, by up to a few percent.
        """
        along = self.along(line)
        frequencies = line.frequency(self.speed)
        there = np.flatnonzero(np.abs(frequencies - frequency) <= max(BESIDE * frequency, resolution))
        if along is None or not there.size:
            return None
        # The end of the range may lie on the flank of a neighbour, which is no peak of this resonance.
        beside = np.pad(along, 1, constant_values=np.inf)
        peaks = there[(along[there] > beside[there]) & (along[there] >= beside[there + 2])]
        nearest = there[np.argmin(np.abs(frequencies[there] - frequency))]
        index = int(peaks[np.argmax(along[peaks])] if peaks.size else nearest)
        return Highest(float(along[index]), float(self.speed[index]), float(frequencies[index]))

    def highest(self, lines: Iterable[OrderLine]) -> tuple[OrderLine, Highest] | None:
        """Return the order that is loudest of all, and where; None if the response has none of them."""
        found: list[tuple[OrderLine, Highest]] = []
        for line in lines:
            along = self.along(line)
            if along is not None:
                index = int(np.argmax(along))
                frequency = float(line.frequency(self.speed[index : index + 1])[0])
                found.append((line, Highest(float(along[index]), float(self.speed[index]), frequency)))
        return max(found, key=lambda own: own[1].level, default=None)


def constant_speed_of(response: xr.Dataset) -> ConstantSpeed:
    """Take the levels of the overall transmission error out of a steady response.

    Parameters
    ----------
    response : as `exugear.steady.steady_file.load_response` reads it
    """
    speed = np.abs(response["speed"].to_numpy())
    rising = np.argsort(speed, kind="stable")
    signals = [str(name) for name in response["signal"].to_numpy()]
    amplitude = response["amplitude"].to_numpy()[rising, :, signals.index("overall_dte")].astype(np.float64)
    level = 20.0 * np.log10(np.maximum(amplitude, FAINTEST) / 1e-6)
    return ConstantSpeed(speed[rising], response["order"].to_numpy(), level)


def truest_response(responses: Iterable[xr.Dataset], choice: Choice) -> xr.Dataset | None:
    """Steady response of a choice that leaves least out; None if there is none over a range of speeds.

    Branches are no function of speed and are left to the section on steady responses.
    """
    own = [data for data in responses if choice_of(data.attrs) == choice and not settings_of(data.attrs).branches]
    return max(own, key=lambda data: LEVELS.index(data.attrs["level"]), default=None)


def truest_of(responses: Iterable[xr.Dataset], choice: Choice) -> ConstantSpeed | None:
    """Levels of a choice by the response that leaves least out, as `truest_response` finds it."""
    best = truest_response(responses, choice)
    if best is None:
        return None
    return constant_speed_of(best)


def is_over_speed(response: xr.Dataset) -> bool:
    """Tell whether a steady response is a function of speed: no branch with folds, and speeds enough to draw."""
    return not settings_of(response.attrs).branches and np.unique(response["speed"]).size >= LEAST_SPEEDS


def highest_drawn(gearbox: Gearbox, response: xr.Dataset) -> float:
    """Highest frequency (Hz) that is drawn of a steady response."""
    fastest = float(np.abs(response["speed"]).max())
    return TOP * max(gearbox.train.mesh_frequencies(fastest).values())


def response_spectra(
    response: xr.Dataset, signals: Sequence[str], highest: float, reference: float = 1e-6, unit: str = "m"
) -> LineSpectra:
    """Lines of a steady response over speed, as a waterfall.

    Parameters
    ----------
    response : as `exugear.steady.steady_file.load_response` reads it, a function of speed
    signals : the root of the summed squares of their amplitudes is taken
    highest : highest frequency that is drawn, Hz
    reference, unit : amplitude of 0 dB, and the unit of the signals
    """
    speed, places = np.unique(np.abs(response["speed"].to_numpy()), return_index=True)
    names = [str(name) for name in response["signal"].to_numpy()]
    # Line 0 is the mean, which is no vibration.
    parts = response["amplitude"].to_numpy()[places, 1:][..., [names.index(name) for name in signals]]
    amplitude = np.sqrt((parts.astype(np.float64) ** 2).sum(axis=-1))
    orders = response["order"].to_numpy()[1:]
    unknown = [abs(float(load["speed"])) for load in json.loads(response.attrs.get("unsolved", "[]"))]
    return line_spectra(speed, orders, amplitude, highest, unknown=unknown, reference=reference, unit=unit)
