"""Diagrams of modes: where mesh orders meet them. A matplotlib figure of plain arrays that needs no display."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.parts import RPM
from exugear.results.spectra.orders import OrderLine
from fe_ste.tools.drawing import COLOURS, drawing_style, finish_figure, new_figure

if TYPE_CHECKING:
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
    eigenfrequencies : (n,) Hz
    lines : orders that excite
    fastest : highest speed of the carrier, rad/s
    path : where to write the picture
    names : names of the modes, written on their lines
    weights : (n,) how strongly the observed quantity sees each mode, 0 to 1: the size of its crossings
    highest_frequency : end of the frequency axis, Hz
    title : variant and inertia set
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
