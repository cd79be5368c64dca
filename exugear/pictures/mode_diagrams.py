"""Diagrams of modes: Campbell diagram, sensitivities to parameters, where the energy sits.

They take plain arrays and order lines, and return a matplotlib figure that needs no display.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from exugear.model.parts import RPM
from exugear.spectra.orders import OrderLine
from fe_ste.tools.arrays import Floats
from fe_ste.tools.drawing import COLOURS, WARNING_COLOUR, drawable, drawing_style, finish_figure, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


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
    order_lines = tuple(lines)
    top = highest_frequency or 1.1 * float(max([modes.max(initial=0.0), 1.0]))
    end_speed = fastest / RPM
    with drawing_style():
        figure = new_figure(7.2, 5.0)
        panel = figure.add_subplot()
        panel.grid(False)
        for mode in modes[modes <= top]:
            panel.axhline(1e-3 * mode, color="#BBBBBB", linewidth=0.8, zorder=1)
        for line, colour in zip(order_lines, _repeated(len(order_lines)), strict=True):
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
        panel.set(xlabel="Input speed / rpm", ylabel="Frequency / kHz")
        panel.set_title(title, loc="left")
        if order_lines:
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
    sensitivities: Sequence[Sensitivity],
    path: str | Path | None = None,
    *,
    target: float | None = None,
    window: tuple[float, float] | None = None,
    title: str = "",
) -> Figure:
    """Draw how eigenfrequencies move with model parameters, side by side on one frequency scale.

    Parameters
    ----------
    sensitivities : sequence of Sensitivity
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
        If values and frequencies of a parameter do not fit.
    """
    for sensitivity in sensitivities:
        if sensitivity.frequencies.ndim != 2 or sensitivity.frequencies.shape[0] != sensitivity.values.size:
            raise ValueError(
                f"sensitivity {sensitivity.label!r}: frequencies {sensitivity.frequencies.shape} must have one row "
                f"for each of {sensitivity.values.size} values"
            )
    with drawing_style():
        figure = new_figure(2.7 * len(sensitivities) + 0.6, 3.4)
        panels = figure.subplots(1, len(sensitivities), sharey=True, squeeze=False)[0]
        for panel, sensitivity in zip(panels, sensitivities, strict=True):
            _draw_sensitivity(panel, sensitivity)
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


def _draw_sensitivity(panel: Axes, sensitivity: Sensitivity) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    size = np.ones(sensitivity.frequencies.shape) if sensitivity.weights is None else sensitivity.weights
    for column, colour in enumerate(_repeated(sensitivity.frequencies.shape[1])):
        frequency = 1e-3 * sensitivity.frequencies[:, column]
        panel.plot(sensitivity.values, frequency, color=colour, linewidth=1.0, alpha=0.6)
        panel.scatter(sensitivity.values, frequency, s=4.0 + 40.0 * size[:, column], color=colour, zorder=3)
    if sensitivity.default is not None:
        panel.axvline(sensitivity.default, color="#555555", linewidth=0.8, linestyle=":")
        panel.annotate(
            "default", (sensitivity.default, 1.0), (2, -2), xycoords=("data", "axes fraction"),
            textcoords="offset points", va="top", rotation=90, fontsize=7.0, color="#555555",
        )  # fmt: skip
    if sensitivity.logarithmic:
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        panel.xaxis.set_minor_locator(NullLocator())
    panel.set_xlabel(sensitivity.label)


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
