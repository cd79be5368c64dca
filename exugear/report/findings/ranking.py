"""Ranking of resonances of a stored steady-state response by transmission error, bearing force and acceleration.

The relevant quantity depends on the purpose (noise or strength), and none replaces another. One of them decides the
order of the ranking (`deciding_quantity`); every quantity is listed with its rank. Resonances without a peak in the
deciding quantity follow, by their best rank in another one.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.choice import Choice, choice_of
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM
from exugear.results.findings import Finding
from exugear.results.spectra.line_spectra import LineSpectra, line_spectra
from exugear.results.spectra.waterfall import OrderLine
from exugear.steady.harmonics.branches import beside_jumps, standing_peaks
from exugear.steady.mean_system.signals import ROUND_OFF, Quantity, vector_peak
from exugear.steady.peaks import SWEEP_SHIFT
from exugear.steady.settings import METHODS
from exugear.steady.steady_file import complex_amplitudes, response_quantities, settings_of
from fe_ste.tools.arrays import Booleans, Floats

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

SAME_SPEED_TOLERANCE = 0.01
"""Relative speed difference within which peaks of one order in several quantities are one resonance."""
AROUND = (0.8, 1.15)
"""Speeds drawn first, as factors of the ends of the operating range."""
SOUND = "surface_velocity"
"""Quantity whose square is the sound power."""
UNIT_KEYS = {
    "error": "m",
    "force": "N",
    "acceleration": "m_per_s2",
    "mount_acceleration": "m_per_s2",
    "surface_velocity": "m_per_s",
}
"""Units in the keys of ``--json``."""
DECIDING = {
    "transmission_error": ("error",),
    "bearing_force": ("force",),
    "acceleration": ("mount_acceleration", "acceleration"),
    "sound_power": (SOUND,),
}
"""Quantities by their name in a gearbox file; the first that is available decides."""
USUAL = ("mount_acceleration", "force", "error")
"""Quantities that decide by default."""
ONLY_QUANTITY = "the only quantity with ideal joints"
REASONS = {
    "mount_acceleration": "default for a flexible housing on mounts",
    "force": "default for elastic bearings",
    "error": ONLY_QUANTITY,
}
"""Why a quantity decides by default."""
SHAFTS = "shafts"
HOUSING = "housing"
BOTH = "shafts and housing"


@dataclass(frozen=True)
class Limit:
    """How high a resonance is in one quantity at one end of the range of damping."""

    amplitude: float
    """Peak amplitude, in the quantity's unit."""
    place: int | None
    """Among the peaks of that quantity with the same damping, 1 for the highest; None without a peak."""


@dataclass(frozen=True)
class PeakAmplitude:
    """Amplitude and rank of a resonance in one quantity."""

    amplitude: float
    """Peak amplitude of the order, in units of the quantity: of a force or an acceleration the largest magnitude of
    its vector, for planets the root mean square over them."""
    at: str
    """Bearing or mount with the largest amplitude, for planets their family; empty for the transmission error."""
    place: int | None
    """Rank among the peaks of that quantity, 1 for the highest; None on the flank of a higher peak."""
    limits: tuple[Limit, Limit] | None = None
    """With the lowest and with the highest plausible damping; None where it was not computed."""

    @property
    def places(self) -> tuple[int, int] | None:
        """Best and worst place over the range of damping; None without a peak or without that range."""
        if self.place is None or self.limits is None:
            return None
        known = [self.place, *(limit.place for limit in self.limits if limit.place is not None)]
        return min(known), max(known)


