"""Load duration distributions as tables with commas, for other programs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from exugear.gearbox.parts import RPM
from exugear.life.load_spectrum.counted import CountedLoads
from exugear.life.load_spectrum.exposure import distinct
from fe_ste.tools.files import write_file


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
            own = distribution.torque * sense > 0.0
            if not own.any():
                continue
            forces = abs(distribution.torques(counted.bin_value)[own]) * counted.mesh_forces[tooth.family]
            side = "plus" if sense * tooth.flank > 0 else "minus"
            lines = zip(forces, distribution.hours[own], distribution.revolutions[own] * tooth.cycles, strict=True)
            path = folder / f"{tooth.gear}_{tooth.family}_{side}.csv"
            paths.append(write_table(path, ("mesh_force_N", "hours", "cycles"), lines))
    return paths


def write_table(path: Path, headings: Sequence[str], rows: Iterable[Sequence[float | str]]) -> Path:
    """Write a table with commas, whole or not at all; numbers to nine digits."""
    lines = [",".join(headings)]
    lines += [",".join(cell if isinstance(cell, str) else f"{cell:.9g}" for cell in row) for row in rows]
    write_file(path, ("\n".join(lines) + "\n").encode())
    return path
