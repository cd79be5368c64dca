"""Diagrams of loads over a life: how long each torque lasts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from exugear.life.counting.duration import DurationDistribution
from fe_ste.tools.drawing import COLOURS, drawing_style, finish_figure, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_duration(distribution: DurationDistribution, body: str, path: str | Path | None = None) -> Figure:
    """Draw the load duration distribution of a body: hours in each bin, and hours above each torque.

    Parameters
    ----------
    found : DurationDistribution
    body : for the labels
    path : where to write the picture
    """
    with drawing_style():
        figure = new_figure(7.0, 3.2)
        bars, above = figure.subplots(1, 2)
        width = 1e-3 * np.abs(distribution.upper - distribution.lower)
        middle = 0.5e-3 * (distribution.lower + distribution.upper)
        bars.bar(middle, distribution.hours, width=width, color=COLOURS[0])
        bars.set(xlabel=f"torque on {body} / kN m", ylabel="hours in the life", title="time at each torque")
        for sign, colour, name in ((1.0, COLOURS[0], "positive"), (-1.0, COLOURS[1], "negative")):
            own = distribution.torque * sign > 0.0
            if own.any():
                order = np.argsort(-np.abs(distribution.torque[own]))
                lasting = np.cumsum(distribution.hours[own][order])
                above.step(
                    lasting, 1e-3 * np.abs(distribution.torque[own][order]), where="pre", color=colour, label=name
                )
        above.set(xlabel="hours with at least this torque", ylabel="torque without sign / kN m", xscale="log")
        above.xaxis.set_major_formatter("{x:g}")
        above.set_title("duration")
        above.legend()
        return finish_figure(figure, path)
