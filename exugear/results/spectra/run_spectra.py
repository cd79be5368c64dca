"""Spectra of stored run-ups: their waterfall, and their resonances with the assigned eigenmodes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.units import RPM
from exugear.results.run_file import read_run as read_arrays
from exugear.results.spectra.diagrams import draw_highest_levels
from exugear.results.spectra.resonances import (
    Pick,
    WaterfallResonance,
    are_indistinct,
    group_by_frequency,
    match_eigenfrequencies,
    peaks_on_line,
    pick_resonances,
)
from exugear.results.spectra.waterfall import OrderLine, Waterfall, sweep_matched_window, waterfall
from exugear.system.modes import participation
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import ReprMixin, TitledRows

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

# Results of eigenmodes: kinetic and strain energy, and participation in the overall transmission error

NEAR = 0.05
"""Relative difference in frequency up to which a mode counts as near a frequency."""


def mobility_shares(modes: xr.Dataset) -> Floats:
    """Participation of each stored mode, see `exugear.system.modes.participation`."""
    return participation(modes["overall_dte"].to_numpy())


@dataclass(frozen=True)
class ModeReport(ReprMixin):
    """Results of one eigenmode."""

    index: int
    """Index in the list of modes, from 0."""
    frequency: float
    damping_ratio: float
    """Frequency (Hz) and damping ratio."""
    name: str
    share: float
    """Participation in the overall transmission error, see `mobility_shares`."""
    amplification: float
    """Overall transmission error at resonance divided by the transmission error of the dominant mesh, m/m."""
    mesh: str
    """Dominant mesh: the one with the largest amplification."""
    strain: Mapping[str, float]
    """Fraction of the strain energy by mesh, bearing and coupling."""
    kinetic: Mapping[str, float]
    """Fraction of the kinetic energy by body."""

    def _line(self) -> str:
        share = f"share {100 * self.share:.2g} %"
        return f" {self.index}: {self.frequency:.1f} Hz, {share}, {shorten(self.name, 90)}"

    def is_near(self, frequency: float) -> bool:
        """Return whether the relative distance of the mode from a frequency (Hz) is at most `NEAR`."""
        return abs(self.frequency - frequency) <= NEAR * frequency


def report_mode(modes: xr.Dataset, index: int) -> ModeReport:
    """Collect the results of one mode."""
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
    """Return the names of the elements with strain energy: meshes, bearings, couplings, and flexible bodies."""
    bodies = {f"{name}_body": f"{name} itself" for name in modes["body"].to_numpy()}
    return [bodies.get(str(name), str(name)) for name in modes["element"].to_numpy()]


def _labelled(names: Iterable[str], values: Floats) -> dict[str, float]:
    return {str(name): float(value) for name, value in zip(names, values, strict=True)}


def nearest_mode(modes: xr.Dataset, frequency: float, least_share: float = 0.0) -> ModeReport | None:
    """Find the elastic mode nearest to a frequency (Hz) among those of a minimum TE participation, or None."""
    frequencies = modes["frequency"].to_numpy()
    allowed = np.flatnonzero((frequencies > 0.0) & (mobility_shares(modes) >= least_share))
    if not allowed.size:
        return None
    return report_mode(modes, int(allowed[np.argmin(np.abs(frequencies[allowed] - frequency))]))


LEAST_SHARE = 1e-5
"""Minimum participation of a mode that is assigned to a resonance of the overall transmission error."""
SHIFT = 0.01
"""Relative frequency difference between a resonance and its mode, due to rotating shafts and stiffness at the load."""

LONGEST_WINDOW = 0.25
"""Maximum length of a window as a fraction of the run; at nearly constant speed the matched window would be longer than
the run.
"""
_NAMES = ("time", "input_speed", "overall_dte")


@dataclass(frozen=True)
class RunSignals(ReprMixin, line=": {overall.size} samples at {rate:.6g} Hz"):
    """Signals of a run-up from which its waterfall is computed."""

    path: Path
    attributes: Mapping[str, Any]
    rate: float
    """Sampling rate, Hz."""
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
            The speed does not change, so that no window length follows from it.
        """
        sweep = float(self.attributes["highest_order"]) * float(np.ptp(self.speed)) / (2.0 * math.pi * self.span)
        return min(sweep_matched_window(sweep), LONGEST_WINDOW * self.span)

    def waterfall(self, window_length: float | None = None) -> Waterfall:
        """Waterfall of the overall transmission error with a window length (s), by default the suitable one."""
        length = self.suitable_window if window_length is None else window_length
        return waterfall(self.overall, self.speed, self.rate, window_length=length)


