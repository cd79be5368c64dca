"""Stresses of gear pairs from their tables, computed once and kept beside these."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.versions import LIFE
from exugear.system.tooth_mesh.tables import TableRequest
from fe_ste.geometry.gears import Gear
from fe_ste.root_stress.mesh_cycle import MeshCycleStress, mesh_cycle_stress
from fe_ste.root_stress.root import RootGauges, root_gauges
from fe_ste.tools.sealed import Layout
from fe_ste.tools.stores.store import Store

if TYPE_CHECKING:
    import xarray as xr

_FIELDS = {
    "hertz": (("torque", "misalignment"), "Pa", "largest Hertzian stress inside the path of contact"),
    "pitch_hertz": (("torque", "misalignment"), "Pa", "largest Hertzian stress near the pitch point"),
    "outside": (("torque", "misalignment"), "1", "largest share of the load outside the path of contact"),
    "face_load": (("torque", "misalignment"), "1", "highest over mean line load along the face"),
    "root": (("torque", "misalignment", "gear"), "Pa", "largest principal stress at the roots of gear 1 and 2"),
    "compression": (("torque", "misalignment", "gear"), "Pa", "least principal stress there"),
}
_LAYOUT = Layout(
    "pair stress",
    LIFE,
    {name: dims for name, (dims, _, _) in _FIELDS.items()} | {"torque": ("torque",), "misalignment": ("misalignment",)},
    ("pair", "input_hash"),
)


def pair_stresses(
    requests: Iterable[TableRequest],
    folder: Path,
    begin: Callable[[str], None] | None = None,
    keep: bool = True,
) -> dict[str, MeshCycleStress]:
    """Stresses of all pairs whose tables are there; those that are missing, or belong to another table, are computed.

    Parameters
    ----------
    folder : where they are kept: ``stress/<pair>.nc``
    begin : called with the name of each pair before it is computed
    keep : whether what is computed is written
    """
    known: dict[tuple[Gear, int], RootGauges] = {}

    def gauges(gear: Gear, side: int) -> RootGauges:
        if (gear, side) not in known:
            known[gear, side] = root_gauges(gear, side)
        return known[gear, side]

    stresses = {}
    for request in requests:
        if request.stored is None:
            continue
        pair = request.wanted.pair
        digest = hashlib.sha256(f"{LIFE} {request.stored.input_hash}".encode()).hexdigest()
        store = Store(folder / "stress" / f"{request.name}.nc", digest)
        dataset = store.read_dataset(_LAYOUT)
        if dataset is not None:
            kept = MeshCycleStress(**{name: dataset[name].to_numpy() for name in ("torque", "misalignment", *_FIELDS)})
        else:
            if begin is not None:
                begin(request.name)
            both = gauges(pair.pinion, 1), gauges(pair.gear, -1 if pair.gear.internal else 1)
            kept = mesh_cycle_stress(pair, request.stored.dataset, both)
            if keep:
                store.write_dataset(_to_dataset(kept, request.name))
        stresses[request.name] = kept
    return stresses


def _to_dataset(stress: MeshCycleStress, pair: str) -> xr.Dataset:
    import xarray as xr

    variables = {
        name: (dims, np.asarray(getattr(stress, name)), {"units": units, "long_name": words})
        for name, (dims, units, words) in _FIELDS.items()
    }
    coordinates = {
        "torque": (("torque",), stress.torque, {"units": "N m"}),
        "misalignment": (("misalignment",), stress.misalignment, {"units": "rad"}),
    }
    return xr.Dataset(variables, coordinates, {"pair": pair, "method_version": LIFE})
