"""Diagrams of steady responses: levels along orders with cuts of run-ups over them, and modes over speed."""

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
    from matplotlib.axes import Axes
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


@dataclass(frozen=True)
class ModeCurve:
    """A mode over speed.

    Attributes
    ----------
    kind : str
        For the legend; curves of one kind have one colour.
    speed, frequency : (n,) arrays
        Of the input without sign (rad/s), and Hz; NaN where there is no mode.
    """

    kind: str
    speed: Floats
    frequency: Floats


@dataclass(frozen=True)
class Mark:
    """A line that meets a mode.

    Attributes
    ----------
    speed, frequency : float
        Of the input without sign (rad/s), and Hz.
    share : float
        How strongly it is excited, 0 to 1: the size of the mark.
    """

    speed: float
    frequency: float
    share: float


def plot_campbell_over_speed(
    curves: Sequence[ModeCurve],
    lines: Sequence[OrderLine],
    marks: Sequence[Mark],
    ranges: Mapping[str, tuple[float, float]],
    path: str | Path | None = None,
) -> Figure:
    """Draw modes over speed with order lines, and where these meet, as large as the mode is excited there.

    Parameters
    ----------
    curves : sequence of ModeCurve
    lines : sequence of OrderLine
    marks : sequence of Mark
    ranges : mapping of name to (float, float)
        Speeds of the input in operation without sign, rad/s.
    path : path-like, optional
        Where to write the picture.

    Raises
    ------
    ValueError
        There is no mode to draw.
    """
    if not curves:
        raise ValueError("plot_campbell_over_speed: at least one mode is needed")
    fastest = max(float(curve.speed.max()) for curve in curves)
    top = 1.1 * max([float(np.nanmax(curve.frequency)) for curve in curves] + [mark.frequency for mark in marks])
    kinds = list(dict.fromkeys(curve.kind for curve in curves))
    with drawing_style():
        figure = new_figure(7.2, 5.4)
        panel = figure.add_subplot()
        panel.grid(False)
        for number, (name, (slow, fast)) in enumerate(ranges.items()):
            panel.axvspan(slow / RPM, fast / RPM, color="#EEEEEE", zorder=0, label=None if number else "in operation")
            _name_at(panel, name, (0.5 * (slow + fast) / RPM, 1e-3 * top), (0, -9 - 9 * number), "center")
        for kind in kinds:
            for number, curve in enumerate(own for own in curves if own.kind == kind):
                panel.plot(
                    curve.speed / RPM, 1e-3 * curve.frequency, color=COLOURS[kinds.index(kind) % len(COLOURS)],
                    linewidth=0.9, label=None if number else kind, zorder=2,
                )  # fmt: skip
        for line in lines:
            end = float(line.frequency(fastest))
            reach = min(1.0, top / end)
            panel.plot(
                [0.0, reach * fastest / RPM], [0.0, 1e-3 * reach * end], color="#888888", linewidth=0.7,
                linestyle="--", zorder=1,
            )  # fmt: skip
            _name_at(panel, line.name, (reach * fastest / RPM, 1e-3 * reach * end), (2, 0), "left")
        panel.scatter(
            [mark.speed / RPM for mark in marks], [1e-3 * mark.frequency for mark in marks],
            s=[4.0 + 90.0 * mark.share for mark in marks], facecolor="none", edgecolor="#000000", zorder=3,
        )  # fmt: skip
        panel.set(xlim=(0.0, fastest / RPM), ylim=(0.0, 1e-3 * top))
        panel.set(xlabel="Input speed / rpm", ylabel="Frequency / kHz")
        figure.legend(loc="outside upper center", ncols=5)
        return finish_figure(figure, path)


def _name_at(panel: Axes, name: str, place: tuple[float, float], shift: tuple[int, int], side: str) -> None:
    panel.annotate(
        name, place, shift, textcoords="offset points", fontsize=7.0, color="#555555", horizontalalignment=side
    )
