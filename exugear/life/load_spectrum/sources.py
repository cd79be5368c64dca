"""Load sources of a gearbox file: files found, read and weighted by hours of the life, with the hash of each."""

from __future__ import annotations

import csv
import hashlib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from exugear.exchange.channels import LoadFileError
from exugear.exchange.rexs.containers import read_rexs
from exugear.exchange.rexs.to_case.bodies import find_bodies
from exugear.exchange.rexs.to_case.loads import ImportedLoads, loads_of
from exugear.exchange.rexs.to_case.notes import ComponentPositions, Notes
from exugear.exchange.rexs.tree import Model, RexsError, RexsLoadCase
from exugear.exchange.series_files import (
    LARGEST_SERIES,
    SERIES_ENDINGS,
    first_lines,
    headings_of,
    is_series,
    table_rows,
)
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import shortened
from exugear.gearbox.sections.entries import HOURS_PER_YEAR
from exugear.gearbox.sections.loads import LoadsSection, SourceSection, WindSection
from exugear.gearbox.units import RPM
from exugear.life.load_spectrum.counting import DurationDistribution, LoadPoints, load_duration, load_points
from exugear.life.load_spectrum.series import (
    HUB_LOADS,
    LARGEST_SPEED,
    LARGEST_TORQUE,
    SamplePool,
    Samples,
    SeriesReader,
    together,
)
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.files import FileError, file_digest

# Hours of simulated files by wind speed: a Weibull distribution over wind speed bins


def bin_of_wind(wind: WindSection, speed: float) -> float:
    """Return the middle (m/s) of the bin of a wind speed (m/s), a multiple of the bin width.

    Examples
    --------
    >>> bin_of_wind(WindSection(mean_m_per_s=8.5), 8.93)
    8.0
    """
    width = wind.bin_m_per_s
    return width * math.floor(max(speed, 0.0) / width + 0.5)


def hours_of_bins(wind: WindSection, middles: Iterable[float]) -> list[float]:
    """Return the hours per year of bins given by their middles (m/s).

    Notes
    -----
    ``F(v) = 1 - exp(-(v / A)^k)``, ``A = mean / Gamma(1 + 1 / k)`` (IEC 61400-1, 6.3.1.1, with k = 2).

    Examples
    --------
    Wind of 8.5 m/s on average blows at 7 to 9 m/s for 1,512 hours:

    >>> [round(hours) for hours in hours_of_bins(WindSection(mean_m_per_s=8.5), [8.0])]
    [1512]
    """
    scale = wind.mean_m_per_s / math.gamma(1.0 + 1.0 / wind.shape)

    def above(speed: float) -> float:
        return math.exp(-((max(speed, 0.0) / scale) ** wind.shape))

    half = 0.5 * wind.bin_m_per_s
    return [wind.hours_per_year * (above(middle - half) - above(middle + half)) for middle in middles]


# Load cases of a REXS file as a table of loads: torque and speed of a body, and the time fraction of each


def rexs_load_cases(gearbox: Gearbox, path: Path, body: str) -> tuple[Floats, Floats, Floats]:
    """Return torques (N m), speeds (rad/s) and time fractions, each (load cases,), on a body of the gearbox file.

    Parameters
    ----------
    gearbox : as `exugear import` makes it from the same REXS file, with its body names

    Raises
    ------
    RexsError
        No load cases, or one without torque on the body, speed or time fraction.
    """
    model = read_rexs(path)
    notes = Notes()
    if not model.load_cases:
        raise RexsError(f"{path}: holds no load spectrum; expected load cases with their share of the time")
    places = ComponentPositions(model)
    bodies = find_bodies(model, places, notes)
    notes.errors.tell()
    rows = []
    for case, loads in zip(model.load_cases, loads_of(model, places, bodies, notes), strict=True):
        where = f"{path}: load case {case.number}"
        if body not in loads.torques:
            known = ", ".join(loads.torques) or "no body"
            raise RexsError(f"{where}: no torque on {body!r}; it loads {known}")
        rows.append((loads.torques[body], _speed(gearbox, loads, body, where), _share(model, case, where)))
    torques, speeds, shares = np.array(rows).T
    return torques, speeds, shares / shares.sum()


