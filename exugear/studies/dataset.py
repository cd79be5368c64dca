"""The result of a study: one labelled dataset over its parameters, with where it comes from."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.versions import MODES, REDUCTION, RUN, STEADY, STUDY
from exugear.results.study_files import DATASET, STUDY_LAYOUT
from exugear.studies.design.sampling import PARAMETER, SIDE
from exugear.studies.journal import Record, number_of
from exugear.studies.study import Study
from fe_ste.tools.sealed import load_dataset, write_dataset
from fe_ste.tools.versions import TABLE

if TYPE_CHECKING:
    import xarray as xr

_PACKAGES = ("exugear", "numpy", "scipy", "numba", "exudyn")
_LOCAL = "slope_"
"""Before the name of a figure: its local derivative."""


def dataset_of(study: Study, records: Mapping[str, Record]) -> xr.Dataset:
    """Put finished points together; what is missing or failed is not a number, `error` says why.

    Parameters
    ----------
    records : by hash

    Returns
    -------
    xarray.Dataset
        Figures over the parameters; `error`, `doubts`, `seconds` and `memory` of each point; as attributes the study,
        its case, versions and numbers of points.
    """
    import xarray as xr

    design = study.design
    sizes = tuple(design.shape.values())
    dimensions = tuple(design.shape)
    at = [(point.index, records.get(name)) for name, point in study.hashed_points()]
    done = [(index, record) for index, record in at if record is not None]
    variables: dict[str, Any] = {}
    labels: dict[str, list[str]] = {}
    for name, kept in study.figures.items():
        dimension = kept.figure.dimension
        if dimension:
            told = [label for _, record in done for label in record.values.get(name, {})]
            labels[dimension] = list(dict.fromkeys([*labels.get(dimension, []), *told]))
    for name, kept in study.figures.items():
        dimension = kept.figure.dimension
        attributes = {"units": kept.units, "long_name": kept.figure.description}
        attributes["options"] = json.dumps(dict(kept.options))
        if dimension:
            values = _filled(
                (*sizes, len(labels[dimension])), done, lambda record, n=name, d=dimension: _row(record, n, labels[d])
            )
            variables[name] = ((*dimensions, dimension), values, attributes)
        else:
            values = _filled(sizes, done, lambda record, n=name: number_of(record.values.get(n)))
            variables[name] = (dimensions, values, attributes)
    variables |= _of_points(dimensions, sizes, at)
    coordinates: dict[str, Any] = {
        name: (axis.dimensions, axis.values, {"units": axis.units, "path": axis.path} if axis.path else {})
        for name, axis in design.axes.items()
    }
    coordinates |= {name: (name, np.array(names, dtype=object)) for name, names in labels.items() if names}
    dataset = xr.Dataset(variables, coordinates, _attributes(study, at))
    if SIDE in design.shape:
        return with_slopes(dataset, study)
    return dataset


def _filled(shape: tuple[int, ...], done: list[tuple[tuple[int, ...], Record]], value: Any) -> Any:
    values = np.full(shape, math.nan)
    for index, record in done:
        values[index] = value(record)
    return values


def _row(record: Record, name: str, labels: list[str]) -> list[float]:
    own = record.values.get(name) or {}
    return [number_of(own.get(label)) for label in labels]


def _of_points(
    dimensions: tuple[str, ...], sizes: tuple[int, ...], at: list[tuple[tuple[int, ...], Record | None]]
) -> dict[str, Any]:
    """Tell of every point what is no figure."""
    error, doubts = (np.full(sizes, "", dtype=object) for _ in range(2))
    seconds, memory = (np.full(sizes, math.nan) for _ in range(2))
    for index, record in at:
        if record is None:
            error[index] = "missing: not computed yet"
            continue
        error[index], doubts[index] = record.error, "; ".join(record.doubts)
        seconds[index], memory[index] = record.seconds, record.memory
    return {
        "error": (dimensions, error, {"long_name": "why a point has no figures"}),
        "doubts": (dimensions, doubts, {"long_name": "what speaks against trusting a point"}),
        "seconds": (dimensions, seconds, {"units": "s", "long_name": "wall time of a point"}),
        "memory": (dimensions, memory, {"units": "B", "long_name": "peak memory of its process so far"}),
    }


def _attributes(study: Study, at: list[tuple[tuple[int, ...], Record | None]]) -> dict[str, Any]:
    """Where the dataset comes from."""
    return {
        "title": study.file.name,
        "description": study.file.description,
        "study": study.file.model_dump_json(exclude_none=True),
        "case": json.dumps(study.gearbox.content),
        "gearbox": study.gearbox.name,
        "variant": str(study.choice.variant),
        "mesh_law": study.choice.mesh_law,
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


def with_slopes(dataset: xr.Dataset, study: Study) -> xr.Dataset:
    """Add the local derivative of each figure by each parameter: the central difference over two steps."""
    added = {}
    for name, kept in study.figures.items():
        below, above = (dataset[name].isel({SIDE: side}) for side in (0, 1))
        slope = (above - below) / (2.0 * dataset["step"])
        slope = slope.transpose(PARAMETER, ...)
        slope.attrs = {"units": f"{kept.units} per unit of the parameter", "long_name": f"slope of {name}"}
        added[f"{_LOCAL}{name}"] = slope
    return dataset.assign(added)


def slopes(dataset: xr.Dataset) -> Iterator[tuple[str, str, float]]:
    """Figure, parameter and relative change for a step up of each single figure of local derivatives."""
    for name in dataset.data_vars:
        figure = str(name).removeprefix(_LOCAL)
        if figure == name or dataset[name].ndim > 1:
            continue
        mean = dataset[figure].mean(SIDE).to_numpy()
        relative = dataset[name].to_numpy() * dataset["step"].to_numpy() / mean
        for parameter, change in zip(dataset[PARAMETER].to_numpy(), relative, strict=True):
            yield figure, str(parameter), float(change)


def write_study(folder: Path, dataset: xr.Dataset) -> Path:
    """Write the dataset of a study into its folder, whole or not at all; return its path."""
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
