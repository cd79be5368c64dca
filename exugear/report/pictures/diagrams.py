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
from exugear.results.spectra.waterfall import OrderLine
from exugear.system.diagrams import draw_campbell
from exugear.system.tooth_mesh.tables import TableRequest
from fe_ste.pictures.teeth import contact_quads, draw_tooth_contact, meshed_teeth
from fe_ste.tools.drawing import drawing_style, finish_figure, new_figure
from fe_ste.transmission_error.diagrams import plot_load_share, plot_ste_curves
from fe_ste.transmission_error.search import contact_state
from fe_ste.transmission_error.table import MeshTable, prepared_compliance

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
        if orders:
            figure.legend(loc="outside upper center", ncols=4)
        return finish_figure(figure, path)


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