def _speed(gearbox: Gearbox, loads: ImportedLoads, body: str, where: str) -> float:
    """Return the speed of the body, rad/s, from that of any body of the train."""
    for name, speed in loads.speeds.items():
        if name == body or name in gearbox.spinning:
            return gearbox.train.rolling_speeds(name, speed * RPM)[body]
    raise RexsError(f"{where}: no rotational_speed of a shaft")


def _share(model: Model, case: RexsLoadCase, where: str) -> float:
    """Return the time fraction in percent; both the old and the new name of the attribute are accepted."""
    for unit in model.components_of_type("gear_unit"):
        share = unit.with_attributes(case.changes.get(unit.number, {})).quantity("operating_time_fraction", "%")
        if share is not None and share >= 0.0:
            return share
    raise RexsError(f"{where}: no operating_time_fraction of the gear_unit")


HUB_CELLS = 8
"""Number of cells of each rotor load into which torque bins are split."""
SPECTRUM_HEADINGS = ("torque_N_m", "speed_rpm", "hours")
"""Headings of a table of counted loads from another program."""
HOURS_HEADINGS = ("file", "hours_per_year")
"""Headings of a table with hours of files."""
MOST_FILES = 20_000
"""Maximum number of files of one source."""
REXS_ENDINGS = (".rexs", ".rexsj", ".rexsz")
Progress = Callable[[int, int], None]
"""Called with the number of files read and the total."""


@dataclass(frozen=True, eq=False)
class LoadSource(ReprMixin):
    """Samples of one source over the life of the gearbox."""

    name: str
    kind: str
    case: str
    """Its key, ``fatigue`` or ``extreme``, and its label."""
    file: str
    """Name of its file, or the pattern of its files."""
    files: int
    count: int
    """Number of its files, and of samples in them."""
    digest: str
    """SHA-256 of the file, or of the names and hashes of all."""
    torque: Floats
    speed: Floats
    """(samples,) on the loaded body about +z, N m and rad/s; extreme torques include their partial factor. Many
    samples are reduced: see `exugear.life.load_spectrum.series`."""
    hours: Floats
    """(samples,) duration of each sample in the whole life; zero for extreme sources."""
    hub: Floats
    """(samples, 5) forces along x, y, z and moments about x, y on the loaded body, N and N m; (samples, 0) without
    rotor loads."""
    series: bool
    """Whether the samples are a time series."""
    skipped: float
    duration: float
    """Longest skipped time of a series, and total time used of all series, s; zero for tables."""
    factors: tuple[float, float]
    """Factors on torque and speed."""
    least: float
    largest: float
    """Torque, N m."""
    slowest: float
    fastest: float
    """Absolute speed under load, rad/s."""
    equivalent_ranges: Mapping[tuple[str, float], float]
    """(component, slope) damage-equivalent range at one cycle per second, N m or N; empty for tables."""
    remarks: tuple[str, ...] = ()

    def _line(self) -> str:
        return f" {self.name!r}: {self.kind}, {self.count} samples, {self.hours.sum():.6g} h"

    @property
    def hub_loads(self) -> Floats:
        """Rotor loads (samples, 5), with zeros if there are none."""
        return self.hub if self.hub.shape[1] else np.zeros((len(self.torque), HUB_LOADS))


LEAST_SHARE_BACKWARDS = 0.05
"""Time fraction of a series above which a positive torque at a negative speed is reported."""


