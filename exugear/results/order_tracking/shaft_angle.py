"""Angle of a shaft over time, from the pulses of a tacho or from a speed signal.

The angle of a tacho is a least-squares cubic spline through the pulses. A spline through every pulse follows the
jitter of the pulses, and knots at every n-th pulse are too stiff where a run-up begins; knots even in time, as many as
predict left-out pulses best, average the jitter out and follow the run-up.
"""

from __future__ import annotations

import statistics
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.units import RPM
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import ReprMixin, TitledRows, value_range

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

FEWEST_PULSES = 16
"""Minimum number of pulses."""
HYSTERESIS = 0.2
"""Drop below the trigger level, as a fraction of the swing, before the next pulse is accepted."""
BLOCKS = 50
"""Number of blocks of a tacho signal whose median extremes are its two levels; single spikes then do not count."""
EXTRA, MISSING = 0.35, 1.6
"""Interval over the usual one below which a pulse is extra, and above which pulses are missing."""
SLOWEST = 0.05
"""Fraction of the highest speed below which the beginning and the end of a run are left out."""
TURNING_BACK = 0.02
"""Speed in the other sense, as a fraction of the highest, from which the shaft turns back; less is an offset."""
KNOTS = (4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024)
"""Numbers of intervals between knots that are tried."""
AS_GOOD = 1.02
"""Prediction error over the smallest one up to which fewer knots are preferred."""


class SpeedSignalError(ValueError):
    """A tacho or speed signal from which no angle follows; the message states the reason and the remedy."""


@dataclass(frozen=True, eq=False)
class ShaftAngle(ReprMixin):
    """Angle of a shaft at the samples of a recording, without sign."""

    rate: float
    """Sampling rate, Hz."""
    first: int
    """Sample of the recording at which the angle begins."""
    angle: Floats
    speed: Floats
    """(n,) angle from zero on, rad, and speed, rad/s, at successive samples."""
    remarks: tuple[str, ...] = ()
    """Deficiencies of the signal that were corrected."""

    @property
    def time(self) -> Floats:
        """Times since the first sample of the recording, (n,), s."""
        return (self.first + np.arange(self.angle.size)) / self.rate

    @property
    def revolutions(self) -> float:
        """Number of revolutions."""
        return float(self.angle[-1] / (2.0 * np.pi))

    def of_shaft(self, ratio: float) -> ShaftAngle:
        """Angle of another shaft that turns `ratio` times as fast."""
        return replace(self, angle=abs(ratio) * self.angle, speed=abs(ratio) * self.speed)

    def _line(self) -> str:
        return f": {self.revolutions:.1f} revolutions, {value_range(self.speed, 'rpm', 1.0 / RPM)}"

    def _table(self) -> TitledRows:
        rows = {"revolutions": f"{self.revolutions:.1f}", "speed": value_range(self.speed, "rpm", 1.0 / RPM)}
        return "Shaft angle", rows | {f"remark {n}": remark for n, remark in enumerate(self.remarks, start=1)}


def pulse_times(values: Floats, rate: float) -> Floats:
    """Find the times (s) of rising edges of a tacho signal (n,), linear between samples; the rate is in Hz.

    The trigger level is halfway between low and high. Pulses may cover any part of a revolution, as long as every
    fiftieth part of the signal has one.

    Raises
    ------
    SpeedSignalError
        The signal has fewer than sixteen pulses.

    Examples
    --------
    >>> time = np.arange(20000) / 1000.0
    >>> pulse_times(np.sin(2 * np.pi * 5.0 * time + 0.1), 1000.0)[1:4].round(4)
    array([0.3968, 0.5968, 0.7968])
    """
    blocks = np.array_split(values, BLOCKS)
    low = float(np.median([block.min() for block in blocks]))
    high = float(np.median([block.max() for block in blocks]))
    level = 0.5 * (low + high)
    above = values > level
    rising = np.flatnonzero(above[1:] & ~above[:-1]) + 1
    # A pulse counts if the signal was clearly low since the one before: noise on a slow edge crosses the level often.
    clearly_low = np.flatnonzero(values < level - HYSTERESIS * (high - low))
    last_low = np.searchsorted(clearly_low, rising)
    rising = rising[np.diff(last_low, prepend=-1 if not clearly_low.size else 0) > 0]
    if not high > low or rising.size < FEWEST_PULSES:
        raise SpeedSignalError(
            f"has {rising.size if high > low else 0} pulses; at least {FEWEST_PULSES} are required, so name the "
            "channel of the tacho, or record longer"
        )
    before, after = values[rising - 1], values[rising]
    return np.asarray((rising - 1 + (level - before) / (after - before)) / rate)


