"""Tolerances of a search: what production does not hold, the same draws at every point that is looked at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.studies.design.sampling import Axis, acted, drawn_values, own_value
from exugear.studies.design.sections import ParameterSection, StudyFile
from fe_ste.tools.arrays import Floats


@dataclass(frozen=True)
class Tolerances:
    """Draws of all tolerances together."""

    axes: Mapping[str, Axis]
    """By name, coordinates over the draws."""
    draws: tuple[Mapping[str, float], ...]
    """Tuple of mapping of path to float. Values before they act."""
    acting: Mapping[str, ParameterSection]
    """Mapping of path to ParameterSection. What a value at a path does."""

    def produced(self, gearbox: Gearbox, changes: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Values at paths of the case, of each draw: a tolerance shifts or scales what a point has set.

        Raises
        ------
        PathError
            There is no number that a value scales or shifts.
        """
        return [
            {
                **changes,
                **{
                    path: acted(self.acting[path], changes.get(path, own_value(gearbox, path)), path, value)
                    for path, value in draw.items()
                },
            }
            for draw in self.draws
        ]


def tolerances_of(study: StudyFile, gearbox: Gearbox) -> Tolerances | None:
    """Draw the tolerances of a study; None where it has none.

    Raises
    ------
    PathError, ValueError
        As `exugear.studies.design.sampling.design_of`.
    """
    if not study.tolerances:
        return None
    axes, draws = drawn_values(study, study.tolerances, gearbox)
    acting = {path: tolerance for tolerance in study.tolerances.values() for path in tolerance.targets}
    tolerances = Tolerances(axes, tuple(draws), acting)
    tolerances.produced(gearbox, {})
    return tolerances


def percentile_of(values: Floats, percent: float) -> Floats:
    """Percentile along the last axis, of a sample of draws; one beside a value without end is that of the worse draw.

    Parameters
    ----------
    values : (..., draws)
    percent : 50 and above; below it the mirrored one, which errs to the side of small values

    Notes
    -----
    Between draws by Hyndman and Fan's eighth rule, whose median error is least whatever the distribution.

    Examples
    --------
    >>> print(percentile_of(np.arange(1.0, 101.0), 95.0).round(2), percentile_of(np.array([1.0, np.inf]), 95.0))
    95.65 inf
    """
    if percent < 50.0:
        return np.asarray(-percentile_of(-values, 100.0 - percent))
    finite = np.isfinite(values).all(axis=-1)
    with np.errstate(invalid="ignore"):  # beside what has no end
        between = np.percentile(values, percent, axis=-1, method="median_unbiased")
    return np.where(finite, between, np.percentile(values, percent, axis=-1, method="higher"))
