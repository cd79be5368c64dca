"""Points of a study: all combinations of listed values with all draws, as values by path in the gearbox file."""

from __future__ import annotations

import difflib
import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from scipy.special import ndtr, ndtri
from scipy.stats import qmc

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.schema.keys import tables, unit_of
from exugear.studies.sections import ParameterSection, StudyFile
from fe_ste.standards.iso1328 import tolerance
from fe_ste.tools.arrays import Floats

# Distributions of parameters by their inverse distribution functions, and correlated draws

Sampling = Literal["sobol", "latin_hypercube", "random"]
_OPEN = 1e-15
"""Minimum distance of a probability from 0 and 1, as a normal distribution is unbounded."""


@dataclass(frozen=True)
class Normal:
    """Normal distribution, truncated at limits if these are given.

    Examples
    --------
    >>> Normal(0.0, 1.0).at(np.array([0.5, 0.975])).round(3).tolist()
    [0.0, 1.96]
    """

    mean: float
    deviation: float
    """Standard deviation before truncation."""
    least: float = -math.inf
    most: float = math.inf
    """Limits of the draws."""

    def at(self, share: Floats) -> Floats:
        """Return the quantiles for probabilities (0 to 1)."""
        low, high = ndtr((np.array([self.least, self.most]) - self.mean) / self.deviation)
        inside = np.clip(low + share * (high - low), _OPEN, 1.0 - _OPEN)
        values = self.mean + self.deviation * ndtri(inside)
        return np.asarray(np.clip(values, self.least, self.most), dtype=np.float64)


@dataclass(frozen=True)
class Uniform:
    """Uniform distribution between two values.

    Examples
    --------
    >>> Uniform(2.0, 4.0).at(np.array([0.25])).tolist()
    [2.5]
    """

    least: float
    most: float

    def at(self, share: Floats) -> Floats:
        """Return the quantiles for probabilities (0 to 1)."""
        return np.asarray(self.least + share * (self.most - self.least), dtype=np.float64)


def shares(sampling: Sampling, count: int, dimensions: int, seed: int) -> Floats:
    """Return points of the unit cube (count, dimensions), evenly distributed; reproducible by the seed.

    A longer Sobol sequence begins with the points of a shorter one.

    Parameters
    ----------
    sampling : {"sobol", "latin_hypercube", "random"}
    count : for Sobol points a power of two

    Examples
    --------
    >>> shares("latin_hypercube", 4, 2, seed=1).shape
    (4, 2)
    """
    generator = np.random.default_rng(seed)
    if sampling == "random":
        return generator.random((count, dimensions))
    if sampling == "sobol":
        points = qmc.Sobol(dimensions, rng=generator).random_base2(round(math.log2(count)))
    else:
        points = qmc.LatinHypercube(dimensions, rng=generator).random(count)
    return np.asarray(points, dtype=np.float64)


def correlated(independent: Floats, correlation: float) -> Floats:
    """Return probabilities (count, members) of a group with equal pairwise correlation, 0 to 1 (Gaussian copula).

    Examples
    --------
    >>> same = correlated(np.array([[0.2, 0.9]]), 1.0)
    >>> bool(np.allclose(same, 0.2))
    True
    """
    members = independent.shape[1]
    if correlation == 1.0:
        return np.repeat(independent[:, :1], members, axis=1)
    if correlation == 0.0 or members == 1:
        return independent
    matrix = np.full((members, members), correlation) + (1.0 - correlation) * np.eye(members)
    normal = ndtri(np.clip(independent, _OPEN, 1.0 - _OPEN)) @ np.linalg.cholesky(matrix).T
    return np.asarray(ndtr(normal), dtype=np.float64)


# Dotted paths into a gearbox file: present values, permitted paths, and contents with other values

SHOWN_MATCHES = 3
"""Maximum number of near matches in a message."""


class PathError(ValueError):
    """Error: a path does not exist in a gearbox file; the message lists near matches."""


