"""Recording of a measurement: channels with quantity, unit and values at one rate, and the checks of all formats."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exugear.exchange.channels import SHOWN_NAMES, channels_like
from exugear.gearbox.units import Unit, unit_of
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin, TitledRows

FEWEST_SAMPLES = 16
"""Minimum number of samples of a recording."""
MOST_SAMPLES = 200_000_000
"""Maximum number of samples of a channel: 1.6 GB in memory, 66 minutes at 50 kHz."""
SAME_RATE = 1e-5
"""Relative difference up to which sampling rates are equal: headers round the time step to six digits."""
GAP = 1.5
"""Distance of two samples, in usual time steps, from which samples are missing between them."""
UNEVEN = 0.5
"""Largest distance of a sample from its place at an even rate, in time steps; written times are rounded."""


class RecordingError(ValueError):
    """An unusable recording; the message states file, place, value and remedy in one sentence."""


@dataclass(frozen=True, eq=False)
class RecordedChannel(ReprMixin, line=" {name!r}: {values.size} samples, unit {unit!r}, {quantity}"):
    """A channel as it was recorded."""

    name: str
    unit: str
    """Unit as written in the file; empty if it has none."""
    values: Floats
    """(n,) values in that unit."""

    @property
    def known_unit(self) -> Unit | None:
        """Quantity and factor to SI of the unit; None for an unknown unit, or none."""
        return unit_of(self.unit, any_case=True) if self.unit.strip(" []()") else None

    @property
    def quantity(self) -> str:
        """Quantity of the unit, such as ``acceleration``; empty for an unknown unit, or none."""
        return "" if self.known_unit is None else self.known_unit.quantity

    @property
    def clipped(self) -> float:
        """Fraction of samples in runs of three or more at the same largest or smallest value, which clipping leaves.

        Signals that are not clipped touch their extremes for one sample, or for two. A channel with few levels, such as
        a tacho, is clipped by design.

        Examples
        --------
        >>> wave = np.sin(np.linspace(0.0, 60.0, 1000))
        >>> RecordedChannel("a", "", wave).clipped, RecordedChannel("a", "", np.clip(wave, -0.8, 0.8)).clipped > 0.3
        (0.0, True)
        """
        found = 0
        for extreme in (self.values.max(), self.values.min()):
            at = np.concatenate([[False], self.values == extreme, [False]])
            begins, ends = np.flatnonzero(at[1:] & ~at[:-1]), np.flatnonzero(at[:-1] & ~at[1:])
            lengths = ends - begins
            found += int(lengths[lengths >= 3].sum())
        return found / self.values.size if np.ptp(self.values) > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class Recording(ReprMixin):
    """Channels sampled at one rate.

    Examples
    --------
    >>> wave = RecordedChannel("left", "g", np.sin(np.arange(100.0)))
    >>> recording = recording_of(Path("bench.unv"), 50.0, 0.0, [wave])
    >>> recording
    <Recording of bench.unv: 100 samples at 50 Hz, left>
    >>> recording.channel("LEFT").quantity, recording.duration
    ('acceleration', 2.0)
    """

    path: Path
    rate: float
    """Sampling rate, Hz."""
    start: float
    """Time of the first sample, s."""
    channels: tuple[RecordedChannel, ...]

    @property
    def samples(self) -> int:
        """Number of samples of each channel."""
        return self.channels[0].values.size

    @property
    def duration(self) -> float:
        """Number of samples over sampling rate, s."""
        return self.samples / self.rate

    @property
    def time(self) -> Floats:
        """Times of the samples, (n,), s."""
        return self.start + np.arange(self.samples) / self.rate

    def channel(self, name: str) -> RecordedChannel:
        """One channel by its name, in upper or lower case.

        Raises
        ------
        RecordingError
            There is no such channel; the message lists names like it.
        """
        (place,) = places_of(self.path, [channel.name for channel in self.channels], [name])
        return self.channels[place]

    def _line(self) -> str:
        names = ", ".join(channel.name for channel in self.channels[:SHOWN_NAMES])
        return f" of {self.path.name}: {self.samples} samples at {self.rate:g} Hz, {names}"

    def _table(self) -> TitledRows:
        rows = {channel.name: f"{channel.unit or 'no unit'} {channel.quantity}".strip() for channel in self.channels}
        return f"{self.path.name}: {self.duration:g} s at {self.rate:g} Hz", rows


def places_of(path: Path, available: Sequence[str], wanted: Iterable[str] | None) -> tuple[int, ...]:
    """Places of the wanted channels among the available ones, in upper or lower case; all of them by default.

    Raises
    ------
    RecordingError
        There is no such channel; the message lists names like it.

    Examples
    --------
    >>> places_of(Path("a.csv"), ["left", "right"], ["Right"])
    (1,)
    """
    if wanted is None:
        return tuple(range(len(available)))
    lower = [name.lower() for name in available]
    places = []
    for name in wanted:
        if name in available:
            places.append(available.index(name))
        elif name.lower() in lower:
            places.append(lower.index(name.lower()))
        else:
            raise RecordingError(f"{path}: no channel {name!r}; {channels_like(name, available)}")
    return tuple(places)


def check_sizes(path: Path, where: str, samples: int, rate: float) -> None:
    """Refuse impossible header values before memory is allocated for samples.

    Raises
    ------
    RecordingError
        There are too few or too many samples, or the sampling rate is no positive number.
    """
    if not FEWEST_SAMPLES <= samples <= MOST_SAMPLES:
        raise RecordingError(
            f"{path}: {where} has {samples} samples; {FEWEST_SAMPLES} to {MOST_SAMPLES:g} are read, so "
            f"{'record longer' if samples < FEWEST_SAMPLES else 'split the file'}"
        )
    if not (math.isfinite(rate) and rate > 0.0):
        raise RecordingError(
            f"{path}: {where} has the sampling rate {rate:g} Hz; a positive number is required, so export the file "
            "again with its time step"
        )


def recording_of(path: Path, rate: float, start: float, channels: Sequence[RecordedChannel]) -> Recording:
    """Build a checked recording.

    Parameters
    ----------
    rate : sampling rate, Hz
    start : time of the first sample, s
    channels : at least one

    Raises
    ------
    RecordingError
        Channels differ in length, have too few samples, or a value is not a finite number.
    """
    if not channels:
        raise RecordingError(f"{path}: has no channels over time; export the time signals")
    first = channels[0]
    for channel in channels:
        if channel.values.size != first.values.size:
            raise RecordingError(
                f"{path}: channel {channel.name} has {channel.values.size} samples and {first.name} has "
                f"{first.values.size}; channels of one recording have equal lengths, so export them with one rate"
            )
    check_sizes(path, "the recording", first.values.size, rate)
    for channel in channels:
        bad = np.flatnonzero(~np.isfinite(channel.values))
        if bad.size:
            raise RecordingError(
                f"{path}: channel {channel.name} has no number at {start + bad[0] / rate:g} s (sample {bad[0] + 1}"
                f"{f', and {bad.size - 1} more' if bad.size > 1 else ''}); fill the dropout, or cut the recording there"
            )
    return Recording(path, rate, start if math.isfinite(start) else 0.0, tuple(channels))


def even_rate(path: Path, time: Floats) -> float:
    """Return the sampling rate (Hz) of written times (s), which must be even.

    Written times are rounded, so a sample may be up to half a step from its place.

    Raises
    ------
    RecordingError
        Times do not increase, have a gap, or are not even; the message states where.

    Examples
    --------
    >>> even_rate(Path("a.csv"), np.round(np.arange(100) / 3000.0, 5)).__round__(6)
    3000.0
    >>> even_rate(Path("a.csv"), np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.2] + [0.5] * 20))
    Traceback (most recent call last):
    ...
    exugear.exchange.recordings.recording.RecordingError: a.csv: time does not increase after 0.4 s (sample 5); ...
    """
    if not np.isfinite(time).all():
        bad = int(np.flatnonzero(~np.isfinite(time))[0])
        raise RecordingError(f"{path}: the time of sample {bad + 1} is not a number; correct the file")
    check_sizes(path, "the recording", time.size, 1.0)
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0.0)
    if back.size:
        raise RecordingError(
            f"{path}: time does not increase after {time[back[0]]:g} s (sample {back[0] + 1}); sort the samples, or "
            "export times with more digits"
        )
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > GAP * usual)
    if gaps.size:
        raise RecordingError(
            f"{path}: no samples between {time[gaps[0]]:g} and {time[gaps[0] + 1]:g} s (after sample {gaps[0] + 1}), "
            f"where the time step is {usual:g} s; fill the gap, or cut the recording there"
        )
    step = float(time[-1] - time[0]) / (time.size - 1)
    away = np.abs(time - time[0] - step * np.arange(time.size))
    if away.max() > UNEVEN * step:
        worst = int(away.argmax())
        raise RecordingError(
            f"{path}: samples are not even: that at {time[worst]:g} s is {away[worst] / step:.2g} time steps from its "
            "place; export the recording with one sampling rate"
        )
    return 1.0 / step


def common_rate(path: Path, names: Sequence[str], rates: Sequence[float]) -> float:
    """Return the sampling rate (Hz) that all channels share.

    Raises
    ------
    RecordingError
        Rates differ by more than `SAME_RATE`.
    """
    for name, rate in zip(names, rates, strict=True):
        if abs(rate - rates[0]) > SAME_RATE * abs(rates[0]):
            raise RecordingError(
                f"{path}: channel {name} is sampled at {rate:g} Hz and {names[0]} at {rates[0]:g} Hz; export them with "
                "one rate"
            )
    return rates[0]


def floats(values: NDArray[np.generic]) -> Floats:
    """Values of any number type and byte order in double precision."""
    with np.errstate(invalid="ignore"):  # a signalling NaN of a damaged file; it is found as a value that is no number
        return np.ascontiguousarray(values, dtype=np.float64)
