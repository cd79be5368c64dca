"""Diagrams of runs and modes: waterfalls with order lines, order levels, Campbell, sensitivities, energies.

All take plain arrays or the small objects of `exugear.spectra.waterfall`, and return a matplotlib figure that needs
no display.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from exugear.spectra.orders import OrderLine
from exugear.spectra.resonances import Pick
from exugear.spectra.waterfall import Waterfall, line_level
from fe_ste.tools.arrays import Floats
from fe_ste.tools.drawing import COLOURS, WARNING_COLOUR, drawable, drawing_style, finish_figure, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_RPM = 60.0 / (2.0 * math.pi)
_MARK_COLOUR = "#00E5FF"


def plot_waterfalls(
    runs: Mapping[str, Waterfall],
    lines: Iterable[OrderLine],
    path: str | Path | None = None,
    *,
    marks: Mapping[str, Sequence[Pick]] | None = None,
    highest_frequency: float | None = None,
    dynamic_range: float = 110.0,
    quantity: str = "overall transmission error",
) -> Figure:
    """Draw waterfalls side by side on one scale.

    Parameters
    ----------
    runs : mapping of str to Waterfall
        Title and spectra of each panel.
    lines : iterable of OrderLine
        Order lines to draw and name.
    path : path-like, optional
        Where to write the picture.
    marks : mapping of str to sequence of Pick, optional
        Peaks to circle and number in a panel, such as those that only this run shows.
    highest_frequency : float, optional
        End of the frequency axis, Hz.
    dynamic_range : float
        Span of the colours below the highest level of all runs, dB.
    quantity : str
        What the level is of, for the colour bar.

    Returns
    -------
    matplotlib.figure.Figure
        Frequency over speed of the carrier, the level in colours.

    Raises
    ------
    ValueError
        If there is no run, or the runs differ in unit or reference and so cannot share a scale.
    """
    if not runs:
        raise ValueError("plot_waterfalls: no run given")
    if len({(run.unit, run.reference) for run in runs.values()}) > 1:
        raise ValueError("plot_waterfalls: the runs differ in unit or reference; they share no scale")
    first = next(iter(runs.values()))
    top = highest_frequency or min(float(run.frequency[-1]) for run in runs.values())
    fastest = _RPM * max(float(run.speed.max()) for run in runs.values())
    loudest = max(float(run.level[:, run.frequency <= top].max()) for run in runs.values())
    drawn = tuple(lines)
    with drawing_style():
        figure = new_figure(4.6 * len(runs) + 1.0, 5.0)
        panels = figure.subplots(1, len(runs), sharex=True, sharey=True, squeeze=False)[0]
        for panel, (name, run) in zip(panels, runs.items(), strict=True):
            image = panel.imshow(
                pooled_levels(run, top, fastest / _RPM),
                extent=(0.0, fastest, 0.0, 1e-3 * top),
                origin="lower",
                aspect="auto",
                interpolation="nearest",
                cmap="inferno",
                clim=(loudest - dynamic_range, loudest),
            )
            panel.grid(False)
            panel.set(xlim=(0.0, fastest), ylim=(0.0, 1e-3 * top), xlabel="Carrier speed / rpm")
            panel.set_title(name, loc="left", pad=24.0)
            _draw_order_lines(panel, drawn, fastest, top, "white")
            _draw_marks(panel, (marks or {}).get(name, ()))
        panels[0].set_ylabel("Frequency / kHz")
        label = f"{quantity[0].upper()}{quantity[1:]}, level / dB re {first.reference_text}"
        figure.colorbar(image, ax=panels, label=label, extend="min", aspect=30)
        caption = "; ".join(sorted({run.description for run in runs.values()}))
        figure.supxlabel(caption, fontsize=7.5, color="#555555")
        return finish_figure(figure, path)


def pooled_levels(
    run: Waterfall, highest_frequency: float, fastest: float, shape: tuple[int, int] = (700, 450)
) -> Floats:
    """Highest level in each cell of a picture, so that no narrow line falls between its pixels.

    Parameters
    ----------
    run : Waterfall
        Spectra.
    highest_frequency, fastest : float
        Ends of both axes, Hz and rad/s; they begin at zero.
    shape : (int, int)
        At most so many cells along frequency and speed.

    Returns
    -------
    (frequencies, speeds) array
        dB; NaN at speeds that the run does not reach.
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
        # A cell between two frames takes the nearer frame; beyond the run there is nothing.
        filled = np.flatnonzero(~empty)
        nearest = filled[np.abs(np.arange(columns)[:, None] - filled).argmin(axis=1)]
        inside = (np.arange(columns) >= filled[0]) & (np.arange(columns) <= filled[-1])
        cells = np.where(inside[:, None], cells[nearest], np.nan)
    return np.where(np.isneginf(cells), np.nan, cells).T


