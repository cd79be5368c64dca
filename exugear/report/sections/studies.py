"""Section "Studies": what sweeps over parameters found, those of the same case alone."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr

from exugear.findings.stored import OTHER_INPUT
from exugear.findings.words import figure_text
from exugear.model.gearbox import BESIDE_EQUATIONS
from exugear.report.parts.charts import Axis, Curve, chart
from exugear.report.parts.material import Material, Part
from exugear.studies.dataset import DATASET, load_study, slopes
from exugear.web import pieces
from exugear.web.pieces import Cell
from fe_ste.tools.files import FileError

OF_POINTS = ("error", "doubts", "seconds", "memory")
"""Variables of a study that are no figures."""
MOST_DRAWN = 6
"""Figures of a study that are drawn."""


def studies_section(material: Material) -> Part:
    """Show the studies that lie in the results folder."""
    charts: dict[str, Any] = {}
    content = [_study(material, name, data, charts) for name, data in _stored(material)]
    html = pieces.section("Studies", *content, name="studies")
    return Part(html, {"charts": charts}, "Studies", "studies")


def _stored(material: Material) -> Iterator[tuple[str, xr.Dataset]]:
    context = material.context
    for path in sorted(context.folder.glob(f"studies/*/{DATASET}")):
        try:
            data = load_study(path)
            own, kept = (_equations(content) for content in (json.loads(data.attrs["case"]), context.gearbox.content))
        except (FileError, ValueError) as error:
            context.notes.left_out.append(f"{context.name_of(path)}: {error}")
            continue
        if own == kept:
            yield path.parent.name, data
        else:
            context.notes.left_out.append(f"{context.name_of(path)}: {OTHER_INPUT}")


def _equations(content: Mapping[str, Any]) -> str:
    """Write what the equations depend on, to compare."""
    return json.dumps({key: value for key, value in content.items() if key not in BESIDE_EQUATIONS}, sort_keys=True)


def _study(material: Material, name: str, data: xr.Dataset, charts: dict[str, Any]) -> str:
    counts = [f"{int(data.attrs[key])} {key}" for key in ("points", "failed", "missing") if int(data.attrs[key])]
    said = f"{data.attrs.get('description', '')} {', '.join(counts)}; variant {data.attrs['variant']}.".strip()
    figures = _figures(data)
    title = str(data.attrs["title"])
    rows = [_row(data, figure) for figure in figures]
    own = [row for row in rows if row is not None]
    tables = pieces.table(
        own, ("least at", "largest at"), caption=f"Figures of the study {title}", name=f"study-{name}"
    )
    steep = [
        {"figure": figure, "parameter": parameter, "slope": Cell(figure_text(slope), slope)}
        for figure, parameter, slope in slopes(data)
    ]
    sloped = pieces.table(steep, ("parameter",), caption=f"Slopes of the study {title}", sortable=True)
    return pieces.section(
        title, pieces.paragraph(said, "note"), _drawn(material, name, data, figures, charts), tables, sloped, level=3
    )


def _figures(data: xr.Dataset) -> list[str]:
    """Names of the figures that are one number a point, or one for each of some labels."""
    dimensions = _dimensions(data)
    return [
        str(name)
        for name, values in data.data_vars.items()
        if values.dims[: len(dimensions)] == dimensions and str(name) not in OF_POINTS and values.dtype.kind == "f"
    ]


def _dimensions(data: xr.Dataset) -> tuple[Any, ...]:
    return tuple(data["error"].dims)


def _parameters(data: xr.Dataset) -> list[str]:
    """Names of the coordinates that are parameters of the case."""
    return [str(name) for name, values in data.coords.items() if "path" in values.attrs]


def _row(data: xr.Dataset, figure: str) -> dict[str, object] | None:
    values = data[figure].to_numpy()
    if data[figure].dims != _dimensions(data):
        return None  # its labels are drawn, or in the file
    if not np.isfinite(values).any():
        return None
    told = {}
    for words, place in (("least", np.nanargmin(values)), ("largest", np.nanargmax(values))):
        index = dict(zip(_dimensions(data), np.unravel_index(int(place), values.shape), strict=True))
        value = float(values[tuple(index.values())])
        told[words] = Cell(figure_text(value, 4), value)
        told[f"{words} at"] = Cell(_place(data, index))
    named = str(data[figure].attrs.get("long_name") or figure)
    return {"figure": f"{named} / {data[figure].attrs.get('units', '1')}", **told}


def _place(data: xr.Dataset, index: Mapping[Any, Any]) -> str:
    parts = []
    for name in _parameters(data):
        own = data[name].isel({key: value for key, value in index.items() if key in data[name].dims})
        value = own.to_numpy().item()
        parts.append(f"{name} = {figure_text(value, 4) if isinstance(value, float) else value}")
    return ", ".join(parts)


def _drawn(material: Material, name: str, data: xr.Dataset, figures: list[str], charts: dict[str, Any]) -> str:
    """Draw figures over the parameter of a study that has one alone."""
    dimensions = _dimensions(data)
    axes = [axis for axis in _parameters(data) if data[axis].dims == dimensions and data[axis].dtype.kind in "fi"]
    if len(dimensions) != 1 or not axes or data.sizes[dimensions[0]] < 3:
        return ""
    drawn = []
    for number, figure in enumerate(figures[:MOST_DRAWN]):
        x, y = data[axes[0]], data[figure]
        unit = x.attrs.get("units", "")
        html, spec = chart(
            f"study-{name}-{number}",
            str(y.attrs.get("long_name") or figure),
            "",
            f"{data.sizes[dimensions[0]]} points.",
            _curves(x, y),
            [Axis(f"{axes[0]} / {unit}" if unit else axes[0]), Axis(str(y.attrs.get("units", "1")))],
            material.arrays,
        )
        drawn.append(html)
        charts.update(spec)
    return pieces.element("div", "".join(drawn), class_="grid") if drawn else ""


def _curves(x: xr.DataArray, y: xr.DataArray) -> list[Curve]:
    """One curve of a figure, or one for each of its first labels."""
    values = x.to_numpy().astype(np.float64)
    if y.ndim == 1:
        return [Curve(str(y.name), values, y.to_numpy())]
    labels = y[y.dims[1]].to_numpy()[:MOST_DRAWN]
    return [Curve(f"{y.dims[1]} {label}", values, y.to_numpy()[:, n]) for n, label in enumerate(labels)]
