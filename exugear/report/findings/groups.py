"""Results of one source, mesh law and inertia set: their resonances ranked, and what only one variant shows.

A source is the run-ups of a load case, or the steady responses of a level.

In a run-up one copy of a planet set stands for all: the one whose force swings most. In a steady response each wave
around the carrier is a channel: mean, cosine, sine.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from exugear.gearbox.choice import Choice
from exugear.gearbox.variant import OFFERED, Variant
from exugear.report.findings.context import REFERENCE_VARIANT, Context, StoredResults, choice_of, run_key
from exugear.report.findings.loudness import (
    ConstantSpeed,
    Highest,
    Ranking,
    highest_drawn,
    is_over_speed,
    ranking_of,
    response_spectra,
    truest_of,
    truest_response,
)
from exugear.report.findings.words import Labels
from exugear.results.run_file import read_run
from exugear.results.spectra.line_spectra import line_peaks
from exugear.results.spectra.resonances import Pick, pick_resonances
from exugear.results.spectra.run_spectra import (
    AbsenceRule,
    Comparison,
    Finding,
    OtherWindow,
    VariantRun,
    compare,
    only_in_first,
    other_windows,
    stays_absent,
    survives,
)
from exugear.results.spectra.waterfall import OrderLine, Waterfall, order_lines, waterfall
from exugear.steady.campbell import campbell_from
from exugear.steady.steady_file import settings_of, steady_path
from fe_ste.tools.arrays import Floats


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
    mesh_model: str
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
        return f"{self.source.replace(', ', '_').replace(' ', '_')}-{self.mesh_model}-{self.inertias}"

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
        return Choice(variant, self.mesh_model, self.inertias)

    @property
    def title(self) -> str:
        """What its runs have in common, in words."""
        factors = sorted({f"{float(run.attributes['housing_factor']):g}" for run in self.runs.values()})
        return (
            f"{self.source}, mesh model {self.mesh_model}, inertia set {self.inertias}, housing stiffness factor "
            f"{', '.join(factors)}"
        )


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
        key = str(data.attrs["method"]), str(data.attrs["mesh_model"]), str(data.attrs["inertias"])
        responses.setdefault(key, {})[str(data.attrs["variant"])] = data
    default = context.gearbox.case.default_inertias

    def rank(key: tuple[str, str, str]) -> tuple[bool, tuple[str, str, str]]:
        return key[2] != default, key

    return (
        *(_group_runs(context, key, runs[key], results) for key in sorted(runs, key=rank)),
        *(_group_responses(context, key, responses[key], results) for key in sorted(responses, key=rank)),
    )


def _group_runs(
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


def _group_responses(
    context: Context, key: tuple[str, str, str], responses: Mapping[str, xr.Dataset], results: StoredResults
) -> RunGroup:
    context.tell(f"orders at constant speed, {', '.join(key)}")
    own = {str(variant): responses[variant] for variant in OFFERED if variant in responses}
    runs = {variant: _spectra_of_response(context, data, results) for variant, data in own.items()}
    return _group(f"constant speed, method {key[0]}", key, runs, (), {}, own, list(own.values())[-1])


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


def _spectra_of_response(context: Context, data: xr.Dataset, results: StoredResults) -> VariantRun:
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


# Channels beside the overall transmission error: forces of bearings and joints, and of meshes, whichever source

OVERLAP = 0.5
"""Share of a window that the next one repeats: enough for what is drawn coarser than the transmission error."""
SAMPLED = 8
"""Every which sample tells how much a force swings."""
MEAN_PART = slice(1, 2)
"""Third of the run whose mean force is told: neither the start nor the fastest."""
AXIAL = "z"
"""Axis of a bearing's force that is not transverse."""

_Signals = Mapping[str, NDArray[Any]]
"""Variables of a run by their names."""


@dataclass(frozen=True)
class Channel:
    """A signal of a run-up or a steady response with its waterfall."""

    name: str
    """Of the bearing, joint or mesh."""
    kind: str
    """{"support", "mesh"}"""
    words: str
    """What it is."""
    copies: int
    """How many equal parts it stands for."""
    mean: float
    """Mean force over the middle third of the run, N; of bearings that go round with a carrier, of its magnitude.
    NaN of a steady response, which has what vibrates."""
    axial: float
    """Mean axial force of a bearing there, N; NaN for a mesh and of a steady response."""
    spectra: Waterfall
    """Of a support the root of the summed squares of both transverse forces."""


@dataclass(frozen=True)
class LoudestOrder:
    """Where a channel is loudest along the orders."""

    line: OrderLine
    amplitude: float
    """In the unit of the channel."""
    speed: float
    frequency: float
    """rad/s, Hz."""


