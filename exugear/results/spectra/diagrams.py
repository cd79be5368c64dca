"""Diagrams of run-ups: waterfalls with order lines, and levels along the orders."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.units import RPM
from exugear.results.spectra.resonances import Pick
from exugear.results.spectra.waterfall import OrderLine, Waterfall
from fe_ste.tools.arrays import Floats
from fe_ste.tools.drawing import (
    COLOURS,
    COLUMN_WIDTHS,
    axes_or_new,
    drawable,
    drawing_style,
    finish_figure,
    label_curves,
    new_figure,
    order_styles,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

MARK_COLOUR = "#00E5FF"
"""Colour of circled peaks, which contrasts with the colours of a waterfall."""

DYNAMIC_RANGE = 110.0
"""Span of the colours below the highest level, dB."""
TRANSMISSION_ERROR = "overall transmission error"


def plot_waterfalls(
    runs: Mapping[str, Waterfall],
    lines: Iterable[OrderLine],
    path: str | Path | None = None,
    *,
    marks: Mapping[str, Sequence[Pick]] | None = None,
    highest_frequency: float | None = None,
    dynamic_range: float = DYNAMIC_RANGE,
    quantity: str = TRANSMISSION_ERROR,
) -> Figure:
    """Draw waterfalls next to each other on a common scale.

    Parameters
    ----------
    runs : title and spectra of each panel
    marks : peaks to circle and number in a panel, such as those that only this run shows
    highest_frequency : end of the frequency axis, Hz
    dynamic_range : span of the colours below the highest level of all runs, dB
    quantity : quantity of the level, for the label of the colour bar

    Returns
    -------
    frequency over speed of the carrier, with colours for the level

    Raises
    ------
    ValueError
        If there is no run, or the runs differ in unit or reference and so cannot share a scale.
    """
    if not runs:
        raise ValueError("plot_waterfalls: no run specified")
    if len({(run.unit, run.reference) for run in runs.values()}) > 1:
        raise ValueError("plot_waterfalls: the runs differ in unit or reference; they share no scale")
    top = highest_frequency or min(float(run.frequency[-1]) for run in runs.values())
    fastest = max(float(run.speed.max()) for run in runs.values()) / RPM
    highest = max(float(run.level[:, run.frequency <= top].max()) for run in runs.values())
    order_lines = tuple(lines)
    with drawing_style():
        figure = new_figure(4.6 * len(runs) + 1.0, 5.0)
        panels = figure.subplots(1, len(runs), sharex=True, sharey=True, squeeze=False)[0]
        for panel, (name, run) in zip(panels, runs.items(), strict=True):
            image = _draw_waterfall(panel, run, order_lines, (fastest, top), (highest - dynamic_range, highest))
            panel.set_title(name, loc="left", pad=24.0)
            for number, pick in enumerate((marks or {}).get(name, ()), start=1):
                speed = pick.speed / RPM
                frequency = 1e-3 * pick.frequency
                panel.plot(speed, frequency, "o", markersize=9, markerfacecolor="none", markeredgecolor=MARK_COLOUR)
                panel.annotate(
                    str(number), (speed, frequency), (6, 6), textcoords="offset points", fontsize=8, color=MARK_COLOUR
                )
        panels[0].set_ylabel("Frequency / kHz")
        label = _level_label(quantity, next(iter(runs.values())))
        figure.colorbar(image, ax=panels, label=label, extend="min", aspect=30)
        caption = "; ".join(sorted({run.description for run in runs.values()}))
        figure.supxlabel(caption, fontsize=7.5, color="#555555")
        return finish_figure(figure, path)


def draw_waterfall(
    run: Waterfall,
    lines: Iterable[OrderLine],
    ax: Axes | None = None,
    *,
    highest_frequency: float | None = None,
    quantity: str = TRANSMISSION_ERROR,
) -> Axes:
    """Draw a waterfall with order lines, see `exugear.transient.outcome.Run.plot` and `plot_waterfalls`."""
    top = min(highest_frequency or math.inf, float(run.frequency[-1]))
    highest = float(run.level[:, run.frequency <= top].max())
    with axes_or_new(ax, 6.0, 4.6) as panel:
        limits = (float(run.speed.max()) / RPM, top), (highest - DYNAMIC_RANGE, highest)
        image = _draw_waterfall(panel, run, tuple(lines), *limits)
        panel.set_ylabel("Frequency / kHz")
        panel.figure.colorbar(image, ax=panel, label=_level_label(quantity, run), extend="min", aspect=30)
        return panel


def draw_levels(run: Waterfall, lines: Iterable[OrderLine], ax: Axes | None = None) -> Axes:
    """Draw the levels along orders over speed, see `exugear.transient.outcome.Run.plot`."""
    lines = list(lines)
    with axes_or_new(ax, COLUMN_WIDTHS[2], 4.0) as panel:
        styles = order_styles([line.name for line in lines])
        for line in lines:
            panel.plot(run.speed / RPM, run.along(line), label=drawable(line.name), **styles[line.name])
        panel.set(xlabel="Input speed / rpm", ylabel=_level_label(TRANSMISSION_ERROR, run))
        label_curves(panel)
        return panel


def draw_highest_levels(
    runs: Mapping[str, Waterfall], marks: Mapping[str, Sequence[Pick]], ax: Axes | None = None
) -> Axes:
    """Draw the highest level of runs over speed, see `exugear.results.spectra.run_spectra.Comparison.plot`."""
    with axes_or_new(ax, 6.0, 4.0) as panel:
        for number, (name, run) in enumerate(runs.items()):
            colour = COLOURS[number % len(COLOURS)]
            panel.plot(run.speed / RPM, run.level.max(axis=1), color=colour, label=drawable(name))
            at = np.array([(pick.speed / RPM, pick.level) for pick in marks.get(name, ())]).reshape(-1, 2)
            panel.plot(*at.T, "o", color=colour, markerfacecolor="none", label=f"only {drawable(name)}")
        panel.set(xlabel="Input speed / rpm", ylabel=_level_label(TRANSMISSION_ERROR, next(iter(runs.values()))))
        panel.legend()
        return panel


def _level_label(quantity: str, run: Waterfall) -> str:
    return f"{quantity[0].upper()}{quantity[1:]}, level / dB re {run.reference_text}"


def _draw_waterfall(
    panel: Axes, run: Waterfall, lines: Sequence[OrderLine], ends: tuple[float, float], levels: tuple[float, float]
) -> AxesImage:
    """Draw levels and order lines up to a speed (rpm) and a frequency (Hz), with colours between two levels (dB)."""
    fastest, top = ends
    image = panel.imshow(
        pooled_levels(run, top, fastest * RPM),
        extent=(0.0, fastest, 0.0, 1e-3 * top),
        origin="lower",
        aspect="auto",
        interpolation="nearest",
        cmap="inferno",
        clim=levels,
    )
    panel.grid(False)
    panel.set(xlim=(0.0, fastest), ylim=(0.0, 1e-3 * top), xlabel="Input speed / rpm")
    _draw_order_lines(panel, lines, fastest, top)
    return image


def pooled_levels(
    run: Waterfall, highest_frequency: float, fastest: float, shape: tuple[int, int] = (700, 450)
) -> Floats:
    """Return the highest level in each cell of a picture, so that narrow lines are not lost between its pixels.

    Parameters
    ----------
    highest_frequency, fastest : upper ends of the axes, Hz and rad/s; the axes begin at zero
    shape : maximum number of cells along frequency and speed

    Returns
    -------
    (frequencies, speeds) dB; NaN at speeds that the run does not reach
    """
    shown = run.frequency <= highest_frequency
    rows = min(shape[0], max(1, int(np.count_nonzero(shown)) - 1))
    columns = min(shape[1], max(1, run.speed.size // 2))
    row = np.minimum((rows * run.frequency[shown] / highest_frequency).astype(np.int64), rows - 1)
    column = np.minimum((columns * run.speed / fastest).astype(np.int64), columns - 1)
    cells = np.full((columns, rows), -np.inf)
    np.maximum.at(cells, (column[:, None], row[None, :]), run.level[:, shown])
    empty = np.isneginf(cells).all(axis=1)
    if empty.any():
        # A cell between two frames takes the nearer frame; beyond the run, cells are empty.
        filled = np.flatnonzero(~empty)
        nearest = filled[np.abs(np.arange(columns)[:, None] - filled).argmin(axis=1)]
        inside = (np.arange(columns) >= filled[0]) & (np.arange(columns) <= filled[-1])
        cells = np.where(inside[:, None], cells[nearest], np.nan)
    return np.where(np.isneginf(cells), np.nan, cells).T


def _draw_order_lines(panel: Axes, lines: Sequence[OrderLine], fastest: float, top: float) -> None:
    """Draw white lines from the origin (rpm, kHz) and name each where it leaves the panel, above or to the right."""
    taken_above: list[float] = []
    taken_right: list[float] = []
    for line in sorted(lines, key=lambda line: line.order):
        end = float(line.frequency(fastest * RPM))
        above = end > top
        speed, frequency = (fastest * top / end, top) if above else (fastest, end)
        # Sparse dots, as a full line would hide the level along it.
        panel.plot([0.0, speed], [0.0, 1e-3 * frequency], color="white", linewidth=0.8, linestyle=(0, (1, 7)))
        taken, position = (taken_above, speed / fastest) if above else (taken_right, frequency / top)
        if all(abs(position - other) > 0.04 for other in taken):
            taken.append(position)
            label = panel.annotate(
                drawable(line.name), (speed, 1e-3 * frequency), (3.0, 2.0), textcoords="offset points"
            )
            label.set(fontsize=7.0, annotation_clip=False, va="bottom" if above else "center")
            label.set_rotation(35.0 if above else 0.0)
