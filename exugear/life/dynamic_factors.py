"""The dynamic factor K_v of meshes over speed: as stated, or from the forces of a run.

In a run it is the largest over the mean force of a mesh within a few mesh cycles. Longer windows would count what the
carrier's turn does to load sharing, and what the load itself does, which the static balance has.

Of a response forces are put together again from its lines, over windows of as many mesh cycles as those of a run, so
that both say the same of one speed. A steady response has settled at every speed; a run-up passes its resonances.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.loads import RatingSection
from exugear.gearbox.units import RPM
from exugear.results.folder import modes_path, run_directory
from exugear.results.run_file import FINAL_NAME, read_run
from exugear.steady.mean_system.mesh_waves import wave_name
from exugear.steady.mean_system.rotating_frame import PlanetSet, planet_sets
from exugear.steady.steady_file import load_response, settings_of
from exugear.system.system import Assembly, input_hash
from fe_ste.tools.arrays import Complexes, Floats
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.files import FileError

if TYPE_CHECKING:
    import xarray as xr

CYCLES = 20.0
"""Mesh cycles of a window: K_v is that of some teeth in turn, and speed hardly changes in it."""
LEAST_SAMPLES = 8
"""Samples of a mesh cycle below which its largest force may lie between them."""
WITHIN = 0.05
"""Part of a speed within which the largest factor counts: a machine does not run at one speed exactly."""


@dataclass(frozen=True, eq=False)
class DynamicFactor(ReprMixin):
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
    GearboxFileError
        No run there, one of another input, or one that is sampled too coarsely for its meshes.
    """
    gearbox = assembly.gearbox
    key = f"rating.dynamic_factor_run = {rating.dynamic_factor_run!r}"
    try:
        arrays, attributes = read_run(path, ["time", "input_speed", "mesh_force"])
    except FileError as error:
        command = f"exugear run GEARBOX.toml --variant {assembly.variant} --load-case {rating.dynamic_factor_run}"
        raise gearbox.fault(f"{key}: {error}; compute it by `{command}`") from error
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
            raise gearbox.fault(f"{key}: {path} is shorter than a window of {CYCLES:g} mesh cycles of {mesh.name}")
        instants, values = windows
        found.setdefault(mesh.family, []).append((ratio * np.interp(instants, arrays["time"], speed), values))
    every = np.concatenate([speeds for parts in found.values() for speeds, _ in parts]) / RPM
    source = f"the run {rating.dynamic_factor_run} over {every.min():.4g} to {every.max():.4g} rpm of {body}"
    return {family: merged(parts, rating.minimum_dynamic_factor or 1.0, source) for family, parts in found.items()}


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


# The dynamic factor K_v as a gearbox file wants it: stated, of a run, or of a steady response

WINDOWS = 4
"""Windows at each speed: slow beats of several meshes show themselves in some of them."""
SAMPLES = 6
"""Samples of the shortest period: the largest lies within a seventh of a line's amplitude."""
SMALLEST = 1e-4
"""Share of the mean force below which a line is left out."""


def factors(assembly: Assembly, rating: RatingSection, folder: Path, body: str) -> Mapping[str, DynamicFactor]:
    """Factors of mesh families, from what a results folder holds where the gearbox file wants them of that.

    Parameters
    ----------
    folder : results folder
    body : loaded body

    Raises
    ------
    GearboxFileError
        See `factors_of_response` and `exugear.life.dynamic_factors.factors_of_run`.
    """
    if rating.dynamic_factor is not None:
        return stated_factors(assembly.gearbox, rating.dynamic_factor)
    if rating.dynamic_factor_run is not None:
        choice = _choice(assembly, rating.dynamic_factor_run)
        return factors_of_run(assembly, rating, run_directory(folder, choice) / FINAL_NAME, body)
    return factors_of_response(assembly, rating, response_path(folder, assembly, rating), body)


def source_hash(assembly: Assembly, rating: RatingSection, folder: Path) -> str:
    """Hash of the input of what gives K_v; empty where it is stated, or where there is no such response."""
    if rating.dynamic_factor_run is not None:
        return input_hash(assembly, rating.dynamic_factor_run)
    if rating.dynamic_factor_steady is not None:
        with suppress(FileError):
            return str(load_response(response_path(folder, assembly, rating)).attrs["input_hash"])
    return ""


def response_path(folder: Path, assembly: Assembly, rating: RatingSection) -> Path:
    """Place of the steady response that gives K_v."""
    name = f"steady-{rating.dynamic_factor_steady}.nc"
    return modes_path(folder, _choice(assembly)).with_name(name)


def _choice(assembly: Assembly, load_case: str | None = None) -> Choice:
    return Choice(assembly.variant, assembly.mesh_model, assembly.inertias, load_case)


