"""Mesh stiffness over the mesh cycle for each pair of a gearbox: from its STE tables or by ISO 6336."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exugear.gearbox import Gearbox, PairSpec
from exugear.mesh_element import MeshError
from fe_ste.iso6336 import mesh_stiffness as iso_stiffness

Floats = NDArray[np.float64]


def table_path(directory: str | Path, pair: str) -> Path:
    """Place of a pair's table: ``tables/<pair>.nc`` in the results directory."""
    return Path(directory) / "tables" / f"{pair}.nc"


def mesh_stiffness(gearbox: Gearbox, law: str, directory: str | Path | None = None) -> dict[str, Floats]:
    """Stiffness F_bt / STE (N/m) at pmc = 0, 1/n, ... of each pair at work.

    Parameters
    ----------
    gearbox : Gearbox
    law : str
        ``iso6336`` and ``rigid`` need no tables; every other law reads them.
    directory : path, optional
        Results directory with ``tables/<pair>.nc``.

    Raises
    ------
    MeshError
        A table is missing, holds unsolved positions, or belongs to another gear pair or torque.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = mesh_stiffness(gearbox, "iso6336")
    >>> [len(values) for values in stiffness.values()]
    [1, 1, 1, 1]
    """
    at_work = {mesh.pair.name for mesh in gearbox.meshes}
    specs = {name: spec for name, spec in gearbox.pairs.items() if name in at_work}
    if law == "rigid":
        return {}
    if law == "iso6336":
        return {name: np.array([_iso(spec)]) for name, spec in specs.items()}
    if directory is None:
        raise MeshError(f"mesh law {law!r} needs STE tables: give the directory they were written to")
    return {name: table_stiffness(table_path(directory, name), spec) for name, spec in specs.items()}


def _iso(spec: PairSpec) -> float:
    force = spec.static_torque / spec.pair.pinion.reference_radius
    return iso_stiffness(spec.pair, tangential_force=force or None).stiffness


def table_stiffness(path: Path, spec: PairSpec) -> Floats:
    """Stiffness samples from a table at the pair's static torque, own centre distance, no misalignment."""
    from fe_ste.table import MeshTable, TableError

    try:
        dataset = MeshTable.open(path).dataset
    except TableError as error:
        raise MeshError(f"pair {spec.name}: {error}; compute the tables first (exugear ste)") from None
    point = dataset.sel(
        torque=spec.static_torque,
        centre_distance=spec.pair.centre_distance,
        misalignment=0.0,
        method="nearest",
    )
    for axis, wanted, tolerance in (
        ("torque", spec.static_torque, 1e-3 * spec.static_torque),
        ("centre_distance", spec.pair.centre_distance, 1e-5),
        ("misalignment", 0.0, 1e-6),
    ):
        if abs(float(point[axis]) - wanted) > tolerance:
            raise MeshError(
                f"pair {spec.name}: {path} has {axis} = {float(point[axis]):g}, the gearbox needs {wanted:g}; "
                "compute the tables of this case again"
            )
    if not bool(np.all(point["converged"])):
        unsolved = int(np.sum(~point["converged"].to_numpy().astype(bool)))
        raise MeshError(f"pair {spec.name}: {path} holds {unsolved} unsolved positions")
    return np.asarray(point["mesh_stiffness"].to_numpy(), dtype=np.float64)
