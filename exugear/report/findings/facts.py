"""Three facts for the summary: the highest resonance, the effect of compliance, and the sensitivity of the mode."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from exugear.gearbox.choice import choice_of
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.report.findings.context import REFERENCE_VARIANT, Context
from exugear.report.findings.groups import RankedResonance, RunGroup
from exugear.report.findings.headline import headline_of_group
from exugear.report.findings.parameter_variations import BestChange, ModelVariations, best_change, variations_of
from exugear.report.findings.words import Labels, capitalised, figure_text
from exugear.results.spectra.waterfall import order_lines
from exugear.steady.peaks import peaks

if TYPE_CHECKING:
    import xarray as xr

# First-order shifts of a natural frequency, from the distribution of strain and kinetic energy

STEP = 0.1
"""Relative change of a stiffness or an inertia for which the frequency shift is reported."""
LEAST_SHIFT = 5e-4
"""Relative frequency shift below which a parameter is not listed."""


@dataclass(frozen=True)
class FrequencySensitivity:
    """First-order sensitivity of a natural frequency to a stiffness or an inertia."""

    what: str
    """Label of the element or body."""
    kind: str
    """{"stiffness", "inertia"}"""
    share: float
    """Fraction of the strain energy (stiffness) or kinetic energy (inertia) of the mode."""
    shift: float
    """Frequency shift for an increase of the parameter by 10 %, Hz."""


def shift_of(frequency: float, share: float, kind: str, step: float = STEP) -> float:
    """Return the frequency shift (Hz) for a relative change of a parameter that has a fraction of the mode's energy.

    With a fixed mode shape, Rayleigh's quotient makes f^2 proportional to strain energy over kinetic energy. With the
    fractions of these energies, f becomes f sqrt(1 + step share) for stiffness and f / sqrt(1 + step share) for
    inertia. The first order in the step is exact.

    Examples
    --------
    >>> round(shift_of(1000.0, 1.0, "stiffness", 0.21), 9), round(shift_of(1000.0, 0.2, "inertia"), 2)
    (100.0, -9.85)
    """
    power = 0.5 if kind == "stiffness" else -0.5
    return frequency * (math.pow(1.0 + step * share, power) - 1.0)


def sensitivities_of(words: Labels, modes: xr.Dataset, index: int) -> tuple[FrequencySensitivity, ...]:
    """List sensitivities of a mode: stiffnesses, then inertias, each by effect; planets of a set vary together."""
    frequency = float(modes["frequency"][index])
    kinetic = modes["kinetic_energy_share"].isel(mode=index).sum("motion").to_numpy()
    bodies = words.gathered(dict(zip(map(str, modes["body"].to_numpy()), map(float, kinetic), strict=True)))
    parts = [("stiffness", words.strain_energy(modes, index)), ("inertia", bodies)]
    sensitivities = [
        FrequencySensitivity(what, kind, share, shift_of(frequency, share, kind))
        for kind, shares in parts
        for what, share in shares.items()
    ]
    return tuple(
        sensitivity
        for sensitivity in sensitivities
        if not math.isclose(sensitivity.shift, 0.0, abs_tol=LEAST_SHIFT * frequency)
    )


# Cards of the summary: highest resonance, effect of compliance, sensitivity

DAMPING = "mesh damping"
"""Beginning of the labels of mesh damping parameters."""
NO_GAIN = 0.1
"""Gain (dB) below which a change has no effect."""
AROUND_RATED = 1.25
"""Ratio to the rated speed up to which a resonance counts as near the rated speed."""

HIGHEST = "Highest transmission error"
"""Heading of the card with the highest peak at all speeds."""
MOST_WORDS = 25
"""Maximum number of words in the text of a card."""
MIN_EXCESS_DB = 1.0
"""Excess (dB) from which a resonance that the run-up does not resolve is reported first."""


@dataclass(frozen=True)
class SummaryCard:
    """Finding for a card of the page and a line of the command line."""

    kind: str
    figure: str
    beside: str
    """Value in large letters, and the text next to it."""
    sentence: str
    link: str
    """Section of the page with details."""

    @property
    def line(self) -> str:
        """Whole finding as one line."""
        return f"{self.kind}: {self.figure} {self.beside}. {self.sentence}"


def short(*sentences: str) -> str:
    """Join sentences while they fit on a card; the first is always included.

    Examples
    --------
    >>> short("Order sun_planet.", "", "One word more than a card takes: " + MOST_WORDS * "word ")
    'Order sun_planet.'
    """
    text = sentences[0]
    for sentence in filter(None, sentences[1:]):
        longer = f"{text} {sentence}"
        if len(longer.split()) <= MOST_WORDS:
            text = longer
    return text


def amplitude_text(level: float) -> str:
    """Return the amplitude of the overall transmission error for a level (dB re 1 µm), with sign and unit.

    Examples
    --------
    >>> amplitude_text(35.9)
    '±62 µm'
    """
    return f"±{figure_text(10.0 ** (level / 20.0), 2)} µm"


def speed_text(peak_speed: float) -> str:
    """Return a speed of the overall input (rad/s) as text in rpm."""
    return f"{figure_text(abs(peak_speed) / RPM, 4)} rpm"


def frequency_text(frequency: float) -> str:
    """Return a frequency as text in Hz."""
    return f"{frequency:.0f} Hz"


def facts_of(
    context: Context, words: Labels, group: RunGroup, variations: Sequence[ModelVariations]
) -> tuple[SummaryCard, ...]:
    """Return the findings of a result group; findings without data are omitted."""
    facts = [_loudest(context, words, group), _compliance(group), _sensitivity(words, group, variations)]
    return tuple(fact for fact in facts if fact is not None)


def facts_of_response(words: Labels, response: xr.Dataset) -> tuple[SummaryCard, ...]:
    """Return the finding of a response from `load_response` without a run-up of the same model settings."""
    top = next(iter(peaks(response)), None)
    if top is None:
        return ()
    level = 20.0 * math.log10(top.amplitude / 1e-6)
    amplitude = f"{amplitude_text(level)} ({figure_text(level)} dB)"
    said = f"Order {words.labelled(top.line)}. Overall TE {amplitude}, constant speed."
    beside = f"at {speed_text(top.speed)}, {Variant.of(choice_of(response.attrs).variant).label}"
    return (SummaryCard(HIGHEST, frequency_text(top.frequency), beside, said, "steady"),)


def _loudest(context: Context, words: Labels, group: RunGroup) -> SummaryCard | None:
    top = group.loudest
    if top is None:
        highest = max(float(run.spectra.speed.max()) for run in group.runs.values())
        with_all = "" if group.responses else " with all window lengths"
        said = f"No resonance found up to {speed_text(highest)}{with_all}."
        return SummaryCard(HIGHEST, "none", "found", said, "ranking")
    if unseen := _unseen(context, words, group, top):
        return unseen
    source = ", constant speed" if group.responses else ""
    if not group.responses and top.constant is not None:
        source = f", {amplitude_text(top.peak.level)} in the run-up"
    modes = group.runs[group.main].modes
    shape = words.labelled(top.finding.mode_name)
    if top.finding.mode is not None and modes is not None:
        shape = words.moves(modes, top.finding.mode)
    said = short(
        f"Order {words.line(top.peak.line)}.",
        f"Overall TE {amplitude_text(top.ranking_level)} ({figure_text(top.ranking_level)} dB){source}.",
        *_speed_relative_to_rated(context, group),
        f"Mode: {shape}." if shape else "",
    )
    beside = f"at {speed_text(top.speed)}, {Variant.of(group.main).label}"
    return SummaryCard(HIGHEST, frequency_text(top.frequency), beside, said, "rings")


def _unseen(context: Context, words: Labels, group: RunGroup, top: RankedResonance) -> SummaryCard | None:
    """Return a resonance that is higher at constant speed than all that the run-up resolves; None if there is none."""
    levels = group.constant.get(group.main)
    found = None if levels is None else levels.highest(order_lines(context.gearbox))
    if found is None or found[1].level < top.ranking_level + MIN_EXCESS_DB:
        return None
    line, at = found
    said = short(
        f"Order {words.line(line)}.",
        f"Overall TE {amplitude_text(at.level)} ({figure_text(at.level)} dB), constant speed.",
        f"Not resolved in the run-up; highest there: {frequency_text(top.finding.resonance.frequency)}, "
        f"{amplitude_text(top.peak.level)}.",
    )
    beside = f"at {speed_text(at.speed)}, {Variant.of(group.main).label}"
    return SummaryCard(HIGHEST, frequency_text(at.frequency), beside, said, "steady")


def _speed_relative_to_rated(context: Context, group: RunGroup) -> tuple[str, ...]:
    """Compare the speed of the highest resonance with the rated speed, as sentences."""
    rated = context.gearbox.case.operation.rated_speed_rpm
    if rated is None or group.loudest is None:
        return ()
    times = abs(group.loudest.speed) / RPM / rated
    compared = f"Speed: {figure_text(times, 2)} × rated."
    if times <= AROUND_RATED:
        return (compared,)
    limit = AROUND_RATED * rated
    near = next((own for own in group.ranked[group.main] if own.steady and own.speed / RPM <= limit), None)
    said = "none"
    if near is not None:
        said = f"{frequency_text(near.frequency)}, {amplitude_text(near.ranking_level)}"
    return compared, f"Up to {AROUND_RATED:g} × rated: {said}."


def _compliance(group: RunGroup) -> SummaryCard | None:
    """Compare the highest resonance with that of the rigid reference variant."""
    reference = group.ranked.get(REFERENCE_VARIANT)
    top = group.loudest
    if reference is None or group.main == REFERENCE_VARIANT:
        return None
    stiff = next((own for own in reference if own.steady), None)
    if stiff is None or top is None:
        return None
    change = top.peak.level - stiff.peak.level
    fresh = sum(own.steady and REFERENCE_VARIANT in own.lacking for own in group.ranked[group.main])
    gone = sum(own.steady and group.main in own.lacking for own in reference)
    counted = "" if group.responses else " (found with all window lengths)"
    elastic = Variant.of(group.main).is_elastic
    said = short(
        f"Torsional model: highest resonance {frequency_text(stiff.finding.resonance.frequency)} at "
        f"{speed_text(stiff.peak.speed)}, {amplitude_text(stiff.peak.level)}.",
        f"{'Flexible bodies add' if elastic else 'Bearing stiffness adds'} {fresh} "
        f"resonance{'s' * (fresh != 1)} and {'remove' if elastic else 'removes'} {gone}{counted}.",
    )
    sign = "−" if change < 0.0 else "+"
    kind = "Effect of flexible bodies" if elastic else "Effect of bearing stiffness"
    return SummaryCard(kind, f"{sign}{figure_text(abs(change), 2)} dB", "at the highest peak", said, "ranking")


def _sensitivity(words: Labels, group: RunGroup, variations: Sequence[ModelVariations]) -> SummaryCard | None:
    """Report the parameters that shift the highest resonance, and whether any change reduces its amplitude."""
    own = headline_of_group(group)
    mode = own.mode_of(own.top) if own.top else None
    modes = own.modes
    if mode is None or modes is None:
        return None
    sensitivities = sensitivities_of(words, modes, mode.index)
    stiffest = next((sensitivity for sensitivity in sensitivities if sensitivity.kind == "stiffness"), None)
    heaviest = next((sensitivity for sensitivity in sensitivities if sensitivity.kind == "inertia"), None)
    if stiffest is None:
        return None
    lighter = "" if heaviest is None else f"Inertia of {heaviest.what} +10 %: {shift_text(heaviest)}."
    said = short(
        f"Strain energy {100.0 * stiffest.share:.0f} %.",
        *_amplitude_reductions(words, group, modes, mode.index, variations),
        lighter,
    )
    return SummaryCard("Sensitivity", shift_text(stiffest), f"for +10 % stiffness of {stiffest.what}", said, "change")


def shift_text(sensitivity: FrequencySensitivity) -> str:
    """Return the frequency shift of a sensitivity as text, with sign and unit.

    Examples
    --------
    >>> shift_text(FrequencySensitivity("carrier", "inertia", 0.4, -13.8))
    '−14 Hz'
    """
    sign = "−" if sensitivity.shift < 0.0 else "+"
    return f"{sign}{figure_text(abs(sensitivity.shift), 2)} Hz"


def _amplitude_reductions(
    words: Labels, group: RunGroup, modes: xr.Dataset, mode: int, variations: Sequence[ModelVariations]
) -> tuple[str, ...]:
    own = variations_of(variations, group.choice(group.main))
    if not own:
        return ()
    frequency = float(modes["frequency"][mode])
    changes = [best_change(variation, frequency) for variation in own]
    # More damping always reduces the amplitude; the question is whether any other parameter does.
    others = [change for change in changes if not change.label.startswith(DAMPING)]
    best = (best_words(words, max(others, key=lambda change: change.gain)),) if others else ()
    damping = [change for change in changes if change.label.startswith(DAMPING) and change.gain > 0.0]
    changed = ((words.change(change.label, change.value, change.default), change.gain) for change in damping)
    return best + tuple(f"{capitalised(text)}: −{figure_text(gain, 2)} dB." for text, gain in changed)


def best_words(words: Labels, best: BestChange) -> str:
    """State how far a parameter lowers the largest TE amplification near a mode; this is a sensitivity, not advice."""
    change = words.change(best.label, best.value, best.default)
    if best.gain >= NO_GAIN:
        return f"Lowest TE amplification within one octave: −{figure_text(best.gain, 2)} dB, with {change}."
    if best.span < NO_GAIN:
        return "No effect on the TE amplification within one octave."
    return f"Other values only raise the TE amplification within one octave, by up to {figure_text(best.span, 2)} dB."
