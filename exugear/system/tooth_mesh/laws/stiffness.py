"""What a mesh law knows of each pair of a gearbox: its stiffness over the mesh cycle, or more of its table."""

from __future__ import annotations

from pathlib import Path

from exugear.gearbox.gearbox import Gearbox
from exugear.system.tooth_mesh.law import MeshCurve
from exugear.system.tooth_mesh.laws.registry import LAWS, law_of
from exugear.system.tooth_mesh.placement import MeshError
from fe_ste.tools.arrays import Floats
from fe_ste.transmission_error.surface import SteSurface


def mesh_stiffness(
    gearbox: Gearbox, law: str, directory: str | Path | None = None
) -> dict[str, Floats | MeshCurve | SteSurface]:
    """Stiffness F_bt / STE (N/m) at pmc = 0, 1/n, ... of each pair at work, as its law knows it.

    The law ``line_of_action`` knows the curve of load over deflection where there is a table, ``table`` its surface.

    Parameters
    ----------
    law : one of `exugear.system.tooth_mesh.laws.registry.MESH_LAWS`; it says whether it needs tables
    directory : results directory with ``tables/<pair>.nc``

    Raises
    ------
    MeshError
        Unknown law; or a table is missing, holds unsolved positions, or was computed from another input.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = mesh_stiffness(gearbox, "iso6336")
    >>> [len(values) for values in stiffness.values()]
    [1, 1, 1, 1]
    """
    if law in LAWS and not LAWS[law].has_force:
        return {}
    reader = law_of(law)
    if LAWS[law].needs_tables and directory is None:
        raise MeshError(f"mesh law {law!r} needs STE tables: give the directory they were written to")
    at_work = {mesh.pair.name for mesh in gearbox.meshes}
    return {name: reader.read(gearbox, name, Path(directory or ".")) for name in gearbox.pairs if name in at_work}
