"""Eigenmodes in figures: what each one moves and strains, and how strongly the overall transmission error sees it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from textwrap import shorten

import numpy as np
import xarray as xr

from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed

NEAR = 0.05
"""A mode within this part of a frequency counts as near it."""


def mobility_shares(modes: xr.Dataset) -> Floats:
    """Share of each mode in the mobility of the overall transmission error, shape (n,); they add up to one.

    With unit modal mass the squares of what the overall transmission error sees of each mode add up to r M^-1 r^T,
    whatever the stiffness: a measure without dimension of how strongly it sees each.
    """
    squares = modes["overall_dte"].to_numpy() ** 2
    total = float(squares.sum())
    shares: Floats = squares / total if total > 0.0 else np.zeros(squares.shape)
    return shares


@dataclass(frozen=True)
class ModeReport(Displayed):
    """One eigenmode in figures."""

    index: int
    """In the list of modes, from 0."""
    frequency: float
    damping_ratio: float
    """Hz, share of critical damping."""
    name: str
    """What moves, in words."""
    share: float
    """See `mobility_shares`."""
    amplification: float
    """Overall transmission error at resonance per transmission error of the mesh that excites it most, m/m."""
    mesh: str
    """That mesh."""
    strain: Mapping[str, float]
    """Share of strain energy by mesh, bearing and coupling."""
    kinetic: Mapping[str, float]
    """Share of kinetic energy by body."""

    def _line(self) -> str:
        share = f"share {100 * self.share:.2g} %"
        return f" {self.index}: {self.frequency:.1f} Hz, {share}, {shorten(self.name, 90)}"

    def is_near(self, frequency: float, tolerance: float = NEAR) -> bool:
        """Tell whether the mode lies within a part of a frequency (Hz)."""
        return abs(self.frequency - frequency) <= tolerance * frequency


def report_mode(modes: xr.Dataset, index: int) -> ModeReport:
    """Gather the figures of one mode."""
    mode = modes.isel(mode=index)
    amplification = mode["amplification"].to_numpy()
    strongest_mesh = int(np.argmax(amplification)) if amplification.size else -1
    kinetic = mode["kinetic_energy_share"].sum("motion").to_numpy()
    return ModeReport(
        index=index,
        frequency=float(mode["frequency"]),
        damping_ratio=float(mode["damping_ratio"]),
        name=str(mode["name"].item()),
        share=float(mobility_shares(modes)[index]),
        amplification=float(amplification[strongest_mesh]) if amplification.size else 0.0,
        mesh=str(modes["mesh"].to_numpy()[strongest_mesh]) if amplification.size else "",
        strain=_labelled(element_words(modes), mode["strain_energy_share"].to_numpy()),
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
    frequencies = modes["frequency"].to_numpy()
    allowed = np.flatnonzero((frequencies > 0.0) & (mobility_shares(modes) >= least_share))
    if not allowed.size:
        return None
    return report_mode(modes, int(allowed[np.argmin(np.abs(frequencies[allowed] - frequency))]))
