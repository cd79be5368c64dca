"""Mesh stiffness over the mesh cycle for each pair of a gearbox: from its STE tables or by ISO 6336."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from exugear.model.gearbox import Gearbox
from exugear.model.parts import PairSpec
from exugear.tooth_mesh.placement import MeshError
from exugear.tooth_mesh.tables import fitting_table, table_path
from fe_ste.standards.iso6336 import mesh_stiffness as iso_stiffness
from fe_ste.tools.arrays import Floats
from fe_ste.transmission_error.surface import InterpolationError, SteSurface
from fe_ste.transmission_error.table import TableError


def mesh_stiffness(gearbox: Gearbox, law: str, directory: str | Path | None = None) -> dict[str, Floats | SteSurface]:
    """Stiffness F_bt / STE (N/m) at pmc = 0, 1/n, ... of each pair at work; for the law ``table`` its surface.

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
        A table is missing, holds unsolved positions, or was computed from another input.

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
        return {name: np.array([iso6336_stiffness(spec)]) for name, spec in specs.items()}
    if directory is None:
        raise MeshError(f"mesh law {law!r} needs STE tables: give the directory they were written to")
    read = table_surface if law == "table" else table_stiffness
    return {name: read(gearbox, name, Path(directory)) for name in specs}


def iso6336_stiffness(spec: PairSpec) -> float:
    """Mean mesh stiffness of a pair by ISO 6336-1 method B at its static load, N/m."""
    force = spec.static_torque / spec.pair.pinion.reference_radius
    return iso_stiffness(spec.pair, tangential_force=force or None).stiffness


def table_stiffness(gearbox: Gearbox, name: str, directory: Path) -> Floats:
    """Stiffness samples of a pair from its table, which must have been computed from exactly this case."""
    try:
        point = fitting_table(gearbox, name, directory).static_state
    except TableError as error:
        raise MeshError(f"pair {name}: {error} (exugear ste)") from None
    if not bool(np.all(point["converged"])):
        unsolved = int(np.sum(~point["converged"].to_numpy().astype(bool)))
        raise MeshError(f"pair {name}: {table_path(directory, name)} holds {unsolved} unsolved positions")
    return np.asarray(point["mesh_stiffness"].to_numpy(), dtype=np.float64)


def table_surface(gearbox: Gearbox, name: str, directory: Path) -> SteSurface:
    """Surface through a pair's table over all axes, which must have been computed from exactly this case."""
    try:
        return SteSurface.from_table(fitting_table(gearbox, name, directory, grid=True).dataset)
    except TableError as error:
        raise MeshError(f"pair {name}: {error} (exugear ste --grid)") from None
    except InterpolationError as error:
        raise MeshError(f"pair {name}: {table_path(directory, name)}: {error}") from None
