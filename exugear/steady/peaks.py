"""Peaks of a stored steady-state response: dominant orders by speed, their sidebands, and loads outside a linear range.

Responses are given as `exugear.steady.steady_file.load_response` reads them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from exugear.steady.harmonics.branches import beside_jumps, standing_peaks
from exugear.steady.mean_system.planet_sets import SteadyError
from fe_ste.tools.arrays import Complexes, Floats, Integers

if TYPE_CHECKING:
    import xarray as xr


LEAST_SPEEDS = 3
"""Speeds without which nothing stands out."""
DRAWN, MANY_TURNS = 4096, 2e4
"""Number of angles of the input at which contact loss is checked, and the range from which they are drawn, rad."""
HEARD = 1e-4
"""Share of the static force below which a line plays no part in whether teeth pull."""
STRAINED = 0.3
"""Dynamic over static load of a bearing from which it is reported to be outside the linear range."""
SWEEP_SHIFT = 0.03
"""Share of the speed within which a run-up's peak is looked for: sweeps shift it."""


@dataclass(frozen=True)
class Peak:
    """An order of a signal at its maximum."""

    line: str
    """Such as ``2 x intermediate``."""
    order: float
    """Periods per revolution of the input."""
    speed: float
    """Of the input, rad/s."""
    frequency: float
    """Hz."""
    amplitude: float
    """In the signal's unit."""


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
    for multiple, base in sorted(zip(index, bases, strict=True), key=lambda pair: -pair[0]):
        if multiple:
            times = "" if abs(multiple) == 1 else f"{abs(multiple)} x "
            words.append(("- " if multiple < 0 else "+ ") + times + base.split(", ")[0])
    return " ".join(words).removeprefix("+ ") or "mean"


def peaks(data: xr.Dataset, signal: str = "overall_dte", least: float = 0.01) -> tuple[Peak, ...]:
    """Return local maxima over speed of all orders of a signal that are prominent on both sides, highest first.

    Parameters
    ----------
    least : share of the highest peak below which a peak is omitted

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
    floor = least * values.max(initial=0.0)
    jumps = beside_jumps(data["loads_at_mean_angles"].to_numpy() == 1)
    highest = [
        (point, line)
        for line, own in enumerate(values.T)
        for point in _tops(own)
        if own[point] >= floor and not jumps[point]
    ]
    bases = tuple(str(name) for name in data["base"].to_numpy())
    index = data["index"].to_numpy()
    orders = data["order"].to_numpy()
    found = [
        Peak(
            line=line_name(tuple(int(n) for n in index[line + 1]), bases),
            order=float(orders[line + 1]),
            speed=float(speed[point]),
            frequency=float(orders[line + 1] * abs(speed[point]) / (2.0 * np.pi)),
            amplitude=float(values[point, line]),
        )
        for point, line in highest
    ]
    return tuple(sorted(found, key=lambda peak: -peak.amplitude))


@dataclass(frozen=True)
class Sideband:
    """A sideband of a peak, at the speed of the peak."""

    line: str
    """Its name, as of `Peak`; of a planet's sidebands the signal."""
    frequency: float
    """Hz."""
    amplitude: float
    """In the signal's unit."""
    share: float
    """Amplitude relative to the modulated order: of the peak, or of the signal's largest component."""
    cause: str
    """What modulates the line of the peak."""


def _tops(values: Floats) -> Integers:
    """Places of the peaks among values over speed; of one speed or two the higher, which is all that is known."""
    if len(values) < LEAST_SPEEDS:
        return np.array([np.argmax(values)])
    return standing_peaks(values)


def varying_carriers(data: xr.Dataset) -> tuple[str, ...]:
    """Carriers with whose angles stiffness varies, as a file of a response names them."""
    names = str(data.attrs.get("varying_carrier", ""))
    return tuple(names.split(", ")) if names else ()


