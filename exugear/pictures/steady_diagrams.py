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
    *,
    harmonics: int = 3,
) -> Figure:
    """Draw modes over speed with order lines, and where these meet, as large as the mode is excited there.

    Parameters
    ----------
    curves : sequence of ModeCurve
    lines : sequence of OrderLine
        Those of the meshes.
    marks : sequence of Mark
    ranges : mapping of name to (float, float)
        Speeds of the input that load cases pass, without sign, rad/s: bars above the diagram.
    path : path-like, optional
        Where to write the picture.
    harmonics : int
        Multiples of each order that are drawn, those above the first thin and without name.

    Raises
    ------
    ValueError
        There is no mode to draw.
    """
    if not curves:
        raise ValueError("plot_campbell_over_speed: at least one mode is needed")
    fastest = max(float(curve.speed.max()) for curve in curves)
    top = 1.1 * max([float(np.nanmax(curve.frequency)) for curve in curves] + [mark.frequency for mark in marks])
    strip = 0.25 + 0.16 * len(ranges)
    with drawing_style():
        figure = new_figure(7.2, 6.0 + strip)
        above, panel = figure.subplots(2, 1, sharex=True, height_ratios=[strip, 6.0])
        panel.grid(False)
        _draw_ranges(above, ranges)
        _draw_modes(panel, curves)
        for line in lines:
            for multiple in range(1, harmonics + 1):
                end = multiple * float(line.frequency(fastest))
                reach = min(1.0, top / end)
                panel.plot(
                    [0.0, reach * fastest / RPM], [0.0, 1e-3 * reach * end], color="#888888",
                    linewidth=0.9 if multiple == 1 else 0.4, linestyle="--", zorder=1,
                )  # fmt: skip
                if multiple == 1:
                    panel.annotate(
                        line.name, (reach * fastest / RPM, 1e-3 * reach * end), (3, 3), fontsize=7.0,
                        textcoords="offset points", color="#555555", annotation_clip=False,
                    )  # fmt: skip
        panel.scatter(
            [mark.speed / RPM for mark in marks], [1e-3 * mark.frequency for mark in marks],
            s=[4.0 + 90.0 * mark.share for mark in marks], facecolor="none", edgecolor="#000000", linewidth=0.8,
            zorder=3,
        )  # fmt: skip
        panel.set(xlim=(0.0, fastest / RPM), ylim=(0.0, 1e-3 * top))
        panel.set(xlabel="Input speed / rpm", ylabel="Frequency / kHz")
        figure.legend(loc="outside upper center", ncols=5)
        return finish_figure(figure, path)


def _draw_ranges(panel: Axes, ranges: Mapping[str, tuple[float, float]]) -> None:
    """Draw the speeds of load cases as bars, one below the other."""
    if not ranges:
        panel.set_axis_off()
        return
    for number, (slow, fast) in enumerate(ranges.values()):
        # A bar of no length, of one speed, is seen by its ends.
        panel.plot(
            [slow / RPM, fast / RPM], [number, number], color="#999999", linewidth=5.0, solid_capstyle="butt",
            marker="|", markersize=5.0, markeredgewidth=2.0,
        )  # fmt: skip
    panel.set_yticks(range(len(ranges)), list(ranges))
    panel.tick_params(axis="both", labelsize=7.0, length=0.0, labelbottom=False)
    panel.set_ylim(len(ranges) - 0.4, -0.6)
    panel.set_title("Speeds of the load cases", loc="left", fontsize=8.0)


def _draw_modes(panel: Axes, curves: Sequence[ModeCurve]) -> None:
    """Draw modes over speed, each kind in its colour and once in the legend."""
    kinds = sorted({curve.kind for curve in curves})
    for colour, kind in enumerate(kinds):
        for number, curve in enumerate(own for own in curves if own.kind == kind):
            panel.plot(
                curve.speed / RPM, 1e-3 * curve.frequency, color=COLOURS[colour % len(COLOURS)], linewidth=0.9,
                label=None if number else kind, zorder=2,
            )  # fmt: skip
