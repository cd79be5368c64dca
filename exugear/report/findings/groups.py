"""Result groups of one source, mesh model and inertia set, with ranked resonances and differences between variants.

A source is the run-ups of a load case, or the steady-state responses of one method.

In a run-up, the member of a planet set with the largest force amplitude represents the set. In a steady-state
response, each multi-blade component (mean, cosine, sine) is a channel.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from exugear.gearbox.choice import Choice, choice_of
from exugear.gearbox.load_cases import operating_range
from exugear.gearbox.variant import OFFERED, Variant
from exugear.report.findings.context import (
    MESH_MODEL_LABELS,
    METHOD_LABELS,
    REFERENCE_VARIANT,
    Context,
    StoredResults,
    run_key,
)
from exugear.report.findings.ranking import (
    ConstantSpeed,
    OrderPeak,
    Ranking,
    Resonance,
    highest_drawn,
    is_over_speed,
    most_complete_levels,
    most_complete_response,
    ranking_of,
    ranking_of_errors,
    response_spectra,
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
from exugear.steady.settings import METHODS
from exugear.steady.steady_file import settings_of, steady_path
from fe_ste.tools.arrays import Floats

if TYPE_CHECKING:
    import xarray as xr

SAME_FREQUENCY = 0.01
"""Relative frequency difference within which a peak or a mode belongs to a resonance. For a mode it is at least its
damping ratio, half of the half-power bandwidth over the frequency."""


@dataclass(frozen=True)
class RankedResonance:
    """Resonance of a run-up or a steady-state response, with checks and comparison."""

    finding: Finding
    steady: bool
    """Whether it is found with all window lengths. A resonance seen with one window only may be an artefact."""
    lacking: tuple[str, ...]
    """Variants without this resonance, judged at its highest peak and with every window."""
    elsewhere: Mapping[str, float]
    """By variant, highest level (dB) of the other variants at its highest peak; NaN outside their speed range."""
    constant: OrderPeak | None
    """Its highest peak at constant speed; None without a steady-state response there."""

    @property
    def peak(self) -> Pick:
        """Highest peak."""
        return self.finding.strongest

    @property
    def ranking_level(self) -> float:
        """Level (dB) used for the ranking: at constant speed where available, otherwise in the run-up."""
        return self.peak.level if self.constant is None else self.constant.level

    @property
    def frequency(self) -> float:
        """Frequency of the highest peak, Hz."""
        return self.finding.resonance.frequency if self.constant is None else self.constant.frequency

    @property
    def speed(self) -> float:
        """Absolute input speed at the highest peak, rad/s."""
        return abs(self.peak.speed) if self.constant is None else self.constant.speed

    @property
    def missed(self) -> float:
        """Level at constant speed minus level in the run-up, dB; 0 if the former is unknown."""
        return 0.0 if self.constant is None else self.constant.level - self.peak.level


@dataclass(frozen=True)
class RunGroup:
    """Run-ups, or steady-state responses, that differ only in the variant."""

    source: str
    """Source of the values as text: the run-up of a load case, or constant speed with the method."""
    mesh_model: str
    inertias: str
    runs: Mapping[str, VariantRun]
    """By variant, the stiffest first."""
    ranked: Mapping[str, tuple[RankedResonance, ...]]
    """By variant, the highest first."""
    comparisons: Mapping[str, Comparison]
    """By variant, comparison of each other variant with the rigid reference."""
    constant: Mapping[str, ConstantSpeed]
    """By variant, levels at constant speed of run-ups that have a steady-state response."""
    responses: Mapping[str, xr.Dataset] = field(default_factory=dict)
    """By variant, the steady-state responses of the group; empty for run-ups."""
    in_operation: Ranking = field(kw_only=True)
    """Resonances of the main variant in the operating range: those of its steady-state response, ranked by three
    quantities, or else those of the run-up."""
    rankings: Mapping[str, Ranking] = field(kw_only=True)
    """By variant, resonances in the operating range: of its steady-state response, or of the run-up alone."""
    response: xr.Dataset | None = field(kw_only=True)
    """Steady-state response of the main variant that they are from; None if they are from the run-up."""

    @property
    def name(self) -> str:
        """Name for files and links."""
        return f"{re.sub(r'[^a-z0-9]+', '_', self.source.lower())}-{self.mesh_model}-{self.inertias}"

    @property
    def main(self) -> str:
        """Variant that is reported first: the one with the fewest simplifications."""
        return list(self.runs)[-1]

    @property
    def loudest(self) -> RankedResonance | None:
        """Highest resonance of the main variant that is found with all window lengths."""
        return next((own for own in self.ranked[self.main] if own.steady), None)

    def shown_peak(self, own: RankedResonance) -> Pick:
        """Return the peak by which a resonance is shown: that of the headline, or the highest in the operating range.

        A mode has a peak for each order that excites it; several of them may be outside the range. Without a peak
        inside, it is the highest of all.
        """
        picks = own.finding.resonance.picks
        top = next(iter(self.in_operation.resonances), None)
        if leading := next((pick for pick in picks if top is not None and is_peak_of(pick, top)), None):
            return leading
        low, high = self.in_operation.speeds
        inside = [pick for pick in picks if low <= abs(pick.speed) <= high]
        return max(inside, key=lambda pick: pick.level, default=own.peak)

    def choice(self, variant: str) -> Choice:
        """Return the model settings of a run."""
        return Choice(variant, self.mesh_model, self.inertias)

    @property
    def title(self) -> str:
        """Common properties of its runs as text."""
        factors = sorted({f"{float(run.attributes['housing_factor']):g}" for run in self.runs.values()})
        return (
            f"{self.source}, {MESH_MODEL_LABELS[self.mesh_model]}, inertia set {self.inertias}, housing stiffness "
            f"factor {', '.join(factors)}"
        )


def is_peak_of(peak: Pick, resonance: Resonance) -> bool:
    """Return whether a peak of the transmission error is that of a ranked resonance: same order, same frequency."""
    return math.isclose(peak.line.order, resonance.order, rel_tol=1e-6) and math.isclose(
        peak.frequency, resonance.frequency, rel_tol=SAME_FREQUENCY
    )


def groups_of(context: Context, results: StoredResults) -> tuple[RunGroup, ...]:
    """Group the steady-state responses and the run-ups of a folder, the most informative first.

    The default inertia set comes first, and constant speed before run-ups. Steady-state responses are evaluated along
    the same orders and by the same rules as run-ups.
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

    groups = (
        *(_group_responses(context, key, responses[key], results) for key in sorted(responses, key=rank)),
        *(_group_runs(context, key, runs[key], results) for key in sorted(runs, key=rank)),
    )
    return tuple(sorted(groups, key=lambda group: _priority(group, default)))