def run_signals(path: str | Path) -> RunSignals:
    """Read the signals of a run-up from which its waterfall is computed.

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
        raise ValueError(f"{path}: contains {time.size} samples, too few for a spectrum; run a longer duration")
    span = float(np.ptp(time))
    return RunSignals(Path(path), attributes, (time.size - 1) / span, span, speed, overall)


def run_waterfall(path: str | Path, window_length: float | None = None) -> Waterfall:
    """Waterfall of the overall transmission error of a run-up.

    Parameters
    ----------
    path : ``run.nc`` of a run-up, or ``run.partial``
    window_length : s; by default suitable for the fastest first-order sweep. Runs to be compared need the same length.

    Raises
    ------
    ValueError
        The speed does not change, so that no window length follows from it, or the run is too short.
    FileError
        The run is missing or damaged.
    """
    return run_signals(path).waterfall(window_length)


@dataclass(frozen=True)
class Finding:
    """A resonance of a run-up and its eigenmode."""

    resonance: WaterfallResonance
    """Peaks of one or several orders at one frequency, the highest first."""
    mode: int | None
    """Index, from 0, of the nearest eigenfrequency with sufficient TE participation, if one is within the resolution.
    """
    mode_frequency: float
    """Frequency of the mode, Hz; NaN without a mode."""
    mode_name: str
    """Description of the mode shape; empty without a mode."""

    @property
    def strongest(self) -> Pick:
        """Highest peak of the resonance."""
        return self.resonance.picks[0]

    @property
    def speed(self) -> float:
        """Speed of the reference shaft at the highest peak, revolutions per minute."""
        return self.strongest.speed / RPM


@dataclass(frozen=True)
class VariantRun(ReprMixin):
    """A run-up with its spectra, resonances and modes."""

    path: Path
    attributes: Mapping[str, Any]
    spectra: Waterfall
    picks: tuple[Pick, ...]
    modes: xr.Dataset | None
    """Dataset of modes from `exugear.system.modes.Modes.to_dataset`."""

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
        """Load case, mesh model and inertia set as text."""
        load_case, law, inertias = (self.attributes[key] for key in ("load_case", "mesh_model", "inertias"))
        return f"load case {load_case}, mesh model {law}, inertia set {inertias}"

    def findings(self) -> tuple[Finding, ...]:
        """Resonances of all peaks, by frequency, each with its mode."""
        resonances = group_by_frequency(self.picks)
        if self.modes is None:
            return tuple(self._finding(resonance, None) for resonance in resonances)
        visible = self._seen_modes(self.modes)
        matches = match_eigenfrequencies(resonances, self.modes["frequency"].to_numpy()[visible])
        return tuple(
            self._finding(resonance, None if match is None else int(visible[match]))
            for resonance, match in zip(resonances, matches, strict=True)
        )

    def located(self, finding: Finding, frequency: float) -> Finding:
        """Return a resonance with the mode nearest to its frequency (Hz) in a steady-state response."""
        if self.modes is None:
            return finding
        visible = self._seen_modes(self.modes)
        apart = np.abs(self.modes["frequency"].to_numpy()[visible] - frequency)
        nearest = None if not apart.size or apart.min() > SHIFT * frequency else int(visible[np.argmin(apart)])
        return self._finding(finding.resonance, nearest)

    @staticmethod
    def _seen_modes(modes: xr.Dataset) -> Integers:
        return np.flatnonzero(mobility_shares(modes) >= LEAST_SHARE)

    def _finding(self, resonance: WaterfallResonance, mode: int | None) -> Finding:
        if mode is None or self.modes is None:
            return Finding(resonance, None, math.nan, "")
        return Finding(resonance, mode, float(self.modes["frequency"][mode]), str(self.modes["name"].to_numpy()[mode]))


def analysed(
    signals: RunSignals,
    lines: Sequence[OrderLine],
    modes: xr.Dataset | None = None,
    window_length: float | None = None,
) -> VariantRun:
    """Compute the waterfall of a run-up that was read, and pick its resonances; arguments as in `read_run`."""
    spectra = signals.waterfall(window_length)
    return VariantRun(signals.path, signals.attributes, spectra, pick_resonances(spectra, lines), modes)


# Comparison of two run-ups: resonances that occur in only one of them


@dataclass(frozen=True)
class AbsenceRule:
    """Rule by which a peak of one run counts as absent from another run."""

    prominence: float = 3.0
    """The other run has no peak of this prominence, dB, on the same order line within the resolution."""
    margin: float = 6.0
    """In addition, its level at this frequency is lower by at least this amount, dB."""

    @property
    def description(self) -> str:
        """The rule as text, for captions."""
        return (
            f"no peak of {self.prominence:g} dB prominence on the same order within the resolution, "
            f"and a level at least {self.margin:g} dB lower"
        )


def only_in_first(picks: Iterable[Pick], other: Waterfall, rule: AbsenceRule | None = None) -> tuple[Pick, ...]:
    """Select the peaks of one run that are absent from another run, by the thresholds of a rule.

    Returns
    -------
    peaks that satisfy the rule; peaks at which the second run has no data do not satisfy it
    """
    stated = rule or AbsenceRule()
    asked = tuple(picks)
    peaks = {line: peaks_on_line(other, line, stated.prominence) for line in {pick.line for pick in asked}}
    return tuple(pick for pick in asked if _is_absent(pick, other, peaks[pick.line], stated))


def _is_absent(pick: Pick, other: Waterfall, peaks: Sequence[Pick], rule: AbsenceRule) -> bool:
    """Return whether a peak is absent from another run with the given peaks on the same order line."""
    frequency = pick.line.frequency(other.speed)
    level = other.along(pick.line)
    near = np.isfinite(level) & (np.abs(frequency - pick.frequency) <= pick.resolution)
    if not np.any(near):
        return False
    same_place = any(are_indistinct(peak, pick) for peak in peaks)
    return not same_place and float(level[near].max()) <= pick.level - rule.margin


@dataclass(frozen=True)
class Comparison(ReprMixin):
    """Run-ups of two variants with the same mesh model, inertia set and load case."""

    first: VariantRun
    second: VariantRun
    """The first run is that of the more compliant variant; the main question is which of its resonances the second
    lacks.
    """
    rule: AbsenceRule
    """Rule by which a peak counts as absent."""

    def _line(self) -> str:
        counts = f"only first {len(self.only_first)}, only second {len(self.only_second)}"
        return f" {shorten(self._title, 130)}: {counts}"

    def _table(self) -> TitledRows:
        rows = {
            f"only {run.variant}": ", ".join(f"{finding.resonance.frequency:.0f} Hz" for finding in findings) or "none"
            for run, findings in ((self.first, self.only_first), (self.second, self.only_second))
        }
        return self._title, rows | {"rule": self.rule.description}

    @property
    def _title(self) -> str:
        return f"{self.first.variant} with {self.second.variant}, {self.first.conditions}"

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the highest level of both runs over speed, with circles at resonances that are absent from the other.

        Parameters
        ----------
        ax : matplotlib axes; by default new ones, whose ``ax.figure`` can be shown and saved
        """
        only = {self.first.variant: self.only_first, self.second.variant: self.only_second}
        marks = {name: [finding.strongest for finding in findings] for name, findings in only.items()}
        return draw_highest_levels({run.variant: run.spectra for run in self.runs}, marks, ax)

    @cached_property
    def only_first(self) -> tuple[Finding, ...]:
        """Resonances of the first run whose highest peak is absent from the second."""
        return self._lacking(self.first, self.second)

    @cached_property
    def only_second(self) -> tuple[Finding, ...]:
        """Resonances of the second run whose highest peak is absent from the first."""
        return self._lacking(self.second, self.first)

    def _lacking(self, run: VariantRun, other: VariantRun) -> tuple[Finding, ...]:
        # The highest peak decides for the whole resonance, because a weak order may be absent although the highest is
        # not.
        absent = set(only_in_first((finding.strongest for finding in run.findings()), other.spectra, self.rule))
        return tuple(finding for finding in run.findings() if finding.strongest in absent)

    @property
    def runs(self) -> tuple[VariantRun, VariantRun]:
        """Both runs, that of the stiffer variant first, as pictures show them."""
        return self.second, self.first


