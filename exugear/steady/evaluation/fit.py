"""Fit of parameters to measured order cuts: least squares on levels, intervals, refusal of undetermined parameters.

Residuals are differences of levels (dB), without the mean of each channel, since gains of sensors are uncertain by
about 1 dB. They are correlated along a cut. Intervals therefore treat each order of each channel as one observation:
they are the wider of the cluster-robust interval (Liang and Zeger, 1986) and of the jackknife over these series, with
as many degrees of freedom as there are series less parameters and channels. A small residual or a small correlation of
parameters does not show that they are determined; the width of the interval does.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.entries import quantities
from fe_ste.tools.arrays import Booleans, Floats
from fe_ste.tools.display import ReprMixin, TitledRows

MOST_PARAMETERS = 3
FEWEST_SERIES = 4
"""Number of orders of channels below which nothing is fitted."""
WIDEST = 1.5
"""Upper over lower end of an interval from which a parameter is not determined."""
LEAST_EFFECT = 0.1
"""Change of levels by 10 % of a parameter, dB rms, below which it is not determined."""
SCANNED = (0.5, 0.63, 0.79, 1.26, 1.59, 2.0)
"""Factors on the start at which a parameter is tried first: levels over a resonance have local minima."""
FARTHEST = 5.0
"""Factor on the start up to which a parameter is searched."""
OUTLIER = 2.0
"""Difference of levels, dB, from which it counts less (smooth approximation of the absolute value)."""
STEP = 0.01
"""Relative step of central differences."""
ACCURACY = 0.02
"""Accuracy of computed levels, dB: interpolation, windows, sweep. No interval is narrower than this permits."""
PROBABILITY = 0.95
FITTED_TABLES = ("bearings", "couplings", "damping", "housing", "mounts")
"""Tables of the gearbox file on which no table of transmission errors and no reduced body depends."""

Levels = Callable[[Mapping[str, float]], Floats]
"""Function that computes levels (channels, lines, windows), dB, from values of parameters."""


class FitError(ValueError):
    """A fit that cannot be made; the message states the reason and the remedy."""


@dataclass(frozen=True)
class FittedParameter:
    """A parameter of a fit."""

    key: str
    start: float
    value: float
    low: float
    high: float
    """Ends of the 95 % interval."""
    refusal: str = ""
    """Why the data do not determine it; empty if they do."""


@dataclass(frozen=True, eq=False)
class ParameterFit(ReprMixin):
    """Parameters with which computed levels agree best with measured ones."""

    parameters: tuple[FittedParameter, ...]
    before: float
    after: float
    """Root mean square difference of levels without the mean of each channel, dB, at the start and of the fit."""
    correlation: Floats
    """(parameters, parameters) correlation of the values."""
    series: int
    """Number of orders of channels."""
    evaluations: int

    @property
    def changes(self) -> dict[str, float]:
        """Fitted values by key, to the six significant digits that a changed gearbox file has.

        Raises
        ------
        FitError
            The data do not determine a parameter.
        """
        refused = [f"{own.key} is not determined ({own.refusal})" for own in self.parameters if own.refusal]
        if refused:
            raise FitError(f"{', '.join(refused)}; fit the others alone, or record a run-up over its resonances")
        return {own.key: float(f"{own.value:.6g}") for own in self.parameters}

    def _line(self) -> str:
        values = ", ".join(f"{own.key} = {own.value:.4g}" for own in self.parameters)
        return f": {values}; {self.before:.2f} to {self.after:.2f} dB (rms)"

    def _table(self) -> TitledRows:
        rows = {own.key: f"{own.value:.4g} ({own.low:.4g} to {own.high:.4g})" for own in self.parameters}
        return "Fitted parameters", rows


def start_of_fit(gearbox: Gearbox, keys: Sequence[str]) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Values and possible ranges of keys of the gearbox file, such as ``housing.factor``.

    Raises
    ------
    GearboxFileError
        There are too many keys, or one has no single number above zero that can be fitted.

    Examples
    --------
    >>> start_of_fit(Gearbox.from_toml("cases/grc750/gearbox.toml"), ["damping.modal_percent"])[1]
    {'damping.modal_percent': (0.01, 20.0)}
    """
    if not 1 <= len(set(keys)) <= MOST_PARAMETERS or len(set(keys)) < len(keys):
        raise gearbox.error(
            f"fit of {', '.join(keys) or 'nothing'}: one to {MOST_PARAMETERS} different keys can be fitted"
        )
    known = {
        key: (value, (limits.least, limits.most))
        for key, value, limits in quantities(gearbox.case)
        if key.split(".")[0] in FITTED_TABLES and value > 0.0 and not key.rpartition(".")[2].isdigit()
    }
    for key in keys:
        if key not in known:
            near = difflib.get_close_matches(key, known, 1)
            tables = ", ".join(f"[{table}]" for table in FITTED_TABLES)
            remedy = (
                f"did you mean {near[0]!r}?" if near else f"single numbers of {tables} that it states can be fitted"
            )
            raise gearbox.error(f"fit of {key}: the file has no such number above zero; {remedy}")
    return {key: known[key][0] for key in keys}, {key: known[key][1] for key in keys}


