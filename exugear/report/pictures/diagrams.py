"""Diagrams of modes (Campbell), and of steady-state responses, and pictures of tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.units import RPM
from exugear.report.findings.ranking import envelopes, order_amplitudes, ranking_of
from exugear.report.findings.words import QUANTITIES
from exugear.results.spectra.waterfall import OrderLine
from exugear.system.diagrams import draw_campbell
from exugear.system.tooth_mesh.tables import TableRequest
from fe_ste.pictures.teeth import contact_quads, draw_tooth_contact, meshed_teeth
from fe_ste.tools.drawing import (
    COLUMN_WIDTHS,
    axes_or_new,
    drawable,
    drawing_style,
    finish_figure,
    label_curves,
    new_figure,
    order_styles,
)
from fe_ste.transmission_error.diagrams import plot_load_share, plot_ste_curves
from fe_ste.transmission_error.search import contact_state
from fe_ste.transmission_error.table import MeshTable, prepared_compliance

if TYPE_CHECKING:
    import xarray as xr
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
    fastest : highest speed of the carrier, rad/s
    names : names of the modes, written on their lines
    weights : (n,) visibility of each mode in the observed quantity, 0 to 1: size of the marks at its crossings
    highest_frequency : end of the frequency axis, Hz
    """
    modes = np.asarray(eigenfrequencies, dtype=np.float64)
    size = np.ones(modes.size) if weights is None else np.asarray(weights, dtype=np.float64)
    orders = {line.name: line.order for line in lines}
    top = highest_frequency or 1.1 * float(max([modes.max(initial=0.0), 1.0]))
    with drawing_style():
        figure = new_figure(7.2, 5.0)
        panel = figure.add_subplot()
        draw_campbell(panel, modes, orders, fastest, top, size)
        for name, mode in zip(names, modes, strict=False):
            if mode <= top:
                panel.annotate(
                    name, (fastest / RPM, 1e-3 * mode), (4, 0), textcoords="offset points", va="center", fontsize=7.0
                )
        panel.set_title(title, loc="left")
        if orders and names:  # the names of the modes stand where the orders have theirs
            figure.legend(loc="outside upper center", ncols=4)
        else:
            label_curves(panel)
        return finish_figure(figure, path)


# Steady-state responses over speed

SHOWN_RESONANCES = 10
"""Maximum number of resonances with a circle, whose orders have a curve."""
SHOWN_RANGE = 1e-4
"""Lowest drawn amplitude as a fraction of the highest."""


def plot_response(
    data: xr.Dataset,
    quantity: Literal["error", "force", "acceleration", "mount_acceleration", "surface_velocity"] = "error",
    ax: Axes | None = None,
) -> Axes:
    """Draw the amplitudes of a steady-state response over speed: the highest of all orders, and those with resonances.

    Circles are the ten highest resonances that `exugear.resonances` and `exugear steady` rank, with their rank; the
    operating range is tinted.

    Parameters
    ----------
    data : result of `exugear.project.Project.steady` or `exugear.steady.steady_file.steady_response`
    quantity : force and acceleration: at the bearing with the largest amplitude, for planets root mean square
    ax : matplotlib axes; by default new ones, whose ``ax.figure`` can be shown and saved

    Raises
    ------
    ValueError
        The response has no such quantity; those of bearings are missing without bearings.

    Examples
    --------
    >>> from exugear import Choice, Gearbox, SpeedRange, SteadySettings, steady_response
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> shape = 1.0 + 0.05 * np.cos(2.0 * np.pi * np.arange(50) / 50)
    >>> mean = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> stiffness = {name: value * shape for name, value in mean.items()}
    >>> settings = SteadySettings(SpeedRange.from_text("15:25:11"))
    >>> ax = plot_response(steady_response(gearbox, Choice("rigid"), stiffness, settings=settings))
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('Input speed / rpm', 'Transmission error, ± µm')
    """
    curves = envelopes(data)
    if quantity not in curves:
        raise ValueError(f"quantity = {quantity!r}: must be one of {', '.join(curves)}")
    amplitude = order_amplitudes(data)[quantity]
    label = QUANTITIES[quantity]
    factor = label.factor
    speed = curves[quantity].speed / RPM
    orders = data["order"].to_numpy()[1:]
    ranking = ranking_of(data)
    places = {own.amplitudes[quantity].place: own for own in ranking.resonances}
    ranked = {place: places[place] for place in range(1, SHOWN_RESONANCES + 1) if place in places}
    lines = {own.line: int(np.argmin(np.abs(orders - own.order))) for own in ranked.values()}
    # A mesh has one colour in all diagrams.
    known = [str(name) for name in data["line"].to_numpy() if name != "mean"]
    styles = order_styles([*known, *lines])
    with axes_or_new(ax, COLUMN_WIDTHS[2], 4.0) as panel:
        panel.plot(speed, factor * curves[quantity].amplitude, color="#BBBBBB", linewidth=3.0, label="highest order")
        for name, line in lines.items():
            panel.plot(speed, factor * amplitude[:, line], linewidth=1.0, label=drawable(name), **styles[name])
        for place, resonance in ranked.items():
            highest = resonance.amplitudes[quantity].amplitude
            point = int(np.argmin(np.abs(amplitude[:, lines[resonance.line]] - highest)))
            at = speed[point], factor * highest
            panel.plot(*at, "o", color=styles[resonance.line]["color"], markerfacecolor="none")
            panel.annotate(str(place), at, (0, 5), textcoords="offset points", ha="center", fontsize=7.0)
        if not ranking.whole:
            panel.axvspan(*(value / RPM for value in ranking.speeds), color="#EEEEEE", zorder=0)
        highest = factor * float(amplitude.max(initial=0.0))
        if highest > 0.0:
            panel.set(yscale="log", ylim=(SHOWN_RANGE * highest, 2.0 * highest))
        panel.set(xlabel="Input speed / rpm", ylabel=f"{label.title}, ± {label.unit}")
        panel.set_xlim(speed.min(), speed.max())
        label_curves(panel)
        return panel


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
