"""List of resonances of a result: those in the operating range first, by the ranking, then those at other speeds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from exugear.report.findings.groups import RankedResonance, RunGroup, is_peak_of
from exugear.report.findings.headline import Headline, headline_of_response
from exugear.report.findings.ranking import Resonance, ranking_of
from exugear.results.spectra.waterfall import OrderLine
from exugear.steady.findings import speed_caveats
from exugear.steady.mean_system.signals import ROUND_OFF

MOST_INSIDE, MOST_OUTSIDE = 40, 20
"""Maximum number of listed resonances in the operating range and at other speeds."""


@dataclass(frozen=True)
class ListedResonance:
    """Resonance in the list of a result."""

    line: OrderLine
    speed: float
    """Absolute input speed, rad/s."""
    frequency: float
    """Hz."""
    level: float
    """Overall transmission error, dB re 1 µm."""
    inside: bool
    """Whether it is in the operating range, or the range is not known."""
    mode: int | None
    """Index of its mode; None if it is unknown."""
    resonance: Resonance | None = None
    """Amplitudes and ranks; None for a run-up."""
    peak: RankedResonance | None = None
    """Resonance of the transmission error with its comparisons; None for a steady-state response without a peak of it.
    """
    caveats: tuple[str, ...] = ()
    """What weakens its amplitudes."""


def listed_resonance(
    headline: Headline,
    own: Resonance,
    inside: bool = True,
    peak: RankedResonance | None = None,
    caveats: tuple[str, ...] = (),
) -> ListedResonance:
    """Return the entry of a resonance of a ranking, with its mode; see `ListedResonance` for what is added."""
    found = headline.mode_of(own)
    return ListedResonance(
        OrderLine(own.line.replace(" x ", " × "), own.order),
        abs(own.speed),
        own.frequency,
        20.0 * math.log10(max(own.amplitudes["error"].amplitude, ROUND_OFF["error"]) / 1e-6),
        inside,
        None if found is None else found.index,
        own,
        peak,
        caveats,
    )


def resonance_list(group: RunGroup, variant: str) -> tuple[ListedResonance, ...]:
    """Return the list of a variant of a result group."""
    listed = _of_response if variant in group.responses else _of_run
    return tuple(listed(group, variant))


def _of_response(group: RunGroup, variant: str) -> Iterator[ListedResonance]:
    """Yield the ranking of a response, and the ranking of the other speeds without ranks."""
    headline = headline_of_response(group, variant)
    ranking = headline.ranking
    low, high = ranking.speeds
    caveats = speed_caveats(group.responses[variant])
    inside = ranking.resonances[:MOST_INSIDE]
    outside: Sequence[Resonance] = ()
    if not ranking.whole:
        speed = caveats.speed
        everywhere = ranking_of(group.responses[variant], (float(speed.min()), float(speed.max())), ranking.wanted)
        # Ranks count within the range.
        outside = [
            replace(own, amplitudes={name: replace(one, place=None) for name, one in own.amplitudes.items()})
            for own in everywhere.resonances
            if not low <= abs(own.speed) <= high
        ][:MOST_OUTSIDE]
    for own in (*inside, *outside):
        picked = (one for one in group.ranked[variant] if any(is_peak_of(p, own) for p in one.finding.resonance.picks))
        peak = next(picked, None)
        yield listed_resonance(headline, own, own in inside, peak, caveats.at(own.speed))


def _of_run(group: RunGroup, variant: str) -> Iterator[ListedResonance]:
    """Yield the resonances of a run-up by level, those with a peak in the operating range first."""
    low, high = group.rankings[variant].speeds
    whole = group.rankings[variant].whole
    found = []
    for own in group.ranked[variant]:
        peak = group.shown_peak(own)
        inside = whole or low <= abs(peak.speed) <= high
        mode = own.finding.mode
        frequency = own.finding.resonance.frequency
        found.append(ListedResonance(peak.line, abs(peak.speed), frequency, peak.level, inside, mode, peak=own))
    by_range = [own.inside for own in found]
    yield from (found[n] for n in np.argsort(~np.array(by_range, dtype=bool), kind="stable"))
