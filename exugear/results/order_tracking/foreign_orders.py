"""Orders that carry power in a measurement but belong to no shaft or mesh of the gearbox.

A wrong number of teeth, a wrong speed ratio or a second machine show themselves in this way. The signal is resampled
to equal angles, and orders are maxima of the median spectrum over all windows above their neighbourhood. A tone of
constant frequency is at one order in few windows only and does not count.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.results.order_tracking.shaft_angle import ShaftAngle
from exugear.results.spectra.waterfall import amplitude_spectrum, overlapping_frames
from fe_ste.tools.arrays import Floats

REVOLUTIONS = 32, 16, 8
"""Revolutions of a window: the first that a run is long enough for."""
ABOVE = 6.0
"""Level above the neighbourhood from which an order stands out, dB."""
BELOW_HIGHEST = 40.0
"""Level below the highest order up to which orders are reported, dB."""
NEIGHBOURHOOD = 41
"""Number of spectral lines of the neighbourhood."""
FEWEST_WINDOWS = 12
"""Number of windows below which the median does not suppress noise."""
FEWEST_REVOLUTIONS = REVOLUTIONS[-1] * (FEWEST_WINDOWS + 1) // 2
"""Revolutions of the faster half of a run that so many windows take, each half over the one before."""
FAST_PART = 0.5
"""Fraction of the highest speed above which windows count; a revolution at lower speeds has many more samples."""
WINDOWS_AT_ONCE = 16
"""Number of windows whose spectra are computed together, which bounds the memory."""
SHAFT_HARMONICS = 4
"""Multiples of the rotational frequency that belong to a shaft: unbalance, misalignment, couplings with jaws."""
SIDEBANDS = 2
"""Sidebands of a mesh order by each of its shafts: run-out and pitch errors."""
SIDEBAND_BELOW = 3.0
"""Level below its mesh order from which an order is a sideband, dB; a higher one is an excitation of its own."""


CLEARLY = 4.0
"""Level by which another speed must make the mesh orders stand out more than the assumed one, dB."""
SAME_LINE = 1.5
"""Distance up to which two orders are one, in spectral lines."""
MAIN_LOBE = 4
"""Number of spectral lines at order zero that belong to the mean."""


@dataclass(frozen=True, eq=False)
class OrderSpectrum:
    """Median amplitude spectrum of a run over the angle."""

    order: Floats
    amplitude: Floats
    """(lines,) periods per revolution of the input; zero-to-peak amplitude in the signal's unit."""
    resolution: float
    """Distance of the lines."""

    @cached_property
    def prominence(self) -> Floats:
        """Level of each line above the median of its neighbourhood, dB."""
        from scipy.ndimage import median_filter

        around = median_filter(self.amplitude, NEIGHBOURHOOD, mode="nearest")
        return 20.0 * np.log10(np.maximum(self.amplitude, 1e-300) / np.maximum(around, 1e-300))

    def level_at(self, order: float) -> float:
        """Prominence at an order, dB: the highest of the lines within its main lobe; NaN outside of the spectrum."""
        line = round(order / self.resolution)
        if not MAIN_LOBE < line < self.order.size - 2:
            return math.nan
        return float(self.prominence[line - 1 : line + 2].max())


@dataclass(frozen=True)
class OrderInSpectrum:
    """An order that stands out in a measured spectrum."""

    order: float
    """Periods per revolution of the input."""
    amplitude: float
    """Median amplitude over the run, zero-to-peak, in the signal's unit."""
    prominence: float
    """Level above the neighbourhood, dB."""


@dataclass(frozen=True)
class GearboxOrder:
    """An order of the gearbox, per revolution of the input."""

    order: float
    carrier: float | None = None
    """Mesh order whose sideband it is; None for orders of shafts and meshes."""


