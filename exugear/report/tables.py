"""Section of the report on transmission error tables: figures of each pair, curves, teeth in contact."""

from __future__ import annotations

from exugear.pictures.tables import PICTURE_FOLDER
from exugear.report import page
from exugear.report.context import Context
from exugear.report.stored import StoredResults
from exugear.tooth_mesh.laws.iso6336 import iso6336_stiffness
from fe_ste.transmission_error.table import MeshTable


def tables_section(context: Context, results: StoredResults) -> str:
    """Show the static transmission error of each pair beside its stiffness by ISO 6336."""
    if not results.tables:
        return ""
    rows = [
        _pair_row(name, table, iso6336_stiffness(context.gearbox.pairs[name])) for name, table in results.tables.items()
    ]
    folder = context.folder / PICTURE_FOLDER
    curves = folder / "ste.png"
    shown = page.picture(curves, "Static transmission error over the mesh cycle.") if curves.is_file() else ""
    teeth = [folder / f"{kind}_{name}.png" for name in results.tables for kind in ("contact", "load_share")]
    pictures = "".join(page.picture(path, path.stem.replace("_", " ")) for path in teeth if path.is_file())
    return page.section(
        "Static transmission error",
        page.table(rows),
        shown,
        page.folded("Teeth in contact", pictures) if pictures else "",
    )


def _pair_row(name: str, table: MeshTable, iso_stiffness: float) -> dict[str, object]:
    """Figures of a pair's static state; the stiffness by ISO 6336 in N/m."""
    state = table.static_state
    return {
        "pair": name,
        "torque on gear 1 / N m": f"{float(state['torque']):.1f}",
        "positions": state.sizes["pmc"],
        "mean / µm": f"{1e6 * float(state['ste'].mean()):.2f}",
        "peak to peak / µm": f"{1e6 * float(state['ste'].max() - state['ste'].min()):.3f}",
        "mean stiffness / (N/µm)": f"{1e-6 * float(state['mesh_stiffness'].mean()):.0f}",
        "ISO 6336-1 B / (N/µm)": f"{1e-6 * iso_stiffness:.0f}",
    }
