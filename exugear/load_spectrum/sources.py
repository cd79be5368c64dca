"""Sources of loads of a gearbox file: samples of torque, speed and time over its life, and the hash of each file."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exugear.counting.duration import DurationDistribution, LoadPoints, load_duration, load_points
from exugear.load_files.channels import Channels, LoadFileError
from exugear.load_files.reading import LARGEST_SERIES, SERIES_ENDINGS, decoded, file_content, read_channels
from exugear.load_files.tables import read_headed
from exugear.load_spectrum.rexs_load_cases import rexs_load_cases
from exugear.model.gearbox import Gearbox
from exugear.model.parts import RPM
from exugear.model.sections.loads import LoadsSection, SourceSection
from exugear.rexs.faults import RexsError
from fe_ste.tools.arrays import Booleans, Floats

HOURS_PER_YEAR = 8766.0
HUB_LOADS = 5
"""Loads of a hub beside its torque: force along x, y, z, moment about x and y."""
HUB_CELLS = 8
"""Cells of each load of a hub into which the bins of torque are split."""
SPECTRUM_HEADINGS = ("torque_N_m", "speed_rpm", "hours")
"""Headings of a table of loads that were counted elsewhere; of its hours the shares count."""
LARGEST_TORQUE = 1e9
"""N m: no gearbox sees more, and damages beyond are no numbers."""
REXS_ENDINGS = (".rexs", ".rexsj", ".rexsz")


@dataclass(frozen=True, eq=False)
class LoadSource:
    """Samples of one source over the life of the gearbox.

    Attributes
    ----------
    name, kind, case : str
        Its key, ``fatigue`` or ``extreme``, and its label.
    path : Path
    digest : str
        SHA-256 of the file.
    torque, speed : array (samples,)
        On the loaded body about +z, N m and rad/s; an extreme torque with its partial factor.
    hours : array (samples,)
        Of each sample in the whole of the life; zero for extreme sources.
    hub : array (samples, 5)
        Force along x, y, z and moment about x, y on the loaded body, N and N m; zero where the source has none.
    series : bool
        Whether the samples follow each other in time.
    skipped, duration : float
        Time of the series that was left out, and that was taken, s; zero for tables.
    factors : (float, float)
        On torque and speed.
    """

    name: str
    kind: str
    case: str
    path: Path
    digest: str
    torque: Floats
    speed: Floats
    hours: Floats
    hub: Floats
    series: bool
    skipped: float
    duration: float
    factors: tuple[float, float]

    def __repr__(self) -> str:
        """Return one short line."""
        return f"<LoadSource {self.name!r}: {self.kind}, {len(self.torque)} samples, {self.hours.sum():.6g} h>"


def load_sources(gearbox: Gearbox) -> tuple[LoadSource, ...]:
    """Read all sources of a gearbox file.

    Raises
    ------
    CaseError
        No section [loads], a body that does not turn, more hours than a year has, or a file that cannot be used.
    """
    loads = section_of(gearbox)
    if loads.body not in gearbox.spinning:
        raise gearbox.fault(f"loads.body = {loads.body!r} does not turn; bodies are {', '.join(gearbox.spinning)}")
    sources = tuple(_read(gearbox, name, source) for name, source in loads.sources.items())
    yearly = sum(float(source.hours.sum()) for source in sources) / loads.life_years
    if yearly > HOURS_PER_YEAR * (1.0 + 1e-9):
        raise gearbox.fault(f"loads.sources: {yearly:.6g} hours a year in all; a year has {HOURS_PER_YEAR:g}")
    return sources


def section_of(gearbox: Gearbox) -> LoadsSection:
    """Section [loads] of a gearbox file.

    Raises
    ------
    CaseError
        There is none.
    """
    if gearbox.case.loads is None:
        raise gearbox.fault("loads: this section is missing; [loads] names the body and the files of its loads")
    return gearbox.case.loads


def distribution(gearbox: Gearbox, sources: tuple[LoadSource, ...]) -> DurationDistribution:
    """Load duration distribution of all sources of fatigue together."""
    worn = [source for source in sources if source.kind == "fatigue"]
    if not worn:
        raise gearbox.fault("loads.sources: none is of kind 'fatigue'; without one no part wears")
    torque, speed, hours = (np.concatenate([getattr(one, key) for one in worn]) for key in ("torque", "speed", "hours"))
    if not np.any(torque * speed * hours):
        raise gearbox.fault("loads.sources: no source of fatigue has torque, speed and hours at once: no part wears")
    return load_duration(torque, speed, hours, section_of(gearbox).bins)


def points_of(gearbox: Gearbox, sources: tuple[LoadSource, ...], found: DurationDistribution) -> LoadPoints:
    """Split the bins of the distribution where loads of a hub differ."""
    worn = [source for source in sources if source.kind == "fatigue"]
    torque, speed, hours, hub = (
        np.concatenate([getattr(one, key) for one in worn]) for key in ("torque", "speed", "hours", "hub")
    )
    return load_points(found, section_of(gearbox).bin_value, torque, speed, hours, hub, HUB_CELLS)


def _read(gearbox: Gearbox, name: str, source: SourceSection) -> LoadSource:
    key, loads = f"loads.sources.{name}", section_of(gearbox)
    path = gearbox.file(f"{key}.file", source.file, LARGEST_SERIES)
    ending = path.suffix.lower()
    if ending not in (*SERIES_ENDINGS, *REXS_ENDINGS):
        known = ", ".join((*SERIES_ENDINGS, *REXS_ENDINGS))
        raise gearbox.fault(f"{key}.file = {source.file!r}: files of loads end in {known}")
    skipped = duration = 0.0
    hub = None
    try:
        table = _table(gearbox, path, loads.body)
        if table is None:
            series = read_channels(path)
            kept = _kept(gearbox, key, source, series)
            torque, speed, shares, skipped, duration = _samples(gearbox, key, source, series, loads.body, kept)
            hub = _hub(source, series)[kept] * (source.partial_factor or 1.0)
        else:
            torque, speed, shares = table
    except (LoadFileError, RexsError) as error:
        raise gearbox.fault(f"{key}.file: {error}") from error
    if table is not None:
        for superfluous in ("skip_s", "torque", "speed", "events_per_year", "hub_forces", "hub_moments"):
            if getattr(source, superfluous) is not None:
                raise gearbox.fault(f"{key}.{superfluous}: makes no sense for a table of loads; leave it out")
    yearly = source.hours_per_year or 0.0
    if source.events_per_year is not None:
        yearly = source.events_per_year * duration / 3600.0
    torque = torque * source.torque_factor * (source.partial_factor or 1.0)
    if np.abs(torque).max() > LARGEST_TORQUE:
        raise gearbox.fault(
            f"{key}: its largest torque is {np.abs(torque).max():.3g} N m; up to {LARGEST_TORQUE:g} N m can be meant; "
            "look at its unit and at torque_factor"
        )
    return LoadSource(
        name=name,
        kind=source.kind,
        case=source.case,
        path=path,
        digest=hashlib.sha256(file_content(path)).hexdigest(),
        torque=torque,
        speed=speed * source.speed_factor,
        hours=shares * yearly * loads.life_years,
        hub=np.zeros((len(torque), HUB_LOADS)) if hub is None else hub,
        series=table is None,
        skipped=skipped,
        duration=duration,
        factors=(source.torque_factor, source.speed_factor),
    )


def _table(gearbox: Gearbox, path: Path, body: str) -> tuple[Floats, Floats, Floats] | None:
    """Torques (N m), speeds (rad/s) and shares of a table of loads; None for a series."""
    if path.suffix.lower() in REXS_ENDINGS:
        return rexs_load_cases(gearbox, path, body)
    if path.suffix.lower() != ".csv":
        return None
    text = decoded(file_content(path))
    if text.lstrip().startswith("time_s"):
        return None
    headings, values = read_headed(path, text)
    if headings != SPECTRUM_HEADINGS:
        raise LoadFileError(
            f"{path}: headings {','.join(headings)[:80]}; a series begins with time_s, a table of counted loads has "
            f"{','.join(SPECTRUM_HEADINGS)}"
        )
    bad = np.flatnonzero(~(np.isfinite(values).all(axis=1) & (values[:, 2] >= 0.0)))
    if bad.size:
        told = ",".join(f"{value:g}" for value in values[bad[0]])
        raise LoadFileError(f"{path}: line {bad[0] + 2} has {told}; needs three finite numbers, hours not negative")
    if not values[:, 2].sum() > 0.0:
        raise LoadFileError(f"{path}: all hours are 0; they are the shares of the time of each line")
    return values[:, 0], values[:, 1] * RPM, values[:, 2] / values[:, 2].sum()


def _hub(source: SourceSection, series: Channels) -> Floats:
    """Read forces and moments of the hub (steps, 5), N and N m, zero where the source names no channels."""
    forces = source.hub_forces or (None,) * 3
    moments = source.hub_moments or (None,) * 2
    wanted = [(name, "force") for name in forces] + [(name, "torque") for name in moments]
    columns = [
        np.zeros(len(series.time))
        if name is None
        else (-1.0 if name.startswith("-") else 1.0) * series.channel(name.removeprefix("-"), quantity)
        for name, quantity in wanted
    ]
    return source.hub_factor * np.array(columns).T


def _kept(gearbox: Gearbox, key: str, source: SourceSection, series: Channels) -> Booleans:
    """Tell which steps of a series are taken: those behind the time that is skipped."""
    if source.skip_s is None:
        raise gearbox.fault(
            f"{key}.skip_s: this key is missing; say how much of the beginning is left out, 0 for nothing"
        )
    kept: Booleans = np.asarray(series.time >= series.time[0] + source.skip_s)
    if np.count_nonzero(kept) < 2:
        length = series.time[-1] - series.time[0]
        raise gearbox.fault(f"{key}.skip_s = {source.skip_s:g}: leaves nothing of a series of {length:g} s")
    return kept


def _samples(
    gearbox: Gearbox, key: str, source: SourceSection, series: Channels, body: str, kept: Booleans
) -> tuple[Floats, Floats, Floats, float, float]:
    """Torques, speeds and shares of the samples of a series, and the time that was left out and taken."""
    own = {"torque": f"{body}_N_m", "speed": f"{body}_rpm"} if series.path.suffix.lower() == ".csv" else {}
    named = {"torque": source.torque or own.get("torque"), "speed": source.speed or own.get("speed")}
    for quantity, channel in named.items():
        if channel is None:
            shown = ", ".join(series.names[:8])
            raise gearbox.fault(f"{key}.{quantity}: this key is missing; name a channel of the file, such as {shown}")
    torque, speed = (series.channel(str(named[quantity]), quantity)[kept] for quantity in ("torque", "speed"))
    lasting = np.gradient(series.time[kept])
    duration = float(series.time[-1] - series.time[kept][0])
    return torque, speed, lasting / lasting.sum(), float(series.time[kept][0] - series.time[0]), duration


def told(sources: tuple[LoadSource, ...]) -> Iterator[str]:
    """Say in words what was left out and scaled."""
    for source in sources:
        if source.skipped:
            yield f"{source.name}: the first {source.skipped:.4g} s of {source.path.name} are skipped"
        torque, speed = source.factors
        if (torque, speed) != (1.0, 1.0):
            yield f"{source.name}: torque times {torque:g}, speed times {speed:g}, not as in {source.path.name}"
