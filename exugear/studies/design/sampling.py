"""The points of a study: every combination of listed values with every draw, as values at paths of the case."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.schema.keys import unit_of
from exugear.studies.design.distributions import Distribution, Normal, Uniform, correlated, shares
from exugear.studies.design.paths import PathError, value_at
from exugear.studies.design.sections import ParameterSection, StudyFile
from fe_ste.standards.iso1328 import tolerance
from fe_ste.tools.arrays import Floats

MOST_POINTS = 10_000_000
SAMPLE = "sample"
"""Dimension of draws."""
PARAMETER, SIDE = "parameter", "side"
"""Dimensions of local derivatives."""
SIDES = ("below", "above")
_DEVIATIONS_WITHIN = 3.0
"""Standard deviations of a production within its tolerance."""


@dataclass(frozen=True)
class Point:
    """One variation."""

    index: tuple[int, ...]
    """Its place along the dimensions of the study."""
    changes: Mapping[str, Any]
    """Values at paths of the case."""


@dataclass(frozen=True)
class Axis:
    """A coordinate of the study's dataset."""

    dimensions: tuple[str, ...]
    values: Any
    """Array."""
    units: str = ""
    path: str = ""
    """What it sets, in words."""


@dataclass(frozen=True)
class Design:
    """All points of a study over labelled dimensions."""

    shape: Mapping[str, int]
    """Mapping of dimension to size."""
    axes: Mapping[str, Axis]
    """By name."""
    points: tuple[Point, ...]
    levels: Mapping[str, tuple[Mapping[str, Any], ...]] = field(default_factory=dict)
    """By dimension, values at paths of the case along each dimension; points are all their combinations."""


@dataclass(frozen=True)
class _Levels:
    """Values that a listed parameter takes one after the other."""

    axes: Mapping[str, Axis]
    changes: tuple[Mapping[str, Any], ...]


def design_of(study: StudyFile, gearbox: Gearbox) -> Design:
    """Make the points of a study of a gearbox whose `changes` are made.

    Raises
    ------
    PathError
        Values are scaled or shifted that are no numbers, or there are too many points.
    ValueError
        A tolerance class that the gear has not got.
    """
    if any(parameter.kind == "step" for parameter in study.parameters.values()):
        return _derivatives(study, gearbox)
    listed = {name: parameter for name, parameter in study.parameters.items() if not parameter.is_drawn}
    levels = {name: _levels(name, parameter, gearbox) for name, parameter in listed.items()}
    drawn = {name: parameter for name, parameter in study.parameters.items() if parameter.is_drawn}
    if drawn:
        levels[SAMPLE] = _draws(study, drawn, gearbox)
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
    """Values of a parameter that lists them."""
    if parameter.settings is not None:
        labels = np.array(list(parameter.settings), dtype=object)
        axis = Axis((name,), labels, "", ", ".join(parameter.targets))
        return _Levels({name: axis}, tuple(dict(setting) for setting in parameter.settings.values()))
    values = listed_values(parameter)
    changes = tuple({path: acting(parameter, gearbox, path, value) for path in parameter.targets} for value in values)
    labels = _labels(values)
    return _Levels({name: Axis((name,), labels, units_of(parameter), ", ".join(parameter.targets))}, changes)


def listed_values(parameter: ParameterSection) -> list[Any]:
    """Values of a list or a range."""
    if parameter.range is None:
        return list(parameter.values or [])
    spread = np.geomspace if parameter.range.scale == "logarithmic" else np.linspace
    return [_rounded(value) for value in spread(parameter.range.first, parameter.range.last, parameter.range.count)]


def _labels(values: list[Any]) -> Any:
    """Numbers as they are; anything else in words."""
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return np.array(values, dtype=np.float64)
    return np.array([value if isinstance(value, str) else str(value) for value in values], dtype=object)


def acting(parameter: ParameterSection, gearbox: Gearbox, path: str, value: Any) -> Any:
    """Value at a path: as it is, or by that of the case.

    Raises
    ------
    PathError
        The case has no number there.
    """
    return acted(parameter, own_value(gearbox, path), path, value)