def _priority(group: RunGroup, default: str) -> tuple[bool, bool, int, int]:
    """Return the sort key of a group: default inertia set, constant speed, fewest simplifications, best method."""
    method = "" if group.response is None else str(group.response.attrs["method"])
    return (
        group.inertias != default,
        not group.responses,
        -OFFERED.index(Variant.of(group.main)),
        -METHODS.index(method) if group.responses else 0,
    )


def _group_runs(
    context: Context, key: tuple[str, str, str], runs: Sequence[VariantRun], results: StoredResults
) -> RunGroup:
    context.tell(f"other windows, {', '.join(key)}")
    by_variant = {run.variant: run for run in sorted(runs, key=lambda run: OFFERED.index(Variant.of(run.variant)))}
    windows = other_windows(list(by_variant.values()), order_lines(context.gearbox))
    levels = {variant: most_complete_levels(results.steady, Choice(variant, *key[1:])) for variant in by_variant}
    constant = {variant: level for variant, level in levels.items() if level is not None}
    response = most_complete_response(results.steady, Choice(list(by_variant)[-1], *key[1:]))
    loud = response if response is not None and is_over_speed(response) else None
    return _group(context, f"run-up {key[0]}", key, by_variant, windows, constant, {}, loud)


def _group_responses(
    context: Context, key: tuple[str, str, str], responses: Mapping[str, xr.Dataset], results: StoredResults
) -> RunGroup:
    context.tell(f"orders at constant speed, {', '.join(key)}")
    own = {str(variant): responses[variant] for variant in OFFERED if variant in responses}
    runs = {variant: _spectra_of_response(context, data, results) for variant, data in own.items()}
    return _group(context, f"constant speed, {METHOD_LABELS[key[0]]}", key, runs, (), {}, own, list(own.values())[-1])


def _group(
    context: Context,
    source: str,
    key: tuple[str, str, str],
    runs: Mapping[str, VariantRun],
    windows: Sequence[OtherWindow],
    constant: Mapping[str, ConstantSpeed],
    responses: Mapping[str, xr.Dataset],
    loud: xr.Dataset | None,
) -> RunGroup:
    """Return a group of run-ups, or of steady-state responses; `loud` is the response to rank."""
    ranked = {name: _ranked(runs, name, windows, constant.get(name), responses.get(name)) for name in runs}
    reference = runs.get(REFERENCE_VARIANT)
    others = {variant: run for variant, run in runs.items() if run is not reference}
    comparisons = {} if reference is None else {name: compare(run, reference) for name, run in others.items()}
    main = list(runs)[-1]
    stated = operating_range(context.gearbox)
    wanted = context.gearbox.case.report.quantity
    rankings = {name: _in_operation(runs[name], ranked[name], responses.get(name), stated, wanted) for name in runs}
    return RunGroup(
        source,
        *key[1:],
        runs,
        ranked,
        comparisons,
        constant,
        responses,
        in_operation=rankings[main] if responses else _in_operation(runs[main], ranked[main], loud, stated, wanted),
        rankings=rankings,
        response=loud,
    )


