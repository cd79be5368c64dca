"""Pictures of a study: curves over parameters, distributions of draws, rankings of slopes, Pareto fronts."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from exugear.results.folder import PICTURES
from exugear.studies.dataset import EVALUATION, slopes
from exugear.studies.sampling import PARAMETER, SAMPLE, SIDE
from fe_ste.tools.arrays import Booleans, Floats
from fe_ste.tools.drawing import COLOURS, drawing_style, finish_figure, new_figure

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_OF_POINTS = ("error", "doubts", "seconds", "memory", "on_front", "meets_limits", "step")
MOST_CURVES = 12
"""Maximum number of curves per picture; of more values, a selection over their range is drawn."""
MOST_PANELS = 6
"""Maximum number of panels per picture."""
MARKED = (0.25, 0.5, 0.75, 0.95)
"""Quantiles marked in a distribution."""
WIDE = 30.0
"""Ratio of largest to smallest value above which a scale is logarithmic."""
MOST_PICTURES = 24
"""Maximum number of pictures per study."""
LEAST_SHARE = 1e-3
"""Fraction of the longest bar below which a bar is omitted."""
MOST_ROWS = 24
"""Maximum number of bars in a ranking."""


def draw_study(dataset: xr.Dataset, folder: Path, minimised: tuple[str, ...] = ()) -> list[Path]:
    """Draw a study into ``pictures`` in its folder; one picture per output, in a form that suits its dimensions.

    Parameters
    ----------
    dataset : as `exugear.studies.dataset.dataset_of` makes it
    minimised : outputs minimised by an optimisation, or their percentiles over tolerances
    """
    pictures: dict[str, Callable[[Figure], None]] = {}
    if SIDE in dataset.dims:
        pictures["slopes"] = lambda figure: _draw_ranking(figure, dataset)
    elif EVALUATION not in dataset.dims:
        for name, values in dataset.data_vars.items():
            if name not in _OF_POINTS and np.isfinite(values.to_numpy()).any():
                pictures[str(name)] = partial(_draw_over_parameters, values=values)
    elif len(minimised) == 2:
        pictures["front"] = lambda figure: _draw_front(figure.add_subplot(), dataset, *minimised)
    else:
        pictures["search"] = lambda figure: _draw_search(figure.add_subplot(), dataset, minimised[0])
    drawn = []
    with drawing_style():
        for stem, draw in itertools.islice(pictures.items(), MOST_PICTURES):
            path = folder / PICTURES / f"{stem}.png"
            figure = new_figure(6.4, 4.0)
            figure.suptitle(str(dataset.attrs["title"])[:80], fontsize=9.5)
            draw(figure)
            finish_figure(figure, path)
            drawn.append(path)
    return drawn


def _draw_over_parameters(figure: Figure, values: xr.DataArray) -> None:
    """Draw an output over one parameter, with a curve for each value of another and a panel for each of the others."""
    dimensions = [str(dim) for dim in values.dims if values.sizes[dim] > 1] or [str(values.dims[-1])]
    values = values.squeeze([dim for dim in values.dims if dim not in dimensions])
    numeric = [dim for dim in dimensions if dim in values.coords and values[dim].dtype.kind in "fi"]
    along = SAMPLE if SAMPLE in dimensions else (numeric or dimensions[-1:])[0]
    others = [dimension for dimension in dimensions if dimension != along]
    panels = others[:-1]
    by = others[-1:]
    labels = _combinations(values, panels)[:MOST_PANELS]
    shape = (-1, values.sizes[by[0]] if by else 1, values.sizes[along])
    stacked = values.transpose(*panels, *by, along).to_numpy().reshape(shape)
    if len(labels) > 1:
        figure.set_size_inches(3.4 * min(len(labels), 2) + 1.6, 3.0 * -(-len(labels) // 2) + 0.6)
    grid = figure.subplots(-(-len(labels) // 2), min(len(labels), 2), squeeze=False, sharey=True, sharex=True)
    if along == SAMPLE:
        draw = _draw_spread
    elif along in numeric:
        draw = _draw_curves
    else:
        draw = _draw_bars
    for axes, rows, label in zip(grid.flat, stacked, labels, strict=False):
        draw(axes, values, along, rows, _combinations(values, by))
        infinite = int(np.isinf(rows).sum())
        if infinite:  # the scale cannot show them
            text = f"{infinite} of {rows.size} infinite"
            axes.text(0.02, 0.98, text, va="top", transform=axes.transAxes, fontsize=7.5)
        axes.set_title(f"{', '.join(panels)} {label}" if panels else "")
    for axes in grid.flat[len(labels) :]:
        axes.set_visible(False)
    if by:
        handles, names = grid.flat[0].get_legend_handles_labels()
        figure.legend(handles, names, title=by[0], loc="outside right upper")


def _finite(values: Floats) -> Floats:
    """Replace infinite values by NaN."""
    return np.asarray(np.where(np.isfinite(values), values, np.nan))


def _label(values: xr.DataArray) -> str:
    units = str(values.attrs.get("units", ""))
    return f"{values.name} / {units}" if units not in ("", "1") else str(values.name)


def _draw_curves(axes: Axes, values: xr.DataArray, along: str, rows: Floats, labels: list[str]) -> None:
    x = values[along].to_numpy().astype(np.float64)
    rows = _finite(rows)
    shown = np.unique(np.linspace(0, len(labels) - 1, min(MOST_CURVES, len(labels))).round().astype(int))
    for place, n in enumerate(shown):
        style = "-" if place < len(COLOURS) else "--"
        axes.plot(x, rows[n], style, marker=".", color=COLOURS[place % len(COLOURS)], label=labels[n])
    _scale(axes, "x", x)
    axes.set_xlabel(_label(values[along]))
    axes.set_ylabel(_label(values))


def _scale(axes: Axes, which: Literal["x", "y"], values: Floats) -> None:
    """Set a logarithmic scale for a wide range of values, with numbers as plain text: the style draws no formulas."""
    from matplotlib.ticker import FuncFormatter, NullFormatter

    if not (values.size and values.min() > 0.0 and values.max() / values.min() > WIDE):
        return
    axes.set(**{f"{which}scale": "log"})
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _combinations(values: xr.DataArray, dimensions: list[str]) -> list[str]:
    """Return the labels of all combinations along some dimensions."""
    labels = [""]
    for dimension in dimensions:
        coordinate = values[dimension].to_numpy() if dimension in values.coords else np.arange(values.sizes[dimension])
        words = [f"{entry:.4g}" if isinstance(entry, float) else str(entry) for entry in coordinate]
        labels = [f"{before}, {word}".removeprefix(", ") for before in labels for word in words]
    return labels


def _draw_bars(axes: Axes, values: xr.DataArray, along: str, rows: Floats, labels: list[str]) -> None:
    combinations = _combinations(values, [along])
    rows = _finite(rows)
    width = 0.8 / min(len(labels), MOST_CURVES)
    for n, (row, label) in enumerate(zip(rows[:MOST_CURVES], labels, strict=False)):
        places = np.arange(len(combinations)) + (n - 0.5 * (min(len(labels), MOST_CURVES) - 1)) * width
        axes.bar(places, row, width, color=COLOURS[n % len(COLOURS)], label=label)
    axes.set_xticks(np.arange(len(combinations)), combinations)
    _scale(axes, "y", values.to_numpy()[np.isfinite(values.to_numpy())])
    axes.set_xlabel(along)
    axes.set_ylabel(_label(values))


def _draw_spread(axes: Axes, values: xr.DataArray, along: str, rows: Floats, labels: list[str]) -> None:
    """Draw the cumulative distribution of draws; quartiles and the 95 % quantile are marked."""
    for n, (row, label) in enumerate(zip(rows[:MOST_CURVES], labels, strict=False)):
        known: Floats = np.sort(row[~np.isnan(row)])
        if not np.isfinite(known).any():
            continue
        share = (np.arange(known.size) + 0.5) / known.size
        colour = COLOURS[n % len(COLOURS)]
        axes.plot(_finite(known), share, "-" if n < len(COLOURS) else "--", color=colour, label=label)
        marked = np.quantile(known, MARKED, method="linear" if np.isfinite(known).all() else "higher")
        axes.plot(_finite(marked), MARKED, "o", color=colour, markersize=3.5)
    _scale(axes, "x", values.to_numpy()[np.isfinite(values.to_numpy())])
    axes.set_xlabel(_label(values))
    axes.set_ylabel("fraction of draws below")
    axes.set_ylim(0.0, 1.0)


def _draw_ranking(figure: Figure, dataset: xr.Dataset) -> None:
    """Draw the change of outputs per step of each parameter, in percent, the largest at the top."""
    axes = figure.add_subplot()
    ranked = sorted(slopes(dataset), key=lambda entry: abs(entry[2]))[-MOST_ROWS:]
    ranked = [entry for entry in ranked if abs(entry[2]) >= LEAST_SHARE * abs(ranked[-1][2])]
    figures = list(dict.fromkeys(name for name, _, _ in ranked))
    for place, (name, _, change) in enumerate(ranked):
        axes.barh(place, 100.0 * change, color=COLOURS[figures.index(name) % len(COLOURS)])
    axes.set_yticks(range(len(ranked)), [f"{name} by {parameter}" for name, parameter, _ in ranked])
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set_xlabel(f"% for a step of the {PARAMETER}")
    figure.set_size_inches(6.4, max(3.0, 0.24 * len(ranked) + 1.2))


def _draw_front(axes: Axes, dataset: xr.Dataset, first: str, second: str) -> None:
    """Draw all points of an optimisation over its two outputs, with the Pareto front and the unchanged gearbox."""
    x, y = (_finite(dataset[name].to_numpy()) for name in (first, second))
    front = dataset["on_front"].to_numpy() == 1
    order = np.argsort(x[front])
    kept = _keeps_limits(dataset)
    axes.plot(x[~front & kept], y[~front & kept], ".", color="#BBBBBB", label="evaluated")
    if not kept.all():
        axes.plot(x[~kept], y[~kept], "x", color="#DDBBBB", markersize=3.5, label="limits violated")
    axes.plot(x[front][order], y[front][order], "o-", color=COLOURS[0], markersize=4, label="Pareto-optimal")
    axes.plot(x[0], y[0], "s", color=COLOURS[1], label="unchanged gearbox")
    near = [np.nanquantile(values, 0.9) for values in (x, y)]
    axes.set_xlim(0.95 * np.nanmin(x), 1.05 * max(near[0], x[0]))
    axes.set_ylim(0.95 * np.nanmin(y), 1.05 * max(near[1], y[0]))
    axes.set_xlabel(_label(dataset[first]))
    axes.set_ylabel(_label(dataset[second]))
    axes.legend()


def _draw_search(axes: Axes, dataset: xr.Dataset, name: str) -> None:
    """Draw an output at the evaluated points of an optimisation, and its best value so far."""
    values = _finite(dataset[name].to_numpy())
    kept = _keeps_limits(dataset)
    axes.plot(np.where(kept, values, np.nan), ".", color="#BBBBBB")
    if not kept.all():
        axes.plot(np.where(kept, np.nan, values), "x", color="#DDBBBB", markersize=3.5, label="limits violated")
        axes.legend()
    axes.plot(np.fmin.accumulate(np.where(kept, values, np.nan)), color=COLOURS[0])
    low = float(np.nanmin(values))
    high = float(np.nanquantile(values, 0.9))
    axes.set_ylim(top=high + 0.05 * max(abs(high), high - low))
    axes.set_xlabel(EVALUATION)
    axes.set_ylabel(_label(dataset[name]))


def _keeps_limits(dataset: xr.Dataset) -> Booleans:
    """Return which points of an optimisation meet its limits; all without limits."""
    if "meets_limits" not in dataset:
        return np.ones(dataset.sizes[EVALUATION], dtype=bool)
    return np.asarray(dataset["meets_limits"].to_numpy() == 1)