def compare(first: VariantRun, second: VariantRun, rule: AbsenceRule | None = None) -> Comparison:
    """Compare two run-ups.

    Raises
    ------
    ValueError
        The runs differ in more than the variant, or were analysed with different windows.
    """
    for key in ("gearbox", "load_case", "method", "mesh_model", "inertias"):
        values = first.attributes.get(key), second.attributes.get(key)
        if values[0] != values[1]:
            raise ValueError(f"runs to compare differ in {key}: {values[0]!r} and {values[1]!r}")
    if not math.isclose(first.spectra.window_length, second.spectra.window_length, rel_tol=1e-9):
        raise ValueError("runs to compare were analysed with windows of different length")
    return Comparison(first, second, rule or AbsenceRule())


# Resonances for other window lengths: results that depend on the window are not properties of the gearbox

WINDOW_FACTORS = (0.94, 0.98, 1.02, 1.06)
"""Factors on the suitable window length."""


@dataclass(frozen=True)
class OtherWindow:
    """Peaks of the compared runs for another window length."""

    picks: Mapping[str, tuple[Pick, ...]]
    """Peaks of each run, by variant."""
    absent: Mapping[tuple[str, str], tuple[Pick, ...]]
    """Peaks of a variant that are absent from the other variant, by (variant, other variant)."""


