"""Resonances under other lengths of the window: what depends on the length is no fact about the gearbox."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from exugear.results.spectra.comparison import AbsenceRule, only_in_first
from exugear.results.spectra.orders import OrderLine
from exugear.results.spectra.resonances import Pick, pick_resonances
from exugear.results.spectra.run_spectra import RunSignals, VariantRun, run_signals

WINDOW_FACTORS = (0.94, 0.98, 1.02, 1.06)
"""Lengths of other windows over the one that suits the sweep."""


@dataclass(frozen=True)
class OtherWindow:
    """What runs to be compared show with another window."""

    picks: Mapping[str, tuple[Pick, ...]]
    """By variant, peaks of each run."""
    absent: Mapping[tuple[str, str], tuple[Pick, ...]]
    """(variant, other variant) peaks of the first that the second lacks."""


def other_windows(
    runs: Sequence[VariantRun],
    lines: Sequence[OrderLine],
    factors: Iterable[float] = WINDOW_FACTORS,
    rule: AbsenceRule | None = None,
) -> tuple[OtherWindow, ...]:
    """Look for the resonances of runs with other windows; one window of all runs is in memory at a time.

    Parameters
    ----------
    runs : of different variants, analysed with one window
    factors : lengths over that of the window
    rule : when a peak counts as absent

    Raises
    ------
    FileError
        A run is missing or damaged.
    """
    signals = {run.variant: run_signals(run.path) for run in runs}
    length = runs[0].spectra.window_length
    return tuple(_with_window(signals, lines, factor * length, rule) for factor in factors)


def _with_window(
    signals: Mapping[str, RunSignals], lines: Sequence[OrderLine], length: float, rule: AbsenceRule | None
) -> OtherWindow:
    spectra = {variant: signal.waterfall(length) for variant, signal in signals.items()}
    picks = {variant: pick_resonances(own, lines) for variant, own in spectra.items()}
    absent = {
        (variant, other): only_in_first(picks[variant], spectra[other], rule)
        for variant in spectra
        for other in spectra
        if variant != other
    }
    return OtherWindow(picks, absent)


def is_among(pick: Pick, picks: Iterable[Pick]) -> bool:
    """Tell whether a peak is among others: on the same order, within the wider of both resolutions.

    Examples
    --------
    >>> line = OrderLine("mesh", 20.0)
    >>> peak = Pick(line, 1.0, 10.0, 600.0, 20.0, 9.0, 15.0)
    >>> is_among(peak, [Pick(line, 1.1, 10.2, 610.0, 20.5, 7.0, 14.0)]), is_among(peak, [])
    (True, False)
    """
    return any(
        own.line.name == pick.line.name and abs(own.frequency - pick.frequency) <= max(own.resolution, pick.resolution)
        for own in picks
    )


def survives(pick: Pick, variant: str, windows: Iterable[OtherWindow]) -> bool:
    """Tell whether every window shows a peak of a variant."""
    return all(is_among(pick, window.picks[variant]) for window in windows)


def stays_absent(pick: Pick, variant: str, other: str, windows: Iterable[OtherWindow]) -> bool:
    """Tell whether a peak of a variant is there and absent from the other variant with every window."""
    return all(is_among(pick, window.absent[variant, other]) for window in windows)
