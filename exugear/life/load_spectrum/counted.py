"""Counted loads of a gearbox: by source, by bin, and as load cycles of rotating parts.

Load cycles follow from the kinematics of the gear train alone. The flanks of a gear are distinguished: flank ``+``
faces the sense of +z rotation.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM
from exugear.life.load_spectrum.counting import DurationDistribution, LoadPoints, equivalent_load
from exugear.life.load_spectrum.series import COMPONENTS, RANGE_EXPONENTS
from exugear.life.load_spectrum.sources import (
    LoadSource,
    Progress,
    describe_sources,
    distribution,
    load_sources,
    points_of,
    section_of,
)
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.drawing import COLOURS, drawing_style, finish_figure, new_figure
from fe_ste.tools.files import write_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Load cycles of teeth and revolutions of bearings per revolution of a body

FLANKS = {1: "+", -1: "-"}


@dataclass(frozen=True)
class ToothExposure:
    """Load cycles of one tooth of a gear in one family of meshes."""

    gear: str
    family: str
    holder: str
    """Gear, the family of its meshes, and the body of the gear: one of equal planets."""
    member: int
    """{0, 1}: index of the gear in the pair (gear 1, gear 2)."""
    flank: int
    """Loaded flank for a positive torque on the loaded body: +1 or -1; a negative torque loads the other."""
    meshes: tuple[int, ...]
    """Indices of the meshes that one tooth passes in succession."""
    cycles: float
    """Contacts of one flank per revolution of the loaded body, summed over these meshes."""


def tooth_exposures(gearbox: Gearbox, body: str) -> tuple[ToothExposure, ...]:
    """Return the load cycles of the teeth of all gears per revolution of a body; equal planets are separate entries.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [round(one.cycles, 4) for one in tooth_exposures(gearbox, "carrier") if one.gear == "sun"]
    [14.1429]
    """
    spins = gearbox.train.rolling_speeds(body, 1.0)
    if body in gearbox.case.static_load.locked:
        held = ", ".join(gearbox.case.static_load.locked)
        raise gearbox.error(f"loads.body = {body!r}: static_load.locked locks {held}; set the body at the other end")
    forces = gearbox.train.static_mesh_forces({body: 1.0})
    exposures: dict[tuple[str, str, str], ToothExposure] = {}
    for mesh in gearbox.meshes:
        for member, holder in enumerate((mesh.pinion, mesh.gear)):
            gear = (mesh.pair.pinion, mesh.pair.gear)[member]
            if (gear.name, mesh.family, holder) in exposures:
                continue
            passed = tuple(
                number
                for number, other in enumerate(gearbox.meshes)
                if other.family == mesh.family and (other.pinion, other.gear)[member] == holder
            )
            opposite = member == 1 and gear.internal
            sign = 1 if forces[mesh.name] >= 0.0 else -1
            exposures[gear.name, mesh.family, holder] = ToothExposure(
                gear=gear.name,
                family=mesh.family,
                holder=holder,
                member=member,
                flank=-sign if opposite else sign,
                meshes=passed,
                cycles=len(passed) * abs(spins.get(holder, 0.0) - spins.get(mesh.frame, 0.0)),
            )
    return tuple(exposures.values())


def distinct(teeth: Iterable[ToothExposure]) -> tuple[ToothExposure, ...]:
    """Return one entry for equal planets: each gear in each family once."""
    found: dict[tuple[str, str], ToothExposure] = {}
    for tooth in teeth:
        found.setdefault((tooth.gear, tooth.family), tooth)
    return tuple(found.values())


def bearing_turns(gearbox: Gearbox, body: str) -> dict[str, float]:
    """Return the absolute relative revolutions of the rings of each bearing per revolution of a body.

    Examples
    --------
    Per revolution of the carrier, a planet rotates on its pin by the tooth number ratio of ring and planet:

    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> round(bearing_turns(gearbox, "carrier")["pl_a_1"], 6), round(99 / 39, 6)
    (2.538462, 2.538462)
    """
    spins = gearbox.train.rolling_speeds(body, 1.0)
    return {
        bearing.name: abs(spins.get(bearing.body, 0.0) - spins.get(bearing.on, 0.0)) for bearing in gearbox.bearings
    }


EXPONENTS = (3.0, 10.0 / 3.0, 6.61, 8.74)
"""Slopes of S-N curves: steel structures, roller bearings, contact and bending of gears, all over torque."""


@dataclass(frozen=True, eq=False)
class CountedLoads(ReprMixin, line=" on {body!r}: {sources!n} sources, {distribution!r}"):
    """Counted loads of a gearbox."""

    body: str
    life_years: float
    sources: tuple[LoadSource, ...]
    distribution: DurationDistribution
    """Load duration distribution of all fatigue sources."""
    points: LoadPoints
    """Bins of the distribution, split where rotor loads differ."""
    equivalent_ranges: Mapping[str, Mapping[float, float]]
    """Damage-equivalent range at one cycle per second over the life, by component (torque, rotor loads) and
    slope, N m or N; empty without series."""
    teeth: tuple[ToothExposure, ...]
    bearings: Mapping[str, float]
    """Revolutions of bearings per revolution of the body."""
    mesh_forces: Mapping[str, float]
    """Static force F_bt of mesh families at 1 N m on the body, N; the largest of each family."""
    bin_value: str

    @property
    def remarks(self) -> tuple[str, ...]:
        """Skipped times and scale factors, one line each."""
        return tuple(describe_sources(self.sources))

    def equivalents(self) -> dict[float, float]:
        """Constant torque with the same damage in the same number of revolutions, by slope, N m, for both signs."""
        found = self.distribution
        torques = found.torques(self.bin_value)
        return {m: equivalent_load(torques, found.revolutions, m) for m in EXPONENTS}

    def source_rows(self) -> list[dict[str, Any]]:
        """Return the values of each source."""
        return [
            {
                "source": source.name,
                "case": source.case,
                "kind": source.kind,
                "file": source.file,
                "files": source.files,
                "sha256": source.digest,
                "samples": source.count,
                "skipped_s": source.skipped,
                "hours": float(source.hours.sum()),
                "torque_factor": source.factors[0],
                "speed_factor": source.factors[1],
                "mean_torque_kN_m": 1e-3 * float(np.average(source.torque, weights=_weights(source))),
                "least_torque_kN_m": 1e-3 * source.least,
                "largest_torque_kN_m": 1e-3 * source.largest,
                "mean_speed_rpm": float(np.average(source.speed, weights=_weights(source))) / RPM,
            }
            for source in self.sources
        ]

    def part_rows(self) -> list[dict[str, Any]]:
        """Return load cycles of teeth by gear and flank, revolutions of bearings, and largest mesh forces."""
        found = self.distribution
        rows = []
        for sense in (1, -1):
            same_sense = np.sign(found.torque) == sense
            turns = float(found.revolutions[same_sense].sum())
            largest = float(np.abs(found.torque[same_sense]).max(initial=0.0))
            for tooth in distinct(self.teeth) if turns else ():
                rows.append(
                    {
                        "part": f"{tooth.gear}, flank {FLANKS[sense * tooth.flank]}",
                        "loaded_by": tooth.family,
                        "cycles": turns * tooth.cycles,
                        "force_kN": 1e-3 * largest * self.mesh_forces[tooth.family],
                    }
                )
        for name, ratio in self.bearings.items():
            if ratio:
                cycles = float(found.revolutions.sum()) * ratio
                rows.append({"part": name, "loaded_by": "", "cycles": cycles, "force_kN": math.nan})
        return rows

    def _ranges(self, component: str) -> dict[str, float]:
        return {f"{m:.4g}": 1e-3 * value for m, value in self.equivalent_ranges.get(component, {}).items()}

    def summary(self) -> dict[str, Any]:
        """Return the values for JSON, with units in the keys."""
        return {
            "body": self.body,
            "life_years": self.life_years,
            "hours": float(self.distribution.hours.sum()),
            "revolutions": float(self.distribution.revolutions.sum()),
            "equivalent_torque_kN_m": {f"{m:.4g}": 1e-3 * value for m, value in self.equivalents().items()},
            "equivalent_range_1_Hz_kN_m": self._ranges("torque"),
            "hub_equivalent_range_1_Hz": {
                f"{name}_{'kN' if name.startswith('force') else 'kN_m'}": self._ranges(name)
                for name in self.equivalent_ranges
                if name != "torque"
            },
            "sources": self.source_rows(),
            "parts": [
                {key: value for key, value in row.items() if value == value and value != ""} for row in self.part_rows()
            ],
            "remarks": list(self.remarks),
        }


def forces_of_families(gearbox: Gearbox, body: str) -> dict[str, float]:
    """Return the static force F_bt of mesh families at 1 N m on a body, N; the largest of each family."""
    forces = gearbox.train.static_mesh_forces({body: 1.0})
    families: dict[str, float] = {}
    for mesh in gearbox.meshes:
        families[mesh.family] = max(families.get(mesh.family, 0.0), abs(forces[mesh.name]))
    return families


def count_loads(gearbox: Gearbox, progress: Progress | None = None) -> CountedLoads:
    """Read and count the loads of a gearbox file.

    Raises
    ------
    GearboxFileError
        An invalid source: see `exugear.life.load_spectrum.sources.load_sources`.
    """
    loads = section_of(gearbox)
    sources = load_sources(gearbox, progress)
    found = distribution(gearbox, sources)
    teeth = tooth_exposures(gearbox, loads.body)
    series = [source for source in sources if source.series and source.kind == "fatigue" and source.hours.sum() > 0.0]
    hours = np.array([float(history.hours.sum()) for history in series])
    ranges: dict[str, dict[float, float]] = {}
    for name in COMPONENTS:
        if any((name, RANGE_EXPONENTS[0]) in history.equivalent_ranges for history in series):
            ranges[name] = {
                m: equivalent_load(
                    np.array([history.equivalent_ranges.get((name, m), 0.0) for history in series]), hours, m
                )
                for m in RANGE_EXPONENTS
            }
    return CountedLoads(
        body=loads.body,
        life_years=loads.life_years,
        sources=sources,
        distribution=found,
        points=points_of(gearbox, sources, found),
        equivalent_ranges=ranges,
        teeth=teeth,
        bearings=bearing_turns(gearbox, loads.body),
        mesh_forces=forces_of_families(gearbox, loads.body),
        bin_value=loads.bin_value,
    )


def _weights(source: LoadSource) -> Any:
    return source.hours if source.hours.sum() > 0.0 else None


# Load duration distributions as CSV tables for other programs


def write_spectra(counted: CountedLoads, folder: Path) -> list[Path]:
    """Write the distribution of the body, and one for each gear and flank; return the paths."""
    distribution = counted.distribution
    rows = zip(
        distribution.lower,
        distribution.upper,
        distribution.torque,
        distribution.speed / RPM,
        distribution.hours,
        distribution.revolutions,
        strict=True,
    )
    headings = ("lower_N_m", "upper_N_m", "torque_N_m", "speed_rpm", "hours", "revolutions")
    paths = [write_table(folder / f"{counted.body}.csv", headings, rows)]
    for tooth in distinct(counted.teeth):
        for sense in (1, -1):
            same_sense = distribution.torque * sense > 0.0
            if not same_sense.any():
                continue
            forces = abs(distribution.torques(counted.bin_value)[same_sense]) * counted.mesh_forces[tooth.family]
            side = "plus" if sense * tooth.flank > 0 else "minus"
            lines = zip(
                forces, distribution.hours[same_sense], distribution.revolutions[same_sense] * tooth.cycles, strict=True
            )
            path = folder / f"{tooth.gear}_{tooth.family}_{side}.csv"
            paths.append(write_table(path, ("mesh_force_N", "hours", "cycles"), lines))
    return paths


# Diagrams of load duration distributions


def draw_duration(distribution: DurationDistribution, body: str, path: str | Path | None = None) -> Figure:
    """Draw the load duration distribution of a body: hours in each bin, and hours above each torque."""
    with drawing_style():
        figure = new_figure(7.0, 3.2)
        bars, above = figure.subplots(1, 2)
        width = 1e-3 * np.abs(distribution.upper - distribution.lower)
        middle = 0.5e-3 * (distribution.lower + distribution.upper)
        bars.bar(middle, distribution.hours, width=width, color=COLOURS[0])
        bars.set(xlabel=f"torque on {body} / kN m", ylabel="hours in the life", title="time at each torque")
        for sign, colour, name in ((1.0, COLOURS[0], "positive"), (-1.0, COLOURS[1], "negative")):
            same_sense = distribution.torque * sign > 0.0
            if same_sense.any():
                order = np.argsort(-np.abs(distribution.torque[same_sense]))
                lasting = np.cumsum(distribution.hours[same_sense][order])
                above.step(
                    lasting,
                    1e-3 * np.abs(distribution.torque[same_sense][order]),
                    where="pre",
                    color=colour,
                    label=name,
                )
        above.set(xlabel="hours with at least this torque", ylabel="torque magnitude / kN m", xscale="log")
        above.xaxis.set_major_formatter("{x:g}")
        above.set_title("duration")
        above.legend()
        return finish_figure(figure, path)
