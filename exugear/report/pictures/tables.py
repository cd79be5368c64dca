"""Pictures of the transmission error tables of a gearbox."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from exugear.system.tooth_mesh.tables import TableRequest
from fe_ste.pictures.diagrams import plot_load_share, plot_ste_curves
from fe_ste.pictures.teeth import contact_quads, draw_tooth_contact, meshed_teeth
from fe_ste.transmission_error.search import contact_state
from fe_ste.transmission_error.table import MeshTable, prepared_compliance

PICTURE_FOLDER = "pictures"


def draw_curves(tables: Mapping[str, MeshTable], out: Path) -> list[Path]:
    """Draw the transmission error of all pairs and the load share of each; return the pictures' files."""
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
    """Return where the picture of a pair's teeth in contact lies."""
    return out / PICTURE_FOLDER / f"contact_{name}.png"


def draw_contact(request: TableRequest, table: MeshTable, out: Path) -> Path:
    """Draw the teeth that carry load at position 0 of the mesh cycle, with the pressure between them.

    Raises
    ------
    fe_ste.tools.rendering.RenderingError
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
