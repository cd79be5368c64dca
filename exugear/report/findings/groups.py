"""Results of one source, mesh law and inertia set: their resonances ranked, and what only one variant shows.

A source is the run-ups of a load case, or the steady responses of a level.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.variant import OFFERED, Variant
from exugear.report.findings.constant_speed import (
    ConstantSpeed,
    Highest,
    highest_drawn,
    is_over_speed,
    response_spectra,
    truest_of,
    truest_response,
)
from exugear.report.findings.context import REFERENCE_VARIANT, Context, choice_of
from exugear.report.findings.loudness import Ranking, ranking_of
from exugear.report.findings.stored import StoredResults, run_key
from exugear.results.spectra.comparison import AbsenceRule, Comparison, compare, only_in_first
from exugear.results.spectra.line_spectra import line_peaks
from exugear.results.spectra.orders import order_lines
from exugear.results.spectra.resonances import Pick, pick_resonances
from exugear.results.spectra.run_spectra import Finding, VariantRun
from exugear.results.spectra.waterfall import Waterfall
from exugear.results.spectra.windows import OtherWindow, other_windows, stays_absent, survives
from exugear.steady.campbell.campbell import campbell_from
from exugear.steady.steady_file import settings_of, steady_path


@dataclass(frozen=True)
class RankedResonance:
    """A resonance of a run-up or a steady response, judged."""

    finding: Finding
    steady: bool
    """Whether windows of other lengths show it, too. What one window alone shows is no fact about the gearbox."""
    lacking: tuple[str, ...]
    """Variants that lack it, judged at its loudest peak and with every window."""
    elsewhere: Mapping[str, float]
    """By variant, highest level (dB) of the other variants at its loudest peak; NaN where they did not go there."""
    constant: Highest | None
    """Its loudest peak at constant speed; None where no steady response goes there."""

    @property
    def peak(self) -> Pick:
        """Its loudest peak."""
        return self.finding.strongest

    @property
    def loudness(self) -> float:
        """Level (dB) that it is ranked by: at constant speed where that is known, else in the run-up."""
        if self.constant is None:
            return self.peak.level
        return self.constant.level

    @property
    def frequency(self) -> float:
        """Frequency where it is loudest, Hz."""
        if self.constant is None:
            return self.finding.resonance.frequency
        return self.constant.frequency

    @property
    def speed(self) -> float:
        """Speed of the input where it is loudest, without sign, rad/s."""
        if self.constant is None:
            return abs(self.peak.speed)
        return self.constant.speed

    @property
    def missed(self) -> float:
        """By how many dB the run-up shows it below its level at constant speed; 0 where that is not known."""
        if self.constant is None:
            return 0.0
        return self.constant.level - self.peak.level


@dataclass(frozen=True)
class RunGroup:
    """Run-ups, or steady responses, that differ in the variant alone."""

    source: str
    """Where the figures are from, in words: the run-up of a load case, or constant speed at a level."""
    mesh_law: str
    inertias: str
    runs: Mapping[str, VariantRun]
    """By variant, the stiffest first."""
    ranked: Mapping[str, tuple[RankedResonance, ...]]
    """By variant, the loudest first."""
    comparisons: Mapping[str, Comparison]
    """By variant, of each other variant with the stiff reference."""
    constant: Mapping[str, ConstantSpeed]
    """By variant, levels at constant speed of run-ups that have a steady response."""
    responses: Mapping[str, xr.Dataset] = field(default_factory=dict)
    """By variant, steady responses that the group is made of; none where it is made of run-ups."""
    in_operation: Ranking | None = None
    """Resonances of the main variant's steady response at speeds of operation, by three quantities; None without
    one."""

    @property
    def name(self) -> str:
        """Name for files and links."""
        return f"{self.source.replace(', ', '_').replace(' ', '_')}-{self.mesh_law}-{self.inertias}"

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
        return f"{self.source}, law {self.mesh_law}, inertias {self.inertias}, housing factor {', '.join(factors)}"


def groups_of(context: Context, results: StoredResults) -> tuple[RunGroup, ...]:
    """Gather the run-ups of a folder, then its steady responses over a range of speeds.

    Of each the default inertia set comes first. What is read out of run-ups is read out of the lines of responses: the
    same orders, the same rules.
    """
    runs: dict[tuple[str, str, str], list[VariantRun]] = {}
    for run in results.runs:
        runs.setdefault(run_key(run.attributes), []).append(run)
    responses: dict[tuple[str, str, str], dict[str, xr.Dataset]] = {}
    for data in filter(is_over_speed, results.steady):
        key = str(data.attrs["level"]), str(data.attrs["mesh_law"]), str(data.attrs["inertias"])
        responses.setdefault(key, {})[str(data.attrs["variant"])] = data
    default = context.gearbox.case.default_inertias

    def rank(key: tuple[str, str, str]) -> tuple[bool, tuple[str, str, str]]:
        return key[2] != default, key

    return (
        *(_of_runs(context, key, runs[key], results) for key in sorted(runs, key=rank)),
        *(_of_responses(context, key, responses[key], results) for key in sorted(responses, key=rank)),
    )


def _of_runs(
    context: Context, key: tuple[str, str, str], runs: Sequence[VariantRun], results: StoredResults
) -> RunGroup:
    context.tell(f"other windows, {', '.join(key)}")
    by_variant = {run.variant: run for run in sorted(runs, key=lambda run: OFFERED.index(Variant.of(run.variant)))}
    windows = other_windows(list(by_variant.values()), order_lines(context.gearbox))
    levels = {variant: truest_of(results.steady, Choice(variant, *key[1:])) for variant in by_variant}
    constant = {variant: level for variant, level in levels.items() if level is not None}
    response = truest_response(results.steady, Choice(list(by_variant)[-1], *key[1:]))
    loud = response if response is not None and is_over_speed(response) else None
    return _group(f"run-up {key[0]}", key, by_variant, windows, constant, {}, loud)


def _of_responses(
    context: Context, key: tuple[str, str, str], responses: Mapping[str, xr.Dataset], results: StoredResults
) -> RunGroup:
    context.tell(f"lines at constant speed, {', '.join(key)}")
    own = {str(variant): responses[variant] for variant in OFFERED if variant in responses}
    runs = {variant: _as_run(context, data, results) for variant, data in own.items()}
    return _group(f"constant speed, level {key[0]}", key, runs, (), {}, own, list(own.values())[-1])


def _group(
    source: str,
    key: tuple[str, str, str],
    runs: Mapping[str, VariantRun],
    windows: Sequence[OtherWindow],
    constant: Mapping[str, ConstantSpeed],
    responses: Mapping[str, xr.Dataset],
    loud: xr.Dataset | None,
) -> RunGroup:
    """Group of run-ups, or of steady responses taken as such; `loud` is what is ranked by three quantities."""
    ranked = {name: _ranked(runs, name, windows, constant.get(name), responses.get(name)) for name in runs}
    reference = runs.get(REFERENCE_VARIANT)
    others = {variant: run for variant, run in runs.items() if run is not reference}
    comparisons = {} if reference is None else {name: compare(run, reference) for name, run in others.items()}
    in_operation = None if loud is None else ranking_of(loud)
    return RunGroup(source, *key[1:], runs, ranked, comparisons, constant, responses, in_operation)


def _as_run(context: Context, data: xr.Dataset, results: StoredResults) -> VariantRun:
    """Take a steady response as a run-up: its lines as spectra, its peaks as picks."""
    choice = choice_of(data.attrs)
    spectra = response_spectra(data, ("overall_dte",), highest_drawn(context.gearbox, data))
    picks = pick_resonances(spectra, order_lines(context.gearbox), peaks=line_peaks)
    path = steady_path(context.folder, choice, settings_of(data.attrs))
    return VariantRun(path, data.attrs, spectra, picks, results.modes.get(choice))


def _ranked(
    runs: Mapping[str, VariantRun],
    variant: str,
    windows: Sequence[OtherWindow],
    constant: ConstantSpeed | None,
    response: xr.Dataset | None,
) -> tuple[RankedResonance, ...]:
    """Resonances of a variant, judged; of a steady response there are no windows, and none is needed."""
    run = runs[variant]
    rule = AbsenceRule()
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
        elif response is not None:
            finding = _named(finding, response) if run.modes is None else run.located(finding, peak.frequency)
        ranked.append(RankedResonance(finding, survives(peak, variant, windows), lacking, elsewhere, level))
    return tuple(sorted(ranked, key=lambda own: -own.loudness))


def _named(finding: Finding, data: xr.Dataset) -> Finding:
    """Name the mode of a resonance by those that the response followed over speed, where no others were computed."""
    diagram = campbell_from(data)
    peak = finding.strongest
    sense = 1.0 if float(data["speed"][0]) >= 0.0 else -1.0
    mode = diagram.mode_at(sense * peak.speed, peak.frequency)
    if mode is None:
        return finding
    frequency = float(np.interp(sense * peak.speed, diagram.speeds, diagram.frequency[:, mode]))
    return Finding(finding.resonance, None, frequency, diagram.names[mode])


def _level_at(spectra: Waterfall, peak: Pick) -> float:
    near = np.abs(peak.line.frequency(spectra.speed) - peak.frequency) <= peak.resolution
    level = spectra.along(peak.line)[near]
    if np.isfinite(level).any():
        return float(np.max(level, initial=-np.inf, where=np.isfinite(level)))
    return float("nan")