def value_at(content: Mapping[str, Any], path: str) -> Any:
    """Return the value at a path (keys joined by dots, list entries numbered from 0); None if there is none.

    Examples
    --------
    >>> value_at({"gears": {"sun": {"teeth": 21}}, "angles": [0.0, 120.0]}, "gears.sun.teeth")
    21
    >>> value_at({"angles": [0.0, 120.0]}, "angles.1")
    120.0
    """
    found: Any = content
    for key in path.split("."):
        if isinstance(found, Mapping) and key in found:
            found = found[key]
        elif isinstance(found, list) and key.isdigit() and int(key) < len(found):
            found = found[int(key)]
        else:
            return None
    return found


def changed(content: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return a content with other values at some paths; missing tables are created, unchanged parts are shared.

    Raises
    ------
    PathError
        A path passes through a value that is neither table nor list, or beyond the end of a list.

    Examples
    --------
    >>> changed({"housing": {"factor": 1.0}, "angles": [0.0, 120.0]}, {"housing.factor": 0.3, "angles.1": 125.0})
    {'housing': {'factor': 0.3}, 'angles': [0.0, 125.0]}
    """
    result = dict(content)
    copied = {id(result)}
    for path, value in changes.items():
        *parents, last = path.split(".")
        section: Any = result
        for key in parents:
            place = _place(section, key, path)
            inner = section[place] if isinstance(section, list) else section.get(place, {})
            if not isinstance(inner, Mapping | list):
                raise PathError(f"{path}: {key!r} is neither a table nor a list")
            if id(inner) not in copied:
                inner = list(inner) if isinstance(inner, list) else dict(inner)
                copied.add(id(inner))
                section[place] = inner
            section = inner
        section[_place(section, last, path)] = value
    return result


def _place(section: Any, key: str, path: str) -> Any:
    """Return the key of a table, or the index of a list entry."""
    if not isinstance(section, list):
        return key
    if not (key.isdigit() and int(key) < len(section)):
        raise PathError(f"{path}: {key!r} is not an index of a list of {len(section)}; indices start at 0")
    return int(key)


def check_path(content: Mapping[str, Any], path: str) -> None:
    """Refuse a path that does not exist.

    Optional keys that the file omits are permitted.

    Raises
    ------
    PathError
        The message lists near matches.

    Examples
    --------
    >>> check_path({"housing": {"factor": 0.3}}, "housing.facter")
    Traceback (most recent call last):
    ...
    exugear.studies.sampling.PathError: no key 'housing.facter' in the gearbox file; did you mean housing.factor?
    """
    if value_at(content, path) is not None:
        return
    permitted = {
        f"{place}.{key}" if place else key
        for table, model in tables().items()
        for place in _named(content, table.split(".") if table else [])
        for key in model.model_fields
    }
    if path in permitted:
        return
    single = {key for key in permitted if not isinstance(value_at(content, key), Mapping)}
    near = difflib.get_close_matches(path[:200], sorted(single.union(_present(content, ""))), SHOWN_MATCHES)
    hint = "paths are such as bearings.NAME.z_mm, with names of the gearbox file"
    if near:
        hint = f"did you mean {' or '.join(near)}?"
    raise PathError(f"no key {path[:200]!r} in the gearbox file; {hint}")


def _present(content: Any, before: str) -> Iterator[str]:
    """Yield the paths of all single values of a content."""
    if isinstance(content, Mapping):
        for key, value in content.items():
            yield from _present(value, f"{before}.{key}" if before else key)
    else:
        yield before


def _named(content: Any, pattern: list[str], before: str = "") -> Iterator[str]:
    """Yield the paths of a table, with each existing entry in place of NAME in its pattern."""
    if not pattern:
        yield before
        return
    first, *rest = pattern
    entries = content if isinstance(content, Mapping) else {}
    for name in entries if first == "NAME" else [first]:
        yield from _named(entries.get(name), rest, f"{before}.{name}" if before else name)


MOST_POINTS = 10_000_000
SAMPLE = "sample"
"""Dimension of draws."""
PARAMETER, SIDE = "parameter", "side"
"""Dimensions of local derivatives."""
SIDES = ("below", "above")
_DEVIATIONS_WITHIN = 3.0
"""Number of standard deviations of production within its tolerance."""


@dataclass(frozen=True)
class Point:
    """One variation of the gearbox."""

    index: tuple[int, ...]
    """Index along the dimensions of the study."""
    changes: Mapping[str, Any]
    """Values by path in the gearbox file."""


@dataclass(frozen=True)
class Axis:
    """Coordinate of the study's dataset."""

    dimensions: tuple[str, ...]
    values: Any
    units: str = ""
    path: str = ""
    """Paths that it sets, as text."""


@dataclass(frozen=True)
class Design:
    """All points of a study over labelled dimensions."""

    shape: Mapping[str, int]
    """Mapping of dimension to size."""
    axes: Mapping[str, Axis]
    """By name."""
    points: tuple[Point, ...]
    levels: Mapping[str, tuple[Mapping[str, Any], ...]] = field(default_factory=dict)
    """By dimension, values by path in the gearbox file along each dimension; points are all their combinations."""


@dataclass(frozen=True)
class _Levels:
    """Successive values of a listed parameter."""

    axes: Mapping[str, Axis]
    changes: tuple[Mapping[str, Any], ...]


def design_of(study: StudyFile, gearbox: Gearbox) -> Design:
    """Return the points of a study for a gearbox that already has its `changes`.

    Raises
    ------
    PathError
        Values to be scaled or shifted are not numbers, or there are too many points.
    ValueError
        A tolerance class is not available for the gear.
    """
    if any(parameter.kind == "step" for parameter in study.parameters.values()):
        return _derivatives(study, gearbox)
    listed = {name: parameter for name, parameter in study.parameters.items() if not parameter.is_drawn}
    levels = {name: _levels(name, parameter, gearbox) for name, parameter in listed.items()}
    drawn = {name: parameter for name, parameter in study.parameters.items() if parameter.is_drawn}
    if drawn:
        drawn_axes, draws = drawn_values(study, drawn, gearbox)
        sample = Axis((SAMPLE,), np.arange(1, len(draws) + 1))
        owners = {path: parameter for parameter in drawn.values() for path in parameter.targets}
        changes = [{path: acting(owners[path], gearbox, path, value) for path, value in draw.items()} for draw in draws]
        levels[SAMPLE] = _Levels({SAMPLE: sample, **drawn_axes}, tuple(changes))
    shape = {name: len(level.changes) for name, level in levels.items()}
    total = int(np.prod([float(size) for size in shape.values()]))
    if total > MOST_POINTS:
        raise PathError(f"parameters: {total:.3g} combinations; a study has at most {MOST_POINTS}")
    axes = {name: axis for level in levels.values() for name, axis in level.axes.items()}
    points = tuple(
        Point(
            index,
            {
                key: value
                for n, level in zip(index, levels.values(), strict=True)
                for key, value in level.changes[n].items()
            },
        )
        for index in itertools.product(*(range(size) for size in shape.values()))
    )
    return Design(shape, axes, points, {name: level.changes for name, level in levels.items()})


def _levels(name: str, parameter: ParameterSection, gearbox: Gearbox) -> _Levels:
    """Return the values of a parameter that lists them; numbers label themselves, other values are labelled by text."""
    paths = ", ".join(parameter.targets)
    if parameter.settings is not None:
        axis = Axis((name,), np.array(list(parameter.settings), dtype=object), "", paths)
        return _Levels({name: axis}, tuple(dict(setting) for setting in parameter.settings.values()))
    values = list(parameter.values or [])
    if parameter.range is not None:
        spread = np.geomspace if parameter.range.scale == "logarithmic" else np.linspace
        ends = (parameter.range.first, parameter.range.last)
        values = [_rounded(value) for value in spread(*ends, parameter.range.count)]
    changes = tuple({path: acting(parameter, gearbox, path, value) for path in parameter.targets} for value in values)
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        labels = np.array(values, dtype=np.float64)
    else:
        labels = np.array([str(value) for value in values], dtype=object)
    return _Levels({name: Axis((name,), labels, units_of(parameter), paths)}, changes)


def acting(
    parameter: ParameterSection, gearbox: Gearbox, path: str, value: Any, changes: Mapping[str, Any] | None = None
) -> Any:
    """Return the new value at a path: the value itself, or the present one scaled or shifted by it.

    Parameters
    ----------
    changes : mapping, optional
        Values by path that precede those of the gearbox file as present ones.

    Raises
    ------
    PathError
        The present value is not a number.
    """
    if parameter.acts == "replaces":
        return value
    own = changes[path] if changes and path in changes else own_value(gearbox, path)
    if isinstance(own, bool) or not isinstance(own, int | float):
        raise PathError(
            f"{path}: the gearbox file has no number there that a value {parameter.acts.rstrip('s')}s; set one in "
            "[changes], or acts = 'replaces'"
        )
    return _rounded(own * value if parameter.acts == "scales" else own + value)


def own_value(gearbox: Gearbox, path: str) -> Any:
    """Return the value of a gearbox file at a path, or the default of an omitted key."""
    given = value_at(gearbox.content, path)
    if given is not None:
        return given
    found: Any = gearbox.case
    for key in path.split("."):
        found = found.get(key) if isinstance(found, Mapping) else getattr(found, key, None)
    return found


def _rounded(value: float) -> float:
    """Round to twelve digits, so that results of different machines give the same point."""
    return float(f"{value:.12g}")


def units_of(parameter: ParameterSection) -> str:
    """Return the unit of the values, from the suffixes of the keys that they set."""
    if parameter.acts == "scales":
        return "1"
    units = {unit_of(path.rpartition(".")[2]) for path in parameter.targets}
    return units.pop() if len(units) == 1 else ""


def drawn_values(
    study: StudyFile, drawn: Mapping[str, ParameterSection], gearbox: Gearbox
) -> tuple[dict[str, Axis], list[dict[str, float]]]:
    """Return the coordinates of drawn parameters over the draws, and the values by path before scaling or shifting.

    Raises
    ------
    ValueError
        See `distribution_of`.
    """
    count = study.samples or 1
    members = {name: len(parameter.targets) if parameter.correlation < 1.0 else 1 for name, parameter in drawn.items()}
    cube = shares(study.sampling, count, sum(members.values()), study.seed)
    axes: dict[str, Axis] = {}
    draws: list[dict[str, float]] = [{} for _ in range(count)]
    first = 0
    for name, parameter in drawn.items():
        columns = cube[:, first : first + members[name]]
        first += members[name]
        values = distribution_of(parameter, gearbox).at(correlated(columns, parameter.correlation))
        labels = units_of(parameter), ", ".join(parameter.targets)
        if values.shape[1] == 1:
            axes[name] = Axis((SAMPLE,), values[:, 0], *labels)
        else:  # drawn separately for each path
            member = f"{name}_path"
            axes[member] = Axis((member,), np.array(parameter.targets, dtype=object))
            axes[name] = Axis((SAMPLE, member), values, *labels)
        for n, row in enumerate(values):
            for m, path in enumerate(parameter.targets):
                draws[n][path] = _rounded(float(row[min(m, len(row) - 1)]))
    return axes, draws


def distribution_of(parameter: ParameterSection, gearbox: Gearbox) -> Normal | Uniform:
    """Return the distribution of a parameter.

    Raises
    ------
    ValueError
        The gearbox file has no such gear, or the gear is outside the range of ISO 1328.
    """
    if parameter.uniform is not None:
        return Uniform(parameter.uniform.min, parameter.uniform.max)
    if parameter.normal is not None:
        normal = parameter.normal
        limits = (-np.inf if normal.min is None else normal.min, np.inf if normal.max is None else normal.max)
        return Normal(normal.mean, normal.deviation, *limits)
    assert parameter.iso1328 is not None
    wanted = parameter.iso1328
    if wanted.gear not in gearbox.gears:
        raise ValueError(f"iso1328: no gear {wanted.gear!r} in the gearbox file; gears are {', '.join(gearbox.gears)}")
    gear = gearbox.gears[wanted.gear]
    most = 1e6 * tolerance(
        wanted.deviation,
        wanted.tolerance_class,
        reference_diameter=2.0 * gear.reference_radius,
        normal_module=gear.normal_module,
        face_width=gear.face_width,
    )
    least = 0.0 if wanted.deviation == "runout" else -most  # half-normal distribution, as the deviation has no sign
    return Normal(0.0, most / _DEVIATIONS_WITHIN, least, most)


def _derivatives(study: StudyFile, gearbox: Gearbox) -> Design:
    """Return two points for each parameter, one step below and above its present value."""
    points = []
    steps = []
    for number, parameter in enumerate(study.parameters.values()):
        step = parameter.step or 0.0
        steps.append(step)
        for side, sign in enumerate((-1.0, 1.0)):
            value = 1.0 + sign * step if parameter.acts == "scales" else sign * step
            moved = parameter if parameter.acts == "scales" else parameter.model_copy(update={"acts": "shifts"})
            points.append(
                Point((number, side), {path: acting(moved, gearbox, path, value) for path in parameter.targets})
            )
    axes = {
        PARAMETER: Axis((PARAMETER,), np.array(list(study.parameters), dtype=object)),
        SIDE: Axis((SIDE,), np.array(SIDES, dtype=object)),
        "step": Axis((PARAMETER,), np.array(steps)),
    }
    levels = {
        name: tuple(point.changes for point in points if point.index[0] == number)
        for number, name in enumerate(study.parameters)
    }
    return Design({PARAMETER: len(study.parameters), SIDE: len(SIDES)}, axes, tuple(points), levels)


# Tolerances of an optimisation: production scatter, with the same draws at every evaluated point


@dataclass(frozen=True)
class Tolerances:
    """Joint draws of all tolerances."""

    axes: Mapping[str, Axis]
    """By name, coordinates over the draws."""
    draws: tuple[Mapping[str, float], ...]
    """Values by path before scaling or shifting."""
    acting: Mapping[str, ParameterSection]
    """Parameter with the action of a value, by path."""

    def produced(self, gearbox: Gearbox, changes: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return the values by path of each draw: a tolerance shifts or scales the value of the point.

        Raises
        ------
        PathError
            The value to be scaled or shifted is not a number.
        """
        return [
            {**changes, **{path: acting(self.acting[path], gearbox, path, own, changes) for path, own in draw.items()}}
            for draw in self.draws
        ]


def tolerances_of(study: StudyFile, gearbox: Gearbox) -> Tolerances | None:
    """Draw the tolerances of a study; None if it has none.

    Raises
    ------
    PathError, ValueError
        As `exugear.studies.sampling.design_of`.
    """
    if not study.tolerances:
        return None
    axes, draws = drawn_values(study, study.tolerances, gearbox)
    acting = {path: tolerance for tolerance in study.tolerances.values() for path in tolerance.targets}
    tolerances = Tolerances(axes, tuple(draws), acting)
    tolerances.produced(gearbox, {})
    return tolerances


def percentile_of(values: Floats, percent: float) -> Floats:
    """Return the percentile along the last axis of a sample of draws; next to an infinite value, the worse draw counts.

    Parameters
    ----------
    values : (..., draws)
    percent : for values below 50 the percentile is mirrored, so that the worse draw is the smaller one

    Notes
    -----
    Values are interpolated by rule 8 of Hyndman and Fan, which is approximately median-unbiased for any distribution.

    Examples
    --------
    >>> print(percentile_of(np.arange(1.0, 101.0), 95.0).round(2), percentile_of(np.array([1.0, np.inf]), 95.0))
    95.65 inf
    """
    if percent < 50.0:
        return np.asarray(-percentile_of(-values, 100.0 - percent))
    finite = np.isfinite(values).all(axis=-1)
    with np.errstate(invalid="ignore"):  # next to infinite values
        between = np.percentile(values, percent, axis=-1, method="median_unbiased")
    return np.where(finite, between, np.percentile(values, percent, axis=-1, method="higher"))