def _draw_order_lines(panel: Axes, lines: Sequence[OrderLine], fastest: float, top: float, colour: str) -> None:
    """Draw lines from the origin (rpm, kHz) and name each where it leaves the panel, above or to the right."""
    taken_above: list[float] = []
    taken_right: list[float] = []
    for line in sorted(lines, key=lambda line: line.order):
        end = float(line.frequency(fastest / _RPM))
        above = end > top
        speed, frequency = (fastest * top / end, top) if above else (fastest, end)
        # Sparse dots: a full line would hide the level on it.
        panel.plot([0.0, speed], [0.0, 1e-3 * frequency], color=colour, linewidth=0.8, linestyle=(0, (1, 7)))
        taken, place = (taken_above, speed / fastest) if above else (taken_right, frequency / top)
        if all(abs(place - other) > 0.04 for other in taken):
            taken.append(place)
            label = panel.annotate(line.name, (speed, 1e-3 * frequency), (3.0, 2.0), textcoords="offset points")
            label.set(fontsize=7.0, annotation_clip=False, va="bottom" if above else "center")
            label.set_rotation(35.0 if above else 0.0)


def _draw_marks(panel: Axes, picks: Sequence[Pick]) -> None:
    for number, pick in enumerate(picks, start=1):
        speed, frequency = _RPM * pick.speed, 1e-3 * pick.frequency
        panel.plot(speed, frequency, "o", markersize=9, markerfacecolor="none", markeredgecolor=_MARK_COLOUR)
        panel.annotate(
            str(number), (speed, frequency), (6, 6), textcoords="offset points", fontsize=8, color=_MARK_COLOUR
        )


def plot_order_levels(
    runs: Mapping[str, Waterfall],
    lines: Iterable[OrderLine],
    path: str | Path | None = None,
    *,
    marks: Mapping[str, Sequence[Pick]] | None = None,
    eigenfrequencies: ArrayLike = (),
) -> Figure:
    """Draw the levels along order lines over frequency, one panel a line, all runs in it.

    Parameters
    ----------
    runs : mapping of str to Waterfall
        Name in the legend and spectra.
    lines : iterable of OrderLine
        One panel each.
    path : path-like, optional
        Where to write the picture.
    marks : mapping of str to sequence of Pick, optional
        Peaks of a run to mark on its curve.
    eigenfrequencies : array_like, shape (n,)
        Hz, as thin vertical lines.

    Returns
    -------
    matplotlib.figure.Figure
    """
    panels_for = tuple(lines)
    if not panels_for or not runs:
        raise ValueError("plot_order_levels: at least one line and one run are needed")
    first = next(iter(runs.values()))
    with drawing_style():
        figure = new_figure(7.2, 2.1 * len(panels_for) + 0.4)
        panels = figure.subplots(len(panels_for), 1, squeeze=False)[:, 0]
        for panel, line in zip(panels, panels_for, strict=True):
            for (name, run), colour in zip(runs.items(), COLOURS, strict=False):
                panel.plot(1e-3 * line.frequency(run.speed), line_level(run, line), color=colour, label=name)
                for pick in (marks or {}).get(name, ()):
                    if pick.line == line:
                        panel.plot(1e-3 * pick.frequency, pick.level, "v", color=colour, markersize=6)
            left, right = panel.get_xlim()
            inside = [value for value in 1e-3 * np.asarray(eigenfrequencies, dtype=np.float64) if left < value < right]
            for value in inside:
                panel.axvline(value, color="#999999", linewidth=0.6, zorder=0)
            panel.set_title(f"order {line.order:g}: {line.name}", loc="left")
            panel.set_ylabel("Level / dB")
            panel.margins(x=0.0)
            low, high = panel.get_ylim()
            panel.set_ylim(min(low, high - 20.0), high)
        panels[0].legend(loc="best", ncols=len(runs))
        panels[-1].set_xlabel(f"Frequency on the order / kHz; 0 dB = {first.reference_text}")
        return finish_figure(figure, path)


