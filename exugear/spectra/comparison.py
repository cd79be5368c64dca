"""Two variants side by side: which resonances their run-ups show, which modes those are, and what only one has."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from exugear.results.run_file import load_run
from exugear.spectra.orders import run_waterfall
from exugear.spectra.resonances import (
    AbsenceRule,
    Pick,
    Resonance,
    group_by_frequency,
    match_eigenfrequencies,
    only_in_first,
    pick_resonances,
)
from exugear.spectra.waterfall import OrderLine, Waterfall
from fe_ste.tools.arrays import Floats

NEAR = 0.05
"""A mode within this part of a frequency counts as near it."""
LEAST_SHARE = 1e-5
"""Modes with a smaller share of the overall transmission error's mobility are no match for a resonance of it."""
RPM = math.pi / 30.0


@dataclass(frozen=True)
class Finding:
    """A resonance of a run-up and the eigenmode it belongs to.

    Attributes
    ----------
    resonance : Resonance
        Peaks of one or several orders at one frequency, the highest first.
    mode : int or None
        Place of the nearest eigenfrequency that the overall transmission error sees, if one lies within the resolution.
    mode_frequency : float
        Hz; NaN without a mode.
    mode_name : str
        What moves, in words; empty without a mode.
    """

    resonance: Resonance
    mode: int | None
    mode_frequency: float
    mode_name: str

    @property
    def strongest(self) -> Pick:
        """Highest of its peaks."""
        return self.resonance.picks[0]

    @property
    def speed(self) -> float:
        """Speed of the reference shaft at the highest peak, revolutions per minute."""
        return self.strongest.speed / RPM


@dataclass(frozen=True)
class VariantRun:
    """A run-up with its spectra, resonances and modes.

    Attributes
    ----------
    path : Path
    attributes : mapping
        What was run.
    spectra : Waterfall
    picks : tuple of Pick
    modes : xarray.Dataset or None
        As `exugear.dynamics.modes.Modes.to_dataset` makes it.
    """

    path: Path
    attributes: Mapping[str, Any]
    spectra: Waterfall
    picks: tuple[Pick, ...]
    modes: xr.Dataset | None

    @property
    def variant(self) -> str:
        """Name of the variant."""
        return str(self.attributes["variant"])

    def findings(self, picks: Sequence[Pick] | None = None) -> tuple[Finding, ...]:
        """Resonances, by frequency, of all peaks or of some of them, each with its mode."""
        found = group_by_frequency(self.picks if picks is None else picks)
        if self.modes is None:
            return tuple(Finding(resonance, None, math.nan, "") for resonance in found)
        seen = np.flatnonzero(mobility_shares(self.modes) >= LEAST_SHARE)
        frequency = self.modes["frequency"].to_numpy()
        matches = match_eigenfrequencies(found, frequency[seen])
        return tuple(
            Finding(resonance, None, math.nan, "")
            if match is None
            else Finding(
                resonance,
                int(seen[match]),
                float(frequency[seen[match]]),
                str(self.modes["name"].to_numpy()[seen[match]]),
            )
            for resonance, match in zip(found, matches, strict=True)
        )


def read_run(
    path: str | Path, lines: Sequence[OrderLine], modes: xr.Dataset | None = None, window_length: float | None = None
) -> VariantRun:
    """Read a run-up, compute its waterfall and pick its resonances.

    Parameters
    ----------
    path : path
        ``run.nc``, or ``run.partial`` of a run that was stopped.
    lines : sequence of OrderLine
        Where to look for resonances.
    modes : xarray.Dataset, optional
        Modes of the same variant, law and inertia set.
    window_length : float, optional
        s; runs to be compared need the same.

    Raises
    ------
    ValueError
        The run is too short for a spectrum, or its speed does not change.
    FileError
        The run is missing or damaged.
    """
    attributes = load_run(path, ()).attrs
    spectra = run_waterfall(path, window_length)
    return VariantRun(Path(path), attributes, spectra, pick_resonances(spectra, lines), modes)


@dataclass(frozen=True)
class Comparison:
    """Run-ups of two variants under the same law, inertia set and load case.

    Attributes
    ----------
    first, second : VariantRun
        The first is the compliant one: what it has and the second lacks is asked for.
    rule : AbsenceRule
        When a peak counts as absent.
    """

    first: VariantRun
    second: VariantRun
    rule: AbsenceRule

    @cached_property
    def only_first(self) -> tuple[Finding, ...]:
        """Resonances of the first run whose peaks the second does not show."""
        return self.first.findings(only_in_first(self.first.picks, self.second.spectra, self.rule))

    @cached_property
    def only_second(self) -> tuple[Finding, ...]:
        """Resonances of the second run whose peaks the first does not show."""
        return self.second.findings(only_in_first(self.second.picks, self.first.spectra, self.rule))

    @property
    def runs(self) -> tuple[VariantRun, VariantRun]:
        """Both, the stiff one first, as pictures show them."""
        return self.second, self.first