@dataclass(frozen=True, eq=False)
class PulseTrain:
    """Pulses with their count: where some are missing, the count rises by more than one."""

    time: Floats
    count: Integers
    """(n,) time of each pulse, s, and number of pulses before it."""
    missing: int
    extra: int
    """How many were missing, and were left out as extra ones."""


def counted_pulses(time: Floats) -> PulseTrain:
    """Count pulses, with missing and extra ones found by their distance relative to the ones before.

    Examples
    --------
    >>> regular = 0.1 * np.arange(40)
    >>> train = counted_pulses(np.sort(np.append(np.delete(regular, [7, 8]), 1.52)))
    >>> train.missing, train.extra, int(train.count[-1])
    (2, 1, 39)
    """
    ratio = time[2:] - time[1:-1]
    ratio = ratio / (time[1:-1] - time[:-2])
    if np.all((ratio > 0.6) & (ratio < MISSING)):
        return PulseTrain(time, np.arange(time.size), 0, 0)
    kept, counts, extra = [0], [0], 0
    usual = [float(np.median(np.diff(time)[:3]))]
    for number in range(1, time.size):
        distance = (time[number] - time[kept[-1]]) / statistics.median(usual)
        if distance < EXTRA:
            extra += 1
            continue
        periods = round(distance) if distance > MISSING else 1
        usual = [*usual, (time[number] - time[kept[-1]]) / periods][-3:]
        kept.append(number)
        counts.append(counts[-1] + periods)
    count = np.array(counts)
    return PulseTrain(time[kept], count, int(count[-1]) - len(kept) + 1, extra)


def mark_places(train: PulseTrain, per_revolution: int) -> Floats:
    """Places of the marks of a revolution relative to an even division, (per_revolution,), in revolutions, mean zero.

    The pulses of one mark are a clock without division errors; the others are read on it.

    Examples
    --------
    >>> counts = np.arange(400)
    >>> time = (counts + 0.05 * (counts % 4 == 2)) / 40.0
    >>> mark_places(counted_pulses(time), 4).round(4)
    array([-0.0031, -0.0031,  0.0094, -0.0031])
    """
    from scipy.interpolate import CubicSpline

    mark = train.count % per_revolution
    own = mark == 0
    if per_revolution == 1 or np.count_nonzero(own) < FEWEST_PULSES:
        return np.zeros(per_revolution)
    clock = CubicSpline(train.time[own], train.count[own] / per_revolution)
    inside = (train.time >= train.time[own][0]) & (train.time <= train.time[own][-1])
    away = clock(train.time) - train.count / per_revolution
    places = np.array([np.median(away[inside & (mark == m)]) for m in range(per_revolution)])
    return np.asarray(places - places.mean())


def angle_of_tacho(values: Floats, rate: float, per_revolution: int = 1) -> ShaftAngle:
    """Angle of a shaft from a tacho.

    Parameters
    ----------
    values : (n,) tacho signal in any unit
    rate : sampling rate, Hz
    per_revolution : pulses per revolution; errors of division are learned and removed

    Returns
    -------
    between the first and the last pulse, without the parts below a twentieth of the highest speed

    Raises
    ------
    SpeedSignalError
        There are too few pulses, or the angle does not increase.

    Examples
    --------
    >>> time = np.arange(50000) / 5000.0
    >>> tacho = np.cos(2 * np.pi * (5.0 * time + 1.5 * time**2)) > 0.9  # 300 to 2,100 rpm
    >>> angle_of_tacho(tacho.astype(float), 5000.0)
    <ShaftAngle: 199.0 revolutions, 331.686 to 2099.66 rpm>
    """
    train = counted_pulses(pulse_times(values, rate))
    places = mark_places(train, per_revolution)
    turns = train.count / per_revolution + places[train.count % per_revolution]
    intervals = np.diff(train.time) / np.diff(train.count)
    usable = np.flatnonzero(intervals < intervals.min() / SLOWEST)
    kept = slice(usable[0], usable[-1] + 2)
    time, angle = train.time[kept], 2.0 * np.pi * turns[kept]
    spline = _smooth_spline(time, angle)
    first, last = int(np.ceil(time[0] * rate)), int(np.floor(time[-1] * rate))
    samples = np.arange(first, last + 1) / rate
    found, speed = _values_and_slopes(spline, samples)
    if not speed.min() > 0.0:
        raise SpeedSignalError(
            f"does not increase near {samples[speed.argmin()]:.4g} s; check the channel and its pulses per revolution"
        )
    remarks = [
        f"{number} {what} pulse{'s' * (number > 1)} of {train.time.size} corrected"
        for number, what in ((train.missing, "missing"), (train.extra, "extra"))
        if number
    ]
    return ShaftAngle(rate, first, found - found[0], speed, tuple(remarks))


