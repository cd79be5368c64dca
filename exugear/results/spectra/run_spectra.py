"""Spectra of stored run-ups: their waterfall, and their resonances with the eigenmodes they belong to."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.parts import RPM
from exugear.results.run_file import read_run as read_arrays
from exugear.results.spectra.mode_report import mobility_shares
from exugear.results.spectra.orders import OrderLine
from exugear.results.spectra.resonances import (
    Pick,
    Resonance,
    group_by_frequency,
    match_eigenfrequencies,
    pick_resonances,
)
from exugear.results.spectra.spectrum import sweep_matched_window
from exugear.results.spectra.waterfall import Waterfall, waterfall
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import Displayed, TitledRows

LEAST_SHARE = 1e-5
"""Modes with a smaller share of the overall transmission error's mobility are no match for a resonance of it."""
SHIFT = 0.01
"""Share of a frequency by which a resonance and its mode differ: turning shafts and stiffness at the load shift it."""

LONGEST_WINDOW = 0.25
"""Part of a run that a window has at most: one whose speed hardly changes would want a longer one than the run."""
_NAMES = ("time", "input_speed", "overall_dte")


@dataclass(frozen=True)
class RunSignals(Displayed, line=": {overall.size} samples at {rate:.6g} Hz"):
    """What the waterfall of a run-up is made of."""

    path: Path
    attributes: Mapping[str, Any]
    """What was run."""
    rate: float
    """Samples per second."""
    span: float
    """Simulated time, s."""
    speed: Floats
    overall: Floats
    """(n,) speed of the overall input, rad/s; overall transmission error, m."""

    @property
    def suitable_window(self) -> float:
        """Length of the window (s) that suits the fastest first-order sweep.

        Raises
        ------
        ValueError
            The speed does not change, so that nothing says how long a window should be.
        """
        sweep = float(self.attributes["highest_order"]) * float(np.ptp(self.speed)) / (2.0 * math.pi * self.span)
        return min(sweep_matched_window(sweep), LONGEST_WINDOW * self.span)

    def waterfall(self, window_length: float | None = None) -> Waterfall:
        """Waterfall of the overall transmission error with a window (s), the suitable one by default."""
        length = self.suitable_window if window_length is None else window_length
        return waterfall(self.overall, self.speed, self.rate, window_length=length)


def run_signals(path: str | Path) -> RunSignals:
    """Read what the waterfall of a run-up is made of.

    Raises
    ------
    ValueError
        The run is too short.
    FileError
        The run is missing or damaged.
    """
    data, attributes = read_arrays(Path(path), _NAMES)
    time, speed, overall = (data[name] for name in _NAMES)
    if time.size < 2:
        raise ValueError(f"{path}: holds {time.size} samples, too few for a spectrum; run for longer")
    span = float(np.ptp(time))
    return RunSignals(Path(path), attributes, (time.size - 1) / span, span, speed, overall)


def run_waterfall(path: str | Path, window_length: float | None = None) -> Waterfall:
    """Waterfall of the overall DTE of a run-up.

    Parameters
    ----------
    path : ``run.nc`` of a run-up, or ``run.partial``
    window_length : s; what suits the fastest first-order sweep by default. Runs to be compared need the same.

    Raises
    ------
    ValueError
        The speed does not change, so that nothing says how long a window should be, or the run is too short.
    FileError
        The run is missing or damaged.
    """
    return run_signals(path).waterfall(window_length)


@dataclass(frozen=True)
class Finding:
    """A resonance of a run-up and the eigenmode it belongs to."""

    resonance: Resonance
    """Peaks of one or several orders at one frequency, the highest first."""
    mode: int | None
    """Number, from 0, of the nearest eigenfrequency that the overall transmission error sees, if one lies within the
    resolution."""
    mode_frequency: float
    """Hz; NaN without a mode."""
    mode_name: str
    """What moves, in words; empty without a mode."""

    @property
    def strongest(self) -> Pick:
        """Highest of its peaks."""
        return self.resonance.picks[0]

    @property
    def speed(self) -> float:
        """Speed of the reference shaft at the highest peak, revolutions per minute."""
        return self.strongest.speed / RPM