def compare(first: VariantRun, second: VariantRun, rule: AbsenceRule | None = None) -> Comparison:
    """Set two run-ups side by side.

    Raises
    ------
    ValueError
        They differ in more than the variant, or were analysed with different windows.
    """
    for key in ("gearbox", "load_case", "mesh_law", "inertias"):
        ours, theirs = first.attributes[key], second.attributes[key]
        if ours != theirs:
            raise ValueError(f"runs to compare differ in {key}: {ours!r} and {theirs!r}")
    if first.spectra.window_length != second.spectra.window_length:
        raise ValueError("runs to compare were analysed with windows of different length")
    return Comparison(first, second, rule or AbsenceRule())


def mobility_shares(modes: xr.Dataset) -> Floats:
    """Share of each mode in the mobility of the overall transmission error, shape (n,); they add up to one.

    With unit modal mass the squares of what the overall transmission error sees of each mode add up to r M^-1 r^T,
    whatever the stiffness: a measure without dimension of how strongly it sees each.
    """
    seen = modes["overall_dte"].to_numpy() ** 2
    total = float(seen.sum())
    shares: Floats = seen / total if total > 0.0 else np.zeros(seen.shape)
    return shares


@dataclass(frozen=True)
class ModeReport:
    """One eigenmode in figures.

    Attributes
    ----------
    place : int
        In the list of modes, from 0.
    frequency, damping_ratio : float
        Hz, share of critical damping.
    name : str
        What moves, in words.
    share : float
        See `mobility_shares`.
    amplification : float
        Overall transmission error at resonance per transmission error of the mesh that excites it most, m/m.
    mesh : str
        That mesh.
    strain : mapping of str to float
        Share of strain energy by mesh, bearing and coupling.
    kinetic : mapping of str to float
        Share of kinetic energy by body.
    """

    place: int
    frequency: float
    damping_ratio: float
    name: str
    share: float
    amplification: float
    mesh: str
    strain: Mapping[str, float]
    kinetic: Mapping[str, float]

    def is_near(self, frequency: float, tolerance: float = NEAR) -> bool:
        """Tell whether the mode lies within a part of a frequency (Hz)."""
        return abs(self.frequency - frequency) <= tolerance * frequency


def report_mode(modes: xr.Dataset, place: int) -> ModeReport:
    """Gather the figures of one mode."""
    one = modes.isel(mode=place)
    amplification = one["amplification"].to_numpy()
    loudest = int(np.argmax(amplification)) if amplification.size else -1
    kinetic = one["kinetic_energy_share"].sum("motion").to_numpy()
    return ModeReport(
        place=place,
        frequency=float(one["frequency"]),
        damping_ratio=float(one["damping_ratio"]),
        name=str(one["name"].item()),
        share=float(mobility_shares(modes)[place]),
        amplification=float(amplification[loudest]) if amplification.size else 0.0,
        mesh=str(modes["mesh"].to_numpy()[loudest]) if amplification.size else "",
        strain=_labelled(element_words(modes), one["strain_energy_share"].to_numpy()),
        kinetic=_labelled(modes["body"].to_numpy(), kinetic),
    )


def element_words(modes: xr.Dataset) -> list[str]:
    """Name what is strained: meshes, bearings and couplings by their names, elastic bodies as themselves."""
    bodies = {f"{name}_body": f"{name} itself" for name in modes["body"].to_numpy()}
    return [bodies.get(str(name), str(name)) for name in modes["element"].to_numpy()]


def _labelled(names: Iterable[str], values: Floats) -> dict[str, float]:
    return {str(name): float(value) for name, value in zip(names, values, strict=True)}


def nearest_mode(modes: xr.Dataset, frequency: float, least_share: float = 0.0) -> ModeReport | None:
    """Find the elastic mode nearest to a frequency (Hz) among those of a least share of mobility, or None."""
    values = modes["frequency"].to_numpy()
    allowed = np.flatnonzero((values > 0.0) & (mobility_shares(modes) >= least_share))
    if not allowed.size:
        return None
    return report_mode(modes, int(allowed[np.argmin(np.abs(values[allowed] - frequency))]))