@dataclass(frozen=True)
class Resonance:
    """Order and speed at which at least one quantity has a peak."""

    line: str
    """Order, such as ``2 x intermediate``."""
    order: float
    """Periods per revolution of the input."""
    speed: float
    """Input speed at the peak of the quantity that decides the ranking, or else of the one with the best rank, rad/s.
    """
    frequency: float
    """Hz."""
    amplitudes: Mapping[str, PeakAmplitude]
    """By quantity: ``error`` (m); with bearings ``force`` (N) and ``acceleration`` (m/s2); with a flexible housing
    ``surface_velocity`` (m/s), whose square is the sound power, and with its mounts ``mount_acceleration`` (m/s2)."""

    @property
    def best(self) -> int:
        """Best rank in any quantity."""
        return min(own.place for own in self.amplitudes.values() if own.place is not None)

    def summary(self) -> dict[str, Any]:
        """Return all values for ``--json``, with units in the keys."""
        found: dict[str, Any] = {
            "line": self.line,
            "order": self.order,
            "speed_rpm": self.speed / RPM,
            "frequency_Hz": self.frequency,
            "best_place": self.best,
        }
        for quantity, peak in self.amplitudes.items():
            unit = UNIT_KEYS[quantity]
            found |= {f"{quantity}_{unit}": peak.amplitude, f"{quantity}_place": peak.place}
            if peak.at:
                found[f"{quantity}_at"] = peak.at
            if peak.limits:
                lowest, highest = peak.limits
                found[f"{quantity}_lowest_damping_{unit}"] = lowest.amplitude
                found[f"{quantity}_highest_damping_{unit}"] = highest.amplitude
                found[f"{quantity}_places_over_damping"] = peak.places
        return found


