"""The transmission error tables of a gearbox: which are wanted, which are there, and their pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr

from exugear.gearbox import CaseError, Gearbox
from fe_ste.plots import plot_load_share, plot_ste_curves
from fe_ste.scene import contact_quads, draw_tooth_contact, meshed_teeth
from fe_ste.ste import contact_state
from fe_ste.table import MeshTable, TableError, TableInput, prepared_compliance

TABLE_FOLDER = "tables"
PICTURE_FOLDER = "pictures"


@dataclass(frozen=True)
class TableOrder:
    """The table of one pair: its input, its file and, where the file fits the input, its content.

    Attributes
    ----------
    name : str
        Name of the pair in the gearbox file.
    wanted : fe_ste.table.TableInput
        All that the numbers depend on.
    path : Path
        The table's file.
    stored : MeshTable or None
        The table in the file, if it was computed from exactly this input.
    replaces : str
        Why a file that is there does not serve; empty if there is none or it serves.
    """

    name: str
    wanted: TableInput
    path: Path
    stored: MeshTable | None
    replaces: str = ""

    def fill(self, progress: Callable[[int, int], None] | None = None) -> MeshTable:
        """Compute the table and write its file.

        Parameters
        ----------
        progress : callable, optional
            Called with the number of finished positions and of all positions.
        """
        table = MeshTable.compute(self.wanted, progress)
        table.save(self.path)
        return table


def order_tables(
    gearbox: Gearbox, out: Path, names: Iterable[str] = (), positions: int | None = None
) -> list[TableOrder]:
    """List the tables of a gearbox and find those that are there; computes and writes nothing.

    Parameters
    ----------
    gearbox : Gearbox
        The case.
    out : Path
        Results folder; the tables lie in its folder ``tables``.
    names : iterable of str
        Pairs to list; without any, those that the file wants a table of.
    positions : int, optional
        Positions of the mesh cycle; without it what the file says.

    Raises
    ------
    CaseError
        A pair that is not in the file, or that carries no load in its static state.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [order.name for order in order_tables(gearbox, Path("nowhere"))]
    ['sun_planet', 'ring_planet', 'intermediate', 'high_speed']
    """
    chosen = list(names) or [name for name, spec in gearbox.pairs.items() if spec.table]
    for name in chosen:
        if name not in gearbox.pairs:
            known = ", ".join(gearbox.pairs)
            raise CaseError(f"{gearbox.source}: no gear pair {name!r}; the pairs are {known}")
        if not gearbox.pairs[name].static_torque > 0.0:
            raise CaseError(
                f"{gearbox.source}: pairs.{name}: carries no torque in [static_load]; "
                "a table needs one, for it belongs to one loaded flank"
            )
    return [_order(gearbox, name, out, positions or gearbox.ste.positions) for name in dict.fromkeys(chosen)]


def table_path(out: Path, name: str) -> Path:
    """Place of a pair's table: ``tables/<pair>.nc`` in the results folder."""
    return out / TABLE_FOLDER / f"{name}.nc"


def wanted_table(gearbox: Gearbox, name: str, positions: int) -> TableInput:
    """All that the numbers of a pair's table depend on."""
    spec = gearbox.pairs[name]
    # Statics leave rounding in the torque; another machine's must not make another hash of it.
    torque = float(f"{spec.static_torque:.12g}")
    return TableInput(pair=spec.pair, torque=(torque,), positions=positions)


def fitting_table(gearbox: Gearbox, name: str, out: Path) -> MeshTable:
    """Read the table of a pair, however many positions it has, if all else is the case's.

    Raises
    ------
    fe_ste.table.TableError
        The file is missing, unreadable, or was computed from another input.
    """
    path = table_path(out, name)
    table = MeshTable.open(path)
    if table.input_hash != wanted_table(gearbox, name, table.dataset.sizes["pmc"]).hash:
        raise TableError(f"{path}: was computed from another input; compute it again")
    return table


