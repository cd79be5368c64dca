"""Result of a study: one labelled dataset over its parameters, with its provenance."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from exugear.gearbox.versions import MODES, REDUCTION, RUN, STEADY, STUDY
from exugear.results.folder import DATASET, STUDY_LAYOUT
from exugear.studies.executors import Record, number_of
from exugear.studies.sampling import PARAMETER, SAMPLE, SIDE, Axis, Design, Point, percentile_of, units_of
from exugear.studies.sections import StudyFile
from exugear.studies.study import SLOPE, Study
from fe_ste.tools.arrays import Booleans, Floats
from fe_ste.tools.stores import load_dataset, write_dataset
from fe_ste.tools.versions import TABLE

if TYPE_CHECKING:
    import xarray as xr

_PACKAGES = ("exugear", "numpy", "scipy", "numba", "exudyn")


def dataset_of(study: Study, records: Mapping[str, Record]) -> xr.Dataset:
    """Combine records by hash into a dataset; missing and failed points are NaN, with the reason in `error`.

    Returns
    -------
    xarray.Dataset
        Outputs over the parameters; `error`, `doubts`, `seconds` and `memory` of each point; as attributes the study,
        its gearbox file, versions and numbers of points.
    """
    import xarray as xr

    design = study.design
    sizes = tuple(design.shape.values())
    dimensions = tuple(design.shape)
    at = [(point.index, records.get(name)) for name, point in study.hashed_points()]
    done = [(index, record) for index, record in at if record is not None]
    labels: dict[str, list[str]] = {}
    for name, kept in study.outputs.items():
        dimension = kept.quantity.dimension
        if dimension:
            told = [label for _, record in done for label in record.values.get(name, {})]
            labels[dimension] = list(dict.fromkeys([*labels.get(dimension, []), *told]))
    variables: dict[str, Any] = {}
    for name, kept in study.outputs.items():
        own = [kept.quantity.dimension] if kept.quantity.dimension else []
        values = np.full((*sizes, *(len(labels[dimension]) for dimension in own)), math.nan)
        for index, record in done:
            found = record.values.get(name)
            if own:
                values[index] = [number_of((found or {}).get(label)) for label in labels[own[0]]]
            else:
                values[index] = number_of(found)
        attributes = {"units": kept.units, "long_name": kept.quantity.description}
        attributes["options"] = json.dumps(dict(kept.options))
        variables[name] = ((*dimensions, *own), values, attributes)
    error = np.full(sizes, "missing: not computed yet", dtype=object)
    doubts = np.full(sizes, "", dtype=object)
    seconds, memory = (np.full(sizes, math.nan) for _ in range(2))
    for index, record in done:
        error[index], doubts[index] = record.error, "; ".join(record.doubts)
        seconds[index], memory[index] = record.seconds, record.memory
    variables["error"] = (dimensions, error, {"long_name": "why a point has no results"})
    variables["doubts"] = (dimensions, doubts, {"long_name": "warnings of a point"})
    variables["seconds"] = (dimensions, seconds, {"units": "s", "long_name": "wall time of a point"})
    variables["memory"] = (dimensions, memory, {"units": "B", "long_name": "peak memory of its process so far"})
    coordinates: dict[str, Any] = {
        name: (axis.dimensions, axis.values, {"units": axis.units, "path": axis.path} if axis.path else {})
        for name, axis in design.axes.items()
    }
    coordinates |= {name: (name, np.array(names, dtype=object)) for name, names in labels.items() if names}
    dataset = xr.Dataset(variables, coordinates, _attributes(study, at))
    if SIDE in design.shape:  # the local derivative of each output by each parameter: the central difference
        for name, kept in study.outputs.items():
            below, above = (dataset[name].isel({SIDE: side}) for side in (0, 1))
            slope = ((above - below) / (2.0 * dataset["step"])).transpose(PARAMETER, ...)
            slope.attrs = {"units": f"{kept.units} per unit of the parameter", "long_name": f"slope of {name}"}
            dataset[f"{SLOPE}{name}"] = slope
    return dataset


def _attributes(study: Study, at: list[tuple[tuple[int, ...], Record | None]]) -> dict[str, Any]:
    """Return the provenance of the dataset."""
    return {
        "title": study.file.name,
        "description": study.file.description,
        "study": study.file.model_dump_json(exclude_none=True),
        "case": json.dumps(study.gearbox.content),
        "gearbox": study.gearbox.name,
        "variant": str(study.choice.variant),
        "mesh_model": study.choice.mesh_model,
        "inertias": str(study.choice.inertias),
        "load_case": str(study.choice.load_case),
        "case_digest": study.case_digest,
        "input_hash": study.case_hash,
        "method_version": STUDY,
        "method_versions": json.dumps(
            {"table": TABLE, "reduction": REDUCTION, "modes": MODES, "run": RUN, "steady": STEADY, "study": STUDY}
        ),
        "versions": json.dumps({package: version(package) for package in _PACKAGES}),
        "points": len(at),
        "failed": sum(bool(record.error) for _, record in at if record is not None),
        "missing": sum(record is None for _, record in at),
    }


def slopes(dataset: xr.Dataset) -> Iterator[tuple[str, str, float]]:
    """Yield output, parameter and relative change per step, for each scalar output with local derivatives."""
    for name in dataset.data_vars:
        output = str(name).removeprefix(SLOPE)
        if output == name or dataset[name].ndim > 1:
            continue
        mean = dataset[output].mean(SIDE).to_numpy()
        relative = dataset[name].to_numpy() * dataset["step"].to_numpy() / mean
        for parameter, change in zip(dataset[PARAMETER].to_numpy(), relative, strict=True):
            yield output, str(parameter), float(change)


def write_study(folder: Path, dataset: xr.Dataset) -> Path:
    """Write the dataset of a study into its folder as an atomic operation; return its path."""
    path = folder / DATASET
    write_dataset(path, dataset)
    return path


def load_study(path: str | Path) -> xr.Dataset:
    """Read what `write_study` wrote.

    Raises
    ------
    FileError
        The file is missing, damaged, or of another version.

    Examples
    --------
    >>> load_study("nowhere/study.nc")
    Traceback (most recent call last):
    fe_ste.tools.files.FileError: nowhere/study.nc: no such file
    """
    return load_dataset(Path(path), STUDY_LAYOUT)


# Points evaluated by an optimisation, with outputs and limits, and the dataset of all of them

EVALUATION = "evaluation"
"""Dimension of the points evaluated by an optimisation, in their order; the first is the unchanged gearbox."""
USUAL_PERCENTILE = 95.0
FAR = 1e9
"""Violation of a limit by an infinite value."""
Side = Literal["high", "low"]
"""Relevant end of an output's spread over tolerances: the high one for minimised outputs and upper limits."""


