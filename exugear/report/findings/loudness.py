"""Resonances of a stored steady response, ranked by transmission error, bearing force and acceleration at bearings.

Which of the three counts depends on what is heard or breaks; none stands for the others. So they stand side by side,
each with its place, and the order is that of the best place in any.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from exugear.steady.harmonics.curve_peaks import standing_peaks
from exugear.steady.mean_system.quantities import Quantity, quantities_of
from exugear.steady.peaks import line_name
from fe_ste.tools.arrays import Booleans, Floats

if TYPE_CHECKING:
    import xarray as xr

ONE = 0.01
"""Share of the speed within which peaks of one line in several quantities are one resonance."""
LEAST = 1e-9
"""Peaks below this share of the largest of their quantity are round-off."""
NOTHING = {"error": 1e-12, "force": 1e-6, "acceleration": 1e-9}
"""Amplitudes below which nothing is excited, in the quantities' units."""
SHAFTS = "shafts"
HOUSING = "housing"
BOTH = "shafts and housing"


@dataclass(frozen=True)
class Loudness:
    """How loud a resonance is in one quantity."""

    amplitude: float
    """Peak amplitude of the line, in the quantity's unit; of planets the root of the mean square over them."""
    at: str
    """Bearing where it is largest, of planets their family; empty for the transmission error."""
    place: int | None
    """Among the peaks of that quantity, 1 for the loudest; None where it rises to a louder one."""


@dataclass(frozen=True)
class Resonance:
    """A line at a speed where at least one quantity has a peak."""

    line: str
    """Such as ``2 x intermediate``."""
    order: float
    """Periods per turn of the input."""
    speed: float
    """Of the input, rad/s, of the peak in the quantity that places it best."""
    frequency: float
    """Hz."""
    loudness: Mapping[str, Loudness]
    """By quantity, of ``error`` (m), ``force`` (N) and ``acceleration`` (m/s2), the last two where there are
    bearings."""

    @property
    def best(self) -> int:
        """Best place in any quantity."""
        return min(own.place for own in self.loudness.values() if own.place is not None)


@dataclass(frozen=True)
class Ranking:
    """Resonances of a steady response, that with the best place in any quantity first."""

    resonances: tuple[Resonance, ...]
    speeds: tuple[float, float]
    """Lowest and highest speed that counts, of the input without sign, rad/s."""
    whole: bool
    """Whether these are all speeds of the response: its file names none of operation, or it was not computed there."""
    accelerates: str
    """Whose acceleration it is: that of shafts where the housing is rigid."""


def ranking_of(data: xr.Dataset) -> Ranking:
    """Rank the resonances of a steady response within the range of operation.

    Parameters
    ----------
    data : as `exugear.steady.steady_file.load_response` reads it

    Notes
    -----
    Planets' forces and accelerations are those that all share and those that go around, by the mean square over the
    planets.
    """
    speed = np.abs(data["speed"].to_numpy().astype(np.float64))
    low, high, whole = _range(data, speed)
    inside = (speed >= low) & (speed <= high)
    amplitude: Floats = data["amplitude"].to_numpy()[:, 1:].astype(np.float64)
    quantities = quantities_of([str(name) for name in data["signal"].to_numpy()])
    sizes = {quantity.name: quantity.sizes(amplitude) for quantity in quantities}
    peaks = {quantity.name: _peaks(quantity, sizes[quantity.name].max(axis=2), inside) for quantity in quantities}
    places = [
        (place, number, quantity.name, point, line)
        for number, quantity in enumerate(quantities)
        for place, (point, line) in enumerate(peaks[quantity.name], start=1)
    ]
    groups: list[dict[str, tuple[int, int, int]]] = []
    of_line: dict[int, list[dict[str, tuple[int, int, int]]]] = {}
    for place, _, name, point, line in sorted(places):
        others = of_line.setdefault(line, [])
        group = next((other for other in others if name not in other and _is_one(other, speed, point)), None)
        if group is None:
            group = {}
            groups.append(group)
            others.append(group)
        group[name] = place, point, line
    found = tuple(_resonance(data, quantities, sizes, group) for group in groups)
    return Ranking(found, (low, high), whole, _whose(data))


def _range(data: xr.Dataset, speed: Floats) -> tuple[float, float, bool]:
    """Speeds that count, and whether they are all."""
    stated = json.loads(str(data.attrs["operating_range"]))
    if stated is not None and ((speed >= stated[0]) & (speed <= stated[1])).any():
        return float(stated[0]), float(stated[1]), False
    return float(speed.min()), float(speed.max()), True


def _peaks(quantity: Quantity, values: Floats, inside: Booleans) -> list[tuple[int, int]]:
    """Points and lines of the peaks of a quantity (points, lines), the loudest first."""
    found = [(int(point), line) for line, own in enumerate(values.T) for point in standing_peaks(own) if inside[point]]
    largest = max((values[peak] for peak in found), default=0.0)
    least = max(LEAST * largest, NOTHING[quantity.name])
    return sorted((peak for peak in found if values[peak] > least), key=lambda peak: -values[peak])


def _is_one(group: Mapping[str, tuple[int, int, int]], speed: Floats, point: int) -> bool:
    """Tell whether a peak belongs to a resonance of the same line: it is at all but the same speed."""
    _, first, _ = next(iter(group.values()))
    return bool(abs(speed[point] - speed[first]) <= ONE * speed[first])


def _resonance(
    data: xr.Dataset,
    quantities: tuple[Quantity, ...],
    sizes: Mapping[str, Floats],
    group: Mapping[str, tuple[int, int, int]],
) -> Resonance:
    _, first, line = next(iter(group.values()))
    loudness = {}
    for quantity in quantities:
        place, point, _ = group.get(quantity.name, (None, first, line))
        at = sizes[quantity.name][point, line]
        loudness[quantity.name] = Loudness(float(at.max()), quantity.places[int(at.argmax())], place)
    bases = tuple(str(name) for name in data["base"].to_numpy())
    order = float(data["order"][line + 1])
    speed = float(data["speed"][first])
    name = line_name(tuple(int(n) for n in data["index"].to_numpy()[line + 1]), bases)
    return Resonance(name, order, speed, order * abs(speed) / (2.0 * np.pi), loudness)


def _whose(data: xr.Dataset) -> str:
    """Tell whose the accelerations are, as the file has it by bearing."""
    carried = {bool(load) for load in json.loads(str(data.attrs["carried_seats"])).values()}
    if carried <= {False}:
        return SHAFTS
    if carried == {True}:
        return HOUSING
    return BOTH