def sidebands(data: xr.Dataset, peak: Peak, least: float = 0.01) -> tuple[Sideband, ...]:
    """Return orders of the overall transmission error beside that of a peak, largest first.

    They differ from it by integer multiples of the other mesh frequencies.

    Parameters
    ----------
    peak : of the response
    least : share of the peak below which an order is omitted
    """
    point, centre = _place(data, peak)
    index = data["index"].to_numpy()
    bases = tuple(str(name) for name in data["base"].to_numpy())
    names = [str(name) for name in data["signal"].to_numpy()]
    values: Floats = data["amplitude"].to_numpy()[point, :, names.index("overall_dte")].astype(np.float64)
    # Passing planets are beside what a mesh excites, however many times they pass.
    of_meshes = np.array([base not in varying_carriers(data) for base in bases])
    carrying = int(np.argmax(np.abs(index[centre]) * of_meshes))
    found = []
    for line in range(1, len(index)):
        # Lines are as good as their conjugates: the one whose multiple of the peak's base has the sign of the peak's.
        multiples = index[line] * (-1 if index[line][carrying] * index[centre][carrying] < 0 else 1)
        apart = multiples - index[centre]
        if line == centre or multiples[carrying] != index[centre][carrying] or values[line] < least * values[centre]:
            continue
        words = line_name(tuple(int(n) for n in apart), bases)
        found.append(
            Sideband(
                line=line_name(tuple(int(n) for n in index[line]), bases),
                frequency=float(data["order"][line]) * abs(peak.speed) / (2.0 * np.pi),
                amplitude=float(values[line]),
                share=float(values[line] / values[centre]),
                cause=words if words.startswith("- ") else f"+ {words}",
            )
        )
    return tuple(sorted(found, key=lambda band: -band.amplitude))


def planet_sidebands(
    data: xr.Dataset, peak: Peak, carriers: Mapping[str, tuple[str, float]], least: float = 0.01
) -> tuple[Sideband, ...]:
    """Return the sidebands of a peak in the force of one planet's meshes, from the cosine and sine components.

    With components F_c cos theta + F_s sin theta and a carrier at the angular speed W, the force on a planet is
    (F_c -+ i F_s) / 2 at the frequency of the order plus and minus W, as its position rotates.

    Parameters
    ----------
    peak : of the response
    carriers : mapping of family of meshes to (str, float)
        Carrier of the planets and its revolutions per revolution of the input.
    least : share of the common force of all planets, or of the largest order, below which an order is omitted
    """
    point, line = _place(data, peak)
    names = [str(name) for name in data["signal"].to_numpy()]
    found = []
    for family, (carrier, ratio) in carriers.items():
        waves = [f"mesh_force {family}{wave}" for wave in ("", " cosine", " sine")]
        if not set(waves) <= set(names):
            continue
        places = [names.index(name) for name in waves]
        mean, cosine, sine = _amplitudes(data.isel(point=point, line=line), places)
        turning = ratio * peak.speed
        felt = {1: 0.5 * abs(cosine - 1j * sine), -1: 0.5 * abs(cosine + 1j * sine)}
        largest = max(abs(mean), *felt.values(), 1e-300)
        for sign, amplitude in felt.items():
            if amplitude >= least * largest:
                shifted = peak.frequency + sign * turning / (2.0 * np.pi)
                more = sign * turning > 0.0
                cause = f"{'+' if more else '-'} {carrier}: multi-blade components with passing planets"
                name = f"mesh_force {family}, one planet"
                found.append(Sideband(name, shifted, float(amplitude), float(amplitude / largest), cause))
    return tuple(sorted(found, key=lambda band: -band.share))


def _amplitudes(data: xr.Dataset, signals: list[int]) -> Complexes:
    """Complex amplitudes (..., signals) of some signals, of line 0 the mean."""
    chosen = data[["amplitude", "phase"]].isel(signal=signals)
    return np.asarray(chosen["amplitude"].to_numpy() * np.exp(1j * chosen["phase"].to_numpy().astype(np.float64)))


def _place(data: xr.Dataset, peak: Peak) -> tuple[int, int]:
    """Point and line of a peak."""
    orders: Floats = data["order"].to_numpy()
    return int(np.argmin(np.abs(data["speed"].to_numpy() - peak.speed))), int(np.argmin(np.abs(orders - peak.order)))