def _in_operation(
    run: VariantRun,
    ranked: Sequence[RankedResonance],
    response: xr.Dataset | None,
    stated: tuple[float, float] | None,
    wanted: str | None,
) -> Ranking:
    """Rank the resonances of a response, or else of a run-up, in the operating range, or at all speeds without any."""
    speed = run.spectra.speed

    def within(speeds: tuple[float, float] | None) -> Ranking:
        if response is not None:
            return ranking_of(response, speeds, wanted)
        peaks = [
            (own.peak.line, own.speed, own.frequency, 1e-6 * 10.0 ** (own.peak.level / 20.0))
            for own in ranked
            if own.steady
        ]
        return ranking_of_errors(peaks, speed, speeds)

    found = within(stated)
    if found.resonances or found.whole:
        return found
    return replace(within((float(speed.min()), float(speed.max()))), whole=True, without=found.speeds)


def _spectra_of_response(context: Context, data: xr.Dataset, results: StoredResults) -> VariantRun:
    """Represent a steady-state response as a run-up: its orders as spectra, its peaks as picks."""
    choice = choice_of(data.attrs)
    ranking = ranking_of(data, operating_range(context.gearbox), context.gearbox.case.report.quantity)
    spectra = response_spectra(data, ("overall_dte",), highest_drawn(context.gearbox, data, ranking))
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
    """Return the resonances of a variant with checks; steady-state responses need no comparison of windows."""
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
    return tuple(sorted(ranked, key=lambda own: -own.ranking_level))


def _named(finding: Finding, data: xr.Dataset) -> Finding:
    """Add to a resonance the mode that the response tracked over speed, if modes were not computed separately."""
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
    known = level[np.isfinite(level)]
    return float(known.max()) if known.size else math.nan


# Channels in addition to the overall transmission error: forces of bearings, joints and meshes, from either source

OVERLAP = 0.5
"""Overlap of successive windows, as a fraction; sufficient for waterfalls coarser than that of the TE."""
SAMPLED = 8
"""Stride of the samples from which force amplitudes are estimated."""
AXIAL = "z"
"""Axis of the axial force of a bearing."""

_Signals = Mapping[str, NDArray[Any]]
"""Variables of a run by name."""


UNITS = {"coupling": "N m", "body": "rad/s"}
"""Units of channels; of all others N."""


@dataclass(frozen=True)
class Channel:
    """Signal of a run-up or a steady-state response with its waterfall."""

    name: str
    """Name of the bearing, joint, mesh or coupling, or of a body after ``speed``."""
    kind: str
    """{"support", "mesh", "coupling", "body"}"""
    words: str
    copies: int
    """Number of equal parts that it represents."""
    mean: float
    """Mean over the middle third of the run; for bearings that revolve with a carrier, the mean magnitude. NaN for a
    steady-state response, which has dynamic parts only."""
    axial: float
    """Mean axial force of a bearing over the same time, N; NaN for a mesh and for a steady-state response."""
    spectra: Waterfall
    """For a support, the root sum square of both transverse forces."""


@dataclass(frozen=True)
class DominantOrder:
    """Highest peak of a channel along the orders."""

    line: OrderLine
    amplitude: float
    """In units of the channel."""
    speed: float
    frequency: float
    """rad/s, Hz."""


def channels_of(run: VariantRun, words: Labels, response: xr.Dataset | None) -> Iterator[Channel]:
    """Compute the channels of a run-up, or of the steady-state response it represents, bearings and joints first.

    Torques of couplings and speeds of the bodies that these connect are among them.
    """
    if response is not None:
        yield from _lines(response, words, float(run.spectra.frequency[-1]))
        return
    data, _ = read_run(run.path, ("time", "input_speed", "support", "mesh", "mesh_force", "support_force"))
    yield from _supports(data, run, words)
    yield from _meshes(data, run, words)
    if words.coupled:
        data, _ = read_run(run.path, ("time", "input_speed", "coupling", "body", "coupling_torque", "body_speed"))
        yield from _couplings(data, run, words)


def _couplings(data: _Signals, run: VariantRun, words: Labels) -> Iterator[Channel]:
    bodies = [name for name in map(str, data["body"]) if name in words.coupled]
    columns = {"coupling": list(map(str, data["coupling"])), "body": list(map(str, data["body"]))}
    for kind, signal, names in (("coupling", "coupling_torque", columns["coupling"]), ("body", "body_speed", bodies)):
        for name in names:
            own = np.ascontiguousarray(data[signal][:, columns[kind].index(name)])
            spectra = _waterfall(own, data, run, UNITS[kind])
            yield Channel(_key(kind, name), kind, words.of(name), 1, float(_middle(own).mean()), math.nan, spectra)