def factors_of_response(assembly: Assembly, rating: RatingSection, path: Path, body: str) -> dict[str, DynamicFactor]:
    """Factors of mesh families over the speed of a body, from a steady response of the same variant.

    Parameters
    ----------
    rating : with the level that the response is of, and the least factor
    path : file of the response
    body : loaded body, whose speed counts

    Raises
    ------
    GearboxFileError
        No response there, or one of another input.
    """
    gearbox = assembly.gearbox
    level = rating.dynamic_factor_steady
    key = f"rating.dynamic_factor_steady = {level!r}"
    try:
        data = load_response(path)
        fits = settings_of(data.attrs).hash_with(assembly) == data.attrs["input_hash"]
    except (FileError, ValueError) as error:
        command = f"exugear steady GEARBOX.toml --variant {assembly.variant} --method {level}"
        raise gearbox.fault(f"{key}: {error}; compute it by `{command}`") from error
    if not fits:
        raise gearbox.fault(f"{key}: {path} belongs to another input; recompute it")
    frequencies = gearbox.train.mesh_frequencies(2.0 * np.pi)
    sets = planet_sets(assembly)
    ratio = abs(gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)[body])
    speed = ratio * np.abs(data["speed"].to_numpy())
    found: dict[str, list[tuple[Floats, Floats]]] = {}
    for mesh in gearbox.meshes:
        if mesh.family not in found:
            ends = {mesh.pinion, mesh.gear}
            planets = next((one for one in sets if ends & set(one.names)), None)
            values = family_factors(data, mesh.family, mesh.name, planets, frequencies[mesh.name])
            found[mesh.family] = [(speed, values)]
    source = (
        f"the steady-state response ({level}) at {len(speed)} speeds of {body} from {speed.min() / RPM:.4g} to "
        f"{speed.max() / RPM:.4g} rpm"
    )
    least = rating.minimum_dynamic_factor or 1.0
    return {family: merged(parts, least, source) for family, parts in found.items()}


def family_factors(data: xr.Dataset, family: str, mesh: str, planets: PlanetSet | None, order: float) -> Floats:
    """Largest over mean force in a window, at each speed, the largest of all windows and planets."""
    signals = [str(name) for name in data["signal"].to_numpy()]
    labels = [mesh] if planets is None else _labels(family, planets)
    places = [signals.index(f"mesh_force {label}") for label in labels if f"mesh_force {label}" in signals]
    size, phase = (data[key].to_numpy()[:, :, places].astype(np.float64) for key in ("amplitude", "phase"))
    lines = size * np.exp(1j * phase)
    orders = data["order"].to_numpy()
    found = np.empty(len(lines))
    for n, line in enumerate(lines):
        loud = np.abs(line).max(axis=1) > SMALLEST * np.abs(line[0]).max()
        loud[0] = True
        waves, angles = _sampled(line[loud], orders[loud], order)
        shapes = np.ones((1, 1, 1)) if planets is None else planets.values(planets.ratio * angles)[..., : len(places)]
        force = np.abs(np.einsum("snw,sw->ns", np.broadcast_to(shapes, (len(angles), *shapes.shape[1:])), waves))
        windows = force.reshape(len(force), WINDOWS, -1)
        mean = windows.mean(axis=2)
        found[n] = np.max(windows.max(axis=2) / np.where(mean > 0.0, mean, np.inf), initial=1.0)
    return found


def _labels(family: str, planets: PlanetSet) -> list[str]:
    names = (wave_name(n, planets.waves) for n in range(1, planets.waves))
    return [family, *(f"{family} {name}" for name in names)]


def _sampled(lines: Complexes, orders: Floats, order: float) -> tuple[Floats, Floats]:
    """Sum lines (lines, waves) over `WINDOWS` windows: (samples, waves), and angles of the input (samples,), rad.

    Samples are even, so that each is a product of a coarse and a fine turn: few exponentials make all.
    """
    each = CYCLES / order * 2.0 * np.pi
    fine = int(np.ceil(SAMPLES * CYCLES * max(1.0, float(orders.max()) / order)))
    blocks = int(np.ceil(np.sqrt(fine)))
    fine = blocks * int(np.ceil(fine / blocks))
    step = each / fine
    coarse = np.exp(1j * np.outer(np.arange(WINDOWS * blocks) * (step * fine / blocks), orders))
    turns = np.exp(1j * np.outer(orders, np.arange(fine // blocks) * step))
    values = np.stack([((coarse * wave) @ turns).real.ravel() for wave in lines.T], axis=-1)
    return np.asarray(values), np.asarray(np.arange(len(values)) * step)