def channels_of(run: VariantRun, words: Labels, response: xr.Dataset | None) -> Iterator[Channel]:
    """Compute the channels of a run-up, or of the steady response that it was made of, bearings and joints first."""
    if response is not None:
        yield from _lines(response, words, float(run.spectra.frequency[-1]))
        return
    data, _ = read_run(run.path, ("time", "input_speed", "support", "mesh", "mesh_force", "support_force"))
    yield from _supports(data, run, words)
    yield from _meshes(data, run, words)


def _supports(data: _Signals, run: VariantRun, words: Labels) -> Iterator[Channel]:
    force = data["support_force"]
    names = [str(name) for name in data["support"]]
    sample = force[::SAMPLED]
    swings = np.hypot(sample[..., 0], sample[..., 1]).std(axis=0)
    for place, copies in _standing_for(names, swings, words):
        own = np.ascontiguousarray(force[:, place].T)
        parts = [_waterfall(own[axis], data, run) for axis in (0, 1)]
        whole = replace(parts[0], amplitude=np.hypot(parts[0].amplitude, parts[1].amplitude))
        middle = _middle(own.T.astype(np.float64))
        # The force of a bearing that goes round has no mean in axes that stand still.
        mean = max(math.hypot(*middle[:, :2].mean(axis=0)), 0.0)
        if copies > 1:
            mean = float(np.hypot(middle[:, 0], middle[:, 1]).mean())
        told = words.of(words.family(names[place])) if copies > 1 else words.of(names[place])
        yield Channel(names[place], "support", told, copies, mean, float(middle[:, 2].mean()), whole)


def _meshes(data: _Signals, run: VariantRun, words: Labels) -> Iterator[Channel]:
    force = data["mesh_force"]
    names = [str(name) for name in data["mesh"]]
    for place, copies in _standing_for(names, force[::SAMPLED].std(axis=0), words):
        own = np.ascontiguousarray(force[:, place])
        told = words.of(words.family(names[place])) if copies > 1 else words.of(names[place])
        mean = float(_middle(own).mean(dtype=np.float64))
        yield Channel(names[place], "mesh", f"mesh {told}", copies, mean, math.nan, _waterfall(own, data, run))


def _lines(response: xr.Dataset, words: Labels, highest: float) -> Iterator[Channel]:
    supports: dict[str, list[str]] = {}
    meshes: dict[str, list[str]] = {}
    for name in map(str, response["signal"].to_numpy()):
        quantity, _, rest = name.partition(" ")
        place, _, axis = rest.rpartition(" ")
        if quantity == "support_force" and axis != AXIAL:
            supports.setdefault(place, []).append(name)
        elif quantity == "mesh_force":
            meshes[rest] = [name]
    for kind, before, places in (("support", "", supports), ("mesh", "mesh ", meshes)):
        for place, signals in places.items():
            spectra = response_spectra(response, signals, highest, 1.0, "N")
            name, *wave = place.split(" ")
            told = " ".join([before + words.of(name), *wave])
            yield Channel(place, kind, told, 1, math.nan, math.nan, spectra)


def _standing_for(names: Sequence[str], swings: Floats, words: Labels) -> list[tuple[int, int]]:
    """Place of the channel that stands for each family, and how many there are."""
    families: dict[str, list[int]] = {}
    for place, name in enumerate(names):
        families.setdefault(words.family(name), []).append(place)
    return [(max(family, key=lambda place: float(swings[place])), len(family)) for family in families.values()]


def _middle(values: Floats) -> Floats:
    third = len(values) // 3
    if third:
        return values[MEAN_PART.start * third : MEAN_PART.stop * third]
    return values


def _waterfall(values: Floats, data: _Signals, run: VariantRun) -> Waterfall:
    time = data["time"]
    speed = data["input_speed"]
    rate = (time.size - 1) / float(np.ptp(time))
    return waterfall(
        values, speed, rate, window_length=run.spectra.window_length, overlap=OVERLAP, reference=1.0, unit="N"
    )


def loudest_order(spectra: Waterfall, lines: Sequence[OrderLine]) -> LoudestOrder | None:
    """Find where a waterfall is loudest along its orders; None where no order lies in its band."""
    levels = np.array([spectra.along(line) for line in lines]).reshape(len(lines), spectra.time.size)
    if not np.isfinite(levels).any():
        return None
    line, frame = divmod(int(np.nanargmax(levels)), levels.shape[1])
    speed = float(spectra.speed[frame])
    return LoudestOrder(
        lines[line],
        spectra.reference * 10.0 ** (float(levels[line, frame]) / 20.0),
        speed,
        float(lines[line].frequency(speed)),
    )
