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
from exugear.report.findings.loudness.ranking import Ranking, ranking_of
from exugear.report.findings.stored import StoredResults, run_key
from exugear.results.spectra.comparison import AbsenceRule, Comparison, compare, only_in_first
from exugear.results.spectra.line_spectra import pick_line_peaks
from exugear.results.spectra.orders import order_lines
from exugear.results.spectra.resonances import Pick
from exugear.results.spectra.run_spectra import Finding, VariantRun
from exugear.results.spectra.waterfall import Waterfall
from exugear.results.spectra.windows import OtherWindow, other_windows, stays_absent, survives
from exugear.steady.campbell.campbell import campbell_from
from exugear.steady.steady_file import settings_of, steady_path


@dataclass(frozen=True)
class RankedResonance:
    """A resonance of a run-up or a steady response, judged.

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
    """Run-ups, or steady responses, that differ in the variant alone.

    Attributes
    ----------
    source : str
        Where the figures are from, in words: the run-up of a load case, or constant speed at a level.
    mesh_law, inertias : str
    runs : mapping of variant to VariantRun
        The stiffest first.
    ranked : mapping of variant to tuple of RankedResonance
        The loudest first.
    comparisons : mapping of variant to Comparison
        Of each other variant with the stiff reference.
    constant : mapping of variant to ConstantSpeed
        Levels at constant speed of run-ups that have a steady response.
    responses : mapping of variant to Dataset
        Steady responses that the group is made of; none where it is made of run-ups.
    in_operation : Ranking or None
        Resonances of the main variant's steady response at speeds of operation, by three quantities; None without one.
    """

    source: str
    mesh_law: str
    inertias: str
    runs: Mapping[str, VariantRun]
    ranked: Mapping[str, tuple[RankedResonance, ...]]
    comparisons: Mapping[str, Comparison]
    constant: Mapping[str, ConstantSpeed]
    responses: Mapping[str, xr.Dataset] = field(default_factory=dict)
    in_operation: Ranking | None = None

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
    ordered = sorted(runs, key=lambda run: OFFERED.index(Variant.of(run.variant)))
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
    response = truest_response(results.steady, Choice(ordered[-1].variant, *key[1:]))
    loud = None if response is None or not is_over_speed(response) else ranking_of(response)
    return RunGroup(f"run-up {key[0]}", *key[1:], by_variant, ranked, comparisons, constant, in_operation=loud)


def response_groups(context: Context, results: StoredResults) -> tuple[RunGroup, ...]:
    """Gather the steady responses of a folder that go over a range of speeds, those of the default inertia set first.

    What `run_groups` reads out of run-ups is read out of the lines of these: the same orders, the same rules.
    """
    gathered: dict[tuple[str, str, str], dict[str, xr.Dataset]] = {}
    for data in filter(is_over_speed, results.steady):
        key = str(data.attrs["level"]), str(data.attrs["mesh_law"]), str(data.attrs["inertias"])
        gathered.setdefault(key, {})[str(data.attrs["variant"])] = data
    default = context.gearbox.case.default_inertias
    keys = sorted(gathered, key=lambda key: (key[2] != default, key))
    return tuple(_response_group(context, key, gathered[key], results) for key in keys)


def _response_group(
    context: Context, key: tuple[str, str, str], responses: Mapping[str, xr.Dataset], results: StoredResults
) -> RunGroup:
    context.tell(f"lines at constant speed, {', '.join(key)}")
    own = {str(variant): responses[variant] for variant in OFFERED if variant in responses}
    runs = {variant: _as_run(context, data, results) for variant, data in own.items()}
    ranked = {variant: _ranked_lines(runs, own, variant) for variant in runs}
    reference, rule = runs.get(REFERENCE_VARIANT), AbsenceRule()
    others = {variant: run for variant, run in runs.items() if run is not reference}
    comparisons = {} if reference is None else {name: Comparison(run, reference, rule) for name, run in others.items()}
    loud = ranking_of(list(own.values())[-1])
    return RunGroup(f"constant speed, level {key[0]}", *key[1:], runs, ranked, comparisons, {}, own, loud)


def _as_run(context: Context, data: xr.Dataset, results: StoredResults) -> VariantRun:
    """Take a steady response as a run-up: its lines as spectra, its peaks as picks."""
    choice = choice_of(data.attrs)
    spectra = response_spectra(data, ("overall_dte",), highest_drawn(context.gearbox, data))
    picks = pick_line_peaks(spectra, order_lines(context.gearbox))
    path = steady_path(context.folder, choice, settings_of(data.attrs))
    return VariantRun(path, data.attrs, spectra, picks, results.modes.get(choice))


def _ranked_lines(
    runs: Mapping[str, VariantRun], responses: Mapping[str, xr.Dataset], variant: str
) -> tuple[RankedResonance, ...]:
    run, rule = runs[variant], AbsenceRule()
    others = {name: other.spectra for name, other in runs.items() if name != variant}
    ranked = []
    for own in run.findings():
        peak = own.strongest
        finding = _named(own, responses[variant]) if run.modes is None else run.located(own, peak.frequency)
        lacking = tuple(name for name, spectra in others.items() if only_in_first([peak], spectra, rule))
        elsewhere = {name: _level_at(spectra, peak) for name, spectra in others.items()}
        ranked.append(RankedResonance(finding, True, lacking, elsewhere, None))
    return tuple(sorted(ranked, key=lambda own: -own.loudness))


def _named(finding: Finding, data: xr.Dataset) -> Finding:
    """Name the mode of a resonance by those that the response followed over speed, where no others were computed."""
    diagram, peak = campbell_from(data), finding.strongest
    sense = 1.0 if float(data["speed"][0]) >= 0.0 else -1.0
    mode = diagram.mode_at(sense * peak.speed, peak.frequency)
    if mode is None:
        return finding
    frequency = float(np.interp(sense * peak.speed, diagram.speeds, diagram.frequency[:, mode]))
    return Finding(finding.resonance, None, frequency, diagram.names[mode])


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
