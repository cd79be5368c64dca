"""Dynamic factor K_v of meshes over speed: as stated, from a run, or from a steady-state response.

In a run, K_v is the ratio of maximum to mean force of a mesh within a few mesh cycles. Longer windows would include
variations of load sharing with the carrier rotation and of the load itself, which the static balance already includes.

For a steady-state response, forces are synthesised from its spectral components over windows of the same number of
mesh cycles, so that both sources give the same factor at a given speed. A steady-state response has settled at every
speed, whereas a run-up passes its resonances.
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
from exugear.steady.mean_system.planet_sets import PlanetSet, planet_sets
from exugear.system.system import Assembly, input_hash
from fe_ste.tools.arrays import Complexes, Floats
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.files import FileError

if TYPE_CHECKING:
    import xarray as xr

CYCLES = 20.0
"""Mesh cycles per window: several teeth contribute to K_v, and the speed is nearly constant."""
LEAST_SAMPLES = 8
"""Minimum number of samples per mesh cycle; with fewer, the maximum force may lie between samples."""
WITHIN = 0.05
"""Relative speed band in which the largest factor counts, as operating speeds are not exact."""


@dataclass(frozen=True, eq=False)
class DynamicFactor(ReprMixin):
    """K_v over the speed of the loaded body."""

    speed: Floats
    value: Floats
    """(n,) absolute speed, rad/s, ascending; factors."""
    least: float = 1.0
    """Minimum factor."""
    source: str = ""

    def _line(self) -> str:
        return f": {self.value.min():.3f} to {self.value.max():.3f} at {len(self.speed)} speeds"

    def at(self, speed: Floats) -> Floats:
        """Return the largest factor near each speed (rad/s); outside the speed range, the factor at its end."""
        found = np.empty(len(speed))
        for place, value in enumerate(np.clip(np.abs(speed), self.speed[0], self.speed[-1])):
            near = np.abs(self.speed - value) <= WITHIN * value
            found[place] = self.value[near].max() if near.any() else np.interp(value, self.speed, self.value)
        return np.maximum(found, self.least)

    def largest(self, slowest: float, fastest: float) -> float:
        """Return the largest factor in a range of absolute speeds, rad/s."""
        inside = (self.speed >= slowest * (1.0 - WITHIN)) & (self.speed <= fastest * (1.0 + WITHIN))
        ends = self.at(np.array([slowest, fastest]))
        return float(max(self.value[inside].max(initial=self.least), ends.max()))


def stated_factors(gearbox: Gearbox, value: float) -> dict[str, DynamicFactor]:
    """Return one factor for all mesh families and speeds."""
    dynamicfactor = DynamicFactor(np.zeros(1), np.full(1, value), source="as stated")
    return {mesh.family: dynamicfactor for mesh in gearbox.meshes}


def factors_of_run(assembly: Assembly, rating: RatingSection, path: Path, body: str) -> dict[str, DynamicFactor]:
    """Return the factors of mesh families over the speed of the loaded body, from a run of the same variant.

    Raises
    ------
    GearboxFileError
        The run is missing, has another input, or is sampled too coarsely for its meshes.
    """
    gearbox = assembly.gearbox
    key = f"rating.dynamic_factor_run = {rating.dynamic_factor_run!r}"
    try:
        arrays, attributes = read_run(path, ["time", "input_speed", "mesh_force"])
    except FileError as error:
        command = f"exugear run GEARBOX.toml --variant {assembly.variant} --load-case {rating.dynamic_factor_run}"
        raise gearbox.error(f"{key}: {error}; compute it by {command}") from error
    if attributes["input_hash"] != input_hash(assembly, rating.dynamic_factor_run):
        raise gearbox.error(f"{key}: {path} belongs to another input; run it again")
    ratio = abs(gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)[body])
    frequencies = gearbox.train.mesh_frequencies(1.0)
    speed = np.abs(arrays["input_speed"].astype(np.float64))
    found: dict[str, list[tuple[Floats, Floats]]] = {}
    for number, mesh in enumerate(gearbox.meshes):
        force = np.abs(arrays["mesh_force"][:, number].astype(np.float64))
        windows = window_factors(arrays["time"], frequencies[mesh.name] * speed, force)
        if windows is None:
            raise gearbox.error(f"{key}: {path} is shorter than a window of {CYCLES:g} mesh cycles of {mesh.name}")
        instants, values = windows
        found.setdefault(mesh.family, []).append((ratio * np.interp(instants, arrays["time"], speed), values))
    every = np.concatenate([speeds for parts in found.values() for speeds, _ in parts]) / RPM
    source = f"the run {rating.dynamic_factor_run} over {every.min():.4g} to {every.max():.4g} rpm of {body}"
    return {family: merged(parts, rating.minimum_dynamic_factor or 1.0, source) for family, parts in found.items()}


def window_factors(time: Floats, frequency: Floats, force: Floats) -> tuple[Floats, Floats] | None:
    """Return maximum over mean force in windows of `CYCLES` mesh cycles, and their middles (s); None without any.

    Parameters
    ----------
    time, frequency, force : (samples,) s, mesh frequency in Hz, N

    Notes
    -----
    Windows with fewer than `LEAST_SAMPLES` samples per cycle, or without load, are skipped.
    """
    cycles = np.append(0.0, np.cumsum(0.5 * (frequency[1:] + frequency[:-1]) * np.diff(time)))
    window = np.floor(cycles / CYCLES).astype(int)
    starts = np.flatnonzero(np.append(True, np.diff(window) > 0))[:-1]  # the last window is incomplete
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
    """Merge the speeds (rad/s) and factors of all meshes of a family, sorted by speed."""
    speed, value = (np.concatenate([part[place] for part in parts]) for place in (0, 1))
    order = np.argsort(speed)
    return DynamicFactor(speed[order], value[order], least, source)


WINDOWS = 4
"""Number of windows at each speed, to include slow beats between meshes."""
SAMPLES = 6
"""Samples per shortest period; the error of the maximum is below one seventh of a component's amplitude."""
SMALLEST = 1e-4
"""Fraction of the mean force below which a spectral component is neglected."""