def other_windows(runs: Sequence[VariantRun], lines: Sequence[OrderLine]) -> tuple[OtherWindow, ...]:
    """Find the resonances of runs of different variants with other windows; the memory holds one length at a time.

    Raises
    ------
    FileError
        A run is missing or damaged.
    """
    signals = {run.variant: run_signals(run.path) for run in runs}
    windows = []
    for factor in WINDOW_FACTORS:
        length = factor * runs[0].spectra.window_length
        spectra = {variant: signal.waterfall(length) for variant, signal in signals.items()}
        picks = {variant: pick_resonances(spectrum, lines) for variant, spectrum in spectra.items()}
        absent = {
            (variant, other): only_in_first(picks[variant], spectra[other])
            for variant, other in itertools.permutations(spectra, 2)
        }
        windows.append(OtherWindow(picks, absent))
    return tuple(windows)


def is_among(pick: Pick, picks: Iterable[Pick]) -> bool:
    """Return whether a peak is among others: on the same order, within the larger of both resolutions.

    Examples
    --------
    >>> line = OrderLine("mesh", 20.0)
    >>> peak = Pick(line, 1.0, 10.0, 600.0, 20.0, 9.0, 15.0)
    >>> is_among(peak, [Pick(line, 1.1, 10.2, 610.0, 20.5, 7.0, 14.0)]), is_among(peak, [])
    (True, False)
    """
    return any(other.line.name == pick.line.name and are_indistinct(other, pick) for other in picks)


def survives(pick: Pick, variant: str, windows: Iterable[OtherWindow]) -> bool:
    """Return whether a peak of a variant occurs for every window length."""
    return all(is_among(pick, window.picks[variant]) for window in windows)


def stays_absent(pick: Pick, variant: str, other: str, windows: Iterable[OtherWindow]) -> bool:
    """Return whether a peak of a variant occurs and is absent from the other variant for every window length."""
    return all(is_among(pick, window.absent[variant, other]) for window in windows)