def missing_tables(gearbox: Gearbox, out: Path) -> list[TableOrder]:
    """List the tables that dynamics need and that are not there, or belong to another input."""
    orders = []
    for name in dict.fromkeys(mesh.pair.name for mesh in gearbox.meshes):
        try:
            fitting_table(gearbox, name, out)
        except TableError:
            orders += order_tables(gearbox, out, [name])
    return orders


def _order(gearbox: Gearbox, name: str, out: Path, positions: int) -> TableOrder:
    wanted = wanted_table(gearbox, name, positions)
    path = table_path(out, name)
    if not path.exists():
        return TableOrder(name, wanted, path, None)
    try:
        return TableOrder(name, wanted, path, MeshTable.open(path, wanted))
    except TableError as error:
        return TableOrder(name, wanted, path, None, str(error))


def summarise(order: TableOrder, table: MeshTable) -> dict[str, Any]:
    """Return the figures of a table that a person asks for first; the unit is part of the key.

    What no converged position gives is None.
    """
    data = table.dataset

    def figure(values: xr.DataArray) -> float | None:
        value = float(values)
        return value if value == value else None

    return {
        "pair": order.name,
        "table": str(order.path),
        "torque_gear_1_N_m": order.wanted.torque[0],
        "positions": order.wanted.positions,
        "not_converged": int((~data["converged"]).sum()),
        "ste_mean_um": figure(1e6 * data["ste"].mean()),
        "ste_peak_to_peak_um": figure(1e6 * (data["ste"].max() - data["ste"].min())),
        "mesh_stiffness_mean_N_per_m": figure(data["mesh_stiffness"].mean()),
        "max_pressure_MPa": figure(1e-6 * data["max_pressure"].max()),
        "input_hash": table.input_hash,
    }


def stored_tables(gearbox: Gearbox, out: Path, positions: int | None = None) -> dict[str, MeshTable]:
    """Return the tables of a results folder that fit the gearbox, by the name of the pair."""
    orders = order_tables(gearbox, out, positions=positions)
    return {order.name: order.stored for order in orders if order.stored}


def draw_curves(tables: Mapping[str, MeshTable], out: Path) -> list[Path]:
    """Draw the transmission error of all pairs and the load share of each; return the pictures' files."""
    folder = out / PICTURE_FOLDER
    curves = folder / "ste.png"
    plot_ste_curves({name: table.dataset for name, table in tables.items()}, curves)
    shares = []
    for name, table in tables.items():
        path = folder / f"load_share_{name}.png"
        plot_load_share(table.dataset, path, title=_title(name, table))
        shares.append(path)
    return [curves, *shares]


def contact_picture(name: str, out: Path) -> Path:
    """Return where the picture of a pair's teeth in contact lies."""
    return out / PICTURE_FOLDER / f"contact_{name}.png"


def draw_contact(order: TableOrder, table: MeshTable, out: Path) -> Path:
    """Draw the teeth that carry load at position 0 of the mesh cycle, with the pressure between them.

    Raises
    ------
    fe_ste.scene.RenderingError
        This machine cannot render; the message says what to install.
    fe_ste.contact.ContactError
        The contact at position 0 cannot be solved.
    """
    pair = order.wanted.pair
    compliance = prepared_compliance(order.wanted)
    state = contact_state(compliance, order.wanted.torque[0], 0.0)
    quads = contact_quads(pair, state.cells, 0.0, compliance.axial, compliance.slice_width)
    teeth = sorted({int(tooth) for tooth in state.cells.tooth[state.pressure > 0.0]})
    pinion, gear = meshed_teeth(pair, 0.0, teeth, order.wanted.mesh)
    path = contact_picture(order.name, out)
    highest = float(table.dataset["max_pressure"].isel(pmc=0).max())
    title = _title(order.name, table)
    draw_tooth_contact(pinion, gear, quads, state.pressure, path, title=title, highest_pressure=highest)
    return path


def _title(name: str, table: MeshTable) -> str:
    return f"{name}, {float(table.dataset['torque'][0]):.0f} N m on gear 1"