@dataclass(frozen=True, eq=False)
class EvaluatedPoint:
    """Point evaluated by an optimisation."""

    row: Floats
    """(parameters,) NaN for the unchanged gearbox."""
    draws: tuple[tuple[str, Mapping[str, Any]], ...]
    """Hash and values by path in the gearbox file for each draw of the tolerances; one entry without tolerances."""


@dataclass(frozen=True)
class Criteria:
    """Criteria for the points of an optimisation."""

    outputs: tuple[str, ...]
    limits: tuple[tuple[str, Side, float], ...]
    """Output, limited side and limit."""
    percentile: float
    """Percentile over tolerances, on the unfavourable side."""

    @classmethod
    def of(cls, study: StudyFile) -> Criteria:
        """Read the criteria from a study file with a section `optimise`."""
        wanted = study.optimise
        assert wanted is not None
        limits: list[tuple[str, Side, float]] = []
        for name, limit in wanted.limits.items():
            if limit.max is not None:
                limits.append((name, "high", limit.max))
            if limit.min is not None:
                limits.append((name, "low", limit.min))
        return cls(tuple(wanted.minimise), tuple(limits), wanted.percentile or USUAL_PERCENTILE)

    @property
    def sides(self) -> list[tuple[str, Side]]:
        """Outputs with the relevant side of their spread, each once."""
        minimised: list[tuple[str, Side]] = [(name, "high") for name in self.outputs]
        return list(dict.fromkeys([*minimised, *((name, side) for name, side, _ in self.limits)]))

    def percent(self, side: Side) -> float:
        """Return the percentile for a side."""
        return self.percentile if side == "high" else 100.0 - self.percentile

    def reduce_draws(self, values: Floats, side: Side) -> Floats:
        """Reduce an output (..., draws) to one value; a failed draw counts as the worst."""
        filled = np.where(np.isnan(values), np.inf if side == "high" else -np.inf, values)
        if filled.shape[-1] == 1:
            return filled[..., 0]
        return percentile_of(filled, self.percent(side))