@dataclass(frozen=True)
class Excess:
    """A mesh or a bearing whose load is outside the range of a linear model at some of the speeds."""

    name: str
    """Mesh or bearing; of planets the family."""
    count: int
    """At how many of the speeds."""
    speed: float
    """Of the input where the share is largest, rad/s."""
    share: float
    """Share of the time with tensile mesh force; maximum reduction of a bearing's static load by the vibration."""


def _excesses(data: xr.Dataset, shares: Mapping[str, Floats]) -> tuple[Excess, ...]:
    """Return what has shares (n,) above zero at any of the speeds, the largest share first."""
    found = [
        Excess(name, int((own > 0.0).sum()), float(data["speed"][int(own.argmax())]), float(own.max()))
        for name, own in shares.items()
        if own.max() > 0.0
    ]
    return tuple(sorted(found, key=lambda excess: -excess.share))


def pulls(data: xr.Dataset) -> tuple[Excess, ...]:
    """Return the meshes whose force changes its sign relative to the static force, longest tensile time first.

    In reality their teeth lose contact, which a bilateral model neglects. The orders of a speed are added at angles of
    the input drawn at random (`DRAWN`, the same each time). For planets it is the planet with the largest unloading by
    the multi-blade components.
    """
    return _excesses(data, tensile_fractions(data))


def tensile_fractions(data: xr.Dataset) -> dict[str, Floats]:
    """Return the fraction of time with tensile force at each speed (n,), by mesh or family of planet meshes."""
    places: dict[str, list[int]] = {}
    for place, name in enumerate(map(str, data["signal"].to_numpy())):
        if name.startswith("mesh_force "):
            places.setdefault(name.split(" ")[1], []).append(place)
    angles = np.random.default_rng(0).uniform(0.0, MANY_TURNS, DRAWN)
    found = {}
    for mesh, components in places.items():
        # The component that all planets have in common comes first.
        force = _amplitudes(data, components)
        static = force[:, 0, 0].real
        force *= np.where(static < 0.0, -1.0, 1.0)[:, None, None]
        swing = np.abs(force).sum(axis=(1, 2)) - np.abs(static)
        found[mesh] = np.zeros(len(static))
        for point in np.flatnonzero(swing >= np.abs(static)):
            lines = np.flatnonzero(np.abs(force[point]).max(axis=1) > HEARD * np.abs(static[point]))
            turning = np.exp(1j * np.outer(angles, data["order"].to_numpy()[lines]))
            waves = (turning @ force[point, lines]).real
            found[mesh][point] = np.mean(waves[:, 0] < np.hypot.reduce(waves[:, 1:], axis=1, initial=0.0))
    return found


def bearing_swings(data: xr.Dataset) -> tuple[Excess, ...]:
    """Return linear bearings whose vibration reaches `STRAINED` of their load or more, the largest ratio first.

    They are outside their linear range, and unloaded from a ratio of 1 on. The orders of a speed are added as if in
    phase. Planet bearings, whose load rotates in fixed axes, are not checked.
    """
    ratios = dynamic_load_ratios(data)
    return _excesses(data, {name: np.where(own >= STRAINED, own, 0.0) for name, own in ratios.items()})


def dynamic_load_ratios(data: xr.Dataset) -> dict[str, Floats]:
    """Return dynamic over static load at each speed (n,) of the bearings that `bearing_swings` checks.

    Of a bearing whose preload exceeds its static load it is the ratio to the preload.
    """
    names = [str(name) for name in data["signal"].to_numpy()]
    preloads = json.loads(data.attrs["bearing_preloads"])
    ratios = {}
    for bearing, load in json.loads(data.attrs["bearing_static_loads"]).items():
        signals = [f"support_force {bearing} {axis}" for axis in "xyz"]
        if set(signals) <= set(names):
            static = np.array(load)
            size = float(np.linalg.norm(static))
            force = _amplitudes(data.isel(line=slice(1, None)), [names.index(name) for name in signals])
            if preloads[bearing] > size:
                swing = np.linalg.norm(force, axis=2) / preloads[bearing]
            else:
                # The largest vibration is along the static load, over which it counts.
                swing = np.abs(force @ static) / size**2
            ratios[bearing] = np.nan_to_num(swing.sum(axis=1))
    return ratios