def gearbox_orders(gearbox: Gearbox, highest: float) -> tuple[GearboxOrder, ...]:
    """Orders, up to the highest, of all shafts with four multiples, and of all meshes with harmonics and sidebands.

    Sidebands are two by each body of the mesh, and of planets one more than their number by the carrier.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [round(own.order, 2) for own in gearbox_orders(gearbox, 6.0)]
    [1.0, 1.54, 2.0, 3.0, 3.08, 4.0, 4.62, 5.71]
    """
    turns = {name: abs(speed) for name, speed in gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0).items()}
    meshes = gearbox.train.mesh_frequencies(2.0 * np.pi)
    found = {GearboxOrder(n * turn) for turn in turns.values() if turn > 0.0 for n in range(1, SHAFT_HARMONICS + 1)}
    planets = Counter(body.carrier for body in gearbox.named_bodies.values() if body.carrier is not None)
    for mesh in gearbox.meshes:
        bodies = (mesh.pinion, mesh.gear)
        carriers = {carrier for name in bodies if (carrier := gearbox.named_bodies[name].carrier) is not None}
        steps = {n * turns.get(name, 0.0) for name in bodies for n in range(1, SIDEBANDS + 1)}
        steps |= {n * turns.get(name, 0.0) for name in carriers for n in range(1, planets[name] + 2)}
        for multiple in range(1, int(highest / meshes[mesh.name]) + 2):
            order = multiple * meshes[mesh.name]
            found.add(GearboxOrder(order))
            found |= {GearboxOrder(order + sign * step, order) for step in steps if step for sign in (-1.0, 1.0)}
    # Planets have equal speeds apart from round-off.
    apart = {(round(own.order, 9), own.carrier): own for own in found if 0.0 < own.order <= highest}
    return tuple(sorted(apart.values(), key=lambda own: own.order))