def load_sources(gearbox: Gearbox, progress: Progress | None = None) -> tuple[LoadSource, ...]:
    """Read all sources of a gearbox file.

    Raises
    ------
    GearboxFileError
        No section [loads], a body that does not rotate, more hours than a year has, or an invalid file.
    """
    loads = section_of(gearbox)
    if loads.body not in gearbox.spinning:
        raise gearbox.error(f"loads.body = {loads.body!r}: does not rotate; bodies are {', '.join(gearbox.spinning)}")
    paths = {name: _paths(gearbox, f"loads.sources.{name}", source) for name, source in loads.sources.items()}
    total = sum(map(len, paths.values()))
    done = 0
    drafts = []
    for name, source in loads.sources.items():
        draft = _SourceDraft(gearbox, loads, name, source)
        draft.take_stated()
        for path in paths[name]:
            if progress is not None:
                progress(done, total)
            draft.take(path)
            done += 1
        drafts.append(draft)
    by_wind: dict[float, float] = {}
    for draft in drafts:
        for group, pool in draft.pools.items() if draft.section.wind is not None else ():
            by_wind[group] = by_wind.get(group, 0.0) + pool.seconds
    sources = tuple(draft.source(by_wind) for draft in drafts)
    yearly = sum(float(source.hours.sum()) for source in sources) / loads.life_years
    if yearly > HOURS_PER_YEAR * (1.0 + 1e-9):
        raise gearbox.error(f"loads.sources: {yearly:.6g} hours per year in total; a year has {HOURS_PER_YEAR:g}")
    is_output = loads.body == gearbox.case.overall.output
    return tuple(
        replace(source, remarks=(*source.remarks, *_torque_sign_warning(source, is_output))) for source in sources
    )


def section_of(gearbox: Gearbox) -> LoadsSection:
    """Return the section [loads] of a gearbox file.

    Raises
    ------
    GearboxFileError
        There is none.
    """
    if gearbox.case.loads is None:
        raise gearbox.error("loads: this section is missing; add [loads] with the loaded body and its loads")
    return gearbox.case.loads


def distribution(gearbox: Gearbox, sources: tuple[LoadSource, ...]) -> DurationDistribution:
    """Return the load duration distribution of all fatigue sources together."""
    worn = [source for source in sources if source.kind == "fatigue"]
    if not worn:
        raise gearbox.error("loads.sources: no source of kind 'fatigue'; set one, fatigue damage requires it")
    torque, speed, hours = (np.concatenate([getattr(one, key) for one in worn]) for key in ("torque", "speed", "hours"))
    if not np.any(torque * speed * hours):
        raise gearbox.error(
            "loads.sources: no fatigue source has torque, speed and hours at the same time; no fatigue damage can be "
            "computed"
        )
    largest = max(max(one.largest, -one.least) for one in worn)
    return load_duration(torque, speed, hours, section_of(gearbox).bins, largest)


def points_of(gearbox: Gearbox, sources: tuple[LoadSource, ...], found: DurationDistribution) -> LoadPoints:
    """Split the bins of the distribution where rotor loads differ."""
    worn = [source for source in sources if source.kind == "fatigue"]
    torque, speed, hours, hub = (
        np.concatenate([getattr(one, key) for one in worn]) for key in ("torque", "speed", "hours", "hub_loads")
    )
    return load_points(found, section_of(gearbox).bin_value, torque, speed, hours, hub, HUB_CELLS)


def _paths(gearbox: Gearbox, key: str, source: SourceSection) -> list[Path]:
    """Return the files of a source, all inside the folder of the gearbox file."""
    if source.hours is not None:
        return []
    if source.file is not None:
        path = gearbox.file(f"{key}.file", source.file, LARGEST_SERIES)
        if path.suffix.lower() not in (*SERIES_ENDINGS, *REXS_ENDINGS):
            known = ", ".join((*SERIES_ENDINGS, *REXS_ENDINGS))
            raise gearbox.error(f"{key}.file = {source.file!r}: load files end in {known}")
        return [path]
    folder = Path(gearbox.source).parent
    pattern = str(source.files)
    try:
        names = sorted(path.relative_to(folder).as_posix() for path in folder.glob(pattern) if path.is_file())
    except (ValueError, NotImplementedError, OSError) as error:
        raise gearbox.error(f"{key}.files = {pattern!r}: {error}") from None
    if not names:
        raise gearbox.error(f"{key}.files = {pattern!r}: no matching file in {folder}")
    if len(names) > MOST_FILES:
        raise gearbox.error(f"{key}.files = {pattern!r}: {len(names)} files; at most {MOST_FILES} are read")
    paths = [gearbox.file(f"{key}.files", name, LARGEST_SERIES) for name in names]
    other = next((name for name in names if Path(name).suffix.lower() not in SERIES_ENDINGS), None)
    if other is not None:
        raise gearbox.error(
            f"{key}.files = {pattern!r}: {other} does not end in one of {', '.join(SERIES_ENDINGS)}; specify the "
            "ending, such as *.outb"
        )
    return paths


