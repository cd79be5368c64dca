"""Order cuts over the angle of a shaft: Hann windows over whole revolutions, without resampling.

Under a window w of R revolutions, the complex amplitude of order n is

    A = 2 ∫ y(a) exp(-i n a) w(a) da / ∫ w(a) da,   w(a) = 1/2 - 1/2 cos(a / R),

over the angle a of the shaft. It is exact for an order of constant amplitude at any sweep rate, and orders that are at
least 2/R apart do not disturb each other where their amplitudes are constant. A resonance that is crossed within a
window is averaged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from exugear.results.order_tracking.shaft_angle import ShaftAngle
from exugear.results.spectra.resonances import OrderCut
from exugear.results.spectra.waterfall import OrderLine
from fe_ste.tools.arrays import Complexes, Floats, Integers
from fe_ste.tools.compilation import summing

USABLE_BAND = 0.45
"""Fraction of the sampling rate up to which an order is evaluated; anti-aliasing filters cut above."""
BANDWIDTH = 1.5
"""Equivalent noise bandwidth of the Hann window, in one over its revolutions (Harris, 1978, table I)."""
STEPS = 8
"""Number of steps of a window from one cut to the next within its length."""


class TooShortError(ValueError):
    """A run that is shorter than a window."""


@dataclass(frozen=True)
class AngleWindow:
    """Hann window over whole revolutions of the shaft.

    Examples
    --------
    >>> AngleWindow(8.0).description
    'Hann window over 8 revolutions, bandwidth 0.188 orders, 1 revolution apart'
    """

    revolutions: float = 8.0

    @property
    def description(self) -> str:
        """Window, bandwidth and distance of successive windows as text, for captions."""
        step = self.revolutions / STEPS
        return (
            f"Hann window over {self.revolutions:g} revolutions, bandwidth {BANDWIDTH / self.revolutions:.3g} orders, "
            f"{step:g} revolution{'s' * (step != 1.0)} apart"
        )


def angle_cuts(
    values: Floats, shaft: ShaftAngle, lines: Sequence[OrderLine], window: AngleWindow | None = None, per: float = 1.0
) -> list[list[OrderCut]]:
    """Cut orders out of signals along the angle of a shaft.

    Parameters
    ----------
    values : (channels, n) signals at the samples of `shaft`
    shaft : angle of the shaft to which the orders refer
    lines : orders
    window : by default over eight revolutions
    per : speed of the shaft whose revolutions the window counts, over that of `shaft`

    Returns
    -------
    cuts of each channel, one for each order, zero-to-peak, in the signal's unit; amplitudes are NaN where the order is
    above 0.45 of the sampling rate

    Raises
    ------
    TooShortError
        The run is shorter than a window.

    Examples
    --------
    >>> from exugear.results.order_tracking.shaft_angle import angle_of_speed
    >>> time = np.arange(40000) / 4000.0
    >>> shaft = angle_of_speed(2 * np.pi * (5.0 + 3.0 * time), 4000.0)
    >>> ((cut,),) = angle_cuts(0.5 * np.cos(30.0 * shaft.angle + 1.0)[None], shaft, [OrderLine("30", 30.0)])
    >>> bool(np.allclose(cut.amplitude, 0.5 * np.exp(1j), rtol=0.0, atol=1e-4))
    True
    """
    frames = _Frames.of(shaft, window or AngleWindow(), per)
    base = np.stack([np.ones(shaft.angle.size), shaft.time, shaft.speed])
    weight, time, speed = frames.means(base, [0.0])[0].real
    amplitudes = 2.0 * frames.means(values, [line.order for line in lines]) / weight
    cuts: list[list[OrderCut]] = [[] for _ in values]
    for line, amplitude in zip(lines, amplitudes, strict=True):
        frequency = line.frequency(speed / weight)
        amplitude[:, frequency > USABLE_BAND * shaft.rate] = np.nan
        for own, found in zip(cuts, amplitude, strict=True):
            own.append(OrderCut(line, time / weight, speed / weight, frequency, found))
    return cuts


def mean_over_angle(envelope: Complexes, shaft: ShaftAngle, window: AngleWindow, per: float = 1.0) -> Complexes:
    """Average complex envelopes (channels, n) under the windows of `angle_cuts`, (channels, frames).

    An amplitude that is computed over time is thereby averaged as that of a measured order.
    """
    frames = _Frames.of(shaft, window, per)
    parts = np.concatenate([envelope.real, envelope.imag, np.ones((1, shaft.angle.size))])
    *means, weight = frames.means(parts, [0.0])[0].real
    means = np.array(means) / weight
    return np.asarray(means[: len(envelope)] + 1j * means[len(envelope) :])


@dataclass(frozen=True, eq=False)
class _Frames:
    """Windows of equal angle, each of `STEPS` bins, and the samples in the bins.

    A Hann window is a constant and two exponentials. Sums over bins, of the signal and of its products with the
    exponentials, therefore give every window exactly: `STEPS` bins each, with the phase of its beginning.
    """

    angle: Floats
    weight: Floats
    """(n,) angle and its step, rad."""
    turn: float
    """Periods of the exponential of the window per radian: one per window."""
    bounds: Integers
    """(bins + 1,) first sample of each bin."""
    begin: Complexes
    """(frames,) exponential of the window where each window begins."""

    @classmethod
    def of(cls, shaft: ShaftAngle, window: AngleWindow, per: float) -> _Frames:
        turn = abs(per) / window.revolutions
        step = 2.0 * np.pi / turn / STEPS
        bins = int((shaft.angle[-1] - shaft.angle[0]) / step)
        if bins < STEPS:
            raise TooShortError(
                f"{shaft.revolutions * abs(per):.3g} revolutions are shorter than a window of {window.revolutions:g}; "
                "choose a shorter window, record longer, or check shaft and unit of the speed"
            )
        edges = shaft.angle[0] + step * np.arange(bins + 1)
        return cls(
            angle=shaft.angle,
            weight=np.gradient(shaft.angle),
            turn=turn,
            bounds=np.searchsorted(shaft.angle, edges).astype(np.int64),
            begin=np.exp(1j * turn * edges[: bins + 1 - STEPS]),
        )

    def means(self, values: Floats, orders: Sequence[float]) -> Complexes:
        """Windowed sums of values (channels, n) times exp(-i order angle), (orders, channels, frames)."""
        signals = np.ascontiguousarray(values, dtype=np.float64)
        sums = _bin_sums(signals, self.angle, self.weight, self.turn, np.array(orders), self.bounds, _TURNED)
        running = np.zeros((*sums.shape[:2], sums.shape[2] + 1, 3), dtype=np.complex128)
        np.cumsum(sums, axis=2, out=running[:, :, 1:])
        constant, ahead, behind = np.moveaxis(running[:, :, STEPS:] - running[:, :, :-STEPS], 3, 0)
        return np.asarray(0.5 * constant - 0.25 * (ahead / self.begin + behind * self.begin))


_TURN_STEPS = 4096
_TURNED = np.array([np.cos(2.0 * np.pi * np.arange(_TURN_STEPS) / _TURN_STEPS),
                    np.sin(2.0 * np.pi * np.arange(_TURN_STEPS) / _TURN_STEPS)])  # fmt: skip


@summing
def _turn(angle: Floats, order: float, turned: Floats, cosine: Floats, sine: Floats) -> None:
    """Write cosine and sine of order times angle: of the nearest of 4096 steps, turned by the rest, within 2e-14.

    The rest is at most pi / 4096, for which the first terms of the series left out are rest^4 / 24 = 1.5e-14 and
    rest^5 / 120. Functions of the processor's library take four times as long.
    """
    step = 2.0 * np.pi / _TURN_STEPS
    for k in range(angle.shape[0]):
        steps = order * angle[k] / step
        nearest = np.floor(steps + 0.5)
        place = int(nearest) & (_TURN_STEPS - 1)
        rest = (steps - nearest) * step
        square = rest * rest
        real, imaginary = 1.0 - 0.5 * square, rest * (1.0 - square / 6.0)
        cosine[k] = turned[0, place] * real - turned[1, place] * imaginary
        sine[k] = turned[1, place] * real + turned[0, place] * imaginary


@summing
def _bin_sums(
    values: Floats, angle: Floats, weight: Floats, turn: float, orders: Floats, bounds: Integers, turned: Floats
) -> Complexes:
    """Return sums over bins of y exp(-i order a) da, and of their products with exp(i turn a) and its conjugate.

    All orders of a bin are summed while its samples are in the cache.
    """
    channels, bins = values.shape[0], bounds.shape[0] - 1
    longest = np.max(bounds[1:] - bounds[:-1])
    sums = np.zeros((orders.shape[0], channels, bins, 3), dtype=np.complex128)
    cosine, sine = np.empty(longest), np.empty(longest)
    plain, along, across = np.empty((channels, longest)), np.empty((channels, longest)), np.empty((channels, longest))
    for b in range(bins):
        first = bounds[b]
        size = bounds[b + 1] - first
        _turn(angle[first : first + size], turn, turned, cosine, sine)
        for c in range(channels):
            for k in range(size):
                y = values[c, first + k] * weight[first + k]
                plain[c, k] = y
                along[c, k] = y * cosine[k]
                across[c, k] = y * sine[k]
        for n in range(orders.shape[0]):
            _turn(angle[first : first + size], orders[n], turned, cosine, sine)
            for c in range(channels):
                pc = ps = ac = az = xc = xs = 0.0
                for k in range(size):
                    pc += plain[c, k] * cosine[k]
                    ps += plain[c, k] * sine[k]
                    ac += along[c, k] * cosine[k]
                    az += along[c, k] * sine[k]
                    xc += across[c, k] * cosine[k]
                    xs += across[c, k] * sine[k]
                sums[n, c, b, 0] = complex(pc, -ps)
                sums[n, c, b, 1] = complex(ac + xs, xc - az)
                sums[n, c, b, 2] = complex(ac - xs, -az - xc)
    return sums