def _key(kind: str, name: str) -> str:
    """Name of a channel; bodies and couplings may share one."""
    return f"speed {name}" if kind == "body" else name


def _supports(data: _Signals, run: VariantRun, words: Labels) -> Iterator[Channel]:
    force = data["support_force"]
    names = [str(name) for name in data["support"]]
    sample = force[::SAMPLED]
    swings = np.hypot(sample[..., 0], sample[..., 1]).std(axis=0)
    for place, copies, label in _standing_for(names, swings, words):
        own = np.ascontiguousarray(force[:, place].T)
        parts = [_waterfall(own[axis], data, run) for axis in (0, 1)]
        whole = replace(parts[0], amplitude=np.hypot(parts[0].amplitude, parts[1].amplitude))
        middle = _middle(own.T.astype(np.float64))
        # The force of a revolving bearing has no mean in fixed axes.
        mean = max(math.hypot(*middle[:, :2].mean(axis=0)), 0.0)
        if copies > 1:
            mean = float(np.hypot(middle[:, 0], middle[:, 1]).mean())
        yield Channel(names[place], "support", label, copies, mean, float(middle[:, 2].mean()), whole)


def _meshes(data: _Signals, run: VariantRun, words: Labels) -> Iterator[Channel]:
    force = data["mesh_force"]
    names = [str(name) for name in data["mesh"]]
    for place, copies, label in _standing_for(names, force[::SAMPLED].std(axis=0), words):
        own = np.ascontiguousarray(force[:, place])
        mean = float(_middle(own).mean(dtype=np.float64))
        yield Channel(names[place], "mesh", f"mesh {label}", copies, mean, math.nan, _waterfall(own, data, run))


def _lines(response: xr.Dataset, words: Labels, highest: float) -> Iterator[Channel]:
    kinds = {"support_force": "support", "mesh_force": "mesh", "coupling_torque": "coupling", "body_speed": "body"}
    found: dict[str, dict[str, list[str]]] = {kind: {} for kind in kinds.values()}
    for name in map(str, response["signal"].to_numpy()):
        quantity, _, rest = name.partition(" ")
        place, _, axis = rest.rpartition(" ")
        if quantity == "support_force" and axis != AXIAL:
            found["support"].setdefault(place, []).append(name)
        elif quantity in ("mesh_force", "coupling_torque") or (quantity == "body_speed" and rest in words.coupled):
            found[kinds[quantity]][rest] = [name]
    for kind, places in found.items():
        for place, signals in places.items():
            spectra = response_spectra(response, signals, highest, 1.0, UNITS.get(kind, "N"))
            name, *wave = place.split(" ")
            label = " ".join([("mesh " if kind == "mesh" else "") + words.of(name), *wave])
            yield Channel(_key(kind, place), kind, label, 1, math.nan, math.nan, spectra)


def _standing_for(names: Sequence[str], swings: Floats, words: Labels) -> Iterator[tuple[int, int, str]]:
    """Yield the index of the channel that represents each family, the number of members, and the label."""
    families: dict[str, list[int]] = {}
    for place, name in enumerate(names):
        families.setdefault(words.family(name), []).append(place)
    for family, places in families.items():
        place = max(places, key=lambda place: float(swings[place]))
        yield place, len(places), words.of(family if len(places) > 1 else names[place])


def _middle(values: Floats) -> Floats:
    """Return the middle third of a run, without start-up and highest speeds, for mean forces."""
    third = len(values) // 3
    return values[third : 2 * third] if third else values


def _waterfall(values: Floats, data: _Signals, run: VariantRun, unit: str = "N") -> Waterfall:
    time = data["time"]
    speed = data["input_speed"]
    rate = (time.size - 1) / float(np.ptp(time))
    return waterfall(
        values, speed, rate, window_length=run.spectra.window_length, overlap=OVERLAP, reference=1.0, unit=unit
    )


def dominant_order(spectra: Waterfall, lines: Sequence[OrderLine]) -> DominantOrder | None:
    """Find the maximum of a waterfall along its orders; None where no order lies in its frequency band."""
    levels = np.array([spectra.along(line) for line in lines]).reshape(len(lines), spectra.time.size)
    if not np.isfinite(levels).any():
        return None
    line, frame = divmod(int(np.nanargmax(levels)), levels.shape[1])
    speed = float(spectra.speed[frame])
    return DominantOrder(
        lines[line],
        spectra.reference * 10.0 ** (float(levels[line, frame]) / 20.0),
        speed,
        float(lines[line].frequency(speed)),
    )
