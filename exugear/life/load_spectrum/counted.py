"""The loads of a gearbox counted: by source, by bin, and as cycles of what turns through them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import RPM
from exugear.life.counting.duration import DurationDistribution, LoadPoints, equivalent_load
from exugear.life.load_spectrum.exposure import (
    FLANKS,
    ToothExposure,
    bearing_turns,
    distinct,
    tooth_exposures,
)
from exugear.life.load_spectrum.pools import COMPONENTS, RANGE_EXPONENTS
from exugear.life.load_spectrum.sources import (
    LoadSource,
    Progress,
    distribution,
    load_sources,
    points_of,
    section_of,
    told,
)
from fe_ste.tools.display import Displayed

EXPONENTS = (3.0, 10.0 / 3.0, 6.61, 8.74)
"""Slopes of the S-N curves of steel structures, of roller bearings, and of contact and bending of gears over torque."""


@dataclass(frozen=True, eq=False)
class CountedLoads(Displayed, line=" on {body!r}: {sources!n} sources, {distribution!r}"):
    """Loads of a gearbox, counted."""

    body: str
    """Body that they act on."""
    life_years: float
    sources: tuple[LoadSource, ...]
    distribution: DurationDistribution
    """Of all sources of fatigue."""
    points: LoadPoints
    """Its bins, split where loads of a hub differ."""
    equivalent_ranges: Mapping[str, Mapping[float, float]]
    """Damage-equivalent range of one cycle a second in the life, by component (torque, forces and moments of a hub)
    and slope, N m or N; none without series."""
    teeth: tuple[ToothExposure, ...]
    bearings: Mapping[str, float]
    """Revolutions of bearings per revolution of the body."""
    mesh_forces: Mapping[str, float]
    """Static force F_bt of mesh families at 1 N m on the body, N, the largest of a family."""
    bin_value: str

    @property
    def remarks(self) -> tuple[str, ...]:
        """What was skipped and scaled, a line each."""
        return tuple(told(self.sources))

    def equivalents(self) -> dict[float, float]:
        """Constant torque that does the same damage in the same revolutions, by slope, N m, of either sign."""
        found = self.distribution
        torques = found.torques(self.bin_value)
        return {m: equivalent_load(torques, found.revolutions, m) for m in EXPONENTS}

    def source_rows(self) -> list[dict[str, Any]]:
        """Figures of each source."""
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
        """Cycles of teeth by gear and flank, revolutions of bearings, and what meshes carry at the largest torque."""
        found = self.distribution
        rows = []
        for sense in (1, -1):
            own = np.sign(found.torque) == sense
            turns = float(found.revolutions[own].sum())
            largest = float(np.abs(found.torque[own]).max(initial=0.0))
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
        """Figures for programs: units in the keys."""
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


def count_loads(gearbox: Gearbox, progress: Progress | None = None) -> CountedLoads:
    """Read and count the loads of a gearbox file.

    Parameters
    ----------
    progress : called with the number of files that are read, and of all

    Raises
    ------
    CaseError
        A source that cannot be used: see `exugear.life.load_spectrum.sources.load_sources`.
    """
    loads = section_of(gearbox)
    sources = load_sources(gearbox, progress)
    found = distribution(gearbox, sources)
    teeth = tooth_exposures(gearbox, loads.body)
    forces = gearbox.train.static_mesh_forces({loads.body: 1.0})
    families: dict[str, float] = {}
    for mesh in gearbox.meshes:
        families[mesh.family] = max(families.get(mesh.family, 0.0), abs(forces[mesh.name]))
    return CountedLoads(
        body=loads.body,
        life_years=loads.life_years,
        sources=sources,
        distribution=found,
        points=points_of(gearbox, sources, found),
        equivalent_ranges=_equivalent_ranges(sources),
        teeth=teeth,
        bearings=bearing_turns(gearbox, loads.body),
        mesh_forces=families,
        bin_value=loads.bin_value,
    )


def _weights(source: LoadSource) -> Any:
    if source.hours.sum() > 0.0:
        return source.hours
    return None


def _equivalent_ranges(sources: tuple[LoadSource, ...]) -> dict[str, dict[float, float]]:
    """Damage-equivalent range of each component of all series of fatigue together, one cycle a second."""
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
    return ranges