def plot_campbell(
    eigenfrequencies: ArrayLike,
    lines: Iterable[OrderLine],
    fastest: float,
    path: str | Path | None = None,
    *,
    names: Sequence[str] = (),
    weights: ArrayLike | None = None,
    highest_frequency: float | None = None,
    title: str = "",
) -> Figure:
    """Draw eigenfrequencies against order lines and mark where they cross.

    Parameters
    ----------
    eigenfrequencies : array_like, shape (n,)
        Hz.
    lines : iterable of OrderLine
        Orders that excite.
    fastest : float
        Highest speed of the carrier, rad/s.
    path : path-like, optional
        Where to write the picture.
    names : sequence of str
        Names of the modes, written on their lines.
    weights : array_like, shape (n,), optional
        How strongly the observed quantity sees each mode, 0 to 1: the size of its crossings.
    highest_frequency : float, optional
        End of the frequency axis, Hz.
    title : str
        Variant and inertia set.

    Returns
    -------
    matplotlib.figure.Figure
    """
    modes = np.asarray(eigenfrequencies, dtype=np.float64)
    size = np.ones(modes.size) if weights is None else np.asarray(weights, dtype=np.float64)
    drawn = tuple(lines)
    top = highest_frequency or 1.1 * float(max([modes.max(initial=0.0), 1.0]))
    end_speed = _RPM * fastest
    with drawing_style():
        figure = new_figure(7.2, 5.0)
        panel = figure.add_subplot()
        panel.grid(False)
        for mode in modes[modes <= top]:
            panel.axhline(1e-3 * mode, color="#BBBBBB", linewidth=0.8, zorder=1)
        for line, colour in zip(drawn, _repeated(len(drawn)), strict=True):
            end = float(line.frequency(fastest))
            reach = min(1.0, top / end)
            panel.plot([0.0, reach * end_speed], [0.0, 1e-3 * reach * end], color=colour, label=line.name, zorder=2)
            crossed = (modes <= reach * end) & (modes > 0.0)
            speeds = end_speed * modes[crossed] / end
            panel.scatter(speeds, 1e-3 * modes[crossed], s=8.0 + 60.0 * size[crossed], color=colour, zorder=3)
        for name, mode in zip(names, modes, strict=False):
            if mode <= top:
                panel.annotate(
                    name, (end_speed, 1e-3 * mode), (4, 0), textcoords="offset points", va="center", fontsize=7.0
                )
        panel.set(xlim=(0.0, end_speed), ylim=(0.0, 1e-3 * top))
        panel.set(xlabel="Carrier speed / rpm", ylabel="Frequency / kHz")
        panel.set_title(title, loc="left")
        figure.legend(loc="outside upper center", ncols=4)
        return finish_figure(figure, path)


def _repeated(count: int) -> list[str]:
    return [COLOURS[index % len(COLOURS)] for index in range(count)]


@dataclass(frozen=True)
class Sensitivity:
    """Frequencies over a parameter.

    Attributes
    ----------
    label : str
        Parameter with its unit, for the axis.
    values : (n,) array
        Parameter values.
    frequencies : (n, m) array
        Hz, one column a mode; NaN where a mode does not exist.
    weights : (n, m) array, optional
        How strongly the observed quantity sees each mode, 0 to 1: the size of the points.
    default : float, optional
        Value of the default model.
    logarithmic : bool
        Scale of the parameter axis.
    """

    label: str
    values: Floats
    frequencies: Floats
    weights: Floats | None = None
    default: float | None = None
    logarithmic: bool = False


