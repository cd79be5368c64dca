"""Two run-ups side by side: resonances that one shows and the other does not."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from textwrap import shorten

import numpy as np

from exugear.results.spectra.resonances import Pick, peaks_on_line
from exugear.results.spectra.run_spectra import Finding, VariantRun
from exugear.results.spectra.waterfall import Waterfall
from fe_ste.tools.display import Displayed, TitledRows


@dataclass(frozen=True)
class AbsenceRule:
    """When a peak of one run counts as absent from another."""

    prominence: float = 3.0
    """On the same order line the other run has no peak of this prominence, dB, within the resolution, and."""
    margin: float = 6.0
    """Its level at that place lies at least so far below, dB."""

    @property
    def description(self) -> str:
        """The rule in words, for captions."""
        return (
            f"no peak of {self.prominence:g} dB prominence on the same order within the resolution, "
            f"and a level at least {self.margin:g} dB lower"
        )


def only_in_first(picks: Iterable[Pick], other: Waterfall, rule: AbsenceRule | None = None) -> tuple[Pick, ...]:
    """Select the peaks of one run that another run does not show.

    Parameters
    ----------
    picks : peaks of the first run
    other : the second run, with the same unit
    rule : stated thresholds

    Returns
    -------
    peaks that satisfy the rule; a peak where the second run has no data does not
    """
    stated = rule or AbsenceRule()
    asked = tuple(picks)
    peaks = {line: peaks_on_line(other, line, stated.prominence) for line in {pick.line for pick in asked}}
    return tuple(pick for pick in asked if _is_absent(pick, other, peaks[pick.line], stated))


def _is_absent(pick: Pick, other: Waterfall, peaks: Sequence[Pick], rule: AbsenceRule) -> bool:
    """Tell whether a peak is absent from another run, of which the peaks on the same order line are given."""
    frequency = pick.line.frequency(other.speed)
    level = other.along(pick.line)
    near = np.isfinite(level) & (np.abs(frequency - pick.frequency) <= pick.resolution)
    if not np.any(near):
        return False
    same_place = any(abs(peak.frequency - pick.frequency) <= max(pick.resolution, peak.resolution) for peak in peaks)
    return not same_place and float(level[near].max()) <= pick.level - rule.margin


@dataclass(frozen=True)
class Comparison(Displayed):
    """Run-ups of two variants under the same law, inertia set and load case."""

    first: VariantRun
    second: VariantRun
    """The first is the compliant one: what it has and the second lacks is asked for."""
    rule: AbsenceRule
    """When a peak counts as absent."""

    def _line(self) -> str:
        counts = f"only first {len(self.only_first)}, only second {len(self.only_second)}"
        return f" {shorten(self._title, 130)}: {counts}"

    def _table(self) -> TitledRows:
        rows = {
            f"only {run.variant}": ", ".join(f"{finding.resonance.frequency:.0f} Hz" for finding in findings) or "none"
            for run, findings in ((self.first, self.only_first), (self.second, self.only_second))
        }
        return self._title, rows | {"rule": self.rule.description}

    @property
    def _title(self) -> str:
        return f"{self.first.variant} with {self.second.variant}, {self.first.conditions}"

    @cached_property
    def only_first(self) -> tuple[Finding, ...]:
        """Resonances of the first run whose loudest peaks the second does not show."""
        return self._lacking(self.first, self.second)

    @cached_property
    def only_second(self) -> tuple[Finding, ...]:
        """Resonances of the second run whose loudest peaks the first does not show."""
        return self._lacking(self.second, self.first)

    def _lacking(self, run: VariantRun, other: VariantRun) -> tuple[Finding, ...]:
        # A weak order may be absent where the loudest is not: what is told of a resonance is told of its loudest peak.
        absent = set(only_in_first((own.strongest for own in run.findings()), other.spectra, self.rule))
        return tuple(finding for finding in run.findings() if finding.strongest in absent)

    @property
    def runs(self) -> tuple[VariantRun, VariantRun]:
        """Both, the stiff one first, as pictures show them."""
        return self.second, self.first


def compare(first: VariantRun, second: VariantRun, rule: AbsenceRule | None = None) -> Comparison:
    """Set two run-ups side by side.

    Raises
    ------
    ValueError
        They differ in more than the variant, or were analysed with different windows.
    """
    for key in ("gearbox", "load_case", "level", "mesh_law", "inertias"):
        values = first.attributes.get(key), second.attributes.get(key)
        if values[0] != values[1]:
            raise ValueError(f"runs to compare differ in {key}: {values[0]!r} and {values[1]!r}")
    if not math.isclose(first.spectra.window_length, second.spectra.window_length, rel_tol=1e-9):  # of rounded times
        raise ValueError("runs to compare were analysed with windows of different length")
    return Comparison(first, second, rule or AbsenceRule())