class _SourceDraft:
    """Source during reading: samples in pools of equal weight."""

    def __init__(self, gearbox: Gearbox, loads: LoadsSection, name: str, source: SourceSection) -> None:
        self.gearbox, self.loads, self.name, self.section = gearbox, loads, name, source
        self.key = f"loads.sources.{name}"
        self.pools: dict[float, SamplePool] = {}
        self._reader = SeriesReader(gearbox, self.key, source, loads.body)
        self._digests: list[tuple[str, str]] = []
        self._table: Samples | None = None
        self._remarks: tuple[str, ...] = ()
        self._skipped = 0.0
        self._hours = self._stated_hours()

    def take_stated(self) -> None:
        """Take the operating points that the gearbox file states, if any."""
        section = self.section
        if section.torque_N_m is None or section.speed_rpm is None or section.hours is None:
            return
        points = np.array([section.torque_N_m, section.speed_rpm, section.hours])
        path = Path(self.gearbox.source)
        self._digests.append((path.name, hashlib.sha256(points.tobytes()).hexdigest()))
        try:
            self._table = self._scaled(path, points[0], points[1] * RPM, points[2])
        except LoadFileError as error:
            raise self.gearbox.error(f"{self.key}: {error}") from error
        self._check_table(path)

    def take(self, path: Path) -> None:
        """Read a file."""
        try:
            self._digests.append((path.name, file_digest(path)))
            self._table = self._counted(path)
            if self._table is None:
                self._take_series(path)
        except (FileError, LoadFileError, RexsError) as error:
            raise self.gearbox.error(f"{self.key}.{'file' if self.section.file else 'files'}: {error}") from error
        if self._table is not None:
            self._check_table(path)

    def _take_series(self, path: Path) -> None:
        section = self.section
        ways = (section.hours_per_year, section.events_per_year, section.hours_table, section.wind)
        if section.kind == "fatigue" and all(way is None for way in ways):
            raise self.gearbox.error(f"{self.key}.hours_per_year: this key is missing; a time series requires it")
        pool = SamplePool(self.section.kind == "extreme")
        taken = self._reader.take(path, pool)
        self._skipped = max(self._skipped, taken.skipped)
        group = 0.0
        if self._hours is not None:
            if path.name not in self._hours:
                raise self.gearbox.error(f"{self.key}.hours_table: has no line for {path.name}")
            group = self._hours[path.name]
        elif self.section.wind is not None and self.loads.wind is not None:
            group = bin_of_wind(self.loads.wind, taken.wind)
        pool.close(taken.counts, taken.duration)
        if group in self.pools:
            self.pools[group].merge(pool)
        else:
            self.pools[group] = pool

    def _stated_hours(self) -> dict[str, float] | None:
        """Return the hours per year of each file by its name, from a table."""
        if self.section.hours_table is None:
            return None
        key = f"{self.key}.hours_table"
        path = self.gearbox.file(key, self.section.hours_table, LARGEST_SERIES)
        try:
            lines = [line for line in first_lines(path, MOST_FILES + 1) if line.strip()]
        except LoadFileError as error:
            raise self.gearbox.error(f"{key}: {error}") from None
        rows = [tuple(cell.strip() for cell in row) for row in csv.reader(lines)]
        if not rows or rows[0] != HOURS_HEADINGS:
            raise self.gearbox.error(f"{key}: {path}: a table of hours begins with {','.join(HOURS_HEADINGS)}")
        found: dict[str, float] = {}
        for number, row in enumerate(rows[1:], start=2):
            try:
                hours = float(row[1]) if len(row) == len(HOURS_HEADINGS) else math.nan
            except ValueError:
                hours = math.nan
            if not 0.0 <= hours <= HOURS_PER_YEAR or row[0] in found:
                raise self.gearbox.error(
                    f"{key}: {path}: line {number} has {shortened(','.join(row), 80)}; required are a file, each "
                    f"once, and its hours per year from 0 to {HOURS_PER_YEAR:g}"
                )
            found[row[0]] = hours
        return found

    def _counted(self, path: Path) -> Samples | None:
        """Read a table of counted loads; None for a series."""
        if path.suffix.lower() in REXS_ENDINGS:
            torque, speed, shares = rexs_load_cases(self.gearbox, path, self.loads.body)
            return self._scaled(path, torque, speed, shares)
        if path.suffix.lower() != ".csv":
            return None
        headings = headings_of(path)
        if is_series(headings):
            return None
        if headings != SPECTRUM_HEADINGS:
            raise LoadFileError(
                f"{path}: headings {shortened(','.join(headings), 80)}; a series begins with time_s, a table of "
                f"counted loads has {','.join(SPECTRUM_HEADINGS)}"
            )
        values = table_rows(path, headings)
        bad = np.flatnonzero(~(np.isfinite(values).all(axis=1) & (values[:, 2] >= 0.0)))
        if bad.size:
            told = ",".join(f"{value:g}" for value in values[bad[0]])
            raise LoadFileError(
                f"{path}: line {bad[0] + 2} has {told}; three finite numbers are required, hours not negative"
            )
        if not values[:, 2].sum() > 0.0:
            raise LoadFileError(f"{path}: all hours are 0")
        return self._scaled(path, values[:, 0], values[:, 1] * RPM, values[:, 2])

    def _scaled(self, path: Path, torque: Floats, speed: Floats, hours: Floats) -> Samples:
        section = self.section
        found = torque * section.torque_factor * (section.partial_factor or 1.0)
        turning = speed * section.speed_factor
        for values, largest, unit in ((found, LARGEST_TORQUE, "N m"), (turning / RPM, LARGEST_SPEED, "rpm")):
            bad = np.flatnonzero(np.abs(values) > largest)
            if bad.size:
                raise LoadFileError(
                    f"{path}: row {bad[0] + 1} has {values[bad[0]]:.3g} {unit}; plausible are up to {largest:g} {unit}"
                    "; check its unit, torque_factor and speed_factor"
                )
        return Samples(found, turning, hours, np.zeros((len(found), 0)))

    def _check_table(self, path: Path) -> None:
        for superfluous in ("skip_s", "torque", "speed", "events_per_year", "wind", "hub_forces", "hub_moments"):
            if getattr(self.section, superfluous) is not None:
                raise self.gearbox.error(
                    f"{self.key}.{superfluous}: not applicable to a table of loads; remove the key"
                )
        if self.section.files is not None:
            raise self.gearbox.error(f"{self.key}.files: {path.name} is a table of counted loads; use the key file")

    def source(self, by_wind: Mapping[float, float]) -> LoadSource:
        """Return the source with all samples in hours of the life."""
        samples = self._table_in_hours() if self._table is not None else self._series_in_hours(by_wind)
        pools = [*self.pools.values()]
        section = self.section
        loaded = np.abs(samples.speed[samples.torque != 0.0])
        if section.files is None and section.hours_table is None:
            digest = self._digests[0][1]
        else:
            content = repr((sorted(self._digests), sorted((self._hours or {}).items())))
            digest = hashlib.sha256(content.encode()).hexdigest()
        return LoadSource(
            name=self.name,
            kind=section.kind,
            case=section.case,
            file=str(section.files or self._digests[0][0]),
            files=len(self._digests),
            count=sum(pool.count for pool in pools) or len(samples),
            digest=digest,
            torque=samples.torque,
            speed=samples.speed,
            hours=samples.lasting,
            hub=samples.hub,
            series=self._table is None,
            skipped=self._skipped,
            duration=sum(pool.seconds for pool in pools),
            factors=(section.torque_factor, section.speed_factor),
            least=min((pool.least for pool in pools), default=float(samples.torque.min())),
            largest=max((pool.largest for pool in pools), default=float(samples.torque.max())),
            slowest=min((pool.slowest for pool in pools), default=float(loaded.min(initial=math.inf))),
            fastest=max((pool.fastest for pool in pools), default=float(loaded.max(initial=0.0))),
            equivalent_ranges=self._ranges(by_wind),
            remarks=self._remarks,
        )

    def _table_in_hours(self) -> Samples:
        """Return the table's durations in hours of the life, or as fractions of the hours stated for the source."""
        table = self._table
        assert table is not None
        hours = table.lasting
        if self.section.hours_per_year is not None:
            found = self.section.hours_per_year * self.loads.life_years
            total = float(hours.sum())
            if abs(total - found) > 1e-3 * found:
                self._remarks = (
                    f"{self.name}: hours of {self._digests[0][0]}, {total:.6g} in total, are used as fractions of the "
                    f"{found:.6g} h that result from hours_per_year",
                )
            hours = hours / total * found
        elif self.section.kind == "extreme":
            hours = np.zeros(len(hours))
        return Samples(table.torque, table.speed, hours, table.hub)

    def _series_in_hours(self, by_wind: Mapping[float, float]) -> Samples:
        parts = []
        for group, pool in self.pools.items():
            samples = pool.samples()
            total = float(samples.lasting.sum())
            hours = self._hours_of(group, pool, by_wind) * self.loads.life_years
            lasting = samples.lasting * (hours / total) if total else np.zeros(len(samples))
            parts.append(Samples(samples.torque, samples.speed, lasting, samples.hub))
        return together(parts)

    def _hours_of(self, group: float, pool: SamplePool, by_wind: Mapping[float, float]) -> float:
        """Return the hours of a pool per year."""
        section = self.section
        if section.kind == "extreme":
            return 0.0
        if section.wind is not None and self.loads.wind is not None:
            return hours_of_bins(self.loads.wind, [group])[0] * pool.seconds / by_wind[group]
        if self._hours is not None:
            return group * pool.files
        if section.events_per_year is not None:
            return section.events_per_year * pool.seconds / 3600.0
        return (section.hours_per_year or 0.0) * pool.seconds / sum(pool.seconds for pool in self.pools.values())

    def _ranges(self, by_wind: Mapping[float, float]) -> dict[tuple[str, float], float]:
        """Return the equivalent ranges of all pools, weighted by their hours."""
        weights = {group: self._hours_of(group, pool, by_wind) for group, pool in self.pools.items()}
        total = sum(weights.values())
        found: dict[tuple[str, float], float] = {}
        for group, pool in self.pools.items() if total else ():
            for key, value in pool.equivalent_ranges().items():
                found[key] = found.get(key, 0.0) + weights[group] / total * value ** key[1]
        return {key: value ** (1.0 / key[1]) for key, value in found.items()}