def plot_sensitivities(
    sweeps: Sequence[Sensitivity],
    path: str | Path | None = None,
    *,
    target: float | None = None,
    window: tuple[float, float] | None = None,
    title: str = "",
) -> Figure:
    """Draw how eigenfrequencies move with model parameters, side by side on one frequency scale.

    Parameters
    ----------
    sweeps : sequence of Sensitivity
        One panel each.
    path : path-like, optional
        Where to write the picture.
    target : float, optional
        Frequency to compare with, Hz, as a dashed line.
    window : (float, float), optional
        Ends of the frequency axis, Hz.
    title : str
        Model and mode.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If values and frequencies of a sweep do not fit.
    """
    for sweep in sweeps:
        if sweep.frequencies.ndim != 2 or sweep.frequencies.shape[0] != sweep.values.size:
            raise ValueError(
                f"sensitivity {sweep.label!r}: frequencies {sweep.frequencies.shape} must have one row "
                f"for each of {sweep.values.size} values"
            )
    with drawing_style():
        figure = new_figure(2.7 * len(sweeps) + 0.6, 3.4)
        panels = figure.subplots(1, len(sweeps), sharey=True, squeeze=False)[0]
        for panel, sweep in zip(panels, sweeps, strict=True):
            _draw_sensitivity(panel, sweep)
            if target is not None:
                panel.axhline(1e-3 * target, color=WARNING_COLOUR, linewidth=1.0, linestyle="--", zorder=1)
                panel.annotate(
                    f"{target:.0f} Hz", (0.02, 1e-3 * target), (0, 2), xycoords=("axes fraction", "data"),
                    textcoords="offset points", color=WARNING_COLOUR, fontsize=7.5,
                )  # fmt: skip
        if window is not None:
            panels[0].set_ylim(1e-3 * window[0], 1e-3 * window[1])
        panels[0].set_ylabel("Eigenfrequency / kHz")
        figure.suptitle(title, fontsize=9.5)
        return finish_figure(figure, path)


def _draw_sensitivity(panel: Axes, sweep: Sensitivity) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    size = np.ones(sweep.frequencies.shape) if sweep.weights is None else sweep.weights
    for column, colour in enumerate(_repeated(sweep.frequencies.shape[1])):
        frequency = 1e-3 * sweep.frequencies[:, column]
        panel.plot(sweep.values, frequency, color=colour, linewidth=1.0, alpha=0.6)
        panel.scatter(sweep.values, frequency, s=4.0 + 40.0 * size[:, column], color=colour, zorder=3)
    if sweep.default is not None:
        panel.axvline(sweep.default, color="#555555", linewidth=0.8, linestyle=":")
        panel.annotate(
            "default", (sweep.default, 1.0), (2, -2), xycoords=("data", "axes fraction"),
            textcoords="offset points", va="top", rotation=90, fontsize=7.0, color="#555555",
        )  # fmt: skip
    if sweep.logarithmic:
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        panel.xaxis.set_minor_locator(NullLocator())
    panel.set_xlabel(sweep.label)


def plot_mode_energies(
    strain: Mapping[str, float],
    kinetic: Mapping[str, float],
    path: str | Path | None = None,
    *,
    title: str = "",
    least_share: float = 0.01,
) -> Figure:
    """Draw where the energy of a mode sits.

    Parameters
    ----------
    strain : mapping of str to float
        Share of the strain energy of each mesh and bearing, adding up to one.
    kinetic : mapping of str to float
        Share of the kinetic energy of each body, adding up to one.
    path : path-like, optional
        Where to write the picture.
    title : str
        Frequency, damping and name of the mode.
    least_share : float
        Smaller shares are gathered under "others".

    Returns
    -------
    matplotlib.figure.Figure
    """
    shares = [_gathered(strain, least_share), _gathered(kinetic, least_share)]
    with drawing_style():
        figure = new_figure(7.2, 0.24 * max(map(len, shares)) + 1.3)
        panels = figure.subplots(1, 2)
        headings = ("Strain energy", "Kinetic energy")
        for panel, entries, heading, colour in zip(panels, shares, headings, COLOURS, strict=False):
            names, values = [drawable(name) for name in entries], [100.0 * value for value in entries.values()]
            bars = panel.barh(range(len(names)), values, color=colour, height=0.7)
            panel.bar_label(bars, fmt="%.0f %%", padding=2, fontsize=7.5)
            panel.set_yticks(range(len(names)), names)
            panel.invert_yaxis()
            panel.set_xlim(0.0, 1.18 * max(values, default=1.0))
            panel.set_xlabel("Share / %")
            panel.set_title(heading, loc="left")
            panel.grid(visible=False, axis="y")
        figure.suptitle(title, fontsize=9.5)
        return finish_figure(figure, path)


def _gathered(shares: Mapping[str, float], least: float) -> dict[str, float]:
    """Largest first, what is smaller than `least` in one entry at the end."""
    kept = {name: share for name, share in sorted(shares.items(), key=lambda item: -item[1]) if share >= least}
    rest = sum(shares.values()) - sum(kept.values())
    if len(kept) < len(shares) and rest > 0.0005:
        kept["others"] = rest
    return kept