def beyond(value: float, side: Side, limit: float) -> float:
    """Return the violation of an upper (high) or lower (low) limit, relative to the absolute limit.

    Examples
    --------
    >>> beyond(1.1, "low", 1.0), beyond(float("inf"), "high", 2.0)
    (-0.1..., 1000000000.0)
    """
    difference = value - limit if side == "high" else limit - value
    return float(np.clip(difference / (abs(limit) or 1.0), -FAR, FAR))


def is_pareto_optimal(outputs: Floats) -> Booleans:
    """Return which points (points, outputs) are Pareto-optimal: no other is smaller in one output and larger in none.

    Examples
    --------
    >>> is_pareto_optimal(np.array([[1.0, 4.0], [2.0, 2.0], [3.0, 3.0]])).tolist()
    [True, True, False]
    """
    kept: Booleans = np.asarray(np.isfinite(outputs).all(axis=1))
    for n in np.flatnonzero(kept):
        beaten = (outputs <= outputs[n]).all(axis=1) & (outputs < outputs[n]).any(axis=1)
        kept[n] = not beaten.any()
    return kept


def searched_dataset(
    study: Study, criteria: Criteria, points: Sequence[EvaluatedPoint], records: Mapping[str, Record]
) -> xr.Dataset:
    """Return all evaluated points of an optimisation in their order, with the percentiles used as criteria."""
    dataset = dataset_of(replace(study, design=_design(study, points)), records)
    judged = {}
    for name, side in criteria.sides:
        values = dataset[name].to_numpy().reshape(len(points), -1)
        told = f"{criteria.percent(side):g}th percentile of {name} over {values.shape[1]} draws of the tolerances"
        told += f" ({study.file.sampling}, seed {study.file.seed}, the same at every point)"
        attributes = {"units": dataset[name].attrs["units"], "long_name": told}
        judged[name, side] = ((EVALUATION,), criteria.reduce_draws(values, side), attributes)
    words = {"long_name": "whether all limits are met"}
    kept = np.ones(len(points), dtype=bool)
    for name, side, limit in criteria.limits:
        kept &= np.array([beyond(float(value), side, limit) <= 0.0 for value in judged[name, side][1]])
    outputs = np.array([judged[name, "high"][1] for name in criteria.outputs]).T
    front = is_pareto_optimal(np.where(kept[:, None], outputs, np.inf))
    if study.tolerances is not None:
        dataset = dataset.assign({judged_name(study, *side): values for side, values in judged.items()})
    if criteria.limits:
        dataset = dataset.assign(meets_limits=((EVALUATION,), kept.astype(np.int8), words))
    words = {"long_name": "whether the point is Pareto-optimal among those that meet all limits"}
    return dataset.assign(on_front=((EVALUATION,), front.astype(np.int8), words))


def judged_name(study: Study, name: str, side: Side) -> str:
    """Return the variable of the dataset used as criterion: the output, or its percentile over the tolerances."""
    return name if study.tolerances is None else f"{name}_{side}"


def _design(study: Study, points: Sequence[EvaluatedPoint]) -> Design:
    """Return the points over evaluations, and over the draws of tolerances."""
    rows = np.array([point.row for point in points])
    tolerances = study.tolerances
    axes = {EVALUATION: Axis((EVALUATION,), np.arange(len(points)))}
    for n, (name, parameter) in enumerate(study.file.parameters.items()):
        axes[name] = Axis((EVALUATION,), rows[:, n], units_of(parameter), ", ".join(parameter.targets))
    if tolerances is None:
        flat = tuple(Point((n,), point.draws[0][1]) for n, point in enumerate(points))
        return Design({EVALUATION: len(points)}, axes, flat)
    count = len(tolerances.draws)
    axes |= {SAMPLE: Axis((SAMPLE,), np.arange(1, count + 1)), **tolerances.axes}
    drawn = tuple(Point((n, m), own) for n, point in enumerate(points) for m, (_, own) in enumerate(point.draws))
    return Design({EVALUATION: len(points), SAMPLE: count}, axes, drawn)
