"""Run-ups of one load case, mesh law and inertia set: their resonances ranked, and what only one variant shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from exugear.findings.constant_speed import ConstantSpeed, Highest, truest_of
from exugear.findings.context import REFERENCE_VARIANT, Context
from exugear.findings.stored import StoredResults, run_key
from exugear.model.choice import Choice
from exugear.spectra.comparison import AbsenceRule, Comparison, compare, only_in_first
from exugear.spectra.orders import order_lines
from exugear.spectra.resonances import Pick
from exugear.spectra.run_spectra import Finding, VariantRun
from exugear.spectra.waterfall import Waterfall
from exugear.spectra.windows import OtherWindow, other_windows, stays_absent, survives

STIFF_TO_SOFT = ("rigid", "bushing", "flexible")
"""Variants in the order in which they are shown."""


@dataclass(frozen=True)
class RankedResonance:
    """A resonance of a run-up, judged.

    Attributes
    ----------
    finding : Finding
    steady : bool
        Whether windows of other lengths show it, too. What one window alone shows is no fact about the gearbox.
    lacking : tuple of str
        Variants that lack it, judged at its loudest peak and with every window.
    elsewhere : mapping of variant to float
        Highest level (dB) of the other variants at its loudest peak; NaN where they did not go there.
    constant : Highest or None
        Its loudest peak at constant speed; None where no steady response goes there.
    """

    finding: Finding
    steady: bool
    lacking: tuple[str, ...]
    elsewhere: Mapping[str, float]
    constant: Highest | None

    @property
    def peak(self) -> Pick:
        """Its loudest peak."""
        return self.finding.strongest

    @property
    def loudness(self) -> float:
        """Level (dB) that it is ranked by: at constant speed where that is known, else in the run-up."""
        return self.peak.level if self.constant is None else self.constant.level

    @property
    def frequency(self) -> float:
        """Frequency where it is loudest, Hz."""
        return self.finding.resonance.frequency if self.constant is None else self.constant.frequency

    @property
    def speed(self) -> float:
        """Speed of the input where it is loudest, without sign, rad/s."""
        return abs(self.peak.speed) if self.constant is None else self.constant.speed

    @property
    def missed(self) -> float:
        """By how many dB the run-up shows it below its level at constant speed; 0 where that is not known."""
        return 0.0 if self.constant is None else self.constant.level - self.peak.level


@dataclass(frozen=True)
class RunGroup:
    """Run-ups that differ in the variant alone.

    Attributes
    ----------
    load_case, mesh_law, inertias : str
    runs : mapping of variant to VariantRun
        The stiffest first.
    ranked : mapping of variant to tuple of RankedResonance
        The loudest first.
    comparisons : mapping of variant to Comparison
        Of each other variant with the stiff reference.
    constant : mapping of variant to ConstantSpeed
        Levels at constant speed of those that have a steady response.
    """

    load_case: str
    mesh_law: str
    inertias: str
    runs: Mapping[str, VariantRun]
    ranked: Mapping[str, tuple[RankedResonance, ...]]
    comparisons: Mapping[str, Comparison]
    constant: Mapping[str, ConstantSpeed]

    @property
    def name(self) -> str:
        """Name for files and links."""
        return f"{self.load_case}-{self.mesh_law}-{self.inertias}"

    @property
    def main(self) -> str:
        """Variant that is told of first: the one that leaves least out."""
        return list(self.runs)[-1]

    @property
    def loudest(self) -> RankedResonance | None:
        """Loudest resonance of the main variant that every window shows."""
        return next((own for own in self.ranked[self.main] if own.steady), None)

    def choice(self, variant: str) -> Choice:
        """Choice that a run was computed of."""
        return Choice(variant, self.mesh_law, self.inertias)

    @property
    def title(self) -> str:
        """What its runs have in common, in words."""
        factors = sorted({f"{float(run.attributes['housing_factor']):g}" for run in self.runs.values()})
        return (
            f"load case {self.load_case}, law {self.mesh_law}, inertias {self.inertias}, "
            f"housing factor {', '.join(factors)}"
        )


def run_groups(context: Context, results: StoredResults) -> tuple[RunGroup, ...]:
    """Gather the run-ups of a folder, those of the default inertia set first."""
    gathered: dict[tuple[str, str, str], list[VariantRun]] = {}
    for run in results.runs:
        gathered.setdefault(run_key(run.attributes), []).append(run)
    default = context.gearbox.case.default_inertias
    keys = sorted(gathered, key=lambda key: (key[2] != default, key))
    return tuple(_group(context, key, gathered[key], results) for key in keys)


def _group(context: Context, key: tuple[str, str, str], runs: Sequence[VariantRun], results: StoredResults) -> RunGroup:
    lines = order_lines(context.gearbox)
    context.tell(f"other windows, {', '.join(key)}")
    ordered = sorted(runs, key=lambda run: STIFF_TO_SOFT.index(run.variant))
    windows = other_windows(ordered, lines)
    by_variant = {run.variant: run for run in ordered}
    levels = {variant: truest_of(results.steady, Choice(variant, *key[1:])) for variant in by_variant}
    constant = {variant: own for variant, own in levels.items() if own is not None}
    ranked = {variant: _ranked(by_variant, variant, windows, levels[variant]) for variant in by_variant}
    reference = by_variant.get(REFERENCE_VARIANT)
    comparisons = {
        variant: compare(run, reference)
        for variant, run in by_variant.items()
        if reference is not None and run is not reference
    }
    return RunGroup(*key, by_variant, ranked, comparisons, constant)


def _ranked(
    runs: Mapping[str, VariantRun], variant: str, windows: Sequence[OtherWindow], constant: ConstantSpeed | None
) -> tuple[RankedResonance, ...]:
    run, rule = runs[variant], AbsenceRule()
    others = {name: other.spectra for name, other in runs.items() if name != variant}
    ranked = []
    for finding in run.findings():
        peak = finding.strongest
        lacking = tuple(
            name
            for name, spectra in others.items()
            if only_in_first([peak], spectra, rule) and stays_absent(peak, variant, name, windows)
        )
        elsewhere = {name: _level_at(spectra, peak) for name, spectra in others.items()}
        level = None if constant is None else constant.near(peak.line, peak.frequency, peak.resolution)
        if level is not None:
            finding = run.located(finding, level.frequency)
        ranked.append(RankedResonance(finding, survives(peak, variant, windows), lacking, elsewhere, level))
    return tuple(sorted(ranked, key=lambda own: -own.loudness))


def _level_at(spectra: Waterfall, peak: Pick) -> float:
    near = np.abs(peak.line.frequency(spectra.speed) - peak.frequency) <= peak.resolution
    level = spectra.along(peak.line)[near]
    return float(np.max(level, initial=-np.inf, where=np.isfinite(level))) if np.isfinite(level).any() else float("nan")