@dataclass(frozen=True)
class Ranking:
    """Resonances of a steady-state response, sorted by one quantity."""

    resonances: tuple[Resonance, ...]
    speeds: tuple[float, float]
    """Lowest and highest absolute input speed that is evaluated, rad/s."""
    whole: bool
    """Whether these are all speeds: the file has no operating range, or the response was not computed there."""
    accelerates: str
    """Parts whose acceleration is given: the shafts where the housing is rigid."""
    without: tuple[float, float] | None = None
    """Operating range (rad/s) in which there is no resonance, where all speeds are ranked instead."""
    quantity: str = "error"
    """Quantity that decides the order."""
    reason: str = ONLY_QUANTITY

    @property
    def wanted(self) -> str:
        """Name of the deciding quantity in a gearbox file."""
        return next(name for name, own in DECIDING.items() if self.quantity in own)

    @property
    def around(self) -> tuple[float, float] | None:
        """Speeds (rad/s) that diagrams show first: the operating range and a little more; None for all speeds."""
        if self.whole:
            return None
        return AROUND[0] * self.speeds[0], AROUND[1] * self.speeds[1]

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Warning if another range than the operating range is evaluated."""
        if not self.whole:
            return ()
        text = "no computed speed is in an operating range, so all speeds are ranked; add rated_speed_rpm or "
        return (Finding("warning", f"{text}speed_range_rpm to [operation]"),)

    def leader(self, quantity: str) -> Resonance | None:
        """Return the resonance with the highest amplitude of a quantity; None without a peak."""
        return next((own for own in self.resonances if own.amplitudes[quantity].place == 1), None)


def deciding_quantity(available: Collection[str], wanted: str | None) -> tuple[str, str]:
    """Return the quantity that decides a ranking, the one wanted in `DECIDING` or the default, and the reason as text.

    Examples
    --------
    >>> deciding_quantity(("error", "force", "acceleration"), "acceleration")
    ('acceleration', 'as chosen')
    >>> deciding_quantity(("error", "force", "acceleration", "mount_acceleration"), None)
    ('mount_acceleration', 'default for a flexible housing on mounts')
    """
    if wanted is not None:
        for quantity in DECIDING[wanted]:
            if quantity in available:
                return quantity, "as chosen"
    quantity = next(own for own in USUAL if own in available)
    return quantity, REASONS[quantity]


def ranking_of(data: xr.Dataset, speeds: tuple[float, float] | None = None, wanted: str | None = None) -> Ranking:
    """Rank the resonances of a steady-state response within the operating range or other speeds.

    Parameters
    ----------
    data : as `exugear.steady.steady_file.load_response` reads it
    speeds : lowest and highest absolute input speed, rad/s; by default the operating range of the file
    wanted : quantity that decides the order, as in `DECIDING`; see `deciding_quantity` for the default

    Notes
    -----
    Forces and accelerations of planets are root mean squares over the planets, from the mean component that all planets
    share and the cosine and sine components around the carrier.
    """
    signed = data["speed"].to_numpy().astype(np.float64)
    speed = np.abs(signed)
    low, high, whole = _range(json.loads(str(data.attrs["operating_range"])) if speeds is None else speeds, speed)
    inside = (speed >= low) & (speed <= high)
    jumps = beside_jumps(data["loads_at_mean_angles"].to_numpy() == 1)
    amplitude = complex_amplitudes(data)[:, 1:]
    quantities = response_quantities(data)
    first, reason = deciding_quantity([quantity.name for quantity in quantities], wanted)
    sizes = {quantity.name: quantity.sizes(amplitude) for quantity in quantities}
    peaks = {}
    for quantity in quantities:
        counted = (inside & ~jumps)[:, None]
        if quantity.name == SOUND:  # above the band of the housing no peak counts
            counted = counted & np.isfinite(data["sound_power"].to_numpy()[:, 1:])
        peaks[quantity.name] = quantity.peaks(sizes[quantity.name].max(axis=2), counted)
    places = [
        (quantity.name != first, place, number, quantity.name, point, line)
        for number, quantity in enumerate(quantities)
        for place, (point, line) in enumerate(peaks[quantity.name], start=1)
    ]
    groups: list[dict[str, tuple[int, int, int]]] = []
    of_line: dict[int, list[dict[str, tuple[int, int, int]]]] = {}
    for _, place, _, name, point, line in sorted(places):
        others = of_line.setdefault(line, [])
        group = next((other for other in others if name not in other and _is_same_resonance(other, speed, point)), None)
        if group is None:
            group = {}
            groups.append(group)
            others.append(group)
        group[name] = place, point, line
    ends_of_damping = _limits(data, quantities, peaks)
    names = data["line"].to_numpy()[1:].tolist()
    orders = data["order"].to_numpy()[1:].astype(np.float64)
    found = []
    for group in groups:
        _, first_point, line = next(iter(group.values()))
        amplitudes = {}
        for quantity in quantities:
            rank, point, _ = group.get(quantity.name, (None, first_point, line))
            at = sizes[quantity.name][point, line]
            limits = ends_of_damping.get((point, line, quantity.name))
            where = quantity.places[int(at.argmax())]
            amplitudes[quantity.name] = PeakAmplitude(float(at.max()), where, rank, limits)
        order = float(orders[line])
        at_speed = float(signed[first_point])
        frequency = order * abs(at_speed) / (2.0 * np.pi)
        found.append(Resonance(names[line], order, at_speed, frequency, amplitudes))
    carried = {bool(carrier) for carrier in json.loads(str(data.attrs["carried_seats"])).values()}
    accelerates = SHAFTS if carried <= {False} else HOUSING if carried == {True} else BOTH
    return Ranking(tuple(found), (low, high), whole, accelerates, quantity=first, reason=reason)


def resonances(data: xr.Dataset, quantity: str | None = None) -> pd.DataFrame:
    """Rank the resonances of a steady-state response within the operating range, as `exugear steady` lists them.

    Parameters
    ----------
    data : result of `exugear.project.Project.steady` or `exugear.steady.steady_file.steady_response`
    quantity : ``transmission_error``, ``bearing_force``, ``acceleration`` or ``sound_power``, by which they are sorted;
        by default the acceleration at the mounts of a flexible housing, or else the bearing force

    Returns
    -------
    pandas.DataFrame
        One row a resonance: order, input speed, frequency; amplitude, rank (empty without a peak) and bearing or mount
        of each quantity, and its amplitudes with the lowest and the highest plausible damping. SI units, speeds in rpm.

    Examples
    --------
    >>> import numpy as np
    >>> from exugear import Choice, Gearbox, SpeedRange, SteadySettings, steady_response
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> shape = 1.0 + 0.05 * np.cos(2.0 * np.pi * np.arange(50) / 50)
    >>> mean = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> stiffness = {name: value * shape for name, value in mean.items()}
    >>> settings = SteadySettings(SpeedRange.from_text("15:25:11"))
    >>> table = resonances(steady_response(gearbox, Choice("rigid"), stiffness, settings=settings))
    >>> table[["line", "error_place"]].head(1)
             line  error_place
    0  high_speed            1
    """
    import pandas as pd

    table = pd.DataFrame([resonance.summary() for resonance in ranking_of(data, wanted=quantity).resonances])
    return table.astype({name: "Int64" for name in table if str(name).endswith("_place")})


@dataclass(frozen=True)
class Envelope:
    """Largest single order of a quantity over speed."""

    speed: Floats
    """(n,) absolute input speed, rad/s, ascending."""
    amplitude: Floats
    """(n,) in the unit of the quantity."""


QUASI_STATIC = 1.25
"""Ratio of the highest to the lowest amplitude of an order in a range of speeds up to which it is quasi-static."""


def dynamic_orders(amplitude: Floats, inside: Booleans) -> Booleans:
    """Return which orders are not quasi-static within a range of speeds: they vary there, or have a ranked peak.

    Amplitudes of quasi-static orders hardly change with speed: the planets that pass, for instance, load bearings and
    teeth in the same way at any speed, and would hide what resonances do.

    Parameters
    ----------
    amplitude : (points, orders) over speed
    inside : (points,) points in the range

    Examples
    --------
    >>> amplitude = np.array([[5.0, 1.0, 5.0], [5.2, 3.0, 5.5], [5.3, 3.5, 5.0]])
    >>> dynamic_orders(amplitude, np.ones(3, dtype=bool))
    array([False,  True,  True])
    """
    ranged = amplitude[inside]
    varies = ranged.max(axis=0, initial=0.0) > QUASI_STATIC * ranged.min(axis=0, initial=np.inf)
    return np.asarray(varies | [bool(inside[standing_peaks(own)].any()) for own in amplitude.T])


def envelopes(data: xr.Dataset, within: tuple[float, float] | None = None) -> dict[str, Envelope]:
    """Return the largest amplitude of a single order at each speed, by quantity, of the bearing with the largest.

    Parameters
    ----------
    data : as `exugear.steady.steady_file.load_response` reads it
    within : range of speeds (rad/s); orders that are quasi-static there are omitted
    """
    speed = np.sort(np.abs(data["speed"].to_numpy().astype(np.float64)))
    inside = np.ones(len(speed), bool) if within is None else (speed >= within[0]) & (speed <= within[1])
    found = {}
    for name, values in order_amplitudes(data).items():
        counted = dynamic_orders(values, inside) if within is not None else np.ones(values.shape[1], bool)
        found[name] = Envelope(speed, values[:, counted].max(axis=1, initial=0.0))
    return found


def order_amplitudes(data: xr.Dataset) -> dict[str, Floats]:
    """Amplitude (points, orders) of each order but 0, by quantity, of the bearing with the largest; speeds ascend."""
    rising = np.argsort(np.abs(data["speed"].to_numpy()), kind="stable")
    amplitude = complex_amplitudes(data)[rising, 1:]
    return {own.name: own.sizes(amplitude).max(axis=2) for own in response_quantities(data)}


Limits = Mapping[tuple[int, int, str], tuple[Limit, Limit]]
"""By point, line and quantity."""


def _limits(data: xr.Dataset, quantities: tuple[Quantity, ...], peaks: Mapping[str, list[tuple[int, int]]]) -> Limits:
    """Amplitudes at both ends of the range of damping, and the places of those that are peaks."""
    solved = data["band_amplitude"].to_numpy()
    at = list(zip(data["band_point"].to_numpy().tolist(), data["band_line"].to_numpy().tolist(), strict=True))
    names = [str(name) for name in data["quantity"].to_numpy()]
    found: dict[tuple[int, int, str], tuple[Limit, Limit]] = {}
    for quantity in quantities:
        values = solved[:, names.index(quantity.name)]
        ranked = set(peaks[quantity.name])
        known = [n for n, (point, line) in enumerate(at) if (point, line - 1) in ranked]
        places = [
            {n: place for place, n in enumerate(sorted(known, key=lambda n: -values[n, end]), start=1)}
            for end in range(2)
        ]
        for n, (point, line) in enumerate(at):
            found[point, line - 1, quantity.name] = (
                Limit(float(values[n, 0]), places[0].get(n)),
                Limit(float(values[n, 1]), places[1].get(n)),
            )
    return found


def _range(stated: Sequence[float] | None, speed: Floats) -> tuple[float, float, bool]:
    """Return the evaluated speed range, and whether it covers all speeds."""
    if stated is not None and ((speed >= stated[0]) & (speed <= stated[1])).any():
        return float(stated[0]), float(stated[1]), False
    return float(speed.min()), float(speed.max()), True


def ranking_of_errors(
    peaks: Sequence[tuple[OrderLine, float, float, float]], speed: Floats, stated: tuple[float, float] | None
) -> Ranking:
    """Rank resonances of which only the transmission error is known, such as those of a run-up.

    Parameters
    ----------
    peaks : order, absolute input speed (rad/s), frequency (Hz) and amplitude (m) of each
    speed : all evaluated absolute input speeds, rad/s
    stated : operating range, rad/s
    """
    low, high, whole = _range(stated, speed)
    inside = sorted((peak for peak in peaks if low <= peak[1] <= high), key=lambda peak: -peak[3])
    found = tuple(
        Resonance(line.name, line.order, at, frequency, {"error": PeakAmplitude(amplitude, "", place)})
        for place, (line, at, frequency, amplitude) in enumerate(inside, start=1)
    )
    return Ranking(found, (low, high), whole, SHAFTS)


def _is_same_resonance(group: Mapping[str, tuple[int, int, int]], speed: Floats, point: int) -> bool:
    """Return whether a peak belongs to a resonance of the same order: both are at practically the same speed."""
    _, first, _ = next(iter(group.values()))
    return bool(abs(speed[point] - speed[first]) <= SAME_SPEED_TOLERANCE * speed[first])


# Levels at constant speed: a fast run-up underestimates resonances that have no time to build up

TOP = 1.1
"""Highest drawn frequency over the highest mesh frequency at the highest speed."""
DRAWN = 10
"""Number of resonances of the ranking that are drawn."""
LEAST_SPEEDS = 3
"""Minimum number of speeds for diagrams over speed."""


@dataclass(frozen=True)
class OrderPeak:
    """Highest point of an order at constant speed."""

    level: float
    """dB re 1 µm."""
    speed: float
    """Absolute input speed, rad/s."""
    frequency: float
    """Hz."""


@dataclass(frozen=True)
class ConstantSpeed:
    """Overall transmission error along the orders of a steady-state response."""

    speed: Floats
    """(n,) absolute input speed, rad/s, ascending."""
    orders: Floats
    """(lines,) periods per revolution of the input."""
    level: Floats
    """(n, lines) dB re 1 µm."""

    def along(self, line: OrderLine) -> Floats | None:
        """Return the level at each speed, dB re 1 µm; None if the response does not contain the order."""
        place = line.place(self.orders)
        return None if place is None else self.level[:, place]

    def near(self, line: OrderLine, frequency: float, resolution: float) -> OrderPeak | None:
        """Return the highest peak of an order within the resolution of a run-up around a frequency (both Hz).

        Without a peak, return the level at the frequency; None outside the speed range of the response. The band also
        allows for the shift of a peak by the sweep, up to a few percent.
        """
        along = self.along(line)
        frequencies = line.frequency(self.speed)
        there = np.flatnonzero(np.abs(frequencies - frequency) <= max(SWEEP_SHIFT * frequency, resolution))
        if along is None or not there.size:
            return None
        # The end of the range may lie on the flank of a neighbouring peak, which does not belong to this resonance.
        beside = np.pad(along, 1, constant_values=np.inf)
        peaks = there[(along[there] > beside[there]) & (along[there] >= beside[there + 2])]
        nearest = there[np.argmin(np.abs(frequencies[there] - frequency))]
        index = int(peaks[np.argmax(along[peaks])] if peaks.size else nearest)
        return OrderPeak(float(along[index]), float(self.speed[index]), float(frequencies[index]))

    def highest(self, lines: Iterable[OrderLine]) -> tuple[OrderLine, OrderPeak] | None:
        """Return the order with the highest level and its maximum; None if the response contains none of the orders."""
        found: list[tuple[OrderLine, OrderPeak]] = []
        for line in lines:
            along = self.along(line)
            if along is not None:
                index = int(np.argmax(along))
                frequency = float(line.frequency(self.speed[index : index + 1])[0])
                found.append((line, OrderPeak(float(along[index]), float(self.speed[index]), frequency)))
        return max(found, key=lambda own: own[1].level, default=None)


def constant_speed_of(response: xr.Dataset) -> ConstantSpeed:
    """Return the levels of the overall transmission error of a steady-state response from `load_response`."""
    speed = np.abs(response["speed"].to_numpy())
    rising = np.argsort(speed, kind="stable")
    signals = [str(name) for name in response["signal"].to_numpy()]
    amplitude = response["amplitude"].to_numpy()[rising, :, signals.index("overall_dte")].astype(np.float64)
    level = 20.0 * np.log10(np.maximum(amplitude, ROUND_OFF["error"]) / 1e-6)
    return ConstantSpeed(speed[rising], response["order"].to_numpy(), level)


def most_complete_response(responses: Iterable[xr.Dataset], choice: Choice) -> xr.Dataset | None:
    """Return the steady-state response with the most complete method for given settings; None if there is none.

    Continuation results are not functions of speed; the section on steady-state responses shows them.
    """
    own = [data for data in responses if choice_of(data.attrs) == choice and not settings_of(data.attrs).branches]
    return max(own, key=lambda data: METHODS.index(data.attrs["method"]), default=None)


def most_complete_levels(responses: Iterable[xr.Dataset], choice: Choice) -> ConstantSpeed | None:
    """Return the levels of the response that `most_complete_response` selects."""
    best = most_complete_response(responses, choice)
    return None if best is None else constant_speed_of(best)


def is_over_speed(response: xr.Dataset) -> bool:
    """Return whether a steady-state response is a function of speed (no continuation) with enough speeds to draw."""
    return not settings_of(response.attrs).branches and np.unique(response["speed"]).size >= LEAST_SPEEDS


def highest_drawn(gearbox: Gearbox, response: xr.Dataset, ranking: Ranking | None = None) -> float:
    """Return the highest frequency (Hz) drawn for a steady-state response: of meshes and of the first resonances."""
    fastest = float(np.abs(response["speed"]).max())
    first = () if ranking is None else ranking.resonances[:DRAWN]
    frequencies = [*gearbox.train.mesh_frequencies(fastest).values(), *(own.frequency for own in first)]
    return TOP * max(frequencies, default=0.0)


def response_spectra(
    response: xr.Dataset, signals: Sequence[str], highest: float, reference: float = 1e-6, unit: str = "m"
) -> LineSpectra:
    """Return the orders of a steady-state response over speed in the form of a waterfall.

    Parameters
    ----------
    response : as `exugear.steady.steady_file.load_response` reads it, a function of speed
    signals : components of a vector, whose largest magnitude is taken
    highest : highest drawn frequency, Hz
    reference, unit : amplitude of 0 dB, and the unit of the signals
    """
    speed, places = np.unique(np.abs(response["speed"].to_numpy()), return_index=True)
    names = [str(name) for name in response["signal"].to_numpy()]
    # Component 0 is the mean.
    components = complex_amplitudes(response, [names.index(name) for name in signals])[places, 1:]
    amplitude = vector_peak(components.astype(np.complex128))
    orders = response["order"].to_numpy()[1:]
    unknown = [abs(float(point["speed"])) for point in json.loads(response.attrs.get("not_converged", "[]"))]
    return line_spectra(speed, orders, amplitude, highest, unknown=unknown, reference=reference, unit=unit)
