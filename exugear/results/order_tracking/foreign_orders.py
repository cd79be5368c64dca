"""Orders that carry power in a measurement but belong to no shaft or mesh of the gearbox.

A wrong number of teeth, a wrong speed ratio or a second machine show themselves in this way. The signal is resampled
to equal angles, and orders are maxima of the median spectrum over all windows above their neighbourhood. A tone of
constant frequency is at one order in few windows only and does not count.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.results.order_tracking.shaft_angle import ShaftAngle
from exugear.results.spectra.waterfall import amplitude_spectrum, overlapping_frames
from fe_ste.tools.arrays import Floats

REVOLUTIONS = 32
"""Revolutions of a window."""
ABOVE = 6.0
"""Level above the neighbourhood from which an order stands out, dB."""
BELOW_HIGHEST = 40.0
"""Level below the highest order up to which orders are reported, dB."""
NEIGHBOURHOOD = 41
"""Number of spectral lines of the neighbourhood."""
FEWEST_WINDOWS = 12
"""Number of windows below which the median does not suppress noise."""
FAST_PART = 0.5
"""Fraction of the highest speed above which windows count; a revolution at lower speeds has many more samples."""
SHAFT_HARMONICS = 4
"""Multiples of the rotational frequency that belong to a shaft: unbalance, misalignment, couplings with jaws."""
SIDEBANDS = 2
"""Sidebands of a mesh order by each of its shafts: run-out and pitch errors."""
SIDEBAND_BELOW = 3.0
"""Level below its mesh order from which an order is a sideband, dB; a higher one is an excitation of its own."""


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
    """Orders of all shafts with four multiples, and of all meshes with harmonics and sidebands.

    Sidebands are two by each body of the mesh, and of planets one more than their number by the carrier.

    Parameters
    ----------
    highest : highest order

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


def standing_orders(values: Floats, shaft: ShaftAngle, per: float = 1.0) -> tuple[OrderInSpectrum, ...]:
    """Orders that stand out of their neighbourhood throughout the faster half of a run, highest amplitude first.

    Parameters
    ----------
    values : (n,) signal at the samples of `shaft`
    shaft : angle of the input
    per : speed of the shaft whose revolutions the windows count, over that of the input

    Returns
    -------
    none if the run has fewer than twelve windows

    Examples
    --------
    >>> from exugear.results.order_tracking.shaft_angle import angle_of_speed
    >>> shaft = angle_of_speed(2 * np.pi * np.linspace(10.0, 40.0, 50000), 2000.0)
    >>> noise = np.random.default_rng(1).standard_normal(shaft.angle.size)
    >>> [round(own.order, 2) for own in standing_orders(np.cos(7.4 * shaft.angle) + 0.1 * noise, shaft)]
    [7.41]
    """
    from scipy.ndimage import median_filter

    turns = shaft.angle * abs(per) / (2.0 * np.pi)
    speed = shaft.speed * abs(per) / (2.0 * np.pi)
    fast = speed >= FAST_PART * speed.max()
    # As many samples of a revolution as the recording has at half of the highest speed: no order is aliased.
    count = 2 ** int(np.ceil(np.log2(shaft.rate / (FAST_PART * speed.max()))))
    begin, end = turns[fast][0], turns[fast][-1]
    even = np.arange(np.ceil(begin * count), np.floor(end * count)) / count
    length = REVOLUTIONS * count
    if even.size < length * (FEWEST_WINDOWS + 1) // 2:
        return ()
    resampled = np.interp(even, turns, values)
    own = np.array(
        [amplitude_spectrum(frame - frame.mean(), count)[1] for frame in overlapping_frames(resampled, length, 0.5)]
    )
    # The image of the highest frequencies, which linear interpolation leaves, is above this order.
    top = int(0.4 * shaft.rate / speed.max() * REVOLUTIONS)
    typical = np.median(own, axis=0)[:top]
    around = median_filter(typical, NEIGHBOURHOOD, mode="nearest")
    level = 20.0 * np.log10(np.maximum(typical, 1e-300) / np.maximum(around, 1e-300))
    peak = np.flatnonzero((level[2:-2] > ABOVE) & _is_highest(typical)) + 2
    orders = [
        OrderInSpectrum(float(line / REVOLUTIONS * abs(per)), float(typical[line]), float(level[line]))
        for line in peak
        if line > 4  # the main lobe of the mean
    ]
    return tuple(sorted(orders, key=lambda order: -order.amplitude))


def _is_highest(values: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return where a value is the highest of itself and two neighbours on each side, without the two outermost."""
    around = np.lib.stride_tricks.sliding_window_view(values, 5)
    return np.asarray(around.argmax(axis=1) == 2)


def foreign_orders(
    standing: Iterable[OrderInSpectrum], known: Sequence[GearboxOrder], per: float = 1.0
) -> tuple[OrderInSpectrum, ...]:
    """Orders that belong to no shaft, mesh or sideband of the gearbox, highest first, down to 40 dB below the highest.

    An order at the place of a sideband is foreign if it is less than 3 dB below its mesh order.

    Parameters
    ----------
    standing : as of `standing_orders`
    known : as of `gearbox_orders`
    per : speed of the shaft whose revolutions the windows count, over that of the input

    Examples
    --------
    >>> known = [GearboxOrder(22.0), GearboxOrder(21.0, 22.0), GearboxOrder(23.0, 22.0)]
    >>> found = [OrderInSpectrum(23.0, 2.0, 30.0), OrderInSpectrum(22.0, 1.0, 25.0), OrderInSpectrum(21.0, 0.1, 9.0)]
    >>> [own.order for own in foreign_orders(found, known)]
    [23.0]
    """
    standing = tuple(standing)
    resolution = 1.5 / REVOLUTIONS * abs(per)
    least = max((own.amplitude for own in standing), default=0.0) * 10.0 ** (-BELOW_HIGHEST / 20.0)

    def amplitude_at(order: float) -> float:
        return max((own.amplitude for own in standing if abs(own.order - order) <= resolution), default=0.0)

    def belongs(own: OrderInSpectrum) -> bool:
        near = [order for order in known if abs(order.order - own.order) <= resolution]
        return any(
            order.carrier is None or own.amplitude < amplitude_at(order.carrier) * 10.0 ** (-SIDEBAND_BELOW / 20.0)
            for order in near
        )

    return tuple(own for own in standing if own.amplitude >= least and not belongs(own))