def fit_levels(
    levels: Levels,
    measured: Floats,
    chosen: Booleans,
    start: Mapping[str, float],
    limits: Mapping[str, tuple[float, float]] | None = None,
) -> ParameterFit:
    """Fit parameters to measured levels.

    Parameters
    ----------
    levels : computes the levels; called about 15 to 50 times
    measured : (channels, lines, windows) measured levels, dB
    chosen : (channels, lines, windows) levels that count
    start : positive values by key, at most three
    limits : possible values by key

    Raises
    ------
    FitError
        There are too many parameters, one is not positive, or too few orders of channels count.

    Examples
    --------
    >>> speed = np.linspace(0.5, 1.5, 200)
    >>> def levels(at):
    ...     own = speed[None] * np.array([[0.8], [0.9], [1.0], [1.2]]) / at["frequency"]
    ...     return -10.0 * np.log10((1.0 - own**2) ** 2 + (2.0 * at["damping"] * own) ** 2)[None]
    >>> true = levels({"frequency": 1.05, "damping": 0.03})
    >>> fit_levels(levels, true + 1.0, np.ones(true.shape, bool), {"frequency": 1.0, "damping": 0.02})
    <ParameterFit: frequency = 1.05, damping = 0.03; 3.16 to 0.00 dB (rms)>
    """
    from scipy.optimize import least_squares
    from scipy.stats import t as student

    keys = [*start]
    series = np.argwhere(chosen.any(axis=2))
    if not 1 <= len(keys) <= MOST_PARAMETERS or not all(value > 0.0 for value in start.values()):
        raise FitError(f"{len(keys)} parameters; one to {MOST_PARAMETERS} with positive values can be fitted")
    freedom = len(series) - len(keys) - len(np.unique(series[:, 0]))
    if len(series) < FEWEST_SERIES or freedom < 1:
        least = max(FEWEST_SERIES, len(series) - freedom + 1)
        raise FitError(
            f"{len(series)} orders of channels count; at least {least} are required: add harmonics or channels"
        )
    evaluations = 0

    def residual(point: Floats) -> Floats:
        nonlocal evaluations
        evaluations += 1
        found = np.where(chosen, levels(dict(zip(keys, np.exp(point), strict=True))) - measured, np.nan)
        return np.asarray((found - np.nanmean(found, axis=(1, 2), keepdims=True))[chosen])

    first = np.log(np.array([*start.values()]))
    known = [(limits or {}).get(key, (0.0, math.inf)) for key in keys]
    low = np.maximum(first - math.log(FARTHEST), [math.log(max(least, 1e-300)) for least, _ in known])
    high = np.minimum(first + math.log(FARTHEST), [math.log(most) for _, most in known])
    before = residual(first)
    best = _scanned(residual, first, low, high)
    solution = least_squares(
        residual,
        best,
        bounds=(low, high),
        loss="soft_l1",
        f_scale=OUTLIER,
        diff_step=[1e-3] * len(keys),
        xtol=1e-5,
        max_nfev=25,
    )
    slopes = np.column_stack(
        [
            (residual(solution.x + step) - residual(solution.x - step)) / (2.0 * STEP)
            for step in STEP * np.eye(len(keys))
        ]
    )
    own = residual(solution.x)
    member = np.ravel_multi_index(np.nonzero(chosen)[:2], chosen.shape[:2])
    covariance = _covariance(slopes, own, member)
    width = float(student.ppf(0.5 + 0.5 * PROBABILITY, freedom)) * np.sqrt(np.diag(covariance))
    slope = np.sqrt(np.mean(slopes**2, axis=0))
    width = np.hypot(width, ACCURACY / np.maximum(slope, 1e-300))
    effect = 0.1 * slope
    at_end = (solution.x < low + 1e-3) | (solution.x > high - 1e-3)
    parameters = [
        FittedParameter(
            key=key,
            start=start[key],
            value=float(np.exp(solution.x[n])),
            low=float(np.exp(solution.x[n] - width[n])),
            high=float(np.exp(min(solution.x[n] + width[n], 700.0))),
            refusal=_refusal(float(width[n]), float(effect[n]), bool(at_end[n])),
        )
        for n, key in enumerate(keys)
    ]
    scale = np.sqrt(np.diag(covariance))
    return ParameterFit(
        parameters=tuple(parameters),
        before=float(np.sqrt(np.mean(before**2))),
        after=float(np.sqrt(np.mean(own**2))),
        correlation=covariance / np.maximum(np.outer(scale, scale), 1e-300),
        series=len(series),
        evaluations=evaluations,
    )


