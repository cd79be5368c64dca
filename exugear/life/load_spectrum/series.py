"""Reading of load series in blocks, with skipped times, scaling and checks, and their reduction to load points.

A point represents samples with torques within a thousandth of each other (with rotor loads within a thirty-second, and
each rotor load within an eighth of its range). Its torque is their mean weighted by revolutions, so that hours,
revolutions and mean torque of every bin are preserved. Small numbers of samples are not reduced.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from exugear.exchange.channels import LONG_SERIES, Channels, LoadFileError
from exugear.exchange.series_files import read_channels
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.loads import SourceSection
from exugear.gearbox.units import RPM
from exugear.life.load_spectrum.counting import Rainflow, equivalent_range
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import ReprMixin

HUB_LOADS = 5
"""Rotor loads in addition to torque: forces along x, y, z, moments about x and y."""
COMPONENTS = ("torque", "force_x", "force_y", "force_z", "moment_x", "moment_y")
"""Components for which equivalent ranges are listed."""
RANGE_EXPONENTS = (3.0, 6.6, 10.0)
"""Slopes of the S-N curves for equivalent ranges."""
MOST_POINTS = 100_000
"""Number of points up to which samples are not reduced."""
HUB_CELLS = 8
"""Number of cells over the range of each rotor load."""
FINE, COARSE = 42, 47
"""Bits of a torque that are dropped to find its cell: 10 and 5 of the 52 mantissa bits remain."""


@dataclass(frozen=True, eq=False)
class Samples(ReprMixin):
    """Load samples with durations."""

    torque: Floats
    speed: Floats
    lasting: Floats
    """(samples,) N m, rad/s, and duration in a unit defined by the owner."""
    hub: Floats
    """(samples, 5) forces along x, y, z and moments about x, y, N and N m; (samples, 0) without rotor loads."""

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.torque)

    def _line(self) -> str:
        return f": {len(self)}"

    def within(self, kept: np.ndarray) -> Samples:
        """Return the samples selected by a mask."""
        return Samples(self.torque[kept], self.speed[kept], self.lasting[kept], self.hub[kept])


def together(parts: list[Samples]) -> Samples:
    """Concatenate samples."""
    names = ("torque", "speed", "lasting", "hub")
    return Samples(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def condensed(samples: Samples, extreme: bool = False) -> Samples:
    """Merge the samples of each cell: to means weighted by revolutions, or to the extreme loads.

    Examples
    --------
    >>> some = Samples(np.array([100.0, 100.01, 250.0]), np.ones(3), np.array([1.0, 3.0, 1.0]), np.zeros((3, 0)))
    >>> condensed(some).torque.round(4).tolist(), condensed(some).lasting.tolist()
    ([100.0075, 250.0], [4.0, 1.0])
    """
    cells = np.ascontiguousarray(samples.torque, dtype=np.float64).view(np.int64) >> (
        COARSE if samples.hub.any() else FINE
    )
    if samples.hub.any():
        span = np.ptp(samples.hub, axis=0)
        inside = (samples.hub - samples.hub.min(axis=0)) / np.where(span > 0.0, span, 1.0)
        for column in np.floor(inside * (HUB_CELLS - 1e-9)).astype(np.int64).T:
            cells = np.unique(cells, return_inverse=True)[1] * HUB_CELLS + column
    number = np.unique(cells, return_inverse=True)[1].ravel()
    if extreme:
        return _largest(samples, number)
    lasting = np.bincount(number, samples.lasting).astype(np.float64)
    weights = np.abs(samples.speed) * samples.lasting
    turns = np.bincount(number, weights).astype(np.float64)
    still = turns == 0.0

    def mean(values: Floats) -> Floats:
        by_time = np.bincount(number, samples.lasting * values) / np.where(lasting > 0.0, lasting, 1.0)
        return np.asarray(np.where(still, by_time, np.bincount(number, weights * values) / np.where(still, 1.0, turns)))

    speed = turns / np.where(lasting > 0.0, lasting, 1.0)
    hub = np.array([mean(column) for column in samples.hub.T]).T.reshape(len(lasting), -1)
    return Samples(mean(samples.torque), speed, lasting, hub)


def _largest(samples: Samples, number: Integers) -> Samples:
    """Return the largest absolute value of each load in a cell, with its sign."""

    def largest(values: Floats) -> Floats:
        order = np.lexsort((np.abs(values), number))
        last = np.append(np.diff(number[order]) > 0, True)
        return np.asarray(values[order[last]])

    hub = np.array([largest(column) for column in samples.hub.T]).T
    torque = largest(samples.torque)
    return Samples(torque, largest(samples.speed), np.zeros(len(torque)), hub.reshape(len(torque), -1))


@dataclass(eq=False)
class SamplePool:
    """Files of one kind, with samples weighted by duration."""

    extreme: bool = False
    seconds: float = 0.0
    """Total duration of the files."""
    count: int = 0
    files: int = 0
    """Number of samples and of files."""
    least: float = np.inf
    largest: float = -np.inf
    """Torque, N m."""
    slowest: float = np.inf
    fastest: float = 0.0
    """Absolute speed under load, rad/s."""
    _parts: list[Samples] = field(default_factory=list)
    _powers: dict[tuple[str, float], float] = field(default_factory=dict)

    def add(self, samples: Samples) -> None:
        """Add samples of a file."""
        if not len(samples):
            return
        self._parts.append(samples)
        self.count += len(samples)
        self.least = min(self.least, float(samples.torque.min()))
        self.largest = max(self.largest, float(samples.torque.max()))
        loaded = np.abs(samples.speed[samples.torque != 0.0])
        self.slowest = min(self.slowest, float(loaded.min(initial=np.inf)))
        self.fastest = max(self.fastest, float(loaded.max(initial=0.0)))
        if sum(map(len, self._parts)) > 2 * max(MOST_POINTS, len(self._parts[0])):
            self._parts = [condensed(together(self._parts), self.extreme)]

    def merge(self, other: SamplePool) -> None:
        """Add the content of another pool."""
        parts = other._parts
        count = other.count
        for samples in parts:
            self.add(samples)
        self.count += count - sum(map(len, parts))
        self.least, self.largest = min(self.least, other.least), max(self.largest, other.largest)
        self.slowest, self.fastest = min(self.slowest, other.slowest), max(self.fastest, other.fastest)
        self.seconds += other.seconds
        self.files += other.files
        for key, power in other._powers.items():
            self._powers[key] = self._powers.get(key, 0.0) + power

    def close(self, counts: Mapping[str, Rainflow], seconds: float) -> None:
        """Add the rainflow counts of a file, and its duration."""
        self.files += 1
        self.seconds += seconds
        for name, count in counts.items():
            ranges, _, cycles = count.cycles()
            for exponent in RANGE_EXPONENTS:
                power = seconds * equivalent_range(ranges, cycles, exponent, seconds) ** exponent
                self._powers[name, exponent] = self._powers.get((name, exponent), 0.0) + power

    def samples(self) -> Samples:
        """Return all samples, reduced if there are many."""
        found = together(self._parts)
        return condensed(found, self.extreme) if len(found) > MOST_POINTS else found

    def equivalent_ranges(self) -> dict[tuple[str, float], float]:
        """Return the damage-equivalent range at one cycle per second of all files together, by component and slope."""
        return {key: (power / self.seconds) ** (1.0 / key[1]) for key, power in self._powers.items()}


# Series of a source read into pools in blocks: skipped times, scaling, and errors with their row

LARGEST_TORQUE = 1e9
"""Largest plausible torque, N m; damages of larger ones would overflow."""
LARGEST_FORCE = 1e9
"""Largest plausible force, N."""
LARGEST_SPEED = 1e5
"""Largest plausible speed, 1/min."""
LEAST_BEFORE_DROPOUT = 0.1
"""Fraction of the largest speed so far above which a shaft cannot stop within one step."""


@dataclass(frozen=True)
class ReadSummary:
    """Summary of the data read from a file."""

    skipped: float
    duration: float
    """s."""
    wind: float
    """Mean wind speed, m/s; NaN if none is required."""
    counts: Mapping[str, Rainflow]
    """By component."""


@dataclass(frozen=True)
class SeriesReader:
    """Reader for the series of one source."""

    gearbox: Gearbox
    key: str
    """Key of the source, for messages."""
    source: SourceSection
    body: str

    @property
    def has_hub(self) -> bool:
        """Whether channels of rotor loads are specified."""
        return self.source.hub_forces is not None or self.source.hub_moments is not None

    def take(self, path: Path, pool: SamplePool) -> ReadSummary:
        """Read a file into a pool.

        Raises
        ------
        LoadFileError
            An invalid file.
        GearboxFileError
            Keys that do not fit the file.
        """
        series = read_channels(path)
        wanted = self._wanted(series)
        counts = {name: Rainflow() for name, asked in zip(COMPONENTS, self._components(), strict=True) if asked}
        first = last = begin = None
        wind = lasting_wind = 0.0
        for time, lasting, values, start in _lasting(self._kept(series, wanted)):
            begin = start if begin is None else begin
            first = float(time[0]) if first is None else first
            last = float(time[-1])
            samples = self._samples(path, time, lasting, values)
            pool.add(samples)
            if self.source.wind is not None:
                wind += float(lasting @ values[:, -1])
                lasting_wind += float(lasting.sum())
            if self.source.kind == "fatigue":
                for name, column in zip(COMPONENTS, (samples.torque, *samples.hub.T), strict=False):
                    if name in counts:
                        counts[name].add(column)
        if first is None or last is None or begin is None or last == first:
            length = series.time[-1] - series.time[0]
            raise self.gearbox.error(
                f"{self.key}.skip_s = {self.source.skip_s:g}: no samples remain of a series of {length:g} s ("
                f"{path.name})"
            )
        found = wind / lasting_wind if lasting_wind else math.nan
        return ReadSummary(first - begin, last - first, found, counts)

    def _components(self) -> list[bool]:
        forces = self.source.hub_forces or (None,) * 3
        moments = self.source.hub_moments or (None,) * 2
        return [True, *(name is not None for name in (*forces, *moments))]

    def _wanted(self, series: Channels) -> list[tuple[str, str]]:
        """Return names and quantities of the channels: torque, speed, rotor loads if any, wind if required."""
        if self.source.skip_s is None:
            raise self.gearbox.error(
                f"{self.key}.skip_s: this key is missing; set the time to skip at the start, 0 for none"
            )
        channels = {}
        if series.path.suffix.lower() == ".csv":
            channels = {"torque": f"{self.body}_N_m", "speed": f"{self.body}_rpm"}
        found = []
        for quantity, given in (("torque", self.source.torque), ("speed", self.source.speed)):
            name = given or channels.get(quantity)
            if name is None:
                shown = ", ".join(series.names[:8])
                raise self.gearbox.error(
                    f"{self.key}.{quantity}: this key is missing; set a channel of the file, such as {shown}"
                )
            found.append((name, quantity))
        found += [(name.removeprefix("-"), quantity) for name, quantity in self._hub()]
        if self.source.wind is not None:
            found.append((self.source.wind, "velocity"))
        return found

    def _hub(self) -> list[tuple[str, str]]:
        forces = [(name, "force") for name in self.source.hub_forces or ()]
        return forces + [(name, "torque") for name in self.source.hub_moments or ()]

    def _kept(self, series: Channels, wanted: list[tuple[str, str]]) -> Iterator[tuple[Floats, Floats, float]]:
        """Yield the blocks after the skipped time, with the start time of the series."""
        start = None
        before = 0
        top = 0.0
        for time, values in series.blocks(wanted):
            start = float(time[0]) if start is None else start
            top = self._check_speed(series.path, values[:, 1], time, before, top)
            before += len(time)
            kept = time >= start + (self.source.skip_s or 0.0)
            if kept.any():
                yield time[kept], values[kept], start

    def _check_speed(self, path: Path, speed: Floats, time: Floats, before: int, top: float) -> float:
        """Refuse implausible speeds; return the largest so far."""
        size = np.abs(speed) * abs(self.source.speed_factor)
        bad = np.flatnonzero(size > LARGEST_SPEED * RPM)
        if bad.size:
            row = int(bad[0])
            raise LoadFileError(
                f"{path}: the speed at {time[row]:g} s (step {before + row + 1}) is {size[row] / RPM:.3g} rpm; "
                f"plausible are up to {LARGEST_SPEED:g} rpm"
            )
        so_far = np.maximum.accumulate(np.append(top, size))
        if before + len(speed) >= LONG_SERIES:
            stopped = np.flatnonzero((size[1:] == 0.0) & (size[:-1] > LEAST_BEFORE_DROPOUT * so_far[1:-1]))
            if stopped.size:
                row = int(stopped[0]) + 1
                raise LoadFileError(
                    f"{path}: the speed falls from {size[row - 1] / RPM:.4g} rpm to 0 within the step to {time[row]:g}"
                    f" s (step {before + row + 1}): a signal dropout; correct the file"
                )
        return float(so_far[-1])

    def _samples(self, path: Path, time: Floats, lasting: Floats, values: Floats) -> Samples:
        """Return the loads of a block with the signs and units of the gearbox."""
        partial = self.source.partial_factor or 1.0
        torque = values[:, 0] * self.source.torque_factor * partial
        hub = np.zeros((len(torque), HUB_LOADS if self.has_hub else 0))
        if self.has_hub:
            places = [place for place, asked in enumerate(self._components()[1:]) if asked]
            signs = np.array([-1.0 if name.startswith("-") else 1.0 for name, _ in self._hub()])
            hub[:, places] = values[:, 2 : 2 + len(places)] * (signs * self.source.hub_factor * partial)
        for name, loads, largest, unit in (
            ("torque", torque[:, None], LARGEST_TORQUE, "N m"),
            ("rotor load", hub, LARGEST_FORCE, "N or N m"),
        ):
            bad = np.argwhere(np.abs(loads) > largest)
            if bad.size:
                row = int(bad[0][0])
                raise LoadFileError(
                    f"{path}: the {name} at {time[row]:g} s is {abs(loads[tuple(bad[0])]):.3g} {unit}; plausible are "
                    f"up to {largest:g}; check its unit and factor"
                )
        return Samples(torque, values[:, 1] * self.source.speed_factor, lasting, hub)


def _lasting(
    blocks: Iterator[tuple[Floats, Floats, float]],
) -> Iterator[tuple[Floats, Floats, Floats, float]]:
    """Return each sample's duration: half the sum of the adjacent steps; at the ends of a series the one step.

    Yields time, duration, values and start of the series by blocks.
    """
    before: float | None = None
    held: tuple[Floats, Floats, float] | None = None
    for block in blocks:
        if held is not None:
            time, values, start = held
            yield time, _halves(before, time, float(block[0][0])), values, start
            before = float(time[-1])
        held = block
    if held is not None:
        time, values, start = held
        yield time, _halves(before, time, None), values, start


def _halves(before: float | None, time: Floats, behind: float | None) -> Floats:
    if before is None and behind is None and len(time) == 1:
        return np.zeros(1)
    around = time
    if before is not None:
        around = np.append(before, around)
    if behind is not None:
        around = np.append(around, behind)
    found = np.gradient(around)
    return np.asarray(found[int(before is not None) : len(found) - int(behind is not None)])