def _smooth_spline(time: Floats, angle: Floats) -> BSpline:
    """Least-squares cubic spline whose number of knots predicts every second pulse best from the others."""
    errors = {}
    for intervals in KNOTS:
        if intervals > time.size // 6:
            break
        # Root mean square error of left-out pulses, rad
        predicted = _least_squares(time[::2], angle[::2], intervals)(time[1::2])
        inside = slice(0, -1) if time.size % 2 == 0 else slice(None)  # a last pulse would be extrapolated
        errors[intervals] = float(np.sqrt(np.mean((predicted - angle[1::2])[inside] ** 2)))
    least = min(errors.values(), default=np.inf)
    chosen = next((intervals for intervals, error in errors.items() if error <= AS_GOOD * least), 2)
    return _least_squares(time, angle, chosen)


def _least_squares(time: Floats, angle: Floats, intervals: int) -> BSpline:
    from scipy.interpolate import make_lsq_spline

    degree = 3
    even = np.linspace(time[0], time[-1], intervals + 1)[1:-1]
    # Each interval between knots needs data (Schoenberg and Whitney); at low speed pulses are far apart.
    place = np.searchsorted(time, even)
    knots, last = [], 1
    for knot, before in zip(even, place, strict=True):
        if before - last >= 2 and time.size - before >= 3:
            knots.append(knot)
            last = before
    ends = degree + 1
    return make_lsq_spline(time, angle, np.r_[[time[0]] * ends, knots, [time[-1]] * ends], degree)


def _values_and_slopes(spline: BSpline, at: Floats) -> tuple[Floats, Floats]:
    """Values and slopes of a cubic spline at ascending places between its ends, interval by interval.

    There are thousands of samples in an interval; to look each of them up takes ten times as long.
    """
    from scipy.interpolate import PPoly

    pieces = PPoly.from_spline((spline.t, spline.c, spline.k))
    first = np.searchsorted(at, pieces.x)
    first[0], first[-1] = 0, at.size
    values, slopes = np.empty(at.size), np.empty(at.size)
    for begin, low, high, (a, b, c, d) in zip(pieces.x[:-1], first[:-1], first[1:], pieces.c.T, strict=True):
        x = at[low:high] - begin
        values[low:high] = ((a * x + b) * x + c) * x + d
        slopes[low:high] = (3.0 * a * x + 2.0 * b) * x + c
    return values, slopes


def angle_of_speed(speed: Floats, rate: float) -> ShaftAngle:
    """Angle of a shaft from a speed signal (n,), rad/s in either sense, by integration; the rate is in Hz.

    An error e of the speed shifts the phase of order n by 2 pi n R e within R revolutions: for levels within 0.2 dB
    under a Hann window, n R e must be below 0.18. A signal that is 0.1 % wrong is good for orders up to 22 with eight
    revolutions.

    Returns
    -------
    over the longest part above a twentieth of the highest speed

    Raises
    ------
    SpeedSignalError
        The shaft stands still, or its sense of rotation changes.

    Examples
    --------
    >>> angle_of_speed(np.linspace(-10.0, -100.0, 1001), 100.0)
    <ShaftAngle: 87.5 revolutions, 95.493 to 954.93 rpm>
    """
    from scipy.integrate import cumulative_trapezoid

    fastest = float(np.abs(speed).max())
    sense = 1.0 if speed.max() == fastest else -1.0
    if fastest == 0.0 or (sense * speed).min() < -TURNING_BACK * fastest:
        what = "is zero throughout" if fastest == 0.0 else "changes its sign"
        raise SpeedSignalError(f"{what}; name the channel of the speed, or cut the recording")
    turning = np.concatenate([[False], sense * speed > SLOWEST * fastest, [False]])
    begins, ends = np.flatnonzero(turning[1:] & ~turning[:-1]), np.flatnonzero(turning[:-1] & ~turning[1:])
    longest = int((ends - begins).argmax())
    part = sense * speed[begins[longest] : ends[longest]]
    angle = cumulative_trapezoid(part, dx=1.0 / rate, initial=0)
    return ShaftAngle(rate, int(begins[longest]), np.asarray(angle), np.asarray(part))
