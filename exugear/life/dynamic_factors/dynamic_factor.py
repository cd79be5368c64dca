"""The dynamic factor K_v of meshes over speed: as stated, or from the forces of a run.

In a run it is the largest over the mean force of a mesh within a few mesh cycles. Longer windows would count what the
carrier's turn does to load sharing, and what the load itself does, which the static balance has.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import RPM
from exugear.gearbox.sections.loads import RatingSection
from exugear.results.run_file import read_run
from exugear.system.assembly import Assembly
from exugear.system.fingerprint import input_hash
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed
from fe_ste.tools.files import FileError

CYCLES = 20.0
"""Mesh cycles of a window: K_v is that of some teeth in turn, and speed hardly changes in it."""
LEAST_SAMPLES = 8
"""Samples of a mesh cycle below which its largest force may lie between them."""
WITHIN = 0.05
"""Part of a speed within which the largest factor counts: a machine does not run at one speed exactly."""


@dataclass(frozen=True, eq=False)
class DynamicFactor(Displayed):
    """K_v over the speed of the loaded body."""

    speed: Floats
    value: Floats
    """(n,) rad/s without sign, rising; factors."""
    least: float = 1.0
    """Factor below which none is taken."""
    source: str = ""
    """What it is of, in words."""

    def _line(self) -> str:
        return f": {self.value.min():.3f} to {self.value.max():.3f} at {len(self.speed)} speeds"

    def at(self, speed: Floats) -> Floats:
        """Largest factor near each speed (rad/s); beyond the run that of its end."""
        found = np.empty(len(speed))
        for place, one in enumerate(np.clip(np.abs(speed), self.speed[0], self.speed[-1])):
            near = np.abs(self.speed - one) <= WITHIN * one
            found[place] = self.value[near].max() if near.any() else np.interp(one, self.speed, self.value)
        return np.maximum(found, self.least)

    def largest(self, slowest: float, fastest: float) -> float:
        """Largest factor of a range of speeds (rad/s without sign)."""
        inside = (self.speed >= slowest * (1.0 - WITHIN)) & (self.speed <= fastest * (1.0 + WITHIN))
        ends = self.at(np.array([slowest, fastest]))
        return float(max(self.value[inside].max(initial=self.least), ends.max()))


def stated_factors(gearbox: Gearbox, value: float) -> dict[str, DynamicFactor]:
    """One factor for all mesh families and speeds."""
    dynamicfactor = DynamicFactor(np.zeros(1), np.full(1, value), source="as stated")
    return {mesh.family: dynamicfactor for mesh in gearbox.meshes}


def factors_of_run(assembly: Assembly, rating: RatingSection, path: Path, body: str) -> dict[str, DynamicFactor]:
    """Factors of mesh families over the speed of a body, from a run of the same variant.

    Parameters
    ----------
    rating : with the load case that the run is of, and the least factor
    path : file of the run
    body : loaded body, whose speed counts

    Raises
    ------
    CaseError
        No run there, one of another input, or one that is sampled too coarsely for its meshes.
    """
    gearbox = assembly.gearbox
    key = f"rating.dynamic_factor_run = {rating.dynamic_factor_run!r}"
    try:
        arrays, attributes = read_run(path, ["time", "input_speed", "mesh_force"])
    except FileError as error:
        command = f"exugear run CASE.toml --variant {assembly.variant} --load-case {rating.dynamic_factor_run}"
        raise gearbox.fault(f"{key}: {error}; `{command}` makes it") from error
    if attributes["input_hash"] != input_hash(assembly, rating.dynamic_factor_run):
        raise gearbox.fault(f"{key}: {path} belongs to another input; run it again")
    ratio = abs(gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)[body])
    frequencies = gearbox.train.mesh_frequencies(1.0)
    speed = np.abs(arrays["input_speed"].astype(np.float64))
    found: dict[str, list[tuple[Floats, Floats]]] = {}
    for number, mesh in enumerate(gearbox.meshes):
        force = np.abs(arrays["mesh_force"][:, number].astype(np.float64))
        windows = window_factors(arrays["time"], frequencies[mesh.name] * speed, force)
        if windows is None:
            raise gearbox.fault(f"{key}: {path} holds no window of {CYCLES:g} mesh cycles of {mesh.name}")
        instants, values = windows
        found.setdefault(mesh.family, []).append((ratio * np.interp(instants, arrays["time"], speed), values))
    every = np.concatenate([speeds for parts in found.values() for speeds, _ in parts]) / RPM
    source = f"the run {rating.dynamic_factor_run} over {every.min():.4g} to {every.max():.4g} rpm of {body}"
    return {family: merged(parts, rating.least_dynamic_factor or 1.0, source) for family, parts in found.items()}


def window_factors(time: Floats, frequency: Floats, force: Floats) -> tuple[Floats, Floats] | None:
    """Largest over mean force in windows of `CYCLES` mesh cycles, and their middles (s); None without a whole one.

    Parameters
    ----------
    time, frequency, force : (samples,) s, mesh frequency in Hz, N

    Notes
    -----
    Windows with fewer than `LEAST_SAMPLES` samples a cycle, or without load, are left out.
    """
    cycles = np.append(0.0, np.cumsum(0.5 * (frequency[1:] + frequency[:-1]) * np.diff(time)))
    window = np.floor(cycles / CYCLES).astype(int)
    starts = np.flatnonzero(np.append(True, np.diff(window) > 0))[:-1]  # the last one is not whole
    if not len(starts):
        return None
    ends = np.append(starts[1:], np.flatnonzero(window == window[starts[-1]])[-1] + 1)
    counts = (ends - starts).astype(np.float64)
    largest = np.maximum.reduceat(force, starts)
    if ends[-1] < len(force):
        largest[-1] = force[starts[-1] : ends[-1]].max()
    sums = np.add.reduceat(force, starts)
    sums[-1] = force[starts[-1] : ends[-1]].sum()
    kept = (counts >= LEAST_SAMPLES * CYCLES) & (sums > 0.0)
    if not kept.any():
        return None
    middles = 0.5 * (time[starts] + time[ends - 1])
    return middles[kept], (largest * counts / np.where(sums > 0.0, sums, 1.0))[kept]


def merged(parts: list[tuple[Floats, Floats]], least: float, source: str) -> DynamicFactor:
    """Speeds (rad/s) and factors of all meshes of a family as one, by speed."""
    speed, value = (np.concatenate([part[place] for part in parts]) for place in (0, 1))
    order = np.argsort(speed)
    return DynamicFactor(speed[order], value[order], least, source)
