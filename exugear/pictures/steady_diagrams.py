"""Diagrams of steady responses: levels along orders over speed, with cuts of run-ups drawn over them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from exugear.model.parts import RPM
from exugear.spectra.orders import OrderLine
from fe_ste.tools.arrays import Floats
from fe_ste.tools.drawing import COLOURS, drawing_style, finish_figure, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class OrderCurve:
    """Amplitudes of one order over speed.

    Attributes
    ----------
    name : str
        For the legend.
    speed : (n,) array
        Of the input, rad/s, without sign.
    amplitude : (n,) array
        m.
    steady : bool
        Whether it is a steady response; else it is cut out of a run-up, and drawn thin.
    """

    name: str
    speed: Floats
    amplitude: Floats
    steady: bool


def plot_order_curves(
    curves: Mapping[OrderLine, Sequence[OrderCurve]], path: str | Path | None = None, *, unit: float = 1e6
) -> Figure:
    """Draw amplitudes along orders over speed, one panel an order.

    Parameters
    ----------
    curves : mapping of OrderLine to sequence of OrderCurve
    path : path-like, optional
        Where to write the picture.
    unit : float
        Amplitudes are drawn times this, as micrometres.

    Raises
    ------
    ValueError
        There is nothing to draw.
    """
    if not any(curves.values()):
        raise ValueError("plot_order_curves: at least one curve is needed")
    names = list(dict.fromkeys(curve.name for own in curves.values() for curve in own))
    with drawing_style():
        figure = new_figure(7.2, 2.1 * len(curves) + 0.4)
        panels = figure.subplots(len(curves), 1, squeeze=False, sharex=True)[:, 0]
        for panel, (line, own) in zip(panels, curves.items(), strict=True):
            for curve in own:
                colour = COLOURS[names.index(curve.name) % len(COLOURS)]
                width = 1.2 if curve.steady else 0.7
                panel.semilogy(
                    curve.speed / RPM, unit * curve.amplitude, color=colour, linewidth=width, label=curve.name
                )
            panel.set_title(f"order {line.order:g}: {line.name}", loc="left")
            panel.set_ylabel("Amplitude / µm")
            steady = [unit * curve.amplitude for curve in own if curve.steady]
            if steady:
                panel.set_ylim(0.5 * min(map(np.min, steady)), 2.0 * max(map(np.max, steady)))
            # Names may hold what mathematical text would obey: it is switched off, and so are its powers of ten.
            panel.yaxis.set_major_formatter("{x:g}")
            panel.margins(x=0.0)
        panels[0].legend(loc="best", ncols=2)
        panels[-1].set_xlabel("Input speed / rpm")
        return finish_figure(figure, path)