def factors(assembly: Assembly, rating: RatingSection, folder: Path, body: str) -> Mapping[str, DynamicFactor]:
    """Return the factors of mesh families from the source in the gearbox file, reading the results folder if necessary.

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
    """Return the input hash of the source of K_v; empty for a stated value or a missing response."""
    if rating.dynamic_factor_run is not None:
        return input_hash(assembly, rating.dynamic_factor_run)
    if rating.dynamic_factor_steady is not None:
        from exugear.steady.steady_file import load_response  # the solvers of the response, not for checks

        with suppress(FileError):
            return str(load_response(response_path(folder, assembly, rating)).attrs["input_hash"])
    return ""


def response_path(folder: Path, assembly: Assembly, rating: RatingSection) -> Path:
    """Return the path of the steady-state response for K_v."""
    name = f"steady-{rating.dynamic_factor_steady}.nc"
    return modes_path(folder, _choice(assembly)).with_name(name)


def _choice(assembly: Assembly, load_case: str | None = None) -> Choice:
    return Choice(assembly.variant, assembly.mesh_model, assembly.inertias, load_case)


def factors_of_response(assembly: Assembly, rating: RatingSection, path: Path, body: str) -> dict[str, DynamicFactor]:
    """Return the factors of mesh families over the speed of the loaded body, from a response of the same variant.

    Raises
    ------
    GearboxFileError
        The response is missing or has another input.
    """
    from exugear.steady.steady_file import load_response, settings_of

    gearbox = assembly.gearbox
    level = rating.dynamic_factor_steady
    key = f"rating.dynamic_factor_steady = {level!r}"
    try:
        data = load_response(path)
        fits = settings_of(data.attrs).hash_with(assembly) == data.attrs["input_hash"]
    except (FileError, ValueError) as error:
        command = f"exugear steady GEARBOX.toml --variant {assembly.variant} --method {level}"
        raise gearbox.error(f"{key}: {error}; compute it by {command}") from error
    if not fits:
        raise gearbox.error(f"{key}: {path} belongs to another input; recompute it")
    frequencies = gearbox.train.mesh_frequencies(2.0 * np.pi)
    sets = planet_sets(assembly)
    ratio = abs(gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)[body])
    speed = ratio * np.abs(data["speed"].to_numpy())
    found: dict[str, list[tuple[Floats, Floats]]] = {}
    for mesh in gearbox.meshes:
        ends = {mesh.pinion, mesh.gear}
        planets = next((one for one in sets if ends & set(one.names) and not one.is_single), None)
        if planets is None or mesh.family not in found:
            values = family_factors(data, mesh.family, mesh.name, planets, frequencies[mesh.name])
            found.setdefault(mesh.family, []).append((speed, values))
    source = (
        f"the steady-state response ({level}) at {len(speed)} speeds of {body} from {speed.min() / RPM:.4g} to "
        f"{speed.max() / RPM:.4g} rpm"
    )
    least = rating.minimum_dynamic_factor or 1.0
    return {family: merged(parts, least, source) for family, parts in found.items()}


def family_factors(data: xr.Dataset, family: str, mesh: str, planets: PlanetSet | None, order: float) -> Floats:
    """Return the largest ratio of maximum to mean force in a window at each speed, over all windows and planets."""
    signals = [str(name) for name in data["signal"].to_numpy()]
    labels = [mesh]
    if planets is not None:
        labels = [family, *(f"{family} {wave_name(n, planets.waves)}" for n in range(1, planets.waves))]
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


def _sampled(lines: Complexes, orders: Floats, order: float) -> tuple[Floats, Floats]:
    """Sum components (lines, waves) over `WINDOWS` windows: (samples, waves), and input angles (samples,), rad.

    Samples are equidistant, so that each phase factor is a product of a coarse and a fine rotation: few exponentials.
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