def describe_sources(sources: tuple[LoadSource, ...]) -> Iterator[str]:
    """Describe skipped times and scale factors."""
    for source in sources:
        if source.skipped:
            each = " each" if source.files > 1 else ""
            yield f"{source.name}: the first {source.skipped:.4g} s of {source.file} are skipped{each}"
        torque, speed = source.factors
        if (torque, speed) != (1.0, 1.0):
            yield f"{source.name}: torque times {torque:g}, speed times {speed:g}, not as in {source.file}"
        yield from source.remarks


def _torque_sign_warning(source: LoadSource, is_output: bool) -> Iterator[str]:
    """Warn of torques that oppose the speed of a driving body, most often because of a wrong sign of one channel.

    Braking and coasting give some such samples; a negative speed under a positive torque is rarely intended. At the
    output, torque and speed usually have opposite signs.
    """
    if is_output:
        return
    reversed_power = source.torque * source.speed < 0.0
    weights = source.hours + (source.hours.sum() == 0.0)  # for an extreme source, samples have equal weight
    share = float(np.average(reversed_power, weights=weights))
    backwards = float(np.average(reversed_power & (source.speed < 0.0), weights=weights))
    if backwards > (LEAST_SHARE_BACKWARDS if source.series else 0.0) or share > 0.5:
        signs = ("a negative torque at a positive speed", "a positive torque at a negative speed")[backwards > 0.0]
        hours = f"{100.0 * (backwards or share):.3g} % of its hours"
        yield (
            f"Warning: {source.name}: {source.file} has {signs} for {hours}, so power flows back from the loaded "
            "body; check the signs of both columns (torque_factor = -1 or speed_factor = -1 inverts one)"
        )