def order_spectrum(values: Floats, shaft: ShaftAngle, per: float = 1.0) -> OrderSpectrum | None:
    """Median spectrum over the angle, throughout the faster half of a run; None if it is too short for twelve windows.

    Parameters
    ----------
    values : (n,) signal at the samples of `shaft`
    shaft : angle of the input
    per : speed of the shaft whose revolutions the windows count, over that of the input
    """
    turns = shaft.angle * abs(per) / (2.0 * np.pi)
    speed = shaft.speed * abs(per) / (2.0 * np.pi)
    fast = np.flatnonzero(speed >= FAST_PART * speed.max())
    # As many samples of a revolution as the recording has at half of the highest speed: no order is aliased.
    count = 2 ** int(np.ceil(np.log2(shaft.rate / (FAST_PART * speed.max()))))
    even = np.arange(np.ceil(turns[fast[0]] * count), np.floor(turns[fast[-1]] * count)) / count
    most = 2 * even.size // ((FEWEST_WINDOWS + 1) * count)
    revolutions = next((own for own in REVOLUTIONS if own <= most), None)
    if revolutions is None:
        return None
    # In single precision, which takes half the time and is 100 dB below the range of orders that are reported.
    frames = overlapping_frames(np.interp(even, turns, values).astype(np.float32), revolutions * count, 0.5)
    # The images of high frequencies that linear interpolation leaves are above this order.
    top = int(0.4 * shaft.rate / speed.max() * revolutions)
    spectra = [
        amplitude_spectrum(part - part.mean(axis=1, keepdims=True), count)[1][:, :top]
        for part in np.array_split(frames, -(-len(frames) // WINDOWS_AT_ONCE))
    ]
    resolution = abs(per) / revolutions
    typical = np.asarray(np.median(np.concatenate(spectra), axis=0), dtype=np.float64)
    return OrderSpectrum(np.linspace(0.0, resolution * (top - 1), top), typical, resolution)


def standing_orders(spectrum: OrderSpectrum) -> tuple[OrderInSpectrum, ...]:
    """Orders that stand out of their neighbourhood, highest amplitude first.

    Examples
    --------
    >>> from exugear.results.order_tracking.shaft_angle import angle_of_speed
    >>> shaft = angle_of_speed(2 * np.pi * np.linspace(10.0, 40.0, 50000), 2000.0)
    >>> noise = np.random.default_rng(1).standard_normal(shaft.angle.size)
    >>> spectrum = order_spectrum(np.cos(7.4 * shaft.angle) + 0.1 * noise, shaft)
    >>> [round(own.order, 2) for own in standing_orders(spectrum)]
    [7.41]
    """
    level = spectrum.prominence
    # the highest of itself and two neighbours on each side
    around = np.lib.stride_tricks.sliding_window_view(spectrum.amplitude, 5)
    peaks = np.flatnonzero((level[2:-2] > ABOVE) & np.asarray(around.argmax(axis=1) == 2)) + 2
    orders = [
        OrderInSpectrum(float(spectrum.order[line]), float(spectrum.amplitude[line]), float(level[line]))
        for line in peaks
        if line > MAIN_LOBE
    ]
    return tuple(sorted(orders, key=lambda order: -order.amplitude))


def foreign_orders(
    standing: Iterable[OrderInSpectrum], known: Sequence[GearboxOrder], resolution: float = 1.0 / REVOLUTIONS[0]
) -> tuple[OrderInSpectrum, ...]:
    """Orders that belong to no shaft, mesh or sideband of the gearbox, highest first, down to 40 dB below the highest.

    An order at the place of a sideband is foreign if it is less than 3 dB below its mesh order.

    Parameters
    ----------
    standing : as of `standing_orders`
    known : as of `gearbox_orders`
    resolution : distance of the lines of the spectrum

    Examples
    --------
    >>> known = [GearboxOrder(22.0), GearboxOrder(21.0, 22.0), GearboxOrder(23.0, 22.0)]
    >>> found = [OrderInSpectrum(23.0, 2.0, 30.0), OrderInSpectrum(22.0, 1.0, 25.0), OrderInSpectrum(21.0, 0.1, 9.0)]
    >>> [own.order for own in foreign_orders(found, known)]
    [23.0]
    """
    standing = tuple(standing)
    same = SAME_LINE * resolution
    least = max((own.amplitude for own in standing), default=0.0) * 10.0 ** (-BELOW_HIGHEST / 20.0)

    def amplitude_at(order: float) -> float:
        return max((own.amplitude for own in standing if abs(own.order - order) <= same), default=0.0)

    def belongs(own: OrderInSpectrum) -> bool:
        near = [order for order in known if abs(order.order - own.order) <= same]
        return any(
            order.carrier is None or own.amplitude < amplitude_at(order.carrier) * 10.0 ** (-SIDEBAND_BELOW / 20.0)
            for order in near
        )

    return tuple(own for own in standing if own.amplitude >= least and not belongs(own))


def speed_score(spectrum: OrderSpectrum, orders: Sequence[float], factor: float) -> float:
    """Mean level (dB) by which the mesh orders would stand out if the true speed were `factor` times the assumed one.

    At a wrong speed the axis of orders is stretched: an order n is found at n times the factor.

    Returns
    -------
    NaN if fewer than two of the orders are within the spectrum
    """
    levels = [spectrum.level_at(order * factor) for order in orders]
    inside = [level for level in levels if not math.isnan(level)]
    return math.nan if len(inside) < min(2, len(orders)) else sum(inside) / len(inside)


def likely_speed(spectrum: OrderSpectrum, orders: Sequence[float], candidates: Mapping[str, float]) -> str | None:
    """Return the mistake of the speed that makes the mesh orders stand out; None if the speed is right or undecided.

    Parameters
    ----------
    orders : mesh orders per revolution of the input
    candidates : true over assumed speed by the mistake

    Examples
    --------
    >>> amplitude = np.ones(4000)
    >>> amplitude[[352, 704, 1056]] = 30.0  # orders 11, 22 and 33: the shaft turns half as fast
    >>> spectrum = OrderSpectrum(np.arange(4000) / 32.0, amplitude, 1.0 / 32.0)
    >>> likely_speed(spectrum, [22.0, 44.0, 66.0], {"half a pulse": 2.0, "two pulses": 0.5})
    'two pulses'
    """
    scores = {mistake: speed_score(spectrum, orders, factor) for mistake, factor in candidates.items()}
    known = {mistake: score for mistake, score in scores.items() if not math.isnan(score)}
    if not known:
        return None
    best = max(known, key=lambda mistake: known[mistake])
    assumed = speed_score(spectrum, orders, 1.0)
    return best if known[best] > ABOVE and not known[best] < assumed + CLEARLY else None