def _scanned(residual: Callable[[Floats], Floats], first: Floats, low: Floats, high: Floats) -> Floats:
    """Return the best point of a coarse search, one parameter after the other."""
    best, least = first, _cost(residual(first))
    for place in range(first.size):
        start = best
        for factor in SCANNED:
            other = start.copy()
            other[place] = first[place] + math.log(factor)
            if low[place] <= other[place] <= high[place] and (cost := _cost(residual(other))) < least:
                best, least = other, cost
    return best


def _cost(values: Floats) -> float:
    """Cost of residuals, as the least squares have it."""
    return float(np.sum(np.sqrt(1.0 + (values / OUTLIER) ** 2) - 1.0))


def _covariance(slopes: Floats, residual: Floats, member: np.ndarray[tuple[int], np.dtype[np.int64]]) -> Floats:
    """Covariance of parameters with series of correlated residuals: the larger of cluster-robust one and jackknife."""
    information = slopes.T @ slopes
    inverse = np.linalg.pinv(information)
    groups = np.unique(member)
    count = len(groups)
    scores = np.array([slopes[member == group].T @ residual[member == group] for group in groups])
    clustered = inverse @ (scores.T @ scores) @ inverse * count / (count - 1)
    steps = []
    for group, score in zip(groups, scores, strict=True):
        without = slopes[member == group]
        steps.append(np.linalg.pinv(information - without.T @ without) @ score)
    spread = np.array(steps) - np.mean(steps, axis=0)
    jackknife = (count - 1) / count * (spread.T @ spread)
    larger = np.maximum(np.sqrt(np.diag(jackknife)), np.sqrt(np.diag(clustered)))
    scale = larger / np.maximum(np.sqrt(np.diag(clustered)), 1e-300)
    return np.asarray(clustered * np.outer(scale, scale))


def _refusal(width: float, effect: float, at_end: bool) -> str:
    """Return why the data do not determine a parameter; empty if they do."""
    if at_end:
        return "at the end of its range"
    if effect < LEAST_EFFECT:
        return f"10 % of it change levels by {effect:.2g} dB only"
    if 2.0 * width > math.log(WIDEST):
        return f"interval wider than a factor of {WIDEST:g}"
    return ""
