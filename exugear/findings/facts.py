"""Three facts in plain words: where it rings loudest, what compliance does, and what would move it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import xarray as xr

from exugear.findings.context import REFERENCE_VARIANT, Context
from exugear.findings.groups import RankedResonance, RunGroup
from exugear.findings.levers import Lever, levers_of
from exugear.findings.variations import GAIN, BestChange, ModelVariations, best_change
from exugear.findings.words import VARIANTS, Words, figure_text
from exugear.model.parts import RPM

DAMPING = "mesh damping"
"""Begin of the label of the parameter that damps."""
NO_GAIN = 0.1
"""Gain (dB) below which a change makes no difference."""
AROUND_RATED = 1.25
"""Speed up to which a resonance counts as one of the rated speed, over that speed."""


@dataclass(frozen=True)
class Fact:
    """A fact for a card of the page and a line of the command line.

    Attributes
    ----------
    kind : str
        What it is about.
    figure, beside : str
        The figure in large letters, and what stands beside it.
    sentence : str
        The rest.
    link : str
        Section of the page that has more.
    """

    kind: str
    figure: str
    beside: str
    sentence: str
    link: str

    @property
    def line(self) -> str:
        """The whole fact as one line."""
        return f"{self.kind}: {self.figure} {self.beside}. {self.sentence}"


def amplitude_text(level: float) -> str:
    """Amplitude of the overall transmission error at a level (dB re 1 µm), with its sign and unit.

    Examples
    --------
    >>> amplitude_text(35.9)
    '±62 µm'
    """
    return f"±{figure_text(10.0 ** (level / 20.0), 2)} µm"


def speed_text(peak_speed: float) -> str:
    """Speed of the overall input (rad/s) in rpm."""
    return f"{figure_text(abs(peak_speed) / RPM, 4)} rpm"


def frequency_text(frequency: float) -> str:
    """Frequency in Hz."""
    return f"{frequency:.0f} Hz"


def facts_of(
    context: Context, words: Words, group: RunGroup, variations: Sequence[ModelVariations]
) -> tuple[Fact, ...]:
    """Tell the facts of a group of run-ups; those that it has nothing for are left out."""
    facts = [_loudest(context, words, group), _compliance(group), _lever(words, group, variations)]
    return tuple(fact for fact in facts if fact is not None)


def _loudest(context: Context, words: Words, group: RunGroup) -> Fact | None:
    top = group.loudest
    if top is None:
        highest = max(float(run.spectra.speed.max()) for run in group.runs.values())
        said = f"No resonance stands out up to {speed_text(highest)} with every window."
        return Fact("Loudest resonance", "none", "that stands out", said, "ranking")
    peak, modes = top.peak, group.runs[group.main].modes
    moves = "" if top.finding.mode is None or modes is None else f": {words.moves(modes, top.finding.mode)}"
    said = (
        f"Excited by {words.line_sentence(peak.line)}. The overall transmission error swings by "
        f"{amplitude_text(peak.level)} ({figure_text(peak.level)} dB){moves}.{_against_rated(context, group)}"
    )
    beside = f"at {speed_text(peak.speed)}, {VARIANTS[group.main]}"
    return Fact("Loudest resonance", frequency_text(top.finding.resonance.frequency), beside, said, "rings")


def _against_rated(context: Context, group: RunGroup) -> str:
    rated = context.gearbox.case.operation.rated_speed_rpm
    if rated is None or group.loudest is None:
        return ""
    times = abs(group.loudest.peak.speed) / RPM / rated
    if times <= AROUND_RATED:
        return f" That is {figure_text(times, 2)} times the rated speed."
    near = next((own for own in group.ranked[group.main] if own.steady and _is_near_rated(own, rated)), None)
    said = "nothing stands out"
    if near is not None:
        frequency = frequency_text(near.finding.resonance.frequency)
        level = amplitude_text(near.peak.level)
        said = f"the loudest is {frequency} at {speed_text(near.peak.speed)} with {level}"
    return (
        f" That is {figure_text(times, 2)} times the rated speed; up to {100.0 * (AROUND_RATED - 1.0):.0f} % over "
        f"rated {said}."
    )


def _is_near_rated(own: RankedResonance, rated: float) -> bool:
    return abs(own.peak.speed) / RPM <= AROUND_RATED * rated


def _compliance(group: RunGroup) -> Fact | None:
    """Tell what compliance does, against the stiff reference."""
    reference, top = group.ranked.get(REFERENCE_VARIANT), group.loudest
    if reference is None or group.main == REFERENCE_VARIANT:
        return None
    stiff = next((own for own in reference if own.steady), None)
    if stiff is None or top is None:
        return None
    change = top.peak.level - stiff.peak.level
    fresh = sum(own.steady and REFERENCE_VARIANT in own.lacking for own in group.ranked[group.main])
    gone = sum(own.steady and group.main in own.lacking for own in reference)
    said = (
        f"On ideal joints the loudest is {frequency_text(stiff.finding.resonance.frequency)} at "
        f"{speed_text(stiff.peak.speed)} with {amplitude_text(stiff.peak.level)}. {VARIANTS[group.main].capitalize()} "
        f"{_resonances(fresh)} that the rigid model lacks, and {gone} of its own disappear. "
        "Counted are those that windows of five lengths show."
    )
    sign = "−" if change < 0.0 else "+"
    kind = "What elastic bodies do" if group.main == "flexible" else "What the bearings do"
    return Fact(kind, f"{sign}{figure_text(abs(change), 2)} dB", "at the loudest peak", said, "ranking")


def _resonances(count: int) -> str:
    return f"{count} resonance appears" if count == 1 else f"{count} resonances appear"


def _lever(words: Words, group: RunGroup, variations: Sequence[ModelVariations]) -> Fact | None:
    """Tell what moves the loudest resonance, and whether any change makes it quieter."""
    top, modes = group.loudest, group.runs[group.main].modes
    if top is None or modes is None or top.finding.mode is None:
        return None
    levers = levers_of(words, modes, top.finding.mode)
    stiffest = next((lever for lever in levers if lever.kind == "stiffness"), None)
    heaviest = next((lever for lever in levers if lever.kind == "inertia"), None)
    if stiffest is None:
        return None
    said = f"It holds {100.0 * stiffest.share:.0f} % of the strain energy of the loudest mode."
    if heaviest is not None:
        said += f" 10 % more inertia of {heaviest.what}: {shift_text(heaviest)}."
    said += _quieter(words, group, modes, top.finding.mode, variations)
    return Fact("What moves it", shift_text(stiffest), f"for 10 % more stiffness of {stiffest.what}", said, "change")


def shift_text(lever: Lever) -> str:
    """Shift of a lever with its sign and unit.

    Examples
    --------
    >>> shift_text(Lever("carrier", "inertia", 0.4, -13.8))
    '−14 Hz'
    """
    sign = "−" if lever.shift < 0.0 else "+"
    return f"{sign}{figure_text(abs(lever.shift), 2)} Hz"


def _quieter(words: Words, group: RunGroup, modes: xr.Dataset, mode: int, variations: Sequence[ModelVariations]) -> str:
    own = next((one.variations for one in variations if one.choice == group.choice(group.main)), ())
    if not own:
        return ""
    frequency = float(modes["frequency"][mode])
    changes = [best_change(variation, frequency) for variation in own]
    # More damping always helps; whether anything else does is the question.
    others = [change for change in changes if not change.label.startswith(DAMPING)]
    said = f" {best_words(words, max(others, key=lambda change: change.gain))}" if others else ""
    damping = [change for change in changes if change.label.startswith(DAMPING) and change.gain > 0.0]
    return said + "".join(
        f" With {words.change(change.label, change.value, change.default)}: −{figure_text(change.gain, 2)} dB."
        for change in damping
    )


def best_words(words: Words, best: BestChange) -> str:
    """Say whether the best change of a parameter is worth it."""
    change = words.change(best.label, best.value, best.default)
    if best.gain < NO_GAIN:
        return "Makes no difference to what lies within an octave of it."
    if best.gain < GAIN:
        return (
            f"Nothing that was varied makes what lies within an octave of it {GAIN:g} dB quieter: where the mode "
            f"fades, another takes over. The most, {figure_text(best.gain, 2)} dB, comes by {change}."
        )
    return f"What lies within an octave of it becomes {figure_text(best.gain, 2)} dB quieter by {change}."