def acted(parameter: ParameterSection, own: Any, path: str, value: Any) -> Any:
    """Value at a path: as it is, or by one that stands there.

    Raises
    ------
    PathError
        No number stands there.
    """
    if parameter.acts == "replaces":
        return value
    if isinstance(own, bool) or not isinstance(own, int | float):
        raise PathError(
            f"{path}: the case has no number there that a value {parameter.acts.rstrip('s')}s; give one in "
            "[changes], or acts = 'replaces'"
        )
    return _rounded(own * value if parameter.acts == "scales" else own + value)


def own_value(gearbox: Gearbox, path: str) -> Any:
    """Value that a case has at a path, also where the file leaves it to the default."""
    given = value_at(gearbox.content, path)
    if given is not None:
        return given
    found: Any = gearbox.case
    for key in path.split("."):
        found = found.get(key) if isinstance(found, Mapping) else getattr(found, key, None)
    return found


def _rounded(value: float) -> float:
    """Twelve digits: what another machine computes is the same point."""
    return float(f"{value:.12g}")


def units_of(parameter: ParameterSection) -> str:
    """Return the unit of the values, from the ends of the keys that they set."""
    if parameter.acts == "scales":
        return "1"
    units = {unit_of(path.rpartition(".")[2]) for path in parameter.targets}
    if len(units) == 1:
        return units.pop()
    return ""


def _draws(study: StudyFile, drawn: Mapping[str, ParameterSection], gearbox: Gearbox) -> _Levels:
    """Values of all parameters with distributions, drawn together."""
    axes, draws = drawn_values(study, drawn, gearbox)
    axes = {SAMPLE: Axis((SAMPLE,), np.arange(1, len(draws) + 1)), **axes}
    owners = {path: parameter for parameter in drawn.values() for path in parameter.targets}
    changes = [{path: acting(owners[path], gearbox, path, value) for path, value in draw.items()} for draw in draws]
    return _Levels(axes, tuple(changes))


def drawn_values(
    study: StudyFile, drawn: Mapping[str, ParameterSection], gearbox: Gearbox
) -> tuple[dict[str, Axis], list[dict[str, float]]]:
    """Coordinates of parameters with distributions over their draws, and values by path before they act.

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
        own = cube[:, first : first + members[name]]
        first += members[name]
        values = distribution_of(parameter, gearbox).at(correlated(own, parameter.correlation))
        axes |= _drawn_axes(name, parameter, values)
        for n, row in enumerate(values):
            for m, path in enumerate(parameter.targets):
                draws[n][path] = _rounded(float(row[min(m, len(row) - 1)]))
    return axes, draws


def _drawn_axes(name: str, parameter: ParameterSection, values: Floats) -> dict[str, Axis]:
    """Coordinates of a drawn parameter: over the draws, and over its paths where these are drawn by themselves."""
    units = units_of(parameter)
    paths = ", ".join(parameter.targets)
    if values.shape[1] == 1:
        return {name: Axis((SAMPLE,), values[:, 0], units, paths)}
    member = f"{name}_path"
    return {
        member: Axis((member,), np.array(parameter.targets, dtype=object)),
        name: Axis((SAMPLE, member), values, units, paths),
    }


def distribution_of(parameter: ParameterSection, gearbox: Gearbox) -> Distribution:
    """Distribution of a parameter.

    Raises
    ------
    ValueError
        The case has no such gear, or it lies outside ISO 1328.
    """
    if parameter.uniform is not None:
        return Uniform(parameter.uniform.least, parameter.uniform.most)
    if parameter.normal is not None:
        normal = parameter.normal
        limits = (-np.inf if normal.least is None else normal.least, np.inf if normal.most is None else normal.most)
        return Normal(normal.mean, normal.deviation, *limits)
    assert parameter.iso1328 is not None
    wanted = parameter.iso1328
    if wanted.gear not in gearbox.gears:
        raise ValueError(f"iso1328: no gear {wanted.gear!r} in the case; gears are {', '.join(gearbox.gears)}")
    gear = gearbox.gears[wanted.gear]
    most = 1e6 * tolerance(
        wanted.deviation,
        wanted.tolerance_class,
        reference_diameter=2.0 * gear.reference_radius,
        normal_module=gear.normal_module,
        face_width=gear.face_width,
    )
    least = 0.0 if wanted.deviation == "runout" else -most  # half of the normal distribution: it has no sign
    return Normal(0.0, most / _DEVIATIONS_WITHIN, least, most)


def _derivatives(study: StudyFile, gearbox: Gearbox) -> Design:
    """Two points for each parameter, a step below and a step above the case."""
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