@dataclass(frozen=True)
class VariantRun(Displayed):
    """A run-up with its spectra, resonances and modes."""

    path: Path
    attributes: Mapping[str, Any]
    """What was run."""
    spectra: Waterfall
    picks: tuple[Pick, ...]
    modes: xr.Dataset | None
    """As `exugear.system.eigenmodes.modes.Modes.to_dataset` makes it."""

    def _line(self) -> str:
        return f" {shorten(f'{self.variant}, {self.conditions}', 150)}, {len(self.picks)} peaks"

    def _table(self) -> TitledRows:
        peaks = [(finding.resonance.frequency, finding.strongest) for finding in self.findings()]
        rows = {f"{frequency:.0f} Hz": f"{peak.level:.1f} dB on {peak.line.name}" for frequency, peak in peaks}
        return f"Run-up of variant {self.variant}, {self.conditions}", rows

    @property
    def variant(self) -> str:
        """Name of the variant."""
        return str(self.attributes["variant"])

    @property
    def conditions(self) -> str:
        """Load case, law and inertia set in words."""
        load_case, law, inertias = (self.attributes[key] for key in ("load_case", "mesh_law", "inertias"))
        return f"load case {load_case}, law {law}, inertias {inertias}"

    def findings(self, picks: Sequence[Pick] | None = None) -> tuple[Finding, ...]:
        """Resonances, by frequency, of all peaks or of some of them, each with its mode."""
        resonances = group_by_frequency(self.picks if picks is None else picks)
        if self.modes is None:
            return tuple(Finding(resonance, None, math.nan, "") for resonance in resonances)
        visible = self._seen_modes(self.modes)
        matches = match_eigenfrequencies(resonances, self.modes["frequency"].to_numpy()[visible])
        return tuple(
            self._finding(resonance, None if match is None else int(visible[match]))
            for resonance, match in zip(resonances, matches, strict=True)
        )

    def located(self, finding: Finding, frequency: float) -> Finding:
        """Return a resonance with the mode nearest to where a steady response shows it, Hz, instead of the run-up."""
        if self.modes is None:
            return finding
        visible = self._seen_modes(self.modes)
        apart = np.abs(self.modes["frequency"].to_numpy()[visible] - frequency)
        nearest = None if not apart.size or apart.min() > SHIFT * frequency else int(visible[np.argmin(apart)])
        return self._finding(finding.resonance, nearest)

    @staticmethod
    def _seen_modes(modes: xr.Dataset) -> Integers:
        return np.flatnonzero(mobility_shares(modes) >= LEAST_SHARE)

    def _finding(self, resonance: Resonance, mode: int | None) -> Finding:
        if mode is None or self.modes is None:
            return Finding(resonance, None, math.nan, "")
        return Finding(resonance, mode, float(self.modes["frequency"][mode]), str(self.modes["name"].to_numpy()[mode]))


def read_run(
    path: str | Path, lines: Sequence[OrderLine], modes: xr.Dataset | None = None, window_length: float | None = None
) -> VariantRun:
    """Read a run-up, compute its waterfall and pick its resonances.

    Parameters
    ----------
    path : ``run.nc``, or ``run.partial`` of a run that was stopped
    lines : where to look for resonances
    modes : modes of the same variant, law and inertia set
    window_length : s; runs to be compared need the same

    Raises
    ------
    ValueError
        The run is too short for a spectrum, or its speed does not change.
    FileError
        The run is missing or damaged.
    """
    return analysed(run_signals(path), lines, modes, window_length)


def analysed(
    signals: RunSignals,
    lines: Sequence[OrderLine],
    modes: xr.Dataset | None = None,
    window_length: float | None = None,
) -> VariantRun:
    """Compute the waterfall of a run-up that was read, and pick its resonances; arguments as in `read_run`."""
    spectra = signals.waterfall(window_length)
    return VariantRun(signals.path, signals.attributes, spectra, pick_resonances(spectra, lines), modes)
