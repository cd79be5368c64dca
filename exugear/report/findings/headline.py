"""The resonance that a report leads with: its mode and its cause.

All statements are about the first resonance of one `Ranking`: that of the most informative steady-state response, or
else of a run-up, or else an estimate from modes and static transmission errors. `exugear.report.sections.answer` writes
the text about it, with the design changes that reduce it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.load_cases import operating_range
from exugear.gearbox.variant import Variant
from exugear.report.findings.context import METHOD_LABELS, Context, PairExcitation, StoredResults, excitations
from exugear.report.findings.groups import SAME_FREQUENCY, RunGroup
from exugear.report.findings.ranking import Envelope, Ranking, Resonance, envelopes, ranking_of, ranking_of_errors
from exugear.report.findings.words import Labels
from exugear.results.spectra.run_spectra import report_mode
from exugear.results.spectra.waterfall import OrderLine, order_lines
from exugear.steady.campbell import campbell_from
from exugear.steady.crossings import Contributions, contributions, loudest_near
from exugear.steady.point_solver import harmonic_balance_model
from exugear.steady.steady_file import settings_of
from exugear.system.tooth_mesh.laws.registry import LAWS

if TYPE_CHECKING:
    import xarray as xr

SAME_SPEED = 0.01
"""Relative speed difference within which an order crosses the mode of a resonance."""
BEYOND = (0.75, 1.5)
"""Evaluated speeds outside the range, as factors of its ends."""
QUIET = -120.0
"""Level (dB) of an order outside the frequencies of a run-up."""
HARMONICS = 3
"""Harmonics of each mesh in an estimate from modes."""


@dataclass(frozen=True)
class MatchedMode:
    """Mode of a resonance."""

    index: int
    """In the file of modes, from 0; the command line counts from 1."""
    frequency: float
    damping: float
    """Hz, and ratio to critical damping."""


@dataclass(frozen=True)
class Headline:
    """Ranking that the report leads with, and the results that it is from."""

    choice: Choice
    source: str
    """Steady-state response with its method, run-up with its load case, or modes."""
    load: str
    ranking: Ranking
    group: RunGroup | None
    """Result group; None for an estimate from modes."""
    response: xr.Dataset | None
    """Steady-state response; None for a run-up and for modes."""
    modes: xr.Dataset | None

    @property
    def top(self) -> Resonance | None:
        """First resonance of the ranking."""
        return next(iter(self.ranking.resonances), None)

    def mode_of(self, resonance: Resonance) -> MatchedMode | None:
        """Return the mode of a resonance: the nearest to its frequency, or to that where its order crosses a mode."""
        if self.modes is None:
            return None
        if self.group is not None and self.response is None:
            # A run-up has matched its own modes within its frequency resolution.
            found = (own for own in self.group.ranked[self.group.main] if own.peak.line.order == resonance.order)
            index = next((own.finding.mode for own in found if own.speed == resonance.speed), None)
            if index is None:
                return None
        else:
            crossed = self._crossing(resonance)
            frequency = resonance.frequency if crossed is None else float(crossed["frequency"])
            frequencies = self.modes["frequency"].to_numpy()
            index = int(np.argmin(np.abs(frequencies - frequency)))
            width = max(SAME_FREQUENCY, float(self.modes["damping_ratio"][index]))
            if abs(frequencies[index] - frequency) > width * frequency:
                return None
        return MatchedMode(index, float(self.modes["frequency"][index]), float(self.modes["damping_ratio"][index]))

    def mode_name(self, resonance: Resonance) -> str:
        """Return the description of the mode that a response without a file of modes crosses; empty if unknown."""
        if self.response is None:
            return ""
        diagram = campbell_from(self.response)
        mode = diagram.mode_at(resonance.speed, resonance.frequency)
        return "" if mode is None else diagram.names[mode]

    def _crossing(self, resonance: Resonance) -> Mapping[str, float] | None:
        """Return the strongest crossing of the order of a resonance with a mode at its speed."""
        if self.response is None:
            return None
        orders = self.response["order"].to_numpy()
        met = [
            crossing
            for crossing in json.loads(self.response.attrs["crossings"])
            if abs(orders[crossing["line"]] - resonance.order) < 1e-6 * resonance.order
            and abs(crossing["speed"] - resonance.speed) < SAME_SPEED * abs(resonance.speed)
        ]
        return max(met, key=lambda crossing: float(crossing["share"]), default=None)

    def envelopes(self, lines: Sequence[OrderLine]) -> dict[str, Envelope]:
        """Return the largest single order of each quantity over speed; none for an estimate from modes."""
        if self.response is not None:
            return envelopes(self.response)
        if self.group is None:
            return {}
        spectra = self.group.runs[self.group.main].spectra
        speed, places = np.unique(np.abs(spectra.speed), return_index=True)
        level = np.array([spectra.along(line) for line in lines])[:, places]
        highest = np.where(np.isfinite(level), level, QUIET).max(axis=0)
        return {"error": Envelope(speed, 1e-6 * 10.0 ** (highest / 20.0))}

    def outside(self) -> Resonance | None:
        """Return the first-ranked resonance just outside the evaluated speeds; None if there is none or none known."""
        if self.response is None or self.ranking.whole:
            return None
        low, high = self.ranking.speeds
        wide = ranking_of(self.response, (BEYOND[0] * low, BEYOND[1] * high), self.ranking.wanted)
        return next((own for own in wide.resonances if not low <= abs(own.speed) <= high), None)

    def is_axial(self, resonance: Resonance, support: str) -> bool:
        """Return whether the force on a bearing or mount at a resonance is larger along the shaft than across it."""
        if self.response is None:
            return False
        names = [str(name) for name in self.response["signal"].to_numpy()]
        wanted = [f"support_force {support} {axis}" for axis in "xyz"]
        if not set(wanted) <= set(names):
            return False
        point = int(np.argmin(np.abs(self.response["speed"].to_numpy() - resonance.speed)))
        line = int(np.argmin(np.abs(self.response["order"].to_numpy() - resonance.order)))
        x, y, z = (float(self.response["amplitude"][point, line, names.index(name)]) for name in wanted)
        return z > float(np.hypot(x, y))

    def computed_up_to(self) -> float | None:
        """Return the highest computed speed (rad/s) if it is less than `BEYOND` above the range; None otherwise."""
        if self.response is None or self.ranking.whole:
            return None
        highest = float(np.abs(self.response["speed"].to_numpy()).max())
        return highest if highest < (1.0 - SAME_SPEED) * BEYOND[1] * self.ranking.speeds[1] else None


def headline_of_group(group: RunGroup) -> Headline:
    """Return the ranking of the main variant of a result group."""
    run = group.runs[group.main]
    source = group.source
    load = str(run.attributes.get("load", ""))
    if group.response is not None:
        source = f"constant speed, {METHOD_LABELS[str(group.response.attrs['method'])]}"
        load = ""
    return Headline(group.choice(group.main), source, load, group.in_operation, group, group.response, run.modes)


def headline_of_response(group: RunGroup, variant: str) -> Headline:
    """Return the ranking of the steady-state response of any variant of a group."""
    return Headline(
        group.choice(variant),
        group.source,
        "",
        group.rankings[variant],
        group,
        group.responses[variant],
        group.runs[variant].modes,
    )


def headline_of(context: Context, results: StoredResults, groups: Sequence[RunGroup]) -> Headline | None:
    """Return the ranking that the report leads with; None if nothing is ranked.

    The `groups` are sorted, the most informative first.
    """
    for group in groups:
        # Other inertia sets are compared with that of the first group.
        if group.in_operation.resonances and group.inertias == groups[0].inertias:
            return headline_of_group(group)
    found = {pair.pair: pair for pair in excitations(context, results)}
    for choice, modes in sorted(results.modes.items(), key=lambda item: -list(Variant).index(item[0].variant)):
        ranking = _estimated(context, modes, found)
        if ranking is not None and ranking.resonances:
            return Headline(choice, "modes and static transmission errors", "", ranking, None, None, modes)
    return None


def _estimated(context: Context, modes: xr.Dataset, found: Mapping[str, PairExcitation]) -> Ranking | None:
    """Rank the crossings of orders and modes by amplification times harmonic of the static transmission error."""
    pairs = {mesh.name: mesh.pair.name for mesh in context.gearbox.meshes}
    families = {mesh.name: mesh.family for mesh in context.gearbox.meshes}
    lines = {line.name: line for line in order_lines(context.gearbox, HARMONICS)}
    fastest = max(
        (abs(case.end_speed or case.start_speed) for case in context.gearbox.load_cases.values()), default=0.0
    )
    peaks = []
    for index in range(modes.sizes["mode"]):
        mode = report_mode(modes, index)
        pair = found.get(pairs.get(mode.mesh, ""))
        if pair is None or mode.frequency <= 0.0:
            continue
        for harmonic in range(1, HARMONICS + 1):
            name = families[mode.mesh] if harmonic == 1 else f"{harmonic} × {families[mode.mesh]}"
            if name in lines:
                speed = 2.0 * math.pi * mode.frequency / lines[name].order
                amplitude = mode.amplification * float(pair.harmonics[harmonic - 1])
                peaks.append((lines[name], speed, mode.frequency, amplitude))
    stated = operating_range(context.gearbox)
    if stated is None and fastest > 0.0:
        peaks = [peak for peak in peaks if peak[1] <= fastest]
    if not peaks:
        return None
    return ranking_of_errors(peaks, np.array([peak[1] for peak in peaks]), stated)


# Cause of a resonance


@dataclass(frozen=True)
class Cause:
    """Excitation of a resonance by one pair."""

    pair: str
    harmonic: int
    amplitude: float
    swing: float
    """Amplitude of this harmonic of the static transmission error, and its peak-to-peak value, m."""
    overlap: float
    share: float | None
    """Fraction of the amplitude that the meshes of this pair cause; None where it is not computed."""


def contributions_of(context: Context, headline: Headline) -> Contributions | None:
    """Compute what makes the first resonance: meshes, modes, and sensitivities; None where that is not defined."""
    top = headline.top
    response = headline.response
    if response is None or top is None or LAWS[headline.choice.mesh_model].loses_contact:
        return None
    orders = response["order"].to_numpy()
    multiples = response["index"].to_numpy()[int(np.argmin(np.abs(orders - top.order)))]
    if np.count_nonzero(multiples) != 1:
        return None
    settings = settings_of(response.attrs)
    assembly = context.assembled(headline.choice)
    reach = settings.harmonics, settings.combinations
    model = harmonic_balance_model(assembly, settings.speeds.values, *reach, settings.method)
    line = int(model.lines.find(multiples)[0])
    speed = loudest_near(model.frozen, top.speed, 0.2 * SAME_SPEED, line)
    return contributions(model.frozen, speed, line)


def causes_of(
    context: Context, words: Labels, top: Resonance, found: Sequence[PairExcitation], known: Contributions | None
) -> tuple[Cause, ...]:
    """Return the excitations of a resonance by pair, the largest contribution first."""
    harmonic, families = words.pairs(words.order(top.line, top.order))
    pairs = {mesh.family: mesh.pair for mesh in context.gearbox.meshes}
    tables = {own.pair: own for own in found}
    causes = []
    for family in families:
        pair = pairs[family]
        table = tables.get(pair.name)
        if table is None or harmonic > len(table.harmonics):
            continue
        share = None if known is None else known.meshes.get(family)
        size = float(table.harmonics[harmonic - 1])
        causes.append(Cause(pair.name, harmonic, size, float(np.ptp(table.error)), pair.overlap_ratio, share))
    return tuple(sorted(causes, key=lambda cause: -abs(cause.share or cause.amplitude)))
