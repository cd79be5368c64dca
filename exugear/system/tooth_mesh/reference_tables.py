"""Tables of a gearbox's pairs by the reference analysis, in addition to the tables used for dynamics."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exugear.gearbox.gearbox import Gearbox
from exugear.system.tooth_mesh.tables import TABLE_FOLDER, figure, requested_tables
from fe_ste.reference.newton import Iteration
from fe_ste.reference.table import NonlinearInput, NonlinearTable

if TYPE_CHECKING:
    import xarray as xr

#: Positions of the mesh cycle unless asked for otherwise: one takes about half a minute.
DEFAULT_POSITIONS = 10

LARGEST_DIFFERENCE = 0.05
"""Part by which the mean transmission errors of both methods may differ because of their meshes."""


@dataclass(frozen=True)
class ReferenceRequest:
    """The reference analysis of one pair."""

    name: str
    """Name of the pair in the gearbox file."""
    wanted: NonlinearInput
    """All that the numbers depend on."""
    path: Path
    """The table's file."""

    def compute(self, progress: Callable[[int, int, Iteration | None], None] | None = None) -> NonlinearTable:
        """Compute what the file does not hold yet, writing after each position."""
        return NonlinearTable.compute(self.wanted, self.path, progress)


def requested_references(
    gearbox: Gearbox, out: Path, names: Iterable[str] = (), positions: int | None = None
) -> list[ReferenceRequest]:
    """List the reference analyses of a gearbox under its static load; computes and writes nothing.

    Parameters
    ----------
    out : results folder; a table lies in ``tables/<pair>-nonlinear.nc``
    names : pairs; without any, those that the file wants a table of
    positions : positions of the mesh cycle

    Raises
    ------
    GearboxFileError
        A pair that is not in the file, or that carries no load in its static state.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [str(request.path) for request in requested_references(gearbox, Path("nowhere"), ["high_speed"])]
    ['nowhere/tables/high_speed-nonlinear.nc']
    """
    requests = requested_tables(gearbox, out, names)
    return [
        ReferenceRequest(
            request.name,
            NonlinearInput(
                pair=request.wanted.pair,
                torque=request.wanted.static_torque or request.wanted.torque[0],
                positions=positions or DEFAULT_POSITIONS,
                pinion_modification=request.wanted.pinion_modification,
                gear_modification=request.wanted.gear_modification,
            ),
            out / TABLE_FOLDER / f"{request.name}-nonlinear.nc",
        )
        for request in requests
    ]


def reference_warnings(summaries: Iterable[dict[str, Any]]) -> list[str]:
    """Say of which pairs the two methods differ by more than they may."""
    doubts = []
    for summary in summaries:
        difference = summary["difference_of_means_percent"]
        if difference is not None and abs(difference) > 100.0 * LARGEST_DIFFERENCE:
            doubts.append(
                f"{summary['pair']}: the mean differs by {difference:+.1f} % from the table used for dynamics; up to "
                f"{100.0 * LARGEST_DIFFERENCE:g} % is explained by the element meshes"
            )
    return doubts


def summarise_reference(request: ReferenceRequest, table: NonlinearTable) -> dict[str, Any]:
    """Return the main results of a table; the unit is part of the key.

    Results without a converged position are None.
    """
    data = table.dataset

    def peak_to_peak(values: xr.DataArray) -> float | None:
        if int(values.notnull().sum()) < 2:
            return None
        return figure(1e6 * (values.max() - values.min()))

    def most_loaded(stress: xr.DataArray) -> xr.DataArray:
        carries = data["load_share"] == data["load_share"].max("tooth")
        return stress.where(carries).max()

    ste = data["ste"]
    # Both means are over the positions that the non-linear analysis solved.
    beside = data["superelement_ste"].where(data["converged"])
    return {
        "pair": request.name,
        "table": str(request.path),
        "method": "nonlinear",
        "torque_gear_1_N_m": request.wanted.torque,
        "positions": request.wanted.positions,
        "states": request.wanted.positions,
        "not_converged": int((~data["converged"]).sum()),
        "ste_mean_um": figure(1e6 * ste.mean()),
        "ste_peak_to_peak_um": peak_to_peak(ste),
        "superelement_mean_um": figure(1e6 * beside.mean()),
        "superelement_peak_to_peak_um": peak_to_peak(beside),
        "difference_of_means_percent": figure(100.0 * (ste.mean() / beside.mean() - 1.0)),
        "mesh_stiffness_mean_N_per_m": figure(data["mesh_stiffness"].mean()),
        "contact_stress_MPa": figure(1e-6 * most_loaded(data["contact_stress"])),
        "superelement_contact_stress_MPa": figure(1e-6 * most_loaded(data["superelement_contact_stress"])),
        "max_pressure_MPa": figure(1e-6 * data["max_pressure"].max()),
        "max_von_mises_MPa": figure(1e-6 * data["max_von_mises"].max()),
        "wall_time_per_position_s": figure(data["wall_time"].mean()),
        "input_hash": table.input_hash,
    }
