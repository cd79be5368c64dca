"""Diagrams of modes (Campbell), of run-ups (waterfalls with order lines) and of transmission error tables.

Functions for modes and runs take arrays or spectra of `exugear.results.spectra` and return a matplotlib `Figure`;
they need no display.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.units import RPM
from exugear.results.spectra.resonances import Pick
from exugear.results.spectra.waterfall import OrderLine, Waterfall
from exugear.system.tooth_mesh.tables import TableRequest
from fe_ste.pictures.teeth import contact_quads, draw_tooth_contact, meshed_teeth
from fe_ste.tools.arrays import Floats
from fe_ste.tools.drawing import COLOURS, drawing_style, finish_figure, new_figure
from fe_ste.transmission_error.diagrams import plot_load_share, plot_ste_curves
from fe_ste.transmission_error.search import contact_state
from fe_ste.transmission_error.table import MeshTable, prepared_compliance

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
    """Draw eigenfrequencies and order lines, and mark their crossings.

    Parameters
    ----------
    eigenfrequencies : (n,) Hz
    lines : exciting orders
    fastest : highest speed of the carrier, rad/s
    path : file for the picture
    names : names of the modes, written on their lines
    weights : (n,) visibility of each mode in the observed quantity, 0 to 1: size of the marks at its crossings
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
        for number, line in enumerate(order_lines):
            colour = COLOURS[number % len(COLOURS)]
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


# Diagrams of runs: waterfalls with order lines

MARK_COLOUR = "#00E5FF"
"""Colour of circled peaks, which contrasts with the colours of a waterfall."""


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
    """Draw waterfalls next to each other on a common scale.

    Parameters
    ----------
    runs : title and spectra of each panel
    lines : order lines to draw and label
    path : file for the picture
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
    reference = next(iter(runs.values())).reference_text  # one for all
    top = highest_frequency or min(float(run.frequency[-1]) for run in runs.values())
    fastest = max(float(run.speed.max()) for run in runs.values()) / RPM
    highest = max(float(run.level[:, run.frequency <= top].max()) for run in runs.values())
    order_lines = tuple(lines)
    with drawing_style():
        figure = new_figure(4.6 * len(runs) + 1.0, 5.0)
        panels = figure.subplots(1, len(runs), sharex=True, sharey=True, squeeze=False)[0]
        for panel, (name, run) in zip(panels, runs.items(), strict=True):
            image = panel.imshow(
                pooled_levels(run, top, fastest * RPM),
                extent=(0.0, fastest, 0.0, 1e-3 * top),
                origin="lower",
                aspect="auto",
                interpolation="nearest",
                cmap="inferno",
                clim=(highest - dynamic_range, highest),
            )
            panel.grid(False)
            panel.set(xlim=(0.0, fastest), ylim=(0.0, 1e-3 * top), xlabel="Input speed / rpm")
            panel.set_title(name, loc="left", pad=24.0)
            _draw_order_lines(panel, order_lines, fastest, top, "white")
            _draw_marks(panel, (marks or {}).get(name, ()))
        panels[0].set_ylabel("Frequency / kHz")
        label = f"{quantity[0].upper()}{quantity[1:]}, level / dB re {reference}"
        figure.colorbar(image, ax=panels, label=label, extend="min", aspect=30)
        caption = "; ".join(sorted({run.description for run in runs.values()}))
        figure.supxlabel(caption, fontsize=7.5, color="#555555")
        return finish_figure(figure, path)


def pooled_levels(
    run: Waterfall, highest_frequency: float, fastest: float, shape: tuple[int, int] = (700, 450)
) -> Floats:
    """Return the highest level in each cell of a picture, so that narrow lines are not lost between its pixels.

    Parameters
    ----------
    run : spectra
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


def _draw_order_lines(panel: Axes, lines: Sequence[OrderLine], fastest: float, top: float, colour: str) -> None:
    """Draw lines from the origin (rpm, kHz) and name each where it leaves the panel, above or to the right."""
    taken_above: list[float] = []
    taken_right: list[float] = []
    for line in sorted(lines, key=lambda line: line.order):
        end = float(line.frequency(fastest * RPM))
        above = end > top
        speed, frequency = (fastest * top / end, top) if above else (fastest, end)
        # Sparse dots, as a full line would hide the level along it.
        panel.plot([0.0, speed], [0.0, 1e-3 * frequency], color=colour, linewidth=0.8, linestyle=(0, (1, 7)))
        taken, position = (taken_above, speed / fastest) if above else (taken_right, frequency / top)
        if all(abs(position - other) > 0.04 for other in taken):
            taken.append(position)
            label = panel.annotate(line.name, (speed, 1e-3 * frequency), (3.0, 2.0), textcoords="offset points")
            label.set(fontsize=7.0, annotation_clip=False, va="bottom" if above else "center")
            label.set_rotation(35.0 if above else 0.0)


def _draw_marks(panel: Axes, picks: Sequence[Pick]) -> None:
    for number, pick in enumerate(picks, start=1):
        speed = pick.speed / RPM
        frequency = 1e-3 * pick.frequency
        panel.plot(speed, frequency, "o", markersize=9, markerfacecolor="none", markeredgecolor=MARK_COLOUR)
        panel.annotate(
            str(number), (speed, frequency), (6, 6), textcoords="offset points", fontsize=8, color=MARK_COLOUR
        )


# Pictures of the transmission error tables of a gearbox

PICTURE_FOLDER = "pictures"


def draw_curves(tables: Mapping[str, MeshTable], out: Path) -> list[Path]:
    """Draw the transmission error of all pairs and the load share of each; return the paths of the pictures."""
    folder = out / PICTURE_FOLDER
    curves = folder / "ste.png"
    plot_ste_curves({name: table.static_state for name, table in tables.items()}, curves)
    shares = []
    for name, table in tables.items():
        path = folder / f"load_share_{name}.png"
        plot_load_share(table.static_state, path, title=_title(name, table))
        shares.append(path)
    return [curves, *shares]


def contact_picture(name: str, out: Path) -> Path:
    """Return the path of the picture of a pair's teeth in contact."""
    return out / PICTURE_FOLDER / f"contact_{name}.png"


def draw_contact(request: TableRequest, table: MeshTable, out: Path) -> Path:
    """Draw the teeth that carry load at position 0 of the mesh cycle, with the contact pressure.

    Raises
    ------
    fe_ste.tools.drawing.RenderingError
        This machine cannot render; the message says what to install.
    fe_ste.contact.kinematics.ContactError
        The contact at position 0 cannot be solved.
    """
    pair = request.wanted.pair
    compliance = prepared_compliance(request.wanted)
    state = contact_state(compliance, float(table.static_state["torque"]), 0.0)
    quads = contact_quads(pair, state.cells, 0.0, compliance.axial, compliance.slice_width)
    teeth = sorted({int(tooth) for tooth in state.cells.tooth[state.pressure > 0.0]})
    pinion, gear = meshed_teeth(pair, 0.0, teeth, request.wanted.mesh)
    path = contact_picture(request.name, out)
    highest = float(table.static_state["max_pressure"].isel(pmc=0))
    title = _title(request.name, table)
    draw_tooth_contact(pinion, gear, quads, state.pressure, path, title=title, highest_pressure=highest)
    return path


def _title(name: str, table: MeshTable) -> str:
    return f"{name}, {float(table.static_state['torque']):.0f} N m on gear 1"
