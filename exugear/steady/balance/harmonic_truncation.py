"""How many harmonics of mesh frequencies, and combinations of several, a set of lines has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exugear.steady.harmonics.lines import LineSet, count_of_lines

MOST_LINES = 500
"""Combinations up to which lines are looked for: those up to the eighth of three mesh frequencies, the 21st of two."""


@dataclass(frozen=True)
class HarmonicTruncation:
    """How far a set of lines reaches: harmonics of each mesh frequency, largest sum of multiples of several."""

    harmonics: int
    combinations: int

    def around(self, lines: LineSet, bases: int, clear: bool) -> HarmonicTruncation:
        """Return this one, doubled until it has lines of so many bases; combinations up to `MOST_LINES`.

        `clear` asks that none of them is at its edge.
        """
        multiples = np.abs(lines.index[:, :bases])
        alone = np.count_nonzero(multiples, axis=1) == 1
        sums = multiples.sum(axis=1) + clear
        harmonics = self.harmonics
        combinations = self.combinations
        while sums[alone].max(initial=0) > harmonics:
            harmonics *= 2
        while sums[~alone].max(initial=0) > combinations:
            sooner = combinations
            later = range(combinations + 1, 2 * combinations + 1)
            combinations = max((n for n in later if count_of_lines(bases, n) <= MOST_LINES), default=sooner)
            if combinations == sooner:
                break
        return HarmonicTruncation(harmonics, combinations)
